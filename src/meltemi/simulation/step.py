"""The coupled machine: the only file in which wind, aerodynamics, structure and control exchange numbers.

``evaluate`` computes everything at one instant. ``advance`` marches: at each instant, in this order,

1. events that are due;
2. sample: measurements from the state (with the extrapolated velocity) and the last loads, as the sensors report them;
3. control, when its sample time has come: demands;
4. actuators: they have moved under the demands so far, the ideal ones follow the new ones at once; generator and
   converters, over the step to come, whose mean torque acts at this instant;
5. physics: ``evaluate``, which completes the velocities of the step that ends here;
6. record, when an output is due;

and then the step to the next instant. Structure: explicit Newmark scheme (beta 0, gamma 1/2), with the
velocity in forces extrapolated from the two last accelerations, so one evaluation a step suffices:

    q_{n+1} = q_n + h v_n + h^2/2 a_n
    v*      = v_n + h (3/2 a_n - 1/2 a_{n-1})
    a_{n+1} = a(q_{n+1}, v*, t_{n+1})
    v_{n+1} = v_n + h/2 (a_n + a_{n+1})

It is of second order and neither damps nor excites free vibrations. States of inflow and stall take
exact steps of their linear parts, modes of a gearbox implicit ones, solved together with a_{n+1}.

Reference: docs/theory/simulation.md (M-1 to M-9); Newmark (1959).
"""

from __future__ import annotations

from collections.abc import Callable
from math import atan2, sin, sqrt
from typing import Any

from numpy import float64, int64
from numpy.typing import NDArray

from meltemi.aero.flaps import ANGLE as FLAP_ANGLE
from meltemi.aero.rotor import disk_averages, loads, quasi_steady, relative_wind
from meltemi.aero.tables import AIR_DENSITY
from meltemi.aero.tower_flow import tower_load, tower_wind
from meltemi.control import faults as ft
from meltemi.control import signals as sg
from meltemi.control.actuators import ANGLE, OFFSET, drive_advance, flap_advance, pitch_advance, yaw_advance
from meltemi.control.faults import happen, report
from meltemi.core.kernel import kernel
from meltemi.electrical.advance import GRID_POWER, ON, TRIP, electric_advance
from meltemi.electrical.advance import TORQUE as ELECTRIC_TORQUE
from meltemi.environment import conditions as cd
from meltemi.environment.conditions import conditions_now
from meltemi.maths.algebra import Vec
from meltemi.maths.tables import MAX_BLADES, Table, number, xyz
from meltemi.numbers.views import viewer
from meltemi.simulation.system import Outputs, System
from meltemi.simulation.validity import watch_blades, watch_shaft
from meltemi.structure.dynamics import accelerations, assemble, collect_blades
from meltemi.structure.gears import gear_accelerations, gear_begin, gear_end
from meltemi.structure.kinematics import GENERATOR, N_SHAFT, YAW, blade_frames, blade_motion, nacelle_and_hub, tower_top
from meltemi.structure.section_loads import blade_loads, chain_loads, station_loads, tower_loads
from meltemi.structure.tables import BladeRootLoad, MachineLoad, StructureParameters
from meltemi.turbine import exchange as ex
from meltemi.wind.velocity import WindField, series_now, wind_velocity

Float = NDArray[float64]
Int = NDArray[int64]


class Summary(Table):
    """Quantities that belong to the whole machine."""

    time: float = number("s", "simulation time")
    wind: Vec = xyz("m/s", "undisturbed wind on the tower's axis, at the height of the undeflected hub, inertial axes")
    hub_wind: Vec = xyz("m/s", "the same at the hub, where it has moved to")
    generator_speed: float = number("rad/s", "of the generator's shaft")
    generator_torque: float = number("N m", "on the generator's shaft")
    power: float = number("W", "electrical")
    rotor_power: float = number("W", "mechanical, of the low-speed shaft")


TIME, WIND, HUB_WIND, GENERATOR_SPEED, TORQUE, POWER, ROTOR_POWER = Summary.slots(
    "time wind hub_wind generator_speed generator_torque power rotor_power"
)

