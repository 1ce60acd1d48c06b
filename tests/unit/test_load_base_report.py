"""The report of a load base: its numbers are those of the records, it needs nothing else, names are escaped."""

from __future__ import annotations

import json
import math
import re
from dataclasses import replace
from html import unescape
from pathlib import Path

import numpy as np
import openpyxl
import pandas as pd
import pytest
from synthetic_base import small_plan, synthetic_base

from meltemi.core.errors import InputError, Status
from meltemi.loads.loadbase import coverage, report
from meltemi.loads.loadbase.axes import axes_of, sketches_of
from meltemi.loads.loadbase.design import DesignLoads, design_loads
from meltemi.loads.loadbase.engine import base_table
from meltemi.loads.loadbase.plan import Plan
from meltemi.loads.loadbase.project import read_project
from meltemi.loads.loadbase.report import limit_ratios, verdict, write_design_loads, write_report
from meltemi.loads.loadbase.report_comparison import write_base_comparison
from meltemi.loads.loadbase.report_loads import LOADS, by_speed, slopes_of, title_of, unit_of_driver
from meltemi.loads.loadbase.settings import DesignSettings, read_settings
from meltemi.loads.loadbase.wording import event_words
from meltemi.reports.blocks import (
    Axis,
    Beside,
    CaseName,
    CaseValue,
    Chart,
    Curve,
    Document,
    Drawing,
    Folded,
    PartChoice,
    Section,
    Share,
    Stroke,
    Subsection,
    Table,
    VerdictBlock,
)
from meltemi.reports.html import html_of, rounded, stored
from meltemi.reports.turbine_facts import number
from meltemi.reports.word import write_word
from meltemi.reports.workbook import write_workbook
from meltemi.turbine.library import load_turbine, write_turbine

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


def data_of(text: str, before: str) -> object:
    """Data within the page, by what stands before it."""
    (found,) = re.findall(rf'{before}<script type="application/json"[^>]*>(.*?)</script>', text, re.S)
    return json.loads(found)


@pytest.mark.slow
def test_page_needs_nothing_else_and_escapes_names(text: str, base: tuple[Plan, Path]) -> None:
    assert not re.search(r"""(src|href)=["'](?!#|data:)|@import|url\(""", text)
    assert set(re.findall(r"https?://[^\s\"'<]*", text)) <= {"http://www.w3.org/2000/svg"}
    markup = re.sub(r"<(script|style).*?</\1>", "", text, flags=re.S)
    assert "<b> &" not in markup and "<1>" not in markup and text.count("</script>") == text.count("<script")
    assert plain(markup).count('blade <1> "struck" & </script> broke') == 2  # at the top, and in the list of cases
    page = data_of(text, "</main>\\s*")
    assert isinstance(page, dict) and page["cases"] == [[case.name for case in base[0].cases]]
    folder = str(base[1]).replace("'", "'\"'\"'")
    assert page["bases"] == [f"'{folder}'"]


def test_what_is_missing_comes_first(text: str, base: tuple[Plan, Path]) -> None:
    top = plain(text.split('<section id="section-1">')[0].split("</style>")[1])
    names = [case.name for case in base[0].cases if case.dlc == "1.3"]
    assert f"Incomplete: no results for 2 of {len(base[0].cases)} load cases" in top
    assert (
        "1 load cases not yet simulated: DLC 1.3 (1)" in top
        and names[0] in top
        and names[1] in top
        and "too far" in top
    )


