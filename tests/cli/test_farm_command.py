"""``meltemi farm``."""

from __future__ import annotations

import csv
import re
from collections.abc import Callable
from pathlib import Path

import pytest
from terminal import Command

from meltemi.farm.commands import _next, _row_case

LAYOUT = """\
turbine: nrel5mw
positions: [[0, 0], [630, 0]]
wind: {kind: steady, speed: 9.0}
duration: 10
wakes: {added_turbulence: false}
channels: [wind_x, generator_power, root_moment_out_of_plane_1, tower_base_moment_fore_aft]
"""


@pytest.mark.slow
def test_a_farm_of_a_file_writes_table_figure_and_results(command: Command, tmp_path: Path) -> None:
    layout, out = tmp_path / "layout.yaml", tmp_path / "out"
    layout.write_text(LAYOUT)
    ran = command("farm", layout, "--out", out)
    assert ran.status == 0, ran
    names = ("turbine_1.nc", "turbine_2.nc", "farm.csv", "farm.png", "farm.yaml")
    assert sorted(ran.files) == sorted(out / name for name in names)
    rows = list(csv.DictReader((out / "farm.csv").read_text().splitlines()))
    assert [row["turbine"] for row in rows] == ["T1", "T2", "farm"]
    change = [float(row["power [%]"]) for row in rows]
    assert change[0] == 0.0
    assert change[1] < -40.0 < change[2] < -15.0


@pytest.mark.slow
def test_shards_of_a_wind_rose_share_a_folder_and_the_last_one_writes_the_tables(
    command: Command, tmp_path: Path
) -> None:
    layout, rose, out = tmp_path / "layout.yaml", tmp_path / "rose.csv", tmp_path / "year"
    layout.write_text(LAYOUT.replace("steady, speed: 9.0", "turbulence, speed: 9.0, intensity: 0.1"))
    rose.write_text("wd,ws,freq_val\n0,9,0.4\n270,9,0.6\n")
    first = command("farm", layout, "--rose", rose, "--shard", "1/2", "--out", out)
    assert first.status == 0 and "1 of 2 winds are those of other shards" in first.out, first
    assert not [*out.glob("*.csv")]
    last = command("farm", layout, "--rose", rose, "--shard", "2/2", "--out", out)
    assert last.status == 0, last
    assert sorted(last.files) == [out / "rose.csv", out / "sectors.csv", out / "turbines.csv"]
    rows = list(csv.DictReader((out / "turbines.csv").read_text().splitlines()))
    loss = [float(row["wake loss [%]"]) for row in rows]
    assert [row["turbine"] for row in rows] == ["T1", "T2", "farm"]
    assert abs(loss[0]) < 2.0 and loss[1] > 20.0  # the second is in the wake of the first in 60 % of the time
    assert command("farm", layout, "--shard", "1/2", "--out", out).status == 2


def test_the_next_command_keeps_the_options_of_the_row() -> None:
    """So that it differs by the yaw angle alone."""
    given = {"--row": 3, "--spacing": 7.0}
    assert _next(_row_case("nrel5mw", given), "nrel5mw", given, Path("out"))[0] == "diff"
    given = {"--spacing": 7.0}
    words = _next(_row_case("nrel5mw", given), "nrel5mw", given, Path("out"))
    steered = ("--yaw", "20,0,0", "--against", Path("out"), "--out", "out-yawed")
    assert words == ("farm", "nrel5mw", "--spacing", 7.0, *steered)
    given = {"--added-turbulence": False}
    words = _next(_row_case("nrel5mw", given), "nrel5mw", given, Path("out"))
    assert words == ("farm", "nrel5mw", "--no-added-turbulence", *steered)


@pytest.mark.long
def test_another_run_is_compared_turbine_by_turbine(command: Command, tmp_path: Path) -> None:
    """With a folder, and with the farm file of the same run: the same table; without the run without wakes."""
    layout, base, steered = tmp_path / "layout.yaml", tmp_path / "base", tmp_path / "steered"
    layout.write_text(LAYOUT)
    assert command("farm", layout, "--no-alone", "--out", base).status == 0
    (tmp_path / "steered.yaml").write_text(f"{LAYOUT}yaw: [20 deg, 0]\n")
    tables = []
    for other in (base, layout):
        ran = command("farm", tmp_path / "steered.yaml", "--against", other, "--out", steered)
        assert ran.status == 0, ran
        assert "differs from" in ran.out and "in: yaw" in ran.out
        assert {steered / "against.csv", steered / "against.png"} < set(ran.files)
        count, seconds, took, times, each = re.findall(
            r"(\d) runs? of 2 turbines, (\d+) s of the farm in ([\d.]+) s: ([\d.]+) times real time, ([\d.]+) for a",
            ran.out,
        )[0]
        assert int(seconds) == 10 * int(count) and float(each) == pytest.approx(2.0 * float(times), rel=0.01)
        assert float(seconds) / float(times) == pytest.approx(float(took), abs=0.06)  # printed with one digit
        tables.append((steered / "against.csv").read_text())
        assert "power [%]" not in (steered / "farm.csv").read_text()
    assert tables[0] == tables[1]
    first, second, farm = (float(row["power change [%]"]) for row in csv.DictReader(tables[0].splitlines()))
    assert first < -5.0 and second > 5.0 and first < farm < second


