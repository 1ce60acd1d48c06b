"""From the motion of the blade nodes to the loads on them: the aerodynamic entry point.

Three passes over the nodes, because the rotor's averages stand between them:

1. ``relative_wind``: wind at the nodes (tower influence included) minus their velocity, in strip axes;
   then ``disk_averages``: mean wind, skew, tip-speed ratio;
2. ``quasi_steady``: the momentum balance at each node; then the mean induction and the time of the inflow;
3. ``loads``: dynamic inflow, skewed wake, dynamic stall, coefficients, loads.

Pass 3 moves the states of inflow and stall over the step that led here (``dt``); with dt = 0 it
evaluates the loads for the states as they are.

Reference: docs/theory/aerodynamics.md (A-1 to A-47).
"""

from __future__ import annotations

from math import acos, atan2, cos, pi, sin, sqrt, tan

from numpy import float32, float64, int64
from numpy.typing import NDArray

from meltemi.aero.bem import STILL, Strip, induction
from meltemi.aero.flaps import Increment, equivalent_angle, flap_increment
from meltemi.aero.inflow import (
    QUASI_STEADY,
    VARIABLE_TIME,
    Inflow,
    first_time,
    inflow_advance,
    inflow_derivative,
    inflow_steady,
    second_time,
)
from meltemi.aero.stall import (
    CAMBER,
    DYNAMIC,
    FADE_TO,
    NO_ROTATION,
    SLOW_FROM,
    STATIC,
    Rotation,
    Stall,
    StallInput,
    angle_at_three_quarters,
    model_weight,
    ramp,
    section_rotation,
    stall_advance,
    stall_coefficients,
    stall_derivative,
    stall_steady,
    static_coefficients,
    wrap,
)
from meltemi.aero.stall import SLOPE as STALL_SLOPE
from meltemi.aero.tables import (
    AeroMemory,
    AeroNode,
    AeroOptions,
    AeroParameters,
    BladeFlow,
    InflowState,
    RotorFlow,
    StallState,
)
from meltemi.aero.tower_flow import tower_influence
from meltemi.core.kernel import kernel
from meltemi.maths.access import put1, put3, rot2, vec1, vec2, vec3
from meltemi.maths.generic import crossed, largest, total, where, whole, zero
from meltemi.maths.vectors import Vec, cross, dot, norm
from meltemi.turbine import exchange as ex
from meltemi.wind.velocity import wind_velocity

Float = NDArray[float64]
Int = NDArray[int64]

AIR_DENSITY, INFLOW_LEAD, INFLOW_TIME, SKEW_FACTOR, AXIAL_DRAG, TANGENTIAL_DRAG, FADE_BEGIN, FADE_END = (
    AeroParameters.slots(
        "air_density inflow_lead inflow_time skew_factor axial_drag tangential_drag fade_begin fade_end"
    )
)
TIP_FACTOR, SWEEP_FLAP, TOWER_CUT = AeroParameters.slots("tip_factor sweep_flap tower_cut")
WAKE, HIGH_INDUCTION, SKEW_MODEL, INFLOW_MODEL, STALL_MODEL, STALL_ROTATION, TOWER_MODEL, ITERATIONS = (
    AeroOptions.slots("wake high_induction skew inflow stall stall_rotation tower iterations")
)
CHORD, TWIST, CENTRE, SLOPE_X, SLOPE_Y, LENGTH, SOLID_LENGTH = AeroNode.slots(
    "chord twist centre slope_x slope_y length solid_length"
)
TIP_NUMBER, HUB_NUMBER, END, POLAR_INDEX, AREA, RING = AeroNode.slots("tip_number hub_number end polar area ring")
WIND, VX, VY, RADIUS, THETA, COS_BEND, SIN_BEND, TURN, PITCHING = BladeFlow.slots(
    "wind vx vy radius theta cos_bend sin_bend rotation pitching"
)
STEADY_AXIAL, STEADY_TANGENTIAL, RESIDUAL, AXIAL, TANGENTIAL, PHI, ALPHA, SPEED = BladeFlow.slots(
    "steady_axial steady_tangential residual axial tangential phi alpha speed"
)
LIFT, DRAG, MOMENT, NORMAL_FORCE, DRIVING_FORCE, PITCHING_MOMENT = BladeFlow.slots(
    "lift drag moment normal_force driving_force pitching_moment"
)
R_WIND, AXIAL_WIND, SKEW, SKEW_AXIS, TIP_RATIO, FADE, INDUCTION, TIME, TIP_RADIUS = RotorFlow.slots(
    "wind axial_wind skew skew_axis tip_ratio fade induction inflow_time tip_radius"
)
R_FORCE, R_MOMENT, THRUST, TORQUE, R_RESIDUAL = RotorFlow.slots("force moment thrust torque residual")
I_REDUCED_X, I_X, I_REDUCED_Y, I_Y = InflowState.slots("reduced_x x reduced_y y")
S_WAKE_1, S_WAKE_2, S_PRESSURE, S_ATTACHMENT = StallState.slots("wake_1 wake_2 pressure attachment")
OLD_PHI, OLD_SLOPE, OLD_X, OLD_Y, OLD_TIME, OLD_ALPHA, OLD_RATE, OLD_PRESSURE, OLD_ATTACHMENT, SWITCHES = (
    AeroMemory.slots("phi slope induced_x induced_y time alpha rate pressure attachment switches")
)
SLOW, MOST_CAMBER = 1.0, 0.1
"""[m/s], [rad] limits of the curved flow's angle in the momentum balance, for rotors at rest."""


