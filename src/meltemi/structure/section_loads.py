"""Section loads: forces and moments that the outboard part of the turbine exerts on the inboard one at a cut.

They are external loads minus inertia of everything outboard, never stiffness times deflection, so that they do not
depend on the number of modes. Called after ``dynamics.accelerations``.

Reference: docs/theory/structure.md (S-41 to S-47).
"""

from __future__ import annotations

from math import sqrt

from meltemi.compiler import by_record, kernel
from meltemi.maths.vectors import Sym, Vec, about_x, about_y, cross, dot, turn
from meltemi.structure.gears import gear_loads, gear_momentum
from meltemi.structure.kinematics import GENERATOR, TORSION, node_inertia
from meltemi.structure.tables import SectionLoads, Structure

FEATURE = "section loads"


@kernel
def apex_acceleration(m: Structure) -> Vec:
    """Acceleration of the rotor apex from the second derivatives of the coordinates."""
    x = Vec(0.0, 0.0, 0.0)
    for j in range(m.columns.coordinates):
        x += m.a[j] * m.columns.linear[j]
    return x


@kernel
def angular_acceleration(m: Structure, n: int) -> Vec:
    """Angular acceleration from the second derivatives of the first ``n`` coordinates."""
    x = Vec(0.0, 0.0, 0.0)
    for j in range(n):
        x += m.a[j] * m.columns.angular[j]
    return x


@by_record
def tip_deflection(m: Structure, s: SectionLoads, b: int) -> tuple[Vec, Vec]:  # type: ignore[empty-body]
    """Deflection [m] and rotation [rad] of a blade's tip, blade axes, by the structural model of the blades."""


@tip_deflection.variant
@kernel
def modal_tip(m: Structure, s: SectionLoads, b: int) -> tuple[Vec, Vec]:
    """Deflection and rotation of the tip in small deflections, of second order in the modes."""
    q, shape, first = m.q, s.tip_shape, m.columns.coordinates + m.shape.modes * b
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
    a, shape, motion, first = m.a, m.shape, m.motion, m.columns.coordinates + m.shape.modes * b
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
    a_h, b_r = apex_acceleration(m), angular_acceleration(m, m.columns.coordinates)
    total_force, total_moment = Vec(0.0, 0.0, 0.0), Vec(0.0, 0.0, 0.0)
    for b in range(frame.blades):
        R = frame.orientation[b]
        acceleration, spin_rate = R.T @ a_h, R.T @ b_r
        moment = body.moment[b]
        F = body.force[b] - (body.mass[b] * acceleration + cross(spin_rate, moment))
        M = body.torque[b] - (cross(moment, acceleration) + body.inertia[b] @ spin_rate)
        first = m.columns.coordinates + link.modes * b
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
def chain_loads(m: Structure, s: SectionLoads) -> None:
    """Loads at the apex, at the yaw bearing (S-43, S-44) and in the gearbox (S-57).

    ``apex`` becomes force and moment at the yaw bearing, in inertial axes.
    """
    q, v, a, p, machine, columns, out = m.q, m.v, m.a, m.structure, m.machine, m.columns, s.chain
    n_tower = m.top_shape.modes
    gravity = Vec(0.0, 0.0, -p.gravity)
    shaft, w_n, w_r = machine.shaft, machine.nacelle_spin, machine.rotor_spin
    rotor_rate = machine.rotor_spin_rate + angular_acceleration(m, columns.coordinates)
    hub_acceleration = machine.hub_acceleration + apex_acceleration(m)
    # hub
    c = p.hub_centre * shaft
    centre = hub_acceleration + (cross(rotor_rate, c) + cross(w_r, cross(w_r, c)))
    F_hub = p.hub_mass * (gravity - centre)
    spin = dot(rotor_rate, shaft) * shaft + dot(w_r, shaft) * cross(w_n, shaft)
    F = s.apex.force + F_hub
    M = s.apex.moment + (cross(c, F_hub) - p.hub_inertia * spin)
    R_in, R_it = machine.nacelle, machine.top
    R_is = R_in @ about_y(p.tilt)
    R_ia = R_is @ about_x(machine.azimuth)
    out.apex_force = R_is.T @ F
    out.apex_moment = R_is.T @ M
    out.rotating_force = R_ia.T @ F
    out.rotating_moment = R_ia.T @ M
    # generator and nacelle
    nacelle_rate = machine.nacelle_spin_rate + angular_acceleration(m, n_tower + 1)
    arm = machine.hub_position - machine.top_position
    top = machine.top_acceleration
    for k in range(n_tower):
        top += a[k] * (columns.linear[k] - cross(columns.angular[k], arm))
    d, own = R_in @ p.nacelle_centre, p.nacelle_inertia
    J = turn(R_in, Sym(own.x, own.y, own.z, 0.0, 0.0, 0.0))
    centre = top + (cross(nacelle_rate, d) + cross(w_n, cross(w_n, d)))
    F_n = p.nacelle_mass * (gravity - centre)
    M_n = cross(d, F_n) - (J @ nacelle_rate + cross(w_n, J @ w_n))
    turns, Jg = p.generator_sense * p.gear_ratio, p.generator_inertia
    g, t = n_tower + GENERATOR, n_tower + TORSION
    spin_rates = Vec(dot(nacelle_rate, shaft), a[g], a[t])
    turning = spin_rates.x + turns * a[g]
    momentum = dot(w_n, shaft) + turns * v[g]
    M_g = -Jg * (turning * shaft + momentum * cross(w_n, shaft))
    if s.gear_loads.parts > 0:
        spins = Vec(dot(w_n, shaft), v[g], v[t])
        momentum, turning = gear_momentum(m, spins, spin_rates)
        M_g -= turning * shaft + momentum * cross(w_n, shaft)
        gear_loads(m, s, q[t], v[t], spin_rates)
    F_o = F + F_n
    M_o = M + cross(arm, F) + (M_n + M_g)
    out.yaw_force = R_it.T @ F_o
    out.yaw_moment = R_it.T @ M_o
    out.nacelle_force = R_in.T @ F_o
    out.nacelle_moment = R_in.T @ M_o
    out.top_acceleration = R_it.T @ top
    out.nacelle_turning = R_is.T @ nacelle_rate
    out.top_deflection = machine.top_position - Vec(0.0, 0.0, p.tower_base + p.tower_length)
    theta = Vec(0.0, 0.0, 0.0)
    for k in range(n_tower):
        theta += q[k] * m.top_shape.rotation[k]
    out.top_rotation = theta
    out.rotor_acceleration = a[g] + a[t]
    s.apex.force = F_o
    s.apex.moment = M_o


