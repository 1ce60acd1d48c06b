"""``scale_turbine``: scaling of a reference turbine to other main parameters."""

from __future__ import annotations

import math
from dataclasses import KW_ONLY, dataclass, fields
from typing import Any

from meltemi.core.calls import arguments_of
from meltemi.core.errors import InputError
from meltemi.core.yamlfile import validated
from meltemi.studies.scaling.blade import scaled_blade
from meltemi.studies.scaling.factors import ScalingFactors, design_ratio
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
from meltemi.studies.scaling.tower import TowerTopBody, scaled_tower
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
      reference: reference turbine, which is not changed.
      rotor_diameter: [m] rotor diameter; by default that of the reference.
      rated_power: [W] electrical power; by default with the same specific power.
      hub_height: [m] height above ground; by default in proportion to the diameter.
      tower_height: [m] height from base to top, instead of ``hub_height``.
      rotor_speed: [rad/s] rated rotor speed; by default with the same tip speed.
      minimum_rotor_speed: [rad/s] rotor speed at which the torque begins; it follows the optimal law from 1.1 times
        this speed on. By default both speeds are in proportion to the rated speed.
      tip_speed_ratio: design tip-speed ratio of the blade; by default the shape is unchanged.
      gear_ratio: generator speed over rotor speed.
      generator_efficiency: electrical over mechanical power, including the converter.
      gearbox_efficiency: power at the high-speed shaft over that at the low-speed shaft.
      generator_inertia: [kg m^2] inertia about the high-speed shaft.
      blade_mass: [kg] mass of one blade; sets its wall thickness, so that its frequencies are unchanged.
      blade_stiffness: stiffness over that for equal strain, as of stiffer material; frequencies scale with its root.
      hub_mass: [kg] mass with pitch bearings and spinner.
      nacelle_mass: [kg] mass without rotor.
      tower_frequency: [Hz] frequency of the first fore-aft mode of the turbine; sets the diameter. By default the
        stress at rated wind speed is unchanged.
      yaw_rate: [rad/s] yaw rate.
      cut_in: [m/s] cut-in wind speed.
      cut_out: [m/s] cut-out wind speed.
      name: name of the new turbine.
      description: description of the new turbine.
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
        """Given values.

        Raises:
          InputError: a value is not positive, or both hub and tower height are given.
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
def scale_turbine(scaling: Scaling) -> Turbine:
    """Scale a reference turbine to another size and rating; the arguments are the fields of :class:`Scaling`.

    Values that are not given follow from the rules of docs/guide/scaling.md: geometric similarity at equal tip speed
    and specific power, and for deviations from it equal lift coefficient, strain, twist of the shaft and damping
    ratio. Pitch gains and optimal gain are scaled; ``tune_baseline`` computes them from the new rotor's aerodynamics.

    Returns:
      The new turbine.

    Raises:
      InputError: a number is not positive or implausible in SI units, both hub and tower height are given, or no
        turbine can have these numbers.
    """
    reference, given = scaling.reference, scaling.given()
    new_drive = {key: given.get(key, getattr(reference.drivetrain, key)) for key in ("gear_ratio", *EFFICIENCIES)}
    size = (scaling.rotor_diameter or reference.rotor_diameter) / reference.rotor_diameter
    power = scaling.rated_power or reference.rated_power * size**2
    factors = _factors(reference, given, power, new_drive)
    _plausible(given, reference, factors, power)
    content = reference.content()
    content["blade"] = scaled_blade(reference, factors, scaling.blade_mass, scaling.blade_stiffness)
    blade = validated(content["blade"], Blade, WHERE)
    before = inertia_of(reference.n_blades, reference.blade.structure, reference.hub, reference.nacelle)
    blade_masses = blade_moments(blade.structure, 0.0)[0] / before.blade
    hub = Hub.model_validate(scaled_hub(reference.hub, factors, blade_masses, scaling.hub_mass))
    nacelle = Nacelle.model_validate(scaled_nacelle(reference.nacelle, factors, scaling.nacelle_mass))
    now = inertia_of(reference.n_blades, blade.structure, hub, nacelle)
    if scaling.generator_inertia is not None:
        new_drive["generator_inertia"] = scaling.generator_inertia
    torque = power / math.prod(new_drive[key] for key in EFFICIENCIES) / (reference.rated_rotor_speed / factors.time)
    drive = scaled_drivetrain(reference, factors, (before.shaft, now.shaft), new_drive, torque)
    parts = ((before, reference.drivetrain.content()), (now, drive))
    inertias = [inertia.shaft + part["gear_ratio"] ** 2 * part["generator_inertia"] for inertia, part in parts]
    gain = inertias[1] / inertias[0]
    content |= {
        "name": scaling.name or f"{reference.name}-scaled",
        "description": scaling.description or f"{reference.name}, scaled",
        "rated_power": power,
        "cut_in": scaling.cut_in or reference.cut_in,
        "cut_out": scaling.cut_out or reference.cut_out,
        "hub": hub.content(),
        "nacelle": nacelle.content(),
        "drivetrain": drive,
        "yaw": scaled_yaw(reference, factors, now.yaw / before.yaw, scaling.yaw_rate),
        "tower": _tower(scaling, factors, nacelle, now),
        "pitch_actuator": scaled_actuator(reference, factors),
        "control": scaled_control(reference, factors, drive, power, gain, scaling.minimum_rotor_speed),
    }
    if reference.foundation is not None:
        content["foundation"] = scaled_foundation(reference.foundation, factors)
    _sources(content, reference)
    return validated(content, Turbine, WHERE)


def _tower(scaling: Scaling, factors: ScalingFactors, nacelle: Nacelle, now: Inertia) -> dict[str, Any]:
    """Content of ``Turbine.tower``, from its base to the hub height, with the mass on its top."""
    reference = scaling.reference
    above = nacelle.shaft_height + nacelle.overhang * math.sin(nacelle.tilt)
    ground = reference.tower.base_height * factors.length
    hub_above_ground = scaling.hub_height or reference.hub_height * factors.length
    length = scaling.tower_height or hub_above_ground - ground - above
    if length <= 0.0:
        raise InputError(
            f"{WHERE}: a hub height of {hub_above_ground:g} m leaves no length for the tower: its base is at "
            f"{ground:g} m and the hub {above:.3g} m above its top"
        )
    mass = now.rotor + nacelle.mass + reference.tower.top_mass * factors.moment
    top = TowerTopBody(mass, (now.rotor * above + nacelle.mass * nacelle.mass_centre[2]) / mass, 0.5 * now.shaft)
    return scaled_tower(reference.tower, factors, length, top, scaling.tower_frequency)


def _factors(reference: Turbine, given: dict[str, Any], power: float, drive: dict[str, float]) -> ScalingFactors:
    s = given.get("rotor_diameter", reference.rotor_diameter) / reference.rotor_diameter
    designed = design_ratio(reference)
    losses = math.prod(getattr(reference.drivetrain, key) / drive[key] for key in EFFICIENCIES)
    return ScalingFactors(
        length=s,
        time=reference.rated_rotor_speed / given["rotor_speed"] if "rotor_speed" in given else s,
        power=power / reference.rated_power * losses,
        gear=drive["gear_ratio"] / reference.drivetrain.gear_ratio,
        tip_speed_ratio=designed,
        slender=given["tip_speed_ratio"] / designed if "tip_speed_ratio" in given else 1.0,
    )


def _plausible(given: dict[str, Any], reference: Turbine, factors: ScalingFactors, power: float) -> None:
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
    """Replace the sources of the reference by a note on the scaling."""
    words = f"scaled from {reference.name}: docs/guide/scaling.md"
    content["source"] = f"scaled from {reference.name} by scale_turbine; {reference.source}".rstrip("; ")
    for key in ("blade", "hub", "nacelle", "drivetrain", "yaw", "tower", "pitch_actuator", "control", "foundation"):
        if content[key] is not None:
            content[key]["source"] = words
