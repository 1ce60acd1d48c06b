"""Figures of response amplitude operators and of the fitted radiation."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from meltemi.report.palette import COLOURS
from meltemi.report.plots import heading, new_figure, panel
from meltemi_float.radiation import kernel

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from meltemi_float.potential import Coefficients
    from meltemi_float.radiation import Radiation
    from meltemi_float.rao import Operators

COHERENT = 0.6
"""Least coherence of the points of a run that are drawn."""
LONGEST, SHOWN = 40.0, {"surge": 0, "heave": 2, "pitch": 4, "yaw": 5}
"""[s] of the kernels of the radiation that are drawn."""


def plot_operators(title: str, found: Sequence[tuple[str, Operators, Any]]) -> Figure:
    """Amplitudes over frequency: lines of the linear model, dots of a run where waves and response are coherent."""
    names = found[0][1].channels
    figure, axes = new_figure(len(names), size=(9.0, 1.6 * len(names) + 1.0), share=True)
    for i, (name, (unit, factor)) in enumerate(zip(names, found[0][1].shown, strict=True)):
        ax = axes[i, 0]
        for label, each, coherence in found:
            f, size = each.frequency / (2.0 * np.pi), np.abs(each.value[:, i]) * factor
            if coherence is None:
                ax.plot(f, size, color=COLOURS[0], lw=1.0, label=label)
            else:
                some = coherence[:, i] >= COHERENT
                ax.plot(f[some], size[some], ".", color=COLOURS[1], ms=3.5, label=label)
        top = max(float(np.abs(found[0][1].value[found[0][1].frequency > 0.25, i]).max()), 1e-9)
        ax.set_ylim(0.0, 1.3 * top * factor)
        panel(ax, name.removeprefix("platform_").replace("_", " "), f"{unit}/m")
    axes[0, 0].legend(loc="upper right", fontsize="small")
    axes[-1, 0].set_xlim(0.0, 0.32)
    axes[-1, 0].set_xlabel("frequency [Hz]")
    heading(axes[0, 0], title, "right")
    return figure


def plot_radiation(title: str, c: Coefficients, fit: Radiation) -> Figure:
    """Kernels of the radiation over their first value: of the coefficients, for a convolution, and of oscillations."""
    t = np.linspace(0.0, LONGEST, 301)
    exact, found = kernel(c, t), fit.kernel(t)
    figure, axes = new_figure(len(SHOWN), size=(9.0, 1.6 * len(SHOWN) + 1.0), share=True)
    for ax, (name, i) in zip(axes[:, 0], SHOWN.items(), strict=True):
        first = np.abs(exact[:, i, i]).max() or 1.0
        ax.plot(t, exact[:, i, i] / first, ".", color=COLOURS[1], ms=3.5, label="coefficients")
        ax.plot(t, found[:, i, i] / first, color=COLOURS[0], lw=1.0, label="oscillations")
        panel(ax, name, "-")
    axes[0, 0].legend(loc="upper right", fontsize="small")
    axes[-1, 0].set_xlabel("time [s]")
    heading(axes[0, 0], f"{title}: radiation, {fit.words}", "right")
    return figure
