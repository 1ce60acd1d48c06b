"""The log of the supervisor: transitions in the state vector, and their words."""

from __future__ import annotations

import math

from numpy import float64
from numpy.typing import NDArray

from meltemi.control.controller import LogEntry
from meltemi.control.supervisor.tables import CONDITIONS, DEGREES, KILOWATT, STATES, YAW_NUMBER, YAW_STATES
from meltemi.core.kernel import kernel
from meltemi.maths.generic import whole
from meltemi.maths.tables import Table, number

Float = NDArray[float64]


class EntryRow(Table, title="log entry"):
    """One transition."""

    time: float = number("s", "of the transition")
    machine: float = number("-", "0 operation, 1 yaw protection")
    source: float = number("-", "number of the state that ended")
    target: float = number("-", "number of the state that began")
    condition: float = number("-", "place of the first condition in their table")
    holds: float = number("-", "positive if it held, negative if it did not")
    value: float = number("-", "of its quantity")
    limit: float = number("-", "of it")


LOG_ROOM = 300
"""Transitions that are kept; the first ones of a run."""
LOG = 1 + LOG_ROOM * len(EntryRow)
"""Places of the log: how many there were, then the entries."""
_LENGTH = len(EntryRow)
HOUR = 3600.0


@kernel
def write_entry(
    x: Float,
    at: int,
    time: float,
    machine: int,
    source: int,
    target: int,
    condition: int,
    holds: int,
    value: float,
    limit: float,
) -> None:
    """Write a transition behind the others, if there is room."""
    n = whole(x[at])
    x[at] = float(n + 1)
    if n >= LOG_ROOM:
        return
    place = at + 1 + _LENGTH * n
    x[place] = time
    x[place + 1], x[place + 2], x[place + 3] = float(machine), float(source), float(target)
    x[place + 4], x[place + 5] = float(condition), float(holds)
    x[place + 6], x[place + 7] = value, limit


def log_entries(journal: Float) -> list[LogEntry]:
    """The log in words.

    Args:
      journal: from the place of the log on.
    """
    entries, derated = [], []
    for n in range(min(int(journal[0]), LOG_ROOM)):
        time, machine, source, target, c, holds, value, limit = journal[1 + _LENGTH * n : 1 + _LENGTH * (n + 1)]
        states = YAW_STATES if machine else STATES
        reason = _reason(int(c), holds > 0, float(value), float(limit))
        if machine and target == YAW_NUMBER["derated"]:
            derated.append(time)
            reason += f"; {sum(time - t <= HOUR for t in derated)} within an hour"
        if machine and source == YAW_NUMBER["derated"] and target == YAW_NUMBER["normal"] and holds > 0:
            reason += ", yaw error within its threshold"
        what = f"{states[int(source) - 1].name} -> {states[int(target) - 1].name}".replace("_", " ")
        entries.append(LogEntry(float(time), "yaw protection" if machine else "supervisor", what, reason))
    return entries


def _reason(c: int, holds: bool, value: float, limit: float) -> str:
    if not holds:
        return f"no longer: {CONDITIONS[c].doc}"
    if c in DEGREES:
        value, limit = math.degrees(value), math.degrees(limit)
    if c in KILOWATT:
        value, limit = 1e-3 * value, 1e-3 * limit
    return CONDITIONS[c].doc.format(value=value, limit=limit)
