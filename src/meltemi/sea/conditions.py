"""Common properties of all seas."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
from pydantic import Field

from meltemi.core.errors import InputError
from meltemi.core.record import Record
from meltemi.core.shown import Viewed
from meltemi.core.usual import unusual_numbers
from meltemi.sea.airy import GRAVITY, WaveComponents, wave_number
from meltemi.sea.current import Current

Stretching = Literal["none", "vertical", "extrapolation", "wheeler"]
BREAKS_IN_SHALLOWS, BREAKS_STEEP = 0.78, 0.142
"""Height of a breaking wave over the depth (McCowan), and over its length times tanh(kh) (Miche)."""


class Sea(Record, Viewed):
    """Base of seas: level, current, and how the waves' kinematics continue to the surface."""

    level: float = Field(default=0.0, gt=-50.0, lt=50.0)
    """[m; 0.05 to 12] level of the still water above mean sea level: tide and surge."""
    stretching: Stretching = "wheeler"
    """Kinematics above still water: none, and no load there; those at still water; their linear extrapolation; or all
    kinematics stretched to the surface (Wheeler)."""
    current: Current | None = None

    @property
    def label(self) -> str:
        """Short description, for titles and metadata."""
        return "still water"

    def components(self, depth: float, duration: float, gravity: float = GRAVITY) -> WaveComponents:
        """Wave components of the sea; none in still water.

        Args:
          depth: [m] depth of the still water.
          duration: [s] duration that they have to cover.

        Raises:
          InputError: waves break, or the sea is too short.
        """
        none = np.zeros(0)
        return WaveComponents(none, none.astype(np.complex128), none, None)

    def doubts(self) -> list[str]:
        """Sentences about numbers that are unusual."""
        return [*unusual_numbers(self, "sea")]


class StillWater(Sea):
    """Still water without waves."""

    kind: Literal["still"] = "still"


def breaking_height(period: float, depth: float) -> float:
    """Largest height [m] of a wave of a period [s] that does not break in water of a depth [m]."""
    k = float(wave_number(np.array([2.0 * np.pi / period]), depth)[0])
    return min(BREAKS_IN_SHALLOWS * depth, float(BREAKS_STEEP * 2.0 * np.pi / k * np.tanh(k * depth)))


def refuse_breaking(height: float, period: float, depth: float, what: str) -> None:
    """Check that a wave of a height [m] and a period [s] does not break.

    Raises:
      InputError: the wave breaks.
    """
    k = float(wave_number(np.array([2.0 * np.pi / period]), depth)[0])
    steepest = BREAKS_STEEP * 2.0 * np.pi / k * np.tanh(k * depth)
    if height > BREAKS_IN_SHALLOWS * depth:
        most, why = BREAKS_IN_SHALLOWS * depth, f"in water of {depth:g} m"
    elif height > steepest:
        most, why = steepest, f"with a period of {period:g} s, a length of {2.0 * np.pi / k:.3g} m"
    else:
        return
    raise InputError(f"{what}: waves of {height:g} m break {why}; expected at most {most:.3g} m")


def along(direction: float | Any) -> Any:
    """Direction of travel, counter-clockwise from the x axis, from one that is clockwise like that of the wind."""
    return -direction
