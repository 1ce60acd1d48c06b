"""Figures 6, 7, 20 and 21: runs with steps of the weather, in two climates, and with limited power."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from meltemi.papers.palanimuthu2022 import paper
from meltemi.papers.palanimuthu2022.figures.look import MEGA, beside, label, shades
from meltemi.papers.palanimuthu2022.machine import BLADES, rotor
from meltemi.papers.palanimuthu2022.runs import (
    CONVERTERS,
    PHYSICAL,
    PLAIN,
    RAMPS,
    SCHEMES,
    TURBULENT,
    PowerControlRuns,
    aero_power,
    power_ratio,
    ratio,
)
from meltemi.report.palette import COLOURS, FAINT, INK, SOFT
from meltemi.report.plots import new_figure, panel
from meltemi.reports.panels import Panel, channel
from meltemi.simulation.result import Result

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Float = NDArray[np.float64]

TEMPERATURE: Panel = ("temperature", "°C", lambda r: r["air_temperature"] - 273.15)
RATIO: Panel = ("tip-speed ratio", "-", ratio)
COEFFICIENT: Panel = ("power coefficient", "-", power_ratio)
SPEED: Panel = ("rotor speed", "rad/s", channel("rotor_speed"))
AERO: Panel = ("power of the air $P_a$", "MW", lambda r: aero_power(r) * MEGA)
GENERATED: Panel = ("power of the generator", "MW", channel("generator_power", MEGA))
GRID: Panel = ("power into the grid, with machine and converters", "MW", channel("generator_power", MEGA))
WIND: Panel = ("wind", "m/s", channel("wind_x"))
TORQUE: Panel = ("torque of the generator $T_{em}$", "MN m", channel("generator_torque", MEGA))
PITCH: Panel = ("pitch", "deg", channel("pitch_1", 180.0 / np.pi))


def _lettered(panels: Sequence[Panel]) -> list[Panel]:
    return [(f"{letter}: {title}", unit, of) for letter, (title, unit, of) in zip("abcdefgh", panels, strict=False)]


def _steps(
    results: Mapping[str, Result],
    names: Mapping[str, str],
    panels: Sequence[Panel],
    title: str,
    converters: Mapping[str, Result] | None = None,
    stated: Mapping[tuple[float, float], float] | None = None,
) -> Figure:
    """Panels of the runs with steps: cases, gains and the means [W] stated in the paper, runs with converters."""
    n = len(panels) + 1
    sources = [results] * (len(panels) - 1) + [converters or results]
    figure, axes = new_figure((n + 1) // 2, 2, size=(11.0, 1.75 * ((n + 1) // 2) + 0.6))
    for ax, (what, unit, of), source in zip(axes.flat, _lettered(panels), sources, strict=False):
        for colour, (case, name) in zip(COLOURS, names.items(), strict=False):
            ax.plot(source[case].time, of(source[case]), color=colour, linewidth=1.1, label=name)
        panel(ax, what, unit)
    last = axes.flat[len(panels)]
    base = results["i"]
    for colour, (case, name) in zip(COLOURS[1:], list(names.items())[1:], strict=False):
        gain = aero_power(results[case]) - aero_power(base)
        last.plot(base.time, gain * 1e-3, color=colour, linewidth=1.1, label=name)
    for window, printed in (stated or {}).items():
        last.plot(window, [printed * 1e-3] * 2, color=INK, linestyle="--", linewidth=1.1)
    panel(last, "gain of $P_a$ against case i" + ("; dashed: means in the paper" if stated else ""), "kW")
    for ax in (last, axes[-2, 1]):
        ax.set_xlabel("time [s]")
        ax.tick_params(labelbottom=True)
    handles, labels = axes[0, 1].get_legend_handles_labels()
    axes[-1, 1].set_axis_off()
    axes[-1, 1].legend(handles, labels, loc="center")
    figure.suptitle(title)
    return figure


def temperature_steps(runs: PowerControlRuns) -> Figure:
    """Figure 6: steps of the temperature."""
    names = {"i": "case i: density 1.225 kg/m³", "ii": "case ii: density of the temperature"}
    converters = runs.temperature.get(CONVERTERS)
    panels = (TEMPERATURE, RATIO, COEFFICIENT, SPEED, AERO, GRID if converters else GENERATED)
    title = "10 m/s, dry air at sea level, M1, J = 2.93e9 kg m²"
    stated = {(100.0, 200.0): paper.GAINS[40.0], (600.0, 700.0): paper.GAINS[-10.0]}
    electric = converters.results if converters else None
    return _steps(runs.temperature[PLAIN].results, names, panels, title, electric, stated)


def humidity_steps(runs: PowerControlRuns) -> Figure:
    """Figure 7: steps of the humidity."""
    names = {
        "i": "case i: 1.225 kg/m³",
        "ii": "case ii: of temperature",
        "iii": "case iii: of temperature and humidity",
    }
    moist: Panel = ("relative humidity", "%", channel("humidity", 100.0))
    panels = (moist, RATIO, COEFFICIENT, SPEED, AERO, GENERATED)
    return _steps(runs.humidity.results, names, panels, "10 m/s, 35 °C, M1, J = 2.93e9 kg m²")


FULL = (WIND, SPEED, RATIO, COEFFICIENT, TORQUE, AERO, GENERATED, PITCH)


def _in_winds(columns: Sequence[tuple[str, Mapping[str, Result]]], lines: Mapping[str, float] | None = None) -> Figure:
    figure, axes = new_figure(len(FULL), len(columns), size=(11.5, 1.45 * len(FULL) + 0.8))
    for j, (title, results) in enumerate(columns):
        for i, (what, unit, of) in enumerate(_lettered(FULL)):
            ax = axes[i, j]
            for k, (name, result) in enumerate(results.items()):
                if i == 0 and k > 0:
                    continue  # the wind is the same in all cases
                colour = INK if i == 0 else COLOURS[k]
                ax.plot(result.time, of(result), color=colour, linewidth=1.0, label=name)
            if what.startswith("b") and lines:
                for name, value in lines.items():
                    ax.axhline(value, color=SOFT, linewidth=0.8, linestyle="--")
                    ax.annotate(
                        name, (0.995, value), xycoords=("axes fraction", "data"), fontsize=7, ha="right", va="bottom"
                    )
            panel(ax, f"{what}; {title}" if i == 0 else what, unit)
        axes[-1, j].set_xlabel("time [s]")
    handles, labels = axes[1, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=len(labels))
    return figure


def climates(runs: PowerControlRuns) -> Figure:
    """Figure 20: two climates."""
    names = {"i": "case i: 15 °C, 0 %", "ii": "case ii: 35 °C, 30 %"}
    columns = [
        (wind, {words: runs.climate[wind, case] for case, words in names.items()})
        for wind in dict.fromkeys(wind for wind, _ in runs.climate)
    ]
    return _in_winds(columns)


def limited(runs: PowerControlRuns) -> Figure:
    """Figure 21: limited power."""
    names = {"A0": "A0 (case i)", "A1": "A1", "A2": "A2 (case ii)", "A3": "A3"}
    columns = [
        (wind, {names[s]: runs.limited[BLADES, PHYSICAL, wind, s] for s in SCHEMES})
        for wind in (RAMPS, f"{TURBULENT} {runs.setup.seeds[0]}")
    ]
    low = rotor(BLADES).speed_for(paper.REFERENCE)
    return _in_winds(columns, {"$\\omega_l$": low, "$\\omega_r$": paper.SPEED})


PITCHES = (4.0, 6.0, 8.0)
"""[deg] pitch angles of the curves of Figure 19."""
WINDS = (8.0, 9.0, 10.0, 11.0)
"""[m/s] wind speeds of the thin curves."""


def _background(ax: Axes) -> None:
    blades = rotor(BLADES)
    speed = np.linspace(0.4, 0.9, 200)
    for v in WINDS:
        power = blades.power(speed, v) * MEGA
        ax.plot(speed, power, color=FAINT, linewidth=0.9)
        at = float(blades.power(0.855, v)) * MEGA
        ax.annotate(f"{v:g} m/s", (0.858, at), fontsize=7, color=SOFT, ha="right", va="bottom")
    ax.plot(speed, blades.gain() * speed**3 * MEGA, color=INK, linewidth=1.4, label="$P_{opt} = K_T\\omega^3$")
    ax.axhline(paper.REFERENCE * MEGA, color=SOFT, linewidth=1.0, linestyle="--", label="$P_{ref}$")
    low = blades.speed_for(paper.REFERENCE)
    for name, value in (("$\\omega_l$", low), ("$\\omega_r$", paper.SPEED)):
        ax.axvline(value, color=SOFT, linewidth=0.8, linestyle=":")
        ax.annotate(
            name,
            (value, 0.015),
            xycoords=("data", "axes fraction"),
            xytext=(2, 0),
            textcoords="offset points",
            fontsize=8,
        )
    ax.set_xlim(0.55, 0.86)
    ax.set_ylim(6.0, 25.0)


def _path(ax: Axes, runs: PowerControlRuns, scheme: str) -> None:
    """Draw the path of a run through the ramps: up with the wind, along the reference, and back."""
    result = runs.limited[BLADES, PHYSICAL, RAMPS, scheme]
    inside = result.time >= 40.0
    speed = result["rotor_speed"][inside]
    air, delivered = aero_power(result)[inside] * MEGA, result["generator_power"][inside] * MEGA
    ax.plot(speed, air, color=COLOURS[0], linewidth=1.0, label="power of the air")
    pitched = np.degrees(result["pitch_1"][inside]) > 0.05
    ax.plot(speed[pitched], air[pitched], ".", color=COLOURS[3], markersize=3.0, label="... with pitch")
    ax.plot(speed, delivered, color=COLOURS[1], linewidth=1.8, label="power of the generator")
    _arrows(ax, speed, air, COLOURS[0])


def _arrows(ax: Axes, x: Float, y: Float, colour: str, number: int = 9) -> None:
    """Draw arrow heads along a path, evenly spaced in the figure."""
    (left, right), (low, high) = ax.get_xlim(), ax.get_ylim()
    steps = np.hypot(np.diff(x) / (right - left), np.diff(y) / (high - low))
    way = np.concatenate([[0.0], np.cumsum(steps)])
    for share in (np.arange(number) + 0.5) / number:
        i = int(np.searchsorted(way, share * way[-1]))
        j = max(int(np.searchsorted(way, share * way[-1] - 0.01)), 0)
        if i > j and low < y[i] < high:
            look = {"arrowstyle": "-|>", "color": colour, "linewidth": 0.0, "mutation_scale": 11}
            ax.annotate("", xy=(x[i], y[i]), xytext=(x[j], y[j]), arrowprops=look)


def _pitch(ax: Axes, runs: PowerControlRuns, scheme: str) -> None:
    for colour, wind in ((COLOURS[2], f"{TURBULENT} {runs.setup.seeds[0]}"), (COLOURS[0], RAMPS)):
        result = runs.limited[BLADES, PHYSICAL, wind, scheme]
        inside = result.time >= 40.0
        x, y = result["rotor_speed"][inside], np.degrees(result["pitch_1"][inside])
        ax.plot(x, y, color=colour, linewidth=1.4 if wind == RAMPS else 0.8, label=wind)
    ax.set_xlim(0.55 if scheme != "A3" else 0.5, 0.86)
    ax.set_ylim(top=1.2 * ax.get_ylim()[1])  # space for the legend
    ax.legend(loc="upper right")


def plane(runs: PowerControlRuns, scheme: str) -> Figure:
    """Figures 17 to 19: a scheme in the plane of rotor speed and power, and its pitch."""
    figure, axes = new_figure(1, 2, size=(10.5, 4.0), share=False)
    ax = axes[0, 0]
    _background(ax)
    if scheme == "A3":
        blades = rotor(BLADES)
        speed = np.linspace(0.4, 0.9, 200)
        for colour, angle in zip(shades(len(PITCHES) + 1)[1:], PITCHES, strict=True):
            power = blades.gain(pitch=float(np.radians(angle))) * speed**3 * MEGA
            ax.plot(speed, power, color=colour, linewidth=1.1, linestyle="-.", label=f"$P_{{opt}}$ at {angle:g}°")
    _path(ax, runs, scheme)
    label(ax, "rotor speed [rad/s]", "power [MW]", f"{scheme}, 15 MW, ramps of the wind")
    beside(ax)
    _pitch(axes[0, 1], runs, scheme)
    for value in (rotor(BLADES).speed_for(paper.REFERENCE), paper.SPEED):
        axes[0, 1].axvline(value, color=SOFT, linewidth=0.8, linestyle=":")
    label(axes[0, 1], "rotor speed [rad/s]", "pitch [deg]", "pitch over speed")
    return figure
