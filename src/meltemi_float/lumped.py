"""Mooring lines of lumped masses, in place of their static shapes.

A line is a chain of points with the mass, weight, drag and added mass of a segment each; segments carry tension
and axial damping.
A step is linearly implicit: tension, damping and sea bed act with their change over it, which costs one solution of a
tridiagonal system of 3 x 3 blocks for each line, and leaves the step to the turbine. Until the first step, and in
linear models, lines have their static shapes.

Reference: docs/theory/floating.md (W-24 to W-28); Hall and Goupee (2015) for forces; Hairer and Wanner (1996), IV.7.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from meltemi.core.kernel import kernel
from meltemi.maths.algebra import Sym, Vec
from meltemi.maths.records import Record, Single
from meltemi.maths.rotations import angular_velocity, rotation
from meltemi.maths.tables import Numbers, Symmetrics, Table, Vectors, View, number, symmetric, xyz
from meltemi.maths.vectors import cross, dot
from meltemi.simulation.step import begin_parts_step
from meltemi_float.catenary import line_forces, span
from meltemi_float.floater import FloaterPart, FloaterSystem, add_mass, line_of, line_pull, static_pull
from meltemi_float.floater import part_of as static_part

Float = NDArray[np.float64]

THETA = 0.5
"""Weight of the end of a step: second order, without damping of its own (W-27)."""
BED_STIFFNESS, BED_DAMPING = 3e6, 3e5
"""[Pa/m], [Pa s/m] of the sea bed below a line, over its diameter; the defaults of MoorDyn."""
CREEP = 0.01
"""[m/s] of a point on the bed, below which friction grows linearly."""
RELAXATIONS, LONG_STEP = 200, 0.5
"""Steps without velocity [s] from the static shape of a continuous line to that of the points."""


class LinePoint(Table, axes="line node"):
    """Points of lines above the anchor; the last one is the fairlead."""

    position: Vectors = xyz("m", "state: place")
    velocity: Vectors = xyz("m/s", "state: velocity")


class LineState(Table, axes="line"):
    """Whether a line moves."""

    begun: Numbers = number("-", "1 after the first step")


class Elimination(Table, axes="line node"):
    """Rows of the tridiagonal system of a line."""

    inverse: Symmetrics = symmetric("1/kg", "of the reduced block on the diagonal")
    beyond: Symmetrics = symmetric("kg", "block of the point above, with the opposite sign")
    right: Vectors = xyz("kg m/s", "reduced right-hand side")


class Lump(Table, axes="line"):
    """Constants of a line of points."""

    damping: Numbers = number("N s", "axial damping force over rate of strain")
    diameter: Numbers = number("m", "of the line, by which the bed carries it")


class LumpedSystem(FloaterSystem):
    """A floating turbine on moving lines."""

    line_point: Single[LinePoint]
    line_state: Single[LineState]
    elimination: Single[Elimination]
    lump: Single[Lump]


@kernel
def dyad(a: float, b: float, e: Vec) -> Sym:
    """a I + b e e^T."""
    return Sym(a + b * e.x * e.x, a + b * e.y * e.y, a + b * e.z * e.z, b * e.x * e.y, b * e.x * e.z, b * e.y * e.z)


@kernel
def inverse(A: Sym) -> Sym:
    """Inverse of a symmetric matrix."""
    xx, yy, zz = A.yy * A.zz - A.yz * A.yz, A.xx * A.zz - A.xz * A.xz, A.xx * A.yy - A.xy * A.xy
    xy, xz, yz = A.xz * A.yz - A.xy * A.zz, A.xy * A.yz - A.xz * A.yy, A.xy * A.xz - A.xx * A.yz
    d = 1.0 / (A.xx * xx + A.xy * xy + A.xz * xz)
    return Sym(d * xx, d * yy, d * zz, d * xy, d * xz, d * yz)


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
    return e, size, taut, taut + m.lump.damping[i] / length * dot(change, e)


@kernel
def march(i: int, h: float, theta: float, end: Vec, m: LumpedSystem) -> None:
    """A step of a line while its fairlead moves to ``end`` (W-24 to W-27)."""
    line, s, w, lump, last = m.line, m.line_point, m.elimination, m.lump, m.line_point.nodes - 1
    length, EA = line.length[i] / (last + 1.0), line.stiffness[i]
    weight, bed = m.structure.gravity * line.mass[i] * length, lump.diameter[i] * length
    a, b = theta * h, theta * h * theta * h
    s.velocity[i, last] = (1.0 / h) * (end - s.position[i, last])
    low, v_low = line.anchor[i], Vec(0.0, 0.0, 0.0)
    # of the segment below a point: direction, force, parts of its stiffness, block of the matrix
    e0, T0, k0, n0 = Vec(0.0, 0.0, 0.0), 0.0, 0.0, 0.0
    S0 = dyad(0.0, 0.0, e0)
    G, right = S0, e0
    for k in range(-1, last):
        x = low if k < 0 else s.position[i, k]
        v = v_low if k < 0 else s.velocity[i, k]
        up, v_up = s.position[i, k + 1], s.velocity[i, k + 1]
        e, size, taut, T = segment(i, up - x, v_up - v, m)
        across = taut / size
        along = (EA / length if taut > 0.0 else 0.0 * taut) - across
        S = dyad(b * across, b * along + a * lump.damping[i] / length, e)
        if k >= 0:
            q = up - low
            q = (1.0 / sqrt(dot(q, q))) * q
            vt = dot(v, q)
            vn = v - vt * q
            cn = length * line.drag[i] * sqrt(dot(vn, vn))
            ca = length * line.axial_drag[i] * abs(vt)
            heavy, other = length * line.inertia[i], length * (line.axial_inertia[i] - line.inertia[i])
            A = dyad(heavy + a * cn, other + a * (ca - cn), q) + S0 + S
            change, change0 = v_up - v, v - v_low
            f = T * e - T0 * e0 - cn * vn - (ca * vt) * q - Vec(0.0, 0.0, weight)
            drift = across * change + (along * dot(e, change)) * e - k0 * change0 - (n0 * dot(e0, change0)) * e0
            deep = m.floater.bed - x.z
            if deep > 0.0:
                hold = line.friction[i] * weight / max(sqrt(v.x * v.x + v.y * v.y), CREEP)
                f += Vec(-hold * v.x, -hold * v.y, bed * (BED_STIFFNESS * deep - BED_DAMPING * v.z))
                drift += Vec(0.0, 0.0, -bed * BED_STIFFNESS * v.z)
                A += Sym(h * hold, h * hold, bed * (a * BED_DAMPING + b * BED_STIFFNESS), 0.0, 0.0, 0.0)
            r = h * f + (h * a) * drift
            if k > 0:
                A = reduced(A, S0, G)
                r += S0 @ (G @ right)
            G, right = inverse(A), r
            w.inverse[i, k] = G
            w.beyond[i, k] = S
            w.right[i, k] = r
        e0, T0, k0, n0, S0 = e, T, across, along, S
        low, v_low = x, v
    further = Vec(0.0, 0.0, 0.0)
    for back in range(last):
        k = last - 1 - back
        further = w.inverse[i, k] @ (w.right[i, k] + w.beyond[i, k] @ further)
        v = s.velocity[i, k]
        s.position[i, k] = s.position[i, k] + h * (v + theta * further)
        s.velocity[i, k] = v + further
    s.position[i, last] = end


@kernel
def hang(i: int, end: Vec, speed: Vec, m: LumpedSystem) -> None:
    """Bring a line into equilibrium below a fairlead, from the static shape of a continuous one (W-28).

    Its points then move with the fairlead in proportion to their distance from the anchor along the line.
    """
    line, s, load, n = m.line, m.line_point, m.line_load, m.line_point.nodes
    anchor, (L, w, EA, friction, on_bed) = line.anchor[i], line_of(i, m)
    d = end - anchor
    across = sqrt(d.x * d.x + d.y * d.y + 1e-12)
    H, V = line_forces(across, d.z, L, w, EA, friction, on_bed, load.horizontal[i], load.vertical[i])
    lying = max(L - V / w, 0.0) * on_bed
    for k in range(n):
        part = L * (k + 1.0) / n
        x, z = part * (1.0 + H / EA), 0.0
        if part > lying:
            up = span(H, V - w * (L - part), part, w, EA, friction, on_bed)
            x, z = up.x, up.z
        s.position[i, k] = anchor + Vec(x * d.x / across, x * d.y / across, z)
    s.position[i, n - 1] = end
    for _ in range(RELAXATIONS):
        for k in range(n):
            s.velocity[i, k] = Vec(0.0, 0.0, 0.0)
        march(i, LONG_STEP, 1.0, end, m)
    for k in range(n):
        s.velocity[i, k] = ((k + 1.0) / n) * speed


@begin_parts_step.variant
@kernel
def lumped_begin(dt: float, m: LumpedSystem) -> None:
    """Lines follow their fairleads to the end of the step."""
    q, v, k, down = m.q, m.v, m.top_shape.modes - 6, Vec(0.0, 0.0, -m.structure.tower_base)
    base, theta = Vec(q[k], q[k + 1], q[k + 2]) - down, Vec(q[k + 3], q[k + 4], q[k + 5])
    R, spin = rotation(theta), angular_velocity(theta, Vec(v[k + 3], v[k + 4], v[k + 5]))
    for i in range(m.line_state.lines):  # type: ignore[attr-defined]
        arm = R @ (down + m.line.fairlead[i])
        speed = Vec(v[k], v[k + 1], v[k + 2]) + cross(spin, arm)
        if m.line_state.begun[i] > 0.0:
            march(i, dt, THETA, base + arm, m)
            m.line_point.velocity[i, m.line_point.nodes - 1] = speed
        else:
            hang(i, base + arm, speed, m)
            m.line_state.begun[i] = 1.0


@line_pull.variant
@kernel
def lumped_pull(i: int, r: Vec, m: LumpedSystem) -> Vec:
    """Force of a line on its fairlead: of the last segment, and of the half of it that moves with the platform."""
    if m.line_state.begun[i] <= 0.0:
        return static_pull(i, r, m)
    p, line, s, last = m.platform, m.line, m.line_point, m.line_point.nodes - 1
    half = 0.5 * line.length[i] / (last + 1.0)
    d, change = s.position[i, last] - s.position[i, last - 1], s.velocity[i, last] - s.velocity[i, last - 1]
    e, _, _, T = segment(i, d, change, m)
    v = p.velocity + cross(p.spin, r)
    vt = dot(v, e)
    vn = v - vt * e
    M = dyad(half * line.inertia[i], half * (line.axial_inertia[i] - line.inertia[i]), e)
    known = p.bias + cross(p.spin_bias, r) + cross(p.spin, cross(p.spin, r))
    pull = -(T * e) - (half * line.drag[i] * sqrt(dot(vn, vn))) * vn - (half * line.axial_drag[i] * abs(vt) * vt) * e
    pull -= Vec(0.0, 0.0, half * m.structure.gravity * line.mass[i]) + M @ known
    add_mass(M, r, m)
    m.line_load.anchor[i] = segment(i, s.position[i, 0] - line.anchor[i], s.velocity[i, 0], m)[2]
    m.line_load.fairlead[i] = sqrt(dot(pull, pull))
    return pull


@dataclass(frozen=True)
class LumpedPart(FloaterPart):
    """The platform of a model on moving lines."""

    system: ClassVar[type[Record] | None] = LumpedSystem
    signals: ClassVar[dict[str, type[Table]]] = {
        **FloaterPart.signals,
        "line_point": LinePoint,
        "line_state": LineState,
    }
    lump: Float
    segments: int

    def sizes(self) -> dict[str, int]:
        """Lengths of the axes of the signals."""
        return {**super().sizes(), "node": self.segments}

    def arrays(self) -> dict[str, Any]:
        """Constants of the platform and its lines, and still water."""
        work = Elimination.zeros(line=self.line.shape[1], node=self.segments)
        return {**super().arrays(), "lump": self.lump.copy(), "elimination": work}


def part_of(turbine: Any, options: Any, rotor: Any) -> FloaterPart:
    """The platform of a turbine, on static or moving lines; as ``simulation.parts.parts_of``.

    Raises:
      InputError: as of :func:`meltemi_float.floater.part_of`.
    """
    found, lines, n = static_part(turbine, options, rotor), turbine.platform.lines, turbine.platform.segments
    if turbine.platform.line_model == "static":
        return found
    lump = Lump.zeros(line=len(lines))
    v = View(Lump, lump)
    v["damping"] = [x.damping_ratio * x.length / n * np.sqrt(x.stiffness * x.mass) for x in lines]
    v["diameter"] = [x.diameter for x in lines]
    return LumpedPart(**vars(found), lump=lump, segments=n)
