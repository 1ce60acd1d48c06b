"""Selection of records by operation, and the capture matrix over wind speed and turbulence.

The matrix and the classes are those of IEC 61400-13: bins of 1 m/s, centred on whole numbers, and of 2 % turbulence
intensity from 3 to 29 %.

Reference: docs/theory/validation.md (V-4).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from meltemi.core.errors import InputError, did_you_mean
from meltemi.core.record import Record
from meltemi.postprocess.bins import EDGES
from meltemi.report.tables import number
from meltemi.reports.blocks import Table
from meltemi.turbine.definition import Turbine
from meltemi.validation.issues import DataIssue, moment
from meltemi.validation.measurements import MeasuredRecord

Float = NDArray[np.float64]
Operation = Literal["production", "start", "stop", "idling", "parked", "fault"]
TURBULENCE = (0.0, *(k / 100.0 for k in range(3, 31, 2)), np.inf)
"""Edges of the bins of turbulence intensity: up to 3 %, 2 % each, above 29 %."""
BLOCK = 5.0
"""[s] over which power is averaged, so that its noise about zero does not count."""


class SelectionRules(Record):
    """Limits of operation and of complete records."""

    least_power: float = Field(default=0.01, gt=0.0, lt=1.0)
    """Power over rated power above which the turbine produces."""
    least_speed: float = Field(default=0.02, gt=0.0, lt=1.0)
    """Rotor speed over rated speed below which it is parked."""
    overspeed: float = Field(default=1.15, gt=1.0)
    """Rotor speed over rated speed from which on a record is a fault."""
    trip: float = Field(default=0.25, gt=0.0)
    """Loss of power within two seconds, over rated power, that ends in no production: a fault, not a stop."""
    complete: float = Field(default=0.99, gt=0.0, le=1.0)
    """Share of samples that every required channel must have."""
    sector: tuple[float, float] | None = None
    """[rad] directions from and to, clockwise, that are undisturbed; needs ``direction``."""
    direction: str = "wind_direction"
    """Channel of the wind direction."""
    excluding: tuple[str, ...] = ("spike", "stuck", "order", "clock", "unit", "sign", "turbine")
    """Kinds of issues in a required channel that reject a record."""


RULES = SelectionRules()


@dataclass(frozen=True)
class SelectedRecord:
    """A record with its class, bin and, if it is rejected, the reason.

    Attributes:
      record: the record.
      operation: its class; None if it cannot be seen.
      wind_speed: [m/s] mean.
      turbulence: standard deviation over mean of the wind speed [-].
      rejected: reason; empty if it is used.
    """

    record: MeasuredRecord = field(repr=False)
    operation: Operation | None
    wind_speed: float
    turbulence: float
    rejected: str = ""


def operation_of(record: MeasuredRecord, turbine: Turbine, rules: SelectionRules = RULES) -> Operation:
    """Class of a record by power and rotor speed (V-4); a start or stop at feather needs no pitch.

    Raises:
      UnknownNameError: power or rotor speed is missing.
      InputError: one has no samples.
    """
    speed = record["rotor_speed"].finite / rated_rotor_speed(turbine)
    power, rate = record["generator_power"].finite / turbine.rated_power, record.rates["generator_power"]
    if not len(speed) or not len(power):
        raise InputError(f"{record.file}: rotor speed or power has no samples")
    width = max(1, min(round(BLOCK * rate), len(power)))
    blocks = power[: len(power) // width * width].reshape(-1, width).mean(axis=1)
    produces = blocks > rules.least_power
    first, last = bool(produces[0]), bool(produces[-1])
    two = max(round(2.0 * rate), 1)
    loss = float(np.max(power[:-two] - power[two:], initial=0.0))
    lowest = np.min(power) <= rules.least_power
    if np.max(speed) > rules.overspeed or (lowest and loss > rules.trip):
        return "fault"
    if first and last:
        return "production" if np.all(produces) else "fault"
    if first or last:
        return "stop" if first else "start"
    if np.any(produces):
        return "start"
    return "parked" if np.mean(speed) < rules.least_speed else "idling"


def rated_rotor_speed(turbine: Turbine) -> float:
    """[rad/s] of the pitch loop."""
    return turbine.control.pitch.reference_speed / turbine.drivetrain.gear_ratio


def select(
    records: Sequence[MeasuredRecord],
    turbine: Turbine,
    *,
    wind: str = "wind_speed",
    needed: Sequence[str] = (),
    issues: Sequence[DataIssue] = (),
    rules: SelectionRules = RULES,
) -> list[SelectedRecord]:
    """Classify records, and reject those that are incomplete, doubtful or disturbed.

    Args:
      records: of the measurements.
      turbine: for its rated power and speed.
      wind: channel of the wind speed.
      needed: channels besides wind, power and rotor speed that must be complete.
      issues: of the measurements.
      rules: limits.

    Raises:
      InputError: no record has a required channel.
    """
    required = list(dict.fromkeys([wind, "rotor_speed", "generator_power", *needed]))
    names = {name for record in records for name in record.signals}
    for name in [*required, *([rules.direction] if rules.sector else [])]:
        if records and name not in names:
            raise InputError(f"{records[0].file}: no channel {name!r}: {did_you_mean(name, names)}")
    return [_selected(record, turbine, wind, required, issues, rules) for record in records]


def _selected(
    record: MeasuredRecord,
    turbine: Turbine,
    wind: str,
    required: Sequence[str],
    issues: Sequence[DataIssue],
    rules: SelectionRules,
) -> SelectedRecord:
    v = record[wind].finite
    mean = float(np.mean(v)) if len(v) else np.nan
    turbulence = float(np.std(v)) / mean if mean > 0.0 else np.nan
    reason = _reason(record, mean, required, issues, rules)
    known = len(record["rotor_speed"].finite) and len(record["generator_power"].finite)
    return SelectedRecord(record, operation_of(record, turbine, rules) if known else None, mean, turbulence, reason)


def _reason(
    record: MeasuredRecord, mean: float, required: Sequence[str], issues: Sequence[DataIssue], rules: SelectionRules
) -> str:
    """Why a record is rejected; empty if it is not."""
    for name in required:
        if (share := record.completeness(name)) < rules.complete:
            return f"{name}: {100.0 * share:.1f} % of the samples, {100.0 * rules.complete:g} % are required"
    if not mean > 0.0:
        return f"mean wind speed {mean:.3g} m/s"
    for issue in issues:
        inside = issue.time < record.begin + record.length and issue.time + issue.duration >= record.begin
        concerned = issue.channel.split(" (")[0] in required or issue.kind in ("order", "clock")
        if issue.kind in rules.excluding and inside and concerned:
            return f"{issue.kind} in {issue.channel or issue.file}"
    if rules.sector is not None:
        angles = record[rules.direction].finite
        centre = float(np.angle(np.mean(np.exp(1j * angles)))) if len(angles) else np.nan
        low, high = rules.sector
        if not (centre - low) % (2.0 * np.pi) <= (high - low) % (2.0 * np.pi):
            return f"wind direction {np.degrees(centre) % 360.0:.0f} deg outside the undisturbed sector"
    return ""


def capture_matrix(
    selected: Sequence[SelectedRecord],
    operation: Operation = "production",
    *,
    speeds: Sequence[float] = EDGES,
    turbulence: Sequence[float] = TURBULENCE,
) -> NDArray[np.intp]:
    """(turbulence bins, wind speed bins) numbers of records of a class that are used; bins contain their lower edge.

    Args:
      selected: records.
      operation: class.
      speeds: (V + 1,) [m/s] edges of the wind speed bins.
      turbulence: (I + 1,) edges of the bins of turbulence intensity.
    """
    matrix = np.zeros((len(turbulence) - 1, len(speeds) - 1), np.intp)
    for each in selected:
        if not each.rejected and each.operation == operation:
            i = int(np.searchsorted(turbulence, each.turbulence, side="right")) - 1
            j = int(np.searchsorted(speeds, each.wind_speed, side="right")) - 1
            if 0 <= i < matrix.shape[0] and 0 <= j < matrix.shape[1]:
                matrix[i, j] += 1
    return matrix


def speed_labels(edges: Sequence[float] = EDGES) -> list[str]:
    """Names of wind speed bins: their centres [m/s], the first and others of another width with their edges."""
    pairs = pairwise(edges)
    return [f"{0.5 * (a + b):g}" if abs(b - a - 1.0) < 1e-9 else f"{a:g}-{b:g}" for a, b in pairs]


def turbulence_labels(edges: Sequence[float] = TURBULENCE) -> list[str]:
    """Names of turbulence bins [%]."""
    pairs = [(100.0 * a, 100.0 * b) for a, b in pairwise(edges)]
    return [f"< {b:g}" if a == 0.0 else f"> {a:g}" if np.isinf(b) else f"{a:g}-{b:g}" for a, b in pairs]


def capture_table(matrix: NDArray[np.intp]) -> Table:
    """The capture matrix as a table of reports: bins of wind speed that have records, and the sum."""
    columns = np.flatnonzero(matrix.sum(axis=0))
    names = speed_labels()
    rows = [
        [name, *(str(n) if n else "" for n in row)]
        for name, row in zip(turbulence_labels(), matrix[:, columns], strict=True)
    ]
    rows.append(["all", *(str(n) for n in matrix[:, columns].sum(axis=0))])
    head = ["turbulence\n%", *(f"{names[j]}\nm/s" for j in columns)]
    return Table(head, rows, "Records by turbulence intensity and wind speed")


def selection_table(selected: Sequence[SelectedRecord]) -> Table:
    """Records, used and rejected, as a table of reports."""
    rows = [
        [
            each.record.file,
            moment(each.record.begin),
            each.operation or "unknown",
            "rejected" if each.rejected else "used",
            number(each.wind_speed),
            number(100.0 * each.turbulence),
            each.rejected,
        ]
        for each in selected
    ]
    head = ["file", "begin (UTC)", "operation", "", "wind\nm/s", "turbulence\n%", "reason"]
    return Table(head, rows, "Records", text_columns=4)
