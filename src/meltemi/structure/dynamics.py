"""Equations of motion by Kane's method for the tree of the turbine: tower, nacelle, hub, and blades from the apex.

For each coordinate r the generalised active and inertia forces balance:

    sum_bodies  T_r . (F - m a) + W_r . (M - dH/dt) = 0

With a = sum_j T_j dv_j/dt + known part this is M dv/dt = f. Each blade is first reduced to one body about the rotor
apex (mass, first moment, inertia, force, moment, and two vectors for each of its modes); only these enter the equations
of the coordinates below it.

Reference: docs/theory/structure.md (S-25 to S-40); Kane & Levinson (1985), chapter 6.
"""

from __future__ import annotations

from math import tanh

from meltemi.compiler import by_record, kernel, total
from meltemi.maths.solve import solve_arrow
from meltemi.maths.vectors import Sym, Vec, cross, dot, turn
from meltemi.structure.gears import gear_equations
from meltemi.structure.kinematics import GENERATOR, TORSION, YAW, node_inertia
from meltemi.structure.tables import Structure

MASS, STIFFNESS, DAMPING, WEIGHT = 0, 1, 2, 3
"""Layers of ``tower_matrix``; WEIGHT is the geometric stiffness at unit gravity."""


@kernel
def inertia_about(J: Sym, m: float, s: Vec, r: Vec) -> Sym:
    """Inertia about a point at -r of a body with mass m, first moment s and inertia J about its reference point."""
    rr, rs = dot(r, r), dot(r, s)
    return Sym(
        J.xx + m * (rr - r.x * r.x) + 2.0 * (rs - r.x * s.x),
        J.yy + m * (rr - r.y * r.y) + 2.0 * (rs - r.y * s.y),
        J.zz + m * (rr - r.z * r.z) + 2.0 * (rs - r.z * s.z),
        J.xy - m * r.x * r.y - r.x * s.y - r.y * s.x,
        J.xz - m * r.x * r.z - r.x * s.z - r.z * s.x,
        J.yz - m * r.y * r.z - r.y * s.z - r.z * s.y,
    )


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
        first = m.columns.coordinates + m.shape.modes * b
        for k in range(m.shape.modes):
            f = 0.0
            for j in range(m.shape.modes):
                f -= m.modal[0, b, k, j] * q[first + j] + m.modal[1, b, k, j] * v[first + j]
            m.arm_force[b, k] = f
        gravity = m.frame.orientation[b].T @ Vec(0.0, 0.0, -m.structure.gravity)
        for n in range(m.motion.nodes):
            collect_node(m, gravity, b, n)


@kernel
def add_body(m: Structure, n: int, mass: float, s: Vec, J: Sym, G: Vec, N: Vec) -> None:
    """Add a rigid body that moves with the first ``n`` columns to the mass matrix and forces of the core (S-35).

    Args:
      mass, s, J: mass, first moment and inertia about the point of the columns, inertial axes.
      G, N: force and moment about that point, external minus known inertia loads.
    """
    columns = m.columns
    for i in range(n):
        T, W = columns.linear[i], columns.angular[i]
        m.core_force[i] += dot(T, G) + dot(W, N)
        P = mass * T + cross(W, s)
        H = J @ W + cross(s, T)
        for j in range(i + 1):
            m.core_mass[i, j] += dot(columns.linear[j], P) + dot(columns.angular[j], H)


@kernel
def assemble(dt: float, m: Structure) -> None:
    """Mass matrix and forces of the coordinates below the blades, and their coupling to the blades.

    Args:
      dt: [s] time step, as in ``simulation.step.equations``.
    """
    n_tower = m.top_shape.modes
    gravity = Vec(0.0, 0.0, -m.structure.gravity)
    m.core_mass[:] = 0.0
    m.core_force[:] = 0.0
    tower_equations(m)
    rotor(m, gravity)
    nacelle(m, n_tower, gravity)
    drivetrain(m, n_tower)
    yaw_bearing(m, n_tower + YAW)
    gear_equations(dt, m, n_tower)


