"""``meltemi wind``: what it makes and writes, what it reads again, and what it refuses."""

from __future__ import annotations

import csv
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from ruamel.yaml import YAML
from terminal import Command, refused, succeeded

import meltemi
from meltemi import Turbine, WindSeries

FIELD = ("--points", 5, "--dt", 0.25, "--duration", 20)
"""A field that is made in no time."""
NTM = ("wind", "NTM", "--class", "IIB", "--speed", 20, *FIELD)
FIGURES = ("series.png", "spectra.png", "coherence.png", "section.png", "profile.png")


def table(folder: Path) -> dict[tuple[str, ...], dict[str, str]]:
    """Rows of the statistics by their first column, or their first two in a field."""
    with (folder / "statistics.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    keys = ("where", "component") if "where" in rows[0] else ("column",)
    return {tuple(row[k] for k in keys): row for row in rows}


@pytest.fixture
def no_pictures(monkeypatch: pytest.MonkeyPatch) -> None:
    """Pictures take most of the time; other tests look at them."""
    monkeypatch.setattr("meltemi.plots.plot_wind", lambda *_, **__: {})


# fields


@pytest.mark.slow
def test_a_field_of_the_standard(command: Command, tmp_path: Path, turbine: Turbine) -> None:
    out = tmp_path / "new" / "folder"
    ran = command(*NTM, "--seed", 1, "--out", out)
    succeeded(ran, out, "wind.bts", "statistics.csv", *FIGURES)
    assert "NTM, Kaimal turbulence 20 m/s, intensity 14.4 %, shear exponent 0.2, seed 1" in ran.out
    assert "planes every 0.25 s" in ran.out
    assert "5 rows from 1.8 m to 178.2 m, 5 columns across 151.2 m, carried at 20 m/s" in ran.out
    found = table(out)
    hub = found["hub", "u"]
    assert float(hub["mean [m/s]"]) == pytest.approx(20.0, abs=0.005)
    # class B: 0.14 (0.75 20 m/s + 5.6 m/s)
    assert float(hub["std [m/s]"]) == pytest.approx(2.884, abs=0.0006)
    assert float(hub["intensity [%]"]) == pytest.approx(14.42, abs=0.006)
    assert float(found["hub", "v"]["std [m/s]"]) == pytest.approx(0.8 * 2.884, abs=0.001)
    assert float(found["hub", "w"]["std [m/s]"]) == pytest.approx(0.5 * 2.884, abs=0.001)
    assert float(found["lowest of the grid", "u"]["mean [m/s]"]) == pytest.approx(20.0 * 0.02**0.2, abs=0.01)
    # the same as from Python
    wind = meltemi.iec_wind("NTM", wind_class="IIB", speed=20.0, points=5, dt=0.25, turbine=turbine)
    assert isinstance(wind, meltemi.TurbulentWind)
    box = meltemi.wind.generate_field(wind, turbine, 20.0)
    np.testing.assert_allclose(meltemi.read_wind(out / "wind.bts").velocity, box.velocity, atol=1e-3)


@pytest.mark.parametrize(
    ("file_format", "files", "read"),
    [
        ("bts", ("wind.bts",), "wind.bts"),
        ("bladed", ("wind.wnd", "wind.sum"), "wind.wnd"),
        ("hawc2", ("wind-u.bin", "wind-v.bin", "wind-w.bin", "wind.hawc2.yaml"), "wind-v.bin"),
        ("netcdf", ("wind.nc",), "wind.nc"),
    ],
)
@pytest.mark.usefixtures("no_pictures")
def test_a_written_field_has_the_same_statistics(
    command: Command, tmp_path: Path, file_format: str, files: tuple[str, ...], read: str
) -> None:
    a, b = tmp_path / "a", tmp_path / "b"
    succeeded(command(*NTM, "--format", file_format, "--out", a), a, *files, "statistics.csv")
    succeeded(command("wind", "--from", a / read, "--turbine", "nrel5mw", "--out", b), b, "statistics.csv")
    made, again = table(a), table(b)
    assert made.keys() == again.keys()
    for key, row in made.items():
        for name in list(row)[2:]:
            if row[name]:  # two of these formats hold whole numbers
                assert float(again[key][name]) == pytest.approx(float(row[name]), rel=2e-3, abs=2e-3), (key, name)


@pytest.mark.slow
def test_a_turbsim_file_needs_no_turbine(command: Command, tmp_path: Path, bts: Callable[..., Path]) -> None:
    out = tmp_path / "out"
    ran = command("wind", "--from", bts(), "--format", "netcdf", "--out", out)
    succeeded(ran, out, "wind.nc", "statistics.csv", *FIGURES)
    assert "field.bts" in ran.out
    # 1 m/s for half of the time
    assert float(table(out)["hub", "u"]["mean [m/s]"]) == pytest.approx(10.5, abs=0.01)
    assert float(table(out)["hub", "u"]["std [m/s]"]) == pytest.approx(0.5, abs=0.01)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("ETM", "--class", "IA", "--speed", 12), "ETM, Kaimal turbulence 12 m/s"),
        (("EWM1", "--class", "IIB"), "EWM1, Kaimal turbulence 34 m/s, intensity 11 %, shear exponent 0.11"),
        (("ewm50", "--class", "IIB"), "EWM50, Kaimal turbulence 42.5 m/s, intensity 11 %, shear exponent 0.11"),
        (("NTM", "--class", "IA+", "--edition", 4, "--speed", 20), "intensity 18.5 %"),
        (("NTM", "--intensity", 0.1, "--speed", 20, "--shear", 0, "--seed", 7), "intensity 10 %, shear exponent 0, se"),
    ],
)
@pytest.mark.usefixtures("no_pictures")
def test_turbulent_models(command: Command, tmp_path: Path, options: tuple[Any, ...], said: str) -> None:
    ran = command("wind", *options, *FIELD, "--out", tmp_path)
    succeeded(ran, tmp_path, "wind.bts", "statistics.csv")
    assert said in ran.out


