"""Geometrically exact blades: finite rotations of cells that deform a little, each in its own frame.

The deformation of the cell between two nodes, its rotation d and the displacement e of its end, is that of the modes,
linear in their coordinates; the frames of the cells are composed without approximation:

    r_n = r_{n-1} + R_{n-1} (r0_n - r0_{n-1} + sum_k q_k e_k),   R_n = R_{n-1} exp(sum_k q_k d_k)

Positions, velocities, accelerations and partial velocities follow by the same recursion from root to tip. Stiffness and
damping are those of the modes.

Reference: docs/theory/structure.md (S-24a to S-24f).
"""

from __future__ import annotations

from math import asin, sqrt

import numpy as np
from numpy.typing import NDArray

from meltemi.core.kernel import kernel
from meltemi.maths.records import Single
from meltemi.maths.tables import Rotations, Symmetrics, Table, Vectors, rotation, symmetric, xyz
from meltemi.maths.vectors import Rot, Sym, Vec, cross, dot, rotation_vector, turn
from meltemi.simulation import system
from meltemi.structure.kinematics import angular_velocity, blade_motion, node_inertia, partial_rotation
from meltemi.structure.members import Member, NodeLayout
from meltemi.structure.section_loads import tip_deflection
from meltemi.structure.tables import BladeNode, BladePartial, SectionLoads
from meltemi.turbine.definition import Turbine
from meltemi.turbine.exchange import BladeMotion


class CellShape(Table, axes="mode blade node", outer=1):
    """Deformation of the cells by the modes; the last cell ends at the tip."""

    displacement: Vectors = xyz("-", "displacement of the end, axes of the cell's beginning")
    rotation: Vectors = xyz("rad/m", "rotation of the end relative to the beginning")


class Cell(Table, axes="blade node"):
    """Undeformed cells."""

    span: Vectors = xyz("m", "from its beginning to its end, blade axes")


class NodeInertia(Table, axes="blade node"):
    """Inertia of the nodes in their present orientation, blade axes."""

    moment: Vectors = xyz("kg m", "first moment about the node")
    inertia: Symmetrics = symmetric("kg m^2", "inertia about the node")


class SectionPartial(Table, axes="mode blade node", outer=1):
    """Partial angular velocities of the nodes."""

    rotation: Vectors = xyz("rad/m", "partial angular velocity by the mode, blade axes")


class LastNode(Table, axes="blade"):
    """The outermost node of each blade, from which the tip is found."""

    orientation: Rotations = rotation("-", "orientation of its section, from the undeflected one")


class System(system.System):
    """A turbine with such blades."""

    cell: Single[Cell]
    cell_shape: Single[CellShape]
    inertia: NodeInertia
    section_partial: SectionPartial
    last_node: LastNode
    nodes_alone: Single[BladeNode]
    motion_alone: Single[BladeMotion]
    partial_alone: Single[BladePartial]
    inertia_alone: Single[NodeInertia]
    section_partial_alone: Single[SectionPartial]

    SAME = {  # noqa: RUF012
        "nodes_alone": "blade_nodes",
        "motion_alone": "motion",
        "partial_alone": "partial",
        "inertia_alone": "inertia",
        "section_partial_alone": "section_partial",
    }


def arrays(turbine: Turbine, blade: Member, layout: NodeLayout) -> dict[str, NDArray[np.float64]]:
    """Cells and the arrays that the kernels fill.

    Args:
      turbine: its description.
      blade: one of its blades with its modes.
      layout: nodes of a blade.
    """
    B, N, modes = turbine.n_blades, len(layout.position), blade.modes
    z = np.concatenate([[0.0], layout.position, blade.beam.position[-1:]])
    span = np.diff(blade.beam.at(z, "axis"), axis=0)
    shape = np.array([[np.interp(z, modes.z, row) for row in mode.T] for mode in modes.shape])  # (k, 6, cells + 1)
    turned = np.cross(shape[:, 3:, :-1], span.T[None], axis=1)
    bent = np.concatenate([np.diff(shape[:, :3]) - turned, np.diff(shape[:, 3:])], axis=1)
    K = len(modes.shape)
    return {
        "cell": np.repeat(span.T[:, None], B, axis=1),
        "cell_shape": np.ascontiguousarray(np.repeat(bent.reshape(6 * K, 1, N + 1), B, axis=1)),
        "inertia": NodeInertia.zeros(blade=B, node=N),
        "section_partial": SectionPartial.zeros(mode=K, blade=B, node=N),
        "last_node": LastNode.zeros(blade=B),
    }


