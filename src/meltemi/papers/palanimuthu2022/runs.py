"""All simulations of the reproduction: the library's 20 MW turbine under its power control."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from meltemi.analyses.performance import performance_of
from meltemi.core.series import TimeSeries
from meltemi.environment.air import Air
from meltemi.environment.grid import PowerGrid
from meltemi.environment.site import STANDARD, Environment
from meltemi.papers.palanimuthu2022 import paper, winds
from meltemi.papers.palanimuthu2022.machine import (
    BLADES,
    CALIBRATED,
    CURVES,
    FORMULA,
    SCALED,
    density,
    rotor,
    turbine,
)
from meltemi.papers.study import Progress, step_progress
from meltemi.power_control.controller import PowerController
from meltemi.power_control.settings import PowerControl
from meltemi.simulation.options import ModelOptions
from meltemi.simulation.result import Result
from meltemi.simulation.rotors import build
from meltemi.simulation.run import Run
from meltemi.simulation.start import Start
from meltemi.tuning.run_store import cells
from meltemi.turbine.power_turbine import PowerTurbine
from meltemi.wind.fields import SteadyWind
from meltemi.wind.turbulent import AnyWind

Float = NDArray[np.float64]

INTERVAL = 100.0
"""[s] length of a step in Figures 6 and 7."""
STEADY = 10.0
"""[m/s] wind of both."""
SETTLING = 50.0
"""[s] initial part of Figures 20 and 21 that is not judged."""
PHYSICAL, LARGE, SMALL = 2.93e9, 4.872e9, 4.872e6
"""[kg m^2] readings of the inertia in Table 1: that of the blades, and the printed digits."""
MIDDLE = 1e9
"""[kg m^2] no reading: with it M1 in dry air has the ratio of the two gains of Figure 6."""
CHANNELS = (
    *("wind_x", "rotor_speed", "pitch_1", "generator_power", "generator_torque", "aerodynamic_power"),
    *("power_state", "air_density", "air_temperature", "humidity"),
)
HUMID = 0.4
"""Relative humidity of Figure 3; that of Figure 6 is constant and not stated."""
HUMIDITIES = (0.2, HUMID, 0.6, 0.8)
"""Further ones of Figure 6."""
RAMPS, TURBULENT = "ramps", "turbulence"
HOT, COLD = Air(temperature=35.0, humidity=0.3), Air(temperature=15.0)
"""Cases ii and i of Figure 20."""
SCHEMES = ("A0", "A1", "A2", "A3")
ANTICIPATION = 2.0
AHEAD = f"A2, {ANTICIPATION:g} s ahead"
"""[s] extrapolation time of the speed in this package's variant of A2; its name."""


@dataclass(frozen=True)
class PowerControlSetup:
    """Extent of the simulations.

    Attributes:
      seeds: turbulence seeds.
      inertias: [kg m^2] rotor inertias for active power control.
      curves: readings of the power coefficient in Figure 6.
      converters: run Figure 6 also with the electrical system, which takes half a minute.
      quick: few and short runs.
    """

    seeds: tuple[int, ...] = (1, 2, 3, 4, 5, 6)
    inertias: tuple[float, ...] = (PHYSICAL, LARGE, SMALL)
    curves: tuple[str, ...] = CURVES
    converters: bool = True
    quick: bool = False


QUICK = PowerControlSetup(seeds=(1,), inertias=(PHYSICAL,), curves=(FORMULA, SCALED), converters=False, quick=True)
"""A look at everything in little time; its numbers are too few to judge by."""


class Reading(NamedTuple):
    """Assumptions that Figure 6 leaves open: coefficient, humidity, inertia [kg m^2], electrical parts."""

    model: str
    humidity: float = 0.0
    inertia: float = PHYSICAL
    converters: bool = False


PLAIN, CONVERTERS = Reading(FORMULA), Reading(FORMULA, converters=True)


