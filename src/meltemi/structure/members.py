"""Blade and tower as modal members, from section data to the arrays of the kernels.

In the order of the file, a member consists of the sections of a description (``blade_beam``, ``tower_beam``), finite
elements between the nodes of its layout, their natural modes or given ones (``given_modes.py``), and their damping. The
elements are those of ``beam.py``. NumPy and SciPy. A missing stiffness (torsion, stretch, shear) counts as rigid.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import get_args

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from meltemi.core.errors import UnsupportedError
from meltemi.structure.beam import (
    Beam,
    Mesh,
    Modes,
    assemble,
    energy_shares,
    interpolated,
    natural_modes,
    ordinal,
    residual_modes,
    second_order,
    section_axes,
    section_mass,
    transfer,
)
from meltemi.turbine.definition import BaseMotion, BladeStructure, Damping, DampingTime, Foundation, Tower

Float = NDArray[np.float64]

ELEMENTS = 40
"""Smallest number of finite elements of a member; errors are then 2e-5 in bending frequencies, 6e-4 in torsion."""
BASE_MOTIONS = get_args(BaseMotion)
DIRECTIONS = ("flap", "edge", "torsion")
MOST_RESIDUAL = 5
LEAST_SHARE = 0.2
"""Smallest fraction of the kinetic energy of a mode in the direction of its name; stretching modes have none."""
RIGID_TORSION, RIGID_STRETCH, RIGID_SHEAR = 1e4, 1e6, 1e8
"""Stiffness if none is given, as a multiple of bending stiffness (over length squared)."""


@dataclass(frozen=True)
class NodeLayout:
    """Positions of the nodes of a blade or tower.

    Attributes:
      position: (N,) [m] distances from the root.
      edges: (N + 1,) [m] boundaries of the pieces that move with the nodes.
    """

    position: Float
    edges: Float

    @property
    def length(self) -> Float:
        """(N,) [m] lengths of the pieces: the weights of the nodes in an integral along the blade."""
        return np.diff(self.edges)


def cells(edges: Float) -> NodeLayout:
    """Nodes in the middle of the pieces (midpoint rule)."""
    return NodeLayout(0.5 * (edges[1:] + edges[:-1]), edges)


def points(position: Float) -> NodeLayout:
    """Nodes at given positions, from root to tip (trapezoidal rule)."""
    return NodeLayout(position, np.concatenate([position[:1], 0.5 * (position[1:] + position[:-1]), position[-1:]]))


@dataclass(frozen=True)
class ModalMember:
    """A flexible member described by some of its modes.

    Attributes:
      names: (k,) e.g. ``"1st flap"``.
      modes: shapes on the finite-element mesh, generalised stiffness and mass.
      damping: (k, k) generalised damping.
      second: (k, k, n, 3) second-order displacements on the mesh.
      beam: the member's sections.
      momenta: (6, k + 6) linear and angular momentum of a tower about its base, by unit rates of its modes on a base at
        rest and then of that base along and about x, y, z; None unless the base moves.
      below: (k, n, 6) shapes of the nodes of a frame below a tower; None without.
      hull: (k, 6) mean motion of the hull of a flexible platform about its point by the modes that are not motions of
        the base; None without.
      gravity: [m/s^2] that under which a frame below a tower stands or floats; 0 without.
    """

    names: tuple[str, ...]
    modes: Modes
    damping: Float
    second: Float
    beam: Beam
    momenta: Float | None = None
    below: Float | None = None
    hull: Float | None = None
    gravity: float = 0.0

    def second_at(self, z: Float) -> Float:
        """(k, k, m, 3) second-order displacements at coordinates ``z`` (m,)."""
        return interpolated(z, self.modes.z, self.second)


def blade_member(
    blade: BladeStructure, counts: dict[str, int], layout: NodeLayout, *, given: bool = False
) -> ModalMember:
    """Modal member of a blade, clamped at its root, with given numbers of flap, edge, torsion and residual modes.

    Args:
      given: use the mode shapes of the description instead of natural modes.
    """
    residual = counts.get("residual", 0)
    if counts["torsion"] and not blade.twists:
        raise UnsupportedError("torsion_modes needs a blade with torsion_stiffness")
    beam = blade_beam(blade)
    mesh = _mesh(beam, layout)
    if given:
        from meltemi.structure.given_modes import given_blade_modes

        modes, names = given_blade_modes(blade, beam, mesh, counts)
        return _member(modes, names, beam, blade.damping or blade.damping_time)
    modes = natural_modes(mesh, 12 + 4 * (sum(counts.values()) - residual))
    picked, names = pick_modes(
        modes, mesh, {"flap": (0, counts["flap"]), "edge": (1, counts["edge"]), "torsion": (2, counts["torsion"])}
    )
    if residual:
        picked = residual_modes(mesh, picked, _static_loads(mesh, beam)[:, :residual])
        kind = np.argmax(energy_shares(picked, mesh.mass), axis=1)
        picked = picked.scaled(np.where(np.arange(len(kind)) < len(names), 1.0, _to_unit_motion(picked, kind)))
        names += [f"{ordinal(i + 1)} residual {DIRECTIONS[k]}" for i, k in enumerate(kind[len(names) :])]
    return _member(picked, names, beam, blade.damping or blade.damping_time)


def tower_member(
    tower: Tower,
    counts: dict[str, int],
    tip_mass: Float,
    foundation: Foundation | None,
    layout: NodeLayout,
    *,
    given: bool = False,
) -> ModalMember:
    """Modal member of the tower with given numbers of fore-aft, side-to-side and torsion modes.

    Args:
      tip_mass: (6, 6) inertia that the tower carries, about its top.
      foundation: foundation of the tower; its motions, if it has any, become further modes, ``"base surge"``.
      given: use the mode shapes of the description instead of natural modes.

    Raises:
      UnsupportedError: modes or shapes that the tower does not have.
    """
    springs = None if foundation is None or foundation.motions else foundation
    if counts["torsion"] and tower.torsion_stiffness is None:
        raise UnsupportedError("tower_torsion_modes needs a tower with torsion_stiffness")
    beam = tower_beam(tower)
    mesh = _mesh(beam, layout)
    if given:
        if springs is not None:
            raise UnsupportedError("mode_shapes 'given': the tower has a foundation")
        from meltemi.structure.given_modes import given_tower_modes

        modes, names = given_tower_modes(tower, beam, mesh, counts)
        return on_foundation(_member(modes, names, beam, tower.damping), mesh, foundation)
    modes = natural_modes(
        mesh,
        12 + 4 * sum(counts.values()),
        tip_mass=tip_mass,
        base=None if springs is None else (springs.stiffness, springs.matrix("mass")),
    )
    wanted = {
        "fore-aft": (0, counts["fore_aft"]),
        "side-side": (1, counts["side_side"]),
        "torsion": (2, counts["torsion"]),
    }
    picked, names = pick_modes(modes, mesh, wanted)
    return on_foundation(_member(picked, names, beam, tower.damping), mesh, foundation)


def on_foundation(tower: ModalMember, mesh: Mesh, foundation: Foundation | None) -> ModalMember:
    """The tower with the damping of its foundation; motions of the base are rigid shapes after its modes."""
    if foundation is None:
        return tower
    mass, stiffness, damping = (foundation.matrix(name) for name in ("mass", "stiffness", "damping"))
    if not foundation.motions:
        base = tower.modes.shape[:, 0]
        return replace(tower, damping=tower.damping + base @ damping @ base.T)
    free = [BASE_MOTIONS.index(name) for name in foundation.motions]
    some, modes = np.ix_(free, free), tower.modes
    rigid = np.zeros((6, len(mesh.z), 6))
    for i in range(6):
        rigid[i, :, i] = 1.0
        if i >= 3:
            rigid[i, :, :3] = np.cross(np.eye(3)[i - 3], mesh.points - mesh.points[0])
    shape = np.concatenate([modes.shape, rigid[free]])
    flat = shape.reshape(len(shape), -1)
    M = flat @ mesh.mass @ flat.T + scipy.linalg.block_diag(np.zeros_like(modes.mass), mass[some])
    K = scipy.linalg.block_diag(modes.stiffness, stiffness[some])
    moving = Modes(mesh.z, mesh.points, shape, K, M, M)
    names = (*tower.names, *(f"base {name}" for name in foundation.motions))
    C = scipy.linalg.block_diag(tower.damping, damping[some])
    momenta = rigid.reshape(6, -1) @ mesh.mass @ np.concatenate([modes.shape, rigid]).reshape(-1, flat.shape[1]).T
    momenta[:, -6:] += mass
    return ModalMember(names, moving, C, second_order(moving), tower.beam, momenta)


# sections ---------------------------------------------------------------------------------------


def blade_beam(blade: BladeStructure) -> Beam:
    """The blade's sections in blade axes, along z from the root."""
    n = len(blade.position)
    zero = np.zeros(n)

    def given(value: Float | None) -> Float:
        return zero if value is None else value

    axis = np.stack([given(blade.axis_x), given(blade.axis_y), blade.position], axis=1)
    if blade.stiffness_matrix is not None and blade.mass_matrix is not None:
        K, M = blade.stiffness_matrix, blade.mass_matrix
    else:
        assert blade.mass is not None and blade.flap_stiffness is not None and blade.edge_stiffness is not None
        K = _diagonal_stiffness(
            blade.edge_stiffness,
            blade.flap_stiffness,
            blade.torsion_stiffness,
            blade.axial_stiffness,
            blade.position[-1],
        )
        flap, edge = given(blade.flap_inertia), given(blade.edge_inertia)
        centre = np.stack([given(blade.mass_centre_x), given(blade.mass_centre_y), zero], axis=1)
        M = section_mass(blade.mass, centre, np.stack([edge, flap, edge + flap], axis=1))
    Q = section_axes(blade.twist, np.gradient(axis, blade.position, axis=0))
    return Beam(blade.position, axis, Q @ K @ Q.transpose(0, 2, 1), Q @ M @ Q.transpose(0, 2, 1))


