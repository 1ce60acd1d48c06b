"""Turbulent wind boxes: Kaimal spectra with the exponential coherence of IEC 61400-1.

The longitudinal component is coherent across the grid, the lateral and vertical ones are
independent from point to point, as in TurbSim's IECKAI. Method of Veers (1988): at each frequency the
matrix of cross-spectra is factorised and drives independent phases. Where neighbouring points no longer
know of each other the matrix is the identity and costs nothing.

Reference: docs/theory/wind.md (W-7 to W-10); IEC 61400-1 ed. 3, B.14 to B.16; Veers (1988), SAND88-0152.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import InputError
from meltemi.core.threads import one_blas_thread
from meltemi.wind.fields import WindBox

Float = NDArray[np.float64]

DECAY = 12.0
"""Coherence decay of edition 3."""
SCALE_LIMIT, SCALE_SLOPE, SCALE_HEIGHT = 42.0, 0.7, 60.0
"""Longitudinal scale parameter: 0.7 z below 60 m, 42 m above."""
INTEGRAL_SCALES = (8.1, 2.7, 0.66)
"""Integral scales of u, v, w over the scale parameter."""
COMPONENT_SIGMAS = (1.0, 0.8, 0.5)
"""Standard deviations of u, v, w over that of u."""
INCOHERENT = 1e-3
"""Coherence of neighbouring points below which they are taken as independent."""
MOST_POINTS = 3e8
"""Points in space and time of a field; they take 12 bytes each, and three times that while it is made."""
CHUNK = 32
"""Frequencies factorised at once."""


@one_blas_thread
def turbulence(
    speed: float,
    intensity: float,
    *,
    hub_height: float,
    rotor_diameter: float,
    duration: float,
    seed: int = 1,
    shear_exponent: float = 0.2,
    points: int = 15,
    dt: float = 0.1,
) -> WindBox:
    """A turbulent field that covers a rotor for a while.

    Args:
      speed: [m/s] mean at hub height.
      intensity: standard deviation of u over the mean speed at hub height [-].
      hub_height: [m].
      rotor_diameter: [m]; the square grid is 20 % larger.
      duration: [s] of the run it is for; the box is longer by what passes before and after.
      seed: the same seed gives the same field.
      shear_exponent: of the mean wind.
      points: grid points across and up.
      dt: [s] between planes.

    Raises:
      InputError: an argument is not sensible.
    """
    for name, value in (("speed", speed), ("hub_height", hub_height), ("rotor_diameter", rotor_diameter), ("dt", dt)):
        if not (math.isfinite(value) and value > 0.0):
            raise InputError(f"turbulence: {name} must be positive, found {value!r}")
    for name, count, least, most in (("seed", seed, 0, 2**64 - 1), ("points", points, 2, 41)):
        if not isinstance(count, int | np.integer) or not least <= count <= most:
            raise InputError(f"turbulence: {name} must be an integer between {least} and {most}, found {count!r}")
    if not -1.0 < shear_exponent < 1.0:
        raise InputError(f"turbulence: shear_exponent must be between -1 and 1, found {shear_exponent!r}")
    if not 0.0 <= intensity < 1.0:
        raise InputError(f"turbulence: intensity must be between 0 and 1 (0.14 is 14 %), found {intensity!r}")
    if not (math.isfinite(duration) and duration > 0.0):
        raise InputError(f"turbulence: duration must be positive, found {duration!r}")
    width = 1.2 * rotor_diameter
    bottom = hub_height - 0.5 * width
    if bottom <= 0.0:
        width = 2.0 * (hub_height - 1.0)
        bottom = 1.0
        if width < rotor_diameter:
            raise InputError("turbulence: the rotor comes too close to the ground for a grid around it")
    step = width / (points - 1)
    planes = (duration + 1.5 * width / speed + 2.0) / dt
    if planes * points**2 > MOST_POINTS:
        raise InputError(
            f"turbulence: a field of {planes:.3g} planes with {points} x {points} points does not fit into memory: "
            "a higher speed, a shorter duration, fewer points or a larger dt make it smaller"
        )
    n = 2 * math.ceil(planes / 2.0)
    y = -0.5 * width + step * np.arange(points)
    z = bottom + step * np.arange(points)
    grid_y, grid_z = (a.ravel() for a in np.meshgrid(y, z))
    distance = np.hypot(grid_y[:, None] - grid_y, grid_z[:, None] - grid_z)
    rng = np.random.Generator(np.random.Philox(seed))
    frequency = np.arange(1, n // 2 + 1) / (n * dt)
    scale = min(SCALE_SLOPE * hub_height, SCALE_LIMIT)
    velocity = np.empty((n, points * points, 3), dtype=np.float32)
    for component in range(3):
        sigma = COMPONENT_SIGMAS[component] * intensity * speed
        amplitude = _amplitudes(frequency, speed, sigma, INTEGRAL_SCALES[component] * scale, n * dt)
        spectrum = np.exp(2j * np.pi * rng.random((n // 2, points * points)))
        if component == 0:
            _correlate(spectrum, frequency, distance, speed, INTEGRAL_SCALES[0] * scale)
        spectrum *= amplitude[:, None]
        whole = np.concatenate([np.zeros((1, points * points)), spectrum])
        series = np.fft.irfft(whole, n=n, axis=0) * n
        # the hub's standard deviation is met exactly
        centre = points * (points // 2) + points // 2
        velocity[:, :, component] = series * (sigma / max(float(series[:, centre].std()), 1e-12))
    velocity[:, :, 0] += (speed * (grid_z / hub_height) ** shear_exponent).astype(np.float32)
    return WindBox(
        velocity=velocity.reshape(n, points, points, 3),
        dt=dt,
        dy=step,
        dz=step,
        bottom=bottom,
        speed=speed,
        hub_height=hub_height,
        periodic=True,
        source=(
            f"Kaimal turbulence {speed:g} m/s, intensity {intensity:g}, seed {seed}, "
            f"shear exponent {shear_exponent:g}, {points} x {points} points, every {dt:g} s, {n * dt:g} s"
        ),
    )


def _amplitudes(f: Float, speed: float, sigma: float, length: float, duration: float) -> Float:
    """Half the amplitude of each Fourier component of a Kaimal spectrum (W-7)."""
    x = f * length / speed
    density = sigma**2 * 4.0 * length / speed / (1.0 + 6.0 * x) ** (5.0 / 3.0)
    result: Float = np.sqrt(0.5 * density / duration)
    return result


def _correlate(spectrum: NDArray[np.complex128], f: Float, distance: Float, speed: float, length: float) -> None:
    """Give independent phases the coherence of the longitudinal component, in place (W-8, W-9)."""
    spacing = float(np.min(distance[distance > 0.0]))
    for i in range(0, len(f), CHUNK):
        some = f[i : i + CHUNK]
        decay = DECAY * np.sqrt((some / speed) ** 2 + (0.12 / length) ** 2)
        if math.exp(-float(decay[0]) * spacing) < INCOHERENT:
            break
        coherence = np.exp(-decay[:, None, None] * distance)
        factor = np.linalg.cholesky(coherence)
        spectrum[i : i + CHUNK] = np.einsum("fij,fj->fi", factor, spectrum[i : i + CHUNK])
