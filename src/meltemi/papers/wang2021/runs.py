"""All simulations of the reproduction."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import product
from typing import Any

import numpy as np

from meltemi.control.controller import Controller
from meltemi.papers.study import Progress, span, step_progress
from meltemi.papers.wang2021 import winds
from meltemi.papers.wang2021.gust import (
    AT_ONCE,
    DERATE,
    EMERGENCY,
    GENTLE,
    IGNORE,
    INTERPOLATED,
    SHORT,
    SIGNS,
    SLOWED,
    STOP,
    Gust,
    Gusts,
    GustSetting,
)
from meltemi.papers.wang2021.machines import (
    LIMITED,
    YAW_CONTROLS,
    gust_machines,
    measured_turbine,
    slowed,
    studied_turbine,
    with_speed_loop,
)
from meltemi.papers.wang2021.table2 import (
    TRANSIENT,
    Calibration,
    SpeedLoop,
    Table2,
    calibrate,
    choose_speed_loop,
    simulate_bins,
)
from meltemi.simulation.events import BaseEvent, PowerLimit, Request
from meltemi.simulation.operating_point import OperatingPoint
from meltemi.simulation.options import ModelOptions
from meltemi.simulation.result import Result
from meltemi.simulation.rotors import build
from meltemi.simulation.run import Run
from meltemi.simulation.start import Start
from meltemi.simulation.trim import operating_point
from meltemi.studies.machine_loads import CHANNELS
from meltemi.studies.yaw_gusts import STOP_RATE, strategy
from meltemi.supervisor.settings import Supervision
from meltemi.supervisor.supervised import SupervisedController
from meltemi.supervisor.threshold import YawProtection
from meltemi.tuning.run_store import FailedResult, attempt, cells
from meltemi.turbine.definition import Turbine

AS_SCALED, CALIBRATED, EARLY = "as scaled", "calibrated", "calibrated, speed limited early"
TIP_SPEED_RATIO = 10.5
"""Tip-speed ratio of ``EARLY``: the rotor reaches rated speed below rated wind, so there is a speed limit area."""
YAW_RATE = float(np.radians(0.5))
"""[rad/s] default yaw rate; the paper gives none."""
RECHECK, SHORT_RECHECK = 90.0, 30.0
"""[s] recheck times of the strategy, and of the run that must end in a stop."""
GUST_LENGTH, START_UP_LENGTH, POWER_LENGTH, STOP_AT = 100.0, 240.0, 480.0, 430.0
"""[s] durations of the runs, and time of the stop."""
SHOWN = (
    *("wind_x", "wind_y", "rotor_speed", "pitch_1", "generator_power", "generator_torque", "nacelle_yaw"),
    *("operating_state", "power_setpoint", "yaw_error", "yaw_threshold", "tip_clearance_1"),
    *CHANNELS,
)


@dataclass(frozen=True)
class YawProtectionSetup:
    """Extent of the simulations.

    Attributes:
      seeds: turbulence seeds.
      period, transient: [s] evaluated period and initial transient of a run of Table 2.
      limit_seeds: seeds for the search of base points and the choice of the speed loop.
      phases: azimuths of the rotor in the gust, over the 120 degrees from blade to blade.
      averages: [s] averaging times of the yaw control in the gust.
      quick: a small grid of gusts.
    """

    seeds: tuple[int, ...] = (1, 2, 3, 4)
    period: float = 600.0
    transient: float = TRANSIENT
    limit_seeds: tuple[int, ...] = (1, 2)
    phases: int = 4
    averages: tuple[float, ...] = tuple(YAW_CONTROLS)
    quick: bool = False


QUICK = YawProtectionSetup(
    seeds=(1,), period=40.0, transient=30.0, limit_seeds=(1,), phases=1, averages=(max(YAW_CONTROLS),), quick=True
)
"""A look at everything in little time; its numbers are too few to judge by."""


@dataclass(frozen=True)
class YawProtectionRuns:
    """Results of all simulations.

    Attributes:
      setup: extent of the simulations.
      turbines: the measured turbine, and that studied beyond the paper.
      loop: speed loop of the measured turbine.
      calibration: calibration of the measured turbine.
      tables: Table 2, as scaled, calibrated, and calibrated with an early limit of the speed.
      start_up, power_stage: V1 and V2 of the calibrated turbine, by seed.
      gusts: Figures 9 and 10.
      recheck: derating in the gust with a recheck while the error still exceeds the threshold.
    """

    setup: YawProtectionSetup
    turbines: tuple[Turbine, Turbine] = field(repr=False)
    loop: SpeedLoop
    calibration: Calibration
    tables: Mapping[str, Table2]
    start_up: tuple[Result, ...] = field(repr=False)
    power_stage: tuple[Result, ...] = field(repr=False)
    gusts: Gusts
    recheck: Result = field(repr=False)


def run_all(setup: YawProtectionSetup, *, workers: int | None, progress: Progress) -> YawProtectionRuns:
    """Run all simulations of the paper."""
    base, studied = measured_turbine(), studied_turbine(YAW_RATE)

    def more(begin: float, length: float, what: str) -> dict[str, Any]:
        return {"workers": workers, "progress": step_progress(span(progress, begin, length), what)}

    def slower(factor: float) -> Turbine:
        return with_speed_loop(base, factor)

    given = {"period": setup.period, "transient": setup.transient}
    loop = attempt("speed loop", choose_speed_loop, slower, setup.limit_seeds, **given, **more(0.0, 0.08, "speed loop"))
    factor = 1.0 if isinstance(loop, FailedResult) else loop.chosen
    turbine = slower(factor)
    early = with_speed_loop(base, factor, tip_speed_ratio=TIP_SPEED_RATIO)
    calibration = attempt("calibration", calibrate, turbine, setup.seeds, **given, **more(0.08, 0.17, "calibration"))
    tables = {}
    kinds = ((AS_SCALED, turbine, Calibration()), (CALIBRATED, turbine, calibration), (EARLY, early, calibration))
    for i, (name, machine, each) in enumerate(kinds):
        options = more(0.25 + 0.18 * i, 0.18, f"Table 2, {name}")
        tables[name] = attempt(
            f"Table 2, {name}", simulate_bins, machine, each, winds.measured(), setup.seeds, **given, **options
        )
    reported = step_progress(span(progress, 0.79, 0.06), "V1 and V2")
    both = attempt("V1 and V2", validation, turbine, calibration, setup.seeds, workers, reported)
    one, two = (both, both) if isinstance(both, FailedResult) else both
    reported = step_progress(span(progress, 0.85, 0.15), "gust with direction change")
    pair = attempt("gust", run_gusts, gust_machines(YAW_RATE), setup.phases, workers, reported, averages=setup.averages)
    gusts, recheck = (pair, pair) if isinstance(pair, FailedResult) else pair
    return YawProtectionRuns(setup, (turbine, studied), loop, calibration, tables, one, two, gusts, recheck)


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
    one: dict[str, Any] = {"duration": START_UP_LENGTH, "channels": SHOWN}
    one |= {"controller": SupervisedController(machine, Supervision(start_time=0.0))}
    one |= {"start": Start(pitch=machine.pitch_actuator.maximum)}
    two: dict[str, Any] = {"duration": POWER_LENGTH, "channels": SHOWN}
    two |= {"controller": strategy(machine, YawProtection())}
    two |= {"events": (Request(at=STOP_AT, request="normal_stop"),)}
    cases = [
        Run(still, partial(winds.start_up, machine, seed, START_UP_LENGTH), name=f"V1, seed {seed}", **one)
        for seed in seeds
    ]
    cases += [
        Run(turning, partial(winds.power_stage, machine, seed, POWER_LENGTH), name=f"V2, seed {seed}", **two)
        for seed in seeds
    ]
    results = cells(cases, workers=workers, progress=progress)
    return tuple(results[: len(seeds)]), tuple(results[len(seeds) :])


def run_gusts(
    machines: Mapping[str, Turbine],
    phases: int,
    workers: int | None,
    progress: Callable[[float], None],
    *,
    averages: Sequence[float] = tuple(YAW_CONTROLS),
    speed: float = winds.GUST_SPEED,
    limited: float = LIMITED,
) -> tuple[Gusts, Result]:
    """The strategies in the gust with direction change, and a recheck that comes too early.

    Args:
      machines: turbines by name.
      phases: azimuths of the rotor.
      workers, progress: as for batches of runs.
      averages: [s] averaging times of the yaw control.
      speed: [m/s] wind speed before the gust.
      limited: [W] power limit of the derating.
    """
    protections = {
        STOP: YawProtection(strategy="stop", law="stepwise"),  # the paper's law before its optimisation
        INTERPOLATED: YawProtection(strategy="stop"),
        GENTLE: YawProtection(strategy="stop", law="stepwise"),
        DERATE: YawProtection(strategy="derate", recheck_time=RECHECK, power_limit=limited),
        AT_ONCE: YawProtection(strategy="derate", recheck_time=RECHECK, power_limit=limited, derate_rate=100.0),
        IGNORE: YawProtection(strategy="ignore"),
        SHORT: YawProtection(strategy="derate", recheck_time=SHORT_RECHECK, power_limit=limited),
    }
    models = {name: build(turbine, ModelOptions(yaw="driven")) for name, turbine in machines.items()}
    inflow = {
        (name, sign, time): winds.gust(turbine, sign, time, speed)
        for (name, turbine), sign, time in product(machines.items(), SIGNS, winds.TIMES)
    }
    starts = {
        name: attempt(f"steady operation, {name}", operating_point, model, inflow[name, 1, winds.STATED])
        for name, model in models.items()
    }
    settings = [GustSetting(*of) for of in product(models, averages, SIGNS, winds.TIMES)]

    def case(setting: GustSetting, phase: int, name: str, controller: Controller, *events: BaseEvent) -> Run:
        machine = setting.machine
        return Run(
            model=models[machine],
            wind=inflow[machine, setting.sign, setting.time],
            duration=GUST_LENGTH,
            controller=controller,
            events=events,
            channels=SHOWN,
            start=at_azimuth(starts[machine], 2.0 * np.pi / 3.0 * phase / phases),
            name=f"{name}, {setting.words}, phase {phase}",
        )

    def protected(setting: GustSetting, name: str) -> Controller:
        rate = (0.5 if name == GENTLE else 1.0) * STOP_RATE
        return strategy(models[setting.machine].turbine, protections[name], YAW_CONTROLS[setting.average], rate)

    keys = [(s, phase, name) for s, phase in product(settings, range(phases)) for name in (STOP, DERATE, IGNORE)]
    shown = tuple(s for s in settings if s.machine == next(iter(models)) and s.average == averages[-1])
    keys += [(s, phase, name) for s, phase, name in product(shown, range(phases), (INTERPOLATED, GENTLE, AT_ONCE))]
    keys.append((shown[0], 0, SHORT))
    cases = [case(s, phase, name, protected(s, name)) for s, phase, name in keys]
    results = dict(zip(keys, cells(cases, workers=workers, progress=lambda share: progress(0.65 * share)), strict=True))
    # strategies outside the yaw protection begin at the time at which stopping began
    later = []
    for s, phase in product(settings, range(phases)):
        begin = attempt(f"trigger, {s.words}", Gust({STOP: results[s, phase, STOP]}).triggered, STOP)
        if isinstance(begin, FailedResult) or np.isnan(begin):
            continue
        stop = Request(at=begin, request="emergency_stop")
        later.append(((s, phase, EMERGENCY), case(s, phase, EMERGENCY, protected(s, IGNORE), stop)))
        if s.average == averages[-1]:
            law = slowed(models[s.machine].turbine, YAW_CONTROLS[s.average])
            limit = PowerLimit(at=begin, power=limited)
            later.append(((s, phase, SLOWED), case(s, phase, SLOWED, law, limit)))
    values = cells([run for _, run in later], workers=workers, progress=lambda share: progress(0.65 + 0.35 * share))
    results |= {key: x for (key, _), x in zip(later, values, strict=True) if not isinstance(x, FailedResult)}
    order = (STOP, INTERPOLATED, GENTLE, EMERGENCY, DERATE, AT_ONCE, SLOWED, IGNORE)
    gusts = {
        s: [Gust({n: results[s, p, n] for n in order if (s, p, n) in results}) for p in range(phases)] for s in settings
    }
    return Gusts(gusts, shown), results[keys[-1]]


def at_azimuth(point: OperatingPoint, azimuth: float) -> OperatingPoint:
    """The operating point, if any, at an azimuth [rad] of blade 1."""
    return point if isinstance(point, FailedResult) else replace(point, azimuth=azimuth)
