"""Measured records of the V27 of the SWiFT site against simulations (docs/verification/field.md)."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest

from meltemi.validation.comparison import prediction_half
from meltemi.validation.reduction import STATISTICS
from meltemi.validation.simulations import simulate_records

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs/verification"


def rows() -> list[dict[str, str]]:
    with (DOCS / "field.csv").open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


@pytest.fixture(autouse=True)
def tools(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(ROOT / "tools")


def test_tables_of_the_page_are_those_of_the_file() -> None:
    from field_page import put

    page = (DOCS / "field.md").read_text(encoding="utf-8")
    assert put(page, rows()) == page
    assert put(page, [r | {"seed 1": "1.0"} if r["experiment"] == "deck" else r for r in rows()]) != page


@pytest.mark.long
@pytest.mark.reference
def test_two_records_have_the_deviations_of_the_page(reference: Path, tmp_path: Path) -> None:
    """One seed lies in the prediction interval of the five seeds of the page: 3.04 standard deviations."""
    import field_study
    from field_page import Study

    if not field_study.SWIFT.is_dir():
        pytest.skip(f"needs the records of the SWiFT site in {field_study.SWIFT}")
    page = Study(rows()).of
    base, records = field_study.simulator(tmp_path, seeds=1)
    names = field_study.compared_channels(base.settings)
    chosen = [r for r in records if r.file in ("neutral_03.csv", "stable_05.csv")]
    compared, failed = simulate_records(base, chosen, names)
    assert not failed and len(compared) == 2
    for each in compared:
        for channel in names:
            for statistic in field_study.SHOWN:
                measured, *seeds = page["deck", each.name.split(".csv")[0], channel, statistic]
                i = STATISTICS.index(statistic)
                assert each.measured.values[channel][i] == pytest.approx(measured, rel=1e-5)
                half = float(prediction_half(np.std(seeds, ddof=1), np.intp(len(seeds))))
                assert each.simulated[0].values[channel][i] == pytest.approx(np.mean(seeds), abs=half)
