"""Gearbox between rotor and generator: equations, time step and loads of its parts.

Every part turns at a speed that is linear in the nacelle's spin along the shaft, the speed of the generator, the rate
of the torsion, and the rates of the gearbox's modes with rotor and generator held. So all inertia is in one symmetric
matrix (``gears`` of table STRUCTURE), and each mode couples by three numbers.

Reference: docs/theory/structure.md (S-49 to S-58); docs/theory/simulation.md (M-31 to M-34).
"""

from __future__ import annotations

from math import exp, sqrt

from numpy import float64
from numpy.typing import NDArray

from meltemi.core.kernel import kernel
from meltemi.maths.access import sym1, vec1, vec2
from meltemi.maths.vectors import Sym, Vec, cross, dot
from meltemi.structure.kinematics import GENERATOR, TORSION
from meltemi.structure.tables import GearLoads, GearModes, GearRows, Gears, StructureParameters
from meltemi.turbine import exchange as ex

Float = NDArray[float64]

(INERTIA,) = StructureParameters.slots("gears")
SHAFT_STIFFNESS, SHAFT_DAMPING = StructureParameters.slots("shaft_stiffness shaft_damping")
FREQUENCY, DAMPING, MODAL_INERTIA, COUPLING = GearModes.slots("frequency damping inertia coupling")
ANGLE, RATE, ACCELERATION = Gears.slots("angle rate acceleration")
FACTOR, ROW_INERTIA = GearRows.slots("factor inertia")
(LOAD,) = GearLoads.slots("load")


@kernel
def implicit_step(x: float, z: float) -> tuple[float, float]:
    """Newmark's beta and gamma of a mode, so that a free vibration decays as it should (M-32).

    Args:
      x: angular frequency times time step, greater than 0.
      z: damping ratio, up to 0.3.
    """
    left = 1.0 - exp(-2.0 * z * x)
    a = 0.25 * left * x * x
    b = left * (2.0 * z * x + 0.5 * x * x) - x * x
    c = left * (1.0 + z * x + 0.25 * x * x) - 2.0 * z * x
    d = b * b - 4.0 * a * c
    # decay that no step of this kind has: the fastest
    more = 2.0 * c / (sqrt(d) - b) if d > 0.0 else -0.5 * b / a
    more = min(max(more, 0.0), 1.0)
    return 0.25 * (1.0 + more) * (1.0 + more), 0.5 + more


@kernel
def mode_resistance(dt: float, w: float, z: float) -> float:
    """What a mode's acceleration at the end of an implicit step is divided by (M-33); 1 without a step."""
    if dt <= 0.0:
        return 1.0 + 0.0 * w
    beta, gamma = implicit_step(w * dt, z)
    return 1.0 + w * dt * (2.0 * z * gamma + w * dt * beta)


@kernel
def restoring(gear_modes: Float, gears: Float, k: int) -> float:
    """[rad/s^2] acceleration of a mode from its own spring and damper."""
    w, z = gear_modes[FREQUENCY, k], gear_modes[DAMPING, k]
    return -w * (2.0 * z * gears[RATE, k] + w * gears[ANGLE, k])


@kernel
def gear_momentum(p: Float, gear_modes: Float, gears: Float, spins: Vec, spin_rates: Vec) -> tuple[float, float]:
    """Angular momentum of the gears about the shaft [kg m^2/s] and its rate (S-55).

    Args:
      spins, spin_rates: of the nacelle along the shaft, the generator seen from the rotor, the torsion.
    """
    J = sym1(p, INERTIA)
    momentum, turning = (J @ spins).x, (J @ spin_rates).x
    for k in range(gear_modes.shape[1]):
        momentum += gear_modes[COUPLING, k] * gears[RATE, k]
        turning += gear_modes[COUPLING, k] * gears[ACCELERATION, k]
    return momentum, turning


