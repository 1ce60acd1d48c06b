"""Geometrically exact blades: finite rotations of cells that deform a little, each in its frame.

The cell between two nodes deforms by the modes, linear in their coordinates: its end turns by d = sum q_k psi_k against
its beginning and is at e = e_0 + sum q_k phi_k. The frames of the cells are composed without approximation:

    r_n = r_{n-1} + R_{n-1} e_n,   R_n = R_{n-1} exp(d_n)

Velocities, accelerations and partial velocities are sums over the cells from the root, too. Stiffness and damping are
those of the modes.

Reference: docs/theory/structure.md (S-60 to S-66); Su & Cesnik (2011), Int. J. Solids Struct. 48, 2349.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from meltemi.compiler import Rotations, Single, Table, Vectors, kernel, last, running, xyz
from meltemi.compiler import rotation as matrix
from meltemi.maths.rotations import angular_acceleration, rotation, rotation_vector, tangent
from meltemi.maths.vectors import Rot, Vec, cross
from meltemi.simulation import system
from meltemi.structure.blades import blade_motion, tip_deflection
from meltemi.structure.members import ModalMember, NodeLayout
from meltemi.structure.tables import SectionLoads
from meltemi.turbine.definition import Turbine
from meltemi.turbine.exchange import BladeMotion


class CellShape(Table, axes="mode blade node", outer=1):
    """Deformation of the cells by the modes; a cell ends at its node."""

    displacement: Vectors = xyz("-", "displacement of the end, axes of the beginning")
    rotation: Vectors = xyz("rad/m", "rotation of the end from the beginning")


class Cell(Table, axes="blade node"):
    """Cells and their present motion."""

    span: Vectors = xyz("m", "vector from beginning to end, undeformed")
    bend: Vectors = xyz("rad", "rotation vector of the end from the beginning, axes of the beginning")
    turn: Rotations = matrix("-", "orientation of the end from the beginning")
    begin: Rotations = matrix("-", "orientation of the beginning from the undeformed one, blade axes")
    tangent: Rotations = matrix("-", "angular velocity by the rate of ``bend``, blade axes")
    arm: Vectors = xyz("m", "vector from beginning to end, blade axes")


class TipCell(Table, axes="mode"):
    """Cell from the last node to the tip: in row 0 its span, then its deformation by the modes."""

    displacement: Vectors = xyz("m or -", "displacement of the tip relative to the node, axes of the node")
    rotation: Vectors = xyz("rad/m", "rotation of the tip relative to the node")


class System(system.System):
    """A turbine with such blades."""

    cell: Cell
    cell_shape: CellShape
    cell_alone: Single[Cell]
    motion_alone: Single[BladeMotion]
    tip_cell: TipCell

    SAME = {"cell_alone": "cell", "motion_alone": "motion"}  # noqa: RUF012


def arrays(turbine: Turbine, blade: ModalMember, layout: NodeLayout) -> dict[str, NDArray[np.float64]]:
    """Cells, and the arrays that the kernels fill.

    Args:
      turbine: description of the turbine.
      blade: a blade of the turbine with its modes.
      layout: nodes of a blade.
    """
    B, K, N = turbine.n_blades, len(blade.names), len(layout.position)
    z = np.concatenate([[0.0], layout.position, blade.beam.position[-1:]])
    points = blade.beam.at(z, "axis")
    span = np.diff(points, axis=0)
    shape = blade.modes.at(z)  # (k, cells + 1, 6)
    change = np.diff(shape, axis=1)
    change[:, :, :3] -= np.cross(shape[:, :-1, 3:], span)
    span[0] = points[1]  # from the pitch axis: the beam's axis may begin beside it
    cell = Cell.zeros(blade=B, node=N)
    cell[Cell.index("span_x") : Cell.index("span_z") + 1] = span[:N].T[:, None]
    tip = np.zeros((6, K + 1))
    tip[:3, 0], tip[:, 1:] = span[N], change[:, N].T
    of_nodes = change[:, :N].transpose(0, 2, 1).reshape(6 * K, 1, N)
    return {"cell": cell, "cell_shape": np.repeat(of_nodes, B, axis=1), "tip_cell": tip}


@kernel
def deform(m: System, first: int, b: int) -> None:
    """Rotation of the cells of a blade; ``first`` is the index of its first coordinate in q (S-60)."""
    cell, shape = m.cell, m.cell_shape
    for n in range(cell.nodes):
        d = Vec(0.0, 0.0, 0.0)
        for k in range(shape.modes):
            d += m.q[first + k] * shape.rotation[k, b, n]
        cell.bend[b, n] = d
        cell.turn[b, n] = rotation(d)


@kernel
def orient(m: System, b: int) -> None:
    """Orientation of the sections of a blade, from root to tip, node by node (S-61)."""
    cell, orientation = m.cell_alone, m.motion_alone.orientation
    R = Rot(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)
    for n in range(cell.nodes):
        cell.begin[b, n] = R
        R = R @ cell.turn[b, n]
        orientation[b, n] = R


@kernel
def move(m: System, first: int, b: int) -> None:
    """Position, velocity and known acceleration of the nodes of a blade: sums over the cells (S-61 to S-64)."""
    cell, shape, frame, motion = m.cell, m.cell_shape, m.frame, m.motion
    w, w_rate = frame.spin[b], frame.spin_rate[b]
    r = Vec(0.0, 0.0, m.structure.hub_radius)
    velocity = frame.velocity[b] + cross(w, r)
    acceleration = frame.acceleration[b] + (cross(w_rate, r) + cross(w, cross(w, r)))
    for n in range(motion.nodes):
        R, d = cell.begin[b, n], cell.bend[b, n]
        e, d_rate, e_rate = cell.span[b, n], Vec(0.0, 0.0, 0.0), Vec(0.0, 0.0, 0.0)
        for k in range(shape.modes):
            e += m.q[first + k] * shape.displacement[k, b, n]
            e_rate += m.v[first + k] * shape.displacement[k, b, n]
            d_rate += m.v[first + k] * shape.rotation[k, b, n]
        T = R @ tangent(d)
        arm, sliding, turning = R @ e, R @ e_rate, T @ d_rate
        cell.arm[b, n] = arm
        cell.tangent[b, n] = T
        spin = w + running(turning)
        before = spin - turning
        gain = cross(before, turning) + R @ angular_acceleration(d, d_rate)
        spin_rate = w_rate + running(gain)
        swing = cross(before, arm)
        motion.position[b, n] = r + running(arm)
        motion.velocity[b, n] = velocity + running(swing + sliding)
        pull = cross(spin_rate - gain, arm) + cross(before, swing + 2.0 * sliding)
        motion.acceleration[b, n] = acceleration + running(pull)
        motion.spin[b, n] = spin
        motion.spin_rate[b, n] = spin_rate
        r, velocity = last(motion.position[b, n]), last(motion.velocity[b, n])
        acceleration = last(motion.acceleration[b, n])
        w, w_rate = last(spin), last(spin_rate)


@kernel
def partial_velocities(m: System, b: int) -> None:
    """Partial velocities of the nodes of a blade, relative to its root (S-65)."""
    cell, shape, partial = m.cell, m.cell_shape, m.partial
    for k in range(shape.modes):
        W, T = Vec(0.0, 0.0, 0.0), Vec(0.0, 0.0, 0.0)
        for n in range(cell.nodes):
            turning = cell.tangent[b, n] @ shape.rotation[k, b, n]
            spin = W + running(turning)
            swing = cross(spin - turning, cell.arm[b, n]) + cell.begin[b, n] @ shape.displacement[k, b, n]
            velocity = T + running(swing)
            partial.rotation[k, b, n] = spin
            partial.velocity[k, b, n] = velocity
            W, T = last(spin), last(velocity)


@blade_motion.variant
@kernel
def exact_motion(m: System) -> None:
    """Motion of all blade nodes."""
    for b in range(m.frame.blades):
        first = m.columns.coordinates + m.shape.modes * b
        deform(m, first, b)
        orient(m, b)
        move(m, first, b)
        partial_velocities(m, b)


@tip_deflection.variant
@kernel
def exact_tip(m: System, s: SectionLoads, b: int) -> tuple[Vec, Vec]:
    """Deflection and rotation of the tip (S-66)."""
    first, end, motion = m.columns.coordinates + m.shape.modes * b, m.motion_alone.nodes - 1, m.motion_alone
    e, d = m.tip_cell.displacement[0], Vec(0.0, 0.0, 0.0)
    for k in range(m.shape.modes):
        e += m.q[first + k] * m.tip_cell.displacement[k + 1]
        d += m.q[first + k] * m.tip_cell.rotation[k + 1]
    R = motion.orientation[b, end]
    return motion.position[b, end] + R @ e - m.structure.tip, rotation_vector(R @ rotation(d))
