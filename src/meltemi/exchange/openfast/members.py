"""Members of a platform from HydroDyn: columns, pontoons and plates beside potential flow, or instead of it.

The area of a joint is the vector sum over the ends of its members (HydroDyn, axial loads): a heave plate under a
thinner column has a wetted ring above. The force of drag on an end is rho A AxCd v^2 / 4 there, of both sides,
and rho A plate_drag v^2 / 2 here.
"""

from __future__ import annotations

from typing import Any

import numpy as np

import meltemi.exchange.openfast.columns as columns
from meltemi.core.errors import InputError, UnsupportedError
from meltemi.exchange.openfast.text import DIFFRACTS, Float, InputFile, KeywordLine, flag, number
from meltemi.exchange.openfast.values import Values
from meltemi.exchange.report import Notes

AXIAL = {"plate_drag": 0.5, "plate_added_mass": 1.0, "plate_pressure": 1.0}
"""Our coefficient over HydroDyn's AxCd, AxCa, AxCp."""
COEFFICIENTS = {"drag": "Cd", "added_mass": "Ca", "pressure": "Cp"}


def hydro_table(file: InputFile, count: str, layout: str, wanted: dict[str, str], notes: Notes) -> dict[str, Float]:
    """Columns of the table that follows a line count, in the format of OpenFAST 5 or before."""
    return file.placed(file.require([count, f"{count}Cyl"], "of lines"), layout, wanted, notes)


def simple_coefficients(file: InputFile, notes: Notes) -> tuple[dict[str, float], bool]:
    """Coefficients of all members, and whether they diffract waves; the table has no count and follows the sections."""
    entry = file.find("NPropSetsRec") or file.require(["NPropSets", "NPropSetsCyl"], "of lines")
    after = file.rows(entry, file.count(entry))[2]
    wanted = {n: f"Simpl{c}" for n, c in COEFFICIENTS.items()}
    one = KeywordLine("SimplCd", ("1",), after)
    coefficients = file.placed(one, columns.SIMPLE, wanted, notes, skip=1)
    return {n: float(x[0]) for n, x in coefficients.items()}, diffracts(file, one, skip=1)


def by_depth(file: InputFile, notes: Notes) -> dict[str, Float]:
    """Coefficients by depth.

    Raises:
      InputError: the table is empty although members refer to it (MCoefMod 2).
    """
    wanted = {"z": "Dpth"} | {n: f"Dpth{c}" for n, c in COEFFICIENTS.items()}
    coefficients = hydro_table(file, "NCoefDpth", columns.BY_DEPTH, wanted, notes)
    if not len(coefficients["z"]):
        raise InputError(f"{file.path}: members have MCoefMod 2, but NCoefDpth says that there are no coefficients")
    return coefficients


def diffracts(file: InputFile, entry: KeywordLine, skip: int = 0) -> bool:
    """Whether a table of coefficients asks for diffraction."""
    return any(
        DIFFRACTS in [w.strip("'\"").upper() for w in r] for _, r in file.rows(entry, file.count(entry), None, skip)[1]
    )


def members_layout(file: InputFile) -> tuple[list[tuple[int, list[str]]], list[str]]:
    """Rows of HydroDyn's members with their lines, and the names of their columns.

    Raises:
      InputError: a row has no column PropPot.
    """
    entry = file.require(["NMembers"], "of lines")
    rows = file.rows(entry, file.count(entry))[1]
    places = [
        next((k for k, word in enumerate(row) if number(word) is None and flag(word) is not None), -1)
        for _, row in rows
    ]
    for (line, row), place in zip(rows, places, strict=True):
        if place not in columns.MEMBERS:
            raise InputError(
                f"{file.at(line)}: expected True or False for PropPot in column 8 (OpenFAST 2), 9 (3, 4) or 11 (5) of "
                f"the table of members, found {' '.join(row)[:60]!r}"
            )
    layout = columns.MEMBERS[places[0] if places else 10]
    return rows, [name.split("|")[0] for name in layout.split()]


