"""Small linear solves against numpy.linalg.

The relative error of a Cholesky solve is about the condition number times 2.2e-16; the random systems
have conditions below 1e3, so 1e-11 leaves room for their size.
"""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from meltemi.maths.solve import cholesky, solve_arrow

Float = NDArray[np.float64]
steady = settings(derandomize=True, deadline=None, max_examples=40)


def positive_definite(rng: np.random.Generator, n: int) -> Float:
    """A symmetric matrix with eigenvalues between 1 and 100."""
    Q, _ = np.linalg.qr(rng.standard_normal((n, n)))
    return (Q * np.exp(rng.uniform(0.0, np.log(100.0), n))) @ Q.T


@steady
@given(n=st.integers(1, 8), seed=st.integers(0, 10**6))
def test_cholesky_is_the_factor_of_numpy_with_inverted_diagonal(n: int, seed: int) -> None:
    A = positive_definite(np.random.default_rng(seed), n)
    L = A.copy()
    cholesky(L, n)
    found = np.tril(L, -1) + np.diag(1.0 / np.diag(L))
    np.testing.assert_allclose(found, np.linalg.cholesky(A), rtol=0.0, atol=1e-12)


def test_cholesky_leaves_the_upper_triangle_and_what_lies_beyond() -> None:
    A = positive_definite(np.random.default_rng(1), 5)
    L = A.copy()
    cholesky(L, 3)
    np.testing.assert_array_equal(L[np.triu_indices(5, 1)], A[np.triu_indices(5, 1)])
    np.testing.assert_array_equal(L[3:], A[3:])


@pytest.mark.slow
@steady
@given(arms=st.integers(1, 3), arm=st.integers(1, 5), core=st.integers(1, 7), seed=st.integers(0, 10**6))
def test_arrow_system_has_the_solution_of_the_full_matrix(arms: int, arm: int, core: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    n = arms * arm + core
    # a random matrix of full rank with the couplings between arms taken out; a strong diagonal keeps it definite
    whole = positive_definite(rng, n)
    for a in range(arms):
        for b in range(arms):
            if a != b:
                whole[a * arm : (a + 1) * arm, b * arm : (b + 1) * arm] = 0.0
    whole += np.diag(np.abs(whole).sum(axis=1))
    right = rng.standard_normal(n)
    D = np.stack([whole[a * arm : (a + 1) * arm, a * arm : (a + 1) * arm] for a in range(arms)])
    C = np.stack([whole[a * arm : (a + 1) * arm, arms * arm :] for a in range(arms)])
    A, f, g = (
        whole[arms * arm :, arms * arm :].copy(),
        right[: arms * arm].reshape(arms, arm).copy(),
        right[arms * arm :],
    )
    g = g.copy()
    solve_arrow(D.copy(), C.copy(), f, A, g, arms, arm, core)
    np.testing.assert_allclose(np.concatenate([f.ravel(), g]), np.linalg.solve(whole, right), rtol=1e-11, atol=1e-13)


def test_arms_without_coordinates_leave_the_core() -> None:
    A = positive_definite(np.random.default_rng(2), 4)
    g = np.arange(1.0, 5.0)
    expected = np.linalg.solve(A, g)
    solve_arrow(np.zeros((3, 0, 0)), np.zeros((3, 0, 4)), np.zeros((3, 0)), A.copy(), g, 3, 0, 4)
    np.testing.assert_allclose(g, expected, rtol=1e-12)


@pytest.mark.parametrize("size", [1e-6, 1.0, 1e9])
def test_the_solution_does_not_depend_on_the_units(size: float) -> None:
    A = positive_definite(np.random.default_rng(3), 4)
    scale = np.array([1.0, size, 1.0 / size, 1.0])
    g = np.arange(1.0, 5.0)
    expected = np.linalg.solve(A, g)
    scaled = g * scale
    nothing = np.zeros((1, 0, 0)), np.zeros((1, 0, 4)), np.zeros((1, 0))
    solve_arrow(*nothing, A * np.outer(scale, scale), scaled, 1, 0, 4)
    np.testing.assert_allclose(scaled * scale, expected, rtol=1e-11)
