"""Claims of a paper, our results beside them, and their table."""

from __future__ import annotations

import csv
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, get_args

from meltemi_reports.blocks import Table
from meltemi_tuning.run_store import guarded

Basis = Literal["paper", "command", "equations", "expectation", "surrogate"]
"""What a claim rests on: the paper states it; it states what a run is commanded to do, so that no run predicts it; it
follows from the paper's equations, it is our expectation, or it is our surrogate of a turbine beside its
measurement, which the paper's model is not compared with."""


@dataclass(frozen=True)
class Claim:
    """A claim and our result.

    Attributes:
      item: what it is about.
      paper: what the paper says.
      ours: what we find.
      verdict: "holds", how it differs, or why it cannot be checked.
      where: in the paper.
      reason: key of the study's reasons; empty if there is nothing to explain.
      tolerance: within which it holds, where it is not said with the paper's number, and what it is derived from.
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

    They are called with a key, a verdict and words. A verdict is whether it holds, or in words how it differs; without
    one, that of the file stands. Words stand for what is in braces in the file.
    """
    stated = rows_of(study, "claims.csv")

    def claim(key: str, verdict: object = None, **words: object) -> Claim:
        fields: dict[str, Any] = {name: text.format(**words) for name, text in stated[key].items()}
        if verdict is not None:
            fields["verdict"] = verdict if isinstance(verdict, str) else "holds" if verdict else "differs"
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


def enough(seeds: int, verdict: object) -> object:
    """A verdict that rests on seeds, if they are enough."""
    return verdict if seeds >= FEWEST_SEEDS else f"{UNJUDGED}it needs {FEWEST_SEEDS} seeds, there are {seeds}"


def claim_group(item: str, where: str, of: Callable[[], list[Claim]]) -> list[Claim]:
    """Claims that need the same results; one line for all of them if a result is missing."""
    return guarded(of, lambda why: [Claim(item, "", "", UNJUDGED + why, where)])


@dataclass(frozen=True)
class Count:
    """Numbers of claims that the paper states: those that hold, differ, cannot be judged and cannot be checked."""

    held: int
    differ: int
    unjudged: int
    unchecked: int


def count(found: Sequence[Claim]) -> Count:
    """Count the claims that the paper states."""
    verdicts = [c.verdict for c in found if c.basis == "paper"]
    held = verdicts.count("holds")
    unjudged, unchecked = (sum(v.startswith(begin) for v in verdicts) for begin in (UNJUDGED, UNCHECKED))
    return Count(held, len(verdicts) - held - unjudged - unchecked, unjudged, unchecked)


def count_held(found: Sequence[Claim]) -> str:
    """Sentence on the number of the paper's claims that hold, and of those that cannot be judged or checked or that
    follow from a command, if any."""
    n = count(found)
    rest = [f"{k} cannot be {what}" for k, what in ((n.unjudged, "judged"), (n.unchecked, "checked")) if k]
    if commanded := sum(c.basis == "command" for c in found):
        rest.append(f"{commanded} more follow from a command")
    of = n.held + n.differ + n.unjudged
    return f"{n.held} of {of} claims of the paper hold" + (f" ({', '.join(rest)})." if rest else ".")


def claims_table(found: Sequence[Claim], caption: str = "Claims of the paper") -> Table:
    """Table of claims, those of the paper first; with tolerances if any claim has one."""
    columns = ["claim", "verdict", "reason", "paper", "tolerance", "ours", "basis", "where"]
    order = get_args(Basis).index
    rows = [
        [c.item, c.verdict, c.reason, c.paper, c.tolerance, c.ours, c.basis, c.where]
        for c in sorted(found, key=lambda c: order(c.basis))
    ]
    if not any(c.tolerance for c in found):
        columns.remove("tolerance")
        rows = [row[:4] + row[5:] for row in rows]
    return Table(columns, rows, caption, text_columns=len(columns))


def brief(table: Table) -> Table:
    """The table for a terminal, without basis, reasons and places in the paper."""
    shown = [i for i, name in enumerate(table.head) if name not in ("basis", "reason", "where")]
    rows = [[row[i] for i in shown] for row in table.rows]
    return Table([table.head[i] for i in shown], rows, table.caption, text_columns=len(shown))


def reason_lines(reasons: Mapping[str, str]) -> list[str]:
    """Reasons as paragraphs of Markdown."""
    return [f"*{key}:* {words}" for key, words in reasons.items()]
