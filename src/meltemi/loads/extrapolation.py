"""Statistical extrapolation of extreme loads in normal production (DLC 1.1).

The extremes of runs at each wind speed are fitted by a distribution, the distributions are weighted with the
probability of the speeds, and the result is the load that is exceeded in ten minutes with a probability of once in 50
years. Equations L-19 to L-27 of ``docs/theory/design-loads.md``, which states bias and coverage; methods: Moriarty et
al. (2004), Fitzwater and Winterstein (2001), Ragan and Manuel (2007).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf, nan, pi, sqrt
from numbers import Integral, Real
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from meltemi.core.errors import InputError, did_you_mean
from meltemi.core.shown import Brief
from meltemi.postprocess.ensemble import CONFIDENCE
from meltemi.postprocess.inputs import floats

Float = NDArray[np.float64]
Distribution = Literal["gumbel", "weibull"]

FIFTY_YEARS = 3.8e-7
"""Probability in ten minutes of an event with a return period of 50 years: 600 s over 50 years."""
LEAST = {"gumbel": 6, "weibull": 15}
"""Smallest number of extremes of a fit: two parameters, and three of which one follows from the skewness."""
SHAPES = np.geomspace(0.6, 20.0, 400)
"""Shape parameters of Weibull distributions with skewnesses from 4.6 to -0.87; other skewnesses take the nearest."""


@dataclass(frozen=True)
class ExtremeFit:
    """Distribution of the extremes of runs at a wind speed.

    Attributes:
      distribution: "gumbel" or "weibull" (three parameters).
      location, scale: parameters in the unit of the load.
      shape: shape parameter of the Weibull distribution; NaN for Gumbel's.
      extremes: number of extremes that it was fitted to.
    """

    distribution: Distribution
    location: float
    scale: float
    shape: float
    extremes: int

    def exceedance(self, loads: ArrayLike) -> Float:
        """Probability of a larger extreme (L-19, L-21), in the shape of ``loads``."""
        return _exceedance(self.distribution, self._parameters, np.asarray(loads, dtype=float))

    def quantile(self, probability: ArrayLike) -> Float:
        """Load that is exceeded with a probability, in the shape of ``probability``."""
        return _quantile(self.distribution, self._parameters, np.asarray(probability, dtype=float))

    @property
    def _parameters(self) -> Float:
        return np.array([self.location, self.scale, self.shape])


@dataclass(frozen=True, repr=False)
class Extrapolation(Brief):
    """Extrapolated load with its confidence band, and the data of a plot.

    Attributes:
      load: load exceeded with ``probability`` in ten minutes, in the unit of the extremes.
      low, high: bounds of its confidence interval, by bootstrap over seeds.
      confidence: probability of the interval.
      probability: probability of exceedance in ten minutes.
      fits: distribution of the extremes of each wind speed.
      levels: (L,) loads of the plot.
      exceedance: (L,) probability of exceedance in ten minutes by the weighted distributions.
      band: (2, L) lower and upper bound of ``exceedance``, of the same confidence at each level.
      points: (2, R) extremes of the runs in descending order, and the weighted share of runs that reach them.
      smallest: whether the extremes are smallest values; exceedance then means falling below.
    """

    load: float
    low: float
    high: float
    confidence: float
    probability: float
    fits: tuple[ExtremeFit, ...]
    levels: Float
    exceedance: Float
    band: Float
    points: Float
    smallest: bool


def fit_extremes(extremes: ArrayLike, distribution: Distribution = "gumbel") -> ExtremeFit:
    """Fit of a distribution: Gumbel's by maximum likelihood (L-20), Weibull's by three moments (L-22).

    Args:
      extremes: (n,) extremes of independent runs or blocks at one wind speed.
      distribution: "gumbel" or "weibull" with three parameters.

    Raises:
      InputError: there are fewer than 6 extremes for Gumbel's and 15 for Weibull's distribution, they are not finite or
        all equal, or there is no such distribution.
    """
    x = _checked(extremes, distribution, "fit_extremes")
    location, scale, shape = _parameters(distribution, x.reshape(-1, 1))[:, 0]
    return ExtremeFit(distribution, float(location), float(scale), float(shape), x.size)


def extrapolate(
    extremes: Sequence[ArrayLike],
    probability_of_speed: ArrayLike,
    *,
    distribution: Distribution = "gumbel",
    probability: float = FIFTY_YEARS,
    smallest: bool = False,
    confidence: float = CONFIDENCE,
    resamples: int = 500,
    seed: int = 1,
) -> Extrapolation:
    """Load that is exceeded in ten minutes of any wind speed with a given probability (L-23 to L-27).

    Args:
      extremes: (seeds,) extremes of ten minutes at each wind speed, or (seeds, blocks) extremes of equal parts of the
        ten minutes.
      probability_of_speed: (n,) probabilities of the bins of wind speed among all time, from ``weibull_weights``.
      distribution: distribution as for ``fit_extremes``.
      probability: probability of exceedance in ten minutes; 3.8e-7 is once in 50 years.
      smallest: whether the extremes are smallest values.
      confidence: probability of the band.
      resamples: number of bootstrap samples. Seeds are drawn with replacement at each speed, with all their blocks.
      seed: seed of the random numbers.

    Raises:
      InputError: as ``fit_extremes``, with the wind speed; speeds and probabilities do not go together; or
        ``probability`` is not smaller than that of all wind speeds.
    """
    where = "extrapolate"
    p = floats(probability_of_speed, "extrapolate: probability_of_speed")
    if not isinstance(extremes, Sequence):
        raise InputError(f"{where}: extremes are lists of numbers, one for each wind speed, found {extremes!r:.60}")
    if p.shape != (len(extremes),) or not len(p) or not np.all(p >= 0.0) or not p.sum() <= 1.0 + 1e-9:
        raise InputError(f"{where}: {len(extremes)} wind speeds need as many probabilities, with a sum up to 1")
    numbers: dict[str, object] = {"probability": probability, "confidence": confidence, "resamples": resamples}
    for name, value in numbers.items():
        if not isinstance(value, Integral if name == "resamples" else Real):
            raise InputError(f"{where}: {name}: expected a number, found {value!r:.60}")
    if not 0.0 < probability < p.sum():
        raise InputError(f"{where}: probability must lie between 0 and {p.sum():g}, found {probability!r}")
    if not 0.0 < confidence < 1.0 or resamples < 1:
        raise InputError(f"{where}: confidence must lie between 0 and 1, resamples must be positive")
    sign = -1.0 if smallest else 1.0
    samples = []
    for k, given in enumerate(extremes):
        x = sign * _checked(given, distribution, f"{where}: wind speed {k + 1}")
        samples.append(x.reshape(len(x), -1))
    rng = np.random.default_rng(seed)
    parameters = np.empty((3, resamples + 1, len(p)))  # the first is the sample itself
    for k, x in enumerate(samples):
        resampled = np.concatenate([np.arange(len(x))[None], rng.integers(0, len(x), (resamples, len(x)))])
        parameters[:, :, k] = _parameters(distribution, x[resampled].reshape(resamples + 1, -1).T.copy())
    blocks = np.array([x.shape[1] for x in samples], dtype=float)
    loads = _long_term(distribution, parameters, p, blocks, probability)
    tails = 50.0 * (1.0 - confidence) * np.array([1.0, -1.0]) + np.array([0.0, 100.0])
    low, high = np.percentile(loads[1:], tails)
    largest = [x.max(axis=1) for x in samples]
    levels = np.linspace(min(float(x.min()) for x in largest), max(float(high), float(loads[0])), 60)
    total = np.array([_total(distribution, parameters, p, blocks, level) for level in levels])
    ordered = np.argsort(np.concatenate(largest))[::-1]
    shares = np.concatenate([np.full(len(x), w / (len(x) + 1.0)) for x, w in zip(largest, p, strict=True)])
    return Extrapolation(
        load=sign * float(loads[0]),
        low=float(min(sign * low, sign * high)),
        high=float(max(sign * low, sign * high)),
        confidence=confidence,
        probability=probability,
        fits=tuple(
            ExtremeFit(distribution, sign * float(a), float(b), float(c), x.size)
            for (a, b, c), x in zip(parameters[:, 0].T, samples, strict=True)
        ),
        levels=sign * levels,
        exceedance=total[:, 0],
        band=np.percentile(total[:, 1:], tails, axis=1),
        points=np.stack([sign * np.concatenate(largest)[ordered], np.cumsum(shares[ordered])]),
        smallest=smallest,
    )


def _checked(extremes: ArrayLike, distribution: str, where: str) -> Float:
    x = floats(extremes, where)
    if str(distribution) not in LEAST:
        raise InputError(f"{where}: no distribution {distribution!r}: {did_you_mean(distribution, LEAST)}")
    if x.ndim not in (1, 2) or not np.all(np.isfinite(x)):
        raise InputError(
            f"{where}: extremes must be finite numbers, (seeds,) or (seeds, blocks), found shape {x.shape}"
        )
    if x.size < LEAST[distribution]:
        raise InputError(
            f"{where}: {x.size} extremes are too few for a {distribution} distribution, which needs "
            f"{LEAST[distribution]}: simulate more seeds, or take the extremes of blocks"
        )
    if np.ptp(x) == 0.0:
        raise InputError(f"{where}: all extremes are equal: there is no distribution to fit")
    return x


def _parameters(distribution: str, samples: Float) -> Float:
    """(3, B) location, scale and shape of B samples (n, B)."""
    n = len(samples)
    mean = samples.mean(axis=0)
    std = np.maximum(samples.std(axis=0, ddof=1), 1e-12 * np.abs(mean) + 1e-300)  # a sample may repeat one seed
    if distribution == "gumbel":
        return _gumbel(samples, std)
    g = np.mean(((samples - mean) / std) ** 3, axis=0) * n**2 / ((n - 1.0) * (n - 2.0))
    one, two, skewness = _weibull_moments(SHAPES)
    shape = np.interp(-g, -skewness, SHAPES)  # skewness falls with the shape
    scale = std / np.interp(shape, SHAPES, np.sqrt(two - one**2))
    return np.stack([mean - scale * np.interp(shape, SHAPES, one), scale, shape])


def _gumbel(samples: Float, std: Float) -> Float:
    """Newton's method for the scale: the likelihood's equation has one root, and its left side ascends."""
    lowest = samples.min(axis=0)
    y, scale = samples - lowest, std * sqrt(6.0) / pi
    mean = y.mean(axis=0)
    for _ in range(50):
        w = np.exp(-y / scale)
        s0, s1, s2 = w.sum(axis=0), (w * y).sum(axis=0), (w * y**2).sum(axis=0)
        step = (scale - mean + s1 / s0) / (1.0 + (s2 * s0 - s1**2) / (s0 * scale) ** 2)
        scale = np.maximum(scale - step, 0.2 * scale)
        if np.all(np.abs(step) <= 1e-10 * scale):
            break
    location = lowest - scale * np.log(np.mean(np.exp(-y / scale), axis=0))
    return np.stack([location, scale, np.full(len(scale), nan)])


def _weibull_moments(k: Float) -> tuple[Float, Float, Float]:
    """First two moments about zero, and skewness, of Weibull distributions of scale 1."""
    from scipy.special import gamma

    one, two, three = (gamma(1.0 + j / k) for j in (1.0, 2.0, 3.0))
    return one, two, (three - 3.0 * one * two + 2.0 * one**3) / (two - one**2) ** 1.5


def _exceedance(distribution: str, parameters: Float, x: Float) -> Float:
    location, scale, shape = parameters
    z = (x - location) / scale
    with np.errstate(over="ignore"):
        return np.asarray(
            -np.expm1(-np.exp(-z)) if distribution == "gumbel" else np.exp(-(np.maximum(z, 0.0) ** shape))
        )


def _quantile(distribution: str, parameters: Float, q: Float) -> Float:
    location, scale, shape = parameters
    if distribution == "gumbel":
        return np.asarray(location - scale * np.log(-np.log1p(-q)))
    return np.asarray(location + scale * (-np.log(q)) ** (1.0 / shape))


def _total(distribution: str, parameters: Float, p: Float, blocks: Float, x: Float) -> Float:
    """(B,) exceedance in ten minutes, weighted over speeds; parameters (3, B, n), x a number or (B, 1)."""
    of_block = np.minimum(_exceedance(distribution, parameters, x), 1.0 - 1e-16)
    total: Float = -np.expm1(blocks * np.log1p(-of_block)) @ p
    return total


def _long_term(distribution: str, parameters: Float, p: Float, blocks: Float, probability: float) -> Float:
    """(B,) loads exceeded with a probability, by bisection between bounds that follow from single speeds."""

    def of_speed(q: Float) -> Float:
        """Loads that ten minutes at each speed exceed with probability q."""
        return _quantile(distribution, parameters, -np.expm1(np.log1p(-np.minimum(q, 1.0 - 1e-16)) / blocks))

    alone = np.where(p > probability, of_speed(probability / np.maximum(p, probability)), -inf)
    high = of_speed(np.full(len(p), probability / p.sum())).max(axis=1)
    low = np.maximum(alone.max(axis=1), of_speed(np.full(len(p), 1.0 - 1e-9)).min(axis=1))
    for _ in range(40):
        middle = 0.5 * (low + high)
        above = _total(distribution, parameters, p, blocks, middle[:, None]) > probability
        low, high = np.where(above, middle, low), np.where(above, high, middle)
    return 0.5 * (low + high)
