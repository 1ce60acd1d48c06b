"""The hull of a flexible floating platform: its clamped joint, how loads of the water spread over it, its inertia.

Reference: docs/theory/frames.md (F-70 to F-74).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import InputError
from meltemi.frames.checks import TOLERANCE
from meltemi.frames.definition import Frame
from meltemi.frames.finite_elements import Assembly, assemble
from meltemi.frames.water import NOWHERE, Pieces, pieces
from meltemi.structure.beam import transfer
from meltemi.structure.members import rigid_body

Float = NDArray[np.float64]


def clamped_joint(frame: Frame) -> str:
    """The joint nearest to the platform's point, to which the frame's displacements are relative."""
    return min(frame.joints, key=lambda name: float(np.linalg.norm(frame.joints[name])))


def afloat(frame: Frame, platform: Any, base: Float) -> Assembly:
    """Finite elements of the frame of a platform, clamped at one joint.

    Args:
      platform: ``floating.platform.Platform``.
      base: (3,) [m] the tower's base.

    Raises:
      InputError: the frame does not belong to the platform.
    """
    if frame.feet:
        raise InputError("frame.feet: a frame with a platform floats; remove frame.feet, or platform")
    if abs(frame.depth - platform.depth) > TOLERANCE:
        raise InputError(f"frame.depth: {frame.depth:g} m, but platform.depth is {platform.depth:g} m; give the same")
    if np.hypot(*base[:2]) > TOLERANCE:
        raise InputError("frame.interface: that of a floating frame is on the tower's axis, x = y = 0")
    assembly = assemble(frame, base, clamp=clamped_joint(frame))
    mass = rigid_inertia(assembly)[0, 0]
    if mass > 1.001 * platform.mass:
        raise InputError(
            f"frame: its members, masses and ballast have {1e-3 * mass:.6g} t, but platform.mass, which includes them, "
            f"is {1e-3 * platform.mass:.6g} t"
        )
    return assembly


def rigid_inertia(assembly: Assembly) -> Float:
    """(6, 6) inertia of a frame about the platform's point."""
    rigid = rigid_motions(assembly.points)
    return rigid @ (assembly.mass @ rigid.T)


def platform_inertia(platform: Any) -> Float:
    """(6, 6) inertia of the whole platform about its point."""
    return rigid_body(platform.mass, platform.centre, np.diag(platform.inertia))


def rigid_motions(points: Float) -> Float:
    """(6, 6n) displacements of points (n, 3) by unit motions of the platform's point."""
    result: Float = transfer(points).transpose(2, 0, 1).reshape(6, -1)
    return result


@dataclass(frozen=True)
class Spread:
    """How a load about the platform's point spreads over pieces of members (F-72).

    What no piece can take, as the yaw moment on a single column, acts on the clamped joint.

    Attributes:
      weights: (P, 3, 3) those of the pieces.
      arms: (P, 3, 6) displacements of the pieces by unit motions of the platform's point.
      forces: (P, 3, 6) forces on the pieces by unit loads.
    """

    weights: Float
    arms: Float
    forces: Float

    @property
    def total(self) -> Float:
        """(6, 6) sum of the weights about the platform's point."""
        return np.einsum("pia,pij,pjb->ab", self.arms, self.weights, self.arms, optimize=True)

    def mean(self, shape: Float) -> Float:
        """(k, 6) mean motion about the platform's point of pieces displaced by ``shape`` (k, P, 3)."""
        return np.einsum("kpi,pia->ka", shape, self.forces)

    def resultant(self, force: Float) -> Float:
        """(..., 6) resultant about the platform's point of forces (..., P, 3)."""
        flat: Float = force.reshape(*force.shape[:-2], -1) @ self.arms.reshape(-1, 6)
        return flat

    def balanced(self, force: Float) -> Float:
        """(..., P, 3) forces on the pieces less their spread resultant."""
        return force - np.einsum("pia,...a->...pi", self.forces, self.resultant(force))


def _spread(p: Pieces, weights: Float) -> Spread:
    arms = transfer(p.place)[:, :3]
    total = np.einsum("pia,pij,pjb->ab", arms, weights, arms, optimize=True)
    forces = weights @ arms @ np.linalg.pinv(total, rcond=1e-9, hermitian=True)
    return Spread(weights, arms, forces)


def by_added_mass(p: Pieces) -> Spread:
    """In proportion to the added mass of the pieces below still water [kg]."""
    wet = (p.high < TOLERANCE)[:, None, None]
    along = p.axis[:, :, None] * p.axis[:, None]
    across = p.added[:, None, None] * (np.eye(3) - along)
    return _spread(p, wet * (across + p.along[:, None, None] * along))


def by_water_plane(p: Pieces) -> Spread:
    """In proportion to the areas [m^2] that members cut out of still water, along z."""
    at_surface = (np.abs(p.high) < TOLERANCE) & (p.element != NOWHERE) & (p.high > p.low)
    area = np.divide(p.volume, p.high - p.low, out=np.zeros_like(p.volume), where=at_surface)
    return _spread(p, area[:, None, None] * np.diag([0.0, 0.0, 1.0]))


def free_mass(assembly: Assembly, platform: Any, tower_points: Float, tower_mass: Float, below: Float) -> Float:
    """(6, 6 + N + m) inertia of all that floats, with added mass, about the platform's point.

    Its columns belong to motions of the point, to those of the tower's nodes (N = 6n), and to shapes of the frame of
    which the first six are those of the tower's base, thus added to the tower's first node.

    Args:
      tower_points: (n, 3) [m] nodes of the tower.
      tower_mass: (N, N) of tower and tip.
      below: (6 + m, n, 6) shapes of the nodes of the frame.
    """
    water = pieces(assembly)
    spread, rigid = by_added_mass(water), rigid_motions(tower_points)
    on_frame = rigid_motions(assembly.points) @ (assembly.mass @ below.reshape(len(below), -1).T)
    wet = np.einsum("pij,kpj->kpi", spread.weights, water.moved(assembly, below))
    on_frame += spread.resultant(wet).T
    on_tower = rigid @ tower_mass
    on_tower[:, :6] += on_frame[:, :6]
    total = rigid @ tower_mass @ rigid.T + platform_inertia(platform) + spread.total
    return np.hstack([total, on_tower, on_frame[:, 6:]])
