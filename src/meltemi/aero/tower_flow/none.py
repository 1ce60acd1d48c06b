"""No influence of the tower on the wind."""

from __future__ import annotations

from meltemi.aero.air import Air
from meltemi.compiler import kernel
from meltemi.maths.vectors import Vec


@kernel
def influence(p: Vec, m: Air, b: int) -> Vec:
    """Zero velocity."""
    return Vec(0.0, 0.0, 0.0)
