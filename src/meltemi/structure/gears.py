"""Gearbox between rotor and generator: equations, time step and loads of its parts.

The speed of every part is linear in the rotation of the nacelle about the shaft, the speed of the generator, the rate
of the torsion, and the rates of the gearbox's modes with rotor and generator fixed. So all inertia is in one symmetric
matrix (``gears`` of table STRUCTURE), and each mode has three coupling terms.

Reference: docs/theory/structure.md (S-49 to S-58); docs/theory/simulation.md (M-31 to M-33).
"""

from __future__ import annotations

from math import exp, sqrt

from meltemi.compiler import kernel
from meltemi.maths.vectors import Sym, Vec, cross, dot
from meltemi.structure.equations import generator_row, torsion_row, yaw_row
from meltemi.structure.tables import SectionLoads, Structure


@kernel
def implicit_step(x: float, z: float) -> tuple[float, float]:
    """Newmark's beta and gamma of a mode, such that free vibration has its exact decay (M-32).

    Args:
      x: angular frequency times time step, greater than 0.
      z: damping ratio, up to 0.3.
    """
    left = 1.0 - exp(-2.0 * z * x)
    a = 0.25 * left * x * x
    b = left * (2.0 * z * x + 0.5 * x * x) - x * x
    c = left * (1.0 + z * x + 0.25 * x * x) - 2.0 * z * x
    d = b * b - 4.0 * a * c
    # a decay that no scheme of this kind attains: the fastest attainable
    more = 2.0 * c / (sqrt(d) - b) if d > 0.0 else -0.5 * b / a
    more = min(max(more, 0.0), 1.0)
    return 0.25 * (1.0 + more) * (1.0 + more), 0.5 + more


@kernel
def mode_resistance(dt: float, w: float, z: float) -> float:
    """Divisor of a mode's acceleration at the end of an implicit step (M-33); 1 for zero time step."""
    if dt <= 0.0:
        return 1.0 + 0.0 * w
    beta, gamma = implicit_step(w * dt, z)
    return 1.0 + w * dt * (2.0 * z * gamma + w * dt * beta)


@kernel
def restoring(m: Structure, k: int) -> float:
    """[rad/s^2] acceleration of a mode by its spring and damper."""
    w, z = m.gear_modes.frequency[k], m.gear_modes.damping[k]
    return -w * (2.0 * z * m.gears.rate[k] + w * m.gears.angle[k])


@kernel
def gear_momentum(m: Structure, spins: Vec, spin_rates: Vec) -> tuple[float, float]:
    """Angular momentum of the gears about the shaft [kg m^2/s] and its rate (S-55).

    Args:
      spins, spin_rates: speeds and accelerations of the nacelle about the shaft, the generator referred to the rotor,
        the torsion.
    """
    J = m.structure.gears
    momentum, turning = (J @ spins).x, (J @ spin_rates).x
    for k in range(m.gears.modes):
        momentum += m.gear_modes.coupling[k].x * m.gears.rate[k]
        turning += m.gear_modes.coupling[k].x * m.gears.acceleration[k]
    return momentum, turning


