"""Log of the supervisor: transitions in its state, and their description."""

from __future__ import annotations

import math

from meltemi.compiler import Entries, Table, kernel, number, parts, whole
from meltemi.control.controller import LogEntry
from meltemi.supervisor.tables import CONDITIONS, DEGREES, KILOWATT, STATES, YAW_NUMBER, YAW_STATES


class EntryRow(Table, title="log entry"):
    """Entry of the log."""

    time: float = number("s", "time of the transition")
    machine: float = number("-", "0 operation, 1 yaw protection")
    source: float = number("-", "number of the previous state")
    target: float = number("-", "number of the new state")
    condition: float = number("-", "index of the first condition in the table of conditions")
    holds: float = number("-", "positive: the condition became true, negative: false")
    value: float = number("-", "monitored value")
    limit: float = number("-", "limit of the condition")


LOG_ROOM = 300
"""Number of transitions that are kept, the first ones of a run."""
HOUR = 3600.0


class Log(Table):
    """Transitions in chronological order."""

    written: float = number("-", "number of transitions")
    entry: Entries[EntryRow] = parts(EntryRow, LOG_ROOM, "those that are kept")


@kernel
def new_entry(log: Log) -> int:
    """Index of the next entry, -1 if the log is full."""
    n = whole(log.written)
    log.written = float(n + 1)
    return n if n < LOG_ROOM else -1


def log_entries(log: Log) -> list[LogEntry]:
    """Entries with description."""
    entries, derated = [], []
    for n in range(min(int(log.written), LOG_ROOM)):
        row = log.entry[n]
        states = YAW_STATES if row.machine else STATES
        reason = _reason(int(row.condition), row.holds > 0, float(row.value), float(row.limit))
        if row.machine and row.target == YAW_NUMBER["derated"]:
            derated.append(row.time)
            reason += f"; {sum(row.time - t <= HOUR for t in derated)} within an hour"
        again = row.source == YAW_NUMBER["derated"] and row.target == YAW_NUMBER["normal"]
        if row.machine and again and row.holds > 0:
            reason += ", yaw error within its threshold"
        what = f"{states[int(row.source) - 1].name} -> {states[int(row.target) - 1].name}".replace("_", " ")
        source = "yaw protection" if row.machine else "supervisor"
        entries.append(LogEntry(float(row.time), source, what, reason))
    return entries


def _reason(c: int, holds: bool, value: float, limit: float) -> str:
    if not holds:
        return f"no longer: {CONDITIONS[c].doc}"
    if c in DEGREES:
        value, limit = math.degrees(value), math.degrees(limit)
    if c in KILOWATT:
        value, limit = 1e-3 * value, 1e-3 * limit
    return CONDITIONS[c].doc.format(value=value, limit=limit)
