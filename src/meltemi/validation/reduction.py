"""Statistics of a record, alike for measured and simulated series.

Reference: docs/theory/validation.md (V-12, V-13).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import InputError
from meltemi.postprocess.fatigue import damage_equivalent_load
from meltemi.postprocess.statistics import sector_means
from meltemi.simulation.result import Result
from meltemi.validation.measurements import MeasuredRecord, Signal

Float = NDArray[np.float64]
SLOPES = (4.0, 10.0)
"""S-N slopes of equivalent loads."""
ORDERS = 6
"""Highest multiple of the rotor frequency."""
STATISTICS = (
    "mean",
    "std",
    "min",
    "max",
    *(f"DEL, m = {m:g}" for m in SLOPES),
    *(f"{n}P" for n in range(1, ORDERS + 1)),
)
"""Statistics of a channel; nP: standard deviation of what varies with n times the rotor's angle."""
RANGE_ONLY = STATISTICS[1:2] + STATISTICS[4:]
"""Statistics that do not depend on the zero of a gauge."""
BANDS = np.geomspace(1.0 / 300.0, 5.0, 41)
"""[Hz] edges of the bands of spectra."""
SECTORS = 36
"""Sectors of azimuth averages."""
PER_TURN = 32
"""Samples of a revolution in which multiples of the rotor frequency are separated."""


@dataclass(frozen=True)
class ReducedRecord:
    """What is compared of a record.

    Attributes:
      values: (S,) statistics by channel, in the order of ``STATISTICS``.
      spectra: (B,) [unit^2/Hz] mean density in ``BANDS`` by channel, NaN for a band without a frequency.
      sectors: (36,) azimuth averages by channel; empty without azimuth.
    """

    values: Mapping[str, Float]
    spectra: Mapping[str, Float] = field(repr=False)
    sectors: Mapping[str, Float] = field(repr=False)


def like(result: Result, signals: Mapping[str, Signal], begin: float, transient: float) -> dict[str, Signal]:
    """Simulated series at the times of measured ones, and missing where these are.

    Args:
      result: simulation that reached the end of the record.
      signals: measured series by channel.
      begin: [s] of the record in the time of the signals.
      transient: [s] of the record in the time of the simulation.
    """
    alike = {}
    for name, signal in signals.items():
        x = np.unwrap(result[name]) if name == "azimuth" else result[name]
        x = np.interp(signal.time - begin + transient, result.time, x)
        alike[name] = replace(signal, values=np.where(np.isfinite(signal.values), x, np.nan))
    return alike


def reduce_record(signals: Mapping[str, Signal], names: Sequence[str]) -> ReducedRecord:
    """Statistics, spectra and azimuth averages of channels of a record.

    The rotor's angle is ``azimuth``, or the integral of ``rotor_speed``.

    Raises:
      InputError: a channel has less than two samples.
    """
    angle = _angle(signals)
    values, spectra, sectors = {}, {}, {}
    for name in names:
        signal = signals[name]
        x = signal.finite
        if len(x) < 2:
            raise InputError(f"{name} has no samples")
        duration = len(x) / signal.rate
        loads = [damage_equivalent_load(x, duration=duration, slope=m) for m in SLOPES]
        time, filled = signal.time, np.interp(signal.time, signal.time[np.isfinite(signal.values)], x)
        turned = None if angle is None else np.interp(time, angle.time, angle.values)
        orders = [np.nan] * ORDERS if turned is None else [*_orders(turned, filled)]
        values[name] = np.array([x.mean(), x.std(), x.min(), x.max(), *loads, *orders])
        spectra[name] = _densities(filled, 1.0 / signal.rate)
        if turned is not None and "azimuth" in signals:
            sectors[name] = sector_means(turned, filled, SECTORS)
    return ReducedRecord(values, spectra, sectors)


def reduce_statistics(
    record: MeasuredRecord, names: Sequence[str], step: float
) -> tuple[dict[str, Signal], ReducedRecord]:
    """Of a record of statistics: where simulated series are read, every ``step`` [s] in all of it; and what is known.

    Raises:
      InputError: none of the channels has a statistic.
    """
    time = record.begin + np.arange(0.0, record.length, step)
    known = {name: record.statistics[name] for name in names if record.statistics.get(name)}
    if not known:
        raise InputError("none of the compared channels has a statistic")
    signals = {name: Signal(time, np.zeros(len(time)), 1.0 / step) for name in known}
    values = {name: np.array([of.get(key, np.nan) for key in STATISTICS]) for name, of in known.items()}
    return signals, ReducedRecord(values, {}, {})


def _angle(signals: Mapping[str, Signal]) -> Signal | None:
    """The rotor's angle [rad], increasing."""
    source = signals.get("azimuth", signals.get("rotor_speed"))
    if source is None or len(source.finite) < 2:
        return None
    there = np.isfinite(source.values)
    time, x = source.time[there], source.values[there]
    if "azimuth" in signals:
        return replace(source, time=time, values=np.unwrap(x))
    turned = np.concatenate([[0.0], np.cumsum(0.5 * (x[1:] + x[:-1]) * np.diff(time))])
    return replace(source, time=time, values=turned)


def _orders(turned: Float, x: Float) -> Float:
    """(6,) standard deviation of x within a quarter of each multiple of the rotor frequency (V-13)."""
    turns = int(abs(turned[-1] - turned[0]) / (2.0 * np.pi))
    if turns < 4:
        return np.full(ORDERS, np.nan)
    at = turned[0] + np.sign(turned[-1] - turned[0]) * 2.0 * np.pi * np.arange(turns * PER_TURN) / PER_TURN
    order = np.argsort(turned, kind="stable")
    power = 2.0 * np.abs(np.fft.rfft(np.interp(at, turned[order], x[order]), norm="forward")) ** 2
    bands = np.arange(1, ORDERS + 1)[:, None] + np.array([-0.25, 0.25])
    first, last = (bands * turns).round().astype(int).T
    return np.sqrt([power[a:b].sum() for a, b in zip(first, last + 1, strict=True)])


def _densities(x: Float, step: float) -> Float:
    """(B,) mean density of an even series in the bands."""
    density = 2.0 * step / len(x) * np.abs(np.fft.rfft(x - x.mean()))[1:] ** 2
    band = np.searchsorted(BANDS, np.fft.rfftfreq(len(x), step)[1:], side="right") - 1
    inside = (band >= 0) & (band < len(BANDS) - 1)
    count = np.bincount(band[inside], minlength=len(BANDS) - 1)
    total = np.bincount(band[inside], density[inside], len(BANDS) - 1)
    return np.where(count, total / np.maximum(count, 1), np.nan)
