"""Statistics of a record, alike for measured and simulated series.

Reference: docs/theory/validation.md (V-12, V-13).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import cumulative_trapezoid

from meltemi.core.errors import InputError
from meltemi.postprocess.fatigue import damage_equivalent_load
from meltemi.postprocess.statistics import sector_means
from meltemi.simulation.result import Result
from meltemi.validation.measurements import Signal

Float = NDArray[np.float64]
SLOPES = (4.0, 10.0)
"""S-N slopes of equivalent loads."""
ORDERS = 6
"""Highest multiple of the rotor frequency."""
STATISTICS = (
    *("mean", "std", "min", "max"),
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
    """What is compared of a record, by channel."""

    values: Mapping[str, Float]  # (S,) statistics, in the order of STATISTICS
    spectra: Mapping[str, Float] = field(repr=False)  # (B,) [unit^2/Hz] mean density in BANDS, NaN without a frequency
    sectors: Mapping[str, Float] = field(repr=False)  # (36,) azimuth averages; without azimuth there are none


def like(result: Result, signals: Mapping[str, Signal], begin: float, transient: float) -> dict[str, Signal]:
    """Simulated series at the times of measured ones, and missing where these are (V-12).

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
        signal, x = signals[name], signals[name].finite
        if len(x) < 2:
            raise InputError(f"{name} has no samples")
        filled = np.interp(signal.time, signal.time[np.isfinite(signal.values)], x)
        loads = [damage_equivalent_load(x, duration=len(x) / signal.rate, slope=m) for m in SLOPES]
        orders = np.full(ORDERS, np.nan)
        if angle is not None:
            turned = np.interp(signal.time, *angle)
            orders = _orders(turned, filled)
            if "azimuth" in signals:
                sectors[name] = sector_means(turned, filled, SECTORS)
        values[name] = np.array([x.mean(), x.std(), x.min(), x.max(), *loads, *orders])
        spectra[name] = _densities(filled, 1.0 / signal.rate)
    return ReducedRecord(values, spectra, sectors)


def _angle(signals: Mapping[str, Signal]) -> tuple[Float, Float] | None:
    """Times and the rotor's angle [rad], without jumps; None if it is not known."""
    source = signals.get("azimuth", signals.get("rotor_speed"))
    if source is None or len(source.finite) < 2:
        return None
    time, x = source.time[np.isfinite(source.values)], source.finite
    return time, np.unwrap(x) if "azimuth" in signals else cumulative_trapezoid(x, time, initial=0.0)


def _orders(turned: Float, x: Float) -> Float:
    """(6,) standard deviation of x within a quarter of each multiple of the rotor frequency (V-13)."""
    way = turned[-1] - turned[0]
    turns = int(abs(way) / (2.0 * np.pi))
    if turns < 4:
        return np.full(ORDERS, np.nan)
    at = turned[0] + np.sign(way) * 2.0 * np.pi * np.arange(turns * PER_TURN) / PER_TURN
    order = np.argsort(turned, kind="stable")
    power = 2.0 * np.abs(np.fft.rfft(np.interp(at, turned[order], x[order]), norm="forward")) ** 2
    edges = turns * (np.arange(1, ORDERS + 1) + np.array([[-0.25], [0.25]]))
    return np.sqrt([power[a : b + 1].sum() for a, b in edges.T.round().astype(int)])


def _densities(x: Float, step: float) -> Float:
    """(B,) mean density of an even series in the bands."""
    frequency = np.fft.rfftfreq(len(x), step)[1:]
    density = 2.0 * step / len(x) * np.abs(np.fft.rfft(x - x.mean()))[1:] ** 2
    inside = frequency < BANDS[-1]
    count, total = (np.histogram(frequency[inside], BANDS, weights=w)[0] for w in (None, density[inside]))
    return np.divide(total, count, out=np.full(len(count), np.nan), where=count > 0)
