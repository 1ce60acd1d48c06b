"""Attached range of a polar, as OpenFAST 5 finds it."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from meltemi.aero.stall_tables import _openfast_range

Float = NDArray[np.float64]
DEG = np.pi / 180.0
ALPHA = DEG * np.arange(-40.0, 41.0)
DRAG = 0.01 + 0.5 * ALPHA**2


def lift_of(normal: Float) -> Float:
    """Lift coefficient of a normal force, beside the drag above its smallest value."""
    return (normal - (DRAG - 0.01) * np.sin(ALPHA)) / np.cos(ALPHA)


@pytest.mark.parametrize(
    ("stall_low", "stall_high", "lower", "upper"),
    [(-90.0, 90.0, -20.5, 20.5), (-14.0, 10.0, -12.5, 8.5), (-90.0, 10.0, -20.5, 8.5), (-14.0, 90.0, -12.5, 20.5)],
)
def test_the_range_ends_where_the_slope_falls_by_a_tenth_or_at_20_degrees(
    stall_low: float, stall_high: float, lower: float, upper: float
) -> None:
    """A normal force with a slope of 6 that stops growing; slopes are smoothed over 2 deg to both sides."""
    lift = lift_of(6.0 * np.clip(ALPHA, stall_low * DEG, stall_high * DEG))
    found = _openfast_range(ALPHA, lift, DRAG, 0.01)
    assert found[:2] == pytest.approx((lower * DEG, upper * DEG))
    margin = 0.2 * (upper - lower) * DEG
    used = (lower * DEG + margin < ALPHA) & (upper * DEG - margin > ALPHA)
    assert found[2] == pytest.approx(np.polyfit(ALPHA[used], lift[used], 1)[0])
