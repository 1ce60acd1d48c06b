"""Trial of controllers: a few steps before long computations, so that faulty ones are rejected immediately."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from meltemi.compiler import is_ours
from meltemi.control.controller import Controller
from meltemi.core.errors import InputError, MeltemiError, Status
from meltemi.simulation.model import Model
from meltemi.simulation.rotors import default_step, operating_point
from meltemi.simulation.run import Run
from meltemi.simulation.simulate import Simulation, march
from meltemi.wind.fields import SteadyWind

CALLS = 3
"""Number of calls of a controller in its trial."""


def try_controllers(controllers: Mapping[str, Controller], model: Model[Any]) -> None:
    """Simulate a few steps of steady operation under each controller.

    Controllers of this package are not tried, only libraries and user-defined Python.

    Args:
      controllers: controllers by label.
      model: turbine model.

    Raises:
      InputError: a controller cannot be started, raises an error, or demands NaN.
    """
    foreign = {label: each for label, each in controllers.items() if not _ours(each)}
    if not foreign:
        return
    wind, step = SteadyWind(speed=0.5 * (model.turbine.cut_in + model.turbine.cut_out)), default_step(model)
    point = operating_point(model, wind.speed)
    for label, controller in foreign.items():
        every = max(math.ceil((controller.sample_time or step) / step - 1e-9), 1) * step
        run = Run(model, wind, duration=CALLS * every, controller=controller, output_step=step, start=point)
        try:
            simulation = Simulation(run)
            march(simulation)
            result = simulation.result()
        except MeltemiError as error:
            raise InputError(f"controller {label!r} cannot be used: {error}") from None
        if result.status is Status.INTERRUPTED:
            raise KeyboardInterrupt
        if result.status in (Status.CONTROLLER_RAISED, Status.CONTROLLER_DEMAND):
            raise InputError(f"controller {label!r} fails in its first steps: {result.message}")


def _ours(controller: Controller) -> bool:
    home = getattr(controller.update, "__module__", "")
    return controller.fresh is None and is_ours(home)
