"""Claims of a paper, the corresponding results, and their table."""

from __future__ import annotations

import csv
import re
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, get_args

from meltemi.reports.blocks import Table
from meltemi.tuning.run_store import guarded

Basis = Literal["paper", "equations", "command", "expectation", "surrogate"]
"""What a claim rests on: the paper states it, it follows from the paper's equations or from a command that the
simulation is given, so that it predicts nothing, it is our expectation, or it is our surrogate of a turbine beside its
measurement, which the paper's model is not compared with."""


@dataclass(frozen=True)
class Claim:
    """A claim of a paper and our result.

    Attributes:
      item: subject of the claim.
      paper: statement of the paper.
      ours: our result.
      verdict: "holds", the difference, or why it cannot be checked; for each reading of the paper if it depends on it.
      where: place in the paper.
      reason: key of the study's reasons; empty if nothing needs an explanation.
      tolerance: tolerance of the verdict, unless it is stated with the paper's number, and its origin.
      basis: only claims that the paper states are counted.
    """

    item: str
    paper: str
    ours: str
    verdict: str
    where: str
    reason: str = ""
    tolerance: str = ""
    basis: Basis = "paper"


def listed(values: Iterable[float], form: str = "g") -> str:
    """Numbers separated by commas."""
    return ", ".join(format(x, form) for x in values)


def claims_of(study: str) -> Callable[..., Claim]:
    """Constructor of the claims that ``claims.csv`` in the folder of a study lists.

    It is called with a key, a verdict and texts. A verdict is whether the claim holds, or a text on the difference;
    without one, that of the file is used. The texts replace the names in braces in the file.
    """
    stated = rows_of(study, "claims.csv")

    def claim(key: str, verdict: object = None, **words: object) -> Claim:
        fields: dict[str, Any] = {name: text.format(**words) for name, text in stated[key].items()}
        if verdict is not None:
            fields["verdict"] = _verdict_text(verdict)
        return Claim(**fields)

    return claim


def rows_of(study: str, name: str) -> dict[str, dict[str, str]]:
    """Rows of a CSV file in the folder of a study, by their column ``key``."""
    with (HERE / study / name).open(newline="", encoding="utf-8") as file:
        return {row.pop("key"): row for row in csv.DictReader(file)}


def reasons_of(study: str) -> dict[str, str]:
    """Reasons for differences, by key: the paragraphs of ``reasons.md`` in the folder of a study."""
    return paragraphs_of(study, "reasons.md")


def paragraphs_of(study: str, name: str) -> dict[str, str]:
    """Paragraphs of a Markdown file in the folder of a study, by the key that each begins with."""
    return dict(re.findall(r"^\*(.+?):\* (.+)$", (HERE / study / name).read_text(encoding="utf-8"), re.M))


HERE = Path(__file__).parent
UNJUDGED = "cannot be judged: "
"""How a verdict begins that depends on a cell that failed."""
FEWEST_SEEDS = 4
"""Below which intervals are as wide as effects, and nothing is judged by them."""
UNCHECKED = "cannot be checked: "
"""How a verdict begins on a claim for which the paper, or this simulation, lacks what a comparison needs."""


def _verdict_text(verdict: object) -> str:
    return verdict if isinstance(verdict, str) else "holds" if verdict else "differs"


def by_reading(verdict_by_reading: Mapping[str, object]) -> str:
    """Combined verdict of a claim over the readings of the paper: one if all agree, otherwise each with its reading."""
    verdicts = {reading: _verdict_text(verdict) for reading, verdict in verdict_by_reading.items()}
    same = set(verdicts.values())
    return same.pop() if len(same) == 1 else " / ".join(f"{each} ({reading})" for reading, each in verdicts.items())


Outcome = Literal["held", "by_reading", "differ", "unjudged", "unchecked"]


def outcome(verdict: str) -> Outcome:
    """Category of a verdict: ``by_reading`` if it differs between readings of the paper."""

    def of(part: str) -> Outcome:
        if part.startswith("holds only"):
            return "by_reading"
        begins: dict[str, Outcome] = {UNJUDGED: "unjudged", UNCHECKED: "unchecked", "holds": "held"}
        return next((name for begin, name in begins.items() if part.startswith(begin)), "differ")

    outcomes = {of(part) for part in verdict.split(" / ")}
    return outcomes.pop() if len(outcomes) == 1 else "by_reading"


def enough(seeds: int, verdict: object) -> object:
    """A verdict that depends on the number of seeds, if there are enough."""
    return verdict if seeds >= FEWEST_SEEDS else f"{UNJUDGED}it needs {FEWEST_SEEDS} seeds, there are {seeds}"


def claim_group(item: str, where: str, of: Callable[[], list[Claim]]) -> list[Claim]:
    """Claims that need the same results; one row for all of them if a result is missing."""
    return guarded(of, lambda why: [Claim(item, "", "", UNJUDGED + why, where)])


def count(claims: Sequence[Claim]) -> Counter[Outcome]:
    """Numbers of claims that the paper states, by category of their verdicts."""
    return Counter(outcome(c.verdict) for c in claims if c.basis == "paper")


def count_held(claims: Sequence[Claim]) -> str:
    """Sentences on the number of the paper's claims that hold, and on those that depend on the reading of the paper."""
    n = count(claims)
    open_: dict[Outcome, str] = {"unjudged": "judged", "unchecked": "checked"}
    rest = [f"{n[k]} cannot be {what}" for k, what in open_.items() if n[k]]
    some = f", {n['by_reading']} in one reading of it and not in another" if n["by_reading"] else ""
    of = n.total() - n["unchecked"]
    summary = f"{n['held']} of {of} claims of the paper hold{some}" + (f" ({', '.join(rest)})." if rest else ".")
    hinge = [f"{c.item}: {c.verdict}" for c in claims if c.basis == "paper" and outcome(c.verdict) == "by_reading"]
    return f"{summary} By reading: {'; '.join(hinge)}." if hinge else summary


def claims_table(claims: Sequence[Claim], caption: str = "Claims of the paper") -> Table:
    """Table of claims, those of the paper first; with a column for the basis if it is not the paper for all."""
    order = get_args(Basis).index
    columns = ["claim", "verdict", "reason", "paper (tolerance)", "ours", "where", "basis"]
    stated = {c: f"{c.paper} ({c.tolerance})" if c.tolerance else c.paper for c in claims}
    rows = [
        [c.item, c.verdict, c.reason, stated[c], c.ours, c.where, c.basis]
        for c in sorted(claims, key=lambda c: order(c.basis))
    ]
    n = len(columns) if {c.basis for c in claims} - {"paper"} else len(columns) - 1
    return Table(columns[:n], [row[:n] for row in rows], caption, text_columns=n)


def brief(table: Table) -> Table:
    """The table for the terminal: claim, verdict, and both results."""
    shown = [table.head.index(name) for name in ("claim", "verdict", "paper (tolerance)", "ours")]
    rows = [[row[i] for i in shown] for row in table.rows]
    return Table([table.head[i] for i in shown], rows, table.caption, text_columns=len(shown))


def reason_lines(reasons: Mapping[str, str]) -> list[str]:
    """Reasons as paragraphs of Markdown."""
    return [f"*{key}:* {words}" for key, words in reasons.items()]
