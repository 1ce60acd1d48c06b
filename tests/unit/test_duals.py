"""Duals against central differences and against the chain rule, written out.

A new operation is one line in ``OPERATIONS``: what kernels write, its two partial derivatives, and where it is tried.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numba
import numpy as np
import pytest
from kernel_arrays import call, row_by_row
from numpy.typing import NDArray

from meltemi.compiler import N_DERIVATIVES, crossed, floor, largest, total, where, whole
from meltemi.compiler.generic import zero

pytestmark = pytest.mark.skipif(bool(numba.config.DISABLE_JIT), reason="duals exist in compiled code only")

Float = NDArray[np.float64]
N = 200
H = 1e-5
"""Step of differences."""
K = N_DERIVATIVES
RNG = np.random.default_rng(12)


def run(function: Callable[..., Any], *arrays: Float, slopes: tuple[Float | None, ...] | None) -> None:
    """Call ``function`` with arrays that have derivatives where ``slopes`` has them; None: with floats."""
    call(function, *arrays, kind="floats" if slopes is None else "duals", slopes=slopes)


class Operation(NamedTuple):
    """An operation of kernels on x and y.

    Attributes:
      ours: what kernels write.
      by_x, by_y: its partial derivatives.
      x, y: ranges of the numbers it is tried at.
    """

    ours: Callable[[Any, Any], Any]
    by_x: Callable[[float, float], float]
    by_y: Callable[[float, float], float] = lambda x, y: 0.0
    x: tuple[float, float] = (-3.0, 3.0)
    y: tuple[float, float] = (0.2, 3.0)


OPERATIONS = {
    "add": Operation(lambda x, y: x + y, lambda x, y: 1.0, lambda x, y: 1.0),
    "subtract": Operation(lambda x, y: x - y, lambda x, y: 1.0, lambda x, y: -1.0),
    "multiply": Operation(lambda x, y: x * y, lambda x, y: y, lambda x, y: x),
    "square": Operation(lambda x, y: x * x, lambda x, y: 2.0 * x),
    "divide": Operation(lambda x, y: x / y, lambda x, y: 1.0 / y, lambda x, y: -x / y**2),
    "negative": Operation(lambda x, y: -x, lambda x, y: -1.0),
    "abs": Operation(lambda x, y: abs(x), lambda x, y: math.copysign(1.0, x)),
    "sqrt": Operation(lambda x, y: math.sqrt(y), lambda x, y: 0.0, lambda x, y: 0.5 / math.sqrt(y)),
    # plain numbers on either side
    "float + dual": Operation(lambda x, y: 2.5 + x, lambda x, y: 1.0),
    "dual + int": Operation(lambda x, y: x + 2, lambda x, y: 1.0),
    "float - dual": Operation(lambda x, y: 2.5 - x, lambda x, y: -1.0),
    "dual - int": Operation(lambda x, y: x - 2, lambda x, y: 1.0),
    "int * dual": Operation(lambda x, y: 3 * x, lambda x, y: 3.0),
    "dual * float": Operation(lambda x, y: x * 2.5, lambda x, y: 2.5),
    "float / dual": Operation(lambda x, y: 2.5 / y, lambda x, y: 0.0, lambda x, y: -2.5 / y**2),
    "int / dual": Operation(lambda x, y: 3 / y, lambda x, y: 0.0, lambda x, y: -3.0 / y**2),
    "dual / float": Operation(lambda x, y: x / 2.5, lambda x, y: 0.4),
    "dual / int": Operation(lambda x, y: x / 4, lambda x, y: 0.25),
    "nothing but a number": Operation(lambda x, y: 2.5, lambda x, y: 0.0),
    # choices: the derivative is that of the branch taken
    "min": Operation(lambda x, y: min(x, y), lambda x, y: float(x <= y), lambda x, y: float(y < x)),
    "max": Operation(lambda x, y: max(x, y), lambda x, y: float(x >= y), lambda x, y: float(y > x)),
    "min with float": Operation(lambda x, y: min(0.5, x), lambda x, y: float(x < 0.5)),
    "max with int": Operation(lambda x, y: max(x, 1), lambda x, y: float(x >= 1.0)),
    "where": Operation(lambda x, y: where(x > y, x * y, y), lambda x, y: y * (x > y), lambda x, y: x if x > y else 1.0),
    "where float": Operation(lambda x, y: where(x > y, 2.0, y), lambda x, y: 0.0, lambda x, y: float(x <= y)),
    "where int": Operation(lambda x, y: where(x <= y, x, 2), lambda x, y: float(x <= y)),
    "if": Operation(lambda x, y: x * x if x > 0.0 else y, lambda x, y: 2.0 * max(x, 0.0), lambda x, y: float(x <= 0.0)),
    "if mixed": Operation(lambda x, y: 1.0 if x > 0.0 else x, lambda x, y: float(x <= 0.0)),
    "less": Operation(lambda x, y: where(x < y, x, 0.0), lambda x, y: float(x < y)),
    "unequal": Operation(lambda x, y: where(x != y, x, 0.0), lambda x, y: 1.0),
    "equal to float": Operation(lambda x, y: where(x == 0.5, 7.0, x), lambda x, y: 1.0),
    "less or equal than int": Operation(lambda x, y: where(x <= 1, x, 0.0), lambda x, y: float(x <= 1.0)),
    "float greater or equal": Operation(lambda x, y: where(0.5 >= x, x, 0.0), lambda x, y: float(x <= 0.5)),  # noqa: SIM300
    # whole numbers have no slope
    "floor": Operation(lambda x, y: x - floor(x), lambda x, y: 1.0),
    "math.floor": Operation(lambda x, y: y * math.floor(x), lambda x, y: 0.0, lambda x, y: math.floor(x)),
    "whole": Operation(lambda x, y: y * whole(x), lambda x, y: 0.0, lambda x, y: int(x)),
    "total": Operation(lambda x, y: total(x * y), lambda x, y: y, lambda x, y: x),
    "largest": Operation(lambda x, y: largest(x * y), lambda x, y: y, lambda x, y: x),
    # elementary functions
    "sin": Operation(lambda x, y: math.sin(x), lambda x, y: math.cos(x)),
    "cos": Operation(lambda x, y: math.cos(x), lambda x, y: -math.sin(x)),
    "tan": Operation(lambda x, y: math.tan(x), lambda x, y: 1.0 / math.cos(x) ** 2, x=(-1.4, 1.4)),
    "exp": Operation(lambda x, y: math.exp(x), lambda x, y: math.exp(x)),
    "expm1": Operation(lambda x, y: math.expm1(x), lambda x, y: math.exp(x)),
    "log": Operation(lambda x, y: math.log(y), lambda x, y: 0.0, lambda x, y: 1.0 / y),
    "acos": Operation(lambda x, y: math.acos(x), lambda x, y: -1.0 / math.sqrt(1.0 - x * x), x=(-0.99, 0.99)),
    "tanh": Operation(lambda x, y: math.tanh(x), lambda x, y: 1.0 / math.cosh(x) ** 2),
    "sinh": Operation(lambda x, y: math.sinh(x), lambda x, y: math.cosh(x)),
    "cosh": Operation(lambda x, y: math.cosh(x), lambda x, y: math.sinh(x)),
    "atan2": Operation(
        lambda x, y: math.atan2(x, y),
        lambda x, y: y / (x * x + y * y),
        lambda x, y: -x / (x * x + y * y),
        y=(-3.0, 3.0),
    ),
    "atan2 of float": Operation(lambda x, y: math.atan2(2.0, x), lambda x, y: -2.0 / (4.0 + x * x)),
    "atan2 by int": Operation(lambda x, y: math.atan2(x, 2), lambda x, y: 2.0 / (4.0 + x * x)),
    "nested": Operation(
        lambda x, y: math.exp(math.sin(x * y)) / math.sqrt(1.0 + y * y),
        lambda x, y: math.exp(math.sin(x * y)) * math.cos(x * y) * y / math.sqrt(1.0 + y * y),
        lambda x, y: math.exp(math.sin(x * y)) * (math.cos(x * y) * x - y / (1.0 + y * y)) / math.sqrt(1.0 + y * y),
    ),
}


def applied(
    operations: Sequence[Callable[[Any, Any], Any]],
    x: Float,
    y: Float,
    dx: Float | None = None,
    dy: Float | None = None,
) -> Any:
    """(operations, N) values and (operations, N, K) derivatives at every pair of a row; without dx and dy of floats."""
    out, d_out = np.full(x.shape, 777.0), np.full((*x.shape, K), 777.0)
    run(row_by_row(operations), x, y, out, slopes=None if dx is None or dy is None else (dx, dy, d_out))
    return out, d_out


@pytest.fixture(scope="module")
def found() -> dict[str, tuple[Float, ...]]:
    """Of every operation: x, y, their derivatives, its values and derivatives, and its values as floats, there and
    along both senses of the first of the eight directions."""
    all_of = OPERATIONS.values()
    x, y = (np.array([RNG.uniform(*getattr(o, name), N) for o in all_of]) for name in ("x", "y"))
    dx, dy = RNG.normal(size=(2, *x.shape, K))
    ours = [o.ours for o in all_of]
    value, slopes = applied(ours, x, y, dx, dy)
    along = [np.concatenate([a, a + H * d[..., 0], a - H * d[..., 0]], axis=1) for a, d in ((x, dx), (y, dy))]
    plain = np.split(applied(ours, *along)[0], 3, axis=1)
    return dict(zip(OPERATIONS, zip(x, y, dx, dy, value, slopes, *plain, strict=True), strict=True))


@pytest.mark.slow
@pytest.mark.parametrize("name", OPERATIONS)
def test_chain_rule(name: str, found: dict[str, tuple[Float, ...]]) -> None:
    o, (x, y, *_) = OPERATIONS[name], found[name]
    # a step away from the corners of functions that have some
    away = np.minimum(np.abs(x - np.round(2.0 * x) / 2.0), np.abs(x - y)) > 1e-4
    x, y, dx, dy, value, slopes, plain, ahead, behind = (each[away] for each in found[name])
    np.testing.assert_allclose(value, plain, rtol=4e-16, atol=1e-300)
    pairs = list(zip(x.tolist(), y.tolist(), strict=True))
    by_x, by_y = (np.array([f(a, b) for a, b in pairs])[:, np.newaxis] for f in (o.by_x, o.by_y))
    size = np.abs(by_x * dx) + np.abs(by_y * dy)
    np.testing.assert_array_less(np.abs(slopes - (by_x * dx + by_y * dy)), 1e-12 * size + 1e-300)
    difference = (ahead - behind) / (2.0 * H)
    # where no corner of the function lies within the step
    smooth = np.abs(difference - slopes[:, 0]) < 1e-6 * (1.0 + np.abs(slopes[:, 0]))
    assert smooth.mean() > 0.97


@pytest.mark.slow
def test_conventions_where_the_slope_is_infinite_or_jumps() -> None:
    conventions = (
        (lambda x, y: math.sqrt(x), 0.0, 0.0, 0.0),
        (lambda x, y: math.acos(x), 1.0, 0.0, 0.0),
        (lambda x, y: math.acos(x), -1.0, math.pi, 0.0),
        (lambda x, y: abs(x), 0.0, 0.0, 1.0),
        (lambda x, y: min(x, 0.5), 0.5, 0.5, 1.0),
        (lambda x, y: min(0.5, x), 0.5, 0.5, 0.0),
        (lambda x, y: max(x, 0.5), 0.5, 0.5, 1.0),
        (lambda x, y: max(0.5, x), 0.5, 0.5, 0.0),
        (lambda x, y: math.atan2(x, y), 0.0, 0.0, 0.0),
    )
    operations, x, value, slope = zip(*conventions, strict=True)
    at = np.array(x)[:, np.newaxis]
    d = RNG.normal(size=(*at.shape, K))
    found, slopes = applied(operations, at, np.zeros_like(at), d, np.zeros_like(d))
    np.testing.assert_array_equal(found[:, 0], value)
    np.testing.assert_array_equal(slopes, np.array(slope)[:, np.newaxis, np.newaxis] * d)


def test_comparisons_look_at_values_alone() -> None:
    def compare(x: Any, y: Any, out: Any) -> None:
        for n in range(x.shape[0]):
            out[0, n] = where(x[n] < y[n], 1.0, 0.0)
            out[1, n] = where(x[n] <= y[n], 1.0, 0.0)
            out[2, n] = where(x[n] > y[n], 1.0, 0.0)
            out[3, n] = where(x[n] >= y[n], 1.0, 0.0)
            out[4, n] = where(x[n] == y[n], 1.0, 0.0)
            out[5, n] = where(x[n] != y[n], 1.0, 0.0)

    special = np.array([0.0, -0.0, 1.0, -1.0, np.inf, -np.inf, np.nan])
    x, y = (a.ravel() for a in np.meshgrid(special, special))
    out = np.zeros((6, len(x)))
    run(compare, x, y, out, slopes=(*RNG.normal(size=(2, len(x), K)), None))
    np.testing.assert_array_equal(out, [x < y, x <= y, x > y, x >= y, x == y, x != y])


def test_crossed_tells_a_switch_within_the_change() -> None:
    """One derivative larger than the distance is enough; their sign does not matter."""
    x = np.array([0.1, -0.1, 0.1, 0.1, 0.0, 0.0])
    d = np.zeros((6, K))
    d[0, 3], d[1, 7], d[2, 0], d[4, 1] = -0.2, 0.2, 0.05, 1e-9
    found, slopes = (each[0] for each in applied([lambda x, y: crossed(x)], x[None], x[None], d[None], d[None]))
    np.testing.assert_array_equal(found, [1.0, 1.0, 0.0, 0.0, 1.0, 0.0])
    assert not slopes.any()
    assert crossed(0.0) == 0.0


def test_reading_writing_and_in_place() -> None:
    def change(A: Any, B: Any, out: Any) -> None:
        for i in range(A.shape[0]):
            for j in range(A.shape[1]):
                B[i, j] = A[i, j]
                B[i, j] *= A[i, j]
                B[i, j] += 2
                B[i, j] -= 0.5 * A[i, j]
                B[i, j] /= 4.0
        out[0] = A[1, 2]
        out[1] = 7
        out[2] += A[0, 0]

    A, B, out = RNG.normal(size=(2, 3)), np.zeros((2, 3)), RNG.normal(size=4)
    dA, dB, d_out = RNG.normal(size=(2, 3, K)), np.zeros((2, 3, K)), RNG.normal(size=(4, K))
    before, d_before = out.copy(), d_out.copy()
    run(change, A, B, out, slopes=(dA, dB, d_out))
    np.testing.assert_allclose(B, (A * A + 2.0 - 0.5 * A) / 4.0, rtol=1e-15)
    np.testing.assert_allclose(dB, (2.0 * A - 0.5)[..., np.newaxis] * dA / 4.0, rtol=1e-12)
    np.testing.assert_array_equal(out, [A[1, 2], 7.0, before[2] + A[0, 0], before[3]])
    np.testing.assert_array_equal(d_out, [dA[1, 2], np.zeros(K), d_before[2] + dA[0, 0], d_before[3]])


def test_parts_of_arrays() -> None:
    def change(A: Any, out: Any) -> None:
        part = A[1]
        for i in range(part.shape[0]):
            row = part[i]
            for j in range(row.shape[0]):
                out[i, j] = row[j] + A[0, i, j]
                row[j] = 0.0

    A, out = RNG.normal(size=(2, 3, 4)), np.zeros((3, 4))
    dA, d_out = RNG.normal(size=(2, 3, 4, K)), np.zeros((3, 4, K))
    expected, d_expected = A.sum(axis=0), dA.sum(axis=0)
    kept, d_kept = A[0].copy(), dA[0].copy()
    run(change, A, out, slopes=(dA, d_out))
    np.testing.assert_array_equal(out, expected)
    np.testing.assert_array_equal(d_out, d_expected)
    np.testing.assert_array_equal(A, [kept, np.zeros((3, 4))])
    np.testing.assert_array_equal(dA, [d_kept, np.zeros((3, 4, K))])


@pytest.mark.parametrize("bounds", [(0, 5), (1, 3), (2, 2), (3, 99), (-2, 5)])
def test_slices_are_filled_and_copied(bounds: tuple[int, int]) -> None:
    first, last = bounds

    def fill(A: Any, B: Any, C: Any, x: Any) -> None:
        A[first:last] = x[0]
        B[first:last] = 0.0
        C[:] = A

    A, B, C = RNG.normal(size=(3, 5, 2))
    dA, dB, dC = RNG.normal(size=(3, 5, 2, K))
    x, dx = RNG.normal(size=1), RNG.normal(size=(1, K))
    expected = [a.copy() for a in (A, B, dA, dB)]
    for a, value in zip(expected, (x[0], 0.0, dx[0], 0.0), strict=True):
        a[first:last] = value
    run(fill, A, B, C, x, slopes=(dA, dB, dC, dx))
    for found, wanted in zip((A, B, dA, dB, C, dC), (*expected, expected[0], expected[2]), strict=True):
        np.testing.assert_array_equal(found, wanted)


def test_part_of_an_array_from_another() -> None:
    def copy(A: Any, B: Any) -> None:
        A[1:4] = B

    A, B = np.zeros((5, 2)), RNG.normal(size=(3, 2))
    dA, dB = np.zeros((5, 2, K)), RNG.normal(size=(3, 2, K))
    run(copy, A, B, slopes=(dA, dB))
    np.testing.assert_array_equal(A[1:4], B)
    np.testing.assert_array_equal(dA[1:4], dB)
    assert not A[[0, 4]].any() and not dA[[0, 4]].any()


def test_look_up_in_plain_arrays_is_linear_between_rows() -> None:
    table = RNG.normal(size=(3, 9)).astype(np.float32)

    def look(x: Any, table: Any, out: Any) -> None:
        for n in range(x.shape[0]):
            i = min(max(whole(x[n]), 0), table.shape[1] - 2)
            w = x[n] - i
            out[n] = (1.0 - w) * table[1, i] + w * table[1, i + 1]

    x, out = RNG.uniform(0.0, 8.0, N), np.zeros(N)
    dx, d_out = RNG.normal(size=(N, K)), np.zeros((N, K))
    run(look, x, table, out, slopes=(dx, None, d_out))
    row, i = table[1].astype(float), x.astype(int)
    np.testing.assert_allclose(out, np.interp(x, np.arange(9.0), row), rtol=1e-14, atol=1e-15)
    np.testing.assert_allclose(d_out, (row[i + 1] - row[i])[:, np.newaxis] * dx, rtol=1e-13, atol=1e-15)


def test_sums_begin_with_zero_of_their_kind() -> None:
    def running(x: Any, out: Any) -> None:
        s = zero(x)
        for n in range(x.shape[0]):
            s += x[n] * x[n]
        out[0] = s

    x, dx, out, d_out = RNG.normal(size=N), RNG.normal(size=(N, K)), np.zeros(1), np.zeros((1, K))
    run(running, x, out, slopes=(dx, d_out))
    assert out[0] == pytest.approx(x @ x, rel=1e-14)
    np.testing.assert_allclose(d_out[0], 2.0 * x @ dx, rtol=1e-12, atol=1e-12)


def test_an_array_without_derivatives_takes_values_only_from_floats() -> None:
    """A dual that is stored in a plain array would lose its derivatives: it does not compile."""

    def store(x: Any, out: Any) -> None:
        out[0] = x[0]

    with pytest.raises(numba.core.errors.TypingError):
        run(store, np.ones(1), np.zeros(1), slopes=(np.ones((1, K)), None))
