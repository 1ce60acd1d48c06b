"""Self-contained HTML pages whose tables sort and filter, and whose charts name what is under the pointer.

Style and script are ``interactive.css`` and ``interactive.js`` beside this file; the page holds them and all its data.
"""

from __future__ import annotations

import json
import math
import shlex
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from html import escape
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from meltemi.core.files import text_of
from meltemi.report.html import Markup, Section, plain, write_page
from meltemi.report.palette import COLOURS
from meltemi.report.turbine_facts import number

Cell = str | float | Markup | None
"""Of a table: text, a number, or HTML."""
LONG = 25
"""Rows above which a table scrolls within itself."""
WRAPPED = 40
"""Characters above which a text is wrapped."""


@dataclass(frozen=True)
class Axis:
    """Of a chart. ``start``: a value that it must contain."""

    label: str
    unit: str = ""
    log: bool = False
    start: float | None = None


@dataclass(frozen=True)
class Curve:
    """Of a chart.

    Attributes:
      name: curves of one name are switched on and off together.
      x, y: points; those that are not finite are left out.
      upper: (N,) upper bound of a band whose lower one is ``y``.
      dots: points instead of a line.
      dash: pattern of the line, such as "5 4".
      colour: number in the palette; by default that of its place.
      cases: places of the points' cases in the page's list of names.
      base: which list.
    """

    name: str
    x: ArrayLike
    y: ArrayLike
    upper: ArrayLike | None = None
    dots: bool = False
    dash: str = ""
    colour: int | None = None
    cases: Sequence[int] | None = None
    base: int = 0


_numbers = count(1)


def place_of(kind: str) -> str:
    """A place for data on a page that no other has, such as ``chart-3``."""
    return f"{kind}-{next(_numbers)}"


def chart(title: str, x: Axis, y: Axis, curves: Sequence[Curve], *, caption: str = "", polar: bool = False) -> Markup:
    """A chart of lines, dots and bands; ``polar``: x are angles [deg], anticlockwise from the right."""
    place = place_of("chart")
    series = []
    for c in curves:
        given = {"name": c.name, "x": rounded(c.x), "y": rounded(c.y), "dots": c.dots, "dash": c.dash, "base": c.base}
        optional = {"y2": None if c.upper is None else rounded(c.upper), "colour": c.colour, "cases": c.cases}
        series.append(given | {key: value for key, value in optional.items() if value is not None})
    axes = {
        key: {"label": a.label, "unit": a.unit, "log": a.log} | ({} if a.start is None else {"from": a.start})
        for key, a in (("x", x), ("y", y))
    }
    spec = {"title": title, "polar": polar, "series": series} | axes
    words = f"<figcaption><b>{plain(title)}</b> {plain(caption)}</figcaption>"
    kind = "chart polar" if polar else "chart"
    return Markup(f'{stored(place, spec)}<figure class="{kind}" data-chart="{place}">{words}</figure>')


def stored(place: str, content: Any) -> str:
    """Data within a page, for its script."""
    text = json.dumps(content, separators=(",", ":"), ensure_ascii=False, allow_nan=False)
    return f'<script type="application/json" id="{place}">{text.replace("<", chr(92) + "u003c")}</script>'


def rounded(values: ArrayLike) -> list[float | None]:
    """Numbers with the digits that :func:`number` shows; None where they are not finite."""
    return [_short(v) if math.isfinite(v) else None for v in np.asarray(values, dtype=float).tolist()]


def _short(value: float) -> float:
    return round(value) if abs(value) >= 1e3 else float(f"{value:.4g}")


def case_button(name: str, base: int = 0, text: str = "") -> Markup:
    """Name of a case, or a text in its place; shows its conditions and the command that repeats it."""
    which = f' data-base="{base}"' if base else ""
    which += f' data-case="{escape(name)}" title="{escape(name)}"' if text else ""
    return Markup(f'<button class="case"{which}>{escape(text or name)}</button>')


def together(*parts: str | Markup) -> Markup:
    """Texts and HTML in one piece."""
    return Markup("".join(p.html if isinstance(p, Markup) else plain(p) for p in parts))