@kernel
def tower_loads(m: Structure, s: SectionLoads) -> None:
    """Loads at stations of the tower, from those at the yaw bearing down (S-45, S-46)."""
    q, a, p, shape, nodes, out = m.q, m.a, m.structure, m.tower_shape, s.tower_nodes, s.tower_station
    gravity = Vec(0.0, 0.0, -p.gravity)
    top = m.machine.top_position
    # below the yaw bearing: include the mass fixed to the tower top
    rising = Vec(0.0, 0.0, 0.0)
    for k in range(shape.modes):
        rising += a[k] * shape.displacement[k, shape.nodes - 1]
    F_top, M_top = s.apex.force + p.top_mass * (gravity - rising), s.apex.moment
    for i in range(out.stations):
        cut = s.tower_stations[i]
        # deflected position of the cut
        place = Vec(0.0, 0.0, p.tower_base + cut)
        for n in range(nodes.nodes - 1):
            low, high = nodes.height[n], nodes.height[n + 1]
            if cut >= low and cut <= high:
                w = (cut - low) / (high - low)
                for k in range(shape.modes):
                    here, there = shape.displacement[k, n], shape.displacement[k, n + 1]
                    place += q[k] * Vec(here.x + w * (there.x - here.x), here.y + w * (there.y - here.y), 0.0)
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
            u, acceleration, turning = Vec(0.0, 0.0, 0.0), Vec(0.0, 0.0, 0.0), Vec(0.0, 0.0, 0.0)
            for k in range(shape.modes):
                phi = shape.displacement[k, n]
                u += q[k] * phi
                acceleration += a[k] * phi
                turning += a[k] * shape.rotation[k, n]
            middle = 0.5 * (max(low, cut) + high)
            r = u + Vec(0.0, 0.0, p.tower_base + middle) - place
            f = nodes.mass[n] * (gravity - acceleration) + s.tower_drag.force[n]
            J = nodes.inertia[n]
            inertial = Vec(J.x * turning.x, J.y * turning.y, J.z * turning.z)
            F += share * f
            M = M + share * cross(r, f) - share * inertial
        out.force[i] = F
        out.moment[i] = M


@kernel
def station_loads(m: Structure, s: SectionLoads) -> None:
    """Loads at stations of the blades (S-47)."""
    stations, edges, out = s.blade_stations, s.blade_edges, s.station
    if stations.shape[0] == 0:
        return
    motion = m.motion
    n_nodes = edges.shape[0] - 1
    a_h, b_r = apex_acceleration(m), angular_acceleration(m, m.columns.coordinates)
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
