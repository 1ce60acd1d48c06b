"""The supervised controller: load control in production, and around it start, stop, protection and derating.

Each call: means of the wind and the yaw control; the quantities; the conditions, each with the time for which it has
held; the machine of yaw protection, then that of operation; then what the state asks for. In production load control
works as it is, to the bit when nothing limits the power. The supervisor turns the knobs of the collective law: its
reference speed (which rises during a start), its lowest pitch, its pitch rate, and its rated power, which is the
set-point. Stops pitch each blade from where it stands; a start sets the law's integral so that nothing jumps.

The section of the supervisor is the last of the state vector, the yaw control the last of it.

Reference: docs/theory/control.md (C-60 to C-68).
"""

from __future__ import annotations

from collections.abc import Sequence
from math import exp, sqrt

import numpy as np
from numpy import float64
from numpy.typing import NDArray

from meltemi.control import baseline as law
from meltemi.control import load_control as inner
from meltemi.control import signals as s
from meltemi.control import yaw as vane
from meltemi.control.baseline import law_torque
from meltemi.control.controller import Controller, LogEntry, StartPoint
from meltemi.control.harmonic import LOOP_STATES, TILT_AXIS, YAW_AXIS
from meltemi.control.integrator import INTEGRAL as AXIS_INTEGRAL
from meltemi.control.load_control import LoadControl, load_control
from meltemi.control.moving_mean import mean_start, mean_states, moving_mean
from meltemi.control.supervisor import tables as t
from meltemi.control.supervisor.log import LOG, LOG_ROOM, EntryRow, log_entries, write_entry
from meltemi.control.supervisor.settings import Supervision, limits
from meltemi.control.supervisor.threshold import STRATEGIES, YawProtection, threshold
from meltemi.control.yaw import YawControl, yaw_settings, yaw_step
from meltemi.core.errors import InputError
from meltemi.core.kernel import kernel
from meltemi.maths.generic import crossed, whole
from meltemi.maths.tables import MAX_BLADES, Table, View, number
from meltemi.turbine.power_turbine import AnyTurbine

Float = NDArray[float64]


class SupervisorState(Table, title="supervisor"):
    """Settings and state."""

    reference: float = number("rad/s", "of the pitch loop, of the generator")
    minimum_pitch: float = number("rad", "of the collective law")
    law_rate: float = number("rad/s", "of the pitch, by the law")
    start_rate: float = number("rad/s", "at start-up")
    normal_rate: float = number("rad/s", "at a normal stop")
    emergency_rate: float = number("rad/s", "at an emergency stop")
    rated_power: float = number("W", "mechanical, of the law")
    efficiency: float = number("-", "of the generator")
    gear_ratio: float = number("-", "generator speed over rotor speed")
    connect_speed: float = number("rad/s", "at which the generator connects, and below which a stop leaves no torque")
    start_acceleration: float = number("rad/s^2", "of the reference")
    start_pitch: float = number("rad", "lowest at standstill")
    start_ratio: float = number("rad/m", "generator speed over wind speed from which the pitch may be the law's lowest")
    connect_time: float = number("s", "in which the torque is allowed")
    feather: float = number("rad", "pitch at rest")
    brake: float = number("-", "share of the full brake")
    brake_speed: float = number("rad/s", "below which it is applied")
    emergency_torque: float = number("-", "1: the generator brakes at an emergency stop")
    derate_rate: float = number("W/s", "of the set-point, for the operator")
    auto_start: float = number("-", "1: starts by itself")
    latching: float = number("-", "1: stops for protection last")
    strategy: float = number("-", "of yaw protection: 0 ignore, 1 stop, 2 derate")
    yaw_latching: float = number("-", "1: its stops last")
    points: float = number("-", "base points, which stand before this section")
    stepwise: float = number("-", "1: stepwise law, 0: interpolated")
    yaw_power: float = number("W", "mechanical, while derated for yaw")
    yaw_rate: float = number("W/s", "of its set-point")
    recheck_time: float = number("s", "of yaw protection")
    follow: float = number("-", "1: the yaw drive is demanded")
    state: float = number("-", "state: number of operation")
    yaw_state: float = number("-", "state: number of yaw protection")
    since: float = number("-", "state: calls in this state of operation")
    yaw_since: float = number("-", "state: calls in this state of yaw protection")
    operator_power: float = number("W", "state: set-point for the operator")
    protected_power: float = number("W", "state: set-point for yaw protection")
    share: float = number("-", "state: of the largest torque that is allowed")
    lowering: float = number("-", "state: 1 while a start lowers the pitch, before the law has it")
    stop_torque: float = number("N m", "state: when the stop began")
    stop_speed: float = number("rad/s", "state: of the generator, when the stop began")
    latched: float = number("-", "state: 1 while a stop lasts")
    word: float = number("-", "state: last word of the operator")
    fresh: float = number("-", 'state: 1 if the operator said "start" since the last stop')
    last_speed: float = number("rad/s", "state: of the generator at the last call")
    last_rotor: float = number("rad/s", "state: of the rotor at the last call")
    frozen: float = number("s", "state: for which the generator's speed has not changed")
    derates: float = number("-", "state: how often yaw protection derated")
    threshold: float = number("rad", "state: of the yaw error")
    gust: float = number("m/s", "state: short mean of the wind")
    wind: float = number("m/s", "state: mean of the wind")
    mean_wind: float = number("m/s", "state: long mean of the wind")
    protection_wind: float = number("m/s", "state: mean of the wind for the threshold")