def part(heading: str, *blocks: Markup, of: str = "") -> Markup:
    """Blocks under a small heading; of several of the same ``of`` the screen shows the one that is chosen."""
    within = f' data-part="{escape(of)}"' if of else ""
    return Markup(f'<div class="part"{within}><h3>{plain(heading)}</h3>{"".join(b.html for b in blocks)}</div>')


def beside(*blocks: Markup) -> Markup:
    """Blocks beside each other where there is room."""
    return Markup(f'<div class="beside">{"".join(f"<div>{each.html}</div>" for each in blocks)}</div>')


def choice(label: str, names: Iterable[str], of: str) -> Markup:
    """Choice of one of several parts."""
    options = "".join(f"<option>{escape(name)}</option>" for name in names)
    select = f'<select class="choose" data-of="{escape(of)}">{options}</select>'
    return Markup(f'<div class="choice"><label>{plain(label)} {select}</label></div>')


@dataclass(frozen=True)
class Look:
    """Of a table.

    Attributes:
      caption: above it.
      sortable: by a click on the head of a column.
      classes: of cells, by row and column.
      ids: of rows.
    """

    caption: str = ""
    sortable: bool = True
    classes: Mapping[tuple[int, int], str] = field(default_factory=dict)
    ids: Sequence[str] = ()


def grid(head: Sequence[str], rows: Sequence[Sequence[Cell]], look: Look = Look()) -> Markup:
    """A table; a line break in its head separates name and unit. Texts are to the left, numbers to the right."""
    left = {j for row in rows for j, value in enumerate(row) if j == 0 or _is_text(value)}

    def cell(value: Cell, i: int, j: int) -> str:
        wraps = "long" if isinstance(value, str) and len(value) > WRAPPED else ""
        kinds = " ".join(filter(None, (look.classes.get((i, j), ""), "text" if j in left else "", wraps)))
        kind = f' class="{kinds}"' if kinds else ""
        tag, scope = ("th", " scope=row") if j == 0 else ("td", "")
        return f"<{tag}{scope}{kind}>{shown(value)}</{tag}>"

    heads = "".join(
        f"<th scope=col{' class=text' if j in left else ''}>{plain(name)}</th>" for j, name in enumerate(head)
    )
    ids = [f' id="{escape(each)}"' for each in look.ids] or [""] * len(rows)
    lines = [
        f"<tr{key}>{''.join(cell(value, i, j) for j, value in enumerate(row))}</tr>"
        for i, (key, row) in enumerate(zip(ids, rows, strict=True))
    ]
    caption = f"<caption>{plain(look.caption)}</caption>" if look.caption else ""
    kind = ' class="sortable"' if look.sortable else ""
    return Markup(
        f'<div class="wide{" long" if len(rows) > LONG else ""}" tabindex="0"><table{kind}>{caption}'
        f"<thead><tr>{heads}</tr></thead>\n<tbody>\n{chr(10).join(lines)}\n</tbody></table></div>"
    )


def _is_text(value: Cell) -> bool:
    if isinstance(value, Markup):
        return value.html.startswith("<button")
    return isinstance(value, str) and value[:1].isalpha()


def shown(value: Cell) -> str:
    """HTML of a cell."""
    if value is None:
        return ""
    if isinstance(value, Markup):
        return value.html
    return plain(value) if isinstance(value, str) else number(value)


@dataclass(frozen=True)
class CaseList:
    """Cases of a load base: its path as in commands, and their names."""

    base: str
    names: Sequence[str]


def write_interactive(
    path: str | Path,
    title: str,
    sections: Sequence[Section],
    cases: Sequence[CaseList],
    **page: Any,
) -> Path:
    """Write sections as one HTML file that needs nothing else.

    Args:
      path: of the file.
      title: of the page.
      sections: in their order.
      cases: of each load base on the page.
      page: ``facts``, ``lead`` and ``footer`` of :func:`write_page`.

    Raises:
      InputError: the file cannot be written.
    """
    about = {"bases": [shlex.quote(each.base) for each in cases], "cases": [list(each.names) for each in cases]}
    style, script = (text_of(Path(__file__).with_name(f"interactive.{kind}")) for kind in ("css", "js"))
    end = Markup(f"{stored('page-data', about | {'colours': COLOURS})}\n<script>{script}</script>\n")
    return write_page(path, title, sections, style=style, end=end, **page)
