"""Summary of the papers, from the tables of claims on their pages."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass

from meltemi.papers.claim import UNCHECKED, UNJUDGED
from meltemi.reports.blocks import Table
from meltemi.reports.markdown import table_lines, table_rows

CAPTION = "*Claims of the paper*"
NAMED = {"claim", "quantity", "scheme", "paper", "verdict", "tolerance", "basis", "reason", "where"}
"""Columns of the table; what else there is are our results."""


@dataclass(frozen=True)
class Line:
    """A claim of a paper on its page.

    Attributes:
      item, paper, ours, verdict: see ``Claim``.
      cause: first sentence of the reason for a difference.
    """

    item: str
    paper: str
    ours: str
    verdict: str
    cause: str

    @property
    def holds(self) -> bool:
        """Whether it holds in every reading."""
        return all(part.strip() == "holds" for part in self.verdict.split(" / "))

    @property
    def unchecked(self) -> bool:
        """Whether it cannot be checked or judged."""
        return self.verdict.startswith((UNCHECKED, UNJUDGED))


def claims_on(page: str) -> list[Line]:
    """Claims that the paper states, from the Markdown text of its page."""
    after = page.partition(CAPTION)[2].strip()
    head, *rows = table_rows(re.match(r"(?:\|.*\n?)*", after)[0].splitlines())  # type: ignore[index]
    reasons = re.findall(r"^\*(.+?):\* (.+)$", page, re.M)
    causes = {key: re.split(r"(?<!Fig)(?<=\w\w)\. ", words)[0].rstrip(".") for key, words in reasons}
    found = []
    for row in (dict(zip(head, cells, strict=True)) for cells in rows):
        if row.get("basis", "paper") == "paper":
            item = row.get("claim") or f"{row['quantity']}, {row['scheme']}"
            ours = ", ".join(value for name, value in row.items() if value and name not in NAMED)
            found.append(Line(item, row["paper"], ours, row["verdict"], causes.get(row["reason"], "")))
    return found


def summary(pages: Mapping[str, str]) -> str:
    """Markdown page on the papers of these pages, by file name."""
    lines = [
        *("# The papers in short", ""),
        "What the papers state, judged by their pages: claims that hold, that differ, with the cause, and that cannot",
        "be checked.",
        *("", "| paper | claims | hold | differ | cannot be checked |", "|---|---:|---:|---:|---:|"),
    ]
    chapters = []
    for name, page in pages.items():
        claims, title = claims_on(page), page.partition("\n")[0].lstrip("# ")
        held = [c.item for c in claims if c.holds]
        open_ = [c for c in claims if c.unchecked]
        differ = [c for c in claims if not c.holds and not c.unchecked]
        lines.append(f"| [{title}]({name}) | {len(claims)} | {len(held)} | {len(differ)} | {len(open_)} |")
        chapters += ["", f"## {title}", "", f"Hold: {'; '.join(held)}."]
        if differ:
            rows = [(c.item, c.paper, c.ours, c.cause) for c in differ]
            chapters += ["", *table_lines(Table(["claim", "paper", "ours", "cause"], rows, "Differ", text_columns=4))]
        if open_:
            chapters += ["", "Cannot be checked: " + "; ".join(f"{c.item} ({_why(c.verdict)})" for c in open_) + "."]
    return "\n".join([*lines, *chapters, ""])


def _why(verdict: str) -> str:
    return verdict.partition(": ")[2].removeprefix("because ")
