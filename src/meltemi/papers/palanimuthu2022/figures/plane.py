"""Figures 17 to 19: the schemes of active power control in the plane of rotor speed and power."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from meltemi.papers.palanimuthu2022 import paper
from meltemi.papers.palanimuthu2022.figures.look import MEGA, beside, label, shades
from meltemi.papers.palanimuthu2022.machine import BLADES, rotor
from meltemi.papers.palanimuthu2022.runs import PHYSICAL, RAMPS, TURBULENT, PowerControlRuns, aero_power
from meltemi.report.palette import COLOURS, FAINT, INK, SOFT
from meltemi.report.plots import new_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Float = NDArray[np.float64]
PITCHES = (4.0, 6.0, 8.0)
"""[deg] of the curves of Figure 19."""
WINDS = (8.0, 9.0, 10.0, 11.0)
"""[m/s] of the thin curves."""


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
    air, given = aero_power(result)[inside] * MEGA, result["generator_power"][inside] * MEGA
    ax.plot(speed, air, color=COLOURS[0], linewidth=1.0, label="power of the air")
    pitched = np.degrees(result["pitch_1"][inside]) > 0.05
    ax.plot(speed[pitched], air[pitched], ".", color=COLOURS[3], markersize=3.0, label="... with pitch")
    ax.plot(speed, given, color=COLOURS[1], linewidth=1.8, label="power of the generator")
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


def _plane(runs: PowerControlRuns, scheme: str) -> Figure:
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


def rated_speed(runs: PowerControlRuns) -> Figure:
    """Figure 17: pitch from rated speed."""
    return _plane(runs, "A1")


def hold(runs: PowerControlRuns) -> Figure:
    """Figure 18: pitch held between the speeds."""
    return _plane(runs, "A2")


def wide_hold(runs: PowerControlRuns) -> Figure:
    """Figure 19: pitch held down to the speed that gives the power at the present pitch."""
    return _plane(runs, "A3")
