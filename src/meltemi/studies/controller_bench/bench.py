"""``run_bench``: controllers through the suite in the same winds, and the verdicts against limits."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import InputError
from meltemi.core.representation import Brief
from meltemi.loadcases.batch import Outcome
from meltemi.postprocess.ensemble import (
    EnsembleTable,
    MeanEstimate,
    actuator_travel,
    ensemble_table,
    lifetime_del,
    mean_interval,
    rayleigh_weights,
)
from meltemi.postprocess.fatigue import damage_equivalent_load
from meltemi.simulation.bladed.rotor import BladedModel
from meltemi.simulation.result import Result
from meltemi.simulation.rotors import build
from meltemi.simulation.run import Run
from meltemi.simulation.start import Start
from meltemi.simulation.validity import undeflected_clearance
from meltemi.studies.compare import SharedField
from meltemi.studies.controller_bench.contenders import Contender
from meltemi.studies.controller_bench.disturbance import disturbed
from meltemi.studies.controller_bench.margins import STEP, Multisine, SpeedLoop, speed_loop
from meltemi.studies.controller_bench.suite import EVENT, BenchCase, Limits, Situation, cases_of
from meltemi.studies.run_store import SizedCases, current, resumed
from meltemi.wind.fields import SteadyWind
from meltemi.wind.iec.classes import as_class

Float = NDArray[np.float64]
Numbers = Mapping[str, float]

SLOPES = {"RootMyc1": 10.0, "RootMxc1": 10.0, "TwrBsMyt": 4.0, "TwrBsMxt": 4.0, "YawBrMyp": 4.0, "YawBrMzp": 4.0}
"""Loads, and the slopes of their S-N curves."""
STOPPED, LEFT = 0.2, 0.9
"""Shares of the reference speed: below the first a stop is complete; above the second there was none."""
HOURS = 8766.0
"""[h] of a year."""
QUICK_SINE = Multisine(period=50.0, settling=60.0)


@dataclass(frozen=True)
class Verdict:
    """A criterion and its outcome.

    Attributes:
      criterion: name.
      value, limit: in ``unit``; NaN if there is no value.
      unit: engineering unit.
      passed: None if the criterion does not apply.
      where: case or reason.
      half_width: of the 95 % interval of the value; NaN without one.
    """

    criterion: str
    value: float
    limit: float
    unit: str
    passed: bool | None
    where: str = ""
    half_width: float = math.nan

    @property
    def word(self) -> str:
        """``pass``, ``fail`` or ``-``, with a mark where the limit lies within the interval."""
        open_ = "" if not abs(self.value - self.limit) < self.half_width else ", limit within interval"
        return "-" if self.passed is None else ("pass" if self.passed else "fail") + open_


@dataclass(frozen=True, repr=False)
class Bench(Brief):
    """Controllers in the same cases.

    Attributes:
      turbine: name.
      wind_class: of the winds.
      controllers: names; the first is the reference.
      about: of each controller.
      supervised: names of those whose starts and stops are those of meltemi's supervisor.
      cases: of the suite.
      numbers: by case and controller; without the runs that did not reach their end.
      failures: messages by case and controller.
      loops: measured speed loops by controller, by wind speed.
      speeds: [m/s] of normal turbulence.
      mean_speed: [m/s] of the Rayleigh distribution of the lifetime.
    """

    turbine: str
    wind_class: str
    controllers: tuple[str, ...]
    about: Mapping[str, str]
    supervised: frozenset[str]
    cases: tuple[BenchCase, ...] = field(repr=False)
    numbers: Mapping[tuple[str, str], Numbers] = field(repr=False)
    failures: Mapping[tuple[str, str], str]
    loops: Mapping[str, tuple[SpeedLoop, ...]]
    speeds: tuple[float, ...]
    mean_speed: float

    @property
    def reference(self) -> str:
        """Name of the reference."""
        return self.controllers[0]

    def of(self, controller: str, group: str = "", situation: str = "") -> dict[BenchCase, Numbers]:
        """Numbers of a controller by case, of one group or situation."""
        return {
            case: self.numbers[case.name, controller]
            for case in self.cases
            if (case.name, controller) in self.numbers
            and group in ("", case.situation.group)
            and situation in ("", case.situation.name)
        }

    def lifetime(self, controller: str) -> EnsembleTable | None:
        """Lifetime loads, energy and travel of the reference and a controller, paired by seed.

        Each seed number has a run at every wind speed; those with a run missing for either are left out.
        """
        names = list(dict.fromkeys((self.reference, controller)))
        found = [self._by_seed(name) for name in names]
        seeds = [k for k in found[0] if all(k in each for each in found)]
        if not seeds:
            return None
        slopes = {f"{load} DEL": slope for load, slope in SLOPES.items()}
        return ensemble_table({k: {n: each[k] for n, each in zip(names, found, strict=True)} for k in seeds}, slopes)

    def _by_seed(self, controller: str) -> dict[int, dict[str, float]]:
        runs: dict[int, dict[float, Numbers]] = {}
        for case, numbers in self.of(controller, "production").items():
            assert case.seed is not None
            runs.setdefault(case.seed % 100, {})[case.speed] = numbers
        return {k: self._lifetime_of(own) for k, own in runs.items() if set(own) == set(self.speeds)}

    def _lifetime_of(self, runs: Mapping[float, Numbers]) -> dict[str, float]:
        weights = rayleigh_weights(self.speeds, self.mean_speed)
        by_speed = [runs[v] for v in self.speeds]
        found = {
            f"{load} DEL": lifetime_del(
                self.speeds, [r[f"{load} DEL"] for r in by_speed], slope=slope, mean_speed=self.mean_speed
            )
            for load, slope in SLOPES.items()
        }
        share = weights / weights.sum()
        found["energy"] = HOURS * 3600.0 * float(weights @ [r["power mean"] for r in by_speed])
        for name in (
            "power std",
            "generator speed std",
            "pitch travel",
            *(["flap travel"] if "flap travel" in by_speed[0] else []),
        ):
            found[name] = float(share @ [r[name] for r in by_speed])
        return found

    def extremes(self, controller: str) -> dict[str, tuple[float, str]]:
        """Largest loads, with their cases, of production and extreme events."""
        found = self.of(controller, "production") | self.of(controller, "extreme")
        if not found:
            return {}
        return {load: max((n[f"{load} max"], case.name) for case, n in found.items()) for load in SLOPES}

    def paired(self, controller: str, situation: str, quantity: str) -> MeanEstimate | None:
        """Relative change of a quantity in a situation against the reference, over all its cases."""
        own, base = self.of(controller, situation=situation), self.of(self.reference, situation=situation)
        common = [case for case in base if case in own]
        return mean_interval([own[c][quantity] / base[c][quantity] - 1.0 for c in common]) if common else None


def run_bench(
    model: BladedModel,
    entries: Sequence[Contender],
    suite: Sequence[Situation],
    *,
    wind_class: str = "IB",
    sine: Multisine | None = None,
    workers: int | None = None,
    progress: Callable[[float], None] | None = None,
) -> Bench:
    """Run controllers through the suite, in the same winds, and measure the margins of their speed loops.

    A run that fails counts as failed for its controller and stops no other.

    Args:
      model: of the nominal turbine.
      entries: controllers; the first is the reference.
      suite: from ``suite_of``.
      wind_class: of IEC 61400-1.
      sine: test signal of the margins.
      workers: threads.
      progress: callback with the completed fraction.

    Raises:
      InputError: an unknown class, no controllers, or no run at all reached its end.
      KeyboardInterrupt: Ctrl-C ended the runs.
    """
    if not entries:
        raise InputError("bench-controller: at least one controller is needed")
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
        raise InputError(f"bench-controller: no run reached its end; the first: {next(iter(failed.values()))}")
    loops = {e.name: tuple(_loop(v, e.name, sine, outcomes) for v in speeds) for e in entries}
    return Bench(
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
    """What is kept of a run.

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


