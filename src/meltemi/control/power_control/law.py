"""The law of the power control: one call after the other of ``power_step`` (C-80 to C-90).

Each call: filtered speed, density, wind estimate; the set-point of the power from reference, limit and frequency; the
speeds that bound the states; the machine; pitch; torque. Everything is on the generator's side of the gearbox but for
the estimator. Below the lower speed the torque is the optimal one, or what A3 spares after a held pitch, so a set-point
that the wind cannot give does not stall the rotor: power falls instead.

Reference: docs/theory/control.md (C-80 to C-90); Palanimuthu et al. (2022), section 5.
"""

from __future__ import annotations

from math import exp, log, pi, sqrt

from numpy import float64
from numpy.typing import NDArray

from meltemi.control import integrator as loop
from meltemi.control import signals as s
from meltemi.control.integrator import integrator
from meltemi.control.power_control import state as p
from meltemi.control.power_control import tables as t
from meltemi.control.power_control.rotor import gain_at_pitch, power_coefficient, sensitivity
from meltemi.core.kernel import kernel
from meltemi.environment.density import moist_air_density
from meltemi.maths.generic import crossed, whole

Float = NDArray[float64]

SPARED = 0.9
"""Share of the power at fine pitch that A3 may take below the lower speed after a held pitch; the rest brings the speed
back."""
LEAST_SHARE, LEAST_VOLTAGE = 0.05, 0.9
"""Of rated power and of the grid's voltage, from which the efficiency is heard."""
FINE = 1e-6
"""[rad] within which the pitch is at its smallest."""
ABOVE_LOWER, ABOVE_UPPER, BELOW_RECOVERY, AT_FINE, HOLDING = range(len(t.CONDITIONS))
assert t.CONDITIONS == ("above_lower", "above_upper", "below_recovery", "fine", "holds")
PITCH_FINE, PITCH_HELD, PITCH_UPPER, PITCH_RECOVERY = range(len(t.PITCHES))


@kernel
def third_root(a: float) -> float:
    """Of a number above zero."""
    return exp(log(a) / 3.0)


@kernel
def air_density(x: Float, at: int, measured: Float) -> float:
    """Density [kg/m^3] that the law takes (C-81); a sensor that gives nonsense leaves the last one."""
    kind = whole(x[at + p.AIR])
    if kind == 0:
        return x[at + p.DENSITY]
    found = 0.0 * x[at + p.DENSITY]
    if kind == 1:
        found = moist_air_density(measured[s.AIR_TEMPERATURE], 0.0, x[at + p.ASSUMED_PRESSURE])
    else:
        found = moist_air_density(measured[s.AIR_TEMPERATURE], measured[s.HUMIDITY], measured[s.AIR_PRESSURE])
    return found if 0.2 < found < 3.0 else x[at + p.DENSITY]


@kernel
def optimal_gain(x: Float, at: int) -> float:
    """K [N m s^2/rad^2] on the generator's side (C-80)."""
    area = 0.5 * pi * x[at + p.DENSITY] * x[at + p.RADIUS] * x[at + p.RADIUS]
    tip = x[at + p.RADIUS] / (x[at + p.BEST_RATIO] * x[at + p.GEAR_RATIO])
    return area * x[at + p.BEST_COEFFICIENT] * x[at + p.GEAR_EFFICIENCY] * tip * tip * tip


@kernel
def transition(x: Float, at: int, gain: float) -> float:
    """Speed [rad/s] at which the line below rated speed begins, with an optimal gain."""
    rated, slope = x[at + p.RATED], x[at + p.SLOPE]
    if gain * rated * rated * rated >= x[at + p.RATED_POWER]:
        return rated
    return (slope - sqrt(max(slope * (slope - 4.0 * gain * x[at + p.SYNCHRONOUS]), 0.0))) / (2.0 * gain)


