"""A floating platform as a part of the machine: water, waves, radiation, drag, weight and mooring lines at its base.

All act on the six motions of the tower base, the last coordinates of the tower. Coefficients of the water are about the
platform's point on the tower's axis at still water, which moves with it, in inertial axes.

Reference: docs/theory/floating.md (W-4, W-7 to W-15, W-33).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import atan2, cos, exp, sin, sqrt
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import InputError
from meltemi.core.kernel import kernel
from meltemi.maths.algebra import Rot, Sym, Vec
from meltemi.maths.records import Array2, Constant, Record, Single
from meltemi.maths.rotations import angular_acceleration, angular_velocity, rotation
from meltemi.maths.tables import Numbers, Table, Vectors, View, number, xyz
from meltemi.maths.vectors import cross, dot, turn
from meltemi.numbers.dispatch import by_record
from meltemi.simulation.channels import Channel, channels_of_group
from meltemi.simulation.parts import ParameterTables, Part, StateRows
from meltemi.simulation.step import begin_parts_step, outer_forces, outer_section_loads, part_rates
from meltemi.simulation.system import Outputs, System
from meltemi.structure.dynamics import MASS, WEIGHT, inertia_about
from meltemi.structure.kinematics import tower_top
from meltemi.structure.section_loads import tower_loads
from meltemi_float.balance import check_balance, check_reach
from meltemi_float.coefficients import Coefficients, read_coefficients
from meltemi_float.members import flow_at, pieces, with_members
from meltemi_float.mooring import (
    INNER,
    NONE,
    Line,
    LineLoad,
    Moorings,
    PointState,
    dyad,
    half_of,
    holds,
    is_held,
    moved_string,
    pulls,
    settle,
    silence,
    string_forces,
)
from meltemi_float.moorings import mooring_tables
from meltemi_float.platform import Platform
from meltemi_float.radiation import Radiation, fit_radiation
from meltemi_float.waves import mean_drift, wave_forces
from meltemi_sea.airy import GRAVITY
from meltemi_sea.field import AHEAD, BEHIND
from meltemi_sea.pile import Instant, cubic

Float = NDArray[np.float64]
FEATURE = "the floating platform"


class Floater(Table):
    """Constants of the platform."""

    mass: float = number("kg", "of the platform with ballast")
    centre: Vec = xyz("m", "of mass, from the platform's point")
    inertia: Vec = xyz("kg m^2", "about the centre of mass")
    displaced: float = number("kg", "of water at rest")
    buoyancy_x: float = number("m", "x of its centre")
    buoyancy_y: float = number("m", "y of its centre")
    step: float = number("s", "between the samples of the waves")
    period: float = number("s", "after which the waves repeat")
    bed: float = number("m", "height of the sea bed")
    current: Vec = xyz("m/s", "velocity of the water at the height of the centre of mass, without waves")


class RadiationState(Table, axes="mode"):
    """Memory of radiated waves: complex amplitudes of decaying oscillations."""

    real: Numbers = number("m", "state: real part")
    imaginary: Numbers = number("m", "state: imaginary part")


class Strip(Table, axes="strip"):
    """Constants of the pieces of members that have drag."""

    place: Vectors = xyz("m", "on the platform")
    axis: Vectors = xyz("-", "of the member")
    drag: Numbers = number("kg/m", "force across over velocity squared")
    plate: Numbers = number("kg/m", "force along over velocity squared")


class PlatformState(Table):
    """Motion of the platform's point, and loads about it."""

    elevation: float = number("m", "of the surface at the origin")
    displacement: Vec = xyz("m", "of the platform's point")
    angle: Vec = xyz("rad", "roll, pitch, yaw: rotations about x, then y, then z")
    velocity: Vec = xyz("m/s", "of the platform's point")
    spin: Vec = xyz("rad/s", "angular velocity")
    arm: Vec = xyz("m", "from the tower base to the platform's point")
    bias: Vec = xyz("m/s^2", "acceleration of the point without that of coordinates")
    spin_bias: Vec = xyz("rad/s^2", "angular acceleration without that of coordinates")
    force: Vec = xyz("N", "of the water: buoyancy, waves, radiation with added mass, drag")
    moment: Vec = xyz("N m", "of the water about the platform's point")
    mooring_force: Vec = xyz("N", "of the lines")
    mooring_moment: Vec = xyz("N m", "of the lines about the platform's point")
    offset: float = number("m", "horizontal distance of the point from its place at rest")
    tilt: float = number("rad", "of the platform's vertical axis")


