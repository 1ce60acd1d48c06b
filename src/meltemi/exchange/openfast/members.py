"""Members of HydroDyn: their places, coefficients and liquid inside; those of a platform.

The area of a joint is the vector sum over the ends of its members (HydroDyn, axial loads): a heave plate under a
thinner column has a wetted ring above. The force of drag on an end is rho A AxCd v^2 / 4 there, of both sides,
and rho A plate_drag v^2 / 2 here.
"""

from __future__ import annotations

import math
from collections import defaultdict
from dataclasses import dataclass
from typing import Any

import numpy as np

import meltemi.exchange.openfast.columns as columns
from meltemi.core.errors import InputError, UnsupportedError
from meltemi.exchange.openfast.text import DIFFRACTS, Float, InputFile, KeywordLine, flag, number
from meltemi.exchange.openfast.values import Values
from meltemi.exchange.report import Notes

NEAR = 0.05
"""[m] distance of members, or joints, at the same place."""
ROUND, RECTANGLE = 1, 2
SIDES = {ROUND: ("",), RECTANGLE: ("A", "B")}
"""Ends of the names of coefficients, by ``MSecGeom``; those of the sides of a rectangle give a mean."""
AXIAL = {"plate_drag": 0.5, "plate_added_mass": 1.0, "plate_pressure": 1.0}
"""Our coefficient over HydroDyn's AxCd, AxCa, AxCp."""
COEFFICIENTS = {"drag": "Cd", "added_mass": "Ca", "pressure": "Cp"}
TABLES = {1: ("", "Simpl", ("",)), 2: ("NCoefDpth", "Dpth", ("",)), 3: ("NCoefMembers", "Member", ("1", "2"))}
"""Keyword of each ``MCoefMod``, beginning of the names of its columns, and their ends at the ends of a member."""
LAYOUTS = {
    ROUND: (columns.SIMPLE, columns.BY_DEPTH, columns.BY_MEMBER),
    RECTANGLE: (columns.SIMPLE_REC, columns.BY_DEPTH_REC, columns.BY_MEMBER_REC),
}


@dataclass(frozen=True)
class HydroMember:
    """A member of HydroDyn from ``a`` to ``b`` (3,) [m], of breadth and wall (2, 2) [m] at both ends, in ``line``."""

    number: int
    line: int
    joints: tuple[int, int]
    a: Float
    b: Float
    geometry: int
    size: Float
    piece: float
    model: int
    hydrostatics: int
    within: bool

    def place_of(self, x: Float, y: Float) -> tuple[float, float]:
        """Distance [m] of the middle of a line from x to y (3,), infinite across the member, and its place (0 to 1)."""
        along, d = self.b - self.a, y - x
        middle = 0.5 * (x + y) - self.a
        s = float(middle @ along / (along @ along))
        across = np.linalg.norm(np.cross(along, d)) / (np.linalg.norm(along) * np.linalg.norm(d))
        beside = across > NEAR or not -1e-3 <= s <= 1.0 + 1e-3
        return (math.inf if beside else float(np.linalg.norm(middle - s * along))), s


def hydro_table(file: InputFile, count: str, layout: str, wanted: dict[str, str], notes: Notes) -> dict[str, Float]:
    """Columns of the table that follows a line count, in the format of OpenFAST 5 or before."""
    return file.placed(file.require([count, f"{count}Cyl"], "of lines"), layout, wanted, notes)


def hydro_rows(file: InputFile, count: str, layout: str, wanted: dict[str, str], notes: Notes) -> list[list[float]]:
    """Rows of a table of HydroDyn, of the wanted columns."""
    rows: list[list[float]] = np.column_stack([*hydro_table(file, count, layout, wanted, notes).values()]).tolist()
    return rows


def member_rows(file: InputFile, notes: Notes) -> list[tuple[int, dict[str, float], bool]]:
    """Line of each member of HydroDyn, its numbers by column, and whether it is part of the potential flow.

    Raises:
      InputError: a row has no column PropPot.
    """
    entry = file.require(["NMembers"], "of lines")
    rows, place = file.rows(entry, file.count(entry))[1], 10
    for line, row in reversed(rows):  # the columns are those of the first row
        place = next((k for k, word in enumerate(row) if number(word) is None and flag(word) is not None), -1)
        if place not in columns.MEMBERS:
            raise InputError(
                f"{file.at(line)}: expected True or False for PropPot in column 8 (OpenFAST 2), 9 (3, 4) or 11 (5) of "
                f"the table of members, found {' '.join(row)[:60]!r}"
            )
    layout = columns.MEMBERS[place]
    names = [name.split("|")[0] for name in layout.split()][:place]
    numbers = zip(*file.placed(entry, layout, dict(zip(names, names, strict=True)), notes).values(), strict=True)
    return [
        (line, dict(zip(names, each, strict=True)), bool(flag(words[place])))
        for (line, words), each in zip(rows, numbers, strict=True)
    ]


