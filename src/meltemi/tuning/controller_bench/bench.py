"""``ControllerBench``: the numbers of controllers in the cases of the suite, and their verdicts against limits."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

from meltemi.core.errors import InputError, did_you_mean
from meltemi.core.representation import Card, Fold, badge
from meltemi.core.shown import Brief
from meltemi.postprocess.ensemble import (
    EnsembleTable,
    MeanEstimate,
    ensemble_table,
    lifetime_del,
    mean_interval,
    rayleigh_weights,
)
from meltemi.report.tables import Rows
from meltemi.tuning.controller_bench.margins import OpenLoop
from meltemi.tuning.controller_bench.suite import BenchCase, BenchLimits
from meltemi.tuning.controller_bench.verdicts import NAMES, SLOPES, CriterionVerdict, LoopMargins, Standing, decibel

Numbers = Mapping[str, float]

STILL_RUNNING = 0.9
"""Fraction of the reference speed above which the turbine has not stopped."""
HOURS = 8766.0
"""[h] hours of a year."""


@dataclass(frozen=True, repr=False)
class ControllerBench(Brief):
    """Controllers in the same cases of a fixed suite.

    Attributes:
      turbine: name of the turbine.
      wind_class: class of the winds.
      controllers: names of the controllers; the first is the reference.
      about: description of each controller.
      supervised: names of those whose starts and stops are those of meltemi's supervisor.
      cases: cases of the suite.
      numbers: numbers by case and controller; without the runs that did not reach their end.
      failures: messages by case and controller.
      loops: measured speed loops by controller, one for each wind speed.
      blade_loops: measured loops on the blades' root moments, at wind speeds where the pitch is away from its
        minimum; without the controllers that have none.
      speeds: [m/s] wind speeds of normal turbulence.
      mean_speed: [m/s] mean of the Rayleigh distribution of the lifetime.
      limits: limits of the verdicts.
    """

    turbine: str
    wind_class: str
    controllers: tuple[str, ...]
    about: Mapping[str, str]
    supervised: frozenset[str]
    cases: tuple[BenchCase, ...] = field(repr=False)
    numbers: Mapping[tuple[str, str], Numbers] = field(repr=False)
    failures: Mapping[tuple[str, str], str]
    loops: Mapping[str, tuple[OpenLoop, ...]]
    blade_loops: Mapping[str, tuple[OpenLoop, ...]]
    speeds: tuple[float, ...]
    mean_speed: float
    limits: BenchLimits

    def __repr__(self) -> str:
        failed = f", {len(self.failures)} runs failed" if self.failures else ""
        return (
            f"<ControllerBench of {', '.join(self.controllers)} on {self.turbine} in {len(self.cases)} cases{failed}>"
        )

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
        by_seed = [self._by_seed(name) for name in names]
        seeds = [k for k in by_seed[0] if all(k in each for each in by_seed)]
        if not seeds:
            return None
        slopes = {f"{load} DEL": slope for load, slope in SLOPES.items()}
        return ensemble_table({k: {n: each[k] for n, each in zip(names, by_seed, strict=True)} for k in seeds}, slopes)

    def lifetimes(self) -> dict[str, EnsembleTable | None]:
        """:meth:`lifetime` of all controllers, the reference first."""
        return {name: self.lifetime(name) for name in self.controllers}

    def _by_seed(self, controller: str) -> dict[int, dict[str, float]]:
        runs: dict[int, dict[float, Numbers]] = {}
        for case, numbers in self.of(controller, "production").items():
            assert case.seed is not None
            runs.setdefault(case.seed % 100, {})[case.speed] = numbers
        return {k: self._lifetime_of(by_speed) for k, by_speed in runs.items() if set(by_speed) == set(self.speeds)}

    def _lifetime_of(self, runs: Mapping[float, Numbers]) -> dict[str, float]:
        weights = rayleigh_weights(self.speeds, self.mean_speed)
        by_speed = [runs[v] for v in self.speeds]
        lifetime = {}
        for name, slope in ((f"{load} DEL", slope) for load, slope in SLOPES.items()):
            loads = [r[name] for r in by_speed]
            lifetime[name] = lifetime_del(self.speeds, loads, slope=slope, mean_speed=self.mean_speed)
        lifetime["energy"] = HOURS * 3600.0 * float(weights @ [r["power mean"] for r in by_speed])
        share = weights / weights.sum()
        for name in ("power std", "generator speed std", "pitch travel", "flap travel", "tracking error"):
            if name in by_speed[0]:
                lifetime[name] = float(share @ [r[name] for r in by_speed])
        return lifetime

    def extremes(self, controller: str) -> dict[str, tuple[float, str]]:
        """Largest loads, with their cases, of production and extreme events."""
        cases = self.of(controller, "production") | self.of(controller, "extreme")
        if not cases:
            return {}
        return {load: max((n[f"{load} max"], case.name) for case, n in cases.items()) for load in SLOPES}

    def paired(self, controller: str, situation: str, quantity: str) -> MeanEstimate | None:
        """Relative change of a quantity in a situation against the reference, over all its cases."""
        numbers, base = self.of(controller, situation=situation), self.of(self.reference, situation=situation)
        common = [case for case in base if case in numbers]
        return mean_interval([numbers[c][quantity] / base[c][quantity] - 1.0 for c in common]) if common else None

    def verdicts(self, controller: str) -> tuple[CriterionVerdict, ...]:
        """Outcome of all criteria for a controller, against the limits.

        Raises:
          InputError: there is no such controller.
        """
        if controller not in self.controllers:
            raise InputError(f"no controller {controller!r} on the bench: {did_you_mean(controller, self.controllers)}")
        return tuple(_verdicts(self, controller))

    def all_verdicts(self) -> dict[str, tuple[CriterionVerdict, ...]]:
        """:meth:`verdicts` of all controllers, the reference first."""
        return {name: self.verdicts(name) for name in self.controllers}

    def judged(self, limits: BenchLimits) -> ControllerBench:
        """The bench with the same runs, judged by other limits."""
        return replace(self, limits=limits)

    def leaderboard(self) -> tuple[Standing, ...]:
        """Controllers, those with fewest failed criteria first, those with failed runs last."""
        lost = {name for _, name in self.failures}
        standings = (self._standing(name) for name in self.controllers)
        return tuple(sorted(standings, key=lambda s: (s.controller in lost, s.failed)))

    def _standing(self, name: str) -> Standing:
        verdicts = self.verdicts(name)
        table = self.lifetime(name)
        energy, blade, tower = (
            table.entry(q, name).change if table and name != self.reference else None
            for q in ("energy", "RootMyc1 DEL", "TwrBsMyt DEL")
        )
        grid, producing = _with_grid(self, name).values(), _producing(self, name).values()
        return Standing(
            name,
            sum(v.passed is False for v in verdicts),
            sum(v.passed is not None for v in verdicts),
            energy,
            blade,
            tower,
            table.entry("pitch travel", name).value.mean if table else math.nan,
            max((n["generator speed max"] for n in grid), default=math.nan),
            min((n["tower clearance"] for n in producing), default=math.nan),
            LoopMargins.of(self.loops.get(name, ())),
            LoopMargins.of(self.blade_loops[name]) if name in self.blade_loops else None,
        )

    def card(self) -> Card:
        """Leaderboard, criteria, lifetime and margins."""
        from meltemi.reports.blocks import Marked
        from meltemi.tuning.controller_bench import tables

        verdicts = self.all_verdicts()
        facts = [(name, self.about.get(name, "")) for name in self.controllers]
        facts[0] = (f"{self.reference} (reference)", facts[0][1])
        table = tables.criteria_table(verdicts)
        cells = [[badge(str(c), c.kind) if isinstance(c, Marked) else str(c) for c in row] for row in table.rows]

        def fold(title: str, rows: Rows, note: str = "", *, open: bool = False) -> Fold:  # noqa: A002
            return Fold(title, rows[1], [" ".join(h.split()) for h in rows[0]], note=note, open=open)

        against = f"changes are against {self.reference}"
        sections = [
            fold("Leaderboard", tables.leaderboard_rows(self.leaderboard(), self.reference), against, open=True),
            fold("Criteria", (list(table.head), cells), table.note),
            fold("Lifetime", tables.lifetime_rows(self.lifetimes()), against),
            fold("Margins", tables.margin_rows(self.loops, self.blade_loops)),
        ]
        if self.failures:
            lost = [[case, name, why] for (case, name), why in self.failures.items()]
            facts.append(("failed", badge(f"{len(lost)} runs", "bad")))
            sections.append(Fold("Failed runs", lost, ["case", "controller", "message"]))
        lead = (
            f"{len(self.controllers)} controllers of {self.turbine} in {len(self.cases)} cases, class {self.wind_class}"
        )
        return Card("Controller bench", lead, facts, sections)


def _verdicts(bench: ControllerBench, controller: str) -> list[CriterionVerdict]:
    limits = bench.limits
    lost = [case for case, name in bench.failures if name == controller]
    tests = [CriterionVerdict("failed runs", len(lost), 0.0, "", not lost, lost[0] if lost else "")]

    def worst(name: str, of: Mapping[BenchCase, Numbers], key: str, limit: float, *, least: bool = False) -> None:
        if of:
            case = (min if least else max)(of, key=lambda c: of[c][key])
            value = of[case][key]
            ok = value >= limit if least else value <= limit
            tests.append(CriterionVerdict(name, 100.0 * value, 100.0 * limit, "%", ok, case.name))

    worst("generator speed", _with_grid(bench, controller), "generator speed max", limits.over_speed)
    grid_loss = bench.of(controller, situation="grid loss")
    worst("generator speed after grid loss", grid_loss, "generator speed max", limits.grid_loss_speed)
    worst("tower clearance", _producing(bench, controller), "tower clearance", limits.clearance, least=True)
    tests += _margin_verdicts("speed loop", bench.loops[controller], limits)
    tests += _margin_verdicts("blade loops", bench.blade_loops.get(controller, ()), limits)
    if controller != bench.reference:
        tests += _changes(bench, controller, limits)
    if table := bench.lifetime(controller):
        travel = table.entry("pitch travel", controller).value
        rate, width, most = (math.degrees(x) for x in (travel.mean, travel.half_width, limits.pitch_travel))
        tests.append(CriterionVerdict("pitch travel", rate, most, "deg/s", rate <= most, "lifetime", width))
    return [*tests, *_operation(bench, controller, limits)]


def _with_grid(bench: ControllerBench, controller: str) -> dict[BenchCase, Numbers]:
    return {c: n for c, n in bench.of(controller).items() if c.situation.name != "grid loss"}


def _producing(bench: ControllerBench, controller: str) -> dict[BenchCase, Numbers]:
    return {c: n for c, n in bench.of(controller).items() if c.situation.group != "operation"}


def _margin_verdicts(where: str, loops: Sequence[OpenLoop], limits: BenchLimits) -> Iterator[CriterionVerdict]:
    """Verdicts on the speed loop, or on the blade loops, which have no delay margin and fail if they are undamped."""
    blades = where == "blade loops"
    bent = [loop for loop in loops if not loop.linear]
    rows = (
        ("phase margin", "phase_margin", math.degrees, limits.phase_margin, "deg"),
        ("gain margin", "gain_margin", decibel, limits.gain_margin, "dB"),
        ("delay margin", "delay_margin", float, limits.delay_margin, "s"),
    )
    linear, unknown = [loop for loop in loops if loop.linear], False if blades else None
    for kind, attribute, shown, limit, unit in rows[: 2 if blades else 3] if loops else ():
        name, value, passed, words = f"{where}: {kind}", math.nan, unknown, "no linear response"
        if linear:
            least = min(linear, key=lambda loop, a=attribute: getattr(loop, a))  # type: ignore[misc]
            margin = getattr(least, attribute)
            value = shown(margin) if math.isfinite(margin) else math.inf
            passed = unknown if bent and margin >= limit else margin >= limit
            words = f"{least.wind_speed:g} m/s" if math.isfinite(margin) else "gain below one everywhere"
            if bent:
                words += f"; no linear response at {', '.join(f'{b.wind_speed:g}' for b in bent)} m/s"
        yield CriterionVerdict(name, value, shown(limit), unit, passed, words)


def _changes(bench: ControllerBench, controller: str, limits: BenchLimits) -> Iterator[CriterionVerdict]:
    if table := bench.lifetime(controller):
        energy = table.entry("energy", controller).change
        assert energy is not None
        yield _of_change("energy", energy, -limits.energy_loss, energy.mean >= -limits.energy_loss, "lifetime")
        changes = {load: table.entry(f"{load} DEL", controller).change for load in SLOPES}
        load, change = max(((n, c) for n, c in changes.items() if c), key=lambda pair: pair[1].mean)
        yield _of_change(
            "lifetime loads", change, limits.load_increase, change.mean <= limits.load_increase, NAMES[load]
        )
    base, extremes = bench.extremes(bench.reference), bench.extremes(controller)
    if base and extremes:
        growth, load = max((extremes[n][0] / base[n][0] - 1.0, n) for n in SLOPES)
        limit = limits.extreme_increase
        yield CriterionVerdict(
            "extreme loads", 100.0 * growth, 100.0 * limit, "%", growth <= limit, f"{NAMES[load]}: {extremes[load][1]}"
        )


def _of_change(name: str, change: MeanEstimate, limit: float, passed: bool, where: str) -> CriterionVerdict:
    """The verdict on a relative change, in percent."""
    return CriterionVerdict(name, 100.0 * change.mean, 100.0 * limit, "%", passed, where, 100.0 * change.half_width)


def _operation(bench: ControllerBench, controller: str, limits: BenchLimits) -> Iterator[CriterionVerdict]:
    supervised = controller in bench.supervised
    for situation in ("normal stop", "emergency stop"):
        if cases := bench.of(controller, situation=situation):
            case = max(cases, key=lambda c: cases[c]["stop time"])
            time, limit = cases[case]["stop time"], limits.stop_time
            if supervised or cases[case]["end speed"] < STILL_RUNNING:
                yield CriterionVerdict(situation, time, limit, "s", time <= limit, case.name)
            else:
                yield CriterionVerdict(situation, math.nan, limit, "s", None, "not offered")
    if cases := bench.of(controller, situation="start"):
        connected = [n["end power"] > 0.0 for n in cases.values()]
        n, unit = len(connected), "of cases"
        if supervised or any(connected):
            yield CriterionVerdict("start", sum(connected), n, unit, all(connected), "power at the end")
        else:
            yield CriterionVerdict("start", math.nan, n, unit, None, "not offered")
