"""Calls of kernels from Python, several in each exchange for each turbine."""

from __future__ import annotations

from typing import Any

from meltemi.compiler import without_dispatch

_FORMS: dict[tuple[Any, ...], Any] = {}


def quick(function: Any, *args: Any) -> Any:
    """Call a kernel in the compiled form of its last call with such arguments, which saves a look-up of 20 us.

    Arrays must be contiguous: their types in Python do not tell how they lie in memory.
    """
    key = (function, *map(type, args))
    if key in _FORMS:
        return _FORMS[key](*args)
    result = function(*args)
    if hasattr(function, "overloads"):
        _FORMS[key] = without_dispatch(function, *args)
    return result
