"""Statistics of simulated against measured records, and what seeds and sensors can resolve.

Reference: docs/theory/validation.md (V-14 to V-18).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Self

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from meltemi.environment.site import STANDARD
from meltemi.validation.reduction import RANGE_ONLY, STATISTICS, ReducedRecord

Float = NDArray[np.float64]
CONFIDENCE = 0.95
"""Of all intervals, two-sided."""
BIN = 0.5
"""[m/s] width of the bins of a power curve (IEC 61400-12-1)."""


@dataclass(frozen=True)
class ComparedRecord:
    """A measured record and its simulations.

    Attributes:
      name: file and begin of the record.
      wind_speed, turbulence, air_density, shear_exponent: [m/s, -, kg/m^3, -] of the simulations.
      measured: reduced record.
      simulated: of each seed.
    """

    name: str
    wind_speed: float
    turbulence: float
    air_density: float
    shear_exponent: float
    measured: ReducedRecord = field(repr=False)
    simulated: tuple[ReducedRecord, ...] = field(repr=False)


@dataclass(frozen=True)
class Agreement:
    """Agreement of a statistic over records; deviations are simulated less measured, over the mean magnitude measured.

    Attributes:
      channel, statistic: names.
      records, seeds: numbers.
      measured, simulated: means over records, SI.
      bias, half: mean deviation [-] and half-width of its interval over records.
      scatter: standard deviation of the deviations [-].
      slope, intercept, correlation: of the line of simulated over measured values.
      resolvable: half-width [-] within which the bias of a right model lies, by seeds and sensors (V-16).
      covered: share of the records whose measured value lies in the prediction interval of its seeds [-].
    """

    channel: str
    statistic: str
    records: int
    seeds: int
    measured: float
    simulated: float
    bias: float
    half: float
    scatter: float
    slope: float
    intercept: float
    correlation: float
    resolvable: float
    covered: float

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
    """All records of a validation.

    Attributes:
      records: in the order of time.
      channels: compared channels.
      range_only: channels of which zero and gain are not known, see :data:`RANGE_ONLY`.
      accuracy: relative standard uncertainty of a sensor by channel [-].
    """

    records: tuple[ComparedRecord, ...]
    channels: tuple[str, ...]
    range_only: tuple[str, ...] = ()
    accuracy: Mapping[str, float] = field(default_factory=dict)

    def values(self, channel: str, statistic: str) -> tuple[Float, Float]:
        """(R,) measured and (R, K) simulated values, NaN where there is none."""
        i = STATISTICS.index(statistic)
        seeds = max((len(r.simulated) for r in self.records), default=0)
        simulated = np.full((len(self.records), seeds), np.nan)
        measured = np.full(len(self.records), np.nan)
        for row, each in enumerate(self.records):
            if channel in each.measured.values:
                measured[row] = each.measured.values[channel][i]
                simulated[row, : len(each.simulated)] = [s.values[channel][i] for s in each.simulated]
        return measured, simulated

    def agreements(self) -> list[Agreement]:
        """Of every channel and statistic with a value."""
        result = []
        for channel in self.channels:
            for statistic in RANGE_ONLY if channel in self.range_only else STATISTICS:
                each = agreement(channel, statistic, *self.values(channel, statistic), self.accuracy.get(channel, 0.0))
                result += [each] if each else []
        return result

    def some(self, rows: Sequence[int]) -> Self:
        """The comparison of some records."""
        return type(self)(tuple(self.records[i] for i in rows), self.channels, self.range_only, self.accuracy)


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
    count = np.isfinite(y).sum(axis=1)
    mean = np.nanmean(y, axis=1)
    squares = np.nansum((y - mean[:, None]) ** 2, axis=1)
    freedom = int((count - 1).sum())
    deviation = (mean - x) / scale
    line = stats.linregress(x, mean) if len(x) > 1 and np.ptp(x) > 0.0 else None
    resolvable = covered = np.nan
    if freedom > 0:
        quantile = float(stats.t.ppf(0.5 + 0.5 * CONFIDENCE, freedom))
        # one seed more is what happened; records of one seed have the mean variance of the others, relative to level
        variance = squares.sum() / freedom * (1.0 + 1.0 / count)
        seeds = float(np.sum(variance)) / len(x) ** 2 / scale**2
        resolvable = quantile * np.sqrt(seeds + accuracy**2)
        variances = np.where(count > 1, squares / np.maximum(count - 1, 1), np.nan)
        half = prediction_half(np.sqrt(variances), count)
        covered = float(np.nanmean(np.where(np.isfinite(half), np.abs(mean - x) <= half, np.nan)))
    spread = float(np.std(deviation, ddof=1)) if len(x) > 1 else np.nan
    half_width = spread / np.sqrt(len(x)) * float(stats.t.ppf(0.5 + 0.5 * CONFIDENCE, max(len(x) - 1, 1)))
    return Agreement(
        channel=channel,
        statistic=statistic,
        records=len(x),
        seeds=int(count.max()),
        measured=float(np.mean(x)),
        simulated=float(np.mean(mean)),
        bias=float(np.mean(deviation)),
        half=half_width,
        scatter=spread,
        slope=line.slope if line else np.nan,
        intercept=line.intercept if line else np.nan,
        correlation=line.rvalue if line else np.nan,
        resolvable=float(resolvable),
        covered=covered,
    )


def prediction_half(spread: Float, count: NDArray[np.intp]) -> Float:
    """Half-width about the mean of ``count`` seeds within which one seed more lies (V-15).

    Args:
      spread: (R,) standard deviation of the seeds.
      count: (R,) number of seeds.
    """
    freedom = np.maximum(count - 1, 1)
    return np.asarray(stats.t.ppf(0.5 + 0.5 * CONFIDENCE, freedom) * spread * np.sqrt(1.0 + 1.0 / count))


@dataclass(frozen=True)
class PowerBin:
    """A bin of the power curve: normalised wind speed [m/s], number of records, measured and simulated power [W] with
    the standard uncertainties of their means (category A)."""

    speed: float
    records: int
    measured: float
    measured_error: float
    simulated: float
    simulated_error: float


def power_curve(comparison: Comparison, channel: str = "generator_power") -> list[PowerBin]:
    """Measured and simulated power in bins of 0.5 m/s of the wind speed at 1.225 kg/m^3 (V-18, IEC 61400-12-1)."""
    measured, simulated = comparison.values(channel, "mean")
    mean = np.array([np.nan if np.isnan(y).all() else np.nanmean(y) for y in simulated])
    speed = np.array([r.wind_speed * (r.air_density / STANDARD) ** (1.0 / 3.0) for r in comparison.records])
    number = np.floor(speed / BIN + 0.5)
    bins = []
    for k in np.unique(number[np.isfinite(measured + mean)]):
        some = (number == k) & np.isfinite(measured + mean)
        n = int(some.sum())
        halves = [float(np.std(p[some], ddof=1) / np.sqrt(n)) if n > 1 else np.nan for p in (measured, mean)]
        bins.append(
            PowerBin(
                float(speed[some].mean()),
                n,
                float(measured[some].mean()),
                halves[0],
                float(mean[some].mean()),
                halves[1],
            )
        )
    return bins
