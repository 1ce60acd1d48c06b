"""Parts of a machine that not every model has: electrical system, reactions of a moving base, sea, wakes ...

A part is a record of arrays with the kernels that act at the hooks of ``simulation/step.py``. It joins the records of
those models, or runs, that have it; to all others it costs nothing. Its module defines what it contributes:
members of the records, signals, states, parameters, channels, inputs of linear models, entries of the log.

Reference: docs/development/parts.md.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING, Any, ClassVar

from meltemi.compiler import KernelRecord, Table
from meltemi.core.errors import InputError, did_you_mean

if TYPE_CHECKING:
    from meltemi.control.controller import LogEntry
    from meltemi.simulation.channels import Channel

ParameterTables = tuple[tuple[type[Table], str, tuple[str, ...]], ...]
Place = tuple[str, int]
"""Name of an array of a case, and index of one of its entries."""


@dataclass(frozen=True)
class LinearVariable:
    """A state, input or output of a linear model.

    Attributes:
      name, unit: name; SI unit.
      value: value of an input at the operating point.
      moves: entries of a case, each with its change for a unit change of the state or input.
      shows: entry of a case with the value of an output, or with the derivative of a state.
    """

    name: str
    unit: str
    moves: tuple[tuple[Place, float], ...] = ()
    shows: Place = ("", 0)
    value: float = 0.0


@dataclass(frozen=True)
class StateRows:
    """States of a part: rows of one of its signals, with their time derivatives in the same rows of another array.

    Attributes:
      array, derivative: names of the arrays.
      names, units: names and units of the states.
    """

    array: str
    derivative: str
    names: tuple[str, ...]
    units: tuple[str, ...]

    def variables(self) -> list[LinearVariable]:
        """The states of a linear model."""
        each = enumerate(zip(self.names, self.units, strict=True))
        return [LinearVariable(name, unit, (((self.array, i), 1.0),), (self.derivative, i)) for i, (name, unit) in each]


class Part:
    """Base of parts, which does nothing. A part is a frozen data class of the arrays that its records need.

    Attributes:
      control: class of records that extends ``simulation.system.Control``, or None.
      system: class of the record of the turbine with this part.
      signals: arrays that channels may record, by their tables; states are among them, so that they are saved.
      parameter_tables: table, array and names of scalar parameters, as of a rotor.
      afterwards: signals that a run computes after its time loop, and which have no value at an instant.
      replaces_momentum: whether the part computes the induced velocities in place of the momentum balance.
      settles: whether runs begin in steady operation without the part, which settles there.
    """

    replaces_momentum: ClassVar[bool] = False
    settles: ClassVar[bool] = False
    control: ClassVar[type[KernelRecord] | None] = None
    system: ClassVar[type[KernelRecord] | None] = None
    signals: ClassVar[dict[str, type[Table]]] = {}
    parameter_tables: ClassVar[ParameterTables] = ()
    afterwards: ClassVar[tuple[str, ...]] = ()

    @property
    def shown(self) -> tuple[str, ...]:
        """Names of the channels of the part that a run records by default."""
        return ()

    def shapes(self) -> dict[str, tuple[int, ...]]:
        """Shapes of the signals."""
        return {name: table.shape() for name, table in self.signals.items()}

    def arrays(self) -> dict[str, Any]:
        """All other arrays of its records; a run writes into none that the part holds."""
        return {}

    def begin(self, case: Any) -> None:
        """Bring the part into steady operation at the present motion by evaluations, after ``step.begin_parts``."""

    def channels(self) -> Sequence[Channel]:
        """Channels that a run can record of the part."""
        return ()

    def derived(self, channels: Sequence[Channel], parts: Sequence[Part]) -> Any:
        """Those channels of a run with ``parts`` that follow from others (``frames.loads.Derived``), or None."""
        return None

    def states(self) -> Sequence[StateRows]:
        """States of linear models."""
        return ()

    def inputs(self, case: Any, point: Any) -> dict[str, LinearVariable]:
        """Inputs of linear models by name, for a case at an operating point."""
        return {}

    def notices(self, channels: Sequence[Channel]) -> list[str]:
        """Warnings about a run that records these channels."""
        return []

    def why(self, case: Any) -> str:
        """Reason for which the part ended a run, or nothing."""
        return ""

    def log(self, case: Any, time: float) -> list[LogEntry]:
        """Log of the part in a case up to a time [s]."""
        return []


def _has(turbine: Any, name: str) -> bool:
    return getattr(turbine, name, None) is not None


PARTS: dict[str, Callable[[Any, Any], bool]] = {
    "meltemi.electrical.part": lambda turbine, options: options.electrical != "ideal",
    "meltemi.vortex.near_wake": lambda turbine, options: options.wake == "near",
    "meltemi.vortex.part": lambda turbine, options: options.wake in ("hybrid", "free"),
    "meltemi.sea.mass_dampers": lambda turbine, _: any(d.span is None for d in getattr(turbine, "mass_dampers", ())),
    "meltemi.sea.blade_dampers": lambda turbine, _: any(d.height is None for d in getattr(turbine, "mass_dampers", ())),
    "meltemi.sea.pile": lambda turbine, options: _has(turbine, "support"),
    "meltemi.frames.part": lambda turbine, options: _has(turbine, "frame") and not _has(turbine, "platform"),
    "meltemi.floating.lumped": lambda turbine, options: _has(turbine, "platform"),
    "meltemi.frames.afloat": lambda turbine, options: _has(turbine, "frame") and _has(turbine, "platform"),
}
"""Modules of parts, and whether a turbine with options has it; ``part_of(turbine, options, rotor)`` there makes it."""
SEA = "meltemi.sea.sea_part"
"""Module whose ``sea_part`` makes the part of a sea."""
GROUP = "meltemi.parts"
"""Entry points of such functions in other packages; ``extensions`` of a turbine names those that it has."""


def complete_table(table: Any, given: Mapping[str, float], where: str) -> Any:
    """A table of numbers, all of which must be given.

    Raises:
      InputError: one is missing or unknown; ``where`` says where.
    """
    if missing := [name for name in table.names if name not in given]:
        raise InputError(f"{where}: missing {', '.join(missing)}")
    if unknown := [name for name in given if name not in table.names]:
        raise InputError(f"{where}.{unknown[0]}: {did_you_mean(unknown[0], table.names)}")
    return table.of(**given)


def parts_of(turbine: Any, options: Any, rotor: Any) -> tuple[Part, ...]:
    """Parts of a turbine with a rotor.

    Raises:
      InputError: a part is not described, is not installed, or does not suit the turbine.
    """
    makers = [import_module(module).part_of for module, has in PARTS.items() if has(turbine, options)]
    makers += [_registered(name) for name in getattr(turbine, "extensions", ())]
    return tuple(make(turbine, options, rotor) for make in makers)


def part_of_sea(sea: Any, model: Any, duration: float, origin: tuple[float, float]) -> Part | None:
    """The part of a run that has a sea, which may already be one.

    Raises:
      InputError: the turbine does not stand in water, waves break, or the sea does not last.
    """
    if sea is None or isinstance(sea, Part):
        return sea
    part: Part = import_module(SEA).sea_part(sea, model, duration, origin)
    return part


def _registered(name: str) -> Callable[[Any, Any, Any], Part]:
    from importlib.metadata import entry_points

    registered = entry_points(group=GROUP)
    if name not in registered.names:
        known = did_you_mean(name, registered.names) if registered.names else "there are none"
        raise InputError(f"extensions.{name}: no installed package registers this part as {GROUP}: {known}")
    make: Callable[[Any, Any, Any], Part] = registered[name].load()
    return make
