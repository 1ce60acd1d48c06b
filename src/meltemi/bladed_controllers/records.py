"""Records of the swap array that a turbine and a Bladed-style controller library exchange.

Units, signs and the choice of records are those of OpenFAST 5 (``ServoDyn``, ``BladedInterface.f90``): rad, rad/s, N m,
W. Records are numbered from 1 as in Bladed's manual. ``RECORDS`` is what the code uses and what the docs show.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from meltemi.turbine.power_turbine import AnyTurbine

EXCHANGED = 164
"""Number of records that are exchanged at a call: all below, up to OpenFAST's tables. Those beyond belong to the
library, and are zero at its first call."""
SIZE = 3300
"""Length of the swap array, that of OpenFAST with its extended records (platform, lidar, cables, dampers: all zero)."""
MESSAGE_SIZE, NAME_SIZE = 4096, 65536
"""Number of characters of the message and of the root name that is passed to a library."""
LOGGING = 145
"""Record at which values for logging would begin."""


@dataclass(frozen=True)
class SwapRecord:
    """One record.

    Attributes:
      number: number from 1.
      unit: unit of its value.
      way: "to" the library, "from" it, or "none" if it is not used.
      source: source of the value: a measurement by its name (with a minus sign if it is reversed), the demand that it
        sets, a number of the turbine by its name in ``CONSTANTS``, or a number.
      meaning: description.
    """

    number: int
    unit: str
    way: str
    source: str
    meaning: str


_TEXT = """
  1 | -       | to   | status                 | 0 first call, 1 later ones, -1 last call
  2 | s       | to   | time                   | time
  3 | s       | to   | sample_time            | time between calls
  4 | rad     | to   | pitch_1                | pitch of blade 1
  5 | rad     | to   | below_rated_pitch      | pitch below rated
  6 | rad     | to   | minimum_pitch          | limit of the actuator
  7 | rad     | to   | maximum_pitch          | limit of the actuator
  8 | rad/s   | to   | minimum_pitch_rate     | limit of the actuator
  9 | rad/s   | to   | maximum_pitch_rate     | limit of the actuator
 10 | -       | to   | 0                      | pitch actuators take a position
 11 | rad     | to   | pitch demand 1         | last pitch demand, blade 1
 12 | rad/s   | to   | 0                      | last pitch rate demand
 13 | W       | to   | rated_power            | demanded power
 14 | W       | to   | rotor_power            | shaft power
 15 | W       | to   | power                  | electrical power
 16 | N m s^2/rad^2 | to | optimal_gain       | torque over generator speed squared, below rated
 17 | rad/s   | to   | optimal_speed          | least generator speed at optimal gain
 18 | rad/s   | to   | rated_speed            | largest generator speed at optimal gain
 19 | rad/s   | to   | reference_speed        | demanded generator speed above rated
 20 | rad/s   | to   | generator_speed        | generator speed
 21 | rad/s   | to   | rotor_speed            | rotor speed
 22 | N m     | to   | rated_torque           | demanded generator torque above rated
 23 | N m     | to   | torque                 | generator torque
 24 | rad     | to   | yaw error              | wind over nacelle direction, counter-clockwise from above, at the hub
 25 | -       | to   | 0                      | record of a torque table: there is none
 26 | -       | to   | 0                      | points of a torque table
 27 | m/s     | to   | wind_speed             | horizontal wind at the hub
 28 | -       | to   | individual_pitch       | 0 collective, 1 individual pitch
 29 | -       | to   | 0                      | yaw by rate
 30 | N m     | to   | out_of_plane_moment_1  | root out-of-plane moment, blade 1 (RootMyc1)
 31 | N m     | to   | out_of_plane_moment_2  | blade 2
 32 | N m     | to   | out_of_plane_moment_3  | blade 3
 33 | rad     | to   | pitch_2                | pitch of blade 2
 34 | rad     | to   | pitch_3                | pitch of blade 3
 35 | -       | from | generator contactor    | 0 off: no torque; 1 on
 36 | -       | from | brake                  | shaft brake: 0 off, 1 on
 37 | rad     | to   | yaw                    | nacelle direction, counter-clockwise from above
 41 | N m     | none | 0                      | yaw torque demand
 42 | rad     | from | pitch 1                | pitch demand of blade 1, if individual
 43 | rad     | from | pitch 2                | blade 2
 44 | rad     | from | pitch 3                | blade 3
 45 | rad     | from | pitch                  | pitch demand, if collective
 46 | rad/s   | none | 0                      | pitch rate demand
 47 | N m     | from | generator_torque       | torque demand
 48 | rad/s   | from | yaw_rate               | yaw rate demand, counter-clockwise from above
 49 | -       | to   | message size           | characters of the message, with the closing zero
 50 | -       | to   | input file size        | characters of the input file's name, with the closing zero
 51 | -       | to   | root name size         | characters of the root name, with the closing zero
 53 | m/s^2   | to   | fore_aft_acceleration  | of the tower top, tower-top axes (not yawing)
 54 | m/s^2   | to   | side_side_acceleration | of the tower top, to the left looking downwind
 55 | -       | from | pitch override         | must stay 0: the library sets the pitch
 56 | -       | from | torque override        | must stay 0: the library sets the torque
 60 | rad     | to   | azimuth                | of blade 1, 0 when it points up, 0 to 2 pi
 61 | -       | to   | n_blades               | number of blades
 62 | -       | to   | 0                      | values that may be returned for logging
 63 | -       | to   | logging                | record at which values for logging would begin
 64 | -       | to   | name size              | characters that may be returned in the root name
 65 | -       | none | 0                      | values returned for logging
 69 | N m     | to   | in_plane_moment_1      | root in-plane moment, blade 1 (RootMxc1)
 70 | N m     | to   | in_plane_moment_2      | blade 2
 71 | N m     | to   | in_plane_moment_3      | blade 3
 72 | -       | none | 0                      | start-up resistance
 73 | N m     | to   | rotating hub moment y  | of the rotor on the shaft, axes that turn with blade 1 (LSSTipMya)
 74 | N m     | to   | rotating hub moment z  | the same (LSSTipMza)
 75 | N m     | to   | hub_moment_y           | the same, axes that do not rotate (LSSTipMys)
 76 | N m     | to   | hub_moment_z           | the same (LSSTipMzs)
 77 | N m     | to   | yaw bearing moment y   | of nacelle on tower, axes that yaw (YawBrMyn)
 78 | N m     | to   | yaw bearing moment z   | the same (YawBrMzn)
 79 | -       | none | 0                      | request for loads: they are always given
 80 | -       | none | 0                      | variable slip
 81 | -       | none | 0                      | variable slip
 82 | rad/s^2 | to   | nacelle_turning_x      | nacelle roll acceleration, shaft axes (NcIMURAxs)
 83 | rad/s^2 | to   | nacelle_turning_y      | nacelle nodding acceleration, shaft axes (NcIMURAys)
 84 | rad/s^2 | to   | nacelle_turning_z      | nacelle yaw acceleration, shaft axes (NcIMURAzs)
