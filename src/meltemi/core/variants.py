"""Models that are selected by name, each in a file of this name.

The place of a name in its ``Literal`` is the number of the model in kernels.
"""

from __future__ import annotations

from importlib import import_module
from types import ModuleType
from typing import Any, get_args


def number(kind: Any, name: str) -> int:
    """Number of the model ``name`` of a kind."""
    return get_args(kind).index(name)


def models(package: str, kind: Any) -> list[ModuleType]:
    """Modules of all models of a kind, by number."""
    return [import_module(f"{package}.{name}") for name in get_args(kind)]
