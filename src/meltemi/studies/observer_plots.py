"""Plot of an observer's estimate, and its tables."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from meltemi.postprocess.fatigue import equivalent_loads
from meltemi.report.palette import COLOURS, INK
from meltemi.report.plots import ABOVE, figure_title, new_figure, panel, readable_unit
from meltemi.report.tables import number
from meltemi.simulation.result import Result
from meltemi.studies.observer import Estimate

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SHOWN = (
    "rotor_effective_wind",
    "tower_base_moment_fore_aft",
    "tower_base_moment_side_side",
    "root_moment_out_of_plane_1",
    "root_moment_in_plane_1",
)
BAND = 1.645
"""Standard deviations of a band that contains 90 % of a normal distribution."""


def plot_estimate(estimate: Estimate, measured: Result | None = None) -> Figure:
    """Plot wind and loads with bands of 90 %, and those of a result beside them.

    Args:
      estimate: of an observer.
      measured: result with the same loads, where they are known.
    """
    found = estimate.result
    figure, axes = new_figure(len(SHOWN), size=(9.0, 9.5))
    for ax, name in zip(axes[:, 0], SHOWN, strict=True):
        channel = found.channel(name)
        unit, factor = readable_unit(channel, found[name])
        x, wide = found[name] * factor, BAND * factor * estimate.deviation[:, found.names.index(channel.name)]
        ax.fill_between(found.time, x - wide, x + wide, color=COLOURS[0], alpha=0.25, linewidth=0, label="90 % band")
        ax.plot(found.time, x, color=COLOURS[0], linewidth=1.0, label="estimate")
        if measured is not None and name in measured:
            ax.plot(measured.time, measured[name] * factor, color=INK, linewidth=0.8, label="in the file")
        panel(ax, channel.name.replace("_", " "), unit, "time [s]" if name == SHOWN[-1] else "")
        ax.set_xlim(found.time[0], found.time[-1])
    axes[0, 0].legend(handles=axes[1, 0].get_legend_handles_labels()[0], ncols=3, **ABOVE)
    figure_title(figure, f"{found.meta.get('turbine', '')}: wind and loads estimated from signals".strip(": "))
    return figure


def estimate_rows(estimate: Estimate) -> tuple[list[str], list[list[str]]]:
    """Header and rows of the series: each channel in SI units, and the standard deviation of its error."""
    found = estimate.result
    head, columns = ["time [s]"], [found.time]
    for i, channel in enumerate(found.channels):
        head += [f"{channel.name} [{channel.unit}]", f"{channel.name} deviation [{channel.unit}]"]
        columns += [found.data[:, i], estimate.deviation[:, i]]
    return head, [[f"{value:.9g}" for value in row] for row in np.column_stack(columns)]


def load_rows(estimate: Estimate, measured: Result | None = None) -> tuple[list[str], list[list[str]]]:
    """Header and rows of the damage-equivalent loads.

    That of the estimate alone lacks what the signals do not show; the mean over the samples contains it, and 90 % of
    the samples are between the last two columns.
    """
    found = estimate.result
    alone = equivalent_loads(found)
    drawn = [equivalent_loads(sample) for sample in estimate.samples]
    shared = [name for name in alone if measured is not None and name in measured]
    own = equivalent_loads(measured, shared) if measured is not None and shared else {}
    head = ["load", "unit", "estimate", "expected", "5 %", "95 %", *(["in the file"] if own else [])]
    rows = []
    for name, value in alone.items():
        unit, factor = found.channel(name).display_unit
        some = np.array([d[name] for d in drawn]) * factor if drawn else np.array([np.nan])
        cells = [value * factor, some.mean(), *np.quantile(some, [0.05, 0.95])]
        cells += [own.get(name, np.nan) * factor] if own else []
        rows.append([name, unit, *(number(float(cell)) for cell in cells)])
    return head, rows
