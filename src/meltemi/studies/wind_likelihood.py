"""The wind in which changes of loads are most likely: intensity and length scale by maximum likelihood.

The logarithms x of load ratios in a minute are assumed to be normal. With a and b the logarithms of intensity and
length,

    x ~ N(m, h C),   m = B (1, a, b, a^2, a b, b^2),   ln h = g (1, a, b)

B, g and C are fitted to the minutes of all simulated winds, with different seeds, by weighted least squares; g
from the logarithms of the distances e' C^-1 e, of which residuals e of n normal variables have the mean psi(n/2)
+ ln 2.
Stated changes y then have the likelihood N(y; m, h C), a function of a and b. Intervals are those of the profile
likelihood.

Reference: Pawitan (2001), In All Likelihood, section 3.4 (intervals).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.special import digamma
from scipy.stats import chi2

from meltemi.core.errors import InputError

Float = NDArray[np.float64]

FEWEST = 100
"""Minutes below which nothing is fitted."""
INTENSITIES, LENGTHS = np.geomspace(0.05, 0.18, 131), np.geomspace(0.5, 2.0, 81)
"""Searched: what is simulated, and a little higher intensities."""


@dataclass(frozen=True)
class Minutes:
    """Minutes in a wind.

    Attributes:
      name: name of the wind.
      intensity, length: turbulence intensity and length scale over those of the edition.
      seeds: (n,) seeds of the minutes.
      begin: (n,) [s] begin of the minutes.
      changes: (n, 8) logarithms of the ratios to CPC.
    """

    name: str
    intensity: float
    length: float
    seeds: NDArray[np.int64]
    begin: Float
    changes: Float


@dataclass(frozen=True)
class WindEstimate:
    """Likelihood of stated changes over the wind.

    Attributes:
      score: (intensities, lengths) logarithm of the likelihood, zero at its maximum.
      at: indices of the maximum.
      mean, scatter: (8,) mean and scatter in the most likely wind, logarithms.
      probability: probability of a minute at least as far from the mean in this wind.
      nearest: wind, seed and begin [s] of the nearest minute.
      nearest_changes: (8,) logarithms of its changes.
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
        """Likelihood of a wind over the maximum."""
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
      stated: (8,) [%] stated changes.

    Raises:
      InputError: the number of minutes is too small.
    """
    x = np.concatenate([cell.changes for cell in cells])
    if len(x) < FEWEST:
        raise InputError(f"the most likely wind needs {FEWEST} minutes, found {len(x)}")
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
