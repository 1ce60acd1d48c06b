"""Targets of a turbulent wind: standard deviations, spectra, coherence.

Reference: docs/theory/wind.md (W-8, W-9, W-13 to W-19).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from meltemi.turbulence import mann
from meltemi.turbulence.spectra import CONSTANTS, coherence_decay, densities, scale_parameter
from meltemi.wind.turbulent import TurbulentWind

Float = NDArray[np.float64]

CUTOFF = 25.0
"""Largest wave number across the wind over hypot(k1, 1) in the integral of a target coherence."""
INCOHERENT = 10.0
"""Wave number along the wind times separation above which Mann's coherence is negligible."""


def sigmas(wind: TurbulentWind) -> tuple[float, float, float]:
    """Standard deviations [m/s] of u, v, w of the target spectra."""
    sigma = wind.intensity * wind.speed
    if wind.spectrum == "mann":
        u, v, w = np.sqrt(mann.one_point(mann.GAMMA).variances[:3])
        return sigma, float(sigma * v / u), float(sigma * w / u)
    u, v, w = CONSTANTS[wind.spectrum].sigmas
    return u * sigma, v * sigma, w * sigma


def length_scale(wind: TurbulentWind, hub_height: float) -> float:
    """Scale parameter [m] of the edition, times the factor of the wind."""
    return wind.length_factor * scale_parameter(wind.edition, hub_height)


def mann_length(wind: TurbulentWind, hub_height: float) -> float:
    """Length L [m] of Mann's model."""
    return mann.LENGTH * length_scale(wind, hub_height)


def target_densities(wind: TurbulentWind, hub_height: float, f: Float) -> Float:
    """(4, F) one-sided densities [m^2/s^2/Hz] of u, v, w and the co-spectrum uw, at frequencies [Hz] above 0."""
    scale = length_scale(wind, hub_height)
    sigma = wind.intensity * wind.speed
    if wind.spectrum != "mann":
        return np.vstack([densities(wind.spectrum, f, wind.speed, sigma, scale), np.zeros_like(f)])
    point = mann.one_point(mann.GAMMA)
    factor = 2.0 * np.pi * mann_length(wind, hub_height) / wind.speed
    return 2.0 * sigma**2 / point.variances[0] * factor * point(factor * f)


def amplitude_variances(wind: TurbulentWind, hub_height: float, n: int) -> tuple[Float, Float]:
    """(B,) frequencies [Hz] of ``n`` planes, and (4, B) variances [m^2/s^2] of their amplitudes (W-7)."""
    f = np.arange(1, n // 2) / (n * wind.dt)
    return f, 0.5 * f[0] * target_densities(wind, hub_height, f)


def target_coherence(wind: TurbulentWind, hub_height: float, f: Float, dy: float, dz: float = 0.0) -> Float:
    """Target of the real part of the coherence of two points of a field.

    Mann's is the tensor's integral over the wave vectors across the wind (W-14), on wave numbers graded for the
    separation; the part beyond CUTOFF counts as incoherent, which makes it too small by less than 0.01.

    Args:
      wind: turbulent wind.
      hub_height: [m] hub height, for the length scales.
      f: (F,) [Hz] above 0.
      dy, dz: [m] distances of the points.

    Returns:
      (3, F) [-] of u, v, w.
    """
    f = np.asarray(f, np.float64)
    apart = math.hypot(dy, dz)
    if apart == 0.0:
        return np.ones((3, len(f)))
    scale = length_scale(wind, hub_height)
    result = np.zeros((3, len(f)))
    if wind.spectrum != "mann":
        components = 1 if wind.coherent == "u" else 3
        result[:components] = np.exp(-coherence_decay(wind.spectrum, wind.edition, f, wind.speed, scale) * apart)
        return result
    length = mann_length(wind, hub_height)
    k1 = 2.0 * np.pi * f * length / wind.speed
    point = mann.one_point(mann.GAMMA)(k1)
    y, z = abs(dy) / length, abs(dz) / length
    for m in np.flatnonzero(k1 * apart < INCOHERENT * length):
        k = float(k1[m])
        highest = CUTOFF * math.hypot(k, 1.0)
        (k3, weight_3), (k2, weight_2) = mann.graded(k, highest, z), mann.graded(k, highest, y)
        k2, weight_2 = k2[len(k2) // 2 :], 2.0 * weight_2[len(k2) // 2 :]  # auto-spectra are even in k2
        phi = np.empty((3, 3, len(k3), len(k2)))
        mann.tensor(-k, k3, k2, mann.lifetimes(mann.GAMMA), phi)
        for c in range(3):
            result[c, m] = (weight_3 * np.cos(k3 * z)) @ phi[c, c] @ (weight_2 * np.cos(k2 * y)) / point[c, m]
    return result
