"""The machine of a power coefficient: the only file in which its wind, rotor, shaft and control exchange numbers.

The order at a sample instant, the signals and the scheme are those of the aeroelastic machine (``simulation/step.py``):
explicit Newmark with extrapolated velocity for azimuth and torsion, exact steps of pitch actuators and yaw drive. The
nacelle is rigid on its bearing, so that it stands where its drive has turned it.

Reference: docs/theory/power-turbines.md (P-1 to P-12).
"""

from __future__ import annotations

from collections.abc import Callable
from math import atan2, cos, exp, log, pi, sin, sqrt, tanh
from typing import Any

from numpy import float64, int64
from numpy.typing import NDArray

from meltemi.aero.coefficient import known, power_coefficient, thrust_coefficient
from meltemi.aero.tables import AIR_DENSITY, RotorFlow
from meltemi.control import signals as sg
from meltemi.control.actuators import ANGLE, drive_advance, pitch_advance, yaw_advance
from meltemi.control.faults import happen, report
from meltemi.core.kernel import kernel
from meltemi.electrical.advance import GRID_POWER, ON, TRIP, electric_advance
from meltemi.electrical.advance import TORQUE as ELECTRIC_TORQUE
from meltemi.environment import conditions as cd
from meltemi.environment.rain import DRAG_DENSITY, rain_power_loss
from meltemi.maths.tables import Table, number
from meltemi.maths.vectors import Vec
from meltemi.numbers.views import viewer
from meltemi.simulation.step import (
    CONTROLLER_DEMAND,
    CONTROLLER_RAISED,
    DIVERGED,
    EVERY_CONTROL,
    EVERY_OUTPUT,
    NEXT_EVENT,
    OK,
    POWER,
    ROW,
    STATUS,
    STEP,
    WANT_LOADS,
    diverged,
    sample,
    sensible,
    surroundings,
    whole_machine,
)
from meltemi.simulation.validity import watch_shaft
from meltemi.structure.kinematics import GENERATOR, N_SHAFT, TORSION, YAW
from meltemi.structure.tables import MachineLoad, StructureParameters
from meltemi.turbine import exchange as ex
from meltemi.wind.velocity import WindField, series_now, wind_velocity

Float = NDArray[float64]
Int = NDArray[int64]

UNKNOWN = 6
"""Value of ``clock[STATUS]``: the rotor has left where its coefficient is known."""


class Disk(Table):
    """Parameters of the rotor beside its coefficients."""

    radius: float = number("m", "to which the coefficients refer")
    inertia: float = number("kg m^2", "of the rotor about the shaft")
    friction: float = number("N m s/rad", "of the bearings")
    power_exponent: float = number("-", "of the cosine between wind and shaft in the power")
    thrust_exponent: float = number("-", "in the thrust")


RADIUS, INERTIA, FRICTION, POWER_EXPONENT, THRUST_EXPONENT = Disk.slots(
    "radius inertia friction power_exponent thrust_exponent"
)


class DiskFlow(Table):
    """What the rotor does."""

    wind_speed: float = number("m/s", "horizontal, mean over the disk")
    power_coefficient: float = number("-", "at this tip-speed ratio and the pitch of the blades, without yaw")
    aerodynamic_power: float = number("W", "of the air on the rotor, rain's loss taken off")
    rain_loss: float = number("W", "of power, to rain")


WIND_SPEED, COEFFICIENT, AERODYNAMIC_POWER, RAIN_LOSS = DiskFlow.slots(
    "wind_speed power_coefficient aerodynamic_power rain_loss"
)