def hydro_members(file: InputFile, notes: Notes, *, round_ones: bool = False) -> list[HydroMember]:
    """Members of HydroDyn.

    Raises:
      InputError: there are none, or one names joints or sections that are not there.
      UnsupportedError: one is rectangular, where all have to be round.
    """
    wanted = {"id": "JointID", "x": "Jointxi", "y": "Jointyi", "z": "Jointzi"}
    joints = {int(i): x for i, *x in hydro_rows(file, "NJoints", columns.HYDRO_JOINTS, wanted, notes)}
    wanted = {"id": "PropSetID", "d": "PropD", "t": "PropThck"}
    sections = {(ROUND, i): x for i, *x in hydro_rows(file, "NPropSets", columns.HYDRO_SECTIONS, wanted, notes)}
    if file.find("NPropSetsRec") is not None:
        wanted = {"id": "PropSetID", "a": "PropA", "b": "PropB", "t": "PropThck"}
        rectangles = hydro_rows(file, "NPropSetsRec", columns.HYDRO_RECTANGLES, wanted, notes)
        sections |= {(RECTANGLE, i): [0.5 * (a + b), t] for i, a, b, t in rectangles}
    content = []
    for line, each, within in member_rows(file, notes):
        i, geometry = int(each["MemberID"]), int(each.get("MSecGeom", ROUND))
        if round_ones and geometry != ROUND:
            raise UnsupportedError(f"{file.at(line)}: MSecGeom: members are round (1)")
        ends, sets = ([int(each[f"{name}{k}"]) for k in (1, 2)] for name in ("MJointID", "MPropSetID"))
        if not set(ends) <= set(joints) or not {(geometry, k) for k in sets} <= set(sections):
            raise InputError(f"{file.at(line)}: member {i} names a joint or property set that is not defined")
        (a, b), size = (np.array(joints[k]) for k in ends), np.array([sections[geometry, k] for k in sets])
        kinds = int(each["MCoefMod"]), int(each.get("MHstLMod", 1))
        content.append(HydroMember(i, line, (ends[0], ends[1]), a, b, geometry, size, each["MDivSize"], *kinds, within))
    if not content:
        raise InputError(f"{file.path}: NMembers: expected members in the water, found none; CompHydro 0 has no water")
    return content


class Tables:
    """Coefficients of HydroDyn's members: simple, by depth, by member; those under growth only where it grows.

    Attributes:
      rows: by ``MSecGeom`` and ``MCoefMod``, the first column of a table, its coefficients at each end, and whether
        the rows have the keyword of diffraction.
    """

    def __init__(self, file: InputFile, notes: Notes, *, grown: bool) -> None:
        self.file, self.grown = file, grown
        self.rows: dict[tuple[int, int], tuple[Float, list[dict[str, Float]], list[bool]]] = {}
        sections = file.find("NPropSetsRec") or file.require(["NPropSets", "NPropSetsCyl"], "of lines")
        last = file.rows(sections, file.count(sections))[2]
        for geometry, kinds in ((ROUND, ("Cyl", "")), (RECTANGLE, ("Rec",)))[: 1 + sections.name.endswith("Rec")]:
            for model, (keyword, prefix, ends) in TABLES.items():
                skip = int(not keyword)  # the simple ones have no count and follow the sections
                entry = KeywordLine("SimplCd", ("1",), last) if skip else file.find(*(keyword + k for k in kinds))
                if entry is None or not (count := file.count(entry)):
                    continue
                _, rows, line = file.rows(entry, count, None, skip)
                last = line if skip else last
                layout = LAYOUTS[geometry][model - 1]
                names = [name for name in layout.split()[: len(rows[0][1])] if "Ax" not in name]  # those of tapers
                values = file.placed(entry, layout, dict(zip(names, names, strict=True)), notes, skip=skip)
                thick = [DIFFRACTS in [word.strip("'\"").upper() for word in words] for _, words in rows]
                self.rows[geometry, model] = (
                    values[names[0]],
                    [_means(values, prefix, geometry, k) for k in ends],
                    thick,
                )

    def of(self, member: HydroMember, s: float, z: float) -> dict[str, Any]:
        """Coefficients of a member at a place (0 to 1) and height [m] of it.

        Raises:
          InputError: the table that it refers to does not have it.
        """
        first, ends, thick = self.rows.get((member.geometry, member.model), (np.zeros(0), [], []))
        row = int(np.argmax(first == member.number)) if member.model == 3 else 0
        if not len(first) or (member.model == 3 and first[row] != member.number):
            where = f"{self.file.at(member.line)}: member {member.number} has MCoefMod {member.model}"
            raise InputError(f"{where}, but no line of coefficients")
        if member.model == 2:
            order = np.argsort(first)
            values = {name: float(np.interp(z, first[order], x[order])) for name, x in ends[0].items()}
        else:
            values = {n: float(x[row] + s * (ends[-1][n][row] - x[row])) for n, x in ends[0].items()}
        content: dict[str, Any] = {name: values[name] for name in COEFFICIENTS}
        for name, x in content.copy().items():
            if self.grown and (under := values.get(f"grown_{name}", x)) != x:
                content[f"grown_{name}"] = under
        diffracts = any(thick) if member.model == 2 else thick[row]
        return content | ({"diffraction": "maccamy_fuchs"} if diffracts else {})


