"""Document model of reports: sections of blocks, which HTML pages, Word documents and Excel files show alike."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from numpy.typing import ArrayLike

from meltemi.reports.turbine_facts import number

# -------------------------------------------------------------------------------------------------------- cells


@dataclass(frozen=True)
class CaseName:
    """Name of a case, or a text in its place; ``base`` is the number of its load base on the page."""

    name: str
    base: int = 0
    text: str = ""

    def __str__(self) -> str:
        return self.text or self.name


@dataclass(frozen=True)
class CaseValue:
    """A value with its case, its utilisation and a note."""

    value: float | None = None
    case: CaseName | None = None
    ratio: float = math.nan
    note: str = ""

    def __str__(self) -> str:
        ratio = f"{self.ratio:.2f}" if math.isfinite(self.ratio) else ""
        value = "" if self.value is None else number(self.value)
        return "; ".join(filter(None, (value, ratio, str(self.case or ""), self.note)))


@dataclass(frozen=True)
class Share:
    """A part of the whole, shown in per cent."""

    value: float

    def __str__(self) -> str:
        return f"{100.0 * self.value:.1f}"


@dataclass(frozen=True)
class Marked:
    """A highlighted cell.

    Attributes:
      cell: content of the cell.
      kind: "subject" (of the row), "over" (a limit), "good", "doubtful" or "bad", or the state of a case:
        "warned", "failed".
    """

    cell: str | float
    kind: str

    def __str__(self) -> str:
        return words(self.cell)


Cell = str | float | CaseName | CaseValue | Share | Marked | None
"""Cell of a table."""


def unmarked(cell: Cell) -> Cell:
    """A cell, or the content of a highlighted one."""
    return cell.cell if isinstance(cell, Marked) else cell


def words(cell: Cell) -> str:
    """A cell as text."""
    return "" if cell is None else number(cell) if isinstance(cell, int | float) else str(cell)


# ------------------------------------------------------------------------------------------------------- blocks


@dataclass(frozen=True)
class Table:
    """A table, which the reader of a page sorts by a click on the head of a column.

    Attributes:
      head: names of the columns, with units; a line break separates the two.
      rows: cells; a row may be shorter than the head.
      caption: above the table.
      text_columns: number of the first columns that are text; others are if most of their cells begin with a letter.
        Numbers are aligned to the right.
      groups: a row above the head, of (text, columns that it spans); it must span all of them.
      note: below the table.
      ids: identifiers of rows.
      paper: a sentence in place of the table on paper; empty: the table itself.
    """

    head: Sequence[str]
    rows: Sequence[Sequence[Cell]]
    caption: str = ""
    text_columns: int = 1
    groups: Sequence[tuple[str, int]] = ()
    note: str = ""
    ids: Sequence[str] = ()
    paper: str = ""

    @property
    def texts(self) -> list[list[str]]:
        """Cells as text, as in files of other kinds."""
        return [["" if cell is None else str(cell) for cell in row] for row in self.rows]

    def left(self) -> set[int]:
        """Columns of text, aligned to the left."""
        columns = [[unmarked(row[j]) for row in self.rows if j < len(row)] for j in range(len(self.head))]
        filled = [[cell for cell in column if cell not in (None, "")] for column in columns]
        return {
            j for j, cells in enumerate(filled) if j < self.text_columns or 2 * sum(map(_is_text, cells)) > len(cells)
        }


def _is_text(cell: Cell) -> bool:
    return isinstance(cell, CaseName) or (isinstance(cell, str) and cell[:1].isalpha())


@dataclass(frozen=True)
class Picture:
    """A picture: a PNG file, or its bytes.

    Attributes:
      png: the file or its content; it becomes part of the page.
      caption: below the picture.
      text: description for those who cannot see it; the caption by default.
    """

    png: Path | bytes
    caption: str = ""
    text: str = ""


@dataclass(frozen=True)
class Code:
    """Verbatim text, such as a command line."""

    text: str


@dataclass(frozen=True)
class Axis:
    """Axis of a chart; ``start`` is a value that it must contain, or that of the centre of a polar one."""

    label: str
    unit: str = ""
    log: bool = False
    start: float | None = None

    def __str__(self) -> str:
        return f"{self.label} [{self.unit}]" if self.unit else self.label


@dataclass(frozen=True)
class Curve:
    """Curve of a chart.

    Attributes:
      name: curves of one name are switched on and off together.
      x, y: points; those that are not finite are left out.
      upper: (N,) upper bound of a band whose lower one is ``y``.
      dots: points instead of a line.
      dash: pattern of the line, such as "5 4".
      colour: number in the palette; by default that of its place.
      cases: places of the points' cases in the page's list of names.
      base: name of the list.
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


