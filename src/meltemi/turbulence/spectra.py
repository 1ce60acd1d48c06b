"""Spectra and coherence of IEC 61400-1: the editions as data, Kaimal's and von Karman's one-sided densities.

Reference: docs/theory/wind.md (W-8, W-9); IEC 61400-1 ed. 2 (1999), annex B; ed. 3 (2005), annex B, B.13 to B.16;
ed. 4 (2019), annex C.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Float = NDArray[np.float64]


@dataclass(frozen=True)
class Edition:
    """Turbulence parameters of an edition of IEC 61400-1.

    Attributes:
      scale_slope, scale_height: the scale parameter is slope times height below that height [m], constant above.
      decay: decay constant of the coherence [-].
      coherence_lengths: coherence scale of (Kaimal, von Karman) over the scale parameter.
    """

    scale_slope: float
    scale_height: float
    decay: float
    coherence_length: dict[str, float]


EDITIONS: dict[int, Edition] = {
    2: Edition(0.7, 30.0, 8.8, {"kaimal": 3.5, "vonkarman": 3.5}),
    3: Edition(0.7, 60.0, 12.0, {"kaimal": 8.1, "vonkarman": 3.5}),
    4: Edition(0.7, 60.0, 12.0, {"kaimal": 8.1, "vonkarman": 3.5}),
}
"""Editions by number. The third and later ones have no von Karman spectrum: it has the lengths of the second."""

OFFSET = 0.12
"""[-] decay of the coherence at zero frequency, times the coherence scale over the decay constant."""


@dataclass(frozen=True)
class Constants:
    """Constants of a spectrum: standard deviations of u, v, w over that of u, and lengths over the scale parameter."""

    sigmas: tuple[float, float, float]
    lengths: tuple[float, float, float]


CONSTANTS: dict[str, Constants] = {
    "kaimal": Constants((1.0, 0.8, 0.5), (8.1, 2.7, 0.66)),
    "vonkarman": Constants((1.0, 1.0, 1.0), (3.5, 3.5, 3.5)),
}


def scale_parameter(edition: int, height: float) -> float:
    """Scale parameter of turbulence, Lambda_1 [m], at a height [m] (ed. 3, eq. 5)."""
    e = EDITIONS[edition]
    return e.scale_slope * min(height, e.scale_height)


def kaimal(f: Float, speed: float, sigma: float, length: float) -> Float:
    """One-sided density [m^2/s^2/Hz] at frequencies [Hz] (ed. 3, B.14)."""
    density: Float = 4.0 * sigma**2 * length / speed / (1.0 + 6.0 * f * length / speed) ** (5.0 / 3.0)
    return density


def vonkarman_along(f: Float, speed: float, sigma: float, length: float) -> Float:
    """One-sided density [m^2/s^2/Hz] of isotropic turbulence along the wind (ed. 2, annex B)."""
    x = (f * length / speed) ** 2
    density: Float = 4.0 * sigma**2 * length / speed / (1.0 + 71.0 * x) ** (5.0 / 6.0)
    return density


def vonkarman_across(f: Float, speed: float, sigma: float, length: float) -> Float:
    """One-sided density [m^2/s^2/Hz] of isotropic turbulence across the wind (ed. 2, annex B)."""
    x = (f * length / speed) ** 2
    density: Float = 2.0 * sigma**2 * length / speed * (1.0 + 189.0 * x) / (1.0 + 71.0 * x) ** (11.0 / 6.0)
    return density


DENSITIES = {"kaimal": (kaimal, kaimal, kaimal), "vonkarman": (vonkarman_along, vonkarman_across, vonkarman_across)}


def densities(spectrum: Literal["kaimal", "vonkarman"], f: Float, speed: float, sigma: float, scale: float) -> Float:
    """(3, F) one-sided densities [m^2/s^2/Hz] of u, v, w.

    Args:
      spectrum: name of the spectrum.
      f: (F,) frequencies [Hz].
      speed: [m/s] mean wind speed.
      sigma: [m/s] standard deviation of u.
      scale: [m] scale parameter.
    """
    c = CONSTANTS[spectrum]
    parts = zip(DENSITIES[spectrum], c.sigmas, c.lengths, strict=True)
    return np.stack([density(f, speed, s * sigma, length * scale) for density, s, length in parts])


def coherence_decay(spectrum: str, edition: int, f: Float, speed: float, scale: float) -> Float:
    """Decay kappa [1/m] of the coherence exp(-kappa r) at frequencies [Hz] (ed. 3, B.16; W-9)."""
    e = EDITIONS[edition]
    kappa: Float = e.decay * np.hypot(f / speed, OFFSET / (e.coherence_length[spectrum] * scale))
    return kappa
