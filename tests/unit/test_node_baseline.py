"""The baseline law against an independent reading of NREL/TP-500-38060, section 7.

The reading is plain Python, line by line after the text and the controller that is distributed with
the reference model: filter, torque by regions with a rate limit, PI pitch with a gain schedule. One thing is ours:
held power is limited below region 2, where the published law drives a rotor at rest backwards.
Arithmetic differs in the order of operations only: tolerances are 1e-12.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import exp, pi, sqrt

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from meltemi import load_turbine
from meltemi.control import baseline as law
from meltemi.control import signals as s
from meltemi.control.baseline import BaselineController, BaselineState, parameters, steady_torque
from meltemi.control.controller import StartPoint
from meltemi.core.errors import InputError
from meltemi.turbine.definition import BaselineControl, Turbine

Float = NDArray[np.float64]
steady = settings(derandomize=True, deadline=None, max_examples=100)


@pytest.fixture(scope="module")
def control(turbine: Turbine) -> BaselineControl:
    return turbine.control


@dataclass
class Reading:
    """Section 7 of the report for the 5 MW turbine, with its own constants."""

    filtered: float
    torque: float
    pitch: float
    integral: float

    # Table 7-2 and the text, in full precision as the distributed controller has them
    CORNER = 1.570796  # rad/s: a quarter of the first edgewise frequency
    CUT_IN, REGION_2, RATED = 70.16224, 91.21091, 121.6805  # rad/s
    GAIN, RATED_POWER, SLIP = 2.332287, 5296610.0, 0.10
    TORQUE_RATE, TORQUE_MAXIMUM, POWER_PITCH = 15000.0, 47402.91, 0.01745329
    REFERENCE, KP, KI, KK = 122.9096, 0.01882681, 0.008068634, 0.1099965
    PITCH_MINIMUM, PITCH_MAXIMUM, PITCH_RATE = 0.0, 1.570796, 0.1396263

    def region_torque(self, speed: float, pitch: float) -> float:
        synchronous = self.RATED / (1.0 + self.SLIP)
        slope_15 = self.GAIN * self.REGION_2 * self.REGION_2 / (self.REGION_2 - self.CUT_IN)
        slope_25 = (self.RATED_POWER / self.RATED) / (self.RATED - synchronous)
        transition = (slope_25 - sqrt(slope_25 * (slope_25 - 4.0 * self.GAIN * synchronous))) / (2.0 * self.GAIN)
        if speed >= self.RATED or pitch >= self.POWER_PITCH:  # region 3: constant power
            fade = (speed - self.CUT_IN) / (self.REGION_2 - self.CUT_IN)  # not of the report
            torque = min(self.RATED_POWER / max(speed, 1.0), min(max(fade, 0.0), 1.0) * self.TORQUE_MAXIMUM)
        elif speed <= self.CUT_IN:  # region 1: no torque
            torque = 0.0
        elif speed < self.REGION_2:  # region 1 1/2: linear ramp
            torque = slope_15 * (speed - self.CUT_IN)
        elif speed < transition:  # region 2: optimal constant
            torque = self.GAIN * speed * speed
        else:  # region 2 1/2: induction generator
            torque = slope_25 * (speed - synchronous)
        return min(torque, self.TORQUE_MAXIMUM)

    def step(self, speed: float, dt: float) -> None:
        alpha = exp(-dt * self.CORNER)
        self.filtered = (1.0 - alpha) * speed + alpha * self.filtered
        rate = (self.region_torque(self.filtered, self.pitch) - self.torque) / dt
        torque = self.torque + min(max(rate, -self.TORQUE_RATE), self.TORQUE_RATE) * dt
        gain = 1.0 / (1.0 + self.pitch / self.KK)
        error = self.filtered - self.REFERENCE
        self.integral += error * dt
        self.integral = min(
            max(self.integral, self.PITCH_MINIMUM / (gain * self.KI)), self.PITCH_MAXIMUM / (gain * self.KI)
        )
        pitch = gain * self.KP * error + gain * self.KI * self.integral
        pitch = min(max(pitch, self.PITCH_MINIMUM), self.PITCH_MAXIMUM)
        rate = min(max((pitch - self.pitch) / dt, -self.PITCH_RATE), self.PITCH_RATE)
        self.torque = torque
        self.pitch = min(max(self.pitch + rate * dt, self.PITCH_MINIMUM), self.PITCH_MAXIMUM)


def machine(control: BaselineControl) -> Turbine:
    """A turbine with these settings."""
    return load_turbine("nrel5mw").replace(control=control)


class Ours:
    """The package's controller, called as the simulation calls it."""

    def __init__(self, control: BaselineControl, start: StartPoint, n_blades: int = 3) -> None:
        controller = BaselineController(machine(control))
        self.state = controller.initial_state(start)
        self.update: Callable[..., None] = controller.update
        self.measured, self.demands = s.Measurements.zeros(), s.Demands.zeros()
        self.measured[s.N_BLADES] = n_blades
        self.demands[:] = -99.0

    def step(self, speed: float, dt: float) -> None:
        self.measured[s.GENERATOR_SPEED] = speed
        self.update(self.state, self.measured, self.demands, dt)

    @property
    def torque(self) -> float:
        return float(self.demands[s.GENERATOR_TORQUE])

    @property
    def pitch(self) -> float:
        return float(self.demands[s.PITCH_DEMAND])


