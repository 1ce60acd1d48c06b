"""Turbulent fields: from a described wind, a grid and a duration to a box.

Reference: docs/theory/wind.md (W-7 to W-22).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray
from scipy import fft, linalg

from meltemi.core.errors import InputError
from meltemi.turbine.definition import Turbine
from meltemi.wind import exponential, mann
from meltemi.wind.fields import Wind, WindBox
from meltemi.wind.grid import Grid, grid_for
from meltemi.wind.spectra import CONSTANTS, coherence_decay, densities, scale_parameter
from meltemi.wind.synthesis import FIELD_STREAM, GAP_STREAM, Spectrum, add_noise, synthesise
from meltemi.wind.turbulent import TurbulentWind

Float = NDArray[np.float64]
Complex = NDArray[np.complex128]

MOST_POINTS = 3e8
"""Points in space and time of a field; they take 12 bytes each."""
MARGIN = 1.0
"""[s] before and after what passes the turbine."""
CUTOFF = 25.0
"""Wave number across the wind over hypot(k1, 1), up to which a target coherence is integrated."""
FORGOTTEN = 10.0
"""Wave number along the wind times separation from which on Mann's coherence counts as none."""


def generate_field(
    wind: TurbulentWind,
    size: Turbine | Grid,
    duration: float,
    progress: Callable[[float], None] = lambda share: None,
) -> WindBox:
    """The field of a turbulent wind.

    Args:
      wind: what it shall be.
      size: a turbine, which the grid then covers with its tower, or the grid itself.
      duration: [s] of the run it is for.
      progress: called with the share that is done.

    Raises:
      InputError: the field does not fit into memory, or the rotor comes too close to the ground.
    """
    grid = size if isinstance(size, Grid) else grid_for(size, wind.points)
    if not (math.isfinite(duration) and duration > 0.0):
        raise InputError(f"turbulence: duration must be positive, found {duration!r}")
    passes = 0.0 if wind.periodic else 1.5 * grid.width / wind.speed + 2.0 * MARGIN
    planes = (duration + passes) / wind.dt
    if planes * grid.points_y * grid.points_z > MOST_POINTS:
        raise InputError(
            f"turbulence: a field of {planes:.3g} planes with {grid.points_z} x {grid.points_y} points does not fit "
            "into memory: a higher speed, a shorter duration, fewer points or a larger dt make it smaller"
        )
    n = max(2 * round(0.5 * planes), 4) if wind.periodic else _even_fast(math.ceil(planes))
    mean = mean_profile(wind, grid)
    measured = hub_amplitudes(wind, grid, n) if wind.hub_series is not None else {}
    for component, amplitudes in measured.items():  # the mean of what was measured belongs to the mean wind
        mean[:, component] += amplitudes[0].real * (mean[:, 0] / wind.speed if component == 0 else 1.0)
        amplitudes[0] = 0.0
    velocity = synthesise(
        spectrum_of(wind, grid, n),
        grid,
        n,
        wind.seed,
        mean=mean,
        sigmas=_targets(wind),
        measured=measured,
        progress=progress,
    )
    return WindBox(
        velocity=velocity,
        dt=wind.dt,
        dy=grid.dy,
        dz=grid.dz,
        bottom=grid.bottom,
        speed=wind.speed,
        hub_height=grid.hub_height,
        periodic=wind.periodic,
        direction=wind.direction,
        source=wind.label,
    )


def _even_fast(n: int) -> int:
    """The next even number with small prime factors."""
    while True:
        n = fft.next_fast_len(n + n % 2, real=True)
        if n % 2 == 0:
            return n
        n += 1


def mean_profile(wind: TurbulentWind, grid: Grid) -> Float:
    """(Z, 3) [m/s] mean wind of the rows, in the axes of the box."""
    z = grid.z
    if wind.roughness > 0.0:
        speed = wind.speed * np.maximum(np.log(z / wind.roughness) / math.log(grid.hub_height / wind.roughness), 0.0)
    else:
        speed = wind.speed * (z / grid.hub_height) ** wind.shear_exponent
    turned = wind.veer * (z - grid.hub_height)
    return np.stack([speed * np.cos(turned), -speed * np.sin(turned), np.zeros_like(z)], axis=1)


def sigmas(wind: TurbulentWind) -> tuple[float, float, float]:
    """[m/s] standard deviations of u, v, w that the spectra stand for."""
    sigma = wind.intensity * wind.speed
    if wind.spectrum == "mann":
        u, v, w = np.sqrt(mann.one_point(mann.GAMMA).variances[:3])
        return sigma, float(sigma * v / u), float(sigma * w / u)
    u, v, w = CONSTANTS[wind.spectrum].sigmas
    return u * sigma, v * sigma, w * sigma


