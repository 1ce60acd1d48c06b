"""Scale drawing of a turbine, and its main data."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from meltemi.report.palette import COLOURS, FAINT, INK, SHADE, SOFT
from meltemi.report.plots import corner
from meltemi.reports.turbine_facts import turbine_facts
from meltemi.reports.turbine_overview import TurbineOverview
from meltemi.turbine.definition import Airfoil, Turbine

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Float = NDArray[np.float64]


def sketch(ax: Axes, overview: TurbineOverview) -> None:
    """Scale drawing of the turbine, front and side view: undeflected rotor at zero pitch."""
    from matplotlib.patches import Polygon, Rectangle

    t = overview.turbine
    n, R, hub = t.nacelle, t.rotor_radius, t.hub_height
    side = 1.75 * R + n.overhang
    for centre in (0.0, side):
        r = 0.5 * t.tower.diameter
        z = t.tower.base_height + t.tower.position
        outline = np.concatenate([np.stack([centre - r, z], 1), np.stack([centre + r, z], 1)[::-1]])
        ax.add_patch(Polygon(outline, facecolor=SHADE, edgecolor=INK, linewidth=0.7))
    below = [each.view_shape() for each in t.substructures]
    for member in (member for each in below for member in each["members"]):
        for centre, i in ((0.0, 1), (side, 0)):
            _member(ax, centre, i, np.array(member))
    circle = np.linspace(0.0, 2.0 * np.pi, 181)
    ax.plot(R * np.sin(circle), hub + R * np.cos(circle), color=FAINT, linewidth=0.6, linestyle=(0, (4, 3)))
    size = 0.5 * float(t.tower.diameter[-1])
    top = t.tower.base_height + t.tower.length
    behind = side + 2.0 * max(size, n.mass_centre[0])
    length, height = behind - side + 0.6 * n.overhang, max(2.0 * n.shaft_height, 1.2 * size)
    box = Rectangle((side - 0.6 * n.overhang, top), length, height, facecolor="white", edgecolor=INK, linewidth=0.7)
    ax.add_patch(box)
    leading, trailing = _edges(t)
    outline = np.concatenate([leading, trailing[::-1]])  # x downwind, y to the trailing edge, z to the tip
    _, y, z = outline.T
    look: dict[str, Any] = {"facecolor": "white", "edgecolor": INK, "linewidth": 0.8}
    for psi in 2.0 * np.pi * np.arange(t.n_blades) / t.n_blades:
        front = np.stack([z * np.sin(psi) - y * np.cos(psi), hub + z * np.cos(psi) + y * np.sin(psi)], 1)
        ax.add_patch(Polygon(front, joinstyle="round", **look))
        ax.add_patch(Polygon(_from_the_side(t, outline, psi, side), **look))
    ax.plot(0.0, hub, marker="o", color=INK, markersize=3)
    ax.plot(side - n.overhang * math.cos(n.tilt), hub, marker="o", color=INK, markersize=3)
    ax.axhline(0.0, color=INK, linewidth=1.2)
    _arrow(ax, (-1.16 * R, 0.0), (-1.16 * R, hub), f"hub {hub:.4g} m")
    _arrow(ax, (-R, hub + 1.1 * R), (R, hub + 1.1 * R), f"rotor {2 * R:.4g} m", beside=False)
    lines = [f"tilt {math.degrees(n.tilt):.3g}°, cone {math.degrees(t.hub.precone):.3g}°"]
    lines.append(f"overhang {n.overhang:.4g} m")
    prebend = t.blade.structure.axis_x
    if prebend is not None and np.any(prebend):
        lines.append(f"prebend {abs(prebend[-1]):.3g} m {'upwind' if prebend[-1] < 0 else 'downwind'}")
    ax.text(side + 0.14 * R, hub - 0.55 * R, "\n".join(lines), fontsize=7.5, color=SOFT, va="top", linespacing=1.4)
    arrow = {"arrowstyle": "-|>", "color": COLOURS[0], "linewidth": 1.4}
    ax.annotate("", (side - 0.3 * R, hub + 0.62 * R), (side - 0.62 * R, hub + 0.62 * R), arrowprops=arrow)
    ax.text(side - 0.46 * R, hub + 0.65 * R, "wind", fontsize=7.5, color=COLOURS[0], ha="center", va="bottom")
    ax.set_xlim(-1.3 * R, side + 0.95 * R)
    lowest = min((member[k] for each in below for member in each["members"] for k in (2, 5)), default=0.0)
    ax.set_ylim(lowest - 0.04 * R, hub + 1.18 * R)
    ax.set_aspect("equal", anchor="W")
    ax.set_axis_off()
    ax.set_title("front view (looking downwind) and side view, to scale", pad=4, fontweight="bold")


def _member(ax: Axes, centre: float, i: int, member: Float) -> None:
    """A tapered member seen along x (``i`` 1) or y (0)."""
    from matplotlib.patches import Polygon

    a, b = member[[i, 2]], member[[i + 3, 5]]
    along = (b - a) / max(float(np.hypot(*(b - a))), 1e-9)
    across = 0.5 * np.array([-along[1], along[0]])
    r, s = member[6:8]
    outline = np.array([a - r * across, b - s * across, b + s * across, a + r * across])
    outline[:, 0] += centre
    ax.add_patch(Polygon(outline, facecolor=SHADE, edgecolor=INK, linewidth=0.4))


def _edges(turbine: Turbine) -> tuple[Float, Float]:
    """(S, 3) leading and trailing edge in blade axes at zero pitch, z from the rotor's axis.

    Aerodynamic centres lie at a quarter of the chord from the leading edge, of round roots in the middle.
    """
    a = turbine.blade.aerodynamics
    x, y, ahead = planform_of(turbine)
    z = turbine.hub.radius + a.position
    leading, trailing = (  # along the chord, towards the trailing edge; the nose turns into the wind
        np.stack([x + along * np.sin(a.twist), y + along * np.cos(a.twist), z], 1)
        for along in (-ahead * a.chord, (1.0 - ahead) * a.chord)
    )
    return leading, trailing


def planform_of(turbine: Turbine) -> tuple[Float, Float, Float]:
    """Aerodynamic centre x, y [m] from the pitch axis, and the fraction of the chord ahead of it."""
    a = turbine.blade.aerodynamics
    zero = np.zeros(len(a.position))
    lifting = [r for r, name in zip(a.position, a.airfoil, strict=True) if _lifts(turbine.airfoils[name])]
    round_root = [0.0, max(float(lifting[0]), 1e-6)] if lifting else [0.0, 1e-6]
    ahead = np.interp(a.position, round_root, [0.5, 0.25] if lifting and lifting[0] > 0.0 else [0.25, 0.25])
    return zero if a.centre_x is None else a.centre_x, zero if a.centre_y is None else a.centre_y, ahead


def _lifts(airfoil: Airfoil) -> bool:
    """Whether the lift slope is at least half of that of a flat plate; otherwise the section is nearly cylindrical."""
    low, high = np.interp((-0.1, 0.1), airfoil.angle_of_attack, airfoil.lift)
    return bool(high - low > 0.2 * math.pi)


def _from_the_side(turbine: Turbine, points: Float, psi: float, side: float) -> Float:
    """(n, 2) points of a blade at azimuth ``psi`` in the side view."""
    n, cone = turbine.nacelle, turbine.hub.precone
    along = points[:, 0] * math.cos(cone) - points[:, 2] * math.sin(cone)
    out = points[:, 0] * math.sin(cone) + points[:, 2] * math.cos(cone)
    up = out * np.cos(psi) + points[:, 1] * np.sin(psi)
    c, s = math.cos(n.tilt), math.sin(n.tilt)
    along = along - n.overhang
    top = turbine.tower.base_height + turbine.tower.length + n.shaft_height
    return np.stack([side + along * c + up * s, top - along * s + up * c], 1)


def _arrow(ax: Axes, begin: tuple[float, float], end: tuple[float, float], text: str, *, beside: bool = True) -> None:
    ax.annotate("", end, begin, arrowprops={"arrowstyle": "<->", "color": SOFT, "linewidth": 0.8})
    at = (0.5 * (begin[0] + end[0]), 0.5 * (begin[1] + end[1]))
    box = {"facecolor": "white", "edgecolor": "none", "pad": 1.0}
    ax.text(*at, text, fontsize=8, color=SOFT, ha="center", va="center", rotation=90 if beside else 0, bbox=box)


def facts(ax: Axes, overview: TurbineOverview) -> None:
    """Main data in two columns."""
    from meltemi.report.figure import grouped

    ax.set_axis_off()
    groups = turbine_facts(overview)
    half = sum(len(rows) + 1.6 for _, rows in groups) / 2.0
    step, y, x = 1.0 / (half + 2.5), 1.0, 0.0
    for name, rows in groups:
        if x == 0.0 and (1.0 - y) / step + 0.5 * len(rows) > half:
            x, y = 0.52, 1.0
        corner(ax, x, y, name, fontsize=9, fontweight="bold", color=COLOURS[0], va="top")
        y -= 1.15 * step
        for what, value in rows:
            corner(ax, x, y, what, fontsize=7.8, color=SOFT, va="top")
            corner(ax, x + 0.185, y, grouped(value), fontsize=7.8, va="top")
            y -= step
        y -= 0.45 * step
