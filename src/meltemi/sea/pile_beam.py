"""A monopile below a tower: one beam from the foot of the pile to the tower top, and the nodes of the pile.

Reference: docs/theory/sea.md (H-30 to H-44).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from meltemi.core.errors import UnsupportedError
from meltemi.sea.soil import Soil
from meltemi.sea.support import Support
from meltemi.structure.beam import (
    Beam,
    Mesh,
    Modes,
    assemble,
    natural_modes,
    second_order,
    transfer,
)
from meltemi.structure.members import (
    BASE_MOTIONS,
    ModalMember,
    NodeLayout,
    on_foundation,
    pick_modes,
    tower_beam,
    tower_member,
)
from meltemi.turbine.definition import Foundation, Tower

Float = NDArray[np.float64]

FINE, GROWTH, LONGEST = 0.4, 0.1, 2.0
"""[m] length of pieces at still water and mudline, their growth with the distance, and that of the longest."""
TOP_MOTIONS = [0, 1, 3, 4, 5]
"""Surge, sway, roll, pitch and yaw of the top of the pile; heave is far stiffer."""
KINDS = ("fore-aft", "side-side", "torsion")
FREE = 1e-8
"""Stiffness of a free foot over the bending stiffness of the pile [1/m and 1/m^3]."""
SECANTS, SETTLED = 50, 1e-6
"""Most iterations of secant springs, and the relative change at which they end."""


def pile_beam(support: Support) -> Beam:
    """The pile's sections along z from its foot, in inertial axes; water inside and growth are lateral mass only."""
    s = support
    foot, top = float(s.position[0]), float(s.position[-1])
    heights = [*s.position, -s.depth]
    if s.flooded is not None:
        heights.append(s.flooded)
    for growth in s.growth:
        heights += [growth.bottom, growth.top]
    for each in s.masses:
        heights += [each.height - each.length, each.height]
    # a repeated station, so that properties may be discontinuous there
    z = np.repeat(np.unique(np.clip(heights, foot, top)), 2)
    just = np.where(np.arange(len(z)) % 2, 1e-9, -1e-9) * (top - foot)
    inside = np.clip(z + just, foot, top)
    outer, wall = np.interp(inside, s.position, s.diameter), np.interp(inside, s.position, s.thickness)
    hole = outer - 2.0 * wall
    area, bending = 0.25 * np.pi * (outer**2 - hole**2), np.pi / 64.0 * (outer**4 - hole**4)
    EI, shear = s.elastic_modulus * bending, s.shear_share * s.shear_modulus * area
    K = np.zeros((len(z), 6, 6))
    for i, values in enumerate((shear, shear, s.elastic_modulus * area, EI, EI, 2.0 * s.shear_modulus * bending)):
        K[:, i, i] = values
    mass, tilting, twisting = s.density * area, s.density * bending, 2.0 * s.density * bending
    for each in s.masses:
        on = ((inside > each.height - each.length) & (inside < each.height)) / each.length
        mass, tilting, twisting = mass + on * each.mass, tilting + on * each.inertia, twisting + on * each.about_axis
    lateral = mass + carried(s, inside, outer, hole)
    M = np.zeros((len(z), 6, 6))
    for i, values in enumerate((lateral, lateral, mass, tilting, tilting, twisting)):
        M[:, i, i] = values
    keep = slice(1, -1)
    z = z[keep] - foot
    axis = np.stack([np.zeros(len(z)), np.zeros(len(z)), z], axis=1)
    return Beam(z, axis, K[keep], M[keep])


def carried(support: Support, z: Float, outer: Float, hole: Float) -> Float:
    """(n,) [kg/m] additional mass in lateral motion of the pile: water inside, and marine growth."""
    mass = np.zeros(len(z))
    if support.flooded is not None:
        wet = (z > -support.depth) & (z < support.flooded)
        mass += wet * support.water_density * 0.25 * np.pi * hole**2
    for growth in support.growth:
        covered = (z > growth.bottom) & (z < growth.top)
        mass += covered * growth.density * np.pi * (outer + growth.thickness) * growth.thickness
    return mass


def joined(pile: Beam, tower: Beam) -> Beam:
    """Pile and tower as one beam."""
    lift = pile.position[-1]
    axis = tower.axis + np.array([0.0, 0.0, lift])
    return Beam(
        np.concatenate([pile.position, tower.position + lift]),
        np.concatenate([pile.axis, axis]),
        np.concatenate([pile.stiffness, tower.stiffness]),
        np.concatenate([pile.mass, tower.mass]),
    )


def pile_edges(support: Support) -> Float:
    """(N + 1,) [m] heights of the edges of the pieces into which the pile is cut, finer near water and mudline."""
    foot, top = float(support.position[0]), float(support.position[-1])
    buried, water, above = (_graded(length) for length in (-support.depth - foot, support.depth, top))
    return np.concatenate([-support.depth - buried[:0:-1], -water[::-1], above[1:]])


