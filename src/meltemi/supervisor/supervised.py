"""Supervised controller: start, stop, protection and derating around load control.

Each call: means of the wind and the yaw control; the quantities; the conditions, each with the time for which it has
held; the machine of yaw protection, then that of operation; then what the state asks for. In production load control
is unchanged while the power is not limited. The supervisor sets parameters of the collective law: its
reference speed (which rises during a start), its minimum pitch, its pitch rate, and its rated power, which is the
set-point. Stops pitch each blade from its present angle; a start sets the integral of the law for a bumpless
transition. One module, in the order of a call.

Reference: docs/theory/control.md (C-60 to C-68).
"""

from __future__ import annotations

from math import exp, sqrt
from typing import NamedTuple

from numpy import float64
from numpy.typing import NDArray

from meltemi.compiler import MAX_BLADES, Numbers, Table, crossed, kernel, number, numbers, part, whole
from meltemi.control.baseline import BaselineState, law_torque, parameters
from meltemi.control.baseline import law as collective_step
from meltemi.control.controller import Controller, StartPoint
from meltemi.control.signals import REQUESTS, Demands, Measurements
from meltemi.control_laws.load_control import (
    PITCH,
    LoadControl,
    LoadController,
    LoadControlState,
    limit_warnings,
    load_step,
)
from meltemi.control_laws.machine import FIRST, FROM, LINE, TO, Int, transition
from meltemi.control_laws.moving_mean import MovingMean, mean_start, moving_mean
from meltemi.control_laws.yaw import YawControl, YawControlState, yaw_settings, yaw_step
from meltemi.core.errors import InputError
from meltemi.supervisor import tables as t
from meltemi.supervisor.log import LOG_ROOM, Log, log_entries, new_entry
from meltemi.supervisor.settings import Supervision, limits
from meltemi.supervisor.threshold import (
    STRATEGIES,
    YawProtection,
    YawThreshold,
    threshold,
    threshold_settings,
)
from meltemi.turbine.power_turbine import AnyTurbine

Float = NDArray[float64]


class MachineState(Table):
    """State of a machine."""

    state: float = number("-", "state: number")
    since: float = number("-", "state: calls in this state")


class SupervisorState(Table, title="supervisor"):
    """Settings and state."""

    reference: float = number("rad/s", "reference speed of the pitch loop, of the generator")
    minimum_pitch: float = number("rad", "minimum pitch of the collective law")
    rate: Numbers = numbers("rad/s", "pitch rates", t.RATES)
    rated_power: float = number("W", "rated mechanical power of the law")
    efficiency: float = number("-", "efficiency of the generator")
    gear_ratio: float = number("-", "generator speed over rotor speed")
    connect_speed: float = number("rad/s", "speed at which the generator connects and a stop ends the torque")
    start_acceleration: float = number("rad/s^2", "acceleration of the reference speed during a start")
    start_pitch: float = number("rad", "lowest pitch at standstill")
    start_ratio: float = number("rad/m", "generator speed over wind speed from which the law may use its minimum pitch")
    connect_time: float = number("s", "time in which the torque limit rises after the connection")
    feather: float = number("rad", "pitch at rest")
    brake: float = number("-", "share of the full brake torque")
    brake_speed: float = number("rad/s", "speed below which the brake is applied")
    emergency_torque: float = number("-", "1: the generator brakes at an emergency stop")
    derate_rate: float = number("W/s", "rate limit of the operator's set-point")
    auto_start: float = number("-", "1: starts without a request")
    latching: float = number("-", "1: stops for protection last until a request")
    strategy: float = number("-", "strategy of yaw protection: 0 ignore, 1 stop, 2 derate")
    yaw_latching: float = number("-", "1: stops of yaw protection last until a request")
    yaw_power: float = number("W", "mechanical power while derated for yaw")
    yaw_rate: float = number("W/s", "rate limit of the set-point of yaw protection")
    recheck_time: float = number("s", "time of yaw protection from derating to the recheck")
    follow: float = number("-", "1: the yaw drive is demanded")
    operation: MachineState = part(MachineState, "operation", prefix="")
    protection: MachineState = part(MachineState, "yaw protection", prefix="yaw")
    operator_power: float = number("W", "state: set-point for the operator")
    protected_power: float = number("W", "state: set-point for yaw protection")
    share: float = number("-", "state: permitted share of the largest torque")
    lowering: float = number("-", "state: 1 while a start lowers the pitch, before the law has it")
    stop_torque: float = number("N m", "state: when the stop began")
    stop_speed: float = number("rad/s", "state: of the generator, when the stop began")
    latched: float = number("-", "state: 1 while a stop lasts until a request")
    last_request: float = number("-", "state: last operator request")
    start_requested: float = number("-", 'state: 1 if the operator requested "start" since the last stop')
    last_speed: float = number("rad/s", "state: generator speed at the last call")
    last_rotor: float = number("rad/s", "state: rotor speed at the last call")
    frozen: float = number("s", "state: time since the last change of the measured generator speed")
    derates: float = number("-", "state: number of deratings by yaw protection")
    threshold: float = number("rad", "state: threshold of the yaw error")
    gust: float = number("m/s", "state: short mean of the wind")
    wind: float = number("m/s", "state: mean of the wind")
    mean_wind: float = number("m/s", "state: long mean of the wind")
    protection_wind: float = number("m/s", "state: mean of the wind for the threshold")

    limit: Numbers = numbers("-", "limits of the conditions", t.CONDITION)
    hold: Numbers = numbers("s", "time for which a condition has to hold", t.CONDITION)
    count: Numbers = numbers("-", "calls for which a condition has held", t.CONDITION)
    holds: Numbers = numbers("-", "1 where a condition has held for this time", t.CONDITION)
    now: t.Quantities = part(t.Quantities, "what conditions compare")
    log: Log = part(Log, "transitions")


