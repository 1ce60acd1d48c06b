"""Colours, legends and labels of the figures."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MEGA = 1e-6


def shades(n: int) -> list[Any]:
    """Colours of n curves in order, from dark to light, readable on white."""
    from matplotlib import colormaps

    return [colormaps["viridis"](0.88 * i / max(n - 1, 1)) for i in range(n)]


def beside(ax: Axes, title: str = "") -> None:
    """Draw a legend to the right of the panel."""
    ax.legend(title=title, loc="center left", bbox_to_anchor=(1.0, 0.5))


def label(ax: Axes, x: str, y: str, title: str = "") -> None:
    """Label the axes with units and give the panel a title."""
    ax.set_xlabel(x)
    ax.set_ylabel(y)
    ax.tick_params(which="both", labelsize=8)  # an axis of less than a decade needs labels at minor ticks
    if title:
        ax.set_title(title)