@kernel
def gear_equations(
    dt: float,
    n_tower: int,
    v: Float,
    p: Float,
    gear_modes: Float,
    gears: Float,
    columns: Float,
    machine: Float,
    core_mass: Float,
    core_force: Float,
) -> None:
    """Add the gears to the equations of the core, their modes eliminated (S-55, S-56; M-33).

    Args:
      dt: [s] of the implicit step at whose end the modes' acceleration is wanted; 0 for the present state.
    """
    if p[INERTIA + 1] <= 0.0:
        return
    g, t = n_tower + GENERATOR, n_tower + TORSION
    shaft, w_n = vec1(machine, ex.SHAFT), vec1(machine, ex.NACELLE_SPIN)
    J = sym1(p, INERTIA)
    known = Vec(dot(vec1(machine, ex.NACELLE_SPIN_RATE), shaft), 0.0 * v[g], 0.0 * v[g])
    momentum = (J @ Vec(dot(w_n, shaft), v[g], v[t])).x
    F = Vec(0.0 * v[g], 0.0 * v[g], 0.0 * v[g])
    for k in range(gear_modes.shape[1]):
        P, m = vec2(gear_modes, COUPLING, k), gear_modes[MODAL_INERTIA, k]
        share = 1.0 / mode_resistance(dt, gear_modes[FREQUENCY, k], gear_modes[DAMPING, k])
        momentum += P.x * gears[RATE, k]
        F -= share * restoring(gear_modes, gears, k) * P
        s = share / m
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
    for i in range(n_tower + 1):
        W = vec2(columns, 3, i)
        along = dot(W, shaft)
        core_force[i] += along * F.x - momentum * dot(W, whirl)
        core_mass[g, i] += J.xy * along
        core_mass[t, i] += J.xz * along
        for j in range(i + 1):
            core_mass[i, j] += J.xx * along * dot(vec2(columns, 3, j), shaft)
    core_force[g] += F.y
    core_force[t] += F.z
    core_mass[g, g] += J.yy
    core_mass[t, g] += J.yz
    core_mass[t, t] += J.zz


@kernel
def gear_accelerations(
    dt: float, n_tower: int, a: Float, gear_modes: Float, gears: Float, columns: Float, machine: Float
) -> None:
    """Accelerations of the modes, when those of the core are known (S-56; M-33)."""
    shaft = vec1(machine, ex.SHAFT)
    turning = dot(vec1(machine, ex.NACELLE_SPIN_RATE), shaft)
    for i in range(n_tower + 1):
        turning += a[i] * dot(vec2(columns, 3, i), shaft)
    rates = Vec(turning, a[n_tower + GENERATOR], a[n_tower + TORSION])
    for k in range(gear_modes.shape[1]):
        push = dot(vec2(gear_modes, COUPLING, k), rates) / gear_modes[MODAL_INERTIA, k]
        resistance = mode_resistance(dt, gear_modes[FREQUENCY, k], gear_modes[DAMPING, k])
        gears[ACCELERATION, k] = (restoring(gear_modes, gears, k) - push) / resistance


@kernel
def gear_begin(dt: float, gear_modes: Float, gears: Float) -> None:
    """Predict the modes at the end of a step (M-31)."""
    for k in range(gear_modes.shape[1]):
        beta, gamma = implicit_step(gear_modes[FREQUENCY, k] * dt, gear_modes[DAMPING, k])
        acceleration = gears[ACCELERATION, k]
        gears[ANGLE, k] += dt * (gears[RATE, k] + (0.5 - beta) * dt * acceleration)
        gears[RATE, k] += (1.0 - gamma) * dt * acceleration


@kernel
def gear_end(dt: float, gear_modes: Float, gears: Float) -> None:
    """Complete the step of the modes with their accelerations at its end (M-31)."""
    for k in range(gear_modes.shape[1]):
        beta, gamma = implicit_step(gear_modes[FREQUENCY, k] * dt, gear_modes[DAMPING, k])
        acceleration = gears[ACCELERATION, k]
        gears[ANGLE, k] += beta * dt * dt * acceleration
        gears[RATE, k] += gamma * dt * acceleration


@kernel
def gear_loads(
    twist: float,
    twist_rate: float,
    spin_rates: Vec,
    p: Float,
    gear_modes: Float,
    gears: Float,
    rows: Float,
    shape: Float,
    out: Float,
) -> None:
    """Torques of shafts and forces of meshes (S-57).

    Args:
      twist, twist_rate: torsion of the drivetrain [rad] and its rate.
      spin_rates: accelerations of nacelle's spin along the shaft, generator and torsion [rad/s^2].
    """
    static = p[SHAFT_STIFFNESS] * twist + p[SHAFT_DAMPING] * twist_rate
    for e in range(out.shape[1]):
        load = rows[FACTOR, e] * static + dot(vec2(rows, ROW_INERTIA, e), spin_rates)
        for k in range(gear_modes.shape[1]):
            w, z = gear_modes[FREQUENCY, k], gear_modes[DAMPING, k]
            load += shape[e, k] * (gears[ANGLE, k] + 2.0 * z / w * gears[RATE, k])
        out[LOAD, e] = load
