"""All simulations of the reproduction."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from itertools import product

import numpy as np

from meltemi.control.supervisor.settings import Supervision
from meltemi.control.supervisor.supervised import SupervisedController
from meltemi.control.supervisor.threshold import YawProtection
from meltemi.simulation.events import Request
from meltemi.simulation.operating_point import OperatingPoint
from meltemi.simulation.options import ModelOptions
from meltemi.simulation.result import Result
from meltemi.simulation.rotors import build
from meltemi.simulation.run import Run
from meltemi.simulation.start import Start
from meltemi.simulation.trim import operating_point
from meltemi.turbine.definition import Turbine
from meltemi_papers.study import Progress, span, told
from meltemi_papers.wang2021 import winds
from meltemi_papers.wang2021.gust import DERATE, IGNORE, MACHINE, SHORT, STOP, Gust, Gusts
from meltemi_papers.wang2021.machines import (
    LIMITED,
    YAW_CONTROLS,
    gust_machines,
    measured_turbine,
    strategy,
    studied_turbine,
)
from meltemi_papers.wang2021.table2 import Calibration, Table2, calibrate, simulate_bins
from meltemi_studies.machine_loads import CHANNELS
from meltemi_tuning.run_store import FailedResult, attempt, cells

AS_SCALED, CALIBRATED = "as scaled", "calibrated"
YAW_RATE = float(np.radians(0.5))
"""[rad/s] by default; the paper gives none."""
RECHECK, SHORT_RECHECK = 90.0, 30.0
"""[s] of the strategy, and of the run that must end in a stop."""
GUST_LENGTH, START_UP_LENGTH, POWER_LENGTH, STOP_AT = 100.0, 240.0, 480.0, 430.0
"""[s]."""
SHOWN = (
    *("wind_x", "wind_y", "rotor_speed", "pitch_1", "generator_power", "generator_torque", "nacelle_yaw"),
    *("operating_state", "power_setpoint", "yaw_error", "yaw_threshold", "tip_clearance_1"),
    *CHANNELS,
)


@dataclass(frozen=True)
class Setup:
    """Extent of the simulations.

    Attributes:
      seeds: of turbulence.
      period: [s] of a run of Table 2, after its transient.
      limit_seeds: of the search for base points.
      phases: azimuths of the rotor in the gust, over the 120 degrees from blade to blade.
      quick: a small grid of gusts.
    """

    seeds: tuple[int, ...] = (1, 2, 3, 4, 5, 6)
    period: float = 600.0
    limit_seeds: tuple[int, ...] = (1, 2)
    phases: int = 6
    quick: bool = False


QUICK = Setup(seeds=(1,), period=60.0, limit_seeds=(1,), phases=2, quick=True)
"""A look at everything in little time; its numbers are too few to judge by."""


@dataclass(frozen=True)
class Runs:
    """Results of all simulations.

    Attributes:
      setup: how much.
      turbines: measured, and that studied beyond the paper.
      calibration: of the measured one.
      tables: Table 2, as scaled and calibrated.
      start_up, power_stage: V1 and V2 of the calibrated turbine, by seed.
      gusts: Figures 9 and 10.
      recheck: derating in the gust with a recheck while the error is still beyond the threshold.
    """

    setup: Setup
    turbines: tuple[Turbine, Turbine] = field(repr=False)
    calibration: Calibration
    tables: Mapping[str, Table2]
    start_up: tuple[Result, ...] = field(repr=False)
    power_stage: tuple[Result, ...] = field(repr=False)
    gusts: Gusts
    recheck: Result = field(repr=False)


def run_all(setup: Setup, *, workers: int | None, progress: Progress) -> Runs:
    """Run all simulations of the paper."""
    turbine, studied = measured_turbine(), studied_turbine(YAW_RATE)

    calibration = attempt(
        "calibration",
        calibrate,
        turbine,
        setup.seeds,
        period=setup.period,
        workers=workers,
        progress=told(span(progress, 0.0, 0.25), "calibration"),
    )
    tables = {}
    for i, (name, each) in enumerate(((AS_SCALED, Calibration()), (CALIBRATED, calibration))):
        tables[name] = attempt(
            f"Table 2, {name}",
            simulate_bins,
            turbine,
            each,
            winds.measured(),
            setup.seeds,
            period=setup.period,
            workers=workers,
            progress=told(span(progress, 0.25 + 0.3 * i, 0.3), f"Table 2, {name}"),
        )
    tell = told(span(progress, 0.85, 0.05), "V1 and V2")
    both = attempt("V1 and V2", validation, turbine, calibration, setup.seeds, workers, tell)
    one, two = (both, both) if isinstance(both, FailedResult) else both
    tell = told(span(progress, 0.9, 0.1), "gust with direction change")
    pair = attempt("gust", run_gusts, setup.phases, workers, tell)
    gusts, recheck = (pair, pair) if isinstance(pair, FailedResult) else pair
    return Runs(setup, (turbine, studied), calibration, tables, one, two, gusts, recheck)


def validation(
    turbine: Turbine,
    calibration: Calibration,
    seeds: tuple[int, ...],
    workers: int | None,
    progress: Callable[[float], None],
) -> tuple[tuple[Result, ...], tuple[Result, ...]]:
    """V1, a start-up from idling without yaw; V2, production with yaw and a stop."""
    machine = calibration.turbine(turbine)
    still, turning = build(machine), build(machine, ModelOptions(yaw="driven"))
    cases = [
        Run(
            model=still,
            wind=lambda seed=seed: winds.start_up(machine, seed, START_UP_LENGTH),  # type: ignore[misc]
            duration=START_UP_LENGTH,
            controller=SupervisedController(machine, Supervision(start_time=0.0)),
            start=Start(pitch=machine.pitch_actuator.maximum),
            channels=SHOWN,
            name=f"V1, seed {seed}",
        )
        for seed in seeds
    ]
    cases += [
        Run(
            model=turning,
            wind=lambda seed=seed: winds.power_stage(machine, seed, POWER_LENGTH),  # type: ignore[misc]
            duration=POWER_LENGTH,
            controller=strategy(machine, YawProtection()),
            events=(Request(at=STOP_AT, request="normal_stop"),),
            channels=SHOWN,
            name=f"V2, seed {seed}",
        )
        for seed in seeds
    ]
    found = cells(cases, workers=workers, progress=progress)
    return tuple(found[: len(seeds)]), tuple(found[len(seeds) :])


def run_gusts(phases: int, workers: int | None, progress: Callable[[float], None]) -> tuple[Gusts, Result]:
    """The strategies in the gust with direction change, and a recheck that comes too early."""
    protections = {
        STOP: YawProtection(strategy="stop"),
        DERATE: YawProtection(strategy="derate", recheck_time=RECHECK, power_limit=LIMITED),
        IGNORE: YawProtection(strategy="ignore"),
        SHORT: YawProtection(strategy="derate", recheck_time=SHORT_RECHECK, power_limit=LIMITED),
    }
    models = {name: build(turbine, ModelOptions(yaw="driven")) for name, turbine in gust_machines(YAW_RATE).items()}
    winds_of = {name: winds.gust(model.turbine) for name, model in models.items()}
    starts = {
        name: attempt(f"steady operation, {name}", operating_point, model, winds_of[name])
        for name, model in models.items()
    }
    keys = [
        (machine, average, phase, name)
        for machine, average, phase in product(models, YAW_CONTROLS, range(phases))
        for name in (STOP, DERATE, IGNORE)
    ]
    keys.append((MACHINE, max(YAW_CONTROLS), 0, SHORT))
    cases = [
        Run(
            model=models[machine],
            wind=winds_of[machine],
            duration=GUST_LENGTH,
            controller=strategy(models[machine].turbine, protections[name], YAW_CONTROLS[average]),
            channels=SHOWN,
            start=at_azimuth(starts[machine], 2.0 * np.pi / 3.0 * phase / phases),
            name=f"{name}, {machine}, average {average:g} s, phase {phase}",
        )
        for machine, average, phase, name in keys
    ]
    found = dict(zip(keys, cells(cases, workers=workers, progress=progress), strict=True))
    gusts = {
        (machine, average): [
            Gust({name: found[machine, average, phase, name] for name in (STOP, DERATE, IGNORE)})
            for phase in range(phases)
        ]
        for machine, average in product(models, YAW_CONTROLS)
    }
    return Gusts(gusts), found[keys[-1]]


def at_azimuth(point: OperatingPoint, azimuth: float) -> OperatingPoint:
    """An operating point, if there is one, at an azimuth [rad] of blade 1."""
    return point if isinstance(point, FailedResult) else replace(point, azimuth=azimuth)
