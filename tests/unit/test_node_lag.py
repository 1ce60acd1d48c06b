"""The first-order lag: exact for inputs that are linear over the step."""

from __future__ import annotations

from math import exp

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from meltemi.aero.lag import lag, lagged

steady = settings(derandomize=True, deadline=None, max_examples=300)
values = st.floats(-100.0, 100.0)


@steady
@given(h=st.floats(1e-2, 50.0), y=values, before=values, after=values)
def test_linear_input_has_the_exact_solution(h: float, y: float, before: float, after: float) -> None:
    # tau y' + y = u with u = b + s t, time in units of tau: y = u - s + (y0 - b + s) exp(-t)
    s = (after - before) / h
    expected = after - s + (y - before + s) * exp(-h)
    # the closed form loses two digits where s is large: 100 / 1e-2
    assert lagged(lag(h), y, before, after) == pytest.approx(expected, abs=1e-11)


@steady
@given(h=st.floats(0.0, 100.0))
def test_weights_are_shares(h: float) -> None:
    w = lag(h)
    assert w.state + w.before + w.after == pytest.approx(1.0, abs=1e-15)
    assert w.state == pytest.approx(exp(-h), abs=2e-16)
    assert w.after >= 0.0
    assert w.before >= -1e-16


def test_no_time_changes_nothing() -> None:
    assert lag(0.0) == (1.0, 0.0, 0.0)
    assert lagged(lag(0.0), 3.0, 77.0, -5.0) == 3.0


def test_after_a_long_time_the_state_trails_a_ramp_by_its_time_constant() -> None:
    # slope 1 per time constant
    assert lagged(lag(200.0), 999.0, 0.0, 200.0) == pytest.approx(199.0, rel=1e-12)
    assert lagged(lag(1e6), 999.0, 2.0, 2.0) == 2.0


def test_short_steps_keep_full_accuracy() -> None:
    # (1 - (1 - e^-h)/h) = h/2 - h^2/6 + ..., to the rounding of 1
    for h in (1e-12, 1e-8, 1e-5, 9.99e-4):
        exact = h / 2.0 - h**2 / 6.0 + h**3 / 24.0 - h**4 / 120.0
        assert lag(h).after == pytest.approx(exact, rel=0.0, abs=3e-16)


@steady
@given(h=st.floats(1e-3, 5.0), y=values, before=values, after=values)
def test_two_half_steps_are_a_whole_one(h: float, y: float, before: float, after: float) -> None:
    middle = 0.5 * (before + after)
    halves = lagged(lag(0.5 * h), lagged(lag(0.5 * h), y, before, middle), middle, after)
    assert halves == pytest.approx(lagged(lag(h), y, before, after), abs=1e-10)
