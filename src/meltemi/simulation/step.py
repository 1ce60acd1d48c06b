"""The coupled turbine: the only file in which wind, aerodynamics, structure and control exchange data.

``evaluate`` computes all quantities at one instant: for blades and tower by :func:`equations`, for a disk with a power
coefficient as in ``simulation/disk``. ``advance`` marches either: at each instant, in this order,

1. events that are due;
2. sample: measurements from the state (with extrapolated velocity and acceleration) and the last loads, by the sensors;
3. control, at its sample instants: demands;
4. actuators: their motion under the previous demands; ideal ones follow the new demands without lag; parts of the
   drive, such as converters, over the following step, whose mean torque acts at this instant;
5. physics: ``evaluate``, which completes the velocities of the step that ends here;
6. record, at output instants;

and then the step to the next instant. Structure: explicit Newmark scheme (beta 0, gamma 1/2), with the
velocity in forces extrapolated from the two last accelerations, so that one evaluation per step suffices:

    q_{n+1} = q_n + h v_n + h^2/2 a_n
    v*      = v_n + h (3/2 a_n - 1/2 a_{n-1})
    a_{n+1} = a(q_{n+1}, v*, t_{n+1})
    v_{n+1} = v_n + h/2 (a_n + a_{n+1})

It is of second order and neither damps nor excites free vibrations. Stiff coordinates, or all of them as an option,
take implicit steps (M-41 to M-45): their stiffness and damping act with the motion at the end of the step. The linear
parts of the states of inflow and stall take exact steps, modes of a gearbox implicit ones, solved with a_{n+1}.

Parts of the machine that not every model has (``simulation/parts.py``) act at the hooks below.

Reference: docs/theory/simulation.md (M-1 to M-9, M-41 to M-45); Newmark (1959); Beeman (1976).
"""

from __future__ import annotations

from collections.abc import Callable
from math import atan2, sin, sqrt
from typing import Any

from numpy import float64
from numpy.typing import NDArray

from meltemi.aero.rotor import derivatives, disk_averages, induce, loads, relative_wind, settle
from meltemi.aero.tower_flow import tower_load, tower_wind
from meltemi.compiler import Vec, by_control, by_record, control_hook, hook, kernel, overload, types
from meltemi.control.actuators import drive_advance, flap_advance, pitch_advance, yaw_advance
from meltemi.control.faults import apply_events, report
from meltemi.environment.conditions import conditions_now
from meltemi.simulation.system import (
    AnySystem,
    Control,
    March,
    Outputs,
    System,
    generator_speed,
    rotor_azimuth,
    rotor_speed,
)
from meltemi.simulation.watch import watch_blades, watch_shaft
from meltemi.structure.blades import collect_blades
from meltemi.structure.chain import accelerations, assemble, chain_loads, implicit_terms, motion
from meltemi.structure.equations import yaw_row
from meltemi.structure.gears import gear_accelerations, gear_begin, gear_end
from meltemi.wind.velocity import series_now, wind_velocity

Float = NDArray[float64]
Controller = Callable[[Float, Float, Float, float], None]
Evaluate = Callable[[float, float, AnySystem], None]
Observe = Callable[[float, Control, AnySystem, Outputs, bool], None]

OK, DIVERGED, CONTROLLER_RAISED, CONTROLLER_DEMAND, UNKNOWN_ROTOR = 0, 1, 2, 3, 6
"""Values of the run's status, as in ``core.errors.Status``."""
ABSURD = 1e6
"""Bound of coordinates (m, rad) and velocities, beyond which they have diverged; 1e6 rad are a day at rated speed."""


# variants by kind of rotor ------------------------------------------------------------------------------


@by_record
def evaluate(t: float, dt: float, m: AnySystem) -> None:
    """Evaluate all quantities at time ``t``; the accelerations go to ``a``.

    Args:
      dt: [s] time since the states of inflow and stall were advanced; they are advanced first, and the modes of a
        gearbox have been predicted for the end of this step; 0 keeps both.
    """


