"""Plot and tables of an observer's estimate."""

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
    """Plot wind and loads with 90 % bands, and those of a measured result.

    Args:
      estimate: estimate of an observer.
      measured: result with the same loads, if available.
    """
    estimated = estimate.result
    figure, axes = new_figure(len(SHOWN), size=(9.0, 9.5))
    for ax, name in zip(axes[:, 0], SHOWN, strict=True):
        channel = estimated.channel(name)
        unit, factor = readable_unit(channel, estimated[name])
        x, wide = estimated[name] * factor, BAND * factor * estimate.deviation[:, estimated.names.index(channel.name)]
        ax.fill_between(
            estimated.time, x - wide, x + wide, color=COLOURS[0], alpha=0.25, linewidth=0, label="90 % band"
        )
        ax.plot(estimated.time, x, color=COLOURS[0], linewidth=1.0, label="estimate")
        if measured is not None and name in measured:
            ax.plot(measured.time, measured[name] * factor, color=INK, linewidth=0.8, label="in the file")
        panel(ax, channel.name.replace("_", " "), unit, "time [s]" if name == SHOWN[-1] else "")
        ax.set_xlim(estimated.time[0], estimated.time[-1])
    axes[0, 0].legend(handles=axes[1, 0].get_legend_handles_labels()[0], ncols=3, **ABOVE)
    figure_title(figure, f"{estimated.meta.get('turbine', '')}: wind and loads estimated from signals".strip(": "))
    return figure


def estimate_rows(estimate: Estimate) -> tuple[list[str], list[list[str]]]:
    """Header and rows of the series: each channel in SI units, and the standard deviation of its error."""
    estimated = estimate.result
    head, columns = ["time [s]"], [estimated.time]
    for i, channel in enumerate(estimated.channels):
        head += [f"{channel.name} [{channel.unit}]", f"{channel.name} deviation [{channel.unit}]"]
        columns += [estimated.data[:, i], estimate.deviation[:, i]]
    return head, [[f"{value:.9g}" for value in row] for row in np.column_stack(columns)]


def load_rows(estimate: Estimate, measured: Result | None = None) -> tuple[list[str], list[list[str]]]:
    """Header and rows of the damage-equivalent loads.

    The load of the estimate lacks components that the signals do not contain; the mean over the samples includes them,
    and 90 % of the samples are between the last two columns.
    """
    estimated = estimate.result
    alone = equivalent_loads(estimated)
    samples = [equivalent_loads(sample) for sample in estimate.samples]
    shared = [name for name in alone if measured is not None and name in measured]
    measured_loads = equivalent_loads(measured, shared) if measured is not None and shared else {}
    head = ["load", "unit", "estimate", "expected", "5 %", "95 %", *(["in the file"] if measured_loads else [])]
    rows = []
    for name, value in alone.items():
        unit, factor = estimated.channel(name).display_unit
        some = np.array([d[name] for d in samples]) * factor if samples else np.array([np.nan])
        cells = [value * factor, some.mean(), *np.quantile(some, [0.05, 0.95])]
        cells += [measured_loads.get(name, np.nan) * factor] if measured_loads else []
        rows.append([name, unit, *(number(float(cell)) for cell in cells)])
    return head, rows