@pytest.mark.usefixtures("no_pictures")
def test_settings_of_turbulence(command: Command, tmp_path: Path) -> None:
    options = ("--spectrum", "vonkarman", "--edition", 2, "--coherent", "all", "--width", 200, "--periodic")
    ran = command(*NTM, *options, "--unscaled", "--out", tmp_path)
    assert ran.status == 0, ran.err
    assert "von Karman turbulence 20 m/s, intensity 15 %" in ran.out
    assert "80 planes every 0.25 s (20 s)" in ran.out
    assert "5 columns across 200 m, periodic" in ran.out
    assert abs(float(table(tmp_path)["hub", "u"]["std [m/s]"]) - 3.0) > 0.01


@pytest.mark.usefixtures("no_pictures")
def test_a_field_through_a_measured_series(command: Command, tmp_path: Path) -> None:
    (tmp_path / "mast.csv").write_text("time [s],u [m/s]\n0,19\n5,21\n20,22\n")
    out = tmp_path / "out"
    assert command(*NTM, "--hub-series", tmp_path / "mast.csv", "--out", out).status == 0
    box = meltemi.read_wind(out / "wind.bts")
    inside = (box.passing >= 0.0) & (box.passing <= 20.0)
    expected = np.interp(box.passing[inside], [0.0, 5.0, 20.0], [19.0, 21.0, 22.0])
    np.testing.assert_allclose(box.velocity[inside, 2, 2, 0], expected, atol=0.02)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--gust", "ECD", "--sign", -1, "--begin", 5), "with IEC ECD- 20 m/s, at 5 s"),
        (("--gust", "EOG", "--edition", 2, "--years", 50, "--begin", 5), "with IEC EOG50 20 m/s, class IIB, edition 2"),
        (("--gust", "ECG", "--begin", 5, "--intensity", 0.1), "with IEC ECG 20 m/s"),
    ],
)
@pytest.mark.usefixtures("no_pictures")
def test_a_gust_on_turbulence(command: Command, tmp_path: Path, options: tuple[Any, ...], said: str) -> None:
    ran = command(*NTM, *options, "--out", tmp_path)
    succeeded(ran, tmp_path, "wind.bts", "statistics.csv")
    assert said in " ".join(ran.out.split())


