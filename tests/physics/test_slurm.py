"""Load bases by a real Slurm on this machine: array jobs whose tasks are killed, and workers of Dask that it starts."""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import psutil
import pytest
from test_load_base import assert_same, campaign, names_in

from meltemi.loads.loadbase import engine
from meltemi.loads.loadbase.campaign import write_campaign
from meltemi.loads.loadbase.plan import Plan, plan
from tools import slurm

pytestmark = [pytest.mark.long, pytest.mark.skipif(bool(slurm.missing()), reason=slurm.missing() or "Slurm is there")]
PATIENCE = 300.0


@pytest.fixture(scope="module")
def daemons(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    folder = tmp_path_factory.mktemp("slurm")
    with pytest.MonkeyPatch.context() as patched:
        for name, value in slurm.start(folder, nodes=2).items():
            patched.setenv(name, value)
        yield
        slurm.stop(folder)


@pytest.fixture(scope="module")
def tiny() -> Plan:
    return plan(campaign())


@pytest.fixture(scope="module")
def whole(tiny: Plan, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("whole")
    engine.run_base(tiny, folder, workers=2)
    return folder


def until(true: Callable[[], Any], what: str) -> Any:
    began = time.monotonic()
    while not (found := true()):
        assert time.monotonic() - began < PATIENCE, what
        time.sleep(0.1)
    return found


def tasks(base: Path) -> list[psutil.Process]:
    """Processes of the tasks of the array."""
    found = []
    for process in psutil.process_iter():
        try:
            words = process.cmdline()
        except psutil.Error:
            continue
        if str(base) in words and "--shard" in words:
            found.append(process)
    return found


def queued() -> bool:
    return bool(subprocess.run(["squeue", "-h"], capture_output=True, check=True).stdout.strip())


@pytest.mark.usefixtures("daemons")
def test_tasks_that_are_killed_or_taken_away_are_finished(tiny: Plan, whole: Path, tmp_path: Path) -> None:
    """One process is killed, one job with its script, one is put back into the queue as by preemption."""
    write_campaign(tiny.campaign, tmp_path)
    words = [sys.executable, "-m", "meltemi", "loads", "submit", tmp_path, "--slurm", "--cores", "1", "--tasks", "4"]
    printed = subprocess.run([*words, "--now"], check=True, capture_output=True, text=True).stdout
    assert "4 tasks of 1 cores" in printed and "submitted: " in printed
    first = until(lambda: tasks(tmp_path)[:3] if len(tasks(tmp_path)) >= 3 else [], "three tasks at a time")
    number = first[2].environ()["SLURM_ARRAY_JOB_ID"], first[2].environ()["SLURM_ARRAY_TASK_ID"]
    subprocess.run(["scontrol", "requeue", "_".join(number)], check=True)
    first[0].kill()
    for process in (first[1].parent(), first[1]):
        assert process is not None
        process.kill()
    until(lambda: not queued(), "the end of all jobs")
    assert engine.base_status(tiny, tmp_path).done == len(tiny.cases)
    assert sorted(names_in(tmp_path)) == sorted(case.name for case in tiny.cases)
    assert_same(tiny, whole, tmp_path)
    told = "".join(file.read_text() for file in tmp_path.glob("jobs/*-array-*.txt"))
    assert "Killed" in told and "DUE TO JOB REQUEUE" in told


@pytest.mark.usefixtures("daemons")
def test_workers_of_dask_that_slurm_starts(tiny: Plan, whole: Path, tmp_path: Path) -> None:
    jobqueue = pytest.importorskip("dask_jobqueue")
    settings: dict[str, Any] = {"cores": 1, "memory": "2GB", "walltime": "00:20:00", "interface": "lo"}
    settings |= {
        "scheduler_options": {"dashboard_address": ":0"},
        "log_directory": str(tmp_path),
        "python": sys.executable,
    }
    with jobqueue.SLURMCluster(**settings) as cluster:
        cluster.scale(jobs=2)
        assert engine.run_base(tiny, tmp_path, dask=cluster.scheduler_address).done == len(tiny.cases)
    assert_same(tiny, whole, tmp_path)
