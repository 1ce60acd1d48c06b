"""Models of which a turbine has one at a time: each name is a file, and this is where it is registered.

``aero/stall/hansen.py`` is the stall model "hansen". The place of a name is the number by which kernels know the model
(``AeroOptions``). docs/development.md shows how to add one.
"""

from __future__ import annotations

from importlib import import_module
from types import ModuleType
from typing import Any, Literal, get_args

StallModel = Literal["static", "hansen"]
InflowModel = Literal["quasi_steady", "constant", "variable"]
TowerInfluence = Literal["none", "potential", "lower_half"]


def number(kind: Any, name: str) -> int:
    """Number of the model ``name`` of a kind."""
    return get_args(kind).index(name)


def models(package: str, kind: Any) -> list[ModuleType]:
    """Modules of all models of a kind, by number."""
    return [import_module(f"{package}.{name}") for name in get_args(kind)]
