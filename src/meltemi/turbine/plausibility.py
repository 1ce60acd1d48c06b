"""Plausibility check of turbine data, to detect wrong units and powers of ten.

Usual ranges of single values are stated with their units (``core.usual``). This module checks relations of values:
power, torque and speed, mass and stiffness of a steel tube, frequencies over rotor speed, which are proportional for
similar rotors (Burton et al. 2011, section 5.1). Ranges are so wide that a turbine outside is either wrong or very
special; those of the library, of turbines scaled from it, and of ROSCO's decks are in brackets.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import sqrt
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from meltemi.core.errors import InputError
from meltemi.core.usual import AT, unusual_numbers
from meltemi.turbine.definition import Turbine
from meltemi.turbine.moments import blade_moments, cumulative

if TYPE_CHECKING:
    from meltemi.turbine import ElectricalSystem
    from meltemi.turbine.power_turbine import AnyTurbine, TableCoefficient

BETZ = 16.0 / 27.0
FREQUENCY = "stiffness and mass give a first frequency which over rated rotor speed"
MODULUS = "modulus over density [m^2/s^2] of a thin tube of its mass and diameter"
TUBE = "it over that of a thin tube of the same bending stiffness"
SLENDER = 0.05
"""Drag coefficient below which a section is a lifting airfoil."""


def doubt(key: str, what: str, value: float, least: float, most: float) -> str:
    """A sentence about a ratio outside its range in similar turbines; empty if inside."""
    usual = least <= value <= most
    return "" if usual else f"{key}: {what} is {value:.3g}; usual is {least:g} to {most:g}"


@np.errstate(all="ignore")  # an overflowing frequency is outside its range
def plausibility_warnings(turbine: AnyTurbine) -> tuple[str, ...]:
    """Warnings about turbine data that are implausible for its size, and about units in its control.

    Returns:
      One sentence each, with the key, its value and the usual range; empty if there is none.
    """
    if not hasattr(turbine, "rated_power"):
        raise InputError(f"turbine: expected a turbine, found {type(turbine).__name__}")
    sentences = [*unusual_numbers(turbine, diameter=turbine.rotor_diameter), *_machine(turbine)]
    if not turbine.control.pitch.proportional_gain:  # fixed-pitch blades: most control values are placeholders
        sentences = [words for words in sentences if not words.startswith(("control.", "pitch_actuator."))]
    if (electrical := turbine.electrical) is not None and not electrical.forced:
        sentences += [*electrical.problems(), *_electrical(electrical, turbine.control.torque.rated_power)]
    if isinstance(turbine, Turbine):
        sentences += [*_blade(turbine), *_tower(turbine), *_airfoils(turbine)]
        sentences += [words for below in turbine.substructures for words in below.doubts(turbine)]
    elif turbine.coefficient.kind == "table":
        sentences += _table(turbine.coefficient)
    return tuple(f"{words}; is its unit right?" for words in sentences if words)


def _machine(turbine: AnyTurbine) -> Iterator[str]:
    control, drive, radius = turbine.control, turbine.drivetrain, turbine.rotor_radius
    torque, pitch, speed = control.torque, control.pitch, turbine.rated_rotor_speed
    reference, rated, gear = pitch.reference_speed, torque.rated_power / pitch.reference_speed, drive.gear_ratio
    share = turbine.rated_power / torque.rated_power / drive.generator_efficiency
    yield doubt("control.torque.rated_power", "rated_power over it and the efficiency", share, 0.85, 1.1)  # [1]
    yield doubt("control.pitch.reference_speed", "tip speed at it [m/s]", speed * radius, 35.0, 140.0)  # [62, 105]
    for name, least, most in (  # [0.96, 1], [0.25, 0.75], [0.25, 0.66]
        ("rated_speed", 0.7, 1.2),
        ("optimal_speed", 0.15, 1.1),
        ("cut_in_speed", 0.05 * bool(torque.cut_in_speed), 1.0),
    ):
        share = getattr(torque, name) / reference
        yield doubt(f"control.torque.{name}", "it over control.pitch.reference_speed", share, least, most)
    share = torque.optimal_gain * reference**2 / rated
    yield doubt("control.torque.optimal_gain", "torque at rated speed over rated", share, 0.25, 1.6)  # [0.3, 1.13]
    yield doubt("control.torque.maximum_torque", "it over rated", torque.maximum_torque / rated, 0.95, 2.5)  # [1, 1.42]
    share = rated / torque.rate_limit * speed
    yield doubt(
        "control.torque.rate_limit", "turn [rad] of the rotor until rated torque", share, 0.05, 20.0
    )  # [0.2, 5]
    if pitch.proportional_gain > 0.0:
        share = pitch.proportional_gain * reference * pitch.gain_halving_pitch
        what = "it times reference_speed and gain_halving_pitch [rad^2]"
        yield doubt("control.pitch.proportional_gain", what, share, 0.02, 4.5)  # [0.08, 4]
        share = pitch.integral_gain / pitch.proportional_gain / speed
        what = "it over proportional_gain and rated rotor speed"
        yield doubt("control.pitch.integral_gain", what, share, 0.03, 1.2)  # [0.09, 0.34]
    for name in ("rate_limit", "maximum"):
        share = getattr(pitch, name) / getattr(turbine.pitch_actuator, name)
        yield doubt(f"control.pitch.{name}", "it over that of pitch_actuator", share, 0.33, 1.5)  # [1]
    if drive.brake_torque > 0.0:
        share = drive.brake_torque / rated
        yield doubt("drivetrain.brake_torque", "it over rated torque", share, 0.2, 6.0)  # [0.65, 4.1]
    if (generator := drive.generator_inertia * gear**2) > 0.0:
        if isinstance(turbine, Turbine):
            one = blade_moments(turbine.blade.structure, turbine.hub.radius)[1]
            rotor = turbine.hub.inertia + turbine.n_blades * one
        else:
            rotor = turbine.drivetrain.rotor_inertia
        what = "it times gear_ratio squared, over the rotor's,"
        yield doubt("drivetrain.generator_inertia", what, generator / rotor, 3e-4, 0.8)  # [0.002, 0.55]
        if drive.stiffness:
            twist = rated * gear / drive.stiffness
            yield doubt("drivetrain.stiffness", "twist [rad] at rated torque", twist, 5e-5, 0.03)  # [0.0001, 0.005]
            share = 0.5 * drive.damping * sqrt((1.0 / rotor + 1.0 / generator) / drive.stiffness)
            yield doubt("drivetrain.damping", "its ratio", share, 5e-4 * bool(share), 0.6)  # [0.0016, 0.45]


def _table(table: TableCoefficient) -> Iterator[str]:
    best = float(table.tip_speed_ratio[np.argmax(table.power.max(axis=1))])
    yield doubt("coefficient.power", "its largest, below Betz's limit of 16/27,", table.power.max(), 0.3, BETZ)
    yield doubt("coefficient.tip_speed_ratio", "that of the largest power", best, 4.0, 14.0)
    if table.thrust is not None:
        yield doubt("coefficient.thrust", "its largest", table.thrust.max(), 0.5, 3.0)


def _electrical(system: ElectricalSystem, rated: float) -> Iterator[str]:
    """Per-unit values, those of sized systems in brackets."""
    machine, link, filtered = system.machine, system.dc_link, system.filter
    power, current = machine.rated_power, system.rated_grid_current
    yield doubt("electrical.machine.rated_power", "it over control.torque.rated_power", power / rated, 0.7, 1.5)  # [1]
    share = machine.copper_loss / power
    yield doubt("electrical.machine.resistance", "loss over rated power", share, 0.002, 0.08)  # [0.02]
    share = machine.rated_frequency * machine.inductance * machine.rated_current / machine.rated_emf
    yield doubt("electrical.machine.inductance", "reactance over rated impedance", share, 0.1, 2.0)  # [0.5, 0.71]
    for name, rated_current in (("machine", machine.rated_current), ("grid", current)):
        share = getattr(system, f"{name}_converter").current / rated_current
        yield doubt(f"electrical.{name}_converter.current", "limit over rated current", share, 1.0, 4.0)  # [1.15, 1.2]
    store = 0.5 * link.capacitance * link.voltage**2 / power
    yield doubt("electrical.dc_link.capacitance", "its energy over rated power [s]", store, 1e-3, 0.3)  # [0.02]
    if link.chopper is not None:
        share = link.chopper.heat / power
        yield doubt("electrical.dc_link.chopper.heat", "it over rated power [s]", share, 0.15, 60.0)  # [2.5, 3]
    share = 1.5 * filtered.resistance * current**2 / power
    yield doubt("electrical.filter.resistance", "loss over rated power", share, 1e-4, 0.02)  # [0.0008, 0.003]


def _blade(turbine: Turbine) -> Iterator[str]:
    """At its root a blade is a thin tube: EI = E A d^2 / 8, GJ / EI = 1 / (1 + nu), k G A / EA = 1 / (4 (1 + nu))."""
    blade, aero = turbine.blade.structure, turbine.blade.aerodynamics
    share = blade_moments(blade, turbine.hub.radius)[0] / (turbine.rotor_diameter / AT) ** 3
    what = "mass [kg] of a blade of similar shape for a rotor of 100 m"
    yield doubt("blade.structure", what, share, 2e3, 5e4)  # [3.6e3, 3e4]
    twists = [float(np.abs(part.twist).max()) for part in (blade, aero)]
    if min(twists) > 0.0:
        yield doubt("blade.structure.twist", "it over blade.aerodynamics.twist", twists[0] / twists[1], 0.4, 2.5)  # [1]
    if blade.stiffness_matrix is not None and blade.mass_matrix is not None:
        bending = np.minimum(blade.stiffness_matrix[:, 3, 3], blade.stiffness_matrix[:, 4, 4])
        line, (stretch, twist) = blade.mass_matrix[:, 0, 0], blade.stiffness_matrix[0, [2, 5], [2, 5]]
    else:
        assert blade.flap_stiffness is not None and blade.mass is not None
        bending, line, given = blade.flap_stiffness, blade.mass, (blade.axial_stiffness, blade.torsion_stiffness)
        stretch, twist = (np.nan if values is None else float(values[0]) for values in given)
    frequency = bending_frequency(blade.position, line, bending) / turbine.rated_rotor_speed
    yield doubt("blade", f"its {FREQUENCY}", frequency, 2.2, 6.5)  # [3, 4.4]
    width, stiff = float(aero.chord[0]), float(bending[0])
    share = 8.0 * stiff / (float(line[0]) * width**2)
    yield doubt("blade.structure.flap_stiffness", f"at the root {MODULUS}", share, 6e6, 5e7)  # [1.4e7, 2.9e7]
    for name, share, least, most in (  # [0.84, 1.04], [0.31, 0.58]
        ("axial", stretch * width**2 / (8.0 * stiff), 0.35, 3.0),
        ("torsion", twist / stiff, 0.1, 1.2),
    ):
        if not np.isnan(share):
            yield doubt(f"blade.structure.{name}_stiffness", f"at the root {TUBE}", share, least, most)


def _tower(turbine: Turbine) -> Iterator[str]:
    tower, speed, d = turbine.tower, turbine.rated_rotor_speed, turbine.tower.diameter
    hub, nacelle, yaw, size = turbine.hub, turbine.nacelle, turbine.yaw, turbine.rotor_diameter / AT
    if hub.mass > 0.0 and hub.inertia > 0.0:
        share = sqrt(hub.inertia / hub.mass) / hub.radius
        yield doubt("hub.inertia", "radius of gyration over hub.radius", share, 0.4, 2.0)  # [0.49, 0.95]
    for name, least, most in (("yaw", 1.2, 6.0), ("roll", 0.4, 3.5), ("nod", 0.4, 4.0)):  # [2.5, 5], [0.8, 1.9]
        if (inertia := getattr(nacelle, f"{name}_inertia")) > 0.0:
            share = sqrt(inertia / max(nacelle.mass, 1e-9)) / size
            yield doubt(f"nacelle.{name}_inertia", "radius of gyration [m] for a rotor of 100 m", share, least, most)
    mass, inertia = blade_moments(turbine.blade.structure, hub.radius)
    rotor = hub.mass + turbine.n_blades * mass
    softer = np.minimum(tower.fore_aft_stiffness, tower.side_side_stiffness)
    frequency = bending_frequency(tower.position, tower.mass, softer, nacelle.mass + rotor) / speed
    yield doubt("tower", f"its {FREQUENCY}", frequency, 0.5, 5.0)  # [1.1, 3.1]
    about = 0.5 * (hub.inertia + turbine.n_blades * inertia) + rotor * nacelle.overhang**2 + nacelle.yaw_inertia
    frequency = sqrt(yaw.stiffness / about)
    yield doubt(
        "yaw.stiffness", "frequency of the nacelle over rated rotor speed", frequency / speed, 1.2, 36.0
    )  # [1.3, 15]
    share = 0.5 * yaw.damping * frequency / yaw.stiffness
    yield doubt("yaw.damping", "its ratio", share, 5e-4 * bool(share), 0.08)  # [0.0015, 0.02]
    for name in ("fore_aft", "side_side"):
        share = float(np.median(8.0 * getattr(tower, f"{name}_stiffness") / (tower.mass * d**2)))
        yield doubt(f"tower.{name}_stiffness", MODULUS, share, 9e6, 5e7)  # [2e7, 2.5e7]
    for name, of_bending in (("torsion", 0.77 * d**0), ("axial", 8.0 / d**2), ("shear", 1.54 / d**2)):
        if (value := getattr(tower, f"{name}_stiffness")) is not None:
            share = float(np.median(value / (of_bending * tower.fore_aft_stiffness)))
            yield doubt(f"tower.{name}_stiffness", TUBE, share, 0.4, 2.5)  # [1, 1.07]


def _airfoils(turbine: Turbine) -> Iterator[str]:
    """Coefficients of lifting sections; normal to the flow they are those of a flat plate (Hoerner 1965)."""
    sentences: dict[str, str] = {}
    for name, airfoil in turbine.airfoils.items():
        least, drag = float(airfoil.drag.min()), f"airfoils.{name}.drag"
        if least < 0.0:
            sentences.setdefault("sign", f"{drag}: {least:.3g} is negative: a section that drives itself")
        elif airfoil.dynamic_stall and 0.0 < least < SLENDER:
            for key, low, high in (
                ("lift", 0.7, 3.0),
                ("drag", 0.8, 2.6),
                ("moment", 0.2, 1.0),
            ):  # [1.4, 2], [0.43, 0.5]
                largest = float(np.abs(getattr(airfoil, key)).max())
                if words := largest and doubt(f"airfoils.{name}.{key}", "its largest", largest, low, high):
                    sentences.setdefault(key, words)
    yield from sentences.values()


def bending_frequency(position: ArrayLike, mass: ArrayLike, stiffness: ArrayLike, tip_mass: float = 0.0) -> float:
    """First bending frequency [rad/s] of a cantilever by Rayleigh's quotient, with its shape under self-weight.

    Args:
      position: (n,) [m] positions from the clamped end.
      mass: (n,) [kg/m] mass per length.
      stiffness: (n,) [N m^2] bending stiffness.
      tip_mass: [kg] mass at the free end.
    """
    z, m, k = (np.asarray(x, dtype=float) for x in (position, mass, stiffness))
    force = cumulative(m, z)
    moment = cumulative(force[-1] + tip_mass - force, z)
    w = cumulative(cumulative((moment[-1] - moment) / k, z), z)
    work, energy = np.trapezoid(m * w, z) + tip_mass * w[-1], np.trapezoid(m * w * w, z) + tip_mass * w[-1] ** 2
    return sqrt(float(work / energy))