REFERENCE, MIN_PITCH, LAW_RATE, RATED_POWER, EFFICIENCY, GEAR_RATIO, CONNECT_SPEED, ACCELERATION, START_PITCH = (
    SupervisorState.slots(
        "reference minimum_pitch law_rate rated_power efficiency gear_ratio connect_speed start_acceleration "
        "start_pitch"
    )
)
START_RATIO, LOWERING = SupervisorState.slots("start_ratio lowering")
CONNECT_TIME, FEATHER, BRAKE, BRAKE_SPEED, EMERGENCY_TORQUE, DERATE_RATE, AUTO_START, LATCHING, STRATEGY = (
    SupervisorState.slots(
        "connect_time feather brake brake_speed emergency_torque derate_rate auto_start latching strategy"
    )
)
YAW_LATCHING, POINTS, STEPWISE, YAW_POWER, YAW_POWER_RATE, RECHECK, FOLLOW, STATE, YAW_STATE, SINCE, YAW_SINCE = (
    SupervisorState.slots(
        "yaw_latching points stepwise yaw_power yaw_rate recheck_time follow state yaw_state since yaw_since"
    )
)
OPERATOR_POWER, PROTECTED_POWER, SHARE, STOP_TORQUE, STOP_SPEED, LATCHED, WORD, FRESH, LAST_SPEED, LAST_ROTOR = (
    SupervisorState.slots(
        "operator_power protected_power share stop_torque stop_speed latched word fresh last_speed last_rotor"
    )
)
FROZEN, DERATES, THRESHOLD, GUST, WIND, MEAN_WIND, PROTECTION_WIND = SupervisorState.slots(
    "frozen derates threshold gust wind mean_wind protection_wind"
)
ROOMS = (240, 2400, 600, 2400)
"""Blocks of the means: gust, wind, long, yaw protection; at 80 calls a second samples of 3 and 30 s."""

_N = len(t.CONDITIONS)
LIMIT = len(SupervisorState)
HOLD, COUNT, HOLDS = LIMIT + _N, LIMIT + 2 * _N, LIMIT + 3 * _N
QUANTITY = LIMIT + 4 * _N
JOURNAL = QUANTITY + len(t.Quantities)
_MEAN = JOURNAL + LOG
GUST_MEAN = _MEAN
WIND_MEAN = GUST_MEAN + mean_states(ROOMS[0])
LONG_MEAN = WIND_MEAN + mean_states(ROOMS[1])
PROTECTION_MEAN = LONG_MEAN + mean_states(ROOMS[2])
YAW = PROTECTION_MEAN + mean_states(ROOMS[3])
LENGTH = YAW + vane.LENGTH
"""Places from the beginning of the section on, and how many it has."""

_MEANS = (GUST_MEAN, WIND_MEAN, LONG_MEAN, PROTECTION_MEAN)

Q = {name: QUANTITY + i for i, name in enumerate(t.Quantities.names)}
Q_YAW, Q_PRODUCING, Q_DERATE, Q_STOP, Q_TIME_OVER, Q_STANDING_BY, Q_YAW_STATE, Q_EMERGENCY, Q_STOP_WORD = (
    Q[name]
    for name in "yaw_error producing derate stop time_over standing_by yaw_state emergency_word stop_word".split()
)
Q_MAY_START, Q_GRID, Q_SPEED, Q_DIFFERENCE, Q_FROZEN, Q_GAP, Q_POWER, Q_ACCELERATION, Q_GUST, Q_WIND, Q_MEAN = (
    Q[name]
    for name in "may_start grid speed difference frozen pitch_gap power acceleration gust wind mean_wind".split()
)
Q_START_TIME, Q_SHARE, Q_REGION, Q_FEATHERED = (Q[name] for name in "start_time share region feathered".split())

