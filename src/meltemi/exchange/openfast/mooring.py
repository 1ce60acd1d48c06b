"""Mooring lines from MoorDyn 1, MoorDyn 2 and MAP++.

The programs identify tables by the titles of sections and columns by their order, regardless of the header
(MoorDyn.f90 of OpenFAST 5.0.0; manuals of MoorDyn 1 and MAP++). MoorDyn 1 states the number of rows; its library
for other programs does not.
"""

from __future__ import annotations

import math
import re
from typing import Any, Literal

import numpy as np
from scipy.spatial.transform import Rotation

from meltemi.core.errors import InputError, UnsupportedError
from meltemi.exchange.openfast.text import Float, InputFile, begins_with_number, check_header, is_content, number, split
from meltemi.exchange.report import ImportNote, Kind, Notes

Program = Literal["MoorDyn 2", "MoorDyn 1", "MAP++"]
MASS = "MassDen|MassDenAir|MassDenInAir|Mass/m"
LAYOUTS: dict[Program, dict[str, str]] = {
    "MoorDyn 2": {
        "types": f"Name|TypeName|LineType Diam {MASS} EA BA/-zeta EI Cd Ca CdAx CaAx",
        "points": "ID Attachment|Type X Y Z M V CdA Ca",
        "lines": "ID LineType AttachA|NodeA AttachB|NodeB UnstrLen NumSegs",
        "bodies": "ID Attachment X0 Y0 Z0 r0 p0 y0 M|Mass CG I V|Volume CdA Ca",
    },
    "MoorDyn 1": {
        "types": f"Name|TypeName|LineType Diam {MASS} EA BA/-zeta Can Cat Cdn Cdt",
        "points": "ID|Node Type|Attachment X Y Z M V FX FY FZ CdA Ca",
        "lines": "ID|Line LineType UnstrLen NumSegs NodeAnch NodeFair",
    },
    "MAP++": {
        "types": f"Name|LineType Diam {MASS} EA CB CIntDamp Ca Cdn Cdt",
        "points": "ID|Node Type X Y Z M V|B FX FY FZ",
        "lines": "ID|Line LineType UnstrLen NodeAnch NodeFair",
    },
}
SECTIONS = {
    "types": ("LINE DICTIONARY", "LINE TYPES"),
    "rods": ("ROD LIST", "ROD PROPERTIES", "RODS"),
    "bodies": ("BODIES", "BODY LIST", "BODY PROPERTIES"),
    "points": ("POINTS", "CONNECTION PROPERTIES", "NODE PROPERTIES", "POINT PROPERTIES", "POINT LIST"),
    "lines": ("LINES", "LINE PROPERTIES", "LINE LIST"),
    "loads": ("EXTERNAL LOADS",),
    "control": ("CONTROL",),
    "failures": ("FAILURE",),
}
"""Words in the titles of sections, in the order in which MoorDyn looks for them."""
TYPES = {
    "diameter": ("Diam",), "mass": ("MassDen",), "stiffness": ("EA",), "friction": ("CB",), "drag": ("Cd", "Cdn"),
    "axial_drag": ("CdAx", "Cdt"), "added_mass": ("Ca", "Can"), "axial_added_mass": ("CaAx", "Cat"),
    "damping_ratio": ("BA/-zeta",), "bending": ("EI",),
}  # fmt: skip
POINTS = {"kind": ("Attachment", "Type"), "x": ("X",), "y": ("Y",), "z": ("Z",)}
FREE = {"mass": ("M",), "volume": ("V",), "drag_area": ("CdA",), "added_mass": ("Ca",)}
PULLED = {"fx": ("FX",), "fy": ("FY",), "fz": ("FZ",)}
LINES = {"type": ("LineType",), "length": ("UnstrLen",), "a": ("AttachA", "NodeAnch"), "b": ("AttachB", "NodeFair"),
         "segments": ("NumSegs",)}  # fmt: skip
"""Our names of the columns that are read."""
SEGMENTS = 4, 400
"""Least and most segments of a line; all lines have those of the one with the most."""
BED_FRICTION = ("mu_kT", "mu_kA")
"""Options of MoorDyn 2: friction of all lines on the bed, across and along."""
SEABED = ("DEPTH", "SEABED", "GROUND", "FLOOR")
"""Heights of a point on the bed."""


