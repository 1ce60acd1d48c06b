"""Wake of the tower behind the potential flow around it, for rotors downwind: a cosine, after Powles.

With x and y in tower radii from the tower's axis, x along the wind, r = sqrt(x^2 + y^2), for x > 0, |y| < sqrt(r):

    u = -W min(C_D / sqrt(r) cos^2(pi y / (2 sqrt(r))), 1/2)

Reference: docs/theory/aerodynamics.md (A-53, A-55); Powles (1983), Wind Engineering 7, 26-42.
"""

from __future__ import annotations

from math import cos, pi, sqrt

from meltemi.aero.air import Air
from meltemi.aero.tower_flow import potential
from meltemi.compiler import kernel, where
from meltemi.maths.vectors import Vec


@kernel
def deficit(x: float, y: float, drag: float) -> float:
    """Deficit over the wind at the tower, before its limit (A-53)."""
    width = sqrt(sqrt(x * x + y * y))
    shape = cos(0.5 * pi * y / max(width, 1e-6))
    return where((x > 0.0) & (abs(y) < width), drag / max(width, 1e-6) * shape * shape, 0.0)


@kernel
def influence(p: Vec, m: Air, b: int) -> Vec:
    """Velocity [m/s] that the tower adds to the wind at point p, inertial axes (A-55)."""
    x, y, along, drag = potential.beside_tower(p, m)
    below = max(1.0 - potential.above_top(p, m), 0.0)
    lost = min(deficit(x, y, drag), 0.5) * below * along.z
    return potential.influence(p, m, b) - Vec(lost * along.x, lost * along.y, 0.0)
