"""Parser of OpenFAST's input files: values by keyword, tables by the order of their columns.

OpenFAST reads by position; versions differ in order, spelling and number of lines. Here a line is
``value(s)  Keyword  - comment`` at any place; brackets and case of keywords do not matter. A line ``@name`` or
``@4-9 in name`` includes a file, or lines of it (``ReadComFile`` in NWTC_IO.f90). Tables are read as in
OpenFAST: by the order of their columns, those of ElastoDyn's and AeroDyn's blades by the names of their columns.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path, PureWindowsPath

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import InputError, closest
from meltemi.core.files import bytes_of
from meltemi.exchange.report import Notes

Float = NDArray[np.float64]
_TOKEN = re.compile(r"""@?"[^"]*"|@?'[^']*'|[^\s,;]+""")
_NAME = re.compile(r"[A-Za-z_][\w]*([(\[][\w,]+[)\]])?$")
NO_FILE = frozenset(["", "unused", "none", "unsed", "n/a", "default"])
WORDS = NO_FILE | {"true", "false", "t", "f"}
"""Values that are words."""
DIFFRACTS = "MCF"
"""Keyword in place of HydroDyn's pressure coefficients: 1, and MacCamy-Fuchs diffraction (``ParseRAryWKywrd``)."""
POSITIONAL = frozenset(["main", "ElastoDyn", "ElastoDyn tower", "BeamDyn", "BeamDyn blade", "DISCON", "OLAF"])
"""Modules whose files include no other ones."""
INCLUDE = re.compile(r"""\s*@\s*(?:(\d+)\s*(-\s*\d+)?\s+in\s+)?(?:"([^"]+)"|'([^']+)'|([^"'!#%]+))""", re.IGNORECASE)
DEEPEST = 16
"""Files that include each other."""
LARGEST = 64_000_000
"""[bytes] no text file of a deck is larger."""


@lru_cache(maxsize=4096)
def key(name: str) -> str:
    """Normalised keyword: ``BldFile(1)``, ``BldFile1`` and ``bldfile[1]`` are one."""
    return re.sub(r"[()\[\]]", "", name).lower()


def number(text: str) -> float | None:
    """A finite number in Fortran notation, or None."""
    fortran = re.sub(r"(?<=[\d.])(?:[dDqQ]|(?=[+-]\d+$))(?=[+-]?\d)", "e", text)  # 1.5d3, also written 1.5+3
    for spelled in (text, fortran):
        with suppress(ValueError):
            value = float(spelled)
            return value if math.isfinite(value) else None
    return None


def flag(text: str) -> bool | None:
    """True or False as Fortran reads them, by the first letter after a point; 1 and 0 too; or None."""
    match = re.match(r"\.?([tf])\w*\.?$|([01])$", text.strip("'\""), re.IGNORECASE)
    return None if match is None else match[0].lstrip(".")[0].lower() in "t1"


@dataclass(frozen=True)
class KeywordLine:
    """One line with a keyword.

    Attributes:
      name: the keyword as spelled in the file.
      values: the words before it.
      line: line number, from 1.
    """

    name: str
    values: tuple[str, ...]
    line: int


