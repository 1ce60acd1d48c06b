"""One number of a record at a time in a wrong unit: what validation and the check of plausibility say."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from math import pi
from typing import Any

import numpy as np

from meltemi.core.errors import InputError
from meltemi.core.record import Record

FACTORS = {"1e-3": 1e-3, "1e3": 1e3, "pi/180": pi / 180.0, "180/pi": 180.0 / pi, "0.3048": 0.3048}
Keys = tuple[str | int, ...]


def is_number(value: Any) -> bool:
    """Whether a value is a number, or a list of them."""
    if isinstance(value, bool | str) or value is None:
        return False
    if isinstance(value, int | float | np.ndarray):
        return True
    return isinstance(value, tuple | list) and bool(value) and all(isinstance(each, int | float) for each in value)


def numbers(record: Record, keys: Keys = ()) -> Iterator[tuple[Keys, Record, str]]:
    """Places of the numbers other than zero of a record: keys, record and field; of records alike one."""
    for name in type(record).model_fields:
        value = getattr(record, name)
        if is_number(value):
            if np.any(value):
                yield (*keys, name), record, name
            continue
        inside: Iterable[tuple[str | int, Any]] = ()
        if isinstance(value, Record):
            inside = [(name, value)]
        elif isinstance(value, tuple):
            inside = list(enumerate(value))
        elif isinstance(value, dict):
            inside = list(value.items())[::-1]
        seen: set[Any] = set()
        for key, each in inside:
            if isinstance(each, Record):
                at = (*keys, name) if each is value else (*keys, name, key)
                for place in numbers(each, at):
                    if (kind := (type(place[1]), place[2])) not in seen:
                        seen.add(kind)
                        yield place


def changed(record: Any, keys: Keys, factor: float) -> Any:
    """A record with one number times a factor, validated.

    Raises:
      InputError: it is refused.
    """
    if not keys:
        return [x * factor for x in record] if isinstance(record, tuple | list) else factor * record
    first, *others = keys
    if isinstance(record, tuple | list):
        return tuple(changed(e, tuple(others), factor) if i == first else e for i, e in enumerate(record))
    if isinstance(record, dict):
        return record | {first: changed(record[first], tuple(others), factor)}
    given = {name: getattr(record, name) for name in type(record).model_fields if name in record.model_fields_set}
    name = str(first)
    return type(record)(**(given | {name: changed(getattr(record, name), tuple(others), factor)}))


def field_of(record: Record, name: str) -> str:
    """Class and field, as in a list of exceptions."""
    return f"{type(record).__name__}.{name}"


def silent_tries(record: Record, say: Callable[[Any], Iterable[str]]) -> tuple[int, list[tuple[str, str]]]:
    """Number of tries, and those that are neither refused nor told of: field and factor."""
    tries, silent = 0, []
    for keys, inner, name in numbers(record):
        for label, factor in FACTORS.items():
            tries += 1
            try:
                told = any(say(changed(record, keys, factor)))
            except (InputError, ValueError, ArithmeticError):
                told = True
            if not told:
                silent.append((field_of(inner, name), label))
    return tries, silent