def test_the_title_is_the_name_of_the_turbine(
    base: tuple[Plan, Path], design: DesignLoads, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The title of a turbine in turbine.yaml was "Design loads: turbine"."""
    file = tmp_path / "turbine.yaml"
    write_turbine(load_turbine("nrel5mw").replace(name="hill"), file)
    own = replace(base[0], campaign=base[0].campaign.replace(turbine=str(file)))
    made: list[Document] = []
    monkeypatch.setattr(report, "write_workbook", lambda path, document: made.append(document) or path)
    write_design_loads(replace(design, plan=own), tmp_path)
    assert made[0].title == "Design loads: hill"
    assert dict(report.facts(own))["turbine"] == "hill (turbine.yaml)"
    assert dict(report.facts(base[0]))["turbine"] == "nrel5mw"
    monkeypatch.setattr(report, "write_page", lambda path, document: made.append(document) or path)
    monkeypatch.setattr(report, "axes_blocks", lambda turbine: [])
    write_report(own, base[1], design=replace(design, plan=own))
    assert made[1].title == "Design loads: hill"


def test_what_holds_for_all_cases_is_said_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A warning about the turbine's data stood beside 130 of 130 cases, and so did one of its controller."""
    of = small_plan(("1.3",))
    names, tower = [case.name for case in of.cases], "tower.mass: it is 3; usual is 1 to 2; is its unit right?"
    monkeypatch.setattr(coverage, "plausibility_warnings", lambda turbine: (tower,))
    said = dict.fromkeys(names, (tower, "the controller has no flaps"))
    said[names[0]] = (*said[names[0]], "rotor overspeed 1.7 rad/s")
    synthetic_base(tmp_path, of, warnings=said, status={names[1]: (Status.FAILED, "it diverged")})
    design = design_loads(of, tmp_path, DesignSettings(resamples=5))
    assert design.common == (tower, "the controller has no flaps")
    assert design.notes[:2] == (f"All cases: {tower}", "All cases: the controller has no flaps.")
    assert design.problems["message"].to_dict() == {names[0]: "rotor overspeed 1.7 rad/s", names[1]: "it diverged"}
    assert html_of(verdict(design, None)).count(tower) == 1
    (tmp_path / "all").mkdir()
    synthetic_base(tmp_path / "all", of, warnings=dict.fromkeys(names, (tower,)))
    whole = verdict(design_loads(of, tmp_path / "all", DesignSettings(resamples=5)), None)
    assert whole.kind == "doubtful"
    heading = f"Complete: {len(names)} load cases simulated without warnings of single cases, 1 for all of them"
    assert whole.heading == heading


def test_a_warning_of_two_runs_is_theirs() -> None:
    assert coverage.shared({"a": ["one"], "b": ["one"]}) == []
    assert coverage.shared({"a": ["one", "two"], "b": ["one"], "c": ["two", "one"]}) == ["one"]
    assert coverage.shared({}) == []


def test_columns_of_sentences_share_the_width() -> None:
    """The table of the axes was cut at a window of 1280 pixels: each column had the least width of a single one."""
    sentence = "a sentence of more than forty characters, as axes have"
    assert 'class="wide narrow texts"' in html_of(Table(["a", "b"], [[sentence, sentence]]))
    assert 'class="wide narrow"' in html_of(Table(["a", "b"], [["short", sentence]]))


def test_a_long_list_of_problems_is_folded(design: DesignLoads, monkeypatch: pytest.MonkeyPatch) -> None:
    """Dozens of warned cases pushed the governing loads down the page."""
    assert len(design.problems[design.problems["state"] != "missing"]) == 2
    assert "<details open><summary>1 failed, 1 doubtful</summary>" in html_of(verdict(design, None))
    monkeypatch.setattr(report, "SHOWN", 1)
    assert "<details><summary>1 failed, 1 doubtful</summary>" in html_of(verdict(design, None))


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
                assert cells[11] == f"{row.factor:g}" and cells[12] == row.case
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
    content = data_of(text, '<figure class="chart" data-statistics>')
    assert isinstance(content, list)
    kept = base_table(*base, "statistics")
    names = [case.name for case in base[0].cases]
    for channel, columns, factor in (("tower base moment fore aft", ["tower_base_moment_fore_aft"], 1e-3),
                                     ("pitch", ["pitch_1", "pitch_2", "pitch_3"], 180.0 / math.pi)):  # fmt: skip
        (own,) = (each for each in content[0]["channels"] if each["label"] == channel)
        part = kept[kept["channel"].isin(columns)].groupby("case", observed=True)
        for end in ("min", "max"):
            expected = getattr(part[end], end)().reindex(names) * factor
            assert own[end] == rounded(expected)
            assert own[end].count(None) == 2  # the failed and the missing case


@pytest.mark.slow
def test_limits_and_other_bases_give_utilisations(base: tuple[Plan, Path], design: DesignLoads, tmp_path: Path) -> None:
    value = float(design.ultimate.at[("tower_base", "M_res max"), "M_res"])
    limits = {"ultimate": {"tower_base": {"M_res max": 0.8 * value}}}
    ratios = limit_ratios(design, limits)
    assert ratios["ratio"].to_list() == pytest.approx([1.25])
    page = write_report(*base, design=design, limits=limits)[0].read_text(encoding="utf-8")
    assert "1 utilisation above 1: tower base Mres max: 1.25" in plain(page) and 'class="bar over"' in page
    page = write_report(*base, design=design, against=("other", design))[0].read_text(encoding="utf-8")
    assert "0 utilisations above 1" in page and "Bars: utilisation against other" in page
    for wrong, words in (
        ({"ultimate": {"tower_bas": {"M_res max": 1.0}}}, "there is no load 'ultimate tower_bas M_res max'"),
        ({"ultimate": {"tower_base": {"M_res max": "much"}}}, "expected a number other than zero, found 'much'"),
        ({"ultimate": {"tower_base": 3}}, "limits: ultimate: expected interfaces with loads and values"),
    ):
        with pytest.raises(InputError, match=re.escape(words)):
            limit_ratios(design, wrong)
    with pytest.raises(InputError, match="not both"):
        write_report(*base, design=design, limits=limits, against=("other", design))


@pytest.mark.slow
def test_comparison_has_both_bases(base: tuple[Plan, Path], tmp_path: Path) -> None:
    planned, folder = base
    other = small_plan(realisation=2)
    synthetic_base(tmp_path, other)
    page, csv = write_base_comparison((str(folder), planned), (str(tmp_path), other), tmp_path / "out")
    text = page.read_text(encoding="utf-8")
    about = data_of(text, "</main>\\s*")
    assert isinstance(about, dict) and len(about["bases"]) == 2
    found = pd.read_csv(csv)
    (table,) = (t for t in rows_of(text, "") if len(t) == len(found) and len(t[0]) == 9)
    assert [row[6] for row in table] == [f"{ratio:.3f}" if math.isfinite(ratio) else "" for ratio in found["ratio"]]


def test_blocks_of_pages() -> None:
    html = html_of(Table(["name", "value\nkN"], [["<b>", 1234.5678], ["x", None]]))
    assert "&lt;b&gt;" in html and ">1235<" in html.replace("1234.6", "1235") and "<b>" not in html
    drawn = html_of(Chart("t", Axis("x"), Axis("y", log=True), [Curve("a", [1.0, math.nan], [2.0, 1 / 3], dots=True)]))
    content = json.loads(re.search(r">({.*?})<", drawn)[1])  # type: ignore[index]
    assert content["curves"][0]["x"] == [1, None] and content["curves"][0]["y"] == [2, 0.3333]
    assert "</script><b>" not in stored("a", "</script><b>")
    assert rounded([math.inf, 1234.6, 0.00012345]) == [None, 1235, 0.0001234]


@pytest.mark.slow
def test_the_report_has_the_settings_of_the_evaluation(base: tuple[Plan, Path], tmp_path: Path) -> None:
    file = tmp_path / "settings.yaml"
    file.write_text("availability: 0.97\nslopes: [4, 10]\n")
    design = design_loads(*base, read_settings(file))
    assert slopes_of(design.fatigue) == [4.0, 10.0]
    page = write_report(*base, design=design)[0].read_text(encoding="utf-8")
    settings = dict(rows_of(page, "Settings of the evaluation")[0])
    assert settings["slopes m of the S-N curves"] == "4, 10"
    assert settings["strengths for the mean correction of cycles by the line of Goodman"] == "none"
    assert settings["clearance of an undeflected tip from the surface of the tower"].endswith(" m")
    assert "0.97" in settings.values()
    file.write_text("availabilty: 0.97\n")
    with pytest.raises(InputError, match="availability"):
        read_settings(file)


def test_nothing_is_written_as_a_program_writes_it(text: str) -> None:
    """Settings were None, {} and 0.10471975511965977."""
    for row in [*rows_of(text, "Settings of")[0], *rows_of(text, "Values from practice")[0]]:
        assert not re.search(r"None|True|False|[{}]|\d\.\d{7}", row[-1]), row
    events = [row[-1] for row in rows_of(text, "Values from practice")[0] if row[1] == "events"]
    assert event_words({"type": "sensor_offset", "sensor": "pitch_1", "offset": math.radians(6.0)}).endswith("6 deg")
    assert event_words({"type": "pitch_runaway", "blade": 1, "rate": "-emergency_rate", "after": 2.5}) == (
        "pitch runaway, blade 1, rate -emergency rate, after 2.5 s"
    )
    assert all("rad" not in each for each in events)


def test_no_interval_without_one(text: str, design: DesignLoads) -> None:
    """One seed has no confidence interval."""
    assert design.energy is not None and math.isnan(design.energy.half_width)
    assert "Annual energy production" in text and "confidence interval" not in text


def test_axes_have_a_sketch_for_each_interface(text: str, design: DesignLoads) -> None:
    places = design.ultimate.index.unique("interface")
    (axes,) = rows_of(text, "Axes of the interfaces")
    assert [row[0] for row in axes] == [title_of(place) for place in places]
    assert {row[0]: row[-1] for row in axes}["tower base"].split(", ")[4] == "TwrBsMyt"
    sketches = re.findall(r'<svg class="sketch".*?</svg>', text)
    assert len(sketches) == 2 * len(places)
    for place in places:
        drawings = [s for s in sketches if f'aria-label="{title_of(place)}, ' in s]
        assert [sorted(re.findall(r">([xyz])</text>", s)) for s in drawings] == [["x", "y", "z"]] * 2


@pytest.mark.parametrize("name", ["blade_root", "hub_rotating", "hub_fixed", "tower_base"])
def test_drawn_axes_are_right_handed(name: str) -> None:
    """In the side view x and z are drawn and y enters; looking downwind y and z are, and x enters."""
    turbine = load_turbine("nrel5mw")
    for drawing, drawn in zip(sketches_of(name, axes_of(name, turbine)), ("xz", "yz"), strict=True):
        found = {s.label: s for s in drawing.strokes if s.label}
        assert found.keys() == {"x", "y", "z"}
        one, two = (complex(*(b - a for a, b in zip(*found[axis].points, strict=True))) for axis in drawn)
        turn = (one.conjugate() * two).imag / abs(one) / abs(two)
        # z x x = y: x to the right, z up, y enters; y x z = x: y to the left, z up, x enters
        assert turn == pytest.approx(1.0 if drawn == "xz" else -1.0)
        assert found["y" if drawn == "xz" else "x"].kind == "into"


@pytest.mark.slow
def test_title_block_of_a_file(
    base: tuple[Plan, Path], design: DesignLoads, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("docx")
    monkeypatch.setattr("meltemi.reports.word._figures", lambda blocks: iter(()))  # drawn in the next test
    file = tmp_path / "project.yaml"
    file.write_text("project: Site A\nauthor: A. Smith\nrevision: 2\ndate: 2026-05-04\n")
    title = read_project(tmp_path)
    assert title is not None and title == read_project(base[1], file) and title.revision == "2"
    page, word, excel, *_ = write_report(*base, design=design, project=title, word=True)
    html = page.read_text(encoding="utf-8")
    assert '@bottom-left { content: "Site A, revision 2, 2026-05-04"' in html
    for name, value in (("Project", "Site A"), ("Author", "A. Smith"), ("Revision", "2"), ("Date", "2026-05-04")):
        assert f"<dt>{name}</dt><dd>{value}</dd>" in html
    same_content(word, excel, html)
    file.write_text("projekt: Site A\n")
    with pytest.raises(InputError, match="did you mean 'project'"):
        read_project(base[1], file)
    assert read_project(tmp_path / "nowhere") is None


def same_content(word: Path, excel: Path, html: str) -> None:
    """The tables of the page are in the Word and in the Excel file."""
    docx = pytest.importorskip("docx").Document(str(word))
    captions = {plain(c).replace("\u00a0", " ") for c in re.findall(r"<caption>.*?</caption>", html)}
    paragraphs = [p.text for p in docx.paragraphs]
    assert (
        captions <= {p.replace("_res", "res") for p in paragraphs}
        and "Site A, revision 2" in docx.sections[0].footer.paragraphs[0].text
    )
    assert len(docx.tables) > len(captions)
    book = openpyxl.load_workbook(excel)
    assert book.sheetnames[0] == "Report" and "Extreme loads, tower base" in book.sheetnames
    cells = [cell for sheet in book for row in sheet.iter_rows() for cell in row if cell.value is not None]
    assert captions <= {str(cell.value).replace("_res", "res") for cell in cells}
    sheet = book["Extreme loads, tower base"]
    head = [cell.value for cell in sheet[2]]
    assert head[:2] == ["extreme", "Fx [kN]"] and "M_res [kN m]" in head
    numbers = [cell for cell in sheet[3][1:9] if isinstance(cell.value, int | float)]
    assert len(numbers) == 8 and all(re.fullmatch(r"0(\.0{1,3})?", cell.number_format) for cell in numbers)
    assert all(7 <= sheet.column_dimensions[c].width <= 60 for c in "ABC")


def test_every_kind_of_block_is_in_a_word_file_and_a_workbook(tmp_path: Path) -> None:
    library = pytest.importorskip("docx")
    line = Chart("Line", Axis("wind", "m/s"), Axis("load", "kN"), [Curve("a", [3, 5], [1, 2]), Curve("b", [5], [7])])
    rose = Chart("Rose", Axis("angle", "deg"), Axis("load", "kN", start=0.0), [Curve("a", [0, 90], [1, 2])], polar=True)
    cases = [CaseValue(12345.678, CaseName("c1", text="DLC 1.3"), 1.25), Share(0.5), None, CaseName("c2")]
    table = Table(["name", "load\nkN", "share\n%", "x", "case"], [["one", *cases]], "Loads", note="a note")
    drawing = Drawing(
        "axes", [Stroke([(0, 0), (9, 9)], "axis", "x"), Stroke([(5, 5)], "into", "y")], caption="a sketch"
    )
    choice = PartChoice("Interface", [Subsection("hub", [table]), Subsection("tower", [line])])
    many = PartChoice("Plot of", [Subsection("one", [line]), Subsection("two", [replace(line, title="Other")])])
    listed = Table(["case"], [["c1"]], paper="See plan.csv.")
    lead = VerdictBlock("bad", "Incomplete", ["a line"], Folded("1 failed", Table(["case"], [["c9"]])))
    document = Document(
        "T", [Section("One", ["words", Beside([line, rose, drawing]), choice, many, listed])], [("a", "b")], lead
    )
    word = library.Document(str(write_word(tmp_path / "a.docx", document)))
    texts = [p.text for p in word.paragraphs]
    assert {"T", "One", "words", "Incomplete", "a line", "Loads", "a note", "See plan.csv."} <= {*texts}
    assert len(word.inline_shapes) == 5 and "Line; Rose; a sketch" in texts
    rows = [[cell.text for cell in row.cells] for row in word.tables[2].rows]
    assert rows == [["name", "load\nkN", "share\n%", "x", "case"], ["one", "12346; 1.25; DLC 1.3", "50.0", "", "c2"]]
    widths = [cell.width for cell in word.tables[2].rows[1].cells]
    assert widths[1] == max(widths) > 3 * widths[2] and sum(widths) < library.shared.Mm(257)
    book = openpyxl.load_workbook(write_workbook(tmp_path / "a.xlsx", document))
    assert book.sheetnames == ["Report", "One", "One, hub", "One, tower"]
    assert [cell.value for cell in book["One, hub"][3]] == ["one", 12345.678, 50, None, "c2"]
    assert book["One, hub"]["B3"].number_format == "0" and book["One, hub"]["B2"].value == "load [kN]"
    points = [[cell.value for cell in row] for row in book["One, tower"].iter_rows()]
    assert points[1:] == [["wind [m/s]", "a [kN]", "b [kN]"], [3, 1, None], [5, 2, 7]]


def test_a_locked_rotor_without_a_blade_in_front_of_the_tower_has_no_clearance(tmp_path: Path) -> None:
    """DLC 7.1 and 8.1 had deflections of -67 m, 312 % of the undeflected clearance."""
    (tmp_path / "away").mkdir()
    planned = synthetic_base(tmp_path, small_plan(("1.3", "8.1"), quick=False, seeds=1, yaw_error=0.0))
    azimuths = {case.variant.azimuth for case in planned.cases if case.row == "8.1"}
    assert azimuths == {0.0, 30.0, 60.0, 90.0}
    found = design_loads(planned, tmp_path).clearance
    assert "-a60-" in found.at["8.1", "case"]  # blade 2 points down
    away = synthetic_base(tmp_path / "away", small_plan(("1.3", "8.1")))  # azimuth 0 only
    assert list(design_loads(away, tmp_path / "away").clearance.index) == ["1.3"]


def test_damage_by_wind_speed_ends_at_the_bins(design: DesignLoads) -> None:
    """Lines joined the speeds of production and idling, and went on beyond the last bin."""
    slopes = slopes_of(design.fatigue)
    drawn = by_speed(design, "tower_base_moment_fore_aft", slopes)
    c, own = design.plan.campaign, design.shares.loc["tower_base_moment_fore_aft"]
    x, y = (np.asarray(each) for each in (drawn.curves[0].x, drawn.curves[0].y))
    assert x[0] == c.cut_in and c.cut_out in x and x[-1] == max(c.cut_out, own.index.get_level_values("speed").max())
    assert y[::2].sum() == pytest.approx(100.0) and np.array_equal(y[::2], y[1::2])
    beyond = own[own.index.get_level_values("speed") > c.cut_out][slopes[0]].sum()
    assert y[-1] == pytest.approx(100.0 * beyond)