109 | N m     | to   | hub_moment_x           | torque of the rotor on the shaft
117 | -       | to   | 0                      | controller state: power production
120 | deg     | from | flap 1                 | deflection of the flaps of blade 1, if the turbine has flaps
121 | deg     | from | flap 2                 | blade 2
122 | deg     | from | flap 3                 | blade 3
129 | -       | to   | size                   | length of the swap array
"""


_LINES = [[part.strip() for part in line.split("|")] for line in _TEXT.splitlines() if line.strip()]
RECORDS: tuple[SwapRecord, ...] = tuple(SwapRecord(int(number), *rest) for number, *rest in _LINES)
"""Every record that Bladed-style libraries and ROSCO 2.x use below 130; the others are zero."""

CONSTANTS: dict[str, Callable[[AnyTurbine], float]] = {
    "below_rated_pitch": lambda t: t.control.pitch.minimum,
    "minimum_pitch": lambda t: t.pitch_actuator.minimum,
    "maximum_pitch": lambda t: t.pitch_actuator.maximum,
    "minimum_pitch_rate": lambda t: -t.pitch_actuator.rate_limit,
    "maximum_pitch_rate": lambda t: t.pitch_actuator.rate_limit,
    "rated_power": lambda t: t.rated_power,
    "optimal_gain": lambda t: t.control.torque.optimal_gain,
    "optimal_speed": lambda t: t.control.torque.optimal_speed,
    "rated_speed": lambda t: t.control.torque.rated_speed,
    "reference_speed": lambda t: t.control.pitch.reference_speed,
    "rated_torque": lambda t: t.control.torque.rated_power / t.control.torque.rated_speed,
    "logging": lambda t: LOGGING,
    "message size": lambda t: MESSAGE_SIZE,
    "name size": lambda t: NAME_SIZE,
    "size": lambda t: SIZE,
}
"""Values of the constant records of a run."""
