"""Scaled tower: equal stress at rated wind speed, or a prescribed first frequency."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meltemi.studies.scaling.factors import ScalingFactors, multiply
from meltemi.turbine.definition import Tower
from meltemi.turbine.moments import cumulative

Float = NDArray[np.float64]


@dataclass(frozen=True)
class TowerTopBody:
    """Rigid body on top of the tower.

    Attributes:
      mass: [kg] mass of nacelle, rotor and parts fixed to the tower top.
      height: [m] height of its centre above the tower top.
      inertia: [kg m^2] inertia about the lateral axis through the centre.
    """

    mass: float
    height: float
    inertia: float


def scaled_tower(
    reference: Tower, factors: ScalingFactors, length: float, top: TowerTopBody, frequency: float | None
) -> dict[str, Any]:
    """Content of ``Turbine.tower``: a tube with the reference's taper and ratio of diameter to wall thickness.

    Its diameter scales with the cube root of the base moment, thrust times length: the stress at rated wind speed is
    kept. A given frequency sets the diameter instead.

    Args:
      reference: reference tower.
      factors: scaling factors.
      length: [m] length of the new tower.
      top: body on top of the tower.
      frequency: [Hz] frequency of the first fore-aft mode.
    """
    stretch = length / reference.length
    diameter = (factors.thrust * stretch) ** (1.0 / 3.0)
    tower = _tube(reference, stretch, diameter, factors.length)
    if frequency is not None:
        tower = _tube(reference, stretch, _diameter(reference, stretch, top, frequency), factors.length)
    tower["top_mass"] = reference.top_mass * factors.moment
    if abs(stretch - factors.length) > 1e-9 * stretch or frequency is not None:
        tower["mode_shapes"] = None  # they belong to the reference tower
    return tower


def first_frequency(tower: Tower, top: TowerTopBody) -> float:
    """Frequency [Hz] of the first fore-aft mode of the clamped tower by Rayleigh's quotient.

    The shape is the deflection under a horizontal force at the centre of mass of the body on top.
    """
    z = np.linspace(0.0, tower.length, 401)
    stiffness, mass = (np.interp(z, tower.position, getattr(tower, name)) for name in ("fore_aft_stiffness", "mass"))
    slope = cumulative((tower.length + top.height - z) / stiffness, z)
    deflection = cumulative(slope, z)
    at_centre = float(deflection[-1] + top.height * slope[-1])
    kinetic = top.mass * at_centre**2 + top.inertia * slope[-1] ** 2 + np.trapezoid(mass * deflection**2, z)
    return math.sqrt(at_centre / float(kinetic)) / (2.0 * math.pi)


def _diameter(reference: Tower, stretch: float, top: TowerTopBody, frequency: float) -> float:
    """Factor of the diameter for a prescribed tower frequency [Hz], which increases with it."""
    low, high = 0.01, 100.0
    for _ in range(60):
        middle = math.sqrt(low * high)
        tube = Tower.model_validate(_tube(reference, stretch, middle, 1.0))
        low, high = (low, middle) if first_frequency(tube, top) > frequency else (middle, high)
    return middle


def _tube(reference: Tower, stretch: float, diameter: float, length: float) -> dict[str, Any]:
    content = reference.content()
    multiply(content, "position", stretch)
    multiply(content, "diameter", diameter)
    multiply(content, "mass axial_stiffness shear_stiffness", diameter**2)
    multiply(content, "fore_aft_stiffness side_side_stiffness torsion_stiffness", diameter**4)
    multiply(content, "base_height", length)
    return content
