"""``scale_turbine``: scaling of a reference turbine to main parameters."""

from __future__ import annotations

import math
from dataclasses import KW_ONLY, dataclass, fields
from typing import Any

from meltemi.core.calls import arguments_of
from meltemi.core.errors import InputError
from meltemi.core.yamlfile import validated
from meltemi.studies.scaling.blade import scaled_blade
from meltemi.studies.scaling.factors import Factors, design_ratio
from meltemi.studies.scaling.machine import (
    ABOVE_MINIMUM,
    Inertia,
    inertia_of,
    scaled_actuator,
    scaled_control,
    scaled_drivetrain,
    scaled_foundation,
    scaled_hub,
    scaled_nacelle,
    scaled_yaw,
)
from meltemi.studies.scaling.tower import Top, scaled_tower
from meltemi.turbine.definition import Blade, Hub, Nacelle, Turbine
from meltemi.turbine.moments import blade_moments

TIP_SPEEDS = 20.0, 150.0
"""[m/s] beyond which a rotor speed is taken for rpm."""
SPECIFIC_POWERS = 30.0, 3000.0
"""[W/m^2] beyond which a power is taken for kW or MW."""
IF_RPM = "if these are rpm, multiply by pi/30 = 0.1047198"
WHERE = "scale_turbine"
NO_NUMBERS = "reference", "name", "description"
EFFICIENCIES = "generator_efficiency", "gearbox_efficiency"


@dataclass(frozen=True)
class Scaling:
    """Main parameters of a scaled turbine.

    Attributes:
      reference: the turbine that is scaled; nothing of it changes.
      rotor_diameter: [m] by default the reference's.
      rated_power: [W] electrical; by default of the same specific power.
      hub_height: [m] above ground; by default in proportion to the diameter.
      tower_height: [m] from base to top, instead of ``hub_height``.
      rotor_speed: [rad/s] rated; by default of the same tip speed.
      minimum_rotor_speed: [rad/s] where the torque begins; it follows the optimal law from 1.1 times this speed on. By
        default both speeds are in proportion to the rated one.
      tip_speed_ratio: that the blade is shaped for; by default the shape stays.
      gear_ratio: generator speed over rotor speed.
      generator_efficiency: electrical power over mechanical, with the converter.
      gearbox_efficiency: power on the fast side over power on the slow one.
      generator_inertia: [kg m^2] on the generator's shaft.
      blade_mass: [kg] of one blade; sets the thickness of its walls, so that its frequencies stay.
      blade_stiffness: over that of equal strain, as of stiffer material; frequencies go with its root.
      hub_mass: [kg] with pitch bearings and spinner.
      nacelle_mass: [kg] without rotor.
      tower_frequency: [Hz] of the first fore-aft mode of the turbine; sets the diameter. By default the stress in rated
        wind stays.
      yaw_rate: [rad/s] of the drive.
      cut_in: [m/s] wind speed.
      cut_out: [m/s] wind speed.
      name: of the new turbine.
      description: of the new turbine.
    """

    reference: Turbine
    _: KW_ONLY
    rotor_diameter: float | None = None
    rated_power: float | None = None
    hub_height: float | None = None
    tower_height: float | None = None
    rotor_speed: float | None = None
    minimum_rotor_speed: float | None = None
    tip_speed_ratio: float | None = None
    gear_ratio: float | None = None
    generator_efficiency: float | None = None
    gearbox_efficiency: float | None = None
    generator_inertia: float | None = None
    blade_mass: float | None = None
    blade_stiffness: float = 1.0
    hub_mass: float | None = None
    nacelle_mass: float | None = None
    tower_frequency: float | None = None
    yaw_rate: float | None = None
    cut_in: float | None = None
    cut_out: float | None = None
    name: str | None = None
    description: str | None = None

    def given(self) -> dict[str, Any]:
        """Numbers that are given.

        Raises:
          InputError: one is not above zero, or hub and tower height are both given.
        """
        names = (each.name for each in fields(self) if each.name not in NO_NUMBERS)
        given = {name: value for name in names if (value := getattr(self, name)) is not None}
        for key, value in given.items():
            if not isinstance(value, int | float) or not 0.0 < value < math.inf:
                raise InputError(f"{WHERE}: {key} must be a number above zero, found {value!r}")
        if "hub_height" in given and "tower_height" in given:
            raise InputError(f"{WHERE}: give hub_height or tower_height, not both")
        return given


