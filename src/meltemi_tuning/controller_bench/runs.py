"""``run_bench``: runs of controllers in the suite, in the same winds, and the stored quantities of each run."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from meltemi.core.errors import InputError
from meltemi.loadcases.batch import Outcome
from meltemi.postprocess.ensemble import actuator_travel
from meltemi.postprocess.fatigue import damage_equivalent_load
from meltemi.simulation.bladed.rotor import BladedModel
from meltemi.simulation.result import Result
from meltemi.simulation.rotors import build
from meltemi.simulation.run import Run
from meltemi.simulation.start import Start
from meltemi.simulation.validity import undeflected_clearance
from meltemi.wind.fields import SteadyWind
from meltemi.wind.iec.classes import as_class
from meltemi_tuning.compare import SharedField
from meltemi_tuning.controller_bench.bench import ControllerBench
from meltemi_tuning.controller_bench.contenders import Contender
from meltemi_tuning.controller_bench.disturbance import disturbed
from meltemi_tuning.controller_bench.margins import STEP, Multisine, SpeedLoop, speed_loop
from meltemi_tuning.controller_bench.suite import EVENT, BenchCase, BenchLimits, Situation, cases_of
from meltemi_tuning.controller_bench.verdicts import SLOPES
from meltemi_tuning.run_store import SizedCases, current, resumed

STOPPED = 0.2
"""Share of the reference speed below which a stop is complete."""


def run_bench(
    model: BladedModel,
    entries: Sequence[Contender],
    suite: Sequence[Situation],
    *,
    wind_class: str = "IB",
    limits: BenchLimits | None = None,
    sine: Multisine | None = None,
    workers: int | None = None,
    progress: Callable[[float], None] | None = None,
) -> ControllerBench:
    """Run controllers through the suite, in the same winds, and measure the margins of their speed loops.

    A run that fails counts as failed for its controller and stops no other.

    Args:
      model: of the nominal turbine.
      entries: controllers; the first is the reference.
      suite: from ``suite_of``.
      wind_class: of IEC 61400-1.
      limits: of the verdicts.
      sine: test signal of the margins.
      workers: threads.
      progress: callback with the completed fraction.

    Raises:
      InputError: an unknown class, no controllers, or no run at all reached its end.
      KeyboardInterrupt: Ctrl-C ended the runs.
    """
    if not entries:
        raise InputError("controllers: at least one controller is needed")
    sine, turbine = sine or Multisine(), model.turbine
    mean_speed = 0.2 * as_class(wind_class, None).v_ref
    cases = tuple(cases_of(suite))
    speeds = next(s.speeds for s in suite if s.group == "production")
    plants = {s.name: s.plant(turbine) for s in suite}
    models: dict[str | None, BladedModel] = {None: model}
    by_situation: dict[str, BladedModel] = {}
    for s in suite:
        plant = plants[s.name]
        key = None if plant is turbine else plant.content_hash()
        by_situation[s.name] = models[key] = models.get(key) or build(plant, model.options)
    about = {f"{case.name}: {e.name}": (case, e.name) for case in cases for e in entries}
    flaps = [f"flap_{j + 1}_angle_{b + 1}" for j in range(model.n_flaps) for b in range(model.n_blades)]
    blades = range(1, model.n_blades + 1)
    channels = ["generator_speed", "generator_power", *SLOPES, *flaps]
    channels += [f"{name}_{b}" for name in ("pitch", "tip_clearance") for b in blades]
    feather = turbine.pitch_actuator.maximum

    def runs() -> Iterator[Run]:
        for case in cases:
            s = case.situation
            wind = SharedField(case.wind(turbine, wind_class), model, case.duration, len(entries))
            for entry in entries:
                controller = entry.operating if s.group == "operation" else entry.controller
                if s.noise or s.delay:
                    controller = disturbed(controller, noise=s.noise, delay=s.delay, seed=case.seed or 1)
                yield Run(
                    by_situation[s.name],
                    wind,
                    duration=case.duration,
                    controller=controller,
                    channels=channels,
                    transient=s.settling,
                    events=s.events,
                    start=Start(rotor_speed="idling", pitch=feather) if s.starts else None,
                    name=f"{case.name}: {entry.name}",
                )
        for v in speeds:
            for entry in entries:
                for sign in (1.0, -1.0):
                    signal = Multisine(sine.period, sine.settling, sign)
                    yield Run(
                        model,
                        SteadyWind(speed=v),
                        duration=signal.duration,
                        controller=disturbed(entry.controller, probe=signal),
                        channels=["generator_speed"],
                        output_step=STEP,
                        name=_sine_name(v, entry.name, sign),
                    )

    clear, reference = undeflected_clearance(model), turbine.control.pitch.reference_speed

    def reduce(result: Result) -> Any:
        name = str(result.meta["case"])
        if name not in about:
            return result["generator_speed"].copy()
        return numbers_of(result, about[name][0], reference, clear)

    total = len(about) + 2 * len(speeds) * len(entries)
    outcomes = {o.name: o for o in resumed(SizedCases(runs, total), reduce=reduce, workers=workers, progress=progress)}
    done, failed = {}, {}
    for name, (case, controller) in about.items():
        outcome = outcomes[name]
        if outcome.status.complete and outcome.value is not None:
            done[case.name, controller] = outcome.value
        else:
            failed[case.name, controller] = outcome.message
            current().enter(name, outcome.message)
    if not done:
        raise InputError(f"controllers: no run reached its end; the first: {next(iter(failed.values()))}")
    loops = {e.name: tuple(_loop(v, e.name, sine, outcomes) for v in speeds) for e in entries}
    return ControllerBench(
        turbine.name,
        wind_class,
        tuple(e.name for e in entries),
        {e.name: e.about for e in entries},
        frozenset(e.name for e in entries if e.operating is not e.controller),
        cases,
        done,
        failed,
        loops,
        speeds,
        mean_speed,
        limits or BenchLimits(),
    )


def _sine_name(speed: float, controller: str, sign: float) -> str:
    return f"margins, {speed:g} m/s, {'up' if sign > 0.0 else 'down'}: {controller}"


def _loop(speed: float, controller: str, sine: Multisine, outcomes: Mapping[str, Outcome]) -> SpeedLoop:
    up, down = (outcomes[_sine_name(speed, controller, sign)] for sign in (1.0, -1.0))
    if not (up.status.complete and down.status.complete):
        nothing = np.full(len(sine.lines), complex(math.nan, math.nan))
        return SpeedLoop(speed, 2.0 * math.pi * sine.lines, nothing, math.inf)
    return speed_loop(speed, sine, up.value, down.value)


def numbers_of(result: Result, case: BenchCase, reference: float, clearance: float) -> dict[str, float]:
    """Stored quantities of a run.

    Args:
      result: of the case.
      case: of the suite.
      reference: [rad/s] generator speed.
      clearance: [m] of the undeflected blade.
    """
    part = result.evaluated
    length = float(part.time[-1] - part.time[0])
    speed, power = part["generator_speed"] / reference, part["generator_power"]
    pitches = [name for name in part.names if name.startswith("pitch_")]
    found = {
        "power mean": float(power.mean()),
        "power std": float(power.std()),
        "generator speed max": float(speed.max()),
        "generator speed std": float(speed.std()),
        "tower clearance": min(float(part[n].min()) for n in part.names if n.startswith("tip_clearance")) / clearance,
        "pitch travel": float(np.mean([actuator_travel(part, name) for name in pitches])),
        "pitch rate max": max(float(np.abs(np.diff(part[n]) / np.diff(part.time)).max()) for n in pitches),
    }
    if flaps := [name for name in part.names if name.startswith("flap_")]:
        found["flap travel"] = sum(actuator_travel(part, name) for name in flaps) / len(pitches)
    for load, slope in SLOPES.items():
        found[f"{load} DEL"] = damage_equivalent_load(part[load], duration=length, slope=slope)
        found[f"{load} max"] = float(np.abs(part[load]).max())
    if case.situation.group == "operation":
        after = part.time >= EVENT
        slow = np.flatnonzero(after & (speed < STOPPED))
        found["stop time"] = float(part.time[slow[0]]) - EVENT if len(slow) else math.inf
        found["end speed"], found["end power"] = float(speed[-1]), float(power[-1])
    return found
