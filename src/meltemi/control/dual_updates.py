"""Updates of controllers for runs with derivatives; ``control/entry.py`` imports them for such a run."""

from __future__ import annotations

from functools import cache
from typing import Any

from meltemi.compiler import DUALS, NUMBERS, CompilationError, last_line, types
from meltemi.control.controller import Controller, compiled_for, update_with_derivatives
from meltemi.core.errors import InputError

_ENTRIES: dict[Any, Any] = {}


@cache
def update_of_duals() -> Any:
    """Signature of ``update(state, measurements, demands, dt)`` for runs with derivatives."""
    vector = NUMBERS[DUALS].array(1)
    return types.void(vector, vector, vector, types.float64)


def dual_entry(controller: Controller) -> Any:
    """A controller's update compiled for derivatives.

    Raises:
      InputError: it is plain Python, or uses operations that duals do not support.
    """
    update = update_with_derivatives(controller)
    if update not in _ENTRIES:
        try:
            _ENTRIES[update] = compiled_for(update, update_of_duals(), cached=False)
        except CompilationError as error:
            raise InputError(
                f"controller {controller.name!r} has no derivatives: it does what they are not defined for "
                f"({last_line(error)}); arithmetic, comparisons, min, max, abs and the functions "
                "of math are"
            ) from None
    return _ENTRIES[update]