@by_record
def section_loads(m: AnySystem, s: Outputs, everywhere: bool) -> None:
    """Compute section loads after an evaluation.

    Args:
      m: node by node, not in lanes.
      everywhere: include stations of tower and blades, in addition to roots, hub and yaw bearing.
    """


@by_record
def settle_inflow(m: AnySystem) -> None:
    """Set the states of inflow and stall to their steady values for the last evaluation."""


@by_record
def inflow_rates(m: AnySystem) -> None:
    """Compute the time derivatives of these states after an evaluation."""


@by_record
def begin_step(dt: float, m: AnySystem) -> None:
    """Predict further states of the rotor and shaft at the next instant, after coordinates and actuators."""


@by_record
def end_step(dt: float, m: AnySystem) -> None:
    """Correct the prediction of :func:`begin_step` with the accelerations at the end of the step."""


@by_record
def check_rotor(t: float, m: AnySystem, run: March) -> bool:
    """Check the validity criteria of the rotor; False if its model has no loads at this operating condition."""
    raise NotImplementedError


# parts of the machine -----------------------------------------------------------------------------------


@hook
def outer_forces(t: float, m: System) -> None:
    """Add forces of parts at time ``t`` to ``core_force``, and added mass to the lower triangle of ``core_mass``."""


@hook
def outer_blade_loads(m: System) -> None:
    """Add forces of parts on the blades, by the present accelerations, to ``body``, before its section loads."""


@hook
def outer_section_loads(m: System, s: Outputs) -> None:
    """Compute section loads of parts after those of tower and blades."""


@hook
def settle_induction(m: System) -> None:
    """Set the states of an induction model to their steady values for the last evaluation."""


@hook
def begin_parts_step(dt: float, m: AnySystem) -> None:
    """Predict the states of parts at the next instant, after those of the rotor."""


@hook
def end_parts_step(dt: float, m: AnySystem) -> None:
    """Correct that prediction with the motion at the end of the step."""


@hook
def check_parts(m: AnySystem, run: March) -> None:
    """End a run in which a part cannot go on: set its status; ``Part.why`` has the reason. ``m`` in plain floats."""


@hook
def part_rates(m: AnySystem) -> None:
    """Compute the time derivatives of the states of parts after an evaluation."""


@control_hook
def begin_parts(dt: float, c: Control, m: AnySystem) -> None:
    """Bring parts into steady operation at the present motion and demands; ``dt`` [s] is that of the steps of the run
    that begins, 0 if none does: the limit of short ones."""


@control_hook
def part_drive_rates(c: Control, m: AnySystem) -> None:
    """Compute the time derivatives of parts of the drive, and their torque, before an evaluation."""


@control_hook
def advance_drive(c: Control, m: AnySystem) -> None:
    """Advance parts of the drive over the following step; they may replace the generator's torque by its mean."""


@control_hook
def report_parts(c: Control) -> None:
    """Change the measurements of parts for the controller."""


@by_control
def generated_power(c: Control, m: AnySystem) -> float:
    """[W] electrical power of the turbine."""
    raise NotImplementedError


# blades and tower ---------------------------------------------------------------------------------------


@kernel
def equations(t: float, dt: float, m: System) -> None:
    """Assemble the equations of motion at time ``t`` for coordinates q and velocities v.

    The results are ``core_mass``, ``core_force``, ``coupling``, ``arm_mass`` and ``arm_force``; ``dt`` is that of
    :func:`evaluate`.
    """
    motion(m)
    # wind and aerodynamic loads
    series_now(t, m)
    tower_wind(t, m)
    relative_wind(t, m)
    disk_averages(m)
    induce(t, m)
    loads(dt, m)
    tower_load(m)
    # equations of motion
    collect_blades(m)
    assemble(dt, m)
    outer_forces(t, m)


@evaluate.variant
@kernel
def _(t: float, dt: float, m: System) -> None:
    equations(t, dt, m)
    if dt > 0.0:
        implicit_terms(dt, m)
    accelerations(m)
    gear_accelerations(dt, m)


@section_loads.variant
@kernel
def _(m: System, s: Outputs, everywhere: bool) -> None:
    outer_blade_loads(m)
    chain_loads(m, s, everywhere)
    if everywhere:
        outer_section_loads(m, s)


