"""Hub, nacelle, drivetrain, yaw bearing, pitch actuator and control law of the scaled turbine."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from meltemi.studies.scaling.factors import ScalingFactors, multiply
from meltemi.turbine.definition import BladeStructure, Foundation, Hub, Nacelle, Turbine
from meltemi.turbine.gearbox import size_gearbox
from meltemi.turbine.moments import blade_moments

ABOVE_MINIMUM = 1.1
"""Rotor speed over a given smallest one, from which on the torque follows the optimal law."""

GEARBOX = {"radius": 1, "inertia": 5, "mass": 3, "mesh": 1, "stiffness": 3}
"""Powers of the length of a gearbox, by the last word of a quantity."""


@dataclass(frozen=True)
class Inertia:
    """Masses and inertias of a turbine.

    Attributes:
      blade: [kg] mass of one blade.
      rotor: [kg] mass of blades and hub.
      shaft: [kg m^2] inertia of the rotor about the shaft.
      yaw: [kg m^2] inertia of nacelle and rotor about the yaw axis; the rotor as a disk.
    """

    blade: float
    rotor: float
    shaft: float
    yaw: float


def inertia_of(n_blades: int, blade: BladeStructure, hub: Hub, nacelle: Nacelle) -> Inertia:
    """Masses and inertias of the parts of a turbine."""
    mass, about_shaft = blade_moments(blade, hub.radius)
    rotor, shaft = n_blades * mass + hub.mass, n_blades * about_shaft + hub.inertia
    return Inertia(mass, rotor, shaft, nacelle.yaw_inertia + 0.5 * shaft + rotor * nacelle.overhang**2)


def scaled_hub(hub: Hub, factors: ScalingFactors, blade_masses: float, mass: float | None) -> dict[str, Any]:
    """Content of ``Turbine.hub``: its mass is proportional to that of the blades (``blade_masses``, a factor)."""
    scaled = hub.mass * blade_masses if mass is None else mass
    content = hub.content()
    content["radius"] = hub.radius * factors.length
    content["mass"] = scaled
    content["inertia"] = hub.inertia * _over(scaled, hub.mass, blade_masses) * factors.length**2
    content["mass_centre"] = hub.mass_centre * factors.length
    return content


def scaled_nacelle(nacelle: Nacelle, factors: ScalingFactors, mass: float | None) -> dict[str, Any]:
    """Content of ``Turbine.nacelle``.

    Half of its mass (shaft, gearbox, brake, generator and transformer) scales with the rotor torque; the other half
    (bedplate, bearings, yaw system and cover) with its bending moment.
    """
    usual = 0.5 * (factors.torque + factors.moment)
    scaled = nacelle.mass * usual if mass is None else mass
    s = factors.length
    content = nacelle.content()
    content["mass"] = scaled
    content["mass_centre"] = tuple(x * s for x in nacelle.mass_centre)
    multiply(content, "overhang shaft_height", s)
    multiply(content, "yaw_inertia roll_inertia nod_inertia", _over(scaled, nacelle.mass, usual) * s**2)
    return content


def scaled_drivetrain(
    reference: Turbine, factors: ScalingFactors, shaft: tuple[float, float], given: dict[str, Any], torque: float
) -> dict[str, Any]:
    """Content of ``Turbine.drivetrain``.

    The twist under rated torque and the damping ratio of the torsion between rotor and generator are kept. The
    generator inertia scales with its torque to the power 5/3: its volume scales with its torque, its inertia with its
    volume to the power 5/3. The brake scales with the generator torque. A gearbox of the same ratio has the same
    stress under rated torque; one of another ratio is newly sized.

    Args:
      reference: reference turbine.
      factors: scaling factors.
      shaft: [kg m^2] inertia of the rotor about the shaft, of the reference and of the new turbine.
      given: keys that the caller sets.
      torque: [N m] rated torque of the new rotor.
    """
    drive = reference.drivetrain
    fast = factors.torque / factors.gear * given["gearbox_efficiency"] / drive.gearbox_efficiency
    content = drive.content()
    content["generator_inertia"] *= fast ** (5.0 / 3.0)
    content |= given
    stiffness = factors.torque
    reduced = [
        1.0 / (1.0 / rotor + 1.0 / (generator * ratio**2))
        for rotor, generator, ratio in (
            (shaft[0], drive.generator_inertia, drive.gear_ratio),
            (shaft[1], content["generator_inertia"], content["gear_ratio"]),
        )
    ]
    content["stiffness"] *= stiffness
    content["damping"] *= float(np.sqrt(stiffness * reduced[1] / reduced[0]))
    content["brake_torque"] *= fast
    if drive.gearbox is not None:
        same = content["gear_ratio"] == drive.gear_ratio
        gearbox = _similar(content["gearbox"], factors.torque) if same else None
        content["gearbox"] = gearbox or size_gearbox(ratio=content["gear_ratio"], rated_torque=torque).content()
    return content


def _similar(gearbox: dict[str, Any], torque: float) -> dict[str, Any]:
    """A gearbox scaled to another torque (a factor) at equal stresses: lengths scale with the cube root."""
    for stage in (*gearbox["planetary"], gearbox["parallel"] or {}):
        for key in stage:
            if power := GEARBOX.get(key.rsplit("_", 1)[-1]):
                multiply(stage, key, torque ** (power / 3.0))
    return gearbox


def scaled_yaw(reference: Turbine, factors: ScalingFactors, inertias: float, rate: float | None) -> dict[str, Any]:
    """Content of ``Turbine.yaw``: constant ratio of frequency to rotor speed, constant damping ratio.

    Friction and brake scale with the bending moment of the rotor.

    Args:
      reference: reference turbine.
      factors: scaling factors.
      inertias: factor of the inertia about the yaw axis.
      rate: [rad/s] yaw rate; unchanged by default, like the yaw acceleration, as the wind direction does not change
        faster for small turbines.
    """
    content = reference.yaw.content()
    content["stiffness"] *= inertias / factors.time**2
    content["damping"] *= inertias / factors.time
    content["rate"] = reference.yaw.rate if rate is None else rate
    multiply(content, "friction brake_torque", factors.moment)
    return content


def scaled_foundation(foundation: Foundation, factors: ScalingFactors) -> dict[str, Any]:
    """Content of ``Turbine.foundation``, by geometric similarity."""
    s = factors.length
    arm = np.array([1.0, 1.0, 1.0, s, s, s])
    content = foundation.content()
    for power, name in enumerate(("stiffness", "damping", "mass"), 1):
        value = np.asarray(content[name])
        content[name] = (s**power * arm[:, None] * arm if value.ndim else s**power) * value
    return content


def scaled_actuator(reference: Turbine, factors: ScalingFactors) -> dict[str, Any]:
    """Content of ``Turbine.pitch_actuator``: time constants proportional to the time of a revolution."""
    content = reference.pitch_actuator.content()
    multiply(content, "rate_limit natural_frequency", 1.0 / factors.time)
    if (friction := content["friction"]) is not None:  # sticking within the same angle
        multiply(friction, "torque", factors.moment)
        multiply(friction, "inertia", factors.moment * factors.time**2)
        multiply(friction, "diameter", factors.length)
    return content


def scaled_control(
    reference: Turbine,
    factors: ScalingFactors,
    drive: dict[str, Any],
    rated_power: float,
    inertias: float,
    minimum_speed: float | None,
) -> dict[str, Any]:
    """Content of ``Turbine.control``: the reference controller, scaled in speed, torque and time.

    The optimal gain is that of the same power coefficient at the new tip-speed ratio, at most that with rated
    power at rated speed. Pitch gains follow from the same sensitivity of power to pitch, over power.

    Args:
      reference: reference turbine.
      factors: scaling factors.
      drive: new drivetrain.
      rated_power: [W] electrical power.
      inertias: factor of the inertia of rotor and generator about the shaft.
      minimum_speed: [rad/s] rotor speed at which the torque begins.
    """
    old = reference.drivetrain
    mechanical = rated_power / reference.rated_power * old.generator_efficiency / drive["generator_efficiency"]
    content = reference.control.content()
    torque, pitch = content["torque"], content["pitch"]
    speed = factors.gear / factors.time
    multiply(torque, "cut_in_speed optimal_speed rated_speed", speed)
    if minimum_speed is not None:
        torque["cut_in_speed"] = minimum_speed * drive["gear_ratio"]
        torque["optimal_speed"] = ABOVE_MINIMUM * torque["cut_in_speed"]
    fast = mechanical / speed
    torque["rated_power"] *= mechanical
    torque["maximum_torque"] *= fast
    torque["rate_limit"] *= fast / factors.time
    gearbox = drive["gearbox_efficiency"] / old.gearbox_efficiency
    gain = torque["optimal_gain"] * factors.length**5 / (factors.slender * factors.gear) ** 3 * gearbox
    torque["optimal_gain"] = min(gain, _most(reference) * torque["rated_power"] / torque["rated_speed"] ** 3)
    pitch["reference_speed"] *= speed
    unit = inertias / (factors.time * factors.gear * factors.power)
    pitch["proportional_gain"] *= unit / factors.time
    pitch["integral_gain"] *= unit / factors.time**2
    for name in ("rate_limit", "motion_frequency"):
        pitch[name] /= factors.time
    pitch["motion_gain"] *= factors.time / factors.length
    content["filter_frequency"] /= factors.time
    return content


def _most(reference: Turbine) -> float:
    """Power of the optimal law at rated speed over rated power, if the reference exceeds it; otherwise 1."""
    law = reference.control.torque
    return max(1.0, law.optimal_gain * law.rated_speed**3 / law.rated_power)


def _over(mass: float, reference: float, usual: float) -> float:
    """Factor of a mass; the default factor if the reference has none."""
    return mass / reference if reference > 0.0 else usual
