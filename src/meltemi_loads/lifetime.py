"""How often each run occurs in a lifetime, and the energy of a year.

Equations L-7 to L-10 of ``docs/theory/design-loads.md``; probabilities of wind speeds come from ``weibull_weights``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf, sqrt

import numpy as np
from numpy.typing import ArrayLike, NDArray

from meltemi.core.errors import InputError
from meltemi.postprocess.ensemble import CONFIDENCE, mean_interval
from meltemi.postprocess.inputs import floats

Float = NDArray[np.float64]

YEAR = 8760.0 * 3600.0
"""[s] of a year, as energy yields count it."""
LIFETIME = 20.0 * YEAR
"""[s] the usual design lifetime."""


def lifetime_weights(
    probability: ArrayLike,
    *,
    simulated: ArrayLike,
    lifetime: float = LIFETIME,
    state: ArrayLike = 1.0,
    yaw: ArrayLike = 1.0,
    runs: ArrayLike = 1,
) -> Float:
    """How often each run occurs in the lifetime: life x P x state x yaw / (runs x simulated time) (L-7).

    All arguments but ``lifetime`` are numbers or arrays that go together (those of NumPy's broadcasting).

    Args:
      probability: of the bin of wind speed, from ``weibull_weights``.
      simulated: [s] of a run that is evaluated.
      lifetime: [s].
      state: share of the time at this wind speed that the turbine spends in the state, such as production.
      yaw: share of the yaw error, such as 1/4, 1/2 and 1/4.
      runs: number of runs (seeds) that stand for the same speed, state and yaw error.

    Returns:
      numbers of repetitions; the weighted simulated time of all runs is the lifetime spent in their conditions.

    Raises:
      InputError: a share does not lie between 0 and 1, or a time or number is not positive.
    """
    shares = {"probability": probability, "state": state, "yaw": yaw}
    p, s, y = (floats(x, "lifetime_weights") for x in shares.values())
    for name, x in zip(shares, (p, s, y), strict=True):
        if not np.all((x >= 0.0) & (x <= 1.0)):
            raise InputError(f"lifetime_weights: {name} must lie between 0 and 1")
    t, n = floats(simulated, "lifetime_weights: simulated"), floats(runs, "lifetime_weights: runs")
    if not (np.all((t > 0.0) & (t < inf)) and np.all((n > 0.0) & (n < inf)) and 0.0 < lifetime < inf):
        raise InputError("lifetime_weights: simulated, runs and lifetime must be positive")
    weights: Float = lifetime * p * s * y / (n * t)
    return weights


def occurrence_weights(per_year: ArrayLike, *, lifetime: float = LIFETIME, runs: ArrayLike = 1) -> Float:
    """How often each run of an event, such as a start or stop, occurs in the lifetime (L-8).

    Args:
      per_year: occurrences of the event in a year.
      lifetime: [s].
      runs: number of runs that stand for the same event.

    Raises:
      InputError: a number of occurrences is negative, or another number not positive.
    """
    f, n = floats(per_year, "occurrence_weights: per_year"), floats(runs, "occurrence_weights: runs")
    if not (np.all((f >= 0.0) & (f < inf)) and np.all((n > 0.0) & (n < inf)) and 0.0 < lifetime < inf):
        raise InputError("occurrence_weights: per_year must not be negative, runs and lifetime must be positive")
    weights: Float = f * (lifetime / YEAR) / n
    return weights


@dataclass(frozen=True)
class AnnualEnergy:
    """Energy of a year with its confidence interval.

    Attributes:
      energy: [J] in 8760 h.
      half_width: [J] of the interval; NaN with a single seed at some speed.
      confidence: probability of the interval.
      parts: (n,) [J] from each wind speed.
    """

    energy: float
    half_width: float
    confidence: float
    parts: Float


def annual_energy(
    powers: Sequence[ArrayLike],
    probability: ArrayLike,
    *,
    availability: float = 1.0,
    confidence: float = CONFIDENCE,
) -> AnnualEnergy:
    """Annual energy, and the interval that follows from the scatter of mean powers over seeds (L-9, L-10).

    Args:
      powers: for each wind speed the (seeds,) mean powers [W] of its runs.
      probability: (n,) of the bins of wind speed.
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