def _means(values: dict[str, Float], prefix: str, geometry: int, end: str) -> dict[str, Float]:
    return {
        ("grown_" if growth else "") + name: np.mean([values[f"{prefix}{c}{x}{growth}{end}"] for x in sides], axis=0)
        for name, c in COEFFICIENTS.items()
        for sides in [SIDES[geometry] if c != "Cp" else ("",)]
        for growth in ("", "MG")
        if not growth or f"{prefix}{c}{sides[-1]}{growth}{end}" in values  # short rows end before
    }


def fill_groups(
    file: InputFile, members: list[HydroMember], notes: Notes
) -> list[tuple[int, list[HydroMember], float, float | None]]:
    """Groups of filled members: line, members, level [m] and density [kg/m^3], None for that of the sea.

    Raises:
      InputError: the table is malformed, or names members that are not there.
    """
    entry, content = file.find("NFillGroups"), []
    by_number = {m.number: m for m in members}
    for line, words in file.rows(entry, file.count(entry), notes=notes)[1] if entry and file.count(entry) else ():
        n = int(number(words[0]) or 0) if words else 0
        which = [int(number(word) or 0) for word in words[1 : n + 1]]
        level, density = ([number(word.strip("'\"")) for word in words[n + 1 : n + 3]] + [None, None])[:2]
        if not which or level is None or not set(which) <= set(by_number):
            found = " ".join(words)[:60]
            raise InputError(f"{file.at(line)}: FillNumM: expected {n} members, level and density, found {found!r}")
        content.append((line, [by_number[i] for i in which], level, density))
    return content


def read_members(file: InputFile, v: Values) -> list[dict[str, Any]]:
    """Read the circular members of a platform as keys of ``Member``.

    Raises:
      InputError: the file is not valid; the message has file and line.
      UnsupportedError: members of other sections.
    """
    if (rectangles := file.find("NPropSetsRec")) is not None and file.count(rectangles):
        raise UnsupportedError(f"{file.path}: NPropSetsRec: members of a platform are round")
    v.differs("ignored", 0, growth="growth on a platform is not modelled")
    members, given = hydro_members(file, v.notes, round_ones=True), Tables(file, v.notes, grown=False)
    wet = [given.of(m, 0.5, 0.5 * float(m.a[2] + m.b[2])) for m in members]
    if any("diffraction" in each for each in wet):
        why = "diffraction of a platform's members is not modelled: their inertia is that of slender ones"
        v.notes.add("approximated", file.path.name, "MCF", why)
    wanted = {"id": "AxCoefID"} | dict(zip(AXIAL, ("AxCd", "AxCa", "AxCp"), strict=True))
    sets = {int(i): c for i, *c in hydro_rows(file, "NAxCoef", columns.AXIAL, wanted, v.notes)}
    wanted = {"id": "JointID", "kind": "JointAxID"}
    kinds = hydro_rows(file, "NJoints", columns.HYDRO_JOINTS, wanted, v.notes)
    plates = {int(j): sets.get(int(k), [0.0] * 3) for j, k in kinds}
    ends, content = _ends(members), list[dict[str, Any]]()
    for row, (m, each) in enumerate(zip(members, wet, strict=True)):
        shared = {name: 0.0 if m.within and name != "drag" else each[name] for name in COEFFICIENTS}
        at = list(zip(m.joints, (m.a, m.b), m.size[:, 0], strict=True))
        middle = (0.5 * (m.a + m.b), 0.5 * (at[0][2] + at[1][2]))
        plate_keys = [
            _plate(joint, row, ends[joint], plates[joint], m.within) if place[2] < 0.0 else {} for joint, place, _ in at
        ]
        halves = [(at[k][1], at[k][2], plate_keys[k]) for k in (0, 1)]
        if plate_keys[0] and plate_keys[1]:  # a plate is at the start of a member: two plates need two members
            pieces = [(half, middle) for half in halves]
        else:
            k = 1 if plate_keys[1] else 0
            pieces = [(halves[k], (at[1 - k][1], at[1 - k][2]))]
        for (start, d, plate), (end, d_end) in pieces:
            cone = {} if d == d_end else {"end_diameter": float(d_end)}
            content.append({"start": start, "end": end, "diameter": float(d)} | cone | shared | plate)
    return content


