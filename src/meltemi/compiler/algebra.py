"""Vectors, rotations and symmetric matrices in three dimensions, and phasors, with the operators of the textbook.

Frames are named by one letter: ``R_ab`` holds the axes of frame b as columns in frame a, so ``R_ab @ v_b`` is ``v_a``
and ``R_ab.T @ v_a`` is ``v_b``. Plain Python; ``vectors`` and ``phasors`` compile them for kernels.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import overload


class Components:
    """Base class of groups: in Python a group is also the sequence of its components."""

    __slots__: tuple[str, ...] = ()
    __array_ufunc__ = None  # NumPy scalars defer s * v to the vector

    def __iter__(self) -> Iterator[float]:
        return iter([getattr(self, name) for name in self.__slots__])

    def __len__(self) -> int:
        return len(self.__slots__)

    def __getitem__(self, i: int) -> float:
        return [*self][i]


@dataclass(frozen=True, slots=True)
class Vec(Components):
    """A vector with its components."""

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


@dataclass(frozen=True, slots=True)
class Rot(Components):
    """A rotation matrix with its entries: ``xy`` is row x, column y."""

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
        """The transpose, which is the inverse rotation."""
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


@dataclass(frozen=True, slots=True)
class Sym(Components):
    """A symmetric 3 x 3 matrix, e.g. an inertia tensor."""

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


@dataclass(frozen=True, slots=True)
class Phasor(Components):
    """A complex number d + j q."""

    d: float
    q: float

    def __add__(self, b: Phasor) -> Phasor:
        return Phasor(self.d + b.d, self.q + b.q)

    def __sub__(self, b: Phasor) -> Phasor:
        return Phasor(self.d - b.d, self.q - b.q)

    def __rmul__(self, s: float) -> Phasor:
        return Phasor(s * self.d, s * self.q)

    def __mul__(self, b: Phasor) -> Phasor:
        return Phasor(self.d * b.d - self.q * b.q, self.d * b.q + self.q * b.d)

    def __truediv__(self, b: Phasor) -> Phasor:
        square = b.d * b.d + b.q * b.q
        return Phasor((self.d * b.d + self.q * b.q) / square, (self.q * b.d - self.d * b.q) / square)
