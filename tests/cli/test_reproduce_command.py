"""``meltemi reproduce``: what is refused, and that a quick look writes everything."""

from __future__ import annotations

import csv
import re
from dataclasses import replace
from importlib import import_module
from importlib.metadata import PackageNotFoundError
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from terminal import Command
from typer.testing import CliRunner

from meltemi import load_turbine
from meltemi.app.cli import app
from meltemi.core.errors import Status
from meltemi.core.yamlfile import write_record
from meltemi.papers.commands import STUDIES
from meltemi.papers.he2018.measures import harmonic_amplitude, percent
from meltemi.papers.study import Contents, Study
from meltemi.reports.blocks import Section, Table
from meltemi.simulation.channels import catalogue
from meltemi.simulation.result import Result
from meltemi.turbine.definition import Turbine


def test_the_comparison_with_rosco_requires_rosco(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    def missing(name: str) -> None:
        raise PackageNotFoundError(name)

    monkeypatch.setattr("meltemi.core.extras.distribution", missing)
    found = CliRunner().invoke(app, ["reproduce", "he2018", "--rosco", "--out", str(tmp_path / "out")])
    assert "pip install --no-deps" in str(found.exception)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("study", list(STUDIES))
def test_a_study_is_applied_to_another_turbine(
    command: Command, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, study: str
) -> None:
    """A separate page, without claims and without the paper's texts; the runs are not those of this test."""
    page = import_module(f"meltemi.papers.{study}.page")
    whole = page.STUDY.applied

    def short(turbine: Turbine) -> Study[Any]:
        found = whole(turbine)
        assert found.figures == {} and found.parts == () and found.texts == ()
        table = Table(["load"], [["1"]], "Loads")
        said = Contents("All of it.", {"loads": Section("Loads", [table])}, [("turbine", turbine.name)], [table])
        return replace(found, run=lambda **_: 0, contents=lambda *_: said)

    monkeypatch.setattr(page, "STUDY", replace(page.STUDY, applied=short))
    write_record(load_turbine("nrel5mw").replace(name="V 90/3"), tmp_path / "mine.yaml")
    ran = command("reproduce", study, "--turbine", tmp_path / "mine.yaml", "--quick", "--out", tmp_path)
    assert (ran.status, ran.err) == (0, "")
    name = f"{study}_V_90_3"
    assert {path.name for path in ran.files} == {"loads.csv", f"{name}.md", f"{name}.html"}
    text = (tmp_path / f"{name}.md").read_text(encoding="utf-8")
    assert "applied to V 90/3" in text and "Nothing here is a claim of the paper" in text and "verdict" not in text
    assert "few, short runs, for a first impression only" in text and "Figures" not in text


@pytest.mark.long
@pytest.mark.rosco
def test_the_comparison_with_rosco_writes_its_section(tmp_path: Path) -> None:
    arguments = ["reproduce", "he2018", "--rosco", "--quick", "--out", str(tmp_path)]
    found = CliRunner().invoke(app, arguments, catch_exceptions=False)
    assert found.exit_code == 0
    text = (tmp_path / "rosco.md").read_text(encoding="utf-8")
    assert text.startswith("## Beside ROSCO") and "Made with rosco 2." in text
    for i in (1, 2):
        with (tmp_path / f"rosco_{i}.csv").open(encoding="utf-8") as file:
            load = {row["scheme"]: row["RootMyc1 DEL"] for row in csv.DictReader(file)}
        assert load["cpc"] == load["ROSCO"] == ""
        assert all(load[scheme].startswith("-") for scheme in ("ipc", "ipc2", "cpfc", "ROSCO 1P", "ROSCO 1P, led"))


def test_the_amplitude_at_a_harmonic_is_that_of_the_azimuth() -> None:
    channels = catalogue()
    time = np.arange(0.0, 100.0, 0.05)
    azimuth = 1.2 * time + 0.3 * np.sin(0.1 * time)
    x = 5.0 + 2.0 * np.cos(azimuth - 0.7) + 0.5 * np.sin(2.0 * azimuth)
    result = Result(time, np.column_stack([azimuth, x]), (channels["azimuth"], channels["pitch_1"]), Status.OK, "", {})
    assert harmonic_amplitude(result, "pitch_1", 1) == pytest.approx(2.0, rel=0.02)
    assert harmonic_amplitude(result, "pitch_1", 2) == pytest.approx(0.5, rel=0.05)


def test_changes_are_given_with_their_interval() -> None:
    assert percent(np.array([-10.0])) == "-10.0 %"
    assert percent(np.array([-10.0, -12.0, -11.0])) == "-11.0 ± 2.5 %"


@pytest.mark.long
def test_a_quick_look_writes_every_table_and_figure(tmp_path: Path) -> None:
    found = CliRunner().invoke(app, ["reproduce", "he2018", "--quick", "--out", str(tmp_path)], catch_exceptions=False)
    assert found.exit_code == 0
    for name in ("claims", "ceilings", "gains", "division", "best_1", "rivals", "travel", "lifetime"):
        with (tmp_path / f"{name}.csv").open(encoding="utf-8") as file:
            rows = list(csv.reader(file))
        assert len(rows) > 2 and all(len(row) == len(rows[0]) for row in rows)
    figures = {int(m[1]) for path in tmp_path.glob("*.png") if (m := re.match(r"fig(\d+)_", path.name))}
    assert figures == {4, 5, 6, 7, 8, 9, 10, 11, 12}
    page = (tmp_path / "he2018.html").read_text(encoding="utf-8")
    assert page.count("data:image/png;base64") >= 11
    assert not re.search(r'(?:src|href)="(?!data:|#)', page), "it opens offline"
    for path in (tmp_path / "he2018.html", tmp_path / "claims.csv"):
        assert str(path) in found.output.replace("\n", "")
