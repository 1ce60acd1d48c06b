"""Tubular towers: diameter and wall from a turbine's description, and nominal stresses of the shell (G-1 to G-3).

Reference: docs/theory/strength.md.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import pi
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import InputError
from meltemi.turbine.definition import Turbine

Float = NDArray[np.float64]

STEEL = 210e9
"""[N/m^2] Young's modulus by which the wall follows from the bending stiffness."""
DENSITIES = (7500.0, 9200.0)
"""[kg/m^3] least and largest density of a steel tower; 8500 has paint, bolts, welds and flanges in it."""


class Tube(NamedTuple):
    """Section of a tower.

    Attributes:
      diameter: [m] outer diameter.
      thickness: [m] wall.
    """

    diameter: float
    thickness: float

    @property
    def area(self) -> float:
        """Area [m^2] of the wall."""
        return pi * (self.diameter - self.thickness) * self.thickness

    @property
    def inertia(self) -> float:
        """Second moment [m^4] of the area about a diameter."""
        return pi / 64.0 * (self.diameter**4 - (self.diameter - 2.0 * self.thickness) ** 4)

    @property
    def modulus(self) -> float:
        """Section modulus [m^3] of the outer surface."""
        return self.inertia / (0.5 * self.diameter)


def tube_at(turbine: Turbine, height: float) -> tuple[Tube, str]:
    """Section of a tower at a height [m] above its base, and a warning if it does not seem to be of steel (G-1).

    The wall is that which gives the bending stiffness with Young's modulus of steel and the outer diameter.

    Raises:
      InputError: the tower has no such height, or a full section of steel would be less stiff.
    """
    tower = turbine.tower
    if not -1e-6 <= height <= tower.length + 1e-6:
        raise InputError(f"height {height:g} m: the tower of {turbine.name} is {tower.length:g} m long")
    position, d = np.asarray(tower.position), float(np.interp(height, tower.position, tower.diameter))
    wanted = min(float(np.interp(height, position, s)) for s in (tower.fore_aft_stiffness, tower.side_side_stiffness))
    inside = d**4 - 64.0 * wanted / (pi * STEEL)
    if inside <= 0.0:
        raise InputError(
            f"the tower of {turbine.name} is stiffer at {height:g} m than a full rod of steel of its diameter, "
            f"{d:g} m: give diameter and thickness of the weld"
        )
    tube = Tube(d, 0.5 * (d - inside**0.25))
    density = float(np.interp(height, position, tower.mass)) / tube.area
    if DENSITIES[0] <= density <= DENSITIES[1]:
        return tube, ""
    return tube, (
        f"tower at {height:g} m: diameter {d:.3g} m and stiffness give a wall of {1e3 * tube.thickness:.3g} mm of "
        f"steel, whose density by the mass would be {density:.0f} kg/m^3: give diameter and thickness of the weld"
    )


def shell_stresses(loads: Mapping[str, Float], tube: Tube, angles: Float) -> Float:
    """Nominal axial stress of the shell at its outer surface (G-2).

    A positive fore-aft moment pushes the tower downwind and compresses its downwind side.

    Args:
      loads: ``force_z``, ``moment_x``, ``moment_y`` (T,) [N, N m], of the part above on the part below, along the axes
        of the tower base; a force that is missing is zero.
      tube: the section.
      angles: (A,) [rad] places round the shell, from downwind (x) to the left (y).

    Returns:
      (A, T) [N/m^2] tension positive.
    """
    bending = np.outer(np.sin(angles), loads["moment_x"]) - np.outer(np.cos(angles), loads["moment_y"])
    return np.asarray(np.asarray(loads.get("force_z", 0.0)) / tube.area + bending / tube.modulus)


def shear_stress(loads: Mapping[str, Float], tube: Tube) -> float:
    """Largest shear stress [N/m^2] of torsion and shear forces over time, where both add up (G-3).

    Args:
      loads: ``force_x``, ``force_y``, ``moment_z`` (T,) [N, N m]; those that are missing are zero.
      tube: the section.
    """
    force = np.hypot(loads.get("force_x", 0.0), loads.get("force_y", 0.0))
    torsion = np.abs(np.asarray(loads.get("moment_z", 0.0))) / (2.0 * tube.modulus)
    return float(np.max(2.0 * force / tube.area + torsion))