@settle_inflow.variant
@kernel
def _(m: System) -> None:
    settle(m)
    settle_induction(m)


inflow_rates.variant(derivatives)
begin_step.variant(gear_begin)
end_step.variant(gear_end)


@check_rotor.variant
@kernel
def _(t: float, m: System, run: March) -> bool:
    watch_blades(t, m, run.watch)
    return True


# any turbine --------------------------------------------------------------------------------------------


@kernel
def electrical_power(mechanical: float, efficiency: float) -> float:
    """[W] electrical power for [W] on the generator's shaft; the losses of a motoring generator add to its input."""
    return mechanical * (efficiency if mechanical >= 0.0 else 1.0 / efficiency)


@generated_power.variant
@kernel
def _(c: Control, m: AnySystem) -> float:
    return electrical_power(c.drive.generator_torque * generator_speed(m), c.settings.efficiency)


@kernel
def surroundings(t: float, c: Control, m: AnySystem) -> None:
    """Set air and grid at time ``t``, with the grid voltage of events."""
    conditions_now(t, c.conditions, m.aero.air_density, c.outside)
    c.outside.grid_voltage *= c.faults.voltage * c.faults.grid
    m.aero.air_density = c.outside.air_density


@kernel
def sample(t: float, c: Control, m: AnySystem) -> None:
    """Measure at time ``t``: motion of this instant with its accelerations (M-46), loads of the last one."""
    x, yaw, drive, outside, chain = c.measured, yaw_row(m), c.drive, c.outside, c.chain
    x.time = t
    x.generator_speed = generator_speed(m)
    x.rotor_speed = rotor_speed(m)
    x.azimuth = rotor_azimuth(m)
    x.torque = drive.generator_torque
    x.power = generated_power(c, m)
    x.yaw = m.q[yaw]
    x.yaw_rate = m.v[yaw]
    for b in range(c.pitch.blades):
        moment = c.root.moment[b]
        x.pitch[b] = c.pitch.angle[b] - c.actuators.pitch_offset[b]
        x.out_of_plane_moment[b] = moment.y
        x.in_plane_moment[b] = moment.x
    for j in range(c.flap.flaps):
        for b in range(c.flap.blades):
            x.flap[j, b] = c.flap.angle[j, b]
    wind = c.summary.hub_wind
    x.wind_speed = sqrt(wind.x * wind.x + wind.y * wind.y)
    x.wind_direction = atan2(-wind.y, wind.x)
    x.fore_aft_acceleration = chain.next_acceleration.x
    x.side_side_acceleration = chain.next_acceleration.y
    x.rotor_power = c.summary.rotor_power
    x.hub_moment = chain.apex_moment
    x.yaw_bearing_moment = chain.yaw_moment
    x.nacelle_turning = chain.next_turning
    x.air_temperature = outside.air_temperature
    x.humidity = outside.humidity
    x.air_pressure = outside.air_pressure
    x.grid_voltage = outside.grid_voltage
    x.grid_frequency = outside.grid_frequency
    x.power_reference = outside.power_reference


@kernel
def sense(t: float, following: int, c: Control, m: AnySystem) -> None:
    """Apply sensor faults, and add grid and operator signals, to the measurements for the controller.

    Args:
      following: index of the first event that is still to come.
    """
    sample(t, c, m)
    if following > 0:
        report(t, c.faults, c.measured)
    report_parts(c)


@kernel
def whole_machine(t: float, c: Control, m: AnySystem) -> None:
    """Fill the summary after section loads; ``m`` node by node."""
    s, p = c.summary, m.structure
    series_now(t, m)
    undeflected = p.tower_base + p.tower_length + p.shaft_height + p.overhang * sin(p.tilt)
    s.time = t
    s.wind = wind_velocity(Vec(0.0, 0.0, undeflected), t, m)
    s.hub_wind = wind_velocity(m.machine.hub_position, t, m)
    s.generator_speed = generator_speed(m)
    s.generator_torque = m.drive.generator_torque
    s.power = generated_power(c, m)
    s.rotor_power = rotor_speed(m) * c.chain.apex_moment.x


