"""Power and loads in turbulence over wind speed, air density, ice and rain."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import InputError
from meltemi.environment.rain import Rain
from meltemi.environment.site import STANDARD, Environment
from meltemi.iec.winds import ntm
from meltemi.postprocess.fatigue import equivalent_loads
from meltemi.simulation.bladed.rotor import BladedModel
from meltemi.simulation.operating_point import OperatingPoint
from meltemi.simulation.options import ModelOptions
from meltemi.simulation.result import Result
from meltemi.simulation.rotors import build
from meltemi.simulation.run import Run
from meltemi.simulation.trim import operating_point
from meltemi.tuning.run_store import FailedResult, FailedResultError, cells
from meltemi.turbine.definition import Turbine
from meltemi.turbine.icing import Icing, with_ice
from meltemi.turbulence.field import generate_field

Float = NDArray[np.float64]
Progress = Callable[[float, str], None]
"""Called with the completed fraction and the current step."""

ROOT, IN_PLANE = "root_moment_out_of_plane_1", "root_moment_in_plane_1"
TOWER, SIDE = "tower_base_moment_fore_aft", "tower_base_moment_side_side"
SLOPES = {ROOT: 10.0, IN_PLANE: 10.0, TOWER: 4.0, SIDE: 4.0}
"""Slopes of the S-N curves of glass fibre and welded steel."""
CLEAN, ICED, SHED, WET = "clean", "ice on all blades", "ice shed by one blade", "rain of 32 mm/h"
RAIN = Rain(kind="rainstorm")
"""Rain of the state ``WET``."""
FULL = 0.99
"""Share of rated power from which the pitch gives way: what rain takes then is not missed."""
FAST = ModelOptions(flap_modes=2, edge_modes=1, torsion_modes=1, fore_aft_modes=1, side_side_modes=1)
"""Fewer modes than usual: the tower's loads are 7 to 10 % lower than with all of them, other loads 2 %."""
RATED_STEPS = 10
"""Halvings of the search for rated wind."""


@dataclass(frozen=True)
class ResponseSetup:
    """Extent of the simulations.

    Attributes:
      speeds: [m/s] mean winds, IEC normal turbulence of class IB.
      densities: [kg/m^3] three ascending air densities.
      icing_density, rain_density: [kg/m^3] air densities for simulations with ice and rain.
      seeds: turbulence seeds; all conditions have the same winds.
      begin, length: [s] initial transient, and evaluated length.
      points: grid points of the field in each direction.
      states: conditions other than clean blades in dry air.
      options: model options.
      wind_class: wind class of IEC 61400-1.
    """

    speeds: tuple[float, ...] = (4.0, 6.0, 8.0, 9.5, 11.0, 12.5, 14.0, 17.0, 20.0, 24.0)
    densities: tuple[float, ...] = (1.0, 1.15, 1.3)
    icing_density: float = 1.3
    rain_density: float = 1.15
    seeds: tuple[int, ...] = (1, 2, 3, 4, 5, 6)
    begin: float = 30.0
    length: float = 600.0
    points: int = 21
    states: tuple[str, ...] = (ICED, SHED, WET)
    options: ModelOptions = FAST
    wind_class: str = "IB"


QUICK = ResponseSetup(speeds=(5.0, 9.0, 12.0, 18.0), seeds=(1, 2), begin=10.0, length=40.0, points=9)


@dataclass(frozen=True)
class WeatherState:
    """Power and loads with ice or in rain, at one air density.

    Attributes:
      density: [kg/m^3] air density.
      power: (speeds, seeds) [W] mean generator power.
      loads: (speeds, seeds) equivalent loads [N m] by channel.
      rated_wind: [m/s] steady wind at which rated power is reached.
    """

    density: float
    power: Float
    loads: Mapping[str, Float]
    rated_wind: float


@dataclass(frozen=True)
class Response:
    """Power and loads of the turbine in all conditions.

    Attributes:
      turbine, setup: turbine, and extent of the simulations.
      power: (densities, speeds, seeds) [W] mean generator power with clean blades.
      below: (densities, speeds, seeds) share of time below rated power.
      loads: (densities, speeds, seeds) equivalent loads [N m] by channel.
      states: results with ice and in rain.
      rated_wind: (densities,) [m/s] steady wind at which rated power is reached.
      points: steady operation over the speeds at standard density.
    """

    turbine: Turbine
    setup: ResponseSetup
    power: Float
    below: Float
    loads: Mapping[str, Float]
    states: Mapping[str, WeatherState]
    rated_wind: Float
    points: tuple[OperatingPoint, ...]


