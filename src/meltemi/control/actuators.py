"""Pitch actuators and yaw drive: what lies between a controller's demands and the machine.

The pitch actuator is a second-order system stepped exactly under a held demand, then limited in rate
and angle. Its ideal variant has the demanded angle at once and no rate, so it turns the blades
without inertial loads. A blade or flap that is stuck stops where it is; a blade that runs away goes to the end of its
range at a rate of its own, as if that were demanded.

Reference: docs/theory/control.md (C-10 to C-13, C-55 to C-58).
"""

from __future__ import annotations

from math import cos, cosh, exp, sin, sinh, sqrt

from numpy import float64
from numpy.typing import NDArray

from meltemi.aero.flaps import ACCELERATION as FLAP_ACCELERATION
from meltemi.aero.flaps import ANGLE as FLAP_ANGLE
from meltemi.aero.flaps import RATE as FLAP_RATE
from meltemi.aero.flaps import SWITCHES as FLAP_SWITCHES
from meltemi.control import faults as f
from meltemi.control import signals as s
from meltemi.core.kernel import kernel
from meltemi.maths.generic import crossed
from meltemi.maths.tables import MAX_BLADES, Numbers, Table, blades, number
from meltemi.turbine import exchange as ex

Float = NDArray[float64]


class Actuators(Table):
    """Parameters."""

    pitch_ideal: float = number("-", "1: pitch follows the demand at once")
    pitch_frequency: float = number("rad/s", "natural frequency")
    pitch_damping: float = number("-", "damping ratio")
    pitch_rate: float = number("rad/s", "limit")
    pitch_minimum: float = number("rad", "limit")
    pitch_maximum: float = number("rad", "limit")
    brake_torque: float = number("N m", "of the full brake, on the generator's shaft")
    yaw_rate: float = number("rad/s", "limit of the yaw drive")
    yaw_acceleration: float = number("rad/s^2", "of the yaw drive; 0: its rate is there at once")
    yaw_friction: float = number("N m", "of the bearing while it turns")
    yaw_hold: float = number("N m", "at which the standing drive slips; negative: never")
    pitch_offset: Numbers = blades("rad", "by which each blade stands beyond what its actuator believes")


PITCH_IDEAL, PITCH_FREQUENCY, PITCH_DAMPING, PITCH_RATE, PITCH_MINIMUM, PITCH_MAXIMUM = Actuators.slots(
    "pitch_ideal pitch_frequency pitch_damping pitch_rate pitch_minimum pitch_maximum"
)
BRAKE_TORQUE, YAW_RATE, YAW_ACCELERATION, YAW_FRICTION, YAW_HOLD, OFFSET = Actuators.slots(
    "brake_torque yaw_rate yaw_acceleration yaw_friction yaw_hold pitch_offset"
)


ANGLE, RATE, ACCELERATION, SWITCHES = ex.PitchMotion.slots("angle rate acceleration switches")


@kernel
def second_order_step(x: float, v: float, w: float, z: float, dt: float) -> tuple[float, float]:
    """Exact step of x'' + 2 z w x' + w^2 x = 0 (C-11)."""
    e = exp(-z * w * dt)
    d = 1.0 - z * z
    if d > 1e-12:
        wd = w * sqrt(d)
        c, s_w = cos(wd * dt), sin(wd * dt) / wd
    elif d < -1e-12:
        wd = w * sqrt(-d)
        c, s_w = cosh(wd * dt), sinh(wd * dt) / wd
    else:
        c, s_w = 1.0, dt
    return e * (x * (c + z * w * s_w) + v * s_w), e * (v * (c - z * w * s_w) - w * w * x * s_w)


