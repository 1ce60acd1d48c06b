"""``sensitivity``: exact derivatives of a simulation and its statistics with respect to parameters.

A simulation with dual numbers carries with every number its derivatives with respect to eight parameters. The result is
the derivative of the simulation between switches: where a limiter acts or a branch of the controller changes within the
step of a parameter, a finite change contains a part that no derivative describes. Such instants are counted
(``Sensitivity.switches``).

The start, the wind and the initial state of the controller are held.

Reference: docs/guide/sensitivities.md; docs/theory/fatigue.md (F-12 to F-15) for statistics.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meltemi.aero.tables import AeroMemory
from meltemi.compiler import MAX_BLADES, N_DERIVATIVES, interpreted
from meltemi.control.actuators import Actuators
from meltemi.control.baseline import BaselineController
from meltemi.control.controller import Controller, StartPoint
from meltemi.control.dual_updates import dual_entry
from meltemi.core.errors import InputError, MeltemiError, Status, UnsupportedError, did_you_mean
from meltemi.core.fingerprint import fingerprint
from meltemi.core.shown import Brief
from meltemi.gradients.extrapolation import STEP, extrapolated
from meltemi.gradients.weights import del_gradient, mean_gradient, std_gradient
from meltemi.simulation.bladed.rotor import BladedModel, BladedRotor
from meltemi.simulation.blades import blade_model
from meltemi.simulation.case import Case
from meltemi.simulation.model import Model
from meltemi.simulation.plan import first_point, step_of
from meltemi.simulation.points import initial_state
from meltemi.simulation.result import Result
from meltemi.simulation.rotors import build, kind_of
from meltemi.simulation.run import Run
from meltemi.simulation.simulate import Simulation, march
from meltemi.turbine.exchange import Drive, PitchMotion
from meltemi.wind.turbulent import realised

Float = NDArray[np.float64]

RELATIVE_STEP = 1e-4
"""Relative change of a parameter within which switches are counted."""
OFFSET_STEP = 1e-5
"""[rad] change of pitch offsets, which are usually zero, within which switches are counted."""
DIFFERENCE_STEP = 1e-3
"""Step of :func:`finite_difference_runs` over that: with a larger step the kinks of piecewise linear polars and wind
boxes appear in a difference, with a smaller one rounding errors."""


@dataclass(frozen=True)
class Direction:
    """Derivative of the inputs of a simulation with respect to a parameter.

    Attributes:
      name: path of the parameter.
      value: value of the parameter; 1 for factors.
      step: within which switches are counted.
      arrays: change of the model's arrays per unit of the parameter.
      state: (row, change) change of the controller state.
    """

    name: str
    value: float
    step: float
    arrays: dict[str, Float] = field(repr=False, default_factory=dict)
    state: tuple[int, float] | None = None


@dataclass(frozen=True, repr=False)
class Sensitivity(Brief):
    """A result with the derivatives of its time series.

    Attributes:
      result: result of the simulation.
      parameters: names.
      values: values of the parameters; a factor on an array is 1.
      steps: changes of the parameters within which switches are counted.
      slopes: (T, channels, parameters) derivatives of the series.
      switches: number of changes of a branch or limit within a step of a parameter, by place; None for a controller
        that does not count them.
    """

    result: Result
    parameters: tuple[str, ...]
    values: tuple[float, ...]
    steps: tuple[float, ...]
    slopes: Float = field(repr=False)
    switches: dict[str, int | None]

    def series(self, channel: str, *, skip: float = 0.0) -> tuple[Float, Float]:
        """Values (T,) of a channel from ``skip`` [s] on, and their derivatives (T, parameters).

        Raises:
          RunError: the run did not reach its end.
          InputError: the channel was not recorded, or less than two samples remain.
        """
        self.result.raise_for_status()
        column = self.result.names.index(self.result.channel(channel).name)
        after = self.result.time >= skip - 1e-9
        if np.count_nonzero(after) < 2:
            raise InputError(f"sensitivity: skip {skip:g} s leaves nothing of {self.result.time[-1]:g} s")
        return self.result.data[after, column], self.slopes[after, column]

    def mean(self, channel: str, *, skip: float = 0.0) -> tuple[float, Float]:
        """Mean of a channel from ``skip`` [s] on, and its derivatives (parameters,)."""
        return mean_gradient(*self.series(channel, skip=skip))

    def std(self, channel: str, *, skip: float = 0.0) -> tuple[float, Float]:
        """Standard deviation of a channel, and its derivatives (parameters,)."""
        return std_gradient(*self.series(channel, skip=skip))

    def fatigue(self, channel: str, slope: float, *, skip: float = 0.0, f_eq: float = 1.0) -> tuple[float, Float]:
        """Damage-equivalent load of a channel (ranges not binned), and its derivatives (parameters,).

        Args:
          slope: Woehler exponent.
          f_eq: [Hz] equivalent frequency.
        """
        series, slopes = self.series(channel, skip=skip)
        duration = float(self.result.time[-1] - self.result.time[-len(series)])
        return del_gradient(series, slopes, duration=duration, slope=slope, f_eq=f_eq)


def refuse_moving_vortices(model: Model[Any], analysis: str) -> None:
    """Check that an analysis has the derivatives of the turbine's wake.

    Raises:
      UnsupportedError: the turbine has a wake of moving vortices.
    """
    if any(part.settles for part in model.parts):
        raise UnsupportedError(
            f"{analysis}: a wake of moving vortices has no derivatives; use options.wake momentum"
            + (" or near" if analysis == "sensitivity" else "")
        )


def sensitivity(run: Run, parameters: Sequence[str], *, steps: Mapping[str, float] | None = None) -> Sensitivity:
    """Exact derivatives of a run by parameters; the times of events are held.

    Args:
      run: the arguments of :func:`simulate`.
      parameters: paths, see :func:`direction`. Eight cost little more than one; more are taken eight at a time.
      steps: changes by parameter for which switches are counted; by default 1e-4 of the value, 1e-5 rad for pitch
        offsets.

    Returns:
      The run and the derivatives. A run that diverges or whose controller fails ends early with a status.

    Raises:
      InputError: a parameter is unknown, or the controller has no derivatives.
      UnsupportedError: the turbine has a wake of moving vortices.
      KeyboardInterrupt: half the derivatives would be of no use.
    """
    if interpreted():
        raise InputError("sensitivity: derivatives need compiled kernels, and NUMBA_DISABLE_JIT is set")
    run, model, controller, start = settled(run)
    refuse_moving_vortices(model, "sensitivity")
    dual_entry(controller)  # refuses those that have no derivatives
    ways = directions(model, parameters, controller, start, steps or {})
    progress = run.progress
    switches: dict[str, int | None] = {}
    series_slopes: Float | None = None
    rounds = range(0, len(ways), N_DERIVATIVES)
    for number, first in enumerate(rounds):
        some = ways[first : first + N_DERIVATIVES]
        simulation = Simulation(run, numbers="duals", prepare=lambda case, some=some: seed(case, some))  # type: ignore[misc]
        march(simulation, None if progress is None else lambda s, n=number: progress((n + s) / len(rounds)))  # type: ignore[misc]
        if simulation.status is Status.INTERRUPTED:
            raise KeyboardInterrupt
        result = simulation.result()
        if series_slopes is None:
            series_slopes = np.empty((*result.data.shape, len(ways)))
        # derivatives were carried for a step of each parameter
        slopes = simulation.case.slopes["output"][: len(result.time), :, : len(some)]
        for k in range(len(some)):
            simulation.derive(slopes[..., k])
        slopes = slopes[:, : result.data.shape[1]]
        np.divide(slopes, [way.step for way in some], out=series_slopes[..., first : first + len(some)])
        for name, count in count_switches(simulation.case, controller).items():
            switches[name] = None if count is None else count + (switches.get(name) or 0)
    assert series_slopes is not None
    result.meta["parameters"] = {way.name: way.value for way in ways}
    return Sensitivity(
        result=result,
        parameters=tuple(way.name for way in ways),
        values=tuple(way.value for way in ways),
        steps=tuple(way.step for way in ways),
        slopes=series_slopes,
        switches=switches,
    )


def settled(run: Run) -> tuple[Run, Model[Any], Controller, StartPoint]:
    """A run whose model, wind, controller and start are held; with model, controller and the controller's start."""
    model = run.model() if callable(run.model) else run.model
    wind = realised(run.wind() if callable(run.wind) else run.wind, model.turbine, run.duration)
    controller = run.controller(wind) if callable(run.controller) else run.controller
    controller = controller or BaselineController(model.turbine)
    start, _ = initial_state(model, wind, run.start() if callable(run.start) else run.start)
    held_run = replace(run, model=model, wind=wind, controller=controller, start=start, events=tuple(run.events))
    return held_run, model, controller, first_point(model, wind, start)


