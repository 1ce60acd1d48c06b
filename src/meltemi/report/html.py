"""Self-contained HTML pages with tables and figures."""

from __future__ import annotations

import base64
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path

from meltemi.core.files import bytes_of, write_text


@dataclass(frozen=True)
class Table:
    """A table.

    Attributes:
      head: names of the columns, with units.
      rows: cells; a row may be shorter than the head.
      caption: above the table.
      text_columns: how many of the first columns are text; the others are numbers, to the right.
      groups: a row above the head, of (text, columns that it spans); it must span all of them.
      note: below the table.
    """

    head: Sequence[str]
    rows: Sequence[Sequence[str]]
    caption: str = ""
    text_columns: int = 1
    groups: Sequence[tuple[str, int]] = ()
    note: str = ""


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


@dataclass(frozen=True)
class Markup:
    """HTML, whose texts are escaped already."""

    html: str


@dataclass(frozen=True)
class Section:
    """A heading and its content, in this order; a text is a paragraph."""

    heading: str
    content: Sequence[str | Table | Picture | Code | Markup]


def write_page(
    path: str | Path,
    title: str,
    sections: Sequence[Section],
    *,
    facts: Iterable[tuple[str, str]] = (),
    lead: str | Markup = "",
    footer: str = "",
    style: str = "",
    end: Markup | None = None,
) -> Path:
    """Write sections as one self-contained HTML file, without external resources.

    Args:
      path: of the file.
      title: of the page.
      sections: in their order; from three on there is a list of them at the top.
      facts: names and values below the title, such as turbine and wind.
      lead: the result in a sentence, in larger letters.
      footer: last line, such as version and licence.
      style: rules after those of all pages.
      end: of the page, such as its script.

    Raises:
      InputError: a picture cannot be read, or the file cannot be written.
    """
    text = page(title, sections, facts=facts, lead=lead, footer=footer, style=style, end=end)
    return write_text(Path(path), text)


def page(
    title: str,
    sections: Sequence[Section],
    *,
    facts: Iterable[tuple[str, str]] = (),
    lead: str | Markup = "",
    footer: str = "",
    style: str = "",
    end: Markup | None = None,
) -> str:
    """HTML text of the page of :func:`write_page`; all arguments are plain text."""
    parts = [f"<h1>{escape(title)}</h1>"]
    if described := [f"<div><dt>{plain(name)}</dt><dd>{plain(value)}</dd></div>" for name, value in facts]:
        parts.append(f'<dl class="facts">{"".join(described)}</dl>')
    if isinstance(lead, Markup):
        parts.append(lead.html)
    elif lead:
        parts.append(f'<p class="lead">{plain(lead)}</p>')
    places = [f"section-{i + 1}" for i in range(len(sections))]
    if len(sections) > 2:
        links = (f'<a href="#{at}">{escape(s.heading)}</a>' for at, s in zip(places, sections, strict=True))
        parts.append(f'<nav aria-label="Sections">{" ".join(links)}</nav>')
    for at, section in zip(places, sections, strict=True):
        body = "\n".join(_block(each) for each in section.content)
        parts.append(f'<section id="{at}">\n<h2>{escape(section.heading)}</h2>\n{body}\n</section>')
    if footer:
        parts.append(f"<footer>{escape(footer)}</footer>")
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{escape(title)}</title>\n<style>{STYLE}{style}</style>\n</head>\n<body>\n<main>\n"
        + "\n".join(parts)
        + "\n</main>\n"
        + (end.html if end else "")
        + "</body>\n</html>\n"
    )


def _block(block: str | Table | Picture | Code | Markup) -> str:
    if isinstance(block, str):
        return f"<p>{plain(block)}</p>"
    if isinstance(block, Markup):
        return block.html
    if isinstance(block, Code):
        return f"<pre><code>{escape(block.text)}</code></pre>"
    return _table(block) if isinstance(block, Table) else _picture(block)


LONG, WORDS = 16, 8
"""Characters of a cell above which it may be wrapped: of any, and of one that begins with a letter."""
SYMBOL = re.compile(r"(?<![\w.])([^\W\d_])_(\w|ref|opt|res|in|out|ave|maint)(?![\w(])")
"""A letter and its index, such as C_p and I_ref, but not a name such as x_max."""
TIED = re.compile(r"(?<=\d) (?=%|±)|(?<=±) ")
"""Spaces at which a number is not broken."""


def plain(text: str) -> str:
    """Escaped text, symbols set as in formulas, numbers kept together."""
    return SYMBOL.sub(r"<i>\1</i><sub>\2</sub>", TIED.sub("\u00a0", escape(text)))


