"""Relative thickness of airfoils, used by the rain model."""

from __future__ import annotations

import re

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import InputError
from meltemi.turbine.definition import Turbine

NAMES = (
    (r"naca[ _-]?64(?:_A17)?", 0.18),  # the 64-618 of the NREL 5 MW
    (r"(?:cyl(?:inder)?|circ(?:le|ular)?)[ _-]?\d*", 1.0),
    (r"(\d+(?:\.\d*)?) % thick", 0.01),
    (r"(?:du|ffa|snl-ffa).*[ _-]([1-9]\d\d)", 0.001),  # the wind tunnels' families: thickness in thousandths at the end
    (r"du[ _-]?([1-6]\d)(?:_A17)?", 0.01),  # of the NREL 5 MW, whose decks add the aspect ratio of 17
    (r"naca[ _-]?(?:\d{2,3}|6\d\S*[ _a-]\d)(0[4-9]|[1-4]\d)", 0.01),  # of four, five and six digits
)
"""Patterns of complete names, and the relative thickness, or the unit of the number in the name."""


def relative_thickness(turbine: Turbine) -> NDArray[np.float64]:
    """Thickness over chord at the stations of ``blade.aerodynamics`` (S,).

    From the airfoils' ``relative_thickness``, or their names, see :func:`thickness_in`.

    Raises:
      InputError: an airfoil has neither.
    """
    return np.array([_of(turbine, name) for name in turbine.blade.aerodynamics.airfoil])


def thickness_in(name: str) -> float | None:
    """Relative thickness encoded in an airfoil's name, as in ``DU40_A17``, ``FFA-W3-241`` or ``27.1 % thick``.

    None for a name that is not understood, rather than a guess.
    """
    for pattern, value in NAMES:
        # decks that list an airfoil twice add underscores
        if match := re.fullmatch(pattern, name.rstrip("_"), re.IGNORECASE):
            return value * float(match[1]) if match.groups() else value
    return None


def _of(turbine: Turbine, name: str) -> float:
    given = turbine.airfoils[name].relative_thickness
    thickness = thickness_in(name) if given is None else given
    if thickness is None:
        raise InputError(
            f"{turbine.name}: airfoils.{name}: relative_thickness is missing, and the name does not contain it; "
            "rain requires it for the projected height of the section"
        )
    return thickness
