"""Ensemble statistics: means with confidence intervals, changes by seed, ensemble and lifetime equivalent loads.

Schemes that ran in the same winds are compared seed by seed: the change of each seed against the first scheme is
formed first and averaged then. Differences from seed to seed, mostly of the wind, cancel, so intervals of changes are
much narrower than those of the values suggest. Intervals are Student's: they hold for numbers that scatter normally
from seed to seed, and say nothing about other errors.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import gamma, inf, nan, sqrt
from typing import Literal, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from meltemi.core.errors import InputError, did_you_mean
from meltemi.core.shown import Brief
from meltemi.postprocess.inputs import floats, positive
from meltemi.postprocess.spectra import even_series
from meltemi.simulation.result import Result

Float = NDArray[np.float64]
Seed = TypeVar("Seed")
Tails = Literal["outside", "end_bins"]

CONFIDENCE = 0.95
LEAST_SHAPE, MOST_SHAPE = 0.5, 20.0
"""Range of the shape of Weibull distributions; those of wind speeds lie between 1 and 4."""


@dataclass(frozen=True)
class MeanEstimate:
    """Sample mean and its confidence interval.

    Attributes:
      mean: mean of the numbers.
      half_width: half-width of the interval; NaN for a single number.
      std: standard deviation of the numbers, from n - 1; NaN for a single number.
      n: number of numbers.
    """

    mean: float
    half_width: float
    std: float
    n: int

    @property
    def low(self) -> float:
        return self.mean - self.half_width

    @property
    def high(self) -> float:
        return self.mean + self.half_width


@dataclass(frozen=True)
class EnsembleEntry:
    """A quantity of a scheme over all seeds.

    Attributes:
      quantity, scheme: their names.
      value: mean over seeds, in the unit of the quantity.
      change: mean of the changes, the ratio to the first scheme minus one, formed for each seed; None for the first
        scheme, NaN if that is zero, or the sign another, for some seed.
      load: equivalent load of the ensemble, see ``ensemble_load``; None for other quantities than loads.
      load_change: change of that load against the first scheme's; None for the first scheme.
    """

    quantity: str
    scheme: str
    value: MeanEstimate
    change: MeanEstimate | None = None
    load: float | None = None
    load_change: float | None = None


@dataclass(frozen=True, repr=False)
class EnsembleTable(Brief):
    """Quantities of schemes over seeds.

    Attributes:
      quantities, schemes: names, in the order in which they were given; the first scheme is the base of changes.
      seeds: number of seeds.
      confidence: probability of the intervals.
      entries: one for each quantity and scheme, scheme by scheme within a quantity.
    """

    quantities: tuple[str, ...]
    schemes: tuple[str, ...]
    seeds: int
    confidence: float
    entries: tuple[EnsembleEntry, ...]

    def __iter__(self) -> Iterator[EnsembleEntry]:
        return iter(self.entries)

    def entry(self, quantity: str, scheme: str) -> EnsembleEntry:
        """The entry of a quantity and a scheme.

        Raises:
          InputError: there is none.
        """
        for name, names in ((quantity, self.quantities), (scheme, self.schemes)):
            if name not in names:
                raise InputError(f"ensemble: no {name!r}: {did_you_mean(name, names)}")
        return self.entries[self.quantities.index(quantity) * len(self.schemes) + self.schemes.index(scheme)]


def mean_interval(values: ArrayLike, confidence: float = CONFIDENCE) -> MeanEstimate:
    """Mean and Student's confidence interval of independent samples, such as one per seed.

    Args:
      values: (n,) numbers.
      confidence: probability of the interval.

    Raises:
      InputError: there are no values, or ``confidence`` does not lie between 0 and 1.
    """
    from scipy.stats import t

    x = floats(values, "mean_interval: values")
    if x.ndim != 1 or not len(x):
        raise InputError(f"mean_interval: values must be a row of numbers, found shape {x.shape}")
    if not 0.0 < positive(confidence, "mean_interval: confidence") < 1.0:
        raise InputError(f"mean_interval: confidence must lie between 0 and 1, found {confidence!r}")
    n = len(x)
    std = float(x.std(ddof=1)) if n > 1 else nan
    quantile = float(t.ppf(0.5 * (1.0 + confidence), n - 1)) if n > 1 else nan
    return MeanEstimate(mean=float(x.mean()), half_width=quantile * std / sqrt(n), std=std, n=n)


def ensemble_load(loads: ArrayLike, slope: float, weights: ArrayLike | None = None) -> float:
    """Equivalent load of several series, (sum w L^m / sum w)^(1/m): damage adds up, not loads.

    Args:
      loads: (n,) equivalent loads, all for the same duration and f_eq.
      slope: m of the S-N curve.
      weights: (n,) shares of time; equal by default.

    Raises:
      InputError: there are no loads, one is negative, or ``slope`` is not positive.
    """
    x = _loads(loads, slope, "ensemble_load")
    w = np.ones(len(x)) if weights is None else floats(weights, "ensemble_load: weights")
    if w.shape != x.shape or not np.all(w >= 0.0) or not w.sum() > 0.0:
        raise InputError("ensemble_load: there must be a weight for each load, none negative, not all zero")
    return _power_mean(x, w / w.sum(), slope)


def ensemble_table(
    values: Mapping[Seed, Mapping[str, Mapping[str, float]]],
    slopes: Mapping[str, float] | None = None,
    *,
    confidence: float = CONFIDENCE,
) -> EnsembleTable:
    """Means, intervals and changes relative to the first scheme, for several schemes in the same wind fields.

    Args:
      values: quantities of each seed and scheme, ``values[seed][scheme][quantity]``, all in the same unit from
        seed to seed. The first scheme of the first seed is the base.
      slopes: m of the S-N curve for quantities that are equivalent loads; for these the ensemble's load is given too.
      confidence: probability of the intervals.

    Raises:
      InputError: the input is empty, a seed lacks a scheme or a scheme a quantity that the first one has or has
        others, a number is not finite, or a slope belongs to no quantity.
    """
    where = "ensemble_table"
    slopes = slopes or {}
    first = next(iter(values.values()), {})
    schemes = tuple(first)
    quantities = tuple(first[schemes[0]]) if schemes else ()
    if not quantities:
        raise InputError(f"{where}: no numbers")
    for seed, of_seed in values.items():
        if set(of_seed) != set(schemes):
            raise InputError(f"{where}: seed {seed!r} has the schemes {_list(of_seed)}, the first {_list(schemes)}")
        for scheme, numbers in of_seed.items():
            if set(numbers) != set(quantities):
                differing = sorted(set(numbers) ^ set(quantities))
                raise InputError(f"{where}: seed {seed!r}, scheme {scheme!r}: not for all there is {_list(differing)}")
            for quantity, value in numbers.items():
                if not np.isfinite(value):
                    raise InputError(f"{where}: seed {seed!r}, scheme {scheme!r}: {quantity} is {value!r}")
    for quantity in slopes:
        if quantity not in quantities:
            raise InputError(f"{where}: slope of {quantity!r}: {did_you_mean(quantity, quantities)}")
    entries = []
    for quantity in quantities:
        base = np.array([of_seed[schemes[0]][quantity] for of_seed in values.values()], dtype=float)
        m = slopes.get(quantity)
        base_load = None if m is None else ensemble_load(base, m)
        for scheme in schemes:
            x = np.array([of_seed[scheme][quantity] for of_seed in values.values()], dtype=float)
            load = None if m is None else ensemble_load(x, m)
            change, load_change = None, None
            if scheme != schemes[0]:
                change = mean_interval(_ratio(x, base) - 1.0, confidence)
                if load is not None and base_load is not None:
                    load_change = load / base_load - 1.0 if base_load > 0.0 else nan
            entries.append(EnsembleEntry(quantity, scheme, mean_interval(x, confidence), change, load, load_change))
    return EnsembleTable(quantities, schemes, len(values), confidence, tuple(entries))


def actuator_travel(source: Result | ArrayLike, channel: str | None = None, *, dt: float | None = None) -> float:
    """Actuator travel per second: mean absolute rate.

    Args:
      source: a result, with ``channel`` (such as ``pitch_1``), or (T,) angles, with ``dt``.
      channel: name of the channel.
      dt: [s] between the values of a bare series.

    Returns:
      integral of |rate| over time, over the duration, in the unit of the series per second. Turning points between
      values are missed, so it is a little low for a coarse series.

    Raises:
      InputError: required arguments besides the source are missing, or values are not finite or not evenly spaced.
    """
    x, step, _ = even_series(source, channel, dt, "actuator_travel")
    return float(np.abs(np.diff(x)).sum() / ((len(x) - 1) * step))


def rayleigh_weights(
    speeds: ArrayLike, mean_speed: float, edges: Sequence[float] | None = None, *, tails: Tails = "outside"
) -> Float:
    """Probabilities of wind speed bins in a Rayleigh distribution: :func:`weibull_weights` with k = 2.

    Source: IEC 61400-1, eq. (8) of edition 3: P(V) = 1 - exp(-pi (V / (2 V_ave))^2).
    """
    return weibull_weights(speeds, mean_speed, 2.0, edges, tails=tails)


def weibull_weights(
    speeds: ArrayLike, mean_speed: float, k: float, edges: Sequence[float] | None = None, *, tails: Tails = "outside"
) -> Float:
    """Probabilities of wind speed bins in a Weibull distribution.

    P(V) = 1 - exp(-(V / A)^k) with the scale A = V_ave / Gamma(1 + 1/k): IEC 61400-1, terms and definitions.

    Args:
      speeds: (n,) [m/s] ascending, one in each bin.
      mean_speed: [m/s] yearly mean at the hub, 0.2 V_ref for a standard class.
      k: shape; 2 is the Rayleigh distribution.
      edges: (n + 1,) [m/s] edges of the bins; half-way between the speeds by default, the outer ones as wide outwards
        as inwards.
      tails: "outside": speeds beyond the outer edges belong to no bin, such as those of standstill, whose probability
        is ``speed_exceedance``. "end_bins": they belong to the first and last bin.

    Returns:
      (n,) probabilities; their sum is one, or below one by what lies outside the edges.

    Raises:
      InputError: speeds or edges do not ascend, a speed lies outside its bin, a single speed has no edges, or there is
        no such treatment of the tails.
    """
    where = "wind speed weights"
    v = floats(speeds, "weibull_weights: speeds")
    if v.ndim != 1 or not len(v) or not np.all(np.isfinite(v)) or not np.all(np.diff(v) > 0.0) or v[0] < 0.0:
        raise InputError(f"{where}: speeds must be a row of ascending numbers, none negative")
    if tails not in ("outside", "end_bins"):
        raise InputError(f"{where}: tails must be 'outside' or 'end_bins', found {tails!r}")
    if edges is None:
        if len(v) < 2:
            raise InputError(f"{where}: a single speed needs the edges of its bin")
        middle = 0.5 * (v[1:] + v[:-1])
        e = np.concatenate([[max(2.0 * v[0] - middle[0], 0.0)], middle, [2.0 * v[-1] - middle[-1]]])
    else:
        e = floats(edges, "weibull_weights: edges")
        if e.shape != (len(v) + 1,) or np.any(np.isnan(e)) or e[0] < 0.0 or np.any(np.diff(e) <= 0.0):
            raise InputError(f"{where}: {len(v)} speeds need {len(v) + 1} ascending edges, none negative")
        if np.any(v < e[:-1]) or np.any(v > e[1:]):
            raise InputError(f"{where}: each speed must lie between the edges of its bin")
    if tails == "end_bins":
        e = np.concatenate([[0.0], e[1:-1], [inf]])
    beyond = speed_exceedance(e, mean_speed, k)
    weights: Float = beyond[:-1] - beyond[1:]
    return weights


def speed_exceedance(speeds: ArrayLike, mean_speed: float, k: float = 2.0) -> Float:
    """Probability that the mean wind speed is higher, in a Weibull distribution.

    Above cut-out it is the share of standstill in storms; one minus that of cut-in is the share of standstill in calms.

    Args:
      speeds: (n,) [m/s].
      mean_speed: [m/s] yearly mean at the hub.
      k: shape; 2 is the Rayleigh distribution.

    Returns:
      (n,) probabilities.

    Raises:
      InputError: ``mean_speed`` is not positive, or ``k`` out of range.
    """
    positive(mean_speed, "wind speed weights: mean_speed")
    if not LEAST_SHAPE <= positive(k, "wind speed weights: k") <= MOST_SHAPE:
        raise InputError(f"wind speed weights: k must lie between {LEAST_SHAPE:g} and {MOST_SHAPE:g}, found {k!r}")
    v = np.maximum(floats(speeds, "speed_exceedance: speeds"), 0.0)
    beyond: Float = np.exp(-((v / mean_speed * gamma(1.0 + 1.0 / k)) ** k))
    return beyond


def lifetime_del(
    speeds: ArrayLike,
    loads: ArrayLike,
    *,
    slope: float,
    mean_speed: float,
    k: float = 2.0,
    edges: Sequence[float] | None = None,
    operating_time: bool = False,
) -> float:
    """Lifetime damage-equivalent load for a Weibull distribution of the wind speed, (sum p_i DEL_i^m)^(1/m).

    Args:
      speeds: (n,) [m/s] ascending.
      loads: (n,) equivalent loads at these speeds, all for the same f_eq; of several seeds see ``ensemble_load``.
      slope: m of the S-N curve.
      mean_speed: [m/s] yearly mean at the hub.
      k: shape of the distribution; 2 is Rayleigh's.
      edges: (n + 1,) [m/s] edges of the bins, see ``weibull_weights``.
      operating_time: N_eq counts the time within the edges only, so the p_i sum to one; otherwise it counts all time,
        without damage outside the edges.

    Returns:
      in the unit of the loads, for the same f_eq, without transients between speeds, starts and stops.

    Raises:
      InputError: as ``weibull_weights``; a load is missing or negative, or ``slope`` is not positive.
    """
    x = _loads(loads, slope, "lifetime_del")
    weights = weibull_weights(speeds, mean_speed, k, edges)
    if x.shape != weights.shape:
        raise InputError(f"lifetime_del: found {len(x)} loads for {len(weights)} speeds")
    if operating_time:
        weights = weights / weights.sum()
    return _power_mean(x, weights, slope)


def _loads(loads: ArrayLike, slope: float, where: str) -> Float:
    x = floats(loads, where)
    if x.ndim != 1 or not len(x) or not np.all(np.isfinite(x)) or np.any(x < 0.0):
        raise InputError(f"{where}: loads must be a row of finite numbers, none negative")
    positive(slope, f"{where}: slope")
    return x


def _power_mean(x: Float, weights: Float, m: float) -> float:
    """(sum w x^m)^(1/m), scaled by the largest against overflow."""
    largest = float(x.max())
    if largest == 0.0:
        return 0.0
    return float(largest * np.sum(weights * (x / largest) ** m) ** (1.0 / m))


def _ratio(x: Float, base: Float) -> Float:
    ratio = np.full(len(x), nan)
    np.divide(x, base, out=ratio, where=(base != 0.0) & (x * base >= 0.0))
    return ratio


def _list(names: Iterator[str] | Sequence[str] | Mapping[str, object]) -> str:
    return ", ".join(names) or "none"
