"""Section loads: what the outer part of the machine exerts on the inner one at a cut.

Always external loads minus inertia of everything outboard, never stiffness times deflection, so a
load is right whatever the number of modes. Called after ``dynamics.accelerations``.

Reference: docs/theory/structure.md (S-41 to S-47).
"""

from __future__ import annotations

from math import sqrt

from numpy import float64
from numpy.typing import NDArray

from meltemi.core.kernel import kernel
from meltemi.maths.access import put1, put2, put3, rot1, rot2, sym2, sym3, vec1, vec2, vec3
from meltemi.maths.vectors import (
    Sym,
    Vec,
    about_x,
    about_y,
    cross,
    dot,
    turn,
)
from meltemi.structure.gears import gear_loads, gear_momentum
from meltemi.structure.kinematics import GENERATOR, N_SHAFT, TORSION
from meltemi.structure.tables import (
    BladeBody,
    BladeNode,
    BladeRootLoad,
    BladeStationLoad,
    MachineLoad,
    StructureParameters,
    TowerNode,
    TowerStationLoad,
)
from meltemi.turbine import exchange as ex

Float = NDArray[float64]

HUB_RADIUS, TIP, TILT, TOWER_BASE, TOWER_LENGTH, TOP_MASS = StructureParameters.slots(
    "hub_radius tip tilt tower_base tower_length top_mass"
)
GRAVITY, HUB_MASS, HUB_CENTRE, HUB_INERTIA = StructureParameters.slots("gravity hub_mass hub_centre hub_inertia")
NACELLE_MASS, NACELLE_CENTRE, NACELLE_INERTIA = StructureParameters.slots("nacelle_mass nacelle_centre nacelle_inertia")
GEAR_RATIO, SENSE, GENERATOR_INERTIA = StructureParameters.slots("gear_ratio generator_sense generator_inertia")
NODE_POSITION, NODE_MASS, NODE_MOMENT, NODE_INERTIA = BladeNode.slots("position mass moment inertia")
B_MASS, B_MOMENT, B_INERTIA, B_FORCE, B_TORQUE = BladeBody.slots("mass moment inertia force torque")
R_FORCE, R_MOMENT, R_PITCHED_FORCE, R_PITCHED_MOMENT, R_TIP, R_PITCHED_TIP, R_TIP_ROTATION, R_CLEARANCE = (
    BladeRootLoad.slots("force moment pitched_force pitched_moment tip pitched_tip tip_rotation clearance")
)
APEX_FORCE, APEX_MOMENT, ROTATING_FORCE, ROTATING_MOMENT, YAW_FORCE, YAW_MOMENT = MachineLoad.slots(
    "apex_force apex_moment rotating_force rotating_moment yaw_force yaw_moment"
)
NACELLE_FORCE, NACELLE_MOMENT = MachineLoad.slots("nacelle_force nacelle_moment")
TOP_DEFLECTION, TOP_ROTATION, TOP_TOTAL_ACCELERATION, ROTOR_ACCELERATION = MachineLoad.slots(
    "top_deflection top_rotation top_acceleration rotor_acceleration"
)
S_FORCE, S_MOMENT = BladeStationLoad.slots("force moment")
T_FORCE, T_MOMENT = TowerStationLoad.slots("force moment")
T_HEIGHT, T_LENGTH, T_MASS, T_INERTIA = TowerNode.slots("height length mass inertia")


@kernel
def from_core(columns: Float, a: Float, n: int, row: int) -> Vec:
    """Sum of the first ``n`` columns times the second derivatives: linear (row 0) or angular (row 3)."""
    x = Vec(0.0, 0.0, 0.0)
    for j in range(n):
        x += a[j] * vec2(columns, row, j)
    return x