def start_point(speed: float = 120.0, pitch: float = 0.0, torque: float = 40000.0) -> StartPoint:
    return StartPoint(wind_speed=11.0, generator_speed=speed, pitch=pitch, generator_torque=torque)


def pair(control: BaselineControl, start: StartPoint) -> tuple[Ours, Reading]:
    """Both controllers at the same start."""
    gain = 1.0 / (1.0 + start.pitch / Reading.KK)
    integral = start.pitch / (gain * Reading.KI)
    return Ours(control, start), Reading(start.generator_speed, start.generator_torque, start.pitch, integral)


def both(control: BaselineControl, start: StartPoint, speeds: Float, dt: float) -> None:
    """Run both over the same generator speeds and compare every demand."""
    ours, reading = pair(control, start)
    for speed in speeds:
        ours.step(float(speed), dt)
        reading.step(float(speed), dt)
        assert ours.torque == pytest.approx(reading.torque, rel=1e-12, abs=1e-9)
        assert ours.pitch == pytest.approx(reading.pitch, rel=1e-12, abs=1e-14)


@pytest.mark.parametrize(
    ("speed", "region"),
    [(0.0, "1"), (50.0, "1"), (70.16224, "1"), (80.0, "1.5"), (91.0, "1.5"), (95.0, "2"), (115.0, "2"), (119.5, "2.5"),
     (121.0, "2.5"), (121.6805, "3"), (125.0, "3"), (150.0, "3")],
)  # fmt: skip
def test_steady_torque_in_each_region(control: BaselineControl, speed: float, region: str) -> None:
    x = parameters(control)
    found = steady_torque(x, speed, 0.0)
    expected = Reading(0.0, 0.0, 0.0, 0.0).region_torque(speed, 0.0)
    assert found == pytest.approx(expected, rel=1e-12, abs=1e-9)
    by_hand = {"1": 0.0, "2": 2.332287 * speed**2, "3": 5296610.0 / max(speed, 1.0)}
    if region in by_hand:
        assert found == pytest.approx(by_hand[region], rel=1e-12)


@steady
@given(speed=st.floats(1.0, 200.0), pitch=st.floats(0.0, 1.5))
def test_steady_torque_everywhere(turbine: Turbine, speed: float, pitch: float) -> None:
    found = steady_torque(parameters(turbine.control), speed, pitch)
    assert found == pytest.approx(Reading(0.0, 0.0, 0.0, 0.0).region_torque(speed, pitch), rel=1e-12, abs=1e-9)