class FloaterSystem(System, Moorings):
    """A floating turbine.

    Attributes:
      float_matrices: (5, 6, 6) as rows of (30, 6): added mass, stiffness of the water, further stiffness, linear and
        quadratic damping; that of the water over gravity.
      float_waves: (T, 7) elevation, and forces and moments of the waves.
      float_pole, float_input, float_output: (P, 2), (P, 12), (P, 12) oscillations of the radiation, real parts first.
      float_flow: (T, 3 P) velocity of the water at the strips.
      tower_air: (3, N) forces of the wind on the nodes of the tower, while loads are in the axes of the base.
      base_columns: (6, 6) velocities of the platform's point, linear and angular, by unit rates of the coordinates.
      base_six: (4, 6) velocity in platform axes, load of the water, further load, position and
        then velocity against the current.
    """

    floater: Floater
    platform: PlatformState
    radiation: Single[RadiationState]
    d_radiation: Single[RadiationState]
    strip: Single[Strip]
    float_flow: Constant[Array2]
    float_matrices: Constant[Array2]
    float_waves: Constant[Array2]
    float_pole: Constant[Array2]
    float_input: Constant[Array2]
    float_output: Constant[Array2]
    tower_air: Array2
    base_columns: Array2
    base_six: Array2


ADDED, WATER, FURTHER, LINEAR, QUADRATIC = 0, 6, 12, 18, 24
"""First rows of the matrices."""


@kernel
def base_motion(m: FloaterSystem) -> None:
    """Position and velocity of the platform's point, and its partial velocities (W-7)."""
    p, first, q, v = m.platform, m.top_shape.modes - 6, m.q, m.v
    theta, rate = Vec(q[first + 3], q[first + 4], q[first + 5]), Vec(v[first + 3], v[first + 4], v[first + 5])
    R = rotation(theta)
    down = Vec(0.0, 0.0, -m.structure.tower_base)
    arm, w, known = R @ down, angular_velocity(theta, rate), angular_acceleration(theta, rate)
    p.arm = arm
    p.displacement = Vec(q[first], q[first + 1], q[first + 2]) + arm - down
    p.angle = Vec(atan2(R.zy, R.zz), atan2(-R.zx, sqrt(R.xx * R.xx + R.yx * R.yx)), atan2(R.yx, R.xx))
    p.velocity = Vec(v[first], v[first + 1], v[first + 2]) + cross(w, arm)
    p.spin = w
    p.bias = cross(known, arm) + cross(w, cross(w, arm))
    p.spin_bias = known
    J = m.base_columns
    for k in range(6):
        e = Vec(1.0 * (k % 3 == 0), 1.0 * (k % 3 == 1), 1.0 * (k % 3 == 2))
        T, W = e, 0.0 * e
        if k >= 3:
            W = angular_velocity(theta, e)
            T = cross(W, arm)
        J[k, 0], J[k, 1], J[k, 2] = T.x, T.y, T.z
        J[k, 3], J[k, 4], J[k, 5] = W.x, W.y, W.z


@tower_top.variant
@kernel
def floating_top(m: FloaterSystem) -> None:
    """Motion of the tower top: modes of the tower, turned with its base (W-30)."""
    q, v, top, machine, C, first = m.q, m.v, m.top_shape, m.machine, m.columns, m.top_shape.modes - 6
    turned, turning = Vec(q[first + 3], q[first + 4], q[first + 5]), Vec(v[first + 3], v[first + 4], v[first + 5])
    R, w, known = rotation(turned), angular_velocity(turned, turning), angular_acceleration(turned, turning)
    nothing = Vec(0.0, 0.0, 0.0)
    u, du, bias, theta, rate = nothing, nothing, nothing, nothing, nothing
    for k in range(first):
        z, zd = nothing, nothing
        for j in range(first):
            Z = Vec(m.top_second[0, k, j], m.top_second[1, k, j], m.top_second[2, k, j])
            z += q[j] * Z
            zd += v[j] * Z
        phi, psi = top.displacement[k], top.rotation[k]
        C.linear[k] = R @ (phi + z)
        u += q[k] * (phi + 0.5 * z)
        du += v[k] * (phi + z)
        bias += v[k] * zd
        theta += q[k] * psi
        rate += v[k] * psi
    for k in range(first):
        C.angular[k] = R @ angular_velocity(theta, top.rotation[k])
    r, du = R @ (u + Vec(0.0, 0.0, m.structure.tower_length)), R @ du
    for k in range(6):
        e = Vec(1.0 * (k % 3 == 0), 1.0 * (k % 3 == 1), 1.0 * (k % 3 == 2))
        W = nothing if k < 3 else angular_velocity(turned, e)
        C.linear[first + k] = e if k < 3 else cross(W, r)
        C.angular[first + k] = W
    own = R @ angular_velocity(theta, rate)
    machine.top_position = Vec(q[first], q[first + 1], q[first + 2] + m.structure.tower_base) + r
    machine.top_velocity = Vec(v[first], v[first + 1], v[first + 2]) + cross(w, r) + du
    machine.top_acceleration = cross(known, r) + cross(w, cross(w, r) + 2.0 * du) + R @ bias
    machine.top_spin = w + own
    machine.top_spin_rate = known + cross(w, own) + R @ angular_acceleration(theta, rate)
    machine.top = R @ rotation(theta)


