"""Vectors and rotations in three dimensions, as small groups of numbers.

Frames are named by one letter: ``R_ab`` holds the axes of frame b as columns in frame a, so
``rotate(R_ab, v_b)`` gives ``v_a`` and ``rotate_back(R_ab, v_a)`` gives ``v_b``.
"""

from __future__ import annotations

from math import cos, sin, sqrt
from typing import NamedTuple

from meltemi.core.kernel import kernel
from meltemi.maths.generic import total


class Vec(NamedTuple):
    """A vector by its components."""

    x: float
    y: float
    z: float


class Rot(NamedTuple):
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


class Sym(NamedTuple):
    """A symmetric 3 x 3 matrix, e.g. an inertia."""

    xx: float
    yy: float
    zz: float
    xy: float
    xz: float
    yz: float


@kernel
def add(a: Vec, b: Vec) -> Vec:
    """a + b."""
    return Vec(a.x + b.x, a.y + b.y, a.z + b.z)


@kernel
def sub(a: Vec, b: Vec) -> Vec:
    """a - b."""
    return Vec(a.x - b.x, a.y - b.y, a.z - b.z)


@kernel
def scale(s: float, a: Vec) -> Vec:
    """s a."""
    return Vec(s * a.x, s * a.y, s * a.z)


@kernel
def add_scaled(a: Vec, s: float, b: Vec) -> Vec:
    """a + s b."""
    return Vec(a.x + s * b.x, a.y + s * b.y, a.z + s * b.z)


@kernel
def dot(a: Vec, b: Vec) -> float:
    """a . b."""
    return a.x * b.x + a.y * b.y + a.z * b.z


@kernel
def cross(a: Vec, b: Vec) -> Vec:
    """a x b."""
    return Vec(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x)


@kernel
def sum_lanes(a: Vec) -> Vec:
    """Sum of the vectors that stand in the lanes of one."""
    return Vec(total(a.x), total(a.y), total(a.z))


@kernel
def norm(a: Vec) -> float:
    """|a|."""
    return sqrt(a.x * a.x + a.y * a.y + a.z * a.z)


@kernel
def rotate(R: Rot, v: Vec) -> Vec:
    """R v: from the frame of R's columns to the frame of its rows."""
    return Vec(
        R.xx * v.x + R.xy * v.y + R.xz * v.z,
        R.yx * v.x + R.yy * v.y + R.yz * v.z,
        R.zx * v.x + R.zy * v.y + R.zz * v.z,
    )


@kernel
def rotate_back(R: Rot, v: Vec) -> Vec:
    """R' v: from the frame of R's rows to the frame of its columns."""
    return Vec(
        R.xx * v.x + R.yx * v.y + R.zx * v.z,
        R.xy * v.x + R.yy * v.y + R.zy * v.z,
        R.xz * v.x + R.yz * v.y + R.zz * v.z,
    )


@kernel
def compose(A: Rot, B: Rot) -> Rot:
    """A B."""
    return Rot(
        A.xx * B.xx + A.xy * B.yx + A.xz * B.zx,
        A.xx * B.xy + A.xy * B.yy + A.xz * B.zy,
        A.xx * B.xz + A.xy * B.yz + A.xz * B.zz,
        A.yx * B.xx + A.yy * B.yx + A.yz * B.zx,
        A.yx * B.xy + A.yy * B.yy + A.yz * B.zy,
        A.yx * B.xz + A.yy * B.yz + A.yz * B.zz,
        A.zx * B.xx + A.zy * B.yx + A.zz * B.zx,
        A.zx * B.xy + A.zy * B.yy + A.zz * B.zy,
        A.zx * B.xz + A.zy * B.yz + A.zz * B.zz,
    )


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
def apply(A: Sym, v: Vec) -> Vec:
    """A v."""
    return Vec(
        A.xx * v.x + A.xy * v.y + A.xz * v.z,
        A.xy * v.x + A.yy * v.y + A.yz * v.z,
        A.xz * v.x + A.yz * v.y + A.zz * v.z,
    )


@kernel
def turn(R: Rot, A: Sym) -> Sym:
    """R A R': the symmetric matrix A of frame b in frame a, for R = R_ab."""
    x = apply(A, Vec(R.xx, R.xy, R.xz))
    y = apply(A, Vec(R.yx, R.yy, R.yz))
    z = apply(A, Vec(R.zx, R.zy, R.zz))
    return Sym(
        R.xx * x.x + R.xy * x.y + R.xz * x.z,
        R.yx * y.x + R.yy * y.y + R.yz * y.z,
        R.zx * z.x + R.zy * z.y + R.zz * z.z,
        R.yx * x.x + R.yy * x.y + R.yz * x.z,
        R.zx * x.x + R.zy * x.y + R.zz * x.z,
        R.zx * y.x + R.zy * y.y + R.zz * y.z,
    )