@kernel
def relative_wind(
    t: float,
    aero: Float,
    options: Int,
    nodes: Float,
    wind: Float,
    now: Float,
    box: NDArray[float32],
    tower: Float,
    machine: Float,
    frame: Float,
    pitch: Float,
    motion: Float,
    flow: Float,
) -> None:
    """Pass 1: wind at the nodes and relative wind in strip axes (A-1 to A-4)."""
    hub = vec1(machine, ex.HUB_POSITION)
    for b in range(flow.shape[1]):
        R = rot2(frame, ex.ROOT_ORIENTATION, b)
        shaft, root_spin = vec2(frame, ex.ROOT_SHAFT, b), vec2(frame, ex.ROOT_SPIN, b)
        cp, sp = frame[ex.COS_PITCH, b], frame[ex.SIN_PITCH, b]
        influenced = options[TOWER_MODEL] == 1 and (aero[TOWER_CUT] == 0.0 or cos(frame[ex.BLADE_AZIMUTH, b]) <= 0.0)
        for n in range(flow.shape[2]):
            theta = vec3(motion, ex.ROTATION, b, n)
            spin = vec3(motion, ex.SPIN, b, n)
            offset = turned_centre(nodes, theta, b, n)
            r = vec3(motion, ex.POSITION, b, n) + offset
            p = hub + R @ r
            u = wind_velocity(p, t, wind, now, box)
            if influenced:
                u += tower_influence(tower, p)
            put3(flow, WIND, b, n, u)
            w = R.T @ u - (vec3(motion, ex.VELOCITY, b, n) + cross(spin, offset))
            # unpitched blade axes, then along the bent blade: elastic slopes in and out of plane, and those of prebend
            sweep, flap = cp * theta.x + sp * theta.y, cp * theta.y - sp * theta.x
            x, y = nodes[SLOPE_X, b, n], nodes[SLOPE_Y, b, n]
            side, lean = sp * x - cp * y, cp * x + sp * y
            bend = flap + lean
            cb, sb = cos(bend), sin(bend)
            flow[VX, b, n] = cb * (cp * w.x + sp * w.y) - sb * w.z
            flow[VY, b, n] = cp * w.y - sp * w.x
            flow[COS_BEND, b, n] = cb
            flow[SIN_BEND, b, n] = sb
            elastic = spin - root_spin
            flow[TURN, b, n] = sb * (cp * spin.x + sp * spin.y) + cb * spin.z
            flow[PITCHING, b, n] = sb * (cp * elastic.x + sp * elastic.y) + cb * (elastic.z - pitch[1, b])
            # rotations about two axes turn the chord about the third
            turned = theta.z + 0.5 * (sweep * lean - flap * side) - aero[SWEEP_FLAP] * (sweep + side) * bend
            flow[THETA, b, n] = pitch[0, b] + nodes[TWIST, b, n] - turned
            flow[RADIUS, b, n] = norm(r - dot(r, shaft) * shaft)


