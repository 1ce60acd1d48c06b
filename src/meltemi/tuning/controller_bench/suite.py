"""The suite of the test bench: situations with their winds, seeds and plants, and the limits of the verdicts.

The seeds of its turbulence are used nowhere else in meltemi: no controller was tuned in these winds.
Reference: docs/guide/controller-bench.md.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

from pydantic import Field

from meltemi.core.record import Record
from meltemi.iec.models import iec_wind
from meltemi.supervisor.settings import OVER_SPEED
from meltemi.tuning.controller_bench.margins import GAIN_MARGIN, PHASE_MARGIN
from meltemi.turbine.definition import Turbine
from meltemi.turbine.icing import Icing, with_ice
from meltemi.wind.fields import SteadyWind
from meltemi.wind.turbulent import AnyWind

FIRST_SEED = 7_400_000
"""All seeds of the suite follow it; tuning and studies of meltemi use numbers below a million."""
Group = Literal["production", "extreme", "robustness", "operation"]
SPEEDS = tuple(float(v) for v in range(4, 25, 2))
EVENT = 60.0
"""[s] time of gusts, faults and requests."""
MISTUNING = 0.2
"""Fraction by which inertia and stiffness of the plant differ from those of the design."""


@dataclass(frozen=True, eq=False)
class Situation:
    """Cases that differ in wind speed, sign and seed only.

    Attributes:
      name: name in tables.
      about: description in one line.
      group: section of the results.
      wind: model of IEC 61400-1, or ``steady``.
      speeds: [m/s] wind speeds.
      seeds: number of turbulent winds at each speed; 0 without turbulence.
      duration: [s] evaluated.
      transient: [s] before, not evaluated.
      senses: signs of a change of direction.
      events: events of the run, as keys and values.
      inertia, stiffness: factors of the plant on those of the turbine for which the controller is tuned.
      iced: ice on all blades of the plant.
      frequency: [rad/s] natural frequency of the plant's pitch actuators, second order.
      delay: [s] between the pitch demand and the actuator.
      noise: factor on the standard deviations ``NOISE`` of the sensors.
      starts: begins with an idling rotor.
    """

    name: str
    about: str
    group: Group
    wind: str
    speeds: tuple[float, ...]
    seeds: int = 0
    duration: float = 600.0
    transient: float = 60.0
    senses: tuple[Literal[1, -1], ...] = ()
    events: tuple[dict[str, Any], ...] = ()
    inertia: float = 1.0
    stiffness: float = 1.0
    iced: bool = False
    frequency: float = 0.0
    delay: float = 0.0
    noise: float = 0.0
    starts: bool = False

    @property
    def settling(self) -> float:
        """[s] excluded from the evaluation; a start is evaluated from its beginning."""
        return 0.0 if self.starts else self.transient

    def plant(self, turbine: Turbine) -> Turbine:
        """The turbine on which the controller runs; controllers are tuned for the nominal one."""
        plant = mistuned(turbine, self.inertia, self.stiffness)
        if self.frequency:
            changes = {"kind": "second_order", "natural_frequency": self.frequency, "damping_ratio": 0.7}
            plant = plant.replace(**{f"pitch_actuator.{key}": value for key, value in changes.items()})
        return with_ice(plant, Icing()) if self.iced else plant


@dataclass(frozen=True)
class BenchCase:
    """One wind of a situation.

    Attributes:
      situation: situation of the case.
      speed: [m/s] mean wind speed at hub height.
      seed: seed of the turbulence; None without it.
      sign: sign of a change of direction.
    """

    situation: Situation
    speed: float
    seed: int | None = None
    sign: Literal[1, -1] | None = None

    @property
    def name(self) -> str:
        """Unique, such as ``normal turbulence, 12 m/s, seed 7400013``."""
        parts = [self.situation.name, f"{self.speed:g} m/s"]
        parts += [] if self.seed is None else [f"seed {self.seed}"]
        parts += [] if self.sign is None else [f"{'+' if self.sign > 0 else '-'} direction"]
        return ", ".join(parts)

    @property
    def duration(self) -> float:
        """[s] simulated."""
        return self.situation.settling + self.situation.duration

    def wind(self, turbine: Turbine, wind_class: str) -> AnyWind:
        """The wind of the case; turbulence is generated later."""
        model = self.situation.wind
        if model == "steady":
            return SteadyWind(speed=self.speed, shear_exponent=0.2)
        given: dict[str, Any] = {"seed": self.seed} if self.seed is not None else {"begin": EVENT}
        if self.sign is not None:
            given["sign"] = self.sign
        return iec_wind(model, turbine=turbine, wind_class=wind_class, speed=self.speed, **given)


def cases_of(suite: Sequence[Situation]) -> Iterator[BenchCase]:
    """All cases of a suite. Situations at the same speed have the same seeds, whatever the model of the turbulence."""
    for situation in suite:
        for speed in situation.speeds:
            for sign in situation.senses or (None,):
                for k in range(situation.seeds) if situation.seeds else (None,):
                    seed = None if k is None else FIRST_SEED + 100 * round(speed) + k
                    yield BenchCase(situation, speed, seed, sign)


def mistuned(turbine: Turbine, inertia: float, stiffness: float) -> Turbine:
    """A turbine with other masses and stiffnesses: of the blades, the generator's inertia, shaft and tower."""
    if inertia == stiffness == 1.0:
        return turbine
    factors = {"mass": inertia, "inertia": inertia, "stiffness": stiffness}
    changes: dict[str, Any] = {
        "drivetrain.generator_inertia": inertia * turbine.drivetrain.generator_inertia,
        "drivetrain.stiffness": stiffness * turbine.drivetrain.stiffness,
    }
    for path, part in (("blade.structure", turbine.blade.structure), ("tower", turbine.tower)):
        for name in type(part).model_fields:
            words = name.split("_")
            kind = next((k for k in factors if k in words), None)
            value = getattr(part, name)
            masses = path == "tower" and kind != "stiffness"  # the tower keeps its mass
            if kind and value is not None and name not in ("top_mass", "mass_centre_x", "mass_centre_y") and not masses:
                changes[f"{path}.{name}"] = factors[kind] * value
    return turbine.replace(**changes)


