"""Vectors, rotations and symmetric matrices against NumPy and SciPy.

Results of a handful of multiplications agree to a few units of the last digit of the largest term, so
tolerances are 1e-14 times that.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from meltemi.maths import vectors as v
from meltemi.maths.vectors import Rot, Sym, Vec

Float = NDArray[np.float64]
steady = settings(derandomize=True, deadline=None, max_examples=100)
# the square of a smaller number is lost
components = st.floats(-1e6, 1e6).filter(lambda x: x == 0.0 or abs(x) > 1e-100)
vec = st.builds(Vec, components, components, components)
angle = st.floats(-20.0, 20.0)
sym = st.builds(Sym, *[components] * 6)


def matrix(R: Rot) -> Float:
    return np.array(R).reshape(3, 3)


def full(A: Sym) -> Float:
    return np.array([[A.xx, A.xy, A.xz], [A.xy, A.yy, A.yz], [A.xz, A.yz, A.zz]])


def rotation(x: float, y: float, z: float) -> Rot:
    return v.about_z(z) @ (v.about_y(y) @ v.about_x(x))


rot = st.builds(rotation, angle, angle, angle)


@steady
@given(a=vec, b=vec, s=components)
def test_sums_and_products_are_those_of_arrays(a: Vec, b: Vec, s: float) -> None:
    A, B = np.array(a), np.array(b)
    size = 1e-14 * (np.linalg.norm(A) * max(np.linalg.norm(B), abs(s)) + np.linalg.norm(A) + abs(s) * 1e6 + 1.0)
    np.testing.assert_array_equal(a + b, A + B)
    np.testing.assert_array_equal(a - b, A - B)
    np.testing.assert_array_equal(s * a, s * A)
    np.testing.assert_allclose(a + s * b, A + s * B, rtol=0.0, atol=size + 1e-14 * abs(s) * max(abs(B)))
    np.testing.assert_allclose(v.dot(a, b), A @ B, rtol=0.0, atol=size)
    np.testing.assert_allclose(v.cross(a, b), np.cross(A, B), rtol=0.0, atol=size)
    assert v.norm(a) == pytest.approx(np.linalg.norm(A), rel=1e-15, abs=1e-150)


def test_cross_product_is_right_handed() -> None:
    assert v.cross(Vec(1.0, 0.0, 0.0), Vec(0.0, 1.0, 0.0)) == Vec(0.0, 0.0, 1.0)


@steady
@given(R=rot)
def test_rotations_are_orthonormal_and_right_handed(R: Rot) -> None:
    np.testing.assert_allclose(matrix(R) @ matrix(R).T, np.eye(3), rtol=0.0, atol=4e-15)
    assert np.linalg.det(matrix(R)) == pytest.approx(1.0, abs=1e-14)


@steady
@given(R=rot, a=vec)
def test_the_transpose_rotates_back(R: Rot, a: Vec) -> None:
    size = 1e-14 * v.norm(a)
    np.testing.assert_allclose(R.T @ (R @ a), a, rtol=0.0, atol=size)
    np.testing.assert_allclose(R @ (R.T @ a), a, rtol=0.0, atol=size)
    np.testing.assert_allclose(R @ a, matrix(R) @ np.array(a), rtol=0.0, atol=size)


@steady
@given(A=rot, B=rot, a=vec)
def test_compose_applies_the_second_first(A: Rot, B: Rot, a: Vec) -> None:
    np.testing.assert_allclose(matrix(A @ B), matrix(A) @ matrix(B), rtol=0.0, atol=1e-15)
    np.testing.assert_allclose(A @ B @ a, A @ (B @ a), rtol=0.0, atol=1e-14 * v.norm(a))


@pytest.mark.parametrize(("turn", "axis"), [(v.about_x, "x"), (v.about_y, "y"), (v.about_z, "z")])
@steady
@given(angle=angle)
def test_rotations_about_axes_are_right_handed(turn: Callable[[float], Rot], axis: str, angle: float) -> None:
    expected = Rotation.from_euler(axis, angle).as_matrix()
    np.testing.assert_allclose(matrix(turn(angle)), expected, rtol=0.0, atol=4e-15)


@steady
@given(A=sym, a=vec)
def test_a_symmetric_matrix_times_a_vector_is_the_product_with_the_full_matrix(A: Sym, a: Vec) -> None:
    size = 1e-15 * np.abs(full(A)).max() * v.norm(a) * 3.0
    np.testing.assert_allclose(A @ a, full(A) @ np.array(a), rtol=0.0, atol=size)


@steady
@given(A=sym, R=rot)
def test_turn_is_the_congruence_and_keeps_the_trace(A: Sym, R: Rot) -> None:
    size = 1e-14 * np.abs(full(A)).max()
    turned = v.turn(R, A)
    np.testing.assert_allclose(full(turned), matrix(R) @ full(A) @ matrix(R).T, rtol=0.0, atol=size)
    assert turned.xx + turned.yy + turned.zz == pytest.approx(A.xx + A.yy + A.zz, abs=4.0 * size)
