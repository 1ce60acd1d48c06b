"""Runs with power control in the speed-power plane."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from meltemi.core.errors import InputError
from meltemi.core.units import display
from meltemi.environment.site import STANDARD
from meltemi.power_control.rotor import rotor_tables
from meltemi.report.palette import COLOURS, FAINT, INK
from meltemi.report.plots import new_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from meltemi.analyses.rotor_performance import RotorPerformance
    from meltemi.simulation.result import Result
    from meltemi.turbine.power_turbine import AnyTurbine


def plot_speed_power(
    turbine: AnyTurbine,
    performance: RotorPerformance,
    runs: Mapping[str, Result],
    power: float,
    *,
    density: float = STANDARD,
) -> Figure:
    """Plot power and pitch over rotor speed, one column per run, with the optimal power and the reference.

    Args:
      turbine: turbine of the runs.
      performance: coefficients of its rotor.
      runs: runs by name, with the channels rotor_speed, generator_power and pitch_1.
      power: [W] electrical reference.
      density: [kg/m^3] air density.

    Raises:
      InputError: there are no runs, or a channel was not recorded.
    """
    if not runs:
        raise InputError("plot_speed_power: give at least one run")
    ratio, best = rotor_tables(performance, turbine.control.pitch.minimum).best
    efficiency = turbine.drivetrain.generator_efficiency
    gain = 0.5 * density * math.pi * turbine.rotor_radius**5 * best / ratio**3 * efficiency
    _, rpm = display("rad/s")
    rated = turbine.rated_rotor_speed
    lower = (power / gain) ** (1.0 / 3.0)
    figure, axes = new_figure(2, len(runs), size=(3.2 * len(runs) + 0.8, 5.6))
    speeds = [np.asarray(run["rotor_speed"]) for run in runs.values()]
    low, high = min(s.min() for s in speeds), max(s.max() for s in speeds)
    curve = np.linspace(min(low, lower), max(high, rated), 100)
    for i, (name, run) in enumerate(runs.items()):
        speed, top, bottom = speeds[i] * rpm, axes[0, i], axes[1, i]
        top.plot(curve * rpm, 1e-6 * gain * curve**3, color=INK, lw=1.0, label="optimal")
        top.axhline(1e-6 * power, color=INK, lw=1.0, ls="--", label="reference")
        top.plot(speed, 1e-6 * run["generator_power"], ".", ms=2, color=COLOURS[i % len(COLOURS)])
        bottom.plot(speed, np.degrees(run["pitch_1"]), ".", ms=2, color=COLOURS[i % len(COLOURS)])
        top.set_title(name.replace("_", " "))
        bottom.set_xlabel("rotor speed [rpm]")
        for ax in (top, bottom):
            for at in (lower, rated):
                ax.axvline(at * rpm, color=FAINT, lw=0.8, ls=":")
        top.set_ylim(0.0, 1.3e-6 * power)
        bottom.set_ylim(bottom=-0.5)
    axes[0, 0].set_ylabel("power [MW]")
    axes[1, 0].set_ylabel("pitch [deg]")
    axes[0, 0].legend(loc="lower right")
    return figure
