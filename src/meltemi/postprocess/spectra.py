"""Power spectra of time series, and their peaks at rotor harmonics.

Densities are one-sided: their integral over frequency is the variance. They are estimated by Welch's method: segments
under a Hann window, each without its mean or line, overlapping, their periodograms averaged. The window spreads a tone
over four bins (main lobe), so a peak's density depends on the resolution, and is up to 1.4 dB lower where the tone lies
between two frequencies; compare peaks of equal resolution only. The variance about a peak does not depend on them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import log10, nan, pi
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from meltemi.core.errors import InputError
from meltemi.core.shown import Brief
from meltemi.postprocess.inputs import floats, positive, whole
from meltemi.simulation.channels import Channel
from meltemi.simulation.result import Result

Float = NDArray[np.float64]

RESOLUTION = 0.02
"""[Hz] Ten bins from one harmonic to the next of a rotor at 12 r/min, 23 segments in ten minutes."""
OVERLAP = 0.5
"""Fraction by which segments overlap; with a Hann window a larger one adds little."""
FEWEST = 8
"""Values in a segment."""
UNEVEN = 1e-3
"""Largest deviation of a time step from their mean, over that mean; single precision in files makes some."""


@dataclass(frozen=True, repr=False)
class PowerSpectrum(Brief):
    """One-sided power spectral density of a time series.

    Attributes:
      frequency: (F,) [Hz] frequencies from zero to half the sampling rate.
      density: (F,) [unit^2/Hz].
      unit: SI unit of the series; empty if unknown.
      channel: name of the series; empty if unknown.
      resolution: [Hz] distance between frequencies, the inverse of a segment's length.
      bandwidth: [Hz] equivalent noise bandwidth of the window, 1.5 times the resolution for a Hann window.
      segments: number of averaged segments.
      degrees_of_freedom: degrees of freedom of the chi-square distribution of ``density`` over its expectation, for
        noise; lower than twice the number of segments because they overlap.
    """

    frequency: Float
    density: Float
    unit: str
    channel: str
    resolution: float
    bandwidth: float
    segments: int
    degrees_of_freedom: float

    @property
    def density_unit(self) -> str:
        """Unit of the density."""
        return f"({self.unit or '-'})^2/Hz"

    @property
    def variance(self) -> float:
        """Variance: integral of the density over all frequencies."""
        return float(self.density.sum() * self.resolution)

    def interval(self, confidence: float = 0.95) -> tuple[float, float]:
        """Confidence interval of the density of a random signal, as factors on the density.

        Raises:
          InputError: ``confidence`` does not lie between 0 and 1.
        """
        from scipy.stats import chi2

        if not 0.0 < confidence < 1.0:
            raise InputError(f"interval: confidence must lie between 0 and 1, found {confidence!r}")
        n, tail = self.degrees_of_freedom, 0.5 * (1.0 - confidence)
        return float(n / chi2.ppf(1.0 - tail, n)), float(n / chi2.ppf(tail, n))


@dataclass(frozen=True)
class SpectralPeak:
    """The highest spectral density near a frequency.

    Attributes:
      frequency: [Hz] frequency of the peak.
      density: [unit^2/Hz] height of the peak.
      background: [unit^2/Hz] geometric mean of the density between one and two half-widths on both sides; NaN if there
        is none.
      variance: [unit^2] variance within the half-width.
    """

    frequency: float
    density: float
    background: float
    variance: float

    @property
    def decibels(self) -> float:
        """[dB] height above the background."""
        return decibels(self.density, self.background)


def decibels(density: float, against: float) -> float:
    """[dB] ten times the decimal logarithm of a power ratio; -inf for zero, NaN relative to zero."""
    if not against > 0.0 or density != density:
        return nan
    return 10.0 * log10(density / against) if density > 0.0 else -np.inf


def time_step(time: Float, where: str) -> float:
    """[s] time step of a uniform series.

    Raises:
      InputError: there are fewer than two, or their steps differ.
    """
    if len(time) < 2:
        raise InputError(f"{where}: the series has fewer than two values")
    steps = np.diff(time)
    mean = float(time[-1] - time[0]) / len(steps)
    if not mean > 0.0 or np.abs(steps - mean).max() > max(UNEVEN * mean, 4.0 * np.spacing(np.float32(time[-1]))):
        raise InputError(f"{where}: the values are not evenly spaced in time; interpolate them first")
    return mean


def even_series(
    source: Result | ArrayLike, channel: str | None, dt: float | None, where: str
) -> tuple[Float, float, Channel | None]:
    """Values, time step [s] and channel of a result's channel, or of a plain series.

    Args:
      source: a result, with ``channel``, or (T,) values, with ``dt``.
      channel: channel of the result.
      dt: [s] time step of the plain series.
      where: begins the messages.

    Raises:
      InputError: required arguments besides the source are missing, or values are not finite or not evenly spaced.
    """
    recorded: Channel | None = None
    if isinstance(source, Result):
        if channel is None or dt is not None:
            raise InputError(f"{where}: a result requires a channel, and defines the time")
        recorded = source.channel(channel)
        x, step = source[channel], time_step(source.time, where)
    else:
        if dt is None or channel is not None:
            raise InputError(f"{where}: a bare series needs its time step dt > 0, and has no channels")
        positive(dt, f"{where}: dt")
        x, step = floats(source, where), float(dt)
    if x.ndim != 1 or len(x) < 2:
        raise InputError(f"{where}: the series must be a row of at least two values, found shape {x.shape}")
    if not np.all(np.isfinite(x)):
        raise InputError(f"{where}: the series contains values that are not finite")
    return x, step, recorded


def _degrees_of_freedom(window: Float, stride: int, segments: int) -> float:
    """2 K / (1 + 2 sum_k (1 - k/K) r_k^2), r_k the correlation of windows k strides apart (Welch 1967)."""
    power, total = float(window @ window), 1.0
    for k in range(1, min(segments, -(-len(window) // stride))):
        r = float(window[k * stride :] @ window[: len(window) - k * stride]) / power
        total += 2.0 * (1.0 - k / segments) * r * r
    return 2.0 * segments / total


def power_spectrum(
    source: Result | ArrayLike,
    channel: str | None = None,
    *,
    dt: float | None = None,
    resolution: float | None = None,
    segments: int | None = None,
    overlap: float = OVERLAP,
    detrend: Literal["constant", "linear"] = "constant",
) -> PowerSpectrum:
    """One-sided power spectral density of a channel or a series by Welch's method with a Hann window.

    Args:
      source: a result, with ``channel``, or (T,) values, with ``dt``.
      channel: name of the channel.
      dt: [s] between the values of a bare series.
      resolution: [Hz] distance between frequencies, to which the length of segments is chosen, in whole steps; 0.02 Hz
        unless ``segments`` is given.
      segments: instead, the number of segments, which sets their length.
      overlap: overlap of a segment with the next, over its length.
      detrend: part removed from each segment: its mean, or its line.

    Source: Welch, The use of fast Fourier transform for the estimation of power spectra, IEEE Trans. Audio
    Electroacoust. 15 (1967).

    Raises:
      InputError: both ``resolution`` and ``segments`` are given, a segment would be longer than the series or shorter
        than eight values, or values are not finite or not evenly spaced.
    """
    from scipy import signal

    where = "power_spectrum"
    x, step, recorded = even_series(source, channel, dt, where)
    if resolution is not None and segments is not None:
        raise InputError(f"{where}: specify either the resolution or the number of segments")
    if not 0.0 <= overlap < 1.0:
        raise InputError(f"{where}: overlap must be at least 0 and below 1, found {overlap!r}")
    if detrend not in ("constant", "linear"):
        raise InputError(f"{where}: detrend must be 'constant' or 'linear', found {detrend!r}")
    if segments is not None:
        segments = whole(segments, f"{where}: segments")
        # K segments with stride (1 - overlap) L cover L (1 + (K - 1)(1 - overlap))
        length = int(len(x) / (1.0 + (segments - 1) * (1.0 - overlap)))
    else:
        resolution = RESOLUTION if resolution is None else resolution
        positive(resolution, f"{where}: resolution")
        length = round(1.0 / (resolution * step))
        if length > len(x):
            raise InputError(
                f"{where}: a resolution of {resolution:g} Hz needs {1.0 / resolution:g} s, "
                f"the series has {len(x) * step:g} s"
            )
    if length < FEWEST:
        raise InputError(f"{where}: a segment would have {length} values, at least {FEWEST} are needed")
    shared = min(int(overlap * length), length - 1)
    window: Float = signal.get_window("hann", length)
    frequency, density = signal.welch(
        x, fs=1.0 / step, window=window, nperseg=length, noverlap=shared, detrend=detrend, scaling="density"
    )
    number = (len(x) - shared) // (length - shared)
    df = 1.0 / (length * step)
    return PowerSpectrum(
        frequency=frequency,
        density=density,
        unit=recorded.unit if recorded else "",
        channel=recorded.name if recorded else "",
        resolution=df,
        bandwidth=df * length * float(window @ window) / float(window.sum()) ** 2,
        segments=number,
        degrees_of_freedom=_degrees_of_freedom(window, length - shared, number),
    )


def average_spectra(spectra: Sequence[PowerSpectrum]) -> PowerSpectrum:
    """Mean of spectra of equal channel and resolution, such as of several seeds; degrees of freedom are added.

    Segments count as weights, so that runs of different length may be averaged.

    Raises:
      InputError: there are none, or their frequencies, channels or units differ.
    """
    if not spectra:
        raise InputError("average_spectra: no spectra")
    first = spectra[0]
    for other in spectra[1:]:
        same = other.frequency.shape == first.frequency.shape and np.allclose(
            other.frequency, first.frequency, rtol=1e-6, atol=0.0
        )
        if not same or (other.channel, other.unit) != (first.channel, first.unit):
            raise InputError("average_spectra: frequencies, channels and units must be the same")
    weights = np.array([s.segments for s in spectra], dtype=float)
    weights /= weights.sum()
    # of a weighted mean of independent estimates, by its variance
    freedom = 1.0 / float(np.sum(weights**2 / np.array([s.degrees_of_freedom for s in spectra])))
    return PowerSpectrum(
        frequency=first.frequency,
        density=weights @ np.stack([s.density for s in spectra]),
        unit=first.unit,
        channel=first.channel,
        resolution=first.resolution,
        bandwidth=first.bandwidth,
        segments=sum(s.segments for s in spectra),
        degrees_of_freedom=freedom,
    )


def spectral_peak(spectrum: PowerSpectrum, frequency: float, half_width: float) -> SpectralPeak:
    """The highest density within ``half_width`` of a frequency, such as of a multiple of the rotor frequency.

    Args:
      spectrum: where to look.
      frequency: [Hz] middle of the range.
      half_width: [Hz] half width of the range; at least that of the main lobe of the window, twice the resolution.

    Raises:
      InputError: there is no frequency of the spectrum in the range.
    """
    positive(half_width, "spectral_peak: half_width")
    distance = np.abs(spectrum.frequency - frequency)
    rounding = 1e-9 * spectrum.resolution
    near = np.flatnonzero(distance <= half_width + rounding)
    if not len(near):
        raise InputError(f"spectral_peak: the spectrum has no frequency within {half_width:g} Hz of {frequency:g} Hz")
    beside = spectrum.density[(distance > half_width + rounding) & (distance <= 2.0 * half_width + rounding)]
    beside = beside[beside > 0.0]
    place = int(near[np.argmax(spectrum.density[near])])
    return SpectralPeak(
        frequency=float(spectrum.frequency[place]),
        density=float(spectrum.density[place]),
        background=float(np.exp(np.log(beside).mean())) if len(beside) else nan,
        variance=float(spectrum.density[near].sum() * spectrum.resolution),
    )


def rotor_frequency(result: Result) -> float:
    """[Hz] mean rotational frequency of a result, from ``rotor_speed`` or else from ``azimuth``.

    Raises:
      InputError: the result has neither, or is empty.
    """
    if len(result.time) < 2:
        raise InputError("rotor_frequency: the series has fewer than two values")
    duration = float(result.time[-1] - result.time[0])
    if "rotor_speed" not in result and "azimuth" in result:
        turned = np.unwrap(result["azimuth"])
        return float(turned[-1] - turned[0]) / (2.0 * pi * duration)
    return float(np.trapezoid(result["rotor_speed"], result.time)) / (2.0 * pi * duration)
