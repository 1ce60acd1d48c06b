"""Classical lamination theory of a wall (B-1 to B-3).

Axes of a wall: z along the blade, s along the contour, n inwards (to the other side of a web). The order of strains is
zz, ss, zs; depth is measured along n from the middle of the wall.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meltemi.sections.layup import Material, Ply

Numbers = NDArray[Any]
HELD = [0, 2, 3, 5]
"""Membrane and bending strains zz and zs."""


def rotation(angle: float) -> NDArray[np.float64]:
    """(3, 3) strains 11, 22, 12 of a ply from zz, ss, zs, with fibres turned from z towards s (B-1)."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c * c, s * s, c * s], [s * s, c * c, -c * s], [-2.0 * c * s, 2.0 * c * s, c * c - s * s]])


def turned(material: Material, angle: float) -> NDArray[np.float64]:
    """(3, 3) [Pa] stresses zz, ss, zs of a ply from its strains."""
    T = rotation(angle)
    return T.T @ material.plane @ T


@dataclass(frozen=True)
class Laminate:
    """Stiffness and mass of a wall about its middle.

    Attributes:
      ABD: (6, 6) forces per width zz, ss, zs [N] and moments [N m] from strains and curvatures.
      wall: (4, 4) N_zz, N_zs, M_zz, M_zs from their strains (B-3).
      across: (2, 4) strain and curvature ss that follow.
      faces: (plies + 1,) [m] depths of the faces of the plies.
      mass: (3,) density times 1, depth, depth squared.
    """

    ABD: Numbers
    wall: Numbers
    across: Numbers
    faces: Numbers
    mass: Numbers


def laminate(
    plies: Sequence[tuple[Ply, complex]], materials: Mapping[str, Material], *, closed: bool, curvature: float = 0.0
) -> Laminate:
    """Laminate of plies with their thickness [m], from the outside to the inside.

    Args:
      curvature: [1/m] of the wall towards n: plies are shorter there.
      closed: the wall is part of a closed cell and keeps its curvature across the blade; otherwise M_ss = 0. N_ss =
        0 in both.
    """
    t = np.array([thickness for _, thickness in plies])
    faces = np.concatenate([[0.0], np.cumsum(t)]) - 0.5 * np.sum(t)
    ABD = np.zeros((6, 6), dtype=faces.dtype)
    mass = np.zeros(3, dtype=faces.dtype)
    for (ply, _), low, high in zip(plies, faces[:-1], faces[1:], strict=True):
        material = materials[ply.material]
        Q = turned(material, ply.angle)
        powers = [(high**k - low**k) / k for k in (1, 2, 3, 4)]
        m0, m1, m2 = (a - curvature * b for a, b in itertools.pairwise(powers))
        ABD[:3, :3] += m0 * Q
        ABD[:3, 3:] += m1 * Q
        ABD[3:, 3:] += m2 * Q
        mass += material.density * np.array([m0, m1, m2])
    ABD[3:, :3] = ABD[:3, 3:]
    free = [1] if closed else [1, 4]
    found = -np.linalg.solve(ABD[np.ix_(free, free)], ABD[np.ix_(free, HELD)])
    wall = ABD[np.ix_(HELD, HELD)] + ABD[np.ix_(HELD, free)] @ found
    across = np.concatenate([found, np.zeros((2 - len(free), 4))])
    return Laminate(ABD, wall, across, faces, mass)
