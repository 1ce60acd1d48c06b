"""The style of all figures, and the classes of figures and axes that have it.

Figures are drawn without display. The style holds within them only: the parameters of Matplotlib stay as the user set
them.
"""

from __future__ import annotations

import re
import warnings
from collections.abc import Callable
from functools import wraps
from io import BytesIO
from typing import Any, ParamSpec, TypeVar

from cycler import cycler
from matplotlib import rc_context, rcParamsDefault
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import ScalarFormatter

from meltemi.report.palette import COLOURS, GRID, INK, SOFT

P = ParamSpec("P")
R = TypeVar("R")
THIN = "\u2009"
"""Thin space between thousands."""
MINUS = "\u2212"
"""Sign of negative numbers."""
STYLE: dict[str, Any] = {
    **{name: rcParamsDefault[name] for name in ("font.family", "font.sans-serif", "mathtext.fontset", "text.usetex")},
    "font.size": 9.0,
    "axes.labelsize": 8.5,
    "xtick.labelsize": 8.0,
    "ytick.labelsize": 8.0,
    "axes.titlesize": 9.0,
    "axes.titlelocation": "left",
    "axes.titlepad": 4.0,
    "axes.titlecolor": INK,
    "text.color": INK,
    "axes.labelcolor": INK,
    "axes.edgecolor": SOFT,
    "axes.linewidth": 0.8,
    "xtick.color": SOFT,
    "ytick.color": SOFT,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.axisbelow": True,
    "axes.grid": True,
    "axes.grid.axis": "both",
    "axes.grid.which": "major",
    "grid.color": GRID,
    "grid.linewidth": 0.6,
    "grid.linestyle": "-",
    "grid.alpha": 1.0,
    "axes.prop_cycle": cycler(color=COLOURS),
    "lines.linewidth": 1.3,
    "lines.markersize": 4.5,
    "axes.formatter.useoffset": False,
    "axes.unicode_minus": True,
    "axes.formatter.use_mathtext": False,
    "axes.formatter.limits": (-4, 8),
    "legend.fontsize": 8.0,
    "legend.title_fontsize": 8.0,
    "legend.frameon": True,
    "legend.framealpha": 0.85,
    "legend.edgecolor": "none",
    "legend.facecolor": "white",
    "legend.fancybox": False,
    "legend.labelcolor": INK,
    "figure.titlesize": 10.5,
    "figure.titleweight": "bold",
    "figure.dpi": 100.0,
    "savefig.dpi": 130.0,
    "figure.facecolor": "white",
    "axes.facecolor": "white",
    "savefig.facecolor": "white",
    "figure.constrained_layout.h_pad": 0.05,
    "figure.constrained_layout.w_pad": 0.05,
}
"""Parameters of Matplotlib."""


def grouped(text: str) -> str:
    """A number with thin spaces between its thousands, if it has at least five digits before the point."""
    return re.sub(r"(?<![\d.])\d{5,}", lambda match: f"{int(match[0]):,}".replace(",", THIN), text, count=1)


class Thousands(ScalarFormatter):
    """Numbers at the ticks of a linear axis, their thousands apart."""

    def __call__(self, x: float, pos: int | None = None) -> str:
        return grouped(super().__call__(x, pos))


def _styled(method: Callable[P, R]) -> Callable[P, R]:
    """The method with the style in force while it runs."""

    @wraps(method)
    def within(*arguments: P.args, **keywords: P.kwargs) -> R:
        with rc_context(STYLE), warnings.catch_warnings():  # type: ignore[arg-type]
            warnings.filterwarnings("ignore", "Glyph .* missing from font")  # names may be in any script
            return method(*arguments, **keywords)

    return within


def style(ax: Axes) -> None:
    """Apply the style to axes, of a caller's figure too: light grid, two spines, thousands apart."""
    ax.grid(True, color=GRID, linewidth=0.6)
    ax.set_axisbelow(True)
    ax.tick_params(which="both", labelsize=STYLE["xtick.labelsize"], color=SOFT, labelcolor=INK)
    for side in ("top", "right"):
        ax.spines[side].set_visible(False)
    for axis in (ax.xaxis, ax.yaxis):
        if type(axis.get_major_formatter()) is ScalarFormatter:
            default, formatter = axis.isDefault_majfmt, Thousands(useOffset=False)
            axis.set_major_formatter(formatter)
            axis.isDefault_majfmt = default


class StyledAxes(Axes):
    """Axes with the style."""

    @_styled
    def clear(self) -> None:
        super().clear()
        style(self)

    def imshow(self, *arguments: Any, **keywords: Any) -> Any:
        self.grid(False)
        return super().imshow(*arguments, **keywords)

    def pcolormesh(self, *arguments: Any, **keywords: Any) -> Any:
        self.grid(False)
        return super().pcolormesh(*arguments, **keywords)

    def twinx(self, *arguments: Any, **keywords: Any) -> Any:
        twin = super().twinx(*arguments, **keywords)
        twin.grid(False)
        twin.spines["right"].set_visible(True)
        return twin

    plot = _styled(Axes.plot)
    legend = _styled(Axes.legend)  # type: ignore[assignment]
    set_title = _styled(Axes.set_title)


class ShownFigure(Figure):
    """A figure with the style, without display or global state, shown as an image in notebooks."""

    @_styled
    def __init__(self, *arguments: Any, **keywords: Any) -> None:
        super().__init__(*arguments, **keywords)
        FigureCanvasAgg(self)

    @_styled
    def add_subplot(self, *arguments: Any, **keywords: Any) -> Any:
        return super().add_subplot(*arguments, **({"axes_class": StyledAxes} | keywords))

    @_styled
    def add_axes(self, *arguments: Any, **keywords: Any) -> Any:
        return super().add_axes(*arguments, **({"axes_class": StyledAxes} | keywords))

    @_styled
    def suptitle(self, *arguments: Any, **keywords: Any) -> Any:
        keywords.setdefault("x", 0.01)
        keywords.setdefault("ha", "left")
        return super().suptitle(*arguments, **keywords)

    colorbar = _styled(Figure.colorbar)
    draw = _styled(Figure.draw)
    legend = _styled(Figure.legend)  # type: ignore[assignment]

    def _repr_png_(self) -> bytes:
        file = BytesIO()
        self.savefig(file, format="png", dpi=100)
        return file.getvalue()
