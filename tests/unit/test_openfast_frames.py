"""Frames of many members in OpenFAST decks: SubDyn and HydroDyn of three generations, superelements, and back again."""

from __future__ import annotations

import math
import re
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from meltemi import InputError, ModelOptions, Turbine, UnsupportedError, load_turbine
from meltemi.core.yamlfile import validated
from meltemi.exchange.openfast import read_deck
from meltemi.exchange.openfast.frame import read_frame, rigid_body
from meltemi.exchange.openfast.frame_water import frame_in_water
from meltemi.exchange.openfast.keywords import row_of
from meltemi.exchange.openfast.members import hydro_members
from meltemi.exchange.openfast.text import read_input
from meltemi.exchange.openfast.values import Values
from meltemi.exchange.openfast.water import DeckWater
from meltemi.exchange.openfast_writer.frame import water
from meltemi.exchange.report import Notes
from meltemi.frames.definition import Frame
from meltemi.io import write_openfast
from meltemi.sea.kinds import sea_of

BASE = 20.15
GENERATIONS = (3, 4, 5)
SIMPLE = ModelOptions(stall="static", inflow="quasi_steady")
LEGS = [(x, y) for x in (-1.0, 1.0) for y in (-1.0, 1.0)]
"""A tower of four legs: feet, a ring under water, and heads under the tower."""


def table(count: str, rows: list[str], head: str = "") -> str:
    names = head or "ID values"
    return f"{len(rows)} {count} - number\n{names}\n(-) (-)\n" + "".join(f"{row}\n" for row in rows)


def subdyn(generation: int, **changed: str) -> str:
    """SubDyn of a small jacket in the format of a generation; ``changed`` replaces rows of tables."""
    joints = [f"{i + 1} {8 * x} {8 * y} -30.001" for i, (x, y) in enumerate(LEGS)]
    joints += [f"{i + 5} {6 * x} {6 * y} -10.0" for i, (x, y) in enumerate(LEGS)]
    joints += [f"{i + 9} {4 * x} {4 * y} 16.15" for i, (x, y) in enumerate(LEGS)]
    ends = [(i, i + 4, 1, 1) for i in range(1, 5)] + [(i, i + 4, 1, 2) for i in range(5, 9)]
    ends += [(5, 6, 3, 3), (6, 8, 3, 3), (8, 7, 3, 3), (7, 5, 3, 3)]
    kind, none = ("1c", "0") if generation == 5 else ("1", "-1")
    members = [f"{k + 1} {a} {b} {p} {q} {kind} {none}" for k, (a, b, p, q) in enumerate(ends)]
    tubes = ["1 2.1e11 8.08e10 7850 1.2 0.05", "2 2.1e11 8.08e10 7850 1.0 0.04", "3 2.1e11 8.08e10 7850 0.6 0.02"]
    piece = "1 " if generation == 5 else ""
    matrix = "".join(" ".join("4e5" if i == j == 0 else "0" for j in range(6)) + "\n" for i in range(6))
    parts = {
        "head": "title\na title\nFalse Echo\n" + ("False GuyanLoadCorrection\n" if generation == 3 else ""),
        "finite": "3 FEMMod\n2 NDiv\n" + ("True CBMod\n" if generation < 5 else "") + "8 Nmodes\n1 JDampings\n",
        "damping": f"2 GuyanDampMod\n0.0, 0.0 RayleighDamp\n6 GuyanDampSize\n{matrix}",
        "offset": "RBSurge RBSway RBHeave\n(m) (m) (m)\n0 0 0 0 0 0\n" if generation == 5 else "",
        "joints": table("NJoints", [f"{row} 1 0 0 0 0" for row in joints], "JointID JointXss JointYss JointZss"),
        "reactions": table("NReact", [f'{i} 1 1 1 1 1 1 ""' for i in range(1, 5)]),
        "interfaces": table("NInterf", [f"{i} {piece}1 1 1 1 1 1" for i in range(9, 13)]),
        "members": table("NMembers", members, "MemberID MJointID1 MJointID2 MPropSetID1 MPropSetID2"),
        "tubes": table("NPropSetsCyl" if generation == 5 else "NPropSets", tubes, "PropSetID YoungE ShearG MatDens"),
        "rectangles": table("NPropSetsRec", []) if generation == 5 else "",
        "generals": table("NXPropSets", []),
        "cables": table("NCablePropSets", []),
        "links": table("NRigidPropSets", []),
        "springs": table("NSpringPropSets", []),
        "cosines": table("NCOSMs", []),
        "masses": table("NCmass", ["5 1000 10 20 30", "6 500 1 2 3 0 0 0.5 0.1 0.2 0.3"]),
    } | changed
    return "".join(parts.values()) + "False SumPrint\nEND\n"


