"""A line of a paper's results beside ours, and the table of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from meltemi.report.html import Table


@dataclass(frozen=True)
class Claim:
    """A line of the paper's results.

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


def holds(ok: bool, otherwise: str = "differs") -> str:
    """The verdict."""
    return "holds" if ok else otherwise


def claims_table(found: Sequence[Claim]) -> Table:
    """The paper's results line by line; with tolerances if there are any."""
    head = ["claim", "paper", "ours", "verdict", "reason", "where"]
    rows = [[c.item, c.paper, c.ours, c.verdict, c.reason, c.where] for c in found]
    if any(c.tolerance for c in found):
        head.insert(2, "tolerance")
        for row, c in zip(rows, found, strict=True):
            row.insert(2, c.tolerance)
    return Table(head, rows, "Claims of the paper", text_columns=len(head))


def brief(table: Table) -> Table:
    """The same for a terminal: without reason and place."""
    n = len(table.head) - 2
    return Table(table.head[:n], [row[:n] for row in table.rows], table.caption, text_columns=n)
