"""Measurements of all loggers on one time axis, in SI units, and their records of ten minutes.

Nothing is repaired: rows keep their order, a missing sample is NaN, and what is wrong is an issue in a list.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import InputError, UnknownNameError, did_you_mean
from meltemi.core.shown import Brief
from meltemi.postprocess.bins import TEN_MINUTES
from meltemi.validation.channel_map import ChannelMap, Logger, Sensor, TimeStamps
from meltemi.validation.issues import DataIssue
from meltemi.validation.tables_in_files import Columns, columns_of_frame, read_columns_of

Float = NDArray[np.float64]
DATENUM_1970 = 719529.0
"""MATLAB's day number of 1970-01-01."""
DAY = 86400.0
"""[s]."""


@dataclass(frozen=True)
class Signal:
    """Samples of a channel.

    Attributes:
      time: (T,) [s] since 1970, begin of the period of each sample.
      values: (T,) SI, NaN where a sample is missing.
    """

    time: Float = field(repr=False)
    values: Float = field(repr=False)

    @property
    def finite(self) -> Float:
        """Values that are there."""
        return self.values[np.isfinite(self.values)]

    @property
    def missing(self) -> int:
        """Number of samples without a value."""
        return int(np.sum(~np.isfinite(self.values)))

    def statistics(self) -> dict[str, float]:
        """Mean, standard deviation (divided by n), minimum and maximum of the samples that are there, SI."""
        x = self.finite
        return {of: float(getattr(x, of)()) if len(x) else np.nan for of in ("mean", "std", "min", "max")}

    def between(self, begin: float, end: float) -> Signal:
        """Samples from ``begin``, included, to ``end``, excluded [s]."""
        inside = (self.time >= begin) & (self.time < end)
        return Signal(self.time[inside], self.values[inside])


@dataclass(frozen=True)
class LoggerSeries:
    """All rows of a logger.

    Attributes:
      name: of the logger.
      rate: [Hz].
      time: (T,) [s] since 1970, as in the files: gaps and duplicates included.
      values: (T,) SI by channel.
      files: names of its files.
      first: rows at which they begin.
    """

    name: str
    rate: float
    time: Float = field(repr=False)
    values: Mapping[str, Float] = field(repr=False)
    files: tuple[str, ...]
    first: tuple[int, ...]

    def place(self, row: int) -> tuple[str, int]:
        """File of a row, and the row in it, counted from 0."""
        i = int(np.searchsorted(self.first, row, side="right")) - 1
        return self.files[i], row - self.first[i]

    def spans(self, length: float) -> Iterator[tuple[str, float, float, bool]]:
        """Files that are a record of ``length`` [s], and runs of others: name, begin, end [s], whether it is one."""
        run: tuple[str, float, float, bool] | None = None
        for name, first, last in zip(self.files, self.first, (*self.first[1:], len(self.time)), strict=True):
            if first == last:
                continue
            begin, end = float(np.min(self.time[first:last])), float(np.max(self.time[first:last])) + 1.0 / self.rate
            whole = 0.5 * length <= end - begin <= length + 1.5 / self.rate
            if run and not whole and not run[3] and begin - run[2] < 0.6 / self.rate:
                run = run[0], run[1], end, False
            else:
                yield from [run] if run else []
                run = name, begin, end, whole
        yield from [run] if run else []


@dataclass(frozen=True)
class MeasuredRecord:
    """Signals of one period.

    Attributes:
      begin, length: [s] since 1970 and duration.
      file: name of the file of the first logger, or of the first one of a run.
      signals: by channel.
      rates: [Hz] by channel.
    """

    begin: float
    length: float
    file: str
    signals: Mapping[str, Signal] = field(repr=False)
    rates: Mapping[str, float] = field(repr=False)

    def __getitem__(self, name: str) -> Signal:
        if name not in self.signals:
            raise UnknownNameError(f"{self.file}: no channel {name!r}: {did_you_mean(name, self.signals)}")
        return self.signals[name]

    def completeness(self, name: str) -> float:
        """Share of the samples of the period that are there, at most 1."""
        return min(len(self[name].finite) / max(round(self.length * self.rates[name]), 1), 1.0)


