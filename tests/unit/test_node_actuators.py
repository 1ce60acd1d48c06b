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

from meltemi.aero.tables import FlapParameters
from meltemi.compiler import View
from meltemi.control.actuator_models.second_order import second_order_step
from meltemi.control.actuators import (
    Actuation,
    Actuators,
    FlapActuators,
    drive_advance,
    pitch_advance,
    yaw_advance,
)
from meltemi.control.faults import healthy
from meltemi.control.signals import Demands, Measurements
from meltemi.core.variants import number
from meltemi.turbine.exchange import ActuatorModel, Drive, PitchMotion

Float = NDArray[np.float64]
IDEAL = number(ActuatorModel, "ideal")
steady = settings(derandomize=True, deadline=None, max_examples=100)


def actuation(blades: int = 3, **changes: float) -> Actuation:
    """Actuators without limits that matter, unless they are given."""
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
    arrays = {
        "measured": Measurements.zeros(),
        "demands": Demands.zeros(),
        "faults": healthy(),
        "actuators": Actuators.zeros(),
        "flap_actuators": FlapActuators.zeros(flap=0),
        "pitch": PitchMotion.zeros(blade=blades),
        "flap": FlapParameters.zeros(flap=0, blade=blades),
        "drive": Drive.zeros(),
    }
    for name, value in values.items():
        View(Actuators, arrays["actuators"])[name] = value
    return Actuation("floats", arrays)


def rows(c: Actuation) -> tuple[Float, Float, Float]:
    """Angle, rate and acceleration of the blades' pitch."""
    v = View(PitchMotion, c.pitch.array)
    return v["angle"], v["rate"], v["acceleration"]


def demand(c: Actuation, pitch: Any = 0.0, **others: float) -> None:
    view = View(Demands, c.demands.array)
    view["pitch"] = pitch
    for name, value in others.items():
        view[name] = value


@pytest.mark.slow
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
    c = actuation(pitch_damping=damping)
    angle, rate, _ = rows(c)
    demand(c, [0.1, -0.2, 0.0])
    found = []
    for _ in range(n):
        pitch_advance(dt, c)
        found.append((angle[0], rate[0]))
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
    np.testing.assert_allclose(angle, angle[0] * np.array([1.0, -2.0, 0.0]), rtol=1e-12)


def test_the_acceleration_is_the_change_of_rate_over_the_step() -> None:
    c = actuation(2)
    demand(c, 0.1)
    pitch_advance(0.01, c)
    _, rate, acceleration = rows(c)
    np.testing.assert_allclose(acceleration, rate / 0.01, rtol=1e-14)
    assert np.all(rate > 0.0)


def test_the_rate_limit_holds_and_the_angle_follows_it() -> None:
    c, limit, dt = actuation(1, pitch_rate=0.14), 0.14, 0.0125
    angle, rate, _ = rows(c)
    demand(c, 0.5)
    angles, rates = [0.0], [0.0]
    for _ in range(400):
        pitch_advance(dt, c)
        angles.append(angle[0])
        rates.append(rate[0])
    assert np.max(rates) == limit
    assert np.all(np.diff(angles) <= limit * dt * (1.0 + 1e-12))
    full = np.flatnonzero((np.array(rates[1:]) == limit) & (np.array(rates[:-1]) == limit))
    assert len(full) > 200
    np.testing.assert_allclose(np.diff(angles)[full], limit * dt, rtol=1e-11)
    # it arrives all the same: exp(-0.6 * 11.11 * 1 s) of the way is left
    assert angles[-1] == pytest.approx(0.5, abs=1e-3)


def test_the_rate_limit_holds_in_both_directions() -> None:
    c = actuation(1, pitch_rate=0.14)
    angle, rate, _ = rows(c)
    angle[:] = 0.5
    for _ in range(100):
        pitch_advance(0.0125, c)
        assert abs(rate[0]) <= 0.14
    assert angle[0] < 0.4


