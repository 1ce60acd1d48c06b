"""Law of the power control (C-80 to C-88).

Each call: filtered speed, density, wind estimate; the set-point of the power from reference, limit and frequency; the
speeds that bound the states; the machine; pitch; torque. All quantities except those of the estimator refer to the
high-speed shaft. Below the lower speed the torque is the optimal one, or that of A3 after a fixed pitch, so a
set-point above the available power does not stall the rotor: power decreases instead.

Reference: docs/theory/control.md (C-80 to C-88); Palanimuthu et al. (2022), section 5.
"""

from __future__ import annotations

from math import exp, log, pi, sqrt

from meltemi.compiler import crossed, kernel, whole
from meltemi.control.signals import Demands, Measurements
from meltemi.control_laws.integrator import integrator
from meltemi.control_laws.machine import TO, transition
from meltemi.environment.density import moist_air_density
from meltemi.power_control import tables as t
from meltemi.power_control.rotor import gain_at_pitch, power_coefficient, sensitivity
from meltemi.power_control.state import PowerControlState

SPARED = 0.9
"""Share of the power at fine pitch that A3 may take below the lower speed after a held pitch; the rest brings the speed
back."""
LEAST_SHARE, LEAST_VOLTAGE = 0.05, 0.9
"""Shares of rated power and of the nominal grid voltage above which the efficiency is estimated."""
FINE = 1e-6
"""[rad] within which the pitch is at its smallest."""
ABOVE_LOWER, ABOVE_UPPER, BELOW_RECOVERY, AT_FINE, HOLDING = range(len(t.CONDITIONS))
assert t.CONDITIONS == ("above_lower", "above_upper", "below_recovery", "fine", "holds")
PITCH_FINE, PITCH_HELD, PITCH_UPPER, PITCH_RECOVERY = range(len(t.PITCHES))


@kernel
def third_root(a: float) -> float:
    """Cubic root of a positive number."""
    return exp(log(a) / 3.0)


@kernel
def air_density(x: PowerControlState, measured: Measurements) -> float:
    """Air density [kg/m^3] of the law (C-81); after a sensor failure the last one."""
    kind = whole(x.air)
    if kind == 0:
        return x.density
    density = 0.0
    if kind == 1:
        density = moist_air_density(measured.air_temperature, 0.0, x.assumed_pressure)
    else:
        density = moist_air_density(measured.air_temperature, measured.humidity, measured.air_pressure)
    return density if 0.2 < density < 3.0 else x.density


@kernel
def optimal_gain(x: PowerControlState) -> float:
    """Optimal torque gain K [N m s^2/rad^2] on the generator side (C-80)."""
    area = 0.5 * pi * x.density * x.radius * x.radius
    tip = x.radius / (x.best_ratio * x.gear_ratio)
    return area * x.best_coefficient * x.gear_efficiency * tip * tip * tip


@kernel
def transition_speed(x: PowerControlState, gain: float) -> float:
    """Speed [rad/s] at which the line below rated speed begins, with an optimal gain."""
    rated, slope = x.rated_speed, x.transition_slope
    if gain * rated * rated * rated >= x.rated_power:
        return rated
    return (slope - sqrt(max(slope * (slope - 4.0 * gain * x.synchronous_speed), 0.0))) / (2.0 * gain)


@kernel
def optimal_torque(x: PowerControlState, gain: float, speed: float) -> float:
    """Torque [N m] that follows the best tip-speed ratio, up to rated speed (C-80)."""
    first, best = x.cut_in_speed, x.optimal_speed
    if speed <= first:
        return 0.0
    if speed < best:
        return (speed - first) / (best - first) * gain * best * best
    torque = gain * speed * speed
    if speed > transition_speed(x, gain):
        torque = max(torque, x.transition_slope * (speed - x.synchronous_speed))
    return torque


@kernel
def lower_speed(x: PowerControlState, gain: float, power: float) -> float:
    """Speed [rad/s] from which the optimal torque gives a power [W] (C-82), within the torque's limit."""
    low = x.optimal_speed
    if power <= gain * low * low * low:
        return low
    speed = third_root(power / gain)
    if speed > transition_speed(x, gain):
        none, slope = x.synchronous_speed, x.transition_slope
        speed = min(0.5 * (none + sqrt(none * none + 4.0 * power / slope)), x.rated_speed)
    return max(speed, low)


