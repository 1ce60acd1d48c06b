"""A run that has been checked: what it marches, in which steps, what it records, before any of its arrays exists."""

from __future__ import annotations

import fnmatch
import math
from collections.abc import Sequence
from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from meltemi.control.baseline import BaselineController
from meltemi.control.controller import Controller, LogEntry, StartPoint
from meltemi.core.errors import InputError
from meltemi.core.record import Record
from meltemi.core.usual import unusual_numbers
from meltemi.simulation.channels import DEFAULT, Channel
from meltemi.simulation.grid import check_grid
from meltemi.simulation.model import Model, Stations
from meltemi.simulation.operating_point import OperatingPoint
from meltemi.simulation.parts import Part, part_of_sea
from meltemi.simulation.rotors import default_step, kind_of
from meltemi.simulation.run import Run
from meltemi.simulation.start import Start
from meltemi.wind.fields import Wind, WindSeries, check_coverage, mean_before, mean_speed, unusual
from meltemi.wind.turbulent import realised

if TYPE_CHECKING:
    from meltemi.simulation.events import BaseEvent


MOST_STEPS, STEPS_A_SECOND = 200_000_000, 20_000
"""Largest number of time steps of a run, and steps that a usual machine computes in a second."""
MOST_OUTPUT = 16_000_000_000
"""[bytes] largest size of the samples of a run."""
SHORTEST_SHARE = 0.1
"""Of the default time step, to divide the intervals of a run."""
SCENE = "meltemi.scene.motion"
"""Module whose ``Recorder`` records what the view of a run needs."""


@dataclass(frozen=True)
class Events:
    """Events of a run: as given, as the table that the time loop reads, and as entries of the log with their steps."""

    given: tuple[BaseEvent, ...] = ()
    rows: NDArray[np.float64] | None = None
    log: tuple[tuple[int, LogEntry], ...] = ()


@dataclass(frozen=True)
class RunPlan:
    """A checked run.

    Attributes:
      model, stations, channels: the simulated model, and what is recorded.
      parts: parts of the run besides those of the model.
      derived: channels that follow from others.
      recorder: recorder of the scene for the view, ``meltemi.scene.motion.Recorder``; None without a view.
      events: events of the run.
      dt: [s] time step.
      n_steps, every_output: number of time steps, and of those between samples.
    """

    model: Model[Any]
    stations: Stations
    parts: tuple[Part, ...]
    channels: tuple[Channel, ...]
    derived: tuple[Any, ...]
    recorder: Any
    events: Events
    dt: float
    n_steps: int
    every_output: int


