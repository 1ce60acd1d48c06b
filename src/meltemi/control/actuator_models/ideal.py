"""Ideal actuator: the demanded angle at once and no rate, so that it turns the blades without inertial loads (C-13)."""

from __future__ import annotations

from meltemi.compiler import kernel
from meltemi.control.actuator_models.parameters import ActuatorParameters


def coefficients(frequency: float, damping: float) -> tuple[float, ...]:
    """None: the angle is the demand."""
    return ()


@kernel
def advance(angle: float, rate: float, demand: float, p: ActuatorParameters, dt: float) -> tuple[float, float, float]:
    """The demand; a runaway blade moves at the rate of the fault."""
    if p.runaway:
        return min(max(demand, angle - p.rate * dt), angle + p.rate * dt), rate, 0.0
    return demand, rate, 0.0