def verdicts(bench: Bench, controller: str, limits: Limits) -> list[Verdict]:
    """Outcome of all criteria for a controller, against the limits and the reference of the bench."""
    found = bench.of(controller)
    lost = [case for case, name in bench.failures if name == controller]
    grid = {c: n for c, n in found.items() if c.situation.name != "grid loss"}
    tests = [Verdict("failed runs", len(lost), 0.0, "", not lost, lost[0] if lost else "")]

    def worst(name: str, of: Mapping[BenchCase, Numbers], key: str, limit: float, *, least: bool = False) -> None:
        if of:
            case = (min if least else max)(of, key=lambda c: of[c][key])
            value = of[case][key]
            ok = value >= limit if least else value <= limit
            tests.append(Verdict(name, 100.0 * value, 100.0 * limit, "%", ok, case.name))

    worst("generator speed", grid, "generator speed max", limits.over_speed)
    worst(
        "generator speed after grid loss",
        bench.of(controller, situation="grid loss"),
        "generator speed max",
        limits.grid_loss_speed,
    )
    producing = {c: n for c, n in found.items() if c.situation.group != "operation"}
    worst("tower clearance", producing, "tower clearance", limits.clearance, least=True)
    tests += _margin_verdicts(bench.loops[controller], limits)
    if controller != bench.reference:
        tests += _changes(bench, controller, limits)
    if table := bench.lifetime(controller):
        travel = table.entry("pitch travel", controller).value
        rate = math.degrees(travel.mean)
        most = math.degrees(limits.pitch_travel)
        tests.append(
            Verdict("pitch travel", rate, most, "deg/s", rate <= most, "lifetime", math.degrees(travel.half_width))
        )
    return [*tests, *_operation(bench, controller, limits)]


