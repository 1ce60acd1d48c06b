"""Issues of measured data: what is missing, duplicated, spiky, stuck, late or implausible, one line each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from meltemi.report.tables import number
from meltemi.reports.blocks import Table
from meltemi.validation.measurements import MeasuredRecord, moment


@dataclass(frozen=True)
class DataIssue:
    """One doubtful place in the data; the data are unchanged."""

    kind: str  # gap, missing, duplicate, order, spike, stuck, lag, clock, unit, sign, turbine, statistics
    file: str
    channel: str  # and its column; empty for all of a file
    time: float  # [s] since 1970 at which it begins
    duration: float  # [s]
    samples: int  # how many are concerned
    text: str  # what was expected, what is there, what to do

    def __str__(self) -> str:
        return f"{self.file}: {f'{self.channel}: ' if self.channel else ''}{self.text}"


def issue_of_all(kind: str, records: Sequence[MeasuredRecord], channel: str, text: str) -> DataIssue:
    """An issue of a channel in all records."""
    begin = records[0].begin
    samples = sum(1 if record.statistics else len(record[channel].time) for record in records)
    duration = records[-1].begin + records[-1].length - begin
    return DataIssue(kind, records[0].file, channel, begin, duration, samples, text)


def issues_table(issues: Sequence[DataIssue]) -> Table:
    """Issues as a table of reports: one row for each kind, file and channel, with the text of the first."""
    groups: dict[tuple[str, str, str], list[DataIssue]] = {}
    for each in issues:
        groups.setdefault((each.kind, each.file, each.channel), []).append(each)
    head = ["kind", "file", "channel", "first (UTC)", "times", "duration\ns", "samples", "what to do"]
    rows = [
        [*key, moment(alike[0].time), str(len(alike)), number(sum(each.duration for each in alike)),
         str(sum(each.samples for each in alike)), alike[0].text]
        for key, alike in groups.items()
    ]  # fmt: skip
    return Table(head, rows, text_columns=4)