@kernel
def observe(t: float, c: Control, m: AnySystem, s: Outputs, everywhere: bool) -> None:
    """Section loads and summary after an evaluation; ``everywhere`` for outputs, else those that controllers need.

    Controllers see the accelerations of the next instant (M-46), which need those of the step before.

    Args:
      m: node by node, not in lanes.
    """
    chain, h = c.chain, c.settings.time_step
    top, turning = chain.top_acceleration, chain.nacelle_turning
    section_loads(m, s, everywhere)
    last = 1.0 if abs(t - h - c.summary.time) < 0.5 * h else 0.0  # not at the start, nor after steps without loads
    chain.next_acceleration = chain.top_acceleration + last * (chain.top_acceleration - top)
    chain.next_turning = chain.nacelle_turning + last * (chain.nacelle_turning - turning)
    whole_machine(t, c, m)


@kernel
def diverged(m: AnySystem) -> bool:
    """Whether a coordinate or velocity is NaN or beyond its bound."""
    for i in range(m.q.shape[0]):
        if not (abs(m.q[i]) < ABSURD and abs(m.v[i]) < ABSURD):
            return True
    return False


# the march ----------------------------------------------------------------------------------------------


def attempt(controller: Controller, state: Float, measured: Float, demands: Float, dt: float) -> bool:
    """Call a controller; False if it raised an exception, which graphics cards do not have."""
    try:
        controller(state, measured, demands, dt)
    except Exception:
        return False
    return True


@overload(attempt, strict=False)  # type: ignore[untyped-decorator]
def _attempt(controller: Any, state: Any, measured: Any, demands: Any, dt: Any) -> Any:
    def call(controller: Any, state: Any, measured: Any, demands: Any, dt: Any) -> bool:
        controller(state, measured, demands, dt)
        return True

    return attempt if isinstance(controller, types.FunctionType) else call


@kernel
def control(t: float, controller: Controller, run: March, c: Control, m: AnySystem) -> None:
    """Call the controller with the sensor signals; invalid demands and exceptions set the status of the run."""
    clock = run.clock
    sense(t, clock.next_event, c, m)
    dt = clock.every_control * c.settings.time_step
    if not attempt(controller, run.controller_state, c.measured.array, c.demands.array, dt):
        clock.status = CONTROLLER_RAISED
    if clock.status == OK:
        for i in range(run.limits.shape[0]):
            if not (abs(c.demands.array[i]) <= run.limits[i]):
                clock.status = CONTROLLER_DEMAND


@kernel
def actuate(dt: float, c: Control, m: AnySystem) -> None:
    """Advance the actuators by ``dt`` under constant demands; 0 for ideal actuators after new demands."""
    pitch_advance(dt, c)
    yaw = yaw_row(m)
    if dt <= 0.0:
        generate(c, m)
    yaw_advance(dt, c, m.structure.yaw_stiffness, m.q[yaw], m.v[yaw])
    flap_advance(dt, c)


@kernel
def generate(c: Control, m: AnySystem) -> None:
    """Set the torque of generator and brake."""
    c.drive.torque_held = c.drive.generator_torque
    drive_advance(c)
    advance_drive(c, m)


@kernel
def between(share: float, c: Control) -> None:
    """Let what jumps at this instant, generator torque, pitch and flap angles, keep a share of its value before.

    The values after the jump are held until :func:`complete` sets them.
    """
    drive, pitch, flap = c.drive, c.pitch, c.flap
    torque = drive.generator_torque
    drive.generator_torque = torque + share * (drive.torque_held - torque)
    drive.torque_held = torque
    for b in range(pitch.blades):
        angle = pitch.angle[b]
        pitch.angle[b] = angle + share * (pitch.held[b] - angle)
        pitch.held[b] = angle
    for j in range(flap.flaps):
        for b in range(flap.blades):
            angle = flap.angle[j, b]
            flap.angle[j, b] = angle + share * (flap.held[j, b] - angle)
            flap.held[j, b] = angle


