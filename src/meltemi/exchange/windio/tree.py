"""A windIO file as a tree of data."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import InputError, did_you_mean
from meltemi.core.yamlfile import parse, read_text
from meltemi.exchange.report import Notes

Float = NDArray[np.float64]


KEYS_2_0 = {
    "assembly.cut_in_wind_speed": "control.supervisory.Vin",
    "assembly.cut_out_wind_speed": "control.supervisory.Vout",
    "control.min_rotor_speed": "control.torque.VS_minspd",
    "control.rated_rotor_speed": "control.torque.VS_maxspd",
    "control.max_torque_rate": "control.torque.max_torque_rate",
    "control.optimal_tsr": "control.torque.tsr",
    "control.min_pitch_limit": "control.pitch.min_pitch",
    "control.max_pitch_limit": "control.pitch.max_pitch",
    "control.max_pitch_rate": "control.pitch.max_pitch_rate",
}
"""Keys of windIO 2.1 that windIO 2.0 has elsewhere, in the same units: deg, rpm."""


class Tree:
    """Data of a windIO file by key paths, and the notes on them.

    Attributes:
      where: the file, for messages.
      source: its name, for records.
      notes: notes added while reading.
      read: paths of the numbers that were read.
    """

    def __init__(self, data: dict[str, Any], where: str) -> None:
        self.data, self.where = data, where
        self.source = Path(where).name
        self.notes = Notes()
        self.read: dict[str, None] = {}

    def note(self, kind: Literal["used", "approximated", "ignored"], where: str, what: str, why: str = "") -> None:
        """Add a note."""
        self.notes.add(kind, where, what, why)

    def note_used(self) -> None:
        """Add a note on each number or list that was read, unless its path already has one."""
        noted = {part.strip() for note in self.notes for part in note.where.split(",")}
        for path in self.read:
            if path not in noted:
                self.note("used", path, path.rpartition(".")[2].replace("_", " "))

    def place(self, path: str) -> str:
        """The path of a value in this file, according to windIO 2.1 or 2.0."""
        old = KEYS_2_0.get(path)
        return old if old is not None and self._at(path) is None and self._at(old) is not None else path

    def get(self, path: str) -> Any:
        """The value at a path, or None."""
        return self._at(self.place(path))

    def _at(self, path: str) -> Any:
        value: Any = self.data
        for key in path.split("."):
            if not isinstance(value, dict) or key not in value:
                return None
            value = value[key]
        return value

    def need(self, path: str) -> Any:
        """The value at a path; an error if it is missing.

        Raises:
          InputError: the value is missing.
        """
        value: Any = self.data
        for i, key in enumerate(path.split(".")):
            if not isinstance(value, dict) or value.get(key) is None:
                above = ".".join(path.split(".")[:i])
                hint = did_you_mean(key, value) if isinstance(value, dict) else "a dictionary of keys is expected there"
                raise InputError(f"{self.where}: {path} is missing; under {above or 'the top'} {hint}")
            value = value[key]
        return value

    def number(self, path: str) -> float | None:
        """A number, or None.

        Raises:
          InputError: the value is not a finite number.
        """
        path = self.place(path)
        value = self.get(path)
        if value is None:
            return None
        self.read[path] = None
        return as_number(value, f"{self.where}: {path}")

    def entries(self, path: str) -> list[dict[str, Any]]:
        """A list of entries with keys.

        Raises:
          InputError: the list is missing or invalid.
        """
        return as_entries(self.need(path), f"{self.where}: {path}")

    def quantities(self, table: Mapping[str, tuple[str, float]]) -> dict[str, float]:
        """Numbers in SI units by meltemi's names, from a table ``name: (path, factor)``; missing values are omitted.

        Raises:
          InputError: a value is not a finite number.
        """
        quantities = {name: (self.number(path), factor) for name, (path, factor) in table.items()}
        return {name: value * factor for name, (value, factor) in quantities.items() if value is not None}

    def numbers(self, path: str, count: int | None = None) -> Float:
        """A list of numbers.

        Raises:
          InputError: it is missing, or no list of ``count`` numbers.
        """
        array = as_numbers(self.need(path), f"{self.where}: {path}", count)
        self.read[path] = None
        return array

    def curve(self, path: str, values: str = "values") -> tuple[Float, Float]:
        """Grid and values of a distributed quantity.

        Raises:
          InputError: it is missing or not regular.
        """
        grid = self.numbers(f"{path}.grid")
        if len(grid) < 2 or np.any(np.diff(grid) <= 0.0):
            raise InputError(f"{self.where}: {path}.grid: expected two or more numbers that increase")
        return grid, self.numbers(f"{path}.{values}", len(grid))

    def at(self, path: str, grid: Float, values: str = "values") -> Float:
        """A distributed quantity, interpolated linearly at other grid points."""
        return np.interp(grid, *self.curve(path, values))


def as_number(value: Any, where: str) -> float:
    """Check and convert a number.

    Raises:
      InputError: the value is not a finite number.
    """
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not abs(value) < 1e300:
        raise InputError(f"{where}: expected a number, found {str(value)[:40]!r}")
    return float(value)


def as_entries(value: Any, where: str) -> list[dict[str, Any]]:
    """A list of entries with keys.

    Raises:
      InputError: the value is no list of dictionaries, or empty.
    """
    if value is None:
        raise InputError(f"{where} is missing")
    if not isinstance(value, list) or not value or not all(isinstance(each, dict) for each in value):
        raise InputError(f"{where}: expected a list of entries with keys, found {str(value)[:40]!r}")
    return value


def as_numbers(value: Any, where: str, count: int | None = None) -> Float:
    """A list of numbers as an array.

    Raises:
      InputError: the value is no list of numbers, or has another length.
    """
    try:
        array = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        array = np.array(np.nan)
    if array.ndim != 1 or not np.all(np.isfinite(array)):
        raise InputError(f"{where}: expected a list of numbers, found {str(value)[:40]!r}")
    if count is not None and len(array) != count:
        raise InputError(f"{where}: expected {count} numbers like its grid, found {len(array)}")
    return array


LIST = re.compile(r"(?m)(?<= )\[([-+\d.eE,\s]*)\](?=[ \t\r]*$)")
"""A list of numbers at the end of a line. They are nearly all of a file, and YAML takes seconds for them."""
TOKEN = re.compile(r"~list(\d+)~")


def parse_quickly(text: str, path: Path) -> dict[str, Any]:
    """Parse YAML like :func:`~meltemi.core.yamlfile.parse`, but with a fast path for lists of numbers."""
    lists: list[str] = []

    def take(match: re.Match[str]) -> str:
        lists.append(match[1])
        return f"~list{len(lists) - 1}~" + "\n" * match[1].count("\n")  # keep line numbers for messages

    def put(node: Any) -> Any:
        if isinstance(node, dict):
            return {key: put(value) for key, value in node.items()}
        if isinstance(node, list):
            return [put(value) for value in node]
        if isinstance(node, str) and (match := TOKEN.fullmatch(node)):
            try:
                return [float(word) for word in lists[int(match[1])].split(",") if word.strip()]
            except ValueError:
                return f"[{lists[int(match[1])]}]"
        return node if not isinstance(node, str) else TOKEN.sub(lambda match: f"[{lists[int(match[1])]}]", node)

    content: dict[str, Any] = put(parse(LIST.sub(take, text), path, "a windIO turbine"))
    return content


def load(path: Path, *, first: bool = False) -> Tree:
    """Parse a windIO file.

    Args:
      first: read one of windIO 1, too.

    Raises:
      InputError: the file is missing, not YAML, or not a windIO 2 turbine.
    """
    data = parse_quickly(read_text(path), path)
    components = data.get("components")
    if not isinstance(components, dict) or not isinstance(components.get("blade"), dict):
        keys = ", ".join(str(key) for key in list(data)[:6])
        raise InputError(f"{path}: not a windIO turbine: components.blade is missing, found {keys}")
    if "outer_shape_bem" in components["blade"] and not first:
        raise InputError(f"{path}: this is windIO 1; convert it to windIO 2 with windIO.converters.windIO2windIO first")
    return Tree(data, str(path))
