"""Compiled part of the learning environments: demands of the agent, its sensors, its rewards, and the time loop.

The agent acts through a controller that is called at every time step and adds its demands to those of an underlying
controller, by default the baseline one. One compiled loop advances any number of turbines by one step of the
environment each, and fills the rows of their observations and rewards. The damage of an episode is that of
:func:`meltemi.loads.rainflow_cycles`.
"""

from __future__ import annotations

from functools import cache
from math import cos, exp, sin
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meltemi.compiler import (
    Array1,
    Array2,
    Array3,
    KernelRecord,
    Numbers,
    Table,
    blades,
    function_at,
    kernel,
    kernel_for,
    number,
    part,
    record_like,
    types,
    whole,
)
from meltemi.control.controller import ENTRY
from meltemi.control.signals import Demands, Measurements
from meltemi.control_laws.yaw import wrap
from meltemi.postprocess.counting import OpenCycles, count, damage_until_now
from meltemi.simulation.tables import Clock

FEATURE = "the learning environments"

Float = NDArray[np.float64]

COMMANDS = ("pitch_1", "pitch_2", "pitch_3", "torque", "yaw_rate")
"""Quantities to which the actions of an agent are converted, in SI units."""
TERMS = ("power", "speed", "reference", "yaw", "load", "pitch_travel", "yaw_travel", "failure")
"""Components of the reward, before their weights."""
OVERSPEED, REFERENCE, YAW_ERROR, TRAVEL = 0.1, 0.1, np.radians(10.0), np.radians(1.0)
"""Overspeed over reference speed, power error over rated power, yaw error [rad] and pitch rate [rad/s] at which the
component is -1."""


class AgentState(Table, title="learning environment"):
    """Controller of an environment: the agent's demands, signals derived from sensors, sums.

    The state of the underlying controller follows it in the same vector.
    """

    wrapper: float = number("-", "address of the controller below: its wrapper,")
    code: float = number("-", "and its compiled code")
    reference_speed: float = number("rad/s", "reference speed of the generator")
    maximum_torque: float = number("N m", "largest torque")
    torque_rate: float = number("N m/s", "largest rate of the torque")
    minimum_pitch: float = number("rad", "smallest pitch")
    maximum_pitch: float = number("rad", "largest pitch")
    pitch_rate: float = number("rad/s", "largest rate of the pitch")
    yaws: float = number("-", "1: the agent's yaw rate is the demand")
    pitch_share: float = number("-", "share of the controller's pitch in the demand")
    torque_share: float = number("-", "share of the controller's torque in the demand")
    pitch: Numbers = blades("rad", "the agent's part of the pitch demand")
    torque: float = number("N m", "the agent's part of the torque demand")
    yaw_rate: float = number("rad/s", "the agent's demand")
    follows: float = number("-", "1: the torque keeps the power below the reference of the grid")
    efficiency: float = number("-", "efficiency of the generator")
    leak: float = number("1/s", "leakage rate of the integrals of accelerations")
    last_pitch: Numbers = blades("rad", "demands of the last call")
    last_torque: float = number("N m", "demand of the last call")
    azimuth_sine: float = number("-", "sine of the azimuth angle")
    azimuth_cosine: float = number("-", "cosine of the azimuth angle")
    tilt_moment: float = number("N m", "cosine component of the out-of-plane root moments")
    yaw_moment: float = number("N m", "sine component of the out-of-plane root moments")
    fore_aft_velocity: float = number("m/s", "leaking integral of the fore-aft acceleration")
    side_side_velocity: float = number("m/s", "leaking integral of the side-side acceleration")
    yaw_error: float = number("rad", "wind direction minus nacelle direction, clockwise from above")
    power_error: float = number("W", "power reference minus power")
    calls: float = number("-", "calls since the last observation; sums over them:")
    power_sum: float = number("W", "sum of the power")
    speed_sum: float = number("-", "sum of the squared overspeed")
    reference_sum: float = number("W^2", "sum of the squared power error")
    yaw_sum: float = number("rad^2", "sum of the squared yaw error")
    pitch_travel: float = number("rad", "travel of the pitch angles, mean of the blades")
    yaw_travel: float = number("rad", "travel of the yaw angle")
    measured_pitch: Numbers = blades("rad", "pitch at the last call")
    measured_yaw: float = number("rad", "yaw at the last call")
    started: float = number("-", "0 before the first call")


