"""Tables for terminals and files."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from meltemi.core.display import rounded
from meltemi.core.files import replacing
from meltemi.postprocess.fatigue import equivalent_loads
from meltemi.simulation.result import channel_statistics

if TYPE_CHECKING:
    from rich.table import Table

    from meltemi.analyses.campbell import Campbell
    from meltemi.simulation.operating_point import OperatingPoint
    from meltemi.simulation.result import Result
    from meltemi.turbulence.statistics import FieldStatistics, SeriesStatistics


Rows = tuple[list[str], list[list[str]]]
"""Header and rows of a table."""


class Number(str):
    """Formatted number that keeps its value: tables show a few digits, files all of them."""

    __slots__ = ("value",)
    value: float


def number(value: float) -> str:
    """Format a number with four or five significant digits, without exponent if possible."""
    text = Number(rounded(float(value)))
    text.value = float(value)
    return text


def statistics_rows(result: Result) -> Rows:
    """Header and rows of the statistics of a result, in engineering units.

    Raises:
      InputError: the result has no samples.
    """
    loads = equivalent_loads(result) if len(result.evaluated.time) > 1 else {}
    rows = []
    for channel, statistics in channel_statistics(result):
        unit, factor = channel.display_unit
        load = number(loads[channel.name] * factor) if channel.name in loads else ""
        rows.append([channel.name, channel.alias, unit, *map(number, statistics), load])
    return ["channel", "OpenFAST", "unit", "mean", "std", "min", "max", "DEL 1 Hz"], rows


EARLY, EARLY_PART = 10.0, 0.05
"""[s] first part of a run in which an extreme may depend on the start, and its fraction of shorter runs: in turbulence
an extreme of the wind falls into it once in twenty times. Runs shorter than three times that give no warning."""
EARLY_UNITS = ("N", "N m", "m", "W")
"""Units of the channels whose extremes are examined."""
EARLY_SHARE = 0.05
"""Amount by which an early extreme exceeds all later ones in a warning, over the channel's largest later magnitude."""


def early_extremes(result: Result) -> str:
    """Warning about extremes in the first seconds of a run; empty if there are none."""
    judged = result.evaluated
    if len(judged.time) < 2 or judged.time[-1] < 3.0 * EARLY:
        return ""
    first = judged.time <= min(EARLY, EARLY_PART * judged.time[-1])
    suspects = []
    for i, channel in enumerate(judged.channels):
        if channel.unit not in EARLY_UNITS or not first.any():
            continue
        early, later = judged.data[first, i], judged.data[~first, i]
        room = EARLY_SHARE * abs(later).max()
        for place, beyond in ((early.argmax(), early.max() - later.max()), (early.argmin(), later.min() - early.min())):
            if beyond > room:
                suspects.append((beyond / max(room, 1e-300), f"{channel.name} at {judged.time[place]:.2f} s"))
    if not suspects:
        return ""
    suspects.sort(reverse=True)
    names = ", ".join(words for _, words in suspects[:3]) + (" and others" if len(suspects) > 3 else "")
    return f"extremes occur in the first seconds and may depend on the start ({names}): set transient to exclude them"


def field_rows(field: FieldStatistics) -> Rows:
    """Header and rows of the statistics of a field: hub, grid mean, smallest and largest value of its points.

    Of the grid, means, deviations and intensities are averages over its points, minimum and maximum are the extremes,
    and scales are those of the average autocorrelation.
    """
    from meltemi.turbulence.statistics import CALM, COMPONENTS

    head = ["where", "component", "mean m/s", "std m/s", "intensity %", "min m/s", "max m/s"]
    head += ["time scale s", "length m"]
    mean = field.mean * (abs(field.mean) > CALM * field.speed)  # no rounding errors in a table
    values = (mean, field.std, 100.0 * field.intensity, field.lowest, field.highest)
    rows: list[list[str]] = []

    def add(where: str, c: int, *numbers: float) -> None:
        rows.append([where, COMPONENTS[c], *(number(float(x)) for x in numbers), *[""] * (7 - len(numbers))])

    for c in range(3):
        at_hub = (x[field.row, field.column, c] for x in values)
        add("hub", c, *at_hub, field.hub_time_scale[c], field.hub_length_scale[c])
    for c in range(3):
        averages, extremes = (x[..., c].mean() for x in values[:3]), (values[3][..., c].min(), values[4][..., c].max())
        add("grid", c, *averages, *extremes, field.grid_time_scale[c], field.grid_length_scale[c])
    for c in range(3):
        add("lowest of the grid", c, *(x[..., c].min() for x in values))
    for c in range(3):
        add("highest of the grid", c, *(x[..., c].max() for x in values))
    return head, rows


def series_rows(series: SeriesStatistics) -> Rows:
    """Header and rows of the statistics of a uniform wind, directions in degrees."""
    from meltemi.wind.velocity import WindNow

    units = {name: field.unit for name, field in zip(WindNow.names, WindNow.rows, strict=True)}
    rows = []
    for i, name in enumerate(series.names):
        unit = units.get(name, "m/s")
        factor = 180.0 / math.pi if unit == "rad" else 1.0
        values = (series.mean[i], series.std[i], series.lowest[i], series.highest[i])
        text = name.replace("_", " ")
        rows.append([text, "deg" if unit == "rad" else unit, *(number(float(x) * factor) for x in values)])
    return ["column", "unit", "mean", "std", "min", "max"], rows


