"""Kernels as the plain Python in which they are written, and records of what a test gives them."""

from __future__ import annotations

from collections.abc import Callable
from types import FunctionType, ModuleType, SimpleNamespace
from typing import Any, TypeVar

import numpy as np

from meltemi.compiler import KernelRecord, View
from meltemi.compiler.dispatch import Variants

R = TypeVar("R", bound=KernelRecord)
T = TypeVar("T")
_PLAIN: dict[Any, Callable[..., Any]] = {}


def plain(kernel: Any) -> Callable[..., Any]:
    """A kernel, or a function with variants, that runs without compilation, as does every kernel that it calls."""
    if isinstance(kernel, Variants):

        def dispatched(*args: Any) -> Any:
            found = [plain(each)(*args) for each in kernel.called(type(args[kernel.place]))]
            return found[0] if found else None

        return dispatched
    text = getattr(kernel, "py_func", kernel)
    if text not in _PLAIN:
        names = dict(text.__globals__)
        _PLAIN[text] = FunctionType(text.__code__, names, text.__name__, text.__defaults__, text.__closure__)
        for name in text.__code__.co_names:
            called = names.get(name)
            if isinstance(called, ModuleType) and called.__name__.startswith("meltemi"):
                inside = (each for each in text.__code__.co_names if hasattr(called, each))
                names[name] = SimpleNamespace(**{each: _as_text(getattr(called, each)) for each in inside})
            elif name in names:
                names[name] = _as_text(called)
    return _PLAIN[text]


def _as_text(called: Any) -> Any:
    """What a kernel calls, without compilation; other objects as they are."""
    own = isinstance(called, FunctionType) and called.__module__.startswith("meltemi")  # without compilation
    return plain(called) if own or isinstance(called, Variants) or hasattr(called, "py_func") else called


def record(cls: type[R], **members: Any) -> R:
    """A record with some of its members only, for plain kernels: tables, arrays, or records in their place."""
    made = object.__new__(cls)
    for name, member in members.items():
        setattr(made, name, member)
    return made


def table(cls: type[T], sizes: dict[str, int], **fields: Any) -> T:
    """A table with axes of these sizes: numbers (...), vectors (3, ...) by field, zero where none are given."""
    kind: Any = cls
    array = kind.zeros(**sizes)
    if kind.integer:
        array = array.astype(np.int64)
    made: T = kind(array)
    for name, value in fields.items():
        rows = View(kind, array).rows(name)
        if kind.outer:
            array.reshape(-1, len(kind), *array.shape[1:])[:, rows] = value
        else:
            array[(..., rows) if kind.fields_last else rows] = value
    return made
