"""Members of a platform from HydroDyn: columns, pontoons and plates beside potential flow, or instead of it.

A joint of several members has the area of all, as vectors out of each end (HydroDyn, axial loads): a heave plate
under a thinner column has a wet ring above. The force of drag on an end is rho A AxCd v^2 / 4 there, of both sides,
and rho A plate_drag v^2 / 2 here.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from meltemi.core.errors import InputError, UnsupportedError
from meltemi_exchange.openfast.text import Entry, Float, InputFile, number, split
from meltemi_exchange.openfast.values import Values

AXIAL = {"plate_drag": 0.5, "plate_added_mass": 1.0, "plate_pressure": 1.0}
"""Our coefficient over HydroDyn's AxCd, AxCa, AxCp."""
COEFFICIENTS = {"drag": "Cd", "added_mass": "Ca", "pressure": "Cp"}


def _table(file: InputFile, count: str, columns: dict[str, str]) -> dict[str, Float]:
    return file.table(file.require([count, f"{count}Cyl"], "of lines"), columns)


def _geometry(file: InputFile) -> tuple[dict[str, Float], dict[int, Float], dict[int, Float]]:
    """Members, places of joints [m], and outer diameter and wall [m] of sections, by their numbers."""
    names = {"id": "MemberID", "a": "MJointID1", "b": "MJointID2", "first": "MPropSetID1", "second": "MPropSetID2"}
    members = _table(file, "NMembers", names | {"model": "MCoefMod" if file.has_word("MCoefMod") else "CoefMod"})
    joints = _table(file, "NJoints", {"id": "JointID", "x": "Jointxi", "y": "Jointyi", "z": "Jointzi"})
    sections = _table(file, "NPropSets", {"id": "PropSetID", "d": "PropD", "t": "PropThck"})
    places = {int(i): np.array(x) for i, *x in zip(*joints.values(), strict=True)}
    found = {int(i): np.array(x) for i, *x in zip(*sections.values(), strict=True)}
    for i, a, b, first, second, _ in zip(*members.values(), strict=True):
        if not {int(a), int(b)} <= set(places) or not {int(first), int(second)} <= set(found):
            raise InputError(f"{file.path}: member {i:g} names a joint or property set that is not defined")
    return members, places, found


def read_members(file: InputFile, v: Values) -> list[dict[str, Any]]:
    """Round members of a platform, as keys of ``Member``.

    Raises:
      InputError: with file and line.
      UnsupportedError: members of other sections.
    """
    members, places, sections = _geometry(file)
    if (rectangles := file.find("NPropSetsRec")) is not None and file.count(rectangles):
        raise UnsupportedError(f"{file.path}: NPropSetsRec: members of a platform are round")
    v.differs("ignored", 0, growth="growth on a platform is not modelled")
    wet = _of_members(file, members, places)
    inside = _in_potential_flow(file)
    axial = _table(file, "NAxCoef", {"id": "AxCoefID"} | dict(zip(AXIAL, ("AxCd", "AxCa", "AxCp"), strict=True)))
    sets = {int(i): c for i, *c in zip(*axial.values(), strict=True)}
    kinds = _table(file, "NJoints", {"id": "JointID", "kind": "JointAxID"})
    ends = _ends(members, places, sections)
    found: list[dict[str, Any]] = []
    plates = {int(j): sets.get(int(k), [0.0] * 3) for j, k in zip(kinds["id"], kinds["kind"], strict=True)}
    for row, (i, a, b, first, second, _) in enumerate(zip(*members.values(), strict=True)):
        within = inside.get(int(i), False)
        shared = {name: 0.0 if within and name != "drag" else float(x[row]) for name, x in wet.items()}
        at = [(int(a), places[int(a)], sections[int(first)][0]), (int(b), places[int(b)], sections[int(second)][0])]
        middle = (0.5 * (at[0][1] + at[1][1]), 0.5 * (at[0][2] + at[1][2]))
        own = [
            _plate(joint, row, ends[joint], plates[joint], within) if place[2] < 0.0 else {} for joint, place, _ in at
        ]
        halves = [(at[k][1], at[k][2], own[k]) for k in (0, 1)]
        if own[0] and own[1]:  # a plate is at the start of a member: one for each
            pieces = [(half, middle) for half in halves]
        else:
            k = 1 if own[1] else 0
            pieces = [(halves[k], (at[1 - k][1], at[1 - k][2]))]
        for (start, d, plate), (end, d_end) in pieces:
            cone = {} if d == d_end else {"end_diameter": float(d_end)}
            found.append({"start": start, "end": end, "diameter": float(d)} | cone | shared | plate)
    return found


def _ends(
    members: dict[str, Float], places: dict[int, Float], sections: dict[int, Float]
) -> dict[int, list[tuple[int, Float, float]]]:
    """For each joint its members, the directions out of their ends, and their diameters [m]."""
    found: dict[int, list[tuple[int, Float, float]]] = {joint: [] for joint in places}
    for row, (_, a, b, first, second, _) in enumerate(zip(*members.values(), strict=True)):
        out = places[int(a)] - places[int(b)]
        out = out / max(float(np.linalg.norm(out)), 1e-12)
        found[int(a)].append((row, out, float(sections[int(first)][0])))
        found[int(b)].append((row, -out, float(sections[int(second)][0])))
    return found


