"""Error messages for invalid records: key path, expected value, remedy."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from types import UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import BaseModel, ValidationError

from meltemi.core.deferred import without_deferral
from meltemi.core.errors import InputError, PlacedError, did_you_mean, place_of
from meltemi.core.units import ANGULAR, in_degrees, unit_of

Keys = tuple[int | str, ...]
RANGES = ("greater_than", "greater_than_equal", "less_than", "less_than_equal")
"""Kinds of pydantic's problems that have a limit."""


def explain(
    error: ValidationError, kind: type[BaseModel], where: str, data: Any, line_of: Callable[[Keys], int | None] | None
) -> str:
    """All problems of a failed validation, one per line: location, key path, problem, remedy."""
    lines: list[str] = []
    reported: set[tuple[tuple[int | str, ...], str]] = set()
    for problem in error.errors(include_url=False):
        message = _message(problem, kind)
        location = _keys(problem, kind, data)
        if (location, message) in reported:
            continue
        reported.add((location, message))
        line = line_of(location) if line_of else None
        place = f"{where}:{line}" if line else where
        key = ".".join(str(part) for part in location)
        lines.append(f"{place}: {key}: {message}" if key else f"{place}: {message}")
    return "\n".join(lines)


def _keys(problem: Any, kind: type[BaseModel], data: Any) -> tuple[int | str, ...]:
    """The key path of a problem in the file, without the names of alternatives that pydantic inserts."""
    keys: list[int | str] = []
    error = problem.get("ctx", {}).get("error")
    place = (*problem["loc"], *(error.keys if isinstance(error, PlacedError) else ()))
    for i, part in enumerate(place):
        if _tagged(_annotations_at(kind, place[:i]), part):
            continue
        holds = isinstance(data, dict) and part in data
        if holds or (isinstance(data, list | tuple) and isinstance(part, int) and part < len(data)):
            data = data[part]
            keys.append(part)
        elif problem["type"] == "missing" and part == problem["loc"][-1]:
            keys.append(part)
    if problem["type"].startswith("union_tag"):
        keys.append(problem["ctx"]["discriminator"].strip("'"))
    return tuple(keys)


def _message(problem: Any, kind: type[BaseModel]) -> str:
    location, what, value = problem["loc"], problem["type"], problem["input"]
    if what == "extra_forbidden":
        parent = _record_at(kind, location[:-1])
        fields = parent.model_fields if parent else {}
        inside = {key: [n for r in _records(field.annotation) for n in r.model_fields] for key, field in fields.items()}
        return f"unknown key; {place_of(str(location[-1]), inside)}"
    if what == "missing":
        parent = _record_at(kind, location[:-1])
        doc = parent.model_fields[str(location[-1])].description if parent else None
        return f"missing{f' ({doc})' if doc else ''}"
    if what in ("value_error", "assertion_error"):
        return str(problem["ctx"]["error"])
    if what == "union_tag_not_found":
        by = problem["ctx"]["discriminator"].strip("'")
        tags = [v for r in _alternatives_at(kind, location) for v in get_args(r.model_fields[by].annotation)]
        return f"missing (one of {', '.join(repr(t) for t in tags)})"
    if what == "union_tag_invalid":
        tags = [tag.strip(" '") for tag in problem["ctx"]["expected_tags"].split(",")]
        tag = problem["ctx"]["tag"]
        return f"expected {', '.join(repr(t) for t in tags)}, found {tag!r}; {did_you_mean(tag, tags)}"
    message = problem["msg"].replace("Input should be", "expected").replace("a valid i", "an i")
    message = message.replace("a valid ", "a ").replace("a dictionary", "keys and values").replace("a tuple", "a list")
    if what in ("model_type", "model_attributes_type"):
        message = f"expected keys and values{_example(_asked(kind, problem), value)}"
    shown = "nothing" if value is None else repr(value)
    message = f"{message}, found {shown if len(shown) <= 60 else shown[:57] + '...'}"
    unit = _unit_at(kind, location)
    if what in RANGES and unit:
        message += f" {unit}"
    if unit in ANGULAR and what in RANGES:
        limit, so = next(iter(problem["ctx"].values())), f"{float(value):g} {unit.replace('rad', 'deg')}"
        message += f"; {limit:g} {unit} is {in_degrees(limit, unit)}, and {so} would be written so"
    elif unit in ANGULAR and isinstance(value, str):
        message += f"; a number is in {unit}, another unit is written behind it: 8 {unit.replace('rad', 'deg')}"
    elif unit and isinstance(value, str) and what not in RANGES:
        message += f"; a number is in {unit}"
    if what == "literal_error" and isinstance(value, str):
        near = did_you_mean(value, re.findall(r"'([^']*)'", problem["ctx"]["expected"]))
        message += f"; {near}" if near.startswith("did") else ""
    return message


