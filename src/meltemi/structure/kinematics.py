"""Motion of tower top, nacelle, hub, blade roots and blade nodes from the generalised coordinates.

Coordinates q, in this order: tower modes, yaw, generator azimuth (referred to the low-speed shaft),
drivetrain torsion (rotor minus generator), then the modes of each blade. Velocities v = dq/dt.

Every velocity is linear in v: velocity = sum_j (partial velocity)_j v_j; every acceleration is
sum_j (partial velocity)_j dv_j/dt plus a known part that depends on q and v alone. Partial
velocities of the rotor apex are the columns T_j (linear) and W_j (angular) of ``columns``.

Reference: docs/theory/structure.md (S-10 to S-24); Kane & Levinson (1985), chapters 2 and 4.
"""

from __future__ import annotations

from math import cos, pi, sin

from meltemi.compiler import by_record, kernel
from meltemi.maths.rotations import angular_acceleration, angular_velocity, rotation
from meltemi.maths.vectors import Sym, Vec, about_x, about_y, about_z, cross, turn
from meltemi.structure.tables import Structure

YAW, GENERATOR, TORSION = 0, 1, 2
"""Offsets of these coordinates after those of the tower."""
N_SHAFT = 3
"""Number of these coordinates."""


@by_record
def tower_top(m: Structure) -> None:
    """Motion of the tower top; its partial velocities fill the first columns."""


@tower_top.variant
@kernel
def top_of_modes(m: Structure) -> None:
    """Of second order in the coordinates (S-11 to S-14)."""
    q, v, top, machine = m.q, m.v, m.top_shape, m.machine
    nothing = Vec(0.0, 0.0, 0.0)
    u, du, bias, theta, rate = nothing, nothing, nothing, nothing, nothing
    for k in range(top.modes):
        z, zd = nothing, nothing
        for j in range(top.modes):
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
    for k in range(top.modes):
        m.columns.angular[k] = angular_velocity(theta, top.rotation[k])
    machine.top_position = u + Vec(0.0, 0.0, m.structure.tower_base + m.structure.tower_length)
    machine.top_velocity = du
    machine.top_acceleration = bias
    machine.top_spin = angular_velocity(theta, rate)
    machine.top_spin_rate = angular_acceleration(theta, rate)
    machine.top = rotation(theta)


@kernel
def nacelle_and_hub(m: Structure) -> None:
    """Motion of nacelle, shaft and rotor apex; all columns are transferred to the apex (S-15 to S-18)."""
    q, v, p, machine, columns = m.q, m.v, m.structure, m.machine, m.columns
    n = columns.coordinates - N_SHAFT
    R_it = machine.top
    w_t, b_t = machine.top_spin, machine.top_spin_rate
    # yaw: about the tower top's z axis
    yaw_axis = Vec(R_it.xz, R_it.yz, R_it.zz)
    yaw_rate = v[n + YAW]
    R_in = R_it @ about_z(q[n + YAW])
    w_n = w_t + yaw_rate * yaw_axis
    b_n = b_t + yaw_rate * cross(w_t, yaw_axis)
    # shaft: its x axis points downwind; with positive tilt the upwind end is up
    shaft = R_in @ Vec(cos(p.tilt), 0.0, -sin(p.tilt))
    speed = v[n + GENERATOR] + v[n + TORSION]
    w_r = w_n + speed * shaft
    b_r = b_n + speed * cross(w_n, shaft)
    # rotor apex H, at d from the tower top
    d = p.shaft_height * yaw_axis - p.overhang * shaft
    turning = cross(w_n, d)
    machine.hub_position = machine.top_position + d
    machine.hub_velocity = machine.top_velocity + turning
    machine.hub_acceleration = machine.top_acceleration + (cross(b_n, d) + cross(w_n, turning))
    machine.nacelle = R_in
    machine.nacelle_spin = w_n
    machine.nacelle_spin_rate = b_n
    machine.shaft = shaft
    machine.rotor_spin = w_r
    machine.rotor_spin_rate = b_r
    machine.azimuth = q[n + GENERATOR] + q[n + TORSION]
    machine.rotor_speed = speed
    for k in range(n):
        columns.linear[k] += cross(columns.angular[k], d)
    columns.linear[n + YAW] = cross(yaw_axis, d)
    columns.angular[n + YAW] = yaw_axis
    for k in range(n + GENERATOR, n + TORSION + 1):
        columns.linear[k] = Vec(0.0, 0.0, 0.0)
        columns.angular[k] = shaft


