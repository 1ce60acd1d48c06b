"""Functions of vectors, rotations and symmetric matrices, and their operators in kernels for every number type."""

from __future__ import annotations

import operator
from collections.abc import Callable
from math import cos, sin, sqrt

from meltemi.compiler import Rot as Rot
from meltemi.compiler import Sym as Sym
from meltemi.compiler import Vec as Vec
from meltemi.compiler import group, kernel, last, operators, running, total

for _class in (Vec, Rot, Sym):
    group(_class)


def _times(s: float, v: Vec) -> Vec:
    return Vec(s * v.x, s * v.y, s * v.z)


def _sum_of_vectors(v: Vec) -> Vec:
    return Vec(total(v.x), total(v.y), total(v.z))


def _sum_of_matrices(A: Sym) -> Sym:
    return Sym(total(A.xx), total(A.yy), total(A.zz), total(A.xy), total(A.xz), total(A.yz))


def _running_sum(v: Vec) -> Vec:
    return Vec(running(v.x), running(v.y), running(v.z))


def _last_vector(v: Vec) -> Vec:
    return Vec(last(v.x), last(v.y), last(v.z))


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
        running: {(Vec,): _running_sum},
        last: {(Vec,): _last_vector},
    }
)


@kernel
def dot(a: Vec, b: Vec) -> float:
    """Scalar product a . b."""
    return a.x * b.x + a.y * b.y + a.z * b.z


@kernel
def cross(a: Vec, b: Vec) -> Vec:
    """Vector product a x b."""
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
