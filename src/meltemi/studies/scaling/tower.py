"""Scaled tower: equal stress at rated wind speed, or a prescribed first frequency."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meltemi.studies.scaling.factors import Factors, multiply
from meltemi.turbine.definition import Tower
from meltemi.turbine.moments import cumulative

Float = NDArray[np.float64]


@dataclass(frozen=True)
class Top:
    """Rigid body on top of the tower.

    Attributes:
      mass: [kg] of nacelle, rotor and what is fixed to the tower top.
      height: [m] of its centre above the tower top.
      inertia: [kg m^2] about the lateral axis through the centre.
    """

    mass: float
    height: float
    inertia: float


def scaled_tower(
    reference: Tower, factors: Factors, length: float, top: Top, frequency: float | None
) -> dict[str, Any]:
    """Content of ``Turbine.tower``: a tube with the reference's taper and ratio of diameter to wall thickness.

    Its diameter goes with the cube root of the base moment, thrust times length: the stress in rated wind is kept. A
    frequency asks for another diameter.

    Args:
      reference: the tower that is scaled.
      factors: of the new turbine.
      length: [m] of the new tower.
      top: what it carries.
      frequency: [Hz] of the first fore-aft mode.
    """
    stretch = length / reference.length
    diameter = (factors.thrust * stretch) ** (1.0 / 3.0)
    made = _tube(reference, stretch, diameter, factors.length)
    if frequency is not None:
        made = _tube(reference, stretch, _diameter(reference, stretch, top, frequency), factors.length)
    made["top_mass"] = reference.top_mass * factors.moment
    if abs(stretch - factors.length) > 1e-9 * stretch or frequency is not None:
        made["mode_shapes"] = None  # those of another tower
    return made


def first_frequency(tower: Tower, top: Top) -> float:
    """[Hz] of the first fore-aft mode of the clamped tower by Rayleigh's quotient.

    The shape is that of a horizontal force in the centre of mass of what the tower carries.
    """
    z = np.linspace(0.0, tower.length, 401)
    stiffness, mass = (np.interp(z, tower.position, getattr(tower, name)) for name in ("fore_aft_stiffness", "mass"))
    slope = cumulative((tower.length + top.height - z) / stiffness, z)
    deflection = cumulative(slope, z)
    at_centre = float(deflection[-1] + top.height * slope[-1])
    kinetic = top.mass * at_centre**2 + top.inertia * slope[-1] ** 2 + np.trapezoid(mass * deflection**2, z)
    return math.sqrt(at_centre / float(kinetic)) / (2.0 * math.pi)


def _diameter(reference: Tower, stretch: float, top: Top, frequency: float) -> float:
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
