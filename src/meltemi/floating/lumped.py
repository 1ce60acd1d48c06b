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
from typing import Any, ClassVar

import numpy as np

from meltemi.compiler import (
    WIDTH,
    KernelRecord,
    Numbers,
    Single,
    Sym,
    Table,
    Vec,
    Vectors,
    kernel,
    number,
    xyz,
)
from meltemi.floating.base import point_motion
from meltemi.floating.catenary import span
from meltemi.floating.floater import FloaterPart, add_mass, line_pull, settle_junctions, settle_points, static_pull
from meltemi.floating.floater import part_of as static_part
from meltemi.floating.mooring import NONE, dyad, hang_all, holds, inverse, is_held, line_of, pulls
from meltemi.floating.segments import (
    LinePoint,
    LineSegment,
    SegmentSystem,
    force_rate,
    halves,
    line_equations,
    point_equation,
    segment,
    slack,
    spring,
)
from meltemi.maths.vectors import cross, dot
from meltemi.simulation.step import DIVERGED, begin_parts_step, check_parts
from meltemi.simulation.system import March

THETA = 0.5
"""Weight of the end of a step: second order, without numerical damping (W-27)."""
LONGEST = 2.0
"""Length of a segment over that without tension beyond which a line has diverged: a run ends."""
BEGUN, BROKEN = 1.0, 2.0
RELAXATIONS, LONG_STEP = 200, 0.5
"""Steps without velocity [s] from the static shape of a continuous line to that of the points."""


class LineState(Table, axes="line"):
    """Whether a line moves, and the first end of a string: at a junction that on the platform, else the anchor."""

    begun: Numbers = number("-", "1 after the first step, 2 once it diverges")
    start: Vectors = xyz("m", "state: position of the first end of the string")
    start_velocity: Vectors = xyz("m/s", "state: velocity of the first end of the string")


class LumpedSystem(SegmentSystem):
    """A floating turbine on moving lines."""

    line_state: Single[LineState]


@kernel
def reduced(A: Sym, S: Sym, G: Sym) -> Sym:
    """A - S G S."""
    x = S @ (G @ Vec(S.xx, S.xy, S.xz))
    y = S @ (G @ Vec(S.xy, S.yy, S.yz))
    z = S @ (G @ Vec(S.xz, S.yz, S.zz))
    return Sym(A.xx - x.x, A.yy - y.y, A.zz - z.z, A.xy - y.x, A.xz - z.x, A.yz - z.y)


@kernel
def gather(i: int, m: LumpedSystem) -> None:
    """Segments of a line, from the last point before it, and the motion of its points."""
    s, w, last = m.line_point, m.segments_alone, m.line_point.nodes - 1
    way, rate = first_segment(i, m)
    for k in range(last + 1):
        w.way[i, k], w.rate[i, k] = way, rate
        w.height[i, k], w.velocity[i, k] = s.position[i, k].z, s.velocity[i, k]
        if k < last:
            way, rate = s.position[i, k + 1] - s.position[i, k], s.velocity[i, k + 1] - s.velocity[i, k]
        w.next_way[i, k], w.next_rate[i, k] = way, rate


@kernel
def knot_equation(i: int, j: int, share: float, h: float, theta: float, m: LumpedSystem) -> tuple[Sym, Vec]:
    """Block and right-hand side of the last point of line ``i``, before line ``j`` or, if there is none, of a string,
    with a share of half a segment of each line."""
    w, k, a, b = m.segments_alone, m.line_point.nodes - 1, theta * h, theta * h * theta * h
    way, rate = w.way[i, k], w.rate[i, k]
    below, above, next_rate, onward, clumped = spring(i, way, rate, a, b, m), slack(way.x), 0.0 * rate, i, NONE
    if j >= 0:
        above, next_rate, onward, clumped = (
            spring(j, w.way[j, 0], w.rate[j, 0], a, b, m),
            w.rate[j, 0],
            j,
            m.line_order.knot[i],
        )
        way += w.way[j, 0]
    p, v, z = halves(i, onward, share, m), w.velocity[i, k], w.height[i, k]
    A, f = point_equation(p, z, v, h, a, way, below, above, m)
    if clumped >= 0:
        more, C = clump(clumped, v, a, m)
        f, A = f + more, A + C
    return A, h * f + (h * a) * force_rate(p, z, v, rate, next_rate, below, above, m)


@kernel
def eliminate(first: int, h: float, theta: float, m: LumpedSystem) -> None:
    """Eliminate the points of a string, from its first line to the last but one point (W-24 to W-27)."""
    w, last, i = m.segments_alone, m.line_point.nodes - 1, first
    while i >= 0:
        gather(i, m)
        line_equations(i, h, theta, m)
        i = m.line_order.onward[i]
    G, right = slack(w.velocity[first, 0].x).block, 0.0 * w.velocity[first, 0]
    i = first
    while i >= 0:
        j = m.line_order.onward[i]
        for k in range(last if j < 0 else last + 1):
            A, f = w.diagonal[i, k], w.right[i, k]
            if k == last:
                A, f = knot_equation(i, j, 1.0, h, theta, m)
            S = w.coupling[i, k]
            A, right = reduced(A, S, G), f + S @ (G @ right)
            G = inverse(A)
            w.diagonal[i, k] = G
            w.right[i, k] = right
        i = j


@kernel
def last_equation(i: int, h: float, theta: float, m: LumpedSystem) -> tuple[Sym, Vec]:
    """Matrix and right-hand side of the last segment of an eliminated string for the change of the last point's
    velocity, with a half of its inertia, weight and drag."""
    w, k = m.segments_alone, m.line_point.nodes - 1
    A, f = knot_equation(i, NONE, 0.5, h, theta, m)
    S, G = w.coupling[i, k], w.diagonal[i, k - 1]
    return reduced(A, S, G), f + S @ (G @ w.right[i, k - 1])


@kernel
def clump(p: int, v: Vec, a: float, m: LumpedSystem) -> tuple[Vec, Sym]:
    """Force and matrix of a free point that moves with ``v``."""
    drag = m.point.drag[p] * sqrt(dot(v, v))
    return -drag * v - Vec(0.0, 0.0, m.structure.gravity * m.point.mass[p]), dyad(m.point.inertia[p] + a * drag, 0.0, v)


@kernel
def substitute(i: int, h: float, theta: float, further: Vec, m: LumpedSystem) -> None:
    """Move the points of a string, whose last one changes its velocity by ``further``, back to the first one."""
    s, w, j, last = m.line_point, m.segments_alone, m.line_order.finish[i], m.line_point.nodes - 1
    k, S = last - 1, w.coupling[j, last]
    while j >= 0:
        further = w.diagonal[j, k] @ (w.right[j, k] + S @ further)
        v = s.velocity[j, k]
        s.position[j, k] = s.position[j, k] + h * (v + theta * further)
        s.velocity[j, k] = v + further
        S = w.coupling[j, k]
        k -= 1
        if k < 0:
            j, k = m.line_order.back[j], last


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
            eliminate(order.start[i], h, theta, m)
            more, right = last_equation(order.finish[i], h, theta, m)
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
    # beyond the last point there are further ones, of which nothing is used, to fill the lanes
    segments = np.ones(LineSegment.shape(line=sizes["line"], node=sizes["node"] + -sizes["node"] % WIDTH))
    return LumpedPart(**vars(part) | {"sizes": sizes, "constants": part.constants | {"segments": segments}})
