"""Self-contained HTML pages: one layout, style sheet and script for all.

A page begins with its result, then come contents and sections. Its tables sort and filter, its pictures enlarge, its
charts name what is under the pointer. The folder ``templates`` has the layout (``page.html``; each kind of block in
``blocks.html``), the style sheet and the script; a page holds them and all its data.
"""

from __future__ import annotations

import base64
import math
import re
import shlex
from collections.abc import Mapping, Sequence
from dataclasses import fields, is_dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from jinja2 import Environment
from jinja2.utils import htmlsafe_json_dumps
from markupsafe import Markup, escape
from numpy.typing import ArrayLike

from meltemi.core.files import bytes_of, text_of, write_text
from meltemi.report.palette import COLOURS, ON_DARK, SOFT
from meltemi.reports.blocks import Block, Cell, Document, Marked, Picture, Table, unmarked, words
from meltemi.reports.drawing import svg_of
from meltemi.reports.rendering import TEMPLATES, templates

NEAR = 0.95
"""Utilisation from which it is marked."""
LONG = 25
"""Rows above which a table scrolls within itself."""
WIDE, NARROW = 12, 7
"""Columns above which a table has smaller letters, and up to which two of a choice are side by side on paper."""
WRAPPED, SENTENCE = 16, 40
"""Characters of a cell above which it may be wrapped, and above which it has a least width."""
SYMBOL = re.compile(r"(?<![\w.])([^\W\d_])_(\w|ref|opt|res|in|out|ave|maint)(?![\w(])")
"""A letter and its index, such as C_p and I_ref, but not a name such as x_max."""
TIED = re.compile(r"(?<=\d) (?=%|±)|(?<=±) |(?<=\b\w) (?== \d)|(?<=\b\w =) (?=\d)")
"""Spaces at which a number is not broken."""
THOUSANDS = re.compile(r"[-+]?\d{5,}(?:\.\d*)?(?: ± \d+(?:\.\d*)?)?(?: [^\W\d]\S*)?")
"""A cell whose thousands are separated."""


def write_page(path: str | Path, document: Document) -> Path:
    """Write a document as one self-contained HTML file, without external resources.

    Raises:
      InputError: a picture cannot be read, or the file cannot be written.
    """
    return write_text(Path(path), page(document))


def page(document: Document) -> str:
    """HTML text of the page of :func:`write_page`; from three sections on there is a list of them."""
    return _templates().get_template("page.html").render(document=document)


def html_of(block: Block) -> str:
    """HTML of a block."""
    return str(_templates().get_template("blocks.html").module.block(block))  # type: ignore[attr-defined]


@cache
def _templates() -> Environment:
    environment = templates(
        base64=_base64,
        cell_kinds=_cell_kinds,
        css=lambda text: re.sub(r"[^\w .,:;()/+-]", " ", text),
        data=data,
        kind=lambda value: type(value).__name__ if is_dataclass(value) else "text",
        layout=_layout,
        page_data=_page_data,
        sentences=sentences,
        svg=lambda drawing: Markup(svg_of(drawing)),
        text=plain,
        words=_words,
    )
    environment.policies["json.dumps_kwargs"] = JSON
    environment.globals |= {
        "colours": _colours,
        "dark": ON_DARK,
        "file": _file,
        "light": COLOURS,
        "near": NEAR,
        "soft": SOFT,
    }
    return environment


@cache
def _file(name: str) -> Markup:
    return Markup(text_of(TEMPLATES / name))


def _colours(of: Sequence[str]) -> str:
    """Colours of curves as variables."""
    return f":root{{{''.join(f'--c{i}:{colour};' for i, colour in enumerate(of))}}}"


# -------------------------------------------------------------------------------------------------------- texts


def sentences(text: str) -> list[str]:
    """The lead of a page as its first sentence and the others; two sentences stay together."""
    first, *others = re.split(r"(?<=\.)\s+(?=[A-Z])", text.strip())
    return [first, *others] if len(others) > 1 else [text.strip()]


def plain(text: str) -> Markup:
    """Escaped text, symbols set as in formulas, numbers kept together."""
    return Markup(SYMBOL.sub(r"<i>\1</i><sub>\2</sub>", TIED.sub("\u00a0", str(escape(text)))))


def apart(text: str) -> Markup:
    """A number with separated thousands; without spaces, so that it is copied and sorted as a number."""
    return Markup(
        re.sub(
            r"(?<![\d.])\d{5,}", lambda match: re.sub(r"(?<=\d)(\d{3})(?=(?:\d{3})*$)", r"<i>\1</i>", match[0]), text
        )
    )


def _words(cell: Cell) -> Markup:
    text = words(cell)
    return apart(plain(text)) if THOUSANDS.fullmatch(text) else plain(text)


# -------------------------------------------------------------------------------------------- tables and pictures


def _length(cell: Cell) -> int:
    """Characters of a text; of other cells none count."""
    text = unmarked(cell)
    return len(text) if isinstance(text, str) else 0


def _cell_kinds(cell: Cell, left: bool) -> str:
    """Classes of a cell: its mark, and those for its place and length."""
    size = _length(cell)
    mark = cell.kind if isinstance(cell, Marked) else ""
    kinds = (mark, "text" if left else "", "wrap" if size > WRAPPED else "", "long" if size > SENTENCE else "")
    return " ".join(filter(None, kinds))


def _layout(table: Table) -> str:
    """Classes of a table for its length and width."""
    columns, sentences = (
        len(table.head),
        {j for r in table.rows for j, cell in enumerate(r) if _length(cell) > SENTENCE},
    )
    width = " many" if columns > WIDE else " narrow" if columns <= NARROW else ""
    return f"wide{' tall' * (len(table.rows) > LONG)}{width}{' texts' * (len(sentences) > 1)}"


def _base64(picture: Picture) -> str:
    content = picture.png if isinstance(picture.png, bytes) else bytes_of(picture.png)
    return base64.b64encode(content).decode("ascii")


# --------------------------------------------------------------------------------------------- data for the script

JSON: dict[str, Any] = {"separators": (",", ":"), "ensure_ascii": False, "allow_nan": False}


def stored(place: str, content: Any) -> str:
    """Data within a page, for its script."""
    return f'<script type="application/json" id="{place}">{htmlsafe_json_dumps(content, **JSON)}</script>'


def _page_data(document: Document) -> Markup:
    bases = [shlex.quote(each.base) for each in document.cases]
    return Markup(stored("page-data", {"bases": bases, "cases": [list(each.names) for each in document.cases]}))


def data(value: Any) -> Any:
    """Records and arrays as plain data, with :func:`rounded` numbers."""
    if is_dataclass(value):
        return {each.name: data(getattr(value, each.name)) for each in fields(value)}
    if isinstance(value, Mapping):
        return {key: data(each) for key, each in value.items()}
    if value is None or isinstance(value, str | int | float):
        return value
    if isinstance(value, np.ndarray) or any(isinstance(each, float) for each in value):
        return rounded(value)
    return [data(each) for each in value]


def rounded(values: ArrayLike) -> list[float | None]:
    """Numbers with the digits that :func:`number` shows; None where they are not finite."""
    return [_short(v) if math.isfinite(v) else None for v in np.asarray(values, dtype=float).tolist()]


def _short(value: float) -> float:
    return round(value) if abs(value) >= 1e3 else float(f"{value:.4g}")
