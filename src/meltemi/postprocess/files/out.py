"""OpenFAST's text output (``.out``): a row of names that begins with ``Time``, a row of units, rows of numbers."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import InputError
from meltemi.postprocess.files.openfast import OutputColumns, columns_of, result_of
from meltemi.simulation.result import Result
from meltemi.wind_files.common import replacing, text_of

LARGEST = 4_000_000_000
"""[bytes] size of an hour with many channels."""
HEAD = 50
"""Number of lines that are searched for the names."""
STARS = re.compile(r"\*+")
"""Fortran's output for a number that does not fit its field."""
CLOSED = "This output file was closed"
"""Last line in the files of stand-alone modules."""


def read_out(path: str | Path) -> Result:
    """Read a text output of OpenFAST 2 to 5, in SI units; see :func:`meltemi.postprocess.files.openfast.result_of`.

    Numbers that Fortran could not write (``****``) become NaN. A cut last row, such as that of an interrupted run, is
    left out; the result's ``warnings`` say so.

    Raises:
      InputError: the file is missing, damaged or of another kind.
    """
    path = Path(path)
    lines = text_of(path, LARGEST).splitlines()
    head = next((i for i, line in enumerate(lines[:HEAD]) if line.split()[:1] and _begins(line)), None)
    if head is None or head + 1 >= len(lines):
        raise InputError(f"{path}: not an OpenFAST text output: no row of names that begins with 'Time'")
    names, units = lines[head].split(), re.findall(r"\(([^()]*)\)", lines[head + 1])
    if len(names) != len(units):
        raise InputError(
            f"{path}:{head + 2}: {len(names)} channels are named, but {len(units)} have a unit in parentheses"
        )
    data, warning = _numbers(lines, head + 2, len(names), path)
    about = (line.partition(":")[2].strip() for line in lines[:head] if line.startswith("Description"))
    return result_of(
        OutputColumns(tuple(names[1:]), tuple(units[1:]), data[:, 0], data[:, 1:], next(about, ""), warning), path
    )


def _begins(line: str) -> bool:
    return line.split()[0].strip('"').lower() == "time"


def _numbers(lines: list[str], first: int, n: int, path: Path) -> tuple[NDArray[np.float64], str]:
    """The rows, and a warning if the last one is truncated."""
    rows: list[NDArray[np.float64]] = []
    warning = ""
    for i, line in enumerate(lines[first:], first + 1):
        words = STARS.sub("nan ", line).split()
        if not words:
            continue
        if line.startswith(CLOSED):
            break
        if len(words) != n:
            if i == len(lines) and rows and len(words) < n:
                warning = f"{path.name} is cut: its last row has {len(words)} of {n} numbers"
                break
            raise InputError(f"{path}:{i}: expected {n} numbers, found {len(words)}")
        try:
            rows.append(np.array(words, dtype=float))
        except ValueError:
            raise InputError(f"{path}:{i}: {_first_bad(words)!r} is not a number") from None
    return np.stack(rows) if rows else np.zeros((0, n)), warning


def _first_bad(words: list[str]) -> str:
    for word in words:
        try:
            float(word)
        except ValueError:
            return word
    return ""


def write_out(result: Result, path: str | Path) -> Path:
    """Write a result as OpenFAST's text output, in its names and units, with seven digits.

    Raises:
      InputError: the file cannot be written.
    """
    path = Path(path)
    table = columns_of(result)
    units = ("(s)", *(f"({u})" for u in table.units))
    width = max(15, *(len(word) for word in (*table.names, *units)))
    about = ["", "", "", "", f"Description from the FAST input file:  {table.description}", ""]
    words = [("Time", *table.names), units]
    rows = np.column_stack([table.time, table.data])
    with replacing(path) as (partial,), partial.open("w", encoding="utf-8", newline="\n") as file:
        file.write("\n".join([*about, *("\t".join(w.ljust(width) for w in line) for line in words)]) + "\n")
        np.savetxt(file, rows, fmt=[f"%-{width}.6f", *[f"%-{width}.6e"] * len(table.names)], delimiter="\t")
    return path