@kernel
def optimal_torque(x: Float, at: int, gain: float, speed: float) -> float:
    """Torque [N m] that follows the best tip-speed ratio, up to rated speed (C-80)."""
    first, best = x[at + p.CUT_IN], x[at + p.OPTIMAL]
    if speed <= first:
        return 0.0 * speed
    if speed < best:
        return (speed - first) / (best - first) * gain * best * best
    torque = gain * speed * speed
    if speed > transition(x, at, gain):
        torque = max(torque, x[at + p.SLOPE] * (speed - x[at + p.SYNCHRONOUS]))
    return torque


@kernel
def lower_speed(x: Float, at: int, gain: float, power: float) -> float:
    """Speed [rad/s] from which the optimal torque gives a power [W] (C-82), within the torque's limit."""
    low = x[at + p.OPTIMAL]
    if power <= gain * low * low * low:
        return low + 0.0 * power
    speed = third_root(power / gain)
    if speed > transition(x, at, gain):
        none, slope = x[at + p.SYNCHRONOUS], x[at + p.SLOPE]
        speed = min(0.5 * (none + sqrt(none * none + 4.0 * power / slope)), x[at + p.RATED])
    return max(speed, low)


@kernel
def estimate_wind(x: Float, at: int, measured: Float, dt: float) -> None:
    """One step of the wind estimate by immersion and invariance (C-85).

    Speed, torque and pitch go through the same low-pass, which leaves the balance of torque as it is and the shaft's
    torsion out of it.
    """
    ratio, radius, inertia = x[at + p.GEAR_RATIO], x[at + p.RADIUS], x[at + p.INERTIA]
    speed, angle = x[at + p.SPEED] / ratio, 0.0 * x[at + p.SPEED]
    blades, keep = whole(measured[s.N_BLADES]), exp(-dt * x[at + p.FILTER])
    for i in range(blades):
        angle = angle + measured[s.PITCH + i] / blades
    x[at + p.HEARD_TORQUE] = (1.0 - keep) * measured[s.TORQUE] + keep * x[at + p.HEARD_TORQUE]
    x[at + p.HEARD_PITCH] = (1.0 - keep) * angle + keep * x[at + p.HEARD_PITCH]
    w, wind = max(speed, 1e-3), x[at + p.WIND]
    disk = 0.5 * x[at + p.DENSITY] * pi * radius * radius
    driving = disk * power_coefficient(x, at, w * radius / wind, x[at + p.HEARD_PITCH]) * wind * wind * wind / w
    braking = ratio * x[at + p.HEARD_TORQUE] / x[at + p.GEAR_EFFICIENCY]
    gain = x[at + p.ESTIMATOR_GAIN]
    wind = wind + gain * (speed - x[at + p.LAST_SPEED] + dt / inertia * (braking - driving))
    # the table's largest tip-speed ratio bounds the estimate from below
    last = x[at + p.RATIO_FIRST] + x[at + p.RATIO_STEP] * (x[at + p.RATIOS] - 1.0)
    x[at + p.WIND] = min(max(wind, max(w * radius / last, 0.5)), 60.0)
    x[at + p.LAST_SPEED] = speed
    most = (
        disk * x[at + p.BEST_COEFFICIENT] * x[at + p.GEAR_EFFICIENCY] * x[at + p.WIND] * x[at + p.WIND] * x[at + p.WIND]
    )
    share = 1.0 - exp(-dt / x[at + p.AVAILABLE_TIME])
    x[at + p.AVAILABLE] += share * (min(most, x[at + p.RATED_POWER]) - x[at + p.AVAILABLE])


@kernel
def fine_power(x: Float, at: int) -> float:
    """Mechanical power [W] that the estimated wind would give at this speed with fine pitch (C-84).

    None of it counts at tip-speed ratios of half the best one and less: near the stall nothing is to be spared.
    """
    radius, wind = x[at + p.RADIUS], x[at + p.WIND]
    disk = 0.5 * x[at + p.DENSITY] * pi * radius * radius * wind * wind * wind
    ratio = x[at + p.SPEED] / x[at + p.GEAR_RATIO] * radius / wind
    share = min(max(10.0 * ratio / x[at + p.BEST_RATIO] - 5.0, 0.0), 1.0)
    return share * disk * power_coefficient(x, at, ratio, x[at + p.MIN_PITCH]) * x[at + p.GEAR_EFFICIENCY]