@kernel
def turned_centre(nodes: Float, theta: Vec, b: int, n: int) -> Vec:
    """Aerodynamic centre from the node's reference point, turned with the section."""
    offset = vec3(nodes, CENTRE, b, n)
    return offset + cross(theta, offset)


@kernel
def disk_averages(aero: Float, nodes: Float, machine: Float, flow: Float, rotor: Float) -> None:
    """Mean wind, skew, tip-speed ratio (A-16 to A-18)."""
    mean, tip = Vec(0.0, 0.0, 0.0), zero(rotor)
    for b in range(flow.shape[1]):
        for n in range(flow.shape[2]):
            mean += total(nodes[AREA, b, n] * vec3(flow, WIND, b, n))
            tip = max(tip, aero[TIP_FACTOR] * largest(flow[RADIUS, b, n]))
    mean -= vec1(machine, ex.HUB_VELOCITY)
    shaft = vec1(machine, ex.SHAFT)
    axial, speed = dot(mean, shaft), norm(mean)
    aside = mean - axial * shaft
    lateral = norm(aside)
    put1(rotor, R_WIND, mean)
    rotor[AXIAL_WIND] = axial
    rotor[TIP_RADIUS] = tip
    rotor[SKEW] = where(speed > STILL, acos(min(max(axial / max(speed, STILL), -1.0), 1.0)), 0.0)
    put1(rotor, SKEW_AXIS, where(lateral > 1e-9, 1.0 / max(lateral, 1e-9), 0.0) * aside)
    rotor[TIP_RATIO] = quotient(machine[ex.ROTOR_SPEED] * tip, axial)
    # against the whole wind: a rotor that idles across the wind has no wake either
    rotor[FADE] = ramp(quotient(abs(machine[ex.ROTOR_SPEED]) * tip, speed), aero[FADE_BEGIN], aero[FADE_END])


@kernel
def quotient(x: float, speed: float) -> float:
    """x / speed [m/s], zero in still air."""
    moves = abs(speed) > STILL
    return where(moves, x / where(moves, speed, 1.0), 0.0)


@kernel
def flapped(
    flap_nodes: Float, increments: Float, flap: Float, section: Float, g: int, alpha: float, b: int, n: int
) -> tuple[Increment, float]:
    """What the flaps add at a node, at any angle of attack, and the angle [rad] that stands for their lift."""
    if flap_nodes.shape[0] == 0:
        return Increment(0.0 * alpha, 0.0 * alpha, 0.0 * alpha), 0.0 * alpha
    added = flap_increment(flap_nodes, increments, flap, wrap(alpha), b, n)
    return added, equivalent_angle(added.lift, section[g, STALL_SLOPE])


