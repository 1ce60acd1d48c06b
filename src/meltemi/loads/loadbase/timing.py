"""Processor time of a load base, from its finished cases or from short runs on this machine."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from meltemi.core.extras import missing
from meltemi.core.threads import available_cores
from meltemi.loads.loadbase.engine import OnThreads, base_table
from meltemi.loads.loadbase.jobs import CaseRow, Job, jobs_of
from meltemi.loads.loadbase.plan import Plan
from meltemi.loads.loadbase.situations import OPERATING

FIRST, TIMED = 5.0, 200.0
"""Simulated time [s] of a run that loads the machine code, and of the one that is timed: about a second of a core."""
MOST = 8
"""Largest number of concurrent runs: cores share caches and power, so that each is slower when others work."""
TIMES = ["wind_seconds", "simulation_seconds", "reduction_seconds"]


@dataclass(frozen=True)
class Cost:
    """Processor time of cases.

    Attributes:
      rate: [-] processor time over simulated time, including winds and starts.
      source: source of the numbers, as text.
    """

    rate: float
    source: str


def finished_cost(plan: Plan, folder: str | Path) -> Cost | None:
    """Cost by the finished cases of a load base; None if it has none, or if packages to read them are missing."""
    if missing(("pandas", "pyarrow")):
        return None
    frame = base_table(plan, folder)
    simulated = float(frame["simulated"].sum()) if len(frame) else 0.0
    if simulated <= 0.0:
        return None
    return Cost(float(frame[TIMES].to_numpy(float).sum()) / simulated, f"{len(frame)} finished cases")


def timed_cost(plan: Plan) -> Cost | None:
    """Cost by short runs of the first turbulent case of a turning and of a parked rotor; None if neither runs."""
    jobs = {job.name: job for job in jobs_of(plan)}
    costs, shares = [], []
    for parked in (False, True):
        cases = [c for c in plan.cases if not c.unsupported and (c.setting.row.situation in OPERATING) != parked]
        turbulent = [c for c in cases if c.seed is not None] or cases
        cost = _timed(jobs[turbulent[0].name]) if turbulent else None
        if cost is not None:
            costs.append(cost)
            shares.append(sum(c.duration + c.transient for c in cases))
    if not costs:
        return None
    rate = sum(cost * share for cost, share in zip(costs, shares, strict=True)) / sum(shares)
    return Cost(rate, "short runs on this machine")


def _timed(job: Job) -> float | None:
    """Processor time over simulated time; None if the run fails."""
    if _run(job, FIRST) is None:
        return None
    seconds = _run(job, TIMED)
    return None if seconds is None else seconds / TIMED


def _run(job: Job, seconds: float) -> float | None:
    """Processor time [s] of a run of some seconds, with all cores at work."""
    rows: list[CaseRow] = []
    content = job.content | {"duration": seconds, "transient": 0.0}
    content.pop("events", None)
    copies = [replace(job, name=f"{job.name} {i}", content=content) for i in range(min(available_cores(), MOST))]
    OnThreads()([copies], rows.extend)
    times = [sum(getattr(row, name) for name in TIMES) for row in rows if row.status.complete]
    return sum(times) / len(times) if len(times) == len(copies) else None
