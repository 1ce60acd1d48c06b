"""Implicit time step of stiff coordinates: their stiffness and damping act with the motion at the end of the step.

Reference: docs/theory/simulation.md (M-41 to M-45).
"""

from __future__ import annotations

from meltemi.compiler import kernel
from meltemi.structure.dynamics import DAMPING, STIFFNESS, WEIGHT
from meltemi.structure.kinematics import TORSION, YAW
from meltemi.structure.tables import Structure


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
def implicit_terms(dt: float, m: Structure) -> None:
    """Complete the assembled equations of a step for the coordinates with implicit stiffness and damping (M-43)."""
    n_tower, matrix, p, drive = m.top_shape.modes, m.tower_matrix, m.structure, m.drive
    for i in range(n_tower):
        for j in range(n_tower):
            stiffness = matrix[STIFFNESS, i, j] + p.gravity * matrix[WEIGHT, i, j]
            add_core(resistance(dt, m, i, j, stiffness, matrix[DAMPING, i, j]), m, i, j)
    y, t, held = n_tower + YAW, n_tower + TORSION, drive.yaw_held
    if drive.yaw_rubs > 0.0:
        held += 1.0
    add_core(resistance(dt, m, y, y, held * p.yaw_stiffness, held * p.yaw_damping), m, y, y)
    add_core(resistance(dt, m, t, t, p.shaft_stiffness, p.shaft_damping), m, t, t)
    for b in range(m.link.blades):
        first = m.columns.coordinates + m.link.modes * b
        for k in range(m.link.modes):
            for j in range(m.link.modes):
                added = resistance(dt, m, first + k, first + j, m.modal[0, b, k, j], m.modal[1, b, k, j])
                if j <= k:
                    m.arm_mass[b, k, j] += added
                m.arm_force[b, k] += added * m.weights.expected[first + j]
