"""Drawings of reports, as SVG within a page and with Matplotlib for documents."""

from __future__ import annotations

import math
from html import escape
from typing import TYPE_CHECKING, Any

from meltemi.report.palette import COLOURS, FAINT, GRID, INK
from meltemi.reports.blocks import Drawing, Stroke

if TYPE_CHECKING:
    from matplotlib.figure import Figure

ARROW, HALF = 3.0, math.radians(20.0)
"""Length and half the angle of the head of an arrow."""
RADIUS = 1.6
"""Radius of the circle of an axis that enters or leaves the picture."""
LABEL_SIZE = 4.2
"""Size of a label."""
Point = tuple[float, float]


def _head(stroke: Stroke) -> list[Point]:
    """Corners of the head of an arrow."""
    (x0, y0), (x, y) = stroke.points[-2:]
    back = math.atan2(y0 - y, x0 - x)
    return [(x, y), *((x + ARROW * math.cos(back + a), y + ARROW * math.sin(back + a)) for a in (HALF, -HALF))]


def _label_place(stroke: Stroke) -> Point:
    """Centre of a label: beyond the end of a line, beside a point."""
    x, y = stroke.points[-1]
    if len(stroke.points) < 2:
        return x + 2.6 * RADIUS, y - 2.6 * RADIUS
    x0, y0 = stroke.points[-2]
    length = math.hypot(x - x0, y - y0) or 1.0
    u, v = LABEL_SIZE * (x - x0) / length, LABEL_SIZE * (y - y0) / length
    return x + u + 0.7 * v, y + v - 0.7 * u  # beside a blade that continues in the direction of the axis


def svg_of(drawing: Drawing) -> str:
    """An SVG element; its colours are those of the page."""
    h, height = drawing.high, drawing.high - drawing.low

    def points(of: list[Point]) -> str:
        return " ".join(f"{x:.1f},{h - y:.1f}" for x, y in of)

    parts = []
    for s in drawing.strokes:
        x, y = s.points[-1][0], h - s.points[-1][1]
        if s.kind in ("point", "into", "out"):
            parts.append(f'<circle class="{s.kind}" cx="{x:.1f}" cy="{y:.1f}" r="{RADIUS}"/>')
            d = 0.7 * RADIUS
            if s.kind == "into":
                parts.append(
                    f'<path class="axis" d="M{x - d:.1f} {y - d:.1f}l{2 * d} {2 * d}m0 {-2 * d}l{-2 * d} {2 * d}"/>'
                )
            elif s.kind == "out":
                parts.append(f'<circle class="head axis" cx="{x:.1f}" cy="{y:.1f}" r="0.5"/>')
        else:
            shape = "polygon" if s.kind == "body" else "polyline"
            parts.append(f'<{shape} class="{s.kind}" points="{points(list(s.points))}"/>')
            if s.kind in ("axis", "wind"):
                parts.append(f'<polygon class="head {s.kind}" points="{points(_head(s))}"/>')
        if s.label:
            u, v = _label_place(s)
            parts.append(f'<text x="{u:.1f}" y="{h - v + 0.35 * LABEL_SIZE:.1f}">{escape(s.label)}</text>')
    name = escape(drawing.title)
    return f'<svg class="sketch" viewBox="0 0 100 {height:g}" role="img" aria-label="{name}">{"".join(parts)}</svg>'


LOOKS: dict[str, dict[str, Any]] = {
    "body": {"color": GRID},
    "line": {"color": FAINT, "linewidth": 3.0},
    "thin": {"color": FAINT, "linewidth": 0.8},
    "axis": {"color": COLOURS[0], "linewidth": 1.5},
    "wind": {"color": FAINT, "linewidth": 1.2},
}


def figure_of(drawing: Drawing) -> Figure:
    """The drawing as a figure of Matplotlib."""
    from matplotlib.figure import Figure

    size = 2.2
    figure = Figure(figsize=(size, size * (drawing.high - drawing.low) / 100.0))
    ax = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    ax.set(xlim=(0.0, 100.0), ylim=(drawing.low, drawing.high))
    ax.set_axis_off()
    for s in drawing.strokes:
        x, y = s.points[-1]
        if s.kind in ("point", "into", "out"):
            marker = {"point": "o", "into": "$\\otimes$", "out": "$\\odot$"}[s.kind]
            ax.plot(x, y, marker=marker, color=INK if s.kind == "point" else COLOURS[0], markersize=6.0)
        elif s.kind == "body":
            ax.fill(*zip(*s.points, strict=True), **LOOKS["body"])
        else:
            ax.plot(*zip(*s.points, strict=True), **LOOKS[s.kind])
            if s.kind in ("axis", "wind"):
                ax.fill(*zip(*_head(s), strict=True), color=LOOKS[s.kind]["color"])
        if s.label:
            ax.text(*_label_place(s), s.label, ha="center", va="center", fontsize=7.0)
    return figure
