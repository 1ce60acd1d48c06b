"""Usual ranges of numbers, which stand beside their units: ``[kg; 1e3 to 1e5 at 100 m]`` in the text below a field.

A number (of a list, the largest magnitude) beyond its range is reported, except zero and the default. A range
``at 100 m`` is that of a turbine of this rotor diameter; it goes with the diameter by geometric similarity at equal tip
speed (docs/guide/scaling.md): lengths and times in proportion to it, masses to its cube, and all else as its unit says.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from functools import cache
from typing import Any, NamedTuple

import numpy as np

from meltemi.core.record import Record
from meltemi.core.units import ANGULAR, in_degrees

AT = 100.0
"""[m] rotor diameter to which ranges that scale with it refer."""
POWERS = {"m": 1, "s": 1, "kg": 3, "N": 2, "W": 2}
"""Exponents of the rotor diameter by which ranges scale, by unit."""


class UsualRange(NamedTuple):
    """Unit, least and largest usual magnitude, and the exponent of the rotor diameter."""

    unit: str
    least: float
    most: float
    power: int | None


def usual_range(description: str | None) -> UsualRange | None:
    """The usual range in a description, if there is one."""
    match = re.search(r"\[([^\];]*); ([-+.\de]+) to ([-+.\de]+)( at 100 m)?\]", description or "")
    return match and UsualRange(match[1], float(match[2]), float(match[3]), _similarity(match[1]) if match[4] else None)


def _similarity(unit: str) -> int:
    total, sign = 0, 1
    for part in re.findall(r"/|[^\s/]+", unit):
        name, _, power = part.partition("^")
        total += sign * POWERS.get(name, 0) * int(power or 1)
        sign = -1 if part == "/" else sign
    return total


@cache
def _fields(kind: type[Record]) -> list[tuple[str, UsualRange | None, Any]]:
    return [(name, usual_range(field.description), field.default) for name, field in kind.model_fields.items()]


def unusual_numbers(record: Record, where: str = "", diameter: float | None = None) -> Iterator[str]:
    """Sentences about numbers in a record beyond their usual ranges; of a field of records alike, one.

    Args:
      where: key path of the record; diameter: [m] of the rotor, without which ranges that scale with it are left out.
    """
    reported: set[tuple[type[Record], str]] = set()
    todo = [(where, record)]
    for place, each in todo:
        for name, usual, default in _fields(type(each)):
            value, key = getattr(each, name), f"{place}.{name}".lstrip(".")
            if isinstance(value, Record):
                todo.append((key, value))
            elif isinstance(value, dict | tuple) and usual is None:
                pairs = value.items() if isinstance(value, dict) else enumerate(value)
                todo += [(f"{key}.{i}", inner) for i, inner in pairs if isinstance(inner, Record)]
            elif usual is not None and value is not None and value is not default and not isinstance(value, str):
                size = 1.0 if usual.power is None else ((diameter or np.nan) / AT) ** usual.power
                amount = float(np.abs(value).max() if isinstance(value, np.ndarray | tuple) else abs(value))
                least, most = usual.least * size, usual.most * size
                if amount and (amount < least or amount > most) and (type(each), name) not in reported:
                    reported.add((type(each), name))
                    unit = "" if usual.unit in ("", "-") else f" {usual.unit}"
                    turned = f" ({in_degrees(amount, usual.unit)})" if usual.unit in ANGULAR else ""
                    of = f" for a rotor of {diameter:.3g} m" if usual.power else ""
                    yield f"{key}: {amount:.4g}{unit}{turned} is unusual; usual is {least:.2g} to {most:.2g}{unit}{of}"
