"""Every command: it succeeds, does what its help says, and says where its output went."""

from __future__ import annotations

import csv
import math
import re
import shutil
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from importlib.metadata import entry_points
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from terminal import STEADY, Command, succeeded

import meltemi
from meltemi import InputError, Model, Simulation, Status, SteadyWind
from meltemi.app.cli import main
from meltemi.app.options import sea_of_options, wind_changed
from meltemi.cases.case import IecCase, LoadCase, read_case
from meltemi.control.baseline import BaselineController
from meltemi.report.tables import number
from meltemi.simulation import validity
from meltemi.simulation.channels import DEFAULT

WITHOUT_FILES = ("turbines", "channels", "warmup", "bench")
WITH_FILES = (
    "run power-curve wind compare climate bench-controller diff observe reproduce campbell farm flutter parked "
    "yaw-limits verify template"
).split()
COMMANDS = (*WITH_FILES, *WITHOUT_FILES)


RUN = ("result.nc", "statistics.csv", "result.png", "case.yaml")


@pytest.mark.slow
def test_run_in_steady_wind(command: Command, tmp_path: Path, model: Model) -> None:
    out = tmp_path / "new" / "folder"
    ran = command("run", "nrel5mw", "--wind-speed", 10, "--duration", 5, "--out", out)
    succeeded(ran, out, *RUN)
    assert "nrel5mw: steady wind 10 m/s" in ran.out
    assert re.search(r"5 s simulated in \d+\.\d\d s: [\d.]+ times real time \(time step 0\.0166667 s", ran.out)
    assert (out / "result.png").read_bytes().startswith(b"\x89PNG")
    # the same as from Python
    result = meltemi.io.read_netcdf(out / "result.nc")
    again = meltemi.simulate(model, SteadyWind(speed=10.0), duration=5.0)
    assert result.status is Status.OK
    assert result.names == DEFAULT
    assert np.array_equal(result.data, again.data)


def test_the_table_on_the_terminal_and_in_the_file_are_the_same(command: Command, tmp_path: Path) -> None:
    ran = command("run", "nrel5mw", "--wind-speed", 10, "--duration", 5, "--channels", "RootMyc1", "--out", tmp_path)
    with (tmp_path / "statistics.csv").open(newline="") as file:
        head, row = csv.reader(file)
    assert head[:7] == ["channel", "OpenFAST", "unit", "mean", "std", "min", "max"]
    assert row[:3] == ["root_moment_out_of_plane_1", "RootMyc1", "kN m"]
    (line,) = (line for line in ran.out.splitlines() if "RootMyc1" in line)
    shown = [part.strip() for part in line.strip("│").split("│")]
    assert shown == [*row[:3], *(number(float(digits)) for digits in row[3:])]
    assert len(row[3]) > 8, "the file keeps the digits that the table rounds"
    low, mean, high = (float(row[head.index(name)]) for name in ("min", "mean", "max"))
    assert low < mean < high


def test_channels_are_chosen_by_either_name(command: Command, tmp_path: Path) -> None:
    names = "RootMyc1, wind_x,rotspeed,,node_20_alpha_2"
    ran = command("run", "nrel5mw", "--wind-speed", 10, "--duration", 5, "--channels", names, "--out", tmp_path)
    succeeded(ran, tmp_path, *RUN)
    recorded = meltemi.io.read_netcdf(tmp_path / "result.nc").names
    assert recorded == ["root_moment_out_of_plane_1", "wind_x", "rotor_speed", "node_20_alpha_2"]


def test_further_names_of_openfast_are_the_same_channels(command: Command, tmp_path: Path) -> None:
    names = "ROOTMOOP1,PtchPMzc2,AB1N020Alpha,LSShftMxa"
    command("run", "nrel5mw", "--wind-speed", 10, "--duration", 5, "--channels", names, "--out", tmp_path)
    recorded = meltemi.read_result(tmp_path / "result.nc").names
    assert recorded == ["root_moment_out_of_plane_1", "pitch_2", "node_20_alpha_1", "rotor_torque"]
    case = "turbine: nrel5mw\nwind: {kind: steady, speed: 10.0}\nduration: 5.0\nchannels: [TipDxc1, spn1mlyb2]\n"
    (tmp_path / "a.yaml").write_text(case + "blade_stations: [20.0]\n")
    assert command("run", tmp_path / "a.yaml", "--out", tmp_path).status == 0
    assert meltemi.read_result(tmp_path / "result.nc").names == ["tip_out_of_plane_1", "station_1_moment_y_2"]


