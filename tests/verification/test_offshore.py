"""The monopile in waves against OpenFAST's figures, which come with the package; the deck comes with rosco."""

from __future__ import annotations

from pathlib import Path

import pytest

pytest.importorskip("windIO")

from meltemi_verification import offshore, offshore_wind
from meltemi_verification.known import KNOWN
from meltemi_verification.table import Verdict

pytestmark = pytest.mark.rosco


def test_frequencies_in_water_and_air() -> None:
    rows = offshore.frequencies().judged(KNOWN).rows
    assert [row for row in rows if row.verdict is Verdict.FAIL] == []
    given = [row for row in rows if "given" in row.case]
    assert len(given) == 6 and all(abs(row.deviation) < 0.15 for row in given)


def test_loads_in_waves() -> None:
    rows = offshore.waves().judged(KNOWN).rows
    assert [f"{row.what}, {row.case}: {row.deviation}" for row in rows if row.verdict is Verdict.FAIL] == []
    force = [row for row in rows if row.what.startswith("Hydro") and row.measure == "%"]
    assert force and all(abs(row.deviation) < 0.15 for row in force)


def test_in_wind_under_rosco() -> None:
    rows = offshore_wind.steady().judged(KNOWN).rows
    assert [f"{row.what}, {row.case}: {row.deviation}" for row in rows if row.verdict is Verdict.FAIL] == []
    means = [row for row in rows if row.what.endswith("mean") and row.case != "M4_18"]
    assert means and all(abs(row.deviation) <= 1.0 for row in means)


@pytest.mark.reference
def test_in_turbulence_and_sea(reference: Path) -> None:
    """Under ROSCO, in waves along the wind and from 60 degrees."""
    rows = offshore_wind.turbulent(reference / "openfast_offshore").judged(KNOWN).rows
    assert [f"{row.what}, {row.case}: {row.deviation}" for row in rows if row.verdict is Verdict.FAIL] == []
    assert sum(row.verdict is Verdict.PASS for row in rows) > 100