def members_table(file: InputFile, notes: Notes) -> tuple[dict[str, Float], dict[int, bool]]:
    """Members with ends, sections and kind of coefficients, and whether each is part of the potential flow.

    Raises:
      InputError: a row has no column PropPot.
      UnsupportedError: a member is rectangular.
    """
    rows, layout = members_layout(file)
    wanted = {"id": "MemberID", "a": "MJointID1", "b": "MJointID2", "first": "MPropSetID1", "second": "MPropSetID2"}
    entry = file.require(["NMembers"], "of lines")
    members = file.placed(entry, columns.MEMBERS[len(layout) - 1], wanted | {"model": "MCoefMod"}, notes)
    if "MSecGeom" in layout:
        wrong = [line for line, row in rows if number(row[5]) != 1.0]
        if wrong:
            raise UnsupportedError(f"{file.at(wrong[0])}: MSecGeom: members are round (1)")
    inside = [bool(flag(row[len(layout) - 1])) for _, row in rows]
    return members, {int(i): within for i, within in zip(members["id"], inside, strict=True)}


def _geometry(file: InputFile, notes: Notes) -> tuple[dict[str, Float], dict[int, Float], dict[int, Float]]:
    """Members, positions of joints [m], and outer diameter and wall thickness [m] of sections, by their numbers."""
    members, _ = members_table(file, notes)
    wanted = {"id": "JointID", "x": "Jointxi", "y": "Jointyi", "z": "Jointzi"}
    joints = hydro_table(file, "NJoints", columns.HYDRO_JOINTS, wanted, notes)
    wanted = {"id": "PropSetID", "d": "PropD", "t": "PropThck"}
    sections = hydro_table(file, "NPropSets", columns.HYDRO_SECTIONS, wanted, notes)
    places = {int(i): np.array(x) for i, *x in zip(*joints.values(), strict=True)}
    by_number = {int(i): np.array(x) for i, *x in zip(*sections.values(), strict=True)}
    for i, a, b, first, second, _ in zip(*members.values(), strict=True):
        if not {int(a), int(b)} <= set(places) or not {int(first), int(second)} <= set(by_number):
            raise InputError(f"{file.path}: member {i:g} names a joint or property set that is not defined")
    return members, places, by_number


