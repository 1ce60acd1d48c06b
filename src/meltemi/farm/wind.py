"""Ambient wind of a farm: generated over the whole farm, or a given field that is large enough."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import InputError
from meltemi.turbine.power_turbine import AnyTurbine
from meltemi.turbulence.exponential import even_fast
from meltemi.turbulence.field import generate_field
from meltemi.turbulence.grid import WindGrid, wind_grid_for
from meltemi.wind.fields import SharedTurbulence, SteadyWind, Wind, WindBox, in_axes
from meltemi.wind.turbulent import AnyWind, TurbulentWind

Float = NDArray[np.float64]
ASIDE = 1.9
"""Rotor diameters of a generated field beside the outermost turbines, where wakes meander."""
POINTS = 12
"""Points of a generated field per rotor diameter."""
MOST_MEMORY = 4e9
"""[bytes] largest size of a generated field."""


def wind_and_positions(
    wind: float | AnyWind, turbines: Sequence[AnyTurbine], positions: Float, duration: float
) -> tuple[Wind, Float]:
    """The wind of a farm, and the positions (turbines, 2) [m] in its axes.

    A turbulent wind becomes a periodic field centred at the farm, longer than the length that passes during the run.

    Args:
      positions: (turbines, 2) [m] positions of the layout, also in the axes of a given wind field.
      duration: [s] simulated time.

    Raises:
      InputError: a field is too small for the farm; the message states the required size.
    """
    if isinstance(wind, int | float):
        return SteadyWind(speed=wind), positions
    if isinstance(wind, TurbulentWind):
        about = positions - 0.5 * (positions.min(axis=0) + positions.max(axis=0))
        return _generated(wind, turbines, about, duration), about
    if isinstance(wind, WindBox | SharedTurbulence):
        _check(wind, turbines, positions, duration)
    return wind, positions


def _along(direction: float, positions: Float) -> tuple[Float, Float]:
    """(turbines,) [m] positions along and across a wind direction [rad]."""
    both = np.array([in_axes(direction, float(x), float(y)) for x, y in positions])
    return both[:, 0], both[:, 1]


@lru_cache(maxsize=1)
def _field(wind: TurbulentWind, grid: WindGrid, duration: float) -> WindBox:
    """The last field, which runs of a farm with and without wakes share."""
    return generate_field(wind, grid, duration)


def _generated(wind: TurbulentWind, turbines: Sequence[AnyTurbine], positions: Float, duration: float) -> WindBox:
    along, across = _along(wind.direction, positions)
    largest = max(turbines, key=lambda t: t.rotor_diameter)
    diameter = largest.rotor_diameter
    width = 2.0 * (float(np.abs(across).max()) + ASIDE * diameter)
    points = 2 * math.ceil(0.5 * width * POINTS / diameter) + 1
    grid = wind_grid_for(largest, points, width=width)
    lasts = duration + (float(np.ptp(along)) + 2.0 * ASIDE * diameter) / wind.speed
    # periodic anyway: a length that is fast to transform
    lasts = even_fast(math.ceil(lasts / wind.dt), real=True) * wind.dt
    top = grid.hub_height + 1.2 * 0.5 * diameter + ASIDE * 0.25 * diameter
    grid = grid.replace(points_z=min(grid.points_z, math.ceil((top - grid.bottom) / grid.dz) + 1))
    size = 12.0 * lasts / wind.dt * grid.points_y * grid.points_z
    if size > MOST_MEMORY:
        raise InputError(
            f"farm: a wind field {width:.0f} m wide for {lasts:.0f} s takes {size / 1e9:.2g} GB, at most "
            f"{MOST_MEMORY / 1e9:g} GB are allowed: a larger dt of the wind, a shorter duration or fewer rows across "
            "the wind reduce it"
        )
    field = _field(wind.replace(periodic=True, coherent="all"), grid, lasts)
    same = all(abs(t.hub_height - grid.hub_height) < 0.02 * grid.hub_height for t in turbines)
    return field if same else replace(field, hub_height=None)


def _check(wind: WindBox | SharedTurbulence, turbines: Sequence[AnyTurbine], positions: Float, duration: float) -> None:
    """Reject a field that is too narrow, low or short for a farm."""
    box, direction = (wind, wind.direction) if isinstance(wind, WindBox) else (wind.field, wind.mean.direction)
    along, across = _along(direction, positions)
    radii = np.array([t.rotor_radius for t in turbines])
    wide = 2.0 * float((np.abs(across) + radii).max())
    high = max(t.hub_height + t.rotor_radius for t in turbines)
    problems = []
    if box.width < wide:
        problems.append(f"it is {box.width:g} m wide, the farm needs {wide:.0f} m, symmetric about its origin")
    if box.top < high:
        problems.append(f"it reaches up to {box.top:g} m, the rotors to {high:.0f} m")
    if not box.periodic and float(along.max()) > box.lead:
        problems.append(
            f"it begins {box.lead:g} m downwind of its origin, the last turbine is at {along.max():.0f} m: place "
            "the farm upwind (negative x), or make the field periodic"
        )
    period, needed = box.duration * box.speed, float(np.ptp(along))
    if box.periodic and period < needed:
        problems.append(f"it repeats after {period:.0f} m, the farm is {needed:.0f} m long")
    if problems:
        raise InputError(f"{wind.label}: the wind field is too small for the farm: " + "; ".join(problems))
