"""Figures 8 and 9: drops in the air, and the wetted area of a rotor."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from meltemi.environment.drops import MM_PER_HOUR, WATER, drop_spectrum, terminal_speed
from meltemi.environment.rain import RAIN_CLASSES, Rain, driest_speed, rain_parameters, rain_power_loss, wetness
from meltemi.papers.palanimuthu2022 import paper
from meltemi.papers.palanimuthu2022.figures.look import MEGA, beside, label, shades
from meltemi.papers.palanimuthu2022.machine import BLADES, rotor
from meltemi.report.palette import COLOURS, INK
from meltemi.report.plots import new_figure
from meltemi.studies.coefficient_rotor import CoefficientRotor

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Float = NDArray[np.float64]

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


STORM = Rain(rate=paper.RATE, mode="seed", diameter=paper.DROP)
"""Rain of the paper's figures: all drops of 3 mm."""
SPEED = np.linspace(0.15, 1.25, 221)


def loss(rain: Rain, wind: ArrayLike, radius: float = paper.RADIUS) -> Float:
    """Power loss [W] by rain at wind speeds [m/s]."""
    parameters = rain_parameters(rain, radius)
    return np.array([rain_power_loss(parameters, v) for v in np.atleast_1d(np.asarray(wind, float))])


def left(power: Float, lost: ArrayLike) -> Float:
    """Aerodynamic power less the loss by rain, at least zero; no loss where the rotor is driven."""
    return np.maximum(power - np.asarray(lost, float), 0.0)


def rainy_gain(blades: CoefficientRotor, rain: Rain) -> float:
    """Gain [N m s^2] of the optimal torque law in rain whose loss is proportional to the cube of the wind speed."""
    per_cube = float(loss(rain, 10.0)[0]) / 1e3
    return blades.gain() - per_cube * (blades.radius / blades.best()[0]) ** 3


Curve = tuple[str, Float, ArrayLike]
"""Name, power without rain [W], and its loss by rain."""


def _both(height: float, x: Float, curves: Sequence[Curve]) -> tuple[Figure, Axes]:
    """Draw curves without rain (solid) and with rain (dashed)."""
    figure, axes = new_figure(1, size=(7.5, height))
    ax: Axes = axes[0, 0]
    for colour, (name, power, lost) in zip(shades(len(curves)), curves, strict=True):
        ax.plot(x, np.maximum(power, 0.0) * MEGA, color=colour, label=name)
        ax.plot(x, left(power, lost) * MEGA, color=colour, linestyle="--")
    return figure, ax


def _named(ax: Axes, x: str, title: str, legend: str = "", top: float | None = None) -> None:
    ax.plot([], [], color=INK, label="no rain")
    ax.plot([], [], color=INK, linestyle="--", label="rain")
    ax.set_ylim(0.0, top)
    label(ax, x, "power [MW]", title)
    beside(ax, legend)


def over_wind() -> Figure:
    """Figure 10: power over wind at constant rotor speeds."""
    blades, v = rotor(BLADES), np.linspace(5.0, 14.0, 181)
    lost = loss(STORM, v)
    figure, ax = _both(4.2, v, [(f"{w:g} rad/s", blades.power(w, v), lost) for w in (0.45, 0.55, 0.65, 0.75, 0.85)])
    _named(ax, "wind speed [m/s]", "32 mm/h, drops of 3 mm, M3")
    return figure


def over_speed() -> Figure:
    """Figure 11: power over rotor speed by wind, with the loci of the best points."""
    blades, winds = rotor(BLADES), (7.0, 8.0, 9.0, 10.0, 10.715, 11.5)
    figure, ax = _both(4.6, SPEED, [(f"{v:g} m/s", blades.power(SPEED, v), loss(STORM, v)) for v in winds])
    w = np.linspace(0.3, 0.86, 100)
    ax.plot(w, blades.gain() * w**3 * MEGA, color=COLOURS[1], linewidth=1.8, label="best points")
    ax.plot(
        w, rainy_gain(blades, STORM) * w**3 * MEGA, color=COLOURS[1], linewidth=1.8, linestyle="--", label="in rain"
    )
    _named(ax, "rotor speed [rad/s]", "32 mm/h, drops of 3 mm, M3", top=32.0)
    return figure


def by_pitch() -> Figure:
    """Figure 12: power over rotor speed at rated wind by pitch."""
    blades, lost = rotor(BLADES), loss(STORM, paper.WIND)
    angles = (0.0, 2.0, 4.0, 6.0, 8.0, 10.0)
    powers = [blades.power(SPEED, paper.WIND, np.radians(angle)) for angle in angles]
    figure, ax = _both(4.2, SPEED, [(f"{a:g}°", power, lost) for a, power in zip(angles, powers, strict=True)])
    _named(ax, "rotor speed [rad/s]", "10.715 m/s, 32 mm/h, drops of 3 mm, M3", "pitch")
    return figure


def _at_rated(ax: Axes, rains: list[tuple[str, Rain | None]], title: str) -> None:
    power = rotor(BLADES).power(SPEED, paper.WIND)
    for colour, (name, rain) in zip([INK, *shades(len(rains) - 1)], rains, strict=True):
        lost = 0.0 if rain is None else loss(rain, paper.WIND)
        words = name if rain is None else f"{name}: -{float(np.max(lost)) * MEGA:.3g} MW"
        ax.plot(SPEED, left(power, lost) * MEGA, color=colour, label=words)
    ax.set_ylim(bottom=0.0)
    label(ax, "rotor speed [rad/s]", "power [MW]", title)


def by_drop() -> Figure:
    """Figure 13: power over rotor speed at rated wind by drop size; and with the spectrum of drops."""
    figure, axes = new_figure(1, size=(7.8, 4.2))
    rains: list[tuple[str, Rain | None]] = [("no rain", None), ("all sizes (integrated)", Rain(rate=paper.RATE))]
    rains += [(f"{d:g} mm", STORM.replace(diameter=d)) for d in (0.3, 1.0, 2.0, 3.0, 4.0, 5.0)]
    _at_rated(axes[0, 0], rains, "10.715 m/s, 32 mm/h, M3")
    beside(axes[0, 0], "diameter of all drops")
    return figure


def by_number() -> Figure:
    """Figure 14: power over rotor speed for drops of 3 mm by their number, and by water density."""
    figure, axes = new_figure(2, 1, size=(8.0, 7.6), share=False)
    rains: list[tuple[str, Rain | None]] = [("no rain", None)]
    rains += [(f"{rate:g} mm/h", STORM.replace(rate=rate)) for rate in RAIN_CLASSES.values()]
    _at_rated(axes[0, 0], rains, "number N of drops, through the rain rate; 3 mm, 10.715 m/s, M3")
    beside(axes[0, 0])
    rains = [("no rain", None)]
    rains += [(f"{x:g} kg/m³", STORM.replace(water_density=x)) for x in (250.0, 500.0, 750.0, 1000.0)]
    _at_rated(axes[1, 0], rains, "density $\\sigma$ of the drops; 3 mm, 32 mm/h, 10.715 m/s, M3")
    beside(axes[1, 0])
    return figure
