"""State diagrams of supervisor and power control, from the tables used by the kernels."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from meltemi.control_laws.machine import Transition
from meltemi.core.errors import InputError, did_you_mean
from meltemi.power_control import tables as power
from meltemi.report.palette import FACES, FAINT, SOFT
from meltemi.report.plots import new_figure
from meltemi.supervisor.tables import GROUPS, STATES, TRANSITIONS, YAW_STATES, YAW_TRANSITIONS

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_PLACES = {
    "idling": (0.0, 0.0),
    "standby": (4.6, 0.0),
    "start_up": (4.6, -2.4),
    "connection": (4.6, -3.7),
    "maximum_power": (4.6, -5.0),
    "speed_limit": (4.6, -6.3),
    "power_limit": (4.6, -7.6),
    "normal_stop": (0.0, -4.4),
    "emergency_stop": (0.0, -7.0),
}
_YAW_PLACES = {"normal": (0.0, 0.0), "derated": (5.0, 0.0), "shutdown": (2.5, -2.8)}
_POWER_PLACES = {
    "maximum_power": (0.0, -2.0),
    "power_tracking": (4.0, 0.0),
    "speed_limit": (9.0, 0.0),
    "hold": (11.5, -4.0),
    "recovery": (4.0, -4.0),
}
_BENDS = {("emergency_stop", "idling"): -0.5}
"""Curvature of arrows that pass another state."""
SMALL = 8.0
"""[pt] font size of the conditions, legible at page width."""
MACHINES: dict[str, tuple[Any, Any, Any, tuple[float, float]]] = {
    "operation": (_PLACES, STATES, TRANSITIONS, (8.2, 8.8)),
    "yaw": (_YAW_PLACES, YAW_STATES, YAW_TRANSITIONS, (8.0, 4.6)),
    "power": (_POWER_PLACES, power.STATES, power.TRANSITIONS, (8.6, 5.0)),
}
"""Places of the states in the diagram, states, transitions and size of the figure [in]."""


def plot_states(machine: str = "operation") -> Figure:
    """Plot a state machine: states as boxes, transitions as arrows with their conditions.

    Args:
      machine: ``operation`` of the supervisor; ``yaw``: its protection against yaw errors, with derating;
        ``power``: of the power control.

    Raises:
      InputError: another machine.
    """
    if machine not in MACHINES:
        raise InputError(f"plot_states: machine {machine!r}: {did_you_mean(machine, MACHINES)}")
    places, states, transitions, size = MACHINES[machine]
    return _draw(places, [state.name for state in states], _merged(transitions), size)


def _merged(transitions: tuple[Transition, ...]) -> dict[tuple[str, str], list[str]]:
    """Labels of all transitions from a state, or from the group of running states, to another."""
    labels: dict[tuple[str, str], list[str]] = {}
    for t in transitions:
        running = {*GROUPS["running"]} <= {*t.sources}
        others = [name for name in t.sources if name not in GROUPS["running"]]
        conditions = " and ".join(name.replace("_", " ") for name in t.conditions)
        for source in ["running", *others] if running else t.sources:
            labels.setdefault((source, t.target), []).append(conditions)
    return labels


def _draw(
    places: dict[str, tuple[float, float]],
    names: list[str],
    arrows: dict[tuple[str, str], list[str]],
    size: tuple[float, float],
) -> Figure:
    figure, grid = new_figure(1, size=size)
    axes = grid[0, 0]
    xs, ys = [x for x, _ in places.values()], [y for _, y in places.values()]
    axes.set_xlim(min(xs) - 1.6, max(xs) + 1.5)
    axes.set_ylim(min(ys) - 0.6, max(ys) + 0.9)
    axes.set_axis_off()
    face, edge = FACES["plant"]
    style: dict[str, Any] = {"boxstyle": "round,pad=0.5", "facecolor": face, "edgecolor": edge}
    boxes = {}
    for number, name in enumerate(names, 1):
        words = f"{number}  {name.replace('_', ' ')}"
        text = axes.text(*places[name], words, ha="center", va="center", fontsize=9, bbox=style, zorder=3)
        boxes[name] = text.get_bbox_patch()
    if any(source == "running" for source, _ in arrows):
        _frame(axes, *places["start_up"], *places["power_limit"])  # from top to bottom
    for (source, target), lines in arrows.items():
        words = " or\n".join(line.replace(" and ", "\nand ") for line in lines)
        x1, y1 = places[target]
        if source == "running":  # from the frame across to the state
            bend = 0.0
            x0, y0 = places["start_up"][0] - 1.25, y1
            _arrow(axes, (x0, y0), (x1, y1), None, boxes[target], bend)
        else:
            x0, y0 = places[source]
            bend = -0.18 if (target, source) in arrows else _BENDS.get((source, target), 0.0)
            _arrow(axes, (x0, y0), (x1, y1), boxes[source], boxes[target], bend)
        if x0 == x1:  # beside it: what goes down to the right, what goes up to the left
            away = (0.2 if bend else 0.1) - 0.5 * bend * abs(y1 - y0)
            up = y1 > y0
            x = x0 - away if up and bend else x0 + away
            at, side = (x, 0.5 * (y0 + y1)), "right" if up and bend else "left"
            axes.text(*at, words, fontsize=SMALL, ha=side, va="center")
        elif y0 == y1 and source != "running":
            away = 0.12 - 0.5 * bend * abs(x1 - x0)
            low = x1 < x0
            y = y0 - away if low else y0 + away
            axes.text(0.5 * (x0 + x1), y, words, fontsize=SMALL, ha="center", va="top" if low else "bottom")
        else:
            shift = 0.0 if (target, source) not in arrows else -0.09
            share = 0.4 if source == "start_up" else 0.45 if source == "running" else 0.5
            x = x0 + share * (x1 - x0) + shift * (y1 - y0)
            y = y0 + share * (y1 - y0) - shift * (x1 - x0)
            blank = {"facecolor": "white", "edgecolor": "none", "pad": 1.5}
            axes.text(x, y, words, fontsize=SMALL, ha="center", va="center", bbox=blank)
    return figure


def _frame(axes: Any, x0: float, y0: float, x1: float, y1: float) -> None:
    """Draw the frame around the column of running states."""
    from matplotlib.patches import FancyBboxPatch

    style = "round,pad=0.02,rounding_size=0.15"
    corner, width, height = (x1 - 1.25, y1 - 0.5), x0 - x1 + 2.5, y0 - y1 + 1.15
    axes.add_patch(FancyBboxPatch(corner, width, height, boxstyle=style, facecolor="none", edgecolor=FAINT, ls="--"))
    axes.text(x0 + 1.0, y0 + 0.4, "running", fontsize=SMALL, color=SOFT, ha="right")


def _arrow(
    axes: Any, begin: tuple[float, float], end: tuple[float, float], first: Any, second: Any, bend: float
) -> None:
    """Draw an arrow between boxes, curved to separate opposite arrows."""
    shape = {"arrowstyle": "-|>", "color": SOFT, "connectionstyle": f"arc3,rad={bend}"}
    axes.annotate("", xy=end, xytext=begin, arrowprops={**shape, "patchA": first, "patchB": second})
