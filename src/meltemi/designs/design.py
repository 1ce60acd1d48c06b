"""``optimise``: a design by gradients, from its file to the comparison on runs that the optimiser did not see."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import FrameType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meltemi.cases.case import LoadCase, case_controller, case_turbine
from meltemi.control.baseline import BaselineController
from meltemi.core.errors import InputError
from meltemi.core.fingerprint import fingerprint
from meltemi.core.interrupts import on_interrupt
from meltemi.core.shown import Brief
from meltemi.core.stores import code_identity
from meltemi.core.yamlfile import read_record
from meltemi.designs.derivatives import Derivatives, unreachable
from meltemi.designs.layup import design_layup
from meltemi.designs.problem import FEASIBLE, History, Problem, Trial
from meltemi.designs.runs import START, DesignCase, Runs, TrialError, cases_of
from meltemi.designs.search import multipliers, search
from meltemi.designs.settings import Design
from meltemi.designs.terms import combined, hard, term_of
from meltemi.designs.variables import variables_of
from meltemi.postprocess.ensemble import MeanEstimate, mean_interval
from meltemi.simulation.rotors import build
from meltemi.turbine.power_turbine import AnyTurbine

Float = NDArray[np.float64]
CHECK_STEPS = (1e-3, 1e-4, 1e-5, 1e-6)
"""Steps of the search's variables by which the gradient is checked; the start of a floater rounds small differences."""
AGREES = 0.01
"""Relative difference up to which the gradient counts as right."""
PROOF_SEEDS = 6
OF_SEARCH = ("method", "iterations", "tolerance", "proof")
"""Keys of a design that its trials do not depend on."""
HISTORY = "history.jsonl"


@dataclass(frozen=True)
class GradientCheck:
    """Derivatives of the objective in one of the cases, by the adjoint and by differences.

    Attributes:
      case: name of the case.
      pairs: per unit of the search along the gradient, along all variables alike, and along these with alternating
        signs: derivative by the adjoint, by differences, and sum of the magnitudes of its parts by the variables.
      table_error: estimate of the relative error of the derivatives of tables.
    """

    case: str
    pairs: tuple[tuple[float, float, float], ...]
    table_error: float

    @property
    def error(self) -> float:
        """Largest difference, over the magnitudes."""
        return max(abs(adjoint - difference) / (size or 1.0) for adjoint, difference, size in self.pairs)

    @property
    def agrees(self) -> bool:
        """Whether the gradient can be trusted."""
        return self.error <= AGREES

    @property
    def words(self) -> str:
        """Numbers of the worst direction."""
        adjoint, difference, _ = max(self.pairs, key=lambda p: abs(p[0] - p[1]) / (p[2] or 1.0))
        return (f"{self.case}: adjoint {adjoint:.6g}, difference {difference:.6g} ({self.error:.1e}) in the worst of "
                f"{len(self.pairs)} directions; derivatives of tables to {self.table_error:.0e}")  # fmt: skip


@dataclass(frozen=True)
class Change:
    """Change of a term by the design on runs that the optimiser did not see.

    Attributes:
      name: of the term.
      unit: engineering unit of the values.
      start, end: values in this unit; of runs the means over the sets of seeds.
      change: end less start over the start, paired by set of seeds; None for terms of the turbine.
      role: objective or constraint.
    """

    name: str
    unit: str
    start: float
    end: float
    change: MeanEstimate | None
    role: str


@dataclass(frozen=True, repr=False)
class DesignResult(Brief):
    """A design by gradients.

    Attributes:
      turbine: the designed turbine.
      variables: names.
      start, end: values of the variables.
      objective: value at the end; that at the start is the sum of the weights.
      first: trial at the start, by the runs of the optimiser.
      best: trial at the end.
      iterations: trials after each iteration.
      ended: why the search ended.
      check: check of the gradient at the start.
      multipliers: by text of a limit or name of a variable, see :func:`multipliers`.
      remainder: part of the gradient that limits and bounds leave.
      proof: changes on unseen runs.
      proof_cases: names of these.
      seconds: [s] simulated time of all runs, and wall time.
      soft: by name of a soft extreme: its value over the extreme at start and end.
      entries: entries of the controller's state that are variables.
      interrupted: whether Ctrl-C ended the search.
      notes: what limits the result.
    """

    turbine: AnyTurbine = field(repr=False)
    design: Design = field(repr=False)
    problem: Problem = field(repr=False)
    variables: tuple[str, ...]
    start: Float
    end: Float
    objective: float
    first: Trial = field(repr=False)
    best: Trial = field(repr=False)
    iterations: tuple[Trial, ...] = field(repr=False)
    ended: str
    check: GradientCheck | None
    multipliers: dict[str, float]
    remainder: float
    proof: tuple[Change, ...] = field(repr=False)
    proof_cases: tuple[str, ...] = field(repr=False)
    seconds: tuple[float, float]
    soft: dict[str, tuple[float, float]]
    entries: dict[str, float]
    interrupted: bool
    notes: tuple[str, ...]


