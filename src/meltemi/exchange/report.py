"""Notes on the import of turbine data."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

from meltemi.core.shown import Brief
from meltemi.turbine.definition import Turbine

Kind = Literal["warning", "approximated", "ignored", "used", "equivalent", "not needed"]
KINDS: tuple[Kind, ...] = ("warning", "approximated", "ignored", "used", "equivalent", "not needed")
"""Kinds of entries in the order of a reader's interest."""
MOST_LINES = 20
"""Notes on a terminal of each kind."""


@dataclass(frozen=True)
class ImportNote:
    """Note on the treatment of one item of an imported file.

    Attributes:
      kind: a warning; used unchanged; approximated; ignored, although it has an effect in the other program; equivalent
        to the behaviour of the model; or not needed.
      where: file and line, or key path.
      what: name and value of the item.
      why: key path that it sets, or the reason.
    """

    kind: Kind
    where: str
    what: str
    why: str = ""


class Notes(list[ImportNote]):
    """Notes on an import or export, in the order of its files."""

    def add(self, kind: Kind, where: str, what: str, why: str = "") -> None:
        """Append a note."""
        self.append(ImportNote(kind, where, what, why))


@dataclass(frozen=True, repr=False)
class ImportedTurbine(Brief):
    """An imported turbine, with notes on the treatment of the input."""

    turbine: Turbine
    notes: tuple[ImportNote, ...]

    def noted(self, kind: Kind) -> list[ImportNote]:
        """The notes of one kind."""
        return [note for note in self.notes if note.kind == kind]

    def brief(self, source: Path) -> list[str]:
        """Warnings, names of ignored items and the place of the report as lines for a terminal."""
        lists = "OutList: "
        ignored = [note.what for note in self.noted("ignored")]
        names = [what for what in ignored if not what.startswith(lists)]
        channels = sum(len(what.split(",")) for what in ignored if what.startswith(lists))
        names += [f"{channels} channel{'s' * (channels > 1)} of the lists of outputs"] if channels else []
        lines = [f"warning: {note.where}: {note.what}: {note.why}" for note in self.noted("warning")[:MOST_LINES]]
        lines += [f"ignored: {', '.join(names[:MOST_LINES])}{', ...' * (len(names) > MOST_LINES)}"] if names else []
        counts = ", ".join(f"{len(self.noted(kind))} {kind}" for kind in KINDS[:3])
        return [*lines, f"{counts}: 'meltemi import {source}' writes the report, with places and reasons"]

    def tables(self) -> list[tuple[str, list[str], list[list[str]]]]:
        """Title, head and rows of warnings, approximated, ignored keys, for a terminal; :func:`report_text` has all."""
        heads: dict[Kind, str] = {"warning": "what is done", "approximated": "how", "ignored": "why"}
        shown = {kind: self.noted(kind)[:MOST_LINES] for kind in heads}
        return [
            (kind.capitalize(), ["where", "what", head], [[n.where, n.what, n.why] for n in shown[kind]])
            for kind, head in heads.items()
            if shown[kind]
        ]


@dataclass(frozen=True, repr=False)
class ImportedModel(ImportedTurbine):
    """Imported model: a turbine with the model options and the case of its program.

    Attributes:
      options: arguments of ``ModelOptions`` for the degrees of freedom and aerodynamic models of the model.
      environment: gravity and air density, for ``Environment``.
      wind: wind as in a case file, with absolute paths; None if a case file cannot represent it.
      sea: sea as in a case file; None for an onshore turbine.
      duration: [s] simulated time.
      output_step: [s] output step.
      start: rotor speed [rad/s], pitch [rad] and azimuth [rad] of blade 1 with which that program would begin.
      output: case keys of the channels that the model records beside the usual ones, and their stations [m].
    """

    options: dict[str, Any] = field(default_factory=dict)
    environment: dict[str, float] = field(default_factory=dict)
    wind: dict[str, Any] | None = None
    sea: dict[str, Any] | None = None
    duration: float = 60.0
    output_step: float = 0.05
    start: dict[str, float] = field(default_factory=dict)
    output: dict[str, tuple[Any, ...]] = field(default_factory=dict)


def report_text(notes: Sequence[ImportNote], title: str) -> str:
    """The notes as a Markdown page, most important first."""
    from meltemi.report.tables import markdown_table

    lines = [f"# {title}", ""]
    for kind in KINDS:
        chosen = [note for note in notes if note.kind == kind]
        lines += [f"## {kind.capitalize()} ({len(chosen)})", ""]
        if chosen:
            head = ["where", "what", "to" if kind == "used" else "why"]
            lines += markdown_table(head, [(note.where, note.what, note.why) for note in chosen])
        lines.append("")
    return "\n".join(lines)
