"""Common checks of records. Names of fields are separated by blanks; fields that are None are skipped.

Checks raise ValueError, to which the record adds its key path.
"""

from __future__ import annotations

import numpy as np

from meltemi.core.record import Record, Vector


def ordered(record: Record, low: str, high: str, unit: str = "") -> None:
    """Check that one field is less than another; the unit is for the message."""
    below, above = getattr(record, low), getattr(record, high)
    if below >= above:
        unit = f" {unit}" if unit else ""
        raise ValueError(f"{low} {below:g}{unit} must be less than {high} {above:g}{unit}")


def above_ground(hub_height: float, rotor_radius: float) -> None:
    """Check that the blade tips clear the ground."""
    if hub_height <= rotor_radius:
        raise ValueError(f"the blade tips reach the ground: hub at {hub_height:g} m, rotor radius {rotor_radius:g} m")


def stations(values: Vector, what: str) -> Vector:
    """Check that positions [m] of at least two stations increase; returns them."""
    if len(values) < 2:
        raise ValueError(f"{what}: at least two stations are needed")
    steps = np.diff(values)
    if np.any(steps <= 0.0):
        i = int(np.flatnonzero(steps <= 0.0)[0])
        raise ValueError(
            f"{what} must increase from station to station, but station {i + 2} ({values[i + 1]:g} m) "
            f"does not lie beyond station {i + 1} ({values[i]:g} m)"
        )
    return values


def per_station(record: Record, names: str, n: int, against: str = "position") -> None:
    """Check that fields have ``n`` entries, as many as ``against`` has."""
    for name in names.split():
        value = getattr(record, name)
        if value is not None and len(value) != n:
            raise ValueError(f"{name} has {len(value)} entries, but {against} has {n}")


def positive(record: Record, names: str, *, zero: bool = False) -> None:
    """Check that all entries of fields are positive, or zero."""
    for name in names.split():
        value = getattr(record, name)
        if value is not None and np.any(value < 0.0 if zero else value <= 0.0):
            i = int(np.flatnonzero(value < 0.0 if zero else value <= 0.0)[0])
            raise ValueError(f"{name} must be {'zero or ' if zero else ''}positive, but entry {i + 1} is {value[i]:g}")


def angles(record: Record, names: str, limit: float) -> None:
    """Check that angles are within a limit [rad], to detect degrees."""
    for name in names.split():
        value = getattr(record, name)
        if value is not None and np.any(np.abs(value) > limit):
            i = int(np.argmax(np.abs(value)))
            raise ValueError(
                f"{name} is in radians and expected within +-{limit:.2f}, but entry {i + 1} is {value[i]:g}; "
                "if these are degrees, multiply by pi/180 = 0.01745329"
            )
