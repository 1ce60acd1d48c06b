"""What every reproduction gives back to the command line."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from meltemi.report.html import Table


@dataclass(frozen=True)
class Reproduction:
    """A study that was done again.

    Attributes:
      tables: for the terminal.
      lead: the result in a few sentences.
      files: that were written.
    """

    tables: Sequence[Table]
    lead: str
    files: Sequence[Path]