def finite_difference_runs(run: Run, parameter: str, *, step: float | None = None) -> tuple[Result, Result, float]:
    """The runs with a parameter one step below and above, and the step: what derivatives are checked with.

    Args:
      run: the arguments of :func:`simulate`.
      parameter: path, see :func:`direction`.
      step: relative step, by default 1e-7 of the value, 1e-8 rad for pitch offsets: small, since polars and wind boxes
        have kinks.
    """
    run, model, controller, start = settled(run)
    (way,) = directions(model, [parameter], controller, start, {} if step is None else {parameter: step})
    size = way.step * (DIFFERENCE_STEP if step is None else 1.0)
    dt = step_of(run, model)
    options = model.options.replace(time_step=dt)
    weights = kind_of(model).step_weights(model, dt)  # constants of the time step, as with derivatives
    present, runs = tables(model), []
    for change in (-size, size):
        moved = {name: present[name] + change * array for name, array in way.arrays.items()}

        def prepare(case: Case, change: float = change) -> None:
            case["weights"][:2] = weights
            if way.state is not None:
                case.controller_state[way.state[0]] += change * way.state[1]

        changed = replace(with_tables(model, moved), options=options)
        simulation = Simulation(replace(run, model=changed), prepare=prepare)
        march(simulation)
        runs.append(simulation.result())
    return runs[0], runs[1], size


