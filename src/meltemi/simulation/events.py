"""Events of a run as data: faults of the machine, the grid, words of the operator.

Each has a time ``at`` from which it acts, and those that can end a time ``until``. :func:`schedule` turns them into
what the time loop reads (``control/faults.py``). Over-speed and the like are no events: they are what a controller has
to notice, and what events provoke.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from operator import itemgetter
from typing import TYPE_CHECKING, Annotated, Any, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, Field, model_validator

from meltemi.control import faults as f
from meltemi.control.controller import LogEntry
from meltemi.control.signals import REQUESTS
from meltemi.control.supervisor.tables import PRODUCING
from meltemi.core.errors import InputError, did_you_mean
from meltemi.core.record import Record
from meltemi.core.yamlfile import validated
from meltemi.maths.tables import MAX_BLADES, MAX_FLAPS

if TYPE_CHECKING:
    from meltemi.turbine.power_turbine import AnyTurbine

NEVER = 1e18
"""Steps that no run has."""
Change = tuple[str, float, float]
"""Name in ``Faults``, value from ``at`` on, value after ``until``."""


def _sensor(name: str) -> str:
    if name not in f.SENSORS:
        raise ValueError(f"there is no sensor {name!r}; {did_you_mean(name, f.SENSORS)}")
    return name


BladeNumber = Annotated[int, Field(ge=1, le=MAX_BLADES)]
FlapNumber = Annotated[int, Field(ge=1, le=MAX_FLAPS)]
SensorName = Annotated[str, AfterValidator(_sensor)]


class Happening(Record):
    """What all events have."""

    at: float = Field(ge=0.0)
    """[s] from which it acts."""

    @property
    def end(self) -> float:
        """[s] from which it acts no more."""
        return math.inf

    @property
    def part(self) -> str:
        """What it concerns: two events cannot have a hold on the same part at a time."""
        return self.what

    @property
    def what(self) -> str:
        """In words."""
        raise NotImplementedError

    def changes(self) -> tuple[Change, ...]:
        """What it changes in ``Faults``."""
        raise NotImplementedError


class Lasting(Happening):
    """An event that may end."""

    until: float | None = None
    """[s] from which it acts no more; by default it stays."""

    @property
    def end(self) -> float:
        return math.inf if self.until is None else self.until

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.end <= self.at:
            raise ValueError(f"until {self.until:g} s must lie after at {self.at:g} s")
        return self


class PitchStuck(Lasting):
    """A blade keeps its pitch angle, whatever is demanded."""

    type: Literal["pitch_stuck"] = "pitch_stuck"
    blade: BladeNumber
    """Number of the blade."""

    @property
    def part(self) -> str:
        return f"pitch of blade {self.blade}"

    @property
    def what(self) -> str:
        return f"{self.part} stuck"

    def changes(self) -> tuple[Change, ...]:
        return ((f"pitch_stuck_{self.blade}", 1.0, 0.0),)


class PitchRunaway(Lasting):
    """A blade pitches to the end of its range, whatever is demanded."""

    type: Literal["pitch_runaway"] = "pitch_runaway"
    blade: BladeNumber
    """Number of the blade."""
    rate: float = Field(ge=-1.0, le=1.0)
    """[rad/s] towards feather when positive, towards fine when negative."""

    @model_validator(mode="after")
    def _moves(self) -> Self:
        if self.rate == 0.0:
            raise ValueError("rate must not be zero; a blade that stands still is pitch_stuck")
        return self

    @property
    def part(self) -> str:
        return f"pitch of blade {self.blade}"

    @property
    def what(self) -> str:
        return f"{self.part} runs away towards {'feather' if self.rate > 0.0 else 'fine'}"

    def changes(self) -> tuple[Change, ...]:
        return ((f"pitch_run_{self.blade}", self.rate, 0.0),)


class FlapStuck(Lasting):
    """A flap keeps its deflection, whatever is demanded."""

    type: Literal["flap_stuck"] = "flap_stuck"
    blade: BladeNumber
    """Number of the blade."""
    flap: FlapNumber = 1
    """Number of the flap on the blade."""

    @property
    def what(self) -> str:
        return f"flap {self.flap} of blade {self.blade} stuck"

    def changes(self) -> tuple[Change, ...]:
        return ((f"flap_stuck_{self.flap}_{self.blade}", 1.0, 0.0),)


class GridLoss(Lasting):
    """There is no grid that takes power: no generator torque; controllers see it (``grid``)."""

    type: Literal["grid_loss"] = "grid_loss"

    @property
    def what(self) -> str:
        return "grid lost"

    def changes(self) -> tuple[Change, ...]:
        return (("grid", 0.0, 1.0),)


class VoltageDip(Lasting):
    """The grid's voltage falls to a share of what it is; ``options.electrical: averaged`` shows what follows."""

    type: Literal["voltage_dip"] = "voltage_dip"
    voltage: float
    """Share of the voltage that is left, 0 for a short circuit at the terminals."""

    @model_validator(mode="after")
    def _share(self) -> Self:
        if not 0.0 <= self.voltage <= 1.5:
            volts = "; it is a share of the nominal voltage, not volts" if self.voltage > 1.5 else ""
            raise ValueError(f"voltage {self.voltage:g} is not between 0 and 1.5{volts}")
        return self

    @property
    def part(self) -> str:
        return "voltage of the grid"

    @property
    def what(self) -> str:
        return f"grid voltage at {100.0 * self.voltage:g} %"

    def changes(self) -> tuple[Change, ...]:
        return (("voltage", self.voltage, 1.0),)


