"""Measured signals, and results for other programs, as comma-separated values.

``time [s],generator_speed [rpm],pitch_1 [deg],GenPwr [kW]``: names are those of channels, meltemi's or OpenFAST's.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from meltemi.core.csvfile import read_columns, write_columns
from meltemi.core.errors import InputError, did_you_mean
from meltemi.postprocess.files.openfast import UNITS, OutputColumns, result_of, si_unit
from meltemi.simulation.channels import every_kind, find
from meltemi.simulation.result import Result


def read_signals(path: str | Path, names: Mapping[str, str] | None = None) -> Result:
    """Read signals from a CSV file, in SI units.

    Args:
      path: path of the file; its first column is the time. Empty cells become NaN.
      names: channel by the name of a column, where the file has other names than meltemi's or OpenFAST's.

    Raises:
      InputError: the file is missing or damaged, a unit or a name is unknown.
    """
    path = Path(path)
    head, data = read_columns(path)
    known = {si for si, _ in UNITS.values()}
    for name, unit in head:
        if si_unit(unit)[0] not in known:
            raise InputError(f"{path}: unknown unit {unit!r} of {name!r}; {did_you_mean(unit, UNITS)}")
    for column, channel in (names or {}).items():
        if column not in (columns := [name for name, _ in head]):
            raise InputError(f"{path}: no column {column!r}: {did_you_mean(column, columns)}")
        find(channel, every_kind())
    known_channels = {name.lower(): c for c in every_kind().values() for name in c.names}
    for column, unit in head[1:]:
        match = known_channels.get((names or {}).get(column, column).lower())
        if match is not None and match.unit != si_unit(unit)[0]:
            raise InputError(
                f"{path}: column {column!r} has the unit {unit}, but {match.name} is in {match.display_unit[0]}"
            )
    named = tuple((names or {}).get(name, name) for name, _ in head[1:])
    return result_of(OutputColumns(named, tuple(unit for _, unit in head[1:]), data[:, 0], data[:, 1:]), path)


def write_signals(result: Result, path: str | Path) -> Path:
    """Write the series of a result as a CSV file, in SI units.

    Raises:
      InputError: the file cannot be written.
    """
    heads = [("time", "s"), *((channel.name, channel.unit) for channel in result.channels)]
    return write_columns(Path(path), heads, np.column_stack([result.time, result.data]))