def _table(table: Table) -> str:
    def cells(texts: Sequence[str], kind: str, first: str = "") -> str:
        found = []
        for i, text in enumerate(texts):
            tag = first if first and i == 0 else kind
            scope = {"th": " scope=row" if first else " scope=col", "td": ""}[tag]
            kinds = "text" * (i < table.text_columns) + " long" * (len(text) > (WORDS if text[:1].isalpha() else LONG))
            style = f' class="{kinds.strip()}"' if kinds else ""
            found.append(f"<{tag}{scope}{style}>{plain(text)}</{tag}>")
        return "".join(found)

    head = f"<tr>{cells(table.head, 'th')}</tr>"
    if table.groups:
        spans = "".join(
            f"<th colspan={span} scope=colgroup>{plain(text)}</th>" if text else f"<td colspan={span}></td>"
            for text, span in table.groups
        )
        head = f'<tr class="groups">{spans}</tr>{head}'
    rows = [f"<tr>{cells(row, 'td', 'th' if table.text_columns else '')}</tr>" for row in table.rows]
    caption = f"<caption>{plain(table.caption)}</caption>" if table.caption else ""
    note = f'<p class="note">{plain(table.note)}</p>' if table.note else ""
    # wide tables scroll within themselves; the page does not
    return (
        f'<div class="wide" tabindex="0"><table>{caption}<thead>{head}</thead>\n<tbody>\n'
        + "\n".join(rows)
        + f"\n</tbody></table></div>{note}"
    )


def _picture(picture: Picture) -> str:
    content = picture.png if isinstance(picture.png, bytes) else bytes_of(picture.png)
    data = base64.b64encode(content).decode("ascii")
    caption = f"<figcaption>{plain(picture.caption)}</figcaption>" if picture.caption else ""
    text = escape(picture.text or picture.caption)
    return f'<figure><img src="data:image/png;base64,{data}" alt="{text}">{caption}</figure>'


STYLE = """
:root { --ink: #1b2a38; --soft: #5b6873; --line: #d7dde2; --accent: #0b6e99; }
* { box-sizing: border-box; }
html { -webkit-text-size-adjust: 100%; }
body { margin: 0; background: #fff; color: var(--ink); line-height: 1.5;
  font-family: system-ui, -apple-system, "Segoe UI", Roboto, "Helvetica Neue", Arial, sans-serif; }
main { max-width: 100rem; margin: 0 auto; padding: 2rem 1.25rem 3rem; }
h1 { font-size: 1.75rem; line-height: 1.2; margin: 0 0 1rem; }
h2 { font-size: 1.25rem; margin: 2.5rem 0 .75rem; padding-top: .75rem; border-top: 2px solid var(--ink); }
p { max-width: 44rem; margin: .6rem 0; }
.lead { font-size: 1.15rem; line-height: 1.45; border-left: 4px solid var(--accent); padding-left: .9rem;
  margin: 1.2rem 0; }
.facts { display: flex; flex-wrap: wrap; gap: .4rem 2rem; margin: 0; }
.facts dt { font-size: .8rem; color: var(--soft); }
.facts dd { margin: 0; }
nav { display: flex; flex-wrap: wrap; gap: .2rem 1.2rem; margin: 1rem 0; font-size: .95rem; }
a { color: var(--accent); }
.wide { overflow-x: auto; margin: .8rem 0 .3rem; }
sub { line-height: 0; font-size: .75em; }
table { border-collapse: collapse; font-size: .9rem; font-variant-numeric: tabular-nums; }
caption { text-align: left; font-weight: 600; padding-bottom: .3rem; }
th, td { padding: .25rem .7rem; text-align: right; vertical-align: top; white-space: nowrap;
  border-bottom: 1px solid var(--line); }
th { font-weight: 600; }
thead th { vertical-align: bottom; white-space: pre-line; border-bottom: 1px solid var(--ink); }
tbody th { font-weight: 400; white-space: pre; position: sticky; left: 0; background: #fff; }
tr > :first-child { padding-left: 0; }
td.long, tbody th.long { white-space: normal; }
.text { text-align: left; }
.groups th { text-align: center; border-bottom: 1px solid var(--soft); }
.groups td { border: 0; }
tbody tr:hover > * { background: #f2f6f8; }
.note, figcaption, footer { color: var(--soft); font-size: .85rem; }
figure { margin: 1rem 0 1.5rem; }
img { display: block; max-width: 100%; height: auto; }
pre { background: #f2f6f8; padding: .8rem 1rem; white-space: pre-wrap;
  overflow-wrap: anywhere; border-radius: 4px; font-size: .85rem; }
footer { margin-top: 3rem; padding-top: .8rem; border-top: 1px solid var(--line); }
@media (max-width: 40rem) {
  main { padding: 1.2rem .9rem 2rem; } h1 { font-size: 1.4rem; } table { font-size: .82rem; }
  th, td { padding: .22rem .5rem; } figure { overflow-x: auto; } img { max-width: none; width: 40rem; } }
@media print { nav { display: none; } figure, tr { break-inside: avoid; } h2 { break-after: avoid; } }
"""
"""Style sheet: dark text on white, in the fonts of the reader's system."""
