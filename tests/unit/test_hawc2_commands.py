"""HAWC2 commands: each that is called used changes the import, orientations, spellings, files that are missing."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest
from proof_of_use import changes, content, write

import meltemi
from meltemi.core.errors import InputError, UnsupportedError
from meltemi.exchange.hawc2 import model
from meltemi.exchange.hawc2.bodies import DAMPING
from meltemi.exchange.hawc2.htc import Block, Command, CommandRule, Treatment, rows, treatments
from meltemi.exchange.report import ImportedModel, Kind

MAIN = "htc/toy.htc"
SPIN = "mbdy2_ini_rotvec_d1 0 0 -1 1.2"


def st(scale: float) -> str:
    """Sets of sections, made up: length, mass, EI, GJ; two subsets."""
    sets = [(60.0, 2e3, 6e10), (20.0, 3e3, 8e10), (2.0, 5.0, 1e11), (3.0, 4.0, 1e11), (40.0, 150.0, 3e8)]
    lines = [f"{len(sets)} sets"]
    for k, (length, mass, stiff) in enumerate(sets, 1):
        lines.append(f"#{k} made up")
        for subset in (1, 2):
            lines.append(f"${subset} 3")
            for r in (0.0, 0.5, 1.0):
                m, b = mass * scale * subset, stiff * scale / 2e11
                lines.append(
                    f"{r * length} {m} 0.1 0 .4 .5 0.1 0 2e11 8e10 {b} {2 * b} {stiff / 8e10} .5 .5 .3 0 0.05 0"
                )
    return "\n".join(lines) + "\n"


def ae(scale: float) -> str:
    shape = [(0, 2, 100), (8, 3, 40), (20, 2.4, 25), (32, 1.6, 18), (40, 0.8, 18)]
    sets = [f"{k} 5\n" + "\n".join(f"{r} {c * scale * k} {t} 1" for r, c, t in shape) for k in (1, 2)]
    return "2 sets\n" + "\n".join(sets) + "\n"


def pc(scale: float) -> str:
    lines = ["1 one set", "3"]
    for i, (t, slope) in enumerate(((18, 6.2), (40, 5.0), (100, 0.0)), 1):
        angles = range(-180, 181, 10)
        lines.append(f"{i} {len(angles)} {t} made up")
        lines += [
            f"{a} {scale * slope * math.sin(2 * x) / 2:.5f} {0.02 + 0.9 * math.sin(x) ** 2:.5f} 0"
            for a, x in ((a, math.radians(a)) for a in angles)
        ]
    return "\n".join(lines) + "\n"


def body(name: str, group: int, nodes: list[tuple[float, float, float]], more: str = "") -> str:
    lines = "".join(f"sec {i} {x} {y} {z} {0.1 * i};\n" for i, (x, y, z) in enumerate(nodes, 1))
    return f"""begin main_body;