def _targets(wind: TurbulentWind) -> tuple[float | None, float | None, float | None]:
    return sigmas(wind) if wind.scaled else (None, None, None)


def target_densities(wind: TurbulentWind, hub_height: float, f: Float) -> Float:
    """(4, F) one-sided densities [m^2/s^2/Hz] of u, v, w and the co-spectrum uw, at frequencies [Hz] above 0."""
    scale = scale_parameter(wind.edition, hub_height)
    sigma = wind.intensity * wind.speed
    if wind.spectrum != "mann":
        return np.vstack([densities(wind.spectrum, f, wind.speed, sigma, scale), np.zeros_like(f)])
    point = mann.one_point(mann.GAMMA)
    factor = 2.0 * np.pi * CONSTANTS["mann"].lengths[0] * scale / wind.speed
    return 2.0 * sigma**2 / point.variances[0] * factor * point(factor * f)


def target_coherence(wind: TurbulentWind, hub_height: float, f: Float, dy: float, dz: float = 0.0) -> Float:
    """Real part of the coherence that two points of a wind's field shall have.

    Mann's is the tensor's integral over the wave vectors across the wind (W-14), on wave numbers graded for the
    separation; what lies beyond CUTOFF counts as incoherent, which makes it too small by less than 0.01.

    Args:
      wind: what it shall be.
      hub_height: [m], which gives the scales.
      f: (F,) [Hz] above 0.
      dy, dz: [m] from one point to the other.

    Returns:
      (3, F) [-] of u, v, w.
    """
    f = np.asarray(f, np.float64)
    apart = math.hypot(dy, dz)
    if apart == 0.0:
        return np.ones((3, len(f)))
    scale = scale_parameter(wind.edition, hub_height)
    result = np.zeros((3, len(f)))
    if wind.spectrum != "mann":
        components = 1 if wind.coherent == "u" else 3
        result[:components] = np.exp(-coherence_decay(wind.spectrum, wind.edition, f, wind.speed, scale) * apart)
        return result
    length = CONSTANTS["mann"].lengths[0] * scale
    k1 = 2.0 * np.pi * f * length / wind.speed
    point = mann.one_point(mann.GAMMA)(k1)
    y, z = abs(dy) / length, abs(dz) / length
    for m in np.flatnonzero(k1 * apart < FORGOTTEN * length):
        k = float(k1[m])
        highest = CUTOFF * math.hypot(k, 1.0)
        (k3, weight_3), (k2, weight_2) = mann.graded(k, highest, z), mann.graded(k, highest, y)
        k2, weight_2 = k2[len(k2) // 2 :], 2.0 * weight_2[len(k2) // 2 :]  # auto-spectra are even in k2
        phi = np.empty((3, 3, len(k3), len(k2)))
        mann.tensor(-k, k3, k2, mann.lifetimes(mann.GAMMA), phi)
        for c in range(3):
            result[c, m] = (weight_3 * np.cos(k3 * z)) @ phi[c, c] @ (weight_2 * np.cos(k2 * y)) / point[c, m]
    return result


def spectrum_of(wind: TurbulentWind, grid: Grid, n: int) -> Spectrum:
    """What the field of a wind shall have at the frequencies of ``n`` planes."""
    f = np.arange(1, n // 2) / (n * wind.dt)
    variances = 0.5 * f[0] * target_densities(wind, grid.hub_height, f)
    return (_mann if wind.spectrum == "mann" else _exponential)(wind, grid, f, variances)


def _exponential(wind: TurbulentWind, grid: Grid, f: Float, variances: Float) -> Spectrum:
    kappa = coherence_decay(wind.spectrum, wind.edition, f, wind.speed, scale_parameter(wind.edition, grid.hub_height))
    some = kappa[kappa * min(grid.dy, grid.dz) < exponential.REACH]
    components = (0,) if wind.coherent == "u" else (0, 1, 2)
    row, column = grid.hub
    to_hub = np.hypot((grid.z - grid.z[row])[:, None], grid.y - grid.y[column])

    def coherent() -> Iterator[tuple[slice, Complex, Float]]:
        streams = [FIELD_STREAM + c for c in components]
        for bins, fields in exponential.coherent_fields(some, grid, wind.seed, streams):
            for c, field in zip(components, fields, strict=True):
                field *= np.sqrt(variances[c, bins])[:, None, None]
            covered = np.zeros((4, fields.shape[1]))
            covered[list(components)] = variances[list(components), bins]
            yield bins, fields, covered

    def with_hub(m: int) -> Complex:
        result = np.zeros((3, 3, *to_hub.shape), np.complex128)
        for c in components:
            result[c, c] = variances[c, m] * np.exp(-kappa[m] * to_hub)
        return result

    return Spectrum(variances, components, len(some), coherent(), with_hub)


def _mann(wind: TurbulentWind, grid: Grid, f: Float, variances: Float) -> Spectrum:
    length = CONSTANTS["mann"].lengths[0] * scale_parameter(wind.edition, grid.hub_height)
    k1 = 2.0 * np.pi * f * length / wind.speed
    some = k1[k1 * min(grid.dy, grid.dz) < mann.INDEPENDENT * length]
    point = mann.one_point(mann.GAMMA)
    unit = wind.intensity**2 * wind.speed**2 / point.variances[0] * k1[0]  # variance of a step of k1

    def coherent() -> Iterator[tuple[slice, Complex, Float]]:
        made = mann.sheared_fields(some, grid, length, mann.GAMMA, wind.seed, FIELD_STREAM)
        for m, (fields, covered) in enumerate(made):
            yield slice(m, m + 1), math.sqrt(unit) * fields[:, None], unit * covered[:, None]

    def with_hub(m: int) -> Complex:
        return unit * mann.covariance_with(grid.hub, float(k1[m]), grid, length, mann.GAMMA)

    return Spectrum(variances, (0, 1, 2), len(some), coherent(), with_hub)


def hub_amplitudes(wind: TurbulentWind, grid: Grid, n: int) -> dict[int, Complex]:
    """Complex amplitudes (n / 2 + 1,) of the measured components at the hub, without the mean wind.

    The box is a ring in time. Where nothing was measured the series is continued by what is random under the
    condition of what was (W-21): the precision matrix of a stationary series on a ring is circulant, so the gap is the
    solution of a Toeplitz system.
    """
    series = wind.hub_series
    assert series is not None
    lead = 0.0 if wind.periodic else 0.5 * grid.width  # see WindBox
    time = wind.dt * np.arange(n) - lead / wind.speed
    known = (time >= series.time[0]) & (time <= series.time[-1])
    if not known.any():
        raise InputError(
            f"hub series: it reaches from {series.time[0]:g} s to {series.time[-1]:g} s, "
            f"the field from {time[0]:g} s to {time[-1]:g} s"
        )
    f = np.arange(1, n // 2) / (n * wind.dt)
    half = 0.5 * f[0] * target_densities(wind, grid.hub_height, f)[:3]
    result: dict[int, Complex] = {}
    for c, values in enumerate((series.u, series.v, series.w)):
        if values is None:
            continue
        variance = np.concatenate([half[c, :1], half[c], half[c, -1:]])
        fluctuation = np.interp(time, series.time, values) - (wind.speed if c == 0 else 0.0)
        result[c] = fft.rfft(_continued(fluctuation, known, variance, wind.seed, c), norm="forward")
    return result


def _continued(series: Float, known: NDArray[np.bool_], variance: Float, seed: int, component: int) -> Float:
    """A series (n,) on a ring, of given variances of its amplitudes (n / 2 + 1,), as it is where it is known."""
    if known.all():
        return series
    n = len(series)
    amplitudes = np.zeros((1, n // 2 + 1), np.complex128)
    add_noise(amplitudes, np.sqrt(variance[1:-1]), seed, 0, GAP_STREAM + component)
    free = fft.irfft(amplitudes[0], n, norm="forward")
    precision = fft.irfft(1.0 / variance, n)
    begin = int(np.flatnonzero(known & ~np.roll(known, -1))[0]) + 1  # of the gap
    gap = (begin + np.arange(n - int(known.sum()))) % n
    difference = np.where(known, series - free, 0.0)
    pull = fft.irfft(fft.rfft(difference) / variance, n)
    difference[gap] = -linalg.solve_toeplitz(precision[: len(gap)], pull[gap])
    return free + difference


AnyWind = Wind | TurbulentWind
"""What a run takes as wind."""


def realised(wind: AnyWind, turbine: Turbine, duration: float) -> Wind:
    """The wind as kernels can take it: a turbulent one becomes the field for the turbine and the run."""
    return generate_field(wind, turbine, duration) if isinstance(wind, TurbulentWind) else wind
