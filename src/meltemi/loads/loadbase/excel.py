"""Changes of a load case table from a YAML or an Excel file, and tables as Excel files to be edited and read again.

An Excel file has the sheets ``cases``, ``faults`` and ``values``.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from importlib import import_module
from io import BytesIO
from pathlib import Path
from typing import Any
from zipfile import ZipFile

from meltemi.core.errors import InputError, did_you_mean
from meltemi.core.files import bytes_of
from meltemi.core.record import Record
from meltemi.core.yamlfile import parse, read_text, validated
from meltemi.loads.loadbase.table import Fault, LoadCaseRow, LoadTable, load_table
from meltemi.reports.workbook import openpyxl, save_workbook

LARGEST = 20_000_000
"""Largest size [bytes] of a file."""
LARGEST_CONTENT = 50_000_000
"""Largest size [bytes] of the unpacked parts of a file: some 10 s; a table has 0.2 MB."""
MOST_ROWS = 20_000
PARTS = ("defaults", "factors", "extrapolation", "states")
"""Parts of a table whose values are in the sheet ``values``."""
HEAD = ("part", "key", "value")


def read_changes(path: str | Path, edition: int | str = 4) -> dict[str, Any]:
    """Changes of a table from a YAML file, or from an Excel file, compared with the edition.

    Raises:
      InputError: the file cannot be read, or its changes are not valid.
    """
    path = Path(path)
    if path.suffix.lower() == ".xlsx":
        changes, text = read_excel(path, edition), None
    else:
        text = read_text(path)
        changes = parse(text, path, "changes of a load case table")
        if given := changes.keys() & {"edition", "extends"}:
            raise InputError(f"{path}: {', '.join(sorted(given))}: the campaign has the edition; leave it out")
    load_table(edition, changes, str(path), text)
    return changes


def write_excel(table: LoadTable, path: str | Path) -> Path:
    """Write a table as an Excel file.

    Raises:
      InputError: the file cannot be written, or openpyxl is missing.
    """
    path, book = Path(path), openpyxl().Workbook()
    book.remove(book.active)
    for name, kind, records in (("cases", LoadCaseRow, table.rows), ("faults", Fault, table.faults)):
        head = ["name", *kind.model_fields]
        lines = [[each, *(_cell(getattr(record, key)) for key in head[1:])] for each, record in records.items()]
        _sheet(book, name, head, lines, {key: kind.model_fields[key].description or "" for key in head[1:]})
    values = [[part, key, _cell(value)] for part, key, value in _values(table)]
    _sheet(book, "values", list(HEAD), values, {})
    about = [["title", table.title], ["edition", str(table.edition)], ["source", table.source]]
    _sheet(book, "about", ["key", "value"], about, {})
    save_workbook(book, path)
    return path


def _sheet(book: Any, name: str, head: list[str], lines: list[list[Any]], notes: Mapping[str, str]) -> None:
    comment, font = import_module("openpyxl.comments").Comment, import_module("openpyxl.styles").Font
    sheet = book.create_sheet(name)
    sheet.append(head)
    for line in lines:
        sheet.append(line)
    for cell in sheet[1]:
        cell.font = font(bold=True)
        if notes.get(cell.value):
            cell.comment = comment(notes[cell.value], "meltemi", width=320, height=90)
    for i, column in enumerate(sheet.iter_cols(), start=1):
        longest = max(len(str(cell.value)) for cell in column if cell.value is not None)
        sheet.column_dimensions[openpyxl().utils.get_column_letter(i)].width = min(longest + 2, 50)
        if i == 1:
            for cell in column:
                cell.number_format = "@"
    sheet.freeze_panes = "B2"


def _cell(value: Any) -> Any:
    """A value as the content of a cell: text, number, true or false; empty for none."""
    if isinstance(value, Record):
        value = value.content()
    if isinstance(value, tuple | list | dict):
        plain = all(isinstance(each, str) for each in value) and not isinstance(value, dict)
        return (", ".join(value) if plain else json.dumps(value)) if value else None
    return None if value == "" else value


def _values(table: LoadTable) -> list[tuple[str, str, Any]]:
    """Values outside rows and faults: part, key, value."""
    values: list[tuple[str, str, Any]] = []
    for part in PARTS:
        record = getattr(table, part)
        named = record if isinstance(record, dict) else {"": record}
        for name, each in named.items():
            values += [(f"{part}.{name}".rstrip("."), key, value) for key, value in each.content().items()]
    return values


def read_excel(path: str | Path, edition: int | str) -> dict[str, Any]:
    """Changes of the table of an edition by an Excel file.

    Raises:
      InputError: the file cannot be read, has other sheets or columns, or a value that is not allowed; or two rows have
        one name; or openpyxl is missing.
    """
    path, base = Path(path), load_table(edition)
    sheets = _read(path)
    for name in ("cases", "faults", "values"):
        if name not in sheets:
            raise InputError(f"{path}: no sheet {name!r}; {did_you_mean(name, sheets)}")
    data: dict[str, Any] = {"edition": base.edition, "title": base.title, "source": base.source}
    data["rows"] = _named(sheets["cases"], LoadCaseRow, f"{path}: sheet cases")
    data["faults"] = _named(sheets["faults"], Fault, f"{path}: sheet faults")
    for line, (part, key, value) in enumerate(_table(sheets["values"], HEAD, f"{path}: sheet values"), start=2):
        group, _, name = str(part).partition(".")
        if group not in PARTS:
            raise InputError(f"{path}: sheet values, row {line}: no part {part!r}; {did_you_mean(str(part), PARTS)}")
        target = data.setdefault(group, {})
        target = target.setdefault(name, {}) if name else target
        if (content := _parsed(value, str(key))) is not None:
            target[str(key)] = content
    return differences(base, validated(data, LoadTable, str(path)))


def _read(path: Path) -> dict[str, list[tuple[Any, ...]]]:
    """Cells of all sheets, without empty rows."""
    content, library = BytesIO(bytes_of(path, LARGEST)), openpyxl()
    try:
        with ZipFile(content) as parts:
            size = sum(part.file_size for part in parts.infolist())
        if size > LARGEST_CONTENT:
            raise ValueError(f"unpacked it has {size / 1e6:.0f} MB, at most {LARGEST_CONTENT / 1e6:.0f} MB are read")
        book = library.load_workbook(content, read_only=True, data_only=True)
        return {
            sheet.title: [
                row
                for row in sheet.iter_rows(values_only=True, max_row=MOST_ROWS, max_col=100)
                if any(value is not None for value in row)
            ]
            for sheet in book.worksheets
        }
    except Exception as error:  # a damaged file raises whatever the parts of openpyxl raise
        why = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise InputError(f"{path}: cannot be read as an Excel file ({why})") from None


def _table(rows: list[tuple[Any, ...]], head: tuple[str, ...], where: str) -> list[list[Any]]:
    """Cells below the header, in the order of ``head``; missing columns are empty."""
    given = [str(name) for name in rows[0] if name is not None] if rows else []
    for name in given:
        if name not in head:
            raise InputError(f"{where}: unknown column {name!r}; {did_you_mean(name, head)}")
    if head[0] not in given:
        raise InputError(f"{where}: no column {head[0]!r}")
    return [[row[given.index(name)] if name in given else None for name in head] for row in rows[1:]]


def _named(rows: list[tuple[Any, ...]], kind: type[Record], where: str) -> dict[str, dict[str, Any]]:
    """Records by name, as plain data."""
    head = ("name", *kind.model_fields)
    records: dict[str, dict[str, Any]] = {}
    for line, (name, *values) in enumerate(_table(rows, head, where), start=2):
        if name is None:
            raise InputError(f"{where}, row {line}: name: missing")
        name = f"{name:.12g}" if isinstance(name, float) else str(name).strip()
        if name in records:
            raise InputError(f"{where}, row {line}: two rows have the name {name!r}")
        given = zip(head[1:], values, strict=True)
        records[name] = {key: _parsed(value, key) for key, value in given if value is not None}
    return records


def _parsed(value: Any, key: str) -> Any:
    """Value of a cell; lists are JSON, or names separated by commas."""
    if key == "practice":
        return [name.strip() for name in str(value or "").split(",") if name.strip()]
    if isinstance(value, str) and value.strip()[:1] in ("[", "{"):
        try:
            return json.loads(value)
        except (ValueError, RecursionError):
            return value
    return value


def differences(base: LoadTable, table: LoadTable) -> dict[str, Any]:
    """Changes that turn one table into another one, as in a file of changes."""
    differing: dict[str, Any] = {}
    if gone := [name for name in base.rows if name not in table.rows]:
        differing["without"] = gone
    for part in ("rows", "faults", "states"):
        before, after = getattr(base, part), getattr(table, part)
        changes = {name: _changes(before.get(name), record) for name, record in after.items()}
        if changes := {name: change for name, change in changes.items() if change}:
            differing[part] = changes
    for part in ("defaults", "factors", "extrapolation"):
        if change := _changes(getattr(base, part), getattr(table, part)):
            differing[part] = change
    return differing


def _changes(before: Record | None, after: Record) -> dict[str, Any]:
    """Keys of a record that differ; for a new record, those that differ from their defaults."""
    new = after.model_dump(mode="json")
    if before is None:
        return after.model_dump(mode="json", exclude_defaults=True)
    old = before.model_dump(mode="json")
    return {key: value for key, value in new.items() if value != old[key]}
