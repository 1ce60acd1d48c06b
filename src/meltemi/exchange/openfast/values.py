"""Values of a deck in SI units according to the table of keywords, with a note on every keyword."""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Any

from meltemi.core.errors import InputError
from meltemi.exchange.openfast.keywords import ROWS, UNITS, KeywordRow, row_of
from meltemi.exchange.openfast.text import InputFile, KeywordLine, flag, number
from meltemi.exchange.report import Kind, Notes

EXPECTED = {
    "int": "a whole number",
    "float": "a number",
    "flag": "True or False",
    "text": "a text in quotes",
    "file": "the name of a file in quotes",
    "list": "numbers",
}


class Values:
    """Values of a deck by target, with their sources and notes.

    ``values["name"]`` is None where the deck says "default" or has no value.
    """

    def __init__(self, notes: Notes, *files: InputFile) -> None:
        self.notes = notes
        self.data: dict[str, Any] = {}
        self.source: dict[str, str] = {}
        self._shown: dict[str, str] = {}
        self._line: dict[str, int] = {}
        for file in files:
            self.read(file)

    def __getitem__(self, target: str) -> Any:
        return self.data.get(target)

    def given(self, target: str, default: Any) -> Any:
        """A value, or a default if the deck has none."""
        value = self.data.get(target)
        return default if value is None else value

    def note(self, kind: Any, target: str, why: str, what: str | None = None) -> None:
        """Replace the note on a value, by default "used"."""
        where, name = self.source.get(target, " ").split(" ", 1)
        self.notes[:] = [n for n in self.notes if not (n.where == where and n.what.startswith(f"{name} ="))]
        shown = what if what is not None else f"{name} = {self._shown.get(target, '')}"
        self.notes.add(kind, where, shown, why)

    def read(self, file: InputFile) -> InputFile:
        """Add the values of a file, with a note on every keyword.

        Raises:
          InputError: a keyword is missing or its value is invalid.
        """
        used_lines: set[int] = set()
        for row in ROWS[file.module]:
            if not row.target:
                continue
            entry = file.find(*row.names)
            if entry is None and not row.optional:
                entry = file.require(row.names, _description_of(row))
            if entry is None:
                continue
            used_lines.add(entry.line)
            value = convert(file, entry, row)
            self.data[row.target] = value
            self._line[row.target] = entry.line
            self.source[row.target] = f"{file.place(entry.line)} {entry.name}"
            self._shown[row.target] = shown = " ".join(entry.values)[:60] + (f" {row.unit}" if row.unit else "")
            if value is None:
                self.notes.add("equivalent", file.place(entry.line), f"{entry.name} = {shown}", "the default")
            else:
                why = row.target if not row.remark else f"{row.target}: {row.remark}"
                kind: Kind = "equivalent" if self._is_equivalent(file, entry, row) else "used"
                self.notes.add(kind, file.place(entry.line), f"{entry.name} = {shown}", why)
        for entries in file.entries.values():
            for entry in entries:
                if entry.line in used_lines:
                    continue
                known = row_of(file.module, entry.name)
                if known is None or known.target:
                    continue
                what = f"{entry.name} = {' '.join(entry.values)[:60]}"
                kind = "not needed" if not known.same else "ignored"
                if self._is_equivalent(file, entry, known):
                    kind = "equivalent"
                self.notes.add(kind, file.place(entry.line), what, known.remark)
        return file

    def _is_equivalent(self, file: InputFile, entry: KeywordLine, row: KeywordRow) -> bool:
        """Whether a value is equivalent to the behaviour of the model."""
        value = entry.values[0].lower()
        if row.same == "blade 1":
            first = file.find(re.sub(r"\d", "1", entry.name))
            return first is not None and first.values == entry.values
        if row.same == ">TMax":
            return (number(value) or 0.0) >= self.given("duration", math.inf)
        words = row.same.lower().split()
        equivalent = {one(word) for word in words for one in (flag, number)} - {None}
        return value in words or bool({flag(value), number(value)} & equivalent)

    def differs(self, kind: Kind, usual: object, **reasons: str) -> None:
        """Add notes, with reasons, on values of the deck that differ from the usual one."""
        for target, why in reasons.items():
            if self.given(target, usual) != usual:
                self.note(kind, target, why)

    def use_other(self, target: str, first: str, why: str) -> None:
        """Replace the note on a value in whose place the model uses that of another target."""
        if target in self.source:
            equal = self.given(target, self[first]) == self[first]
            self.note("equivalent" if equal else "approximated", target, why)

    def unneeded(self, why: str, *targets: str) -> None:
        """Add notes on values that are not needed."""
        for target in targets:
            if target in self.source:
                self.note("not needed", target, why)

    def file(self, file: InputFile, target: str) -> Path | None:
        """The file named by a value, or None for "unused".

        Raises:
          InputError: the file does not exist.
        """
        text = self.data.get(target)
        return None if text is None else file.file(text, self._line.get(target, 0))


def _description_of(row: KeywordRow) -> str:
    unit = f" in {row.unit}" if row.unit else ""
    return f"expected {EXPECTED.get(row.kind, 'a value')}{unit}, for {row.target}"


def convert(file: InputFile, entry: KeywordLine, row: KeywordRow) -> Any:
    """The value of a line in SI units; None for "default" where that is allowed.

    Raises:
      InputError: the value is not of the expected kind.
    """
    text = entry.values[0]
    if row.optional and text.strip("\"'").lower() == "default":
        return None
    if row.kind in ("any", "text"):
        return text
    if row.kind == "file":
        if file.file(text, entry.line) is None:
            raise InputError(f"{file.at(entry.line)}: {entry.name}: {_description_of(row)}, found {text!r}")
        return text
    if row.kind == "flag":
        if (truth := flag(text)) is None:
            raise InputError(f"{file.at(entry.line)}: {entry.name}: {_description_of(row)}, found {text!r}")
        return truth
    numbers = [number(value) for value in (entry.values if row.kind == "list" else entry.values[:1])]
    bad = next((t for t, x in zip(entry.values, numbers, strict=False) if x is None or x != x or abs(x) > 1e30), None)
    if row.kind == "int" and bad is None and numbers[0] != int(numbers[0] or 0.0):
        bad = text
    if bad is not None:
        raise InputError(f"{file.at(entry.line)}: {entry.name}: {_description_of(row)}, found {bad!r}")
    if row.kind == "int":
        return int(numbers[0] or 0.0)
    factor = UNITS[row.unit] * (-1.0 if row.turned else 1.0)
    scaled = [factor * x + 0.0 for x in numbers if x is not None]
    return scaled if row.kind == "list" else scaled[0]
