"""The baseline controller: torque by regions, gain-scheduled PI pitch.

The law of Jonkman et al. (2009), section 7, with the details of the controller distributed with
OpenFAST: first-order filter of the generator speed; torque in regions 1, 1 1/2, 2, 2 1/2 and 3,
rate-limited; pitch PI with gains divided by 1 + pitch / gain_halving_pitch, integral held within the
pitch limits, pitch rate-limited. All numbers come from ``turbine.control``.

Reference: docs/theory/control.md (C-1 to C-9).
"""

from __future__ import annotations

import math
from math import exp, tanh

import numpy as np
from numpy import float64
from numpy.typing import NDArray

from meltemi.control import signals as s
from meltemi.control.controller import Controller, StartPoint
from meltemi.core.errors import InputError
from meltemi.core.kernel import kernel
from meltemi.maths.generic import crossed, whole
from meltemi.maths.tables import Table, View, number
from meltemi.turbine.definition import BaselineControl

Float = NDArray[float64]


class BaselineState(Table, title="baseline controller"):
    """State vector: parameters first, so that another turbine needs no other compilation."""

    filter_frequency: float = number("rad/s", "of the generator speed's low-pass")
    cut_in_speed: float = number("rad/s", "below which there is no torque")
    optimal_speed: float = number("rad/s", "where region 2 begins")
    transition_speed: float = number("rad/s", "where region 2 1/2 begins")
    rated_speed: float = number("rad/s", "where region 3 begins")
    synchronous_speed: float = number("rad/s", "at which the line of region 2 1/2 has no torque")
    transition_slope: float = number("N m s/rad", "of that line")
    optimal_gain: float = number("N m s^2/rad^2", "region 2")
    rated_power: float = number("W", "mechanical")
    maximum_torque: float = number("N m", "limit")
    torque_rate: float = number("N m/s", "limit")
    power_pitch: float = number("rad", "above which the power is held")
    reference_speed: float = number("rad/s", "of the pitch loop")
    proportional_gain: float = number("s", "at zero pitch")
    integral_gain: float = number("-", "at zero pitch")
    gain_halving_pitch: float = number("rad", "gain schedule")
    minimum_pitch: float = number("rad", "limit")
    maximum_pitch: float = number("rad", "limit")
    pitch_rate: float = number("rad/s", "limit")
    smoothing: float = number("rad", "of pitch, over which the torque law changes at power_pitch; 0 switches at once")
    speed: float = number("rad/s", "state: filtered generator speed")
    integral: float = number("rad", "state: integral of the speed error, rad/s times s")
    torque: float = number("N m", "state: last torque")
    pitch: float = number("rad", "state: last pitch")
    switches: float = number("-", "state: branches that a difference step would have changed, in derivative runs")


FILTER, CUT_IN, OPTIMAL, TRANSITION, RATED, SYNCHRONOUS, SLOPE, GAIN, RATED_POWER, MAX_TORQUE, TORQUE_RATE = (
    BaselineState.slots(
        "filter_frequency cut_in_speed optimal_speed transition_speed rated_speed synchronous_speed transition_slope "
        "optimal_gain rated_power maximum_torque torque_rate"
    )
)
POWER_PITCH, REFERENCE, KP, KI, HALVING, MIN_PITCH, MAX_PITCH, PITCH_RATE, SMOOTHING = BaselineState.slots(
    "power_pitch reference_speed proportional_gain integral_gain gain_halving_pitch "
    "minimum_pitch maximum_pitch pitch_rate smoothing"
)
SPEED, INTEGRAL, TORQUE, PITCH, SWITCHES = BaselineState.slots("speed integral torque pitch switches")


@kernel
def law_torque(x: Float, speed: float) -> float:
    """Torque [N m] of regions 1 to 2 1/2 for a generator speed [rad/s] (C-2 to C-4)."""
    if speed <= x[CUT_IN]:
        return 0.0 * speed
    if speed < x[OPTIMAL]:
        return (speed - x[CUT_IN]) / (x[OPTIMAL] - x[CUT_IN]) * x[GAIN] * x[OPTIMAL] * x[OPTIMAL]
    if speed < x[TRANSITION]:
        return x[GAIN] * speed * speed
    return x[SLOPE] * (speed - x[SYNCHRONOUS])


@kernel
def held_torque(x: Float, speed: float) -> float:
    """Torque [N m] that holds rated power; below region 2 its limit falls, to nothing at cut-in (C-5).

    Without that a rotor that stands feathered would get all of the torque, and be driven backwards.
    """
    if speed <= x[CUT_IN]:
        return 0.0 * speed
    most = x[MAX_TORQUE]
    if speed < x[OPTIMAL]:
        most = most * (speed - x[CUT_IN]) / (x[OPTIMAL] - x[CUT_IN])
    return min(x[RATED_POWER] / max(speed, 1e-3), most)


@kernel
def steady_torque(x: Float, speed: float, pitch: float) -> float:
    """Torque [N m] of the regions for a generator speed [rad/s] and the last pitch [rad] (C-2 to C-5).

    Held power begins at once at ``power_pitch``, or gradually if there is smoothing (C-5a).
    """
    held = held_torque(x, speed)
    if x[SMOOTHING] > 0.0 and speed < x[RATED]:
        share = 0.5 + 0.5 * tanh((pitch - x[POWER_PITCH]) / x[SMOOTHING])
        torque = law_torque(x, speed) + share * (held - law_torque(x, speed))
    elif speed >= x[RATED] or pitch >= x[POWER_PITCH]:
        torque = held
    else:
        torque = law_torque(x, speed)
    return min(torque, x[MAX_TORQUE])