STEP, STATUS, ROW, NEXT_EVENT, EVERY_OUTPUT, EVERY_CONTROL, CORRECTIONS, WANT_LOADS = range(8)
"""Places in ``clock``: instant, status, next output row, next event; periods in steps, options."""
N_CLOCK = 8
N_OUTSIDE = sg.GRID - sg.AIR_TEMPERATURE
"""Measurements of what is around the turbine, in the order of the conditions."""
(R_MOMENT,) = BladeRootLoad.slots("moment")
APEX_MOMENT, YAW_MOMENT, TOP_TOTAL_ACCELERATION = MachineLoad.slots("apex_moment yaw_moment top_acceleration")
SHAFT_TORQUE = APEX_MOMENT
"""The first component of the apex moment is the torque."""
OK, DIVERGED, CONTROLLER_RAISED, CONTROLLER_DEMAND = 0, 1, 2, 3
"""Values of ``clock[STATUS]``, as in ``core.errors.Status``."""
ABSURD = 1e6
"""Coordinates (m, rad) and velocities beyond this have diverged."""

RUN_PARTS = (
    "controller_state measured demands faults actuators flap_actuators conditions outside electrical electric v_old "
    "a_old spare aero_state signals output watch"
).split()
"""Arrays of a run under way, see :func:`advance`."""
GEAR_RATIO, TOWER_BASE, TOWER_LENGTH, SHAFT_HEIGHT, OVERHANG, TILT, YAW_STIFFNESS = StructureParameters.slots(
    "gear_ratio tower_base tower_length shaft_height overhang tilt yaw_stiffness"
)


@kernel
def equations(t: float, dt: float, m: System) -> None:
    """The assembled equations of motion at time ``t`` for coordinates q and velocities v.

    Mass matrix and forces are left in ``core_mass``, ``core_force``, ``coupling``, ``arm_mass`` and
    ``arm_force``.

    Args:
      dt: [s] by which the states of inflow and stall lag behind ``t`` and are moved first, and at whose end the modes
        of a gearbox were predicted; 0 leaves them.
    """
    # motion
    tower_top(m)
    nacelle_and_hub(m)
    blade_frames(m)
    blade_motion(m)
    # wind and aerodynamic loads
    series_now(t, m)
    tower_wind(t, m)
    relative_wind(t, m)
    disk_averages(m)
    quasi_steady(m)
    loads(dt, m)
    tower_load(m)
    # equations of motion
    collect_blades(m)
    assemble(dt, m)


view_run = viewer()


@kernel
def evaluate(t: float, dt: float, m: System, solve: bool) -> None:
    """Everything at time ``t``; the accelerations go to ``a``.

    Args:
      dt: as of :func:`equations`.
      solve: False leaves the equations of motion assembled.
    """
    equations(t, dt, m)
    if solve:
        accelerations(m)
        gear_accelerations(dt, m)


@kernel
def electrical_power(mechanical: float, efficiency: float) -> float:
    """[W] delivered for [W] on the generator's shaft; a generator that motors takes more than it gives."""
    return mechanical * (efficiency if mechanical >= 0.0 else 1.0 / efficiency)


@kernel
def sample(
    t: float,
    q: Float,
    v: Float,
    n_core: int,
    structure: Float,
    drive: Float,
    pitch: Float,
    flap: Float,
    actuators: Float,
    root: Float,
    chain: Float,
    summary: Float,
    efficiency: float,
    outside: Float,
    electrical: Float,
    electric: Float,
    measured: Float,
) -> None:
    """What the sensors give at time ``t``: motion of this instant, loads of the last one."""
    n = n_core - N_SHAFT
    generator_speed = structure[GEAR_RATIO] * v[n + GENERATOR]
    measured[sg.TIME] = t
    measured[sg.GENERATOR_SPEED] = generator_speed
    measured[sg.ROTOR_SPEED] = v[n + GENERATOR] + v[n + GENERATOR + 1]
    measured[sg.AZIMUTH] = q[n + GENERATOR] + q[n + GENERATOR + 1]
    measured[sg.TORQUE] = drive[ex.GENERATOR_TORQUE]
    measured[sg.POWER] = electrical_power(drive[ex.GENERATOR_TORQUE] * generator_speed, efficiency)
    if electrical[ON] > 0.0:
        measured[sg.POWER] = electric[GRID_POWER]
    measured[sg.YAW] = q[n]
    measured[sg.YAW_RATE] = v[n]
    for b in range(pitch.shape[1]):
        measured[sg.PITCH + b] = pitch[ANGLE, b] - actuators[OFFSET + b]
        measured[sg.OUT_OF_PLANE_MOMENT + b] = root[R_MOMENT + 1, b]
        measured[sg.IN_PLANE_MOMENT + b] = root[R_MOMENT, b]
    for j in range(flap.shape[1]):
        for b in range(flap.shape[2]):
            measured[sg.FLAP + MAX_BLADES * j + b] = flap[FLAP_ANGLE, j, b]
    u, w = summary[HUB_WIND], summary[HUB_WIND + 1]
    measured[sg.WIND_SPEED] = sqrt(u * u + w * w)
    measured[sg.WIND_DIRECTION] = atan2(-w, u)
    measured[sg.FORE_AFT_ACCELERATION] = chain[TOP_TOTAL_ACCELERATION]
    measured[sg.SIDE_SIDE_ACCELERATION] = chain[TOP_TOTAL_ACCELERATION + 1]
    measured[sg.ROTOR_POWER] = summary[ROTOR_POWER]
    for i in range(3):
        measured[sg.HUB_MOMENT + i] = chain[APEX_MOMENT + i]
        measured[sg.YAW_BEARING_MOMENT + i] = chain[YAW_MOMENT + i]
    for i in range(N_OUTSIDE):
        measured[sg.AIR_TEMPERATURE + i] = outside[cd.AIR_TEMPERATURE + i]
    measured[sg.POWER_REFERENCE] = outside[cd.POWER_REFERENCE]