name {name};
type timoschenko;
nbodies 1;
damping_posdef 0 0 0 2e-3 2.1e-3 1e-3; of {name}
{more}begin timoschenko_input;
filename ./st.dat;
fpm 0;
set {group} 1;
end timoschenko_input;
begin c2_def;
nsec {len(nodes)};
{lines}end c2_def;
end main_body;
"""


def joint(first: str, second: str, *turns: str) -> str:
    return f"begin relative;\nmbdy1 {first};\nmbdy2 {second};\n" + "".join(f"{t};\n" for t in turns) + "end relative;\n"


def hub_joint(k: int) -> str:
    azimuth = f"mbdy2_eulerang 0 {180 - 120 * (k - 1)} 0"
    return joint("shaft last", f"hub{k} 1", "mbdy2_eulerang -90 0 0", azimuth, "mbdy2_eulerang 2 0 0")


def constants(values: dict[int, float]) -> str:
    return "".join(f"constant {i} {v};\n" for i, v in values.items())


def library(name: str, values: dict[int, float]) -> str:
    return f"begin type2_dll;\nname {name};\nbegin init;\n{constants(values)}end init;\nend type2_dll;\n"


def toy() -> dict[str, str]:
    """Files of a model that has most commands: three blades of 40 m, tilt 5 deg, cone 2 deg, a body below the tower."""
    controller = {1: 2000, 2: 0.8, 3: 2.0, 4: 1.6e6, 5: 100, 6: 82, 7: 8, 8: 0.4, 9: 0.7, 10: 1.8, 11: 1e5, 12: 7e5}
    controller |= {13: 1.5e5, 15: 1, 16: 0.9, 17: 0.2, 21: 11.4, 22: 402.9, 33: 2.0, 76: 1}
    nacelle = "concentrated_mass 2 0 0.5 0 80000 4e5 2e5 4e5; of the nacelle\n"
    rotor = "concentrated_mass 2 0 0 0.1 20000 0 0 3e4;\nconcentrated_mass 1 0 0 0 10000 0 0 4e5;\n"
    text = (
        "begin simulation;\ntime_stop 50;\nend simulation;\nbegin new_htc_structure;\n"
        + body("pile", 2, [(0, 0, 0), (0, 0, -20)])
        + body("tower", 1, [(0, 0, -6.0 * i) for i in range(11)], "concentrated_mass 11 0 0 0 900 0 0 0;\n")
        + body("nacelle", 3, [(0, 0, 0), (0, 0, -2)], nacelle)
        + body("shaft", 4, [(0, 0, 0), (0, 0, 3)], rotor)
        + body("hub1", 3, [(0, 0, 0), (0, 0, 1.5)])
        + body("blade1", 5, [(0.01 * i, -0.02 * i * i, 4.0 * i) for i in range(11)])
        + "".join(
            f"begin main_body;\nname {n}{k};\ncopy_main_body {n}1;\nend main_body;\n"
            for k in (2, 3) for n in ("hub", "blade")
        )
        + "begin orientation;\nbegin base;\nmbdy pile;\ninipos 0 0 5;\nmbdy_eulerang 0 0 0;\nend base;\n"
        + joint("pile last", "tower 1", "mbdy2_eulerang 0 0 0")
        + joint("tower last", "nacelle 1", "mbdy2_eulerang 0 0 0")
        + joint("nacelle last", "shaft 1", "mbdy2_eulerang 90 0 0", "mbdy2_eulerang 5 0 0", SPIN)
        + "".join(hub_joint(k) + joint(f"hub{k} last", f"blade{k} 1", "mbdy2_eulerang 0 0 0") for k in (1, 2, 3))
        + "end orientation;\nbegin constraint;\nbegin fix0;\nmbdy pile;\nend fix0;\nbegin bearing1;\nname shaft_rot;\n"
        "mbdy1 nacelle last;\nmbdy2 shaft 1;\nbearing_vector 2 0 0 -1;\nend bearing1;\nbegin bearing2;\nname pitch1;\n"
        "mbdy1 hub1 last;\nmbdy2 blade1 1;\nbearing_vector 2 0 0 -1;\nend bearing2;\nend constraint;\n"
        "end new_htc_structure;\nbegin wind;\ndensity 1.2;\nwsp 9;\ntint 0;\nhorizontal_input 1;\n"
        "windfield_rotations 10 8 0;\ncenter_pos0 0 0 -75;\nshear_format 3 0.1;\nturb_format 0;\n"
        "tower_shadow_method 3;\nbegin tower_shadow_potential_2;\ntower_mbdy_link tower;\nnsec 2;\nradius 0 2;\n"
        "radius 60 1.5;\nend tower_shadow_potential_2;\nend wind;\nbegin aerodrag;\nbegin aerodrag_element;\n"
        "mbdy_name tower;\nnsec 2;\nsec 0 0.6 4;\nsec 60 0.6 3;\nend aerodrag_element;\nend aerodrag;\n"
        "begin aero;\nnblades 3;\nhub_vec shaft -3;\n"
        + "".join(f"link {k} mbdy_c2_def blade{k};\n" for k in (1, 2, 3))
        + "ae_filename ./ae.dat;\npc_filename ./pc.dat;\ninduction_method 1;\ntiploss_method 1;\ndynstall_method 2;\n"
        "ae_sets 1 1 1;\nend aero;\nbegin dll;\n"
        + library("dtu_we_controller", controller)
        + library("generator_servo", {4: 0.95, 5: 1})
        + library("mech_brake", {1: 2e6})
        + library("servo_with_limits", {1: 3, 2: 1.0, 3: 0.7, 4: 10, 5: 15, 6: -5, 7: 90})
        + "end dll;\nbegin output;\nunheard_of 1 2;\nend output;\nexit;\n"
    )  # fmt: skip
    files = {MAIN: text, "st.dat": st(1.0), "st2.dat": st(1.3), "ae.dat": ae(1.0), "ae2.dat": ae(1.1)}
    return files | {"pc.dat": pc(1.0), "pc2.dat": pc(1.1), "control/wpdata.100": "2\n4 1.5\n25 0.5\n"}


def read(folder: Path) -> ImportedModel:
    return meltemi.io.import_hawc2(folder / MAIN)


def edited(*changed: tuple[str, str]) -> dict[str, str]:
    """The files with replacements, each of which must apply, in the main file."""
    files = toy()
    for old, new in changed:
        assert old in files[MAIN], old
        files[MAIN] = files[MAIN].replace(old, new)
    return files


COPY = "begin main_body;\nname blade1;\ncopy_main_body root;\nend main_body;\n"
VARIANTS: dict[str, list[tuple[str, str]]] = {
    "copy_main_body": [
        ("name blade1;\ntype", "name root;\ntype"),
        ("begin main_body;\nname hub2", f"{COPY}begin main_body;\nname hub2"),
    ],
    "mbdy_eulerpar": [("mbdy_eulerang 0 0 0", "mbdy_eulerpar 1 0 0 0")],
    "mbdy_axisangle": [("mbdy_eulerang 0 0 0", "mbdy_axisangle 0 0 1 0")],
    "mbdy2_eulerpar": [("mbdy2_eulerang 5 0 0", "mbdy2_eulerpar 0.9990482215818578 0.043619387365336 0 0")],
    "mbdy2_axisangle": [("mbdy2_eulerang 5 0 0", "mbdy2_axisangle 1 0 0 5")],
    "omegas": [("bearing1", "bearing3"), ("end bearing3", "omegas 0.5;\nend bearing3")],
    "shear_format 0": [("shear_format 3 0.1", "shear_format 0 0")],
    "shear_format 2": [("shear_format 3 0.1", "shear_format 2 0.03")],
    "horizontal_input": [("horizontal_input 1", "horizontal_input 0")],
    "induction_method ": [("induction_method 1", "induction_method 2")],
    "generator_servo/constant_5": [("constant 76 1;\n", "")],
    **{name: [("damping_posdef", name)] for name in DAMPING},
}  # fmt: skip
"""What the toy model needs to have a command; with values or library where the name alone does not tell."""
WORDS = {
    "name": "nobody", "mbdy": "nobody", "copy_main_body": "hub1", "filename": "./st2.dat", "ae_filename": "./ae2.dat",
    "pc_filename": "./pc2.dat", "fpm": "1", "tower_mbdy_link": "pile", "mbdy_name": "shaft", "link": "1 c2_def hub1",
    "ae_sets": "2 2 2", "nblades": "2", "induction_method": "0", "tiploss_method": "0", "dynstall_method": "0",
    "tower_shadow_method": "0", "horizontal_input": "1", "constant_5": "5 1.5", "constant_11": "11 5e4",
    "constant_15": "15 0", "constant_76": "76 2",
}  # fmt: skip
"""Other values of a command that is no row of measures."""
MAY_REFUSE = ("name", "mbdy", "mbdy1", "mbdy2", "link", "fpm", "copy_main_body")
"""Names: another one that does not fit the rest of the model is refused, which shows that it is read."""


def other_values(path: str, command: Command) -> str:
    """Values of a command that are different."""
    leaf = path.rpartition("/")[2]
    if leaf == "constant_5" and "generator_servo" in path:
        return "5 2"
    if leaf == "shear_format" and command.values[0] == "0":
        return "1 0"
    if leaf in WORDS:
        return WORDS[leaf]
    if leaf == "set":
        return f"{command.values[0]} 2"
    if "constraint" in path and leaf == "mbdy2":
        return "hub1 1"
    if leaf in ("mbdy1", "mbdy2"):
        return f"{command.values[0]} {'1' if command.values[1] == 'last' else 'last'}"
    if leaf.endswith("axisangle"):
        return " ".join([*command.values[:3], str(float(command.values[3]) + 3.0)])
    if leaf.endswith("eulerpar"):  # three degrees more
        if "base" in path:
            return f"{math.cos(math.radians(1.5))} 0 0 {math.sin(math.radians(1.5))}"
        a = math.radians(1.5) + math.acos(float(command.values[0]))
        return f"{math.cos(a)} {math.sin(a)} 0 0"
    if leaf == "mbdy_eulerang":  # the tower remains upright
        return f"0 0 {float(command.values[2]) + 3.0}"
    if leaf.endswith("eulerang"):
        return f"{float(command.values[0]) + 3.0} {' '.join(command.values[1:])}"
    keep = 1 if len(command.values) > 1 and leaf not in ("windfield_rotations", "inipos", "center_pos0") else 0
    keep = 3 if leaf == "mbdy2_ini_rotvec_d1" else keep
    factor = 0.993 if leaf == "sec" else 0.93  # sections reach to the ends of their bodies
    return " ".join([*command.values[:keep], *(f"{factor * float(v):.9g}" for v in command.values[keep:])])


@pytest.fixture
def seen(monkeypatch: pytest.MonkeyPatch) -> list[tuple[str, Command, Kind, str]]:
    """The treatment of every command of the last import."""
    found: list[tuple[str, Command, Kind, str]] = []
    original = model.notes_on

    def spy(root: Block, treatment: Treatment) -> list[meltemi.io.ImportNote]:
        found[:] = treatments(root, treatment)
        return original(root, treatment)

    monkeypatch.setattr(model, "notes_on", spy)
    return found


def variants_of(row: CommandRule) -> list[list[tuple[str, str]]]:
    """Edits of the toy model that give it the commands of a row."""
    leaf = row.path.rpartition("/")[2]
    library = re.search(r"type2_dll:(\w+)", row.path)
    names = [f"{leaf} {v}" for v in row.values] or [f"{leaf} "] + ([f"{library.group(1)}/{leaf}"] if library else [])
    if row.path.endswith("induction_method") and row.values:
        names = []
    edits = [VARIANTS[name] for name in names if name in VARIANTS]
    if leaf in VARIANTS and not (leaf == "copy_main_body" and "copy" not in row.path):
        edits.append(VARIANTS[leaf])
    if row.values == ("2", "3") or not edits:
        edits.append([])
    return edits


READ = [row for row in rows() if row.kind in ("used", "approximated")]
IDS = [f"{r.path.removeprefix('new_htc_structure/')} {'|'.join(r.values)}" for r in READ]


@pytest.mark.parametrize("row", READ, ids=IDS)
def test_what_is_called_used_is_used(
    row: CommandRule, seen: list[tuple[str, Command, Kind, str]], tmp_path: Path
) -> None:
    """Each command of a row, in each block of the model that has it, changes the imported model by itself."""
    tried = 0
    for n, edits in enumerate(variants_of(row)):
        files = edited(*edits)
        read(write(files, tmp_path / f"{n}"))
        last = {}
        for path, command, kind, remark in seen:
            first = next((r for r in rows() if r.fits(path, command.values)), None)
            if first is row and (kind, remark) == (row.kind, row.remark):
                last[path, command.name] = (path, command)
                if len(command.values) < 2 or not command.values[0].isdigit():  # lines that are not numbered
                    last[path, command.where] = (path, command)
        for k, (path, command) in enumerate(last.values()):
            line = int(command.where.rpartition(":")[2]) - 1
            lines = files[MAIN].splitlines()
            lines[line] = f"{lines[line].split()[0]} {other_values(path, command)};"
            tried += 1
            try:
                found = changes(read, files, {MAIN: "\n".join(lines) + "\n"}, tmp_path / f"{n}_{k}")
            except (InputError, UnsupportedError):
                assert command.name in MAY_REFUSE, f"{path} = {lines[line]} is refused"
                continue
            assert found, f"{path}: {lines[line]} changes nothing"
    assert tried, f"{row.path} {row.values}: no perturbation proves that it is used"


def test_rows_that_promise_use_name_their_command() -> None:
    """A wildcard would promise it for commands that nobody has heard of."""
    for row in rows():
        if row.kind in ("used", "approximated"):
            assert "*" not in row.path.rpartition("/")[2], row.path


def test_the_geometry_of_the_toy(tmp_path: Path) -> None:
    imported = read(write(toy(), tmp_path))
    turbine = imported.turbine
    assert turbine.nacelle.tilt == pytest.approx(math.radians(5.0))
    assert turbine.hub.precone == pytest.approx(math.radians(2.0), abs=3e-5)
    assert turbine.nacelle.overhang == pytest.approx(3.0)
    assert turbine.tower.base_height == pytest.approx(15.0)
    assert turbine.hub_height == pytest.approx(15.0 + 60.0 + 2.0 + 3.0 * math.sin(math.radians(5.0)))
    wind = {"kind": "steady", "speed": 9.0, "shear_exponent": 0.1, "reference_height": 75.0}
    assert imported.wind == pytest.approx(wind | {"direction": math.radians(10.0), "upflow": math.radians(8.0)})
    assert imported.start == pytest.approx({"rotor_speed": 1.2, "pitch": 0.0, "azimuth": 0.0})
    assert not [n for n in imported.notes if n.what.startswith("blade ")]
    assert [n.kind for n in imported.notes if "unheard_of" in n.what] == ["not needed"]


@pytest.mark.parametrize(
    "tilted",
    [
        "mbdy2_axisangle 1 0 0 5",
        "mbdy2_axisangle -2 0 0 -5",
        "mbdy2_eulerpar 0.9990482215818578 0.043619387365336 0 0",
        "body2_eulerang 5 0 0",
        "body2_axisangle 1 0 0 5",
        "BODY2_EulerAng 5.0,0.0,0.0",
        "mbdy2_eulerang 2 0 0;\nmbdy2_eulerang 3 0 0",
        "mbdy2_eulerang\t5d0 0 0 and words without a semicolon",
    ],
)
def test_every_spelling_of_an_orientation(tilted: str, tmp_path: Path) -> None:
    files = edited(("mbdy2_eulerang 5 0 0", tilted))
    assert not changes_beyond_rounding(files, tmp_path)


def changes_beyond_rounding(files: dict[str, str], folder: Path) -> list[str]:
    """Nacelle and hub, as they were in the toy model."""
    one, two = (content(read(write(f, folder / name))) for f, name in ((toy(), "one"), (files, "two")))
    keys = [k for k in one if k.startswith(("turbine.nacelle.", "turbine.hub.")) and isinstance(one[k], float | tuple)]
    assert len(keys) > 8
    return [k for k in keys if not np.allclose(one[k], two[k], rtol=1e-9, atol=1e-6)]


@pytest.mark.parametrize(
    "change",
    [
        [("mbdy2_", "body2_"), ("mbdy1 ", "body1 "), ("mbdy2 ", "body2 "), ("mbdy pile", "body pile"),
         ("mbdy_eulerang", "body_eulerang"), ("mbdy_name", "body_name")],
        [("name tower;", "name TOWER;"), ("begin ", "BEGIN "), ("end dll", "end")],
        [("concentrated_mass 2 0 0 0.1", "concentrated_mass last 0 0 0.1"), ("mass 1 0", "mass 1.0 0")],
        [("hub1 1;\nmbdy2_eulerang -90 0 0;\nmbdy2_eulerang 0 180 0", "hub1 1;\nmbdy2_eulerang -90 180 0")],
    ],
)  # fmt: skip
def test_other_spellings_are_the_same_model(change: list[tuple[str, str]], tmp_path: Path) -> None:
    """Of earlier versions, in any case, an end without a name, last and 1.0 as nodes, several angles in one command."""
    files = edited(*change)
    assert not changes_beyond_rounding(files, tmp_path)
    imported = read(tmp_path / "two")
    assert imported.start["rotor_speed"] == pytest.approx(1.2)
    assert imported.turbine.tower.drag_coefficient == pytest.approx(0.6)


def test_euler_angles_turn_about_axes_that_turn(tmp_path: Path) -> None:
    """x, then y, then z of the body: the azimuth comes before the cone."""
    one = edited(("mbdy2_eulerang 90 0 0;\nmbdy2_eulerang 5 0 0", "mbdy2_eulerang 95 0 20"))
    start = read(write(one, tmp_path)).start
    # the shaft's z points upwind: +20 deg about it turns blade 1 against the clockwise sense
    assert start["azimuth"] == pytest.approx(math.radians(340.0))


def test_pitch_and_speed_of_the_start(tmp_path: Path) -> None:
    held = (
        "begin bearing3;\nname shaft_rot;\nmbdy1 nacelle last;\nmbdy2 shaft 1;\nbearing_vector 2 0 0 -1;\nomegas 0.7;\n"
    )
    pitched = "mbdy2 blade1 1;\nmbdy2_eulerang 0 0 "
    text = edited((f"{pitched}0", f"{pitched}-4"))[MAIN]
    text = re.sub(r"begin bearing1.*?end bearing1", f"{held}end bearing3", text, flags=re.S)
    imported = read(write(toy() | {MAIN: text}, tmp_path))
    assert imported.start == pytest.approx({"rotor_speed": 0.7, "pitch": math.radians(4.0), "azimuth": 0.0}, abs=1e-9)
    assert "generator" in imported.options["locked"]
    assert {n.what.split()[1] for n in imported.notes if "although" in n.why} == {
        "2",
        "3",
    }  # blades 2, 3 are not pitched


def test_a_rotor_turned_about_the_vertical_is_one_in_turned_wind(tmp_path: Path) -> None:
    """+6 deg about the global z, which points down, is clockwise seen from above: so much less of the wind's 10 deg."""
    files = edited(("mbdy2 nacelle 1;\nmbdy2_eulerang 0 0 0", "mbdy2 nacelle 1;\nmbdy2_eulerang 0 0 6"))
    assert not changes_beyond_rounding(files, tmp_path)
    imported = read(tmp_path / "two")
    assert imported.wind is not None
    assert imported.wind["direction"] == pytest.approx(math.radians(4.0))
    assert imported.start == pytest.approx({"rotor_speed": 1.2, "pitch": 0.0, "azimuth": 0.0}, abs=1e-9)