def _at(kind: str, **more: Any) -> tuple[dict[str, Any], ...]:
    return ({"at": EVENT, "type": kind, **more},)


def suite_of(turbine: Turbine, *, quick: bool = False) -> tuple[Situation, ...]:
    """The suite for a turbine: that of the documentation, at the wind speeds at which the turbine operates.

    Args:
      turbine: gives cut-in and cut-out wind speed, and the offset of the speed sensor.
      quick: fewer speeds and seeds, and shorter runs.
    """
    robust: dict[str, Any] = {"group": "robustness", "wind": "NTM", "speeds": (8.0, 18.0), "seeds": 3}
    robust["duration"] = 300.0
    bias = 0.01 * turbine.control.pitch.reference_speed
    gust: dict[str, Any] = {"group": "extreme", "duration": 60.0, "transient": 50.0}
    operation: dict[str, Any] = {"group": "operation", "wind": "steady", "duration": 90.0, "transient": 50.0}
    full = (
        Situation("normal turbulence", "NTM", "production", "NTM", SPEEDS, 6),
        Situation("extreme turbulence", "ETM", "extreme", "ETM", (12.0, 18.0, 24.0), 3),
        Situation("gust", "extreme operating gust (EOG)", wind="EOG", speeds=(12.0, 18.0, 24.0), **gust),
        Situation("gust with direction change", "ECD", wind="ECD", speeds=(10.0, 12.0, 14.0), senses=(1, -1), **gust),
        Situation("direction change", "EDC", wind="EDC", speeds=(12.0, 24.0), senses=(1, -1), **gust),
        Situation("sensor noise", "white noise on all sensors", noise=1.0, **robust),
        Situation(
            "sensor bias",
            "generator speed 1 % too high",
            events=({"at": 0.0, "type": "sensor_offset", "sensor": "generator_speed", "offset": bias},),
            **robust,
        ),
        Situation("actuator delay", "pitch demands arrive 0.2 s late", delay=0.2, **robust),
        Situation("actuator lag", "pitch actuators of 4 rad/s, damping ratio 0.7", frequency=4.0, **robust),
        Situation("blade stuck", "blade 2 keeps its pitch from 60 s on", events=_at("pitch_stuck", blade=2), **robust),
        Situation("inertia +20 %", "blades and generator heavier", inertia=1.0 + MISTUNING, **robust),
        Situation("inertia -20 %", "blades and generator lighter", inertia=1.0 - MISTUNING, **robust),
        Situation("stiffness +20 %", "blades, tower and shaft stiffer", stiffness=1.0 + MISTUNING, **robust),
        Situation("stiffness -20 %", "blades, tower and shaft softer", stiffness=1.0 - MISTUNING, **robust),
        Situation("icing", "ice on all blades", iced=True, **robust),
        Situation("start", "from idling", speeds=(8.0, 20.0), starts=True, **operation | {"duration": 140.0}),
        Situation("normal stop", "", speeds=(12.0, 24.0), events=_at("request", request="normal_stop"), **operation),
        Situation(
            "emergency stop", "", speeds=(12.0, 24.0), events=_at("request", request="emergency_stop"), **operation
        ),
        Situation("grid loss", "no torque from 60 s on", speeds=(12.0, 24.0), events=_at("grid_loss"), **operation),
    )
    low, high = turbine.cut_in, turbine.cut_out
    inside = [replace(s, speeds=tuple(v for v in s.speeds if low <= v < high)) for s in full]
    kept = [s for s in inside if s.speeds]
    return tuple(_quick(s) for s in kept) if quick else tuple(kept)