class GeneratorFault(Lasting):
    """The generator gives no torque; controllers see it only by its effects."""

    type: Literal["generator_fault"] = "generator_fault"

    @property
    def what(self) -> str:
        return "generator without torque"

    def changes(self) -> tuple[Change, ...]:
        return (("generator", 0.0, 1.0),)


class SensorOffset(Lasting):
    """A measurement is off by a constant."""

    type: Literal["sensor_offset"] = "sensor_offset"
    sensor: SensorName
    """Name of a measurement, with the number of its blade: generator_speed, pitch_2, out_of_plane_moment_1."""
    offset: float
    """Added to the measurement, in its SI unit."""

    @property
    def part(self) -> str:
        return f"offset of the sensor {self.sensor}"

    @property
    def what(self) -> str:
        return f"sensor {self.sensor} off by {self.offset:g} {f.SENSOR_UNITS[self.sensor]}"

    def changes(self) -> tuple[Change, ...]:
        return ((f"offset_{self.sensor}", self.offset, 0.0),)


class SensorDrift(Lasting):
    """A measurement goes astray at a constant rate."""

    type: Literal["sensor_drift"] = "sensor_drift"
    sensor: SensorName
    """Name of a measurement, as for sensor_offset."""
    rate: float
    """Added to the measurement for each second, in its SI unit."""

    @property
    def part(self) -> str:
        return f"drift of the sensor {self.sensor}"

    @property
    def what(self) -> str:
        return f"sensor {self.sensor} drifts by {self.rate:g} {f.SENSOR_UNITS[self.sensor]} a second"

    def changes(self) -> tuple[Change, ...]:
        return ((f"drift_begin_{self.sensor}", self.at, 0.0), (f"drift_{self.sensor}", self.rate, 0.0))


class SensorLoss(Lasting):
    """A measurement is frozen, or zero."""

    type: Literal["sensor_loss"] = "sensor_loss"
    sensor: SensorName
    """Name of a measurement, as for sensor_offset."""
    holds: Literal["last", "zero"] = "last"
    """What a controller reads from then on."""

    @property
    def part(self) -> str:
        return f"loss of the sensor {self.sensor}"

    @property
    def what(self) -> str:
        return f"sensor {self.sensor} lost, gives {'its last value' if self.holds == 'last' else 'zero'}"

    def changes(self) -> tuple[Change, ...]:
        return ((f"lost_{self.sensor}", f.KEEP_NEXT if self.holds == "last" else f.ZERO, 0.0),)


class Request(Happening):
    """A word of the operator, which holds until the next one."""

    type: Literal["request"] = "request"
    request: Literal["none", "start", "normal_stop", "emergency_stop"]
    """The word."""

    @property
    def part(self) -> str:
        return "request of the operator"

    @property
    def what(self) -> str:
        return f"request {self.request.replace('_', ' ')}"

    def changes(self) -> tuple[Change, ...]:
        return (("request", float(REQUESTS.index(self.request)), 0.0),)


class PowerLimit(Lasting):
    """The operator limits the power; controllers that know of limits follow it, the baseline law does not."""

    type: Literal["power_limit"] = "power_limit"
    power: float = Field(ge=0.0)
    """[W] electrical."""

    @property
    def part(self) -> str:
        return "power limit of the operator"

    @property
    def what(self) -> str:
        return f"power limit {self.power / 1e3:g} kW"

    def changes(self) -> tuple[Change, ...]:
        return (("power_limit", self.power, math.inf),)


