"""Figures of a turbine: scale drawing, blade, tower, polars, coefficients, steady operation.

``plot_turbine`` puts all of it on one page. Every panel is a function of axes and a portrait; one whose numbers could
not be had says why.
"""

from __future__ import annotations

import math
import textwrap
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from meltemi.report.palette import COLOURS, FAINT, GRID, INK, SHADE, SOFT
from meltemi.report.plots import style
from meltemi.report.turbine_facts import turbine_facts
from meltemi.simulation.portrait import Portrait, line_mass, portrait, principal_stiffness
from meltemi.structure.members import blade_beam
from meltemi.turbine.definition import Airfoil, Turbine

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Float = NDArray[np.float64]
Panel = Callable[["Axes", Portrait], None]

FLAP, EDGE, TORSION = COLOURS[0], COLOURS[1], COLOURS[2]
MOST_NAMES = 10
"""Airfoils that are named; of more, some are."""
LEAST_COUPLING = 1e-4
"""[deg/m] of elastic twist in bending modes that is shown."""
NEAR = (-20.0, 30.0)
"""[deg] angles of attack of the insets."""


def plot_turbine(turbine: Turbine | Portrait) -> Figure:
    """Summary figure of a turbine: scale drawing, main data, blade, tower, polars, coefficients, operation.

    Args:
      turbine: it, or its portrait if there is one already.
    """
    seen = turbine if isinstance(turbine, Portrait) else portrait(turbine)
    figure = _figure((18.0, 13.6), layout=None)
    rows: tuple[tuple[float, tuple[tuple[float, Panel], ...]], ...] = (
        (1.85, ((1.6, sketch), (1.85, facts), (0.85, power), (0.85, thrust))),
        (1.0, ((2.1, planform), (1.0, power_coefficient), (1.0, thrust_coefficient))),
        (1.0, ((1.0, twist), (1.0, stiffness), (1.0, mass), (1.0, offsets))),
        (
            1.0,
            ((1.0, blade_bending), (1.0, blade_torsion), (0.5, tower_size), (0.5, tower_stiffness), (0.7, tower_modes)),
        ),
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
                panel(figure.add_axes((x, box[1] + half + down, box[2], half)), seen)
                HALVED[panel](figure.add_axes((*box[:3], half)), seen)
            else:
                panel(figure.add_axes(box), seen)
            x += w * width + across
        top -= share * height + down
    t = seen.turbine
    figure.text(0.012, 0.988, t.description or t.name, fontsize=18, fontweight="bold", color=INK, va="top")
    figure.text(0.992, 0.984, textwrap.shorten(t.source, 110), fontsize=8, color=SOFT, va="top", ha="right")
    return figure


def turbine_figures(seen: Portrait) -> dict[str, Figure]:
    """Separate figures of blade, tower, polars, rotor and operation."""
    groups: dict[str, tuple[tuple[float, float], Sequence[Sequence[Panel]]]] = {
        "blade": ((11.0, 12.0), ((planform,), (twist, offsets), (stiffness, mass), (blade_bending, blade_torsion))),
        "tower": ((11.0, 4.6), ((tower_size, tower_stiffness, tower_modes),)),
        "polars": ((11.0, 11.0), ((lift,), (drag,), (moment,))),
        "rotor": ((11.0, 4.6), ((power_coefficient, thrust_coefficient),)),
        "operation": ((11.0, 6.4), ((power, thrust), (speed, pitch))),
    }
    found = {}
    for name, (size, rows) in groups.items():
        figure = found[name] = _figure(size)
        grid = figure.add_gridspec(len(rows), math.lcm(*map(len, rows)))
        for i, row in enumerate(rows):
            width = grid.ncols // len(row)
            for j, panel in enumerate(row):
                panel(figure.add_subplot(grid[i, j * width : (j + 1) * width]), seen)
    return found


def _figure(size: tuple[float, float], layout: Literal["constrained"] | None = "constrained") -> Figure:
    from meltemi.report.figure import ShownFigure

    return ShownFigure(figsize=size, layout=layout)


def _label(ax: Axes, what: str, x: str, y: str) -> None:
    """Set the title and axis labels of a panel."""
    ax.set_title(what, fontsize=9, loc="left", color=INK, pad=4, fontweight="bold")
    ax.set_xlabel(x, fontsize=8, labelpad=1.5)
    ax.set_ylabel(y, fontsize=8, labelpad=2)
    ax.tick_params(labelsize=7.5)
    style(ax)


def _legend(ax: Axes, **look: Any) -> None:
    if ax.get_legend_handles_labels()[0]:
        ax.legend(**{"fontsize": 7, "frameon": False, "borderpad": 0.1, "handlelength": 1.6, **look})


def _missing(ax: Axes, what: str, reason: str) -> None:
    """An empty panel with the reason for the missing data."""
    ax.set_title(what, fontsize=9, loc="left", color=INK, pad=4, fontweight="bold")
    ax.set_xticks([])
    ax.set_yticks([])
    for spine in ax.spines.values():
        spine.set_color(GRID)
    ax.text(
        0.5,
        0.5,
        textwrap.fill(reason, 46),
        transform=ax.transAxes,
        ha="center",
        va="center",
        fontsize=8,
        color=COLOURS[1],
    )


# the whole machine ------------------------------------------------------------------------------


def sketch(ax: Axes, seen: Portrait) -> None:
    """Scale drawing of the turbine, front and side view: undeflected rotor at zero pitch."""
    from matplotlib.patches import Polygon, Rectangle

    t = seen.turbine
    n, R, hub = t.nacelle, t.rotor_radius, t.hub_height
    side = 1.75 * R + n.overhang
    for centre in (0.0, side):
        r = 0.5 * t.tower.diameter
        z = t.tower.base_height + t.tower.position
        outline = np.concatenate([np.stack([centre - r, z], 1), np.stack([centre + r, z], 1)[::-1]])
        ax.add_patch(Polygon(outline, facecolor=SHADE, edgecolor=INK, linewidth=0.7))
    angles = 2.0 * np.pi * np.arange(t.n_blades) / t.n_blades
    circle = np.linspace(0.0, 2.0 * np.pi, 181)
    ax.plot(R * np.sin(circle), hub + R * np.cos(circle), color=FAINT, linewidth=0.6, linestyle=(0, (4, 3)))
    size = 0.5 * float(t.tower.diameter[-1])
    top = t.tower.base_height + t.tower.length
    behind = side + 2.0 * max(size, n.mass_centre[0])
    ax.add_patch(
        Rectangle(
            (side - 0.6 * n.overhang, top),
            behind - side + 0.6 * n.overhang,
            max(2.0 * n.shaft_height, 1.2 * size),
            facecolor="white",
            edgecolor=INK,
            linewidth=0.7,
        )
    )
    s = t.blade.structure
    for psi in angles:
        for leading, trailing in (_edges(t),):
            outline = np.concatenate([leading, trailing[::-1]])  # x downwind, y to the trailing edge, z to the tip
            front = np.stack(
                [
                    outline[:, 2] * np.sin(psi) - outline[:, 1] * np.cos(psi),
                    hub + outline[:, 2] * np.cos(psi) + outline[:, 1] * np.sin(psi),
                ],
                1,
            )
            ax.add_patch(Polygon(front, facecolor="white", edgecolor=INK, linewidth=0.8, joinstyle="round"))
            ax.add_patch(
                Polygon(_from_the_side(t, outline, psi, side), facecolor="white", edgecolor=INK, linewidth=0.8)
            )
    ax.plot(0.0, hub, marker="o", color=INK, markersize=3)
    ax.plot(side - n.overhang * math.cos(n.tilt), hub, marker="o", color=INK, markersize=3)
    ax.axhline(0.0, color=INK, linewidth=1.2)
    _arrow(ax, (-1.16 * R, 0.0), (-1.16 * R, hub), f"hub {hub:.4g} m")
    _arrow(ax, (-R, hub + 1.1 * R), (R, hub + 1.1 * R), f"rotor {2 * R:.4g} m", beside=False)
    lines = [f"tilt {math.degrees(n.tilt):.3g}°, cone {math.degrees(t.hub.precone):.3g}°"]
    lines.append(f"overhang {n.overhang:.4g} m")
    if s.axis_x is not None and np.any(s.axis_x):
        lines.append(f"prebend {abs(s.axis_x[-1]):.3g} m {'upwind' if s.axis_x[-1] < 0 else 'downwind'}")
    ax.text(side + 0.14 * R, hub - 0.55 * R, "\n".join(lines), fontsize=7.5, color=SOFT, va="top", linespacing=1.4)
    ax.annotate(
        "",
        (side - 0.3 * R, hub + 0.62 * R),
        (side - 0.62 * R, hub + 0.62 * R),
        arrowprops={"arrowstyle": "-|>", "color": COLOURS[0], "linewidth": 1.4},
    )
    ax.text(side - 0.46 * R, hub + 0.65 * R, "wind", fontsize=7.5, color=COLOURS[0], ha="center", va="bottom")
    ax.set_xlim(-1.3 * R, side + 0.95 * R)
    ax.set_ylim(-0.04 * R, hub + 1.18 * R)
    ax.set_aspect("equal", anchor="W")
    ax.set_axis_off()
    ax.set_title("looking downwind, and from the side: to scale", fontsize=9, loc="left", color=INK, fontweight="bold")


def _edges(turbine: Turbine) -> tuple[Float, Float]:
    """(S, 3) leading and trailing edge in blade axes at zero pitch, z from the rotor's axis.

    Aerodynamic centres lie at a quarter of the chord from the leading edge, of round roots in the middle.
    """
    a = turbine.blade.aerodynamics
    x, y, ahead = _planform(turbine)
    edges = []
    for along in (-ahead, 1.0 - ahead):  # of the chord, towards the trailing edge
        edges.append(
            np.stack(
                [
                    x + along * a.chord * np.sin(a.twist),  # the nose turns into the wind
                    y + along * a.chord * np.cos(a.twist),
                    turbine.hub.radius + a.position,
                ],
                1,
            )
        )
    return edges[0], edges[1]


def _planform(turbine: Turbine) -> tuple[Float, Float, Float]:
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


def _short(names: Sequence[str]) -> list[str]:
    """Names without a long common prefix."""
    same = 0
    while len({name[: same + 1] for name in names}) == 1 < len(names) and all(len(name) > same for name in names):
        same += 1
    return [name[same:] or name for name in names] if same > 5 else list(names)


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


def facts(ax: Axes, seen: Portrait) -> None:
    """Main data in two columns."""
    ax.set_axis_off()
    groups = turbine_facts(seen)
    half = sum(len(rows) + 1.6 for _, rows in groups) / 2.0
    step, y, x = 1.0 / (half + 2.5), 1.0, 0.0
    for name, rows in groups:
        if x == 0.0 and (1.0 - y) / step + 0.5 * len(rows) > half:
            x, y = 0.52, 1.0
        ax.text(x, y, name, fontsize=9, fontweight="bold", color=COLOURS[0], va="top", transform=ax.transAxes)
        y -= 1.15 * step
        for what, value in rows:
            ax.text(x, y, what, fontsize=7.8, color=SOFT, va="top", transform=ax.transAxes)
            ax.text(x + 0.185, y, value, fontsize=7.8, color=INK, va="top", transform=ax.transAxes)
            y -= step
        y -= 0.45 * step


# blade ------------------------------------------------------------------------------------------


def _span(seen: Portrait) -> tuple[Float, Float]:
    """[m] from the root of the stations of aerodynamics and structure."""
    return seen.turbine.blade.aerodynamics.position, seen.turbine.blade.structure.position


SPAN = "from the blade root [m]"


def planform(ax: Axes, seen: Portrait) -> None:
    """Leading and trailing edge relative to the pitch axis, and the polars along the span."""
    from matplotlib import colormaps

    a = seen.turbine.blade.aerodynamics
    _, y, ahead = _planform(seen.turbine)
    leading, trailing = y - ahead * a.chord, y + (1.0 - ahead) * a.chord
    names = list(dict.fromkeys(a.airfoil))
    colours = colormaps["viridis_r"](np.linspace(0.08, 0.95, len(names)))
    short = _short(names)
    edges = np.concatenate([a.position[:1], 0.5 * (a.position[1:] + a.position[:-1]), a.position[-1:]])
    fine = np.unique(np.concatenate([edges, a.position]))
    low, high = np.interp(fine, a.position, -leading), np.interp(fine, a.position, -trailing)
    begin = 0
    every = -(-len(names) // MOST_NAMES)
    for i in range(1, len(a.airfoil) + 1):
        if i < len(a.airfoil) and a.airfoil[i] == a.airfoil[begin]:
            continue
        k = names.index(a.airfoil[begin])
        part = (fine >= edges[begin]) & (fine <= edges[i])
        ax.fill_between(fine[part], low[part], high[part], color=colours[k], alpha=0.55, linewidth=0.0)
        if k % every == 0:
            ax.text(
                0.5 * (edges[begin] + edges[i]),
                1.06 * low.max(),
                short[k],
                fontsize=7,
                color=INK,
                ha="center",
                va="bottom",
                rotation=30 if len(names) > 6 else 0,
            )
        begin = i
    ax.plot(a.position, -leading, color=INK, linewidth=1.1)
    ax.plot(a.position, -trailing, color=INK, linewidth=1.1)
    ax.plot(a.position, -y, color=COLOURS[1], linewidth=1.0, linestyle="--", label="aerodynamic centre")
    ax.axhline(0.0, color=INK, linewidth=0.7, linestyle=":", label="pitch axis")
    i = int(np.argmax(a.chord))
    ax.annotate(
        f"largest chord {a.chord[i]:.3g} m",
        (a.position[i], float(-trailing[i])),
        xytext=(12, -2),
        textcoords="offset points",
        fontsize=7,
        color=SOFT,
        va="top",
    )
    ax.set_ylim(-1.25 * float(trailing.max()), (2.4 if len(names) > 6 else 1.45) * float(-leading.min()))
    ax.set_xlim(-0.01 * a.position[-1], 1.01 * a.position[-1])
    _label(ax, "planform: chord, pitch axis and polars", SPAN, "towards the nose [m]")
    _legend(ax, loc="lower right", ncols=2)


def twist(ax: Axes, seen: Portrait) -> None:
    """Aerodynamic and structural twist."""
    aero, beam = _span(seen)
    ax.plot(aero, np.degrees(seen.turbine.blade.aerodynamics.twist), color=FLAP, linewidth=1.5, label="chord")
    structural = np.degrees(seen.turbine.blade.structure.twist)
    ax.plot(beam, structural, color=EDGE, linewidth=1.1, linestyle="--", label="structural axes")
    ax.axhline(0.0, color=INK, linewidth=0.6)
    _label(ax, "twist, positive towards feather", SPAN, "[deg]")
    _legend(ax)


def stiffness(ax: Axes, seen: Portrait) -> None:
    """Principal stiffness in bending and torsion."""
    _, position = _span(seen)
    s = seen.turbine.blade.structure
    flap, edge, torsion = principal_stiffness(s)
    ax.semilogy(position, flap, color=FLAP, linewidth=1.4, label="flap")
    ax.semilogy(position, edge, color=EDGE, linewidth=1.4, label="edge")
    if torsion is not None:
        ax.semilogy(position, torsion, color=TORSION, linewidth=1.4, label="torsion")
    kind = "of the 6 x 6 matrices, principal" if s.stiffness_matrix is not None else "EI, GJ"
    _label(ax, f"blade stiffness, {kind}", SPAN, "[N m²]")
    _legend(ax)


def mass(ax: Axes, seen: Portrait) -> None:
    """Mass per length."""
    from meltemi.simulation.portrait import beam_mass

    beam = blade_beam(seen.turbine.blade.structure)
    total, centre = beam_mass(beam)
    ax.fill_between(beam.position, line_mass(beam), color=FLAP, alpha=0.18, linewidth=0.0)
    ax.plot(beam.position, line_mass(beam), color=FLAP, linewidth=1.4)
    ax.axvline(centre, color=INK, linewidth=0.9, linestyle="--")
    ax.set_ylim(0.0, 1.12 * float(np.quantile(line_mass(beam), 0.97)))
    ax.text(
        0.97,
        0.93,
        f"{total:,.0f} kg\ncentre at {centre:.4g} m".replace(",", " "),
        transform=ax.transAxes,
        fontsize=8,
        color=INK,
        ha="right",
        va="top",
    )
    _label(ax, "blade mass", SPAN, "[kg/m]")


def offsets(ax: Axes, seen: Portrait) -> None:
    """Positions of beam axis, aerodynamic centre and centre of mass."""
    a, s = seen.turbine.blade.aerodynamics, seen.turbine.blade.structure
    rows = (
        ("prebend, beam axis x", s.position, s.axis_x, COLOURS[0], "-"),
        ("sweep, beam axis y", s.position, s.axis_y, COLOURS[1], "-"),
        ("aerodynamic centre x", a.position, a.centre_x, COLOURS[0], "--"),
        ("aerodynamic centre y", a.position, a.centre_y, COLOURS[1], "--"),
        ("centre of mass x*", s.position, s.mass_centre_x, COLOURS[0], ":"),
        ("centre of mass y*", s.position, s.mass_centre_y, COLOURS[1], ":"),
    )
    shown = [row for row in rows if row[2] is not None and np.any(row[2])]
    for label, position, values, colour, line in shown:
        assert values is not None
        ax.plot(position, values, color=colour, linewidth=1.3, linestyle=line, label=label)
    ax.axhline(0.0, color=INK, linewidth=0.6)
    star = ", * in section's axes" if any("*" in row[0] for row in shown) else ""
    _label(ax, f"offsets: x downwind, y to the trailing edge{star}", SPAN, "[m]")
    _legend(ax)


def _shape_lines(
    ax: Axes, position: Float, values: Float, label: str, colour: str, line: str, *, upright: bool = False
) -> None:
    pair = (values, position) if upright else (position, values)
    ax.plot(*pair, color=colour, linewidth=1.4, linestyle=line, label=label)


def blade_bending(ax: Axes, seen: Portrait) -> None:
    """Flapwise and edgewise modes of the clamped blade."""
    title = "blade modes, clamped and at rest: bending"
    if seen.blade is None:
        return _missing(ax, title, seen.problems["blade"])
    modes = seen.blade.modes
    for k, name in enumerate(seen.blade.names):
        if "torsion" in name:
            continue
        component, colour = (0, FLAP) if "flap" in name else (1, EDGE)
        label = f"{name} {modes.frequency[k] / (2.0 * np.pi):.3g} Hz"
        line = "-" if name.startswith("1st") else "--"
        _shape_lines(ax, modes.z, _unit(modes.shape[k, :, component]), label, colour, line)
    ax.axhline(0.0, color=INK, linewidth=0.6)
    _label(ax, title, SPAN, "displacement, tip 1 [-]")
    return _legend(ax)


def blade_torsion(ax: Axes, seen: Portrait) -> None:
    """Torsion of the blade modes."""
    title = "blade modes: elastic twist"
    if seen.blade is None:
        return _missing(ax, title, seen.problems["blade"])
    modes = seen.blade.modes
    torsion = [k for k, name in enumerate(seen.blade.names) if "torsion" in name]
    if not torsion:
        return _missing(ax, title, "the blade has no stiffness in torsion: it does not twist")
    for k in torsion:
        label = f"{seen.blade.names[k]} {modes.frequency[k] / (2.0 * np.pi):.3g} Hz"
        _shape_lines(ax, modes.z, _unit(modes.shape[k, :, 5]), label, TORSION, "-")
    ax.axhline(0.0, color=INK, linewidth=0.6)
    _label(ax, title, SPAN, "torsion mode, tip 1 [-]")
    coupled = [
        (name, np.degrees(modes.shape[k, :, 5] / modes.shape[k, -1, 0 if "flap" in name else 1]))
        for k, name in enumerate(seen.blade.names)
        if name in ("1st flap", "1st edge")
    ]
    if max(float(np.abs(values).max()) for _, values in coupled) > LEAST_COUPLING:
        twin = ax.twinx()
        for name, values in coupled:
            _shape_lines(twin, modes.z, values, f"{name}, right [deg/m]", FLAP if "flap" in name else EDGE, "--")
        twin.tick_params(labelsize=7, direction="in", pad=-26)  # inside, for want of room
        twin.spines["top"].set_visible(False)
        lines = [*ax.get_legend_handles_labels()[0], *twin.get_legend_handles_labels()[0]]
        ax.legend(handles=lines, fontsize=7, frameon=False, loc="center left")
    else:
        _legend(ax)
        ax.text(0.03, 0.8, "bending does not twist it", transform=ax.transAxes, fontsize=7, color=SOFT)
    return None


def _unit(values: Float) -> Float:
    """Mode shape scaled to 1 at its end, or to its largest value if the end is small."""
    end, largest = values[-1], values[np.argmax(np.abs(values))]
    return values / (end if abs(end) > 0.3 * abs(largest) else largest)


# tower ------------------------------------------------------------------------------------------

HEIGHT = "above the tower base [m]"


def tower_size(ax: Axes, seen: Portrait) -> None:
    """Diameter and mass per length."""
    t = seen.turbine.tower
    ax.plot(t.diameter, t.position, color=INK, linewidth=1.5, label="diameter [m]")
    ax.plot(1e-3 * t.mass, t.position, color=COLOURS[0], linewidth=1.4, linestyle="--", label="mass [t/m]")
    ax.set_xlim(left=0.0)
    ax.set_ylim(0.0, t.length)
    _label(ax, "tower: diameter, mass", "[m], [t/m]", HEIGHT)
    _legend(ax, loc="lower left")


def tower_stiffness(ax: Axes, seen: Portrait) -> None:
    """Stiffness in bending and torsion."""
    t = seen.turbine.tower
    ax.plot(1e-9 * t.fore_aft_stiffness, t.position, color=FLAP, linewidth=1.5, label="fore-aft")
    ax.plot(1e-9 * t.side_side_stiffness, t.position, color=EDGE, linewidth=1.3, linestyle="--", label="side-side")
    if t.torsion_stiffness is not None:
        ax.plot(1e-9 * t.torsion_stiffness, t.position, color=TORSION, linewidth=1.3, label="torsion")
    ax.set_xlim(left=0.0)
    ax.set_ylim(0.0, t.length)
    _label(ax, "tower stiffness", "[GN m²]", HEIGHT)
    _legend(ax, loc="lower left")


def tower_modes(ax: Axes, seen: Portrait) -> None:
    """Fore-aft and side-to-side modes with the tower-top mass."""
    title = "tower modes, with the mass on its top"
    if seen.model is None:
        return _missing(ax, title, seen.problems["model"])
    member = seen.model.rotor.tower
    for k, name in enumerate(member.names):
        component, colour = (0, FLAP) if "fore" in name else (1, EDGE)
        if "torsion" in name:
            continue
        line = "-" if "fore" in name else (0, (4, 3))
        label = f"{name} {member.modes.frequency[k] / (2.0 * np.pi):.3g} Hz"
        values = member.modes.shape[k, :, component]
        values = values / values[np.argmax(np.abs(values))]
        _shape_lines(ax, member.modes.z, values, label, colour, line, upright=True)  # type: ignore[arg-type]
    ax.axvline(0.0, color=INK, linewidth=0.6)
    ax.set_ylim(0.0, seen.turbine.tower.length)
    _label(ax, title, "displacement, largest 1 [-]", HEIGHT)
    ax.set_xlim(right=2.2)  # room for the legend
    return _legend(ax, loc="center right")


# polars -----------------------------------------------------------------------------------------


ROOM = {"lift": 0.5, "drag": 0.6, "moment": 0.1}
"""For insets and legends above the curves, over their range."""


def _polars(ax: Axes, seen: Portrait, field: str, symbol: str, title: str) -> None:
    from matplotlib import colormaps

    t = seen.turbine
    names = list(dict.fromkeys(t.blade.aerodynamics.airfoil))
    colours = colormaps["viridis_r"](np.linspace(0.08, 0.95, len(names)))
    every, short = -(-len(names) // MOST_NAMES), _short(names)
    inset = ax.inset_axes((0.34, 0.6, 0.32, 0.39) if field == "drag" else (0.64, 0.56, 0.33, 0.43))
    low, high = math.inf, -math.inf
    for k, name in enumerate(names):
        foil = t.airfoils[name]
        alpha, values = np.degrees(foil.angle_of_attack), getattr(foil, field)
        label = short[k] if k % every == 0 or k == len(names) - 1 else None
        for each in (ax, inset):
            each.plot(alpha, values, color=colours[k], linewidth=1.0, label=label)
        inside = np.interp(np.linspace(*NEAR, 101), alpha, values)
        if foil.dynamic_stall:
            low, high = min(low, float(inside.min())), max(high, float(inside.max()))
    inset.set_xlim(*NEAR)
    if high > low:
        inset.set_ylim(low - 0.06 * (high - low), high + 0.06 * (high - low))
    inset.tick_params(labelsize=6.5, pad=1.5)
    inset.axvline(0.0, color=INK, linewidth=0.5)
    inset.grid(True, color=GRID, linewidth=0.5)
    inset.set_facecolor("white")
    bottom, top = ax.get_ylim()
    ax.set_ylim(bottom, top + ROOM[field] * (top - bottom))
    ax.set_xlim(-180.0, 180.0)
    ax.set_xticks(range(-180, 181, 45))
    _label(ax, title, "angle of attack [deg]", f"${symbol}$ [-]")
    if field == "lift":
        _legend(ax, loc="upper left", ncols=2, fontsize=6.5)


def lift(ax: Axes, seen: Portrait) -> None:
    """Lift coefficients, over the full circle and near zero."""
    _polars(ax, seen, "lift", "C_l", "lift, colours from root to tip")


def drag(ax: Axes, seen: Portrait) -> None:
    """Drag coefficients."""
    _polars(ax, seen, "drag", "C_d", "drag")


def moment(ax: Axes, seen: Portrait) -> None:
    """Moment coefficients."""
    _polars(ax, seen, "moment", "C_m", "moment, nose up")


# rotor and operation ----------------------------------------------------------------------------


def _contour(ax: Axes, seen: Portrait, values: Float, symbol: str, levels: Float, title: str) -> None:
    from matplotlib import colormaps

    assert seen.performance is not None
    table = seen.performance
    x, y = table.tip_speed_ratio, np.degrees(table.pitch)
    colours = colormaps["YlGnBu"].with_extremes(under="white")
    ax.contourf(x, y, values.T, levels=levels, cmap=colours, extend="both")
    lines = ax.contour(x, y, values.T, levels=levels[::2], colors=INK, linewidths=0.4)
    ax.clabel(lines, fontsize=6.5, fmt="%g")
    if seen.curve:
        R = seen.turbine.rotor_radius
        ratio = [p.rotor_speed * R / p.wind.speed for p in seen.curve]
        angle = [math.degrees(p.pitch) for p in seen.curve]
        ax.plot(ratio, angle, color=COLOURS[1], linewidth=1.3, marker="o", markersize=2.4, label="steady operation")
    assert seen.best is not None
    _, at, pitch = seen.best
    there = values[np.flatnonzero(x == at)[0], np.flatnonzero(table.pitch == pitch)[0]]
    ax.plot(at, math.degrees(pitch), marker="*", color="white", markeredgecolor=INK, markersize=11, linestyle="none")
    ax.annotate(
        f"{symbol} {there:.3f}\n$\\lambda$ {at:g}, {math.degrees(pitch):.3g}°",
        (at, math.degrees(pitch)),
        xytext=(7, -9),
        textcoords="offset points",
        fontsize=7,
        color=INK,
        va="top",
        bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.8, "alpha": 0.7},
    )
    ax.set_xlim(x[0], x[-1])
    ax.set_ylim(y[0], y[-1])
    _label(ax, title, "tip-speed ratio [-]", "pitch [deg]")
    _legend(ax, loc="upper right", frameon=True, framealpha=0.8, edgecolor="none")


def power_coefficient(ax: Axes, seen: Portrait) -> None:
    """Power coefficient over tip-speed ratio and pitch, with the steady operating curve."""
    if seen.performance is None:
        return _missing(ax, "power coefficient", seen.problems["performance"])
    levels = np.arange(0.0, 0.56, 0.04)
    return _contour(ax, seen, seen.performance.power, "$C_p$", levels, "power coefficient $C_p$, rigid rotor")


def thrust_coefficient(ax: Axes, seen: Portrait) -> None:
    """Thrust coefficient over tip-speed ratio and pitch, with the steady operating curve."""
    if seen.performance is None:
        return _missing(ax, "thrust coefficient", seen.problems["performance"])
    levels = np.arange(0.0, 1.31, 0.1)
    return _contour(ax, seen, seen.performance.thrust, "$C_t$", levels, "thrust coefficient $C_t$; star: highest $C_p$")


def _against_wind(ax: Axes, seen: Portrait, name: str, title: str, unit: str, factor: float, colour: str) -> None:
    if seen.curve is None:
        return _missing(ax, title, seen.problems["curve"])
    wind, values = [p.wind.speed for p in seen.curve], [factor * p[name] for p in seen.curve]
    ax.plot(wind, values, color=colour, linewidth=1.4, marker="o", markersize=2.2)
    if seen.rated is not None:
        ax.axvline(seen.rated.wind.speed, color=INK, linewidth=0.7, linestyle=":")
    ax.set_xlim(0.0, math.ceil(wind[-1]) + 0.5)
    ax.set_ylim(bottom=min(0.0, 1.05 * min(values)), top=1.1 * max(max(values), 1e-3))
    i = int(np.argmax(values))
    if name == "rotor_aero_thrust":
        ax.text(wind[i] + 0.6, values[i], f"{values[i]:.4g} {unit}", fontsize=7, color=SOFT, va="center")
    return _label(ax, title, "wind [m/s]", f"[{unit}]")


def power(ax: Axes, seen: Portrait) -> None:
    """Electrical power over wind speed."""
    _against_wind(ax, seen, "generator_power", "electrical power", "MW", 1e-6, COLOURS[0])


def thrust(ax: Axes, seen: Portrait) -> None:
    """Aerodynamic thrust over wind speed."""
    _against_wind(ax, seen, "rotor_aero_thrust", "thrust", "kN", 1e-3, COLOURS[1])


def speed(ax: Axes, seen: Portrait) -> None:
    """Rotor speed over wind speed."""
    _against_wind(ax, seen, "rotor_speed", "rotor speed", "rpm", 30.0 / math.pi, COLOURS[2])


def pitch(ax: Axes, seen: Portrait) -> None:
    """Pitch over wind speed."""
    _against_wind(ax, seen, "pitch_1", "pitch", "deg", 180.0 / math.pi, COLOURS[4])


HALVED: dict[Panel, Panel] = {power: speed, thrust: pitch}
"""Panels that share their place on the page with another, below."""
