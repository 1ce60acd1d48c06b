"""The channel catalogue: everything a simulation can record, as data.

A channel is an entry of a case's signals with name, unit, frame, sign, description and OpenFAST's name. Values are in
SI units; tables and plots show them in ``display_unit``.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cache, lru_cache
from pathlib import Path

from meltemi.core.errors import InputError, UnknownNameError, closest, did_you_mean
from meltemi.core.units import display


@dataclass(frozen=True, slots=True)
class Channel:
    """One quantity that can be recorded.

    Attributes:
      name: name in meltemi.
      alias: OpenFAST's name, or empty.
      unit: SI unit of the recorded values.
      frame: axes of the component.
      sign: positive direction.
      description: meaning of the quantity.
      source: array of the case and row of the array.
      index: further indices of the array (blade, node or station).
      wrap: whether the channel is an angle between 0 and 2 pi.
      also: further names in OpenFAST.
    """

    name: str
    alias: str
    unit: str
    frame: str
    sign: str
    description: str
    source: tuple[str, str]
    index: tuple[int, ...] = ()
    wrap: bool = False
    also: tuple[str, ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        """All its names, meltemi's first."""
        return tuple(filter(None, (self.name, self.alias, *self.also)))

    @property
    def display_unit(self) -> tuple[str, float]:
        """Engineering unit and the factor to it from SI."""
        return display(self.unit, angular_rate_in_degrees="speed" not in self.name.lower())


@cache
def _rows(group: str) -> list[tuple[str, ...]]:
    """Rows of one group of ``channels.csv``, without the group column."""
    import csv

    with (Path(__file__).parent / "channels.csv").open(newline="", encoding="utf-8") as file:
        return [tuple(row[1:]) for row in csv.reader(file) if row[0] == group]


@cache
def _channel(row: tuple[str, ...], index: tuple[int, ...], **numbers: int) -> Channel:
    name, alias, also, unit, frame, sign, description, source = (part.format(**numbers) for part in row)
    array, field, *rest = source.split(".")
    if rest:
        index = (int(rest[0]),)
    wrap, others = field == "azimuth", tuple(also.split())
    return Channel(name, alias, unit, frame, sign, description, (array, field), index, wrap, others)


@dataclass(frozen=True)
class ChannelSet:
    """Parts of a turbine that have channels.

    Attributes:
      blades: number of blades.
      nodes: number of nodes of each blade; their channels are numbered from 1 at the root.
      blade_stations, tower_stations: number of additional stations with section loads.
      coordinates: names of the generalised coordinates; each has a channel, and so does its velocity.
      flaps: number of flaps of each blade.
      gears: numbers of planetary stages and of all stages of a gearbox whose parts are modelled.
      further: channels that only this kind of turbine has, and those of its parts.
    """

    blades: int = 3
    nodes: int = 0
    blade_stations: int = 0
    tower_stations: int = 0
    coordinates: tuple[str, ...] = ()
    flaps: int = 0
    gears: tuple[int, int] = (0, 0)
    further: tuple[Channel, ...] = ()


def channels_of_group(group: str, count: int | None = None) -> tuple[Channel, ...]:
    """Channels of a group of ``channels.csv``, for entries 1 to ``count`` along an axis if their names have numbers."""
    if count is None:
        return tuple(_channel(row, ()) for row in _rows(group))
    return tuple(_channel(row, (n,), n=n) for n in range(1, count + 1) for row in _rows(group))


def catalogue(contents: ChannelSet = ChannelSet()) -> dict[str, Channel]:
    """All channels of a turbine by name."""
    return dict(_catalogue(contents))


@lru_cache(maxsize=8)
def _catalogue(contents: ChannelSet) -> dict[str, Channel]:
    channels = [*channels_of_group("machine"), *_gearbox(*contents.gears), *contents.further]
    for b in range(1, contents.blades + 1):
        for row in _rows("blade"):
            index = () if row[-1].startswith("demands.") else (b - 1,)
            channels.append(_channel(row, index, b=b))
        for f in range(1, contents.flaps + 1):
            for row in _rows("flap"):
                place = () if row[-1].startswith("demands.") else (f - 1, b - 1)
                channels.append(_channel(row, place, b=b, f=f))
        for group, number in (("node", contents.nodes), ("station", contents.blade_stations)):
            for n in range(1, number + 1):
                channels += [_channel(row, (b - 1, n - 1), b=b, n=n) for row in _rows(group)]
    channels += channels_of_group("tower_station", contents.tower_stations)
    for name in contents.coordinates:
        unit = unit_of_coordinate(name)
        if name != "yaw":  # yaw has a separate channel
            channels.append(Channel(f"q {name}", "", unit, "-", "-", f"generalised coordinate {name!r}", ("q", name)))
        channels.append(Channel(f"v {name}", "", f"{unit}/s", "-", "-", f"rate of coordinate {name!r}", ("v", name)))
    return {channel.name: channel for channel in channels}