@pytest.mark.parametrize(
    ("other", "words"),
    [("nowhere", "expected the output folder of meltemi farm"), ("three.yaml", "has 3 turbines and this farm 2")],
)
def test_what_cannot_be_compared_is_refused_before_the_run(
    command: Command, tmp_path: Path, other: str, words: str
) -> None:
    layout = tmp_path / "layout.yaml"
    layout.write_text(LAYOUT)
    (tmp_path / "three.yaml").write_text(LAYOUT.replace("[630, 0]", "[630, 0], [1260, 0]"))
    ran = command("farm", layout, "--against", tmp_path / other, "--out", tmp_path / "out")
    assert ran.status == 2 and words in ran.err
    assert not (tmp_path / "out").exists()


def test_options_of_a_row_reach_its_case(tmp_path: Path) -> None:
    case = _row_case("nrel5mw", {"--added-turbulence": False, "--wakes": "keck"})
    assert (case.wakes.model, case.wakes.added_turbulence) == ("keck", False)
    assert _row_case("nrel5mw", {}).wakes.added_turbulence
    case = _row_case("nrel5mw", {"--wind-file": tmp_path / "a.bts", "--row": 2})
    assert (case.wind.kind, case.wind.file) == ("file", str(tmp_path / "a.bts"))
    assert case.positions == ((-630.0, 0.0), (0.0, 0.0))  # upwind of where the field begins


@pytest.mark.slow
def test_a_farm_in_the_wind_of_a_file(command: Command, tmp_path: Path, bts: Callable[..., Path]) -> None:
    field, out = bts(seconds=100.0), tmp_path / "out"
    ran = command(
        "farm", "nrel5mw", "--row", 2, "--wind-file", field, "--duration", 8, "--no-added-turbulence", "--out", out
    )
    assert ran.status == 0, ran
    assert "no added turbulence: " in ran.out
    change = [float(row["power [%]"]) for row in csv.DictReader((out / "farm.csv").read_text().splitlines())]
    assert change[0] == 0.0 and change[1] < -30.0


@pytest.mark.parametrize(
    ("before", "after", "words"),
    [
        ("[630, 0]", "[600, 0], [700, 0]", "turbines 2 and 3 are 100 m apart, expected at least 252 m"),
        ("added_turbulence: false", "model: fast-farm", "fast.farm"),
        ("positions", "position", "positions"),
        ("[0, 0]", "[0, 0, 5]", "layout.yaml:2: positions: turbine 1: expected two numbers, x and y in m"),
        ("[630, 0]]", "[630, 0]]\nyaw: [20, 0]", "20 deg"),
    ],
)
def test_mistakes_are_answered_in_words(command: Command, tmp_path: Path, before: str, after: str, words: str) -> None:
    layout, out = tmp_path / "layout.yaml", tmp_path / "out"
    layout.write_text(LAYOUT.replace(before, after))
    ran = command("farm", layout, "--out", out)
    assert ran.status == 2
    assert words in ran.err
    assert not out.exists()


def test_options_beside_the_file_of_a_farm_are_named(command: Command, tmp_path: Path) -> None:
    (tmp_path / "layout.yaml").write_text(LAYOUT)
    ran = command("farm", tmp_path / "layout.yaml", "--no-added-turbulence", "--out", tmp_path / "out")
    assert ran.status == 2 and "remove --no-added-turbulence" in ran.err


@pytest.mark.slow
def test_the_template_of_a_farm_runs(command: Command, tmp_path: Path) -> None:
    path = tmp_path / "farm.yaml"
    ran = command("template", "farm", "--out", path)
    assert (ran.status, ran.files) == (0, [path]) and f"meltemi farm {path}" in ran.out
    text = path.read_text(encoding="utf-8").replace("duration: 600.0", "duration: 4.0")
    path.write_text(text.replace("transient: 30.0", "transient: 0.0").replace("\n  - [1260, 0]", ""), encoding="utf-8")
    assert command("farm", path, "--no-alone", "--out", tmp_path / "out").status == 0