@kernel
def momentum(m: FloaterSystem, k: int) -> tuple[Vec, Vec]:
    """Linear and angular momentum [kg, kg m, kg m^2] of the tower about its base by unit rate of a coordinate, axes of
    the base."""
    M, b = m.tower_matrix, m.top_shape.modes - 6
    linear = Vec(M[MASS, b, k], M[MASS, b + 1, k], M[MASS, b + 2, k])
    return linear, Vec(M[MASS, b + 3, k], M[MASS, b + 4, k], M[MASS, b + 5, k])


@kernel
def momentum_of(m: FloaterSystem, v: Vec, w: Vec) -> tuple[Vec, Vec]:
    """The same for a base that moves with ``v`` and ``w``."""
    b = m.top_shape.modes - 6
    mass, arm = m.tower_matrix[MASS, b, b], Vec(0.0, 0.0, m.tower_matrix[MASS, b, b + 4])
    (px, hx), (py, hy), (pz, hz) = momentum(m, b + 3), momentum(m, b + 4), momentum(m, b + 5)
    return mass * v + w.x * px + w.y * py + w.z * pz, cross(arm, v) + w.x * hx + w.y * hy + w.z * hz


@kernel
def base_column(m: FloaterSystem, R: Rot, k: int) -> tuple[Vec, Vec]:
    """Velocity and angular velocity of the base by unit rate of its motion ``k``, in its own axes."""
    J = m.base_columns
    e = Vec(1.0 * (k == 0), 1.0 * (k == 1), 1.0 * (k == 2))
    return R.T @ e, R.T @ Vec(J[k, 3], J[k, 4], J[k, 5])


@kernel
def tower_body(m: FloaterSystem) -> None:
    """Inertia and weight of the tower turn with its base, in place of what is linear in the angles (W-31, W-32)."""
    p, q, matrix, first = m.platform, m.q, m.tower_matrix, m.top_shape.modes - 6
    R, gravity = rotation(Vec(q[first + 3], q[first + 4], q[first + 5])), m.structure.gravity
    for i in range(first + 6):
        if i >= first:
            m.core_force[i] -= gravity * m.tower_weight[i]
        for j in range(first + 6):
            if max(i, j) >= first:
                m.core_force[i] += gravity * matrix[WEIGHT, i, j] * q[j]
                if j <= i:
                    m.core_mass[i, j] -= matrix[MASS, i, j]
    g, w, known = R.T @ Vec(0.0, 0.0, -gravity), R.T @ p.spin, R.T @ p.spin_bias
    mass, s, flow = matrix[MASS, first, first], Vec(0.0, 0.0, matrix[MASS, first, first + 4]), 0.0 * g
    for k in range(first):
        P, H = momentum(m, k)
        m.core_force[k] += dot(P, g) - dot(H, known) - w.z * (w.x * H.y - w.y * H.x)
        s += q[k] * P
        flow += m.v[k] * P
    F = mass * g - cross(known, s) - cross(w, cross(w, s) + 2.0 * flow)
    M = cross(s, g) - momentum_of(m, 0.0 * g, known)[1] - cross(w, momentum_of(m, 0.0 * g, w)[1])
    for k in range(6):
        T, W = base_column(m, R, k)
        P, H = momentum_of(m, T, W)
        m.core_force[first + k] += dot(T, F) + dot(W, M)
        for j in range(first):
            Pj, Hj = momentum(m, j)
            m.core_mass[first + k, j] += dot(T, Pj) + dot(W, Hj)
        for j in range(k + 1):
            Tj, Wj = base_column(m, R, j)
            m.core_mass[first + k, first + j] += dot(Tj, P) + dot(Wj, H)


@kernel
def strip_drag(now: Instant, R: Rot, m: FloaterSystem) -> tuple[Vec, Vec]:
    """Force and moment of drag, in velocities relative to that of the water at the places at rest (W-20)."""
    p, s, f, i = m.platform, m.strip, m.float_flow, now.row
    F, M = Vec(0.0, 0.0, 0.0), Vec(0.0, 0.0, 0.0)
    for n in range(s.strips):  # type: ignore[attr-defined]
        r, e, k = R @ s.place[n], R @ s.axis[n], 3 * n
        v = -1.0 * (p.velocity + cross(p.spin, r))
        v += now.a * Vec(f[i, k], f[i, k + 1], f[i, k + 2])
        v += now.b * Vec(f[i + 1, k], f[i + 1, k + 1], f[i + 1, k + 2])
        v += now.c * Vec(f[i + 2, k], f[i + 2, k + 1], f[i + 2, k + 2])
        v += now.d * Vec(f[i + 3, k], f[i + 3, k + 1], f[i + 3, k + 2])
        along = dot(v, e)
        across = v - along * e
        G = s.drag[n] * sqrt(dot(across, across)) * across + s.plate[n] * abs(along) * along * e
        F += G
        M += cross(r, G)
    return F, M


