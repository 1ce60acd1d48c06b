"""Controllers in plain Python, called back on the vectors of a case; ``control/entry.py`` imports them for one."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from functools import cache
from typing import Any

from meltemi.compiler import call_address, kernel_for
from meltemi.control.controller import UPDATE, Vector
from meltemi.control.signals import CALLBACK, Demands, Measurements
from meltemi.core.errors import InputError, did_you_mean


def callback(
    failed: Callable[[BaseException], None], update: Any, state: Vector, measurements: Vector, demands: Vector
) -> Any:
    """C function that calls a plain update on the vectors of a case, and passes what it raises to ``failed``."""
    measured, wanted = Measurements(measurements), Demands(demands)
    known = set(vars(wanted))

    def call(dt: float) -> int:
        try:
            answer = update(state, measured, wanted, dt)
            if answer is not None and answer is not wanted:
                raise InputError(
                    f"update returns {type(answer).__name__}, which nobody reads; it sets what it wants in its "
                    "third argument: demands.generator_torque = ..., demands.pitch[blade] = ..."
                )
            if len(vars(wanted)) > len(known):
                name = min(vars(wanted).keys() - known)
                raise InputError(f"demands have no {name!r}: {did_you_mean(name, Demands.fields)}")
        except BaseException as error:  # a Python exception must not cross compiled code
            failed(error)
            return 1
        return 0

    return ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_double)(call)


@cache
def call_python() -> Any:
    """Compiled function that calls the plain Python controller of the case."""

    @kernel_for(UPDATE)
    def python_controller(state: Vector, measurements: Vector, demands: Vector, dt: float) -> None:
        if call_address(measurements[CALLBACK], dt) != 0:
            raise RuntimeError

    return python_controller