def _quick(s: Situation) -> Situation:
    """Three speeds, one of them just above rated, and three seeds in production; one speed and one seed elsewhere."""
    if s.group == "production":
        few = s.speeds[2::3] if len(s.speeds) > 5 else s.speeds[-2:]
        return replace(s, speeds=few, seeds=3, duration=120.0, transient=40.0)
    short: dict[str, Any] = {"duration": 80.0, "transient": 40.0} if s.seeds else {}
    return replace(s, speeds=s.speeds[-1:], senses=s.senses[:1], seeds=min(s.seeds, 1), **short)


class BenchLimits(Record):
    """Limits of the verdicts of a test bench."""

    over_speed: float = Field(default=OVER_SPEED, gt=1.0)
    """Largest generator speed over its reference in all cases with a grid; by default that at which the supervisor
    stops the turbine."""
    grid_loss_speed: float = Field(default=1.25, gt=1.0)
    """Largest generator speed over its reference after a grid loss."""
    clearance: float = Field(default=0.3, ge=0.0, lt=1.0)
    """Smallest tower clearance over that of the undeflected blade."""
    phase_margin: float = Field(default=PHASE_MARGIN, ge=0.0, lt=3.2)
    """[rad] phase margin of the speed loop at each wind speed."""
    gain_margin: float = Field(default=GAIN_MARGIN, ge=1.0)
    """Factor on the gain of the speed loop at each wind speed; 2 is 6 dB."""
    delay_margin: float = Field(default=0.2, ge=0.0)
    """[s] additional delay of the speed loop at each wind speed."""
    energy_loss: float = Field(default=0.01, ge=0.0)
    """Relative loss of annual energy against the reference."""
    load_increase: float = Field(default=0.05, ge=0.0)
    """Relative increase of each lifetime equivalent load against the reference."""
    extreme_increase: float = Field(default=0.1, ge=0.0)
    """Relative increase of each extreme load against the reference."""
    pitch_travel: float = Field(default=math.radians(2.0), gt=0.0)
    """[rad/s] mean pitch rate in production."""
    stop_time: float = Field(default=60.0, gt=0.0)
    """[s] time from a request to stop to 20 % of the reference speed."""


NOISE = {
    "generator_speed": 2e-3,
    "rotor_speed": 2e-3,
    "power": 5e-3,
    "pitch": math.radians(0.05),
    "out_of_plane_moment": 0.01,
    "in_plane_moment": 0.01,
    "wind_speed": 0.5,
    "wind_direction": math.radians(2.0),
    "fore_aft_acceleration": 0.02,
    "side_side_acceleration": 0.02,
}
"""Standard deviations of the sensors: of speeds, power and moments as a share of the present value, otherwise in SI."""
RELATIVE = ("generator_speed", "rotor_speed", "power", "out_of_plane_moment", "in_plane_moment")