@kernel
def hear_efficiency(x: Float, at: int, measured: Float, dt: float) -> None:
    """Electrical over mechanical power, slowly followed: a reference is one of power into the grid (C-86b)."""
    shaft = measured[s.TORQUE] * measured[s.GENERATOR_SPEED]
    if shaft < LEAST_SHARE * x[at + p.RATED_POWER] or measured[s.GRID_VOLTAGE] < LEAST_VOLTAGE:
        return
    now = min(max(measured[s.POWER] / shaft, 0.5), 1.0)
    x[at + p.EFFICIENCY] += (1.0 - exp(-dt / x[at + p.AVAILABLE_TIME])) * (now - x[at + p.EFFICIENCY])


@kernel
def wanted_power(x: Float, at: int, measured: Float) -> float:
    """Mechanical power [W] that the operator and the frequency ask for, not more than rated (C-87)."""
    rated, efficiency = x[at + p.RATED_POWER], x[at + p.EFFICIENCY]
    if measured[s.POWER_REFERENCE] == measured[s.POWER_REFERENCE]:  # else the link is lost: the last one holds
        x[at + p.REFERENCE] = measured[s.POWER_REFERENCE]
    reference = x[at + p.REFERENCE] / efficiency
    if x[at + p.REFERENCE] > x[at + p.GRID_RATING] * 1.000001 and x[at + p.REFERENCE] < 1e300:
        x[at + p.OVER] += 1.0
    power = min(rated, reference)
    if measured[s.POWER_LIMIT] > 0.0 or measured[s.POWER_LIMIT] <= 0.0:
        power = min(power, measured[s.POWER_LIMIT] / efficiency)
    most = power if x[at + p.RESERVE] == 0.0 else rated
    if x[at + p.DROOP_GAIN] > 0.0:
        away = measured[s.GRID_FREQUENCY] - x[at + p.NOMINAL_FREQUENCY]
        beyond = max(away - x[at + p.DEAD_BAND], 0.0) + min(away + x[at + p.DEAD_BAND], 0.0)
        x[at + p.SWITCHES] += crossed(abs(away) - x[at + p.DEAD_BAND])
        if not (abs(beyond) < 1e3):
            beyond = 0.0 * power  # the sensor is lost
        change = -x[at + p.DROOP_GAIN] * beyond / efficiency
        if x[at + p.RESERVE] > 0.0 or change < 0.0:
            power = min(power, (1.0 - x[at + p.RESERVE]) * x[at + p.AVAILABLE])
        most = rated
        if measured[s.POWER_LIMIT] > 0.0 or measured[s.POWER_LIMIT] <= 0.0:
            most = min(rated, measured[s.POWER_LIMIT] / efficiency)
        power = power + change
    return min(max(power, 0.0), most)


@kernel
def set_point(x: Float, at: int, measured: Float, dt: float) -> None:
    """Move the set-point towards the wanted power, at its rate; downwards from the power that there is (C-87)."""
    wanted, now = wanted_power(x, at, measured), x[at + p.SETPOINT]
    if wanted < now:
        now = min(now, max(wanted, x[at + p.TORQUE] * x[at + p.SPEED]))
    step = x[at + p.REFERENCE_RATE] * dt
    x[at + p.SWITCHES] += crossed(abs(wanted - now) - step)
    x[at + p.SETPOINT] = now + min(max(wanted - now, -step), step)


@kernel
def inertial_power(x: Float, at: int, measured: Float, dt: float) -> float:
    """Mechanical power [W] of synthetic inertia, against the filtered rate of the frequency (C-88).

    It fades where the speed falls to the begin of the optimal torque: the rotor keeps what it needs to recover.
    """
    if x[at + p.INERTIA_GAIN] <= 0.0:
        return 0.0 * x[at + p.SPEED]
    if abs(measured[s.GRID_FREQUENCY]) < 1e3:
        step = (measured[s.GRID_FREQUENCY] - x[at + p.SLOW_FREQUENCY]) * (1.0 - exp(-dt / x[at + p.INERTIA_TIME]))
        x[at + p.SLOW_FREQUENCY] += step
    else:
        step = 0.0 * x[at + p.SPEED]
    low, high = x[at + p.OPTIMAL], 1.2 * x[at + p.OPTIMAL]
    share = min(max((x[at + p.SPEED] - low) / (high - low), 0.0), 1.0)
    return -share * x[at + p.INERTIA_GAIN] * step / dt / x[at + p.EFFICIENCY]


