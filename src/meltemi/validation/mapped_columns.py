"""Times and SI values of the columns of a file, by the channel map."""

from __future__ import annotations

import re
from collections.abc import Mapping
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import InputError, did_you_mean
from meltemi.validation.channel_map import Logger, Sensor, Statistic, TimeStamps
from meltemi.validation.tables_in_files import NUMBER, Columns, read_columns_of

Float = NDArray[np.float64]
DATENUM_1970 = 719529.0  # MATLAB's day number of 1970-01-01


def table_of(
    file: str, columns: Columns, logger: Logger, sensors: Mapping[str, Sensor]
) -> tuple[Float, dict[tuple[str, Statistic | None], Float]]:
    """Times [s] since 1970, as stamped, and SI values by channel, and by statistic if the logger has statistics."""
    values = {}
    for name, sensor in sensors.items():
        for statistic, label in logger.columns_of(sensor).items():
            raw = _column(file, columns, label, name)
            if raw.dtype.kind not in "fiub":
                bad = next((text for text in map(str, raw) if not NUMBER.fullmatch(text) and text != "nan"), "")
                raise InputError(f"{file}: column {label!r} of {name}: expected numbers, found {bad[:40]!r}")
            x = np.where(np.isin(raw, logger.missing) | ~np.isfinite(raw), np.nan, raw)
            values[name, statistic] = sensor.in_si(x, statistic), label
    first = next(iter(values.values()))[0]
    time = _times(file, columns, logger.time) if logger.time else np.arange(len(first), dtype=float)
    for x, label in values.values():
        if len(x) != len(time):
            raise InputError(
                f"{file}: column {label!r} has {len(x)} samples for {len(time)} times; columns of another rate belong "
                "to a logger of their own"
            )
    return time, {key: x for key, (x, _) in values.items()}


def columns_of_statistics(folder: Path, files: Mapping[Statistic, str]) -> Columns:
    """Columns of a file for each statistic, as ``mean/P``, and those of the first one by their names, for its times."""
    tables = {statistic: read_columns_of(folder / name) for statistic, name in files.items()}
    prefixed = {f"{statistic}/{name}": x for statistic, table in tables.items() for name, x in table.items()}
    return {**next(iter(tables.values())), **prefixed}


def _column(file: str, columns: Columns, name: str, what: str) -> NDArray[Any]:
    """A column by its name, with or without its unit in brackets."""
    short = {re.sub(r"\s*[\[(].*", "", key): key for key in columns}
    if name not in columns and name not in short:
        hint = did_you_mean(name, columns)
        raise InputError(f"{file}: no column {name!r} for {what}: {hint}; correct the channel map")
    return columns[name if name in columns else short[name]]


def _times(file: str, columns: Columns, stamps: TimeStamps) -> Float:
    """[s] since 1970 of a column of dates, texts or numbers."""
    column = _column(file, columns, stamps.column, "the time")
    numbers = column.dtype.kind in "fiu"
    if numbers and stamps.form == "iso":
        raise InputError(
            f"{file}: column {stamps.column!r}: expected dates such as 2024-05-01 12:00:00, found numbers; give "
            "time.form: posix, matlab or seconds"
        )
    try:
        dates = [] if numbers else [stamps.posix(datetime.fromisoformat(str(each))) for each in column]
        begin = stamps.posix(datetime.strptime(Path(file).name, stamps.name)) if stamps.name else 0.0
    except ValueError as error:
        raise InputError(f"{file}: no date in column {stamps.column!r}, or in the name: {error}") from None
    time = column.astype(float) if numbers else np.array(dates)
    if not np.all(np.isfinite(time)):
        row = int(np.argmin(np.isfinite(time)))
        raise InputError(f"{file}: column {stamps.column!r}: row {row + 1} of the numbers has no time; remove the row")
    return (time - DATENUM_1970) * 86400.0 if stamps.form == "matlab" and numbers else time + begin
