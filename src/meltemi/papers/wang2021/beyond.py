"""Results beyond the paper: simulations, tables, figures, conclusion."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from meltemi.control.supervisor.threshold import YawProtection, yaw_threshold
from meltemi.papers.study import Chapter, Draw, Progress, span, tabled, told, worded
from meltemi.papers.wang2021 import lifetime
from meltemi.papers.wang2021.gust import SIGNS
from meltemi.papers.wang2021.lifetime import production
from meltemi.papers.wang2021.winds import measured
from meltemi.postprocess.ensemble import mean_interval
from meltemi.report.figure import MINUS
from meltemi.report.palette import COLOURS, DIVERGING, GROWING, INK
from meltemi.report.plots import new_figure, panel
from meltemi.reports.blocks import Table
from meltemi.reports.ensemble_tables import with_interval
from meltemi.simulation.rotors import build
from meltemi.studies.machine_loads import LOADS, TOP_SHEAR, YAW_BENDING, YAW_TORSION
from meltemi.studies.wind_year import FRONTS, WindSite, Year, a_year, power_curve
from meltemi.studies.yaw_gusts import FAST, OURS, QUICK, WIND, Found, Grid, run_grid
from meltemi.studies.yaw_limits import JUDGED, YawLimits, draw_limits, find_limits, limit_rows, limit_words
from meltemi.tuning.run_store import FailedResult, attempt
from meltemi.turbine.definition import Turbine

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.colors import LinearSegmentedColormap
    from matplotlib.figure import Figure

Float = NDArray[np.float64]
KWH = 3.6e6
"""[J]."""
WIND_CLASS = "IIIB"
"""Of the limits' turbulence; the turbine's class S does not say."""
LIMIT_SPEEDS = (5.0, 8.0, 10.0, 12.0, 15.0, 20.0, 25.0)
"""[m/s]."""
STRATEGIES = ("S1", "S2", OURS, "S3")


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
    grid: Found
    years: tuple[Year, ...]
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
      turbine: which.
      quick: a look.
      limit_seeds: of the limits.
      speed: [m/s] of the larger one of the grid's winds; by default that of the paper's gust.
      workers, progress: of the runs.
    """
    fixed = build(turbine, FAST.replace(yaw="held"))
    speeds = LIMIT_SPEEDS if speed is None else None
    few: dict[str, Any] = {"speeds": (8.0, 25.0), "length": 30.0} if quick else {"speeds": speeds}
    limits = attempt(
        "limits",
        find_limits,
        fixed,
        limit_seeds[: 1 if quick else None],
        wind_class=WIND_CLASS,
        workers=workers,
        progress=told(span(progress, 0.0, 0.15), "loads at yaw errors"),
        **few,
    )
    ours = attempt("base points", lambda: limits.base_points)
    chosen = QUICK if quick else Grid()
    grid = attempt(
        "grid",
        run_grid,
        turbine,
        chosen if speed is None else replace(chosen, speeds=(*chosen.speeds[:-1], speed)),
        None if isinstance(ours, FailedResult) else ours,
        workers=workers,
        progress=told(span(progress, 0.15, 0.8), "gusts"),
    )
    progress(0.95, "a year of wind")
    curve = attempt("power curve", power_curve, fixed)
    years = attempt("year", a_year, turbine, curve, ours, site(), days=3.0 if quick else 365.0, workers=workers)
    length = 30.0 if quick else 600.0
    usual = attempt(
        "production",
        production,
        fixed,
        site().mean,
        WIND_CLASS,
        limit_seeds[: 1 if quick else None],
        length,
        workers=workers,
    )
    progress(1.0, "done")
    return Beyond(limits, grid, years, usual)


def site() -> WindSite:
    """The paper's site: a mean of 7.11 m/s, weighted by the numbers of sets, and the intensities of Table 2."""
    speed, intensity, sets = np.array([(row.speed, row.intensity, row.sets) for row in measured()]).T
    return WindSite(round(float(speed @ sets / sets.sum()), 2), speed, intensity)


