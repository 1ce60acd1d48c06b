"""Pitch actuators, brake and yaw drive: exact steps, limits, the ideal variant."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from meltemi.control import signals as s
from meltemi.control.actuators import (
    ACCELERATION,
    ANGLE,
    RATE,
    Actuators,
    drive_advance,
    pitch_advance,
    second_order_step,
    yaw_advance,
)
from meltemi.control.faults import PITCH_STUCK, healthy
from meltemi.maths.tables import View
from meltemi.turbine import exchange as ex
from meltemi.turbine.exchange import PitchMotion

Float = NDArray[np.float64]
steady = settings(derandomize=True, deadline=None, max_examples=100)


def parameters(**changes: float) -> Float:
    """Actuators without limits that matter, unless they are given."""
    array = Actuators.zeros()
    values = {
        "pitch_frequency": 11.11,
        "pitch_damping": 0.6,
        "pitch_rate": 1e3,
        "pitch_minimum": -10.0,
        "pitch_maximum": 10.0,
        "brake_torque": 28000.0,
        "yaw_rate": 0.005,
        "yaw_hold": -1.0,
    } | changes
    for name, value in values.items():
        View(Actuators, array)[name] = value
    return array


def demand(pitch: Any = 0.0, **others: float) -> Float:
    array = s.Demands.zeros()
    View(s.Demands, array)["pitch"] = pitch
    for name, value in others.items():
        View(s.Demands, array)[name] = value
    return array


@steady
@given(
    x=st.floats(-2.0, 2.0),
    v=st.floats(-5.0, 5.0),
    w=st.floats(0.1, 50.0),
    z=st.one_of(st.floats(0.0, 3.0), st.just(1.0)),
    dt=st.floats(0.0, 0.5),
)
def test_a_step_of_the_second_order_system_is_exact(x: float, v: float, w: float, z: float, dt: float) -> None:
    found = second_order_step(x, v, w, z, dt)
    expected = expm(dt * np.array([[0.0, 1.0], [-w * w, -2.0 * z * w]])) @ np.array([x, v])
    # near z = 1 sin(wd dt) / wd is a difference of nearly equal numbers only below 1e-6 of damping;
    # the matrix exponential itself is good to 1e-12 of its largest intermediate entry, w^2 |x| + w |v|
    size = 1e-11 * (1.0 + w * abs(x) + abs(v)) * max(1.0, w)
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=size)


@pytest.mark.parametrize("z", [1.0 - 1e-9, 1.0 - 1e-13, 1.0, 1.0 + 1e-13, 1.0 + 1e-9])
def test_critical_damping_joins_its_neighbours(z: float) -> None:
    w, dt = 11.0, 0.05
    found = second_order_step(0.3, -1.0, w, z, dt)
    # x = e^-wt (x0 + (v0 + w x0) t)
    e = np.exp(-w * dt)
    expected = e * (0.3 + (-1.0 + w * 0.3) * dt), e * (-1.0 - w * (-1.0 + w * 0.3) * dt)
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-8)


def test_two_half_steps_are_a_whole_one() -> None:
    half = second_order_step(*second_order_step(0.2, 1.0, 9.0, 0.7, 0.02), 9.0, 0.7, 0.02)
    np.testing.assert_allclose(half, second_order_step(0.2, 1.0, 9.0, 0.7, 0.04), rtol=0.0, atol=1e-15)


@pytest.mark.parametrize("damping", [0.2, 0.6, 1.0, 1.7])
def test_the_answer_to_a_step_is_that_of_the_differential_equation(damping: float) -> None:
    w, dt, n = 11.11, 0.01, 100
    p, pitch = parameters(pitch_damping=damping), PitchMotion.zeros(blade=3)
    demands = demand([0.1, -0.2, 0.0])
    found = []
    for _ in range(n):
        pitch_advance(p, demands, healthy(), pitch, dt)
        found.append(pitch[[ANGLE, RATE], 0].copy())
    solution = solve_ivp(
        lambda t, y: [y[1], w * w * (0.1 - y[0]) - 2.0 * damping * w * y[1]],
        (0.0, n * dt),
        [0.0, 0.0],
        t_eval=dt * np.arange(1, n + 1),
        rtol=1e-11,
        atol=1e-13,
        method="DOP853",
    )
    np.testing.assert_allclose(np.array(found).T, solution.y, rtol=0.0, atol=1e-10)
    # the blades answer independently, in proportion
    np.testing.assert_allclose(pitch[ANGLE], pitch[ANGLE, 0] * np.array([1.0, -2.0, 0.0]), rtol=1e-12)


def test_the_acceleration_is_the_change_of_rate_over_the_step() -> None:
    pitch = PitchMotion.zeros(blade=2)
    pitch_advance(parameters(), demand(0.1), healthy(), pitch, 0.01)
    np.testing.assert_allclose(pitch[ACCELERATION], pitch[RATE] / 0.01, rtol=1e-14)


def test_the_rate_limit_holds_and_the_angle_follows_it() -> None:
    p, pitch, limit, dt = parameters(pitch_rate=0.14), PitchMotion.zeros(blade=1), 0.14, 0.0125
    angles, rates = [0.0], [0.0]
    for _ in range(400):
        pitch_advance(p, demand(0.5), healthy(), pitch, dt)
        angles.append(pitch[ANGLE, 0])
        rates.append(pitch[RATE, 0])
    assert np.max(rates) == limit
    assert np.all(np.diff(angles) <= limit * dt * (1.0 + 1e-12))
    full = np.flatnonzero((np.array(rates[1:]) == limit) & (np.array(rates[:-1]) == limit))
    assert len(full) > 200
    np.testing.assert_allclose(np.diff(angles)[full], limit * dt, rtol=1e-11)
    # it arrives all the same: exp(-0.6 * 11.11 * 1 s) of the way is left
    assert angles[-1] == pytest.approx(0.5, abs=1e-3)


def test_the_rate_limit_holds_in_both_directions() -> None:
    p, pitch = parameters(pitch_rate=0.14), PitchMotion.zeros(blade=1)
    pitch[ANGLE] = 0.5
    for _ in range(100):
        pitch_advance(p, demand(0.0), healthy(), pitch, 0.0125)
        assert abs(pitch[RATE, 0]) <= 0.14
    assert pitch[ANGLE, 0] < 0.4


@steady
@given(demands=st.lists(st.floats(-3.0, 3.0), min_size=1, max_size=30), dt=st.floats(1e-3, 0.1))
def test_angles_stay_within_their_limits_whatever_is_demanded(demands: list[float], dt: float) -> None:
    p, pitch = parameters(pitch_minimum=-0.1, pitch_maximum=0.4, pitch_damping=0.1), PitchMotion.zeros(blade=2)
    for value in demands:
        pitch_advance(p, demand(value), healthy(), pitch, dt)
        assert np.all(pitch[ANGLE] >= -0.1)
        assert np.all(pitch[ANGLE] <= 0.4)
        at_limit = (pitch[ANGLE] == -0.1) | (pitch[ANGLE] == 0.4)
        assert np.all(np.abs(pitch[RATE][at_limit]) < 1e-9)


def test_a_demand_beyond_the_limit_ends_at_the_limit() -> None:
    p, pitch = parameters(pitch_minimum=0.0, pitch_maximum=0.4), PitchMotion.zeros(blade=1)
    for _ in range(400):
        pitch_advance(p, demand(2.0), healthy(), pitch, 0.01)
    assert pitch[ANGLE, 0] == pytest.approx(0.4, abs=1e-12)


def test_nothing_moves_in_no_time() -> None:
    pitch = PitchMotion.zeros(blade=3)
    pitch[ANGLE], pitch[RATE], pitch[ACCELERATION] = 0.1, 0.2, 0.3
    before = pitch.copy()
    pitch_advance(parameters(), demand(1.0), healthy(), pitch, 0.0)
    np.testing.assert_array_equal(pitch, before)


@pytest.mark.parametrize("dt", [0.0, 0.0125])
def test_the_ideal_actuator_has_the_demand_at_once_and_no_rate(dt: float) -> None:
    p, pitch = parameters(pitch_ideal=1.0, pitch_maximum=0.5), PitchMotion.zeros(blade=3)
    pitch_advance(p, demand([0.1, 0.2, 3.0]), healthy(), pitch, dt)
    np.testing.assert_array_equal(pitch[ANGLE], [0.1, 0.2, 0.5])
    np.testing.assert_array_equal(pitch[RATE], 0.0)
    np.testing.assert_array_equal(pitch[ACCELERATION], 0.0)


def test_the_generator_has_the_torque_that_is_asked_for() -> None:
    drive = ex.Drive.zeros()
    drive_advance(parameters(), demand(generator_torque=4.2e4), healthy(), drive)
    assert drive[ex.GENERATOR_TORQUE] == 4.2e4


@pytest.mark.parametrize(("share", "torque"), [(-1.0, 0.0), (0.0, 0.0), (0.25, 7000.0), (1.0, 28000.0), (3.0, 28000.0)])
def test_the_brake_has_a_share_of_its_torque(share: float, torque: float) -> None:
    drive = ex.Drive.zeros()
    drive_advance(parameters(), demand(brake=share), healthy(), drive)
    assert drive[ex.BRAKE_TORQUE] == torque


def test_the_yaw_drive_turns_with_its_rate_at_most() -> None:
    drive = ex.Drive.zeros()
    for _ in range(10):
        yaw_advance(parameters(), 1e9, demand(yaw_rate=0.002), healthy(), drive, 0.0, 0.0, 0.5)
    assert drive[ex.YAW_COMMAND] == pytest.approx(0.01, rel=1e-14)
    for _ in range(10):
        yaw_advance(parameters(), 1e9, demand(yaw_rate=-1.0), healthy(), drive, 0.0, 0.0, 0.5)
    assert drive[ex.YAW_COMMAND] == pytest.approx(0.01 - 0.025, rel=1e-13)
    assert drive[ex.YAW_COMMAND_RATE] == -0.005


def test_a_blade_that_sticks_stops_within_a_step_and_passes_its_momentum_on() -> None:
    """The acceleration of that one step is what takes the rate away; when it comes free it starts from rest."""
    p, pitch, faults, dt = parameters(), PitchMotion.zeros(blade=3), healthy(), 0.01
    for _ in range(10):
        pitch_advance(p, demand(0.5), faults, pitch, dt)
    angle, rate = pitch[ANGLE, 1], pitch[RATE, 1]
    faults[PITCH_STUCK + 1] = 1.0
    pitch_advance(p, demand(0.5), faults, pitch, 0.0)
    assert (pitch[ANGLE, 1], pitch[RATE, 1]) == (angle, rate)
    pitch_advance(p, demand(0.5), faults, pitch, dt)
    assert (pitch[ANGLE, 1], pitch[RATE, 1], pitch[ACCELERATION, 1]) == (angle, 0.0, -rate / dt)
    assert pitch[ANGLE, 0] == pitch[ANGLE, 2] > angle
    pitch_advance(p, demand(0.5), faults, pitch, dt)
    assert (pitch[ANGLE, 1], pitch[ACCELERATION, 1]) == (angle, 0.0)
    faults[PITCH_STUCK + 1] = 0.0
    pitch_advance(p, demand(0.5), faults, pitch, dt)
    assert 0.0 < pitch[RATE, 1] < 0.2 * rate
