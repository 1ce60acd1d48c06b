"""Controller libraries on the command line and in case files."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import pytest
from terminal import Command

import meltemi
from meltemi.controllers.specification import LibraryCase
from meltemi.core.yamlfile import read_record
from meltemi.loads.loadbase.campaign import Campaign

STEADY = ("--wind-speed", 12, "--duration", 1)


def test_a_library_controls_the_run(command: Command, library: Path, tmp_path: Path) -> None:
    """And the case file that is written does the same, from any folder."""
    order = tmp_path / "order.in"
    order.write_text("count")
    out = tmp_path / "out"
    asked = ("--controller", library, "--controller-input", order, "--channels", "generator_torque")
    ran = command("run", "nrel5mw", *STEADY, *asked, "--out", out)
    assert ran.status == 0, ran
    result = meltemi.io.read_netcdf(out / "result.nc")
    assert result["generator_torque"][-1] == 61.0
    assert result.meta["controller"] == "libdiscon.so"
    case = meltemi.io.read_case(out / "case.yaml")
    assert isinstance(case.controller, LibraryCase)
    assert Path(case.controller.library) == library
    again = tmp_path / "again"
    assert command("run", out / "case.yaml", "--out", again).status == 0
    assert meltemi.io.read_netcdf(again / "result.nc")["generator_torque"][-1] == 61.0


@pytest.mark.slow
def test_a_crash_ends_the_run_with_a_message(command: Command, library: Path, tmp_path: Path) -> None:
    order = tmp_path / "order.in"
    order.write_text("crash 0.5")
    out = tmp_path / "out"
    ran = command("run", "nrel5mw", *STEADY, "--controller", library, "--controller-input", order, "--out", out)
    assert ran.status == 1
    assert "at t = 0.500 s the controller 'libdiscon.so' failed" in ran.err and "SIGSEGV" in ran.err
    assert "hello from the library" not in ran.out
    assert len(meltemi.io.read_netcdf(out / "result.nc").time) == 10


CASE = """turbine: nrel5mw
wind: {kind: steady, speed: 12.0}
duration: 1.0
channels: [generator_torque]
"""


def test_paths_in_a_case_file_are_relative_to_it(command: Command, library: Path, tmp_path: Path) -> None:
    (tmp_path / "lib.so").write_bytes(library.read_bytes())
    (tmp_path / "order.in").write_text("count")
    path = tmp_path / "case.yaml"
    path.write_text(CASE + "controller: {kind: bladed, library: lib.so, input: order.in, sample_time: 0.1}\n")
    assert command("run", path, "--out", tmp_path / "out").status == 0
    assert meltemi.io.read_netcdf(tmp_path / "out" / "result.nc")["generator_torque"][-1] == 11.0


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("{kind: blade}", "did you mean 'bladed'?"),
        ("{kind: bladed}", "library: missing"),
        ("{kind: bladed, library: gone.so}", "library .*gone.so: no such file"),
        ("{kind: bladed, library: law.so, input: gone.in}", "input file .*gone.in: no such file"),
        ("{kind: bladed, library: law.txt}", "cannot be used as a controller library"),
        ("{kind: bladed, library: law.so, timeout: 0}", "timeout"),
        (
            "{kind: bladed, library: mine.py}",
            "mine.py: cannot be used .*: a Python file is a controller of kind: python",
        ),
        ("{kind: python, file: gone.py}", "gone.py"),
        ("{kind: supervised, scheme: icp}", "did you mean .*'ipc'"),
        ("supervized", "no controller 'supervized': did you mean 'supervised'.* Valid are baseline, supervised"),
        ("{kind: baseline, library: x}", "unknown key"),
    ],
)
def test_bad_controllers_in_case_files(command: Command, tmp_path: Path, line: str, words: str) -> None:
    path = tmp_path / "case.yaml"
    path.write_text(CASE + f"controller: {line}\n")
    (tmp_path / "mine.py").write_text("")
    (tmp_path / "law.txt").write_text("no library")
    (tmp_path / "law.so").write_bytes(b"\x7fELF")
    ran = command("run", path, "--out", tmp_path / "out")
    assert ran.status == 2
    assert ran.err.startswith(f"error: {path}") and "Traceback" not in ran.err
    assert re.search(words, ran.err), ran.err
    assert not list((tmp_path / "out").rglob("*"))


def test_an_input_file_alone_is_refused(command: Command, tmp_path: Path) -> None:
    ran = command("run", "nrel5mw", *STEADY, "--controller-input", tmp_path / "x", "--out", tmp_path / "out")
    assert ran.status == 2 and "--controller-input: requires --controller" in ran.err


def test_baseline_by_its_name_is_the_default(command: Command, tmp_path: Path) -> None:
    ran = command("run", "nrel5mw", *STEADY, "--controller", "baseline", "--out", tmp_path / "out")
    assert ran.status == 0
    assert meltemi.io.read_netcdf(tmp_path / "out" / "result.nc").meta["controller"] == "baseline"


@pytest.mark.rosco
def test_rosco_needs_its_settings(command: Command, tmp_path: Path) -> None:
    ran = command("run", "iea15mw", *STEADY, "--controller", "rosco", "--out", tmp_path / "out")
    assert ran.status == 2 and "--controller-input DISCON.IN" in ran.err
    assert not (tmp_path / "out").exists()


@pytest.mark.rosco
def test_logs_of_rosco_are_among_the_results(command: Command, rosco_cases: Path, tmp_path: Path) -> None:
    """The deck ships with ``LoggingLevel`` 2."""
    deck = rosco_cases / "NREL_2p8_127" / "NREL-2p8-127.fst"
    ran = command("run", deck, "--controller", "rosco", "--duration", 1, "--out", tmp_path / "out")
    assert ran.status == 0, ran
    for name in ("run.RO.dbg", "run.RO.dbg2", "library.log"):
        assert tmp_path / "out" / name in ran.files
        assert (tmp_path / "out" / name).stat().st_size > 100


@pytest.mark.rosco
def test_a_deck_runs_under_rosco_with_its_own_settings(command: Command, rosco_cases: Path, tmp_path: Path) -> None:
    shutil.copytree(rosco_cases / "NREL-5MW", tmp_path / "NREL-5MW")
    deck = tmp_path / "NREL-5MW" / "NREL-5MW.fst"
    deck.write_text(re.sub(r"^.*TMax ", "5.0 TMax ", deck.read_text(), flags=re.MULTILINE))
    for path in (tmp_path / "NREL-5MW").glob("*InflowWind.dat"):
        path.write_text(re.sub(r"^.*WindType ", "1 WindType ", path.read_text(), flags=re.MULTILINE))
    before = sorted((tmp_path / "NREL-5MW").rglob("*"))
    ran = command("run", deck, "--controller", "rosco", "--out", tmp_path / "out")
    assert ran.status == 0, ran
    assert meltemi.io.read_netcdf(tmp_path / "out" / "result.nc").meta["controller"] == "libdiscon.so"
    case = meltemi.io.read_case(tmp_path / "out" / "case.yaml").controller
    assert isinstance(case, LibraryCase) and case.input == str(deck.with_name("DISCON.IN"))
    assert sorted((tmp_path / "NREL-5MW").rglob("*")) == before


@pytest.mark.rosco
def test_an_imported_deck_keeps_its_controller(command: Command, rosco_cases: Path, tmp_path: Path) -> None:
    """Its case, ``compare`` and ``loads plan`` have ROSCO with the copy of its settings, wherever the folder goes."""
    deck, out = rosco_cases / "NREL_2p8_127" / "NREL-2p8-127.fst", tmp_path / "model"
    ran = command("import", deck, "--out", tmp_path / "first")
    assert ran.status == 0 and "note: NREL-2p8-127: controller rosco" in ran.err, ran
    (tmp_path / "first").rename(out)
    settings = out / "NREL-2p8-127_DISCON.IN"
    assert re.search('"NREL-2p8-127_Cp_Ct_Cq.txt" .*PerfFileName', settings.read_text())
    case = meltemi.io.read_case(out / "case.yaml")
    assert isinstance(case.controller, LibraryCase)
    assert (case.controller.library, case.controller.input) == ("rosco", settings.name)
    short = out / "short.yaml"
    short.write_text(re.sub("duration: .*", "duration: 0.5", (out / "case.yaml").read_text()))
    ran = command("run", short, "--out", tmp_path / "run")
    assert ran.status == 0, ran
    assert meltemi.io.read_netcdf(tmp_path / "run" / "result.nc").meta["controller"] == "libdiscon.so"
    turbine = out / "turbine.yaml"
    ran = command("loads", "plan", turbine, "--class", "IIIB", "--quick", "--out", tmp_path / "base")
    assert ran.status == 0 and "note: NREL-2p8-127: controller rosco" in ran.err, ran
    campaign = read_record(tmp_path / "base" / "campaign.yaml", Campaign)
    assert isinstance(campaign.controller, LibraryCase) and campaign.controller.input == str(settings)
    wind = ("--ntm", "--wind-class", "IIIB", "--wind-speed", 9, "--seeds", 1, "--duration", 21, "--transient", 1)
    ran = command("compare", turbine, *wind, "--workers", 1, "--out", tmp_path / "compared")
    assert ran.status == 0 and "note: NREL-2p8-127: controller rosco" in ran.err, ran
    table = (tmp_path / "compared" / "comparison.csv").read_text()
    assert -1 < table.find("rosco") < table.find("cpc")
    settings.unlink()
    ran = command("run", short, "--out", tmp_path / "again")
    assert ran.status == 2 and f"input file {settings}: no such file" in ran.err


MINE = """
import meltemi

