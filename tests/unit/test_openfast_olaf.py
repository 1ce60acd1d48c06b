"""Vortex wakes of OpenFAST decks: OLAF's files of each version in and out."""

from __future__ import annotations

import math
import re
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import meltemi
from meltemi import InputError, ModelOptions, StallConstants, UnsupportedError
from meltemi.core.errors import MeltemiError
from meltemi.exchange.openfast import Deck
from meltemi.exchange.openfast.keywords import ROWS
from meltemi.exchange.openfast.text import read_input
from meltemi.simulation.options import VortexOptions
from meltemi.verification.table import reference_table

REFERENCE = Path(__file__).parents[3] / "shared" / "reference" / "olaf"
HEAD = """- the wake
a title
- general
5 IntMethod
0.1 DTfvw
default FreeWakeStart
1.0 FullCircStart
- circulation
default CircSolvMethod
default CircSolvConvCrit
0.1 CircSolvRelaxation
30 CircSolvMaxIter
"NA" PrescribedCircFile
=====
- wake
- extent
"""
TAIL = """- treatment
True TwrShadowOnWake
1 ShearModel
- speed
2 VelocityMethod
1.5 TreeBranchFactor
1 PartPerSegment
=====
- output
0 WrVTK
1 nVTKBlades
1 VTKCoord
all VTK_fps
1 nGridOut
GridName GridType
(-) (-)
"plane" 1 default default all -80 170. 120 -120. 120. 80 210. 210. 1
=====
- advanced
! a comment
0.7 kFrozenNWStart - decay
True InductionAtCP
F DStallOnWake
1 Frobnicate
=====
"""
MIDDLE = {
    "2.5": """35 nNWPanel
10 WakeLength
5 FreeWakeLength
False FWShedVorticity
- cores
0 DiffusionMethod
3 RegDeterMethod
default RegFunction
default WakeRegMethod
0.6 WakeRegFactor
0.4 WingRegFactor
1000 CoreSpreadEddyVisc
""",
    "5.0": """820 nNWPanels
205 nNWPanelsFree
default nFWPanels
0 nFWPanelsFree
default FWShedVorticity
- cores
default DiffusionMethod
3 RegDeterMethod
2 RegFunction
default WakeRegMethod
0.6 WakeRegFactor
0.6 WingRegFactor
default CoreSpreadEddyVisc
""",
}
MIDDLE["after 5.0"] = MIDDLE["5.0"].replace("2 RegFunction\n", "2 RegFunction\n1 RegFunctionPart\n")
OLAF = {version: HEAD + middle + TAIL for version, middle in MIDDLE.items()}
STEP = 0.1 * 12.1 * math.pi / 30.0
"""[rad] azimuth between rows: DTfvw times RotSpeed."""
TURN = STEP / (2.0 * math.pi)
Reader = Callable[..., Deck]


@pytest.fixture
def read(openfast_deck: Path, tmp_path: Path) -> Reader:
    """Read the deck with a file of OLAF: ``read(text, (old, new), ..., ElastoDyn=(old, new))``."""

    def reader(text: str, *changes: tuple[str, str], **others: tuple[str, str]) -> Deck:
        folder = tmp_path / "deck"
        shutil.copytree(openfast_deck, folder, dirs_exist_ok=True)
        for old, new in changes:
            assert old in text, old
            text = text.replace(old, new, 1)
        (folder / "OLAF.dat").write_text(text)
        uses = (("AeroDyn", ("1 Wake_Mod", "3 Wake_Mod")), ("AeroDyn", ('"unused" OLAF', '"OLAF.dat" OLAF')))
        for name, (old, new) in (*uses, *others.items()):
            file = folder / f"{name}.dat"
            content = file.read_text()
            assert old in content, old
            file.write_text(content.replace(old, new, 1))
        return meltemi.io.read_deck(folder / "5MW.fst")

    return reader


def why(deck: Deck, keyword: str) -> tuple[str, str]:
    note = next(note for note in deck.notes if note.what.startswith(f"{keyword} ="))
    return note.kind, note.why


def vortices(deck: Deck) -> VortexOptions:
    options = ModelOptions(**deck.options)
    assert options.wake == "free"
    return options.vortices