def _graded(length: float) -> Float:
    """(n + 1,) [m] distances from 0 to ``length`` in pieces that grow with the distance."""
    edges = [0.0]
    while edges[-1] < length - 1e-9:
        edges.append(edges[-1] + min(max(FINE, GROWTH * edges[-1]), LONGEST))
    return np.array(edges) * (length / edges[-1] if len(edges) > 1 else 1.0)


@dataclass(frozen=True)
class Springs:
    """Lateral springs of the soil along the pile.

    Attributes:
      height: (N,) [m] height above mean sea level.
      stiffness: (N,) [N/m] stiffness of the spring of each piece, along x and y.
      foot: (6, 6) stiffness under the foot.
    """

    height: Float
    stiffness: Float
    foot: Float


def soil_springs(support: Support, soil: Soil) -> Springs:
    """Springs that are the secants of the soil's curves at the load of the case (H-44).

    Iterated: deflection of the embedded part under shear and moment at the mudline with the present springs, secants
    at that deflection, until both agree.
    """
    return _settled(support, soil)[0]


def mudline_deflection(support: Support, soil: Soil) -> float:
    """Deflection [m] of the pile along x at the mudline under the load of the case."""
    return float(_settled(support, soil)[1][-1])


def _settled(support: Support, soil: Soil) -> tuple[Springs, Float]:
    """Springs of the soil, and deflection (N + 1,) [m] at the edges of the pieces."""
    edges = pile_edges(support)
    edges = edges[edges <= -support.depth + 1e-9]
    z, length = 0.5 * (edges[1:] + edges[:-1]), np.diff(edges)
    width = np.interp(z, support.position, support.diameter)
    bending = _bending(support)
    # the foot is free to translate and rotate: negligible springs
    foot = np.diag([FREE * bending] * 2 + [soil.axial_stiffness] + [FREE * bending] * 2 + [soil.torsion_stiffness])
    mesh = assemble(_cut(pile_beam(support), edges[-1] - edges[0]), edges - edges[0])
    moved = np.zeros(len(edges))
    for _ in range(SECANTS):
        pairs = zip(np.interp(z, edges, moved), z, width, strict=True)
        secant = np.array([soil.secant(y, -support.depth - at, d) for y, at, d in pairs])
        springs = Springs(z, secant * length, foot)
        before, moved = moved, _deflection(mesh, springs, edges, soil)
        if np.abs(moved - before).max() <= SETTLED * np.abs(moved).max():
            break
    return springs, moved


def pile_head(support: Support) -> tuple[Float, Float, Float]:
    """Static condensation of the part of a pile in soil to its upper end at the mudline.

    Returns:
      (6, 6) stiffness, its mass (Guyan), and the share of the springs along the pile in the stiffness.
    """
    assert support.soil is not None
    springs, edges = soil_springs(support, support.soil), pile_edges(support)
    edges = edges[edges <= -support.depth + 1e-9]
    mesh = assemble(_cut(pile_beam(support), edges[-1] - edges[0]), edges - edges[0])
    around = spread(springs, edges)
    G = softened(grounded(mesh, springs.foot), around)
    stiffness = np.asarray(np.linalg.inv(G[-6:] @ G[-6:].T), float)
    bent = G @ (G[-6:].T @ stiffness)
    return stiffness, bent.T @ mesh.mass @ bent, (bent.T * around) @ bent


def _bending(support: Support) -> float:
    """Largest bending stiffness [N m^2]."""
    hole = support.diameter - 2.0 * support.thickness
    return float((support.elastic_modulus * np.pi / 64.0 * (support.diameter**4 - hole**4)).max())


def _cut(beam: Beam, length: float) -> Beam:
    """The lowest part of a beam, up to a station."""
    n = int(np.searchsorted(beam.position, length - 1e-6)) + 1
    return Beam(beam.position[:n], beam.axis[:n], beam.stiffness[:n], beam.mass[:n])


def _deflection(mesh: Mesh, springs: Springs, edges: Float, soil: Soil) -> Float:
    """(N + 1,) [m] deflection of the edges of the pieces along x under the load at the mudline."""
    G = softened(grounded(mesh, springs.foot), spread(springs, edges))
    load = np.zeros(len(G))
    load[-6], load[-2] = soil.shear, soil.moment
    deflection: Float = (G @ (G.T @ load)).reshape(-1, 6)[:, 0]
    return deflection


