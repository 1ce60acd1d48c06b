"""A regular wave: one component."""

from __future__ import annotations

import math
from typing import Literal

import numpy as np
from pydantic import Field

from meltemi.sea.airy import GRAVITY, WaveComponents
from meltemi.sea.conditions import Sea, along, refuse_breaking


class RegularSea(Sea):
    """One wave of constant height and period."""

    kind: Literal["regular"] = "regular"
    height: float = Field(gt=0.0, lt=50.0)
    """[m; 0.05 to 35] height from trough to crest."""
    period: float = Field(gt=0.5, lt=600.0)
    """[s; 2 to 40] wave period."""
    direction: float = Field(default=0.0, ge=-7.0, le=7.0)
    """[rad] direction of travel, clockwise from above as that of the wind."""
    phase: float = Field(default=0.0, ge=-7.0, le=7.0)
    """[rad] phase at the origin at time 0: 0 is a crest."""

    @property
    def label(self) -> str:
        return f"regular wave {self.height:g} m, {self.period:g} s"

    def components(self, depth: float, duration: float, gravity: float = GRAVITY) -> WaveComponents:
        refuse_breaking(self.height, self.period, depth, "sea.height")
        amplitude = 0.5 * self.height * np.exp(1j * self.phase)
        frequency = 2.0 * math.pi / self.period
        return WaveComponents(
            np.array([frequency]), np.array([amplitude]), np.array([along(self.direction)]), self.period
        )
