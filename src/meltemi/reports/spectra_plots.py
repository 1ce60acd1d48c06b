"""Comparison of power spectra."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from meltemi.core.errors import InputError
from meltemi.postprocess.spectra import RESOLUTION, PowerSpectrum, average_spectra, power_spectrum, rotor_frequency
from meltemi.report.palette import COLOURS, FAINT
from meltemi.report.plots import ON_TOP, new_figure, note, panel
from meltemi.simulation.channels import every_kind, find
from meltemi.simulation.result import Result

if TYPE_CHECKING:
    from matplotlib.axes import Axes

ABOVE = 1.6
"""Default upper limit of the frequency axis over the highest marked harmonic."""
WITHOUT_ROTOR = 1.0
"""[Hz] default upper limit of the frequency axis without marked harmonics."""


def plot_spectra(
    results: Mapping[str, Result | Sequence[Result] | PowerSpectrum],
    channel: str,
    *,
    resolution: float = RESOLUTION,
    harmonics: Sequence[int] = (1, 2, 3),
    rotor: float | None = None,
    highest: float | None = None,
    ax: Axes | None = None,
) -> Axes:
    """Plot power spectral densities of a channel of several runs, in engineering units.

    Multiples of the rotor frequency are marked.

    Args:
      results: runs by name; several runs under one name, such as seeds, are averaged. Or spectra by name.
      channel: name of the channel.
      resolution: [Hz] see ``power_spectrum``; spectra have theirs.
      harmonics: marked harmonics.
      rotor: [Hz] rotor frequency; by default the mean of all runs that have it; spectra do not.
      highest: [Hz] upper limit of the figure; a little above the last harmonic by default.
      ax: where to draw.

    Raises:
      InputError: there is nothing to plot, or a run is shorter than the resolution needs.
    """
    if not results or not all(isinstance(some, PowerSpectrum | Result) or some for some in results.values()):
        raise InputError("plot_spectra: no results")
    if ax is None:
        ax = new_figure(1, size=(9.0, 4.2))[1][0, 0]
    runs = {name: _runs(some) for name, some in results.items()}
    every = [run for some in runs.values() for run in some]
    if rotor is None:
        turning = [rotor_frequency(run) for run in every if "rotor_speed" in run or "azimuth" in run]
        rotor = float(np.mean(turning)) if turning else 0.0
    marked = [n for n in harmonics if rotor > 0.0]
    if highest is None:
        highest = ABOVE * max(marked) * rotor if marked else WITHOUT_ROTOR
    about = every[0].channel(channel) if every else find(channel, every_kind())
    unit, factor = about.display_unit
    shown: list[float] = []
    for i, (name, some) in enumerate(results.items()):
        each = [power_spectrum(run, channel, resolution=resolution) for run in runs[name]]
        spectrum = some if isinstance(some, PowerSpectrum) else average_spectra(each)
        # the density at zero frequency is the rest of the mean
        part = (spectrum.frequency > 0.0) & (spectrum.frequency <= highest)
        density = spectrum.density[part] * factor**2
        ax.semilogy(spectrum.frequency[part], density, linewidth=1.1, label=name, color=COLOURS[i % len(COLOURS)])
        shown += [float(value) for value in density if value > 0.0]
    for n in marked:
        ax.axvline(n * rotor, color=FAINT, linewidth=0.8, linestyle="--", zorder=0.5)
        if n * rotor <= highest:
            note(ax, f"{n}P", (n * rotor, 1.0), (2, -9), fontsize=8, **ON_TOP)
    ax.set_xlim(0.0, highest)
    if shown:
        ax.set_ylim(0.5 * min(shown), 3.0 * max(shown))
    panel(ax, f"{about.name.replace('_', ' ')}, power spectral density", f"({unit})$^2$/Hz", "frequency [Hz]")
    if len(results) > 1:
        ax.legend()
    return ax


def _runs(some: Result | Sequence[Result] | PowerSpectrum) -> list[Result]:
    if isinstance(some, PowerSpectrum):
        return []
    return [some] if isinstance(some, Result) else list(some)