@dataclass(frozen=True)
class Steps:
    """A run of Figure 6 or 7.

    Attributes:
      model: model of the power coefficient.
      air: air of the densities that cases i, ii, iii assume.
      results: results by case.
      levels: temperatures [degC] or humidities after the lead-in, by interval.
      lead: [s] duration of the lead-in.
    """

    model: str
    humidity: float
    inertia: float
    results: Mapping[str, Result]
    levels: tuple[float, ...]
    lead: float

    def settled(self, case: str, channel: str, of: Callable[[Result], Float] | None = None) -> Float:
        """(levels,) means over the last tenth of each interval."""
        result = self.results[case]
        series = result[channel] if of is None else of(result)
        ends = self.lead + INTERVAL * np.arange(1, len(self.levels) + 1)
        return np.array([series[(result.time > e - 0.1 * INTERVAL) & (result.time < e - 0.1)].mean() for e in ends])

    def means(self, case: str, channel: str) -> Float:
        """(levels,) means over each interval."""
        result = self.results[case]
        ends = self.lead + INTERVAL * np.arange(1, len(self.levels) + 1)
        inside = [(result.time > e - INTERVAL) & (result.time < e) for e in ends]
        return np.array([result[channel][i].mean() for i in inside])


@dataclass(frozen=True)
class PowerControlRuns:
    """Results of all simulations.

    Attributes:
      setup: extent of the simulations.
      temperature: Figure 6 by reading.
      humidity: Figure 7.
      climate: Figure 20 by wind and case.
      limited: Figure 21 by model, inertia, wind and scheme; M1 and the variant with anticipation with the physical
        inertia only.
    """

    setup: PowerControlSetup
    temperature: Mapping[Reading, Steps]
    humidity: Steps
    climate: Mapping[tuple[str, str], Result]
    limited: Mapping[tuple[str, float, str, str], Result]


def machine_with(model: str, inertia: float = PHYSICAL) -> PowerTurbine:
    """The library's turbine with a model of its power coefficient and a rotor inertia [kg m^2]."""
    return turbine(model).replace(**{"drivetrain.rotor_inertia": inertia})


def aero_power(result: Result) -> Float:
    """Aerodynamic power [W] of the rotor."""
    return np.asarray(result["aerodynamic_power"])


def ratio(result: Result) -> Float:
    """Tip-speed ratio."""
    return np.asarray(result["rotor_speed"] * paper.RADIUS / result["wind_x"])


def power_ratio(result: Result) -> Float:
    """Power coefficient."""
    area = np.pi * paper.RADIUS**2
    return np.asarray(aero_power(result) / (0.5 * result["air_density"] * area * result["wind_x"] ** 3))


def staircase(levels: Sequence[float], lead: float, first: float) -> TimeSeries:
    """Series of levels of duration ``INTERVAL`` each after a lead-in."""
    edges = lead + INTERVAL * np.arange(len(levels))
    values = np.repeat([first, *levels], 2)
    return TimeSeries(time=np.array([0.0, *np.repeat(edges, 2), edges[-1] + INTERVAL]), value=values)


def _case(  # noqa: PLR0913 - what differs between the figures' runs
    machine: PowerTurbine,
    settings: PowerControl,
    wind: AnyWind,
    air: Air,
    duration: float,
    *,
    speed: float,
    reference: float | None = None,
    options: ModelOptions | None = None,
    name: str,
) -> Run:
    power = min(rotor(FORMULA).gain() * speed**3, reference or np.inf, paper.STATOR_POWER)
    return Run(
        model=build(machine, options, Environment(air=air)),
        wind=wind,
        duration=duration,
        controller=PowerController(machine, performance_of(machine), settings),
        start=Start(rotor_speed=speed, generator_torque=power / speed),
        channels=CHANNELS,
        output_step=0.25,
        grid=None if reference is None else PowerGrid(power_reference=reference),
        name=name,
    )


def _scheme(name: str) -> PowerControl:
    """Settings of a scheme of Figure 21."""
    return PowerControl.model_validate(
        {"density": "weather", "scheme": name[:2], "anticipation": ANTICIPATION if name == AHEAD else 0.0}
    )


