"""A frame reduced to the motion of the tower's base and a few modes, and one modal member of tower and frame.

Reference: docs/theory/frames.md (F-15 to F-22).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from meltemi.core.errors import InputError, UnsupportedError
from meltemi.core.threads import one_blas_thread
from meltemi.frames.checks import TOLERANCE
from meltemi.frames.definition import Frame
from meltemi.frames.finite_elements import Assembly, assemble, geometric_stiffness
from meltemi.frames.hull import afloat, free_mass, hull_spread, rigid_motions
from meltemi.frames.water import NOWHERE, added_mass, pieces
from meltemi.sea.airy import GRAVITY
from meltemi.sea.pile_beam import KINDS, first_frequency, grounded, strain_stiffness
from meltemi.structure.beam import Mesh, Modes, lowest_modes, second_order, transfer
from meltemi.structure.beam import assemble as beam_mesh
from meltemi.structure.members import (
    BASE_MOTIONS,
    LEAST_SHARE,
    ModalMember,
    NodeLayout,
    on_foundation,
    pick_modes,
    tower_beam,
    tower_member,
)
from meltemi.turbine.definition import Foundation, Tower

Float = NDArray[np.float64]

HULL_MODES = 2
"""Number of further modes in each direction of a floating frame, with which the tower's static deflection is right."""
FIXED_MODES = 20
"""Number of modes of the frame with a fixed base that the modes of the assembly are made of."""


@dataclass(frozen=True)
class Reduction:
    """A frame by the six motions of the tower's base, static otherwise, and modes with a fixed base (F-15 to F-17).

    Attributes:
      static: (6, n, 6) displacements of the nodes by unit motions of the base (Guyan).
      modes: (m, n, 6) displacements of modes with a fixed base, of unit mass.
      frequency: (m,) [rad/s] theirs.
      stiffness: (6, 6) of the base.
      mass: (6 + m, 6 + m) of base and modes, without the water around.
    """

    static: Float
    modes: Float
    frequency: Float
    stiffness: Float
    mass: Float

    @property
    def shapes(self) -> Float:
        """(6 + m, n, 6) all displacements."""
        return np.concatenate([self.static, self.modes])


@one_blas_thread
def reduced(assembly: Assembly, modes: int) -> Reduction:
    """Reduce a frame to its base and at most ``modes`` modes.

    Raises:
      InputError: the frame is a mechanism.
    """
    T, K = assembly.transformation, assembly.free
    M = T.T @ assembly.mass @ T
    static = np.vstack([-assembly.solver(base=True).solve(K[:-6, -6:].toarray()), np.eye(6)])
    inner = K.shape[0] - 6
    value, shape = _lowest(M[:inner, :inner], K[:inner, :inner], modes)
    own = np.vstack([shape / np.sqrt(value), np.zeros((6, len(value)))])
    basis = np.hstack([static, own])
    return Reduction(
        static=_nodes(T @ static),
        modes=_nodes(T @ own),
        frequency=1.0 / np.sqrt(value),
        stiffness=static.T @ (K @ static),
        mass=basis.T @ (M @ basis),
    )


