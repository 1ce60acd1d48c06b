"""Mooring lines in their static shapes: strings of lines, clump weights between them, and bridles.

A string is a row of lines, end to end, from a fairlead or a free point at its upper end to an anchor or a free point at
its lower one. The points between its lines hang in its plane, so that a string has the two unknown forces of a single
line. A *junction* is a free point where strings meet; its place follows from the balance of its forces.

Reference: docs/theory/floating.md (W-14, W-15, W-40 to W-42).
"""

from __future__ import annotations

from math import sqrt

from meltemi.compiler import (
    Entries,
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
from meltemi.control.faults import Faults
from meltemi.floating.catenary import Ends, guess, improved, span
from meltemi.maths.vectors import dot
from meltemi.structure.tables import StructureParameters

NONE, INNER = -1, -2
"""Instead of the number of a free point: there is none (an anchor or a fairlead); the end is within a string."""
STEPS, EXACT = 60, 1e-9
"""Most steps of a search, and the residual of a string over its length."""
SLACK = 1e-3
"""Least excess of the span over that at which a string would hang straight down, as a fraction of its length."""
POINTS = 8
"""Points of a line at which its drag and inertia act."""
REACH = 0.25
"""Longest step of the search for a junction, over the length of the shortest string there."""
SETTLED = 1e-7
"""Last step of the search over the longest one."""


class Line(Table, axes="line"):
    """Constants of a mooring line."""

    fairlead: Vectors = xyz("m", "upper end of the string on the platform")
    anchor: Vectors = xyz("m", "anchor of the string, inertial axes")
    length: Numbers = number("m", "unstretched length")
    mass: Numbers = number("kg/m", "mass per length less that of the displaced water")
    stiffness: Numbers = number("N", "Young's modulus times section")
    friction: Numbers = number("-", "friction coefficient of the sea bed")
    drag: Numbers = number("kg/m^2", "drag across the line, over length and velocity squared")
    axial_drag: Numbers = number("kg/m^2", "drag along the line, over length and velocity squared")
    inertia: Numbers = number("kg/m", "inertia per length across the line, with the water that moves with it")
    axial_inertia: Numbers = number("kg/m", "inertia per length along the line")
    on_bed: Numbers = number("-", "1 if it may lie on the sea bed, else 0")
    damping: Numbers = number("N s", "axial damping force over rate of strain, of a moving line")
    diameter: Numbers = number("m", "diameter of the line, by which the bed carries it")
    reach: Numbers = number("m", "unstretched length of the line and of those below it in its string")


class LineOrder(Table, axes="line", integer=True):
    """Connection of lines to strings: numbers of lines and of free points, or ``NONE``."""

    below: Entries[int] = number("-", "next line below in the string")
    point: Entries[int] = number("-", "free point at the lower end, within the string")
    head: Entries[int] = number("-", "free point at the upper end of a string's first line; INNER for other lines")
    foot: Entries[int] = number("-", "free point at the lower end of the string")
    start: Entries[int] = number("-", "first line of the string on the way to its last point")
    finish: Entries[int] = number("-", "last line on this way")
    onward: Entries[int] = number("-", "next line on this way")
    back: Entries[int] = number("-", "line before on this way")
    knot: Entries[int] = number("-", "free point at the line's end on this way")


class LineLoad(Table, axes="line"):
    """Forces of a mooring line."""

    horizontal: Numbers = number("N", "horizontal force at the upper end, the first guess of the next search")
    vertical: Numbers = number("N", "downward force at the upper end")
    fairlead: Numbers = number("N", "tension at the upper end")
    anchor: Numbers = number("N", "tension at the lower end")
    pull: Vectors = xyz("N", "force on the fairlead, inertial axes")


class LineEnd(Table, axes="line"):
    """Ends of lines, in inertial axes."""

    upper: Vectors = xyz("m", "upper end")
    lower: Vectors = xyz("m", "lower end")
    velocity: Vectors = xyz("m/s", "velocity of the fairlead")
    stiffness: Symmetrics = symmetric("N/m", "stiffness of the string against displacements of one end; at junctions")


class FreePoint(Table, axes="point"):
    """Constants of the free points."""

    mass: Numbers = number("kg", "mass less that of the displaced water")
    inertia: Numbers = number("kg", "mass with that of the water that moves with the point")
    drag: Numbers = number("kg/m", "drag over velocity squared")
    junction: Numbers = number("-", "1 if strings meet there, 0 within a string")


class PointState(Table, axes="point"):
    """Junctions in equilibrium."""

    place: Vectors = xyz("m", "position, the first guess of the next search")
    known: Numbers = number("-", "1 after the first search")
    flexibility: Symmetrics = symmetric("m/N", "displacement by a force")
    load: Vectors = xyz("N", "drag of the water on the point and what moves with it")


class Moorings(KernelRecord):
    """Tables of the mooring lines, on a platform or alone."""

    structure: StructureParameters
    faults: Faults
    line: Single[Line]
    line_order: Single[LineOrder]
    line_load: Single[LineLoad]
    line_end: Single[LineEnd]
    point: Single[FreePoint]
    point_state: Single[PointState]


@kernel
def dyad(a: float, b: float, e: Vec) -> Sym:
    """Matrix a I + b e e^T."""
    return Sym(a + b * e.x * e.x, a + b * e.y * e.y, a + b * e.z * e.z, b * e.x * e.y, b * e.x * e.z, b * e.y * e.z)


@kernel
def inverse(A: Sym) -> Sym:
    """Inverse of a symmetric matrix."""
    xx, yy, zz = A.yy * A.zz - A.yz * A.yz, A.xx * A.zz - A.xz * A.xz, A.xx * A.yy - A.xy * A.xy
    xy, xz, yz = A.xz * A.yz - A.xy * A.zz, A.xy * A.yz - A.xz * A.yy, A.xy * A.xz - A.xx * A.yz
    d = 1.0 / (A.xx * xx + A.xy * xy + A.xz * xz)
    return Sym(d * xx, d * yy, d * zz, d * xy, d * xz, d * yz)


@kernel
def line_of(i: int, m: Moorings) -> tuple[float, float, float, float, float]:
    """Length, weight per length, stiffness, friction, and whether it may lie on the bed, as of :func:`span`."""
    line = m.line
    return line.length[i], m.structure.gravity * line.mass[i], line.stiffness[i], line.friction[i], line.on_bed[i]


@kernel
def more(a: Ends, b: Ends) -> Ends:
    """Span of two rows of lines, end to end."""
    return Ends(a.x + b.x, a.z + b.z, a.xh + b.xh, a.xv + b.xv, a.zh + b.zh, a.zv + b.zv, b.anchor_h, b.anchor_v)


@kernel
def less(a: Ends, b: Ends) -> Ends:
    """Span of a row of lines without that of its upper part."""
    return more(a, Ends(-b.x, -b.z, -b.xh, -b.xv, -b.zh, -b.zv, a.anchor_h, a.anchor_v))


@kernel
def string_span(i: int, H: float, V: float, m: Moorings) -> Ends:
    """Span of a string with forces H, V [N] on its upper end; leaves the forces of each of its lines (W-40)."""
    load, order, zero = m.line_load, m.line_order, 0.0 * H
    whole = Ends(zero, zero, zero, zero, zero, zero, H, V)
    # derivatives of the forces on the upper end of a line by those on that of the string
    hh, hv, vv = zero + 1.0, zero, zero + 1.0
    k = i
    while k >= 0:
        L, w, EA, friction, on_bed = line_of(k, m)
        load.horizontal[k] = H
        load.vertical[k] = V
        lies = on_bed > 0.0 and w * L > V
        e = Ends(L + zero, zero, zero, zero, zero, zero, zero, zero)
        if H > 0.0:
            e = span(H, V, L, w, EA, friction, on_bed)
        xv, zv = e.xh * hv + e.xv * vv, e.zh * hv + e.zv * vv
        whole = more(whole, Ends(e.x, e.z, e.xh * hh, xv, e.zh * hh, zv, e.anchor_h, e.anchor_v))
        load.fairlead[k] = sqrt(H * H + V * V)
        load.anchor[k] = sqrt(e.anchor_h * e.anchor_h + e.anchor_v * e.anchor_v)
        if lies:
            H, hv = e.anchor_h, hv + friction * vv
            if not H > 0.0:
                hh, hv = zero, zero
        V = e.anchor_v
        p = order.point[k]
        if p >= 0:
            V -= m.structure.gravity * m.point.mass[p]
        # the bed carries the weight below
        if lies or (on_bed > 0.0 and V < 0.0):
            V, vv = zero, zero
        k = order.below[k]
    return whole


@kernel
def first_guess(i: int, x: float, z: float, m: Moorings) -> tuple[float, float]:
    """First forces H, V [N] of the search, of one line with the weight of the string."""
    weight, k = 0.0 * x, i
    while k >= 0:
        weight += m.line.length[k] * m.line.mass[k]
        p = m.line_order.point[k]
        if p >= 0:
            weight += max(m.point.mass[p], 0.0)
        k = m.line_order.below[k]
    return guess(x, z, m.line.reach[i], m.structure.gravity * weight / m.line.reach[i])


@kernel
def string_forces(i: int, d: Vec, m: Moorings) -> tuple[Ends, float]:
    """Forces of a string whose ends are ``d`` [m] apart, left in ``line_load``; its span, and the horizontal part.

    Newton's method from the last forces (W-14).
    """
    load, L, on_bed = m.line_load, m.line.reach[i], m.line.on_bed[i]
    # nearer to an anchor on the bed than this, the string hangs straight down and hardly pulls
    across = max(sqrt(d.x * d.x + d.y * d.y + 1e-12), on_bed * ((1.0 + SLACK) * L - d.z))
    H, V = load.horizontal[i], load.vertical[i]
    if not H > 0.0:
        H, V = first_guess(i, across, d.z, m)
    for _ in range(STEPS):
        e = string_span(i, H, V, m)
        dx, dz = across - e.x, d.z - e.z
        H, V = improved(e, dx, dz, H, V)
        if abs(dx) + abs(dz) < EXACT * L:
            break
    return string_span(i, H, V, m), across


@kernel
def string_stiffness(i: int, e: Ends, d: Vec, across: float, m: Moorings) -> Sym:
    """Stiffness of a string against displacements of one end."""
    det, aside = e.xh * e.zv - e.xv * e.zh, m.line_load.horizontal[i] / across
    x, y = d.x / across, d.y / across
    along, both = e.zv / det - aside, -0.5 * (e.xv + e.zh) / det
    return Sym(aside + along * x * x, aside + along * y * y, e.xh / det, along * x * y, both * x, both * y)


@kernel
def is_lost(i: int, m: Moorings) -> bool:
    """Whether a line of a string has parted."""
    k = i
    while k >= 0:
        if m.faults.line_lost[k] == 1.0:
            return True
        k = m.line_order.below[k]
    return False


@kernel
def holds(i: int, n: int, m: Moorings) -> bool:
    """Whether line ``i`` is the first of an intact string at the free point ``n``."""
    order = m.line_order
    return order.head[i] != INNER and (order.head[i] == n or order.foot[i] == n) and not is_lost(i, m)


@kernel
def is_held(n: int, m: Moorings) -> bool:
    """Whether a junction still joins the platform with something."""
    legs, all_strings = 0, 0
    for i in range(m.line_order.lines):  # type: ignore[attr-defined]
        if holds(i, n, m):
            all_strings += 1
            legs += m.line_order.foot[i] == n
    return legs > 0 and all_strings > 1


@kernel
def pulls(i: int, m: Moorings) -> bool:
    """Whether a string still joins the platform with something."""
    n = max(m.line_order.head[i], m.line_order.foot[i])
    return not is_lost(i, m) and (n < 0 or is_held(n, m))


@kernel
def half_of(i: int, m: Moorings) -> tuple[float, float]:
    """Half the inertia [kg] of a string and half its drag across [kg/m]."""
    mass, drag, k = 0.0 * m.line.length[i], 0.0 * m.line.length[i], i
    while k >= 0:
        mass += 0.5 * m.line.length[k] * m.line.inertia[k]
        drag += 0.5 * m.line.length[k] * m.line.drag[k]
        k = m.line_order.below[k]
    return mass, drag


@kernel
def first_place(n: int, m: Moorings) -> Vec:
    """Start of the search for a junction: between the ends of its strings, by their lengths."""
    nothing = Vec(0.0, 0.0, 0.0)
    above, below, legs, trunks, short, long = nothing, nothing, 0, 0, 0.0, 0.0
    for i in range(m.line_order.lines):  # type: ignore[attr-defined]
        if holds(i, n, m):
            if m.line_order.foot[i] == n:
                above, legs, short = above + m.line_end.upper[i], legs + 1, short + m.line.reach[i]
            else:
                below, trunks, long = below + m.line.anchor[i], trunks + 1, long + m.line.reach[i]
    above, short = (1.0 / legs) * above, short / legs
    if trunks == 0:
        return above - Vec(0.0, 0.0, 0.5 * short)
    return above + (short / (short + long / trunks)) * ((1.0 / trunks) * below - above)


@kernel
def settle(n: int, m: Moorings) -> None:
    """Bring a junction into equilibrium: Newton's method with the stiffness of its strings (W-41)."""
    s, order, load = m.point_state, m.line_order, m.line_load
    if not s.known[n] > 0.0:
        s.place[n] = first_place(n, m)
        s.known[n] = 1.0
    for _ in range(STEPS):
        x, F = s.place[n], Vec(0.0, 0.0, -m.structure.gravity * m.point.mass[n])
        K, longest = dyad(0.0, 0.0, F), 1e30
        for i in range(order.lines):  # type: ignore[attr-defined]
            if holds(i, n, m):
                longest = min(longest, REACH * m.line.reach[i])
                if order.foot[i] == n:
                    d = m.line_end.upper[i] - x
                    e, across = string_forces(i, d, m)
                    F += Vec(e.anchor_h * d.x / across, e.anchor_h * d.y / across, e.anchor_v)
                else:
                    d = x - m.line.anchor[i]
                    e, across = string_forces(i, d, m)
                    H = load.horizontal[i]
                    F -= Vec(H * d.x / across, H * d.y / across, load.vertical[i])
                m.line_end.stiffness[i] = string_stiffness(i, e, d, across, m)
                K += m.line_end.stiffness[i]
        s.flexibility[n] = inverse(K)
        step = s.flexibility[n] @ F
        size = sqrt(dot(step, step))
        s.place[n] = x + min(1.0, longest / (size + 1e-30)) * step
        if size < SETTLED * longest:
            break


@kernel
def carried(part: Ends, e: Ends, side: float, c: float, b: float, inertia: Vec, drag: Vec, v: Vec) -> tuple[Vec, Sym]:
    """Drag and inertia of a point of a string at its upper end, which moves with ``v``; along, aside, up (W-15).

    Args:
      part: span of what is below the point; e: of the string.
      side: motion aside by that of the upper end.
      c, b: direction of the line, along and up.
      inertia: [kg] inertia along the line and across it; drag: [kg/m] along, across, and in any direction.
    """
    det = e.xh * e.zv - e.xv * e.zh
    hh, hz = (part.xh * e.zv - part.xv * e.zh) / det, (part.xv * e.xh - part.xh * e.xv) / det
    zh, zz = (part.zh * e.zv - part.zv * e.zh) / det, (part.zv * e.xh - part.zh * e.xv) / det
    uh, uz, ul = hh * v.x + hz * v.z, zh * v.x + zz * v.z, side * v.y
    along, normal = c * uh + b * uz, c * uz - b * uh
    across = normal * normal + ul * ul
    any_way = drag.z * sqrt(across + along * along)
    fn, fa = drag.y * sqrt(across) + any_way, drag.x * abs(along) + any_way
    gh, gz = b * fn * normal - c * fa * along, -b * fa * along - c * fn * normal
    ah, az, nh, nz = c * hh + b * zh, c * hz + b * zz, c * zh - b * hh, c * zz - b * hz
    mass = Sym(
        inertia.x * ah * ah + inertia.y * nh * nh,
        inertia.y * side * side,
        inertia.x * az * az + inertia.y * nz * nz,
        0.0 * side,
        inertia.x * ah * az + inertia.y * nh * nz,
        0.0 * side,
    )
    return Vec(hh * gh + zh * gz, -side * fn * ul, hz * gh + zz * gz), mass


@kernel
def moved_line(k: int, e: Ends, rest: Ends, ground: float, across: float, v: Vec, m: Moorings) -> tuple[Vec, Sym]:
    """Drag and inertia of a line at the upper end of its string, which moves with ``v``; along, aside, up (W-15).

    Args:
      e: span of the string; rest: of the lines below.
      ground: [m] length of the string that lies on the bed.
    """
    line, load, zero = m.line, m.line_load, 0.0 * across
    L, w, EA, friction, on_bed = line_of(k, m)
    H, V = load.horizontal[k], load.vertical[k]
    F, M = Vec(zero, zero, zero), Sym(zero, zero, zero, zero, zero, zero)
    lying = on_bed * min(max(L - V / w, 0.0), L)
    # without friction what lies on the bed slides to the side, too, as a straight line from the anchor
    fixed = ground
    if friction <= 0.0:
        fixed = zero
        a, b = rest.x / across, (rest.x + lying) / across
        push = 0.25 * lying * (b * b * b + a * (b * b + a * b + a * a)) * line.drag[k] * abs(v.y) * v.y
        F -= Vec(zero, push, zero)
        M += Sym(zero, lying * (b * b + a * b + a * a) / 3.0 * line.inertia[k], zero, zero, zero, zero)
    if lying < L:
        ds = (L - lying) / POINTS
        inertia = Vec(line.axial_inertia[k] * ds, line.inertia[k] * ds, zero)
        drag = Vec(line.axial_drag[k] * ds, line.drag[k] * ds, zero)
        for n in range(POINTS):
            s = lying + (n + 0.5) * ds
            up = V - w * (L - s)
            part = more(span(H, up, s, w, EA, 0.0, 1.0 * (lying > 0.0)), rest)
            tension = sqrt(H * H + up * up)
            side = (part.x - fixed) / (across - fixed)
            force, mass = carried(part, e, side, H / tension, up / tension, inertia, drag, v)
            F += force
            M += mass
    p = m.line_order.point[k]
    if p >= 0:
        inertia, drag = Vec(m.point.inertia[p], m.point.inertia[p], zero), Vec(zero, zero, m.point.drag[p])
        side = max(rest.x - fixed, 0.0) / (across - fixed)
        force, mass = carried(rest, e, side, zero + 1.0, zero, inertia, drag, v)
        F += force
        M += mass
    return F, M


@kernel
def moved_string(i: int, e: Ends, d: Vec, across: float, velocity: Vec, m: Moorings) -> tuple[Vec, Sym]:
    """Drag of a string on its upper end, which moves with ``velocity``, and its inertia there (W-15).

    The points of its lines move as those of lines at rest do when this end moves.
    """
    order, load, line = m.line_order, m.line_load, m.line
    x, y, zero = d.x / across, d.y / across, 0.0 * across
    v = Vec(x * velocity.x + y * velocity.y, x * velocity.y - y * velocity.x, velocity.z)
    ground, k = zero, i
    while k >= 0:
        if line.on_bed[k] > 0.0:
            ground += min(
                max(line.length[k] - load.vertical[k] / (m.structure.gravity * line.mass[k]), 0.0), line.length[k]
            )
        k = order.below[k]
    rest, F, M = e, Vec(zero, zero, zero), Sym(zero, zero, zero, zero, zero, zero)
    k = i
    while k >= 0:
        if load.horizontal[k] > 0.0:
            shape = rest
            if order.below[k] >= 0:
                L, w, EA, friction, on_bed = line_of(k, m)
                shape = span(load.horizontal[k], load.vertical[k], L, w, EA, friction, on_bed)
            rest = less(rest, shape)
            force, mass = moved_line(k, e, rest, ground, across, v, m)
            F += force
            M += mass
        k = order.below[k]
    mass = Sym(
        M.xx * x * x + M.yy * y * y, M.xx * y * y + M.yy * x * x, M.zz, (M.xx - M.yy) * x * y, M.xz * x, M.xz * y
    )
    return Vec(F.x * x - F.y * y, F.x * y + F.y * x, F.z), mass


@kernel
def lower_ends(i: int, d: Vec, across: float, m: Moorings) -> None:
    """Places of the ends of the lines of a string, from its upper end downwards."""
    ends, load, order, k = m.line_end, m.line_load, m.line_order, i
    place = ends.upper[i]
    while k >= 0:
        ends.upper[k] = place
        L, w, EA, friction, on_bed = line_of(k, m)
        x, z = L, 0.0 * L
        if load.horizontal[k] > 0.0:
            e = span(load.horizontal[k], load.vertical[k], L, w, EA, friction, on_bed)
            x, z = e.x, e.z
        place -= Vec(x * d.x / across, x * d.y / across, z)
        ends.lower[k] = place
        k = order.below[k]


@kernel
def hang_all(m: Moorings) -> None:
    """Equilibrium of all lines below given fairleads, with the places of their ends."""
    order, ends, s = m.line_order, m.line_end, m.point_state
    for n in range(m.point.points):  # type: ignore[attr-defined]
        if m.point.junction[n] > 0.0 and is_held(n, m):
            settle(n, m)
    for i in range(order.lines):  # type: ignore[attr-defined]
        if order.head[i] != INNER and pulls(i, m):
            if order.head[i] >= 0:
                ends.upper[i] = s.place[order.head[i]]
            low = m.line.anchor[i]
            if order.foot[i] >= 0:
                low = s.place[order.foot[i]]
            d = ends.upper[i] - low
            _, across = string_forces(i, d, m)
            lower_ends(i, d, across, m)