def rated_wind(turbine: Turbine) -> float:
    """[m/s] at which the turbine reaches rated power."""
    return float(power_curve(build(turbine, FAST.replace(yaw="held"))).speed[-1])


def longest(grid: Found) -> pd.DataFrame:
    """Rows of the strategies; of derating only those with the longest recheck time."""
    rows = grid.rows
    return rows[(rows["recheck"] == 0.0) | (rows["recheck"] == rows["recheck"].max())]


def relative(rows: pd.DataFrame, column: str, against: str = "S3") -> pd.DataFrame:
    """Rows with columns ``base``, of another strategy in the same wind and with the same yaw rate, and ``gain``: the
    difference from it as a share."""
    wind = [*WIND, "yaw_rate"]
    base = rows[rows["strategy"] == against].set_index(wind)[column]
    joined = rows.join(base.rename("base"), on=wind)
    return joined.assign(gain=joined[column] / joined["base"] - 1.0)


def by_wind(rows: pd.DataFrame, strategy: str, recheck: float, column: str) -> Float:
    """(winds,) change of a column against ignoring the error, means over the yaw rates: a share, of energy in J."""
    part = relative(rows, column)
    part = part[(part["strategy"] == strategy) & (part["recheck"] == recheck)]
    change = part[column] - part["base"] if column == "energy" else part["gain"]
    return np.asarray(change.groupby([part[name] for name in WIND]).mean().to_numpy())


def costs(grid: Found, strategy: str, column: str, sign: int = 0) -> str:
    """Mean and 95 % interval over the winds, of a direction if given, of what a strategy changes or loses."""
    rows = grid.rows[grid.rows["sign"] == sign] if sign else grid.rows
    found = by_wind(rows, strategy, rows[rows["strategy"] == strategy]["recheck"].max(), column)
    return _cost(found, column)


def _cost(found: Float, column: str) -> str:
    sign, factor, unit = ("", -1.0 / KWH, "kWh") if column == "energy" else ("+", 100.0, "%")
    return f"{with_interval(mean_interval(factor * found), 0, sign)} {unit}"


def winds_of(grid: Found) -> int:
    """Number of winds of a grid."""
    return len(grid.rows.groupby(WIND))


def costs_table(grid: Found) -> Table:
    """Table of energy loss and loads of each strategy by direction, over all gusts of the grid."""
    columns = [f"{load}, extreme" for load in LOADS] + [f"{load}, fatigue" for load in (YAW_BENDING, YAW_TORSION)]
    rows = []
    for sign, direction in SIGNS.items():
        of_sign = grid.rows[grid.rows["sign"] == sign]
        for name in STRATEGIES:
            for recheck, part in of_sign[of_sign["strategy"] == name].groupby("recheck"):
                words = f"{name}, recheck after {recheck:g} s" if recheck else name
                cells = [
                    direction,
                    words,
                    f"{100.0 * part['stops'].mean():.0f}",
                    f"{100.0 * part['derates'].mean():.0f}",
                ]
                found = [_cost(by_wind(of_sign, name, recheck, c), c) for c in ("energy", *columns)]
                rows.append([*cells, *(each.removesuffix(" %").removesuffix(" kWh") for each in found)])
    head = ["change", "strategy", "stops\n% of runs", "derates\n% of runs", "energy lost\nkWh a gust"]
    head += [f"{load}\nextreme %" for load in LOADS] + [f"{load}\nfatigue %" for load in (YAW_BENDING, YAW_TORSION)]
    note = (
        f"Loads and energy against S3, which ignores the error, in the same wind; means and 95 % intervals over "
        f"{winds_of(grid)} winds, each with {len(grid.grid.yaw_rates)} yaw rates. Energy from the start of a run to "
        f"ten minutes after its end. {OURS}: base points from loads, see below."
    )
    return Table(head, rows, "The paper's strategies and ours in the same gusts", text_columns=2, note=note)