@kernel
def water_load(t: float, m: FloaterSystem) -> None:
    """Loads of the water but for added mass, in the second row of ``base_six``; further ones in the third (W-8 to
    W-10)."""
    p, f, x, K = m.platform, m.floater, m.base_six, m.float_matrices
    now = cubic(t, f.step, f.period)
    a, i = m.float_waves, now.row
    u, angle, dq, w = p.displacement, p.angle, p.velocity, p.spin
    x[3, 0], x[3, 1], x[3, 2], x[3, 3], x[3, 4], x[3, 5] = u.x, u.y, u.z, angle.x, angle.y, angle.z
    theta = Vec(m.q[m.top_shape.modes - 3], m.q[m.top_shape.modes - 2], m.q[m.top_shape.modes - 1])
    R = rotation(theta)
    own, turning = R.T @ dq, R.T @ w
    x[0, 0], x[0, 1], x[0, 2], x[0, 3], x[0, 4], x[0, 5] = own.x, own.y, own.z, turning.x, turning.y, turning.z
    p.elevation = now.a * a[i, 0] + now.b * a[i + 1, 0] + now.c * a[i + 2, 0] + now.d * a[i + 3, 0]
    for k in range(6):
        c = k + 1
        water = now.a * a[i, c] + now.b * a[i + 1, c] + now.c * a[i + 2, c] + now.d * a[i + 3, c]
        water -= p.bias.x * K[k, 0] + p.bias.y * K[k, 1] + p.bias.z * K[k, 2]
        water -= p.spin_bias.x * K[k, 3] + p.spin_bias.y * K[k, 4] + p.spin_bias.z * K[k, 5]
        other = 0.0 * water
        for j in range(6):
            other -= K[FURTHER + k, j] * x[3, j]
        for n in range(m.radiation.modes):
            water -= m.float_output[n, k] * m.radiation.real[n] - m.float_output[n, 6 + k] * m.radiation.imaginary[n]
        x[1, k], x[2, k] = water, other
    # lift and moments of the water turn with the heading
    lift = f.displaced * Vec(1.0, f.buoyancy_y, -f.buoyancy_x)
    for j in range(2, 5):
        lift -= x[3, j] * Vec(K[WATER + 2, j], K[WATER + 3, j], K[WATER + 4, j])
    g, cz, sz = m.structure.gravity, cos(angle.z), sin(angle.z)
    x[1, 2] += g * lift.x
    x[1, 3] += g * (cz * lift.y - sz * lift.z)
    x[1, 4] += g * (sz * lift.y + cz * lift.z)
    against = own - R.T @ f.current
    x[3, 0], x[3, 1], x[3, 2] = against.x, against.y, against.z
    x[3, 3], x[3, 4], x[3, 5] = turning.x, turning.y, turning.z
    drag, drag_moment = Vec(0.0 * t, 0.0 * t, 0.0 * t), Vec(0.0 * t, 0.0 * t, 0.0 * t)
    for j in range(6):
        s, s2 = x[0, j], x[3, j] * abs(x[3, j])
        drag -= s * Vec(K[LINEAR, j], K[LINEAR + 1, j], K[LINEAR + 2, j])
        drag -= s2 * Vec(K[QUADRATIC, j], K[QUADRATIC + 1, j], K[QUADRATIC + 2, j])
        drag_moment -= s * Vec(K[LINEAR + 3, j], K[LINEAR + 4, j], K[LINEAR + 5, j])
        drag_moment -= s2 * Vec(K[QUADRATIC + 3, j], K[QUADRATIC + 4, j], K[QUADRATIC + 5, j])
    strips, strip_moment = strip_drag(now, R, m)
    drag, drag_moment = R @ drag + strips, R @ drag_moment + strip_moment
    x[1, 0] += drag.x
    x[1, 1] += drag.y
    x[1, 2] += drag.z
    x[1, 3] += drag_moment.x
    x[1, 4] += drag_moment.y
    x[1, 5] += drag_moment.z


@kernel
def add_mass(M: Sym, r: Vec, m: FloaterSystem) -> None:
    """Add a mass [kg], by direction, that moves with the platform at ``r`` [m] to the mass matrix."""
    J, first = m.base_columns, m.top_shape.modes - 6
    for k in range(6):
        own = M @ (Vec(J[k, 0], J[k, 1], J[k, 2]) + cross(Vec(J[k, 3], J[k, 4], J[k, 5]), r))
        for j in range(k + 1):
            other = Vec(J[j, 0], J[j, 1], J[j, 2]) + cross(Vec(J[j, 3], J[j, 4], J[j, 5]), r)
            m.core_mass[first + k, first + j] += dot(own, other)


@kernel
def joint_motion(n: int, v: Vec, w: Vec, m: FloaterSystem) -> Vec:
    """Velocity of a junction while the platform moves with ``v`` and ``w`` (W-33)."""
    ends, F = m.line_end, Vec(0.0, 0.0, 0.0)
    for i in range(m.line_order.lines):  # type: ignore[attr-defined]
        if m.line_order.foot[i] == n and holds(i, n, m):
            F += ends.stiffness[i] @ (v + cross(w, ends.upper[i] - m.platform.displacement))
    return m.point_state.flexibility[n] @ F


