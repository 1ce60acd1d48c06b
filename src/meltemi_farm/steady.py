"""A wake alone in steady wind: for comparisons of the sets of constants with each other and with tables.

Reference: docs/theory/wakes.md (K-2 to K-8).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from meltemi_farm.march import Mixing, one_step, viscosity
from meltemi_farm.sets import WakeSet

Float = NDArray[np.float64]


def mixing_of(model: WakeSet, diameter: float) -> Mixing:
    """Constants of the march of a set, for a rotor diameter [m]."""
    names = ("ambient", "power", "shear", "gradient", "slowest", "rotor_wide")
    return Mixing.of(radius=0.5 * diameter, **{name: float(getattr(model, name)) for name in names})


def steady_wake(  # noqa: PLR0913 - dimensions of a wake, by name
    model: WakeSet,
    thrust: float | Float,
    intensity: float,
    *,
    speed: float,
    diameter: float,
    length: float,
    spacing: float,
    way: float,
    points: int = 60,
) -> tuple[Float, Float, Float, Float]:
    """Profiles along a wake that does not meander, in uniform steady wind.

    Args:
      model: set of constants.
      thrust: thrust coefficient, uniform over the rotor or at each point of the profile.
      intensity: ambient turbulence intensity.
      speed: [m/s] wind.
      diameter: [m] of the rotor.
      length: [m] of the wake.
      spacing: [m] between the points of a profile.
      way: [m] between profiles.
      points: of a profile.

    Returns:
      Distances (X,) and radii (R,) [m], axial and radial velocities (X, R) [m/s] of the wake.
    """
    r, radius = spacing * np.arange(points, dtype=np.float64), 0.5 * diameter
    local = np.where(r <= radius, thrust, 0.0)
    steps = math.ceil(length / way - 1e-9)
    x = way * np.arange(steps + 1, dtype=np.float64)
    V, Vr = np.zeros((steps + 1, points)), np.zeros((steps + 1, points))
    V[0] = model.inlet(r, local, radius, speed)
    along, constants = model.filters(x / diameter), mixing_of(model, diameter)
    nu, work = np.empty(points), np.empty(points)
    for i in range(steps):
        viscosity(V[i], speed, intensity, along[0, i], along[1, i], spacing, constants, nu)
        one_step(V[i], Vr[i], nu, speed, way, spacing, V[i + 1], Vr[i + 1], work)
    return x, r, V, Vr
