"""Conversion of names, signs and units of OpenFAST's output files, in both directions."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from meltemi.compiler import MAX_FLAPS
from meltemi.core.errors import InputError
from meltemi.simulation.channels import Channel, ChannelSet, catalogue, channels_of_group
from meltemi.simulation.result import Result

Float = NDArray[np.float64]

_DEG = math.pi / 180.0
_SI = "s Hz rad rad/s rad/s^2 m m^2 m/s m/s^2 kg A J Pa K kg/m^3 -"
_ANGULAR = {
    "deg": ("rad", _DEG),
    "deg/s": ("rad/s", _DEG),
    "deg/s^2": ("rad/s^2", _DEG),
    "rpm": ("rad/s", math.pi / 30.0),
}
_PREFIXED = (
    *(("N", "N", "kM"), ("N-m", "N m", "kM"), ("N/m", "N/m", "k"), ("N-m/m", "N m/m", "k")),
    *(("W", "W", "kM"), ("var", "var", "k"), ("V", "V", "k")),
)
UNITS: dict[str, tuple[str, float]] = {
    **{unit: (unit, 1.0) for unit in _SI.split()},
    **_ANGULAR,
    **{unit: (si, 1.0) for unit, si, _ in _PREFIXED},
    **{prefix + unit: (si, {"k": 1e3, "M": 1e6}[prefix]) for unit, si, each in _PREFIXED for prefix in each},
}
"""OpenFAST's unit -> SI unit, factor."""
_SPELLINGS = (("**", "^"), ("/s/s", "/s^2"), ("*", "-"), ("·", "-"), (" ", "-"), ("sec", "s"), ("Nm", "N-m"))
OURS = "Result of meltemi"
"""Beginning of the description in files that meltemi wrote."""
_INVALID = "invalid"
"""OpenFAST's unit of channels that could not be computed; their values are 0."""
MOST = 300
"""Largest number of nodes and stations."""
GEARS = 5
"""Largest number of gearbox stages."""
EVEN = 0.1
"""Tolerance of a uniform time grid over the time step, for times that are written with few digits."""


@dataclass(frozen=True)
class OutputColumns:
    """The table of an OpenFAST output file.

    Attributes:
      names, units: names and units of the columns as written; units without parentheses.
      time: (T,) [s].
      data: (T, C) values in these units, without the time.
      description: description of the run.
      warning: message if the file is cut.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    time: Float
    data: Float
    description: str = ""
    warning: str = ""


def si_unit(text: str) -> tuple[str, float]:
    """SI unit and conversion factor of a unit in OpenFAST's spelling; unknown units are kept."""
    unit = text.strip().strip("()").strip()
    for theirs, ours in _SPELLINGS:
        unit = unit.replace(theirs, ours)
    return UNITS.get(unit or "-", (text.strip().strip("()").strip(), 1.0))


def result_of(columns: OutputColumns, path: Path) -> Result:
    """A result in SI units, with meltemi's channels where the catalogue contains them.

    Names are those of the catalogue, with the sign reversed where OpenFAST's name begins with ``-``, ``_``, ``M`` or
    ``m``. Channels of numbered nodes and stations keep their names, since the numbers are those of another
    discretisation, unless meltemi wrote the file. Channels that the catalogue does not contain, or in another unit,
    keep their names, too.

    Raises:
      InputError: the times do not increase.
    """
    time = _even(columns.time)
    if not (np.all(np.isfinite(time)) and np.all(np.diff(time) > 0.0)):
        raise InputError(f"{path}: the times in it do not increase from row to row: the file is damaged")
    ours = columns.description.startswith(OURS)
    known = _known(columns.names if ours else ())
    series: dict[str, tuple[Channel, Float]] = {}
    invalid = []
    for i, (name, text) in enumerate(zip(columns.names, columns.units, strict=True)):
        unit, factor = si_unit(text)
        if unit.lower() == _INVALID:
            invalid.append(name)
            continue
        sign, channel = _mapped(name, known)
        if channel is None or channel.unit != unit or channel.name in series:
            sign, channel = 1, Channel(name, "", unit, "-", "-", "channel of OpenFAST", ("file", name))
        if channel.name not in series:  # of two columns of one name the first counts, as for OpenFAST's tools
            series[channel.name] = (channel, columns.data[:, i] * (sign * factor))
    meta: dict[str, object] = {"file": path.name, "description": columns.description}
    warnings = [columns.warning] if columns.warning else []
    if invalid:
        warnings.append(f"omitted, since OpenFAST could not compute them: {', '.join(invalid)}")
    if warnings:
        meta["warnings"] = warnings
    data = np.stack([x for _, x in series.values()], axis=1) if series else np.zeros((len(time), 0))
    return Result(time, data, tuple(c for c, _ in series.values()), meta=meta)