@kernel
def surroundings(t: float, conditions: Float, density: float, faults: Float, outside: Float) -> None:
    """What surrounds the machine at time ``t``: the conditions, with the grid's voltage as events leave it."""
    conditions_now(t, conditions, density, outside)
    outside[cd.GRID_VOLTAGE] *= faults[ft.VOLTAGE] * faults[ft.GRID]


@kernel
def sensible(demands: Float, limits: Float) -> bool:
    """Every demand is a number within its limits."""
    for i in range(demands.shape[0]):
        if not (abs(demands[i]) <= limits[i]):
            return False
    return True


@kernel
def whole_machine(
    t: float,
    hub: Vec,
    m: WindField,
    v: Float,
    n_core: int,
    structure: Float,
    drive: Float,
    efficiency: float,
    shaft_torque: float,
    summary: Float,
) -> None:
    """Fill the summary; ``hub`` [m] is the place of the hub, ``shaft_torque`` [N m] that of the rotor on the shaft."""
    n = n_core - N_SHAFT
    series_now(t, m)
    height = structure[TOWER_BASE] + structure[TOWER_LENGTH] + structure[SHAFT_HEIGHT]
    u = wind_velocity(Vec(0.0, 0.0, height + structure[OVERHANG] * sin(structure[TILT])), t, m)
    seen = wind_velocity(hub, t, m)
    speed = structure[GEAR_RATIO] * v[n + GENERATOR]
    summary[TIME] = t
    summary[WIND], summary[WIND + 1], summary[WIND + 2] = u.x, u.y, u.z
    summary[HUB_WIND], summary[HUB_WIND + 1], summary[HUB_WIND + 2] = seen.x, seen.y, seen.z
    summary[GENERATOR_SPEED] = speed
    summary[TORQUE] = drive[ex.GENERATOR_TORQUE]
    summary[POWER] = electrical_power(drive[ex.GENERATOR_TORQUE] * speed, efficiency)
    summary[ROTOR_POWER] = (v[n + GENERATOR] + v[n + GENERATOR + 1]) * shaft_torque


@kernel
def section_loads(everywhere: bool, m: System, s: Outputs) -> None:
    """Section loads after an evaluation: at roots, hub and yaw bearing, and ``everywhere`` along tower and blades."""
    blade_loads(m, s)
    chain_loads(m, s)
    if everywhere:
        tower_loads(m, s)
        station_loads(m, s)


@kernel
def observe(t: float, efficiency: float, m: System, s: Outputs, everywhere: bool) -> None:
    """Section loads and summary after an evaluation; only ``everywhere`` for outputs, for controllers the nearest.

    Args:
      m: node by node, not in lanes.
    """
    section_loads(everywhere, m, s)
    whole_machine(
        t,
        m.machine.hub_position,
        m,
        m.v,
        m.columns.coordinates,
        m.structure.array,
        m.drive.array,
        efficiency,
        s.chain.array[SHAFT_TORQUE],
        s.summary,
    )