@dataclass
class Teller:
    """What is told while a search runs: lines, the progress of the runs of a trial, and each iteration."""

    line: Callable[[str], None] = lambda text: None
    runs: Callable[[float], None] | None = None
    iteration: Callable[[Problem, Sequence[Trial]], None] = lambda problem, trials: None


def read_design(path: str | Path) -> Design:
    """Read a design from a YAML file.

    Raises:
      InputError: with file, line, key and remedy.
    """
    return read_record(path, Design)


def optimise(
    design: Design | str | Path, *, folder: str | Path | None = None, out: str | Path | None = None,
    resume: bool = False, workers: int | None = None, unchecked: bool = False, teller: Teller | None = None,
) -> DesignResult:  # fmt: skip
    """Design a turbine and its controller by gradients.

    Args:
      design: the design or its file (docs/guide/designs.md).
      folder: folder to which paths are relative; by default that of the file.
      out: folder of the history; by default there is none.
      resume: continue the search of this folder.
      workers: simultaneous runs; by default one per core.
      unchecked: go on if the gradient does not agree with differences.
      teller: what is told while the search runs.

    Raises:
      InputError: the design is not valid, its start cannot be evaluated, a variable has no effect, or the gradient does
        not agree with differences.
    """
    place = ""
    if not isinstance(design, Design):
        place, folder = f"{design}: ", Path(design).parent if folder is None else folder
        design = read_design(design)
    try:
        return _Study(design, Path(folder or "."), out, resume, workers, teller or Teller()).run(unchecked)
    except InputError as error:
        raise InputError(f"{place}{error}") from None


