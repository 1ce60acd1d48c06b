"""No control: torque and pitch keep the values of the start. The null variant of a controller."""

from __future__ import annotations

from typing import Any

from numpy import float64
from numpy.typing import NDArray

from meltemi.control.controller import UPDATE, Controller
from meltemi.core.kernel import kernel_for

Float = NDArray[float64]
_ENTRY: list[Any] = []


def fixed() -> Controller:
    """A controller that never changes a demand."""
    if not _ENTRY:

        @kernel_for(UPDATE)
        def fixed(state: Float, measurements: Float, demands: Float, dt: float) -> None:
            pass

        _ENTRY.append(fixed)
    return Controller(update=_ENTRY[0], name="fixed", uses_loads=False)
