"""The report of a load base: its numbers are those of the records, it needs nothing else, names are escaped."""

from __future__ import annotations

import json
import math
import re
from html import unescape
from pathlib import Path

import pandas as pd
import pytest
from synthetic_base import small_plan, synthetic_base

from meltemi.core.errors import InputError, Status
from meltemi.loadbase import report
from meltemi.loadbase.design import DesignLoads, design_loads
from meltemi.loadbase.engine import base_table
from meltemi.loadbase.plan import Plan
from meltemi.loadbase.report import LOADS, limit_ratios, verdict, write_report
from meltemi.loadbase.report_comparison import write_base_comparison
from meltemi.loadbase.report_loads import slopes_of, title_of, unit_of_driver
from meltemi.loadbase.settings import DesignSettings, read_settings
from meltemi.report.charts import Axis, Curve, chart, rounded
from meltemi.report.html import Table, html_of, stored
from meltemi.report.turbine_facts import number

NASTY = 'blade <1> "struck" & </script> broke'
TAG = re.compile(r"<[^>]*>")


@pytest.fixture(scope="module")
def base(tmp_path_factory: pytest.TempPathFactory) -> tuple[Plan, Path]:
    """A load base with a failed, a doubtful and a missing case, in a folder whose name needs quoting."""
    folder = tmp_path_factory.mktemp("report") / "a <b> & c's"
    folder.mkdir()
    planned = small_plan()
    names = [case.name for case in planned.cases if case.dlc == "1.3"]
    status = {names[0]: (Status.FAILED, NASTY), names[1]: (Status.DOUBTFUL, "too far")}
    return synthetic_base(folder, planned, status=status, without=[names[2]]), folder


@pytest.fixture(scope="module")
def design(base: tuple[Plan, Path]) -> DesignLoads:
    return design_loads(*base, DesignSettings(resamples=10))


@pytest.fixture(scope="module")
def text(base: tuple[Plan, Path], design: DesignLoads) -> str:
    page, *tables = write_report(*base, design=design)
    assert page == base[1] / "report.html" and {path.suffix for path in tables} == {".csv", ".xlsx"}
    return page.read_text(encoding="utf-8")


def rows_of(text: str, caption: str) -> list[list[list[str]]]:
    """Cells of all tables whose caption begins so."""
    tables = [
        t for t in re.findall(r"<table.*?</table>", text, re.S) if plain(t.split("</caption>")[0]).startswith(caption)
    ]
    return [
        [
            [plain(c) for c in re.findall(r"<t[hd].*?</t[hd]>", row, re.S)]
            for row in re.findall(r"<tr.*?</tr>", t, re.S)[1:]
        ]
        for t in tables
    ]


def plain(html: str) -> str:
    return unescape(TAG.sub("", html)).strip()


def data_of(text: str, start: str) -> list[tuple[str, object]]:
    """Data within the page, by the beginning of its name."""
    found = re.findall(rf'<script type="application/json" id="({start}[^"]*)">(.*?)</script>', text, re.S)
    return [(name, json.loads(content)) for name, content in found]


def test_page_needs_nothing_else_and_escapes_names(text: str, base: tuple[Plan, Path]) -> None:
    assert not re.search(r"""(src|href)=["'](?!#|data:)|@import|url\(""", text)
    assert set(re.findall(r"https?://[^\s\"'<]*", text)) <= {"http://www.w3.org/2000/svg"}
    markup = re.sub(r"<(script|style).*?</\1>", "", text, flags=re.S)
    assert "<b> &" not in markup and "<1>" not in markup and text.count("</script>") == text.count("<script")
    assert plain(markup).count('blade <1> "struck" & </script> broke') == 2  # at the top, and in the list of cases
    ((_, page),) = data_of(text, "page-data")
    assert isinstance(page, dict) and page["cases"] == [[case.name for case in base[0].cases]]
    folder = str(base[1]).replace("'", "'\"'\"'")
    assert page["bases"] == [f"'{folder}'"]