def spread(springs: Springs, heights: Float) -> Float:
    """(6n,) [N/m] stiffness of springs to ground at the nodes of a mesh, at heights (n,) [m], along x and y."""
    stiffness_at_nodes = np.zeros((len(heights), 6))
    place = np.interp(springs.height, heights, np.arange(len(heights)))
    low = np.minimum(place.astype(int), len(heights) - 2)
    for node, share in ((low, low + 1.0 - place), (low + 1, place - low)):
        np.add.at(stiffness_at_nodes[:, 0], node, share * springs.stiffness)
    stiffness_at_nodes[:, 1] = stiffness_at_nodes[:, 0]
    return stiffness_at_nodes.reshape(-1)


def grounded(mesh: Mesh, stiffness: Float) -> Float:
    """Factor G of the flexibility of a beam on springs (6, 6) under its first node: loads f move it by G G^T f."""
    ground = np.linalg.cholesky(np.linalg.inv(stiffness))
    carried_by = (transfer(mesh.points - mesh.points[0]) @ ground).reshape(-1, 6)
    return np.hstack([carried_by, mesh.flexibility])


def softened(G: Float, stiffness: Float) -> Float:
    """The factor of a structure with further springs to ground, (6n,) along the coordinates of its nodes (H-33)."""
    supported = np.flatnonzero(stiffness)
    if not len(supported):
        return G
    inner = np.eye(G.shape[1]) + (G[supported] * stiffness[supported, None]).T @ G[supported]
    result: Float = scipy.linalg.solve_triangular(np.linalg.cholesky(inner), G.T, lower=True).T
    return result


def strain_stiffness(mesh: Mesh, shape: Float, low: float, high: float) -> Float:
    """(k, k) generalised stiffness of the part of a beam between two coordinates, for shapes (k, n, 6) on its mesh."""
    total = np.zeros((len(shape), len(shape)))
    for e, middle in enumerate(0.5 * (mesh.z[1:] + mesh.z[:-1])):
        if not low < middle < high:
            continue
        chord = mesh.points[e + 1] - mesh.points[e]
        bent = shape[:, e + 1] - shape[:, e] @ transfer(chord).T
        factor = mesh.flexibility[6 * e + 6 : 6 * e + 12, 6 * e : 6 * e + 6]
        y = np.linalg.solve(factor, bent.T)
        total += y.T @ y
    return total


def outer_diameter(support: Support, z: Float) -> Float:
    """(n,) [m] diameter with marine growth at heights (n,) [m]."""
    diameter = np.interp(z, support.position, support.diameter)
    for growth in support.growth:
        diameter += 2.0 * growth.thickness * ((z > growth.bottom) & (z < growth.top))
    return diameter


def coefficient(support: Support, name: str, z: Float) -> Float:
    """(n,) hydrodynamic coefficient at heights (n,) [m]."""
    value = np.asarray(getattr(support.hydrodynamics, name))
    return np.interp(z, support.position, value) if value.ndim else np.full(len(z), float(value))


def water_around(support: Support, heights: Float) -> Float:
    """(6n,) [kg] added mass of still water at the nodes of a mesh, at heights (n,) [m], along x and y (H-34)."""
    edges = pile_edges(support)
    z, wet = 0.5 * (edges[1:] + edges[:-1]), np.diff(edges)
    wet = wet * ((z < 0.0) & (z > -support.depth))
    section = 0.25 * np.pi * outer_diameter(support, z) ** 2
    added = support.water_density * coefficient(support, "added_mass", z) * section * wet
    return spread(Springs(z, added, np.eye(6)), heights)


@dataclass(frozen=True)
class Ground:
    """Support of the pile by the ground, and the mass at its foot.

    Attributes:
      base: (6, 6) stiffness under the foot and mass that moves with it; None clamps it.
      around: (6n,) stiffness of the soil along the coordinates of a mesh.
    """

    base: tuple[Float, Float] | None
    around: Float


def ground_of(support: Support, foundation: Foundation | None, heights: Float) -> Ground:
    """The ground for a mesh with nodes at heights (n,) [m]."""
    if support.soil is not None:
        springs = soil_springs(support, support.soil)
        return Ground((springs.foot, np.zeros((6, 6))), spread(springs, heights))
    base = None if foundation is None else (foundation.stiffness, foundation.matrix("mass"))
    return Ground(base, np.zeros(6 * len(heights)))


