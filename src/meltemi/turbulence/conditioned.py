"""Turbulent fields through what sensors on a mast measured: a random field, conditioned on their series.

Frequency by frequency the field and the values at the sensors are jointly normal. A field that is drawn with its
values at the sensors becomes a conditional one by its covariance with the sensors times the difference of what was
measured and what was drawn (Matheron's rule): no matrix is larger than the number of sensors. The difference is known
only while the sensors measured; elsewhere it is the most probable continuation, by conjugate gradients.

With Kaimal's and von Karman's spectra u, v and w are independent: each is conditioned alone. Arrays over frequencies
have H = n / 2 + 1 entries from 0 to the Nyquist frequency, which has the covariances of its neighbour and is not drawn.
At 0 is what fluctuates too slowly for the ring: without it the mean at a sensor would be that of the whole rotor.

Reference: docs/theory/wind.md (W-50 to W-54).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from itertools import combinations
from typing import TYPE_CHECKING, Literal, get_args

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from meltemi.core.errors import InputError, did_you_mean
from meltemi.core.threads import one_blas_thread
from meltemi.turbulence.exponential import REACH, coherent_fields, even_fast
from meltemi.turbulence.field import box_of, mean_profile, plane_count
from meltemi.turbulence.grid import WindGrid, wind_grid_for
from meltemi.turbulence.sensors import Sensor, components
from meltemi.turbulence.spectra import coherence_decay
from meltemi.turbulence.synthesis import FIELD_STREAM, POINT_STREAM, POINTS_AT_ONCE, add_noise
from meltemi.turbulence.targets import amplitude_variances, length_scale, target_densities
from meltemi.wind.fields import WindBox
from meltemi.wind.turbulent import TurbulentWind

if TYPE_CHECKING:
    from meltemi.turbine.power_turbine import AnyTurbine

Float = NDArray[np.float64]
Complex = NDArray[np.complex128]
Index = NDArray[np.intp]
Known = NDArray[np.bool_]
Variance = Literal["measured", "wind"]

SENSOR_STREAM, ERROR_STREAM, SLOW_STREAM, SLOW_SENSOR_STREAM = 48, 64, 80, 96
"""Streams of the air at the sensors, of their errors, and of what is slower than the ring, in the field and at the
sensors, plus the component; the other address is the sensor, or 0."""
SLOW_NODES = 8
"""Of the quadrature over what is slower than the ring."""
PADDING = 8.1
"""Scale parameters that the air travels between the end of a field and its periodic repetition."""
SAME_TIME, SAME_PLACE = 1e-6, 1e-6
"""Tolerance of the sampling times, in planes, and of places [m]."""
TOLERANCE, MOST_ITERATIONS = 1e-9, 2000
"""Residual of the continuation, relative, and its limit of iterations."""
INDEPENDENT = 1e9
"""[1/m] decay of the coherence of components without any."""
NEAREST = 36
"""Points nearest to a sensor from which the air there is drawn."""
FREQUENCIES_AT_ONCE = 1024
"""Number of frequencies whose covariances are in memory."""


@dataclass(frozen=True)
class ConditionedFields:
    """Wind fields through measured series, and how far these determine them.

    Attributes:
      fields: a wind field for each seed.
      channels: (M,) text of each measured component, as "u at 80 m, 0 m across".
      delay: [s] time of the air from mast to rotor.
      begin, end: [s] times of the run in between which the series determine the wind at the tower.
      missing: (M,) [-] share of the samples that are missing.
      offset: (M,) [m/s] mean of a series less that of the wind's profile.
      factor: (3,) [-] standard deviation of u, v, w over that of the wind's description.
      explained: (3,) [-] share of the variance at the hub that the series determine.
    """

    fields: tuple[WindBox, ...]
    channels: tuple[str, ...]
    delay: float
    begin: float
    end: float
    missing: Float
    offset: Float
    factor: Float
    explained: Float


@dataclass(frozen=True)
class Channel:
    """A measured component on the planes of a field, less the wind's mean profile."""

    component: int  # 0, 1, 2 for u, v, w
    z: float  # [m] height
    y: float  # [m] lateral position
    values: Float  # (n,) [m/s], 0 where unknown
    known: Known  # (n,) where a sample falls on a plane
    noise: float = 0.0  # [m/s] standard deviation of the errors
    missing: float = 0.0  # [-] share of missing samples

    @property
    def label(self) -> str:
        """Short description."""
        return f"{'uvw'[self.component]} at {self.z:g} m, {self.y:g} m across"


