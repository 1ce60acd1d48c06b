"""Faults of measured series, by stated rules: gaps, duplicates, spikes, stuck sensors, clocks apart.

Reference: docs/theory/validation.md (V-1 to V-3).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations, pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.signal import correlate, correlation_lags

from meltemi.core.errors import InputError
from meltemi.core.units import display
from meltemi.postprocess.ensemble import MeanEstimate, mean_interval
from meltemi.validation.channel_map import Sensor, known_channel
from meltemi.validation.issues import DataIssue
from meltemi.validation.measurements import Float, LoggerSeries, Measurements, Signal

NORMAL = 1.4826  # standard deviation of a normal variable over its median absolute deviation
WINDOW = 10.0  # [s] of the moving median
DEVIATIONS = 8.0  # distance of a spike from the moving median over the standard deviation
LONGEST = 1.0  # [s] above which an excursion is no spike
FLOOR = 0.2  # least deviation of a window over that of the whole series, so that steps of a display are no spikes
JUMP = 0.5  # share of a spike's distance that one sample covers, at its begin and at its end: gusts take longer
STUCK = 30.0  # [s] for which a sensor must not be constant
STUCK_MACHINE = 300.0  # [s] for power and rotor speed, which are displayed in steps and may be steady
PARTS = 8  # of a series, whose lags give the interval of the lag
SMOOTH = 9  # samples over which series are smoothed before they are correlated, so that the peak is a parabola
CORRELATED = 0.5  # correlation of two loggers' records of one channel from which on their lag is known
STRETCH = 4.0 * 3600.0  # [s] of a measurement, from its begin, by which clocks are compared
LONGEST_LAG = 7200.0  # [s] of clocks
HALF_HOUR = 1800.0  # [s] of which errors of time zones are multiples


def inspected(measurements: Measurements) -> Measurements:
    """The measurements with the issues of their time stamps, samples and clocks; the data are unchanged."""
    issues: list[DataIssue] = []
    for series in measurements.loggers:
        issues += _of_stamps(series)
        for name, sensor in measurements.channels.loggers[series.name].channels.items():
            issues += _of_samples(series, name, sensor)
    return measurements.with_issues([*issues, *_of_clocks(measurements)])


def _of_stamps(series: LoggerSeries) -> Iterator[DataIssue]:
    """Gaps, duplicated stamps and rows out of order."""
    step = np.diff(series.time) * series.rate
    for i in np.flatnonzero((step > 1.5) | (step < 0.5)):
        (file, row), lost, seconds = series.place(int(i) + 1), round(float(step[i])) - 1, float(step[i]) / series.rate
        if step[i] > 1.5:
            kind, text = "gap", f"{lost} samples at {series.rate:g} Hz are missing before row {row + 1} of the file"
        elif step[i] >= 0.0:
            kind = "duplicate"
            text = "two rows have one time stamp; remove one of them, or correct rate and zone (end of summer time)"
        else:
            kind, text = "order", f"time goes back by {-seconds:.4g} s; sort the rows, or correct zone and clock"
        yield DataIssue(kind, file, "", float(series.time[i]), max(seconds, 0.0), max(lost, 1), text)


def _of_samples(series: LoggerSeries, name: str, sensor: Sensor) -> Iterator[DataIssue]:
    """Missing samples, spikes and stuck sensors."""
    x, channel, machine = series.values[name], known_channel(name), sensor.kind in ("power", "rpm")
    marked = {"missing": ~np.isfinite(x)}
    longest = STUCK_MACHINE if machine else STUCK
    if sensor.kind != "position" and not (channel and channel.wrap):
        marked["spike"] = spikes(x, series.rate)
        marked["stuck"] = stuck(x, series.rate, longest) & ~(machine & (x == 0.0))
    unit, factor = display(sensor.si[0])
    texts = {
        "missing": "no value; excluded from statistics",
        "spike": f"{{:.4g}} {unit}, more than {DEVIATIONS:g} deviations from the median of {WINDOW:g} s; "
        "look at it, and exclude the record if it is no load",
        "stuck": f"constant for more than {longest:g} s; exclude the record, or give kind: position if it rests",
    }
    for kind, each in marked.items():
        for begin, end in runs(each, series.first):
            text = texts[kind].format(x[(begin + end) // 2] * factor)
            yield series.issue(kind, f"{name} ({sensor.column})", text, begin, end)


def runs(marked: NDArray[np.bool_], breaks: Sequence[int] = ()) -> list[tuple[int, int]]:
    """First row and row after the last one of each run of marked rows; runs end at breaks."""
    edge = np.diff(np.concatenate([[False], marked, [False]]))
    edge[list(breaks)] = True
    return [(begin, end) for begin, end in pairwise(np.flatnonzero(edge).tolist()) if marked[begin]]


def spikes(values: Float, rate: float) -> NDArray[np.bool_]:
    """(T,) samples that are spikes: far from the moving median, and for a short time only (V-1); rate in Hz."""
    import pandas as pd

    marked = np.zeros(len(values), bool)
    if not np.isfinite(values).any():
        return marked
    x, width = pd.Series(values), 2 * round(0.5 * WINDOW * rate) + 1
    distance = (x - x.rolling(width, min_periods=5, center=True).median()).abs()
    least = FLOOR * (x - x.median()).abs().median() + 1e-9 * x.abs().max()
    deviation = NORMAL * distance.rolling(width, min_periods=5, center=True).median().clip(lower=least)
    step = np.nan_to_num(np.abs(np.diff(values, prepend=np.nan, append=np.nan)), nan=np.inf)
    for begin, end in runs((distance > DEVIATIONS * deviation).to_numpy()):
        sharp = min(step[begin], step[end]) >= JUMP * distance[begin:end].max()
        marked[begin:end] = sharp and end - begin <= max(LONGEST * rate, 1.0)
    return marked


def stuck(values: Float, rate: float, longest: float) -> NDArray[np.bool_]:
    """(T,) samples of runs of equal values that last longer than ``longest`` [s] (V-2); rate in Hz."""
    import pandas as pd

    x = pd.Series(values)
    run = (x != x.shift()).cumsum()
    return np.asarray(x.groupby(run).transform("size") > longest * rate)


def clock_lag(reference: Signal, other: Signal, rate: float, longest: float) -> tuple[MeanEstimate, float]:
    """Time [s] by which the stamps of ``other`` are late, with its interval of 95 %, and the correlation (V-3).

    Both are compared at ``rate`` [Hz], with lags of either sign up to ``longest`` [s].

    Raises:
      InputError: the series overlap by less than a minute.
    """
    a, b = (_on_grid(signal, rate) for signal in (reference, other))
    lag, correlation = _lag(a, b, 0.0, longest)
    edges = np.linspace(max(a.time[0], b.time[0] - lag), min(a.time[-1], b.time[-1] - lag), PARTS + 1)
    if edges[-1] - edges[0] < 60.0:
        raise InputError(f"clocks: the series overlap by {edges[-1] - edges[0]:.3g} s; a minute is needed")
    parts = [(a.between(begin, end), b.between(begin + lag, end + lag)) for begin, end in pairwise(edges)]
    lags = [_lag(x, y, lag, 20.0 / rate)[0] for x, y in parts if np.std(x.values) > 0.0 and np.std(y.values) > 0.0]
    return mean_interval(lags), correlation


def _on_grid(signal: Signal, rate: float) -> Signal:
    """Smoothed values at equal times; missing ones are interpolated, here only."""
    order = np.argsort(signal.time, kind="stable")
    order = order[np.isfinite(signal.values[order])]
    if len(order) < 2:
        raise InputError("clocks: a channel of two loggers has no samples")
    t = signal.time[order]
    grid, smooth = np.arange(t[0], t[-1] + 0.5 / rate, 1.0 / rate), np.hanning(SMOOTH + 2)[1:-1]
    values = np.interp(grid, t, signal.values[order])
    return Signal(grid, np.convolve(values, smooth / smooth.sum(), "same"), rate)


def _lag(a: Signal, b: Signal, near: float, within: float) -> tuple[float, float]:
    """[s] lag of the largest correlation, between samples by a parabola, and the correlation."""
    x, y = a.values - a.values.mean(), b.values - b.values.mean()
    pairs = ((x, y), (x * x, np.ones(len(y))), (np.ones(len(x)), y * y), (np.ones(len(x)), np.ones(len(y))))
    product, power_x, power_y, common = (correlate(q, p, method="fft") for p, q in pairs)
    lags = correlation_lags(len(y), len(x)) / a.rate + (b.time[0] - a.time[0])
    allowed = (np.abs(lags - near) <= within + 1e-6) & (common > max(0.25 * min(len(x), len(y)), 5.0))
    power = power_x * power_y
    r = np.where(allowed, product / np.sqrt(np.maximum(power, 1e-12 * power.max())), -np.inf)
    k = int(np.argmax(r))
    left, top, right = np.append(r, -np.inf)[[k - 1, k, k + 1]]
    bend = left - 2.0 * top + right
    part = 0.5 * (left - right) / bend if np.isfinite(bend) and bend < 0.0 else 0.0
    return float(lags[k] + part / a.rate), float(top)


def _of_clocks(measurements: Measurements) -> Iterator[DataIssue]:
    """Lags between the loggers that share a channel."""
    for name in sorted({name for series in measurements.loggers for name in series.values}):
        for one, two in combinations(measurements.having(name), 2):
            rate, begin = min(one.rate, two.rate), float(one.time[0])
            a = one[name].between(begin, begin + STRETCH)
            b = two[name].between(begin - LONGEST_LAG, begin + STRETCH + LONGEST_LAG)
            lag, correlation = clock_lag(a, b, rate, LONGEST_LAG)
            late, zone = abs(lag.mean), abs(lag.mean) % HALF_HOUR
            if correlation < CORRELATED:
                text = f"correlation {correlation:.2f} with {one.name!r}: another quantity, or clocks further apart"
            elif late > max(lag.half_width, 0.5 / rate):
                halves = late > 0.5 * HALF_HOUR and min(zone, HALF_HOUR - zone) < 60.0
                text = (
                    f"logger {two.name!r} is {late:.4g} +/- {lag.half_width:.2g} s "
                    f"{'later' if lag.mean > 0.0 else 'earlier'} than {one.name!r} (correlation {correlation:.2f}); "
                    f"correct its {'zone or stamp' if halves else 'clock'}"
                )
            else:
                continue
            yield DataIssue("clock", two.files[0], name, float(two.time[0]), late, len(two.time), text)
