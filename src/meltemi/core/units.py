"""Unit conversion at the interfaces. Internally all units are SI and radians.

``FIELD`` maps an SI unit to the unit that turbine engineers read (tables, plots, command line):
``display("N m") == ("kN m", 1e-3)``.
"""

from __future__ import annotations

import math
import re
from typing import Any

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
    """Engineering unit and factor for values in SI ``unit``; other units are unchanged.

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


_DEG = math.pi / 180.0
ANGULAR: dict[str, dict[str, float]] = {
    "rad": {"rad": 1.0, "deg": _DEG},
    "rad/s": {"rad/s": 1.0, "deg/s": _DEG, "rpm": math.pi / 30.0},
    "rad/s^2": {"rad/s^2": 1.0, "deg/s^2": _DEG},
    "rad/m": {"rad/m": 1.0, "deg/m": _DEG},
}
"""SI unit -> units in which texts may give it, and their factors."""


def unit_of(description: str | None) -> str:
    """The unit in brackets at the start of a description; empty if there is none."""
    match = re.search(r"\[([^\];]+)", description or "")
    return match[1] if match and match[1] != "-" else ""


def angular_unit(description: str | None) -> str:
    """The unit of a description if it is one of :data:`ANGULAR`; otherwise empty."""
    unit = unit_of(description)
    return unit if unit in ANGULAR else ""


def from_text(value: Any, unit: str) -> Any:
    """SI value of a text such as ``8 deg``, or of each in a list; other values are returned unchanged."""
    if isinstance(value, list | tuple):
        return [from_text(each, unit) for each in value]
    parts = value.split() if isinstance(value, str) else []
    if len(parts) != 2 or parts[1] not in ANGULAR[unit]:
        return value
    try:
        return float(parts[0]) * ANGULAR[unit][parts[1]]
    except ValueError:
        return value


def in_degrees(value: float, unit: str) -> str:
    """A value in SI ``unit`` of :data:`ANGULAR`, formatted in degrees: ``34.4 deg``."""
    return f"{value / _DEG:.3g} {unit.replace('rad', 'deg')}"
