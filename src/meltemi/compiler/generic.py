"""Functions beyond arithmetic that kernels need for every number type.

For floats these are plain Python. ``lanes`` and ``duals`` implement them for their types.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from math import frexp, ldexp
from typing import Any

from numba import types
from numba.extending import overload


def _for_floats(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile the function unchanged for plain numbers and arrays."""

    @overload(function, strict=False)
    def choose(*args: Any) -> Any:
        plain = all(isinstance(a, (types.Number, types.Boolean, types.Array)) for a in args)
        return function if plain else None

    return function


@_for_floats
def where(condition: Any, yes: Any, no: Any) -> Any:
    """``yes`` where the condition is true, else ``no``; both are evaluated."""
    return yes if condition else no


@_for_floats
def anywhere(condition: Any) -> bool:
    """Whether the condition is true for at least one lane, so that a branch has to be evaluated."""
    return bool(condition)


@_for_floats
def beyond(x: Any, bound: float) -> Any:
    """Whether |x|, the residual of an iteration, exceeds its bound; always with duals, which converge later."""
    return abs(x) > bound


@_for_floats
def reverse(x: Any) -> bool:
    """Whether this code, with numbers of the type of x, is being differentiated in reverse (``gradients.reverse``)."""
    return False


@_for_floats
def held(x: Any) -> Any:
    """x as a constant: in code differentiated in reverse, it has no derivatives."""
    return x


@_for_floats
def total(x: Any) -> Any:
    """Sum over the lanes of a number; a number without lanes is returned unchanged."""
    return x


@_for_floats
def largest(x: Any) -> Any:
    """Largest of the lanes of a number."""
    return x


@_for_floats
def running(x: Any) -> Any:
    """Sums over the lanes up to each one; a number without lanes is returned unchanged."""
    return x


@_for_floats
def last(x: Any) -> Any:
    """The last of the lanes of a number."""
    return x


@_for_floats
def whole(x: Any) -> Any:
    """Integer part, towards zero."""
    return int(x)


@_for_floats
def neighbours(box: Any, i: Any, k: Any, j: Any) -> Any:
    """The vectors ``box[i, k, j]`` and ``box[i, k, j + 1]`` of a box in single precision: six numbers."""
    lower, upper = box[i, k, j], box[i, k, j + 1]
    return float(lower[0]), float(lower[1]), float(lower[2]), float(upper[0]), float(upper[1]), float(upper[2])


@_for_floats
def zero(array: Any) -> Any:
    """Zero of the number type of an array."""
    return 0.0


@_for_floats
def crossed(x: Any) -> Any:
    """1 where ``x``, the distance from a switch of the model, changes sign within the finite difference of a parameter.

    Only derivative runs (``sensitivity``) evaluate it; elsewhere 0.
    """
    return 0.0


@_for_floats
def floor(x: Any) -> Any:
    """Largest integer not above x, in the type of x."""
    return float(math.floor(x))


@_for_floats
def two_to(n: Any) -> Any:
    """2 to the power of n, an integer from -1022 to 1023."""
    return ldexp(1.0, int(n))


@_for_floats
def split(x: Any) -> Any:
    """Mantissa in [sqrt(1/2), sqrt(2)) and exponent of a positive number x = mantissa 2^exponent."""
    m, e = frexp(x)
    return (2.0 * m, e - 1.0) if m < 0.7071067811865476 else (m, float(e))
