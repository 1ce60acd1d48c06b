"""Figures 8 and 9: drops in the air, and the wetted area of a rotor."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from meltemi.environment.drops import MM_PER_HOUR, WATER, drop_spectrum, terminal_speed
from meltemi.environment.rain import RAIN_CLASSES, Rain, driest_speed, wetness
from meltemi.papers.palanimuthu2022 import paper
from meltemi.papers.palanimuthu2022.figures.look import beside, label, shades
from meltemi.report.palette import COLOURS
from meltemi.report.plots import new_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

HALF = Rain(rate=1.0).half_thickness
"""[m] half thickness of the ellipsoid."""


def drops() -> Figure:
    """Figure 8: number of drops over their diameter, and the water in them, for the eight rain classes."""
    figure, axes = new_figure(1, 2, size=(11.0, 4.0), share=False)
    d = np.linspace(0.1e-3, 6e-3, 300)
    for colour, (name, rate) in zip(shades(len(RAIN_CLASSES)), RAIN_CLASSES.items(), strict=True):
        n = drop_spectrum(d, rate * MM_PER_HOUR)
        axes[0, 0].semilogy(d * 1e3, n * 1e-3, color=colour)
        words = f"{name.replace('_', ' ')}, {rate:g} mm/h"
        axes[0, 1].plot(
            d * 1e3, WATER * np.pi / 6.0 * d**3 * n, color=colour, label=words
        )  # kg/m^3 per m is g/m^3 per mm
    axes[0, 0].set_ylim(1e-3, 1e4)
    label(axes[0, 0], "diameter [mm]", "n(d) [1/m³ and mm]", "number of drops")
    label(axes[0, 1], "diameter [mm]", "water [g/m³ and mm]", "water in them")
    beside(axes[0, 1])
    return figure


def _wet(
    ax: Axes, rains: Sequence[tuple[str, tuple[float, float, float]]], ends: tuple[float, float], title: str
) -> None:
    disc = np.pi * paper.RADIUS**2
    for colour, (name, (tail, cross, fall)) in zip(COLOURS, rains, strict=False):
        components = {"tail": tail, "cross": cross, "fall": fall}
        dry = driest_speed(paper.RADIUS, HALF, tail, cross, fall)
        s = np.linspace(*ends, 800)
        if ends[0] < dry < ends[1]:
            s = np.sort(np.append(s, dry))
            ax.plot(dry, wetness(dry, paper.RADIUS, HALF, **components) / disc, "o", color=colour, markersize=4)
        ax.semilogy(s, wetness(s, paper.RADIUS, HALF, **components) / disc, color=colour, label=f"{name} m/s")
    label(ax, "speed s [m/s]", "W / πR² [-]", title)
    ax.legend(loc="lower right")


def wetted() -> Figure:
    """Figure 9: wetted area over speed, with the components of the rain: tail, cross, down."""
    figure, axes = new_figure(1, 3, size=(10.5, 3.6), share=False)
    fall = float(terminal_speed(paper.DROP * 1e-3))
    tails = [(f"$v_t$ = {t:g}", (t, 0.0, fall)) for t in (-5.0, 0.0, 2.0, 5.0, 10.0)]
    _wet(axes[0, 0], tails, (1.0, 25.0), f"tail wind; $v_c$ = 0, k = {fall:.2f} m/s")
    crosses = [(f"$v_c$ = {c:g}", (5.0, c, fall)) for c in (0.0, 5.0, 10.0, 20.0)]
    _wet(axes[0, 1], crosses, (4.5, 5.5), f"cross wind; $v_t$ = 5, k = {fall:.2f} m/s")
    falls = [(f"k = {k:.2f}", (5.0, 0.0, k)) for k in map(float, terminal_speed(np.array([0.3, 1.0, 2.0, 3.0]) * 1e-3))]
    _wet(axes[0, 2], falls, (4.5, 5.5), "down: drops of 0.3 to 3 mm; $v_t$ = 5")
    return figure