STANDBY, START_UP, CONNECTION, MAXIMUM_POWER, SPEED_LIMIT, POWER_LIMIT, NORMAL_STOP, EMERGENCY_STOP, IDLING = range(
    1, 10
)
assert [a.name.upper() for a in t.STATES] == (
    "STANDBY START_UP CONNECTION MAXIMUM_POWER SPEED_LIMIT POWER_LIMIT NORMAL_STOP EMERGENCY_STOP IDLING".split()
)
NORMAL, DERATED, SHUTDOWN = (t.YAW_NUMBER[name] for name in ("normal", "derated", "shutdown"))
YAW_LIMIT = LIMIT + t.CONDITION["yaw_exceeded"]
YAW_STOP = t.CONDITION["yaw_shutdown"]
TORQUE_NONE, TORQUE_LAW, TORQUE_JOIN, TORQUE_FALL = range(len(t.TORQUES))
PITCH_LAW, PITCH_SPEED, PITCH_FEATHER = range(len(t.PITCHES))
M_TORQUE, M_PITCH, M_RATE, M_BRAKE, M_YAW = range(t.MODES.shape[1])
WORD_START, WORD_STOP, WORD_EMERGENCY = (s.REQUESTS.index(word) for word in ("start", "normal_stop", "emergency_stop"))
N_CONDITIONS, N_YAW = len(t.CONDITIONS), t.YAW_CONDITIONS
NEVER = 1e30
"""In the place of an infinite limit."""
AHEAD = 5.0
"""[s] of the start's acceleration by which the reference may be ahead of the speed."""


@kernel
def samples(time: float, dt: float) -> int:
    """Calls after which a time [s] has passed: the first one at or after it."""
    n = whole(time / dt)
    return n if n * dt >= time * (1.0 - 1e-9) else n + 1


@kernel
def look(x: Float, at: int, first: int, last: int, dt: float) -> None:
    """Conditions first to last - 1 of the present quantities, with the time for which they have held (C-63)."""
    for c in range(first, last):
        value, limit = x[at + QUANTITY + t.COMPARED[c, 0]], x[at + LIMIT + c]
        true = not (value <= limit) if t.COMPARED[c, 1] > 0 else value < limit
        if true:
            x[at + COUNT + c] += 1.0
        else:
            x[at + COUNT + c] = 0.0
        x[at + HOLDS + c] = 0.0
        if true and whole(x[at + COUNT + c]) > samples(x[at + HOLD + c], dt):
            x[at + HOLDS + c] = 1.0


@kernel
def walk(x: Float, at: int, machine: t.Int, state: int) -> int:
    """The row of the transition that is taken from a state, -1 for none."""
    for row in range(machine.shape[0]):
        if machine[row, t.FROM] != state:
            continue
        taken = True
        for k in range(t.MOST_CONDITIONS):
            c = machine[row, t.FIRST + k]
            if c > 0 and x[at + HOLDS + c - 1] < 0.5:
                taken = False
            if c < 0 and x[at + HOLDS - c - 1] > 0.5:
                taken = False
        if taken:
            return row
    return -1


@kernel
def near(x: Float, at: int, state: int) -> float:
    """How many of the comparisons that could end a state a difference step would change, in derivative runs."""
    found = 0.0
    for row in range(t.MACHINE.shape[0]):
        if t.MACHINE[row, t.FROM] == state and t.REPORTED[t.MACHINE[row, t.LINE]] == 0:
            c = abs(t.MACHINE[row, t.FIRST]) - 1
            found += crossed(x[at + QUANTITY + t.COMPARED[c, 0]] - x[at + LIMIT + c])
    return found


@kernel
def enter(x: Float, at: int, row: int, machine: t.Int, which: int, time: float) -> None:
    """Write a transition into the log: when, which machine, which line, value and limit of its first condition."""
    c = abs(machine[row, t.FIRST]) - 1
    value = x[at + QUANTITY + t.COMPARED[c, 0]]
    write_entry(
        x,
        at + JOURNAL,
        time,
        which,
        machine[row, t.FROM],
        machine[row, t.TO],
        c,
        machine[row, t.FIRST],
        value,
        x[at + LIMIT + c],
    )


@kernel
def law_pitch(x: Float, pitch: float, speed: float) -> None:
    """Set the law to a pitch [rad] and a generator speed [rad/s], so that its next call does not jump (C-66)."""
    schedule = 1.0 / (1.0 + pitch / x[law.HALVING])
    x[law.SPEED], x[law.PITCH] = speed, pitch
    integral = (pitch / schedule - x[law.KP] * (speed - x[law.REFERENCE])) / x[law.KI]
    low, high = x[law.MIN_PITCH] / (schedule * x[law.KI]), x[law.MAX_PITCH] / (schedule * x[law.KI])
    x[law.INTEGRAL] = min(max(integral, low), high)
    for i in range(MAX_BLADES):
        x[inner.LIMITED + inner.LAST + i] = pitch


@kernel
def forget_loops(x: Float) -> None:
    """Integrals of the load loops at nothing, for a new start."""
    for k in range(whole(x[inner.LOOPS])):
        place = inner.FIRST_LOOP + LOOP_STATES * k
        x[place + TILT_AXIS + AXIS_INTEGRAL] = 0.0
        x[place + YAW_AXIS + AXIS_INTEGRAL] = 0.0