def hydrodyn(generation: int, **changed: str) -> str:
    """HydroDyn of the same: its legs are one member each, and its ring has other coefficients."""
    joints = [f"{i + 1} {8 * x} {8 * y} -30.001 1 0" for i, (x, y) in enumerate(LEGS)]
    joints += [f"{i + 5} {6 * x} {6 * y} -10.0 2 0" for i, (x, y) in enumerate(LEGS)]
    joints += [f"{i + 9} {4 * x} {4 * y} 16.15 1 0" for i, (x, y) in enumerate(LEGS)]
    extra = {3: "", 4: "1 ", 5: "1 "}[generation]
    section = "1 0 " if generation == 5 else ""
    ends = [(i, i + 4, 1, 1) for i in range(1, 5)] + [(i, i + 4, 1, 2) for i in range(5, 9)]
    rows = [f"{i} {a} {b} {p} {q} {section}2.5 1 {extra}False" for i, (a, b, p, q) in enumerate(ends, 1)]
    ring = [(5, 6), (6, 8), (8, 7), (7, 5)]
    rows += [f"{i} {a} {b} 3 3 {section}1.5 3 {extra}False" for i, (a, b) in enumerate(ring, 9)]
    last = "1 1" if generation > 3 else ""
    own = [f"{i} " + "0.7 0.9 0.8 0.8 1.1 1.1 1.1 1.1 1 1 1 1 " + "0 " * 12 + f"{last} {last}" for i in range(9, 13)]
    kind = "Cyl" if generation == 5 else ""
    new = generation == 5
    parts = {
        "head": "title\na title\n0 PotMod\n" + ("30 WtrDpth\n0 WaveMod\n" if generation == 3 else ""),
        "axial": table("NAxCoef", ["1 0 0 0", "2 0.5 0.6 1.0"], "AxCoefID AxCd AxCa AxCp"),
        "joints": table("NJoints", joints, "JointID Jointxi Jointyi Jointzi JointAxID JointOvrlp"),
        "sections": table(f"NPropSets{kind}", ["1 1.2 0.05", "2 1.0 0.04", "3 0.6 0.02"], "PropSetID PropD PropThck"),
        "rectangles": table("NPropSetsRec", []) if new else "",
        "simple": f"--- SIMPLE ---\nSimplCd SimplCdMG SimplCa\n(-) (-) (-)\n1 1.2 1 1 1 1 0 0 0 0 1 1 {last}\n",
        "simple_rectangles": "--- SIMPLE ---\nSimplCdA SimplCdAMG SimplCdB\n(-) (-) (-)\n" + "0 " * 18 + "\n"
        if new
        else "",
        "by_depth": table(f"NCoefDpth{kind}", [], "Dpth DpthCd"),
        "by_depth_rectangles": table("NCoefDpthRec", []) if new else "",
        "by_member": table(f"NCoefMembers{kind}", own, "MemberID MemberCd1"),
        "by_member_rectangles": table("NCoefMembersRec", []) if new else "",
        "members": table("NMembers", rows, "MemberID MJointID1 MJointID2 MPropSetID1 MPropSetID2"),
        "fills": table("NFillGroups", ["4 1 2 3 4 0.0 DEFAULT", "2 9 10 -10.5 1000"], "FillNumM FillMList"),
        "growth": table("NMGDepths", ["-2 0.1 1100", "-20 0.1 1100"], "MGDpth MGThck MGDens"),
    } | changed
    return "".join(parts.values()) + "False HDSum\nEND\n"


def read(folder: Path, sub: str, hydro: str | None = None) -> tuple[dict[str, Any], Notes]:
    """A frame on a transition piece of 100 t at 18.15 m."""
    (folder / "SubDyn.dat").write_text(sub)
    (folder / "main.fst").write_text("title\n1 CompHydro\n1 CompSeaSt\n'HydroDyn.dat' HydroFile\n")
    (folder / "SeaState.dat").write_text("title\n1025 WtrDens\n30 WtrDpth\n")
    (folder / "HydroDyn.dat").write_text(hydro or "")
    notes = Notes()
    v = Values(notes)
    v.data = {"tower.base_height": BASE, "platform_mass": 1e5, "platform_centre_z": 18.15, "platform_inertia_R": 7e6}
    v.data |= {"platform_reference_z": 18.15, "comp_hydro": int(hydro is not None), "hydro_file": "HydroDyn.dat"}
    v.data |= {"comp_sea": 1, "sea_file": "SeaState.dat", "depth": 30.0}
    water = DeckWater(read_input(folder / "main.fst", "main"), v, notes)
    content = read_frame(read_input(folder / "SubDyn.dat", "SubDyn"), v, notes)
    return frame_in_water(water, content, notes), notes


def frame_of(folder: Path, sub: str, hydro: str | None = None) -> Frame:
    content = read(folder, sub, hydro)[0]
    content.pop("rayleigh", None)
    return validated(content, Frame, "frame")


