"""What a reader of another code's files made of them: the turbine, and notes on what it did not take as it stands."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from meltemi.turbine.definition import Turbine


@dataclass(frozen=True)
class Note:
    """One quantity of a file and what became of it.

    Attributes:
      kind: used as it stands, approximated, or ignored.
      where: file or key.
      what: the quantity.
      why: reason, with numbers where there are any.
    """

    kind: Literal["used", "approximated", "ignored"]
    where: str
    what: str
    why: str = ""


@dataclass(frozen=True)
class Imported:
    """A turbine from another code's files.

    Attributes:
      turbine: the record.
      notes: what was used, approximated and ignored.
    """

    turbine: Turbine
    notes: tuple[Note, ...]
