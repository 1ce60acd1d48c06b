"""What the wakes of a farm cost: a table by turbine, and the row from above."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from meltemi.postprocess.fatigue import equivalent_loads
from meltemi.report.palette import INK, SOFT
from meltemi.report.plots import figure_title, heading, new_figure
from meltemi.report.tables import number
from meltemi_farm.simulation import FarmResult

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SHOWN = ("root_moment_out_of_plane_1", "tower_base_moment_fore_aft")
"""Loads of the table on a terminal."""
LOADS = {
    "root_moment_out_of_plane_1": "blade root",
    "root_moment_in_plane_1": "blade root in plane",
    "tower_base_moment_fore_aft": "tower base",
    "yaw_moment_z": "yaw bearing torsion",
}
"""Loads of the table by channel, and their names."""
CHANNELS = ("wind_x", "rotor_speed", "pitch_1", "generator_power", "rotor_aero_thrust", "nacelle_yaw", *LOADS)
"""Channels that the table needs, and usual ones."""


def cost_rows(
    result: FarmResult, alone: FarmResult | None = None, loads: Sequence[str] = tuple(LOADS)
) -> tuple[list[str], list[list[str]]]:
    """Header and rows of the table of a farm: mean wind and power, and damage-equivalent loads, by turbine.

    Args:
      result: with wakes.
      alone: the same without wakes; columns then say how much wakes change, in percent.
      loads: channels of :data:`LOADS`; those that were not recorded are left out.
    """
    loads = [name for name in loads if all(name in each for each in result.turbines)]
    head = ["turbine", "x m", "y m", "yaw deg", "wind m/s", "power kW"] + ["power %"] * (alone is not None)
    for name in loads:
        head += [f"{LOADS[name]} DEL kN m"] + [f"{LOADS[name]} %"] * (alone is not None)
    rows = []
    for i, each in enumerate(result.turbines):
        before = None if alone is None else alone.turbines[i].evaluated
        now = each.evaluated
        x, y = result.positions[i]
        cells = [f"T{i + 1}", number(x), number(y), number(float(np.degrees(result.yaw[i])))]
        cells += [number(float(now["wind_x"].mean())), number(float(now["generator_power"].mean()) * 1e-3)]
        if before is not None:
            cells.append(_change(float(now["generator_power"].mean()), float(before["generator_power"].mean())))
        found = equivalent_loads(now, loads)
        without = {} if before is None else equivalent_loads(before, loads)
        for name in loads:
            cells.append(number(found[name] * 1e-3))
            if before is not None:
                cells.append(_change(found[name], without[name]))
        rows.append(cells)
    if len(result) > 1:
        rows.append(_sum(result, alone, len(head)))
    return head, rows


def _sum(result: FarmResult, alone: FarmResult | None, columns: int) -> list[str]:
    """The last row: power of the farm."""
    power, before = (
        None if each is None else sum(float(r.evaluated["generator_power"].mean()) for r in each.turbines)
        for each in (result, alone)
    )
    assert power is not None
    cells = ["farm", "", "", "", "", number(power * 1e-3)]
    if before is not None:
        cells.append(_change(power, before))
    return cells + [""] * (columns - len(cells))


def _change(now: float, before: float) -> str:
    return number(100.0 * (now / before - 1.0)) if before > 0.0 else ""


def plot_farm(result: FarmResult, alone: FarmResult | None = None, title: str = "") -> Figure:
    """The wind over the farm at the end of the run, from above; power and a fatigue load by turbine.

    Args:
      result: with wakes.
      alone: the same without wakes.
    """
    figure, _ = new_figure(1, size=(12.0, 6.0))
    figure.clear()
    grid = figure.add_gridspec(2, 2, height_ratios=(1.5, 1.0))
    above = figure.add_subplot(grid[0, :])
    if result.view is not None:
        x, y, speed = result.view
        image = above.pcolormesh(x, y, speed.T, shading="gouraud", cmap="viridis", rasterized=True)
        figure.colorbar(image, ax=above, label="wind [m/s]", pad=0.01)
    for i, ((x0, y0), yaw, diameter) in enumerate(zip(result.positions, result.yaw, result.diameters, strict=True)):
        across = 0.5 * diameter * np.array([-np.sin(yaw), np.cos(yaw)])
        above.plot([x0 - across[0], x0 + across[0]], [y0 - across[1], y0 + across[1]], color="white", linewidth=3.0)
        above.annotate(f"T{i + 1}", (x0, y0 + 0.6 * diameter), color="white", ha="center", fontsize=9)
    for wake in result.wakes:
        if len(wake.planes):
            above.plot(*wake.planes[-1][:2], color="white", linewidth=0.8, linestyle="--")
    above.set_aspect("equal", adjustable="box")
    if result.view is not None:
        above.set_xlim(x[0], x[-1])
        above.set_ylim(y[0], y[-1])
    above.set_xlabel("x [m], downwind for direction 0")
    above.set_ylabel("y [m]")
    heading(above, f"Wind at {result.hubs[0]:.0f} m at the end, rotors, centres of the wakes")
    names = [f"T{i + 1}" for i in range(len(result))]
    _bars(figure.add_subplot(grid[1, 0]), names, *_both(result, alone, _power), "mean power [MW]")
    _bars(
        figure.add_subplot(grid[1, 1]), names, *_both(result, alone, _load), "DEL of the blade root out of plane [MN m]"
    )
    if title:
        figure_title(figure, title)
    return figure


def _both(result: FarmResult, alone: FarmResult | None, of: object) -> tuple[list[float], list[float]]:
    assert callable(of)
    return [of(r) for r in result.turbines], [] if alone is None else [of(r) for r in alone.turbines]


def _power(result: object) -> float:
    return float(result.evaluated["generator_power"].mean()) * 1e-6  # type: ignore[attr-defined]


def _load(result: object) -> float:
    name = next(iter(LOADS))
    known = name in result  # type: ignore[operator]
    return equivalent_loads(result, [name])[name] * 1e-6 if known else 0.0  # type: ignore[arg-type]


def _bars(ax: object, names: Sequence[str], now: list[float], before: list[float], title: str) -> None:
    """Bars by turbine, with wakes and without."""
    place = np.arange(len(names))
    width = 0.4 if before else 0.6
    ax.bar(place, now, width, color=INK, label="in the wakes")  # type: ignore[attr-defined]
    if before:
        ax.bar(place + width, before, width, color=SOFT, alpha=0.5, label="without wakes")  # type: ignore[attr-defined]
        ax.set_ylim(0.0, 1.25 * max(*now, *before))  # type: ignore[attr-defined]
        ax.legend(frameon=False, fontsize=8, ncols=2, loc="upper right")  # type: ignore[attr-defined]
    ax.set_xticks(place + (0.5 * width if before else 0.0), names)  # type: ignore[attr-defined]
    heading(ax, title)  # type: ignore[arg-type]
