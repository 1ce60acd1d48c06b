"""Aerodynamic loads of the rotor from the motion of the blade nodes.

Three passes over the nodes, because the rotor's averages stand between them:

1. ``relative_wind``: wind at the nodes (tower influence included) minus their velocity, in strip axes;
   then ``disk_averages``: mean wind, skew, tip-speed ratio;
2. ``induce``: the momentum balance at each node; then the mean induction and the time constant of the inflow;
3. ``loads``: dynamic inflow, skewed wake, dynamic stall, coefficients, loads.

Pass 3 advances the states of inflow and stall by the step that ends here (``dt``); with dt = 0 it
evaluates the loads for the present states.

Models of inflow, stall and tower influence are called by their number: see ``variants``. Induction models that need the
loads of all nodes are parts: their records have variants of ``induce`` and ``induced_velocity`` (``lifting_line``).

Reference: docs/theory/aerodynamics.md (A-1 to A-47).
"""

from __future__ import annotations

from math import acos, atan2, pi, sqrt, tan

from meltemi.aero import inflow, stall, tower_flow
from meltemi.aero.air import Air
from meltemi.aero.bem import LEAST_SKEW, MADSEN, MOST_SKEW, STILL, Strip, induction
from meltemi.aero.flaps import equivalent_angle, flap_increment
from meltemi.aero.polars import SectionCoefficients, ramp, wrap
from meltemi.aero.stall.section import CAMBER
from meltemi.compiler import anywhere, by_record, kernel, largest, total, where, whole
from meltemi.maths.vectors import Rot, Vec, cross, dot, norm
from meltemi.wind.velocity import wind_velocity

SLOW, MOST_CAMBER = 1.0, 0.1
"""[m/s], [rad] limits of the curved flow's angle in the momentum balance, for rotors at rest."""


@kernel
def relative_wind(t: float, m: Air) -> None:
    """Pass 1: wind at the nodes and relative wind in strip axes (A-1 to A-4)."""
    aero, nodes, frame, pitch, motion, flow = m.aero, m.aero_nodes, m.frame, m.pitch, m.motion, m.flow
    hub = m.machine.hub_position
    for b in range(flow.blades):
        R = frame.orientation[b]
        shaft, root_spin = frame.shaft[b], frame.spin[b]
        cp, sp = frame.cos_pitch[b], frame.sin_pitch[b]
        unpitched = Rot(cp, sp, 0.0, -sp, cp, 0.0, 0.0, 0.0, 1.0)
        for n in range(flow.nodes):
            elastic, spin = motion.orientation[b, n], motion.spin[b, n]
            offset = elastic @ nodes.centre[b, n]
            r = motion.position[b, n] + offset
            p = hub + R @ r
            u = wind_velocity(p, t, m) + tower_flow.influence(m.aero_options.tower, p, m, b)
            flow.wind[b, n] = u
            w = R.T @ u - (motion.velocity[b, n] + cross(spin, offset))
            # strip axes: those of the unpitched blade, turned about y into the span of the section
            section = unpitched @ (elastic @ nodes.section[b, n])
            slope = 1.0 / sqrt(section.xz * section.xz + section.zz * section.zz)
            cb, sb = slope * section.zz, slope * section.xz
            flow.vx[b, n] = cb * (cp * w.x + sp * w.y) - sb * w.z
            flow.vy[b, n] = cp * w.y - sp * w.x
            flow.cos_bend[b, n] = cb
            flow.sin_bend[b, n] = sb
            relative_spin = spin - root_spin
            flow.rotation[b, n] = sb * (cp * spin.x + sp * spin.y) + cb * spin.z
            flow.pitching[b, n] = sb * (cp * relative_spin.x + sp * relative_spin.y) + cb * (
                relative_spin.z - pitch.rate[b]
            )
            flow.theta[b, n] = chord_angle(cb, sb, section, aero.chord_angle)
            flow.radius[b, n] = norm(r - dot(r, shaft) * shaft)


