"""SeaState, HydroDyn and mooring files of OpenFAST decks."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from meltemi import InputError, UnsupportedError
from meltemi.core.yamlfile import validated
from meltemi.exchange.openfast.members import displaced
from meltemi.exchange.openfast.mooring import read_mooring
from meltemi.exchange.openfast.text import read_input
from meltemi.exchange.openfast.values import Values
from meltemi.exchange.openfast.water import DeckWater
from meltemi.exchange.report import Notes
from meltemi.floating.moorings import MooringLine
from meltemi.sea.kinds import sea_of

MOORDYN_2 = """--- MoorDyn ---
a title
--- LINE TYPES ---
Name  Diam  MassDen  EA  BA/-zeta  EI  Cd  Ca  CdAx  CaAx
(-) (m) (kg/m) (N) (-) (-) (-) (-) (-) (-)
main  0.09  77.0  3.84E+08  -1.0  0  1.6  1.0  0.1  0.05
--- POINTS ---
ID  Attachment  X  Y  Z  M  V  CdA  CA
(-) (-) (m) (m) (m) (kg) (m^3) (m^2) (-)
1  Vessel  5.2  0.0  -70.0  0 0 0 0
2  Fixed  853.87  0.0  -320.0  0 0 0 0
--- LINES ---
ID  LineType  AttachA  AttachB  UnstrLen  NumSegs  Outputs
(-) (-) (-) (-) (m) (-) (-)
1  main  2  1  902.2  20  -
--- SOLVER OPTIONS ---
"""
MOORDYN_1 = """--- MoorDyn ---
a title
--- LINE TYPES ---
1  NTypes - number of line types
LineType  Diam  MassDenInAir  EA  BA/-zeta  Can  Cat  Cdn  Cdt
(-) (m) (kg/m) (N) (-) (-) (-) (-) (-)
main  0.09  77.0  3.84E+08  -1.0  1.0  0.05  1.6  0.1
--- CONNECTION PROPERTIES ---
2  NConnects - number
Node  Type  X  Y  Z  M  V  FX  FY  FZ  CdA  Ca
(-) (-) (m) (m) (m) (kg) (m^3) (kN) (kN) (kN) (m2) (-)
1  fixed  853.87  0.0  -320.0  0 0 0 0 0 0 0
2  Vessel  5.2  0.0  -70.0  0 0 0 0 0 0 0
--- LINE PROPERTIES ---
Line  LineType  UnstrLen  NumSegs  NodeAnch  NodeFair  Flags/Outputs
(-) (-) (m) (-) (-) (-) (-)
1  main  902.2  20  1  2  p
--- SOLVER OPTIONS ---
"""
MAP = """--- LINE DICTIONARY ---
LineType  Diam  MassDenInAir  EA  CB  CIntDamp  Ca  Cdn  Cdt
(-) (m) (kg/m) (N) (-) (Pa-s) (-) (-) (-)
main  0.09  77.0  3.84E8  0.5  1.0E8  1.0  1.6  0.1
--- NODE PROPERTIES ---
Node  Type  X  Y  Z  M  V  FX  FY  FZ
(-) (-) (m) (m) (m) (kg) (m^3) (N) (N) (N)
1  fix  853.87  0.0  depth  0 0 # # #
2  Vessel  5.2  0.0  -70.0  0 0 # # #
--- LINE PROPERTIES ---
Line  LineType  UnstrLen  NodeAnch  NodeFair  Flags
(-) (-) (m) (-) (-) (-)
1  main  902.2  1  2  tension_fair
--- SOLVER OPTIONS ---
repeat 120 240
"""
SEA = """title
8.0 WtrDens
30.0 WtrDpth
DEFAULT MSL2SWL
1P90 WaveMod
3 WaveStMod
600.0 WaveTMax
4.0 WaveHs
9.0 WaveTp
DEFAULT WavePkShp
0.1 WvLowCOff
3.0 WvHiCOff
30.0 WaveDir
0 WaveDirMod
-7 WaveSeed(1)
True WaveNDAmp
2 ConstWaveMod
7.0 CrestHmax
60.0 CrestTime
1 CurrMod
0.5 CurrSSV0
DEFAULT CurrSSDir
20 CurrNSRef
0.3 CurrNSV0
-10.0 CurrNSDir
0.0 CurrDIV
0 CurrDIDir
"""


def lines_of(folder: Path, text: str) -> list[MooringLine]:
    path = folder / "mooring.dat"
    path.write_text(text)
    lines = read_mooring(read_input(path, "mooring"), 320.0, Notes(), of_map="repeat" in text)["lines"]
    return [validated(line, MooringLine, "line") for line in lines]


def water_of(folder: Path, text: str, *, old: bool) -> DeckWater:
    """Water of a deck with SeaState, or with the waves in HydroDyn."""
    (folder / "sea.dat").write_text(text)
    (folder / "hydro.dat").write_text(text if old else "title\n0 PotMod\n")
    main = f"title\n{int(not old)} CompSeaSt\n1 CompHydro\n'sea.dat' SeaStFile\n'hydro.dat' HydroFile\n0.4 MSL2SWL\n"
    (folder / "main.fst").write_text(main)
    file = read_input(folder / "main.fst", "main")
    values = Values(Notes())
    values.data = {"comp_hydro": 1, "comp_sea": int(not old), "level": 0.4}
    values.data |= {"hydro_file": "hydro.dat", "sea_file": "sea.dat"}
    return DeckWater(file, values, Notes())


def test_one_line_in_three_formats(tmp_path: Path) -> None:
    # the library of MoorDyn 1, whose files MoorPy writes, counts no rows
    library = re.sub(r"(?m)^\d +N(Types|Connects|Lines).*\n", "", MOORDYN_1)
    assert "NTypes" not in library
    second, first, map_lines, bare = (lines_of(tmp_path, text) for text in (MOORDYN_2, MOORDYN_1, MAP, library))
    assert first == second == bare
    (line,) = second
    assert (line.mass, line.drag, line.axial_drag, line.added_mass, line.axial_added_mass) == (77, 1.6, 0.1, 1, 0.05)
    assert line.anchor == pytest.approx([853.87, 0.0, -320.0]) and line.fairlead == pytest.approx([5.2, 0.0, -70.0])
    assert len(map_lines) == 3 and map_lines[0].friction == 0.5
    assert map_lines[0].anchor == pytest.approx(line.anchor)
    assert map_lines[1].anchor == pytest.approx([-426.935, 739.473, -320.0], abs=1e-3)


@pytest.mark.parametrize(
    ("old", "new", "kind", "says"),
    [
        ("1  Vessel", "1  Turbine", UnsupportedError, "point 1 is of kind 'Turbine'"),
        ("1  Vessel", "1  Fixed", UnsupportedError, "both of kind 'Fixed'"),
        ("1  main  2", "1  other  2", InputError, "names a type or point"),
        ("902.2", "long", InputError, "expected a number, found 'long'"),
        ("--- LINE TYPES", "--- TYPES", InputError, "no section of types: .* LINE DICTIONARY or LINE TYPES"),
        ("0 0 0 0\n2  Fixed", "0 0 0\n2  Fixed", InputError, "mooring.dat:10: the table of points has 9 columns"),
        ("1  Vessel", "1  Body1", UnsupportedError, "point 1 is of kind 'Body1'"),
        (
            "--- SOLVER",
            "--- RODS\nID\n(-)\n1 a Fixed 0 0 0 0 0 1 0 -\n--- SOLVER",
            UnsupportedError,
            "mooring.dat:19: rods of MoorDyn",
        ),
    ],
)
def test_other_lines_are_refused(tmp_path: Path, old: str, new: str, kind: type[Exception], says: str) -> None:
    with pytest.raises(kind, match=says):
        lines_of(tmp_path, MOORDYN_2.replace(old, new))


def read(folder: Path, text: str) -> tuple[Any, Notes]:
    path, notes = folder / "mooring.dat", Notes()
    path.write_text(text)
    return read_mooring(read_input(path, "mooring"), 320.0, notes), notes


CLUMP = "3  Free  40.0  0.0  -85.0  50000 4.0 2.0 0.5\n"
CLUMPED = MOORDYN_2.replace("--- LINES", CLUMP + "--- LINES").replace(
    "1  main  2  1  902.2", "1  main  3  1  40.0 20 -\n2  main  2  3  862.2"
)


@pytest.mark.parametrize(
    ("old", "new", "warns"),
    [
        ("MassDen", "Mass/m", ""),
        ("MassDen", "MassDenInAir", ""),
        (" M  V ", " Mass  Volume ", ""),
        ("Name  Diam", "TypeName  Diam", ""),
        (" M  V ", " V  M ", "column 6 is headed V"),
        ("Diam", "Width", "column 2 is headed Width"),
    ],
)
def test_columns_of_moordyn_are_known_by_their_place(tmp_path: Path, old: str, new: str, warns: str) -> None:
    """MoorDyn.f90 reads the line without a look at its header; a clump of 50 t stays one."""
    assert old in CLUMPED
    found, notes = read(tmp_path, CLUMPED.replace(old, new))
    assert found["lines"][0]["mass"] == 77.0 and found["lines"][0]["diameter"] == 0.09
    assert found["points"]["point3"] == {"mass": 50e3, "volume": 4.0, "drag_area": 2.0, "added_mass": 0.5}
    assert [note.what for note in notes if note.kind == "warning"][:1] == ([warns] if warns else [])


BODIES = "--- BODIES\nID Attachment X0 Y0 Z0 r0 p0 y0 Mass CG I Volume CdA Ca\n(-)\n1 {} 9.0 0 0 0 0 0\n--- POINTS"


@pytest.mark.parametrize(
    ("angles", "point", "end"),
    [
        ("0 0 0", "5.2 0.0 -70.0", [5.4, 0.0, -71.0]),
        # right-handed: roll turns y upwards, pitch turns x downwards, yaw turns x to y
        ("90 0 0", "0 3 0", [0.2, 0.0, 2.0]),
        ("0 90 0", "3 0 0", [0.2, 0.0, -4.0]),
        ("0 0 90", "3 0 0", [0.2, 3.0, -1.0]),
        # Rx Ry Rz: yaw turns x to y, which roll turns upwards; the other order would leave it along y
        ("90 0 90", "3 0 0", [0.2, 0.0, 2.0]),
        # yaw turns y to -x, which pitch turns upwards
        ("0 90 90", "0 3 0", [0.2, 0.0, 2.0]),
        # pitch turns z to x, which roll leaves
        ("90 90 0", "0 0 3", [3.2, 0.0, -1.0]),
    ],
)
@pytest.mark.parametrize("name", ["Body1", "B1"])
def test_a_body_of_the_platform_places_its_points(
    tmp_path: Path, name: str, angles: str, point: str, end: list[float]
) -> None:
    text = MOORDYN_2.replace("--- POINTS", BODIES.format(f"Coupled 0.2 0.0 -1.0 {angles}"))
    found, notes = read(tmp_path, text.replace("1  Vessel  5.2  0.0  -70.0", f"1  {name}  {point}"))
    assert found["lines"][0]["fairlead"] == pytest.approx(end, abs=1e-12)
    assert [note.what for note in notes] == ["body 1", *(["body 1: r0, p0, y0"] if angles != "0 0 0" else [])]


def test_a_fixed_body_places_its_anchors(tmp_path: Path) -> None:
    """The run of OpenFAST does not move it: no warning of its angles."""
    text = MOORDYN_2.replace("--- POINTS", BODIES.format("Fixed 800 0.0 -320.0 0 0 -90"))
    found, notes = read(tmp_path, text.replace("2  Fixed  853.87  0.0  -320.0", "2  Body1  0.0  53.87  0.0"))
    assert found["lines"][0]["anchor"] == pytest.approx([853.87, 0.0, -320.0])
    assert [note.kind for note in notes] == ["ignored"]


@pytest.mark.parametrize("z", ["seabed", "Ground", "-320.0"])
def test_attachments_and_heights_by_their_other_names(tmp_path: Path, z: str) -> None:
    text = CLUMPED.replace("-320.0", z).replace("  3  1  40.0", "  P3  Point1  40.0").replace("Vessel", "Cpld")
    found, _ = read(tmp_path, text.replace("3.84E+08", "3.84d8|5e8|1 ", 1))
    assert found["lines"][1]["anchor"] == [853.87, 0.0, -320.0]
    assert found["lines"][0]["stiffness"] == 3.84e8


BRIDLES = {
    "MoorDyn 2": (
        MOORDYN_2,
        "1  main  2  1  902.2  20  -",
        "3  Vessel  5.2  2.0  -70.0  0 0 0 0\n4  Free  40.0  0.0  -85.0  500 0.1 2.0 0.5\n",
        "1  main  1  4  40  20  -\n2  main  3  4  40  20  -\n3  main  2  4  860  20  -",
    ),
    "MoorDyn 1": (
        MOORDYN_1,
        "1  main  902.2  20  1  2  p",
        "3  Vessel  5.2  2.0  -70.0  0 0 0 0 0 0 0\n4  Connect  40.0  0.0  -85.0  500 0.1 0 0 0 2.0 0.5\n",
        "1  main  40  20  4  2  p\n2  main  40  20  4  3  p\n3  main  860  20  1  4  p",
    ),
    "MAP++": (
        MAP,
        "1  main  902.2  1  2  tension_fair",
        "3  Vessel  5.2  2.0  -70.0  0 0 # # #\n4  Connect  #40.0  #0.0  #-85.0  500 0.1 0 0 0\n",
        "1  main  40  4  2\n2  main  40  4  3\n3  main  860  1  4",
    ),
}


@pytest.mark.parametrize("kind", BRIDLES)
def test_a_bridle_in_three_formats(tmp_path: Path, kind: str) -> None:
    """Two lines from the platform meet a third one, whatever the order of their ends in the file."""
    text, line, points, lines = BRIDLES[kind]
    at = text.index("---", text.index("Vessel"))
    path = tmp_path / "mooring.dat"
    path.write_text((text[:at] + points + text[at:]).replace(line, lines))
    found = read_mooring(read_input(path, "mooring"), 320.0, Notes(), of_map=kind == "MAP++")
    first, second, third = found["lines"][:3]
    assert (first["anchor"], second["anchor"], third["fairlead"]) == ("point4",) * 3
    assert first["fairlead"][2] == second["fairlead"][2] == -70.0 and third["anchor"][2] == -320.0
    assert {first["fairlead"][1], second["fairlead"][1]} == {0.0, 2.0}
    assert found.get("segments") == (None if kind == "MAP++" else 20)
    assert (found["points"]["point4"]["mass"], found["points"]["point4"]["volume"]) == (500.0, 0.1)
    if kind == "MAP++":
        assert len(found["lines"]) == 9 and found["lines"][3]["anchor"] == "point4_120"
        assert set(found["points"]) == {"point4", "point4_120", "point4_240"}
    else:
        assert (found["points"]["point4"]["drag_area"], found["points"]["point4"]["added_mass"]) == (2.0, 0.5)
    path.write_text(path.read_text().replace("500 0.1 0 0 0", "500 0.1 0 0 9"))
    if kind != "MoorDyn 2":
        with pytest.raises(UnsupportedError, match="point 4 has forces"):
            read_mooring(read_input(path, "mooring"), 320.0, Notes(), of_map=kind == "MAP++")


@pytest.mark.parametrize("old", [False, True], ids=["SeaState", "HydroDyn before 4"])
def test_a_regular_sea_with_current(tmp_path: Path, old: bool) -> None:
    water = water_of(tmp_path, SEA, old=old)
    sea = sea_of(water.sea(), "deck").model_dump()
    assert (sea["kind"], sea["height"], sea["period"], sea["stretching"], sea["level"]) == (
        "regular",
        4,
        9,
        "wheeler",
        0.4,
    )
    assert (sea["direction"], sea["phase"]) == pytest.approx((-np.radians(30.0), np.radians(90.0)))
    current = sea["current"]
    assert (current["sub_surface"], current["near_surface"], current["uniform"]) == (0.5, 0.3, 0.0)
    assert current["direction"] == pytest.approx(-np.radians(30.0))  # with the waves, by default
    assert any("CurrMod" in note.what and note.kind == "approximated" for note in water.notes)


def test_an_irregular_sea(tmp_path: Path) -> None:
    water = water_of(tmp_path, SEA.replace("1P90", "2").replace("DEFAULT WavePkShp", "3.3 WavePkShp"), old=False)
    sea = sea_of(water.sea(), "deck").model_dump()
    assert (sea["kind"], sea["peak_factor"], sea["seed"], sea["repeat"]) == ("irregular", 3.3, 7, 600.0)
    assert sea["frequencies"] == (0.1, 3.0) and sea["amplitudes"] == "gaussian"
    assert (sea["crest"]["height"], sea["crest"]["of"]) == (7.0, "crest to trough")
    white = water_of(tmp_path, SEA.replace("1P90", "3"), old=False).sea()
    assert sea_of(white, "deck").model_dump()["spectrum"] == "white"


def test_files_of_waves_are_noted(tmp_path: Path) -> None:
    water = water_of(tmp_path, SEA.replace("1P90", "5"), old=False)
    assert water.sea()["kind"] == "still"
    assert any("WaveMod" in note.what and note.kind == "ignored" for note in water.notes)


def test_without_potential_flow_members_have_the_buoyancy() -> None:
    """A column of 2 m, 10 m deep, at x = 3 m: pi m^2 times 10 m."""
    volume, centre = displaced([{"start": [3.0, 0.0, -10.0], "end": [3.0, 0.0, 5.0], "diameter": 2.0}])
    assert volume == pytest.approx(10.0 * np.pi)
    assert centre == pytest.approx((3.0, 0.0))