@kernel
def move_junction(n: int, m: FloaterSystem) -> None:
    """Drag and inertia of a junction, of the strings below it, and of half of those above (W-33)."""
    p, s, order, J, first = m.platform, m.point_state, m.line_order, m.base_columns, m.top_shape.modes - 6
    v = joint_motion(n, p.velocity, p.spin, m)
    M, drag = dyad(m.point.inertia[n], 0.0, v), m.point.drag[n]
    F = Vec(0.0, 0.0, 0.0)
    for i in range(order.lines):  # type: ignore[attr-defined]
        if holds(i, n, m):
            if order.foot[i] == n:
                mass, more = half_of(i, m)
                M, drag = M + dyad(mass, 0.0, v), drag + more
            else:
                d = s.place[n] - m.line.anchor[i]
                e, across = string_forces(i, d, m)
                force, below = moved_string(i, e, d, across, v, m)
                F, M = F + force, M + below
    s.load[n] = F - (drag * sqrt(dot(v, v))) * v
    for k in range(6):
        own = M @ joint_motion(n, Vec(J[k, 0], J[k, 1], J[k, 2]), Vec(J[k, 3], J[k, 4], J[k, 5]), m)
        for j in range(k + 1):
            other = joint_motion(n, Vec(J[j, 0], J[j, 1], J[j, 2]), Vec(J[j, 3], J[j, 4], J[j, 5]), m)
            m.core_mass[first + k, first + j] += dot(own, other)


@by_record
def line_pull(i: int, r: Vec, m: FloaterSystem) -> Vec:
    """Force [N] of a string of lines on its fairlead, ``r`` [m] from the platform's point."""
    raise NotImplementedError


@kernel
def static_pull(i: int, r: Vec, m: FloaterSystem) -> Vec:
    """Of a string in its static shape, with drag and inertia of its motion (W-12 to W-15)."""
    ends, load, n = m.line_end, m.line_load, m.line_order.foot[i]
    v = ends.velocity[i]
    if n < 0:
        d = ends.upper[i] - m.line.anchor[i]
        e, across = string_forces(i, d, m)
        pull, M = moved_string(i, e, d, across, v, m)
    else:
        d = ends.upper[i] - m.point_state.place[n]
        e, across = string_forces(i, d, m)
        mass, drag = half_of(i, m)
        M = dyad(mass, 0.0, v)
        pull = ends.stiffness[i] @ (m.point_state.flexibility[n] @ m.point_state.load[n])
        pull -= (drag * sqrt(dot(v, v))) * v
    H = load.horizontal[i]
    pull += Vec(-H * d.x / across, -H * d.y / across, -load.vertical[i])
    add_mass(M, r, m)
    load.fairlead[i] = sqrt(dot(pull, pull))
    return pull


line_pull.variant(static_pull)


@by_record
def settle_points(m: FloaterSystem) -> None:
    """Bring free points into equilibrium, where they do not move by themselves."""
    raise NotImplementedError


@kernel
def settle_junctions(m: FloaterSystem) -> None:
    """Of lines in their static shapes."""
    for n in range(m.point.points):  # type: ignore[attr-defined]
        if m.point.junction[n] > 0.0 and is_held(n, m):
            settle(n, m)
            move_junction(n, m)


settle_points.variant(settle_junctions)


@kernel
def mooring(m: FloaterSystem) -> None:
    """Forces of the lines on the platform, which are added to the third row of ``base_six``."""
    p, order, ends, x = m.platform, m.line_order, m.line_end, m.base_six
    first = m.top_shape.modes - 3
    R = rotation(Vec(m.q[first], m.q[first + 1], m.q[first + 2]))
    for i in range(order.lines):  # type: ignore[attr-defined]
        if order.head[i] == NONE:
            r = R @ m.line.fairlead[i]
            ends.upper[i] = p.displacement + r
            ends.velocity[i] = p.velocity + cross(p.spin, r)
    settle_points(m)
    F, M = Vec(0.0, 0.0, 0.0), Vec(0.0, 0.0, 0.0)
    for i in range(order.lines):  # type: ignore[attr-defined]
        if order.head[i] == INNER:
            continue
        if not pulls(i, m):
            silence(i, m)
        elif order.head[i] == NONE:
            r = ends.upper[i] - p.displacement
            pull = line_pull(i, r, m)
            F += pull
            M += cross(r, pull)
    p.mooring_force = F
    p.mooring_moment = M
    x[2, 0] += F.x
    x[2, 1] += F.y
    x[2, 2] += F.z
    x[2, 3] += M.x
    x[2, 4] += M.y
    x[2, 5] += M.z


