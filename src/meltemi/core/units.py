"""Units at the borders. Inside there is only SI and radians.

``FIELD`` maps an SI unit to the unit that turbine engineers read (tables, plots, command line):
``display("N m") == ("kN m", 1e-3)``.
"""

from __future__ import annotations

import math

FIELD: dict[str, tuple[str, float]] = {
    "rad": ("deg", 180.0 / math.pi),
    "rad/s": ("rpm", 30.0 / math.pi),
    "N": ("kN", 1e-3),
    "N m": ("kN m", 1e-3),
    "W": ("kW", 1e-3),
    "var": ("kvar", 1e-3),
    "V": ("kV", 1e-3),
}
"""SI unit -> (field unit, factor). Rotational speeds of shafts are read in rpm; see ``display``."""


def display(unit: str, *, angular_rate_in_degrees: bool = False) -> tuple[str, float]:
    """Field unit and factor for values in SI ``unit``; units without an entry are kept.

    Args:
      unit: SI unit as written in the channel catalogue.
      angular_rate_in_degrees: pitch and yaw rates are read in deg/s, shaft speeds in rpm.
    """
    if unit == "rad/s" and angular_rate_in_degrees:
        return "deg/s", 180.0 / math.pi
    return FIELD.get(unit, (unit, 1.0))


def deg(value_in_degrees: float) -> float:
    """Radians from degrees."""
    return math.radians(value_in_degrees)


def rpm(value_in_rpm: float) -> float:
    """Radians per second from revolutions per minute."""
    return value_in_rpm * math.pi / 30.0
