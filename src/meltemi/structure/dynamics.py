"""Equations of motion by Kane's method, exploiting the tree: blades hang on the rotor apex.

For each coordinate r the generalised active and inertia forces balance:

    sum_bodies  T_r . (F - m a) + W_r . (M - dH/dt) = 0

With a = sum_j T_j dv_j/dt + known part this is M dv/dt = f. A blade is first collected into one body
seen from the rotor apex (mass, first moment, inertia, force, moment, and two vectors for each of its
modes); only these enter the equations of the coordinates below it.

Reference: docs/theory/structure.md (S-25 to S-40); Kane & Levinson (1985), chapter 6.
"""

from __future__ import annotations

from math import tanh

from numpy import float64
from numpy.typing import NDArray

from meltemi.core.kernel import kernel
from meltemi.maths.access import add2, add3, add_sym2, rot1, rot2, sym2, sym3, vec1, vec2, vec3
from meltemi.maths.generic import total, zero
from meltemi.maths.solve import solve_arrow
from meltemi.maths.vectors import (
    Sym,
    Vec,
    cross,
    dot,
    turn,
)
from meltemi.structure.gears import gear_equations
from meltemi.structure.kinematics import GENERATOR, TORSION, YAW
from meltemi.structure.tables import BladeBody, BladeNode, StructureParameters
from meltemi.turbine import exchange as ex

Float = NDArray[float64]

GRAVITY, HUB_MASS, HUB_CENTRE, HUB_INERTIA = StructureParameters.slots("gravity hub_mass hub_centre hub_inertia")
NACELLE_MASS, NACELLE_CENTRE, NACELLE_INERTIA = StructureParameters.slots("nacelle_mass nacelle_centre nacelle_inertia")
GEAR_RATIO, SENSE, GENERATOR_INERTIA, GEARBOX = StructureParameters.slots(
    "gear_ratio generator_sense generator_inertia gearbox_efficiency"
)
SHAFT_STIFFNESS, SHAFT_DAMPING, YAW_STIFFNESS, YAW_DAMPING = StructureParameters.slots(
    "shaft_stiffness shaft_damping yaw_stiffness yaw_damping"
)
NODE_MASS, NODE_MOMENT, NODE_INERTIA = BladeNode.slots("mass moment inertia")
B_MASS, B_MOMENT, B_INERTIA, B_FORCE, B_TORQUE = BladeBody.slots("mass moment inertia force torque")
MASS, STIFFNESS, DAMPING, WEIGHT = 0, 1, 2, 3
"""Layers of ``tower_matrix``; WEIGHT is the gravity stiffness for unit gravity."""


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
def collect_node(
    shape: Float,
    nodes: Float,
    partial: Float,
    motion: Float,
    load: Float,
    gravity: Vec,
    body: Float,
    link: Float,
    arm_mass: Float,
    arm_force: Float,
    b: int,
    n: int,
) -> None:
    """Add one node, a small rigid body, to the sums of its blade (S-28 to S-32)."""
    n_modes = shape.shape[0] // 6
    m, J = nodes[NODE_MASS, b, n], sym3(nodes, NODE_INERTIA, b, n)
    theta = vec3(motion, ex.ROTATION, b, n)
    s0 = vec3(nodes, NODE_MOMENT, b, n)
    s = s0 + cross(theta, s0)
    r, a = vec3(motion, ex.POSITION, b, n), vec3(motion, ex.ACCELERATION, b, n)
    w, known = vec3(motion, ex.SPIN, b, n), vec3(motion, ex.SPIN_RATE, b, n)
    # force and moment about the node: aerodynamic + gravity - inertia
    fall = gravity - a
    inertia_force = cross(known, s) + cross(w, cross(w, s))
    G = vec3(load, ex.FORCE, b, n) + (m * fall - inertia_force)
    inertia_moment = J @ known + cross(w, J @ w)
    N = vec3(load, ex.MOMENT, b, n) + (cross(s, fall) - inertia_moment)

    body[B_MASS, b] += total(m)
    add2(body, B_MOMENT, b, s + m * r)
    add_sym2(body, B_INERTIA, b, inertia_about(J, m, s, r))
    add2(body, B_FORCE, b, G)
    add2(body, B_TORQUE, b, N + cross(r, G))
    for k in range(n_modes):
        t, psi = vec3(partial, 3 * k, b, n), vec3(shape, 6 * k + 3, b, n)
        # momentum of the node in this mode at unit speed: linear P, angular about the node H
        P = m * t + cross(psi, s)
        H = J @ psi + cross(s, t)
        add3(link, 0, b, k, P)
        add3(link, 3, b, k, H + cross(r, P))
        arm_force[b, k] += total(dot(t, G) + dot(psi, N))
        for j in range(k + 1):
            arm_mass[b, k, j] += total(dot(vec3(partial, 3 * j, b, n), P) + dot(vec3(shape, 6 * j + 3, b, n), H))


