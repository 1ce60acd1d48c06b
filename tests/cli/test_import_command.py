"""``meltemi import`` and runs of OpenFAST decks, with a deck that we write."""

from __future__ import annotations

import math
import re
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
from terminal import Command

import meltemi


@pytest.fixture(scope="module")
def deck(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("deck")
    turbine = meltemi.load_turbine("nrel5mw")
    return meltemi.io.write_openfast(turbine, folder, wind=meltemi.SteadyWind(speed=9.0), duration=2.0).main


@pytest.mark.slow
def test_import_gives_turbine_case_and_report(command: Command, deck: Path, tmp_path: Path) -> None:
    ran = command("import", deck, "--control-of", "nrel5mw", "--out", tmp_path / "mine")
    assert ran.status == 0 and ran.err == ""
    assert [file.name for file in ran.files] == ["turbine.yaml", "case.yaml", "report.md"]
    turbine, case, report = ran.files
    assert meltemi.load_turbine(turbine).rated_power == 5e6
    assert meltemi.io.read_case(case).duration == 2.0
    assert meltemi.io.read_case(case).options.torsion_modes == 0
    assert "## Ignored" in report.read_text()
    assert command("run", case, "--out", tmp_path / "run").status == 0
    assert meltemi.io.read_netcdf(tmp_path / "run" / "result.nc")["wind_x"].mean() == pytest.approx(9.0)


@pytest.mark.slow
def test_a_slip_of_a_unit_is_told(command: Command, deck: Path, tmp_path: Path) -> None:
    (tmp_path / "extra.yaml").write_text("drivetrain: {stiffness: 8.7e5}\n")  # in kN m/rad
    extra = ("--control-of", "nrel5mw", "--extra", tmp_path / "extra.yaml")
    ran = command("import", deck, *extra, "--out", tmp_path / "mine")
    assert ran.status == 0
    assert ran.err.startswith("warning: drivetrain.stiffness: twist [rad] at rated torque is ")
    assert "; is its unit right?" in ran.err


def test_extra_values_come_on_top(command: Command, deck: Path, tmp_path: Path) -> None:
    (tmp_path / "more.yaml").write_text("hub: {mass: 60000.0}\n")
    extra = ("--control-of", "nrel5mw", "--extra", tmp_path / "more.yaml")
    assert command("import", deck, *extra, "--out", tmp_path / "mine").status == 0
    assert meltemi.load_turbine(tmp_path / "mine" / "turbine.yaml").hub.mass == 60000.0


def of_user(deck: Path, folder: Path) -> Path:
    """A copy whose controller is a routine of the user."""
    shutil.copytree(deck.parent, folder / "own", dirs_exist_ok=True)
    servo = folder / "own" / "ServoDyn.dat"
    servo.write_text(re.sub(r"\S+( +(?:PCMode|VSContrl) )", r"3\1", servo.read_text()))
    return folder / "own" / deck.name


@pytest.mark.slow
def test_a_deck_with_servodyn_own_torque_keeps_its_pitch(command: Command, deck: Path, tmp_path: Path) -> None:
    ran = command("import", deck, "--out", tmp_path / "mine")
    assert ran.status == 0 and "is its unit right" not in ran.err
    assert "BlPitch(1) =" in ran.out and "keep their initial pitch" in " ".join(ran.out.split())
    assert command("run", ran.files[1], "--out", tmp_path / "run").status == 0
    pitch = meltemi.io.read_netcdf(tmp_path / "run" / "result.nc")["BldPitch1"]
    assert abs(pitch - pitch[0]).max() < 1e-4


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("nope.fst",), "nope.fst: cannot be read"),
        (("{own}",), "control.pitch.*--control-of"),
        (("{deck}", "--blade", "beam"), "--blade 'beam': did you mean 'beamdyn'"),
        (("{deck}", "--control-of", "nrel5mv"), "did you mean 'nrel5mw'"),
        (("{deck}", "--discon", "{deck}"), "not the settings of ROSCO"),
        (("{deck}", "--control-of", "nrel5mw", "--extra", "no.yaml"), "no.yaml: no such file"),
    ],
)
def test_bad_input_is_one_error_and_writes_nothing(
    command: Command, deck: Path, tmp_path: Path, arguments: tuple[str, ...], says: str
) -> None:
    ran = command(
        "import",
        *(argument.format(deck=deck, own=of_user(deck, tmp_path)) for argument in arguments),
        "--out",
        tmp_path / "out",
    )
    assert ran.status == 2 and ran.err.startswith("error: ") and "Traceback" not in ran.err
    assert re.search(says, ran.err, re.DOTALL)
    assert not (tmp_path / "out").exists()


def test_a_deck_without_readable_control_cannot_be_run_as_it_is(command: Command, deck: Path, tmp_path: Path) -> None:
    ran = command("run", of_user(deck, tmp_path), "--out", tmp_path / "out")
    assert ran.status == 2 and "--control-of" in ran.err
    assert not (tmp_path / "out").exists()


