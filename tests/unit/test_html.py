"""The page in one file: well-formed, nothing from outside, plain text stays plain text."""

from __future__ import annotations

import base64
import re
import shutil
import subprocess
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import pytest

from meltemi import InputError
from meltemi.reports.blocks import Code, Document, Folded, Picture, Section, Table, chosen
from meltemi.reports.html import html_of, page, sentences, write_page

PNG = b"\x89PNG\r\n\x1a\n and so on"
TABLE = Table(
    head=["quantity", "unit", "mean", "change %"],
    rows=[["load <1>", "kN m", "12.5", "-3.1"], ["power", "kW", "5000", ""]],
    caption="Numbers",
    text_columns=2,
    groups=[("", 3), ("ipc", 1)],
    note="over six seeds",
)
SECTIONS = [
    Section("Numbers", ["A paragraph with 5 < 6 & more.", TABLE]),
    Section("Pictures", [Picture(PNG, "A caption", 'what "it" shows')]),
    Section("How to repeat it", [Code("meltemi compare nrel5mw --ntm\n  --seeds 6")]),
]
EMPTY = ("meta", "img", "br", "hr", "link")


class Reader(HTMLParser):
    """Opens and closes tags, and keeps text and attributes."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.texts: list[tuple[str, str]] = []
        self.attributes: list[tuple[str, str, str]] = []
        self.feed(text)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.attributes += [(tag, name, value or "") for name, value in attrs]
        if tag not in EMPTY:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open, tag
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        if self.open and data.strip():
            self.texts.append((self.open[-1], data.strip()))

    def of(self, tag: str) -> list[str]:
        return [text for where, text in self.texts if where == tag]

    def values(self, name: str) -> list[str]:
        return [value for _, found, value in self.attributes if found == name]


@pytest.fixture(scope="module")
def text() -> str:
    return page(Document("A & B", SECTIONS, facts=[("turbine", "<mine>")], lead="It works.", footer="meltemi 0.1.0"))


@pytest.fixture(scope="module")
def read(text: str) -> Reader:
    return Reader(text)


def test_every_tag_is_closed(read: Reader) -> None:
    assert read.open == []


def test_text_is_escaped_and_complete(read: Reader) -> None:
    assert read.of("h1") == ["A & B"] and read.of("title") == ["A & B"]
    assert read.of("h2") == ["Numbers", "Pictures", "How to repeat it"]
    assert read.of("dd") == ["<mine>"]
    assert "A paragraph with 5 < 6 & more." in read.of("p") and "It works." in read.of("p")
    assert read.of("caption") == ["Numbers"]
    assert read.of("td") == ["kN m", "12.5", "-3.1", "kW", "5000"]  # the empty cells have no text
    assert "load <1>" in read.of("th") and "ipc" in read.of("th")
    assert read.of("code") == ["meltemi compare nrel5mw --ntm\n  --seeds 6"]
    assert read.of("footer") == ["meltemi 0.1.0"]


def test_rows_have_as_many_cells_as_the_head(text: str) -> None:
    for row in text.split("<tbody>")[1].split("</tbody>")[0].strip().splitlines():
        assert row.count("<td") + row.count("<th") == len(TABLE.head)


def test_nothing_comes_from_outside(read: Reader, text: str) -> None:
    outside = text.replace("http://www.w3.org/2000/svg", "")  # the name of a namespace
    assert "://" not in outside and "@import" not in text and "url(" not in text
    for source in read.values("src"):
        assert source.startswith("data:image/png;base64,")
        assert base64.b64decode(source.partition(",")[2]) == PNG
    assert set(read.values("href")) == {"#section-1", "#section-2", "#section-3"}
    assert set(read.values("href")) == {f"#{at}" for at in read.values("id") if at.startswith("section")}


def test_pictures_have_words(read: Reader) -> None:
    assert read.values("alt") == ['what "it" shows']
    assert read.of("figcaption") == ["A caption"]


def test_it_fits_a_phone(read: Reader) -> None:
    assert "width=device-width, initial-scale=1" in read.values("content")


def test_a_short_page_has_no_list_of_sections() -> None:
    assert "<nav" not in page(Document("short", SECTIONS[:2]))


def test_pictures_may_be_files(tmp_path: Path) -> None:
    (tmp_path / "one.png").write_bytes(PNG)
    written = write_page(
        tmp_path / "page.html", Document("files", [Section("one", [Picture(tmp_path / "one.png", "it")])])
    )
    found = Reader(written.read_text(encoding="utf-8"))
    assert base64.b64decode(found.values("src")[0].partition(",")[2]) == PNG
    assert found.values("alt") == ["it"]
    with pytest.raises(InputError, match=r"two\.png: cannot be read"):
        page(Document("files", [Section("two", [Picture(tmp_path / "two.png")])]))
    with pytest.raises(InputError, match=r"page\.html: cannot be written"):
        write_page(tmp_path / "no" / "page.html", Document("files", []))


def test_long_cells_are_broken_and_numbers_are_not() -> None:
    """Verdicts of wide tables lay outside a window of 1200 pixels."""
    text = page(
        Document(
            "a", [Section("b", [Table(["what", "value"], [["a claim of more than a few words", "-34.0 ± 3.0 %"]])])]
        )
    )
    assert '<th scope=row class="text wrap">a claim' in text
    assert "<td>-34.0\u00a0±\u00a03.0\u00a0%" in text
    assert "td.wrap, tbody th.wrap { white-space: normal;" in text


def test_symbols_are_set_and_names_are_not() -> None:
    text = page(Document("a", [Section("b", ["C_p and ω_l of root_moment_1, f_x(t), x_max", Table(["K_T"], [["9"]])])]))
    assert "<p><i>C</i><sub>p</sub> and <i>ω</i><sub>l</sub> of root_moment_1, f_x(t), x_max</p>" in text
    assert "<th scope=col class=text><i>K</i><sub>T</sub></th>" in text


def test_tables_sort_and_numbers_keep_their_digits() -> None:
    """Thousands stand apart without a character between them: a cell is copied and sorted as a number."""
    rows = [["a", "153586", "12345.67 ± 123"], ["b", "0.123456", "2024"], ["c", "-98765", "4 of 5"]]
    text = page(Document("a", [Section("b", [Table(["what", "one", "two"], rows)])]))
    assert (
        '<table class="sortable">' in text and "<td>153<i>586</i></td><td>12<i>345</i>.67\u00a0±\u00a0123</td>" in text
    )
    assert "<td>0.123456</td><td>2024</td>" in text and "<td>-98<i>765</i></td>" in text
    assert Reader(text).open == []
    assert 'class="sortable"' not in page(Document("a", [Section("b", [TABLE])])), "two rows need no sorting"


def test_long_and_wide_tables_stay_within_the_page() -> None:
    text = page(Document("a", [Section("b", [Table([str(i) for i in range(14)], [["x"] * 14] * 30)])]))
    assert '<div class="wide tall many" tabindex="0">' in text
    assert ".wide { overflow-x: auto;" in text and ".wide.tall { max-height: 75vh; overflow: auto;" in text


def test_there_are_rules_for_paper_dark_and_narrow_screens(text: str) -> None:
    rules = text.split("<style>")[1].split("</style>")[0]
    assert rules.count("{") == rules.count("}")
    for rule in ("@media print", "@page", "@media screen and (prefers-color-scheme: dark)", "max-width: 40rem"):
        assert rule in rules
    dark = re.findall(r"@media screen and \(prefers-color-scheme: ?dark\) ?\{ ?:root ?\{(.*?)\}", rules, re.S)
    light = re.search(r":root \{(.*?)\}", rules, re.S)
    assert light is not None
    names = [set(re.findall(r"--\w[\w-]*(?=:)", part)) for part in (light[1], " ".join(dark))]
    assert names[0] <= names[1], "a colour has no dark counterpart"
    used = set(re.findall(r"var\((--\w[\w-]*)\)", rules)) - {"--share"}
    assert used <= names[1]


def test_pictures_enlarge_and_blocks_fold(text: str) -> None:
    assert '<figure class="picture"><img' in text and "figure.large" in text and 'class: "enlarge"' in text
    assert html_of(Folded("3 < 4", "words")) == "<details><summary>3 &lt; 4</summary><p>words</p></details>"
    assert html_of(Folded("a", TABLE, unfolded=True)).startswith("<details open>")


def test_reader_chooses_one_of_several_parts() -> None:
    blocks = chosen("Interface", [("a <b>", ["one"]), ("c", [TABLE])])
    text = page(Document("a", [Section("b", blocks), Section("c", chosen("x", [("only", ["one"])]))]))
    assert text.count("<option>") == 2 and "<option>a &lt;b&gt;</option>" in text and Reader(text).open == []


def test_the_first_sentence_leads() -> None:
    text = page(Document("a", [], lead="3 of 4 claims hold. At 9.9 rpm loads fall by 2. 5 of them matter. All < 1."))
    assert (
        '<div class="lead"><p>3 of 4 claims hold.</p>'
        "<ul><li>At 9.9 rpm loads fall by 2. 5 of them matter.</li><li>All &lt; 1.</li></ul></div>"
    ) in text
    assert Reader(text).open == []
    assert sentences("It works. So does this.") == ["It works. So does this."]


BROWSER = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome", "chrome"))), None)
ACT = """
<script>
const first = () => document.querySelector("tbody tr").cells[0].textContent;
const head = document.querySelectorAll("thead tr:last-child th")[2], told = [];
const figure = document.querySelector("figure");
head.click(); told.push(first());
head.click(); told.push(first());
figure.querySelector("button.enlarge").click(); told.push(figure.classList.contains("large"));
document.dispatchEvent(new KeyboardEvent("keydown", { key: "Escape" })); told.push(figure.classList.contains("large"));
document.querySelector("summary").click(); told.push(document.querySelector("details").open);
document.body.innerHTML = `<pre>${told.join(" ")}</pre>`;
</script>
"""


@pytest.mark.slow
@pytest.mark.skipif(BROWSER is None, reason="needs chromium or google-chrome")
def test_a_browser_sorts_tables_enlarges_pictures_and_unfolds(tmp_path: Path) -> None:
    rows = [["middle", "kN m", "12.5", ""], ["largest", "kN m", "100", ""], ["least", "kN m", "-3", ""]]
    sections = [Section("Numbers", [replace(TABLE, rows=rows), Picture(PNG, "A picture"), Folded("More", "of it")])]
    file = tmp_path / "page.html"
    file.write_text(page(Document("Page", sections)).replace("</body>", ACT + "</body>"), encoding="utf-8")
    how = ("--headless=new", "--no-sandbox", "--disable-gpu", "--dump-dom", f"--user-data-dir={tmp_path / 'profile'}")
    made = subprocess.run([str(BROWSER), *how, file.as_uri()], capture_output=True, text=True, timeout=60.0, check=True)
    assert "<pre>least largest true false true</pre>" in made.stdout
