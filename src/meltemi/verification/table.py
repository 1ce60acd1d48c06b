"""Rows, verdicts and reports of comparisons."""

from __future__ import annotations

import csv
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum
from fnmatch import fnmatch
from functools import cache
from importlib.resources import files
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from meltemi.core.files import write_text
from meltemi.core.units import display
from meltemi.report.tables import Rows, number

if TYPE_CHECKING:
    from matplotlib.figure import Figure


class CheckVerdict(StrEnum):
    """Verdict of a row; only FAIL is an error."""

    PASS = "pass"
    KNOWN = "known deviation"
    FAIL = "FAIL"
    REPORTED = "reported"


@dataclass(frozen=True)
class KnownDeviation:
    """A known deviation beyond its band.

    Attributes:
      table, what, case: patterns (``*`` fits everything) of the rows it belongs to.
      bound: beyond it the row fails after all.
      why: explanation: the model that differs, and the model that is right; or that there is none.
    """

    table: str
    what: str
    case: str
    bound: float
    why: str


@dataclass(frozen=True)
class Check:
    """A value and its reference.

    Attributes:
      what: quantity.
      case: wind speed, mode, node, ...
      unit: SI unit of ``reference`` and ``ours``.
      deviation: deviation in ``measure``.
      measure: ``"%"``, ``"deg"``, ``"s"``, ``"points"`` or ``"-"``.
      band: largest deviation that passes; None is only reported.
      beside: a further number for comparison, in ``measure``.
      verdict, why: set by ``judged``; ``why`` explains a known deviation.
    """

    what: str
    case: str
    unit: str
    reference: float
    ours: float
    deviation: float
    measure: str = "%"
    band: float | None = None
    beside: float | None = None
    verdict: CheckVerdict = CheckVerdict.REPORTED
    why: str = ""

    def judged(self, table: str, known: Sequence[KnownDeviation]) -> Check:
        """The row with its verdict."""
        if self.band is None or abs(self.deviation) <= self.band:
            return replace(self, verdict=CheckVerdict.REPORTED if self.band is None else CheckVerdict.PASS, why="")
        for k in known:
            fits = fnmatch(table, k.table) and fnmatch(self.what, k.what) and fnmatch(self.case, k.case)
            if fits and abs(self.deviation) <= k.bound:
                return replace(self, verdict=CheckVerdict.KNOWN, why=k.why)
        return replace(self, verdict=CheckVerdict.FAIL, why="")


def relative(
    what: str,
    case: str,
    unit: str,
    reference: float,
    ours: float,
    band: float | None = None,
    *,
    floor: float = 0.0,
    beside: float | None = None,
) -> Check:
    """A row with the deviation in percent of the reference's magnitude, at least of ``floor``."""
    scale = max(abs(reference), abs(floor), 1e-300)
    return Check(what, case, unit, reference, ours, 100.0 * (ours - reference) / scale, "%", band, beside)


def difference(  # noqa: PLR0913 - the columns of a row
    what: str,
    case: str,
    unit: str,
    reference: float,
    ours: float,
    band: float | None = None,
    *,
    measure: str = "-",
    factor: float = 1.0,
    beside: float | None = None,
) -> Check:
    """A row whose deviation is ``factor`` times the difference."""
    return Check(what, case, unit, reference, ours, factor * (ours - reference), measure, band, beside)


def angle(
    what: str, case: str, reference: float, ours: float, band: float | None, *, beside: float | None = None
) -> Check:
    """A row of an angle [rad] whose deviation is in degrees."""
    return difference(what, case, "rad", reference, ours, band, measure="deg", factor=180.0 / math.pi, beside=beside)


def phase(what: str, case: str, reference: float, ours: float, band: float) -> Check:
    """A row of a phase angle [rad], whose deviation is modulo a full turn."""
    turn = (ours - reference + math.pi) % (2.0 * math.pi) - math.pi
    return angle(what, case, reference, reference + turn, band)


def at_least(what: str, case: str, unit: str, bound: float, ours: float) -> Check:
    """A row that passes if the value reaches the bound; the deviation is the shortfall in percent."""
    missing = max(0.0, 100.0 * (bound - ours) / abs(bound))
    return Check(what, case, unit, bound, ours, missing, "%", 0.0)


