"""Figure of a sea: elevation, velocity over depth, spectrum."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from meltemi.report.palette import COLOURS
from meltemi.report.plots import heading, new_figure, panel
from meltemi.sea.statistics import SeaSeries

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from meltemi.sea.conditions import Sea

SHOWN = 300.0
"""[s] length of the series that is drawn."""


def plot_sea(sea: Sea, series: SeaSeries) -> Figure:
    """Elevation and velocities over time, and the spectrum of the waves."""
    figure, axes = new_figure(3, size=(9.0, 7.5), share=False)
    elevation, velocity, spectrum = axes[:, 0]
    shown = series.time <= SHOWN
    elevation.plot(series.time[shown], series.elevation[shown], color=COLOURS[0], lw=0.9)
    panel(elevation, "elevation", "m")
    for i, z in enumerate(series.height):
        velocity.plot(
            series.time[shown],
            series.velocity[shown, i],
            color=COLOURS[i],
            lw=0.9,
            label=f"{z:g} m" if z else "surface",
        )
    panel(velocity, "velocity", "m/s")
    velocity.legend(ncols=len(series.height), loc="upper right", fontsize="small")
    velocity.set_xlabel("time [s]")
    w, variance = series.spectrum
    if len(w) > 1:
        spectrum.plot(w / (2.0 * np.pi), 2.0 * np.pi * variance / np.gradient(w), color=COLOURS[0], lw=0.9)
    elif len(w):
        spectrum.stem(w / (2.0 * np.pi), variance)
    panel(spectrum, "spectrum", "m^2/Hz" if len(w) != 1 else "m^2")
    spectrum.set_xlabel("frequency [Hz]")
    heading(elevation, sea.label, "right")
    return figure
