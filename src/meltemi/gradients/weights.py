"""Derivatives of the statistics of a time series with respect to parameters.

Every statistic is a function of the values of the series alone, smooth but for the choice of instants: that
of the largest value, and those of the turning points. A small change of a parameter leaves these as they
are, so they are held. Equations F-12 to F-15 of ``docs/theory/fatigue.md``; cycles by ASTM E1049-85 (2017).

Each function takes the series (T,) and its derivatives (T, P), and returns the value and its derivatives (P,).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from meltemi.core.errors import InputError
from meltemi.postprocess.cycles import Cycles, cycle_ends, cycle_load
from meltemi.postprocess.fatigue import check_equivalent
from meltemi.postprocess.inputs import floats, one_row

Float = NDArray[np.float64]


def _checked(series: ArrayLike, derivatives: ArrayLike) -> tuple[Float, Float]:
    x, dx = floats(series, "series"), floats(derivatives, "derivatives")
    if x.ndim != 1 or dx.ndim != 2 or len(dx) != len(x) or len(x) == 0:
        raise InputError(f"derivatives of a series (T,) must be (T, P), T > 0; found {x.shape} and {dx.shape}")
    return x, dx


def mean_gradient(series: ArrayLike, derivatives: ArrayLike) -> tuple[float, Float]:
    """Mean and its derivatives (F-12)."""
    x, dx = _checked(series, derivatives)
    return float(x.mean()), dx.mean(axis=0)


def std_weights(series: ArrayLike) -> tuple[float, Float]:
    """Standard deviation, sum over T, and its derivatives by the values of the series (F-12); 0 if it is constant."""
    x = one_row(series, "std_weights")
    if np.ptp(x) == 0.0:
        return 0.0, np.zeros(len(x))
    scale = float(np.ldexp(1.0, np.frexp(np.abs(x).max())[1] - 1))  # a power of two: squares neither overflow nor round
    y = x / scale
    std = float(y.std())
    return scale * std, (y - y.mean()) / (len(y) * std)


def std_gradient(series: ArrayLike, derivatives: ArrayLike) -> tuple[float, Float]:
    """Standard deviation, sum over T (F-12); derivatives 0 if the series is constant."""
    x, dx = _checked(series, derivatives)
    std, weights = std_weights(x)
    gradient: Float = weights @ dx
    return std, gradient


def min_gradient(series: ArrayLike, derivatives: ArrayLike) -> tuple[float, Float]:
    """Minimum and its derivatives, at its first occurrence (F-13)."""
    x, dx = _checked(series, derivatives)
    at = int(np.argmin(x))
    return float(x[at]), dx[at].copy()


def max_gradient(series: ArrayLike, derivatives: ArrayLike) -> tuple[float, Float]:
    """Maximum and its derivatives, at its first occurrence (F-13)."""
    x, dx = _checked(series, derivatives)
    at = int(np.argmax(x))
    return float(x[at]), dx[at].copy()


def del_weights(series: ArrayLike, *, duration: float, slope: float, f_eq: float = 1.0) -> tuple[float, Float]:
    """Damage-equivalent load without bins and its derivatives by the values of the series (F-14, F-15).

    Arguments and errors are those of :func:`del_gradient`.
    """
    x = one_row(series, "del_weights", least=2)
    check_equivalent(duration, slope, f_eq)
    first, second, counts = cycle_ends(x)
    rise = x[first] - x[second]
    load = cycle_load(Cycles(np.abs(rise), x[first], counts), slope=slope, reference=f_eq * duration)
    weights = np.zeros(len(x))
    if load > 0.0:
        cycle = counts / (f_eq * duration) * (np.abs(rise) / load) ** (slope - 1.0) * np.sign(rise)
        np.add.at(weights, first, cycle)
        np.subtract.at(weights, second, cycle)
    return load, weights


def del_gradient(
    series: ArrayLike, derivatives: ArrayLike, *, duration: float, slope: float, f_eq: float = 1.0
) -> tuple[float, Float]:
    """Damage-equivalent load without bins (F-14, F-15); derivatives 0 if there are no cycles.

    Args:
      series: (T,) values.
      derivatives: (T, P) derivatives by the parameters.
      duration: [s] duration of the series, held constant.
      slope: m of the S-N curve.
      f_eq: [Hz] frequency of the equivalent load.

    Returns:
      the value of ``damage_equivalent_load``, and its derivatives (P,).

    Raises:
      InputError: shapes do not fit, or ``duration``, ``slope`` or ``f_eq`` is not positive.
    """
    x, dx = _checked(series, derivatives)
    load, weights = del_weights(x, duration=duration, slope=slope, f_eq=f_eq)
    gradient: Float = weights @ dx
    return load, gradient
