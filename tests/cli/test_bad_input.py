"""What users get wrong: one clear message, no traceback, exit status 2, and nothing half-written."""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from ruamel.yaml import YAML
from terminal import STEADY, Command, refused

import meltemi
from meltemi import InputError, Model, RunError, Status, SteadyWind, Turbine

Content = dict[str, Any]
NAN = float("nan")


def named_line(message: str, path: Path, key: str) -> str:
    """The line of a file that a message about a key names."""
    match = re.search(rf"{re.escape(str(path))}:(\d+): {re.escape(key)}: ", message)
    assert match, message
    return path.read_text(encoding="utf-8").splitlines()[int(match[1]) - 1].strip()


# turbine files


@pytest.fixture
def described(turbine: Turbine, tmp_path: Path) -> Callable[[Callable[[Content], Any]], Path]:
    """A file of the reference turbine with a change."""

    def write(change: Callable[[Content], Any]) -> Path:
        content = turbine.content()
        change(content)
        path = tmp_path / "mine.yaml"
        with path.open("w", encoding="utf-8") as file:
            YAML(typ="safe", pure=True).dump(content, file)
        return path

    return write


@pytest.mark.slow
@pytest.mark.parametrize(
    ("change", "key", "said"),
    [
        pytest.param(
            lambda t: t["nacelle"].update(overhnag=5.0),
            "nacelle.overhnag",
            "unknown key; did you mean 'overhang'",
            id="key",
        ),
        pytest.param(
            lambda t: t["airfoils"]["du40"].update(lfit=[0.0]),
            "airfoils.du40.lfit",
            "did you mean 'lift'",
            id="deep key",
        ),
        pytest.param(
            lambda t: t["hub"].pop("mass"), "hub.mass", "missing ([kg; 2.5e3 to 1.2e5 at 100 m] mass.)", id="missing"
        ),
        pytest.param(
            lambda t: t["nacelle"].update(mass=-1.0),
            "nacelle.mass",
            "expected greater than or equal to 0, found -1.0 kg",
            id="mass",
        ),
        pytest.param(
            lambda t: t["blade"]["structure"]["mass"].__setitem__(7, -3.0),
            "blade.structure",
            "mass must be positive, but entry 8 is -3",
            id="mass of a station",
        ),
        pytest.param(
            lambda t: t["blade"]["aerodynamics"]["twist"].__setitem__(0, 13.0),
            "blade.aerodynamics",
            "twist is in radians and expected within +-1.60, but entry 1 is 13; if these are degrees",
            id="degrees",
        ),
        pytest.param(
            lambda t: t["blade"]["structure"]["position"].__setitem__(5, 0.0),
            "blade.structure",
            "position must increase from station to station, but station 6 (0 m) does not lie beyond station 5",
            id="stations",
        ),
        pytest.param(
            lambda t: t["airfoils"]["du40"].update({name: t["airfoils"]["du40"][name][3:] for name in POLAR}),
            "airfoils.du40",
            "angle_of_attack must cover -pi to pi (+-180 degrees), but goes from -2.7",
            id="polar",
        ),
        pytest.param(
            lambda t: t["tower"]["mass"].__setitem__(2, NAN),
            "tower.mass",
            "every entry must be a finite number; not so at entry 3",
            id="NaN in a list",
        ),
        pytest.param(
            lambda t: t["nacelle"].update(overhang=NAN), "nacelle.overhang", "expected a finite number", id="NaN"
        ),
        pytest.param(lambda t: t["hub"].update(mass="heavy"), "hub.mass", "expected a number", id="text"),
        pytest.param(
            lambda t: t["tower"].update(mass=3.0),
            "tower.mass",
            "expected a list of numbers, found a number",
            id="no list",
        ),
    ],
)
def test_a_turbine_file_is_refused_with_file_line_and_key(
    command: Command,
    tmp_path: Path,
    described: Callable[[Callable[[Content], Any]], Path],
    change: Callable[[Content], Any],
    key: str,
    said: str,
) -> None:
    path, out = described(change), tmp_path / "out"
    ran = command("run", path, "--wind-speed", 10, "--out", out)
    refused(ran, out, said)
    *parents, last = key.split(".")
    assert re.match(rf"({parents[-1]}|{last}):", named_line(ran.err, path, key))
    assert len(ran.err.splitlines()) == 1