@dataclass(frozen=True)
class InputFile:
    """A parsed file of a deck: keywords and lines.

    Attributes:
      path: path of the file.
      module: name for messages, e.g. ``"ElastoDyn"``.
      lines: its text, including that of included files.
      entries: keyword lines by key; a repeated keyword, as in airfoil tables, has several.
      origins: file and number of each line, if there are included files.
    """

    path: Path
    module: str
    lines: tuple[str, ...]
    entries: dict[str, list[KeywordLine]] = field(default_factory=dict)
    origins: tuple[tuple[Path, int], ...] = ()

    def at(self, line: int) -> str:
        """File and line for error messages."""
        path, line_number = self.origins[line - 1] if self.origins and line else (self.path, line)
        return f"{path}:{line_number}" if line else str(path)

    def place(self, line: int) -> str:
        """Name of the file and line for notes."""
        return Path(self.at(line)).name

    def find(self, *names: str) -> KeywordLine | None:
        """The first line that has one of the keywords."""
        for name in names:
            if key(name) in self.entries:
                return self.entries[key(name)][0]
        return None

    def require(self, names: Sequence[str], what: str) -> KeywordLine:
        """Line of a required keyword.

        Raises:
          InputError: the keyword is missing; the message names the closest one.
        """
        entry = self.find(*names)
        if entry is not None:
            return entry
        near = closest(key(names[0]), self.entries, n=1)
        other = self.entries[near[0]][0] if near else None
        hint = f"; the closest is {other.name} in line {other.line}" if other else ""
        raise InputError(
            f"{self.path}: {self.module} keyword {names[0]} is missing ({what}){hint}; "
            "a line reads: value, keyword, comment"
        )

    def table(
        self, entry: KeywordLine, wanted: Mapping[str, str], notes: Notes, optional: Sequence[str] = ()
    ) -> dict[str, Float]:
        """Columns of numbers by their names in the header, as OpenFAST reads the blades of ElastoDyn and AeroDyn.

        Args:
          entry: the line that says how many rows there are.
          wanted: name of each column in the header; the first one identifies the header.
          notes: a warning is appended if the table continues.
          optional: columns that may be missing and are then left out.

        Raises:
          InputError: the table is not valid; the message has file, line and what was expected.
        """
        count, first = self.count(entry), next(iter(wanted.values()))
        at = next(
            (i for i in range(entry.line, len(self.lines)) if first.lower() in self.lines[i].lower().split()), None
        )
        if at is None:
            raise InputError(
                f"{self.path}: no table header with {first} below line {entry.line} ({entry.name}); "
                "columns of this table are identified by their names"
            )
        header, rows, _ = self.rows(entry, count, at, notes=notes)
        columns = [key(name) for name in header]
        missing = [name for target, name in wanted.items() if key(name) not in columns and target not in optional]
        if missing:
            raise InputError(
                f"{self.path}: the table of {entry.name} (line {entry.line}) needs the "
                f"column{'s' * (len(missing) > 1)} {', '.join(missing)}"
            )
        places = {t: (columns.index(key(name)), name) for t, name in wanted.items() if key(name) in columns}
        return {
            target: np.array([self._cell(line, tokens, place, name) for line, tokens in rows])
            for target, (place, name) in places.items()
        }

    def placed(
        self,
        entry: KeywordLine,
        layout: str,
        wanted: Mapping[str, str],
        notes: Notes,
        *,
        after: int | None = None,
        skip: int = 0,
    ) -> dict[str, Float]:
        """Columns of numbers by their order, as OpenFAST reads its other tables; the header is only checked.

        Args:
          entry: the line that says how many rows there are.
          layout: names of the columns in the order in which OpenFAST reads them; a bar separates spellings.
          wanted: name of each column in the layout.
          notes: a warning is appended if the header has another name in a column.
          after: the table follows this line; by default that of ``entry``.
          skip: lines between that line and the header.

        Raises:
          InputError: the table is not valid; the message has file, line and what was expected.
        """
        header, rows, line = self.rows(entry, self.count(entry), entry.line if after is None else after, skip, notes)
        order = layout.split()
        names = [name.split("|")[0] for name in order]
        places = {target: names.index(name) for target, name in wanted.items()}
        if rows:
            check_header(self.place(line), header, order, sorted(set(places.values())), notes)
        return {
            target: np.array([self._cell(at, tokens, place, names[place]) for at, tokens in rows])
            for target, place in places.items()
        }

    def _cell(self, line: int, tokens: list[str], place: int, name: str) -> float:
        if place >= len(tokens):
            raise InputError(
                f"{self.at(line)}: the table has {place + 1} columns or more ({name}), found {len(tokens)}"
            )
        value = 1.0 if tokens[place].strip("'\"").upper() == DIFFRACTS else number(tokens[place])
        if value is None or not np.isfinite(value):
            raise InputError(f"{self.at(line)}: expected a number for {name}, found {tokens[place]!r}")
        return value

    def rows(
        self, entry: KeywordLine, count: int, after: int | None = None, skip: int = 0, notes: Notes | None = None
    ) -> tuple[list[str], list[tuple[int, list[str]]], int]:
        """Header, ``count`` rows with their lines, and the line of the last one, of the table of a keyword.

        A table is two lines of header, names and units, and rows that begin with a number; blank lines and comments do
        not count.

        Args:
          entry: the line that says how many rows there are.
          count: number of rows.
          after: the table follows this line; by default that of ``entry``.
          skip: lines between that line and the header, such as the title of a section.
          notes: a warning is appended if the file ends with more rows, which OpenFAST does not read.

        Raises:
          InputError: the table is missing or malformed.
        """
        at = entry.line if after is None else after
        body = [(i, split(line)) for i, line in enumerate(self.lines[at:], at + 1) if is_content(line)][skip:]
        head = next((k for k, (_, tokens) in enumerate(body[:3]) if begins_with_number(tokens)), 2)
        if count and any(self.lines[i - 1].strip().startswith(("---", "===")) for i, _ in body[:head]):
            raise InputError(
                f"{self.at(at)}: {entry.name} says {count} lines, but the table of {entry.name} does not follow: "
                "expected two lines of header, names and units, and rows of numbers"
            )
        rows = body[head : head + count]
        for i in range(count):
            if i >= len(rows) or not begins_with_number(rows[i][1]):
                line, tokens = rows[i] if i < len(rows) else (len(self.lines), [])
                raise InputError(
                    f"{self.at(line)}: {entry.name} in line {entry.line} says {count} "
                    f"lines, but line {i + 1} of the table is not one ({' '.join(tokens)[:40]!r})"
                )
        if count:
            self.check_end(entry, count, body[head:], len(rows[0][1]), notes)
        header = [t.strip("!") for t in body[0][1]] if head and body else []
        last = rows[-1][0] if rows else body[head - 1][0] if 0 < head <= len(body) else at
        return header, rows, last

    def check_end(
        self, entry: KeywordLine, count: int, rows: Sequence[tuple[int, list[str]]], width: int, notes: Notes | None
    ) -> None:
        """Check that a table ends where its keyword says; further rows at the end of the file are a warning.

        Rows after a blank line or a comment are ignored deliberately, without a warning.

        Args:
          entry: the line that says how many rows there are.
          count: number of rows.
          rows: numbers and words of the lines from the first row on.
          width: least number of words of a row.
          notes: the warning is appended; without notes the further rows are an error, too.

        Raises:
          InputError: more rows and then other content follow, which OpenFAST would misread.
        """

        def more(words: list[str]) -> bool:
            return len(words) >= width > 1 and all(number(word) is not None for word in words[:width])

        beyond = rows[count:]
        if not beyond or not more(beyond[0][1]) or beyond[0][0] != rows[count - 1][0] + 1:
            return
        first = beyond[0][0]
        if notes is None or not all(more(words) for _, words in beyond):
            raise InputError(
                f"{self.at(first)}: {entry.name} in line {entry.line} says {count} lines, but the table goes on"
            )
        what = f"{len(beyond)} line{'s' * (len(beyond) > 1)} beyond {entry.name} = {count}"
        notes.add("warning", self.place(first), what, "not read, as in OpenFAST")

    def count(self, entry: KeywordLine) -> int:
        """Number of lines that a keyword gives.

        Raises:
          InputError: it is not a whole number from 0 to 100000.
        """
        value = number(entry.values[0])
        if value is None or value != int(value) or not 0 <= value <= 100_000:
            raise InputError(
                f"{self.at(entry.line)}: {entry.name}: expected a whole number of lines, found {entry.values[0]!r}"
            )
        return int(value)

    def file(self, text: str, line: int) -> Path | None:
        """A path named in the file, or None for "unused" etc.; separators of all systems are accepted.

        Raises:
          InputError: there is no such file.
        """
        bare = text.lstrip("@").strip("\"'").strip()
        if bare.lower() in NO_FILE:
            return None
        parts = PureWindowsPath(bare).parts if "\\" in bare else Path(bare).parts
        path = self.path.parent.joinpath(*parts)
        existing = path if path.is_file() else any_case(self.path.parent, parts)
        if existing is None:
            folder = path.parent
            names = [p.name for p in folder.iterdir()] if folder.is_dir() else []
            near = closest(path.name, names, n=1)
            raise InputError(
                f"{self.at(line)}: the file does not exist: {path}" + (f"; did you mean {near[0]!r}?" if near else "")
            )
        return existing


