"""Potential flow around the tower, for blades that point down only."""

from __future__ import annotations

from math import cos

from meltemi.aero.air import Air
from meltemi.aero.tower_flow import potential
from meltemi.compiler import kernel
from meltemi.maths.vectors import Vec


@kernel
def influence(p: Vec, m: Air, b: int) -> Vec:
    """Velocity [m/s] that the tower adds to the wind at point p, inertial axes."""
    added = Vec(0.0, 0.0, 0.0)
    if cos(m.frame.azimuth[b]) <= 0.0:
        added += potential.influence(p, m, b)
    return added
