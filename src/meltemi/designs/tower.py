"""The tower as a tube: mass and stiffness of changed diameters and walls.

Reference: docs/theory/designs.md (D-8, D-11).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import InputError

Float = NDArray[np.float64]
WALLS = ("tower.diameter", "tower.thickness")
"""Paths of factors on the outer diameter and on the thickness of the wall."""
MODULUS = 210e9
"""[N/m^2] Young's modulus by which the wall follows from diameter and stiffness: 5 % of it change mass and stiffness of
a wall of a hundredth of the diameter, made a third thicker, by 2e-4 and 4e-4."""


def wall_thickness(diameter: Float, stiffness: Float) -> Float:
    """(S,) [m] wall of the steel tube of outer diameters (S,) [m] and bending stiffness (S,) [N m^2].

    Raises:
      InputError: a full bar is less stiff.
    """
    inner = diameter**4 - 64.0 / np.pi * stiffness / MODULUS
    if np.any(inner < 0.0):
        i = int(np.argmin(inner))
        raise InputError(
            f"variables: tower.thickness: no steel tube of {diameter[i]:.4g} m has the bending stiffness of station "
            f"{i + 1}, {stiffness[i]:.4g} N m^2"
        )
    return 0.5 * (diameter - np.sqrt(np.sqrt(inner)))


def area_and_second_moment(diameter: Float, thickness: Float) -> tuple[Float, Float]:
    """(S,) area [m^2] and second moment of area [m^4] of tubes of outer diameter and thickness [m]."""
    inner = diameter - 2.0 * thickness
    return 0.25 * np.pi * (diameter**2 - inner**2), np.pi / 64.0 * (diameter**4 - inner**4)


def put_walls(tower: dict[str, Any], factors: Mapping[str, Float]) -> None:
    """Change diameter and wall of a tower's description by factors (S,): mass, axial and shear stiffness with the area,
    bending and torsion with the second moment (D-11).

    Raises:
      InputError: the wall is thicker than the radius.
    """
    diameter = np.asarray(tower["diameter"], dtype=float)
    thickness = wall_thickness(diameter, np.asarray(tower["fore_aft_stiffness"], dtype=float))
    new = [factors.get(path, 1.0) * each for path, each in zip(WALLS, (diameter, thickness), strict=True)]
    if np.any(2.0 * new[1] >= new[0]):
        raise InputError("variables: tower.thickness: the wall is thicker than the tower's radius")
    ratios = np.array(area_and_second_moment(*new)) / np.array(area_and_second_moment(diameter, thickness))
    of = dict.fromkeys(("mass", "axial_stiffness", "shear_stiffness"), 0)
    of |= dict.fromkeys(("fore_aft_stiffness", "side_side_stiffness", "torsion_stiffness"), 1)
    tower["diameter"] = list(new[0])
    for name, i in of.items():
        if tower.get(name) is not None:
            tower[name] = list(np.asarray(tower[name], dtype=float) * ratios[i])


def strain_per_moment(turbine: Any) -> float:
    """[1/(N m)] strain of the outer fibre at the tower's base by a fore-aft moment (D-8).

    Raises:
      InputError: the turbine has no tower.
    """
    if (tower := getattr(turbine, "tower", None)) is None:
        raise InputError(f"terms: tower_base_strain: {turbine.name} has no tower")
    return 0.5 * float(tower.diameter[0]) / float(tower.fore_aft_stiffness[0])
