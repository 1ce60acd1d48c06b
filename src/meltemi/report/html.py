"""Self-contained HTML pages: one layout, style sheet and script for all.

A page begins with its result, then come contents and sections. Its tables sort and filter, its pictures enlarge, its
charts name what is under the pointer. Style and script are ``page.css`` and ``page.js`` beside this file; a page holds
them and all its data.
"""

from __future__ import annotations

import base64
import json
import re
import shlex
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from html import escape
from pathlib import Path
from typing import Any

from meltemi.core.files import bytes_of, text_of, write_text
from meltemi.report.palette import COLOURS, ON_DARK
from meltemi.report.turbine_facts import number


@dataclass(frozen=True)
class Markup:
    """HTML, whose texts are escaped already."""

    html: str


Cell = str | float | Markup | None
"""Of a table: text, a number, or HTML."""


@dataclass(frozen=True)
class Table:
    """A table, which the reader sorts by a click on the head of a column.

    Attributes:
      head: names of the columns, with units; a line break separates the two.
      rows: cells; a row may be shorter than the head.
      caption: above the table.
      text_columns: how many of the first columns are text; others are if most of their cells begin with a letter.
        Numbers stand to the right.
      groups: a row above the head, of (text, columns that it spans); it must span all of them.
      note: below the table.
      classes: of cells, by row and column.
      ids: of rows.
    """

    head: Sequence[str]
    rows: Sequence[Sequence[Cell]]
    caption: str = ""
    text_columns: int = 1
    groups: Sequence[tuple[str, int]] = ()
    note: str = ""
    classes: Mapping[tuple[int, int], str] = field(default_factory=dict)
    ids: Sequence[str] = ()

    @property
    def texts(self) -> list[list[str]]:
        """Cells as text, as in files of other kinds."""
        return [["" if cell is None else str(cell) for cell in row] for row in self.rows]


@dataclass(frozen=True)
class Picture:
    """A picture: a PNG file, or its bytes.

    Attributes:
      png: the file or its content; it becomes part of the page.
      caption: below the picture.
      text: what it shows, for those who cannot see it; the caption by default.
    """

    png: Path | bytes
    caption: str = ""
    text: str = ""


@dataclass(frozen=True)
class Code:
    """Verbatim text, such as a command line."""

    text: str


Block = str | Table | Picture | Code | Markup
"""Of a section; a text is a paragraph."""


@dataclass(frozen=True)
class Section:
    """A heading and its content, in this order."""

    heading: str
    content: Sequence[Block]


@dataclass(frozen=True)
class CaseList:
    """Cases of a load base: its path as in commands, and their names."""

    base: str
    names: Sequence[str]


def write_page(
    path: str | Path,
    title: str,
    sections: Sequence[Section],
    *,
    facts: Iterable[tuple[str, str]] = (),
    lead: str | Markup = "",
    footer: str = "",
    cases: Sequence[CaseList] = (),
) -> Path:
    """Write sections as one self-contained HTML file, without external resources.

    Args:
      path: of the file.
      title: of the page.
      sections: in their order; from three on there is a list of them.
      facts: names and values below the title, such as turbine and wind.
      lead: the result, before everything else.
      footer: last line, such as version and licence.
      cases: of each load base on the page; a click on one shows its conditions and its command.

    Raises:
      InputError: a picture cannot be read, or the file cannot be written.
    """
    return write_text(Path(path), page(title, sections, facts=facts, lead=lead, footer=footer, cases=cases))


def result_first(text: str) -> Markup:
    """The lead of a page out of several sentences: the first one, then the others as a list."""
    first, *others = re.split(r"\.\s+(?=[A-Z])", text.strip().rstrip("."))
    more = f"<ul>{''.join(f'<li>{plain(each)}.</li>' for each in others)}</ul>" if others else ""
    return Markup(f'<div class="lead"><p>{plain(first)}.</p>{more}</div>')


def _begin(label: str) -> str:
    """A label with a capital letter at its beginning."""
    return label if label == "meltemi" else label[:1].upper() + label[1:]


