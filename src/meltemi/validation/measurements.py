"""Measurements as records of ten minutes, in SI units.

Nothing is repaired: rows keep their order, a missing sample is NaN, and what is doubtful goes into a list of issues.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import InputError, UnknownNameError, did_you_mean
from meltemi.postprocess.bins import TEN_MINUTES
from meltemi.validation.channel_map import ChannelMap, Logger, Sensor, Statistic
from meltemi.validation.tables_in_files import Columns, columns_of_frame, read_tables, table_of

Float = NDArray[np.float64]


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
    statistics: Mapping[str, Mapping[str, float]] = field(default_factory=dict, repr=False)
    """SI by channel, where there are no series; two samples, a deviation below and above the mean, are its signal."""

    @property
    def name(self) -> str:
        """File and begin: a file may have several records."""
        return f"{self.file} {moment(self.begin)}"

    def __getitem__(self, name: str) -> Signal:
        if name not in self.signals:
            raise UnknownNameError(f"{self.file}: no channel {name!r}: {did_you_mean(name, self.signals)}")
        return self.signals[name]

    def completeness(self, name: str) -> float:
        """Share of the samples of ten minutes that are there, at most 1."""
        return min(len(self[name].finite) / max(round(TEN_MINUTES * self[name].rate), 1), 1.0)


def joined(records: Sequence[MeasuredRecord], name: str) -> Signal:
    """A channel of all records."""
    signals = [record[name] for record in records]
    time, values = np.concatenate([(signal.time, signal.values) for signal in signals], axis=1)
    return Signal(time, values, signals[0].rate)


def read_measurements(folder: str | Path, channels: ChannelMap) -> list[MeasuredRecord]:
    """Records of the files of all loggers in a folder, or of one file.

    A file of the first logger of five to ten minutes is a record with all its samples. Longer and shorter files are
    cut, or joined, at whole ten minutes (UTC); what has less than half of them is left out. Each row of ten-minute
    statistics is a record.

    Raises:
      InputError: there are no files, a file is damaged, a column is missing or has no numbers or dates.
    """
    folder = Path(folder)
    if not folder.exists():
        raise InputError(f"{folder}: no such file or folder")
    return _records({key: read_tables(folder, key, logger) for key, logger in channels.loggers.items()}, channels)


def measurements_of(frames: Mapping[str, Any], channels: ChannelMap) -> list[MeasuredRecord]:
    """Records, as of files, of data frames of pandas by logger, or of columns by name.

    Raises:
      InputError: a logger or column is missing, or has no numbers or dates.
    """
    for key in channels.loggers:
        if key not in frames:
            raise InputError(f"measurements: no table of logger {key!r}: {did_you_mean(key, frames)}")
    return _records({key: {key: columns_of_frame(frames[key])} for key in channels.loggers}, channels)


class _Rows(NamedTuple):
    """All rows of a logger, as in its files: gaps and duplicates included."""

    time: Float
    values: dict[tuple[str, Statistic | None], Float]  # SI by channel, and statistic if the rows are statistics
    rate: float
    files: dict[str, slice]  # rows of each, in the order of their first stamps

    def file(self, row: int) -> str:
        """Name of the file that has a row."""
        return next(name for name, rows in self.files.items() if row < rows.stop)


def _records(files: Mapping[str, Mapping[str, Columns]], channels: ChannelMap) -> list[MeasuredRecord]:
    """Records of the files by logger."""
    loggers = [
        _rows(files[key], logger, {name: sensor for name, of, sensor in channels.sensors() if of == key})
        for key, logger in channels.loggers.items()
    ]
    return _of_statistics(loggers, channels) if channels.statistical else _of_series(loggers)


def _of_series(loggers: Sequence[_Rows]) -> list[MeasuredRecord]:
    """Records of the series of all loggers."""
    leader, records = loggers[0], []
    step = 1.0 / leader.rate
    begins = np.floor((leader.time + 0.25 * step) / TEN_MINUTES) * TEN_MINUTES  # stamps are rounded
    lengths = np.full(len(begins), TEN_MINUTES)
    for rows in leader.files.values():
        time = leader.time[rows]
        if len(time) and 0.5 * TEN_MINUTES <= (length := np.ptp(time) + step) <= TEN_MINUTES + 1.5 * step:
            begins[rows], lengths[rows] = time.min(), min(round(length, 3), TEN_MINUTES)
    for begin in np.unique(begins).tolist():
        chosen = np.flatnonzero(begins == begin)
        if len(chosen) < 0.5 * TEN_MINUTES * leader.rate:
            continue
        end = float(leader.time[chosen].max()) + step
        signals: dict[str, Signal] = {}
        for time, values, rate, _ in loggers:
            inside = (time >= begin - 0.25 / rate) & (time < end - 0.25 / rate)
            signals |= {name: Signal(time[inside], x[inside], rate) for (name, _), x in values.items()}
        records.append(MeasuredRecord(begin, float(lengths[chosen[0]]), leader.file(int(chosen[0])), signals))
    return records


def _of_statistics(loggers: Sequence[_Rows], channels: ChannelMap) -> list[MeasuredRecord]:
    """Records of the rows of the first logger, with those of the other ones that begin at the same second."""
    import pandas as pd

    tables = [pd.DataFrame(rows.values, rows.time.round()) for rows in loggers]
    for rows, table in zip(loggers, tables, strict=True):
        if len(twice := table.index[table.index.duplicated()]):
            text = f"two rows begin at {moment(twice[0])}; remove one, or correct zone (summer time)"
            raise InputError(f"{rows.file(0)}: {text}")
    values, records = pd.concat(tables, axis=1).reindex(tables[0].index).to_dict("records"), []
    for row in np.argsort(tables[0].index).tolist():
        begin = float(tables[0].index[row])
        signals, statistics = {}, {name: dict[str, float]() for name, _, _ in channels.sensors()}
        for (name, statistic), value in values[row].items():
            if np.isfinite(value):
                statistics[name][statistic] = value
        for name, _, sensor in channels.sensors():
            mean, std = values[row].get((name, "mean"), np.nan), values[row].get((name, "std"), 0.0)
            samples = np.full(2, mean) if sensor.si[0] == "rad" else np.array([mean - std, mean + std])
            signals[name] = Signal(begin + np.array([0.0, 1.0]), samples, 2.0 / TEN_MINUTES)
        records.append(MeasuredRecord(begin, TEN_MINUTES, loggers[0].file(row), signals, statistics))
    return records


def _rows(files: Mapping[str, Columns], logger: Logger, sensors: Mapping[str, Sensor]) -> _Rows:
    """All rows of a logger."""
    tables = {file: table_of(file, columns, logger, sensors) for file, columns in files.items()}
    order = sorted(files, key=lambda file: tables[file][0][0] if len(tables[file][0]) else np.inf)
    times = [tables[file][0] for file in order]
    rate = 1.0 / TEN_MINUTES if logger.statistical else _rate(dict(zip(order, times, strict=True)))
    if logger.time and logger.time.stamp == "end":  # of the file for the date in its name, of each row otherwise
        whole = logger.time.name and not logger.statistical
        times = [time - (len(time) if whole else 1.0) / rate for time in times]
    ends = np.cumsum([len(time) for time in times]).tolist()
    places = {file: slice(end - len(time), end) for file, time, end in zip(order, times, ends, strict=True)}
    values = {key: np.concatenate([tables[file][1][key] for file in order]) for key in tables[order[0]][1]}
    return _Rows(np.concatenate(times) if logger.time else TEN_MINUTES * np.arange(ends[-1]), values, rate, places)


def _rate(times: Mapping[str, Float]) -> float:
    """[Hz] common sampling rate of the times of files."""
    steps = {file: step[step > 0.0] for file, time in times.items() if np.any((step := np.diff(time)) > 0.0)}
    if not steps:
        raise InputError(f"{next(iter(times))}: the sampling rate cannot be seen from one sample; choose longer files")
    rate = 1.0 / float(np.median(np.concatenate(list(steps.values()))))
    for file, step in steps.items():
        if abs((seen := 1.0 / float(np.median(step))) / rate - 1.0) > 0.01:
            raise InputError(
                f"{file}: its time stamps have {seen:.4g} Hz, other files {rate:g} Hz; put it into a logger of its own"
            )
    return rate
