"""Potential-flow coefficients of a platform.

Reference: docs/theory/floating.md (W-1, W-2, W-43, W-44).
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from meltemi.structure.beam import transfer

Float = NDArray[np.float64]
Complex = NDArray[np.complex128]
NONE, NO_FORCE = np.zeros(0), np.zeros((0, 0, 0, 6), dtype=np.complex128)


@dataclass(frozen=True)
class HydroCoefficients:
    """Coefficients over water density, and gravity where they have it, about a point at still water.

    Those of N bodies have 6N motions in place of 6, and no forces of second order.

    Attributes:
      frequency: (F,) [rad/s] increasing.
      added_mass: (F, 6, 6) [m^3 .. m^5] added mass over density.
      damping: (F, 6, 6) [m^3/s ..] radiation damping over density.
      infinite: (6, 6) added mass over density at infinite frequency.
      heading: (H,) [deg] direction of the waves' travel, counter-clockwise from x, increasing.
      excitation: (F, H, 6) force per wave amplitude over density and gravity, e^{+i w t}.
      hydrostatic: (6, 6) stiffness over density and gravity, without weight.
      drift_frequency: (D,) [rad/s]; drift: (N, D, D, 6) difference-frequency force per amplitude squared over density
        and gravity at increasing headings ``drift_heading`` (N,) [deg]; none if D and N are 0.
      sums_frequency, sums, sums_heading: the same at sum frequencies.
    """

    frequency: Float
    added_mass: Float
    damping: Float
    infinite: Float
    heading: Float
    excitation: Complex
    hydrostatic: Float
    drift_frequency: Float = field(default_factory=lambda: NONE)
    drift: Complex = field(default_factory=lambda: NO_FORCE)
    drift_heading: Float = field(default_factory=lambda: NONE)
    sums_frequency: Float = field(default_factory=lambda: NONE)
    sums: Complex = field(default_factory=lambda: NO_FORCE)
    sums_heading: Float = field(default_factory=lambda: NONE)


def tilt_stiffness(place: Float, force: float) -> Float:
    """(6, 6) stiffness of a vertical force at a place (3,) of the body, about the body's point (W-44)."""
    x, y, z = place
    C = np.zeros((6, 6))
    C[3, 3], C[4, 4], C[3, 5], C[4, 5] = force * z, force * z, -force * x, -force * y
    return C


def about_still_water(c: HydroCoefficients, centre: Float, volume: Float | float) -> HydroCoefficients:
    """Coefficients of first order about the origin, from those about another point of the body, or about one of each of
    N bodies that are rigidly connected (W-43, W-44).

    Args:
      c: coefficients without forces of second order.
      centre: (3,) or (N, 3) [m] centre of rotation of the motions of ``c``.
      volume: (N,) [m^3] volume of the displaced water.
    """
    centres, volumes = np.reshape(centre, (-1, 3)), np.ravel(volume)
    T = transfer(centres).reshape(-1, 6)
    added, damping, infinite, C = (T.T @ each @ T for each in (c.added_mass, c.damping, c.infinite, c.hydrostatic))
    stiffness = C + sum(map(tilt_stiffness, centres, volumes))
    return replace(
        c, added_mass=added, damping=damping, infinite=infinite, excitation=c.excitation @ T, hydrostatic=stiffness
    )
