"""Effects of wakes in a farm, and comparison of two runs of a farm: tables by turbine, and figures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import InputError
from meltemi.farm.simulation import FarmResult
from meltemi.postprocess.fatigue import equivalent_loads
from meltemi.report.palette import COLOURS, INK, SOFT
from meltemi.report.plots import figure_title, heading, new_figure, panel
from meltemi.report.tables import number

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from meltemi.simulation.result import Result

Float = NDArray[np.float64]
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
      result: results with wakes.
      alone: results without wakes; columns then show the changes due to wakes in percent.
      loads: channels of :data:`LOADS`; those that were not recorded are left out. The fore-aft moment of the tower
        base is along the mean wind.
    """
    loads = _recorded(result, loads)
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
        equivalent = [equivalent_loads(turbine, loads) for turbine in both]
        rows.append(cells + [cell for name in loads for cell in _compared([dels[name] for dels in equivalent])])
    if len(result) > 1:
        cells = ["farm", "", "", "", "", *_compared([sum(column) for column in zip(*powers, strict=True)])]
        rows.append(cells + [""] * (len(head) - len(cells)))
    return head, rows


def _recorded(result: FarmResult, loads: Sequence[str]) -> list[str]:
    """The loads that all turbines recorded, including the channels needed for the wind direction."""
    needed = {FORE_AFT: (FORE_AFT, SIDE_SIDE)} if result.direction else {}
    return [name for name in loads if all(x in each for each in result.turbines for x in needed.get(name, (name,)))]


@dataclass(frozen=True)
class FarmComparison:
    """Power and loads of two runs of a farm, by turbine.

    Attributes:
      yaw: (2, turbines) [rad] yaw from the wind; this run, then the other.
      power: (2, turbines) [W] mean power.
      loads: (2, turbines) [N m] damage-equivalent loads by channel of :data:`LOADS`.
    """

    yaw: Float
    power: Float
    loads: dict[str, Float]

    def power_change(self) -> Float:
        """(turbines + 1,) [%] change in power of each turbine, and of the farm."""
        now, other = np.append(self.power, self.power.sum(axis=1, keepdims=True), axis=1)
        return percent(now, other)

    def load_changes(self) -> dict[str, Float]:
        """(turbines,) [%] change of each load, by channel."""
        return {name: percent(*both) for name, both in self.loads.items()}

    def words(self) -> str:
        """Text with the gain in power of the farm and the largest increase of a load."""
        text = f"power of the farm {self.power_change()[-1]:+.2f} %"
        changes = {(i, n): x for n, row in self.load_changes().items() for i, x in enumerate(row) if np.isfinite(x)}
        if not changes:
            return text
        (i, name), most = max(changes.items(), key=lambda entry: entry[1])
        kind = "largest rise" if most > 0.0 else "smallest fall"
        return f"{text}; {kind} of an equivalent load: {LOADS[name]} of T{i + 1}, {most:+.1f} %"


def percent(now: Float, other: Float) -> Float:
    """Change [%] from ``other``; NaN where ``other`` is not positive."""
    known = other > 0.0
    return np.where(known, 100.0 * (now / np.where(known, other, 1.0) - 1.0), np.nan)


def compare_farms(result: FarmResult, other: FarmResult) -> FarmComparison:
    """Compare power and loads of two runs of a farm, such as with and without wake steering.

    Raises:
      InputError: the farms have different numbers of turbines.
    """
    check_counts(len(result), len(other), "the other run")
    both = result, other
    loads = [name for name in LOADS if all(name in _recorded(each, tuple(LOADS)) for each in both)]
    turbines = [[along_wind(t.evaluated, farm.direction) for t in farm.turbines] for farm in both]
    equivalent = [[equivalent_loads(t, loads) for t in row] for row in turbines]
    return FarmComparison(
        np.array([farm.yaw for farm in both]),
        np.array([[t["generator_power"].mean() for t in row] for row in turbines]),
        {name: np.array([[dels[name] for dels in row] for row in equivalent]) for name in loads},
    )


def check_counts(count: int, other: int, what: str) -> None:
    """Reject a comparison of farms with different numbers of turbines."""
    if count != other:
        raise InputError(
            f"{what} has {other} turbine{'s' * (other != 1)} and this farm {count}: farms are compared turbine by "
            "turbine; give a run of the same layout"
        )


