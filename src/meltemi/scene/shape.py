"""Shape of a turbine at rest, for the view: skin of the blades, tower, nacelle and hub."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from meltemi.structure.members import ModalMember
from meltemi.turbine.definition import Turbine
from meltemi.turbine.thickness import thickness_in

Float = NDArray[np.float64]

SECTIONS, POINTS, LEVELS = 40, 28, 24
"""Sections of a blade that are drawn, points of their outlines, and sections of the tower."""
CAMBER = 0.025
"""Camber of the drawn airfoils, over the chord."""
USUAL_THICKNESS = 0.21
"""Relative thickness of an airfoil whose thickness is unknown."""


def sections(length: float) -> Float:
    """(S,) [m] positions from the root, denser towards the tip, where the chord ends."""
    return length * (1.0 - (1.0 - np.linspace(0.0, 1.0, SECTIONS)) ** 1.35)


def beam_axis(blade: ModalMember, s: Float, hub_radius: float) -> Float:
    """(S, 3) [m] points of the undeformed beam axis from the rotor apex, blade axes."""
    points: Float = blade.beam.at(s, "axis") + np.array([0.0, 0.0, hub_radius])
    return points


def thickness(turbine: Turbine, s: Float) -> Float:
    """(S,) relative thickness; from the airfoils, their names, or usual values."""
    known = []
    for name in turbine.blade.aerodynamics.airfoil:
        airfoil = turbine.airfoils[name]
        given = airfoil.relative_thickness or thickness_in(name)
        known.append(given or (USUAL_THICKNESS if np.ptp(airfoil.lift) > 0.5 else 1.0))
    relative_thickness: Float = np.interp(s, turbine.blade.aerodynamics.position, known)
    return relative_thickness


def roundness(t: Float | float) -> Any:
    """Weight from 0 for an airfoil to 1 for a circle, by relative thickness."""
    return np.clip((t - 0.35) / 0.6, 0.0, 1.0)


def outline(t: float) -> Float:
    """(P, 2) outline of a section with unit chord: towards the suction side, and from its aerodynamic centre aft.

    The thickness is that of the four-digit NACA airfoils, with a thin camber; thick sections approach the ellipse.
    The aerodynamic centre is at a quarter of the chord, that of a circle in the middle.
    """
    round_ = roundness(t)
    angle = 2.0 * np.pi * np.arange(POINTS) / POINTS  # from the trailing edge over the suction side
    x = 0.5 * (1.0 + np.cos(angle))
    half = 5.0 * t * (0.2969 * np.sqrt(x) - 0.126 * x - 0.3516 * x**2 + 0.2843 * x**3 - 0.1036 * x**4)
    camber = 4.0 * CAMBER * (1.0 - round_) * x * (1.0 - x)
    y = camber + np.sign(np.sin(angle)) * half
    y = (1.0 - round_) * y + round_ * 0.5 * t * np.sin(angle)
    return np.stack([y, x - 0.25 - 0.25 * round_], axis=1)


def blade_skin(turbine: Turbine, blade: ModalMember, s: Float) -> Float:
    """(S, P, 3) [m] outlines of the undeformed sections from the beam axis, blade axes (x flap, y to trailing edge)."""
    a = turbine.blade.aerodynamics
    axis, thick = blade.beam.at(s, "axis"), thickness(turbine, s)
    chord, twist = np.interp(s, a.position, a.chord), np.interp(s, a.position, a.twist)
    skin = np.zeros((len(s), POINTS, 3))
    for i, t in enumerate(thick):
        flap, aft = chord[i] * outline(float(t)).T
        # twist turns the leading edge into the wind: about -z
        cos, sin = np.cos(twist[i]), np.sin(twist[i])
        skin[i, :, 0], skin[i, :, 1] = cos * flap + sin * aft, cos * aft - sin * flap
    for k, values in enumerate((a.centre_x, a.centre_y)):
        if values is not None:  # circles are about the beam axis
            skin[:, :, k] += ((1.0 - roundness(thick)) * (np.interp(s, a.position, values) - axis[:, k]))[:, None]
    return skin


def machine(turbine: Turbine) -> dict[str, Any]:
    """Dimensions of tower, nacelle and hub [m, rad]; those of nacelle and spinner are usual proportions."""
    tower, nacelle = turbine.tower, turbine.nacelle
    z = np.linspace(0.0, tower.length, LEVELS)
    width = np.interp(z, tower.position, tower.diameter)
    root = float(turbine.blade.aerodynamics.chord[0])
    return {
        "name": turbine.name,
        "blades": turbine.n_blades,
        "rotor_radius": turbine.rotor_radius,
        "hub_height": turbine.hub_height,
        "hub_radius": turbine.hub.radius,
        "root_diameter": root,
        "precone": turbine.hub.precone,
        "tilt": nacelle.tilt,
        "overhang": nacelle.overhang,
        "shaft_height": nacelle.shaft_height,
        "tower_base": tower.base_height,
        "tower_length": tower.length,
        "tower_height": [round(float(v), 3) for v in z],
        "tower_diameter": [round(float(v), 3) for v in width],
        "water": next((each.view_shape() for each in turbine.substructures), None),
    }
