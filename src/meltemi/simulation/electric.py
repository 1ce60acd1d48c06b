"""The electrical system of a machine that stands in steady operation or is linearised."""

from __future__ import annotations

from typing import Any

from meltemi.control import signals as sg
from meltemi.core.kernel import kernel
from meltemi.electrical.advance import GRID_POWER, TORQUE, electric_begin, electric_rates
from meltemi.environment import conditions as cd
from meltemi.numbers.views import viewer
from meltemi.simulation.step import GEAR_RATIO, POWER
from meltemi.structure.kinematics import GENERATOR, N_SHAFT
from meltemi.turbine import exchange as ex

ELECTRIC_PARTS = "electrical electric d_electric drive demands outside structure v columns summary".split()
"""Arrays of the kernels below."""

_view = viewer()


@kernel
def begin_electric(dt: float, numbers: Any, parts: tuple[Any, ...]) -> None:
    """Steady operation at the present speed and torque on the drive, which becomes what the machine makes of it."""
    electrical, electric, _, drive, demands, outside, structure, v, columns, _ = _view(numbers, parts)
    speed = structure[GEAR_RATIO] * v[columns.shape[1] - N_SHAFT + GENERATOR]
    torque, reactive = drive[ex.GENERATOR_TORQUE], demands[sg.REACTIVE_POWER]
    voltage, frequency = outside[cd.GRID_VOLTAGE], outside[cd.GRID_FREQUENCY]
    electric_begin(electrical, torque, reactive, speed, voltage, frequency, electric, dt)
    drive[ex.GENERATOR_TORQUE] = electric[TORQUE]


@kernel
def rates_of_electric(numbers: Any, parts: tuple[Any, ...]) -> None:
    """Rates under the demands, and the torque on the drive."""
    electrical, electric, rates, drive, demands, outside, structure, v, columns, _ = _view(numbers, parts)
    speed = structure[GEAR_RATIO] * v[columns.shape[1] - N_SHAFT + GENERATOR]
    torque, reactive = demands[sg.GENERATOR_TORQUE], demands[sg.REACTIVE_POWER]
    voltage, frequency = outside[cd.GRID_VOLTAGE], outside[cd.GRID_FREQUENCY]
    electric_rates(electrical, torque, reactive, speed, voltage, frequency, electric, rates)
    drive[ex.GENERATOR_TORQUE] = electric[TORQUE]


@kernel
def deliver(numbers: Any, parts: tuple[Any, ...]) -> None:
    """The power of the machine is what the grid gets."""
    seen = _view(numbers, parts)
    seen[9][POWER] = seen[1][GRID_POWER]
