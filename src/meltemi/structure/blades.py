"""The blades: motion of their nodes, their reduction to one body each about the rotor apex, and their section loads.

A blade meets the hub at the rotor apex. To the bodies below it is one body (mass, first moment, inertia, force, moment)
and two vectors for each of its modes.

Reference: docs/theory/structure.md (S-19 to S-24, S-28 to S-32, S-41, S-42, S-47).
"""

from __future__ import annotations

from math import cos, pi, sin, sqrt

from meltemi.compiler import by_record, kernel, total
from meltemi.maths.rotations import angular_acceleration, angular_velocity, rotation
from meltemi.maths.vectors import Sym, Vec, about_x, about_y, about_z, cross, dot, turn
from meltemi.structure.equations import angular_acceleration as core_angular_acceleration
from meltemi.structure.equations import apex_acceleration, blade_row, inertia_about, resistance
from meltemi.structure.tables import SectionLoads, Structure


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


@by_record
def blade_motion(m: Structure) -> None:
    """Motion of all blade nodes, by the structural model of the blades: fills ``motion`` and ``partial``."""


@blade_motion.variant
@kernel
def modal_motion(m: Structure) -> None:
    """Motion of all blade nodes in small deflections, of second order in the modes."""
    for b in range(m.motion.blades):
        for n in range(m.motion.nodes):
            node_motion(m, blade_row(m, b), b, n)


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
def collect_blades(m: Structure) -> None:
    """Reduce every blade to one body and its modal sums, by the structural model of the blades.

    The results are ``body``, ``link``, ``arm_mass`` and ``arm_force``; motion and loads of the nodes come first.
    """


@collect_blades.variant
@kernel
def collect_modal_blades(m: Structure) -> None:
    """Reduce every blade, with the stiffness and damping of its modes."""
    q, v = m.q, m.v
    m.body.array[:] = 0.0
    m.link.array[:] = 0.0
    m.arm_mass[:] = 0.0
    for b in range(m.motion.blades):
        first = blade_row(m, b)
        for k in range(m.shape.modes):
            f = 0.0
            for j in range(m.shape.modes):
                f -= m.modal[0, b, k, j] * q[first + j] + m.modal[1, b, k, j] * v[first + j]
            m.arm_force[b, k] = f
        gravity = m.frame.orientation[b].T @ Vec(0.0, 0.0, -m.structure.gravity)
        for n in range(m.motion.nodes):
            collect_node(m, gravity, b, n)


@kernel
def collect_node(m: Structure, gravity: Vec, b: int, n: int) -> None:
    """Add one node, as a small rigid body, to the sums of its blade (S-28 to S-32)."""
    shape, partial, motion, body, link = m.shape, m.partial, m.motion, m.body, m.link
    mass, (s, J) = m.blade_nodes.mass[b, n], node_inertia(m, b, n)
    r, w, known = motion.position[b, n], motion.spin[b, n], motion.spin_rate[b, n]
    # force and moment about the node: aerodynamic + gravity - inertia
    fall = gravity - motion.acceleration[b, n]
    inertia_force = cross(known, s) + cross(w, cross(w, s))
    G = m.load.force[b, n] + (mass * fall - inertia_force)
    inertia_moment = J @ known + cross(w, J @ w)
    N = m.load.moment[b, n] + (cross(s, fall) - inertia_moment)

    body.mass[b] += total(mass)
    body.moment[b] += total(s + mass * r)
    body.inertia[b] += total(inertia_about(J, mass, s, r))
    body.force[b] += total(G)
    body.torque[b] += total(N + cross(r, G))
    for k in range(shape.modes):
        t, psi = partial.velocity[k, b, n], partial.rotation[k, b, n]
        # momentum of the node in this mode at unit speed: linear P, angular about the node H
        P = mass * t + cross(psi, s)
        H = J @ psi + cross(s, t)
        link.linear[b, k] += total(P)
        link.angular[b, k] += total(H + cross(r, P))
        m.arm_force[b, k] += total(dot(t, G) + dot(psi, N))
        for j in range(k + 1):
            m.arm_mass[b, k, j] += total(dot(partial.velocity[j, b, n], P) + dot(partial.rotation[j, b, n], H))


