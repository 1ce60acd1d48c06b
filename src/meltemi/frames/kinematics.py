"""Kinematics of a sea at many places that do not move.

The motion of the water at a place over that of the surface is a smooth function of the frequency. So it is interpolated
between some tens of frequencies, the waves near each of which are summed once; places are then products of matrices.

Reference: docs/theory/frames.md (F-30 to F-34).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import InputError
from meltemi.sea.airy import WaveComponents, maccamy_fuchs, profiles, wave_number
from meltemi.sea.field import MOST_BYTES, amplitudes_at, repeats, summed, times

Float = NDArray[np.float64]
Complex = NDArray[np.complex128]

PHASE = 0.7
"""[rad] largest change of the phase of the farthest place between two of the frequencies."""
LEVELS = ((0.5, 2), (2.0, 3), (math.inf, 4))
"""Up to what range of heights [m] stretched kinematics are computed at how many; a polynomial joins them."""
SLOPE = 0.01
"""[m] distance over which the slope at still water is taken."""


@dataclass(frozen=True)
class Kinematics:
    """The water at P places over time.

    Attributes:
      dt, period: [s] time between samples, and repeat period.
      elevation: (T, P) [m] elevation of the surface above still water.
      velocity: (T, P, 3) [m/s].
      acceleration: (T, P, 3) [m/s^2], with the factors of diffraction.
      pressure: (T, P) [m] dynamic pressure over density and gravity.
    """

    dt: float
    period: float
    elevation: Float
    velocity: Float
    acceleration: Float
    pressure: Float


@dataclass(frozen=True)
class Basis:
    """Waves (F,) to which the motion of the water at a place is a linear function: all of a sea, or some of a sum.

    Attributes:
      frequency, number, x, y: frequency [rad/s], wave number [rad/m] and direction.
      real, imaginary: (F, T) [m] their complex elevation at the origin over time.
    """

    frequency: Float
    number: Float
    x: Float
    y: Float
    real: Float
    imaginary: Float

    def phase(self, place: Float) -> Complex:
        """(F,) factors of the elevation at a place."""
        return np.asarray(np.exp(-1j * self.number * (place[0] * self.x + place[1] * self.y)))

    def over_time(self, factors: Complex) -> Float:
        """(R, T) real parts of the sums with factors (R, F)."""
        result: Float = factors.real @ self.real - factors.imag @ self.imaginary
        return result

    def motion(self, place: Float, z: Float, weights: Float, depth: float, radius: float) -> tuple[Float, Float, Float]:
        """Velocity (T, 3), acceleration (T, 3) and pressure (T,) at a place (F-31).

        Args:
          z, weights: (L,), (L, T) heights, and the weights of the values there.
        """
        across, up, pressure = profiles(self.number, z, depth)
        here, w = self.phase(place), self.frequency
        factor = 0.5 * maccamy_fuchs(radius * self.number) if radius > 0.0 else 1.0
        straight = np.ptp(self.x) < 1e-9 and np.ptp(self.y) < 1e-9
        flat = [w * across * here * c for c in ((1.0,) if straight else (self.x, self.y))]
        rise = 1j * w * up * here
        rows = [*flat, rise, *(1j * w * factor * each for each in flat), 1j * w * rise, pressure * here]
        series = self.over_time(np.concatenate(rows)).reshape(len(rows), len(z), -1)
        values = (series * weights).sum(axis=1)
        if straight:
            x, y = self.x[0], self.y[0]
            u, v, a, b, p = values
            values = np.stack([x * u, y * u, v, x * a, y * a, b, p])
        return values[:3].T, values[3:6].T, values[6]


def kinematics(
    waves: WaveComponents,
    depth: float,
    place: Float,
    duration: float,
    *,
    stretching: str,
    radius: Float,
    gravity: float,
    origin: tuple[float, float] = (0.0, 0.0),
) -> Kinematics:
    """Kinematics of waves.

    Args:
      depth: [m] depth of still water.
      place: (P, 3) [m] places, z from still water.
      stretching: how the kinematics continue to the surface (``sea.conditions``).
      radius: (P,) [m] radius of an upright cylinder that diffracts the waves; 0 where it does not.
      origin: (x, y) [m] of the turbine.

    Raises:
      InputError: the kinematics would be too large.
    """
    dt, count, total = times(waves, duration)
    if 64.0 * len(place) * count > MOST_BYTES:
        raise InputError(f"sea: {count} samples at {len(place)} places are too many; shorten the run")
    reach = float(np.hypot(place[:, 0], place[:, 1]).max()) if len(place) else 0.0
    basis = _basis(waves, depth, gravity, origin, reach, (dt, count, total))
    result = Kinematics(dt, repeats(waves, dt), *(np.zeros((count, len(place), *s)) for s in ((), (3,), (3,), ())))
    for n, (x, y, z) in enumerate(place):
        level = result.elevation[:, n] = basis.over_time(basis.phase(place[n])[None])[0]
        heights = np.array([min(z, 0.0)])
        weights = np.ones((1, count))
        if stretching == "wheeler":
            wanted = np.minimum(depth * (depth + z) / (depth + level) - depth, 0.0)
            heights, weights = _levels(wanted)
        elif stretching == "extrapolation" and z > 0.0:
            heights = np.array([0.0, -SLOPE])
            weights = _polynomial(heights, np.full(count, z))
        motion = basis.motion(np.array([x, y]), heights, weights, depth, float(radius[n]))
        result.velocity[:, n], result.acceleration[:, n], result.pressure[:, n] = motion
    return result


def _levels(wanted: Float) -> tuple[Float, Float]:
    """Heights (L,) within those wanted (T,), and weights (L, T) of a polynomial through their values."""
    low, high = float(wanted.min()), float(wanted.max())
    if high - low < 1e-6:
        return np.array([high]), np.ones((1, len(wanted)))
    count = next(n for most, n in LEVELS if high - low <= most)
    points = np.cos(np.pi * (np.arange(count) + 0.5) / count)
    heights = 0.5 * (low + high) + 0.5 * (high - low) * points
    return heights, _polynomial(heights, wanted)


def _polynomial(points: Float, at: Float) -> Float:
    """(L, T) weights of Lagrange's polynomial through points (L,), or (L, T), at places (T,)."""
    rows = [[(at - b) / (a - b) for j, b in enumerate(points) if j != i] for i, a in enumerate(points)]
    return np.stack([np.prod(row, axis=0) for row in rows])


