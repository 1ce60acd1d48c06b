"""Running the cases of a load base that are missing: on threads of this machine, or on a Dask cluster.

Cases run in groups, in random order, so that several processes in one folder rarely meet; what one has finished the
others skip. A backend is a function that takes groups of jobs and hands over rows as they are finished.
"""

from __future__ import annotations

import hashlib
import random
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import astuple, dataclass, replace
from functools import partial
from itertools import accumulate
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING

import meltemi
from meltemi.core.calls import arguments_of
from meltemi.core.errors import InputError, MeltemiError, Status
from meltemi.core.physics import PHYSICS
from meltemi.core.representation import Card, Fold
from meltemi.core.shown import Shown
from meltemi.loadcases.batch import Batch, Piece, check_division
from meltemi.loadcases.store import Outcome
from meltemi.loads.loadbase.jobs import CaseRow, Job, Workshop, check_key, jobs_of, names_by_key
from meltemi.loads.loadbase.joints import without_members
from meltemi.loads.loadbase.plan import Plan
from meltemi.loads.loadbase.store import ResultStore
from meltemi.simulation.result import Result
from meltemi.simulation.run import Run

if TYPE_CHECKING:
    import pandas as pd

GROUP = 10800.0
"""Time [s] simulated by a group of cases, with ``SHORTEST`` more for each: about 15 s of one core."""
SHORTEST = 30.0
"""Time [s] that is simulated while a case begins and is reduced."""
KEPT = 30.0
"""Time [s] after which finished cases are written, though they are no group yet: no more is lost to a full disk."""
FEWEST_GROUPS, MOST_GROUPS = 100, 2000
"""Numbers of groups: many more than workers, of which each may be lost; but of larger load bases they are larger."""
MOST_PROBLEMS = 50
"""Largest number of messages that a notebook shows."""

Finished = Callable[[Sequence[CaseRow]], None]


Backend = Callable[[Iterable[Sequence[Job]], Finished], None]
"""Runs group after group of jobs, and hands over their rows to ``finished`` from the calling thread."""


@dataclass(frozen=True)
class Progress:
    """State of a run of a load base.

    Attributes:
      done, total: numbers of cases.
      share: completed share of the simulated time.
      seconds_left: estimate [s] of wall time; None before the first case.
    """

    done: int
    total: int
    share: float
    seconds_left: float | None


@dataclass(frozen=True)
class DlcStatus:
    """Number of cases of a row of the load case table, such as 7.1b, by outcome."""

    dlc: str
    cases: int
    ok: int
    doubtful: int
    failed: int
    missing: int
    unsupported: int


@dataclass(frozen=True, repr=False)
class BaseStatus(Shown):
    """State of a load base.

    Attributes:
      dlcs: numbers of cases by row of the load case table, as in the plan.
      problems: messages of cases that failed or are doubtful, by name.
      hours: [h] simulated time that is missing.
      unreadable: files that count as missing, with the reason.
      outdated: number of results of other inputs, such as an earlier controller.
    """

    dlcs: tuple[DlcStatus, ...]
    problems: dict[str, str]
    hours: float
    unreadable: dict[Path, str]
    outdated: int

    def __repr__(self) -> str:
        return f"BaseStatus({self.done} of {self.total} cases, {self.failed} failed, {self.hours:.1f} h missing)"

    def card(self) -> Card:
        """Cases by row of the load case table and outcome, and messages."""
        facts = [("done", f"{self.done} of {self.total} cases"), ("missing", f"{self.hours:.1f} h simulated")]
        head = ["DLC", "cases", "ok", "doubtful", "failed", "missing", "cannot run"]
        rows = [[row.dlc, *(str(n) if n else "-" for n in astuple(row)[1:])] for row in self.dlcs]
        sections = [Fold("Design load cases", rows, head, open=True)]
        if self.problems:
            problems = list(self.problems.items())
            sections.append(Fold("Messages", problems[:MOST_PROBLEMS], ["case", "message"], note=str(len(problems))))
        return Card("BaseStatus", "", facts, sections)

    @property
    def total(self) -> int:
        """Cases that can run."""
        return sum(row.cases - row.unsupported for row in self.dlcs)

    @property
    def done(self) -> int:
        """Cases with results, failed ones included."""
        return self.total - sum(row.missing for row in self.dlcs)

    @property
    def failed(self) -> int:
        """Number of cases without loads, since their run did not reach its end."""
        return sum(row.failed for row in self.dlcs)