@kernel
def gear_equations(dt: float, m: Structure) -> None:
    """Add the gears to the equations of the core, with their modes eliminated (S-55, S-56; M-33).

    Args:
      dt: [s] implicit step, at whose end the modes' accelerations are computed; 0 for the present state.
    """
    J = m.structure.gears
    if J.yy <= 0.0:
        return
    v, modes, gears, machine, columns = m.v, m.gear_modes, m.gears, m.machine, m.columns
    g, t = generator_row(m), torsion_row(m)
    shaft, w_n = machine.shaft, machine.nacelle_spin
    known = Vec(dot(machine.nacelle_spin_rate, shaft), 0.0, 0.0)
    momentum = (J @ Vec(dot(w_n, shaft), v[g], v[t])).x
    F = Vec(0.0, 0.0, 0.0)
    for k in range(modes.modes):
        P = modes.coupling[k]
        share = 1.0 / mode_resistance(dt, modes.frequency[k], modes.damping[k])
        momentum += P.x * gears.rate[k]
        F -= share * restoring(m, k) * P
        s = share / modes.inertia[k]
        J = Sym(
            J.xx - s * P.x * P.x,
            J.yy - s * P.y * P.y,
            J.zz - s * P.z * P.z,
            J.xy - s * P.x * P.y,
            J.xz - s * P.x * P.z,
            J.yz - s * P.y * P.z,
        )
    F -= J @ known
    whirl = cross(w_n, shaft)
    for i in range(yaw_row(m) + 1):
        W = columns.angular[i]
        along = dot(W, shaft)
        m.core_force[i] += along * F.x - momentum * dot(W, whirl)
        m.core_mass[g, i] += J.xy * along
        m.core_mass[t, i] += J.xz * along
        for j in range(i + 1):
            m.core_mass[i, j] += J.xx * along * dot(columns.angular[j], shaft)
    m.core_force[g] += F.y
    m.core_force[t] += F.z
    m.core_mass[g, g] += J.yy
    m.core_mass[t, g] += J.yz
    m.core_mass[t, t] += J.zz


@kernel
def gear_accelerations(dt: float, m: Structure) -> None:
    """Compute the accelerations of the modes from those of the core (S-56; M-33)."""
    modes, shaft = m.gear_modes, m.machine.shaft
    turning = dot(m.machine.nacelle_spin_rate, shaft)
    for i in range(yaw_row(m) + 1):
        turning += m.a[i] * dot(m.columns.angular[i], shaft)
    rates = Vec(turning, m.a[generator_row(m)], m.a[torsion_row(m)])
    for k in range(modes.modes):
        push = dot(modes.coupling[k], rates) / modes.inertia[k]
        resistance = mode_resistance(dt, modes.frequency[k], modes.damping[k])
        m.gears.acceleration[k] = (restoring(m, k) - push) / resistance


@kernel
def gear_begin(dt: float, m: Structure) -> None:
    """Predict the modes at the end of a step (M-31)."""
    gears = m.gears
    for k in range(gears.modes):
        beta, gamma = implicit_step(m.gear_modes.frequency[k] * dt, m.gear_modes.damping[k])
        acceleration = gears.acceleration[k]
        gears.angle[k] += dt * (gears.rate[k] + (0.5 - beta) * dt * acceleration)
        gears.rate[k] += (1.0 - gamma) * dt * acceleration


@kernel
def gear_end(dt: float, m: Structure) -> None:
    """Correct the predicted modes with their accelerations at the end of the step (M-31)."""
    gears = m.gears
    for k in range(gears.modes):
        beta, gamma = implicit_step(m.gear_modes.frequency[k] * dt, m.gear_modes.damping[k])
        acceleration = gears.acceleration[k]
        gears.angle[k] += beta * dt * dt * acceleration
        gears.rate[k] += gamma * dt * acceleration


@kernel
def gear_loads(m: Structure, s: SectionLoads, twist: float, twist_rate: float, spin_rates: Vec) -> None:
    """Torques of shafts and forces of gear meshes (S-57).

    Args:
      twist, twist_rate: torsion of the drivetrain [rad] and its rate.
      spin_rates: accelerations of nacelle rotation about the shaft, generator and torsion [rad/s^2].
    """
    static = m.structure.shaft_stiffness * twist + m.structure.shaft_damping * twist_rate
    for e in range(s.gear_loads.parts):
        load = s.gear_rows.factor[e] * static + dot(s.gear_rows.inertia[e], spin_rates)
        for k in range(m.gears.modes):
            w, z = m.gear_modes.frequency[k], m.gear_modes.damping[k]
            load += s.gear_shape[e, k] * (m.gears.angle[k] + 2.0 * z / w * m.gears.rate[k])
        s.gear_loads.load[e] = load
