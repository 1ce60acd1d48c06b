"""Claims of a paper, the corresponding results, and their table."""

from __future__ import annotations

import csv
import re
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, get_args

from meltemi.papers.verdict import Judged, Judgement, Outcome, judgement, judgement_in, unjudged
from meltemi.reports.blocks import Table
from meltemi.tuning.run_store import guarded

Basis = Literal["paper", "equations", "command", "expectation", "surrogate"]
"""Basis of a claim: the paper states it, it follows from the paper's equations or from a command that the
simulation is given, so that it predicts nothing, it is our expectation, or it is our surrogate of a turbine beside its
measurement, which the paper's model is not compared with."""


@dataclass(frozen=True)
class Claim:
    """A claim of a paper and our result.

    Attributes:
      item: subject.
      paper: statement of the paper.
      ours: our result.
      judgement: whether it holds, in each reading of the paper if it depends on the reading.
      where: place in the paper.
      reason: key of the study's reasons; empty if there is nothing to explain.
      tolerance: tolerance within which it holds and its origin, unless they are given with the paper's number.
      basis: basis; only claims that the paper states are counted.
      by_few: whether it holds, in a reading, by few of our numbers only.
    """

    item: str
    paper: str
    ours: str
    judgement: Judgement
    where: str
    reason: str = ""
    tolerance: str = ""
    basis: Basis = "paper"
    by_few: bool = False

    @property
    def verdict(self) -> str:
        """The judgement in words."""
        return self.judgement.text

    @property
    def outcome(self) -> Outcome:
        """Verdict of the judgement."""
        return self.judgement.outcome


def listed(values: Iterable[float], form: str = "g") -> str:
    """Numbers separated by commas."""
    return ", ".join(format(x, form) for x in values)


def claims_of(study: str) -> Callable[..., Claim]:
    """Constructor of the claims that ``claims.csv`` in the folder of a study lists.

    It is called with a key, whether the claim holds, and the words for the braces of the file; without a verdict, that
    of the file holds.
    """
    stated = rows_of(study, "claims.csv")

    def claim(key: str, holds: Judged | None = None, **words: object) -> Claim:
        fields: dict[str, Any] = {name: text.format(**words) for name, text in stated[key].items()}
        text = fields.pop("verdict")
        return Claim(**fields, judgement=judgement_in(text) if holds is None else judgement(holds))

    return claim


def rows_of(study: str, name: str) -> dict[str, dict[str, str]]:
    """Rows of a CSV file in the folder of a study, by their column ``key``."""
    with (HERE / study / name).open(newline="", encoding="utf-8") as file:
        return {row.pop("key"): row for row in csv.DictReader(file)}


def reasons_of(study: str) -> dict[str, str]:
    """Reasons for differences, by key: the paragraphs of ``reasons.md`` in the folder of a study."""
    return _paragraphs(study, "reasons.md")


def sentences_of(study: str) -> Callable[..., str]:
    """Function of the sentences in ``words.md`` in the folder of a study: called with a key, and the numbers that
    stand for what is in braces in the file."""
    paragraphs = _paragraphs(study, "words.md")
    return lambda key, **numbers: paragraphs[key].format(**numbers)


def _paragraphs(study: str, name: str) -> dict[str, str]:
    """Paragraphs of a Markdown file in the folder of a study, by the key at their beginning."""
    return dict(re.findall(r"^\*(.+?):\* (.+)$", (HERE / study / name).read_text(encoding="utf-8"), re.M))


HERE = Path(__file__).parent


def claim_group(item: str, where: str, of: Callable[[], list[Claim]]) -> list[Claim]:
    """Claims that need the same results; one row for all of them if a result is missing."""
    return guarded(of, lambda why: [Claim(item, "", "", judgement(unjudged(why)), where)])


def count(claims: Sequence[Claim]) -> Counter[Outcome]:
    """Numbers of claims that the paper states, by category of their verdicts."""
    return Counter(c.outcome for c in claims if c.basis == "paper")


def count_held(claims: Sequence[Claim]) -> str:
    """Sentences on the number of the paper's claims that hold, and on those that depend on the reading of the paper."""
    n = count(claims)
    open_: dict[Outcome, str] = {"unjudged": "judged", "unchecked": "checked"}
    rest = [f"{n[k]} cannot be {what}" for k, what in open_.items() if n[k]]
    some = f", {n['by_reading']} in one reading of it and not in another" if n["by_reading"] else ""
    of = n.total() - n["unchecked"]
    summary = f"{n['held']} of {of} claims of the paper hold{some}" + (f" ({', '.join(rest)})." if rest else ".")
    hinge = [f"{c.item}: {c.verdict}" for c in claims if c.basis == "paper" and c.outcome == "by_reading"]
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
