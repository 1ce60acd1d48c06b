"""The wind in which the paper's changes are most likely, by :mod:`meltemi.studies.wind_likelihood`."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from meltemi.papers.he2018.measures import PAPER_CHANGES, in_minutes, sentence
from meltemi.papers.he2018.runs import CLASS_B, GRID, READ_AS, LoadControlRuns
from meltemi.report.palette import COLOURS, INK
from meltemi.report.plots import new_figure, panel
from meltemi.reports.blocks import Table
from meltemi.studies.wind_likelihood import INTENSITIES, LENGTHS, Minutes, WindEstimate, estimate_wind
from meltemi.tuning.compare import Comparison

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Float = NDArray[np.float64]


def minutes_of(name: str, intensity: float, length: float, c: Comparison) -> Minutes:
    """All minutes of a comparison."""
    begins, x = in_minutes(c)
    seeds = np.array([-1 if seed is None else seed for seed in c.seeds])
    return Minutes(
        name, intensity, length, np.tile(seeds, len(begins)), np.repeat(begins, len(seeds)), np.log1p(x / 100.0)
    )


def winds_of(runs: LoadControlRuns) -> list[Minutes]:
    """Minutes of all winds that differ only in intensity and length scale."""
    cells = [minutes_of(name, *GRID[name], c) for name, c in runs.studies.items() if name in GRID]
    return [*cells, minutes_of(CLASS_B, *READ_AS[CLASS_B], runs.readings[CLASS_B])]


def estimate(runs: LoadControlRuns) -> WindEstimate:
    """The estimate from all winds."""
    return estimate_wind(winds_of(runs), np.array([change for *_, change in PAPER_CHANGES]))


def wind_estimate_text(e: WindEstimate) -> str:
    """Text on the estimate."""
    (best, low, high), (s, short, long) = [100.0 * x for x in e.interval(0)], e.interval(1)
    readings = ", ".join(f"{100 * e.ratio(*wind):.2g} % ({name})" for name, wind in READ_AS.items())
    intensities, lengths = (f"{x[0]:g} to {x[-1]:g}" for x in (100.0 * INTENSITIES, LENGTHS))
    numbers = {"best": best, "low": low, "high": high, "intensities": intensities, "probability": e.probability}
    return sentence("wind", s=s, short=short, long=long, lengths=lengths, readings=readings, **numbers)


def intensity_text(e: WindEstimate) -> str:
    """Sentence on the estimated intensity."""
    best, low, high = (100.0 * x for x in e.interval(0))
    return f"Its changes are most likely in a wind of {best:.1f} % (95 % interval {low:.1f} to {high:.1f} %). "


def search_table(runs: LoadControlRuns) -> Table:
    """Table of the paper's changes, those of the most likely wind and of the nearest minute."""
    e = estimate(runs)
    percent = [100.0 * np.expm1(x) for x in (e.mean, e.mean - e.scatter, e.mean + e.scatter, e.nearest_changes)]
    rows = []
    for (quantity, scheme, paper), mean, low, high, minute in zip(PAPER_CHANGES, *percent, strict=True):
        numbers = [f"{paper:+.1f} %", f"{mean:+.1f} %", f"{low:+.1f} to {high:+.1f} %", f"{minute:+.1f} %"]
        rows.append([f"{quantity}, {scheme.upper()}", *numbers])
    name, seed, begin = e.nearest
    head = ["change", "paper", "most likely wind", "68 % of its minutes", "nearest minute"]
    note = f"Nearest of all minutes: {name}, seed {seed}, {begin:g} to {begin + 60.0:g} s."
    return Table(head, rows, "The paper's minute in the wind that makes it most likely", note=note)


def surface(runs: LoadControlRuns) -> Figure:
    """Likelihood over intensity and length scale."""
    e = estimate(runs)
    figure, axes = new_figure(1, size=(7.0, 4.2))
    ax = axes[0, 0]
    levels = [-0.5 * float(chi2.ppf(share, 2)) for share in (0.999, 0.95, 0.5)]
    contours = ax.contour(100.0 * INTENSITIES, LENGTHS, e.score.T, levels, colors=[COLOURS[0]])
    ax.clabel(contours, fmt=dict(zip(levels, ("99.9 %", "95 %", "50 %"), strict=True)), fontsize=8)
    ax.plot(100.0 * INTENSITIES[e.at[0]], LENGTHS[e.at[1]], "o", color=COLOURS[0], clip_on=False, label="most likely")
    for colour, (name, (intensity, length)) in zip(COLOURS[1:], READ_AS.items(), strict=False):
        ax.plot(100.0 * intensity, length, "D", color=colour, label=name, clip_on=False)
    for cell in winds_of(runs):
        ax.plot(100.0 * cell.intensity, cell.length, ".", color=INK, markersize=4, clip_on=False)
    ax.set_yscale("log")
    ax.set_yticks([0.5, 1.0, 2.0], ["0.5", "1", "2"])
    ax.minorticks_off()
    ax.set_xlabel("turbulence intensity [%]")
    ax.legend(loc="upper right")
    panel(ax, "Regions of likelihood; dots: simulated", "lengths over those of edition 3")
    return figure