POLAR = ("angle_of_attack", "lift", "drag", "moment")


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda t: t.update(n_blades=1), "n_blades: 1 blades; 2 and 3 are supported"),
    ],
)
def test_what_is_not_modelled_is_said(
    command: Command,
    tmp_path: Path,
    described: Callable[[Callable[[Content], Any]], Path],
    change: Callable[[Content], Any],
    said: str,
) -> None:
    ran = command("run", described(change), "--wind-speed", 10, "--out", tmp_path / "out")
    refused(ran, tmp_path / "out", said)


@pytest.mark.parametrize("name", ["run", "power-curve"])
def test_an_unknown_turbine_gets_the_closest(command: Command, tmp_path: Path, name: str) -> None:
    out = tmp_path / "out"
    wind = ("--wind-speed", 10) if name == "run" else ("--wind-speeds", 10)
    ran = command(name, "nrel5wm", *wind, "--out", out)
    refused(
        ran, out, "no turbine 'nrel5wm' in the library: did you mean 'nrel5mw'", "(or give the path of a .yaml file)"
    )
    assert not out.exists()


# case files


def case_message(command: Command, tmp_path: Path, text: str) -> str:
    """What is said about a case file, which is called FILE."""
    path, out = tmp_path / "a.yaml", tmp_path / "out"
    path.write_text(text, encoding="utf-8")
    ran = command("run", path, "--out", out)
    refused(ran, out)
    return ran.err.replace(str(path), "FILE")


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("duration: 5.0", "duratoin: 5.0", "FILE:3: duratoin: unknown key; did you mean 'duration'"),
        ("duration: 5.0", "", "FILE: duration: missing ([s; 1 to 1e5] duration.)"),
        ("duration: 5.0", "duration: 0.0", "FILE:3: duration: expected greater than 0, found 0.0"),
        ("duration: 5.0", "duration: -5.0", "FILE:3: duration: expected greater than 0, found -5.0"),
        ("duration: 5.0", "duration: .nan", "FILE:3: duration: expected a finite number"),
        ("speed: 10.0", "sped: 10.0", "FILE:2: wind.sped: unknown key; did you mean 'speed'"),
        ("speed: 10.0", "speed: 1000.0", "FILE:2: wind.speed: expected less than or equal to 100, found 1000.0"),
        (
            "kind: steady",
            "kind: stedy",
            "FILE:2: wind.kind: expected 'steady', 'turbulence', 'iec', 'file', 'bts', 'wnd', found 'stedy'",
        ),
        (
            "\nduration",
            "\noptions: {time_step: 0.0}\nduration",
            "FILE:3: options.time_step: expected greater than 0, found 0.0",
        ),
        ("\nduration", "\noptions: {time_step: -0.01}\nduration", "FILE:3: options.time_step: expected greater than 0"),
        (
            "\nduration",
            "\noptions:\n  flap_mods: 2\nduration",
            "FILE:4: options.flap_mods: unknown key; did you mean 'flap_modes'",
        ),
        ("\nduration", "\noutput_step: 0.0\nduration", "FILE:3: output_step: expected greater than 0, found 0.0"),
        ("\nduration", "\noutput_step: -0.05\nduration", "FILE:3: output_step: expected greater than 0, found -0.05"),
        ("\nduration", "\nchannels: []\nduration", "channels: name at least one"),
        ("\nduration", "\nchannels: RootMyc1\nduration", "FILE:3: channels: expected a"),
        ("\nduration", "\nduration: 4.0\nduration", "FILE: line 4, column 1: not valid YAML: found duplicate key"),
        ("{kind", "[kind", "not valid YAML"),
        (
            "duration: 5.0",
            "duration: 5.0\nevents:\n  - {at: 1, type: grid_loss}\n  - {at: 1, type: pitch_stuck, blade: 4}",
            "FILE:6: events.1.blade: expected less than or equal to 3, found 4",
        ),
        (
            "duration: 5.0",
            "duration: 5.0\nevents:\n  - {at: 9, type: grid_loss}",
            "FILE:5: events.0: at 9 s is not before the end of the run at 5 s (duration)",
        ),
        (
            "duration: 5.0",
            "duration: 5.0\nevents: [{at: 1, type: sensor_loss, sensor: generator_sped}]",
            "FILE:4: events.0.sensor: there is no sensor 'generator_sped'; did you mean 'generator_speed'",
        ),
        (
            "duration: 5.0",
            "duration: 5.0\nevents: [{at: 1, type: yaw_stuck}, {at: 2, type: yaw_stuck}]",
            "FILE: events.1 at 2 s and events.0, which acts from 1 s permanently, "
            "contradict each other (yaw drive stuck)",
        ),
        (
            "duration: 5.0",
            "duration: 5.0\nenvironment: {air_density: 1.225, air: {}}",
            "FILE:4: environment: give either air_density or air (temperature, humidity, altitude, pressure), not both",
        ),
        *(
            ("duration: 5.0", f"duration: 5.0\nenvironment: {{{weather}}}", f"FILE:4: environment.{said}\n")
            for weather, said in (
                ("air: {humidity: 40}", "air: humidity 40 is not between 0 and 1; if it is in percent, write 0.4"),
                ("air: {temperature: -300}", "air: temperature -300 degC is below absolute zero (-273.15 degC)"),
                ("air: {temperature: [1, 2]}", "air.temperature: expected a number, found [1, 2]"),
                (
                    "air: {temperature: {time: [0, 9, 5], value: [1, 2, 3]}}",
                    "air.temperature: time must not decrease, but entry 3 is 5 s",
                ),
                (
                    "air: {temperature: {time: [0], value: [1], valeu: [1]}}",
                    "air.temperature.valeu: unknown key; did you mean 'value'?",
                ),
                ("rain: {kind: hevy}", "rain.kind: no class of rain 'hevy'; did you mean 'heavy'?"),
            )
        ),
    ],
)
def test_a_case_file_is_refused_with_file_line_and_key(
    command: Command, tmp_path: Path, old: str, new: str, said: str
) -> None:
    assert said in case_message(command, tmp_path, STEADY.replace(old, new, 1))


