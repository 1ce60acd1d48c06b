"""Potential flow around the tower, as around a cylinder.

Both components, for every point below the tower top whatever the azimuth; within one tower radius above the top it
fades out. With x and y in tower radii from the tower's axis, x along the local wind:

    u = W (1 - (x^2 - y^2) / (x^2 + y^2)^2),   v = -2 W x y / (x^2 + y^2)^2

Reference: docs/theory/aerodynamics.md (A-43 to A-45); Burton et al. (2011), section 3.14; He et al. (2018), Eq. 2.
"""

from __future__ import annotations

from math import cos, pi, sqrt

from meltemi.aero.air import Air
from meltemi.core.kernel import kernel
from meltemi.maths.generic import whole
from meltemi.maths.vectors import Vec


@kernel
def influence(p: Vec, m: Air, b: int) -> Vec:
    """Velocity [m/s] that the tower adds to the wind at point p, inertial axes (A-43 to A-45)."""
    tower = m.tower_flow
    last = tower.nodes - 1
    base = tower.height[0]
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
    # above the top: the cylinder shrinks to nothing within one radius
    above = min(max((p.z - tower.height[last]) / radius, 0.0), 1.0)
    shrink = cos(0.5 * pi * above)
    x = (dx * ex + dy * ey) / radius
    y = (-dx * ey + dy * ex) / radius
    r2 = max(x * x + y * y, 1.0)
    r2 = r2 / max(shrink * shrink, 1e-12)
    x, y = x / max(shrink, 1e-6), y / max(shrink, 1e-6)
    du = W * (y * y - x * x) / (r2 * r2)
    dv = W * (-2.0 * x * y) / (r2 * r2)
    return Vec(du * ex - dv * ey, du * ey + dv * ex, 0.0)
