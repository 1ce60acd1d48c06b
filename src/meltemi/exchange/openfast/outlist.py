"""Channels of a case for the output lists of a deck.

OpenFAST numbers output nodes and gages, meltemi all nodes and stations: ``B1N3Alpha`` is at node ``BlOutNd(3)`` of
AeroDyn, and ``Spn2MLyb1`` at gage 2, which is the middle of element ``BldGagNd(2)`` of the ``BldNodes`` equal ones of
ElastoDyn (``Coeff`` in ElastoDyn.f90).
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from meltemi.cases.recordable import recordable
from meltemi.core.errors import InputError
from meltemi.exchange.openfast.text import InputFile
from meltemi.exchange.openfast.values import Values
from meltemi.exchange.report import Notes
from meltemi.simulation.channels import Channel, ChannelSet, catalogue, channels_of_group, find
from meltemi.turbine.definition import Turbine

OF_NODE = re.compile(r"B(\d)N(\d)([A-Za-z]\w*)", re.IGNORECASE)
OF_GAGE = {"blade": re.compile(r"Spn\d[FM]L.b\d", re.IGNORECASE), "tower": re.compile(r"TwHt\d[FM]L.t", re.IGNORECASE)}
SIGNS = "-_mM"
"""Before a name they turn the sign (SetOutParam)."""


@dataclass(frozen=True)
class Output:
    """Output of a case for the output lists of a deck.

    Attributes:
      channels: channels by the names of meltemi.
      blade_stations, tower_stations: [m] positions of the gages whose loads are listed.
    """

    channels: tuple[str, ...] = ()
    blade_stations: tuple[float, ...] = ()
    tower_stations: tuple[float, ...] = ()


def outputs(files: Sequence[InputFile], v: Values, aero: Values, turbine: Turbine, notes: Notes) -> Output:
    """Channels of the output lists of files, with a note on each name, or on all that are missing for the same reason.

    Args:
      files: files with output lists.
      v, aero: values of ElastoDyn, with gages, and of AeroDyn, with output nodes.
      turbine: turbine of the deck.
      notes: notes on the deck, which are appended.
    """
    lists = [(file, line, name) for file in files for line, name in requested(file)]
    nodes = _first(aero, "output_nodes", "output_count")
    if not any(OF_NODE.fullmatch(name) for *_, name in lists):
        aero.unneeded("no channel of OutList is at a node", "output_nodes", "output_count")
    lengths = {"blade": v["tip_radius"] - v["hub.radius"], "tower": float(np.ptp(turbine.tower.position))}
    gages: dict[str, tuple[float, ...]] = dict.fromkeys(OF_GAGE, ())
    for part, pattern in OF_GAGE.items():
        if any(pattern.fullmatch(name) for *_, name in lists):
            gages[part] = _gages(v, part, lengths[part])
        else:
            targets = (f"{part}_gages", f"{part}_gage_nodes", f"{part}_elements")
            v.unneeded("no channel of OutList is at a gage, and the discretisation is that of ModelOptions", *targets)
    available = _available(turbine, len(gages["blade"]), len(gages["tower"]))
    chosen: dict[str, None] = {}
    without: dict[tuple[str, str], list[str]] = {}
    for file, line, name in lists:
        at_node = OF_NODE.fullmatch(name)
        if file.module == "AeroDyn" and at_node and int(at_node[2]) > len(nodes):
            without.setdefault((file.path.name, f"AeroDyn has {len(nodes)} output nodes (NBlOuts)"), []).append(name)
            continue
        wanted = _unsigned(_of_node(name, nodes), available)
        try:
            channels, missing = recordable([wanted], available)
        except InputError as error:
            channels, missing = (), {wanted: f"OpenFAST 5 has it neither: {str(error).partition(': ')[2]}"}
        where = f"{file.path.name}:{line}"
        if channels:
            channel = find(wanted, available)
            chosen[channel.name] = None
            notes.add("used", where, name, f"channel {channel.name}")
        for why in missing.values():
            without.setdefault((file.path.name, why), []).append(name)
    for (where, why), names in without.items():
        notes.add("ignored", where, f"OutList: {', '.join(names)}", f"not recorded: {why}")
    return Output(tuple(chosen), gages["blade"], gages["tower"])


def requested(file: InputFile) -> Iterator[tuple[int, str]]:
    """Line number and name of each channel of a file's output list, without the second list, that of all nodes."""
    inside = False
    for i, text in enumerate(file.lines, 1):
        bare = text.strip()
        if inside:
            quoted = re.match(r"""["']([^"']*)["']?""", bare)
            if (quoted[1] if quoted else bare).strip().upper().startswith("END") or bare.startswith("---"):
                return
            if bare and bare[0] not in "!#%":
                words = quoted[1] if quoted else bare if file.module == "mooring" else bare.split()[0]
                names = re.split(r"[\s,;]+", words.partition(" - ")[0].strip())
                yield from ((i, name) for name in names if name)
        elif bare.startswith("---"):
            title = bare.upper()
            inside = (
                "OUTPUT CHANNELS" in title or "OUTLIST" in title or (file.module == "mooring" and "OUTPUT" in title)
            )
        else:
            inside = any(word.lower() == "outlist" for word in bare.split()[:2])


def _available(turbine: Turbine, blade_stations: int, tower_stations: int) -> dict[str, Channel]:
    """Channels of the model of a deck with the nodes of its blade file."""
    further: tuple[Channel, ...] = ()
    if turbine.platform is not None:
        further = channels_of_group("platform") + channels_of_group("line", len(turbine.platform.lines))
    elif turbine.substructures:
        piles = turbine.support.load_stations if turbine.support is not None else ()
        further = channels_of_group("sea") + channels_of_group("pile_station", len(piles))
        further += channels_of_group("frame") if turbine.frame is not None else ()
    nodes = len(turbine.blade.aerodynamics.position)
    return catalogue(ChannelSet(turbine.n_blades, nodes, blade_stations, tower_stations, further=further))


def _of_node(name: str, nodes: Sequence[int]) -> str:
    """Channel name of an output node with the number of its node in the model."""
    match = OF_NODE.fullmatch(name)
    if match is None or not 1 <= int(match[2]) <= len(nodes):
        return name  # BeamDyn's nodes and those of members have other names
    return f"AB{match[1]}N{nodes[int(match[2]) - 1]:03d}{match[3]}"


def _unsigned(name: str, available: dict[str, Channel]) -> str:
    """A name without its leading sign, if it is no channel with it."""
    if name[0] in "-_":
        return name[1:]
    known = {other.lower() for channel in available.values() for other in channel.names}
    return name[1:] if name[0] in SIGNS and name.lower() not in known and name[1:].lower() in known else name


def _gages(v: Values, part: str, length: float) -> tuple[float, ...]:
    """Positions [m] of ElastoDyn's gages from the blade root or from the tower base."""
    nodes = _first(v, f"{part}_gage_nodes", f"{part}_gages")
    many = v.given(f"{part}_elements", 0)
    return tuple((node - 0.5) / many * length for node in nodes if 1 <= node <= many)


def _first(v: Values, target: str, count: str) -> tuple[int, ...]:
    """The first nodes of a list, as many as another keyword states."""
    return tuple(int(node) for node in v.given(target, ())[: max(v.given(count, 0), 0)])