def nothing_words(grid: Found) -> str:
    """Whether doing nothing is as good as derating at base points from loads, by direction."""
    parts = []
    for sign, direction in SIGNS.items():
        rows = grid.rows[grid.rows["sign"] == sign]
        recheck = rows[rows["strategy"] == OURS]["recheck"].max()
        found = {
            load: mean_interval(100.0 * by_wind(rows, OURS, recheck, f"{load}, {what}"))
            for what in ("extreme", "fatigue")
            for load in LOADS
        }
        lower = [load for load, e in found.items() if e.n > 1 and e.high < 0.0]
        gains = f"lowers {', '.join(lower)}" if lower else "lowers no load beyond its interval"
        parts.append(f"with a {direction} change it {gains} and loses {costs(grid, OURS, 'energy', sign)} a gust")
    return (
        f"Against doing nothing (S3), derating at base points from loads ({OURS}) earns this: {'; '.join(parts)}. "
        "Where it lowers nothing, doing nothing dominates; the limits then only say that the loads of gusts stay "
        "within those of extreme turbulence."
    )


def stopped_all_the_same(grid: Found) -> Float:
    """(yaw rates, recheck times) fraction of derated runs that end in a stop; NaN where none was derated."""
    part = grid.rows[(grid.rows["strategy"] == "S2") & (grid.rows["derates"] > 0)]
    means = part.pivot_table(index="yaw_rate", columns="recheck", values="stops", aggfunc="mean")
    return means.reindex(index=grid.grid.yaw_rates, columns=grid.grid.rechecks).to_numpy()


def recheck_table(grid: Found) -> Table:
    """Table of derated runs that end in a stop, by yaw rate and recheck time."""
    rates, times = grid.grid.yaw_rates, grid.grid.rechecks
    rows = [
        [f"{np.degrees(rate):.1f}", *(f"{100.0 * x:.0f}" if np.isfinite(x) else "-" for x in shares)]
        for rate, shares in zip(rates, stopped_all_the_same(grid), strict=True)
    ]
    head = ["yaw rate [deg/s]", *(f"recheck after {time:g} s" for time in times)]
    note = (
        "Percent of the runs that were derated. The drive must turn the error below the threshold before the recheck."
    )
    return Table(head, rows, "Derated, and stopped all the same", note=note)


def limits_table(limits: YawLimits) -> Table:
    """Table of base points from load limits."""
    head, rows = limit_rows(limits)
    note = (
        f"Largest load over its limit, of {len(JUDGED)} loads and both signs of the error; and the load that governs. "
    )
    note += f"Limits, 1.1 times extreme turbulence at 8 deg: {limit_words(limits)}."
    return Table(head, rows, "Base points that keep loads within those of extreme turbulence", note=note)


def year_table(years: tuple[Year, ...]) -> Table:
    """Table of a year by strategy and number of fronts."""
    rows = [
        [
            f"{y.fronts}",
            y.strategy,
            f"{y.energy / 3.6e12:.3f}",
            f"{y.exceeded}",
            f"{y.derates}",
            f"{y.stops}",
            f"{y.down / 3600.0:.1f}",
            f"{(y.energy - y.stopped) / 3.6e9:+.2f}",
        ]
        for y in years
    ]
    head = ["fronts\na year", "strategy", "energy\nGWh", "threshold\npassed", "derates", "stops", "down\nh"]
    head += ["won against S1\nMWh"]
    note = "The same wind for all strategies; only fronts differ between the blocks."
    return Table(head, rows, "A year of wind", text_columns=2, note=note)


def chapter(found: Beyond, draw: Draw) -> Chapter:
    """Chapter: conclusion, page of figures, tables."""
    return Chapter(
        "Beyond the paper: what an owner would do",
        [
            worded(partial(verdict, found), "What to do"),
            worded(lambda: nothing_words(found.grid), "Doing nothing"),
            draw("beyond", "Derate or stop: one page to act on", lambda: page(found)),
            tabled("What the strategies cost", lambda: costs_table(found.grid)),
            tabled("Lifetime loads", lambda: lifetime.table(found.grid, found.usual, STRATEGIES[:-1])),
            tabled("Extremes of derating over those of stopping", lambda: better(found.grid)),
            tabled("Derated, and stopped all the same", lambda: recheck_table(found.grid)),
            tabled("Base points", lambda: limits_table(found.limits)),
            tabled("A year of wind", lambda: year_table(found.years)),
        ],
    )


