"""Templates of reports, by Jinja2: texts are escaped, and a name that is not there is an error; folders of reports."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined

from meltemi.core.errors import InputError

TEMPLATES = Path(__file__).with_name("templates")


def report_folder(path: str | Path) -> Path:
    """The folder of a report, created if needed.

    Raises:
      InputError: it cannot be created.
    """
    path = Path(path)
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{path}: cannot be written ({error.strerror or error})") from None
    return path


def templates(**filters: Callable[..., Any]) -> Environment:
    """The templates, with filters for their values."""
    environment = Environment(
        loader=FileSystemLoader(TEMPLATES),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=StrictUndefined,
    )
    environment.filters |= filters
    return environment