@kernel
def bound_speeds(x: Float, at: int, gain: float, dt: float) -> float:
    """The speeds that bound the states; returns the gain of the torque law at the present pitch (C-82 to C-84)."""
    scheme, power = whole(x[at + p.SCHEME]), x[at + p.SETPOINT]
    reference, lower = x[at + p.REFERENCE_SPEED], lower_speed(x, at, gain, power)
    if scheme == 3:
        wide = gain_at_pitch(x, at, x[at + p.PITCH]) * x[at + p.DENSITY]
        x[at + p.SWITCHES] += crossed(wide - gain)
        gain = max(gain, wide)
        least = max(lower_speed(x, at, gain, power), power / x[at + p.MAX_TORQUE])
        lower = min(lower, least)
    lower = min(lower, reference)
    x[at + p.LOWER] = lower
    slow = x[at + p.RECOVERY_MARGIN] * x[at + p.FREQUENCY] * dt  # of a bound that the rotor has to follow
    if scheme == 0:
        x[at + p.UPPER] = min(max(lower, x[at + p.UPPER] - slow), reference)
    else:
        x[at + p.UPPER] = reference + 0.0 * lower
    recovery = min(lower + x[at + p.RECOVERY_MARGIN], x[at + p.UPPER])
    if scheme == 3:
        # pitch that falls raises this speed, which lets the pitch fall further
        recovery = min(recovery, x[at + p.RECOVERY] + slow)
    x[at + p.RECOVERY] = recovery
    return gain


@kernel
def tune_pitch_loop(x: Float, at: int, gain: float, dt: float) -> None:
    """Gains of the pitch loop at the present pitch, speed and power (C-86).

    The pitch is filtered: gains that grow while it falls would drive it.
    """
    x[at + p.SLOW_PITCH] += (1.0 - exp(-dt * x[at + p.FREQUENCY])) * (x[at + p.PITCH] - x[at + p.SLOW_PITCH])
    ratio = x[at + p.GEAR_RATIO]
    speed = max(x[at + p.SPEED], x[at + p.OPTIMAL])
    optimal = gain * speed * speed * speed
    power = max(x[at + p.TORQUE] * speed, 0.01 * optimal)
    falls = optimal * sensitivity(x, at, x[at + p.SLOW_PITCH], third_root(power / optimal))
    unit = x[at + p.LOOP_INERTIA] * speed / (ratio * ratio * falls)
    x[at + p.PITCH_LOOP + loop.KP] = 2.0 * x[at + p.DAMPING] * x[at + p.FREQUENCY] * unit
    x[at + p.PITCH_LOOP + loop.KI] = x[at + p.FREQUENCY] * x[at + p.FREQUENCY] * unit


@kernel
def walk(x: Float, at: int) -> None:
    """Conditions, and at most one transition of the machine (C-83)."""
    speed, holds = x[at + p.SPEED], at + p.HOLDS
    state = whole(x[at + p.STATE])
    above = speed - x[at + p.UPPER]
    for c in range(len(t.CONDITIONS)):
        x[holds + c] = 0.0
    if speed > x[at + p.LOWER]:
        x[holds + ABOVE_LOWER] = 1.0
    if above >= 0.0:
        x[holds + ABOVE_UPPER] = 1.0
    if speed <= x[at + p.RECOVERY]:
        x[holds + BELOW_RECOVERY] = 1.0
    if x[at + p.PITCH] <= x[at + p.MIN_PITCH] + FINE:
        x[holds + AT_FINE] = 1.0
    if x[at + p.SCHEME] > 1.5 and x[at + p.RECOVERY] < x[at + p.UPPER]:
        x[holds + HOLDING] = 1.0
    x[at + p.SWITCHES] += crossed(above) + crossed(speed - x[at + p.RECOVERY])
    for row in range(t.MACHINE.shape[0]):
        if t.MACHINE[row, t.FROM] != state:
            continue
        taken = True
        for k in range(t.MOST):
            c = t.MACHINE[row, t.FIRST + k]
            if (c > 0 and x[holds + c - 1] < 0.5) or (c < 0 and x[holds - c - 1] > 0.5):
                taken = False
        if taken:
            x[at + p.STATE] = float(t.MACHINE[row, t.TO])
            # bumpless: the loop begins with the pitch there is
            x[at + p.PITCH_LOOP + loop.INTEGRAL] = x[at + p.PITCH] - x[at + p.PITCH_LOOP + loop.KP] * pitch_error(x, at)
            return


