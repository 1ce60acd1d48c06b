"""Measurements of all loggers in SI units, and their records of ten minutes.

Nothing is repaired: rows keep their order, a missing sample is NaN, and what is wrong is an issue in a list.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import datetime
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import InputError, UnknownNameError, did_you_mean
from meltemi.core.extras import need
from meltemi.core.shown import Brief
from meltemi.postprocess.bins import TEN_MINUTES
from meltemi.validation.channel_map import ChannelMap, Logger, TimeStamps
from meltemi.validation.issues import DataIssue
from meltemi.validation.tables_in_files import NUMBER, Columns, columns_of_frame, read_columns_of

Float = NDArray[np.float64]
DATENUM_1970 = 719529.0  # MATLAB's day number of 1970-01-01


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

    def between(self, begin: float, end: float) -> Signal:
        """Samples from ``begin``, included, to ``end``, excluded [s]; stamps are rounded by a quarter of a sample."""
        late = self.time + 0.25 / self.rate
        inside = (late >= begin) & (late < end)
        return Signal(self.time[inside], self.values[inside], self.rate)


@dataclass(frozen=True)
class LoggerSeries:
    """All rows of a logger."""

    name: str
    rate: float  # [Hz]
    time: Float = field(repr=False)  # (T,) [s] since 1970, as in the files: gaps and duplicates included
    values: Mapping[str, Float] = field(repr=False)  # (T,) SI by channel
    files: tuple[str, ...]
    first: tuple[int, ...]  # rows at which the files begin

    def __getitem__(self, name: str) -> Signal:
        return Signal(self.time, self.values[name], self.rate)

    def place(self, row: int) -> tuple[str, int]:
        """File of a row, and the row in it, counted from 0."""
        i = int(np.searchsorted(self.first, row, side="right")) - 1
        return self.files[i], row - self.first[i]

    def issue(self, kind: str, channel: str, text: str, begin: int = 0, end: int | None = None) -> DataIssue:
        """An issue of some rows, or of all."""
        n = (len(self.time) if end is None else end) - begin
        return DataIssue(kind, self.place(begin)[0], channel, float(self.time[begin]), n / self.rate, n, text)

    def begins(self, length: float) -> Float:
        """(T,) [s] begin of the record to which a row belongs: its file's if that is a record, or a whole multiple."""
        begins = np.floor((self.time + 0.25 / self.rate) / length) * length
        for first, end in pairwise((*self.first, len(self.time))):
            time = self.time[first:end]
            if len(time) and 0.5 * length <= np.ptp(time) + 1.0 / self.rate <= length + 1.5 / self.rate:
                begins[first:end] = time.min()
        return begins


@dataclass(frozen=True)
class MeasuredRecord:
    """Signals of one period, by channel."""

    begin: float  # [s] since 1970
    length: float  # [s]
    file: str  # of the first logger, in which it begins
    signals: Mapping[str, Signal] = field(repr=False)

    def __getitem__(self, name: str) -> Signal:
        if name not in self.signals:
            raise UnknownNameError(f"{self.file}: no channel {name!r}: {did_you_mean(name, self.signals)}")
        return self.signals[name]

    def completeness(self, name: str) -> float:
        """Share of the samples of the period that are there, at most 1."""
        return min(len(self[name].finite) / max(round(self.length * self[name].rate), 1), 1.0)


@dataclass(frozen=True, repr=False)
class Measurements(Brief):
    """Series of all loggers, with what is wrong in them."""

    channels: ChannelMap = field(repr=False)
    loggers: tuple[LoggerSeries, ...]  # in the order of the map
    issues: tuple[DataIssue, ...] = ()

    def having(self, name: str) -> list[LoggerSeries]:
        """Loggers that have a channel."""
        return [series for series in self.loggers if name in series.values]

    def with_issues(self, issues: Sequence[DataIssue]) -> Measurements:
        """The measurements with further issues."""
        return replace(self, issues=(*self.issues, *issues))

    def records(self, length: float = TEN_MINUTES) -> list[MeasuredRecord]:
        """Records of this length [s].

        A file of the first logger of half of this length up to it is a record with all its samples. Longer and shorter
        files are cut, or joined, at whole multiples of the length (UTC); what has less than half of it is left out.
        """
        leader, records = self.loggers[0], []
        begins = leader.begins(length)
        for begin in np.unique(begins).tolist():
            rows = np.flatnonzero(begins == begin)
            if len(rows) >= 0.5 * length * leader.rate:
                end = float(leader.time[rows].max()) + 1.0 / leader.rate
                signals = {name: s[name].between(begin, end) for s in reversed(self.loggers) for name in s.values}
                records.append(MeasuredRecord(begin, length, leader.place(int(rows[0]))[0], signals))
        return records


def read_measurements(folder: str | Path, channels: ChannelMap) -> Measurements:
    """Read the files of all loggers from a folder, or from one file.

    Raises:
      InputError: there are no files, a file is damaged, a column is missing or has no numbers or dates.
    """
    folder = Path(folder)
    if not folder.exists():
        raise InputError(f"{folder}: no such file or folder")
    loggers = []
    for key, logger in channels.loggers.items():
        paths = [folder] if folder.is_file() else sorted(path for path in folder.glob(logger.files) if path.is_file())
        if not paths:
            others = ", ".join(sorted(path.name for path in folder.iterdir())[:3])
            raise InputError(f"{folder}: no file {logger.files!r} of logger {key!r}; it has {others or 'no files'}")
        loggers.append(_series(key, logger, {path.name: read_columns_of(path) for path in paths}))
    return Measurements(channels, tuple(loggers))


def measurements_of(frames: Mapping[str, Any], channels: ChannelMap) -> Measurements:
    """Measurements from data frames of pandas by logger, or from columns by name.

    Raises:
      InputError: a logger or column is missing, or has no numbers or dates.
    """
    loggers = []
    for key, logger in channels.loggers.items():
        if key not in frames:
            raise InputError(f"measurements: no table of logger {key!r}: {did_you_mean(key, frames)}")
        table = frames[key]
        columns = {k: np.asarray(x) for k, x in table.items()} if isinstance(table, dict) else columns_of_frame(table)
        loggers.append(_series(key, logger, {key: columns}))
    return Measurements(channels, tuple(loggers))


def _series(key: str, logger: Logger, files: Mapping[str, Columns]) -> LoggerSeries:
    """All rows of a logger; its files are in the order of their first stamps."""
    need("reading of measurements", "pandas")
    tables = {file: _table(file, columns, logger) for file, columns in files.items()}
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
    times, values = zip(*(tables[file] for file in order), strict=True)
    if logger.time.stamp == "end":  # of the file for the date in its name, of each sample otherwise
        times = tuple(time - (len(time) if logger.time.name else 1.0) / rate for time in times)
    first = np.cumsum([0, *map(len, times)])[:-1].tolist()
    joined = {name: np.concatenate([of_file[name] for of_file in values]) for name in logger.channels}
    return LoggerSeries(key, rate, np.concatenate(times), joined, tuple(order), tuple(first))


def _table(file: str, columns: Columns, logger: Logger) -> tuple[Float, dict[str, Float]]:
    """Times [s] since 1970, as stamped, and SI values by channel of a file."""
    time, values = _times(file, _column(file, columns, logger.time.column, "the time"), logger.time), {}
    for name, sensor in logger.channels.items():
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