class EpisodeState(Table, title="episode of an environment"):
    """Settings and progress of an episode."""

    substeps: float = number("-", "time steps in a step of the environment")
    last_step: float = number("-", "instant at which the episode is truncated")
    overspeed: float = number("rad/s", "generator speed at which it is terminated")
    rated_power: float = number("W", "rated power of the turbine")
    rated_speed: float = number("rad/s", "reference of the generator speed")
    yaw_drive: float = number("rad/s", "rate of the yaw drive")
    time_step: float = number("s", "time step of the run")
    output_step: float = number("s", "interval between rows of the output")
    counting: float = number("-", "1: the load component is the rainflow damage; 0: the squared rate")
    read: float = number("-", "rows of the output that have been read")
    place: float = number("-", "place of the present observation in the ring of delayed ones")


class CounterState(Table, title="load counter"):
    """Rainflow counter of one load of the reward."""

    cycles: OpenCycles = part(OpenCycles, "in ranges of the scale", prefix="")
    column: float = number("-", "column of the output")
    scale: float = number("N m", "range that counts as one")
    weight: float = number("-", "weight in the load component")
    damage: float = number("-", "damage of closed cycles, and of open ones as half cycles, at the last observation")
    rates: float = number("1/s^2", "sum of the squared rates since the last observation")


class Slot(KernelRecord):
    """Records of one turbine of an environment.

    Attributes:
      law: state of the controller.
      counters, points: (loads, fields) counters, and (loads, 2, DEPTH) turning points with space for a copy.
      sensors: (n, 4) source of each sensor (0: measurements, 1: ``AgentState``) and row; values for -1 and 1.
      commands: (5, 1 + actions) commands of actions: offset, gains.
      ring: (1 + delay, n) ring buffer of observations.
      weights: weights of the components of the reward.
    """

    law: AgentState
    measured: Measurements
    clock: Clock
    episode: EpisodeState
    output: Array2
    counters: Array2
    points: Array3
    sensors: Array2
    commands: Array2
    ring: Array2
    weights: Array1


AGENT = len(AgentState)
_entry_at = function_at(ENTRY)


# the controller -------------------------------------------------------------------------------------------