class SupervisedState(Table, title="supervised controller"):
    """State of the supervisor, of load control and of yaw control."""

    supervisor: SupervisorState = part(SupervisorState, "supervisor")
    yaw: YawControlState = part(YawControlState, "yaw control")
    load: LoadControlState = part(LoadControlState, "in production", prefix="")
    protection: YawThreshold = part(YawThreshold, "against yaw errors")
    gust_mean: MovingMean = part(MovingMean, "short mean of the wind")
    wind_mean: MovingMean = part(MovingMean, "mean of the wind")
    long_mean: MovingMean = part(MovingMean, "long mean of the wind")
    protection_mean: MovingMean = part(MovingMean, "mean of the wind for the threshold")


class Call(NamedTuple):
    """One call of the controller.

    Attributes:
      speed: [rad/s] generator speed by its sensor, or by that of the rotor where this gives no number.
      twin: [rad/s] generator speed by the sensor of the rotor.
      blades: number of blades.
      dt: [s] since the last call.
    """

    measured: Measurements
    demands: Demands
    speed: float
    twin: float
    blades: int
    dt: float


ROOMS = (240, 2400, 600, 2400)
"""Blocks of the means: gust, wind, long, yaw protection; at 80 calls a second samples of 3 and 30 s."""

STANDBY, START_UP, CONNECTION, MAXIMUM_POWER, SPEED_LIMIT, POWER_LIMIT, NORMAL_STOP, EMERGENCY_STOP, IDLING = range(
    1, 10
)
assert [a.name.upper() for a in t.STATES] == (
    "STANDBY START_UP CONNECTION MAXIMUM_POWER SPEED_LIMIT POWER_LIMIT NORMAL_STOP EMERGENCY_STOP IDLING".split()
)
NORMAL, DERATED, SHUTDOWN = (t.YAW_NUMBER[name] for name in ("normal", "derated", "shutdown"))
YAW_EXCEEDED = t.CONDITION["yaw_exceeded"]
YAW_STOP = t.CONDITION["yaw_shutdown"]
TORQUE_NONE, TORQUE_LAW, TORQUE_JOIN, TORQUE_FALL = range(len(t.TORQUES))
PITCH_LAW, PITCH_SPEED, PITCH_FEATHER = range(len(t.PITCHES))
RATE_LAW = t.RATES.index("law")
OPERATION, YAW_PROTECTION = range(2)
"""Machines, as the log numbers them."""
M_TORQUE, M_PITCH, M_RATE, M_BRAKE, M_YAW = range(t.MODES.shape[1])
REQUEST_START, REQUEST_STOP, REQUEST_EMERGENCY = map(REQUESTS.index, ("start", "normal_stop", "emergency_stop"))
N_CONDITIONS, N_YAW = len(t.CONDITIONS), t.YAW_CONDITIONS
NEVER = 1e30
"""Number in place of an infinite limit."""
AHEAD = 5.0
"""[s] longest lead of the reference over the speed during a start, in time of its acceleration."""