@kernel
def chord_angle(cb: float, sb: float, section: Rot, variant: float) -> float:
    """Angle [rad] of the chord from the strip plane, towards feather (A-3).

    Args:
      cb, sb: cosine and sine of the strip's slope out of plane.
      section: orientation of the section in unpitched blade axes.
      variant: 0: that of chord and normal in the strip's plane, 1: the last of the rotations sweep, flap, twist.
    """
    normal_x, chord_x = cb * section.xx - sb * section.zx, cb * section.xy - sb * section.zy
    if anywhere(variant > 0.0):
        return atan2(section.xy, section.xx)
    return atan2(chord_x - section.yx, normal_x + section.yy)


@kernel
def disk_averages(m: Air) -> None:
    """Mean wind, skew, tip-speed ratio (A-16 to A-18)."""
    aero, machine, flow, rotor = m.aero, m.machine, m.flow, m.rotor
    mean, tip = Vec(0.0, 0.0, 0.0), 0.0
    for b in range(flow.blades):
        for n in range(flow.nodes):
            mean += total(m.aero_nodes.area[b, n] * flow.wind[b, n])
            tip = max(tip, aero.tip_factor * largest(flow.radius[b, n]))
    mean -= machine.hub_velocity
    axial, speed = dot(mean, machine.shaft), norm(mean)
    aside = mean - axial * machine.shaft
    lateral = norm(aside)
    rotor.wind = mean
    rotor.axial_wind = axial
    rotor.tip_radius = tip
    rotor.skew = where(speed > STILL, acos(min(max(axial / max(speed, STILL), -1.0), 1.0)), 0.0)
    rotor.skew_axis = where(lateral > 1e-9, 1.0 / max(lateral, 1e-9), 0.0) * aside
    rotor.tip_ratio = quotient(machine.rotor_speed * tip, axial)
    # against the whole wind: a rotor that idles across the wind has no wake either
    rotor.fade = ramp(quotient(abs(machine.rotor_speed) * tip, speed), aero.fade_begin, aero.fade_end)


@kernel
def quotient(x: float, speed: float) -> float:
    """Quotient x / speed [m/s], zero in still air."""
    moves = abs(speed) > STILL
    return where(moves, x / where(moves, speed, 1.0), 0.0)


@kernel
def flapped(alpha: float, m: Air, b: int, n: int) -> tuple[SectionCoefficients, float]:
    """Increments of the flaps at a node, at any angle of attack, and their equivalent angle [rad]."""
    added, angle = SectionCoefficients(0.0, 0.0, 0.0), 0.0
    if m.flap_nodes.shape[0] > 0:
        added = flap_increment(wrap(alpha), m.flap_nodes, m, b, n)
        angle = equivalent_angle(added.lift, m.section.slope[whole(m.aero_nodes.polar[b, n])])
    return added, angle


@kernel
def camber(rotation: float, chord: float, speed: float, m: Air) -> float:
    """Angle [rad] by which curved flow lowers the balanced lift: that of three quarters of the chord."""
    options = m.aero_options
    curved = 0.5 if options.stall != stall.STATIC and options.stall_rotation == CAMBER else 0.0
    return min(max(curved * rotation * chord / max(speed, SLOW), -MOST_CAMBER), MOST_CAMBER)


@by_record
def induce(t: float, m: Air) -> None:
    """Pass 2: what the induced velocities follow from, for all nodes of the rotor."""


@by_record
def induced_velocity(dt: float, m: Air, sin_skew: float, b: int, n: int) -> tuple[float, float]:
    """Induced velocity [m/s] at one node: normal to the strip, upwind, and along it, towards the trailing edge."""
    raise NotImplementedError


