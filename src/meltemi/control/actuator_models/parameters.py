"""Parameters common to all actuator models."""

from __future__ import annotations

from typing import NamedTuple


class ActuatorParameters(NamedTuple):
    """Natural frequency [rad/s], damping ratio, limits of rate [rad/s] and angle [rad]; whether the blade runs away;
    friction torque over inertia [rad/s^2], 0 without."""

    frequency: float
    damping: float
    rate: float
    minimum: float
    maximum: float
    runaway: bool
    friction: float
