"""``gradient``: derivatives of one objective of a run by any number of parameters, by a discrete adjoint.

The time loop is run forward in lanes, with checkpoints; then every step, the last one first, is repeated with taped
numbers, and the adjoints of its results are carried back to the state at its beginning. Parameters are states that
never change, so the cost does not depend on their number.

Reference: docs/theory/adjoint.md (J-1 to J-6); Griewank & Walther (2008), Evaluating Derivatives, chapters 3, 4 and 12.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import InputError
from meltemi.core.kernel import kernel
from meltemi.core.representation import Brief
from meltemi.numbers.tape import Tape
from meltemi.simulation.case import Case
from meltemi.simulation.result import Result
from meltemi.simulation.run import Run
from meltemi.simulation.simulate import Simulation
from meltemi.studies.sensitivity import Direction, directions, settled

Float = NDArray[np.float64]
Objective = Callable[[Result], tuple[float, Mapping[str, Any]]]
"""Gives the value of an objective and, by channel, its derivatives by the samples of the series (T,)."""
STATES = ("signals", "aero_state", "v_old", "a_old", "controller_state", "weights", "faults", "measured")
"""Arrays that carry derivatives from one step to the next."""


@dataclass(frozen=True, repr=False)
class Gradient(Brief):
    """An objective of a run with its derivatives by parameters.

    Attributes:
      result: of the run.
      value: of the objective.
      parameters: names.
      values: of the parameters; a factor on an array is 1.
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
      RunError: the run did not reach its end.
    """
    if numba.config.DISABLE_JIT:
        raise InputError("gradient: derivatives need compiled kernels, and NUMBA_DISABLE_JIT is set")
    run, model, controller, start = settled(run)
    ways = directions(model, parameters, controller, start, {})
    tape = Tape()
    leaves = _Leaves(tape, ways)
    fast, slow = Simulation(run), Simulation(run, numbers="taped", prepare=leaves.begin)
    back = _Backwards(fast, slow, tape, leaves)
    began = time.perf_counter()
    spacing = max(math.isqrt(fast.n_steps), 1)
    checkpoints = []
    while not fast.finished:
        checkpoints.append(tuple(array.copy() for array in fast.moving))
        fast.advance(spacing)
    marched = time.perf_counter() - began
    result = fast.result()
    result.raise_for_status()
    value, weights = objective(result)
    back.weigh(result, weights)
    for checkpoint in reversed(checkpoints):
        back.segment(checkpoint, spacing)
    slopes = back.parameters()
    return Gradient(
        result=result,
        value=float(value),
        parameters=tuple(way.name for way in ways),
        values=tuple(way.value for way in ways),
        slopes=slopes,
        seconds=(marched, time.perf_counter() - began),
    )


class _Leaves:
    """The parameters at the beginning of the tape."""

    def __init__(self, tape: Tape, ways: Sequence[Direction]) -> None:
        self.tape, self.ways = tape, ways
        names = {name for way in ways for name in way.arrays}
        self.arrays = sorted(names | {"controller_state" for way in ways if way.state is not None})
        self.first: dict[str, int] = {}

    def begin(self, case: Case) -> None:
        """Make the entries of the parameters' arrays variables."""
        for name in self.arrays:
            places = case.slopes[name].view(np.int64).reshape(-1)
            self.first[name] = self.tape.count
            places[:] = np.arange(self.tape.count, self.tape.count + len(places))
            self.tape.count += len(places)
        self.end = self.tape.count

    def slopes(self, case: Case) -> Float:
        """Derivatives by the parameters from the adjoints of their arrays."""
        found = np.zeros(len(self.ways))
        by = {n: self.tape.adjoints[at : at + case.slopes[n].size].copy() for n, at in self.first.items()}
        self.tape.adjoints[: self.end] = 0.0
        for k, way in enumerate(self.ways):
            for name, change in way.arrays.items():
                found[k] += by[name] @ change.reshape(-1)
            if way.state is not None:
                found[k] += by["controller_state"][way.state[0]] * way.state[1]
        return found