@kernel
def quasi_steady(
    aero: Float,
    options: Int,
    nodes: Float,
    polars: Float,
    section: Float,
    flap_nodes: Float,
    increments: Float,
    flap: Float,
    flow: Float,
    memory: Float,
    rotor: Float,
) -> None:
    """Pass 2: momentum balance at every node, mean induction, time of the inflow."""
    mean, worst = zero(rotor), zero(rotor)
    curved = 0.5 if options[STALL_MODEL] != STATIC and options[STALL_ROTATION] == CAMBER else 0.0
    for b in range(flow.shape[1]):
        for n in range(flow.shape[2]):
            a, ap, residual = zero(flow), zero(flow), zero(flow)
            if options[WAKE] == 1:
                vx, vy = flow[VX, b, n], flow[VY, b, n]
                # the lift that is balanced is that in curved flow, at the angle of three quarters of the chord
                camber = curved * flow[TURN, b, n] * nodes[CHORD, b, n] / max(sqrt(vx * vx + vy * vy), SLOW)
                g = whole(nodes[POLAR_INDEX, b, n])
                # so is that of flaps, at the angle of attack where the solver begins
                last = memory[OLD_PHI, b, n] - flow[THETA, b, n]
                _, bent = flapped(flap_nodes, increments, flap, section, g, last, b, n)
                strip = Strip(
                    vx,
                    vy,
                    flow[THETA, b, n] - min(max(camber, -MOST_CAMBER), MOST_CAMBER) - bent,
                    nodes[SOLID_LENGTH, b, n] / flow[RADIUS, b, n],
                    nodes[TIP_NUMBER, b, n],
                    nodes[HUB_NUMBER, b, n],
                    g,
                )
                solution = induction(
                    strip,
                    polars,
                    aero[AXIAL_DRAG],
                    aero[TANGENTIAL_DRAG],
                    options[HIGH_INDUCTION],
                    options[ITERATIONS],
                    memory[OLD_PHI, b, n],
                    memory[OLD_SLOPE, b, n],
                )
                memory[OLD_PHI, b, n] = solution.phi
                memory[OLD_SLOPE, b, n] = solution.slope
                # where the loss factor vanishes the wake is fully blocked
                blocked = nodes[END, b, n] > 0.0
                a = where(blocked, 1.0, solution.a)
                ap = where(blocked, 0.0, solution.ap)
                residual = where(blocked, 0.0, solution.residual)
            flow[STEADY_AXIAL, b, n] = a
            flow[STEADY_TANGENTIAL, b, n] = ap
            flow[RESIDUAL, b, n] = residual
            mean += total(nodes[RING, b, n] * a)
            worst = max(worst, largest(abs(residual)))
    rotor[INDUCTION] = mean
    rotor[R_RESIDUAL] = worst
    variable = options[INFLOW_MODEL] == VARIABLE_TIME
    rotor[TIME] = first_time(mean, rotor[TIP_RADIUS], rotor[AXIAL_WIND]) if variable else aero[INFLOW_TIME]


@kernel
def loads(
    dt: float,
    aero: Float,
    options: Int,
    nodes: Float,
    polars: Float,
    section: Float,
    flap_nodes: Float,
    increments: Float,
    flap: Float,
    machine: Float,
    frame: Float,
    motion: Float,
    flow: Float,
    rotor: Float,
    memory: Float,
    inflow: Float,
    stall: Float,
    load: Float,
) -> None:
    """Pass 3: states of inflow and stall over the step, coefficients and loads (A-19 to A-42, A-47)."""
    shaft, aside = vec1(machine, ex.SHAFT), vec1(rotor, SKEW_AXIS)
    force, moment = Vec(0.0, 0.0, 0.0), Vec(0.0, 0.0, 0.0)
    for b in range(flow.shape[1]):
        R = rot2(frame, ex.ROOT_ORIENTATION, b)
        cp, sp = frame[ex.COS_PITCH, b], frame[ex.SIN_PITCH, b]
        radial = Vec(R.xz, R.yz, R.zz)
        in_plane = radial - dot(radial, shaft) * shaft
        sin_skew = dot(in_plane, aside) / norm(in_plane)
        F_b, M_b = Vec(0.0, 0.0, 0.0), Vec(0.0, 0.0, 0.0)
        for n in range(flow.shape[2]):
            induced_velocity(dt, aero, options, nodes, flow, rotor, memory, inflow, sin_skew, b, n)
            section_coefficients(
                dt, aero, options, nodes, polars, section, flap_nodes, increments, flap, flow, memory, stall, b, n
            )
            # loads per length in strip axes, then in blade axes on the node
            cb, sb = flow[COS_BEND, b, n], flow[SIN_BEND, b, n]
            pressure = 0.5 * aero[AIR_DENSITY] * flow[SPEED, b, n] * flow[SPEED, b, n] * nodes[CHORD, b, n]
            s, c = sin(flow[PHI, b, n]), cos(flow[PHI, b, n])
            normal = pressure * (flow[LIFT, b, n] * c + flow[DRAG, b, n] * s)
            driving = pressure * (flow[LIFT, b, n] * s - flow[DRAG, b, n] * c)
            pitching = pressure * nodes[CHORD, b, n] * flow[MOMENT, b, n]
            flow[NORMAL_FORCE, b, n] = normal
            flow[DRIVING_FORCE, b, n] = driving
            flow[PITCHING_MOMENT, b, n] = pitching
            length = nodes[LENGTH, b, n]
            F = length * Vec(cp * cb * normal + sp * driving, sp * cb * normal - cp * driving, -sb * normal)
            M = length * pitching * Vec(cp * sb, sp * sb, cb)
            offset = turned_centre(nodes, vec3(motion, ex.ROTATION, b, n), b, n)
            M += cross(offset, F)
            put3(load, ex.FORCE, b, n, F)
            put3(load, ex.MOMENT, b, n, M)
            F_b += F
            M_b += M + cross(vec3(motion, ex.POSITION, b, n), F)
        force += R @ total(F_b)
        moment += R @ total(M_b)
    put1(rotor, R_FORCE, force)
    put1(rotor, R_MOMENT, moment)
    rotor[THRUST] = dot(force, shaft)
    rotor[TORQUE] = dot(moment, shaft)


