"""``meltemi climate``: a year of weather; the turbine's response is in closed form."""

from __future__ import annotations

import csv
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from terminal import Command

from meltemi.studies.climate import response
from meltemi.studies.climate.response import SLOPES, Response, ResponseSetup
from meltemi.turbine.definition import Turbine

HOURS = "temperature,humidity,pressure,wind_speed\n35,0.4,100000,8\n-10,0.4,100000,9\n5,0.4,,10\n"


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> list[ResponseSetup]:
    """Power and loads that go with density and wind; the list gets what was asked for."""
    found: list[ResponseSetup] = []

    def respond(turbine: Turbine, setup: ResponseSetup, **_: Any) -> Response:
        found.append(setup)
        v, d = np.array(setup.speeds), np.array(setup.densities)[:, None, None]
        power = d * v[:, None] ** 3 * np.ones(len(setup.seeds))
        points: Any = [SimpleNamespace(wind=SimpleNamespace(speed=x), rotor_speed=1.0, pitch=0.0) for x in v]
        loads = dict.fromkeys(SLOPES, power)
        return Response(turbine, setup, power, 0.0 * power, loads, {}, np.array([12.0, 11.5, 11.0]), tuple(points))

    monkeypatch.setattr(response, "respond", respond)
    return found


def test_a_year_of_hours(command: Command, tmp_path: Path, asked: list[ResponseSetup]) -> None:
    (tmp_path / "site.csv").write_text(HOURS)
    out = tmp_path / "out"
    ran = command("climate", "nrel5mw", "--climate", tmp_path / "site.csv", "--altitude", 300, "--out", out)
    assert (ran.status, ran.err) == (0, "")
    names = ("energy.csv", "loads.csv", "months.csv", "periods.csv", "climate.png")
    assert sorted(ran.files) == sorted(out / name for name in names) == sorted(out.iterdir())
    assert asked[0].states == () and asked[0].speeds[0] == 4.0 and asked[0].speeds[-1] == 24.0
    with (out / "periods.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [float(row["density [kg/m³]"]) for row in rows] == pytest.approx([1.1207, 1.3231, 1.2220], abs=1e-3)
    assert all(float(row["mean power [kW]"]) > 0.0 for row in rows)


def test_a_single_seed_has_no_interval(command: Command, tmp_path: Path, asked: list[ResponseSetup]) -> None:
    ran = command("climate", "nrel5mw", "--climate", "north_sea", "--seeds", 1, "--out", tmp_path)
    assert ran.status == 0 and len(asked[0].seeds) == 1
    assert "nan" not in ran.out and "±" not in ran.out
    assert "rated wind at 1.225 kg/m³ [m/s]" in ran.out
