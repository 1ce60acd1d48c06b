"""Records from YAML files and back, with errors that name file, line, key, expectation and remedy."""

from __future__ import annotations

import io
import math
import os
import re
from collections.abc import Sequence
from pathlib import Path
from types import UnionType
from typing import Annotated, Any, Literal, TypeVar, Union, get_args, get_origin

from pydantic import BaseModel, ValidationError

from meltemi.core.errors import InputError, did_you_mean
from meltemi.core.files import bytes_of, write_text
from meltemi.core.record import COPY, Record, refused
from meltemi.core.units import ANGULAR, in_degrees, unit_of

R = TypeVar("R", bound=Record)
LARGEST = 32_000_000
"""[bytes] of a file; the largest turbines known have 2 MB."""
RANGES = ("greater_than", "greater_than_equal", "less_than", "less_than_equal")
"""Kinds of pydantic's problems that have a limit."""
MOST_ENTRIES = 3_000_000
"""Values that a file may hold, aliases written out."""
LINE_BREAKS = {"\x85", "\u2028", "\u2029"}
"""Beside the usual ones, in YAML 1.1."""


def read_record(path: str | Path, kind: type[R]) -> R:
    """Read one record from a YAML file.

    Raises:
      InputError: the file is missing, is not YAML, or does not describe a valid ``kind``; the message
        lists every problem with its line and key.
    """
    path = Path(path)
    text = read_text(path)
    return validated(parse(text, path, f"a {kind.__name__}"), kind, where=str(path), text=text)


def read_mapping(path: str | Path) -> dict[str, Any]:
    """Keys and values of a YAML file.

    Raises:
      InputError: the file is missing, is not YAML, or holds something else.
    """
    return parse(read_text(Path(path)), Path(path))


def read_text(path: Path) -> str:
    """Content of a text file.

    Raises:
      InputError: the file is missing or no UTF-8 text.
    """
    try:
        return bytes_of(path, LARGEST).decode()
    except InputError:
        if os.path.lexists(path):
            raise
        raise InputError(f"{path}: no such file{_similar_file(path)}") from None
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: cannot be read as UTF-8 text ({error})") from None


def validated(data: dict[str, Any], kind: type[R], where: str, text: str | None = None) -> R:
    """Make a record from plain data; problems are reported as in :func:`read_record`."""
    with refused(kind, data, where, text):
        return super(Record, kind).model_validate(data)


def write_record(record: Record, path: str | Path) -> None:
    """Write a record as YAML; reading it back gives an equal record.

    Raises:
      InputError: the file cannot be written.
    """
    from ruamel.yaml import YAML

    yaml = YAML(typ="safe", pure=True)
    yaml.default_flow_style = None
    yaml.sort_base_mapping_type_on_output = False  # type: ignore[assignment]
    yaml.width = 110
    buffer = io.StringIO()
    content = record.model_dump(mode="json", exclude_none=True, context=COPY)
    yaml.dump(content, buffer)
    if set(buffer.getvalue()) & LINE_BREAKS:  # these must be escaped, which the writer does for all or none
        yaml.allow_unicode = False
        buffer = io.StringIO()
        yaml.dump(content, buffer)
    write_text(Path(path), buffer.getvalue())


def parse(text: str, path: Path, what: str = "") -> dict[str, Any]:
    """Keys and values of a YAML text, which describes ``what``.

    Raises:
      InputError: it is not YAML, or not keys and values.
    """
    from ruamel.yaml import YAML
    from ruamel.yaml.error import MarkedYAMLError, YAMLError

    try:
        data = YAML(typ="safe").load(text)
        if "*" in text and _entries(data, {}) > MOST_ENTRIES:
            raise ValueError(f"its aliases make more than {MOST_ENTRIES} values of it")
    except MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        place = f"line {mark.line + 1}, column {mark.column + 1}: " if mark else ""
        raise InputError(f"{path}: {place}not valid YAML: {error.problem or error.context}") from None
    except (YAMLError, ValueError, RecursionError, TypeError, AttributeError, KeyError, IndexError) as error:
        raise InputError(
            f"{path}: not valid YAML: {str(error).splitlines()[0] if str(error) else type(error).__name__}"
        ) from None
    if not isinstance(data, dict):
        described = f" ({what})" if what else ""
        raise InputError(f"{path}: expected keys and values{described}, found {type(data).__name__}")
    return data


def _entries(data: Any, known: dict[int, float]) -> float:
    """Values in nested lists and keys, each counted as often as aliases repeat it; no end if one holds itself."""
    if not isinstance(data, dict | list):
        return 1.0
    if id(data) not in known:
        known[id(data)] = math.inf
        inside = data.values() if isinstance(data, dict) else data
        known[id(data)] = 1.0 + sum(_entries(each, known) for each in inside)
    return known[id(data)]


def _similar_file(path: Path) -> str:
    try:
        names = [p.name for p in path.parent.iterdir()]
    except OSError:
        return f" (the folder {path.parent} does not exist either)"
    hint = did_you_mean(path.name, names)
    return f"; {hint}" if hint.startswith("did") else ""


def explain(error: ValidationError, kind: type[BaseModel], where: str, data: Any, text: str | None = None) -> str:
    """All problems of a failed validation, one a line: where, key path, what is wrong, what to do."""
    root = _nodes(text) if text is not None else None
    lines: list[str] = []
    seen: set[tuple[tuple[int | str, ...], str]] = set()
    for problem in error.errors(include_url=False):
        message = _message(problem, kind)
        location = _keys(problem, kind, data)
        if (location, message) in seen:
            continue
        seen.add((location, message))
        line = _line(root, location)
        place = f"{where}:{line}" if line else where
        key = ".".join(str(part) for part in location)
        lines.append(f"{place}: {key}: {message}" if key else f"{place}: {message}")
    return "\n".join(lines)


