"""Vectors and matrices read from the rows of arrays."""

from __future__ import annotations

import numpy as np
import pytest

from meltemi.maths import access

A1 = np.arange(20.0)
A2 = np.arange(60.0).reshape(20, 3)
A3 = np.arange(240.0).reshape(20, 3, 4)
PLACE = {1: (), 2: (2,), 3: (1, 3)}


def column(A: np.ndarray, i: int, n: int) -> np.ndarray:
    """Rows i to i+n-1 at the place the tests use."""
    return A[(slice(i, i + n), *PLACE[A.ndim])]


@pytest.mark.parametrize(("read", "A"), [(access.vec1, A1), (access.vec3, A3)])
def test_vectors_are_read_from_three_rows(read, A) -> None:  # type: ignore[no-untyped-def]
    assert tuple(read(A, 4, *PLACE[A.ndim])) == tuple(column(A, 4, 3))


@pytest.mark.parametrize(("read", "A"), [(access.rot2, A2)])
def test_rotations_are_read_row_by_row(read, A) -> None:  # type: ignore[no-untyped-def]
    assert tuple(read(A, 4, *PLACE[A.ndim])) == tuple(column(A, 4, 9))
