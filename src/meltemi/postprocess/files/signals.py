"""Measured signals as comma-separated values: a row of names with units, rows of numbers.

``time [s],generator_speed [rpm],pitch_1 [deg],GenPwr (kW)``: names are those of channels, meltemi's or OpenFAST's.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from meltemi.core.errors import InputError, did_you_mean
from meltemi.core.files import text_of
from meltemi.postprocess.files.openfast import UNITS, Columns, result_of, si_unit
from meltemi.simulation.channels import every_kind, find
from meltemi.simulation.result import Result

LARGEST = 1_000_000_000
"""[bytes]."""
HEAD = re.compile(r"\s*([^\[(]+?)\s*[\[(]([^\])]*)[\])]\s*")
"""A column's name and unit."""


def read_signals(path: str | Path, names: Mapping[str, str] | None = None) -> Result:
    """Read signals from a CSV file, in SI units.

    Args:
      path: of the file; its first column is the time. Empty cells become NaN.
      names: channel by the name of a column, where the file has other names than meltemi's or OpenFAST's.

    Raises:
      InputError: the file is missing or damaged, a unit or a name is unknown.
    """
    path = Path(path)
    rows = [row for row in csv.reader(text_of(path, LARGEST).splitlines()) if any(cell.strip() for cell in row)]
    if len(rows) < 2:
        raise InputError(f"{path}: expected a row of names with units and rows of numbers")
    heads = [HEAD.fullmatch(cell) for cell in rows[0]]
    for cell, head in zip(rows[0], heads, strict=True):
        if head is None:
            raise InputError(f"{path}: column {cell.strip()!r} has no unit; expected, e.g., 'generator_speed [rpm]'")
    found = [(head[1], head[2]) for head in heads if head]
    if found[0][0].lower() != "time" or si_unit(found[0][1]) != ("s", 1.0):
        raise InputError(f"{path}: the first column must be 'time [s]', found {rows[0][0].strip()!r}")
    known = {si for si, _ in UNITS.values()}
    for name, unit in found:
        if si_unit(unit)[0] not in known:
            raise InputError(f"{path}: unknown unit {unit!r} of {name!r}; {did_you_mean(unit, UNITS)}")
    for own, channel in (names or {}).items():
        if own not in (columns := [name for name, _ in found]):
            raise InputError(f"{path}: no column {own!r}: {did_you_mean(own, columns)}")
        find(channel, every_kind())
    known_channels = {name.lower(): c for c in every_kind().values() for name in c.names}
    for own, unit in found[1:]:
        meant = known_channels.get((names or {}).get(own, own).lower())
        if meant is not None and meant.unit != si_unit(unit)[0]:
            raise InputError(
                f"{path}: column {own!r} has the unit {unit}, but {meant.name} is in {meant.display_unit[0]}"
            )
    data = np.empty((len(rows) - 1, len(found)))
    for i, row in enumerate(rows[1:]):
        try:
            data[i] = [float(cell) if cell.strip() else np.nan for cell in row]
        except ValueError:
            raise InputError(f"{path}: row {i + 2}: expected {len(found)} numbers, found {','.join(row)!r}") from None
    named = tuple((names or {}).get(name, name) for name, _ in found[1:])
    return result_of(Columns(named, tuple(unit for _, unit in found[1:]), data[:, 0], data[:, 1:]), path)