def rich_table(title: str, head: Sequence[str], rows: Sequence[Sequence[str]], text_columns: int = 1) -> Table:
    """A terminal table; the first columns are text, the others numbers."""
    from rich.table import Table
    from rich.text import Text

    table = Table(title=Text(title), title_justify="left", header_style="bold")
    for i, name in enumerate(head):
        text = i < text_columns
        table.add_column(Text(name), justify="left" if text else "right", no_wrap=not text, overflow="fold")
    for row in rows:
        table.add_row(*map(Text, row))  # a string would be markup: [m/s] a style that does not exist
    return table


def markdown_table(head: Sequence[str], rows: Iterable[Sequence[str]], text_columns: int | None = None) -> list[str]:
    """Lines of a Markdown table; columns after the first ``text_columns`` are numbers, by default none are."""
    sides = ["---" if text_columns is None or i < text_columns else "---:" for i in range(len(head))]
    lines = [[" ".join(cell.split()).replace("|", "\\|") for cell in line] for line in (head, *rows)]
    first, *others = (f"| {' | '.join(line)} |" for line in lines)
    return [first, f"|{'|'.join(sides)}|", *others]


HEAD_UNIT = re.compile(
    r"(.*?[^\d\s])\s+\[?(m/s|rpm|deg/s|deg|rad/s|rad|Hz|%|kN m/deg|kN m|kN|MW|kW|kvar|kV|kg|m|s|h)\]?"
)
"""A column's name with its unit at the end."""


def _with_unit(text: str) -> str:
    """A column's name with its unit in brackets."""
    match = None if text.endswith("]") else HEAD_UNIT.fullmatch(text)
    return f"{match[1]} [{match[2]}]" if match else text


def write_csv(path: str | Path, head: Sequence[str], rows: Sequence[Sequence[str]]) -> Path:
    """Write a table as comma-separated values: units of the head in brackets, numbers with all digits.

    Raises:
      InputError: the file cannot be written.
    """
    import csv

    path = Path(path)
    with replacing(path) as (partial,), partial.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow([_with_unit(" ".join(cell.split())) for cell in head])
        for row in rows:
            known = (c.value if isinstance(c, Number) else math.nan for c in row)
            writer.writerow([f"{v:.15g}" if v == v else c for c, v in zip(row, known, strict=True)])
    return path


POWER_CURVE = {
    "rotor_speed": "speed",
    "pitch_1": "pitch",
    "generator_power": "power",
    "rotor_aero_thrust": "aero thrust",
    "rotor_torque": "torque",
    "root_moment_out_of_plane_1": "root oop",
    "root_moment_in_plane_1": "root ip",
    "tip_out_of_plane_1": "tip oop",
    "tip_in_plane_1": "tip ip",
    "tower_top_fore_aft": "tower top",
    "tower_base_moment_fore_aft": "tower base",
}
"""Channels of a power curve, as far as a turbine has them, and their short names."""
DISK_CURVE = {"tip_speed_ratio": "lambda", "power_coefficient": "C_p", "aerodynamic_power": "aero power"}
"""Additional channels of a power-coefficient turbine."""


def is_disk(point: OperatingPoint) -> bool:
    """Whether an operating point is that of a power-coefficient turbine."""
    return "aerodynamic_power" in point.channels


def power_curve_rows(points: Sequence[OperatingPoint], failures: Mapping[float, str] | None = None) -> Rows:
    """Header and rows of a power curve in engineering units; rows of failed wind speeds [m/s] are marked."""
    wanted = POWER_CURVE | (DISK_CURVE if is_disk(points[0]) else {})
    channels = [points[0].channels[name] for name in wanted if name in points[0].channels]
    head = ["wind\nm/s", *(f"{wanted[c.name]}\n{c.display_unit[0]}" for c in channels)]
    rows = {p.wind.speed: [number(p[c.name] * c.display_unit[1]) for c in channels] for p in points}
    rows |= {speed: ["failed", *[""] * (len(channels) - 1)] for speed in failures or {}}
    return head, [[number(speed), *rows[speed]] for speed in sorted(rows)]


def campbell_rows(diagram: Campbell) -> Rows:
    """Header and rows of a Campbell diagram, one per mode and operating point."""
    head = ["mode", "wind m/s", "rotor rpm", "pitch deg", "frequency Hz", "damping %", "energy"]
    operation = (diagram.wind_speed, diagram.rotor_speed * 30.0 / math.pi, diagram.pitch * 180.0 / math.pi)
    rows = []
    for label, frequency, damping in zip(diagram.labels, diagram.frequency, diagram.damping, strict=True):
        for i, (*where, f, d) in enumerate(zip(*operation, frequency, damping, strict=True)):
            values = (*where, f / (2.0 * math.pi), 100.0 * d)
            rows.append([label, *(number(float(v)) for v in values), diagram.participation(label, i)])
    return head, rows
