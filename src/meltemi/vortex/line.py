"""Bound vortices of the blades: their circulation follows the polars at the velocity that all vortices induce.

In a step of the wake the velocity at an element is that of all vortices that do not change with the present
circulation, from begin to end of the step in the axes of the blade, plus the influence of the bound vortices of its
own blade and of the panels behind them (VW-5 to VW-8). Newton's method solves for the circulation.
"""

from __future__ import annotations

from meltemi.aero.lifting_line import induced_velocities, static_circulation
from meltemi.compiler import Rot, Vec, kernel, whole
from meltemi.maths.vectors import dot, norm
from meltemi.vortex.filaments import filament
from meltemi.vortex.tables import VortexSystem, WakeZone

LATEST, FIRST_GUESS = 1.5, 0.25
"""Share of a step of the wake up to which its velocities are extrapolated; induction factor before there is a wake."""
INSET = 0.125
"""Distance of the outermost vortex from the end of the blade, over the width of the element: with circulation that ends
like the square root of the distance it makes lift and induced drag of second order in the width."""
PIECES = 3
"""Filaments of a vortex from the blade to the youngest row, shorter near the blade: they leave it as the arc does."""


@kernel
def root_axes(m: VortexSystem, b: int) -> Rot:
    """Axes of a blade without its pitch, as the strips have them."""
    cp, sp = m.frame.cos_pitch[b], m.frame.sin_pitch[b]
    return m.frame.orientation[b] @ Rot(cp, -sp, 0.0, sp, cp, 0.0, 0.0, 0.0, 1.0)


@kernel
def into(R: Rot, v: Vec) -> Vec:
    """Components of v along the columns of R."""
    return Vec(
        R.xx * v.x + R.yx * v.y + R.zx * v.z, R.xy * v.x + R.yy * v.y + R.zy * v.z, R.xz * v.x + R.yz * v.y + R.zz * v.z
    )


@kernel
def velocity_at(m: VortexSystem, share: float, b: int, i: int) -> Vec:
    """[m/s] induced velocity at an element by the present circulation, axes of the blade (VW-6)."""
    bound, A = m.bound, m.bound_influence
    first, second = 1.0 - share, share
    u = first * bound.before[b, i] + second * bound.after[b, i]
    for j in range(A.sources):
        G = bound.circulation[b, j]
        u += (first * G) * A.before[b, i, j] + (second * G) * A.after[b, i, j]
    return u


@induced_velocities.variant
@kernel
def _(t: float, m: VortexSystem) -> None:
    state, bound, line = m.vortex_state, m.bound, m.lifting_line
    state.time = t
    if state.step <= 0.0:  # before there is a wake
        u = -FIRST_GUESS * m.rotor.axial_wind * m.machine.shaft
        for b in range(line.blades):
            for i in range(line.nodes):
                line.induced[b, i] = u
                bound.circulation[b, i] = static_circulation(u, m, b, i)
        return
    share = min(max((t - state.begin) / state.step, 0.0), LATEST)
    for b in range(line.blades):
        Q = root_axes(m, b)
        for i in range(line.nodes):
            u = Q @ velocity_at(m, share, b, i)
            bound.defect[b, i] = static_circulation(u, m, b, i) - bound.circulation[b, i]
        solve(m, b)
        for i in range(line.nodes):
            bound.circulation[b, i] += bound.defect[b, i]
        for i in range(line.nodes):
            line.induced[b, i] = Q @ velocity_at(m, share, b, i)


@kernel
def solve(m: VortexSystem, b: int) -> None:
    """Multiply the defects of a blade by the inverse of its factors."""
    x, A, n = m.bound.defect, m.bound_influence.factor, m.lifting_line.nodes
    for i in range(n):
        for j in range(i):
            x[b, i] -= A[b, i, j] * x[b, j]
    for k in range(n):
        i = n - 1 - k
        for j in range(i + 1, n):
            x[b, i] -= A[b, i, j] * x[b, j]
        x[b, i] /= A[b, i, i]


@kernel
def factorise(m: VortexSystem, b: int) -> None:
    """Factors of Newton's matrix I - d circulation / d velocity . influence; nearly diagonal, so without pivots."""
    F, A, n, Q = m.bound_influence.factor, m.bound_influence, m.lifting_line.nodes, root_axes(m, b)
    for i in range(n):
        u, normal = m.lifting_line.induced[b, i], m.lifting_line.normal[b, i]
        step = 0.01 * (1.0 + m.node_flow.speed[b, i])
        rise = static_circulation(u + step * normal, m, b, i) - static_circulation(u - step * normal, m, b, i)
        slope = max(0.5 * rise / step, 0.0)  # in stall the circulation falls: steps of full length would diverge
        across = into(Q, normal)
        for j in range(n):
            F[b, i, j] = -slope * dot(across, A.after[b, i, j])
        F[b, i, i] += 1.0
    for k in range(n):
        for i in range(k + 1, n):
            F[b, i, k] /= F[b, k, k]
            for j in range(k + 1, n):
                F[b, i, j] -= F[b, i, k] * F[b, k, j]


