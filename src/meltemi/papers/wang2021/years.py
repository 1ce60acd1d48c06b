"""A year of wind with the strategies, by number of fronts: means and intervals over parts of the year."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from meltemi.postprocess.ensemble import MeanEstimate, mean_interval
from meltemi.reports.blocks import Table
from meltemi.reports.ensemble_tables import with_interval
from meltemi.studies.wind_year import StrategyYear

Float = NDArray[np.float64]
MWH = 3.6e9
"""[J]."""


def over_parts(years: Sequence[StrategyYear], strategy: str, fronts: int, of: Callable[[StrategyYear], float]) -> Float:
    """(parts,) annual values of a strategy."""
    return np.array([of(y) for y in years if (y.strategy, y.fronts) == (strategy, fronts)])


def paired(
    years: Sequence[StrategyYear], one: str, other: str, fronts: int, of: Callable[[StrategyYear], float]
) -> MeanEstimate:
    """Difference between two strategies in the same wind."""
    return mean_interval(over_parts(years, one, fronts, of) - over_parts(years, other, fronts, of))


def won(years: Sequence[StrategyYear], strategy: str, fronts: int) -> MeanEstimate:
    """Annual energy [MWh] of a strategy beyond that of stopping."""
    return mean_interval(over_parts(years, strategy, fronts, lambda y: (y.energy - y.stopped) / MWH))


def year_table(years: Sequence[StrategyYear]) -> Table:
    """Table of a year by strategy and number of fronts."""
    columns: tuple[tuple[Callable[[StrategyYear], float], int], ...] = (
        (lambda y: y.energy / 3.6e12, 2),
        (lambda y: y.exceeded, 0),
        (lambda y: y.derates, 0),
        (lambda y: y.stops, 0),
        (lambda y: y.down / 3600.0, 1),
        (lambda y: 100.0 * y.available, 2),
    )
    rows = []
    for fronts, strategy in dict.fromkeys((y.fronts, y.strategy) for y in years):
        values = [with_interval(mean_interval(over_parts(years, strategy, fronts, of)), n) for of, n in columns]
        rows.append([f"{fronts}", strategy, *values, with_interval(won(years, strategy, fronts), 2, "+")])
    head = ["fronts\na year", "strategy", "energy\nGWh", "threshold\npassed", "derates", "stops", "down\nh"]
    head += ["available\n%", "won against S1\nMWh"]
    note = (
        f"Means and 95 % intervals over {len({y.seed for y in years})} parts of a year, as a year; the same wind for "
        "all strategies, only fronts differ between the blocks. S1 has the stepwise threshold, as before the paper's "
        "optimisation."
    )
    return Table(head, rows, "A year of wind", text_columns=2, note=note)
