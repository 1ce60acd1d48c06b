"""The hull of a flexible floating platform: its clamped joint, how loads of the water spread over it, its inertia.

Reference: docs/theory/frames.md (F-70 to F-74, F-77, F-78).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from meltemi.core.errors import InputError, did_you_mean
from meltemi.floating.coefficients import bodies_coefficients
from meltemi.floating.potential import HydroCoefficients
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
      weights: (3 P, 3 P) those of the pieces.
      arms: (P, 3, 6) displacements of the pieces by unit motions of the platform's point.
      forces: (P, 3, 6) forces on the pieces by unit loads.
    """

    weights: Float
    arms: Float
    forces: Float

    @property
    def total(self) -> Float:
        """(6, 6) sum of the weights about the platform's point."""
        flat = self.arms.reshape(-1, 6)
        return flat.T @ self.weights @ flat

    def weighted(self, shape: Float) -> Float:
        """(k, P, 3) weights times displacements (k, P, 3) of the pieces."""
        result: Float = (shape.reshape(len(shape), -1) @ self.weights).reshape(shape.shape)
        return result

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
    """The spread by weights (P, 3, 3) of pieces, or (3 P, 3 P)."""
    arms = transfer(p.place)[:, :3]
    flat, square = arms.reshape(-1, 6), weights if weights.ndim == 2 else scipy.linalg.block_diag(*weights)
    forces = square @ flat @ np.linalg.pinv(flat.T @ square @ flat, rcond=1e-9, hermitian=True)
    return Spread(square, arms, forces.reshape(arms.shape))


def by_added_mass(p: Pieces) -> Spread:
    """In proportion to the added mass of the pieces below still water [kg]."""
    wet = (p.high < TOLERANCE)[:, None, None]
    along = p.axis[:, :, None] * p.axis[:, None]
    across = p.added[:, None, None] * (np.eye(3) - along)
    return _spread(p, wet * (across + p.along[:, None, None] * along))


@dataclass(frozen=True)
class Bodies:
    """The bodies of a hull between which potential flow has added mass (F-77, F-78).

    Attributes:
      arms: (3 P, 6 N) displacements of the pieces by unit motions of the bodies.
      forces: (3 P, 6 N) forces on the pieces by unit loads of the bodies, spread by their added mass of strip theory,
        or by volume in directions in which they have none.
      coefficients: of all bodies.
    """

    arms: Float
    forces: Float
    coefficients: HydroCoefficients

    def spread(self, p: Pieces, density: float) -> Spread:
        """In proportion to the added mass of potential flow between bodies, and that of strip theory within each."""
        strip = by_added_mass(p).weights
        mean = strip @ self.arms @ self.forces.T  # of each body, which potential flow has
        return _spread(p, strip - mean + self.forces @ (density * self.coefficients.infinite) @ self.forces.T)


def bodies_of(assembly: Assembly, platform: Any, p: Pieces) -> Bodies | None:
    """The bodies of the platform of a frame, if there are several.

    Raises:
      InputError: a member is not there, or in no body or in two, or the coefficients are not those of the bodies.
    """
    if not platform.bodies:
        return None
    frame, body, elements = assembly.frame, np.full(len(p.low), NOWHERE), assembly.elements
    for name, i in ((name, i) for i, each in enumerate(platform.bodies) for name in each.members):
        if name not in frame.members:
            raise InputError(f"platform.bodies: no member {name!r} in frame: {did_you_mean(name, frame.members)}")
        on = (p.element != NOWHERE) & (elements.member[p.element] == assembly.members.index(name))
        if (body[on] != NOWHERE).any():
            raise InputError(f"platform.bodies: member {name!r} is in two bodies; name it in one")
        ends = np.isin(p.node, [assembly.joint_nodes[each] for each in frame.members[name].joints])
        body[on | (ends & (body == NOWHERE))] = i
    strip = by_added_mass(p)
    wet = strip.weights.any(axis=1).reshape(-1, 3).any(axis=1) & (p.element != NOWHERE)
    if len(alone := np.flatnonzero(wet & (body == NOWHERE))):
        name = assembly.members[elements.member[p.element[alone[0]]]]
        raise InputError(f"platform.bodies: member {name!r} is in the water and in no body; name it in one")
    volume = np.repeat(p.volume * (p.high < TOLERANCE), 3)
    arms, forces = np.zeros((2, 3 * len(body), 6 * len(platform.bodies)))
    for i, each in enumerate(platform.bodies):
        mine, at = np.repeat(body == i, 3), slice(6 * i, 6 * i + 6)
        arms[mine, at] = transfer(p.place[body == i] - each.place)[:, :3].reshape(-1, 6)
        G, left = arms[:, at], np.eye(6)
        for weighted in (strip.weights @ G, volume[:, None] * G):  # by volume what has no added mass
            more = weighted @ np.linalg.pinv(G.T @ weighted, rcond=1e-9, hermitian=True) @ left
            forces[:, at] += more
            left = left - G.T @ more
    return Bodies(arms, forces, bodies_coefficients(platform))


def hull_spread(assembly: Assembly, platform: Any, p: Pieces) -> Spread:
    """How loads of the water on a platform spread over the pieces of its frame (F-72, F-77)."""
    bodies = bodies_of(assembly, platform, p)
    return by_added_mass(p) if bodies is None else bodies.spread(p, platform.water_density)


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
    spread, rigid = hull_spread(assembly, platform, water), rigid_motions(tower_points)
    on_frame = rigid_motions(assembly.points) @ (assembly.mass @ below.reshape(len(below), -1).T)
    on_frame += spread.resultant(spread.weighted(water.moved(assembly, below))).T
    on_tower = rigid @ tower_mass
    on_tower[:, :6] += on_frame[:, :6]
    total = rigid @ tower_mass @ rigid.T + platform_inertia(platform) + spread.total
    return np.hstack([total, on_tower, on_frame[:, 6:]])