@dataclass(frozen=True, repr=False)
class Measurements(Brief):
    """Series of all loggers, with what is wrong in them.

    Attributes:
      channels: the channel map.
      loggers: in the order of the map.
      issues: see :mod:`meltemi.validation.issues`.
    """

    channels: ChannelMap = field(repr=False)
    loggers: tuple[LoggerSeries, ...]
    issues: tuple[DataIssue, ...] = ()

    def signals(self, name: str) -> list[tuple[LoggerSeries, Signal]]:
        """A channel of all loggers that have it.

        Raises:
          UnknownNameError: no logger has it.
        """
        present = [(s, Signal(s.time, s.values[name])) for s in self.loggers if name in s.values]
        if not present:
            names = {known for s in self.loggers for known in s.values}
            raise UnknownNameError(f"no channel {name!r} in the measurements: {did_you_mean(name, names)}")
        return present

    def with_issues(self, issues: Sequence[DataIssue]) -> Self:
        """The measurements with further issues."""
        return type(self)(self.channels, self.loggers, (*self.issues, *issues))

    def records(self, length: float = TEN_MINUTES) -> list[MeasuredRecord]:
        """Records of this length [s].

        A file of the first logger of half of this length up to it is a record with all its samples. Longer files, and
        shorter ones that follow each other, are cut at whole multiples of the length (UTC); pieces of less than half of
        it are left out.
        """
        records = []
        for name, begin, end, whole in self.loggers[0].spans(length):
            edges = np.arange(np.floor(begin / length + 1e-9), np.ceil(end / length)) * length
            for low, high in [(begin, end)] if whole else [(float(edge), float(edge) + length) for edge in edges]:
                if min(high, end) - max(low, begin) >= 0.5 * length:
                    records.append(self._record(low, high, length, name))
        return records

    def _record(self, begin: float, end: float, length: float, file: str) -> MeasuredRecord:
        signals: dict[str, Signal] = {}
        rates: dict[str, float] = {}
        for series in self.loggers:
            edge = 0.25 / series.rate  # stamps are rounded
            for name, values in series.values.items():
                if name not in signals:
                    signals[name] = Signal(series.time, values).between(begin - edge, end - edge)
                    rates[name] = series.rate
        return MeasuredRecord(begin, length, file, signals, rates)


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
            others = sorted(path.name for path in folder.iterdir())[:3]
            raise InputError(
                f"{folder}: no file {logger.files!r} of logger {key!r}; it has {', '.join(others) or 'no files'}"
            )
        loggers.append(_series(key, logger, [(path.name, read_columns_of(path)) for path in paths]))
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
        loggers.append(_series(key, logger, [(key, columns)]))
    return Measurements(channels, tuple(loggers))


def _series(key: str, logger: Logger, tables: Sequence[tuple[str, Columns]]) -> LoggerSeries:
    """All rows of a logger; its files are in the order of their first stamps."""
    parts, sensors = [], logger.sensors
    for file, columns in tables:
        values = {name: _values(file, columns, name, s, logger) for name, s in sensors.items()}
        lengths = {name: len(x) for name, x in values.items()}
        n = next(iter(lengths.values()), 0)
        for name, length in lengths.items():
            if length != n:
                raise InputError(
                    f"{file}: column {sensors[name].column!r} has {length} samples, the first one has {n}; "
                    "columns of another rate belong to a logger of their own"
                )
        parts.append((file, *_times(file, columns, logger, n), values))
    rates = [rate for _, _, rate, _ in parts if np.isfinite(rate)]
    if not rates:
        raise InputError(
            f"{parts[0][0]}: the sampling rate cannot be seen from one sample; give the rate of the logger"
        )
    rate = float(np.median(rates))
    if different := [f"{file} has {r:g} Hz" for file, _, r, _ in parts if abs(r / rate - 1.0) > 0.01]:
        raise InputError(
            f"logger {key!r}: {different[0]}, other files {rate:g} Hz; put them into a logger of their own"
        )
    parts.sort(key=lambda part: float(part[1][0]) if len(part[1]) else np.inf)
    first = np.concatenate([[0], np.cumsum([len(part[1]) for part in parts])[:-1]]).astype(int)
    joined = {name: np.concatenate([part[3][name] for part in parts]) for name in sensors}
    time = np.concatenate([part[1] for part in parts])
    return LoggerSeries(key, rate, time, joined, tuple(part[0] for part in parts), tuple(int(i) for i in first))


