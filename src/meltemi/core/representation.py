"""Representations of objects in notebooks: a title, key figures, and sections that fold.

They contain no script, take the colours of the notebook, light or dark, and escape all text. Classes give their content
as a :class:`Card`; this module draws it.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from html import escape
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from pydantic import BaseModel

from meltemi.core.display import brief, is_default, quantity, rounded
from meltemi.core.units import display, unit_of

STYLE = """\
.meltemi{font-size:13px;line-height:1.45;text-align:left;color:inherit;max-width:64em}
.meltemi p{margin:0}
.meltemi .lead{opacity:.85}
.meltemi details{margin:.15em 0 0 .2em}
.meltemi details details{margin-left:1em}
.meltemi summary{cursor:pointer;padding:.1em 0}
.meltemi summary span{opacity:.7;margin-left:.5em}
.meltemi .wide{overflow:auto;max-height:30em;margin:.1em 0 .4em 1.1em}
.meltemi.meltemi table{border-collapse:collapse;border:0;margin:0;font-size:12px;color:inherit;
width:auto;table-layout:auto}
.meltemi.meltemi.meltemi tr:nth-child(n){background:none}
.meltemi.meltemi th,.meltemi.meltemi td{text-align:left;padding:1px 1.2em 1px 0;border:0;border-bottom:1px solid #8884;
font-weight:normal;vertical-align:top;white-space:nowrap;max-width:none}
.meltemi.meltemi th{opacity:.75}
.meltemi.meltemi td.number,.meltemi.meltemi th.number{text-align:right;font-variant-numeric:tabular-nums}
.meltemi.meltemi td.long{white-space:normal;opacity:.75;min-width:16em}
.meltemi svg{display:block;width:120px;height:18px}
.meltemi svg path{fill:none;stroke:#4a90d9;stroke-width:1;vector-effect:non-scaling-stroke}
.meltemi .good{color:#2e9e6b}.meltemi .bad{color:#e0564a}.meltemi .doubtful{color:#c98a1b}
"""
BINS, HEIGHT = 60, 18
"""Intervals of a small line, each with its smallest and largest value, and its height in units of its picture."""
MOST_ROWS = 60
"""Rows of a table; of more, their number is given."""
LONG = 40
"""Characters from which a text cell may wrap."""
MOST_INSIDE = 12
"""Records in a list or dictionary that are shown; of more, the names."""


class Html(str):
    """HTML that is not escaped."""

    __slots__ = ()


@dataclass(frozen=True)
class Fold:
    """A part of a representation that folds.

    Attributes:
      title: title of the part.
      rows: cells of its table.
      head: titles of the columns; empty for names and values.
      note: shown beside the title while it is folded, such as the number of rows.
      open: whether the part is unfolded at first.
      inside: sections inside this one, below its table.
    """

    title: str
    rows: Sequence[Sequence[str]] = ()
    head: Sequence[str] = ()
    note: str = ""
    open: bool = False
    inside: Sequence[Fold] = ()


@dataclass(frozen=True)
class Card:
    """Representation of an object in a notebook.

    Attributes:
      title: class of the object.
      lead: one line that describes the object.
      facts: names and values of the key figures.
      sections: parts that fold.
    """

    title: str
    lead: str = ""
    facts: Sequence[Sequence[str]] = ()
    sections: Sequence[Fold] = ()

    def folded(self, title: str) -> Fold:
        """The card as a section of another one."""
        return Fold(title, self.facts, note=self.lead or self.title, inside=self.sections)


def html(card: Card) -> str:
    """The card as an HTML element."""
    lead = f' <span class="lead">{_text(card.lead)}</span>' if card.lead else ""
    facts = _table(card.facts, ()) if card.facts else ""
    inside = "".join(map(_section, card.sections))
    return f'<div class="meltemi"><style>{STYLE}</style><p><b>{_text(card.title)}</b>{lead}</p>{facts}{inside}</div>'


def badge(text: str, kind: str) -> Html:
    """A word with the colour of its ``kind``: good, doubtful, bad."""
    return Html(f'<span class="{escape(kind)}">&#9679;</span> {escape(text, quote=False)}')


def sparkline(values: ArrayLike) -> Html:
    """A small line of a series without axes, from its smallest to its largest value; empty for less than two values."""
    x = np.asarray(values, dtype=float).ravel()
    x = x[np.isfinite(x)]
    if len(x) < 2:
        return Html("")
    low, high = float(x.min()), float(x.max())
    scale = (HEIGHT - 2.0) / (high - low) if high > low else 0.0
    points = []
    if len(x) <= 2 * BINS:
        points = [(2.0 * BINS * i / (len(x) - 1), v) for i, v in enumerate(x)]
    else:
        for i, part in enumerate(np.array_split(x, BINS)):
            ends = sorted((int(part.argmin()), int(part.argmax())))  # in the order in which they occur
            points += [(2.0 * i + k, part[end]) for k, end in enumerate(ends)]
    middle = 0.5 * HEIGHT if scale == 0.0 else HEIGHT - 1.0
    path = " ".join(f"{place:.0f},{middle - scale * (v - low):.1f}" for place, v in points)
    frame = f'viewBox="0 0 {2 * BINS} {HEIGHT}" preserveAspectRatio="none" aria-hidden="true"'
    return Html(f'<svg {frame}><path d="M{path}"/></svg>')


def _section(section: Fold) -> str:
    note = f"<span>{_text(section.note)}</span>" if section.note else ""
    table = _table(section.rows, section.head) if section.rows else ""
    inside = "".join(map(_section, section.inside))
    if not table and not inside:
        return f"<p>{_text(section.title)}{note}</p>"
    opening = "<details open>" if section.open else "<details>"
    return f"{opening}<summary>{_text(section.title)}{note}</summary>{table}{inside}</details>"


def _table(rows: Iterable[Sequence[str]], head: Sequence[str]) -> str:
    rows = list(rows)
    more = f"<p>and {len(rows) - MOST_ROWS} more</p>" if len(rows) > MOST_ROWS else ""
    rows = rows[:MOST_ROWS]
    columns = [[row[i] for row in rows if i < len(row)] for i in range(len(head))]
    numeric = [any(column) and all(_numeric(cell) for cell in column) for column in columns]

    def line(cells: Sequence[str], tag: str) -> str:
        return "".join(_cell(cell, tag, i < len(numeric) and numeric[i]) for i, cell in enumerate(cells))

    top = f"<thead><tr>{line(head, 'th')}</tr></thead>" if head else ""
    body = "".join(
        f"<tr>{line(row, 'td') if head else _cell(row[0], 'th', False) + line(row[1:], 'td')}</tr>" for row in rows
    )
    return f'<div class="wide"><table>{top}<tbody>{body}</tbody></table>{more}</div>'


def _cell(text: str, tag: str, number: bool) -> str:
    kind = "number" if number else "long" if tag == "td" and len(text) > LONG and not isinstance(text, Html) else ""
    return f"<{tag}{f' class={kind}' if kind else ''}>{_text(text)}</{tag}>"


def _numeric(cell: str) -> bool:
    """Whether a cell is a number, alone or with a unit; empty cells and dashes are."""
    if isinstance(cell, Html):
        return False
    first = cell.split(" ", 1)[0].rstrip("%")
    if first in ("", "-"):
        return True
    try:
        float(first)
    except ValueError:
        return False
    return True


def _text(text: str) -> str:
    return text if isinstance(text, Html) else escape(text, quote=False)


def record_card(record: BaseModel) -> Card:
    """Card of an input record: what differs from the defaults, then the defaults, folded; records in it fold."""
    given: list[tuple[str, ...]] = []
    usual: list[tuple[str, ...]] = []
    inside: list[Fold] = []
    for name, field in type(record).model_fields.items():
        value, about = getattr(record, name), field.description or ""
        if sections := _records_in(name, value):
            inside += sections
        elif value is not None or field.is_required():
            row = (_words(name), *_value(value, unit_of(about), name), _first_sentence(about))
            (usual if is_default(value, field) else given).append(row)
    if usual:
        inside.append(Fold("Defaults", usual, note=str(len(usual))))
    lead = getattr(record, "label", "") or getattr(record, "name", "")
    return Card(type(record).__name__, lead if isinstance(lead, str) else "", given, inside)


def _records_in(name: str, value: Any) -> list[Fold]:
    """Sections of a record, or of the records in a list or dictionary."""
    if isinstance(value, BaseModel):
        return [value.card().folded(_words(name))]  # type: ignore[attr-defined]
    entries = list(value.items() if isinstance(value, dict) else enumerate(value, 1)) if _is_many(value) else []
    if not entries or not all(isinstance(each, BaseModel) for _, each in entries):
        return []
    if len(entries) > MOST_INSIDE:
        names = ", ".join(str(key) if isinstance(value, dict) else type(each).__name__ for key, each in entries)
        return [Fold(_words(name), [("names", names)], note=str(len(entries)))]
    inside = [each.card().folded(str(key)) for key, each in entries]
    return [Fold(_words(name), note=str(len(entries)), inside=inside)]


def _is_many(value: Any) -> bool:
    return isinstance(value, dict | tuple | list) and len(value) > 0


def _value(value: Any, unit: str, name: str) -> tuple[str, str]:
    """A value as text with its unit, and its small line if it is a series."""
    if isinstance(value, str):
        return value, ""
    if value is None or isinstance(value, bool):
        return "none" if value is None else "yes" if value else "no", ""
    if isinstance(value, int | float):
        return quantity(value, unit, name), ""
    if isinstance(value, np.ndarray) and value.size > 1:
        shown, factor = display(unit, angular_rate_in_degrees="speed" not in name)
        low, high = (rounded(float(v) * factor) for v in (value.min(), value.max()))
        extent = f"{low} {shown}" if low == high else f"{low} to {high} {shown}"
        line = sparkline(value) if value.ndim == 1 and low != high else ""
        return f"{' x '.join(map(str, value.shape))} values, {extent.strip()}", line
    if isinstance(value, tuple) and all(isinstance(each, str | float | int) for each in value):
        return ", ".join(each if isinstance(each, str) else f"{each:g}" for each in value) or "none", ""
    return brief(value), ""


def _words(name: str) -> str:
    return name.replace("_", " ")


def _first_sentence(about: str) -> str:
    """The first sentence of a description without its unit."""
    text = re.sub(r"^(\([^)]*\) )?(\[[^]]*\][;,.]? ?)?| ?\[-(; [^]]*)?\]", "", " ".join(about.split())).replace("`", "")
    return re.split(r"; |(?<=[.]) (?=[A-Z])", text, maxsplit=1)[0].rstrip(".;")