@pytest.mark.slow
def test_a_run_is_written_for_tools_for_openfast(command: Command, tmp_path: Path) -> None:
    ran = command("run", "nrel5mw", "--wind-speed", 10, "--duration", 5, "--outb", "--out", tmp_path)
    succeeded(ran, tmp_path, *RUN, "result.outb")
    result, packed = (meltemi.read_result(tmp_path / f"result.{suffix}") for suffix in ("nc", "outb"))
    assert packed.names == result.names
    assert np.all(np.abs(packed.data - result.data) <= np.ptp(result.data, axis=0) / 131000 + 6e-8 * abs(result.data))
    assert "nrel5mw: steady wind 10 m/s" in packed.meta["description"]


@pytest.mark.slow
def test_events_of_a_case_happen_and_are_told(command: Command, tmp_path: Path) -> None:
    events = "events:\n  - {at: 2, type: grid_loss}\n  - {at: 1.5, until: 3, type: pitch_stuck, blade: 3}\n"
    case = f"turbine: nrel5mw\nwind: {{kind: steady, speed: 14.0}}\nduration: 4.0\nchannels: [GenTq]\n{events}"
    (tmp_path / "a.yaml").write_text(case)
    ran = command("run", tmp_path / "a.yaml", "--out", tmp_path / "out")
    succeeded(ran, tmp_path / "out", *RUN)
    assert re.search(r"1\.50 .* event .* pitch of blade 3 stuck .*\n.* 2\.00 .* grid lost", ran.out)
    result = meltemi.io.read_netcdf(tmp_path / "out" / "result.nc")
    assert np.flatnonzero(result["GenTq"] == 0.0)[0] == 40 and len(result.log) == 3
    again = command("run", tmp_path / "out" / "case.yaml", "--out", tmp_path / "again")
    assert np.array_equal(meltemi.io.read_netcdf(tmp_path / "again" / "result.nc").data, result.data)
    assert again.status == 0


@pytest.mark.slow
def test_turbulence_repeats_with_its_seed(command: Command, tmp_path: Path) -> None:
    winds = []
    for i, seed in enumerate((7, 7, 8)):
        out = tmp_path / str(i)
        options = ("--wind-speed", 9, "--turbulence", 0.2, "--seed", seed, "--duration", 5, "--channels", "wind_x")
        succeeded(command("run", "nrel5mw", *options, "--out", out), out, *RUN)
        winds.append(meltemi.io.read_netcdf(out / "result.nc")["wind_x"])
    assert np.array_equal(winds[0], winds[1])
    assert not np.array_equal(winds[0], winds[2])
    assert np.std(winds[0]) > 0.1


@pytest.mark.slow
def test_shear_reaches_the_wind(command: Command, tmp_path: Path) -> None:
    ran = command("run", "nrel5mw", "--wind-speed", 8, "--shear", 0.14, "--duration", 5, "--out", tmp_path)
    succeeded(ran, tmp_path, *RUN)
    assert "steady wind 8 m/s, shear exponent 0.14" in ran.out


@pytest.mark.slow
def test_run_in_a_turbsim_field(command: Command, tmp_path: Path, bts: Callable[..., Path]) -> None:
    out = tmp_path / "out"
    succeeded(command("run", "nrel5mw", "--bts", bts(), "--duration", 9, "--out", out), out, *RUN)
    result = meltemi.io.read_netcdf(out / "result.nc")
    # the gust of 1 m/s ends after 10 s of the field, half of whose width has passed when the run begins
    assert result["wind_x"][0] == pytest.approx(11.0, abs=1e-4)
    assert result["wind_x"][-1] == pytest.approx(10.0, abs=1e-4)
    assert result.meta["wind"] == "field.bts"


