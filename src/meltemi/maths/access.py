"""Vectors and matrices in the rows of table arrays (see ``maths.tables``)."""

from __future__ import annotations

from numpy import float64
from numpy.typing import NDArray

from meltemi.core.kernel import kernel
from meltemi.maths.generic import total
from meltemi.maths.vectors import Rot, Sym, Vec

Float = NDArray[float64]


@kernel
def vec1(A: Float, i: int) -> Vec:
    """Vector in rows i, i+1, i+2."""
    return Vec(A[i], A[i + 1], A[i + 2])


@kernel
def vec2(A: Float, i: int, b: int) -> Vec:
    """Vector in rows i, i+1, i+2 of column b."""
    return Vec(A[i, b], A[i + 1, b], A[i + 2, b])


@kernel
def vec3(A: Float, i: int, b: int, n: int) -> Vec:
    """Vector in rows i, i+1, i+2 at (b, n)."""
    return Vec(A[i, b, n], A[i + 1, b, n], A[i + 2, b, n])


@kernel
def put1(A: Float, i: int, v: Vec) -> None:
    """Store a vector in rows i, i+1, i+2."""
    A[i] = v.x
    A[i + 1] = v.y
    A[i + 2] = v.z


@kernel
def put2(A: Float, i: int, b: int, v: Vec) -> None:
    """Store a vector in rows i, i+1, i+2 of column b."""
    A[i, b] = v.x
    A[i + 1, b] = v.y
    A[i + 2, b] = v.z


@kernel
def put3(A: Float, i: int, b: int, n: int, v: Vec) -> None:
    """Store a vector in rows i, i+1, i+2 at (b, n)."""
    A[i, b, n] = v.x
    A[i + 1, b, n] = v.y
    A[i + 2, b, n] = v.z


@kernel
def sym1(A: Float, i: int) -> Sym:
    """Symmetric matrix in rows i to i+5."""
    return Sym(A[i], A[i + 1], A[i + 2], A[i + 3], A[i + 4], A[i + 5])


@kernel
def sym2(A: Float, i: int, b: int) -> Sym:
    """Symmetric matrix in rows i to i+5 of column b."""
    return Sym(A[i, b], A[i + 1, b], A[i + 2, b], A[i + 3, b], A[i + 4, b], A[i + 5, b])


@kernel
def sym3(A: Float, i: int, b: int, n: int) -> Sym:
    """Symmetric matrix in rows i to i+5 at (b, n)."""
    return Sym(A[i, b, n], A[i + 1, b, n], A[i + 2, b, n], A[i + 3, b, n], A[i + 4, b, n], A[i + 5, b, n])


@kernel
def rot1(A: Float, i: int) -> Rot:
    """Rotation matrix in rows i to i+8."""
    return Rot(A[i], A[i + 1], A[i + 2], A[i + 3], A[i + 4], A[i + 5], A[i + 6], A[i + 7], A[i + 8])


@kernel
def rot2(A: Float, i: int, b: int) -> Rot:
    """Rotation matrix in rows i to i+8 of column b."""
    return Rot(
        A[i, b], A[i + 1, b], A[i + 2, b], A[i + 3, b], A[i + 4, b], A[i + 5, b], A[i + 6, b], A[i + 7, b], A[i + 8, b]
    )


@kernel
def put_rot1(A: Float, i: int, R: Rot) -> None:
    """Store a rotation matrix in rows i to i+8."""
    A[i], A[i + 1], A[i + 2] = R.xx, R.xy, R.xz
    A[i + 3], A[i + 4], A[i + 5] = R.yx, R.yy, R.yz
    A[i + 6], A[i + 7], A[i + 8] = R.zx, R.zy, R.zz


@kernel
def put_rot2(A: Float, i: int, b: int, R: Rot) -> None:
    """Store a rotation matrix in rows i to i+8 of column b."""
    A[i, b], A[i + 1, b], A[i + 2, b] = R.xx, R.xy, R.xz
    A[i + 3, b], A[i + 4, b], A[i + 5, b] = R.yx, R.yy, R.yz
    A[i + 6, b], A[i + 7, b], A[i + 8, b] = R.zx, R.zy, R.zz


@kernel
def add2(A: Float, i: int, b: int, v: Vec) -> None:
    """Add the total of a vector to rows i, i+1, i+2 of column b."""
    A[i, b] += total(v.x)
    A[i + 1, b] += total(v.y)
    A[i + 2, b] += total(v.z)


@kernel
def add3(A: Float, i: int, b: int, n: int, v: Vec) -> None:
    """Add the total of a vector to rows i, i+1, i+2 at (b, n)."""
    A[i, b, n] += total(v.x)
    A[i + 1, b, n] += total(v.y)
    A[i + 2, b, n] += total(v.z)


@kernel
def add_sym2(A: Float, i: int, b: int, J: Sym) -> None:
    """Add the total of a symmetric matrix to rows i to i+5 of column b."""
    A[i, b] += total(J.xx)
    A[i + 1, b] += total(J.yy)
    A[i + 2, b] += total(J.zz)
    A[i + 3, b] += total(J.xy)
    A[i + 4, b] += total(J.xz)
    A[i + 5, b] += total(J.yz)
