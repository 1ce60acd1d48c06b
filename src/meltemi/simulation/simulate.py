"""``simulate``: march a model in a wind, under control, for a duration."""

from __future__ import annotations

import hashlib
import math
import platform
import time as clock_time
import weakref
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from datetime import UTC, datetime
from functools import cache
from importlib import import_module
from importlib.metadata import PackageNotFoundError, version
from types import FrameType
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import NDArray

from meltemi.compiler import N_DERIVATIVES, Kind, Record, View, compile_seconds, processor, versions
from meltemi.control import constant
from meltemi.control.controller import Controller, Entry, LogEntry
from meltemi.control.faults import Faults, apply_events
from meltemi.control.signals import Demands, Measurements
from meltemi.core.calls import arguments_of
from meltemi.core.errors import InputError, MeltemiError, Status
from meltemi.core.interrupts import on_interrupt
from meltemi.core.log import LOG
from meltemi.simulation import step
from meltemi.simulation.case import LEAST_BRAKE_SPEED, Case
from meltemi.simulation.loop import Loop, loop_of
from meltemi.simulation.plan import Plan, controller_of, first_point, planned, wind_of
from meltemi.simulation.points import initial_state
from meltemi.simulation.result import Finding, Result
from meltemi.simulation.rotors import kind_of
from meltemi.simulation.run import Run
from meltemi.simulation.start import Start, begin
from meltemi.simulation.unsteady import wind_log
from meltemi.simulation.validity import notices, violations
from meltemi.wind.fields import Wind

if TYPE_CHECKING:
    from meltemi.simulation.events import BaseEvent

CHUNK_SECONDS = 0.1
"""[s] wall time between checks of progress and keyboard."""


@arguments_of(Run)
def simulate(run: Run) -> Result:
    """Simulate a model in a wind; the arguments are the fields of :class:`Run`.

    The run starts in the steady operating point for the wind (``start`` replaces it); a turbulent wind differs from it
    from the first instant, so the first seconds of the motion, and tens of seconds of the wake, are an initial
    transient.

    Returns:
      The result; beyond the model's range of validity its status is ``DOUBTFUL``.

    Raises:
      InputError: an argument is not valid, or the wind does not cover the run.
      RunError: the run diverged, its controller failed, or Ctrl-C ended it; ``error.result`` has the series up to then.
        With ``partial`` it is returned instead.
    """
    simulation = Simulation(run)
    march(simulation, run.progress)
    result = simulation.result()
    LOG.info("%r", result)
    for words in filter(None, [result.message, *result.warnings]):
        LOG.warning("%s: %s", result.meta.get("turbine", ""), words)
    return result if run.partial or result.status.complete else result.raise_for_status()


def march(
    run: Simulation, progress: Callable[[float], None] | None = None, stop: Callable[[], bool] | None = None
) -> None:
    """March a run to its end, in chunks of about 0.1 s of wall time, or until Ctrl-C or ``stop`` ends it."""

    def heard(frame: FrameType | None) -> None:
        run.interrupted = True
        # an exception in a controller that compiled code calls would be lost: the chunk is completed
        if frame is None or frame.f_globals.get("__name__") != Entry.__module__:
            raise KeyboardInterrupt

    chunk = 100
    try:
        with on_interrupt(heard):
            while not run.finished:
                began = clock_time.perf_counter()
                run.advance(chunk)
                spent = clock_time.perf_counter() - began
                chunk = int(np.clip(chunk * CHUNK_SECONDS / max(spent, 1e-4), 10, 4 * chunk))
                if progress is not None:
                    progress(run.share)
                if stop is not None and stop() and not run.finished:
                    run.interrupted = True
    except KeyboardInterrupt:
        run.interrupted = True
    finally:
        run.close()


class Sink(Protocol):
    """Takes the samples that a run holds and sets ``clock.row`` to zero."""

    @property
    def record(self) -> Record:
        """Everything that this needs."""

    def __call__(self) -> None: ...


