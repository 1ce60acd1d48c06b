"""Version of the physics, for everything that keeps results."""

from __future__ import annotations

PHYSICS = 4
"""Increased by every change that moves results of an unchanged input by more than rounding.

``tests/regression`` compares its stored numbers under this version; pages with results state it.
"""
