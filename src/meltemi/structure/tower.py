"""The tower on what it stands on: motion of its top, equations, and section loads.

Reference: docs/theory/structure.md (S-11 to S-14, S-33, S-34, S-45, S-46).
"""

from __future__ import annotations

from meltemi.compiler import by_record, kernel
from meltemi.maths.rotations import angular_acceleration, angular_velocity, rotation
from meltemi.maths.vectors import Vec, cross
from meltemi.structure.equations import add_core, resistance
from meltemi.structure.tables import SectionLoads, Structure

MASS, STIFFNESS, DAMPING, WEIGHT = 0, 1, 2, 3
"""Layers of ``tower_matrix``; WEIGHT is the geometric stiffness at unit gravity."""


@kernel
def bending(m: Structure, modes: int) -> tuple[Vec, Vec, Vec, Vec, Vec]:
    """Motion of the tower top by its first ``modes`` in axes of the base, whose columns are filled (S-11 to S-14).

    Returns:
      Deflection [m], of second order in the coordinates; its rate [m/s]; its second derivative [m/s^2] without those of
      the coordinates; rotation vector [rad] and its rate [rad/s].
    """
    q, v, top = m.q, m.v, m.top_shape
    nothing = Vec(0.0, 0.0, 0.0)
    u, du, bias, theta, rate = nothing, nothing, nothing, nothing, nothing
    for k in range(modes):
        z, zd = nothing, nothing
        for j in range(modes):
            Z = Vec(m.top_second[0, k, j], m.top_second[1, k, j], m.top_second[2, k, j])
            z += q[j] * Z
            zd += v[j] * Z
        phi, psi = top.displacement[k], top.rotation[k]
        T = phi + z
        m.columns.linear[k] = T
        u += q[k] * (phi + 0.5 * z)
        du += v[k] * T
        bias += v[k] * zd
        theta += q[k] * psi
        rate += v[k] * psi
    for k in range(modes):
        m.columns.angular[k] = angular_velocity(theta, top.rotation[k])
    return u, du, bias, theta, rate


@by_record
def tower_top(m: Structure) -> None:
    """Motion of the tower top; its partial velocities fill the first columns."""


@tower_top.variant
@kernel
def top_on_ground(m: Structure) -> None:
    """Motion of the top of a tower on the ground, on a foundation or a pile."""
    machine, (u, du, bias, theta, rate) = m.machine, bending(m, m.top_shape.modes)
    machine.top_position = u + Vec(0.0, 0.0, m.structure.tower_base + m.structure.tower_length)
    machine.top_velocity = du
    machine.top_acceleration = bias
    machine.top_spin = angular_velocity(theta, rate)
    machine.top_spin_rate = angular_acceleration(theta, rate)
    machine.top = rotation(theta)


@by_record
def tower_equations(m: Structure) -> None:
    """Initialise the core equations with those of the tower and of what it stands on."""


@tower_equations.variant
@kernel
def modal_equations(m: Structure) -> None:
    """Equations of the modes (S-33, S-34)."""
    modes, matrix, gravity = m.top_shape.modes, m.tower_matrix, m.structure.gravity
    for i in range(modes):
        f = m.tower_push[i] + gravity * m.tower_weight[i]
        for j in range(modes):
            stiffness = matrix[STIFFNESS, i, j] + gravity * matrix[WEIGHT, i, j]
            f -= stiffness * m.q[j] + matrix[DAMPING, i, j] * m.v[j]
        m.core_force[i] = f
        for j in range(i + 1):
            m.core_mass[i, j] = matrix[MASS, i, j]


@kernel
def tower_implicit(dt: float, m: Structure) -> None:
    """Complete the equations of a step for implicit modes of the tower (M-43)."""
    matrix = m.tower_matrix
    for i in range(m.top_shape.modes):
        for j in range(m.top_shape.modes):
            stiffness = matrix[STIFFNESS, i, j] + m.structure.gravity * matrix[WEIGHT, i, j]
            add_core(resistance(dt, m, i, j, stiffness, matrix[DAMPING, i, j]), m, i, j)


@by_record
def top_place(m: Structure) -> Vec:
    """Position [m] of the tower top, axes of the tower's base, with the base at its height at rest."""
    raise NotImplementedError


@top_place.variant
@kernel
def place_on_ground(m: Structure) -> Vec:
    """Position of a tower top whose base does not move by itself."""
    return m.machine.top_position


