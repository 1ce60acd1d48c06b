"""What models of both kinds have: of blades and tower, and of a power coefficient."""

from __future__ import annotations

from dataclasses import fields, replace
from typing import Any, Protocol, TypeVar

from meltemi.core.display import Brief, brief
from meltemi.core.errors import InputError, did_you_mean
from meltemi.core.fingerprint import fingerprint
from meltemi.environment.site import Environment
from meltemi.maths.tables import Table
from meltemi.simulation.options import ModelOptions
from meltemi.turbine.power_turbine import AnyTurbine


class AnyModel(Protocol):
    """A turbine ready for kernels."""

    @property
    def turbine(self) -> AnyTurbine: ...
    @property
    def environment(self) -> Environment: ...
    @property
    def options(self) -> ModelOptions: ...
    @property
    def coordinates(self) -> tuple[str, ...]: ...
    @property
    def locked(self) -> Any: ...
    @property
    def actuators(self) -> Any: ...
    @property
    def n_blades(self) -> int: ...
    @property
    def n_core(self) -> int: ...
    @property
    def n_flaps(self) -> int: ...
    @property
    def has_electrical(self) -> bool: ...
    @property
    def parameter_tables(self) -> tuple[tuple[type[Table], str, tuple[str, ...]], ...]: ...
    def parameter_names(self) -> list[str]: ...
    def parameter(self, name: str) -> float: ...
    def find_parameter(self, name: str) -> tuple[str, int]: ...
    def content_hash(self) -> str: ...


Kind = TypeVar("Kind", bound=AnyModel)


class Parameters(Brief):
    """Scalar parameters by name, of a model that says in ``parameter_tables`` what it has.

    ``parameter_tables``: table, array of the model, and those of the table's names that are parameters.
    """

    def facts(self: AnyModel) -> dict[str, str]:
        """Turbine, coordinates, and the options and conditions that are not the usual ones."""
        told = {"turbine": self.turbine.name, "coordinates": ", ".join(self.coordinates)}
        given = {"options": self.options, "environment": self.environment}
        for name, record in given.items():
            told[name] = (
                ", ".join(f"{k}: {brief(v)}" for k, v in record if v != type(record)().__dict__[k]) or "default"
            )
        return told

    def __repr__(self: AnyModel) -> str:
        return f"{type(self).__name__}({self.turbine.name!r}, {len(self.coordinates)} coordinates)"

    @property
    def has_electrical(self: AnyModel) -> bool:
        """Whether generator, converters and grid are modelled."""
        return self.options.electrical == "averaged"

    def parameter_names(self: AnyModel) -> list[str]:
        """Names that :meth:`parameter` and :meth:`with_parameters` accept."""
        return [f"{table.title}.{name}" for table, _, names in self.parameter_tables for name in names]

    def parameter(self: AnyModel, name: str) -> float:
        """Value of a scalar parameter by its name, e.g. ``"structure.generator_inertia"``.

        Raises:
          InputError: unknown name; the message gives the closest ones.
        """
        array, row = self.find_parameter(name)
        return float(getattr(self, array)[row])

    def with_parameters(self: Kind, **values: float) -> Kind:
        """A model with some scalar parameters changed; dots in names are written as two underscores or
        given in a dictionary: ``model.with_parameters(**{"aerodynamics.air_density": 1.1})``."""
        changed: dict[str, Any] = {}
        for name, value in values.items():
            array, row = self.find_parameter(name.replace("__", "."))
            changed.setdefault(array, getattr(self, array).copy())[row] = value
        return replace(self, **changed)  # type: ignore[type-var]

    def find_parameter(self: AnyModel, name: str) -> tuple[str, int]:
        """Array of the model and row in it that hold a scalar parameter; InputError as :meth:`parameter`."""
        for table, array, names in self.parameter_tables:
            prefix = f"{table.title}."
            if name.startswith(prefix) and name[len(prefix) :] in names:
                return array, table.names.index(name[len(prefix) :])
        raise InputError(f"no parameter {name!r}: {did_you_mean(name, self.parameter_names())}")

    def content_hash(self: AnyModel) -> str:
        """Hash of everything that determines results of this model."""
        found = fingerprint([getattr(self, field.name) for field in fields(self)])  # type: ignore[arg-type]
        assert found is not None, "models have records and arrays only"
        return found
