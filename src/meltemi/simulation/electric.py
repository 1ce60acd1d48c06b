"""The electrical system of a machine that stands in steady operation or is linearised, and of its grid."""

from __future__ import annotations

from typing import Any

from meltemi.control import signals as sg
from meltemi.core.errors import InputError
from meltemi.core.kernel import kernel
from meltemi.core.series import values
from meltemi.electrical.advance import GRID_POWER, TORQUE, electric_begin, electric_rates
from meltemi.environment import conditions as cd
from meltemi.environment.grid import PowerGrid
from meltemi.numbers.views import viewer
from meltemi.simulation.step import GEAR_RATIO, POWER
from meltemi.structure.kinematics import GENERATOR, N_SHAFT
from meltemi.turbine import exchange as ex

ELECTRIC_PARTS = "electrical electric d_electric drive demands outside structure v columns summary".split()
"""Arrays of the kernels below."""

_view = viewer()


def check_grid(grid: PowerGrid | None, electrical: bool, rated_power: float) -> None:
    """InputError for what a run would not feel, or no turbine can give.

    Args:
      electrical: there is an electrical system.
      rated_power: [W] of the turbine.
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
    if most > sg.MOST_REACTIVE * rated_power:
        raise InputError(f"grid.reactive_power: {most:g} var is far beyond the rated power of {rated_power:g} W")


@kernel
def begin_electric(dt: float, numbers: Any, parts: tuple[Any, ...]) -> None:
    """Steady operation at the present speed and torque on the drive, which becomes what the machine makes of it."""
    electrical, electric, _, drive, demands, outside, structure, v, columns, _ = _view(numbers, parts)
    speed = structure[GEAR_RATIO] * v[columns.shape[1] - N_SHAFT + GENERATOR]
    torque, reactive = drive[ex.GENERATOR_TORQUE], demands[sg.REACTIVE_POWER] + outside[cd.REACTIVE_POWER]
    voltage, frequency = outside[cd.GRID_VOLTAGE], outside[cd.GRID_FREQUENCY]
    electric_begin(electrical, torque, reactive, speed, voltage, frequency, electric, dt)
    drive[ex.GENERATOR_TORQUE] = electric[TORQUE]


@kernel
def rates_of_electric(numbers: Any, parts: tuple[Any, ...]) -> None:
    """Rates under the demands, and the torque on the drive."""
    electrical, electric, rates, drive, demands, outside, structure, v, columns, _ = _view(numbers, parts)
    speed = structure[GEAR_RATIO] * v[columns.shape[1] - N_SHAFT + GENERATOR]
    torque, reactive = demands[sg.GENERATOR_TORQUE], demands[sg.REACTIVE_POWER] + outside[cd.REACTIVE_POWER]
    voltage, frequency = outside[cd.GRID_VOLTAGE], outside[cd.GRID_FREQUENCY]
    electric_rates(electrical, torque, reactive, speed, voltage, frequency, electric, rates)
    drive[ex.GENERATOR_TORQUE] = electric[TORQUE]


@kernel
def deliver(numbers: Any, parts: tuple[Any, ...]) -> None:
    """The power of the machine is what the grid gets."""
    seen = _view(numbers, parts)
    seen[9][POWER] = seen[1][GRID_POWER]
