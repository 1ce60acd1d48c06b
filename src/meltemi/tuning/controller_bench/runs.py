"""``run_bench``: runs of controllers in the suite, in the same winds, and the stored quantities of each run."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from meltemi.core.errors import InputError
from meltemi.environment.grid import PowerGrid
from meltemi.iec.classes import as_class
from meltemi.loadcases.store import Outcome
from meltemi.postprocess.ensemble import actuator_travel
from meltemi.postprocess.fatigue import damage_equivalent_load
from meltemi.simulation.bladed.rotor import BladedModel
from meltemi.simulation.result import Result
from meltemi.simulation.rotors import build, default_step
from meltemi.simulation.run import Run
from meltemi.simulation.start import Start
from meltemi.simulation.trim import operating_point
from meltemi.simulation.validity import undeflected_clearance
from meltemi.tuning.compare import SharedField
from meltemi.tuning.controller_bench.bench import ControllerBench
from meltemi.tuning.controller_bench.contenders import Contender
from meltemi.tuning.controller_bench.disturbance import disturbed
from meltemi.tuning.controller_bench.margins import (
    STEP,
    Multisine,
    OpenLoop,
    Whirl,
    blade_loop,
    moment_amplitude,
    moment_scale,
    speed_loop,
)
from meltemi.tuning.controller_bench.suite import EVENT, BenchCase, BenchLimits, Situation, cases_of
from meltemi.tuning.controller_bench.verdicts import SLOPES
from meltemi.tuning.power_reference import tracking_error
from meltemi.tuning.run_store import current, resumed
from meltemi.wind.fields import SteadyWind

STOPPED = 0.2
"""Fraction of the reference speed below which a stop is complete."""
SIGNS = (1.0, -1.0)
"""Signs of the test signal of the margins."""
FREE_PITCH = math.radians(1.0)
"""[rad] distance of the steady pitch from its minimum, below which the blades stay at it for much of a turn."""
ROOTS = tuple(f"root_moment_out_of_plane_{b + 1}" for b in range(3))
"""Channels of the moments that blade loops act on."""


def run_bench(  # noqa: PLR0913 - options of a study, each with a default
    model: BladedModel,
    entries: Sequence[Contender],
    suite: Sequence[Situation],
    *,
    wind_class: str = "IB",
    limits: BenchLimits | None = None,
    sine: Multisine | None = None,
    grid: PowerGrid | None = None,
    workers: int | None = None,
    progress: Callable[[float], None] | None = None,
) -> ControllerBench:
    """Run controllers through the suite, in the same winds, and measure the margins of their speed and blade loops.

    A run that fails counts as failed for its controller and stops no other.

    Args:
      model: model of the nominal turbine.
      entries: controllers; the first is the reference.
      suite: situations of ``suite_of``.
      wind_class: class of IEC 61400-1.
      limits: limits of the verdicts.
      sine: test signal of the margins.
      grid: grid with a power reference outside starts, stops and grid losses; all controllers follow it.
      workers: number of threads.
      progress: callback with the completed fraction.

    Raises:
      InputError: an unknown class, no controllers, or no run at all reached its end.
      KeyboardInterrupt: Ctrl-C ended the runs.
    """
    if not entries:
        raise InputError("controllers: at least one controller is needed")
    sine, turbine = sine or Multisine(), model.turbine
    speeds = next(s.speeds for s in suite if s.group == "production")
    in_suite = suite_runs(model, suite, entries, wind_class, grid)
    probed = signal_runs(model, speeds, entries, sine, grid)
    whirl, scale, late = Whirl(sine.period, sine.settling), moment_scale(turbine), default_step(model)
    loaded = [entry for entry in entries if entry.controller.uses_loads and model.n_blades == 3]
    free = pitching_speeds(model, speeds) if loaded else []
    whirled = signal_runs(model, free, loaded, whirl, grid)
    turning = {run.name for run in whirled.values()}
    about = {run.name: case for (case, _), run in in_suite.items()}
    clear, reference = undeflected_clearance(model), turbine.control.pitch.reference_speed

    def reduce(result: Result) -> Any:
        name = str(result.meta["case"])
        if name in turning:
            return moment_amplitude([result[each] for each in ROOTS], result["azimuth"], scale, late)
        case = about.get(name)
        return result["generator_speed"].copy() if case is None else numbers_of(result, case, reference, clear)

    runs = [*in_suite.values(), *probed.values(), *whirled.values()]
    outcomes = {o.name: o for o in resumed(runs, reduce=reduce, workers=workers, progress=progress)}
    done, failed = {}, {}
    for (case, controller), run in in_suite.items():
        outcome = outcomes[run.name]
        if outcome.status.complete and outcome.value is not None:
            done[case.name, controller] = outcome.value
        else:
            failed[case.name, controller] = outcome.message
            current().enter(run.name, outcome.message)
    if not done:
        raise InputError(f"controllers: no run reached its end; the first: {next(iter(failed.values()))}")
    pairs = {(v, name): [outcomes[probed[v, name, sign].name] for sign in SIGNS] for v, name, _ in probed}
    turned = {(v, name): [outcomes[whirled[v, name, sign].name] for sign in SIGNS] for v, name, _ in whirled}
    loop = partial(blade_loop, delay=late)
    blades = {name: tuple(_measured(v, whirl, turned[v, name], loop) for v in free) for _, name in turned}
    return ControllerBench(
        turbine=turbine.name,
        wind_class=wind_class,
        controllers=tuple(e.name for e in entries),
        about={e.name: e.about for e in entries},
        supervised=frozenset(e.name for e in entries if e.operating is not e.controller),
        cases=tuple(dict.fromkeys(case for case, _ in in_suite)),
        numbers=done,
        failures=failed,
        loops={e.name: tuple(_measured(v, sine, pairs[v, e.name]) for v in speeds) for e in entries},
        blade_loops={name: loops for name, loops in blades.items() if any(np.any(loop.response) for loop in loops)},
        speeds=speeds,
        mean_speed=0.2 * as_class(wind_class, None).v_ref,
        limits=limits or BenchLimits(),
    )


def suite_runs(
    model: BladedModel,
    suite: Iterable[Situation],
    entries: Sequence[Contender],
    wind_class: str,
    grid: PowerGrid | None = None,
) -> dict[tuple[BenchCase, str], Run]:
    """Runs of the suite by case and controller; those of a case share its wind, equal plants a model."""
    flaps = [f"flap_{j + 1}_angle_{b + 1}" for j in range(model.n_flaps) for b in range(model.n_blades)]
    channels = ["generator_speed", "generator_power", *SLOPES, *flaps]
    channels += [f"{name}_{b + 1}" for name in ("pitch", "tip_clearance") for b in range(model.n_blades)]
    channels += ["power_reference"] if grid is not None else []
    idling = Start(rotor_speed="idling", pitch=model.turbine.pitch_actuator.maximum)
    models = {model.turbine: model}
    runs = {}
    for s in suite:
        plant = s.plant(model.turbine)
        models[plant] = plant_model = models.get(plant) or build(plant, model.options)
        for case in cases_of([s]):
            wind = SharedField(case.wind(model.turbine, wind_class), model, case.duration, len(entries))
            for entry in entries:
                controller = entry.operating if s.group == "operation" else entry.controller
                if s.noise or s.delay:
                    controller = disturbed(controller, noise=s.noise, delay=s.delay, seed=case.seed or 1)
                runs[case, entry.name] = Run(
                    plant_model,
                    wind,
                    duration=case.duration,
                    controller=controller,
                    channels=channels,
                    transient=s.settling,
                    events=s.events,
                    grid=None if s.group == "operation" else grid,
                    start=idling if s.starts else None,
                    name=f"{case.name}: {entry.name}",
                )
    return runs


def signal_runs(
    model: BladedModel,
    speeds: Iterable[float],
    entries: Iterable[Contender],
    signal: Multisine,
    grid: PowerGrid | None = None,
) -> dict[tuple[float, str, float], Run]:
    """Runs with a test signal, of the blade loops if it is a :class:`Whirl`, by wind speed, controller and sign."""
    blades, scale = isinstance(signal, Whirl), moment_scale(model.turbine)

    def disturbance(sign: float) -> dict[str, Any]:
        signed = replace(signal, sign=sign)
        return (
            {"whirl": lambda time: scale * signed.amplitude(time)} if isinstance(signed, Whirl) else {"probe": signed}
        )

    return {
        (v, entry.name, sign): Run(
            model,
            SteadyWind(speed=v),
            duration=signal.duration,
            controller=disturbed(entry.controller, **disturbance(sign)),
            channels=["azimuth", *ROOTS] if blades else ["generator_speed"],
            grid=grid,
            output_step=STEP,
            name=f"margins{' of blade loops' * blades}, {v:g} m/s, {'up' if sign > 0.0 else 'down'}: {entry.name}",
        )
        for v in speeds
        for entry in entries
        for sign in SIGNS
    }


def pitching_speeds(model: BladedModel, speeds: Iterable[float]) -> list[float]:
    """Wind speeds [m/s] at which the steady pitch is away from its minimum, so that blades can pitch either way."""
    least = model.turbine.control.pitch.minimum + FREE_PITCH
    return [v for v in speeds if operating_point(model, v).pitch > least]


def _measured(
    speed: float, signal: Multisine, runs: Sequence[Outcome], loop: Callable[..., OpenLoop] = speed_loop
) -> OpenLoop:
    """The loop from runs with either sign; without numbers if one of them did not reach its end."""
    if all(run.status.complete for run in runs):
        return loop(speed, signal, *(run.value for run in runs))
    nothing = np.full(len(signal.lines), complex(math.nan, math.nan))
    return OpenLoop(speed, 2.0 * math.pi * signal.lines, nothing, math.inf)


def numbers_of(result: Result, case: BenchCase, reference: float, clearance: float) -> dict[str, float]:
    """Stored quantities of a run.

    Args:
      result: result of the case.
      case: case of the suite.
      reference: [rad/s] reference of the generator speed.
      clearance: [m] tower clearance of the undeflected blade.
    """
    part = result.evaluated
    length = float(part.time[-1] - part.time[0])
    speed, power = part["generator_speed"] / reference, part["generator_power"]
    pitches = [name for name in part.names if name.startswith("pitch_")]
    numbers = {
        "power mean": float(power.mean()),
        "power std": float(power.std()),
        "generator speed max": float(speed.max()),
        "generator speed std": float(speed.std()),
        "tower clearance": min(float(part[n].min()) for n in part.names if n.startswith("tip_clearance")) / clearance,
        "pitch travel": float(np.mean([actuator_travel(part, name) for name in pitches])),
        "pitch rate max": max(float(np.abs(np.diff(part[n]) / np.diff(part.time)).max()) for n in pitches),
    }
    if "power_reference" in part.names:
        numbers["tracking error"] = tracking_error(part)
    if flaps := [name for name in part.names if name.startswith("flap_")]:
        numbers["flap travel"] = sum(actuator_travel(part, name) for name in flaps) / len(pitches)
    for load, slope in SLOPES.items():
        numbers[f"{load} DEL"] = damage_equivalent_load(part[load], duration=length, slope=slope)
        numbers[f"{load} max"] = float(np.abs(part[load]).max())
    if case.situation.group == "operation":
        after = part.time >= EVENT
        slow = np.flatnonzero(after & (speed < STOPPED))
        numbers["stop time"] = float(part.time[slow[0]]) - EVENT if len(slow) else math.inf
        numbers["end speed"], numbers["end power"] = float(speed[-1]), float(power[-1])
    return numbers
