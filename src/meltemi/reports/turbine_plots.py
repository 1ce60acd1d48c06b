"""Figures of a turbine: ``plot_turbine`` puts all of it on one page, ``turbine_figures`` has one for each topic.

Their panels show blade, tower, polars, coefficients and steady operation. Every panel is a function of axes and an
overview; one whose numbers could not be computed gives the reason.
"""

from __future__ import annotations

import math
import textwrap
from collections.abc import Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from meltemi.report.palette import COLOURS, GRID, INK, SOFT
from meltemi.report.plots import corner, note
from meltemi.reports.turbine_overview import (
    TurbineOverview,
    beam_mass,
    line_mass,
    principal_stiffness,
    turbine_overview,
)
from meltemi.reports.turbine_sketch import facts, planform_of, sketch
from meltemi.structure.beam import Modes
from meltemi.structure.members import blade_beam
from meltemi.turbine.definition import Tower, Turbine

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Float = NDArray[np.float64]
Panel = Callable[["Axes", TurbineOverview], None]

RPM, DEGREES = 30.0 / math.pi, 180.0 / math.pi
FLAP, EDGE, TORSION = COLOURS[0], COLOURS[1], COLOURS[2]
MOST_NAMES = 10
"""Largest number of labelled airfoils; of more, some are labelled."""
BENDING = {"1st flap": ((0, FLAP),), "1st edge": ((1, EDGE),)}
"""Component and colour of the modes whose twist is shown."""
LEAST_COUPLING = 1e-4
"""[deg/m] smallest elastic twist of bending modes that is shown."""
NEAR = (-20.0, 30.0)
"""[deg] angles of attack of the insets."""


def _title(ax: Axes, text: str) -> None:
    ax.set_title(text, pad=4, fontweight="bold")


def _label(ax: Axes, title: str, x: str, y: str, **look: Any) -> None:
    """Set title, axis labels and style of a panel, and the legend if curves have labels."""
    _title(ax, title)
    ax.set_xlabel(x, labelpad=1.5)
    ax.set_ylabel(y, labelpad=2)
    ax.tick_params(labelsize=7.5)
    if ax.get_legend_handles_labels()[0]:
        ax.legend(**{"fontsize": 7, "frameon": False, "borderpad": 0.1, "handlelength": 1.6, **look})


def _missing(ax: Axes, title: str, reason: str) -> None:
    """An empty panel with the reason for the missing data."""
    _title(ax, title)
    ax.set_xticks([])
    ax.set_yticks([])
    for spine in ax.spines.values():
        spine.set_color(GRID)
    corner(ax, 0.5, 0.5, textwrap.fill(reason, 46), ha="center", va="center", color=COLOURS[1])


def _curves(ax: Axes, *curves: tuple[str, Float, Float | None, str, Any, float]) -> None:
    """Plot curves, each with label, x, y, colour, line style and width; those without values are left out."""
    for label, x, y, colour, line, width in curves:
        if y is not None:
            ax.plot(x, y, color=colour, linewidth=width, linestyle=line, label=label)


def _zero(ax: Axes) -> None:
    ax.axhline(0.0, color=INK, linewidth=0.6)


# blade ------------------------------------------------------------------------------------------


SPAN = "from the blade root [m]"