def is_content(line: str) -> bool:
    """Whether a line is neither blank nor a comment."""
    bare = line.strip()
    return bool(bare) and bare[0] not in "!#%"


def begins_with_number(tokens: Sequence[str]) -> bool:
    """Whether a line of words is a row of a table."""
    return bool(tokens) and number(tokens[0].strip("'\"")) is not None


def check_header(where: str, header: Sequence[str], order: Sequence[str], places: Sequence[int], notes: Notes) -> None:
    """Warn of columns whose header names contradict their order; alternative spellings share their beginning.

    Args:
      where: file and line of the table.
      header: words of the header.
      order: names of the columns; a bar separates spellings.
      places: indices of the columns that are read.
    """
    spelled = [[re.sub(r"\W", "", word.lower()) for word in name.split("|")] for name in order]
    for place in places:
        title = re.sub(r"\W", "", header[place].lower()) if place < len(header) else ""
        spellings = spelled[place]
        other = any(title in words for k, words in enumerate(spelled) if k != place and title not in spellings)
        alike = any(title.startswith(word) or word.startswith(title) for word in spellings)
        if title and (other or not alike):
            what = f"column {place + 1} is headed {header[place]}"
            why = f"read as {order[place].split('|')[0]}: OpenFAST reads this table by position"
            if not any((n.where, n.what) == (where, what) for n in notes):
                notes.add("warning", where, what, why)