def _scale(name: str, colours: Sequence[str]) -> LinearSegmentedColormap:
    from matplotlib.colors import LinearSegmentedColormap

    return LinearSegmentedColormap.from_list(name, colours)


def _heat(ax: Axes, x: Float, y: Float, values: Float, title: str, *, text: str, low: float, high: float) -> None:
    scale = _scale("growing", GROWING) if low == 0.0 else _scale("change", DIVERGING[::-1])
    drawn = ax.imshow(values, origin="lower", aspect="auto", cmap=scale, vmin=low, vmax=high)
    for i in range(len(y)):
        for j in range(len(x)):
            if np.isfinite(values[i, j]):
                light = drawn.cmap(drawn.norm(values[i, j]))[:3] @ np.array([0.2126, 0.7152, 0.0722]) > 0.4
                colour = INK if light else "white"
                said = format(values[i, j], text).replace("-", MINUS).replace("+0", "0").replace(f"{MINUS}0", "0")
                ax.text(j, i, said, ha="center", va="center", fontsize=7.5, color=colour)
    ax.set_xticks(range(len(x)), [f"{v:g}" for v in x])
    ax.set_yticks(range(len(y)), [f"{v:g}" for v in y])
    ax.set_title(title)


def by_gust(rows: pd.DataFrame, column: str) -> tuple[Float, Float, Float]:
    """Direction changes [deg], rises [m/s], and means of a column over all else (rises, changes)."""
    table = rows.pivot_table(index="rise", columns="change", values=column, aggfunc="mean")
    return np.degrees(table.columns.to_numpy()).round(), table.index.to_numpy(), table.to_numpy()