def read_members(file: InputFile, v: Values) -> list[dict[str, Any]]:
    """Read the circular members of a platform as keys of ``Member``.

    Raises:
      InputError: the file is not valid; the message has file and line.
      UnsupportedError: members of other sections.
    """
    members, places, sections = _geometry(file, v.notes)
    if (rectangles := file.find("NPropSetsRec")) is not None and file.count(rectangles):
        raise UnsupportedError(f"{file.path}: NPropSetsRec: members of a platform are round")
    v.differs("ignored", 0, growth="growth on a platform is not modelled")
    wet = _of_members(file, members, places, v)
    inside = members_table(file, v.notes)[1]
    wanted = {"id": "AxCoefID"} | dict(zip(AXIAL, ("AxCd", "AxCa", "AxCp"), strict=True))
    axial = hydro_table(file, "NAxCoef", columns.AXIAL, wanted, v.notes)
    sets = {int(i): c for i, *c in zip(*axial.values(), strict=True)}
    kinds = hydro_table(file, "NJoints", columns.HYDRO_JOINTS, {"id": "JointID", "kind": "JointAxID"}, v.notes)
    ends = _ends(members, places, sections)
    content: list[dict[str, Any]] = []
    plates = {int(j): sets.get(int(k), [0.0] * 3) for j, k in zip(kinds["id"], kinds["kind"], strict=True)}
    for row, (i, a, b, first, second, _) in enumerate(zip(*members.values(), strict=True)):
        within = inside.get(int(i), False)
        shared = {name: 0.0 if within and name != "drag" else float(x[row]) for name, x in wet.items()}
        at = [(int(a), places[int(a)], sections[int(first)][0]), (int(b), places[int(b)], sections[int(second)][0])]
        middle = (0.5 * (at[0][1] + at[1][1]), 0.5 * (at[0][2] + at[1][2]))
        plate_keys = [
            _plate(joint, row, ends[joint], plates[joint], within) if place[2] < 0.0 else {} for joint, place, _ in at
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


def _ends(
    members: dict[str, Float], places: dict[int, Float], sections: dict[int, Float]
) -> dict[int, list[tuple[int, Float, float]]]:
    """Members at each joint, the directions out of their ends, and their diameters [m]."""
    ends: dict[int, list[tuple[int, Float, float]]] = {joint: [] for joint in places}
    for row, (_, a, b, first, second, _) in enumerate(zip(*members.values(), strict=True)):
        out = places[int(a)] - places[int(b)]
        out = out / max(float(np.linalg.norm(out)), 1e-12)
        ends[int(a)].append((row, out, float(sections[int(first)][0])))
        ends[int(b)].append((row, -out, float(sections[int(second)][0])))
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


def _of_members(file: InputFile, members: dict[str, Float], places: dict[int, Float], v: Values) -> dict[str, Float]:
    """Coefficients of members: common ones, by depth (at their middle), or per member (mean of both ends)."""
    simple, diffract = simple_coefficients(file, v.notes)
    coefficients = {name: np.full(len(members["id"]), x) for name, x in simple.items()}
    diffract = diffract and bool(np.any(members["model"] == 1))
    if np.any(members["model"] == 2):
        table = by_depth(file, v.notes)
        diffract |= diffracts(file, file.require(["NCoefDpth", "NCoefDpthCyl"], "of lines"))
        order = np.argsort(table["z"])
        z = np.array(
            [0.5 * (places[int(a)][2] + places[int(b)][2]) for a, b in zip(members["a"], members["b"], strict=True)]
        )
        for name, x in coefficients.items():
            x[members["model"] == 2] = np.interp(z, table["z"][order], table[name][order])[members["model"] == 2]
    if np.any(members["model"] == 3):
        names = {f"{n}{k}": f"Member{c}{k}" for n, c in COEFFICIENTS.items() for k in (1, 2)}
        each = hydro_table(file, "NCoefMembers", columns.BY_MEMBER, {"id": "MemberID", **names}, v.notes)
        diffract |= diffracts(file, file.require(["NCoefMembers", "NCoefMembersCyl"], "of lines"))
        where = {int(i): k for k, i in enumerate(each["id"])}
        for row in np.flatnonzero(members["model"] == 3):
            k = where.get(int(members["id"][row]))
            if k is None:
                raise InputError(
                    f"{file.path}: member {members['id'][row]:g} has MCoefMod 3, but no line of coefficients"
                )
            for name, x in coefficients.items():
                x[row] = 0.5 * (each[f"{name}1"][k] + each[f"{name}2"][k])
    if diffract:
        why = "diffraction of a platform's members is not modelled: their inertia is that of slender ones"
        v.notes.add("approximated", file.path.name, "MCF", why)
    return coefficients


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
    entry = file.find("NFillGroups")
    count = 0 if entry is None else file.count(entry)
    if entry is None or not count:
        return body
    members, places, sections = _geometry(file, v.notes)
    number_of = {int(i): k for k, i in enumerate(members["id"])}
    parts = [(body[0], np.array(body[1:4]), np.diag(body[4:]))]
    for line, words in file.rows(entry, count)[1]:
        n = int(number(words[0]) or 0) if words else 0
        which = [number_of.get(int(number(w) or 0)) for w in words[1 : n + 1]]
        if len(words) < n + 3 or not which or None in which:
            raise InputError(
                f"{file.at(line)}: FillNumM: expected {n} members, level and density, found {' '.join(words)[:60]!r}"
            )
        level, density = number(words[n + 1]) or 0.0, number(words[n + 2]) or v.given("water_density", 1025.0)
        for row in filter(lambda k: k is not None, which):
            parts += _filled(members, places, sections, row, level, density)
    masses, centres = np.array([m for m, _, _ in parts]), np.array([c for _, c, _ in parts])
    mass = float(masses.sum())
    centre = masses @ centres / mass
    arms = centres - centre
    inertia = sum(np.diag(about_centre) for _, _, about_centre in parts) + masses @ (
        (arms**2).sum(axis=1)[:, None] - arms**2
    )
    return [mass, *centre.tolist(), *np.asarray(inertia).tolist()]


def _filled(
    members: dict[str, Float],
    places: dict[int, Float],
    sections: dict[int, Float],
    row: Any,
    level: float,
    density: float,
) -> list[tuple[float, Float, Float]]:
    """Slices (mass, centre, inertia about it) of the water in a member below a level."""
    a, b = places[int(members["a"][row])], places[int(members["b"][row])]
    first, second = sections[int(members["first"][row])], sections[int(members["second"][row])]
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