@kernel
def blade_loads(
    q: Float,
    a: Float,
    p: Float,
    columns: Float,
    machine: Float,
    frame: Float,
    body: Float,
    link: Float,
    tip_shape: Float,
    tip_second: Float,
    apex: Float,
    root: Float,
) -> None:
    """Loads at the blade roots, tip deflections, and the blades' share of the apex loads (S-41, S-42).

    Args:
      tip_shape: (6, modes) shapes at the tip; tip_second: (3, modes, modes).
      apex: (6,) becomes force and moment of all blades on the hub at the apex, inertial axes.
    """
    n_core = columns.shape[1]
    n_modes = link.shape[2]
    a_h, b_r = from_core(columns, a, n_core, 0), from_core(columns, a, n_core, 3)
    total_force, total_moment = Vec(0.0, 0.0, 0.0), Vec(0.0, 0.0, 0.0)
    R_in = rot1(machine, ex.NACELLE)
    top, hub = vec1(machine, ex.TOP_POSITION), vec1(machine, ex.HUB_POSITION)
    for b in range(frame.shape[1]):
        R = rot2(frame, ex.ROOT_ORIENTATION, b)
        acceleration, spin_rate = R.T @ a_h, R.T @ b_r
        m, s, J = body[B_MASS, b], vec2(body, B_MOMENT, b), sym2(body, B_INERTIA, b)
        F = vec2(body, B_FORCE, b) - (m * acceleration + cross(spin_rate, s))
        M = vec2(body, B_TORQUE, b) - (cross(s, acceleration) + J @ spin_rate)
        first = n_core + n_modes * b
        u, theta = Vec(0.0, 0.0, 0.0), Vec(0.0, 0.0, 0.0)
        for k in range(n_modes):
            F -= a[first + k] * Vec(link[0, b, k], link[1, b, k], link[2, b, k])
            M -= a[first + k] * Vec(link[3, b, k], link[4, b, k], link[5, b, k])
            t = Vec(tip_shape[0, k], tip_shape[1, k], tip_shape[2, k])
            for j in range(n_modes):
                Z = Vec(tip_second[0, k, j], tip_second[1, k, j], tip_second[2, k, j])
                t += 0.5 * q[first + j] * Z
            u += q[first + k] * t
            theta += q[first + k] * Vec(tip_shape[3, k], tip_shape[4, k], tip_shape[5, k])
        total_force += R @ F
        total_moment += R @ M
        arm = Vec(0.0, 0.0, p[HUB_RADIUS])
        M_root = M - cross(arm, F)
        cp, sp = frame[ex.COS_PITCH, b], frame[ex.SIN_PITCH, b]
        put2(root, R_PITCHED_FORCE, b, F)
        put2(root, R_PITCHED_MOMENT, b, M_root)
        put2(root, R_PITCHED_TIP, b, u)
        put2(root, R_FORCE, b, unpitched(cp, sp, F))
        put2(root, R_MOMENT, b, unpitched(cp, sp, M_root))
        put2(root, R_TIP, b, unpitched(cp, sp, u))
        put2(root, R_TIP_ROTATION, b, theta)
        # tip from the tower top, nacelle axes
        place = R_in.T @ (hub - top + R @ (vec1(p, TIP) + u))
        flat = place.x * place.x + place.y * place.y
        root[R_CLEARANCE, b] = sqrt(flat + place.z * place.z) if place.z > 0.0 else sqrt(flat)
    put1(apex, 0, total_force)
    put1(apex, 3, total_moment)


@kernel
def unpitched(cp: float, sp: float, v: Vec) -> Vec:
    """From blade axes to coned axes, which do not pitch."""
    return Vec(cp * v.x + sp * v.y, -sp * v.x + cp * v.y, v.z)


