"""``meltemi verify`` skips what lacks a package, and shows and keeps what was computed."""

from __future__ import annotations

from pathlib import Path

import pytest
from terminal import Command

from meltemi.core.errors import InputError
from meltemi.verification.table import CheckStudy, CheckTable, relative


def test_what_was_computed_is_shown_and_kept_and_what_lacks_a_package_is_skipped_at_the_start(
    command: Command, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    def breaks() -> CheckTable:
        raise InputError("a broken study")

    row = relative("thing", "here", "N", 1.0, 1.001, 0.5)
    studies = (
        CheckStudy(1.0, lambda: CheckTable("example", "Example", "nobody", [row])),
        CheckStudy(1.0, breaks, "blades of another", ("windIO",)),
        CheckStudy(1.0, breaks),
    )
    monkeypatch.setattr("meltemi.verification.verification.FULL", studies)
    monkeypatch.setattr("meltemi.core.extras.installed", lambda name: False)
    ran = command("verify", "--out", str(tmp_path))
    assert ran.status == 2 and ran.err.startswith("skipped: blades of another: needs windIO, which is not installed")
    assert "error: a broken study" in ran.err and "Example" in ran.out and "1 pass" in ran.out
    assert "example,thing,here" in (tmp_path / "verification.csv").read_text(encoding="utf-8")
    monkeypatch.setattr("meltemi.verification.verification.FULL", studies[:2])
    assert command("verify", "--out", str(tmp_path)).status == 0


def test_a_folder_without_models_of_hawc2_is_named(command: Command, tmp_path: Path) -> None:
    ran = command("verify", "--hawc2", str(tmp_path), "--out", str(tmp_path))
    assert ran.status == 2 and "none of the main files DTU_10MW_RWT.htc" in ran.err
    assert list(tmp_path.iterdir()) == []


def test_a_folder_without_runs_of_frames_is_named(command: Command, tmp_path: Path) -> None:
    ran = command("verify", "--members", str(tmp_path), "--out", str(tmp_path))
    assert ran.status == 2 and "--members" in ran.err and "none of the runs series/J2_decay_dry" in ran.err
    assert list(tmp_path.iterdir()) == []
