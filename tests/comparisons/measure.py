"""Quantities derived from time series, by the same functions for our results and the reference."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Float = NDArray[np.float64]


def decay(time: Float, x: Float, begin: float = 10.0) -> tuple[float, float]:
    """Frequency [Hz] and damping ratio of a free decay from its positive peaks after ``begin``."""
    x = x - x[time >= begin].mean()
    inside = np.flatnonzero((x[1:-1] > x[:-2]) & (x[1:-1] >= x[2:]) & (x[1:-1] > 0.0)) + 1
    # parabola through three points
    a, b, c = x[inside - 1], x[inside], x[inside + 1]
    shift = 0.5 * (a - c) / (a - 2.0 * b + c)
    at, peak = time[inside] + shift * (time[1] - time[0]), b - 0.25 * (a - c) * shift
    keep = at >= begin
    at, peak = at[keep], peak[keep]
    # small peaks of other modes between the large ones
    large = peak > 0.5 * np.interp(at, at, np.maximum.accumulate(peak[::-1])[::-1])
    at, peak = at[large], peak[large]
    period = float(np.polyfit(np.arange(len(at)), at, 1)[0])
    rate = -float(np.polyfit(at, np.log(peak), 1)[0])
    omega = np.hypot(2.0 * np.pi / period, rate)
    return 1.0 / period, rate / float(omega)


def harmonic(psi: Float, x: Float) -> tuple[float, float, float]:
    """Mean, amplitude and phase [rad] of the first harmonic x = mean + amplitude cos(psi - phase)."""
    columns = [np.ones_like(psi), *(f(n * psi) for n in (1, 2, 3) for f in (np.cos, np.sin))]
    c = np.linalg.lstsq(np.stack(columns, axis=1), x, rcond=None)[0]
    return float(c[0]), float(np.hypot(c[1], c[2])), float(np.arctan2(c[2], c[1]))


def undershoot(time: Float, x: Float, step_at: float) -> tuple[float, float, float, float]:
    """Value before a step, lowest after it, final value, and seconds from the lowest value until 63.2 % of the
    undershoot are made good (0 without undershoot)."""
    before = float(x[(time > step_at - 1.0) & (time < step_at - 1e-6)].mean())
    final = float(x[-20:].mean())
    late = time >= step_at
    t, y = time[late], x[late]
    i = int(y.argmin())
    lowest = float(y[i])
    if final - lowest < 0.01 * abs(final):
        return before, lowest, final, 0.0
    target = lowest + 0.632 * (final - lowest)
    j = i + int(np.flatnonzero(y[i:] > target)[0])
    reached = t[j - 1] + (target - y[j - 1]) / (y[j] - y[j - 1]) * (t[j] - t[j - 1])
    return before, lowest, final, float(reached - t[i])


def extremes(time: Float, x: Float) -> tuple[float, float, float, float]:
    """Minimum and its time, maximum and its time; of extremes that differ by rounding the first."""
    low, high = x.min(), x.max()
    nearly = 1e-9 * (high - low)
    return (
        float(low),
        float(time[np.argmax(x <= low + nearly)]),
        float(high),
        float(time[np.argmax(x >= high - nearly)]),
    )


def vibration(
    time: Float, blades: Float, band: tuple[float, float], between: tuple[float, float]
) -> tuple[float, float, float]:
    """Frequency [Hz] and damping ratio of a vibration of all blades, negative when it grows, and its last amplitude.

    The amplitude is the root of the sum of squares over the blades: what passes from blade to blade in beats does not
    change it.

    Args:
      time: (T,) [s], in even steps.
      blades: (B, T) deflections.
      band: [Hz] of the vibration.
      between: [s] part for frequency and damping; the amplitude is the mean from 12 to 4 s before the end.
    """
    amplitude, frequency = amplitudes(time, blades, band)
    inside = (time >= between[0] - 1e-6) & (time <= between[1] + 1e-6)
    rate = -float(np.polyfit(time[inside], np.log(amplitude[inside]), 1)[0])
    mean = float(frequency[inside].mean())
    late = (time >= time[-1] - 12.0) & (time <= time[-1] - 4.0)
    return mean, rate / float(np.hypot(2.0 * np.pi * mean, rate)), float(amplitude[late].mean())


def amplitudes(time: Float, blades: Float, band: tuple[float, float]) -> tuple[Float, Float]:
    """Amplitude and frequency [Hz] (T,) of a vibration of all blades from the analytic signals within a band."""
    n, dt = len(time), time[1] - time[0]
    spectrum = np.fft.fft(blades - blades.mean(axis=1, keepdims=True), 4 * n)
    at = np.fft.fftfreq(4 * n, dt)
    spectrum[:, (at < band[0]) | (at > band[1])] = 0.0
    signal = 2.0 * np.fft.ifft(spectrum)[:, :n]
    square = np.abs(signal) ** 2
    rates = np.gradient(np.unwrap(np.angle(signal)), dt, axis=1)
    whole = square.sum(axis=0)
    return np.sqrt(whole), np.sum(square * rates, axis=0) / whole / (2.0 * np.pi)