def test_wind_along_an_inclined_flow(tmp_path: Path) -> None:
    imported = read(write(edited(("horizontal_input 1", "horizontal_input 0")), tmp_path))
    assert imported.wind is not None
    assert imported.wind["speed"] == pytest.approx(9.0 * math.cos(math.radians(8.0)))


def test_a_uniform_nacelle_is_not_compared_by_value(tmp_path: Path) -> None:
    """Pieces of equal mass in the bodies between tower and shaft."""
    whole = "nsec 2;\nsec 1 0 0 0 0.1;\nsec 2 0 0 -2 0.2;"
    files = edited((whole, "nsec 3;\nsec 1 0 0 0 0.1;\nsec 2 0 0 -1 0.2;\nsec 3 0 0 -2 0.3;"))
    imported = read(write(files, tmp_path))
    # 80000, 900 at the tower top, 2 m of 5 kg/m; generator 10000 and half of the shaft's 3 m of 4 kg/m
    assert imported.turbine.nacelle.mass == pytest.approx(80000.0 + 10.0 + 10000.0 + 6.0)


def test_the_tower_has_the_drag_of_its_widths(tmp_path: Path) -> None:
    """Coefficient and width interchanged, as in the public IEA 22 MW, is the same force per length."""
    swapped = edited(("sec 0 0.6 4;", "sec 0 4 0.6;"), ("sec 60 0.6 3;", "sec 60 3 0.6;"))
    tower = read(write(swapped, tmp_path)).turbine.tower
    assert tower.drag_coefficient == pytest.approx(0.6)
    assert tower.diameter[0] == 4.0