def supported_tower(
    support: Support,
    tower: Tower,
    counts: dict[str, int],
    tip_mass: Float,
    foundation: Foundation | None,
    layout: NodeLayout,
    *,
    given: bool = False,
) -> ModalMember:
    """Modal member of pile and tower, from the foot of the pile.

    Its modes are the natural ones with the water around the pile; or the static deflections of the pile by unit
    motions of its top (Guyan), and the mode shapes of the description on it, as in OpenFAST. Its damping is that of
    the isolated tower for what the tower deforms, and those of steel and soil in proportion to their share of a mode's
    stiffness (H-35).

    Args:
      tip_mass ... given: as for ``tower_member``; the nodes are those of the tower, from its base.
    """
    alone = tower_member(tower, counts, tip_mass, None, layout, given=given)
    beam = joined(pile_beam(support), tower_beam(tower))
    foot, lift = float(support.position[0]), float(support.position[-1] - support.position[0])
    on_pile = pile_edges(support) - foot
    mesh = assemble(beam, np.concatenate([on_pile, lift + alone.modes.z[1:]]))
    heights = mesh.z + foot
    ground = ground_of(support, foundation, heights)
    if given:
        modes, names = _on_top_of_pile(alone, mesh, len(on_pile), ground, tip_mass)
    else:
        supported, dry = mesh, mesh.mass.copy()
        if ground.base is not None:
            supported = replace(mesh, flexibility=grounded(mesh, ground.base[0]))
            dry[:6, :6] += ground.base[1]
        wet = dry + np.diag(water_around(support, heights))
        supported = replace(supported, flexibility=softened(supported.flexibility, ground.around), mass=wet)
        natural = natural_modes(supported, 12 + 4 * sum(counts.values()), tip_mass=tip_mass)
        flat = natural.shape.reshape(len(natural.shape), -1)
        natural = replace(natural, mass_alone=flat @ dry @ flat.T)
        wanted = {kind: (i, counts[key]) for i, (kind, key) in enumerate(zip(KINDS, counts, strict=True))}
        modes, names = pick_modes(natural, mesh, wanted)
    damping = _damping(support, alone, mesh, modes, names, ground)
    kept = ModalMember(tuple(names), modes, damping, second_order(modes), beam)
    return on_foundation(kept, mesh, foundation)


def _damping(support: Support, alone: ModalMember, mesh: Mesh, modes: Modes, names: list[str], ground: Ground) -> Float:
    """(k, k) generalised damping of tower, steel of the pile, and soil (H-35)."""
    lift, n = float(support.position[-1] - support.position[0]), len(alone.names)
    first, flat = first_frequency(modes), modes.shape.reshape(len(names), -1)
    damping = np.zeros((len(names), len(names)))
    if len(names) == n:
        lag = np.sqrt(np.diag(alone.damping) / np.diag(alone.modes.stiffness))
        damping += strain_stiffness(mesh, modes.shape, lift, math.inf) * np.outer(lag, lag)
    else:
        damping[:n, :n] = alone.damping
    damping += 2.0 * support.damping / first * strain_stiffness(mesh, modes.shape, 0.0, lift)
    if support.soil is not None:
        damping += 2.0 * support.soil.damping / first * (flat * ground.around) @ flat.T
    return damping


def _on_top_of_pile(
    tower: ModalMember, mesh: Mesh, on_pile: int, ground: Ground, tip_mass: Float
) -> tuple[Modes, list[str]]:
    """Shapes of a clamped tower on a pile, and static shapes of the pile for motions of its top that carry the tower.

    Args:
      on_pile: number of the mesh's nodes on the pile.
      tip_mass: (6, 6) inertia that the tower carries, about its top.
    """
    end = 6 * on_pile
    pile = Mesh(mesh.z[:on_pile], mesh.points[:on_pile], mesh.flexibility[:end, : end - 6], mesh.mass[:end, :end])
    G = pile.flexibility if ground.base is None else grounded(pile, ground.base[0])
    G = softened(G, ground.around[:end])
    stiffness = np.linalg.inv(G[-6:] @ G[-6:].T)
    bent = (G @ (G[-6:].T @ stiffness)).reshape(on_pile, 6, 6)
    rigid = transfer(mesh.points[on_pile:] - mesh.points[on_pile - 1])
    static = np.concatenate([bent, rigid])[:, :, TOP_MOTIONS].transpose(2, 0, 1)
    still = np.zeros((len(tower.names), on_pile - 1, 6))
    shape = np.concatenate([np.concatenate([still, tower.modes.shape], axis=1), static])
    flat = shape.reshape(len(shape), -1)
    K = scipy.linalg.block_diag(tower.modes.stiffness, stiffness[np.ix_(TOP_MOTIONS, TOP_MOTIONS)])
    M, top = flat @ mesh.mass @ flat.T, shape[:, -1]
    names = [*tower.names, *(f"pile {BASE_MOTIONS[i]}" for i in TOP_MOTIONS)]
    return Modes(mesh.z, mesh.points, shape, K, M + top @ tip_mass @ top.T, M), names


def first_frequency(modes: Modes) -> float:
    """Lowest natural frequency [rad/s] of a tower with its pile and tip mass, for any set of shapes.

    Raises:
      UnsupportedError: there are none.
    """
    if not len(modes.shape):
        raise UnsupportedError("a tower on a pile or frame needs a mode; keep one, and hold it still by options.locked")
    return float(np.sqrt(scipy.linalg.eigvalsh(modes.stiffness, modes.mass)[0]))
