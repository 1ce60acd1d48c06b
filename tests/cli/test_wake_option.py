"""The option ``--wake``, and what a run with a vortex wake writes."""

from __future__ import annotations

import csv
from pathlib import Path

import pytest
from terminal import Command

import meltemi

CASE = """\
turbine: nrel5mw
wind: {kind: steady, speed: 10.0}
duration: 6.0
start: {rotor_speed: 11.2 rpm, pitch: 0.0, undeflected: true}
"""


def test_an_unknown_wake_is_refused_with_the_choices(command: Command, tmp_path: Path) -> None:
    ran = command("run", "nrel5mw", "--wind-speed", 10, "--wake", "olaf", "--out", tmp_path)
    assert ran.status == 2
    assert ran.err == "error: --wake 'olaf': expected momentum, near, hybrid, free or none\n"
    assert not list(tmp_path.iterdir())


def test_no_wake_is_an_option_of_runs_and_needs_no_comparison(command: Command, tmp_path: Path) -> None:
    ran = command("run", "nrel5mw", "--wind-speed", 10, "--wake", "none", "--duration", 1, "--out", tmp_path)
    assert ran.status == 0, ran.err
    assert "wake: none" in (tmp_path / "case.yaml").read_text()
    assert not (tmp_path / "momentum.csv").exists()
    assert not (tmp_path / "turbine.html").exists()


@pytest.mark.long
def test_a_vortex_wake_is_drawn_and_compared_with_momentum(command: Command, tmp_path: Path) -> None:
    (tmp_path / "case.yaml").write_text(CASE)
    out = tmp_path / "out"
    ran = command("run", tmp_path / "case.yaml", "--wake", "hybrid", "--out", out)
    assert ran.status == 0, ran.err
    assert "Vortex wake (hybrid) beside momentum theory" in ran.out
    assert "of the azimuth of blade 1, which is 0 where it points up" in ran.out
    with (out / "momentum.csv").open() as file:
        rows = {(row["quantity"], row["part"]): row for row in csv.DictReader(file)}
    power = rows["electrical power", "mean"]
    ours, theirs = float(power["vortex wake"]), float(power["momentum"])
    assert 0.7 < ours / theirs < 1.4
    assert float(power["difference"]) == pytest.approx(ours - theirs)
    assert ("flapwise bending moment at the blade root", "sine of the azimuth") in rows
    assert meltemi.read_result(out / "result.nc").scene.about["vortices"]["lines"] == 4
    assert (out / "turbine.html").stat().st_size < 2e6
    assert "wake: hybrid" in (out / "case.yaml").read_text()
    again = command("run", tmp_path / "case.yaml", "--duration", 1, "--out", out)
    assert again.status == 0, again.err
    assert not (out / "momentum.csv").exists()