@kernel
def either(condition: bool, yes: Inflow, no: Inflow) -> Inflow:
    """One of two states."""
    return Inflow(where(condition, yes.reduced, no.reduced), where(condition, yes.velocity, no.velocity))


@kernel
def inflow_state(inflow: Float, b: int, n: int) -> tuple[Inflow, Inflow]:
    """States of the induced velocity at a node, normal and tangential."""
    normal = Inflow(inflow[I_REDUCED_X, b, n], inflow[I_X, b, n])
    return normal, Inflow(inflow[I_REDUCED_Y, b, n], inflow[I_Y, b, n])


@kernel
def put_inflow(inflow: Float, normal: Inflow, tangential: Inflow, b: int, n: int) -> None:
    """Write them, or their derivatives."""
    inflow[I_REDUCED_X, b, n], inflow[I_X, b, n] = normal.reduced, normal.velocity
    inflow[I_REDUCED_Y, b, n], inflow[I_Y, b, n] = tangential.reduced, tangential.velocity


@kernel
def stall_state(stall: Float, b: int, n: int) -> Stall:
    """State of the dynamic stall at a node."""
    return Stall(stall[S_WAKE_1, b, n], stall[S_WAKE_2, b, n], stall[S_PRESSURE, b, n], stall[S_ATTACHMENT, b, n])


@kernel
def put_stall(stall: Float, y: Stall, b: int, n: int) -> None:
    """Write it, or its derivative."""
    stall[S_WAKE_1, b, n], stall[S_WAKE_2, b, n] = y.wake_1, y.wake_2
    stall[S_PRESSURE, b, n], stall[S_ATTACHMENT, b, n] = y.pressure, y.attachment