PARTS = (
    "q v a locked structure aero disk coefficient ratios pitches values rain field points pitch drive "
    "machine rotor disk_flow chain summary"
).split()
"""Arrays of :func:`equations`, in the order of its arguments after t."""
RUN_PARTS = (
    "controller_state measured demands faults actuators flap conditions outside electrical electric v_old a_old root "
    "signals output watch"
).split()
"""Arrays of a run under way."""
Q, V, A, P_STRUCTURE, P_AERO, P_DISK, P_COEFFICIENT, P_RATIOS = (
    PARTS.index(name) for name in "q v a structure aero disk coefficient ratios".split()
)
P_FIELD, P_PITCH, P_DRIVE, P_ROTOR, P_CHAIN, P_SUMMARY = (
    PARTS.index(name) for name in "field pitch drive rotor chain summary".split()
)
GEAR_RATIO, GENERATOR_INERTIA, STIFFNESS, DAMPING, TOWER_LENGTH, YAW_STIFFNESS = StructureParameters.slots(
    "gear_ratio generator_inertia shaft_stiffness shaft_damping tower_length yaw_stiffness"
)
TIP_RATIO, AXIAL_WIND, SKEW, THRUST, TORQUE, MEAN_WIND = RotorFlow.slots("tip_ratio axial_wind skew thrust torque wind")
SHAFT_TORQUE, ROTOR_ACCELERATION = MachineLoad.slots("apex_moment rotor_acceleration")
LEAST_WIND = 0.1
"""[m/s] below which the tip-speed ratio is that of this wind."""
LEAST_RATIO = 0.01
"""Tip-speed ratio below which the torque is that of this ratio: a rotor at rest has no power, but a torque."""


@kernel
def to_the(x: float, n: float) -> float:
    """The n-th power of a cosine; 0 if it is not above 0."""
    return exp(n * log(x)) if x > 0.0 else 0.0 * x


@kernel
def disk_wind(t: float, yaw: float, height: float, points: Float, field: WindField) -> Vec:
    """Mean of the wind over points of the disk (P-5).

    Args:
      points: (2, n) [m] from the hub, to the left looking downwind and up.
    """
    c, s = cos(yaw), sin(yaw)
    u = wind_velocity(Vec(-s * points[0, 0], c * points[0, 0], height + points[1, 0]), t, field)
    n = points.shape[1]
    x, y, z = u.x, u.y, u.z
    for i in range(1, n):
        u = wind_velocity(Vec(-s * points[0, i], c * points[0, i], height + points[1, i]), t, field)
        x, y, z = x + u.x, y + u.y, z + u.z
    return Vec(x / n, y / n, z / n)