def test_the_hub_of_a_rigid_shaft_is_where_its_mass_is(tmp_path: Path) -> None:
    """The public IEA 22 MW fixes the hub to the first node of a rigid shaft, with an offset."""
    files = edited(("concentrated_mass 2 0 0 0.1 20000", "concentrated_mass 1 0 0 2.9 20000"))
    files["stiff.dat"] = st(1.0).replace("8e10", "8e16")
    head, name, tail = files[MAIN].partition("name shaft;")
    files[MAIN] = head + name + tail.replace("./st.dat", "./stiff.dat", 1)
    turbine = read(write(files, tmp_path)).turbine
    assert turbine.hub.mass == pytest.approx(20000.0, abs=40.0)
    assert turbine.hub.mass_centre == pytest.approx(0.1, abs=0.01)


@pytest.mark.parametrize(
    ("old", "new", "G", "k_x", "k_y"),
    [
        ("", "", 8e10, 0.5, 0.5),
        (" .5 .5 .3 ", " .2 .5 .3 ", 8e10, 0.2, 0.5),
        (" .5 .5 .3 ", " .5 .2 .3 ", 8e10, 0.5, 0.2),
        (" 8e10 ", " 4e10 ", 4e10, 0.5, 0.5),
    ],
    ids=["as it is", "k_x", "k_y", "G"],
)
def test_shear_factors_and_modulus_are_used(
    old: str, new: str, G: float, k_x: float, k_y: float, tmp_path: Path
) -> None:
    """Of blade and tower; our x is HAWC2's y. The blade's shear centre is 0.05 m from the elastic centre."""
    files = toy()
    files["st.dat"] = files["st.dat"].replace(old, new) if old else files["st.dat"]
    turbine = read(write(files, tmp_path)).turbine
    K, rigidity = turbine.blade.structure.stiffness_matrix, 3e8 / 8e10 * G
    assert K is not None and turbine.tower.shear_stiffness is not None and turbine.tower.torsion_stiffness is not None
    assert (K[0, 0, 0], K[0, 1, 1]) == pytest.approx((k_y * G * 0.3, k_x * G * 0.3))
    assert K[0, 5, 5] == pytest.approx(rigidity + k_y * G * 0.3 * 0.05**2)
    assert turbine.tower.shear_stiffness[0] == pytest.approx(0.5 * (k_x + k_y) * G * 0.3)
    assert turbine.tower.torsion_stiffness[0] == pytest.approx(6e10 / 8e10 * G + k_y * G * 0.3 * 0.1**2, rel=0.01)


