"""A tower on a base that moves by itself: a platform, a block on the ground, or another body below the tower.

The coordinates of the base are the last ones of the tower. The base supplies its motion (``base_motion``); the tower on
it turns with it without approximation. Mass and forces of the base itself act at ``simulation.step.outer_forces``.

Reference: docs/theory/floating.md (W-7, W-30 to W-33); docs/development/bodies.md.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from meltemi.compiler import Rot, Sym, Table, Vec, Vectors, View, by_record, kernel, number, symmetric, xyz
from meltemi.compiler import rotation as matrix
from meltemi.maths.rotations import angular_acceleration, angular_velocity, rotation
from meltemi.maths.vectors import cross, dot, turn
from meltemi.structure.members import ModalMember
from meltemi.structure.tables import SectionLoads, Structure
from meltemi.structure.tower import (
    DAMPING,
    MASS,
    STIFFNESS,
    WEIGHT,
    bending,
    load_piece,
    stations_below,
    top_place,
    top_rise,
    tower_equations,
    tower_loads,
    tower_top,
)


class Base(Table):
    """Motion of the tower's base, inertial axes; it is the interface of tower and base."""

    position: Vec = xyz("m", "position of the tower's base")
    velocity: Vec = xyz("m/s", "velocity of the tower's base")
    acceleration: Vec = xyz("m/s^2", "known acceleration of the tower's base")
    orientation: Rot = matrix("-", "orientation of the base")
    spin: Vec = xyz("rad/s", "angular velocity")
    spin_rate: Vec = xyz("rad/s^2", "angular acceleration, known part")


class BaseColumns(Table, axes="coordinate"):
    """Partial velocities of the tower's base by the coordinates of the base."""

    linear: Vectors = xyz("- or m", "partial velocity, inertial axes")
    angular: Vectors = xyz("rad/m or -", "partial angular velocity, inertial axes")


class TowerBody(Table):
    """The undeflected tower as one body about its base, with the mass fixed to its top; axes of the base."""

    mass: float = number("kg", "mass")
    moment: Vec = xyz("kg m", "first moment")
    inertia: Sym = symmetric("kg m^2", "inertia")


class TowerMomentum(Table, axes="mode"):
    """Momentum of the tower about its base by unit rate of a mode; axes of the base."""

    linear: Vectors = xyz("kg", "momentum")
    angular: Vectors = xyz("kg m", "angular momentum")


class MovingBase(Structure):
    """A turbine whose tower stands on a base that moves."""

    base: Base
    base_columns: BaseColumns
    tower_body: TowerBody
    tower_momentum: TowerMomentum


def moving_base(tower: ModalMember, top_mass: float) -> dict[str, Any]:
    """Arrays of the records of a tower on a moving base.

    Args:
      tower: the modes of the tower, and then the motions of its base (``structure.members.on_foundation``).
      top_mass: [kg] fixed to its top.
    """
    assert tower.momenta is not None, "its base moves"
    modes = tower.momenta.shape[1] - 6
    rigid = np.concatenate([np.eye(3), np.cross(np.eye(3), tower.modes.points[-1] - tower.modes.points[0])])
    top = np.concatenate([tower.modes.shape[:modes, -1, :3], rigid])
    momenta = tower.momenta + top_mass * rigid @ top.T
    J = momenta[3:, modes + 3 :]
    body, momentum = TowerBody.zeros(), TowerMomentum.zeros(mode=modes)
    v = View(TowerBody, body)
    v["mass"] = momenta[0, modes]
    # the momentum of a translation is the mass, its angular momentum the first moment times it
    v["moment"] = momenta[5, modes + 1], momenta[3, modes + 2], momenta[4, modes]
    v["inertia"] = J[0, 0], J[1, 1], J[2, 2], J[0, 1], J[0, 2], J[1, 2]
    v = View(TowerMomentum, momentum)
    v["linear"], v["angular"] = momenta[:3, :modes], momenta[3:, :modes]
    return {
        "base": Base.zeros(),
        "base_columns": BaseColumns.zeros(coordinate=len(tower.names) - modes),
        "tower_body": body,
        "tower_momentum": momentum,
    }


@kernel
def base_row(m: MovingBase) -> int:
    """Index of the base's first motion in the coordinates, which is the number of modes of the tower."""
    return m.tower_momentum.modes


@by_record
def base_motion(m: MovingBase) -> None:
    """Motion of the tower's base: fills ``base`` and ``base_columns``."""


@tower_top.variant
@kernel
def top_on_base(m: MovingBase) -> None:
    """Motion of the top of a tower that turns with its base (W-30)."""
    base_motion(m)
    base, machine, C, first = m.base, m.machine, m.columns, base_row(m)
    R, w, known = base.orientation, base.spin, base.spin_rate
    u, du, bias, theta, rate = bending(m, first)
    r, du = R @ (u + Vec(0.0, 0.0, m.structure.tower_length)), R @ du
    for k in range(first):
        C.linear[k], C.angular[k] = R @ C.linear[k], R @ C.angular[k]
    for k in range(m.base_columns.coordinates):
        T, W = m.base_columns.linear[k], m.base_columns.angular[k]
        C.linear[first + k], C.angular[first + k] = T + cross(W, r), W
    spin = R @ angular_velocity(theta, rate)
    machine.top_position = base.position + r
    machine.top_velocity = base.velocity + cross(w, r) + du
    machine.top_acceleration = base.acceleration + cross(known, r) + cross(w, cross(w, r) + 2.0 * du) + R @ bias
    machine.top_spin = w + spin
    machine.top_spin_rate = known + cross(w, spin) + R @ angular_acceleration(theta, rate)
    machine.top = R @ rotation(theta)


