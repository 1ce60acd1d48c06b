"""A tower on a moving base: records of a floating turbine, and motion, inertia and section loads of its tower.

The six motions of the tower base are the last coordinates of the tower.

Reference: docs/theory/floating.md (W-7, W-30 to W-33).
"""

from __future__ import annotations

from math import atan2, sqrt

from meltemi.compiler import Array2, Array3, Constant, Numbers, Rot, Single, Table, Vec, Vectors, kernel, number, xyz
from meltemi.floating.mooring import Moorings
from meltemi.maths.rotations import angular_acceleration, angular_velocity, rotation
from meltemi.maths.vectors import cross, dot
from meltemi.simulation.system import Outputs, System
from meltemi.structure.dynamics import DAMPING, MASS, STIFFNESS, WEIGHT, tower_equations
from meltemi.structure.kinematics import tower_top
from meltemi.structure.section_loads import tower_loads


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
      float_lines, float_forces: (M, 3), (H, M, 12) waves that push the platform where it is: frequency, wave numbers,
        and forces at its headings, real parts first.
      float_pole, float_input, float_output: (P, 2), (P, 12), (P, 12) oscillations of the radiation, real parts first.
      float_flow: (T, 3 P) velocity of the water at the strips.
      tower_air: (3, N) forces of the wind on the nodes of the tower, while loads are in the axes of the base.
      base_columns: (6, 6) velocities of the platform's point, linear and angular, by unit rates of the coordinates.
      base_six: (9, 6) forces and moments, or other pairs of vectors, in the rows ``OWN_VELOCITY`` to ``ACCELERATION``.
    """

    floater: Floater
    platform: PlatformState
    radiation: Single[RadiationState]
    d_radiation: Single[RadiationState]
    strip: Single[Strip]
    float_flow: Constant[Array2]
    float_matrices: Constant[Array2]
    float_waves: Constant[Array2]
    float_lines: Constant[Array2]
    float_forces: Constant[Array3]
    float_pole: Constant[Array2]
    float_input: Constant[Array2]
    float_output: Constant[Array2]
    tower_air: Array2
    base_columns: Array2
    base_six: Array2


OWN_VELOCITY, WATER_LOAD, FURTHER_LOAD, PLACE, AGAINST_CURRENT, OWN_DRAG, WHOLE_LOAD, MOTION, ACCELERATION = range(9)
"""Rows of ``base_six``: velocity in the platform's axes; load of the water without added mass; further load; position;
velocity against the current, and drag, in the platform's axes; load of the water with added mass; coordinates of the
base and their second derivatives."""


@kernel
def base_row(m: FloaterSystem) -> int:
    """Index of the base's first motion in the coordinates: three displacements, then three rotations."""
    return m.top_shape.modes - 6


@kernel
def base_rotation(m: FloaterSystem) -> Rot:
    """Orientation of the base."""
    k = base_row(m) + 3
    return rotation(Vec(m.q[k], m.q[k + 1], m.q[k + 2]))


@kernel
def six(i: int, m: FloaterSystem) -> tuple[Vec, Vec]:
    """Force and moment, or what else is in a row of ``base_six``."""
    x = m.base_six
    return Vec(x[i, 0], x[i, 1], x[i, 2]), Vec(x[i, 3], x[i, 4], x[i, 5])


@kernel
def keep_six(i: int, u: Vec, w: Vec, m: FloaterSystem) -> None:
    """Put two vectors into a row of ``base_six``."""
    x = m.base_six
    x[i, 0], x[i, 1], x[i, 2], x[i, 3], x[i, 4], x[i, 5] = u.x, u.y, u.z, w.x, w.y, w.z


@kernel
def column(k: int, m: FloaterSystem) -> tuple[Vec, Vec]:
    """Velocity of the platform's point, and angular velocity, by unit rate of the base's motion ``k``."""
    J = m.base_columns
    return Vec(J[k, 0], J[k, 1], J[k, 2]), Vec(J[k, 3], J[k, 4], J[k, 5])


@kernel
def base_motion(m: FloaterSystem) -> None:
    """Position and velocity of the platform's point, and its partial velocities (W-7)."""
    p, first, q, v = m.platform, base_row(m), m.q, m.v
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
    q, v, top, machine, C, first = m.q, m.v, m.top_shape, m.machine, m.columns, base_row(m)
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
    M, b = m.tower_matrix, base_row(m)
    linear = Vec(M[MASS, b, k], M[MASS, b + 1, k], M[MASS, b + 2, k])
    return linear, Vec(M[MASS, b + 3, k], M[MASS, b + 4, k], M[MASS, b + 5, k])


@kernel
def momentum_of(m: FloaterSystem, v: Vec, w: Vec) -> tuple[Vec, Vec]:
    """The same for a base that moves with ``v`` and ``w``."""
    b = base_row(m)
    mass, arm = m.tower_matrix[MASS, b, b], Vec(0.0, 0.0, m.tower_matrix[MASS, b, b + 4])
    (px, hx), (py, hy), (pz, hz) = momentum(m, b + 3), momentum(m, b + 4), momentum(m, b + 5)
    return mass * v + w.x * px + w.y * py + w.z * pz, cross(arm, v) + w.x * hx + w.y * hy + w.z * hz


@kernel
def base_column(m: FloaterSystem, R: Rot, k: int) -> tuple[Vec, Vec]:
    """Velocity and angular velocity of the base by unit rate of its motion ``k``, in its own axes."""
    e = Vec(1.0 * (k == 0), 1.0 * (k == 1), 1.0 * (k == 2))
    return R.T @ e, R.T @ column(k, m)[1]


@tower_equations.variant
@kernel
def floating_tower(m: FloaterSystem) -> None:
    """Those of a tower whose inertia and weight turn with its base (W-31, W-32)."""
    base_motion(m)
    p, q, matrix, first = m.platform, m.q, m.tower_matrix, base_row(m)
    R, gravity = base_rotation(m), m.structure.gravity
    for i in range(first + 6):
        f = m.tower_push[i]
        for j in range(first + 6):
            f -= matrix[STIFFNESS, i, j] * q[j] + matrix[DAMPING, i, j] * m.v[j]
        for j in range(first if i < first else 0):
            f -= gravity * matrix[WEIGHT, i, j] * q[j]
        m.core_force[i] = f + gravity * m.tower_weight[i] if i < first else f
        for j in range(i + 1):
            m.core_mass[i, j] = matrix[MASS, i, j] if i < first else 0.0
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
def turned_tower_loads(R: Rot, place: Vec, m: FloaterSystem, s: Outputs) -> None:
    """Loads of the tower in the axes of its base, on which it stands as on one at rest that accelerates (W-33).

    Args:
      R: orientation of the base; place: [m] of the tower top from the base, in its axes.
    """
    q, a, x, first, nodes, drag = m.q, m.a, m.base_six, base_row(m), s.tower_nodes, s.tower_drag
    force, moment, top, up = s.apex.force, s.apex.moment, m.machine.top_position, Vec(0.0, 0.0, 1.0)
    g, rate, spin = m.structure.gravity * up, m.platform.spin_bias, R.T @ m.platform.spin
    for k in range(6):
        x[MOTION, k], x[ACCELERATION, k] = q[first + k], a[first + k]
        rate += x[ACCELERATION, k] * column(k, m)[1]
        q[first + k] = 0.0 * x[MOTION, k]
    rising, rate = R.T @ (six(ACCELERATION, m)[0] + g) - g, R.T @ rate
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
        q[first + k], a[first + k] = x[MOTION, k], x[ACCELERATION, k]
