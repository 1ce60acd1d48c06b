"""Structural models of the blades.

The name of a model is that of its file in this folder, which has ``System``, the class of the records that its kernels
take, and ``arrays``. Its kernels are variants of ``blade_motion``, ``collect_blades``, ``tip_deflection`` and
``node_load`` for this class; where it has none, those of the modal blade hold (``structure``).
docs/development/extensions.md explains how to add one.
"""

from __future__ import annotations

from importlib import import_module
from types import ModuleType
from typing import Literal

BladeModel = Literal["modal", "geometrically_exact"]
"""Names of the registered models."""


def blade_model(name: BladeModel) -> ModuleType:
    """The module of a model."""
    return import_module(f"{__name__}.{name}")
