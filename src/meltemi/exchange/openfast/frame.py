"""Frames of many members from SubDyn, in the formats of OpenFAST 3 to 5.

Tables are read by position. OpenFAST 5 adds the number of the transition piece at interface joints, rectangular
sections, and the spin of a member in place of a matrix of its axes.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from meltemi.core.errors import InputError, UnsupportedError
from meltemi.exchange.openfast.text import Float, InputFile, number, read_input, split
from meltemi.exchange.openfast.tower import LUMP, springs
from meltemi.exchange.openfast.values import Values
from meltemi.exchange.report import Notes
from meltemi.frames.definition import Frame
from meltemi.frames.finite_elements import assemble
from meltemi.structure.beam import transfer

BEAMS = {"1": "tube", "1c": "tube", "1r": "rectangle", "4": "general"}
"""Kind of section by type of member."""
OTHERS = {
    "2": ("cable", "NCablePropSets", ("axial_stiffness", "line_mass", "pretension")),
    "3": ("rigid", "NRigidPropSets", ("line_mass",)),
    "5": ("spring", "NSpringPropSets", tuple(f"k{i}{j}" for i in range(1, 7) for j in range(i, 7))),
}
"""Kind of other members by their type, table and columns of their properties."""
JOINTS = {2: "universal", 3: "pin", 4: "ball"}
"""Kind of release by type of joint."""
SECTIONS: dict[str, tuple[tuple[str, ...], str]] = {
    "tube": (("NPropSetsCyl", "NPropSets"), "diameter thickness"),
    "rectangle": (("NPropSetsRec",), "width height thickness"),
    "general": (("NXPropSets",), "area shear_area_x shear_area_y inertia_x inertia_y torsion"),
}
"""Keywords of the tables of sections, and their columns after elastic modulus, shear modulus and density."""
HELD = 1e13
"""[N/m, N m/rad] spring in a direction that is fixed at a foot that is free in others."""


@dataclass(frozen=True)
class Row:
    """A row of a table: its words and their line in the file."""

    file: InputFile
    line: int
    words: list[str]

    def error(self, text: str) -> InputError:
        """An error with file and line."""
        return InputError(f"{self.file.at(self.line)}: {text}")

    def numbers(self, first: int, last: int | None = None) -> list[float]:
        """Numbers from one column up to another, by default the end.

        Raises:
          InputError: one is not a number.
        """
        values = [number(word.strip("'\"")) for word in self.words[first:last]]
        if None in values:
            column = first + values.index(None)
            raise self.error(f"expected a number in column {column + 1}, found {self.words[column]!r}")
        return [value for value in values if value is not None]

    def name(self, letter: str, column: int = 0) -> str:
        """Name of a joint, member or section by its number in a column."""
        return f"{letter}{int(self.numbers(column, column + 1)[0])}"


def table(file: InputFile, names: Sequence[str], least: int, notes: Notes) -> list[Row]:
    """Rows of a table; none if the file does not have it.

    Raises:
      InputError: the table is malformed; a row has fewer words than ``least``.
    """
    entry = file.find(*names)
    count = 0 if entry is None else file.count(entry)
    if entry is None or not count:
        return []
    rows = [Row(file, line, words) for line, words in file.rows(entry, count, notes=notes)[1]]
    for row in rows:
        if len(row.words) < least:
            raise row.error(f"the table of {entry.name} has {least} columns or more, found {len(row.words)}")
    return rows


class SubDyn:
    """Tables of a SubDyn file as keys of ``Frame``.

    Attributes:
      joints: positions (3,) [m] by name.
      places: file and line of joints, sections and members by their key path.
    """

    def __init__(self, file: InputFile, notes: Notes) -> None:
        self.file, self.notes = file, notes
        self.v = Values(notes, replace(file, module="SubDyn frame"))
        self.new = file.find("NPropSetsRec") is not None
        self.joint_rows = table(file, ["NJoints"], 4, notes)
        self.joints = {row.name("J"): np.array(row.numbers(1, 4)) for row in self.joint_rows}
        self.places = {f"frame.joints.{row.name('J')}": file.place(row.line) for row in self.joint_rows}
        if len(self.joints) < len(self.joint_rows):
            raise InputError(f"{file.path}: the table of NJoints has a joint twice")

    def rows(self, name: str, least: int) -> list[Row]:
        """Rows of a table."""
        return table(self.file, [name], least, self.notes)

    def joint(self, row: Row, column: int = 0) -> str:
        """Name of a joint that another table refers to.

        Raises:
          InputError: there is none with this number.
        """
        if (name := row.name("J", column)) not in self.joints:
            raise row.error(f"joint {name[1:]} is named here; the table of NJoints does not have it")
        return name

    def sections(self) -> dict[str, dict[str, Any]]:
        """Sections of all kinds."""
        content: dict[str, dict[str, Any]] = {}
        for kind, (names, columns) in SECTIONS.items():
            keys = ["elastic_modulus", "shear_modulus", "density", *columns.split()]
            for row in table(self.file, names, 1 + len(keys), self.notes):
                values = row.numbers(1, 1 + len(keys))
                if kind == "general" and self.new:  # the constant of torsion follows that of inertia
                    values[-1:] = row.numbers(1 + len(keys), 2 + len(keys))
                pairs = zip(keys, values, strict=True)
                each = {name: x for name, x in pairs if x > 0.0 or name == "density"}
                across = min(each.get(name, math.inf) for name in ("diameter", "width", "height"))
                if 2.0 * each.get("thickness", 0.0) > across * (1.0 + 1e-9):
                    raise row.error(f"the wall of {each['thickness']:g} m is more than half of {across:g} m")
                content[row.name(kind)] = {"kind": kind, **each}
                self.places[f"frame.sections.{row.name(kind)}"] = self.file.place(row.line)
        return content

    def members(self, sections: dict[str, Any]) -> dict[str, dict[str, Any]]:
        """Members of all kinds.

        Raises:
          InputError: a member names joints or properties that are not there.
          UnsupportedError: it is of another kind.
        """
        old = len(self.joint_rows[0].words) < 9 or number(self.joint_rows[0].words[4]) is None
        properties = {
            f"{kind}{row.name('')}": (row, dict(zip(columns, row.numbers(1, 1 + len(columns)), strict=True)))
            for kind, keyword, columns in OTHERS.values()
            for row in self.rows(keyword, 1 + len(columns))
        }
        content: dict[str, dict[str, Any]] = {}
        for row in self.rows("NMembers", 5 if old else 7):
            kind = "1" if old else row.words[5].lower().strip("'\"")
            if kind not in BEAMS | OTHERS:
                expected = "1, 1c, 1r, 2, 3, 4 or 5, as OpenFAST 5 has them"
                raise UnsupportedError(f"{self.file.at(row.line)}: MType {row.words[5]}: expected {expected}")
            names = [row.name(BEAMS[kind] if kind in BEAMS else OTHERS[kind][0], column) for column in (3, 4)]
            for name in names[: 1 + (kind in BEAMS)]:
                if name not in (sections if kind in BEAMS else properties):
                    raise row.error(f"member {row.words[0]} names {name}; it is not defined")
            each: dict[str, Any] = {"joints": (self.joint(row, 1), self.joint(row, 2))}
            if kind in BEAMS:
                each |= {"section": names[0]} | ({"end_section": names[1]} if names[0] != names[1] else {})
                each |= {"spin": self._spin(row)} if BEAMS[kind] != "tube" else {}
            else:
                each |= {"section": "-", "kind": OTHERS[kind][0]}
                values = properties[names[0]][1]
                each |= {"stiffness": self._spring(row, list(values.values()))} if kind == "5" else values
            content[row.name("M")] = each
            self.places[f"frame.members.{row.name('M')}"] = self.file.place(row.line)
        return content

    def _spring(self, row: Row, values: list[float]) -> Float:
        """(6, 6) stiffness of a spring, from its upper triangle about the axes that the last column refers to."""
        k = np.zeros((6, 6))
        k[np.triu_indices(6)] = values
        k = np.triu(k) + np.triu(k, 1).T
        axes = {each.name(""): np.reshape(each.numbers(1, 10), (3, 3)) for each in self.rows("NCOSMs", 10)}
        if not axes or (wanted := row.name("", 6)) == "-1":
            return k
        if wanted not in axes:
            raise row.error(f"COSMID {wanted}: the table of NCOSMs does not have it")
        turn = np.kron(np.eye(2), axes[wanted].T)
        return turn @ k @ turn.T

    def _spin(self, row: Row) -> float:
        """[rad] spin of the section of a member about its axis, which decks before OpenFAST 5 do not have."""
        (spin,) = row.numbers(6, 7)
        if spin == -1.0 and self.new:
            why = "-1 degree, as OpenFAST 5 reads it; in decks before it was a member without matrix of its axes"
            self.notes.add("warning", self.file.place(row.line), f"MSpin of member {row.words[0]} is -1", why)
        if spin != -1.0 and not self.new:
            what, why = f"COSMID of member {row.words[0]}", "x of its section is horizontal"
            self.notes.add("approximated", self.file.place(row.line), what, why)
        return math.radians(spin) if self.new else 0.0

    def releases(self, members: dict[str, Any]) -> dict[str, dict[str, Any]]:
        """Joints that are not rigid, with their axes."""
        content: dict[str, dict[str, Any]] = {}
        for row in self.joint_rows:
            if len(row.words) < 9 or number(row.words[4]) in (None, 1.0):
                continue
            kind, *axis, stiffness = row.numbers(4, 9)
            if kind not in JOINTS:
                raise row.error(f"JointType {kind:g}: expected 1, 2, 3 or 4")
            joint, each = row.name("J"), {"kind": JOINTS[int(kind)], "stiffness": stiffness}
            if kind == 2:  # about both directions across the mean of its members
                ends = [[self.joints[j] for j in m["joints"]] for m in members.values() if joint in m["joints"]]
                along = [(b - a) / np.linalg.norm(b - a) for a, b in ends]
                axis = np.sum([math.copysign(1.0, d @ along[0]) * d for d in along], axis=0).tolist()
            content[joint] = each | ({"axis": np.array(axis)} if kind != 4 else {})
        return content

    def feet(self) -> list[dict[str, Any]]:
        """Joints on the ground: clamped, or with springs and mass of an SSI file where they are free."""
        content = []
        for row in self.rows("NReact", 1):
            each: dict[str, Any] = {"joint": self.joint(row)}
            fixed = np.array(row.numbers(1, 7)) == 1.0
            if len(fixed) == 6 and not fixed.all():
                path = self.file.file(row.words[7], row.line) if len(row.words) > 7 else None
                ground: dict[str, Any] = {"stiffness": np.zeros((6, 6)), "mass": np.zeros((6, 6))}
                if path is not None:
                    ground = springs(read_input(path, "SSI"))
                    self.notes.add("used", path.name, "springs and mass under a foot", "frame.feet")
                each |= {name: np.where(fixed[:, None] | fixed, 0.0, ground[name]) for name in ("stiffness", "mass")}
                each["stiffness"][fixed, fixed] = HELD
                if fixed.any():
                    why = f"springs of {HELD:g} N/m and N m/rad in the {fixed.sum()} directions that are fixed"
                    self.notes.add("approximated", self.file.place(row.line), f"foot at joint {row.words[0]}", why)
            content.append(each)
        return content

    def interface(self) -> tuple[str, ...]:
        """Joints that hold the tower; that of the rigid motions of a floating frame (TPID 0) is not one of them.

        Raises:
          InputError: there is none, or one is not fixed to the transition piece.
          UnsupportedError: there are several transition pieces.
        """
        content: dict[int, list[str]] = {}
        for row in self.rows("NInterf", 1):
            given = list(itertools.takewhile(lambda word: number(word) is not None, row.words))
            piece = int(number(given[1]) or 0) if len(given) in (2, 8) else 1
            if not all(row.numbers(len(given) % 6 if len(given) > 2 else len(given), len(given))):
                raise row.error("a joint of the interface has to be fixed in all directions")
            content.setdefault(piece, []).append(self.joint(row))
        if rigid := content.pop(0, None):
            what, why = f"TPID 0 at joint {rigid[0][1:]}", "the six rigid motions are those of the tower's base"
            self.notes.add("not needed", self.file.path.name, what, why)
        if not content:
            raise InputError(f"{self.file.path}: NInterf: expected a joint that is fixed to the transition piece")
        if len(content) > 1:
            text = f"{len(content)} transition pieces: one that holds the tower is read"
            raise UnsupportedError(f"{self.file.path}: NInterf: {text}")
        return tuple(next(iter(content.values())))

    def masses(self) -> list[dict[str, Any]]:
        """Concentrated masses of joints."""
        rows = [(row, row.numbers(1, 11)) for row in self.rows("NCmass", 5)]
        return [joint_mass(self.joint(row), (values + [0.0] * 10)[:10]) for row, values in rows]


def joint_mass(joint: str, values: Sequence[float]) -> dict[str, Any]:
    """A ``JointMass`` from mass, inertia (6) and centre (3), which are left out where they are zero."""
    given = {"inertia": np.array(values[1:7]), "centre": np.array(values[7:])}
    return {"joint": joint, "mass": values[0]} | {name: x for name, x in given.items() if x.any()}


def read_frame(file: InputFile, v: Values, notes: Notes) -> dict[str, Any]:
    """Read a frame of SubDyn, without water, as keys of ``Frame``.

    An additional key is ``rayleigh``, instead of a damping ratio: factors [1/s] of mass and [s] of stiffness, and the
    ratio of the first internal mode if it is given.

    Args:
      v: values of the main file and ElastoDyn, whose platform is the transition piece.

    Raises:
      InputError: the file is not valid; the message has file and line.
      UnsupportedError: the frame has a feature that is not modelled.
    """
    sub = SubDyn(file, notes)
    sections = sub.sections()
    members, interface = sub.members(sections), sub.interface()
    base = np.array([0.0, 0.0, v["tower.base_height"]])
    content: dict[str, Any] = {
        "joints": sub.joints,
        "sections": sections,
        "members": members,
        "feet": sub.feet(),
        "interface": interface,
        "masses": sub.masses(),
        "releases": sub.releases(members),
        "divisions": sub.v.given("divisions", 1),
        "source": file.path.name,
    }
    if piece := transition_piece(v, "frame.masses"):
        piece[7:] = (np.array(piece[7:]) - sub.joints[interface[0]]).tolist()
        content["masses"].append(joint_mass(interface[0], piece))
    for target, key in (
        *(("joints", "joints"), ("members", "members"), ("reactions", "feet"), ("interfaces", "interface")),
        *((name, "sections") for name in ("sections", "rectangles", "generals")),
        *((name, "members") for name in ("cables", "links", "springs", "cosines")),
        ("lumped_masses", "masses"),
    ):
        if sub.v[target] is not None:
            sub.v.note("used" if sub.v[target] else "equivalent", target, f"frame.{key}")
    v.source |= sub.places
    sub.v.differs("approximated", 3, element="elements with shear (Timoshenko)")
    return content | _damping(sub, base, v)


def transition_piece(v: Values, what: str) -> list[float]:
    """Mass, inertia (6) about its centre, and centre (3) of ElastoDyn's platform; empty if it has no mass."""
    if not v.given("platform_mass", 0.0):
        v.unneeded("of PtfmMass; the tower has its inertia about its axis here", *(f"platform_{name}" for name in LUMP))
        return []
    for name in ("mass", *LUMP):
        if v[f"platform_{name}"] is not None:
            v.note("used", f"platform_{name}", f"{what}: the transition piece")
    names = *(f"inertia_{name}" for name in ("R", "P", "Y", "XY", "XZ", "YZ")), *(f"centre_{axis}" for axis in "xyz")
    return [v["platform_mass"], *(v.given(f"platform_{name}", 0.0) for name in names)]


