"""Documents as Excel files: their tables and the data of their charts, in the units of the report."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from meltemi.core.extras import need
from meltemi.core.files import replacing
from meltemi.reports import blocks

LONGEST_NAME, WIDEST, NARROWEST = 31, 60, 7
"""Characters of the name of a sheet, and of the width of a column."""
FORBIDDEN = re.compile(r"[\[\]:*?/\\]")
INTEGER = re.compile(r"-?\d{1,15}")


def openpyxl() -> Any:
    """The library.

    Raises:
      MissingPackageError: it is missing.
    """
    need("an Excel file", "openpyxl")
    return import_module("openpyxl")


def write_workbook(path: str | Path, document: blocks.Document) -> Path:
    """Write the tables of a document: a sheet for each section, and for each part of a choice between tables.

    Raises:
      InputError: the file cannot be written, or openpyxl is missing.
    """
    book, path = openpyxl().Workbook(), Path(path)
    book.remove(book.active)
    first: list[str | blocks.Table] = [document.title, blocks.Table(["", ""], document.facts, text_columns=2)]
    if isinstance(verdict := document.lead, blocks.VerdictBlock):
        first += [verdict.heading, *verdict.lines, *_tables([verdict.more] if verdict.more else [])]
    _sheet(book, "Report", first)
    for section in document.sections:
        for name, tables in _sheets(section.heading, section.content):
            if any(isinstance(each, blocks.Table) for each in tables):
                _sheet(book, name, tables)
    save_workbook(book, path)
    return path


def save_workbook(book: Any, path: Path) -> None:
    """Write a book without formulas: text of an input that begins with ``=`` stays text, and is not evaluated.

    Raises:
      InputError: the file cannot be written.
    """
    for sheet in book.worksheets:
        for row in sheet.iter_rows():
            for cell in row:
                if cell.data_type == "f":
                    cell.data_type = "s"
    with replacing(path) as (partial,):
        book.save(partial)


def _sheets(heading: str, content: Sequence[blocks.Block]) -> Iterator[tuple[str, list[str | blocks.Table]]]:
    """Names of sheets, and their tables."""
    tables: list[str | blocks.Table] = []
    split: list[tuple[str, list[str | blocks.Table]]] = []
    for block in content:
        if isinstance(block, blocks.PartChoice) and any(
            isinstance(each, blocks.Table) for each in blocks.within(block)
        ):
            split += [(f"{heading}, {part.heading}", _tables([part])) for part in block.parts]
        else:
            tables += _tables([block])
    yield heading, tables
    yield from split


def _tables(content: Sequence[blocks.Block]) -> list[str | blocks.Table]:
    """Texts and tables of blocks, and their charts as tables."""
    inner = [each for block in content for each in blocks.within(block)]
    tables = [chart_table(each) if isinstance(each, blocks.Chart) else each for each in inner]
    return [each for each in tables if isinstance(each, str | blocks.Table)]


def chart_table(chart: blocks.Chart) -> blocks.Table:
    """Points of a chart: the abscissa, and a column for each curve, two for a band."""
    head, columns = [f"{chart.x.label}\n{chart.x.unit}".strip()], []
    points = sorted({float(x) for curve in chart.curves for x in np.asarray(curve.x, dtype=float)})
    for curve in chart.curves:
        for name, values in ((curve.name, curve.y), (f"{curve.name}, upper", curve.upper)):
            if values is not None:
                head.append(f"{name}\n{chart.y.unit}".strip())
                known = zip(
                    np.asarray(curve.x, dtype=float).tolist(), np.asarray(values, dtype=float).tolist(), strict=True
                )
                columns.append(dict(known))
    rows: list[list[blocks.Cell]] = [[x, *(column.get(x) for column in columns)] for x in points]
    return blocks.Table(head, rows, caption=f"{chart.title} {chart.caption}".strip(), text_columns=0)


def _sheet(book: Any, name: str, parts: Sequence[str | blocks.Table]) -> None:
    """A sheet with texts and tables below each other."""
    styles = import_module("openpyxl.styles")
    bold, right = styles.Font(bold=True), styles.Alignment(horizontal="right", vertical="bottom", wrap_text=True)
    line = styles.Border(bottom=styles.Side(style="thin"))
    sheet = book.create_sheet(_free_name(book, name))
    widths: dict[int, int] = {}
    row = 0
    for table in parts:
        if isinstance(table, str):
            row += 1
            sheet.cell(row, 1, table)
            continue
        row += 1 if row else 0
        if table.caption:
            row += 1
            sheet.cell(row, 1, table.caption).font = bold
        row += any(table.head)
        left = table.left()
        for j, title in enumerate(table.head if any(table.head) else ()):
            text, _, unit = title.partition("\n")
            cell = sheet.cell(row, j + 1, f"{text} [{unit}]" if unit else text)
            cell.font, cell.border = bold, line
            cell.alignment = styles.Alignment(vertical="bottom", wrap_text=True) if j in left else right
            widths[j] = max(widths.get(j, NARROWEST), max((len(part) for part in title.split("\n")), default=0) + 3)
        if sum(isinstance(each, blocks.Table) for each in parts) == 1 and any(table.head):
            sheet.freeze_panes = sheet.cell(row + 1, 2)
            sheet.auto_filter.ref = f"A{row}:{sheet.cell(row + len(table.rows), len(table.head)).coordinate}"
        for cells in table.rows:
            row += 1
            for j, value in enumerate(cells):
                content, form = _content(value)
                if content is not None:
                    cell = sheet.cell(row, j + 1, content)
                    cell.number_format = form
                    widths[j] = max(widths.get(j, NARROWEST), min(len(blocks.words(value)) + 2, WIDEST))
        if table.note:
            row += 1
            sheet.cell(row, 1, table.note)
    for j, width in widths.items():
        sheet.column_dimensions[openpyxl().utils.get_column_letter(j + 1)].width = min(width, WIDEST)


def _free_name(book: Any, name: str) -> str:
    """A name that Excel allows and no other sheet has."""
    plain = FORBIDDEN.sub(" ", name)
    free, n = plain[:LONGEST_NAME], 1
    while free.lower() in {each.lower() for each in book.sheetnames}:
        n += 1
        free = f"{plain[: LONGEST_NAME - len(str(n)) - 1]} {n}"
    return free


def _content(cell: blocks.Cell) -> tuple[str | float | None, str]:
    """Content of a cell of a sheet, and its number format: a number keeps its value, shows the digits of the report."""
    cell = blocks.unmarked(cell)
    if isinstance(cell, blocks.Share):
        return 100.0 * cell.value, "0.0"
    if isinstance(cell, blocks.CaseValue) and cell.value is not None and not cell.note:
        cell = cell.value
    if isinstance(cell, int | float):
        text = blocks.words(cell)
        digits = len(text.partition(".")[2])
        return (
            (float(cell), "0.00E+00" if "e" in text else "0." + "0" * digits if digits else "0")
            if cell == cell
            else (None, "")
        )
    text = blocks.words(cell)
    if INTEGER.fullmatch(text):
        return int(text), "0"
    try:
        return float(text), "General"
    except ValueError:
        return text or None, "@"