def read_mooring(  # noqa: C901 - a branch for each thing that a line can be attached to
    file: InputFile, depth: float, notes: Notes, *, of_map: bool = False
) -> dict[str, Any]:
    """Read mooring lines (``lines``), the free points where they meet (``points``), and MoorDyn's ``segments``.

    Args:
      depth: [m] water depth, for anchors on the bed.
      notes: notes of the import, which are appended.
      of_map: the file is of MAP++, not of MoorDyn.

    Raises:
      InputError: a table or a value is missing.
      UnsupportedError: lines end at objects other than anchors, free points and the platform.
    """
    sections = _sections(file)
    _refuse(file, sections, notes)
    program: Program = "MAP++" if of_map else "MoorDyn 1" if _is_first(file, sections) else "MoorDyn 2"
    types = _table(file, sections, program, "types", TYPES, notes)
    points = _table(file, sections, program, "points", POINTS | FREE | PULLED, notes)
    bodies = _bodies(file, sections, program, notes)
    lines, free, ends = [], {}, {}

    def note(kind: Kind, what: str, why: str) -> None:
        if (one := ImportNote(kind, file.path.name, what, why)) not in notes:
            notes.append(one)

    for name, (_, point) in points.items():
        kind = point["kind"].lower()
        body, origin, turned = bodies.get(re.sub(r"^b(?=\d+$)", "body", kind), (kind, np.zeros(3), np.eye(3)))
        what = next((w for w, names in ENDS.items() if body in names), None)
        if what is None:
            raise UnsupportedError(
                f"{file.path}: point {name} is of kind {point['kind']!r}: lines end at anchors, free points and the "
                "platform"
            )
        z = -depth if point["z"].upper() in SEABED else _number(file, point["z"])
        place = [_number(file, point["x"]), _number(file, point["y"]), z]
        ends[name] = what, (origin + turned @ place).tolist()
        if what == "fairlead" and any(_number(file, point.get(each, "0")) for each in ("mass", "volume", "drag_area")):
            why = "mass, volume and drag of a point on the platform are not part of it; add them to the platform"
            note("ignored", f"point {name}", why)
        if what == "free":
            if any(number(point.get(axis, "0")) for axis in PULLED):
                raise UnsupportedError(f"{file.path}: point {name} has forces FX, FY, FZ, which are not modelled")
            free[f"point{name}"] = {key: _number(file, point[key]) for key in FREE if key in point}
    rows = [row for _, row in _table(file, sections, program, "lines", LINES, notes).values()]
    for row in rows:
        row |= {end: re.sub(r"^(point|p)(?=\d+$)", "", row[end], flags=re.IGNORECASE) for end in "ab"}
    for row in rows:
        if row["type"] not in types or not {row["a"], row["b"]} <= set(ends):
            raise InputError(f"{file.path}: line {row} names a type or point that the tables do not have")
    steps = _steps({name: what for name, (what, _) in ends.items()}, [(row["a"], row["b"]) for row in rows])
    for row in rows:
        properties = types[row["type"]][1]
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
        values = {name: _number(file, text) for name, text in properties.items() if name != "bending"}
        for name, why in (("stiffness", "the static stiffness"), ("damping_ratio", "the static damping")):
            if "|" in properties.get(name, ""):
                note("approximated", f"{row['type']}: {properties[name]}", why)
        if properties.get("bending", "0").strip("0.eE+-"):
            note("ignored", f"{row['type']}: EI {properties['bending']}", "lines have no bending stiffness")
        if values.get("damping_ratio", 0.0) < 0.0:
            values["damping_ratio"] *= -1.0
        else:  # damping in N s has no equivalent
            values.pop("damping_ratio", None)
        if (friction := file.find(BED_FRICTION[1])) is not None:
            values["friction"] = _number(file, friction.values[0])
        lines.append(places | values | {"length": _number(file, row["length"])})
    turns = next((split(line)[1:] for line in file.lines if line.lower().split()[:1] == ["repeat"]), [])
    systems = [(lines, free), *(_turned(lines, free, _number(file, text), f"_{text}") for text in turns)]
    every = {name: point for _, each in systems for name, point in each.items()}
    segments = [_number(file, row["segments"]) for row in rows if "segments" in row]
    return {
        "lines": [line for each, _ in systems for line in each],
        **({"points": every} if every else {}),
        **({"segments": int(np.clip(max(segments), *SEGMENTS))} if segments else {}),
    }


ENDS = {
    "anchor": ("fixed", "fix", "anchor"),
    "fairlead": ("vessel", "ves", "coupled", "cpld"),
    "free": ("free", "connect", "connection", "con", "point", "p"),
}


def _steps(kinds: dict[str, str], lines: list[tuple[str, str]]) -> dict[str, float]:
    """Number of lines from each point to the platform, largest for anchors; it orders the ends of lines upwards."""
    steps = {name: 0.0 if what == "fairlead" else math.inf for name, what in kinds.items()}
    for _ in lines:
        for a, b in (*lines, *(both[::-1] for both in lines)):
            if kinds[b] == "free":
                steps[b] = min(steps[b], steps[a] + 1.0)
    return steps


def _turned(lines: list[Any], free: dict[str, Any], degrees: float, end: str) -> tuple[list[Any], dict[str, Any]]:
    """Lines and points rotated about the vertical, with a suffix to the names of the points."""
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))

    def turn(place: Any) -> Any:
        if isinstance(place, str):
            return place + end
        return [c * place[0] - s * place[1], s * place[0] + c * place[1], place[2]]

    turned = [line | {name: turn(line[name]) for name in ("fairlead", "anchor")} for line in lines]
    return turned, {name + end: point for name, point in free.items()}


def _number(file: InputFile, text: str) -> float:
    value = number(text.lstrip("#").split("|")[0]) if text != "#" else 0.0
    if value is None:
        raise InputError(f"{file.path}: expected a number, found {text!r}")
    return value


