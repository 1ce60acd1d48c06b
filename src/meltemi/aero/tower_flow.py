"""Influence of the tower on the wind around it, and the wind's drag on the tower.

Potential flow around a cylinder, with both components, for every point below the tower top whatever
the azimuth; within one tower radius above the top it fades out. With x and y in tower radii from the
tower's axis, x along the local wind:

    u = W (1 - (x^2 - y^2) / (x^2 + y^2)^2),   v = -2 W x y / (x^2 + y^2)^2

Reference: docs/theory/aerodynamics.md (A-43 to A-46); Burton et al. (2011), section 3.14; He et al.
(2018), Eq. 2.
"""

from __future__ import annotations

from math import cos, pi, sqrt

from numpy import float32, float64
from numpy.typing import NDArray

from meltemi.aero.tables import TowerFlow
from meltemi.core.kernel import kernel
from meltemi.maths.access import put2, vec2
from meltemi.maths.generic import total, whole, zero
from meltemi.maths.vectors import Vec
from meltemi.wind.velocity import wind_velocity

Float = NDArray[float64]

HEIGHT, DIAMETER, TOWER_DRAG_COEFFICIENT, TOWER_PIECE, AXIS_X, AXIS_Y, TOWER_WIND, TOWER_FORCE = TowerFlow.slots(
    "height diameter drag length x y wind force"
)


@kernel
def tower_wind(
    t: float, q: Float, v: Float, tower_shape: Float, wind: Float, now: Float, box: NDArray[float32], tower: Float
) -> None:
    """Deflection of the tower's axis and the wind relative to it at the tower nodes.

    Args:
      tower_shape: (6 modes, nodes) shapes of the tower modes.
    """
    for n in range(tower.shape[1]):
        x, y, vx, vy = zero(tower), zero(tower), zero(tower), zero(tower)
        for k in range(tower_shape.shape[0] // 6):
            x += tower_shape[6 * k, n] * q[k]
            y += tower_shape[6 * k + 1, n] * q[k]
            vx += tower_shape[6 * k, n] * v[k]
            vy += tower_shape[6 * k + 1, n] * v[k]
        u = wind_velocity(Vec(x, y, tower[HEIGHT, n]), t, wind, now, box)
        tower[AXIS_X, n] = x
        tower[AXIS_Y, n] = y
        put2(tower, TOWER_WIND, n, Vec(u.x - vx, u.y - vy, u.z))


@kernel
def tower_influence(tower: Float, p: Vec) -> Vec:
    """Velocity [m/s] that the tower adds to the wind at point p, inertial axes (A-43 to A-45)."""
    last = tower.shape[1] - 1
    step = tower[HEIGHT, 1] - tower[HEIGHT, 0]
    z = min(max((p.z - tower[HEIGHT, 0]) / step, 0.0), last)
    n = min(max(whole(z), 0), last - 1)
    w = z - n
    radius = 0.5 * (tower[DIAMETER, n] + w * (tower[DIAMETER, n + 1] - tower[DIAMETER, n]))
    U = vec2(tower, TOWER_WIND, n)
    U1 = vec2(tower, TOWER_WIND, n + 1)
    ux, uy = U.x + w * (U1.x - U.x), U.y + w * (U1.y - U.y)
    W = max(sqrt(ux * ux + uy * uy), 1e-6)
    ex, ey = ux / W, uy / W
    dx = p.x - (tower[AXIS_X, n] + w * (tower[AXIS_X, n + 1] - tower[AXIS_X, n]))
    dy = p.y - (tower[AXIS_Y, n] + w * (tower[AXIS_Y, n + 1] - tower[AXIS_Y, n]))
    # above the top: the cylinder shrinks to nothing within one radius
    above = min(max((p.z - tower[HEIGHT, last]) / radius, 0.0), 1.0)
    shrink = cos(0.5 * pi * above)
    x = (dx * ex + dy * ey) / radius
    y = (-dx * ey + dy * ex) / radius
    r2 = max(x * x + y * y, 1.0)
    r2 = r2 / max(shrink * shrink, 1e-12)
    x, y = x / max(shrink, 1e-6), y / max(shrink, 1e-6)
    du = W * (y * y - x * x) / (r2 * r2)
    dv = W * (-2.0 * x * y) / (r2 * r2)
    return Vec(du * ex - dv * ey, du * ey + dv * ex, 0.0 * du)


@kernel
def tower_load(air_density: float, tower: Float, tower_shape: Float, load: Float) -> None:
    """Drag on the tower nodes and its generalised force on the tower modes (A-46).

    Args:
      air_density: [kg/m^3]; 0 switches the drag off.
      load: (modes,) becomes the generalised forces.
    """
    for k in range(load.shape[0]):
        load[k] = 0.0
    for n in range(tower.shape[1]):
        U = vec2(tower, TOWER_WIND, n)
        speed = sqrt(U.x * U.x + U.y * U.y)
        area = tower[DIAMETER, n] * tower[TOWER_PIECE, n]
        push = 0.5 * air_density * tower[TOWER_DRAG_COEFFICIENT, n] * area * speed
        F = Vec(push * U.x, push * U.y, zero(tower))
        put2(tower, TOWER_FORCE, n, F)
        for k in range(load.shape[0]):
            load[k] += total(tower_shape[6 * k, n] * F.x + tower_shape[6 * k + 1, n] * F.y)
