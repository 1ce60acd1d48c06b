"""Runs of a design: the same winds, starts and seeds for every trial, their statistics and the derivatives of these.

Held over a search are the wind and its place, the time step and the constants of the integration. Each trial begins in
its own steady operation; derivatives include it (docs/theory/designs.md, D-1 to D-21).
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from meltemi.cases.case import LoadCase, case_controller, case_run, case_turbine
from meltemi.control.baseline import BaselineController
from meltemi.control.controller import Controller, StartPoint
from meltemi.controllers.specification import BaselineCase, SupervisedCase
from meltemi.core.errors import InputError, MeltemiError
from meltemi.core.fingerprint import fingerprint
from meltemi.core.yamlfile import merged, validated
from meltemi.designs.kept import keep
from meltemi.designs.operation import Operation
from meltemi.designs.settings import CaseSetting, Design
from meltemi.designs.strain import moments, per_moment
from meltemi.designs.terms import Term, combined, hard, matching, of_turbine, slope_of, statistic
from meltemi.designs.variables import Variables
from meltemi.gradients.sensitivity import matched
from meltemi.loadcases.batch import Batch, Piece, told_to_end
from meltemi.simulation.bladed.rotor import BladedRotor
from meltemi.simulation.case import Case
from meltemi.simulation.model import Model
from meltemi.simulation.operating_point import steady_wind
from meltemi.simulation.plan import step_of
from meltemi.simulation.points import initial_state
from meltemi.simulation.result import Result
from meltemi.simulation.rotors import build, kind_of
from meltemi.simulation.run import Run
from meltemi.simulation.simulate import Simulation, march
from meltemi.wind.fields import SteadyWind
from meltemi.wind.turbulent import realised

Float = NDArray[np.float64]
FIELDS = 3 << 30
"""[bytes] wind fields that are kept; others are generated for each run."""
TURBULENT = ("NTM", "ETM", "EWM1", "EWM50")
"""Wind models of IEC 61400-1 that have a seed."""
HELD = ("wind", "watch")
"""Arrays of a case besides the weights of the step that follow from the turbine and are held."""
START_STEP = 1e-2
"""Step of differences of the start over the scale of a variable: steady operation is found to 1e-5."""
WITHOUT_START = tuple(
    f"control.{name}"
    for name in ("filter_frequency", "pitch.proportional_gain", "pitch.integral_gain", "pitch.gain_halving_pitch",
                 "pitch.rate_limit", "pitch.motion_gain", "pitch.motion_frequency", "torque.rate_limit")
)  # fmt: skip
"""Settings of the control that do not act in steady operation."""


def group_of(case: LoadCase) -> str:
    """Cases of one model."""
    return str(fingerprint(case.options, case.environment))


class TrialError(MeltemiError):
    """A trial that cannot be built, trimmed or run to its end."""


@dataclass(frozen=True)
class DesignCase:
    """A run of the objective.

    Attributes:
      name: of its group and seed.
      case: content.
      share: of the weights, of sum 1.
      group: number of its entry in the list of cases.
      seed: seed of its turbulence.
    """

    name: str
    case: LoadCase
    share: float
    group: int
    seed: int


def cases_of(design: Design, folder: Path, settings: Sequence[CaseSetting] | None = None) -> list[DesignCase]:
    """Cases of the objective, or of other settings.

    Raises:
      InputError: the content of a case is not valid, or the load base has no such cases.
    """
    found: list[tuple[str, LoadCase, float, int, int]] = []
    if settings is None and design.base is not None:
        found = _of_base(design, folder)
    for group, each in enumerate(design.cases if settings is None else settings):
        wind = merged(design.case.get("wind", {}), each.wind) | ({"speed": each.speed} if each.speed else {})
        wind = {"kind": "turbulence", **wind}
        turbulent = wind["kind"] == "turbulence" or wind.get("model") in TURBULENT
        seeds = each.seeds if turbulent else each.seeds[:1]
        for seed in seeds:
            wind = wind | ({"seed": seed} if turbulent else {})
            content = merged(design.case, each.other) | {"wind": wind, "turbine": design.turbine}
            content |= {} if each.sea is None else {"sea": each.sea}
            where = f"cases {group + 1}"
            speed = f"{each.speed:g} m/s" if each.speed else where
            found.append((f"{speed}, seed {seed}", validated({"duration": 600.0, **content}, LoadCase, where),
                          each.weight / len(seeds), group, seed))  # fmt: skip
    total = sum(weight for _, _, weight, _, _ in found)
    return [DesignCase(name, case, weight / total, group, seed) for name, case, weight, group, seed in found]


def _of_base(design: Design, folder: Path) -> list[tuple[str, LoadCase, float, int, int]]:
    from meltemi.loads.loadbase.campaign import read_campaign
    from meltemi.loads.loadbase.plan import plan

    assert design.base is not None
    planned = plan(read_campaign(folder / design.base.file))
    chosen = [c for c in planned.cases if c.dlc in design.base.dlc and not c.unsupported]
    if not chosen:
        known = ", ".join(sorted({c.dlc for c in planned.cases}))
        raise InputError(f"base: the plan has no cases of {', '.join(design.base.dlc)}: it has {known}")
    if len(chosen) > design.base.most:
        raise InputError(
            f"base: {len(chosen)} cases, at most {design.base.most} (base.most): choose fewer, or raise it"
        )
    content = {k: v for k, v in design.case.items() if k not in ("wind", "turbine")} | {"turbine": design.turbine}
    shares = [c.weight.share if c.weight else 0.0 for c in chosen]  # cases of ultimate loads: for extremes
    shares = shares if any(shares) else [1.0] * len(chosen)
    return [
        (c.name, validated(merged(c.content, content), LoadCase, c.name), share, i, c.seed or 0)
        for i, (c, share) in enumerate(zip(chosen, shares, strict=True))
    ]


@dataclass(frozen=True)
class _Held:
    """What is held of a case: its wind, and the mean of that, time step, constants of the integration, arrays."""

    wind: Callable[[], Any]
    steady: SteadyWind
    time_step: float
    weights: Float
    arrays: dict[str, Float]


@dataclass
class Statistics:
    """Statistics of the runs of a trial: (C, M) values, and those of the turbine by name."""

    of_runs: Float
    of_turbine: dict[str, float]


class Runs:
    """Runs of the cases of a design.

    Args:
      cases: the cases.
      terms: terms of objective and constraints.
      variables: the variables.
      folder: folder to which paths are relative.
      workers: threads.

    Attributes:
      display: engineering units of the terms, and factors to them.
      seconds: [s] simulated time of all runs so far; a gradient counts as the runs whose time it takes.
    """

    def __init__(
        self, cases: Sequence[DesignCase], terms: Sequence[Term], variables: Variables, folder: Path,
        workers: int | None = None,
    ) -> None:  # fmt: skip
        self.cases, self.variables, self.folder, self.workers = cases, variables, folder, workers
        self.of_runs = [t for t in terms if t.of_runs]
        self.of_turbine = [t for t in terms if not t.of_runs]
        self.strained = {t.name: moments(t, variables, cases[0].case.blade_stations) for t in self.of_runs if t.strain}
        names = [name for t in self.of_runs for name in self.strained.get(t.name, (t.of,))]
        self.channels = tuple(dict.fromkeys(names)) or ("generator_power",)
        self.units = np.ones(len(self.of_runs))
        self.slopes = np.ones(len(self.of_runs))
        self.display = {t.name: ({"mass": "kg", "frequency": "Hz"}.get(t.kind, ""), 1.0) for t in self.of_turbine}
        self.seconds = 0.0
        self.progress: Callable[[float], None] | None = None
        self._models: dict[tuple[Any, ...], Model[Any]] = {}
        self._laws: dict[str, Controller] = {}
        self._factors: dict[tuple[Any, ...], dict[str, float]] = {}
        self.lock = threading.Lock()
        self.restart(variables.start)

    # ------------------------------------------------------------------------------------------------- inputs

    def restart(self, x: Float) -> None:
        """Hold the time step and the constants of the integration of a design."""
        self.origin = np.array(x, dtype=float)
        self._models.clear()
        self._held: dict[int, _Held] = {}
        each, case = self.variables.each, self.cases[0].case
        self.operation = Operation(
            [t for t in self.of_turbine if t.of_operation], lambda x, about: self.model(x, case, about), self.origin,
            np.array([not (v.of_controller or v.path in WITHOUT_START) for v in each]),
            START_STEP * self.variables.scale,
        )  # fmt: skip
        self._reference: dict[str, Model[Any]] = {}
        self._kept = 0

    def model(self, x: Float, case: LoadCase, about: Float | None = None) -> Model[Any]:
        """The model of a trial for the options of a case, with the modes' signs of that of the origin.

        Args:
          about: design beside which it is wanted for derivatives (``Variables.apply``).
        """
        group = group_of(case)
        if group not in self._reference:
            turbine = self.turbine(self.origin, case)
            self._reference[group] = build(turbine, case.options, case.environment)
        reference = self._reference[group]
        key = (group, x.tobytes(), None if about is None else about.tobytes())
        if (model := self._models.get(key)) is None:
            model = build(self.turbine(x, case, about), case.options, case.environment)
            model = matched(model, reference) if isinstance(model.rotor, BladedRotor) else model
            with self.lock:
                keep(self._models, key, model, 3 + 2 * len(self.variables.each))
        return model

    def turbine(self, x: Float, case: LoadCase, about: Float | None = None) -> Any:
        base = self.variables.turbine
        given = case_turbine(case, self.folder) if (case.icing or case.imbalance or case.electrical) else base
        return replace(self.variables, turbine=given).apply(x, about)

    def controller(self, x: Float, case: LoadCase) -> Controller:
        """The controller of a trial: that of the turbine's settings, or one that is designed once, with its entries."""
        law = self.law(x, case, self.model(x, case).turbine)
        return with_entries(law, self.variables.entries(x))

    def law(self, x: Float, case: LoadCase, turbine: Any) -> Controller:
        """The controller of a case; that of a scheme or a file is made once, for the turbine at the start."""
        if case.controller == BaselineCase():
            return BaselineController(turbine)
        if isinstance(case.controller, SupervisedCase):
            made = case_controller(case, replace(self.model(self.origin, case), turbine=turbine), self.folder)
            assert made is not None
            return made
        key = str(fingerprint(case.controller))
        if key not in self._laws:
            made = case_controller(case, self.model(self.variables.start, case), self.folder)
            assert made is not None
            self._laws[key] = made
        return self._laws[key]

    def hold(self, number: int) -> _Held:
        """What is held of a case, from the design at the start."""
        if number not in self._held:
            case, turbine = self.cases[number].case, self.variables.turbine
            model = self.model(self.origin, case)
            run = case_run(case, model.turbine, self.folder, model=model, controller=self.controller(self.origin, case))
            described: Any = run.wind() if callable(run.wind) else run.wind
            field = realised(described, turbine, case.duration)
            self._kept += getattr(getattr(field, "velocity", None), "nbytes", 0)
            kept = field if self._kept < FIELDS else None
            dt = step_of(run, model)
            arrays = {n: a.copy() for n, a in Case(model, field).arrays.items() if n in HELD}
            self._held[number] = _Held(
                wind=lambda: realised(described, turbine, case.duration) if kept is None else kept,
                steady=steady_wind(described, turbine.hub_height),
                time_step=dt,
                weights=kind_of(model).step_weights(model, dt),
                arrays=arrays,
            )
        return self._held[number]

    def run(self, x: Float, number: int) -> tuple[Run, Callable[[Case], None]]:
        """A run of a trial, and what prepares its case."""
        held, case = self.hold(number), self.cases[number].case
        model, controller = self.model(x, case), self.controller(x, case)
        run = case_run(case, model.turbine, self.folder, model=model, controller=controller)
        begun = run.start() if callable(run.start) else run.start
        start, _ = initial_state(model, held.steady, begun)
        model = replace(model, options=model.options.replace(time_step=held.time_step))
        run = replace(run, model=model, wind=held.wind(), start=start, channels=self.channels, view=False)

        def prepare(case: Case) -> None:
            case["weights"][:2] = held.weights
            for name, array in held.arrays.items():
                if name in case.arrays and case[name].shape == array.shape:
                    case[name][...] = array

        return run, prepare

    # --------------------------------------------------------------------------------------------- statistics

    def statistics(self, x: Float) -> Statistics:
        """Statistics of all runs of a trial.

        Raises:
          TrialError: it cannot be built, or a run does not reach its end.
          KeyboardInterrupt: by Ctrl-C.
        """
        try:
            model = self.model(x, self.cases[0].case)
            fixed = {t.name: of_turbine(t, model) for t in self.of_turbine if not t.of_operation}
            fixed |= self.operation.values(x)
            for number in range(len(self.cases)):
                self.hold(number)
        except MeltemiError as error:
            raise TrialError(str(error)) from None
        rows = self.of_cases(lambda number: self.row(x, number)) if self.of_runs else [np.zeros(0)] * len(self.cases)
        found = np.array(rows).reshape(len(self.cases), len(self.of_runs))
        if not np.all(np.isfinite(found)) or not all(np.isfinite(v) for v in fixed.values()):
            raise TrialError("a statistic is not a finite number")
        return Statistics(found, fixed)

    def row(self, x: Float, number: int) -> Float:
        return np.array([value for value, _ in self.numbers(x, self.simulated(x, number), number)])

    def simulated(self, x: Float, number: int) -> Result:
        """The result of a run."""
        run, prepare = self.run(x, number)
        simulation = Simulation(run, prepare=prepare)
        march(simulation, stop=told_to_end)
        if simulation.interrupted:
            raise KeyboardInterrupt
        result = simulation.result()
        self.seconds += run.duration
        return result.raise_for_status() if not result.status.complete else result

    def numbers(self, x: Float, result: Result, number: int) -> list[tuple[float, dict[str, Float]]]:
        """Terms of a run, and their derivatives by the samples of its channels."""
        transient = self.cases[number].case.transient
        return [
            statistic(t, result, transient, unit, self.factors(t, x))
            for t, unit in zip(self.of_runs, self.units, strict=True)
        ]

    def factors(self, term: Term, x: Float, about: Float | None = None) -> dict[str, float] | None:
        """Strains by moments of 1 N m, by channel; None for other terms."""
        if term.name not in self.strained:
            return None
        key = (term.name, x.tobytes(), None if about is None else about.tobytes())
        with self.lock:
            if key not in self._factors:
                found = per_moment(term, self.variables, x, self.cases[0].case.blade_stations, about)
                factors = dict(zip(self.strained[term.name], map(float, found), strict=True))
                keep(self._factors, key, factors, 2 * len(self.strained) + 1)
            return self._factors[key]

    def set_units(self) -> None:
        """Hold the magnitudes of soft extremes, and find the slopes of equivalent loads, by the run of the first case.

        Raises:
          InputError: a channel is unknown.
        """
        result = self.simulated(self.origin, 0)
        for i, term in enumerate(self.of_runs):
            factors = self.factors(term, self.origin)
            channels = matching(term.of, result, factors)
            if not channels:
                raise InputError(f"terms: {term.name!r}: no channel begins with {term.of[:-1]!r}")
            self.slopes[i] = slope_of(term, channels[0])
            unit, factor = ("µm/m", 1e6) if term.strain else channels[0].display_unit
            self.display[term.name] = (f"{unit}/s" if term.kind in ("travel", "rate") else unit, factor)
            if term.soft:
                extreme, scales = hard(term, result, self.cases[0].case.transient, factors), factors or {}
                ranges = [scales.get(c.name, 1.0) * float(np.ptp(result[c.name])) for c in channels]
                self.units[i] = max(abs(extreme), 0.1 * max(ranges)) or 1.0

    def totals(self, found: Statistics) -> tuple[Float, list[Float]]:
        """(M,) statistics of all runs together, and the derivatives of each by those of the runs."""
        shares = np.array([c.share for c in self.cases])
        pairs = [
            combined(term, slope, found.of_runs[:, i], shares, unit)
            for i, (term, slope, unit) in enumerate(zip(self.of_runs, self.slopes, self.units, strict=True))
        ]
        return np.array([value for value, _ in pairs]), [by for _, by in pairs]

    def of_cases(self, work: Callable[[int], Any], numbers: Sequence[int] | None = None) -> list[Any]:
        """Values of a function of the numbers of all or some cases, in threads.

        Raises:
          TrialError: one failed.
          KeyboardInterrupt: by Ctrl-C.
        """
        chosen = range(len(self.cases)) if numbers is None else numbers
        pieces = [Piece(f"{i + 1}: {self.cases[i].name}", partial(work, i)) for i in chosen]
        batch = Batch(pieces, workers=self.workers, progress=self.progress)
        outcomes = batch.run()
        if batch.interrupted:
            raise KeyboardInterrupt
        for outcome in outcomes:
            if outcome.error is not None:
                raise TrialError(f"case {outcome.name}: {outcome.message}")
        return [outcome.value for outcome in outcomes]


def with_entries(controller: Controller, entries: Mapping[str, float]) -> Controller:
    """A controller whose initial state has given entries, by ``controller.NAME``."""
    if not entries:
        return controller
    names = [f"controller.{name}" for name in controller.state_names or range(len(controller.initial_state(START)))]
    rows = [names.index(name) for name in entries]

    def init(start: StartPoint) -> Float:
        state = np.array(controller.init(start), dtype=float)
        state[rows] = list(entries.values())
        return cast("Float", state)

    return replace(controller, init=init)


START = StartPoint(wind_speed=12.0, generator_speed=100.0, pitch=0.1, generator_torque=1e4)
"""Where the entries of a controller's state are looked up."""