@pytest.mark.parametrize("generation", GENERATIONS)
def test_a_jacket_of_three_generations(generation: int, tmp_path: Path) -> None:
    frame = frame_of(tmp_path, subdyn(generation), hydrodyn(generation))
    assert (len(frame.joints), len(frame.members), len(frame.feet), frame.divisions) == (12, 12, 4, 2)
    assert frame.interface == ("J9", "J10", "J11", "J12")
    assert (frame.depth, frame.piece) == (30.0, 1.5)
    assert frame.members["M5"].joints == ("J5", "J9")
    assert (frame.members["M5"].section, frame.members["M5"].end_section) == ("tube1", "tube2")
    assert frame.sections["tube3"].diameter == 0.6 and frame.sections["tube3"].thickness == 0.02
    assert frame.joints["J1"] == pytest.approx([-8.0, -8.0, -30.001])
    piece, at_joint, offset = (next(m for m in frame.masses if m.joint == j) for j in ("J9", "J5", "J6"))
    assert (piece.mass, at_joint.mass, offset.mass) == (1e5, 1000.0, 500.0)
    assert piece.centre == pytest.approx([4.0, 4.0, 2.0]) and piece.inertia == pytest.approx([7e6, 0, 0, 0, 0, 0])
    assert offset.centre == pytest.approx([0.1, 0.2, 0.3]) and offset.inertia == pytest.approx([1, 2, 3, 0, 0, 0.5])
    assert frame.hydrodynamics.content() | {"diffraction": 0} == {
        "drag": 1.0, "added_mass": 1.0, "pressure": 1.0, "grown_drag": 1.2, "grown_added_mass": None,
        "grown_pressure": None, "diffraction": 0,
    }  # fmt: skip
    assert [frame.members[f"M{i}"].hydrodynamics for i in (1, 5, 9, 12)] == [None, None, "M9", "M9"]
    ring = frame.other_hydrodynamics["M9"]
    assert (ring.drag, ring.added_mass, ring.grown_drag, ring.pressure) == pytest.approx((0.8, 1.1, None, 1.0))
    assert frame.other_ends["J5"].content() == {"drag": 0.5, "added_mass": 0.6, "pressure": 1.0}
    assert set(frame.other_ends) == {"J5", "J6", "J7", "J8"} and not any(frame.ends.content().values())
    assert [frame.members[f"M{i}"].flooded for i in (1, 4, 5, 9)] == [True, True, False, False]
    assert (frame.members["M9"].filled_to, frame.members["M9"].fill_density) == (-10.5, 1000.0)
    (layer,) = frame.growth
    assert layer.content() == {"bottom": -20.0, "top": -2.0, "thickness": 0.1, "density": 1100.0}
    # 2 m below the tower's base a force along x has the moment -2 m times itself about y
    damping = np.zeros((6, 6))
    damping[0, 0], damping[0, 4], damping[4, 0], damping[4, 4] = 4e5, -8e5, -8e5, 16e5
    assert frame.interface_damping == pytest.approx(damping)


def test_every_key_is_in_the_report(tmp_path: Path) -> None:
    _, notes = read(tmp_path, subdyn(5), hydrodyn(5))
    for name in ("SubDyn", "HydroDyn"):
        for entries in read_input(tmp_path / f"{name}.dat", name).entries.values():
            for entry in entries:
                where = f"{name}.dat:{entry.line}"
                known = row_of(name, entry.name) is not None
                assert not known or any(n.where == where and n.what.startswith(entry.name) for n in notes), entry
    warned = [n.what for n in notes if n.kind == "warning"]
    assert warned == ["end coefficients at 4 joints of several members"]


