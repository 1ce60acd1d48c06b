"""The baseline controller: torque by regions, gain-scheduled PI pitch.

The law of Jonkman et al. (2009), section 7, with the details of the controller distributed with
OpenFAST: first-order filter of the generator speed; torque in regions 1, 1 1/2, 2, 2 1/2 and 3,
rate-limited; pitch PI with gains divided by 1 + pitch / gain_halving_pitch, integral held within the
pitch limits, pitch rate-limited. All numbers come from ``turbine.control``.

Reference: docs/theory/control.md (C-1 to C-9, C-9g).
"""

from __future__ import annotations

import math
from math import exp, tanh
from typing import TYPE_CHECKING

import numpy as np
from numpy import float64
from numpy.typing import NDArray

from meltemi.compiler import Table, crossed, kernel, number, whole
from meltemi.control.controller import Controller, StartPoint
from meltemi.control.signals import Demands, Measurements
from meltemi.core.errors import InputError
from meltemi.turbine.definition import BaselineControl

if TYPE_CHECKING:
    from meltemi.turbine.power_turbine import AnyTurbine

Float = NDArray[float64]
MOTION_BAND = 3.0
"""Highest frequency of the feedback of the tower-top motion over its centre frequency, and this over the lowest."""


class BaselineState(Table, title="baseline controller"):
    """Parameters and states; parameters are data, so another turbine needs no new compilation."""

    filter_frequency: float = number("rad/s", "corner frequency of the low-pass filter of the generator speed")
    cut_in_speed: float = number("rad/s", "generator speed below which there is no torque")
    optimal_speed: float = number("rad/s", "generator speed at which region 2 begins")
    transition_speed: float = number("rad/s", "generator speed at which region 2 1/2 begins")
    rated_speed: float = number("rad/s", "generator speed at which region 3 begins")
    synchronous_speed: float = number("rad/s", "generator speed of zero torque on the line of region 2 1/2")
    transition_slope: float = number("N m s/rad", "slope of that line")
    optimal_gain: float = number("N m s^2/rad^2", "torque over the squared speed in region 2")
    rated_power: float = number("W", "rated mechanical power")
    maximum_torque: float = number("N m", "torque limit")
    torque_rate: float = number("N m/s", "limit of the torque rate")
    power_pitch: float = number("rad", "pitch above which the power is held")
    reference_speed: float = number("rad/s", "reference of the pitch loop")
    proportional_gain: float = number("s", "gain at zero pitch")
    integral_gain: float = number("-", "gain at zero pitch")
    gain_halving_pitch: float = number("rad", "pitch at which the gains are halved")
    minimum_pitch: float = number("rad", "lower pitch limit")
    maximum_pitch: float = number("rad", "upper pitch limit")
    pitch_rate: float = number("rad/s", "limit of the pitch rate")
    smoothing: float = number("rad", "half-width in pitch of the transition of the torque law at power_pitch; 0: none")
    torque_speed: float = number("rad/s", "speed at which held torque gives rated power; 0: the power is held")
    motion_gain: float = number("rad s/m", "pitch over the velocity of the tower top downwind; 0: no such feedback")
    motion_frequency: float = number("rad/s", "centre frequency of that feedback")
    speed: float = number("rad/s", "state: filtered generator speed")
    integral: float = number("rad", "state: integral of the speed error, rad/s times s")
    torque: float = number("N m", "state: last torque")
    pitch: float = number("rad", "state: last pitch")
    velocity: float = number("m/s", "state: velocity of the tower top, without its mean")
    motion: float = number("m/s", "state: the same without high frequencies")
    switches: float = number("-", "state: switches within the difference step of a parameter, in derivative runs")


@kernel
def law_torque(x: BaselineState, speed: float) -> float:
    """Torque [N m] of regions 1 to 2 1/2 for a generator speed [rad/s] (C-2 to C-4)."""
    if speed <= x.cut_in_speed:
        return 0.0
    if speed < x.optimal_speed:
        return (
            (speed - x.cut_in_speed)
            / (x.optimal_speed - x.cut_in_speed)
            * x.optimal_gain
            * x.optimal_speed
            * x.optimal_speed
        )
    if speed < x.transition_speed:
        return x.optimal_gain * speed * speed
    return x.transition_slope * (speed - x.synchronous_speed)


