"""``simulate``: march a model in a wind, under control, for a duration."""

from __future__ import annotations

import hashlib
import math
import platform
import time as clock_time
import weakref
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict
from datetime import UTC, datetime
from functools import cache
from importlib import import_module
from importlib.metadata import PackageNotFoundError, version
from types import FrameType
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import NDArray

from meltemi.compiler import KernelRecord, Kind, View, compile_seconds, processor, versions
from meltemi.control import constant
from meltemi.control.controller import Controller, LogEntry
from meltemi.control.entry import CALLED_BACK
from meltemi.control.faults import apply_events
from meltemi.control.signals import Demands, Measurements
from meltemi.core.calls import arguments_of
from meltemi.core.errors import InputError, Status
from meltemi.core.interrupts import on_interrupt
from meltemi.core.log import LOG
from meltemi.simulation import stages, step
from meltemi.simulation.case import Case
from meltemi.simulation.plan import planned
from meltemi.simulation.result import Finding, Result
from meltemi.simulation.run import Run
from meltemi.simulation.validity import notices, violations

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
        if frame is None or frame.f_globals.get("__name__") != CALLED_BACK:
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
    def record(self) -> KernelRecord:
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

    ``advance`` marches under the controller of the run. For co-simulation and reinforcement learning, create the
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
        around = stages.surroundings(run, plan)
        case = stages.bound(run, plan, around, numbers)
        if case.controller.close is not None:
            weakref.finalize(self, case.controller.close)  # for a run that is never finished
        if prepare is not None:
            prepare(case)
        at_start = stages.started(plan, around, case, starting)
        self.held_steps, self.sink = held_steps or plan.n_steps, None
        self.loop = stages.compiled(plan, at_start, self.held_steps, numbers)
        self.moving, self._begin = at_start.moving, at_start.begin
        self.model, self.wind, self.case, self.controller = plan.model, around.wind, case, case.controller
        self.controller_hash = hashlib.sha256(case.controller_state.data).hexdigest()[:16]
        numbers_of_start = ("rotor_speed", "pitch", "generator_torque")
        self.start = {"kind": type(around.start).__name__} | {
            name: float(getattr(around.start, name)) for name in numbers_of_start
        }
        self.dt, self.n_steps, self.duration, self.transient = plan.dt, plan.n_steps, run.duration, run.transient
        self.output_step, self.interrupted = plan.every_output * plan.dt, False
        self.channels, self.derived, self.recorder = plan.channels, plan.derived, plan.recorder
        self.grid, self.sea, self.stations = run.grid, run.sea, plan.stations
        self.events, self._noticed, self._planned = plan.events.given, around.noticed, around.log
        self._acted: list[tuple[int, LogEntry]] = []
        self.compile_seconds = compile_seconds() - compiled
        self.prepare_seconds = clock_time.perf_counter() - began - self.compile_seconds
        self.run_seconds = 0.0

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
            first = int(self.case.clock.row)
            self.loop.march(min(left - done, self.held_steps))
            if self.derived:
                self.derive(self.loop.output[first : int(self.case.clock.row)])
            if self.sink is not None:
                self.sink()
        self.run_seconds += clock_time.perf_counter() - began
        if isinstance(self.case.entry.exception, KeyboardInterrupt):  # raised while a Python controller was running
            self.interrupted = True
        if self.finished:
            self.close()

    def derivations(self) -> Iterator[tuple[list[int], slice, Any]]:
        """Columns of channels that follow from others, columns of those, and how."""
        place, begin = {channel: i for i, channel in enumerate(self.channels)}, len(self.channels)
        for each in self.derived:
            yield [place[channel] for channel in each.channels], slice(begin, begin := begin + len(each.sources)), each

    def derive(self, samples: NDArray[np.float64]) -> None:
        """Compute the channels of samples (T, columns) that follow from others."""
        for columns, sources, each in self.derivations():
            samples[:, columns] = each.product(samples[:, sources])

    def stream(self, samples: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """March a run without end, piece by piece, in the memory of its output.

        Args:
          samples: number of samples of the output, fewer than the run's duration has.

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
        from meltemi.simulation.events import act

        self._acted.append(act(event, self.case, self.time, ended=ended))

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
          demands: demands by name (``"pitch"`` is for all blades; those omitted keep their values), or all of
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
        warnings = [*self._noticed]
        if self.controller.warnings is not None:
            warnings += controller_warnings(self.controller, self.case.controller_state)
        if (state := int(self.case.view("demands")["operating_state"])) and self.events:
            from meltemi.simulation.events import misplaced_events

            states = import_module("meltemi.supervisor.tables").STATES

            happened = [event for event in self.events if event.at < self.time]
            warnings += misplaced_events(happened, self.log(), states[state - 1].name.replace("_", " "))
        return warnings + [str(Finding(**each)) for each in notices(self.case["watch"])]

    @property
    def message(self) -> str:
        """Why the run has ended early or is doubtful; empty if neither."""
        messages = [str(Finding(**each)) for each in violations(self.case["watch"])]
        if not (status := self.status).complete:
            from meltemi.simulation.failure import explain

            messages = [explain(self.case, status, self.time, self.dt), *messages]
        return "; ".join(messages)

    def result(self) -> Result:
        """Result up to now."""
        rows = int(self.case.clock.row)
        output = self.loop.output[:rows]
        data = output[:, : len(self.channels)].copy()
        scene = output[:, len(self.channels) + sum(len(each.sources) for each in self.derived) :]
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
            scene=self.recorder.scene(scene, time, self.wind) if self.recorder else None,
        )


@cache
def _demand_rows(name: str) -> int | slice:
    return View(Demands, Demands.zeros()).rows(name)


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
        "stations": {part: list(places) for part, places in asdict(run.stations).items()},
        "python": platform.python_version(),
        "numba": versions()["numba"],
        "numpy": np.__version__,
        "machine": f"{platform.system()} {platform.machine()}",
        "processor": processor(),
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
    }
