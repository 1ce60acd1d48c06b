"""Bode plots of control loops at their operating points, over the envelope frequency."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from meltemi.core.errors import InputError
from meltemi.report.palette import COLOURS, FAINT, INK
from meltemi.report.plots import corner, new_figure, panel

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from meltemi.controllers.tuning import LoopTuning, TunedPoint

LEAST_GAIN, MOST_GAIN = 0.03, 30.0
"""Displayed range of |L|."""
SMALL_GAIN = 0.1
"""|L| below which, from the first such frequency on, the phase is not shown."""
SLOWEST, FASTEST = 3e-3, 10.0
"""[Hz] displayed frequencies."""
LIMIT: dict[str, Any] = {"color": FAINT, "linewidth": 0.9, "linestyle": ":", "zorder": 0.5}


def plot_tuning(tunings: LoopTuning | Mapping[str, LoopTuning]) -> Figure:
    """Plot gain and phase of L and sensitivity 1 / |1 + L|: one row per loop, one colour per operating point.

    L is the sum of all simultaneous loops, as seen by the blades about the loop's harmonic. The amplitude of a
    harmonic changes with frequencies of either sign. Both are drawn over their size: negative ones dashed, with the
    phase mirrored, so that a loop that treats both alike has one curve.

    Args:
      tunings: a tuning, or several by name.

    Raises:
      InputError: there are none.
    """
    several: Mapping[str, LoopTuning] = tunings if isinstance(tunings, Mapping) else {"": tunings}
    if not several:
        raise InputError("plot_tuning: no tunings")
    from matplotlib.lines import Line2D

    figure, axes = new_figure(len(several), 3, size=(12.0, 3.1 * len(several) + 0.9))
    for (name, tuning), row in zip(several.items(), axes, strict=True):
        _loop(name, tuning.points, row)
    for ax in axes[-1]:
        ax.set_xlabel("frequency of the amplitude [Hz]")
    handles, labels = axes[0, 0].get_legend_handles_labels()
    handles += [Line2D([], [], color=INK, linewidth=1.1), Line2D([], [], color=INK, linewidth=1.1, linestyle="--")]
    labels += ["positive frequencies", "negative frequencies"]
    figure.legend(handles, labels, loc="outside lower center", ncols=len(labels))
    return figure


def _loop(name: str, points: Sequence[TunedPoint], row: Sequence[Axes]) -> None:
    gain, phase, sensitivity = row
    for i, point in enumerate(points):
        colour = COLOURS[i % len(COLOURS)]
        for sign, look in ((1, "-"), (-1, "--")):
            side = np.flatnonzero(np.sign(point.frequency) == sign)[::sign]
            f, L = np.abs(point.frequency[side]) / (2.0 * np.pi), point.together[side]
            label = f"{point.wind_speed:.3g} m/s" if sign > 0 else None
            look_of_curve = {"color": colour, "linewidth": 1.1, "linestyle": look}
            gain.loglog(f, np.abs(L), label=label, **look_of_curve)
            # at these frequencies the band-pass has no output, and the phase jumps
            small = np.flatnonzero(np.abs(L) < SMALL_GAIN)
            end = int(small[0]) if len(small) else len(f)
            angle = np.degrees(np.unwrap(np.angle(L if sign > 0 else L.conj())))
            phase.semilogx(f[:end], angle[:end], **look_of_curve)
            sensitivity.semilogx(f, 1.0 / np.abs(1.0 + L), **look_of_curve)
    gain.set_ylim(LEAST_GAIN, MOST_GAIN)
    gain.axhline(1.0, **LIMIT)
    phase.set_ylim(-270.0, 0.0)
    phase.set_yticks(np.arange(-270.0, 1.0, 45.0))
    phase.axhline(-180.0, **LIMIT)
    sensitivity.axhline(1.0, **LIMIT)
    sensitivity.set_ylim(0.0, None)
    margin, factor = np.degrees(min(p.phase_margin for p in points)), min(p.gain_margin for p in points)
    peak = max(p.sensitivity for p in points)
    words = (
        (gain, f"gain margin {factor:.2g}" if np.isfinite(factor) else "gain margin infinite"),
        (phase, f"phase margin {margin:.0f} deg" if np.isfinite(margin) else "phase margin infinite"),
        (sensitivity, f"largest {peak:.2f}"),
    )
    what = ("gain |L|", "phase of L", "sensitivity 1/|1 + L|")
    for (ax, text), title, unit in zip(words, what, ("-", "deg", "-"), strict=True):
        panel(ax, f"{name}: {title}".removeprefix(": "), unit)
        ax.set_xlim(SLOWEST, FASTEST)
        ax.tick_params(labelsize=8)
        corner(ax, 0.04, 0.9 if ax is sensitivity else 0.06, text)
