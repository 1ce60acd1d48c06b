"""Results beyond the paper: limits from loads, the grid of gusts, years of wind, and what an owner would do."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from meltemi.papers.study import Draw, Progress, guarded_table, guarded_text, span, step_progress
from meltemi.papers.wang2021 import lifetime
from meltemi.papers.wang2021.costs import (
    KWH,
    STRATEGIES,
    costs,
    costs_table,
    longest,
    nothing_words,
    over_stopping,
    recheck_table,
    relative,
    stopped_after_derating,
)
from meltemi.papers.wang2021.lifetime import over_parts, production, won, year_table
from meltemi.papers.wang2021.winds import measured
from meltemi.papers.wang2021.words import sentence
from meltemi.report.figure import MINUS
from meltemi.report.palette import COLOURS, DIVERGING, GROWING, INK
from meltemi.report.plots import new_figure, panel
from meltemi.reports.blocks import Section, Table
from meltemi.reports.ensemble_tables import with_interval
from meltemi.simulation.rotors import build
from meltemi.studies.machine_loads import YAW_BENDING
from meltemi.studies.wind_year import FRONTS, QUARTER, StrategyYear, WindSite, a_year, power_curve
from meltemi.studies.yaw_gusts import FAST, OURS, QUICK, GustGrid, GustResults, run_grid
from meltemi.studies.yaw_limits import YawLimits, draw_limits, find_limits, limit_rows, limit_words
from meltemi.supervisor.threshold import YawProtection, yaw_threshold
from meltemi.tuning.run_store import FailedResult, attempt
from meltemi.turbine.definition import Turbine

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.colors import LinearSegmentedColormap
    from matplotlib.figure import Figure

Float = NDArray[np.float64]

WIND_CLASS = "IIIB"
"""Class of the turbulence in which limits are evaluated; the turbine's class S does not state one."""
LIMIT_SPEEDS = (5.0, 8.0, 10.0, 12.0, 15.0, 20.0, 25.0)
"""[m/s] wind speeds at which limits are evaluated."""


@dataclass(frozen=True)
class Beyond:
    """Results beyond the paper.

    Attributes:
      limits: loads over wind speed and yaw error.
      grid: gusts by the thousand.
      years: a year of wind, by strategy and number of fronts.
      usual: lifetime equivalent loads of production without fronts.
    """

    limits: YawLimits
    grid: GustResults
    years: tuple[StrategyYear, ...]
    usual: Mapping[str, float]


def study(
    turbine: Turbine,
    quick: bool,
    *,
    limit_seeds: Sequence[int] = (1, 2),
    speed: float | None = None,
    workers: int | None,
    progress: Progress,
) -> Beyond:
    """Run limits, the grid of gusts with base points from the limits, and the year.

    Args:
      turbine: turbine for the paper's methods.
      quick: whether to run a small part of the study.
      limit_seeds: seeds of the limits.
      speed: [m/s] larger one of the grid's wind speeds; by default that of the paper's gust.
      workers, progress: number of processes, and callback with the completed fraction.
    """
    fixed, seeds = build(turbine, FAST.replace(yaw="held")), limit_seeds[: 1 if quick else None]
    few: dict[str, Any] = {"speeds": LIMIT_SPEEDS if speed is None else None}
    few = {"speeds": (8.0, 25.0), "length": 30.0} if quick else few
    few |= {"wind_class": WIND_CLASS, "progress": step_progress(span(progress, 0.0, 0.15), "loads at yaw errors")}
    limits = attempt("limits", find_limits, fixed, seeds, workers=workers, **few)
    ours = attempt("base points", lambda: limits.base_points)
    base_points = None if isinstance(ours, FailedResult) else ours
    gusts = QUICK if quick else GustGrid()
    gusts = gusts if speed is None else replace(gusts, speeds=(*gusts.speeds[:-1], speed))
    reported = step_progress(span(progress, 0.15, 0.8), "gusts")
    grid = attempt("grid", run_grid, turbine, gusts, base_points, workers=workers, progress=reported)
    progress(0.95, "a year of wind")
    curve = attempt("power curve", power_curve, fixed)
    years = attempt("year", a_year, turbine, curve, ours, site(), days=3.0 if quick else QUARTER, workers=workers)
    length = 30.0 if quick else 600.0
    usual = attempt("production", production, fixed, site().mean, WIND_CLASS, seeds, length, workers=workers)
    progress(1.0, "done")
    return Beyond(limits, grid, years, usual)


