"""The kind of rotor with a power coefficient, see ``simulation.rotors``."""

from __future__ import annotations

import math

from meltemi.simulation import vibrations
from meltemi.simulation.disk.channels import disk_channels, find_disk_channel
from meltemi.simulation.disk.point import disk_point
from meltemi.simulation.disk.rotor import DiskModel, build_disk
from meltemi.simulation.rotors import RotorKind

SHARE_OF_TIME = 0.1
"""Longest default time step over the time in which rated torque stops the rotor."""


def _disk_step(model: DiskModel) -> float:
    """[s] largest fraction of 0.05 s that does not exceed these limits."""
    longest = min(_disk_limits(model).values())
    return vibrations.OUTPUT_STEP / max(math.ceil(vibrations.OUTPUT_STEP / longest - 1e-9), 1)


def _disk_limits(model: DiskModel) -> dict[str, float]:
    """[s] longest time steps by cause: for torsion as for other turbines, for the speed a fraction of its time."""
    shaft, control = model.turbine.drivetrain, model.turbine.control
    inertia = model.parameter("disk.inertia") + shaft.gear_ratio**2 * model.parameter("structure.generator_inertia")
    speed = model.turbine.rated_rotor_speed
    cause = f"the rotor has little inertia for its power, drivetrain.rotor_inertia {shaft.rotor_inertia:g} kg m^2"
    limits = {cause: SHARE_OF_TIME * inertia * speed**2 / control.torque.rated_power}
    if shaft.stiffness is not None:
        other = shaft.gear_ratio**2 * shaft.generator_inertia
        frequency = math.sqrt(shaft.stiffness * (1.0 / shaft.rotor_inertia + 1.0 / other))
        cause = (
            f"drivetrain.stiffness {shaft.stiffness:g} N m/rad is large for drivetrain.rotor_inertia "
            f"{shaft.rotor_inertia:g} kg m^2 and drivetrain.generator_inertia {shaft.generator_inertia:g} kg m^2"
        )
        limits[cause] = vibrations.STEP_LIMIT / frequency
    return limits


def _disk_cause(model: DiskModel) -> str:
    limits = _disk_limits(model)
    return min(limits, key=limits.__getitem__)


KIND = RotorKind(
    build=build_disk,
    time_step=_disk_step,
    step_weights=lambda model, dt: 0.0,
    step_cause=_disk_cause,
    channels=lambda model, stations: disk_channels(model),
    channel=find_disk_channel,
    operating_point=disk_point,
    reach=lambda t: 0.0,
    brake_inertia=lambda t: t.drivetrain.inertia / t.drivetrain.gear_ratio**2,
    tables=("structure", "aero", "disk", "coefficient", "values", "actuators"),
)
