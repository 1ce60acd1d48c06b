"""State machines of the supervisor: states, conditions, transitions of operation and of yaw protection.

The machine of operation has the states of the turbine. The machine of yaw protection runs in parallel: it derates,
waits and rechecks, or requests a stop (Wang et al. 2021, Fig. 8). In every call each machine makes at most one
transition (``control.machine``).

These tables define the law: the kernel evaluates them as arrays of integers, and pages and diagrams of the
documentation are generated from them.

Reference: docs/theory/control.md (C-60 to C-68).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from meltemi.compiler import Table, number
from meltemi.control.controller import PRODUCING
from meltemi.control_laws.machine import Int, cells, machine, transitions


@dataclass(frozen=True)
class OperatingState:
    """State of the turbine.

    Attributes:
      torque: ``none``; ``law``: of the collective law; ``join``: that, its limit rising from zero; ``fall``: in
        proportion to speed, to zero.
      pitch: ``law``; ``speed``: the law with a reference that rises; ``feather``.
      rate: pitch rate: ``law``, ``start``, ``normal``, ``emergency``.
      brake: ``free`` or ``slow``: applied at low speed.
      yaw: ``follow`` the wind or ``hold``.
    """

    name: str
    torque: str
    pitch: str
    rate: str
    brake: str
    yaw: str
    doc: str


@dataclass(frozen=True)
class Condition:
    """Comparison of a quantity with a limit.

    Attributes:
      quantity: name in ``QUANTITIES``.
      sense: ``above`` (and NaN) or ``below``; equality is neither.
      limit: a number, or the name of a limit of ``Supervision`` and ``YawProtection``.
      hold: [s] time for which it has to hold without interruption, or the name of a setting.
      latches: a stop for this reason lasts until the operator requests "start".
      doc: text of the reason, with placeholders for value and limit.
    """

    name: str
    quantity: str
    sense: str
    limit: str
    hold: str
    latches: bool
    doc: str


class Quantities(Table, title="quantities of the supervisor"):
    """Quantities that conditions compare."""

    yaw_error: float = number("rad", "filtered yaw error, absolute")
    producing: float = number("-", "1 while the generator is connected")
    derate: float = number("-", "1 if the strategy of yaw protection is to derate and recheck")
    stop: float = number("-", "1 if it is to stop at once")
    time_over: float = number("-", "1 when the recheck is due")
    standing_by: float = number("-", "1 in standby")
    yaw_state: float = number("-", "number of the state of yaw protection")
    emergency_request: float = number("-", "1 while the last request of the operator is emergency_stop")
    stop_request: float = number("-", "1 while it is normal_stop")
    may_start: float = number("-", "1 if neither a latch nor the operator forbids a start")
    grid: float = number("-", "1 while there is a grid")
    speed: float = number("rad/s", "generator speed, the larger one of both sensors")
    difference: float = number("rad/s", "difference of both speed sensors, on the generator's side")
    frozen: float = number("s", "time for which the generator's speed has not changed while the rotor's has")
    pitch_gap: float = number("rad", "largest difference of demanded and measured pitch")
    power: float = number("W", "electrical power")
    acceleration: float = number("m/s^2", "horizontal acceleration of the tower top")
    gust: float = number("m/s", "short mean of the wind")
    wind: float = number("m/s", "30 s mean of the wind")
    mean_wind: float = number("m/s", "10 min mean of the wind")
    start_time: float = number("s", "time since the start-up began")
    share: float = number("-", "permitted share of the torque; 0 while the law would hold power below rated speed")
    region: float = number("-", "region of the collective law: 1 maximum power, 2 speed limit, 3 power limit")
    feathered: float = number("rad", "smallest pitch demand of the blades")


_CONDITIONS = """
yaw_exceeded      | yaw_error         | above | yaw_threshold    | 0            | yes
producing         | producing         | above | 0.5              | 0            | no
derates           | derate            | above | 0.5              | 0            | no
stops             | stop              | above | 0.5              | 0            | no
time_over         | time_over         | above | 0.5              | 0            | no
restarted         | standing_by       | above | 0.5              | 0            | no
yaw_shutdown      | yaw_state         | above | 2.5              | 0            | yaw
emergency_request | emergency_request | above | 0.5              | 0            | yes
stop_request      | stop_request      | above | 0.5              | 0            | no
may_start         | may_start         | above | 0.5              | 0            | no
grid_lost         | grid              | below | 0.5              | 0            | no
trip_speed        | speed             | above | trip_speed       | 0            | yes
over_speed        | speed             | above | over_speed       | 0            | yes
speed_sensors     | difference        | above | speed_difference | sensor_time  | yes
frozen            | frozen            | above | frozen_time      | 0            | yes
pitch_gap         | pitch_gap         | above | pitch_difference | pitch_time   | yes
over_power        | power             | above | over_power       | power_time   | yes
tower             | acceleration      | above | acceleration     | 0            | yes
gust              | gust              | above | cut_out_gust     | 0            | no
wind_high         | wind              | above | cut_out_wind     | 0            | no
mean_high         | mean_wind         | above | cut_out_mean     | 0            | no
wind_low          | wind              | below | stop_wind        | stop_time    | no
wind_enough       | wind              | above | start_wind       | start_time   | no
wind_under        | wind              | below | restart_wind     | 0            | no
wind_fit          | wind              | below | restart_wind     | restart_time | no
slow_start        | start_time        | above | start_limit      | 0            | no
connect_speed     | speed             | above | connect_speed    | 0            | no
joined            | share             | above | 0.9999999        | 0            | no
speed_region      | region            | above | 1.5              | region_time  | no
below_speed       | region            | below | 1.5              | region_time  | no
power_region      | region            | above | 2.5              | region_time  | no
below_power       | region            | below | 2.5              | region_time  | no
feathered         | feathered         | above | feathered        | 0            | no
slow              | speed             | below | idle_speed       | 0            | no
"""
"""Columns: name, quantity, sense, limit, hold, latches."""

_WORDS = """
yaw_exceeded      | yaw error {value:.1f} deg above {limit:.1f} deg
producing         | the generator is connected
derates           | the strategy is to derate
stops             | the strategy is to stop
time_over         | the recheck is due
restarted         | the turbine stands by again
yaw_shutdown      | yaw protection
emergency_request | the operator's emergency stop
stop_request      | the operator's stop
may_start         | free to start
grid_lost         | the grid is lost
trip_speed        | generator speed {value:.5g} rad/s above {limit:.5g} rad/s
over_speed        | generator speed {value:.5g} rad/s above {limit:.5g} rad/s
speed_sensors     | speed sensors differ by {value:.5g} rad/s
frozen            | the generator's speed has not changed for {value:.1f} s
pitch_gap         | a blade is {value:.1f} deg from its demand
over_power        | power {value:.0f} kW above {limit:.0f} kW
tower             | tower top accelerates by {value:.2f} m/s^2
gust              | gust of {value:.1f} m/s above {limit:.1f} m/s
wind_high         | wind of {value:.1f} m/s above {limit:.1f} m/s
mean_high         | mean wind of {value:.1f} m/s above {limit:.1f} m/s
wind_low          | wind of {value:.1f} m/s below {limit:.1f} m/s
wind_enough       | wind of {value:.1f} m/s above {limit:.1f} m/s
wind_under        | wind of {value:.1f} m/s below {limit:.1f} m/s
wind_fit          | wind of {value:.1f} m/s below {limit:.1f} m/s
slow_start        | no connection within {limit:.0f} s
connect_speed     | generator speed {value:.5g} rad/s
joined            | all of the torque is allowed
speed_region      | the speed is at its limit
below_speed       | the speed is below its limit
power_region      | the power is at its set-point
below_power       | the power is below its set-point
feathered         | feathered
slow              | generator speed {value:.5g} rad/s below {limit:.5g} rad/s
"""

_STATES = """
standby        | none | feather | normal    | free | follow | ready, waits for wind
start_up       | none | speed   | start     | free | follow | speeds up to the connection
connection     | join | speed   | law       | free | follow | connected to the grid, torque rises
maximum_power  | law  | law     | law       | free | follow | tracks maximum power, below the speed limit
speed_limit    | law  | law     | law       | free | follow | holds the speed by torque
power_limit    | law  | law     | law       | free | follow | holds power by torque, speed by pitch
normal_stop    | fall | feather | normal    | free | follow | pitches to feather, torque falls with speed
emergency_stop | fall | feather | emergency | slow | hold   | as fast as pitch may, brake at low speed
idling         | none | feather | normal    | free | follow | feathered, turns freely
"""

_TRANSITIONS = """
running stopping | emergency_stop | emergency_request
running stopping | emergency_stop | trip_speed
running stopping | emergency_stop | grid_lost
running stopping | emergency_stop | speed_sensors
running stopping | emergency_stop | frozen
running stopping | emergency_stop | pitch_gap
running          | normal_stop    | stop_request
running          | normal_stop    | over_speed
running          | normal_stop    | over_power
running          | normal_stop    | tower
running          | normal_stop    | gust
running          | normal_stop    | wind_high
running          | normal_stop    | mean_high
running          | normal_stop    | yaw_shutdown
running          | normal_stop    | wind_low
start_up         | normal_stop    | slow_start
standby          | start_up       | wind_enough, wind_under, may_start, not grid_lost, not yaw_exceeded
start_up         | connection     | connect_speed
connection       | maximum_power  | joined
maximum_power    | speed_limit    | speed_region
speed_limit      | power_limit    | power_region
power_limit      | speed_limit    | below_power
speed_limit      | maximum_power  | below_speed
normal_stop      | idling         | slow, feathered
emergency_stop   | idling         | slow, feathered
idling           | standby        | wind_fit, may_start, not grid_lost
"""

GROUPS = {
    "running": ("start_up", "connection", "maximum_power", "speed_limit", "power_limit"),
    "stopping": ("normal_stop",),
}
"""Names for several states."""

_YAW_STATES = """
normal   | law | law | law | free | follow | generates normally
derated  | law | law | law | free | follow | power limited until the recheck
shutdown | law | law | law | free | follow | requests a stop
"""

_YAW_TRANSITIONS = """
normal   | derated  | yaw_exceeded, producing, derates
normal   | shutdown | yaw_exceeded, producing, stops
derated  | normal   | not producing
derated  | shutdown | yaw_exceeded, time_over
derated  | normal   | time_over
shutdown | normal   | restarted
"""


STATES = tuple(OperatingState(*row) for row in cells(_STATES))
YAW_STATES = tuple(OperatingState(*row) for row in cells(_YAW_STATES))
CONDITIONS = tuple(
    Condition(name, quantity, sense, limit, hold, latches != "no", words)
    for (name, quantity, sense, limit, hold, latches), (_, words) in zip(cells(_CONDITIONS), cells(_WORDS), strict=True)
)
TRANSITIONS = transitions(_TRANSITIONS, GROUPS)
YAW_TRANSITIONS = transitions(_YAW_TRANSITIONS)

CONDITION = {c.name: i for i, c in enumerate(CONDITIONS)}
YAW_CONDITIONS = CONDITION["yaw_shutdown"]
"""The first conditions, which the machine of yaw protection looks at; the rest see its new state."""
TORQUES = ("none", "law", "join", "fall")
PITCHES = ("law", "speed", "feather")
RATES = ("law", "start", "normal", "emergency")

DEGREES = frozenset(i for i, c in enumerate(CONDITIONS) if " deg " in f"{c.doc} ")
KILOWATT = frozenset(i for i, c in enumerate(CONDITIONS) if " kW" in c.doc)


NUMBER = {state.name: i + 1 for i, state in enumerate(STATES)}
YAW_NUMBER = {state.name: i + 1 for i, state in enumerate(YAW_STATES)}
MACHINE = machine([*NUMBER], [*CONDITION], TRANSITIONS)
YAW_MACHINE = machine([*YAW_NUMBER], [*CONDITION], YAW_TRANSITIONS)


def _column(values: list[Any]) -> Int:
    return np.array(values, dtype=np.int64)


MODES = _column(
    [
        [TORQUES.index(a.torque), PITCHES.index(a.pitch), RATES.index(a.rate), a.brake == "slow", a.yaw == "follow"]
        for a in STATES
    ]
)
"""(states, 5): torque, pitch, rate, brake, yaw, by number in the lists above."""
COMPARED = _column([[Quantities.index(c.quantity), 1 if c.sense == "above" else -1] for c in CONDITIONS])
"""(conditions, 2): quantity; 1 above, -1 below."""
LATCHES = _column([c.latches for c in CONDITIONS])
REPORTED = _column([PRODUCING.count(t.target) * PRODUCING.count(t.sources[0]) for t in TRANSITIONS])
"""(transitions,): 1 for those among production states, which say where the law is and change nothing."""
CONNECTED = _column([state.name in PRODUCING for state in STATES])
"""(states,): 1 where the generator is connected."""