@kernel
def collect_blades(
    q: Float,
    v: Float,
    n_core: int,
    p: Float,
    shape: Float,
    nodes: Float,
    modal: Float,
    frame: Float,
    partial: Float,
    motion: Float,
    load: Float,
    body: Float,
    link: Float,
    arm_mass: Float,
    arm_force: Float,
) -> None:
    """Collect every blade into one body and its modal sums.

    Args:
      modal: (2, blades, modes, modes) stiffness and damping.
      body: table BODY.
      link: (6, blades, modes) linear and angular momentum about the apex of each mode at unit speed.
      arm_mass: (blades, modes, modes) lower triangle.
      arm_force: (blades, modes).
    """
    n_modes = shape.shape[0] // 6
    body[:] = 0.0
    link[:] = 0.0
    arm_mass[:] = 0.0
    for b in range(motion.shape[1]):
        first = n_core + n_modes * b
        for k in range(n_modes):
            f = zero(arm_force)
            for j in range(n_modes):
                f -= modal[0, b, k, j] * q[first + j] + modal[1, b, k, j] * v[first + j]
            arm_force[b, k] = f
        gravity = rot2(frame, ex.ROOT_ORIENTATION, b).T @ Vec(0.0, 0.0, -p[GRAVITY])
        for n in range(motion.shape[2]):
            collect_node(shape, nodes, partial, motion, load, gravity, body, link, arm_mass, arm_force, b, n)


@kernel
def add_body(columns: Float, n: int, m: float, s: Vec, J: Sym, G: Vec, N: Vec, A: Float, g: Float) -> None:
    """Add a rigid body that moves with the first ``n`` columns to mass matrix A and force g (S-35).

    Args:
      m, s, J: mass, first moment and inertia about the point of the columns, inertial axes.
      G, N: force and moment about that point, external minus known inertia.
    """
    for i in range(n):
        T, W = vec2(columns, 0, i), vec2(columns, 3, i)
        g[i] += dot(T, G) + dot(W, N)
        P = m * T + cross(W, s)
        H = J @ W + cross(s, T)
        for j in range(i + 1):
            A[i, j] += dot(vec2(columns, 0, j), P) + dot(vec2(columns, 3, j), H)


