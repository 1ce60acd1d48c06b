"""The same questions in the same winds, seed after seed."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TypeVar

from meltemi.loadcases.batch import BatchCase, completed, simulate_batch
from meltemi.postprocess.ensemble import EnsembleTable, ensemble_table
from meltemi.simulation.result import Result

Progress = Callable[[float, str], None]
Question = TypeVar("Question")


def compared(
    seeds: Sequence[int],
    questions: Sequence[Question],
    schemes: Sequence[str],
    cases: Callable[[int], Iterable[BatchCase]],
    quantities: Callable[[Result], dict[str, float]],
    slopes: Mapping[str, float],
    *,
    workers: int | None,
    progress: Progress,
    what: str,
) -> dict[Question, EnsembleTable]:
    """A table for each question. ``cases`` gives a seed's, question after question and for each all schemes."""
    found: dict[Question, dict[int, dict[str, dict[str, float]]]] = {question: {} for question in questions}
    for number, seed in enumerate(seeds):

        def part(share: float, done: int = number) -> None:
            progress((done + share) / len(seeds), what)

        batch = simulate_batch(list(cases(seed)), reduce=quantities, workers=workers, progress=part)
        values = iter(completed(batch))
        for question in questions:
            found[question][seed] = {scheme: next(values) for scheme in schemes}
    return {question: ensemble_table(by_seed, slopes) for question, by_seed in found.items()}