@kernel
def induced_velocity(
    dt: float,
    aero: Float,
    options: Int,
    nodes: Float,
    flow: Float,
    rotor: Float,
    memory: Float,
    inflow: Float,
    sin_skew: float,
    b: int,
    n: int,
) -> None:
    """Dynamic inflow and skewed wake at one node: induction factors, inflow angle and speed (A-19 to A-28)."""
    vx, vy = flow[VX, b, n], flow[VY, b, n]
    blocked = nodes[END, b, n] > 0.0
    new_x, new_y = flow[STEADY_AXIAL, b, n] * vx, flow[STEADY_TANGENTIAL, b, n] * vy
    # the time constant changes over the step: its mean keeps the second order
    k, tau_1 = aero[INFLOW_LEAD], 0.5 * (memory[OLD_TIME, b, n] + rotor[TIME])
    tau_2 = second_time(tau_1, flow[RADIUS, b, n] / rotor[TIP_RADIUS])
    old_x, old_y = memory[OLD_X, b, n], memory[OLD_Y, b, n]
    x, y = inflow_state(inflow, b, n)
    x = inflow_advance(x, k, tau_1, tau_2, old_x, new_x, dt)
    y = inflow_advance(y, k, tau_1, tau_2, old_y, new_y, dt)
    at_once = blocked | (options[INFLOW_MODEL] == QUASI_STEADY)
    x, y = either(at_once, inflow_steady(k, new_x), x), either(at_once, inflow_steady(k, new_y), y)
    put_inflow(inflow, x, y, b, n)
    memory[OLD_X, b, n] = new_x
    memory[OLD_Y, b, n] = new_y
    memory[OLD_TIME, b, n] = rotor[TIME]
    # skewed wake: more induction on the downwind side (Glauert; Pitt & Peters)
    wx = rotor[FADE] * x.velocity
    if options[SKEW_MODEL] == 1:
        chi = (0.6 * quotient(x.velocity, vx) + 1.0) * rotor[SKEW]
        lean = where(abs(chi) < 0.5 * pi, tan(0.5 * chi), 1.0)
        r_R = flow[RADIUS, b, n] / rotor[TIP_RADIUS]
        wx *= where(blocked, 1.0, 1.0 + aero[SKEW_FACTOR] * lean * r_R * sin_skew)
    wy = rotor[FADE] * y.velocity
    un, ut = vx - wx, vy + wy
    flow[AXIAL, b, n] = quotient(wx, vx)
    flow[TANGENTIAL, b, n] = quotient(wy, vy)
    flow[PHI, b, n] = atan2(un, ut)
    flow[SPEED, b, n] = sqrt(un * un + ut * ut)
    flow[ALPHA, b, n] = wrap(flow[PHI, b, n] - flow[THETA, b, n])


@kernel
def turned_flow(options: Int, nodes: Float, flow: Float, b: int, n: int) -> tuple[float, float, Rotation]:
    """Angle of attack [rad] at 3/4 chord, U / (c/2) [1/s], and the section's rotation (A-31, A-32)."""
    variant, speed, chord = options[STALL_ROTATION], flow[SPEED, b, n], nodes[CHORD, b, n]
    rate = 2.0 * max(speed, STILL) / chord
    turn = where(variant != NO_ROTATION, flow[TURN, b, n], 0.0)
    alpha = angle_at_three_quarters(flow[ALPHA, b, n], speed, turn, chord)
    return alpha, rate, section_rotation(variant, turn, flow[PITCHING, b, n], rate)


@kernel
def section_coefficients(
    dt: float,
    aero: Float,
    options: Int,
    nodes: Float,
    polars: Float,
    section: Float,
    flap_nodes: Float,
    increments: Float,
    flap: Float,
    flow: Float,
    memory: Float,
    stall: Float,
    b: int,
    n: int,
) -> None:
    """Static or dynamic coefficients at one node."""
    g = whole(nodes[POLAR_INDEX, b, n])
    alpha, speed = flow[ALPHA, b, n], flow[SPEED, b, n]
    c = static_coefficients(polars, g, alpha)
    lift, drag, moment = c.lift, c.drag, c.moment
    added, bent = flapped(flap_nodes, increments, flap, section, g, alpha, b, n)
    if options[STALL_MODEL] != STATIC:
        alpha_34, rate, rotation = turned_flow(options, nodes, flow, b, n)
        weight = model_weight(section, g, alpha, speed)
        memory[SWITCHES, b, n] += section[g, DYNAMIC] * (crossed(abs(alpha) - FADE_TO) + crossed(speed - SLOW_FROM))
        old = StallInput(
            memory[OLD_ALPHA, b, n], memory[OLD_RATE, b, n], memory[OLD_PRESSURE, b, n], memory[OLD_ATTACHMENT, b, n]
        )
        y, new = stall_advance(
            aero, polars, section, g, stall_state(stall, b, n), old, alpha_34, rate, rotation.pitching, weight, dt, bent
        )
        put_stall(stall, y, b, n)
        memory[OLD_ALPHA, b, n] = new.alpha
        memory[OLD_RATE, b, n] = new.rate
        memory[OLD_PRESSURE, b, n] = new.pressure
        memory[OLD_ATTACHMENT, b, n] = new.attachment
        d = stall_coefficients(aero, polars, section, g, y, alpha_34, rotation, bent)
        lift += weight * (d.lift - lift)
        drag += weight * (d.drag - drag)
        moment += weight * (d.moment - moment)
    flow[LIFT, b, n] = lift + added.lift
    flow[DRAG, b, n] = drag + added.drag
    flow[MOMENT, b, n] = moment + added.moment


