"""``meltemi inspect``: the same numbers as from Python, a page and a picture, errors in one line."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from terminal import Command

from meltemi import Turbine
from meltemi.io import write_turbine


@pytest.mark.long
def test_it_draws_and_prints(command: Command, tmp_path: Path) -> None:
    ran = command("inspect", "nrel5mw", "--out", tmp_path / "a" / "b")
    assert ran.status == 0 and ran.err == ""
    assert "12.1 rpm" in ran.out and "732.8 kN" in ran.out
    assert [f.name for f in ran.files] == ["turbine.html", "turbine.png"]
    assert all(f.stat().st_size > 100_000 for f in ran.files)
    page = ran.files[0].read_text(encoding="utf-8")
    assert page.count("<img") == 6 and "Missing data" not in page and "732.8 kN" in page
    assert not re.search(r'(?:src|href)="(?!data:|#)', page), "it opens offline"


@pytest.mark.long
def test_what_is_missing_is_said(command: Command, tmp_path: Path, turbine: Turbine) -> None:
    write_turbine(turbine.replace(n_blades=4), tmp_path / "mine.yaml")
    ran = command("inspect", tmp_path / "mine.yaml", "--out", tmp_path)
    assert ran.status == 0 and len(ran.files) == 2
    assert "missing: model: nrel5mw: n_blades: 4 blades" in ran.err
    page = ran.files[0].read_text(encoding="utf-8")
    assert "Missing data" in page and "4 blades; 2 and 3 are supported" in page


def test_a_folder_that_cannot_be_made(command: Command, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("x")
    ran = command("inspect", "nrel5mw", "--out", tmp_path / "file" / "out")
    assert ran.status == 2 and "cannot be written" in ran.err