@kernel
def estimate_wind(x: PowerControlState, measured: Measurements, dt: float) -> None:
    """One step of the wind estimate by immersion and invariance (C-85).

    Speed, torque and pitch have the same low-pass filter, which keeps the torque balance and removes the torsion of
    the shaft.
    """
    ratio, radius, inertia = x.gear_ratio, x.radius, x.inertia
    speed, angle = x.speed / ratio, 0.0
    blades, keep = whole(measured.n_blades), exp(-dt * x.filter_frequency)
    for b in range(blades):
        angle = angle + measured.pitch[b] / blades
    x.filtered_torque = (1.0 - keep) * measured.torque + keep * x.filtered_torque
    x.filtered_pitch = (1.0 - keep) * angle + keep * x.filtered_pitch
    w, wind = max(speed, 1e-3), x.wind
    disk = 0.5 * x.density * pi * radius * radius
    driving = disk * power_coefficient(x, w * radius / wind, x.filtered_pitch) * wind * wind * wind / w
    braking = ratio * x.filtered_torque / x.gear_efficiency
    gain = x.estimator_gain
    wind = wind + gain * (speed - x.last_speed + dt / inertia * (braking - driving))
    # the table's largest tip-speed ratio bounds the estimate from below
    last = x.ratio_first + x.ratio_step * (x.ratios - 1.0)
    x.wind = min(max(wind, max(w * radius / last, 0.5)), 60.0)
    x.last_speed = speed
    most = disk * x.best_coefficient * x.gear_efficiency * x.wind * x.wind * x.wind
    share = 1.0 - exp(-dt / x.available_time)
    x.available += share * (min(most, x.rated_power) - x.available)


@kernel
def fine_power(x: PowerControlState) -> float:
    """Mechanical power [W] that the estimated wind would give at this speed with fine pitch (C-84).

    It is zero at tip-speed ratios of half the optimum and below: near stall there is no reserve.
    """
    radius, wind = x.radius, x.wind
    disk = 0.5 * x.density * pi * radius * radius * wind * wind * wind
    ratio = x.speed / x.gear_ratio * radius / wind
    share = min(max(10.0 * ratio / x.best_ratio - 5.0, 0.0), 1.0)
    return share * disk * power_coefficient(x, ratio, x.minimum_pitch) * x.gear_efficiency


@kernel
def estimate_efficiency(x: PowerControlState, measured: Measurements, dt: float) -> None:
    """Filtered ratio of electrical to mechanical power, since the reference is one of power into the grid (C-86b)."""
    shaft = measured.torque * measured.generator_speed
    if shaft < LEAST_SHARE * x.rated_power or measured.grid_voltage < LEAST_VOLTAGE:
        return
    now = min(max(measured.power / shaft, 0.5), 1.0)
    x.efficiency += (1.0 - exp(-dt / x.available_time)) * (now - x.efficiency)


@kernel
def requested_power(x: PowerControlState, measured: Measurements) -> float:
    """Mechanical power [W] requested by the operator and by droop, at most rated power (C-87)."""
    rated, efficiency = x.rated_power, x.efficiency
    if measured.power_reference == measured.power_reference:  # otherwise the link is lost: the last value holds
        x.reference = measured.power_reference
    reference = x.reference / efficiency
    if x.reference > x.grid_rating * 1.000001 and x.reference < 1e300:
        x.over += 1.0
    power = min(rated, reference)
    if measured.power_limit > 0.0 or measured.power_limit <= 0.0:
        power = min(power, measured.power_limit / efficiency)
    most = power if x.reserve == 0.0 else rated
    if x.droop_gain > 0.0:
        away = measured.grid_frequency - x.nominal_frequency
        beyond = max(away - x.dead_band, 0.0) + min(away + x.dead_band, 0.0)
        x.switches += crossed(abs(away) - x.dead_band)
        if not (abs(beyond) < 1e3):
            beyond = 0.0  # the sensor is lost
        change = -x.droop_gain * beyond / efficiency
        if x.reserve > 0.0 or change < 0.0:
            power = min(power, (1.0 - x.reserve) * x.available)
        most = rated
        if measured.power_limit > 0.0 or measured.power_limit <= 0.0:
            most = min(rated, measured.power_limit / efficiency)
        power = power + change
    return min(max(power, 0.0), most)


@kernel
def set_point(x: PowerControlState, measured: Measurements, dt: float) -> None:
    """Rate-limited power set-point; it falls from the present power (C-87)."""
    wanted, now = requested_power(x, measured), x.setpoint
    if wanted < now:
        now = min(now, max(wanted, x.torque * x.speed))
    step = x.reference_rate * dt
    x.switches += crossed(abs(wanted - now) - step)
    x.setpoint = now + min(max(wanted - now, -step), step)