# series and steady winds


@pytest.mark.parametrize(
    ("options", "column", "lowest", "highest"),
    [
        (("EOG", "--class", "IIB"), "hub speed", 10.61, 15.84),
        (("EOG", "--class", "IIB", "--edition", 2, "--years", 1, "--begin", 10), "hub speed", 10.36, 16.53),
        (("EDC", "--class", "IIB", "--sign", -1), "direction", -29.86, 0.0),
        (("ECD",), "direction", 0.0, 60.0),
        (("ECG",), "hub speed", 12.0, 27.0),
        (("EWSH", "--class", "IIB", "--sign", -1), "horizontal shear", -0.9905, 0.0),
        (("EWSV", "--class", "IIB"), "vertical shear", 0.0, 0.9905),
    ],
)
@pytest.mark.usefixtures("no_pictures")
def test_transients(
    command: Command, tmp_path: Path, options: tuple[Any, ...], column: str, lowest: float, highest: float
) -> None:
    a, b = tmp_path / "a", tmp_path / "b"
    succeeded(command("wind", *options, "--speed", 12, "--out", a), a, "wind.wnd", "statistics.csv")
    found = table(a)
    assert float(found[(column,)]["min"]) == pytest.approx(lowest, abs=0.006)
    assert float(found[(column,)]["max"]) == pytest.approx(highest, abs=0.006)
    assert found[("exponent",)]["std"] == "0"  # no rounding errors
    assert isinstance(meltemi.read_wind(a / "wind.wnd"), WindSeries)
    succeeded(command("wind", "--from", a / "wind.wnd", "--out", b), b, "statistics.csv")
    again = table(b)
    for key, row in found.items():
        for name in ("mean", "std", "min", "max"):
            assert float(again[key][name]) == pytest.approx(float(row[name]), rel=1e-3, abs=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("options", "speed"),
    [
        (("NWP", "--speed", 12), 12.0),
        (("EWM50", "--class", "IIB", "--steady"), 1.4 * 42.5),
        (("EWM1", "--class", "IIB", "--steady"), 0.8 * 1.4 * 42.5),
    ],
)
def test_steady_winds(command: Command, tmp_path: Path, options: tuple[Any, ...], speed: float) -> None:
    succeeded(command("wind", *options, "--out", tmp_path), tmp_path, "statistics.csv", "profile.png")
    assert float(table(tmp_path)[("hub speed",)]["mean"]) == pytest.approx(speed, abs=0.01)


def test_wind_at_the_hub(command: Command, tmp_path: Path) -> None:
    (tmp_path / "mast.csv").write_text("time [s],u [m/s],v [m/s],w [m/s]\n0,3,-4,1\n10,3,-4,1\n")
    out = tmp_path / "out"
    ran = command("wind", "--from", tmp_path / "mast.csv", "--format", "uniform", "--out", out)
    succeeded(ran, out, "wind.wnd", "statistics.csv", "series.png")
    found = table(out)
    assert found[("hub speed",)]["mean"] == "5"
    assert float(found[("direction",)]["mean"]) == pytest.approx(53.13, abs=0.01)  # to the right: clockwise
    assert found[("vertical",)]["mean"] == "1"


def test_no_picture_of_another_wind_is_left(command: Command, tmp_path: Path) -> None:
    assert command("wind", "NWP", "--speed", 12, "--out", tmp_path).status == 0
    ran = command("wind", "ECD", "--speed", 12, "--out", tmp_path)
    succeeded(ran, tmp_path, "wind.wnd", "statistics.csv", "series.png")


