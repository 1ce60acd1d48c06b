"""Arguments of functions on series as numbers; errors name the argument."""

from __future__ import annotations

from math import inf, isfinite
from operator import index
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import InputError


def floats(values: Any, what: str) -> NDArray[np.float64]:
    """Numbers as a contiguous array of any shape.

    Raises:
      InputError: they are none, or lie in lists of different lengths.
    """
    try:
        given = np.asarray(values, order="C")
        return given.astype(np.float64, casting="unsafe" if given.dtype.kind != "c" else "safe", copy=False)
    except (TypeError, ValueError, OverflowError):
        shown = repr(values)
        shown = shown if len(shown) <= 60 else f"{shown[:57]}..."
        raise InputError(f"{what}: expected numbers in a regular list, found {shown}") from None


def one_row(values: Any, what: str, least: int = 1) -> NDArray[np.float64]:
    """A row of numbers.

    Raises:
      InputError: it has another shape, or fewer than ``least`` values.
    """
    x = floats(values, what)
    if x.ndim != 1 or len(x) < least:
        raise InputError(f"{what}: expected a row of at least {least} numbers, found the shape {x.shape}")
    return x


def number(value: Any, what: str) -> float:
    """A number.

    Raises:
      InputError: it is none.
    """
    if not _is_number(value):
        raise InputError(f"{what} must be a number, found {value!r}")
    return float(value)


def positive(value: Any, what: str) -> float:
    """A number above zero.

    Raises:
      InputError: it is none.
    """
    if not (_is_number(value) and 0.0 < value < inf and not (isinstance(value, int) and value > 10**300)):
        raise InputError(f"{what} must be positive, found {value!r}")
    return float(value)


def whole(value: Any, what: str) -> int:
    """A whole number of at least 1.

    Raises:
      InputError: it is none.
    """
    try:
        n = index(value)
    except TypeError:
        n = int(value) if _is_number(value) and isfinite(value) and value == int(value) else 0
    if n < 1:
        raise InputError(f"{what} must be a whole number of at least 1, found {value!r}")
    return n


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float | np.number) and not isinstance(value, bool | np.complexfloating)
