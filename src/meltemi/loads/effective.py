"""Effective turbulence of a farm after Frandsen: one ambient wind that fatigues like all wind directions with wakes.

Reference: docs/theory/wakes.md (K-16 to K-18); IEC 61400-1:2005, Annex D; IEC 61400-1:2019, Annex E; Frandsen (2007).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Literal

import numpy as np

from meltemi.core.errors import InputError

SHARE = 0.06
"""Probability of the wake of each neighbour."""
FURTHEST = 10.0
"""Distance in rotor diameters beyond which a neighbour does not count."""
MOST_NEIGHBOURS = 8
"""Largest number of neighbours, inside a farm."""
NEAREST = 2.0
"""Smallest distance of a neighbour in rotor diameters."""


def checked_neighbours(distances: Sequence[float]) -> Sequence[float]:
    """Distances of neighbours [D]; ValueError if they are too small, or too many below ten diameters."""
    if any(not NEAREST <= distance <= 1e3 for distance in distances):
        raise ValueError(f"neighbours: expected distances of {NEAREST:g} rotor diameters or more, found {distances}")
    if sum(distance < FURTHEST for distance in distances) > MOST_NEIGHBOURS:
        raise ValueError(f"neighbours: expected at most {MOST_NEIGHBOURS} nearer than {FURTHEST:g} rotor diameters")
    return distances


def wake_turbulence(
    speed: float, sigma: float, distance: float, thrust: float | None = None, *, edition: Literal[3, 4] = 4
) -> float:
    """Standard deviation [m/s] of the wind in the centre of a wake (K-16).

    Args:
      speed: [m/s] mean wind speed at hub height.
      sigma: [m/s] ambient standard deviation.
      distance: distance to the turbine upstream, in rotor diameters.
      thrust: thrust coefficient of that turbine; edition 3 does not use it.
      edition: edition of IEC 61400-1.

    Raises:
      InputError: a number is not positive, or edition 4 has no thrust coefficient.
    """
    if not (speed > 0.0 and sigma >= 0.0 and distance >= NEAREST):
        raise InputError(
            f"effective turbulence: expected a positive speed and distances of at least {NEAREST:g} diameters, found "
            f"{speed:g} m/s, {sigma:g} m/s, {distance:g}"
        )
    if edition == 3:
        added = math.sqrt(0.9) * speed / (1.5 + 0.3 * distance * math.sqrt(speed))
    elif thrust is None or not thrust > 0.0:
        raise InputError(f"effective turbulence: edition 4 needs a positive thrust coefficient, found {thrust!r}")
    else:
        added = speed / (1.5 + 0.8 * distance / math.sqrt(thrust))
    return math.hypot(added, sigma)


def farm_turbulence(speed: float, sigma: float, rows: float, within: float, thrust: float) -> float:
    """Ambient standard deviation [m/s] within a farm of more than five rows (K-18).

    Args:
      speed: [m/s] mean wind speed.
      sigma: [m/s] ambient standard deviation, as for :func:`wake_turbulence`.
      rows: distance between rows, in rotor diameters.
      within: distance within rows, in rotor diameters.
      thrust: thrust coefficient of the turbines.
    """
    wake = 0.36 * speed / (1.0 + 0.2 * math.sqrt(rows * within / thrust))
    return 0.5 * (math.hypot(wake, sigma) + sigma)


def effective_intensity(
    speed: float,
    intensity: float,
    distances: Sequence[float],
    *,
    slope: float,
    thrust: float | None = None,
    edition: Literal[3, 4] = 4,
) -> float:
    """Effective turbulence intensity of a wind speed (K-17).

    Args:
      speed: [m/s] mean wind speed at hub height.
      intensity: ambient turbulence intensity; for design its 90 % quantile.
      distances: distances of the neighbours, in rotor diameters; those beyond ten do not count.
      slope: S-N slope of the material, 4 for steel, 10 for blades.
      thrust: thrust coefficient at this speed.
      edition: edition of IEC 61400-1.

    Raises:
      InputError: there are more than eight neighbours, or an argument is not allowed.
    """
    near = [d for d in distances if d < FURTHEST]
    if len(near) > MOST_NEIGHBOURS:
        raise InputError(f"effective turbulence: expected at most {MOST_NEIGHBOURS} neighbours, found {len(near)}")
    sigma = intensity * speed
    waked = [wake_turbulence(speed, sigma, d, thrust, edition=edition) for d in near]
    mean = (1.0 - SHARE * len(near)) * sigma**slope + SHARE * float(np.sum(np.power(waked, slope)))
    return float(mean ** (1.0 / slope) / speed)