def columns_of(result: Result) -> OutputColumns:
    """A result in OpenFAST's names and units; other channels keep their names, with ``_`` for blanks."""
    columns = [_written(c) for c in result.channels]
    factors = np.array([factor for _, _, factor in columns])
    about = f"{result.meta.get('turbine', '')}: {result.meta.get('wind', '')}".strip(": ")
    title = " ".join(f"{OURS} {result.meta.get('version', '')} {about} {result.message}".split())
    return OutputColumns(
        names=tuple(name for name, _, _ in columns),
        units=tuple(unit for _, unit, _ in columns),
        time=result.time,
        data=result.data * factors,
        description=str(result.meta.get("description", title)),
    )


def _written(channel: Channel) -> tuple[str, str, float]:
    unit, factor = channel.display_unit
    if channel.alias.startswith(("RtFld", "RtAero")):  # AeroDyn gives loads and power of the rotor in N, N m and W
        unit, factor = channel.unit, 1.0
    return (channel.alias or channel.name).replace(" ", "_"), unit.replace(" ", "-"), factor


def _known(names: tuple[str, ...]) -> dict[str, Channel]:
    """Channels by all their lower-case names, with as many nodes, stations and flaps as ``names`` require."""
    last = min(max((int(n) for name in names for n in re.findall(r"\d+", name)), default=0), MOST)
    disk = channels_of_group("disk")
    floats = any(re.match("ptfmsurge|fairten", name, re.IGNORECASE) for name in names)  # HydroFxi is of either support
    water, numbered = (("platform",), "line") if floats else (("sea", "frame"), "pile_station")
    every = catalogue(ChannelSet(further=disk))
    if names:
        stations = channels_of_group(numbered, min(last, 9))
        further = sum(map(channels_of_group, ("electrical", *water)), stations) + disk
        every = catalogue(ChannelSet(3, last, last, last, flaps=MAX_FLAPS, gears=(0, GEARS), further=further))
        every |= catalogue(ChannelSet(0, gears=(GEARS, GEARS + 1)))  # a stage may be of either kind
    known = {name.lower(): channel for channel in every.values() for name in channel.names}
    for name in names:  # coordinates have names of their model
        if re.match(r"[qv]_", name):
            coordinate = name.replace("_", " ")
            unit = "rad" if re.search(r"yaw|generator|drivetrain|torsion$", coordinate) else "m"
            unit += "/s" if coordinate[0] == "v" else ""
            what = f"{'rate of' if coordinate[0] == 'v' else 'generalised'} coordinate {coordinate[2:]!r}"
            known[name.lower()] = Channel(coordinate, "", unit, "-", "-", what, (coordinate[0], coordinate[2:]))
    return known


def _mapped(name: str, known: dict[str, Channel]) -> tuple[int, Channel | None]:
    """Sign and channel of a column; a leading ``M`` is a sign only if the whole is not a channel name."""
    lower = name.lower()
    if lower in known:
        return 1, known[lower]
    return -1, known.get(lower[1:]) if lower[:1] in ("-", "_", "m") else None


def _even(time: Float) -> Float:
    """The times, restored to a uniform grid if they differ from one by rounding only."""
    if len(time) < 3 or not np.all(np.isfinite(time)):
        return time
    grid = np.linspace(time[0], time[-1], len(time))
    return grid if np.max(np.abs(time - grid)) <= EVEN * abs(grid[1] - grid[0]) else time
