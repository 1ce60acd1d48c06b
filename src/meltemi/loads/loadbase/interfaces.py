"""Interfaces of a turbine at which a load base has loads, and the channels that it records."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import chain

from meltemi.compiler import MAX_LINES
from meltemi.simulation.channels import Channel, ChannelSet, catalogue, channels_of_group
from meltemi.turbine.definition import Turbine

BLADE_STATIONS = (0.25, 0.5, 0.75)
"""Stations with loads over the length of the blade, from the root."""
TOWER_STATIONS = (0.5,)
"""Stations with loads over the length of the tower, from its base."""
SIX = ("force_x", "force_y", "force_z", "moment_x", "moment_y", "moment_z")
TURNED = (30, 60, 120, 150)
"""Directions [deg] of a rose of moments besides those of the two components."""
OTHERS = (
    "wind_x rotor_speed generator_speed generator_torque generator_power azimuth tower_top_acceleration_x "
    "tower_top_acceleration_y tower_top_fore_aft tower_top_side_side nacelle_yaw operating_state brake_torque"
).split()
OF_BLADES = (
    "pitch pitch_rate root_moment_flap root_moment_edge tip_out_of_plane tip_in_plane tip_clearance tip_twist"
).split()
MOTIONS = tuple(f"platform_{name}" for name in "surge sway heave roll pitch yaw offset tilt".split())
"""Channels of the motions of a floating platform."""


@dataclass(frozen=True)
class Interface:
    """A point with three forces and three moments.

    Attributes:
      name: name such as ``tower_base``.
      channels: channels of Fx, Fy, Fz, Mx, My, Mz.
      plane: transverse axes, ``xy`` or ``yz``.
      rose: whether its moments are evaluated by direction.
      speed: channel of the speed at which its bearing turns; empty without one.
    """

    name: str
    channels: tuple[str, ...]
    plane: str = "xy"
    rose: bool = False
    speed: str = ""


def interfaces_of(turbine: Turbine) -> tuple[Interface, ...]:
    """All interfaces of a turbine, from the blades to the tower base."""

    def six(stem: str, blade: str = "", names: Sequence[str] = SIX) -> tuple[str, ...]:
        return tuple(f"{stem}_{name}{blade}" for name in names)

    interfaces = []
    for b in range(1, turbine.n_blades + 1):
        root = six("root", f"_{b}", (*SIX[:3], "moment_in_plane", "moment_out_of_plane", "moment_torsion"))
        interfaces.append(Interface(f"blade_root_{b}", root, rose=True, speed=f"pitch_rate_{b}"))
        for n in range(1, len(BLADE_STATIONS) + 1):
            interfaces.append(Interface(f"blade_station_{n}_{b}", six(f"station_{n}", f"_{b}")))
    thrust, torque = ("rotor_thrust",), ("rotor_torque",)
    fixed = (*thrust, "shaft_force_y", "shaft_force_z", *torque, "shaft_tilt_moment", "shaft_yaw_moment")
    turning = (*thrust, "shaft_rotating_force_y", "shaft_rotating_force_z", *torque, "shaft_moment_y", "shaft_moment_z")
    interfaces.append(Interface("hub_fixed", fixed, "yz", speed="rotor_speed"))
    interfaces.append(Interface("hub_rotating", turning, "yz"))
    interfaces.append(Interface("yaw_bearing", six("yaw"), rose=True))
    tower = [f"tower_station_{n}" for n in range(1, len(TOWER_STATIONS) + 1)]
    interfaces += [Interface(name, six(name), rose=True) for name in tower]
    base = six("tower_base", names=(*SIX[:3], "moment_side_side", "moment_fore_aft", "moment_torsion"))
    interfaces.append(Interface("tower_base", base, rose=True))
    if turbine.support is not None:
        piles = [f"pile_station_{n}" for n in range(1, len(turbine.support.load_stations) + 1)]
        interfaces += [Interface(name, six(name)) for name in piles]
    if turbine.support is not None or (turbine.frame is not None and turbine.frame.feet):
        interfaces.append(Interface("mudline", six("mudline_reaction"), rose=True))
    return tuple(interfaces)


def tensions(turbine: Turbine) -> dict[str, str]:
    """Channels of the tensions of a turbine's mooring lines, and the names of the lines."""
    lines = range(1, len(turbine.platform.lines) + 1) if turbine.platform is not None else ()
    return {f"line_{n}_{end}_tension": f"line_{n}" for n in lines for end in ("fairlead", "anchor")}


def known_channels(blades: int) -> dict[str, Channel]:
    """Channels with up to 9 stations of blades and tower, 40 of the pile, and all mooring lines."""
    lines = channels_of_group("line", MAX_LINES)
    groups = (channel for group in ("sea", "frame", "platform") for channel in channels_of_group(group))
    sea = (*groups, *channels_of_group("pile_station", 40), *lines)
    return catalogue(ChannelSet(blades, blade_stations=9, tower_stations=9, further=sea))


def recorded(turbine: Turbine, interfaces: Sequence[Interface]) -> tuple[str, ...]:
    """Channels that the cases of a load base record."""
    names = (*OF_BLADES, *(f"flap_{j + 1}_angle" for j in range(len(turbine.flaps))))
    others = (*OTHERS, "wave_elevation") if turbine.substructures else OTHERS
    if turbine.platform is not None:
        others = (*others, *MOTIONS, *tensions(turbine))
    blades = (f"{name}_{b}" for b in range(1, turbine.n_blades + 1) for name in names)
    return tuple(dict.fromkeys(chain(*(each.channels for each in interfaces), others, blades)))


def stations(turbine: Turbine) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Stations [m] of blades from the root and of the tower above its base."""
    blade, tower = turbine.blade.length, turbine.tower.length
    return tuple(s * blade for s in BLADE_STATIONS), tuple(s * tower for s in TOWER_STATIONS)
