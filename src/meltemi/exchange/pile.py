"""Equivalent springs at the top of a monopile."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from meltemi.turbine.definition import Foundation

Float = NDArray[np.float64]


def pile_foundation(
    position: Float, bending: Float, shear: Float, axial: Float, torsion: Float, mass: Float, source: str = ""
) -> Foundation:
    """Equivalent springs and mass at the top of an upright pile that is clamped at its foot.

    The flexibility at the top is the integral of the sectional flexibilities along the pile with the lever
    z_top - z (a cantilever under end loads; shear-flexible beam). The mass that moves with the top follows from the
    static deflection under a horizontal force (Rayleigh).

    Args:
      position: (S,) [m] heights from foot to top, increasing; properties are linear in between.
      bending: (S,) [N m^2] stiffness about any horizontal axis.
      shear: (S,) [N] shear stiffness.
      axial: (S,) [N] axial stiffness.
      torsion: (S,) [N m^2] torsional stiffness.
      mass: (S,) [kg/m] mass per length.
      source: origin of the data.
    """
    x, w = np.polynomial.legendre.leggauss(4)
    half = 0.5 * np.diff(position)
    pieces = np.linspace(0.0, 1.0, 9)  # properties vary within a piece between stations: integrate finely
    left = (position[:-1, None] + 2.0 * half[:, None] * pieces[:-1]).reshape(-1)
    width = np.repeat(2.0 * half / 8.0, 8)
    z = (left[:, None] + 0.5 * width[:, None] * (1.0 + x)).reshape(-1)
    weight = (0.5 * width[:, None] * w).reshape(-1)
    EI, GA, EA, GJ, m = (np.interp(z, position, values) for values in (bending, shear, axial, torsion, mass))
    lever = position[-1] - z

    F = np.zeros((6, 6))
    F[0, 0] = F[1, 1] = np.sum(weight * (lever**2 / EI + 1.0 / GA))
    F[3, 3] = F[4, 4] = np.sum(weight / EI)
    F[0, 4] = F[4, 0] = np.sum(weight * lever / EI)  # a moment about y pushes the top along x
    F[1, 3] = F[3, 1] = -F[0, 4]
    F[2, 2] = np.sum(weight / EA)
    F[5, 5] = np.sum(weight / GJ)

    def up_to(rate: Float) -> Float:
        """Integral of ``rate`` from the foot to each point."""
        return np.cumsum(weight * rate) - 0.5 * weight * rate

    shape = up_to(up_to(lever / EI) + 1.0 / GA) / F[0, 0]  # deflection under a force at the top, over that of the top
    moving = float(np.sum(weight * m * shape**2))
    return Foundation(stiffness=np.asarray(np.linalg.inv(F), dtype=np.float64), mass=moving, source=source)
