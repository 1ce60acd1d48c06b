"""Self-contained HTML pages: one layout, style sheet and script for all.

A page begins with its result, then come contents and sections. Its tables sort and filter, its pictures enlarge, its
charts name what is under the pointer. Style and script are ``page.css`` and ``page.js`` beside this file; a page holds
them and all its data.
"""

from __future__ import annotations

import base64
import json
import math
import re
import shlex
from collections.abc import Sequence
from functools import cache
from html import escape
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from meltemi.core.files import bytes_of, text_of, write_text
from meltemi.report.palette import COLOURS, ON_DARK, SOFT
from meltemi.reports.blocks import (
    Beside,
    Block,
    Case,
    Cell,
    Chart,
    Choice,
    Code,
    Document,
    Drawing,
    Entry,
    Facts,
    Folded,
    Markup,
    Part,
    Picture,
    Share,
    Statistics,
    Table,
    Verdict,
    words,
)
from meltemi.reports.drawing import svg_of


def write_page(path: str | Path, document: Document) -> Path:
    """Write a document as one self-contained HTML file, without external resources.

    Raises:
      InputError: a picture cannot be read, or the file cannot be written.
    """
    return write_text(Path(path), page(document))


def result_first(text: str) -> Markup:
    """The lead of a page out of several sentences: the first one, then the others as a list."""
    first, *others = re.split(r"\.\s+(?=[A-Z])", text.strip().rstrip("."))
    more = f"<ul>{''.join(f'<li>{plain(each)}.</li>' for each in others)}</ul>" if others else ""
    return Markup(f'<div class="lead"><p>{plain(first)}.</p>{more}</div>')


def _begin(label: str) -> str:
    """A label with a capital letter at its beginning."""
    return label if label == "meltemi" else label[:1].upper() + label[1:]


def page(document: Document) -> str:
    """HTML text of the page of :func:`write_page`; from three sections on there is a list of them."""
    d = document
    parts = [f"<h1>{escape(d.title)}</h1>"]
    if described := [f"<div><dt>{plain(_begin(name))}</dt><dd>{plain(value)}</dd></div>" for name, value in d.facts]:
        parts.append(f'<dl class="facts">{"".join(described)}</dl>')
    if d.lead:
        parts.append(f'<p class="lead">{plain(d.lead)}</p>' if isinstance(d.lead, str) else html_of(d.lead))
    places = [f"section-{i + 1}" for i in range(len(d.sections))]
    if len(d.sections) > 2:
        links = (f'<a href="#{at}">{escape(s.heading)}</a>' for at, s in zip(places, d.sections, strict=True))
        parts.append(f'<nav aria-label="Contents">{" ".join(links)}</nav>')
    for at, section in zip(places, d.sections, strict=True):
        body = "\n".join(html_of(each) for each in section.content)
        parts.append(f'<section id="{at}">\n<h2>{escape(section.heading)}</h2>\n{body}\n</section>')
    if d.footer:
        parts.append(f"<footer>{escape(d.footer)}</footer>")
    about = {"bases": [shlex.quote(each.base) for each in d.cases], "cases": [list(each.names) for each in d.cases]}
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        '<meta name="color-scheme" content="light dark">\n'
        f"<title>{escape(d.title)}</title>\n<style>{_curve_colours()}{_beside('page.css')}{_running(d.running)}</style>\n"
        "</head>\n<body>\n<main>\n"
        + "\n".join(parts)
        + f"\n</main>\n{stored('page-data', about)}\n<script>{_beside('page.js')}</script>\n</body>\n</html>\n"
    )


def _running(text: str) -> str:
    """Rule for the foot of printed pages."""
    safe = re.sub(r"[^\w .,:;()/+-]", " ", text)
    return f'@page {{ @bottom-left {{ content: "{safe}"; font-size: 8pt; color: {SOFT}; }} }}' if text else ""


@cache
def _beside(name: str) -> str:
    return text_of(Path(__file__).with_name(name))


def _curve_colours() -> str:
    """Colours of curves as variables, on white and on black."""
    light, dark = ("".join(f"--c{i}:{c};" for i, c in enumerate(colours)) for colours in (COLOURS, ON_DARK))
    return f":root{{{light}}}@media screen and (prefers-color-scheme:dark){{:root{{{dark}}}}}"


