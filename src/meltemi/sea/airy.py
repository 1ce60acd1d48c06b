"""Linear waves over a plane sea bed (Airy): dispersion, kinematics, diffraction by a vertical cylinder.

Reference: docs/theory/sea.md (H-1 to H-9); Dean & Dalrymple (1991), chapter 3; MacCamy & Fuchs (1954).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Float = NDArray[np.float64]
Complex = NDArray[np.complex128]

GRAVITY = 9.80665
"""[m/s^2] gravitational acceleration."""


@dataclass(frozen=True)
class WaveComponents:
    """Wave components whose sum is a sea (H-1).

    Attributes:
      frequency: (M,) [rad/s] frequencies above zero.
      amplitude: (M,) [m] complex: modulus, and phase at the origin at time 0.
      direction: (M,) [rad] direction of travel, counter-clockwise from above from the x axis.
      period: [s] repeat period of the sum: all frequencies are multiples of 2 pi over it; None if it does not.
    """

    frequency: Float
    amplitude: Complex
    direction: Float
    period: float | None


def wave_number(frequency: Float, depth: float, gravity: float = GRAVITY) -> Float:
    """(M,) [rad/m] wave numbers k of frequencies (M,) [rad/s]: w^2 = g k tanh(k h) (H-2), by Newton's method."""
    deep = np.asarray(frequency, dtype=np.float64) ** 2 * depth / gravity
    x = deep / np.sqrt(np.tanh(np.maximum(deep, 1e-12)))  # Eckart (1952), within 5 %
    for _ in range(6):
        t = np.tanh(x)
        x -= (x * t - deep) / (t + x * (1.0 - t * t) + 1e-300)
    return np.asarray(x / depth)


def profiles(k: Float, z: Float, depth: float) -> tuple[Float, Float, Float]:
    """Decay with depth of the horizontal and vertical velocity and of the dynamic pressure (H-4), stable in deep water.

    Args:
      k: (M,) [rad/m]; z: (P,) [m] from the still water, at most 0.

    Returns:
      (P, M) each: cosh k(z+h) / sinh kh, sinh k(z+h) / sinh kh, cosh k(z+h) / cosh kh.
    """
    down, up, bed = np.exp(np.outer(z, k)), np.exp(-np.outer(z + 2.0 * depth, k)), np.exp(-2.0 * k * depth)
    return (down + up) / (1.0 - bed), (down - up) / (1.0 - bed), (down + up) / (1.0 + bed)


def maccamy_fuchs(ka: Float) -> Complex:
    """Inertia coefficient of a vertical cylinder, with the phase of its force, over wave number times radius (H-9)."""
    from scipy.special import h2vp

    x = np.maximum(ka, 1e-6)
    return np.asarray(-4j / (np.pi * x * x * h2vp(1, x)))