@kernel
def complete(c: Control) -> None:
    """Complete the jumps of this instant."""
    drive, pitch, flap = c.drive, c.pitch, c.flap
    drive.generator_torque = drive.torque_held
    for b in range(pitch.blades):
        pitch.angle[b] = pitch.held[b]
    for j in range(flap.flaps):
        for b in range(flap.blades):
            flap.angle[j, b] = flap.held[j, b]


@kernel
def physics(t: float, dt: float, evaluate: Evaluate, run: March, m: AnySystem) -> None:
    """Evaluate at ``t`` and complete the velocities of the step that ends here."""
    first, corrections, w = run.clock.step == 0, run.clock.corrections, m.weights
    for i in range(1 + corrections):
        if corrections > 0:
            # entry by entry: copies of whole arrays compile a check of shapes that takes seconds
            for j in range(run.spare.shape[0]):
                if i == 0:
                    run.spare[j] = run.aero_state[j]
                else:
                    run.aero_state[j] = run.spare[j]
        evaluate(t, 0.0 if first else dt, m)
        if not first:
            for j in range(m.q.shape[0]):
                m.v[j] = run.v_old[j] + 0.5 * dt * (run.a_old[j] + m.a[j])
                if w.position[j] > 0.0:
                    m.q[j] += w.position[j] * (m.a[j] - w.expected[j])
                    m.v[j] -= w.lag[j] * (m.a[j] - run.a_old[j])
                    w.expected[j] = m.a[j]
    if not first:
        end_step(dt, m)
        end_parts_step(dt, m)


@kernel
def predict(dt: float, run: March, m: AnySystem) -> None:
    """Predict coordinates, and velocities for forces, at the next instant."""
    w = m.weights
    for j in range(m.q.shape[0]):
        v, a = m.v[j], m.a[j]
        before = run.a_old[j] if run.clock.step > 0 else a
        m.q[j] += dt * (v + 0.5 * dt * a)
        m.v[j] = v + dt * (1.5 * a - 0.5 * before)
        run.v_old[j] = v
        run.a_old[j] = a
        if w.position[j] > 0.0:
            change = a - before
            m.q[j] += (w.position[j] + dt * w.lag[j]) * change
            run.v_old[j] += w.lag[j] * change
            w.expected[j] = a + change


def advance(  # noqa: PLR0913 - the whole run
    n_steps: int,
    controller: Controller,
    evaluate: Evaluate,
    observe: Observe,
    run: March,
    c: Control,
    m: AnySystem,
    one: AnySystem,
    plain: AnySystem,
    sections: Outputs,
) -> None:
    """March ``n_steps`` instants, or until something ends the run (``run.clock.status``).

    Args:
      evaluate, observe: those above, or their machine code: it is then not part of that of this loop.
      m, one, plain: the turbine in the number type of the run; node by node; and in plain floats for the host.
    """
    clock, dt = run.clock, c.settings.time_step
    for _ in range(n_steps if clock.status == OK else 0):
        t = clock.step * dt
        clock.next_event = apply_events(clock.step, clock.next_event, run.events, c.faults)
        surroundings(t, c, m)
        if clock.step % clock.every_control == 0:
            control(t, controller, run, c, m)
            if clock.status != OK:
                return
        actuate(0.0, c, m)
        between(c.settings.held_share if clock.step > 0 else 0.0, c)
        physics(t, dt, evaluate, run, m)
        complete(c)
        if diverged(m):
            clock.status = DIVERGED
            return
        if not check_rotor(t, plain, run):
            clock.status = UNKNOWN_ROTOR
            return
        check_parts(plain, run)
        if clock.status != OK:
            return
        watch_shaft(t, dt, plain, run.watch)
        due = clock.step % clock.every_output == 0
        if due or clock.want_loads == 1:
            observe(t, c, one, sections, due)
        if due:
            for j in range(run.places.shape[0]):
                run.output[clock.row, j] = run.signals[run.places[j]]
            clock.row += 1
        predict(dt, run, m)
        actuate(dt, c, m)
        begin_step(dt, m)
        begin_parts_step(dt, m)
        clock.step += 1