@by_record
def tower_equations(m: Structure) -> None:
    """Initialise the core equations with those of the tower and of what it stands on."""


@tower_equations.variant
@kernel
def modal_tower(m: Structure) -> None:
    """Of modes (S-33, S-34)."""
    n_tower, matrix, gravity = m.top_shape.modes, m.tower_matrix, m.structure.gravity
    for i in range(n_tower):
        f = m.tower_push[i] + gravity * m.tower_weight[i]
        for j in range(n_tower):
            stiffness = matrix[STIFFNESS, i, j] + gravity * matrix[WEIGHT, i, j]
            f -= stiffness * m.q[j] + matrix[DAMPING, i, j] * m.v[j]
        m.core_force[i] = f
        for j in range(i + 1):
            m.core_mass[i, j] = matrix[MASS, i, j]


@kernel
def rotor(m: Structure, gravity: Vec) -> None:
    """Add hub and blades, as one body about the apex, and the blades' coupling to the core (S-35)."""
    p, machine, body, link, columns = m.structure, m.machine, m.body, m.link, m.columns
    shaft, w_n = machine.shaft, machine.nacelle_spin
    w_r, b_r = machine.rotor_spin, machine.rotor_spin_rate
    mass, Jh = p.hub_mass, p.hub_inertia
    c = p.hub_centre * shaft
    s = mass * c
    # the hub rotates about the shaft: dH/dt = J (b.s) s + J (w.s) (w_n x s), known part
    spin_moment = Jh * dot(b_r, shaft) * shaft + Jh * dot(w_r, shaft) * cross(w_n, shaft)
    centre_turning = cross(b_r, c) + cross(w_r, cross(w_r, c))
    G = mass * (gravity - (machine.hub_acceleration + centre_turning))
    N = cross(c, G) - spin_moment
    x, y, z = shaft.x, shaft.y, shaft.z
    disc = Sym(Jh * x * x, Jh * y * y, Jh * z * z, Jh * x * y, Jh * x * z, Jh * y * z)
    J = inertia_about(disc, mass, Vec(0.0, 0.0, 0.0), c)
    for b in range(body.blades):
        R = m.frame.orientation[b]
        mass += body.mass[b]
        s += R @ body.moment[b]
        G += R @ body.force[b]
        N += R @ body.torque[b]
        J += turn(R, body.inertia[b])
        for k in range(link.modes):
            P, L = R @ link.linear[b, k], R @ link.angular[b, k]
            for j in range(columns.coordinates):
                m.coupling[b, k, j] = dot(columns.linear[j], P) + dot(columns.angular[j], L)
    add_body(m, columns.coordinates, mass, s, J, G, N)


@kernel
def nacelle(m: Structure, n_tower: int, gravity: Vec) -> None:
    """Add the nacelle, whose columns are those of the rotor apex moved to the tower top (S-36)."""
    p, machine = m.structure, m.machine
    R = machine.nacelle
    d = machine.top_position - machine.hub_position
    mass, c, own = p.nacelle_mass, R @ p.nacelle_centre, p.nacelle_inertia
    J0 = turn(R, Sym(own.x, own.y, own.z, 0.0, 0.0, 0.0))
    w, known = machine.nacelle_spin, machine.nacelle_spin_rate
    a = machine.top_acceleration + (cross(known, c) + cross(w, cross(w, c)))
    G = mass * (gravity - a)
    N = cross(c, G) - (J0 @ known + cross(w, J0 @ w))
    # about the rotor apex, the point of the columns
    r = d + c
    J = inertia_about(J0, mass, Vec(0.0, 0.0, 0.0), r)
    add_body(m, n_tower + 1, mass, mass * r, J, G, N + cross(d, G))


