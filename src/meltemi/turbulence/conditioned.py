"""Turbulent fields through what sensors on a mast measured: a random field, conditioned on their series.

Frequency by frequency the field and the values at the sensors are jointly normal. A field that is drawn with its
values at the sensors becomes a conditional one by its covariance with the sensors times the difference of what was
measured and what was drawn (Matheron's rule): no matrix is larger than the number of sensors. The difference is known
only while the sensors measured; elsewhere it is the most probable continuation, by conjugate gradients.

Reference: docs/theory/wind.md (W-50, W-53 to W-55).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, get_args

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from meltemi.core.errors import InputError, did_you_mean
from meltemi.core.threads import one_blas_thread
from meltemi.turbulence.exponential import even_fast
from meltemi.turbulence.field import MARGIN, MOST_POINTS, mean_profile
from meltemi.turbulence.grid import WindGrid, wind_grid_for
from meltemi.turbulence.joint import TOUCHING, Channels, Joint, joint_of, widened
from meltemi.turbulence.sensors import Sensor, components
from meltemi.turbulence.synthesis import POINTS_AT_ONCE, add_noise
from meltemi.turbulence.targets import amplitude_variances, length_scale
from meltemi.wind.fields import WindBox
from meltemi.wind.turbulent import TurbulentWind

if TYPE_CHECKING:
    from meltemi.turbine.power_turbine import AnyTurbine

Float = NDArray[np.float64]
Complex = NDArray[np.complex128]
Evolution = Literal["none", "simley"]
Variance = Literal["measured", "spectrum", "wind"]

NOISE_STREAM, EVOLUTION_STREAM = 64, 65
"""Of the random numbers of the sensors' errors and of the air's change between mast and rotor, by channel."""
PADDING = 8.1
"""Scale parameters that the air travels between the end of a field and its periodic repetition."""
SAME_TIME = 1e-6
"""Tolerance of the sampling times, in planes."""
TOLERANCE, MOST_ITERATIONS = 1e-9, 2000
"""Residual of the continuation, relative, and its limit of iterations."""
SINGULAR = 1e-9
"""Added to variances, relative: sensors at the same place have equal ones."""
PER_BAND = 12
"""Least number of values of a periodogram in a band of a measured spectrum."""
DENSE, SPARSE = 0.45, 0.2
"""Highest frequency of a measured spectrum times the step of planes or, if it is longer, of samples."""


@dataclass(frozen=True)
class ConditionedField:
    """A wind field through measured series, and how far these determine it.

    Attributes:
      field: wind field.
      channels: (M,) text of each measured component, as "u at 80 m, 0 m across".
      delay: [s] time of the air from mast to rotor.
      begin, end: [s] times of the run in between which the series determine the wind at the tower.
      missing: (M,) [-] share of the samples that are missing.
      offset: (M,) [m/s] mean of a series less that of the wind's profile.
      factor: (3,) [-] standard deviation of u, v, w over that of the wind's description.
      explained: (3,) [-] share of the variance at the hub that the series determine.
    """

    field: WindBox
    channels: tuple[str, ...]
    delay: float
    begin: float
    end: float
    missing: Float
    offset: Float
    factor: Float
    explained: Float


@dataclass(frozen=True)
class Measured:
    """Series on the planes of a field, less the wind's mean profile.

    Attributes:
      channels: components and places.
      labels: (M,) text.
      values: (M, n) [m/s], 0 where unknown.
      known: (M, n) where a sample falls on a plane.
      noise: (M,) [m/s] standard deviation.
      missing: (M,) [-] share of missing samples.
      step: (M,) [s] between samples.
    """

    channels: Channels
    labels: tuple[str, ...]
    values: Float
    known: NDArray[np.bool_]
    noise: Float
    missing: Float
    step: Float


@one_blas_thread
def conditioned_field(
    sensors: Sequence[Sensor],
    wind: TurbulentWind,
    size: AnyTurbine | WindGrid,
    duration: float,
    *,
    distance: float = 0.0,
    evolution: Evolution = "none",
    variance: Variance = "measured",
    sampled: bool = True,
) -> ConditionedField:
    """Generate a turbulent field that passes through the series of sensors.

    The field is what the wind's model allows, given the measurement (W-50): the same at every sensor and time with a
    sample, random elsewhere, the more so the farther away. A sensor determines the box there if it is at a point of
    the grid; between points the box is linear. Missing samples, the time between rare ones, and that before and after
    the series are drawn on the condition of all known samples (W-54).

    Args:
      sensors: on one mast or several at the same distance upwind; at least one.
      wind: mean profile, spectrum, coherence, seed; that of :func:`measured_wind` fits the sensors. With
        ``coherent="u"`` v and w change only the point at which they are measured.
      size: a turbine, which the grid then covers with its tower, or the grid itself.
      duration: [s] duration of the run.
      distance: [m] of the mast upwind of the tower along the mean wind; the air needs the time distance / speed.
      evolution: change of the air on its way from mast to rotor: ``none``, frozen turbulence; ``simley``, the coherence
        of Simley and Pao (2015) (W-55).
      variance: of the field: ``measured``, the spectra of the model times one factor for each measured component, so
        that their variance is the mean one of the sensors; ``spectrum``, times a factor for each band of frequencies;
        ``wind``, those of the description (W-53).
      sampled: False leaves out what is random: the most probable field, which fluctuates too little.

    Raises:
      InputError: the sensors do not measure during the run, two of them measure the same at the same place, the wind
        cannot be conditioned, or the field does not fit into memory.
    """
    _check(sensors, wind, duration, distance)
    for name, value, allowed in (
        ("evolution", evolution, get_args(Evolution)),
        ("variance", variance, get_args(Variance)),
    ):
        if value not in allowed:
            raise InputError(f"{name}: unknown choice {value!r}; {did_you_mean(value, allowed)}")
    grid = size if isinstance(size, WindGrid) else wind_grid_for(size, wind.points)
    planes = math.ceil((duration + 1.5 * grid.width / wind.speed + 2.0 * MARGIN) / wind.dt)
    padding = PADDING * length_scale(wind, grid.hub_height) / wind.speed
    n = even_fast(planes + math.ceil(padding / wind.dt), real=True)
    if n * grid.points_y * grid.points_z > MOST_POINTS / 2:
        raise InputError(
            f"turbulence: a conditioned field of {n} planes with {grid.points_z} x {grid.points_y} points does not fit "
            "into memory: a higher speed, a shorter duration, fewer points or a larger dt reduce its size"
        )
    start = -0.5 * grid.width / wind.speed  # of the first plane at the tower, see WindBox
    delay = distance / wind.speed
    lag = _lag(sensors[0].time[0] - start + delay, wind.dt)
    measured = _on_planes(sensors, wind, grid, start - delay + lag, n, planes)
    gain = _gain(measured, wind, grid, n, variance)
    model = joint_of(wind, grid, n, measured.channels)
    kept = _evolution(wind, grid, gain, n, distance) if evolution == "simley" else np.ones(n // 2 + 1)
    among = _condition(model, measured, gain, kept, wind.seed if sampled else None)
    f = np.arange(n // 2 + 1) / (n * wind.dt)
    shift = gain * np.exp(-2j * np.pi * f * lag)
    mean = np.repeat(mean_profile(wind, grid.z, grid.hub_height), grid.points_y, axis=0)
    velocity = np.empty((planes, len(mean), 3), np.float32)
    for first in range(0, len(mean), POINTS_AT_ONCE):
        last = min(first + POINTS_AT_ONCE, len(mean))
        for c in range(3):
            series = fft.irfft(model.spectra(c, first, last) * shift[c], n, norm="forward")[:, :planes]
            velocity[:, first:last, c] = (series + mean[first:last, c, None]).T
    box = WindBox(
        velocity=velocity.reshape(planes, grid.points_z, grid.points_y, 3),
        dt=wind.dt,
        dy=grid.dy,
        dz=grid.dz,
        bottom=grid.bottom,
        speed=wind.speed,
        hub_height=grid.hub_height,
        direction=wind.direction,
        source=f"{wind.label}, through {len(sensors)} sensor{'s' if len(sensors) > 1 else ''}",
    )
    inside = np.flatnonzero(measured.known.any(axis=0))
    known, variances = measured.known, model.variances[:3, 1:-1]
    return ConditionedField(
        field=box,
        channels=measured.labels,
        delay=delay,
        begin=max(start + lag + wind.dt * int(inside[0]), 0.0),
        end=min(start + lag + wind.dt * int(inside[-1]), duration),
        missing=measured.missing,
        offset=np.sum(measured.values * known, axis=1) / np.maximum(known.sum(axis=1), 1),
        factor=np.sqrt(np.sum(gain[:, 1:-1] ** 2 * variances, axis=1) / np.sum(variances, axis=1)),
        explained=_explained(model, measured, gain, kept, among),
    )


def _check(sensors: Sequence[Sensor], wind: TurbulentWind, duration: float, distance: float) -> None:
    """Raise InputError for what cannot be conditioned."""
    if not sensors:
        raise InputError("sensors: a conditioned field needs at least one sensor; generate_field makes one without")
    if wind.intensity == 0.0:
        raise InputError("wind: intensity must be above 0 for a field through measured series")
    if wind.periodic or wind.hub_series is not None:
        raise InputError("wind: a conditioned field takes neither periodic nor hub_series: leave them out")
    if not (math.isfinite(duration) and duration > 0.0):
        raise InputError(f"turbulence: duration must be positive, found {duration!r}")
    if not 0.0 <= distance <= 1e5:
        raise InputError(f"distance: the mast must be 0 to 1e5 m upwind of the tower, found {distance!r}")


def _lag(time: float, dt: float) -> float:
    """[s] by which planes are late so that one of them falls on a time, from -dt / 2 to dt / 2."""
    return float((time + 0.5 * dt) % dt - 0.5 * dt)


def _on_planes(
    sensors: Sequence[Sensor], wind: TurbulentWind, grid: WindGrid, start: float, n: int, planes: int
) -> Measured:
    """What the sensors measured on planes that pass the mast from ``start`` [s] on.

    A plane is known if a sample lies within half a step of it; its value is interpolated linearly. Planes from number
    ``planes`` on are not: there the ring closes.
    """
    time = start + wind.dt * np.arange(n)
    places, labels, values, known, missing = [], [], [], [], []
    for sensor in sensors:
        mean = mean_profile(wind, np.array([sensor.height]), grid.hub_height)[0]
        for c, x in components(sensor, wind, mean).items():
            valid = ~np.isnan(x)
            at = sensor.time[valid]
            right = np.searchsorted(at, time).clip(1, len(at) - 1)
            nearest = np.minimum(np.abs(at[right - 1] - time), np.abs(at[right] - time))
            known.append((nearest <= (0.5 + SAME_TIME) * wind.dt) & (np.arange(n) < planes))
            values.append(np.where(known[-1], np.interp(time, at, x[valid]) - mean[c], 0.0))
            missing.append(float(np.mean(~valid)))
            labels.append(f"{'uvw'[c]} at {sensor.height:g} m, {sensor.across:g} m across")
            places.append((c, sensor.height, sensor.across, sensor.noise, float(np.median(np.diff(sensor.time)))))
    component, z, y, noise, step = np.array(places).T
    channels = Channels(component.astype(np.intp), z, y)
    measured = Measured(channels, tuple(labels), np.array(values), np.array(known), noise, np.array(missing), step)
    if not measured.known.any():
        raise InputError(
            f"sensors: they measure from {min(s.time[0] for s in sensors):g} s to {max(s.time[-1] for s in sensors):g}"
            f" s, the field passes the mast from {time[0]:g} s to {time[planes - 1]:g} s"
        )
    same = (channels.distances(z, y) < TOUCHING) & (component[:, None] == component) & (noise + noise[:, None] == 0.0)
    for i, j in np.argwhere(np.triu(same, 1)):
        raise InputError(f"sensors: two of them measure {labels[max(i, j)]}: leave one out, or give noise")
    return measured


def _gain(measured: Measured, wind: TurbulentWind, grid: WindGrid, n: int, variance: Variance) -> Float:
    """(3, H) [-] of the model's amplitudes (W-53)."""
    f, model = amplitude_variances(wind, grid.hub_height, n)
    gain = np.ones((3, n // 2 + 1))
    for c in range(3):
        some = np.flatnonzero((measured.channels.component == c) & (measured.known.sum(axis=1) > 1))
        if variance == "wind" or not len(some):
            continue
        noise = measured.noise[some]
        target = [np.var(measured.values[i, measured.known[i]]) for i in some] - noise**2
        gain[c] = math.sqrt(max(float(np.mean(target)), 0.0) / (2.0 * np.sum(model[c])))
        if variance == "spectrum":
            densities = [_periodogram(measured, int(i)) for i in some]
            step = float(measured.step[some].max())
            highest = min(DENSE / wind.dt, SPARSE / step if step > 1.5 * wind.dt else math.inf)
            gain[c] = widened(_banded(f, model[c], densities, highest, wind.dt, float(np.mean(noise**2))))
        if not np.all(gain[c] > 0.0):
            raise InputError(f"sensors: {'uvw'[c]} does not vary more than its noise; leave it out, or correct noise")
    return gain


def _periodogram(measured: Measured, i: int) -> Float:
    """(B,) [m^2/s^2] squared amplitudes of a series from its first to its last sample, linear in its gaps."""
    inside = np.flatnonzero(measured.known[i])
    whole = np.arange(inside[0], inside[-1] + 1)
    series = np.interp(whole, inside, measured.values[i, inside])
    return np.abs(fft.rfft(series - series.mean(), norm="forward")[1:]) ** 2 * len(series)


def _banded(f: Float, model: Float, densities: list[Float], highest: float, dt: float, noise: float) -> Float:
    """(B,) [-] square root of the measured over the model's density, by bands, linear in the logarithm of frequency.

    Args:
      f, model: (B,) [Hz] frequencies, and the model's variances of the amplitudes.
      densities: squared amplitudes times the number of planes of each series.
      highest: [Hz] beyond which the last ratio holds.
      dt: [s] step of the planes.
      noise: [m^2/s^2] mean variance of the noise.
    """
    middle, ratio = [], []
    length = min(len(d) for d in densities)
    step = 0.5 / (dt * length)
    spectrum = np.mean([d[:length] for d in densities], axis=0) - noise
    target = np.interp(step * np.arange(1, length + 1), f, model / (f[0] * dt))
    begin, last = 0, max(min(int(highest / step), length), 1)
    while begin < last:
        end = max(begin + PER_BAND, int(1.3 * begin))
        end = last if last - end < PER_BAND else end
        middle.append(step * math.sqrt((begin + 1) * end))
        ratio.append(np.sum(spectrum[begin:end]) / np.sum(target[begin:end]))
        begin = end
    return np.sqrt(np.maximum(np.interp(np.log(f), np.log(middle), ratio), 0.0))


def _evolution(wind: TurbulentWind, grid: WindGrid, gain: Float, n: int, distance: float) -> Float:
    """(H,) [-] coherence of mast and rotor: the root of that of Simley and Pao (2015) (W-55)."""
    f, variances = amplitude_variances(wind, grid.hub_height, n)
    sigma = math.sqrt(2.0 * np.sum(gain[:, 1:-1] ** 2 * variances[:3]))
    decay = 8.4 * sigma / wind.speed + 0.05
    lowest = 0.25 * (8.1 * length_scale(wind, grid.hub_height)) ** -1.24
    f = np.concatenate([[0.0], f, f[-1:]])
    kept: Float = np.exp(-0.5 * decay * distance * np.hypot(f / wind.speed, lowest))
    return kept


def _condition(model: Joint, measured: Measured, gain: Float, kept: Float, seed: int | None) -> Complex:
    """Condition a random field on the series (W-50); returns the covariances (H, M, M) of these, with noise."""
    m, n = measured.values.shape
    factor = gain[measured.channels.component]
    air = model.among() * (factor[:, None] * factor).transpose(2, 0, 1)
    among = air + np.diag(measured.noise**2 / n)
    drawn = np.zeros((m, n // 2 + 1), np.complex128)
    if seed is not None:
        drawn = kept * factor * model.draw(seed)
        fresh = np.zeros((2, m, n // 2 + 1), np.complex128)
        for i in range(2):
            add_noise(fresh[i], np.ones(n // 2 - 1), seed, 0, (NOISE_STREAM, EVOLUTION_STREAM)[i])
        drawn += measured.noise[:, None] / math.sqrt(n) * fresh[0]
        if np.any(kept < 1.0):
            root = np.linalg.cholesky(air * (1.0 + SINGULAR * np.eye(m)))
            drawn += np.sqrt(1.0 - kept**2) * np.einsum("hij,jh->ih", root, fresh[1])
    difference = measured.values - fft.irfft(drawn, n, norm="forward")
    amplitudes = fft.rfft(_continued(difference, measured.known, among), norm="forward")
    pull = np.linalg.solve(among, amplitudes.T[:, :, None])[..., 0].T
    model.condition(kept * factor * pull)
    return among


def _continued(series: Float, known: NDArray[np.bool_], among: Complex) -> Float:
    """Most probable continuation of periodic series (M, n) with covariances (H, M, M) of their amplitudes (W-54).

    The precision matrix on the ring is circulant. Its part for the unknown values is solved by conjugate gradients; the
    covariance of the unknown values is nearly its inverse, and preconditions it.
    """
    from scipy.sparse.linalg import LinearOperator, cg

    if known.all():
        return series
    n = series.shape[1]
    unknown = ~known
    inverse = np.asarray(np.linalg.inv(among), np.complex128)

    def times(matrix: Complex, x: Float) -> Float:
        product: Float = fft.irfft(np.einsum("hij,jh->ih", matrix, fft.rfft(x)), n)
        return product

    def within(matrix: Complex) -> LinearOperator:
        def product(x: Float) -> Float:
            whole = np.zeros_like(series)
            whole[unknown] = x.ravel()
            return times(matrix, whole)[unknown]

        size = int(unknown.sum())
        return LinearOperator((size, size), matvec=product, dtype=np.float64)

    result = np.where(known, series, 0.0)
    right = -times(inverse, result)[unknown]
    precision, covariance = within(inverse), within(among)
    result[unknown], failed = cg(precision, right, rtol=TOLERANCE, maxiter=MOST_ITERATIONS, M=covariance)
    if failed:
        raise InputError(
            "sensors: the gaps of the series cannot be filled: two sensors are too close to each other, or too few "
            "samples fall on planes of the field; leave one sensor out, give noise, or a longer dt of the wind"
        )
    return result


def _explained(model: Joint, measured: Measured, gain: Float, kept: Float, among: Complex) -> Float:
    """(3,) [-] share of the variance at the hub that the series determine, while they are known."""
    factor = gain[measured.channels.component]
    result = np.zeros(3)
    for c in range(3):
        with_hub = model.with_hub(c) * (kept * factor).T
        solved = np.linalg.solve(among, with_hub.conj()[..., None])[..., 0]
        share = np.sum((with_hub * solved).real, axis=1)
        result[c] = np.sum((gain[c] ** 2 * share)[1:-1]) / np.sum((gain[c] ** 2 * model.variances[c])[1:-1])
    return result
