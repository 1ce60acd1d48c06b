"""Mooring lines of lumped masses, in place of their static shapes.

A line is a row of points with the mass, weight, drag and added mass of a segment each; segments carry tension
and axial damping.
A step is linearly implicit: tension, damping and sea bed act with their change over it, which costs one solution of a
tridiagonal system of 3 x 3 blocks for each line, and leaves the step to the turbine. Until the first step, and in
linear models, lines have their static shapes.

Reference: docs/theory/floating.md (W-24 to W-28, W-34); Hall and Goupee (2015) for forces;
Hairer and Wanner (1996), IV.7.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt
from typing import Any, ClassVar, NamedTuple

from meltemi.compiler import (
    KernelRecord,
    Numbers,
    Single,
    Sym,
    Symmetrics,
    Table,
    Vec,
    Vectors,
    kernel,
    number,
    symmetric,
    xyz,
)
from meltemi.floating.base import FloaterSystem, point_motion
from meltemi.floating.catenary import span
from meltemi.floating.floater import FloaterPart, add_mass, line_pull, settle_junctions, settle_points, static_pull
from meltemi.floating.floater import part_of as static_part
from meltemi.floating.mooring import NONE, dyad, hang_all, holds, inverse, is_held, line_of, pulls
from meltemi.maths.vectors import cross, dot
from meltemi.simulation.step import DIVERGED, begin_parts_step, check_parts
from meltemi.simulation.system import March

THETA = 0.5
"""Weight of the end of a step: second order, without numerical damping (W-27)."""
BED_STIFFNESS, BED_DAMPING = 3e6, 3e5
"""[Pa/m], [Pa s/m] of the sea bed below a line, over its diameter; the defaults of MoorDyn."""
CREEP = 0.01
"""[m/s] velocity of a point on the bed below which friction grows linearly."""
LONGEST = 2.0
"""Length of a segment over that without tension beyond which a line has diverged: a run ends."""
BEGUN, BROKEN = 1.0, 2.0
RELAXATIONS, LONG_STEP = 200, 0.5
"""Steps without velocity [s] from the static shape of a continuous line to that of the points."""


class LinePoint(Table, axes="line node"):
    """Points of lines on the way to the last point of their string: a fairlead, or a junction."""

    position: Vectors = xyz("m", "state: position")
    velocity: Vectors = xyz("m/s", "state: velocity")


class LineState(Table, axes="line"):
    """Whether a line moves, and the first end of a string: at a junction that on the platform, else the anchor."""

    begun: Numbers = number("-", "1 after the first step, 2 once it diverges")
    start: Vectors = xyz("m", "state: position of the first end of the string")
    start_velocity: Vectors = xyz("m/s", "state: velocity of the first end of the string")


class Elimination(Table, axes="line node"):
    """Rows of the tridiagonal system of a line."""

    inverse: Symmetrics = symmetric("1/kg", "inverse of the reduced block on the diagonal")
    beyond: Symmetrics = symmetric("kg", "block of the point above, with the opposite sign")
    right: Vectors = xyz("kg m/s", "reduced right-hand side")


class LumpedSystem(FloaterSystem):
    """A floating turbine on moving lines."""

    line_point: Single[LinePoint]
    line_state: Single[LineState]
    elimination: Single[Elimination]


@kernel
def reduced(A: Sym, S: Sym, G: Sym) -> Sym:
    """A - S G S."""
    x = S @ (G @ Vec(S.xx, S.xy, S.xz))
    y = S @ (G @ Vec(S.xy, S.yy, S.yz))
    z = S @ (G @ Vec(S.xz, S.yz, S.zz))
    return Sym(A.xx - x.x, A.yy - y.y, A.zz - z.z, A.xy - y.x, A.xz - z.x, A.yz - z.y)


@kernel
def segment(i: int, d: Vec, change: Vec, m: LumpedSystem) -> tuple[Vec, float, float, float]:
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
    """A point of a line: place, velocity, and what lines give it: drag and inertia across and along, mass in water,
    area on the bed, friction there."""

    place: Vec
    velocity: Vec
    drag: float
    axial_drag: float
    inertia: float
    axial_inertia: float
    mass: float
    area: float
    friction: float


@kernel
def spring(j: int, d: Vec, change: Vec, a: float, b: float, m: LumpedSystem) -> Spring:
    """A segment of line ``j``; ``a``, ``b`` are the weights [s], [s^2] of its damping and stiffness (W-25)."""
    line, length = m.line, m.line.length[j] / m.line_point.nodes
    e, size, taut, T = segment(j, d, change, m)
    across = taut / size
    along = (line.stiffness[j] / length if taut > 0.0 else 0.0 * taut) - across
    return Spring(e, T, across, along, dyad(b * across, b * along + a * line.damping[j] / length, e))


@kernel
def slack(x: float) -> Spring:
    """No segment, in the number type of ``x``."""
    zero = 0.0 * x
    nothing = Vec(zero, zero, zero)
    return Spring(nothing, zero, zero, zero, dyad(zero, zero, nothing))


@kernel
def halves(i: int, j: int, share: float, x: Vec, v: Vec, m: LumpedSystem) -> Point:
    """A point at ``x`` that moves with ``v``, with a share of half a segment of each of two lines."""
    line, a, b = m.line, 0.5 * m.line.length[i] / m.line_point.nodes, 0.5 * m.line.length[j] / m.line_point.nodes
    return Point(
        x,
        v,
        share * (a * line.drag[i] + b * line.drag[j]),
        share * (a * line.axial_drag[i] + b * line.axial_drag[j]),
        share * (a * line.inertia[i] + b * line.inertia[j]),
        share * (a * line.axial_inertia[i] + b * line.axial_inertia[j]),
        share * (a * line.mass[i] + b * line.mass[j]),
        share * (a * line.diameter[i] + b * line.diameter[j]),
        line.friction[i],
    )


@kernel
def point_equation(
    p: Point, h: float, a: float, way: Vec, below: Spring, above: Spring, m: LumpedSystem
) -> tuple[Sym, Vec]:
    """Matrix of a point, and force on it without the change of springs in the step (W-24 to W-26).

    Args:
      h, a: [s] time step, and its part after which forces act.
      way: direction from the point below to that above.
    """
    v = p.velocity
    vt = dot(v, way)
    vn = v - vt * way
    across, along = p.drag * sqrt(dot(vn, vn)), p.axial_drag * abs(vt)
    weight = m.structure.gravity * p.mass
    A = dyad(p.inertia + a * across, (p.axial_inertia - p.inertia) + a * (along - across), way)
    A += below.block + above.block
    f = above.tension * above.direction - below.tension * below.direction
    f = f - across * vn - (along * vt) * way - Vec(0.0, 0.0, weight)
    deep = m.floater.bed - p.place.z
    if deep > 0.0:
        hold = p.friction * weight / max(sqrt(v.x * v.x + v.y * v.y), CREEP)
        f += Vec(-hold * v.x, -hold * v.y, p.area * (BED_STIFFNESS * deep - BED_DAMPING * v.z))
        A += Sym(h * hold, h * hold, p.area * (a * BED_DAMPING + a * a * BED_STIFFNESS), 0.0, 0.0, 0.0)
    return A, f


@kernel
def force_rate(p: Point, v_low: Vec, v_up: Vec, below: Spring, above: Spring, m: LumpedSystem) -> Vec:
    """Rate of the force on a point by springs and sea bed at the present velocities, with those of its neighbours."""
    v = p.velocity
    up, down = v_up - v, v - v_low
    rate = above.across * up + (above.along * dot(above.direction, up)) * above.direction
    rate = rate - below.across * down - (below.along * dot(below.direction, down)) * below.direction
    if m.floater.bed - p.place.z > 0.0:
        rate += Vec(0.0, 0.0, -p.area * BED_STIFFNESS * v.z)
    return rate


@kernel
def eliminate(first: int, h: float, theta: float, m: LumpedSystem) -> tuple[Sym, Vec]:
    """Eliminate the points of a string, from its first line to the last point (W-24 to W-27).

    Returns:
      Matrix and right-hand side of the last segment for the change of the last point's velocity, with a half of its
      inertia, weight and drag.
    """
    s, w, order, n = m.line_point, m.elimination, m.line_order, m.line_point.nodes
    a, b = theta * h, theta * h * theta * h
    low, v_low = m.line_state.start[first], m.line_state.start_velocity[first]
    x, v, below = low, v_low, slack(low.x)
    G, right = below.block, below.direction
    i, k, j, q = NONE, NONE, first, 0  # line and number of the present point, and of the next one
    while j >= 0:
        up, v_up = s.position[j, q], s.velocity[j, q]
        above = spring(j, up - x, v_up - v, a, b, m)
        if i >= 0:
            p, way = halves(i, j, 1.0, x, v, m), up - low
            A, f = point_equation(p, h, a, (1.0 / sqrt(dot(way, way))) * way, below, above, m)
            if k == n - 1 and order.knot[i] >= 0:
                more, C = clump(order.knot[i], v, a, m)
                f, A = f + more, A + C
            rate = force_rate(p, v_low, v_up, below, above, m)
            A, right = reduced(A, below.block, G), h * f + (h * a) * rate + below.block @ (G @ right)
            G = inverse(A)
            w.inverse[i, k] = G
            w.beyond[i, k] = above.block
            w.right[i, k] = right
        low, v_low, x, v, below = x, v, up, v_up, above
        i, k, q = j, q, q + 1
        if q == n:
            q, j = 0, order.onward[j]
    p, way, above = halves(i, i, 0.5, x, v, m), x - low, slack(low.x)
    A, f = point_equation(p, h, a, (1.0 / sqrt(dot(way, way))) * way, below, above, m)
    rate = force_rate(p, v_low, v, below, above, m)
    return reduced(A, below.block, G), h * f + (h * a) * rate + below.block @ (G @ right)


@kernel
def clump(p: int, v: Vec, a: float, m: LumpedSystem) -> tuple[Vec, Sym]:
    """Force and matrix of a free point that moves with ``v``."""
    drag = m.point.drag[p] * sqrt(dot(v, v))
    return -drag * v - Vec(0.0, 0.0, m.structure.gravity * m.point.mass[p]), dyad(m.point.inertia[p] + a * drag, 0.0, v)


@kernel
def substitute(i: int, h: float, theta: float, further: Vec, m: LumpedSystem) -> None:
    """Move the points of a string, whose last one changes its velocity by ``further``, back to the first one."""
    s, w, order, k = m.line_point, m.elimination, m.line_order, m.line_point.nodes - 2
    j = order.finish[i]
    while j >= 0:
        further = w.inverse[j, k] @ (w.right[j, k] + w.beyond[j, k] @ further)
        v = s.velocity[j, k]
        s.position[j, k] = s.position[j, k] + h * (v + theta * further)
        s.velocity[j, k] = v + further
        k -= 1
        if k < 0:
            j, k = order.back[j], m.line_point.nodes - 1


@kernel
def march_junction(p: int, h: float, theta: float, m: LumpedSystem) -> None:
    """A step of the strings that meet in a free point, and of this point (W-34)."""
    s, order, x, last = m.line_point, m.line_order, m.line_state, m.line_point.nodes - 1
    place, v = Vec(0.0, 0.0, 0.0), Vec(0.0, 0.0, 0.0)
    A, r = dyad(0.0, 0.0, v), v
    for i in range(order.lines):  # type: ignore[attr-defined]
        if holds(i, p, m):
            if order.foot[i] == p:
                x.start_velocity[i] = (1.0 / h) * (m.line_end.upper[i] - x.start[i])
            place, v = s.position[order.finish[i], last], s.velocity[order.finish[i], last]
            more, right = eliminate(order.start[i], h, theta, m)
            A, r = A + more, r + right
    f, more = clump(p, v, theta * h, m)
    change = inverse(A + more) @ (r + h * f)
    for i in range(order.lines):  # type: ignore[attr-defined]
        if holds(i, p, m):
            substitute(i, h, theta, change, m)
            s.position[order.finish[i], last] = place + h * (v + theta * change)
            s.velocity[order.finish[i], last] = v + change
            if order.foot[i] == p:
                x.start[i] = m.line_end.upper[i]


@kernel
def march(h: float, theta: float, m: LumpedSystem) -> None:
    """A step of all lines, to the end of which their fairleads move (W-24 to W-27)."""
    s, order, ends, last = m.line_point, m.line_order, m.line_end, m.line_point.nodes - 1
    for i in range(order.lines):  # type: ignore[attr-defined]
        if order.head[i] == NONE and order.foot[i] == NONE and pulls(i, m):
            s.velocity[i, last] = (1.0 / h) * (ends.upper[i] - s.position[i, last])
            eliminate(order.start[i], h, theta, m)
            substitute(i, h, theta, Vec(0.0, 0.0, 0.0), m)
            s.position[i, last] = ends.upper[i]
    for p in range(m.point.points):  # type: ignore[attr-defined]
        if m.point.junction[p] > 0.0 and is_held(p, m):
            march_junction(p, h, theta, m)


@kernel
def hang(m: LumpedSystem) -> None:
    """Bring lines into equilibrium below their fairleads, from the static shapes of continuous ones (W-28)."""
    s, ends, load, n = m.line_point, m.line_end, m.line_load, m.line_point.nodes
    hang_all(m)
    for i in range(m.line_order.lines):  # type: ignore[attr-defined]
        L, w, EA, friction, on_bed = line_of(i, m)
        H, V, leg = load.horizontal[i], load.vertical[i], m.line_order.foot[i] >= 0
        d = ends.upper[i] - ends.lower[i]
        across = sqrt(d.x * d.x + d.y * d.y + 1e-12)
        m.line_state.start[i] = ends.upper[i] if leg else m.line.anchor[i]
        lying = on_bed * max(L - V / w, 0.0)
        for k in range(n):
            part = L * (k + 1.0) / n
            if leg:
                part = L - part
            x, z = part * (1.0 + H / EA), 0.0 * L
            if part > lying:
                e = span(H, V - w * (L - part), part, w, EA, friction, on_bed)
                x, z = e.x, e.z
            s.position[i, k] = ends.lower[i] + Vec(x * d.x / across, x * d.y / across, z)
        # from one line to the next without a gap
        s.position[i, n - 1] = ends.lower[i] if leg else ends.upper[i]
    for step in range(RELAXATIONS + 1):
        for i in range(m.line_order.lines):  # type: ignore[attr-defined]
            for k in range(n):
                s.velocity[i, k] = Vec(0.0, 0.0, 0.0)
        if step < RELAXATIONS:
            march(LONG_STEP, 1.0, m)


@begin_parts_step.variant
@kernel
def lumped_begin(dt: float, m: LumpedSystem) -> None:
    """Advance the lines to the end of the step: they follow their fairleads."""
    x, s, begun = m.line_state, m.line_point, 1.0
    R, spin, displacement, velocity = point_motion(m)
    for i in range(x.lines):  # type: ignore[attr-defined]
        if m.line_order.head[i] == NONE:
            m.line_end.upper[i] = displacement + R @ m.line.fairlead[i]
        begun = x.begun[i]
        x.begun[i] = BEGUN
    if begun > 0.0:
        march(dt, THETA, m)
    else:
        hang(m)
    for i in range(x.lines):  # type: ignore[attr-defined]
        if m.line_order.head[i] == NONE:
            speed = velocity + cross(spin, R @ m.line.fairlead[i])
            follow(i, begun, speed, m)
            d, _ = last_segment(i, m)
            size = sqrt(dot(d, d)) * s.nodes / m.line.length[i]
            if pulls(i, m) and not size < LONGEST:  # not a number, too
                x.begun[i] = BROKEN + 0.0 * size


@check_parts.variant
@kernel
def lumped_check(m: LumpedSystem, run: March) -> None:
    """End the run when a line diverges."""
    for i in range(m.line_state.lines):  # type: ignore[attr-defined]
        if not m.line_state.begun[i] <= BEGUN:
            run.clock.status = DIVERGED


@kernel
def follow(i: int, begun: float, speed: Vec, m: LumpedSystem) -> None:
    """Give the end at the fairlead its velocity; a line that begins moves in proportion to the way from its anchor."""
    s, n = m.line_point, m.line_point.nodes
    if m.line_order.foot[i] >= 0:
        m.line_state.start_velocity[i] = speed
    else:
        s.velocity[i, n - 1] = speed
        if begun <= 0.0 and m.line_order.start[i] == i:
            for k in range(n - 1):
                s.velocity[i, k] = ((k + 1.0) / n) * speed


@kernel
def first_segment(i: int, m: LumpedSystem) -> tuple[Vec, Vec]:
    """Ends of the first segment of a line on the way to the last point of its string, and their rate, apart."""
    s, x, j = m.line_point, m.line_state, m.line_order.back[i]
    if j >= 0:
        last = s.nodes - 1
        return s.position[i, 0] - s.position[j, last], s.velocity[i, 0] - s.velocity[j, last]
    return s.position[i, 0] - x.start[i], s.velocity[i, 0] - x.start_velocity[i]


@kernel
def last_segment(i: int, m: LumpedSystem) -> tuple[Vec, Vec]:
    """Ends of the last segment of a line on the way to the last point of its string, and their rate, apart."""
    s, last = m.line_point, m.line_point.nodes - 1
    return s.position[i, last] - s.position[i, last - 1], s.velocity[i, last] - s.velocity[i, last - 1]


@settle_points.variant
@kernel
def lumped_tensions(m: LumpedSystem) -> None:
    """Tensions at the ends of lines; before the first step, of static ones."""
    load, begun = m.line_load, 1.0
    for i in range(m.line_state.lines):  # type: ignore[attr-defined]
        begun = m.line_state.begun[i]
        if begun > 0.0:
            d, change = first_segment(i, m)
            lower = segment(i, d, change, m)[2]
            d, change = last_segment(i, m)
            upper = segment(i, d, change, m)[2]
            if m.line_order.foot[i] >= 0:
                lower, upper = upper, lower
            load.anchor[i] = lower
            load.fairlead[i] = upper
    if begun <= 0.0:
        settle_junctions(m)


@line_pull.variant
@kernel
def lumped_pull(i: int, r: Vec, m: LumpedSystem) -> Vec:
    """Force of a string on its fairlead: of the segment there, and of the half of it that moves with the platform."""
    if m.line_state.begun[i] <= 0.0:
        return static_pull(i, r, m)
    p, line = m.platform, m.line
    half = 0.5 * line.length[i] / m.line_point.nodes
    d, change = last_segment(i, m)
    if m.line_order.foot[i] >= 0:
        d, change = first_segment(i, m)
        d, change = -d, -change
    e, _, _, T = segment(i, d, change, m)
    v = p.velocity + cross(p.spin, r)
    vt = dot(v, e)
    vn = v - vt * e
    M = dyad(half * line.inertia[i], half * (line.axial_inertia[i] - line.inertia[i]), e)
    known = p.bias + cross(m.base.spin_rate, r) + cross(p.spin, cross(p.spin, r))
    pull = -(T * e) - (half * line.drag[i] * sqrt(dot(vn, vn))) * vn - (half * line.axial_drag[i] * abs(vt) * vt) * e
    pull -= Vec(0.0, 0.0, half * m.structure.gravity * line.mass[i]) + M @ known
    add_mass(M, r, m)
    m.line_load.fairlead[i] = sqrt(dot(pull, pull))
    return pull


@dataclass(frozen=True)
class LumpedPart(FloaterPart):
    """The platform of a model on moving lines."""

    system: ClassVar[type[KernelRecord] | None] = LumpedSystem
    signals: ClassVar[dict[str, type[Table]]] = {
        **FloaterPart.signals,
        "line_point": LinePoint,
        "line_state": LineState,
    }

    def why(self, case: Any) -> str:
        """The message that the platform turns over or that a line diverges, or nothing."""
        unsettled = [i for i, begun in enumerate(case.view("line_state")["begun"]) if not begun <= BEGUN]
        if (words := super().why(case)) or not unsettled:
            return words
        return (
            f"mooring line {unsettled[0] + 1} diverges, with {self.platform.segments} segments: give it drag and a "
            "damping_ratio, or fewer segments; a shorter time step helps, too (options.time_step)"
        )


def part_of(turbine: Any, options: Any, rotor: Any) -> FloaterPart:
    """The platform of a turbine, on static or moving lines; arguments and errors as for ``simulation.parts.parts_of``.

    Raises:
      InputError: as for :func:`meltemi.floating.floater.part_of`.
    """
    part = static_part(turbine, options, rotor)
    if part.platform.line_model == "static":
        return part
    sizes = part.sizes | {"node": part.platform.segments}
    work = {"elimination": Elimination.zeros(line=sizes["line"], node=sizes["node"])}
    return LumpedPart(**vars(part) | {"sizes": sizes, "constants": part.constants | work})