def test_kinds_of_members_joints_and_feet(tmp_path: Path) -> None:
    k = " ".join("1e8" if i == j else "5e6" if (i, j) == (0, 1) else "0" for i in range(6) for j in range(i, 6))
    changed = {
        "joints": table("NJoints", [
            "1 0 0 -20 1 0 0 0 0", "2 0 0 -5 3 0 1 0 7e5", "3 0 0 10 1 0 0 0 0", "4 5 0 10 2 0 0 0 0",
            "5 9 0 10 4 0 0 0 0", "6 9 5 10 1 0 0 0 0", "7 9 5 10 1 0 0 0 0", "8 12 5 12 1 0 0 0 0",
        ]),
        "reactions": table("NReact", ['1 1 1 0 0 0 0 "ground.dat"', "6 1 1 1 1 1 1"]),
        "interfaces": table("NInterf", ["3 1 1 1 1 1 1 1"]),
        "members": table("NMembers", [
            "1 1 2 1 1 1c 0", "2 2 3 1 1 1 0", "3 3 4 1 1 1r 30", "4 4 5 2 2 4 -1", "5 5 6 3 3 1c 0",
            "6 6 7 1 1 5 1", "7 6 8 1 1 2 0", "8 7 8 1 1 3 0",
        ]),
        "rectangles": table("NPropSetsRec", ["1 2.1e11 8e10 7850 0.5 0.8 0.03"]),
        "generals": table("NXPropSets", ["2 2.1e11 8e10 7850 0.1 0.05 0.06 0.02 0.03 0.05 0.04"]),
        "cables": table("NCablePropSets", ["1 2e8 80 1e5"]),
        "links": table("NRigidPropSets", ["1 12"]),
        "springs": table("NSpringPropSets", [f"1 {k}"]),
        "cosines": table("NCOSMs", ["1 0 1 0 -1 0 0 0 0 1"]),
        "masses": table("NCmass", []),
    }  # fmt: skip
    (tmp_path / "ground.dat").write_text("2e9 Kzz\n3e10 Ktxtx\n3e10 Ktyty\n1e9 Ktztz\n500 Mzz\n")
    content, notes = read(tmp_path, subdyn(5, **changed))
    frame = validated({k: x for k, x in content.items() if k != "rayleigh"}, Frame, "frame")
    m = frame.members
    assert m["M3"].section == "rectangle1" and m["M3"].spin == pytest.approx(math.pi / 6.0)
    assert frame.sections["rectangle1"].content() == frame.sections["rectangle1"].content() | {
        "kind": "rectangle", "width": 0.5, "height": 0.8, "thickness": 0.03
    }  # fmt: skip
    general = frame.sections["general2"]
    assert (general.area, general.shear_area_y, general.inertia_y, general.torsion) == (0.1, 0.06, 0.03, 0.04)
    assert m["M4"].spin == pytest.approx(math.radians(-1.0))
    assert any(n.kind == "warning" and n.what == "MSpin of member 4 is -1" for n in notes)
    assert (m["M7"].kind, m["M7"].axial_stiffness, m["M7"].line_mass, m["M7"].pretension) == ("cable", 2e8, 80.0, 1e5)
    assert (m["M8"].kind, m["M8"].line_mass) == ("rigid", 12.0)
    turned = np.diag([1e8] * 6)
    turned[0, 1] = turned[1, 0] = -5e6  # x of the spring is y, its y is -x
    assert m["M6"].kind == "spring" and m["M6"].stiffness == pytest.approx(turned)
    assert {name: r.kind for name, r in frame.releases.items()} == {"J2": "pin", "J4": "universal", "J5": "ball"}
    assert frame.releases["J2"].axis == pytest.approx([0.0, 1.0, 0.0]) and frame.releases["J2"].stiffness == 7e5
    assert frame.releases["J4"].axis / 2.0 == pytest.approx([1.0, 0.0, 0.0])
    spring, clamped = frame.feet
    assert clamped.stiffness is None and spring.mass[2, 2] == 500.0
    assert np.diag(spring.stiffness).tolist() == [1e13, 1e13, 2e9, 3e10, 3e10, 1e9]
    assert all(member.potential_flow for member in m.values() if member.kind == "beam")  # without HydroDyn
    assert frame.hydrodynamics.drag == 0.0


def test_coefficients_by_depth_diffraction_and_members_elsewhere(tmp_path: Path) -> None:
    rows = ["0 1 1.5 1 1 MCF MCF 0 0 0 0 1 1 1 1", "-20 2 2.5 0.8 0.8 1 1 0 0 0 0 1 1 1 1"]
    text = hydrodyn(5, by_depth=table("NCoefDpthCyl", rows, "Dpth DpthCd"), growth=table("NMGDepths", []))
    text = re.sub(r"^([1-8] .* 2\.5) 1 1 False", r"\1 2 1 False", text, flags=re.MULTILINE)
    text = text.replace("7 3 3 1 0 1.5 3 1 False", "7 3 3 1 0 1.5 3 1 True")  # the third of the ring
    text = text.replace("12 7 5 3 3", "12 1 2 3 3")  # the last lies on the bed instead
    content, notes = read(tmp_path, subdyn(5), text)
    frame = validated({k: x for k, x in content.items() if k != "rayleigh"}, Frame, "frame")
    legs = [frame.hydrodynamics if m is None else frame.other_hydrodynamics[m]
            for m in (frame.members[f"M{i}"].hydrodynamics for i in (1, 5))]  # fmt: skip
    assert [leg.drag for leg in legs] == pytest.approx([2.0, 1.0])  # at the middle, 20 m deep and in the air
    assert {leg.diffraction for leg in legs} == {"maccamy_fuchs"} and legs[0].grown_drag is None
    assert [frame.members[f"M{i}"].potential_flow for i in (10, 11, 12)] == [False, True, True]
    assert frame.members["M12"].hydrodynamics == "dry" and frame.other_hydrodynamics["dry"].drag == 0.0
    assert any(n.what == "member M12" and "at their place" in n.why for n in notes)
    narrow = text.replace("\n3 0.6 0.02", "\n3 0.9 0.02", 1)
    _, notes = read(tmp_path, subdyn(5), narrow)
    assert any(n.what == "member M9: 0.9 m wide in the water" and n.kind == "warning" for n in notes)