def _keys(problem: Any, kind: type[BaseModel], data: Any) -> tuple[int | str, ...]:
    """The key path of a problem as it stands in the file: pydantic adds names of alternatives that are no keys."""
    keys: list[int | str] = []
    for i, part in enumerate(problem["loc"]):
        if _tagged(_annotations_at(kind, problem["loc"][:i]), part):
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
        return f"unknown key; {did_you_mean(str(location[-1]), parent.model_fields if parent else [])}"
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
        limit, degrees = next(iter(problem["ctx"].values())), unit.replace("rad", "deg")
        message += f"; {limit:g} {unit} is {in_degrees(limit, unit)}, and {value:g} {degrees} would be written so"
    elif unit in ANGULAR and isinstance(value, str):
        message += f"; a number is in {unit}, another unit is written behind it: 8 {unit.replace('rad', 'deg')}"
    if what == "literal_error" and isinstance(value, str):
        near = did_you_mean(value, re.findall(r"'([^']*)'", problem["ctx"]["expected"]))
        message += f"; {near}" if near.startswith("did") else ""
    return message


def _asked(kind: type[BaseModel], problem: Any) -> list[type[BaseModel]]:
    """The record classes of which a plain value stands in the place."""
    found = _alternatives_at(kind, problem["loc"])
    named = [record for record in found if record.__name__ == problem.get("ctx", {}).get("class_name")]
    return named or found


def _example(records: Sequence[type[BaseModel]], value: Any) -> str:
    """The keys of a record as they may stand in a file: the one that takes ``value``, or those it cannot do without."""
    if not records:
        return ""
    tagged = [record for record in records if value in _literals(record)] if isinstance(value, str) else []
    record = (tagged or records)[0]
    plain = isinstance(value, str | int | float) and not isinstance(value, bool)
    for key in [*record.model_fields][:3] if plain and len(records) == 1 else []:
        try:
            made = record.model_validate({key: value})
        except InputError:
            continue
        if not isinstance(getattr(made, key), bool):
            return f", for instance {{{key}: {value}}}"
    tags = {key: _tag(field.annotation) for key, field in record.model_fields.items()}
    chosen = [key for key, field in record.model_fields.items() if field.is_required() or tags[key]]
    if not chosen:
        return f" ({', '.join([*record.model_fields][:6])}{', ...' if len(record.model_fields) > 6 else ''})"
    shown = ", ".join(f"{key}: {tags[key] or '...'}" for key in chosen)
    return f" such as {{{shown}}}"


def _tag(annotation: Any) -> str:
    """The value of a key that has only one: it tells alternatives apart."""
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
    return [c for c in _annotations_at(kind, location) if isinstance(c, type) and issubclass(c, BaseModel)]


def _annotations_at(kind: type[BaseModel], location: Sequence[int | str]) -> list[Any]:
    found: list[Any] = [kind]
    for part in location:
        found = _tagged(found, part) or [inner for outer in found for inner in _inside(outer, part)]
    return found


def _tagged(found: list[Any], part: int | str) -> list[Any]:
    """Of several alternatives the one with this tag or name, which pydantic puts into the path; nothing for a key."""
    records = [c for c in found if isinstance(c, type) and issubclass(c, BaseModel)]
    return [c for c in records if c.__name__ == part or (len(records) > 1 and part in _literals(c))]


def _inside(outer: Any, part: int | str) -> list[Any]:
    """The annotations one step down a key path."""
    if isinstance(outer, type) and issubclass(outer, BaseModel):
        return _alternatives(outer.model_fields[str(part)].annotation) if part in outer.model_fields else []
    return _alternatives(get_args(outer)[-1 if isinstance(part, str) else 0]) if get_args(outer) else []


def _alternatives(annotation: Any) -> list[Any]:
    if get_origin(annotation) is Annotated:
        return _alternatives(get_args(annotation)[0])
    if get_origin(annotation) in (Union, UnionType):
        return [inner for member in get_args(annotation) for inner in _alternatives(member)]
    return [annotation]


def _literals(record: type[BaseModel]) -> list[str]:
    """The values by which alternatives tell each other apart."""
    annotations = (field.annotation for field in record.model_fields.values())
    return [value for a in annotations if get_origin(a) is Literal for value in get_args(a)]


def _nodes(text: str) -> Any:
    """The nodes of a YAML text, which know their lines; read without comments, which not every place may have."""
    from ruamel.yaml import YAML
    from ruamel.yaml.error import YAMLError

    try:
        return YAML(typ="safe", pure=True).compose(text)
    except (YAMLError, ValueError):
        return None


def _line(node: Any, location: Sequence[int | str]) -> int | None:
    """Line at which a key path stands below a node."""
    line: int | None = None
    for part in location:
        if node is None or not isinstance(node.value, list):
            break
        if isinstance(part, int):
            if part >= len(node.value) or isinstance(node.value[part], tuple):
                break
            node = node.value[part]
            line = node.start_mark.line + 1
            continue
        for key, value in (entry for entry in node.value if isinstance(entry, tuple)):
            if key.value == part:
                line, node = key.start_mark.line + 1, value
                break
        else:
            break
    return line
