"""Faults of measured series, by stated rules: gaps, duplicates, spikes, stuck sensors, clocks apart.

Reference: docs/theory/validation.md (V-1 to V-3).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter
from scipy.signal import correlate, correlation_lags

from meltemi.core.errors import InputError
from meltemi.validation.channel_map import ChannelMap, Sensor, known_channel
from meltemi.validation.issues import DataIssue, issue_of_all
from meltemi.validation.measurements import Float, MeasuredRecord, Signal, joined, moment

NORMAL = 1.4826  # standard deviation of a normal variable over its median absolute deviation
WINDOW = 10.0  # [s] of the moving median
DEVIATIONS = 8.0  # distance of a spike from the moving median over the standard deviation
LONGEST = 1.0  # [s] above which an excursion is no spike
FLOOR = 0.2  # least deviation of a window over that of the whole series, so that steps of a display are no spikes
JUMP = 0.5  # share of a spike's distance that one sample covers, at its begin and at its end: gusts take longer
STUCK = 30.0  # [s] for which a sensor must not be constant
STUCK_MACHINE = 300.0  # [s] for power and rotor speed, which are displayed in steps and may be steady
CORRELATED = 0.5  # correlation of two loggers' records of one channel from which on their lag is known
COMPARED = 30  # records, from the first, by which clocks are compared
LONGEST_LAG = 7200.0  # [s] of clocks
LATE = 6.0  # [s] below which a lag does not matter for statistics
ROUNDED = 0.01  # share by which numbers of a table of statistics may be rounded
HALF_HOUR = 1800.0  # [s] of which errors of time zones are multiples


def doubtful(records: Sequence[MeasuredRecord], channels: ChannelMap) -> list[DataIssue]:
    """Issues of time stamps, samples and clocks of records; of statistics, whether they can belong together."""
    issues: list[DataIssue] = []
    sensors = list(channels.sensors())
    first = {key: name for name, key, _ in reversed(sensors) if not channels.statistical}  # a channel of each logger
    of_channel = _of_statistics if channels.statistical else _of_samples
    for record in records:
        for key, name in first.items():
            issues += _of_stamps(record, f"logger {key!r}", record[name])
        for name, _, sensor in sensors:
            issues += of_channel(record, name, sensor)
    for name in [name for name, _, _ in sensors if "@" in name and records and first]:
        issues += _of_clocks(records, name)
    return issues


def _of_stamps(record: MeasuredRecord, logger: str, signal: Signal) -> Iterator[DataIssue]:
    """Gaps, duplicated stamps and rows out of order."""
    step = 1.0 / signal.rate
    end = max(record.begin + record.length, np.max(signal.time, initial=0.0) + step)
    time = np.concatenate([[record.begin - step], signal.time, [end]])
    gaps = np.diff(time)
    for i in np.flatnonzero((gaps > 1.5 * step) | (gaps < 0.5 * step)):
        before, seconds = float(time[i]), float(gaps[i])
        lost = max(round(seconds / step) - 1, 1)
        kind, text = "gap", f"{lost} samples at {signal.rate:.4g} Hz are missing after {moment(before)}"
        if seconds < 0.0:
            kind, text = "order", f"time goes back by {-seconds:.4g} s; sort the rows, or correct zone and clock"
        elif seconds < step:
            kind = "duplicate"
            text = "two rows have one time stamp; remove one of them, or correct zone (end of summer time)"
        yield DataIssue(kind, record.file, logger, before, max(seconds, 0.0), lost, text)


def _of_samples(record: MeasuredRecord, name: str, sensor: Sensor) -> Iterator[DataIssue]:
    """Missing samples, spikes and stuck sensors."""
    signal, channel, machine = record[name], known_channel(name.split("@")[0]), sensor.kind in ("power", "rpm")
    x, longest = signal.values, STUCK_MACHINE if machine else STUCK
    marked = {"missing": ~np.isfinite(x)}
    if sensor.kind != "position" and not (channel and channel.wrap):
        marked["spike"] = spikes(x, signal.rate)
        marked["stuck"] = stuck(x, signal.rate, longest) & ~(machine & (x == 0.0))
    texts = {
        "missing": "no value; excluded from statistics",
        "spike": f"{{:.6g}} {sensor.unit}, more than {DEVIATIONS:g} deviations from the median of {WINDOW:g} s; "
        "look at it, and exclude the record if it is no load",
        "stuck": f"constant for more than {longest:g} s; exclude the record, or give kind: position if it rests",
    }
    for kind, each in marked.items():
        for begin, end in runs(each):
            text, n = texts[kind].format(x[(begin + end) // 2] / sensor.si[1]), end - begin
            label = f"{name} ({sensor.label})"
            yield DataIssue(kind, record.file, label, float(signal.time[begin]), n / signal.rate, n, text)


def _of_statistics(record: MeasuredRecord, name: str, sensor: Sensor) -> Iterator[DataIssue]:
    """Statistics that no series has: a mean beyond the extremes, or a deviation that these do not allow."""
    low, mean, high, std = (record.statistics[name].get(key, np.nan) for key in ("min", "mean", "max", "std"))
    text, turns = "", sensor.si[0] == "rad"  # a direction passes north
    if np.isnan(mean):
        yield issue_of_all("missing", [record], name, f"column {sensor.label!r}: no mean; the row is excluded")
    elif not turns and (low > mean or mean > high):
        text = "the mean is not between minimum and maximum"
    elif not turns and (std < 0.0 or std > 0.5 * (1.0 + ROUNDED) * (high - low)):
        text = "the standard deviation is negative, or more than half of maximum less minimum"
    if text:
        text = f"column {sensor.label!r}: {text}; correct the columns of the map"
        yield issue_of_all("statistics", [record], name, text)


def runs(marked: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """First row and row after the last one of each run of marked rows."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], marked, [False]]))).tolist()
    return list(zip(edges[::2], edges[1::2], strict=True))


