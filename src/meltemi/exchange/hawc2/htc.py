"""Parser of HAWC2's main files (.htc): nested blocks of commands, and the report on each command.

A line is ``command values ; comment``; ``begin name`` and ``end name`` enclose a block; ``continue_in_file`` inserts a
file. ``commands.csv`` states the treatment of every command: its path of blocks as a pattern, first values for which
the row stands (all without any), the kind of the note, and a remark. The first row that fits counts. A block with a
role in the model, such as the body of the tower, is ``block:role`` in the path, a constant of a library
``constant_number``.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from functools import cache
from itertools import groupby
from pathlib import Path, PureWindowsPath
from typing import cast

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import InputError, closest, did_you_mean
from meltemi.core.files import text_of
from meltemi.exchange.openfast.text import any_case, number
from meltemi.exchange.report import Kind, Notes

Float = NDArray[np.float64]
LEVELS = 4
"""Folders above the main file in which a named file is looked for: HAWC2 is started in one of them."""
DEEPEST = 20
"""Files that may continue in one another."""
LFS = "version https://git-lfs"
"""First words of a file that stands for one in the large file storage of git."""
TAG = re.compile(r"\[[A-Za-z][^\]]*\]?|\{[{%#][^}]*\}*")
"""Tag of a template, which a preprocessor replaces."""
OLDER = re.compile(r"^body(?=[12]?$|[12]?_(name|node|eulerang|eulerpar|axisangle|ini_rotvec_d1)$)")
"""Spelling of a main body in commands of earlier versions: ``body2_eulerang`` is ``mbdy2_eulerang``."""


@dataclass(frozen=True)
class Command:
    """One command.

    Attributes:
      name: name in the spelling of HAWC2 12 and later.
      where: file and line.
      values: the words after its name.
    """

    name: str
    values: tuple[str, ...]
    where: str

    def numbers(self, first: int, count: int, more: int = 0) -> Float:
        """``count`` values from index ``first`` as numbers, and up to ``more`` further ones if they are given.

        Raises:
          InputError: they are not numbers, or fewer than ``count``.
        """
        words = [w for value in self.values for w in value.split(",") if w][first : first + count + more]
        values = [number(word) for word in words]
        given = values.index(None) if None in values else len(values)
        if given < count:
            shown = " ".join(words[:count])
            raise InputError(
                f"{self.where}: {self.name}: expected {count} number{'s' * (count != 1)} at place {first + 1}, "
                f"found {shown!r}{template_hint(shown)}"
            )
        return np.array(values[:given], dtype=float)

    def word(self, place: int = 0) -> str:
        """The word at an index in lower case: names of bodies and choices.

        Raises:
          InputError: there is none.
        """
        if place >= len(self.values):
            raise InputError(f"{self.where}: {self.name}: expected a word at place {place + 1}, found nothing")
        return self.values[place].strip("'\"").lower()

    def file(self, main: Path) -> Path:
        """The file named by all words, as a name may have blanks, or by the first.

        Raises:
          InputError: there is none.
        """
        names = dict.fromkeys([" ".join(self.values), *self.values[:1]])
        existing = next((path for name in names if (path := _place_of(main, name)) is not None), None)
        return file_of(main, " ".join(self.values), self.where) if existing is None else existing


@dataclass(frozen=True)
class Block:
    """Block of commands and nested blocks."""

    name: str
    where: str
    commands: list[Command] = field(default_factory=list)
    blocks: list[Block] = field(default_factory=list)

    def all(self, *names: str) -> list[Command]:
        """The commands of these names, in the order of the file."""
        return [c for c in self.commands if c.name in names]

    def get(self, *names: str) -> Command | None:
        """The last command of these names, which is the effective one."""
        commands = self.all(*names)
        return commands[-1] if commands else None

    def need(self, *names: str) -> Command:
        """The last command of these names.

        Raises:
          InputError: there is none.
        """
        command = self.get(*names)
        if command is None:
            raise InputError(f"{self.where}: block {self.name}: the command {names[0]} is missing")
        return command

    def value(self, name: str, default: float, place: int = 0) -> float:
        """A number of a command, or the default if the command is missing."""
        command = self.get(name)
        return default if command is None else float(command.numbers(place, 1)[0])

    def within(self, *names: str) -> list[Block]:
        """The blocks of these names."""
        return [b for b in self.blocks if b.name in names]

    def block(self, name: str) -> Block:
        """The block of a name.

        Raises:
          InputError: there is none.
        """
        blocks = self.within(name)
        if not blocks:
            names = [b.name for b in self.blocks]
            raise InputError(
                f"{self.where}: the block {name} is missing in {self.name or 'the file'}: {did_you_mean(name, names)}"
            )
        return blocks[0]

    def find(self, name: str) -> Block:
        """The block of a name, empty if there is none."""
        return next(iter(self.within(name)), Block(name, self.where))


def read_htc(path: Path) -> Block:
    """Read a main file with the files in which it continues.

    Raises:
      InputError: the file is not valid; the message has file and line.
    """
    root = Block("", str(path))
    stack = [root]
    _read(path, path, stack, 0)
    if len(stack) > 1:
        raise InputError(f"{stack[-1].where}: begin {stack[-1].name} has no end")
    return root


def lines_of(path: Path) -> list[str]:
    """The lines of a file of a model.

    Raises:
      InputError: it cannot be read, or is a placeholder for another file.
    """
    text = text_of(path)
    if text.startswith(LFS):
        raise InputError(f"{path}: this is a pointer to a file in Git LFS, not the file: `git lfs pull` fetches it")
    return text.splitlines()


def template_hint(text: str) -> str:
    """Hint for a value that a preprocessor has still to fill in; empty for other values."""
    tag = TAG.search(text)
    if tag is None:
        return ""
    return f"; {tag.group()} is a tag of a template: fill in the template first, and import what comes out"


def _read(path: Path, main: Path, stack: list[Block], depth: int) -> None:
    if depth > DEEPEST:
        raise InputError(f"{path}: more than {DEEPEST} files continue in one another")
    for i, line in enumerate(lines_of(path), 1):
        words = line.split(";")[0].split()
        if not words:
            continue
        where, name, values = f"{path}:{i}", OLDER.sub("mbdy", words[0].lower()), tuple(words[1:])
        if name == "exit":
            return
        if tag := TAG.match(line.strip()):
            raise InputError(f"{where}: expected a command, found {tag.group()!r}{template_hint(line)}")
        if name == "end" and not values and stack[-1].name:
            values = (stack[-1].name,)
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
            _read(Command(name, values, where).file(main), main, stack, depth + 1)
        else:
            stack[-1].commands.append(Command(name, values, where))


def file_of(main: Path, name: str, where: str) -> Path:
    """A file that a model names, from the folder in which HAWC2 is started: that of the main file or one above.

    Raises:
      InputError: there is none.
    """
    if (path := _place_of(main, name)) is not None:
        return path
    raise InputError(
        f"{where}: the file {name} does not exist in {main.absolute().parent} and the {LEVELS - 1} folders above it, "
        f"from one of which HAWC2 is started{template_hint(name)}"
    )


def _place_of(main: Path, name: str) -> Path | None:
    parts = [p for p in PureWindowsPath(name.strip("'\"")).parts if p != "."]
    candidates = (any_case(folder, parts) for folder in main.absolute().parents[:LEVELS])
    return next((path for path in candidates if path is not None), None) if parts else None


@dataclass(frozen=True)
class CommandRule:
    """CommandRule of ``commands.csv``: treatment of the commands of a path, for all or some of their first values."""

    path: str
    values: tuple[str, ...]
    kind: Kind
    remark: str

    def fits(self, path: str, values: tuple[str, ...]) -> bool:
        """Whether the rule applies to a command of this path with these values."""
        return fnmatchcase(path, self.path) and (not self.values or any(_matches(values, v) for v in self.values))


def _matches(values: tuple[str, ...], wanted: str) -> bool:
    first = (values or ("",))[: len(wanted.split())]
    return all(
        a.lower() == b or (number(a) is not None and number(a) == number(b))
        for a, b in zip(first, wanted.split(), strict=False)
    )


@cache
def rows() -> tuple[CommandRule, ...]:
    """The rows of ``commands.csv``, one for each path."""
    with (Path(__file__).parent / "commands.csv").open(newline="", encoding="utf-8") as file:
        return tuple(
            CommandRule(path, tuple(filter(None, row["values"].split("|"))), cast("Kind", row["kind"]), row["remark"])
            for row in csv.DictReader(file)
            for path in row["command"].split()
        )


@dataclass
class Treatment:
    """Treatment of blocks and commands that the reader determines beyond ``commands.csv``.

    Attributes:
      roles: roles of blocks in the model, by ``id``.
      remarks: kind and remark of single commands, by ``id``, in place of those of their rule.
    """

    roles: dict[int, str] = field(default_factory=dict)
    remarks: dict[int, tuple[Kind, str]] = field(default_factory=dict)

    def set_note(self, commands: Iterable[Command], kind: Kind, remark: str) -> None:
        """Set the kind of note and the remark of commands."""
        self.remarks |= {id(command): (kind, remark) for command in commands}


def treatments(root: Block, treatment: Treatment) -> Iterator[tuple[str, Command, Kind, str]]:
    """Path, command, kind of note and remark for every command of a model, in the order of the blocks."""
    for path, command in _walk(root, "", treatment.roles):
        row = next((r for r in rows() if r.fits(path, command.values)), None)
        if id(command) in treatment.remarks:
            yield (path, command, *treatment.remarks[id(command)])
        elif row is not None:
            yield path, command, row.kind, row.remark
        else:
            yield path, command, "ignored", f"unknown to this reader{_nearest(command.name, path)}"


def _nearest(name: str, path: str) -> str:
    block = path.rpartition("/")[0].rpartition("/")[2].partition(":")[0]
    known = {r.path.rpartition("/")[2] for r in rows() if block in r.path}
    near = closest(name, known - {"*"}, n=1)
    return f"; it knows {near[0]}" if near else ""


def notes_on(root: Block, treatment: Treatment) -> Notes:
    """A note on every command of a file; commands of one name with the same treatment share a note."""
    notes = Notes()
    for (block, name, kind, remark), group in groupby(treatments(root, treatment), _grouped):
        commands = [command for _, command, _, _ in group]
        first = commands[0]
        if len(commands) == 1:
            what = f"{name} = {' '.join(first.values)[:60]}"
        elif name == "constant":
            what = f"constants {', '.join(c.values[0] for c in commands)}"
        else:
            what = f"{name} ({len(commands)} lines)"
        notes.add(kind, first.where.rpartition("/")[2], f"{block}: {what}", remark)
    return notes


def _grouped(treated: tuple[str, Command, Kind, str]) -> tuple[str, str, Kind, str]:
    path, command, kind, remark = treated
    return path.rpartition("/")[0], command.name, kind, remark


def _walk(block: Block, path: str, roles: Mapping[int, str]) -> Iterator[tuple[str, Command]]:
    order = list(dict.fromkeys(c.name for c in block.commands))
    for command in sorted(block.commands, key=lambda c: order.index(c.name)):
        name = command.name
        if name == "constant" and command.values:
            name = f"constant_{command.values[0].split(',')[0]}"
        yield f"{path}{name}", command
    for inner in block.blocks:
        role = roles.get(id(inner))
        yield from _walk(inner, f"{path}{inner.name}{f':{role}' if role else ''}/", roles)
