"""Figures of a turbine: ``plot_turbine`` puts all of it on one page, ``turbine_figures`` has one for each topic."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Sequence
from typing import TYPE_CHECKING, Literal

from meltemi.report.palette import INK, SOFT
from meltemi.reports.portrait import Portrait, portrait
from meltemi.reports.turbine_panels import (
    Panel,
    bending,
    drag,
    lift,
    mass,
    moment,
    offsets,
    pitch,
    planform,
    power,
    power_coefficient,
    speed,
    stiffness,
    thrust,
    thrust_coefficient,
    torsion,
    tower_modes,
    tower_size,
    tower_stiffness,
    twist,
)
from meltemi.reports.turbine_sketch import facts, sketch
from meltemi.turbine.definition import Turbine

if TYPE_CHECKING:
    from matplotlib.figure import Figure

HALVED: dict[Panel, Panel] = {power: speed, thrust: pitch}
"""Panels that share their place on the page with another, below."""


def plot_turbine(turbine: Turbine | Portrait) -> Figure:
    """Summary figure of a turbine: scale drawing, main data, blade, tower, polars, coefficients, operation.

    Args:
      turbine: it, or its portrait if there is one already.
    """
    overview = turbine if isinstance(turbine, Portrait) else portrait(turbine)
    figure = _figure((18.0, 13.6), layout=None)
    rows: tuple[tuple[float, tuple[tuple[float, Panel], ...]], ...] = (
        (1.85, ((1.6, sketch), (1.85, facts), (0.85, power), (0.85, thrust))),
        (1.0, ((2.1, planform), (1.0, power_coefficient), (1.0, thrust_coefficient))),
        (1.0, ((1.0, twist), (1.0, stiffness), (1.0, mass), (1.0, offsets))),
        (1.0, ((1.0, bending), (1.0, torsion), (0.5, tower_size), (0.5, tower_stiffness), (0.7, tower_modes))),
        (1.05, ((1.0, lift), (1.0, drag), (1.0, moment))),
    )
    left, right, top, across, down = 0.036, 0.992, 0.935, 0.038, 0.052
    height = (top - 0.04 - down * (len(rows) - 1)) / sum(share for share, _ in rows)
    for share, panels in rows:
        width = (right - left - across * (len(panels) - 1)) / sum(w for w, _ in panels)
        x = left
        for w, panel in panels:
            box = (x, top - share * height, w * width, share * height)
            if panel in HALVED:  # two above each other
                half = 0.5 * (box[3] - down)
                panel(figure.add_axes((x, box[1] + half + down, box[2], half)), overview)
                HALVED[panel](figure.add_axes((*box[:3], half)), overview)
            else:
                panel(figure.add_axes(box), overview)
            x += w * width + across
        top -= share * height + down
    t = overview.turbine
    figure.text(0.012, 0.988, t.name, fontsize=18, fontweight="bold", color=INK, va="top")
    origin = "\n".join(textwrap.shorten(words, 110) for words in (t.description, t.source) if words)
    figure.text(0.992, 0.988, origin, fontsize=8, color=SOFT, va="top", ha="right")
    return figure


def turbine_figures(overview: Portrait) -> dict[str, Figure]:
    """Separate figures of blade, tower, polars, rotor and operation."""
    groups: dict[str, tuple[tuple[float, float], Sequence[Sequence[Panel]]]] = {
        "blade": ((11.0, 12.0), ((planform,), (twist, offsets), (stiffness, mass), (bending, torsion))),
        "tower": ((11.0, 4.6), ((tower_size, tower_stiffness, tower_modes),)),
        "polars": ((11.0, 11.0), ((lift,), (drag,), (moment,))),
        "rotor": ((11.0, 4.6), ((power_coefficient, thrust_coefficient),)),
        "operation": ((11.0, 6.4), ((power, thrust), (speed, pitch))),
    }
    figures = {}
    for name, (size, rows) in groups.items():
        figure = figures[name] = _figure(size)
        grid = figure.add_gridspec(len(rows), math.lcm(*map(len, rows)))
        for i, row in enumerate(rows):
            width = grid.ncols // len(row)
            for j, panel in enumerate(row):
                panel(figure.add_subplot(grid[i, j * width : (j + 1) * width]), overview)
    return figures


def _figure(size: tuple[float, float], layout: Literal["constrained"] | None = "constrained") -> Figure:
    from meltemi.report.figure import ShownFigure

    return ShownFigure(figsize=size, layout=layout)
