"""``sensitivity``: exact derivatives of a run, and of its statistics, by parameters.

A run with dual numbers carries with every number its derivatives by eight parameters. What it gives is the
derivative of the simulation as it is computed, between switches: where a limiter acts or a branch of the
controller changes within the difference step of a parameter, a finite change has a part that no derivative knows.
Such places are counted (``Sensitivity.switches``).

The start of the run, the wind and the controller's first state are held.

Reference: docs/guide/sensitivities.md; docs/theory/fatigue.md (F-12 to F-15) for statistics.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meltemi.aero.tables import MEMORY
from meltemi.control.actuators import ACTUATOR, PITCH
from meltemi.control.baseline import BASELINE, baseline
from meltemi.control.baseline import SWITCHES as CONTROLLER_SWITCHES
from meltemi.control.controller import Controller
from meltemi.core.errors import InputError, did_you_mean
from meltemi.core.tables import MAX_BLADES
from meltemi.numbers.duals import N_DERIVATIVES
from meltemi.postprocess.gradient import del_gradient, mean_gradient, std_gradient
from meltemi.simulation.case import CONSTANT, Case, Stations
from meltemi.simulation.channels import DEFAULT, find
from meltemi.simulation.model import Model, build
from meltemi.simulation.result import Result
from meltemi.simulation.simulate import Simulation, march
from meltemi.simulation.start import Start
from meltemi.simulation.trim import OperatingPoint, operating_point
from meltemi.wind.fields import Wind

Float = NDArray[np.float64]

RELATIVE_STEP = 1e-4
"""Difference step over the value of a parameter."""
STEPS = {"pitch_offset": 1e-4}
"""[rad] difference steps of parameters that are usually zero."""
TABLE_STEP = 1e-3
"""Relative change of the turbine for differences of the model's tables."""


@dataclass(frozen=True)
class Direction:
    """How the numbers of a run change with a parameter.

    Attributes:
      name: the path.
      value: of the parameter; 1 for factors.
      step: difference step, by which switches are judged.
      arrays: change of the model's arrays for a unit of the parameter.
      state: (row, change) of the controller's state.
    """

    name: str
    value: float
    step: float
    arrays: dict[str, Float] = field(repr=False, default_factory=dict)
    state: tuple[int, float] | None = None


@dataclass(frozen=True)
class Sensitivity:
    """A run with the derivatives of its series.

    Attributes:
      result: the run.
      parameters: names.
      values: of the parameters; a factor on an array is 1.
      steps: difference steps, by which switches are judged.
      slopes: (T, channels, parameters) derivatives of the series.
      switches: how often a branch or limit would have changed within a difference step of a parameter, by where.
    """

    result: Result
    parameters: tuple[str, ...]
    values: tuple[float, ...]
    steps: tuple[float, ...]
    slopes: Float = field(repr=False)
    switches: dict[str, int]

    def _series(self, channel: str, skip: float) -> tuple[Float, Float]:
        names = [c.name for c in self.result.channels]
        name = find(channel, {c.name: c for c in self.result.channels}).name
        after = self.result.time >= skip
        column = names.index(name)
        return self.result.data[after, column], self.slopes[after, column]

    def mean(self, channel: str, *, skip: float = 0.0) -> tuple[float, Float]:
        """Mean of a channel after ``skip`` [s], and its derivatives (parameters,)."""
        return mean_gradient(*self._series(channel, skip))

    def std(self, channel: str, *, skip: float = 0.0) -> tuple[float, Float]:
        """Standard deviation of a channel, and its derivatives (parameters,)."""
        return std_gradient(*self._series(channel, skip))

    def fatigue(self, channel: str, slope: float, *, skip: float = 0.0, f_eq: float = 1.0) -> tuple[float, Float]:
        """Damage-equivalent load of a channel (ranges not binned), and its derivatives (parameters,).

        Args:
          slope: Woehler exponent.
          f_eq: [Hz].
        """
        series, slopes = self._series(channel, skip)
        duration = float(self.result.time[-1] - skip)
        return del_gradient(series, slopes, duration=duration, slope=slope, f_eq=f_eq)