FOUND_LATER = [
    ("turbine: nrel5wm", "did you mean 'nrel5mw'"),
    ("channels: [wind_x, RootMyc9]", "no channel 'RootMyc9': did you mean RootMyc1, RootMyc2, RootMyc3"),
    ("options: {time_step: 0.02}", "output_step 0.05 s is not a multiple of the time step 0.02 s; use 0.04 or 0.06 s"),
    ("events: [{at: 1.0, type: flap_stuck, blade: 2}]", "events.0.flap: there is no flap 1; nrel5mw has none"),
    ("options: {locked: [yow]}", "locked: no coordinate 'yow': did you mean 'yaw'"),
    (
        "environment: {rain: {kind: heavy, mode: integrated, diameter: 3.0}}",
        "environment.rain.mode, diameter: no effect on nrel5mw",
    ),
    ("options: {blade_nodes: [0.0, 30.0, 20.0, 40.0, 61.5]}", "blade_nodes"),
]


def with_line(line: str) -> str:
    """The steady case with one key set."""
    return STEADY.replace("turbine: nrel5mw", line) if line.startswith("turbine") else STEADY + line + "\n"


@pytest.mark.parametrize(("line", "said"), FOUND_LATER)
def test_what_only_the_turbine_shows_is_explained_with_the_case_file(
    command: Command, tmp_path: Path, line: str, said: str
) -> None:
    message = case_message(command, tmp_path, with_line(line))
    assert message.startswith("error: FILE: ")
    assert said in message


@pytest.mark.parametrize(
    "line", ["blade_stations: [-1.0]", "blade_stations: [100.0]", "tower_stations: [-1.0]", "tower_stations: [1000.0]"]
)
def test_stations_must_lie_on_the_blade_or_tower(command: Command, tmp_path: Path, line: str) -> None:
    assert line.split(":")[0] in case_message(command, tmp_path, with_line(line))


def test_a_missing_turbine_file_is_named(command: Command, tmp_path: Path) -> None:
    (tmp_path / "mine.yaml").touch()
    ran = command("run", tmp_path / "mien.yaml", "--wind-speed", 10, "--out", tmp_path / "out")
    refused(ran, tmp_path / "out", f"{tmp_path / 'mien.yaml'}: no such file; did you mean 'mine.yaml'?")


