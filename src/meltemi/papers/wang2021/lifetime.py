"""Lifetime loads of the strategies: production in the wind of the site, and a number of fronts a year from the grid."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import product
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from meltemi.loads.energy import YEAR
from meltemi.papers.wang2021.costs import kinds
from meltemi.papers.wang2021.words import sentence
from meltemi.postprocess.ensemble import MeanEstimate, ensemble_load, lifetime_del, mean_interval
from meltemi.reports.blocks import Table
from meltemi.reports.ensemble_tables import with_interval
from meltemi.simulation.bladed.rotor import BladedModel
from meltemi.simulation.result import Result
from meltemi.studies.machine_loads import LOADS, fatigue
from meltemi.studies.wind_year import StrategyYear
from meltemi.studies.yaw_gusts import LENGTH, WIND, GustResults
from meltemi.studies.yaw_limits import LEAD, cases_in_turbulence
from meltemi.tuning.run_store import cells

if TYPE_CHECKING:
    import pandas as pd

Float = NDArray[np.float64]

SPEEDS = (5.0, 7.0, 9.0, 11.0, 13.0, 17.0, 21.0)
"""[m/s] wind speeds of production without fronts."""
FRONTS = (50, 200)
"""A year."""


def production(
    model: BladedModel,
    mean_wind: float,
    wind_class: str,
    seeds: Sequence[int],
    length: float = 600.0,
    *,
    workers: int | None = None,
) -> dict[str, float]:
    """Lifetime equivalent loads of production without fronts, by name of ``LOADS``, in their units.

    Args:
      model: turbine with fixed yaw.
      mean_wind: [m/s] annual mean; Rayleigh distribution.
      wind_class: class of the turbulence.
      seeds: turbulence seeds.
      length: [s] evaluated length of each run.
      workers: number of threads.

    Raises:
      FailedResultError: a run did not reach its end.
    """
    keys = [("ntm", speed, 0.0, seed) for speed in SPEEDS for seed in seeds]
    cases = cases_in_turbulence(model, keys, wind_class, LEAD + length)

    def loads(result: Result) -> dict[str, float]:
        return {name: fatigue(result.between(LEAD, np.inf), name) for name in LOADS}

    results = cells(cases, reduce=loads, workers=workers)
    lifetime = {}
    for name, load in LOADS.items():
        by_speed = np.reshape([run[name] for run in results], (len(SPEEDS), len(seeds)))
        at = [ensemble_load(values, load.slope) for values in by_speed]
        lifetime[name] = lifetime_del(SPEEDS, at, slope=load.slope, mean_speed=mean_wind)
    return lifetime


def change(rows: pd.DataFrame, production: Mapping[str, float], strategy: str, name: str, fronts: int) -> str:
    """Change [%] of a lifetime equivalent load against ignoring the error, and its 95 % interval over the winds.

    The damage of production and of the fronts adds up: L^m T = L_p^m (T - n t) + n t mean(L_g^m).
    """
    slope, share = LOADS[name].slope, fronts * LENGTH / YEAR
    rows = rows.assign(damage=rows[f"{name}, fatigue"] ** slope)
    damage, ignored = (
        of[of["recheck"] == of["recheck"].max()].groupby(WIND)["damage"].mean()
        for of in (rows[rows["strategy"] == strategy], rows[rows["strategy"] == "S3"])
    )
    base = production[name] ** slope * (1.0 - share) + share * ignored.mean()
    more = mean_interval((damage - ignored).dropna().to_numpy())
    low, middle, high = (
        100.0 * (max(1.0 + share * x / base, 0.0) ** (1.0 / slope) - 1.0) for x in (more.low, more.mean, more.high)
    )
    return f"{middle:+.1f}" + (f" ± {0.5 * (high - low):.1f}" if more.n > 1 else "")


def table(grid: GustResults, production: Mapping[str, float], strategies: Sequence[str]) -> Table:
    """Table of lifetime loads by strategy, direction and rise time of the fronts, and their number."""
    rows = []
    for fronts, (direction, time, of_kind), strategy in product(FRONTS, list(kinds(grid)), strategies):
        changes = [change(of_kind, production, strategy, name, fronts) for name in LOADS]
        rows.append([f"{fronts}", direction, f"{time:g}", strategy, *changes])
    usual = ", ".join(f"{name} {production[name]:.3g} {load.unit}" for name, load in LOADS.items())
    head = ["fronts\na year", "change", "within\ns", "strategy", *LOADS]
    note = sentence("lifetime", production=usual)
    return Table(head, rows, "Lifetime loads of the strategies", text_columns=4, note=note)


MWH = 3.6e9
"""[J] one megawatt hour."""


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
    note = sentence("a year", parts=len({y.seed for y in years}))
    return Table(head, rows, "A year of wind", text_columns=2, note=note)
