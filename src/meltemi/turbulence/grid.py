"""Grids of wind fields, sized for the turbine."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from meltemi.core.errors import InputError
from meltemi.core.record import Record

if TYPE_CHECKING:
    from meltemi.turbine.power_turbine import AnyTurbine

WIDTH = 1.2
"""Width of a grid over the rotor diameter."""
MOST_ROWS = 1001
"""Largest number of rows, and of columns."""
LOWEST = 0.02
"""Height of the lowest row over the hub height."""


class WindGrid(Record):
    """Vertical grid of points across the wind, centred on the rotor axis."""

    points_y: int = Field(ge=2, le=MOST_ROWS)
    """Number of columns."""
    points_z: int = Field(ge=2, le=MOST_ROWS)
    """Number of rows."""
    dy: float = Field(gt=0.0)
    """[m] spacing of columns."""
    dz: float = Field(gt=0.0)
    """[m] spacing of rows."""
    bottom: float = Field(gt=0.0)
    """[m] height of the lowest row."""
    hub_height: float = Field(gt=0.0)
    """[m] height of the given mean speed and intensity."""

    @model_validator(mode="after")
    def _check(self) -> Self:
        if not self.bottom <= self.hub_height <= self.top:
            raise ValueError(
                f"hub_height {self.hub_height:g} m lies outside the grid, which reaches from {self.bottom:g} m to "
                f"{self.top:g} m"
            )
        return self

    @property
    def width(self) -> float:
        """Width [m]."""
        return (self.points_y - 1) * self.dy

    @property
    def top(self) -> float:
        """Height [m] of the highest row."""
        return self.bottom + (self.points_z - 1) * self.dz

    @property
    def y(self) -> NDArray[np.float64]:
        """(Y,) [m] positions of the columns, to the left looking downwind."""
        return self.dy * np.arange(self.points_y, dtype=np.float64) - 0.5 * self.width

    @property
    def z(self) -> NDArray[np.float64]:
        """(Z,) [m] heights of the rows."""
        return self.bottom + self.dz * np.arange(self.points_z, dtype=np.float64)

    @property
    def hub(self) -> tuple[int, int]:
        """Row and column of the point nearest to the hub."""
        return int(np.argmin(np.abs(self.z - self.hub_height))), self.points_y // 2


def wind_grid_for(turbine: AnyTurbine, points: int = 25, *, width: float | None = None, tower: bool = True) -> WindGrid:
    """Grid that covers rotor and tower, with a point at the hub if ``points`` is odd.

    Args:
      turbine: turbine, for its hub height and rotor diameter.
      points: number of columns; rows have about the same spacing.
      width: [m] width, 1.2 rotor diameters by default. The grid reaches half of it above the hub.
      tower: the grid reaches down to 2 % of the hub height; otherwise as far below the hub as above.

    Raises:
      InputError: ``points`` or ``width`` is too small, or the rotor is too close to the ground.
    """
    hub, diameter = turbine.hub_height, turbine.rotor_diameter
    width = WIDTH * diameter if width is None else width
    if isinstance(points, bool) or not isinstance(points, int) or points < 3:
        raise InputError(f"grid: points must be a whole number of at least 3, found {points!r}")
    if not (math.isfinite(width) and width >= diameter):
        raise InputError(f"grid: it is {width:g} m wide, the rotor needs {diameter:.1f} m")
    lowest = LOWEST * hub
    if hub - 0.5 * diameter < lowest:
        raise InputError(
            f"grid: the rotor reaches down to {hub - 0.5 * diameter:.1f} m, the lowest row is at {lowest:.1f} m"
        )
    dy = width / (points - 1)
    below = hub - (lowest if tower else max(hub - 0.5 * width, lowest))
    rows_below = max(round(below / dy), 1)
    dz = below / rows_below
    rows_above = math.ceil(0.5 * width / dz - 1e-9)
    if rows_below + 1 + rows_above > MOST_ROWS:
        raise InputError(
            f"grid: {width:g} m wide with {points} points it has {rows_below + 1 + rows_above} rows, expected at most "
            f"{MOST_ROWS}: make it narrower"
        )
    return WindGrid(
        points_y=points,
        points_z=rows_below + 1 + rows_above,
        dy=dy,
        dz=dz,
        bottom=hub - below,
        hub_height=hub,
    )