@kernel
def settle(
    aero: Float,
    options: Int,
    nodes: Float,
    polars: Float,
    section: Float,
    flap_nodes: Float,
    increments: Float,
    flap: Float,
    flow: Float,
    rotor: Float,
    inflow: Float,
    stall: Float,
) -> None:
    """Set the states of inflow and stall to their steady values for the flow of the last evaluation.

    Call it, evaluate, and call it again: the second time the induction it saw was its own.
    """
    k = aero[INFLOW_LEAD]
    for b in range(flow.shape[1]):
        for n in range(flow.shape[2]):
            x = inflow_steady(k, flow[STEADY_AXIAL, b, n] * flow[VX, b, n])
            y = inflow_steady(k, flow[STEADY_TANGENTIAL, b, n] * flow[VY, b, n])
            put_inflow(inflow, x, y, b, n)
            g = whole(nodes[POLAR_INDEX, b, n])
            alpha, _, rotation = turned_flow(options, nodes, flow, b, n)
            _, bent = flapped(flap_nodes, increments, flap, section, g, flow[ALPHA, b, n], b, n)
            put_stall(stall, stall_steady(aero, polars, section, g, alpha, rotation.pitching, bent), b, n)


@kernel
def derivatives(
    aero: Float,
    options: Int,
    nodes: Float,
    polars: Float,
    section: Float,
    flap_nodes: Float,
    increments: Float,
    flap: Float,
    flow: Float,
    rotor: Float,
    inflow: Float,
    stall: Float,
    d_inflow: Float,
    d_stall: Float,
) -> None:
    """Time derivatives of the states of inflow and stall, after an evaluation with dt = 0."""
    k, tau_1 = aero[INFLOW_LEAD], rotor[TIME]
    for b in range(flow.shape[1]):
        for n in range(flow.shape[2]):
            tau_2 = second_time(tau_1, flow[RADIUS, b, n] / rotor[TIP_RADIUS])
            V_x, V_y = flow[STEADY_AXIAL, b, n] * flow[VX, b, n], flow[STEADY_TANGENTIAL, b, n] * flow[VY, b, n]
            x, y = inflow_state(inflow, b, n)
            x_rate = inflow_derivative(x, k, tau_1, tau_2, V_x)
            y_rate = inflow_derivative(y, k, tau_1, tau_2, V_y)
            still = Inflow(zero(flow), zero(flow))
            at_once = (nodes[END, b, n] > 0.0) | (options[INFLOW_MODEL] == QUASI_STEADY)
            put_inflow(d_inflow, either(at_once, still, x_rate), either(at_once, still, y_rate), b, n)
            g = whole(nodes[POLAR_INDEX, b, n])
            alpha, rate, rotation = turned_flow(options, nodes, flow, b, n)
            s = stall_state(stall, b, n)
            _, bent = flapped(flap_nodes, increments, flap, section, g, flow[ALPHA, b, n], b, n)
            s_rate = stall_derivative(aero, polars, section, g, s, alpha, rate, rotation.pitching, bent)
            # where the model is off its state is not integrated but set
            weight = model_weight(section, g, flow[ALPHA, b, n], flow[SPEED, b, n])
            on = (weight > 0.0) & (options[STALL_MODEL] != STATIC)
            put_stall(
                d_stall,
                Stall(
                    where(on, s_rate.wake_1, 0.0),
                    where(on, s_rate.wake_2, 0.0),
                    where(on, s_rate.pressure, 0.0),
                    where(on, s_rate.attachment, 0.0),
                ),
                b,
                n,
            )
