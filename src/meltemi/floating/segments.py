"""Segments and points of a moving mooring line, and what they give to the system of equations of a step.

Kernels take one of them, or eight neighbours at once (docs/number-types.md).

Reference: docs/theory/floating.md (W-24 to W-26).
"""

from __future__ import annotations

from math import sqrt
from typing import NamedTuple

from meltemi.compiler import (
    Numbers,
    Single,
    Sym,
    Symmetrics,
    Table,
    Vec,
    Vectors,
    anywhere,
    kernel,
    number,
    symmetric,
    where,
    xyz,
)
from meltemi.floating.base import FloaterSystem
from meltemi.floating.mooring import dyad
from meltemi.maths.vectors import dot

BED_STIFFNESS, BED_DAMPING = 3e6, 3e5
"""[Pa/m], [Pa s/m] of the sea bed below a line, over its diameter; the defaults of MoorDyn."""
CREEP = 0.01
"""[m/s] velocity of a point on the bed below which friction grows linearly."""


class LinePoint(Table, axes="line node"):
    """Points of lines on the way to the last point of their string: a fairlead, or a junction."""

    position: Vectors = xyz("m", "state: position")
    velocity: Vectors = xyz("m/s", "state: velocity")


class LineSegment(Table, axes="line node"):
    """Segments of lines below their points, with the rows of these points in the system of equations of a step."""

    way: Vectors = xyz("m", "from the point below to this one")
    rate: Vectors = xyz("m/s", "rate of this way")
    next_way: Vectors = xyz("m", "from this point to the next one of the line")
    next_rate: Vectors = xyz("m/s", "rate of this way")
    height: Numbers = number("m", "height of the point")
    velocity: Vectors = xyz("m/s", "velocity of the point")
    coupling: Symmetrics = symmetric("kg", "block of the point below, with the opposite sign")
    diagonal: Symmetrics = symmetric("kg or 1/kg", "block on the diagonal, then the inverse of the reduced one")
    right: Vectors = xyz("kg m/s", "right-hand side, then the reduced one")


class SegmentSystem(FloaterSystem):
    """A floating turbine with the segments of its lines."""

    line_point: Single[LinePoint]
    segments: LineSegment
    segments_alone: Single[LineSegment]

    SAME = {"segments_alone": "segments"}  # noqa: RUF012


@kernel
def segment(i: int, d: Vec, change: Vec, m: SegmentSystem) -> tuple[Vec, float, float, float]:
    """Direction of a segment between ends ``d`` [m] apart, its length, tension without, and with damping (W-24).

    Args:
      change: [m/s] rate of ``d``.
    """
    length, size = m.line.length[i] / m.line_point.nodes, sqrt(dot(d, d))
    e = (1.0 / size) * d
    taut = max(m.line.stiffness[i] * (size / length - 1.0), 0.0)
    return e, size, taut, taut + m.line.damping[i] / length * dot(change, e)


class Spring(NamedTuple):
    """A segment in a step: direction, tension with damping, stiffness [N/m] across and along, block of the matrix."""

    direction: Vec
    tension: float
    across: float
    along: float
    block: Sym


class Point(NamedTuple):
    """What lines give to a point: drag and inertia across and along, mass in water, area on the bed, friction there."""

    drag: float
    axial_drag: float
    inertia: float
    axial_inertia: float
    mass: float
    area: float
    friction: float


@kernel
def spring(j: int, d: Vec, change: Vec, a: float, b: float, m: SegmentSystem) -> Spring:
    """A segment of line ``j``; ``a``, ``b`` are the weights [s], [s^2] of its damping and stiffness (W-25)."""
    line, length = m.line, m.line.length[j] / m.line_point.nodes
    e, size, taut, T = segment(j, d, change, m)
    across = taut / size
    along = where(taut > 0.0, line.stiffness[j] / length, 0.0) - across
    return Spring(e, T, across, along, dyad(b * across, b * along + a * line.damping[j] / length, e))


