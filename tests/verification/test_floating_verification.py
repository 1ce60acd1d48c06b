"""The floating platform against OpenFAST's figures, which come with the package; the deck comes with rosco."""

from __future__ import annotations

from pathlib import Path

import pytest

pytest.importorskip("rosco")

from comparisons import floating
from comparisons.known import KNOWN
from meltemi.verification.table import CheckVerdict

pytestmark = pytest.mark.rosco


def test_decays_and_waves() -> None:
    rows = floating.floating().judged(KNOWN).rows
    assert [f"{row.what}, {row.case}: {row.deviation}" for row in rows if row.verdict is CheckVerdict.FAIL] == []
    assert sum(row.verdict is CheckVerdict.PASS for row in rows) > 50


def test_under_rosco() -> None:
    """Its floating feedback acts on the nodding acceleration of the nacelle (record 83)."""
    rows = floating.in_wind().judged(KNOWN).rows
    assert [f"{row.what}, {row.case}: {row.deviation}" for row in rows if row.verdict is CheckVerdict.FAIL] == []
    assert sum(row.verdict is CheckVerdict.PASS for row in rows) > 50


@pytest.mark.reference
def test_in_turbulence_and_sea(reference: Path) -> None:
    """Under ROSCO, and with speed and pitch held: far within the bands of 2 and 3 %."""
    rows = floating.in_wind(reference / "openfast_offshore").rows
    some = [row for row in rows if row.case in floating.TURBULENT]
    assert len(some) > 30 and max(abs(row.deviation) for row in some) < 1.5