@pytest.fixture
def master(openfast_deck: Path, tmp_path: Path) -> Path:
    """The reference deck with ROSCO's settings, of 2 s."""
    folder = tmp_path / "deck"
    shutil.copytree(openfast_deck, folder)
    main_file = folder / "5MW.fst"
    main_file.write_text(main_file.read_text().replace("200 TMax", "2 TMax"))
    return main_file


@pytest.mark.slow
def test_a_deck_with_rosco_runs_as_it_is(command: Command, master: Path, tmp_path: Path) -> None:
    main_file = master
    assert command("run", main_file, "--out", tmp_path / "run").status == 0
    assert meltemi.io.read_netcdf(tmp_path / "run" / "result.nc")["wind_x"].mean() == pytest.approx(12.0)
    case = meltemi.io.read_case(tmp_path / "run" / "case.yaml")
    assert case.turbine == str(main_file)
    assert case.options.mode_shapes == "given"


def case_of(command: Command, master: Path, out: Path, *arguments: object) -> meltemi.io.LoadCase:
    ran = command("run", master, *arguments, "--out", out)
    assert ran.status == 0, ran
    return meltemi.io.read_case(out / "case.yaml")


@pytest.mark.long
@pytest.mark.parametrize(
    ("arguments", "changes"),
    [
        (("--duration", 1), {"duration": 1.0}),
        (("--channels", "RotSpeed,GenPwr"), {"channels": ("RotSpeed", "GenPwr")}),
        (("--wind-speed", 10), {"wind.speed": 10.0}),
        (("--shear", 0.1), {"wind.shear_exponent": 0.1}),
        (("--direction", 10), {"wind.direction": math.radians(10.0)}),
        (("--start", "operating"), {}),
    ],
)
def test_options_replace_what_they_name(
    command: Command, master: Path, tmp_path: Path, arguments: tuple[object, ...], changes: dict[str, object]
) -> None:
    """The deck's degrees of freedom, models, site and all else stay."""
    as_it_is = case_of(command, master, tmp_path / "a")
    asked = case_of(command, master, tmp_path / "b", *arguments)
    assert asked == as_it_is.replace(**changes)


@pytest.mark.long
def test_another_wind_replaces_the_wind_only(
    command: Command, master: Path, bts: Callable[..., Path], tmp_path: Path
) -> None:
    as_it_is = case_of(command, master, tmp_path / "a")
    field = case_of(command, master, tmp_path / "b", "--wind-file", bts())
    assert field.wind.kind == "file"
    assert field.options == as_it_is.options and field.environment == as_it_is.environment
    assert field.duration == 2.0
    gusty = case_of(command, master, tmp_path / "c", "--wind-speed", 9, "--turbulence", 0.1, "--duration", 1)
    assert gusty.wind.kind == "turbulence" and gusty.options == as_it_is.options
    normal = "--ntm", "--wind-class", "IIB", "--wind-speed", 9, "--duration", 1
    standard = case_of(command, master, tmp_path / "d", *normal)
    assert standard.wind.wind_class == "IIB" and standard.options == as_it_is.options


@pytest.mark.slow
def test_a_start_as_openfast_makes_it(command: Command, master: Path, tmp_path: Path) -> None:
    """At the deck's rotor speed, pitch and azimuth, with straight blades; trimmed without the option."""
    file = master.parent / "ElastoDyn.dat"
    file.write_text(re.sub(r"^.* Azimuth ", " 30 Azimuth ", file.read_text(), flags=re.MULTILINE))
    asked = ("--channels", "RotSpeed,BldPitch1,Azimuth,OoPDefl1,GenTq", "--wind-speed", 8)
    case_of(command, master, tmp_path / "a", *asked, "--start", "deck")
    begun = meltemi.io.read_netcdf(tmp_path / "a" / "result.nc")
    assert begun["RotSpeed"][0] == pytest.approx(12.1 * math.pi / 30.0)
    assert begun["BldPitch1"][0] == pytest.approx(math.radians(3.83), rel=1e-3)
    assert begun["Azimuth"][0] == pytest.approx(math.radians(30.0))
    assert begun["OoPDefl1"][0] == 0.0 and begun["GenTq"][0] > 10e3
    case_of(command, master, tmp_path / "b", *asked)
    trimmed = meltemi.io.read_netcdf(tmp_path / "b" / "result.nc")
    assert trimmed["RotSpeed"][0] < 1.0 and trimmed["OoPDefl1"][0] > 1.0
    assert command("import", master, "--start", "deck", "--out", tmp_path / "c").status == 0
    assert meltemi.io.read_case(tmp_path / "c" / "case.yaml").start.azimuth == pytest.approx(math.radians(30.0))
    ran = command("run", "nrel5mw", "--start", "deck", "--wind-speed", 8, "--out", tmp_path / "d")
    assert ran.status == 2 and "--start deck: only available for OpenFAST decks" in ran.err
