"""Relative thickness of airfoils, which only rain asks for."""

from __future__ import annotations

import re

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import InputError
from meltemi.turbine.definition import Turbine

NAMES = (
    (r"naca64$", 0.18),  # the 64-618 of the NREL 5 MW
    (r"cyl|circ", 1.0),
    (r"([\d.]+) % thick$", 0.01),
    (r"(?:du|ffa|snl-ffa).*-(\d{3})$", 0.001),
    (r"du.*?(\d\d)$", 0.01),
    (r"naca.*(\d\d)$", 0.01),
)
"""Patterns of names, and the thickness or the unit of the number that stands in them."""


def relative_thickness(turbine: Turbine) -> NDArray[np.float64]:
    """Thickness over chord at the stations of ``blade.aerodynamics`` (S,).

    From the airfoils' ``relative_thickness``, or their names, as in ``DU40``, ``FFA-W3-241`` or ``27.1 % thick``.

    Raises:
      InputError: an airfoil has neither.
    """
    return np.array([_of(turbine, name) for name in turbine.blade.aerodynamics.airfoil])


def _of(turbine: Turbine, name: str) -> float:
    given = turbine.airfoils[name].relative_thickness
    if given is not None:
        return given
    for pattern, value in NAMES:
        if said := re.match(pattern, name, re.IGNORECASE):
            return value * float(said[1]) if said.groups() else value
    raise InputError(
        f"{turbine.name}: airfoils.{name}: relative_thickness is missing; drops hit a section as it is seen along the "
        "flow, so rain needs it"
    )
