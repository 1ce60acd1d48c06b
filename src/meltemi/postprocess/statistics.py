"""Statistics that need more than a column of numbers."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import InputError
from meltemi.simulation.result import Result

Float = NDArray[np.float64]


def revolution_means(result: Result, name: str) -> Float:
    """(revolutions,) averages of a channel over each full revolution, exact for series linear between records.

    Needs the channel ``azimuth`` beside it.

    Raises:
      InputError: the result has no full revolution.
    """
    azimuth = np.unwrap(result["azimuth"])
    turns = np.floor((azimuth - azimuth[0]) / (2.0 * np.pi))
    n = int(turns[-1])
    if n < 1:
        raise InputError("revolution_means: the result covers less than one revolution")
    ends = np.interp(azimuth[0] + 2.0 * np.pi * np.arange(n + 1), azimuth, result.time)
    area = np.concatenate([[0.0], np.cumsum(0.5 * (result[name][1:] + result[name][:-1]) * np.diff(result.time))])
    # the integral between records is quadratic in time; interpolate it with the series' own slope
    i = np.clip(np.searchsorted(result.time, ends, side="right") - 1, 0, len(result.time) - 2)
    dt = ends - result.time[i]
    slope = (result[name][i + 1] - result[name][i]) / (result.time[i + 1] - result.time[i])
    integral = area[i] + result[name][i] * dt + 0.5 * slope * dt**2
    means: Float = np.diff(integral) / np.diff(ends)
    return means


def azimuth_bins(result: Result, name: str, n: int = 36) -> Float:
    """(n,) averages of a channel over bins of the azimuth; NaN where a bin is empty."""
    which = np.minimum((result["azimuth"] % (2.0 * np.pi) / (2.0 * np.pi) * n).astype(int), n - 1)
    total = np.bincount(which, weights=result[name], minlength=n)
    count = np.bincount(which, minlength=n)
    with np.errstate(invalid="ignore"):
        means: Float = total / count
    return means
