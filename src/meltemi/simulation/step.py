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

from numpy import float32, float64, int64
from numpy.typing import NDArray

from meltemi.aero.flaps import ANGLE as FLAP_ANGLE
from meltemi.aero.rotor import AIR_DENSITY, disk_averages, loads, quasi_steady, relative_wind
from meltemi.aero.tables import AeroOptions
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
from meltemi.maths.access import vec1
from meltemi.maths.algebra import Vec
from meltemi.maths.tables import MAX_BLADES, Table, number, xyz
from meltemi.numbers.views import viewer
from meltemi.simulation.validity import watch_blades, watch_shaft
from meltemi.structure.dynamics import accelerations, assemble, collect_blades
from meltemi.structure.gears import gear_accelerations, gear_begin, gear_end
from meltemi.structure.kinematics import GENERATOR, N_SHAFT, YAW, blade_frames, blade_motion, nacelle_and_hub, tower_top
from meltemi.structure.section_loads import (
    APEX_MOMENT,
    R_MOMENT,
    TOP_TOTAL_ACCELERATION,
    YAW_MOMENT,
    blade_loads,
    chain_loads,
    station_loads,
    tower_loads,
)
from meltemi.structure.tables import StructureParameters
from meltemi.turbine import exchange as ex
from meltemi.wind.velocity import series_now, wind_velocity

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
SHAFT_TORQUE = APEX_MOMENT
"""The first component of the apex moment is the torque."""
OK, DIVERGED, CONTROLLER_RAISED, CONTROLLER_DEMAND = 0, 1, 2, 3
"""Values of ``clock[STATUS]``, as in ``core.errors.Status``."""
ABSURD = 1e6
"""Coordinates (m, rad) and velocities beyond this have diverged."""

PARTS = (
    "q v a locked structure blade_nodes shape second modal top_shape top_second tower_matrix tower_weight "
    "tower_shape aero aero_options aero_nodes polars section flap_nodes increments flap wind series now box pitch "
    "drive gear_modes gears inflow stall memory columns machine frame partial motion load body link arm_mass arm_force "
    "core_mass core_force coupling flow rotor tower_flow tower_lanes tower_push"
).split()
"""Arrays of :func:`equations`, in the order of its arguments after t and dt."""
NODES = (
    "blade_nodes shape second aero_nodes flap_nodes partial motion load flow inflow stall memory d_inflow d_stall "
    "tower_shape tower_lanes"
).split()
"""Those whose last axis are the nodes of a blade or of the tower; ``tower_lanes`` is ``tower_flow``, read in lanes."""
LOAD_PARTS = (
    "q v a structure gear_modes gears gear_rows gear_shape blade_nodes blade_edges shape tip_shape tip_second "
    "top_shape tower_nodes tower_shape columns machine frame partial motion load body link tower_drag apex root chain "
    "gear_loads blade_stations station tower_stations tower_station summary"
).split()
"""Arrays of :func:`section_loads`, in the order of its arguments; then the summary."""
RUN_PARTS = (
    "controller_state measured demands faults actuators flap_actuators conditions outside electrical electric v_old "
    "a_old spare aero_state signals output watch"
).split()
"""Arrays of a run under way, see :func:`advance`."""
ROOT, CHAIN = LOAD_PARTS.index("root"), LOAD_PARTS.index("chain")
Q, V, A, P_STRUCTURE, COLUMNS = (PARTS.index(name) for name in ("q", "v", "a", "structure", "columns"))
P_AERO = PARTS.index("aero")
P_WIND, P_SERIES, NOW, BOX = (PARTS.index(name) for name in ("wind", "series", "now", "box"))
P_PITCH, P_DRIVE, P_FLAP = (PARTS.index(name) for name in ("pitch", "drive", "flap"))
GEAR_MODES, GEARS, P_MACHINE = (PARTS.index(name) for name in ("gear_modes", "gears", "machine"))
LOCKED, CORE_MASS, CORE_FORCE, ARM_MASS, COUPLING, ARM_FORCE = (
    PARTS.index(name) for name in ("locked", "core_mass", "core_force", "arm_mass", "coupling", "arm_force")
)