@kernel
def switches_near(x: Float, speed: float, torque_change: float, pitch: float, low: float, high: float) -> float:
    """How many of the law's switches a difference step would change, in derivative runs.

    Args:
      torque_change, pitch: what the limits are applied to.
      low, high: by how much the integral is within its limits.
    """
    gradual = x[SMOOTHING] > 0.0
    near = 0.0
    if not gradual and speed < x[RATED]:
        near += crossed(x[PITCH] - x[POWER_PITCH])
    if not gradual and x[PITCH] < x[POWER_PITCH]:
        near += crossed(speed - x[RATED])
    near += crossed(speed - x[CUT_IN]) + crossed(speed - x[OPTIMAL])
    # laws that have a share in the torque: 1 - tanh(4) is less than 1e-3
    if x[PITCH] < x[POWER_PITCH] + 4.0 * x[SMOOTHING]:
        near += crossed(speed - x[TRANSITION])
    if x[PITCH] > x[POWER_PITCH] - 4.0 * x[SMOOTHING]:
        near += crossed(speed - x[RATED_POWER] / x[MAX_TORQUE])
    near += crossed(torque_change) + crossed(pitch - x[MIN_PITCH]) + crossed(pitch - x[MAX_PITCH])
    return near + crossed(low) + crossed(high)


@kernel
def law(x: Float, speed: float, measured: Float, demands: Float, dt: float) -> None:
    """One call of the law for a generator speed [rad/s], which may be a filtered one."""
    alpha = exp(-dt * x[FILTER])
    x[SPEED] = (1.0 - alpha) * speed + alpha * x[SPEED]
    # torque
    change = steady_torque(x, x[SPEED], x[PITCH]) - x[TORQUE]
    step = x[TORQUE_RATE] * dt
    x[TORQUE] += min(max(change, -step), step)
    # pitch
    schedule = 1.0 / (1.0 + x[PITCH] / x[HALVING])
    error = x[SPEED] - x[REFERENCE]
    integral = x[INTEGRAL] + error * dt
    low, high = x[MIN_PITCH] / (schedule * x[KI]), x[MAX_PITCH] / (schedule * x[KI])
    x[INTEGRAL] = min(max(integral, low), high)
    wanted = schedule * (x[KP] * error + x[KI] * x[INTEGRAL])
    x[SWITCHES] += switches_near(x, x[SPEED], abs(change) - step, wanted, integral - low, high - integral)
    wanted = min(max(wanted, x[MIN_PITCH]), x[MAX_PITCH])
    step = x[PITCH_RATE] * dt
    x[SWITCHES] += crossed(abs(wanted - x[PITCH]) - step)
    x[PITCH] += min(max(wanted - x[PITCH], -step), step)
    x[PITCH] = min(max(x[PITCH], x[MIN_PITCH]), x[MAX_PITCH])
    demands[s.GENERATOR_TORQUE] = x[TORQUE]
    for blade in range(whole(measured[s.N_BLADES])):
        demands[s.PITCH_DEMAND + blade] = x[PITCH]


@kernel
def update(x: Float, measured: Float, demands: Float, dt: float) -> None:
    """One call of the controller."""
    law(x, measured[s.GENERATOR_SPEED], measured, demands, dt)


def parameters(control: BaselineControl) -> Float:
    """State vector with its parameters set and its states zero."""
    t, p = control.torque, control.pitch
    x = BaselineState.zeros()
    view = View(BaselineState, x)
    view["filter_frequency"] = control.filter_frequency
    for name in ("cut_in_speed", "optimal_speed", "rated_speed", "optimal_gain", "rated_power", "maximum_torque"):
        view[name] = getattr(t, name)
    view["torque_rate"], view["power_pitch"] = t.rate_limit, t.power_pitch
    for name in ("reference_speed", "proportional_gain", "integral_gain", "gain_halving_pitch"):
        view[name] = getattr(p, name)
    view["minimum_pitch"], view["maximum_pitch"], view["pitch_rate"] = p.minimum, p.maximum, p.rate_limit
    # region 2 1/2: a line with the slope of an induction machine that reaches rated power at rated speed
    synchronous = t.rated_speed / (1.0 + t.slip)
    slope = t.rated_power / t.rated_speed / (t.rated_speed - synchronous)
    view["synchronous_speed"], view["transition_slope"] = synchronous, slope
    root = np.sqrt(max(slope * (slope - 4.0 * t.optimal_gain * synchronous), 0.0))
    view["transition_speed"] = (slope - root) / (2.0 * t.optimal_gain)
    return x


def start_state(control: BaselineControl, start: StartPoint, smoothing: float = 0.0) -> Float:
    """State vector at an operating point, from which nothing jumps."""
    x = parameters(control)
    view = View(BaselineState, x)
    view["smoothing"] = smoothing
    schedule = 1.0 / (1.0 + start.pitch / control.pitch.gain_halving_pitch)
    view["speed"], view["pitch"], view["torque"] = start.generator_speed, start.pitch, start.generator_torque
    view["integral"] = start.pitch / (schedule * control.pitch.integral_gain)
    return x


def baseline(control: BaselineControl, sample_time: float | None = None, *, smoothing: float = 0.0) -> Controller:
    """The baseline controller with the settings of a turbine.

    Args:
      sample_time: [s] between calls; by default every time step.
      smoothing: [rad] of pitch, zero or more: half the width over which the torque goes from the law of region 2 1/2 to
        held power (C-5a); zero, the published law, jumps there, where it has no derivative.
    """

    if not (math.isfinite(smoothing) and smoothing >= 0.0):
        raise InputError(f"baseline: smoothing must be zero or a positive angle [rad], found {smoothing!r}")

    return Controller(
        update=update,
        init=lambda start: start_state(control, start, smoothing),
        sample_time=sample_time,
        name="baseline",
        uses_loads=False,
        state_names=tuple(BaselineState.names),
    )