@kernel
def inertial_power(x: PowerControlState, measured: Measurements, dt: float) -> float:
    """Mechanical power [W] of synthetic inertia, by the filtered rate of change of frequency (C-88).

    It vanishes as the speed falls to the begin of the optimal torque, so that the rotor can recover.
    """
    if x.inertia_gain <= 0.0:
        return 0.0
    if abs(measured.grid_frequency) < 1e3:
        step = (measured.grid_frequency - x.slow_frequency) * (1.0 - exp(-dt / x.inertia_time))
        x.slow_frequency += step
    else:
        step = 0.0
    low, high = x.optimal_speed, 1.2 * x.optimal_speed
    share = min(max((x.speed - low) / (high - low), 0.0), 1.0)
    return -share * x.inertia_gain * step / dt / x.efficiency


@kernel
def bound_speeds(x: PowerControlState, gain: float, dt: float) -> float:
    """Speeds that bound the states; returns the gain of the torque law at the present pitch (C-82 to C-84)."""
    scheme, power = whole(x.scheme), x.setpoint
    reference, lower = x.reference_speed, lower_speed(x, gain, power)
    if scheme == 3:
        wide = gain_at_pitch(x, x.pitch) * x.density
        x.switches += crossed(wide - gain)
        gain = max(gain, wide)
        least = max(lower_speed(x, gain, power), power / x.maximum_torque)
        lower = min(lower, least)
    lower = min(lower, reference)
    x.lower = lower
    slow = x.recovery_margin * x.frequency * dt  # rate limit of a bound that the rotor has to follow
    if scheme == 0:
        x.upper = min(max(lower, x.upper - slow), reference)
    else:
        x.upper = reference
    recovery = min(lower + x.recovery_margin, x.upper)
    if scheme == 3:
        # decreasing pitch raises this speed, which decreases the pitch further
        recovery = min(recovery, x.recovery + slow)
    x.recovery = recovery
    return gain


@kernel
def tune_pitch_loop(x: PowerControlState, gain: float, dt: float) -> None:
    """Gains of the pitch loop at the present pitch, speed and power (C-86).

    The pitch is filtered: gains that grow with decreasing pitch would destabilise the loop.
    """
    x.slow_pitch += (1.0 - exp(-dt * x.frequency)) * (x.pitch - x.slow_pitch)
    ratio = x.gear_ratio
    speed = max(x.speed, x.optimal_speed)
    optimal = gain * speed * speed * speed
    power = max(x.torque * speed, 0.01 * optimal)
    falls = optimal * sensitivity(x, x.slow_pitch, third_root(power / optimal))
    unit = x.loop_inertia * speed / (ratio * ratio * falls)
    x.pitch_loop.proportional_gain = 2.0 * x.damping_ratio * x.frequency * unit
    x.pitch_loop.integral_gain = x.frequency * x.frequency * unit


@kernel
def step_machine(x: PowerControlState) -> None:
    """Conditions and step of the state machine (C-83)."""
    speed, state = x.speed, whole(x.state)
    above = x.ahead - x.upper
    for c in range(len(t.CONDITIONS)):
        x.holds[c] = 0.0
    if speed > x.lower:
        x.holds[ABOVE_LOWER] = 1.0
    if above >= 0.0:
        x.holds[ABOVE_UPPER] = 1.0
    if x.ahead <= x.recovery:
        x.holds[BELOW_RECOVERY] = 1.0
    if x.pitch <= x.minimum_pitch + FINE:
        x.holds[AT_FINE] = 1.0
    if x.scheme > 1.5 and x.recovery < x.upper:
        x.holds[HOLDING] = 1.0
    x.switches += crossed(above) + crossed(x.ahead - x.recovery)
    row = transition(t.MACHINE, state, x.holds)
    if row >= 0:
        x.state = float(t.MACHINE[row, TO])
        # bumpless: the loop begins with the present pitch
        x.pitch_loop.integral = x.pitch - x.pitch_loop.proportional_gain * pitch_error(x)


@kernel
def pitch_error(x: PowerControlState) -> float:
    """Speed error [rad/s] of the state; zero where no speed is held."""
    mode = t.MODES[whole(x.state) - 1]
    if mode == PITCH_UPPER:
        return x.ahead - x.upper
    if mode == PITCH_RECOVERY:
        return x.ahead - x.recovery
    return 0.0


@kernel
def move_pitch(x: PowerControlState, dt: float) -> None:
    """Pitch demand of the state within the limits of angle and rate."""
    mode, step, last = t.MODES[whole(x.state) - 1], x.pitch_rate * dt, x.pitch
    if mode == PITCH_HELD:
        return
    low, high = max(x.minimum_pitch, last - step), min(x.maximum_pitch, last + step)
    if mode == PITCH_FINE:
        x.pitch = low
    else:
        x.pitch = integrator(x.pitch_loop, pitch_error(x), low, high, dt)
        x.switches += x.pitch_loop.switches
        x.pitch_loop.switches = 0.0


