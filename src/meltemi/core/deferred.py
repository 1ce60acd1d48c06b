"""Record classes of optional parts, imported with the first value that is given of them.

    if TYPE_CHECKING:
        from meltemi.turbine.gearbox import Gearbox
    else:
        Gearbox = deferred("meltemi.turbine.gearbox", "Gearbox")

A field ``gearbox: Gearbox | None = None`` then costs turbines without one nothing.
"""

from __future__ import annotations

from functools import cached_property
from importlib import import_module
from typing import Annotated, Any

from pydantic import TypeAdapter
from pydantic_core import core_schema


class Deferred:
    """Mark of a field whose record class is in ``module`` under ``name``."""

    def __init__(self, module: str, name: str) -> None:
        self.module, self.name = module, name

    @property
    def kind(self) -> Any:
        """The record class."""
        return getattr(import_module(self.module), self.name)

    @cached_property
    def adapter(self) -> TypeAdapter[Any]:
        return TypeAdapter(self.kind)  # of a class, or a union

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> Any:  # problems keep their places in the value
        return core_schema.no_info_plain_validator_function(lambda value: self.adapter.validator.validate_python(value))

    def __get_pydantic_json_schema__(self, schema: Any, handler: Any) -> Any:
        return handler(self.adapter.core_schema)


def deferred(module: str, name: str) -> Any:
    """Type of the fields of such a class."""
    return Annotated[Any, Deferred(module, name)]


def without_deferral(annotation: Any) -> Any:
    """The record class of such a type; another type unchanged."""
    marks = getattr(annotation, "__metadata__", ())
    return next((mark.kind for mark in marks if isinstance(mark, Deferred)), annotation)