def sensitivity(
    model: Model,
    wind: Wind,
    parameters: Sequence[str],
    *,
    duration: float,
    controller: Controller | None = None,
    channels: Sequence[str] = DEFAULT,
    output_step: float = 0.05,
    start: OperatingPoint | Start | None = None,
    stations: Stations | None = None,
    steps: Mapping[str, float] | None = None,
    progress: Callable[[float], None] | None = None,
) -> Sensitivity:
    """Exact derivatives of a run by parameters.

    Args:
      parameters: paths, see :func:`direction`. Eight cost little more than one; more are taken eight at a time.
      steps: difference steps by parameter, for the count of switches; by default 1e-4 of the value, 1e-4 rad for a
        pitch offset.
      model, wind, duration, controller, channels, output_step, start, stations, progress: as in ``simulate``.

    Raises:
      InputError: a parameter is unknown, or the controller has no derivatives.
    """
    controller = controller or baseline(model.turbine.control)
    start = start or operating_point(model, wind)
    ways = directions(model, parameters, controller, start, steps or {})
    parts, switches = [], dict.fromkeys(("controller", "pitch limits", "stall"), 0)
    rounds = range(0, len(ways), N_DERIVATIVES)
    for number, first in enumerate(rounds):
        some = ways[first : first + N_DERIVATIVES]
        run = Simulation(
            model,
            wind,
            duration=duration,
            controller=controller,
            channels=channels,
            output_step=output_step,
            start=start,
            stations=stations,
            numbers="duals",
            prepare=lambda case, some=some: seed(case, some),  # type: ignore[misc]
        )
        share = (lambda s, n=number: progress((n + s) / len(rounds))) if progress is not None else None
        march(run, share)
        result = run.result()
        # derivatives were carried for a step of each parameter
        found = run.case.slopes["output"][: len(result.time), :, : len(some)]
        parts.append(found / np.array([way.step for way in some]))
        for name, count in count_switches(run.case, controller).items():
            switches[name] += count
    return Sensitivity(
        result=result,
        parameters=tuple(way.name for way in ways),
        values=tuple(way.value for way in ways),
        steps=tuple(way.step for way in ways),
        slopes=np.concatenate(parts, axis=2),
        switches=switches,
    )


def differences(
    model: Model,
    wind: Wind,
    parameter: str,
    *,
    controller: Controller | None = None,
    start: OperatingPoint | Start | None = None,
    step: float | None = None,
    **arguments: Any,
) -> tuple[Result, Result, float]:
    """The runs with a parameter one step below and above, and the step: what derivatives are checked with.

    Args:
      arguments: as in ``simulate``.
    """
    controller = controller or baseline(model.turbine.control)
    start = start or operating_point(model, wind)
    (way,) = directions(model, [parameter], controller, start, {} if step is None else {parameter: step})
    found = []
    for sign in (-1.0, 1.0):
        moved = {name: getattr(model, name) + sign * way.step * change for name, change in way.arrays.items()}

        def prepare(case: Case, size: float = sign * way.step) -> None:
            if way.state is not None:
                case.controller_state[way.state[0]] += size * way.state[1]

        run = Simulation(
            replace(model, **moved), wind, controller=controller, start=start, prepare=prepare, **arguments
        )
        march(run)
        found.append(run.result())
    return found[0], found[1], way.step


def directions(
    model: Model,
    parameters: Sequence[str],
    controller: Controller,
    start: OperatingPoint | Start,
    steps: Mapping[str, float],
) -> list[Direction]:
    """What each parameter changes.

    Raises:
      InputError: a parameter is unknown, named twice, or none is given.
    """
    if isinstance(parameters, str) or not parameters:
        raise InputError(f"sensitivity: parameters must be a list of at least one path, found {parameters!r}")
    for name in steps:
        if name not in parameters:
            raise InputError(
                f"sensitivity: a step for {name!r}, which is no parameter: {did_you_mean(name, parameters)}"
            )
    twice = {name for name in parameters if list(parameters).count(name) > 1}
    if twice:
        raise InputError(f"sensitivity: parameter {sorted(twice)[0]!r} is named twice")
    found = []
    for name in parameters:
        way = direction(model, name, controller)
        size = float(steps.get(name, way.step))
        if not 0.0 < size < np.inf:
            raise InputError(f"sensitivity: the step of {name!r} must be a positive number, found {size!r}")
        found.append(replace(way, step=size))
    return found


def direction(model: Model, name: str, controller: Controller) -> Direction:
    """What a parameter changes in a run.

    ``controller.NAME`` is an entry of the controller's state vector, of the baseline controller by name, of others by
    number; ``pitch_offset`` stands for those of all blades; ``structure.NAME``, ``aerodynamics.NAME`` and
    ``actuators.NAME`` are the parameters of ``Model.parameter_names``; ``turbine.PATH`` is an entry of the
    turbine's description, or a factor on it where it is a list of numbers.

    Raises:
      InputError: there is no such parameter.
    """
    if name == "pitch_offset":
        change = np.zeros_like(model.actuators)
        first = ACTUATOR.index("pitch_offset")
        change[first : first + MAX_BLADES] = 1.0
        return Direction(name, 0.0, STEPS[name], {"actuators": change})
    kind, _, rest = name.partition(".")
    if kind == "controller":
        return _of_controller(name, rest, model, controller)
    if kind == "turbine" and rest:
        return _of_turbine(name, rest, model)
    names = [*model.parameter_names(), "pitch_offset", *(f"controller.{row}" for row in BASELINE.names)]
    if name not in model.parameter_names():
        raise InputError(f"sensitivity: no parameter {name!r}: {did_you_mean(name, names)}")
    array, row = model.find_parameter(name)
    change = np.zeros_like(getattr(model, array))
    change[row] = 1.0
    value = model.parameter(name)
    step = STEPS["pitch_offset"] if "pitch_offset" in name else RELATIVE_STEP * abs(value)
    return Direction(name, value, step or RELATIVE_STEP, {array: change})


