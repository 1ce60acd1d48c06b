"""Annual energy.

Equations L-9 and L-10 of ``docs/theory/design-loads.md``; probabilities of wind speeds come from ``weibull_weights``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import sqrt

import numpy as np
from numpy.typing import ArrayLike, NDArray

from meltemi.core.errors import InputError
from meltemi.postprocess.ensemble import CONFIDENCE, mean_interval
from meltemi.postprocess.inputs import floats

Float = NDArray[np.float64]

YEAR = 8760.0 * 3600.0
"""Duration [s] of a year, the convention of energy yields."""


@dataclass(frozen=True)
class AnnualEnergy:
    """Annual energy with its confidence interval.

    Attributes:
      energy: [J] energy in 8760 h.
      half_width: [J] half width of the interval; NaN with a single seed at some speed.
      confidence: probability of the interval.
      parts: (n,) [J] energy of each wind speed.
    """

    energy: float
    half_width: float
    confidence: float
    parts: Float


def annual_energy(
    powers: Sequence[ArrayLike], probability: ArrayLike, *, availability: float = 1.0, confidence: float = CONFIDENCE
) -> AnnualEnergy:
    """Annual energy, and the interval that follows from the scatter of mean powers over seeds (L-9, L-10).

    Args:
      powers: (seeds,) mean powers [W] of the runs at each wind speed.
      probability: (n,) probabilities of the bins of wind speed.
      availability: share of the time in which the turbine produces when the wind allows it.
      confidence: probability of the interval. It holds for seeds that are independent between speeds.

    Raises:
      InputError: there are not as many speeds as probabilities, a speed has no power, or a share is out of range.
    """
    p = floats(probability, "annual_energy: probability")
    if p.shape != (len(powers),) or not len(p) or not np.all((p >= 0.0) & (p <= 1.0)):
        raise InputError(f"annual_energy: {len(powers)} wind speeds need as many probabilities between 0 and 1")
    if not 0.0 <= availability <= 1.0:
        raise InputError(f"annual_energy: availability must lie between 0 and 1, found {availability!r}")
    means = [mean_interval(power, confidence) for power in powers]
    seconds = YEAR * availability * p
    parts = seconds * np.array([m.mean for m in means])
    variances = (seconds * np.array([m.std / sqrt(m.n) for m in means])) ** 2
    total = float(variances.sum())
    half_width = sqrt(total) if not total > 0.0 else _student(variances, [m.n for m in means], confidence) * sqrt(total)
    return AnnualEnergy(float(parts.sum()), half_width, confidence, parts)


def _student(variances: Float, seeds: Sequence[int], confidence: float) -> float:
    """Quantile of Student's distribution with the degrees of freedom of Welch and Satterthwaite."""
    from scipy.stats import t

    freedom = variances.sum() ** 2 / np.sum(variances**2 / (np.array(seeds) - 1.0))
    return float(t.ppf(0.5 * (1.0 + confidence), freedom))
