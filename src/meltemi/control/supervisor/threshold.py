"""Yaw protection: the largest yaw error that is tolerated, by the mean wind, and what is done beyond it.

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

from meltemi.core.kernel import kernel
from meltemi.core.record import Record, Vector

Float = NDArray[float64]

STRATEGIES = ("ignore", "stop", "derate")


class YawProtection(Record):
    """Settings of the yaw protection; the numbers are those of Wang et al. (2021)."""

    law: Literal["stepwise", "interpolated"] = "interpolated"
    """How the threshold depends on the mean wind between base points."""
    wind_speeds: Vector = Field(default_factory=lambda: np.array([0.0, 5.0, 10.0, 35.0]))
    """(n,) [m/s] of the base points, increasing; n >= 2."""
    thresholds: Vector = Field(default_factory=lambda: np.radians([60.0, 60.0, 45.0, 30.0]))
    """(n,) [rad] at the base points, not increasing."""
    window: float = Field(default=30.0, gt=0.0, le=3600.0)
    """[s] over which the wind is averaged."""
    filter_time: float = Field(default=1.0, ge=0.0)
    """[s] time constant of the yaw error's low-pass; 0: none."""
    strategy: Literal["derate", "stop", "ignore"] = "derate"
    """Beyond the threshold: derate and look again, stop at once, or nothing."""
    power_limit: float | None = Field(default=None, ge=0.0)
    """[W] electrical, of the derated turbine; two thirds of the rated power by default."""
    recheck_time: float = Field(default=90.0, gt=0.0)
    """[s] after which the error is looked at again, once."""
    derate_rate: float = Field(default=0.1, gt=0.0)
    """[1/s] share of rated power a second by which the set-point falls and rises."""
    latched: bool = True
    """Whether a stop lasts until the operator's word "start"; else until the error is within the threshold."""

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


@kernel
def threshold(x: Float, at: int, n: int, stepwise: float, wind: float) -> float:
    """Threshold [rad] at a mean wind speed [m/s] (C-60, C-61).

    Args:
      x: vector that holds n wind speeds and then n thresholds from the place ``at`` on.
      stepwise: 1: the stepwise law, 0: the interpolated one.
    """
    b = at + n
    if wind <= x[at]:
        return x[b]
    for i in range(n - 1):
        if wind <= x[at + i + 1]:
            if stepwise > 0.0:
                return x[b + i]
            share = (wind - x[at + i]) / (x[at + i + 1] - x[at + i])
            return x[b + i] + (x[b + i + 1] - x[b + i]) * share
    return x[b + n - 1]


def yaw_threshold(protection: YawProtection, wind_speed: ArrayLike) -> Float:
    """Largest yaw error that is tolerated.

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
