"""What every reproduction gives back to the command line."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from meltemi.report.html import Table
from meltemi.report.tables import write_csv

Tables = Mapping[str, tuple[str, Sequence[Table]]]
"""By file name: heading and tables."""


@dataclass(frozen=True)
class Reproduction:
    """A study that was done again.

    Attributes:
      tables: for the terminal.
      lead: the result in a few sentences.
      files: that were written.
      page: as Markdown for the documentation: linked to its other pages, its pictures in a folder of the study's name.
    """

    tables: Sequence[Table]
    lead: str
    files: Sequence[Path]
    page: str


def write_tables(tables: Tables, out: Path) -> list[Path]:
    """Each table as a CSV file; several of one name are numbered."""
    files = []
    for name, (_, made) in tables.items():
        for i, table in enumerate(made, start=1):
            path = out / f"{name if len(made) == 1 else f'{name}_{i}'}.csv"
            files.append(write_csv(path, [h.replace("\n", " ") for h in table.head], table.rows))
    return files