def _basis(
    waves: WaveComponents,
    depth: float,
    gravity: float,
    origin: tuple[float, float],
    reach: float,
    sampling: tuple[float, int, int | None],
) -> Basis:
    """The waves of a sea, or if all travel in one direction, those between which others are interpolated (F-32)."""
    k = wave_number(waves.frequency, depth, gravity)
    amplitude = amplitudes_at(waves, k, origin)
    w, x, y = waves.frequency, np.cos(waves.direction), np.sin(waves.direction)
    if len(w) and np.ptp(waves.direction) < 1e-9:
        low, high = float(w.min()), float(w.max())
        step = 0.05
        line = [max(low - step, 1e-3)]
        while line[-1] < high + 2.0 * step or len(line) < 4:
            # in deep water the phase over the distance r grows with 2 w r / g
            step = min(0.05 + 0.05 * line[-1], PHASE * gravity / (2.0 * max(line[-1], 0.1) * max(reach, 1.0)))
            line.append(line[-1] + step)
        nodes = np.array(line)
        if len(nodes) < len(w):
            amplitude = _shares(w, nodes) * amplitude
            w, x, y = nodes, np.full(len(nodes), x[0]), np.full(len(nodes), y[0])
            k = wave_number(w, depth, gravity)
            return Basis(w, k, x, y, *(summed(waves, each, *sampling) for each in (amplitude, -1j * amplitude)))
    each = np.diag(amplitude)
    if not len(w):  # still water
        w = k = x = y = np.ones(1)
        each = np.zeros((1, 0), dtype=np.complex128)
    return Basis(w, k, x, y, *(summed(waves, lines, *sampling) for lines in (each, -1j * each)))


def _shares(w: Float, nodes: Float) -> Float:
    """(F, M) weights of values at nodes (F,) in cubic interpolation at frequencies (M,)."""
    result = np.zeros((len(nodes), len(w)))
    four = np.clip(np.searchsorted(nodes, w) - 2, 0, len(nodes) - 4) + np.arange(4)[:, None]
    result[four, np.arange(len(w))] = _polynomial(nodes[four], w)
    return result