@kernel
def region(x: Float, at: int) -> float:
    """Region of the collective law as it is: 3 power limit, 2 speed limit, 1 below (C-67)."""
    speed, setpoint = x[law.SPEED], x[law.RATED_POWER]
    if speed >= x[law.RATED] or (x[law.PITCH] >= x[law.POWER_PITCH] and x[law.PITCH] > x[law.MIN_PITCH]):
        return 3.0
    if x[law.TORQUE] * speed >= 0.999 * setpoint:
        return 3.0
    return 2.0 if speed >= x[law.TRANSITION] else 1.0


@kernel
def quantities(x: Float, at: int, speed: float, twin: float, measured: Float, demands: Float, dt: float) -> None:
    """What conditions compare, from the measurements; of yaw protection's state only what stood before this call."""
    state, blades = whole(x[at + STATE]), whole(measured[s.N_BLADES])
    x[at + Q_YAW] = abs(x[at + YAW + vane.FILTERED])
    x[at + YAW_LIMIT] = x[at + THRESHOLD]
    x[at + Q_PRODUCING] = float(t.CONNECTED[state - 1])
    x[at + Q_DERATE], x[at + Q_STOP] = 0.0, 0.0
    if whole(x[at + STRATEGY]) == 2:
        x[at + Q_DERATE] = 1.0
    if whole(x[at + STRATEGY]) == 1:
        x[at + Q_STOP] = 1.0
    x[at + Q_TIME_OVER], x[at + Q_STANDING_BY] = 0.0, 0.0
    if whole(x[at + YAW_SINCE]) + 1 >= samples(x[at + RECHECK], dt):
        x[at + Q_TIME_OVER] = 1.0
    if state == STANDBY:
        x[at + Q_STANDING_BY] = 1.0
    word = whole(measured[s.REQUEST])
    if word != whole(x[at + WORD]):
        if word == WORD_START:
            x[at + FRESH] = 1.0
        x[at + WORD] = float(word)
    x[at + Q_EMERGENCY], x[at + Q_STOP_WORD], x[at + Q_MAY_START] = 0.0, 0.0, 0.0
    if word == WORD_EMERGENCY:
        x[at + Q_EMERGENCY] = 1.0
    elif word == WORD_STOP:
        x[at + Q_STOP_WORD] = 1.0
    elif x[at + FRESH] > 0.5 or (x[at + LATCHED] < 0.5 and x[at + AUTO_START] > 0.5):
        x[at + Q_MAY_START] = 1.0
    x[at + Q_GRID] = measured[s.GRID]
    x[at + Q_SPEED] = speed
    if twin > speed:
        x[at + Q_SPEED] = twin
    x[at + Q_DIFFERENCE] = abs(measured[s.GENERATOR_SPEED] - x[at + GEAR_RATIO] * measured[s.ROTOR_SPEED])
    if measured[s.GENERATOR_SPEED] == x[at + LAST_SPEED] and measured[s.ROTOR_SPEED] != x[at + LAST_ROTOR]:
        x[at + FROZEN] += dt
    else:
        x[at + FROZEN] = 0.0
    x[at + LAST_SPEED], x[at + LAST_ROTOR] = measured[s.GENERATOR_SPEED], measured[s.ROTOR_SPEED]
    x[at + Q_FROZEN] = x[at + FROZEN]
    x[at + Q_GAP] = 0.0
    x[at + Q_FEATHERED] = demands[s.PITCH_DEMAND]
    for i in range(blades):
        gap = abs(demands[s.PITCH_DEMAND + i] - measured[s.PITCH + i])
        if not (gap <= x[at + Q_GAP]):
            x[at + Q_GAP] = gap
        if demands[s.PITCH_DEMAND + i] < x[at + Q_FEATHERED]:
            x[at + Q_FEATHERED] = demands[s.PITCH_DEMAND + i]
    x[at + Q_POWER] = measured[s.POWER]
    a, b = measured[s.FORE_AFT_ACCELERATION], measured[s.SIDE_SIDE_ACCELERATION]
    x[at + Q_ACCELERATION] = sqrt(a * a + b * b)
    x[at + Q_GUST], x[at + Q_WIND], x[at + Q_MEAN] = x[at + GUST], x[at + WIND], x[at + MEAN_WIND]
    x[at + Q_START_TIME] = x[at + SINCE] * dt
    x[at + Q_SHARE] = 0.0
    if x[law.SPEED] >= x[law.RATED] or x[law.PITCH] < x[law.POWER_PITCH] or x[law.PITCH] <= x[law.MIN_PITCH]:
        x[at + Q_SHARE] = x[at + SHARE]
    x[at + Q_REGION] = region(x, at)


@kernel
def approach(value: float, target: float, step: float) -> float:
    """The value moved towards a target by at most a step."""
    return min(max(target, value - step), value + step)


