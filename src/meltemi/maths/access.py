"""Vectors and matrices in the rows of table arrays (see ``maths.tables``)."""

from __future__ import annotations

from numpy import float64
from numpy.typing import NDArray

from meltemi.core.kernel import kernel
from meltemi.maths.vectors import Rot, Vec

Float = NDArray[float64]


@kernel
def vec1(A: Float, i: int) -> Vec:
    """Vector with components in rows i, i+1, i+2."""
    return Vec(A[i], A[i + 1], A[i + 2])


@kernel
def vec3(A: Float, i: int, b: int, n: int) -> Vec:
    """Vector with components in rows i, i+1, i+2 at (b, n)."""
    return Vec(A[i, b, n], A[i + 1, b, n], A[i + 2, b, n])


@kernel
def rot2(A: Float, i: int, b: int) -> Rot:
    """Rotation matrix in rows i to i+8 of column b."""
    return Rot(
        A[i, b], A[i + 1, b], A[i + 2, b], A[i + 3, b], A[i + 4, b], A[i + 5, b], A[i + 6, b], A[i + 7, b], A[i + 8, b]
    )
