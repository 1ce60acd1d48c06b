"""Failure of plies and buckling of panels: closed forms (G-10 to G-19).

Reference: docs/theory/strength.md.

Indices are proportional to the loads: failure is at 1, and the margin of safety is 1/index - 1.
"""

from __future__ import annotations

from math import pi
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from meltemi.postprocess.cycles import Cycles

if TYPE_CHECKING:
    from meltemi.sections.layup import Material

Float = NDArray[np.float64]

PLANE = (0, 1, 5)
"""Places of 11, 22 and 12 among 11, 22, 33, 23, 13, 12."""
MODES = ("fibre", "across", "shear")


def component_indices(values: Float, tension: Float, compression: Float) -> Float:
    """(..., 3) components 11, 22, 12 over their strengths (G-10); NaN strengths do not count."""
    limits = np.where(values >= 0.0, tension, compression)
    return np.nan_to_num(np.abs(values) / limits, nan=0.0)


def strengths(material: Material) -> tuple[Float, Float]:
    """Strengths (3,) of 11, 22, 12 [Pa] in tension and compression; NaN where the material has none."""
    given = (material.Xt, material.Yt, material.S12), (material.Xc, material.Yc, material.S12)
    tension, compression = (np.array([np.nan if x is None else x for x in each]) for each in given)
    return tension, compression


def stress_indices(material: Material, stress: Float) -> Float:
    """(..., 3) indices of maximum stress in 11, 22 and 12 (G-10) from stresses (..., 6) [Pa]."""
    return component_indices(stress[..., PLANE], *strengths(material))


def strain_indices(material: Material, strain: Float) -> Float:
    """(..., 3) indices of maximum strain (G-11) from strains (..., 6); the limits are strengths over moduli."""
    moduli = np.array([material.E1, material.E2, material.G12])
    tension, compression = strengths(material)
    return component_indices(strain[..., PLANE], tension / moduli, compression / moduli)


def tsai_wu_index(material: Material, stress: Float) -> Float:
    """(...) index of Tsai and Wu (G-12), from stresses (..., 6) [Pa]; NaN if a strength is missing.

    It is the inverse of the factor by which all stresses together would have to grow for failure.
    """
    (xt, yt, s), (xc, yc, _) = strengths(material)
    s1, s2, s12 = (stress[..., i] for i in PLANE)
    linear = (1.0 / xt - 1.0 / xc) * s1 + (1.0 / yt - 1.0 / yc) * s2
    square = s1**2 / (xt * xc) + s2**2 / (yt * yc) + s12**2 / s**2 - s1 * s2 / np.sqrt(xt * xc * yt * yc)
    return np.asarray(0.5 * (linear + np.sqrt(linear**2 + 4.0 * square)))


class SnLine(NamedTuple):
    """A straight S-N line from the static strengths (G-13).

    Attributes:
      tension, compression: [Pa] static strengths.
      m: slope.
      static, fatigue: partial factors of strength, on means, and of fatigue, on amplitudes.
    """

    tension: float
    compression: float
    m: float
    static: float = 1.0
    fatigue: float = 1.0


def goodman_damage(cycles: Cycles, line: SnLine) -> float:
    """Miner's sum of stress cycles [Pa] by a line that is shifted after Goodman (G-13, G-14).

    It is infinite where a mean alone exceeds the strength.
    """
    both, difference = line.tension + line.compression, line.tension - line.compression
    left = both - np.abs(2.0 * line.static * cycles.means - difference)
    if np.any(left <= 0.0):
        return float("inf")
    return float(cycles.counts @ (line.fatigue * cycles.ranges / left) ** line.m)


def bending_stiffness(ABD: NDArray[Any]) -> Float:
    """(3, 3) [N m] bending stiffness D - B A^-1 B of a laminate about its neutral plane (G-16), from its (6, 6)."""
    A, B, D = ABD[:3, :3].real, ABD[:3, 3:].real, ABD[3:, 3:].real
    return np.asarray(D - B @ np.linalg.solve(A, B))


def critical_load(D: Float, width: float) -> float:
    """Critical compression [N/m] of a long orthotropic plate, simply supported at its edges (G-17).

    Args:
      D: (3, 3) [N m] bending stiffness, along the load, across it, twist.
      width: [m] between the edges.
    """
    return float(2.0 * pi**2 / width**2 * (np.sqrt(D[0, 0] * D[1, 1]) + D[0, 1] + 2.0 * D[2, 2]))


def wrinkling_load(membrane: float, thickness: float, E: float, G: float) -> float:
    """Compression [N/m] at which a face wrinkles on a thick core (G-19).

    Args:
      membrane: [N/m] stiffness of the face, modulus times thickness.
      thickness: [m] of the face.
      E, G: [Pa] moduli of the core, through its thickness, and of shear between this and the load.
    """
    return float(0.5 * thickness * (membrane / thickness * E * G) ** (1.0 / 3.0))