@kernel
def set_point(x: Float, at: int, measured: Float, dt: float) -> None:
    """Set-points of the power for operator and yaw protection, each with its own rate (C-65)."""
    rated = x[at + RATED_POWER]
    wanted = min(rated, max(measured[s.POWER_LIMIT], 0.0) / x[at + EFFICIENCY])
    x[at + OPERATOR_POWER] = approach(x[at + OPERATOR_POWER], wanted, x[at + DERATE_RATE] * dt)
    wanted = 1.0 * rated
    if whole(x[at + YAW_STATE]) == DERATED:
        wanted = min(rated, x[at + YAW_POWER])
    x[at + PROTECTED_POWER] = approach(x[at + PROTECTED_POWER], wanted, x[at + YAW_POWER_RATE] * dt)
    power = min(x[at + OPERATOR_POWER], x[at + PROTECTED_POWER])
    # written where it differs, so that derivatives by the law's own entries stay
    if power != x[law.RATED_POWER]:
        x[law.RATED_POWER] = power


@kernel
def begin_state(x: Float, at: int, state: int, speed: float, demands: Float, blades: int) -> None:
    """What happens once when a state of operation begins."""
    x[at + SINCE] = 0.0
    if state == START_UP:
        x[at + SHARE], x[law.TORQUE], x[at + LATCHED], x[at + FRESH] = 0.0, 0.0, 0.0, 0.0
        mean = 0.0 * speed
        for i in range(blades):
            mean = mean + demands[s.PITCH_DEMAND + i] / blades
        x[law.REFERENCE] = min(max(speed, 0.0), x[at + REFERENCE])
        law_pitch(x, mean, speed)
        x[at + LOWERING] = 1.0
        forget_loops(x)
    if state == CONNECTION:
        x[law.TORQUE] = 0.0
    if state in (NORMAL_STOP, EMERGENCY_STOP):
        x[at + STOP_TORQUE], x[at + STOP_SPEED], x[at + FRESH] = demands[s.GENERATOR_TORQUE], speed, 0.0
    if state == STANDBY:
        x[at + LATCHED] = 0.0


@kernel
def start_law(x: Float, at: int, state: int, speed: float, dt: float) -> None:
    """Knobs of the collective law while it starts: reference and lowest pitch follow the speed (C-66)."""
    step = x[at + ACCELERATION] * dt
    ahead = max(speed, 0.0) + AHEAD * x[at + ACCELERATION]
    x[law.REFERENCE] = min(max(min(x[law.REFERENCE] + step, ahead), 0.0), x[at + REFERENCE])
    fine = min(x[at + CONNECT_SPEED], x[at + START_RATIO] * max(x[at + WIND], 1.0))
    left = min(max(1.0 - speed / fine, 0.0), 1.0)
    x[law.MIN_PITCH] = x[at + MIN_PITCH] + left * max(x[at + START_PITCH] - x[at + MIN_PITCH], 0.0)
    x[law.PITCH_RATE] = x[at + LAW_RATE + t.MODES[state - 1, M_RATE]]


@kernel
def lower(x: Float, at: int, speed: float, measured: Float, demands: Float, dt: float) -> None:
    """Lower the pitch until the rotor has its reference speed or the pitch is lowest; then the law has it (C-66)."""
    pitch = max(x[law.PITCH] - x[law.PITCH_RATE] * dt, x[law.MIN_PITCH])
    if speed >= x[law.REFERENCE] or pitch <= x[law.MIN_PITCH]:
        x[at + LOWERING] = 0.0
    law_pitch(x, pitch, speed)
    for i in range(whole(measured[s.N_BLADES])):
        demands[s.PITCH_DEMAND + i] = pitch


@kernel
def usual_law(x: Float, at: int, dt: float) -> None:
    """The knobs back where they belong; nothing is written where nothing differs."""
    if x[law.REFERENCE] < x[at + REFERENCE]:
        x[law.REFERENCE] = min(x[law.REFERENCE] + x[at + ACCELERATION] * dt, x[at + REFERENCE])
    if x[law.MIN_PITCH] != x[at + MIN_PITCH]:
        x[law.MIN_PITCH] = x[at + MIN_PITCH]
    if x[law.PITCH_RATE] != x[at + LAW_RATE]:
        x[law.PITCH_RATE] = x[at + LAW_RATE]


@kernel
def limit_torque(x: Float, most: float, demands: Float) -> None:
    """Torque demand and the law's memory of it within a limit [N m]."""
    x[law.SWITCHES] += crossed(x[law.TORQUE] - most)
    x[law.TORQUE] = min(x[law.TORQUE], most)
    demands[s.GENERATOR_TORQUE] = x[law.TORQUE]


