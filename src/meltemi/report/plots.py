"""Plot functions. Each takes data and an optional ``ax``, adds labels, and returns the axes."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import InputError
from meltemi.core.files import replacing
from meltemi.report.palette import BLADES, COLOURS, FAINT, INK, SOFT, curve
from meltemi.report.tables import DISK_CURVE, is_disk
from meltemi.simulation.channels import Channel

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from meltemi.analyses.campbell import Campbell
    from meltemi.analyses.rotor_performance import RotorPerformance
    from meltemi.simulation.model import Model
    from meltemi.simulation.operating_point import OperatingPoint
    from meltemi.simulation.result import Result

MAIN_CHANNELS = (
    "wind_x",
    "rotor_speed",
    "pitch_1",
    "generator_power",
    "root_moment_out_of_plane_1",
    "tower_base_moment_fore_aft",
)
"""Main channels, shown by default with those at sea."""
AT_SEA = ("wave_elevation", "platform_surge", "platform_pitch", "mudline_reaction_moment_y", "line_1_fairlead_tension")
MOST_PANELS = 12
"""Channels of a result of which all are shown by default, those of three blades counted once."""


def new_figure(rows: int, columns: int = 1, *, size: tuple[float, float], share: bool = True) -> tuple[Figure, Any]:
    """A figure without display or global state, and its axes."""
    from meltemi.report.figure import ShownFigure

    figure = ShownFigure(figsize=size, layout="constrained")
    return figure, figure.subplots(rows, columns, squeeze=False, sharex=share)


def heading(ax: Axes, text: str, side: Literal["left", "right"] = "left", size: float = 9.0) -> None:
    """Set the title of axes, at their left or right end."""
    ax.set_title(text, fontsize=size, loc=side)


def panel(ax: Axes, title: str, unit: str, x: str = "") -> None:
    """Set title, unit and label of the abscissa of axes."""
    from meltemi.report.figure import StyledAxes, style

    heading(ax, title)
    ax.set_ylabel(f"[{unit}]")
    if x:
        ax.set_xlabel(x)
    if not isinstance(ax, StyledAxes):  # of a figure of the caller
        style(ax)


def note(ax: Axes, text: str, at: tuple[float, float], shift: tuple[float, float] = (0.0, 0.0), **look: Any) -> None:
    """Write a small text beside a point in data coordinates, shifted by points."""
    ax.annotate(text, at, xytext=shift, **{"textcoords": "offset points", "fontsize": 7, "color": SOFT, **look})


def corner(ax: Axes, x: float, y: float, text: str, **look: Any) -> None:
    """Write a text at a place within the axes, from (0, 0) at the lower left to (1, 1)."""
    ax.text(x, y, text, **{"transform": ax.transAxes, "fontsize": 8, "color": INK, **look})


LINE = 1.25
"""Distance of two names at the ends of curves, over the size of their letters."""


def name_curves(ax: Axes, size: float = 7.5) -> None:
    """Write the label of each curve at its right end, in its colour, names apart from each other: no legend needed."""
    ends: list[tuple[float, float, float, Any]] = []
    for line in ax.get_lines():
        x, y = (np.asarray(values, dtype=float) for values in line.get_data())
        shown = np.flatnonzero(np.isfinite(x) & np.isfinite(y))
        if str(line.get_label()).startswith("_") or not len(shown):
            continue
        at = ax.transLimits.transform(ax.transScale.transform((x[shown[-1]], y[shown[-1]])))
        if 0.0 <= at[1] <= 1.02:
            ends.append((float(at[1]), float(at[1]), float(at[0]), line))
    ends.sort(key=lambda end: end[0])
    height = ax.get_position().height * ax.figure.bbox.height / ax.figure.dpi  # [in]
    step = LINE * size / 72.0 / height
    placed = apart([end[0] for end in ends], step)
    for place, (_, height, right, line) in zip(placed, ends, strict=True):
        moved = abs(place - height) > 0.3 * step
        leader = {"arrowstyle": "-", "color": FAINT, "linewidth": 0.5, "relpos": (0.0, 0.5), "shrinkB": 2.0}
        look: dict[str, Any] = {"fontsize": size, "color": line.get_color(), "va": "center", "annotation_clip": False}
        ax.annotate(
            str(line.get_label()),
            (right, height),
            (1.03, place),
            xycoords="axes fraction",
            textcoords="axes fraction",
            arrowprops=leader if moved else None,
            **look,
        )


def apart(places: Sequence[float], step: float) -> list[float]:
    """Sorted places, moved as little as it takes to keep a distance of ``step`` between them."""
    groups: list[list[float]] = []  # of touching places: their number and the sum of the first places they ask for
    for place in places:
        groups.append([1.0, place])
        while len(groups) > 1 and groups[-2][1] / groups[-2][0] + groups[-2][0] * step > groups[-1][1] / groups[-1][0]:
            n, wanted = groups.pop()
            groups[-1][1] += wanted - n * groups[-1][0] * step
            groups[-1][0] += n
    return [wanted / n + i * step for n, wanted in groups for i in range(round(n))]


ON_TOP: dict[str, Any] = {"xycoords": ("data", "axes fraction")}
"""Coordinates of a :func:`note` whose ordinate is a fraction of the axes."""


def figure_title(figure: Figure, text: str, more: str = "", longest: int = 90) -> None:
    """Set the title of a figure: a text, shortened if there is not enough room for it, and what follows it."""
    room = longest - len(more)
    figure.suptitle((text if len(text) <= room else f"{text[: room - 3]}...") + more)


MANY = 1e4
"""Kilonewtons and the like from which on meganewtons are read more easily."""


def readable_unit(channel: Channel, *series: NDArray[np.float64]) -> tuple[str, float]:
    """Engineering unit that suits the magnitude of the values, and the factor to it."""
    unit, factor = channel.display_unit
    largest = max((float(np.max(np.abs(x[np.isfinite(x)]), initial=0.0)) for x in series), default=0.0)
    return (f"M{unit[1:]}", 1e-3 * factor) if unit[0] == "k" and largest * factor >= MANY else (unit, factor)


def plot_channel(
    result: Result,
    name: str,
    ax: Axes | None = None,
    label: str | None = None,
    colour: str | None = None,
    unit: tuple[str, float] | None = None,
) -> Axes:
    """Plot a channel over time, in engineering units, or in a given unit with its factor."""
    result.require_samples()
    if ax is None:
        ax = new_figure(1, size=(9.0, 2.6))[1][0, 0]
    channel = result.channel(name)
    text, factor = unit or readable_unit(channel, result[name])
    ax.plot(result.time, result[name] * factor, linewidth=0.9, label=label, color=colour or COLOURS[0])
    panel(ax, channel.name.replace("_", " "), text)
    ax.set_xmargin(0.0)  # a run begins at its axis
    return ax


MARK_COLOURS = {"event": COLOURS[1], "wind": COLOURS[0]}
"""Colours of log entries by their source; other sources are controllers."""
MOST_MARKS = 12
"""Log entries that are listed below a plot; of more, the first ones."""
NEAR = 0.02
"""Fraction of the time axis within which marks share one label."""


def mark_log(result: Result, axes: Sequence[Axes]) -> None:
    """Mark the log entries of a run with numbered lines, and list them below the axes."""
    from matplotlib.lines import Line2D

    inside = [entry for entry in result.log if result.time[0] <= entry.time <= result.time[-1]]
    if not inside:
        return
    near = NEAR * float(result.time[-1] - result.time[0])
    handles: list[Line2D] = []
    groups: list[tuple[float, list[int]]] = []
    for number, entry in enumerate(inside, 1):
        colour = MARK_COLOURS.get(entry.source, COLOURS[4])
        look: dict[str, Any] = {"color": colour, "linewidth": 0.8, "linestyle": (0, (4, 2))}
        for ax in axes:
            ax.axvline(entry.time, zorder=1.0, **look)
        if not groups or entry.time - groups[-1][0] > near:
            groups.append((entry.time, []))
        groups[-1][1].append(number)
        line = f"{number}: {entry.time:g} s, {'wind ' * (entry.source == 'wind')}{entry.what}"
        handles.append(Line2D([], [], label=line if len(line) <= 75 else line[:72] + "...", **look))
    for time, numbers in groups:
        text = str(numbers[0]) if len(numbers) == 1 else f"{numbers[0]} to {numbers[-1]}"
        note(axes[0], text, (time, 1.0), (0, 2), ha="center", va="bottom", color=INK, **ON_TOP)  # off the curves
    axes[0].set_title(axes[0].get_title(loc="left"), loc="left", pad=14.0)  # the numbers are below it
    if (more := len(handles) - MOST_MARKS + 1) > 1:
        handles = [*handles[: MOST_MARKS - 1], Line2D([], [], label=f"and {more} more", alpha=0.0)]
    columns = min(2, len(handles))
    axes[0].figure.legend(handles=handles, loc="outside lower left", ncols=columns)


ABOVE: dict[str, Any] = {"loc": "lower right", "bbox_to_anchor": (1.0, 0.97), "borderpad": 0.0}
"""Position of a legend next to the title of its axes."""


def _of_all_blades(result: Result, name: str) -> list[str]:
    """The channel of all blades that a result contains, if there are several."""
    names = [f"{name[:-1]}{b}" for b in range(1, 4) if name.endswith("_1") and f"{name[:-1]}{b}" in result]
    return names if len(names) > 1 else []


def _shown(result: Result) -> list[str]:
    """Channels that are plotted by default; those of further blades are in the panels of the first."""
    names = [name for name in result.names if name[-2:] not in ("_2", "_3") or f"{name[:-1]}1" not in result]
    if len(names) <= MOST_PANELS:
        return names
    return [name for name in (*MAIN_CHANNELS, *AT_SEA) if name in result] or names[:MOST_PANELS]


def plot(
    results: Result | Sequence[Result], channels: Sequence[str] | None = None, labels: Sequence[str] | None = None
) -> Figure:
    """Plot time series of one or several results; by default of all channels, or of the main ones of many.

    What a single result has in its log is marked and listed; by default all its blades are shown, in one line where
    they are alike.

    Raises:
      InputError: nothing to plot.
    """
    several = list(results) if isinstance(results, Sequence) else [results]
    if not several:
        raise InputError("plot: no results")
    names = list(channels or _shown(several[0]))
    if not names:
        raise InputError("plot: the result has no channels")
    figure, axes = new_figure(len(names), size=(9.0, 1.3 * len(names) + 0.8))
    for i, name in enumerate(names):
        texts = labels or [str(result.meta.get("turbine", j)) for j, result in enumerate(several)]
        series = [(result, name, text) for result, text in zip(several, texts, strict=True)]
        blades = [] if channels or len(several) > 1 else _of_all_blades(several[0], name)
        if blades and all(np.array_equal(several[0][each], several[0][name]) for each in blades):
            series, blades = [(several[0], name, f"blades 1 to {len(blades)}")], blades[:1]
        elif blades:
            series = [(several[0], each, f"blade {each[-1]}") for each in blades]
        unit = readable_unit(several[0].channel(name), *(result[each] for result, each, _ in series))
        for j, (result, each, text) in reversed(list(enumerate(series))):  # the first on top
            plot_channel(result, each, axes[i, 0], text, (BLADES if blades else COLOURS)[j % len(COLOURS)], unit)
        if blades:
            heading(axes[i, 0], name.removesuffix("_1").replace("_", " "))
            handles = axes[i, 0].get_lines()[::-1]
            axes[i, 0].legend(handles=handles, ncols=len(blades), **ABOVE)
    axes[-1, 0].set_xlabel("time [s]")
    if len(several) == 1:
        mark_log(several[0], axes[:, 0])
    if len(several) > 1:
        handles = axes[0, 0].get_lines()[::-1]
        axes[0, 0].legend(handles=handles, ncols=len(several), **ABOVE)
    figure_title(figure, several[0].title)
    return figure


STEADY_OPERATION: list[tuple[str, ...]] = [
    ("rotor_aero_thrust",),
    ("root_moment_out_of_plane_1",),
    ("tower_base_moment_fore_aft",),
    ("tip_out_of_plane_1", "tip_in_plane_1"),
    ("tower_top_fore_aft",),
]
"""Channels of the panels of steady operation that only a turbine with blades has."""


COARSE = 0.3
"""[m/s] spacing of points above which a curve does not show where rated operation begins."""


def plot_power_curve(points: Sequence[OperatingPoint], model: Model[Any] | None = None) -> Figure:
    """Plot steady operation over wind speed: power, speed, pitch, thrust, root moment, deflections.

    A dotted line marks the first of the points with the largest power.

    Args:
      points: operating points by wind speed.
      model: model whose radius and air give C_p and C_t of aerodynamic power and thrust; without it neither is shown.
    """
    disk = is_disk(points[0])  # a power coefficient in place of blades and tower
    panels = [(name,) for name in DISK_CURVE] if disk else STEADY_OPERATION
    panels = [("generator_power",), ("rotor_speed",), ("pitch_1",), *panels]
    blades = model is not None and not disk
    rows = len(panels) // 2 + blades
    figure, axes = new_figure(rows, 2, size=(9.0, 2.25 * rows))
    speeds = np.array([p.wind.speed for p in points])
    look: dict[str, Any] = {"marker": "o", "markersize": 3}
    for ax, names in zip(axes.flat, panels, strict=False):
        for i, name in enumerate(names):
            values = np.array([p[name] for p in points])
            text, factor = readable_unit(points[0].channels[name], values)
            ax.plot(speeds, values * factor, **look, color=COLOURS[i], label=name.replace("_", " "))
            panel(ax, name.replace("_", " "), text)
        if len(names) > 1:
            heading(ax, "tip deflection")
            for i, name in enumerate(names):  # beside the curve, where it has fallen and there is room above
                at = (3 * len(points)) // 5
                height = points[0].channels[name].display_unit[1] * points[at][name]
                note(ax, name.removesuffix("_1").replace("_", " "), (speeds[at], height), (4, 8), color=COLOURS[i])
    if model is not None and blades:
        pressure = 0.5 * model.environment.density * speeds**2 * np.pi * model.turbine.rotor_radius**2
        power = np.array([p["rotor_aero_torque"] * p["rotor_speed"] for p in points]) / (pressure * speeds)
        thrust = np.array([p["rotor_aero_thrust"] for p in points]) / pressure
        coefficients = (("power coefficient $C_p$", power), ("thrust coefficient $C_t$", thrust))
        for ax, (name, values) in zip(axes[-1], coefficients, strict=True):
            ax.plot(speeds, values, **look, color=COLOURS[0])
            panel(ax, name, "-")
            ax.set_ylim(bottom=0.0)
    power_output = np.array([p["generator_power"] for p in points])
    first = int(np.argmax(power_output > 0.995 * power_output.max()))
    rated, below = speeds[first], speeds[max(first - 1, 0)]
    for ax in axes.flat:
        ax.axvline(rated, color=FAINT, linewidth=0.9, linestyle=":", zorder=0.5)
    if rated < speeds[-1]:
        where = f"from {rated:.4g}" if rated - below < COARSE else f"between {below:.4g} and {rated:.4g}"
        note(axes[0, 0], f" rated {where} m/s", (rated, 0.02), **ON_TOP)
    for ax in axes[-1]:
        ax.set_xlabel("wind speed [m/s]")
    of = f"{model.turbine.name}: steady" if model is not None else "Steady"
    figure_title(figure, f"{of} operation in uniform wind, azimuthal averages")
    return figure


def plot_performance(performance: RotorPerformance) -> Figure:
    """Plot the available power, thrust and torque coefficients over tip-speed ratio, for up to ten pitch angles."""
    coefficients = (("C_p", performance.power), ("C_t", performance.thrust), ("C_q", performance.torque))
    known = [(name, values) for name, values in coefficients if not np.all(np.isnan(values))]
    figure, axes = new_figure(1, len(known), size=(11.0, 3.8))
    every = -(-len(performance.pitch) // len(COLOURS))
    for ax, (name, values) in zip(axes[0], known, strict=True):
        for colour, j in zip(COLOURS, range(0, len(performance.pitch), every), strict=False):
            label = f"{np.degrees(performance.pitch[j]):.4g} deg"
            ax.plot(performance.tip_speed_ratio, values[:, j], label=label, color=colour)
        ax.set_xlabel("tip-speed ratio [-]")
        ax.set_ylabel(f"${name}$ [-]")
        ax.set_ylim(bottom=0.0)
    axes[0, 0].legend(title="pitch")
    return figure


HIGHEST_DAMPING = 25.0
"""[%] upper end of the second panel of a Campbell diagram."""


def plot_campbell(diagram: Campbell, name: str = "") -> Figure:
    """Plot frequency and damping of the modes, and the per-rev frequencies that may excite them.

    The curves run over wind speed, or over rotor speed where there is no wind. ``name`` is that of the turbine.
    """
    windless = bool(np.any(np.isnan(diagram.wind_speed)))
    rpm = diagram.rotor_speed * 30.0 / np.pi
    x = rpm if windless else diagram.wind_speed
    figure, axes = new_figure(1, 2, size=(12.0, 7.5))
    frequency, damping = diagram.frequency / (2.0 * np.pi), 100.0 * diagram.damping
    top = 1.05 * float(np.nanmax(frequency, initial=0.1))
    for n in (1, 3, 6, 9):
        axes[0, 0].plot(x, n * rpm / 60.0, color=FAINT, linewidth=0.8, linestyle="--")
        if n * rpm[-1] / 60.0 < top:
            middle, box = len(x) // 2, {"facecolor": "white", "edgecolor": "none", "pad": 0.5}
            note(axes[0, 0], f"{n}P", (x[middle], n * rpm[middle] / 60.0), ha="center", va="center", bbox=box)
    for j, label in enumerate(diagram.labels):
        look = curve(j) | {"markersize": 4.5, "linewidth": 1.0}
        axes[0, 0].plot(x, frequency[j], label=label, **look)
        axes[0, 1].plot(x, damping[j], label=label, **look)
    axes[0, 0].set_ylim(0.0, top)
    high = float(np.nanmax(damping, initial=1.0))
    low = min(0.0, 1.05 * float(np.nanmin(damping, initial=0.0)))
    axes[0, 1].set_ylim(low, min(1.05 * high, HIGHEST_DAMPING))
    cut = f" (up to {HIGHEST_DAMPING:g} %; flap modes may lie above)" if 1.05 * high > HIGHEST_DAMPING else ""
    axes[0, 1].axhline(0.0, color=INK, linewidth=0.8)
    for ax, what, unit in ((axes[0, 0], "natural frequency", "Hz"), (axes[0, 1], f"damping ratio{cut}", "%")):
        panel(ax, what, unit, "rotor speed [rpm]" if windless else "wind speed [m/s]")
        name_curves(ax)
    of = f"{name}: " if name else ""
    figure_title(figure, f"{of}Campbell diagram, {'with air' if diagram.air else 'in vacuum'}")
    return figure


def save(figure: Figure, path: str | Path) -> Path:
    """Write a figure as PNG, or in the format of the suffix.

    Raises:
      InputError: the file cannot be written.
    """
    path = Path(path)
    try:
        with replacing(path) as (partial,):
            figure.savefig(partial, dpi=130, format=path.suffix[1:] or "png")
    except ValueError as error:  # a format that does not exist
        raise InputError(f"{path}: {error}") from None
    return path
