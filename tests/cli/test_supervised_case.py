"""A supervised case from the command line."""

from __future__ import annotations

from pathlib import Path

import pytest
from terminal import Command

from meltemi.io import read_case


@pytest.mark.slow
def test_it_starts_from_standstill_and_shows_its_log(command: Command, supervised_case: str, tmp_path: Path) -> None:
    path = tmp_path / "case.yaml"
    path.write_text(supervised_case, encoding="utf-8")
    ran = command("run", path, "--out", tmp_path / "out")
    assert ran.status == 0
    assert "standby -> start up" in ran.out
    again = read_case(tmp_path / "out" / "case.yaml")
    assert again.start == "standstill"
    assert again.controller == read_case(path).controller


def test_what_does_not_fit_is_one_line(command: Command, supervised_case: str, tmp_path: Path) -> None:
    path = tmp_path / "case.yaml"
    for old, new, words in (
        ("supervision: {start_time: 5.0}", "supervision: {start_wind: 24.0}", "start_wind 24 m/s is more than"),
        ("[0, 30]", "[30, 0]", "wind_speeds must increase"),
    ):
        path.write_text(supervised_case.replace(old, new), encoding="utf-8")
        ran = command("run", path, "--out", tmp_path / "none")
        assert ran.status == 2
        assert words in ran.err
        assert "Traceback" not in ran.err
        assert not (tmp_path / "none").exists()
