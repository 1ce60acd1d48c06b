"""Static polars: no dynamic stall."""

from __future__ import annotations

from meltemi.aero.air import Air
from meltemi.aero.polars import SectionCoefficients, static_coefficients
from meltemi.compiler import kernel, whole

STATES = ()


@kernel
def advance(dt: float, flap: float, m: Air, b: int, n: int) -> SectionCoefficients:
    """Coefficients of the polar."""
    return static_coefficients(m.flow.alpha[b, n], whole(m.aero_nodes.polar[b, n]), m)


@kernel
def settle(flap: float, m: Air, b: int, n: int) -> None:
    """Nothing to settle: the model has no state."""


@kernel
def derivative(flap: float, m: Air, b: int, n: int) -> None:
    """Zero: the model has no state."""
    rate = m.d_stall
    rate.wake_1[b, n] = rate.wake_2[b, n] = rate.pressure[b, n] = rate.attachment[b, n] = 0.0
