"""``meltemi bench-controller``: files, JSON, limits from a file, bad input."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from terminal import Command

from meltemi.tuning.controller_bench import study, suite
from meltemi.tuning.controller_bench.margins import Multisine

TINY = suite.Situation("normal turbulence", "NTM", "production", "NTM", (16.0, 18.0), 1, 5.0, 1.0)
OWN = "import meltemi\n\ndef controller(turbine):\n    return meltemi.control.BaselineController(turbine)\n"


@pytest.fixture
def tiny(monkeypatch: pytest.MonkeyPatch) -> list[bool]:
    """Two short runs a controller; whether the reduced suite was asked for."""
    asked = []

    def suite_of(turbine: Any, *, quick: bool = False) -> tuple[suite.Situation, ...]:
        asked.append(quick)
        return (TINY,)

    monkeypatch.setattr(study, "suite_of", suite_of)
    monkeypatch.setattr(study, "QUICK_SINE", Multisine(5.0, 5.0))
    return asked


@pytest.mark.slow
def test_two_controllers_and_limits_of_a_file(
    command: Command, tiny: list[bool], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.py").write_text(OWN)
    (tmp_path / "limits.yaml").write_text("over_speed: 1.0001\n")
    arguments = ("bench-controller", "mine:controller", "--quick", "--limits", "limits.yaml", "--out", "page", "--json")
    ran = command(*arguments)
    assert ran.status == 0, ran.err
    assert tiny == [True]
    printed = json.loads(ran.out)
    board, failing = printed["tables"]
    assert {row["controller"] for row in board["rows"]} == {"baseline (reference)", "mine:controller"}
    speeds = [row for row in failing["rows"] if row["criterion"] == "generator speed"]
    assert [row["verdict"] for row in speeds] == ["fail", "fail"]
    energy = next(row for row in failing["rows"] if row["criterion"] == "energy")
    assert energy["value"] == 0.0
    assert {Path(name).name for name in printed["files"]} >= {"bench.html", "bench.json", "runs.csv", "leaderboard.md"}
    assert "meltemi bench-controller" in (tmp_path / "page" / "bench.html").read_text()


@pytest.mark.slow
def test_controllers_follow_a_power_reference(command: Command, tiny: list[bool], tmp_path: Path) -> None:
    ran = command("bench-controller", "A2", "--power", "0.5", "--quick", "--out", tmp_path, "--json")
    assert ran.status == 0, ran.err
    board, _ = json.loads(ran.out)["tables"]
    assert {row["controller"] for row in board["rows"]} == {"A1 (reference)", "A2"}
    assert "tracking error" in (tmp_path / "runs.csv").read_text()


@pytest.mark.slow
def test_a_failed_run_is_reported_and_stops_no_other(
    command: Command, tiny: list[bool], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    body = "    def update(state, measured, demands, dt):\n        if measured.time > 2.0: raise ValueError('no')\n"
    (tmp_path / "fails.py").write_text(
        f"import meltemi\n\ndef controller(turbine):\n{body}    return meltemi.Controller(update)\n"
    )
    ran = command("bench-controller", "fails.py", "--quick", "--out", "page")
    assert ran.status == 1
    assert "2 runs did not reach their end" in ran.err
    assert "Failed runs" in (tmp_path / "page" / "bench.html").read_text()


def test_unknown_limit_names_the_nearest(command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "limits.yaml").write_text("overspeed: 1.2\n")
    ran = command("bench-controller", "ipc", "--limits", "limits.yaml")
    assert ran.status == 2
    assert "over_speed" in ran.err


def test_limits_may_have_units() -> None:
    assert suite.BenchLimits(phase_margin="45 deg").phase_margin == pytest.approx(0.7854, abs=1e-4)  # type: ignore[arg-type]


def test_the_class_changes_the_winds() -> None:
    import meltemi

    turbine = meltemi.load_turbine("nrel5mw")
    case = next(suite.cases_of((replace(TINY, seeds=1),)))
    assert case.wind(turbine, "IA").content_hash() != case.wind(turbine, "IIIC").content_hash()
