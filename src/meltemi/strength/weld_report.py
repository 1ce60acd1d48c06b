"""Table and figure of the fatigue of tower welds."""

from __future__ import annotations

from collections.abc import Sequence
from math import degrees
from typing import TYPE_CHECKING

import numpy as np

from meltemi.report.palette import COLOURS, FAINT, INK, curve
from meltemi.report.plots import new_figure, note, panel
from meltemi.report.tables import Rows, number
from meltemi.strength.welds import WeldFatigue

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MOST = 6
"""Largest number of welds whose damage is drawn over the direction: those with the largest one."""
HEAD = (
    "weld,category,height [m],diameter [m],wall [mm],direction [deg],DEL 1 Hz [MPa],shear [MPa],damage,life [years],"
    "utilisation,loads at [m]"
).split(",")


def weld_rows(welds: Sequence[WeldFatigue]) -> Rows:
    """Header and rows of the fatigue of welds.

    The direction is that of the worst place, from downwind to the left; the DEL has the curve's first slope, stress
    concentration and factors in it; shear is the largest nominal shear stress; life is that to a utilisation of 1.
    """
    rows = []
    for w in welds:
        shown = (w.weld.height, w.tube.diameter, 1e3 * w.tube.thickness, degrees(w.worst), 1e-6 * w.load)
        judged = (
            "" if np.isnan(w.shear) else number(1e-6 * w.shear),
            *map(number, (w.damage.max(), w.life, w.utilisation)),
        )
        name = w.weld.name or f"{w.weld.height:g} m"
        at = " and ".join(f"{h:.4g}" for h in w.loads_at)
        rows.append([name, f"{w.weld.category}, {w.weld.environment}", *map(number, shown), *judged, at])
    return list(HEAD), rows


def plot_welds(welds: Sequence[WeldFatigue], title: str = "") -> Figure:
    """Draw utilisation over height, damage over the direction, and cycles of the worst weld beside its S-N curve."""
    figure, axes = new_figure(1, 3, size=(13.0, 4.6), share=False)
    tall, round_, cycles = axes[0]
    worst = sorted(welds, key=lambda w: -w.utilisation)
    for j, w in enumerate(worst[:MOST]):
        look = curve(j) | {"markersize": 3.5}
        label = f"{w.weld.name or f'{w.weld.height:g} m'}: {w.weld.category}"
        x = np.degrees(np.append(w.angles, w.angles[0] + 2.0 * np.pi))
        round_.semilogy(x, np.maximum(np.append(w.damage, w.damage[0]), 1e-300), label=label, **look)
        tall.plot([max(w.utilisation, 1e-300)], [w.weld.height], color=look["color"], marker=look["marker"], zorder=3)
    rest = worst[MOST:]
    tall.plot([max(w.utilisation, 1e-300) for w in rest], [w.weld.height for w in rest], "o", color=FAINT)
    tall.set_xscale("log")
    tall.axvline(1.0, color=INK, linewidth=0.8, linestyle="--")
    panel(tall, "utilisation of the lifetime", "m above the tower base", "damage with all factors [-]")
    panel(round_, "damage round the shell", "-", "place, from downwind (0) to the left (90) [deg]")
    round_.set_xticks(range(0, 361, 60))
    top = max(float(worst[0].damage.max()), 1e-300)
    round_.set_ylim(
        max(float(min(w.damage[w.damage > 0].min(initial=top) for w in worst[:MOST])) / 2.0, 1e-7 * top), 3.0 * top
    )
    round_.legend(loc="lower center", ncols=2)
    w = worst[0]
    order = np.argsort(-w.cycles.ranges)
    ranges = 1e-6 * w.cycles.ranges[order]
    if len(ranges):
        cycles.loglog(
            np.cumsum(w.cycles.counts[order]),
            ranges,
            color=COLOURS[0],
            drawstyle="steps-pre",
            label="cycles of the lifetime above a range",
        )
    S = np.geomspace(2.0, 600.0, 300)
    rate = w.curve.rate(1e6 * S, w.tube.thickness)
    cycles.loglog(
        1.0 / rate[rate > 0.0],
        S[rate > 0.0],
        color=COLOURS[1],
        label=f"S-N curve {w.weld.category}, {w.weld.environment}",
    )
    cycles.set_xlim(0.5, 1e10)
    cycles.set_ylim(1.0, 1.2 * max(float(ranges.max(initial=0.0)), 400.0))
    panel(cycles, f"worst weld, at {w.weld.height:g} m", "MPa", "cycles [-]")
    note(cycles, f"damage {w.damage.max():.3g}", (1.0, 1.2), (4, 2))
    cycles.legend(loc="upper right")
    if title:
        figure.suptitle(title)
    return figure