P_NODES, P_MOTION, P_FRAME, P_ROTOR, P_TOWER = (
    PARTS.index(name) for name in ("blade_nodes", "motion", "frame", "rotor", "tower_flow")
)

(TOWER_DRAG,) = AeroOptions.slots("tower_drag")
GEAR_RATIO, TOWER_BASE, TOWER_LENGTH, SHAFT_HEIGHT, OVERHANG, TILT, YAW_STIFFNESS = StructureParameters.slots(
    "gear_ratio tower_base tower_length shaft_height overhang tilt yaw_stiffness"
)


@kernel
def equations(
    t: float,
    dt: float,
    q: Float,
    v: Float,
    a: Float,
    locked: Float,
    structure: Float,
    blade_nodes: Float,
    shape: Float,
    second: Float,
    modal: Float,
    top_shape: Float,
    top_second: Float,
    tower_matrix: Float,
    tower_weight: Float,
    tower_shape: Float,
    aero: Float,
    aero_options: Int,
    aero_nodes: Float,
    polars: Float,
    section: Float,
    flap_nodes: Float,
    increments: Float,
    flap: Float,
    wind: Float,
    series: Float,
    now: Float,
    box: NDArray[float32],
    pitch: Float,
    drive: Float,
    gear_modes: Float,
    gears: Float,
    inflow: Float,
    stall: Float,
    memory: Float,
    columns: Float,
    machine: Float,
    frame: Float,
    partial: Float,
    motion: Float,
    load: Float,
    body: Float,
    link: Float,
    arm_mass: Float,
    arm_force: Float,
    core_mass: Float,
    core_force: Float,
    coupling: Float,
    flow: Float,
    rotor: Float,
    tower_flow: Float,
    tower_lanes: Float,
    tower_push: Float,
) -> None:
    """The assembled equations of motion at time ``t`` for coordinates q and velocities v.

    Mass matrix and forces are left in ``core_mass``, ``core_force``, ``coupling``, ``arm_mass`` and
    ``arm_force``.

    Args:
      dt: [s] by which the states of inflow and stall lag behind ``t`` and are moved first, and at whose end the modes
        of a gearbox were predicted; 0 leaves them.
    """
    n_core = columns.shape[1]
    # motion
    tower_top(q, v, structure, top_shape, top_second, columns, machine)
    nacelle_and_hub(q, v, structure, columns, machine)
    blade_frames(structure, pitch, machine, frame)
    blade_motion(q, v, n_core, shape, second, blade_nodes, frame, partial, motion)
    # wind and aerodynamic loads
    series_now(t, series, now)
    tower_wind(t, q, v, tower_shape, wind, now, box, tower_lanes)
    relative_wind(t, aero, aero_options, aero_nodes, wind, now, box, tower_flow, machine, frame, pitch, motion, flow)
    disk_averages(aero, aero_nodes, machine, flow, rotor)
    quasi_steady(aero, aero_options, aero_nodes, polars, section, flap_nodes, increments, flap, flow, memory, rotor)
    loads(
        dt,
        aero,
        aero_options,
        aero_nodes,
        polars,
        section,
        flap_nodes,
        increments,
        flap,
        machine,
        frame,
        motion,
        flow,
        rotor,
        memory,
        inflow,
        stall,
        load,
    )
    tower_load(aero_options[TOWER_DRAG] * aero[AIR_DENSITY], tower_lanes, tower_shape, tower_push)
    # equations of motion
    collect_blades(
        q,
        v,
        n_core,
        structure,
        shape,
        blade_nodes,
        modal,
        frame,
        partial,
        motion,
        load,
        body,
        link,
        arm_mass,
        arm_force,
    )
    assemble(
        dt,
        q,
        v,
        structure,
        drive,
        gear_modes,
        gears,
        columns,
        tower_matrix,
        tower_weight,
        tower_push,
        machine,
        frame,
        body,
        link,
        core_mass,
        core_force,
        coupling,
    )


view_run = viewer()
view_parts = viewer({PARTS.index(name) for name in NODES if name in PARTS})
view_load_parts = viewer()


