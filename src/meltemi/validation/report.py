"""Report of a validation: one page with verdicts, twelve numbers and three figures, then all tables."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from meltemi.report.tables import number, write_csv
from meltemi.reports.blocks import Block, Code, Document, Folded, Picture, Section, Table, VerdictBlock
from meltemi.reports.html import write_page
from meltemi.reports.word import write_word
from meltemi.validation.comparison import Agreement, Comparison, mean_of_known, power_curve
from meltemi.validation.issues import DataIssue, issues_table
from meltemi.validation.plots import plot_agreement, plot_capture_matrix, plot_operation, plot_spectra, unit_of
from meltemi.validation.selection import SelectedRecord, capture_matrix, capture_table, selection_table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

HEADLINE = ("mean", "std", "DEL, m = 10")
"""Statistics of the first page, of the first four channels."""
WORDS = (
    "Bias: simulated less measured, mean over records, in per cent of the mean magnitude measured. Interval: of the "
    "mean over records. Resolvable: within it lies the bias of a right model with a probability of 95 %, by the spread "
    "of the wind fields that the sensors allow and by the accuracy of the sensors."
)
BY_STATISTICS = (
    "The wind is known by its statistics only: the fields of the seeds have its mean and turbulence, not its gusts. "
    "Their spread, and with it what can be resolved, is larger than in the wind of measured series."
)


@dataclass(frozen=True)
class Findings:
    """What a report shows."""

    title: str  # turbine and period
    comparison: Comparison
    selected: Sequence[SelectedRecord]  # all records with their class and reason
    issues: Sequence[DataIssue]  # of the measurements
    failed: dict[str, str]  # reasons of records that could not be simulated, by file
    facts: Sequence[tuple[str, str]]  # names and values below the title
    further: Sequence[Section] = ()  # of sensitivities and a fit
    repeat: str = ""  # command line
    footer: str = ""

    @cached_property
    def agreements(self) -> list[Agreement]:
        """Of every channel and statistic."""
        return self.comparison.agreements()

    @property
    def headline(self) -> list[Agreement]:
        """Those of the first page."""
        return headline(self.agreements, self.comparison.channels)


def headline(agreements: Sequence[Agreement], channels: Sequence[str]) -> list[Agreement]:
    """At most twelve of them, for the first page."""
    return [a for name in channels[:4] for a in agreements if a.channel == name and a.statistic in HEADLINE]


def agreement_table(agreements: Sequence[Agreement], caption: str = "") -> Table:
    """Agreement as a table, deviations in per cent of the mean magnitude."""
    rows = []
    for a in agreements:
        unit, factor = unit_of(a.channel, np.array([a.measured]))
        levels = factor * np.array([a.measured, a.simulated])
        shares = 100.0 * np.array([a.bias, a.half, a.resolvable, a.scatter])
        values = (*levels, *shares, a.slope, a.correlation, 100.0 * a.covered)
        rows.append([a.channel, a.statistic, a.verdict, unit, *map(number, values), str(a.records), str(a.seeds)])
    head = (
        "channel|statistic|verdict|unit|measured|simulated|bias\n%|interval\n+/- %|resolvable\n+/- %|scatter\n%|slope"
    )
    head += "|correlation|within seeds\n% of records|records|seeds"
    return Table(head.split("|"), rows, caption, text_columns=4)


def record_table(comparison: Comparison, shown: Sequence[Agreement]) -> Table:
    """Each record: conditions, and measured and simulated values of some statistics."""
    head = ["record", "wind\nm/s", "turbulence\n%", "density\nkg/m³", "shear exponent"]
    rows = [
        [r.name, *map(number, (r.wind_speed, 100.0 * r.turbulence, r.air_density, r.shear_exponent))]
        for r in comparison.records
    ]
    for each in shown:
        x, y = comparison.values(each.channel, each.statistic)
        unit, factor = unit_of(each.channel, x)
        head += [f"{each.channel} {each.statistic}\nmeasured {unit}", "deviation\n%", "seeds\n+/- %"]
        deviation = 100.0 * (mean_of_known(y) / x - 1.0)
        for row, a, b, share in zip(rows, x, y, deviation, strict=True):
            spread = 100.0 * np.nanstd(b, ddof=1) / abs(a) if np.isfinite(b).sum() > 1 else np.nan
            row += map(number, (factor * a, share, spread))
    return Table(head, rows, "Records; seeds: standard deviation over wind fields")


def power_table(comparison: Comparison) -> Table:
    """Power curve as a table."""
    bins = power_curve(comparison)
    power = 1e-3 * bins[["measured", "measured_error", "simulated", "simulated_error"]].to_numpy()
    every = zip(bins["speed"], bins["records"], power, strict=True)
    rows = [[number(speed), str(n), *map(number, kilowatts)] for speed, n, kilowatts in every]
    head = ["wind\nm/s", "records", "measured\nkW", "+/-\nkW", "simulated\nkW", "+/-\nkW"]
    return Table(head, rows, "Power at 1.225 kg/m³ with standard uncertainties of the means", text_columns=0)


def report_document(findings: Findings, tables: Mapping[str, Table]) -> Document:
    """The report, with the tables that are files, too."""
    c = findings.comparison
    judged = [a for a in findings.agreements if a.statistic in HEADLINE]
    outside = [a for a in judged if a.outside > 0.0]
    lead = VerdictBlock(
        "doubtful" if outside else "good",
        f"{len(judged) - len(outside)} of {len(judged)} means, standard deviations and equivalent loads lie inside "
        "what seeds and sensors can resolve.",
        [f"{a.channel}, {a.statistic}: {a.verdict} (bias {100.0 * a.bias:+.1f} %, resolvable "
         f"{100.0 * a.resolvable:.1f} %)" for a in outside],
    )  # fmt: skip
    sections = [
        Section("At a glance", [*_first_page(c, findings.headline)]),
        *findings.further,
        Section("All statistics", [Folded("All channels and statistics", tables["statistics"])]),
        Section("Records", [tables["records"], *_selection(findings, tables["selection"])]),
        Section("Power curve", [power_table(c)] if "generator_power" in c.channels else []),
        Section("Doubtful data", [tables["issues"] if findings.issues else "No issue was found."]),
        Section("Repeat", [Code(findings.repeat)] if findings.repeat else []),
    ]
    shown = [section for section in sections if section.content]
    return Document(findings.title, shown, facts=findings.facts, lead=lead, footer=findings.footer)


def _first_page(c: Comparison, first: Sequence[Agreement]) -> Iterator[Block]:
    yield agreement_table(first, "Twelve numbers")
    shown = [(a.channel, a.statistic) for a in first if a.statistic != HEADLINE[1] or a.channel in c.range_only][:6]
    if shown:
        yield Picture(_png(plot_agreement(c, shown)), "Each point is a record.")
    series = any(record.measured.spectra for record in c.records)
    if series:
        yield Picture(_png(plot_spectra(c)), "Spectra in bands of equal ratio.")
    yield Picture(_png(plot_operation(c)), "Bins of 0.5 m/s as in IEC 61400-12-1.")
    yield WORDS
    if not series:
        yield BY_STATISTICS


def _selection(findings: Findings, selection: Table) -> Iterator[Block]:
    used = capture_matrix(findings.selected, "production")
    yield from (selection, capture_table(used))
    yield Picture(_png(plot_capture_matrix(used, "production")), "Capture matrix")
    if findings.failed:
        yield Table(["file", "reason"], [[*each] for each in findings.failed.items()], "Not simulated", 2)


def write_findings(findings: Findings, out: Path) -> list[Path]:
    """Write ``report.html``, ``report.docx`` and tables as CSV into a folder.

    Raises:
      InputError: a file cannot be written.
    """
    tables = {
        "statistics": agreement_table(findings.agreements),
        "records": record_table(findings.comparison, findings.headline),
        "selection": selection_table(findings.selected),
        "issues": issues_table(findings.issues),
    }
    document = report_document(findings, tables)
    files = [write_page(out / "report.html", document), write_word(out / "report.docx", document)]
    for name, table in tables.items():
        files.append(write_csv(out / f"{name}.csv", [" ".join(h.split()) for h in table.head], table.texts))
    return files


def _png(figure: Figure) -> bytes:
    file = BytesIO()
    figure.savefig(file, dpi=110, format="png")
    return file.getvalue()
