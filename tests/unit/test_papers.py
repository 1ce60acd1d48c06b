"""What the papers say stands in tables and texts: all of it is used, and nothing is missing."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import meltemi.papers
from meltemi.core.physics import PHYSICS
from meltemi.papers.claim import Claim, claims_of, claims_table, count_held, reasons_of, rows_of
from meltemi.papers.commands import STUDIES
from meltemi.papers.he2018.claims import RULES
from meltemi.papers.study import by_kind
from meltemi.papers.summary import claims_on, summary
from meltemi.papers.verdict import HOLDS, UNCHECKED, by_reading, judgement, judgement_in, unchecked, unjudged
from meltemi.reports.blocks import Code, Section, Table
from meltemi.reports.markdown import plain, sections, table_lines

FOLDER = Path(meltemi.papers.__path__[0])
STATED = ["wang2021", "palanimuthu2022"]
"""Studies whose claims are called by their keys."""


@pytest.mark.parametrize("study", [*STATED, "he2018"])
def test_the_page_shows_the_present_physics(study: str) -> None:
    """A page whose results moved is remade (``meltemi reproduce``); until then it says what each version changed."""
    page = Path(__file__).parents[2] / "docs" / "papers" / f"{study}.md"
    versions = re.findall(r"physics version (\d+)", page.read_text(encoding="utf-8"))
    assert versions == [str(version) for version in range(int(versions[0]), PHYSICS + 1)]


@pytest.mark.parametrize("study", STATED)
def test_every_stated_claim_is_judged(study: str) -> None:
    code = "".join(path.read_text(encoding="utf-8") for path in (FOLDER / study).rglob("*.py"))
    assert set(re.findall(r'\bclaim\(\s*"(.+?)"', code)) == set(rows_of(study, "claims.csv"))


@pytest.mark.parametrize("study", [*STATED, "he2018"])
def test_every_claims_reason_is_given(study: str) -> None:
    text = (FOLDER / study / "reasons.md").read_text(encoding="utf-8")
    reasons = reasons_of(study)
    assert len(reasons) == len(text.strip().split("\n\n"))
    named = {row["reason"] for row in rows_of(study, "claims.csv").values()}
    assert {reason for reason in named if reason and "{" not in reason} <= set(reasons)


def test_every_kind_of_claim_of_he2018_occurs() -> None:
    assert {row["kind"] for row in rows_of("he2018", "claims.csv").values()} == set(RULES)


def test_a_claim_is_filled_and_judged() -> None:
    claim = claims_of("wang2021")
    words = {"name": "as scaled", "std": 110.2, "error": 4.6, "bin": 8}
    found = claim("power std", True, **words)
    tolerance = "same bin, two standard errors over our seeds"
    item, paper, ours = "largest std of power, as scaled", "109 kW in bin 7", "110 ± 5 kW in bin 8"
    assert found == Claim(item, paper, ours, judgement(True), "Table 2", tolerance=tolerance, basis="surrogate")
    assert claim("power std", False, **words).verdict == "differs"
    assert claim("power std", unjudged("why"), **words).verdict == "cannot be judged: why"
    assert claim("V1 loads").verdict == "cannot be checked: the paper does not name these loads"
    with pytest.raises(KeyError, match="name"):
        claim("power std", True)


def test_what_no_run_can_check_is_said_in_the_table() -> None:
    """A claim that is judged has no verdict there."""
    for study in STATED:
        verdicts = [row["verdict"] for row in rows_of(study, "claims.csv").values()]
        assert {v.partition(": ")[0] + ": " for v in verdicts if v} == {UNCHECKED}


def test_the_summary_is_that_of_the_pages() -> None:
    docs = FOLDER.parents[2] / "docs" / "papers"
    pages = {f"{name}.md": (docs / f"{name}.md").read_text(encoding="utf-8") for name in STUDIES}
    found = (docs / "index.md").read_text(encoding="utf-8")
    assert found == summary(pages), "python tools/paper_page.py writes it"


def test_a_summary_counts_what_the_paper_states() -> None:
    claims = [
        Claim("one", "1 | 2", "1", judgement(True), "Fig. 1"),
        Claim("two", "2", "3", judgement(False), "Fig. 2", "size"),
        Claim("three", "much", "", judgement(unchecked("because it has no number")), "Fig. 3"),
        Claim("four", "4", "4", judgement(True), "", basis="command"),
        Claim("five", "5", "5", by_reading({"of mean": True, "of peak": False}), "Fig. 5"),
    ]
    page = "\n".join(["# A paper", "", *table_lines(claims_table(claims)), "", "*size:* It is larger. Much larger."])
    assert [line.item for line in claims_on(page)] == ["one", "two", "three", "five"]
    assert count_held(claims).startswith(
        "1 of 3 claims of the paper hold, 1 in one reading of it and not in another (1 "
    )
    assert count_held(claims).endswith("By reading: five: holds (of mean) / differs (of peak).")
    found = summary({"a.md": page})
    assert "| [A paper](a.md) | 4 | 1 | 1 | 1 | 1 |" in found
    assert "| two | 2 | 3 | It is larger |" in found
    assert "Cannot be checked: three (it has no number)." in found


def test_a_verdict_by_readings() -> None:
    assert (
        by_reading({"a": True, "b": HOLDS}).text == "holds" and by_reading({"a": False, "b": False}).text == "differs"
    )
    both = by_reading({"20 %": False, "40 %": True})
    assert both.text == "differs (20 %) / holds (40 %)"
    verdicts = [
        "holds",
        both.text,
        "smaller effect",
        "holds only for 1P",
        f"{UNCHECKED}not given",
        "cannot be judged: x",
    ]
    expected = ["held", "by_reading", "differ", "by_reading", "unchecked", "unjudged"]
    assert [judgement_in(text).outcome for text in verdicts] == expected
    assert [judgement_in(text).text for text in verdicts] == verdicts


@pytest.mark.parametrize("study", STUDIES)
def test_verdicts_of_the_pages_are_data(study: str) -> None:
    page = (FOLDER.parents[2] / "docs" / "papers" / f"{study}.md").read_text(encoding="utf-8")
    verdicts = [line.verdict for line in claims_on(page)]
    assert verdicts and [judgement_in(text).text for text in verdicts] == verdicts


def test_doubtful_runs_that_differ_in_numbers_only_are_one_line() -> None:
    cells = {f"seed {k}": f"rotor faster than {1.2 + k} rpm (limit 10.7 rpm)" for k in (1, 2, 3)} | {"x": "diverged"}
    first = "rotor faster than 2.2 rpm (limit 10.7 rpm)"
    assert by_kind(cells) == [("seed 1, and 2 more", first), ("x", "diverged")]


def test_texts_of_a_page_become_chapters() -> None:
    text = "# Title\n\nOf [air](../air.md), $M_i\\cos\\psi_i$.\n\n## Set-up\n\n```sh\na | b\n```\n"
    text += "\n- one\n  *more*\n- two\n\n| | here |\n|---|---|\n| `x` | 1 \\| 2 |\n\n## Empty\n"
    table = Table(["", "here"], [["x", "1 | 2"]], text_columns=2)
    assert plain(sections(text, "First")) == [
        Section("First", ["Of air, M_i cos ψ_i."]),
        Section("Set-up", [Code("a | b"), "• one more", "• two", table]),
    ]
    assert plain("2 * 3 * 4, **b**, *c d*") == "2 * 3 * 4, b, c d"