@outer_forces.variant
@kernel
def floater_forces(t: float, m: FloaterSystem) -> None:
    """Forces on the motions of the base, with inertia of the platform and added mass of the water (W-7)."""
    p, f, J, K, x = m.platform, m.floater, m.base_columns, m.float_matrices, m.base_six
    base_motion(m)
    tower_body(m)
    water_load(t, m)
    mooring(m)
    first = m.top_shape.modes - 6
    R = rotation(Vec(m.q[first + 3], m.q[first + 4], m.q[first + 5]))
    c = R @ f.centre
    own = turn(R, Sym(f.inertia.x, f.inertia.y, f.inertia.z, 0.0, 0.0, 0.0))
    w, known = p.spin, p.spin_bias
    G = f.mass * (Vec(0.0, 0.0, -m.structure.gravity) - (p.bias + cross(known, c) + cross(w, cross(w, c))))
    N = cross(c, G) - (own @ known + cross(w, own @ w))
    s, inertia = f.mass * c, inertia_about(own, f.mass, Vec(0.0, 0.0, 0.0), c)
    F, M = G + Vec(x[1, 0] + x[2, 0], x[1, 1] + x[2, 1], x[1, 2] + x[2, 2]), N
    M += Vec(x[1, 3] + x[2, 3], x[1, 4] + x[2, 4], x[1, 5] + x[2, 5])
    for k in range(6):
        T, W = Vec(J[k, 0], J[k, 1], J[k, 2]), Vec(J[k, 3], J[k, 4], J[k, 5])
        m.core_force[first + k] += dot(T, F) + dot(W, M)
        P, H = f.mass * T + cross(W, s), inertia @ W + cross(s, T)
        for j in range(k + 1):
            added = dot(Vec(J[j, 0], J[j, 1], J[j, 2]), P) + dot(Vec(J[j, 3], J[j, 4], J[j, 5]), H)
            for a in range(6):
                if J[j, a] != 0.0:
                    for b in range(6):
                        added += J[j, a] * K[ADDED + a, b] * J[k, b]
            m.core_mass[first + k, first + j] += added


@kernel
def driven(n: int, dt: float, m: FloaterSystem) -> tuple[float, float]:
    """Rate of an oscillation of the radiation from the mean velocity over a step that ends now (W-4)."""
    first, J = m.top_shape.modes - 6, m.base_columns
    re, im = 0.0 * m.v[first], 0.0 * m.v[first]
    for k in range(6):
        rate = m.v[first + k] - 0.5 * dt * m.a[first + k]
        for j in range(6):
            re += m.float_input[n, j] * J[k, j] * rate
            im += m.float_input[n, 6 + j] * J[k, j] * rate
    return re, im


@begin_parts_step.variant
@kernel
def floater_begin(dt: float, m: FloaterSystem) -> None:
    """Exact for the mean velocity over the step (W-4)."""
    x = m.radiation
    for n in range(x.modes):
        s, z = m.float_pole[n, 0], m.float_pole[n, 1]
        size = exp(s * dt)
        c, d = size * cos(z * dt), size * sin(z * dt)
        re, im = driven(n, dt, m)
        # (exp(p dt) - 1) / p
        g, h, square = c - 1.0, d, s * s + z * z
        gr, gi = (g * s + h * z) / square, (h * s - g * z) / square
        a, b = x.real[n], x.imaginary[n]
        x.real[n] = c * a - d * b + gr * re - gi * im
        x.imaginary[n] = c * b + d * a + gr * im + gi * re


@part_rates.variant
@kernel
def floater_rates(m: FloaterSystem) -> None:
    """Rates of the radiation (W-4)."""
    x, rate = m.radiation, m.d_radiation
    for n in range(x.modes):
        s, z = m.float_pole[n, 0], m.float_pole[n, 1]
        re, im = driven(n, 0.0, m)
        rate.real[n] = s * x.real[n] - z * x.imaginary[n] + re
        rate.imaginary[n] = s * x.imaginary[n] + z * x.real[n] + im


@outer_section_loads.variant
@kernel
def floater_loads(m: FloaterSystem, s: Outputs) -> None:
    """Loads of the water with added mass; deflection of the tower and loads at its base in the axes of that base."""
    p, J, K, x, first = m.platform, m.base_columns, m.float_matrices, m.base_six, m.top_shape.modes - 6
    for i in range(6):
        total = x[1, i]
        for j in range(6):
            for k in range(6):
                total -= K[ADDED + i, j] * J[k, j] * m.a[first + k]
        x[0, i] = total
    p.force = Vec(x[0, 0], x[0, 1], x[0, 2])
    p.moment = Vec(x[0, 3], x[0, 4], x[0, 5])
    R = rotation(Vec(m.q[first + 3], m.q[first + 4], m.q[first + 5]))
    base = Vec(m.q[first], m.q[first + 1], m.q[first + 2] + m.structure.tower_base)
    p.offset = sqrt(p.displacement.x * p.displacement.x + p.displacement.y * p.displacement.y)
    p.tilt = atan2(sqrt(R.xz * R.xz + R.yz * R.yz), R.zz)
    place = R.T @ (m.machine.top_position - base)
    s.chain.top_deflection = place - Vec(0.0, 0.0, m.structure.tower_length)
    turned_tower_loads(R, place, m, s)


