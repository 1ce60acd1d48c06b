"""Charts of reports as figures, for documents that have no script."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np
from matplotlib.figure import Figure

from meltemi.report.figure import ShownFigure
from meltemi.report.palette import COLOURS
from meltemi.report.plots import new_figure
from meltemi.reports.blocks import Axis, Chart, Curve, Statistics

CHARTS_PER_FIGURE = 9
"""Charts in a figure."""


def chart_figure(chart: Chart) -> Figure:
    """A chart as a figure."""
    if not chart.polar:
        figure, axes = new_figure(1, size=(6.0, 3.0))
        _draw(axes[0, 0], chart)
        return figure
    figure = Figure(figsize=(3.6, 3.6), layout="constrained")
    ax = figure.add_subplot(projection="polar")
    for i, c in enumerate(chart.curves):
        angles, values = np.radians(np.asarray(c.x, dtype=float)), np.asarray(c.y, dtype=float)
        ax.plot(np.append(angles, angles[:1]), np.append(values, values[:1]), color=_colour(c, i), label=c.name)
    if chart.y.start is not None:
        ax.set_ylim(bottom=chart.y.start)
    ax.set_title(f"{chart.title}, {chart.y}", fontsize=8.0, loc="left")
    ax.tick_params(labelsize=7.0)
    if len(chart.curves) > 1:
        figure.legend(loc="outside lower center", ncols=4, fontsize=7.0)
    return figure


def _colour(curve: Curve, place: int) -> str:
    return COLOURS[(place if curve.colour is None else curve.colour) % len(COLOURS)]


def _draw(ax: object, chart: Chart) -> None:
    from matplotlib.axes import Axes

    assert isinstance(ax, Axes)
    for i, c in enumerate(chart.curves):
        x, y, colour = np.asarray(c.x, dtype=float), np.asarray(c.y, dtype=float), _colour(c, i)
        if c.upper is not None:
            ax.fill_between(x, y, np.asarray(c.upper, dtype=float), color=colour, alpha=0.18, linewidth=0.0)
        elif c.dots:
            ax.plot(x, y, "o", color=colour, markersize=2.5, alpha=0.65, label=c.name)
        else:
            ax.plot(x, y, "--" if c.dash else "-", color=colour, label=c.name)
    for axis, scale, limit in ((chart.x, ax.set_xscale, ax.set_xlim), (chart.y, ax.set_yscale, ax.set_ylim)):
        if axis.log:
            scale("log")
        elif axis.start is not None:
            low, high = limit()
            limit(min(low, axis.start), high)
    ax.set(xlabel=str(chart.x), ylabel=str(chart.y), title=chart.title)
    if len(chart.curves) > 1:
        ax.legend(fontsize=6.0)


def grid_figures(charts: Sequence[Chart]) -> Iterator[Figure]:
    """Charts with straight axes, nine in a figure."""
    for at in range(0, len(charts), CHARTS_PER_FIGURE):
        batch = charts[at : at + CHARTS_PER_FIGURE]
        rows = math.ceil(len(batch) / 3)
        figure = ShownFigure(figsize=(10.5, 2.2 * rows))  # laid out by hand: constrained layout takes twice the time
        axes = figure.subplots(rows, 3, squeeze=False)
        figure.subplots_adjust(0.06, 0.24 / rows, 0.99, 1.0 - 0.12 / rows, wspace=0.25, hspace=0.65)
        for ax, chart in zip(axes.flat, batch, strict=False):
            _draw(ax, chart)
        for ax in list(axes.flat)[len(batch) :]:
            ax.set_axis_off()
        yield figure


def statistics_charts(block: Statistics) -> Iterator[Chart]:
    """A chart of each channel."""
    for name in block.labels("channels"):
        curves, unit = [], ""
        for base in block.bases:
            wind = base["across"][0]["values"]
            for channel in (each for each in base["channels"] if each["label"] == name):
                unit = channel["unit"]
                values = np.concatenate((channel["max"], channel["min"]))
                curves.append(Curve(base["name"], [*wind, *wind], values, dots=True))
        yield Chart(name, Axis("wind speed", "m/s"), Axis("", unit), curves)
