"""Geometry of the sections of members: tubes, rectangles, and general ones.

Reference: docs/theory/frames.md (F-1 to F-3).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from meltemi.frames.definition import Section


class Properties(NamedTuple):
    """Geometry of a section; areas [m^2], moments [m^4], about the member's axes x and y."""

    area: float
    shear_x: float
    shear_y: float
    inertia_x: float
    inertia_y: float
    torsion: float
    hole: float
    """[m^2] area inside the wall."""
    breadth: float
    """[m] outer diameter, or that of a rod or square with the sides' mean."""


def properties(first: Section, last: Section, x: float) -> Properties:
    """Section at a fraction ``x`` of a member whose dimensions change linearly (F-1 to F-3)."""

    def between(name: str, otherwise: float | None = None) -> float:
        a, b = (getattr(each, name) for each in (first, last))
        if a is None or b is None:
            assert otherwise is not None
            return otherwise
        return float(a + (b - a) * x)

    nu = 0.5 * first.elastic_modulus / first.shear_modulus - 1.0
    if first.kind == "tube":
        d = between("diameter")
        hole = max(d - 2.0 * between("thickness", 0.5 * d), 0.0)
        area, inertia = 0.25 * np.pi * (d**2 - hole**2), np.pi / 64.0 * (d**4 - hole**4)
        shear = area * _shear_of_tube(nu, hole / d)
        return Properties(area, shear, shear, inertia, inertia, 2.0 * inertia, 0.25 * np.pi * hole**2, d)
    if first.kind == "rectangle":
        w, h = between("width"), between("height")
        t = between("thickness", 0.5 * min(w, h))
        a, b = max(w - 2.0 * t, 0.0), max(h - 2.0 * t, 0.0)
        area = w * h - a * b
        shear_x, shear_y = (area * _shear_of_box(nu, *sides) for sides in ((w, h, t, a * b), (h, w, t, a * b)))
        moments = (w * h**3 - a * b**3) / 12.0, (h * w**3 - b * a**3) / 12.0
        long, short = max(w, h), min(w, h)
        torsion = long * short**3 * (1.0 / 3.0 - 0.21 * short / long * (1.0 - (short / long) ** 4 / 12.0))
        if a * b > 0.0:
            torsion = 2.0 * t * (w - t) ** 2 * (h - t) ** 2 / (w + h - 2.0 * t)
        return Properties(area, shear_x, shear_y, *moments, torsion, a * b, 0.5 * (w + h))
    area = between("area")
    x_area, y_area = (between(name, 5.0 / 6.0 * area) for name in ("shear_area_x", "shear_area_y"))
    moments = between("inertia_x"), between("inertia_y")
    return Properties(area, x_area, y_area, *moments, between("torsion"), 0.0, first.breadth)


def _shear_of_tube(nu: float, r: float) -> float:
    """Share of a tube's area that carries shear, by Poisson's ratio and inner over outer diameter (Steinboeck 2013)."""
    a = (1.0 + r * r) ** 2
    below = a * (7.0 + 14.0 * nu + 8.0 * nu**2) + 4.0 * r**2 * (5.0 + 10.0 * nu + 4.0 * nu**2)
    return 6.0 * (1.0 + nu) ** 2 * a / below


def _shear_of_box(nu: float, height: float, width: float, t: float, inner: float) -> float:
    """That of a rectangle under shear along ``height``: solid, or a box of thin walls (Cowper 1966)."""
    if inner == 0.0:
        return 10.0 * (1.0 + nu) / (12.0 + 11.0 * nu)
    m = n = (width - t) / (height - t)
    webs = 12.0 + 72.0 * m + 150.0 * m**2 + 90.0 * m**3 + nu * (11.0 + 66.0 * m + 135.0 * m**2 + 90.0 * m**3)
    flanges = 10.0 * n**2 * ((3.0 + nu) * m + 3.0 * m**2)
    return 10.0 * (1.0 + nu) * (1.0 + 3.0 * m) ** 2 / (webs + flanges)
