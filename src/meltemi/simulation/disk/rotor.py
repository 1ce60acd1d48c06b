"""Arrays of a power-coefficient turbine, and those of its cases."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from meltemi.aero.coefficient import RotorCoefficient, coefficient_arrays
from meltemi.aero.tables import AeroParameters
from meltemi.compiler import KernelRecord, Table, View
from meltemi.control.actuators import FlapActuators
from meltemi.core.errors import InputError, did_you_mean
from meltemi.environment.rain import rain_parameters
from meltemi.environment.site import Environment
from meltemi.simulation.disk.system import Disk, DiskFlow, DiskSystem
from meltemi.simulation.model import Model, Stations, actuator_array
from meltemi.simulation.options import ModelOptions
from meltemi.simulation.parts import ParameterTables, parts_of
from meltemi.simulation.system import COMMON_SIGNALS
from meltemi.structure.equations import N_SHAFT
from meltemi.structure.tables import StructureParameters
from meltemi.turbine.power_turbine import PowerTurbine
from meltemi.wind.fields import SharedTurbulence, Wind, WindBox

Float = NDArray[np.float64]

COORDINATES = ("yaw", "generator", "drivetrain")
OPTIONS = ("locked", "yaw", "nacelle_yaw", "time_step", "disk_points", "electrical")
"""Options that apply to such a turbine."""
GOLDEN = np.pi * (3.0 - np.sqrt(5.0))
"""[rad] golden angle, between successive points of the disk."""


@dataclass(frozen=True, repr=False)
class DiskRotor:
    """Rotor with a power coefficient; see ``simulation.model.Rotor``.

    Attributes:
      disk ... points: arrays of the kernels.
    """

    in_lanes: ClassVar[bool] = False
    system: ClassVar[type[KernelRecord]] = DiskSystem
    sections: ClassVar[type[KernelRecord]] = DiskSystem
    signals: ClassVar[dict[str, type[Table]]] = COMMON_SIGNALS | {"disk_flow": DiskFlow}
    parameter_tables: ClassVar[ParameterTables] = (
        (StructureParameters, "structure", ("gear_ratio", "generator_inertia", "shaft_stiffness", "shaft_damping")),
        (AeroParameters, "aero", ("air_density",)),
        (Disk, "disk", Disk.names),
        (RotorCoefficient, "coefficient", ("scale", "ratio_scale")),
    )
    n_core: ClassVar[int] = N_SHAFT
    n_flaps: ClassVar[int] = 0
    disk: Float
    coefficient: Float
    ratios: Float
    pitches: Float
    values: Float
    rain: Float
    points: Float

    def check(self, stations: Stations, turbine: PowerTurbine) -> None:
        """Raise InputError for any station."""
        if stations.blade or stations.tower:
            raise InputError(
                f"{turbine.name}: blade_stations and tower_stations need blades and a tower, which a power-coefficient "
                "turbine does not have"
            )

    def shapes(self, turbine: PowerTurbine, stations: Stations, lanes: bool) -> dict[str, tuple[int, ...]]:
        """Shapes of the signals."""
        return {name: t.shape(blade=turbine.n_blades, flap=0, mode=0) for name, t in self.signals.items()}

    def states(self, turbine: PowerTurbine, lanes: bool) -> dict[str, tuple[int, ...]]:
        """A power-coefficient turbine has no states of the aerodynamics."""
        return {}

    def arrays(self, turbine: PowerTurbine, wind: Wind, stations: Stations, lanes: bool) -> dict[str, Any]:
        """All other arrays of its records; a hub-height wind is evaluated at the hub."""
        return {
            **{field.name: getattr(self, field.name) for field in fields(self)},
            "points": self.points if isinstance(wind, WindBox | SharedTurbulence) else np.zeros((2, 1)),
            "columns": np.zeros((6, N_SHAFT)),
            "flap_actuators": FlapActuators.zeros(flap=0),
        }

    def share_slopes(self, slopes: dict[str, Any]) -> None:
        """No member shows an array twice."""

    def shown(self, arrays: dict[str, Any]) -> dict[str, Any]:
        """All arrays."""
        return arrays


DiskModel = Model[DiskRotor]


def build_disk(
    turbine: PowerTurbine, options: ModelOptions | None = None, environment: Environment | None = None
) -> DiskModel:
    """Make a model of a power-coefficient turbine.

    Raises:
      InputError: an option concerns a component that such a turbine does not have.
    """
    options, environment = options or ModelOptions(), environment or Environment()
    _refuse(turbine, options)
    shaft = turbine.drivetrain
    locked = np.zeros(N_SHAFT)
    for name in options.locked:
        if name not in COORDINATES:
            raise InputError(f"locked: no coordinate {name!r}: {did_you_mean(name, COORDINATES)}")
        locked[COORDINATES.index(name)] = 1.0
    locked[COORDINATES.index("yaw")] = 1.0  # the nacelle follows its drive
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
    rotor = DiskRotor(
        disk=disk.array,
        **coefficient_arrays(turbine.coefficient),
        rain=rain_parameters(environment.rain, turbine.rotor_radius).array,
        points=disk_points(turbine.rotor_radius, options.disk_points),
    )
    return Model(
        turbine=turbine,
        environment=environment,
        options=options,
        coordinates=COORDINATES,
        locked=locked,
        structure=structure.array,
        aero=aero.array,
        actuators=actuator_array(turbine, options),
        parts=parts_of(turbine, options, None),
        rotor=rotor,
    )


def _refuse(turbine: PowerTurbine, options: ModelOptions) -> None:
    """Raise InputError for options that would have no effect."""
    default = ModelOptions()
    for name in ModelOptions.model_fields:
        if name not in OPTIONS and getattr(options, name) != getattr(default, name):
            raise InputError(
                f"{turbine.name}: options.{name} concerns blades and tower, which a power-coefficient turbine "
                f"does not have; it has the options {', '.join(OPTIONS)}"
            )
    if options.yaw == "free":
        raise InputError(f"{turbine.name}: options.yaw 'free': its nacelle is rigid, 'held' or 'driven'")


def disk_points(radius: float, n: int) -> Float:
    """(2, n) [m] points on the disk from its centre, each for the same area: a spiral of the golden angle."""
    i = np.arange(n)
    r, turn = radius * np.sqrt((i + 0.5) / n), GOLDEN * i
    return np.ascontiguousarray([r * np.cos(turn), r * np.sin(turn)])
