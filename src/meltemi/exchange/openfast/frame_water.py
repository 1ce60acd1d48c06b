"""Water of a frame from HydroDyn: coefficients, ends of members, liquid inside them, marine growth.

HydroDyn has members of its own, which are found by their place: a member of the frame gets what the one has that lies
along its middle.
"""

from __future__ import annotations

from collections import Counter
from typing import Any

import numpy as np

import meltemi.exchange.openfast.columns as columns
from meltemi.core.errors import InputError, UnsupportedError
from meltemi.exchange.openfast.frame import table
from meltemi.exchange.openfast.members import (
    NEAR,
    HydroMember,
    Tables,
    fill_groups,
    hydro_members,
    hydro_rows,
)
from meltemi.exchange.openfast.text import InputFile, number
from meltemi.exchange.openfast.water import POTENTIAL, DeckWater
from meltemi.exchange.report import Notes

SAME = 0.01
"""Share by which diameters differ that are the same."""
DRY: dict[str, Any] = {"drag": 0.0, "added_mass": 0.0, "pressure": 0.0}


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
    for one in members:
        if one.hydrostatics == 0 and not one.within:
            notes.add("ignored", file.place(one.line), f"MHstLMod of member {one.number} is 0", "members have buoyancy")
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
    for line, which, top, density in fill_groups(file, members, notes):
        each = {"filled_to": top, "fill_density": frame["water_density"] if density is None else density}
        if min(float(min(m.a[2], m.b[2])) for m in which) < -frame["depth"] - 1e-6:
            each = {"flooded": True}
            if abs(top - level) > NEAR:
                what, why = f"FillFSLoc {top:g} m", "the sea fills legs to its level"
                notes.add("approximated", file.place(line), what, why)
        content |= dict.fromkeys((m.number for m in which), each)
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
