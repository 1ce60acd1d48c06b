"""Charts of HTML pages, which name what is under the pointer, and blocks of which the reader chooses one."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from html import escape
from itertools import count

import numpy as np
from numpy.typing import ArrayLike

from meltemi.report.html import Block, Markup, html_of, plain, stored, together


@dataclass(frozen=True)
class Axis:
    """Of a chart. ``start``: a value that it must contain, or that of the centre of a polar one."""

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


def chart(
    title: str,
    x: Axis,
    y: Axis,
    curves: Sequence[Curve],
    *,
    caption: str = "",
    polar: bool = False,
    spokes: Sequence[str] = (),
) -> Markup:
    """A chart of lines, dots and bands; ``polar``: x are angles [deg], anticlockwise from the right.

    ``spokes`` are names of evenly spaced angles, the first to the right: then it is polar, with a value of each curve
    on every spoke; a line break within a name is one on the page.
    """
    polar = polar or bool(spokes)
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
    spec = {"title": title, "polar": polar, "series": series} | axes | ({"spokes": list(spokes)} if spokes else {})
    words = f"<figcaption><b>{plain(title)}</b> {plain(caption)}</figcaption>"
    kind = "chart polar" if polar else "chart"
    return Markup(f'{stored(place, spec)}<figure class="{kind}" data-chart="{place}">{words}</figure>')


def rounded(values: ArrayLike) -> list[float | None]:
    """Numbers with the digits that :func:`number` shows; None where they are not finite."""
    return [_short(v) if math.isfinite(v) else None for v in np.asarray(values, dtype=float).tolist()]


def _short(value: float) -> float:
    return round(value) if abs(value) >= 1e3 else float(f"{value:.4g}")


def part(heading: str, *blocks: Block) -> Markup:
    """Blocks under a small heading."""
    return Markup(f'<div class="part"><h3>{plain(heading)}</h3>{"".join(map(html_of, blocks))}</div>')


def beside(*blocks: Block) -> Markup:
    """Blocks beside each other where there is room."""
    return Markup(f'<div class="beside">{"".join(f"<div>{html_of(each)}</div>" for each in blocks)}</div>')


def chosen(label: str, parts: Iterable[tuple[str, Sequence[Block]]], *, print_all: bool = False) -> list[Block]:
    """Parts of which the reader chooses one.

    Args:
      label: of the choice.
      parts: their names and blocks.
      print_all: on paper too; else the chosen one.
    """
    made = [(name, part(name, *blocks)) for name, blocks in parts]
    if len(made) == 1:
        return [made[0][1]]
    options = "".join(f"<option>{escape(name)}</option>" for name, _ in made)
    select = f'<div class="choice"><label>{plain(label)} <select>{options}</select></label></div>'
    kind = "choose all" if print_all else "choose"
    return [together(Markup(f'<div class="{kind}">{select}'), *(each for _, each in made), Markup("</div>"))]
