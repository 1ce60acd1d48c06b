"""Multi-blade coordinates: round trip, derivatives, and systems that are constant in the fixed frame."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from meltemi.maths.multiblade import TURNING, blade_matrix, by_components, fixed_frame, to_components

Float = NDArray[np.float64]
azimuths = st.floats(-10.0, 10.0)
steady = settings(derandomize=True, deadline=None, max_examples=50)


@steady
@given(azimuth=azimuths)
def test_blade_quantities_are_collective_plus_cosine_plus_sine(azimuth: float) -> None:
    T, _, _ = blade_matrix(azimuth)
    psi = azimuth + 2.0 * np.pi / 3.0 * np.arange(3)
    np.testing.assert_allclose(
        T @ np.array([2.0, 3.0, 5.0]), 2.0 + 3.0 * np.cos(psi) + 5.0 * np.sin(psi), rtol=0.0, atol=1e-14
    )


@steady
@given(azimuth=azimuths)
def test_the_inverse_is_the_textbook_one(azimuth: float) -> None:
    # means, and twice the means of cosine and sine parts
    psi = azimuth + 2.0 * np.pi / 3.0 * np.arange(3)
    inverse = np.stack([np.ones(3), 2.0 * np.cos(psi), 2.0 * np.sin(psi)]) / 3.0
    np.testing.assert_allclose(inverse @ blade_matrix(azimuth)[0], np.eye(3), rtol=0.0, atol=4e-15)


@steady
@given(azimuth=azimuths)
def test_derivatives_by_azimuth(azimuth: float) -> None:
    h = 1e-4
    (before, slope_before, _), (_, slope, bend), (after, slope_after, _) = (
        blade_matrix(azimuth + d) for d in (-h, 0.0, h)
    )
    # central differences: h^2 / 6 = 2e-9, rounding 1e-12
    np.testing.assert_allclose((after - before) / (2.0 * h), slope, rtol=0.0, atol=2e-9)
    np.testing.assert_allclose((slope_after - slope_before) / (2.0 * h), bend, rtol=0.0, atol=2e-9)


@steady
@given(azimuth=azimuths, speed=st.floats(0.0, 3.0))
def test_three_alike_oscillators_split_by_the_rotor_speed(azimuth: float, speed: float) -> None:
    # q_b'' = -k q_b - d q_b' in the rotating frame; in the fixed frame (Bir 2008):
    #   z_0'' = -k z_0 - d z_0'
    #   z_c'' = (W^2 - k) z_c - W d z_s - d z_c' - 2 W z_s'
    #   z_s'' = (W^2 - k) z_s + W d z_c - d z_s' + 2 W z_c'
    k, d, W = 7.0, 0.3, speed
    K, D = fixed_frame(-k * np.eye(3), -d * np.eye(3), azimuth, W, 0, 1)
    expected_K = np.array([[-k, 0.0, 0.0], [0.0, W * W - k, -W * d], [0.0, W * d, W * W - k]])
    expected_D = np.array([[-d, 0.0, 0.0], [0.0, -d, -2.0 * W], [0.0, 2.0 * W, -d]])
    np.testing.assert_allclose(K, expected_K, rtol=0.0, atol=1e-13)
    np.testing.assert_allclose(D, expected_D, rtol=0.0, atol=1e-13)


def test_the_fixed_core_keeps_its_own_matrices() -> None:
    rng = np.random.default_rng(1)
    core = rng.standard_normal((2, 2))
    K = np.zeros((8, 8))
    K[:2, :2] = core
    K[2:, 2:] = -np.eye(6)
    found, D = fixed_frame(K, np.zeros((8, 8)), 0.7, 1.1, 2, 2)
    np.testing.assert_allclose(found[:2, :2], core, rtol=0.0, atol=1e-15)
    np.testing.assert_array_equal(D[:2], 0.0)


@steady
@given(azimuth=azimuths)
def test_isotropic_coupling_to_the_core_is_constant(azimuth: float) -> None:
    # a tower coordinate feels the sum of the blades times cos(psi_b), each blade feels the tower times cos(psi_b)
    c = np.cos(azimuth + 2.0 * np.pi / 3.0 * np.arange(3))
    K = np.zeros((4, 4))
    K[0, 1:] = c
    K[1:, 0] = c
    found, _ = fixed_frame(K, np.zeros((4, 4)), azimuth, 0.9, 1, 1)
    W2 = 0.9**2
    expected = np.zeros((4, 4))
    expected[0, 2], expected[2, 0] = 1.5, 1.0
    expected[2, 2] = expected[3, 3] = W2
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-14)


def test_motion_in_both_frames_is_the_same() -> None:
    # integrate z'' = K z + D z' with constant matrices and compare q = T z with the rotating equations
    from scipy.linalg import expm

    rng = np.random.default_rng(5)
    coupling = rng.standard_normal((2, 2))
    stiffness = np.zeros(
        (6, 6)
    )  # two modes of each blade, coupled within the blade: mode k of blade b stands at 2 b + k
    for b in range(3):
        stiffness[2 * b : 2 * b + 2, 2 * b : 2 * b + 2] = -4.0 * np.eye(2) + 0.5 * coupling
    speed, t, n = 1.3, 0.8, 6
    K, D = fixed_frame(stiffness, np.zeros((n, n)), 0.0, speed, 0, 2)
    q0, v0 = rng.standard_normal(n), rng.standard_normal(n)

    def spread(azimuth: float) -> tuple[Float, Float]:
        T, T1 = np.zeros((2, n, n))
        for whole, part in zip((T, T1), blade_matrix(azimuth), strict=False):
            for k in range(2):
                whole[np.ix_(k + 2 * np.arange(3), 3 * k + np.arange(3))] = part
        return T, T1

    T, T1 = spread(0.0)
    z0 = np.linalg.solve(T, q0)
    w0 = np.linalg.solve(T, v0 - speed * T1 @ z0)
    zero, one = np.zeros((n, n)), np.eye(n)
    fixed = expm(t * np.block([[zero, one], [K, D]])) @ np.concatenate([z0, w0])
    rotating = expm(t * np.block([[zero, one], [stiffness, zero]])) @ np.concatenate([q0, v0])
    # two matrix exponentials of size 1: rounding only
    np.testing.assert_allclose(spread(speed * t)[0] @ fixed[:n], rotating[:n], rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("modes", [1, 3])
def test_azimuth_does_not_matter_for_alike_blades(modes: int) -> None:
    rng = np.random.default_rng(modes)
    block = rng.standard_normal((modes, modes))
    K = np.kron(np.eye(3), block)
    one, two = (fixed_frame(K, 0.1 * K, azimuth, 1.2, 0, modes) for azimuth in (0.0, 1.0))
    for a, b in zip(one, two, strict=True):
        np.testing.assert_allclose(a, b, rtol=0.0, atol=1e-13)


@steady
@given(azimuth=azimuths)
def test_places_of_the_blades_need_not_be_neighbours(azimuth: float) -> None:
    triples = np.array([[4, 0, 2], [5, 6, 1]])
    whole, derivative, _ = blade_matrix(azimuth)
    z = np.arange(1.0, 8.0)
    x, J = z.copy(), np.diag(z)
    x[triples] = z[triples] @ whole.T
    to_components(x, triples, azimuth)
    np.testing.assert_allclose(x, z, rtol=0.0, atol=1e-14)
    by_components(J, triples, azimuth)
    for triple in triples:
        np.testing.assert_allclose(J[np.ix_(triple, triple)], np.diag(z[triple]) @ whole, rtol=0.0, atol=1e-14)
        J[np.ix_(triple, triple)] = 0.0
    assert x[3] == z[3]
    assert J[3, 3] == z[3] and np.count_nonzero(J) == 1
    np.testing.assert_allclose(whole @ TURNING, derivative, rtol=0.0, atol=1e-14)
