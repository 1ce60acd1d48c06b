"""Faults of measured series, by stated rules: gaps, duplicates, spikes, stuck sensors, clocks apart.

Reference: docs/theory/validation.md (V-1 to V-3).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import combinations, pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.fft import irfft, next_fast_len, rfft
from scipy.ndimage import median_filter

from meltemi.core.errors import InputError
from meltemi.core.record import Record
from meltemi.core.units import display
from meltemi.postprocess.ensemble import MeanEstimate, mean_interval
from meltemi.validation.channel_map import ChannelMap, known_channel
from meltemi.validation.issues import DataIssue
from meltemi.validation.measurements import LoggerSeries, Measurements, Signal

Float = NDArray[np.float64]

NORMAL = 1.4826
"""Standard deviation of a normal variable over its median absolute deviation."""
PARTS = 8
"""Parts of a series whose lags give the interval of the lag."""
SMOOTH = 9
"""Samples over which series are smoothed before they are correlated, so that the peak is a parabola."""
CORRELATED = 0.5
"""Correlation of two loggers' records of one channel from which on their lag is known."""
STRETCH = 4.0 * 3600.0
"""[s] of a measurement, from its begin, by which clocks are compared."""
HALF_HOUR = 1800.0
"""[s] of which errors of time zones are multiples."""


class QualityRules(Record):
    """Limits of the rules for doubtful samples."""

    spike_window: float = 10.0
    """[s] of the moving median."""
    spike_deviations: float = 8.0
    """Distance from the moving median, over the standard deviation by the moving median absolute deviation."""
    spike_floor: float = 0.2
    """Least standard deviation of this rule over that of the whole series, so that steps of a display do not count."""
    spike_longest: float = 1.0
    """[s] above which an excursion is no spike."""
    spike_jump: float = 0.5
    """Share of the distance that must be covered in one sample, at its begin and at its end: gusts take longer."""
    stuck: float = 30.0
    """[s] for which a sensor must not be constant."""
    stuck_machine: float = 300.0
    """[s] for power and rotor speed, which are displayed in steps and may be steady."""
    longest_lag: float = 7200.0
    """[s] of clocks."""


RULES = QualityRules()


def inspected(measurements: Measurements, rules: QualityRules = RULES) -> Measurements:
    """The measurements with the issues of their time stamps, samples and clocks; the data are unchanged."""
    issues: list[DataIssue] = []
    for series in measurements.loggers:
        issues += _of_stamps(series)
        for name, values in series.values.items():
            sensor = measurements.channels.loggers[series.name].sensors[name]
            label, kind = f"{name} ({sensor.column})", sensor.kind
            issues += _runs(series, label, ~np.isfinite(values), "missing", "no value; excluded from statistics")
            channel = known_channel(name)
            if kind != "position" and not (channel and channel.wrap):
                marked = spikes(values, series.rate, rules)
                issues += _runs(series, label, marked, "spike", _spike_text(values, sensor.si[0], rules))
                machine = kind in ("power", "rpm")
                longest = rules.stuck_machine if machine else rules.stuck
                still = stuck(values, series.rate, longest) & ~(machine & (values == 0.0))
                text = f"constant for more than {longest:g} s; exclude the record, or give kind: position if it rests"
                issues += _runs(series, label, still, "stuck", text)
    return measurements.with_issues([*issues, *_of_clocks(measurements, rules)])


def _runs(
    series: LoggerSeries, label: str, marked: NDArray[np.bool_], kind: str, text: str | Callable[[slice], str]
) -> Iterator[DataIssue]:
    """An issue for each run of marked rows of a file, with a text or that of its rows."""
    edge = np.zeros(len(marked) + 1, bool)
    edge[1:-1] = marked[1:] != marked[:-1]
    edge[list(series.first)] = edge[-1] = True
    bounds = np.flatnonzero(edge)
    for begin, end in pairwise(bounds):
        if marked[begin]:
            n, time = int(end - begin), float(series.time[begin])
            words = text if isinstance(text, str) else text(slice(begin, end))
            yield DataIssue(kind, series.place(int(begin))[0], label, time, n / series.rate, n, words)


