"""Templates of the files of an OpenFAST 5 deck: ``lines.txt`` contains the keywords in the order of the input files.

A line has a default value and a keyword; ``==`` begins a heading, ``@`` a table or list that the writer fills in,
with its columns after a colon if it may be empty.
The order is that of the decks of OpenFAST 5.0.0's reference runs (Apache-2.0), which the tests compare.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from meltemi.exchange.openfast.keywords import ROWS, UNITS, row_of
from meltemi.exchange.openfast.text import key


def template(module: str) -> list[str]:
    """Lines of the template of a file."""
    text = (Path(__file__).parent / "lines.txt").read_text(encoding="utf-8")
    for part in text.split("\n# "):
        name, _, lines = part.removeprefix("# ").partition("\n")
        if name == module:
            return lines.splitlines()
    raise KeyError(module)


def fill(module: str, title: str, values: Mapping[str, object], tables: Mapping[str, Sequence[str]]) -> str:
    """Text of a file, with the defaults of the template for keywords without a value.

    Args:
      module: name of the file, such as ``"ElastoDyn"``.
      title: second line of the file.
      values: values by keyword; that of ``BldFile`` holds for ``BldFile(1)`` to ``BldFile(3)``.
      tables: lines by name of the table; for a list of outputs only its entries.

    Raises:
      KeyError: the file has no such keyword.
    """
    mark, begin = ("!", "! ") if module == "airfoil" else ("-", "")
    lines = [f"{mark}------ {module.upper()} INPUT FILE for OpenFAST 5, by meltemi ".ljust(80, "-"), begin + title]
    left = set(values)
    for line in template(module):
        if line.startswith("=="):
            lines.append(f"---------------------- {line[2:].strip()} ".ljust(80, "-"))
        elif line == "@outputs":
            lines.append(f"{'':>22}   OutList - channels that are written")
            lines += [f'"{name}"' for name in tables.get("outputs", ())]
            lines.append('END of input file (the word "END" must appear in the first 3 columns of this last line)')
            lines.append("-" * 80)
        elif line == "@channels":
            lines += [*(f'"{name}"' for name in tables["channels"]), "END", "-" * 80]
        elif line.startswith("@") and ":" in line:
            name, _, header = line[1:].partition(":")
            lines += [_line(header.split()), _line(["(-)"] * len(header.split())), *tables.get(name, ())]
        elif line.startswith("@"):
            lines += tables[line[1:]]
        else:
            default, _, name = line.rpartition(" ")
            known = next((n for n in (name, name.partition("(")[0]) if n in values), None)
            left.discard(known or "")
            value = default if known is None else text_of(values[known])
            unit = unit_of(module, name)
            lines.append(f"{value:>22}   {name:<18} {mark}{f' ({unit})' if unit else ''}")
    if left:
        raise KeyError(f"{module}: {sorted(left)}")
    return "\n".join(lines) + "\n"


def by_target(module: str, values: Mapping[str, float | str]) -> dict[str, object]:
    """Convert SI values by target (key path of the reader) to values by keyword in the units of the file."""
    rows = {row.target: row for row in ROWS[module] if row.target}
    values_by_keyword: dict[str, object] = {}
    for target, value in values.items():
        row = rows[target]
        factor = UNITS[row.unit] * (-1.0 if row.turned else 1.0)
        values_by_keyword[row.names[0]] = value / factor + 0.0 if isinstance(value, float) else value
    return values_by_keyword


def text_of(value: object) -> str:
    """A value in Fortran's notation."""
    if isinstance(value, bool):
        return str(value)
    if isinstance(value, str):
        return f'"{value}"'
    return f"{value:.12g}" if isinstance(value, float) else str(value)


def unit_of(module: str, name: str) -> str:
    """Unit of a keyword from the reader's table; empty if unknown."""
    row = row_of(module, key(name)) if module in ROWS else None
    return row.unit if row else ""


def columns(*values: Sequence[float] | Sequence[str] | NDArray[np.float64]) -> list[str]:
    """Lines of a table of numbers or texts."""
    return rows_of(zip(*values, strict=True))


def rows_of(rows: Iterable[Iterable[object]]) -> list[str]:
    """Lines of rows of floats, counts and texts."""
    return [_line([f"{x:.9E}" if isinstance(x, float) else str(x) for x in row]) for row in rows]


def matrix(name: str, value: NDArray[np.float64]) -> list[str]:
    """Lines of a matrix, the first of which ends with the keyword."""
    first, *others = rows_of(value.tolist())
    return [f"{first}   {name}", *others]


def table(names: str, units: str, *values: Sequence[float] | Sequence[str] | NDArray[np.float64]) -> list[str]:
    """Lines of a table under the names and units of its columns, each separated by blanks."""
    return [_line(names.split()), _line([f"({unit})" for unit in units.split()]), *columns(*values)]


def _line(cells: Sequence[str]) -> str:
    return "  ".join(f"{cell:>17}" for cell in cells)
