"""Directions of the waves of a sea about its mean direction.

Reference: docs/theory/sea.md (H-15); Ewing & Laing (1987).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from meltemi.core.record import Record

Float = NDArray[np.float64]


class Spreading(Record):
    """Density of the energy over the direction: in proportion to cos^2s of the angle within a range."""

    exponent: float = Field(default=1.0, gt=0.0, le=200.0)
    """Exponent s [-; 0.5 to 50]: the larger it is, the narrower the range of directions."""
    width: float = Field(default=np.pi, gt=0.0, le=2.0 * np.pi)
    """[rad; 0.3 to 6.3] whole range of directions."""
    directions: int = Field(default=25, ge=3, le=361)
    """Number of directions of equal energy."""

    def directions_of(self, count: int, random: np.random.Generator) -> Float:
        """(count,) [rad] direction of each wave from the mean direction, of ``directions`` with equal energy."""
        angle = np.linspace(-0.5 * self.width, 0.5 * self.width, 2001)
        density = np.abs(np.cos(np.pi * angle / self.width)) ** (2.0 * self.exponent)
        share = np.concatenate([[0.0], np.cumsum(0.5 * (density[1:] + density[:-1]))])
        equal = np.interp((np.arange(self.directions) + 0.5) / self.directions, share / share[-1], angle)
        return random.permutation(np.resize(equal, count))
