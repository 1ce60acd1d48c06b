"""Processor time of a load base, from its finished cases or from short runs on this machine."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from meltemi.cluster.scripts import JobSize, job_size
from meltemi.core.errors import InputError
from meltemi.core.extras import missing
from meltemi.core.threads import available_cores
from meltemi.loadcases.batch import memory_of, prepare
from meltemi.loadcases.store import with_model_and_wind
from meltemi.loads.loadbase.engine import OnThreads, base_table, missing_jobs
from meltemi.loads.loadbase.jobs import CaseRow, Job, Workshop, jobs_of
from meltemi.loads.loadbase.plan import Plan
from meltemi.loads.loadbase.situations import OPERATING

FIRST, TIMED = 5.0, 200.0
"""Simulated time [s] of a run that loads the machine code, and of the one that is timed: about a second of a core."""
MOST = 8
"""Largest number of concurrent runs: cores share caches and power, so that each is slower when others work."""
PROCESS, FIELDS = 0.5e9, 6.0
"""Memory [bytes] of a process beside its cases, and that of a case over its field and series, at most."""
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


def compile_base(plan: Plan) -> int:
    """Compile what the cases of a plan need, by a short run of one of each row; the number of runs that failed."""
    first = {case.row: case.name for case in reversed(plan.cases) if not case.unsupported}
    rows: list[CaseRow] = []
    brief = [_brief(job, 1.0, job.name) for job in jobs_of(plan) if job.name in first.values()]
    OnThreads()([brief], rows.extend)
    return sum(not row.status.complete for row in rows)


def base_size(plan: Plan, folder: str | Path, cost: Cost, cores: int, tasks: int | None) -> JobSize:
    """Size of the jobs that run what is missing of a load base; arguments as of :func:`job_size`.

    Raises:
      InputError: nothing is missing, or a number is not positive.
    """
    jobs = missing_jobs(plan, folder)
    if not jobs:
        raise InputError(f"{folder}: all cases have results; nothing is to be submitted")
    longest = max(jobs, key=lambda job: job.seconds)
    run = Workshop().run(longest)
    memory = PROCESS + cores * FIELDS * sum(memory_of(prepare(with_model_and_wind(run))).values())
    processor = cost.rate * sum(job.seconds for job in jobs)
    return job_size(processor, cost.rate * longest.seconds, memory, len(jobs), cores, tasks)


def _timed(job: Job) -> float | None:
    """Processor time over simulated time; None if the run fails."""
    if _run(job, FIRST) is None:
        return None
    seconds = _run(job, TIMED)
    return None if seconds is None else seconds / TIMED


def _run(job: Job, seconds: float) -> float | None:
    """Processor time [s] of a run of some seconds, with all cores at work."""
    rows: list[CaseRow] = []
    copies = [_brief(job, seconds, f"{job.name} {i}") for i in range(min(available_cores(), MOST))]
    OnThreads()([copies], rows.extend)
    times = [sum(getattr(row, name) for name in TIMES) for row in rows if row.status.complete]
    return sum(times) / len(times) if len(times) == len(copies) else None


def _brief(job: Job, seconds: float, name: str) -> Job:
    """The first seconds of a job."""
    content = {key: value for key, value in job.content.items() if key != "events"}
    return replace(job, name=name, content=content | {"duration": seconds, "transient": 0.0})