def test_the_file_of_openfast_5(read: Reader) -> None:
    deck = read(OLAF["5.0"])
    assert vortices(deck).content() == pytest.approx(
        {
            "azimuth_step": STEP,
            "lattice": 0.5,
            "free": 205 * TURN,
            "length": 820 * TURN,
            "core": "lamb_oseen",
            "blade_core": 0.6,
            "wake_core": 0.6,
            "eddy_viscosity": 100.0,
            "shed": 0.0,
            "ground": True,
            "wind": "local",
        }
    )
    assert why(deck, "DTfvw") == ("used", "options.vortices.azimuth_step 0.1267 rad at RotSpeed, 12.1 rpm")
    kind, text = why(deck, "nNWPanels")
    assert kind == "approximated"
    assert text.startswith("options.vortices.length 16.54 revolutions")
    assert why(deck, "TwrShadowOnWake")[0] == "ignored"
    assert why(deck, "kFrozenNWStart")[0] == "not needed"
    assert why(deck, "DStallOnWake")[0] == "equivalent"
    assert any(note.what == "1 Frobnicate" for note in deck.noted("not needed"))
    assert why(deck, "DBEMT_Mod") == ("not needed", "of momentum theory: see Wake_Mod")


def test_files_before_3_4_have_no_frozen_near_wake_and_constant_cores(read: Reader) -> None:
    found = vortices(read(OLAF["2.5"]))
    assert (found.length, found.free) == (pytest.approx(1.0), pytest.approx(40 * TURN))  # 45 panels: 0.91 revolutions
    assert (found.core, found.eddy_viscosity, found.wake_core, found.blade_core) == ("vatistas", 0.0, 0.6, 0.4)


def test_the_function_of_particles_after_5_0_moves_the_lines_below(read: Reader) -> None:
    deck = read(OLAF["after 5.0"])
    assert vortices(deck) == vortices(read(OLAF["5.0"]))
    assert why(deck, "RegFunctionPart")[0] == "not needed"


@pytest.mark.parametrize("version", OLAF)
def test_every_line_has_one_note(read: Reader, version: str) -> None:
    places = [note.where for note in read(OLAF[version]).notes if note.where.startswith("OLAF.dat:")]
    lines = OLAF[version].splitlines()
    values = [i for i, line in enumerate(lines, 1) if re.match(r'[\w."]', line) and i != 2 and "Grid" not in line]
    values = [i for i in values if '"plane"' not in lines[i - 1]] + [lines.index("1 nGridOut") + 1]
    assert sorted(places) == sorted(f"OLAF.dat:{i}" for i in values)


def test_keywords_are_free_text_and_blank_lines_do_not_count(read: Reader) -> None:
    text = "\n\n".join(re.sub(r"^(\S+) .*", r"\1 whatever", line) for line in HEAD.splitlines()[3:])
    whole = "\n".join(HEAD.splitlines()[:3]) + "\n" + text + "\n" + MIDDLE["5.0"] + TAIL
    assert vortices(read(whole)) == vortices(read(OLAF["5.0"]))


@pytest.mark.parametrize(
    ("measure", "core", "viscosity"),
    [("0", lambda dr, chord: 0.6 / dr, 100.0), ("2", lambda dr, chord: 0.6 * chord / dr, 100.0), ("1", None, 1000.0)],
)
def test_core_radii_by_metres_and_by_chord(
    read: Reader, measure: str, core: Callable[[float, float], float] | None, viscosity: float
) -> None:
    deck = read(OLAF["5.0"], ("3 RegDeterMethod", f"{measure} RegDeterMethod"))
    blade = deck.turbine.blade.aerodynamics
    wanted = 2.0 if core is None else core(float(np.mean(np.diff(blade.position))), float(np.mean(blade.chord)))
    found = vortices(deck)
    assert (found.wake_core, found.blade_core) == (pytest.approx(wanted), pytest.approx(wanted))
    assert found.eddy_viscosity == viscosity
    assert why(deck, "WakeRegFactor")[0] == "approximated"


def test_the_wake_of_a_standstill_turns_with_rated_speed(read: Reader) -> None:
    deck = read(OLAF["5.0"], ElastoDyn=("12.1 RotSpeed", "0 RotSpeed"))
    assert vortices(deck).azimuth_step == pytest.approx(0.1 * deck.turbine.rated_rotor_speed)
    assert "at rated speed" in why(deck, "DTfvw")[1]


def test_steps_by_default_are_those_of_aerodyn(read: Reader) -> None:
    """The deck has a time step of 6.25 ms, whose rows are finer than possible."""
    deck = read(OLAF["5.0"], ("0.1 DTfvw", "default DTfvw"))
    assert vortices(deck).azimuth_step == 0.01
    assert "the nearest to 0.007919 that is possible" in why(deck, "DTfvw")[1]
    deck = read(OLAF["5.0"], ("0.1 DTfvw", "default DTfvw"), AeroDyn=('"default" DTAero', "0.025 DTAero"))
    assert vortices(deck).azimuth_step == pytest.approx(STEP / 4.0)