def html_of(block: Block) -> str:
    """HTML of a block."""
    match block:
        case str():
            return f"<p>{plain(block)}</p>"
        case Markup():
            return block.html
        case Code():
            return f"<pre><code>{escape(block.text)}</code></pre>"
        case Table():
            return _table(block)
        case Picture():
            return _picture(block)
        case Chart():
            return _chart(block)
        case Statistics():
            return _statistics(block)
        case Drawing():
            caption = f"<figcaption>{plain(block.caption)}</figcaption>"
            return f'<figure class="sketch">{svg_of(block)}{caption}</figure>'
        case Facts():
            items = (
                f"<div><dt>{escape(n)}</dt><dd>{plain(v)}{_case(c) if c else ''}</dd></div>" for n, v, c in block.items
            )
            return f'<dl class="facts key">{"".join(items)}</dl>'
        case Verdict():
            lines = "".join(f"<li>{plain(line)}</li>" for line in block.lines)
            more = html_of(block.more) if block.more else ""
            body = (f"<ul>{lines}</ul>" if lines else "") + more
            return f'<div class="verdict {block.kind}"><h2>{plain(block.heading)}</h2>{body}</div>'
        case Folded():
            how = " open" if block.unfolded else ""
            return f"<details{how}><summary>{plain(block.summary)}</summary>{html_of(block.block)}</details>"
        case Part():
            return f'<div class="part"><h3>{plain(block.heading)}</h3>{"".join(map(html_of, block.content))}</div>'
        case Beside():
            return f'<div class="beside">{"".join(f"<div>{html_of(each)}</div>" for each in block.content)}</div>'
        case Choice():
            options = "".join(f"<option>{escape(each.heading)}</option>" for each in block.parts)
            select = f'<div class="choice"><label>{plain(block.label)} <select>{options}</select></label></div>'
            return f'<div class="choose">{select}{"".join(map(html_of, block.parts))}</div>'


def stored(place: str, content: Any) -> str:
    """Data within a page, for its script."""
    text = json.dumps(content, separators=(",", ":"), ensure_ascii=False, allow_nan=False)
    return f'<script type="application/json" id="{place}">{text.replace("<", chr(92) + "u003c")}</script>'


def _case(case: Case) -> str:
    """A case as a button, which shows its conditions and the command that repeats it."""
    which = f' data-base="{case.base}"' if case.base else ""
    which += f' data-case="{escape(case.name)}" title="{escape(case.name)}"' if case.text else ""
    return f'<button class="case"{which}>{escape(str(case))}</button>'


def _entry(entry: Entry) -> str:
    """A value, its case or note below it, and its utilisation as a number and a bar."""
    value = "" if entry.value is None else f"<b>{shown(entry.value)}</b>"
    small = "".join(
        f"<small>{each}</small>" for each in (_case(entry.case) if entry.case else "", plain(entry.note)) if each
    )
    if not math.isfinite(entry.ratio):
        return value + small
    state = " over" if entry.ratio > 1.0 else " near" if entry.ratio > NEAR else ""
    width = 100.0 * min(max(entry.ratio, 0.0), 1.0)
    bar = f'<span class="bar{state}"><i style="width:{width:.0f}%"></i></span>'
    return f'{value}{small}<small class="ratio{state}">{entry.ratio:.2f}</small>{bar}'


NEAR = 0.95
"""Utilisation from which it is marked."""
LONG = 25
"""Rows above which a table scrolls within itself."""
WIDE, NARROW = 12, 7
"""Columns above which a table has smaller letters, and up to which two of a choice stand side by side on paper."""
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
    match value:
        case Case():
            return _case(value)
        case Entry():
            return _entry(value)
        case Share():
            return f'<span class="share" style="--share:{100.0 * value.value:.0f}%">{value}</span>'
    text = words(value)
    return apart(plain(text)) if THOUSANDS.fullmatch(text) else plain(text)


