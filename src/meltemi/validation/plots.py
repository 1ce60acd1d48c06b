"""Figures of a validation: capture matrix, agreement, spectra, power curve."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from matplotlib.colors import LinearSegmentedColormap
from numpy.typing import NDArray

from meltemi.report.palette import COLOURS, INK
from meltemi.report.plots import figure_title, new_figure, panel, readable_unit
from meltemi.validation.channel_map import known_channel
from meltemi.validation.comparison import CONFIDENCE, Comparison, mean_of_known, power_curve, prediction_half
from meltemi.validation.reduction import BANDS, SECTORS
from meltemi.validation.selection import SPEED_LABELS, TURBULENCE_LABELS

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Float = NDArray[np.float64]
SIDES = (("measured", INK), ("simulated", COLOURS[1]))
"""Labels and colours."""


def plot_capture_matrix(matrix: NDArray[np.intp], what: str = "") -> Figure:
    """Numbers of records over wind speed and turbulence intensity (``capture_matrix``); ``what`` is of the title."""
    figure, axes = new_figure(1, size=(9.0, 4.8))
    ax = axes[0, 0]
    colours = LinearSegmentedColormap.from_list("records", ["white", COLOURS[3]])
    ax.pcolormesh(matrix, cmap=colours, vmin=0, vmax=max(int(matrix.max(initial=0)), 1), edgecolors="white")
    for i, j in zip(*np.nonzero(matrix), strict=True):
        ax.text(j + 0.5, i + 0.5, str(matrix[i, j]), ha="center", va="center", color=INK, fontsize=8.0)
    ax.set_xticks(np.arange(matrix.shape[1]) + 0.5, SPEED_LABELS, fontsize=7.0)
    ax.set_yticks(np.arange(matrix.shape[0]) + 0.5, TURBULENCE_LABELS, fontsize=7.0)
    ax.set_xlabel("wind speed [m/s]")
    ax.set_ylabel("turbulence intensity [%]")
    figure_title(figure, f"Capture matrix: {int(matrix.sum())} records", f", {what}" if what else "")
    return figure


def plot_agreement(comparison: Comparison, statistics: Sequence[tuple[str, str]]) -> Figure:
    """Simulated over measured values of each record, with the interval of the seeds; a panel for each statistic."""
    figure, axes = _panels(len(statistics), 3)
    for ax, (name, statistic) in zip(axes, statistics, strict=True):
        x, y = comparison.values(name, statistic)
        unit, factor = unit_of(name, x)
        mean, half = mean_of_known(y), np.full(len(x), np.nan)
        if y.shape[1] > 1:
            half = prediction_half(np.nanstd(y, axis=1, ddof=1), np.isfinite(y).sum(axis=1))
        ax.errorbar(factor * x, factor * mean, factor * half, fmt="o", color=COLOURS[0], ms=4.0, lw=1.0)
        ends = factor * np.array([np.nanmin([x, mean]), np.nanmax([x, mean])])
        ax.plot(ends, ends, color=INK, lw=0.8)
        panel(ax, f"{name}, {statistic}", unit, f"measured [{unit}]")
    figure_title(figure, "Simulated over measured", f", bars: {100.0 * CONFIDENCE:g} % of the seeds")
    return figure


def plot_spectra(comparison: Comparison) -> Figure:
    """Mean spectra over records, measured and of all seeds."""
    frequency = np.sqrt(BANDS[1:] * BANDS[:-1])
    names = [name for name in comparison.channels if any(name in r.measured.spectra for r in comparison.records)]
    figure, axes = _panels(len(names), 2)
    for ax, name in zip(axes, names, strict=True):
        densities = _both(comparison, "spectra", name)
        unit, factor = unit_of(name, np.sqrt(densities[0]))
        for (label, colour), density in zip(SIDES, densities, strict=True):
            ax.loglog(frequency, factor**2 * mean_of_known(density, 0), label=label, color=colour)
        panel(ax, name, f"({unit})²/Hz", "frequency [Hz]")
    axes[0].legend(fontsize=8.0)
    figure_title(figure, "Mean spectra of the records")
    return figure


def plot_operation(comparison: Comparison) -> Figure:
    """Power curve, and azimuth averages of a load if the azimuth was measured."""
    turned = [n for n in comparison.channels if any(n in r.measured.sectors for r in comparison.records)]
    loads = [n for n in turned if "moment" in n][:1]
    figure, axes = new_figure(1, 1 + len(loads), size=(10.0, 4.0), share=False)
    ax = axes[0, 0]
    bins = power_curve(comparison)
    unit, factor = unit_of("generator_power", bins["measured"].to_numpy())
    for what, colour in SIDES:
        power = factor * bins[what], factor * bins[f"{what}_error"]
        ax.errorbar(bins["speed"], *power, fmt="o-", ms=4.0, lw=1.0, color=colour, label=what)
    panel(ax, "Power curve at 1.225 kg/m³, bars: standard uncertainty of the mean", unit, "wind speed [m/s]")
    ax.legend(fontsize=8.0)
    for ax, name in zip(axes[0, 1:], loads, strict=True):
        averages = _both(comparison, "sectors", name)
        unit, factor = unit_of(name, averages[0])
        angle = (np.arange(SECTORS) + 0.5) * 360.0 / SECTORS
        for (label, colour), x in zip(SIDES, averages, strict=True):
            mean = mean_of_known(x, 0)
            ax.plot(angle, factor * (mean - np.nanmean(mean)), label=label, color=colour)
        panel(ax, f"{name} over azimuth, less its mean", unit, "azimuth [deg]")
    return figure


def unit_of(name: str, values: Float) -> tuple[str, float]:
    """Engineering unit of a channel for these magnitudes, and the factor to it."""
    channel = known_channel(name)
    return ("-", 1.0) if channel is None else readable_unit(channel, values)


def _panels(n: int, columns: int) -> tuple[Figure, list[Any]]:
    """A figure with n panels in as many columns at most."""
    rows = -(-n // columns)
    figure, axes = new_figure(rows, min(n, columns), size=(10.0, 3.5 * rows), share=False)
    for ax in axes.flat[n:]:
        ax.set_visible(False)
    return figure, [*axes.flat[:n]]


def _both(comparison: Comparison, of: Literal["spectra", "sectors"], name: str) -> tuple[Float, Float]:
    """Curves of a channel: (R, N) measured and (R K, N) simulated."""
    records = [r for r in comparison.records if name in getattr(r.measured, of)]
    measured = [getattr(r.measured, of)[name] for r in records]
    return np.array(measured), np.array([getattr(each, of)[name] for r in records for each in r.simulated])