@kernel
def turned_tower_loads(R: Rot, place: Vec, m: FloaterSystem, s: Outputs) -> None:
    """Loads of the tower in the axes of its base, on which it stands as on one at rest that accelerates (W-33).

    Args:
      R: orientation of the base; place: [m] of the tower top from the base, in its axes.
    """
    q, a, x, first, nodes, drag = m.q, m.a, m.base_six, m.top_shape.modes - 6, s.tower_nodes, s.tower_drag
    force, moment, top, up = s.apex.force, s.apex.moment, m.machine.top_position, Vec(0.0, 0.0, 1.0)
    g, rate, spin = m.structure.gravity * up, m.platform.spin_bias, R.T @ m.platform.spin
    for k in range(6):
        x[0, k], x[3, k] = q[first + k], a[first + k]
        rate += x[3, k] * Vec(m.base_columns[k, 3], m.base_columns[k, 4], m.base_columns[k, 5])
        q[first + k] = 0.0 * x[0, k]
    rising, rate = R.T @ (Vec(x[3, 0], x[3, 1], x[3, 2]) + g) - g, R.T @ rate
    a[first], a[first + 1], a[first + 2] = rising.x, rising.y, rising.z
    a[first + 3], a[first + 4], a[first + 5] = rate.x, rate.y, rate.z
    for n in range(nodes.nodes):
        own = drag.force[n]
        m.tower_air[0, n], m.tower_air[1, n], m.tower_air[2, n] = own.x, own.y, own.z
        flow = cross(spin, nodes.height[n] * up)
        for k in range(first):
            flow += (2.0 * m.v[k]) * m.tower_shape.displacement[k, n]
        drag.force[n] = R.T @ own - nodes.mass[n] * cross(spin, flow)
    turning = cross(spin, cross(spin, m.structure.tower_length * up))
    s.apex.force, s.apex.moment = R.T @ force - m.structure.top_mass * turning, R.T @ moment
    m.machine.top_position = place + m.structure.tower_base * up
    tower_loads(m, s)
    s.apex.force, s.apex.moment, m.machine.top_position = force, moment, top
    for n in range(nodes.nodes):
        drag.force[n] = Vec(m.tower_air[0, n], m.tower_air[1, n], m.tower_air[2, n])
    for k in range(6):
        q[first + k], a[first + k] = x[0, k], x[3, k]


@dataclass(frozen=True)
class FloaterPart(Part):
    """The platform of a model, in still water."""

    system: ClassVar[type[Record] | None] = FloaterSystem
    signals: ClassVar[dict[str, type[Table]]] = {
        "platform": PlatformState,
        "radiation": RadiationState,
        "line_load": LineLoad,
        "point_state": PointState,
    }
    parameter_tables: ClassVar[ParameterTables] = ((Floater, "floater", Floater.names),)
    shown: ClassVar[tuple[str, ...]] = (
        "wave_elevation",
        "platform_surge",
        "platform_sway",
        "platform_heave",
        "platform_roll",
        "platform_pitch",
        "platform_yaw",
    )
    floater: Float
    moorings: dict[str, Any]
    strip: Float
    float_matrices: Float
    float_pole: Float
    float_input: Float
    float_output: Float
    wind_nodes: int
    coefficients: Coefficients
    platform: Platform

    def sizes(self) -> dict[str, int]:
        """Lengths of the axes of the signals."""
        lines, points = self.moorings["line"].shape[1], self.moorings["point"].shape[1]
        return {"mode": len(self.float_pole), "line": lines, "point": points}

    def shapes(self) -> dict[str, tuple[int, ...]]:
        """Shapes of the signals."""
        sizes = self.sizes()
        return {name: table.shape(**{a: sizes[a] for a in table.axes}) for name, table in self.signals.items()}

    def arrays(self) -> dict[str, Any]:
        """Constants of the platform, and still water."""
        own = ("floater", "strip", "float_matrices", "float_pole", "float_input", "float_output")
        return {
            **{name: getattr(self, name).copy() for name in own},
            "tower_air": np.zeros((3, self.wind_nodes)),
            **{name: array.copy() for name, array in self.moorings.items()},
            "d_radiation": RadiationState.zeros(mode=len(self.float_pole)),
            "float_waves": np.zeros((AHEAD + BEHIND + 2, 7)),
            "float_flow": np.zeros((AHEAD + BEHIND + 2, 3 * self.strip.shape[1])),
            "base_columns": np.zeros((6, 6)),
            "base_six": np.zeros((4, 6)),
        }

    def channels(self) -> Sequence[Channel]:
        """Motion of the platform, loads of the water and of the lines."""
        lines = channels_of_group("line", self.sizes()["line"])
        return (*channels_of_group("platform"), *(replace(c, index=(c.index[0] - 1,)) for c in lines))

    def states(self) -> Sequence[StateRows]:
        """The memory of radiated waves."""
        n = len(self.float_pole)
        names = tuple(f"radiation {part} {i + 1}" for part in ("real", "imaginary") for i in range(n))
        return (StateRows("radiation", "d_radiation", names, ("m",) * (2 * n)),)

    def in_sea(self, sea: Any, duration: float, origin: tuple[float, float], gravity: float) -> FloatingSea:
        """The waves of a run.

        Raises:
          InputError: the waves, or a part of them, are not in the coefficients.
        """
        n, platform = self.strip.shape[1], self.platform.replace(depth=self.platform.depth + sea.level)
        check_reach(self.platform, f"sea.level: with {sea.level:g} m", sea.level)
        if sea.current is not None and not n and platform.quadratic_damping is None:
            raise InputError("sea: current acts on platform.quadratic_damping and on members with drag; give either")
        dt, period, waves = wave_forces(sea, self.coefficients, platform, duration, origin, gravity)
        floater = self.floater.copy()
        v = View(Floater, floater)
        v["step"], v["period"], v["bed"] = dt, period, -platform.depth
        line = self.moorings["line"].copy()
        View(Line, line)["anchor"][2] -= sea.level
        if sea.current is not None:
            v["current"][:2] = sea.current.at(platform.centre[2:], platform.depth)[0]
        place = View(Strip, self.strip)["place"].T
        flow = np.zeros((len(waves), 0))
        if n:
            flow = flow_at(place, sea, platform.depth, duration, origin, gravity, platform.sum_forces)
        return FloatingSea(floater, line, waves, flow)

    def in_steady_sea(self, sea: Any, still: Any, gravity: float) -> FloatingSea:
        """Level and current of a sea, as ``still`` has them, and the mean drift of its waves.

        Raises:
          InputError: as of :meth:`in_sea`.
        """
        found = self.in_sea(still, 1.0, (0.0, 0.0), gravity)
        found.float_waves[:, 1:] += mean_drift(sea, self.coefficients, self.platform, gravity)
        return found