@dataclass(frozen=True, kw_only=True)
class Execution:
    """Execution of the missing runs of a load base or of a surrogate.

    Attributes:
      shard: number k, from 1, and N: only every N-th case, beginning with the k-th.
      workers: threads; by default one for each core this process may use.
      dask: address of the scheduler of a Dask cluster, or ``local``: worker processes of this machine.
      device: "cpu"; "cuda" or "cuda-single" for a graphics card, the latter in single precision.
      retry: run cases again that failed.
      progress: called as cases are finished.
    """

    shard: tuple[int, int] = (1, 1)
    workers: int | None = None
    dask: str | None = None
    device: str = "cpu"
    retry: bool = False
    progress: Callable[[Progress], None] | None = None

    def __post_init__(self) -> None:
        check_division(self.shard, self.dask, self.device)


@dataclass(frozen=True)
class BaseRun(Execution):
    """Runs of a load base.

    Attributes:
      plan: plan of the load base.
      folder: folder of the load base; results are written to ``results`` in it.
      expect: hash of the plan, see :func:`plan_hash`, without which nothing runs; empty: any.
    """

    plan: Plan
    folder: str | Path
    expect: str = ""


@arguments_of(BaseRun)
def run_base(run: BaseRun) -> BaseStatus:
    """Run the cases of a load base that are missing; the arguments are the fields of :class:`BaseRun`.

    Returns:
      State of all cases after the runs.

    Raises:
      InputError: ``shard`` or ``device`` is not valid, a file cannot be read or written, or Dask is not installed.
      KeyboardInterrupt: Ctrl-C; what was finished is kept.
    """
    jobs = jobs_of(run.plan)
    if run.expect and run.expect != plan_hash(jobs):
        raise InputError(
            f"{run.folder}: not the plan that was submitted: this machine has another version of meltemi "
            f"({meltemi.__version__}, physics {PHYSICS}), turbine or controller file"
        )
    store = ResultStore(run.folder)
    run_jobs(jobs, store, run)
    return status_of(run.plan, jobs, store)


def plan_hash(jobs: Iterable[Job]) -> str:
    """Hash of the inputs of all cases and of the version of the physics."""
    return hashlib.sha256(" ".join(sorted(job.key for job in jobs)).encode()).hexdigest()[:12]


def missing_jobs(plan: Plan, folder: str | Path) -> list[Job]:
    """Jobs of a plan without results."""
    places = ResultStore(folder).places
    return [job for job in jobs_of(plan) if job.key not in places]


def run_jobs(jobs: Sequence[Job], store: ResultStore, how: Execution) -> None:
    """Run the jobs whose results are missing in a store; errors as for :func:`run_base`."""
    store.tidy()
    k, n = how.shard
    selected = list({job.key: job for job in jobs[k - 1 :: n]}.values())
    count = _Count(selected, how.progress)

    def missing(job: Job) -> bool:
        place = store.places.get(job.key)
        return place is None or (how.retry and not place.status.complete and job.key not in count.keys)

    def groups() -> Iterator[list[Job]]:
        for group in grouped([job for job in selected if missing(job)]):
            store.refresh()
            if left := [job for job in group if missing(job)]:
                yield left
            count.keys |= {job.key for job in group} - {job.key for job in left}

    def finished(rows: Sequence[CaseRow]) -> None:
        store.write(rows)
        count.add({row.key for row in rows})

    count.keys |= {job.key for job in selected if not missing(job)}
    threads = OnThreads(how.workers, how.device, lambda seconds: count.add(set(), seconds))
    backend: Backend = threads if how.dask is None else partial(run_on_dask, how.dask)
    backend(groups(), finished)
    store.refresh()


def grouped(jobs: Sequence[Job]) -> list[list[Job]]:
    """Groups of consecutive jobs, in random order."""
    *begins, whole = accumulate((job.seconds + SHORTEST for job in jobs), initial=0.0)
    size, groups = max(min(GROUP, whole / FEWEST_GROUPS), whole / MOST_GROUPS, 1e-9), dict[int, list[Job]]()
    for job, begin in zip(jobs, begins, strict=True):
        groups.setdefault(int(begin / size), []).append(job)
    shuffled = list(groups.values())
    random.shuffle(shuffled)
    return shuffled


