"""``meltemi stress``: what it prints and writes of results and load bases, and what it refuses."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from terminal import Command, refused

import meltemi
from meltemi import Result
from meltemi.simulation.channels import ChannelSet, catalogue

KNOWN = catalogue(ChannelSet(blade_stations=1, tower_stations=1))
TOWER = ("tower_base_moment_fore_aft", "tower_base_moment_side_side", "tower_base_force_z")
ROOT = tuple(
    f"root_{name}_1" for name in "force_flap force_edge force_z moment_edge moment_flap moment_torsion".split()
)
WINDIO = """\
name: round
components:
  blade: {}
"""
SANDWICH = """\
name: tube
position: {grid: [0, 1], values: [0, 61.5]}
chord: 2.0
offset_y: 1.0
thickness: 1.0
shapes: [{thickness: 1.0, coordinates: [[1, 0], [0.85, 0.35], [0.5, 0.5], [0.15, 0.35], [0, 0], [0.15, -0.35], [0.5,
  -0.5], [0.85, -0.35], [1, 0]]}]
materials:
  glass: {density: 1940, E1: 44e9, E2: 13e9, E3: 13e9, G12: 4.2e9, G13: 4.2e9, G23: 4.2e9, nu12: 0.28, nu13: 0.28,
    nu23: 0.4, Xt: 1e9, Xc: 7e8, Yt: 5e7, Yc: 1.5e8, S12: 7e7, fatigue_exponent: 10}
  foam: {density: 130, E1: 1.3e8, E2: 1.3e8, E3: 1.3e8, G12: 5e7, G13: 5e7, G23: 5e7, nu12: 0.3, nu13: 0.3, nu23: 0.3,
    Xt: 2e6, Xc: 2e6}
layers:
  - {name: outside, material: glass, thickness: 0.01}
  - {name: core, material: foam, thickness: 0.02}
  - {name: inside, material: glass, thickness: 0.01}
