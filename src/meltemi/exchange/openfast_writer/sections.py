"""Blade sections in the formats of ElastoDyn and BeamDyn."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from meltemi.structure.beam import section_mass
from meltemi.structure.members import ModalMember
from meltemi.turbine.definition import BladeStructure, Damping, DampingTime

Float = NDArray[np.float64]
Report = Callable[[str, str], None]

AXIAL_OVER_MASS = 1.43e7
"""[N m/kg] default of axial stiffness over mass per length: that of the blade root of the NREL 5 MW."""
SHEAR_OVER_AXIAL = 0.1
"""Default of shear stiffness over axial stiffness."""
LEAST_INERTIA = 1e-6
"""[m^2] default of rotary inertia over mass: the mass matrix of BeamDyn must not be singular."""


def classical(blade: BladeStructure, ratios: Damping, lost: Report) -> BladeStructure:
    """Blade for ElastoDyn: straight, with principal bending stiffness, without torsion."""
    if blade.axis_x is not None or blade.axis_y is not None:
        lost("prebend and sweep of the structure", "ElastoDyn's blades are straight; AeroDyn's keep their curve")
    if blade.twists:
        lost("torsion of the blade", "ElastoDyn has none")
    if blade.stiffness_matrix is None or blade.mass_matrix is None:
        centres = (blade.mass_centre_x, blade.mass_centre_y, blade.flap_inertia, blade.edge_inertia)
        if any(value is not None and np.any(value) for value in centres):
            lost("mass centre and rotary inertia of sections", "ElastoDyn has none")
        mass, twist = blade.mass, blade.twist
        flap, edge = blade.flap_stiffness, blade.edge_stiffness
    else:
        lost("coupling and offsets of the 6 x 6 sections", "ElastoDyn has principal bending stiffness and mass")
        flap, edge, angle = principal(blade.stiffness_matrix)
        twist, mass = blade.twist + angle, blade.mass_matrix[:, 0, 0]
    return BladeStructure(
        position=blade.position,
        twist=twist,
        mass=mass,
        flap_stiffness=flap,
        edge_stiffness=edge,
        damping=ratios,
        mode_shapes=blade.mode_shapes,
    )


def principal(stiffness: Float) -> tuple[Float, Float, Float]:
    """Principal flapwise and edgewise stiffness [N m^2] of 6 x 6 sections, and rotation of their axes to feather [rad].

    From the compliance in bending about x and y, as in ``reports.turbine_overview.principal_stiffness``.
    """
    C = np.linalg.inv(stiffness)[:, 3:5, 3:5]
    # flapwise bending is about y; a rotation to feather is a negative angle about z
    angle = 0.5 * np.arctan2(2.0 * C[:, 0, 1], C[:, 1, 1] - C[:, 0, 0])
    mean, half = 0.5 * (C[:, 0, 0] + C[:, 1, 1]), np.hypot(0.5 * (C[:, 1, 1] - C[:, 0, 0]), C[:, 0, 1])
    # near the circular root the stiffer direction may be flapwise: each axis is named by the closer direction
    swapped = np.abs(angle) > 0.25 * np.pi
    angle, half = np.where(swapped, angle - 0.5 * np.pi * np.sign(angle), angle), np.where(swapped, -half, half)
    return 1.0 / (mean + half), 1.0 / (mean - half), angle


def matrices(blade: BladeStructure, lost: Report) -> tuple[Float, Float]:
    """(S, 6, 6) stiffness and mass matrices for BeamDyn."""
    if blade.stiffness_matrix is not None and blade.mass_matrix is not None:
        return blade.stiffness_matrix, blade.mass_matrix
    assert blade.mass is not None and blade.flap_stiffness is not None and blade.edge_stiffness is not None
    assert blade.torsion_stiffness is not None
    n = len(blade.position)
    zero = np.zeros(n)
    if blade.axial_stiffness is None:
        lost("no axial stiffness", f"{AXIAL_OVER_MASS:g} N m/kg times the mass is written for BeamDyn")
    axial = AXIAL_OVER_MASS * blade.mass if blade.axial_stiffness is None else blade.axial_stiffness
    lost("no shear stiffness", f"{SHEAR_OVER_AXIAL:g} of the axial stiffness is written for BeamDyn")
    K = np.zeros((n, 6, 6))
    about = (blade.edge_stiffness, blade.flap_stiffness, blade.torsion_stiffness)
    for i, values in enumerate((SHEAR_OVER_AXIAL * axial, SHEAR_OVER_AXIAL * axial, axial, *about)):
        K[:, i, i] = values
    least = LEAST_INERTIA * blade.mass
    flap, edge = (np.maximum(least, least if x is None else x) for x in (blade.flap_inertia, blade.edge_inertia))
    x, y = (zero if value is None else value for value in (blade.mass_centre_x, blade.mass_centre_y))
    return K, section_mass(blade.mass, np.stack([x, y, zero], 1), np.stack([edge, flap, edge + flap], 1))


def damping_ratios(damping: Damping | DampingTime | None, member: ModalMember) -> Damping:
    """Damping ratios of the first modes; w mu / 2 for stiffness-proportional damping."""
    if isinstance(damping, DampingTime):
        first = dict(zip(member.names, member.modes.frequency_alone.tolist(), strict=True))
        return Damping(flap=0.5 * damping.flap * first["1st flap"], edge=0.5 * damping.edge * first["1st edge"])
    return damping or Damping()


def damping_times(damping: Damping | DampingTime | None, member: ModalMember) -> tuple[float, float, float]:
    """[s] damping times of flap, edge and torsion; 2 zeta / w of the first modes for damping ratios."""
    if isinstance(damping, DampingTime):
        return damping.flap, damping.edge, damping.torsion
    ratios = damping or Damping()
    first = dict(zip(member.names, member.modes.frequency_alone.tolist(), strict=True))
    flap, edge, torsion = (
        2.0 * getattr(ratios, name) / first[f"1st {name}"] if f"1st {name}" in first else 0.0
        for name in ("flap", "edge", "torsion")
    )
    return flap, edge, torsion
