"""Tubular towers: diameter and wall from a turbine's description, stresses (G-1 to G-3) and buckling (G-20 to G-24).

Reference: docs/theory/strength.md.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import pi
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from meltemi.core.errors import InputError
from meltemi.core.record import Record
from meltemi.turbine.definition import Turbine

Float = NDArray[np.float64]

STEEL = 210e9
"""[N/m^2] Young's modulus by which the wall follows from the bending stiffness."""
DENSITIES = (7500.0, 9200.0)
"""[kg/m^3] least and largest density of a steel tower; 8500 has paint, bolts, welds and flanges in it."""

QUALITY = {"A": 40.0, "B": 25.0, "C": 16.0}
"""Fabrication quality parameters (EN 1993-1-6, table D.2)."""


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


class Shell(Record):
    """Shell of a tower between its stiffeners, for buckling after EN 1993-1-6."""

    strength: float = Field(default=345e6, ge=200e6, le=700e6)
    """[N/m^2; 235e6 to 460e6] yield stress; 345 MPa is that of S355 up to 40 mm."""
    length: float | None = Field(default=None, gt=0.1, lt=500.0)
    """[m; 10 to 150] between flanges or ring stiffeners; by default the whole tower."""
    quality: Literal["A", "B", "C"] = "B"
    """Fabrication tolerance quality class: A excellent, B high, C normal."""
    factor: float = Field(default=1.1, ge=1.0, le=2.0)
    """Partial factor [-; 1.1 to 1.2] of the resistance to buckling."""


def buckling_stress(tube: Tube, length: float, shell: Shell, share: float) -> float:
    """Characteristic buckling stress [N/m^2] of a cylinder under compression along its axis (G-21 to G-24).

    Args:
      tube: the section.
      length: [m] between stiffeners.
      shell: yield stress and quality.
      share: part of bending in the compression.
    """
    slender = 0.5 * (tube.diameter - tube.thickness) / tube.thickness
    omega, squash = length / (np.sqrt(slender) * tube.thickness), 0.2
    if omega <= 1.7:
        C = 1.36 - 1.83 / omega + 2.07 / omega**2
    else:
        C = float(np.clip(1.0 + 0.2 * (1.0 - 2.0 * omega / slender), 0.6, 1.0))
        if omega > 0.5 * slender and omega <= 6.0 * slender and slender <= 150.0 and STEEL / shell.strength >= 500.0:
            C, squash = share + (1.0 - share) * C, 0.2 + 0.1 * share
    reduced = 0.62 / (1.0 + 1.91 * (np.sqrt(slender) / QUALITY[shell.quality]) ** 1.44)
    slenderness, plastic = np.sqrt(shell.strength / (0.605 * STEEL * C / slender)), np.sqrt(reduced / 0.4)
    if slenderness >= plastic:
        return float(shell.strength * reduced / slenderness**2)
    return float(shell.strength * min(1.0 - 0.6 * (slenderness - squash) / (plastic - squash), 1.0))


def buckling_utilisation(loads: Mapping[str, Float], tube: Tube, length: float, shell: Shell) -> float:
    """Largest compression of the shell under loads with their factor, over its resistance (G-20).

    Args:
      loads: see :func:`shell_stresses`.
      tube: the section.
      length: [m] between stiffeners, unless the shell gives it.
      shell: yield stress, quality, partial factor.
    """
    bending = np.hypot(loads["moment_x"], loads["moment_y"]) / tube.modulus
    stress = bending - np.asarray(loads.get("force_z", 0.0)) / tube.area
    worst = int(stress.argmax())
    share = min(float(bending[worst] / max(stress[worst], 1e-9)), 1.0)
    resistance = buckling_stress(tube, shell.length or length, shell, share) / shell.factor
    return max(float(stress[worst]), 0.0) / resistance
