"""Verdicts on claims as data, with their one wording and its inverse."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

Outcome = Literal["held", "by_reading", "differ", "unjudged", "unchecked"]
"""Outcome of a verdict: ``by_reading`` if it is not the same in all readings of the paper; ``unjudged`` if it
depends on a cell that failed; ``unchecked`` if the paper, or this simulation, lacks what a comparison needs."""
UNJUDGED, UNCHECKED = "cannot be judged: ", "cannot be checked: "
_BEGINS: dict[Outcome, str] = {"by_reading": "holds only for ", "unjudged": UNJUDGED, "unchecked": UNCHECKED}
_BETWEEN = " / "
FEWEST_SEEDS = 4
"""Number of seeds below which intervals are as wide as effects, and nothing is judged by them."""


@dataclass(frozen=True)
class Verdict:
    """Whether a claim holds.

    Attributes:
      outcome: outcome of the judgement.
      words: how it differs, why nothing is known, or for what the claim holds.
    """

    outcome: Outcome
    words: str = ""

    @property
    def text(self) -> str:
        """The verdict in words."""
        if self.outcome == "held":
            return "holds"
        return _BEGINS.get(self.outcome, "") + (self.words or "differs")


@dataclass(frozen=True)
class Judgement:
    """Verdicts on a claim by the readings of the paper; one, of the reading "", if it does not hinge on them."""

    verdicts: tuple[tuple[str, Verdict], ...]

    @property
    def text(self) -> str:
        """All verdicts in words."""
        if len(self.verdicts) == 1:
            return self.verdicts[0][1].text
        return _BETWEEN.join(f"{verdict.text} ({reading})" for reading, verdict in self.verdicts)

    @property
    def outcome(self) -> Outcome:
        """Common verdict of all readings."""
        outcomes = {verdict.outcome for _, verdict in self.verdicts}
        return outcomes.pop() if len(outcomes) == 1 else "by_reading"

    def in_readings(self, readings: Sequence[str]) -> list[Verdict]:
        """The verdict in each of the readings."""
        of = dict(self.verdicts)
        return [of[reading if len(of) > 1 else next(iter(of))] for reading in readings]


Judged = bool | Verdict | Judgement
"""A verdict as rules give it: also whether the claim holds."""
HOLDS = Verdict("held")


def differs(how: str = "") -> Verdict:
    """The claim does not hold."""
    return Verdict("differ", how)


def unjudged(why: str) -> Verdict:
    """A result is missing."""
    return Verdict("unjudged", why)


def unchecked(why: str) -> Verdict:
    """There is nothing to compare with."""
    return Verdict("unchecked", why)


def verdict(holds: bool | Verdict) -> Verdict:
    """The verdict of a rule."""
    return holds if isinstance(holds, Verdict) else HOLDS if holds else differs()


def judgement(of: Judged) -> Judgement:
    """One verdict for all readings, or those that there are."""
    return of if isinstance(of, Judgement) else Judgement((("", verdict(of)),))


def by_reading(readings: Mapping[str, bool | Verdict]) -> Judgement:
    """Verdicts by reading; one if all agree."""
    verdicts = tuple((reading, verdict(each)) for reading, each in readings.items())
    return judgement(verdicts[0][1]) if len({each for _, each in verdicts}) == 1 else Judgement(verdicts)


def only_for(holds: Mapping[str, bool]) -> Verdict:
    """Verdict on a statement that may hold for some of what it is about."""
    some = [words for words, each in holds.items() if each]
    if len(some) == len(holds):
        return HOLDS
    return Verdict("by_reading", "; ".join(some)) if some else differs()


def enough(seeds: int, of: bool | Verdict) -> Verdict:
    """A verdict that rests on seeds, if they are enough."""
    return verdict(of) if seeds >= FEWEST_SEEDS else unjudged(f"it needs {FEWEST_SEEDS} seeds, there are {seeds}")


def judgement_in(text: str) -> Judgement:
    """The judgement that a text words, as of tables on pages."""
    matches = [re.fullmatch(r"(.+?) \((.+)\)", part) for part in text.split(_BETWEEN)]
    parts = [(match[2], _verdict_in(match[1])) for match in matches if match]
    return Judgement(tuple(parts)) if 1 < len(parts) == len(matches) else judgement(_verdict_in(text))


def _verdict_in(text: str) -> Verdict:
    for outcome, begin in _BEGINS.items():
        if text.startswith(begin):
            return Verdict(outcome, text.removeprefix(begin))
    return HOLDS if text == "holds" else differs("" if text == "differs" else text)