@induce.variant
@kernel
def quasi_steady(t: float, m: Air) -> None:
    """Pass 2: momentum balance at every node, mean induction, time constant of the inflow."""
    options, nodes, flow, memory, rotor = m.aero_options, m.aero_nodes, m.flow, m.memory, m.rotor
    mean, worst = 0.0, 0.0
    skew = min(max(abs(tan(rotor.skew)), LEAST_SKEW), MOST_SKEW)
    for b in range(flow.blades):
        cp, sp, shaft = m.frame.cos_pitch[b], m.frame.sin_pitch[b], m.frame.shaft[b]
        for n in range(flow.nodes):
            a, ap, residual = 0.0, 0.0, 0.0
            if options.wake == 1:
                vx, vy, theta = flow.vx[b, n], flow.vy[b, n], flow.theta[b, n]
                # the lift that is balanced is that in curved flow, at the angle of three quarters of the chord
                angle = camber(flow.rotation[b, n], nodes.chord[b, n], sqrt(vx * vx + vy * vy), m)
                g = whole(nodes.polar[b, n])
                # so is that of flaps, at the angle of attack where the solver begins
                guess = memory.phi[b, n] + memory.change[b, n]
                _, bent = flapped(guess - theta, m, b, n)
                lean = 1.0
                if options.high_induction == MADSEN:
                    lean = flow.cos_bend[b, n] * (cp * shaft.x + sp * shaft.y) - flow.sin_bend[b, n] * shaft.z
                strip = Strip(
                    vx,
                    vy,
                    theta - angle - bent,
                    nodes.solid_length[b, n] / flow.radius[b, n],
                    nodes.tip_number[b, n],
                    nodes.hub_number[b, n],
                    g,
                    skew,
                    lean,
                )
                solution = induction(guess, memory.slope[b, n], strip, m)
                memory.change[b, n] = solution.phi - memory.phi[b, n]
                memory.phi[b, n] = solution.phi
                memory.slope[b, n] = solution.slope
                # where the loss factor vanishes the wake is fully blocked
                blocked = nodes.end[b, n] > 0.0
                a = where(blocked, 1.0, solution.a)
                ap = where(blocked, 0.0, solution.ap)
                residual = where(blocked, 0.0, solution.residual)
            flow.steady_axial[b, n] = a
            flow.steady_tangential[b, n] = ap
            flow.residual[b, n] = residual
            mean += total(nodes.ring[b, n] * a)
            worst = max(worst, largest(abs(residual)))
    rotor.induction = mean
    rotor.residual = worst
    rotor.inflow_time = inflow.time_constant(options.inflow, m)


@kernel
def loads(dt: float, m: Air) -> None:
    """Pass 3: states of inflow and stall over the step, coefficients and loads (A-19 to A-42, A-47)."""
    nodes, frame, motion, flow, rotor = m.aero_nodes, m.frame, m.motion, m.flow, m.rotor
    shaft = m.machine.shaft
    force, moment = Vec(0.0, 0.0, 0.0), Vec(0.0, 0.0, 0.0)
    for b in range(flow.blades):
        R = frame.orientation[b]
        cp, sp = frame.cos_pitch[b], frame.sin_pitch[b]
        radial = Vec(R.xz, R.yz, R.zz)
        in_plane = radial - dot(radial, shaft) * shaft
        sin_skew = dot(in_plane, rotor.skew_axis) / norm(in_plane)
        F_b, M_b = Vec(0.0, 0.0, 0.0), Vec(0.0, 0.0, 0.0)
        for n in range(flow.nodes):
            un, ut = induced_flow(dt, m, sin_skew, b, n)
            section_coefficients(dt, m, b, n)
            # loads per length in strip axes, then in blade axes on the node
            cb, sb = flow.cos_bend[b, n], flow.sin_bend[b, n]
            chord, speed = nodes.chord[b, n], flow.speed[b, n]
            # pressure times chord, by the speed: its products with the velocity have the sine and cosine of phi
            flux = 0.5 * m.aero.air_density * speed * chord
            lift, drag = flow.lift[b, n], flow.drag[b, n]
            normal = flux * (lift * ut + drag * un)
            driving = flux * (lift * un - drag * ut)
            pitching = flux * speed * chord * flow.moment[b, n]
            flow.normal_force[b, n] = normal
            flow.driving_force[b, n] = driving
            flow.pitching_moment[b, n] = pitching
            length = nodes.length[b, n]
            F = length * Vec(cp * cb * normal + sp * driving, sp * cb * normal - cp * driving, -sb * normal)
            M = length * pitching * Vec(cp * sb, sp * sb, cb)
            M += cross(motion.orientation[b, n] @ nodes.centre[b, n], F)
            m.load.force[b, n] = F
            m.load.moment[b, n] = M
            F_b += F
            M_b += M + cross(motion.position[b, n], F)
        force += R @ total(F_b)
        moment += R @ total(M_b)
    rotor.force = force
    rotor.moment = moment
    rotor.thrust = dot(force, shaft)
    rotor.torque = dot(moment, shaft)


