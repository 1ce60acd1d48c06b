"""A design as a problem of optimisation: scaled variables, objective, constraints, and the history of its trials."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import InputError
from meltemi.designs.runs import Runs, Statistics, TrialError
from meltemi.designs.settings import ConstraintSetting
from meltemi.designs.terms import Term
from meltemi.designs.variables import Variables

Float = NDArray[np.float64]
Derive = Callable[[Float, Float, Statistics], Float]
FAILED = 10.0
"""Objective of a trial that cannot be evaluated, above the largest one so far: the line search goes back."""
FEASIBLE = 1e-4
"""Violation of a limit, over its value at the start, that counts as none."""


@dataclass(frozen=True)
class Limit:
    """One side of a constraint: ``sign * (value / unit - bound)`` must not be negative.

    Attributes:
      term: number of the term.
      text: such as ``mean generator_power at least 0.99 of the start``.
    """

    term: int
    sign: float
    unit: float
    bound: float
    text: str


@dataclass(frozen=True)
class Trial:
    """An evaluated design.

    Attributes:
      x: (P,) values of the variables.
      totals: values of the terms, by their order; empty if it failed.
      objective: value of the objective; 1 at the start for positive weights of sum 1.
      margins: (L,) margins of the limits; negative where one is violated.
      failed: why it could not be evaluated.
    """

    x: Float
    totals: Float
    objective: float
    margins: Float
    failed: str = ""

    @property
    def violation(self) -> float:
        """Largest violation of a limit."""
        return float(max(0.0, -self.margins.min())) if self.margins.size else 0.0


class History:
    """Trials and derivatives in a file, from which a search that was interrupted is repeated exactly.

    Args:
      file: file of JSON lines; None: memory only.
      key: what identifies the design.
      resume: whether to read it.

    Raises:
      InputError: the file is of another design, or exists and ``resume`` is not given.
    """

    def __init__(self, file: Path | None, key: str, *, resume: bool = False) -> None:
        self.file, self.known = file, dict[str, dict[str, Any]]()
        self.reused = 0
        if file is None:
            return
        if file.exists() and not resume and '"runs"' in file.read_text():  # a start that failed does not count
            raise InputError(f"{file}: a search has been here: add --resume to continue it, or choose another --out")
        if resume and not file.exists():
            raise InputError(f"{file}: no such file: there is no search to resume; leave --resume out")
        if resume:
            first, *lines = file.read_text().splitlines() or ["{}"]
            if json.loads(first).get("design") != key:
                raise InputError(
                    f"{file}: the history is of another design, or of another version: choose another --out"
                )
            for line in lines:
                try:
                    entry = json.loads(line)
                except json.JSONDecodeError:  # the last one, which the end of the process cut off
                    break
                self.known[entry["key"]] = entry
            file.write_text("\n".join([first, *map(json.dumps, self.known.values())]) + "\n")
        else:
            file.write_text(json.dumps({"design": key}) + "\n")

    def get(self, key: str, make: Callable[[], dict[str, Any]]) -> dict[str, Any]:
        """The entry of a key, computed and written if there is none."""
        if key in self.known:
            self.reused += 1
            return self.known[key]
        entry = self.known[key] = {"key": key, **make()}
        if self.file is not None:
            with self.file.open("a") as file:
                file.write(json.dumps(entry) + "\n")
        return entry


class Problem:
    """Objective and constraints of scaled variables.

    Args:
      variables, evaluator: the variables, and what evaluates trials.
      derivatives: function of the variables, (K, terms) outputs by the totals, and the statistics.
      objective: terms of the objective.
      constraints: terms with limits.
      history: where trials are kept.

    Attributes:
      trials: trials in their order.
    """

    def __init__(
        self, variables: Variables, evaluator: Runs, derivatives: Derive, objective: Sequence[Term],
        constraints: Sequence[Term], history: History, bands: Callable[[float], tuple[float, float]] | None = None,
    ) -> None:  # fmt: skip
        self.variables, self.evaluator, self.history, self.bands = variables, evaluator, history, bands
        self.derivatives = derivatives
        self.terms = [*evaluator.of_runs, *evaluator.of_turbine]
        self.objective, self.constraints = list(objective), list(constraints)
        self.trials: list[Trial] = []
        self.first: Float | None = None
        self.limits: list[Limit] = []

    # ------------------------------------------------------------------------------------------------ scaling

    def scaled(self, x: Float) -> Float:
        """Variables of the search."""
        return (x - self.variables.start) / self.variables.scale

    def unscaled(self, y: Float) -> Float:
        """Variables of the design, within their bounds."""
        x = self.variables.start + self.variables.scale * np.asarray(y, dtype=float)
        return np.clip(x, self.variables.low, self.variables.high)

    # ------------------------------------------------------------------------------------------------- values

    def begin(self) -> Trial:
        """Evaluate the start, which objective and limits refer to.

        Raises:
          InputError: the start cannot be evaluated, or a term of the objective is zero there.
        """
        found = self._statistics(self.variables.start)
        if "failed" in found:
            raise InputError(f"the start cannot be evaluated: {found['failed']}")
        self.first = self._totals(found)
        for term in self.objective:
            if self.first[self._place(term)] == 0.0:
                raise InputError(f"objective: {term.name!r} is zero at the start: take another channel")
        self.limits = [limit for term in self.constraints for limit in self._limits(term)]
        return self.trial(self.variables.start)

    def _place(self, term: Term) -> int:
        return [each.name for each in self.terms].index(term.name)

    def _limits(self, term: Term) -> list[Limit]:
        assert self.first is not None
        s, place = term.setting, self._place(term)
        assert isinstance(s, ConstraintSetting)
        start = float(self.first[place])
        unit = abs(start) or 1.0
        ratio = start / unit
        found = []
        if s.most is not None:
            found.append(Limit(place, -1.0, unit, s.most * ratio, f"{term.name} at most {s.most:g} of the start"))
        if s.least is not None:
            found.append(Limit(place, 1.0, unit, s.least * ratio, f"{term.name} at least {s.least:g} of the start"))
        if s.below is not None:
            found.append(Limit(place, -1.0, unit, s.below / unit, f"{term.name} at most {s.below:g}"))
        if s.above is not None:
            found.append(Limit(place, 1.0, unit, s.above / unit, f"{term.name} at least {s.above:g}"))
        if s.away is not None and self.bands is not None:
            low, high = self.bands(start)
            if low > 0.0:
                bound = low * (1.0 + s.away)
                found.append(Limit(place, 1.0, unit, bound / unit, f"{term.name} above {bound:.4g} Hz"))
            if np.isfinite(high):
                bound = high * (1.0 - s.away)
                found.append(Limit(place, -1.0, unit, bound / unit, f"{term.name} below {bound:.4g} Hz"))
        return found

    def trial(self, x: Float) -> Trial:
        """A trial, evaluated or from the history."""
        found = self._statistics(x)
        if "failed" in found:
            worst = max([abs(t.objective) for t in self.trials if not t.failed] or [1.0])
            trial = Trial(x, np.zeros(0), FAILED + worst, np.full(len(self.limits), -1.0), found["failed"])
        else:
            totals = self._totals(found)
            trial = Trial(x, totals, self._objective(totals), self._margins(totals))
        if not any(np.array_equal(trial.x, t.x) for t in self.trials):
            self.trials.append(trial)
        return trial

    def _objective(self, totals: Float) -> float:
        return sum(
            t.setting.weight * float(totals[self._place(t)]) / abs(float(self._first[self._place(t)]))
            for t in self.objective
        )

    @property
    def _first(self) -> Float:
        assert self.first is not None
        return self.first

    def _margins(self, totals: Float) -> Float:
        return np.array([limit.sign * (totals[limit.term] / limit.unit - limit.bound) for limit in self.limits])

    def _statistics(self, x: Float) -> dict[str, Any]:
        def make() -> dict[str, Any]:
            try:
                found = self.evaluator.statistics(x)
            except TrialError as error:
                return {"x": x.tolist(), "failed": str(error)}
            return {"x": x.tolist(), "runs": found.of_runs.tolist(), "turbine": found.of_turbine}

        return self.history.get(f"values {x.tobytes().hex()}", make)

    def _found(self, entry: dict[str, Any]) -> Statistics:
        runs = np.array(entry["runs"], dtype=float).reshape(len(entry["runs"]), len(self.evaluator.of_runs))
        return Statistics(runs, entry["turbine"])

    def _totals(self, entry: dict[str, Any]) -> Float:
        totals, _ = self.evaluator.totals(self._found(entry))
        return np.array([*totals, *(entry["turbine"][t.name] for t in self.evaluator.of_turbine)])

    # -------------------------------------------------------------------------------------------- derivatives

    def jacobian(self, x: Float) -> Float:
        """(1 + L, P) derivatives of the objective and of the margins by the variables.

        Raises:
          TrialError: a neighbouring turbine cannot be built.
        """
        entry = self._statistics(x)
        if "failed" in entry:
            return np.zeros((1 + len(self.limits), len(x)))

        def make() -> dict[str, Any]:
            outputs = np.zeros((1 + len(self.limits), len(self.terms)))
            for t in self.objective:
                outputs[0, self._place(t)] += t.setting.weight / abs(float(self._first[self._place(t)]))
            for k, limit in enumerate(self.limits):
                outputs[1 + k, limit.term] = limit.sign / limit.unit
            kinds, inverse = np.unique(np.abs(outputs), axis=0, return_inverse=True)
            first = [int(np.flatnonzero(inverse == j)[0]) for j in range(len(kinds))]
            # two sides of a limit have the same derivatives but for the sign
            found = self.derivatives(x, outputs[first], self._found(entry))
            rows = []
            for k in range(len(outputs)):
                j = int(inverse.reshape(-1)[k])
                sign = 1.0 if np.array_equal(outputs[k], outputs[first[j]]) else -1.0
                rows.append(sign * found[j])
            return {"x": x.tolist(), "jacobian": np.array(rows).tolist()}

        return np.array(self.history.get(f"slopes {x.tobytes().hex()}", make)["jacobian"])

    # --------------------------------------------------------------------------------------------------- best

    def best(self) -> Trial:
        """The feasible trial with the smallest objective, or the one closest to feasible."""
        done = [t for t in self.trials if not t.failed]
        feasible = [t for t in done if t.violation <= FEASIBLE]
        if feasible:
            return min(feasible, key=lambda t: t.objective)
        return min(done, key=lambda t: (t.violation, t.objective))
