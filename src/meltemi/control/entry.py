"""Controllers bound to the vectors of a case: compiled ones, those for derivatives, and plain Python.

What only some runs need, ``dual_updates`` and ``plain_updates``, is imported for them.
"""

from __future__ import annotations

import ctypes
from typing import Any

import numpy as np

from meltemi.compiler import EntryPoint, interpreted, is_compiled
from meltemi.control.controller import UPDATE, Controller, Vector, compiled_entry
from meltemi.control.signals import CALLBACK, Demands, Measurements

CALLED_BACK = "meltemi.control.plain_updates"
"""Module whose code compiled code calls: what is raised there, outside of a controller, is lost."""


class Entry:
    """Controller bound to the vectors of one case, for the time loop.

    Attributes:
      function: function that the loop calls.
      exception: exception that a plain Python controller raised, if any.
    """

    def __init__(
        self, controller: Controller, state: Vector, measurements: Vector, demands: Vector, *, duals: bool = False
    ) -> None:
        self.exception: BaseException | None = None
        self._callback: Any = None
        update: Any = controller.update
        if interpreted():
            self.function = lambda x, measured, wanted, dt: update(x, Measurements(measured), Demands(wanted), dt)
        elif duals:
            from meltemi.control.dual_updates import dual_entry, update_of_duals

            self.function = EntryPoint(dual_entry(controller), update_of_duals())
        elif is_compiled(update):
            self.function = EntryPoint(compiled_entry(update), UPDATE)
        else:
            from meltemi.control.plain_updates import call_python, callback

            self.function = EntryPoint(call_python(), UPDATE)
            self._callback = callback(self._failed, update, state, measurements, demands)
            address = ctypes.cast(self._callback, ctypes.c_void_p).value
            measurements[CALLBACK] = np.array([address], dtype=np.int64).view(np.float64)[0]

    def _failed(self, error: BaseException) -> None:
        self.exception = error
