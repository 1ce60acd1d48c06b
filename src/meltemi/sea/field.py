"""Kinematics of a sea at points, by fast Fourier transform once before a run.

Reference: docs/theory/sea.md (H-21 to H-23).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import InputError
from meltemi.sea.airy import GRAVITY, WaveComponents, maccamy_fuchs, profiles, wave_number

Float = NDArray[np.float64]
Complex = NDArray[np.complex128]

STEP, PHASE = 0.25, 1.0
"""Longest step [s] of a field, and largest phase [rad] of its fastest wave over a step (H-22)."""
AHEAD, BEHIND = 1, 2
"""Numbers of samples before and after an interval that the cubic interpolation uses."""
MOST_BYTES = 2e9


@dataclass(frozen=True)
class SeaField:
    """Kinematics at points over time.

    Attributes:
      dt: [s] time between samples; the first is ``AHEAD`` samples before time 0.
      period: [s] repeat period, 1e30 if they do not.
      elevation: (T,) [m] elevation at the origin.
      velocity: (T, P, 2) [m/s] along x and y.
      acceleration: (T, P, 2) [m/s^2], including the factors of diffraction.
    """

    dt: float
    period: float
    elevation: Float
    velocity: Float
    acceleration: Float


def sea_field(
    waves: WaveComponents,
    depth: float,
    z: Float,
    duration: float,
    *,
    radius: Float | None = None,
    slope: bool = False,
    gravity: float = GRAVITY,
    origin: tuple[float, float] = (0.0, 0.0),
) -> SeaField:
    """Kinematics of waves at points of a vertical line.

    Args:
      depth: [m] depth of the still water.
      z: (P,) [m] heights from still water, at most 0.
      duration: [s] duration of the run.
      radius: (P,) [m] radius of a vertical cylinder that diffracts the waves (H-9); 0 where it does not. The
        accelerations become those that, with an inertia coefficient of 2, give its load.
      slope: add a last point, whose values are the vertical derivatives at still water.
      origin: (x, y) [m] position of the line.

    Raises:
      InputError: the field would be too large.
    """
    w, k = waves.frequency, wave_number(waves.frequency, depth, gravity)
    dt, count, total = times(waves, duration)
    columns = 1 + 4 * (len(z) + slope)
    if 8.0 * columns * count > MOST_BYTES:
        raise InputError(f"sea: {count} samples at {len(z)} points are too many; shorten sea.repeat or the run")
    amplitude = amplitudes_at(waves, k, origin)
    across, _, _ = profiles(k, z, depth)
    diffracted: Complex = np.ones((len(z), len(w)), dtype=np.complex128)
    if radius is not None:
        some = radius > 0.0
        diffracted[some] = 0.5 * maccamy_fuchs(np.outer(radius[some], k))
    if slope:
        across, diffracted = np.vstack([across, k]), np.vstack([diffracted, np.ones(len(w))])
    velocity = across * w * amplitude
    acceleration = 1j * w * velocity * diffracted
    x, y = np.cos(waves.direction), np.sin(waves.direction)
    lines = np.concatenate([amplitude[None], velocity * x, velocity * y, acceleration * x, acceleration * y])
    series = summed(waves, lines, dt, count, total)
    u, v, a, b = series[1:].reshape(4, -1, count)
    velocities, accelerations = np.stack([u.T, v.T], axis=-1), np.stack([a.T, b.T], axis=-1)
    return SeaField(dt, repeats(waves, dt), np.ascontiguousarray(series[0]), velocities, accelerations)


def amplitudes_at(waves: WaveComponents, k: Float, origin: tuple[float, float]) -> Complex:
    """(M,) [m] complex amplitudes of waves with wave numbers k (M,) [rad/m] at a place (x, y) [m]."""
    place = origin[0] * np.cos(waves.direction) + origin[1] * np.sin(waves.direction)
    return np.asarray(waves.amplitude * np.exp(-1j * k * place))


def repeats(waves: WaveComponents, dt: float) -> float:
    """Period [s] of samples in steps of ``dt`` [s]; 1e30 if they do not repeat."""
    if not len(waves.frequency):
        return dt
    return 1e30 if waves.period is None else waves.period


def times(waves: WaveComponents, duration: float, sums: bool = False) -> tuple[float, int, int | None]:
    """Step [s], number of samples, and samples in a period; None where the waves are summed individually.

    Args:
      duration: [s] duration of the run; sums: whether there are also sum frequencies.
    """
    if not len(waves.frequency):
        return 1.0, AHEAD + BEHIND + 1, None
    longest = min(STEP, PHASE / ((1.0 + sums) * float(waves.frequency.max())))
    if waves.period is None:
        return longest, math.ceil(duration / longest) + AHEAD + BEHIND + 1, None
    from scipy.fft import next_fast_len

    if len(waves.frequency) == 1:
        longest = min(longest, waves.period / 64.0)
    total = next_fast_len(math.ceil(waves.period / longest), real=True)
    dt = waves.period / total
    whole = min(total, math.ceil(duration / dt) + 1)
    return dt, whole + AHEAD + BEHIND + 1, total


def summed(waves: WaveComponents, lines: Complex, dt: float, count: int, total: int | None) -> Float:
    """(L, count) real parts of the sums of waves with complex amplitudes (L, M), from ``AHEAD`` samples before 0."""
    number = np.arange(count) - AHEAD
    if total is None:
        result = np.zeros((len(lines), count))
        if len(waves.frequency):
            for part in np.array_split(number, max(1, count // 512)):
                turning = np.exp(1j * np.outer(waves.frequency, dt * part))
                result[:, part[0] + AHEAD : part[-1] + AHEAD + 1] = (lines @ turning).real
        return result
    from scipy.fft import irfft

    assert waves.period is not None
    bins = np.round(waves.frequency * waves.period / (2.0 * np.pi)).astype(int)
    result, spectrum = np.empty((len(lines), count)), np.zeros(total // 2 + 1, dtype=np.complex128)
    for line, row in zip(lines, result, strict=True):
        spectrum[:] = 0.0
        np.add.at(spectrum, bins, line)
        row[:] = irfft(spectrum * (0.5 * total), n=total)[number % total]
    return result