@kernel
def blade_implicit(dt: float, m: Structure) -> None:
    """Complete the equations of a step for implicit modes of the blades (M-43)."""
    for b in range(m.link.blades):
        first = blade_row(m, b)
        for k in range(m.link.modes):
            for j in range(m.link.modes):
                added = resistance(dt, m, first + k, first + j, m.modal[0, b, k, j], m.modal[1, b, k, j])
                if j <= k:
                    m.arm_mass[b, k, j] += added
                m.arm_force[b, k] += added * m.weights.expected[first + j]


@by_record
def tip_deflection(m: Structure, s: SectionLoads, b: int) -> tuple[Vec, Vec]:  # type: ignore[empty-body]
    """Deflection [m] and rotation [rad] of a blade's tip, blade axes, by the structural model of the blades."""


@tip_deflection.variant
@kernel
def modal_tip(m: Structure, s: SectionLoads, b: int) -> tuple[Vec, Vec]:
    """Deflection and rotation of the tip in small deflections, of second order in the modes."""
    q, shape, first = m.q, s.tip_shape, blade_row(m, b)
    u, theta = Vec(0.0, 0.0, 0.0), Vec(0.0, 0.0, 0.0)
    for k in range(shape.modes):
        t = shape.displacement[k]
        for j in range(shape.modes):
            Z = Vec(s.tip_second[0, k, j], s.tip_second[1, k, j], s.tip_second[2, k, j])
            t += 0.5 * q[first + j] * Z
        u += q[first + k] * t
        theta += q[first + k] * shape.rotation[k]
    return u, theta


@by_record
def node_load(m: Structure, a_b: Vec, b_b: Vec, b: int, n: int) -> tuple[Vec, Vec]:  # type: ignore[empty-body]
    """Force and moment about a blade node, external minus inertia, blade axes, by the structural model of the blades.

    Args:
      a_b, b_b: acceleration and angular acceleration of the blade's root by the second derivatives, blade axes.
      b, n: blade and node.
    """


@node_load.variant
@kernel
def modal_node_load(m: Structure, a_b: Vec, b_b: Vec, b: int, n: int) -> tuple[Vec, Vec]:
    """Load of a blade node in small deflections."""
    a, shape, motion, first = m.a, m.shape, m.motion, blade_row(m, b)
    gravity = m.frame.orientation[b].T @ Vec(0.0, 0.0, -m.structure.gravity)
    moment, J = node_inertia(m, b, n)
    r, w = motion.position[b, n], motion.spin[b, n]
    acceleration = motion.acceleration[b, n] + (a_b + cross(b_b, r))
    spin_rate = motion.spin_rate[b, n] + b_b
    for k in range(shape.modes):
        acceleration += a[first + k] * m.partial.velocity[k, b, n]
        spin_rate += a[first + k] * m.partial.rotation[k, b, n]
    fall = gravity - acceleration
    F = m.blade_nodes.mass[b, n] * fall - (cross(spin_rate, moment) + cross(w, cross(w, moment)))
    F += m.load.force[b, n]
    M = cross(moment, fall) - (J @ spin_rate + cross(w, J @ w))
    M += m.load.moment[b, n]
    return F, M


