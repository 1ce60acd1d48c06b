"""Mode shapes for ElastoDyn: the polynomials with which its kinematics are closest to the natural modes.

ElastoDyn's blade and tower move in shapes c_2 x^2 + ... + c_6 x^6 of the relative span, with c_2 + ... + c_6 = 1, and
the curvature of a blade follows the twist of its sections. The shapes are not fitted to natural modes; they are the
Ritz vectors of this kinematics: with the five powers as coordinates, the coefficients are an eigenvector of stiffness
and mass.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from meltemi.simulation.bladed.rotor import BladedModel
from meltemi.structure.members import blade_member, tower_member
from meltemi.turbine.definition import BladeStructure, ModeShapes

Float = NDArray[np.float64]

POWERS = tuple(tuple(float(i == j) for i in range(5)) for j in range(5))
"""Coefficients of x^2 to x^6, one in each shape."""


@dataclass(frozen=True)
class Shape:
    """A mode of a member in ElastoDyn.

    Attributes:
      coefficients: coefficients of x^2 to x^6.
      frequency: [rad/s] natural frequency with this shape; that of a tower includes the tower-top mass.
    """

    coefficients: tuple[float, ...]
    frequency: float


def blade_shapes(blade: BladeStructure, model: BladedModel) -> tuple[list[Shape], list[Shape]]:
    """Two flap shapes and an edge shape of the clamped blade with classical sections."""
    basis = blade.replace(mode_shapes=ModeShapes(flap=POWERS, edge=POWERS))
    member = blade_member(basis, {"flap": 5, "edge": 5, "torsion": 0}, model.rotor.blade_layout, given=True)
    K, M = member.modes.stiffness, member.modes.mass
    return _ritz(K[:5, :5], M[:5, :5], 2), _ritz(K[5:, 5:], M[5:, 5:], 1)


def tower_shapes(model: BladedModel, head: Float) -> tuple[list[Shape], list[Shape]]:
    """Two fore-aft and two side-to-side shapes of the clamped tower that carries ``head`` (6, 6) on its top."""
    basis = model.turbine.tower.replace(mode_shapes=ModeShapes(fore_aft=POWERS, side_side=POWERS))
    counts = {"fore_aft": 5, "side_side": 5, "torsion": 0}
    modes = tower_member(basis, counts, head, None, model.rotor.tower_layout, given=True).modes
    top = modes.shape[:, -1, :]
    M = modes.mass + top @ head @ top.T
    return _ritz(modes.stiffness[:5, :5], M[:5, :5], 2), _ritz(modes.stiffness[5:, 5:], M[5:, 5:], 2)


def _ritz(K: Float, M: Float, n: int) -> list[Shape]:
    value, vector = scipy.linalg.eigh(K, M)
    return [Shape(tuple((vector[:, i] / vector[:, i].sum()).tolist()), float(np.sqrt(value[i]))) for i in range(n)]