@pytest.mark.slow
def test_run_in_a_uniform_wind_file(command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "gust.wnd").write_text("! time speed\n0 10 0 0 0 0.2 0 0\n4 12 0 0 0 0.2 0 0\n")
    monkeypatch.chdir(tmp_path)
    ran = command("run", "nrel5mw", "--wnd", "gust.wnd", "--duration", 5, "--out", "out")
    succeeded(ran, Path("out"), *RUN)
    wind = meltemi.io.read_netcdf("out/result.nc")["wind_x"]
    assert wind[0] == pytest.approx(10.0)
    assert wind[-1] == pytest.approx(12.0)


@pytest.mark.slow
def test_warnings_of_a_run_are_shown(command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    law = BaselineController(meltemi.load_turbine("nrel5mw"))
    wary = replace(law, warnings=lambda state: ["pitch: look at it"])
    monkeypatch.setattr("meltemi.simulation.plan.BaselineController", lambda turbine: wary)
    ran = command("run", "nrel5mw", "--wind-speed", 9, "--duration", 1, "--out", tmp_path)
    assert (ran.status, ran.err) == (0, "warning: pitch: look at it\n")
    assert meltemi.io.read_netcdf(tmp_path / "result.nc").warnings == ("pitch: look at it",)


@pytest.mark.slow
def test_statistics_leave_the_transient_out(command: Command, tmp_path: Path) -> None:
    ran = command("run", "nrel5mw", "--wind-speed", 9, "--duration", 3, "--transient", 1, "--out", tmp_path / "out")
    assert ran.status == 0
    assert "after 1 s" in ran.out
    case = meltemi.io.read_case(tmp_path / "out" / "case.yaml")
    assert case.transient == 1.0
    result = meltemi.io.read_netcdf(tmp_path / "out" / "result.nc")
    assert result.time[0] == 0.0 and result.evaluated.time[0] == 1.0
    late = command("run", "nrel5mw", "--wind-speed", 9, "--duration", 3, "--transient", 3, "--out", tmp_path / "none")
    assert late.status == 2 and "leaves nothing" in late.err
    assert not (tmp_path / "none").exists()


@pytest.mark.slow
def test_a_doubtful_run_says_so(command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(validity, "OVERSPEED", 0.5)
    ran = command("run", "nrel5mw", "--wind-speed", 9, "--duration", 1, "--out", tmp_path)
    assert ran.status == 1
    assert "DOUBTFUL: rotor faster than 1.5 times its rated speed" in ran.err
    assert (tmp_path / "result.nc").exists()
    assert meltemi.io.read_netcdf(tmp_path / "result.nc").status is Status.DOUBTFUL


@pytest.mark.slow
def test_a_turbine_that_may_be_a_slip_is_told(command: Command, tmp_path: Path) -> None:
    light = meltemi.load_turbine("nrel5mw").replace(**{"nacelle.mass": 240.0})
    meltemi.io.write_turbine(light, tmp_path / "light.yaml")
    ran = command("run", tmp_path / "light.yaml", "--wind-speed", 9, "--duration", 0.5, "--out", tmp_path / "out")
    assert "warning: nacelle.mass: 240 kg is unusual; usual is " in ran.err


def test_run_a_case(command: Command, tmp_path: Path) -> None:
    (tmp_path / "a.yaml").write_text(STEADY + "channels: [RotSpeed, station_1_moment_y_1]\nblade_stations: [20.0]\n")
    out = tmp_path / "out"
    succeeded(command("run", tmp_path / "a.yaml", "--out", out), out, *RUN)
    result = meltemi.io.read_netcdf(out / "result.nc")
    assert result.names == ["rotor_speed", "station_1_moment_y_1"]
    assert result.time[-1] == 5.0


CHANGES = [
    (("--duration", 4), {"duration": 4.0}),
    (("--wind-speed", 9, "--direction", 90), {"wind.speed": 9.0, "wind.direction": math.pi / 2}),
    (("--turbulence", 0.1, "--seed", 3), {"wind.kind": "turbulence", "wind.speed": 10.0, "wind.seed": 3}),
    (("--iec", "ETM", "--wind-class", "IA"), {"wind.kind": "iec", "wind.speed": 10.0, "wind.wind_class": "IA"}),
    (("--controller", "ipc"), {"controller.scheme": "ipc"}),
    (("--transient", 1), {"transient": 1.0}),
    (("--yaw", 180), {"options.nacelle_yaw": math.pi}),
    (("--channels", "RotSpeed"), {"channels": ("RotSpeed",)}),
]


@pytest.mark.parametrize(("options", "changed"), CHANGES)
def test_options_change_a_case(
    command: Command,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    options: tuple[Any, ...],
    changed: dict[str, Any],
) -> None:
    (tmp_path / "a.yaml").write_text(STEADY + "output_step: 0.1\n")
    begun: list[LoadCase] = []

    def described(case: LoadCase, *_: Any) -> None:
        begun.append(case)
        raise InputError("far enough")

    monkeypatch.setattr("meltemi.cases.case.case_run", described)
    assert command("run", tmp_path / "a.yaml", *options, "--out", tmp_path / "out").err.endswith("far enough\n")
    for key, value in changed.items():
        found: Any = begun[0]
        for name in key.split("."):
            found = getattr(found, name)
        assert found == pytest.approx(value) if isinstance(value, float) else found == value
    assert begun[0] != read_case(tmp_path / "a.yaml")
    assert begun[0].output_step == 0.1


def test_options_of_turbulence_change_that_of_a_case(tmp_path: Path) -> None:
    wind = {"kind": "iec", "model": "NTM", "wind_class": "IIB", "speed": 8.0, "turbulence": {"points": 9}}
    given = {"--wind-speed": 11.0, "--spectrum": "mann", "--seed": 4}
    found = wind_changed(given, wind, IecCase.model_fields)
    assert found == wind | {"speed": 11.0, "seed": 4, "turbulence": {"points": 9, "spectrum": "mann"}}


def test_a_regular_wave_is_an_option() -> None:
    wave = {"kind": "regular", "height": 4.0, "period": 12.0, "direction": 0.0}
    assert sea_of_options("regular:4,12") == wave
    assert sea_of_options("4,12,90") == {**wave, "kind": "irregular", "direction": math.pi / 2}


@pytest.mark.slow
def test_paths_in_a_case_are_relative_to_its_file(
    command: Command, tmp_path: Path, bts: Callable[..., Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    bts()
    assert command("template", "turbine", "--out", tmp_path / "mine.yaml").status == 0
    (tmp_path / "a.yaml").write_text("turbine: mine.yaml\nwind: {kind: bts, file: field.bts}\nduration: 5.0\n")
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    succeeded(command("run", "../a.yaml", "--out", "out"), Path("out"), *RUN)


@pytest.mark.slow
def test_the_written_case_repeats_the_run(command: Command, tmp_path: Path) -> None:
    options = ("--wind-speed", 9, "--turbulence", 0.1, "--duration", 5)
    command("run", "nrel5mw", *options, "--out", tmp_path / "a")
    succeeded(command("run", tmp_path / "a" / "case.yaml", "--out", tmp_path / "b"), tmp_path / "b", *RUN)
    a, b = (meltemi.io.read_netcdf(tmp_path / name / "result.nc") for name in "ab")
    assert np.array_equal(a.data, b.data)
    assert a.meta["wind_hash"] == b.meta["wind_hash"]


@pytest.mark.slow
def test_the_written_case_repeats_a_run_with_files(command: Command, tmp_path: Path, bts: Callable[..., Path]) -> None:
    bts()
    (tmp_path / "a.yaml").write_text("turbine: nrel5mw\nwind: {kind: bts, file: field.bts}\nduration: 5.0\n")
    command("run", tmp_path / "a.yaml", "--out", tmp_path / "a")
    ran = command("run", tmp_path / "a" / "case.yaml", "--out", tmp_path / "b")
    assert ran.status == 0, ran.err


@pytest.mark.slow
def test_a_run_leaves_its_own_case_file_alone(command: Command, tmp_path: Path) -> None:
    case = tmp_path / "case.yaml"
    case.write_text("# my notes\n" + STEADY)
    command("run", case, "--out", tmp_path)
    assert case.read_text() == "# my notes\n" + STEADY


@pytest.mark.slow
def test_the_template_of_a_case_runs(command: Command, tmp_path: Path) -> None:
    path, out = tmp_path / "case.yaml", tmp_path / "out"
    ran = command("template", "case", "--out", path)
    assert (ran.status, ran.files, ran.err) == (0, [path], "")
    assert command("template").out == command("template", "case").out == path.read_text(encoding="utf-8")
    path.write_text(path.read_text(encoding="utf-8").replace("duration: 60.0", "duration: 5.0"), encoding="utf-8")
    succeeded(command("run", path, "--out", out), out, *RUN)


def test_what_the_template_has_in_comments_is_valid(command: Command, tmp_path: Path) -> None:
    text = command("template").out
    for old, new in (
        ("controller: baseline ", "# controller: baseline "),
        ("# controller: {kind: power", "controller: {kind: power"),
        ("  # electrical: averaged", "  electrical: averaged"),
        ("# electrical: sized", "electrical: sized"),
        ("# grid: ", "grid: "),
        ("#   power_reference", "  power_reference"),
        ("#   voltage", "  voltage"),
        ("#   frequency", "  frequency"),
    ):
        assert old in text
        text = text.replace(old, new, 1)
    (tmp_path / "a.yaml").write_text(text)
    case = meltemi.io.read_case(tmp_path / "a.yaml")
    assert (case.grid.power_reference, case.electrical, case.options.electrical) == (3e6, "sized", "averaged")
    assert case.controller.kind == "power"


@pytest.mark.long
def test_the_templates_other_winds_are_valid(command: Command, tmp_path: Path, bts: Callable[..., Path]) -> None:
    bts()
    (tmp_path / "gust.wnd").write_text("0 10 0 0 0 0.2 0 0\n")
    text = command("template").out
    ours = re.search(r"^wind:\n(  .*\n)+", text, re.MULTILINE)
    others = re.findall(r"^# (wind: .*)$", text, re.MULTILINE)
    assert ours is not None
    assert len(others) == 4
    for i, wind in enumerate(others):
        short = text.replace(ours[0], wind + "\n").replace("duration: 60.0", "duration: 5.0")
        (tmp_path / "a.yaml").write_text(short.replace("begin: 30.0", "begin: 3.0"))
        ran = command("run", tmp_path / "a.yaml", "--out", tmp_path / str(i))
        assert ran.status == 0, ran.err


@pytest.mark.slow
@pytest.mark.parametrize(
    ("options", "label"),
    [
        (("--ntm", "--class", "IIB", "--wind-speed", 20, "--seed", 1), "Kaimal turbulence 20 m/s, intensity 14.4 %"),
        (("--iec", "ETM", "--class", "IA", "--wind-speed", 8, "--spectrum", "mann"), "Mann turbulence 8 m/s"),
        (("--iec", "EOG", "--class", "IIB", "--wind-speed", 12, "--begin", 1, "--duration", 12), "IEC EOG 12 m/s"),
        (("--wind-speed", 9, "--turbulence", 0.1, "--spectrum", "vonkarman", "--edition", 2), "von Karman turbulence"),
    ],
)
def test_winds_of_the_standard_need_no_file(
    command: Command, tmp_path: Path, options: tuple[object, ...], label: str
) -> None:
    out = tmp_path / "out"
    ran = command("run", "nrel5mw", "--duration", 5, *options, "--out", out)
    succeeded(ran, out, *RUN)
    assert label in ran.out
    again = command("run", out / "case.yaml", "--out", tmp_path / "again")
    assert again.status == 0, again.err
    assert (tmp_path / "again" / "statistics.csv").read_bytes() == (out / "statistics.csv").read_bytes()


def test_a_case_takes_a_measured_series(command: Command, tmp_path: Path) -> None:
    (tmp_path / "mast.csv").write_text("time [s],u [m/s]\n0,9\n5,11\n20,12\n")
    (tmp_path / "a.yaml").write_text(
        "turbine: nrel5mw\nduration: 5.0\nchannels: [wind_x]\n"
        "wind: {kind: turbulence, speed: 10.0, intensity: 0.1, hub_file: mast.csv}\n"
    )
    ran = command("run", tmp_path / "a.yaml", "--out", tmp_path / "out")
    assert ran.status == 0, ran.err
    wind = meltemi.io.read_netcdf(tmp_path / "out" / "result.nc")
    expected = 9.0 + 2.0 / 5.0 * wind.time  # between the planes linear, as the series is
    np.testing.assert_allclose(wind.data[2:, 0], expected[2:], rtol=0.0, atol=0.01)


@pytest.mark.slow
def test_the_template_of_a_turbine_runs(command: Command, tmp_path: Path) -> None:
    path, out = tmp_path / "mine.yaml", tmp_path / "out"
    assert command("template", "turbine", "--out", path).files == [path]
    assert meltemi.load_turbine(path) == meltemi.load_turbine("nrel5mw")
    succeeded(command("run", path, "--wind-speed", 10, "--duration", 5, "--out", out), out, *RUN)


def test_templates_never_overwrite(command: Command, tmp_path: Path) -> None:
    path = tmp_path / "case.yaml"
    path.write_text("mine")
    ran = command("template", "case", "--out", path)
    assert (ran.status, ran.err) == (2, f"error: {path}: the file already exists; choose another name\n")
    assert path.read_text() == "mine"


def test_turbines(command: Command) -> None:
    ran = command("turbines")
    assert (ran.status, ran.err) == (0, "")
    (line,) = (line for line in ran.out.splitlines() if line.strip("│ ").startswith("nrel5mw "))
    assert [part.strip() for part in line.strip("│").split("│")][-3:] == ["5", "126", "90.0"]


def test_channels(command: Command) -> None:
    ran = command("channels")
    assert (ran.status, ran.err) == (0, "")
    for name in (*DEFAULT, "RootMyc1", "B1N1Alpha"):
        assert name in ran.out


def test_channels_by_a_word(command: Command) -> None:
    ran = command("channels", "--search", "Torsion")
    assert ran.status == 0
    names = [line.split("│")[1].strip() for line in ran.out.splitlines() if line.startswith("│")]
    assert "tower_base_moment_torsion" in names
    assert "tip_twist_1" in names  # by its description
    assert "wind_x" not in names
    assert "tip_out_of_plane_1" in command("channels", "--search", "tipdxc").out  # by a further name


@pytest.mark.parametrize("name", ["RootMyc1", "rootmyc1", "root_moment_out_of_plane_1", "RootMOoP1"])
def test_a_channel_is_explained(command: Command, name: str) -> None:
    ran = command("channels", "--explain", name)
    assert (ran.status, ran.err) == (0, "")
    assert ran.out.splitlines()[0] == "root_moment_out_of_plane_1"
    for part in (
        "RootMyc1",
        "also         RootMOoP1",
        "out-of-plane bending moment at the blade root",
        "N m (shown in kN m, times 0.001)",
        "coned blade axes",
        "about y: positive when thrust bends the blade downwind",
    ):
        assert part in ran.out


@pytest.mark.parametrize("name", ["power_coefficient", "RtAeroCp"])
def test_channels_of_a_power_coefficient_are_explained_and_listed(command: Command, name: str) -> None:
    ran = command("channels", "--explain", name)
    assert (ran.status, ran.err, ran.out.splitlines()[0]) == (0, "", "power_coefficient")
    assert "power_coefficient" in command("channels", "--search", name).out


@pytest.mark.parametrize("name", ["B3N20Alpha", "station_2_moment_y_1", "tower_station_1_moment_y", "pitch_rate_2"])
def test_channels_of_nodes_and_stations_are_explained_too(command: Command, name: str) -> None:
    ran = command("channels", "--explain", name)
    assert ran.status == 0
    assert name in ran.out


@pytest.mark.slow
def test_power_curve(command: Command, tmp_path: Path) -> None:
    ran = command("power-curve", "nrel5mw", "--wind-speeds", "8,12", "--out", tmp_path)
    succeeded(ran, tmp_path, "power_curve.csv", "power_curve.png")
    with (tmp_path / "power_curve.csv").open(newline="") as file:
        head, *rows = csv.reader(file)
    power = [float(row[head.index("power [kW]")]) for row in rows]
    assert [float(row[0]) for row in rows] == [8.0, 12.0]
    # NREL/TP-500-38060, figure 9-1: about 1.8 MW, and rated power
    assert power == pytest.approx([1770.0, 5000.0], rel=0.03)


@pytest.mark.slow
def test_power_curve_over_a_range(command: Command, tmp_path: Path) -> None:
    ran = command("power-curve", "nrel5mw", "--wind-speeds", "14:15:0.5", "--out", tmp_path)
    assert ran.status == 0
    speeds = [row.split(",")[0] for row in (tmp_path / "power_curve.csv").read_text().splitlines()[1:]]
    assert [float(u) for u in speeds] == [14.0, 14.5, 15.0]


@pytest.mark.slow
def test_campbell_at_standstill_is_the_published_table(command: Command, tmp_path: Path) -> None:
    ran = command("campbell", "nrel5mw", "--rotor-speeds", "0", "--out", tmp_path)
    succeeded(ran, tmp_path, "campbell.csv", "campbell.png")
    assert "at 0 rpm" in ran.out
    with (tmp_path / "campbell.csv").open(newline="") as file:
        found = {row["mode"]: float(row["frequency [Hz]"]) for row in csv.DictReader(file)}
    # NREL/TP-500-38060, table 9-1 (ADAMS)
    assert found["1st drivetrain torsion"] == pytest.approx(0.6094, rel=0.03)
    assert found["1st edge sine"] == pytest.approx(1.0740, rel=0.03)


@pytest.mark.long
def test_campbell_with_air(command: Command, tmp_path: Path) -> None:
    ran = command("campbell", "nrel5mw", "--wind-speeds", "8,16", "--out", tmp_path)
    succeeded(ran, tmp_path, "campbell.csv", "campbell.png")
    assert "1st flap backward whirl" in ran.out


@pytest.mark.parametrize("name", COMMANDS)
@pytest.mark.parametrize("flag", ["-h", "--help"])
def test_every_command_has_help(command: Command, name: str, flag: str) -> None:
    ran = command(name, flag)
    assert (ran.status, ran.err) == (0, "")
    assert "Usage: " in ran.out
    options = re.findall(r"--[a-z-]+", ran.out)
    assert "--help" in options
    assert ("--out" in options) is (name in WITH_FILES)


@pytest.mark.parametrize("arguments", [("--help",), ("-h",)])
def test_help_names_every_command(command: Command, arguments: tuple[str, ...]) -> None:
    ran = command(*arguments)
    assert (ran.status, ran.err) == (0, "")
    listed = re.findall(r"^  ([a-z-]+) +[A-Z]", ran.out, re.MULTILINE)
    assert set(COMMANDS) <= set(listed)


def test_without_a_command_there_is_help(command: Command) -> None:
    ran = command()
    assert "Usage: " in ran.out + ran.err
    assert "power-curve" in ran.out + ran.err


def test_version(command: Command) -> None:
    ran = command("--version")
    assert (ran.status, ran.out, ran.err) == (0, f"meltemi {meltemi.__version__}\n", "")


def test_the_installed_script_is_this_command_line() -> None:
    (script,) = entry_points(group="console_scripts", name="meltemi")
    assert script.load() is main


def registered(folder: Path, **commands: str) -> None:
    """A package that registers commands, as pip would leave it there."""
    info = folder / "guest-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: guest\nVersion: 1.0\n", encoding="utf-8")
    lines = [f"{name} = {where}" for name, where in commands.items()]
    (info / "entry_points.txt").write_text("\n".join(["[meltemi.commands]", *lines]), encoding="utf-8")
    code = 'def greet(name: str) -> None:\n    """Say hello."""\n    print("hello", name)\n'
    (folder / "guest_commands.py").write_text(code, encoding="utf-8")


def test_another_package_registers_a_command(command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    registered(tmp_path, greet="guest_commands:greet", lost="guest_commands:nothing", run="guest_commands:greet")
    monkeypatch.syspath_prepend(tmp_path)
    ran = command("greet", "wind")
    assert (ran.status, ran.out) == (0, "hello wind\n")
    listed = dict(re.findall(r"^  ([a-z-]+) +([A-Z].*)", command("--help").out, re.MULTILINE))
    assert listed["greet"] == "Say hello." and listed["lost"] == "Cannot be loaded."
    assert listed["run"].startswith("Simulate")  # ours stay ours
    ran = command("lost")
    assert ran.status == 2 and "guest_commands:nothing" in ran.err


def test_python_m_meltemi_is_the_same() -> None:
    ran = subprocess.run([sys.executable, "-m", "meltemi", "--version"], capture_output=True, text=True)
    assert (ran.returncode, ran.stdout, ran.stderr) == (0, f"meltemi {meltemi.__version__}\n", "")


@pytest.mark.slow
def test_an_interrupted_run_keeps_what_it_computed(
    command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    march = Simulation.advance

    def advance(self: Simulation, n_steps: int) -> None:
        if self.time > 2.0:
            raise KeyboardInterrupt
        march(self, n_steps)

    monkeypatch.setattr(Simulation, "advance", advance)
    ran = command("run", "nrel5mw", "--wind-speed", 10, "--duration", 1000, "--out", tmp_path)
    assert ran.status == 130
    assert re.match(r"the run ended early: at t = \d+\.\d+ s: interrupted by the user", ran.err)
    result = meltemi.io.read_netcdf(tmp_path / "result.nc")
    assert result.status is Status.INTERRUPTED
    assert 2.0 <= result.time[-1] < 1000.0
    assert np.isfinite(result.data).all()


def test_output_is_plain_text_where_no_terminal_is(tmp_path: Path) -> None:
    ran = subprocess.run([sys.executable, "-m", "meltemi.app.cli", "turbines"], capture_output=True, check=True)
    assert b"\x1b" not in ran.stdout + ran.stderr


def test_a_nacelle_turns_to_the_wind_of_a_file(command: Command, tmp_path: Path) -> None:
    """A wind of direction 270 deg meets a nacelle at 90 deg from its front; --direction turns that of a file."""
    wind, out = tmp_path / "side.wnd", tmp_path / "out"
    wind.write_text("0 9 250 0 0 0.2 0 0\n")
    base = ("run", "nrel5mw", "--wind-file", wind, "--direction", 20, "--duration", 1, "--out", out)
    ran = command(*base)
    assert ran.status == 2 and "across the rotor or from behind, 90 deg from its front" in ran.err
    ran = command(*base, "--yaw", 90)
    assert ran.status == 0, ran
    case = meltemi.io.read_case(out / "case.yaml")
    assert case.options.nacelle_yaw == pytest.approx(0.5 * math.pi)
    assert case.wind.direction == pytest.approx(math.radians(20.0))
    ran = command("run", out / "case.yaml", "--yaw", 5, "--out", out)
    assert ran.status == 2 and "choose another folder with --out" in ran.err


def test_a_run_of_a_deck_prints_what_was_ignored(command: Command, openfast_deck: Path, tmp_path: Path) -> None:
    folder = tmp_path / "deck"
    shutil.copytree(openfast_deck, folder)
    file = folder / "ElastoDyn.dat"
    file.write_text(re.sub(r"(?m)^ *0 +NacYaw(?!\S)", "10 NacYaw", file.read_text(), count=1))
    ran = command("run", folder / "5MW.fst", "--wind-speed", 9, "--duration", 1, "--out", tmp_path / "out")
    assert ran.status == 0, ran
    assert "ignored: " in ran.err and "NacYaw = 10 deg" in ran.err
    assert ran.err.count("meltemi import") == 1