class _Study:
    def __init__(
        self, design: Design, folder: Path, out: str | Path | None, resume: bool, workers: int | None, teller: Teller
    ) -> None:
        self.design, self.folder, self.workers, self.teller = design, folder, workers, teller
        self.began = time.perf_counter()
        self.cases = cases_of(design, folder)
        self.unseen = self._unseen()
        first = self.cases[0].case
        turbine = case_turbine(first.replace(icing=None, imbalance=None, electrical=None), folder)
        layup = None if design.layup is None else design_layup(design.layup, turbine, folder, design.variables)
        self.variables = variables_of(design.variables, turbine, _state(first, turbine, folder), layup)
        self.objective = [term_of(name, setting) for name, setting in design.objective.items()]
        self.constraints = [term_of(name, setting) for name, setting in design.constraints.items()]
        terms = {t.name: t for t in (*self.objective, *self.constraints)}
        shared = {t.name: t for t in self.objective}
        self.constraints = [
            replace(t, setting=t.setting.replace(slope=shared[t.name].setting.slope)) if t.name in shared else t
            for t in self.constraints
        ]
        terms |= {t.name: t for t in self.constraints}
        self.terms = list(terms.values())
        self.objective = [replace(terms[t.name], setting=t.setting) for t in self.objective]
        given = {key: value for key, value in design.content().items() if key not in OF_SEARCH}
        content = (
            given,
            [c.case.content() for c in self.cases],
            turbine.content(),
            layup and layup.start.content(),
            code_identity(),
        )
        path = None if out is None else Path(out) / HISTORY
        self.history = History(path, str(fingerprint(*content)), resume=resume)
        self.runs = Runs(self.cases, self.terms, self.variables, folder, workers)
        self.runs.progress = teller.runs
        self.derivatives = Derivatives(self.runs)
        self.problem = Problem(
            self.variables,
            self.runs,
            self.derivatives.of,
            self.objective,
            self.constraints,
            self.history,
            _bands(turbine),
        )
        self.iterations: list[Trial] = []
        self.early: list[str] = []

    def _unseen(self) -> list[DesignCase]:
        """Cases of the proof; none for runs of a load base without ``proof.cases``."""
        given, last = self.design.proof, max(c.seed for c in self.cases)
        seeds = given.seeds or tuple(range(last + 101, last + 101 + PROOF_SEEDS))
        settings = given.cases or tuple(s.replace(seeds=seeds) for s in self.design.cases)
        found = cases_of(self.design, self.folder, settings)
        known = {c.case.content_hash() for c in self.cases}
        random = [c for c in found if getattr(c.case.wind, "seed", None) is not None]
        if seen := [c.name for c in random if c.case.content_hash() in known]:
            raise InputError(f"proof: the optimiser sees {', '.join(seen)}: choose other seeds")
        return found

    def run(self, unchecked: bool) -> DesignResult:
        """Search and proof; Ctrl-C and SIGTERM end the search, and keep the best design so far."""
        say, problem, d = self.teller.line, self.problem, self.design
        say(f"{len(self.variables.each)} variables, {len(self.cases)} runs, {len(problem.terms)} terms")
        interrupted, ended = False, ""
        with on_interrupt(_interrupt):
            try:
                self.runs.set_units()
                first = problem.begin()
                say(f"start: objective {first.objective:.5g}, largest violation {first.violation:.2g}")
                self._step(self.variables.start)
                check = self._check(unchecked)
                slope = self._effects()
                ended = self._ended(lambda: search(problem, method=d.method, iterations=d.iterations,
                                                   tolerance=d.tolerance, step=self._step), "")  # fmt: skip
                best = problem.best()
                active, rest = self._ended(lambda: multipliers(problem, best.x, slope), ({}, np.nan))
                proof, names, soft = self._ended(lambda: self._proof(best.x), ([], [], {}))
            except KeyboardInterrupt:
                if not self.iterations:
                    raise
                interrupted, ended, best = True, "interrupted", problem.best()
                check, active, rest, proof, names, soft = None, {}, np.nan, [], [], {}
        failed = [t for t in problem.trials if t.failed]
        notes = [*self.early] + [
            f"{v}: derivatives by differences of runs, since {why}" for v, why in self.derivatives.without.items()
        ]
        notes += [f"{len(failed)} trials could not be evaluated, the last: {failed[-1].failed}"] if failed else []
        if best.violation > FEASIBLE:
            limit = problem.limits[int(np.argmin(best.margins))]
            notes.append(f"no trial fulfils all limits: {limit.text} is violated by {best.violation:.2g}")
        return DesignResult(
            turbine=self.variables.apply(best.x), design=d, problem=problem, variables=tuple(self.variables.names),
            start=self.variables.start, end=best.x, objective=best.objective, first=first, best=best,
            iterations=tuple(self.iterations), ended=ended, check=check, multipliers=active, remainder=rest,
            proof=tuple(proof), proof_cases=tuple(names),
            seconds=(self.runs.seconds, time.perf_counter() - self.began), soft=soft,
            entries=self.variables.entries(best.x), interrupted=interrupted, notes=tuple(notes),
        )  # fmt: skip

    def _ended(self, work: Callable[[], Any], otherwise: Any) -> Any:
        """The value of a part of the study; if a trial of it cannot be evaluated, a note says why."""
        try:
            return work()
        except TrialError as error:
            self.early.append(f"ended early: {error}")
            return otherwise

    def _step(self, x: Float) -> None:
        trial = self.problem.trial(x)
        number = len(self.iterations)
        self.iterations.append(trial)
        worst = ""
        if trial.margins.size and trial.violation > 0.0:
            worst = f", violated: {self.problem.limits[int(np.argmin(trial.margins))].text} by {trial.violation:.2g}"
        if number:
            self.teller.line(f"iteration {number}: objective {trial.objective:.5g}{worst}, "
                             f"{self.runs.seconds / 3600.0:.3g} h simulated")  # fmt: skip
        self.teller.iteration(self.problem, self.iterations)

    def _check(self, unchecked: bool) -> GradientCheck:
        """Compare the gradient in the middle one of the cases, and in that with the most switches, with differences."""
        middle, worst = len(self.cases) // 2, self._switches()
        checks = [self._compare(number) for number in dict.fromkeys((middle, worst)) if number is not None]
        for check in checks:
            self.teller.line(f"gradient in {check.words}")
        if not checks[0].agrees and not unchecked:
            raise InputError(
                f"the gradient in {checks[0].words}: the objective is not smooth here, as where a controller switches, "
                "a limit acts or an extreme is one event; choose other cases or terms, a smoothing of the controller, "
                "or --unchecked"
            )
        self.early += [f"the gradient may be wrong in {each.words}" for each in checks if not each.agrees]
        return checks[0]

    def _switches(self) -> int | None:
        """Tell what switches in the first run of each of the cases at the start; the number of that with the most."""
        first = {case.group: number for number, case in reversed([*enumerate(self.cases)])}
        numbers = sorted(first.values())
        found = self.history.get("switches", lambda: {"counts": self._start(self.derivatives.switches, numbers)})
        totals = dict.fromkeys(numbers, 0)
        for kind in sorted({kind for counts in found["counts"] for kind in counts}):
            where = [(n, counts[kind]) for n, counts in zip(numbers, found["counts"], strict=True) if counts.get(kind)]
            for number, count in where:
                totals[number] += count
            most = sorted(where, key=lambda each: -each[1])
            shown = ", ".join(f"{self.cases[n].name} ({count})" for n, count in most[:3])
            self.teller.line(f"{kind} in {len(where)} of {len(numbers)} runs, most in {shown}")
        worst = max(totals, key=lambda number: totals[number])
        return worst if totals[worst] else None

    def _compare(self, number: int) -> GradientCheck:
        """Derivatives of the objective in a case in some directions: by the adjoint, and by differences."""
        case = self.cases[number]

        def make() -> dict[str, Any]:
            alone = Runs([replace(case, share=1.0)], self.terms, self.variables, self.folder, 1)
            alone.units, alone.slopes, alone.seconds = self.runs.units, self.runs.slopes, 0.0
            derivatives, none = Derivatives(alone), History(None, "")
            problem = Problem(self.variables, alone, derivatives.of, self.objective, self.constraints, none)
            problem.first, problem.limits = self.problem.first, self.problem.limits  # a term may be zero in this case
            row = self._slopes(problem)[0]
            signs = np.where(row < 0.0, -1.0, 1.0)
            ways = [row, signs, signs * (-1.0) ** np.arange(len(row))][: 1 if len(row) == 1 else 3]
            pairs = []
            for way in (way / (np.linalg.norm(way) or 1.0) for way in ways):
                found = []
                for h in CHECK_STEPS:
                    trials = [problem.trial(problem.unscaled(s * h * way)) for s in (-1.0, 1.0)]
                    if not any(t.failed for t in trials):
                        found.append((trials[1].objective - trials[0].objective) / (2.0 * h))
                if not found:
                    raise InputError(self._unreachable(problem))
                slope, size = float(row @ way), float(np.abs(row) @ np.abs(way))
                pairs.append((slope, min(found, key=lambda each: abs(each - slope)), size))
            self.runs.seconds += alone.seconds
            self.derivatives.without |= derivatives.without
            return {"pairs": pairs, "tables": derivatives.table_error}

        kept = self.history.get(f"check {number}", make)
        return GradientCheck(case.name, tuple(map(tuple, kept["pairs"])), kept["tables"])

    def _unreachable(self, problem: Problem) -> str:
        """Which variable has no neighbours of the start that can be evaluated."""
        for v, unit in zip(self.variables.each, np.eye(len(self.variables.each)), strict=True):
            for step in (-CHECK_STEPS[-1], CHECK_STEPS[-1]):
                if (trial := problem.trial(problem.unscaled(step * unit))).failed:
                    return unreachable(v, trial.failed)
        return "the neighbours of the start cannot be evaluated: give closer bounds"

    def _slopes(self, problem: Problem) -> Float:
        """Scaled derivatives at the start."""
        return np.asarray(self._start(problem.jacobian)) * self.variables.scale

    def _start(self, derivatives: Callable[..., Any], *others: Any) -> Any:
        """What needs derivatives at the start."""
        try:
            return derivatives(self.variables.start, *others)
        except TrialError as error:
            raise InputError(f"the derivatives at the start cannot be computed: {error}") from None

    def _effects(self) -> float:
        """Norm of the scaled gradient at the start, after a test that every variable has an effect."""
        rows = self._slopes(self.problem)
        for name, column in zip(self.variables.names, rows.T, strict=True):
            if not np.any(column):
                raise InputError(f"variables: {name!r} has no effect on any term of objective and constraints")
        return float(np.linalg.norm(rows[0]))

    def _proof(self, x: Float) -> tuple[list[Change], list[str], dict[str, tuple[float, float]]]:
        """Start and end on runs that the optimiser did not see, each in its own steady operation."""
        cases = self.unseen
        if not cases:
            return [], [], {}
        self.teller.line(f"proof: {len(cases)} unseen runs of start and end")
        found = []
        runs = Runs(cases, self.terms, self.variables, self.folder, self.workers)
        runs.units, runs.slopes, runs.progress = self.runs.units, self.runs.slopes, self.teller.runs
        for each in (self.variables.start, x):
            runs.restart(each)
            found.append(runs.statistics(each))
        self.runs.seconds += runs.seconds
        places = _places(cases)
        changes = []
        for i, term in enumerate(self.problem.terms):
            role = "objective" if term.name in self.design.objective else "constraint"
            unit, factor = self.runs.display[term.name]
            change: MeanEstimate | None = None
            if term.of_runs:
                both = [_of_seeds(runs, each.of_runs, i, cases, places) for each in found]
                ends = [float(each.mean()) for each in both]
                change = mean_interval((both[1] - both[0]) / (abs(ends[0]) or 1.0))
            else:
                ends = [each.of_turbine[term.name] for each in found]
            changes.append(Change(term.name, unit, factor * ends[0], factor * ends[1], change, role))
        soft: dict[str, tuple[float, float]] = {}
        if extremes := [(i, term) for i, term in enumerate(runs.of_runs) if term.soft]:
            result = runs.simulated(x, 0)
            for i, term in extremes:
                extreme = hard(term, result, cases[0].case.transient, runs.factors(term, x))
                soft[term.name] = float(found[1].of_runs[0, i]), extreme
        return changes, [c.name for c in cases], soft