def _sections(file: InputFile) -> dict[str, list[int]]:
    """Line numbers (from 1) of the content of each section by its kind, without outputs and options."""
    sections: dict[str, list[int]] = {}
    kind = ""
    for i, line in enumerate(file.lines, 1):
        if "---" in line:
            title = line.upper()
            kind = next((kind for kind, words in SECTIONS.items() if any(word in title for word in words)), "")
        elif kind and is_content(line):
            sections.setdefault(kind, []).append(i)
    return sections


def _is_first(file: InputFile, sections: dict[str, list[int]]) -> bool:
    """Whether a file is of MoorDyn 1: it states numbers of rows, or has the columns of its library (``Lines.dll``)."""
    types, lines = ([split(file.lines[i - 1]) for i in sections.get(kind, ())] for kind in ("types", "lines"))
    if types and begins_with_number(types[0]):
        return True
    narrow = len(types) > 2 and all(len(row) == len(LAYOUTS["MoorDyn 1"]["types"].split()) for row in types[2:])
    return narrow and bool(lines) and "nodeanch" in [word.lower() for word in lines[0]]


def _refuse(file: InputFile, sections: dict[str, list[int]], notes: Notes) -> None:
    for kind, what in (("rods", "rods"), ("loads", "external loads")):
        if rows := sections.get(kind, [])[2:]:
            raise UnsupportedError(f"{file.at(rows[0])}: {what} of MoorDyn are not modelled")
    for kind, what in (("control", "control of line lengths"), ("failures", "failures of lines")):
        if sections.get(kind, [])[2:]:
            notes.add("ignored", file.path.name, what, "lines keep their length")


def _table(
    file: InputFile,
    sections: dict[str, list[int]],
    program: Program,
    kind: str,
    names: dict[str, tuple[str, ...]],
    notes: Notes,
) -> dict[str, tuple[int, dict[str, str]]]:
    """Rows of a section by their first word, with line numbers; without columns that the program does not have."""
    if kind not in sections:
        raise InputError(
            f"{file.path}: no section of {kind}: expected a line of dashes with {' or '.join(SECTIONS[kind])}, as "
            f"{program} reads it"
        )
    lines = sections[kind]
    if begins_with_number(split(file.lines[lines[0] - 1]) if lines else []):  # a number of rows
        lines = lines[1:]
    order = LAYOUTS[program][kind].split()
    first = [name.split("|")[0] for name in order]
    places = {key: first.index(each) for key, known in names.items() for each in known if each in first}
    if lines:
        check_header(f"{file.path.name}:{lines[0]}", split(file.lines[lines[0] - 1]), order, [*places.values()], notes)
    rows = {}
    for line in lines[2:]:
        row = split(file.lines[line - 1])
        if len(row) < len(order):
            raise InputError(
                f"{file.at(line)}: the table of {kind} has {len(order)} columns or more in {program} "
                f"({' '.join(first)}), found {len(row)} words"
            )
        rows[row[0]] = (line, {key: row[place] for key, place in places.items()})
    return rows


def _bodies(
    file: InputFile, sections: dict[str, list[int]], program: Program, notes: Notes
) -> dict[str, tuple[str, Float, Float]]:
    """Attachment, position (3,) [m] and orientation (3, 3) of each body, named as ``body1``."""
    if program != "MoorDyn 2" or "bodies" not in sections:
        return {}
    names: dict[str, tuple[str, ...]] = {
        name: (name,) for name in ("Attachment", "X0", "Y0", "Z0", "r0", "p0", "y0", "M", "V")
    }
    bodies = {}
    for number_of, (line, row) in _table(file, sections, program, "bodies", names, notes).items():
        kind = row["Attachment"].lower()
        if kind not in (*ENDS["anchor"], *ENDS["fairlead"]):
            raise UnsupportedError(
                f"{file.at(line)}: body {number_of} is {row['Attachment']}: only bodies that are fixed"
            )
        if any(_number(file, row[name]) for name in ("M", "V")):
            what = f"body {number_of}"
            notes.add("ignored", file.path.name, what, "its mass and volume are not part of the platform")
        angles = np.radians([_number(file, row[name]) for name in ("r0", "p0", "y0")])
        if angles.any() and kind in ENDS["fairlead"]:
            # MD_CalcContStateDeriv takes them from the mesh of the body, whose reference is this matrix and not its
            # transpose
            why = "turned as MoorDyn begins; in the run OpenFAST 5.0.0 turns it the other way: make its points Vessel"
            notes.add("warning", f"{file.path.name}:{line}", f"body {number_of}: r0, p0, y0", why)
        place = np.array([_number(file, row[name]) for name in ("X0", "Y0", "Z0")])
        bodies[f"body{number_of}"] = kind, place, _orientation(*angles)
    return bodies


def _orientation(roll: float, pitch: float, yaw: float) -> Float:
    """(3, 3) rotation from body axes to those of the sea, Rx Ry Rz of its angles [rad] (Body_Setup, EulerConstruct)."""
    orientation: Float = Rotation.from_euler("XYZ", [roll, pitch, yaw]).as_matrix()
    return orientation
