"""Statistics that require the azimuth."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import InputError
from meltemi.simulation.result import Result

Float = NDArray[np.float64]
ROUNDING = 1e-9
"""Tolerance of the number of revolutions."""


def means_over_revolutions(time: Float, azimuth: Float, x: Float) -> tuple[Float, Float]:
    """Azimuthal averages of x, one per full revolution, and their end times; exact for piecewise linear x.

    Args:
      time, azimuth, x: (T,) [s], [rad], anything.

    Raises:
      InputError: there is no full revolution.
    """
    turned = np.unwrap(azimuth)
    n = int((turned[-1] - turned[0]) / (2.0 * np.pi) + ROUNDING) if len(time) else 0
    if n < 1:
        raise InputError("azimuthal_averages: the series covers less than one revolution")
    ends = np.interp(turned[0] + 2.0 * np.pi * np.arange(n + 1.0), turned, time)
    area = np.concatenate([[0.0], np.cumsum(0.5 * (x[1:] + x[:-1]) * np.diff(time))])
    # the integral is quadratic between samples: continue from the sample before with the slope of the series
    i = np.clip(np.searchsorted(time, ends, side="right") - 1, 0, len(time) - 2)
    dt = ends - time[i]
    slope = (x[i + 1] - x[i]) / (time[i + 1] - time[i])
    means: Float = np.diff(area[i] + x[i] * dt + 0.5 * slope * dt**2) / np.diff(ends)
    return means, ends[1:]


def azimuthal_averages(result: Result, name: str) -> Float:
    """(revolutions,) azimuthal averages of a channel, one per full revolution; requires the channel ``azimuth``.

    Raises:
      InputError: the result has no full revolution.
    """
    return means_over_revolutions(result.time, result["azimuth"], result[name])[0]


def azimuth_bins(result: Result, name: str, n: int = 36) -> Float:
    """(n,) averages of a channel in azimuth bins; NaN for an empty bin."""
    return sector_means(result["azimuth"], result[name], n)


def sector_means(azimuth: Float, x: Float, n: int) -> Float:
    """(n,) averages of x (T,) in sectors of the azimuth (T,) [rad]; NaN for an empty one."""
    which = np.minimum((azimuth % (2.0 * np.pi) / (2.0 * np.pi) * n).astype(int), n - 1)
    total = np.bincount(which, weights=x, minlength=n)
    count = np.bincount(which, minlength=n)
    with np.errstate(invalid="ignore"):
        means: Float = total / count
    return means


def once_per_revolution(result: Result, names: Sequence[str]) -> dict[str, tuple[float, float]]:
    """Amplitudes of cosine and sine of the azimuth of channels, by least squares over the last whole revolutions.

    Results without a full revolution have none. Requires the channel ``azimuth``.
    """
    turned = np.unwrap(result["azimuth"])
    revolutions = int(np.ptp(turned) / (2.0 * np.pi) + ROUNDING) if len(turned) else 0
    if not revolutions:
        return {}
    last = turned >= turned[-1] - 2.0 * np.pi * revolutions
    waves = np.stack([np.ones(last.sum()), np.cos(turned[last]), np.sin(turned[last])], axis=1)
    parts = np.linalg.lstsq(waves, np.stack([result[name][last] for name in names], axis=1), rcond=None)[0]
    return {name: (float(parts[1, i]), float(parts[2, i])) for i, name in enumerate(names)}
