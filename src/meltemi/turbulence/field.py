"""Generation of turbulent fields from a wind description, a grid and a duration.

Reference: docs/theory/wind.md (W-7 to W-22).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import InputError
from meltemi.simulation.operating_point import steady_wind
from meltemi.turbulence import exponential, mann
from meltemi.turbulence.grid import WindGrid, wind_grid_for
from meltemi.turbulence.measured import hub_amplitudes
from meltemi.turbulence.spectra import coherence_decay
from meltemi.turbulence.synthesis import FIELD_STREAM, Spectrum, synthesise
from meltemi.turbulence.targets import amplitude_variances, length_scale, mann_length, sigmas
from meltemi.wind.fields import WindBox
from meltemi.wind.turbulent import TurbulentWind

if TYPE_CHECKING:
    from meltemi.turbine.power_turbine import AnyTurbine

Float = NDArray[np.float64]
Complex = NDArray[np.complexfloating[Any]]

MOST_POINTS = 3e8
"""Largest number of points in space and time of a field; they take 12 bytes each."""
MARGIN = 1.0
"""[s] of wind before and after the part that passes the turbine."""


def generate_field(
    wind: TurbulentWind,
    size: AnyTurbine | WindGrid,
    duration: float,
    progress: Callable[[float], None] = lambda share: None,
) -> WindBox:
    """Generate the field of a turbulent wind.

    Args:
      wind: turbulent wind.
      size: the grid, or a turbine, whose rotor and tower the grid then covers.
      duration: [s] duration of the run.
      progress: callback with the completed fraction.

    Raises:
      InputError: the field does not fit into memory, or the rotor is too close to the ground.
    """
    grid = size if isinstance(size, WindGrid) else wind_grid_for(size, wind.points)
    planes = plane_count(wind, grid, duration)
    n = max(2 * round(0.5 * planes), 4) if wind.periodic else exponential.even_fast(math.ceil(planes), real=True)
    mean = mean_profile(wind, grid.z, grid.hub_height)
    measured = hub_amplitudes(wind, grid, n) if wind.hub_series is not None else {}
    for component, amplitudes in measured.items():  # the mean of the measurement belongs to the mean wind
        mean[:, component] += amplitudes[0].real * (mean[:, 0] / wind.speed if component == 0 else 1.0)
        amplitudes[0] = 0.0
    velocity = synthesise(
        spectrum_of(wind, grid, n),
        grid,
        n,
        wind.seed,
        mean=mean,
        sigmas=sigmas(wind) if wind.scaled else (None, None, None),
        measured=measured,
        progress=progress,
    )
    return box_of(wind, grid, velocity, wind.label)


def plane_count(wind: TurbulentWind, grid: WindGrid, duration: float, fields: int = 1) -> float:
    """Number of planes, not rounded, that cover a run of a duration [s].

    Raises:
      InputError: the duration is not positive, or that many fields do not fit into memory.
    """
    if not (math.isfinite(duration) and duration > 0.0):
        raise InputError(f"turbulence: duration must be positive, found {duration!r}")
    passes = 0.0 if wind.periodic else 1.5 * grid.width / wind.speed + 2.0 * MARGIN
    planes = (duration + passes) / wind.dt
    if fields * planes * grid.points_y * grid.points_z > MOST_POINTS:
        raise InputError(
            f"turbulence: a field of {planes:.3g} planes with {grid.points_z} x {grid.points_y} points does not fit "
            f"into memory{'' if fields == 1 else f' {fields} times'}: a higher speed, a shorter duration, fewer points "
            "or a larger dt reduce its size"
        )
    return planes


def box_of(wind: TurbulentWind, grid: WindGrid, velocity: NDArray[np.float32], source: str) -> WindBox:
    """The field of velocities (T, Z, Y, 3) [m/s] at the points of a grid."""
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
        mean=steady_wind(wind, grid.hub_height) if wind.hub_series is None else None,
        source=source,
    )


def mean_profile(wind: TurbulentWind, z: Float, hub_height: float) -> Float:
    """(Z, 3) [m/s] mean wind at heights ``z`` (Z,) [m], in the axes of the box."""
    if wind.roughness > 0.0:
        speed = wind.speed * np.maximum(np.log(z / wind.roughness) / math.log(hub_height / wind.roughness), 0.0)
    else:
        speed = wind.speed * (z / hub_height) ** wind.shear_exponent
    turned = wind.veer * (z - hub_height)
    return np.stack([speed * np.cos(turned), -speed * np.sin(turned), speed * math.tan(wind.upflow)], axis=1)


def spectrum_of(wind: TurbulentWind, grid: WindGrid, n: int) -> Spectrum:
    """Target spectrum of a wind's field at the frequencies of ``n`` planes."""
    f, variances = amplitude_variances(wind, grid.hub_height, n)
    return (_mann if wind.spectrum == "mann" else _exponential)(wind, grid, f, variances)


def _exponential(wind: TurbulentWind, grid: WindGrid, f: Float, variances: Float) -> Spectrum:
    kappa = coherence_decay(wind.spectrum, wind.edition, f, wind.speed, length_scale(wind, grid.hub_height))
    some = kappa[kappa * min(grid.dy, grid.dz) < exponential.REACH]
    components = (0,) if wind.coherent == "u" else (0, 1, 2)
    row, column = grid.hub
    to_hub = np.hypot((grid.z - grid.z[row])[:, None], grid.y - grid.y[column])

    def coherent() -> Iterator[tuple[slice, Complex, Float]]:
        addresses = [(wind.seed, FIELD_STREAM + c) for c in components]
        for bins, fields in exponential.coherent_fields(some, grid, addresses):
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


def _mann(wind: TurbulentWind, grid: WindGrid, f: Float, variances: Float) -> Spectrum:
    length = mann_length(wind, grid.hub_height)
    k1 = 2.0 * np.pi * f * length / wind.speed
    some = k1[k1 * min(grid.dy, grid.dz) < mann.INDEPENDENT * length]
    point = mann.one_point(mann.GAMMA)
    unit = wind.intensity**2 * wind.speed**2 / point.variances[0] * k1[0]  # variance of a step of k1

    def coherent() -> Iterator[tuple[slice, Complex, Float]]:
        velocities = mann.sheared_fields(some, grid, length, mann.GAMMA, wind.seed, FIELD_STREAM)
        for m, (fields, covered) in enumerate(velocities):
            yield slice(m, m + 1), math.sqrt(unit) * fields[:, None], unit * covered[:, None]

    def with_hub(m: int) -> Complex:
        return unit * mann.covariance_with(grid.hub, float(k1[m]), grid, length, mann.GAMMA)

    return Spectrum(variances, (0, 1, 2), len(some), coherent(), with_hub)