def comparison_rows(comparison: FarmComparison, values: bool = True) -> tuple[list[str], list[list[str]]]:
    """Header and rows of the table of a comparison by turbine: changes [%], with ``values`` also both values."""
    powers = np.append(comparison.power, comparison.power.sum(axis=1, keepdims=True), axis=1)
    n = len(powers[0]) - 1
    columns = {"turbine": [*(f"T{i + 1}" for i in range(n)), "farm"]}
    columns |= _both("yaw", "deg", np.degrees(comparison.yaw), values)
    columns |= _both("power", "kW", 1e-3 * powers, values)
    columns["power change %" if values else "power %"] = _known(comparison.power_change())
    for name, change in comparison.load_changes().items():
        if values:
            columns |= _both(f"{LOADS[name]} DEL", "kN m", 1e-3 * comparison.loads[name], values)
        columns[f"{LOADS[name]} DEL change %" if values else f"{LOADS[name]} %"] = _known(change)
    filled = [column + [""] * (n + 1 - len(column)) for column in columns.values()]
    return list(columns), [list(row) for row in zip(*filled, strict=True)]


def _both(name: str, unit: str, values: Float, reference: bool) -> dict[str, list[str]]:
    """Columns of a value of this run and of the other one."""
    heads = (f"{name} {unit}", f"reference {name} {unit}")[: 1 + reference]
    return {head: [number(float(x)) for x in row] for head, row in zip(heads, values, strict=False)}


def _known(changes: Float) -> list[str]:
    return [number(float(x)) if np.isfinite(x) else "" for x in changes]


def differences(result: FarmResult, other: FarmResult) -> list[str]:
    """Differences in the setup of two runs of a farm as text; those that impair the comparison come last."""
    first = [farm.turbines[0] for farm in (result, other)]
    times = [float(np.ptp(each.evaluated.time)) for each in first]
    same = {
        "yaw": len(result) == len(other) and np.allclose(result.yaw, other.yaw),
        "wakes": result.settings == other.settings,
        "positions": result.positions.shape == other.positions.shape and np.allclose(result.positions, other.positions),
        "turbine": first[0].meta.get("turbine") == first[1].meta.get("turbine"),
        "controller": first[0].meta.get("controller") == first[1].meta.get("controller"),
        "wind": first[0].meta.get("wind") == first[1].meta.get("wind"),
        "evaluated time": abs(times[0] - times[1]) < 1e-6 * max(times),
    }
    return [name for name, equal in same.items() if not equal]


def plot_comparison(comparison: FarmComparison, title: str = "") -> Figure:
    """Changes of power and of equivalent loads against another run, by turbine."""
    figure, axes = new_figure(1, 2, size=(12.0, 4.0), share=False)
    power, loads = axes[0]
    n = len(comparison.power[0])
    names = [f"T{i + 1}" for i in range(n)]
    power.bar(range(n + 1), np.nan_to_num(comparison.power_change()), 0.6, color=[INK] * n + [SOFT])
    power.set_xticks(range(n + 1), [*names, "farm"])
    panel(power, "change of the mean power", "%")
    changes = comparison.load_changes()
    width = 0.8 / max(len(changes), 1)
    for k, (name, change) in enumerate(changes.items()):
        place = np.arange(n) + (k - 0.5 * (len(changes) - 1)) * width
        loads.bar(place, np.nan_to_num(change), 0.94 * width, color=COLOURS[k % len(COLOURS)], label=LOADS[name])
    loads.set_xticks(range(n), names)
    panel(loads, "change of the damage-equivalent loads", "%")
    if changes:
        loads.legend(frameon=False, fontsize=8, ncols=2)
    for ax in (power, loads):
        ax.axhline(0.0, color=INK, linewidth=0.9)
        ax.grid(False, axis="x")
    if title:
        figure_title(figure, title, longest=120)
    return figure


def along_wind(result: Result, direction: float) -> Result:
    """A result with ``wind_x`` and the fore-aft moment of the tower base along a wind direction [rad] (K-25).

    They are NaN if the component along y was not recorded.
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
    """A value in thousands, and its change in percent from the second value, if given."""
    now, *before = values
    return [number(now * 1e-3), *(number(100.0 * (now / x - 1.0)) if x > 0.0 else "" for x in before)]


def plot_farm(result: FarmResult, alone: FarmResult | None = None, title: str = "") -> Figure:
    """Wind over the farm at the end of the run, from above; power and a fatigue load by turbine.

    Args:
      result: results with wakes.
      alone: results without wakes.
    """
    figure = new_figure(1, size=(12.0, 6.0))[0]
    figure.clear()
    grid = figure.add_gridspec(2, 2, height_ratios=(1.5, 1.0))
    above = figure.add_subplot(grid[0, :])
    if result.view is not None:
        x, y, speed = result.view
        image = above.pcolormesh(x, y, speed.T, shading="gouraud", cmap="viridis", rasterized=True)
        bar = above.inset_axes((1.01, 0.0, 0.01, 1.0), axes_class=type(above))  # height of the panels
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
