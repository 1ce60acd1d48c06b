"""Ten-minute statistics of measured or simulated series, and their wind speed bins.

Means, standard deviations and extremes of fixed periods are what IEC TS 61400-13 stores of a load measurement; bins of
1 m/s centred on whole numbers are those of IEC 61400-12-1. A bin has the mean of the means, the mean of the
standard deviations, the smallest minimum and the largest maximum of its periods.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from meltemi.core.errors import InputError, did_you_mean
from meltemi.core.extras import need
from meltemi.postprocess.inputs import floats, positive

if TYPE_CHECKING:
    import pandas as pd

    from meltemi.simulation.result import Result

Float = NDArray[np.float64]
MOST_PERIODS = 2.0**53
"""Largest number of periods that a float counts one by one."""
OVER_PERIODS = {"mean": "mean", "std": "mean", "min": "min", "max": "max"}
"""Statistics of periods, and the statistic of each in a bin."""
STATISTICS = tuple(OVER_PERIODS)
TEN_MINUTES = 600.0
"""[s] length of the periods."""
EDGES = (0.0, *(k + 0.5 for k in range(2, 25)))
"""[m/s] up to 2.5 in one bin, then 1 m/s each, centred on whole numbers."""


def period_statistics(
    time: ArrayLike, series: Mapping[str, ArrayLike], *, period: float = TEN_MINUTES, complete: float = 1.0
) -> pd.DataFrame:
    """Statistics of consecutive periods of measured time series.

    Args:
      time: (T,) [s], increasing; gaps are allowed. Periods begin at whole multiples of ``period``.
      series: (T,) values by name, NaN where a sample is missing, for example ``{"wind_speed": v, "power": p}``.
      period: [s].
      complete: share of the samples a period of this sampling rate would have that it must have, in every series;
        periods with fewer are left out.

    Returns:
      One row a period, its begin [s] as index; columns (name, "mean" | "std" | "min" | "max"). The standard deviation
      is that of the samples about their mean (divided by n).

    Raises:
      InputError: times do not increase, lengths differ, or a number is out of range.
      MissingPackageError: pandas is not installed.
    """
    need("period_statistics", "pandas")
    import pandas as pd

    t = floats(time, "period_statistics: time")
    if t.ndim != 1 or len(t) < 2 or not np.all(np.diff(t) > 0.0):
        raise InputError("period_statistics: time must be at least two increasing numbers of seconds")
    positive(period, "period_statistics: period")
    if not 0.0 < complete <= 1.0:
        raise InputError(f"period_statistics: complete must lie in (0, 1], found {complete!r}")
    values = {name: floats(x, "period_statistics") for name, x in series.items()}
    for name, x in values.items():
        if x.shape != t.shape:
            raise InputError(f"period_statistics: {name!r} has shape {x.shape}, time has {t.shape}")
    step = float(np.median(np.diff(t)))
    with np.errstate(over="ignore"):
        which = np.floor(t / period + 1e-9)
    if not np.abs(which).max() < MOST_PERIODS:
        raise InputError(f"period_statistics: period {period:g} s is too short for times up to {np.abs(t).max():g} s")
    expected = complete * (period / step) - 0.5  # a period may have lost or won a sample by rounding
    samples = pd.DataFrame({name: np.where(np.isfinite(x), x, np.nan) for name, x in values.items()})
    groups = samples.groupby(pd.Index(which * period, name="begin"))
    statistics = pd.concat(
        {"mean": groups.mean(), "std": groups.std(ddof=0), "min": groups.min(), "max": groups.max()}, axis=1
    )
    whole = (groups.count() >= max(expected, 1.0)).all(axis=1)
    return statistics.swaplevel(axis=1).loc[whole, pd.MultiIndex.from_product([list(values), STATISTICS])]


def result_statistics(result: Result, names: Sequence[str], *, begin: float = 0.0) -> pd.DataFrame:
    """Statistics of a simulation, as one period from ``begin`` [s] to its end, in SI units.

    Raises:
      InputError: a channel is not there.
      MissingPackageError: pandas is not installed.
    """
    need("result_statistics", "pandas")
    import pandas as pd

    part = result.between(begin, np.inf)
    row = {(name, of): float(getattr(part[name], of)()) for name in names for of in STATISTICS}
    return pd.DataFrame([row], index=pd.Index([begin], name="begin"), columns=pd.MultiIndex.from_tuples(list(row)))


def bin_statistics(periods: pd.DataFrame, by: str = "wind_speed", *, edges: Sequence[float] = EDGES) -> pd.DataFrame:
    """Statistics of periods, binned by the mean of one of the series.

    Args:
      periods: table of ``period_statistics``; those of several records can be joined by ``pandas.concat``.
      by: name of the series whose mean gives the bin.
      edges: edges of the bins, increasing, in the unit of that series. A bin holds from its lower edge, included, to
        its upper one, excluded; the last bin holds its upper edge as well.

    Returns:
      One row a bin, numbered from 1, empty ones with NaN; columns ("bin", "from"), ("bin", "to"), ("bin", "sets"), and
      for each series mean of means, mean of standard deviations, smallest minimum, largest maximum; for the series
      ``by`` also ("bin", "intensity"): mean of standard deviation over mean.

    Raises:
      InputError: no such series, or edges that do not increase.
      MissingPackageError: pandas is not installed.
    """
    need("bin_statistics", "pandas")
    import pandas as pd

    names = list(dict.fromkeys(name for name, _ in periods.columns))
    if by not in names:
        raise InputError(f"bin_statistics: no series {by!r}: {did_you_mean(by, names)}")
    limits = floats(edges, "bin_statistics: edges")
    if limits.ndim != 1 or len(limits) < 2 or not np.all(np.diff(limits) > 0.0):
        raise InputError("bin_statistics: edges must be at least two increasing numbers")
    mean = periods[by, "mean"].to_numpy()
    which = np.searchsorted(limits, mean, side="right")
    which[mean == limits[-1]] -= 1
    groups, bins = periods.groupby(which), pd.RangeIndex(1, len(limits), name="bin")
    head = pd.DataFrame(
        {
            ("bin", "from"): limits[:-1],
            ("bin", "to"): limits[1:],
            ("bin", "sets"): groups.size().reindex(bins, fill_value=0),
            ("bin", "intensity"): (periods[by, "std"] / periods[by, "mean"]).groupby(which).mean().reindex(bins),
        },
        bins,
    )
    return head.join(
        groups.agg({(name, of): over for name in names for of, over in OVER_PERIODS.items()}).reindex(bins)
    )
