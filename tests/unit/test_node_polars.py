"""Look-up of polars: linear, exact at its rows, periodic."""

from __future__ import annotations

from math import floor, pi
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from meltemi.aero.polars import coefficient, locate
from meltemi.aero.tables import PolarPoint
from meltemi.compiler import KernelRecord, kernel

Float = NDArray[np.float64]
steady = settings(derandomize=True, deadline=None, max_examples=200)
ROWS = 1441
GRID = np.linspace(-pi, pi, ROWS)
POLARS = np.random.default_rng(3).standard_normal((2, ROWS, 6))
POLARS[:, -1] = POLARS[:, 0]  # a turn brings the section back


class Foils(KernelRecord):
    """What the look-up takes of the record of the aerodynamics."""

    polars: PolarPoint


M: Any = Foils("floats", {"polars": POLARS})


def value(alpha: float, column: str = "lift", g: int = 0) -> float:
    if column == "drag":  # in kernels a field is named
        return drag(alpha, g, M)
    return lift(alpha, g, M)


@kernel
def lift(alpha: float, g: int, m: Any) -> float:
    return coefficient(m.polars.lift, g, locate(alpha, m))


@kernel
def drag(alpha: float, g: int, m: Any) -> float:
    return coefficient(m.polars.drag, g, locate(alpha, m))


@steady
@given(alpha=st.floats(-pi, pi), column=st.sampled_from(["lift", "drag"]), g=st.integers(0, 1))
def test_look_up_is_linear_interpolation(alpha: float, column: str, g: int) -> None:
    # the place is found in turns times rows: 1440 * 1e-16 of a row, times differences of size 5
    assert value(alpha, column, g) == pytest.approx(
        np.interp(alpha, GRID, POLARS[g, :, PolarPoint.index(column)]), abs=1e-11
    )


def test_rows_are_met() -> None:
    for i in range(0, ROWS, 7):
        assert value(float(GRID[i])) == pytest.approx(POLARS[0, i, 0], abs=1e-11)


@steady
@given(alpha=st.floats(-pi, pi), turns=st.integers(-5, 5))
def test_look_up_is_periodic(alpha: float, turns: int) -> None:
    # adding turns costs 16 * 1e-16 of the angle, which is 4e-13 of a row
    assert value(alpha + 2.0 * pi * turns) == pytest.approx(value(alpha), abs=1e-10)


@pytest.mark.parametrize("alpha", [-pi, pi, -3.0 * pi, 3.0 * pi, 0.0, np.nextafter(pi, 0.0), np.nextafter(-pi, 0.0)])
def test_both_ends_are_inside(alpha: float) -> None:
    at = locate(float(alpha), M)
    assert 0 <= at.point <= ROWS - 2
    assert -1e-12 <= at.weight <= 1.0 + 1e-12


@steady
@given(alpha=st.floats(-1e4, 1e4))
def test_places_are_rows_with_weights(alpha: float) -> None:
    at = locate(alpha, M)
    assert 0 <= at.point <= ROWS - 2
    assert 0.0 <= at.weight <= 1.0
    turns = (alpha + pi) / (2.0 * pi)
    assert (at.point + at.weight) / (ROWS - 1) == pytest.approx(turns - floor(turns), abs=1e-9)