def planned(run: Run) -> RunPlan:
    """Check all that needs neither the wind nor the controller of a run.

    Raises:
      InputError: an argument is not valid.
    """
    duration, transient, grid = run.duration, run.transient, run.grid
    model = run.model() if callable(run.model) else run.model
    if not isinstance(model, Model):
        raise InputError(f"model: expected the model from build(turbine), found {type(model).__name__}")
    if not (math.isfinite(duration) and duration > 0.0):
        raise InputError(f"duration must be a positive number of seconds, found {duration!r}")
    if not 0.0 <= transient < duration:
        raise InputError(f"transient must be from 0 s to less than the duration, found {transient!r}")
    dt = step_of(run, model)
    if duration < (1.0 - 1e-9) * dt:
        raise InputError(f"duration {duration:g} s is less than the time step of {dt:g} s")
    n_steps = round(duration / dt) + 1
    if n_steps > MOST_STEPS:
        raise InputError(
            f"a run of {duration:g} s in steps of {dt:g} s has {n_steps:.2g} steps and takes some "
            f"{n_steps / STEPS_A_SECOND / 3600.0:.2g} h; up to {MOST_STEPS:.0e} are allowed: set a longer "
            "options.time_step, or split the run"
        )
    every_output = multiple(run.output_step, dt, "output_step")
    stations = run.stations or Stations()
    sea = part_of_sea(run.sea, model, run.duration, run.origin)
    parts = tuple(part for part in (sea, run.other_wind) if part is not None)
    chosen = choose(model, run.channels, stations, parts)
    derived = tuple(each for part in model.parts if (each := part.derived(chosen, parts)) is not None)
    recorder = None
    if run.view:
        recorder = import_module(SCENE).Recorder(model, stations)
        stations = recorder.stations
    size = 8 * len(chosen) * (n_steps // every_output + 1)
    if size > MOST_OUTPUT:
        raise InputError(
            f"{len(chosen)} channels every {run.output_step:g} s for {duration:g} s take {size / 1e9:.3g} GB, at "
            f"most {MOST_OUTPUT / 1e9:g} GB are allowed: record fewer channels, or set a longer output_step"
        )
    check_grid(grid, model.has_electrical, model.turbine.rated_power)
    events = _events(run, model, dt, n_steps)
    if run.controller is None and grid is not None and grid.power_reference is not None:
        raise InputError(
            "grid: power_reference is given, but the baseline controller does not follow it: "
            "give controller=meltemi.control.PowerController(turbine, meltemi.analysis.performance_of(turbine)) "
            "or a controller that follows it"
        )
    return RunPlan(model, stations, parts, tuple(chosen), derived, recorder, events, dt, n_steps, every_output)


def _events(run: Run, model: Model[Any], dt: float, n_steps: int) -> Events:
    given = tuple(run.events)
    if not given:
        return Events()
    from meltemi.simulation.events import check_dips, read_events, schedule

    events = read_events(given)
    table = schedule(events, model.turbine, dt, n_steps)
    if not model.has_electrical:
        check_dips(events)
    return Events(events, table.rows, table.log)


def wind_of(run: Run, plan: RunPlan) -> tuple[Wind, list[str]]:
    """The wind of a run as a field, and warnings about turbine, wind and events.

    Raises:
      InputError: the wind does not cover the run.
    """
    turbine, described = plan.model.turbine, run.wind() if callable(run.wind) else run.wind
    produces, yaw = not isinstance(run.start, Start), plan.model.options.nacelle_yaw
    noticed = [*plan.model.doubts, *unusual(described, produces=produces, yaw=yaw)]
    for where, each in (("wind", described), ("environment", plan.model.environment)):
        noticed += unusual_numbers(each, where) if isinstance(each, Record) else ()
    noticed += getattr(run.sea, "doubts", list)()
    if run.controller is None and plan.events.given:
        from meltemi.simulation.events import ignored

        noticed += ignored(plan.events.given)
    wind = realised(described, turbine, run.duration)
    check_coverage(
        wind,
        hub_height=turbine.hub_height,
        radius=turbine.rotor_radius,
        reach=abs(kind_of(plan.model).reach(turbine)),
        duration=run.duration,
        origin=run.origin,
    )
    changing = {"grid": run.grid, "environment.air": plan.model.environment.air}
    noticed += [words for part in plan.model.parts for words in part.notices(plan.channels)]
    if isinstance(wind, WindSeries) or any(changing.values()):
        from meltemi.simulation.unsteady import unseen

        noticed += unseen(wind, changing, run.duration, run.transient)
    return wind, noticed


def controller_of(run: Run, plan: RunPlan, wind: Wind) -> tuple[Controller, int]:
    """The controller of a run, and the number of time steps between its calls.

    Raises:
      InputError: the object is not a controller, turns a nacelle that the model holds, or its sample time does not fit
        the time step.
    """
    controller = run.controller(wind) if callable(run.controller) else run.controller
    controller = controller or BaselineController(plan.model.turbine)
    if not isinstance(controller, Controller):
        raise InputError(f"controller: expected a meltemi.Controller, found {type(controller).__name__}")
    if controller.yaws and plan.model.options.yaw != "driven":
        raise InputError(
            f"controller {controller.name!r} turns the nacelle, but the model's yaw is {plan.model.options.yaw!r}: "
            'build it with ModelOptions(yaw="driven"), or in a file options: {yaw: driven}'
        )
    time = controller.sample_time
    return controller, 1 if time is None else multiple(time, plan.dt, "sample_time")


def first_point(model: Model[Any], wind: Wind, start: OperatingPoint | Start) -> StartPoint:
    """The initial state of the controller of a run."""
    turbine = model.turbine
    speed = float(start.rotor_speed) * turbine.drivetrain.gear_ratio
    now, before = (mean(wind, turbine.hub_height) for mean in (mean_speed, mean_before))
    return StartPoint(now, speed, start.pitch, start.generator_torque, before)


def step_of(run: Run, model: Model[Any]) -> float:
    """Time step [s]: the option, or the longest up to the default that divides intervals of outputs and controller."""
    longest, sampled = default_step(model), getattr(run.controller, "sample_time", None)
    periods = [each for each in (run.output_step, sampled or 0.0) if 0.0 < each < 1e9]
    if model.options.time_step is None and periods:
        shortest = min(periods)
        for n in range(math.ceil(shortest / longest - 1e-9), int(shortest / (SHORTEST_SHARE * longest)) + 1):
            if all(abs(each * n / shortest - round(each * n / shortest)) < 1e-6 for each in periods):
                return shortest / n
    return longest


def multiple(value: float, dt: float, name: str) -> int:
    """Number of time steps in ``value`` [s], which must be an integer."""
    if not (math.isfinite(value) and value > 0.0):
        raise InputError(f"{name} must be a positive number of seconds, found {value!r}")
    n = round(value / dt)
    if n < 1 or abs(n * dt - value) > 1e-6 * value:
        near = max(n, 1)
        raise InputError(
            f"{name} {value:g} s is not a multiple of the time step {dt:g} s; "
            f"use {near * dt:g} or {(near + 1) * dt:g} s, or set options.time_step"
        )
    return n


def model_channels(
    model: Model[Any], stations: Stations | None = None, parts: Sequence[Part] = ()
) -> dict[str, Channel]:
    """All channels of a model, and of further parts of a run, by name."""
    channels = kind_of(model).channels(model, stations or Stations())
    return channels | {channel.name: channel for part in parts for channel in part.channels()}


def choose(model: Model[Any], names: Sequence[str], stations: Stations, parts: Sequence[Part] = ()) -> list[Channel]:
    """Channels by name, each once, and all channels of stations that are given without any of theirs.

    Raises:
      InputError: a name is unknown, or no channel is given.
    """
    available = model_channels(model, stations, parts)
    if isinstance(names, str):
        raise InputError(f"channels must be a list of names, found the text {names!r}")
    chosen: dict[str, Channel] = {}
    whole = set(DEFAULT) <= set(names)
    for name in (*names, *(name for part in model.parts for name in part.shown if whole)):
        if name == "all":
            chosen.update(available)
            continue
        if "*" in name:
            if not (alike := fnmatch.filter(available, name)):
                raise InputError(f"no channel is called {name!r}")
            chosen.update((each, available[each]) for each in alike)
            continue
        if name in DEFAULT and name not in available and (whole or name.endswith("_3")):
            continue  # blade 3 of a two-bladed turbine, or blades of a power-coefficient turbine
        channel = kind_of(model).channel(name, model, available)
        chosen[channel.name] = channel
    for wanted, beginning in ((stations.blade, "station_"), (stations.tower, "tower_station_")):
        if wanted and not any(name.startswith(beginning) for name in chosen):
            chosen.update({name: c for name, c in available.items() if name.startswith(beginning)})
    chosen.pop("time", None)
    if not chosen:
        raise InputError("no channels to record")
    return list(chosen.values())
