"""Degree of attachment and fully separated lift of a polar for dynamic stall (host side).

A static lift coefficient is split into an attached and a separated share:

    C_L = f C_La (alpha - alpha_0) + (1 - f) C_L,fs,   f = (2 sqrt(C_L / (C_La (alpha - alpha_0))) - 1)^2

Reference: docs/theory/aerodynamics.md (A-40); Hansen, Gaunaa & Madsen (2004), Risoe-R-1354, Eqs. 14-19.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Float = NDArray[np.float64]

LINEAR_RANGE = np.radians(20.0)
"""[rad] half-width around zero of the range in which attached flow is sought."""


@dataclass(frozen=True)
class StallTable:
    """Constants and tables of a polar.

    Attributes:
      slope: [1/rad] C_La.
      zero_lift: [rad] alpha_0.
      drag_floor: drag coefficient at alpha_0.
      attachment: (P,) degree of attachment f.
      attached_lift: (P,) C_La (alpha - alpha_0); C_L itself where that exceeds it.
      separated_lift: (P,) C_L,fs.
    """

    slope: float
    zero_lift: float
    drag_floor: float
    attachment: Float
    attached_lift: Float
    separated_lift: Float


def hansen(alpha: Float, lift: Float, drag: Float) -> StallTable:
    """Split of the model's authors: C_La is the largest C_L / (alpha - alpha_0) away from alpha_0; the static lift
    is recovered exactly.

    Args:
      alpha: (P,) [rad]; lift, drag: (P,).
    """
    zero = zero_lift_angle(alpha, lift)
    d = alpha - zero
    near = (np.abs(alpha) < LINEAR_RANGE) & (np.abs(d) > np.radians(2.0))
    slope = float(np.max(lift[near] / d[near]))
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = lift / (slope * d)
    ratio[np.abs(d) < np.radians(0.05)] = 1.0
    attachment = (2.0 * np.sqrt(np.clip(ratio, 0.25, 1.0)) - 1.0) ** 2
    # beyond the first angle at which the lift is a quarter of the attached one, the flow stays separated
    best = np.flatnonzero(near)[
        [
            int(np.argmax(np.where(d[near] > 0.0, ratio[near], -1.0))),
            int(np.argmax(np.where(d[near] < 0.0, ratio[near], -1.0))),
        ]
    ]
    high = best[0] + int(np.argmax(np.append(ratio[best[0] :], 0.0) <= 0.25))
    low = best[1] - int(np.argmax(np.append(ratio[best[1] :: -1], 0.0) <= 0.25))
    attachment[high:] = 0.0
    attachment[: max(low, 0) + 1] = 0.0
    attached = np.where(ratio > 1.0, lift, slope * d)
    full = attachment > 1.0 - 1e-6
    separated = np.where(full, 0.5 * lift, (lift - attached * attachment) / np.where(full, 1.0, 1.0 - attachment))
    return StallTable(slope, zero, float(np.interp(zero, alpha, drag)), attachment, attached, separated)


def zero_lift_angle(alpha: Float, lift: Float) -> float:
    """Angle [rad] nearest to zero at which the lift rises through zero."""
    inside = np.abs(alpha) < LINEAR_RANGE
    a, c = alpha[inside], lift[inside]
    rising = np.flatnonzero((c[:-1] <= 0.0) & (c[1:] > 0.0))
    if len(rising) == 0:
        return 0.0
    zeros = a[rising] - c[rising] * (a[rising + 1] - a[rising]) / (c[rising + 1] - c[rising])
    return float(zeros[np.argmin(np.abs(zeros))])


def openfast(alpha: Float, lift: Float, drag: Float, zero_lift: float, drag_floor: float) -> StallTable:
    """Split of OpenFAST 5 (UA_Mod 4): slope by least squares over the middle of the attached range, a given zero
    of the lift, and attachment limited to 0..1 afterwards; the static lift is then not recovered
    exactly.

    Args:
      alpha: (P,) [rad] rows of the polar's file; lift, drag: (P,).
      zero_lift: [rad] alpha_0 of the file; drag_floor: C_d0 of the file.
    """
    lower, upper, slope = _openfast_range(alpha, lift, drag, drag_floor)
    d = alpha - zero_lift
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.maximum(lift / (slope * d), 0.0)
    f = np.where(d == 0.0, 1.0, (2.0 * np.sqrt(np.nan_to_num(ratio)) - 1.0) ** 2)
    separated = np.where(f < 1.0, (lift - slope * d * f) / np.where(f < 1.0, 1.0 - f, 1.0), 0.5 * lift)
    f = np.minimum(f, 1.0)
    below, above = np.flatnonzero(alpha < lower), np.flatnonzero(alpha > upper)
    cut_low = below[len(below) - 1 - int(np.argmin(f[below][::-1]))]
    cut_high = above[int(np.argmin(f[above]))]
    f[: cut_low + 1] = 0.0
    f[cut_high:] = 0.0
    separated[: cut_low + 1], separated[cut_high:] = lift[: cut_low + 1], lift[cut_high:]
    span = slope * d - separated
    f = np.where(span == 0.0, 1.0, (lift - separated) / np.where(span == 0.0, 1.0, span))
    return StallTable(slope, zero_lift, drag_floor, np.clip(f, 0.0, 1.0), slope * d, separated)


def _openfast_range(alpha: Float, lift: Float, drag: Float, drag_floor: float) -> tuple[float, float, float]:
    """Limits [rad] of the attached range and slope of the lift in its middle."""
    limit = np.radians(20.0)
    normal = lift * np.cos(alpha) + (drag - drag_floor) * np.sin(alpha)
    slopes = np.diff(normal) / np.diff(alpha)
    middle = 0.5 * (alpha[1:] + alpha[:-1])
    u = (middle[:, None] - middle[None, :]) / np.radians(2.0)
    weight = np.where(np.abs(u) < 1.0, (1.0 - u**2) ** 3, 0.0)
    smooth = (weight @ slopes) / weight.sum(axis=1)
    small = np.flatnonzero(np.abs(alpha) <= limit + 1e-9)
    start = int(small[np.argmin(drag[small])])
    i_high = int(np.flatnonzero(middle >= limit)[0])
    i_low = int(np.flatnonzero(middle <= -limit)[-1])
    at_start = float(np.interp(alpha[start], middle, smooth))
    upper, largest = float(middle[i_high]), at_start
    for i in range(start, i_high + 1):
        largest = max(largest, float(smooth[i]))
        if smooth[i] < 0.9 * largest:
            upper = float(alpha[start]) if i == start else float(middle[i - 1])
            break
    lower, largest = float(middle[i_low]), at_start
    for i in range(start - 1, i_low - 1, -1):
        largest = max(largest, float(smooth[i]))
        if smooth[i] < 0.9 * largest:
            lower = float(alpha[start]) if i == start - 1 else float(middle[i + 1])
            break
    margin = 0.2 * (upper - lower)
    used = (alpha >= lower + margin) & (alpha <= upper - margin)
    # thick sections may stall so early that no line can be drawn through what is left
    slope = float(np.polyfit(alpha[used], lift[used], 1)[0]) if used.sum() > 1 else at_start
    return lower, upper, slope
