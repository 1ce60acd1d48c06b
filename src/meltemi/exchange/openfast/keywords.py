"""Mapping of OpenFAST keywords: one table for all files, ``keywords.csv``.

Its columns: file; names of the keyword (current name first, then older ones); expected value ("?" if the line is
optional or may be "default"); unit in the file; target; values that are equivalent to the model; remark. A target with
a dot is a key path of ``Turbine``, a minus changes the sign (tilt, cone and overhang of an upwind rotor are negative in
OpenFAST); a target without a dot is processed in ``deck.py``; without a target the keyword is not used, for the reason
in the remark. Of equivalent values, ``blade 1`` is that of blade 1, and ``>TMax`` a time after the end of the run.
"""

from __future__ import annotations

import csv
import math
from dataclasses import dataclass
from fnmatch import fnmatchcase
from functools import lru_cache
from pathlib import Path

from meltemi.exchange.openfast.text import key

UNITS = {
    "": 1.0, "m": 1.0, "kg": 1.0, "s": 1.0, "-": 1.0, "N m": 1.0, "N m/rad": 1.0, "N m s/rad": 1.0, "kg m^2": 1.0,
    "m/s": 1.0, "m/s^2": 1.0, "kg/m^3": 1.0, "rad": 1.0, "rad/s": 1.0, "W": 1.0, "N m s^2/rad^2": 1.0,
    "m^3": 1.0, "N m/s": 1.0, "N/m": 1.0, "N s/m": 1.0, "N m/rpm^2": (30.0 / math.pi) ** 2,
    "deg": math.pi / 180.0, "deg/s": math.pi / 180.0, "rpm": math.pi / 30.0, "%": 0.01,
}  # fmt: skip
"""Factor to SI of the units that the table names."""


@dataclass(frozen=True)
class KeywordRow:
    """One row of the table.

    Attributes:
      names: names of the keyword, the current one first; patterns with ``*`` in rows without a target.
      kind: int, float, flag, text, file, list or any.
      optional: the line may be missing or say "default".
      unit: unit in the file.
      target: key path, local name, or empty.
      turned: the sign is reversed.
      same: values equivalent to the behaviour of the model; may be empty.
      remark: explanation for the user.
    """

    names: tuple[str, ...]
    kind: str
    optional: bool
    unit: str
    target: str
    turned: bool
    same: str
    remark: str


def _rows() -> dict[str, tuple[KeywordRow, ...]]:
    table: dict[str, list[KeywordRow]] = {}
    with (Path(__file__).parent / "keywords.csv").open(newline="", encoding="utf-8") as file:
        for row in csv.DictReader(file):
            kind, target = row["kind"], row["target"]
            table.setdefault(row["file"], []).append(
                KeywordRow(
                    tuple(row["keyword"].split()),
                    kind.rstrip("?"),
                    kind.endswith("?"),
                    row["unit"],
                    target.lstrip("-"),
                    target.startswith("-"),
                    row["same"],
                    row["remark"],
                )
            )
    return {module: tuple(rows) for module, rows in table.items()}


ROWS = _rows()


@lru_cache(maxsize=4096)
def row_of(module: str, name: str) -> KeywordRow | None:
    """The row that a keyword of a file belongs to, exact names before patterns."""
    wanted = key(name)
    for row in ROWS[module]:
        if wanted in (key(n) for n in row.names):
            return row
    for row in ROWS[module]:
        if any("*" in n and fnmatchcase(wanted, key(n)) for n in row.names):
            return row
    return None