@kernel
def update(state: Float, measurements: Float, demands: Float, dt: float) -> None:
    """One call of the controller of an environment."""
    x, measured, wanted = AgentState(state), Measurements(measurements), Demands(demands)
    n = whole(measured.n_blades)
    below = _entry_at(int(x.wrapper), 0, int(x.code))
    below(state[AGENT:], measurements, demands, dt)
    torque = x.torque_share * wanted.generator_torque + x.torque
    if x.follows > 0.0:
        torque = min(torque, measured.power_reference / (x.efficiency * max(measured.generator_speed, 1.0)))
    step = x.torque_rate * dt
    torque = min(max(torque, 0.0, x.last_torque - step), x.maximum_torque, x.last_torque + step)
    wanted.generator_torque = torque
    x.last_torque = torque
    step = x.pitch_rate * dt
    for b in range(n):
        pitch = min(max(x.pitch_share * wanted.pitch[b] + x.pitch[b], x.minimum_pitch), x.maximum_pitch)
        wanted.pitch[b] = min(max(pitch, x.last_pitch[b] - step), x.last_pitch[b] + step)
        x.last_pitch[b] = wanted.pitch[b]
    if x.yaws > 0.0:
        wanted.yaw_rate = x.yaw_rate
    # signals
    decay = exp(-dt * x.leak)
    x.fore_aft_velocity = decay * x.fore_aft_velocity + dt * measured.fore_aft_acceleration
    x.side_side_velocity = decay * x.side_side_velocity + dt * measured.side_side_acceleration
    x.azimuth_sine, x.azimuth_cosine = sin(measured.azimuth), cos(measured.azimuth)
    tilt, yaw = 0.0, 0.0
    for b in range(n):
        angle = measured.azimuth + 2.0 * np.pi * b / n
        tilt += 2.0 / n * measured.out_of_plane_moment[b] * cos(angle)
        yaw += 2.0 / n * measured.out_of_plane_moment[b] * sin(angle)
    x.tilt_moment, x.yaw_moment = tilt, yaw
    x.yaw_error = wrap(measured.wind_direction + measured.yaw)
    x.power_error = measured.power_reference - measured.power
    # sums
    x.calls += 1.0
    x.power_sum += measured.power
    over = max(measured.generator_speed / x.reference_speed - 1.0, 0.0)
    x.speed_sum += over * over
    x.reference_sum += x.power_error * x.power_error
    x.yaw_sum += x.yaw_error * x.yaw_error
    for b in range(n):
        if x.started > 0.0:
            x.pitch_travel += abs(measured.pitch[b] - x.measured_pitch[b]) / n
        x.measured_pitch[b] = measured.pitch[b]
    if x.started > 0.0:
        x.yaw_travel += abs(measured.yaw - x.measured_yaw)
    x.measured_yaw = measured.yaw
    x.started = 1.0


# loads ----------------------------------------------------------------------------------------------------


@kernel
def read_loads(s: Slot, first: bool) -> float:
    """Read the rows of the output since the last observation; return the load component of the reward."""
    e, rows, load = s.episode, s.clock.row, 0.0
    begin = whole(e.read)
    for k in range(s.counters.shape[0]):
        x, points = CounterState(s.counters[k]), s.points[k, 0]
        column, rates = whole(x.column), 0.0
        for row in range(max(rows - 1, 0) if first else begin, rows):
            value = s.output[row, column] / x.scale
            if x.cycles.values > 0.0 and row > 0:
                rate = (value - s.output[row - 1, column] / x.scale) / e.output_step
                rates += rate * rate
            count(x.cycles, points, value)
        damage = damage_until_now(x.cycles, points, s.points[k, 1])
        if e.counting > 0.0:
            seconds = max(rows - begin, 1) * e.output_step
            load += x.weight * (damage - x.damage) / seconds
        else:
            load += x.weight * rates / max(rows - begin, 1)
        x.rates, x.damage = rates, damage
    e.read = float(rows)
    return load


# observations and rewards ---------------------------------------------------------------------------------


@kernel
def act(s: Slot, actions: NDArray[np.float32]) -> None:
    """Set the demands of the agent."""
    x = s.law
    for k in range(s.commands.shape[0]):
        value = s.commands[k, 0]
        for j in range(actions.shape[0]):
            value += s.commands[k, 1 + j] * min(max(float(actions[j]), -1.0), 1.0)
        if k < 3:
            x.pitch[k] = value
        elif k == 3:
            x.torque = value
        else:
            x.yaw_rate = value


@kernel
def observe(s: Slot, noise: Float, first: bool, row: NDArray[np.float32]) -> None:
    """Fill a row of observations: sensors, noise, delay, limits."""
    e, size = s.episode, s.ring.shape[0]
    now = (whole(e.place) + 1) % size
    e.place = float(now)
    for j in range(s.sensors.shape[0]):
        at = int(s.sensors[j, 1])
        value = s.law.array[at] if s.sensors[j, 0] > 0.0 else s.measured.array[at]
        low, high = s.sensors[j, 2], s.sensors[j, 3]
        value = 2.0 * (value - low) / (high - low) - 1.0 + noise[j]
        value = min(max(value, -1.0), 1.0) if np.isfinite(value) else 0.0
        s.ring[now, j] = value
        if first:
            for i in range(size):
                s.ring[i, j] = value
        row[j] = s.ring[(now + 1) % size, j]