@kernel
def least_torque(x: PowerControlState, gain: float) -> float:
    """Torque [N m] below the lower speed: the optimal one; with A3 more, until the speed has recovered (C-80, C-84)."""
    law = optimal_torque(x, gain, x.speed)
    if whole(x.scheme) != 3:
        return law
    mode = t.MODES[whole(x.state) - 1]
    if mode in (PITCH_HELD, PITCH_RECOVERY):
        x.spares = 1.0
    if x.spares < 0.5:
        return law
    spared = SPARED * fine_power(x) / max(x.speed, 1e-3)
    if mode == PITCH_FINE:
        x.switches += crossed(spared - law)
        if spared <= law:  # the speed has recovered
            x.spares = 0.0
    return max(law, spared)


@kernel
def track_ratio(x: PowerControlState, law: float, high: float, low: float, more: float, dt: float) -> float:
    """Torque demand of the loop on the best speed for the estimated wind; ``law`` [N m] holds while limited.

    A rising set-point moves its lower speed away from the rotor speed. A loop on that speed alone would unload the
    generator although the power is available and demanded, and delay the pitch. So after limited power the torque
    moves to that of (C-82) and stays there until the speed has arrived.

    Args:
      high, low: [N m] limits of the demand.
      more: [N m] additional torque for the grid's frequency.
    """
    last, loop = x.torque, x.torque_loop
    best = max(x.best_ratio * x.wind / x.radius * x.gear_ratio, x.optimal_speed)
    error = x.speed - min(best, x.lower)
    x.switches += crossed(best - x.lower)
    torque = last - more
    if best >= x.lower:
        x.limited = 1.0
    elif error >= 0.0 and x.limited > 0.5:
        x.limited = 0.0
        loop.integral = torque - loop.proportional_gain * error  # bumpless: it continues from the present torque
    if x.limited > 0.5:
        near = torque + (1.0 - exp(-dt * x.frequency)) * (law - torque)
        high = max(min(high, max(law, near) + more), low)
        low = min(max(low, min(law, near) + more), high)
    torque = integrator(loop, error, low - more, high - more, dt)
    x.switches += loop.switches
    loop.switches = 0.0
    if x.limited > 0.5:  # the loop follows the law where that demanded more
        loop.integral = max(loop.integral, torque - loop.proportional_gain * error)
    return torque + more


@kernel
def move_torque(x: PowerControlState, gain: float, more: float, dt: float) -> None:
    """Torque demand, within the set-point, the torque's limit and its rate.

    Args:
      gain: gain of the torque law at the present pitch.
      more: [W] additional power for the grid's frequency, from the kinetic energy of the rotor.
    """
    speed = max(x.speed, 1e-3)
    torque = x.setpoint / speed
    step, last = x.torque_rate * dt, x.torque
    most = min((x.setpoint + more) / speed, min(x.maximum_torque, x.rated_power / speed))
    law = least_torque(x, gain)
    x.switches += crossed(law - torque) + crossed(torque - x.maximum_torque)
    law = min(law, torque)
    if x.tracks_ratio > 0.5:
        high = max(max(min(most, last + step), last - step), 0.0)
        x.torque = track_ratio(x, law, high, max(last - step, 0.0), more / speed, dt)
        return
    wanted = max(min(law + more / speed, most), 0.0)
    x.switches += crossed(abs(wanted - last) - step)
    x.torque = last + min(max(wanted - last, -step), step)


@kernel
def power_step(x: PowerControlState, measured: Measurements, demands: Demands, dt: float) -> None:
    """One call of the power control (C-80 to C-88).

    Args:
      x: settings and state, see ``power_settings``.
      measured: measurements of the sensors.
      demands: torque, pitch of all blades and its reports are written.
      dt: [s] since the last call.
    """
    keep = exp(-dt * x.filter_frequency)
    last = x.speed
    x.speed = (1.0 - keep) * measured.generator_speed + keep * last
    x.ahead = x.speed + x.anticipation / dt * (x.speed - last)
    x.density = air_density(x, measured)
    estimate_wind(x, measured, dt)
    estimate_efficiency(x, measured, dt)
    set_point(x, measured, dt)
    more = inertial_power(x, measured, dt)
    optimal = optimal_gain(x)
    gain = bound_speeds(x, optimal, dt)
    tune_pitch_loop(x, optimal, dt)
    step_machine(x)
    move_pitch(x, dt)
    move_torque(x, gain, more, dt)
    if measured.grid < 0.5:
        x.torque = 0.0
    demands.generator_torque = x.torque
    for b in range(whole(measured.n_blades)):
        demands.pitch[b] = x.pitch
    demands.power_setpoint = x.setpoint * x.efficiency
    demands.power_state = x.state
    demands.wind_estimate = x.wind
