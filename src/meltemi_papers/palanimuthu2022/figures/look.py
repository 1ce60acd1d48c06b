"""Colours, legends and labels of the figures."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from meltemi.report.plots import style

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MEGA = 1e-6


def shades(n: int) -> list[Any]:
    """Colours of n curves in order, from dark to light, readable on white."""
    from matplotlib import colormaps

    return [colormaps["viridis"](0.88 * i / max(n - 1, 1)) for i in range(n)]


def beside(ax: Axes, title: str = "") -> None:
    """A legend to the right of the panel."""
    ax.legend(title=title, fontsize=7, title_fontsize=7, loc="center left", bbox_to_anchor=(1.0, 0.5), frameon=False)


def label(ax: Axes, x: str, y: str, title: str = "") -> None:
    """Label the axes with units and give the panel a title."""
    ax.set_xlabel(x, fontsize=8)
    ax.set_ylabel(y, fontsize=8)
    ax.tick_params(which="both", labelsize=8)  # an axis of less than a decade labels its minor ticks
    if title:
        ax.set_title(title, fontsize=9, loc="left", pad=3)
    style(ax)
