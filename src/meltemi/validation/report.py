"""Report of a validation: one page with verdicts, twelve numbers and three figures, then all tables."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from meltemi.report.tables import number, write_csv
from meltemi.reports.blocks import Block, Code, Document, Folded, Picture, Section, Table, VerdictBlock
from meltemi.reports.html import write_page
from meltemi.reports.word import write_word
from meltemi.validation.comparison import Agreement, Comparison, power_curve
from meltemi.validation.issues import DataIssue, issues_table
from meltemi.validation.plots import plot_agreement, plot_capture_matrix, plot_operation, plot_spectra, unit_of
from meltemi.validation.selection import SelectedRecord, capture_matrix, capture_table, selection_table

HEADLINE = ("mean", "std", "DEL, m = 10")
"""Statistics of the first page, of the first four channels."""
WORDS = (
    "Bias: simulated less measured, mean over records, in per cent of the mean magnitude measured. Interval: of the "
    "mean over records. Resolvable: within it lies the bias of a right model with a probability of 95 %, by the spread "
    "of the wind fields that the sensors allow and by the accuracy of the sensors."
)


@dataclass(frozen=True)
class Findings:
    """What a report shows.

    Attributes:
      title: turbine and period.
      comparison: compared records.
      selected: all records with their class and reason.
      issues: of the measurements.
      failed: reasons of records that could not be simulated, by file.
      facts: names and values below the title.
      further: sections of sensitivities and a fit.
      repeat: command line.
    """

    title: str
    comparison: Comparison
    selected: Sequence[SelectedRecord]
    issues: Sequence[DataIssue]
    failed: dict[str, str]
    facts: Sequence[tuple[str, str]]
    further: Sequence[Section] = ()
    repeat: str = ""
    footer: str = field(default="")


def headline(agreements: Sequence[Agreement], channels: Sequence[str]) -> list[Agreement]:
    """At most twelve of them, for the first page."""
    first = channels[:4]
    return [a for name in first for a in agreements if a.channel == name and a.statistic in HEADLINE]


def agreement_table(agreements: Sequence[Agreement], caption: str = "") -> Table:
    """Agreement as a table, deviations in per cent of the mean magnitude."""
    rows = []
    for a in agreements:
        unit, factor = unit_of(a.channel, np.array([a.measured]))
        rows.append([
            a.channel, a.statistic, a.verdict, unit, number(factor * a.measured), number(factor * a.simulated),
            *(number(100.0 * x) for x in (a.bias, a.half, a.resolvable, a.scatter)),
            number(a.slope), number(a.correlation), number(100.0 * a.covered), str(a.records), str(a.seeds),
        ])  # fmt: skip
    head = ["channel", "statistic", "verdict", "unit", "measured", "simulated", "bias\n%", "interval\n+/- %"]
    head += [
        "resolvable\n+/- %",
        "scatter\n%",
        "slope",
        "correlation",
        "within seeds\n% of records",
        "records",
        "seeds",
    ]
    return Table(head, rows, caption, text_columns=4)


def record_table(comparison: Comparison) -> Table:
    """Each record: conditions, and measured and simulated values of the statistics of the first page."""
    pairs = [(a.channel, a.statistic) for a in headline(comparison.agreements(), comparison.channels)]
    head = ["record", "wind\nm/s", "turbulence\n%", "density\nkg/m³", "shear exponent"]
    rows = [
        [r.name, *map(number, (r.wind_speed, 100.0 * r.turbulence, r.air_density, r.shear_exponent))]
        for r in comparison.records
    ]
    for name, statistic in pairs:
        x, y = comparison.values(name, statistic)
        unit, factor = unit_of(name, x)
        head += [f"{name} {statistic}\nmeasured {unit}", "deviation\n%", "seeds\n+/- %"]
        for row, a, b in zip(rows, x, y, strict=True):
            spread = 100.0 * np.nanstd(b, ddof=1) / abs(a) if np.isfinite(b).sum() > 1 else np.nan
            row += [number(factor * a), number(100.0 * (np.nanmean(b) / a - 1.0) if np.isfinite(b).any() else np.nan),
                    number(spread)]  # fmt: skip
    return Table(head, rows, "Records; seeds: standard deviation over wind fields")


def report_document(findings: Findings) -> Document:
    """The report."""
    c = findings.comparison
    agreements = c.agreements()
    first = headline(agreements, c.channels)
    outside = [a for a in agreements if a.statistic in HEADLINE and a.outside > 0.0]
    shown = [(a.channel, a.statistic) for a in first if a.statistic != HEADLINE[1] or a.channel in c.range_only][:6]
    lines = [f"{a.channel}, {a.statistic}: {a.verdict} (bias {100.0 * a.bias:+.1f} %, resolvable "
             f"{100.0 * a.resolvable:.1f} %)" for a in outside]  # fmt: skip
    checked = sum(a.statistic in HEADLINE for a in agreements)
    lead = VerdictBlock(
        "good" if not outside else "doubtful",
        f"{checked - len(outside)} of {checked} means, standard deviations and equivalent loads lie inside what seeds "
        "and sensors can resolve.",
        lines,
    )
    sections = [
        Section("At a glance", [
            agreement_table(first, "Twelve numbers"),
            *(Picture(_png(figure), caption) for figure, caption in (
                (plot_agreement(c, shown), "Each point is a record."),
                (plot_spectra(c), "Spectra in bands of equal ratio."),
                (plot_operation(c), "Bins of 0.5 m/s as in IEC 61400-12-1."),
            )),
            WORDS,
        ]),
        *findings.further,
        Section("All statistics", [Folded("All channels and statistics", agreement_table(agreements))]),
        Section("Records", [record_table(c), *_selection(findings)]),
        Section("Power curve", [power_table(c)] if "generator_power" in c.channels else []),
        Section("Doubtful data", [issues_table(findings.issues)] if findings.issues else ["No issue was found."]),
        Section("Repeat", [Code(findings.repeat)] if findings.repeat else []),
    ]  # fmt: skip
    return Document(
        findings.title, [s for s in sections if s.content], facts=findings.facts, lead=lead, footer=findings.footer
    )


def _selection(findings: Findings) -> list[Block]:
    used = capture_matrix(findings.selected, "production")
    blocks: list[Block] = [selection_table(findings.selected), capture_table(used)]
    blocks.append(Picture(_png(plot_capture_matrix(used, "production")), "Capture matrix"))
    if findings.failed:
        blocks.append(Table(["file", "reason"], [[*each] for each in findings.failed.items()], "Not simulated", 2))
    return blocks


def power_table(comparison: Comparison) -> Table:
    """Power curve as a table."""
    rows = [[number(b.speed), str(b.records), *(number(1e-3 * x) for x in
             (b.measured, b.measured_error, b.simulated, b.simulated_error))]
            for b in power_curve(comparison)]  # fmt: skip
    head = ["wind\nm/s", "records", "measured\nkW", "+/-\nkW", "simulated\nkW", "+/-\nkW"]
    return Table(head, rows, "Power at 1.225 kg/m³ with standard uncertainties of the means", text_columns=0)


def write_findings(findings: Findings, out: Path) -> list[Path]:
    """Write ``report.html``, ``report.docx`` and tables as CSV into a folder.

    Raises:
      InputError: a file cannot be written.
    """
    document = report_document(findings)
    files = [write_page(out / "report.html", document), write_word(out / "report.docx", document)]
    tables = {
        "statistics": agreement_table(findings.comparison.agreements()),
        "records": record_table(findings.comparison),
        "selection": selection_table(findings.selected),
        "issues": issues_table(findings.issues),
    }
    for name, table in tables.items():
        files.append(write_csv(out / f"{name}.csv", [" ".join(h.split()) for h in table.head], table.texts))
    return files


def _png(figure: Any) -> bytes:
    file = BytesIO()
    figure.savefig(file, dpi=110, format="png")
    return file.getvalue()
