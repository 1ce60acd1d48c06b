"""The same questions in the same winds, seed after seed."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TypeVar

from meltemi.loadcases.batch import BatchCase
from meltemi.postprocess.ensemble import EnsembleTable, ensemble_table
from meltemi.simulation.result import Result
from meltemi.studies.journal import Lost, LostError, cells
from meltemi_papers.study import Progress

Question = TypeVar("Question")


def compared(
    seeds: Sequence[int],
    questions: Sequence[Question],
    schemes: Sequence[str],
    of_seed: Callable[[int], Iterable[BatchCase]],
    quantities: Callable[[Result], dict[str, float]],
    slopes: Mapping[str, float],
    *,
    workers: int | None,
    progress: Progress,
    what: str,
) -> dict[Question, EnsembleTable]:
    """A table for each question. ``of_seed`` gives a seed's cases, question after question and for each all schemes.

    A seed in which the run of a scheme failed is left out of that question for all schemes.

    Raises:
      LostError: of a question no seed is left.
    """
    found: dict[Question, dict[int, dict[str, dict[str, float]]]] = {question: {} for question in questions}
    for number, seed in enumerate(seeds):

        def part(share: float, done: int = number) -> None:
            progress((done + share) / len(seeds), what)

        values = iter(cells(list(of_seed(seed)), reduce=quantities, workers=workers, progress=part))
        for question in questions:
            row = {scheme: next(values) for scheme in schemes}
            if not any(isinstance(value, Lost) for value in row.values()):
                found[question][seed] = row
    for question, by_seed in found.items():
        if not by_seed:
            raise LostError(f"{what}, {question}: no seed in which every scheme reached its end")
    return {question: ensemble_table(by_seed, slopes) for question, by_seed in found.items()}
