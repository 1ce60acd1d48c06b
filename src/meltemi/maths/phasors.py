"""Functions of phasors, and their operators in kernels for every number type."""

from __future__ import annotations

import operator
from math import cos, sin, sqrt

from meltemi.compiler import Phasor as Phasor
from meltemi.compiler import group, kernel, operators

group(Phasor)


def _scaled(s: float, a: Phasor) -> Phasor:
    return Phasor(s * a.d, s * a.q)


operators(
    {
        operator.add: {(Phasor, Phasor): Phasor.__add__},
        operator.sub: {(Phasor, Phasor): Phasor.__sub__},
        operator.mul: {(None, Phasor): _scaled, (Phasor, Phasor): Phasor.__mul__},
        operator.truediv: {(Phasor, Phasor): Phasor.__truediv__},
    }
)


@kernel
def polar(size: float, angle: float) -> Phasor:
    """Phasor size e^(j angle)."""
    return Phasor(size * cos(angle), size * sin(angle))


@kernel
def magnitude(a: Phasor) -> float:
    """|a|."""
    return sqrt(a.d * a.d + a.q * a.q)


@kernel
def real_product(a: Phasor, b: Phasor) -> float:
    """Re(a b*): for voltage and current, 2/3 of the active power."""
    return a.d * b.d + a.q * b.q


@kernel
def imaginary_product(a: Phasor, b: Phasor) -> float:
    """Im(a b*): for voltage and current, 2/3 of the reactive power."""
    return a.q * b.d - a.d * b.q