def test_a_missing_case_file_is_named(command: Command, tmp_path: Path) -> None:
    (tmp_path / "case.yaml").write_text(STEADY)
    ran = command("run", tmp_path / "caes.yaml", "--out", tmp_path / "out")
    refused(ran, tmp_path / "out", "caes.yaml: no such file; did you mean 'case.yaml'?")


@pytest.mark.slow
@pytest.mark.parametrize(
    "text", ["{turbine: nrel5mw, wind: {kind: steady, speed: 10.0}, duration: 5.0}", "'turbine': nrel5mw\n'wind': 3\n"]
)
def test_a_case_in_other_words_is_a_case(command: Command, tmp_path: Path, text: str) -> None:
    (tmp_path / "a.yaml").write_text(text)
    assert "give one of --wind-speed" not in command("run", tmp_path / "a.yaml", "--out", tmp_path / "out").err


@pytest.mark.parametrize(
    ("option", "said"),
    [
        (("--seed", 2), "--seed: the wind of the case, of kind steady, has no seed"),
        (("--start", "deck"), "--start deck: only available for OpenFAST decks"),
        (("--wind-speed", -3), "wind.speed: expected greater than or equal to 0, found -3"),
        (("--sea", "regular:4"), "expected significant wave height [m], peak period [s]"),
        (("--sea", "regluar:4,12"), "height and period of a regular wave, e.g. --sea regular:4,12"),
    ],
)
def test_options_that_do_not_go_with_a_case_file(
    command: Command, tmp_path: Path, option: tuple[str, Any], said: str
) -> None:
    (tmp_path / "a.yaml").write_text(STEADY)
    refused(command("run", tmp_path / "a.yaml", *option, "--out", tmp_path / "out"), tmp_path / "out", said)


def test_the_case_of_results_is_not_changed_by_options(command: Command, tmp_path: Path) -> None:
    (tmp_path / "case.yaml").write_text(STEADY)
    ran = command("run", tmp_path / "case.yaml", "--wind-speed", 8, "--out", tmp_path)
    assert ran.status == 2
    assert "options change it; choose another folder with --out" in ran.err
    assert (tmp_path / "case.yaml").read_text() == STEADY


# options


def test_shear_does_not_go_with_a_wind_file(command: Command, tmp_path: Path, bts: Callable[..., Path]) -> None:
    ran = command("run", "nrel5mw", "--bts", bts(), "--shear", 0.1, "--out", tmp_path / "out")
    refused(ran, tmp_path / "out", "--shear: a wind file defines shear")


def test_turbulence_does_not_go_with_a_wind_file(command: Command, tmp_path: Path, bts: Callable[..., Path]) -> None:
    ran = command("run", "nrel5mw", "--bts", bts(), "--turbulence", 0.1, "--duration", 5, "--out", tmp_path / "out")
    refused(ran, tmp_path / "out", "--turbulence")


def test_a_turbulent_field_without_end_is_refused(command: Command, tmp_path: Path) -> None:
    # its length grows with the width of the grid over the mean speed
    ran = command("run", "nrel5mw", "--wind-speed", 1e-300, "--turbulence", 0.1, "--out", tmp_path / "out")
    refused(ran, tmp_path / "out", "speed")


@pytest.mark.parametrize("speeds", ["4:x:2", "4,,6", "fast", "24:4:2", "4:24:-2", "4:24:0", "4:24", "0", "101", "-4,4"])
def test_speeds_of_a_power_curve(command: Command, tmp_path: Path, speeds: str) -> None:
    ran = command("power-curve", "nrel5mw", f"--wind-speeds={speeds}", "--out", tmp_path / "out")
    refused(ran, tmp_path / "out", f"--wind-speeds '{speeds}': expected ")


@pytest.mark.parametrize("speeds", ["nan", "90:200:50", "-4:4:4", "4:inf:1"])
def test_speeds_that_no_wind_has(command: Command, tmp_path: Path, speeds: str) -> None:
    ran = command("power-curve", "nrel5mw", f"--wind-speeds={speeds}", "--out", tmp_path / "out")
    refused(ran, tmp_path / "out", "--wind-speeds")


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("channels", "--explain", "RootMyc9"), "no channel 'RootMyc9': did you mean RootMyc1"),
        (("channels", "--search", "flux"), "--search 'flux': no channel name or description contains it"),
        (("template", "cas"), "template 'cas': did you mean 'case'?"),
        (
            ("template", "case", "--out", "nowhere/case.yaml"),
            "nowhere/case.yaml: cannot be written (the folder nowhere does not exist)",
        ),
    ],
)
def test_arguments_of_other_commands(
    command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, arguments: tuple[str, ...], said: str
) -> None:
    monkeypatch.chdir(tmp_path)
    refused(command(*arguments), tmp_path, said)


