"""Actuators of pitch and flaps, brake and yaw drive between the controller's demands and the turbine.

The models of pitch and flap actuators are in ``control/actuator_models``. A stuck blade or flap keeps its angle;
a runaway blade moves to the end of its range at the rate of the fault, as if that were demanded.

Reference: docs/theory/control.md (C-10 to C-13, C-55 to C-58, C-94).
"""

from __future__ import annotations

from math import sqrt

from meltemi.aero.tables import FlapParameters
from meltemi.compiler import KernelRecord, Numbers, Table, blades, crossed, kernel, number, whole
from meltemi.control.actuator_models import advance
from meltemi.control.actuator_models.parameters import ActuatorParameters
from meltemi.control.faults import Faults
from meltemi.control.signals import Demands, Measurements
from meltemi.turbine.exchange import Drive, PitchMotion


class Actuators(Table):
    """Parameters of the pitch actuators, brake and yaw drive."""

    pitch_model: float = number("-", "number of the model of the pitch actuators")
    pitch_frequency: float = number("rad/s", "natural frequency of the pitch actuators")
    pitch_damping: float = number("-", "damping ratio of the pitch actuators")
    pitch_rate: float = number("rad/s", "limit of the pitch rate")
    pitch_minimum: float = number("rad", "lower pitch limit")
    pitch_maximum: float = number("rad", "upper pitch limit")
    brake_torque: float = number("N m", "torque of the full brake, on the generator shaft")
    yaw_rate: float = number("rad/s", "limit of the yaw drive")
    yaw_acceleration: float = number("rad/s^2", "acceleration of the yaw drive; 0: not limited")
    yaw_friction: float = number("N m", "friction torque of the yaw bearing while it turns")
    yaw_hold: float = number("N m", "torque at which the yaw drive at rest slips; negative: it never slips")
    pitch_friction: float = number("rad/s^2", "friction torque of the unloaded pitch bearing over inertia")
    pitch_friction_moment: float = number("1/(kg m^2)", "friction torque over bending moment, over inertia")
    pitch_friction_spin: float = number("-", "friction torque over square of the rotor speed, over inertia")
    pitch_offset: Numbers = blades("rad", "pitch angle of each blade minus that of its encoder")


class FlapActuators(Table, axes="flap"):
    """Parameters of the flaps' actuators."""

    model: Numbers = number("-", "number of the model")
    frequency: Numbers = number("rad/s", "natural frequency")
    damping: Numbers = number("-", "damping ratio")
    rate: Numbers = number("rad/s", "rate limit")
    minimum: Numbers = number("rad", "lower limit of the deflection")
    maximum: Numbers = number("rad", "upper limit of the deflection")


class Actuation(KernelRecord):
    """Record of the actuators between the controller's demands and the turbine."""

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
def pitch_friction(b: int, c: Actuation) -> float:
    """Friction torque of a pitch bearing over inertia [rad/s^2] under the measured loads (C-94)."""
    p, x = c.actuators, c.measured
    friction = p.pitch_friction
    if p.pitch_friction_moment > 0.0:
        across, along = x.out_of_plane_moment[b], x.in_plane_moment[b]
        friction += p.pitch_friction_moment * sqrt(across * across + along * along)
        friction += p.pitch_friction_spin * x.rotor_speed * x.rotor_speed
    return friction


@kernel
def pitch_advance(dt: float, c: Actuation) -> None:
    """Advance the pitch angles by ``dt`` under held demands; with the ideal actuator at once."""
    p, f, pitch = c.actuators, c.faults, c.pitch
    low, high = p.pitch_minimum, p.pitch_maximum
    for b in range(pitch.blades):
        if f.pitch_stuck[b] > 0.0:
            if dt > 0.0:
                pitch.acceleration[b] = -pitch.rate[b] / dt
                pitch.rate[b] = 0.0
            pitch.held[b] = pitch.angle[b]
            continue
        demand, most, run = c.demands.pitch[b], p.pitch_rate, f.pitch_run[b]
        if run != 0.0:
            demand, most = (high if run > 0.0 else low), abs(run)
        if dt > 0.0:
            pitch.switches[b] += crossed(demand - low) + crossed(demand - high)
        demand = min(max(demand, low), high)
        offset = p.pitch_offset[b]
        angle, rate = pitch.angle[b] - offset, pitch.rate[b]
        limits = ActuatorParameters(
            p.pitch_frequency, p.pitch_damping, most, low, high, run != 0.0, pitch_friction(b, c)
        )
        new, pitch.rate[b], switches = advance(whole(p.pitch_model), angle, rate, demand, limits, dt)
        pitch.held[b], pitch.angle[b] = pitch.angle[b], new + offset
        if dt > 0.0:
            pitch.switches[b] += switches
            pitch.acceleration[b] = (pitch.rate[b] - rate) / dt