@kernel
def evaluate(t: float, dt: float, numbers: tuple[Any, ...], parts: tuple[Any, ...], solve: bool) -> None:
    """Everything at time ``t``; the accelerations go to ``a``.

    Args:
      numbers: the kinds of number in which to compute, see ``numbers.views``, for run, parts and load parts.
      parts: arrays of :func:`equations` after t and dt, as the host has them.
      solve: False leaves the equations of motion assembled.
    """
    seen = view_parts(numbers[1], parts)
    equations(t, dt, *seen)
    if solve:
        accelerations(
            seen[LOCKED],
            seen[CORE_MASS],
            seen[CORE_FORCE],
            seen[ARM_MASS],
            seen[COUPLING],
            seen[ARM_FORCE],
            seen[A],
        )
        n_tower = seen[COLUMNS].shape[1] - N_SHAFT
        gear_accelerations(dt, n_tower, seen[A], seen[GEAR_MODES], seen[GEARS], seen[COLUMNS], seen[P_MACHINE])


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
    v: Float,
    n_core: int,
    structure: Float,
    wind: Float,
    series: Float,
    now: Float,
    box: NDArray[float32],
    drive: Float,
    efficiency: float,
    shaft_torque: float,
    summary: Float,
) -> None:
    """Fill the summary; ``hub`` [m] is the place of the hub, ``shaft_torque`` [N m] that of the rotor on the shaft."""
    n = n_core - N_SHAFT
    series_now(t, series, now)
    height = structure[TOWER_BASE] + structure[TOWER_LENGTH] + structure[SHAFT_HEIGHT]
    u = wind_velocity(Vec(0.0, 0.0, height + structure[OVERHANG] * sin(structure[TILT])), t, wind, now, box)
    seen = wind_velocity(hub, t, wind, now, box)
    speed = structure[GEAR_RATIO] * v[n + GENERATOR]
    summary[TIME] = t
    summary[WIND], summary[WIND + 1], summary[WIND + 2] = u.x, u.y, u.z
    summary[HUB_WIND], summary[HUB_WIND + 1], summary[HUB_WIND + 2] = seen.x, seen.y, seen.z
    summary[GENERATOR_SPEED] = speed
    summary[TORQUE] = drive[ex.GENERATOR_TORQUE]
    summary[POWER] = electrical_power(drive[ex.GENERATOR_TORQUE] * speed, efficiency)
    summary[ROTOR_POWER] = (v[n + GENERATOR] + v[n + GENERATOR + 1]) * shaft_torque


@kernel
def section_loads(
    everywhere: bool,
    q: Float,
    v: Float,
    a: Float,
    structure: Float,
    gear_modes: Float,
    gears: Float,
    gear_rows: Float,
    gear_shape: Float,
    blade_nodes: Float,
    blade_edges: Float,
    shape: Float,
    tip_shape: Float,
    tip_second: Float,
    top_shape: Float,
    tower_nodes: Float,
    tower_shape: Float,
    columns: Float,
    machine: Float,
    frame: Float,
    partial: Float,
    motion: Float,
    load: Float,
    body: Float,
    link: Float,
    tower_drag: Float,
    apex: Float,
    root: Float,
    chain: Float,
    gear_load: Float,
    blade_stations: Float,
    station: Float,
    tower_stations: Float,
    tower_station: Float,
) -> None:
    """Section loads after an evaluation: at roots, hub and yaw bearing, and ``everywhere`` along tower and blades."""
    blade_loads(q, a, structure, columns, machine, frame, body, link, tip_shape, tip_second, apex, root)
    chain_loads(
        q,
        v,
        a,
        structure,
        gear_modes,
        gears,
        gear_rows,
        gear_shape,
        columns,
        machine,
        apex,
        top_shape,
        chain,
        gear_load,
    )
    if not everywhere:
        return
    tower_loads(q, a, structure, machine, apex, tower_nodes, tower_shape, tower_drag, tower_stations, tower_station)
    station_loads(
        a,
        structure,
        columns,
        blade_nodes,
        blade_edges,
        shape,
        partial,
        frame,
        motion,
        load,
        blade_stations,
        station,
    )