def decibel(factor: float) -> float:
    """[dB] of a gain."""
    return 20.0 * math.log10(factor)


def _margin_verdicts(loops: Sequence[SpeedLoop], limits: Limits) -> Iterator[Verdict]:
    bent = [loop for loop in loops if not loop.linear]
    rows = (
        ("phase margin", "phase_margin", math.degrees, limits.phase_margin, "deg"),
        ("gain margin", "gain_margin", decibel, limits.gain_margin, "dB"),
        ("delay margin", "delay_margin", float, limits.delay_margin, "s"),
    )
    for name, attribute, shown, limit, unit in rows:
        kept = [loop for loop in loops if loop.linear]
        if kept:
            least = min(kept, key=lambda loop, a=attribute: getattr(loop, a))  # type: ignore[misc]
            value = getattr(least, attribute)
            passed = None if bent and value >= limit else value >= limit
            words = f"{least.wind_speed:g} m/s" if math.isfinite(value) else "gain below one everywhere"
            if bent:
                words += f"; no linear response at {', '.join(f'{b.wind_speed:g}' for b in bent)} m/s"
            yield Verdict(name, shown(value) if math.isfinite(value) else math.inf, shown(limit), unit, passed, words)
        else:
            yield Verdict(name, math.nan, shown(limit), unit, None, "no linear response")


def _changes(bench: Bench, controller: str, limits: Limits) -> Iterator[Verdict]:
    if table := bench.lifetime(controller):
        energy = table.entry("energy", controller).change
        assert energy is not None
        least = -limits.energy_loss
        yield Verdict(
            "energy",
            100.0 * energy.mean,
            100.0 * least,
            "%",
            energy.mean >= least,
            "lifetime",
            100.0 * energy.half_width,
        )
        changes = {load: table.entry(f"{load} DEL", controller).change for load in SLOPES}
        load, change = max(((n, c) for n, c in changes.items() if c), key=lambda pair: pair[1].mean)
        limit = limits.load_increase
        yield Verdict(
            "lifetime loads",
            100.0 * change.mean,
            100.0 * limit,
            "%",
            change.mean <= limit,
            load,
            100.0 * change.half_width,
        )
    base, own = bench.extremes(bench.reference), bench.extremes(controller)
    if base and own:
        growth, load = max((own[n][0] / base[n][0] - 1.0, n) for n in SLOPES)
        limit = limits.extreme_increase
        yield Verdict("extreme loads", 100.0 * growth, 100.0 * limit, "%", growth <= limit, f"{load}: {own[load][1]}")


def _operation(bench: Bench, controller: str, limits: Limits) -> Iterator[Verdict]:
    for situation in ("normal stop", "emergency stop"):
        if found := bench.of(controller, situation=situation):
            case = max(found, key=lambda c: found[c]["stop time"])
            time, follows = found[case]["stop time"], found[case]["end speed"] < LEFT
            none = not follows and controller not in bench.supervised
            passed = None if none else time <= limits.stop_time
            yield Verdict(
                situation,
                math.nan if none else time,
                limits.stop_time,
                "s",
                passed,
                "not offered" if none else case.name,
            )
    if found := bench.of(controller, situation="start"):
        connected = {case: n["end power"] > 0.0 for case, n in found.items()}
        none = not any(connected.values()) and controller not in bench.supervised
        share = sum(connected.values())
        passed = None if none else all(connected.values())
        yield Verdict("start", share, len(connected), "of cases", passed, "not offered" if none else "power at the end")
