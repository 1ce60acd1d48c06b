"""Plausibility check of turbine data, to detect wrong units and powers of ten.

Masses go by NREL's Cost and Scaling Model, frequencies by the speed of the rotor: similar rotors of the same tip speed
have frequencies in proportion to it (Burton et al. 2011, section 5.1). Bands are so wide that a turbine beyond them is
either wrong or very special.

References: Fingersh, Hand and Laxson (2006), NREL/TP-500-40566, with the update of 2015 (``turbine.typical``).
"""

from __future__ import annotations

from collections.abc import Iterator
from math import pi, sqrt
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from meltemi.core.errors import InputError
from meltemi.turbine.definition import Turbine
from meltemi.turbine.moments import blade_moments, cumulative
from meltemi.turbine.typical import typical_masses

if TYPE_CHECKING:
    from meltemi.turbine.power_turbine import AnyTurbine

LEAST_DIAMETER = 40.0
"""[m] below which the regressions of masses say nothing."""
MASS = (1.0 / 8.0, 8.0)
"""Over the usual one; those of the library and of ROSCO's decks lie between 0.19 and 2.4."""
TWIST = 0.05
"""[rad] of the shaft at rated torque; those have 0.0003 to 0.008."""
BLADE = (2.0, 12.0)
"""First flapwise frequency at rest over rated rotor speed; those have 3.3 to 4.4."""
TOWER = (0.4, 6.0)
"""First frequency over rated rotor speed; those have 1.1 to 1.9."""
BETZ = 16.0 / 27.0


class Ratio(NamedTuple):
    """A ratio of turbine data that similar turbines have in common: key, what it is, its value and usual range."""

    key: str
    what: str
    value: float
    least: float
    most: float


@np.errstate(all="ignore")  # a frequency that overflows is outside of its range
def plausibility_warnings(turbine: AnyTurbine) -> tuple[str, ...]:
    """Warnings about turbine data that are implausible for its size, and about units in its control.

    Returns:
      One sentence each, with the key, its value and the usual range; empty if there is none.
    """
    if not hasattr(turbine, "rated_power"):
        raise InputError(f"turbine: expected a turbine, found {type(turbine).__name__}")
    said = [
        f"{key}: {what} is {value:.3g}; usual is {least:g} to {most:g}"
        for key, what, value, least, most in _ratios(turbine)
        if not least <= value <= most
    ]
    if isinstance(turbine, Turbine):
        said += _structure_warnings(turbine)
        drags = {name: float(airfoil.drag.min()) for name, airfoil in turbine.airfoils.items()}
        if negative := [name for name, drag in drags.items() if drag < 0.0]:
            worst = min(negative, key=drags.__getitem__)
            others = f", and of {len(negative) - 1} others," if len(negative) > 1 else ""
            said.append(
                f"airfoils.{worst}.drag: {drags[worst]:.3g}{others} is negative: sections that drive themselves"
            )
    elif (table := getattr(turbine.coefficient, "power", None)) is not None and table.max() > BETZ:
        said.append(f"coefficient.power: {table.max():.3g} is above Betz's limit of 16/27")
    return tuple(f"{words}; is its unit right?" for words in said)


def _ratios(turbine: AnyTurbine) -> Iterator[Ratio]:
    """Ratios of machine and control; those of the library and of ROSCO's decks are in brackets."""
    control, drive, radius = turbine.control, turbine.drivetrain, turbine.rotor_radius
    torque, pitch, speed = control.torque, control.pitch, turbine.rated_rotor_speed
    area = pi * radius**2
    yield Ratio(
        "rated_power", "rated power over rotor area [W/m^2]", turbine.rated_power / area, 50.0, 1000.0
    )  # [159, 401]
    share = turbine.rated_power / torque.rated_power
    yield Ratio("control.torque.rated_power", "rated_power over it", share, 0.6, 1.2)  # [0.94, 1]
    yield Ratio("control.pitch.reference_speed", "tip speed at it [m/s]", speed * radius, 25.0, 150.0)  # [80, 105]
    share = torque.rated_speed / pitch.reference_speed
    yield Ratio("control.torque.rated_speed", "it over control.pitch.reference_speed", share, 0.7, 1.2)  # [0.96, 1]
    yield Ratio("control.pitch.gain_halving_pitch", "it [rad]", pitch.gain_halving_pitch, 0.01, 0.6)  # [0.03, 0.19]
    share = control.filter_frequency / speed
    yield Ratio("control.filter_frequency", "it over the rated rotor speed", share, 0.6, 60.0)  # [1.2, 2.8]
    if isinstance(turbine, Turbine):
        _, blade = blade_moments(turbine.blade.structure, turbine.hub.radius)
        rotor, aero = turbine.hub.inertia + turbine.n_blades * blade, turbine.blade.aerodynamics
        share = float(np.max(aero.chord)) / turbine.blade.length
        yield Ratio("blade.aerodynamics.chord", "the largest over the blade's length", share, 0.02, 0.3)  # [0.05, 0.08]
    else:
        rotor = turbine.drivetrain.rotor_inertia
    share = drive.generator_inertia * drive.gear_ratio**2 / rotor
    if share > 0.0:
        what = "it times gear_ratio squared, over the rotor's,"
        yield Ratio("drivetrain.generator_inertia", what, share, 1e-4, 1.0)  # [0.002, 0.13]