@kernel
def observe(
    t: float,
    efficiency: float,
    numbers: tuple[Any, ...],
    parts: tuple[Any, ...],
    load_parts: tuple[Any, ...],
    everywhere: bool,
) -> None:
    """Section loads and summary after an evaluation; only ``everywhere`` for outputs, for controllers the nearest."""
    seen, loads_seen = view_parts(numbers[1], parts), view_load_parts(numbers[2], load_parts)
    section_loads(everywhere, *loads_seen[:-1])
    whole_machine(
        t,
        vec1(seen[P_MACHINE], ex.HUB_POSITION),
        seen[V],
        seen[COLUMNS].shape[1],
        seen[P_STRUCTURE],
        seen[P_WIND],
        seen[P_SERIES],
        seen[NOW],
        seen[BOX],
        seen[P_DRIVE],
        efficiency,
        loads_seen[CHAIN][SHAFT_TORQUE],
        loads_seen[-1],
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
    numbers: tuple[Any, ...],
    run: tuple[Any, ...],
    parts: tuple[Any, ...],
    load_parts: tuple[Any, ...],
) -> None:
    """March ``n_steps`` instants, or until something ends the run (``clock[STATUS]``).

    Args:
      events: (n, 3) see ``control.faults.happen``.
      index: (channels,) places in the signals, recorded in the columns of the output.
      run: arrays RUN_PARTS. ``v_old`` and ``a_old`` are velocities and accelerations of the last instant,
        ``aero_state`` are states and memory of inflow and stall as one vector, ``spare`` a copy of it for
        corrections, ``signals`` is everything a channel may ask for, ``output`` has (rows, channels), ``watch`` is
        that of ``simulation.validity``.
      numbers, parts, load_parts: as in :func:`evaluate` and :func:`observe`.
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
    ) = view_run(numbers[0], run)
    seen, loads_seen = view_parts(numbers[1], parts), view_load_parts(numbers[2], load_parts)
    aero = seen[P_AERO]
    q, v, a, structure, n_core = seen[Q], seen[V], seen[A], seen[P_STRUCTURE], seen[COLUMNS].shape[1]
    pitch, drive, flap = seen[P_PITCH], seen[P_DRIVE], seen[P_FLAP]
    gear_modes, gears = seen[GEAR_MODES], seen[GEARS]
    root, chain, summary = loads_seen[ROOT], loads_seen[CHAIN], loads_seen[-1]
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
            evaluate(t, behind, numbers, parts, True)
            if step > 0:
                for j in range(q.shape[0]):
                    v[j] = v_old[j] + 0.5 * dt * (a_old[j] + a[j])
        if step > 0:
            gear_end(dt, gear_modes, gears)
        if diverged(q, v):
            clock[STATUS] = DIVERGED
            return
        # plain numbers, as the host has them
        generator = n_core - N_SHAFT + GENERATOR
        watch_shaft(
            t,
            dt,
            parts[V][generator] + parts[V][generator + 1],
            parts[P_STRUCTURE][GEAR_RATIO] * parts[V][generator],
            parts[P_DRIVE][ex.GENERATOR_TORQUE],
            parts[P_AERO][AIR_DENSITY],
            parts[P_PITCH],
            parts[P_ROTOR],
            watch,
        )
        watch_blades(t, parts[P_NODES], parts[P_MOTION], parts[P_FRAME], parts[P_MACHINE], parts[P_TOWER], watch)
        due = step % clock[EVERY_OUTPUT] == 0
        if due or clock[WANT_LOADS] == 1:
            observe(t, efficiency, numbers, parts, load_parts, due)
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
        gear_begin(dt, gear_modes, gears)
        pitch_advance(actuators, demands, faults, pitch, dt)
        yaw_advance(actuators, structure[YAW_STIFFNESS], demands, faults, drive, q[yaw], v[yaw], dt)
        flap_advance(flap_actuators, demands, faults, flap, dt)
        clock[STEP] = step + 1
