"""Water of a frame from HydroDyn: coefficients, ends of members, liquid inside them, marine growth.

HydroDyn has members of its own, which are found by their place: a member of the frame gets what the one has that lies
along its middle.
"""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass
from typing import Any

import numpy as np

import meltemi.exchange.openfast.columns as columns
from meltemi.core.errors import InputError, UnsupportedError
from meltemi.exchange.openfast.frame import table
from meltemi.exchange.openfast.members import hydro_table, members_layout
from meltemi.exchange.openfast.text import DIFFRACTS, Float, InputFile, KeywordLine, flag, number
from meltemi.exchange.openfast.water import POTENTIAL, DeckWater
from meltemi.exchange.report import Notes

NEAR, SAME = 0.05, 0.01
"""[m] distance of members, or joints, at the same place; share by which diameters differ that are the same."""
ROUND, RECTANGLE = 1, 2
SIDES = {ROUND: ("",), RECTANGLE: ("A", "B")}
"""Ends of the names of coefficients, by ``MSecGeom``; those of the sides of a rectangle give a mean."""
COEFFICIENTS = {"drag": "Cd", "added_mass": "Ca", "pressure": "Cp"}
TABLES = {1: ("", "Simpl", ("",)), 2: ("NCoefDpth", "Dpth", ("",)), 3: ("NCoefMembers", "Member", ("1", "2"))}
"""Keyword of each ``MCoefMod``, beginning of the names of its columns, and their ends at the ends of a member."""
LAYOUTS = {
    ROUND: (columns.SIMPLE, columns.BY_DEPTH, columns.BY_MEMBER),
    RECTANGLE: (columns.SIMPLE_REC, columns.BY_DEPTH_REC, columns.BY_MEMBER_REC),
}
DRY: dict[str, Any] = {"drag": 0.0, "added_mass": 0.0, "pressure": 0.0}


@dataclass(frozen=True)
class HydroMember:
    """A member of HydroDyn from ``a`` to ``b`` (3,) [m], of breadth and wall (2,) [m] at both ends, in ``line``."""

    number: int
    line: int
    a: Float
    b: Float
    geometry: int
    size: Float
    piece: float
    model: int
    within: bool

    def place_of(self, x: Float, y: Float) -> tuple[float, float]:
        """Distance [m] of the middle of a line from x to y (3,), infinite across the member, and its place (0 to 1)."""
        along, d = self.b - self.a, y - x
        middle = 0.5 * (x + y) - self.a
        s = float(middle @ along / (along @ along))
        across = np.linalg.norm(np.cross(along, d)) / (np.linalg.norm(along) * np.linalg.norm(d))
        beside = across > NEAR or not -1e-3 <= s <= 1.0 + 1e-3
        return (math.inf if beside else float(np.linalg.norm(middle - s * along))), s


def frame_in_water(water: DeckWater, frame: dict[str, Any], notes: Notes) -> dict[str, Any]:
    """The frame with the water of HydroDyn, as keys of ``Frame``; without HydroDyn no water acts on it.

    Raises:
      InputError: a table of HydroDyn is malformed.
      UnsupportedError: a frame on the sea bed is in potential flow.
    """
    v, file = water.v, water.file
    if v["depth"] is None:
        raise InputError("WtrDpth: the depth of the water is needed, in the main file or in SeaState")
    frame |= {"depth": v["depth"], "water_density": v.given("water_density", 1025.0)}
    beams = {name: m for name, m in frame["members"].items() if m.get("kind", "beam") == "beam"}
    if file is None:
        for member in beams.values():
            member["potential_flow"] = True
        notes.add("equivalent", frame["source"], "no HydroDyn", "no water acts on the members")
        return frame | {"hydrodynamics": DRY}
    if frame["feet"]:
        v.unneeded("of PotMod 1", *POTENTIAL)
        v.unneeded("of a platform", "drift_cutoff")
        if v.given("potential", 0):
            raise UnsupportedError(f"{file.path}: PotMod {v['potential']}: members on the bed have Morison's equation")
    if growth := water.growth():
        frame["growth"] = growth
    members, given = hydro_members(file, notes), Tables(file, notes, grown=bool(growth))
    fills = _fills(file, members, frame, v.given("level", 0.0), notes)
    sets: dict[str, dict[str, Any]] = {}
    pieces: list[float] = []
    for name, member in beams.items():
        x, y = (frame["joints"][joint] for joint in member["joints"])
        places = [(*each.place_of(x, y), each) for each in members]
        distance, s, one = min(places, key=lambda place: place[0])
        if distance <= NEAR:
            sets[name] = given.of(one, s, 0.5 * float(x[2] + y[2]))
            member |= fills.get(one.number, {}) | ({"potential_flow": True} if one.within else {})
            _compare(frame["sections"], member, one, s, name, file, notes)
            pieces += [one.piece] * int(min(x[2], y[2]) < 0.0)
        elif max(x[2], y[2]) > -v["depth"]:
            member |= {"hydrodynamics": "dry", "potential_flow": True}
            what, why = f"member {name}", "no water acts on members that HydroDyn does not have at their place"
            notes.add("equivalent", file.path.name, what, why)
    if pieces:
        frame["piece"] = float(np.clip(min(pieces), 0.1, 50.0))
    for target, key in (("axial", "ends, other_ends"), ("members", "hydrodynamics, other_hydrodynamics")):
        v.note("used", target, f"frame.{key}")
    for target in ("sections", "joints"):
        v.note("equivalent", target, "geometry is that of SubDyn; members are found by their place")
    v.unneeded("of a platform", "diffraction_radius")
    where = file.path.name
    notes[:] = [n for n in notes if n.kind != "ignored" or not n.where.startswith(where) or "Rec =" not in n.what]
    return frame | _named(sets, beams) | _ends(file, frame, beams, notes)