@kernel
def chain_loads(
    q: Float,
    v: Float,
    a: Float,
    p: Float,
    gear_modes: Float,
    gears: Float,
    gear_rows: Float,
    gear_shape: Float,
    columns: Float,
    machine: Float,
    apex: Float,
    top_shape: Float,
    out: Float,
    gear_load: Float,
) -> None:
    """Loads at the apex, at the yaw bearing (S-43, S-44) and in the gearbox (S-57).

    Args:
      gear_modes, gears, gear_rows, gear_load: tables GEAR_MODE, GEARS, GEAR_ROW, GEAR_LOAD.
      gear_shape: (parts, modes) [N m/rad or N/rad] load of a unit amplitude.
      apex: (6,) from :func:`blade_loads`; becomes force and moment at the yaw bearing, inertial axes.
      out: table MACHINE_LOAD.
    """
    n_core = columns.shape[1]
    n_tower = n_core - N_SHAFT
    gravity = Vec(0.0, 0.0, -p[GRAVITY])
    shaft = vec1(machine, ex.SHAFT)
    w_n, w_r = vec1(machine, ex.NACELLE_SPIN), vec1(machine, ex.ROTOR_SPIN)
    rotor_rate = vec1(machine, ex.ROTOR_SPIN_RATE) + from_core(columns, a, n_core, 3)
    hub_acceleration = vec1(machine, ex.HUB_ACCELERATION) + from_core(columns, a, n_core, 0)
    # hub
    c = p[HUB_CENTRE] * shaft
    centre = hub_acceleration + (cross(rotor_rate, c) + cross(w_r, cross(w_r, c)))
    F_hub = p[HUB_MASS] * (gravity - centre)
    spin = dot(rotor_rate, shaft) * shaft + dot(w_r, shaft) * cross(w_n, shaft)
    F = vec1(apex, 0) + F_hub
    M = vec1(apex, 3) + (cross(c, F_hub) - p[HUB_INERTIA] * spin)
    R_is = rot1(machine, ex.NACELLE) @ about_y(p[TILT])
    R_ia = R_is @ about_x(machine[ex.AZIMUTH])
    put1(out, APEX_FORCE, R_is.T @ F)
    put1(out, APEX_MOMENT, R_is.T @ M)
    put1(out, ROTATING_FORCE, R_ia.T @ F)
    put1(out, ROTATING_MOMENT, R_ia.T @ M)
    # generator and nacelle
    nacelle_rate = vec1(machine, ex.NACELLE_SPIN_RATE) + from_core(columns, a, n_tower + 1, 3)
    arm = vec1(machine, ex.HUB_POSITION) - vec1(machine, ex.TOP_POSITION)
    top = vec1(machine, ex.TOP_ACCELERATION)
    for k in range(n_tower):
        at_top = vec2(columns, 0, k) - cross(vec2(columns, 3, k), arm)
        top += a[k] * at_top
    R_in = rot1(machine, ex.NACELLE)
    d = R_in @ vec1(p, NACELLE_CENTRE)
    J = turn(R_in, Sym(p[NACELLE_INERTIA], p[NACELLE_INERTIA + 1], p[NACELLE_INERTIA + 2], 0.0, 0.0, 0.0))
    centre = top + (cross(nacelle_rate, d) + cross(w_n, cross(w_n, d)))
    F_n = p[NACELLE_MASS] * (gravity - centre)
    M_n = cross(d, F_n) - (J @ nacelle_rate + cross(w_n, J @ w_n))
    turns, Jg = p[SENSE] * p[GEAR_RATIO], p[GENERATOR_INERTIA]
    g, t = n_tower + GENERATOR, n_tower + TORSION
    spin_rates = Vec(dot(nacelle_rate, shaft), a[g], a[t])
    turning = spin_rates.x + turns * a[g]
    momentum = dot(w_n, shaft) + turns * v[g]
    M_g = -Jg * (turning * shaft + momentum * cross(w_n, shaft))
    if gear_load.shape[1] > 0:
        spins = Vec(dot(w_n, shaft), v[g], v[t])
        momentum, turning = gear_momentum(p, gear_modes, gears, spins, spin_rates)
        M_g -= turning * shaft + momentum * cross(w_n, shaft)
        gear_loads(q[t], v[t], spin_rates, p, gear_modes, gears, gear_rows, gear_shape, gear_load)
    F_o = F + F_n
    M_o = M + cross(arm, F) + (M_n + M_g)
    R_it = rot1(machine, ex.TOP)
    put1(out, YAW_FORCE, R_it.T @ F_o)
    put1(out, YAW_MOMENT, R_it.T @ M_o)
    put1(out, NACELLE_FORCE, R_in.T @ F_o)
    put1(out, NACELLE_MOMENT, R_in.T @ M_o)
    put1(out, TOP_TOTAL_ACCELERATION, R_it.T @ top)
    put1(out, TOP_DEFLECTION, vec1(machine, ex.TOP_POSITION) - Vec(0.0, 0.0, p[TOWER_BASE] + p[TOWER_LENGTH]))
    theta = Vec(0.0, 0.0, 0.0)
    for k in range(n_tower):
        theta += q[k] * Vec(top_shape[3, k], top_shape[4, k], top_shape[5, k])
    put1(out, TOP_ROTATION, theta)
    out[ROTOR_ACCELERATION] = a[n_tower + GENERATOR] + a[n_tower + TORSION]
    put1(apex, 0, F_o)
    put1(apex, 3, M_o)