@kernel
def momentum_of(m: MovingBase, s: Vec, v: Vec, w: Vec) -> tuple[Vec, Vec]:
    """Linear and angular momentum of the tower with first moment ``s`` about its base, of velocity v, spin w."""
    body = m.tower_body
    return body.mass * v + cross(w, s), cross(s, v) + body.inertia @ w


@kernel
def base_column(m: MovingBase, k: int) -> tuple[Vec, Vec]:
    """Velocity and angular velocity of the base by unit rate of its motion ``k``, in its axes."""
    R = m.base.orientation
    return R.T @ m.base_columns.linear[k], R.T @ m.base_columns.angular[k]


@tower_equations.variant
@kernel
def equations_on_base(m: MovingBase) -> None:
    """Equations of a tower whose inertia and weight turn with its base, and of the base's springs (W-31, W-32)."""
    base, q, matrix, momentum, first = m.base, m.q, m.tower_matrix, m.tower_momentum, base_row(m)
    R, gravity, motions = base.orientation, m.structure.gravity, m.base_columns.coordinates
    for i in range(first + motions):
        f = m.tower_push[i]
        for j in range(first + motions):
            f -= matrix[STIFFNESS, i, j] * q[j] + matrix[DAMPING, i, j] * m.v[j]
        for j in range(first if i < first else 0):
            f -= gravity * matrix[WEIGHT, i, j] * q[j]
        m.core_force[i] = f + gravity * m.tower_weight[i] if i < first else f
        for j in range(i + 1):
            m.core_mass[i, j] = matrix[MASS, i, j] if i < first else 0.0
    g, w, known = R.T @ (Vec(0.0, 0.0, -gravity) - base.acceleration), R.T @ base.spin, R.T @ base.spin_rate
    mass, s, flow = m.tower_body.mass, m.tower_body.moment, 0.0 * g
    for k in range(first):
        P, H = momentum.linear[k], momentum.angular[k]
        m.core_force[k] += dot(P, g) - dot(H, known) - w.z * (w.x * H.y - w.y * H.x)
        s += q[k] * P
        flow += m.v[k] * P
    F = mass * g - cross(known, s) - cross(w, cross(w, s) + 2.0 * flow)
    M = cross(s, g) - momentum_of(m, s, 0.0 * g, known)[1] - cross(w, momentum_of(m, s, 0.0 * g, w)[1])
    for k in range(motions):
        T, W = base_column(m, k)
        P, H = momentum_of(m, s, T, W)
        m.core_force[first + k] += dot(T, F) + dot(W, M)
        for j in range(first):
            m.core_mass[first + k, j] += dot(T, momentum.linear[j]) + dot(W, momentum.angular[j])
        for j in range(k + 1):
            Tj, Wj = base_column(m, j)
            m.core_mass[first + k, first + j] += dot(Tj, P) + dot(Wj, H)


@kernel
def add_to_base(m: MovingBase, mass: float, centre: Vec, inertia: Sym, F: Vec, N: Vec) -> None:
    """Add a rigid body that moves with the base, with its weight, to the equations of the base's motions (W-7).

    Args:
      mass, centre, inertia: mass [kg], centre [m] from the tower base, inertia [kg m^2] about it; axes of the base.
      F, N: [N] other forces and [N m] their moment about the centre of mass, inertial axes.
    """
    base, columns, first = m.base, m.base_columns, base_row(m)
    r, J, w, known = base.orientation @ centre, turn(base.orientation, inertia), base.spin, base.spin_rate
    a = base.acceleration + (cross(known, r) + cross(w, cross(w, r)))
    G = F + mass * (Vec(0.0, 0.0, -m.structure.gravity) - a)
    M = N - (J @ known + cross(w, J @ w))
    for k in range(columns.coordinates):
        W = columns.angular[k]
        T = columns.linear[k] + cross(W, r)
        m.core_force[first + k] += dot(T, G) + dot(W, M)
        P, H = mass * T, J @ W
        for j in range(k + 1):
            Wj = columns.angular[j]
            m.core_mass[first + k, first + j] += dot(columns.linear[j] + cross(Wj, r), P) + dot(Wj, H)


@top_place.variant
@kernel
def place_on_base(m: MovingBase) -> Vec:
    """Position of the top of a tower that turns with its base."""
    return m.base.orientation.T @ (m.machine.top_position - m.base.position) + Vec(0.0, 0.0, m.structure.tower_base)


@tower_loads.variant
@kernel
def loads_on_base(m: MovingBase, s: SectionLoads) -> None:
    """Loads of the tower in the axes of its base, on which it stands as on one at rest that accelerates (W-33)."""
    base, columns, first, nodes, up = m.base, m.base_columns, base_row(m), s.tower_nodes, Vec(0.0, 0.0, 1.0)
    R, rise, turning = base.orientation, base.acceleration, base.spin_rate
    for k in range(columns.coordinates):
        rise += m.a[first + k] * columns.linear[k]
        turning += m.a[first + k] * columns.angular[k]
    fall, turning, spin = R.T @ (Vec(0.0, 0.0, -m.structure.gravity) - rise), R.T @ turning, R.T @ base.spin
    for n in range(nodes.nodes):
        flow, r = cross(spin, nodes.height[n] * up), nodes.height[n] * up
        for k in range(first):
            flow += (2.0 * m.v[k]) * m.tower_shape.displacement[k, n]
        carried = fall - (cross(turning, r) + cross(spin, flow))
        load_piece(n, first, carried, turning, R.T @ s.tower_drag.force[n], m, s)
    r = m.structure.tower_length * up
    carried = fall - (cross(turning, r) + cross(spin, cross(spin, r)))
    F = R.T @ s.apex.force + m.structure.top_mass * (carried - top_rise(m, first))
    stations_below(place_on_base(m), F, R.T @ s.apex.moment, first, m, s)
