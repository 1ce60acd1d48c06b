"""Figure of the capture matrix."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.colors import LinearSegmentedColormap
from numpy.typing import NDArray

from meltemi.report.palette import COLOURS, INK
from meltemi.report.plots import figure_title, new_figure
from meltemi.validation.selection import SPEED_LABELS, TURBULENCE_LABELS

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def plot_capture_matrix(matrix: NDArray[np.intp], what: str = "") -> Figure:
    """Numbers of records over wind speed and turbulence intensity.

    Args:
      matrix: from :func:`meltemi.validation.selection.capture_matrix`.
      what: of the title, such as the class of operation.
    """
    figure, axes = new_figure(1, size=(9.0, 4.8))
    ax = axes[0, 0]
    colours = LinearSegmentedColormap.from_list("records", ["#ffffff", COLOURS[3]])
    ax.pcolormesh(matrix, cmap=colours, vmin=0, vmax=max(int(matrix.max(initial=0)), 1), edgecolors="white")
    for i, j in zip(*np.nonzero(matrix), strict=True):
        ax.text(j + 0.5, i + 0.5, str(matrix[i, j]), ha="center", va="center", color=INK, fontsize=8.0)
    ax.set_xticks(np.arange(matrix.shape[1]) + 0.5, SPEED_LABELS, fontsize=7.0)
    ax.set_yticks(np.arange(matrix.shape[0]) + 0.5, TURBULENCE_LABELS, fontsize=7.0)
    ax.set_xlabel("wind speed [m/s]")
    ax.set_ylabel("turbulence intensity [%]")
    figure_title(figure, f"Capture matrix: {int(matrix.sum())} records", f", {what}" if what else "")
    return figure
