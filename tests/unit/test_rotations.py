"""Rotations by rotation vectors, their angular velocity and acceleration, against SciPy and differences."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from meltemi.maths import vectors as v
from meltemi.maths.rotations import angular_acceleration, angular_velocity, rotation, rotation_vector
from meltemi.maths.vectors import Rot, Vec

steady = settings(derandomize=True, deadline=None, max_examples=100)
within_a_radian = st.builds(Vec, *[st.floats(-0.57, 0.57)] * 3)
within_three_radians = st.builds(Vec, *[st.floats(-1.7, 1.7)] * 3)


def matrix(R: Rot) -> NDArray[np.float64]:
    return np.array(R).reshape(3, 3)


@steady
@given(theta=within_a_radian)
def test_rotations_are_exact_up_to_a_radian(theta: Vec) -> None:
    expected = Rotation.from_rotvec(np.array(theta)).as_matrix()
    np.testing.assert_allclose(matrix(rotation(theta)), expected, rtol=0.0, atol=1e-15)


@steady
@given(theta=within_three_radians)
def test_rotations_hold_to_1e_8_up_to_three_radians(theta: Vec) -> None:
    expected = Rotation.from_rotvec(np.array(theta)).as_matrix()
    np.testing.assert_allclose(matrix(rotation(theta)), expected, rtol=0.0, atol=1e-8)


def test_rotations_about_axes() -> None:
    np.testing.assert_allclose(rotation(Vec(0.7, 0.0, 0.0)), v.about_x(0.7), rtol=0.0, atol=4e-16)
    np.testing.assert_allclose(rotation(Vec(0.0, -0.9, 0.0)), v.about_y(-0.9), rtol=0.0, atol=4e-16)
    np.testing.assert_allclose(rotation(Vec(0.0, 0.0, 1.0)), v.about_z(1.0), rtol=0.0, atol=4e-16)


@steady
@given(theta=within_a_radian)
def test_the_rotation_vector_is_found_again(theta: Vec) -> None:
    np.testing.assert_allclose(rotation_vector(rotation(theta)), theta, rtol=0.0, atol=2e-15)


@pytest.mark.parametrize("size", [0.0, 1e-12, 1e-6, 1e-3])
def test_small_rotations_keep_full_accuracy(size: float) -> None:
    theta = Vec(*(size * np.array([2.0, -3.0, 6.0]) / 7.0))
    np.testing.assert_allclose(rotation_vector(rotation(theta)), theta, rtol=1e-15, atol=1e-22)


@steady
@given(theta=within_a_radian, rate=within_a_radian)
def test_angular_velocity_and_acceleration_are_derivatives_of_the_rotation(theta: Vec, rate: Vec) -> None:
    h = 1e-5

    def at(t: float) -> NDArray[np.float64]:
        return matrix(rotation(theta + t * rate))

    def spin(t: float) -> NDArray[np.float64]:
        return np.array(angular_velocity(theta + t * rate, rate))

    tilde = (at(h) - at(-h)) / (2.0 * h) @ at(0.0).T
    found = np.array([tilde[2, 1], tilde[0, 2], tilde[1, 0]])
    np.testing.assert_allclose(spin(0.0), found, rtol=0.0, atol=1e-9)
    change = (spin(h) - spin(-h)) / (2.0 * h)
    np.testing.assert_allclose(angular_acceleration(theta, rate), change, rtol=0.0, atol=1e-9)
