"""Mooring lines from MoorDyn 1, MoorDyn 2 and MAP++: tables of line types, points and lines, whatever their order."""

from __future__ import annotations

import math
from typing import Any

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
LINES = {"type": ("linetype",), "length": ("unstrlen",), "a": ("attacha", "nodeanch"), "b": ("attachb", "nodefair")}
"""Columns by the names that the three programs give them."""
BED_FRICTION = ("mu_kT", "mu_kA")
"""Options of MoorDyn 2: friction of all lines on the bed, across and along."""


def read_lines(file: InputFile, depth: float) -> list[dict[str, Any]]:
    """Mooring lines, each between an anchor and the platform.

    Args:
      depth: [m] of the water, for anchors at "depth".

    Raises:
      InputError: a table or a value is missing.
      UnsupportedError: lines that meet in free points, or other things than one line from anchor to platform.
    """
    types, points = _table(file, TYPES, "diameter"), _table(file, POINTS, "kind")
    found = []
    for _, row in _table(file, LINES, "length").values():
        ends = [points.get(row[name]) for name in "ab"]
        kind = types.get(row["type"])
        if kind is None or None in ends:
            raise InputError(f"{file.path}: line {row} names a type or point that the tables do not have")
        places = {}
        for _, point in filter(None, ends):
            what = next((w for w, names in ENDS.items() if point["kind"].lower() in names), None)
            if what is None or what in places:
                raise UnsupportedError(
                    f"{file.path}: a line ends at a point of kind {point['kind']!r}: each line goes from an anchor to "
                    "the platform, without free points and bridles"
                )
            z = -depth if point["z"].lower() == "depth" else _number(file, point["z"])
            places[what] = [_number(file, point["x"]), _number(file, point["y"]), z]
        values = {name: _number(file, text) for name, text in kind[1].items()}
        if values.get("damping_ratio", 0.0) < 0.0:
            values["damping_ratio"] *= -1.0
        else:  # a damping in N s has no counterpart
            values.pop("damping_ratio", None)
        if (friction := file.find(BED_FRICTION[1])) is not None:
            values["friction"] = _number(file, friction.values[0])
        found.append(places | values | {"length": _number(file, row["length"])})
    turns = next((split(line)[1:] for line in file.lines if line.split()[:1] == ["repeat"]), [])
    return found + [_turned(line, math.radians(_number(file, text))) for text in turns for line in found]


ENDS = {"anchor": ("fixed", "fix", "anchor"), "fairlead": ("vessel", "coupled", "coupledpinned", "body1")}


def _turned(line: dict[str, Any], angle: float) -> dict[str, Any]:
    c, s = math.cos(angle), math.sin(angle)
    turned = {n: [c * x - s * y, s * x + c * y, z] for n in ENDS for x, y, z in [line[n]]}
    return line | turned


def _number(file: InputFile, text: str) -> float:
    value = number(text.lstrip("#"))
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