@kernel
def top_deflection(m: Structure, s: SectionLoads) -> None:
    """Deflection of the tower top and its rotation by the modes."""
    p, theta = m.structure, Vec(0.0, 0.0, 0.0)
    s.chain.top_deflection = top_place(m) - Vec(0.0, 0.0, p.tower_base + p.tower_length)
    for k in range(m.top_shape.modes):
        theta += m.q[k] * m.top_shape.rotation[k]
    s.chain.top_rotation = theta


@by_record
def tower_loads(m: Structure, s: SectionLoads) -> None:
    """Loads at stations of the tower, from those at the yaw bearing down, in the axes of the tower's base."""


@tower_loads.variant
@kernel
def loads_on_ground(m: Structure, s: SectionLoads) -> None:
    """Loads of a tower whose base does not move by itself (S-45, S-46)."""
    modes, gravity = m.tower_shape.modes, Vec(0.0, 0.0, -m.structure.gravity)
    for n in range(s.tower_nodes.nodes):
        load_piece(n, modes, gravity, Vec(0.0, 0.0, 0.0), s.tower_drag.force[n], m, s)
    F = s.apex.force + m.structure.top_mass * (gravity - top_rise(m, modes))
    stations_below(m.machine.top_position, F, s.apex.moment, modes, m, s)


@kernel
def top_rise(m: Structure, modes: int) -> Vec:
    """Acceleration [m/s^2] of the tower top by its first ``modes``."""
    shape, rise = m.tower_shape, Vec(0.0, 0.0, 0.0)
    for k in range(modes):
        rise += m.a[k] * shape.displacement[k, shape.nodes - 1]
    return rise


@kernel
def load_piece(n: int, modes: int, fall: Vec, turning: Vec, wind: Vec, m: Structure, s: SectionLoads) -> None:
    """Load of a piece of the tower, external minus inertia, axes of its base.

    Args:
      modes: number of modes that bend the tower.
      fall: [m/s^2] gravity minus the acceleration that the base's motion gives the piece.
      turning: [rad/s^2] angular acceleration of the base.
      wind: [N] force of the wind.
    """
    shape, piece, J = m.tower_shape, s.tower_piece, s.tower_nodes.inertia[n]
    u, acceleration = Vec(0.0, 0.0, 0.0), Vec(0.0, 0.0, 0.0)
    for k in range(modes):
        phi = shape.displacement[k, n]
        u += m.q[k] * phi
        acceleration += m.a[k] * phi
        turning += m.a[k] * shape.rotation[k, n]
    piece.offset[n] = u
    piece.force[n] = s.tower_nodes.mass[n] * (fall - acceleration) + wind
    piece.moment[n] = -Vec(J.x * turning.x, J.y * turning.y, J.z * turning.z)


@kernel
def stations_below(top: Vec, F_top: Vec, M_top: Vec, modes: int, m: Structure, s: SectionLoads) -> None:
    """Loads at the stations from those below the yaw bearing and those of the pieces (S-45).

    Args:
      top: [m] position of the tower top, axes of the base, with the base at its height at rest.
      F_top, M_top: force and moment there, with those of the mass fixed to the tower top.
    """
    base, shape = m.structure.tower_base, m.tower_shape
    nodes, piece, out = s.tower_nodes, s.tower_piece, s.tower_station
    for i in range(out.stations):
        cut = s.tower_stations[i]
        # deflected position of the cut
        place = Vec(0.0, 0.0, base + cut)
        for n in range(nodes.nodes - 1):
            low, high = nodes.height[n], nodes.height[n + 1]
            if cut >= low and cut <= high:
                w = (cut - low) / (high - low)
                for k in range(modes):
                    lower, upper = shape.displacement[k, n], shape.displacement[k, n + 1]
                    place += m.q[k] * Vec(lower.x + w * (upper.x - lower.x), lower.y + w * (upper.y - lower.y), 0.0)
                break
        F = F_top
        M = M_top + cross(top - place, F_top)
        edge = 0.0
        for n in range(nodes.nodes):
            length = nodes.length[n]
            low, high = edge, edge + length
            edge = high
            share = min(max((high - cut) / length, 0.0), 1.0)
            if share <= 0.0:
                continue
            middle = 0.5 * (max(low, cut) + high)
            r = piece.offset[n] + Vec(0.0, 0.0, base + middle) - place
            F += share * piece.force[n]
            M = M + share * cross(r, piece.force[n]) + share * piece.moment[n]
        out.force[i] = F
        out.moment[i] = M
