"""Bar charts of changes relative to the first scheme, with confidence intervals."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from meltemi.core.errors import InputError
from meltemi.report.palette import COLOURS, INK
from meltemi.report.plots import new_figure, panel
from meltemi.reports.ensemble_tables import change_bar, half_bar

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from meltemi.postprocess.ensemble import EnsembleTable

GROUP_WIDTH = 0.8
"""Total width of the bars over the distance between groups."""
LEGEND_SPACE = 0.2
"""Space for the legend above the bars, over the height of the axes."""


def plot_changes(
    table: EnsembleTable,
    quantities: Sequence[str],
    absolute: Sequence[str] = (),
    units: Mapping[str, tuple[str, float]] | None = None,
    operation: Sequence[str] = (),
) -> Figure:
    """Plot changes relative to the first scheme in percent, and absolute values of some quantities.

    Args:
      table: table of an ensemble.
      quantities: quantities whose changes are drawn.
      absolute: quantities drawn as values of the schemes, such as the travel of actuators, whose change may be hundreds
        of percent, or relative to zero.
      units: unit and factor to it by quantity; those of ``absolute`` must have the same.
      operation: quantities whose changes are drawn in a separate panel, such as power and speed beside loads.

    Raises:
      InputError: there is no second scheme, or a quantity is not in the table.
    """
    base, *others = table.schemes
    if not others:
        raise InputError("plot_changes: there is nothing to compare with the first scheme")
    colour = {scheme: COLOURS[i % len(COLOURS)] for i, scheme in enumerate(table.schemes)}
    title = f"change against {base}, mean over seeds and its {100.0 * table.confidence:g} % interval"
    main, beside = _panels(len(quantities), [len(names) for names in (operation, absolute) if names], bool(operation))
    _changes(main, table, quantities, colour, f"loads: {title}" if operation else title)
    if operation:
        _changes(beside.pop(0), table, operation, colour, "power and speed: change")
    if absolute:
        unit, factor = (units or {}).get(absolute[0], ("-", 1.0))
        values = {
            s: [(factor * e.mean, half_bar(e, factor)) for e in (table.entry(q, s).value for q in absolute)]
            for s in table.schemes
        }
        _bars(beside[0], absolute, values, colour)
        _finish(beside[0], "actuator travel", unit)
    return main.figure


def _panels(main: int, beside: Sequence[int], below: bool) -> tuple[Any, list[Any]]:
    """Axes of the main quantities and of others, beside them or below, with widths by the numbers of quantities."""
    figure = new_figure(1, size=(12.0, 8.0 if below else 4.4))[0]
    figure.clear()
    if below:
        rows = figure.add_gridspec(2, 1)
        second = rows[1].subgridspec(1, len(beside), width_ratios=beside)
        return figure.add_subplot(rows[0]), [figure.add_subplot(second[0, i]) for i in range(len(beside))]
    grid = figure.add_gridspec(1, 1 + len(beside), width_ratios=[max(main, 1), *(1.5 * n for n in beside)])
    return figure.add_subplot(grid[0, 0]), [figure.add_subplot(grid[0, i + 1]) for i in range(len(beside))]


def _changes(ax: Axes, table: EnsembleTable, quantities: Sequence[str], colour: Mapping[str, str], title: str) -> None:
    """Bars of the changes [%] of quantities against the first scheme."""
    others = table.schemes[1:]
    changes = {s: [table.entry(q, s).change for q in quantities] for s in others}
    bars = {s: [change_bar(c) for c in changes[s]] for s in others}
    _bars(ax, quantities, bars, colour)
    ax.axhline(0.0, color=INK, linewidth=0.9)
    _finish(ax, title, "%")


def _finish(ax: Axes, title: str, unit: str) -> None:
    panel(ax, title, unit)
    ax.grid(False, axis="x")
    low, high = ax.get_ylim()
    ax.set_ylim(low, high + LEGEND_SPACE * (high - low))
    ax.legend(loc="upper right", ncols=3)


def _bars(
    ax: Axes, names: Sequence[str], bars: Mapping[str, Sequence[tuple[float, float]]], colour: Mapping[str, str]
) -> None:
    width = GROUP_WIDTH / len(bars)
    for i, (scheme, pairs) in enumerate(bars.items()):
        x = np.arange(len(names)) + (i - 0.5 * (len(bars) - 1)) * width
        mean, half = np.array(pairs).reshape(-1, 2).T
        error = None if np.all(np.isnan(half)) else np.nan_to_num(half)
        bar: dict[str, Any] = {"ecolor": INK, "capsize": 2.0, "error_kw": {"linewidth": 0.9}}
        ax.bar(x, mean, 0.94 * width, yerr=error, label=scheme, color=colour[scheme], **bar)
    ax.set_xticks(range(len(names)), [name.replace(" ", "\n", 1) for name in names])