@kernel
def equations(
    t: float,
    q: Float,
    v: Float,
    a: Float,
    locked: Float,
    structure: Float,
    aero: Float,
    disk: Float,
    coefficient: Float,
    ratios: Float,
    pitches: Float,
    values: Float,
    rain: Float,
    field: WindField,
    points: Float,
    pitch: Float,
    drive: Float,
    machine: Float,
    rotor: Float,
    flow: Float,
    chain: Float,
) -> None:
    """Rotor and shaft at time ``t`` for coordinates q and velocities v; accelerations are left in ``a``."""
    q[YAW], v[YAW] = drive[ex.YAW_COMMAND], drive[ex.YAW_COMMAND_RATE]
    speed = v[GENERATOR] + v[TORSION]
    machine[ex.AZIMUTH], machine[ex.ROTOR_SPEED] = q[GENERATOR] + q[TORSION], speed
    # wind on the disk
    series_now(t, field)
    u = disk_wind(t, q[YAW], structure[TOWER_LENGTH], points, field)
    along = u.x * cos(q[YAW]) + u.y * sin(q[YAW])
    across = u.y * cos(q[YAW]) - u.x * sin(q[YAW])
    wind_speed = sqrt(max(along * along + across * across, 1e-12))
    facing = along / wind_speed
    # rotor (P-1)
    radius = disk[RADIUS]
    reference = max(wind_speed, LEAST_WIND)
    ratio = max(radius * speed / reference, LEAST_RATIO)
    blades = pitch.shape[1]
    c_p = power_coefficient(coefficient, ratios, pitches, values, ratio, pitch[ANGLE, 0])
    c_t = thrust_coefficient(coefficient, ratios, pitches, values, ratio, pitch[ANGLE, 0])
    for b in range(1, blades):
        c_p += power_coefficient(coefficient, ratios, pitches, values, ratio, pitch[ANGLE, b])
        c_t += thrust_coefficient(coefficient, ratios, pitches, values, ratio, pitch[ANGLE, b])
    c_p, c_t = c_p / blades, c_t / blades
    pressure = 0.5 * aero[AIR_DENSITY] * pi * radius * radius * wind_speed * wind_speed
    power = pressure * wind_speed * c_p * to_the(facing, disk[POWER_EXPONENT])
    loss = 0.0 * power
    if rain[DRAG_DENSITY] > 0.0:  # it stops the rotor at most
        loss = min(rain_power_loss(rain, wind_speed) + loss, max(power, 0.0))
    power -= loss
    torque = power * radius / (ratio * reference)
    rotor[THRUST] = pressure * c_t * to_the(facing, disk[THRUST_EXPONENT])
    rotor[TORQUE] = torque
    rotor[TIP_RATIO], rotor[AXIAL_WIND], rotor[SKEW] = ratio, along, abs(atan2(across, along))
    rotor[MEAN_WIND], rotor[MEAN_WIND + 1], rotor[MEAN_WIND + 2] = u.x, u.y, u.z
    flow[WIND_SPEED], flow[COEFFICIENT], flow[RAIN_LOSS] = wind_speed, c_p, loss
    flow[AERODYNAMIC_POWER] = torque * speed
    # shaft (P-6, P-7)
    gear = structure[GEAR_RATIO]
    brake = drive[ex.BRAKE_TORQUE] * tanh(gear * v[GENERATOR] / drive[ex.BRAKE_SPEED])
    held = gear * (drive[ex.GENERATOR_TORQUE] + brake)
    driving = torque - disk[FRICTION] * speed
    other = gear * gear * structure[GENERATOR_INERTIA]
    if locked[TORSION] > 0.0:
        a_generator = (driving - held) / (disk[INERTIA] + other)
        if locked[GENERATOR] > 0.0:
            a_generator = 0.0 * a_generator
        a_rotor = a_generator
    else:
        twist = structure[STIFFNESS] * q[TORSION] + structure[DAMPING] * v[TORSION]
        a_rotor = (driving - twist) / disk[INERTIA]
        a_generator = (twist - held) / other
        if locked[GENERATOR] > 0.0:
            a_generator = 0.0 * a_generator
    a[YAW] = 0.0 * a_rotor
    a[GENERATOR], a[TORSION] = a_generator, a_rotor - a_generator
    chain[ROTOR_ACCELERATION] = a_rotor
    chain[SHAFT_TORQUE] = torque - disk[INERTIA] * a_rotor


view_run = viewer()
view_parts = viewer()


@kernel
def evaluate(t: float, numbers: tuple[Any, ...], parts: tuple[Any, ...]) -> None:
    """Everything at time ``t``."""
    equations(t, *view_parts(numbers[1], parts)[:-1])


@kernel
def observe(t: float, efficiency: float, numbers: tuple[Any, ...], parts: tuple[Any, ...]) -> None:
    """The summary after an evaluation."""
    seen = view_parts(numbers[1], parts)
    whole_machine(
        t,
        Vec(0.0, 0.0, seen[P_STRUCTURE][TOWER_LENGTH]),
        seen[P_FIELD],
        seen[V],
        N_SHAFT,
        seen[P_STRUCTURE],
        seen[P_DRIVE],
        efficiency,
        seen[P_CHAIN][SHAFT_TORQUE],
        seen[P_SUMMARY],
    )


