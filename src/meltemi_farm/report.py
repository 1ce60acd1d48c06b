"""What the wakes of a farm cost: a table by turbine, and the row from above."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from meltemi.postprocess.fatigue import equivalent_loads
from meltemi.report.palette import INK, SOFT
from meltemi.report.plots import figure_title, heading, new_figure
from meltemi.report.tables import number
from meltemi_farm.simulation import FarmResult

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from meltemi.simulation.result import Result

FORE_AFT, SIDE_SIDE = "tower_base_moment_fore_aft", "tower_base_moment_side_side"
SHOWN = ("root_moment_out_of_plane_1", FORE_AFT)
"""Loads of the table on a terminal."""
LOADS = {
    "root_moment_out_of_plane_1": "blade root",
    "root_moment_in_plane_1": "blade root in plane",
    FORE_AFT: "tower base",
    "yaw_moment_z": "yaw bearing torsion",
}
"""Loads of the table by channel, and their names."""
LABEL = {"facecolor": "white", "edgecolor": "none", "pad": 1.0, "alpha": 0.7}
CHANNELS = (
    *("wind_x", "wind_y", "rotor_speed", "pitch_1", "generator_power", "rotor_aero_thrust", "nacelle_yaw"),
    *(*LOADS, SIDE_SIDE),
)
"""Channels that the table needs, and usual ones."""


def cost_rows(
    result: FarmResult, alone: FarmResult | None = None, loads: Sequence[str] = tuple(LOADS)
) -> tuple[list[str], list[list[str]]]:
    """Header and rows of the table of a farm: mean wind and power, and damage-equivalent loads, by turbine.

    Args:
      result: with wakes.
      alone: the same without wakes; columns then say how much wakes change, in percent.
      loads: channels of :data:`LOADS`; those that were not recorded are left out. The tower base is bent along the
        mean wind.
    """
    needed = {FORE_AFT: (FORE_AFT, SIDE_SIDE)} if result.direction else {}
    loads = [name for name in loads if all(x in each for each in result.turbines for x in needed.get(name, (name,)))]
    head = ["turbine", "x m", "y m", "yaw deg", "wind m/s", "power kW"] + ["power %"] * (alone is not None)
    for name in loads:
        head += [f"{LOADS[name]} DEL kN m"] + [f"{LOADS[name]} %"] * (alone is not None)
    rows, powers = [], []
    for i, each in enumerate(result.turbines):
        turbines = [each] if alone is None else [each, alone.turbines[i]]
        both = [along_wind(turbine.evaluated, result.direction) for turbine in turbines]
        cells = [f"T{i + 1}", *map(number, result.positions[i]), number(float(np.degrees(result.yaw[i])))]
        powers.append([float(turbine["generator_power"].mean()) for turbine in both])
        cells += [number(float(both[0]["wind_x"].mean())), *_compared(powers[-1])]
        found = [equivalent_loads(turbine, loads) for turbine in both]
        rows.append(cells + [cell for name in loads for cell in _compared([dels[name] for dels in found])])
    if len(result) > 1:
        cells = ["farm", "", "", "", "", *_compared([sum(column) for column in zip(*powers, strict=True)])]
        rows.append(cells + [""] * (len(head) - len(cells)))
    return head, rows


def along_wind(result: Result, direction: float) -> Result:
    """A result whose ``wind_x`` and fore-aft moment of the tower base are along a wind of a direction [rad] (K-25).

    They are NaN without the component across x.
    """
    if not direction:
        return result
    data, c, s = result.data.copy(), np.cos(direction), np.sin(direction)
    for name, other, sign in (("wind_x", "wind_y", -1.0), (FORE_AFT, SIDE_SIDE, 1.0)):
        if name in result.names:
            across = result[other] if other in result.names else np.nan
            data[:, result.names.index(name)] = c * result[name] + sign * s * across
    return replace(result, data=data)


def _compared(values: Sequence[float]) -> list[str]:
    """A value in thousands, and its change in percent from the second one, if there is one."""
    now, *before = values
    return [number(now * 1e-3), *(number(100.0 * (now / x - 1.0)) if x > 0.0 else "" for x in before)]


def plot_farm(result: FarmResult, alone: FarmResult | None = None, title: str = "") -> Figure:
    """The wind over the farm at the end of the run, from above; power and a fatigue load by turbine.

    Args:
      result: with wakes.
      alone: the same without wakes.
    """
    figure = new_figure(1, size=(12.0, 6.0))[0]
    figure.clear()
    grid = figure.add_gridspec(2, 2, height_ratios=(1.5, 1.0))
    above = figure.add_subplot(grid[0, :])
    if result.view is not None:
        x, y, speed = result.view
        image = above.pcolormesh(x, y, speed.T, shading="gouraud", cmap="viridis", rasterized=True)
        bar = above.inset_axes((1.01, 0.0, 0.01, 1.0), axes_class=type(above))  # as high as they are
        figure.colorbar(image, cax=bar, label="wind [m/s]")
        above.set(xlim=(x[0], x[-1]), ylim=(y[0], y[-1]))
    places = zip(result.positions, result.yaw - result.direction, result.diameters, strict=True)
    for i, ((x0, y0), angle, diameter) in enumerate(places):
        across = 0.5 * diameter * np.array([-np.sin(angle), np.cos(angle)])
        above.plot([x0 - across[0], x0 + across[0]], [y0 - across[1], y0 + across[1]], color="white", linewidth=3.0)
        above.annotate(f"T{i + 1}", (x0, y0 + 0.6 * diameter), ha="center", fontsize=9, bbox=LABEL)
    for wake in result.wakes:
        if len(wake.planes):
            above.plot(*wake.planes[-1][:2], color="white", linewidth=0.8, linestyle="--")
    above.set_aspect("equal", adjustable="box")
    above.set(xlabel="x [m], downwind for direction 0", ylabel="y [m]")
    heading(above, f"Wind at {result.hubs[0]:.0f} m at the end, rotors, centres of the wakes")
    both = [result.turbines, () if alone is None else alone.turbines]
    for k, (of, what) in enumerate(((_power, "mean power [MW]"), (_load, "DEL of the blade root out of plane [MN m]"))):
        now, before = ([of(each) for each in turbines] for turbines in both)
        _bars(figure.add_subplot(grid[1, k]), now, before, what)
    if title:
        figure_title(figure, title, longest=120)
    return figure


def _power(result: Result) -> float:
    return float(result.evaluated["generator_power"].mean()) * 1e-6


def _load(result: Result) -> float:
    return equivalent_loads(result, SHOWN[:1])[SHOWN[0]] * 1e-6 if SHOWN[0] in result else 0.0


def _bars(ax: Axes, now: list[float], before: list[float], title: str) -> None:
    """Bars by turbine, with wakes and without."""
    place, width = np.arange(len(now)), 0.4 if before else 0.6
    ax.bar(place, now, width, color=INK, label="in the wakes")
    if before:
        ax.bar(place + width, before, width, color=SOFT, alpha=0.5, label="without wakes")
        ax.set_ylim(0.0, 1.25 * max(*now, *before))
        ax.legend(frameon=False, fontsize=8, ncols=2, loc="upper right")
    ax.set_xticks(place + (0.5 * width if before else 0.0), [f"T{i + 1}" for i in range(len(now))])
    heading(ax, title)