@kernel
def produce(x: Float, at: int, state: int, measured: Float, demands: Float, dt: float) -> None:
    """States whose pitch is the law's."""
    mode = t.MODES[state - 1, M_TORQUE]
    if mode == TORQUE_LAW:
        usual_law(x, at, dt)
        inner.update(x, measured, demands, dt)
        if x[law.RATED_POWER] < x[at + RATED_POWER]:
            limit_torque(x, x[law.RATED_POWER] / max(x[law.SPEED], 1e-3), demands)
        return
    speed = measured[s.GENERATOR_SPEED]
    start_law(x, at, state, x[law.SPEED], dt)
    if x[at + LOWERING] > 0.5 and mode == TORQUE_NONE:
        lower(x, at, speed, measured, demands, dt)
    else:
        law.law(x, speed, measured, demands, dt)
    for i in range(MAX_BLADES):
        x[inner.LIMITED + inner.LAST + i] = x[law.PITCH]
    if mode == TORQUE_JOIN:
        x[at + SHARE] = min(x[at + SHARE] + dt / x[at + CONNECT_TIME], 1.0)
        # below rated speed the torque of the regions: held power would stop the rotor that is to speed up
        most = min(law_torque(x, x[law.SPEED]), x[law.RATED_POWER] / max(x[law.SPEED], 1e-3))
        limit_torque(x, min(x[at + SHARE] * x[law.MAX_TORQUE], most), demands)
    else:
        x[law.TORQUE] = 0.0
        demands[s.GENERATOR_TORQUE] = 0.0


@kernel
def rest(x: Float, at: int, state: int, speed: float, twin: float, measured: Float, demands: Float, dt: float) -> None:
    """States that pitch to feather: torque falls with speed, or there is none (C-68).

    Of the two sensors of speed the lower one counts for the torque, the higher one for the brake: one that is stuck can
    neither drive the rotor backwards nor brake it at full speed.
    """
    mode, blades = t.MODES[state - 1, M_TORQUE], whole(measured[s.N_BLADES])
    keep = 1.0 - exp(-dt * x[law.FILTER])
    x[law.SPEED] = x[law.SPEED] + keep * (speed - x[law.SPEED])
    wanted = 0.0 * speed
    if mode == TORQUE_FALL and x[at + STOP_SPEED] > x[at + CONNECT_SPEED]:
        share = (min(speed, twin) - x[at + CONNECT_SPEED]) / (x[at + STOP_SPEED] - x[at + CONNECT_SPEED])
        wanted = x[at + STOP_TORQUE] * min(max(share, 0.0), 1.0)
    if state == EMERGENCY_STOP and x[at + EMERGENCY_TORQUE] < 0.5:
        wanted = 0.0 * wanted
    x[law.TORQUE] = approach(demands[s.GENERATOR_TORQUE], wanted, x[law.TORQUE_RATE] * dt)
    demands[s.GENERATOR_TORQUE] = x[law.TORQUE]
    step, mean = x[at + LAW_RATE + t.MODES[state - 1, M_RATE]] * dt, 0.0 * speed
    for i in range(blades):
        demands[s.PITCH_DEMAND + i] = approach(demands[s.PITCH_DEMAND + i], x[at + FEATHER], step)
        mean = mean + demands[s.PITCH_DEMAND + i] / blades
    x[law.PITCH] = mean
    demands[s.BRAKE] = 0.0
    if t.MODES[state - 1, M_BRAKE] > 0 and max(speed, twin) < x[at + BRAKE_SPEED]:
        demands[s.BRAKE] = x[at + BRAKE]


@kernel
def protect(x: Float, at: int, time: float, dt: float) -> None:
    """One step of the machine of yaw protection (C-64)."""
    look(x, at, 0, N_YAW, dt)
    x[at + YAW_SINCE] += 1.0
    row = walk(x, at, t.YAW_MACHINE, whole(x[at + YAW_STATE]))
    if row >= 0:
        enter(x, at, row, t.YAW_MACHINE, 1, time)
        x[at + YAW_STATE] = float(t.YAW_MACHINE[row, t.TO])
        x[at + YAW_SINCE] = 0.0
        if t.YAW_MACHINE[row, t.TO] == DERATED:
            x[at + DERATES] += 1.0
    x[at + Q_YAW_STATE] = x[at + YAW_STATE]


@kernel
def operate(x: Float, at: int, speed: float, demands: Float, blades: int, time: float, dt: float) -> None:
    """One step of the machine of operation (C-63)."""
    look(x, at, N_YAW, N_CONDITIONS, dt)
    x[at + SINCE] += 1.0
    state = whole(x[at + STATE])
    x[law.SWITCHES] += near(x, at, state)
    row = walk(x, at, t.MACHINE, state)
    if row < 0:
        return
    enter(x, at, row, t.MACHINE, 0, time)
    state = t.MACHINE[row, t.TO]
    x[at + STATE] = float(state)
    begin_state(x, at, state, speed, demands, blades)
    if state in (NORMAL_STOP, EMERGENCY_STOP):
        c = abs(t.MACHINE[row, t.FIRST]) - 1
        lasting = x[at + YAW_LATCHING] if c == YAW_STOP else x[at + LATCHING] * t.LATCHES[c]
        x[at + LATCHED] = max(x[at + LATCHED], lasting)


