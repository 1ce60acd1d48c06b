"""Checks of the grid of a run."""

from __future__ import annotations

from meltemi.control.signals import MOST_REACTIVE
from meltemi.core.errors import InputError
from meltemi.core.series import values
from meltemi.environment.grid import PowerGrid


def check_grid(grid: PowerGrid | None, electrical: bool, rated_power: float) -> None:
    """Raise InputError for a grid without effect on the run, or for a demand that no turbine can meet.

    Args:
      electrical: whether an electrical system is modelled.
      rated_power: [W] rated power of the turbine.
    """
    if grid is None:
        return
    if not electrical:
        for name, nothing in (("voltage", 1.0), ("reactive_power", 0.0)):
            if (values(getattr(grid, name)) != nothing).any():
                raise InputError(
                    f"grid.{name}: other than {nothing:g} it has no effect without an electrical system; "
                    "set options.electrical: averaged"
                )
    most = abs(values(grid.reactive_power)).max()
    if most > MOST_REACTIVE * rated_power:
        raise InputError(f"grid.reactive_power: {most:g} var is far beyond the rated power of {rated_power:g} W")
