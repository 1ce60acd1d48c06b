"""The floating platform against OpenFAST's figures, which come with the package; the deck comes with rosco."""

from __future__ import annotations

import pytest

pytest.importorskip("rosco")

from meltemi_verification import floating
from meltemi_verification.known import KNOWN
from meltemi_verification.table import Verdict

pytestmark = pytest.mark.rosco


def test_decays_and_waves() -> None:
    rows = floating.floating().judged(KNOWN).rows
    assert [f"{row.what}, {row.case}: {row.deviation}" for row in rows if row.verdict is Verdict.FAIL] == []
    assert sum(row.verdict is Verdict.PASS for row in rows) > 50
