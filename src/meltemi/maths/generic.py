"""What kernels need beyond arithmetic so that they work for every number type.

For floats these are plain Python. ``lanes`` and ``duals`` give them a meaning for their types.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from math import frexp, ldexp
from typing import Any

from numba import types
from numba.extending import overload


def _for_floats(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile the function as it stands wherever its arguments are plain numbers and arrays."""

    @overload(function, strict=False)
    def choose(*args: Any) -> Any:
        plain = all(isinstance(a, (types.Number, types.Boolean, types.Array)) for a in args)
        return function if plain else None

    return function


@_for_floats
def where(condition: Any, yes: Any, no: Any) -> Any:
    """``yes`` where the condition holds, else ``no``; both are computed."""
    return yes if condition else no


@_for_floats
def anywhere(condition: Any) -> bool:
    """The condition holds for at least one of the numbers: a branch that is worth taking."""
    return bool(condition)


@_for_floats
def total(x: Any) -> Any:
    """Sum over the lanes of a number; a number that has none is its own sum."""
    return x


@_for_floats
def largest(x: Any) -> Any:
    """Largest of the lanes of a number."""
    return x


@_for_floats
def whole(x: Any) -> Any:
    """Integer part, towards zero."""
    return int(x)


@_for_floats
def zero(array: Any) -> Any:
    """Zero of the kind of number that an array holds."""
    return 0.0


@_for_floats
def crossed(x: Any) -> Any:
    """1 where ``x``, the distance from a switch of the model, changes sign within the difference step of a parameter.

    Only a derivative run can tell (``sensitivity``); elsewhere 0.
    """
    return 0.0


@_for_floats
def floor(x: Any) -> Any:
    """Largest whole number that is not above x, as a number of its kind."""
    return float(math.floor(x))


@_for_floats
def two_to(n: Any) -> Any:
    """2 to the power of n, a whole number from -1022 to 1023."""
    return ldexp(1.0, int(n))


@_for_floats
def split(x: Any) -> Any:
    """Mantissa in [sqrt(1/2), sqrt(2)) and exponent of a positive number x = mantissa 2^exponent."""
    m, e = frexp(x)
    return (2.0 * m, e - 1.0) if m < 0.7071067811865476 else (m, float(e))