@dataclass(frozen=True)
class CheckTable:
    """Rows against one source.

    Attributes:
      name: short, for patterns and files.
      title, source: title and source in words.
      beside: head of a further column; empty without one.
      figures: plots by name.
    """

    name: str
    title: str
    source: str
    rows: Sequence[Check]
    beside: str = ""
    figures: dict[str, Figure] = field(default_factory=dict)

    text_columns = 2

    def judged(self, known: Sequence[KnownDeviation]) -> CheckTable:
        """The comparison with the verdict of each row."""
        return replace(self, rows=[row.judged(self.name, known) for row in self.rows])

    def head_and_rows(self) -> Rows:
        """Table for the terminal: for each quantity the case with the largest deviation."""
        head = ["quantity", "worst case", "cases", "reference", "ours", "unit", "deviation", "band", "verdict"]
        if self.beside:
            head.insert(7, self.beside)
        groups: dict[str, list[Check]] = {}
        for row in self.rows:
            groups.setdefault(row.what, []).append(row)
        lines = []
        for what, rows in groups.items():
            order = {CheckVerdict.REPORTED: 0, CheckVerdict.PASS: 1, CheckVerdict.KNOWN: 2, CheckVerdict.FAIL: 3}
            row = max(rows, key=lambda r: (order[r.verdict], abs(r.deviation) / (r.band or 1.0)))
            unit, factor = display(row.unit, angular_rate_in_degrees=False)
            line = [what, row.case, str(len(rows)), number(row.reference * factor), number(row.ours * factor), unit]
            line.append(f"{row.deviation:+.2f} {row.measure}")
            if self.beside:
                line.append("-" if row.beside is None else f"{row.beside:+.2f} {row.measure}")
            line += ["-" if row.band is None else f"{row.band:g} {row.measure}", str(row.verdict)]
            lines.append(line)
        return head, lines


class CheckStudy(NamedTuple):
    """A comparison to make.

    Attributes:
      seconds: usual duration.
      compare: function that returns the comparison.
      what: name in the message if a package is missing.
      needs: optional packages.
    """

    seconds: float
    compare: Callable[[], CheckTable]
    what: str = ""
    needs: tuple[str, ...] = ()


@dataclass(frozen=True)
class VerificationReport:
    """All comparisons of a verification.

    Attributes:
      tables: the comparisons.
      name: name of the files that ``write`` makes.
    """

    tables: Sequence[CheckTable]
    name: str = "verification"

    def count(self, verdict: CheckVerdict) -> int:
        """Number of rows with a verdict."""
        return sum(row.verdict is verdict for table in self.tables for row in table.rows)

    @property
    def failed(self) -> bool:
        """Whether any row fails."""
        return self.count(CheckVerdict.FAIL) > 0

    def summary(self) -> str:
        """Number of rows by verdict, in one line."""
        counts = [
            f"{self.count(v)} {v}"
            for v in (CheckVerdict.PASS, CheckVerdict.KNOWN, CheckVerdict.FAIL, CheckVerdict.REPORTED)
        ]
        return f"{sum(len(t.rows) for t in self.tables)} comparisons: {', '.join(counts)}"

    def markdown(self) -> str:
        """The report as a page."""
        from meltemi.report.tables import markdown_table

        lines = [f"**{self.summary()}**", ""]
        for table in self.tables:
            lines += [f"## {table.title}", "", f"Reference: {table.source}.", ""]
            lines += markdown_table(*table.head_and_rows())
            reasons = dict.fromkeys(row.why for row in table.rows if row.why)
            lines += ["", *(f"Known deviation: {why}" for why in reasons)]
            lines += ["", *(f"![{name}]({name}.png)" for name in table.figures), ""]
        return "\n".join(lines)

    def write(self, out: Path) -> list[Path]:
        """Write a CSV file with every row, the page and the plots."""
        from meltemi.report.plots import save
        from meltemi.report.tables import write_csv

        columns = "what case unit reference ours deviation measure band beside verdict why".split()
        rows = [[table.name, *(_cell(getattr(row, c)) for c in columns)] for table in self.tables for row in table.rows]
        written = [
            write_csv(out / f"{self.name}.csv", ["table", *columns], rows),
            write_text(out / f"{self.name}.md", self.markdown()),
        ]
        for table in self.tables:
            written += [save(figure, out / f"{name}.png") for name, figure in table.figures.items()]
        return written


def _cell(value: object) -> str:
    return f"{value:.7g}" if isinstance(value, float) else "" if value is None else str(value)


DATA = files("meltemi.verification") / "data"


@cache
def reference_table(name: str, folder: Traversable = DATA, **where: str) -> list[dict[str, str]]:
    """Rows of one of the small reference tables of a folder, those with certain values in some columns."""
    text = (folder / f"{name}.csv").read_text(encoding="utf-8")
    rows = csv.DictReader(line for line in text.splitlines() if not line.startswith("#"))
    return [row for row in rows if all(row[column] == value for column, value in where.items())]


def source_of(name: str, folder: Traversable = DATA) -> str:
    """Source of a reference table, from its comments."""
    text = (folder / f"{name}.csv").read_text(encoding="utf-8")
    comments = [line.removeprefix("#").strip() for line in text.splitlines() if line.startswith("#")]
    return "; ".join(comments).replace("Source: ", "")
