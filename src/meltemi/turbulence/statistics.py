"""Wind statistics: moments, scales, spectra and coherence of a field, range of a uniform series.

A field is evaluated in the axes of its box: u along the direction of the box, v to the left looking downwind, w
upwards. With veer the mean wind of a row deviates from u; it then has a mean v, and the deviations of that row are
still those along and across the box, not along and across the mean wind of the row.

Series of files need not be periodic. Their periodograms are taken without a taper, so that they hold the variance of
the series exactly: the jump between end and begin leaks like f^-2, below 1 % of a -5/3 spectrum after ten minutes.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from meltemi.core.errors import InputError, did_you_mean
from meltemi.wind.fields import SteadyWind, WindBox, WindSeries
from meltemi.wind.velocity import WindNow

Float = NDArray[np.float64]
Complex = NDArray[np.complex128]
Component = Literal["u", "v", "w"]

COMPONENTS: tuple[Component, Component, Component] = ("u", "v", "w")
VALUES_AT_ONCE = 200_000
"""Number of values of a field that are in double precision at a time."""
POINTS_FOR_SCALES = 100
"""Points of the grid, evenly chosen, whose autocorrelations are averaged."""
CALM = 1e-6
"""Standard deviation over the speed below which a component is constant except for rounding."""
ROUNDING = 1e-3
"""[m] rounding of heights in files."""
PER_DECADE = 12
"""Frequency bands."""


@dataclass(frozen=True)
class FieldStatistics:
    """Moments and scales of a turbulent field, components in the order u, v, w of the box.

    Attributes:
      row, column: indices of the point nearest to the hub.
      height: [m] height of that point.
      speed: [m/s] magnitude of the mean horizontal velocity at the hub.
      direction: [rad] wind direction of that velocity, clockwise from above, including the direction of the box.
      mean, std, lowest, highest: (Z, Y, 3) [m/s] statistics of each point over time.
      covariance: (3, 3) [m^2/s^2] at the hub.
      hub_time_scale, grid_time_scale: (3,) [s] integral of the autocorrelation up to its first zero, at the hub and of
        the autocorrelation averaged over the grid; NaN for a component that is constant.
      travel: [m/s] convection speed of the field.
    """

    row: int
    column: int
    height: float
    speed: float
    direction: float
    mean: Float
    std: Float
    lowest: Float
    highest: Float
    covariance: Float
    hub_time_scale: Float
    grid_time_scale: Float
    travel: float

    @property
    def intensity(self) -> Float:
        """(Z, Y, 3) [-] standard deviation over the mean horizontal speed at the hub."""
        return self.std / self.speed if self.speed > 0.0 else np.full_like(self.std, np.nan)

    @property
    def hub_length_scale(self) -> Float:
        """(3,) [m] time scale times the convection speed."""
        return self.hub_time_scale * self.travel

    @property
    def grid_length_scale(self) -> Float:
        """(3,) [m] length scale of the whole grid: time scale times the convection speed."""
        return self.grid_time_scale * self.travel


@dataclass(frozen=True)
class SeriesStatistics:
    """Range and moments of a wind that is uniform over the rotor except for shear.

    Attributes:
      names: columns; those of a series, after ``hub_speed``, which is speed and gust together.
      mean, std, lowest, highest: (columns,) in m/s, rad or none, each instant counting for as long as it lasts.
      duration: [s] duration of the series.
    """

    names: tuple[str, ...]
    mean: Float
    std: Float
    lowest: Float
    highest: Float
    duration: float

    @property
    def direction_range(self) -> float:
        """Angle [rad] between the extreme directions."""
        i = self.names.index("direction")
        return float(self.highest[i] - self.lowest[i])


@dataclass(frozen=True)
class SpectrumEstimate:
    """Estimate of a one-sided spectral density.

    Attributes:
      f: (B,) [Hz] geometric middle of each band.
      density: (B,) [m^2/s^2/Hz] one-sided density.
      count: (B,) periodogram values that were averaged. At one point they are independent, so the standard error is
        density / sqrt(count); over a grid they are not where eddies are as large as the grid, and the error is larger.
    """

    f: Float
    density: Float
    count: NDArray[np.int64]


@dataclass(frozen=True)
class CoherenceEstimate:
    """Estimate of the co-coherence: real part of the cross-spectrum over the auto-spectra.

    Attributes:
      separation: (S,) [m] multiples of the grid's step.
      f: (B,) [Hz] geometric middle of each band.
      coherence: (S, B) [-] co-coherence between -1 and 1.
      count: (S, B) products that were averaged: frequencies times pairs of points.
    """

    separation: Float
    f: Float
    coherence: Float
    count: NDArray[np.int64]


def hub_point(box: WindBox, hub_height: float | None = None) -> tuple[int, int]:
    """Row and column nearest to the hub.

    Args:
      box: a field.
      hub_height: [m]; that of the box by default, or its middle if it has none.

    Raises:
      InputError: the hub lies above or below the box.
    """
    if hub_height is None:
        hub_height = box.hub_height if box.hub_height is not None else 0.5 * (box.bottom + box.top)
    if not box.bottom - ROUNDING <= hub_height <= box.top + ROUNDING:
        raise InputError(
            f"{box.label}: a hub height of {hub_height:g} m lies outside the field, which reaches from {box.bottom:g} m"
            f" to {box.top:g} m"
        )
    row = min(max(round((hub_height - box.bottom) / box.dz), 0), box.velocity.shape[1] - 1)
    return row, box.velocity.shape[2] // 2


def field_statistics(box: WindBox, hub_height: float | None = None) -> FieldStatistics:
    """Mean, standard deviation, extremes and integral scales of a field, at the hub and over the grid.

    The integral time scale is the autocorrelation integrated up to its first zero; the length scale is that times the
    speed of the box (Taylor). A sample's own mean is taken off first, so both are too small where the sample is not
    much longer than the scale. Over the grid it is that of the average autocorrelation of up to about 100 points.

    Args:
      box: a field.
      hub_height: [m]; that of the box by default, or its middle if it has none.

    Raises:
      InputError: the hub lies outside the field.
    """
    row, column = hub_point(box, hub_height)
    mean, std, lowest, highest = _moments(box)
    hub = box.velocity[:, row, column].astype(np.float64) - mean[row, column]
    u, v = mean[row, column, :2]
    _, rows, columns, _ = box.velocity.shape
    step = max(math.ceil(math.sqrt(rows * columns / POINTS_FOR_SCALES)), 1)
    several = box.velocity[:, row % step :: step, column % step :: step]
    small = CALM * float(np.max(np.abs(mean), initial=1e-30))
    return FieldStatistics(
        row=row,
        column=column,
        height=box.bottom + row * box.dz,
        speed=float(np.hypot(u, v)),
        direction=box.direction - float(np.arctan2(v, u)),
        mean=mean,
        std=std,
        lowest=lowest,
        highest=highest,
        covariance=hub.T @ hub / len(hub),
        hub_time_scale=_time_scales(hub[:, None], box, small),
        grid_time_scale=_time_scales(several.reshape(len(hub), -1, 3), box, small),
        travel=box.speed,
    )


def _moments(box: WindBox) -> tuple[Float, Float, Float, Float]:
    """(Z, Y, 3) mean, standard deviation, minimum and maximum, computed in blocks of planes."""
    v = box.velocity.reshape(len(box.velocity), -1)
    step = max(VALUES_AT_ONCE // v.shape[1], 1)
    first = v[0].astype(np.float64)  # offset near the mean avoids loss of digits in the squares
    total, squares = np.zeros_like(first), np.zeros_like(first)
    lowest, highest = v[0].copy(), v[0].copy()
    for begin in range(0, len(v), step):
        some = v[begin : begin + step]
        np.minimum(lowest, some.min(axis=0), out=lowest)
        np.maximum(highest, some.max(axis=0), out=highest)
        part = some - first
        total += part.sum(axis=0)
        squares += np.einsum("tp,tp->p", part, part)
    total /= len(v)
    variance = np.maximum(squares / len(v) - total**2, 0.0)
    shape = box.velocity.shape[1:]
    moments = (first + total, np.sqrt(variance), lowest.astype(np.float64), highest.astype(np.float64))
    return tuple(values.reshape(shape) for values in moments)


def _time_scales(series: NDArray[np.floating], box: WindBox, small: float) -> Float:
    """(3,) [s] of the autocorrelation averaged over the points of series (T, points, 3)."""
    n = len(series)
    length = n if box.periodic else fft.next_fast_len(2 * n, real=True)
    lags = n // 2 + 1
    scales = np.full(3, np.nan)
    for c in range(3):
        x = np.ascontiguousarray(series[:, :, c].T, np.float64)
        x -= x.mean(axis=1, keepdims=True)
        power = np.mean(np.abs(fft.rfft(x, length)) ** 2, axis=0)
        covariance = fft.irfft(power, length)[:lags] / (n if box.periodic else n - np.arange(lags))
        if covariance[0] > small**2:
            scales[c] = box.dt * _to_first_zero(covariance / covariance[0])
    return scales


def _to_first_zero(correlation: Float) -> float:
    """Integral over the index by the trapezoidal rule, up to the first zero between samples."""
    below = np.flatnonzero(correlation <= 0.0)
    if not len(below):
        return float(np.trapezoid(correlation))
    i = int(below[0])
    last, after = correlation[i - 1], correlation[i]
    return float(np.trapezoid(correlation[:i]) + 0.5 * last * last / (last - after))


def series_statistics(wind: WindSeries | SteadyWind) -> SeriesStatistics:
    """Range, mean and standard deviation of a wind that is uniform except for shear, at its reference height.

    Averages are over time, with values linear in between; directions are not wrapped, as a run does not wrap them.

    Args:
      wind: a series, or a steady wind, whose deviation is zero.
    """
    if isinstance(wind, SteadyWind):
        vertical = wind.speed * math.tan(wind.upflow)
        row = {"speed": wind.speed, "direction": wind.direction, "vertical": vertical, "exponent": wind.shear_exponent}
        wind = WindSeries(time=[0.0], **row)  # type: ignore[arg-type]
    names = tuple(name for name in WindNow.names if name != "time")
    x = np.stack([wind.speed + wind.gust, *(getattr(wind, name) for name in names)])
    step = np.diff(wind.time)
    duration = float(step.sum())
    if len(step):
        share = step / duration
        mean = (0.5 * (x[:, 1:] + x[:, :-1])) @ share
        d = x - mean[:, None]
        square = ((d[:, 1:] ** 2 + d[:, 1:] * d[:, :-1] + d[:, :-1] ** 2) / 3.0) @ share
    else:
        mean, square = x[:, 0], np.zeros(len(x))
    lowest, highest = x.min(axis=1), x.max(axis=1)
    constant = lowest == highest  # without the rounding errors of an average
    return SeriesStatistics(
        names=("hub_speed", *names),
        mean=np.where(constant, lowest, mean),
        std=np.where(constant, 0.0, np.sqrt(np.maximum(square, 0.0))),
        lowest=lowest,
        highest=highest,
        duration=duration,
    )


def wind_spectrum(
    box: WindBox,
    component: Component,
    *,
    where: Literal["hub", "grid"] = "hub",
    per_decade: int | None = PER_DECADE,
    hub_height: float | None = None,
) -> SpectrumEstimate:
    """One-sided spectral density of a component, at the hub or averaged over the grid.

    Args:
      box: a field.
      component: u, v or w, in the axes of the box.
      where: the point nearest to the hub, or the average over all points.
      per_decade: bands, equally wide in the logarithm of the frequency, over which periodograms are averaged; bands
        that hold no frequency are left out. None gives every frequency alone; the sum of these densities times
        their spacing is the variance.
      hub_height: [m]; that of the box by default, or its middle if it has none.

    Raises:
      InputError: there is no such component, the hub lies outside, or the field has fewer than 4 planes.
    """
    c = _component(component)
    n = _planes(box)
    row, column = hub_point(box, hub_height)
    if where == "hub":
        power, points = np.abs(_amplitudes(box.velocity[:, row, column, c][:, None])[:, 0]) ** 2, 1
    else:
        power, points = np.zeros(n // 2), box.velocity.shape[1] * box.velocity.shape[2]
        for k in range(box.velocity.shape[1]):
            power += np.sum(np.abs(_amplitudes(box.velocity[:, k, :, c])) ** 2, axis=1)
        power /= points
    density = 2.0 * power * n * box.dt
    if n % 2 == 0:
        density[-1] *= 0.5  # the highest frequency is its own mirror image
    f = np.arange(1, n // 2 + 1) / (n * box.dt)
    if per_decade is None:
        return SpectrumEstimate(f, density, np.full(len(f), points, np.int64))
    starts, size = _bands(f, per_decade)
    return SpectrumEstimate(_middle(f, starts, size), np.add.reduceat(density, starts) / size, size * points)


def wind_coherence(
    box: WindBox,
    component: Component,
    separations: Sequence[float] | Float,
    *,
    direction: Literal["lateral", "vertical"] = "lateral",
    per_decade: int = PER_DECADE,
) -> CoherenceEstimate:
    """Real part of the coherence, averaged over all pairs of points of equal separation and over bands.

    Args:
      box: a field.
      component: u, v or w, in the axes of the box.
      separations: [m] rounded to the nearest multiple of the grid step; each multiple is returned once.
      direction: direction of the separation.
      per_decade: bands, equally wide in the logarithm of the frequency.

    Raises:
      InputError: there is no such component, or a separation is larger than the grid or smaller than half a step.
    """
    c = _component(component)
    n = _planes(box)
    lateral = direction == "lateral"
    step, points = (box.dy, box.velocity.shape[2]) if lateral else (box.dz, box.velocity.shape[1])
    apart = sorted({round(float(s) / step) for s in separations})
    if not apart or apart[0] < 1 or apart[-1] >= points:
        raise InputError(
            f"coherence: separations must lie between {step:g} m and {(points - 1) * step:g} m, found "
            + ", ".join(f"{float(s):g} m" for s in separations)
        )
    f = np.arange(1, n // 2 + 1) / (n * box.dt)
    starts, size = _bands(f, per_decade)
    cross, power_1, power_2 = np.zeros((3, len(apart), len(f)))
    lines = box.velocity.shape[1 if lateral else 2]
    for k in range(lines):
        a = _amplitudes(box.velocity[:, k, :, c] if lateral else box.velocity[:, :, k, c])
        power = a.real**2 + a.imag**2
        for i, m in enumerate(apart):
            product = np.einsum("fp,fp->f", a.real[:, m:], a.real[:, :-m])
            cross[i] += product + np.einsum("fp,fp->f", a.imag[:, m:], a.imag[:, :-m])
            power_1[i] += power[:, m:].sum(axis=1)
            power_2[i] += power[:, :-m].sum(axis=1)
    cross, power_1, power_2 = (np.add.reduceat(x, starts, axis=1) for x in (cross, power_1, power_2))
    both = np.sqrt(power_1 * power_2)
    with np.errstate(invalid="ignore", divide="ignore"):
        value = np.where(both > 0.0, cross / both, np.nan)
    pairs = np.array([lines * (points - m) for m in apart], np.int64)
    return CoherenceEstimate(step * np.array(apart, float), _middle(f, starts, size), value, np.outer(pairs, size))


def _component(name: str) -> int:
    if name not in COMPONENTS:
        raise InputError(f"no component {name!r}: {did_you_mean(name, COMPONENTS)}")
    return COMPONENTS.index(name)


def _planes(box: WindBox) -> int:
    n = len(box.velocity)
    if n < 4:
        raise InputError(f"{box.label}: a spectrum needs at least 4 planes, found {n}")
    return n


def _amplitudes(series: NDArray[np.float32]) -> Complex:
    """Amplitudes (n // 2, points) of series (n, points) above zero frequency; a half has the variance of two."""
    x = np.ascontiguousarray(series.T, np.float64)
    x -= x.mean(axis=1, keepdims=True)
    return fft.rfft(x, norm="forward")[:, 1:].T


def _bands(f: Float, per_decade: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """First index and number of the frequencies of each band with at least one."""
    if per_decade < 1:
        raise InputError(f"there must be at least 1 band in a decade, found {per_decade}")
    which = np.floor(np.log10(f / f[0]) * per_decade + 1e-9)
    starts = np.flatnonzero(np.concatenate([[True], np.diff(which) > 0.0]))
    return starts, np.diff(np.append(starts, len(f)))


def _middle(f: Float, starts: NDArray[np.int64], size: NDArray[np.int64]) -> Float:
    middle: Float = np.exp(np.add.reduceat(np.log(f), starts) / size)
    return middle