def directions(
    model: Model[Any],
    parameters: Sequence[str],
    controller: Controller,
    start: StartPoint,
    steps: Mapping[str, float],
) -> list[Direction]:
    """Derivatives of the inputs with respect to each parameter.

    Raises:
      InputError: a parameter is unknown or repeated, or there are none.
    """
    if isinstance(parameters, str) or not parameters:
        raise InputError(f"sensitivity: parameters must be a list of at least one path, found {parameters!r}")
    for name in steps:
        if name not in parameters:
            raise InputError(
                f"sensitivity: a step for {name!r}, which is not a parameter: {did_you_mean(name, parameters)}"
            )
    twice = {name for name in parameters if list(parameters).count(name) > 1}
    if twice:
        raise InputError(f"sensitivity: parameter {sorted(twice)[0]!r} is named twice")
    result = []
    for name in parameters:
        way = direction(model, name, controller, start)
        size = float(steps.get(name, way.step))
        if not 0.0 < size < np.inf:
            raise InputError(f"sensitivity: the step of {name!r} must be a positive number, found {size!r}")
        result.append(replace(way, step=size))
    return result


def direction(model: Model[Any], name: str, controller: Controller, start: StartPoint) -> Direction:
    """Derivative of the inputs of a simulation with respect to a parameter.

    ``controller.NAME`` is an entry of the controller's state vector by name, or by number if the controller gives no
    names; ``pitch_offset`` stands for those of all blades; ``structure.NAME``, ``aerodynamics.NAME`` and
    ``actuators.NAME`` are the parameters of ``Model.parameter_names``; ``turbine.PATH`` is a number in the turbine's
    description, or a factor on it where it is a list of numbers; ``turbine.airfoils.*.drag`` is one on those of all.

    Raises:
      InputError: there is no such parameter.
    """
    if name == "pitch_offset":
        change = np.zeros_like(model.actuators)
        first = Actuators.index("pitch_offset")
        change[first : first + MAX_BLADES] = 1.0
        return Direction(name, 0.0, OFFSET_STEP, {"actuators": change})
    kind, _, rest = name.partition(".")
    if kind == "turbine" and rest:
        return _of_turbine(name, rest, model)
    state = controller.initial_state(start)
    entries = [f"controller.{row}" for row in controller.state_names or range(len(state))]
    if name in entries:
        row = entries.index(name)
        value = float(state[row])
        return Direction(name, value, RELATIVE_STEP * (abs(value) or 1.0), state=(row, 1.0))
    if kind == "controller":
        raise InputError(f"sensitivity: {controller.name!r} has no {name!r}: {did_you_mean(name, entries)}")
    if name not in model.parameter_names():
        names = [*model.parameter_names(), "pitch_offset", *entries]
        hint = "; entries of the turbine's description are turbine.PATH" if kind in vars(model.turbine) else ""
        raise InputError(f"sensitivity: no parameter {name!r}: {did_you_mean(name, names)}{hint}")
    array, row = model.find_parameter(name)
    change = np.zeros_like(model.array(array))
    change[row] = 1.0
    value = model.parameter(name)
    step = OFFSET_STEP if "pitch_offset" in name else RELATIVE_STEP * (abs(value) or 1.0)
    return Direction(name, value, step, {array: change})