@kernel
def samples(time: float, dt: float) -> int:
    """Number of calls after which a time [s] has passed."""
    n = whole(time / dt)
    return n if n * dt >= time * (1.0 - 1e-9) else n + 1


@kernel
def evaluate_conditions(supervisor: SupervisorState, first: int, last: int, dt: float) -> None:
    """Evaluate conditions first to last - 1, with the time for which they have held (C-63)."""
    for c in range(first, last):
        value, limit = supervisor.now.array[t.COMPARED[c, 0]], supervisor.limit[c]
        true = not (value <= limit) if t.COMPARED[c, 1] > 0 else value < limit
        if true:
            supervisor.count[c] += 1.0
        else:
            supervisor.count[c] = 0.0
        supervisor.holds[c] = 0.0
        if true and whole(supervisor.count[c]) > samples(supervisor.hold[c], dt):
            supervisor.holds[c] = 1.0


@kernel
def switches_near(supervisor: SupervisorState, state: int) -> float:
    """Number of conditions that end a state within the difference step of a parameter, in derivative runs."""
    crossings = 0.0
    for row in range(t.MACHINE.shape[0]):
        if t.MACHINE[row, FROM] == state and t.REPORTED[t.MACHINE[row, LINE]] == 0:
            c = abs(t.MACHINE[row, FIRST]) - 1
            crossings += crossed(supervisor.now.array[t.COMPARED[c, 0]] - supervisor.limit[c])
    return crossings


@kernel
def log_transition(supervisor: SupervisorState, machine: Int, row: int, which: int, time: float) -> None:
    """Log a transition with value and limit of its first condition."""
    n = new_entry(supervisor.log)
    if n < 0:
        return
    entry, c = supervisor.log.entry[n], abs(machine[row, FIRST]) - 1
    entry.time, entry.machine = time, float(which)
    entry.source, entry.target = float(machine[row, FROM]), float(machine[row, TO])
    entry.condition, entry.holds = float(c), float(machine[row, FIRST])
    entry.value, entry.limit = supervisor.now.array[t.COMPARED[c, 0]], supervisor.limit[c]


@kernel
def step_machine(supervisor: SupervisorState, at: MachineState, machine: Int, which: int, time: float) -> int:
    """Step of a state machine: the row of its transition, -1 for none (C-63)."""
    at.since += 1.0
    row = transition(machine, whole(at.state), supervisor.holds)
    if row >= 0:
        log_transition(supervisor, machine, row, which, time)
        at.state, at.since = float(machine[row, TO]), 0.0
    return row


@kernel
def set_collective(x: LoadControlState, pitch: float, speed: float) -> None:
    """Set the collective law to a pitch [rad] and a generator speed [rad/s], without a jump at its next call (C-66)."""
    law = x.collective
    schedule = 1.0 / (1.0 + pitch / law.gain_halving_pitch)
    law.speed, law.pitch = speed, pitch
    integral = (pitch / schedule - law.proportional_gain * (speed - law.reference_speed)) / law.integral_gain
    low, high = law.minimum_pitch / (schedule * law.integral_gain), law.maximum_pitch / (schedule * law.integral_gain)
    law.integral = min(max(integral, low), high)
    for b in range(MAX_BLADES):
        x.group[PITCH].last[b] = pitch


@kernel
def reset_loops(x: LoadControlState) -> None:
    """Reset the integrals of the load loops for a new start."""
    for k in range(whole(x.loop_count)):
        x.loop[k].tilt_axis.integral = 0.0
        x.loop[k].yaw_axis.integral = 0.0


