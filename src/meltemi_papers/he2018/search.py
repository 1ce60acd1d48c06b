"""The wind of the paper's minute: intensity and length scale by maximum likelihood, and the nearest minute of ours.

The logarithms of load ratios in a minute, x, are taken as normal. With a and b the logarithms of intensity and length,

    x ~ N(m, h C),   m = B (1, a, b, a^2, a b, b^2),   ln h = g (1, a, b)

B, g and C are fitted to the minutes of all simulated winds, which have different seeds, by weighted least squares; g
from the logarithms of the distances e' C^-1 e, of which residuals e of 8 normal variables have the mean psi(4) + ln 2.
The paper's changes y then have the likelihood N(y; m, h C), a function of a and b. Intervals are those of the profile
likelihood.

Reference: Pawitan (2001), In All Likelihood, section 3.4 (intervals).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.special import digamma
from scipy.stats import chi2

from meltemi.core.errors import InputError
from meltemi.report.palette import COLOURS, INK
from meltemi.report.plots import new_figure, panel
from meltemi_papers.he2018.claims import PAPER_CHANGES, in_minutes
from meltemi_papers.he2018.runs import CLASS_B, GRID, READ_AS, Runs
from meltemi_reports.blocks import Table
from meltemi_tuning.compare import Comparison

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Float = NDArray[np.float64]

FEWEST = 100
"""Minutes below which nothing is fitted."""
INTENSITIES, LENGTHS = np.geomspace(0.05, 0.18, 131), np.geomspace(0.5, 2.0, 81)
"""Searched: what is simulated, and a little higher intensities."""


@dataclass(frozen=True)
class Minutes:
    """Minutes in a wind.

    Attributes:
      name: of the wind.
      intensity, length: over those of the edition.
      seeds: (n,) of the minutes.
      begin: (n,) [s].
      changes: (n, 8) logarithms of the ratios to CPC.
    """

    name: str
    intensity: float
    length: float
    seeds: NDArray[np.int64]
    begin: Float
    changes: Float


def minutes_of(name: str, intensity: float, length: float, c: Comparison) -> Minutes:
    """All minutes of a comparison."""
    begins, x = in_minutes(c)
    seeds = np.array([-1 if seed is None else seed for seed in c.seeds])
    return Minutes(
        name, intensity, length, np.tile(seeds, len(begins)), np.repeat(begins, len(seeds)), np.log1p(x / 100.0)
    )


@dataclass(frozen=True)
class WindEstimate:
    """Likelihood of the paper's changes over the wind.

    Attributes:
      score: (intensities, lengths) logarithm of the likelihood, zero at its largest.
      at: indices of the largest.
      mean, scatter: (8,) in the most likely wind, logarithms.
      probability: of a minute as far from the mean there.
      nearest: wind, seed and begin [s] of the nearest minute.
      nearest_changes: (8,) its logarithms.
    """

    score: Float = field(repr=False)
    at: tuple[int, int]
    mean: Float
    scatter: Float
    probability: float
    nearest: tuple[str, int, float]
    nearest_changes: Float

    def interval(self, axis: int) -> tuple[float, float, float]:
        """Most likely intensity (axis 0) or length (axis 1), and the 95 % interval."""
        values = (INTENSITIES, LENGTHS)[axis]
        inside = values[2.0 * self.score.max(axis=1 - axis) > -chi2.ppf(0.95, 1)]
        return float(values[self.at[axis]]), float(inside[0]), float(inside[-1])

    def ratio(self, intensity: float, length: float) -> float:
        """Likelihood of a wind over the largest."""
        i, j = np.abs(INTENSITIES - intensity).argmin(), np.abs(LENGTHS - length).argmin()
        return float(np.exp(self.score[i, j]))


def _terms(intensity: Float, length: Float) -> Float:
    a, b = np.log(intensity / 0.1), np.log(length)
    return np.stack([np.ones_like(a), a, b, a * a, a * b, b * b], axis=-1)


def _square(x: Float, C: Float) -> Float:
    """Distances x' C^-1 x of the last axis."""
    return np.asarray(np.einsum("...i,ij,...j", x, np.linalg.inv(C), x))