def _of_turbine(name: str, path: str, model: Model[Any]) -> Direction:
    """Extrapolated differences of the model's tables, with matched signs of the modes."""
    places = turbine_values(name, model.turbine, path.split("."))
    factor = all(isinstance(target, np.ndarray) for target in places.values())
    if not factor and (len(places) > 1 or not _is_number(*places.values())):
        raise InputError(f"sensitivity: {name!r} is neither a number nor a list of numbers")
    value = 1.0 if factor else float(next(iter(places.values())))

    def moved(change: float) -> Any:
        return model.turbine.replace(
            **{p: (t * (1.0 + change)).tolist() if factor else value + change for p, t in places.items()}
        )

    arrays, _ = table_slopes(name, model, moved, STEP * (abs(value) or 1.0))
    if not arrays:
        hint = "; parameters of the controller are controller.NAME" if path.startswith("control.") else ""
        raise InputError(f"sensitivity: {name!r} changes nothing in the model's tables{hint}")
    return Direction(name, value, RELATIVE_STEP * (abs(value) or 1.0), arrays)


class WithoutDerivatives(InputError):
    """A parameter changes what carries no derivatives."""


def table_slopes(
    name: str, model: Model[Any], moved: Callable[[float], Any], step: float
) -> tuple[dict[str, Float], float]:
    """Derivatives of a model's tables by a change of its turbine, and their relative error (:func:`extrapolated`).

    Args:
      name: of the parameter, for messages.
      model: the model without a change.
      moved: turbine for a change of the parameter.
      step: largest change.

    Raises:
      InputError: the parameter cannot be changed.
      WithoutDerivatives: it changes what carries no derivatives.
    """
    apart, present = _apart(model), tables(model)

    def changed(change: float) -> dict[str, Float]:
        try:
            side = build(moved(change), model.options, model.environment)
            side = matched(side, model) if isinstance(model.rotor, BladedRotor) else side
        except (ValueError, MeltemiError) as error:
            raise InputError(f"sensitivity: {name!r} cannot be changed by {change:g}: {error}") from None
        if _apart(side) != apart:
            raise WithoutDerivatives(
                f"sensitivity: {name!r} changes tables of the substructure or of the water, which carry no "
                "derivatives; compare two runs instead"
            )
        found = tables(side)
        for array, before in present.items():
            if found[array].shape != before.shape:
                raise WithoutDerivatives(f"sensitivity: {name!r} changes the layout of the model's table {array!r}")
        return found

    return extrapolated(changed, step)


def _is_number(target: Any) -> bool:
    return isinstance(target, int | float) and not isinstance(target, bool)


