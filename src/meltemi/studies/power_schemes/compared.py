"""Comparison of control schemes in the same winds, seed by seed."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import TypeVar

from meltemi.simulation.result import Result
from meltemi.simulation.run import Run
from meltemi.tuning.run_store import FailedResult, FailedResultError, cells

Question = TypeVar("Question")
Progress = Callable[[float, str], None]
"""Called with the completed fraction and the current step."""


@dataclass(frozen=True)
class SchemeSetup:
    """Extent of the simulations.

    Attributes:
      speed: [m/s] mean wind speed; IEC normal turbulence of class IB.
      levels: demanded power over rated power.
      length, begin: [s] evaluated length, and initial transient.
      points: grid points of the field in each direction.
      seeds: seeds of the wind and of signals that vary with it.
    """

    speed: float
    levels: tuple[float, ...]
    length: float
    begin: float
    points: int
    seeds: tuple[int, ...] = (1, 2, 3, 4, 5, 6)


def by_seed(
    seeds: Sequence[int],
    questions: Sequence[Question],
    schemes: Sequence[str],
    of_seed: Callable[[int], Iterable[Run]],
    quantities: Callable[[Result], dict[str, float]],
    *,
    workers: int | None,
    progress: Progress,
    what: str,
) -> dict[Question, dict[int, dict[str, dict[str, float]]]]:
    """Quantities by question, seed and scheme. ``of_seed`` gives the cases of a seed: for each question all schemes.

    A seed for which the run of a scheme failed is excluded from that question for all schemes.

    Raises:
      FailedResultError: no seed remains for a question.
    """
    results: dict[Question, dict[int, dict[str, dict[str, float]]]] = {question: {} for question in questions}
    for number, seed in enumerate(seeds):

        def part(share: float, done: int = number) -> None:
            progress((done + share) / len(seeds), what)

        values = iter(cells(list(of_seed(seed)), reduce=quantities, workers=workers, progress=part))
        for question in questions:
            row = {scheme: next(values) for scheme in schemes}
            if not any(isinstance(value, FailedResult) for value in row.values()):
                results[question][seed] = row
    for question, rows in results.items():
        if not rows:
            raise FailedResultError(f"{what}, {question}: no seed in which every scheme reached its end")
    return results
