"""What every reproduction gives back to the command line."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from meltemi.report.html import Picture, Table
from meltemi.report.plots import save
from meltemi.report.tables import write_csv
from meltemi.studies.journal import current, guarded

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Tables = Mapping[str, tuple[str, Sequence[Table]]]
"""By file name: heading and tables."""


@dataclass(frozen=True)
class Reproduction:
    """A study that was done again.

    Attributes:
      tables: for the terminal.
      lead: the result in a few sentences.
      files: that were written.
      failed: reasons by cell that failed.
      doubtful: findings by cell whose run left what the model is made for.
      page: as Markdown for the documentation: linked to its other pages, its pictures in a folder of the study's name.
    """

    tables: Sequence[Table]
    lead: str
    files: Sequence[Path]
    page: str
    failed: Mapping[str, str] = field(default_factory=dict)
    doubtful: Mapping[str, str] = field(default_factory=dict)


def write_tables(tables: Tables, out: Path) -> list[Path]:
    """Each table as a CSV file; several of one name are numbered."""
    files = []
    for name, (_, made) in tables.items():
        for i, table in enumerate(made, start=1):
            path = out / f"{name if len(made) == 1 else f'{name}_{i}'}.csv"
            files.append(write_csv(path, [h.replace("\n", " ") for h in table.head], table.rows))
    return files


Drawn = Mapping[str, tuple[str, Path | None]]
"""Captions and files of figures, by name; see :func:`drawn`."""


def picture(caption: str, file: Path | None) -> Picture | str:
    """A figure for a page, or why it could not be drawn."""
    return Picture(file, caption) if file else caption


def tabled(caption: str, of: Callable[[], Table]) -> Table:
    """A table, or one that says why there is none."""
    return guarded(of, lambda why: Table([caption], [[f"cannot be made: {why}"]], caption))


def drawn(name: str, caption: str, draw: Callable[[], Figure], out: Path) -> tuple[str, Path | None]:
    """Caption and file of a figure; without a file, and with the reason, if it cannot be drawn."""

    def file() -> tuple[str, Path | None]:
        return caption, save(draw(), out / f"{name}.png")

    return guarded(file, lambda why: (f"{caption}: cannot be drawn: {why}", None))


def failed_tables() -> dict[str, tuple[str, list[Table]]]:
    """Tables of the cells that failed and of doubtful ones, if there are any, as entries of ``Tables``."""
    book = current()
    listed = {
        "failed": ("What failed", book.failed, "Cells that failed; what needs them is not judged"),
        "doubtful": ("Doubtful runs", book.doubtful, "Runs beyond what the model is made for; they count all the same"),
    }
    return {
        name: (heading, [Table(["cell", "reason"], list(cells.items()), caption, text_columns=2)])
        for name, (heading, cells, caption) in listed.items()
        if cells
    }
