"""Drops of rain by the exponential spectrum of Marshall and Palmer, and how fast they fall.

References: Marshall and Palmer (1948), J. Meteorol. 5, 165; Atlas, Srivastava and Sekhon (1973), Rev. Geophys. 11, 1;
Palanimuthu et al. (2022), eqs (9) and (10). The latter prints the slope as 4.1 I^0.21 / cm; it is 4.1 I^-0.21 / mm,
which gives the accepted 0.09 g of water in a cubic metre at 1 mm/h, and not ten times as much.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Float = NDArray[np.float64]

INTERCEPT = 8e6
"""[1/m^4] number of drops at diameter zero, in a volume and range of diameters."""
SMALLEST, LARGEST = 1e-4, 6e-3
"""[m] diameters between which the review counts drops."""
WATER = 1000.0
"""[kg/m^3] density of water."""
MM_PER_HOUR = 1e-3 / 3600.0
"""[m/s]."""


def spectrum_slope(rate: ArrayLike) -> Float:
    """Slope [1/m] of the spectrum for a rain rate [m/s]; infinite without rain."""
    with np.errstate(divide="ignore"):
        return np.asarray(4100.0 * (np.asarray(rate, float) / MM_PER_HOUR) ** -0.21)


def drop_spectrum(diameter: ArrayLike, rate: ArrayLike) -> Float:
    """Drops in a volume and range of diameters [1/m^4] of a diameter [m], at a rain rate [m/s] (eq. 10)."""
    return np.asarray(INTERCEPT * np.exp(-spectrum_slope(rate) * np.asarray(diameter, float)))


def drop_count(rate: ArrayLike, smallest: float = SMALLEST, largest: float = LARGEST) -> Float:
    """Drops in a volume [1/m^3] with diameters between two [m], at a rain rate [m/s] (eq. 9)."""
    slope = spectrum_slope(rate)
    return np.asarray(INTERCEPT / slope * (np.exp(-slope * smallest) - np.exp(-slope * largest)))


def water_content(
    rate: ArrayLike, water_density: float = WATER, smallest: float = SMALLEST, largest: float = LARGEST
) -> Float:
    """Mass of water in a volume of air [kg/m^3] at a rain rate [m/s]: the integral of density pi/6 d^3 n(d).

    From 0 to infinity it is pi density n0 / slope^4; between 0.1 and 6 mm 0.3 % less at 32 mm/h, 13 % at 709 mm/h.
    """
    slope = spectrum_slope(rate)

    def beyond(diameter: float) -> Float:  # share of the mass in larger drops
        x = slope * diameter
        with np.errstate(invalid="ignore"):
            share = np.exp(-x) * (1.0 + x * (1.0 + x * (0.5 + x / 6.0)))
        return np.where(np.isfinite(x), share, 0.0)

    return np.asarray(np.pi * water_density * INTERCEPT / slope**4 * (beyond(smallest) - beyond(largest)))


def mean_diameter(rate: ArrayLike) -> Float:
    """Diameter [m] in the mean by mass, at a rain rate [m/s]: 4 / slope."""
    return np.asarray(4.0 / spectrum_slope(rate))


def terminal_speed(diameter: ArrayLike) -> Float:
    """Speed [m/s] at which a drop of a diameter [m] falls (Atlas et al.; for 0.6 to 5.8 mm, zero below 0.11 mm)."""
    return np.asarray(np.maximum(9.65 - 10.3 * np.exp(-600.0 * np.asarray(diameter, float)), 0.0))