@kernel
def region(law: BaselineState) -> float:
    """Region of the collective law: 3 power limit, 2 speed limit, 1 below (C-67)."""
    speed, setpoint = law.speed, law.rated_power
    if speed >= law.rated_speed or (law.pitch >= law.power_pitch and law.pitch > law.minimum_pitch):
        return 3.0
    if law.torque * speed >= 0.999 * setpoint:
        return 3.0
    return 2.0 if speed >= law.transition_speed else 1.0


@kernel
def quantities(x: SupervisedState, call: Call) -> None:  # noqa: C901 - one line of conditions after the other
    """Quantities of the conditions from the measurements, with the state of yaw protection before this call."""
    supervisor, law, now = x.supervisor, x.load.collective, x.supervisor.now
    measured, demands = call.measured, call.demands
    state = whole(supervisor.operation.state)
    now.yaw_error = abs(x.yaw.filtered)
    supervisor.limit[YAW_EXCEEDED] = supervisor.threshold
    now.producing = float(t.CONNECTED[state - 1])
    now.derate, now.stop = 0.0, 0.0
    if whole(supervisor.strategy) == 2:
        now.derate = 1.0
    if whole(supervisor.strategy) == 1:
        now.stop = 1.0
    now.time_over, now.standing_by = 0.0, 0.0
    if whole(supervisor.protection.since) + 1 >= samples(supervisor.recheck_time, call.dt):
        now.time_over = 1.0
    if state == STANDBY:
        now.standing_by = 1.0
    request = whole(measured.request)
    if request != whole(supervisor.last_request):
        if request == REQUEST_START:
            supervisor.start_requested = 1.0
        supervisor.last_request = float(request)
    now.emergency_request, now.stop_request, now.may_start = 0.0, 0.0, 0.0
    if request == REQUEST_EMERGENCY:
        now.emergency_request = 1.0
    elif request == REQUEST_STOP:
        now.stop_request = 1.0
    elif supervisor.start_requested > 0.5 or (supervisor.latched < 0.5 and supervisor.auto_start > 0.5):
        now.may_start = 1.0
    now.grid = measured.grid
    now.speed = call.speed
    if call.twin > call.speed:
        now.speed = call.twin
    now.difference = abs(measured.generator_speed - supervisor.gear_ratio * measured.rotor_speed)
    if measured.generator_speed == supervisor.last_speed and measured.rotor_speed != supervisor.last_rotor:
        supervisor.frozen += call.dt
    else:
        supervisor.frozen = 0.0
    supervisor.last_speed, supervisor.last_rotor = measured.generator_speed, measured.rotor_speed
    now.frozen = supervisor.frozen
    now.pitch_gap = 0.0
    now.feathered = demands.pitch[0]
    for b in range(call.blades):
        gap = abs(demands.pitch[b] - measured.pitch[b])
        if not (gap <= now.pitch_gap):
            now.pitch_gap = gap
        if demands.pitch[b] < now.feathered:
            now.feathered = demands.pitch[b]
    now.power = measured.power
    along, aside = measured.fore_aft_acceleration, measured.side_side_acceleration
    now.acceleration = sqrt(along * along + aside * aside)
    now.gust, now.wind, now.mean_wind = supervisor.gust, supervisor.wind, supervisor.mean_wind
    now.start_time = supervisor.operation.since * call.dt
    now.share = 0.0
    if law.speed >= law.rated_speed or law.pitch < law.power_pitch or law.pitch <= law.minimum_pitch:
        now.share = supervisor.share
    now.region = region(law)


@kernel
def approach(value: float, target: float, step: float) -> float:
    """The value moved towards a target by at most a step."""
    return min(max(target, value - step), value + step)


@kernel
def set_point(x: SupervisedState, call: Call) -> None:
    """Set-points of the power for operator and yaw protection, with separate rates (C-65)."""
    supervisor, law = x.supervisor, x.load.collective
    rated = supervisor.rated_power
    wanted = min(rated, max(call.measured.power_limit, 0.0) / supervisor.efficiency)
    supervisor.operator_power = approach(supervisor.operator_power, wanted, supervisor.derate_rate * call.dt)
    wanted = rated
    if whole(supervisor.protection.state) == DERATED:
        wanted = min(rated, supervisor.yaw_power)
    supervisor.protected_power = approach(supervisor.protected_power, wanted, supervisor.yaw_rate * call.dt)
    power = min(supervisor.operator_power, supervisor.protected_power)
    # written only if different, which keeps derivatives with respect to entries of the law
    if power != law.rated_power:
        law.rated_power = power


