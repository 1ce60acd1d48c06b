"""Quantities derived from time series, by the same functions for our results and the reference."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Float = NDArray[np.float64]


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