@kernel
def limited_step(
    angle: float,
    rate: float,
    demand: float,
    w: float,
    z: float,
    most: float,
    low: float,
    high: float,
    dt: float,
) -> tuple[float, float, float]:
    """Angle and rate of a second-order actuator after ``dt``, within its limits (C-11 to C-13).

    Args:
      demand: held, within ``low`` and ``high``.
      w, z: natural frequency [rad/s] and damping ratio.
      most: limit of the rate.

    Returns:
      Angle, rate, and what the limit of the rate adds to the switches.
    """
    error, free = second_order_step(angle - demand, rate, w, z, dt)
    new, limited = demand + error, min(max(free, -most), most)
    if limited != free:
        new = angle + 0.5 * (rate + limited) * dt
    # within the step the free motion may be faster than at its ends
    new = min(max(new, angle - most * dt), angle + most * dt)
    if new < low or new > high:
        new = min(max(new, low), high)
        limited = 0.0 * limited
    return new, limited, crossed(abs(free) - most)


@kernel
def pitch_advance(p: Float, demands: Float, faults: Float, pitch: Float, dt: float) -> None:
    """Pitch angles after ``dt`` under held demands; with the ideal actuator at once."""
    for b in range(pitch.shape[1]):
        if faults[f.PITCH_STUCK + b] > 0.0:
            if dt > 0.0:
                pitch[ACCELERATION, b] = -pitch[RATE, b] / dt
                pitch[RATE, b] = 0.0
            continue
        demand, most, run = demands[s.PITCH_DEMAND + b], p[PITCH_RATE], faults[f.PITCH_RUN + b]
        if run != 0.0:
            demand, most = (p[PITCH_MAXIMUM] if run > 0.0 else p[PITCH_MINIMUM]), abs(run)
        if dt > 0.0:
            pitch[SWITCHES, b] += crossed(demand - p[PITCH_MINIMUM]) + crossed(demand - p[PITCH_MAXIMUM])
        demand = min(max(demand, p[PITCH_MINIMUM]), p[PITCH_MAXIMUM])
        angle, rate = pitch[ANGLE, b] - p[OFFSET + b], pitch[RATE, b]
        if p[PITCH_IDEAL] > 0.0:
            if run != 0.0:
                demand = min(max(demand, angle - most * dt), angle + most * dt)
            pitch[ANGLE, b] = demand + p[OFFSET + b]
            continue
        if dt <= 0.0:
            continue
        w, z = p[PITCH_FREQUENCY], p[PITCH_DAMPING]
        new, new_rate, switches = limited_step(angle, rate, demand, w, z, most, p[PITCH_MINIMUM], p[PITCH_MAXIMUM], dt)
        pitch[SWITCHES, b] += switches
        pitch[ANGLE, b] = new + p[OFFSET + b]
        pitch[RATE, b] = new_rate
        pitch[ACCELERATION, b] = (new_rate - rate) / dt


class FlapActuators(Table, axes="flap"):
    """Parameters of the flaps' actuators."""

    ideal: Numbers = number("-", "1: the flap follows the demand at once")
    frequency: Numbers = number("rad/s", "natural frequency")
    damping: Numbers = number("-", "damping ratio")
    rate: Numbers = number("rad/s", "limit")
    minimum: Numbers = number("rad", "limit")
    maximum: Numbers = number("rad", "limit")


F_IDEAL, F_FREQUENCY, F_DAMPING, F_RATE, F_MINIMUM, F_MAXIMUM = FlapActuators.slots(
    "ideal frequency damping rate minimum maximum"
)


@kernel
def flap_advance(p: Float, demands: Float, faults: Float, flap: Float, dt: float) -> None:
    """Deflections after ``dt`` under held demands; with ideal actuators at once, within their limits."""
    for j in range(flap.shape[1]):
        for b in range(flap.shape[2]):
            if faults[f.FLAP_STUCK + MAX_BLADES * j + b] > 0.0:
                if dt > 0.0:
                    flap[FLAP_ACCELERATION, j, b] = -flap[FLAP_RATE, j, b] / dt
                    flap[FLAP_RATE, j, b] = 0.0
                continue
            demand = demands[s.FLAP_DEMAND + MAX_BLADES * j + b]
            low, high, most = p[F_MINIMUM, j], p[F_MAXIMUM, j], p[F_RATE, j]
            if dt > 0.0:
                flap[FLAP_SWITCHES, j, b] += crossed(demand - low) + crossed(demand - high)
            demand = min(max(demand, low), high)
            angle, rate = flap[FLAP_ANGLE, j, b], flap[FLAP_RATE, j, b]
            if p[F_IDEAL, j] > 0.0:
                flap[FLAP_ANGLE, j, b] = demand
                continue
            if dt <= 0.0:
                continue
            new, new_rate, switches = limited_step(
                angle, rate, demand, p[F_FREQUENCY, j], p[F_DAMPING, j], most, low, high, dt
            )
            flap[FLAP_SWITCHES, j, b] += switches
            flap[FLAP_ANGLE, j, b] = new
            flap[FLAP_RATE, j, b] = new_rate
            flap[FLAP_ACCELERATION, j, b] = (new_rate - rate) / dt