def controller(turbine):
    law = meltemi.control.BaselineController(turbine)
    return meltemi.Controller(law.update, init=law.init, name="mine")
"""


@pytest.mark.slow
@pytest.mark.parametrize("name", ["supervised", "A2", "feedforward", "mine.py", "mine:controller"])
def test_every_name_runs_and_its_case_file_again(
    command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    """Whatever the folder; the case file may give the name in place of the keys."""
    monkeypatch.chdir(tmp_path)
    Path("mine.py").write_text(MINE)
    asked = ("--wind-speed", 15, "--duration", 0.5, "--channels", "pitch_1,generator_torque")
    ran = command("run", "nrel5mw", *asked, "--controller", name, "--out", "out")
    assert ran.status == 0, ran
    Path("case.yaml").write_text(
        "turbine: nrel5mw\nwind: {kind: steady, speed: 15.0}\nduration: 0.5\n"
        f"channels: [pitch_1, generator_torque]\ncontroller: {name!r}\n"
    )
    assert command("run", "case.yaml", "--out", "named").status == 0
    monkeypatch.chdir("out") if ":" not in name else None
    assert command("run", tmp_path / "out" / "case.yaml", "--out", tmp_path / "again").status == 0
    first = meltemi.io.read_netcdf(tmp_path / "out" / "result.nc")
    for other in ("named", "again"):
        found = meltemi.io.read_netcdf(tmp_path / other / "result.nc")
        assert found.meta["controller"] == first.meta["controller"]
        for channel in first.names:
            assert (found[channel] == first[channel]).all()


def test_a_misspelt_controller_gets_the_closest_name_and_the_list(command: Command) -> None:
    for line in (
        ("run", "nrel5mw", *STEADY, "--controller", "supervized"),
        ("loads", "plan", "nrel5mw", "--class", "IB", "--controller", "supervized"),
        ("compare", "nrel5mw", "--ntm", "--wind-speed", 18, "--controllers", "supervized"),
        ("bench-controller", "supervized"),
        ("surrogate", "design", "nrel5mw", "--controller", "supervized"),
        ("live", "nrel5mw", "--controller", "supervized"),
    ):
        ran = command(*line)
        assert ran.status == 2
        assert "no controller 'supervized': did you mean 'supervised'" in ran.err, line
        assert "Valid are baseline, supervised, cpc, ipc, cpfc" in ran.err and "rosco" in ran.err, line