def page(found: Beyond) -> Figure:
    """Page of figures for the choice of a strategy."""
    figure, axes = new_figure(3, 3, size=(12.0, 10.0), share=False)
    some = longest(found.grid)
    middle = sorted(found.grid.grid.yaw_rates)[len(found.grid.grid.yaw_rates) // 2]
    at = some[some["yaw_rate"] == middle]
    energy, load = relative(at, "energy"), relative(at, f"{YAW_BENDING}, extreme")
    lost = energy.assign(lost=(energy["base"] - energy["energy"]) / KWH)
    top = float(lost["lost"].max())
    for ax, name in zip(axes[0], ("S1", "S2", OURS), strict=True):
        part = lost[lost["strategy"] == name]
        _heat(ax, *by_gust(part, "lost"), f"{name}: energy lost a gust [kWh]", text=".0f", low=0.0, high=top)
    for ax, name in zip(axes[1], ("S1", "S2", OURS), strict=True):
        part = load[load["strategy"] == name].assign(percent=lambda r: 100.0 * r["gain"])
        title = f"{name}: extreme bending over S3 [%]"
        _heat(ax, *by_gust(part, "percent"), title, text="+.0f", low=-60.0, high=60.0)
    for ax in axes[:2].flat:
        ax.set_xlabel("direction change [deg]")
        ax.set_ylabel("rise [m/s]")
    _recheck(axes[2, 0], found.grid)
    draw_limits(axes[2, 1], found.limits)
    _years(axes[2, 2], found.years)
    figure.suptitle(
        f"Derate or stop? {len(found.grid.rows)} runs; maps at {np.degrees(middle):.1f} deg/s, means over "
        "wind speeds, seeds, directions; bending at the yaw bearing",
    )
    return figure


def _recheck(ax: Axes, grid: Found) -> None:
    values = 100.0 * stopped_all_the_same(grid)
    rates = np.degrees(grid.grid.yaw_rates).round(2)
    title = "derated runs that stop all the same [%]"
    _heat(ax, np.array(grid.grid.rechecks), rates, values, title, text=".0f", low=0.0, high=100.0)
    ax.set_xlabel("recheck after [s]")
    ax.set_ylabel("yaw rate [deg/s]")


def _years(ax: Axes, years: tuple[Year, ...]) -> None:
    for colour, name in zip(COLOURS, ("S2", OURS, "S3"), strict=False):
        part = [y for y in years if y.strategy == name]
        ax.plot(
            [y.fronts for y in part], [(y.energy - y.stopped) / 3.6e9 for y in part], "o-", color=colour, label=name
        )
    panel(ax, "energy won in a year against stopping", "MWh")
    ax.set_xlabel("fronts a year")
    ax.legend()


def better(grid: Found) -> Table:
    """Table of extreme loads of derating relative to those of stopping."""
    some = longest(grid)
    wind = [*WIND, "yaw_rate"]
    rows = []
    for name in ("S2", OURS):
        one, two = (some[some["strategy"] == n].set_index(wind) for n in ("S1", name))
        both = one.add_suffix(" of S1").join(two, how="inner")
        for load in (YAW_BENDING, YAW_TORSION, TOP_SHEAR):
            ratio = both[f"{load}, extreme"] / both[f"{load}, extreme of S1"]
            rows.append(
                [
                    name,
                    load,
                    f"{ratio.median():.2f}",
                    f"{ratio.quantile(0.95):.2f}",
                    f"{100.0 * (ratio > 1.05).mean():.0f}",
                ]
            )
    head = ["strategy", "load", "median over S1", "95 % over S1", "runs with 5 % more [%]"]
    return Table(head, rows, "Extremes of derating over those of stopping, gust by gust", text_columns=2)


def verdict(found: Beyond) -> str:
    """Recommendation, from the results."""
    some = longest(found.grid)
    share = 100.0 * some.groupby("strategy")["stops"].mean()
    bending = {name: costs(found.grid, name, f"{YAW_BENDING}, extreme") for name in ("S1", "S2", OURS)}
    paper = yaw_threshold(YawProtection(), found.limits.speeds)
    than = {
        word: ", ".join(f"{c:g}" for c in found.limits.speeds[where])
        for word, where in (
            ("stricter", paper < found.limits.allowed() - 1e-6),
            ("laxer", paper > found.limits.allowed() + 1e-6),
        )
        if where.any()
    }
    stops = 100.0 * stopped_all_the_same(found.grid)
    slow, fast = np.degrees(found.grid.grid.yaw_rates)[[0, -1]]
    short, *_, long = found.grid.grid.rechecks
    years = {y.strategy: y for y in found.years if y.fronts == max(y.fronts for y in found.years)}
    won = {name: (years[name].energy - years[name].stopped) / 3.6e9 for name in ("S2", OURS)}
    calm = max((y.energy - y.stopped) / 3.6e9 for y in found.years if y.fronts == min(FRONTS))
    base = "; ".join(
        f"{c:g} m/s {np.degrees(b):.0f} deg" for c, b in zip(found.limits.speeds, found.limits.allowed(), strict=True)
    )
    lines = (
        f"Of the gusts in the grid S1 stops in {share['S1']:.0f} %, S2 in {share['S2']:.0f} %,",
        f"S2 with base points from loads in {share[OURS]:.0f} %.",
        f"Against going on, a stop changes the extreme bending at the yaw bearing by {bending['S1']},",
        f"derating by {bending['S2']}, with those base points by {bending[OURS]}.",
        f"The recheck must leave the drive its time: after {short:g} s at {slow:.1f} deg/s",
        f"{stops[0, 0]:.0f} % of the derated runs end in a stop,",
        f"after {long:g} s at {fast:.1f} deg/s {stops[-1, -1]:.0f} %.",
        f"Base points that keep loads of production within 1.1 times those of extreme turbulence: {base}.",
        f"The paper's are {' and '.join(f'{word} at {at} m/s' for word, at in than.items()) or 'the same'}.",
        f"In a year with {years['S1'].fronts} fronts derating wins {won['S2']:.0f} MWh against stopping,",
        f"with these base points {won[OURS]:.0f} MWh,",
        f"{100.0 * won[OURS] * 3.6e9 / years['S1'].energy:.2f} % of the year;",
        f"without fronts {calm:.1f} MWh.",
    )
    return " ".join(lines)