@kernel
def begin_state(x: SupervisedState, state: int, call: Call) -> None:
    """Actions at the entry of a state of operation."""
    supervisor, law, demands = x.supervisor, x.load.collective, call.demands
    if state == START_UP:
        supervisor.share, law.torque, supervisor.latched, supervisor.start_requested = 0.0, 0.0, 0.0, 0.0
        mean = 0.0
        for b in range(call.blades):
            mean = mean + demands.pitch[b] / call.blades
        law.reference_speed = min(max(call.speed, 0.0), supervisor.reference)
        set_collective(x.load, mean, call.speed)
        supervisor.lowering = 1.0
        reset_loops(x.load)
    if state == CONNECTION:
        law.torque = 0.0
    if state in (NORMAL_STOP, EMERGENCY_STOP):
        supervisor.stop_torque, supervisor.stop_speed = demands.generator_torque, call.speed
        supervisor.start_requested = 0.0
    if state == STANDBY:
        supervisor.latched = 0.0


@kernel
def start_law(x: SupervisedState, state: int, dt: float) -> None:
    """Parameters of the collective law during start-up: reference and minimum pitch follow the speed (C-66)."""
    supervisor, law = x.supervisor, x.load.collective
    speed, step = law.speed, supervisor.start_acceleration * dt
    ahead = max(speed, 0.0) + AHEAD * supervisor.start_acceleration
    law.reference_speed = min(max(min(law.reference_speed + step, ahead), 0.0), supervisor.reference)
    fine = min(supervisor.connect_speed, supervisor.start_ratio * max(supervisor.wind, 1.0))
    left = min(max(1.0 - speed / fine, 0.0), 1.0)
    law.minimum_pitch = supervisor.minimum_pitch + left * max(supervisor.start_pitch - supervisor.minimum_pitch, 0.0)
    law.pitch_rate = supervisor.rate[t.MODES[state - 1, M_RATE]]


@kernel
def lower_pitch(x: SupervisedState, call: Call) -> None:
    """Lower the pitch to its minimum or until the rotor reaches its reference speed; then the law takes over (C-66)."""
    supervisor, law = x.supervisor, x.load.collective
    pitch = max(law.pitch - law.pitch_rate * call.dt, law.minimum_pitch)
    if call.speed >= law.reference_speed or pitch <= law.minimum_pitch:
        supervisor.lowering = 0.0
    set_collective(x.load, pitch, call.speed)
    for b in range(call.blades):
        call.demands.pitch[b] = pitch


@kernel
def restore_law(x: SupervisedState, dt: float) -> None:
    """Restore the parameters of the collective law; written only where they differ."""
    supervisor, law = x.supervisor, x.load.collective
    if law.reference_speed < supervisor.reference:
        law.reference_speed = min(law.reference_speed + supervisor.start_acceleration * dt, supervisor.reference)
    if law.minimum_pitch != supervisor.minimum_pitch:
        law.minimum_pitch = supervisor.minimum_pitch
    if law.pitch_rate != supervisor.rate[RATE_LAW]:
        law.pitch_rate = supervisor.rate[RATE_LAW]


@kernel
def limit_torque(law: BaselineState, most: float, demands: Demands) -> None:
    """Limit the torque demand and the torque state of the law [N m]."""
    law.switches += crossed(law.torque - most)
    law.torque = min(law.torque, most)
    demands.generator_torque = law.torque


