"""Wake of the tower behind the potential flow around it, for rotors downwind: a Gaussian, after Eames.

With x and y in tower radii from the tower's axis, x along the local wind, for x > 0:

    u = -W min(C_D / (sqrt(2 pi) I x) exp(-(y / (I x))^2 / 2), 1/2)

with the turbulence intensity I of the wake.

Reference: docs/theory/aerodynamics.md (A-54, A-55); Eames, Jonsson and Johnson (2011), J. Turbulence 12, N39.
"""

from __future__ import annotations

from math import exp, pi, sqrt

from meltemi.aero.air import Air
from meltemi.aero.tower_flow import potential
from meltemi.compiler import kernel, where
from meltemi.maths.vectors import Vec

INTENSITY = 0.1
"""Turbulence intensity of the wake of the tower."""
FAR = 30.0
"""Widths beyond which there is no deficit."""


@kernel
def deficit(x: float, y: float, drag: float) -> float:
    """Deficit over the wind at the tower, before its limit (A-54)."""
    width = INTENSITY * max(x, 1e-6)
    ratio = min(abs(y) / width, FAR)
    return where(x > 0.0, drag / (sqrt(2.0 * pi) * width) * exp(-0.5 * ratio * ratio), 0.0)


@kernel
def influence(p: Vec, m: Air, b: int) -> Vec:
    """Velocity [m/s] that the tower adds to the wind at point p, inertial axes (A-55)."""
    x, y, along, drag = potential.beside_tower(p, m)
    below = max(1.0 - potential.above_top(p, m), 0.0)
    lost = min(deficit(x, y, drag), 0.5) * below * along.z
    return potential.influence(p, m, b) - Vec(lost * along.x, lost * along.y, 0.0)
