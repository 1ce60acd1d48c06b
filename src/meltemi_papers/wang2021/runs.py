"""All simulations of the reproduction."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

from meltemi.control.supervisor.settings import Supervision
from meltemi.control.supervisor.supervised import SupervisedController
from meltemi.control.supervisor.threshold import YawProtection
from meltemi.environment.site import Environment
from meltemi.simulation.events import Request
from meltemi.simulation.options import ModelOptions
from meltemi.simulation.result import Result
from meltemi.simulation.rotors import build
from meltemi.simulation.run import Run
from meltemi.simulation.start import Start
from meltemi.studies.run_store import FailedResult, attempt, cells
from meltemi.turbine.definition import Turbine
from meltemi_papers.study import Progress, span, told
from meltemi_papers.wang2021 import winds
from meltemi_papers.wang2021.gust import DERATE, IGNORE, SHORT, STOP, Gust
from meltemi_papers.wang2021.loads import CHANNELS
from meltemi_papers.wang2021.machines import LIMITED, measured_turbine, prompt_yaw, strategy, studied_turbine
from meltemi_papers.wang2021.table2 import Calibration, Table2, calibrate, simulate_bins

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
      quick: a small grid of gusts.
    """

    seeds: tuple[int, ...] = (1, 2, 3, 4, 5, 6)
    period: float = 600.0
    limit_seeds: tuple[int, ...] = (1, 2)
    quick: bool = False


QUICK = Setup(seeds=(1,), period=60.0, limit_seeds=(1,), quick=True)
"""A look at everything in little time; its numbers are too few to judge by."""


@dataclass(frozen=True)
class Runs:
    """Results of all simulations.

    Attributes:
      setup: how much.
      turbines: measured, and studied.
      calibration: of the measured one.
      tables: Table 2, as scaled and calibrated.
      start_up, power_stage: V1 and V2 of the calibrated turbine, by seed.
      gust: Figures 9 and 10.
    """

    setup: Setup
    turbines: tuple[Turbine, Turbine] = field(repr=False)
    calibration: Calibration
    tables: Mapping[str, Table2]
    start_up: tuple[Result, ...] = field(repr=False)
    power_stage: tuple[Result, ...] = field(repr=False)
    gust: Gust


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
    tell = told(span(progress, 0.85, 0.12), "V1 and V2")
    both = attempt("V1 and V2", validation, turbine, calibration, setup.seeds, workers, tell)
    one, two = (both, both) if isinstance(both, FailedResult) else both
    gust = attempt("gust", run_gust, studied, workers, told(span(progress, 0.97, 0.03), "gust with direction change"))
    return Runs(setup, (turbine, studied), calibration, tables, one, two, gust)


def validation(
    turbine: Turbine,
    calibration: Calibration,
    seeds: tuple[int, ...],
    workers: int | None,
    progress: Callable[[float], None],
) -> tuple[tuple[Result, ...], tuple[Result, ...]]:
    """V1, a start-up from idling without yaw; V2, production with yaw and a stop."""
    machine, air = calibration.turbine(turbine), Environment(air_density=calibration.air_density)
    still = build(machine, ModelOptions(), air)
    turning = build(machine, ModelOptions(yaw="driven"), air)
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


def run_gust(studied: Turbine, workers: int | None, progress: Callable[[float], None]) -> Gust:
    """The strategies in the gust with direction change."""
    model = build(studied, ModelOptions(yaw="driven"))
    wind = winds.gust(studied)
    protections = {
        STOP: YawProtection(strategy="stop"),
        DERATE: YawProtection(strategy="derate", recheck_time=RECHECK, power_limit=LIMITED),
        IGNORE: YawProtection(strategy="ignore"),
        SHORT: YawProtection(strategy="derate", recheck_time=SHORT_RECHECK, power_limit=LIMITED),
    }
    cases = [
        Run(
            model=model,
            wind=wind,
            duration=GUST_LENGTH,
            controller=strategy(studied, protection, prompt_yaw()),
            channels=SHOWN,
            name=name,
        )
        for name, protection in protections.items()
    ]
    found = cells(cases, workers=workers, progress=progress)
    return Gust(dict(zip(protections, found, strict=True)))