def _ends(members: list[HydroMember]) -> dict[int, list[tuple[int, Float, float]]]:
    """Members at each joint, the directions out of their ends, and their diameters [m]."""
    ends = defaultdict[int, list[tuple[int, Float, float]]](list)
    for row, m in enumerate(members):
        out = (m.a - m.b) / max(float(np.linalg.norm(m.a - m.b)), 1e-12)
        for joint, sign, (d, _) in zip(m.joints, (1.0, -1.0), m.size, strict=True):
            ends[joint].append((row, sign * out, float(d)))
    return ends


def _plate(
    joint: int, row: int, ends: list[tuple[int, Float, float]], coefficients: list[float], within: bool
) -> dict[str, float]:
    """Coefficients of an end as a plate; those of a joint belong to its widest member."""
    widest, normal, d = max(ends, key=lambda each: each[2])
    if widest != row or not any(coefficients):
        return {}
    area = abs(float(sum(each[2] ** 2 * (each[1] @ normal) for each in ends))) / d**2
    ball = abs(float(sum(each[2] ** 3 * (each[1] @ normal) for each in ends))) / d**3
    size = dict(zip(AXIAL, (area, ball, area), strict=True))
    plate = {n: f * c * size[n] for (n, f), c in zip(AXIAL.items(), coefficients, strict=True)}
    if within:  # potential flow already has inertia and pressure
        plate = {"plate_drag": plate["plate_drag"]}
    return {n: x for n, x in plate.items() if x > 1e-9}


def displaced(members: list[dict[str, Any]]) -> tuple[float, tuple[float, float]]:
    """Volume [m^3] of the water that members displace at rest, and x, y [m] of its centre."""
    from meltemi.floating.members import Member, at_rest

    volume, centre, _ = at_rest([Member.model_validate(each) for each in members])
    x, y = (round(float(c), 9) + 0.0 for c in centre[:2])
    return volume, (x, y)


def with_ballast(body: list[float], file: InputFile, v: Values) -> list[float]:
    """Mass, centre (3) and inertia (3) about it of a platform, including the water in filled members.

    Raises:
      InputError: the table of filled members is malformed.
    """
    parts = [(body[0], np.array(body[1:4]), np.diag(body[4:]))]
    for _, which, level, density in fill_groups(file, hydro_members(file, v.notes, round_ones=True), v.notes):
        for member in which:
            parts += _filled(member, level, density or v.given("water_density", 1025.0))
    if len(parts) == 1:
        return body
    masses, centres = np.array([m for m, _, _ in parts]), np.array([c for _, c, _ in parts])
    mass = float(masses.sum())
    centre = masses @ centres / mass
    arms = centres - centre
    inertia = sum(np.diag(about_centre) for _, _, about_centre in parts) + masses @ (
        (arms**2).sum(axis=1)[:, None] - arms**2
    )
    return [mass, *centre.tolist(), *np.asarray(inertia).tolist()]


def _filled(member: HydroMember, level: float, density: float) -> list[tuple[float, Float, Float]]:
    """Slices (mass, centre, inertia about it) of the water in a member below a level."""
    a, b, (first, second) = member.a, member.b, member.size
    axis, size = (b - a) / np.linalg.norm(b - a), float(np.linalg.norm(b - a))
    share = (np.arange(200) + 0.5) / 200
    slices = []
    for s in share:
        place = a + s * (b - a)
        if place[2] < level:
            d, t = first + s * (second - first)
            r = 0.5 * d - t
            m = density * np.pi * r**2 * size / 200
            slices.append((m, place, 0.25 * m * r**2 * (np.eye(3) + np.outer(axis, axis))))
    return slices