def tower_beam(tower: Tower) -> Beam:
    """The tower's sections in inertial axes, along z from the base."""
    n = len(tower.position)
    axis = np.stack([np.zeros(n), np.zeros(n), tower.position], axis=1)
    K = _diagonal_stiffness(
        tower.side_side_stiffness,
        tower.fore_aft_stiffness,
        tower.torsion_stiffness,
        tower.axial_stiffness,
        tower.position[-1],
    )
    if tower.shear_stiffness is not None:
        K[:, 0, 0] = K[:, 1, 1] = tower.shear_stiffness
    # a thin tube: J_z = m r^2, J_x = J_y = m r^2 / 2
    tube = tower.mass * (0.5 * tower.diameter) ** 2
    M = section_mass(tower.mass, np.zeros((n, 3)), np.stack([0.5 * tube, 0.5 * tube, tube], axis=1))
    return Beam(tower.position, axis, K, M)


def _diagonal_stiffness(
    about_x: Float, about_y: Float, torsion: Float | None, axial: Float | None, length: float
) -> Float:
    """(S, 6, 6) uncoupled section stiffness."""
    stiff = np.maximum(about_x, about_y).max()
    n = len(about_x)
    K = np.zeros((n, 6, 6))
    K[:, 0, 0] = K[:, 1, 1] = RIGID_SHEAR * stiff / length**2
    K[:, 2, 2] = RIGID_STRETCH * stiff / length**2 if axial is None else axial
    K[:, 3, 3], K[:, 4, 4] = about_x, about_y
    K[:, 5, 5] = RIGID_TORSION * stiff if torsion is None else torsion
    return K