def _of_stamps(series: LoggerSeries) -> Iterator[DataIssue]:
    """Gaps, duplicated stamps and rows out of order."""
    step = np.diff(series.time) * series.rate
    for i in np.flatnonzero((step > 1.5) | (step < 0.5)):
        lost = round(float(step[i])) - 1
        (file, row), time = series.place(int(i) + 1), float(series.time[i])
        if step[i] > 1.5:
            text = f"{lost} samples at {series.rate:g} Hz are missing before row {row + 1} of the file"
            yield DataIssue("gap", file, "", time, float(step[i]) / series.rate, lost, text)
        elif step[i] >= 0.0:
            text = "two rows have one time stamp; remove one of them, or correct rate and zone (end of summer time)"
            yield DataIssue("duplicate", file, "", time, 0.0, 1, text)
        else:
            text = f"time goes back by {-step[i] / series.rate:.4g} s; sort the rows, or correct zone and clock"
            yield DataIssue("order", file, "", time, 0.0, 1, text)


def spikes(values: Float, rate: float, rules: QualityRules = RULES) -> NDArray[np.bool_]:
    """(T,) samples that are spikes: far from the moving median, and for a short time only (V-1).

    Args:
      values: (T,) samples, NaN where one is missing.
      rate: [Hz].
      rules: limits.
    """
    there = np.flatnonzero(np.isfinite(values))
    marked = np.zeros(len(values), bool)
    width = min(2 * round(0.5 * rules.spike_window * rate) + 1, 2 * (len(there) // 4) - 1)
    if width < 5:
        return marked
    x = values[there]
    middle = median_filter(x, width, mode="mirror")
    distance = np.abs(x - middle)
    least = rules.spike_floor * NORMAL * float(np.median(np.abs(x - np.median(x))))
    deviation = np.maximum(
        NORMAL * median_filter(distance, width, mode="mirror"), least + 1e-9 * float(np.abs(x).max())
    )
    step = np.abs(np.diff(x, prepend=x[0], append=x[-1]))
    for begin, end in _bounds(distance > rules.spike_deviations * deviation):
        jump = rules.spike_jump * float(distance[begin:end].max())
        sharp = (begin == 0 or step[begin] >= jump) and (end == len(x) or step[end] >= jump)
        if sharp and end - begin <= max(rules.spike_longest * rate, 1.0):
            marked[there[begin:end]] = True
    return marked


def stuck(values: Float, rate: float, longest: float) -> NDArray[np.bool_]:
    """(T,) samples of runs of equal values that last longer than ``longest`` [s] (V-2)."""
    marked = np.zeros(len(values), bool)
    same = np.append(False, values[1:] == values[:-1])
    for begin, end in _bounds(same):
        if (end - begin + 1) / rate > longest:
            marked[begin - 1 : end] = True
    return marked


def _bounds(marked: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """First row and row after the last one of each run."""
    edge = np.flatnonzero(np.diff(np.concatenate([[False], marked, [False]]).astype(int)))
    return [(int(a), int(b)) for a, b in zip(edge[::2], edge[1::2], strict=True)]


def _spike_text(values: Float, si_unit: str, rules: QualityRules) -> Callable[[slice], str]:
    unit, factor = display(si_unit)
    middle = float(np.median(values[np.isfinite(values)])) if np.isfinite(values).any() else 0.0

    def text(rows: slice) -> str:
        worst = max(values[rows], key=lambda x: abs(x - middle))
        return (
            f"{worst * factor:.4g} {unit}, more than {rules.spike_deviations:g} deviations from the "
            f"median of {rules.spike_window:g} s; look at it, and exclude the record if it is no load"
        )

    return text


def clock_lag(reference: Signal, other: Signal, rate: float, longest: float) -> tuple[MeanEstimate, float]:
    """Time [s] by which the stamps of ``other`` are late, with its interval of 95 %, and the correlation (V-3).

    Args:
      reference: a channel by the one logger.
      other: the same quantity by the other one.
      rate: [Hz] of the slower one.
      longest: [s] lag of either sign that is searched.

    Raises:
      InputError: the series overlap by less than a minute.
    """
    a, b = (_on_grid(signal, rate) for signal in (reference, other))
    lag, correlation = _lag(a, b, rate, longest)
    # both on common times, after the lag, in parts
    begin = max(a[0], b[0] - lag)
    n = round((min(a[0] + len(a[1]) / rate, b[0] - lag + len(b[1]) / rate) - begin) * rate)
    if n < 60.0 * rate:
        raise InputError(f"clocks: the series overlap by {n / rate:.3g} s; a minute is needed")
    size, near = n // PARTS, 20.0 / rate
    i, j = round((begin - a[0]) * rate), round((begin + lag - b[0]) * rate)
    rest = (j - i) / rate + b[0] - a[0]
    parts = []
    for k in range(PARTS):
        one, two = a[1][i + k * size : i + (k + 1) * size], b[1][j + k * size : j + (k + 1) * size]
        if min(len(one), len(two)) > 10 and np.std(one) > 0.0 and np.std(two) > 0.0:
            parts.append(rest + _lag((0.0, one), (0.0, two), rate, near)[0])
    return mean_interval(parts), correlation


def _on_grid(signal: Signal, rate: float) -> tuple[float, Float]:
    """Begin [s] and smoothed values at equal times; missing ones are interpolated, here only."""
    order = np.argsort(signal.time, kind="stable")
    order = order[np.isfinite(signal.values[order])]
    t, x = signal.time[order], signal.values[order]
    if len(t) < 2:
        raise InputError("clocks: a channel of two loggers has no samples")
    grid = np.arange(t[0], t[-1] + 0.5 / rate, 1.0 / rate)
    smooth = np.hanning(SMOOTH + 2)[1:-1]
    return float(t[0]), np.convolve(np.interp(grid, t, x), smooth / smooth.sum(), "same")


def _lag(a: tuple[float, Float], b: tuple[float, Float], rate: float, longest: float) -> tuple[float, float]:
    """[s] lag of the largest correlation, between samples by a parabola, and the correlation."""
    (begin, x), (late, y) = a, b
    x, y = x - x.mean(), y - y.mean()
    size = next_fast_len(len(x) + len(y))

    def at_lags(p: Float, q: Float) -> Float:
        return np.asarray(irfft(np.conj(rfft(p, size)) * rfft(q, size), size))

    power = at_lags(x * x, np.ones(len(y))) * at_lags(np.ones(len(x)), y * y)
    common = at_lags(np.ones(len(x)), np.ones(len(y)))
    shift = np.arange(size)
    shift = np.where(shift < len(y), shift, shift - size)  # samples by which y is late in its array
    lags = shift / rate + (late - begin)
    allowed = (np.abs(lags) <= longest + 1e-6) & (common > max(0.25 * min(len(x), len(y)), 5.0))
    r = np.where(allowed, at_lags(x, y) / np.sqrt(np.maximum(power, 1e-12 * power.max())), -np.inf)
    k = int(np.argmax(r))
    left, top, right = r[k - 1], r[k], r[(k + 1) % size]
    bend = left - 2.0 * top + right
    part = 0.5 * (left - right) / bend if np.isfinite(bend) and bend < 0.0 else 0.0
    return float(lags[k] + part / rate), float(top)


def _of_clocks(measurements: Measurements, rules: QualityRules) -> Iterator[DataIssue]:
    """Lags between the loggers that share a channel."""
    for name in shared_channels(measurements.channels):
        for (one, a), (two, b) in combinations(measurements.signals(name), 2):
            rate = min(one.rate, two.rate)
            begin, longest = float(a.time[0]), rules.longest_lag
            stretch = a.between(begin, begin + STRETCH), b.between(begin - longest, begin + STRETCH + longest)
            lag, correlation = clock_lag(*stretch, rate, longest)
            if correlation < CORRELATED:
                text = f"correlation {correlation:.2f} with {one.name!r}: another quantity, or clocks further apart"
            elif abs(lag.mean) > max(lag.half_width, 0.5 / rate):
                halves = round(lag.mean / HALF_HOUR)
                zone = halves and abs(lag.mean - halves * HALF_HOUR) < 60.0
                text = (
                    f"logger {two.name!r} is {abs(lag.mean):.4g} +/- {lag.half_width:.2g} s "
                    f"{'later' if lag.mean > 0.0 else 'earlier'} than {one.name!r} (correlation {correlation:.2f}); "
                    + ("correct its zone or stamp" if zone else "correct its clock")
                )
            else:
                continue
            yield DataIssue("clock", two.files[0], name, float(two.time[0]), abs(lag.mean), len(two.time), text)


def shared_channels(channels: ChannelMap) -> list[str]:
    """Channels that more than one logger has."""
    names = [name for name, _, _ in channels.sensors()]
    return sorted({name for name in names if names.count(name) > 1})