def test_a_stiff_tower_is_overdamped_not_refused(tmp_path: Path) -> None:
    files = edited(("damping_posdef 0 0 0 2e-3 2.1e-3 1e-3; of tower", "damping_posdef 0 0 0 0.9 0.8 0.9;"))
    imported = read(write(files, tmp_path))
    assert imported.turbine.tower.damping.fore_aft == 0.99
    assert any("at most 99 %" in n.why for n in imported.notes)


def test_files_that_are_not_used_are_not_needed(tmp_path: Path, turbine: meltemi.turbine.Turbine) -> None:
    """Sections below the tower; the table of the pitch angle if the control is another turbine's."""
    files = toy()
    del files["control/wpdata.100"]
    head, name, tail = files[MAIN].partition("name pile;")
    files[MAIN] = head + name + tail.replace("./st.dat", "./no_such.dat", 1)
    folder = write(files, tmp_path)
    with pytest.raises(InputError, match=r"wpdata.100 does not exist.*extra=.*control_of"):
        read(folder)
    imported = meltemi.io.import_hawc2(folder / MAIN, control_of=turbine)
    # the control's generator speeds are those of its gear ratio
    assert imported.turbine.drivetrain.gear_ratio == turbine.drivetrain.gear_ratio
    assert imported.turbine.drivetrain.generator_inertia * turbine.drivetrain.gear_ratio**2 == pytest.approx(
        4e5, rel=1e-3
    )
    given = meltemi.io.import_hawc2(folder / MAIN, extra={"control.pitch.minimum": 0.01})
    assert given.turbine.control.pitch.minimum == 0.01


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("wsp 9", "wsp [Windspeed]", r"\[Windspeed\] is a tag of a template"),
        ("wsp 9", "wsp {{ speed }}", "is a tag of a template"),
        ("./ae.dat", "./[turbine]_ae.dat", "is a tag of a template"),
        ("tiploss_method 1;", "tiploss_method 1;\n[gust] iec_gust 1;", r"expected a command, found '\[gust\]'"),
        ("mbdy2_eulerang 5 0 0", "mbdy2_eulerangle 5 0 0", "eulerangle is unknown: did you mean 'mbdy2_eulerang'"),
        ("mbdy2_eulerang 5 0 0", "mbdy2_axisangle 0 0 0 5", "expected an axis"),
        ("mbdy2_eulerang 5 0 0", "mbdy2_eulerpar 1 1 0 0", "four numbers of length 1"),
        ("mbdy2_eulerang 5 0 0", "relpos 0 0 1", "relpos: a distance between two bodies"),
        ("bearing_vector 2 0 0 -1;\nend bearing1", "bearing_vector 2 0 1 0;\nend bearing1", "rotate it about its axis"),
        ("name tower;", "name ;", "name: expected a word at place 1, found nothing"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_named(old: str, new: str, words: str, tmp_path: Path) -> None:
    files = edited((old, new))
    if not words:
        read(write(files, tmp_path))
        return
    with pytest.raises((InputError, UnsupportedError), match=words):
        read(write(files, tmp_path))


def test_tags_where_nothing_is_read_do_no_harm(tmp_path: Path) -> None:
    files = edited(("time_stop 50", "time_stop 50;\nlogfile ./log/[Case id.].log"), ("exit;\n", "exit;\n[never read"))
    assert read(write(files, tmp_path)).duration == 50.0


@pytest.mark.parametrize("name", [MAIN, "st.dat", "ae.dat", "pc.dat", "control/wpdata.100"])
def test_a_pointer_of_git_lfs_is_named(name: str, tmp_path: Path) -> None:
    pointer = "version https://git-lfs.github.com/spec/v1\noid sha256:4d7a\nsize 12345\n"
    with pytest.raises(InputError, match=r"pointer to a file in Git LFS, not the file: `git lfs pull` fetches it"):
        read(write(toy() | {name: pointer}, tmp_path))


def test_unknown_commands_are_listed_with_the_closest(tmp_path: Path) -> None:
    imported = read(write(edited(("tiploss_method 1", "tiploss_metod 1")), tmp_path))
    (note,) = [n for n in imported.notes if "tiploss_metod" in n.what]
    assert (note.kind, note.why) == ("ignored", "unknown to this reader; it knows tiploss_method")