@kernel
def reward(s: Slot, load: float, failed: bool, terms: Float) -> float:
    """Fill a row with the weighted components of the reward, clear the sums and return the total."""
    x, e = s.law, s.episode
    n = max(x.calls, 1.0)
    seconds = n * e.time_step
    terms[0] = x.power_sum / n / e.rated_power
    terms[1] = -x.speed_sum / n / OVERSPEED**2
    terms[2] = -x.reference_sum / n / (REFERENCE * e.rated_power) ** 2
    terms[3] = -x.yaw_sum / n / YAW_ERROR**2
    terms[4] = -load
    terms[5] = -x.pitch_travel / seconds / TRAVEL
    terms[6] = -x.yaw_travel / seconds / e.yaw_drive
    terms[7] = -1.0 if failed else 0.0
    total = 0.0
    for k in range(terms.shape[0]):
        terms[k] *= s.weights[k]
        total += terms[k]
    x.calls = x.power_sum = x.speed_sum = x.reference_sum = x.yaw_sum = x.pitch_travel = x.yaw_travel = 0.0
    return total


# time loop ------------------------------------------------------------------------------------------------


WORDS = 7
"""Addresses of the records of a turbine."""


def step_turbines(  # noqa: PLR0913 - called by its address: no records
    words: Any,
    which: Any,
    actions: Any,
    noise: Any,
    steps: int,
    first: bool,
    observations: Any,
    rewards: Any,
    terms: Any,
    ended: Any,
    loop: Any,
    controller: Any,
    evaluation: Any,
    observation: Any,
    run: Any,
    control: Any,
    m: Any,
    one: Any,
    plain: Any,
    sections: Any,
    slot: Any,
) -> None:
    """Advance turbines by one step of the environment, and fill their rows.

    Args:
      words: (n, WORDS) addresses.
      which: indices of the turbines to advance; those whose episode has ended are skipped.
      actions, noise: (n, actions) within -1 and 1, and (n, sensors) of the observations.
      steps: time steps; 0 for those of the episode.
      first: no action, and a new episode from the observation on.
      observations, rewards, terms, ended: (n, sensors), (n,), (n, TERMS), (n,) 1 for terminated, 2 for truncated.
      loop, controller, evaluation, observation: addresses of the time loop and of the functions that it calls.
      run, control, m, one, plain, sections, slot: records of one turbine, for their types.
    """
    for i in which:
        if ended[i] != 0 and not first:
            continue  # the output has no rows beyond its end
        w = words[i]
        s, clock = record_like(slot, w[6]), record_like(run, w[0]).clock
        if not first:
            act(s, actions[i])
        loop(
            steps if steps > 0 else whole(s.episode.substeps),
            controller,
            evaluation,
            observation,
            record_like(run, w[0]),
            record_like(control, w[1]),
            record_like(m, w[2]),
            record_like(one, w[3]),
            record_like(plain, w[4]),
            record_like(sections, w[5]),
        )
        failed = clock.status != 0 or s.measured.generator_speed > s.episode.overspeed
        load = read_loads(s, first)
        observe(s, noise[i], first, observations[i])
        rewards[i] = reward(s, load, failed, terms[i])
        ended[i] = 1 if failed else 2 if clock.step >= s.episode.last_step else 0


_F64, _F32, _I64 = types.float64, types.float32, types.int64
_ROWS = (_I64[:, ::1], _I64[::1], _F32[:, ::1], _F64[:, ::1], _I64, types.boolean)
_FILLED = (_F32[:, ::1], _F64[::1], _F64[:, ::1], _I64[::1])


@cache
def compiled(*kinds: Any) -> Any:
    """:func:`step_turbines` for functions and records of given types."""
    return kernel_for(types.void(*_ROWS, *_FILLED, *kinds))(step_turbines)