def _structure_warnings(turbine: Turbine) -> list[str]:
    """Implausible masses, stiffnesses and frequencies."""
    blade, tower, drive, control = turbine.blade.structure, turbine.tower, turbine.drivetrain, turbine.control
    speed = turbine.rated_rotor_speed
    blade_mass = blade_moments(blade, turbine.hub.radius)[0]
    said: list[str] = []
    if turbine.rotor_diameter >= LEAST_DIAMETER:
        usual = typical_masses(turbine)
        for key, mass, typical in (
            ("blade.structure.mass", blade_mass, usual.blade),
            ("hub.mass", turbine.hub.mass, usual.hub),
            ("nacelle.mass", turbine.nacelle.mass, usual.nacelle),
            ("tower.mass", float(np.trapezoid(tower.mass, tower.position)), usual.tower),
        ):
            if not MASS[0] <= mass / typical <= MASS[1]:
                size = f"a rotor of {turbine.rotor_diameter:.0f} m and {turbine.rated_power / 1e6:.3g} MW"
                said.append(f"{key}: {mass:.4g} kg in all, where {size} has about {typical:.2g} kg")
    twist = control.torque.rated_power / speed / drive.stiffness
    if twist > TWIST:
        said.append(
            f"drivetrain.stiffness: rated torque twists the shaft by {np.degrees(twist):.3g} deg, "
            "where less than 1 deg is usual"
        )
    if blade.stiffness_matrix is not None and blade.mass_matrix is not None:
        bending = np.minimum(blade.stiffness_matrix[:, 3, 3], blade.stiffness_matrix[:, 4, 4])
        line = blade.mass_matrix[:, 0, 0]
    else:
        assert blade.flap_stiffness is not None and blade.mass is not None
        bending, line = blade.flap_stiffness, blade.mass
    top = turbine.nacelle.mass + turbine.hub.mass + turbine.n_blades * blade_mass
    softer = np.minimum(tower.fore_aft_stiffness, tower.side_side_stiffness)
    for key, found, band in (
        ("blade", bending_frequency(blade.position, line, bending), BLADE),
        ("tower", bending_frequency(tower.position, tower.mass, softer, top), TOWER),
    ):
        if not band[0] <= found / speed <= band[1]:
            said.append(
                f"{key}: its stiffness and mass give a first frequency of {found / (2.0 * np.pi):.3g} Hz, "
                f"{found / speed:.2g} times rated rotor speed; usual is {band[0]:g} to {band[1]:g} times"
            )
    return said


def bending_frequency(position: ArrayLike, mass: ArrayLike, stiffness: ArrayLike, tip_mass: float = 0.0) -> float:
    """[rad/s] first bending frequency of a cantilever by Rayleigh's quotient, with its shape under self-weight.

    Args:
      position: (n,) [m]; mass: (n,) [kg/m]; stiffness: (n,) [N m^2].
      tip_mass: [kg] at its end.
    """
    z, m, k = (np.asarray(x, dtype=float) for x in (position, mass, stiffness))
    force = cumulative(m, z)
    moment = cumulative(force[-1] + tip_mass - force, z)
    w = cumulative(cumulative((moment[-1] - moment) / k, z), z)
    work, energy = np.trapezoid(m * w, z) + tip_mass * w[-1], np.trapezoid(m * w * w, z) + tip_mass * w[-1] ** 2
    return sqrt(float(work / energy))
