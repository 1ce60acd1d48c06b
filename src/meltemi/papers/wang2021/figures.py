"""Figures of the paper from our runs."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from meltemi.papers.wang2021.gust import DERATE, DRAWN, SIGNS, Gust, Gusts
from meltemi.papers.wang2021.table2 import MOMENT, POWER, Table2
from meltemi.papers.wang2021.winds import TIMES, measured
from meltemi.report.palette import COLOURS, FAINT, INK
from meltemi.report.plots import new_figure, panel
from meltemi.reports.panels import Panel, channel, series
from meltemi.simulation.result import Result
from meltemi.studies.machine_loads import LOADS, TOP_SHEAR, YAW_BENDING, YAW_TORSION
from meltemi.supervisor.threshold import YawProtection, yaw_threshold
from meltemi.tuning.run_store import survivors

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Float = NDArray[np.float64]


def table2(tables: dict[str, Table2]) -> Figure:
    """Power and load curves of Table 2 over the measured columns."""
    figure, axes = new_figure(2, 2, size=(11.0, 7.0))
    rows = measured()
    speed = [r.speed for r in rows]
    panels = (
        ("Table 2: mean power", "kW", POWER, "mean", "power_mean"),
        ("Table 2: standard deviation of power", "kW", POWER, "std", "power_std"),
        ("Table 2: mean flapwise moment", "kN m", MOMENT, "mean", "moment_mean"),
        ("Table 2: standard deviation of the flapwise moment", "kN m", MOMENT, "std", "moment_std"),
    )
    for ax, (title, unit, name, of, column) in zip(axes.flat, panels, strict=True):
        values = [getattr(r, column) for r in rows]
        ax.plot(speed, values, color=INK, marker="s", markersize=4, linewidth=0.0, label="measured")
        for colour, (label, table) in zip(COLOURS, tables.items(), strict=False):
            series = table.column(name, of)
            ax.plot(speed, series, color=colour, marker="o", markersize=3, label=label)
            if of == "mean":
                low, high = table.column(name, "min"), table.column(name, "max")
                ax.fill_between(speed, low, high, color=colour, alpha=0.10, linewidth=0.0)
        panel(ax, title, unit)
    axes[0, 0].legend()
    for ax in axes[-1]:
        ax.set_xlabel("wind speed [m/s]")
    return figure


SHOWN: tuple[Panel, ...] = (
    ("wind at the hub", "m/s", channel("wind_x")),
    ("A: rotor speed", "rpm", channel("rotor_speed", 30.0 / np.pi)),
    ("B: electrical power", "kW", channel("generator_power", 1e-3)),
    ("pitch", "deg", channel("pitch_1", 180.0 / np.pi)),
    ("yaw", "deg", channel("nacelle_yaw", 180.0 / np.pi)),
    ("flapwise moment, blade 1", "kN m", channel("root_moment_flap_1", 1e-3)),
    ("yaw bearing, nodding", "kN m", channel("yaw_moment_y", 1e-3)),
    ("tower base, fore-aft", "MN m", channel("tower_base_moment_fore_aft", 1e-6)),
)


def validation(results: Sequence[Result], title: str, spans: Sequence[tuple[float, float, str, float]]) -> Figure:
    """Figures 4 and 5: all seeds of a validation run, the first one in colour.

    Args:
      spans: begin and end [s], text, and power [kW] of statements of the paper.
    """
    figure, axes = new_figure(len(SHOWN), size=(9.0, 1.45 * len(SHOWN) + 0.8))
    for ax, (name, unit, of) in zip(axes[:, 0], SHOWN, strict=True):
        for i, result in reversed(list(enumerate(survivors(results)))):
            look = {"color": COLOURS[0], "linewidth": 0.9} if i == 0 else {"color": FAINT, "linewidth": 0.5}
            ax.plot(result.time, of(result), **look)
        if name == "B: electrical power":
            for (begin, end, words, value), colour in zip(spans, COLOURS[1:], strict=False):
                ax.plot([begin, end], [value, value], color=colour, linewidth=2.0, label=f"{words}: {value:g} kW")
            ax.legend(loc="lower right")
        panel(ax, name, unit)
    axes[-1, 0].set_xlabel("time [s]")
    figure.suptitle(title)
    return figure


def thresholds() -> Figure:
    """Figures 6 and 7 and Table 3: the stepwise law, the interpolated one, and its base points."""
    figure, axes = new_figure(1, size=(7.5, 4.2))
    ax = axes[0, 0]
    c = np.linspace(0.0, 42.0, 2101)
    for colour, law in zip(COLOURS, ("stepwise", "interpolated"), strict=False):
        protection = YawProtection(law=law)  # type: ignore[arg-type]
        ax.plot(c, np.degrees(yaw_threshold(protection, c)), color=colour, label=law)
    base = YawProtection()
    ax.plot(base.wind_speeds, np.degrees(base.thresholds), "o", color=COLOURS[1], label="base points")
    ax.set_xlabel("wind speed, mean over 30 s [m/s]")
    ax.set_ylim(0.0, 65.0)
    ax.legend()
    panel(ax, "Table 3, Figs 6 and 7: limit of the yaw error", "deg")
    return figure


def gust_wind(gusts: Gusts) -> Figure:
    """Figure 9: speed and direction of the wind, both directions and all rise times."""
    figure, axes = new_figure(2, size=(9.0, 6.0))
    looks = {"wind": (COLOURS[0], "-"), "yaw error of S2": (COLOURS[1], "-"), "threshold": (COLOURS[2], "--")}
    for width, (time, sign) in zip((1.8, 1.8, 0.8, 0.8), product(TIMES, SIGNS), strict=True):
        result = gusts.first(sign, time).results[DERATE]
        u, v = result["wind_x"], result["wind_y"]
        axes[0, 0].plot(result.time, np.hypot(u, v), color=COLOURS[0], linewidth=width)
        limit = sign * np.degrees(result["yaw_threshold"])
        angles = (np.degrees(np.arctan2(-v, u)), np.degrees(result["yaw_error"]), limit)
        for (words, (colour, style)), angle in zip(looks.items(), angles, strict=True):
            label = f"{words}, within {time:g} s" if sign > 0 else None
            axes[1, 0].plot(result.time, angle, color=colour, linestyle=style, linewidth=width, label=label)
    axes[1, 0].legend(ncols=2, loc="center right")
    panel(axes[0, 0], "Fig. 9: wind speed at the hub; thick: within 20 s, thin: within 10 s", "m/s")
    panel(axes[1, 0], "Fig. 9: direction; filtered yaw error and its threshold, clockwise above zero", "deg")
    axes[-1, 0].set_xlabel("time [s]")
    return figure


def gust_runs(gust: Gust, letters: str = "") -> Figure:
    """Pitch, power, rotor speed and loads under the strategies, with the letters of the panels in the paper."""
    panels: list[Panel] = [
        ("pitch", "deg", lambda r: np.degrees(r["pitch_1"])),
        ("electrical power", "kW", channel("generator_power", 1e-3)),
        ("rotor speed", "rpm", lambda r: r["rotor_speed"] * 30.0 / np.pi),
    ]
    for name in (YAW_BENDING, YAW_TORSION, TOP_SHEAR):
        load = LOADS[name]
        panels.append((name, load.unit, lambda r, load=load: load.size(r) * load.factor))  # type: ignore[misc]
    if letters:
        lettered = zip(letters, panels, strict=True)
        panels = [(f"Fig. 10{a}: {what}" if a.strip() else what, *rest) for a, (what, *rest) in lettered]  # type: ignore[misc]
    return series(panels, {n: gust.results[n] for n in DRAWN if n in gust.results}, height=1.8, rest=0.6)


def figure_10(gust: Gust) -> Figure:
    """Figure 10; dotted: the paper's 18 s (for an assumed begin of its gust) and 2,000 kW."""
    figure = gust_runs(gust, "AB CCD")
    pitch, power, *_ = figure.axes
    pitch.axvline(18.0, color=INK, linestyle=":", linewidth=1.0)
    power.axhline(2000.0, color=INK, linestyle=":", linewidth=1.0)
    return figure