def test_what_is_missing_comes_first(text: str, base: tuple[Plan, Path]) -> None:
    top = plain(text.split('<section id="section-1">')[0].split("</style>")[1])
    names = [case.name for case in base[0].cases if case.dlc == "1.3"]
    assert f"Not complete: 2 of {len(base[0].cases)} cases have no loads" in top
    assert "1 cases are missing: DLC 1.3 (1)" in top and names[0] in top and names[1] in top and "too far" in top


def test_a_long_list_of_problems_is_folded(design: DesignLoads, monkeypatch: pytest.MonkeyPatch) -> None:
    """Dozens of warned cases pushed the governing loads down the page."""
    assert len(design.problems[design.problems["state"] != "missing"]) == 2
    assert "<details open><summary>1 failed, 1 doubtful</summary>" in verdict(design, None).html
    monkeypatch.setattr(report, "SHOWN", 1)
    assert "<details><summary>1 failed, 1 doubtful</summary>" in verdict(design, None).html


def test_extreme_loads_are_those_of_the_records(text: str, design: DesignLoads) -> None:
    for words, frame in (("with", design.ultimate), ("without", design.characteristic)):
        tables = rows_of(text, f"Extreme loads, {words} partial")
        assert len(tables) == len(frame.index.unique("interface"))
        for place, table in zip(frame.index.unique("interface"), tables, strict=True):
            own = frame.loc[place]
            assert [row[0].replace("res", "_res") for row in table] == [d.replace("_res", "_res") for d in own.index]
            for cells, (_, row) in zip(table, own.iterrows(), strict=True):
                assert cells[1:9] == [number(float(row[h]) * unit_of_driver(h)[1]) for h in LOADS]
                assert cells[9:11] == [f"{math.degrees(row[f'{h} angle']):.0f}" for h in ("F_res", "M_res")]
                assert cells[11] == f"{row.factor:g}" and cells[13] == row.case
    (glance,) = rows_of(text, "Ultimate loads, with")
    for cells, place in zip(glance, design.ultimate.index.unique("interface"), strict=True):
        own = design.ultimate.loc[place]
        for cell, name in zip(cells[1:], LOADS, strict=True):
            driver = max((d for d in own.index if d.split()[0] == name), key=lambda d, n=name: abs(own.at[d, n]))
            mark = "" if own.at[driver, "state"] == "ok" else " (!)"
            assert cell == f"{number(own.at[driver, name] * 1e-3)}DLC {own.at[driver, 'row']}{mark}"


def test_fatigue_and_shares_are_those_of_the_records(text: str, design: DesignLoads) -> None:
    slopes = slopes_of(design.fatigue)
    (table,) = (t for t in rows_of(text, "") if len(t) == len(design.fatigue) and len(t[0]) == 5 + len(slopes))
    for cells, (channel, row) in zip(table, design.fatigue.iterrows(), strict=True):
        assert cells[0] == title_of(str(channel)) and cells[4] in ("kN", "kN m")
        assert cells[5:] == [number(float(row[m]) * 1e-3) for m in slopes]
    for slope, table in zip(slopes, rows_of(text, "Share in the damage"), strict=True):
        dlcs = list(design.shares.index.unique("dlc"))
        for cells in table:
            own = design.shares.loc[cells[0].replace(" ", "_")][slope].groupby(level="dlc").sum()
            expected = [f"{100 * own[dlc]:.1f}" if own[dlc] >= 0.005 else "" for dlc in sorted(dlcs)]
            assert sorted(cells[1:]) == sorted(expected)


def test_statistics_are_those_of_the_base(text: str, base: tuple[Plan, Path]) -> None:
    ((_, content),) = data_of(text, "statistics")
    assert isinstance(content, list)
    kept = base_table(*base, "statistics")
    names = [case.name for case in base[0].cases]
    for channel, columns, factor in (("tower base moment fore aft", ["tower_base_moment_fore_aft"], 1e-3),
                                     ("pitch", ["pitch_1", "pitch_2", "pitch_3"], 180.0 / math.pi)):  # fmt: skip
        (own,) = (each for each in content[0]["channels"] if each["label"] == channel)
        part = kept[kept["channel"].isin(columns)].groupby("case")
        for end in ("min", "max"):
            expected = getattr(part[end], end)().reindex(names) * factor
            assert own[end] == rounded(expected)
            assert own[end].count(None) == 2  # the failed and the missing case