def _column(file: str, columns: Columns, name: str, what: str) -> NDArray[Any]:
    """A column by its name, with or without its unit in brackets."""
    short = {re.sub(r"\s*[\[(].*", "", key): key for key in columns}
    if name not in columns and name not in short:
        raise InputError(
            f"{file}: no column {name!r} for {what}: {did_you_mean(name, columns)}; correct the channel map"
        )
    return columns[name if name in columns else short[name]]


def _values(file: str, columns: Columns, name: str, sensor: Sensor, logger: Logger) -> Float:
    raw = _column(file, columns, sensor.column, name)
    if raw.dtype.kind not in "fiub":
        raise InputError(f"{file}: column {sensor.column!r} of {name}: expected numbers, found {str(raw[:1])[1:-1]}")
    x = raw.astype(float)
    x = np.where(np.isin(x, logger.missing) | ~np.isfinite(x), np.nan, x)
    return np.asarray(sensor.sign * (sensor.gain * x + sensor.offset) * sensor.si[1])


def _times(file: str, columns: Columns, logger: Logger, n: int) -> tuple[Float, float]:
    """[s] since 1970 of the begin of each sample, and the sampling rate [Hz]."""
    stamps = logger.time
    column = None if stamps.column is None else _column(file, columns, stamps.column, "the time")
    time = np.arange(n) / (logger.rate or 1.0) if column is None else _numbers(file, column, stamps)
    if not np.all(np.isfinite(time)):
        row = int(np.flatnonzero(~np.isfinite(time))[0])
        raise InputError(f"{file}: column {stamps.column!r}: row {row + 1} of the numbers has no time; remove the row")
    if len(time) != n:
        raise InputError(f"{file}: column {stamps.column!r} has {len(time)} times, the channels have {n} samples")
    steps = np.diff(time)
    seen = 1.0 / float(np.median(steps[steps > 0.0])) if np.any(steps > 0.0) else np.nan
    rate = logger.rate or seen
    if abs(seen / rate - 1.0) > 0.01:
        raise InputError(f"{file}: its time stamps have {seen:.4g} Hz, the channel map {rate:g} Hz; correct the rate")
    in_name = 0.0
    if stamps.name is not None:
        try:
            in_name = stamps.posix(datetime.strptime(Path(file).name, stamps.name))
        except ValueError:
            raise InputError(f"{file}: its name has no date of the form {stamps.name!r}; correct time.name") from None
    ended = 0.0
    if stamps.stamp == "end":  # of the file for the date in its name, of each sample otherwise
        ended = n / rate if stamps.name is not None else 1.0 / rate
    return time + in_name - ended, rate


def _numbers(file: str, column: NDArray[Any], stamps: TimeStamps) -> Float:
    if column.dtype.kind == "M":
        return np.array([stamps.posix(each) for each in column.astype("M8[us]").tolist()])
    if column.dtype.kind in "UOS":
        try:
            return np.array([stamps.posix(datetime.fromisoformat(str(each))) for each in column.tolist()])
        except ValueError as error:
            raise InputError(
                f"{file}: column {stamps.column!r}: not a date of ISO 8601 ({error}); see time.form"
            ) from None
    if stamps.form == "iso":
        raise InputError(
            f"{file}: column {stamps.column!r}: expected dates such as 2024-05-01 12:00:00, found numbers; give "
            "time.form: posix, matlab or seconds"
        )
    time = column.astype(float)
    return (time - DATENUM_1970) * DAY if stamps.form == "matlab" else time
