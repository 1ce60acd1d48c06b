"""No control: torque and pitch keep the values of the start. The null variant of a controller."""

from __future__ import annotations

from functools import cache
from typing import Any

from numpy import float64
from numpy.typing import NDArray

from meltemi.control.controller import UPDATE, Controller
from meltemi.core.kernel import kernel_for

Float = NDArray[float64]


@cache
def update() -> Any:
    """The compiled update, for the entry's signature."""

    @kernel_for(UPDATE)
    def fixed(state: Float, measurements: Float, demands: Float, dt: float) -> None:
        pass

    return fixed


def fixed() -> Controller:
    """A controller that never changes a demand."""
    return Controller(update=update(), name="fixed", uses_loads=False)
