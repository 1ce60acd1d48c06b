"""``meltemi yaw-limits``: limits of the yaw error from loads, and a case that runs with them."""

from __future__ import annotations

import csv
from pathlib import Path

import pytest
from terminal import Command

from meltemi.cases.case import LoadCase
from meltemi.core.yamlfile import read_record

FEW = ("--wind-speeds", "12,20", "--yaw-errors", "0,45", "--seeds", 1, "--duration", 10)


def test_yaw_limits_write_the_settings_of_the_supervisor(command: Command, tmp_path: Path) -> None:
    limit = "tower-top-shear=1.2,tower-base-bending=80"
    ran = command("yaw-limits", "nrel5mw", *FEW, "--load-limits", limit, "--strategy", "stop", "--out", tmp_path)
    warning = "warning: at 12 m/s loads exceed their limits at 0 deg already: no yaw error is allowed"
    assert (ran.status, ran.err.strip()) == (0, warning)
    names = ("yaw_limits.csv", "yaw_limits.png", "yaw_limits.yaml")
    assert sorted(ran.files) == sorted(tmp_path / name for name in names) == sorted(tmp_path.iterdir())
    assert "limits: tower top shear 1.2 MN; tower base bending 80 MN m" in ran.out
    rows = list(csv.DictReader((tmp_path / "yaw_limits.csv").read_text().splitlines()))
    assert [row["wind [m/s]"] for row in rows] == ["12", "20"]
    case = read_record(tmp_path / "yaw_limits.yaml", LoadCase)
    protection = case.controller.protection  # type: ignore[union-attr]
    assert protection is not None and protection.strategy == "stop" and case.options.yaw == "driven"
    assert protection.wind_speeds.tolist() == [12.0, 20.0]
    assert case.wind.speed == 12.0  # type: ignore[union-attr]
    allowed = [float(row["allowed [deg]"]) for row in rows]
    assert protection.thresholds * 57.29578 == pytest.approx(allowed, abs=0.06)
    assert allowed[0] >= allowed[1] and allowed[1] < 45.0


def test_a_limit_that_is_not_reached_is_said(command: Command, tmp_path: Path) -> None:
    """And the gust of the case ends at the cut-out wind speed, 15 m/s above 10."""
    few = ("--wind-speeds", "8,10,12", "--yaw-errors", "0,30", "--seeds", 1, "--duration", 10)
    ran = command("yaw-limits", "nrel5mw", *few, "--load-limits", "tower-top-shear=100", "--out", tmp_path)
    assert (ran.status, ran.err) == (0, "")
    assert "no limit is reached at 8, 10, 12 m/s: 30 deg is the largest of --yaw-errors" in ran.out
    assert read_record(tmp_path / "yaw_limits.yaml", LoadCase).wind.speed == 10.0  # type: ignore[union-attr]