def test_a_wake_that_is_never_free(read: Reader) -> None:
    deck = read(OLAF["5.0"], ("default FreeWakeStart", "99999 FreeWakeStart"))
    assert vortices(deck).free == 0.0
    assert why(deck, "FreeWakeStart")[0] == "approximated"
    assert why(read(OLAF["5.0"], ("default FreeWakeStart", "3 FreeWakeStart")), "FreeWakeStart")[0] == "ignored"


def test_dynamic_stall_leaves_the_lag_of_the_wake_to_the_wake(read: Reader) -> None:
    deck = read(OLAF["5.0"], AeroDyn=("0 UA_Mod", "4 UA_Mod"))
    constants = ModelOptions(**deck.options).stall_constants
    assert (constants.a1, constants.a2) == (0.0, 0.0)
    assert constants.separation_lag > 0.0
    assert why(deck, "UA_Mod")[0] == "used"


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        (
            "default CircSolvMethod",
            "3 CircSolvMethod",
            "OLAF.dat:9 CircSolvMethod = 3: a prescribed circulation is not",
        ),
        ("default CircSolvMethod", "2 CircSolvMethod", "without flow through the blade is not modelled"),
        ("default CircSolvMethod", "4 CircSolvMethod", "OLAF.dat:9 CircSolvMethod = 4: expected one of 1, 2, 3"),
        ("0.1 DTfvw", "1e-4 DTfvw", "OLAF.dat:5 DTfvw = 0.0001: expected AeroDyn's step, .* s, or more"),
        ("820 nNWPanels", "0 nNWPanels", "OLAF.dat:17 nNWPanels = 0: expected 1 or more"),
        ("820 nNWPanels", "many nNWPanels", "OLAF.dat:17: expected the value of nNWPanels, .* found 'many nNWPanels'"),
        ("820 nNWPanels", "8.5 nNWPanels", "OLAF.dat:17: nNWPanels: expected a whole number.* found '8.5'"),
        ("820 nNWPanels", "default nNWPanels", "OLAF.dat:17: nNWPanels: expected a whole number.* found 'default'"),
        ("205 nNWPanelsFree", "821 nNWPanelsFree", "expected from 0 to nNWPanels, 820"),
        ("0 nFWPanelsFree", "1 nFWPanelsFree", "expected from 0 to nFWPanels, 0"),
        ("default nFWPanels", "9 nFWPanels", None),
        ("default nFWPanels\n0", "9 nFWPanels\n9", "nNWPanelsFree = 205: expected nNWPanels, 820, or nFWPanelsFree 0"),
        ("2 RegFunction", "7 RegFunction", "OLAF.dat:25 RegFunction = 7: expected one of 0, 1, 2, 3, 4"),
        ("0.6 WakeRegFactor", "-1 WakeRegFactor", "WakeRegFactor = -1.0: expected 0 or more"),
        ("0.1 DTfvw\n", "", "OLAF.dat:7: expected the value of FullCircStart, .* found '- circulation'"),
        (TAIL, "- treatment\nTrue\n", "OLAF.dat:31: the file ends before the line of ShearModel"),
        (OLAF["5.0"], "Wind\nis\nhere\n", "OLAF.dat:3: the file ends before the line of IntMethod"),
    ],
)
def test_wrong_files_are_refused_in_one_sentence(read: Reader, old: str, new: str, says: str | None) -> None:
    if says is None:
        assert why(read(OLAF["5.0"], (old, new)), "nFWPanels")[0] == "approximated"
        return
    with pytest.raises(MeltemiError, match=says) as error:
        read(OLAF["5.0"], (old, new))
    assert "\n" not in str(error.value)
    assert isinstance(error.value, UnsupportedError) == ("is not" in says)


def test_a_line_with_the_keyword_of_another_is_a_warning(read: Reader) -> None:
    deck = read(OLAF["5.0"], ("820 nNWPanels", "820 nFWPanels"))
    assert [note.what for note in deck.noted("warning")] == ["the line has the keyword nFWPanels"]


def test_a_deck_without_the_file_that_it_needs(read: Reader) -> None:
    with pytest.raises(InputError, match="OLAFInputFileName names no file"):
        read(OLAF["5.0"], AeroDyn=('"OLAF.dat" OLAF', '"unused" OLAF'))


