"""Figures of response amplitude operators and of the fitted radiation."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from meltemi.floating.radiation import kernel
from meltemi.report.palette import COLOURS, FAINT
from meltemi.report.plots import heading, new_figure, panel

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from meltemi.floating.potential import HydroCoefficients
    from meltemi.floating.radiation import Radiation
    from meltemi.floating.rao import Operators

COHERENT = 0.6
"""Least coherence of the points of a run that are drawn."""
LOWEST, HIGHEST = 1e-2, 1e2
"""Widest limits of the axis of a channel, over its usual amplitude."""
LONGEST, SHOWN = 40.0, {"surge": 0, "heave": 2, "pitch": 4, "yaw": 5}
"""[s] length of the kernels of the radiation that are drawn."""


def plot_operators(title: str, methods: Sequence[tuple[str, Operators, Any]]) -> Figure:
    """Amplitudes over frequency: lines of the linear model, dots of a run where waves and response are coherent.

    Both axes are logarithmic, so that the range of the waves and the resonances are both seen; dotted lines mark these.
    An undamped resonance of the linear model, which has no drag about rest, is higher than the axes. Motions that
    symmetry makes negligible are left out, and named.
    """
    first = methods[0][1]
    silent = first.silent()
    names = [name for name in first.channels if name not in silent]
    figure, axes = new_figure(len(names), size=(9.0, 1.7 * len(names) + 1.0), share=True)
    for ax, name in zip(axes[:, 0], names, strict=True):
        k = first.channels.index(name)
        unit, factor = first.readable[k]
        for label, each, coherence in methods:
            f, size = each.frequency / (2.0 * np.pi), np.abs(each.value[:, k]) * factor
            if coherence is None:
                ax.plot(f, size, color=COLOURS[0], lw=1.0, label=label)
            else:
                some = coherence[:, k] >= COHERENT
                ax.plot(f[some], size[some], ".", color=COLOURS[1], ms=3.5, label=label)
        for i, (w, _) in enumerate(first.resonances):
            label = "_" * (i > 0) + "resonances"
            ax.axvline(w / (2.0 * np.pi), color=FAINT, lw=0.7, ls=":", zorder=0.5, label=label)
        usual = float(first.usual()[k]) * factor or 1.0
        top = min(HIGHEST * usual, max(float(np.abs(first.value[:, k]).max()) * factor, usual))
        ax.set(xscale="log", yscale="log", ylim=(LOWEST * usual, 2.0 * top))
        panel(ax, shown_name(name), f"{unit}/m")
    axes[0, 0].legend(loc="upper right", fontsize="small")
    axes[-1, 0].set_xlim(first.frequency[0] / (2.0 * np.pi), first.frequency[-1] / (2.0 * np.pi))
    left_out = f"; negligible: {', '.join(map(shown_name, silent))}" if silent else ""
    axes[-1, 0].set_xlabel(f"frequency [Hz]{left_out}")
    heading(axes[0, 0], title, "right")
    return figure


def shown_name(channel: str) -> str:
    """Text for a channel."""
    return channel.removeprefix("platform_").replace("_", " ")


def plot_radiation(title: str, c: HydroCoefficients, fit: Radiation) -> Figure:
    """Kernels of the radiation over their first value: of the coefficients, for a convolution, and of oscillations."""
    t = np.linspace(0.0, LONGEST, 301)
    exact, fitted = kernel(c, t), fit.kernel(t)
    figure, axes = new_figure(len(SHOWN), size=(9.0, 1.6 * len(SHOWN) + 1.0), share=True)
    for ax, (name, i) in zip(axes[:, 0], SHOWN.items(), strict=True):
        first = np.abs(exact[:, i, i]).max() or 1.0
        ax.plot(t, exact[:, i, i] / first, ".", color=COLOURS[1], ms=3.5, label="coefficients")
        ax.plot(t, fitted[:, i, i] / first, color=COLOURS[0], lw=1.0, label="oscillations")
        panel(ax, name, "-")
    axes[0, 0].legend(loc="upper right", fontsize="small")
    axes[-1, 0].set_xlabel("time [s]")
    heading(axes[0, 0], f"{title}: radiation, {fit.words}", "right")
    return figure
