"""Models: a turbine with options in an environment, as arrays for the kernels."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar, Generic, NamedTuple, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from meltemi.compiler import KernelRecord, Table
from meltemi.control.actuators import Actuators
from meltemi.core.errors import InputError, did_you_mean
from meltemi.core.fingerprint import fingerprint
from meltemi.core.shown import Brief, Viewed
from meltemi.core.variants import number
from meltemi.environment.site import Environment
from meltemi.simulation.options import ModelOptions
from meltemi.simulation.parts import ParameterTables, Part
from meltemi.structure.equations import GENERATOR, N_SHAFT, TORSION, YAW
from meltemi.turbine.exchange import ActuatorModel
from meltemi.turbine.plausibility import plausibility_warnings
from meltemi.wind.fields import Wind

if TYPE_CHECKING:
    from meltemi.core.representation import Card
    from meltemi.turbine.power_turbine import AnyTurbine

Float = NDArray[np.float64]


@dataclass(frozen=True)
class Stations:
    """Stations of section loads [m]: along the blades from the root, along the tower from its base.

    The tower base is always the first station of the tower.
    """

    blade: tuple[float, ...] = ()
    tower: tuple[float, ...] = ()


class Rotor(Protocol):
    """Interface of a kind of rotor to models and cases, including its tower and shaft.

    Attributes:
      in_lanes: whether the nodes may be evaluated in lanes.
      system, sections: classes of the records of its kernels, for evaluations and for section loads.
      parameter_tables: table, array and names of the scalar parameters of a model.
      signals: tables of the arrays that channels may record, by array; q, v and a are additional.
      n_core: number of coordinates except those of the blades.
      n_flaps: number of flaps of each blade.
    """

    in_lanes: ClassVar[bool]
    sections: ClassVar[type[KernelRecord]]
    parameter_tables: ClassVar[ParameterTables]
    signals: ClassVar[dict[str, type[Table]]]

    @property
    def system(self) -> type[KernelRecord]: ...
    @property
    def n_core(self) -> int: ...
    @property
    def n_flaps(self) -> int: ...

    def check(self, stations: Stations, turbine: Any) -> None:
        """Raise InputError for stations outside this turbine."""

    def shapes(self, turbine: Any, stations: Stations, lanes: bool) -> dict[str, tuple[int, ...]]:
        """Shapes of the signals."""

    def states(self, turbine: Any, lanes: bool) -> dict[str, tuple[int, ...]]:
        """Shapes of the states and memory of the aerodynamics."""

    def arrays(self, turbine: Any, wind: Wind, stations: Stations, lanes: bool) -> dict[str, Any]:
        """All other arrays of its records."""

    def shown(self, arrays: dict[str, Any]) -> dict[str, Any]:
        """The arrays without the nodes that pad the last lanes."""


R = TypeVar("R", bound=Rotor)


class Rows(NamedTuple):
    """Indices of coordinates of a turbine."""

    yaw: int
    generator: int
    torsion: int


def rows_of(n_core: int) -> Rows:
    """Indices in the coordinates, of which all but those of the blades are ``n_core``."""
    n = n_core - N_SHAFT
    return Rows(n + YAW, n + GENERATOR, n + TORSION)


@dataclass(frozen=True, repr=False)
class Model(Brief, Viewed, Generic[R]):
    """A turbine with options and environment as arrays for the kernels.

    Attributes:
      turbine, environment, options: the description that it was built from.
      coordinates: names of the generalised coordinates, in their order.
      locked ... actuators: arrays of the kernels, see the tables of their layers.
      rotor: blades and tower, or a disk with a power coefficient.
      parts: further parts of the machine, such as an electrical system.
    """

    turbine: Any
    environment: Environment
    options: ModelOptions
    coordinates: tuple[str, ...]
    locked: Float
    structure: Float
    aero: Float
    actuators: Float
    rotor: R
    parts: tuple[Part, ...] = ()

    @property
    def n_blades(self) -> int:
        return int(self.turbine.n_blades)

    @property
    def n_core(self) -> int:
        """Number of coordinates except those of the blades."""
        return self.rotor.n_core

    @property
    def rows(self) -> Rows:
        """Indices of yaw, generator and torsion in the coordinates."""
        return rows_of(self.n_core)

    @property
    def n_flaps(self) -> int:
        """Number of flaps of each blade."""
        return self.rotor.n_flaps

    @property
    def has_electrical(self) -> bool:
        """Whether generator, converters and grid are modelled."""
        return self.options.electrical == "averaged"

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.turbine.name!r}, {len(self.coordinates)} coordinates)"

    def card(self) -> Card:
        """Turbine, coordinates, options and environment."""
        from meltemi.core.representation import Card, Fold
        from meltemi.turbine.key_figures import summary

        locked = int(self.locked.sum())
        facts = [
            ("coordinates", f"{len(self.coordinates)}{f', {locked} of them locked' if locked else ''}"),
            ("blades", f"{self.options.blade_model}, stall {self.options.stall}, inflow {self.options.inflow}"),
            ("air density", f"{self.environment.density:.4g} kg/m^3"),
        ]
        if not hasattr(self.turbine, "blade"):
            facts[1] = ("rotor", f"power coefficient, {self.turbine.coefficient.kind}")
        numbered = [
            (name, "locked" if fixed else "free") for name, fixed in zip(self.coordinates, self.locked, strict=True)
        ]
        sections = [
            Fold("Coordinates", numbered, note=str(len(numbered))),
            self.options.card().folded("Options"),
            self.environment.card().folded("Environment"),
            self.turbine.card().folded("Turbine"),
        ]
        return Card("Model", summary(self.turbine), facts, sections)

    @property
    def parameter_tables(self) -> ParameterTables:
        """Table, array and names of the scalar parameters."""
        common: ParameterTables = ((Actuators, "actuators", Actuators.names),)
        return sum((part.parameter_tables for part in self.parts), self.rotor.parameter_tables + common)

    def parameter_names(self) -> list[str]:
        """Names that :meth:`parameter` and :meth:`with_parameters` accept."""
        return [f"{table.title}.{name}" for table, _, names in self.parameter_tables for name in names]

    def parameter(self, name: str) -> float:
        """Value of a scalar parameter by name, e.g. ``"structure.generator_inertia"``.

        Raises:
          InputError: unknown name; the message lists the closest names.
        """
        array, row = self.find_parameter(name)
        return float(self.array(array)[row])

    def array(self, name: str) -> Float:
        """An array of the model, of its rotor or of a part."""
        array: Float = next(getattr(each, name) for each in (self, self.rotor, *self.parts) if hasattr(each, name))
        return array

    def with_arrays(self, **changed: Float) -> Model[R]:
        """A model with some arrays replaced."""
        left = dict(changed)

        def changed_copy(of: Any, **more: Any) -> Any:
            replaced = {field.name: left.pop(field.name) for field in fields(of) if field.name in left}
            return replace(of, **replaced, **more) if replaced or more else of

        parts = tuple(changed_copy(part) for part in self.parts)
        rotor = changed_copy(self.rotor)
        model: Model[R] = changed_copy(self, rotor=rotor, parts=parts)
        assert not left, f"no arrays {', '.join(left)}"
        return model

    def with_parameters(self, **values: float) -> Model[R]:
        """A model with some scalar parameters changed; dots in names are written as two underscores or
        given in a dictionary: ``model.with_parameters(**{"aerodynamics.air_density": 1.1})``."""
        changed: dict[str, Any] = {}
        for name, value in values.items():
            array, row = self.find_parameter(name.replace("__", "."))
            changed.setdefault(array, self.array(array).copy())[row] = value
        return self.with_arrays(**changed)

    def find_parameter(self, name: str) -> tuple[str, int]:
        """Array of the model and row in it that hold a scalar parameter; InputError as :meth:`parameter`."""
        for table, array, names in self.parameter_tables:
            prefix = f"{table.title}."
            if name.startswith(prefix) and name[len(prefix) :] in names:
                return array, table.names.index(name[len(prefix) :])
        raise InputError(f"no parameter {name!r}: {did_you_mean(name, self.parameter_names())}")

    @cached_property
    def doubts(self) -> tuple[str, ...]:
        """Warnings about implausible data of the turbine."""
        return plausibility_warnings(self.turbine)

    def content_hash(self) -> str:
        """Hash of all data that determine the results of this model."""
        return self._hash

    @cached_property
    def _hash(self) -> str:
        digest = fingerprint([getattr(self, field.name) for field in fields(self)])
        assert digest is not None, "models have records and arrays only"
        return digest


def actuator_array(turbine: AnyTurbine, options: ModelOptions) -> Float:
    """Parameters of pitch actuators, brake and yaw drive."""
    p = Actuators(Actuators.zeros())
    a, yaw = turbine.pitch_actuator, turbine.yaw
    p.pitch_model = number(ActuatorModel, a.kind)
    p.pitch_frequency, p.pitch_damping, p.pitch_rate = a.natural_frequency, a.damping_ratio, a.rate_limit
    p.pitch_minimum, p.pitch_maximum = a.minimum, a.maximum
    if a.friction is not None:
        p.pitch_friction = a.friction.torque / a.friction.inertia
    p.brake_torque = turbine.drivetrain.brake_torque
    p.yaw_rate = yaw.rate if options.yaw == "driven" else 0.0
    p.yaw_acceleration = yaw.acceleration or 0.0
    p.yaw_hold = -1.0
    return p.array
