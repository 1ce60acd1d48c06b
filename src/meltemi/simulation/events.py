"""Events of a run as data: faults of the turbine and the grid, requests of the operator.

Each has a start time ``at``, and those that can end an end time ``until``. :func:`schedule` converts them to the table
that the time loop reads (``control/faults.py``). Over-speed and the like are not events: they are consequences of
events, which a controller has to detect.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from operator import itemgetter
from typing import TYPE_CHECKING, Annotated, Any, Literal, Self, get_args

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, Field, model_validator

from meltemi.compiler import MAX_BLADES, MAX_FLAPS, MAX_LINES
from meltemi.control import faults as f
from meltemi.control.controller import PRODUCING, LogEntry
from meltemi.control.signals import REQUESTS
from meltemi.core.errors import InputError, did_you_mean
from meltemi.core.record import Record
from meltemi.core.yamlfile import validated

if TYPE_CHECKING:
    from meltemi.simulation.case import Case
    from meltemi.turbine.power_turbine import AnyTurbine

NEVER = 1e18
"""Step number beyond the end of any run."""
Change = tuple[str, float, float]
"""Name in ``Faults``, value from ``at`` on, value after ``until``."""


def _sensor(name: str) -> str:
    if name not in f.SENSORS:
        raise ValueError(f"there is no sensor {name!r}; {did_you_mean(name, f.SENSORS)}")
    return name


BladeNumber = Annotated[int, Field(ge=1, le=MAX_BLADES)]
SensorName = Annotated[str, AfterValidator(_sensor)]


class BaseEvent(Record):
    """Common fields of all events."""

    at: float = Field(ge=0.0)
    """[s] start time."""

    @property
    def end(self) -> float:
        """[s] end time; infinite for a permanent event."""
        return math.inf

    @property
    def part(self) -> str:
        """Affected component: two events cannot act on the same component at the same time."""
        return self.what

    @property
    def what(self) -> str:
        """Description for logs and messages."""
        raise NotImplementedError

    def changes(self) -> tuple[Change, ...]:
        """Changes of ``Faults``."""
        raise NotImplementedError


class TemporaryEvent(BaseEvent):
    """An event with an optional end time."""

    until: float | None = None
    """[s] end time; permanent by default."""

    @property
    def end(self) -> float:
        return math.inf if self.until is None else self.until

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.end <= self.at:
            raise ValueError(f"until {self.until:g} s must be later than at {self.at:g} s")
        return self


class PitchStuck(TemporaryEvent):
    """Pitch actuator stuck: the blade keeps its pitch angle, whatever the demand."""

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


class PitchRunaway(TemporaryEvent):
    """Pitch runaway: the blade pitches to the end of its range, whatever the demand."""

    type: Literal["pitch_runaway"] = "pitch_runaway"
    blade: BladeNumber
    """Number of the blade."""
    rate: float = Field(ge=-1.0, le=1.0)
    """[rad/s] pitch rate, positive towards feather, negative towards fine pitch."""

    @model_validator(mode="after")
    def _moves(self) -> Self:
        if self.rate == 0.0:
            raise ValueError("rate must not be zero; use pitch_stuck for a blade that does not pitch")
        return self

    @property
    def part(self) -> str:
        return f"pitch of blade {self.blade}"

    @property
    def what(self) -> str:
        return f"{self.part} runs away towards {'feather' if self.rate > 0.0 else 'fine'}"

    def changes(self) -> tuple[Change, ...]:
        return ((f"pitch_run_{self.blade}", self.rate, 0.0),)


class FlapStuck(TemporaryEvent):
    """Flap stuck: the flap keeps its deflection, whatever the demand."""

    type: Literal["flap_stuck"] = "flap_stuck"
    blade: BladeNumber
    """Number of the blade."""
    flap: int = Field(default=1, ge=1, le=MAX_FLAPS)
    """Number of the flap on the blade."""

    @property
    def what(self) -> str:
        return f"flap {self.flap} of blade {self.blade} stuck"

    def changes(self) -> tuple[Change, ...]:
        return ((f"flap_stuck_{self.flap}_{self.blade}", 1.0, 0.0),)


class LineLoss(BaseEvent):
    """Loss of a mooring line: it parts at its fairlead; what is left of it is not simulated."""

    type: Literal["line_loss"] = "line_loss"
    line: int = Field(ge=1, le=MAX_LINES)
    """Number of the line."""

    @property
    def what(self) -> str:
        return f"mooring line {self.line} lost"

    def changes(self) -> tuple[Change, ...]:
        return ((f"line_lost_{self.line}", 1.0, 0.0),)


class GridLoss(TemporaryEvent):
    """Loss of the grid: no power export, no generator torque; controllers receive the state of the grid (``grid``)."""

    type: Literal["grid_loss"] = "grid_loss"

    @property
    def what(self) -> str:
        return "grid lost"

    def changes(self) -> tuple[Change, ...]:
        return (("grid", 0.0, 1.0),)


class VoltageDip(TemporaryEvent):
    """Grid voltage dip to a fraction of the nominal voltage; its effects need ``options.electrical: averaged``."""

    type: Literal["voltage_dip"] = "voltage_dip"
    voltage: float
    """Residual voltage over nominal voltage, 0 for a short circuit at the terminals."""

    @model_validator(mode="after")
    def _share(self) -> Self:
        if not 0.0 <= self.voltage <= 1.5:
            volts = "; it is relative to the nominal voltage, not in volts" if self.voltage > 1.5 else ""
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


class GeneratorFault(TemporaryEvent):
    """Generator fault: no torque, or too much; controllers notice it only by its effects."""

    type: Literal["generator_fault"] = "generator_fault"
    share: float = Field(default=0.0, ge=0.0, le=10.0)
    """Torque over the demanded one: 0 for none, 2 for an overload or a short circuit with twice the torque."""

    @property
    def part(self) -> str:
        return "torque of the generator"

    @property
    def what(self) -> str:
        return f"generator with {100.0 * self.share:g} % of its torque" if self.share else "generator without torque"

    def changes(self) -> tuple[Change, ...]:
        return (("generator", self.share, 1.0),)


class SensorOffset(TemporaryEvent):
    """Constant offset of a measurement."""

    type: Literal["sensor_offset"] = "sensor_offset"
    sensor: SensorName
    """Name of the measurement, with the number of its blade: generator_speed, pitch_2, out_of_plane_moment_1."""
    offset: float
    """Offset in the SI unit of the measurement."""

    @property
    def part(self) -> str:
        return f"offset of the sensor {self.sensor}"

    @property
    def what(self) -> str:
        return f"sensor {self.sensor} has an offset of {self.offset:g} {f.SENSOR_UNITS[self.sensor]}"

    def changes(self) -> tuple[Change, ...]:
        return ((f"offset_{self.sensor}", self.offset, 0.0),)


class SensorDrift(TemporaryEvent):
    """Drift of a measurement at a constant rate."""

    type: Literal["sensor_drift"] = "sensor_drift"
    sensor: SensorName
    """Name of the measurement, as for sensor_offset."""
    rate: float
    """Drift rate per second in the SI unit of the measurement."""

    @property
    def part(self) -> str:
        return f"drift of the sensor {self.sensor}"

    @property
    def what(self) -> str:
        return f"sensor {self.sensor} drifts by {self.rate:g} {f.SENSOR_UNITS[self.sensor]} per second"

    def changes(self) -> tuple[Change, ...]:
        return ((f"drift_begin_{self.sensor}", self.at, 0.0), (f"drift_{self.sensor}", self.rate, 0.0))


class SensorLoss(TemporaryEvent):
    """Loss of a measurement: it is frozen, or zero."""

    type: Literal["sensor_loss"] = "sensor_loss"
    sensor: SensorName
    """Name of the measurement, as for sensor_offset."""
    holds: Literal["last", "zero"] = "last"
    """Value that the controller receives from then on: the last one, or zero."""

    @property
    def part(self) -> str:
        return f"loss of the sensor {self.sensor}"

    @property
    def what(self) -> str:
        return f"sensor {self.sensor} lost, gives {'its last value' if self.holds == 'last' else 'zero'}"

    def changes(self) -> tuple[Change, ...]:
        return ((f"lost_{self.sensor}", f.KEEP_NEXT if self.holds == "last" else f.ZERO, 0.0),)


class Request(BaseEvent):
    """Request of the operator, valid until the next one."""

    type: Literal["request"] = "request"
    request: Literal["none", "start", "normal_stop", "emergency_stop"]
    """Requested operation."""

    @property
    def part(self) -> str:
        return "request of the operator"

    @property
    def what(self) -> str:
        return f"request {self.request.replace('_', ' ')}"

    def changes(self) -> tuple[Change, ...]:
        return (("request", float(REQUESTS.index(self.request)), 0.0),)


class PowerLimit(TemporaryEvent):
    """Power limit of the operator; derating controllers follow it, the baseline controller does not."""

    type: Literal["power_limit"] = "power_limit"
    power: float = Field(ge=0.0)
    """[W] largest electrical power."""

    @property
    def part(self) -> str:
        return "power limit of the operator"

    @property
    def what(self) -> str:
        return f"power limit {self.power / 1e3:g} kW"

    def changes(self) -> tuple[Change, ...]:
        return (("power_limit", self.power, math.inf),)


class Brake(TemporaryEvent):
    """The brake is applied, whatever the demand."""

    type: Literal["brake"] = "brake"
    share: float = Field(default=1.0, gt=0.0, le=1.0)
    """Fraction of the full brake torque."""

    @property
    def what(self) -> str:
        return "brake applied"

    def changes(self) -> tuple[Change, ...]:
        return (("brake_applied", self.share, 0.0),)


class BrakeFault(TemporaryEvent):
    """Brake fault: no brake torque, whatever the demand."""

    type: Literal["brake_fault"] = "brake_fault"

    @property
    def what(self) -> str:
        return "brake without torque"

    def changes(self) -> tuple[Change, ...]:
        return (("brake", 0.0, 1.0),)


class YawStuck(TemporaryEvent):
    """The yaw drive is stuck, whatever the demand."""

    type: Literal["yaw_stuck"] = "yaw_stuck"

    @property
    def what(self) -> str:
        return "yaw drive stuck"

    def changes(self) -> tuple[Change, ...]:
        return (("yaw_drive", 0.0, 1.0),)


class YawRunaway(TemporaryEvent):
    """Yaw runaway: the yaw drive turns the nacelle, whatever the demand; without effect on a free bearing."""

    type: Literal["yaw_runaway"] = "yaw_runaway"
    rate: float = Field(ge=-0.2, le=0.2)
    """[rad/s] yaw rate, counter-clockwise seen from above; may exceed the limit of the drive."""

    @property
    def what(self) -> str:
        return "yaw drive runs away"

    def changes(self) -> tuple[Change, ...]:
        return (("yaw_run", self.rate, 0.0),)


RUNNING = tuple(name.replace("_", " ") for name in ("start_up", *PRODUCING))
AT_REST = ("standby", "idling")
"""States of the supervisor, as its log writes them."""

Event = Annotated[
    PitchStuck
    | PitchRunaway
    | FlapStuck
    | LineLoss
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
    | YawStuck
    | YawRunaway,
    Field(discriminator="type"),
]
"""Any event; ``type`` selects the class."""
KINDS: tuple[type[BaseEvent], ...] = get_args(get_args(Event)[0])
"""Classes of all events."""


class _Events(Record):
    events: tuple[Event, ...]


def read_events(events: Iterable[BaseEvent | Mapping[str, Any]]) -> tuple[BaseEvent, ...]:
    """Events from records, or from mappings of keys to values.

    Raises:
      InputError: a record is invalid; the message has its number and key.
    """
    plain = [event.content() if isinstance(event, BaseEvent) else event for event in events]
    return validated({"events": plain}, _Events, "run").events


def conflict(events: Sequence[BaseEvent]) -> str | None:
    """Description of the first two contradictory events; None if there are none."""
    order = sorted(range(len(events)), key=lambda i: (events[i].at, i))
    for place, i in enumerate(order):
        for j in order[place + 1 :]:
            one, two = events[i], events[j]
            if one.part != two.part or one.end <= two.at:
                continue
            follows = one.end == math.inf and isinstance(two, Request | PowerLimit) and two.at > one.at
            if not follows:
                until = "permanently" if one.end == math.inf else f"until {one.end:g} s"
                return (
                    f"events.{j} at {two.at:g} s and events.{i}, which acts from {one.at:g} s {until}, "
                    f"contradict each other ({one.part}); change their times, or leave one out"
                )
    return None


@dataclass(frozen=True)
class Schedule:
    """Events as the table that the time loop reads.

    Attributes:
      rows: (n, 3) step, index in ``Faults``, value; in order of time.
      log: entries in order of time, each with its step.
    """

    rows: NDArray[np.float64]
    log: tuple[tuple[int, LogEntry], ...]


def schedule(events: Sequence[BaseEvent], turbine: AnyTurbine, dt: float, n_steps: int) -> Schedule:
    """Steps at which events act: the first instant that is not before their time.

    Args:
      dt: [s] time step.
      n_steps: number of time steps of the run.

    Raises:
      InputError: an event is not before the end of the run, ends within its time step, concerns equipment that the
        turbine does not have, or contradicts another event.
    """
    if words := conflict(events):
        raise InputError(words)
    edges: list[tuple[int, bool, float, str, BaseEvent]] = []
    for i, event in enumerate(events):
        check_parts(event, f"events.{i}", turbine)
        begin = _step(event.at, dt)
        if begin >= n_steps - 1:
            raise InputError(
                f"events.{i}.at: {event.at:g} s is not before the end of the run at {(n_steps - 1) * dt:g} s; "
                "take an earlier time or a longer duration"
            )
        edges.append((begin, True, event.at, event.what, event))
        if event.end < math.inf:
            end = _step(event.end, dt)
            if end == begin:
                raise InputError(f"events.{i}.until: the event ends within its time step of {dt:g} s")
            edges.append((end, False, event.end, event.what, event))
    # at the same instant, events end before others begin
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


def misplaced_events(events: Iterable[BaseEvent], log: Iterable[LogEntry], state: str) -> list[str]:
    """Warnings about events that occurred in a state of the turbine in which they have no meaning.

    A stop needs a turbine in operation, a start one at rest; faults are meant for the state in which a run begins,
    unless an earlier event has ended it.

    Args:
      log: log of the run, with the supervisor's transitions.
      state: final state of the supervisor, as its log writes it.
    """
    moves: list[tuple[str, str, LogEntry]] = []
    for entry in log:
        if entry.source == "supervisor":
            source, target = entry.what.split(" -> ")
            moves.append((source, target, entry))
    first = moves[0][0] if moves else state
    left = next((entry for source, target, entry in moves if source in RUNNING and target not in RUNNING), None)
    warnings = []
    for i, event in enumerate(events):
        now = next((target for _, target, entry in reversed(moves) if entry.time < event.at - 1e-9), first)
        word = event.request if isinstance(event, Request) else ""
        alone = not any(other.at < event.at for other in events)
        stopped = alone and first in RUNNING and now not in RUNNING and not isinstance(event, PowerLimit)
        useless = (word.endswith("_stop") and now in AT_REST) or (word == "start" and now in RUNNING)
        if useless or (stopped and word != "start"):
            why = f", which stopped at {left.time:.2f} s ({left.reason})" if left and left.time < event.at else ""
            warnings.append(f"events.{i}: {event.what} at {event.at:g} s occurred in state {now!r}{why}")
    return warnings


def ignored(events: Iterable[BaseEvent]) -> list[str]:
    """Warnings about requests of the operator, which the baseline controller ignores."""
    return [
        f"events.{i}: {event.what} at {event.at:g} s has no effect: the baseline controller ignores operator requests; "
        "meltemi.control.SupervisedController follows them"
        for i, event in enumerate(events)
        if isinstance(event, Request | PowerLimit)
    ]


def check_dips(events: Sequence[BaseEvent]) -> None:
    """Raise InputError for a voltage dip in a run without an electrical system, where it has no effect."""
    for i, event in enumerate(events):
        if isinstance(event, VoltageDip):
            raise InputError(
                f"events.{i}: a voltage_dip has no effect without an electrical system; "
                "set options.electrical: averaged"
            )


def _step(t: float, dt: float) -> int:
    """First instant that is not before ``t``, except for rounding."""
    return math.ceil(min(t / dt, NEVER) - 1e-6)


def check_parts(event: BaseEvent, where: str, turbine: AnyTurbine) -> None:
    """Raise InputError for blades, flaps, mooring lines and sensors that the turbine does not have."""
    n_blades, n_flaps = turbine.n_blades, len(turbine.flaps)
    lines = len(getattr(getattr(turbine, "platform", None), "lines", ()))
    blade, flap = getattr(event, "blade", None), getattr(event, "flap", None)
    if isinstance(event, LineLoss) and event.line > lines:
        raise InputError(f"{where}.line: {turbine.name} has {lines} mooring lines, found {event.line}")
    if blade is not None and blade > n_blades:
        raise InputError(f"{where}.blade: {turbine.name} has {n_blades} blades, found {blade}")
    if flap is not None and flap > n_flaps:
        message = f"{where}.flap: there is no flap {flap}; {turbine.name} has {n_flaps or 'none'}"
        raise InputError(f"{message} (meltemi.turbine.with_flaps adds them)")
    sensor = getattr(event, "sensor", None)
    if sensor is not None and sensor not in (known := _sensors(n_blades, n_flaps)):
        raise InputError(f"{where}.sensor: {turbine.name} has no {sensor!r}; {did_you_mean(sensor, known)}")


def act(event: BaseEvent, case: Case, time: float, *, ended: bool) -> tuple[int, LogEntry]:
    """Let an event happen, or end, in a case at the present time [s]: its step, and the entry for the log.

    Raises:
      InputError: the turbine lacks what the event concerns, or events of the run are still to come.
    """
    check_parts(event, "event", case.model.turbine)
    clock, faults = case.clock, case["faults"]
    if clock.next_event < len(case.events):
        raise InputError(f"{event.what}: events of the run are still to come")
    for name, on, off in event.changes():
        faults[f.Faults.index(name)] = off if ended else on
    clock.next_event = max(int(clock.next_event), 1)  # from now on sensors report faults and requests
    return int(clock.step), LogEntry(time, "event", f"{event.what}: over" if ended else event.what)


def _sensors(n_blades: int, n_flaps: int) -> list[str]:
    """Sensors of a turbine; the names of blade and flap sensors end in their numbers."""

    def exists(name: str) -> bool:
        *_, flap, blade = ("", *name.split("_"))
        return not blade.isdigit() or (int(blade) <= n_blades and not (flap.isdigit() and int(flap) > n_flaps))

    return [name for name in f.SENSORS if exists(name)]
