"""Synthesis of turbulent fields on a grid from a spectrum, by frequency, and by FFT in time.

Every frequency has a complex field across the wind, the sum of a coherent part, from ``exponential`` or ``mann``, and a
part that is independent from point to point. Above the frequency at which neighbours are independent there is only the
second part, which is cheap.

Reference: docs/theory/wind.md (W-7, W-12, W-20).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from meltemi.compiler import kernel
from meltemi.core.threads import one_blas_thread
from meltemi.turbulence.grid import WindGrid
from meltemi.turbulence.random import noise

Float = NDArray[np.float64]
Complex = NDArray[np.complexfloating[Any]]

POINT_STREAM = 0
"""Stream of the random numbers of points, plus the component; their other address is the point."""
FIELD_STREAM = 16
"""Stream of the random numbers of fields across the wind, plus the component; their other address is the frequency."""
GAP_STREAM = 32
"""Stream of the random numbers in gaps of a measured series, plus the component."""
POINTS_AT_ONCE = 32
"""Number of points that are transformed together."""


@dataclass(frozen=True)
class Spectrum:
    """Target spectrum of a turbulent field at frequencies m / (n dt), m = 1 ... B.

    Attributes:
      variances: (4, B) [m^2/s^2] mean squared magnitudes of the complex amplitudes of u, v, w, and of u times w
        conjugate: half the one-sided density times the frequency step.
      components: components that are coherent across the wind.
      count: number of coherent frequencies, from the lowest on.
      coherent: yields successive frequencies, fields (C, b, Z, Y) of the components, and the part of the variances
        (4, b) that the fields contain.
      column: covariances (3, 3, Z, Y) [m^2/s^2] of all points with the hub at a coherent frequency, by its number.
    """

    variances: Float
    components: tuple[int, ...]
    count: int
    coherent: Iterator[tuple[slice, Complex, Float]]
    column: Callable[[int], Complex]


@dataclass(frozen=True)
class CovarianceFactors:
    """Lower triangular factor of the spatially uncorrelated part: amplitudes (B,) of u, v, w, and u in w."""

    uu: Float
    vv: Float
    ww: Float
    wu: Float

    def of(self, component: int) -> list[tuple[int, Float]]:
        """Random number streams of a component, and their factors."""
        return [[(0, self.uu)], [(1, self.vv)], [(0, self.wu), (2, self.ww)]][component]


def factors(rest: Float) -> CovarianceFactors:
    """Cholesky factor of variances (4, B) that may be negative by rounding."""
    uu, vv = np.sqrt(np.maximum(rest[:2], 0.0))
    wu = rest[3] / np.where(uu > 0.0, uu, np.inf)
    return CovarianceFactors(uu, vv, np.sqrt(np.maximum(rest[2] - wu**2, 0.0)), wu)


@kernel
def add_noise(spectrum: Complex, factor: NDArray[np.floating[Any]], seed: int, first: int, stream: int) -> None:
    """Add independent normal numbers times ``factor`` (B,) to the spectra (P, B + 2) of points ``first`` and on.

    Entry 0 of a spectrum is its mean, the last one the Nyquist frequency; both are not changed.
    """
    count = len(factor)
    half = (count + 1) // 2
    bits = np.empty((4, half), np.uint32)
    numbers = np.empty(2 * half, np.complex64)
    for p in range(len(spectrum)):
        noise(seed, first + p, stream, bits, numbers)
        for m in range(count):
            spectrum[p, m + 1] += factor[m] * numbers[m]


@one_blas_thread
def synthesise(
    spectrum: Spectrum,
    grid: WindGrid,
    n: int,
    seed: int,
    *,
    mean: Float,
    sigmas: tuple[float | None, float | None, float | None],
    measured: Mapping[int, Complex],
    progress: Callable[[float], None],
) -> NDArray[np.float32]:
    """Synthesise the field in time.

    Args:
      spectrum: target spectrum; n / 2 - 1 frequencies.
      grid: points across the wind.
      n: even number of planes.
      seed: seed of the random numbers.
      mean: (Z, 3) [m/s] added to each row.
      sigmas: [m/s] standard deviations of u, v, w at the hub, to which a component is scaled; None: it is not scaled.
      measured: components whose amplitudes (n / 2 + 1,) at the hub are given.
      progress: callback with the completed fraction.

    Returns:
      (n, Z, Y, 3) velocities [m/s].
    """
    bins = spectrum.variances.shape[1]
    hub = grid.hub[0] * grid.points_y + grid.hub[1]
    points = grid.points_z * grid.points_y
    covered = np.zeros_like(spectrum.variances)
    coherent = np.empty((len(spectrum.components), spectrum.count, points), np.complex64)
    pull = np.zeros((3, bins), np.complex128)
    for some, fields, parts in spectrum.coherent:
        covered[:, some] = parts
        if measured:
            rest = factors(spectrum.variances[:, some] - parts)
            pull[:, some] = _condition(spectrum, some, fields, rest, measured, grid, seed, hub)
        coherent[:, some] = fields.reshape(*fields.shape[:2], points)
        progress(0.5 * some.stop / bins)
    independent = factors(spectrum.variances - covered)
    if 0 in measured:  # beyond the coherent frequencies
        alone = np.zeros((1, bins + 2), np.complex128)
        add_noise(alone, independent.uu, seed, hub, POINT_STREAM)
        late = slice(spectrum.count, None)
        pull[0, late] = (measured[0] - alone[0])[1:-1][late] / spectrum.variances[0, late]

    def put_spectra(out: NDArray[np.complex64], component: int, first: int, scale: float = 1.0) -> None:
        """Fill spectra (P, n / 2 + 1) of a component at points ``first`` and on."""
        last = first + len(out)
        out[...] = 0.0
        if component in spectrum.components:
            own = coherent[spectrum.components.index(component), :, first:last]
            np.multiply(own.T, np.float32(scale), out=out[:, 1 : spectrum.count + 1])
        for stream, factor in independent.of(component):
            if factor.any():
                add_noise(out, (scale * factor).astype(np.float32), seed, first, POINT_STREAM + stream)
        if first <= hub < last:
            if component in measured:
                out[hub - first] = measured[component]
            elif component == 2:  # its remainder is correlated with that of u, which is known now
                out[hub - first, 1:-1] += scale * independent.wu * independent.uu * pull[0]

    # in single precision, as the field is; with components innermost the transform ends in the order of the field
    spectra = np.empty((3, POINTS_AT_ONCE, bins + 2), np.complex64)
    scales = np.ones(3)
    for component, sigma in enumerate(sigmas):
        if sigma is not None and component not in measured:
            at_hub = spectra[component, :1]
            put_spectra(at_hub, component, hub)
            scales[component] = sigma / max(math.sqrt(2.0) * float(np.linalg.norm(at_hub[0, 1:-1])), 1e-300)
    velocity = np.empty((n, 3 * points), np.float32)
    means = np.repeat(mean, grid.points_y, axis=0).astype(np.float32).ravel()
    for first in range(0, points, POINTS_AT_ONCE):
        last = min(first + POINTS_AT_ONCE, points)
        for component, scale in enumerate(scales):
            put_spectra(spectra[component, : last - first], component, first, scale)
        series = fft.irfft(spectra[:, : last - first].transpose(2, 1, 0), n, axis=0, norm="forward")
        some = slice(3 * first, 3 * last)
        np.add(series.reshape(n, -1), means[some], out=velocity[:, some])
        progress(0.5 + 0.5 * last / points)
    return velocity.reshape(n, grid.points_z, grid.points_y, 3)


def _condition(
    spectrum: Spectrum,
    some: slice,
    fields: Complex,
    rest: CovarianceFactors,
    measured: Mapping[int, Complex],
    grid: WindGrid,
    seed: int,
    hub: int,
) -> Complex:
    """Condition random fields on the measurement at the hub (W-20); the hub itself is set later.

    Returns:
      (3, b) measured minus synthesised amplitudes, over their covariance: times a covariance it is the change.
    """
    given = [c for c in spectrum.components if c in measured]
    pull = np.zeros((3, some.stop - some.start), np.complex128)
    if not given:
        return pull
    at_hub = np.zeros((3, 1, spectrum.variances.shape[1] + 2), np.complex128)
    for component in given:
        for stream, factor in rest.of(component):
            whole = np.zeros(spectrum.variances.shape[1])
            whole[some] = factor
            add_noise(at_hub[component], whole, seed, hub, POINT_STREAM + stream)
    v = spectrum.variances[:, some]
    for i in range(some.stop - some.start):
        m = some.start + i
        missing = [
            measured[c][m + 1] - at_hub[c, 0, m + 1] - fields[spectrum.components.index(c), i, grid.hub[0], grid.hub[1]]
            for c in given
        ]
        pull[given, i] = np.linalg.solve(_at_point(v[:, i])[np.ix_(given, given)], np.array(missing))
        column = spectrum.column(m)
        for c, component in enumerate(spectrum.components):
            fields[c, i] += np.einsum("g,gzy->zy", pull[given, i], column[component, given])
    return pull


def _at_point(variances: Float) -> Float:
    """Covariance (3, 3) of u, v, w at a point."""
    uu, vv, ww, uw = variances
    return np.array([[uu, 0.0, uw], [0.0, vv, 0.0], [uw, 0.0, ww]])