def _table(table: Table) -> str:
    left = table.left()

    def cell(value: Cell, i: int, j: int) -> str:
        size = len(value) if isinstance(value, str) else 0
        kinds = ("text" if j in left else "", "wrap" if size > WRAPPED else "", "long" if size > SENTENCE else "")
        named = " ".join(filter(None, (table.classes.get((i, j), ""), *kinds)))
        tag = "th scope=row" if j == 0 and table.text_columns else "td"
        kind = f' class="{named}"' if named else ""
        return f"<{tag}{kind}>{shown(value)}</{tag[:2]}>"

    sides = [" class=text" if j in left else "" for j in range(len(table.head))]
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
    columns = len(table.head)
    kind = (
        "wide" + " tall" * (len(rows) > LONG) + (" many" if columns > WIDE else " narrow" if columns <= NARROW else "")
    )
    sentences = {
        j for row in table.rows for j, value in enumerate(row) if isinstance(value, str) and len(value) > SENTENCE
    }
    kind += " texts" * (len(sentences) > 1)
    sortable = ' class="sortable"' if len(rows) > 2 else ""
    # wide tables scroll within themselves; the page does not
    made = (
        f'<div class="{kind}" tabindex="0"><table{sortable}>{caption}<thead>{head}</thead>\n<tbody>\n'
        + "\n".join(rows)
        + f"\n</tbody></table></div>{note}"
    )
    return f'<p class="paper">{plain(table.paper)}</p><div class="screen">{made}</div>' if table.paper else made


def _picture(picture: Picture) -> str:
    content = picture.png if isinstance(picture.png, bytes) else bytes_of(picture.png)
    data = base64.b64encode(content).decode("ascii")
    caption = f"<figcaption>{plain(picture.caption)}</figcaption>" if picture.caption else ""
    text = escape(picture.text or picture.caption)
    return f'<figure class="picture"><img src="data:image/png;base64,{data}" alt="{text}">{caption}</figure>'


# ------------------------------------------------------------------------------------------------------- charts

_numbers = count(1)


def _place(kind: str) -> str:
    """A place for data on a page that no other has, such as ``chart-3``."""
    return f"{kind}-{next(_numbers)}"


def _chart(chart: Chart) -> str:
    place, polar = _place("chart"), chart.polar or bool(chart.spokes)
    series = []
    for c in chart.curves:
        given = {"name": c.name, "x": rounded(c.x), "y": rounded(c.y), "dots": c.dots, "dash": c.dash, "base": c.base}
        optional = {"y2": None if c.upper is None else rounded(c.upper), "colour": c.colour, "cases": c.cases}
        series.append(given | {key: value for key, value in optional.items() if value is not None})
    axes = {
        key: {"label": a.label, "unit": a.unit, "log": a.log} | ({} if a.start is None else {"from": a.start})
        for key, a in (("x", chart.x), ("y", chart.y))
    }
    spokes = {"spokes": list(chart.spokes)} if chart.spokes else {}
    spec = {"title": chart.title, "polar": polar, "series": series} | axes | spokes
    caption = f"<figcaption><b>{plain(chart.title)}</b> {plain(chart.caption)}</figcaption>"
    kind = "chart polar" if polar else "chart"
    return f'{stored(place, spec)}<figure class="{kind}" data-chart="{place}">{caption}</figure>'


def rounded(values: ArrayLike) -> list[float | None]:
    """Numbers with the digits that :func:`number` shows; None where they are not finite."""
    return [_short(v) if math.isfinite(v) else None for v in np.asarray(values, dtype=float).tolist()]


def _short(value: float) -> float:
    return round(value) if abs(value) >= 1e3 else float(f"{value:.4g}")


def _statistics(block: Statistics) -> str:
    channels = list(dict.fromkeys(each["label"] for base in block.bases for each in base["channels"]))
    across = list(dict.fromkeys(each["label"] for base in block.bases for each in base["across"]))
    place = _place("statistics")
    values = '<option value="max min">max and min</option><option>mean</option><option>max</option><option>min</option>'
    choices = [
        _select("Channel", channels, block.first),
        _select("over", [*across, *channels]),
        f"<label>values <select>{values}</select></label>",
    ]
    figure = (
        f'<figure class="chart" data-statistics="{place}"><div class="choice">{"".join(choices)}</div>'
        f'<figcaption>{plain(block.caption)}</figcaption></figure><div class="beside paper" data-all="{place}"></div>'
    )
    return stored(place, block.bases) + figure


def _select(label: str, names: Sequence[str], first: str = "") -> str:
    options = (f"<option{' selected' if name == first else ''}>{escape(name)}</option>" for name in names)
    return f"<label>{label} <select>{''.join(options)}</select></label>"