@kernel
def update(x: Float, measured: Float, demands: Float, dt: float) -> None:
    """One call of the supervised controller (C-60 to C-68)."""
    at, blades, time = x.shape[0] - LENGTH, whole(measured[s.N_BLADES]), measured[s.TIME]
    # a sensor that gives no number is lost: its twin stands in for it until the stop that follows
    speed, twin = measured[s.GENERATOR_SPEED], x[at + GEAR_RATIO] * measured[s.ROTOR_SPEED]
    lost = speed != speed
    if lost:
        speed = twin
    wind = measured[s.WIND_SPEED]
    x[at + GUST] = moving_mean(x, at + GUST_MEAN, wind, dt)
    x[at + WIND] = moving_mean(x, at + WIND_MEAN, wind, dt)
    x[at + MEAN_WIND] = moving_mean(x, at + LONG_MEAN, wind, dt)
    yaw_rate = yaw_step(x, at + YAW, measured, dt)
    points = whole(x[at + POINTS])
    x[at + THRESHOLD] = NEVER
    if points > 0:
        x[at + PROTECTION_WIND] = moving_mean(x, at + PROTECTION_MEAN, wind, dt)
        x[at + THRESHOLD] = threshold(x, at - 2 * points, points, x[at + STEPWISE], x[at + PROTECTION_WIND])
    quantities(x, at, speed, twin, measured, demands, dt)
    protect(x, at, time, dt)
    operate(x, at, speed, demands, blades, time, dt)
    set_point(x, at, measured, dt)
    if lost:
        measured[s.GENERATOR_SPEED] = speed
    state = whole(x[at + STATE])
    if t.MODES[state - 1, M_PITCH] == PITCH_FEATHER:
        rest(x, at, state, speed, twin, measured, demands, dt)
    else:
        produce(x, at, state, measured, demands, dt)
        demands[s.BRAKE] = 0.0
    if measured[s.GRID] < 0.5:
        x[law.TORQUE] = 0.0
        demands[s.GENERATOR_TORQUE] = 0.0
    demands[s.YAW_RATE_DEMAND] = 0.0
    if x[at + FOLLOW] > 0.5 and t.MODES[state - 1, M_YAW] > 0 and measured[s.GRID] > 0.5:
        demands[s.YAW_RATE_DEMAND] = yaw_rate
    demands[s.OPERATING_STATE] = x[at + STATE]
    demands[s.POWER_SETPOINT] = x[law.RATED_POWER] * x[at + EFFICIENCY]
    demands[s.YAW_ERROR] = x[at + YAW + vane.FILTERED]
    demands[s.YAW_THRESHOLD] = 0.0
    if points > 0:
        demands[s.YAW_THRESHOLD] = x[at + THRESHOLD]
    x[law.SWITCHES] += x[at + YAW + vane.SWITCHES]
    x[at + YAW + vane.SWITCHES] = 0.0


def supervised(
    turbine: AnyTurbine,
    settings: Supervision | None = None,
    *,
    load: LoadControl | None = None,
    yaw: YawControl | None = None,
    protection: YawProtection | None = None,
    sample_time: float | None = None,
    name: str = "supervised",
) -> Controller:
    """A controller that starts and stops the turbine, protects it, derates it and turns it into the wind.

    Args:
      turbine: gives the collective law, cut-in and cut-out, and the limits of the actuators.
      settings: of the supervisor; by default those that follow from the turbine.
      load: of the load controller that works in production; none leaves the collective law.
      yaw: of the yaw control; without it the nacelle is not turned. The model then needs ``yaw="driven"``.
      protection: against yaw errors; none by default.
      sample_time: [s] between calls; by default every time step.
      name: for messages.

    Returns:
      The controller. ``Result.log`` has its transitions, channel ``operating_state`` the number of its state.

    Raises:
      InputError: settings that contradict each other or the turbine.
    """
    settings = settings or Supervision()
    numbers = limits(turbine, settings)
    work = load_control(turbine, load, sample_time=sample_time, name=name)
    section = _section(turbine, settings, numbers, yaw, protection)
    points = np.zeros(0)
    if protection is not None:
        points = np.concatenate([protection.wind_speeds, protection.thresholds])

    def init(start: StartPoint) -> Float:
        x = np.concatenate([work.init(start), points, section])
        at = len(x) - LENGTH
        x[at + STATE] = _first_state(turbine, settings, numbers, start)
        x[at + LATCHED] = float(settings.begin == "idling")
        x[at + SHARE] = float(x[at + STATE] >= CONNECTION)
        x[at + WORD] = -1.0
        windows = [numbers[window] for window in ("gust_window", "wind_window", "mean_window")]
        windows.append(30.0 if protection is None else protection.window)
        mean = start.wind_speed if start.mean_wind is None else start.mean_wind
        for place, window, room in zip(_MEANS, windows, ROOMS, strict=True):
            mean_start(x, at + place, window, room, before=mean)
        return x

    names: tuple[str, ...] = ()
    if work.state_names:
        names = (*work.state_names, *(f"yaw_point_{i + 1}" for i in range(len(points))), *_names())
    return Controller(
        update=update,
        init=init,
        sample_time=sample_time,
        name=name,
        yaws=yaw is not None,
        state_names=names,
        warnings=lambda x: [*(work.warnings(x) if work.warnings is not None else ()), *_crowded(x)],
        log=_log,
    )