@pytest.mark.parametrize(
    ("file", "old", "new", "says"),
    [
        ("SubDyn", "\n9 5 6 3 3", "\n9 5 66 3 3", r"SubDyn.dat:\d+: joint 66 is named here; the table of NJoints"),
        ("SubDyn", "\n9 5 6 3 3", "\n9 5 6 3 7", r"SubDyn.dat:\d+: member 9 names tube7; it is not defined"),
        ("SubDyn", "3 3 1c 0\n10", "3 3 9 0\n10", r"SubDyn.dat:\d+: MType 9: expected 1, 1c, 1r, 2, 3, 4 or 5"),
        ("SubDyn", "0.6 0.02", "0.6 0.4", r"SubDyn.dat:\d+: the wall of 0.4 m is more than half of 0.6 m"),
        ("SubDyn", "\n2 -8.0 8.0", "\n1 -8.0 8.0", r"SubDyn.dat: the table of NJoints has a joint twice"),
        ("SubDyn", "7850 0.6", "steel 0.6", r"SubDyn.dat:\d+: expected a number in column 4, found 'steel'"),
        ("SubDyn", "\n12 1 1 1 1", "\n12 2 1 1 1", r"SubDyn.dat: NInterf: 2 transition pieces: one that holds"),
        ("SubDyn", "\n12 1 1 1 1", "\n12 1 0 1 1", r"SubDyn.dat:\d+: a joint of the interface has to be fixed"),
        ("SubDyn", "4e5 0 0 0 0 0\n", "4e5 0 0 0 0\n", r"SubDyn.dat:\d+: GuyanDampSize: expected six lines of six"),
        ("HydroDyn", "\n9 5 6 3 3", "\n9 5 6 3 8", r"HydroDyn.dat:\d+: member 9 names a joint or property set"),
        ("HydroDyn", "\n9 0.7 0.9", "\n99 0.7 0.9", r"HydroDyn.dat:\d+: member 9 has MCoefMod 3, but no line"),
        ("HydroDyn", "2 9 10 -10.5", "2 9 77 -10.5", r"HydroDyn.dat:\d+: FillNumM: expected 2 members, level"),
        ("HydroDyn", "0 PotMod", "1 PotMod", r"HydroDyn.dat: PotMod 1: members on the bed have Morison's"),
    ],
)  # fmt: skip
def test_bad_tables(file: str, old: str, new: str, says: str, tmp_path: Path) -> None:
    sub, hydro = subdyn(5), hydrodyn(5)
    whole = sub if file == "SubDyn" else hydro
    assert old in whole
    bad = whole.replace(old, new, 1)
    with pytest.raises((InputError, UnsupportedError), match=says) as wrong:
        read(tmp_path, bad if file == "SubDyn" else sub, bad if file == "HydroDyn" else hydro)
    assert "\n" not in str(wrong.value)


@cache
def jacket() -> Turbine:
    return load_turbine("nrel5mw-jacket")


def again(turbine: Turbine, folder: Path) -> Frame:
    main = write_openfast(turbine, folder, options=SIMPLE, duration=10.0).main
    frame: Frame | None = read_deck(main, control_of=turbine).turbine.frame
    assert frame is not None
    return frame


def same(a: Any, b: Any, where: str = "frame") -> None:
    """Contents that are equal to nine digits."""
    if isinstance(a, dict):
        assert a.keys() == b.keys(), where
        for key in a:
            same(a[key], b[key], f"{where}.{key}")
    elif isinstance(a, list | tuple | np.ndarray) and len(a) and not isinstance(a[0], float | int):
        assert len(a) == len(b), where
        for i, (x, y) in enumerate(zip(a, b, strict=True)):
            same(x, y, f"{where}.{i}")
    elif isinstance(a, float | list | tuple | np.ndarray):
        assert b == pytest.approx(a, rel=1e-8, abs=1e-9), where
    else:
        assert a == b, where