def page(
    title: str,
    sections: Sequence[Section],
    *,
    facts: Iterable[tuple[str, str]] = (),
    lead: str | Markup = "",
    footer: str = "",
    cases: Sequence[CaseList] = (),
) -> str:
    """HTML text of the page of :func:`write_page`; all arguments are plain text."""
    parts = [f"<h1>{escape(title)}</h1>"]
    if described := [f"<div><dt>{plain(_begin(name))}</dt><dd>{plain(value)}</dd></div>" for name, value in facts]:
        parts.append(f'<dl class="facts">{"".join(described)}</dl>')
    if lead:
        parts.append(lead.html if isinstance(lead, Markup) else f'<p class="lead">{plain(lead)}</p>')
    places = [f"section-{i + 1}" for i in range(len(sections))]
    if len(sections) > 2:
        links = (f'<a href="#{at}">{escape(s.heading)}</a>' for at, s in zip(places, sections, strict=True))
        parts.append(f'<nav aria-label="Contents">{" ".join(links)}</nav>')
    for at, section in zip(places, sections, strict=True):
        body = "\n".join(html_of(each) for each in section.content)
        parts.append(f'<section id="{at}">\n<h2>{escape(section.heading)}</h2>\n{body}\n</section>')
    if footer:
        parts.append(f"<footer>{escape(footer)}</footer>")
    about = {"bases": [shlex.quote(each.base) for each in cases], "cases": [list(each.names) for each in cases]}
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        '<meta name="color-scheme" content="light dark">\n'
        f"<title>{escape(title)}</title>\n<style>{_curve_colours()}{_beside('page.css')}</style>\n</head>\n<body>\n<main>\n"
        + "\n".join(parts)
        + f"\n</main>\n{stored('page-data', about)}\n<script>{_beside('page.js')}</script>\n</body>\n</html>\n"
    )


@cache
def _beside(name: str) -> str:
    return text_of(Path(__file__).with_name(name))


def _curve_colours() -> str:
    """Colours of curves as variables, on white and on black."""
    light, dark = ("".join(f"--c{i}:{c};" for i, c in enumerate(colours)) for colours in (COLOURS, ON_DARK))
    return f":root{{{light}}}@media screen and (prefers-color-scheme:dark){{:root{{{dark}}}}}"


def html_of(block: Block) -> str:
    """HTML of a block."""
    if isinstance(block, str):
        return f"<p>{plain(block)}</p>"
    if isinstance(block, Markup):
        return block.html
    if isinstance(block, Code):
        return f"<pre><code>{escape(block.text)}</code></pre>"
    return _table(block) if isinstance(block, Table) else _picture(block)


def together(*parts: Block) -> Markup:
    """Blocks in one piece, texts without paragraphs of their own."""
    return Markup("".join(plain(p) if isinstance(p, str) else html_of(p) for p in parts))


def stored(place: str, content: Any) -> str:
    """Data within a page, for its script."""
    text = json.dumps(content, separators=(",", ":"), ensure_ascii=False, allow_nan=False)
    return f'<script type="application/json" id="{place}">{text.replace("<", chr(92) + "u003c")}</script>'


def case_button(name: str, base: int = 0, text: str = "") -> Markup:
    """Name of a case, or a text in its place; shows its conditions and the command that repeats it."""
    which = f' data-base="{base}"' if base else ""
    which += f' data-case="{escape(name)}" title="{escape(name)}"' if text else ""
    return Markup(f'<button class="case"{which}>{escape(text or name)}</button>')


def folded(summary: str, block: Block, *, unfolded: bool = False) -> Markup:
    """A block that a click on its summary shows and hides."""
    how = " open" if unfolded else ""
    return Markup(f"<details{how}><summary>{plain(summary)}</summary>{html_of(block)}</details>")


LONG = 25
"""Rows above which a table scrolls within itself."""
WIDE = 12
"""Columns above which a table has smaller letters on paper."""
WRAPPED, SENTENCE = 16, 40
"""Characters of a cell above which it may be wrapped, and above which it has a least width."""
SYMBOL = re.compile(r"(?<![\w.])([^\W\d_])_(\w|ref|opt|res|in|out|ave|maint)(?![\w(])")
"""A letter and its index, such as C_p and I_ref, but not a name such as x_max."""
TIED = re.compile(r"(?<=\d) (?=%|±)|(?<=±) |(?<=\b\w) (?== \d)|(?<=\b\w =) (?=\d)")
"""Spaces at which a number is not broken."""
THOUSANDS = re.compile(r"[-+]?\d{5,}(?:\.\d*)?(?: ± \d+(?:\.\d*)?)?(?: [^\W\d]\S*)?")
"""A cell whose thousands stand apart."""


