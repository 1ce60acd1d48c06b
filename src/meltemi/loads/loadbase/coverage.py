"""Coverage of a load base: states of its cases, and consequences of missing, failed and doubtful ones for the loads."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from meltemi.core.errors import Status
from meltemi.loads.loadbase.jobs import jobs_of, names_by_key
from meltemi.loads.loadbase.plan import Plan, PlannedCase
from meltemi.loads.loadbase.store import ResultStore
from meltemi.turbine.library import load_turbine
from meltemi.turbine.plausibility import plausibility_warnings

if TYPE_CHECKING:
    import pandas as pd

STATES = ("ok", "warned", "doubtful", "failed", "missing", "unsupported")
"""A warned case ended within the range of validity, with warnings."""
MEANINGS = (
    ("tower's surface", "tower strike: loads do not include the impact"),
    ("comes close to the tower", "tip clearance below the required share of that of the undeflected rotor"),
    ("model's range", "deflection beyond the range of validity of the model: loads of this case are uncertain"),
    ("range of their model", "deflection beyond the range of validity of the model: loads of this case are uncertain"),
    (
        "rotor faster",
        "overspeed beyond the design range, where a protection system would have acted: not valid as design loads",
    ),
    ("overspeed", "overspeed: loads are valid only if the protection system acts no earlier"),
    ("stopped at", "the supervisor stopped the turbine: loads after that are not those of power production"),
    ("vibration", "instability: loads depend on its duration"),
    ("unstable", "instability: loads depend on its duration"),
    ("the run needs", "not simulated: the wind field is shorter than the run or does not cover the rotor"),
)
"""Meaning of messages and warnings, by words that they contain."""
UNCERTAIN = "outside the range of validity of the model: loads of this case are uncertain"
LOST = "no results: excluded from all loads"
FEW = 3
"""Smallest number of runs whose common warning becomes one of the load base."""


@dataclass(frozen=True)
class Results:
    """Results of the cases of a plan.

    Attributes:
      plan: plan of the load base.
      store: store with the results.
      keys: names of the cases by key.
      states: state of each case, one of ``STATES``.
      messages: message and warnings of the cases that are not simply OK.
      present: cases with loads that are evaluated.
      common: warnings of the whole load base: about the turbine, and those that all runs share word for word; single
        cases do not repeat them.
    """

    plan: Plan
    store: ResultStore = field(repr=False)
    keys: dict[str, list[str]] = field(repr=False)
    states: dict[str, str] = field(repr=False)
    messages: dict[str, str] = field(repr=False)
    present: tuple[PlannedCase, ...] = field(repr=False)
    common: tuple[str, ...]

    def table(self, what: str, channels: Sequence[str] | None = None) -> pd.DataFrame:
        """A table of the cases that are evaluated, see ``ResultStore.table``."""
        return self.store.table(self.keys, what, channels)


def read_results(plan: Plan, folder: str | Path, *, doubtful: bool = True) -> Results:
    """Results of a plan.

    Args:
      doubtful: whether doubtful cases are evaluated.

    Raises:
      InputError: the turbine, a file of the controller or a file of the results cannot be read.
    """
    every, store = names_by_key(jobs_of(plan)), ResultStore(folder)
    states = {case.name: "unsupported" if case.unsupported else "missing" for case in plan.cases}
    messages = {case.name: case.unsupported or "not simulated" for case in plan.cases}
    frame, common = store.table(every), turbine_warnings(plan)
    if len(frame):
        complete = frame[[Status[word].complete for word in frame["status"]]]
        common = tuple(dict.fromkeys([*common, *shared(complete["warnings"].to_dict())]))
        for name, word, message, warnings in frame[["status", "message", "warnings"]].itertuples():
            status, lines = Status[word], [str(line) for line in warnings if str(line) not in common]
            ended = "ok" if status is Status.OK else "doubtful"
            states[name] = "failed" if not status.complete else "warned" if ended == "ok" and lines else ended
            messages[name] = "; ".join([message] * (status is not Status.OK) + lines)
    evaluated_states = ("ok", "warned", *["doubtful"] * doubtful)
    present = tuple(case for case in plan.cases if states[case.name] in evaluated_states)
    names = {case.name for case in present}
    keys = {key: evaluated for key, given in every.items() if (evaluated := [name for name in given if name in names])}
    return Results(plan, store, keys, states, messages, present, common)


def turbine_warnings(plan: Plan) -> tuple[str, ...]:
    """Warnings about the turbine of a plan, which hold for all cases: implausible data, static mooring lines."""
    turbine = load_turbine(plan.campaign.turbine)
    static = getattr(getattr(turbine, "platform", None), "tension_warning", "")
    return (*filter(None, [static]), *plausibility_warnings(turbine))


def shared(warnings: Mapping[str, Sequence[str]]) -> list[str]:
    """Warnings that all cases have word for word, from a few cases on."""
    counts = Counter(line for lines in warnings.values() for line in dict.fromkeys(map(str, lines)))
    return [line for line, n in counts.items() if n == len(warnings) >= FEW]


def problems_of(results: Results) -> pd.DataFrame:
    """Cases that are not simply OK; index case, columns row, dlc, state, message, meaning."""
    import pandas as pd

    evaluated = {case.name for case in results.present}
    lines = []
    for case in results.plan.cases:
        if (state := results.states[case.name]) != "ok":
            message = results.messages[case.name]
            meanings = list(dict.fromkeys(meaning for words, meaning in MEANINGS if words in message))
            meanings = meanings or [UNCERTAIN] * (state == "doubtful")
            meaning = "; ".join([LOST] * (case.name not in evaluated) + meanings)
            lines.append((case.name, case.row, case.dlc, state, message, meaning))
    return pd.DataFrame(lines, columns=["case", "row", "dlc", "state", "message", "meaning"]).set_index("case")


def coverage_of(results: Results) -> pd.DataFrame:
    """Cases of each row of the table by state; see ``DesignLoads.coverage``."""
    import pandas as pd

    counts: dict[str, Counter[str]] = {name: Counter() for name in results.plan.table.rows}
    for case in results.plan.cases:
        counts[case.row][results.states[case.name]] += 1
    evaluated = Counter(case.row for case in results.present)
    lost = lost_shares(results)
    lines = []
    for name, row in results.plan.table.rows.items():
        n, n_evaluated = counts[name].total(), evaluated[name]
        words = ""
        if n_evaluated < n:
            words = f"{n - n_evaluated} of {n} cases have no results: {_consequence(row.type, lost.get(name, 0.0))}"
        if n and not n_evaluated:
            words = f"{n} of {n} cases have no results: the load case is not evaluated"
        states = [counts[name][state] for state in STATES]
        lines.append((name, results.plan.table.dlc(name), row.title, row.type, n, *states, not words, words))
    head = ["row", "dlc", "title", "type", "cases", *STATES, "complete", "meaning"]
    return pd.DataFrame(lines, columns=head).set_index("row")


def _consequence(kind: str, lost: float) -> str:
    """Consequence of missing cases for ultimate or fatigue loads, by the share of lost occurrences."""
    if kind != "fatigue":
        return "extreme loads may be underestimated"
    if lost <= 0.0:
        return "their time is assigned to the other cases of the same wind speed and yaw error"
    return f"{100.0 * lost:.2g} % of the occurrences have no case, so that damage and energy are underestimated"


Condition = tuple[str, str, float, float | None]


def condition_of(case: PlannedCase) -> Condition:
    """Row, wind model, speed and yaw error: cases of fatigue that share their time differ in the rest."""
    return case.row, case.variant.model, case.variant.speed, case.variant.yaw


def shared_repetitions(results: Results) -> dict[str, float]:
    """Occurrences of each fatigue case in the lifetime, including its part of those of missing cases (L-34)."""
    planned, present = Counter(map(condition_of, results.plan.cases)), Counter(map(condition_of, results.present))
    return {
        case.name: case.weight.repetitions * planned[condition_of(case)] / present[condition_of(case)]
        for case in results.present
        if case.weight
    }


def lost_shares(results: Results) -> dict[str, float]:
    """Share of the repetitions of each row of fatigue whose condition has no case at all."""
    covered = {condition_of(case) for case in results.present}
    whole, lost = defaultdict[str, float](float), defaultdict[str, float](float)
    for case in results.plan.cases:
        if case.weight:
            whole[case.row] += case.weight.repetitions
            lost[case.row] += case.weight.repetitions * (condition_of(case) not in covered)
    return {row: lost[row] / total for row, total in whole.items() if total > 0.0}