@kernel
def tower_loads(
    q: Float,
    a: Float,
    p: Float,
    machine: Float,
    apex: Float,
    nodes: Float,
    shape: Float,
    drag: Float,
    stations: Float,
    out: Float,
) -> None:
    """Loads at stations of the tower (S-45, S-46).

    Args:
      apex: (6,) force and moment at the yaw bearing, inertial axes.
      nodes: table TOWER_NODE.
      shape: (6 modes, nodes).
      drag: (3, nodes) wind force on each node, inertial axes.
      stations: (stations,) [m] heights above the base.
      out: table TOWER_STATION_LOAD.
    """
    gravity = Vec(0.0, 0.0, -p[GRAVITY])
    n_modes = shape.shape[0] // 6
    top = vec1(machine, ex.TOP_POSITION)
    # below the yaw bearing: with the mass that is fixed there
    rising = Vec(0.0, 0.0, 0.0)
    for k in range(n_modes):
        rising += a[k] * vec2(shape, 6 * k, shape.shape[1] - 1)
    F_top, M_top = vec1(apex, 0) + p[TOP_MASS] * (gravity - rising), vec1(apex, 3)
    for i in range(out.shape[1]):
        cut = stations[i]
        # deflected place of the cut
        place = Vec(0.0, 0.0, p[TOWER_BASE] + cut)
        for n in range(nodes.shape[1] - 1):
            low, high = nodes[T_HEIGHT, n], nodes[T_HEIGHT, n + 1]
            if cut >= low and cut <= high:
                w = (cut - low) / (high - low)
                for k in range(n_modes):
                    x = shape[6 * k, n] + w * (shape[6 * k, n + 1] - shape[6 * k, n])
                    y = shape[6 * k + 1, n] + w * (shape[6 * k + 1, n + 1] - shape[6 * k + 1, n])
                    place += q[k] * Vec(x, y, 0.0)
                break
        F = F_top
        M = M_top + cross(top - place, F_top)
        edge = 0.0
        for n in range(nodes.shape[1]):
            length = nodes[T_LENGTH, n]
            low, high = edge, edge + length
            edge = high
            share = min(max((high - cut) / length, 0.0), 1.0)
            if share <= 0.0:
                continue
            u, acceleration, turning = Vec(0.0, 0.0, 0.0), Vec(0.0, 0.0, 0.0), Vec(0.0, 0.0, 0.0)
            for k in range(n_modes):
                phi = vec2(shape, 6 * k, n)
                u += q[k] * phi
                acceleration += a[k] * phi
                turning += a[k] * vec2(shape, 6 * k + 3, n)
            middle = 0.5 * (max(low, cut) + high)
            r = u + Vec(0.0, 0.0, p[TOWER_BASE] + middle) - place
            f = nodes[T_MASS, n] * (gravity - acceleration) + vec2(drag, 0, n)
            J = vec2(nodes, T_INERTIA, n)
            inertial = Vec(J.x * turning.x, J.y * turning.y, J.z * turning.z)
            F += share * f
            M = M + share * cross(r, f) - share * inertial
        put2(out, T_FORCE, i, F)
        put2(out, T_MOMENT, i, M)