@kernel
def limited_power_torque(x: BaselineState, speed: float) -> float:
    """Torque [N m] of region 3 (C-2, C-2a); below region 2 its limit falls, to nothing at cut-in (C-5).

    Otherwise a feathered rotor at standstill would get the full torque and be driven backwards.
    """
    if speed <= x.cut_in_speed:
        return 0.0
    most = x.maximum_torque
    if speed < x.optimal_speed:
        most = most * (speed - x.cut_in_speed) / (x.optimal_speed - x.cut_in_speed)
    at = x.torque_speed if x.torque_speed > 0.0 else max(speed, 1e-3)
    return min(x.rated_power / at, most)


@kernel
def steady_torque(x: BaselineState, speed: float, pitch: float) -> float:
    """Torque [N m] of the regions for a generator speed [rad/s] and the last pitch [rad] (C-2 to C-5).

    Region 3 begins at once at ``power_pitch``, or gradually if there is smoothing (C-5a).
    """
    constant_power = limited_power_torque(x, speed)
    if x.smoothing > 0.0 and speed < x.rated_speed:
        share = 0.5 + 0.5 * tanh((pitch - x.power_pitch) / x.smoothing)
        torque = law_torque(x, speed) + share * (constant_power - law_torque(x, speed))
    elif speed >= x.rated_speed or pitch >= x.power_pitch:
        torque = constant_power
    else:
        torque = law_torque(x, speed)
    return min(torque, x.maximum_torque)


@kernel
def switches_near(x: BaselineState, speed: float, torque_change: float, pitch: float, low: float, high: float) -> float:
    """Number of switches of the law within the difference step of a parameter, in derivative runs.

    Args:
      torque_change, pitch: values to which the limits are applied.
      low, high: distances of the integral from its limits.
    """
    gradual = x.smoothing > 0.0
    near = 0.0
    if not gradual and speed < x.rated_speed:
        near += crossed(x.pitch - x.power_pitch)
    if not gradual and x.pitch < x.power_pitch:
        near += crossed(speed - x.rated_speed)
    near += crossed(speed - x.cut_in_speed) + crossed(speed - x.optimal_speed)
    # laws that contribute to the torque: 1 - tanh(4) is less than 1e-3
    if x.pitch < x.power_pitch + 4.0 * x.smoothing:
        near += crossed(speed - x.transition_speed)
    if x.pitch > x.power_pitch - 4.0 * x.smoothing and x.torque_speed == 0.0:
        near += crossed(speed - x.rated_power / x.maximum_torque)
    near += crossed(torque_change) + crossed(pitch - x.minimum_pitch) + crossed(pitch - x.maximum_pitch)
    return near + crossed(low) + crossed(high)


@kernel
def follow_motion(x: BaselineState, acceleration: float, dt: float) -> None:
    """Velocity of the tower top, from its acceleration [m/s^2] downwind (C-9g)."""
    slow, fast = exp(-dt * x.motion_frequency / MOTION_BAND), exp(-dt * x.motion_frequency * MOTION_BAND)
    x.velocity = slow * (x.velocity + dt * acceleration)
    x.motion = fast * x.motion + (1.0 - fast) * x.velocity


@kernel
def motion_pitch(x: BaselineState) -> float:
    """Pitch [rad] against this motion: zero at the minimum pitch of the law, with symmetric limits (C-9g)."""
    most = min(x.pitch - x.minimum_pitch, x.maximum_pitch - x.pitch)
    return min(max(x.motion_gain * x.motion, -most), most)


