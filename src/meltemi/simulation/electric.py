"""The electrical system and its grid in steady operation and in linearisation."""

from __future__ import annotations

from meltemi.control import signals as sg
from meltemi.core.errors import InputError
from meltemi.core.kernel import kernel
from meltemi.core.series import values
from meltemi.electrical.advance import electric_begin, electric_rates
from meltemi.environment.grid import PowerGrid
from meltemi.simulation.system import AnySystem, Control, generator_speed


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
    if most > sg.MOST_REACTIVE * rated_power:
        raise InputError(f"grid.reactive_power: {most:g} var is far beyond the rated power of {rated_power:g} W")


@kernel
def begin_electric(dt: float, c: Control, m: AnySystem) -> None:
    """Set steady operation at the present speed and torque of the drive; the torque becomes the electrical system's."""
    reactive = c.demands.reactive_power + c.outside.reactive_power
    voltage, frequency = c.outside.grid_voltage, c.outside.grid_frequency
    electric_begin(dt, c.drive.generator_torque, reactive, generator_speed(m), voltage, frequency, c)
    c.drive.generator_torque = c.electric.torque


@kernel
def rates_of_electric(c: Control, m: AnySystem) -> None:
    """Compute the time derivatives under the present demands, and the torque on the drive."""
    reactive = c.demands.reactive_power + c.outside.reactive_power
    voltage, frequency = c.outside.grid_voltage, c.outside.grid_frequency
    electric_rates(c.demands.generator_torque, reactive, generator_speed(m), voltage, frequency, c)
    c.drive.generator_torque = c.electric.torque
