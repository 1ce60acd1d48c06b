"""Records from YAML files and back, with errors that name file, line, key, expectation and remedy."""

from __future__ import annotations

import io
from collections.abc import Sequence
from pathlib import Path
from typing import Any, TypeVar, get_args

from pydantic import BaseModel, ValidationError

from meltemi.core.errors import InputError, did_you_mean
from meltemi.core.record import Record

R = TypeVar("R", bound=Record)


def read_record(path: str | Path, kind: type[R]) -> R:
    """Read one record from a YAML file.

    Raises:
      InputError: the file is missing, is not YAML, or does not describe a valid ``kind``; the message
        lists every problem with its line and key.
    """
    path = Path(path)
    try:
        text = path.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise InputError(f"{path}: no such file{_similar_file(path)}") from None
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: cannot be read as UTF-8 text ({error})") from None
    data = _parse(text, path)
    if not isinstance(data, dict):
        raise InputError(f"{path}: expected keys and values (a {kind.__name__}), found {type(data).__name__}")
    return validated(data, kind, where=str(path), text=text)


def validated(data: dict[str, Any], kind: type[R], where: str, text: str | None = None) -> R:
    """Make a record from plain data; problems are reported as in :func:`read_record`."""
    try:
        return kind.model_validate(data)
    except ValidationError as error:
        raise InputError(explain(error, kind, where, text)) from None
    except RecursionError:
        raise InputError(f"{where}: nested too deeply") from None


def write_record(record: Record, path: str | Path) -> None:
    """Write a record as YAML; reading it back gives an equal record."""
    from ruamel.yaml import YAML

    yaml = YAML(typ="safe", pure=True)
    yaml.default_flow_style = None
    yaml.sort_base_mapping_type_on_output = False  # type: ignore[assignment]
    yaml.width = 110
    buffer = io.StringIO()
    yaml.dump(record.model_dump(mode="json", exclude_none=True), buffer)
    Path(path).write_text(buffer.getvalue(), encoding="utf-8")


def _parse(text: str, path: Path) -> Any:
    from ruamel.yaml import YAML
    from ruamel.yaml.error import MarkedYAMLError, YAMLError

    try:
        return YAML(typ="safe").load(text)
    except MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        place = f"line {mark.line + 1}, column {mark.column + 1}: " if mark else ""
        raise InputError(f"{path}: {place}not valid YAML: {error.problem or error.context}") from None
    except (YAMLError, ValueError, RecursionError, TypeError, AttributeError, KeyError, IndexError) as error:
        raise InputError(
            f"{path}: not valid YAML: {str(error).splitlines()[0] if str(error) else type(error).__name__}"
        ) from None


def _similar_file(path: Path) -> str:
    folder = path.parent
    if not folder.is_dir():
        return f" (the folder {folder} does not exist either)"
    names = [p.name for p in folder.iterdir()]
    hint = did_you_mean(path.name, names)
    return f"; {hint}" if hint.startswith("did") else ""


def explain(error: ValidationError, kind: type[BaseModel], where: str, text: str | None = None) -> str:
    """All problems of a failed validation, one a line: where, key path, what is wrong, what to do."""
    lines: list[str] = []
    seen: set[tuple[tuple[int | str, ...], str]] = set()
    for problem in error.errors(include_url=False):
        location = tuple(problem["loc"])
        message = _message(problem, kind, location)
        if (location, message) in seen:
            continue
        seen.add((location, message))
        line = _line(text, location) if text is not None else None
        place = f"{where}:{line}" if line else where
        key = ".".join(str(part) for part in location)
        lines.append(f"{place}: {key}: {message}" if key else f"{place}: {message}")
    return "\n".join(lines)


def _message(problem: Any, kind: type[BaseModel], location: Sequence[int | str]) -> str:
    kind_of_error: str = problem["type"]
    if kind_of_error == "extra_forbidden":
        parent = _model_at(kind, location[:-1])
        valid = list(parent.model_fields) if parent else []
        return f"unknown key; {did_you_mean(str(location[-1]), valid)}"
    if kind_of_error == "missing":
        parent = _model_at(kind, location[:-1])
        doc = parent.model_fields[str(location[-1])].description if parent else None
        return f"missing{f' ({doc})' if doc else ''}"
    if kind_of_error in ("value_error", "assertion_error"):
        return str(problem["ctx"]["error"])
    message = problem["msg"].replace("Input should be", "expected").replace("a valid ", "a ")
    value = repr(problem["input"])
    return f"{message}, found {value if len(value) <= 60 else value[:57] + '...'}"


def _model_at(kind: type[BaseModel], location: Sequence[int | str]) -> type[BaseModel] | None:
    """The record class that a key path leads to, if it leads to one."""
    current: Any = kind
    for part in location:
        if isinstance(current, type) and issubclass(current, BaseModel):
            field = current.model_fields.get(str(part))
            if field is None:
                return None
            current = field.annotation
        candidates = [c for c in (current, *get_args(current)) if isinstance(c, type) and issubclass(c, BaseModel)]
        if candidates:
            current = candidates[0]
    return current if isinstance(current, type) and issubclass(current, BaseModel) else None


def _line(text: str, location: Sequence[int | str]) -> int | None:
    """Line in the YAML text at which a key path stands."""
    from ruamel.yaml import YAML
    from ruamel.yaml.error import YAMLError

    try:
        node = YAML(typ="rt").compose(text)
    except (YAMLError, ValueError):
        return None
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
