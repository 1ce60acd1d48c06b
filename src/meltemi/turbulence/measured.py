"""Fourier amplitudes of a series measured at the hub, for constrained turbulence.

Reference: docs/theory/wind.md (W-21).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import fft, linalg

from meltemi.core.errors import InputError
from meltemi.turbulence.grid import WindGrid
from meltemi.turbulence.synthesis import GAP_STREAM, add_noise
from meltemi.turbulence.targets import amplitude_variances
from meltemi.wind.turbulent import TurbulentWind

Float = NDArray[np.float64]
Complex = NDArray[np.complex128]


def hub_amplitudes(wind: TurbulentWind, grid: WindGrid, n: int) -> dict[int, Complex]:
    """Complex amplitudes (n / 2 + 1,) of the measured components at the hub, without the mean wind.

    The box is periodic in time. Gaps of the measurement are filled with random values conditioned on the
    measured ones (W-21): the precision matrix of a stationary series on a ring is circulant, so the gap is the
    solution of a Toeplitz system.
    """
    series = wind.hub_series
    assert series is not None
    lead = 0.0 if wind.periodic else 0.5 * grid.width  # see WindBox
    time = wind.dt * np.arange(n) - lead / wind.speed
    known = (time >= series.time[0]) & (time <= series.time[-1])
    if not known.any():
        raise InputError(
            f"hub series: it reaches from {series.time[0]:g} s to {series.time[-1]:g} s, "
            f"the field from {time[0]:g} s to {time[-1]:g} s"
        )
    half = amplitude_variances(wind, grid.hub_height, n)[1]
    result: dict[int, Complex] = {}
    for c, values in enumerate((series.u, series.v, series.w)):
        if values is None:
            continue
        variance = np.concatenate([half[c, :1], half[c], half[c, -1:]])
        fluctuation = np.interp(time, series.time, values) - (wind.speed if c == 0 else 0.0)
        result[c] = fft.rfft(_continued(fluctuation, known, variance, wind.seed, c), norm="forward")
    return result


def _continued(series: Float, known: NDArray[np.bool_], variance: Float, seed: int, component: int) -> Float:
    """Extend a periodic series (n,) of given amplitude variances (n / 2 + 1,) from its known values."""
    if known.all():
        return series
    n = len(series)
    amplitudes = np.zeros((1, n // 2 + 1), np.complex128)
    add_noise(amplitudes, np.sqrt(variance[1:-1]), seed, 0, GAP_STREAM + component)
    free = fft.irfft(amplitudes[0], n, norm="forward")
    precision = fft.irfft(1.0 / variance, n)
    begin = int(np.flatnonzero(known & ~np.roll(known, -1))[0]) + 1  # precision matrix of the gap
    gap = (begin + np.arange(n - int(known.sum()))) % n
    difference = np.where(known, series - free, 0.0)
    pull = fft.irfft(fft.rfft(difference) / variance, n)
    difference[gap] = -linalg.solve_toeplitz(precision[: len(gap)], pull[gap])
    return free + difference
