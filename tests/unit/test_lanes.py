"""Lanes against Python's floats, lane by lane.

A new operation is one line in ``OPERATIONS``: what kernels write, what Python's floats give, and how far apart they
may be.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numba
import numpy as np
import pytest
from kernel_arrays import call, row_by_row
from numpy.typing import NDArray

from meltemi.compiler import WIDTH, Kind, anywhere, floor, largest, neighbours, total, where, whole
from meltemi.compiler.generic import split, two_to, zero
from meltemi.maths.vectors import Vec, cross, dot

pytestmark = pytest.mark.skipif(bool(numba.config.DISABLE_JIT), reason="lanes exist in compiled code only")

Float = NDArray[np.float64]
N = 40 * WIDTH
RNG = np.random.default_rng(11)
SPECIAL = np.array([0.0, -0.0, 1.0, -1.0, 0.5, -0.5, 2.0, 3.0, 1e300, -1e300, 1e-300, 5e-324, np.inf, -np.inf, np.nan])


def any_numbers() -> tuple[Float, Float]:
    """Pairs: all of the special values with each other, then random ones of all sizes, some of them equal."""
    x, y = (a.ravel() for a in np.meshgrid(SPECIAL, SPECIAL))
    few = N - len(x)
    sizes = RNG.choice([-1.0, 1.0], (2, few)) * 10.0 ** RNG.uniform(-8.0, 8.0, (2, few))
    sizes[1, :10] = sizes[0, :10]
    return np.concatenate([x, sizes[0]]), np.concatenate([y, sizes[1]])


def between(low: float, high: float, low_2: float = -3.0, high_2: float = 3.0) -> Callable[[], tuple[Float, Float]]:
    """Random pairs; the first number from one range, with both ends, the second from another."""

    def draw() -> tuple[Float, Float]:
        x, y = RNG.uniform(low, high, N), RNG.uniform(low_2, high_2, N)
        x[:2] = low, high
        return x, y

    return draw


def steps() -> tuple[Float, Float]:
    """Whole numbers and the numbers beside them."""
    k = np.arange(-(N // 6), N).astype(float)[: N // 3 + 1]
    return np.concatenate([k, np.nextafter(k, 1e9), np.nextafter(k, -1e9)])[:N], RNG.uniform(-9.0, 9.0, N)


class Operation(NamedTuple):
    """An operation of kernels on x and y.

    Attributes:
      ours: of lanes; its result is stored.
      python: the same of floats.
      numbers: draws x and y.
      ulp: [units in the last place] difference allowed.
    """

    ours: Callable[[Any, Any], Any]
    python: Callable[[float, float], float]
    numbers: Callable[[], tuple[Float, Float]] = any_numbers
    ulp: float = 0.0


def divided(x: float, y: float) -> float:
    return float(np.divide(x, y))


OPERATIONS = {
    "add": Operation(lambda x, y: x + y, lambda x, y: x + y),
    "subtract": Operation(lambda x, y: x - y, lambda x, y: x - y),
    "multiply": Operation(lambda x, y: x * y, lambda x, y: x * y),
    "divide": Operation(lambda x, y: x / y, divided),
    "negative": Operation(lambda x, y: -x, lambda x, y: -x),
    "abs": Operation(lambda x, y: abs(x), lambda x, y: abs(x)),
    "sqrt": Operation(lambda x, y: math.sqrt(x), lambda x, y: math.sqrt(x), between(0.0, 1e6)),
    "sqrt of a tiny": Operation(lambda x, y: math.sqrt(x), lambda x, y: math.sqrt(x), between(0.0, 1e-300)),
    # plain numbers on either side
    "float left": Operation(
        lambda x, y: 2.5 * x + (1.5 - y) / 3.0, lambda x, y: 2.5 * x + (1.5 - y) / 3.0, between(-9.0, 9.0), 4
    ),
    "int left": Operation(lambda x, y: 2 - x, lambda x, y: 2 - x),
    "int right": Operation(lambda x, y: x / 7, lambda x, y: x / 7, between(-9.0, 9.0), 1),  # may become x (1/7)
    "float by lanes": Operation(lambda x, y: 1.0 / x, lambda x, y: divided(1.0, x)),
    "int by lanes": Operation(lambda x, y: 3 / x, lambda x, y: divided(3.0, x)),
    "bool of numbers": Operation(lambda x, y: where(True, x, y), lambda x, y: x),
    # comparisons and logic
    "less": Operation(lambda x, y: where(x < y, 1.0, 0.0), lambda x, y: float(x < y)),
    "less or equal": Operation(lambda x, y: where(x <= y, 1.0, 0.0), lambda x, y: float(x <= y)),
    "greater": Operation(lambda x, y: where(x > y, 1.0, 0.0), lambda x, y: float(x > y)),
    "greater or equal": Operation(lambda x, y: where(x >= y, 1.0, 0.0), lambda x, y: float(x >= y)),
    "equal": Operation(lambda x, y: where(x == y, 1.0, 0.0), lambda x, y: float(x == y)),
    "unequal": Operation(lambda x, y: where(x != y, 1.0, 0.0), lambda x, y: float(x != y)),
    "against float": Operation(lambda x, y: where(x < 0.5, 1.0, 0.0), lambda x, y: float(x < 0.5)),
    "float against": Operation(lambda x, y: where(0.5 >= x, 1.0, 0.0), lambda x, y: float(x <= 0.5)),  # noqa: SIM300
    "against int": Operation(lambda x, y: where(x > 1, 1.0, 0.0), lambda x, y: float(x > 1)),
    "and": Operation(lambda x, y: where((x < 1.0) & (y < 1.0), 1.0, 0.0), lambda x, y: float(x < 1.0 and y < 1.0)),
    "or": Operation(lambda x, y: where((x < 1.0) | (y < 1.0), 1.0, 0.0), lambda x, y: float(x < 1.0 or y < 1.0)),
    "bool and mask": Operation(lambda x, y: where(True & (y < 1.0), 1.0, 0.0), lambda x, y: float(y < 1.0)),
    "mask or bool": Operation(lambda x, y: where((y < 1.0) | False, 1.0, 0.0), lambda x, y: float(y < 1.0)),
    # choices
    "min": Operation(lambda x, y: min(x, y), min),
    "max": Operation(lambda x, y: max(x, y), max),
    "min with float": Operation(lambda x, y: min(x, 0.5), lambda x, y: min(x, 0.5)),
    "max with int": Operation(lambda x, y: max(1, x), lambda x, y: max(1.0, x)),
    "within": Operation(lambda x, y: min(max(x, -1.0), 1.0), lambda x, y: min(max(x, -1.0), 1.0)),
    "where": Operation(lambda x, y: where(x > y, x, -y), lambda x, y: x if x > y else -y),
    "where int": Operation(lambda x, y: where(x > y, 2, y), lambda x, y: 2.0 if x > y else y),
    "where in where": Operation(
        lambda x, y: where(x > 0.0, where(y > 0.0, 1.0, 2.0), where(y > 0.0, 3.0, 4.0)),
        lambda x, y: (1.0 if y > 0.0 else 2.0) if x > 0.0 else (3.0 if y > 0.0 else 4.0),
    ),
    # integer parts
    "floor": Operation(lambda x, y: floor(x), lambda x, y: float(np.floor(x)), steps),
    "math.floor": Operation(lambda x, y: math.floor(x), lambda x, y: float(np.floor(x)), steps),
    "whole": Operation(lambda x, y: 0.0 + whole(x), lambda x, y: float(int(x)), steps),
    "places": Operation(
        lambda x, y: 0.5 * min(max(whole(x) + 3 - whole(y), -2), 7),
        lambda x, y: 0.5 * min(max(int(x) + 3 - int(y), -2), 7),
        steps,
    ),
    "product of places": Operation(
        lambda x, y: 0.0 + 3 * whole(x) * whole(y), lambda x, y: float(3 * int(x) * int(y)), steps
    ),
    "compared places": Operation(
        lambda x, y: 0.0 + where(whole(x) + 1 < whole(y), whole(x), 0),
        lambda x, y: float(int(x) if int(x) + 1 < int(y) else 0),
        steps,
    ),
    "fraction": Operation(lambda x, y: x - whole(x), lambda x, y: x - int(x), steps),
    # bits
    "two_to": Operation(lambda x, y: two_to(floor(x)), lambda x, y: 2.0 ** math.floor(x), between(-1022.0, 1023.0)),
    "mantissa": Operation(lambda x, y: split(x)[0], lambda x, y: split(x)[0], between(1e-300, 1e5)),
    "exponent": Operation(lambda x, y: split(x)[1], lambda x, y: split(x)[1], between(1e-300, 1e5)),
    # elementary functions: their own errors are measured in test_elementary, that of the C library's comes on top
    "exp": Operation(lambda x, y: math.exp(x), lambda x, y: math.exp(x), between(-700.0, 700.0), 3),
    "expm1": Operation(lambda x, y: math.expm1(x), lambda x, y: math.expm1(x), between(-50.0, 700.0), 4),
    "log": Operation(lambda x, y: math.log(x), lambda x, y: math.log(x), between(1e-3, 1e5), 3),
    "sin": Operation(lambda x, y: math.sin(x), lambda x, y: math.sin(x), between(-1e3, 1e3), 4),
    "cos": Operation(lambda x, y: math.cos(x), lambda x, y: math.cos(x), between(-1e3, 1e3), 4),
    "tan": Operation(lambda x, y: math.tan(x), lambda x, y: math.tan(x), between(-1e3, 1e3), 5),
    "tanh": Operation(lambda x, y: math.tanh(x), lambda x, y: math.tanh(x), between(-30.0, 30.0), 4),
    "acos": Operation(lambda x, y: math.acos(x), lambda x, y: math.acos(x), between(-1.0, 1.0), 3),
    "atan2": Operation(lambda x, y: math.atan2(x, y), lambda x, y: math.atan2(x, y), between(-3.0, 3.0), 4),
    "atan2 of float": Operation(
        lambda x, y: math.atan2(2.0, x), lambda x, y: math.atan2(2.0, x), between(-3.0, 3.0), 4
    ),
    "atan2 by int": Operation(lambda x, y: math.atan2(x, 3), lambda x, y: math.atan2(x, 3), between(-3.0, 3.0), 4),
}


def run(function: Callable[..., Any], *arrays: Float, of_nodes: tuple[int, ...], kind: Kind = "lanes") -> None:
    """Call ``function`` with arrays, some of them as arrays of lanes."""
    call(function, *arrays, kind=kind, nodes=of_nodes)


def applied(operations: Sequence[Callable[[Any, Any], Any]], x: Float, y: Float) -> Float:
    """Each operation at every pair of its row, by lanes."""
    out = np.full(x.shape, 777.0)
    run(row_by_row(operations), x, y, out, of_nodes=(0, 1, 2))
    return out


@pytest.fixture(scope="module")
def found() -> dict[str, tuple[Float, ...]]:
    """Of every operation: x, y, and its values."""
    x, y = np.array([operation.numbers() for operation in OPERATIONS.values()]).transpose(1, 0, 2)
    x, y = x.copy(), y.copy()
    values = applied([operation.ours for operation in OPERATIONS.values()], x, y)
    return dict(zip(OPERATIONS, zip(x, y, values, strict=True), strict=True))


@pytest.mark.slow
@pytest.mark.parametrize("name", OPERATIONS)
def test_lane_by_lane_as_python(name: str, found: dict[str, tuple[Float, ...]]) -> None:
    operation, (x, y, ours) = OPERATIONS[name], found[name]
    with np.errstate(all="ignore"):
        expected = np.array([operation.python(a, b) for a, b in zip(x.tolist(), y.tolist(), strict=True)])
        if not operation.ulp:
            np.testing.assert_array_equal(ours, expected)
        else:
            worst = float(
                np.max(np.abs(ours - expected) / np.spacing(np.maximum(np.abs(expected), sys.float_info.min)))
            )
            assert worst <= operation.ulp


def test_in_place_operations() -> None:
    def change(x: Any, out: Any) -> None:
        for n in range(x.shape[1]):
            out[0, n] += x[0, n]
            out[0, n] *= 2.0
            out[0, n] -= 1
            out[0, n] /= x[0, n]
            out[1, n] = 7
            out[2, n] = 0.5

    x, out = RNG.uniform(1.0, 2.0, (1, N)), RNG.uniform(1.0, 2.0, (4, N))
    before = out.copy()
    run(change, x, out, of_nodes=(0, 1))
    np.testing.assert_allclose(out[0], ((before[0] + x[0]) * 2.0 - 1.0) / x[0], rtol=4e-16)
    assert np.all(out[1] == 7.0) and np.all(out[2] == 0.5)
    np.testing.assert_array_equal(out[3], before[3])


def test_sums_over_lanes() -> None:
    def sums(x: Any, mixed: Any, out: Any) -> None:
        running = zero(x)
        for n in range(x.shape[1]):
            running += x[0, n]
            out[0, n] = total(x[0, n])
            out[1, n] = largest(x[0, n])
            out[2, n] = 1.0 if anywhere(x[0, n] > 1.9) else 0.0
            out[3, n] = largest(x[0, n] * mixed[0, n])
        out[4, 0] = total(running)

    x, mixed = RNG.uniform(1.0, 2.0, (1, N)), RNG.choice([-1.0, 1.0], (1, N))
    out = np.zeros((5, N // WIDTH))
    run(sums, x, mixed, out, of_nodes=(0, 1))
    groups = x.reshape(-1, WIDTH)
    np.testing.assert_allclose(out[0], groups.sum(axis=1), rtol=1e-15)
    np.testing.assert_array_equal(out[1], groups.max(axis=1))
    np.testing.assert_array_equal(out[2], (groups > 1.9).any(axis=1))
    assert 0.0 < out[2].mean() < 1.0
    np.testing.assert_array_equal(out[3], (groups * mixed.reshape(-1, WIDTH)).max(axis=1))
    assert out[4, 0] == pytest.approx(x.sum(), rel=1e-14)


def test_a_plain_number_is_its_own_sum() -> None:
    assert (total(2.5), largest(-2.5), anywhere(True), zero(np.ones(3))) == (2.5, -2.5, True, 0.0)


@pytest.mark.slow
@pytest.mark.parametrize("kind", [np.float64, np.float32])
@pytest.mark.parametrize("ndim", [1, 2, 3, 4])
def test_look_up_in_plain_arrays(ndim: int, kind: Any) -> None:
    """Every axis by eight places, by one for all, and by sums of both."""
    shape = (7, 5, 4, 3)[:ndim]
    table = RNG.uniform(-1.0, 1.0, shape).astype(kind)
    places = np.stack([RNG.uniform(0.0, n - 1e-9, N) for n in shape])

    def one(at: Any, table: Any, out: Any) -> None:
        for n in range(at.shape[1]):
            out[0, n] = table[(whole(at[0, n]),)]
            out[1, n] = table[(min(whole(at[0, n]) + 1, 6),)]

    def two(at: Any, table: Any, out: Any) -> None:
        for n in range(at.shape[1]):
            out[0, n] = table[whole(at[0, n]), whole(at[1, n])]
            out[1, n] = table[2, whole(at[1, n])]

    def three(at: Any, table: Any, out: Any) -> None:
        for n in range(at.shape[1]):
            out[0, n] = table[whole(at[0, n]), whole(at[1, n]), whole(at[2, n])]
            out[1, n] = table[whole(at[0, n]), 1, whole(at[2, n])]

    def four(at: Any, table: Any, out: Any) -> None:
        for n in range(at.shape[1]):
            out[0, n] = table[whole(at[0, n]), whole(at[1, n]), whole(at[2, n]), whole(at[3, n])]
            out[1, n] = table[whole(at[0, n]), whole(at[1, n]), whole(at[2, n]), 2]

    out = np.zeros((2, N))
    run((one, two, three, four)[ndim - 1], places, table, out, of_nodes=(0, 2))
    i = [p.astype(int) for p in places]
    other: tuple[Any, ...] = {
        1: lambda: (np.minimum(i[0] + 1, 6),),
        2: lambda: (2, i[1]),
        3: lambda: (i[0], 1, i[2]),
        4: lambda: (i[0], i[1], i[2], 2),
    }[ndim]()
    np.testing.assert_array_equal(out[0], table[tuple(i)])
    np.testing.assert_array_equal(out[1], table[other])


def test_what_is_no_number_does_not_lead_out_of_a_table() -> None:
    def look(at: Any, table: Any, out: Any) -> None:
        for n in range(at.shape[1]):
            out[0, n] = table[0, min(max(whole(at[0, n]), 0), 4)]

    at, table, out = np.full((1, WIDTH), np.nan), np.arange(5.0).reshape(1, 5), np.full((1, WIDTH), -1.0)
    at[0, 1:4] = np.inf, -np.inf, 1e300
    run(look, at, table, out, of_nodes=(0, 2))
    assert np.isin(out, table).all()


def test_reading_and_writing_in_all_dimensions() -> None:
    def copy(a: Any, b: Any, to_a: Any, to_b: Any) -> None:
        for i in range(a.shape[0]):
            for n in range(a.shape[1]):
                to_a[i, n] = a[i, n]
            for j in range(b.shape[1]):
                for n in range(b.shape[2]):
                    to_b[i, j, n] = b[i, j, n]

    a, b = RNG.uniform(size=(2, 24)), RNG.uniform(size=(2, 3, 16))
    to_a, to_b = np.zeros_like(a), np.zeros_like(b)
    run(copy, a, b, to_a, to_b, of_nodes=(0, 1, 2, 3))
    np.testing.assert_array_equal(to_a, a)
    np.testing.assert_array_equal(to_b, b)


def test_shape_counts_groups() -> None:
    def shapes(a: Any, out: Any) -> None:
        out[0], out[1], out[2] = a.shape[0], a.shape[1], a.shape[2]

    out = np.zeros(3)
    run(shapes, np.zeros((2, 3, 32)), out, of_nodes=(0,))
    assert out.tolist() == [2.0, 3.0, 32.0 / WIDTH]


def nodes_kernel(A: Any, box: Any, out: Any) -> None:
    """A little of everything that kernels do to nodes, with arithmetic only: nothing that lanes may round otherwise."""
    for b in range(A.shape[1]):
        running = Vec(0.0, 0.0, 0.0)
        for n in range(A.shape[2]):
            x, y = Vec(A[0, b, n], A[1, b, n], A[2, b, n]), Vec(A[3, b, n], A[4, b, n], A[5, b, n])
            z = cross(x, y)
            size = math.sqrt(dot(z, z))
            place = min(max(whole(4.0 * abs(x.x)), 0), box.shape[1] - 2)
            w = 4.0 * abs(x.x) - place
            # single precision meets double before it meets itself: floats would compute the sum in single
            looked = (1.0 - w) * box[b, place] + w * box[b, place + 1]
            bounded = min(max(size / max(abs(looked), 0.01), -3.0), 3.0)
            if anywhere(bounded > 2.0):
                bounded = where(bounded > 2.0, 2.0 + 0.1 * (bounded - 2.0), bounded)
            running += bounded * z
            out[0, b, n], out[1, b, n], out[2, b, n] = running.x, running.y, running.z
            out[3, b, n] = bounded


@pytest.mark.slow
def test_floats_and_lanes_agree_to_the_last_bit_in_arithmetic() -> None:
    A, box = RNG.normal(size=(6, 3, 16)), RNG.normal(size=(3, 10)).astype(np.float32)
    by_lanes, by_floats = np.zeros((4, 3, 16)), np.zeros((4, 3, 16))
    run(nodes_kernel, A, box, by_lanes, of_nodes=(0, 2))
    # the running sums of a lane go over every eighth node: for floats, each lane is a blade of two nodes
    some = np.zeros((4, 3 * WIDTH, 2))
    apart = A.reshape(6, 3, 2, WIDTH).swapaxes(2, 3).reshape(6, 3 * WIDTH, 2)
    run(nodes_kernel, apart, np.repeat(box, WIDTH, axis=0), some, of_nodes=(0, 2), kind="floats")
    by_floats[:] = some.reshape(4, 3, WIDTH, 2).swapaxes(2, 3).reshape(4, 3, 16)
    np.testing.assert_array_equal(by_lanes, by_floats)
    assert (by_lanes[3] > 2.0).any() and (by_lanes[3] < 2.0).any()


@pytest.mark.parametrize(
    "wrong",
    [
        lambda x: 1.0 if x > 0.0 else 2.0,
        lambda x: x if x > 0.0 and x < 1.0 else -x,
        lambda x: -x if not x > 0.0 else x,
        lambda x: float(x),
        lambda x: x**2,
    ],
)
def test_what_lanes_cannot_do_does_not_compile(wrong: Callable[[Any], Any]) -> None:
    with pytest.raises(numba.core.errors.TypingError):
        applied([lambda x, y: wrong(x)], *np.ones((2, 1, WIDTH)))


def test_neighbours_in_a_box() -> None:
    box = RNG.normal(size=(3, 4, 5, 3)).astype(np.float32)
    places = RNG.integers(0, (3, 4, 4), (N, 3))
    places[0], places[-1] = 0, (2, 3, 3)
    i, k, j = (p.astype(float).reshape(1, -1) for p in places.T)

    def every(box: Any, i: Any, k: Any, j: Any, out: Any) -> None:
        for n in range(i.shape[1]):
            found = neighbours(box, whole(i[0, n]), whole(k[0, n]), whole(j[0, n]))
            for c in range(6):
                out[c, n] = found[c]

    out = np.full((6, N), 777.0)
    run(every, box, i, k, j, out, of_nodes=(1, 2, 3, 4))
    expected = np.array([[*box[i, k, j], *box[i, k, j + 1]] for i, k, j in places]).T
    np.testing.assert_array_equal(out, expected)