@kernel
def produce(x: SupervisedState, state: int, call: Call) -> None:
    """States with the pitch of the collective law."""
    supervisor, law, demands = x.supervisor, x.load.collective, call.demands
    mode = t.MODES[state - 1, M_TORQUE]
    if mode == TORQUE_LAW:
        restore_law(x, call.dt)
        load_step(x.load, call.measured, demands, call.dt)
        if law.rated_power < supervisor.rated_power:
            limit_torque(law, law.rated_power / max(law.speed, 1e-3), demands)
        return
    start_law(x, state, call.dt)
    if supervisor.lowering > 0.5 and mode == TORQUE_NONE:
        lower_pitch(x, call)
    else:
        collective_step(law, call.speed, call.measured, demands, call.dt)
    for b in range(MAX_BLADES):
        x.load.group[PITCH].last[b] = law.pitch
    if mode == TORQUE_JOIN:
        supervisor.share = min(supervisor.share + call.dt / supervisor.connect_time, 1.0)
        # torque of the regions below rated speed: constant power would prevent the rotor from accelerating
        most = min(law_torque(law, law.speed), law.rated_power / max(law.speed, 1e-3))
        limit_torque(law, min(supervisor.share * law.maximum_torque, most), demands)
    else:
        law.torque = 0.0
        demands.generator_torque = 0.0


@kernel
def shut_down(x: SupervisedState, state: int, call: Call) -> None:
    """States that pitch to feather: torque falls with speed, or is zero (C-68).

    The torque uses the lower of the two speed measurements, the brake the higher one: a stuck sensor can neither drive
    the rotor backwards nor brake it at full speed.
    """
    supervisor, law, demands = x.supervisor, x.load.collective, call.demands
    mode = t.MODES[state - 1, M_TORQUE]
    keep = 1.0 - exp(-call.dt * law.filter_frequency)
    law.speed = law.speed + keep * (call.speed - law.speed)
    wanted = 0.0
    if mode == TORQUE_FALL and supervisor.stop_speed > supervisor.connect_speed:
        range_ = supervisor.stop_speed - supervisor.connect_speed
        share = (min(call.speed, call.twin) - supervisor.connect_speed) / range_
        wanted = supervisor.stop_torque * min(max(share, 0.0), 1.0)
    if state == EMERGENCY_STOP and supervisor.emergency_torque < 0.5:
        wanted = 0.0
    law.torque = approach(demands.generator_torque, wanted, law.torque_rate * call.dt)
    demands.generator_torque = law.torque
    step, mean = supervisor.rate[t.MODES[state - 1, M_RATE]] * call.dt, 0.0
    for b in range(call.blades):
        demands.pitch[b] = approach(demands.pitch[b], supervisor.feather, step)
        mean = mean + demands.pitch[b] / call.blades
    law.pitch = mean
    demands.brake = 0.0
    if t.MODES[state - 1, M_BRAKE] > 0 and max(call.speed, call.twin) < supervisor.brake_speed:
        demands.brake = supervisor.brake


@kernel
def protect(supervisor: SupervisorState, call: Call) -> None:
    """One step of the machine of yaw protection (C-64)."""
    evaluate_conditions(supervisor, 0, N_YAW, call.dt)
    row = step_machine(supervisor, supervisor.protection, t.YAW_MACHINE, YAW_PROTECTION, call.measured.time)
    if row >= 0 and t.YAW_MACHINE[row, TO] == DERATED:
        supervisor.derates += 1.0
    supervisor.now.yaw_state = supervisor.protection.state


@kernel
def operate(x: SupervisedState, call: Call) -> None:
    """One step of the machine of operation (C-63)."""
    supervisor = x.supervisor
    evaluate_conditions(supervisor, N_YAW, N_CONDITIONS, call.dt)
    x.load.collective.switches += switches_near(supervisor, whole(supervisor.operation.state))
    row = step_machine(supervisor, supervisor.operation, t.MACHINE, OPERATION, call.measured.time)
    if row < 0:
        return
    state = t.MACHINE[row, TO]
    begin_state(x, state, call)
    if state in (NORMAL_STOP, EMERGENCY_STOP):
        c = abs(t.MACHINE[row, FIRST]) - 1
        lasting = supervisor.yaw_latching if c == YAW_STOP else supervisor.latching * t.LATCHES[c]
        supervisor.latched = max(supervisor.latched, lasting)


