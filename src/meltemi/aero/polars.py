"""Polars on a uniform grid of the angle of attack, and their look-up."""

from __future__ import annotations

import operator
from dataclasses import dataclass
from math import cos, floor, pi
from typing import NamedTuple

from meltemi.aero.air import Air
from meltemi.compiler import Components, Numbers, anywhere, group, kernel, operators, whole


class PolarPosition(NamedTuple):
    """Place in a polar: the point before it, and the weight of the next one."""

    point: int
    weight: float


@dataclass(frozen=True, slots=True)
class SectionCoefficients(Components):
    """Lift, drag and moment coefficient."""

    lift: float
    drag: float
    moment: float

    def __add__(self, b: SectionCoefficients) -> SectionCoefficients:
        return SectionCoefficients(self.lift + b.lift, self.drag + b.drag, self.moment + b.moment)

    def __sub__(self, b: SectionCoefficients) -> SectionCoefficients:
        return SectionCoefficients(self.lift - b.lift, self.drag - b.drag, self.moment - b.moment)

    def __rmul__(self, s: float) -> SectionCoefficients:
        return SectionCoefficients(s * self.lift, s * self.drag, s * self.moment)


def _times(s: float, c: SectionCoefficients) -> SectionCoefficients:
    return SectionCoefficients(s * c.lift, s * c.drag, s * c.moment)


group(SectionCoefficients)
operators(
    {
        operator.add: {(SectionCoefficients, SectionCoefficients): SectionCoefficients.__add__},
        operator.iadd: {(SectionCoefficients, SectionCoefficients): SectionCoefficients.__add__},
        operator.sub: {(SectionCoefficients, SectionCoefficients): SectionCoefficients.__sub__},
        operator.mul: {(None, SectionCoefficients): _times},
    }
)


@kernel
def locate(alpha: float, m: Air) -> PolarPosition:
    """Place of the angle of attack ``alpha`` [rad] in the polars; any angle is allowed."""
    last = m.polars.angles - 1
    turns = (alpha + pi) * (0.5 / pi)
    x = (turns - floor(turns)) * last
    point = min(max(whole(x), 0), last - 1)  # NaN must not lead out of the table
    return PolarPosition(point, x - point)


@kernel
def coefficient(values: Numbers, g: int, at: PolarPosition) -> float:
    """Coefficient of polar ``g`` at a place, by linear interpolation."""
    a = values[g, at.point]
    return a + at.weight * (values[g, at.point + 1] - a)


@kernel
def static_coefficients(alpha: float, g: int, m: Air) -> SectionCoefficients:
    """Static coefficients of polar ``g`` at ``alpha`` [rad]."""
    at, polars = locate(alpha, m), m.polars
    return SectionCoefficients(
        coefficient(polars.lift, g, at), coefficient(polars.drag, g, at), coefficient(polars.moment, g, at)
    )


@kernel
def wrap(angle: float) -> float:
    """Angle in [-pi, pi)."""
    return angle - 2.0 * pi * floor((angle + pi) * (0.5 / pi))


@kernel
def ramp(x: float, low: float, high: float) -> float:
    """Blending function: 0 below ``low``, 1 above ``high``, half a cosine between."""
    t = min(max((x - low) / (high - low), 0.0), 1.0)
    if anywhere((t > 0.0) & (t < 1.0)):
        return 0.5 - 0.5 * cos(pi * t)
    return t