def test_limits_and_other_bases_give_utilisations(base: tuple[Plan, Path], design: DesignLoads, tmp_path: Path) -> None:
    value = float(design.ultimate.at[("tower_base", "M_res max"), "M_res"])
    limits = {"ultimate": {"tower_base": {"M_res max": 0.8 * value}}}
    ratios = limit_ratios(design, limits)
    assert ratios["ratio"].to_list() == pytest.approx([1.25])
    page = write_report(*base, design=design, limits=limits)[0].read_text(encoding="utf-8")
    assert "1 utilisations are above 1: tower base Mres max: 1.25" in plain(page) and 'class="bar over"' in page
    page = write_report(*base, design=design, against=("other", design))[0].read_text(encoding="utf-8")
    assert "0 utilisations are above 1" in page and "Bars: utilisation against other" in page
    for wrong, words in (
        ({"ultimate": {"tower_bas": {"M_res max": 1.0}}}, "there is no load 'ultimate tower_bas M_res max'"),
        ({"ultimate": {"tower_base": {"M_res max": "much"}}}, "expected a number other than zero, found 'much'"),
        ({"ultimate": {"tower_base": 3}}, "limits: ultimate: expected interfaces with loads and values"),
    ):
        with pytest.raises(InputError, match=re.escape(words)):
            limit_ratios(design, wrong)
    with pytest.raises(InputError, match="not both"):
        write_report(*base, design=design, limits=limits, against=("other", design))


def test_comparison_has_both_bases(base: tuple[Plan, Path], tmp_path: Path) -> None:
    planned, folder = base
    other = small_plan(realisation=2)
    synthetic_base(tmp_path, other)
    page, csv = write_base_comparison((str(folder), planned), (str(tmp_path), other), tmp_path / "out")
    text = page.read_text(encoding="utf-8")
    ((_, about),) = data_of(text, "page-data")
    assert isinstance(about, dict) and len(about["bases"]) == 2
    found = pd.read_csv(csv)
    (table,) = (t for t in rows_of(text, "") if len(t) == len(found) and len(t[0]) == 9)
    assert [row[6] for row in table] == [f"{ratio:.3f}" if math.isfinite(ratio) else "" for ratio in found["ratio"]]


def test_blocks_of_pages() -> None:
    html = html_of(Table(["name", "value\nkN"], [["<b>", 1234.5678], ["x", None]]))
    assert "&lt;b&gt;" in html and ">1235<" in html.replace("1234.6", "1235") and "<b>" not in html
    drawn = chart("t", Axis("x"), Axis("y", log=True), [Curve("a", [1.0, math.nan], [2.0, 1 / 3], dots=True)]).html
    content = json.loads(re.search(r">({.*?})<", drawn)[1])  # type: ignore[index]
    assert content["series"][0]["x"] == [1, None] and content["series"][0]["y"] == [2, 0.3333]
    assert "</script><b>" not in stored("a", "</script><b>")
    assert rounded([math.inf, 1234.6, 0.00012345]) == [None, 1235, 0.0001234]


def test_the_report_has_the_settings_of_the_evaluation(base: tuple[Plan, Path], tmp_path: Path) -> None:
    file = tmp_path / "settings.yaml"
    file.write_text("availability: 0.97\nslopes: [4, 10]\n")
    design = design_loads(*base, read_settings(file))
    assert slopes_of(design.fatigue) == [4.0, 10.0]
    page = write_report(*base, design=design)[0].read_text(encoding="utf-8")
    assert re.search(r"availability.{1,80}0\.97", page, re.DOTALL)
    file.write_text("availabilty: 0.97\n")
    with pytest.raises(InputError, match="availability"):
        read_settings(file)