def written(turbine: meltemi.Turbine, folder: Path, options: ModelOptions) -> Deck:
    """A deck at 1.2 rad/s with steps of 0.01 s, written and read back."""
    main = meltemi.io.write_openfast(turbine, folder, options=options, time_step=0.01, rotor_speed=1.2).main
    return meltemi.io.read_deck(main, control_of=turbine)


@pytest.mark.parametrize("core", ["none", "rankine", "lamb_oseen", "vatistas", "offset"])
def test_a_wake_is_the_same_when_read_back(turbine: meltemi.Turbine, tmp_path: Path, core: str) -> None:
    turn = 0.12 / (2.0 * math.pi)
    wanted = {
        "azimuth_step": 0.12,
        "free": 120 * turn,
        "length": 900 * turn,
        "blade_core": 0.5,
        "wake_core": 0.7,
        "eddy_viscosity": 300.0,
        "shed": 0.0,
        "ground": core != "none",
    }
    options = ModelOptions(
        wake="free", vortices=VortexOptions(core=core, **wanted), stall_constants=StallConstants(a1=0.0, a2=0.0)
    )
    deck = written(turbine, tmp_path, options)
    found = ModelOptions(**deck.options)
    assert found.wake == "free"
    assert found.stall_constants == options.stall_constants
    assert found.vortices.core == core
    for name, value in wanted.items():
        assert getattr(found.vortices, name) == pytest.approx(value, rel=1e-10), name


def test_a_wake_that_is_never_free_when_read_back(turbine: meltemi.Turbine, tmp_path: Path) -> None:
    deck = written(turbine, tmp_path, ModelOptions(wake="hybrid", vortices=VortexOptions(free=0.0)))
    assert vortices(deck).free == 0.0


def test_keywords_are_in_the_order_of_olaf(turbine: meltemi.Turbine, tmp_path: Path) -> None:
    written(turbine, tmp_path, ModelOptions(wake="hybrid"))
    entries = read_input(tmp_path / "OLAF.dat", "OLAF").entries
    found = [name for name in sorted(entries, key=lambda name: entries[name][0].line) if name != "gridname"]
    assert found == [row["keyword"] for row in reference_table("openfast_keywords", module="OLAF")]


def test_what_olaf_lacks_is_noted_on_export(turbine: meltemi.Turbine, tmp_path: Path) -> None:
    options = ModelOptions(wake="hybrid", vortices=VortexOptions(wind="mean"))
    changed = {
        note.what: note.why for note in meltemi.io.write_openfast(turbine, tmp_path / "a", options=options).notes
    }
    assert changed["hybrid wake"] == "each vortex moves with the velocity at its place"
    assert changed.keys() >= {"azimuth_step", "lag of the shed vorticity", "mean wind on the wake", "blade_core"}
    assert "5 to 8 degrees" in changed["discretisation of the wake"]
    near = meltemi.io.write_openfast(turbine, tmp_path / "b", options=ModelOptions(wake="near"))
    assert any(note.what == "coupled near wake" and "Wake_Mod 1" in note.why for note in near.notes)
    assert not (tmp_path / "b" / "OLAF.dat").exists()


def test_every_keyword_of_the_layouts_is_in_the_table() -> None:
    known = {name for row in ROWS["OLAF"] for name in row.names}
    assert {line.split()[1] for line in (MIDDLE["after 5.0"] + TAIL).splitlines() if line[0] not in '-=!("G1'} <= known


@pytest.mark.parametrize("name", ["rigid_12", "yaw20_10"])
def test_files_of_the_reference_runs(read: Reader, name: str) -> None:
    """OLAF of OpenFAST 5.0 by its guidelines: 820 and 984 panels, a quarter of them free, cores of 0.6 dr."""
    path = REFERENCE / f"{name}.npz"
    if not path.is_file():
        pytest.skip(f"needs the reference runs of OLAF beside the project: {path}")
    with np.load(path) as data:
        deck = read(str(data["olaf"]))
    panels = {"rigid_12": 820, "yaw20_10": 984}[name]
    step = 0.08 * 12.1 * math.pi / 30.0
    found = vortices(deck)
    assert found.azimuth_step == pytest.approx(step)
    assert found.length == pytest.approx(panels * step / (2.0 * math.pi))
    assert found.free == pytest.approx(panels // 4 * step / (2.0 * math.pi))
    assert (found.core, found.blade_core, found.wake_core, found.eddy_viscosity) == ("vatistas", 0.6, 0.6, 1000.0)
    assert not deck.noted("warning")
