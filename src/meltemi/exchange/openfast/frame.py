"""Frames of many members from SubDyn, in the formats of OpenFAST 3 to 5.

Tables are read by position. OpenFAST 5 adds the number of the transition piece at interface joints, rectangular
sections, and the spin of a member in place of a matrix of its axes.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
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

Row = tuple[int, list[str]]
BEAMS = {"1": "tube", "1c": "tube", "1r": "rectangle", "4": "general"}
"""Kind of section by type of member."""
OTHERS = {"2": "cable", "3": "rigid", "5": "spring"}
JOINTS = {2: "universal", 3: "pin", 4: "ball"}
"""Kind of release by type of joint."""
HELD = 1e13
"""[N/m, N m/rad] spring in a direction that is fixed at a foot that is free in others."""
SECTIONS: dict[str, tuple[tuple[str, ...], str]] = {
    "tube": (("NPropSetsCyl", "NPropSets"), "diameter thickness"),
    "rectangle": (("NPropSetsRec",), "width height thickness"),
    "general": (("NXPropSets",), "area shear_area_x shear_area_y inertia_x inertia_y polar torsion"),
}
"""Keywords of the tables of sections, and their columns after elastic modulus, shear modulus and density."""


def table(file: InputFile, names: Sequence[str], least: int, notes: Notes) -> list[Row]:
    """Rows of a table with their lines; none if the file does not have it.

    Raises:
      InputError: the table is malformed; a row has fewer words than ``least``.
    """
    entry = file.find(*names)
    if entry is None or not (count := file.count(entry)):
        return []
    rows = file.rows(entry, count, notes=notes)[1]
    for line, words in rows:
        if len(words) < least:
            raise InputError(
                f"{file.at(line)}: the table of {entry.name} has {least} columns or more, found {len(words)}"
            )
    return rows


def numbers(file: InputFile, row: Row, first: int, last: int | None, what: str) -> list[float]:
    """Numbers of a row from one column up to another.

    Raises:
      InputError: one is not a number.
    """
    line, words = row
    values = [number(word) for word in words[first:last]]
    if any(value is None for value in values):
        bad = words[first + values.index(None)]
        raise InputError(f"{file.at(line)}: {what}: expected a number, found {bad!r}")
    return [value for value in values if value is not None]


class SubDyn:
    """Tables of a SubDyn file as keys of ``Frame``; a reader has file, notes and the positions of joints (3,) [m]."""

    def __init__(self, file: InputFile, notes: Notes) -> None:
        self.file, self.notes = file, notes
        self.v = Values(notes, replace(file, module="SubDyn frame"))
        self.new = file.find("NPropSetsRec") is not None
        self.joint_rows = table(file, ["NJoints"], 4, notes)
        self.joints = {self.name("J", row): np.array(numbers(file, row, 1, 4, "JointXss")) for row in self.joint_rows}
        if len(self.joints) < len(self.joint_rows):
            raise InputError(f"{file.path}: the table of NJoints has a joint twice")

    def name(self, letter: str, row: Row, column: int = 0) -> str:
        """Name of a joint, member or section by its number."""
        return f"{letter}{int(numbers(self.file, row, column, column + 1, 'a number of a row')[0])}"

    def joint(self, row: Row, column: int, what: str) -> str:
        """Name of a joint that another table refers to.

        Raises:
          InputError: there is none with this number.
        """
        name = self.name("J", row, column)
        if name not in self.joints:
            raise InputError(
                f"{self.file.at(row[0])}: {what} names joint {name[1:]}; the table of NJoints does not have it"
            )
        return name

    def sections(self) -> dict[str, dict[str, Any]]:
        """Sections of all kinds."""
        content: dict[str, dict[str, Any]] = {}
        for kind, (names, columns) in SECTIONS.items():
            keys = ["elastic_modulus", "shear_modulus", "density", *columns.split()]
            for row in table(self.file, names, 1 + len(keys) - (kind == "general"), self.notes):
                values = dict(zip(keys, numbers(self.file, row, 1, 1 + len(keys), names[0]), strict=False))
                if kind == "general":  # before OpenFAST 5 one constant is that of torsion and of its inertia
                    values["torsion"] = values.get("torsion", values["polar"])
                    del values["polar"]
                each = {name: x for name, x in values.items() if x > 0.0 or name == "density"}
                across = min(each.get(name, math.inf) for name in ("diameter", "width", "height"))
                if 2.0 * each.get("thickness", 0.0) > across * (1.0 + 1e-9):
                    raise InputError(
                        f"{self.file.at(row[0])}: the wall of {each['thickness']:g} m is more than half of {across:g} m"
                    )
                content[self.name(kind, row)] = {"kind": kind, **each}
        return content

    def members(self, sections: dict[str, Any]) -> dict[str, dict[str, Any]]:
        """Members of all kinds.

        Raises:
          InputError: a member names joints or properties that are not there.
          UnsupportedError: it is of another kind.
        """
        others = {
            "2": {self.name("", row): row for row in table(self.file, ["NCablePropSets"], 4, self.notes)},
            "3": {self.name("", row): row for row in table(self.file, ["NRigidPropSets"], 2, self.notes)},
            "5": {self.name("", row): row for row in table(self.file, ["NSpringPropSets"], 22, self.notes)},
        }
        old = len(self.joint_rows[0][1]) < 9 or number(self.joint_rows[0][1][4]) is None
        content: dict[str, dict[str, Any]] = {}
        for row in table(self.file, ["NMembers"], 5 if old else 7, self.notes):
            line, words = row
            kind = "1" if old else words[5].lower().strip("'\"")
            a, b = (self.joint(row, k, f"member {words[0]}") for k in (1, 2))
            if kind in BEAMS:
                first, second = (self.name(BEAMS[kind], row, k) for k in (3, 4))
                place = next((x for x in (first, second) if x not in sections), None)
                each: dict[str, Any] = {"section": first} | ({} if first == second else {"end_section": second})
                if place is None and sections[first]["kind"] != "tube" and (spin := self._spin(row)):
                    each["spin"] = spin
            elif kind in OTHERS:
                first = self.name("", row, 3)
                place = None if first in others[kind] else f"property set {first}"
                if place is None:
                    each = {"kind": OTHERS[kind], "section": "-"} | self._other(kind, others[kind][first], row)
            else:
                raise UnsupportedError(
                    f"{self.file.at(line)}: MType {words[5]}: expected 1, 1c, 1r, 2, 3, 4 or 5, as OpenFAST 5 has them"
                )
            if place is not None:
                raise InputError(f"{self.file.at(line)}: member {words[0]} names {place}; it is not defined")
            content[self.name("M", row)] = {"joints": (a, b), **each}
        return content

    def _other(self, kind: str, properties: Row, row: Row) -> dict[str, Any]:
        values = numbers(self.file, properties, 1, 22 if kind == "5" else 4 if kind == "2" else 2, "properties")
        if kind == "2":
            stiffness, mass, tension = values
            return {"axial_stiffness": stiffness, "line_mass": mass, "pretension": tension}
        if kind == "3":
            return {"line_mass": values[0]}
        k = np.zeros((6, 6))
        k[np.triu_indices(6)] = values
        turn = np.kron(np.eye(2), self._cosines(row).T)
        return {"stiffness": turn @ (np.triu(k) + np.triu(k, 1).T) @ turn.T}

    def _cosines(self, row: Row) -> Float:
        """(3, 3) axes x, y, z of a member as rows, from the table that its last column refers to."""
        wanted = numbers(self.file, row, 6, 7, "COSMID")[0]
        rows = table(self.file, ["NCOSMs"], 10, self.notes)
        if wanted == -1.0 or not rows:
            return np.eye(3)
        for each in rows:
            if numbers(self.file, each, 0, 1, "COSMID")[0] == wanted:
                return np.array(numbers(self.file, each, 1, 10, "COSM11")).reshape(3, 3)
        raise InputError(f"{self.file.at(row[0])}: COSMID {wanted:g}: the table of NCOSMs does not have it")

    def _spin(self, row: Row) -> float:
        """[rad] spin of the section of a member about its axis, which decks before OpenFAST 5 do not have."""
        spin = numbers(self.file, row, 6, 7, "MSpin")[0]
        if spin == -1.0 and self.new:
            why = "-1 degree, as OpenFAST 5 reads it; in decks before it was a member without matrix of its axes"
            self.notes.add("warning", self.file.place(row[0]), f"MSpin of member {row[1][0]} is -1", why)
        if spin != -1.0 and not self.new:
            what, why = f"COSMID of member {row[1][0]}", "x of its section is horizontal"
            self.notes.add("approximated", self.file.place(row[0]), what, why)
        return math.radians(spin) if self.new else 0.0

    def releases(self, members: dict[str, Any]) -> dict[str, dict[str, Any]]:
        """Joints that are not rigid, with their axes."""
        content: dict[str, dict[str, Any]] = {}
        for row in self.joint_rows:
            if len(row[1]) < 9 or number(row[1][4]) in (None, 1.0):
                continue
            kind, *axis, stiffness = numbers(self.file, row, 4, 9, "JointType")
            if kind not in JOINTS:
                raise InputError(f"{self.file.at(row[0])}: JointType {kind:g}: expected 1, 2, 3 or 4")
            joint, each = self.name("J", row), {"kind": JOINTS[int(kind)], "stiffness": stiffness}
            if kind == 2:  # about both directions across the mean of its two members
                ends = [[self.joints[j] for j in m["joints"]] for m in members.values() if joint in m["joints"]]
                along = [(b - a) / np.linalg.norm(b - a) for a, b in ends]
                each["axis"] = sum((math.copysign(1.0, d @ along[0]) * d for d in along), np.zeros(3))
            if kind == 3:
                each["axis"] = np.array(axis)
            content[joint] = each
        return content

    def feet(self) -> list[dict[str, Any]]:
        """Joints on the ground: clamped, or with springs and mass of an SSI file where they are free."""
        content = []
        for row in table(self.file, ["NReact"], 1, self.notes):
            line, words = row
            each: dict[str, Any] = {"joint": self.joint(row, 0, "RJointID")}
            fixed = np.array(numbers(self.file, row, 1, 7, "RctTDXss")) == 1.0
            if len(fixed) == 6 and not fixed.all():
                path = self.file.file(words[7], line) if len(words) > 7 else None
                ground = {"stiffness": np.zeros((6, 6)), "mass": np.zeros((6, 6))}
                if path is not None:
                    ground = springs(read_input(path, "SSI"))
                    self.notes.add("used", path.name, "springs and mass under a foot", "frame.feet")
                for matrix in (ground["stiffness"], ground["mass"]):
                    matrix[fixed, :] = matrix[:, fixed] = 0.0
                ground["stiffness"][fixed, fixed] = HELD
                if fixed.any():
                    why = f"springs of {HELD:g} N/m and N m/rad in the {fixed.sum()} directions that are fixed"
                    self.notes.add("approximated", self.file.place(line), f"foot at joint {words[0]}", why)
                each |= {"stiffness": ground["stiffness"]} | ({"mass": ground["mass"]} if ground["mass"].any() else {})
            content.append(each)
        return content

    def interface(self) -> tuple[str, ...]:
        """Joints that hold the tower; that of the rigid motions of a floating frame (TPID 0) is not one of them.

        Raises:
          InputError: there is none, or one is not fixed to the transition piece.
          UnsupportedError: there are several transition pieces.
        """
        content: dict[int, list[str]] = {}
        for row in table(self.file, ["NInterf"], 1, self.notes):
            line, words = row
            many = next((k for k, word in enumerate(words) if number(word) is None), len(words))
            piece = int(number(words[1]) or 0) if many in (2, 8) else 1
            if not all(numbers(self.file, row, 1 + (many in (2, 8)), min(many, 8), "ItfTDXss")):
                raise InputError(f"{self.file.at(line)}: a joint of the interface has to be fixed in all directions")
            content.setdefault(piece, []).append(self.joint(row, 0, "IJointID"))
        if reference := content.pop(0, None):
            why = "the six rigid motions are those of the tower's base"
            self.notes.add("not needed", self.file.path.name, f"TPID 0 at joint {reference[0][1:]}", why)
        if len(content) != 1:
            where = f"{self.file.path}: NInterf"
            if content:
                raise UnsupportedError(f"{where}: {len(content)} transition pieces: one that holds the tower is read")
            raise InputError(f"{where}: expected a joint that is fixed to the transition piece")
        return tuple(next(iter(content.values())))

    def masses(self) -> list[dict[str, Any]]:
        """Concentrated masses of joints."""
        content = []
        for row in table(self.file, ["NCmass"], 5, self.notes):
            mass, *rest = numbers(self.file, row, 1, 11, "JMass")
            rest += [0.0] * (9 - len(rest))
            content.append(joint_mass(self.joint(row, 0, "CMJointID"), mass, rest[:6], rest[6:]))
        return content


def joint_mass(joint: str, mass: float, inertia: Sequence[float], centre: Sequence[float]) -> dict[str, Any]:
    """A ``JointMass``: inertia (6,) about its centre (3,) from the joint, which are left out where they are zero."""
    given = {"inertia": np.array(inertia), "centre": np.array(centre)}
    return {"joint": joint, "mass": mass} | {name: x for name, x in given.items() if x.any()}


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
        "masses": [*sub.masses(), *_transition_piece(interface[0], sub.joints[interface[0]], v)],
        "releases": sub.releases(members),
        "divisions": sub.v.given("divisions", 1),
        "source": file.path.name,
    }
    for target, key in (
        *(("joints", "joints"), ("members", "members"), ("reactions", "feet"), ("interfaces", "interface")),
        *((name, "sections") for name in ("sections", "rectangles", "generals")),
        *((name, "members") for name in ("cables", "links", "springs", "cosines")),
        ("lumped_masses", "masses"),
    ):
        if sub.v[target] is not None:
            sub.v.note("used" if sub.v[target] else "equivalent", target, f"frame.{key}")
    sub.v.differs("approximated", 3, element="elements with shear (Timoshenko)")
    return content | _damping(sub, base, v)


def _transition_piece(joint: str, place: Float, v: Values) -> list[dict[str, Any]]:
    """The mass of ElastoDyn's platform as that of a joint of the interface."""
    if not v.given("platform_mass", 0.0):
        v.unneeded("of PtfmMass", *(f"platform_{name}" for name in LUMP))
        turning = "without PtfmMass it is the inertia of the tower about its axis, which the tower has here"
        if v.given("platform_inertia_Y", 0.0):
            v.note("equivalent", "platform_inertia_Y", turning)
        return []
    for name in ("mass", *LUMP):
        if v[f"platform_{name}"] is not None:
            v.note("used", f"platform_{name}", f"frame.masses: the transition piece, at joint {joint}")
    centre = np.array([v.given(f"platform_centre_{axis}", 0.0) for axis in "xyz"])
    inertia = [v.given(f"platform_inertia_{name}", 0.0) for name in ("R", "P", "Y", "XY", "XZ", "YZ")]
    return [joint_mass(joint, v["platform_mass"], inertia, centre - place)]


