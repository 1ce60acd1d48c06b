"""Tables and figures of stability: flutter, parked turbines."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from meltemi.report.palette import COLOURS, DIVERGING, FAINT, INK, curve
from meltemi.report.plots import ON_TOP, figure_title, heading, name_curves, new_figure, note, panel
from meltemi.report.tables import number

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from meltemi.studies.flutter import Flutter
    from meltemi.studies.parked_modes import ParkedStability

TO_RPM = 30.0 / math.pi
LEAST = "least damped blade mode"
MOST_DAMPING = 12.0
"""[%] upper limit of the panel of damping; flap modes lie above."""


def limit_text(diagram: Flutter) -> str:
    """The flutter limit as a sentence."""
    limit = diagram.limit
    if limit is None:
        known = diagram.rotor_speed[np.isfinite(diagram.least)] * TO_RPM
        return f"no blade mode is unstable up to {known[-1]:.4g} rpm" if len(known) else "no speed has a result"
    at = f"{limit.rotor_speed * TO_RPM:.4g} rpm"
    if limit.rotor_speed == diagram.rotor_speed[0]:
        at = f"at or below {at}, the lowest of the given speeds"
    if limit.frequency == 0.0:
        return f"limit: {at}, divergence ({limit.mode.participation()})"
    return (
        f"limit: {at}, {limit.blade_frequency / (2.0 * math.pi):.3g} Hz in the blades, "
        f"{limit.frequency / (2.0 * math.pi):.3g} Hz in the fixed frame: {limit.label} ({limit.mode.participation(4)})"
    )


def flutter_rows(diagram: Flutter) -> tuple[list[str], list[list[str]]]:
    """Header and rows of the modes over rotor speed, one per mode and speed."""
    head = ["mode", "wind m/s", "rotor rpm", "pitch deg", "frequency Hz", "damping %"]
    where = [number(diagram.wind_speed), number(math.degrees(diagram.pitch))]
    rows = [
        [label, where[0], number(float(speed) * TO_RPM), where[1], number(f / (2.0 * math.pi)), number(100.0 * d)]
        for label, frequency, damping in zip(diagram.labels, diagram.frequency, diagram.damping, strict=True)
        for speed, f, d in zip(diagram.rotor_speed, frequency, damping, strict=True)
    ]
    for speed, least in zip(diagram.rotor_speed, diagram.least, strict=True):
        rows.append([LEAST, where[0], number(float(speed) * TO_RPM), where[1], "-", number(100.0 * float(least))])
    return head, rows


def plot_flutter(diagram: Flutter, name: str = "") -> Figure:
    """Plot frequency and damping of the modes over rotor speed, and the flutter limit."""
    rpm = diagram.rotor_speed * TO_RPM
    figure, axes = new_figure(1, 2, size=(12.0, 7.0))
    frequency, damping = diagram.frequency / (2.0 * math.pi), 100.0 * diagram.damping
    for j, label in enumerate(diagram.labels):
        look = curve(j) | {"markersize": 4.0, "linewidth": 1.0}
        axes[0, 0].plot(rpm, frequency[j], label=label, **look)
        axes[0, 1].plot(rpm, damping[j], label=label, **look)
    least = 100.0 * diagram.least
    axes[0, 1].plot(rpm, least, color=INK, linewidth=2.0, marker="o" if len(rpm) == 1 else None, label=LEAST)
    axes[0, 0].set_ylim(bottom=0.0)
    low = float(np.nanmin([*damping.ravel(), *least], initial=-1.0))
    axes[0, 1].set_ylim(max(1.1 * low, -MOST_DAMPING), MOST_DAMPING)
    axes[0, 1].axhline(0.0, color=INK, linewidth=0.9)
    titles = (("natural frequency, fixed frame", "Hz"), (f"damping ratio (to {MOST_DAMPING:g} %)", "%"))
    for ax, (what, unit) in zip(axes[0], titles, strict=True):
        panel(ax, what, unit, "rotor speed [rpm]")
        if diagram.limit is not None:
            at = diagram.limit.rotor_speed * TO_RPM
            ax.axvspan(at, max(rpm[-1], at), color=COLOURS[1], alpha=0.12, linewidth=0.0, zorder=0)
            ax.axvline(at, color=FAINT, linewidth=1.0, linestyle="--")
    if diagram.limit is not None:
        at = diagram.limit.rotor_speed * TO_RPM
        note(axes[0, 1], f"limit {at:.2f} rpm", (at, 0.02), (-5, 0), ha="right", fontsize=9, **ON_TOP)
    for ax in axes[0]:
        name_curves(ax)
    of = f"{name}: " if name else ""
    figure_title(
        figure,
        f"{of}stability over rotor speed, wind {diagram.wind_speed:g} m/s, pitch {math.degrees(diagram.pitch):.3g} deg",
    )
    return figure


MOST_GROWTH = 5.0
"""[%] negative damping at the end of the colour scale of a map; fast growth lies beyond."""
LINEAR = 0.1
"""[%] damping up to which the colour scale of a map is linear; it is logarithmic beyond, as damping is mostly small."""


def parked_rows(stability: ParkedStability) -> tuple[list[str], list[list[str]]]:
    """Header and rows of the least damped mode at standstill, one per yaw and pitch."""
    head = ["wind m/s", "yaw deg", "pitch deg", "damping %", "frequency Hz", "mode"]
    speed = number(stability.wind.speed)
    rows = [
        [
            *(speed, number(math.degrees(yaw)), number(math.degrees(pitch)), number(100.0 * stability.damping[i, j])),
            *(number(stability.frequency[i, j] / (2.0 * math.pi)), stability.coordinate[i][j] or "-"),
        ]
        for i, yaw in enumerate(stability.yaw)
        for j, pitch in enumerate(stability.pitch)
    ]
    return head, rows


def plot_parked(stability: ParkedStability, name: str = "") -> Figure:
    """Map of the smallest damping ratio at standstill over yaw and pitch; letters name the unstable modes."""
    from matplotlib.colors import LinearSegmentedColormap, SymLogNorm

    from meltemi.report.figure import MINUS

    figure, axes = new_figure(1, 1, size=(11.0, 1.6 + 0.5 * max(len(stability.pitch), 4)))
    ax = axes[0, 0]
    scale = LinearSegmentedColormap.from_list("damping", DIVERGING).with_extremes(bad=FAINT)
    yaw, pitch = np.degrees(stability.yaw), np.degrees(stability.pitch)
    image = ax.pcolormesh(
        np.arange(len(yaw) + 1.0) - 0.5,
        np.arange(len(pitch) + 1.0) - 0.5,
        100.0 * stability.damping.T,
        cmap=scale,
        norm=SymLogNorm(LINEAR, linscale=0.5, vmin=-MOST_GROWTH, vmax=MOST_GROWTH),
    )
    for i in range(len(yaw)):
        for j in range(len(pitch)):
            if stability.damping[i, j] < 0.0:
                kind = stability.coordinate[i][j]
                letter = next((word[0].upper() for word in ("flap", "edge", "torsion") if word in kind), "o")
                colour = INK if 100.0 * stability.damping[i, j] > -0.4 * MOST_GROWTH else "white"
                ax.text(i, j, letter, fontsize=8, color=colour, ha="center", va="center")
    every = max(1, round(len(yaw) / 18))
    ax.set_xticks(range(0, len(yaw), every), [f"{angle:.4g}" for angle in yaw[::every]])
    ax.set_yticks(range(len(pitch)), [f"{angle:.4g}" for angle in pitch])
    ax.set_xlabel("yaw misalignment [deg]")
    ax.set_ylabel("pitch [deg]")
    levels = [sign * level for sign in (-1, 1) for level in (LINEAR, 0.3, 1.0, MOST_GROWTH)]
    bar = figure.colorbar(image, ax=ax, extend="both", label="smallest damping ratio [%]")
    levels = sorted([0.0, *levels])
    bar.set_ticks(levels, labels=[f"{level:g}".replace("-", MINUS) for level in levels])
    bar.minorticks_off()
    heading(ax, "unstable: F flapwise, E edgewise, T torsion, o other")
    figure_title(figure, f"{name} at standstill, wind {stability.wind.speed:g} m/s")
    return figure