def _interrupt(_: FrameType | None) -> None:
    """SIGTERM acts like Ctrl-C."""
    raise KeyboardInterrupt


def _places(cases: Sequence[DesignCase]) -> list[int]:
    """Number of each case among those of its group: the k-th seeds of all groups are compared together."""
    seen: dict[int, int] = {}
    found = []
    for case in cases:
        found.append(seen.get(case.group, 0))
        seen[case.group] = found[-1] + 1
    return found


def _of_seeds(runs: Runs, values: Float, i: int, cases: Sequence[DesignCase], places: Sequence[int]) -> Float:
    """(seeds,) statistics of a term of the cases of each seed; a case with one run, such as a gust, is in all sets."""
    counts = Counter(case.group for case in cases)
    single = {group: n == 1 for group, n in counts.items()}
    found = []
    for k in sorted(set(places)):
        rows = [n for n, place in enumerate(places) if place == k or single[cases[n].group]]
        shares = np.array([cases[n].share for n in rows])
        total, _ = combined(runs.of_runs[i], runs.slopes[i], values[rows, i], shares / shares.sum(), runs.units[i])
        found.append(total)
    return np.array(found)


def _state(case: LoadCase, turbine: AnyTurbine, folder: Path) -> dict[str, float]:
    """State of the controller by name; the loops of a scheme are tuned for it."""
    controller = case_controller(case, build(turbine, case.options, case.environment), folder)
    controller = controller or BaselineController(turbine)
    state = controller.initial_state(START)
    names = controller.state_names or tuple(map(str, range(len(state))))
    if controller.close is not None:
        controller.close()
    return dict(zip(names, map(float, state), strict=True))


def _bands(turbine: AnyTurbine) -> Callable[[float], tuple[float, float]]:
    """Bands of once and three times the rotor's speed in which a frequency must not lie, about that at the start."""
    ratio = turbine.drivetrain.gear_ratio * 2.0 * np.pi
    slow, fast = turbine.control.torque.optimal_speed / ratio, turbine.control.pitch.reference_speed / ratio
    n = getattr(turbine, "n_blades", 3)

    def bands(frequency: float) -> tuple[float, float]:
        """Upper edge of the band below, and lower edge of the band above."""
        edges = [(slow, fast), (n * slow, n * fast)]
        low = max((b for a, b in edges if frequency >= 0.5 * (a + b)), default=0.0)
        high = min((a for a, b in edges if frequency < 0.5 * (a + b)), default=np.inf)
        return low, high

    return bands