def turbine_values(name: str, target: Any, keys: Sequence[str], before: tuple[str, ...] = ()) -> dict[str, Any]:
    """Values in a turbine's description by path; ``*`` stands for every key of a mapping.

    Raises:
      InputError: a key is unknown; ``name`` is that of the parameter in the message.
    """
    if not keys:
        return {".".join(before): target}
    known = list(target) if isinstance(target, dict) else list(getattr(type(target), "model_fields", {}))
    if keys[0] != "*" and keys[0] not in known:
        raise InputError(f"sensitivity: {name!r} leads nowhere at {keys[0]!r}: {did_you_mean(keys[0], known)}")
    places: dict[str, Any] = {}
    for key in known if keys[0] == "*" else keys[:1]:
        inner = target[key] if isinstance(target, dict) else getattr(target, key)
        places |= turbine_values(name, inner, keys[1:], (*before, key))
    return places


def tables(model: Model[Any]) -> dict[str, Float]:
    """Arrays of a model that depend on the turbine's description."""
    arrays = {name: model.array(name) for name in kind_of(model).tables}
    arrays |= {name: a for part in model.parts for name, a in vars(part).items() if isinstance(a, np.ndarray)}
    return arrays | (model.rotor.blade_arrays if isinstance(model.rotor, BladedRotor) else {})


def _apart(model: Model[Any]) -> str | None:
    """Hash of what the parts of a model hold besides :func:`tables`, and which a run carries no derivatives of."""
    held = [each for part in model.parts for each in vars(part).values() if not isinstance(each, np.ndarray)]
    return fingerprint(*held)


def with_tables(model: Model[Any], changed: dict[str, Float]) -> Model[Any]:
    """The model with some of its :func:`tables` replaced."""
    if isinstance(model.rotor, BladedRotor):
        blades = {name: changed.get(name, array) for name, array in model.rotor.blade_arrays.items()}
        changed = {name: array for name, array in changed.items() if name not in blades}
        model = replace(model, rotor=replace(model.rotor, blade_arrays=blades))
    return model.with_arrays(**changed)


def matched(model: BladedModel, reference: BladedModel) -> BladedModel:
    """A model whose modes have the signs of those of a reference, since the sign of an eigenvector is arbitrary."""
    signs = [
        np.where(
            np.einsum("knc,knc->k", getattr(model.rotor, m).modes.shape, getattr(reference.rotor, m).modes.shape) < 0,
            -1.0,
            1.0,
        )
        for m in ("blade", "tower")
    ]
    b, t = signs
    rows, pairs = np.repeat(b, 6), np.repeat(np.outer(b, b).reshape(-1), 3)
    t_rows, t_pairs = np.repeat(t, 6), np.outer(t, t)
    r = model.rotor
    blade = replace(r.blade, modes=r.blade.modes.scaled(b))
    blade_arrays = blade_model(r.blade_model).arrays(model.turbine, blade, r.blade_layout)
    turned = replace(model, rotor=replace(r, blade_arrays=blade_arrays))
    return turned.with_arrays(
        shape=r.shape * rows[:, None, None],
        second=r.second * pairs[:, None, None],
        modal=r.modal * np.outer(b, b),
        tip_shape=r.tip_shape * b,
        tip_second=r.tip_second * np.outer(b, b),
        top_shape=r.top_shape * t,
        top_second=r.top_second * t_pairs,
        tower_matrix=r.tower_matrix * t_pairs,
        tower_weight=r.tower_weight * t,
        tower_shape=r.tower_shape * t_rows[:, None],
    )


def seed(case: Case, ways: Sequence[Direction]) -> None:
    """Give the arrays of a case the derivatives by the parameters, for a step of each."""
    for k, way in enumerate(ways):
        for name, change in way.arrays.items():
            case.slopes[name][..., k] += way.step * change
        if way.state is not None:
            row, change_of_state = way.state
            case.slopes["controller_state"][row, k] += way.step * change_of_state


def count_switches(case: Case, controller: Controller) -> dict[str, int | None]:
    """Number of branches and limits that would have changed within a step, by place."""
    names = controller.state_names
    return {
        "controller": int(case.controller_state[names.index("switches")]) if "switches" in names else None,
        "pitch limits": int(case["pitch"][PitchMotion.index("switches")].sum()),
        "yaw brake": int(case["drive"][Drive.index("yaw_switches")]),
        "stall": int(case["memory"][AeroMemory.index("switches")].sum()) if "memory" in case.arrays else 0,
    }
