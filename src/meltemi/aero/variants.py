"""Registered models of stall, inflow and tower influence.

The name of a model is that of its file: ``aero/stall/hansen.py`` is the stall model "hansen". The place of the name is
the number of the model in kernels (``AeroOptions``). docs/variants.md explains how to add one.
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