def hydro_members(file: InputFile, notes: Notes) -> list[HydroMember]:
    """Members of HydroDyn.

    Raises:
      InputError: there are none, or one names joints or sections that are not there.
    """
    rows, layout = members_layout(file)
    wanted = {"id": "JointID", "x": "Jointxi", "y": "Jointyi", "z": "Jointzi"}
    joints = {int(i): x for i, *x in hydro_rows(file, "NJoints", columns.HYDRO_JOINTS, wanted, notes)}
    wanted = {"id": "PropSetID", "d": "PropD", "t": "PropThck"}
    sections = {(ROUND, i): x for i, *x in hydro_rows(file, "NPropSets", columns.HYDRO_SECTIONS, wanted, notes)}
    if file.find("NPropSetsRec") is not None:
        wanted = {"id": "PropSetID", "a": "PropA", "b": "PropB", "t": "PropThck"}
        rectangles = hydro_rows(file, "NPropSetsRec", columns.HYDRO_RECTANGLES, wanted, notes)
        sections |= {(RECTANGLE, i): [0.5 * (a + b), t] for i, a, b, t in rectangles}
    names = layout[:-1]
    values = hydro_rows(file, "NMembers", " ".join(layout), dict(zip(names, names, strict=True)), notes)
    content = []
    for (line, words), row in zip(rows, values, strict=True):
        each = dict(zip(names, row, strict=True))
        i, geometry = int(each["MemberID"]), int(each.get("MSecGeom", ROUND))
        ends, sets = ([int(each[f"{name}{k}"]) for k in (1, 2)] for name in ("MJointID", "MPropSetID"))
        if not set(ends) <= set(joints) or not {(geometry, k) for k in sets} <= set(sections):
            raise InputError(f"{file.at(line)}: member {i} names a joint or property set that is not defined")
        (a, b), size = (np.array(joints[k]) for k in ends), np.array([sections[geometry, k] for k in sets])
        within, model = bool(flag(words[len(names)])), int(each["MCoefMod"])
        content.append(HydroMember(i, line, a, b, geometry, size, each["MDivSize"], model, within))
        if each.get("MHstLMod", 1) == 0 and not within:
            notes.add("ignored", file.place(line), f"MHstLMod of member {i} is 0", "members have buoyancy")
    if not content:
        raise InputError(f"{file.path}: NMembers: expected members in the water, found none; CompHydro 0 has no water")
    return content


def hydro_rows(file: InputFile, count: str, layout: str, wanted: dict[str, str], notes: Notes) -> list[list[float]]:
    """Rows of a table of HydroDyn, of the wanted columns."""
    rows: list[list[float]] = np.column_stack([*hydro_table(file, count, layout, wanted, notes).values()]).tolist()
    return rows


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
            if self.grown and values[f"grown_{name}"] != x:
                content[f"grown_{name}"] = values[f"grown_{name}"]
        return content | ({"diffraction": "maccamy_fuchs"} if thick[row] else {})


def _means(values: dict[str, Float], prefix: str, geometry: int, end: str) -> dict[str, Float]:
    return {
        ("grown_" if growth else "") + name: np.mean([values[f"{prefix}{c}{x}{growth}{end}"] for x in sides], axis=0)
        for name, c in COEFFICIENTS.items()
        for sides in [SIDES[geometry] if c != "Cp" else ("",)]
        for growth in ("", "MG")
    }


