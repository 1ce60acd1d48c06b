"""``gradient``: derivatives of one objective of a run by any number of parameters, by a discrete adjoint.

The run is marched once, with checkpoints. Then its segments are repeated, the last one first, by code that records what
the adjoint needs, and the adjoints are carried back over each by the adjoint of that code (``studies.reverse``).
Parameters are numbers in memory that never change, so the cost does not depend on their number.

Reference: docs/theory/adjoint.md (J-1 to J-5); Griewank & Walther (2008), Evaluating Derivatives, chapters 3, 4 and 12.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meltemi.compiler import OPTIONS, interpreted, is_ours, loose, njit, typeof, types
from meltemi.control.controller import Controller, of_vectors, update_with_derivatives
from meltemi.core.errors import InputError, UnsupportedError
from meltemi.core.shown import Brief
from meltemi.gradients.reverse.compiled import Compiled
from meltemi.gradients.reverse.memory import Memory
from meltemi.gradients.sensitivity import Direction, directions, refuse_moving_vortices, settled
from meltemi.simulation import step
from meltemi.simulation.case import SWEEPS, Case
from meltemi.simulation.result import Result
from meltemi.simulation.run import Run
from meltemi.simulation.simulate import Simulation
from meltemi.simulation.start import GEAR_SWEEPS, settle_gears

FEATURE = "gradients"
CONTROLLER = frozenset({"controller_state"})
Float = NDArray[np.float64]
Objective = Callable[[Result], tuple[float, Mapping[str, Any]]]
"""Gives the value of an objective and, by channel, its derivatives by the samples of the series (T,)."""
SEGMENT, CHECKPOINTS = 12, 256 << 20
"""Steps of a segment at least, and [bytes] of all checkpoints at most."""


@dataclass(frozen=True, repr=False)
class Gradient(Brief):
    """An objective of a run with its derivatives by parameters.

    Attributes:
      result: result of the run.
      value: value of the objective.
      parameters: names.
      values: values of the parameters; a factor on an array is 1.
      slopes: (parameters,) derivatives of the objective.
      seconds: [s] wall time of the march alone, and of march and adjoint, without compilation.
    """

    result: Result
    value: float
    parameters: tuple[str, ...]
    values: tuple[float, ...]
    slopes: Float = field(repr=False)
    seconds: tuple[float, float]


def gradient(run: Run, objective: Objective, parameters: Sequence[str]) -> Gradient:
    """Exact derivatives of an objective of a run by parameters; start, wind and times of events are held.

    Args:
      run: the arguments of :func:`simulate`.
      objective: function of the result; see ``Objective``.
      parameters: paths as of :func:`sensitivity`.

    Returns:
      The run, and the derivatives of its objective. At kinks they are those of the branch that was taken.

    Raises:
      InputError: a parameter or channel is unknown, or the controller has no derivatives.
      UnsupportedError: the turbine has an induction model or a near wake.
      RunError: the run did not reach its end.
    """
    if interpreted():
        raise InputError("gradient: derivatives need compiled kernels, and NUMBA_DISABLE_JIT is set")
    run, model, controller, start = settled(run)
    refuse_moving_vortices(model, "gradient")
    if not all(part.has_adjoint for part in model.parts):
        raise UnsupportedError("gradient: induction models have no derivatives in reverse; sensitivity has them")
    ways = directions(model, parameters, controller, start, {})
    found = gradients(run, lambda result: [objective(result)], ways)
    return Gradient(
        result=found.result,
        value=float(found.values[0]),
        parameters=tuple(way.name for way in ways),
        values=tuple(way.value for way in ways),
        slopes=found.slopes[0],
        seconds=found.seconds,
    )


@dataclass(frozen=True)
class Gradients:
    """Objectives of a run with their derivatives.

    Attributes:
      result: result of the run.
      values: (K,) objectives.
      slopes: (K, P) their derivatives along the directions.
      seconds: [s] wall time of the march alone, and of march and adjoints, without compilation.
    """

    result: Result
    values: Float
    slopes: Float
    seconds: tuple[float, float]


def gradients(
    run: Run,
    objectives: Callable[[Result], Sequence[tuple[float, Mapping[str, Any]]]],
    ways: Sequence[Direction],
    *,
    prepare: Callable[[Case], None] | None = None,
) -> Gradients:
    """Derivatives of several objectives of a run by directions; its steps are recorded once for all of them.

    Args:
      run: a run of which model, wind, controller and start are held (:func:`settled`).
      objectives: function of the result; see ``Objective``.
      ways: changes of the inputs by each parameter.
      prepare: callback with the case before its start is set.

    Raises:
      InputError: a channel is unknown, or the controller has no derivatives.
      RunError: the run did not reach its end.
    """
    before = _Before()
    simulation = Simulation(run, starting=before.take, prepare=prepare)
    back = Backwards(simulation, tables=any(way.arrays.keys() - CONTROLLER for way in ways))
    began = time.perf_counter()
    size = sum(array.nbytes for array in simulation.moving)
    steps = max(SEGMENT, -(-simulation.n_steps * size // CHECKPOINTS))
    checkpoints = []
    while not simulation.finished:
        checkpoints.append(tuple(array.copy() for array in simulation.moving))
        simulation.advance(steps)
    marched = time.perf_counter() - began
    result = simulation.result()
    result.raise_for_status()
    asked = objectives(result)
    for number, (_, weights) in enumerate(asked):
        back.weigh(result, weights, number)
    for n, checkpoint in reversed([*enumerate(checkpoints)]):
        back.segment(checkpoint, min(steps, simulation.n_steps - n * steps))
    back.start(before)
    return Gradients(
        result=result,
        values=np.array([value for value, _ in asked]),
        slopes=np.array([back.slopes(ways, number) for number in range(len(asked))]).reshape(len(asked), len(ways)),
        seconds=(marched, time.perf_counter() - began),
    )


class _Before:
    """The arrays of a case before the evaluations with which its run begins."""

    def take(self, case: Case, settles: bool) -> None:
        """Copy them; ``settles``: inflow and stall are settled by these evaluations."""
        self.sweeps = SWEEPS if settles else 0
        kept = (a for record in (case.control, case.system, case.sections) for a in record.arrays)
        self.arrays = [(a, a.copy()) for a in kept if a.dtype == np.float64]


class Backwards:
    """The adjoint of a run, segment by segment.

    Args:
      simulation: the run, before its first step.
      tables: whether derivatives by the model's tables are wanted, besides those by the controller's state.

    Attributes:
      memory: copies of the arrays of the run, with their adjoints.
      adjoints: adjoints of each objective, while those of another one are in the memory.
    """

    def __init__(self, simulation: Simulation, *, tables: bool) -> None:
        self.simulation = simulation
        self.code = _code(simulation, tables)
        self.memory = Memory(simulation.loop.records, self.code.used)
        self.adjoints = [self.memory.adjoints.copy()]
        self._present = 0
        self.moving = [self.memory.of(array) for array in simulation.moving]

    def weigh(self, result: Result, weights: Mapping[str, Any], number: int = 0) -> None:
        """Set the derivatives of an objective by the recorded samples."""
        while number >= len(self.adjoints):
            self.adjoints.append(np.zeros_like(self.memory.adjoints))
        self._take(number)
        adjoints = self.memory.of(self.simulation.loop.records[0].output, adjoint=True)
        for channel, by in weights.items():
            by = np.asarray(by, dtype=float)
            if by.shape != result.time.shape:
                raise InputError(f"gradient: {channel}: expected {len(result.time)} derivatives, found {by.shape}")
            adjoints[:, result.names.index(result.channel(channel).name)] += by
        for columns, sources, each in self.simulation.derivations():
            adjoints[:, sources] += adjoints[:, columns] @ each.matrix.T

    def segment(self, state: Sequence[Any], steps: int) -> None:
        """Carry the adjoints back over the steps that begin at a state."""
        for array, values in zip(self.moving, state, strict=True):
            array[...] = values
        self._back(steps, 0, 0)

    def start(self, before: _Before) -> None:
        """Carry the adjoints of the first state back over the evaluations with which the run begins."""
        for array, values in before.arrays:
            self.memory.of(array)[...] = values
        self._back(0, before.sweeps, GEAR_SWEEPS if self.simulation.case["gears"].size else 1)

    def _back(self, *numbers: int) -> None:
        self.memory.rewind()
        steps, *others = numbers
        self.code.forward(self.memory, steps, 0, *others)
        recorded = self.memory.recorded
        for number in range(len(self.adjoints)):  # beginning with the one that is there
            self._take((self._present + (number > 0)) % len(self.adjoints))
            self.memory.rewind(recorded)
            self.code.backward(self.memory, steps, 0, *others)

    def _take(self, number: int) -> None:
        """Put the adjoints of an objective into the memory."""
        if number != self._present:
            self.adjoints[self._present][...] = self.memory.adjoints
            self.memory.adjoints[...] = self.adjoints[number]
            self._present = number

    def slopes(self, ways: Sequence[Direction], number: int = 0) -> Float:
        """Derivatives of an objective by the parameters, once the start is reached."""
        self._take(number)
        memory = self.memory
        slopes, case = np.zeros(len(ways)), self.simulation.case
        for k, way in enumerate(ways):
            for name, change in way.arrays.items():
                array = case.controller_state if name == "controller_state" else case[name]
                slopes[k] += np.sum(memory.of(array, adjoint=True) * change)
            if way.state is not None:
                slopes[k] += memory.of(case.controller_state, adjoint=True)[way.state[0]] * way.state[1]
        return slopes


_march = loose(step.advance)


@loose
def _without_gears(m: Any) -> None:
    """Do nothing: a power-coefficient turbine has no gearbox."""


def _whole(gears: Any) -> Any:
    """The march of ``n_steps``, or for 0 steps the evaluations with which a run begins, as one function.

    The latter are those of ``Case.settle``, ``Case.begin_parts`` and ``start.begin``.
    """

    def whole(  # noqa: PLR0913 - the time loop's own arguments
        n_steps: int,
        controller: Any,
        sweeps: int,
        gear_sweeps: int,
        run: Any,
        c: Any,
        m: Any,
        one: Any,
        plain: Any,
        sections: Any,
    ) -> None:
        if n_steps > 0:
            _march(n_steps, controller, step.evaluate, step.observe, run, c, m, one, plain, sections)
            return
        for _ in range(sweeps):
            step.evaluate(0.0, 0.0, m)
            step.settle_inflow(m)
        if sweeps > 0:
            step.evaluate(0.0, 0.0, m)
        step.surroundings(0.0, c, m)
        step.begin_parts(c.settings.time_step, c, m)
        for _ in range(gear_sweeps):
            step.evaluate(0.0, 0.0, m)
            gears(m)
        step.observe(0.0, c, one, sections, True)
        for j in range(m.q.shape[0]):
            run.v_old[j], run.a_old[j] = m.v[j], m.a[j]

    return whole


_CODES: dict[Any, Compiled] = {}


def _code(simulation: Simulation, tables: bool) -> Compiled:
    """The march of a run and its start with their adjoints, compiled once for a controller and kind of turbine."""
    update = _entry(simulation.controller)
    records = simulation.loop.records
    has_gears = "gear_modes" in simulation.case.arrays
    kinds = [types.int64, typeof(update), types.int64, types.int64, *(typeof(r) for r in records)]
    arrays = Memory.numbers(records)
    key = (update, has_gears, tables, *kinds[4:], *arrays.items())
    if key not in _CODES:
        function = _whole(settle_gears if has_gears else _without_gears)
        law: Any = simulation.controller.update
        ours = all(is_ours(each.__module__) for each in (law, *map(type, records)))
        name = f"{law.__module__}.{law.__qualname__} {has_gears} {kinds[2:]}" if ours else ""
        _CODES[key] = Compiled(function, kinds, arrays, wanted=None if tables else CONTROLLER, name=name)
    return _CODES[key]


_ENTRIES: dict[Any, Any] = {}


def _entry(controller: Controller) -> Any:
    """The controller's update as a function that the march calls directly.

    Raises:
      InputError: the update is plain Python.
    """
    update = update_with_derivatives(controller)
    if update not in _ENTRIES:
        _ENTRIES[update] = njit(**OPTIONS)(of_vectors(update))
    return _ENTRIES[update]
