"""What a reader made of somebody else's description of a turbine."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from meltemi.core.display import Brief
from meltemi.turbine.definition import Turbine

Kind = Literal["approximated", "ignored", "used", "equivalent", "not needed"]
KINDS: tuple[Kind, ...] = ("approximated", "ignored", "used", "equivalent", "not needed")
"""In the order of a reader's interest."""


@dataclass(frozen=True)
class Note:
    """What became of one thing in a file.

    Attributes:
      kind: used as it is; approximated; ignored, although it asks for something; equivalent, since the model is like
        that anyway; or not needed by any model.
      where: file and line, or key path.
      what: name and value.
      why: where it went, or the reason.
    """

    kind: Kind
    where: str
    what: str
    why: str = ""


@dataclass(frozen=True, repr=False)
class Imported(Brief):
    """A turbine from somebody else's files, and what became of everything in them."""

    turbine: Turbine
    notes: tuple[Note, ...]

    def noted(self, kind: Kind) -> list[Note]:
        """The notes of one kind."""
        return [note for note in self.notes if note.kind == kind]


def report_text(notes: Sequence[Note], title: str) -> str:
    """The notes as a page of Markdown, what matters first."""
    lines = [f"# {title}", ""]
    for kind in KINDS:
        chosen = [note for note in notes if note.kind == kind]
        lines += [f"## {kind.capitalize()} ({len(chosen)})", ""]
        if chosen:
            lines += ["| where | what | " + ("to" if kind == "used" else "why") + " |", "|---|---|---|"]
        for note in chosen:
            cells = (note.where, note.what, note.why)
            lines.append("| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |")
        lines.append("")
    return "\n".join(lines)
