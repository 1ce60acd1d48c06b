"""Verdicts on the paper by reading: model of the turbine, edition of the standard, with and without detuned pitch."""

from __future__ import annotations

from collections.abc import Sequence

from meltemi.papers.claim import Claim
from meltemi.papers.verdict import HOLDS
from meltemi.reports.blocks import Table


def counted(lines: Sequence[Claim]) -> list[Claim]:
    """Claims that the paper states and that can be checked."""
    return [c for c in lines if c.basis == "paper" and c.outcome != "unchecked"]


def count_by_reading(lines: Sequence[Claim], readings: Sequence[str]) -> list[int]:
    """Number of those that hold in each of the readings."""
    verdicts = [c.judgement.in_readings(readings) for c in counted(lines)]
    return [sum(v[k] == HOLDS for v in verdicts) for k in range(len(readings))]


def verdicts_table(lines: Sequence[Claim], added: Sequence[Claim], readings: Sequence[str]) -> Table:
    """Counts by reading, and the claims on which readings differ or that hold in none.

    Args:
      lines: all claims.
      added: all claims with flaps added to an unchanged IPC.
      readings: names.
    """
    whole = len(counted(lines))
    rows = [
        ["hold", *(f"{k} of {whole}" for k in count_by_reading(lines, readings))],
        [
            "hold, flaps beside an IPC that stays as it is",
            *(f"{k} of {whole}" for k in count_by_reading(added, readings)),
        ],
        *(
            [c.item, *(v.text for v in c.judgement.in_readings(readings))]
            for c in counted(lines)
            if c.outcome != "held"
        ),
    ]
    note = "All other claims that can be checked hold in every reading."
    return Table(["claim", *readings], rows, "Verdicts by model and wind", text_columns=len(readings) + 1, note=note)


def counts_words(lines: Sequence[Claim], added: Sequence[Claim], readings: Sequence[str]) -> str:
    """Sentences on the counts."""
    checked = counted(lines)
    whole, unchecked = len(checked), sum(c.outcome == "unchecked" for c in lines if c.basis == "paper")
    if any(v.outcome == "unjudged" for c in checked for _, v in c.judgement.verdicts):
        return f"The {whole} claims of the paper that can be checked are not all judged by these runs."
    verdicts = [c.judgement.in_readings(readings) for c in checked]
    every = sum(all(v == HOLDS for v in each) for each in verdicts)
    none = sum(all(v != HOLDS for v in each) for each in verdicts)
    few = sum(c.by_few for c in checked)
    each = ", ".join(f"{k} with {name}" for k, name in zip(count_by_reading(lines, readings), readings, strict=True))
    other = ", ".join(map(str, count_by_reading(added, readings)))
    return (
        f"Of {whole} claims of the paper that can be checked, {every} hold in every reading of its model and wind, "
        f"{whole - every - none} in some, {none} in none. There hold {each}; with flaps beside an IPC that stays as it "
        f"is {other}. {few} claims hold in a reading by at most three of our minutes. {unchecked} more cannot be "
        "checked."
    )