@arguments_of(Scaling)
def scale_turbine(asked: Scaling) -> Turbine:
    """Scale a reference turbine to another size and rating; the arguments are the fields of :class:`Scaling`.

    What is not given follows by the rules of docs/guide/scaling.md: geometric similarity at equal tip speed and
    specific power, and where a number departs from it, equal lift coefficient, strain, twist of the shaft and damping
    ratio. Pitch gains and optimal gain are scaled; ``tune_baseline`` makes them from the new rotor's aerodynamics.

    Returns:
      The new turbine.

    Raises:
      InputError: a number is not above zero or cannot be in SI units, hub and tower height are both given, or no
        turbine can have these numbers.
    """
    reference, given = asked.reference, asked.given()
    new_drive = {key: given.get(key, getattr(reference.drivetrain, key)) for key in ("gear_ratio", *EFFICIENCIES)}
    size = (asked.rotor_diameter or reference.rotor_diameter) / reference.rotor_diameter
    power = asked.rated_power or reference.rated_power * size**2
    factors = _factors(reference, given, power, new_drive)
    _plausible(given, reference, factors, power)
    content = reference.content()
    content["blade"] = scaled_blade(reference, factors, asked.blade_mass, asked.blade_stiffness)
    blade = validated(content["blade"], Blade, WHERE)
    before = inertia_of(reference.n_blades, reference.blade.structure, reference.hub, reference.nacelle)
    blade_masses = blade_moments(blade.structure, 0.0)[0] / before.blade
    hub = Hub.model_validate(scaled_hub(reference.hub, factors, blade_masses, asked.hub_mass))
    nacelle = Nacelle.model_validate(scaled_nacelle(reference.nacelle, factors, asked.nacelle_mass))
    now = inertia_of(reference.n_blades, blade.structure, hub, nacelle)
    if asked.generator_inertia is not None:
        new_drive["generator_inertia"] = asked.generator_inertia
    torque = power / math.prod(new_drive[key] for key in EFFICIENCIES) / (reference.rated_rotor_speed / factors.time)
    drive = scaled_drivetrain(reference, factors, (before.shaft, now.shaft), new_drive, torque)
    parts = ((before, reference.drivetrain.content()), (now, drive))
    inertias = [inertia.shaft + part["gear_ratio"] ** 2 * part["generator_inertia"] for inertia, part in parts]
    gain = inertias[1] / inertias[0]
    content |= {
        "name": asked.name or f"{reference.name}-scaled",
        "description": asked.description or f"{reference.name}, scaled",
        "rated_power": power,
        "cut_in": asked.cut_in or reference.cut_in,
        "cut_out": asked.cut_out or reference.cut_out,
        "hub": hub.content(),
        "nacelle": nacelle.content(),
        "drivetrain": drive,
        "yaw": scaled_yaw(reference, factors, now.yaw / before.yaw, asked.yaw_rate),
        "tower": _tower(asked, factors, nacelle, now),
        "pitch_actuator": scaled_actuator(reference, factors),
        "control": scaled_control(reference, factors, drive, power, gain, asked.minimum_rotor_speed),
    }
    if reference.foundation is not None:
        content["foundation"] = scaled_foundation(reference.foundation, factors)
    _sources(content, reference)
    return validated(content, Turbine, WHERE)


def _tower(asked: Scaling, factors: Factors, nacelle: Nacelle, now: Inertia) -> dict[str, Any]:
    """Content of ``Turbine.tower``, from its base to the hub height, under what stands on it."""
    reference = asked.reference
    above = nacelle.shaft_height + nacelle.overhang * math.sin(nacelle.tilt)
    ground = reference.tower.base_height * factors.length
    hub_above_ground = asked.hub_height or reference.hub_height * factors.length
    length = asked.tower_height or hub_above_ground - ground - above
    if length <= 0.0:
        raise InputError(
            f"{WHERE}: a hub height of {hub_above_ground:g} m leaves no length for the tower: its base is at "
            f"{ground:g} m and the hub {above:.3g} m above its top"
        )
    mass = now.rotor + nacelle.mass + reference.tower.top_mass * factors.moment
    top = Top(mass, (now.rotor * above + nacelle.mass * nacelle.mass_centre[2]) / mass, 0.5 * now.shaft)
    return scaled_tower(reference.tower, factors, length, top, asked.tower_frequency)


def _factors(reference: Turbine, given: dict[str, Any], power: float, drive: dict[str, float]) -> Factors:
    s = given.get("rotor_diameter", reference.rotor_diameter) / reference.rotor_diameter
    designed = design_ratio(reference)
    losses = math.prod(getattr(reference.drivetrain, key) / drive[key] for key in EFFICIENCIES)
    return Factors(
        length=s,
        time=reference.rated_rotor_speed / given["rotor_speed"] if "rotor_speed" in given else s,
        power=power / reference.rated_power * losses,
        gear=drive["gear_ratio"] / reference.drivetrain.gear_ratio,
        tip_speed_ratio=designed,
        slender=given["tip_speed_ratio"] / designed if "tip_speed_ratio" in given else 1.0,
    )


def _plausible(given: dict[str, Any], reference: Turbine, factors: Factors, power: float) -> None:
    """Raise errors for implausible values, such as rotor speeds in rpm and powers in kW."""
    rated, radius = reference.rated_rotor_speed / factors.time, reference.rotor_radius * factors.length
    if not TIP_SPEEDS[0] < rated * radius < TIP_SPEEDS[1]:
        raise InputError(
            f"{WHERE}: rotor_speed is in rad/s, and {rated:g} gives a tip speed of {rated * radius:.0f} m/s, expected "
            f"60 to 110; {IF_RPM}"
        )
    lowest = given.get("minimum_rotor_speed", 0.0)
    if ABOVE_MINIMUM * lowest >= 0.95 * rated:
        raise InputError(
            f"{WHERE}: minimum_rotor_speed {lowest:g} rad/s must be well below the rated {rated:g} rad/s; {IF_RPM}"
        )
    specific = power / (math.pi * radius**2)
    if not SPECIFIC_POWERS[0] < specific < SPECIFIC_POWERS[1]:
        raise InputError(
            f"{WHERE}: rated_power is in W, and {power:g} is {specific:.3g} W per m^2 of the rotor, "
            "expected 100 to 600; check the unit"
        )


def _sources(content: dict[str, Any], reference: Turbine) -> None:
    """Replace the sources of the reference by the scaling."""
    words = f"scaled from {reference.name}: docs/guide/scaling.md"
    content["source"] = f"scaled from {reference.name} by scale_turbine; {reference.source}".rstrip("; ")
    for key in ("blade", "hub", "nacelle", "drivetrain", "yaw", "tower", "pitch_actuator", "control", "foundation"):
        if content[key] is not None:
            content[key]["source"] = words
