"""Base class of records: validated, immutable, SI units, comparable, with a content hash."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache, partial, wraps
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Self

import numpy as np
from numpy.linalg import LinAlgError
from numpy.typing import NDArray
from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    PlainSerializer,
    SerializationInfo,
    SerializerFunctionWrapHandler,
    ValidationError,
    WithJsonSchema,
    model_serializer,
    model_validator,
)

from meltemi.core.display import brief, is_default, one_line
from meltemi.core.errors import InputError, place_of
from meltemi.core.problems import Keys, explain
from meltemi.core.shown import Shown
from meltemi.core.units import angular_unit, from_text

if TYPE_CHECKING:
    from meltemi.core.representation import Card

LARGEST = 1e50
"""No physical quantity in SI units is larger; the product of a few still fits a number of 64 bits."""


def _read_only(value: Any, *, gaps: bool = False) -> NDArray[np.float64]:
    try:
        array = np.array(value, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        raise ValueError("expected numbers in a regular (rectangular) list") from None
    infinite = np.isinf(array) if gaps else ~np.isfinite(array)
    for bad, must in ((infinite, "a finite number"), (np.abs(array) > LARGEST, f"at most {LARGEST:g}")):
        if bad.any():
            where = ", ".join(str(i + 1) for i in np.flatnonzero(bad)[:5])
            raise ValueError(f"every entry must be {must}; not so at entry {where}")
    array.setflags(write=False)
    return array


_Listed = Annotated[
    NDArray[np.float64],
    PlainSerializer(lambda a: a.tolist(), return_type=list[Any]),
    WithJsonSchema({"type": "array", "items": {"type": "number"}}),
]
Array = Annotated[_Listed, BeforeValidator(_read_only)]
"""A read-only float array of finite numbers; written in files as lists of numbers."""


def _flat(array: NDArray[np.float64]) -> NDArray[np.float64]:
    if array.ndim != 1:
        raise ValueError(f"expected a list of numbers, found {'a number' if array.ndim == 0 else 'lists in a list'}")
    return array


Vector = Annotated[Array, AfterValidator(_flat)]
"""An :data:`Array` of one dimension."""
Samples = Annotated[_Listed, BeforeValidator(partial(_read_only, gaps=True)), AfterValidator(_flat)]
"""A :data:`Vector` of samples, NaN where one is missing."""


def set_keys(data: dict[str, Any], path: str, value: Any) -> None:
    """Set a value in nested dictionaries, creating missing ones: ``set_keys(d, "hub.mass", 5e4)``."""
    *parts, last = path.split(".")
    for part in parts:
        inner = data.setdefault(part, {})
        data = inner if isinstance(inner, dict) else data
    data[last] = value


COPY = {"copy": True}
"""Context of a dump from which a record is created again."""


@cache
def _angular(kind: type[BaseModel]) -> dict[str, str]:
    """Angular fields of a record and their units, from their descriptions."""
    units = {name: angular_unit(field.description) for name, field in kind.model_fields.items()}
    return {name: unit for name, unit in units.items() if unit}


@contextmanager
def refused(
    kind: type[BaseModel], data: Any, where: str, line_of: Callable[[Keys], int | None] | None = None
) -> Iterator[None]:
    """Convert errors about the content of a record to InputError."""
    try:
        yield
    except ValidationError as error:
        raise InputError(explain(error, kind, where, data, line_of)) from None
    except InputError as error:  # raised while the record processed its fields
        raise InputError(f"{where}: {error}") from None
    except (ArithmeticError, LinAlgError) as error:
        raise InputError(f"{where}: a number is too small or too large to compute with ({error})") from None
    except RecursionError:
        raise InputError(f"{where}: nested too deeply") from None


class Record(Shown, BaseModel):
    """Base of all input records: unknown keys are errors, instances are immutable.

    Where a field's unit is rad, rad/s, rad/s^2 or rad/m, a text with a unit may replace the number: ``8 deg``.

    Raises:
      InputError: a value is not allowed, a field is missing or unknown, or one is given without its name.
    """

    model_config = ConfigDict(
        frozen=True,
        extra="forbid",
        arbitrary_types_allowed=True,
        use_attribute_docstrings=True,
        allow_inf_nan=False,
    )

    if not TYPE_CHECKING:

        @wraps(
            BaseModel.__init__
        )  # with this mark: records inside records are created without it, and their errors are reported together
        def __init__(self, *unnamed: Any, **data: Any) -> None:
            kind = type(self)
            if unnamed:
                given = [f"{name}={value!r}" for name, value in zip(kind.model_fields, unnamed, strict=False)]
                raise InputError(f"{kind.__name__}: fields are given by name: {kind.__name__}({', '.join(given)})")
            with refused(kind, data, kind.__name__):
                super().__init__(**data)

        @classmethod
        def model_validate(cls, obj: Any, **settings: Any) -> Self:
            with refused(cls, obj, cls.__name__):
                return super().model_validate(obj, **settings)

        def __setattr__(self, name: str, value: Any) -> None:
            try:
                super().__setattr__(name, value)
            except ValidationError:
                raise InputError(
                    f"{type(self).__name__} is frozen and cannot be changed: replace({name}=...) returns a changed copy"
                ) from None

    @model_validator(mode="before")
    @classmethod
    def _read_units(cls, data: Any) -> Any:
        if not isinstance(data, dict):
            return data
        for name, value in data.items():
            if isinstance(value, (int, float)) and LARGEST < abs(value) < float("inf"):
                raise ValueError(f"{name}: expected a number of at most {LARGEST:g}")
        return data | {name: from_text(data[name], unit) for name, unit in _angular(cls).items() if name in data}

    def __dir__(self) -> list[str]:
        return [name for name in super().__dir__() if name.startswith("__") or not hasattr(BaseModel, name)]

    def __eq__(self, other: object) -> bool:
        return type(self) is type(other) and self.content_hash() == other.content_hash()

    def __hash__(self) -> int:
        return hash(self.content_hash())

    def __repr__(self) -> str:
        kind = type(self).model_fields
        shown = {name: getattr(self, name) for name, field in kind.items() if field.repr}
        return one_line(
            type(self).__name__, {n: brief(value) for n, value in shown.items() if not is_default(value, kind[n])}
        )

    def __str__(self) -> str:
        return repr(self)

    def card(self) -> Card:
        """The card that notebooks show."""
        from meltemi.core.representation import record_card

        return record_card(self)

    def content(self) -> dict[str, Any]:
        """The record as nested dictionaries, lists, numbers and strings."""
        return self.model_dump(mode="python")

    def content_hash(self) -> str:
        """Hash of the content; equal records have equal hashes."""
        text = json.dumps(self.content(), sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()[:16]

    def replace(self, **changes: Any) -> Self:
        """A validated copy with changed fields; ``{"tower.height": 90.0}`` changes nested records.

        Raises:
          InputError: a path leads nowhere, or a value is not allowed.
        """
        data = self.model_dump(mode="python", context=COPY)
        target: Any
        for path, value in changes.items():
            target, last = {"": data}, ""
            for key in path.split("."):
                target, last = target[last], key
                if not isinstance(target, dict) or key not in target:
                    hint = f"nothing can hold {key!r}"
                    if isinstance(target, dict):
                        hint = place_of(key, {k: v if isinstance(v, dict) else () for k, v in target.items()})
                    raise InputError(f"{type(self).__name__} has no {path!r}: {hint}")
            target[last] = value.model_dump(mode="python", context=COPY) if isinstance(value, Record) else value
        return type(self).model_validate(data)


class Particular(Record):
    """A record with fields for which it matters whether they were set explicitly, also in copies and files."""

    WHEN_GIVEN: ClassVar[tuple[str, ...]] = ()
    """Names of the fields."""

    @model_validator(mode="before")
    @classmethod
    def _drop(cls, given: Any) -> Any:
        if not isinstance(given, dict):
            return given
        return {name: value for name, value in given.items() if value is not None or name not in cls.WHEN_GIVEN}

    @model_serializer(mode="wrap")
    def _leave_out(self, dump: SerializerFunctionWrapHandler, info: SerializationInfo) -> dict[str, Any]:
        data: dict[str, Any] = dump(self)
        if info.context is COPY:
            for name in set(self.WHEN_GIVEN) - self.model_fields_set:
                if info.exclude_none:
                    data.pop(name, None)
                else:
                    data[name] = None
        return data
