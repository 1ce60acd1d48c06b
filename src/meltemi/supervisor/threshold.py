"""Yaw protection: permissible yaw error by mean wind speed, with derating or stop beyond it.

    stepwise       b = b_i of the last base point below c; b_1 up to the first one and at it
    interpolated   b = b_i + (b_{i+1} - b_i) (c - c_i) / (c_{i+1} - c_i) between base points, constant beyond them

with c the mean of the wind over a window [m/s]. Equality is within the threshold.

Reference: docs/theory/control.md (C-60 to C-62); Wang et al. (2021), Table 3 and Figs 6 to 8.
"""

from __future__ import annotations

import math
from typing import Literal, Self

import numpy as np
from numpy import float64
from numpy.typing import ArrayLike, NDArray
from pydantic import Field, model_validator

from meltemi.compiler import Numbers, Table, kernel, number, series, whole
from meltemi.core.record import Record, Vector

Float = NDArray[float64]

STRATEGIES = ("ignore", "stop", "derate")


class YawProtection(Record):
    """Settings of the yaw protection; the numbers are those of Wang et al. (2021)."""

    law: Literal["stepwise", "interpolated"] = "interpolated"
    """Dependence of the threshold on the mean wind between base points."""
    wind_speeds: Vector = Field(default_factory=lambda: np.array([0.0, 5.0, 10.0, 35.0]))
    """(n,) [m/s] mean wind speeds of the base points, increasing; n >= 2."""
    thresholds: Vector = Field(default_factory=lambda: np.radians([60.0, 60.0, 45.0, 30.0]))
    """(n,) [rad] thresholds at the base points, not increasing."""
    window: float = Field(default=30.0, gt=0.0, le=3600.0)
    """[s] averaging time of the wind."""
    filter_time: float = Field(default=1.0, ge=0.0)
    """[s] time constant of the low-pass filter of the yaw error; 0: none."""
    strategy: Literal["derate", "stop", "ignore"] = "derate"
    """Beyond the threshold: derate and recheck, stop at once, or do nothing."""
    power_limit: float | None = Field(default=None, ge=0.0)
    """[W] electrical power of the derated turbine; two thirds of the rated power by default."""
    recheck_time: float = Field(default=90.0, gt=0.0)
    """[s] time after which the error is checked again, once."""
    derate_rate: float = Field(default=0.1, gt=0.0)
    """[1/s] rate limit of the set-point, as a share of rated power."""
    latched: bool = True
    """A stop lasts until the operator requests "start"; otherwise until the error is within the threshold."""

    @model_validator(mode="after")
    def _check(self) -> Self:
        c, b = self.wind_speeds, self.thresholds
        if len(c) < 2 or len(c) != len(b):
            raise ValueError(
                f"wind_speeds and thresholds need the same number of base points, two or more; "
                f"found {len(c)} and {len(b)}"
            )
        if np.any(np.diff(c) <= 0.0):
            i = int(np.flatnonzero(np.diff(c) <= 0.0)[0])
            raise ValueError(f"wind_speeds must increase, but entry {i + 2} is {c[i + 1]:g} after {c[i]:g} m/s")
        if np.any(np.diff(b) > 0.0):
            i = int(np.flatnonzero(np.diff(b) > 0.0)[0])
            raise ValueError(
                f"thresholds must not rise with the wind, but entry {i + 2} is {b[i + 1]:g} after {b[i]:g} rad"
            )
        if b[-1] < 0.0 or b[0] > math.pi:
            hint = "; if these are degrees, multiply by pi/180 = 0.01745329" if b[0] > math.pi else ""
            raise ValueError(f"thresholds are angles from 0 to pi rad, found {b[0]:g} to {b[-1]:g}{hint}")
        return self


class YawThreshold(Table):
    """Base points of the threshold."""

    stepwise: float = number("-", "1: stepwise law, 0: interpolated")
    points: float = number("-", "number of base points; 0: no protection")
    wind_speed: Numbers = series("m/s", "wind speeds of the base points", "points")
    threshold: Numbers = series("rad", "thresholds at the base points", "points")


@kernel
def threshold(x: YawThreshold, wind: float) -> float:
    """Threshold [rad] at a mean wind speed [m/s] (C-61, C-62)."""
    c, b, n = x.wind_speed, x.threshold, whole(x.points)
    if wind <= c[0]:
        return b[0]
    for i in range(n - 1):
        if wind <= c[i + 1]:
            if x.stepwise > 0.0:
                return b[i]
            share = (wind - c[i]) / (c[i + 1] - c[i])
            return b[i] + (b[i + 1] - b[i]) * share
    return b[n - 1]


def threshold_settings(protection: YawProtection) -> YawThreshold:
    """Base points of a protection."""
    return YawThreshold.of(
        stepwise=protection.law == "stepwise", wind_speed=protection.wind_speeds, threshold=protection.thresholds
    )


def yaw_threshold(protection: YawProtection, wind_speed: ArrayLike) -> Float:
    """Permissible yaw error.

    Args:
      wind_speed: [m/s] mean over the protection's window, of any shape.

    Returns:
      [rad] of the same shape.
    """
    c, b = protection.wind_speeds, protection.thresholds
    wind = np.asarray(wind_speed, dtype=float)
    i = np.clip(np.searchsorted(c, wind, side="left") - 1, -1, len(c) - 1)
    low, high = np.clip(i, 0, None), np.clip(i + 1, 0, len(c) - 1)
    if protection.law == "stepwise":
        return b[low]
    span = np.where(high > low, c[high] - c[low], 1.0)
    share = np.where(high > low, (wind - c[low]) / span, 0.0)
    return b[low] + (b[high] - b[low]) * share
