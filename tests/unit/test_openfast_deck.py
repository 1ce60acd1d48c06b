"""OpenFAST decks in: what is read, what is said about it, and what happens to broken ones."""

from __future__ import annotations

import math
import random
import re
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import meltemi
from meltemi import InputError, ModelOptions, UnsupportedError
from meltemi.control.baseline import parameters, steady_torque
from meltemi.core.errors import MeltemiError
from meltemi.exchange.openfast.keywords import ROWS, UNITS, row_of
from meltemi.exchange.openfast.members import member_rows
from meltemi.exchange.openfast.text import flag, key, number, read_input, split
from meltemi.exchange.report import Notes
from meltemi.simulation.options import AdvancedOptions
from meltemi.simulation.rotors import operating_point
from meltemi.verification.openfast_deck import deck_options, deck_turbine

Deck = Callable[..., Path]
OPENFAST = AdvancedOptions(
    chord_angle="openfast", stall_fit="openfast", stall_rotation="openfast", reversed_flow="static"
)


@pytest.fixture(scope="module")
def master(openfast_deck: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The reference deck with its controller settings and BeamDyn files beside it."""
    folder = tmp_path_factory.mktemp("deck") / "deck"
    shutil.copytree(openfast_deck, folder)
    main = folder / "5MW.fst"
    main.write_text(main.read_text().replace("NRELOffshrBsline5MW_BeamDyn.dat", "BeamDyn.dat"))
    beamdyn = folder / "BeamDyn.dat"
    beamdyn.write_text(re.sub(r'"[^"]*BeamDyn_Blade.dat"', '"BeamDyn_Blade.dat"', beamdyn.read_text()))
    return folder


@pytest.fixture
def deck(master: Path, tmp_path: Path) -> Deck:
    """A copy with replacements in its files: ``deck("ElastoDyn.dat", (old, new), ...)`` gives the main file."""

    def make(name: str = "", *changes: tuple[str, str]) -> Path:
        folder = tmp_path / "copy"
        shutil.copytree(master, folder, dirs_exist_ok=True)
        if name:
            text = (folder / name).read_text()
            for old, new in ((" ".join(old.split()), new) for old, new in changes):
                assert old in text, old
                text = text.replace(old, new, 1)
            (folder / name).write_text(text)
        return folder / "5MW.fst"

    return make


def test_the_deck_has_the_values_of_the_original(openfast_deck: Path, reference: Path) -> None:
    deck, found = reference / "decks/nrel5mw-land", set()
    for path in (*deck.rglob("*"), reference / "openfast_rosco/DISCON.IN"):
        ours = openfast_deck / (path.relative_to(deck) if deck in path.parents else path.name)
        if ours.is_file():
            found.add(ours)
            one, other = ([(e.name, e.values) for several in read_input(p, "any").entries.values() for e in several]
                          for p in (path, ours))  # fmt: skip
            assert one == other, path
    assert found == {path for path in openfast_deck.rglob("*") if path.is_file()}


def test_the_reference_deck_is_the_library_turbine(master: Path, turbine: meltemi.Turbine) -> None:
    read = meltemi.io.read_openfast(master / "5MW.fst")
    ours = deck_turbine(turbine)
    for name in ("hub", "nacelle"):
        for field, value in getattr(read, name).content().items():
            if field != "source":
                assert value == pytest.approx(getattr(ours, name).content()[field], rel=1e-6), field
    for name in ("gear_ratio", "generator_inertia", "stiffness", "damping", "generator_efficiency", "brake_torque"):
        assert getattr(read.drivetrain, name) == pytest.approx(getattr(ours.drivetrain, name), rel=1e-6)
    for name in ("position", "mass", "fore_aft_stiffness", "side_side_stiffness"):
        np.testing.assert_allclose(getattr(read.tower, name), getattr(ours.tower, name), rtol=1e-6)
    np.testing.assert_allclose(read.tower.diameter, ours.tower.diameter, rtol=1e-4)
    structure = read.blade.structure
    for name in ("twist", "flap_stiffness", "edge_stiffness", "torsion_stiffness"):
        np.testing.assert_allclose(getattr(structure, name), getattr(ours.blade.structure, name), rtol=1e-6, atol=1e-9)
    assert structure.mass is not None
    np.testing.assert_allclose(structure.mass[0], 678.935 * 1.04536, rtol=1e-9)
    assert structure.mode_shapes == ours.blade.structure.mode_shapes
    assert read.tower.mode_shapes == ours.tower.mode_shapes
    for name in ("chord", "twist", "centre_x", "centre_y"):
        np.testing.assert_allclose(
            getattr(read.blade.aerodynamics, name), getattr(ours.blade.aerodynamics, name), rtol=1e-6, atol=1e-9
        )
    for mine, other in zip(read.airfoils.values(), ours.airfoils.values(), strict=True):
        np.testing.assert_allclose(mine.lift, other.lift)
        assert mine.zero_lift_angle == pytest.approx(other.zero_lift_angle)
        assert mine.dynamic_stall is other.dynamic_stall
    assert read.hub_height == pytest.approx(90.0, abs=1e-3)
    assert read.rated_power == 5e6


def test_options_are_those_of_the_comparison(master: Path, turbine: meltemi.Turbine) -> None:
    deck = meltemi.io.read_deck(master / "5MW.fst")
    options, ours = ModelOptions(**deck.options), deck_options(deck_turbine(turbine), "A")
    # the reference runs were made with the yaw drive locked and no drag on the tower; the tip node is 0.1 mm off
    changes = {"locked": ["yaw"], "tower_drag": False, "integration": "explicit", "blade_nodes": list(ours.blade_nodes)}  # type: ignore[arg-type]
    assert (options.flap_modes, options.edge_modes) == (2, 1)
    assert options.replace(flap_modes=None, edge_modes=None, **changes) == ours
    assert deck.environment == {"air_density": 1.225, "gravity": 9.80665}
    assert deck.start["rotor_speed"] == pytest.approx(12.1 * math.pi / 30.0)
    assert deck.wind == {"kind": "steady", "speed": 12.0, "shear_exponent": 0.0}
    assert deck.library["library"] == "libdiscon.so"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "old", "new", "option", "value"),
    [
        ("ElastoDyn.dat", "True          FlapDOF2", "False  FlapDOF2", "flap_modes", 1),
        ("ElastoDyn.dat", "True          EdgeDOF", "False  EdgeDOF", "edge_modes", 0),
        ("ElastoDyn.dat", "True          DrTrDOF", "False  DrTrDOF", "locked", ("drivetrain",)),
        ("ElastoDyn.dat", "True          YawDOF", "F  YawDOF", "locked", ("yaw",)),
        ("ElastoDyn.dat", "True          TwFADOF2", "False  TwFADOF2", "fore_aft_modes", 1),
        ("ElastoDyn.dat", "True          TwSSDOF2", "False  TwSSDOF2", "side_side_modes", 1),
        ("AeroDyn.dat", "1   Wake_Mod", "0 Wake_Mod", "wake", "none"),
        ("AeroDyn.dat", "0   DBEMT_Mod", "2 DBEMT_Mod", "inflow", "variable"),
        ("AeroDyn.dat", "0   DBEMT_Mod", "1 DBEMT_Mod", "inflow", "constant"),
        ("AeroDyn.dat", "0   UA_Mod", "4 UA_Mod", "stall", "hansen"),
        ("AeroDyn.dat", "0   UA_Mod", "4 UA_Mod", "advanced", OPENFAST),
        ("AeroDyn.dat", "1   TwrPotent", "0 TwrPotent", "tower_influence", "none"),
        ("AeroDyn.dat", "True          TwrAero", "False TwrAero", "tower_drag", False),
        ("AeroDyn.dat", "True          TipLoss", "False TipLoss", "tip_loss", False),
        ("AeroDyn.dat", "True          HubLoss", "False HubLoss", "hub_loss", False),
        ("AeroDyn.dat", "False         AIDrag", "True AIDrag", "axial_drag", True),
        ("AeroDyn.dat", "False         TIDrag", "True TIDrag", "tangential_drag", True),
        ("AeroDyn.dat", "1                      Skew_Mod", "0 Skew_Mod", "skew", "none"),
        ("AeroDyn.dat", "1                      Skew_Mod", "1 SkewMod", "skew", "none"),
        ("AeroDyn.dat", "1   Wake_Mod", "2 WakeMod", "inflow", "quasi_steady"),
    ],
)
def test_switches_become_options(deck: Deck, name: str, old: str, new: str, option: str, value: object) -> None:
    found = ModelOptions(**meltemi.io.read_deck(deck(name, (old, new))).options)
    assert getattr(found, option) == value
    assert getattr(ModelOptions(**meltemi.io.read_deck(deck()).options), option) != value or option == "inflow"


def test_cant_of_the_sections_is_read(deck: Deck) -> None:
    assert meltemi.io.read_openfast(deck()).blade.aerodynamics.cant is None
    row = "1.3667000E+00 -8.1531745E-04 -3.4468858E-03 "
    path = deck("AeroDyn_blade.dat", (row + "0.0000000E+00", row + "-5.0"))
    cant = meltemi.io.read_openfast(path).blade.aerodynamics.cant
    assert cant is not None
    assert cant[1] == pytest.approx(math.radians(-5.0))
    assert np.count_nonzero(cant) == 1


@pytest.mark.parametrize(
    ("name", "old", "new", "path", "value"),
    [
        ("ElastoDyn.dat", "-5.0191   OverHang", "-6.5 OverHang", "nacelle.overhang", 6.5),
        ("ElastoDyn.dat", "-2.5   PreCone(1)", "-4 PreCone1", "hub.precone", math.radians(4.0)),
        ("ElastoDyn.dat", "-5   ShftTilt", "-6 ShftTilt", "nacelle.tilt", math.radians(6.0)),
        ("ElastoDyn.dat", "0   YawBrMass", "1000 YawBrMass", "tower.top_mass", 1000.0),
        ("ElastoDyn.dat", "100   GBoxEff", "96 GBoxEff", "drivetrain.gearbox_efficiency", 0.96),
        ("ElastoDyn.dat", "534.116   GenIner", "5.34116D+02   GenIner", "drivetrain.generator_inertia", 534.116),
        ("ServoDyn.dat", "94.4   GenEff", "90 GenEff", "drivetrain.generator_efficiency", 0.9),
        ("ServoDyn.dat", "9.02832E+09   YawSpr", "1E+09   YawSpr", "yaw.stiffness", 1e9),
        ("DISCON.IN", "122.9096700000      ! PC_RefSpd", "120.0 ! PC_RefSpd", "control.pitch.reference_speed", 120.0),
        ("DISCON.IN", "0                   ! PA_Mode", "2 ! PA_Mode", "pitch_actuator.kind", "second_order"),
    ],
)
def test_values_reach_the_turbine(deck: Deck, name: str, old: str, new: str, path: str, value: object) -> None:
    changes = [(old, new)]
    if "PA_Mode" in old:
        text = (deck().parent / name).read_text()
        line = next(line for line in text.splitlines() if "PA_CornerFreq" in line)
        changes.append((line, "3.14 ! PA_CornerFreq"))
    content: object = meltemi.io.read_openfast(deck(name, *changes)).content()
    for part in path.split("."):
        content = content[part]  # type: ignore[index]
    assert content == pytest.approx(value, rel=1e-9) if isinstance(value, float) else content == value


def test_the_blade_of_beamdyn(master: Path) -> None:
    sections = meltemi.io.read_openfast(master / "5MW.fst", blade="beamdyn").blade.structure
    classical = meltemi.io.read_openfast(master / "5MW.fst", blade="elastodyn").blade.structure
    assert sections.stiffness_matrix is not None
    assert sections.damping_time is not None
    assert (sections.damping_time.flap, sections.damping_time.edge) == (0.0022, 0.0014)
    # BeamDyn's x is the flap direction: bending about y is flap bending
    np.testing.assert_allclose(sections.stiffness_matrix[:, 4, 4], classical.flap_stiffness, rtol=1e-6)
    np.testing.assert_allclose(sections.stiffness_matrix[:, 3, 3], classical.edge_stiffness, rtol=1e-6)
    np.testing.assert_allclose(sections.stiffness_matrix[:, 5, 5], classical.torsion_stiffness, rtol=1e-6)
    # the sections of BeamDyn are soft in shear, have no factor on the mass, and offset centres of mass
    stiff = np.array(sections.stiffness_matrix)
    stiff[:, [0, 1], [0, 1]] *= 1e4
    turbine = meltemi.io.read_openfast(master / "5MW.fst", blade="beamdyn")
    rigid = turbine.replace(**{"blade.structure.stiffness_matrix": stiff.tolist()})
    options = ModelOptions(flap_modes=2, edge_modes=1, torsion_modes=0)
    by_matrix = meltemi.build(rigid, options).rotor.blade.modes.frequency_alone
    lighter = {"blade.structure.mass": (np.asarray(classical.mass) / 1.04536).tolist()}
    by_class = meltemi.build(meltemi.io.read_openfast(master / "5MW.fst", extra=lighter), options)
    np.testing.assert_allclose(by_matrix, by_class.rotor.blade.modes.frequency_alone, rtol=5e-3)


@pytest.mark.parametrize(
    ("mode", "settings", "lift"),
    [
        (1, (-10, 0, 10), -1.0),
        (2, (-10, 0, 10), -1.0),
        (3, (-10, 0, 10), 0.0),
        (3, (10, -30, 20), -0.75),
        (3, (5, 10, 20), -1.0),
    ],
)
def test_of_several_polars_that_of_the_deck_counts(
    deck: Deck, mode: int, settings: tuple[int, ...], lift: float
) -> None:
    """With AFTabMod 3 that at UserProp 0, between tables linearly; the lift of table i is the file's plus i - 1."""
    path = deck("AeroDyn.dat", ("1   AFTabMod", f"{mode} AFTabMod"))
    file = path.parent / "Airfoils" / "DU21_A17.dat"
    before = meltemi.io.read_openfast(path).airfoils["DU21_A17"]
    lines = file.read_text().splitlines()
    first = next(i for i, line in enumerate(lines) if line.split()[1:2] == ["Re"])
    rows = next(i for i, line in enumerate(lines) if " NumAlf " in line) + 3
    tables = []
    for i, setting in enumerate(settings):
        moved = [line.split() for line in lines[rows : rows + 142]]
        polar = [" ".join([a, repr(float(cl) + i - 1.0), *more]) for a, cl, *more in moved]
        head = [f"{setting} UserProp" if " UserProp " in line else line for line in lines[first:rows]]
        tables += [*head, *polar]
    file.write_text("\n".join([*lines[:first], *tables]))
    found = meltemi.io.read_deck(path)
    np.testing.assert_allclose(found.turbine.airfoils["DU21_A17"].lift, np.array(before.lift) + lift, atol=1e-12)
    assert any("3 polars" in note.what for note in found.notes)


def test_every_line_of_the_deck_is_in_the_report(master: Path) -> None:
    deck = meltemi.io.read_deck(master / "5MW.fst")
    for name, module in (("5MW.fst", "main"), ("ElastoDyn.dat", "ElastoDyn"), ("AeroDyn.dat", "AeroDyn")):
        entries = [e for found in read_input(master / name, module).entries.values() for e in found]
        noted = {note.where for note in deck.notes}
        missing = [e.name for e in entries if f"{name}:{e.line}" not in noted and row_of(module, e.name) is not None]
        assert not missing
        # and the table knows every keyword: what it does not know is no keyword but prose
        unknown = [e.name for e in entries if row_of(module, e.name) is None]
        assert not unknown, f"{module}: {unknown}"
    text = meltemi.io.report_text(deck.notes, "5MW")
    assert "| ElastoDyn.dat:" in text
    assert all(note.why for note in deck.notes)


@pytest.mark.parametrize(
    ("name", "old", "new", "kind"),
    [
        ("AeroDyn.dat", "0   DBEMT_Mod", "0 DBEMT_Mod", "used"),
        ("AeroDyn.dat", "0   DBEMT_Mod", "-1 DBEMT_Mod", "approximated"),
        ("AeroDyn.dat", "False   SectAvg ", "True SectAvg ", "ignored"),
        ("AeroDyn.dat", "0   TwrShadow", "1 TwrShadow", "used"),
        ("AeroDyn.dat", "0   TwrShadow", "0 TwrShadow", "equivalent"),
        ("AeroDyn.dat", "1   AFTabMod", "2 AFTabMod", "approximated"),
        ("AeroDyn.dat", "0   UAStartRad", "0.25 UAStartRad", "ignored"),
        ("ServoDyn.dat", "9999.9   TPitManS(1)", "20 TPitManS(1)", "ignored"),
        ("ServoDyn.dat", "9999.9   TPitManS(1)", "9999.9 TPitManS(1)", "equivalent"),
        ("ElastoDyn.dat", "0   PBrIner(1)", "200 PBrIner(1)", "not needed"),
        ("ElastoDyn.dat", "0   NacYaw", "10 NacYaw", "ignored"),
    ],
)
def test_what_becomes_of_a_line(deck: Deck, name: str, old: str, new: str, kind: str) -> None:
    keyword = old.split()[-1]
    text = (deck().parent / name).read_text()
    line = next(line for line in text.splitlines() if keyword in line.split()[:2])
    notes = meltemi.io.read_deck(deck(name, (line, new))).notes
    assert [note.kind for note in notes if f"{keyword} =" in note.what] == [kind]


def test_a_wake_of_constant_time_in_continuous_form(deck: Deck) -> None:
    assert meltemi.io.read_deck(deck("AeroDyn.dat", ("0   DBEMT_Mod", "3 DBEMT_Mod"))).options["inflow"] == "constant"
    assert (
        meltemi.io.read_deck(deck("AeroDyn.dat", ("0   DBEMT_Mod", "-1 DBEMT_Mod"))).options["inflow"] == "quasi_steady"
    )


def test_the_table_of_keywords_is_sound(turbine: meltemi.Turbine) -> None:
    for module, rows in ROWS.items():
        names = [key(name) for row in rows for name in row.names]
        assert len(names) == len(set(names)), module
        targets = [row.target for row in rows if row.target]
        assert len(targets) == len(set(targets)), module
        assert all(row.unit in UNITS for row in rows)
        assert all(row.remark or row.target for row in rows), module
        for row in rows:
            place: object = turbine.content()
            for part in row.target.split(".") if "." in row.target else []:
                assert isinstance(place, dict)
                assert part in place, row.target
                place = place[part]


def test_case_and_paths_of_other_systems(deck: Deck) -> None:
    path = deck("AeroDyn.dat", ('"Airfoils/Cylinder2.dat"', '"airfoils\\CYLINDER2.dat"'))
    assert meltemi.io.read_openfast(path).name == "5MW"


def test_order_and_comments_do_not_matter(deck: Deck) -> None:
    path = deck()
    file = path.parent / "ElastoDyn.dat"
    lines = file.read_text().splitlines()
    at = next(i for i, line in enumerate(lines) if "OUTPUT" in line)
    body = lines[3:at]
    random.Random(1).shuffle(body)
    lines[3:at] = [line.split(" - ")[0] for line in body] + ["! a comment", ""]
    before = meltemi.io.read_openfast(path)
    file.write_text("\r\n".join(lines), encoding="latin-1")
    assert meltemi.io.read_openfast(path) == before


@pytest.mark.parametrize(
    ("name", "old", "new", "says"),
    [
        ("5MW.fst", "0          MHK", "1          MHK", "marine"),
        ("5MW.fst", "1   NRotors", "2   NRotors", "rotors"),
        ("5MW.fst", "F   MirrorRotor", "T   MirrorRotor", "counter-clockwise"),
        ("5MW.fst", "0          CompMooring", "3 CompMooring", "floating.*--fixed-base"),
        ("5MW.fst", "1          CompElast", "3 CompElast", "ElastoDyn"),
        ("5MW.fst", "2          CompAero", "1 CompAero", "AeroDyn"),
        ("ElastoDyn.dat", "False         PtfmPDOF", "True PtfmPDOF", "platform.*--fixed-base"),
    ],
)
def test_what_is_not_modelled_is_refused_by_name(deck: Deck, name: str, old: str, new: str, says: str) -> None:
    text = (deck().parent / name).read_text()
    old = old if old in text else next(line for line in text.splitlines() if line.split()[1:2] == [old.split()[-1]])
    with pytest.raises(UnsupportedError, match=says):
        meltemi.io.read_openfast(deck(name, (old, new)))


def test_fixed_base_and_momentum_wake_when_the_user_says_so(deck: Deck) -> None:
    text = (deck().parent / "5MW.fst").read_text()
    old = next(line for line in text.splitlines() if "CompMooring" in line)
    path = deck("5MW.fst", (old, "3 CompMooring"))
    found = meltemi.io.read_deck(path, fixed_base=True)
    assert any(note.kind == "ignored" and "CompMooring = 3" in note.what for note in found.notes)
    path = deck("AeroDyn.dat", ("1   Wake_Mod", "3 Wake_Mod"))
    assert meltemi.io.read_deck(path, momentum_wake=True).options["inflow"] == "variable"


@pytest.mark.parametrize(
    ("name", "old", "new", "says"),
    [
        (
            "ElastoDyn.dat",
            "TipRad ",
            "TipRadius ",
            r"ElastoDyn.dat: ElastoDyn keyword TipRad is missing .*TipRadius in",
        ),
        (
            "ElastoDyn.dat",
            "63   TipRad",
            "sixty   TipRad",
            r"ElastoDyn.dat:\d+: TipRad: expected a number in m.*'sixty'",
        ),
        ("ElastoDyn.dat", "3   NumBl", "2.5   NumBl", r"ElastoDyn.dat:\d+: NumBl: expected a whole number.*'2.5'"),
        ("ElastoDyn.dat", "True          EdgeDOF", "maybe EdgeDOF", r"EdgeDOF: expected True or False.*'maybe'"),
        ("ElastoDyn.dat", "97   GBRatio", "-97   GBRatio", r"drivetrain.gear_ratio.*GBRatio"),
        (
            "ElastoDyn.dat",
            '"ElastoDyn_tower.dat"',
            '"ElastoDyn_towr.dat"',
            r"the file does not exist: .*did you mean '\w+_tower.dat'",
        ),
        ("ElastoDyn_blade.dat", "49   NBlInpSt", "48   NBlInpSt", r"NBlInpSt in line 4 says 48.*goes on"),
        ("ElastoDyn_blade.dat", "49   NBlInpSt", "50   NBlInpSt", r"NBlInpSt in line 4 says 50 lines, but line 50"),
        ("ElastoDyn_blade.dat", "BMassDen", "Mass", r"needs the column BMassDen"),
        ("ElastoDyn_tower.dat", "11   NTwInpSt", "12   NTwInpSt", r"says 12 lines"),
        ("AeroDyn.dat", "8   NumAFfiles", "9   NumAFfiles", r"name of airfoil file 9 of 9"),
        ("AeroDyn_blade.dat", "BlChord", "Chord", r"needs the column BlChord"),
        ("AeroDyn_blade.dat", "3.5420000E+00        1 ", "3.5420000E+00        9 ", r"BlAFID of station 1 is 9"),
        (
            "Airfoils/DU21_A17.dat",
            "142   NumAlf",
            "141   NumAlf",
            r"DU21_A17.dat:\d+: NumAlf in line 41 says 141.*goes on",
        ),
        ("Airfoils/DU21_A17.dat", "142   NumAlf", "NaN   NumAlf", r"NumAlf: expected a whole number of lines, found"),
        ("Airfoils/DU21_A17.dat", "142   NumAlf", "1e999 NumAlf", r"NumAlf: expected a whole number of lines, found"),
        ("Airfoils/DU21_A17.dat", "-175.00    0.394", "-185.00    0.394", r"angles of attack must increase"),
        ("Airfoils/DU21_A17.dat", "-175.00    0.394", "-175.00    0.x94", r"is not one \('-175.00 0.x94"),
        ("InflowWind.dat", "WindType", "WindTyp", r"WindType is missing .*WindTyp in line"),
        ("5MW.fst", '"ElastoDyn.dat"', '"unused"', r"EDFile"),
        ("BeamDyn_Blade.dat", "0.003250", "0.0000", r"stations must increase"),
        ("BeamDyn_Blade.dat", "1.811360E+10", "1.811360E+10 1.0", r"BeamDyn_Blade.dat:\d+: station 1 of 49"),
    ],
)
def test_broken_decks_say_what_is_wrong(deck: Deck, name: str, old: str, new: str, says: str) -> None:
    with pytest.raises(InputError, match=says):
        meltemi.io.read_openfast(deck(name, (old, new)), blade="beamdyn" if name.startswith("BeamDyn") else "deck")


def test_a_deck_without_a_readable_controller_asks_for_one(deck: Deck, turbine: meltemi.Turbine) -> None:
    path = deck()
    settings = path.parent / "DISCON.IN"
    settings.rename(path.parent / "elsewhere.in")
    with pytest.raises(InputError, match=r"(?s)control\.pitch.*rated_power.*--control-of"):
        meltemi.io.read_openfast(path)
    assert meltemi.io.read_openfast(path, discon=path.parent / "elsewhere.in").control.pitch.integral_gain > 0.0
    assert meltemi.io.read_openfast(path, control_of=turbine).control == turbine.control
    extra = {"control": turbine.control.content(), "rated_power": 5e6}
    assert meltemi.io.read_openfast(path, extra=extra).control == turbine.control


def test_gains_of_rosco_become_a_schedule(master: Path) -> None:
    pitch = meltemi.io.read_openfast(master / "5MW.fst").control.pitch
    file = read_input(master / "DISCON.IN", "DISCON")
    angle, gain = (np.array([number(t) for t in file.require([n], "").values]) for n in ("PC_GS_angles", "PC_GS_KI"))
    ours = pitch.integral_gain / (1.0 + angle / pitch.gain_halving_pitch)
    np.testing.assert_allclose(ours, np.abs(gain), rtol=0.35)


def _mutations(master: Path, path: Path, rng: random.Random) -> None:
    """One random harm to one file."""
    files = sorted(p for p in path.parent.rglob("*") if p.suffix in (".dat", ".fst", ".IN"))
    file = rng.choice(files)
    text = file.read_bytes()
    lines = text.split(b"\n")
    i = rng.randrange(len(lines))
    harm = rng.randrange(8)
    if harm == 0:
        file.unlink()
        return
    if harm == 1:
        del lines[i]
    elif harm == 2:
        lines.insert(i, lines[rng.randrange(len(lines))])
    elif harm == 3:
        words = lines[i].split()
        lines[i] = b" ".join(words[1:])
    elif harm == 4:
        lines[i] = lines[i].replace(b"1", b"x", 1)
    elif harm == 5:
        lines = lines[:i]
    elif harm == 6:
        words = lines[i].split()
        lines[i] = b" ".join([rng.choice([b"-1", b"1e999", b"NaN", b'"', b"\xff\xfe", b"0", b"default"]), *words[1:]])
    else:
        words = lines[i].split()
        lines[i] = b" ".join([*words[:1], b"Renamed", *words[2:]])
    file.write_bytes(b"\n".join(lines))


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
def test_decks_harmed_by_machine_never_surprise(master: Path, tmp_path: Path, seed: int) -> None:
    rng = random.Random(seed)
    for i in range(25):
        folder = tmp_path / str(i)
        shutil.copytree(master, folder)
        for _ in range(rng.randrange(1, 3)):
            _mutations(master, folder / "5MW.fst", rng)
        try:
            meltemi.io.read_deck(folder / "5MW.fst", blade=rng.choice(["deck", "beamdyn"]))
        except MeltemiError as error:
            assert str(error)
        shutil.rmtree(folder)


@pytest.mark.slow
def test_every_required_keyword_is_missed_by_name(master: Path, tmp_path: Path) -> None:
    files = {"main": "5MW.fst", "ElastoDyn": "ElastoDyn.dat", "ElastoDyn blade": "ElastoDyn_blade.dat"}
    files |= {"ElastoDyn tower": "ElastoDyn_tower.dat", "AeroDyn": "AeroDyn.dat", "DISCON": "DISCON.IN"}
    shutil.copytree(master, tmp_path / "copy")
    tried = 0
    for module, name in files.items():
        file = tmp_path / "copy" / name
        text = file.read_text()
        for row in ROWS[module]:
            found = read_input(master / name, module).find(*row.names)
            if row.optional or not row.target or found is None or row.names[0] == "PC_GS_KP":  # it tells ROSCO's files
                continue
            lines = text.splitlines()
            lines[found.line - 1] = lines[found.line - 1].replace(found.name, "Qqq", 1)
            file.write_text("\n".join(lines))
            with pytest.raises(MeltemiError, match=re.escape(row.names[0])):
                meltemi.io.read_openfast(tmp_path / "copy" / "5MW.fst")
            tried += 1
        file.write_text(text)
    assert tried > 40


def test_numbers_as_fortran_writes_them() -> None:
    assert [number(t) for t in ("1.5D+03", "1.", ".5", "-2d-1", "True", "")] == [1500.0, 1.0, 0.5, -0.2, None, None]
    assert [number(t) for t in ("1d3", "1.5+3", "-2.-1", "1-2-3", "2:1")] == [1000.0, 1500.0, -0.2, None, None]
    assert [flag(t) for t in ("T", ".true.", "TRUE", "tru", "'F'", ".f.", "1")] == [
        True,
        True,
        True,
        True,
        False,
        False,
        True,
    ]
    assert [flag(t) for t in ("maybe", "2", "", "default")] == [None] * 4
    assert split("1, 9, 19  BlOutNd - text") == ["1", "9", "19", "BlOutNd", "-", "text"]


def test_tables_are_read_by_place_with_a_check_of_their_names(deck: Deck) -> None:
    """Names of the header do not move a column (ElastoDyn_IO.f90, ReadTowerFile); another's name is a warning."""
    before = meltemi.io.read_deck(deck())
    assert not before.noted("warning")
    found = meltemi.io.read_deck(deck("ElastoDyn_tower.dat", ("TMassDen", "Density")))
    assert [note.what for note in found.noted("warning")] == ["column 2 is headed Density"]
    assert found.turbine == before.turbine
    found = meltemi.io.read_deck(deck("BeamDyn.dat", ("kp_xr", "kp_yr_")), blade="beamdyn")
    assert found.turbine == meltemi.io.read_deck(deck(), blade="beamdyn").turbine


@pytest.mark.parametrize("column", ["BlCrvAC", "BlSwpAC"])
def test_columns_that_aerodyn_needs_are_no_zeros(deck: Deck, column: str) -> None:
    with pytest.raises(InputError, match=f"needs the column {column}"):
        meltemi.io.read_openfast(deck("AeroDyn_blade.dat", (column, "Other")))


def test_cant_without_its_column_is_that_of_the_mid_chord_line(deck: Deck) -> None:
    """AeroDyn's setCantAngle: a parabola through three stations, here of a chord that twists by a small angle."""
    path = deck("AeroDyn_blade.dat", ("BlCrvAng", "Other"))
    blade = meltemi.io.read_openfast(path).blade.aerodynamics
    assert blade.cant is not None and blade.centre_x is not None
    middle = np.asarray(blade.centre_x) + 0.25 * np.asarray(blade.chord) * np.sin(blade.twist)
    curve = np.polyfit(blade.position[8:11], middle[8:11], 2)
    assert blade.cant[9] == pytest.approx(math.atan(np.polyval(np.polyder(curve), blade.position[9])), rel=1e-9)
    assert blade.cant[9] != 0.0


@pytest.mark.parametrize(
    ("row", "model", "within"),
    [
        ("7 1 2 1 1 0.5 3 T", 3.0, True),
        ("7 1 2 1 1 0.5 2 0 .false. ! before 5", 2.0, False),
        ("7 1 2 1 1 1 0.0 0.5 1 0 TRUE", 1.0, True),
    ],
)
def test_members_of_hydrodyn_by_version(tmp_path: Path, row: str, model: float, within: bool) -> None:
    """PropPot, the only True or False, tells the order of the columns."""
    (tmp_path / "hydro.dat").write_text(f"title\na title\n1 NMembers\na b c\n(-)\n! a comment\n\n{row}\n")
    ((_, member, inside),) = member_rows(read_input(tmp_path / "hydro.dat", "HydroDyn"), Notes())
    assert (member["MemberID"], member["MJointID2"], member["MCoefMod"], inside) == (7.0, 2.0, model, within)


def test_a_table_never_begins_in_the_next_section(tmp_path: Path) -> None:
    (tmp_path / "hydro.dat").write_text(
        "title\na title\n1 NMembers\n--- FILLED\n1 NFillGroups\nh\n(-)\n1 7 0 default\n"
    )
    with pytest.raises(InputError, match="hydro.dat:3: NMembers says 1 lines, but the table"):
        member_rows(read_input(tmp_path / "hydro.dat", "HydroDyn"), Notes())


@pytest.mark.parametrize("blade", ["deck", "elastodyn"])
@pytest.mark.parametrize(
    ("name", "old", "new"),
    [("BeamDyn.dat", '"BeamDyn_Blade.dat"', '"no_such_file.dat"'), ("BeamDyn.dat", "kp_total", "key_points")],
)
def test_beamdyn_files_are_not_needed_with_elastodyn(
    deck: Deck, tmp_path: Path, blade: str, name: str, old: str, new: str
) -> None:
    """OpenFAST opens them with CompElast 2 only (FAST_Subs.f90)."""
    found = meltemi.io.read_deck(deck(name, (old, new)), blade=blade)
    assert found.turbine.blade.structure.torsion_stiffness is None
    assert any("blades without torsion" in note.why for note in found.noted("ignored"))
    with pytest.raises(InputError):
        meltemi.io.read_deck(tmp_path / "copy" / "5MW.fst", blade="beamdyn")


def test_beamdyn_blades_that_end_nearly_at_the_tip(deck: Deck) -> None:
    path = deck()
    file = path.parent / "BeamDyn.dat"
    lines = file.read_text().splitlines()
    last = max(i for i, line in enumerate(lines) if len(line.split()) == 4 and number(line.split()[2]) == 61.5)
    for end, outcome in ((62.0, "stretched"), (55.0, "kp_zr must increase")):
        file.write_text("\n".join([*lines[:last], " ".join(["0 0", str(end), "0"]), *lines[last + 1 :]]))
        if outcome == "stretched":
            found = meltemi.io.read_deck(path, blade="beamdyn")
            assert [note.what for note in found.noted("warning")] == ["kp_zr ends at 62 m"]
            assert found.turbine.blade.structure.position[-1] == pytest.approx(61.5)
        else:
            with pytest.raises(InputError, match=outcome):
                meltemi.io.read_deck(path, blade="beamdyn")


def test_blade_files_of_elastodyn_are_not_needed_with_beamdyn(deck: Deck) -> None:
    """ED_ReadInput leaves them unread where BeamDyn has the blades."""
    path = deck("5MW.fst", ("1   CompElast", "2   CompElast"))
    before = meltemi.io.read_openfast(path)
    (path.parent / "ElastoDyn_blade.dat").unlink()
    assert meltemi.io.read_openfast(path) == before
    with pytest.raises(InputError, match=r"ElastoDyn.dat:\d+: the file does not exist"):
        meltemi.io.read_openfast(path, blade="elastodyn")


SIMPLE = {
    "PCMode": "0",
    "VSContrl": "1",
    "VS_RtGnSp": "1200.0",
    "VS_RtTq": "1800.0",
    "VS_Rgn2K": "3.6d-4",
    "VS_SlPc": "1",
}


def with_simple_law(deck: Deck, **values: str) -> Path:
    lines = (deck().parent / "ServoDyn.dat").read_text().splitlines()
    names = SIMPLE | values
    own = [(line, line.split()[1]) for line in lines if line.split()[1:2] and line.split()[1] in names]
    return deck("ServoDyn.dat", *((line, f"{names[name]} {name}") for line, name in own))


def simple_law(rpm: float) -> float:
    """[N m] of ServoDyn.f90, CalculateTorque, in its own words and units."""
    rated, torque, gain, slip = 1200.0, 1800.0, 3.6e-4, 0.01
    synchronous = rated / (1.0 + slip)
    slope = torque / (rated - synchronous)
    transition = (slope - math.sqrt(slope * (slope - 4.0 * gain * synchronous))) / (2.0 * gain)
    if rpm >= rated:
        return torque
    return gain * rpm**2 if rpm < transition else slope * (rpm - synchronous)


@pytest.mark.parametrize("rpm", [30.0, 600.0, 1190.0, 1191.0, 1196.0, 1199.9, 1201.0, 1500.0])
def test_the_torque_law_of_servodyn(deck: Deck, rpm: float) -> None:
    turbine = meltemi.io.read_openfast(with_simple_law(deck))
    law = parameters(turbine.control)
    assert steady_torque(law, rpm * math.pi / 30.0, law.minimum_pitch) == pytest.approx(simple_law(rpm), rel=1e-9)
    assert law.minimum_pitch == pytest.approx(math.radians(3.83), rel=1e-3)  # BlPitch(1)
    assert turbine.rated_power == pytest.approx(1800.0 * 40.0 * math.pi * 0.944)


def test_more_torque_in_region_2_than_rated_is_refused(deck: Deck) -> None:
    with pytest.raises(InputError, match=r"ServoDyn.dat:\d+ VS_Rgn2K: VS_Rgn2K times"):
        meltemi.io.read_openfast(with_simple_law(deck, VS_Rgn2K="1.0"))


def test_a_rigid_shaft_needs_no_stiffness(deck: Deck) -> None:
    stiff = next(x for x in (deck().parent / "ElastoDyn.dat").read_text().splitlines() if "DTTorSpr" in x)
    path = deck("ElastoDyn.dat", (stiff, "0.0 DTTorSpr"))
    with pytest.raises(InputError, match="DTTorSpr is 0 in ElastoDyn's file although"):
        meltemi.io.read_openfast(path)
    path = deck("ElastoDyn.dat", (stiff, "0.0 DTTorSpr"), ("True          DrTrDOF", "False DrTrDOF"))
    found = meltemi.io.read_deck(path)
    shaft = found.turbine.drivetrain
    assert shaft.stiffness == pytest.approx((20.0 * math.pi) ** 2 * 534.116 * 97.0**2)
    assert found.options["locked"] == ("drivetrain",)
    assert [note.kind for note in found.notes if "DTTorSpr" in note.what] == ["approximated"]


@pytest.mark.slow
def test_swift_at_the_speeds_of_openfast(reference: Path) -> None:
    """Steady performance of the deck by OpenFAST 2, 1.064 kg/m^3 (NREL/wakebench_swift, RotorPerformances_OF2)."""
    path = reference / "swift_v27/deck/OpenFAST_model/SNLV27_OF2.fst"
    if not path.is_file():
        pytest.skip("the deck of SWiFT is not in the reference folder")
    deck = meltemi.io.read_deck(path)
    site = meltemi.Environment(air_density=1.064)
    model = meltemi.build(deck.turbine, ModelOptions(**deck.options), site)
    for wind, rpm, power in ((5.0, 27.7301, 16.5348e3), (8.0, 43.5116, 67.5888e3), (10.0, 43.6227, 123.4121e3)):
        point = operating_point(model, meltemi.SteadyWind(speed=wind))
        assert point.rotor_speed == pytest.approx(rpm * math.pi / 30.0, rel=1e-4)
        shaft = deck.turbine.drivetrain
        speed = point.rotor_speed * shaft.gear_ratio
        assert point.generator_torque * speed * shaft.generator_efficiency == pytest.approx(power, rel=2e-3)


@pytest.mark.parametrize(
    ("yaw", "neutral", "free", "mode", "angle", "kind"),
    [
        (-20, -20, "True", 0, -20.0, "used"),
        (0, -20, "True", 0, -20.0, "ignored"),
        (-20, 0, "True", 0, 0.0, "ignored"),  # the spring turns it back
        (-20, 0, "False", 0, -20.0, "used"),
        (-20, 15, "False", 5, -20.0, "used"),
        (10, 10, "True", 5, 10.0, "used"),
    ],
)
def test_where_the_nacelle_of_a_deck_stands(
    deck: Deck, yaw: int, neutral: int, free: str, mode: int, angle: float, kind: str
) -> None:
    """Counter-clockwise, as in OpenFAST; the spring of ServoDyn is free at YawNeut."""
    main = deck()
    for name, changes in (
        ("ElastoDyn.dat", {"NacYaw": yaw, "YawDOF": free}),
        ("ServoDyn.dat", {"YawNeut": neutral, "YCMode": mode}),
    ):
        text = (main.parent / name).read_text()
        for keyword, value in changes.items():
            text, count = re.subn(rf"(?m)^ *\S+ +{keyword}(?!\S)", f"{value} {keyword}", text)
            assert count == 1
        (main.parent / name).write_text(text)
    found = meltemi.io.read_deck(main)
    assert np.degrees(found.options.get("nacelle_yaw", 0.0)) == pytest.approx(angle)
    assert found.options.get("yaw", "held") == ("driven" if mode == 5 and free == "True" else "held")
    assert [note.kind for note in found.notes if "NacYaw =" in note.what] == [kind]
    printed = [row for _, _, rows in found.tables() for row in rows if "NacYaw" in row[1]]
    assert len(printed) == (kind == "ignored")
