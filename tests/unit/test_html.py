"""The page in one file: well-formed, nothing from outside, plain text stays plain text."""

from __future__ import annotations

import base64
from html.parser import HTMLParser
from pathlib import Path

import pytest

from meltemi import InputError
from meltemi.report.html import Code, Picture, Section, Table, page, write_page

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
    return page("A & B", SECTIONS, facts=[("turbine", "<mine>")], lead="It works.", footer="meltemi 0.1.0")


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
    assert "<nav" not in page("short", SECTIONS[:2])


def test_pictures_may_be_files(tmp_path: Path) -> None:
    (tmp_path / "one.png").write_bytes(PNG)
    written = write_page(tmp_path / "page.html", "files", [Section("one", [Picture(tmp_path / "one.png", "it")])])
    found = Reader(written.read_text(encoding="utf-8"))
    assert base64.b64decode(found.values("src")[0].partition(",")[2]) == PNG
    assert found.values("alt") == ["it"]
    with pytest.raises(InputError, match=r"two\.png: cannot be read"):
        page("files", [Section("two", [Picture(tmp_path / "two.png")])])
    with pytest.raises(InputError, match=r"page\.html: cannot be written"):
        write_page(tmp_path / "no" / "page.html", "files", [])


def test_long_cells_are_broken_and_numbers_are_not() -> None:
    """Verdicts of wide tables lay outside a window of 1200 pixels."""
    text = page(
        "a", [Section("b", [Table(["what", "value"], [["a claim of more than a few words", "-34.0 ± 3.0 %"]])])]
    )
    assert '<th scope=row class="text wrap">a claim' in text
    assert "<td>-34.0\u00a0±\u00a03.0\u00a0%" in text
    assert "td.wrap, tbody th.wrap { white-space: normal;" in text


def test_symbols_are_set_and_names_are_not() -> None:
    text = page("a", [Section("b", ["C_p and ω_l of root_moment_1, f_x(t), x_max", Table(["K_T"], [["9"]])])])
    assert "<p><i>C</i><sub>p</sub> and <i>ω</i><sub>l</sub> of root_moment_1, f_x(t), x_max</p>" in text
    assert "<th scope=col class=text><i>K</i><sub>T</sub></th>" in text
