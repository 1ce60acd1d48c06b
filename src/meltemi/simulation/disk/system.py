"""Rotor with a power coefficient: wind over its disk, aerodynamic power, shaft.

The nacelle is rigid on its bearing, so that its yaw angle is that of the drive.

Reference: docs/theory/power-turbines.md (P-1 to P-9).
"""

from __future__ import annotations

from math import atan2, cos, exp, log, pi, sin, sqrt, tanh

from meltemi.aero.coefficient import PowerCoefficients, known, power_coefficient, thrust_coefficient
from meltemi.compiler import Array2, Constant, Table, Vec, kernel, number
from meltemi.environment.rain import RainParameters, rain_power_loss
from meltemi.simulation.step import (
    begin_step,
    check_rotor,
    end_step,
    evaluate,
    inflow_rates,
    section_loads,
    settle_inflow,
)
from meltemi.simulation.system import AnySystem, March, Outputs, rotor_azimuth, rotor_speed
from meltemi.structure.equations import GENERATOR, TORSION, YAW
from meltemi.structure.tables import MachineLoad
from meltemi.wind.velocity import series_now, wind_velocity

LEAST_WIND = 0.1
"""[m/s] smallest wind speed in the tip-speed ratio."""
LEAST_RATIO = 0.01
"""Smallest tip-speed ratio in the torque: a rotor at rest has no power, but a torque."""


class Disk(Table):
    """Parameters of the rotor besides its coefficients."""

    radius: float = number("m", "rotor radius, to which the coefficients refer")
    inertia: float = number("kg m^2", "inertia of the rotor about the shaft")
    friction: float = number("N m s/rad", "friction of the bearings")
    power_exponent: float = number("-", "exponent of the yaw cosine in the power")
    thrust_exponent: float = number("-", "exponent of the yaw cosine in the thrust")


class DiskFlow(Table):
    """Flow and power of the rotor."""

    wind_speed: float = number("m/s", "horizontal wind speed, mean over the disk")
    power_coefficient: float = number("-", "power coefficient at the present tip-speed ratio and pitch, without yaw")
    aerodynamic_power: float = number("W", "aerodynamic power of the rotor, less the loss to rain")
    rain_loss: float = number("W", "power loss to rain")


class DiskSystem(AnySystem, PowerCoefficients):
    """A power-coefficient turbine; its coordinates are yaw, generator, torsion of the shaft."""

    disk: Disk
    rain: Constant[RainParameters]
    points: Constant[Array2]
    disk_flow: DiskFlow
    chain: MachineLoad


@kernel
def cosine_power(x: float, n: float) -> float:
    """The n-th power of a cosine; 0 if it is not positive."""
    return exp(n * log(x)) if x > 0.0 else 0.0


@kernel
def disk_wind(t: float, m: DiskSystem) -> Vec:
    """Mean of the wind over points of the disk (P-5), given by [m] to the left looking downwind, and up."""
    c, s, n = cos(m.q[YAW]), sin(m.q[YAW]), m.points.shape[1]
    u = Vec(0.0, 0.0, 0.0)
    for i in range(n):
        left, up = m.points[0, i], m.points[1, i]
        u += wind_velocity(Vec(-s * left, c * left, m.structure.tower_length + up), t, m)
    return Vec(u.x / n, u.y / n, u.z / n)


@kernel
def coefficients(ratio: float, m: DiskSystem) -> tuple[float, float]:
    """Power and thrust coefficient at a tip-speed ratio, means over the pitch angles of the blades."""
    c_p, c_t = 0.0, 0.0
    for b in range(m.pitch.blades):
        pitch = m.pitch.angle[b]
        c_p += power_coefficient(ratio, pitch, m)
        c_t += thrust_coefficient(ratio, pitch, m)
    return c_p / m.pitch.blades, c_t / m.pitch.blades


