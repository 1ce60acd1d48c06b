"""Vectors, rotations and symmetric matrices in three dimensions, with the operators of the textbook.

Frames are named by one letter: ``R_ab`` holds the axes of frame b as columns in frame a, so ``R_ab @ v_b`` is ``v_a``
and ``R_ab.T @ v_a`` is ``v_b``. Kernels compute with them in every kind of number (``groups``).
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from math import cos, sin, sqrt
from typing import overload

from meltemi.core.kernel import kernel
from meltemi.maths.generic import total
from meltemi.maths.groups import group, operators


class _Components:
    """In Python a group is also the sequence of its components."""

    __slots__: tuple[str, ...] = ()
    __array_ufunc__ = None  # NumPy's numbers leave s * v to the vector

    def __iter__(self) -> Iterator[float]:
        return iter([getattr(self, name) for name in self.__slots__])

    def __len__(self) -> int:
        return len(self.__slots__)

    def __getitem__(self, i: int) -> float:
        return [*self][i]


@group
@dataclass(frozen=True, slots=True)
class Vec(_Components):
    """A vector by its components."""

    x: float
    y: float
    z: float

    def __add__(self, b: Vec) -> Vec:
        return Vec(self.x + b.x, self.y + b.y, self.z + b.z)

    def __sub__(self, b: Vec) -> Vec:
        return Vec(self.x - b.x, self.y - b.y, self.z - b.z)

    def __neg__(self) -> Vec:
        return Vec(-self.x, -self.y, -self.z)

    def __rmul__(self, s: float) -> Vec:
        return Vec(s * self.x, s * self.y, s * self.z)


@group
@dataclass(frozen=True, slots=True)
class Rot(_Components):
    """A rotation matrix by its rows: ``xy`` is row x, column y."""

    xx: float
    xy: float
    xz: float
    yx: float
    yy: float
    yz: float
    zx: float
    zy: float
    zz: float

    @property
    def T(self) -> Rot:
        """The rotation back."""
        return Rot(self.xx, self.yx, self.zx, self.xy, self.yy, self.zy, self.xz, self.yz, self.zz)

    def rotated(self, v: Vec) -> Vec:
        """R v: from the frame of R's columns to the frame of its rows."""
        return Vec(
            self.xx * v.x + self.xy * v.y + self.xz * v.z,
            self.yx * v.x + self.yy * v.y + self.yz * v.z,
            self.zx * v.x + self.zy * v.y + self.zz * v.z,
        )

    def composed(self, B: Rot) -> Rot:
        """R B."""
        return Rot(
            self.xx * B.xx + self.xy * B.yx + self.xz * B.zx,
            self.xx * B.xy + self.xy * B.yy + self.xz * B.zy,
            self.xx * B.xz + self.xy * B.yz + self.xz * B.zz,
            self.yx * B.xx + self.yy * B.yx + self.yz * B.zx,
            self.yx * B.xy + self.yy * B.yy + self.yz * B.zy,
            self.yx * B.xz + self.yy * B.yz + self.yz * B.zz,
            self.zx * B.xx + self.zy * B.yx + self.zz * B.zx,
            self.zx * B.xy + self.zy * B.yy + self.zz * B.zy,
            self.zx * B.xz + self.zy * B.yz + self.zz * B.zz,
        )

    @overload
    def __matmul__(self, b: Vec) -> Vec: ...
    @overload
    def __matmul__(self, b: Rot) -> Rot: ...
    def __matmul__(self, b: Vec | Rot) -> Vec | Rot:
        return self.composed(b) if isinstance(b, Rot) else self.rotated(b)


@group
@dataclass(frozen=True, slots=True)
class Sym(_Components):
    """A symmetric 3 x 3 matrix, e.g. an inertia."""

    xx: float
    yy: float
    zz: float
    xy: float
    xz: float
    yz: float

    def __add__(self, B: Sym) -> Sym:
        return Sym(self.xx + B.xx, self.yy + B.yy, self.zz + B.zz, self.xy + B.xy, self.xz + B.xz, self.yz + B.yz)

    def __matmul__(self, v: Vec) -> Vec:
        return Vec(
            self.xx * v.x + self.xy * v.y + self.xz * v.z,
            self.xy * v.x + self.yy * v.y + self.yz * v.z,
            self.xz * v.x + self.yz * v.y + self.zz * v.z,
        )