class _Count:
    """Count of finished cases, with an estimate of the time left."""

    def __init__(self, jobs: Sequence[Job], progress: Callable[[Progress], None] | None) -> None:
        self.seconds = {job.key: job.seconds for job in jobs}
        self.keys: set[str] = set()
        self.progress = progress
        self.before = 0.0
        self.began: float | None = None

    def add(self, keys: set[str], under_way: float = 0.0) -> None:
        """Count finished cases; ``under_way`` [s] are simulated, but not yet written."""
        self.keys |= keys
        if self.progress is None:
            return
        # a copy, since other threads add keys
        whole, done = sum(self.seconds.values()), sum(self.seconds[key] for key in list(self.keys)) + under_way
        if self.began is None:  # work before the end of the first case, such as compilation, occurs once
            self.before, self.began = done, perf_counter()
        spent, gained = perf_counter() - self.began, done - self.before
        left = spent * (whole - done) / gained if gained > 0.0 else None
        self.progress(Progress(len(self.keys), len(self.seconds), done / max(whole, 1e-9), left))


@dataclass(frozen=True)
class OnThreads:
    """Backend: threads of this process.

    Attributes:
      workers: number of threads; by default one for each core this process may use.
      device: "cpu"; "cuda" or "cuda-single" for a graphics card, the latter in single precision.
      tell: called with the simulated time [s] of the finished cases that are not yet handed over.
    """

    workers: int | None = None
    device: str = "cpu"
    tell: Callable[[float], None] = lambda seconds: None

    def __call__(self, groups: Iterable[Sequence[Job]], finished: Finished) -> None:
        """Run all jobs; rows are handed over when together they have the length of a group, or after some time.

        Raises:
          KeyboardInterrupt: Ctrl-C, after the rows of the finished cases were handed over.
        """
        shop, rows, jobs, kept = Workshop(), list[CaseRow](), dict[str, Job](), perf_counter()

        def runs() -> Iterator[Run]:
            for group in groups:
                for job in group:
                    try:
                        run = shop.run(job)
                    except Exception as error:  # of one case
                        words = str(error) if isinstance(error, MeltemiError) else f"{type(error).__name__}: {error}"
                        rows.append(CaseRow(job.name, job.key, Status.FAILED, words))
                        continue
                    jobs[job.name] = job
                    yield run

        def done(outcome: Outcome) -> None:
            job = jobs.pop(outcome.name)
            if outcome.status is not Status.INTERRUPTED:
                rows.append(outcome.value or CaseRow(job.name, job.key, outcome.status, outcome.message))
            together = sum(row.simulated for row in rows)
            if together >= GROUP or perf_counter() - kept >= KEPT:
                hand_over()
            else:
                self.tell(together)

        def hand_over() -> None:
            nonlocal kept
            if finished_rows := [rows.pop(0) for _ in range(len(rows))]:  # other threads may add to them
                finished(finished_rows)
            kept = perf_counter()

        batch = Batch(runs(), reduce=shop.row, workers=self.workers, done=done, device=self.device)
        batch.run()
        hand_over()
        if batch.interrupted:
            raise KeyboardInterrupt


def run_on_dask(address: str, groups: Iterable[Sequence[Job]], finished: Finished) -> None:
    """Backend: a Dask cluster. A group whose worker dies runs on another one.

    Args:
      address: address of the scheduler, or ``local``: one worker process for each core.
      groups: groups of jobs.
      finished: called with the rows of each group.

    Raises:
      InputError: Dask is not installed, there is no scheduler at the address, or groups could not be run.
      KeyboardInterrupt: Ctrl-C, after the rows of the finished groups were handed over.
    """
    lost: list[str] = []

    def done(outcome: Outcome) -> None:
        if outcome.ok:
            finished(outcome.value)
        elif outcome.status is not Status.INTERRUPTED:
            lost.append(outcome.message)

    batch = Batch((Piece("", partial(compute, group)) for group in groups), dask=address, done=done)
    batch.run()
    if batch.interrupted:
        raise KeyboardInterrupt
    if lost:
        raise InputError(f"{len(lost)} groups of cases could not be run, the first one: {lost[0]}")