def test_torque_is_continuous_over_the_regions(control: BaselineControl) -> None:
    x = parameters(control)
    for name in ("cut_in_speed", "optimal_speed", "transition_speed", "rated_speed"):
        at = float(getattr(x, name))
        below, above = (steady_torque(x, at * (1.0 + d), 0.0) for d in (-1e-12, 1e-12))
        # the steepest line (region 2 1/2: 3900 N m s) times 1e-12 of 120 rad/s
        assert above == pytest.approx(below, abs=1e-5), name


def test_transition_lies_between_regions_2_and_3(control: BaselineControl) -> None:
    x = parameters(control)
    # TP-500-38060, section 7.2: region 2 1/2 begins at 1,137 rpm or 119.0 rad/s
    assert x.transition_speed == pytest.approx(119.0, abs=0.1)
    assert x.synchronous_speed == pytest.approx(121.6805 / 1.1, rel=1e-12)


def test_pitched_above_a_degree_the_power_is_held_whatever_the_speed(control: BaselineControl) -> None:
    x = parameters(control)
    assert steady_torque(x, 118.0, 0.0175) == pytest.approx(5296610.0 / 118.0, rel=1e-12)
    assert steady_torque(x, 118.0, 0.0174) == pytest.approx(2.332287 * 118.0**2, rel=1e-12)


def test_torque_has_a_maximum(control: BaselineControl) -> None:
    x = parameters(control)
    assert steady_torque(x, 95.0, 0.5) == 47402.91


@pytest.mark.parametrize("speed", [-5.0, 0.0, 10.0, 70.0])
def test_a_feathered_rotor_at_rest_gets_no_torque(control: BaselineControl, speed: float) -> None:
    """Held power asked for all of it: the generator drove a parked rotor backwards with 2.7 MW."""
    assert steady_torque(parameters(control), speed, 1.5) == 0.0


@pytest.mark.parametrize("dt", [0.00125, 0.0125, 0.1])
@pytest.mark.parametrize(
    "start",
    [start_point(60.0, 0.0, 0.0), start_point(100.0, 0.0, 2.332287e4), start_point(122.9, 0.0, 43093.0),
     start_point(122.9096, 0.25, 43093.0), start_point(140.0, 1.5, 47402.91)],
)  # fmt: skip
def test_demands_are_those_of_the_reading_over_all_regions(
    control: BaselineControl, start: StartPoint, dt: float
) -> None:
    t = dt * np.arange(800)
    period = 800.0 * dt / 3.0
    both(control, start, 100.0 + 45.0 * np.sin(2.0 * pi * t / period) + 5.0 * np.sin(9.0 * t / dt), dt)


@steady
@given(
    speeds=st.lists(st.floats(0.0, 200.0), min_size=1, max_size=40),
    pitch=st.floats(0.0, 1.57),
    torque=st.floats(0.0, 47402.0),
    dt=st.floats(1e-3, 0.5),
)
def test_demands_are_those_of_the_reading_for_any_speeds(
    turbine: Turbine, speeds: list[float], pitch: float, torque: float, dt: float
) -> None:
    both(turbine.control, start_point(speeds[0] + 1.0, pitch, torque), np.array(speeds), dt)


def test_the_filter_follows_a_step_exponentially(control: BaselineControl) -> None:
    ours = Ours(control, start_point(100.0))
    for _ in range(80):
        ours.step(110.0, 0.0125)
    # exact whatever the step: 1 s at the corner frequency
    assert BaselineState(ours.state).speed == pytest.approx(110.0 - 10.0 * exp(-1.570796), rel=1e-13)


def test_the_filter_does_not_depend_on_the_step(control: BaselineControl) -> None:
    found = []
    for n in (10, 1000):
        ours = Ours(control, start_point(100.0))
        for _ in range(n):
            ours.step(110.0, 1.0 / n)
        found.append(float(BaselineState(ours.state).speed))
    assert found[0] == pytest.approx(found[1], rel=1e-12)