def _times(s: float, v: Vec) -> Vec:
    return Vec(s * v.x, s * v.y, s * v.z)


def _sum_of_vectors(v: Vec) -> Vec:
    return Vec(total(v.x), total(v.y), total(v.z))


def _sum_of_matrices(A: Sym) -> Sym:
    return Sym(total(A.xx), total(A.yy), total(A.zz), total(A.xy), total(A.xz), total(A.yz))


_SUM: dict[tuple[type | None, ...], Callable[..., object]] = {(Vec, Vec): Vec.__add__, (Sym, Sym): Sym.__add__}
operators(
    {
        operator.add: _SUM,
        operator.iadd: _SUM,
        operator.sub: {(Vec, Vec): Vec.__sub__},
        operator.isub: {(Vec, Vec): Vec.__sub__},
        operator.neg: {(Vec,): Vec.__neg__},
        operator.mul: {(None, Vec): _times},
        operator.matmul: {(Rot, Vec): Rot.rotated, (Rot, Rot): Rot.composed, (Sym, Vec): Sym.__matmul__},
        total: {(Vec,): _sum_of_vectors, (Sym,): _sum_of_matrices},
    }
)


@kernel
def dot(a: Vec, b: Vec) -> float:
    """a . b."""
    return a.x * b.x + a.y * b.y + a.z * b.z


@kernel
def cross(a: Vec, b: Vec) -> Vec:
    """a x b."""
    return Vec(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x)


@kernel
def norm(a: Vec) -> float:
    """|a|."""
    return sqrt(a.x * a.x + a.y * a.y + a.z * a.z)


@kernel
def about_x(angle: float) -> Rot:
    """Rotation by ``angle`` [rad] about x."""
    s, c = sin(angle), cos(angle)
    return Rot(1.0, 0.0, 0.0, 0.0, c, -s, 0.0, s, c)


@kernel
def about_y(angle: float) -> Rot:
    """Rotation by ``angle`` [rad] about y."""
    s, c = sin(angle), cos(angle)
    return Rot(c, 0.0, s, 0.0, 1.0, 0.0, -s, 0.0, c)


@kernel
def about_z(angle: float) -> Rot:
    """Rotation by ``angle`` [rad] about z."""
    s, c = sin(angle), cos(angle)
    return Rot(c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0)


@kernel
def rotation_vector(t: Vec) -> Rot:
    """Rotation by |t| [rad] about t (Rodrigues), smooth at t = 0."""
    a2 = dot(t, t)
    if a2 < 1e-8:  # series keep full accuracy where sin(a)/a would lose it
        s = 1.0 - a2 / 6.0
        c = 0.5 - a2 / 24.0
    else:
        a = sqrt(a2)
        s = sin(a) / a
        c = (1.0 - cos(a)) / a2
    return Rot(
        1.0 - c * (t.y * t.y + t.z * t.z),
        c * t.x * t.y - s * t.z,
        c * t.x * t.z + s * t.y,
        c * t.x * t.y + s * t.z,
        1.0 - c * (t.x * t.x + t.z * t.z),
        c * t.y * t.z - s * t.x,
        c * t.x * t.z - s * t.y,
        c * t.y * t.z + s * t.x,
        1.0 - c * (t.x * t.x + t.y * t.y),
    )


@kernel
def turn(R: Rot, A: Sym) -> Sym:
    """R A R': the symmetric matrix A of frame b in frame a, for R = R_ab."""
    x = A @ Vec(R.xx, R.xy, R.xz)
    y = A @ Vec(R.yx, R.yy, R.yz)
    z = A @ Vec(R.zx, R.zy, R.zz)
    return Sym(
        R.xx * x.x + R.xy * x.y + R.xz * x.z,
        R.yx * y.x + R.yy * y.y + R.yz * y.z,
        R.zx * z.x + R.zy * z.y + R.zz * z.z,
        R.yx * x.x + R.yy * x.y + R.yz * x.z,
        R.zx * x.x + R.zy * x.y + R.zz * x.z,
        R.zx * y.x + R.zy * y.y + R.zz * y.z,
    )
