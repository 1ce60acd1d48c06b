"""Interface of controllers: compiled ones and callbacks in plain Python.

A controller has a state vector from ``init`` and an ``update`` that is called every
``sample_time`` seconds. ``update`` may be a plain Python function or one compiled by Numba
(``@numba.njit``); either reads and writes by name: ``measurements.generator_speed``, ``demands.pitch[b]``.
Compiled ones enter the time loop through one function type, so the loop is never compiled again for
another controller; plain ones are called back on the same vectors.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meltemi.compiler import (
    CompilationError,
    EntryType,
    is_cached,
    is_compiled,
    is_compiled_for,
    is_ours,
    kernel_for,
    last_line,
    njit,
    types,
)
from meltemi.control.signals import Demands, Measurements
from meltemi.core.errors import InputError

Vector = NDArray[np.float64]
Update = Callable[[Any, Any, Any, float], None]

_V = types.float64[::1]
UPDATE = types.void(_V, _V, _V, types.float64)
"""Signature of ``update(state, measurements, demands, dt)``."""
ENTRY = EntryType(UPDATE)
"""The type through which every controller enters the time loop."""
PRODUCING = ("connection", "maximum_power", "speed_limit", "power_limit")
"""States of a supervisor in which the generator is connected."""


@dataclass(frozen=True)
class StartPoint:
    """Steady operating point from which a controller starts without a jump of its demands.

    Attributes:
      wind_speed: [m/s] wind speed at hub height.
      generator_speed: [rad/s] generator speed.
      pitch: [rad] collective pitch.
      generator_torque: [N m] generator torque.
      mean_wind: [m/s] mean at hub height before; ``wind_speed`` by default.
    """

    wind_speed: float
    generator_speed: float
    pitch: float
    generator_torque: float
    mean_wind: float | None = None


@dataclass(frozen=True)
class LogEntry:
    """Entry of the log of a run.

    Attributes:
      time: [s] time of the entry.
      source: "supervisor", "yaw protection" or "event".
      what: e.g. ``"power limit -> normal stop"``.
      reason: reason, e.g. ``"wind above cut-out"``.
    """

    time: float
    source: str
    what: str
    reason: str = ""


@dataclass(frozen=True)
class Controller:
    """Controller of a simulation.

    Attributes:
      update: ``update(state, measurements, demands, dt)``, changes state, a vector, and demands in place; see
        ``Measurements`` and ``Demands`` of ``meltemi.control.signals`` for the names.
      init: returns the state vector for a start point; by default one zero.
      sample_time: [s] time between calls; None for every time step.
      name: name for messages.
      yaws: whether it demands a yaw rate; then the model needs a yaw drive.
      uses_loads: whether it reads loads, accelerations or wind; a run is a little faster when it does not.
      state_names: names of the entries of the state vector, for derivatives by them. In one of the name ``switches``
        update may sum what ``meltemi.compiler.crossed`` gives for the distance from each of its switches.
      warnings: called with the state at the end of a run; its lines go into the result's ``warnings``.
      log: called with the state at the end of a run; returns the log entries in order for the result's ``log``.
      fresh: returns the controller of one run, for controllers with resources beside the state vector, such as a
        process; then every run, also of a batch, has a separate one.
      close: called once or more after the end of a run, regardless of its status.
    """

    update: Update
    init: Callable[[StartPoint], Any] = lambda start: np.zeros(1)
    sample_time: float | None = None
    name: str = ""
    uses_loads: bool = True
    yaws: bool = False
    state_names: tuple[str, ...] = ()
    warnings: Callable[[Vector], Sequence[str]] | None = None
    log: Callable[[Vector], Sequence[LogEntry]] | None = None
    fresh: Callable[[], Controller] | None = None
    close: Callable[[], None] | None = None

    def __post_init__(self) -> None:
        if not callable(self.update):
            raise InputError(f"controller: update must be a function, found {type(self.update).__name__}")
        number = isinstance(self.sample_time, int | float)
        if self.sample_time is not None and not (number and 0.0 < self.sample_time < 1e9):
            raise InputError(f"controller: sample_time must be positive, and a time, found {self.sample_time!r}")
        if not self.name:
            object.__setattr__(self, "name", getattr(self.update, "__name__", type(self.update).__name__))

    def initial_state(self, start: StartPoint) -> Vector:
        """The controller's state vector, checked."""
        try:
            state = np.atleast_1d(np.array(self.init(start))).astype(np.float64, casting="same_kind")
        except (TypeError, ValueError, OverflowError):
            state = np.array([np.nan])
        if state.ndim != 1 or not np.all(np.isfinite(state)):
            raise InputError(f"controller {self.name!r}: init must give a vector of finite numbers")
        if self.state_names and len(self.state_names) != len(state):
            raise InputError(
                f"controller {self.name!r}: {len(self.state_names)} state_names for a state of {len(state)} entries"
            )
        return state


_ENTRIES: dict[Any, Any] = {}


def of_vectors(update: Any, *, cached: bool = False) -> Update:
    """Function of vectors, not compiled, of a compiled update: user-defined ones get tables in their place."""
    if is_ours(update.__module__):
        return update.py_func
    inner = njit(cache=cached)(update.py_func)

    def entry(state: Vector, measurements: Vector, demands: Vector, dt: float) -> None:
        inner(state, Measurements(measurements), Demands(demands), dt)

    return entry


def update_with_derivatives(controller: Controller) -> Any:
    """The update of a controller, as derivatives need it.

    Raises:
      InputError: it is plain Python.
    """
    if not is_compiled(controller.update):
        raise InputError(
            f"controller {controller.name!r} has no derivatives: it is plain Python; decorate its update by numba.njit"
        )
    return controller.update


def compiled_for(update: Any, signature: Any, *, cached: bool = True) -> Any:
    """Update compiled for the signature of an entry."""
    make = kernel_for(signature) if is_ours(update.__module__) else njit(signature)
    return make(of_vectors(update, cached=cached))


def compiled_entry(update: Any) -> Any:
    """``update`` compiled for the entry's signature; functions with exactly that signature pass through."""
    if is_compiled_for(update, UPDATE):
        return update
    if update not in _ENTRIES:
        try:
            _ENTRIES[update] = compiled_for(update, UPDATE, cached=is_cached(update))  # as its author asked
        except (CompilationError, TypeError) as error:
            raise InputError(
                f"controller {update.__name__!r} cannot be compiled for (state, measurements, demands, dt): "
                f"{last_line(error)}"
            ) from None
    return _ENTRIES[update]
