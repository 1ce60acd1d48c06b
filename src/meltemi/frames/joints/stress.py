"""Nominal stresses of tubes and rectangles from their section loads (F-50, F-51).

Loads are those of the part beyond a section on the part before it, in member axes: forces x, y, z [N] and moments
x, y, z [N m]; tension is positive.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import InputError
from meltemi.frames.definition import Section
from meltemi.frames.sections import properties

Float = NDArray[np.float64]

ANGLES = 0.25 * np.pi * np.arange(8)
"""[rad] directions of eight points from the member's x towards its y; those of a rectangle are corners and middles."""


def nominal_stress(loads: Float, section: Section) -> Float:
    """Axial stress (T, 8) [N/m^2] at the eight points, of section loads (T, 6) (F-50).

    Raises:
      InputError: the section is a general one, without an outline.
    """
    if section.kind == "general":
        raise InputError("stress: a general section has no outline; give a tube or a rectangle")
    p, tube = properties(section, section, 0.0), section.kind == "tube"
    c, s = np.cos(ANGLES), np.sin(ANGLES)
    scale = 1.0 if tube else np.maximum(np.abs(c), np.abs(s))
    w, h = (p.breadth, p.breadth) if tube else (float(section.width or 0.0), float(section.height or 0.0))
    x, y = 0.5 * w * c / scale, 0.5 * h * s / scale
    return np.asarray(loads[:, 2:3] / p.area + loads[:, 3:4] * (y / p.inertia_x) - loads[:, 4:5] * (x / p.inertia_y))


def shear_stress(loads: Float, section: Section) -> Float:
    """Largest shear stress (T,) [N/m^2] of a tube, by shear forces and torsion together (F-51).

    Raises:
      InputError: the section is no tube.
    """
    if section.kind != "tube":
        raise InputError(f"shear stress: it is known of tubes, the section is {section.kind}")
    p = properties(section, section, 0.0)
    R, r = 0.5 * p.breadth, np.sqrt(p.hole / np.pi)
    largest = 4.0 / 3.0 * (R**2 + R * r + r**2) / (R**2 + r**2) / p.area
    return np.asarray(largest * np.hypot(loads[:, 0], loads[:, 1]) + np.abs(loads[:, 5]) * R / p.torsion)
