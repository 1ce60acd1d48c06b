"""Pitch actuators and yaw drive: what lies between a controller's demands and the machine.

The pitch actuator is a second-order system stepped exactly under a held demand, then limited in rate
and angle. Its ideal variant has the demanded angle at once and no rate, so it turns the blades
without inertial loads. A blade or flap that is stuck stops where it is; a blade that runs away goes to the end of its
range at a rate of its own, as if that were demanded.

Reference: docs/theory/control.md (C-10 to C-13, C-55 to C-58).
"""

from __future__ import annotations

from math import cos, cosh, exp, sin, sinh, sqrt
from typing import NamedTuple

from meltemi.aero.tables import FlapParameters
from meltemi.control.faults import Faults
from meltemi.control.signals import Demands, Measurements
from meltemi.core.kernel import kernel
from meltemi.maths.generic import crossed
from meltemi.maths.records import Record
from meltemi.maths.tables import Numbers, Table, blades, number
from meltemi.turbine.exchange import Drive, PitchMotion


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


class FlapActuators(Table, axes="flap"):
    """Parameters of the flaps' actuators."""

    ideal: Numbers = number("-", "1: the flap follows the demand at once")
    frequency: Numbers = number("rad/s", "natural frequency")
    damping: Numbers = number("-", "damping ratio")
    rate: Numbers = number("rad/s", "limit")
    minimum: Numbers = number("rad", "limit")
    maximum: Numbers = number("rad", "limit")


class Actuation(Record):
    """What lies between a controller's demands and the turbine."""

    measured: Measurements
    demands: Demands
    faults: Faults
    # actuators
    actuators: Actuators
    flap_actuators: FlapActuators
    pitch: PitchMotion
    flap: FlapParameters
    drive: Drive


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


class SecondOrder(NamedTuple):
    """A second-order actuator: natural frequency [rad/s], damping ratio, and limits of rate and angle."""

    frequency: float
    damping: float
    rate: float
    minimum: float
    maximum: float


@kernel
def limited_step(angle: float, rate: float, demand: float, p: SecondOrder, dt: float) -> tuple[float, float, float]:
    """Angle and rate of a second-order actuator after ``dt``, within its limits (C-11 to C-13).

    Args:
      demand: held, within the limits of the angle.

    Returns:
      Angle, rate, and what the limit of the rate adds to the switches.
    """
    most = p.rate
    error, free = second_order_step(angle - demand, rate, p.frequency, p.damping, dt)
    new, limited = demand + error, min(max(free, -most), most)
    if limited != free:
        new = angle + 0.5 * (rate + limited) * dt
    # within the step the free motion may be faster than at its ends
    new = min(max(new, angle - most * dt), angle + most * dt)
    if new < p.minimum or new > p.maximum:
        new = min(max(new, p.minimum), p.maximum)
        limited = 0.0
    return new, limited, crossed(abs(free) - most)


@kernel
def pitch_advance(dt: float, c: Actuation) -> None:
    """Pitch angles after ``dt`` under held demands; with the ideal actuator at once."""
    p, f, pitch = c.actuators, c.faults, c.pitch
    low, high = p.pitch_minimum, p.pitch_maximum
    for b in range(pitch.blades):
        if f.pitch_stuck[b] > 0.0:
            if dt > 0.0:
                pitch.acceleration[b] = -pitch.rate[b] / dt
                pitch.rate[b] = 0.0
            continue
        demand, most, run = c.demands.pitch[b], p.pitch_rate, f.pitch_run[b]
        if run != 0.0:
            demand, most = (high if run > 0.0 else low), abs(run)
        if dt > 0.0:
            pitch.switches[b] += crossed(demand - low) + crossed(demand - high)
        demand = min(max(demand, low), high)
        offset = p.pitch_offset[b]
        angle, rate = pitch.angle[b] - offset, pitch.rate[b]
        if p.pitch_ideal > 0.0:
            if run != 0.0:
                demand = min(max(demand, angle - most * dt), angle + most * dt)
            pitch.angle[b] = demand + offset
            continue
        if dt <= 0.0:
            continue
        new, new_rate, switches = limited_step(
            angle, rate, demand, SecondOrder(p.pitch_frequency, p.pitch_damping, most, low, high), dt
        )
        pitch.switches[b] += switches
        pitch.angle[b] = new + offset
        pitch.rate[b] = new_rate
        pitch.acceleration[b] = (new_rate - rate) / dt


