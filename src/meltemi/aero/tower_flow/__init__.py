"""Influence of the tower on the wind around it, and the wind's drag on the tower.

The influence is selected by ``ModelOptions.tower_influence``. A model is a module with one kernel,
``influence(p, m, b)``: the velocity [m/s] that the tower adds to the wind at the point p of blade b, inertial axes.

Reference: docs/theory/aerodynamics.md (A-43 to A-46).
"""

from __future__ import annotations

from math import sqrt

from meltemi.aero.air import Air
from meltemi.aero.variants import TowerInfluence
from meltemi.compiler import choice, kernel, total
from meltemi.core.variants import models
from meltemi.maths.vectors import Vec
from meltemi.wind.velocity import wind_velocity


@kernel
def tower_wind(t: float, m: Air) -> None:
    """Deflection of the tower's axis and the wind relative to it at the tower nodes."""
    tower, shape, q, v = m.tower_lanes, m.tower_shape, m.q, m.v
    for n in range(tower.nodes):
        place, velocity = Vec(0.0, 0.0, 0.0), Vec(0.0, 0.0, 0.0)
        for k in range(shape.modes):
            s = shape.displacement[k, n]
            place += q[k] * s
            velocity += v[k] * s
        u = wind_velocity(Vec(place.x, place.y, tower.height[n]), t, m)
        tower.x[n] = place.x
        tower.y[n] = place.y
        tower.wind[n] = u - Vec(velocity.x, velocity.y, 0.0)


@kernel
def tower_load(m: Air) -> None:
    """Drag on the tower nodes and its generalised force on the tower modes (A-46)."""
    tower, shape, push = m.tower_lanes, m.tower_shape, m.tower_push
    air_density = m.aero_options.tower_drag * m.aero.air_density
    for k in range(shape.modes):
        push[k] = 0.0
    for n in range(tower.nodes):
        U = tower.wind[n]
        speed = sqrt(U.x * U.x + U.y * U.y)
        pressure = 0.5 * air_density * tower.drag[n] * (tower.diameter[n] * tower.length[n]) * speed
        F = Vec(pressure * U.x, pressure * U.y, 0.0)
        tower.force[n] = F
        for k in range(shape.modes):
            s = shape.displacement[k, n]
            push[k] += total(s.x * F.x + s.y * F.y)


influence = choice([model.influence for model in models(__name__, TowerInfluence)])
