"""Tables and figures of stability: flutter."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from meltemi.report.palette import COLOURS, FAINT, INK, curve
from meltemi.report.plots import figure_title, new_figure, note, panel
from meltemi.report.tables import number

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from meltemi.simulation.flutter import Flutter

TO_RPM = 30.0 / math.pi
MOST_DAMPING = 12.0
"""[%] to which the panel of damping reaches; flap modes lie above."""


def limit_text(found: Flutter) -> str:
    """The flutter limit as a sentence."""
    limit = found.limit
    if limit is None:
        last = found.rotor_speed[np.isfinite(found.least)][-1] * TO_RPM
        return f"no blade mode is unstable up to {last:.4g} rpm"
    if limit.frequency == 0.0:
        return f"limit: divergence at {limit.rotor_speed * TO_RPM:.4g} rpm ({limit.mode.participation()})"
    return (
        f"limit: {limit.rotor_speed * TO_RPM:.4g} rpm, {limit.blade_frequency / (2.0 * math.pi):.3g} Hz in the blades, "
        f"{limit.frequency / (2.0 * math.pi):.3g} Hz in the fixed frame: {limit.label} ({limit.mode.participation(4)})"
    )


def flutter_rows(found: Flutter) -> tuple[list[str], list[list[str]]]:
    """Header and rows of the modes over rotor speed, one per mode and speed."""
    head = ["mode", "wind m/s", "rotor rpm", "pitch deg", "frequency Hz", "damping %"]
    where = [number(found.wind_speed), number(math.degrees(found.pitch))]
    rows = [
        [label, where[0], number(float(speed) * TO_RPM), where[1], number(f / (2.0 * math.pi)), number(100.0 * d)]
        for label, frequency, damping in zip(found.labels, found.frequency, found.damping, strict=True)
        for speed, f, d in zip(found.rotor_speed, frequency, damping, strict=True)
    ]
    return head, rows


def plot_flutter(found: Flutter, name: str = "") -> Figure:
    """Plot frequency and damping of the modes over rotor speed, and the flutter limit."""
    rpm = found.rotor_speed * TO_RPM
    figure, axes = new_figure(1, 2, size=(12.0, 7.0))
    frequency, damping = found.frequency / (2.0 * math.pi), 100.0 * found.damping
    for j, label in enumerate(found.labels):
        look = curve(j) | {"markersize": 4.0, "linewidth": 1.0}
        axes[0, 0].plot(rpm, frequency[j], label=label, **look)
        axes[0, 1].plot(rpm, damping[j], **look)
    axes[0, 0].set_ylim(bottom=0.0)
    low = float(np.nanmin(damping, initial=-1.0))
    axes[0, 1].set_ylim(max(1.1 * low, -MOST_DAMPING), MOST_DAMPING)
    axes[0, 1].axhline(0.0, color=INK, linewidth=0.9)
    titles = (("natural frequency, fixed frame", "Hz"), (f"damping ratio (to {MOST_DAMPING:g} %)", "%"))
    for ax, (what, unit) in zip(axes[0], titles, strict=True):
        panel(ax, what, unit, "rotor speed [rpm]")
        if found.limit is not None:
            at = found.limit.rotor_speed * TO_RPM
            ax.axvspan(at, max(rpm[-1], at), color=COLOURS[1], alpha=0.12, linewidth=0.0, zorder=0)
            ax.axvline(at, color=FAINT, linewidth=1.0, linestyle="--")
    if found.limit is not None:
        top = axes[0, 1].get_ylim()[1]
        note(axes[0, 1], f"limit {found.limit.rotor_speed * TO_RPM:.2f} rpm", (rpm[0], 0.95 * top), fontsize=9)
    figure.legend(loc="outside lower center", ncols=5, fontsize=8, frameon=False)
    figure_title(
        figure,
        f"{name}: stability over rotor speed, wind {found.wind_speed:g} m/s, pitch {math.degrees(found.pitch):.3g} deg",
    )
    return figure