def _named(sets: dict[str, dict[str, Any]], beams: dict[str, Any]) -> dict[str, Any]:
    """Coefficients of most members, and others by the name of the first member that has them."""
    keys = {name: tuple(sorted(each.items())) for name, each in sets.items()}
    usual = Counter(keys.values()).most_common(1)[0][0] if keys else ()
    others: dict[Any, str] = {}
    for name, key in keys.items():
        if key != usual:
            beams[name]["hydrodynamics"] = others.setdefault(key, name)
    named = {name: dict(key) for key, name in others.items()}
    named |= {"dry": DRY} if len(keys) < len(beams) else {}
    return {"hydrodynamics": dict(usual), "other_hydrodynamics": named}


def _compare(
    sections: dict[str, Any],
    member: dict[str, Any],
    one: HydroMember,
    s: float,
    name: str,
    file: InputFile,
    notes: Notes,
) -> None:
    """Compare the sections of SubDyn and HydroDyn; general ones get HydroDyn's diameter and wall."""
    ends = [sections[member["section"]], sections[member.get("end_section", member["section"])]]
    breadth, wall = one.size[0] + s * (one.size[1] - one.size[0])
    if ends[0]["kind"] == "general" and "diameter" not in ends[0]:
        for each in ends:
            each |= {"diameter": float(breadth), "thickness": float(wall)}
    ours = np.mean([each.get("diameter") or 0.5 * (each["width"] + each["height"]) for each in ends])
    if abs(ours - breadth) > SAME * breadth:
        what, why = f"member {name}: {breadth:.4g} m wide in the water", f"water acts on the {ours:.4g} m of SubDyn"
        notes.add("warning", file.place(one.line), what, why)


def _fills(
    file: InputFile, members: list[HydroMember], frame: dict[str, Any], level: float, notes: Notes
) -> dict[int, dict[str, Any]]:
    """Liquid inside members by their number: the sea, in groups that reach below the bed, or up to a level."""
    content: dict[int, dict[str, Any]] = {}
    lowest = {m.number: float(min(m.a[2], m.b[2])) for m in members}
    for row in table(file, ["NFillGroups"], 3, notes):
        n = int(row.numbers(0, 1)[0])
        which = {int(number(word) or 0) for word in row.words[1 : n + 1]}
        top, density = ([number(word.strip("'\"")) for word in row.words[n + 1 : n + 3]] + [None, None])[:2]
        if not which or top is None or not which <= set(lowest):
            raise row.error(f"FillNumM: expected {n} members, level and density, found {' '.join(row.words)[:60]!r}")
        each = {"filled_to": top, "fill_density": frame["water_density"] if density is None else density}
        if min(lowest[i] for i in which) < -frame["depth"] - 1e-6:
            each = {"flooded": True}
            if abs(top - level) > NEAR:
                what, why = f"FillFSLoc {top:g} m", "the sea fills legs to its level"
                notes.add("approximated", file.place(row.line), what, why)
        content |= dict.fromkeys(which, each)
    return content


def _ends(file: InputFile, frame: dict[str, Any], beams: dict[str, Any], notes: Notes) -> dict[str, Any]:
    """Coefficients of the ends of members at joints: those of most joints, and others."""
    wanted = {"id": "AxCoefID", "drag": "AxCd", "added_mass": "AxCa", "pressure": "AxCp"}
    sets = {int(i): tuple(c) for i, *c in hydro_rows(file, "NAxCoef", columns.AXIAL, wanted, notes)}
    for row in table(file, ["NAxCoef"], 4, notes):
        if len(row.words) > 4 and number(row.words[4]):
            notes.add("approximated", file.place(row.line), f"AxFDMod {row.words[4]}", "drag of ends is that of 0")
    wanted = {"x": "Jointxi", "y": "Jointyi", "z": "Jointzi", "kind": "JointAxID"}
    rows = np.array(hydro_rows(file, "NJoints", columns.HYDRO_JOINTS, wanted, notes))
    count = Counter(joint for member in beams.values() for joint in member["joints"])
    at = {}
    for joint in count:
        distance = np.linalg.norm(rows[:, :3] - frame["joints"][joint], axis=1)
        k = int(np.argmin(distance))
        at[joint] = sets.get(int(rows[k, 3]), (0.0,) * 3) if distance[k] < NEAR else (0.0,) * 3
    usual = Counter(at.values()).most_common(1)[0][0]
    through = [j for j, each in at.items() if count[j] > 2 and any(each) and frame["joints"][j][2] < 0.0]
    if through:
        why = (
            "ends of braces inside legs act as plates in the water: some per cent of the base shear, more of the "
            "vertical force; set frame.ends to zeros unless the deck is to be compared"
        )
        notes.add("warning", file.path.name, f"end coefficients at {len(through)} joints of several members", why)
    ends = {joint: dict(zip(DRY, each, strict=True)) for joint, each in at.items()}
    others = {joint: ends[joint] for joint, each in at.items() if each != usual}
    return {"ends": next(ends[joint] for joint, each in at.items() if each == usual), "other_ends": others}
