"""Constant demands: those of the start, or those set from outside. The null variant of a controller."""

from __future__ import annotations

from functools import cache
from typing import Any

from numpy import float64
from numpy.typing import NDArray

from meltemi.compiler import kernel_for
from meltemi.control.controller import UPDATE, Controller

Float = NDArray[float64]


@cache
def update() -> Any:
    """Compiled update for the signature of the entry."""

    @kernel_for(UPDATE)
    def constant(state: Float, measurements: Float, demands: Float, dt: float) -> None:
        pass

    return constant


def ConstantController(sample_time: float | None = None) -> Controller:
    """Controller that keeps the demands of the start, for runs that are stepped from outside.

    Args:
      sample_time: [s] time by which ``Simulation.step`` advances; None is one time step.
    """
    return Controller(update=update(), sample_time=sample_time, name="constant", uses_loads=False)
