"""Figures 2 to 5: air density, and power over rotor speed at different air densities."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from meltemi.papers.palanimuthu2022 import paper
from meltemi.papers.palanimuthu2022.figures.look import MEGA, beside, label, shades
from meltemi.papers.palanimuthu2022.machine import FORMULA, density, rotor
from meltemi.report.palette import COLOURS
from meltemi.report.plots import new_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Float = NDArray[np.float64]
WARMTH = np.linspace(-10.0, 40.0, 201)
TEMPERATURES = (-10.0, 0.0, 10.0, 20.0, 30.0, 40.0)
SHOWN_TEMPERATURES = (-10.0, 0.0, 10.0, 15.0, 20.0, 30.0, 40.0)


def _curves(ax: Axes, x: Float, curves: Mapping[str, Float]) -> None:
    for colour, (name, y) in zip(shades(len(curves)), curves.items(), strict=True):
        ax.plot(x, y, color=colour, label=name)


def humidity() -> Figure:
    """Figure 2: density over temperature and humidity at sea level."""
    figure, axes = new_figure(1, 2, size=(11.0, 3.8), share=False)
    _curves(axes[0, 0], WARMTH, {f"{100 * h:g} %": density(WARMTH, h) for h in paper.HUMIDITIES})
    label(axes[0, 0], "temperature [°C]", "density [kg/m³]", "over temperature")
    beside(axes[0, 0], "humidity")
    moist = np.linspace(0.0, 1.0, 101)
    changes = {f"{t:g} °C": 100.0 * (density(t, moist) / density(t) - 1.0) for t in TEMPERATURES}
    _curves(axes[0, 1], 100.0 * moist, changes)
    label(axes[0, 1], "relative humidity [%]", "change of the density [%]", "change from dry air")
    beside(axes[0, 1], "temperature")
    return figure


def altitude() -> Figure:
    """Figure 3: density over temperature and altitude at a humidity of 40 %."""
    figure, axes = new_figure(1, 2, size=(11.0, 3.8), share=False)
    _curves(axes[0, 0], WARMTH, {f"{h:g} m": density(WARMTH, 0.4, h) for h in paper.ALTITUDES})
    for i, ((t, _), printed) in enumerate(paper.DENSITIES.items()):
        name = "printed in the paper" if i == 0 else None
        axes[0, 0].plot(t, printed, "o", color=COLOURS[1], markersize=6, fillstyle="none", label=name, clip_on=False)
    label(axes[0, 0], "temperature [°C]", "density [kg/m³]", "over temperature, humidity 40 %")
    beside(axes[0, 0], "altitude")
    high = np.linspace(0.0, 2000.0, 101)
    _curves(axes[0, 1], high, {f"{t:g} °C": density(t, 0.4, high) for t in TEMPERATURES})
    label(axes[0, 1], "altitude [m]", "density [kg/m³]", "over altitude, humidity 40 %")
    beside(axes[0, 1], "temperature")
    return figure


def _power(densities: Mapping[str, float], title: str) -> Figure:
    figure, axes = new_figure(1, size=(7.5, 4.0))
    ax, formula, speed = axes[0, 0], rotor(FORMULA), np.linspace(0.2, 1.3, 221)
    best = formula.best()[0] * paper.WIND / formula.radius
    for colour, (name, rho) in zip(shades(len(densities)), densities.items(), strict=True):
        ax.plot(speed, formula.power(speed, paper.WIND, 0.0, rho) * MEGA, color=colour, label=name)
        ax.plot(best, formula.power(best, paper.WIND, 0.0, rho) * MEGA, "o", color=colour, markersize=3.5)
    stated = "paper, 15 °C:\n21.2 MW, 0.75 rad/s"
    ax.plot(paper.SPEED, paper.POWER * MEGA, "*", color=COLOURS[1], markersize=11, label=stated)
    ax.set_ylim(bottom=0.0)
    label(ax, "rotor speed [rad/s]", "power [MW]", title)
    beside(ax)
    return figure


def by_temperature() -> Figure:
    """Figure 4: power over rotor speed at rated wind, by temperature."""
    densities = {f"{t:g} °C": float(density(t)) for t in SHOWN_TEMPERATURES}
    return _power(densities, "dry air at sea level, 10.715 m/s, M1")


def by_altitude() -> Figure:
    """Figure 5: power over rotor speed at rated wind, by altitude."""
    densities = {f"{h:g} m": float(density(15.0, 0.0, h)) for h in paper.ALTITUDES}
    return _power(densities, "dry air of 15 °C, 10.715 m/s, M1")
