"""Every study of ``meltemi verify``, and those with stored runs, pass within their bands or their known deviations."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from comparisons import reference_table, thinned
from comparisons import studies as stored
from comparisons.known import KNOWN
from comparisons.turbulent import reference_series, short_series, short_wind, turbulence
from meltemi.app.cli import main
from meltemi.turbine.library import _from_library
from meltemi.verification.table import (
    Check,
    CheckStudy,
    CheckTable,
    CheckVerdict,
    KnownDeviation,
    VerificationReport,
    relative,
)
from meltemi.verification.verification import FULL, QUICK
from meltemi.wind_files import read_bts, read_wnd

ALL = (*QUICK, *stored.QUICK, *FULL[len(QUICK) :], *stored.LAND[len(stored.QUICK) :])
N_QUICK = len(QUICK) + len(stored.QUICK)
LONG_QUICK, LONG = 10.0, 3.0
"""[s] from which a study, of the quick look or not, is left to the tests that take long."""


def studies(begin: int, end: int, seconds: float) -> list[Any]:
    return [pytest.param(k, marks=[pytest.mark.long] * (ALL[k].seconds >= seconds)) for k in range(begin, end)]


def complaints(comparison: CheckTable) -> list[str]:
    judged = comparison.judged(KNOWN)
    return [
        f"{r.what}, {r.case}: {r.deviation:+.2f} {r.measure}, band {r.band:g}"
        for r in judged.rows
        if r.verdict is CheckVerdict.FAIL
    ]


@pytest.fixture
def bare(monkeypatch: pytest.MonkeyPatch, study: int) -> None:
    """Only the optional packages are there that the study says it needs."""
    monkeypatch.setattr("meltemi.core.extras.installed", lambda name: name in ALL[study].needs)
    _from_library.cache_clear()


@pytest.mark.slow
@pytest.mark.usefixtures("bare")
@pytest.mark.parametrize("study", studies(0, N_QUICK, LONG_QUICK))
def test_quick_study(study: int) -> None:
    comparison = ALL[study].compare()
    assert len(comparison.rows) > 0
    assert complaints(comparison) == []


@pytest.mark.slow
@pytest.mark.usefixtures("bare")
@pytest.mark.parametrize("study", studies(N_QUICK, len(ALL), LONG))
def test_full_study(study: int) -> None:
    assert complaints(ALL[study].compare()) == []


@pytest.mark.slow
@pytest.mark.reference
@pytest.mark.parametrize("aero", ["A", pytest.param("B", marks=pytest.mark.long)])
def test_ten_minutes_of_turbulence(aero: str, reference: Path) -> None:
    assert complaints(turbulence(aero, reference)) == []


@pytest.mark.reference
def test_thinned_data_are_those_of_the_runs(reference: Path) -> None:
    """Within half a step of rounding, in the same units."""
    for aero in "AB":
        short, whole = short_series(aero), reference_series(reference, f"{aero}_turb_vkm20_s1")
        rows = slice(400, 1301, 2)
        for name, x in short.items():
            y = whole[name][rows]
            np.testing.assert_allclose(x, y, rtol=1e-6, atol=2.6e-4 * np.ptp(y))
    ours, box = short_wind(), read_bts(reference / "openfast/wind/vkm20_s1.bts")
    near, same = thinned("turbulent_wind")["near"], "dt dy dz bottom speed hub_height periodic direction".split()
    assert [getattr(ours, name) for name in same] == pytest.approx([getattr(box, name) for name in same], rel=1e-6)
    np.testing.assert_allclose(ours.velocity[:, near], box.velocity[:700, near], atol=0.0501)
    gust = read_wnd(reference / "openfast/wind/eog12.wnd")
    table = [[float(r["time"]), float(r["gust"])] for r in reference_table("gust_wind")]
    np.testing.assert_array_equal(np.column_stack([gust.time, gust.gust])[1:-1], table)


def test_verdicts() -> None:
    known = [KnownDeviation("table", "what", "a*", 5.0, "reason")]
    cases = {
        ("a1", 0.5): CheckVerdict.PASS,
        ("a1", 3.0): CheckVerdict.KNOWN,
        ("a1", 6.0): CheckVerdict.FAIL,
        ("b", 3.0): CheckVerdict.FAIL,
    }
    for (case, deviation), verdict in cases.items():
        row = relative("what", case, "m", 100.0, 100.0 + deviation, 1.0).judged("table", known)
        assert row.verdict is verdict
    assert relative("what", "a1", "m", 1.0, 9.0).judged("table", known).verdict is CheckVerdict.REPORTED


def test_report_fails_only_on_fail(tmp_path: Path) -> None:
    good = Check("x", "c", "m", 1.0, 1.0, 0.0, "%", 1.0)
    bad = Check("y", "c", "m", 1.0, 2.0, 100.0, "%", 1.0)
    table = CheckTable("t", "Title", "source", [good])
    assert not VerificationReport([table.judged(())]).failed
    report = VerificationReport([CheckTable("t", "Title", "source", [good, bad]).judged(())])
    assert report.failed
    assert "1 pass" in report.summary()
    assert "1 FAIL" in report.summary()
    for path in report.write(tmp_path):
        assert path.stat().st_size > 0


def test_every_known_deviation_belongs_to_a_table() -> None:
    names = {
        "report modes",
        "spin",
        "gust",
        "gusts",
        "stops",
        "stops in turbulence",
        "wind step",
        "steady *",
        "periodic *",
        "periodic B",
        "turbulence *",
        "iea15mw",
        "iea22mw",
        "hawc2 iea10",
        "hawc2 iea1?",
        "hawc2 iea22",
        "hawc2 modes",
        "iea22mw modes",
        "uae attached",
        "parked",
        "parked discretisation",
        "parked stall",
        "parked turbulence*",
        "offshore waves",
        "offshore wind",
        "offshore turbulence",
        "floating",
        "floating wind",
        "members J*",
        "members J3*45",
        "members J4*",
        "members J5*",
        "members J6*",
        "members J[56]*",
    }
    assert {k.table for k in KNOWN} <= names


def test_reference_folder_is_checked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.syspath_prepend(Path(__file__).parents[2] / "tools")
    import verification_page

    monkeypatch.setattr("sys.argv", ["verification_page", "--reference", str(tmp_path)])
    with pytest.raises(SystemExit):
        verification_page.main()
    assert "no folder 'openfast'" in capsys.readouterr().err


@pytest.mark.parametrize(("deviation", "status"), [(0.1, 0), (0.9, 1)])
def test_only_a_failure_ends_with_status_one(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, deviation: float, status: int
) -> None:
    row = relative("thing", "here", "N", 1.0, 1.0 + deviation / 100.0, 0.5)
    study = CheckStudy(1.0, lambda: CheckTable("example", "Example", "nobody", [row]))
    monkeypatch.setattr("meltemi.verification.verification.FULL", (study,))
    monkeypatch.setattr("sys.argv", ["meltemi", "verify", "--out", str(tmp_path)])
    with pytest.raises(SystemExit) as end:
        main()
    assert (end.value.code or 0) == status
    assert "example,thing,here" in (tmp_path / "verification.csv").read_text(encoding="utf-8")