def plain(text: str) -> str:
    """Escaped text, symbols set as in formulas, numbers kept together."""
    return SYMBOL.sub(r"<i>\1</i><sub>\2</sub>", TIED.sub("\u00a0", escape(text)))


def apart(text: str) -> str:
    """A number whose thousands stand apart; without spaces, so that it is copied and sorted as a number."""
    return re.sub(
        r"(?<![\d.])\d{5,}", lambda found: re.sub(r"(?<=\d)(\d{3})(?=(?:\d{3})*$)", r"<i>\1</i>", found[0]), text
    )


def shown(value: Cell) -> str:
    """HTML of a cell."""
    if value is None:
        return ""
    if isinstance(value, Markup):
        return value.html
    text = value if isinstance(value, str) else number(value)
    return apart(plain(text)) if THOUSANDS.fullmatch(text) else plain(text)


def _is_text(value: Cell) -> bool:
    if isinstance(value, Markup):
        return value.html.startswith("<button")
    return isinstance(value, str) and value[:1].isalpha()


def _table(table: Table) -> str:
    places = range(len(table.head))
    filled = [[row[j] for row in table.rows if j < len(row) and row[j] not in (None, "")] for j in places]
    left = {j for j, own in enumerate(filled) if j < table.text_columns or 2 * sum(map(_is_text, own)) > len(own)}

    def cell(value: Cell, i: int, j: int) -> str:
        size = len(value) if isinstance(value, str) else 0
        kinds = ("text" if j in left else "", "wrap" if size > WRAPPED else "", "long" if size > SENTENCE else "")
        named = " ".join(filter(None, (table.classes.get((i, j), ""), *kinds)))
        tag = "th scope=row" if j == 0 and table.text_columns else "td"
        kind = f' class="{named}"' if named else ""
        return f"<{tag}{kind}>{shown(value)}</{tag[:2]}>"

    sides = [" class=text" if j in left else "" for j in places]
    names = (f"<th scope=col{side}>{plain(name)}</th>" for side, name in zip(sides, table.head, strict=True))
    head = f"<tr>{''.join(names)}</tr>"
    if table.groups:
        spans = "".join(
            f"<th colspan={span} scope=colgroup>{plain(text)}</th>" if text else f"<td colspan={span}></td>"
            for text, span in table.groups
        )
        head = f'<tr class="groups">{spans}</tr>{head}'
    ids = [f' id="{escape(each)}"' for each in table.ids] or [""] * len(table.rows)
    rows = [
        f"<tr{key}>{''.join(cell(value, i, j) for j, value in enumerate(row))}</tr>"
        for i, (key, row) in enumerate(zip(ids, table.rows, strict=True))
    ]
    caption = f"<caption>{plain(table.caption)}</caption>" if table.caption else ""
    note = f'<p class="note">{plain(table.note)}</p>' if table.note else ""
    kind = "wide" + " tall" * (len(rows) > LONG) + " many" * (len(table.head) > WIDE)
    sortable = ' class="sortable"' if len(rows) > 2 else ""
    # wide tables scroll within themselves; the page does not
    return (
        f'<div class="{kind}" tabindex="0"><table{sortable}>{caption}<thead>{head}</thead>\n<tbody>\n'
        + "\n".join(rows)
        + f"\n</tbody></table></div>{note}"
    )


def _picture(picture: Picture) -> str:
    content = picture.png if isinstance(picture.png, bytes) else bytes_of(picture.png)
    data = base64.b64encode(content).decode("ascii")
    caption = f"<figcaption>{plain(picture.caption)}</figcaption>" if picture.caption else ""
    text = escape(picture.text or picture.caption)
    return f'<figure class="picture"><img src="data:image/png;base64,{data}" alt="{text}">{caption}</figure>'
