"""The channel catalogue: everything a simulation can record, as data.

A channel is a place in the signals of a case, with a name, unit, frame, sign and description, and the
name OpenFAST gives it. Values are SI; ``display_unit`` is what tables and plots show.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache

from meltemi.core.errors import InputError, closest, did_you_mean
from meltemi.core.units import display


@dataclass(frozen=True, slots=True)
class Channel:
    """One quantity that can be recorded.

    Attributes:
      name: ours.
      alias: OpenFAST's, or empty.
      unit: SI unit of the recorded values.
      frame: axes in which it is given.
      sign: which direction is positive.
      description: what it is.
      source: array of the case and row in it.
      index: further places in that array (blade, node or station).
      scale: factor from the array to the channel.
      alias_scale: factor from the channel to OpenFAST's value in SI (-1 where the signs differ).
    """

    name: str
    alias: str
    unit: str
    frame: str
    sign: str
    description: str
    source: tuple[str, str]
    index: tuple[int, ...] = ()
    scale: float = 1.0
    wrap: bool = False

    @property
    def display_unit(self) -> tuple[str, float]:
        """Unit for people and the factor to it."""
        return display(self.unit, angular_rate_in_degrees="speed" not in self.name)


_BLADE = """
pitch_{b}            | BldPitch{b} | rad   | blade {b}          | towards feather                    | pitch angle | pitch.angle
pitch_rate_{b}       |             | rad/s | blade {b}          | towards feather                    | rate of the pitch angle | pitch.rate
pitch_demand_{b}     | BlPitchC{b} | rad   | blade {b}          | towards feather                    | pitch angle that the controller asks for | demands.pitch_{b}
root_force_x_{b}     | RootFxc{b}  | N     | coned blade axes   | downwind                           | shear force at the blade root, out of plane | root.force_x
root_force_y_{b}     | RootFyc{b}  | N     | coned blade axes   | towards the trailing edge at zero pitch | shear force at the blade root, in plane | root.force_y
root_force_z_{b}     | RootFzc{b}  | N     | coned blade axes   | from root to tip (tension)         | axial force at the blade root | root.force_z
root_moment_in_plane_{b}     | RootMxc{b} | N m | coned blade axes | about x: positive when the air drives the blade | in-plane bending moment at the blade root | root.moment_x
root_moment_out_of_plane_{b} | RootMyc{b} | N m | coned blade axes | about y: positive when thrust bends the blade downwind | out-of-plane bending moment at the blade root | root.moment_y
root_moment_torsion_{b}      | RootMzc{b} | N m | coned blade axes | about z, nose up                  | pitching moment at the blade root | root.moment_z
root_force_flap_{b}  | RootFxb{b}  | N     | pitched blade axes | flapwise, downwind at zero pitch   | flapwise shear force at the blade root | root.pitched_force_x
root_force_edge_{b}  | RootFyb{b}  | N     | pitched blade axes | edgewise, towards the trailing edge | edgewise shear force at the blade root | root.pitched_force_y
root_moment_edge_{b} | RootMxb{b}  | N m   | pitched blade axes | about x                            | edgewise bending moment at the blade root | root.pitched_moment_x
root_moment_flap_{b} | RootMyb{b}  | N m   | pitched blade axes | about y                            | flapwise bending moment at the blade root | root.pitched_moment_y
tip_out_of_plane_{b} | OoPDefl{b}  | m     | coned blade axes   | downwind                           | deflection of the blade tip out of plane | root.tip_x
tip_in_plane_{b}     | IPDefl{b}   | m     | coned blade axes   | towards the trailing edge at zero pitch | deflection of the blade tip in plane | root.tip_y
tip_axial_{b}        | TipDzc{b}   | m     | coned blade axes   | outwards                           | shortening of the blade (negative) | root.tip_z
tip_flap_{b}         | TipDxb{b}   | m     | pitched blade axes | flapwise, downwind at zero pitch   | flapwise deflection of the blade tip | root.pitched_tip_x
tip_edge_{b}         | TipDyb{b}   | m     | pitched blade axes | edgewise, towards the trailing edge | edgewise deflection of the blade tip | root.pitched_tip_y
tip_twist_{b}        |             | rad   | pitched blade axes | nose up                            | elastic torsion of the blade tip | root.tip_rotation_z
tip_clearance_{b}    | TwrClrnc{b} | m     | nacelle axes       | distance                           | distance of the blade tip from the yaw axis, or from the tower top when the tip is above it | root.clearance
"""

_MACHINE = """
time                 |           | s     | -                 | -                                 | simulation time | summary.time
azimuth              | Azimuth   | rad   | shaft             | clockwise looking downwind, 0: blade 1 up | azimuth of blade 1 | machine.azimuth
rotor_speed          | RotSpeed  | rad/s | shaft             | clockwise looking downwind        | speed of the rotor relative to the nacelle | machine.rotor_speed
generator_speed      | GenSpeed  | rad/s | generator shaft   | with the rotor                    | speed of the generator | summary.generator_speed
generator_torque     | GenTq     | N m   | generator shaft   | against the rotor's rotation      | generator torque | summary.generator_torque
generator_power      | GenPwr    | W     | -                 | delivered                         | electrical power | summary.power
rotor_power          | RotPwr    | W     | -                 | from rotor to shaft               | mechanical power of the low-speed shaft | summary.rotor_power
rotor_acceleration   | RotAccel  | rad/s^2 | shaft           | clockwise looking downwind        | acceleration of the rotor relative to the nacelle | chain.rotor_acceleration
wind_x               | Wind1VelX | m/s   | inertial          | downwind                          | wind at the undeflected hub centre | summary.hub_wind_x
wind_y               | Wind1VelY | m/s   | inertial          | to the left looking downwind      | wind at the undeflected hub centre | summary.hub_wind_y
wind_z               | Wind1VelZ | m/s   | inertial          | up                                | wind at the undeflected hub centre | summary.hub_wind_z
rotor_thrust         | RotThrust | N     | shaft axes        | downwind                          | axial force of the rotor on the shaft, weight and inertia included | chain.apex_force_x
shaft_force_y        | LSShftFys | N     | shaft axes, not rotating | to the left looking downwind | lateral force of the rotor on the shaft | chain.apex_force_y
shaft_force_z        | LSShftFzs | N     | shaft axes, not rotating | up                         | vertical force of the rotor on the shaft | chain.apex_force_z
rotor_torque         | RotTorq   | N m   | shaft axes        | driving                           | torque of the rotor on the shaft | chain.apex_moment_x
shaft_tilt_moment    | LSSTipMys | N m   | shaft axes, not rotating | about y                    | tilt moment of the rotor at its apex | chain.apex_moment_y
shaft_yaw_moment     | LSSTipMzs | N m   | shaft axes, not rotating | about z                    | yaw moment of the rotor at its apex | chain.apex_moment_z
shaft_moment_y       | LSSTipMya | N m   | shaft axes, rotating with blade 1 | about y            | bending moment of the shaft at the rotor apex | chain.rotating_moment_y
shaft_moment_z       | LSSTipMza | N m   | shaft axes, rotating with blade 1 | about z            | bending moment of the shaft at the rotor apex | chain.rotating_moment_z
rotor_aero_thrust    | RtFldFxh  | N     | shaft axes        | downwind                          | aerodynamic thrust of the blades | rotor.thrust
rotor_aero_torque    | RtFldMxh  | N m   | shaft axes        | driving                           | aerodynamic torque of the blades | rotor.torque
yaw_force_x          | YawBrFxp  | N     | tower-top axes, not yawing | downwind                 | shear force at the yaw bearing | chain.yaw_force_x
yaw_force_y          | YawBrFyp  | N     | tower-top axes, not yawing | to the left looking downwind | shear force at the yaw bearing | chain.yaw_force_y
yaw_force_z          | YawBrFzp  | N     | tower-top axes, not yawing | up                       | axial force at the yaw bearing | chain.yaw_force_z
yaw_moment_x         | YawBrMxp  | N m   | tower-top axes, not yawing | about x                  | roll moment at the yaw bearing | chain.yaw_moment_x
yaw_moment_y         | YawBrMyp  | N m   | tower-top axes, not yawing | about y: positive when pushed downwind at the top | nodding moment at the yaw bearing | chain.yaw_moment_y
yaw_moment_z         | YawBrMzp  | N m   | tower-top axes, not yawing | about z: counter-clockwise from above | yaw moment at the yaw bearing | chain.yaw_moment_z
nacelle_yaw          | NacYaw    | rad   | tower-top axes    | counter-clockwise from above      | direction of the nacelle | q.yaw
tower_top_fore_aft   | TTDspFA   | m     | inertial          | downwind                          | deflection of the tower top | chain.top_deflection_x
tower_top_side_side  | TTDspSS   | m     | inertial          | to the left looking downwind      | deflection of the tower top | chain.top_deflection_y
tower_top_acceleration_x | YawBrTAxp | m/s^2 | tower-top axes | downwind                         | acceleration of the tower top, without gravity | chain.top_acceleration_x
tower_top_acceleration_y | YawBrTAyp | m/s^2 | tower-top axes | to the left looking downwind     | acceleration of the tower top, without gravity | chain.top_acceleration_y
tower_base_force_x   | TwrBsFxt  | N     | tower-base axes   | downwind                          | shear force at the tower base | tower_station.force_x.0
tower_base_force_y   | TwrBsFyt  | N     | tower-base axes   | to the left looking downwind      | shear force at the tower base | tower_station.force_y.0
tower_base_force_z   | TwrBsFzt  | N     | tower-base axes   | up                                | axial force at the tower base | tower_station.force_z.0
tower_base_moment_side_side | TwrBsMxt | N m | tower-base axes | about x: positive when pushed to the right looking downwind | side-to-side bending moment at the tower base | tower_station.moment_x.0
tower_base_moment_fore_aft  | TwrBsMyt | N m | tower-base axes | about y: positive when pushed downwind | fore-aft bending moment at the tower base | tower_station.moment_y.0
tower_base_moment_torsion   | TwrBsMzt | N m | tower-base axes | about z: counter-clockwise from above | torsion at the tower base | tower_station.moment_z.0
skew_angle           | RtSkew    | rad   | -                 | -                                 | angle between mean wind and shaft | rotor.skew
tip_speed_ratio      | RtTSR     | -     | -                 | -                                 | tip-speed ratio with the mean relative wind | rotor.tip_ratio
mean_induction       |           | -     | -                 | -                                 | mean quasi-steady axial induction around 70 % of the radius | rotor.induction
inflow_time          |           | s     | -                 | -                                 | time constant of the first inflow lag | rotor.inflow_time
induction_residual   |           | -     | -                 | -                                 | largest residual of the momentum balance over the nodes | rotor.residual
brake_torque         |           | N m   | generator shaft   | against rotation                  | torque of the brake | drive.brake_torque
"""

_NODE = """
node_{n}_wind_speed_{b}   | B{b}N{n}Vrel  | m/s  | strip axes | - | relative wind in the strip's plane, with induction | flow.speed
node_{n}_alpha_{b}        | B{b}N{n}Alpha | rad  | strip axes | nose up | angle of attack at the aerodynamic centre | flow.alpha
node_{n}_phi_{b}          | B{b}N{n}Phi   | rad  | strip axes | from the rotor plane | inflow angle | flow.phi
node_{n}_theta_{b}        | B{b}N{n}Theta | rad  | strip axes | towards feather | pitch, twist and torsion | flow.theta
node_{n}_axial_induction_{b}      | B{b}N{n}AxInd | - | strip axes | against the wind | axial induction factor | flow.axial
node_{n}_tangential_induction_{b} | B{b}N{n}TnInd | - | strip axes | against the rotation of the blade | tangential induction factor | flow.tangential
node_{n}_lift_{b}         | B{b}N{n}Cl    | -    | -          | - | lift coefficient | flow.lift
node_{n}_drag_{b}         | B{b}N{n}Cd    | -    | -          | - | drag coefficient | flow.drag
node_{n}_moment_{b}       | B{b}N{n}Cm    | -    | -          | nose up | moment coefficient | flow.moment
node_{n}_normal_force_{b} | B{b}N{n}Fx    | N/m  | strip axes | downwind | load normal to the strip | flow.normal_force
node_{n}_driving_force_{b}| B{b}N{n}Fy    | N/m  | strip axes | driving the rotor | load along the strip | flow.driving_force
node_{n}_pitching_moment_{b} |            | N m/m | strip axes | nose up | aerodynamic moment about the strip's axis | flow.pitching_moment
"""

_STATION = """
station_{n}_force_x_{b}  |  | N   | pitched blade axes | flapwise | shear force at blade station {n} | station.force_x
station_{n}_force_y_{b}  |  | N   | pitched blade axes | edgewise, towards the trailing edge | shear force at blade station {n} | station.force_y
station_{n}_force_z_{b}  |  | N   | pitched blade axes | tension | axial force at blade station {n} | station.force_z
station_{n}_moment_x_{b} |  | N m | pitched blade axes | about x | edgewise bending moment at blade station {n} | station.moment_x
station_{n}_moment_y_{b} |  | N m | pitched blade axes | about y | flapwise bending moment at blade station {n} | station.moment_y
station_{n}_moment_z_{b} |  | N m | pitched blade axes | nose up | torsion at blade station {n} | station.moment_z
"""

_TOWER_STATION = """
tower_station_{n}_force_x  |  | N   | inertial | downwind | shear force at tower station {n} | tower_station.force_x
tower_station_{n}_force_y  |  | N   | inertial | to the left looking downwind | shear force at tower station {n} | tower_station.force_y
tower_station_{n}_force_z  |  | N   | inertial | up | axial force at tower station {n} | tower_station.force_z
tower_station_{n}_moment_x |  | N m | inertial | about x | side-to-side bending moment at tower station {n} | tower_station.moment_x
tower_station_{n}_moment_y |  | N m | inertial | about y | fore-aft bending moment at tower station {n} | tower_station.moment_y
tower_station_{n}_moment_z |  | N m | inertial | about z | torsion at tower station {n} | tower_station.moment_z
"""


def _rows(text: str, **values: int) -> list[list[str]]:
    return [
        [part.strip() for part in line.format(**values).split("|")] for line in text.splitlines() if line.strip()
    ]


def _channel(row: list[str], index: tuple[int, ...]) -> Channel:
    name, alias, unit, frame, sign, description, source = row
    array, field, *rest = source.split(".")
    if rest:
        index = (int(rest[0]),)
    return Channel(name, alias, unit, frame, sign, description, (array, field), index, wrap=field == "azimuth")


def catalogue(
    n_blades: int = 3, n_nodes: int = 0, blade_stations: int = 0, tower_stations: int = 0, coordinates: Iterable[str] = ()
) -> dict[str, Channel]:
    """All channels of a turbine by name.

    Args:
      n_blades: number of blades.
      n_nodes: nodes of each blade (their channels are numbered from 1 at the root).
      blade_stations, tower_stations: further stations at which section loads are wanted.
      coordinates: names of the generalised coordinates; each becomes a channel, and its velocity.
    """
    found = [_channel(row, ()) for row in _rows(_MACHINE)]
    for b in range(1, n_blades + 1):
        for row in _rows(_BLADE, b=b):
            index = () if row[-1].startswith("demands.") else (b - 1,)
            found.append(_channel(row, index))
        for n in range(1, n_nodes + 1):
            found += [_channel(row, (b - 1, n - 1)) for row in _rows(_NODE, b=b, n=n)]
        for n in range(1, blade_stations + 1):
            found += [_channel(row, (b - 1, n - 1)) for row in _rows(_STATION, b=b, n=n)]
    for n in range(1, tower_stations + 1):
        found += [_channel(row, (n,)) for row in _rows(_TOWER_STATION, n=n)]
    for name in coordinates:
        if name == "yaw":
            continue
        unit = "rad" if name in ("generator", "drivetrain") or name.endswith("torsion") else "m"
        found.append(
            Channel(
                f"q {name}", "", unit, "-", "-", f"generalised coordinate {name!r}", ("q", name), ()
            )
        )
    return {channel.name: channel for channel in found}


@cache
def standard() -> dict[str, Channel]:
    """Channels that every three-bladed turbine has, without nodes and stations."""
    return catalogue()


def find(name: str, channels: dict[str, Channel]) -> Channel:
    """A channel by its name or OpenFAST's, upper or lower case alike.

    Raises:
      InputError: unknown; the message gives the closest names.
    """
    if name in channels:
        return channels[name]
    lower = name.lower()
    for channel in channels.values():
        if lower in (channel.name.lower(), channel.alias.lower()):
            return channel
    names = [*channels, *(c.alias for c in channels.values() if c.alias)]
    near = closest(name, names, n=4)
    hint = f"did you mean {', '.join(near)}?" if near else did_you_mean(name, names)
    if re.match(r"(b\dn\d|node_)", lower):
        hint += f" Blade nodes are numbered 1 to {_last_node(channels)}."
    raise InputError(f"no channel {name!r}: {hint}")


def _last_node(channels: dict[str, Channel]) -> int:
    return max((c.index[1] + 1 for c in channels.values() if c.source[0] == "flow"), default=0)


DEFAULT = (
    "wind_x wind_y wind_z azimuth rotor_speed generator_speed generator_torque generator_power "
    "pitch_1 pitch_2 pitch_3 rotor_thrust rotor_torque rotor_aero_thrust rotor_aero_torque "
    "root_moment_out_of_plane_1 root_moment_out_of_plane_2 root_moment_out_of_plane_3 "
    "root_moment_in_plane_1 root_moment_in_plane_2 root_moment_in_plane_3 root_moment_flap_1 root_moment_edge_1 "
    "tip_out_of_plane_1 tip_in_plane_1 tip_clearance_1 tower_top_fore_aft tower_top_side_side "
    "tower_base_moment_fore_aft tower_base_moment_side_side tower_base_moment_torsion "
    "yaw_moment_x yaw_moment_y yaw_moment_z shaft_tilt_moment shaft_yaw_moment nacelle_yaw"
).split()
"""What is recorded unless something else is asked for."""
