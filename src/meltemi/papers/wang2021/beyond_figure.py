"""Figure for the choice of a strategy: maps over the gusts, recheck, allowed yaw errors, a year."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from meltemi.papers.wang2021.costs import KWH, longest, relative, stopped_after_derating
from meltemi.papers.wang2021.years import won
from meltemi.report.figure import MINUS
from meltemi.report.palette import COLOURS, DIVERGING, GROWING, INK
from meltemi.report.plots import new_figure, panel
from meltemi.studies.machine_loads import YAW_BENDING
from meltemi.studies.wind_year import FRONTS, StrategyYear
from meltemi.studies.yaw_gusts import OURS, GustResults
from meltemi.studies.yaw_limits import YawLimits, draw_limits

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.colors import LinearSegmentedColormap
    from matplotlib.figure import Figure

Float = NDArray[np.float64]


def beyond_figure(grid: GustResults, limits: YawLimits, years: Sequence[StrategyYear]) -> Figure:
    """Energy and loads by gust, rechecks, allowed yaw errors, and a year."""
    figure, axes = new_figure(3, 3, size=(12.0, 10.0), share=False)
    some = longest(grid)
    middle = sorted(grid.grid.yaw_rates)[len(grid.grid.yaw_rates) // 2]
    at = some[some["yaw_rate"] == middle]
    energy, load = relative(at, "energy"), relative(at, f"{YAW_BENDING}, extreme")
    lost = energy.assign(lost=(energy["base"] - energy["energy"]) / KWH)
    top = float(lost["lost"].max())
    for ax, name in zip(axes[0], ("S1", "S2", OURS), strict=True):
        part = lost[lost["strategy"] == name]
        heat_map(ax, *by_gust(part, "lost"), f"{name}: energy lost a gust [kWh]", text=".0f", low=0.0, high=top)
    for ax, name in zip(axes[1], ("S1", "S2", OURS), strict=True):
        part = load[load["strategy"] == name].assign(percent=lambda r: 100.0 * r["gain"])
        title = f"{name}: extreme bending over S3 [%]"
        heat_map(ax, *by_gust(part, "percent"), title, text="+.0f", low=-60.0, high=60.0)
    for ax in axes[:2].flat:
        ax.set_xlabel("direction change [deg]")
        ax.set_ylabel("rise time [s]")
    _recheck(axes[2, 0], grid)
    draw_limits(axes[2, 1], limits)
    _years(axes[2, 2], years)
    figure.suptitle(
        f"Derate or stop? {len(grid.rows)} runs; maps at {np.degrees(middle):.1f} deg/s, means over "
        "wind speeds, rises, seeds, directions; bending at the yaw bearing",
    )
    return figure


def by_gust(rows: pd.DataFrame, column: str) -> tuple[Float, Float, Float]:
    """Direction changes [deg], rise times [s], and means of a column over other parameters (times, changes)."""
    table = rows.pivot_table(index="time", columns="change", values=column, aggfunc="mean")
    return np.degrees(table.columns.to_numpy()).round(), table.index.to_numpy(), table.to_numpy()


def _scale(name: str, colours: Sequence[str]) -> LinearSegmentedColormap:
    from matplotlib.colors import LinearSegmentedColormap

    return LinearSegmentedColormap.from_list(name, colours)


def heat_map(ax: Axes, x: Float, y: Float, values: Float, title: str, *, text: str, low: float, high: float) -> None:
    """Draw values (rows by ``y``, columns by ``x``) as colours from ``low`` to ``high``, with numbers."""
    scale = _scale("growing", GROWING) if low == 0.0 else _scale("change", DIVERGING[::-1])
    image = ax.imshow(values, origin="lower", aspect="auto", cmap=scale, vmin=low, vmax=high)
    for i in range(len(y)):
        for j in range(len(x)):
            if np.isfinite(values[i, j]):
                light = image.cmap(image.norm(values[i, j]))[:3] @ np.array([0.2126, 0.7152, 0.0722]) > 0.4
                colour = INK if light else "white"
                label = format(values[i, j], text).replace("-", MINUS).replace("+0", "0").replace(f"{MINUS}0", "0")
                ax.text(j, i, label, ha="center", va="center", fontsize=9.0, color=colour)
    ax.set_xticks(range(len(x)), [f"{v:g}" for v in x])
    ax.set_yticks(range(len(y)), [f"{v:g}" for v in y])
    ax.set_title(title)


def _recheck(ax: Axes, grid: GustResults) -> None:
    values = 100.0 * stopped_after_derating(grid)
    rates = np.degrees(grid.grid.yaw_rates).round(2)
    title = "derated runs that stop all the same [%]"
    heat_map(ax, np.array(grid.grid.rechecks), rates, values, title, text=".0f", low=0.0, high=100.0)
    ax.set_xlabel("recheck after [s]")
    ax.set_ylabel("yaw rate [deg/s]")


def _years(ax: Axes, years: Sequence[StrategyYear]) -> None:
    for colour, name in zip(COLOURS, ("S2", OURS, "S3"), strict=False):
        gains = [won(years, name, fronts) for fronts in FRONTS]
        ax.errorbar(FRONTS, [e.mean for e in gains], [e.half_width for e in gains], fmt="o-", color=colour, label=name)
    panel(ax, "won in a year against stopping", "MWh")
    ax.set_xlabel("fronts a year")
    ax.legend(loc="upper left")
