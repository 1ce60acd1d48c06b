"""Summary of the papers from the tables of claims on their pages."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass

from meltemi.papers.verdict import judgement_in
from meltemi.reports.blocks import Table
from meltemi.reports.markdown import table_lines, table_rows

CAPTION = "*Claims of the paper*"
STATED = "paper (tolerance)"
NAMED = {"claim", "quantity", "scheme", "paper", STATED, "verdict", "tolerance", "basis", "reason", "where"}
"""Columns of the table; what else there is are our results."""


@dataclass(frozen=True)
class SummaryLine:
    """Row of a claim on the page of a paper.

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
    def outcome(self) -> str:
        """Class of its verdict; claims that cannot be judged count as those that cannot be checked."""
        outcome = judgement_in(self.verdict).outcome
        return "unchecked" if outcome == "unjudged" else outcome


def claims_on(page: str) -> list[SummaryLine]:
    """Claims that the paper states, from the Markdown text of its page."""
    after = page.partition(CAPTION)[2].strip()
    head, *rows = table_rows(re.match(r"(?:\|.*\n?)*", after)[0].splitlines())  # type: ignore[index]
    reasons = re.findall(r"^\*(.+?):\* (.+)$", page, re.M)
    causes = {key: re.split(r"(?<!Fig)(?<=\w\w)\. ", words)[0].rstrip(".") for key, words in reasons}
    lines = []
    for row in (dict(zip(head, cells, strict=True)) for cells in rows):
        if row.get("basis", "paper") == "paper":
            item = row.get("claim") or f"{row['quantity']}, {row['scheme']}"
            ours = ", ".join(value for name, value in row.items() if value and name not in NAMED)
            stated = row.get("paper") or row.get(STATED, "")  # format of an earlier version of the page
            lines.append(SummaryLine(item, stated, ours, row["verdict"], causes.get(row["reason"], "")))
    return lines


def summary(pages: Mapping[str, str]) -> str:
    """Markdown page that summarises pages of papers, by file name."""
    lines = [
        *("# The papers in short", ""),
        "What the papers state, judged by their pages: claims that hold, that hold in one reading of the paper and not",
        "in another, that differ, with the cause, and that cannot be checked.",
        *("", "| paper | claims | hold | by reading | differ | cannot be checked |", "|---|---:|---:|---:|---:|---:|"),
    ]
    chapters = []
    for name, page in pages.items():
        claims, title = claims_on(page), page.partition("\n")[0].lstrip("# ")
        of = {kind: [c for c in claims if c.outcome == kind] for kind in ("held", "by_reading", "differ", "unchecked")}
        numbers = " | ".join(str(len(each)) for each in of.values())
        lines.append(f"| [{title}]({name}) | {len(claims)} | {numbers} |")
        chapters += ["", f"## {title}", "", f"Hold: {'; '.join(c.item for c in of['held'])}."]
        if of["by_reading"]:
            rows = [(c.item, c.verdict, c.paper, c.ours) for c in of["by_reading"]]
            head = ["claim", "verdict", "paper", "ours"]
            chapters += ["", *table_lines(Table(head, rows, "By reading", text_columns=4))]
        if of["differ"]:
            rows = [(c.item, c.paper, c.ours, c.cause) for c in of["differ"]]
            chapters += ["", *table_lines(Table(["claim", "paper", "ours", "cause"], rows, "Differ", text_columns=4))]
        if open_ := of["unchecked"]:
            chapters += ["", "Cannot be checked: " + "; ".join(f"{c.item} ({_why(c.verdict)})" for c in open_) + "."]
    return "\n".join([*lines, *chapters, ""])


def _why(verdict: str) -> str:
    return verdict.partition(": ")[2].removeprefix("because ")