# elements and modes -----------------------------------------------------------------------------


def _mesh(beam: Beam, layout: NodeLayout) -> Mesh:
    """Finite elements with nodes at those of the layout and between its pieces, and sufficiently fine elsewhere."""
    length = beam.position[-1]
    z = np.union1d(np.concatenate([layout.position, layout.edges]), np.linspace(0.0, length, ELEMENTS + 1))
    keep = np.concatenate([[True], np.diff(z) > 1e-6 * length])
    z = z[keep]
    z[-1] = length
    return assemble(beam, z)


def pick_modes(modes: Modes, mesh: Mesh, wanted: dict[str, tuple[int, int]]) -> tuple[Modes, list[str]]:
    """The first modes of each kind, scaled to unit motion of the end (or of the largest displacement)."""
    shares = energy_shares(modes, mesh.mass)
    kind = np.where(shares.max(axis=1) > LEAST_SHARE, np.argmax(shares, axis=1), -1)
    which: list[int] = []
    names: list[str] = []
    for name, (component, count) in wanted.items():
        candidates = np.flatnonzero(kind == component)[:count]
        if len(candidates) < count:
            raise UnsupportedError(f"only {len(candidates)} {name} modes exist, {count} are requested")
        which += candidates.tolist()
        names += [f"{ordinal(i + 1)} {name}" for i in range(count)]
    picked = modes.pick(which)
    return picked.scaled(_to_unit_motion(picked, kind[which])), names


