"""Phasors: the operators and functions of complex numbers, in Python and in kernels, and fields of them."""

from __future__ import annotations

import cmath
from collections.abc import Callable
from typing import Any

import numba
import numpy as np
import pytest

from meltemi.compiler import KernelRecord, Kind, Table, dq, number
from meltemi.compiler import record_types as compiled  # noqa: F401 - by it kernels know what a record is
from meltemi.maths.phasors import Phasor, imaginary_product, magnitude, polar, real_product

A, B = 3.0 - 4.0j, -0.5 + 2.0j
OPERATIONS: list[tuple[Callable[..., Any], Callable[[complex, complex], complex]]] = [
    (lambda a, b: a + b, lambda a, b: a + b),
    (lambda a, b: a - b, lambda a, b: a - b),
    (lambda a, b: a * b, lambda a, b: a * b),
    (lambda a, b: a / b, lambda a, b: a / b),
    (lambda a, b: 2.5 * a, lambda a, b: 2.5 * a),
]


class Line(Table):
    """A table with phasors."""

    current: Phasor = dq("A", "through the line")
    resistance: float = number("Ohm", "of the line")
    voltage: Phasor = dq("V", "across the line")


class Network(KernelRecord):
    """One line."""

    line: Line


def drop(m: Network) -> None:
    """The current turned by a right angle, and its voltage."""
    x = m.line
    x.current = Phasor(0.0, 1.0) * x.current
    x.voltage = x.resistance * x.current


@pytest.mark.slow
@pytest.mark.parametrize(("ours", "expected"), OPERATIONS)
def test_node_operators_are_those_of_complex_numbers(
    ours: Callable[..., Any], expected: Callable[[complex, complex], complex]
) -> None:
    a, b = Phasor(A.real, A.imag), Phasor(B.real, B.imag)
    for function in (ours, numba.njit(ours)):
        assert complex(*function(a, b)) == pytest.approx(expected(A, B), rel=1e-15)


def test_node_functions_are_those_of_complex_numbers() -> None:
    a, b = Phasor(A.real, A.imag), Phasor(B.real, B.imag)
    assert complex(real_product(a, b), imaginary_product(a, b)) == pytest.approx(A * B.conjugate(), rel=1e-15)
    assert magnitude(a) == 5.0
    assert complex(*polar(2.0, 0.7)) == pytest.approx(cmath.rect(2.0, 0.7), rel=1e-15)


def test_rows_of_a_phasor_are_d_and_q() -> None:
    assert Line.names == ("current_d", "current_q", "resistance", "voltage_d", "voltage_q")
    assert Line.index("voltage") == 3


@pytest.mark.parametrize("kind", ["floats", "duals"])
def test_kernels_read_and_store_phasors_by_name(kind: Kind) -> None:
    array = np.array([3.0, -4.0, 2.0, 0.0, 0.0])
    slopes = np.zeros((5, 8))
    slopes[0, 0] = 1.0
    numba.njit(drop)(Network(kind, {"line": array}, {"line": slopes}))
    np.testing.assert_array_equal(array, [4.0, 3.0, 2.0, 8.0, 6.0])
    if kind == "duals":
        np.testing.assert_array_equal(slopes[:, 0], [0.0, 1.0, 0.0, 0.0, 2.0])


def test_python_reads_and_stores_phasors_by_name() -> None:
    array = np.array([3.0, -4.0, 2.0, 0.0, 0.0])
    drop(Network("floats", {"line": array}))
    np.testing.assert_array_equal(array, [4.0, 3.0, 2.0, 8.0, 6.0])