def test_a_frame_of_all_kinds_comes_back(tmp_path: Path) -> None:
    tubes = {"diameter": 1.2, "thickness": 0.04}, {"diameter": 0.9, "thickness": 0.03}, {"diameter": 0.3}
    sections: dict[str, Any] = {f"tube{i}": values for i, values in enumerate(tubes, 1)}
    sections["rectangle1"] = {"kind": "rectangle", "width": 0.4, "height": 0.6, "thickness": 0.02, "density": 7000.0}
    area = {"area": 0.05, "shear_area_x": 0.02, "shear_area_y": 0.03, "inertia_x": 4e-3, "inertia_y": 5e-3}
    sections["general1"] = {"kind": "general", "torsion": 6e-3, "diameter": 0.5, "thickness": 0.05} | area
    places = {"J4": (6.0, -10.0), "J7": (4.0, BASE), "J1": (8.0, -30.0)}
    joints = {
        f"J{int(first[1:]) + i}": [r * math.cos(2.1 * i), r * math.sin(2.1 * i), z]
        for first, (r, z) in sorted(places.items())
        for i in range(3)
    }
    middle = 0.5 * (np.array(joints["J1"]) + joints["J5"])
    joints |= {"J10": [1.0, 0.0, 19.0], "J11": joints["J6"], "J12": middle.tolist()}
    members: dict[str, Any] = {}

    def add(a: int, b: int, section: str, **keys: Any) -> None:
        members[f"M{len(members) + 1}"] = {"joints": (f"J{a}", f"J{b}"), "section": section, **keys}

    for i in (1, 2, 3):
        add(i, i + 3, "tube1", flooded=True)
        add(i + 3, i + 6, "tube1", end_section="tube2")
    add(4, 5, "tube3", hydrodynamics="M7")
    add(5, 6, "tube2", filled_to=-10.2, fill_density=1100.0)
    add(6, 4, "rectangle1", spin=0.3, hydrodynamics="M9")
    add(7, 8, "general1", spin=-0.2)
    add(8, 9, "tube2", potential_flow=True, hydrodynamics="dry")
    add(9, 7, "tube2", potential_flow=True, hydrodynamics="dry")
    add(1, 12, "tube2")
    add(12, 5, "tube2")
    add(11, 2, "tube2")
    add(2, 6, "-", kind="cable", axial_stiffness=2e8, line_mass=40.0, pretension=1e4)
    add(7, 10, "-", kind="rigid", line_mass=15.0)
    stiffness = np.diag([1e9, 2e9, 3e9, 1e8, 2e8, 3e8])
    stiffness[0, 4] = stiffness[4, 0] = 1e7
    add(6, 11, "-", kind="spring", stiffness=stiffness)
    ground = {"stiffness": np.diag([1e9, 2e9, 3e9, 4e10, 5e10, 6e10]), "mass": np.diag([1e3] * 3 + [0.0] * 3)}
    other = {"drag": 0.7, "added_mass": 0.8, "pressure": 0.9, "grown_drag": 1.1}
    frame = Frame.model_validate({
        "depth": 30.0, "joints": joints, "sections": sections, "members": members,
        "feet": [{"joint": "J1"}, {"joint": "J2"}, {"joint": "J3", **ground}], "interface": ("J7", "J8", "J9"),
        "masses": [{"joint": "J10", "mass": 2e4, "inertia": [1e3, 2e3, 3e3, 10.0, 20.0, 30.0]},
                   {"joint": "J7", "mass": 5e4, "centre": [-1.0, 0.5, 2.0]}],
        "releases": {"J12": {"kind": "pin", "axis": [0.6, 0.8, 0.0], "stiffness": 1e5}}, "divisions": 3,
        "damping": 0.008, "hydrodynamics": {"drag": 0.9, "added_mass": 0.95},
        "other_hydrodynamics": {"M7": other, "M9": other | {"drag": 2.0}, "dry": dict.fromkeys(("drag", "added_mass",
                                                                                              "pressure"), 0.0)},
        "ends": {"pressure": 1.0}, "other_ends": {"J4": {"drag": 4.0, "added_mass": 0.5, "pressure": 1.0}},
        "growth": [{"bottom": -25.0, "top": -8.0, "thickness": 0.05, "density": 1200.0},
                   {"bottom": -8.0, "top": -1.0, "thickness": 0.1, "density": 1300.0}],
        "piece": 1.25, "water_density": 1020.0,
    })  # fmt: skip
    turbine = jacket().replace(frame=frame)
    found = again(turbine, tmp_path).content()
    assert found["damping"] == pytest.approx(0.008, rel=0.005)  # of its mode shapes by polynomials
    edges = [edge for layer in found["growth"] for edge in (layer["bottom"], layer["top"])]
    assert edges == pytest.approx([-24.999, -8.001, -7.999, -1.001], abs=1e-6)  # steps of the table
    left_out = dict.fromkeys(("damping", "growth", "source"))
    same(frame.content() | left_out, found | left_out)


def test_a_matrix_of_the_interface_comes_back(tmp_path: Path) -> None:
    damping = np.diag([1e5, 2e5, 3e5, 4e6, 5e6, 6e6])
    damping[0, 4] = damping[4, 0] = -1e5
    frame = jacket().frame
    assert frame is not None
    frame = frame.replace(interface_damping=damping)
    written = write_openfast(jacket().replace(frame=frame), tmp_path, options=SIMPLE, duration=10.0)
    assert any(note.what == "frame.damping" for note in written.notes)
    found = read_deck(written.main, control_of=jacket()).turbine.frame
    assert found is not None and found.interface_damping == pytest.approx(damping)
    assert found.damping == pytest.approx(frame.damping, rel=0.005)  # by that of the internal modes
    for old, new in zip(frame.members.values(), found.members.values(), strict=True):
        same(frame.sections[old.section].content(), found.sections[new.section].content())
        same([frame.joints[j] for j in old.joints], [found.joints[j] for j in new.joints])


def test_hydrostatics_of_ends_in_the_surface_and_of_rectangles(tmp_path: Path) -> None:
    """OpenFAST 5.0 stops where the surface cuts a tube's end and ``MHstLMod`` is 1, and at rectangles with it."""
    frame = load_turbine("nrel5mw-tripod").frame
    assert frame is not None
    box = frame.sections["ring"].replace(kind="rectangle", diameter=None, width=1.0, height=1.2)

    def integrated(level: float) -> set[str]:
        (tmp_path / "HydroDyn.dat").write_text(water("", frame.replace(sections=sections), level, lambda a, b: None))
        rows = hydro_members(read_input(tmp_path / "HydroDyn.dat", "HydroDyn"), Notes())
        return {name for name, row in zip(frame.members, rows, strict=True) if row.hydrostatics == 2}

    sections = dict(frame.sections)
    at_column = {f"upper{x}_column4" for x in "ABC"} | {"column3_column4", "column4_top"}
    assert integrated(0.0) == at_column
    assert integrated(3.5) == set()
    sections["ring"] = box
    assert integrated(3.5) == {"ringA_ringB", "ringB_ringC", "ringC_ringA"}