@kernel
def drive_advance(p: Float, demands: Float, faults: Float, drive: Float) -> None:
    """Generator torque and brake under held demands."""
    drive[ex.GENERATOR_TORQUE] = demands[s.GENERATOR_TORQUE] * faults[f.GRID] * faults[f.GENERATOR]
    share = max(demands[s.BRAKE] * faults[f.BRAKE], faults[f.BRAKE_APPLIED])
    drive[ex.BRAKE_TORQUE] = p[BRAKE_TORQUE] * min(max(share, 0.0), 1.0)


@kernel
def slid(rest: float, angle: float, most: float) -> float:
    """Angle at which a spring is free that slides where it would be stretched by more than ``most`` (C-57)."""
    return min(max(rest, angle - most), angle + most)


@kernel
def yaw_advance(
    p: Float, stiffness: float, demands: Float, faults: Float, drive: Float, angle: float, speed: float, dt: float
) -> None:
    """Yaw drive, its brake and the bearing's friction after ``dt`` under a held demand (C-55 to C-58).

    Args:
      stiffness: [N m/rad] of the bearing.
      angle: [rad] of the nacelle, after ``dt``.
      speed: [rad/s] of the same.
    """
    most, a, friction = p[YAW_RATE], p[YAW_ACCELERATION], p[YAW_FRICTION]
    target = min(max(demands[s.YAW_RATE_DEMAND] * faults[f.YAW_DRIVE], -most), most)
    before = drive[ex.YAW_DRIVE_RATE]
    if a > 0.0:
        # towards the target at constant acceleration, then at its rate
        change = min(max(target - before, -a * dt), a * dt)
        rate = target if abs(target - before) <= a * dt else before + change
        drive[ex.YAW_COMMAND] += rate * dt - 0.5 * change * abs(change) / a
    else:
        rate = target
        drive[ex.YAW_COMMAND] += rate * dt
    drive[ex.YAW_DRIVE_RATE] = rate
    stands = rate == 0.0 and target == 0.0
    if friction > 0.0:
        rubs = drive[ex.YAW_HELD] == 0.0 or not stands
        if rubs and drive[ex.YAW_RUBS] == 0.0:
            drive[ex.YAW_REST], drive[ex.YAW_REST_RATE] = angle, speed
        elif drive[ex.YAW_RUBS] > 0.0 and not rubs:
            drive[ex.YAW_COMMAND] += drive[ex.YAW_REST] - angle  # the brake takes over what the friction held
        drive[ex.YAW_RUBS] = 1.0 if rubs else 0.0
        if dt > 0.0:
            rest = slid(drive[ex.YAW_REST], angle, friction / stiffness)
            drive[ex.YAW_REST_RATE] = speed if rest != drive[ex.YAW_REST] else 0.0 * speed
            drive[ex.YAW_REST] = rest
    if not stands or before != 0.0 or p[YAW_HOLD] < 0.0:
        drive[ex.YAW_COMMAND_RATE] = rate
    elif dt > 0.0 and drive[ex.YAW_HELD] > 0.0:
        drive[ex.YAW_SWITCHES] += crossed(stiffness * abs(angle - drive[ex.YAW_COMMAND]) - p[YAW_HOLD])
        command = slid(drive[ex.YAW_COMMAND], angle, p[YAW_HOLD] / stiffness)
        drive[ex.YAW_COMMAND_RATE] = speed if command != drive[ex.YAW_COMMAND] else 0.0 * speed
        drive[ex.YAW_COMMAND] = command