def advance(
    n_steps: int,
    controller: Callable[[Float, Float, Float, float], None],
    dt: float,
    efficiency: float,
    clock: Int,
    limits: Float,
    events: Float,
    index: Int,
    kinds: tuple[Any, ...],
    run: tuple[Any, ...],
    numbers: tuple[Any, ...],
    parts: tuple[Any, ...],
) -> None:
    """March ``n_steps`` instants, or until something ends the run; the arguments are those of ``step.advance``."""
    (
        controller_state,
        measured,
        demands,
        faults,
        actuators,
        flap,
        conditions,
        outside,
        electrical,
        electric,
        v_old,
        a_old,
        root,
        signals,
        output,
        watch,
    ) = view_run(kinds, run)
    seen = view_parts(numbers[1], parts)
    q, v, a, structure, aero = seen[Q], seen[V], seen[A], seen[P_STRUCTURE], seen[P_AERO]
    pitch, drive, rotor = seen[P_PITCH], seen[P_DRIVE], seen[P_ROTOR]
    chain, summary = seen[P_CHAIN], seen[P_SUMMARY]
    coefficient = seen[P_COEFFICIENT]
    for _ in range(n_steps):
        step = clock[STEP]
        t = step * dt
        clock[NEXT_EVENT] = happen(step, clock[NEXT_EVENT], events, faults)
        surroundings(t, conditions, aero[AIR_DENSITY], faults, outside)
        aero[AIR_DENSITY] = outside[cd.AIR_DENSITY]
        if step % clock[EVERY_CONTROL] == 0:
            sample(
                t,
                q,
                v,
                N_SHAFT,
                structure,
                drive,
                pitch,
                flap,
                actuators,
                root,
                chain,
                summary,
                efficiency,
                outside,
                electrical,
                electric,
                measured,
            )
            if clock[NEXT_EVENT] > 0:
                report(t, faults, measured)
            if electric[TRIP] > 0.0:
                measured[sg.GRID] = 0.0
            try:
                controller(controller_state, measured, demands, clock[EVERY_CONTROL] * dt)
            except Exception:
                clock[STATUS] = CONTROLLER_RAISED
            if clock[STATUS] == OK and not sensible(demands, limits):
                clock[STATUS] = CONTROLLER_DEMAND
            if clock[STATUS] != OK:
                return
        pitch_advance(actuators, demands, faults, pitch, 0.0)
        drive_advance(actuators, demands, faults, drive)
        if electrical[ON] > 0.0:
            electric_advance(
                electrical,
                drive[ex.GENERATOR_TORQUE],
                demands[sg.REACTIVE_POWER] + outside[cd.REACTIVE_POWER],
                structure[GEAR_RATIO] * v[GENERATOR],
                outside[cd.GRID_VOLTAGE],
                outside[cd.GRID_FREQUENCY],
                electric,
                dt,
            )
            drive[ex.GENERATOR_TORQUE] = electric[ELECTRIC_TORQUE]
        yaw_advance(actuators, structure[YAW_STIFFNESS], demands, faults, drive, q[YAW], v[YAW], 0.0)
        evaluate(t, numbers, parts)
        if step > 0:
            for j in range(GENERATOR, N_SHAFT):
                v[j] = v_old[j] + 0.5 * dt * (a_old[j] + a[j])
        if diverged(q, v):
            clock[STATUS] = DIVERGED
            return
        for b in range(pitch.shape[1]):
            if not known(coefficient, rotor[TIP_RATIO], pitch[ANGLE, b]):
                clock[STATUS] = UNKNOWN
                return
        watch_shaft(
            t,
            dt,
            parts[V][GENERATOR] + parts[V][TORSION],
            parts[P_STRUCTURE][GEAR_RATIO] * parts[V][GENERATOR],
            parts[P_DRIVE][ex.GENERATOR_TORQUE],
            parts[P_AERO][AIR_DENSITY],
            parts[P_PITCH],
            parts[P_ROTOR],
            watch,
        )
        due = step % clock[EVERY_OUTPUT] == 0
        if due or clock[WANT_LOADS] == 1:
            observe(t, efficiency, numbers, parts)
            if electrical[ON] > 0.0:
                summary[POWER] = electric[GRID_POWER]
        if due:
            for j in range(index.shape[0]):
                output[clock[ROW], j] = signals[index[j]]
            clock[ROW] += 1
        # to the next instant
        for j in range(GENERATOR, N_SHAFT):
            v_now, a_now = v[j], a[j]
            before = a_old[j] if step > 0 else a_now
            q[j] += dt * (v_now + 0.5 * dt * a_now)
            v[j] = v_now + dt * (1.5 * a_now - 0.5 * before)
            v_old[j] = v_now
            a_old[j] = a_now
        pitch_advance(actuators, demands, faults, pitch, dt)
        yaw_advance(actuators, structure[YAW_STIFFNESS], demands, faults, drive, q[YAW], v[YAW], dt)
        q[YAW], v[YAW] = drive[ex.YAW_COMMAND], drive[ex.YAW_COMMAND_RATE]
        clock[STEP] = step + 1