@dataclass(frozen=True)
class Places:
    """P points of a grid, rows first, and then M sensors, between which the coherence is exp(-kappa r)."""

    grid: WindGrid
    of_sensors: tuple[complex, ...]  # (M,) [m] lateral positions + i heights
    kappa: Float  # (H,) [1/m]

    @cached_property
    def all(self) -> Complex:
        """(P + M,) [m] lateral positions + i heights."""
        return np.append(self.grid.y + 1j * self.grid.z[:, None], self.of_sensors)

    @property
    def points(self) -> Index:
        """Numbers of the points."""
        return np.arange(len(self.all) - len(self.of_sensors))

    @property
    def sensors(self) -> Index:
        """Numbers of the sensors."""
        return len(self.points) + np.arange(len(self.of_sensors))

    def distances(self, a: Index, b: Index) -> Float:
        """(A, B) [m] between places."""
        r = np.abs(self.all[a, None] - self.all[b])
        return np.where(r < SAME_PLACE, 0.0, r)

    def coherence(self, a: Index, b: Index, some: slice | Index = slice(None)) -> Float:
        """(h, A, B) between places at some frequencies."""
        return np.asarray(np.exp(-self.kappa[some, None, None] * self.distances(a, b)))

    @cached_property
    def predictors(self) -> list[tuple[Index, Float, Float]]:
        """For each sensor places before it, their weights (H, K), and the share of variance (H,) they leave (W-51)."""
        parts = np.array_split(np.arange(len(self.kappa)), math.ceil(len(self.kappa) / FREQUENCIES_AT_ONCE))
        result, distinct = [], np.array([], np.intp)  # sensors that are neither at a point nor at a sensor before
        for i in self.sensors[:, None]:
            r = self.distances(i, np.arange(i[0]))[0]
            if r.min() == 0.0:
                given, weight = np.array([r.argmin()]), np.ones((len(self.kappa), 1))
            else:
                given = np.append(np.argsort(r[: len(self.points)], kind="stable")[:NEAREST], distinct)
                among, to_sensor = (partial(self.coherence, given, b) for b in (given, i))
                weight = np.concatenate([np.linalg.solve(among(some), to_sensor(some)) for some in parts])[..., 0]
                distinct = np.append(distinct, i)
            left = 1.0 - np.sum(weight * self.coherence(given, i)[..., 0], axis=1)
            result.append((given, weight, left.clip(0.0)))
        return result


@dataclass(frozen=True)
class RandomField:
    """Random field of one component at places, and what sensors measured of it."""

    component: int  # 0, 1, 2 for u, v, w
    places: Places
    channels: Sequence[Channel]  # (M,)
    variances: Float  # (H,) [m^2/s^2] of the amplitudes

    def covariances(self, a: Index, b: Index) -> Float:
        """(H, A, B) [m^2/s^2] between places."""
        return np.asarray(self.variances[:, None, None] * self.places.coherence(a, b))

    @cached_property
    def noise(self) -> Float:
        """(M,) [m/s] standard deviations of the amplitudes of the sensors' errors, at all frequencies."""
        return np.array([channel.noise for channel in self.channels]) / math.sqrt(2 * len(self.variances) - 2)

    @cached_property
    def measured(self) -> Float:
        """(H, M, M) [m^2/s^2] covariances of what the sensors measure, with their errors."""
        return self.covariances(self.places.sensors, self.places.sensors) + np.diag(self.noise**2)