@kernel
def flap_advance(dt: float, c: Actuation) -> None:
    """Deflections after ``dt`` under held demands; with ideal actuators at once, within their limits."""
    p, flap = c.flap_actuators, c.flap
    for j in range(flap.flaps):
        low, high, most = p.minimum[j], p.maximum[j], p.rate[j]
        for b in range(flap.blades):
            if c.faults.flap_stuck[j, b] > 0.0:
                if dt > 0.0:
                    flap.acceleration[j, b] = -flap.rate[j, b] / dt
                    flap.rate[j, b] = 0.0
                continue
            demand = c.demands.flap[j, b]
            if dt > 0.0:
                flap.switches[j, b] += crossed(demand - low) + crossed(demand - high)
            demand = min(max(demand, low), high)
            angle, rate = flap.angle[j, b], flap.rate[j, b]
            if p.ideal[j] > 0.0:
                flap.angle[j, b] = demand
                continue
            if dt <= 0.0:
                continue
            new, new_rate, switches = limited_step(
                angle, rate, demand, SecondOrder(p.frequency[j], p.damping[j], most, low, high), dt
            )
            flap.switches[j, b] += switches
            flap.angle[j, b] = new
            flap.rate[j, b] = new_rate
            flap.acceleration[j, b] = (new_rate - rate) / dt


@kernel
def drive_advance(c: Actuation) -> None:
    """Generator torque and brake under held demands."""
    f = c.faults
    c.drive.generator_torque = c.demands.generator_torque * f.grid * f.generator
    share = max(c.demands.brake * f.brake, f.brake_applied)
    c.drive.brake_torque = c.actuators.brake_torque * min(max(share, 0.0), 1.0)


@kernel
def slid(rest: float, angle: float, most: float) -> float:
    """Angle at which a spring is free that slides where it would be stretched by more than ``most`` (C-57)."""
    return min(max(rest, angle - most), angle + most)


@kernel
def yaw_advance(dt: float, c: Actuation, stiffness: float, angle: float, speed: float) -> None:
    """Yaw drive, its brake and the bearing's friction after ``dt`` under a held demand (C-55 to C-58).

    Args:
      stiffness: [N m/rad] of the bearing.
      angle: [rad] of the nacelle, after ``dt``.
      speed: [rad/s] of the same.
    """
    p, d = c.actuators, c.drive
    most, a, friction = p.yaw_rate, p.yaw_acceleration, p.yaw_friction
    target = min(max(c.demands.yaw_rate * c.faults.yaw_drive, -most), most)
    before = d.yaw_drive_rate
    if a > 0.0:
        # towards the target at constant acceleration, then at its rate
        change = min(max(target - before, -a * dt), a * dt)
        rate = target if abs(target - before) <= a * dt else before + change
        d.yaw_command += rate * dt - 0.5 * change * abs(change) / a
    else:
        rate = target
        d.yaw_command += rate * dt
    d.yaw_drive_rate = rate
    stands = rate == 0.0 and target == 0.0
    if friction > 0.0:
        rubs = d.yaw_held == 0.0 or not stands
        if rubs and d.yaw_rubs == 0.0:
            d.yaw_rest, d.yaw_rest_rate = angle, speed
        elif d.yaw_rubs > 0.0 and not rubs:
            d.yaw_command += d.yaw_rest - angle  # the brake takes over what the friction held
        d.yaw_rubs = 1.0 if rubs else 0.0
        if dt > 0.0:
            rest = slid(d.yaw_rest, angle, friction / stiffness)
            d.yaw_rest_rate = speed if rest != d.yaw_rest else 0.0
            d.yaw_rest = rest
    if not stands or before != 0.0 or p.yaw_hold < 0.0:
        d.yaw_command_rate = rate
    elif dt > 0.0 and d.yaw_held > 0.0:
        d.yaw_switches += crossed(stiffness * abs(angle - d.yaw_command) - p.yaw_hold)
        command = slid(d.yaw_command, angle, p.yaw_hold / stiffness)
        d.yaw_command_rate = speed if command != d.yaw_command else 0.0
        d.yaw_command = command
