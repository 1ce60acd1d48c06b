"""Scaled blade: outer shape of the optimum rotor, wall thickness for equal strain."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from meltemi.studies.scaling.factors import ScalingFactors, multiply
from meltemi.turbine.definition import Turbine

Float = NDArray[np.float64]

AREA = "mass axial_stiffness"
"""Properties of a thin-walled section that are proportional to its size and its wall thickness."""
SECOND_MOMENT = "flap_stiffness edge_stiffness torsion_stiffness flap_inertia edge_inertia"
"""Properties that are proportional to the cube of its size and to its wall thickness."""
STIFFNESS = "axial_stiffness flap_stiffness edge_stiffness torsion_stiffness stiffness_matrix"


def scaled_blade(
    reference: Turbine, factors: ScalingFactors, blade_mass: float | None, stiffness: float
) -> dict[str, Any]:
    """Content of ``Turbine.blade``.

    A section is s c times as large as in the reference: s from geometric similarity, c from the design tip-speed ratio.
    Its walls are s w times as thick, with w = (moment / s^3) / c^2, which keeps the strain under the flapwise moment at
    rated wind speed. A given mass sets w instead, for mass and stiffness alike, and thus keeps the frequencies.
    All stiffness may be multiplied by a factor: stiffer material of the same mass.

    Args:
      reference: reference turbine.
      factors: scaling factors.
      blade_mass: [kg] mass of the new blade.
      stiffness: further factor of all stiffness.
    """
    content = reference.blade.content()
    aero, structure = content["aerodynamics"], content["structure"]
    s, radius = factors.length, reference.rotor_radius

    def share(part: dict[str, Any]) -> Float:
        return (np.asarray(part["position"]) + reference.hub.radius) / radius

    size = s * factors.chord(share(aero))
    multiply(aero, "chord centre_x centre_y", size)
    c = factors.chord(share(structure))
    wall = s * factors.pressure / c**2
    _sections(structure, s * c, wall)
    if blade_mass is not None:
        _sections(structure, np.ones_like(c), np.full_like(c, blade_mass / s / _mass(structure)))
    multiply(structure, STIFFNESS, stiffness)
    for part in (aero, structure):
        part["twist"] = np.asarray(part["twist"]) + factors.twist(share(part))
        multiply(part, "position", s)
    multiply(structure, "axis_x axis_y", s)
    if structure["damping_time"] is not None:
        multiply(structure["damping_time"], "flap edge torsion", s)
    if factors.slender != 1.0 or stiffness != 1.0:
        structure["mode_shapes"] = None  # they belong to the reference blade
    for flap in content["flaps"]:
        multiply(flap, "rate frequency", 1.0 / factors.time)
    return content


def _sections(structure: dict[str, Any], size: Float, wall: Float) -> None:
    """Scale the size and the shell thickness of sections."""
    multiply(structure, AREA, size * wall)
    multiply(structure, SECOND_MOMENT, size**3 * wall)
    multiply(structure, "mass_centre_x mass_centre_y", size)
    arm = np.ones((len(size), 6))
    arm[:, 3:] = size[:, None]  # moments and curvatures have another power of length than forces and strains
    matrix = arm[:, :, None] * arm[:, None, :] * (size * wall)[:, None, None]
    multiply(structure, "stiffness_matrix mass_matrix", matrix)


def _mass(structure: dict[str, Any]) -> float:
    """Blade mass [kg] with the length of the reference."""
    mass = structure["mass"] if structure["mass"] is not None else np.asarray(structure["mass_matrix"])[:, 0, 0]
    return float(np.trapezoid(mass, structure["position"]))