@kernel
def diverged(q: Float, v: Float) -> bool:
    """A coordinate or velocity is absurd or no number; a million radians are more than a day at rated speed."""
    for i in range(q.shape[0]):
        if not (abs(q[i]) < ABSURD and abs(v[i]) < ABSURD):
            return True
    return False


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
    m: System,
    one: System,
    plain: System,
    sections: Outputs,
) -> None:
    """March ``n_steps`` instants, or until something ends the run (``clock[STATUS]``).

    Args:
      events: (n, 3) see ``control.faults.happen``.
      index: (channels,) places in the signals, recorded in the columns of the output.
      run: arrays RUN_PARTS. ``v_old`` and ``a_old`` are velocities and accelerations of the last instant,
        ``aero_state`` are states and memory of inflow and stall as one vector, ``spare`` a copy of it for
        corrections, ``signals`` is everything a channel may ask for, ``output`` has (rows, channels), ``watch`` is
        that of ``simulation.validity``.
      kinds: of the numbers of these arrays, see ``numbers.views``.
      m, one, plain: the system as it is computed; node by node; and in plain numbers, as the host has it.
    """
    (
        controller_state,
        measured,
        demands,
        faults,
        actuators,
        flap_actuators,
        conditions,
        outside,
        electrical,
        electric,
        v_old,
        a_old,
        spare,
        aero_state,
        signals,
        output,
        watch,
    ) = view_run(kinds, run)
    q, v, a, n_core = m.q, m.v, m.a, m.columns.coordinates
    aero, structure = m.aero.array, m.structure.array
    pitch, drive, flap = m.pitch.array, m.drive.array, m.flap.array
    root, chain, summary = sections.root.array, sections.chain.array, sections.summary
    yaw = n_core - N_SHAFT + YAW
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
                n_core,
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
                structure[GEAR_RATIO] * v[n_core - N_SHAFT + GENERATOR],
                outside[cd.GRID_VOLTAGE],
                outside[cd.GRID_FREQUENCY],
                electric,
                dt,
            )
            drive[ex.GENERATOR_TORQUE] = electric[ELECTRIC_TORQUE]
        yaw_advance(actuators, structure[YAW_STIFFNESS], demands, faults, drive, q[yaw], v[yaw], 0.0)
        flap_advance(flap_actuators, demands, faults, flap, 0.0)
        # physics at t: complete the velocities of the step that ends here
        behind = dt if step > 0 else 0.0
        for i in range(1 + clock[CORRECTIONS]):
            if clock[CORRECTIONS] > 0:
                # entry by entry: copies of whole arrays compile a check of shapes that takes seconds
                for j in range(spare.shape[0]):
                    if i == 0:
                        spare[j] = aero_state[j]
                    else:
                        aero_state[j] = spare[j]
            evaluate(t, behind, m, True)
            if step > 0:
                for j in range(q.shape[0]):
                    v[j] = v_old[j] + 0.5 * dt * (a_old[j] + a[j])
        if step > 0:
            gear_end(dt, m)
        if diverged(q, v):
            clock[STATUS] = DIVERGED
            return
        generator = n_core - N_SHAFT + GENERATOR
        watch_shaft(
            t,
            dt,
            plain.v[generator] + plain.v[generator + 1],
            plain.structure.gear_ratio * plain.v[generator],
            plain.drive.generator_torque,
            plain.aero.air_density,
            plain.pitch.array,
            plain.rotor.array,
            watch,
        )
        watch_blades(
            t,
            plain.blade_nodes.array,
            plain.motion.array,
            plain.frame.array,
            plain.machine.array,
            plain.tower_flow.array,
            watch,
        )
        due = step % clock[EVERY_OUTPUT] == 0
        if due or clock[WANT_LOADS] == 1:
            observe(t, efficiency, one, sections, due)
            if electrical[ON] > 0.0:
                summary[POWER] = electric[GRID_POWER]
        if due:
            for j in range(index.shape[0]):
                output[clock[ROW], j] = signals[index[j]]
            clock[ROW] += 1
        # to the next instant
        for j in range(q.shape[0]):
            v_now, a_now = v[j], a[j]
            before = a_old[j] if step > 0 else a_now
            q[j] += dt * (v_now + 0.5 * dt * a_now)
            v[j] = v_now + dt * (1.5 * a_now - 0.5 * before)
            v_old[j] = v_now
            a_old[j] = a_now
        gear_begin(dt, m)
        pitch_advance(actuators, demands, faults, pitch, dt)
        yaw_advance(actuators, structure[YAW_STIFFNESS], demands, faults, drive, q[yaw], v[yaw], dt)
        flap_advance(flap_actuators, demands, faults, flap, dt)
        clock[STEP] = step + 1
