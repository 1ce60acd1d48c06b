"""Title block of a report: project, author, revision, date."""

from __future__ import annotations

import datetime
from pathlib import Path
from typing import Annotated, Any

from pydantic import BeforeValidator, Field

from meltemi.core.record import Record
from meltemi.core.yamlfile import read_record

FILE = "project.yaml"
"""Name of the file in the folder of a load base."""


def _text(value: Any) -> Any:
    """A number or a date as text, since YAML reads ``revision: 2`` and ``date: 2026-05-04`` as such."""
    plain = isinstance(value, int | float | datetime.date) and not isinstance(value, bool)
    return str(value) if plain else value


Text = Annotated[str, BeforeValidator(_text)]


class Project(Record):
    """Title block of a report."""

    project: Text = Field(min_length=1)
    """Name of the project."""
    document: Text = ""
    """Number of the document."""
    author: str = ""
    """Author of the document."""
    checked: str = ""
    """Person who checked the document."""
    approved: str = ""
    """Person who approved the document."""
    revision: Text = ""
    """Revision, such as A or 1.2."""
    date: Text = ""
    """Date of the revision; today by default."""
    note: str = ""
    """Anything else, such as a distribution list."""

    @property
    def facts(self) -> list[tuple[str, str]]:
        """Names and values of the fields that are given."""
        values = {name: str(getattr(self, name)) for name in type(self).model_fields}
        values["date"] = values["date"] or f"{datetime.date.today():%Y-%m-%d}"
        return [(name, value) for name, value in values.items() if value]

    @property
    def running(self) -> str:
        """Text at the foot of printed pages."""
        known = dict(self.facts)
        revision = f"revision {known['revision']}" if "revision" in known else ""
        return ", ".join(filter(None, (self.project, self.document, revision, known["date"])))


def read_project(folder: str | Path, file: str | Path | None = None) -> Project | None:
    """Title block of a YAML file, by default ``project.yaml`` in the folder of the load base if that exists.

    Raises:
      InputError: the file cannot be read, or has an unknown key.
    """
    path = Path(folder) / FILE if file is None else Path(file)
    return read_record(path, Project) if file is not None or path.is_file() else None