@kernel
def pitch_error(x: Float, at: int) -> float:
    """Speed [rad/s] above the one that the state holds; zero where it holds none."""
    mode = t.MODES[whole(x[at + p.STATE]) - 1]
    if mode == PITCH_UPPER:
        return x[at + p.SPEED] - x[at + p.UPPER]
    if mode == PITCH_RECOVERY:
        return x[at + p.SPEED] - x[at + p.RECOVERY]
    return 0.0 * x[at + p.SPEED]


@kernel
def move_pitch(x: Float, at: int, dt: float) -> None:
    """Pitch demand of the state, within angle and rate."""
    mode, step, last = t.MODES[whole(x[at + p.STATE]) - 1], x[at + p.PITCH_RATE] * dt, x[at + p.PITCH]
    if mode == PITCH_HELD:
        return
    low, high = max(x[at + p.MIN_PITCH], last - step), min(x[at + p.MAX_PITCH], last + step)
    if mode == PITCH_FINE:
        x[at + p.PITCH] = low
    else:
        x[at + p.PITCH] = integrator(x, at + p.PITCH_LOOP, pitch_error(x, at), low, high, dt)
        x[at + p.SWITCHES] += x[at + p.PITCH_LOOP + loop.SWITCHES]
        x[at + p.PITCH_LOOP + loop.SWITCHES] = 0.0


@kernel
def least_torque(x: Float, at: int, gain: float) -> float:
    """Torque [N m] below the lower speed: the optimal one; for A3 more, until the speed is back (C-80, C-84)."""
    law = optimal_torque(x, at, gain, x[at + p.SPEED])
    if whole(x[at + p.SCHEME]) != 3:
        return law
    mode = t.MODES[whole(x[at + p.STATE]) - 1]
    if mode in (PITCH_HELD, PITCH_RECOVERY):
        x[at + p.SPARES] = 1.0
    if x[at + p.SPARES] < 0.5:
        return law
    spared = SPARED * fine_power(x, at) / max(x[at + p.SPEED], 1e-3)
    if mode == PITCH_FINE:
        x[at + p.SWITCHES] += crossed(spared - law)
        if spared <= law:  # the speed is back
            x[at + p.SPARES] = 0.0
    return max(law, spared)


