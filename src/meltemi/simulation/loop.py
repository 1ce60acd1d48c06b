"""The time loop of a run: compiled for its records, and called with them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, cached_property
from typing import Any

from numpy import float64
from numpy.typing import NDArray

from meltemi.compiler import by_address, interpreted, kernel_for, typeof, types, without_dispatch
from meltemi.simulation import step

NUMBER = types.float64


@dataclass(frozen=True)
class Loop:
    """A time loop with all that it takes.

    Attributes:
      controller: entry point of the controller.
      physics: entry points of :func:`simulation.step.evaluate` and :func:`simulation.step.observe`.
      records: run, control, system, system node by node, in plain floats, and section loads.
      function: ``function(n_steps, controller, *physics, *records)`` marches.
      output: (rows, columns) samples, which it writes.
    """

    controller: Any
    physics: tuple[Any, Any]
    records: tuple[Any, ...]
    function: Any
    output: NDArray[float64]

    @cached_property
    def _call(self) -> Any:
        return without_dispatch(self.function, 0, self.controller, *self.physics, *self.records)

    def march(self, n_steps: int) -> None:
        """March a number of time steps, or until something ends the run."""
        self._call(n_steps, self.controller, *self.physics, *self.records)


def loop_of(controller: Any, records: tuple[Any, ...], output: NDArray[float64]) -> Loop:
    """The loop for a controller and records, compiled if this process has not done so."""
    physics = compiled_physics(*records)
    function = compiled_advance(controller, *physics, *records)
    function(0, controller, *physics, *records)
    return Loop(controller, physics, records, function, output)


def compiled_physics(run: Any, control: Any, m: Any, one: Any, plain: Any, sections: Any) -> tuple[Any, Any]:
    """Evaluation and observation of a turbine by their addresses."""
    evaluate = by_address(step.evaluate.of(type(m)), NUMBER, NUMBER, typeof(m))
    return evaluate, by_address(step.observe, NUMBER, *map(typeof, (control, one, sections)), types.boolean)


@cache
def _loop_for(function: Any, signature: Any) -> Any:
    return kernel_for(signature)(function)


def compiled_advance(*arguments: Any) -> Any:
    """The time loop, compiled for all its arguments but the first; the controller has the type of all controllers."""
    if interpreted():
        return step.advance
    return _loop_for(step.advance, types.void(types.int64, *map(typeof, arguments)))