@induced_velocity.variant
@kernel
def momentum_velocity(dt: float, m: Air, sin_skew: float, b: int, n: int) -> tuple[float, float]:
    """Dynamic inflow and skewed wake (A-19 to A-28)."""
    flow, rotor, options = m.flow, m.rotor, m.aero_options
    vx = flow.vx[b, n]
    inflow.advance(options.inflow, dt, m, b, n)
    V_x, V_y = m.inflow.x[b, n], m.inflow.y[b, n]
    # skewed wake: more induction on the downwind side (Glauert; Pitt & Peters)
    wx = rotor.fade * V_x
    if options.skew == 1:
        chi = (0.6 * quotient(V_x, vx) + 1.0) * rotor.skew
        lean = where(abs(chi) < 0.5 * pi, tan(0.5 * chi), 1.0)
        r_R = flow.radius[b, n] / rotor.tip_radius
        wx *= where(m.aero_nodes.end[b, n] > 0.0, 1.0, 1.0 + m.aero.skew_factor * lean * r_R * sin_skew)
    return wx, rotor.fade * V_y


@kernel
def induced_flow(dt: float, m: Air, sin_skew: float, b: int, n: int) -> tuple[float, float]:
    """Relative wind [m/s] with induction at one node, normal to the strip and along it, and what follows from it."""
    flow = m.flow
    vx, vy = flow.vx[b, n], flow.vy[b, n]
    wx, wy = induced_velocity(dt, m, sin_skew, b, n)
    un, ut = vx - wx, vy + wy
    phi = atan2(un, ut)
    flow.axial[b, n] = quotient(wx, vx)
    flow.tangential[b, n] = quotient(wy, vy)
    flow.phi[b, n] = phi
    flow.speed[b, n] = sqrt(un * un + ut * ut)
    flow.alpha[b, n] = wrap(phi - flow.theta[b, n])
    return un, ut


@kernel
def section_coefficients(dt: float, m: Air, b: int, n: int) -> None:
    """Coefficients at one node: of the stall model, and the increments of the flaps."""
    flow = m.flow
    added, angle = flapped(flow.alpha[b, n], m, b, n)
    c = stall.advance(m.aero_options.stall, dt, angle, m, b, n) + added
    flow.lift[b, n] = c.lift
    flow.drag[b, n] = c.drag
    flow.moment[b, n] = c.moment


@kernel
def settle(m: Air) -> None:
    """Set the states of inflow and stall to their steady values for the flow of the last evaluation.

    Alternate with evaluations: the induction changes with the states.
    """
    flow, options = m.flow, m.aero_options
    for b in range(flow.blades):
        for n in range(flow.nodes):
            inflow.settle(options.inflow, m, b, n)
            _, angle = flapped(flow.alpha[b, n], m, b, n)
            stall.settle(options.stall, angle, m, b, n)


@kernel
def derivatives(m: Air) -> None:
    """Time derivatives of the states of inflow and stall, after an evaluation with dt = 0."""
    flow, options = m.flow, m.aero_options
    for b in range(flow.blades):
        for n in range(flow.nodes):
            inflow.derivative(options.inflow, m, b, n)
            _, angle = flapped(flow.alpha[b, n], m, b, n)
            stall.derivative(options.stall, angle, m, b, n)