def _log(x: Float) -> Sequence[LogEntry]:
    return log_entries(x[len(x) - LENGTH + JOURNAL :])


def _crowded(x: Float) -> list[str]:
    written = int(x[len(x) - LENGTH + JOURNAL])
    if written <= LOG_ROOM:
        return []
    return [f"supervisor: {written} transitions, of which the log has the first {LOG_ROOM}: limits that lie too close?"]


def _first_state(turbine: AnyTurbine, settings: Supervision, numbers: dict[str, float], start: StartPoint) -> int:
    """Number of the state in which a run begins."""
    torque = turbine.control.torque
    if settings.begin != "automatic":
        return t.NUMBER[settings.begin]
    if start.generator_speed < 0.9 * numbers["connect_speed"]:
        return STANDBY
    if start.generator_speed >= torque.rated_speed or start.pitch >= max(torque.power_pitch, 1e-3):
        return POWER_LIMIT
    view = View(law.BaselineState, law.parameters(turbine.control))
    return SPEED_LIMIT if start.generator_speed >= float(view["transition_speed"]) else MAXIMUM_POWER


def _section(
    turbine: AnyTurbine,
    settings: Supervision,
    numbers: dict[str, float],
    yaw: YawControl | None,
    protection: YawProtection | None,
) -> Float:
    """The supervisor's part of the state vector, at its beginning."""
    control, drivetrain = turbine.control, turbine.drivetrain
    x = np.zeros(LENGTH)
    view = View(SupervisorState, x[: len(SupervisorState)])
    view["reference"], view["law_rate"] = control.pitch.reference_speed, control.pitch.rate_limit
    view["minimum_pitch"] = control.pitch.minimum
    names = "start_rate normal_rate emergency_rate connect_speed start_acceleration start_pitch connect_time feather"
    for name in f"{names} brake brake_speed".split():
        view[name] = numbers[name]
    rated = control.torque.rated_power
    view["rated_power"] = view["operator_power"] = view["protected_power"] = rated
    view["efficiency"], view["gear_ratio"] = drivetrain.generator_efficiency, drivetrain.gear_ratio
    view["start_ratio"] = settings.start_ratio * drivetrain.gear_ratio / turbine.rotor_radius
    view["emergency_torque"], view["derate_rate"] = settings.emergency_torque, settings.derate_rate * rated
    view["auto_start"], view["latching"], view["follow"] = settings.auto_start, settings.latched, yaw is not None
    view["yaw_state"], view["yaw_rate"] = NORMAL, settings.derate_rate * rated
    if protection is not None:
        most = turbine.rated_power if protection.power_limit is None else protection.power_limit
        share = 2.0 / 3.0 if protection.power_limit is None else 1.0
        if protection.power_limit is not None and most >= numbers["rated_power"]:
            raise InputError(
                f"yaw protection: power_limit {most:g} W is no limit for a turbine of {numbers['rated_power']:g} W"
            )
        view["strategy"] = STRATEGIES.index(protection.strategy)
        view["yaw_latching"], view["points"] = protection.latched, len(protection.wind_speeds)
        view["stepwise"] = protection.law == "stepwise"
        view["yaw_power"] = share * most / drivetrain.generator_efficiency
        view["yaw_rate"], view["recheck_time"] = protection.derate_rate * rated, protection.recheck_time
    for i, condition in enumerate(t.CONDITIONS):
        x[LIMIT + i] = 0.0 if condition.limit == "yaw_threshold" else _number(condition.limit, numbers)
        x[HOLD + i] = _number(condition.hold, numbers)
    x[YAW:LENGTH] = yaw_settings(yaw or YawControl(), turbine.yaw)
    if protection is not None:
        x[YAW + vane.FILTER_TIME] = protection.filter_time
    return x


def _number(text: str, numbers: dict[str, float]) -> float:
    return numbers[text] if text in numbers else float(text)


def _names() -> list[str]:
    """Of the entries of the section."""
    names = list(SupervisorState.names)
    for what in ("limit", "hold", "count", "holds"):
        names += [f"{what}_{condition.name}" for condition in t.CONDITIONS]
    names += [f"now_{name}" for name in t.Quantities.names]
    names += ["entries", *(f"entry_{i + 1}_{name}" for i in range(LOG_ROOM) for name in EntryRow.names)]
    for what, room in zip(("gust", "wind", "mean_wind", "protection_wind"), ROOMS, strict=True):
        names += [f"{what}_{i}" for i in range(mean_states(room))]
    return [f"supervisor_{name}" for name in names] + [f"yaw_{name}" for name in vane.YawControlState.names]