@kernel
def assemble(
    dt: float,
    q: Float,
    v: Float,
    p: Float,
    drive: Float,
    gear_modes: Float,
    gears: Float,
    columns: Float,
    tower_matrix: Float,
    tower_weight: Float,
    tower_load: Float,
    machine: Float,
    frame: Float,
    body: Float,
    link: Float,
    core_mass: Float,
    core_force: Float,
    coupling: Float,
) -> None:
    """Mass matrix and forces of the coordinates below the blades, and their coupling to the blades.

    Args:
      dt: [s] as in ``simulation.step.equations``.
      drive: table DRIVE.
      gear_modes, gears: tables GEAR_MODE and GEARS.
      tower_matrix: (4, tower modes, tower modes), layers MASS, STIFFNESS, DAMPING, WEIGHT.
      tower_weight: (tower modes,) generalised force of the tower's own weight for unit gravity.
      tower_load: (tower modes,) generalised aerodynamic force on the tower.
      core_mass: (core, core) lower triangle.
      coupling: (blades, modes, core).
    """
    n_tower = tower_weight.shape[0]
    n_core = core_force.shape[0]
    n_modes = link.shape[2]
    core_mass[:] = 0.0
    core_force[:] = 0.0
    gravity = Vec(0.0, 0.0, -p[GRAVITY])
    for i in range(n_tower):
        f = tower_load[i] + p[GRAVITY] * tower_weight[i]
        for j in range(n_tower):
            stiffness = tower_matrix[STIFFNESS, i, j] + p[GRAVITY] * tower_matrix[WEIGHT, i, j]
            f -= stiffness * q[j] + tower_matrix[DAMPING, i, j] * v[j]
        core_force[i] = f
        for j in range(i + 1):
            core_mass[i, j] = tower_matrix[MASS, i, j]

    # rotor: hub and blades, about the apex
    shaft, w_n = vec1(machine, ex.SHAFT), vec1(machine, ex.NACELLE_SPIN)
    a_h, w_r, b_r = vec1(machine, ex.HUB_ACCELERATION), vec1(machine, ex.ROTOR_SPIN), vec1(machine, ex.ROTOR_SPIN_RATE)
    m, Jh = p[HUB_MASS], p[HUB_INERTIA]
    c = p[HUB_CENTRE] * shaft
    s = m * c
    # the hub spins about the shaft: dH/dt = J (b.s) s + J (w.s) (w_n x s), known part
    spin_moment = Jh * dot(b_r, shaft) * shaft + Jh * dot(w_r, shaft) * cross(w_n, shaft)
    centre_turning = cross(b_r, c) + cross(w_r, cross(w_r, c))
    G = m * (gravity - (a_h + centre_turning))
    N = cross(c, G) - spin_moment
    disc = Sym(
        Jh * shaft.x * shaft.x,
        Jh * shaft.y * shaft.y,
        Jh * shaft.z * shaft.z,
        Jh * shaft.x * shaft.y,
        Jh * shaft.x * shaft.z,
        Jh * shaft.y * shaft.z,
    )
    J = inertia_about(disc, m, Vec(0.0, 0.0, 0.0), c)
    for b in range(frame.shape[1]):
        R = rot2(frame, ex.ROOT_ORIENTATION, b)
        m += body[B_MASS, b]
        s += R @ vec2(body, B_MOMENT, b)
        G += R @ vec2(body, B_FORCE, b)
        N += R @ vec2(body, B_TORQUE, b)
        J_b = turn(R, sym2(body, B_INERTIA, b))
        J += J_b
        for k in range(n_modes):
            P = R @ Vec(link[0, b, k], link[1, b, k], link[2, b, k])
            L = R @ Vec(link[3, b, k], link[4, b, k], link[5, b, k])
            for j in range(n_core):
                coupling[b, k, j] = dot(vec2(columns, 0, j), P) + dot(vec2(columns, 3, j), L)
    add_body(columns, n_core, m, s, J, G, N, core_mass, core_force)

    nacelle(n_tower, p, columns, machine, gravity, core_mass, core_force)
    drivetrain(n_tower, q, v, p, drive, columns, machine, core_mass, core_force)
    yaw_bearing(n_tower + YAW, q, v, p, drive, core_force)
    gear_equations(dt, n_tower, v, p, gear_modes, gears, columns, machine, core_mass, core_force)


@kernel
def nacelle(
    n_tower: int, p: Float, columns: Float, machine: Float, gravity: Vec, core_mass: Float, core_force: Float
) -> None:
    """Add the nacelle, whose columns are those of the rotor apex moved to the tower top (S-36)."""
    R = rot1(machine, ex.NACELLE)
    d = vec1(machine, ex.TOP_POSITION) - vec1(machine, ex.HUB_POSITION)
    m, c = p[NACELLE_MASS], R @ vec1(p, NACELLE_CENTRE)
    J0 = turn(R, Sym(p[NACELLE_INERTIA], p[NACELLE_INERTIA + 1], p[NACELLE_INERTIA + 2], 0.0, 0.0, 0.0))
    w, known = vec1(machine, ex.NACELLE_SPIN), vec1(machine, ex.NACELLE_SPIN_RATE)
    a = vec1(machine, ex.TOP_ACCELERATION) + (cross(known, c) + cross(w, cross(w, c)))
    G = m * (gravity - a)
    N = cross(c, G) - (J0 @ known + cross(w, J0 @ w))
    # about the rotor apex, the point of the columns
    r = d + c
    s = m * r
    J = inertia_about(J0, m, Vec(0.0, 0.0, 0.0), r)
    add_body(columns, n_tower + 1, m, s, J, G, N + cross(d, G), core_mass, core_force)