@kernel
def blade_frames(m: Structure) -> None:
    """Orientation and motion of the blade roots (S-19, S-20)."""
    machine, frame, pitch = m.machine, m.frame, m.pitch
    R_is = machine.nacelle @ about_y(m.structure.tilt)
    for b in range(frame.blades):
        angle, rate, rate2 = pitch.angle[b], pitch.rate[b], pitch.acceleration[b]
        azimuth = machine.azimuth + b * (2.0 * pi / frame.blades)
        R_ib = R_is @ about_x(azimuth) @ (about_y(-m.structure.precone) @ about_z(-angle))
        w, known = R_ib.T @ machine.rotor_spin, R_ib.T @ machine.rotor_spin_rate
        # pitching by +angle to feather is a rotation by -angle about the blade's z axis
        axis = Vec(0.0, 0.0, -1.0)
        frame.orientation[b] = R_ib
        frame.velocity[b] = R_ib.T @ machine.hub_velocity
        frame.acceleration[b] = R_ib.T @ machine.hub_acceleration
        frame.spin[b] = w + rate * axis
        frame.spin_rate[b] = known + (rate2 * axis + rate * cross(w, axis))
        frame.shaft[b] = R_ib.T @ machine.shaft
        frame.cos_pitch[b] = cos(angle)
        frame.sin_pitch[b] = sin(angle)
        frame.azimuth[b] = azimuth


@kernel
def node_motion(m: Structure, first: int, b: int, n: int) -> None:
    """Motion of one blade node; ``first`` is the index of the blade's first coordinate in q (S-21 to S-24)."""
    q, v, shape, frame, motion = m.q, m.v, m.shape, m.frame, m.motion
    nothing = Vec(0.0, 0.0, 0.0)
    u, du, bias, theta, rate = nothing, nothing, nothing, nothing, nothing
    for k in range(shape.modes):
        z, zd = nothing, nothing
        for j in range(shape.modes):
            Z = m.second.displacement[shape.modes * k + j, b, n]
            z += q[first + j] * Z
            zd += v[first + j] * Z
        phi, psi = shape.displacement[k, b, n], shape.rotation[k, b, n]
        t = phi + z
        m.partial.velocity[k, b, n] = t
        u += q[first + k] * (phi + 0.5 * z)
        du += v[first + k] * t
        bias += v[first + k] * zd
        theta += q[first + k] * psi
        rate += v[first + k] * psi
    r = m.blade_nodes.position[b, n] + u
    w, w_rate = frame.spin[b], frame.spin_rate[b]
    turning = cross(w, r)
    motion.position[b, n] = r
    motion.velocity[b, n] = frame.velocity[b] + (turning + du)
    # a = a_H + dw/dt x r + w x (w x r) + 2 w x du/dt + second-order part of d2u/dt2
    spinning = cross(w, turning + 2.0 * du)
    motion.acceleration[b, n] = frame.acceleration[b] + (cross(w_rate, r) + (spinning + bias))
    motion.orientation[b, n] = rotation(theta)
    motion.spin[b, n] = w + angular_velocity(theta, rate)
    motion.spin_rate[b, n] = w_rate + (cross(w, angular_velocity(theta, rate)) + angular_acceleration(theta, rate))
    for k in range(shape.modes):
        m.partial.rotation[k, b, n] = angular_velocity(theta, shape.rotation[k, b, n])


@kernel
def node_inertia(m: Structure, b: int, n: int) -> tuple[Vec, Sym]:
    """First moment and inertia of a blade node about its reference point, blade axes."""
    R = m.motion.orientation[b, n]
    return R @ m.blade_nodes.moment[b, n], turn(R, m.blade_nodes.inertia[b, n])


@by_record
def blade_motion(m: Structure) -> None:
    """Motion of all blade nodes, by the structural model of the blades: fills ``motion`` and ``partial``."""


@blade_motion.variant
@kernel
def modal_motion(m: Structure) -> None:
    """Motion of all blade nodes in small deflections, of second order in the modes."""
    for b in range(m.motion.blades):
        for n in range(m.motion.nodes):
            node_motion(m, m.columns.coordinates + m.shape.modes * b, b, n)