def test_what_a_frame_refuses_has_the_line_of_the_deck(tmp_path: Path) -> None:
    main = write_openfast(jacket(), tmp_path, options=SIMPLE, duration=10.0).main
    sub = tmp_path / "SubDyn.dat"
    lines = sub.read_text().splitlines()
    k = next(i for i, line in enumerate(lines) if "JointXss" in line) + 5
    name, _, *rest = lines[k].split()
    lines[k] = " ".join([name, "6000.0", *rest])
    sub.write_text("\n".join(lines))
    with pytest.raises(InputError, match=rf"frame.joints.J{name}: .*is it in mm\? \(SubDyn.dat:{k + 1}\)$"):
        read_deck(main, control_of=jacket())


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"feet": [{"joint": "footA", "soil": {"layers": [{"kind": "sand", "top": 0.0, "friction_angle": 0.6,
          "weight": 9e3}]}, "pile_length": 30.0, "pile_section": "pile"}]}, "frame.feet: soil at joint footA: SubDyn"),
        ({"hydrodynamics": {"diffraction": "maccamy_fuchs"}}, "diffraction by cylinders of one diameter, without"),
    ],
)  # fmt: skip
def test_frames_that_openfast_lacks(change: dict[str, Any], says: str, tmp_path: Path) -> None:
    frame = jacket().frame
    assert frame is not None
    turbine = jacket().replace(frame=frame.replace(**change))
    sea = sea_of({"kind": "regular", "height": 2.0, "period": 8.0}, "sea")
    with pytest.raises(UnsupportedError, match=says):
        write_openfast(turbine, tmp_path, options=SIMPLE, duration=10.0, sea=sea)
    assert not list(tmp_path.iterdir())


def superelement(kind: str, modes: int) -> tuple[dict[str, np.ndarray[Any, Any]], str]:
    """Matrices of a superelement, and their file in one of three formats."""
    n = 6 + modes
    rng = np.random.default_rng(3)
    matrices = {}
    for name, scale in (("mass", 1e5), ("damping", 1e4), ("stiffness", 1e9)):
        half = rng.normal(size=(n, n))
        matrices[name] = scale * (half @ half.T + n * np.eye(n))
        matrices[name][6:, :6] = matrices[name][:6, 6:] = 0.0 if name != "mass" else 1.0
    matrices["mass"][6:, 6:], matrices["stiffness"][6:, 6:] = np.eye(modes), np.diag((40.0 + np.arange(modes)) ** 2)
    text = {"guyan": "a title\n", "flex": f"!Comment\n!Dimension: {n}\n", "five": f"!Dimension: {n}\n"}[kind]
    mark, between = {"guyan": ("#", ""), "flex": ("!", f"!Dimension: {n}\n"), "five": ("!", "")}[kind]
    for name, matrix in matrices.items():
        matrix = matrix.copy()
        matrix[0, 1] += 1e-6 * matrix[0, 0]  # noise of its program
        rows = "\n".join(" ".join(f"{x:.10e}" for x in row) for row in matrix)
        text += f"{mark}{name.capitalize()} Matrix\n{between}{rows}\n\n"
    if kind == "guyan":
        text += "#Loading\ntime Fx\n(s) (N)\n0.0 " + "0 " * n + "\n1.0 " + "5 " * n + "\n"
    return matrices, text


@pytest.mark.parametrize(("kind", "modes"), [("guyan", 0), ("flex", 2), ("five", 3)])
def test_a_superelement_is_a_foundation(kind: str, modes: int, tmp_path: Path) -> None:
    main = write_openfast(load_turbine("nrel5mw"), tmp_path, options=SIMPLE, duration=10.0).main
    matrices, text = superelement(kind, modes)
    (tmp_path / "matrices.dat").write_text(text)
    (tmp_path / "ExtPtfm.dat").write_text("title\na title\n0 FileFormat\n'matrices.dat' Red_FileName\nEND\n")
    main.write_text(re.sub(r'0( +CompSub.*)((.|\n)*)"unused"( +SubFile)', r'2\1\2"ExtPtfm.dat"\4', main.read_text()))
    elastodyn = tmp_path / "ElastoDyn.dat"
    for name, value in (("PtfmMass", 2e5), ("PtfmCMzt", -3.0), ("PtfmPIner", 1e6), ("PtfmRefzt", -1.0)):
        elastodyn.write_text(re.sub(rf"\S+( +{name} )", rf"{value}\1", elastodyn.read_text()))
    deck = read_deck(main, control_of=load_turbine("nrel5mw"))
    foundation = deck.turbine.foundation
    assert foundation is not None and not foundation.motions
    # the reference point is 1 m below the tower's base
    arm = np.eye(6)
    arm[0, 4], arm[1, 3] = -1.0, 1.0
    for name in ("stiffness", "damping"):
        expected = arm.T @ matrices[name][:6, :6] @ arm
        assert getattr(foundation, name) == pytest.approx(expected, abs=1e-5 * np.abs(expected).max())
    piece = np.diag([2e5, 2e5, 2e5, 9 * 2e5, 9 * 2e5 + 1e6, 0.0])
    piece[0, 4] = piece[4, 0] = -3 * 2e5
    piece[1, 3] = piece[3, 1] = 3 * 2e5
    assert foundation.mass == pytest.approx(arm.T @ matrices["mass"][:6, :6] @ arm + piece, abs=30.0)
    left = [n.why for n in deck.notes if n.what == f"{modes} internal modes"]
    assert bool(left) == bool(modes) and all(f"{40.0 / math.tau:.3g} Hz" in why for why in left)
    assert any(n.what == "loads of the superelement" for n in deck.notes) == (kind == "guyan")
    lines = text.splitlines()
    k = next(i for i, line in enumerate(lines) if "Stiffness" in line) + 1 + (kind == "flex")
    first, _, *rest = lines[k].split()
    skewed = [*lines[:k], " ".join([first, "9e9", *rest]), *lines[k + 1 :]]
    (tmp_path / "matrices.dat").write_text("\n".join(skewed))
    with pytest.raises(InputError, match=rf"matrices.dat:{k + 1}: the stiffness matrix is not symmetric"):
        read_deck(main, control_of=load_turbine("nrel5mw"))
    (tmp_path / "matrices.dat").write_text(text.replace("e+09 ", "e+09 x", 1))
    with pytest.raises(
        InputError, match=r"matrices.dat:\d+: expected a stiffness matrix of 6 rows and columns or more"
    ):
        read_deck(main, control_of=load_turbine("nrel5mw"))