@kernel
def drivetrain(
    n_tower: int,
    q: Float,
    v: Float,
    p: Float,
    drive: Float,
    columns: Float,
    machine: Float,
    core_mass: Float,
    core_force: Float,
) -> None:
    """Add generator, shaft and brake (S-37 to S-39)."""
    g, t = n_tower + GENERATOR, n_tower + TORSION
    ratio, Jg = p[GEAR_RATIO], p[GENERATOR_INERTIA]
    turns = p[SENSE] * ratio
    shaft, w_n = vec1(machine, ex.SHAFT), vec1(machine, ex.NACELLE_SPIN)
    # the generator turns with the nacelle and, about the shaft, with the gear ratio times the low-speed end
    spin = dot(w_n, shaft) + turns * v[g]
    known = Jg * dot(vec1(machine, ex.NACELLE_SPIN_RATE), shaft) * shaft + Jg * spin * cross(w_n, shaft)
    for i in range(n_tower + 1):
        W = vec2(columns, 3, i)
        along = dot(W, shaft)
        core_force[i] -= dot(W, known)
        core_mass[g, i] += Jg * turns * along
        for j in range(i + 1):
            core_mass[i, j] += Jg * along * dot(vec2(columns, 3, j), shaft)
    core_mass[g, g] += Jg * ratio * ratio / p[GEARBOX]
    brake = drive[ex.BRAKE_TORQUE] * tanh(ratio * v[g] / drive[ex.BRAKE_SPEED])
    held = drive[ex.GENERATOR_TORQUE] + brake
    # the rotor drives through the gearbox and pays its losses; a motor pays them when it drives the rotor
    held = held / p[GEARBOX] if held >= 0.0 else held * p[GEARBOX]
    core_force[g] -= ratio * held + turns * dot(shaft, known)
    core_force[t] -= p[SHAFT_STIFFNESS] * q[t] + p[SHAFT_DAMPING] * v[t]


@kernel
def yaw_bearing(y: int, q: Float, v: Float, p: Float, drive: Float, core_force: Float) -> None:
    """Add the yaw bearing: drive and brake behind a spring and a damper, and friction behind the same (S-40)."""
    twist, twist_rate = q[y] - drive[ex.YAW_COMMAND], v[y] - drive[ex.YAW_COMMAND_RATE]
    held = drive[ex.YAW_HELD] * (p[YAW_STIFFNESS] * twist + p[YAW_DAMPING] * twist_rate)
    core_force[y] -= held
    drive[ex.YAW_DRIVE_TORQUE] = -held
    if drive[ex.YAW_RUBS] > 0.0:
        twist, twist_rate = q[y] - drive[ex.YAW_REST], v[y] - drive[ex.YAW_REST_RATE]
        rubbed = p[YAW_STIFFNESS] * twist + p[YAW_DAMPING] * twist_rate
        core_force[y] -= rubbed
        drive[ex.YAW_FRICTION_TORQUE] = -rubbed
    else:
        drive[ex.YAW_FRICTION_TORQUE] = 0.0


@kernel
def lock(locked: NDArray[float64], A: Float, g: Float, D: Float, C: Float, f: Float) -> None:
    """Take locked coordinates out of the equations: they keep their velocity (second derivative zero).

    Args:
      locked: (coordinates,) 1 for locked, 0 for free.
    """
    n_core = g.shape[0]
    n_blades, n_modes = f.shape
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
def accelerations(locked: Float, A: Float, g: Float, D: Float, C: Float, f: Float, a: Float) -> None:
    """Second derivatives of all coordinates from the assembled equations, which are overwritten."""
    n_core = g.shape[0]
    n_blades, n_modes = f.shape
    lock(locked, A, g, D, C, f)
    solve_arrow(D, C, f, A, g, n_blades, n_modes, n_core)
    for i in range(n_core):
        a[i] = g[i]
    for b in range(n_blades):
        for k in range(n_modes):
            a[n_core + n_modes * b + k] = f[b, k]
