"""Reverse differentiation of compiled code against the chain rule, written out, in floats and lanes."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Annotated, Any

import numba
import numpy as np
import pytest
from kernel_arrays import compiled
from test_duals import OPERATIONS

from meltemi.compiler import Array1, Array2, KernelRecord, Kind, held, reverse
from meltemi.compiler.records import NODES, Float
from meltemi.core.errors import InputError
from meltemi.gradients.reverse.compiled import Compiled
from meltemi.gradients.reverse.memory import Memory
from meltemi.maths.vectors import Vec

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(bool(numba.config.DISABLE_JIT), reason="there is no compiled code"),
]

N = 48
RNG = np.random.default_rng(5)
FLOATS_ONLY = ("if", "if mixed", "sinh", "cosh", "whole", "unequal", "nothing but a number", "total", "largest")
"""Operations that lanes do not have, or that differ there."""


class Numbers(KernelRecord):
    x: Annotated[Float, 2, NODES]
    y: Annotated[Float, 2, NODES]
    z: Annotated[Float, 2, NODES]


class Pair(KernelRecord):
    x: Array1
    z: Array2


def differentiated(function: Any, record: KernelRecord, **weights: Any) -> Memory:
    """Memory with adjoints, after ``function(n, record)`` and its adjoint for the weights of members."""
    kinds = [numba.types.int64, numba.typeof(record)]
    code = Compiled(function, kinds, Memory.numbers([record]), wanted=None)
    memory = Memory([record], code.used)
    for name, by in weights.items():
        memory.of(getattr(record, name), adjoint=True)[...] = by
    memory.rewind()
    code.forward(memory, 3)
    memory.longest = memory.recorded
    code.backward(memory, 3)
    assert memory.recorded == 0
    return memory


def every(functions: list[Callable[..., Any]]) -> Any:
    """Function that applies each of some operations to its row of arguments."""
    rows = "".join(f"\n        m.z[{k}, i] = f{k}(m.x[{k}, i], m.y[{k}, i])" for k in range(len(functions)))
    made: dict[str, Any] = {"__name__": __name__} | {f"f{k}": compiled(f) for k, f in enumerate(functions)}
    exec(f"def function(n, m):\n    for i in range(m.x.shape[1]):{rows}", made)
    return made["function"]


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["floats", "lanes"])
def test_derivatives_follow_the_chain_rule(kind: Kind) -> None:
    chosen = {n: o for n, o in OPERATIONS.items() if kind == "floats" or n not in FLOATS_ONLY}
    x, y = (np.array([RNG.uniform(*getattr(o, name), N) for o in chosen.values()]) for name in ("x", "y"))
    weights = RNG.uniform(-1.0, 1.0, x.shape)
    function = every([o.ours for o in chosen.values()])
    record = Numbers(kind, {"x": x, "y": y, "z": np.zeros_like(x)})
    memory = differentiated(function, record, z=weights)
    for k, (name, o) in enumerate(chosen.items()):
        values = [o.ours(a, b) for a, b in zip(x[k], y[k], strict=True)]
        np.testing.assert_allclose(memory.of(record.z)[k], values, rtol=1e-13, atol=1e-13, err_msg=name)
        for array, by in ((x, o.by_x), (y, o.by_y)):
            expected = weights[k] * [by(a, b) for a, b in zip(x[k], y[k], strict=True)]
            found = memory.of(array, adjoint=True)[k]
            np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-12, err_msg=name)
    assert not memory.of(record.z, adjoint=True).any()


def test_loops_branches_and_memory_that_changes() -> None:
    """A recurrence whose branches depend on its values, with numbers that are overwritten."""

    @compiled
    def map_of(a: float, b: float) -> float:
        if a > 0.4:
            return 3.2 * a * (1.0 - a) + 0.01 * b
        return a + 0.3 * math.sqrt(b)

    def function(n: int, m: Any) -> None:
        for j in range(n):
            total = 0.0
            for i in range(m.x.shape[0]):
                total += m.x[i] * m.x[i]
                m.x[i] = map_of(m.x[i], total)
            m.z[j, 0] = total
            if total > 1.0:
                m.z[j, 1] = math.exp(-total)

    start = np.array([0.3, 0.6, 0.1, 0.45])
    weights = RNG.uniform(-1.0, 1.0, (3, 2))

    def value(x: Any) -> float:
        record = Pair("floats", {"x": x.copy(), "z": np.zeros((3, 2))})
        function.__globals__["map_of"] = map_of
        function(3, record)
        return float(np.sum(weights * record.z))

    record = Pair("floats", {"x": start.copy(), "z": np.zeros((3, 2))})
    found = differentiated(function, record, z=weights).of(record.x, adjoint=True)
    h = 1e-6
    expected = [(value(start + h * e) - value(start - h * e)) / (2.0 * h) for e in np.eye(4)]
    np.testing.assert_allclose(found, expected, rtol=1e-7)


def test_a_held_solution_has_the_derivatives_of_its_last_steps() -> None:
    """x^3 = y by Newton's method: neither the way to the solution nor where it began is recorded (J-3a)."""

    @compiled
    def sides(x: Any, y: Any) -> Any:
        return Vec(x * x * x - y, 3.0 * x * x, 0.0)

    def solved(held_there: bool) -> Any:
        def function(n: int, m: Any) -> None:
            for i in range(m.x.shape[1]):
                x, y = m.x[0, i], m.y[0, i]
                for _ in range(30):
                    f = sides(x, y)
                    x -= f.x / f.y
                if held_there and reverse(x):
                    x = held(x)
                    slope = held(sides(x, y).y)
                    x -= sides(x, y).x / slope
                    x -= sides(x, y).x / slope
                m.z[0, i] = x

        return function

    x, y = RNG.uniform(0.5, 2.0, (1, N)), RNG.uniform(0.5, 2.0, (1, N))
    recorded = []
    for held_there in (True, False):
        record = Numbers("lanes", {"x": x, "y": y, "z": np.zeros_like(x)})
        memory = differentiated(solved(held_there), record, z=1.0)
        recorded.append(memory.longest)
        np.testing.assert_allclose(memory.of(y, adjoint=True), y ** (-2.0 / 3.0) / 3.0, rtol=1e-12)
        np.testing.assert_allclose(memory.of(x, adjoint=True), 0.0, atol=0.0 if held_there else 1e-12)
    assert recorded[0] < 0.2 * recorded[1]


def test_infinite_factors_in_branches_not_taken_do_no_harm() -> None:
    def function(n: int, m: Any) -> None:
        for i in range(m.x.shape[0]):
            x = m.x[i]
            m.z[0, i] = 2.0 * x if x == 0.0 else x * math.sqrt(x) / x

    record = Pair("floats", {"x": np.array([0.0, 4.0]), "z": np.zeros((1, 2))})
    found = differentiated(function, record, z=1.0).of(record.x, adjoint=True)
    np.testing.assert_allclose(found, [2.0, 0.25])


def test_what_has_no_derivative_is_an_error() -> None:
    def function(n: int, m: Any) -> None:
        m.z[0, 0] = math.erf(m.x[0])

    with pytest.raises(InputError, match="'erf', which has no derivative"):
        differentiated(function, Pair("floats", {"x": np.ones(1), "z": np.zeros((1, 1))}))