@kernel
def track_ratio(x: Float, at: int, law: float, high: float, low: float, more: float, dt: float) -> float:
    """Torque demand of the loop on the best speed for the estimated wind; ``law`` [N m] holds while limited.

    The set-point that rises takes its lower speed away from the rotor. A loop on that speed alone would unload the
    generator, of power that is there and asked for, and let the pitch wait. So from a limited power on the torque goes
    to that of (C-82) and stays there, until the speed has arrived.

    Args:
      high, low: [N m] limits of the demand.
      more: [N m] for the grid's frequency, beside the loop.
    """
    last, place = x[at + p.TORQUE], at + p.TORQUE_LOOP
    best = max(x[at + p.BEST_RATIO] * x[at + p.WIND] / x[at + p.RADIUS] * x[at + p.GEAR_RATIO], x[at + p.OPTIMAL])
    error = x[at + p.SPEED] - min(best, x[at + p.LOWER])
    x[at + p.SWITCHES] += crossed(best - x[at + p.LOWER])
    own = last - more
    if best >= x[at + p.LOWER]:
        x[at + p.LIMITED] = 1.0
    elif error >= 0.0 and x[at + p.LIMITED] > 0.5:
        x[at + p.LIMITED] = 0.0
        x[place + loop.INTEGRAL] = own - x[place + loop.KP] * error  # bumpless: it goes on from the torque there is
    if x[at + p.LIMITED] > 0.5:
        near = own + (1.0 - exp(-dt * x[at + p.FREQUENCY])) * (law - own)
        high = max(min(high, max(law, near) + more), low)
        low = min(max(low, min(law, near) + more), high)
    own = integrator(x, place, error, low - more, high - more, dt)
    x[at + p.SWITCHES] += x[place + loop.SWITCHES]
    x[place + loop.SWITCHES] = 0.0
    if x[at + p.LIMITED] > 0.5:  # where the law gave more, the loop follows
        x[place + loop.INTEGRAL] = max(x[place + loop.INTEGRAL], own - x[place + loop.KP] * error)
    return own + more


@kernel
def move_torque(x: Float, at: int, gain: float, more: float, dt: float) -> None:
    """Torque demand, within the set-point, the torque's limit and its rate.

    Args:
      gain: of the torque law at the present pitch.
      more: [W] for the grid's frequency, taken from the rotor's motion.
    """
    speed = max(x[at + p.SPEED], 1e-3)
    held = x[at + p.SETPOINT] / speed
    step, last = x[at + p.TORQUE_RATE] * dt, x[at + p.TORQUE]
    most = min((x[at + p.SETPOINT] + more) / speed, min(x[at + p.MAX_TORQUE], x[at + p.RATED_POWER] / speed))
    law = least_torque(x, at, gain)
    x[at + p.SWITCHES] += crossed(law - held) + crossed(held - x[at + p.MAX_TORQUE])
    law = min(law, held)
    if x[at + p.TRACKS_RATIO] > 0.5:
        high = max(max(min(most, last + step), last - step), 0.0)
        x[at + p.TORQUE] = track_ratio(x, at, law, high, max(last - step, 0.0), more / speed, dt)
        return
    wanted = max(min(law + more / speed, most), 0.0)
    x[at + p.SWITCHES] += crossed(abs(wanted - last) - step)
    x[at + p.TORQUE] = last + min(max(wanted - last, -step), step)


@kernel
def power_step(x: Float, at: int, measured: Float, demands: Float, dt: float) -> None:
    """One call of the power control (C-80 to C-90).

    Args:
      x: state vector that holds its section from the place ``at`` on, see ``power_section``.
      measured: table Measurements.
      demands: table DEMANDS; torque, pitch of all blades and its reports are written.
      dt: [s] since the last call.
    """
    keep = exp(-dt * x[at + p.FILTER])
    x[at + p.SPEED] = (1.0 - keep) * measured[s.GENERATOR_SPEED] + keep * x[at + p.SPEED]
    x[at + p.DENSITY] = air_density(x, at, measured)
    estimate_wind(x, at, measured, dt)
    hear_efficiency(x, at, measured, dt)
    set_point(x, at, measured, dt)
    more = inertial_power(x, at, measured, dt)
    optimal = optimal_gain(x, at)
    gain = bound_speeds(x, at, optimal, dt)
    tune_pitch_loop(x, at, optimal, dt)
    walk(x, at)
    move_pitch(x, at, dt)
    move_torque(x, at, gain, more, dt)
    if measured[s.GRID] < 0.5:
        x[at + p.TORQUE] = 0.0
    demands[s.GENERATOR_TORQUE] = x[at + p.TORQUE]
    for i in range(whole(measured[s.N_BLADES])):
        demands[s.PITCH_DEMAND + i] = x[at + p.PITCH]
    demands[s.POWER_SETPOINT] = x[at + p.SETPOINT] * x[at + p.EFFICIENCY]
    demands[s.POWER_STATE] = x[at + p.STATE]
    demands[s.WIND_ESTIMATE] = x[at + p.WIND]