@pytest.fixture(scope="module")
def decks(reference: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Working copies of the reference decks, parked ones with the aerodynamics of a turning one."""
    source = reference / "openfast_members/decks"
    if not source.is_dir():
        pytest.skip(f"needs the OpenFAST decks in {source}")
    folder = tmp_path_factory.mktemp("members")
    for path in source.rglob("*"):
        if path.is_file():
            target = folder / path.relative_to(source)
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(path.read_bytes())
    for name in ("J2_decay_dry", "T3_H6T10", "S1_decay"):
        for file in ("AeroDyn.dat", "InflowWind.dat"):
            (folder / name / file).write_bytes((source / "J6_20" / file).read_bytes())
        main = folder / name / "run.fst"
        main.write_text(re.sub(r"^0( +CompAero)", r"2\1", main.read_text(), flags=re.MULTILINE))
    return folder


@pytest.mark.reference
@pytest.mark.long
def test_the_reference_decks(decks: Path, tmp_path: Path) -> None:
    """Masses by SubDyn's summaries (shared/reference/openfast_members), without transition piece and water."""
    control = load_turbine("nrel5mw")
    for name, joints, members, mass in (("J6_20", 64, 112, 673882.7), ("T3_H6T10", 158, 163, 858127.4)):
        turbine = read_deck(decks / name / "run.fst", control_of=control).turbine
        frame = turbine.frame
        assert frame is not None and (len(frame.joints), len(frame.members)) == (joints, members)
        dry = {n: m.replace(flooded=False, filled_to=None) for n, m in frame.members.items()}
        bare = frame.replace(masses=(), growth=(), members=dry)
        assert rigid_body(bare)["mass"] == pytest.approx(mass, abs=0.06)
        found = again(turbine, tmp_path / name)
        left_out = dict.fromkeys(("damping", "source"))
        same(frame.content() | left_out, found.content() | left_out)
    dry_deck = read_deck(decks / "J2_decay_dry/run.fst", control_of=control).turbine.frame
    assert dry_deck is not None and all(m.potential_flow for m in dry_deck.members.values())


@pytest.mark.reference
@pytest.mark.long
def test_a_floating_frame_has_its_platform(decks: Path) -> None:
    """Mass with ballast 3 710 433 kg + 95.19 MN / g, volume 13 919 m^3 (README of the reference)."""
    turbine = read_deck(decks / "S1_decay/run.fst", control_of=load_turbine("nrel5mw")).turbine
    frame, platform = turbine.frame, turbine.platform
    assert frame is not None and platform is not None
    assert (len(frame.joints), len(frame.members), frame.feet, frame.interface) == (56, 67, (), ("J5",))
    assert platform.mass == pytest.approx(3710433 + 95.19e6 / 9.80665, rel=1e-3)
    assert platform.volume == pytest.approx(13919.0, rel=1e-3)
    assert len(platform.lines) == 3 and {m.kind for m in frame.members.values()} == {"beam", "rigid"}
    with pytest.raises(UnsupportedError, match="a floating frame is not written"):
        write_openfast(turbine, decks / "out", options=SIMPLE)


@pytest.mark.reference
@pytest.mark.slow
@pytest.mark.parametrize("module", ["SubDyn", "HydroDyn", "SeaState"])
def test_keywords_are_in_the_order_of_openfast(module: str, decks: Path, tmp_path: Path) -> None:
    write_openfast(jacket(), tmp_path, options=SIMPLE, duration=10.0)
    orders = [
        [name for name, _ in sorted(((k, e[0].line) for k, e in file.entries.items()), key=lambda pair: pair[1])]
        for file in (read_input(folder / f"{module}.dat", module) for folder in (tmp_path, decks / "J6_20"))
    ]
    both = set(orders[0]) & set(orders[1])
    assert [k for k in orders[0] if k in both] == [k for k in orders[1] if k in both]
    assert len(both) >= 0.95 * len(orders[0])