@kernel
def aerodynamics(t: float, m: DiskSystem) -> None:
    """Power, torque and thrust of the rotor (P-1 to P-5)."""
    disk, rotor, flow, yaw = m.disk, m.rotor, m.disk_flow, m.q[YAW]
    speed = rotor_speed(m)
    u = disk_wind(t, m)
    along = u.x * cos(yaw) + u.y * sin(yaw)
    across = u.y * cos(yaw) - u.x * sin(yaw)
    wind_speed = sqrt(max(along * along + across * across, 1e-12))
    facing = along / wind_speed
    reference = max(wind_speed, LEAST_WIND)
    ratio = max(disk.radius * speed / reference, LEAST_RATIO)
    c_p, c_t = coefficients(ratio, m)
    pressure = 0.5 * m.aero.air_density * pi * disk.radius * disk.radius * wind_speed * wind_speed
    power = pressure * wind_speed * c_p * cosine_power(facing, disk.power_exponent)
    loss = 0.0
    if m.rain.drag_density > 0.0:  # it stops the rotor at most
        loss = min(rain_power_loss(m.rain, wind_speed), max(power, 0.0))
    power -= loss
    torque = power * disk.radius / (ratio * reference)
    rotor.thrust = pressure * c_t * cosine_power(facing, disk.thrust_exponent)
    rotor.torque = torque
    rotor.tip_ratio = ratio
    rotor.axial_wind = along
    rotor.skew = abs(atan2(across, along))
    rotor.wind = u
    flow.wind_speed = wind_speed
    flow.power_coefficient = c_p
    flow.rain_loss = loss
    flow.aerodynamic_power = torque * speed


@kernel
def shaft(m: DiskSystem) -> None:
    """Accelerations of generator and torsion (P-6, P-7)."""
    p, drive, disk, q, v, locked = m.structure, m.drive, m.disk, m.q, m.v, m.locked
    torque, speed, gear = m.rotor.torque, rotor_speed(m), p.gear_ratio
    brake = drive.brake_torque * tanh(gear * v[GENERATOR] / drive.brake_speed)
    shaft_torque = gear * (drive.generator_torque + brake)
    driving = torque - disk.friction * speed
    other = gear * gear * p.generator_inertia
    if locked[TORSION] > 0.0:
        a_generator = (driving - shaft_torque) / (disk.inertia + other)
        if locked[GENERATOR] > 0.0:
            a_generator = 0.0
        a_rotor = a_generator
    else:
        twist = p.shaft_stiffness * q[TORSION] + p.shaft_damping * v[TORSION]
        a_rotor = (driving - twist) / disk.inertia
        a_generator = (twist - shaft_torque) / other
        if locked[GENERATOR] > 0.0:
            a_generator = 0.0
    m.a[YAW] = 0.0
    m.a[GENERATOR], m.a[TORSION] = a_generator, a_rotor - a_generator
    m.chain.rotor_acceleration = a_rotor
    m.chain.apex_moment = Vec(torque - disk.inertia * a_rotor, 0.0, 0.0)


@kernel
def follow_drive(m: DiskSystem) -> None:
    """Set the yaw angle of the nacelle to that of its drive."""
    m.q[YAW], m.v[YAW] = m.drive.yaw_command, m.drive.yaw_command_rate


@evaluate.variant
@kernel
def _(t: float, dt: float, m: DiskSystem) -> None:
    follow_drive(m)
    m.machine.azimuth, m.machine.rotor_speed = rotor_azimuth(m), rotor_speed(m)
    m.machine.hub_position = Vec(0.0, 0.0, m.structure.tower_length)
    series_now(t, m)
    aerodynamics(t, m)
    shaft(m)


@section_loads.variant
@kernel
def _(m: DiskSystem, s: Outputs, everywhere: bool) -> None:
    """None."""


@settle_inflow.variant
@kernel
def _(m: DiskSystem) -> None:
    """Nothing to do: no states."""


@inflow_rates.variant
@kernel
def _(m: DiskSystem) -> None:
    """Nothing to do: no states."""


@begin_step.variant
@kernel
def _(dt: float, m: DiskSystem) -> None:
    follow_drive(m)


@end_step.variant
@kernel
def _(dt: float, m: DiskSystem) -> None:
    follow_drive(m)


@check_rotor.variant
@kernel
def _(t: float, m: DiskSystem, run: March) -> bool:
    for b in range(m.pitch.blades):
        if not known(m.rotor.tip_ratio, m.pitch.angle[b], m.coefficient):
            return False
    return True