@kernel
def flap_advance(dt: float, c: Actuation) -> None:
    """Advance the flap deflections by ``dt`` under held demands; with ideal actuators at once, within their limits."""
    p, flap = c.flap_actuators, c.flap
    for j in range(flap.flaps):
        low, high = p.minimum[j], p.maximum[j]
        for b in range(flap.blades):
            if c.faults.flap_stuck[j, b] > 0.0:
                if dt > 0.0:
                    flap.acceleration[j, b] = -flap.rate[j, b] / dt
                    flap.rate[j, b] = 0.0
                flap.held[j, b] = flap.angle[j, b]
                continue
            demand = c.demands.flap[j, b]
            if dt > 0.0:
                flap.switches[j, b] += crossed(demand - low) + crossed(demand - high)
            demand = min(max(demand, low), high)
            angle, rate = flap.angle[j, b], flap.rate[j, b]
            limits = ActuatorParameters(p.frequency[j], p.damping[j], p.rate[j], low, high, False, 0.0)
            new, new_rate, switches = advance(whole(p.model[j]), angle, rate, demand, limits, dt)
            flap.held[j, b], flap.angle[j, b] = angle, new
            flap.rate[j, b] = new_rate
            if dt > 0.0:
                flap.switches[j, b] += switches
                flap.acceleration[j, b] = (new_rate - rate) / dt


@kernel
def drive_advance(c: Actuation) -> None:
    """Generator torque and brake under held demands."""
    f = c.faults
    c.drive.generator_torque = c.demands.generator_torque * f.grid * f.generator
    share = max(c.demands.brake * f.brake, f.brake_applied)
    c.drive.brake_torque = c.actuators.brake_torque * min(max(share, 0.0), 1.0)


@kernel
def friction_limited(rest: float, angle: float, most: float) -> float:
    """Rest angle of a spring that slides at a deflection of more than ``most`` (C-57)."""
    return min(max(rest, angle - most), angle + most)


@kernel
def yaw_advance(dt: float, c: Actuation, stiffness: float, angle: float, speed: float) -> None:
    """Advance yaw drive, brake and friction of the bearing by ``dt`` under a held demand (C-55 to C-58).

    Args:
      stiffness: [N m/rad] stiffness of the bearing.
      angle: [rad] yaw angle of the nacelle, after ``dt``.
      speed: [rad/s] yaw rate of the nacelle, after ``dt``.
    """
    p, d = c.actuators, c.drive
    most, a, friction = p.yaw_rate, p.yaw_acceleration, p.yaw_friction
    target = c.faults.yaw_run
    if target == 0.0:
        target = min(max(c.demands.yaw_rate * c.faults.yaw_drive, -most), most)
    before = d.yaw_drive_rate
    if a > 0.0:
        # towards the target at constant acceleration, then at constant rate
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
            d.yaw_command += d.yaw_rest - angle  # the brake takes over the load of the friction
        d.yaw_rubs = 1.0 if rubs else 0.0
        if dt > 0.0:
            rest = friction_limited(d.yaw_rest, angle, friction / stiffness)
            d.yaw_rest_rate = speed if rest != d.yaw_rest else 0.0
            d.yaw_rest = rest
    if not stands or before != 0.0 or p.yaw_hold < 0.0:
        d.yaw_command_rate = rate
    elif dt > 0.0 and d.yaw_held > 0.0:
        d.yaw_switches += crossed(stiffness * abs(angle - d.yaw_command) - p.yaw_hold)
        command = friction_limited(d.yaw_command, angle, p.yaw_hold / stiffness)
        d.yaw_command_rate = speed if command != d.yaw_command else 0.0
        d.yaw_command = command
