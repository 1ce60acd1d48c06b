"""Spectra of the sea's elevation, one-sided over the angular frequency.

Reference: docs/theory/sea.md (H-11, H-12); IEC 61400-3-1:2019, annex C.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Float = NDArray[np.float64]


def default_peak_factor(height: float, period: float) -> float:
    """Peak enhancement factor of the IEC for a significant wave height [m] and a peak period [s] (H-12)."""
    ratio = period / math.sqrt(height)
    return float(np.clip(math.exp(5.75 - 1.15 * ratio), 1.0, 5.0))


def jonswap(frequency: Float, height: float, period: float, peak_factor: float = 1.0) -> Float:
    """(M,) [m^2 s/rad] JONSWAP spectrum; a peak factor of 1 is that of Pierson and Moskowitz (H-11).

    Args:
      frequency: (M,) [rad/s] frequencies.
      height: [m] significant wave height.
      period: [s] peak period.
    """
    x = frequency * period / (2.0 * np.pi)
    width = np.where(x <= 1.0, 0.07, 0.09)
    with np.errstate(divide="ignore", over="ignore", under="ignore", invalid="ignore"):
        steep = x**-4.0
        plain = 0.3125 * height**2 * steep / np.where(frequency > 0.0, frequency, np.inf) * np.exp(-1.25 * steep)
        enhanced = peak_factor ** np.exp(-0.5 * ((x - 1.0) / width) ** 2)
    return np.asarray(np.nan_to_num((1.0 - 0.287 * math.log(peak_factor)) * plain * enhanced))
