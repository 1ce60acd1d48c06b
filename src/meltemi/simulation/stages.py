"""The stages from a described run to its time loop; each takes the records of those before it.

``planned`` (``plan.py``) checks the run; then ``surroundings`` has wind, controller and start, ``bound`` the case with
its controller, ``started`` the first instant, and ``compiled`` the time loop.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from meltemi.compiler import N_DERIVATIVES, Kind
from meltemi.control.controller import Controller, LogEntry
from meltemi.core.errors import InputError
from meltemi.simulation.case import LEAST_BRAKE_SPEED, Case
from meltemi.simulation.loop import Loop, loop_of
from meltemi.simulation.operating_point import OperatingPoint
from meltemi.simulation.plan import RunPlan, controller_of, first_point, wind_of
from meltemi.simulation.points import initial_state
from meltemi.simulation.rotors import kind_of
from meltemi.simulation.run import Run
from meltemi.simulation.start import Start, begin
from meltemi.wind.fields import Wind, WindSeries


@dataclass(frozen=True)
class Surroundings:
    """Inputs of the turbine of a run from outside, and its start.

    Attributes:
      every_control: time steps between the calls of the controller.
      noticed: warnings about turbine, wind, events and start.
      log: entries that are known beforehand, with their steps.
    """

    wind: Wind
    controller: Controller
    every_control: int
    start: OperatingPoint | Start
    noticed: tuple[str, ...]
    log: tuple[tuple[int, LogEntry], ...]


@dataclass(frozen=True)
class Started:
    """A case at its first instant.

    Attributes:
      moving: the vectors that the time loop changes.
      begin: copies of them.
    """

    case: Case
    moving: tuple[NDArray[np.float64], ...]
    begin: tuple[NDArray[np.float64], ...]


def surroundings(run: Run, plan: RunPlan) -> Surroundings:
    """Wind, controller and start of a run.

    Raises:
      InputError: one of them is not valid, or the wind does not cover the run.
    """
    wind, noticed = wind_of(run, plan)
    controller, every_control = controller_of(run, plan, wind)
    try:
        start, words = initial_state(plan.model, wind, run.start() if callable(run.start) else run.start)
    except InputError as error:  # an implausible value may be the cause
        raise InputError("; note: ".join([str(error), *noticed])) from None
    log = plan.events.log
    if isinstance(wind, WindSeries):
        from meltemi.simulation.unsteady import wind_log

        log = (*log, *wind_log(wind, run.duration, plan.dt))
    return Surroundings(wind, controller, every_control, start, (*noticed, *words), log)


def bound(run: Run, plan: RunPlan, around: Surroundings, numbers: Kind) -> Case:
    """The arrays of a run with its controller, and with what depends on its time step."""
    model, turbine, kind = plan.model, plan.model.turbine, kind_of(plan.model)
    case = Case(model, around.wind, plan.stations, numbers=numbers, grid=run.grid, parts=plan.parts, origin=run.origin)
    if plan.events.rows is not None:
        case.events = plan.events.rows
    case["weights"][:2] = kind.step_weights(model, plan.dt)
    # dry friction acts over a speed that a step of full braking cannot cross: as a damper on the generator
    # it has h c / J = 0.4, below the bound of 0.5 with a margin for the shaft (docs/theory/simulation.md, M-7)
    brake_step = turbine.drivetrain.brake_torque * plan.dt / kind.brake_inertia(turbine)
    case.view("drive")["brake_speed"] = max(LEAST_BRAKE_SPEED, 2.5 * brake_step)
    case.bind(around.controller, first_point(model, around.wind, around.start))
    return case


def started(
    plan: RunPlan, around: Surroundings, case: Case, starting: Callable[[Case, bool], None] | None = None
) -> Started:
    """The case at the start of the run; ``starting``: see :class:`Simulation`."""
    start, unsettled = around.start, isinstance(around.start, Start)
    start.set(case) if isinstance(start, Start) else start.put(case)
    if starting is not None:
        starting(case, unsettled)
    if unsettled:
        case.settle(0.0)
    case.begin_parts(plan.dt)
    begin(case)
    clock, settings = case.clock, case.settings
    clock.every_output, clock.every_control, settings.time_step = plan.every_output, around.every_control, plan.dt
    # an instant stands for half a step before and after it: what is held between calls and jumps there would lead
    calls_each_short_step = around.controller.sample_time is None and plan.model.options.integration == "explicit"
    settings.held_share = 0.0 if calls_each_short_step else 0.5
    moving = (
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
    return Started(case, moving, tuple(array.copy() for array in moving))


def compiled(plan: RunPlan, started: Started, held_steps: int, numbers: Kind) -> Loop:
    """The time loop of the run, with room for the samples of some of its time steps."""
    case = started.case
    sources = (source for each in plan.derived for source in each.sources)
    places = np.array([case.place(channel) for channel in (*plan.channels, *sources)], dtype=np.int64)
    if plan.recorder:
        places = np.concatenate([places, plan.recorder.places(case)])
    samples = (min(plan.n_steps, held_steps) - 1) // plan.every_output + 1
    output = np.full((samples, len(places)), np.nan)
    if numbers == "duals":
        case.slopes["output"] = np.zeros((*output.shape, N_DERIVATIVES))
    records = (case.run(places, output), case.control, case.system, case.one, case.plain, case.sections)
    loop = loop_of(case.entry.function, records, output)
    return plan.recorder.framed(loop, case, plan.dt) if plan.recorder else loop
