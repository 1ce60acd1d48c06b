"""Hashes of all inputs of a computation, including functions."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from functools import partial
from types import BuiltinFunctionType, CodeType, FunctionType, ModuleType
from typing import Any

import numpy as np


class Unknown(Exception):
    """An object without a reproducible hash."""


def fingerprint(*parts: Any) -> str | None:
    """Hash of values, records, arrays, data classes and functions; None if one has no reproducible content.

    Of a function counts its code, with that of the functions it calls, what it encloses and its defaults.
    """
    digest = hashlib.sha256()
    try:
        _add(digest, parts, set())
    except Unknown:
        return None
    return digest.hexdigest()[:16]


def _add(digest: Any, x: Any, visited: set[FunctionType]) -> None:
    digest.update(f"{type(x).__qualname__}:".encode())
    if x is None or isinstance(x, str | int | float | complex | bytes | np.generic):
        digest.update(f"{x!r};".encode())
    elif isinstance(x, np.ndarray) and x.dtype != object:
        digest.update(f"{x.shape}{x.dtype}".encode() + np.ascontiguousarray(x).tobytes())
    elif hasattr(x, "content_hash") and not isinstance(x, type):
        digest.update(x.content_hash().encode())
    elif isinstance(x, ModuleType | type | BuiltinFunctionType):
        digest.update(f"{getattr(x, '__module__', '')}.{x.__name__};".encode())
    elif isinstance(function := getattr(x, "py_func", x), FunctionType) and function in visited:
        digest.update(f"{function.__qualname__} again;".encode())
    else:
        if isinstance(function, FunctionType):
            visited.add(function)
        for part in _parts(x):
            _add(digest, part, visited)


def _parts(x: Any) -> list[Any]:
    """Feed the content of an object to the digest."""
    if isinstance(x, Mapping):
        return [part for item in x.items() for part in item]
    if isinstance(x, list | tuple):
        return [len(x), *x]
    if isinstance(x, frozenset | set):
        return sorted(x, key=repr)
    if is_dataclass(x):
        return [getattr(x, field.name) for field in fields(x)]
    if isinstance(x, partial):
        return [x.func, x.args, x.keywords]
    if isinstance(x, CodeType):
        return [x.co_code, x.co_consts, x.co_names]
    function = getattr(x, "py_func", x)  # of compiled functions
    if not isinstance(function, FunctionType):
        raise Unknown(type(x).__name__)
    enclosed = [cell.cell_contents for cell in function.__closure__ or ()]
    called = [function.__globals__[name] for name in _names(function.__code__) if name in function.__globals__]
    return [function.__code__, function.__defaults__, function.__kwdefaults__, enclosed, called]


def _names(code: CodeType) -> list[str]:
    """Global names used by a function and by its nested functions."""
    inner = [name for const in code.co_consts if isinstance(const, CodeType) for name in _names(const)]
    return [*code.co_names, *inner]
