"""Duty of a servo drive, such as a pitch drive: travel, starts, revolutions of the bearing, oscillations."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi, radians

import numpy as np

from meltemi.postprocess.ensemble import actuator_travel
from meltemi.postprocess.fatigue import damage_equivalent_load
from meltemi.simulation.result import Result

BEARING_SLOPE = 3.0
"""Exponent of the life of a ball bearing over its load (ISO 281), here over the range of an oscillation."""
MOVES = radians(0.1)
"""[rad/s] rate above which a servo counts as moving."""
YEAR = 365.25 * 86400.0


@dataclass(frozen=True)
class ServoDuty:
    """Duty of a servo.

    Attributes:
      travel: [rad/s] mean absolute rate.
      starts: [1/s] frequency of starts.
      moving: share of the time in motion.
      oscillation: [rad] equivalent range of its rainflow cycles at 1 Hz, slope 3.
    """

    travel: float
    starts: float
    moving: float
    oscillation: float

    @property
    def revolutions(self) -> float:
        """Full revolutions of the bearing in a year."""
        return self.travel * YEAR / (2.0 * pi)


def servo_duty(result: Result, channel: str = "pitch_1", *, moves: float = MOVES) -> ServoDuty:
    """Duty of a servo from the angle [rad] of a channel.

    Args:
      result: result of a run, without its initial transient.
      channel: name of the channel.
      moves: [rad/s] threshold of the rate for motion.

    Raises:
      InputError: the result has no such channel, or fewer than two samples.
    """
    angle, dt = result[channel], float(result.time[1] - result.time[0])
    duration = float(result.time[-1] - result.time[0])
    moving = np.abs(np.diff(angle)) > moves * dt
    return ServoDuty(
        travel=actuator_travel(result, channel),
        starts=float(np.sum(moving[1:] & ~moving[:-1])) / duration,
        moving=float(moving.mean()),
        oscillation=damage_equivalent_load(angle, duration=duration, slope=BEARING_SLOPE),
    )