def _plate(
    joint: int, row: int, ends: list[tuple[int, Float, float]], coefficients: list[float], within: bool
) -> dict[str, float]:
    """Coefficients of an end as a plate; those of a joint are with its widest member."""
    widest, normal, d = max(ends, key=lambda each: each[2])
    if widest != row or not any(coefficients):
        return {}
    area = abs(float(sum(each[2] ** 2 * (each[1] @ normal) for each in ends))) / d**2
    ball = abs(float(sum(each[2] ** 3 * (each[1] @ normal) for each in ends))) / d**3
    size = dict(zip(AXIAL, (area, ball, area), strict=True))
    found = {n: f * c * size[n] for (n, f), c in zip(AXIAL.items(), coefficients, strict=True)}
    if within:  # potential flow has inertia and pressure
        found = {"plate_drag": found["plate_drag"]}
    return {n: x for n, x in found.items() if x > 1e-9}


def _of_members(file: InputFile, members: dict[str, Float], places: dict[int, Float]) -> dict[str, Float]:
    """Coefficients of members: for all, by depth (at their middle), or of each (mean of both ends)."""
    simple = file.table(Entry("SimplCd", ("1",), 0), {n: f"Simpl{c}" for n, c in COEFFICIENTS.items()})
    found = {name: np.full(len(members["id"]), x[0]) for name, x in simple.items()}
    if np.any(members["model"] == 2):
        by_depth = _table(file, "NCoefDpth", {"z": "Dpth"} | {n: f"Dpth{c}" for n, c in COEFFICIENTS.items()})
        order = np.argsort(by_depth["z"])
        z = np.array(
            [0.5 * (places[int(a)][2] + places[int(b)][2]) for a, b in zip(members["a"], members["b"], strict=True)]
        )
        for name, x in found.items():
            x[members["model"] == 2] = np.interp(z, by_depth["z"][order], by_depth[name][order])[members["model"] == 2]
    if np.any(members["model"] == 3):
        names = {f"{n}{k}": f"Member{c}{k}" for n, c in COEFFICIENTS.items() for k in (1, 2)}
        each = _table(file, "NCoefMembers", {"id": "MemberID", **names})
        where = {int(i): k for k, i in enumerate(each["id"])}
        for row in np.flatnonzero(members["model"] == 3):
            k = where.get(int(members["id"][row]))
            if k is None:
                raise InputError(
                    f"{file.path}: member {members['id'][row]:g} has MCoefMod 3, but no line of coefficients"
                )
            for name, x in found.items():
                x[row] = 0.5 * (each[f"{name}1"][k] + each[f"{name}2"][k])
    return found


def _in_potential_flow(file: InputFile) -> dict[int, bool]:
    """Of each member whether it is part of potential flow (PropPot)."""
    entry = file.require(["NMembers"], "of lines")
    header, rows = file.rows(entry, file.count(entry), "MJointID1")
    place = next((k for k, name in enumerate(header) if name.lower() == "proppot"), None)
    return {int(number(r[0]) or 0): place is not None and r[place].lower().startswith("t") for _, r in rows}


def displaced(members: list[dict[str, Any]]) -> float:
    """[m^3] of water that members displace at rest."""
    from meltemi_float.members import Member, at_rest

    return at_rest([Member.model_validate(each) for each in members])[0]


def with_ballast(body: list[float], file: InputFile, v: Values) -> list[float]:
    """Mass, centre (3) and inertia (3) about it of a platform with the water inside of filled members.

    Raises:
      InputError: the table of filled members is not one.
    """
    count = int(v.given("fills", 0))
    if not count:
        return body
    members, places, sections = _geometry(file)
    number_of = {int(i): k for k, i in enumerate(members["id"])}
    at = next((i for i, line in enumerate(file.lines) if line.split()[:1] == ["FillNumM"]), len(file.lines))
    parts = [(body[0], np.array(body[1:4]), np.diag(body[4:]))]
    for line in file.lines[at + 2 : at + 2 + count]:
        words = split(line)
        n = int(number(words[0]) or 0) if words else 0
        which = [number_of.get(int(number(w) or 0)) for w in words[1 : n + 1]]
        if len(words) < n + 3 or not which or None in which:
            raise InputError(
                f"{file.path}: FillNumM: expected {n} members, level and density, found {line.strip()[:60]!r}"
            )
        level, density = number(words[n + 1]) or 0.0, number(words[n + 2]) or v.given("water_density", 1025.0)
        for row in filter(lambda k: k is not None, which):
            parts += _filled(members, places, sections, row, level, density)
    masses, centres = np.array([m for m, _, _ in parts]), np.array([c for _, c, _ in parts])
    mass = float(masses.sum())
    centre = masses @ centres / mass
    arms = centres - centre
    inertia = sum(np.diag(own) for _, _, own in parts) + masses @ ((arms**2).sum(axis=1)[:, None] - arms**2)
    return [mass, *centre.tolist(), *np.asarray(inertia).tolist()]


def _filled(
    members: dict[str, Float],
    places: dict[int, Float],
    sections: dict[int, Float],
    row: Any,
    level: float,
    density: float,
) -> list[tuple[float, Float, Float]]:
    """Slices (mass, centre, inertia about it) of the water inside of a member below a level."""
    a, b = places[int(members["a"][row])], places[int(members["b"][row])]
    first, second = sections[int(members["first"][row])], sections[int(members["second"][row])]
    axis, size = (b - a) / np.linalg.norm(b - a), float(np.linalg.norm(b - a))
    share = (np.arange(200) + 0.5) / 200
    found = []
    for s in share:
        place = a + s * (b - a)
        if place[2] < level:
            d, t = first + s * (second - first)
            r = 0.5 * d - t
            m = density * np.pi * r**2 * size / 200
            found.append((m, place, 0.25 * m * r**2 * (np.eye(3) + np.outer(axis, axis))))
    return found