def estimate_wind(cells: Sequence[Minutes], stated: Float) -> WindEstimate:
    """Likelihood of changes [%] of one minute over intensity and length scale.

    Args:
      cells: minutes in several winds.
      stated: (8,) [%].

    Raises:
      InputError: too few minutes.
    """
    x = np.concatenate([cell.changes for cell in cells])
    if len(x) < FEWEST:
        raise InputError(f"the wind of Figure 5 needs {FEWEST} minutes, found {len(x)}")
    sizes = [len(cell.changes) for cell in cells]
    terms = _terms(*(np.repeat([getattr(cell, name) for cell in cells], sizes) for name in ("intensity", "length")))
    y = np.log1p(stated / 100.0)
    h = np.ones(len(x))
    for _ in range(5):
        weight = 1.0 / np.sqrt(h)[:, None]
        B = np.linalg.lstsq(weight * terms, weight * x, rcond=None)[0]
        e = weight * (x - terms @ B)
        C = e.T @ e / (len(x) - terms.shape[1])
        apart = np.log(h * _square(e, C)) - digamma(0.5 * len(y)) - np.log(2.0)
        g = np.linalg.lstsq(terms[:, :3], apart, rcond=None)[0]
        h = np.exp(terms[:, :3] @ g)
    over = _terms(*np.meshgrid(INTENSITIES, LENGTHS, indexing="ij"))
    m, log_h = over @ B, over[..., :3] @ g
    square = _square(y - m, C) / np.exp(log_h)
    score = -0.5 * square - 0.5 * len(y) * log_h
    i, j = np.unravel_index(int(score.argmax()), score.shape)
    k = int(_square(x - y, C).argmin())
    names = np.repeat([cell.name for cell in cells], sizes)
    seeds, begins = (np.concatenate([getattr(cell, what) for cell in cells]) for what in ("seeds", "begin"))
    return WindEstimate(
        score=score - score.max(),
        at=(int(i), int(j)),
        mean=m[i, j],
        scatter=np.sqrt(np.diag(C) * np.exp(log_h[i, j])),
        probability=float(chi2.sf(square[i, j], len(y))),
        nearest=(str(names[k]), int(seeds[k]), float(begins[k])),
        nearest_changes=x[k],
    )


def winds_of(runs: Runs) -> list[Minutes]:
    """Minutes of all winds that differ in intensity and length scale only."""
    found = {study.name: study.comparison for study in runs.studies if study.name in GRID}
    cells = [minutes_of(name, *GRID[name], c) for name, c in found.items()]
    return [*cells, minutes_of(CLASS_B, *READ_AS[CLASS_B], runs.readings[CLASS_B])]


def estimate(runs: Runs) -> WindEstimate:
    """The estimate from all winds."""
    return estimate_wind(winds_of(runs), np.array([change for *_, change in PAPER_CHANGES]))


def told(e: WindEstimate) -> str:
    """The estimate in words."""
    (best, low, high), (s, short, long) = e.interval(0), e.interval(1)
    readings = ", ".join(f"{100 * e.ratio(*wind):.2g} % ({name})" for name, wind in READ_AS.items())
    intensities, lengths = (f"{x[0]:g} to {x[-1]:g}" for x in (100.0 * INTENSITIES, LENGTHS))
    return (
        f"The paper's changes are most likely in an intensity of {100 * best:.1f} % (95 % interval {100 * low:.1f} to "
        f"{100 * high:.1f} %, searched {intensities} %) and lengths {s:.2f} times those of edition 3 ({short:.2f} to "
        f"{long:.2f}, searched {lengths}). There the probability of a minute as far from the mean is "
        f"{e.probability:.2f}. Of this likelihood the wind as we read it has {readings}. "
        "Turbine and loops are ours: where the paper's differ, it counts as a difference of wind."
    )


def told_briefly(e: WindEstimate) -> str:
    """The intensity in a sentence."""
    best, low, high = (100.0 * x for x in e.interval(0))
    return f"Its changes are most likely in a wind of {best:.1f} % (95 % interval {low:.1f} to {high:.1f} %). "


def search_table(runs: Runs) -> Table:
    """The paper's changes beside those of the most likely wind and of the nearest minute."""
    e = estimate(runs)
    percent = [100.0 * np.expm1(x) for x in (e.mean, e.mean - e.scatter, e.mean + e.scatter, e.nearest_changes)]
    rows = [
        [
            f"{quantity}, {scheme.upper()}",
            f"{paper:+.1f} %",
            f"{mean:+.1f} %",
            f"{low:+.1f} to {high:+.1f} %",
            f"{minute:+.1f} %",
        ]
        for (quantity, scheme, paper), mean, low, high, minute in zip(PAPER_CHANGES, *percent, strict=True)
    ]
    name, seed, begin = e.nearest
    head = ["change", "paper", "most likely wind", "68 % of its minutes", "nearest minute"]
    note = f"Nearest of all minutes: {name}, seed {seed}, {begin:g} to {begin + 60.0:g} s."
    return Table(head, rows, "The paper's minute in the wind that makes it most likely", note=note)


def surface(runs: Runs) -> Figure:
    """Likelihood over intensity and length scale."""
    e = estimate(runs)
    figure, axes = new_figure(1, size=(7.0, 4.2))
    ax = axes[0, 0]
    levels = [-0.5 * float(chi2.ppf(share, 2)) for share in (0.999, 0.95, 0.5)]
    drawn = ax.contour(100.0 * INTENSITIES, LENGTHS, e.score.T, levels, colors=[COLOURS[0]])
    ax.clabel(drawn, fmt=dict(zip(levels, ("99.9 %", "95 %", "50 %"), strict=True)), fontsize=8)
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