# what is wrong


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("a.bts", b"", "a.bts: not a TurbSim .bts file (only 0 bytes)"),
        ("a.bts", b"\x89PNG" * 50, "a.bts: not a TurbSim .bts file (its first number is"),
        ("a.wnd", b"", "a.wnd: no rows of wind"),
        ("a.wnd", b"0 10 0\n", "a.wnd:1: expected 8 or 9 numbers, found 3"),
        ("a.wnd", (-99).to_bytes(2, "little", signed=True) + bytes(200), "a.wnd: "),
        ("a.bin", b"", "expected the name of a file of HAWC2, such as a-u.bin"),
        ("a-u.bin", bytes(400), "a-"),
        ("a.nc", b"text", "a.nc: not a wind box of meltemi"),
        ("a.csv", b"", "a.csv: expected a row of names with units"),
        ("a.csv", b"time [s],u [m/s]\n0,9\n1,x\n", "a.csv:3: expected 2 numbers, found '1,x'"),
        ("a.csv", b"time [s],u [m/s]\n0,9\n0,9\n", "a.csv: time must increase, but entry 2"),
        ("a.txt", b"", "'.txt' is not the suffix of a wind file; did you mean '.bts'?"),
    ],
)
def test_files_of_other_kinds(command: Command, tmp_path: Path, name: str, content: bytes, said: str) -> None:
    (tmp_path / name).write_bytes(content)
    refused(command("wind", "--from", tmp_path / name, "--out", tmp_path / "out"), tmp_path / "out", said)


def test_a_truncated_field(command: Command, tmp_path: Path, bts: Callable[..., Path]) -> None:
    path, out = bts(), tmp_path / "out"
    path.write_bytes(path.read_bytes()[:5000])
    refused(command("wind", "--from", path, "--out", out), out, "field.bts: cut off: 5000 bytes, expected ")


def test_a_file_is_looked_at_as_it_is(command: Command, tmp_path: Path, bts: Callable[..., Path]) -> None:
    out = tmp_path / "out"
    ran = command("wind", "--from", bts(), "--class", "IIB", "--shear", 0, "--unscaled", "--width", 3, "--out", out)
    refused(ran, out, "--wind-class, --shear, --unscaled, --width: a wind file is used unchanged; omit these options")
    refused(command("wind", "--from", bts(), "--steady", "--out", out), out, "--steady: a wind file")
    refused(command("wind", "--from", bts(), "--format", "uniform", "--out", out), out, "field.bts is a field")


def test_a_hub_above_the_field(command: Command, tmp_path: Path, bts: Callable[..., Path], turbine: Turbine) -> None:
    content = turbine.replace(**{"tower.base_height": 150.0}).content()
    with (tmp_path / "high.yaml").open("w", encoding="utf-8") as file:
        YAML(typ="safe", pure=True).dump(content, file)
    ran = command("wind", "--from", bts(), "--turbine", tmp_path / "high.yaml", "--out", tmp_path / "out")
    refused(ran, tmp_path / "out", "lies outside the field, which reaches from 15 m to 165 m")


@pytest.mark.parametrize("arguments", [NTM, ("wind", "NWP", "--speed", 12)])
@pytest.mark.parametrize("name", ["file", "file/deeper"])
def test_the_folder_must_be_one(command: Command, tmp_path: Path, arguments: tuple[Any, ...], name: str) -> None:
    (tmp_path / "file").write_text("mine")
    ran = command(*arguments, "--out", tmp_path / name)
    assert (ran.status, ran.out) == (2, "")
    assert f"--out {tmp_path / name}: cannot be written (" in ran.err
    assert (tmp_path / "file").read_text() == "mine"