def _nodes(columns: Float) -> Float:
    """(k, n, 6) displacements of nodes from columns (6n, k)."""
    return columns.T.reshape(columns.shape[1], len(columns) // 6, 6)


@one_blas_thread
def frequencies(assembly: Assembly, count: int, *, fixed: bool = False) -> Float:
    """(count,) [rad/s] lowest natural frequencies of a frame in air without tower, its base free or ``fixed``.

    Raises:
      InputError: the frame is a mechanism.
    """
    assembly.solver(base=fixed)
    T, K = assembly.transformation, assembly.free
    M, end = T.T @ assembly.mass @ T, K.shape[0] - 6 * fixed
    result: Float = 1.0 / np.sqrt(_lowest(M[:end, :end], K[:end, :end], count)[0])
    return result


def _lowest(M: Any, K: Any, count: int) -> tuple[Float, Float]:
    """Inverse squares (m,) of the lowest frequencies, and shapes (f, m) of unit stiffness; at most ``count``.

    Coordinates without mass do no harm in the inverse problem.
    """
    n, m = K.shape[0], min(count, K.shape[0])
    if m == 0:
        return np.zeros(0), np.zeros((n, 0))
    value, shape = scipy.linalg.eigh(M.toarray(), K.toarray(), subset_by_index=(n - m, n - 1))
    moving = np.flatnonzero(value > 1e-12 * value[-1])[::-1]
    return value[moving], shape[:, moving]


def tower_base(frame: Frame, tower: Tower) -> Float:
    """(3,) [m] the tower's base: on its axis, or where the only joint of the interface is."""
    top = frame.joints[frame.interface[0]]
    x, y = top[:2] if len(frame.interface) == 1 else (0.0, 0.0)
    return np.array([x, y, tower.base_height])


def supported_tower(  # noqa: PLR0913 - as for piles, and what a frame needs besides
    frame: Frame,
    tower: Tower,
    counts: dict[str, int],
    tip_mass: Float,
    foundation: Foundation | None,
    layout: NodeLayout,
    *,
    given: bool = False,
    platform: Any = None,
    gravity: float = GRAVITY,
) -> ModalMember:
    """Modal member of tower and frame, whose mesh is the tower's.

    Its modes are the natural ones of tower and frame with the still water around its members (F-18); or the static
    displacements of the frame by unit motions of the tower's base (Guyan), and the mode shapes of the description on
    it, as in OpenFAST. Its damping is that of the isolated tower for what the tower deforms, those of frame and soil in
    proportion to their share of a mode's stiffness, and ``interface_damping`` (F-20).

    Args:
      tip_mass ... given: as for ``tower_member``.
      platform: the platform of which the frame is the structure (``floating.platform.Platform``). Modes are then those
        of the free platform, relative to a joint of it that moves with the base (F-71).
      gravity: [m/s^2].

    Raises:
      InputError: the frame is a mechanism, has neither feet nor platform, or does not belong to the platform.
      UnsupportedError: modes or shapes that the tower does not have.
    """
    if platform is None and not frame.feet:
        raise InputError("frame.feet: the frame has no feet; give some, or a platform on which it floats")
    at = tower_base(frame, tower)
    assembly = assemble(frame, at) if platform is None else afloat(frame, platform, at)
    alone = tower_member(tower, counts, tip_mass, None, layout, given=given)
    if platform is not None:
        counts = {kind: count + HULL_MODES * (kind != "torsion" and count > 0) for kind, count in counts.items()}
    mesh = beam_mesh(tower_beam(tower), alone.modes.z)
    if given and platform is not None:
        raise UnsupportedError("mode_shapes 'given': the frame floats; use computed mode shapes")
    make = _given_on_frame if given else partial(_natural, platform)
    modes, names, below = make(assembly, alone, mesh, counts, tip_mass)
    dry = _product(modes.shape, mesh.mass) + _product(below, assembly.mass)
    modes = replace(modes, mass_alone=dry)
    second = second_order(modes)
    second[..., 2] += _base_lowering(assembly, below)[:, :, None]
    damping = _damping(frame, assembly, alone, mesh, modes, below)
    if platform is None:  # that of a floating frame is small, for the water carries it where it is
        modes = replace(modes, stiffness=modes.stiffness + gravity * weight_stiffness(assembly, below))
    member = ModalMember(tuple(names), modes, damping, second, tower_beam(tower), below=below, gravity=gravity)
    return member if platform is None else _on_platform(member, assembly, mesh, foundation, platform)


def _on_platform(
    member: ModalMember, assembly: Assembly, mesh: Mesh, foundation: Foundation | None, platform: Any
) -> ModalMember:
    """The member with the motions of its base, as of one rigid body, after its modes (F-71, F-73, F-74).

    The platform's own equations have the inertia of the frame as a rigid body.
    """
    assert member.below is not None
    base, water, n = on_foundation(member, mesh, foundation), pieces(assembly), len(member.names)
    rigid = rigid_motions(assembly.points - assembly.points[-1])
    product = rigid @ (assembly.mass @ member.below.reshape(n, -1).T)
    assert base.momenta is not None
    momenta, mass = base.momenta.copy(), base.modes.mass.copy()
    momenta[:, :n] += product
    mass[:n, :n] = member.modes.mass_alone
    mass[n:, :n] += product
    mass[:n, n:] += product.T
    vibrating = mass.copy()
    vibrating[:n, :n] = member.modes.mass  # that of free vibration in still water
    modes = replace(base.modes, mass=vibrating, mass_alone=mass)
    hull = hull_spread(assembly, platform, water).mean(water.moved(assembly, member.below))
    second = np.zeros_like(base.second)
    second[:n, :n] = member.second
    base = replace(base, below=member.below, gravity=member.gravity, hull=hull)
    return replace(base, modes=modes, second=second, momenta=momenta)


def _natural(
    platform: Any, assembly: Assembly, alone: ModalMember, mesh: Mesh, counts: dict[str, int], tip_mass: Float
) -> tuple[Modes, list[str], Float]:
    """Natural modes of the tower on the frame, their names, and shapes (k, n, 6) of the frame's nodes (F-18, F-19).

    Those of a floating frame are its free ones, relative to its clamped joint (F-71).
    """
    frame, water = reduced(assembly, FIXED_MODES), pieces(assembly)
    still = int(np.searchsorted(water.high, TOLERANCE))
    moved = water.moved(assembly, frame.shapes)
    if platform is None:
        wet = frame.mass + added_mass(water, moved, still)
    else:
        wet = frame.mass + _product(moved, hull_spread(assembly, platform, water).weights)
    # coordinates are those of the tower's nodes, of which the first is the base, then the modes of the frame
    tower, m = 6 * len(mesh.z), len(frame.frequency)
    joined = np.r_[0:6, tower : tower + m]
    G = scipy.linalg.block_diag(grounded(mesh, frame.stiffness), np.diag(1.0 / frame.frequency))
    M = scipy.linalg.block_diag(mesh.mass, np.zeros((m, m)))
    M[tower - 6 : tower, tower - 6 : tower] += tip_mass
    above = M[:tower, :tower].copy()
    M[np.ix_(joined, joined)] += wet
    following: tuple[Any, Any] = np.zeros((tower + m, 0)), np.zeros((0, tower))
    if platform is not None:
        points = mesh.points + assembly.points[-1]
        moving = free_mass(assembly, platform, points, above, frame.shapes)
        led = -np.linalg.solve(moving[:, :6], moving[:, 6:])  # motion of the point, for the whole keeps its momentum
        M += moving[:, 6:].T @ led
        following = led.T, rigid_motions(points)
    square, columns = lowest_modes(G, M, 12 + 4 * sum(counts.values()) + m)
    motion = columns[:, :tower] + columns @ following[0] @ following[1]
    energy = np.einsum("ki,ij,kj->k", motion, above, motion)
    some = np.flatnonzero(energy > LEAST_SHARE)  # others are of the frame's members
    shape = columns[some, :tower].reshape(len(some), -1, 6)
    identity = np.eye(len(some))
    natural = Modes(mesh.z, mesh.points, shape, np.diag(square[some]), identity, identity)
    wanted = {kind: (i, counts[key]) for i, (kind, key) in enumerate(zip(KINDS, counts, strict=True))}
    modes, names = pick_modes(natural, mesh, wanted)
    # the frame's modes follow the tower at the frequency of each mode
    base, w2, flat = modes.shape[:, 0], modes.frequency**2, modes.shape.reshape(len(names), tower)
    own = [
        np.linalg.solve(np.diag(frame.frequency**2) - w * M[tower:, tower:], w * M[tower:, :tower] @ x)
        for x, w in zip(flat, w2, strict=True)
    ]
    below = np.tensordot(np.hstack([base, np.array(own).reshape(len(base), m)]), frame.shapes, 1)
    return modes, names, below


def _given_on_frame(
    assembly: Assembly, alone: ModalMember, mesh: Mesh, counts: dict[str, int], tip_mass: Float
) -> tuple[Modes, list[str], Float]:
    """As :func:`_natural`: shapes of a clamped tower, and static shapes of the frame that carry it."""
    frame, k = reduced(assembly, 0), len(alone.names)
    rigid = transfer(mesh.points - mesh.points[0]).transpose(2, 0, 1)
    shape = np.concatenate([alone.modes.shape, rigid])
    below = np.concatenate([np.zeros((k, *frame.static.shape[1:])), frame.static])
    K, top = scipy.linalg.block_diag(alone.modes.stiffness, frame.stiffness), shape[:, -1]
    dry = _product(shape, mesh.mass) + _product(below, assembly.mass)
    names = [*alone.names, *(f"frame {motion}" for motion in BASE_MOTIONS)]
    return Modes(mesh.z, mesh.points, shape, K, dry + top @ tip_mass @ top.T, dry), names, below


def _product(shapes: Float, matrix: Any) -> Float:
    """(k, k) generalised matrix (6n, 6n) for shapes (k, n, 6)."""
    flat = shapes.reshape(len(shapes), matrix.shape[0])
    result: Float = flat @ (matrix @ flat.T)
    return result


def _base_lowering(assembly: Assembly, below: Float) -> Float:
    """(k, k) second-order displacement of the tower's base along z (F-21): q^T Z q / 2.

    By virtual work it is that of a unit upward force on the base, whose axial forces stiffen the frame.
    """
    up = np.zeros((len(assembly.points), 6))
    up[-1, 2] = 1.0
    return -_product(below, geometric_stiffness(assembly, up))


def weight_stiffness(assembly: Assembly, below: Float) -> Float:
    """(k, k) stiffness over gravity by the weight of the frame in still water, for shapes (k, n, 6) (F-22).

    That of the displaced water is weight, too: pressure on the deflected sides of a member acts as tension does.
    """
    e, water = assembly.elements, pieces(assembly)
    wet = (water.high < TOLERANCE) & (water.element != NOWHERE)
    displaced = assembly.frame.water_density * np.bincount(water.element[wet], water.volume[wet], len(e.length))
    weight = e.steel + e.fill + e.growth - displaced / np.where(e.beam, e.length, 1.0)
    ends = assembly.line_loads(np.outer(weight, [0.0, 0.0, -1.0]))
    return _product(below, geometric_stiffness(assembly, assembly.nodal(ends) + assembly.joint_weight))


def _damping(frame: Frame, assembly: Assembly, alone: ModalMember, mesh: Mesh, modes: Modes, below: Float) -> Float:
    """(k, k) generalised damping of tower, frame, soil and interface (F-20)."""
    first, base, n = first_frequency(modes), modes.shape[:, 0], len(alone.names)
    damping = _product(below, 2.0 * frame.damping * assembly.stiffness + assembly.ground_damping) / first
    if len(modes.shape) == n:
        lag = np.sqrt(np.diag(alone.damping) / np.diag(alone.modes.stiffness))
        damping += strain_stiffness(mesh, modes.shape, -math.inf, math.inf) * np.outer(lag, lag)
    else:
        damping[:n, :n] += alone.damping
    if frame.interface_damping is not None:
        damping += base @ np.asarray(frame.interface_damping) @ base.T
    return damping