@kernel
def law(x: BaselineState, speed: float, measured: Measurements, demands: Demands, dt: float) -> None:
    """One call of the law with a generator speed [rad/s], measured or filtered."""
    alpha = exp(-dt * x.filter_frequency)
    x.speed = (1.0 - alpha) * speed + alpha * x.speed
    # torque
    change = steady_torque(x, x.speed, x.pitch) - x.torque
    step = x.torque_rate * dt
    x.torque += min(max(change, -step), step)
    # pitch
    schedule = 1.0 / (1.0 + x.pitch / x.gain_halving_pitch)
    error = x.speed - x.reference_speed
    integral = x.integral + error * dt
    low, high = x.minimum_pitch / (schedule * x.integral_gain), x.maximum_pitch / (schedule * x.integral_gain)
    x.integral = min(max(integral, low), high)
    wanted = schedule * (x.proportional_gain * error + x.integral_gain * x.integral)
    x.switches += switches_near(x, x.speed, abs(change) - step, wanted, integral - low, high - integral)
    wanted = min(max(wanted, x.minimum_pitch), x.maximum_pitch)
    step = x.pitch_rate * dt
    x.switches += crossed(abs(wanted - x.pitch) - step)
    x.pitch += min(max(wanted - x.pitch, -step), step)
    x.pitch = min(max(x.pitch, x.minimum_pitch), x.maximum_pitch)
    demands.generator_torque = x.torque
    if x.motion_gain != 0.0:
        follow_motion(x, measured.fore_aft_acceleration, dt)
    for b in range(whole(measured.n_blades)):
        demands.pitch[b] = x.pitch + motion_pitch(x)


@kernel
def update(state: Float, measurements: Float, demands: Float, dt: float) -> None:
    """One call of the controller."""
    measured = Measurements(measurements)
    law(BaselineState(state), measured.generator_speed, measured, Demands(demands), dt)


def parameters(control: BaselineControl) -> BaselineState:
    """Parameters of the law, with zero states."""
    t, p = control.torque, control.pitch
    x = BaselineState.of(filter_frequency=control.filter_frequency)
    for name in ("cut_in_speed", "optimal_speed", "rated_speed", "optimal_gain", "rated_power", "maximum_torque"):
        setattr(x, name, getattr(t, name))
    x.torque_rate, x.power_pitch = t.rate_limit, t.power_pitch
    x.torque_speed = p.reference_speed if t.hold == "torque" else 0.0
    for name in ("reference_speed", "proportional_gain", "integral_gain", "gain_halving_pitch"):
        setattr(x, name, getattr(p, name))
    x.motion_gain, x.motion_frequency = p.motion_gain, p.motion_frequency
    x.minimum_pitch, x.maximum_pitch, x.pitch_rate = p.minimum, p.maximum, p.rate_limit
    # region 2 1/2: a line with the slope of an induction machine that reaches rated power at rated speed
    synchronous = t.rated_speed / (1.0 + t.slip)
    slope = t.rated_power / t.rated_speed / (t.rated_speed - synchronous)
    x.synchronous_speed, x.transition_slope = synchronous, slope
    root = np.sqrt(max(slope * (slope - 4.0 * t.optimal_gain * synchronous), 0.0))
    x.transition_speed = (slope - root) / (2.0 * t.optimal_gain)
    return x


def start_state(control: BaselineControl, start: StartPoint, smoothing: float = 0.0) -> BaselineState:
    """Parameters, and states at an operating point, for a start without a jump of the demands."""
    x = parameters(control)
    x.smoothing = smoothing
    schedule = 1.0 / (1.0 + start.pitch / control.pitch.gain_halving_pitch)
    x.speed, x.pitch, x.torque = start.generator_speed, start.pitch, start.generator_torque
    x.integral = start.pitch / (schedule * control.pitch.integral_gain)
    return x


def BaselineController(turbine: AnyTurbine, *, sample_time: float | None = None, smoothing: float = 0.0) -> Controller:
    """Baseline controller of a turbine.

    Args:
      turbine: turbine with the settings, ``turbine.control``.
      sample_time: [s] time between calls; by default every time step.
      smoothing: [rad] pitch, zero or more: half the width of the transition of the torque from region 2 1/2 to
        constant power (C-5a); zero, the published law, is discontinuous there and has no derivative.

    Raises:
      InputError: ``smoothing`` is negative or not finite.
    """
    if not (math.isfinite(smoothing) and smoothing >= 0.0):
        raise InputError(f"BaselineController: smoothing must be zero or a positive angle [rad], found {smoothing!r}")
    law = turbine.control  # raise the error for an invalid turbine now
    return Controller(
        update=update,
        init=lambda start: start_state(law, start, smoothing),
        sample_time=sample_time,
        name="baseline",
        uses_loads=law.pitch.motion_gain != 0.0,
        state_names=tuple(BaselineState.names),
    )
