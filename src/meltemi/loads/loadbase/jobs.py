"""Jobs of a load base: key, run and reduced result of each case."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterable
from dataclasses import dataclass, fields, replace
from pathlib import Path
from time import thread_time
from typing import Any, TypeVar, cast

import numpy as np

import meltemi
from meltemi.cases.case import LoadCase, case_controller, case_run, case_turbine
from meltemi.control.controller import Controller, LogEntry
from meltemi.controllers.specification import hashed, specification, uses_flaps
from meltemi.core.errors import InputError, Status
from meltemi.core.physics import PHYSICS
from meltemi.core.stores import code_identity
from meltemi.core.yamlfile import validated
from meltemi.loads.loadbase.interfaces import interfaces_of, recorded, stations
from meltemi.loads.loadbase.joints import frame_of, joint_settings, member_channels, with_joints, without_members
from meltemi.loads.loadbase.plan import Plan
from meltemi.loads.loadbase.reduction import Reduced, equivalent, reduced
from meltemi.simulation.bladed.rotor import BladedModel
from meltemi.simulation.operating_point import OperatingPoint, steady_wind
from meltemi.simulation.points import initial_state
from meltemi.simulation.result import Result
from meltemi.simulation.rotors import build
from meltemi.simulation.run import Run
from meltemi.studies.preview import rotor_average
from meltemi.turbine.definition import Turbine
from meltemi.turbine.library import load_turbine
from meltemi.turbine.power_turbine import aeroelastic
from meltemi.wind.fields import SteadyWind, Wind, WindBox
from meltemi.wind.turbulent import AnyWind, TurbulentWind, realised

REDUCTION = 3
"""Version of the reduction, increased with every change of starts, of reduced results, and of omitted defaults."""
FIRST = 2.0
"""Time [s] of the wind over the rotor whose mean is the speed in which a case of production begins."""
WITHOUT_CONTROL = (
    *("pitch.reference_speed", "pitch.minimum", "pitch.maximum"),
    *("torque.rated_power", "torque.rated_speed", "torque.maximum_torque"),
)
"""Settings of the control on which a run without controller depends."""
OF_RUN = ("wind", "controller", "start", "duration", "transient", "events", "grid", "sea")
"""Keys of a case on which its model does not depend."""
MOST_MODELS = 16
"""Largest number of models, and of controllers, that are kept for further cases."""
T = TypeVar("T")
WITH_FILES = ("bladed", "python")
"""Kinds of controllers that depend on files."""


@dataclass(frozen=True)
class Job:
    """A case of a load base, ready to run anywhere.

    Attributes:
      name: name of the planned case.
      key: hash of its resolved input, of the version of the physics, and of the reduction.
      content: content of its case file.
      cycles: whether cycles are counted, for fatigue.
      slopes: S-N slopes of load channels; if given, only equivalent loads and statistics are kept.
      joints: settings of the joints of the turbine's frame, and partial safety factor, if they are evaluated.
    """

    name: str
    key: str
    content: dict[str, Any]
    cycles: bool
    slopes: dict[str, float] | None = None
    joints: dict[str, Any] | None = None

    @property
    def seconds(self) -> float:
        """Simulated time [s]."""
        return float(self.content["duration"])


@dataclass(frozen=True)
class CaseRow:
    """Stored result of a case.

    Attributes:
      name, key: name and key of the case.
      status, message, warnings: outcome of its run.
      simulated: [s] simulated time, including the initial transient.
      wind_seconds, simulation_seconds, reduction_seconds: [s] processor times.
      version: version of meltemi.
      reduced: statistics and loads; None for a run that did not reach its end.
    """

    name: str
    key: str
    status: Status
    message: str = ""
    warnings: tuple[str, ...] = ()
    simulated: float = 0.0
    wind_seconds: float = 0.0
    simulation_seconds: float = 0.0
    reduction_seconds: float = 0.0
    version: str = meltemi.__version__
    reduced: Reduced | None = None


def jobs_of(plan: Plan) -> list[Job]:
    """Jobs of all cases of a plan that can run.

    Raises:
      InputError: the turbine or a file of the controller cannot be read.
    """
    known: dict[str, str] = {}
    jobs = []
    if (settings := joint_settings(plan.campaign)) is not None:
        frame_of(aeroelastic(load_turbine(plan.campaign.turbine), "joints"))
    for case in plan.cases:
        if not case.unsupported:
            content, cycles = case.content, case.type == "fatigue"
            joints = None if settings is None else {"settings": settings.content(), "factor": case.factor}
            jobs.append(Job(case.name, case_key(content, cycles, known, joints=joints), content, cycles, joints=joints))
    return jobs


def names_by_key(jobs: Iterable[Job]) -> dict[str, list[str]]:
    """Names of the cases of each key; cases of equal input have one key."""
    names: dict[str, list[str]] = {}
    for job in jobs:
        names.setdefault(job.key, []).append(job.name)
    return names


def case_key(
    content: dict[str, Any],
    cycles: bool,
    known: dict[str, str],
    slopes: dict[str, float] | None = None,
    joints: dict[str, Any] | None = None,
) -> str:
    """Key of a case.

    Args:
      content: content of its case file; paths are absolute.
      cycles: whether cycles are counted.
      known: hashes of turbines and files, filled as they are needed.
      slopes, joints: see :class:`Job`.

    Raises:
      InputError: the turbine or a file of the controller cannot be read.
    """

    def once(name: str, make: Callable[[], str]) -> str:
        if name not in known:
            known[name] = make()
        return known[name]

    controller, turbine = content["controller"], str(content["turbine"])
    controlled = controller["kind"] != "fixed"
    if controller["kind"] in WITH_FILES:
        controller = hashed(specification(controller), once)
    turbine_hash = once(f"{turbine} {controlled}", lambda: _turbine_hash(turbine, controlled))
    given = [*code_identity(), REDUCTION, cycles, content | {"turbine": turbine_hash, "controller": controller}]
    given += [{"equivalent": slopes}] if slopes else []
    given += [{"joints": joints}] if joints else []
    return hashlib.sha256(json.dumps(given, sort_keys=True).encode()).hexdigest()[:24]


def _turbine_hash(name: str, controlled: bool) -> str:
    turbine = load_turbine(name)
    content = turbine.content()
    if not controlled:
        control = content["control"]
        kept = (path.split(".") for path in WITHOUT_CONTROL)
        content["control"] = {f"{group}.{field}": control[group][field] for group, field in kept}
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


@dataclass(frozen=True, repr=False)
class CaseField(WindBox):
    """Wind of a case, identified by the key of the case."""

    key: str = ""

    def __post_init__(self) -> None:
        """The original field was already checked."""

    def content_hash(self) -> str:
        """Key of the case."""
        return self.key


class Workshop:
    """Runs of jobs, and their rows. Cases of the same turbine and options share a model.

    Args:
      hashed: whether results have a hash of the velocities of their wind, which takes a tenth of the time of a run.
    """

    def __init__(self, hashed: bool = False) -> None:
        self.hashed = hashed
        self.models: dict[str, BladedModel] = {}
        self.controllers: dict[str, Controller | None] = {}
        self.begun: dict[str, tuple[Job, Turbine, float, float]] = {}
        self.first: dict[str, SteadyWind] = {}

    def run(self, job: Job) -> Run:
        """The run of a job; its wind is computed when the run begins.

        Raises:
          InputError: its content is not valid.
        """
        content = job.content
        flaps = uses_flaps(specification(content["controller"]))
        group = json.dumps([{k: v for k, v in content.items() if k not in OF_RUN}, flaps], sort_keys=True)

        def built() -> BladedModel:
            case = validated(content, LoadCase, job.name)
            turbine = aeroelastic(case_turbine(case, Path()), "meltemi loads")
            return build(turbine, case.options, case.environment)

        model = _once(self.models, group, built)
        blade, tower = stations(model.turbine)
        recording: dict[str, Any] = {"blade_stations": blade, "tower_stations": tower}
        members = member_channels(frame_of(model.turbine)) if job.joints else ()
        recording["channels"] = (*recorded(model.turbine, interfaces_of(model.turbine)), *members)
        case = validated(content | ({} if job.slopes else recording), LoadCase, job.name)
        law = json.dumps([group, content["controller"], content.get("start")], sort_keys=True)
        controller = _once(self.controllers, law, lambda: case_controller(case, model, Path()))
        run = case_run(case, model.turbine, Path(), model=model, controller=controller)

        def start() -> Any:
            begin: Any = run.start
            if (wind := self.first.pop(job.name, None)) is None:
                return begin
            point, words = initial_state(model, wind, begin)  # computed once for all cases that share it
            return point if isinstance(point, OperatingPoint) and words == point.warnings else begin

        return replace(run, name=job.name, start=start, wind=lambda: self._wind(job, run, model.turbine))

    def _wind(self, job: Job, run: Run, turbine: Turbine) -> Wind:
        began, wind = thread_time(), cast("AnyWind", run.wind)
        field = realised(wind, turbine, job.seconds)
        if isinstance(wind, TurbulentWind):
            self.first[job.name] = first_wind(field, steady_wind(wind, turbine.hub_height), run.start, turbine)
        if isinstance(field, WindBox) and not self.hashed:
            field = CaseField(**{each.name: getattr(field, each.name) for each in fields(field)}, key=job.key)
        self.begun[job.name] = (job, turbine, began, thread_time() - began)
        return field

    def row(self, result: Result) -> CaseRow:
        """The row of a result; called in the thread that simulated it."""
        job, turbine, began, wind = self.begun.pop(str(result.meta["case"]))
        ended, kept = thread_time(), None
        if result.status.complete and job.slopes:
            kept = equivalent(result, job.slopes)
        elif result.status.complete:
            rated = turbine.rated_rotor_speed
            rest = without_members(result) if job.joints else result
            kept = reduced(rest, interfaces_of(turbine), rated_speed=rated, cycles=job.cycles)
            if job.joints:
                kept = with_joints(kept, result, frame_of(turbine), job.joints, cycles=job.cycles)
        simulated = float(result.time[-1]) if len(result.time) else 0.0
        times = (wind, ended - began - wind, thread_time() - ended)
        stop = "" if "events" in job.content else unplanned_stop(result.log)
        warnings = (*result.warnings, *filter(None, [stop]))
        return CaseRow(job.name, job.key, result.status, result.message, warnings, simulated, *times, reduced=kept)


def _once(known: dict[str, T], key: str, make: Callable[[], T]) -> T:
    """The object of a key, created if there is none; the oldest one is dropped when there are many."""
    if key not in known:
        if len(known) >= MOST_MODELS:
            del known[next(iter(known))]
        known[key] = make()
    return known[key]


def unplanned_stop(log: Iterable[LogEntry]) -> str:
    """Time and reason of a stop by the supervisor in a case without events, after which its loads are not valid."""
    for entry in log:
        if entry.source == "supervisor" and entry.what.endswith("stop"):
            return f"stopped at {entry.time:.1f} s: {entry.reason}"
    return ""


def first_wind(wind: Wind, mean: SteadyWind, start: Any, turbine: Turbine) -> SteadyWind:
    """Wind in which a case begins: the mean wind, in production with the speed that the rotor meets first.

    A start in the mean of a gusty wind trips protections within seconds. The speed is rounded to 1 m/s, so that cases
    share starts.
    """
    if start is not None or not isinstance(wind, WindBox):
        return mean
    begin = int(np.searchsorted(wind.passing, 0.0))
    planes = replace(wind, velocity=wind.velocity[begin : begin + max(round(FIRST / wind.dt), 2)])
    speed = float(rotor_average(planes, turbine.hub_height, turbine.rotor_radius).mean())
    return mean.replace(speed=max(float(round(speed)), turbine.cut_in))


def check_key(job: Job, known: dict[str, str]) -> None:
    """Test that this process has the files and the version from which the key of a job was computed.

    Raises:
      InputError: the keys differ.
    """
    if case_key(job.content, job.cycles, known, job.slopes, job.joints) != job.key:
        raise InputError(
            f"{job.name}: this process has another version of meltemi (physics {PHYSICS}), turbine or controller file"
        )
