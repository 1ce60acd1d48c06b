"""Short texts of values, for representations of objects."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from pydantic.fields import FieldInfo

LONGEST = 60
"""Characters of a value; of a longer one, kind and size are shown."""


def brief(value: Any) -> str:
    """The ``repr`` of a value, shortened to a description if it is long."""
    if isinstance(value, np.ndarray) and value.size > 6:
        return f"<{' x '.join(map(str, value.shape))} numbers>"
    text = repr(value)
    if len(text) <= LONGEST:
        return text
    if isinstance(value, str):
        return f"{text[: LONGEST - 4]}...'"
    if isinstance(value, (Mapping, Sequence)):
        return f"<{len(value)} entries>"
    return f"<{type(value).__name__}>"


def one_line(title: str, facts: Mapping[str, str]) -> str:
    """Names and values in the form of a call."""
    return f"{title}({', '.join(f'{name}={text}' for name, text in facts.items())})"


def rounded(value: float) -> str:
    """A number with four or five significant digits, without exponent if possible."""
    if value != value:
        return "-"
    if value == 0.0:
        return "0"
    size = abs(value)
    if size >= 1e6 or size < 1e-3:
        return f"{value:.3e}"
    exponent = int(f"{size:.3e}"[-3:])  # of the rounded value: 9.9999 has two digits before the point
    return f"{value:.{max(0, 3 - exponent)}f}"


def quantity(value: float, unit: str, name: str = "") -> str:
    """A value in SI with its engineering unit: ``12.1 rpm``, ``5000 kW``.

    Args:
      value: value in SI.
      unit: SI unit; empty without one.
      name: name of the quantity; speeds in rad/s are shown in rpm, rates in deg/s, frequencies as they are.
    """
    from meltemi.core.units import display

    if unit == "rad/s" and "speed" not in name and "rate" not in name:
        return f"{value:.5g} {unit}"
    shown, factor = display(unit, angular_rate_in_degrees="speed" not in name)
    return f"{value * factor:.5g} {shown}".strip()


def is_default(value: Any, field: FieldInfo) -> bool:
    """Whether a field of a record has its default value."""
    return not field.is_required() and brief(field.get_default(call_default_factory=True)) == brief(value)