def site() -> WindSite:
    """The paper's site: a mean of 7.11 m/s, weighted by the numbers of sets, and the intensities of Table 2."""
    speed, intensity, sets = np.array([(row.speed, row.intensity, row.sets) for row in measured()]).T
    return WindSite(round(float(speed @ sets / sets.sum()), 2), speed, intensity)


def rated_wind(turbine: Turbine) -> float:
    """[m/s] wind speed at which the turbine reaches rated power."""
    return float(power_curve(build(turbine, FAST.replace(yaw="held"))).speed[-1])


def limits_table(limits: YawLimits) -> Table:
    """Table of base points from load limits."""
    head, rows = limit_rows(limits)
    note = sentence("limits", loads=len(limits.limit), limits=limit_words(limits))
    return Table(head, rows, "Base points that keep loads within those of extreme turbulence", note=note)


def chapter(results: Beyond, draw: Draw) -> Section:
    """Chapter: conclusion, figure, tables."""

    def figure() -> Any:
        return beyond_figure(results.grid, results.limits, results.years)

    return Section(
        "Beyond the paper: what an owner would do",
        [
            guarded_text(partial(verdict, results), "What to do"),
            guarded_text(lambda: nothing_words(results.grid), "Doing nothing"),
            draw("beyond", "Derate or stop: one page to act on", figure),
            guarded_table("What the strategies cost", lambda: costs_table(results.grid)),
            guarded_table("Lifetime loads", lambda: lifetime.table(results.grid, results.usual, STRATEGIES[:-1])),
            guarded_table("Extremes of derating over those of stopping", lambda: over_stopping(results.grid)),
            guarded_table("Derated, and stopped all the same", lambda: recheck_table(results.grid)),
            guarded_table("Base points", lambda: limits_table(results.limits)),
            guarded_table("A year of wind", lambda: year_table(results.years)),
        ],
    )


def verdict(results: Beyond) -> str:
    """Recommendation, from the results."""
    return " ".join((_of_gusts(results.grid), _of_base_points(results.limits), _of_the_year(results.years)))


def _of_gusts(grid: GustResults) -> str:
    share = 100.0 * longest(grid).groupby("strategy")["stops"].mean()
    bending = {name: costs(grid.rows, name, f"{YAW_BENDING}, extreme") for name in ("S1", "S2", OURS)}
    stops, rates = 100.0 * stopped_after_derating(grid), np.degrees(grid.grid.yaw_rates)
    numbers = {"S1": share["S1"], "S2": share["S2"], "ours": share[OURS]}
    numbers |= {"stop": bending["S1"], "derate": bending["S2"], "derate_ours": bending[OURS]}
    numbers |= {"short": grid.grid.rechecks[0], "slow": rates[0], "most": stops[0, 0]}
    numbers |= {"long": grid.grid.rechecks[-1], "fast": rates[-1], "least": stops[-1, -1]}
    return sentence("owner", **numbers)


def _of_base_points(limits: YawLimits) -> str:
    c, allowed, paper = limits.speeds, limits.allowed(), yaw_threshold(YawProtection(), limits.speeds)
    kinds = {"stricter": paper < allowed - 1e-6, "laxer": paper > allowed + 1e-6}
    than = [f"{word} at {', '.join(f'{v:g}' for v in c[at])} m/s" for word, at in kinds.items() if at.any()]
    base = "; ".join(f"{v:g} m/s {np.degrees(b):.0f} deg" for v, b in zip(c, allowed, strict=True))
    return sentence("base points", base=base, than=" and ".join(than) or "the same")


def _of_the_year(years: Sequence[StrategyYear]) -> str:
    most, least = (of(y.fronts for y in years) for of in (max, min))
    ours = won(years, OURS, most)
    energy = over_parts(years, "S1", most, lambda y: y.energy / 3.6e9).mean()
    return sentence(
        "year",
        fronts=most,
        won=with_interval(won(years, "S2", most), 0),
        won_ours=with_interval(ours, 0),
        share=100.0 * ours.mean / energy,
        calm=with_interval(won(years, OURS, least), 1),
    )


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
