"""Steady Gaussian wake of a misaligned turbine: Bastankhah and Porté-Agel (2016), J. Fluid Mech. 806, 506-541.

The expansion follows the turbulence as k = 0.38 I + 0.004 (Niayifar and Porté-Agel 2016, Energies 9, 741).
"""

from __future__ import annotations

import math

import numpy as np

NEAR, TURBULENT = 0.154, 2.32
"""Constants 2 beta* and 4 alpha* of the length of the near wake, eq. (7.3) in its usual form."""


def _widths(thrust: float, misalignment: float, intensity: float, distance: float) -> tuple[float, float, float, float]:
    """Expansion, length of the near wake, and widths across and up, in rotor diameters."""
    k, cosine, root = 0.38 * intensity + 0.004, math.cos(misalignment), math.sqrt(1.0 - thrust)
    near = cosine * (1.0 + root) / (math.sqrt(2.0) * (TURBULENT * intensity + NEAR * (1.0 - root)))
    grown = k * max(distance - near, 0.0)
    return k, near, grown + cosine / math.sqrt(8.0), grown + 1.0 / math.sqrt(8.0)


def deflection(thrust: float, misalignment: float, intensity: float, distance: float) -> float:
    """Lateral deflection of the wake centre in rotor diameters, eq. (7.4); positive for a positive misalignment."""
    k, near, across, up = _widths(thrust, misalignment, intensity, distance)
    cosine, root = math.cos(misalignment), math.sqrt(1.0 - thrust)
    angle = 0.3 * misalignment / cosine * (1.0 - math.sqrt(1.0 - thrust * cosine))
    if distance <= near:
        return angle * distance
    wide, c = 1.6 * math.sqrt(8.0 * across * up / cosine), math.sqrt(thrust)
    bent = math.log((1.6 + c) * (wide - c) / ((1.6 - c) * (wide + c)))
    return angle * near + angle / 14.7 * math.sqrt(cosine / (k * k * thrust)) * (2.9 + 1.3 * root - thrust) * bent


def waked_speed(thrust: float, misalignment: float, intensity: float, distance: float) -> float:
    """Mean wind over the rotor of a turbine directly downstream, over the undisturbed wind.

    Args:
      thrust: thrust coefficient of the upstream turbine, below one.
      misalignment: [rad] yaw misalignment of the upstream turbine.
      intensity: turbulence intensity.
      distance: distance in rotor diameters, beyond the near wake.
    """
    _, _, across, up = _widths(thrust, misalignment, intensity, distance)
    shift = deflection(thrust, misalignment, intensity, distance)
    deficit = 1.0 - math.sqrt(max(1.0 - thrust * math.cos(misalignment) / (8.0 * across * up), 0.0))
    y, z = np.meshgrid(*2 * (np.linspace(-0.5, 0.5, 41),))
    inside = y * y + z * z <= 0.25
    shape = np.exp(-0.5 * ((y[inside] - shift) / across) ** 2 - 0.5 * (z[inside] / up) ** 2)
    return 1.0 - deficit * float(shape.mean())
