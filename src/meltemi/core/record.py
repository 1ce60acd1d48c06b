"""The one kind of record: validated, immutable, in SI, comparable, with a hash of its content."""

from __future__ import annotations

import hashlib
import json
from typing import Annotated, Any, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, BeforeValidator, ConfigDict, PlainSerializer, WithJsonSchema


def _read_only(value: Any) -> NDArray[np.float64]:
    try:
        array = np.array(value, dtype=np.float64)
    except (TypeError, ValueError):
        raise ValueError("expected numbers in a regular (rectangular) list") from None
    if not np.all(np.isfinite(array)):
        where = ", ".join(str(i + 1) for i in np.flatnonzero(~np.isfinite(array.reshape(-1)))[:5])
        raise ValueError(f"every entry must be a finite number; not so at entry {where}")
    array.setflags(write=False)
    return array


Array = Annotated[
    NDArray[np.float64],
    BeforeValidator(_read_only),
    PlainSerializer(lambda a: a.tolist(), return_type=list[Any]),
    WithJsonSchema({"type": "array", "items": {"type": "number"}}),
]
"""A read-only float array; written in files as a list of numbers."""


class Record(BaseModel):
    """Base of all described data: unknown keys are refused, nothing can be changed after creation."""

    model_config = ConfigDict(
        frozen=True,
        extra="forbid",
        arbitrary_types_allowed=True,
        use_attribute_docstrings=True,
        ser_json_inf_nan="strings",
    )

    def __eq__(self, other: object) -> bool:
        return type(self) is type(other) and self.content() == other.content()

    def __hash__(self) -> int:
        return hash(self.content_hash())

    def content(self) -> dict[str, Any]:
        """The record as nested dictionaries, lists, numbers and strings."""
        return self.model_dump(mode="python")

    def content_hash(self) -> str:
        """Hash of everything in the record; equal records have equal hashes."""
        text = json.dumps(self.content(), sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()[:16]

    def replace(self, **changes: Any) -> Self:
        """A validated copy with some fields changed; ``{"tower.height": 90.0}`` reaches deeper.

        Raises:
          pydantic.ValidationError: a changed field is unknown or its value not allowed.
        """
        data = self.content()
        for path, value in changes.items():
            *parents, last = path.split(".")
            target = data
            for key in parents:
                target = target[key]
            target[last] = value.content() if isinstance(value, Record) else value
        return type(self).model_validate(data)
