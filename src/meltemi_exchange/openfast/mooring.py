"""Mooring lines from MoorDyn 1, MoorDyn 2 and MAP++: tables of line types, points and lines, whatever their order."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from meltemi.core.errors import InputError, UnsupportedError
from meltemi_exchange.openfast.text import InputFile, number, split

TYPES = {
    "diameter": ("diam",),
    "mass": ("massden", "massdenair", "massdeninair"),
    "stiffness": ("ea",),
    "friction": ("cb",),
    "drag": ("cd", "cdn"),
    "axial_drag": ("cdax", "cdt"),
    "added_mass": ("ca", "can"),
    "axial_added_mass": ("caax", "cat"),
    "damping_ratio": ("ba/-zeta",),
}
POINTS = {"kind": ("type", "attachment"), "x": ("x",), "y": ("y",), "z": ("z",)}
FREE = {"mass": ("m",), "volume": ("v",), "drag_area": ("cda",), "added_mass": ("ca",)}
PULLED = {"fx": ("fx",), "fy": ("fy",), "fz": ("fz",)}
LINES = {
    "type": ("linetype",),
    "length": ("unstrlen",),
    "a": ("attacha", "nodeanch"),
    "b": ("attachb", "nodefair"),
    "segments": ("numsegs",),
}
"""Columns by the names that the three programs give them."""
SEGMENTS = 4, 400
"""Least and most segments of a line; all lines have those of the one with the most."""
BED_FRICTION = ("mu_kT", "mu_kA")
"""Options of MoorDyn 2: friction of all lines on the bed, across and along."""


def read_mooring(file: InputFile, depth: float) -> dict[str, Any]:
    """Mooring lines (``lines``), the free points where they meet (``points``), and MoorDyn's ``segments``.

    Args:
      depth: [m] of the water, for anchors at "depth".

    Raises:
      InputError: a table or a value is missing.
      UnsupportedError: lines end at other things than anchors, free points and the platform.
    """
    types, points = _table(file, TYPES, "diameter"), _table(file, POINTS | FREE | PULLED, "kind")
    lines, free, ends = [], {}, {}
    for name, (_, point) in points.items():
        what = next((w for w, names in ENDS.items() if point["kind"].lower() in names), None)
        if what is None:
            raise UnsupportedError(
                f"{file.path}: point {name} is of kind {point['kind']!r}: lines end at anchors, free points and the "
                "platform"
            )
        z = -depth if point["z"].lower() == "depth" else _number(file, point["z"])
        ends[name] = what, [_number(file, point["x"]), _number(file, point["y"]), z]
        if what == "free":
            if any(number(point.get(axis, "0")) for axis in PULLED):
                raise UnsupportedError(f"{file.path}: point {name} has forces FX, FY, FZ, which have no counterpart")
            free[f"point{name}"] = {key: _number(file, point[key]) for key in FREE if key in point}
    rows = [row for _, row in _table(file, LINES, "length").values()]
    for row in rows:
        if row["type"] not in types or not {row["a"], row["b"]} <= set(ends):
            raise InputError(f"{file.path}: line {row} names a type or point that the tables do not have")
    steps = _steps({name: what for name, (what, _) in ends.items()}, [(row["a"], row["b"]) for row in rows])
    for row in rows:
        kind = types[row["type"]]
        up, low = sorted((row["a"], row["b"]), key=steps.__getitem__)
        places: dict[str, Any] = {}
        for name, end, other in (("fairlead", up, "anchor"), ("anchor", low, "fairlead")):
            what, place = ends[end]
            if what == other:
                raise UnsupportedError(
                    f"{file.path}: points {up} and {low} of a line are both of kind {points[up][1]['kind']!r}: lines "
                    "go from the platform to an anchor, directly or through free points"
                )
            places[name] = f"point{end}" if what == "free" else place
        values = {name: _number(file, text) for name, text in kind[1].items()}
        if values.get("damping_ratio", 0.0) < 0.0:
            values["damping_ratio"] *= -1.0
        else:  # a damping in N s has no counterpart
            values.pop("damping_ratio", None)
        if (friction := file.find(BED_FRICTION[1])) is not None:
            values["friction"] = _number(file, friction.values[0])
        lines.append(places | values | {"length": _number(file, row["length"])})
    turns = next((split(line)[1:] for line in file.lines if line.split()[:1] == ["repeat"]), [])
    found = [(lines, free), *(_turned(lines, free, _number(file, text), f"_{text}") for text in turns)]
    every = {name: point for _, each in found for name, point in each.items()}
    segments = [_number(file, row["segments"]) for row in rows if "segments" in row]
    return {
        "lines": [line for each, _ in found for line in each],
        **({"points": every} if every else {}),
        **({"segments": int(np.clip(max(segments), *SEGMENTS))} if segments else {}),
    }


ENDS = {
    "anchor": ("fixed", "fix", "anchor"),
    "fairlead": ("vessel", "coupled", "coupledpinned", "body1"),
    "free": ("free", "connect", "connection"),
}


def _steps(kinds: dict[str, str], lines: list[tuple[str, str]]) -> dict[str, float]:
    """Lines between each point and the platform, most of all for anchors: lines go upwards along them."""
    steps = {name: 0.0 if what == "fairlead" else math.inf for name, what in kinds.items()}
    for _ in lines:
        for a, b in (*lines, *(both[::-1] for both in lines)):
            if kinds[b] == "free":
                steps[b] = min(steps[b], steps[a] + 1.0)
    return steps


def _turned(lines: list[Any], free: dict[str, Any], degrees: float, end: str) -> tuple[list[Any], dict[str, Any]]:
    """Lines and points turned about the vertical, the names of the points with another end."""
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))

    def turn(place: Any) -> Any:
        return (
            place + end
            if isinstance(place, str)
            else [c * place[0] - s * place[1], s * place[0] + c * place[1], place[2]]
        )

    turned = [line | {name: turn(line[name]) for name in ("fairlead", "anchor")} for line in lines]
    return turned, {name + end: point for name, point in free.items()}


def _number(file: InputFile, text: str) -> float:
    value = number(text.lstrip("#")) if text != "#" else 0.0
    if value is None:
        raise InputError(f"{file.path}: expected a number, found {text!r}")
    return value


def _table(file: InputFile, names: dict[str, tuple[str, ...]], sign: str) -> dict[str, tuple[int, dict[str, str]]]:
    """Rows by their first word, with their lines; the header is known by the column ``sign``."""
    for at, line in enumerate(file.lines):
        header = [word.lower() for word in split(line)]
        places = {key: header.index(word) for key, known in names.items() for word in known if word in header[1:]}
        if sign not in places or len(places) < min(len(names), 4):
            continue
        found = {}
        for i in range(at + 2, len(file.lines)):
            row = split(file.lines[i])
            if not row or row[0].startswith("---"):
                break
            if len(row) <= max(places.values()):
                raise InputError(f"{file.at(i + 1)}: the table has columns {' '.join(header)}, found {len(row)} words")
            found[row[0]] = (i + 1, {key: row[place] for key, place in places.items()})
        return found
    raise InputError(f"{file.path}: no table of mooring {'/'.join(names[sign])}; expected MoorDyn or MAP++ input")
