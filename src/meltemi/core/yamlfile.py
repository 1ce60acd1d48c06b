"""Reading and writing of records as YAML; errors name file, line, key, expected value and remedy."""

from __future__ import annotations

import io
import math
import os
from collections.abc import Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any, TypeVar
from warnings import catch_warnings

from meltemi.core.errors import InputError, did_you_mean
from meltemi.core.files import bytes_of, write_text
from meltemi.core.record import COPY, Record, refused

R = TypeVar("R", bound=Record)
LARGEST = 32_000_000
"""[bytes] largest size of a file; the largest turbines known have 2 MB."""
MOST_ENTRIES = 3_000_000
"""Largest number of values of a file, aliases written out."""
LINE_BREAKS = {"\x85", "\u2028", "\u2029"}
"""Line breaks of YAML 1.1 beside the usual ones."""


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


def merged(below: Mapping[str, Any], above: Mapping[str, Any]) -> dict[str, Any]:
    """Merge nested keys; those of the second mapping take precedence."""
    result = dict(below)
    for key, value in above.items():
        inner = result.get(key)
        if isinstance(inner, Mapping) and isinstance(value, Mapping):
            value = merged(inner, value)
        result[key] = value
    return result


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
    """Create a record from plain data; errors are reported as in :func:`read_record`."""
    with refused(kind, data, where, lambda keys: _line(_nodes(text), keys) if text is not None else None):
        return super(Record, kind).model_validate(data)


def write_record(record: Record, path: str | Path) -> None:
    """Write a record as YAML; :func:`read_record` returns an equal record.

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
    """Parse the keys and values of a YAML text that describes ``what``.

    Raises:
      InputError: the text is not YAML, or not keys and values.
    """
    from ruamel.yaml import YAML
    from ruamel.yaml.error import MarkedYAMLError, YAMLError

    try:
        with catch_warnings(action="ignore"):  # of an anchor that is set twice, which YAML allows
            try:
                data = YAML(typ="safe", pure="%YAML" in text).load(text)  # by ruamel.yaml.clib, which reads no version
            except YAMLError:
                data = YAML(typ="safe", pure=True).load(text)  # slower; allows more, and its errors say more
        if _entries(data, {}) > MOST_ENTRIES:  # which also refuses what is nested too deeply
            raise ValueError(f"its aliases expand to more than {MOST_ENTRIES} values")
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
    """Number of values in nested data, with repetitions by aliases; infinite for recursive data."""
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


@lru_cache(maxsize=1)  # a text may have several problems
def _nodes(text: str) -> Any:
    """The nodes of a YAML text with their line numbers, parsed without comments."""
    from ruamel.yaml import YAML
    from ruamel.yaml.error import YAMLError

    try:
        with catch_warnings(action="ignore"):
            return YAML(typ="safe", pure=True).compose(text)
    except (YAMLError, ValueError):
        return None


def _line(node: Any, location: Sequence[int | str]) -> int | None:
    """Line of a key path below a node."""
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
