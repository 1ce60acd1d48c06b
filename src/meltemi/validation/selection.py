"""Selection of records by operation, and the capture matrix over wind speed and turbulence.

The matrix and the classes are those of IEC 61400-13: bins of 1 m/s, centred on whole numbers, and of 2 % turbulence
intensity from 3 to 29 %.

Reference: docs/theory/validation.md (V-4).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from meltemi.core.record import Record
from meltemi.postprocess.bins import EDGES
from meltemi.report.tables import number
from meltemi.reports.blocks import Table
from meltemi.turbine.definition import Turbine
from meltemi.validation.issues import DataIssue
from meltemi.validation.measurements import MeasuredRecord, moment

Operation = Literal["production", "start", "stop", "idling", "parked", "fault", "interrupted"]
TURBULENCE = (0.0, *(k / 100.0 for k in range(3, 31, 2)), np.inf)  # edges of bins: up to 3 %, 2 % each, above 29 %
TURBULENCE_LABELS = ("< 3", *(f"{k}-{k + 2}" for k in range(3, 29, 2)), "> 29")  # [%]
SPEED_LABELS = ("0-2.5", *(str(k) for k in range(3, 25)))  # [m/s] the first bin, centres of the others
BLOCK = 5.0  # [s] over which power is averaged, so that its noise about zero does not count
LEAST_POWER = 0.01  # power over rated power above which the turbine produces
LEAST_SPEED = 0.02  # rotor speed over rated speed below which it is parked
OVERSPEED = 1.15  # rotor speed over rated speed above which a record is a fault
TRIP = 0.25  # loss of power within two seconds, over rated power, which is a fault if it ends in no production


class SelectionRules(Record):
    """Limits of complete and undisturbed records."""

    complete: float = Field(default=0.99, gt=0.0, le=1.0)
    """Share of samples that every required channel must have."""
    sector: tuple[float, float] | None = None
    """[rad] directions from and to, clockwise, that are undisturbed; needs ``direction``."""
    direction: str = "wind_direction"
    """Channel of the wind direction."""
    excluding: tuple[str, ...] = ("spike", "stuck", "order", "clock", "unit", "sign", "turbine", "statistics")
    """Kinds of issues in a required channel that reject a record."""


RULES = SelectionRules()


@dataclass(frozen=True)
class SelectedRecord:
    """A record with its class, bin and, if it is rejected, the reason."""

    record: MeasuredRecord = field(repr=False)
    operation: Operation | None  # None without samples
    wind_speed: float  # [m/s] mean
    turbulence: float  # standard deviation over mean of the wind speed [-]
    rejected: str = ""  # reason; empty if it is used


def rated_rotor_speed(turbine: Turbine) -> float:
    """[rad/s] of the pitch loop."""
    return turbine.control.pitch.reference_speed / turbine.drivetrain.gear_ratio


def operation_of(record: MeasuredRecord, turbine: Turbine) -> Operation | None:
    """Class of a record by power and rotor speed, which it must have; None without samples.

    Statistics do not distinguish start, stop and fault: power that was above and below the limit is ``interrupted``.
    Where there are no extremes of the power, its mean decides; the rotor speed is optional.
    """
    if record.statistics:
        return _operation_by_statistics(record.statistics, turbine)
    speed = record["rotor_speed"].finite / rated_rotor_speed(turbine)
    power, rate = record["generator_power"].finite / turbine.rated_power, record["generator_power"].rate
    if not len(speed) or not len(power):
        return None
    width, two = max(1, min(round(BLOCK * rate), len(power))), max(round(2.0 * rate), 1)
    produces = power[: len(power) // width * width].reshape(-1, width).mean(axis=1) > LEAST_POWER
    loss = np.max(power[:-two] - power[two:], initial=0.0)
    if np.max(speed) > OVERSPEED or (np.min(power) <= LEAST_POWER and loss > TRIP):
        return "fault"
    if produces[0] and produces[-1]:
        return "production" if np.all(produces) else "fault"
    if np.any(produces):
        return "stop" if produces[0] else "start"
    return "parked" if np.mean(speed) < LEAST_SPEED else "idling"


def _operation_by_statistics(of: Mapping[str, Mapping[str, float]], turbine: Turbine) -> Operation | None:
    power, speed = of["generator_power"], of.get("rotor_speed", {})
    limit, rated = LEAST_POWER * turbine.rated_power, rated_rotor_speed(turbine)
    if "mean" not in power:
        return None
    if speed.get("max", 0.0) > OVERSPEED * rated:
        return "fault"
    if power.get("max", power["mean"]) > limit:
        return "production" if power.get("min", power["mean"]) > limit else "interrupted"
    return "parked" if speed.get("mean", np.inf) < LEAST_SPEED * rated else "idling"


def select(
    records: Sequence[MeasuredRecord],
    turbine: Turbine,
    *,
    wind: str = "wind_speed",
    needed: Sequence[str] = (),
    issues: Sequence[DataIssue] = (),
    rules: SelectionRules = RULES,
) -> list[SelectedRecord]:
    """Classify records, and reject those that are incomplete, doubtful (by ``issues``) or disturbed.

    Channels that must be complete are ``wind``, which has the wind speed, power, rotor speed (of statistics, if it is
    there) and those ``needed``.

    Raises:
      InputError: a record has not a required channel.
    """
    direction = [rules.direction] if rules.sector else []
    selected = []
    for record in records:
        optional = {"rotor_speed"} - record.signals.keys() if record.statistics else set()
        names = dict.fromkeys([wind, "rotor_speed", "generator_power", *needed, *direction])
        required = [name for name in names if name not in optional]
        shares = {name: record.completeness(name) for name in required}
        v = record[wind].finite
        mean = float(np.mean(v)) if len(v) else np.nan
        turbulence = float(np.std(v)) / mean if mean > 0.0 else np.nan
        reason = next(_reasons(record, mean, shares, issues, rules), "")
        selected.append(SelectedRecord(record, operation_of(record, turbine), mean, turbulence, reason))
    return selected


def _reasons(
    record: MeasuredRecord, mean: float, shares: Mapping[str, float], issues: Sequence[DataIssue], rules: SelectionRules
) -> Iterator[str]:
    """Why a record is rejected; none if it is not. ``shares`` of the samples are there of the required channels."""
    for name, share in shares.items():
        if share < rules.complete:
            yield f"{name}: {100.0 * share:.1f} % of the samples, {100.0 * rules.complete:g} % are required"
    if not mean > 0.0:
        yield f"mean wind speed {mean:.3g} m/s"
    for issue in issues:
        inside = issue.time < record.begin + record.length and issue.time + issue.duration >= record.begin
        concerned = issue.channel.split(" (")[0] in shares or issue.kind in ("order", "clock")
        if issue.kind in rules.excluding and inside and concerned:
            yield f"{issue.kind} in {issue.channel or issue.file}"
    if rules.sector is not None:
        low, high = rules.sector
        centre = np.angle(np.sum(np.exp(1j * record[rules.direction].finite)))
        if (centre - low) % (2.0 * np.pi) > (high - low) % (2.0 * np.pi):
            yield f"wind direction {np.degrees(centre) % 360.0:.0f} deg outside the undisturbed sector"


def capture_matrix(selected: Sequence[SelectedRecord], operation: Operation = "production") -> NDArray[np.intp]:
    """(turbulence bins, wind speed bins) numbers of records of a class that are used; bins contain their lower edge."""
    used = [each for each in selected if not each.rejected and each.operation == operation]
    places = [each.turbulence for each in used], [each.wind_speed for each in used]
    return np.histogram2d(*places, bins=(TURBULENCE, EDGES))[0].astype(np.intp)


def capture_table(matrix: NDArray[np.intp]) -> Table:
    """The capture matrix as a table of reports: bins of wind speed that have records, and the sum."""
    columns = np.flatnonzero(matrix.sum(axis=0))
    rows = [[name, *(n or "" for n in row)] for name, row in zip(TURBULENCE_LABELS, matrix[:, columns], strict=True)]
    rows.append(["all", *matrix[:, columns].sum(axis=0)])
    head = ["turbulence\n%", *(f"{SPEED_LABELS[j]}\nm/s" for j in columns)]
    return Table(head, [[*map(str, row)] for row in rows], "Records by turbulence intensity and wind speed")


def selection_table(selected: Sequence[SelectedRecord]) -> Table:
    """Records, used and rejected, as a table of reports."""
    head = ["file", "begin (UTC)", "operation", "", "wind\nm/s", "turbulence\n%", "reason"]
    rows = [
        [s.record.file, moment(s.record.begin), s.operation or "unknown", "rejected" if s.rejected else "used",
         number(s.wind_speed), number(100.0 * s.turbulence), s.rejected]
        for s in selected
    ]  # fmt: skip
    return Table(head, rows, "Records", text_columns=4)