@dataclass(frozen=True)
class Chart:
    """A chart of lines, dots and bands.

    Attributes:
      title: above it.
      x, y: axes.
      curves: curves of the chart.
      caption: below it.
      polar: x are angles [deg], anticlockwise from the right.
      spokes: names of evenly spaced angles of a polar chart, the first to the right, with a value of each curve on
        every spoke; a line break within a name is one on the page.
    """

    title: str
    x: Axis
    y: Axis
    curves: Sequence[Curve]
    caption: str = ""
    polar: bool = False
    spokes: Sequence[str] | None = None


@dataclass(frozen=True)
class Statistics:
    """Statistics of all cases over their wind speed; a page lets its reader choose channel and abscissa.

    Attributes:
      bases: data of the page's script for each load base: name, dlcs, dlc, channels, across.
      first: channel that is shown first.
      caption: below it.
    """

    bases: Sequence[Mapping[str, Any]]
    first: str
    caption: str = ""

    def labels(self, kind: str) -> list[str]:
        """Labels of the ``channels``, or of what they are drawn ``across``, of all load bases."""
        return list(dict.fromkeys(each["label"] for base in self.bases for each in base[kind]))


@dataclass(frozen=True)
class Stroke:
    """A line of a drawing.

    Attributes:
      points: (x to the right, y up), the picture being 100 wide.
      kind: "body" (closed, filled), "line", "thin", "axis" (with an arrow), "wind" (with an arrow), "point", "into" or
        "out" (an axis that enters or leaves the picture at the point).
      label: label at the end of the line.
    """

    points: Sequence[tuple[float, float]]
    kind: str = "line"
    label: str = ""


@dataclass(frozen=True)
class Drawing:
    """A sketch of lines, 100 wide, from ``low`` to ``high``; the title is for those who cannot see it."""

    title: str
    strokes: Sequence[Stroke]
    low: float = 0.0
    high: float = 100.0
    caption: str = ""


@dataclass(frozen=True)
class Facts:
    """Names and values in a line; a value may have its case."""

    items: Sequence[tuple[str, str, CaseName | None]]


@dataclass(frozen=True)
class VerdictBlock:
    """The result at the beginning of a report; ``kind`` is "good", "doubtful" or "bad"; ``more`` follows the lines."""

    kind: str
    heading: str
    lines: Sequence[str] = ()
    more: Folded | None = None


@dataclass(frozen=True)
class Folded:
    """A block that a click on its summary shows and hides."""

    summary: str
    block: Block
    unfolded: bool = False


@dataclass(frozen=True)
class Subsection:
    """Blocks under a small heading."""

    heading: str
    content: Sequence[Block]


@dataclass(frozen=True)
class Beside:
    """Blocks beside each other where there is room."""

    content: Sequence[Block]


@dataclass(frozen=True)
class PartChoice:
    """Parts of which the reader of a page chooses one; all are on paper and in files."""

    label: str
    parts: Sequence[Subsection]


Container = Folded | Subsection | Beside | PartChoice
"""Block that has other blocks in it."""
Block = str | Table | Picture | Code | Chart | Statistics | Drawing | Facts | VerdictBlock | Container
"""Block of a section; a text is a paragraph."""


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


@dataclass(frozen=True)
class Document:
    """A report: what a page, a Word document and an Excel file have in common.

    Attributes:
      title: title of the report.
      sections: sections in their order.
      facts: names and values below the title, such as turbine and wind.
      lead: the result, before everything else; the first sentence of a text is highlighted.
      footer: last line, such as version and licence.
      running: text at the foot of each printed page, such as project and revision.
      cases: cases of each load base; on a page a click on one shows its conditions and its command.
    """

    title: str
    sections: Sequence[Section]
    facts: Sequence[tuple[str, str]] = ()
    lead: Block = ""
    footer: str = ""
    running: str = ""
    cases: Sequence[CaseList] = ()


def within(block: Block) -> Iterator[Block]:
    """A block and all blocks inside it."""
    yield block
    inner: Sequence[Block] = ()
    if isinstance(block, Subsection | Beside):
        inner = block.content
    elif isinstance(block, PartChoice):
        inner = block.parts
    elif isinstance(block, Folded):
        inner = (block.block,)
    for each in inner:
        yield from within(each)


def chosen(label: str, parts: Sequence[tuple[str, Sequence[Block]]]) -> list[Block]:
    """A choice between parts, given as names and blocks; no choice if there is one."""
    subsections = [Subsection(name, blocks) for name, blocks in parts]
    return [PartChoice(label, subsections)] if len(subsections) > 1 else list(subsections)