def test_an_interrupted_field_leaves_nothing(command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupt(*_: Any, **__: Any) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("meltemi.wind.generate_field", interrupt)
    ran = command(*NTM, "--out", tmp_path / "new" / "folder")
    assert (ran.status, ran.out, ran.err) == (130, "", "interrupted\n")
    assert list(tmp_path.iterdir()) == []


# case files


@pytest.mark.parametrize(
    ("wind", "said"),
    [
        ("{kind: iec}", r"a\.yaml:\d: wind\S*model: missing"),
        ("{kind: iec, model: NTN, speed: 9.0}", r"a\.yaml: .*unknown model 'NTN'; did you mean 'NTM'"),
        (
            "{kind: iec, model: NTM, wind_clas: IIB}",
            r"a\.yaml:2: wind\S*wind_clas: unknown key; did you mean 'wind_cla",
        ),
        ("{kind: iec, model: NTM, edition: 7}", r"a\.yaml:2: wind\S*edition: expected 2, 3 or 4, found 7"),
        ("{kind: iec, model: ECD, speed: 9.0, sign: 2}", r"a\.yaml:2: wind\S*sign: expected 1 or -1, found 2"),
        ("{kind: iec, model: EOG, wind_class: IIB, speed: 9.0, seed: 1}", r"a\.yaml: .*EOG .* has no argument 'seed'"),
        (
            "{kind: iec, model: NTM, wind_class: IIB, speed: 9.0, turbulence: {spectrm: mann}}",
            r"a\.yaml: .*has no argument 'spectrm'; did you mean 'spectrum'",
        ),
        (
            "{kind: iec, model: NTM, wind_class: IIB, speed: 9.0, seed: 1, turbulence: {seed: 2}}",
            r"a\.yaml: wind\.turbulence: seed is given twice",
        ),
        ("{kind: iek, model: NTM}", r"a\.yaml:2: wind.*'iek'.*"),
        ("{kind: file}", r"a\.yaml:2: wind\.file: missing \(Path, relative to the case file"),
        ("{kind: file, file: 3}", r"a\.yaml:2: wind\.file: expected a string, found 3"),
        (
            "{model: NTM}",
            r"a\.yaml:2: wind\.kind: missing \(one of 'steady', 'turbulence', 'iec', 'file', 'bts', 'wnd'\)",
        ),
        ("{kind: file, fil: a.bts}", r"a\.yaml:2: wind\.fil: unknown key; did you mean 'file'"),
        ("{kind: file, file: none.bts}", r"a\.yaml: .*none\.bts: cannot be read \(No such file"),
        ("{kind: file, file: a.yaml}", r"'\.yaml' is not the suffix of a wind file"),
        ("{kind: turbulence, speed: 9.0, intensity: 0.1, hubfile: x}", r"a\.yaml:2: wind\S*hubfile: unknown key; did"),
        ("{kind: turbulence, speed: 9.0, intensity: 0.1, hub_file: x.csv}", r"x\.csv: cannot be read \(No such file"),
        ("{kind: turbulence, speed: 9.0, intensity: 0.1, hub_file: bad.csv}", r"bad\.csv:3: expected 2 numbers"),
        ("{kind: turbulence, speed: 9.0, intensity: 0.1, points: 1}", r"a\.yaml:2: wind\S*points: expected greater"),
    ],
)
def test_winds_of_case_files(command: Command, tmp_path: Path, wind: str, said: str) -> None:
    (tmp_path / "bad.csv").write_text("time [s],u [m/s]\n0,9\n1,x\n")
    (tmp_path / "a.yaml").write_text(f"turbine: nrel5mw\nwind: {wind}\nduration: 5.0\n")
    ran = command("run", tmp_path / "a.yaml", "--out", tmp_path / "out")
    assert (ran.status, ran.out) == (2, "")
    assert "Traceback" not in ran.err
    assert re.search(said, ran.err), ran.err
    assert str(tmp_path / "a.yaml") in ran.err
    assert not (tmp_path / "out").exists()