@pytest.mark.parametrize(
    "arguments", [("rnu", "nrel5mw"), ("run",), ("run", "nrel5mw", "--wind-sped", 3), ("run", "a", "b")]
)
def test_what_is_no_command_or_option(command: Command, arguments: tuple[str, ...]) -> None:
    ran = command(*arguments)
    assert (ran.status, ran.out) == (2, "")
    assert "Error: " in ran.err
    assert "Traceback" not in ran.err


@pytest.mark.parametrize("duration", [0, -600, "nan"])
def test_the_length_of_a_bench_is_looked_at_first(
    command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, duration: Any
) -> None:
    monkeypatch.setattr("meltemi.verification.bench.subprocess.run", lambda *_, **__: pytest.fail("began"))
    refused(command("bench", "--duration", duration), tmp_path, "duration")


# winds


@pytest.mark.parametrize(
    ("field", "duration", "said"),
    [
        (
            {"width": 100.0},
            5,
            "it is 100 m wide, the rotor needs 126.0 m; it reaches up to 115 m, the rotor to 153.0 m",
        ),
        ({"seconds": 10.0}, 5, "it is 10.0 s long, a run of 5 s needs 13."),
        ({}, 500, "a run of 500 s needs 508."),
        ({"hub": 120.0}, 5, "it was generated for a hub height of 120 m, the turbine's is 90.0 m"),
    ],
)
@pytest.mark.parametrize("by", ["option", "case"])
def test_a_wind_field_must_cover_the_run(
    command: Command,
    tmp_path: Path,
    bts: Callable[..., Path],
    field: dict[str, float],
    duration: float,
    said: str,
    by: str,
) -> None:
    path, out = bts("mine.bts", **field), tmp_path / "out"
    (tmp_path / "a.yaml").write_text(f"turbine: nrel5mw\nwind: {{kind: bts, file: mine.bts}}\nduration: {duration}\n")
    given = (tmp_path / "a.yaml",) if by == "case" else ("nrel5mw", "--bts", path, "--duration", duration)
    refused(command("run", *given, "--out", out), out, "mine.bts: the wind field does not cover the run: ", said)


@pytest.mark.slow
def test_the_longest_run_in_a_field_is_said_and_possible(
    command: Command, tmp_path: Path, bts: Callable[..., Path]
) -> None:
    path = bts(seconds=20.0)
    ran = command("run", "nrel5mw", "--bts", path, "--duration", 60, "--out", tmp_path / "out")
    longest = re.search(r"the longest run is ([\d.]+) s", ran.err)
    assert longest
    # it is given to a tenth of a second
    ran = command("run", "nrel5mw", "--bts", path, "--duration", float(longest[1]) - 0.05, "--out", tmp_path / "out")
    assert ran.status == 0


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("0 10 0 0 0 0.2 0 0\n4 nan 0 0 0 0.2 0 0\n", "speed: every entry must be a finite number; not so at entry 2"),
        ("0 10 0 0 0 0.2 0 0\n4 fast 0 0 0 0.2 0 0\n", ":2: expected numbers, found '4 fast"),
        ("0 10 0 0 0 0.2 0 0\n0 11 0 0 0 0.2 0 0\n", "time must increase, but row 2 (0 s) does not"),
        ("0 10 0\n", ":1: expected 8 or 9 numbers, found 3"),
        ("! nothing\n", "no rows of wind"),
    ],
)
def test_a_uniform_wind_file_is_refused_with_its_name(command: Command, tmp_path: Path, text: str, said: str) -> None:
    path, out = tmp_path / "gust.wnd", tmp_path / "out"
    path.write_text(text)
    refused(command("run", "nrel5mw", "--wnd", path, "--duration", 5, "--out", out), out, str(path), said)