def _damping(sub: SubDyn, base: Float, v: Values) -> dict[str, Any]:
    """Damping of the frame: Rayleigh's of the interface, or a matrix; and of internal modes.

    Raises:
      InputError: factors or matrix are malformed.
    """
    kind, content = sub.v.given("guyan_damping", 0), {}
    modes = number(str(sub.v.given("modes", "0")))
    if kind != 1 and modes and any(ratios := sub.v.given("mode_damping", [0.0])):
        content["rayleigh"] = [0.0, 0.0, ratios[0]]
        why = "frame.damping: in proportion to stiffness, so that the first internal mode has this ratio"
        sub.v.note("approximated", "mode_damping", why)
    else:
        sub.v.unneeded(
            "of internal modes: see Nmodes; the frame has one damping, that of GuyanDampMod 1", "mode_damping"
        )
    if kind == 1:
        factors = sub.v.given("rayleigh", [])
        if len(factors) != 2:
            raise InputError(
                f"{sub.file.path}: RayleighDamp: expected factors of mass and stiffness, as GuyanDampMod is 1"
            )
        content["rayleigh"] = factors
        sub.v.note("used", "rayleigh", "frame.damping, at the first natural frequency")
    else:
        sub.v.unneeded("of GuyanDampMod 1", "rayleigh")
    entry = sub.file.find("GuyanDampSize")
    if kind != 2 or entry is None:
        sub.v.unneeded("of GuyanDampMod 2", "damping_size")
        return content
    rows = [(entry.line + k, split(line)) for k, line in enumerate(sub.file.lines[entry.line : entry.line + 6], 1)]
    if len(rows) < 6 or any(len(words) < 6 for _, words in rows):
        raise InputError(f"{sub.file.at(entry.line)}: GuyanDampSize: expected six lines of six numbers")
    matrix = np.array([numbers(sub.file, row, 0, 6, "Guyan damping") for row in rows])
    sub.v.note("used", "damping_size", "frame.interface_damping: the matrix, about the tower's base")
    return content | {"interface_damping": moved(matrix, reference(v) - base)}


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