@kernel
def drivetrain(m: Structure, n_tower: int) -> None:
    """Add generator, shaft and brake (S-37 to S-39)."""
    v, p, machine, drive = m.v, m.structure, m.machine, m.drive
    g, t = n_tower + GENERATOR, n_tower + TORSION
    ratio, Jg = p.gear_ratio, p.generator_inertia
    turns = p.generator_sense * ratio
    shaft, w_n = machine.shaft, machine.nacelle_spin
    # the generator moves with the nacelle and, about the shaft, with the gear ratio times the low-speed end
    spin = dot(w_n, shaft) + turns * v[g]
    known = Jg * dot(machine.nacelle_spin_rate, shaft) * shaft + Jg * spin * cross(w_n, shaft)
    for i in range(n_tower + 1):
        W = m.columns.angular[i]
        along = dot(W, shaft)
        m.core_force[i] -= dot(W, known)
        m.core_mass[g, i] += Jg * turns * along
        for j in range(i + 1):
            m.core_mass[i, j] += Jg * along * dot(m.columns.angular[j], shaft)
    m.core_mass[g, g] += Jg * ratio * ratio / p.gearbox_efficiency
    brake = drive.brake_torque * tanh(ratio * v[g] / drive.brake_speed)
    held = drive.generator_torque + brake
    # the rotor drives the gearbox, whose losses reduce the torque; a motoring generator covers them itself
    held = held / p.gearbox_efficiency if held >= 0.0 else held * p.gearbox_efficiency
    m.core_force[g] -= ratio * held + turns * dot(shaft, known)
    m.core_force[t] -= p.shaft_stiffness * m.q[t] + p.shaft_damping * v[t]


@kernel
def yaw_bearing(m: Structure, y: int) -> None:
    """Add the yaw bearing: drive and brake in series with spring and damper, and friction in series with the same
    (S-40)."""
    p, drive = m.structure, m.drive
    twist, twist_rate = m.q[y] - drive.yaw_command, m.v[y] - drive.yaw_command_rate
    held = drive.yaw_held * (p.yaw_stiffness * twist + p.yaw_damping * twist_rate)
    m.core_force[y] -= held
    drive.yaw_drive_torque = -held
    if drive.yaw_rubs > 0.0:
        twist, twist_rate = m.q[y] - drive.yaw_rest, m.v[y] - drive.yaw_rest_rate
        rubbed = p.yaw_stiffness * twist + p.yaw_damping * twist_rate
        m.core_force[y] -= rubbed
        drive.yaw_friction_torque = -rubbed
    else:
        drive.yaw_friction_torque = 0.0


@kernel
def lock(m: Structure) -> None:
    """Eliminate locked coordinates from the equations: they keep their velocity (zero acceleration)."""
    A, g, D, C, f, locked = m.core_mass, m.core_force, m.arm_mass, m.coupling, m.arm_force, m.locked
    n_core = m.columns.coordinates
    n_blades, n_modes = m.link.blades, m.link.modes
    for i in range(n_core):
        if locked[i] > 0.0:
            g[i] = 0.0
            for j in range(n_core):
                A[i, j] = 0.0
                A[j, i] = 0.0
            A[i, i] = 1.0
            for b in range(n_blades):
                for k in range(n_modes):
                    C[b, k, i] = 0.0
    for b in range(n_blades):
        for k in range(n_modes):
            if locked[n_core + n_modes * b + k] > 0.0:
                f[b, k] = 0.0
                for j in range(n_modes):
                    D[b, k, j] = 0.0
                    D[b, j, k] = 0.0
                D[b, k, k] = 1.0
                for j in range(n_core):
                    C[b, k, j] = 0.0


@kernel
def accelerations(m: Structure) -> None:
    """Solve the assembled equations, which are overwritten, for the second derivatives of all coordinates."""
    n_core, n_blades, n_modes = m.columns.coordinates, m.link.blades, m.link.modes
    lock(m)
    solve_arrow(m.arm_mass, m.coupling, m.arm_force, m.core_mass, m.core_force, n_blades, n_modes, n_core)
    for i in range(n_core):
        m.a[i] = m.core_force[i]
    for b in range(n_blades):
        for k in range(n_modes):
            m.a[n_core + n_modes * b + k] = m.arm_force[b, k]
