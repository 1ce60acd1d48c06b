"""A turbine of a power coefficient ready for its kernels."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from meltemi.aero.coefficient import RotorCoefficient, coefficient_arrays
from meltemi.aero.tables import AeroParameters
from meltemi.control.actuators import Actuators
from meltemi.core.errors import InputError, did_you_mean
from meltemi.electrical.tables import ElectricalParameters
from meltemi.environment.rain import rain_parameters
from meltemi.environment.site import Environment
from meltemi.maths.tables import Table, View
from meltemi.simulation.machine import Parameters
from meltemi.simulation.model import electrical_of
from meltemi.simulation.options import ModelOptions
from meltemi.simulation.disk import Disk
from meltemi.structure.kinematics import N_SHAFT
from meltemi.structure.tables import StructureParameters
from meltemi.turbine.power_turbine import PowerTurbine

Float = NDArray[np.float64]

COORDINATES = ("yaw", "generator", "drivetrain")
OPTIONS = ("locked", "yaw", "time_step", "disk_points", "electrical")
"""Options that say something to such a turbine."""
GOLDEN = np.pi * (3.0 - np.sqrt(5.0))
"""[rad] from point to point of the disk."""


@dataclass(frozen=True, repr=False)
class PowerModel(Parameters):
    """A turbine of a power coefficient, ready for the kernels.

    Attributes:
      turbine, environment, options: what it was built from.
      coordinates: names of the generalised coordinates; without a stiffness of the shaft its torsion is locked.
      locked ... actuators: arrays of the kernels.
    """

    turbine: PowerTurbine
    environment: Environment
    options: ModelOptions
    coordinates: tuple[str, ...]
    locked: Float
    structure: Float
    aero: Float
    disk: Float
    coefficient: Float
    ratios: Float
    pitches: Float
    values: Float
    rain: Float
    points: Float
    actuators: Float
    electrical: Float

    @property
    def n_blades(self) -> int:
        return self.turbine.n_blades

    @property
    def n_core(self) -> int:
        """Coordinates below the blades."""
        return N_SHAFT

    @property
    def n_flaps(self) -> int:
        """None."""
        return 0

    @property
    def parameter_tables(self) -> tuple[tuple[type[Table], str, tuple[str, ...]], ...]:
        """Table, array and names of the scalar parameters."""
        return (
            (*_PARAMETERS, (ElectricalParameters, "electrical", ElectricalParameters.names))
            if self.has_electrical
            else _PARAMETERS
        )


SHAFT = ("gear_ratio", "generator_inertia", "shaft_stiffness", "shaft_damping")
_PARAMETERS: tuple[tuple[type[Table], str, tuple[str, ...]], ...] = (
    (StructureParameters, "structure", SHAFT),
    (AeroParameters, "aero", ("air_density",)),
    (Disk, "disk", Disk.names),
    (RotorCoefficient, "coefficient", ("scale", "ratio_scale")),
    (Actuators, "actuators", Actuators.names),
)


def build_power(
    turbine: PowerTurbine, options: ModelOptions | None = None, environment: Environment | None = None
) -> PowerModel:
    """Make a model of a turbine of a power coefficient.

    Raises:
      InputError: an option concerns what such a turbine does not have.
    """
    options, environment = options or ModelOptions(), environment or Environment()
    _refuse(turbine, options)
    shaft = turbine.drivetrain
    locked = np.zeros(N_SHAFT)
    for name in options.locked:
        if name not in COORDINATES:
            raise InputError(f"locked: no coordinate {name!r}: {did_you_mean(name, COORDINATES)}")
        locked[COORDINATES.index(name)] = 1.0
    locked[COORDINATES.index("yaw")] = 1.0  # it stands where its drive has turned it
    if shaft.stiffness is None:
        locked[COORDINATES.index("drivetrain")] = 1.0
    structure, aero, disk = (
        View(StructureParameters, StructureParameters.zeros()),
        View(AeroParameters, AeroParameters.zeros()),
        View(Disk, Disk.zeros()),
    )
    structure["gravity"], structure["tower_length"] = environment.gravity, turbine.hub_height
    structure["gear_ratio"], structure["generator_inertia"] = shaft.gear_ratio, shaft.generator_inertia
    structure["shaft_stiffness"], structure["shaft_damping"] = shaft.stiffness or 0.0, shaft.damping
    structure["yaw_stiffness"] = 1.0
    aero["air_density"] = environment.density
    disk["radius"], disk["inertia"], disk["friction"] = turbine.rotor_radius, shaft.rotor_inertia, shaft.friction
    disk["power_exponent"], disk["thrust_exponent"] = turbine.power_yaw_exponent, turbine.thrust_yaw_exponent
    known = coefficient_arrays(turbine.coefficient)
    return PowerModel(
        turbine=turbine,
        environment=environment,
        options=options,
        coordinates=COORDINATES,
        locked=locked,
        structure=structure.array,
        aero=aero.array,
        disk=disk.array,
        coefficient=known.parameters,
        ratios=known.ratios,
        pitches=known.pitches,
        values=known.values,
        rain=rain_parameters(environment.rain, turbine.rotor_radius).array,
        points=disk_points(turbine.rotor_radius, options.disk_points),
        actuators=_actuators(turbine, options),
        electrical=electrical_of(turbine, options),
    )


def _refuse(turbine: PowerTurbine, options: ModelOptions) -> None:
    """Options that would change nothing are a misunderstanding."""
    default = ModelOptions()
    for name in ModelOptions.model_fields:
        if name not in OPTIONS and getattr(options, name) != getattr(default, name):
            raise InputError(
                f"{turbine.name}: options.{name} concerns blades and tower, which a turbine of a power coefficient "
                f"does not have; it has the options {', '.join(OPTIONS)}"
            )
    if options.yaw == "free":
        raise InputError(f"{turbine.name}: options.yaw 'free': its nacelle is rigid, 'held' or 'driven'")


def disk_points(radius: float, n: int) -> Float:
    """(2, n) [m] places on the disk from its centre, each for the same area: a spiral of the golden angle."""
    i = np.arange(n)
    r, turn = radius * np.sqrt((i + 0.5) / n), GOLDEN * i
    return np.ascontiguousarray([r * np.cos(turn), r * np.sin(turn)])


def _actuators(turbine: PowerTurbine, options: ModelOptions) -> Float:
    v = View(Actuators, Actuators.zeros())
    a = turbine.pitch_actuator
    v["pitch_ideal"] = float(a.kind == "ideal")
    v["pitch_frequency"], v["pitch_damping"], v["pitch_rate"] = a.natural_frequency, a.damping_ratio, a.rate_limit
    v["pitch_minimum"], v["pitch_maximum"] = a.minimum, a.maximum
    v["brake_torque"] = turbine.drivetrain.brake_torque
    v["yaw_rate"] = turbine.yaw.rate if options.yaw == "driven" else 0.0
    v["yaw_acceleration"], v["yaw_hold"] = turbine.yaw.acceleration or 0.0, -1.0
    return v.array
