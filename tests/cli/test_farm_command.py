"""``meltemi farm``."""

from __future__ import annotations

import csv
from pathlib import Path

import pytest
from terminal import Command

from meltemi_farm.commands import _next, _row_case

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


def test_the_next_command_keeps_the_options_of_the_row() -> None:
    """So that it differs by the yaw angle alone."""
    given = {"--row": 3, "--spacing": 7.0}
    assert _next(_row_case("nrel5mw", given), "nrel5mw", given, Path("out"))[0] == "diff"
    given = {"--spacing": 7.0}
    words = _next(_row_case("nrel5mw", given), "nrel5mw", given, Path("out"))
    assert words == ("farm", "nrel5mw", "--spacing", 7.0, "--yaw", "20,0,0", "--out", "out-yawed")


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


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--row", "0"), "--row 0: expected 1 to 200 turbines"),
        (("--spacing", "1.5"), "--spacing 1.5: expected 2 rotor diameters or more"),
        (("--spacing", "nan"), "--spacing nan: expected 2 rotor diameters or more"),
        (("--wakes", "frandsen"), "fast.farm"),
        (("--yaw", "20"), "expected an angle for each of 3 turbines"),
    ],
)
def test_options_are_checked(command: Command, tmp_path: Path, options: tuple[str, str], words: str) -> None:
    ran = command("farm", "nrel5mw", *options, "--out", tmp_path / "out")
    assert ran.status == 2
    assert words in ran.err
    assert not (tmp_path / "out").exists()