@kernel
def slack(x: float) -> Spring:
    """No segment, in the number type of ``x``."""
    zero = 0.0 * x
    nothing = Vec(zero, zero, zero)
    return Spring(nothing, zero, zero, zero, dyad(zero, zero, nothing))


@kernel
def halves(i: int, j: int, share: float, m: SegmentSystem) -> Point:
    """A point with a share of half a segment of each of two lines."""
    line, a, b = m.line, 0.5 * m.line.length[i] / m.line_point.nodes, 0.5 * m.line.length[j] / m.line_point.nodes
    return Point(
        share * (a * line.drag[i] + b * line.drag[j]),
        share * (a * line.axial_drag[i] + b * line.axial_drag[j]),
        share * (a * line.inertia[i] + b * line.inertia[j]),
        share * (a * line.axial_inertia[i] + b * line.axial_inertia[j]),
        share * (a * line.mass[i] + b * line.mass[j]),
        share * (a * line.diameter[i] + b * line.diameter[j]),
        line.friction[i],
    )


@kernel
def point_equation(  # noqa: PLR0913 - all that acts on a point
    p: Point, z: float, v: Vec, h: float, a: float, way: Vec, below: Spring, above: Spring, m: SegmentSystem
) -> tuple[Sym, Vec]:
    """Matrix of a point, and force on it without the change of springs in the step (W-24 to W-26).

    Args:
      z, v: [m] height and [m/s] velocity of the point.
      h, a: [s] time step, and its part after which forces act.
      way: from the point below to that above.
    """
    e = (1.0 / sqrt(dot(way, way))) * way
    vt = dot(v, e)
    vn = v - vt * e
    across, along = p.drag * sqrt(dot(vn, vn)), p.axial_drag * abs(vt)
    weight = m.structure.gravity * p.mass
    A = dyad(p.inertia + a * across, (p.axial_inertia - p.inertia) + a * (along - across), e)
    A += below.block + above.block
    f = above.tension * above.direction - below.tension * below.direction
    f = f - across * vn - (along * vt) * e - Vec(0.0, 0.0, weight)
    deep = m.floater.bed - z
    if anywhere(deep > 0.0):
        hold = where(deep > 0.0, p.friction * weight, 0.0) / max(sqrt(v.x * v.x + v.y * v.y), CREEP)
        area = where(deep > 0.0, p.area, 0.0)
        f += Vec(-hold * v.x, -hold * v.y, area * (BED_STIFFNESS * deep - BED_DAMPING * v.z))
        none = 0.0 * hold
        A += Sym(h * hold, h * hold, area * (a * BED_DAMPING + a * a * BED_STIFFNESS), none, none, none)
    return A, f


@kernel
def force_rate(
    p: Point, z: float, v: Vec, rate: Vec, next_rate: Vec, below: Spring, above: Spring, m: SegmentSystem
) -> Vec:
    """Rate of the force on a point by springs and sea bed at the present rates of the ways to its neighbours."""
    f = above.across * next_rate + (above.along * dot(above.direction, next_rate)) * above.direction
    f = f - below.across * rate - (below.along * dot(below.direction, rate)) * below.direction
    area = where(m.floater.bed - z > 0.0, p.area, 0.0)
    return f - Vec(0.0, 0.0, area * BED_STIFFNESS * v.z)


@kernel
def line_equations(i: int, h: float, theta: float, m: SegmentSystem) -> None:
    """Rows of the points of a line between two of its segments; the last point needs those of the next line, too."""
    w, p, a, b = m.segments, halves(i, i, 1.0, m), theta * h, theta * h * theta * h
    for n in range(w.nodes):
        way, rate, next_way, next_rate = w.way[i, n], w.rate[i, n], w.next_way[i, n], w.next_rate[i, n]
        below, above = spring(i, way, rate, a, b, m), spring(i, next_way, next_rate, a, b, m)
        z, v = w.height[i, n], w.velocity[i, n]
        A, f = point_equation(p, z, v, h, a, way + next_way, below, above, m)
        w.coupling[i, n] = below.block
        w.diagonal[i, n] = A
        w.right[i, n] = h * f + (h * a) * force_rate(p, z, v, rate, next_rate, below, above, m)