def _to_unit_motion(modes: Modes, kind: NDArray[np.int64]) -> Float:
    """(k,) factors for unit motion of the end in the direction of the mode's kind, or of the largest motion."""
    factor = np.empty(len(kind))
    for i, k in enumerate(kind):
        values = modes.shape[i, :, (0, 1, 5)[int(k)]]
        largest, end = values[np.argmax(np.abs(values))], values[-1]
        factor[i] = 1.0 / (end if abs(end) > 0.3 * abs(largest) else abs(largest) * np.sign(end))
    return factor


def _static_loads(mesh: Mesh, beam: Beam) -> Float:
    """(6m, 5) loads on a mesh whose static deflection completes that of the natural modes.

    A flapwise force that grows with the distance from the root as the lift does, at the centres of mass, so that the
    reference axis does not matter; then moments about the span in proportion to the mass times the first, second and
    fourth power of the distance; then a centrifugal force along the span. Natural modes hardly stretch the blade:
    without the last load, residual modes that stretch a little would take the place of the stretch and twist the tip.
    """
    span = mesh.z / mesh.z[-1]
    step, inertia = np.gradient(mesh.z), beam.at(mesh.z, "mass")
    mass = inertia[:, 0, 0]
    load = np.zeros((len(span), 6, MOST_RESIDUAL))
    load[:, :, 0] = (step * span / mass)[:, None] * inertia[:, :, 0]
    for i, power in enumerate((1, 2, 4)):
        load[:, 5, i + 1] = step * mass * span**power
    along = np.zeros(load.shape[:2])
    along[:, 2] = span
    load[:, :, 4] = (mesh.mass @ along.reshape(-1)).reshape(along.shape)
    flat: Float = load.reshape(-1, MOST_RESIDUAL)
    return flat / np.abs(flat).sum(axis=0)


# damping, and what members carry ----------------------------------------------------------------


def _member(modes: Modes, names: list[str], beam: Beam, damping: Damping | DampingTime | None) -> ModalMember:
    share = np.array([getattr(damping, name.split(" ")[-1].replace("-", "_")) for name in names])
    # C = 2 zeta / omega K, with omega of the member alone: each mode has its damping ratio for the separate member
    time = share if isinstance(damping, DampingTime) else 2.0 * share / modes.frequency_alone
    C = modes.stiffness * time[None, :]
    return ModalMember(tuple(names), modes, C, second_order(modes), beam)


def rigid_body(mass: float, centre: Float, inertia: Float) -> Float:
    """(6, 6) inertia about the origin of a body with inertia (3, 3) about its centre of mass."""
    M = np.zeros((6, 6))
    M[:3, :3] = mass * np.eye(3)
    M[3:, 3:] = inertia
    T = transfer(np.asarray(centre, dtype=float))
    result: Float = T.T @ M @ T
    return result
