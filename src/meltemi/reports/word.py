"""Documents as Word files, of the same blocks as pages, by python-docx."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cache
from importlib import import_module
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

from jinja2 import Template

from meltemi.core.extras import need
from meltemi.core.files import bytes_of, replacing
from meltemi.reports import blocks
from meltemi.reports.chart_figures import chart_figure, grid_figures, statistics_charts
from meltemi.reports.drawing import figure_of
from meltemi.reports.rendering import templates

if TYPE_CHECKING:
    from matplotlib.figure import Figure

WIDTH, SMALL, MANY = 257.0, 7, 12
"""Width [mm] between the margins of A4 landscape; size [pt] of tables, and columns above which it is smaller."""
DOTS = 150
"""Dots per inch of pictures."""
PAGE = '<w:fldSimple xmlns:w="http://schemas.openxmlformats.org/wordprocessingml/2006/main" w:instr="PAGE"/>'
"""Field of the number of a page."""


def write_word(path: str | Path, document: blocks.Document) -> Path:
    """Write a document as a Word file: A4 landscape, tables with repeated heads, charts as pictures.

    Raises:
      InputError: the file cannot be written, or python-docx is missing.
    """
    need("a Word file", "python-docx")
    docx = import_module("docx")
    path, word = Path(path), docx.Document()
    _layout(word, document.running or document.title)
    word.add_heading(document.title, 0)
    _add(word, blocks.Table(["", ""], document.facts, text_columns=2))
    if document.lead:
        _add(word, document.lead)
    for section in document.sections:
        word.add_heading(section.heading, 1)
        for block in section.content:
            _add(word, block)
    if document.footer:
        word.add_paragraph(document.footer, style="Caption")
    with replacing(path) as (partial,):
        word.save(str(partial))
    return path


def _layout(word: Any, running: str) -> None:
    shared, section = import_module("docx.shared"), word.sections[0]
    section.orientation = import_module("docx.enum.section").WD_ORIENT.LANDSCAPE
    section.page_width, section.page_height = shared.Mm(297), shared.Mm(210)
    section.left_margin = section.right_margin = shared.Mm((297 - WIDTH) / 2)
    section.top_margin = section.bottom_margin = shared.Mm(18)
    word.styles["Normal"].font.size = shared.Pt(9)
    foot = section.footer.paragraphs[0]
    foot.text = f"{running}    "
    foot._p.append(import_module("docx.oxml").parse_xml(PAGE))


def _add(word: Any, block: blocks.Block) -> None:  # noqa: C901 - a case for each kind of block
    """Append a block."""
    match block:
        case str():
            word.add_paragraph(block)
        case blocks.Code():
            word.add_paragraph(block.text, style="No Spacing")
        case blocks.Table():
            _add_table(word, block)
        case blocks.Picture():
            content = block.png if isinstance(block.png, bytes) else bytes_of(block.png)
            word.add_picture(BytesIO(content), width=import_module("docx.shared").Mm(WIDTH))
            word.add_paragraph(block.caption, style="Caption")
        case blocks.Chart() | blocks.Drawing() | blocks.Statistics():
            _add_pictures(word, [block])
        case blocks.Facts():
            rows = [[name, f"{value}{case or ''}"] for name, value, case in block.items]
            _add_table(word, blocks.Table(["", ""], rows, text_columns=2))
        case blocks.VerdictBlock():
            word.add_heading(block.heading, 2)
            for line in block.lines:
                word.add_paragraph(line, style="List Bullet")
            if block.more:
                _add(word, block.more)
        case blocks.Folded():
            word.add_paragraph(block.summary)
            _add(word, block.block)
        case blocks.Subsection():
            if block.heading:
                word.add_heading(block.heading, 3)
            for each in block.content:
                _add(word, each)
        case blocks.PartChoice():
            charts = [each for part in block.parts for each in part.content]
            if all(isinstance(each, blocks.Chart) for each in charts):
                _add_pictures(word, charts, block.label)
            else:
                for part in block.parts:
                    _add(word, part)
        case blocks.Beside():
            pictures = [each for each in block.content if isinstance(each, blocks.Chart | blocks.Drawing)]
            _add_pictures(word, pictures)
            for each in block.content:
                if each not in pictures:
                    _add(word, each)


def _add_pictures(word: Any, shown: Sequence[blocks.Block], caption: str = "") -> None:
    """Drawings and charts in a line, or many charts in rows, with a caption below."""
    if not shown:
        return
    shared, paragraph = import_module("docx.shared"), word.add_paragraph()
    paragraph.paragraph_format.keep_with_next = True
    for figure in _figures(shown):
        content = BytesIO()
        figure.savefig(content, format="png", dpi=DOTS)
        content.seek(0)
        paragraph.add_run().add_picture(content, width=shared.Mm(min(25.4 * figure.get_size_inches()[0], WIDTH)))
    word.add_paragraph(caption or "; ".join(filter(None, map(_caption, shown))), style="Caption")


def _caption(block: blocks.Block) -> str:
    if isinstance(block, blocks.Chart):
        return f"{block.title}: {block.caption}".strip(": ")
    return block.caption if isinstance(block, blocks.Drawing | blocks.Statistics) else ""


def _figures(shown: Sequence[blocks.Block]) -> Iterator[Figure]:
    """Figures of drawings and charts; those of many charts have several."""
    charts = [each for each in shown if isinstance(each, blocks.Chart)]
    straight = not any(each.polar for each in charts)
    if len(charts) > 1 and straight:
        yield from grid_figures(charts)
    else:
        yield from map(chart_figure, charts)
    for block in shown:
        if isinstance(block, blocks.Statistics):
            yield from grid_figures(list(statistics_charts(block)))
        elif isinstance(block, blocks.Drawing):
            yield figure_of(block)


def _add_table(word: Any, table: blocks.Table) -> None:
    """A table; its XML is written at once, since cells of python-docx take milliseconds each."""
    if table.paper:
        word.add_paragraph(table.paper)
        return
    if table.caption:
        caption = word.add_paragraph(table.caption, style="Caption")
        caption.paragraph_format.keep_with_next = True
    rows = [[*cells, *[""] * (len(table.head) - len(cells))] for cells in table.rows]
    has_head = any(table.head)
    xml = _table_template().render(
        rows=[table.head, *rows] if has_head else rows,
        has_head=has_head,
        widths=_widths([list(map(blocks.words, cells)) for cells in (table.head, *rows)]),
        left=table.left(),
        size=2 * SMALL - (2 if len(table.head) > MANY else 0),
    )
    after = word.add_paragraph(table.note)
    after._p.addprevious(import_module("docx.oxml").parse_xml(xml))


@cache
def _table_template() -> Template:
    def is_bold(cell: blocks.Cell) -> bool:
        return isinstance(cell, blocks.Marked) and cell.kind == "subject"

    return templates(words=blocks.words, is_bold=is_bold).get_template("table.xml")


def _widths(rows: Sequence[Sequence[str]]) -> list[int]:
    """Widths of columns [1/20 pt] for their texts; programs of offices would give all columns the same.

    Columns get what their longest line needs while the page has it; else long texts share what short ones leave.
    """
    page, letter = round(56.7 * WIDTH), 90
    wanted = [
        letter * (2 + max(len(line) for text in column for line in text.split("\n")))
        for column in zip(*rows, strict=True)
    ]
    most = page
    while sum(min(each, most) for each in wanted) > page and most > letter:
        most -= letter
    return [min(each, most) for each in wanted]