class Brake(Lasting):
    """The brake is applied, whatever is demanded."""

    type: Literal["brake"] = "brake"
    share: float = Field(default=1.0, gt=0.0, le=1.0)
    """Of the full brake torque."""

    @property
    def what(self) -> str:
        return "brake applied"

    def changes(self) -> tuple[Change, ...]:
        return (("brake_applied", self.share, 0.0),)


class BrakeFault(Lasting):
    """The brake does not act, whatever is demanded."""

    type: Literal["brake_fault"] = "brake_fault"

    @property
    def what(self) -> str:
        return "brake without torque"

    def changes(self) -> tuple[Change, ...]:
        return (("brake", 0.0, 1.0),)


class YawStuck(Lasting):
    """The yaw drive stands still, whatever is demanded."""

    type: Literal["yaw_stuck"] = "yaw_stuck"

    @property
    def what(self) -> str:
        return "yaw drive stuck"

    def changes(self) -> tuple[Change, ...]:
        return (("yaw_drive", 0.0, 1.0),)


KINDS: tuple[type[Happening], ...] = (
    *(PitchStuck, PitchRunaway, FlapStuck, GridLoss, VoltageDip, GeneratorFault, SensorOffset, SensorDrift, SensorLoss),
    *(Request, PowerLimit, Brake, BrakeFault, YawStuck),
)
"""All kinds of events."""

RUNNING = tuple(name.replace("_", " ") for name in ("start_up", *PRODUCING))
AT_REST = ("standby", "idling")
"""States of the supervisor, in the words of its log."""

Event = Annotated[
    PitchStuck
    | PitchRunaway
    | FlapStuck
    | GridLoss
    | VoltageDip
    | GeneratorFault
    | SensorOffset
    | SensorDrift
    | SensorLoss
    | Request
    | PowerLimit
    | Brake
    | BrakeFault
    | YawStuck,
    Field(discriminator="type"),
]
"""Any of them, told apart by ``type``."""


class _Events(Record):
    events: tuple[Event, ...]


def read_events(events: Iterable[Happening | Mapping[str, Any]]) -> tuple[Happening, ...]:
    """Events from records, or from keys and values.

    Raises:
      InputError: with number and key.
    """
    plain = [event.content() if isinstance(event, Happening) else event for event in events]
    return validated({"events": plain}, _Events, "run").events


def conflict(events: Sequence[Happening]) -> str | None:
    """Which two events contradict each other, in words; None if there are none."""
    order = sorted(range(len(events)), key=lambda i: (events[i].at, i))
    for place, i in enumerate(order):
        for j in order[place + 1 :]:
            one, two = events[i], events[j]
            if one.part != two.part or one.end <= two.at:
                continue
            follows = one.end == math.inf and isinstance(two, Request | PowerLimit) and two.at > one.at
            if not follows:
                until = "for good" if one.end == math.inf else f"until {one.end:g} s"
                return (
                    f"events.{j} at {two.at:g} s and events.{i}, which acts from {one.at:g} s {until}, "
                    f"contradict each other ({one.part}); change their times, or leave one out"
                )
    return None


@dataclass(frozen=True)
class Schedule:
    """Events as the time loop reads them.

    Attributes:
      rows: (n, 3) step, place in ``faults``, value; by time.
      log: what happens, by time, each with its step.
    """

    rows: NDArray[np.float64]
    log: tuple[tuple[int, LogEntry], ...]


def schedule(events: Sequence[Happening], turbine: AnyTurbine, dt: float, n_steps: int) -> Schedule:
    """When events act: at the first instant that is not before their time.

    Args:
      dt: [s] time step.
      n_steps: number of instants of the run.

    Raises:
      InputError: an event comes after the end of the run, is over within its time step, concerns what the turbine
        does not have, or contradicts another one.
    """
    if words := conflict(events):
        raise InputError(words)
    edges: list[tuple[int, bool, float, str, Happening]] = []
    for i, event in enumerate(events):
        _check_parts(event, f"events.{i}", turbine)
        begin = _step(event.at, dt)
        if begin >= n_steps:
            raise InputError(
                f"events.{i}.at: {event.at:g} s is after the end of the run at {(n_steps - 1) * dt:g} s; "
                "take an earlier time or a longer duration"
            )
        edges.append((begin, True, event.at, event.what, event))
        if event.end < math.inf:
            end = _step(event.end, dt)
            if end == begin:
                raise InputError(f"events.{i}.until: the event is over within its time step of {dt:g} s")
            edges.append((end, False, event.end, event.what, event))
    # an end comes before what begins at the same instant
    edges.sort(key=itemgetter(0, 1, 2, 3))
    rows = [
        (step, f.Faults.index(name), on if begins else off)
        for step, begins, _, _, event in edges
        for name, on, off in event.changes()
    ]
    log = tuple(
        (step, LogEntry(step * dt, "event", what if begins else f"{what}: over")) for step, begins, _, what, _ in edges
    )
    return Schedule(np.array(rows, dtype=float).reshape(-1, 3), log)


