"""Hub, nacelle, drivetrain, yaw bearing and pitch actuator of a windIO file."""

from __future__ import annotations

import math
from typing import Any

from meltemi.core.units import rpm
from meltemi.exchange.windio.tree import Tree

DRIVE = "components.drivetrain"
DEGREE = math.pi / 180.0
HUB = {
    "radius": ("components.hub.diameter", 0.5),
    "precone": ("components.hub.cone_angle", DEGREE),
    "mass": ("components.hub.elastic_properties.mass", 1.0),
}
YAW = {"rate": ("control.yaw_rate", DEGREE)}
ACTUATOR = {
    "natural_frequency": ("control.pitch_actuator_frequency", 1.0),
    "damping_ratio": ("control.pitch_actuator_damping", 1.0),
    "rate_limit": ("control.max_pitch_rate", DEGREE),
    "minimum": ("control.min_pitch_limit", DEGREE),
    "maximum": ("control.max_pitch_limit", DEGREE),
}
"""Our keys from the paths of a windIO file, with the factor to SI units."""


def given(**values: Any) -> dict[str, Any]:
    """Dictionary of the available values only."""
    return {name: value for name, value in values.items() if value is not None}


def scaled(value: float | None, factor: float) -> float | None:
    """Convert an optional number to other units."""
    return None if value is None else value * factor


def read_hub(tree: Tree) -> dict[str, Any]:
    """Content of ``Turbine.hub``, as far as available in the file."""
    body = "components.hub.elastic_properties"
    inertia = tree.get(f"{body}.inertia")
    centre = tree.get(f"{body}.location")
    if centre is not None:
        why = "the format does not say whether x points up- or downwind; taken as downwind"
        tree.note("approximated", f"{body}.location", "centre of mass of the hub", why)
    return tree.quantities(HUB) | given(
        inertia=None if inertia is None else float(tree.numbers(f"{body}.inertia")[0]),
        mass_centre=None if centre is None else float(tree.numbers(f"{body}.location")[0]),
        source=tree.source,
    )


def read_nacelle(tree: Tree) -> dict[str, Any]:
    """Content of ``Turbine.nacelle``: the drivetrain with generator; the mass of the yaw system belongs to the tower.

    The format has positive tilt, a horizontal overhang and the height of the rotor apex above the tower
    top; here the overhang is along the shaft, and ``shaft_height`` is where shaft and yaw axis meet.
    """
    shape = f"{DRIVE}.outer_shape"
    tilt = scaled(tree.number(f"{shape}.uptilt"), DEGREE)
    along, apex = tree.number(f"{shape}.overhang"), tree.number(f"{shape}.distance_tt_hub")
    overhang = None if along is None else along / math.cos(tilt or 0.0)
    height = None if apex is None or along is None else apex - along * math.tan(tilt or 0.0)
    content = given(tilt=tilt, overhang=overhang, shaft_height=height, source=tree.source)
    body = f"{DRIVE}.elastic_properties"
    mass = tree.number(f"{body}.mass")
    if mass is None or tree.get(f"{body}.location") is None or tree.get(f"{body}.inertia") is None:
        return content
    centre, J = tree.numbers(f"{body}.location", 3), tree.numbers(f"{body}.inertia")[:3]
    tree.note("used", body, "nacelle", f"{mass:.6g} kg")
    tree.note("ignored", body, "products of inertia of the nacelle", "its axes are assumed to be principal axes")
    return content | {
        "mass": mass,
        "mass_centre": tuple(float(c) for c in centre),
        "roll_inertia": float(J[0]),
        "nod_inertia": float(J[1]),
        "yaw_inertia": float(J[2] + mass * (centre[0] ** 2 + centre[1] ** 2)),
    }


def read_drivetrain(tree: Tree) -> dict[str, Any]:
    """Content of ``Turbine.drivetrain``, as far as available in the file."""
    inertia = f"{DRIVE}.generator.elastic_properties.inertia"
    stiffness = tree.number(f"{DRIVE}.elastic_properties.spring_constant")
    damping = tree.number(f"{DRIVE}.elastic_properties.damping_coefficient")
    gearbox = f"{DRIVE}.gearbox.elastic_properties"
    if tree.get(f"{DRIVE}.generator.rpm_efficiency") is not None:
        efficiency = float(tree.curve(f"{DRIVE}.generator.rpm_efficiency")[1][-1])
        why = "that of the highest speed at all speeds"
        tree.note("approximated", f"{DRIVE}.generator.rpm_efficiency", "efficiency", why)
    else:
        efficiency = None
    return given(
        gear_ratio=tree.number(f"{DRIVE}.gearbox.gear_ratio"),
        generator_inertia=None if tree.get(inertia) is None else float(tree.numbers(inertia)[0]),
        stiffness=tree.number(f"{gearbox}.torsional_stiffness") if stiffness is None else stiffness,
        damping=tree.number(f"{gearbox}.torsional_damping") if damping is None else damping,
        generator_efficiency=efficiency,
        source=tree.source,
    )


def read_yaw(tree: Tree) -> dict[str, Any]:
    """Content of ``Turbine.yaw``: windIO has the yaw rate only."""
    return {**tree.quantities(YAW), "source": tree.source}


def read_actuator(tree: Tree) -> dict[str, Any]:
    """Content of ``Turbine.pitch_actuator``, as far as available in the file."""
    content: dict[str, Any] = {**tree.quantities(ACTUATOR), "source": tree.source}
    if "natural_frequency" not in content:
        content["kind"] = "ideal"
        tree.note("approximated", "control.pitch_actuator_frequency", "pitch actuator", "ideal: none is given")
    return content


def rotor_speed(tree: Tree, key: str) -> float | None:
    """Rotor speed [rad/s] from the file's ``control``, which is in rpm."""
    return scaled(tree.number(f"control.{key}"), rpm(1.0))
