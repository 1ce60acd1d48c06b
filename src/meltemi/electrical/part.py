"""The electrical system as a part of the machine: generator, converters, DC link and grid connection."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from meltemi.compiler import KernelRecord, Table, kernel
from meltemi.control.controller import LogEntry
from meltemi.control.signals import Demands
from meltemi.core.errors import InputError
from meltemi.electrical.advance import electric_advance, electric_begin, electric_rates
from meltemi.electrical.tables import (
    N_STATES,
    TRIPS,
    Electrical,
    ElectricalParameters,
    ElectricState,
    electrical_array,
)
from meltemi.environment.conditions import Conditions
from meltemi.simulation.case import Case
from meltemi.simulation.channels import Channel, channels_of_group
from meltemi.simulation.parts import LinearVariable, ParameterTables, Part, StateRows
from meltemi.simulation.step import advance_drive, begin_parts, generated_power, part_drive_rates, report_parts
from meltemi.simulation.system import AnySystem, Control, generator_speed

if TYPE_CHECKING:
    from meltemi.simulation.operating_point import OperatingPoint

FEATURE = "the electrical system"


class ElectricControl(Electrical, Control):
    """Control of a turbine with an electrical system."""


@kernel
def reactive_power(c: ElectricControl) -> float:
    """[var] reactive power that controller and operator demand."""
    return c.demands.reactive_power + c.outside.reactive_power


@begin_parts.variant
@kernel
def _(dt: float, c: ElectricControl, m: AnySystem) -> None:
    voltage, frequency = c.outside.grid_voltage, c.outside.grid_frequency
    electric_begin(dt, c.drive.generator_torque, reactive_power(c), generator_speed(m), voltage, frequency, c)
    c.drive.generator_torque = c.electric.torque


@part_drive_rates.variant
@kernel
def _(c: ElectricControl, m: AnySystem) -> None:
    voltage, frequency = c.outside.grid_voltage, c.outside.grid_frequency
    electric_rates(c.demands.generator_torque, reactive_power(c), generator_speed(m), voltage, frequency, c)
    c.drive.generator_torque = c.electric.torque


@advance_drive.variant
@kernel
def _(c: ElectricControl, m: AnySystem) -> None:
    dt, drive, voltage, frequency = c.settings.time_step, c.drive, c.outside.grid_voltage, c.outside.grid_frequency
    electric_advance(dt, drive.generator_torque, reactive_power(c), generator_speed(m), voltage, frequency, c)
    drive.generator_torque = drive.torque_held = c.electric.torque


@report_parts.variant
@kernel
def _(c: ElectricControl) -> None:
    if c.electric.trip > 0.0:
        c.measured.grid = 0.0


@generated_power.variant
@kernel
def _(c: ElectricControl, m: AnySystem) -> float:
    return c.electric.grid_power


@dataclass(frozen=True)
class ElectricPart(Part):
    """The electrical system of a model.

    Attributes:
      electrical: its parameters.
    """

    control: ClassVar[type[KernelRecord] | None] = ElectricControl
    signals: ClassVar[dict[str, type[Table]]] = {"electric": ElectricState}
    parameter_tables: ClassVar[ParameterTables] = ((ElectricalParameters, "electrical", ElectricalParameters.names),)
    electrical: NDArray[np.float64]

    def arrays(self) -> dict[str, Any]:
        """Parameters, and the rates of the states."""
        return {"electrical": self.electrical, "d_electric": ElectricState.zeros()}

    def channels(self) -> Sequence[Channel]:
        """Currents, voltages, powers and losses."""
        return channels_of_group("electrical")

    def states(self) -> Sequence[StateRows]:
        """All states except those of the protection."""
        rows = ElectricState.rows[:N_STATES]
        return (StateRows("electric", "d_electric", tuple(r.name for r in rows), tuple(r.unit for r in rows)),)

    def inputs(self, case: Case, point: OperatingPoint) -> dict[str, LinearVariable]:
        """Demands of torque and reactive power; voltage and frequency of the grid."""
        case.begin_parts()
        outside = case.control.outside
        inputs = (
            ("generator_torque", "N m", "demands", Demands, point.generator_torque),
            ("reactive_power", "var", "demands", Demands, 0.0),
            ("grid_voltage", "-", "outside", Conditions, outside.grid_voltage),
            ("grid_frequency", "Hz", "outside", Conditions, outside.grid_frequency),
        )
        return {
            name: LinearVariable("", unit, (((array, table.index(name)), 1.0),), value=value)
            for name, unit, array, table, value in inputs
        }

    def log(self, case: Case, time: float) -> list[LogEntry]:
        """Entry for a trip of the protection."""
        state = case.view("electric")
        number = int(state["trip"])
        since = time - float(state["off_time"])
        return [LogEntry(since, "protection", "electrical system tripped", TRIPS[number])] if number else []


def part_of(turbine: Any, options: Any, rotor: Any) -> ElectricPart:
    """The electrical system of a turbine; as ``simulation.parts.parts_of``."""
    law, speed = turbine.control.torque, turbine.control.pitch.reference_speed
    if turbine.electrical is None:
        raise InputError(
            f"{turbine.name}: options.electrical 'averaged' needs turbine.electrical; "
            f"size_electrical(rated_power={law.rated_power:.4g}, rated_speed={speed:.4g}) creates one, and so does "
            "electrical: sized in a case file"
        )
    if unfit := turbine.electrical.unfit(law.rated_power / law.rated_speed, speed):
        raise InputError(f"{turbine.name}: electrical.{unfit}")
    return ElectricPart(electrical_array(turbine.electrical))