def _polar_colours(overview: TurbineOverview) -> tuple[list[str], list[str], Any, int]:
    """Airfoils from root to tip, their short names and colours; every how many are named."""
    from matplotlib import colormaps

    names = list(dict.fromkeys(overview.turbine.blade.aerodynamics.airfoil))
    colours = colormaps["viridis_r"](np.linspace(0.08, 0.95, len(names)))
    return names, _short(names), colours, -(-len(names) // MOST_NAMES)


def _short(names: Sequence[str]) -> list[str]:
    """Names without a long common prefix."""
    same = 0
    while len({name[: same + 1] for name in names}) == 1 < len(names) and all(len(name) > same for name in names):
        same += 1
    return [name[same:] or name for name in names] if same > 5 else list(names)


def planform(ax: Axes, overview: TurbineOverview) -> None:
    """Leading and trailing edge relative to the pitch axis, and the polars along the span."""
    a = overview.turbine.blade.aerodynamics
    names, short, colours, every = _polar_colours(overview)
    _, y, ahead = planform_of(overview.turbine)
    leading, trailing = y - ahead * a.chord, y + (1.0 - ahead) * a.chord
    edges = np.concatenate([a.position[:1], 0.5 * (a.position[1:] + a.position[:-1]), a.position[-1:]])
    fine = np.unique(np.concatenate([edges, a.position]))
    low, high = np.interp(fine, a.position, -leading), np.interp(fine, a.position, -trailing)
    begin = 0
    turned = 30 if len(names) > 6 else 0
    for i in range(1, len(a.airfoil) + 1):
        if i < len(a.airfoil) and a.airfoil[i] == a.airfoil[begin]:
            continue
        k = names.index(a.airfoil[begin])
        part = (fine >= edges[begin]) & (fine <= edges[i])
        ax.fill_between(fine[part], low[part], high[part], color=colours[k], alpha=0.55, linewidth=0.0)
        if k % every == 0:
            look: dict[str, Any] = {"ha": "center", "va": "bottom", "rotation": turned}
            ax.text(0.5 * (edges[begin] + edges[i]), 1.06 * low.max(), short[k], fontsize=7, color=INK, **look)
        begin = i
    ax.plot(a.position, -leading, color=INK, linewidth=1.1)
    ax.plot(a.position, -trailing, color=INK, linewidth=1.1)
    ax.plot(a.position, -y, color=COLOURS[1], linewidth=1.0, linestyle="--", label="aerodynamic centre")
    ax.axhline(0.0, color=INK, linewidth=0.7, linestyle=":", label="pitch axis")
    i = int(np.argmax(a.chord))
    note(ax, f"largest chord {a.chord[i]:.3g} m", (a.position[i], float(-trailing[i])), (12, -2), va="top")
    ax.set_ylim(-1.25 * float(trailing.max()), (2.4 if len(names) > 6 else 1.45) * float(-leading.min()))
    ax.set_xlim(-0.01 * a.position[-1], 1.01 * a.position[-1])
    _label(ax, "planform: chord, pitch axis and polars", SPAN, "towards the nose [m]", loc="lower right", ncols=2)


def twist(ax: Axes, overview: TurbineOverview) -> None:
    """Aerodynamic and structural twist."""
    a, s = overview.turbine.blade.aerodynamics, overview.turbine.blade.structure
    _curves(
        ax,
        ("chord", a.position, np.degrees(a.twist), FLAP, "-", 1.5),
        ("structural axes", s.position, np.degrees(s.twist), EDGE, "--", 1.1),
    )
    _zero(ax)
    _label(ax, "twist, positive towards feather", SPAN, "[deg]")


def stiffness(ax: Axes, overview: TurbineOverview) -> None:
    """Principal stiffness in bending and torsion."""
    s = overview.turbine.blade.structure
    flap, edge, torsion = principal_stiffness(s)
    _curves(
        ax,
        ("flap", s.position, flap, FLAP, "-", 1.4),
        ("edge", s.position, edge, EDGE, "-", 1.4),
        ("torsion", s.position, torsion, TORSION, "-", 1.4),
    )
    ax.set_yscale("log")
    kind = "of the 6 x 6 matrices, principal" if s.stiffness_matrix is not None else "EI, GJ"
    _label(ax, f"blade stiffness, {kind}", SPAN, "[N m²]")


def mass(ax: Axes, overview: TurbineOverview) -> None:
    """Mass per length."""
    from meltemi.report.figure import grouped

    beam = blade_beam(overview.turbine.blade.structure)
    total, centre = beam_mass(beam)
    ax.fill_between(beam.position, line_mass(beam), color=FLAP, alpha=0.18, linewidth=0.0)
    ax.plot(beam.position, line_mass(beam), color=FLAP, linewidth=1.4)
    ax.axvline(centre, color=INK, linewidth=0.9, linestyle="--")
    ax.set_ylim(0.0, 1.12 * float(np.quantile(line_mass(beam), 0.97)))
    text = f"{grouped(f'{total:.0f}')} kg\ncentre at {centre:.4g} m"
    corner(ax, 0.97, 0.93, text, ha="right", va="top")
    _label(ax, "blade mass", SPAN, "[kg/m]")


def offsets(ax: Axes, overview: TurbineOverview) -> None:
    """Positions of beam axis, aerodynamic centre and centre of mass."""
    a, s = overview.turbine.blade.aerodynamics, overview.turbine.blade.structure
    rows = (
        ("prebend, beam axis x", s.position, s.axis_x, COLOURS[0], "-", 1.3),
        ("sweep, beam axis y", s.position, s.axis_y, COLOURS[1], "-", 1.3),
        ("aerodynamic centre x", a.position, a.centre_x, COLOURS[0], "--", 1.3),
        ("aerodynamic centre y", a.position, a.centre_y, COLOURS[1], "--", 1.3),
        ("centre of mass x*", s.position, s.mass_centre_x, COLOURS[0], ":", 1.3),
        ("centre of mass y*", s.position, s.mass_centre_y, COLOURS[1], ":", 1.3),
    )
    shown = [row for row in rows if row[2] is not None and np.any(row[2])]
    _curves(ax, *shown)
    _zero(ax)
    star = ", * in section's axes" if any("*" in row[0] for row in shown) else ""
    _label(ax, f"offsets: x downwind, y to the trailing edge{star}", SPAN, "[m]")


def _frequency(name: str, modes: Modes, k: int) -> str:
    return f"{name} {modes.frequency[k] / (2.0 * np.pi):.3g} Hz"


def bending(ax: Axes, overview: TurbineOverview) -> None:
    """Flapwise and edgewise modes of the clamped blade."""
    title = "blade modes, clamped and at rest: bending"
    if overview.blade is None:
        return _missing(ax, title, overview.problems["blade"])
    modes = overview.blade.modes
    for k, name in enumerate(overview.blade.names):
        if "torsion" not in name:
            component, colour = (0, FLAP) if "flap" in name else (1, EDGE)
            line = "-" if name.startswith("1st") else "--"
            _curves(ax, (_frequency(name, modes, k), modes.z, _unit(modes.shape[k, :, component]), colour, line, 1.4))
    _zero(ax)
    return _label(ax, title, SPAN, "displacement, tip 1 [-]")


def torsion(ax: Axes, overview: TurbineOverview) -> None:
    """Torsion of the blade modes."""
    title = "blade modes: elastic twist"
    if overview.blade is None:
        return _missing(ax, title, overview.problems["blade"])
    modes, names = overview.blade.modes, overview.blade.names
    twisting = [k for k, name in enumerate(names) if "torsion" in name]
    if not twisting:
        return _missing(ax, title, "the blade has no stiffness in torsion: it does not twist")
    for k in twisting:
        _curves(ax, (_frequency(names[k], modes, k), modes.z, _unit(modes.shape[k, :, 5]), TORSION, "-", 1.4))
    _zero(ax)
    for k, component, colour in ((k, *part) for k, name in enumerate(names) for part in BENDING.get(name, ())):
        # twist over the displacement of the tip
        twist = np.degrees(modes.shape[k, :, 5] / modes.shape[k, -1, component])
        largest = float(np.abs(twist).max())
        if largest > LEAST_COUPLING:
            label = f"{names[k]}, largest {largest:.2g}° per m of tip"
            _curves(ax, (label, modes.z, twist / largest, colour, "--", 1.4))
    if len(ax.get_lines()) == len(twisting) + 1:
        corner(ax, 0.03, 0.8, "no twist in the bending modes", fontsize=7, color=SOFT)
    return _label(ax, title, SPAN, "twist, tip or largest 1 [-]", loc="upper left")


def _unit(values: Float) -> Float:
    """Mode shape scaled to 1 at its end, or to its largest value if the end is small."""
    end, largest = values[-1], values[np.argmax(np.abs(values))]
    return values / (end if abs(end) > 0.3 * abs(largest) else largest)


# tower ------------------------------------------------------------------------------------------

HEIGHT = "above the tower base [m]"


def tower_size(ax: Axes, overview: TurbineOverview) -> None:
    """Diameter and mass per length."""
    t = overview.turbine.tower
    _along_tower(
        ax, t, ("diameter [m]", t.diameter, INK, "-", 1.5), ("mass [t/m]", 1e-3 * t.mass, COLOURS[0], "--", 1.4)
    )
    _label(ax, "tower: diameter, mass", "[m], [t/m]", HEIGHT, loc="lower left")


def tower_stiffness(ax: Axes, overview: TurbineOverview) -> None:
    """Stiffness in bending and torsion."""
    t = overview.turbine.tower
    _along_tower(
        ax,
        t,
        ("fore-aft", 1e-9 * t.fore_aft_stiffness, FLAP, "-", 1.5),
        ("side-side", 1e-9 * t.side_side_stiffness, EDGE, "--", 1.3),
        ("torsion", None if t.torsion_stiffness is None else 1e-9 * t.torsion_stiffness, TORSION, "-", 1.3),
    )
    _label(ax, "tower stiffness", "[GN m²]", HEIGHT, loc="lower left")


def _along_tower(ax: Axes, tower: Tower, *curves: tuple[str, Float | None, str, str, float]) -> None:
    for label, x, colour, line, width in curves:
        if x is not None:
            _curves(ax, (label, x, tower.position, colour, line, width))
    ax.set_xlim(left=0.0)
    ax.set_ylim(0.0, tower.length)


def tower_modes(ax: Axes, overview: TurbineOverview) -> None:
    """Fore-aft and side-to-side modes with the tower-top mass."""
    title = "tower modes, with the mass on its top"
    if overview.model is None:
        return _missing(ax, title, overview.problems["model"])
    member = overview.model.rotor.tower
    for k, name in enumerate(member.names):
        if "torsion" not in name and not name.startswith("base"):  # a floating base moves, and does not bend
            # both directions nearly coincide: the second is drawn thin on the first
            component, colour, width = (0, FLAP, 2.8) if "fore" in name else (1, EDGE, 1.1)
            line = "-" if name.startswith("1st") else "--"
            values = member.modes.shape[k, :, component]
            values = values / values[np.argmax(np.abs(values))]
            _curves(ax, (_frequency(name, member.modes, k), values, member.modes.z, colour, line, width))
    ax.axvline(0.0, color=INK, linewidth=0.6)
    ax.set_ylim(0.0, overview.turbine.tower.length)
    ax.set_xlim(right=2.2)  # room for the legend
    return _label(ax, title, "displacement, largest 1 [-]", HEIGHT, loc="center right")


# polars -----------------------------------------------------------------------------------------


ROOM = {"lift": 1.0, "drag": 1.0, "moment": 0.6}
"""Space for insets and legends above the curves, over their range."""


def _polars(ax: Axes, overview: TurbineOverview, field: str, symbol: str, title: str) -> None:
    names, short, colours, every = _polar_colours(overview)
    inset = ax.inset_axes((0.34, 0.63, 0.32, 0.36) if field == "drag" else (0.64, 0.63, 0.33, 0.36))
    low, high = math.inf, -math.inf
    for k, name in enumerate(names):
        foil = overview.turbine.airfoils[name]
        alpha, values = np.degrees(foil.angle_of_attack), getattr(foil, field)
        named = field == "lift" and (k % every == 0 or k == len(names) - 1)
        label = short[k] if named else None
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
    _label(ax, title, "angle of attack [deg]", f"${symbol}$ [-]", loc="upper left", ncols=2, fontsize=6.5)


lift = partial(_polars, field="lift", symbol="C_l", title="lift, colours from root to tip")
drag = partial(_polars, field="drag", symbol="C_d", title="drag")
moment = partial(_polars, field="moment", symbol="C_m", title="moment, nose up")
"""Coefficients over the full circle and near zero."""

# rotor and operation ----------------------------------------------------------------------------


def _contour(ax: Axes, overview: TurbineOverview, name: str, symbol: str, levels: Float, title: str) -> None:
    from matplotlib import colormaps

    if overview.performance is None or overview.best is None:
        return _missing(ax, f"{name} coefficient", overview.problems["performance"])
    table, values = overview.performance, getattr(overview.performance, name)
    x, y = table.tip_speed_ratio, np.degrees(table.pitch)
    colours = colormaps["YlGnBu"].with_extremes(under="white")
    ax.contourf(x, y, values.T, levels=levels, cmap=colours, extend="both")
    lines = ax.contour(x, y, values.T, levels=levels[::2], colors=INK, linewidths=0.4)
    for label in ax.clabel(lines, fontsize=6.5, fmt="%g"):
        at = ((label.get_position()[0] - x[0]) / (x[-1] - x[0]), (label.get_position()[1] - y[0]) / (y[-1] - y[0]))
        label.set_visible(min(at) > 0.04 and max(at) < 0.96)  # the edges would cut it
    if overview.curve:
        R = overview.turbine.rotor_radius
        ratios = [p.rotor_speed * R / p.wind.speed for p in overview.curve]
        angles = [math.degrees(p.pitch) for p in overview.curve]
        ax.plot(ratios, angles, color=COLOURS[1], linewidth=1.3, marker="o", markersize=2.4, label="steady operation")
    _, ratio, angle = overview.best
    highest = values[np.flatnonzero(x == ratio)[0], np.flatnonzero(table.pitch == angle)[0]]
    degrees = math.degrees(angle)
    ax.plot(ratio, degrees, marker="*", color="white", markeredgecolor=INK, markersize=11, linestyle="none")
    box = {"facecolor": "white", "edgecolor": "none", "pad": 0.8, "alpha": 0.85}
    text = f"{symbol} {highest:.3f}\n$\\lambda$ {ratio:g}, {degrees:.3g}°"
    note(ax, text, (ratio, degrees), (9, 8), color=INK, va="bottom", bbox=box, zorder=6)  # above, where there is room
    ax.set_xlim(x[0], x[-1])
    ax.set_ylim(y[0], y[-1])
    look = {"loc": "upper right", "frameon": True, "framealpha": 0.8, "edgecolor": "none"}
    return _label(ax, title, "tip-speed ratio [-]", "pitch [deg]", **look)


power_coefficient = partial(
    _contour,
    name="power",
    symbol="$C_p$",
    levels=np.arange(0.0, 0.56, 0.04),
    title="power coefficient $C_p$, rigid rotor",
)
thrust_coefficient = partial(
    _contour,
    name="thrust",
    symbol="$C_t$",
    levels=np.arange(0.0, 1.31, 0.1),
    title="thrust coefficient $C_t$; star: highest $C_p$",
)
"""Draw coefficients over tip-speed ratio and pitch, with the steady operating curve."""


def _operation(
    ax: Axes, overview: TurbineOverview, name: str, title: str, unit: str, factor: float, colour: str
) -> None:
    if overview.curve is None:
        return _missing(ax, title, overview.problems["curve"])
    wind, values = [p.wind.speed for p in overview.curve], [factor * p[name] for p in overview.curve]
    ax.plot(wind, values, color=colour, linewidth=1.4, marker="o", markersize=2.2)
    if overview.rated is not None:
        ax.axvline(overview.rated.wind.speed, color=INK, linewidth=0.7, linestyle=":")
    ax.set_xlim(0.0, math.ceil(wind[-1]) + 0.5)
    ax.set_ylim(bottom=min(0.0, 1.05 * min(values)), top=1.1 * max(max(values), 1e-3))
    i = int(np.argmax(values))
    if name == "rotor_aero_thrust":
        ax.text(wind[i] + 0.6, values[i], f"{values[i]:.4g} {unit}", fontsize=7, color=SOFT, va="center")
    return _label(ax, title, "wind [m/s]", f"[{unit}]")


power = partial(_operation, name="generator_power", title="electrical power", unit="MW", factor=1e-6, colour=COLOURS[0])
thrust = partial(_operation, name="rotor_aero_thrust", title="thrust", unit="kN", factor=1e-3, colour=COLOURS[1])
speed = partial(_operation, name="rotor_speed", title="rotor speed", unit="rpm", factor=RPM, colour=COLOURS[2])
pitch = partial(_operation, name="pitch_1", title="pitch", unit="deg", factor=DEGREES, colour=COLOURS[4])
"""Steady operation over wind speed."""

# figures ----------------------------------------------------------------------------------------

HALVED: dict[Panel, Panel] = {power: speed, thrust: pitch}
"""Panels that share their place on the page with another, below."""


def plot_turbine(turbine: Turbine | TurbineOverview) -> Figure:
    """Summary figure of a turbine: scale drawing, main data, blade, tower, polars, coefficients, operation.

    Args:
      turbine: the turbine, or its overview if there is one already.
    """
    overview = turbine if isinstance(turbine, TurbineOverview) else turbine_overview(turbine)
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


def turbine_figures(overview: TurbineOverview) -> dict[str, Figure]:
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
