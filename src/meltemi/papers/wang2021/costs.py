"""Energy losses and load reductions of the strategies over the grid of gusts, relative to ignoring the yaw error."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from meltemi.papers.wang2021.gust import SIGNS
from meltemi.papers.wang2021.words import sentence
from meltemi.postprocess.ensemble import mean_interval
from meltemi.reports.blocks import Table
from meltemi.reports.ensemble_tables import with_interval
from meltemi.studies.machine_loads import LOADS, TOP_SHEAR, YAW_BENDING, YAW_TORSION
from meltemi.studies.yaw_gusts import OURS, WIND, GustResults

if TYPE_CHECKING:
    import pandas as pd

Float = NDArray[np.float64]
KWH = 3.6e6
"""[J] one kilowatt hour."""
STRATEGIES = ("S1", "S2", OURS, "S3")


def longest(grid: GustResults) -> pd.DataFrame:
    """Rows of the strategies, for derating only those with the longest recheck time."""
    rows = grid.rows
    return rows[(rows["recheck"] == 0.0) | (rows["recheck"] == rows["recheck"].max())]


def relative(rows: pd.DataFrame, column: str, against: str = "S3") -> pd.DataFrame:
    """Rows with added columns ``base``, of another strategy at the same wind and yaw rate, and ``gain``, the relative
    difference from it."""
    wind = [*WIND, "yaw_rate"]
    base = rows[rows["strategy"] == against].set_index(wind)[column]
    joined = rows.join(base.rename("base"), on=wind)
    return joined.assign(gain=joined[column] / joined["base"] - 1.0)


def by_wind(rows: pd.DataFrame, strategy: str, recheck: float, column: str) -> Float:
    """(winds,) change of a column against ignoring the error, means over the yaw rates: relative, for energy in J."""
    part = relative(rows, column)
    part = part[(part["strategy"] == strategy) & (part["recheck"] == recheck)]
    change = part[column] - part["base"] if column == "energy" else part["gain"]
    return np.asarray(change.groupby([part[name] for name in WIND]).mean().to_numpy())


def kinds(grid: GustResults) -> Iterator[tuple[str, float, pd.DataFrame]]:
    """Directions of the change as text, rise times [s], and their rows."""
    for (sign, direction), time in product(SIGNS.items(), grid.grid.times):
        rows = grid.rows[(grid.rows["sign"] == sign) & (grid.rows["time"] == time)]
        if len(rows):
            yield direction, time, rows


def costs(rows: pd.DataFrame, strategy: str, column: str) -> str:
    """Mean and 95 % interval over the winds of the changes by a strategy with its longest recheck time."""
    return _cost(by_wind(rows, strategy, rows[rows["strategy"] == strategy]["recheck"].max(), column), column)


def _cost(changes: Float, column: str) -> str:
    sign, factor, unit = ("", -1.0 / KWH, "kWh") if column == "energy" else ("+", 100.0, "%")
    return f"{with_interval(mean_interval(factor * changes), 0, sign)} {unit}"


def winds_of(grid: GustResults) -> int:
    """Number of winds of a grid."""
    return len(grid.rows.groupby(WIND))


def costs_table(grid: GustResults) -> Table:
    """Table of energy loss and loads of each strategy by direction and rise time, over all gusts of the grid."""
    columns = [f"{load}, extreme" for load in LOADS] + [f"{load}, fatigue" for load in (YAW_BENDING, YAW_TORSION)]
    rows = []
    for direction, time, of_kind in kinds(grid):
        for name in STRATEGIES:
            for recheck, part in of_kind[of_kind["strategy"] == name].groupby("recheck"):
                words = f"{name}, recheck after {recheck:g} s" if recheck else name
                shares = [f"{100.0 * part[of].mean():.0f}" for of in ("stops", "derates")]
                cells = [_cost(by_wind(of_kind, name, recheck, c), c) for c in ("energy", *columns)]
                numbers = [each.removesuffix(" %").removesuffix(" kWh") for each in cells]
                rows.append([direction, f"{time:g}", words, *shares, *numbers])
    head = ["change", "within\ns", "strategy", "stops\n% of runs", "derates\n% of runs", "energy lost\nkWh a gust"]
    head += [f"{load}\nextreme %" for load in LOADS] + [f"{load}\nfatigue %" for load in (YAW_BENDING, YAW_TORSION)]
    note = sentence("costs", winds=winds_of(grid), rates=len(grid.grid.yaw_rates), ours=OURS)
    return Table(head, rows, "The paper's strategies and ours in the same gusts", text_columns=3, note=note)


def nothing_words(grid: GustResults) -> str:
    """Text on whether doing nothing is as good as derating at base points from loads, by direction and rise time."""
    parts = []
    for direction, time, rows in kinds(grid):
        recheck = rows[rows["strategy"] == OURS]["recheck"].max()
        intervals = {
            load: mean_interval(100.0 * by_wind(rows, OURS, recheck, f"{load}, {what}"))
            for what in ("extreme", "fatigue")
            for load in LOADS
        }
        lower = [load for load, e in intervals.items() if e.n > 1 and e.high < 0.0]
        gains = f"lowers {', '.join(lower)}" if lower else "lowers no load beyond its interval"
        parts.append(sentence("earned", direction=direction, time=time, gains=gains, lost=costs(rows, OURS, "energy")))
    return sentence("nothing", earned="; ".join(parts))


def stopped_after_derating(grid: GustResults) -> Float:
    """(yaw rates, recheck times) fraction of derated runs that end in a stop; NaN if no run was derated."""
    part = grid.rows[(grid.rows["strategy"] == "S2") & (grid.rows["derates"] > 0)]
    means = part.pivot_table(index="yaw_rate", columns="recheck", values="stops", aggfunc="mean")
    return means.reindex(index=grid.grid.yaw_rates, columns=grid.grid.rechecks).to_numpy()


def recheck_table(grid: GustResults) -> Table:
    """Table of derated runs that end in a stop, by yaw rate and recheck time."""
    rates, times = grid.grid.yaw_rates, grid.grid.rechecks
    rows = [
        [f"{np.degrees(rate):.1f}", *(f"{100.0 * x:.0f}" if np.isfinite(x) else "-" for x in shares)]
        for rate, shares in zip(rates, stopped_after_derating(grid), strict=True)
    ]
    head = ["yaw rate [deg/s]", *(f"recheck after {time:g} s" for time in times)]
    return Table(head, rows, "Derated, and stopped all the same", note=sentence("recheck"))


def over_stopping(grid: GustResults) -> Table:
    """Table of extreme loads of derating relative to those of stopping."""
    some, wind = longest(grid), [*WIND, "yaw_rate"]
    rows = []
    for name in ("S2", OURS):
        one, two = (some[some["strategy"] == n].set_index(wind) for n in ("S1", name))
        both = one.add_suffix(" of S1").join(two, how="inner")
        for load in (YAW_BENDING, YAW_TORSION, TOP_SHEAR):
            ratio = both[f"{load}, extreme"] / both[f"{load}, extreme of S1"]
            more = f"{100.0 * (ratio > 1.05).mean():.0f}"
            rows.append([name, load, f"{ratio.median():.2f}", f"{ratio.quantile(0.95):.2f}", more])
    head = ["strategy", "load", "median over S1", "95 % over S1", "runs with 5 % more [%]"]
    return Table(head, rows, "Extremes of derating over those of stopping, gust by gust", text_columns=2)