@kernel
def update(state: Float, measurements: Float, demands: Float, dt: float) -> None:
    """One call of the supervised controller (C-60 to C-68)."""
    supervise(SupervisedState(state), Measurements(measurements), Demands(demands), dt)


@kernel
def supervise(x: SupervisedState, measured: Measurements, demands: Demands, dt: float) -> None:
    """Means of the wind, yaw control, machines, demands of the state (C-60 to C-68)."""
    supervisor, law = x.supervisor, x.load.collective
    # a sensor without a value has failed: the other one replaces it until the following stop
    speed, twin = measured.generator_speed, supervisor.gear_ratio * measured.rotor_speed
    lost = speed != speed
    if lost:
        speed = twin
    call = Call(measured, demands, speed, twin, whole(measured.n_blades), dt)
    wind = measured.wind_speed
    supervisor.gust = moving_mean(x.gust_mean, wind, dt)
    supervisor.wind = moving_mean(x.wind_mean, wind, dt)
    supervisor.mean_wind = moving_mean(x.long_mean, wind, dt)
    yaw_rate = yaw_step(x.yaw, measured, dt)
    protected = x.protection.points > 0.0
    supervisor.threshold = NEVER
    if protected:
        supervisor.protection_wind = moving_mean(x.protection_mean, wind, dt)
        supervisor.threshold = threshold(x.protection, supervisor.protection_wind)
    quantities(x, call)
    protect(supervisor, call)
    operate(x, call)
    set_point(x, call)
    if lost:
        measured.generator_speed = speed
    state = whole(supervisor.operation.state)
    if t.MODES[state - 1, M_PITCH] == PITCH_FEATHER:
        shut_down(x, state, call)
    else:
        produce(x, state, call)
        demands.brake = 0.0
    if measured.grid < 0.5:
        law.torque = 0.0
        demands.generator_torque = 0.0
    demands.yaw_rate = 0.0
    if supervisor.follow > 0.5 and t.MODES[state - 1, M_YAW] > 0 and measured.grid > 0.5:
        demands.yaw_rate = yaw_rate
    demands.operating_state = supervisor.operation.state
    demands.power_setpoint = law.rated_power * supervisor.efficiency
    demands.yaw_error = x.yaw.filtered
    demands.yaw_threshold = 0.0
    if protected:
        demands.yaw_threshold = supervisor.threshold
    law.switches += x.yaw.switches
    x.yaw.switches = 0.0


def SupervisedController(
    turbine: AnyTurbine,
    settings: Supervision | None = None,
    *,
    load: LoadControl | None = None,
    yaw: YawControl | None = None,
    protection: YawProtection | None = None,
    sample_time: float | None = None,
    name: str = "supervised",
) -> Controller:
    """Controller with start, stop, protection, derating and yaw control.

    Args:
      turbine: turbine with the collective law, cut-in and cut-out, and the limits of the actuators.
      settings: settings of the supervisor; by default those that follow from the turbine.
      load: load controller in production; by default the collective law only.
      yaw: yaw control, which needs a model with ``yaw="driven"``; without it the nacelle is fixed.
      protection: yaw protection; none by default.
      sample_time: [s] time between calls; by default every time step.
      name: name for messages.

    Returns:
      The controller. ``Result.log`` has its transitions, channel ``operating_state`` the number of its state.

    Raises:
      InputError: settings are inconsistent with each other or with the turbine.
    """
    settings = settings or Supervision()
    values = limits(turbine, settings)
    work = LoadController(turbine, load, sample_time=sample_time, name=name)
    template = _settings(turbine, settings, values, yaw is not None, protection)
    vane = yaw_settings(yaw or YawControl(), turbine.yaw)
    if protection is not None:
        vane.filter_time = protection.filter_time
    points = YawThreshold.of() if protection is None else threshold_settings(protection)

    def init(start: StartPoint) -> SupervisedState:
        mean = start.wind_speed if start.mean_wind is None else start.mean_wind
        x = SupervisedState.of(
            supervisor=template,
            yaw=vane,
            load=work.init(start),
            protection=points,
            gust_mean=mean_start(values["gust_window"], ROOMS[0], before=mean),
            wind_mean=mean_start(values["wind_window"], ROOMS[1], before=mean),
            long_mean=mean_start(values["mean_window"], ROOMS[2], before=mean),
            protection_mean=mean_start(30.0 if protection is None else protection.window, ROOMS[3], before=mean),
        )
        supervisor = x.supervisor
        supervisor.operation.state = _first_state(turbine, settings, values, start)
        supervisor.latched = float(settings.begin == "idling")
        supervisor.share = float(supervisor.operation.state >= CONNECTION)
        supervisor.last_request = -1.0
        return x

    anywhere = StartPoint(wind_speed=0.0, generator_speed=0.0, pitch=0.0, generator_torque=0.0)
    return Controller(
        update=update,
        init=init,
        sample_time=sample_time,
        name=name,
        yaws=yaw is not None,
        state_names=SupervisedState.names_of(init(anywhere).array) if work.state_names else (),
        warnings=lambda x: [
            *limit_warnings(SupervisedState(x).load),
            *_log_warnings(SupervisedState(x).supervisor.log),
        ],
        log=lambda x: log_entries(SupervisedState(x).supervisor.log),
    )