def spikes(values: Float, rate: float) -> NDArray[np.bool_]:
    """(T,) samples that are spikes: far from the moving median, and for a short time only (V-1); rate in Hz."""
    marked, there = np.zeros(len(values), bool), np.flatnonzero(np.isfinite(values))
    width = min(2 * round(0.5 * WINDOW * rate) + 1, 2 * (len(there) // 4) - 1)
    if width < 5:
        return marked
    x = values[there]
    distance = np.abs(x - median_filter(x, width, mode="mirror"))
    least = FLOOR * NORMAL * np.median(np.abs(x - np.median(x))) + 1e-9 * np.abs(x).max()
    deviation = np.maximum(NORMAL * median_filter(distance, width, mode="mirror"), least)
    step = np.abs(np.diff(x, prepend=np.inf, append=np.inf))  # at both ends any jump may have been
    for begin, end in runs(distance > DEVIATIONS * deviation):
        sharp = min(step[begin], step[end]) >= JUMP * distance[begin:end].max()
        marked[there[begin:end]] = sharp and end - begin <= max(LONGEST * rate, 1.0)
    return marked


def stuck(values: Float, rate: float, longest: float) -> NDArray[np.bool_]:
    """(T,) samples of runs of equal values that last longer than ``longest`` [s] (V-2); rate in Hz."""
    import pandas as pd

    x = pd.Series(values)
    run = (x != x.shift()).cumsum()
    return np.asarray(x.groupby(run).transform("size") > longest * rate)


def clock_lag(reference: Signal, other: Signal, rate: float, longest: float) -> tuple[float, float]:
    """Time [s] by which the stamps of ``other`` are late, to a sample at ``rate`` [Hz], and the correlation (V-3).

    Lags of either sign up to ``longest`` [s] are compared.

    Raises:
      InputError: a signal has no samples, or they overlap by less than a minute.
    """
    (begin, x), (begin_y, y) = (_on_grid(signal, rate) for signal in (reference, other))
    pairs = ((x, y), (x * x, np.ones(len(y))), (np.ones(len(x)), y * y), (np.ones(len(x)), np.ones(len(y))))
    product, power_x, power_y, common = (correlate(b, a, method="fft") for a, b in pairs)
    lags = correlation_lags(len(y), len(x)) / rate + (begin_y - begin)
    allowed = (np.abs(lags) <= longest) & (common > max(0.25 * min(len(x), len(y)), 60.0 * rate - 0.5))
    if not allowed.any():
        raise InputError("the series overlap by less than a minute")
    power = power_x * power_y
    r = np.where(allowed, product / np.sqrt(np.maximum(power, 1e-12 * power.max())), -np.inf)
    return float(lags[np.argmax(r)]), float(r.max())


def _on_grid(signal: Signal, rate: float) -> tuple[float, Float]:
    """Begin [s], and values about their mean at equal times; missing ones are interpolated, here only."""
    there = np.flatnonzero(np.isfinite(signal.values))
    if len(there) < 2:
        raise InputError("one of them has no samples")
    order = there[np.argsort(signal.time[there], kind="stable")]
    t = signal.time[order]
    x = np.interp(np.arange(t[0], t[-1] + 0.5 / rate, 1.0 / rate), t, signal.values[order])
    return float(t[0]), x - x.mean()


def _of_clocks(records: Sequence[MeasuredRecord], name: str) -> Iterator[DataIssue]:
    """The lag of a channel@logger behind the channel."""
    channel, logger = name.split("@")
    a, b = joined(records[:COMPARED], channel), joined(records[:COMPARED], name)
    rate = min(a.rate, b.rate)
    try:
        lag, correlation = clock_lag(a, b, rate, LONGEST_LAG)
    except InputError as error:
        yield issue_of_all("lag", records, name, f"not compared with that of the first logger: {error}")
        return
    late, rest = abs(lag), abs(lag) % HALF_HOUR
    if correlation < CORRELATED:
        text = f"correlation {correlation:.2f} with that of the first logger: another quantity, or clocks further apart"
        yield issue_of_all("clock", records, name, text)
    elif late > 1.5 / rate:
        zone = late > 0.5 * HALF_HOUR and min(rest, HALF_HOUR - rest) < 60.0
        text = (
            f"logger {logger!r} is {late:.4g} s {'later' if lag > 0.0 else 'earlier'} than the first one (correlation "
            f"{correlation:.2f}); correct its {'zone or stamp' if zone else 'clock'}"
        )
        yield issue_of_all("clock" if late > LATE else "lag", records, name, text)