@dataclass(frozen=True)
class FloatingSea(Part):
    """The sea of a run, in place of still water."""

    floater: Float
    line: Float
    float_waves: Float
    float_flow: Float

    def arrays(self) -> dict[str, Any]:
        """Those that replace the ones of still water."""
        own = {"floater": self.floater.copy(), "line": self.line.copy()}
        return {**own, "float_waves": self.float_waves, "float_flow": self.float_flow}


def part_of(turbine: Any, options: Any, rotor: Any) -> FloaterPart:
    """The platform of a turbine; as ``simulation.parts.parts_of``.

    Raises:
      InputError: no coefficients, no fit of the radiation, or the platform does not float.
    """
    platform: Platform = turbine.platform
    potential = read_coefficients(platform.coefficients) if platform.coefficients else None
    c = with_members(potential, platform.members, platform.depth, GRAVITY)
    check_balance(turbine, c)
    radiation = fit_radiation(c) if potential is not None else Radiation.none()
    rho = platform.water_density
    matrices = np.zeros((5, 6, 6))
    matrices[0], matrices[1] = rho * c.infinite, rho * c.hydrostatic
    for i, name in enumerate(("stiffness", "linear_damping", "quadratic_damping")):
        value = getattr(platform, name)
        matrices[2 + i] = 0.0 if value is None else value
    floater = Floater.zeros()
    v = View(Floater, floater)
    v["mass"], v["centre"], v["inertia"] = platform.mass, platform.centre, platform.inertia
    v["displaced"] = rho * platform.volume
    v["buoyancy_x"], v["buoyancy_y"] = platform.buoyancy_centre
    v["step"], v["period"], v["bed"] = 1.0, 1.0, -platform.depth
    some = pieces(platform.members)
    has = (some.drag > 0.0) | (some.plate > 0.0)
    strip = Strip.zeros(strip=int(has.sum()))
    v = View(Strip, strip)
    for name, value in (("place", some.place.T), ("axis", some.axis.T), ("drag", rho * some.drag)):
        v[name] = value[..., has]
    v["plate"] = rho * some.plate[has]
    parts = [
        np.concatenate([getattr(radiation, n).real, getattr(radiation, n).imag], axis=1) for n in ("input", "output")
    ]
    return FloaterPart(
        wind_nodes=rotor.tower_flow.shape[1],
        floater=floater,
        moorings=mooring_tables(platform.lines, platform.points, platform.depth, rho),
        strip=strip,
        float_matrices=np.ascontiguousarray(matrices.reshape(30, 6)),
        float_pole=np.stack([radiation.pole.real, radiation.pole.imag], axis=1),
        float_input=np.ascontiguousarray(parts[0]),
        float_output=np.ascontiguousarray(rho * parts[1]),
        coefficients=c,
        platform=platform,
    )