def compute(jobs: Sequence[Job]) -> list[CaseRow]:
    """Rows of jobs, run one after the other by a worker of a cluster.

    Raises:
      InputError: this process has other files or another version than the process of the jobs.
    """
    known: dict[str, str] = {}
    for job in jobs:
        check_key(job, known)
    rows: list[CaseRow] = []
    OnThreads(workers=1)([jobs], rows.extend)
    return rows


def base_status(plan: Plan, folder: str | Path) -> BaseStatus:
    """State of a load base: numbers of completed, failed and missing cases.

    Raises:
      InputError: the turbine or a file of the controller cannot be read.
    """
    return status_of(plan, jobs_of(plan), ResultStore(folder))


def status_of(plan: Plan, jobs: Sequence[Job], store: ResultStore) -> BaseStatus:
    """State of the jobs of a plan."""
    keys = {job.name: job.key for job in jobs}
    counts: dict[str, Counter[str]] = {}
    for case in plan.cases:
        place = store.places.get(keys.get(case.name, ""))
        if case.unsupported:
            word = "unsupported"
        elif place is None:
            word = "missing"
        else:
            word = place.status.name.lower() if place.status.complete else "failed"
        counts.setdefault(case.row, Counter())[word] += 1
    words = ("ok", "doubtful", "failed", "missing", "unsupported")
    dlcs = tuple(DlcStatus(row, sum(c.values()), *(c[word] for word in words)) for row, c in counts.items())
    bad = {job.key: [job.name] for job in jobs if (p := store.places.get(job.key)) and p.status is not Status.OK}
    problems = store.table(bad)[["status", "message"]].agg(": ".join, axis=1).to_dict() if bad else {}
    hours = sum(job.seconds for job in jobs if job.key not in store.places) / 3600.0
    return BaseStatus(dlcs, problems, hours, store.unreadable, len(store.places.keys() - {*keys.values()}))


def base_table(
    plan: Plan, folder: str | Path, what: str = "cases", channels: Sequence[str] | None = None
) -> pd.DataFrame:
    """A table of the results of a load base: those of the completed cases of the plan, in the order of the plan.

    Args:
      plan: plan of the load base.
      folder: folder of the load base.
      what: ``cases`` (status, messages, times), ``statistics`` (of each channel), ``extremes`` (with contemporaneous
        loads), ``durations`` (of loads), ``duties`` (of drives), or ``cycles`` (of loads, for fatigue).
      channels: only these, for statistics and cycles.

    Returns:
      table in SI units; one row for each case, with its name as index, or several rows with the column "case".

    Raises:
      InputError: there is no such table, or a file cannot be read.
    """
    return ResultStore(folder).table(names_by_key(jobs_of(plan)), what, channels)


def show_case(plan: Plan, name: str, progress: Callable[[float], None] | None = None) -> Result:
    """Simulate a case of a load base again, with exactly the same numbers.

    Args:
      plan: plan of the load base.
      name: name of the case.
      progress: callback with the completed fraction.

    Raises:
      InputError: there is no such case, it cannot run, or its run fails.
    """
    case = plan.case(name)
    if case.unsupported:
        raise InputError(f"{name} cannot run yet: {case.unsupported}")
    job = next(job for job in jobs_of(plan) if job.name == name)
    results: list[Result] = []
    batch = Batch([Workshop(hashed=True).run(job)], reduce=results.append, workers=1, progress=progress)
    outcomes = batch.run()
    if batch.interrupted:
        raise KeyboardInterrupt
    if not results:
        raise InputError(f"{name}: {outcomes[0].message}")
    return results[0]


def same_numbers(plan: Plan, folder: str | Path, name: str, result: Result) -> bool | None:
    """Whether a result equals the statistics of its case in the load base exactly; None if there are none."""
    part = without_members(result.evaluated)
    kept = base_table(replace(plan, cases=(plan.case(name),)), folder, "statistics", part.names).set_index("channel")
    if kept.empty:
        return None
    return all((kept.at[c, "min"], kept.at[c, "max"]) == (part[c].min(), part[c].max()) for c in part.names)