def _log_warnings(log: Log) -> list[str]:
    written = int(log.written)
    if written <= LOG_ROOM:
        return []
    return [f"supervisor: {written} transitions, of which the log has the first {LOG_ROOM}: limits that lie too close?"]


def _first_state(turbine: AnyTurbine, settings: Supervision, numbers: dict[str, float], start: StartPoint) -> int:
    """Number of the initial state."""
    torque = turbine.control.torque
    if settings.begin != "automatic":
        return t.NUMBER[settings.begin]
    if start.generator_speed < 0.9 * numbers["connect_speed"]:
        return STANDBY
    if start.generator_speed >= torque.rated_speed or start.pitch >= max(torque.power_pitch, 1e-3):
        return POWER_LIMIT
    return SPEED_LIMIT if start.generator_speed >= parameters(turbine.control).transition_speed else MAXIMUM_POWER


def _settings(
    turbine: AnyTurbine, settings: Supervision, values: dict[str, float], follow: bool, protection: YawProtection | None
) -> SupervisorState:
    """Initial state of the supervisor, without that of operation."""
    control, drivetrain = turbine.control, turbine.drivetrain
    rated = control.torque.rated_power
    same = "connect_speed start_acceleration start_pitch connect_time feather brake brake_speed".split()
    x = SupervisorState.of(
        **{name: values[name] for name in same},
        reference=control.pitch.reference_speed,
        minimum_pitch=control.pitch.minimum,
        rate=[control.pitch.rate_limit, *(values[f"{name}_rate"] for name in t.RATES if name != "law")],
        rated_power=rated,
        operator_power=rated,
        protected_power=rated,
        efficiency=drivetrain.generator_efficiency,
        gear_ratio=drivetrain.gear_ratio,
        start_ratio=settings.start_ratio * drivetrain.gear_ratio / turbine.rotor_radius,
        emergency_torque=settings.emergency_torque,
        derate_rate=settings.derate_rate * rated,
        auto_start=settings.auto_start,
        latching=settings.latched,
        follow=follow,
        protection=MachineState.of(state=NORMAL),
        yaw_rate=settings.derate_rate * rated,
        limit=[0.0 if c.limit == "yaw_threshold" else _number(c.limit, values) for c in t.CONDITIONS],
        hold=[_number(c.hold, values) for c in t.CONDITIONS],
    )
    if protection is not None:
        most = turbine.rated_power if protection.power_limit is None else protection.power_limit
        share = 2.0 / 3.0 if protection.power_limit is None else 1.0
        if protection.power_limit is not None and most >= values["rated_power"]:
            raise InputError(
                f"yaw protection: power_limit {most:g} W is no limit for a turbine of {values['rated_power']:g} W"
            )
        x.strategy = STRATEGIES.index(protection.strategy)
        x.yaw_latching = protection.latched
        x.yaw_power = share * most / drivetrain.generator_efficiency
        x.yaw_rate, x.recheck_time = protection.derate_rate * rated, protection.recheck_time
    return x


def _number(text: str, values: dict[str, float]) -> float:
    return values[text] if text in values else float(text)