def _asked(kind: type[BaseModel], problem: Any) -> list[type[BaseModel]]:
    """The record classes that are expected in place of a plain value."""
    alternatives = _alternatives_at(kind, problem["loc"])
    named = [record for record in alternatives if record.__name__ == problem.get("ctx", {}).get("class_name")]
    return named or alternatives


def _example(records: Sequence[type[BaseModel]], value: Any) -> str:
    """Example of a record in a file: the key that accepts ``value``, or the required keys."""
    if not records:
        return ""
    tagged = [record for record in records if value in _literals(record)] if isinstance(value, str) else []
    record = (tagged or records)[0]
    plain = isinstance(value, str | int | float) and not isinstance(value, bool)
    for key in [*record.model_fields][:3] if plain and len(records) == 1 else []:
        try:
            instance = record.model_validate({key: value})
        except InputError:
            continue
        if not isinstance(getattr(instance, key), bool):
            return f", for instance {{{key}: {value}}}"
    tags = {key: _tag(field.annotation) for key, field in record.model_fields.items()}
    chosen = [key for key, field in record.model_fields.items() if field.is_required() or tags[key]]
    if not chosen:
        return f" ({', '.join([*record.model_fields][:6])}{', ...' if len(record.model_fields) > 6 else ''})"
    shown = ", ".join(f"{key}: {tags[key] or '...'}" for key in chosen)
    return f" such as {{{shown}}}"


def _tag(annotation: Any) -> str:
    """The single permitted value of a key, which identifies an alternative."""
    values = get_args(annotation) if get_origin(annotation) is Literal else ()
    return str(values[0]) if len(values) == 1 else ""


def _unit_at(kind: type[BaseModel], location: Sequence[int | str]) -> str:
    """Unit of the field that a key path leads to, from its description; empty without one."""
    parent = _record_at(kind, location[:-1]) if location else None
    field = parent.model_fields.get(str(location[-1])) if parent else None
    return unit_of(field.description) if field else ""


def _record_at(kind: type[BaseModel], location: Sequence[int | str]) -> type[BaseModel] | None:
    """The record class that a key path leads to, if it leads to one."""
    records = _alternatives_at(kind, location)
    return records[0] if records else None


def _alternatives_at(kind: type[BaseModel], location: Sequence[int | str]) -> list[type[BaseModel]]:
    """The record classes a key path may lead to."""
    return [c for annotation in _annotations_at(kind, location) for c in _records(annotation)]


def _annotations_at(kind: type[BaseModel], location: Sequence[int | str]) -> list[Any]:
    annotations: list[Any] = [kind]
    for part in location:
        annotations = _tagged(annotations, part) or [inner for outer in annotations for inner in _inside(outer, part)]
    return annotations


def _tagged(annotations: list[Any], part: int | str) -> list[Any]:
    """The alternative with this tag or name, which pydantic inserts into the path; None for a key."""
    records = [c for one in annotations for c in _records(one)]
    return [c for c in records if c.__name__ == part or (len(records) > 1 and part in _literals(c))]


def _inside(outer: Any, part: int | str) -> list[Any]:
    """The annotations one level down a key path."""
    if isinstance(outer, type) and issubclass(outer, BaseModel):
        return _alternatives(outer.model_fields[str(part)].annotation) if part in outer.model_fields else []
    return _alternatives(get_args(outer)[-1 if isinstance(part, str) else 0]) if get_args(outer) else []


def _alternatives(annotation: Any) -> list[Any]:
    annotation = without_deferral(annotation)
    if get_origin(annotation) is Annotated:
        return _alternatives(get_args(annotation)[0])
    if get_origin(annotation) in (Union, UnionType):
        return [inner for member in get_args(annotation) for inner in _alternatives(member)]
    return [annotation]


def _records(annotation: Any) -> list[type[BaseModel]]:
    return [c for c in _alternatives(annotation) if isinstance(c, type) and issubclass(c, BaseModel)]


def _literals(record: type[BaseModel]) -> list[str]:
    """The values that distinguish alternatives."""
    annotations = (field.annotation for field in record.model_fields.values())
    return [value for a in annotations if get_origin(a) is Literal for value in get_args(a)]