@one_blas_thread
def conditioned_fields(
    sensors: Sequence[Sensor],
    wind: TurbulentWind,
    size: AnyTurbine | WindGrid,
    duration: float,
    *,
    seeds: Sequence[int] = (),
    distance: float = 0.0,
    variance: Variance = "measured",
) -> ConditionedFields:
    """Generate turbulent fields that pass through the series of sensors.

    A field is what the wind's model allows, given the measurement (W-50): the same at every sensor and time with a
    sample, random elsewhere, the more so the farther away. A sensor determines the box there if it is at a point of
    the grid; between points the box is linear. Missing samples, the time between rare ones, and that before and after
    the series are drawn on the condition of all known samples (W-53).

    Args:
      sensors: on one mast or several at the same distance upwind; at least one.
      wind: mean profile, spectrum (Kaimal's or von Karman's), coherence; that of :func:`measured_wind` fits the
        sensors. With ``coherent="u"`` v and w change only the point at which they are measured.
      size: a turbine, which the grid then covers with its tower, or the grid itself.
      duration: [s] duration of the run.
      seeds: one for each field, by default that of the wind; several take less time together than one by one.
      distance: [m] of the mast upwind of the tower along the mean wind; the air needs the time distance / speed.
      variance: of the fields: ``measured``, the spectra of the model times one factor for each measured component, so
        that their variance is the mean one of the sensors; ``wind``, those of the description (W-52).

    Raises:
      InputError: the sensors do not measure during the run, two of them measure the same at the same place, the wind
        cannot be conditioned, or a field does not fit into memory.
    """
    _check(sensors, wind, distance, variance)
    winds = [wind.replace(seed=seed) for seed in seeds or (wind.seed,)]
    grid = size if isinstance(size, WindGrid) else wind_grid_for(size, wind.points)
    planes = math.ceil(plane_count(wind, grid, duration, len(winds)))
    padding = PADDING * length_scale(wind, grid.hub_height) / wind.speed
    n = even_fast(planes + math.ceil(padding / wind.dt), real=True)
    start = -0.5 * grid.width / wind.speed  # of the first plane at the tower, see WindBox
    delay = distance / wind.speed
    lag = math.remainder(sensors[0].time[0] - start + delay, wind.dt)  # so that planes fall on samples
    channels = on_planes(sensors, wind, grid, start - delay + lag, n, planes)
    shift = np.exp(-2j * np.pi * np.arange(n // 2 + 1) / (n * wind.dt) * lag)
    mean = np.repeat(mean_profile(wind, grid.z, grid.hub_height), grid.points_y, axis=0)
    velocity = np.empty((len(winds), planes, grid.points_z, grid.points_y, 3), np.float32)
    at_points = velocity.reshape(len(winds), planes, -1, 3)
    factor, explained = np.ones(3), np.zeros(3)
    field = None
    for c in range(3):
        field = random_field(wind, grid, n, c, channels, field)
        if variance == "measured":
            factor[c] = _factor(field)
            field = replace(field, variances=factor[c] ** 2 * field.variances)
        amplitudes = conditioned(field, [wind.seed for wind in winds])
        explained[c] = _explained(field)
        for first in range(0, len(mean), POINTS_AT_ONCE):
            some = slice(first, first + POINTS_AT_ONCE)
            series = fft.irfft(amplitudes[:, some] * shift, n, norm="forward")[..., :planes]
            at_points[:, :, some, c] = (series + mean[some, c, None]).swapaxes(1, 2)
    known = start + lag + wind.dt * np.flatnonzero(np.any([channel.known for channel in channels], axis=0))
    return ConditionedFields(
        fields=tuple(
            box_of(one, grid, v, f"{one.label}, through {len(channels)} measured series")
            for one, v in zip(winds, velocity, strict=True)
        ),
        channels=tuple(channel.label for channel in channels),
        delay=delay,
        begin=max(float(known[0]), 0.0),
        end=min(float(known[-1]), duration),
        missing=np.array([channel.missing for channel in channels]),
        offset=np.array([channel.values.sum() / max(channel.known.sum(), 1) for channel in channels]),
        factor=factor,
        explained=explained,
    )


def _check(sensors: Sequence[Sensor], wind: TurbulentWind, distance: float, variance: Variance) -> None:
    """Raise InputError for what cannot be conditioned."""
    if not sensors:
        raise InputError("sensors: a conditioned field needs at least one sensor; generate_field makes one without")
    if wind.spectrum == "mann":
        raise InputError("wind: a conditioned field takes the spectrum kaimal or vonkarman, found mann")
    if wind.intensity == 0.0:
        raise InputError("wind: intensity must be above 0 for a field through measured series")
    if wind.periodic or wind.hub_series is not None:
        raise InputError("wind: a conditioned field takes neither periodic nor hub_series: leave them out")
    if not 0.0 <= distance <= 1e5:
        raise InputError(f"distance: the mast must be 0 to 1e5 m upwind of the tower, found {distance!r}")
    if variance not in (allowed := get_args(Variance)):
        raise InputError(f"variance: unknown choice {variance!r}; {did_you_mean(variance, allowed)}")


def on_planes(
    sensors: Sequence[Sensor], wind: TurbulentWind, grid: WindGrid, start: float, n: int, planes: int
) -> list[Channel]:
    """What the sensors measured on planes that pass the mast from ``start`` [s] on.

    A plane is known if a sample lies within half a step of it; its value is interpolated linearly. Planes from number
    ``planes`` on are not: there the ring closes.
    """
    time = start + wind.dt * np.arange(n)
    channels = []
    for sensor in sensors:
        (mean,) = mean_profile(wind, np.array([sensor.height]), grid.hub_height)
        for c, x in components(sensor, wind, mean).items():
            valid = ~np.isnan(x)
            at = sensor.time[valid]
            right = np.searchsorted(at, time).clip(1, len(at) - 1)
            nearest = np.minimum(np.abs(at[right - 1] - time), np.abs(at[right] - time))
            known = (nearest <= (0.5 + SAME_TIME) * wind.dt) & (np.arange(n) < planes)
            values = np.where(known, np.interp(time, at, x[valid]) - mean[c], 0.0)
            missing = float(np.mean(~valid))
            channels.append(Channel(c, sensor.height, sensor.across, values, known, sensor.noise, missing))
    if not any(channel.known.any() for channel in channels):
        raise InputError(
            f"sensors: they measure from {min(s.time[0] for s in sensors):g} s to {max(s.time[-1] for s in sensors):g}"
            f" s, the field passes the mast from {time[0]:g} s to {time[planes - 1]:g} s"
        )
    for a, b in combinations(channels, 2):
        same = a.component == b.component and math.hypot(a.z - b.z, a.y - b.y) < SAME_PLACE
        if same and a.noise + b.noise == 0.0:
            raise InputError(f"sensors: two of them measure {b.label}: leave one out, or give noise")
    return channels


def random_field(
    wind: TurbulentWind,
    grid: WindGrid,
    n: int,
    component: int,
    channels: Sequence[Channel],
    like: RandomField | None = None,
) -> RandomField:
    """A component of a wind on ``n`` planes of a grid and at the sensors that measure it.

    Its places are those of another field, ``like``, if they are equal: u, v and w of a sonic share the predictors.
    """
    f, variances = amplitude_variances(wind, grid.hub_height, n)
    x, weight = np.polynomial.legendre.leggauss(SLOW_NODES)
    slow = 0.25 * f[0] * weight @ target_densities(wind, grid.hub_height, 0.25 * f[0] * (x + 1.0))[component]  # W-54
    f = np.append(0.0, f)
    kappa = coherence_decay(wind.spectrum, wind.edition, f, wind.speed, length_scale(wind, grid.hub_height))
    if wind.coherent == "u" and component > 0:
        kappa = np.full_like(kappa, INDEPENDENT)
    mine = [channel for channel in channels if channel.component == component]
    places = Places(grid, tuple(channel.y + 1j * channel.z for channel in mine), np.pad(kappa, (0, 1), "edge"))
    if like and like.places.of_sensors == places.of_sensors and np.array_equal(like.places.kappa, places.kappa):
        places = like.places
    return RandomField(component, places, mine, np.pad(np.append(slow, variances[component]), (0, 1), "edge"))


def _factor(field: RandomField) -> float:
    """[-] of the model's standard deviation (W-52)."""
    varying = [x for x in field.channels if x.known.sum() > 1]
    if not varying:
        return 1.0
    variance = np.mean([np.var(x.values[x.known]) - x.noise**2 for x in varying])
    if variance <= 0.0:
        raise InputError(f"sensors: {varying[0].label} varies no more than its noise: leave it out, or correct noise")
    # fluctuations that are slower than the series belong to its mean
    within = [1.0 - np.abs(fft.rfft(x.known / x.known.sum())) ** 2 for x in varying]
    return math.sqrt(variance / (2.0 * np.sum(np.mean(within, axis=0)[1:-1] * field.variances[1:-1])))


def _explained(field: RandomField) -> float:
    """[-] share of the variance at the hub that the series determine, while they are known."""
    row, column = field.places.grid.hub
    with_hub = field.covariances(field.places.sensors, np.array([row * field.places.grid.points_y + column]))
    share = np.sum(with_hub * np.linalg.solve(field.measured, with_hub), axis=(1, 2))
    return float(np.sum(share[1:-1]) / np.sum(field.variances[1:-1]))


def draw(field: RandomField, seeds: Sequence[int]) -> Complex:
    """Draw the amplitudes (S, P + M, H) [m/s] at all places with each seed."""
    c, places, grid, kappa = field.component, field.places, field.places.grid, field.places.kappa
    bins, count = len(kappa), len(places.points)
    coherent = kappa[:-1] * min(grid.dy, grid.dz) < REACH
    amplitudes = np.zeros((len(seeds), len(places.all), bins), np.complex128)
    for begin, end, stream in ((0, 1, SLOW_STREAM), (1, bins - 1, FIELD_STREAM)):
        some_kappa = kappa[begin:end][coherent[begin:end]]
        for some, parts in coherent_fields(some_kappa, grid, [(seed, stream + c) for seed in seeds]):
            part = parts.reshape(len(seeds), -1, count).swapaxes(1, 2)
            amplitudes[:, :count, begin + some.start : begin + some.stop] = part
    for seed, drawn in zip(seeds, amplitudes, strict=True):
        add_noise(drawn[:count], np.where(coherent[1:], 0.0, 1.0), seed, 0, POINT_STREAM + c)
        add_noise(drawn[count:], np.ones(bins - 2), seed, 0, SENSOR_STREAM + c)
        slow = np.zeros((len(places.sensors), 3), np.complex128)
        add_noise(slow, coherent[:1].astype(np.float64), seed, 0, SLOW_SENSOR_STREAM + c)
        drawn[count:, 0] = slow[:, 1]
    amplitudes[..., 0] = math.sqrt(2.0) * amplitudes[..., 0].real
    amplitudes *= np.sqrt(field.variances)
    for i, (given, weight, left) in zip(places.sensors, places.predictors, strict=True):
        amplitudes[:, i] *= np.sqrt(left)
        amplitudes[:, i] += np.einsum("hk,skh->sh", weight, amplitudes[:, given])
    return amplitudes


def conditioned(field: RandomField, seeds: Sequence[int]) -> Complex:
    """Draw the amplitudes (S, P, H) [m/s] at the points with each seed on the condition of the series (W-50)."""
    places, drawn = field.places, draw(field, seeds)
    at_points, at_sensors = np.split(drawn, [len(places.points)], axis=1)
    if not field.channels:
        return at_points
    values, known = (np.array([getattr(channel, name) for channel in field.channels]) for name in ("values", "known"))
    errors = np.zeros_like(at_sensors)
    for seed, error in zip(seeds, errors, strict=True):
        add_noise(error, np.ones(len(field.variances) - 2), seed, 0, ERROR_STREAM + field.component)
    at_sensors += field.noise[:, None] * errors
    differences = values - fft.irfft(at_sensors, values.shape[1], norm="forward")
    amplitudes = fft.rfft([continued(x, known, field.measured) for x in differences], norm="forward")
    pull = np.linalg.solve(field.measured, amplitudes.T)
    for some in np.array_split(places.points, math.ceil(len(places.points) / POINTS_AT_ONCE)):
        at_points[:, some] += (field.covariances(some, places.sensors) @ pull).T
    return at_points


def continued(series: Float, known: NDArray[np.bool_], among: Float) -> Float:
    """Most probable continuation of periodic series (M, n) with covariances (H, M, M) of their amplitudes (W-53).

    The precision matrix on the ring is circulant. Its part for the unknown values is solved by conjugate gradients; the
    covariance of the unknown values is nearly its inverse, and preconditions it.
    """
    from scipy.sparse.linalg import LinearOperator, cg

    unknown = ~known
    inverse: Float = np.linalg.inv(among).astype(np.float64)

    def times(matrix: Float, x: Float) -> Float:
        product: Float = fft.irfft(np.einsum("hij,jh->ih", matrix, fft.rfft(x)), series.shape[1])
        return product[unknown]

    def within(matrix: Float) -> LinearOperator:
        def product(x: Float) -> Float:
            whole = np.zeros_like(series)
            whole[unknown] = x.ravel()
            return times(matrix, whole)

        return LinearOperator((unknown.sum(), unknown.sum()), matvec=product, dtype=np.float64)

    result = np.where(known, series, 0.0)
    right = -times(inverse, result)
    precision, preconditioner = within(inverse), within(among)
    result[unknown], failed = cg(precision, right, rtol=TOLERANCE, maxiter=MOST_ITERATIONS, M=preconditioner)
    if failed:
        raise InputError(
            "sensors: the gaps of the series cannot be filled: two sensors are too close to each other, or too few "
            "samples fall on planes of the field; leave one sensor out, give noise, or a longer dt of the wind"
        )
    return result