@steady
@given(demands=st.lists(st.floats(-3.0, 3.0), min_size=1, max_size=30), dt=st.floats(1e-3, 0.1))
def test_angles_stay_within_their_limits_whatever_is_demanded(demands: list[float], dt: float) -> None:
    c = actuation(2, pitch_minimum=-0.1, pitch_maximum=0.4, pitch_damping=0.1)
    angle, rate, _ = rows(c)
    for value in demands:
        demand(c, value)
        pitch_advance(dt, c)
        assert np.all(angle >= -0.1)
        assert np.all(angle <= 0.4)
        at_limit = (angle == -0.1) | (angle == 0.4)
        assert np.all(np.abs(rate[at_limit]) < 1e-9)


def test_a_demand_beyond_the_limit_ends_at_the_limit() -> None:
    c = actuation(1, pitch_minimum=0.0, pitch_maximum=0.4)
    demand(c, 2.0)
    for _ in range(400):
        pitch_advance(0.01, c)
    assert rows(c)[0][0] == pytest.approx(0.4, abs=1e-12)


def test_nothing_moves_in_no_time() -> None:
    c = actuation()
    for row, value in zip(rows(c), (0.1, 0.2, 0.3), strict=True):
        row[:] = value
    before = np.array(rows(c))
    demand(c, 1.0)
    pitch_advance(0.0, c)
    np.testing.assert_array_equal(rows(c), before)


@pytest.mark.parametrize("dt", [0.0, 0.0125])
def test_the_ideal_actuator_has_the_demand_at_once_and_no_rate(dt: float) -> None:
    c = actuation(pitch_model=IDEAL, pitch_maximum=0.5)
    demand(c, [0.1, 0.2, 3.0])
    pitch_advance(dt, c)
    angle, rate, acceleration = rows(c)
    np.testing.assert_array_equal(angle, [0.1, 0.2, 0.5])
    np.testing.assert_array_equal(rate, 0.0)
    np.testing.assert_array_equal(acceleration, 0.0)


def test_the_generator_has_the_torque_that_is_asked_for() -> None:
    c = actuation()
    demand(c, generator_torque=4.2e4)
    drive_advance(c)
    assert c.drive.generator_torque == 4.2e4


@pytest.mark.parametrize(("share", "torque"), [(-1.0, 0.0), (0.0, 0.0), (0.25, 7000.0), (1.0, 28000.0), (3.0, 28000.0)])
def test_the_brake_has_a_share_of_its_torque(share: float, torque: float) -> None:
    c = actuation()
    demand(c, brake=share)
    drive_advance(c)
    assert c.drive.brake_torque == torque


def test_the_yaw_drive_turns_with_its_rate_at_most() -> None:
    c = actuation()
    demand(c, yaw_rate=0.002)
    for _ in range(10):
        yaw_advance(0.5, c, 1e9, 0.0, 0.0)
    assert c.drive.yaw_command == pytest.approx(0.01, rel=1e-14)
    demand(c, yaw_rate=-1.0)
    for _ in range(10):
        yaw_advance(0.5, c, 1e9, 0.0, 0.0)
    assert c.drive.yaw_command == pytest.approx(0.01 - 0.025, rel=1e-13)
    assert c.drive.yaw_command_rate == -0.005


def test_a_blade_that_sticks_stops_within_a_step_and_passes_its_momentum_on() -> None:
    """The acceleration of that one step is what takes the rate away; when it comes free it starts from rest."""
    c, dt = actuation(), 0.01
    angles, rates, accelerations = rows(c)
    demand(c, 0.5)
    for _ in range(10):
        pitch_advance(dt, c)
    angle, rate = angles[1], rates[1]
    c.faults.pitch_stuck[1] = 1.0
    pitch_advance(0.0, c)
    assert (angles[1], rates[1]) == (angle, rate)
    pitch_advance(dt, c)
    assert (angles[1], rates[1], accelerations[1]) == (angle, 0.0, -rate / dt)
    assert angles[0] == angles[2] > angle
    pitch_advance(dt, c)
    assert (angles[1], accelerations[1]) == (angle, 0.0)
    c.faults.pitch_stuck[1] = 0.0
    pitch_advance(dt, c)
    assert 0.0 < rates[1] < 0.2 * rate
