"""Derivatives of the runs of a design by its variables: of tables, starts, controllers, and by adjoints of the runs.

Reference: docs/theory/designs.md (D-17 to D-21).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from meltemi.cases.case import LoadCase, case_start
from meltemi.compiler import N_DERIVATIVES, members
from meltemi.control.controller import Controller, StartPoint
from meltemi.core.errors import InputError, MeltemiError
from meltemi.core.fingerprint import fingerprint
from meltemi.designs.kept import keep
from meltemi.designs.runs import HELD, START_STEP, WITHOUT_START, Runs, Statistics, TrialError, group_of, with_entries
from meltemi.designs.terms import Term, of_turbine
from meltemi.designs.variables import Variable
from meltemi.gradients.adjoint import gradients
from meltemi.gradients.extrapolation import STEP, extrapolated
from meltemi.gradients.sensitivity import Direction, count_switches, table_slopes
from meltemi.gradients.sensitivity import seed as seeded
from meltemi.loadcases.batch import told_to_end
from meltemi.simulation.case import Case
from meltemi.simulation.plan import first_point
from meltemi.simulation.points import initial_state
from meltemi.simulation.result import Result
from meltemi.simulation.simulate import Simulation, march
from meltemi.simulation.start import Start

Float = NDArray[np.float64]
OF_START = ("q", "v", "pitch", "drive", "demands", "gears", "controller_state")
"""Arrays that the start of a run sets, besides those of inflow and stall."""
RUN_STEP = 1e-2
"""Step of differences of runs over the scale of a variable."""
SWITCH_STEP = 1e-4
"""Step over the scale of a variable within which switches are counted."""
NEGLIGIBLE = 1e-6
"""Share of a run in the derivative of a term, over the largest one, below which its adjoint is left out: that of most
runs in an extreme of all."""


def moved(x: Float, p: int, change: float) -> Float:
    """A design with a variable changed."""
    beside = x.copy()
    beside[p] += change
    return beside


def unreachable(v: Variable, why: object) -> str:
    """What to do where neighbours of a design cannot be evaluated."""
    return (
        f"variables: {v.name!r}: neighbours of the start cannot be evaluated ({why}): give closer bounds than "
        f"{v.low:g} to {v.high:g}, or the scale of a usual change"
    )


class Derivatives:
    """Derivatives of the statistics of runs.

    Args:
      runs: the runs.

    Attributes:
      without: variables whose derivatives are differences of runs, and why.
      table_error: largest relative error of the derivatives of tables.
    """

    def __init__(self, runs: Runs) -> None:
        self.runs, self.each = runs, runs.variables.each
        self.without, self.table_error = dict[str, str](), 0.0
        self._starts: dict[tuple[Any, ...], dict[str, Float]] = {}
        self._strains: dict[str, dict[str, Float]] = {}
        self._last: tuple[bytes, dict[str, list[dict[str, Float]]]] = (b"", {})

    def of(self, x: Float, outputs: Float, found: Statistics) -> Float:
        """(K, P) derivatives of outputs by the variables, in their own units.

        Args:
          outputs: (K, terms) derivatives of the outputs by the totals, those of runs first.
          found: statistics of the trial.

        Raises:
          TrialError: a neighbouring turbine cannot be built.
          KeyboardInterrupt: by Ctrl-C.
        """
        k, m = len(outputs), len(self.runs.of_runs)
        total, (_, inner) = np.zeros((k, len(self.each))), self.runs.totals(found)
        by = np.zeros((len(self.runs.cases), k, m))
        for i, each in enumerate(inner):
            each = np.where(np.abs(each) < NEGLIGIBLE * np.abs(each).max(), 0.0, each)
            by[:, :, i] = each[:, None] * outputs[None, :, i]
        ways = self._groups(x)
        if m:
            self._strains = {t.name: self._strain_slopes(t, x) for t in self.runs.of_runs if t.strain}
            parts = self.runs.of_cases(lambda n: self._part(x, n, by[n], ways))
            total += np.sum(parts, axis=0)
        if self.runs.of_turbine:
            total += outputs[:, m:] @ self._fixed(x)
        return total

    def step(self, x: Float, p: int) -> float:
        """Step of the differences of tables by a variable."""
        v = self.each[p]
        return min(STEP * abs(float(x[p])), v.scale) if x[p] != 0.0 and not v.add else STEP * v.scale

    def _groups(self, x: Float) -> dict[str, list[dict[str, Float]]]:
        """Derivatives of the tables by group of cases; those of the last design are kept.

        Raises:
          TrialError: a neighbouring turbine cannot be built.
        """
        if self._last[0] != x.tobytes():
            cases = {group_of(case.case): case.case for case in self.runs.cases}
            try:
                self._last = x.tobytes(), {group: self._tables(x, case) for group, case in cases.items()}
            except MeltemiError as error:
                raise TrialError(str(error)) from None
        return self._last[1]

    def _tables(self, x: Float, case: LoadCase) -> list[dict[str, Float]]:
        """Derivatives of the model's tables by each variable."""
        model, found = self.runs.model(x, case), []
        for p, v in enumerate(self.each):
            arrays: dict[str, Float] = {}
            if not v.of_law and v.name not in self.without:
                try:
                    turbine = partial(self._turbine_beside, x, case, p)
                    arrays, error = table_slopes(v.name, model, turbine, self.step(x, p))
                    self.table_error = max(self.table_error, error)
                except InputError as refused:  # without derivatives, or no turbine so far away
                    self.without[v.name] = str(refused).partition(": ")[2].partition(", which")[0]
            found.append(arrays)
        return found

    def ways(self, x: Float, number: int, arrays: Sequence[dict[str, Float]]) -> list[Direction]:
        """Changes of the inputs of a case by each variable: of tables, start, and state of the controller (D-21)."""
        case, found = self.runs.cases[number].case, []
        point = first_point(self.runs.model(x, case), self.runs.hold(number).steady, self._start(x, number))
        for p, v in enumerate(self.each):
            state: dict[str, Float] = {}
            if v.of_law:
                key = (x.tobytes(), p, point, fingerprint(case.controller))
                if key not in self._starts:
                    beside = partial(self._state_beside, x, case, point, p)
                    self._starts[key] = extrapolated(beside, self.step(x, p))[0]
                state = dict(self._starts[key])
            begin = self._begins(x, number, p)
            if "controller_state" in begin and "controller_state" in state:
                state["controller_state"] = state["controller_state"] + begin["controller_state"]
            changes = {} if v.name in self.without else {**begin, **arrays[p], **state}
            found.append(Direction(v.name, float(x[p]), 1.0, changes))
        return found

    def _start(self, x: Float, number: int, about: Float | None = None) -> Any:
        case, steady = self.runs.cases[number].case, self.runs.hold(number).steady
        model = self.runs.model(x, case, about)
        return initial_state(model, steady, case_start(case, model.turbine))[0]

    def _begins(self, x: Float, number: int, p: int) -> dict[str, Float]:
        """Derivatives of the start of a case by a variable, by differences; the same for all seeds of a mean wind.

        A variable that changes other arrays, which carry no derivatives, is left to differences of runs.
        """
        v, case, steady = self.each[p], self.runs.cases[number].case, self.runs.hold(number).steady
        if v.of_controller or v.path in WITHOUT_START or v.name in self.without:
            return {}
        key = (x.tobytes(), group_of(case), steady.content_hash(), fingerprint(case.start, case.controller), p)
        with self.runs.lock:
            if key in self._starts:
                return self._starts[key]
        h, sides, law = START_STEP * v.scale, [], self.runs.controller(x, case)
        for sign in (-1.0, 1.0):
            beside = moved(x, p, sign * h)
            try:
                model, start = self.runs.model(beside, case, x), self._start(beside, number, x)
            except MeltemiError as error:
                raise TrialError(unreachable(v, error)) from None
            at = Case(model, steady)
            start.set(at) if isinstance(start, Start) else start.put(at)
            arrays = {n: a for n, a in at.arrays.items() if isinstance(a, np.ndarray) and a.dtype == np.float64}
            arrays["controller_state"] = law.initial_state(first_point(model, steady, start))
            sides.append({n: a.copy() for n, a in arrays.items() if n not in (*HELD, "weights")})
        low, high = sides
        changed = {n for n, a in high.items() if not np.array_equal(a, low[n], equal_nan=True)}
        records: list[Any] = [type(each) for each in (at.system, at.sections, at.control)]
        if held := changed & {n for r in records for n, member in members(r).items() if member.constant}:
            self.without[v.name] = f"it changes the {' and '.join(sorted(held))} of the simulation"
        set_at_start = changed & {*at.aero_state.views, *OF_START}
        found = {n: (high[n] - low[n]) / (2.0 * h) for n in set_at_start}
        with self.runs.lock:
            return keep(self._starts, key, found, 4096)

    def _turbine_beside(self, x: Float, case: LoadCase, p: int, change: float) -> Any:
        return self.runs.turbine(moved(x, p, change), case, x)

    def _state_beside(self, x: Float, case: LoadCase, point: StartPoint, p: int, change: float) -> dict[str, Float]:
        """Initial state of the controller with a variable changed."""
        beside = moved(x, p, change)
        law = self.runs.law(beside, case, self.runs.turbine(beside, case, x))
        law = with_entries(law, self.runs.variables.entries(beside))
        return {"controller_state": law.initial_state(point)}

    def _part(self, x: Float, number: int, by: Float, ways: Mapping[str, Any]) -> Float:
        """(K, P) contribution of a case to the derivatives."""
        case = self.runs.cases[number].case
        run, prepare = self.runs.run(x, number)
        directions = self.ways(x, number, ways[group_of(case)])
        used = [k for k in range(len(by)) if np.any(by[k])]

        def objectives(result: Result) -> list[tuple[float, dict[str, Float]]]:
            numbers = self.runs.numbers(x, result, number)
            for i, (term, (_, weights)) in enumerate(zip(self.runs.of_runs, numbers, strict=True)):
                for channel, slope in self._strains.get(term.name, {}).items():  # the moments held
                    held[...] += by[:, i, None] * (weights[channel] @ result[channel]) * slope
            weighted = []
            for k in used:
                sums: dict[str, Float] = {}
                for share, (_, weights) in zip(by[k], numbers, strict=True):
                    for channel, series in weights.items():
                        sums[channel] = sums.get(channel, 0.0) + share * series
                weighted.append((0.0, sums))
            return weighted

        total, held = (np.zeros((len(by), len(directions))) for _ in range(2))
        if used and not told_to_end():
            total[used] = gradients(run, objectives, directions, prepare=prepare).slopes
            total += held * [v.name not in self.without for v in self.each]
            self.runs.seconds += (3.3 + 2.0 * len(used)) * run.duration
        for p, v in enumerate(self.each):
            if v.name in self.without:
                h = RUN_STEP * v.scale
                try:
                    low, high = (self.runs.row(moved(x, p, sign * h), number) for sign in (-1.0, 1.0))
                except MeltemiError as error:
                    raise TrialError(unreachable(v, error)) from None
                total[:, p] += by @ (high - low) / (2.0 * h)
        return total

    def _strain_slopes(self, term: Term, x: Float) -> dict[str, Float]:
        """(P,) derivatives of the logarithm of strains by moments, by channel."""

        def strains(p: int, h: float) -> dict[str, Float]:
            """Strains with a variable changed."""
            return {"strain": np.array(list((self.runs.factors(term, moved(x, p, h), x) or {}).values()))}

        factors = self.runs.factors(term, x) or {}
        rows = np.zeros((len(x), len(factors)))
        for p, v in enumerate(self.each):
            if not v.of_law:
                rows[p] = extrapolated(partial(strains, p), self.step(x, p))[0].get("strain", 0.0)
        pairs = zip(factors.items(), rows.T, strict=True)
        return {name: row / factor if factor else np.zeros(len(x)) for (name, factor), row in pairs}

    def switches(self, x: Float, numbers: Sequence[int]) -> list[dict[str, int]]:
        """What would switch in some cases within a small step of the variables: counts by kind.

        Besides a step of all variables alike, the first of them have own ones, as many as are computed at once.
        """
        tables = self._groups(x)

        def count(number: int) -> dict[str, int]:
            run, prepare = self.runs.run(x, number)
            ways = self.ways(x, number, tables[group_of(self.runs.cases[number].case)])
            steps = [replace(w, step=SWITCH_STEP * v.scale) for w, v in zip(ways, self.each, strict=True)]
            names = {name for way in steps for name in way.arrays}
            both = {n: np.sum([w.step * w.arrays[n] for w in steps if n in w.arrays], axis=0) for n in names}
            some = [Direction("all", 0.0, 1.0, both), *steps][:N_DERIVATIVES]

            def begin(case: Case) -> None:
                prepare(case)
                known = [{n: a for n, a in way.arrays.items() if n in case.slopes} for way in some]
                seeded(case, [replace(way, arrays=arrays) for way, arrays in zip(some, known, strict=True)])

            watched = replace(run, channels=(*run.channels, "operating_state"))
            simulation = Simulation(watched, numbers="duals", prepare=begin)
            march(simulation, stop=told_to_end)
            if simulation.interrupted:
                raise KeyboardInterrupt
            self.runs.seconds += 3.0 * run.duration
            result = simulation.result()
            found = count_switches(simulation.case, cast("Controller", run.controller))
            found["changes of the supervisor's state"] = int(np.count_nonzero(np.diff(result["operating_state"])))
            return {kind if "state" in kind else f"switches of {kind}": int(n) for kind, n in found.items() if n}

        return self.runs.of_cases(count, numbers)

    def _fixed(self, x: Float) -> Float:
        """(terms, P) derivatives of the terms of the turbine itself."""
        case = self.runs.cases[0].case
        still = [t for t in self.runs.of_turbine if not t.of_operation]
        found = {t.name: np.zeros(len(x)) for t in still} | self.runs.operation.slopes(x)

        def terms(p: int, h: float) -> dict[str, Float]:
            """Terms with a variable changed."""
            model = self.runs.model(moved(x, p, h), case, x)
            return {t.name: np.array([of_turbine(t, model)]) for t in still}

        for p, v in enumerate(self.each):
            if still and not v.of_law:
                slopes, _ = extrapolated(partial(terms, p), 0.1 * self.step(x, p))
                for name, slope in slopes.items():
                    found[name][p] = float(slope[0])
        return np.array([found[t.name] for t in self.runs.of_turbine])
