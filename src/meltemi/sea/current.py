"""Current: a power law below the surface, a linear profile near it, a uniform part, and a table.

Reference: docs/theory/sea.md (H-20); IEC 61400-3-1:2019, 6.3.4.
"""

from __future__ import annotations

from typing import Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from meltemi.core.record import Record, Vector

Float = NDArray[np.float64]
EXPONENT = 1.0 / 7.0


class Current(Record):
    """Velocity of the water without waves; its parts add up."""

    sub_surface: float = Field(default=0.0, ge=0.0, lt=10.0)
    """[m/s; 0.02 to 4] speed at still water; it decreases with depth by the power law of exponent 1/7."""
    near_surface: float = Field(default=0.0, ge=0.0, lt=10.0)
    """[m/s; 0.02 to 3] speed at still water by the wind; it decreases linearly to zero at ``reference_depth``."""
    reference_depth: float = Field(default=20.0, gt=0.0)
    """[m; 2 to 100] depth of the near-surface current."""
    uniform: float = Field(default=0.0, ge=0.0, lt=10.0)
    """[m/s; 0.02 to 4] speed at all depths."""
    height: Vector | None = None
    """(K,) [m] heights of a table, from still water, increasing; constant beyond."""
    speed: Vector | None = None
    """(K,) [m/s] speeds of the table."""
    direction: float = Field(default=0.0, ge=-7.0, le=7.0)
    """[rad] direction towards which it flows, clockwise from above as that of the wind."""

    @model_validator(mode="after")
    def _check(self) -> Self:
        if (self.height is None) != (self.speed is None):
            raise ValueError("height and speed of a table come together")
        if self.height is not None and self.speed is not None:
            if len(self.height) != len(self.speed):
                raise ValueError(f"speed must have {len(self.height)} entries like height, found {len(self.speed)}")
            if np.any(np.diff(self.height) <= 0.0):
                raise ValueError("height must increase")
        return self

    def at(self, z: Float, depth: float) -> Float:
        """(P, 2) [m/s] velocity along x and y at heights (P,) [m] from still water; above it as at still water."""
        z = np.clip(z, -depth, 0.0)
        speed = self.sub_surface * ((z + depth) / depth) ** EXPONENT + self.uniform
        speed = speed + self.near_surface * np.maximum(0.0, 1.0 + z / self.reference_depth)
        if self.height is not None and self.speed is not None:
            speed = speed + np.interp(z, self.height, self.speed)
        return np.outer(speed, [np.cos(self.direction), -np.sin(self.direction)])