def unit_of_coordinate(name: str) -> str:
    """SI unit of a generalised coordinate."""
    turns = name in ("generator", "drivetrain") or name.endswith(("torsion", "roll", "pitch", "yaw"))
    return "rad" if turns else "m"


def _gearbox(planetary: int, stages: int) -> list[Channel]:
    """Channels of a gearbox, in the order of the table ``GearLoads``."""
    rows = [(row, 1) for row in _rows("main_shaft")] if stages else []
    for n in range(1, stages + 1):
        rows += [(row, n) for row in _rows("planetary" if n <= planetary else "parallel")]
        rows += [(row, n) for row in _rows("stage_shaft" if n < stages else "high_speed_shaft")]
    return [_channel(row, (i,), n=n) for i, (row, n) in enumerate(rows)]


GEARBOX = re.compile(r"main_shaft_torque|high_speed_shaft_torque|stage_\d_.*")


def every_kind() -> dict[str, Channel]:
    """Channels of all kinds that a turbine may have, with the smallest numbers of nodes, stations and flaps."""
    numbered = (*channels_of_group("pile_station", 1), *channels_of_group("line", 1))
    further = sum(map(channels_of_group, ("electrical", "disk", "sea", "frame", "platform")), numbered)
    return catalogue(ChannelSet(nodes=1, flaps=1, gears=(2, 3), further=further))


@cache
def standard() -> dict[str, Channel]:
    """Channels of every three-bladed turbine, without nodes and stations."""
    return catalogue()


def find(name: str, channels: dict[str, Channel]) -> Channel:
    """A channel by its name or one of OpenFAST's, irrespective of case.

    Raises:
      UnknownNameError: the message lists the closest names.
    """
    if not isinstance(name, str):
        raise InputError(f"channels have names, found {name!r}")
    if name in channels:
        return channels[name]
    lower = name.lower()
    for channel in channels.values():
        if any(lower == known.lower() for known in channel.names):
            return channel
    from meltemi.simulation.openfast_only import why_missing

    names = [known for c in channels.values() for known in c.names]
    near = closest(name, names, n=4)
    hint = why_missing(name) or (f"did you mean {', '.join(near)}?" if near else did_you_mean(name, names))
    if re.match(r"(a?b\dn\d|node_)", lower):
        last = max((c.index[1] + 1 for c in channels.values() if c.source[0] == "flow"), default=0)
        hint += f" Blade nodes are numbered 1 to {last}."
    if GEARBOX.fullmatch(lower) and "main_shaft_torque" not in channels:
        hint = "loads of the gearbox need options.drivetrain: quasi_static or multibody"
    if lower in {name.lower() for row in _rows("disk") for name in filter(None, row[:2])}:
        hint = "only a power-coefficient turbine has it"
    if lower.startswith("pile_") or lower in {name.lower() for row in _rows("sea") for name in row[:2]}:
        hint = "only a turbine in the sea has it, with turbine.support" + " or turbine.frame" * (lower[:5] != "pile_")
    if lower in {name.lower() for row in _rows("frame") for name in row[:2]}:
        hint = "only a turbine on a frame in the sea has it, with turbine.frame"
    if lower.startswith("member_") and not any(name.startswith("member_") for name in channels):
        hint = "section loads of members are those of runs of a turbine on a frame, such as nrel5mw-jacket"
    if lower in {row[0] for row in _rows("electrical")}:
        hint = "channels of the electrical system need options.electrical: averaged"
    raise UnknownNameError(f"no channel {name!r}: {hint}")


DEFAULT = (
    "wind_x wind_y wind_z azimuth rotor_speed generator_speed generator_torque generator_power pitch_1 "
    "pitch_2 pitch_3 rotor_thrust rotor_torque rotor_aero_thrust rotor_aero_torque "
    "root_moment_out_of_plane_1 root_moment_out_of_plane_2 root_moment_out_of_plane_3 "
    "root_moment_in_plane_1 root_moment_in_plane_2 root_moment_in_plane_3 root_moment_flap_1 "
    "root_moment_edge_1 tip_out_of_plane_1 tip_in_plane_1 tip_clearance_1 tower_top_fore_aft "
    "tower_top_side_side tower_base_moment_fore_aft tower_base_moment_side_side tower_base_moment_torsion "
    "yaw_moment_x yaw_moment_y yaw_moment_z shaft_tilt_moment shaft_yaw_moment nacelle_yaw"
).split()
"""Channels recorded by default."""