class Simulation:
    """A run in progress: :func:`simulate` in steps of the caller's choice.

    Args:
      run: the arguments of ``simulate``.
      numbers: number type of the computation, see ``Case``.
      prepare: callback with the case before its start is set.
      starting: callback with the case after its start was set, before the evaluations with which a run begins, and
        whether inflow and stall are settled by them.
      held_steps: time steps of which the output is held, for a run with a ``sink``; by default all.

    ``advance`` marches under the run's own controller. For co-simulation and reinforcement learning, create the
    simulation with ``controller=meltemi.control.ConstantController(sample_time)``, call ``reset``, then ``step`` with
    demands.

    Raises:
      InputError: an argument of the run is not valid, or the wind does not cover the run.
    """

    sink: Sink | None

    def __init__(
        self,
        run: Run,
        *,
        numbers: Kind = "lanes",
        prepare: Callable[[Case], None] | None = None,
        starting: Callable[[Case, bool], None] | None = None,
        held_steps: int | None = None,
    ) -> None:
        plan = planned(run)
        began, compiled = clock_time.perf_counter(), compile_seconds()
        wind, self._noticed = wind_of(run, plan)
        controller, every_control = controller_of(run, plan, wind)
        try:
            start, words = initial_state(plan.model, wind, run.start() if callable(run.start) else run.start)
        except InputError as error:  # what is implausible may be why
            raise InputError("; note: ".join([str(error), *self._noticed])) from None
        self._noticed += words
        self.events, self._acted = plan.events.given, list[tuple[int, LogEntry]]()
        self._planned = (*plan.events.log, *wind_log(wind, run.duration, plan.dt))
        case = _prepared(run, plan, wind, numbers)
        entry = case.bind(controller, first_point(plan.model, wind, start))
        if case.controller.close is not None:
            weakref.finalize(self, case.controller.close)  # for a run that is never finished
        if prepare is not None:
            prepare(case)
        unsettled = isinstance(start, Start)
        start.set(case) if isinstance(start, Start) else start.put(case)
        if starting is not None:
            starting(case, unsettled)
        if unsettled:
            case.settle(0.0)
        case.begin_parts(plan.dt)
        begin(case)
        clock, settings = case.clock, case.settings
        clock.every_output, clock.every_control, settings.time_step = plan.every_output, every_control, plan.dt
        # an instant stands for half a step before and after it: what is held between calls and jumps there would lead
        settings.held_share = 0.0 if controller.sample_time is None else 0.5
        self.model, self.wind, self.case, self.controller = plan.model, wind, case, case.controller
        self.controller_hash = hashlib.sha256(case.controller_state.data).hexdigest()[:16]
        self.start = {
            "kind": type(start).__name__,
            "rotor_speed": float(start.rotor_speed),
            "pitch": float(start.pitch),
            "generator_torque": float(start.generator_torque),
        }
        self.dt, self.n_steps, self.duration, self.transient = plan.dt, plan.n_steps, run.duration, run.transient
        self.channels, self.recorder, self.grid, self.sea = plan.channels, plan.recorder, run.grid, run.sea
        self.interrupted = False
        self.output_step = plan.every_output * plan.dt
        self.held_steps, self.sink = held_steps or plan.n_steps, None
        self.loop = self._compiled(entry, plan, numbers)
        self.moving = (
            case.signals.vector,
            case.aero_state.vector,
            case.measured,
            case.v_old,
            case.a_old,
            case.clock.array,
            case.controller_state,
            case["faults"],
            case["watch"],
            case["weights"],
        )
        self._begin = tuple(array.copy() for array in self.moving)
        self.compile_seconds = compile_seconds() - compiled
        self.prepare_seconds = clock_time.perf_counter() - began - self.compile_seconds
        self.run_seconds = 0.0

    def _compiled(self, entry: Entry, plan: Plan, numbers: Kind) -> Loop:
        """The time loop of the run, with room for what it holds of its output."""
        case = self.case
        places = np.array([case.place(channel) for channel in plan.channels], dtype=np.int64)
        if plan.recorder:
            places = np.concatenate([places, plan.recorder.places(case)])
        samples = (plan.n_steps - 1) // plan.every_output + 1
        output = np.full((min(samples, (self.held_steps - 1) // plan.every_output + 1), len(places)), np.nan)
        if numbers == "duals":
            case.slopes["output"] = np.zeros((*output.shape, N_DERIVATIVES))
        records = (case.run(places, output), case.control, case.system, case.one, case.plain, case.sections)
        return loop_of(entry.function, records, output)

    @property
    def time(self) -> float:
        """[s] simulated time."""
        return float(self.case.clock.step) * self.dt

    @property
    def share(self) -> float:
        """Completed fraction of the run."""
        return float(self.case.clock.step) / self.n_steps

    @property
    def status(self) -> Status:
        """Present status of the run."""
        if self.interrupted:
            return Status.INTERRUPTED
        status = Status(int(self.case.clock.status))
        return Status.DOUBTFUL if status is Status.OK and violations(self.case["watch"]) else status

    @property
    def finished(self) -> bool:
        """True when the end is reached or the run has ended early."""
        stopped = self.interrupted or self.case.clock.status != step.OK
        return bool(stopped or self.case.clock.step >= self.n_steps)

    def advance(self, n_steps: int) -> None:
        """March ``n_steps`` time steps, at most to the end of the run."""
        began, left = clock_time.perf_counter(), min(n_steps, self.n_steps - int(self.case.clock.step))
        for done in range(0, left, self.held_steps):
            self.loop.march(min(left - done, self.held_steps))
            if self.sink is not None:
                self.sink()
        self.run_seconds += clock_time.perf_counter() - began
        if isinstance(self.case.entry.exception, KeyboardInterrupt):  # raised while a Python controller was running
            self.interrupted = True
        if self.finished:
            self.close()

    def stream(self, samples: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """March a run without end, piece by piece, in the memory of its output.

        Args:
          samples: of the output, fewer than the run's duration has.

        Returns:
          (n,) times [s] and (n, columns) samples, which the next call overwrites; fewer if the run has ended.
        """
        clock = self.case.clock
        every, first = int(clock.every_output), int(clock.step)
        if not 0 < samples < len(self.loop.output):
            raise InputError(f"stream: expected 1 to {len(self.loop.output) - 1} samples, found {samples}")
        clock.row, self.n_steps = 0, first + samples * every + 1  # the end moves on: it is never reached
        self.advance(samples * every)
        rows = int(clock.row)
        time = self.output_step * (-(-first // every) + np.arange(rows, dtype=np.float64))
        return time, self.loop.output[:rows]

    def act(self, event: BaseEvent, *, ended: bool = False) -> None:
        """Let an event happen now, or end now, whatever its times.

        Raises:
          InputError: the turbine lacks what the event concerns, or events of the run are still to come.
        """
        from meltemi.simulation.events import check_parts

        check_parts(event, "event", self.model.turbine)
        clock, faults = self.case.clock, self.case["faults"]
        if clock.next_event < len(self.case.events):
            raise InputError(f"{event.what}: events of the run are still to come")
        for name, on, off in event.changes():
            faults[Faults.index(name)] = off if ended else on
        clock.next_event = max(int(clock.next_event), 1)  # from now on sensors report faults and requests
        entry = LogEntry(self.time, "event", f"{event.what}: over" if ended else event.what)
        self._acted.append((int(clock.step), entry))

    def close(self) -> None:
        """Release what the controller holds besides its state; a run that has ended has done so."""
        if self.case.controller.close is not None:
            self.case.controller.close()

    def reset(self) -> View:
        """Return to the start, in the same arrays; returns the measurements there."""
        for array, values in zip(self.moving, self._begin, strict=True):
            array[...] = values
        self.case.entry.exception = None
        self.interrupted = False
        self._acted.clear()
        self.run_seconds = 0.0
        return self._measure()

    def step(self, demands: Mapping[str, float] | Sequence[float] | None = None) -> View:
        """March to the next sample instant of the controller under the given demands.

        Args:
          demands: by name (``"pitch"`` is for all blades; those omitted keep their values), or all of
            ``control.signals.Demands`` as a vector, in SI units; needs ``control.ConstantController()``.

        Returns:
          Measurements at that instant, a copy: ``measurements["generator_speed"]``, or all as ``measurements.array``.
          A demand beyond its limits, or a motion that diverges, ends the run: check ``finished`` and ``status``.

        Raises:
          InputError: the run has ended, a name is unknown, or another controller sets the demands.
        """
        clock = self.case.clock
        if self.finished:
            raise InputError(f"step: the run has ended ({self.status.name}); reset() restarts it")
        if demands is not None:
            self._demand(demands)
        clock.want_loads, every = 1, int(clock.every_control)
        self.advance(every - int(clock.step) % every)
        return self._measure()

    def _demand(self, demands: Mapping[str, float] | Sequence[float]) -> None:
        if self.controller.update is not constant.update():
            raise InputError(
                f"step: the controller {self.controller.name!r} sets the demands; "
                "to pass them to step, create the Simulation with controller=meltemi.control.ConstantController()"
            )
        now = self.case["demands"]
        if isinstance(demands, Mapping):
            for name, value in demands.items():
                rows = _demand_rows(name)
                try:
                    now[rows] = value
                except (TypeError, ValueError):
                    n = now[rows].size
                    raise InputError(f"step: {name}: expected {n} number{'s' * (n > 1)}, found {value!r}") from None
            return
        try:
            given = np.asarray(demands)
        except ValueError:  # sequences of several lengths
            given = np.zeros(0)
        if given.shape != now.shape or given.dtype.kind not in "fiu":
            raise InputError(f"step: expected {len(now)} demands ({', '.join(Demands.names)}), found {demands!r:.80}")
        now[:] = given

    def _measure(self) -> View:
        case, clock = self.case, self.case.clock
        clock.next_event = apply_events(int(clock.step), int(clock.next_event), case.events, case.control.faults)
        t = int(clock.step) * self.dt
        step.surroundings(t, case.control, case.system)
        step.sense(t, int(clock.next_event), case.control, case.system)
        return View(Measurements, case.measured.copy())  # a copy, so that later steps do not change it

    def motion(self) -> tuple[Any, Any]:
        """Coordinates and velocities at the last evaluated instant."""
        case, h = self.case, self.dt
        position, lag, expected = case["weights"]
        change = expected - case.a_old
        return case["q"] - h * (case.v_old + 0.5 * h * case.a_old) - position * change, case.v_old - lag * change

    def log(self) -> list[LogEntry]:
        """Entries up to now in order of time; an event precedes the reactions of a controller to it."""
        entries = [entry for at, entry in (*self._planned, *self._acted) if at < self.case.clock.step]
        entries += self._of_parts()
        if self.controller.log is not None:
            entries += self.controller.log(self.case.controller_state)
        return sorted(entries, key=lambda entry: entry.time)

    def _of_parts(self) -> list[LogEntry]:
        return [entry for part in self.case.parts for entry in part.log(self.case, self.time)]

    def warnings(self) -> list[str]:
        """Warnings up to now, which do not affect the status."""
        found = [*self._noticed]
        if self.controller.warnings is not None:
            found += controller_warnings(self.controller, self.case.controller_state)
        if (state := int(self.case.view("demands")["operating_state"])) and self.events:
            from meltemi.simulation.events import misplaced_events

            states = import_module("meltemi.supervisor.tables").STATES

            happened = [event for event in self.events if event.at < self.time]
            found += misplaced_events(happened, self.log(), states[state - 1].name.replace("_", " "))
        return found + [str(Finding(**each)) for each in notices(self.case["watch"])]

    @property
    def message(self) -> str:
        """Why the run has ended early or is doubtful; empty if neither."""
        findings = (str(Finding(**each)) for each in violations(self.case["watch"]))
        return "; ".join(filter(None, [explain(self.case, self.status, self.time, self.dt), *findings]))

    def result(self) -> Result:
        """Result up to now."""
        rows = int(self.case.clock.row)
        output = self.loop.output[:rows]
        data = output[:, : len(self.channels)].copy()
        time = np.arange(rows, dtype=float) * self.output_step
        for j, channel in enumerate(self.channels):
            if channel.wrap:
                data[:, j] %= 2.0 * math.pi
        meta = describe(self)
        for name in ("compile_seconds", "prepare_seconds", "run_seconds"):
            meta[name] = round(getattr(self, name), 4)
        meta["real_time_factor"] = round(self.time / max(self.run_seconds, 1e-9), 1)
        if warnings := self.warnings():
            meta["warnings"] = warnings
        if self.controller.log is not None or self._planned or self._acted or self._of_parts():
            meta["log"] = [asdict(entry) for entry in self.log()]
        if findings := violations(self.case["watch"]):
            meta["findings"] = findings
        return Result(
            time=time,
            data=data,
            channels=self.channels,
            status=self.status,
            message=self.message,
            meta=meta,
            scene=self.recorder.scene(output[:, data.shape[1] :], time, self.wind) if self.recorder else None,
        )


def _prepared(run: Run, plan: Plan, wind: Wind, numbers: Kind) -> Case:
    """The case of a run, with what depends on its time step."""
    model, turbine, kind = plan.model, plan.model.turbine, kind_of(plan.model)
    case = Case(model, wind, plan.stations, numbers=numbers, grid=run.grid, parts=plan.parts, origin=run.origin)
    if plan.events.rows is not None:
        case.events = plan.events.rows
    case["weights"][:2] = kind.step_weights(model, plan.dt)
    # dry friction acts over a speed that a step of full braking cannot cross: as a damper on the generator
    # it has h c / J = 0.4, below the bound of 0.5 with a margin for the shaft (docs/theory/simulation.md, M-7)
    brake_step = turbine.drivetrain.brake_torque * plan.dt / kind.brake_inertia(turbine)
    case.view("drive")["brake_speed"] = max(LEAST_BRAKE_SPEED, 2.5 * brake_step)
    return case


@cache
def _demand_rows(name: str) -> int | slice:
    return View(Demands, Demands.zeros()).rows(name)


def explain(case: Case, status: Status, t: float, dt: float) -> str:
    """Reason for the end of a run, with time, state and a hint."""
    if status.complete:
        return ""
    name = case.controller.name
    if status is Status.DIVERGED:
        if reasons := [why for part in case.parts if (why := part.why(case))]:
            return f"at t = {t:.3f} s {reasons[0]}"
        # once one coordinate is NaN all are, within a step: the last velocities show which diverged first
        last = np.where(np.isfinite(case["v"]), case["v"], case.v_old)
        size = np.nan_to_num(np.abs(case["q"]), posinf=np.inf) + np.abs(last)
        worst = int(np.argmax(np.where(np.isfinite(size), size, np.inf)))
        return (
            f"at t = {t:.3f} s {status.message} "
            f"(worst: {case.model.coordinates[worst]!r}, q = {case['q'][worst]:.3g}, dq/dt = {case['v'][worst]:.3g}; "
            f"time step {dt:g} s)"
        )
    if status is Status.CONTROLLER_RAISED:
        error = case.entry.exception
        if isinstance(error, MeltemiError):
            return f"at t = {t:.3f} s the controller {name!r} failed: {error}"
        what = f"{type(error).__name__}: {error}" if error is not None else "an exception in compiled code"
        return f"at t = {t:.3f} s the controller {name!r} raised {what}"
    if status is Status.CONTROLLER_DEMAND:
        demands = case.view("demands")
        bad = [
            f"{n} = {demands.array[i]:g} (limit {case.limits[i]:g})"
            for i, n in enumerate(demands.table.names)
            if not abs(demands.array[i]) <= case.limits[i]
        ]
        return f"at t = {t:.3f} s the controller {name!r} returned {', '.join(bad)}"
    return f"at t = {t:.3f} s: {status.message}"


def controller_warnings(controller: Controller, state: Any) -> list[str]:
    """Warnings of a controller about a run; an exception in it does not lose the result."""
    try:
        return [str(line) for line in controller.warnings(state)] if controller.warnings is not None else []
    except Exception as error:
        return [f"warnings of the controller {controller.name!r} raised {type(error).__name__}: {error}"]


@cache
def _package() -> str:
    """Version of the installed package."""
    try:
        return version("meltemi")
    except PackageNotFoundError:
        return "unknown"


def describe(run: Simulation) -> dict[str, Any]:
    """Data to repeat a run."""
    model, wind = run.model, run.wind
    return {
        "meltemi": _package(),
        "turbine": model.turbine.name,
        "turbine_hash": model.turbine.content_hash(),
        "model_hash": model.content_hash(),
        "options": model.options.model_dump(mode="json"),
        "environment": model.environment.model_dump(mode="json"),
        "grid": None if run.grid is None else run.grid.model_dump(mode="json"),
        "wind": wind.label,
        "wind_hash": wind.content_hash(),
        "sea": getattr(run.sea, "content", dict)() or None,
        "waves": getattr(run.sea, "label", None),
        "lines": getattr(getattr(model.turbine, "platform", None), "line_words", None),
        "controller": run.controller.name,
        "controller_state_hash": run.controller_hash,
        "start": run.start,
        "time_step": run.dt,
        "duration": run.duration,
        "output_step": run.output_step,
        "transient": run.transient,
        "events": [event.model_dump(mode="json", exclude_none=True) for event in run.events],
        "channels": [channel.name for channel in run.channels],
        "python": platform.python_version(),
        "numba": versions()["numba"],
        "numpy": np.__version__,
        "machine": f"{platform.system()} {platform.machine()}",
        "processor": processor(),
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
    }
