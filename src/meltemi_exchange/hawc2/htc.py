"""Parser of HAWC2's main files (.htc): nested blocks of commands, and the report on each command.

A line is ``command values ; comment``; ``begin name`` and ``end name`` enclose a block; ``continue_in_file`` inserts a
file. ``commands.csv`` states the treatment of every command: its path of blocks as a pattern, the kind of the note,
values that are equivalent to the model whether it reads them or not, and a remark. The first row that fits counts.
"""

from __future__ import annotations

import csv
from collections.abc import Iterator
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from functools import cache
from pathlib import Path, PureWindowsPath
from typing import cast

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import InputError, did_you_mean
from meltemi.core.files import text_of
from meltemi_exchange.openfast.text import any_case, number
from meltemi_exchange.report import ImportNote, Kind

Float = NDArray[np.float64]
LEVELS = 4
"""Folders above the main file in which a named file is looked for: HAWC2 is started in one of them."""
DEEPEST = 20
"""Files that may continue in one another."""


@dataclass(frozen=True)
class Command:
    """One command.

    Attributes:
      where: file and line.
      values: the words behind its name.
    """

    name: str
    values: tuple[str, ...]
    where: str

    def numbers(self, first: int = 0, count: int | None = None) -> Float:
        """Its values from the first, counted from 0, as numbers.

        Raises:
          InputError: they are not numbers, or fewer than ``count``.
        """
        words = self.values[first : None if count is None else first + count]
        found = [number(word) for word in words]
        if not words or None in found or len(found) < (count or 1):
            what = f"{count or 'some'} number{'s' * (count != 1)}"
            raise InputError(
                f"{self.where}: {self.name}: expected {what} at place {first + 1}, found {' '.join(words)!r}"
            )
        return np.array(found, dtype=float)


@dataclass(frozen=True)
class Block:
    """A block: its commands and blocks."""

    name: str
    where: str
    commands: list[Command] = field(default_factory=list)
    blocks: list[Block] = field(default_factory=list)

    def all(self, *names: str) -> list[Command]:
        """The commands of these names, in the order of the file."""
        return [c for c in self.commands if c.name in names]

    def get(self, *names: str) -> Command | None:
        """The last command of these names, which counts."""
        found = self.all(*names)
        return found[-1] if found else None

    def need(self, *names: str) -> Command:
        """The last command of these names.

        Raises:
          InputError: there is none.
        """
        found = self.get(*names)
        if found is None:
            raise InputError(f"{self.where}: block {self.name}: the command {names[0]} is missing")
        return found

    def value(self, name: str, default: float, place: int = 0) -> float:
        """A number of a command, or a default without it."""
        found = self.get(name)
        return default if found is None else float(found.numbers(place, 1)[0])

    def within(self, *names: str) -> list[Block]:
        """The blocks of these names."""
        return [b for b in self.blocks if b.name in names]

    def block(self, name: str) -> Block:
        """The block of a name.

        Raises:
          InputError: there is none.
        """
        found = self.within(name)
        if not found:
            names = [b.name for b in self.blocks]
            raise InputError(
                f"{self.where}: the block {name} is missing in {self.name or 'the file'}: {did_you_mean(name, names)}"
            )
        return found[0]

    def find(self, name: str) -> Block:
        """The block of a name, empty if there is none."""
        return next(iter(self.within(name)), Block(name, self.where))


def read_htc(path: Path) -> Block:
    """Read a main file with the files in which it continues.

    Raises:
      InputError: with file and line.
    """
    root = Block("", str(path))
    stack = [root]
    _read(path, path, stack, 0)
    if len(stack) > 1:
        raise InputError(f"{stack[-1].where}: begin {stack[-1].name} has no end")
    return root


def _read(path: Path, main: Path, stack: list[Block], depth: int) -> None:
    if depth > DEEPEST:
        raise InputError(f"{path}: more than {DEEPEST} files continue in one another")
    for i, line in enumerate(text_of(path).splitlines(), 1):
        words = line.split(";")[0].split()
        if not words:
            continue
        where, name, values = f"{path}:{i}", words[0].lower(), tuple(words[1:])
        if name == "exit":
            return
        if name in ("begin", "end", "continue_in_file") and not values:
            raise InputError(f"{where}: {name}: a name is missing")
        if name == "begin":
            block = Block(values[0].lower(), where)
            stack[-1].blocks.append(block)
            stack.append(block)
        elif name == "end":
            if stack[-1].name != values[0].lower():
                inside = f"begin {stack[-1].name} ({stack[-1].where})" if stack[-1].name else "no open block"
                raise InputError(f"{where}: end {values[0]} does not match {inside}")
            stack.pop()
        elif name == "continue_in_file":
            _read(file_of(main, values[0], where), main, stack, depth + 1)
        else:
            stack[-1].commands.append(Command(name, values, where))


def file_of(main: Path, name: str, where: str) -> Path:
    """A file that a model names, from the folder in which HAWC2 is started: that of the main file or one above.

    Raises:
      InputError: there is none.
    """
    parts = [p for p in PureWindowsPath(name.strip("'\"")).parts if p != "."]
    folders = [main.absolute().parent, *main.absolute().parents[1:LEVELS]]
    for folder in folders:
        if (found := any_case(folder, parts)) is not None:
            return found
    raise InputError(
        f"{where}: the file {name} does not exist in {folders[0]} and the {LEVELS - 1} folders above it, from one of "
        "which HAWC2 is started"
    )


@cache
def _rows() -> tuple[tuple[str, Kind, tuple[str, ...], str], ...]:
    with (Path(__file__).parent / "commands.csv").open(newline="", encoding="utf-8") as file:
        return tuple(
            (path, cast("Kind", row["kind"]), tuple(row["same"].split("|")) if row["same"] else (), row["remark"])
            for row in csv.DictReader(file)
            for path in row["command"].split()
        )


def notes_on(root: Block) -> list[ImportNote]:
    """A note on every command of a file; those that come again within a block share one."""
    notes = []
    for path, commands in _walk(root, ""):
        first, last = commands[0], commands[-1]
        shown = " ".join(last.values)[:60]
        what = f"{first.name} ({len(commands)} lines)" if len(commands) > 1 else f"{first.name} = {shown}"
        row = next((r for r in _rows() if fnmatchcase(path, r[0])), None)
        kind: Kind = row[1] if row else "ignored"
        same, remark = row[2:] if row else ((), "unknown to this reader")
        if any(_like(shown, value) for value in same):
            kind = "equivalent"
        where = first.where.rsplit("/", 1)[-1]
        notes.append(ImportNote(kind, where, f"{path.rsplit('/', 1)[0]}: {what}", remark))
    return notes


def _like(shown: str, value: str) -> bool:
    numbers = [number(text) for text in (shown, value)]
    return numbers[0] == numbers[1] if None not in numbers else shown.split()[:1] == value.split()


def _walk(block: Block, path: str) -> Iterator[tuple[str, list[Command]]]:
    for name in dict.fromkeys(c.name for c in block.commands):
        yield f"{path}{name}", block.all(name)
    for inner in block.blocks:
        yield from _walk(inner, f"{path}{inner.name}/")
