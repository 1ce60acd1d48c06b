"""The nacelle, which yaws on the tower top: motion, equations with those of the yaw bearing, and loads.

Reference: docs/theory/structure.md (S-15, S-36, S-40, S-44).
"""

from __future__ import annotations

from meltemi.compiler import kernel
from meltemi.maths.vectors import Sym, Vec, about_y, about_z, cross, turn
from meltemi.structure.equations import add_body, add_core, angular_acceleration, inertia_about, resistance, yaw_row
from meltemi.structure.shaft import generator_moment
from meltemi.structure.tables import SectionLoads, Structure


@kernel
def nacelle_motion(m: Structure) -> None:
    """Motion of the nacelle about the tower top's z axis, and the column of the yaw about the tower top (S-15)."""
    machine, yaw = m.machine, yaw_row(m)
    R_it, w_t = machine.top, machine.top_spin
    axis, rate = Vec(R_it.xz, R_it.yz, R_it.zz), m.v[yaw]
    machine.nacelle = R_it @ about_z(m.q[yaw])
    machine.nacelle_spin = w_t + rate * axis
    machine.nacelle_spin_rate = machine.top_spin_rate + rate * cross(w_t, axis)
    m.columns.linear[yaw] = Vec(0.0, 0.0, 0.0)
    m.columns.angular[yaw] = axis


@kernel
def nacelle_equations(m: Structure, gravity: Vec) -> None:
    """Add the nacelle, whose columns are those of the rotor apex moved to the tower top (S-36)."""
    p, machine = m.structure, m.machine
    R = machine.nacelle
    d = machine.top_position - machine.hub_position
    mass, c, principal = p.nacelle_mass, R @ p.nacelle_centre, p.nacelle_inertia
    J0 = turn(R, Sym(principal.x, principal.y, principal.z, 0.0, 0.0, 0.0))
    w, known = machine.nacelle_spin, machine.nacelle_spin_rate
    a = machine.top_acceleration + (cross(known, c) + cross(w, cross(w, c)))
    G = mass * (gravity - a)
    N = cross(c, G) - (J0 @ known + cross(w, J0 @ w))
    # about the rotor apex, the point of the columns
    r = d + c
    J = inertia_about(J0, mass, Vec(0.0, 0.0, 0.0), r)
    add_body(m, yaw_row(m) + 1, mass, mass * r, J, G, N + cross(d, G))


@kernel
def yaw_bearing(m: Structure) -> None:
    """Add the yaw bearing: drive and brake in series with spring and damper, and friction in series with the same
    (S-40)."""
    p, drive, y = m.structure, m.drive, yaw_row(m)
    twist, twist_rate = m.q[y] - drive.yaw_command, m.v[y] - drive.yaw_command_rate
    brake_moment = drive.yaw_held * (p.yaw_stiffness * twist + p.yaw_damping * twist_rate)
    m.core_force[y] -= brake_moment
    drive.yaw_drive_torque = -brake_moment
    if drive.yaw_rubs > 0.0:
        twist, twist_rate = m.q[y] - drive.yaw_rest, m.v[y] - drive.yaw_rest_rate
        rubbed = p.yaw_stiffness * twist + p.yaw_damping * twist_rate
        m.core_force[y] -= rubbed
        drive.yaw_friction_torque = -rubbed
    else:
        drive.yaw_friction_torque = 0.0


@kernel
def yaw_implicit(dt: float, m: Structure) -> None:
    """Complete the equations of a step for an implicit yaw (M-43)."""
    p, y, locked = m.structure, yaw_row(m), m.drive.yaw_held
    if m.drive.yaw_rubs > 0.0:
        locked += 1.0
    add_core(resistance(dt, m, y, y, locked * p.yaw_stiffness, locked * p.yaw_damping), m, y, y)


@kernel
def nacelle_loads(m: Structure, s: SectionLoads) -> None:
    """Loads at the yaw bearing (S-44), from those of the rotor; ``apex`` becomes them, in inertial axes."""
    p, machine, columns, out, yaw = m.structure, m.machine, m.columns, s.chain, yaw_row(m)
    gravity = Vec(0.0, 0.0, -p.gravity)
    R_in, R_it, w_n = machine.nacelle, machine.top, machine.nacelle_spin
    nacelle_rate = machine.nacelle_spin_rate + angular_acceleration(m, yaw + 1)
    arm = machine.hub_position - machine.top_position
    top = machine.top_acceleration
    for k in range(yaw):
        top += m.a[k] * (columns.linear[k] - cross(columns.angular[k], arm))
    d, principal = R_in @ p.nacelle_centre, p.nacelle_inertia
    J = turn(R_in, Sym(principal.x, principal.y, principal.z, 0.0, 0.0, 0.0))
    centre = top + (cross(nacelle_rate, d) + cross(w_n, cross(w_n, d)))
    F_n = p.nacelle_mass * (gravity - centre)
    M_n = cross(d, F_n) - (J @ nacelle_rate + cross(w_n, J @ w_n))
    F, M = s.apex.force, s.apex.moment
    F_o = F + F_n
    M_o = M + cross(arm, F) + (M_n + generator_moment(m, s, nacelle_rate))
    out.yaw_force = R_it.T @ F_o
    out.yaw_moment = R_it.T @ M_o
    out.nacelle_force = R_in.T @ F_o
    out.nacelle_moment = R_in.T @ M_o
    out.top_acceleration = R_it.T @ top
    out.nacelle_turning = (R_in @ about_y(p.tilt)).T @ nacelle_rate
    s.apex.force = F_o
    s.apex.moment = M_o