@kernel
def station_loads(
    a: Float,
    p: Float,
    columns: Float,
    nodes: Float,
    edges: Float,
    shape: Float,
    partial: Float,
    frame: Float,
    motion: Float,
    load: Float,
    stations: Float,
    out: Float,
) -> None:
    """Loads at stations of the blades (S-47).

    Args:
      edges: (nodes + 1,) [m] cuts between the pieces of blade, from the root.
      stations: (stations,) [m] from the root.
      out: table STATION_LOAD.
    """
    if stations.shape[0] == 0:
        return
    n_core = columns.shape[1]
    n_modes = shape.shape[0] // 6
    n_nodes = edges.shape[0] - 1
    a_h, b_r = from_core(columns, a, n_core, 0), from_core(columns, a, n_core, 3)
    for b in range(frame.shape[1]):
        R = rot2(frame, ex.ROOT_ORIENTATION, b)
        gravity = R.T @ Vec(0.0, 0.0, -p[GRAVITY])
        a_b, b_b = R.T @ a_h, R.T @ b_r
        first = n_core + n_modes * b
        for i in range(stations.shape[0]):
            put3(out, S_FORCE, b, i, Vec(0.0, 0.0, 0.0))
            put3(out, S_MOMENT, b, i, Vec(0.0, 0.0, 0.0))
        for n in range(n_nodes):
            m, J = nodes[NODE_MASS, b, n], sym3(nodes, NODE_INERTIA, b, n)
            r = vec3(motion, ex.POSITION, b, n)
            theta, s0 = vec3(motion, ex.ROTATION, b, n), vec3(nodes, NODE_MOMENT, b, n)
            s = s0 + cross(theta, s0)
            acceleration = vec3(motion, ex.ACCELERATION, b, n) + (a_b + cross(b_b, r))
            spin_rate = vec3(motion, ex.SPIN_RATE, b, n) + b_b
            for k in range(n_modes):
                acceleration += a[first + k] * vec3(partial, 3 * k, b, n)
                spin_rate += a[first + k] * vec3(shape, 6 * k + 3, b, n)
            w = vec3(motion, ex.SPIN, b, n)
            fall = gravity - acceleration
            F = m * fall - (cross(spin_rate, s) + cross(w, cross(w, s)))
            F += vec3(load, ex.FORCE, b, n)
            M = cross(s, fall) - (J @ spin_rate + cross(w, J @ w))
            M += vec3(load, ex.MOMENT, b, n)
            for i in range(stations.shape[0]):
                share = min(max((edges[n + 1] - stations[i]) / (edges[n + 1] - edges[n]), 0.0), 1.0)
                if share <= 0.0:
                    continue
                # the outer part of a cut piece has its middle further out
                shift = 0.5 * (1.0 - share) * (edges[n + 1] - edges[n])
                root = p[HUB_RADIUS]
                arm = r + Vec(0.0, 0.0, shift) - station_place(nodes, motion, root, root + stations[i], b, n_nodes)
                put3(out, S_FORCE, b, i, vec3(out, S_FORCE, b, i) + share * F)
                put3(out, S_MOMENT, b, i, vec3(out, S_MOMENT, b, i) + share * (M + cross(arm, F)))


@kernel
def station_place(nodes: Float, motion: Float, root: float, z: float, b: int, n_nodes: int) -> Vec:
    """Deflected place of a station at ``z`` [m] from the apex, linear between root, nodes and beyond the last."""
    first = nodes[NODE_POSITION + 2, b, 0]
    if z < first:
        w = (z - root) / (first - root)
        return Vec(0.0, 0.0, (1.0 - w) * root) + w * vec3(motion, ex.POSITION, b, 0)
    n = 0
    for i in range(1, n_nodes - 1):
        if z >= nodes[NODE_POSITION + 2, b, i]:
            n = i
    z0, z1 = nodes[NODE_POSITION + 2, b, n], nodes[NODE_POSITION + 2, b, n + 1]
    w = (z - z0) / (z1 - z0)
    return (1.0 - w) * vec3(motion, ex.POSITION, b, n) + w * vec3(motion, ex.POSITION, b, n + 1)