def test_a_start_in_steady_operation_is_bumpless(control: BaselineControl) -> None:
    start = start_point(122.9096, 0.1, 5296610.0 / 122.9096)
    ours = Ours(control, start)
    for _ in range(100):
        ours.step(122.9096, 0.0125)
    assert ours.torque == pytest.approx(start.generator_torque, rel=1e-12)
    assert ours.pitch == pytest.approx(0.1, rel=1e-12)


def test_gains_are_halved_at_the_halving_pitch(control: BaselineControl) -> None:
    small, steps = 1e-3, []
    for pitch in (0.0, 0.1099965):
        ours = Ours(control, start_point(122.9096 + small, pitch))
        ours.step(122.9096 + small, 0.01)
        steps.append(ours.pitch - pitch)
    assert steps[0] == pytest.approx(small * (0.01882681 + 0.008068634 * 0.01), rel=1e-9)
    assert steps[1] == pytest.approx(0.5 * steps[0], rel=1e-9)


def test_the_torque_changes_no_faster_than_its_limit(control: BaselineControl) -> None:
    ours = Ours(control, start_point(100.0, 0.0, 0.0))
    found = []
    for _ in range(200):
        ours.step(100.0, 0.0125)
        found.append(ours.torque)
    steps = np.diff([0.0, *found])
    assert steps.max() == pytest.approx(15000.0 * 0.0125, rel=1e-12)
    assert found[-1] == pytest.approx(2.332287e4, rel=1e-12)


@pytest.mark.parametrize(("speed", "start", "sign"), [(160.0, 0.0, 1.0), (60.0, 1.0, -1.0)])
def test_the_pitch_changes_no_faster_than_its_limit(
    control: BaselineControl, speed: float, start: float, sign: float
) -> None:
    ours = Ours(control, start_point(speed, start))
    for i in range(8):
        ours.step(speed, 0.05)
        assert ours.pitch == pytest.approx(start + sign * 0.1396263 * 0.05 * (i + 1), rel=1e-12)


def test_the_pitch_stays_within_its_limits(control: BaselineControl) -> None:
    for speed, limit in ((400.0, 1.570796), (20.0, 0.0)):
        ours = Ours(control, start_point(speed, 0.5))
        for _ in range(1000):
            ours.step(speed, 0.05)
        assert ours.pitch == limit


def test_the_integral_does_not_wind_up(control: BaselineControl) -> None:
    # long below rated, then a speed just above the reference: the pitch moves at the first call
    ours = Ours(control, start_point(90.0))
    for _ in range(2000):
        ours.step(90.0, 0.05)
    assert ours.pitch == 0.0
    assert BaselineState(ours.state).integral == 0.0
    calls = 0
    while ours.pitch == 0.0 and calls < 100:
        ours.step(135.0, 0.05)
        calls += 1
    # only the filter delays: 90 + 45 (1 - exp(-w t)) passes the reference after 0.84 s
    assert calls == int(np.log(45.0 / (135.0 - 122.9096)) / 1.570796 / 0.05) + 1


def test_the_integral_is_held_at_the_upper_limit(control: BaselineControl) -> None:
    ours = Ours(control, start_point(200.0, 1.5))
    for _ in range(1000):
        ours.step(200.0, 0.05)
    gain = 1.0 / (1.0 + 1.570796 / 0.1099965)
    assert BaselineState(ours.state).integral == pytest.approx(1.570796 / (gain * 0.008068634), rel=1e-12)


@pytest.mark.parametrize("blades", [2, 3])
def test_all_blades_get_the_same_pitch_and_nothing_else_is_demanded(control: BaselineControl, blades: int) -> None:
    ours = Ours(control, start_point(130.0, 0.2), n_blades=blades)
    ours.step(130.0, 0.0125)
    expected = np.full(len(s.Demands), -99.0)
    expected[s.GENERATOR_TORQUE] = ours.torque
    expected[s.PITCH_DEMAND : s.PITCH_DEMAND + blades] = ours.pitch
    np.testing.assert_array_equal(ours.demands, expected)
    assert ours.pitch > 0.1