@kernel
def rotation_of(R: Rot) -> Vec:
    """Rotation vector [rad] of an orientation, for angles below 90 deg."""
    v = 0.5 * Vec(R.zy - R.yz, R.xz - R.zx, R.yx - R.xy)
    s = sqrt(dot(v, v) + 1e-300)
    return (asin(min(s, 1.0)) / s if s > 1e-6 else 1.0 + s * s / 6.0) * v


@kernel
def one_blade(m: System, first: int, b: int) -> None:
    """Motion of the nodes of one blade, from root to tip; ``first`` is the index of its first coordinate in q."""
    q, v, frame, cell, shape = m.q, m.v, m.frame, m.cell, m.cell_shape
    motion, partial, turned = m.motion_alone, m.partial_alone, m.section_partial_alone
    nothing = Vec(0.0, 0.0, 0.0)
    R = Rot(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)
    w, w_rate = frame.spin[b], frame.spin_rate[b]
    r = Vec(0.0, 0.0, m.structure.hub_radius)
    velocity = frame.velocity[b] + cross(w, r)
    acceleration = frame.acceleration[b] + (cross(w_rate, r) + cross(w, cross(w, r)))
    for n in range(motion.nodes):
        if n < cell.nodes - 1:  # beyond it are copies of the last node that pad lanes
            d, d_rate, e, e_rate = nothing, nothing, cell.span[b, n], nothing
            for k in range(shape.modes):
                d += q[first + k] * shape.rotation[k, b, n]
                d_rate += v[first + k] * shape.rotation[k, b, n]
                e += q[first + k] * shape.displacement[k, b, n]
                e_rate += v[first + k] * shape.displacement[k, b, n]
            arm, sliding = R @ e, R @ e_rate
            for k in range(shape.modes):
                T = R @ shape.displacement[k, b, n]
                W = R @ angular_velocity(d, shape.rotation[k, b, n])
                if n > 0:
                    T += partial.velocity[k, b, n - 1] + cross(turned.rotation[k, b, n - 1], arm)
                    W += turned.rotation[k, b, n - 1]
                partial.velocity[k, b, n] = T
                turned.rotation[k, b, n] = W
            turning = cross(w, arm)
            r += arm
            velocity += turning + sliding
            acceleration += cross(w_rate, arm) + cross(w, turning + 2.0 * sliding)
            spin = R @ angular_velocity(d, d_rate)
            w_rate += cross(w, spin) + R @ (1.0 / 6.0 * cross(d_rate, cross(d, d_rate)))
            w += spin
            R = R @ rotation_vector(d)
        else:
            for k in range(shape.modes):
                partial.velocity[k, b, n] = partial.velocity[k, b, n - 1]
                turned.rotation[k, b, n] = turned.rotation[k, b, n - 1]
        motion.position[b, n] = r
        motion.velocity[b, n] = velocity
        motion.acceleration[b, n] = acceleration
        motion.rotation[b, n] = rotation_of(R)
        motion.spin[b, n] = w
        motion.spin_rate[b, n] = w_rate
        m.inertia_alone.moment[b, n] = R @ m.nodes_alone.moment[b, n]
        m.inertia_alone.inertia[b, n] = turn(R, m.nodes_alone.inertia[b, n])
    m.last_node.orientation[b] = R


@blade_motion.variant
@kernel
def _(m: System) -> None:
    for b in range(m.frame.blades):
        one_blade(m, m.columns.coordinates + m.shape.modes * b, b)


@partial_rotation.variant
@kernel
def _(m: System, k: int, b: int, n: int) -> Vec:
    return m.section_partial.rotation[k, b, n]


@node_inertia.variant
@kernel
def _(m: System, b: int, n: int) -> tuple[Vec, Sym]:
    return m.inertia.moment[b, n], m.inertia.inertia[b, n]


@tip_deflection.variant
@kernel
def _(m: System, s: SectionLoads, b: int) -> tuple[Vec, Vec]:
    first, cell, shape = m.columns.coordinates + m.shape.modes * b, m.cell, m.cell_shape
    last = cell.nodes - 1
    d, e = Vec(0.0, 0.0, 0.0), cell.span[b, last]
    for k in range(shape.modes):
        d += m.q[first + k] * shape.rotation[k, b, last]
        e += m.q[first + k] * shape.displacement[k, b, last]
    R = m.last_node.orientation[b]
    tip = m.motion_alone.position[b, last - 1] + R @ e
    return tip - m.structure.tip, rotation_of(R @ rotation_vector(d))