class _Backwards:
    """Steps of a run repeated in reverse order with taped numbers.

    Args:
      fast: the run in lanes.
      slow: the same run in taped numbers, at its start.
    """

    def __init__(self, fast: Simulation, slow: Simulation, tape: Tape, leaves: _Leaves) -> None:
        self.fast, self.slow, self.tape, self.leaves = fast, slow, tape, leaves
        names = [name for name in STATES if name in slow.case.slopes]
        names += [name for name in leaves.arrays if name not in names]
        self.places = [slow.case.slopes[name].view(np.int64).reshape(-1) for name in names]
        self.begin = [places.copy() for places in self.places]
        self.end_of_start = tape.count
        self.adjoints = [np.zeros(len(places)) for places in self.places]
        self.output = slow.case.slopes["output"].view(np.int64)[..., 0]
        arenas = [(getattr(fast.case, n), getattr(slow.case, n)) for n in ("signals", "aero_state")]
        self.gather = [_positions(fast.case, *arena) for arena in arenas]

    def weigh(self, result: Result, weights: Mapping[str, Any]) -> None:
        """Set the derivatives of the objective by the recorded samples."""
        self.weights = np.zeros(self.output.shape)
        for channel, by in weights.items():
            by = np.asarray(by, dtype=float)
            if by.shape != result.time.shape:
                raise InputError(f"gradient: {channel}: expected {len(result.time)} derivatives, found {by.shape}")
            self.weights[:, result.names.index(result.channel(channel).name)] += by

    def segment(self, checkpoint: tuple[Any, ...], steps: int) -> None:
        """March from a checkpoint once more, and carry the adjoints back over its steps."""
        fast = self.fast
        for array, values in zip(fast.moving, checkpoint, strict=True):
            array[...] = values
        states: list[tuple[Any, ...]] = []
        while len(states) < steps and not fast.finished:
            states.append(tuple(array.copy() for array in fast.moving))
            fast.advance(1)
        for state in reversed(states):
            self.step(state)

    def step(self, state: tuple[Any, ...]) -> None:
        """Carry the adjoints back over the step that begins at a state."""
        tape, slow = self.tape, self.slow
        signals, aero_state, *others = slow.moving
        signals[...], aero_state[...] = (v[at] for v, at in zip(state, self.gather, strict=False))
        for array, values in zip(others, state[2:], strict=True):
            array[...] = values
        row, first = int(slow.case.clock.row), self.end_of_start
        end = first
        for places in self.places:
            places[:] = np.arange(end, end + len(places))
            end += len(places)
        tape.count = end
        slow.advance(1)
        for places, adjoints in zip(self.places, self.adjoints, strict=True):
            collect(places, adjoints, tape.adjoints)
        if slow.case.clock.row > row:
            collect(self.output[row], self.weights[row], tape.adjoints)
        tape.sweep(end)
        at = first
        for adjoints in self.adjoints:
            adjoints[:] = tape.adjoints[at : at + len(adjoints)]
            at += len(adjoints)
        tape.adjoints[first:end] = 0.0

    def parameters(self) -> Float:
        """Carry the adjoints of the first state back to the parameters; returns their derivatives."""
        self.tape.count = self.end_of_start
        for places, adjoints in zip(self.begin, self.adjoints, strict=True):
            collect(places, adjoints, self.tape.adjoints)
        self.tape.sweep(self.leaves.end)
        return self.leaves.slopes(self.slow.case)


@kernel
def collect(places: Any, by: Float, adjoints: Float) -> None:
    """Add derivatives by numbers to the adjoints of their places."""
    for i in range(places.shape[0]):
        adjoints[places[i]] += by[i]


def _positions(case: Case, fast: Any, slow: Any) -> Any:
    """Index in the vector of a case in lanes of each entry of that in taped numbers."""
    result = np.zeros(slow.vector.size, dtype=np.int64)
    indices = {name: fast.begin[name] + np.arange(view.size).reshape(view.shape) for name, view in fast.views.items()}
    shown = case.model.rotor.shown(indices)
    for name, view in slow.views.items():
        at = slow.begin[name]
        result[at : at + view.size] = shown[name].reshape(-1)
    return result