def any_case(folder: Path, parts: Sequence[str]) -> Path | None:
    """The file with this name regardless of case."""
    for part in parts:
        if part in (".", "..") or (folder / part).exists():
            folder = folder / part
            continue
        try:
            near = [p for p in folder.iterdir() if p.name.lower() == part.lower()]
        except OSError:
            return None
        if not near:
            return None
        folder = near[0]
    return folder if folder.is_file() else None


def split(line: str) -> list[str]:
    """Split a line into words; quoted text is one word."""
    return _TOKEN.findall(line)


def read_input(path: Path, module: str) -> InputFile:
    """Read a file of a deck.

    Raises:
      InputError: it cannot be read, or is not text.
    """
    known = _lines(path, module)
    lines = tuple(line for *_, line in known)
    origins = tuple((origin, i) for origin, i, _ in known) if any(origin != path for origin, *_ in known) else ()
    entries: dict[str, list[KeywordLine]] = {}
    in_list = False
    titled = bool(lines) and lines[0].lstrip().startswith("--")
    for i, line in enumerate(lines):
        bare = line.strip()
        if i == 1 and titled:
            continue
        if not bare or bare[0] in "!#%" or bare.startswith(("---", "===")):
            continue
        tokens = split(bare)
        if in_list:
            in_list = not bare.strip("\"'").upper().startswith("END")
            continue
        if any(t.lower() == "outlist" for t in tokens[:2]):
            in_list = True
            continue
        if _is_header(tokens):
            continue
        entry = _entry(tokens, i + 1)
        if entry is not None:
            entries.setdefault(key(entry.name), []).append(entry)
    return InputFile(path, module, lines, entries, origins)


def _lines(path: Path, module: str, within: tuple[Path, ...] = ()) -> list[tuple[Path, int, str]]:
    """Lines of a file with their files and numbers, included files (with relative paths) in place.

    Raises:
      InputError: a file is not there, is not text, or includes itself.
    """
    raw = bytes_of(path, LARGEST)
    if b"\0" in raw[:4096]:
        raise InputError(f"{path}: not a text file; expected {module} input")
    try:
        text = raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = raw.decode("latin-1")
    lines: list[tuple[Path, int, str]] = []
    for i, line in enumerate(text.splitlines(), 1):
        named = INCLUDE.match(line) if module not in POSITIONAL else None
        if named is None or "numcoords" in line.lower():  # coordinates of an airfoil, which are not used
            lines.append((path, i, line))
            continue
        name = next(filter(None, named.groups()[2:])).strip()
        other = InputFile(path, module, ()).file(name, i)
        if other is None or other in (path, *within) or len(within) > DEEPEST:
            raise InputError(f"{path}:{i}: {name} cannot be included here")
        begin, end = int(named[1] or 1), int((named[2] or "0").strip("- "))
        lines += _lines(other, module, (*within, path))[begin - 1 : end or None]
    return lines


def _is_header(tokens: list[str]) -> bool:
    """Whether a line is a table header (or text): three consecutive words that are not values."""
    first = tokens[0].lower()
    return first not in WORDS and len(tokens) > 2 and all(_NAME.match(t) and number(t) is None for t in tokens[:3])


def _entry(tokens: list[str], line: int) -> KeywordLine | None:
    """Leading values, then the keyword: the first word that is neither number nor quoted nor the first."""
    values: list[str] = []
    for token in tokens:
        word = token.strip("!")
        if not word or word == "-":
            continue
        if values and _NAME.match(word) and number(word) is None:
            return KeywordLine(word, tuple(values), line)
        if not values or number(token) is not None or token[0] in "\"'":
            values.append(token.strip("\"'") if token[0] in "\"'" else token)
            continue
        return None
    return None