@kernel
def blade_loads(m: Structure, s: SectionLoads) -> None:
    """Loads at the blade roots, tip deflections, and contribution of the blades to the apex loads (S-41, S-42).

    ``apex`` becomes force and moment of all blades on the hub at the apex, in inertial axes.
    """
    a, machine, frame, body, link, root = m.a, m.machine, m.frame, m.body, m.link, s.root
    a_h, b_r = apex_acceleration(m), core_angular_acceleration(m, m.columns.coordinates)
    total_force, total_moment = Vec(0.0, 0.0, 0.0), Vec(0.0, 0.0, 0.0)
    for b in range(frame.blades):
        R = frame.orientation[b]
        acceleration, spin_rate = R.T @ a_h, R.T @ b_r
        moment = body.moment[b]
        F = body.force[b] - (body.mass[b] * acceleration + cross(spin_rate, moment))
        M = body.torque[b] - (cross(moment, acceleration) + body.inertia[b] @ spin_rate)
        first = blade_row(m, b)
        for k in range(link.modes):
            F -= a[first + k] * link.linear[b, k]
            M -= a[first + k] * link.angular[b, k]
        u, theta = tip_deflection(m, s, b)
        total_force += R @ F
        total_moment += R @ M
        M_root = M - cross(Vec(0.0, 0.0, m.structure.hub_radius), F)
        cp, sp = frame.cos_pitch[b], frame.sin_pitch[b]
        root.pitched_force[b] = F
        root.pitched_moment[b] = M_root
        root.pitched_tip[b] = u
        root.force[b] = unpitched(cp, sp, F)
        root.moment[b] = unpitched(cp, sp, M_root)
        root.tip[b] = unpitched(cp, sp, u)
        root.tip_rotation[b] = theta
        # tip position from the tower top, nacelle axes
        place = machine.nacelle.T @ (machine.hub_position - machine.top_position + R @ (m.structure.tip + u))
        flat = place.x * place.x + place.y * place.y
        root.clearance[b] = sqrt(flat + place.z * place.z) if place.z > 0.0 else sqrt(flat)
    s.apex.force = total_force
    s.apex.moment = total_moment


@kernel
def unpitched(cp: float, sp: float, v: Vec) -> Vec:
    """Transformation from blade axes to coned axes, which do not pitch."""
    return Vec(cp * v.x + sp * v.y, -sp * v.x + cp * v.y, v.z)


@kernel
def station_loads(m: Structure, s: SectionLoads) -> None:
    """Loads at stations of the blades (S-47)."""
    stations, edges, out = s.blade_stations, s.blade_edges, s.station
    if stations.shape[0] == 0:
        return
    motion = m.motion
    n_nodes = edges.shape[0] - 1
    a_h, b_r = apex_acceleration(m), core_angular_acceleration(m, m.columns.coordinates)
    for b in range(motion.blades):
        R = m.frame.orientation[b]
        a_b, b_b = R.T @ a_h, R.T @ b_r
        for i in range(stations.shape[0]):
            out.force[b, i] = Vec(0.0, 0.0, 0.0)
            out.moment[b, i] = Vec(0.0, 0.0, 0.0)
        for n in range(n_nodes):
            r = motion.position[b, n]
            F, M = node_load(m, a_b, b_b, b, n)
            for i in range(stations.shape[0]):
                share = min(max((edges[n + 1] - stations[i]) / (edges[n + 1] - edges[n]), 0.0), 1.0)
                if share <= 0.0:
                    continue
                # the outer part of a cut piece has its centre further out
                shift = 0.5 * (1.0 - share) * (edges[n + 1] - edges[n])
                arm = r + Vec(0.0, 0.0, shift) - station_place(m, stations[i], b, n_nodes)
                out.force[b, i] += share * F
                out.moment[b, i] += share * (M + cross(arm, F))


@kernel
def station_place(m: Structure, station: float, b: int, n_nodes: int) -> Vec:
    """Deflected position of a ``station`` [m] from the root, linear between root, nodes and beyond the last."""
    root, nodes, motion = m.structure.hub_radius, m.blade_nodes, m.motion
    z = root + station
    first = nodes.position[b, 0].z
    if z < first:
        w = (z - root) / (first - root)
        return Vec(0.0, 0.0, (1.0 - w) * root) + w * motion.position[b, 0]
    n = 0
    for i in range(1, n_nodes - 1):
        if z >= nodes.position[b, i].z:
            n = i
    z0, z1 = nodes.position[b, n].z, nodes.position[b, n + 1].z
    w = (z - z0) / (z1 - z0)
    return (1.0 - w) * motion.position[b, n] + w * motion.position[b, n + 1]
