"""Inputs that change in a run without control: wind, air and grid. Changes outside of a run have no effect."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

from meltemi.control.controller import LogEntry
from meltemi.core.record import Record
from meltemi.core.series import TimeSeries, changing
from meltemi.wind.fields import Wind, WindSeries


def wind_log(wind: Wind, duration: float, dt: float) -> Iterator[tuple[int, LogEntry]]:
    """Begin and end of a gust or another change of the wind for a part of a run, each with its time step.

    Args:
      duration, dt: [s] duration of the run, and its time step.
    """
    span = wind.changes if isinstance(wind, WindSeries) else None
    if span is None or (span[0] <= 0.0 and span[1] >= duration):
        return
    for time, what in zip(span, ("begins to change", "is constant again"), strict=True):
        if 0.0 <= time <= duration:
            yield math.ceil(time / dt - 1e-6), LogEntry(time, "wind", what, wind.label)


def unseen(wind: Wind, others: Mapping[str, Record | None], duration: float, transient: float) -> list[str]:
    """Warnings about changes that a run shows only in part, or that its statistics leave out.

    Args:
      others: descriptions of grid and air, by name.
      duration, transient: [s] duration of the run and of its initial transient.
    """
    causes = []
    if isinstance(wind, WindSeries) and (span := wind.changes):
        if span[0] > 0.0 and span[1] > duration:
            causes.append(f"{wind.label}: the wind changes until {span[1]:g} s, but the run ends at {duration:g} s")
        if span[1] <= transient:
            causes.append(f"{wind.label}: over at {span[1]:g} s, within the initial transient of {transient:g} s")
    for where, record in others.items():
        for name, value in dict(record or {}).items():
            if isinstance(value, TimeSeries) and (span := changing(value.time, value.value)) and span[0] >= duration:
                causes.append(f"{where}.{name}: changes at {span[0]:g} s for the first time, after the end of the run")
    return causes