def respond(
    turbine: Turbine,
    setup: ResponseSetup,
    *,
    icing: Icing | None = None,
    workers: int | None = None,
    progress: Progress = lambda share, what: None,
) -> Response:
    """Run all conditions in all winds; a seed with a failed run is excluded everywhere.

    Args:
      turbine: turbine with clean blades.
      icing: ice on the iced blades; by default the defaults of ``Icing``.
      workers: number of threads.
      progress: callback with the completed fraction and the current step.

    Raises:
      FailedResultError: a run failed for every seed.
      InputError: rated power is not reached at any of the speeds.
    """
    models = _models(turbine, setup, icing or Icing())
    progress(0.0, "steady operation")
    starts = {key: {v: operating_point(model, v) for v in setup.speeds} for key, model in models.items()}
    results: list[Float | FailedResult] = []
    winds = [(v, seed) for v in setup.speeds for seed in setup.seeds]
    duration = setup.begin + setup.length
    rated = FULL * turbine.rated_power

    def reduced(result: Result) -> Float:
        part = result.between(setup.begin, duration)
        power, loads = part["generator_power"], equivalent_loads(part, list(SLOPES))
        return np.array([power.mean(), np.mean(power < rated), *(loads[name] for name in SLOPES)])

    channels = ["generator_power", *SLOPES]
    for done, (v, seed) in enumerate(winds):
        progress(0.05 + 0.95 * done / len(winds), f"{v:g} m/s, seed {seed}")
        wind = generate_field(ntm(v, setup.wind_class, seed=seed, points=setup.points), turbine, duration)
        cases = [
            Run(model, wind, duration=duration, channels=channels, start=starts[key][v], name=f"{key[0]}, {key[1]:g}")
            for key, model in models.items()
        ]
        results += cells(cases, reduce=reduced, workers=workers)
    lost = {winds[i // len(models)][1]: value for i, value in enumerate(results) if isinstance(value, FailedResult)}
    if len(lost) == len(setup.seeds):
        raise FailedResultError(next(iter(lost.values())).why)
    setup = replace(setup, seeds=tuple(seed for seed in setup.seeds if seed not in lost))
    kept = [value for i, value in enumerate(results) if winds[i // len(models)][1] not in lost]
    # conditions, quantities, speeds, seeds
    values = np.array(kept).reshape(len(setup.speeds), len(setup.seeds), len(models), -1).transpose(2, 3, 0, 1)
    rated_winds = [rated_wind(model, list(starts[key].values())) for key, model in models.items()]
    n = len(setup.densities)
    clean = values[:n]
    standard = build(turbine, setup.options, Environment(air_density=STANDARD))
    return Response(
        turbine=turbine,
        setup=setup,
        power=clean[:, 0],
        below=clean[:, 1],
        loads={name: clean[:, 2 + i] for i, name in enumerate(SLOPES)},
        states={
            name: WeatherState(density, x[0], {load: x[2 + i] for i, load in enumerate(SLOPES)}, wind)
            for (name, density), x, wind in list(zip(models, values, rated_winds, strict=True))[n:]
        },
        rated_wind=np.array(rated_winds[:n]),
        points=tuple(operating_point(standard, v) for v in setup.speeds),
    )


def _models(turbine: Turbine, setup: ResponseSetup, icing: Icing) -> dict[tuple[str, float], BladedModel]:
    """Models by condition and density [kg/m^3]."""
    fast = setup.options
    models = {(CLEAN, density): build(turbine, fast, Environment(air_density=density)) for density in setup.densities}
    cold = Environment(air_density=setup.icing_density)
    for state, on in ((ICED, None), (SHED, tuple(range(2, turbine.n_blades + 1)))):
        if state in setup.states:
            iced = with_ice(turbine, icing.replace(blades=on))
            models[state, setup.icing_density] = build(iced, fast, cold)
    if WET in setup.states:
        wet = Environment(air_density=setup.rain_density, rain=RAIN)
        models[WET, setup.rain_density] = build(turbine, fast, wet)
    return models


def rated_wind(model: BladedModel, points: Sequence[OperatingPoint]) -> float:
    """Rated wind speed [m/s] of a model, interpolated between two operating points."""

    def full(point: OperatingPoint) -> bool:
        return point["generator_power"] > 0.999 * model.turbine.rated_power

    speeds = [point.wind.speed for point in points]
    first = next((i for i, point in enumerate(points) if full(point)), None)
    if not first:
        raise InputError(f"rated power must be reached between {speeds[0]:g} and {speeds[-1]:g} m/s")
    low, high = speeds[first - 1], speeds[first]
    for _ in range(RATED_STEPS):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if full(operating_point(model, middle)) else (middle, high)
    return high