@pytest.mark.parametrize("row", ["0 10 450 0 0 0.2 0 0", "0 150 0 0 0 0.2 0 0", "0 10 0 0 0 1.5 0 0"])
def test_a_uniform_wind_no_run_can_begin_in(command: Command, tmp_path: Path, row: str) -> None:
    path, out = tmp_path / "gust.wnd", tmp_path / "out"
    path.write_text(row + "\n")
    refused(command("run", "nrel5mw", "--wnd", path, "--duration", 5, "--out", out), out, "gust.wnd")


@pytest.mark.parametrize("data", [b"", b"text that is no wind field" * 10])
def test_a_broken_turbsim_file_is_refused_with_its_name(command: Command, tmp_path: Path, data: bytes) -> None:
    path, out = tmp_path / "field.bts", tmp_path / "out"
    path.write_bytes(data)
    refused(command("run", "nrel5mw", "--bts", path, "--out", out), out, f"{path}: not a TurbSim .bts file")


# output


@pytest.mark.parametrize("arguments", [("run", "nrel5mw", "--wind-speed", 10), ("power-curve", "nrel5mw"), ("verify",)])
@pytest.mark.parametrize("name", ["file", "file/deeper"])
def test_the_output_folder_must_be_one(command: Command, tmp_path: Path, arguments: tuple[Any, ...], name: str) -> None:
    (tmp_path / "file").write_text("mine")
    ran = command(*arguments, "--out", tmp_path / name)
    refused(ran, tmp_path / name, f"--out {tmp_path / name}: cannot be written (")
    assert (tmp_path / "file").read_text() == "mine"


@pytest.mark.slow
@pytest.mark.parametrize(
    "taken",
    [
        "result.nc",
        "result.png",
        "statistics.csv",
        "case.yaml",
    ],
)
def test_a_file_that_cannot_be_written_is_named(command: Command, tmp_path: Path, taken: str) -> None:
    (tmp_path / taken).mkdir()
    ran = command("run", "nrel5mw", "--wind-speed", 10, "--duration", 5, "--out", tmp_path)
    assert ran.status == 2
    assert ran.err.startswith(f"error: {tmp_path / taken}: cannot be written (")
    assert not list(tmp_path.glob(".*"))  # no remains of a file under way


@pytest.mark.slow
def test_results_of_an_earlier_run_survive_a_refused_one(command: Command, tmp_path: Path) -> None:
    command("run", "nrel5mw", "--wind-speed", 10, "--duration", 5, "--out", tmp_path)
    before = {path: path.read_bytes() for path in tmp_path.iterdir()}
    assert len(before) == 4
    for wrong in (("--duration", 0), ("--channels", "RootMyc9"), ("--turbulence", 3)):
        assert command("run", "nrel5mw", "--wind-speed", 10, *wrong, "--out", tmp_path).status == 2
    assert {path: path.read_bytes() for path in tmp_path.iterdir()} == before


# runs that stop


@pytest.mark.slow
def test_a_step_too_large_stops_the_run_and_keeps_what_was_computed(command: Command, tmp_path: Path) -> None:
    (tmp_path / "a.yaml").write_text(STEADY + "options: {time_step: 0.1}\noutput_step: 0.1\n")
    out = tmp_path / "out"
    ran = command("run", tmp_path / "a.yaml", "--out", out)
    assert ran.status == 1
    said = re.fullmatch(
        r"the run ended early: (at t = (\d\.\d+) s the motion diverged .*: try a smaller time step.* "
        r"\(worst: 'blade \d .*', q = \S+, dq/dt = \S+; time step 0\.1 s\); .*rotor faster than 1\.5 times .*)\n",
        ran.err,
    )
    assert said, ran.err
    assert sorted(out.iterdir()) == sorted(ran.files)
    assert len(ran.files) == 4
    result = meltemi.io.read_netcdf(out / "result.nc")
    assert result.status is Status.DIVERGED
    assert result.message == said[1]
    with pytest.raises(RunError, match="diverged"):
        result.raise_for_status()
    assert result.time[-1] == pytest.approx(float(said[2]) - 0.1)
    assert np.isfinite(result.data).all()
    # the run began well
    assert result["rotor_speed"][0] == pytest.approx(1.19, rel=0.01)


