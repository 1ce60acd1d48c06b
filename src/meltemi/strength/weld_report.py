"""Table and figure of the fatigue of tower welds."""

from __future__ import annotations

from collections.abc import Sequence
from math import degrees
from typing import TYPE_CHECKING

import numpy as np

from meltemi.report.palette import COLOURS, FAINT, INK, curve
from meltemi.report.plots import figure_title, new_figure, note, panel
from meltemi.report.tables import Rows, number
from meltemi.strength.welds import WeldFatigue

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MOST = 6
"""Largest number of welds whose damage is drawn over the direction: those with the largest one."""
SHORT = ("weld", "category", "wall [mm]", "direction [deg]", "DEL 1 Hz [MPa]", "damage", "life [years]", "buckling")
LEAST = 1e-12
"""Least damage that is drawn."""
BOX = {"facecolor": "white", "edgecolor": "none", "pad": 0.6, "alpha": 0.85}
"""Behind names."""
HEAD = (
    "weld,category,height [m],diameter [m],wall [mm],direction [deg],DEL 1 Hz [MPa],shear [MPa],damage,life [years],"
    "utilisation,buckling,loads at [m]"
).split(",")


def weld_rows(welds: Sequence[WeldFatigue]) -> Rows:
    """Header and rows of the fatigue of welds.

    The direction is that of the worst place, from downwind to the left; the DEL has the curve's first slope, stress
    concentration and factors in it; shear is the largest nominal shear stress; life is that to a utilisation of 1;
    buckling is the utilisation of the shell in compression.
    """
    rows = []
    for w in welds:
        shown = (w.weld.height, w.tube.diameter, 1e3 * w.tube.thickness, degrees(w.worst), 1e-6 * w.load)
        judged = (1e-6 * w.shear, w.damage.max(), w.life, w.utilisation, w.buckling)
        values = ["" if np.isnan(v) else number(v) for v in (*shown, *judged)]
        at = " and ".join(f"{h:.4g}" for h in w.loads_at)
        rows.append([name_of(w), f"{w.weld.category}, {w.weld.environment}", *values, at])
    return list(HEAD), rows


def short_weld_rows(rows: Rows) -> Rows:
    """The columns of :func:`weld_rows` for a terminal."""
    kept = [HEAD.index(name) for name in SHORT]
    return list(SHORT), [[row[k] for k in kept] for row in rows[1]]


def name_of(w: WeldFatigue) -> str:
    """Name of a weld, by default its height."""
    return w.weld.name or f"{w.weld.height:g} m"


def plot_welds(welds: Sequence[WeldFatigue], title: str = "") -> Figure:
    """Draw utilisation over height, damage over the direction, and cycles of the worst weld beside its S-N curve."""
    figure, axes = new_figure(1, 3, size=(13.0, 4.6), share=False)
    tall, around, cycles = axes[0]
    worst = sorted(welds, key=lambda w: -w.utilisation)
    for j, w in enumerate(worst):
        look = {"marker": "o", "color": FAINT} if j >= MOST else curve(j) | {"markersize": 3.5}
        at = (max(w.utilisation, LEAST), w.weld.height)
        tall.plot(*([x] for x in at), **look | {"markersize": 5.0, "linestyle": "", "zorder": 4})
        note(tall, f"{name_of(w)}: {w.weld.category}", at, (7, -2), color=look["color"], bbox=BOX, zorder=2)
        if j < MOST:
            x = np.degrees(np.append(w.angles, w.angles[0] + 2.0 * np.pi))
            line = {} if len(w.angles) > 4 else {"linestyle": ""}  # four directions say nothing of those between
            around.semilogy(x, np.maximum(np.append(w.damage, w.damage[0]), LEAST), **look | line)
    used = [max(w.utilisation, LEAST) for w in welds]
    tall.set_xscale("log")
    tall.set_xlim(0.5 * min(*used, 0.2), 4.0 * max(*used, 1.0))
    tall.axvline(1.0, color=INK, linewidth=0.8, linestyle="--")
    panel(tall, "utilisation", "m above the tower base", "damage of the lifetime with all factors [-]")
    panel(around, "damage round the shell", "-", "place, from downwind (0) to the left (90) [deg]")
    top = max(float(worst[0].damage.max()), 10.0 * LEAST)
    around.set_ylim(1e-5 * top, 2.0 * top)
    around.set_xticks(range(0, 361, 60))
    _draw_cycles(cycles, worst[0])
    if title:
        figure_title(figure, title)
    return figure


def _draw_cycles(ax: Axes, w: WeldFatigue) -> None:
    """Draw the numbers of cycles above each range, with all factors, and the S-N curve."""
    order = np.argsort(-w.cycles.ranges)
    ranges, counts = 1e-6 * w.cycles.ranges[order], np.cumsum(w.cycles.counts[order])
    top = max(1.2 * float(ranges.max(initial=0.0)), 400.0)
    S = np.geomspace(1.0, top, 400)
    rate = w.curve.rate(1e6 * S, w.tube.thickness)
    ax.loglog(1.0 / rate[rate > 0.0], S[rate > 0.0], color=COLOURS[1])
    ax.loglog(np.append(counts[:1], counts), np.append(ranges, ranges[-1:]), color=COLOURS[0], drawstyle="steps-post")
    ax.set_xlim(1e3, 1e10)
    ax.set_ylim(1.0, top)
    panel(ax, f"cycles of the lifetime above a range, worst weld ({name_of(w)})", "MPa", "cycles [-]")
    note(ax, f"S-N curve {w.weld.category}, {w.weld.environment}", (1e7, 60.0), (4, 4), color=COLOURS[1])
    note(ax, f"damage {w.damage.max():.3g}", (1e3, 1.0), (6, 6), color=COLOURS[0])
