"""Nominal stresses of tubes and rectangles from their section loads (F-50, F-51).

Loads are those of the part beyond a section on the part before it, in member axes: forces x, y, z [N] and moments
x, y, z [N m]; tension is positive.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import InputError
from meltemi.frames.definition import Section
from meltemi.frames.finite_elements import properties

Float = NDArray[np.float64]

ANGLES = 0.25 * np.pi * np.arange(8)
"""[rad] directions of the eight points from the member's x towards its y; those of a rectangle are its corners and
the middles of its sides."""


class Profile(NamedTuple):
    """A section with its points: shape (8,) [m] from its centre, area [m^2], moments [m^4] about x and y.

    ``shear`` (2,) [1/m^2] and ``torsion`` [1/m^3] are the largest shear stress by a force along x and y and by torsion.
    """

    x: Float
    y: Float
    area: float
    inertia_x: float
    inertia_y: float
    shear: Float
    torsion: float


def profile(section: Section) -> Profile:
    """Area, moments and points of a tube or a rectangle.

    Raises:
      InputError: the section is general, without an outline.
    """
    g, t = properties(section, section, 0.0), section.thickness
    c, s = np.cos(ANGLES), np.sin(ANGLES)
    if section.kind == "tube":
        R = 0.5 * g.breadth
        r = float(np.sqrt(g.hole / np.pi))
        shear = 4.0 / 3.0 * (R**2 + R * r + r**2) / (R**2 + r**2) / g.area
        return Profile(R * c, R * s, g.area, g.inertia_x, g.inertia_y, np.full(2, shear), R / g.torsion)
    if section.kind == "rectangle" and section.width is not None and section.height is not None:
        w, h = section.width, section.height
        wi, hi = (0.0, 0.0) if t is None else (w - 2.0 * t, h - 2.0 * t)
        halves = np.array([h * w**2 - hi * wi**2, w * h**2 - wi * hi**2]) / 8.0
        shear = halves / np.array([g.inertia_y, g.inertia_x]) / np.array([h - hi, w - wi])
        a, b = max(w, h), min(w, h)
        torsion = (3.0 * a + 1.8 * b) / (a * b) ** 2 if t is None else 1.0 / (2.0 * t * (w - t) * (h - t))
        x, y = (0.5 * side * np.round(each / np.maximum(np.abs(c), np.abs(s)), 12) for side, each in ((w, c), (h, s)))
        return Profile(x, y, g.area, g.inertia_x, g.inertia_y, shear, torsion)
    raise InputError("stress: a general section has no outline; give a tube or a rectangle")


def nominal_stress(loads: Float, section: Section) -> Float:
    """Axial stress (T, 8) [N/m^2] at the eight points, of section loads (T, 6) (F-50).

    Raises:
      InputError: the section is general.
    """
    p = profile(section)
    bending = loads[:, 3:4] * (p.y / p.inertia_x) - loads[:, 4:5] * (p.x / p.inertia_y)
    return np.asarray(loads[:, 2:3] / p.area + bending)


def shear_stress(loads: Float, section: Section) -> Float:
    """Largest shear stress (T,) [N/m^2] by shear forces and torsion together, on the safe side (F-51).

    Raises:
      InputError: the section is general.
    """
    p = profile(section)
    return np.asarray(np.hypot(*(np.abs(loads[:, :2]) * p.shear).T) + np.abs(loads[:, 5]) * p.torsion)
