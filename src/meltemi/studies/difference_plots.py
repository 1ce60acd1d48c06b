"""Plots and tables of the differences of two results."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from meltemi.report.palette import COLOURS, FAINT, INK
from meltemi.report.plots import MAIN_CHANNELS, heading, new_figure, readable_unit
from meltemi.report.tables import number
from meltemi.studies.difference import ChannelDifference, ResultDifferences, gaps, most_different, percent_text

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PANELS = 8
"""Channels of a plot that names none."""
ZOOM = 20.0
"""[s] shown around the worst instant, or a fifth of shorter results."""


def difference_rows(differences: ResultDifferences, labels: tuple[str, str]) -> tuple[list[str], list[list[str]]]:
    """Header and rows of all differences in engineering units, one row per channel."""
    each = [f"{what} {label}" for what in ("mean", "std", "DEL 1 Hz") for label in labels]
    changes = ["mean %", "std %", "DEL %"]
    head = ["channel", "OpenFAST", "unit", *each, *changes, "correlation", "rms / std", "worst", "at s"]
    rows = []
    for d in differences.channels:
        unit, factor = d.channel.display_unit
        values = [number(v * factor) for pair in (d.mean, d.std, d.load) for v in pair]
        rows.append([d.channel.name, d.channel.alias, unit, *values, *_closeness(d), number(d.worst * factor)])
        rows[-1].append(f"{d.worst_time:g}")
    return head, rows


def short_difference_rows(differences: ResultDifferences) -> tuple[list[str], list[list[str]]]:
    """Shortened :func:`difference_rows` for a terminal: values of the second result, and changes."""
    head = ["channel", "unit", "mean", "%", "std", "%", "DEL", "%", "corr.", "rms/std", "worst", "at s"]
    rows = []
    for d in differences.channels:
        unit, factor = d.channel.display_unit
        mean, std, load, correlation, distance = _closeness(d)
        values = (number(pair[1] * factor) for pair in (d.mean, d.std, d.load))
        pairs = [text for both in zip(values, (mean, std, load), strict=True) for text in both]
        name = d.channel.alias or d.channel.name
        worst = number(d.worst * factor)
        rows.append([name, unit, *pairs, correlation, distance, worst, f"{d.worst_time:g}"])
    return head, rows


def _closeness(d: ChannelDifference) -> list[str]:
    """Changes of mean, standard deviation and load [%]; correlation; normalised rms difference."""
    changes = [percent_text(v) for v in (d.mean_change, d.std_change, d.load_change)]
    return [*changes, "-" if np.isnan(d.correlation) else f"{d.correlation:.5f}", _fixed(d.distance)]


def _fixed(value: float) -> str:
    return "-" if np.isnan(value) else f"{value:.4f}"


def plot_differences(
    differences: ResultDifferences, channels: Sequence[str] | None = None, *, labels: tuple[str, str]
) -> Figure:
    """Plot both results over the whole time and around the largest difference, and the difference, per channel.

    Args:
      differences: differences of two results.
      channels: channels to plot; by default the main ones, and the most different of the others.
      labels: labels of the first and the second result.

    Raises:
      InputError: a channel was not compared.
    """
    from meltemi.report.figure import MINUS, grouped

    shown = [_entry(differences, name) for name in channels] if channels else _chosen(differences)
    figure, axes = new_figure(len(shown), 3, size=(15.0, 1.5 * len(shown) + 0.9), share=False)
    time = differences.second.time
    half = 0.5 * min(ZOOM, 0.2 * float(time[-1] - time[0]))
    for (whole, zoom, gap), d in zip(axes, shown, strict=True):
        i = differences.channels.index(d)
        x, y = (result.data[:, i] for result in (differences.first, differences.second))
        unit, factor = readable_unit(d.channel, x, y)
        x, y = factor * x, factor * y
        near = np.abs(time - np.clip(d.worst_time, time[0] + half, time[-1] - half)) <= half
        for ax, part, thick, thin in ((whole, slice(None), 0.9, 0.6), (zoom, near, 2.4, 1.0)):
            ax.plot(time[part], y[part], color=COLOURS[1], linewidth=thick, label=labels[1])
            ax.plot(time[part], x[part], color=COLOURS[0], linewidth=thin, label=labels[0])
        gap.plot(time, gaps(d.channel, *differences.of(i)) * factor, color=INK, linewidth=0.6)
        for ax in (whole, gap):
            ax.axvspan(time[near][0], time[near][-1], color=FAINT, alpha=0.18, linewidth=0.0)
        zoom.axvline(d.worst_time, color=INK, linewidth=0.8, linestyle=":")
        worst = f"worst {grouped(number(d.worst * factor))} {unit.strip('-')}".strip() + f" at {d.worst_time:g} s"
        worst = worst.replace("-", MINUS)
        changes = f"mean {percent_text(d.mean_change)} %, std {percent_text(d.std_change)} %".replace("-", MINUS)
        changes += f", rms/std {_fixed(d.distance)}"
        for ax, text in ((whole, d.channel.name.replace("_", " ")), (zoom, worst), (gap, f"difference: {changes}")):
            heading(ax, text, size=9 if ax is whole else 8)
            ax.tick_params(labelsize=7)
            ax.margins(x=0.01)
        whole.set_ylabel(f"[{unit}]")
    for ax in axes[-1]:
        ax.set_xlabel("time [s]")
    figure.align_ylabels(axes[:, 0])
    handles, names = axes[0, 0].get_legend_handles_labels()
    legend = figure.legend(handles[::-1], names[::-1], loc="outside upper center", ncols=2)
    for line in legend.get_lines():
        line.set_linewidth(2.0)
    return figure


def _chosen(differences: ResultDifferences) -> list[ChannelDifference]:
    wanted = [d for name in MAIN_CHANNELS for d in differences.channels if d.channel.name == name]
    others = [d for d in most_different(differences, len(differences.channels)) if d not in wanted]
    return [*wanted, *others[: PANELS - len(wanted)]] or list(differences.channels[:PANELS])


def _entry(differences: ResultDifferences, name: str) -> ChannelDifference:
    channel = differences.first.channel(name.partition("=")[0].strip())
    return differences.channels[differences.first.channels.index(channel)]
