"""Measurements as records of ten minutes, in SI units.

Nothing is repaired: rows keep their order, a missing sample is NaN, and what is doubtful goes into a list of issues.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import InputError, UnknownNameError, did_you_mean
from meltemi.core.extras import need
from meltemi.postprocess.bins import TEN_MINUTES
from meltemi.validation.channel_map import ChannelMap, Logger, Sensor, TimeStamps
from meltemi.validation.tables_in_files import NUMBER, Columns, columns_of_frame, read_columns_of

Float = NDArray[np.float64]
DATENUM_1970 = 719529.0  # MATLAB's day number of 1970-01-01


def moment(time: float) -> str:
    """A time [s] since 1970 in UTC as text."""
    return datetime.fromtimestamp(round(time, 3), UTC).strftime("%Y-%m-%d %H:%M:%S.%f")[:-3].removesuffix(".000")


@dataclass(frozen=True)
class Signal:
    """Samples of a channel."""

    time: Float = field(repr=False)  # (T,) [s] since 1970, begin of the period of each sample
    values: Float = field(repr=False)  # (T,) SI, NaN where a sample is missing
    rate: float  # [Hz]

    @property
    def finite(self) -> Float:
        """Values that are there."""
        return self.values[np.isfinite(self.values)]


@dataclass(frozen=True)
class MeasuredRecord:
    """Signals of ten minutes, by the names of :meth:`ChannelMap.sensors`."""

    begin: float  # [s] since 1970
    length: float  # [s]
    file: str  # of the first logger, in which it begins
    signals: Mapping[str, Signal] = field(repr=False)

    @property
    def name(self) -> str:
        """File and begin: a file may have several records."""
        return f"{self.file} {moment(self.begin)}"

    def __getitem__(self, name: str) -> Signal:
        if name not in self.signals:
            raise UnknownNameError(f"{self.file}: no channel {name!r}: {did_you_mean(name, self.signals)}")
        return self.signals[name]

    def completeness(self, name: str) -> float:
        """Share of the samples of the period that are there, at most 1."""
        return min(len(self[name].finite) / max(round(self.length * self[name].rate), 1), 1.0)


def joined(records: Sequence[MeasuredRecord], name: str) -> Signal:
    """A channel of all records."""
    signals = [record[name] for record in records]
    time, values = np.concatenate([(signal.time, signal.values) for signal in signals], axis=1)
    return Signal(time, values, signals[0].rate)


def read_measurements(folder: str | Path, channels: ChannelMap) -> list[MeasuredRecord]:
    """Records of the files of all loggers in a folder, or of one file.

    A file of the first logger of five to ten minutes is a record with all its samples. Longer and shorter files are
    cut, or joined, at whole ten minutes (UTC); what has less than half of them is left out.

    Raises:
      InputError: there are no files, a file is damaged, a column is missing or has no numbers or dates.
    """
    folder, files = Path(folder), {}
    if not folder.exists():
        raise InputError(f"{folder}: no such file or folder")
    for key, logger in channels.loggers.items():
        paths = [folder] if folder.is_file() else sorted(path for path in folder.glob(logger.files) if path.is_file())
        if not paths:
            others = ", ".join(sorted(path.name for path in folder.iterdir())[:3])
            raise InputError(f"{folder}: no file {logger.files!r} of logger {key!r}; it has {others or 'no files'}")
        files[key] = {path.name: read_columns_of(path) for path in paths}
    return _records(files, channels)


def measurements_of(frames: Mapping[str, Any], channels: ChannelMap) -> list[MeasuredRecord]:
    """Records, as of files, of data frames of pandas by logger, or of columns by name.

    Raises:
      InputError: a logger or column is missing, or has no numbers or dates.
    """
    files = {}
    for key in channels.loggers:
        if key not in frames:
            raise InputError(f"measurements: no table of logger {key!r}: {did_you_mean(key, frames)}")
        table = frames[key]
        columns = {k: np.asarray(x) for k, x in table.items()} if isinstance(table, dict) else columns_of_frame(table)
        files[key] = {key: columns}
    return _records(files, channels)


class _Rows(NamedTuple):
    """All rows of a logger, as in its files: gaps and duplicates included."""

    time: Float
    values: dict[str, Float]
    rate: float
    files: dict[str, slice]  # rows of each, in the order of their first stamps


def _records(files: Mapping[str, Mapping[str, Columns]], channels: ChannelMap) -> list[MeasuredRecord]:
    """Records of the files by logger."""
    need("reading of measurements", "pandas")
    loggers, records = [], []
    for key, logger in channels.loggers.items():
        sensors = {name: sensor for name, of, sensor in channels.sensors() if of == key}
        loggers.append(_rows(files[key], logger, sensors))
    leader = loggers[0]
    begins = np.floor((leader.time + 0.25 / leader.rate) / TEN_MINUTES) * TEN_MINUTES  # stamps are rounded
    for rows in leader.files.values():
        time = leader.time[rows]
        if len(time) and 0.5 * TEN_MINUTES <= np.ptp(time) + 1.0 / leader.rate <= TEN_MINUTES + 1.5 / leader.rate:
            begins[rows] = time.min()
    for begin in np.unique(begins).tolist():
        chosen = np.flatnonzero(begins == begin)
        if len(chosen) < 0.5 * TEN_MINUTES * leader.rate:
            continue
        end = float(leader.time[chosen].max()) + 1.0 / leader.rate
        signals: dict[str, Signal] = {}
        for time, values, rate, _ in loggers:
            inside = (time >= begin - 0.25 / rate) & (time < end - 0.25 / rate)
            signals |= {name: Signal(time[inside], x[inside], rate) for name, x in values.items()}
        file = next(name for name, rows in leader.files.items() if chosen[0] < rows.stop)
        records.append(MeasuredRecord(begin, TEN_MINUTES, file, signals))
    return records


def _rows(files: Mapping[str, Columns], logger: Logger, sensors: Mapping[str, Sensor]) -> _Rows:
    """All rows of a logger."""
    tables = {file: _table(file, columns, logger, sensors) for file, columns in files.items()}
    steps = {file: step[step > 0.0] for file, (time, _) in tables.items() if np.any((step := np.diff(time)) > 0.0)}
    if not steps:
        raise InputError(f"{next(iter(files))}: the sampling rate cannot be seen from one sample; choose longer files")
    rate = 1.0 / float(np.median(np.concatenate(list(steps.values()))))
    for file, step in steps.items():
        if abs((seen := 1.0 / float(np.median(step))) / rate - 1.0) > 0.01:
            raise InputError(
                f"{file}: its time stamps have {seen:.4g} Hz, other files {rate:g} Hz; put it into a logger of its own"
            )
    order = sorted(files, key=lambda file: tables[file][0][0] if len(tables[file][0]) else np.inf)
    times = [tables[file][0] for file in order]
    if logger.time.stamp == "end":  # of the file for the date in its name, of each sample otherwise
        times = [time - (len(time) if logger.time.name else 1.0) / rate for time in times]
    ends = np.cumsum([len(time) for time in times]).tolist()
    places = {file: slice(end - len(time), end) for file, time, end in zip(order, times, ends, strict=True)}
    values = {name: np.concatenate([tables[file][1][name] for file in order]) for name in sensors}
    return _Rows(np.concatenate(times), values, rate, places)


def _table(
    file: str, columns: Columns, logger: Logger, sensors: Mapping[str, Sensor]
) -> tuple[Float, dict[str, Float]]:
    """Times [s] since 1970, as stamped, and SI values by channel of a file."""
    time, values = _times(file, _column(file, columns, logger.time.column, "the time"), logger.time), {}
    for name, sensor in sensors.items():
        raw = _column(file, columns, sensor.column, name)
        if raw.dtype.kind not in "fiub":
            bad = next((text for text in map(str, raw.tolist()) if not NUMBER.fullmatch(text) and text != "nan"), "")
            raise InputError(f"{file}: column {sensor.column!r} of {name}: expected numbers, found {bad[:40]!r}")
        if len(raw) != len(time):
            raise InputError(
                f"{file}: column {sensor.column!r} has {len(raw)} samples for {len(time)} times; columns of another "
                "rate belong to a logger of their own"
            )
        x = np.where(np.isin(raw, logger.missing) | ~np.isfinite(raw), np.nan, raw)
        values[name] = sensor.sign * (sensor.gain * x + sensor.offset) * sensor.si[1]
    return time, values


def _column(file: str, columns: Columns, name: str, what: str) -> NDArray[Any]:
    """A column by its name, with or without its unit in brackets."""
    short = {re.sub(r"\s*[\[(].*", "", key): key for key in columns}
    if name not in columns and name not in short:
        hint = did_you_mean(name, columns)
        raise InputError(f"{file}: no column {name!r} for {what}: {hint}; correct the channel map")
    return columns[name if name in columns else short[name]]


def _times(file: str, column: NDArray[Any], stamps: TimeStamps) -> Float:
    """[s] since 1970 of a column of dates, texts or numbers."""
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