def _of_controller(name: str, entry: str, model: Model, controller: Controller) -> Direction:
    from meltemi.control.controller import StartPoint

    state = controller.initial_state(StartPoint(12.0, 1.0, 0.0, 0.0))
    rows = list(BASELINE.names) if controller.name == "baseline" else [str(i) for i in range(len(state))]
    if entry not in rows:
        raise InputError(
            f"sensitivity: the controller {controller.name!r} has no {entry!r}: {did_you_mean(entry, rows)}"
        )
    row = rows.index(entry)
    return Direction(name, float(state[row]), RELATIVE_STEP * (abs(float(state[row])) or 1.0), state=(row, 1.0))


def _of_turbine(name: str, path: str, model: Model) -> Direction:
    """Central differences of the model's tables, modes with matched signs."""
    target: Any = model.turbine
    for key in path.split("."):
        if isinstance(target, dict) and key in target:
            target = target[key]
        elif key in getattr(type(target), "model_fields", {}):
            target = getattr(target, key)
        else:
            known = target if isinstance(target, dict) else getattr(type(target), "model_fields", {})
            raise InputError(f"sensitivity: {name!r} leads nowhere at {key!r}: {did_you_mean(key, list(known))}")
    if isinstance(target, bool) or not isinstance(target, int | float | np.ndarray):
        raise InputError(f"sensitivity: {name!r} is no number and no list of numbers")
    factor = isinstance(target, np.ndarray)
    value = 1.0 if factor else float(target)
    step = TABLE_STEP * (abs(value) or 1.0)
    sides = []
    for sign in (-1.0, 1.0):
        moved = np.asarray(target) * (1.0 + sign * step) if factor else value + sign * step
        turbine = model.turbine.replace(**{path: moved.tolist() if isinstance(moved, np.ndarray) else moved})
        sides.append(matched(build(turbine, model.options, model.environment), model))
    arrays = {}
    for array in ARRAYS:
        low, high = (getattr(side, array) for side in sides)
        if low.shape != high.shape:
            raise InputError(f"sensitivity: {name!r} changes the layout of the model's table {array!r}")
        change = (high - low) / (2.0 * step)
        if np.any(change):
            arrays[array] = change
    return Direction(name, value, RELATIVE_STEP * (abs(value) or 1.0), arrays)


ARRAYS = (
    "structure blade_nodes blade_edges shape second modal tip_shape tip_second top_shape top_second tower_matrix "
    "tower_weight tower_nodes tower_shape aero aero_nodes polars section tower_flow actuators"
).split()
"""Arrays of a model that may change with the turbine."""


def matched(model: Model, reference: Model) -> Model:
    """A model whose modes have the signs of those of a reference: the sign of an eigenvector is anybody's choice."""
    signs = [
        np.where(
            np.einsum("knc,knc->k", getattr(model, m).modes.shape, getattr(reference, m).modes.shape) < 0, -1.0, 1.0
        )
        for m in ("blade", "tower")
    ]
    b, t = signs
    rows, pairs = np.repeat(b, 6), np.repeat(np.outer(b, b).reshape(-1), 3)
    t_rows, t_pairs = np.repeat(t, 6), np.outer(t, t)
    return replace(
        model,
        shape=model.shape * rows[:, None, None],
        second=model.second * pairs[:, None, None],
        modal=model.modal * np.outer(b, b),
        tip_shape=model.tip_shape * b,
        tip_second=model.tip_second * np.outer(b, b),
        top_shape=model.top_shape * t,
        top_second=model.top_second * t_pairs,
        tower_matrix=model.tower_matrix * t_pairs,
        tower_weight=model.tower_weight * t,
        tower_shape=model.tower_shape * t_rows[:, None],
    )


def seed(case: Case, ways: Sequence[Direction]) -> None:
    """Give the arrays of a case the derivatives by the parameters, for a step of each."""
    for k, way in enumerate(ways):
        for name, change in way.arrays.items():
            if name in CONSTANT:
                raise InputError(f"sensitivity: {way.name!r} changes {name}, which has no derivatives")
            if name in case.slopes:
                case.slopes[name][..., k] += way.step * change
        if way.state is not None:
            row, change_of_state = way.state
            case.slopes["controller_state"][row, k] += way.step * change_of_state


def count_switches(case: Case, controller: Controller) -> dict[str, int]:
    """Branches and limits that would have changed within a difference step (a controller's, of the baseline only)."""
    state = case.controller_state
    return {
        "controller": int(state[CONTROLLER_SWITCHES]) if controller.name == "baseline" else 0,
        "pitch limits": int(case["pitch"][PITCH.index("switches")].sum()),
        "stall": int(case["memory"][MEMORY.index("switches")].sum()),
    }
