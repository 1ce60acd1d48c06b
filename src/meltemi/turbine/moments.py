"""Integrals along blades and towers."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from meltemi.turbine.definition import BladeStructure

Float = NDArray[np.float64]


def blade_moments(structure: BladeStructure, hub_radius: float) -> tuple[float, float]:
    """Mass [kg] of a blade, and its inertia [kg m^2] about the shaft."""
    z = np.asarray(structure.position)
    mass = structure.mass if structure.mass is not None else np.asarray(structure.mass_matrix)[:, 0, 0]
    r = z + hub_radius
    # mass varies linearly between stations: Simpson's rule is exact to the second moment
    half = 0.5 * (r[1:] + r[:-1])
    middle = 0.5 * (mass[1:] + mass[:-1])
    inertia = np.diff(z) / 6.0 * (mass[:-1] * r[:-1] ** 2 + 4.0 * middle * half**2 + mass[1:] * r[1:] ** 2)
    return float(np.trapezoid(mass, z)), float(inertia.sum())


def cumulative(values: Float, at: Float) -> Float:
    """Integral from the first point on by the trapezoidal rule."""
    return np.concatenate(([0.0], np.cumsum(0.5 * (values[1:] + values[:-1]) * np.diff(at))))