"""


@pytest.fixture
def run(tmp_path: Path) -> Path:
    time = np.arange(0.0, 60.01, 0.05)
    names = (*TOWER, *ROOT)
    waves = [(1.0 + 0.1 * i) * 3e7 * np.sin((1.0 + 0.2 * i) * time) for i in range(len(names))]
    meta = {"turbine": "nrel5mw", "stations": {"tower": [], "blade": []}}
    result = Result(time, np.stack(waves, axis=1), tuple(KNOWN[name] for name in names), meta=meta)
    return meltemi.write_result(result, tmp_path / "run.nc")


def test_welds_of_a_result(command: Command, tmp_path: Path, run: Path) -> None:
    out = tmp_path / "out"
    ran = command("stress", run, "--out", out)
    assert (ran.status, ran.err) == (0, "")
    assert ran.files == [out / "welds.csv", out / "welds.png"]
    assert ran.files[1].read_bytes().startswith(b"\x89PNG")
    with ran.files[0].open(newline="") as file:
        (row,) = csv.DictReader(file)
    assert (row["weld"], row["category"], row["loads at [m]"]) == ("0 m", "D, air", "0")
    assert float(row["wall [mm]"]) == pytest.approx(35.1, abs=0.01)
    assert float(row["life [years]"]) == pytest.approx(20.0 / float(row["damage"]))


def test_welds_of_a_file_with_factors(command: Command, tmp_path: Path, run: Path) -> None:
    welds = tmp_path / "welds.yaml"
    welds.write_text('edition: EN1993\nwelds: [{height: 0.0, name: foot, category: "71"}]\n', encoding="utf-8")

    def damage(*options: Any) -> float:
        ran = command("stress", run, run, "--welds", welds, "--out", tmp_path / "out", "--json", *options)
        assert ran.status == 0
        (table,) = json.loads(ran.out)["tables"]
        return float(table["rows"][0]["damage"])

    assert damage("--shares", "0.2,0.3") == pytest.approx(0.5 * damage())
    assert damage("--factors", "en1993-high") > 2.0 * damage()
    assert damage("--years", 10) == pytest.approx(0.5 * damage())


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--shares", "0.2"), "shares: expected 2, one for each result"),
        (("--factors", "en1993"), "factors 'en1993': "),
        (("--welds", "none.yaml"), "none.yaml: no such file"),
        (("--welds", "welds.yaml"), "has no curve '72'"),
        (("--turbine", "nrel5"), "did you mean 'nrel5mw'"),
        (("--layup", "layup.yaml"), "layup.yaml: "),
        (("--layup", "layup.yaml", "--welds", "welds.yaml"), "--welds and --layup: give one of them"),
        (("--years", "0"), "--years 0: expected more than 0"),
    ],
)
def test_bad_input(
    command: Command, tmp_path: Path, run: Path, monkeypatch: pytest.MonkeyPatch, options: tuple[str, ...], words: str
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("welds.yaml").write_text('edition: EN1993\nwelds: [{height: 0.0, category: "72"}]\n', encoding="utf-8")
    Path("layup.yaml").write_text(WINDIO, encoding="utf-8")
    refused(command("stress", run, run, *options, "--out", tmp_path / "out"), tmp_path / "out", words)


def test_a_result_without_loads_or_turbine(command: Command, tmp_path: Path) -> None:
    time = np.arange(0.0, 10.0, 0.1)
    bare = Result(time, np.zeros((len(time), 1)), (KNOWN["rotor_speed"],), meta={"turbine": "mine"})
    path = meltemi.write_result(bare, tmp_path / "bare.nc")
    out = tmp_path / "out"
    refused(command("stress", path, "--out", out), out, "its turbine 'mine' is not in the library", "--turbine FILE")
    refused(command("stress", path, "--turbine", "nrel5mw", "--out", out), out, "no bending moments of the tower")


def test_a_turbine_in_place_of_results(command: Command, tmp_path: Path) -> None:
    path = tmp_path / "turbine.yaml"
    path.write_text("name: mine\n", encoding="utf-8")
    words = "turbine.yaml: not a result", ".nc, .outb, .out, .csv", "folder of a load base", "--turbine"
    refused(command("stress", path, "--out", tmp_path / "out"), tmp_path / "out", *words)


def test_plies_of_a_result(command: Command, tmp_path: Path, run: Path) -> None:
    layup = tmp_path / "layup.yaml"
    layup.write_text(SANDWICH, encoding="utf-8")
    out = tmp_path / "out"
    ran = command("stress", run, "--layup", layup, "--out", out, "--factors", "none")
    assert ran.status == 0, ran.err
    assert ran.files == [out / "layers.csv", out / "layers.png", out / "panels.csv"]
    assert ran.err.split("is not given: ")[1].split() == ["glass"]  # slopes across the fibres
    with ran.files[0].open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert {row["layer"] for row in rows} == {"outside", "core", "inside"}
    assert {row["result"] for row in rows} == {"run.nc"}
    with ran.files[2].open(newline="") as file:
        faces = list(csv.DictReader(file))
    assert {(row["mode"], row["where"]) for row in faces} == {
        ("wrinkling", "suction side, core"),
        ("wrinkling", "pressure side, core"),
    }
    more = command("stress", run, "--layup", layup, "--out", out, "--factors", "none", "--load-factor", 2.7)
    with more.files[2].open(newline="") as file:
        assert float(next(csv.DictReader(file))["index"]) == pytest.approx(2.0 * float(faces[0]["index"]), rel=1e-3)


def test_a_folder_that_is_no_load_base(command: Command, tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    refused(command("stress", tmp_path / "empty", "--out", tmp_path / "out"), tmp_path / "out", "no load base")
    layup = tmp_path / "layup.yaml"
    layup.write_text(SANDWICH, encoding="utf-8")
    ran = command("stress", tmp_path / "empty", "--layup", layup, "--out", tmp_path / "out")
    refused(ran, tmp_path / "out", "no load base")
    ran = command("stress", tmp_path / "empty", "--shares", "1", "--out", tmp_path / "out")
    refused(ran, tmp_path / "out", "--shares: not with a load base")
