"""Drop size distribution of Marshall and Palmer, and fall speed of drops.

References: Marshall and Palmer (1948), J. Meteorol. 5, 165; Atlas, Srivastava and Sekhon (1973), Rev. Geophys. 11, 1;
Palanimuthu et al. (2022), eqs (9) and (10). The latter prints the slope as 4.1 I^0.21 / cm; it is 4.1 I^-0.21 / mm,
which gives the accepted 0.09 g of water in a cubic metre at 1 mm/h, and not ten times as much.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from meltemi.core.errors import InputError

Float = NDArray[np.float64]

INTERCEPT = 8e6
"""[1/m^4] number of drops at diameter zero, in a volume and range of diameters."""
SMALLEST, LARGEST = 1e-4, 6e-3
"""[m] diameters between which the review counts drops."""
WATER = 1000.0
"""[kg/m^3] density of water."""
MM_PER_HOUR = 1e-3 / 3600.0
"""[m/s] one millimetre per hour."""


def _not_negative(name: str, value: ArrayLike, unit: str) -> Float:
    array = np.asarray(value, float)
    if not np.all(array >= 0.0):
        raise InputError(f"{name} must not be negative, found {array[~(array >= 0.0)].flat[0]:g} {unit}")
    return array


def spectrum_slope(rate: ArrayLike) -> Float:
    """Slope [1/m] of the size distribution for a rain rate [m/s]; infinite without rain.

    Raises:
      InputError: a rate is negative; so do all functions of the spectrum.
    """
    with np.errstate(divide="ignore"):
        return np.asarray(4100.0 * (_not_negative("rate", rate, "m/s") / MM_PER_HOUR) ** -0.21)


def _exponent(slope: Float, diameter: Float) -> Float:
    """Slope times diameter; infinite without rain."""
    with np.errstate(invalid="ignore"):
        return np.where(np.isinf(slope), np.inf, slope * diameter)


def drop_spectrum(diameter: ArrayLike, rate: ArrayLike) -> Float:
    """Number density of drops per diameter [1/m^4] at a diameter [m] and rain rate [m/s] (eq. 10)."""
    return np.asarray(INTERCEPT * np.exp(-_exponent(spectrum_slope(rate), _not_negative("diameter", diameter, "m"))))


def drop_count(rate: ArrayLike, smallest: float = SMALLEST, largest: float = LARGEST) -> Float:
    """Number density of drops [1/m^3] between two diameters [m], at a rain rate [m/s] (eq. 9)."""
    slope, ends = spectrum_slope(rate), (_not_negative("diameter", d, "m") for d in (smallest, largest))
    more, less = (np.exp(-_exponent(slope, end)) for end in ends)
    return np.asarray(INTERCEPT / slope * (more - less))


def water_content(
    rate: ArrayLike, water_density: float = WATER, smallest: float = SMALLEST, largest: float = LARGEST
) -> Float:
    """Liquid water content of the air [kg/m^3] at a rain rate [m/s]: the integral of density pi/6 d^3 n(d).

    From 0 to infinity it is pi density n0 / slope^4; between 0.1 and 6 mm 0.3 % less at 32 mm/h, 13 % at 709 mm/h.
    """
    slope = spectrum_slope(rate)

    def beyond(diameter: float) -> Float:  # share of the mass in larger drops
        x = _exponent(slope, _not_negative("diameter", diameter, "m"))
        with np.errstate(invalid="ignore"):  # 0 times infinity, beyond the largest drop or without rain
            share = np.exp(-x) * (1.0 + x * (1.0 + x * (0.5 + x / 6.0)))
        return np.where(np.isfinite(x), share, 0.0)

    return np.asarray(np.pi * water_density * INTERCEPT / slope**4 * (beyond(smallest) - beyond(largest)))


def mean_diameter(rate: ArrayLike) -> Float:
    """Mass-weighted mean diameter [m] at a rain rate [m/s]: 4 / slope."""
    return np.asarray(4.0 / spectrum_slope(rate))


def terminal_speed(diameter: ArrayLike) -> Float:
    """Terminal fall speed [m/s] of a drop of a diameter [m] (Atlas et al.; for 0.6 to 5.8 mm, zero below 0.11 mm).

    Raises:
      InputError: a diameter is negative.
    """
    return np.asarray(np.maximum(9.65 - 10.3 * np.exp(-600.0 * _not_negative("diameter", diameter, "m")), 0.0))
