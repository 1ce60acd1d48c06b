"""The shaft with hub, generator and brake: motion of the rotor apex, equations, and loads.

Reference: docs/theory/structure.md (S-16 to S-18, S-35, S-37 to S-39, S-43).
"""

from __future__ import annotations

from math import cos, sin, tanh

from meltemi.compiler import kernel
from meltemi.maths.vectors import Sym, Vec, about_x, about_y, cross, dot, turn
from meltemi.structure.equations import (
    add_body,
    add_core,
    angular_acceleration,
    apex_acceleration,
    generator_row,
    inertia_about,
    resistance,
    torsion_row,
    yaw_row,
)
from meltemi.structure.gears import gear_loads, gear_momentum
from meltemi.structure.tables import SectionLoads, Structure


@kernel
def hub_motion(m: Structure) -> None:
    """Motion of shaft and rotor apex; all columns are moved from the tower top to the apex (S-16 to S-18)."""
    v, p, machine, columns = m.v, m.structure, m.machine, m.columns
    R_in, w_n, b_n = machine.nacelle, machine.nacelle_spin, machine.nacelle_spin_rate
    generator, torsion = generator_row(m), torsion_row(m)
    # shaft: its x axis points downwind; with positive tilt the upwind end is up
    shaft = R_in @ Vec(cos(p.tilt), 0.0, -sin(p.tilt))
    speed = v[generator] + v[torsion]
    # rotor apex H, at d from the tower top
    d = p.shaft_height * columns.angular[yaw_row(m)] - p.overhang * shaft
    turning = cross(w_n, d)
    machine.hub_position = machine.top_position + d
    machine.hub_velocity = machine.top_velocity + turning
    machine.hub_acceleration = machine.top_acceleration + (cross(b_n, d) + cross(w_n, turning))
    machine.shaft = shaft
    machine.rotor_spin = w_n + speed * shaft
    machine.rotor_spin_rate = b_n + speed * cross(w_n, shaft)
    machine.azimuth = m.q[generator] + m.q[torsion]
    machine.rotor_speed = speed
    for k in range(generator):
        columns.linear[k] += cross(columns.angular[k], d)
    for k in range(generator, torsion + 1):
        columns.linear[k] = Vec(0.0, 0.0, 0.0)
        columns.angular[k] = shaft


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
def drivetrain(m: Structure) -> None:
    """Add generator, shaft and brake (S-37 to S-39)."""
    v, p, machine, drive = m.v, m.structure, m.machine, m.drive
    yaw, g, t = yaw_row(m), generator_row(m), torsion_row(m)
    ratio, Jg = p.gear_ratio, p.generator_inertia
    turns = p.generator_sense * ratio
    shaft, w_n = machine.shaft, machine.nacelle_spin
    # the generator moves with the nacelle and, about the shaft, with the gear ratio times the low-speed end
    spin = dot(w_n, shaft) + turns * v[g]
    known = Jg * dot(machine.nacelle_spin_rate, shaft) * shaft + Jg * spin * cross(w_n, shaft)
    for i in range(yaw + 1):
        W = m.columns.angular[i]
        along = dot(W, shaft)
        m.core_force[i] -= dot(W, known)
        m.core_mass[g, i] += Jg * turns * along
        for j in range(i + 1):
            m.core_mass[i, j] += Jg * along * dot(m.columns.angular[j], shaft)
    m.core_mass[g, g] += Jg * ratio * ratio / p.gearbox_efficiency
    brake = drive.brake_torque * tanh(ratio * v[g] / drive.brake_speed)
    high_speed_torque = drive.generator_torque + brake
    # the rotor drives the gearbox, whose losses reduce the torque; a motoring generator covers them itself
    high_speed_torque = (
        high_speed_torque / p.gearbox_efficiency
        if high_speed_torque >= 0.0
        else high_speed_torque * p.gearbox_efficiency
    )
    m.core_force[g] -= ratio * high_speed_torque + turns * dot(shaft, known)
    m.core_force[t] -= p.shaft_stiffness * m.q[t] + p.shaft_damping * v[t]


@kernel
def torsion_implicit(dt: float, m: Structure) -> None:
    """Complete the equations of a step for an implicit torsion (M-43)."""
    p, t = m.structure, torsion_row(m)
    add_core(resistance(dt, m, t, t, p.shaft_stiffness, p.shaft_damping), m, t, t)


@kernel
def hub_loads(m: Structure, s: SectionLoads) -> None:
    """Loads of the rotor on the shaft at the apex (S-43); ``apex`` becomes them, in inertial axes."""
    p, machine, out = m.structure, m.machine, s.chain
    shaft, w_n, w_r = machine.shaft, machine.nacelle_spin, machine.rotor_spin
    rotor_rate = machine.rotor_spin_rate + angular_acceleration(m, m.columns.coordinates)
    hub_acceleration = machine.hub_acceleration + apex_acceleration(m)
    c = p.hub_centre * shaft
    centre = hub_acceleration + (cross(rotor_rate, c) + cross(w_r, cross(w_r, c)))
    F_hub = p.hub_mass * (Vec(0.0, 0.0, -p.gravity) - centre)
    spin = dot(rotor_rate, shaft) * shaft + dot(w_r, shaft) * cross(w_n, shaft)
    F = s.apex.force + F_hub
    M = s.apex.moment + (cross(c, F_hub) - p.hub_inertia * spin)
    R_is = machine.nacelle @ about_y(p.tilt)
    R_ia = R_is @ about_x(machine.azimuth)
    out.apex_force = R_is.T @ F
    out.apex_moment = R_is.T @ M
    out.rotating_force = R_ia.T @ F
    out.rotating_moment = R_ia.T @ M
    out.rotor_acceleration = m.a[generator_row(m)] + m.a[torsion_row(m)]
    s.apex.force = F
    s.apex.moment = M


@kernel
def generator_moment(m: Structure, s: SectionLoads, nacelle_rate: Vec) -> Vec:
    """Moment [N m] of the inertia of generator and gears on the nacelle, inertial axes; loads in the gearbox (S-57).

    Args:
      nacelle_rate: [rad/s^2] angular acceleration of the nacelle.
    """
    v, a, p, shaft, w_n = m.v, m.a, m.structure, m.machine.shaft, m.machine.nacelle_spin
    turns, Jg = p.generator_sense * p.gear_ratio, p.generator_inertia
    g, t = generator_row(m), torsion_row(m)
    spin_rates = Vec(dot(nacelle_rate, shaft), a[g], a[t])
    turning = spin_rates.x + turns * a[g]
    momentum = dot(w_n, shaft) + turns * v[g]
    M = -Jg * (turning * shaft + momentum * cross(w_n, shaft))
    if s.gear_loads.parts > 0:
        spins = Vec(dot(w_n, shaft), v[g], v[t])
        momentum, turning = gear_momentum(m, spins, spin_rates)
        M -= turning * shaft + momentum * cross(w_n, shaft)
        gear_loads(m, s, m.q[t], v[t], spin_rates)
    return M
