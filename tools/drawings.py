"""Draw the frames and signs of ``docs/conventions.md`` and the machines of the supervisor:  python tools/drawings.py"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Arc, Circle, FancyArrowPatch, Polygon

from meltemi.report.palette import COLOURS, FAINT, GRID, INK, SOFT
from meltemi.reports.state_diagram import plot_states

IMAGES = Path(__file__).parents[1] / "docs" / "images"
AXIS, MOTION, WIND = COLOURS[0], COLOURS[1], COLOURS[5]
BODY = GRID
mpl.rcParams["svg.hashsalt"] = "meltemi"


def page(width: float, height: float, x: tuple[float, float], y: tuple[float, float]) -> tuple[Figure, Any]:
    figure = Figure(figsize=(width, height))
    ax = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    ax.set(xlim=x, ylim=y, aspect="equal")
    ax.axis("off")
    return figure, ax


def arrow(
    ax: Any, a: Any, b: Any, colour: str = AXIS, width: float = 1.6, style: str = "-|>", bend: float = 0.0
) -> None:
    ax.add_patch(
        FancyArrowPatch(
            a,
            b,
            arrowstyle=style,
            mutation_scale=11,
            color=colour,
            linewidth=width,
            shrinkA=0,
            shrinkB=0,
            connectionstyle=f"arc3,rad={bend}",
        )
    )


def text(ax: Any, at: Any, what: str, colour: str = INK, size: float = 10.0, **keywords: Any) -> None:
    ax.text(*at, what, color=colour, fontsize=size, ha=keywords.pop("ha", "center"), va=keywords.pop("va", "center"))


def line(ax: Any, a: Any, b: Any, colour: str = INK, width: float = 0.8, style: str = "--") -> None:
    ax.plot([a[0], b[0]], [a[1], b[1]], color=colour, linewidth=width, linestyle=style)


def axes(
    ax: Any, at: Any, first: tuple[float, str], second: tuple[float, str], third: str, length: float = 1.0
) -> None:
    """Two axes in the page (angle in degrees, name) and the one across it (name, 'in' or 'out')."""
    o = np.array(at, dtype=float)
    for angle, name in (first, second):
        d = np.array([np.cos(np.radians(angle)), np.sin(np.radians(angle))])
        arrow(ax, o, o + length * d)
        text(ax, o + (length + 0.24) * d, name, AXIS)
    name, way = third.split()
    ax.add_patch(Circle(o, 0.1, facecolor="white", edgecolor=AXIS, linewidth=1.3, zorder=5))
    if way == "out":
        ax.add_patch(Circle(o, 0.03, facecolor=AXIS, edgecolor=AXIS, zorder=6))
    else:
        for s in (-1, 1):
            ax.plot(o[0] + np.array([-0.06, 0.06]), o[1] + s * np.array([-0.06, 0.06]), color=AXIS, lw=1.1, zorder=6)
    text(ax, o + (-0.24, -0.2), name, AXIS)


def side() -> Figure:
    """Side view: x to the right (downwind), z up, y into the page."""
    figure, ax = page(9.0, 8.6, (-5.6, 6.0), (-0.9, 10.2))
    tilt, cone = np.radians(8.0), np.radians(7.0)
    top, joint = np.array([0.0, 5.4]), np.array([0.0, 6.0])
    ax.plot([-5.4, 5.8], [0, 0], color=INK, lw=1.2)
    ax.add_patch(Polygon([(-0.32, 0), (0.32, 0), (0.2, 5.4), (-0.2, 5.4)], color=BODY))
    down = np.array([np.cos(tilt), -np.sin(tilt)])  # shaft, downwind
    up = np.array([np.sin(tilt), np.cos(tilt)])
    apex = joint - 1.9 * down
    corners = [joint - 1.2 * down + 0.42 * up, joint + 2.3 * down + 0.42 * up]
    corners += [joint + 2.3 * down - 0.42 * up, joint - 1.2 * down - 0.42 * up]
    ax.add_patch(Polygon(corners, color=BODY))
    ax.add_patch(Circle(apex, 0.3, color=FAINT))
    line(ax, apex - 1.2 * down, joint + 3.2 * down)
    line(ax, (0, 5.4), (0, 7.4))
    for sign, length in ((1, 3.1), (-1, 3.1)):
        along = np.cos(cone) * sign * up - np.sin(cone) * down
        across = np.array([along[1], -along[0]])
        root, tip = apex + 0.3 * along, apex + length * along
        ax.add_patch(
            Polygon([root + 0.12 * across, root - 0.12 * across, tip - 0.02 * across, tip + 0.02 * across], color=FAINT)
        )
        line(ax, apex, apex + 3.4 * sign * up, style=":")
        if sign > 0:
            blade_angle = np.degrees(np.arctan2(along[1], along[0]))
            axes(ax, apex + 1.15 * along, (blade_angle - 90, "$x_c$"), (blade_angle, "$z_c$"), "$y_c$ in", 0.9)
            text(ax, apex + 3.45 * along + (-0.45, 0.0), "blade 1\nazimuth 0", size=9)
    text(ax, apex + 3.35 * up + (0.42, 0.05), "precone", MOTION, 9)
    arrow(ax, apex + 2.9 * up, apex + 2.9 * (np.cos(cone) * up - np.sin(cone) * down), MOTION, 1.3, bend=0.1)
    axes(ax, (2.5, 1.2), (0, "$x$"), (90, "$z$"), "$y$ in")
    text(ax, (3.0, 0.55), "inertial", AXIS, 9)
    axes(ax, (0, 0.0), (0, "$x_t$"), (90, "$z_t$"), "$y_t$ in", 0.85)
    text(ax, (-1.3, 0.35), "tower base\n(TwrBs…t)", AXIS, 9)
    axes(ax, top, (0, "$x_p$"), (90, "$z_p$"), "$y_p$ in", 1.0)
    text(ax, (0.9, 4.95), "tower top and yaw bearing\n(YawBr…p)", AXIS, 9, ha="left")
    arrow(ax, apex, apex + 1.0 * down)
    text(ax, apex + 0.85 * down + (0.05, 0.28), "$x_s$", AXIS)
    text(ax, apex + (-1.05, 0.32), "rotor apex", size=9)
    arrow(ax, joint + 3.0 * np.array([1, 0.0]), joint + 3.0 * down, MOTION, 1.3, bend=-0.1)
    line(ax, joint, joint + (3.4, 0), style=":")
    text(ax, joint + (3.45, -0.2), "tilt", MOTION, 9)
    for z in (3.0, 5.0, 7.0):
        arrow(ax, (-5.3, z), (-4.1, z), WIND)
    text(ax, (-4.7, 7.35), "wind", WIND)
    # dimensions
    arrow(ax, (-3.3, 0), (-3.3, apex[1]), INK, 0.8, "<|-|>")
    line(ax, (-3.5, apex[1]), apex, width=0.5, style="-")
    text(ax, (-3.45, 2.6), "hub height", size=9, ha="right")
    arrow(ax, (-0.75, 5.4), (-0.75, 6.0), INK, 0.8, "<|-|>")
    text(ax, (-0.85, 5.6), "shaft_height", size=8, ha="right")
    arrow(ax, apex + 0.75 * up, joint + 0.75 * up, INK, 0.8, "<|-|>")
    text(ax, (apex + joint) / 2 + 1.0 * up + (0.25, 0), "overhang", size=8)
    return figure


def front() -> Figure:
    """Seen from upwind, looking downwind: x into the page, y to the left, z up."""
    figure, ax = page(7.2, 6.6, (-4.9, 4.9), (-4.5, 4.5))
    ax.add_patch(Polygon([(-0.22, -4.5), (0.22, -4.5), (0.14, 0), (-0.14, 0)], color=BODY))
    for number in range(3):
        psi = np.radians(120.0 * number)
        along, behind = np.array([np.sin(psi), np.cos(psi)]), np.array([-np.cos(psi), np.sin(psi)])
        shape = [0.25 * along - 0.06 * behind, 0.8 * along - 0.1 * behind, 3.3 * along - 0.05 * behind]
        shape += [3.3 * along + 0.05 * behind, 0.8 * along + 0.3 * behind, 0.25 * along + 0.08 * behind]
        ax.add_patch(Polygon(shape, color=FAINT))
        text(ax, 3.75 * along, f"blade {number + 1}")
    ax.add_patch(Circle((0, 0), 0.28, color=SOFT))
    ax.add_patch(Arc((0, 0), 4.4, 4.4, theta1=30, theta2=90, color=MOTION, lw=1.5))
    end = np.radians(30.0)
    arrow(
        ax, 2.2 * np.array([np.cos(end + 0.08), np.sin(end + 0.08)]), 2.2 * np.array([np.cos(end), np.sin(end)]), MOTION
    )
    text(ax, (2.3, 1.95), "azimuth and\nrotor speed", MOTION, 9, ha="left")
    axes(ax, (0, 1.25), (180, "$y_c$"), (90, "$z_c$"), "$x_c$ in", 0.85)
    axes(ax, (3.3, -3.5), (180, "$y$"), (90, "$z$"), "$x$ in", 1.0)
    text(ax, (3.1, -4.1), "inertial; wind into the page", AXIS, 9)
    text(ax, (-1.0, 2.6), "trailing edge", size=9)
    text(ax, (0.85, 2.75), "leading\nedge", size=9)
    arrow(ax, (-0.38, 2.5), (-0.12, 2.15), INK, 0.7)
    arrow(ax, (0.45, 2.55), (0.09, 2.15), INK, 0.7)
    return figure


def section() -> Figure:
    """A blade section seen from the tip towards the root: x downwind, y towards the trailing edge, z to the reader."""
    figure, ax = page(8.2, 6.8, (-4.0, 5.4), (-3.4, 4.4))
    theta, phi = np.radians(14.0), np.radians(32.0)
    t = np.linspace(0, 1, 60)
    thick = 0.6 * (0.2969 * np.sqrt(t) - 0.126 * t - 0.3516 * t**2 + 0.2843 * t**3 - 0.1036 * t**4) * 4.5
    camber = 0.5 * t * (1 - t)
    chord = np.array([np.sin(theta), np.cos(theta)])  # leading to trailing edge
    suction = np.array([np.cos(theta), -np.sin(theta)])  # downwind side
    nose = -1.125 * chord
    upper = nose + 4.5 * t[:, None] * chord + (camber + thick)[:, None] * suction
    lower = nose + 4.5 * t[:, None] * chord + (camber - thick)[:, None] * suction
    ax.add_patch(Polygon(np.vstack([upper, lower[::-1]]), color=BODY))
    line(ax, nose - 1.3 * chord, nose + 5.2 * chord)
    line(ax, (0, -3.3), (0, 4.3), style=":")
    text(ax, (-0.15, 4.2), "rotor plane", size=9, ha="right")
    axes(ax, (0, 0), (0, ""), (90, ""), "$z_c$ out", 1.5)
    text(ax, (1.6, 0.0), "$x_c$ (downwind)", AXIS, ha="left")
    text(ax, (-0.15, 1.5), "$y_c$", AXIS, ha="right")
    # pitch, twist and torsion of the chord
    arrow(ax, (0, 3.75), 3.75 * chord, MOTION, bend=-0.1)
    text(ax, (1.25, 3.75), r"$\theta$ = pitch + twist", MOTION, ha="left")
    # inflow
    w = np.array([np.sin(phi), np.cos(phi)])
    begin = -3.6 * w
    arrow(ax, begin, (0, 0), WIND, 2.0)
    text(ax, 0.72 * begin + (-0.3, 0.12), "$W$", WIND)
    arrow(ax, begin, (0, begin[1]), WIND, 1.2)
    text(ax, (0.55 * begin[0], begin[1] - 0.25), r"$U(1-a)$", WIND)
    arrow(ax, (0, begin[1]), (0, 0), WIND, 1.2)
    text(ax, (0.12, 0.7 * begin[1]), r"$\Omega r(1+a')$", WIND, ha="left")
    ax.add_patch(Arc((0, 0), 4.3, 4.3, theta1=270 - np.degrees(phi), theta2=270, color=INK, lw=1.0))
    text(ax, -2.4 * np.array([np.sin(0.7 * phi), np.cos(0.7 * phi)]), r"$\varphi$")
    ax.add_patch(
        Arc((0, 0), 2.9, 2.9, theta1=270 - np.degrees(phi), theta2=270 - np.degrees(theta), color=MOTION, lw=1.2)
    )
    text(ax, -1.7 * np.array([np.sin((phi + theta) / 2), np.cos((phi + theta) / 2)]), r"$\alpha$", MOTION)
    # forces
    lift = np.array([np.cos(phi), -np.sin(phi)])
    arrow(ax, (0, 0), 2.7 * lift, INK, 2.0)
    text(ax, 2.95 * lift, "lift")
    arrow(ax, (0, 0), 1.0 * w, INK, 2.0)
    text(ax, 1.0 * w + (0.35, 0.1), "drag")
    notes = ("nose up (moment, torsion): counter-clockwise", "towards feather (pitch, twist): clockwise")
    for i, note in enumerate((*notes, "the blade moves towards $-y_c$, driving forces too")):
        text(ax, (1.4, 2.9 - 0.35 * i), note, size=9, ha="left")
    return figure


def above() -> Figure:
    """Seen from above: x to the right (downwind), y up the page."""
    figure, ax = page(7.2, 5.0, (-4.4, 4.2), (-3.0, 3.0))
    yaw, direction = np.radians(18.0), np.radians(15.0)
    d = np.array([np.cos(yaw), np.sin(yaw)])
    n = np.array([-d[1], d[0]])
    ax.add_patch(
        Polygon([-0.9 * d + 0.32 * n, 1.7 * d + 0.32 * n, 1.7 * d - 0.32 * n, -0.9 * d - 0.32 * n], color=BODY)
    )
    ax.add_patch(Polygon([-1.3 * d + 2.3 * n, -1.2 * d + 2.3 * n, -1.2 * d - 2.3 * n, -1.3 * d - 2.3 * n], color=FAINT))
    line(ax, -2.0 * d, 3.2 * d)
    line(ax, (-2.4, 0), (3.6, 0), style=":")
    axes(ax, (0, 0), (0, "$x$"), (90, "$y$"), "$z$ out", 1.2)
    arrow(ax, (2.7, 0), 2.7 * d, MOTION, bend=0.12)
    text(ax, (3.0, 0.6), "yaw", MOTION, ha="left")
    w = np.array([np.cos(direction), -np.sin(direction)])
    at = np.array([-4.1, 1.9])
    line(ax, at, at + (2.4, 0), style=":")
    arrow(ax, at, at + 2.0 * w, WIND, 2.0)
    arrow(ax, at + (1.7, 0), at + 1.7 * w, MOTION, bend=-0.12)
    text(ax, at + (1.0, 0.3), "wind direction", MOTION, ha="left")
    text(ax, at + (0.8, -0.55), "wind", WIND)
    return figure


if __name__ == "__main__":
    for draw in (side, front, section, above):
        path = IMAGES / f"conventions-{draw.__name__}.svg"
        draw().savefig(path, metadata={"Date": None})
        print(f"wrote {path}")
    for machine, name in (("operation", "supervisor-operation"), ("yaw", "supervisor-yaw"), ("power", "power-states")):
        path = IMAGES / f"{name}.svg"
        plot_states(machine).savefig(path, metadata={"Date": None})
        print(f"wrote {path}")
