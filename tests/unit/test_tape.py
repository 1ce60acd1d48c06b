"""Taped numbers against the chain rule: the operations of duals, swept in reverse."""

from __future__ import annotations

from typing import Any

import numba
import numpy as np
import pytest
from kernel_arrays import call, compiled
from numpy.typing import NDArray
from test_duals import OPERATIONS

from meltemi.core.errors import MeltemiError
from meltemi.numbers.tape import CAPACITY, Tape

pytestmark = pytest.mark.skipif(bool(numba.config.DISABLE_JIT), reason="taped numbers exist in compiled code only")

Float = NDArray[np.float64]
N = 50
RNG = np.random.default_rng(5)


def places(first: int, n: int = N) -> Float:
    """Places on the tape from ``first`` on, in the words of an array of floats."""
    return np.arange(first, first + n).view(np.float64).reshape(n, 1)


@pytest.mark.parametrize("name", OPERATIONS)
def test_derivatives_follow_the_chain_rule(name: str) -> None:
    each = OPERATIONS[name]
    ours, tape = compiled(each.ours), Tape()
    x, y, z, weights = (RNG.uniform(low, high, N) for low, high in (each.x, each.y, (0.0, 1.0), (-1.0, 1.0)))

    def function(x: Any, y: Any, z: Any) -> None:
        for i in range(x.shape[0]):
            z[i] = ours(x[i], y[i])

    tape.count = 2 * N + 1
    made = places(0)
    call(function, x, y, z, kind="taped", slopes=[places(1), places(N + 1), made])
    tape.adjoints[made.view(np.int64)[:, 0]] = weights
    tape.sweep(2 * N + 1)
    by = np.array([[each.by_x(a, b), each.by_y(a, b)] for a, b in zip(x, y, strict=True)]).T
    found = tape.adjoints[1 : 2 * N + 1].reshape(2, N)
    np.testing.assert_allclose(found, by * weights, rtol=1e-12, atol=1e-12)
    assert not tape.adjoints[2 * N + 1 :].any()


def test_constants_leave_no_entry_and_a_full_tape_is_an_error() -> None:
    tape = Tape()

    def function(x: Any, z: Any) -> None:
        for i in range(x.shape[0]):
            z[i] = x[i] * x[i] + 3.0

    made = places(1)
    call(function, np.ones(N), np.zeros(N), kind="taped", slopes=[np.zeros((N, 1)), made])
    assert tape.count == 1 and not made.any()
    tape.count = CAPACITY - 3
    call(function, np.ones(N), np.zeros(N), kind="taped", slopes=[places(1), made])
    with pytest.raises(MeltemiError, match="the tape is full"):
        tape.sweep(1)