@kernel
def influence(m: VortexSystem, turn: Rot, b: int, age: float) -> None:
    """Influence of the bound vortices of a blade, and of the panels from them to the youngest row (VW-7).

    Args:
      turn: rotation of the rotor until the end of the step of the wake.
      age: [s] of the youngest row.
    """
    A, Q, p, zone, n = m.bound_influence, turn @ root_axes(m, b), m.vortex, m.wake_1, m.lifting_line.nodes
    core, closed = whole(p.core), p.shed < 1.0
    for i in range(n):
        x = moved(m, turn, control_point(m, b, i))
        for j in range(n):
            A.after[b, i, j] = Vec(0.0, 0.0, 0.0)
        for e in range(n + 1):  # the vortices that leave both ends of the elements
            begin, row = moved(m, turn, line_end(m, b, e)), zone.position[b, 0, e]
            core2, u = core2_at(zone, m, b, 0, e, p.blade_core, 0.0), Vec(0.0, 0.0, 0.0)
            for k in range(PIECES):
                u += filament(x, arc_point(m, begin, row, age, k), arc_point(m, begin, row, age, k + 1), core2, core)
            u = into(Q, u)
            if e > 0:
                A.after[b, i, e - 1] += u
            if e < n:
                A.after[b, i, e] -= u
        for j in range(n):
            begin, end = line_end(m, b, j), line_end(m, b, j + 1)
            width2 = dot(end - begin, end - begin)
            core2 = p.blade_core * p.blade_core * width2
            u = Vec(0.0, 0.0, 0.0)
            if j != i:
                u += filament(x, moved(m, turn, begin), moved(m, turn, end), core2, core)
            if closed:
                u += filament(x, zone.position[b, 0, j + 1], zone.position[b, 0, j], core2, core)
            A.after[b, i, j] += into(Q, u)


@kernel
def core2_at(zone: WakeZone, m: VortexSystem, b: int, r: int, e: int, factor: float, age: float) -> float:
    """[m^2] square of the core radius of a vortex: its size on the blade, and what it has grown since."""
    return factor * factor * zone.width2[b, r, e] + m.vortex.growth * age


@kernel
def line_end(m: VortexSystem, b: int, e: int) -> Vec:
    """Position [m] of the inner end of the bound vortex of element ``e``, or of the outer end of the last one."""
    line, last = m.lifting_line, m.lifting_line.nodes - 1
    if e == 0:
        return line.inner_end[b, 0] + INSET * (line.outer_end[b, 0] - line.inner_end[b, 0])
    if e > last:
        return line.outer_end[b, last] + INSET * (line.inner_end[b, last] - line.outer_end[b, last])
    return line.inner_end[b, e]


@kernel
def arc_point(m: VortexSystem, begin: Vec, row: Vec, age: float, k: int) -> Vec:
    """Position [m] of end ``k`` of the filaments between bound vortex and youngest row, on an arc about the shaft."""
    f, angle = (k / PIECES) ** 2, age * m.machine.rotor_speed
    d, s = begin - m.machine.hub_position, m.machine.shaft
    return begin + f * (row - begin) + (0.5 * angle * angle * f * (1.0 - f)) * (d - dot(d, s) * s)


@kernel
def control_point(m: VortexSystem, b: int, i: int) -> Vec:
    """Position [m] where the velocity of an element is computed (VW-5).

    Where the elements become narrower it is not the middle: it is where it would be if their ends were the cosines of
    equal angles (van Garrel 2003, sec. 4.3).
    """
    inner, outer = m.lifting_line.inner_end[b, i], m.lifting_line.outer_end[b, i]
    w = norm(outer - inner)
    before = norm(inner - m.lifting_line.inner_end[b, i - 1]) if i > 0 else 0.0
    after = norm(m.lifting_line.outer_end[b, i + 1] - outer) if i < m.lifting_line.nodes - 1 else 0.0
    if i == 0:
        share = w / (w + after)
    elif i == m.lifting_line.nodes - 1:
        share = before / (before + w)
    else:
        share = 0.25 * (1.0 + before / (before + w) + w / (w + after))
    return inner + share * (outer - inner)


@kernel
def moved(m: VortexSystem, turn: Rot, x: Vec) -> Vec:
    """Position [m] at the end of the step of the wake of a point on the rotor."""
    hub = m.machine.hub_position
    return hub + m.vortex_state.step * m.machine.hub_velocity + turn @ (x - hub)