def out_of_place(events: Iterable[Happening], log: Iterable[LogEntry], state: str) -> list[str]:
    """Sentences about events that found the machine in another state than they are for.

    A stop is for a machine that runs, a start for one at rest; faults are for the state in which a run begins, unless
    an event before them has ended it.

    Args:
      log: of the run, with the supervisor's transitions.
      state: of the supervisor at the end, in words.
    """
    moves: list[tuple[str, str, LogEntry]] = []
    for entry in log:
        if entry.source == "supervisor":
            source, target = entry.what.split(" -> ")
            moves.append((source, target, entry))
    first = moves[0][0] if moves else state
    left = next((entry for source, target, entry in moves if source in RUNNING and target not in RUNNING), None)
    said = []
    for i, event in enumerate(events):
        now = next((target for _, target, entry in reversed(moves) if entry.time < event.at - 1e-9), first)
        word = event.request if isinstance(event, Request) else ""
        alone = not any(other.at < event.at for other in events)
        stopped = alone and first in RUNNING and now not in RUNNING and not isinstance(event, PowerLimit)
        useless = (word.endswith("_stop") and now in AT_REST) or (word == "start" and now in RUNNING)
        if useless or (stopped and word != "start"):
            why = f", which stopped at {left.time:.2f} s ({left.reason})" if left and left.time < event.at else ""
            said.append(f"events.{i}: {event.what} at {event.at:g} s found the machine in state {now!r}{why}")
    return said


def ignored(events: Iterable[Happening]) -> list[str]:
    """Sentences about words of the operator, which the baseline law does not hear."""
    return [
        f"events.{i}: {event.what} at {event.at:g} s does nothing: the baseline law does not follow the operator; "
        "meltemi.control.SupervisedController does"
        for i, event in enumerate(events)
        if isinstance(event, Request | PowerLimit)
    ]


def refuse_dips(events: Sequence[Happening]) -> None:
    """InputError for a dip that a run without an electrical system would not feel."""
    for i, event in enumerate(events):
        if isinstance(event, VoltageDip):
            raise InputError(
                f"events.{i}: a voltage_dip has no effect without an electrical system; "
                "set options.electrical: averaged"
            )


def _step(t: float, dt: float) -> int:
    """The first instant that is not before ``t``, rounding apart."""
    return math.ceil(min(t / dt, NEVER) - 1e-6)


def _check_parts(event: Happening, where: str, turbine: AnyTurbine) -> None:
    """Refuse blades, flaps and sensors that the turbine does not have."""
    n_blades, n_flaps = turbine.n_blades, len(turbine.flaps)
    blade, flap = getattr(event, "blade", None), getattr(event, "flap", None)
    if blade is not None and blade > n_blades:
        raise InputError(f"{where}.blade: {turbine.name} has {n_blades} blades, found {blade}")
    if flap is not None and flap > n_flaps:
        has = f"{n_flaps} on each blade" if n_flaps else "none"
        raise InputError(
            f"{where}.flap: there is no flap {flap}; {turbine.name} has {has} (meltemi.turbine.with_flaps adds them)"
        )
    sensor = getattr(event, "sensor", None)
    if sensor is not None and sensor not in _sensors(n_blades, n_flaps):
        raise InputError(
            f"{where}.sensor: {turbine.name} has no {sensor!r}; {did_you_mean(sensor, _sensors(n_blades, n_flaps))}"
        )


def _sensors(n_blades: int, n_flaps: int) -> list[str]:
    """Sensors of a turbine: those of blades and flaps have their numbers at their end."""
    found = []
    for name in f.SENSORS:
        *_, before, last = ("", *name.split("_"))
        there = not last.isdigit() or int(last) <= n_blades
        if before.isdigit():
            there = there and int(before) <= n_flaps
        if there:
            found.append(name)
    return found
