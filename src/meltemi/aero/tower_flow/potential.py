"""Potential flow around the tower, as around a cylinder.

Both components, for every point below the tower top whatever the azimuth; within one tower radius above the top it
fades out. With x and y in tower radii from the tower's axis, x along the local wind:

    u = W (1 - (x^2 - y^2) / (x^2 + y^2)^2),   v = -2 W x y / (x^2 + y^2)^2

Reference: docs/theory/aerodynamics.md (A-43 to A-45); Burton et al. (2011), section 3.14; He et al. (2018), Eq. 2.
"""

from __future__ import annotations

from math import cos, pi, sqrt

from meltemi.aero.air import Air
from meltemi.compiler import anywhere, kernel, whole
from meltemi.maths.vectors import Vec


@kernel
def influence(p: Vec, m: Air, b: int) -> Vec:
    """Velocity [m/s] that the tower adds to the wind at point p, inertial axes (A-43 to A-45)."""
    u, above = Vec(0.0, 0.0, 0.0), above_top(p, m)
    if anywhere(above < 1.0):
        shrink = 1.0
        if anywhere(above > 0.0):
            shrink = cos(0.5 * pi * min(above, 1.0))
        u = around_cylinder(p, shrink, m)
    return u


@kernel
def above_top(p: Vec, m: Air) -> float:
    """Height of p above the tower top [tower radii]: the cylinder shrinks to nothing within one."""
    tower = m.tower_flow
    last = tower.nodes - 1
    return max((p.z - tower.height[last]) / (0.5 * tower.diameter[last]), 0.0)


@kernel
def beside_tower(p: Vec, m: Air) -> tuple[float, float, Vec, float]:
    """Place of p from the tower's axis [tower radii], x along the local wind; this wind; drag coefficient there."""
    tower = m.tower_flow
    last, base = tower.nodes - 1, tower.height[0]
    step = tower.height[1] - base
    z = min(max((p.z - base) / step, 0.0), last)
    n = min(max(whole(z), 0), last - 1)
    w = z - n
    radius = 0.5 * (tower.diameter[n] + w * (tower.diameter[n + 1] - tower.diameter[n]))
    U = tower.wind[n] + w * (tower.wind[n + 1] - tower.wind[n])
    W = max(sqrt(U.x * U.x + U.y * U.y), 1e-6)
    ex, ey = U.x / W, U.y / W
    dx = p.x - (tower.x[n] + w * (tower.x[n + 1] - tower.x[n]))
    dy = p.y - (tower.y[n] + w * (tower.y[n + 1] - tower.y[n]))
    x = (dx * ex + dy * ey) / radius
    y = (-dx * ey + dy * ex) / radius
    return x, y, Vec(ex, ey, W), tower.drag[n] + w * (tower.drag[n + 1] - tower.drag[n])


@kernel
def around_cylinder(p: Vec, shrink: float, m: Air) -> Vec:
    """Velocity [m/s] that a cylinder with ``shrink`` of the tower's radius adds at point p (A-43 to A-45)."""
    x, y, along, _ = beside_tower(p, m)
    r2 = max(x * x + y * y, 1.0)
    strength = along.z * shrink * shrink / (r2 * r2)
    du, dv = strength * (y * y - x * x), -2.0 * strength * x * y
    return Vec(du * along.x - dv * along.y, du * along.y + dv * along.x, 0.0)
