"""Figures of stacked time-series panels, described as data."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from meltemi.report.palette import COLOURS
from meltemi.report.plots import ABOVE, new_figure, panel
from meltemi.simulation.result import Result

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Float = NDArray[np.float64]
Panel = tuple[str, str, Callable[[Result], Float]]
"""Title, unit, and what is drawn of a result."""


def channel(name: str, factor: float = 1.0) -> Callable[[Result], Float]:
    """A channel in another unit."""
    return lambda result: result[name] * factor


def series(panels: Sequence[Panel], results: Mapping[str, Result], *, height: float, rest: float) -> Figure:
    """Panels of a height [in], one curve for each result; ``rest`` [in] is for legend and labels."""
    figure, axes = new_figure(len(panels), size=(9.0, height * len(panels) + rest))
    for ax, (title, unit, of) in zip(axes[:, 0], panels, strict=True):
        for colour, (name, result) in zip(COLOURS, results.items(), strict=False):
            ax.plot(result.time, of(result), color=colour, linewidth=1.0, label=name)
        panel(ax, title, unit)
    axes[0, 0].legend(ncols=len(results), **ABOVE)
    axes[-1, 0].set_xlabel("time [s]")
    return figure
