"""Dynamic inflow: two lags in a row, advanced, differentiated, settled."""

from __future__ import annotations

from collections.abc import Callable
from math import exp, sin

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from meltemi.aero.inflow.lags import (
    Inflow,
    first_time,
    inflow_advance,
    inflow_derivative,
    inflow_steady,
    second_time,
)

steady = settings(derandomize=True, deadline=None, max_examples=100)
K = 0.6
times = st.floats(0.1, 50.0)
values = st.floats(-20.0, 20.0)


@steady
@given(V=values, tau_1=times, tau_2=times, dt=st.floats(0.0, 100.0))
def test_the_settled_state_stays(V: float, tau_1: float, tau_2: float, dt: float) -> None:
    y = inflow_steady(K, V)
    assert y.velocity == V
    np.testing.assert_allclose(inflow_advance(y, K, tau_1, tau_2, V, V, dt), y, rtol=0.0, atol=1e-13)
    np.testing.assert_allclose(inflow_derivative(y, K, tau_1, tau_2, V), 0.0, rtol=0.0, atol=1e-12)


@steady
@given(z=values, v=values, V=values, tau_1=times, tau_2=times)
def test_the_derivative_is_the_limit_of_the_advance(z: float, v: float, V: float, tau_1: float, tau_2: float) -> None:
    y, h = Inflow(z, v), 1e-5
    rate = (np.array(inflow_advance(y, K, tau_1, tau_2, V, V, h)) - y) / h
    # first difference: h / 2 times the second derivative, at most 100 / 0.1^2; rounding 1e-15 * 20 / h
    np.testing.assert_allclose(rate, inflow_derivative(y, K, tau_1, tau_2, V), rtol=0.0, atol=0.1)


def march(n: int, V: Callable[[float], float], end: float, tau_1: float, tau_2: float) -> Inflow:
    y, dt = Inflow(0.3, -0.2), end / n
    for i in range(n):
        y = inflow_advance(y, K, tau_1, tau_2, V(i * dt), V((i + 1) * dt), dt)
    return y


def exact(V: Callable[[float], float], end: float, tau_1: float, tau_2: float) -> np.ndarray:
    solution = solve_ivp(
        lambda t, y: inflow_derivative(Inflow(*y), K, tau_1, tau_2, V(t)),
        (0.0, end),
        [0.3, -0.2],
        rtol=1e-11,
        atol=1e-13,
        method="DOP853",
    )
    return solution.y[:, -1]


def test_the_advance_converges_to_the_differential_equation_with_second_order() -> None:
    def V(t: float) -> float:
        return 3.0 + sin(2.0 * t)

    truth = exact(V, 4.0, 2.5, 0.7)
    errors = [np.abs(np.array(march(n, V, 4.0, 2.5, 0.7)) - truth).max() for n in (20, 40, 80)]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    np.testing.assert_allclose(orders, 2.0, rtol=0.0, atol=0.1)
    assert errors[-1] < 1e-3


def test_the_first_lag_is_exact_for_a_ramp_whatever_the_step() -> None:
    def V(t: float) -> float:
        return 1.0 + 2.0 * t

    one, many = march(1, V, 3.0, 1.7, 0.4), march(300, V, 3.0, 1.7, 0.4)
    assert one.reduced == pytest.approx(many.reduced, rel=1e-13)
    # z' = ((1 - k) V - z) / tau
    slope = 0.4 * 2.0
    expected = 0.4 * V(3.0) - slope * 1.7 + (0.3 - 0.4 + slope * 1.7) * exp(-3.0 / 1.7)
    assert one.reduced == pytest.approx(expected, rel=1e-13)


def test_a_step_passes_at_once_through_the_lead_only() -> None:
    # right after a step of V_s from 0 to 1 the induced velocity rises with k / tau_2
    rate = inflow_derivative(inflow_steady(K, 0.0), K, 5.0, 0.5, 1.0)
    assert rate.velocity == pytest.approx(K / 0.5, rel=1e-14)
    assert rate.reduced == pytest.approx((1.0 - K) / 5.0, rel=1e-14)


def test_steps_of_any_length_are_stable() -> None:
    y = inflow_advance(Inflow(5.0, -5.0), K, 0.1, 0.05, 2.0, 2.0, 1e4)
    np.testing.assert_allclose(y, inflow_steady(K, 2.0), rtol=1e-3)


@pytest.mark.parametrize(
    ("induction", "expected"),
    [
        (0.0, 1.1 * 63.0 / 10.0),
        (1.0 / 3.0, 1.1 * 63.0 / ((1.0 - 1.3 / 3.0) * 10.0)),
        (0.5, 1.1 * 63.0 / (0.35 * 10.0)),
        (0.9, 1.1 * 63.0 / (0.35 * 10.0)),
    ],
)
def test_first_time_constant(induction: float, expected: float) -> None:
    # Snel & Schepers (1995): tau_1 = 1.1 / (1 - 1.3 a) R / U, a not above 0.5
    assert first_time(induction, 63.0, 10.0) == pytest.approx(expected, rel=1e-14)


@pytest.mark.parametrize("wind", [0.0, -5.0, 1e-9])
def test_first_time_constant_is_bounded_in_still_air(wind: float) -> None:
    assert first_time(0.3, 63.0, wind) == 100.0


def test_second_time_constant_falls_towards_the_tip() -> None:
    assert second_time(10.0, 0.0) == pytest.approx(3.9, rel=1e-14)
    assert second_time(10.0, 0.5) == pytest.approx(3.25, rel=1e-14)  # with the square of r/R
    assert second_time(10.0, 1.0) == pytest.approx(1.3, rel=1e-14)
