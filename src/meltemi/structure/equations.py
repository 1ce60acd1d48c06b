"""Coordinates of the bodies, and what bodies add to the equations of motion.

Coordinates q are, in this order, those of the tower and of what it stands on, yaw, generator azimuth (referred to the
low-speed shaft), drivetrain torsion (rotor minus generator), then the modes of each blade. Velocities v = dq/dt.

Every velocity is linear in v: velocity = sum_j (partial velocity)_j v_j; every acceleration is
sum_j (partial velocity)_j dv_j/dt plus a known part that depends on q and v alone. Partial velocities of the rotor
apex are the columns T_j (linear) and W_j (angular) of ``columns``.

Reference: docs/theory/structure.md (S-10, S-25 to S-27, S-35); docs/theory/simulation.md (M-43); Kane & Levinson
(1985), chapters 2, 4 and 6.
"""

from __future__ import annotations

from meltemi.compiler import kernel
from meltemi.maths.vectors import Sym, Vec, cross, dot
from meltemi.structure.tables import Coordinates, Structure

YAW, GENERATOR, TORSION = 0, 1, 2
"""Offsets of these coordinates after those of the tower."""
N_SHAFT = 3
"""Number of these coordinates."""


@kernel
def yaw_row(m: Coordinates) -> int:
    """Index of the yaw in the coordinates, which is the number of those below it."""
    return m.columns.coordinates - N_SHAFT + YAW


@kernel
def generator_row(m: Coordinates) -> int:
    """Index of the generator azimuth in the coordinates."""
    return m.columns.coordinates - N_SHAFT + GENERATOR


@kernel
def torsion_row(m: Coordinates) -> int:
    """Index of the drivetrain torsion in the coordinates."""
    return m.columns.coordinates - N_SHAFT + TORSION


@kernel
def blade_row(m: Structure, b: int) -> int:
    """Index of the first coordinate of a blade."""
    return m.columns.coordinates + m.shape.modes * b


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
def resistance(dt: float, m: Structure, i: int, j: int, stiffness: float, damping: float) -> float:
    """Added mass of a stiffness and a damping between two coordinates (M-43); zero unless both are implicit."""
    w = m.weights
    if w.position[i] <= 0.0 or w.position[j] <= 0.0:
        return 0.0 * stiffness
    position, lag = 0.5 * (w.position[i] + w.position[j]), 0.5 * (w.lag[i] + w.lag[j])
    return position * stiffness + (0.5 * dt - lag) * damping


@kernel
def add_core(added: float, m: Structure, i: int, j: int) -> None:
    """Add to row ``i`` and column ``j`` of the core equations, with the expected acceleration on the other side."""
    if j <= i:
        m.core_mass[i, j] += added
    m.core_force[i] += added * m.weights.expected[j]


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
