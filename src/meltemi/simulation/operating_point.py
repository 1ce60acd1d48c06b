"""Steady operation as a record: the state in which runs start, and about which models are linearised."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import InputError
from meltemi.core.shown import Brief
from meltemi.core.yamlfile import validated
from meltemi.simulation.case import Case
from meltemi.simulation.channels import Channel, find
from meltemi.simulation.start import set_actuators
from meltemi.turbine.definition import Turbine
from meltemi.wind.fields import SharedTurbulence, SteadyWind, WindBox, WindSeries, mean_speed
from meltemi.wind.turbulent import AnyWind, TurbulentWind

if TYPE_CHECKING:
    from meltemi.turbine.power_turbine import AnyTurbine

Float = NDArray[np.float64]

SOUND = 340.0
"""[m/s] fastest speed of the blade tips: coefficients of sections are those of incompressible flow."""


@dataclass(frozen=True, repr=False)
class OperatingPoint(Brief):
    """Steady operation in a steady wind.

    Attributes:
      wind: the steady wind.
      rotor_speed: [rad/s] mean speed of the rotor.
      pitch: [rad] mean pitch angle.
      generator_torque: [N m] mean generator torque.
      imbalance: [N m] residual torque on the low-speed shaft; zero when the speed is free and an electrical
        system, if there is one, can supply the torque.
      q, v: coordinates and velocities with blade 1 up.
      aero: states of inflow and stall, and the solver's memory, with blade 1 up.
      revolution: (azimuths, states) q, v and aero in one row, at equal steps of the azimuth from 0.
      means: azimuthal averages of all signals.
      warnings: such as that the motion is unstable.
      azimuth: [rad] azimuth of blade 1 at the start of a run.
    """

    wind: SteadyWind
    rotor_speed: float
    pitch: float
    generator_speed: float
    generator_torque: float
    imbalance: float
    q: Float = field(repr=False)
    v: Float = field(repr=False)
    aero: Float = field(repr=False)
    revolution: Float = field(repr=False)
    means: Float = field(repr=False)
    channels: dict[str, Channel] = field(repr=False)
    places: dict[str, int] = field(repr=False)
    warnings: tuple[str, ...] = ()
    azimuth: float = 0.0

    def facts(self) -> dict[str, str]:
        """The wind, and the operation of the turbine in it, in engineering units."""
        wanted = ("rotor_speed", "pitch_1", "generator_power", "rotor_aero_thrust")
        known = [self.channels[name] for name in wanted if name in self.channels]
        values = {c.name: f"{self[c.name] * c.display_unit[1]:.5g} {c.display_unit[0]}" for c in known}
        return {"wind_speed": f"{self.wind.speed:g} m/s", **values}

    def put(self, case: Case, azimuth: float | None = None) -> None:
        """Write the state at an azimuth [rad] of blade 1 (default: that of the point) into a case of the same model."""
        azimuth = self.azimuth if azimuth is None else azimuth
        set_actuators(case, self.pitch, self.generator_torque)
        case["q"][:], case["v"][:] = self.q, self.v
        case.set_aero_states(self.aero)
        if azimuth:
            # interpolation by the Fourier series of the stored azimuths; the generator rotates with the rotor
            n = len(self.revolution)
            weight = np.exp(1j * azimuth * np.arange(n // 2 + 1)) / n
            weight[1 : (n + 1) // 2] *= 2.0
            state = (weight @ np.fft.rfft(self.revolution, axis=0)).real
            case["q"][:], case["v"][:], air = np.split(state, [len(self.q), 2 * len(self.q)])
            case.set_aero_states(air)
            case["q"][case.model.rows.generator] += azimuth

    def __getitem__(self, name: str) -> float:
        """Azimuthal average of a channel, by meltemi's name or OpenFAST's, in SI units."""
        return float(self.means[self.places[find(name, self.channels).name]])


def check_prescribed(what: str, turbine: AnyTurbine, rotor_speed: float | None, pitch: float | None) -> None:
    """Refuse a rotor speed [rad/s] or pitch [rad] beyond any range, as one in rpm or in degrees is."""
    if rotor_speed is not None:
        if not rotor_speed > 0.0:
            other = "; use meltemi.analysis.parked_point for parked or idling rotors"
            bladed = isinstance(turbine, Turbine)
            raise InputError(f"{what}: rotor_speed must be above zero, found {rotor_speed!r}{other if bladed else ''}")
        if not (tip := rotor_speed * turbine.rotor_radius) <= SOUND:
            raise InputError(
                f"{what}: at a rotor speed of {rotor_speed:g} rad/s, {30.0 / np.pi * rotor_speed:.4g} rpm, the blade "
                f"tips would be faster than sound ({tip:.4g} m/s)"
            )
    if pitch is not None and not abs(pitch) <= np.pi:
        raise InputError(f"{what}: pitch {pitch:g} rad is not between -pi and pi; from degrees: math.radians")


class NotConverged(InputError):
    """A search for steady operation that did not converge."""


def steady_wind(wind: float | AnyWind, hub_height: float) -> SteadyWind:
    """The steady wind at the start of a wind, of a turbulent wind its mean (of any seed), or that of a speed [m/s]."""
    if isinstance(wind, (int, float)):
        return validated({"speed": wind}, SteadyWind, "wind")
    if isinstance(wind, SteadyWind):
        return wind
    if isinstance(wind, SharedTurbulence | WindBox) and wind.mean is not None:
        return wind.mean
    if isinstance(wind, TurbulentWind):
        return SteadyWind(**{name: getattr(wind, name) for name in SteadyWind.model_fields if hasattr(wind, name)})
    speed = mean_speed(wind, hub_height)
    if isinstance(wind, WindSeries):
        upflow = float(np.clip(np.arctan2(wind.vertical[0], speed), -0.99, 0.99))
        begin = {"speed": speed, "shear_exponent": wind.exponent[0], "direction": wind.direction[0], "upflow": upflow}
        return validated(begin, SteadyWind, f"{wind.label}, the wind at its start")
    assert isinstance(wind, WindBox)
    rows = wind.bottom + wind.dz * np.arange(wind.velocity.shape[1])
    profile = wind.velocity[..., 0].mean(axis=(0, 2), dtype=np.float64)
    slope = float(np.polyfit(np.log(rows), np.log(np.maximum(profile, 0.1)), 1)[0])
    mean = {"speed": speed, "shear_exponent": float(np.clip(slope, -0.5, 0.9)), "direction": wind.direction}
    return validated(mean, SteadyWind, f"{wind.label}, its mean")


def no_balance(wind_speed: float, rain: str = "") -> InputError:
    """Error for a wind that does not turn the rotor; ``rain`` adds the effect of rain."""
    return InputError(
        f"no steady operation at a wind speed of {wind_speed:g} m/s: the wind does not turn the rotor against the "
        f"generator{rain}. Use {'less rain or ' if rain else ''}a higher wind speed, or another start: in a case "
        "file start: standstill with controller: {kind: supervised}; in Python start=Start(rotor_speed=..., pitch=...)"
        ", or for operating_point rotor_speed and pitch"
    )
