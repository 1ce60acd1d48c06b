"""Series as comma-separated values: one form for all that is read and written.

The first row has names with units, ``time [s],generator_speed [rpm],u [m/s]``; the time is the first column. Rows of
numbers follow. Empty rows and those that begin with ``#`` are skipped.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Iterable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import InputError
from meltemi.core.files import replacing, text_of

LARGEST = 1_000_000_000
"""[bytes] largest size of a file."""
HEAD = re.compile(r"\s*([^\[\]]*[^\[\]\s])\s*\[\s*([^\]]*?)\s*\]\s*")
"""Name and unit of a column."""


def read_columns(path: Path) -> tuple[list[tuple[str, str]], NDArray[np.float64]]:
    """Names with their units, and (rows, columns) numbers, of a file; empty cells become NaN.

    Raises:
      InputError: the file is missing, has no such form, or a row is not of numbers; the message names the row.
    """
    lines = text_of(path, LARGEST).removeprefix("\ufeff").splitlines()
    reader = csv.reader(line if not line.lstrip().startswith("#") else "" for line in lines)
    rows = [(reader.line_num, row) for row in reader if any(cell.strip() for cell in row)]
    if len(rows) < 2:
        raise InputError(f"{path}: expected a row of names with units, such as 'time [s],u [m/s]', and rows of numbers")
    heads: list[tuple[str, str]] = []
    for cell in rows[0][1]:
        match = HEAD.fullmatch(cell)
        if match is None:
            raise InputError(
                f"{path}:{rows[0][0]}: column {cell.strip()[:60]!r} has no unit in brackets; expected names with "
                "units, separated by commas, such as 'time [s],generator_speed [rpm],u [m/s]'"
            )
        heads.append((match[1], match[2]))
    if (heads[0][0].lower(), heads[0][1]) != ("time", "s"):
        raise InputError(f"{path}:{rows[0][0]}: the first column must be 'time [s]', found {rows[0][1][0].strip()!r}")
    if twice := [name for i, (name, _) in enumerate(heads) if name in dict(heads[:i])]:
        raise InputError(f"{path}:{rows[0][0]}: the column {twice[0]!r} appears twice")
    data = np.empty((len(rows) - 1, len(heads)))
    for i, (line, row) in enumerate(rows[1:]):
        try:
            data[i] = [float(cell) if cell.strip() else np.nan for cell in row]
        except ValueError:
            header = ",".join(row)
            raise InputError(f"{path}:{line}: expected {len(heads)} numbers, found {header[:60]!r}") from None
    return heads, data


def write_columns(path: Path, heads: Iterable[tuple[str, str]], data: NDArray[np.float64]) -> Path:
    """Write (rows, columns) numbers with all digits below names and units, of which the first are ``time`` and ``s``.

    Raises:
      InputError: the file cannot be written.
    """
    with replacing(path) as (partial,), partial.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow([f"{name} [{unit}]" for name, unit in heads])
        writer.writerows([repr(float(x)) for x in row] for row in data)
    return path