def test_numbers_of_another_turbine_are_used(turbine: Turbine) -> None:
    other = turbine.control.replace(**{"torque.optimal_gain": 1.0, "torque.slip": 0.05, "pitch.minimum": -0.02})
    x = parameters(other)
    assert steady_torque(x, 100.0, 0.0) == pytest.approx(1e4, rel=1e-12)
    ours = Ours(other, start_point(50.0))
    for _ in range(50):
        ours.step(50.0, 0.1)
    assert ours.pitch == pytest.approx(-0.02, rel=1e-12)


def test_a_sample_time_is_handed_on(control: BaselineControl) -> None:
    assert BaselineController(machine(control)).sample_time is None
    assert BaselineController(machine(control), sample_time=0.1).sample_time == 0.1
    assert BaselineController(machine(control)).name == "baseline"


def test_held_torque(control: BaselineControl) -> None:
    """Region 3 with constant torque (C-2a): rated power at the reference speed, the regions below unchanged."""
    x, other = parameters(control.replace(**{"torque.hold": "torque"})), parameters(control)
    reference, rated = control.pitch.reference_speed, control.torque.rated_power
    for speed in (0.95 * reference, reference, 1.1 * reference):
        assert steady_torque(x, speed, 0.1) == pytest.approx(rated / reference, rel=1e-15)
    assert steady_torque(x, reference, 0.1) == pytest.approx(steady_torque(other, reference, 0.1), rel=1e-15)
    for speed in (50.0, 80.0, 100.0, 0.985 * reference):
        assert steady_torque(x, speed, 0.0) == steady_torque(other, speed, 0.0)
    low = 0.5 * (control.torque.cut_in_speed + control.torque.optimal_speed)  # where held torque is limited
    assert steady_torque(x, low, 0.1) == steady_torque(other, low, 0.1) > 0.0


def test_smoothing(control: BaselineControl) -> None:
    """Held power comes gradually (C-5a); without smoothing the law is the published one to the bit."""
    start = StartPoint(11.0, 118.0, 0.0, 3.5e4)
    assert BaselineState(BaselineController(machine(control)).initial_state(start)).smoothing == 0.0
    sharp, smooth = parameters(control), parameters(control)
    width = 0.005
    smooth.smoothing = width
    speed, threshold = 115.0, control.torque.power_pitch
    low, high = law.law_torque(sharp, speed), min(control.torque.rated_power / speed, control.torque.maximum_torque)
    assert steady_torque(sharp, speed, threshold - 1e-12) == low
    assert steady_torque(sharp, speed, threshold) == high
    assert steady_torque(smooth, speed, threshold) == pytest.approx(0.5 * (low + high), rel=1e-12)
    share = np.array([(steady_torque(smooth, speed, threshold + k * width) - low) / (high - low) for k in (-4, 1, 4)])
    assert share == pytest.approx(0.5 + 0.5 * np.tanh([-4.0, 1.0, 4.0]), rel=1e-9)
    # above the speed of region 3 nothing changes, and at it nothing jumps
    rated = control.torque.rated_speed
    for pitch in (0.0, threshold, 0.1):
        assert steady_torque(smooth, rated + 1.0, pitch) == steady_torque(sharp, rated + 1.0, pitch)
        assert steady_torque(smooth, rated * (1.0 - 1e-10), pitch) == pytest.approx(steady_torque(smooth, rated, pitch))


@pytest.mark.parametrize("width", [-0.01, np.inf, np.nan])
def test_smoothing_is_an_angle(control: BaselineControl, width: float) -> None:
    with pytest.raises(InputError, match="smoothing"):
        BaselineController(machine(control), smoothing=width)