def _damping(sub: SubDyn, base: Float, v: Values) -> dict[str, Any]:
    """Damping of the frame: Rayleigh's of the interface, or a matrix; and of internal modes.

    Raises:
      InputError: factors or matrix are malformed.
    """
    v_sub, entry = sub.v, sub.file.find("GuyanDampSize")
    kind, content = v_sub.given("guyan_damping", 0), {}
    ratio = v_sub.given("mode_damping", [0.0])[0] if number(str(v_sub.given("modes", "0"))) else 0.0
    if kind == 1:
        content["rayleigh"] = v_sub.given("rayleigh", [])
        if len(content["rayleigh"]) != 2:
            where = f"{sub.file.path}: RayleighDamp"
            raise InputError(f"{where}: expected factors of mass and stiffness, as GuyanDampMod is 1")
        v_sub.note("used", "rayleigh", "frame.damping, at the first natural frequency")
        v_sub.unneeded("the frame has one damping, that of GuyanDampMod 1", "mode_damping")
    else:
        content |= {"rayleigh": [0.0, 0.0, ratio]} if ratio else {}
        why = "frame.damping: in proportion to stiffness, so that the first internal mode has this ratio"
        v_sub.differs("approximated" if ratio else "not needed", None, mode_damping=why if ratio else "see Nmodes")
        v_sub.unneeded("of GuyanDampMod 1", "rayleigh")
    if kind != 2 or entry is None:
        v_sub.unneeded("of GuyanDampMod 2", "damping_size")
        return content
    lines = enumerate(sub.file.lines[entry.line : entry.line + 6], entry.line + 1)
    matrix = [Row(sub.file, line, split(text)).numbers(0, 6) for line, text in lines]
    if [len(row) for row in matrix] != [6] * 6:
        raise InputError(f"{sub.file.at(entry.line)}: GuyanDampSize: expected six lines of six numbers")
    v_sub.note("used", "damping_size", "frame.interface_damping: the matrix, about the tower's base")
    return content | {"interface_damping": moved(np.array(matrix), reference(v) - base)}


def rigid_body(frame: Frame) -> dict[str, Any]:
    """Mass, centre and inertia of a frame with the liquid inside and growth, as keys of ``Platform``."""
    assembly = assemble(frame)
    arms = transfer(assembly.points).reshape(-1, 6)
    whole = arms.T @ (assembly.mass @ arms)
    mass = float(whole[0, 0])
    centre = np.array([whole[1, 5], whole[2, 3], whole[0, 4]]) / mass
    about = moved(whole, -centre)
    return {"mass": mass, "centre": centre, "inertia": np.diag(about)[3:]}


def reference(v: Values) -> Float:
    """(3,) [m] point of the transition piece that the matrices of SubDyn and ExtPtfm refer to."""
    return np.array([v.given(f"platform_reference_{axis}", 0.0) for axis in "xyz"])


def moved(matrix: Float, arm: Float) -> Float:
    """(6, 6) matrix about a point from that about another, which is at ``arm`` (3,) [m] from it."""
    motion = transfer(arm)
    result: Float = motion.T @ matrix @ motion
    return result
