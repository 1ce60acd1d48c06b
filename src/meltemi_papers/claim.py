"""Claims of a paper, our results beside them, and their table."""

from __future__ import annotations

import csv
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from meltemi.report.html import Table
from meltemi.studies.run_store import guarded


@dataclass(frozen=True)
class Claim:
    """A claim of the paper and our result.

    Attributes:
      item: what it is about.
      paper: what the paper says.
      ours: what we find.
      verdict: "holds" or how it differs.
      where: in the paper.
      reason: key of the study's reasons; empty if there is nothing to explain.
      tolerance: within which it holds, where it is not said with the paper's number.
    """

    item: str
    paper: str
    ours: str
    verdict: str
    where: str
    reason: str = ""
    tolerance: str = ""


def listed(values: Iterable[float], form: str = "g") -> str:
    """Numbers separated by commas."""
    return ", ".join(format(x, form) for x in values)


def claims_of(study: str) -> Callable[..., Claim]:
    """Constructor of the claims that ``claims.csv`` in the folder of a study lists.

    They are called with a key, ours, the verdict and words. A verdict is whether it holds, or in words how it differs;
    words stand for what is in braces in the file.
    """
    stated = rows_of(study, "claims.csv")

    def claim(key: str, ours: str, verdict: object, **words: object) -> Claim:
        found = verdict if isinstance(verdict, str) else "holds" if verdict else "differs"
        return Claim(ours=ours, verdict=found, **{name: text.format(**words) for name, text in stated[key].items()})

    return claim


def rows_of(study: str, name: str) -> dict[str, dict[str, str]]:
    """Rows of a CSV file in the folder of a study, by their column ``key``."""
    with (HERE / study / name).open(newline="", encoding="utf-8") as file:
        return {row.pop("key"): row for row in csv.DictReader(file)}


def reasons_of(study: str) -> dict[str, str]:
    """Reasons for differences, by key: the paragraphs of ``reasons.md`` in the folder of a study."""
    return dict(re.findall(r"^\*(.+?):\* (.+)$", (HERE / study / "reasons.md").read_text(encoding="utf-8"), re.M))


HERE = Path(__file__).parent
UNJUDGED = "cannot be judged: "
"""How a verdict begins that depends on a cell that failed."""


def claim_group(item: str, where: str, of: Callable[[], list[Claim]]) -> list[Claim]:
    """Claims that need the same results; one line for all of them if a result is missing."""
    return guarded(of, lambda why: [Claim(item, "", "", UNJUDGED + why, where)])


def count_held(found: Sequence[Claim]) -> str:
    """Number of claims that hold, and of those that cannot be judged, if any."""
    lost = sum(c.verdict.startswith(UNJUDGED) for c in found)
    missing = f" ({lost} cannot be judged)" if lost else ""
    return f"{sum(c.verdict == 'holds' for c in found)} of {len(found)} lines hold{missing}."


def claims_table(found: Sequence[Claim]) -> Table:
    """Table of claims; with tolerances if any claim has one."""
    head = ["claim", "paper", "ours", "verdict", "reason", "where"]
    rows = [[c.item, c.paper, c.ours, c.verdict, c.reason, c.where] for c in found]
    if any(c.tolerance for c in found):
        head.insert(2, "tolerance")
        for row, c in zip(rows, found, strict=True):
            row.insert(2, c.tolerance)
    return Table(head, rows, "Claims of the paper", text_columns=len(head))


def brief(table: Table) -> Table:
    """The table for a terminal, without reasons and places in the paper."""
    n = len(table.head) - 2
    return Table(table.head[:n], [row[:n] for row in table.rows], table.caption, text_columns=n)


def reason_lines(reasons: Mapping[str, str]) -> list[str]:
    """Reasons as paragraphs of Markdown."""
    return [f"*{key}:* {words}" for key, words in reasons.items()]