def temperature_cases(reading: Reading) -> list[Run]:
    """Figure 6: cases i and ii over the steps of the temperature."""
    model, humidity, inertia, converters = reading
    options = ModelOptions(electrical="averaged") if converters else None
    machine, model_rotor = machine_with(model, inertia), rotor(model)
    first = paper.TEMPERATURES[0]
    air = Air(temperature=staircase(paper.TEMPERATURES, INTERVAL, first), humidity=humidity)
    rho = float(density(first, humidity))
    adapted = "temperature" if humidity == 0.0 else "weather"
    return [
        _case(
            machine,
            PowerControl(density=how),  # type: ignore[arg-type]
            SteadyWind(speed=STEADY),
            air,
            INTERVAL * (1 + len(paper.TEMPERATURES)),
            speed=model_rotor.settled(STANDARD if how == "fixed" else rho, rho) * STEADY / model_rotor.radius,
            options=options,
            name=f"Fig. 6, {model}, humidity {humidity:g}, J {inertia:.4g}, {how}{', converters' if options else ''}",
        )
        for how in ("fixed", adapted)
    ]


def humidity_cases() -> list[Run]:
    """Figure 7: cases i, ii, iii over the steps of the humidity at 35 degrees."""
    machine, formula = machine_with(FORMULA), rotor(FORMULA)
    air = Air(temperature=35.0, humidity=staircase(paper.HUMIDITIES[1:], INTERVAL, 0.0))
    rho = float(density(35.0))
    return [
        _case(
            machine,
            PowerControl(density=how),
            SteadyWind(speed=STEADY),
            air,
            INTERVAL * len(paper.HUMIDITIES),
            speed=formula.settled(1.225 if how == "fixed" else rho, rho) * STEADY / formula.radius,
            name=f"Fig. 7, {how}",
        )
        for how in ("fixed", "temperature", "weather")
    ]


def run_all(setup: PowerControlSetup, *, workers: int | None, progress: Progress) -> PowerControlRuns:
    """Run all simulations of the paper."""
    readings = [Reading(curve) for curve in setup.curves]
    readings += [Reading(curve, humidity, SMALL) for humidity, curve in product((0.0, HUMID), setup.curves)]
    readings += [Reading(FORMULA, humidity) for humidity in HUMIDITIES]
    readings += [Reading(FORMULA, 0.0, j) for j in (LARGE, MIDDLE) if LARGE in setup.inertias]
    readings += [Reading(CALIBRATED, 0.1, SMALL), *([CONVERTERS] if setup.converters else [])]
    steps = [case for reading in readings for case in temperature_cases(reading)]
    moist = humidity_cases()
    hub = turbine().hub_height
    inflow: dict[str, AnyWind] = {RAMPS: winds.ramps()}
    inflow |= {f"{TURBULENT} {seed}": winds.turbulent(hub, seed) for seed in setup.seeds}
    adapted = PowerControl(density="weather", scheme="rated_speed")
    climate = {
        (wind, name): _case(
            machine_with(FORMULA), adapted, inflow[wind], air, winds.LENGTH, speed=0.62, name=f"Fig. 20, {wind}, {name}"
        )
        for wind in (RAMPS, f"{TURBULENT} {setup.seeds[0]}")
        for name, air in (("i", COLD), ("ii", HOT))
    }
    machines = [(FORMULA, PHYSICAL), *((BLADES, inertia) for inertia in setup.inertias)]
    limited = {
        (model, inertia, wind, scheme): _case(
            machine_with(model, inertia),
            _scheme(scheme),
            series,
            COLD,
            winds.LENGTH,
            speed=0.64,
            reference=paper.REFERENCE,
            name=f"Fig. 21, {model}, {wind}, {scheme}, J {inertia:.4g}",
        )
        for model, inertia in machines
        for wind, series in inflow.items()
        for scheme in (*SCHEMES, *([AHEAD] if (model, inertia) == (BLADES, PHYSICAL) else []))
    }
    cases = [*steps, *moist, *climate.values(), *limited.values()]
    results = cells(cases, workers=workers, progress=step_progress(progress, "simulations"))
    at = iter(results)
    temperature = {
        reading: Steps(*reading[:3], {"i": next(at), "ii": next(at)}, paper.TEMPERATURES, INTERVAL)
        for reading in readings
    }
    seven = Steps(FORMULA, 0.0, PHYSICAL, {k: next(at) for k in ("i", "ii", "iii")}, paper.HUMIDITIES, 0.0)
    return PowerControlRuns(
        setup, temperature, seven, {key: next(at) for key in climate}, {key: next(at) for key in limited}
    )
