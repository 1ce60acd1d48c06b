"""Statistics of simulated against measured records, and what seeds and sensors can resolve.

Reference: docs/theory/validation.md (V-14 to V-18).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import stats

from meltemi.environment.site import STANDARD
from meltemi.validation.reduction import RANGE_ONLY, STATISTICS, ReducedRecord

if TYPE_CHECKING:
    import pandas as pd

Float = NDArray[np.float64]
CONFIDENCE = 0.95
"""Of all intervals, two-sided."""
BIN = 0.5
"""[m/s] width of the bins of a power curve (IEC 61400-12-1)."""


@dataclass(frozen=True)
class ComparedRecord:
    """A measured record and its simulations."""

    name: str  # file and begin of the record
    wind_speed: float  # [m/s] of the simulations, as the following
    turbulence: float  # [-]
    air_density: float  # [kg/m^3]
    shear_exponent: float  # [-]
    measured: ReducedRecord = field(repr=False)
    simulated: tuple[ReducedRecord, ...] = field(repr=False)  # of each seed


@dataclass(frozen=True)
class Agreement:
    """Agreement of a statistic over records; deviations are simulated less measured, over the mean of magnitudes."""

    channel: str
    statistic: str
    records: int
    seeds: int
    measured: float  # mean over records, SI
    simulated: float
    bias: float  # mean deviation [-]
    half: float  # half-width of its interval over records [-]
    scatter: float  # standard deviation of the deviations [-]
    slope: float  # of the line of simulated over measured values
    intercept: float
    correlation: float
    resolvable: float  # half-width [-] within which the bias of a right model lies, by seeds and sensors (V-16)
    covered: float  # share of the records whose measured value lies in the prediction interval of its seeds [-]

    @property
    def outside(self) -> float:
        """By how much the bias exceeds what can be resolved [-]; 0 inside it, NaN where nothing can be said."""
        return float(np.maximum(abs(self.bias) - self.resolvable, 0.0))

    @property
    def verdict(self) -> str:
        """One phrase."""
        if not np.isfinite(self.resolvable):
            return "not resolved: one seed"
        return f"outside by {100.0 * self.outside:.1f} %" if self.outside > 0.0 else "inside"


@dataclass(frozen=True)
class Comparison:
    """All records of a validation."""

    records: tuple[ComparedRecord, ...]  # in the order of time
    channels: tuple[str, ...]
    range_only: tuple[str, ...] = ()  # channels of which zero and gain are not known, see :data:`RANGE_ONLY`
    accuracy: Mapping[str, float] = field(default_factory=dict)  # relative standard uncertainty by channel [-]

    def values(self, channel: str, statistic: str) -> tuple[Float, Float]:
        """(R,) measured and (R, K) simulated values, NaN where there is none."""
        i = STATISTICS.index(statistic)
        measured = np.full(len(self.records), np.nan)
        simulated = np.full((len(self.records), max((len(r.simulated) for r in self.records), default=0)), np.nan)
        for row, each in enumerate(self.records):
            if channel in each.measured.values:
                measured[row] = each.measured.values[channel][i]
                simulated[row, : len(each.simulated)] = [s.values[channel][i] for s in each.simulated]
        return measured, simulated

    def agreements(self) -> list[Agreement]:
        """Of every channel and statistic with a value."""
        pairs = [(c, s) for c in self.channels for s in (RANGE_ONLY if c in self.range_only else STATISTICS)]
        every = (agreement(c, s, *self.values(c, s), self.accuracy.get(c, 0.0)) for c, s in pairs)
        return [each for each in every if each]

    def some(self, rows: Sequence[int]) -> Self:
        """The comparison of some records."""
        return replace(self, records=tuple(self.records[i] for i in rows))


def mean_of_known(x: Float, axis: int = -1) -> Float:
    """Mean along an axis of what is not missing; NaN where everything is."""
    return np.asarray(np.ma.masked_invalid(x).mean(axis).filled(np.nan))


def agreement(
    channel: str, statistic: str, measured: Float, simulated: Float, accuracy: float = 0.0
) -> Agreement | None:
    """Agreement of a statistic (V-14 to V-17); None without a record.

    Args:
      channel, statistic: names.
      measured: (R,).
      simulated: (R, K) by seeds.
      accuracy: relative standard uncertainty of the sensor, the same in all records [-].
    """
    there = np.isfinite(measured) & np.isfinite(simulated).any(axis=1)
    x, y = measured[there], simulated[there]
    scale = float(np.mean(np.abs(x))) if len(x) else 0.0
    if scale == 0.0:
        return None
    n, count, mean = len(x), np.isfinite(y).sum(axis=1), mean_of_known(y)
    squares, freedom = np.nansum((y - mean[:, None]) ** 2, axis=1), int((count - 1).sum())
    deviation = (mean - x) / scale
    line = stats.linregress(x, mean) if n > 1 and np.ptp(x) > 0.0 else None
    resolvable = covered = np.nan
    if freedom > 0:
        # one seed more is what happened; records of one seed have the mean variance of the others, relative to level
        variance = squares.sum() / freedom * (1.0 + 1.0 / count)
        seeds = float(np.sum(variance)) / n**2 / scale**2
        resolvable = float(student(freedom) * np.sqrt(seeds + accuracy**2))
        variances = np.where(count > 1, squares / np.maximum(count - 1, 1), np.nan)
        half = prediction_half(np.sqrt(variances), count)
        covered = float(np.nanmean(np.where(np.isfinite(half), np.abs(mean - x) <= half, np.nan)))
    scatter = float(np.std(deviation, ddof=1)) if n > 1 else np.nan
    interval = scatter / np.sqrt(n) * float(student(max(n - 1, 1)))
    means = float(np.mean(x)), float(np.mean(mean)), float(np.mean(deviation))
    fitted: tuple[float, float, float] = (line.slope, line.intercept, line.rvalue) if line else (np.nan, np.nan, np.nan)
    return Agreement(channel, statistic, n, int(count.max()), *means, interval, scatter, *fitted, resolvable, covered)


def student(freedom: ArrayLike) -> Float:
    """Half-width of Student's interval over the standard error."""
    return np.asarray(stats.t.ppf(0.5 + 0.5 * CONFIDENCE, freedom))


def prediction_half(spread: Float, count: NDArray[np.intp]) -> Float:
    """(R,) half-width about the mean of ``count`` seeds of a deviation within which one seed more lies (V-15)."""
    return np.asarray(student(np.maximum(count - 1, 1)) * spread * np.sqrt(1.0 + 1.0 / count))


def power_curve(comparison: Comparison, channel: str = "generator_power") -> pd.DataFrame:
    """Measured and simulated power in bins of 0.5 m/s of the wind speed at 1.225 kg/m^3 (V-18, IEC 61400-12-1).

    Columns: normalised wind ``speed`` [m/s], number of ``records``, ``measured`` and ``simulated`` power [W], and of
    both the standard uncertainty of the mean (category A), ``measured_error`` and ``simulated_error``.
    """
    import pandas as pd

    measured, seeds = comparison.values(channel, "mean")
    speed = np.array([r.wind_speed * (r.air_density / STANDARD) ** (1.0 / 3.0) for r in comparison.records])
    table = pd.DataFrame({"speed": speed, "measured": measured, "simulated": mean_of_known(seeds)}).dropna()
    bins = table.groupby(np.floor(table["speed"] / BIN + 0.5))
    return bins.mean().join(bins.sem().add_suffix("_error")).assign(records=bins.size())