@pytest.mark.slow
def test_no_plot_of_another_run_is_left_beside_a_result(command: Command, tmp_path: Path) -> None:
    command("run", "nrel5mw", "--wind-speed", 10, "--duration", 5, "--out", tmp_path)
    ran = command("run", "nrel5mw", "--wind-speed", 10, "--duration", 0.02, "--out", tmp_path)
    assert sorted(tmp_path.iterdir()) == sorted(ran.files)


# tracebacks


@pytest.mark.long
@pytest.mark.parametrize("place", ["none", "first", "last"])
def test_a_traceback_is_there_for_those_who_ask(place: str) -> None:
    given = ["run", "nrel5wm", "--wind-speed", "10"]
    given = {"none": given, "first": ["--debug", *given], "last": [*given, "--debug"]}[place]
    ran = subprocess.run([sys.executable, "-m", "meltemi.app.cli", *given], capture_output=True, text=True)
    assert ran.returncode != 0
    assert "did you mean 'nrel5mw'" in ran.stderr
    assert ("Traceback (most recent call last)" in ran.stderr) is (place != "none")


# the same from Python


@pytest.mark.parametrize("value", [0.0, -1.0, NAN, float("inf")])
@pytest.mark.parametrize("name", ["duration", "output_step"])
def test_times_must_be_positive_numbers(model: Model, name: str, value: float) -> None:
    with pytest.raises(InputError, match=f"{name} must be a positive number of seconds, found "):
        meltemi.simulate(model, SteadyWind(speed=10.0), **{"duration": 5.0, name: value})


@pytest.mark.parametrize(
    ("channels", "said"),
    [
        (["wind_x", "RootMyc9"], "no channel 'RootMyc9': did you mean RootMyc1, RootMyc2, RootMyc3"),
        (["wind_X1"], "did you mean wind_x"),
        (["node_21_alpha_1"], r"Blade nodes are numbered 1 to 20\."),
        (["xyzzy"], r"no channel 'xyzzy': none of the \d+ valid names is close to it"),
        ("RootMyc1", "simulate: channels: expected a list of texts, found 'RootMyc1'"),
        ([], "no channels to record"),
    ],
)
def test_channels_must_exist(model: Model, channels: Any, said: str) -> None:
    with pytest.raises(InputError, match=said):
        meltemi.simulate(model, SteadyWind(speed=10.0), duration=5.0, channels=channels)


@pytest.mark.parametrize(
    ("icing", "words"),
    [
        ("{blades: [1, 4]}", ("icing.blades names blade 4", "blades 1 to 3")),
        ("{amount: -0.5}", ("icing.amount", "greater than or equal to 0", "-0.5")),
        ("{lift_penalty: 1.5}", ("icing.lift_penalty", "less than or equal to 1", "1.5")),
        ("{penalty_begin: 0.8}", ("penalty_begin 0.8 must not lie beyond penalty_full 0.5",)),
        ("{blades: []}", ("name at least one",)),
        ("{thickness: 0.1}", ("icing.thickness: unknown key",)),
    ],
)
def test_ice_that_cannot_be(command: Command, tmp_path: Path, icing: str, words: tuple[str, ...]) -> None:
    path, out = tmp_path / "iced.yaml", tmp_path / "out"
    path.write_text(STEADY + f"icing: {icing}\n", encoding="utf-8")
    refused(command("run", path, "--out", out), out, *words)


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (("power-curve", "nrel5mw", "--wind-speeds", "0.1"), "no steady operation"),
        (("campbell", "pmsg20mw", "--wind-speeds", "5"), "pmsg20mw"),
    ],
)
def test_a_refused_command_leaves_no_folder(
    command: Command, tmp_path: Path, arguments: tuple[Any, ...], reason: str
) -> None:
    out = tmp_path / "new" / "deep"
    refused(command(*arguments, "--out", out), out, reason)
    assert list(tmp_path.iterdir()) == []
    (tmp_path / "new").mkdir()
    refused(command(*arguments, "--out", out), out, reason)
    assert list(tmp_path.rglob("*")) == [tmp_path / "new"]  # which was there before


def test_no_folder_has_a_name_with_control_characters(command: Command, tmp_path: Path) -> None:
    out = tmp_path / "a\x1b[31mb"
    refused(command("power-curve", "nrel5mw", "--wind-speeds", "12", "--out", out), out, "control characters")
    assert list(tmp_path.iterdir()) == []
