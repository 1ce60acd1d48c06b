"""Ten thousand short cases by threads, Slurm and Dask, with workers killed at random: the same tables to the bit.

    python tools/cluster_proof.py FOLDER [--seeds 257] [--tasks 64] [--only threads,slurm,dask]

Cases of 3 s of the NREL 5 MW. Slurm is that of ``tools/slurm.py`` with four nodes of two processors; each task of the
array is hit once at a random time: its process is killed, or the job with it, or it is told to end and started again as
by preemption. Dask has eight workers, each of which is killed within two minutes, and those that take their place after
five minutes on average. What is missing or different ends the tool with an assertion. It prints a table, and writes it
to FOLDER/proof.md.
"""

from __future__ import annotations

import argparse
import os
import random
import signal
import subprocess
import sys
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import pandas as pd
import psutil
import slurm

import meltemi
from meltemi.loads.loadbase.campaign import make_campaign, write_campaign
from meltemi.loads.loadbase.engine import base_table
from meltemi.loads.loadbase.plan import Plan, plan
from meltemi.loads.loadbase.table import load_table
from meltemi.report.tables import markdown_table

WORKERS = 8
FIRST, LIFE = 120.0, 300.0
"""Time [s] within which the first workers of Dask are killed, and mean life of those that take their place."""
TABLES = ("statistics", "extremes", "durations", "cycles")
HEAD = ["", "wall time [min]", "processor time [min]", "beyond the cases, a case [ms]", "kills", "cases", "twice"]


def campaign(seeds: int) -> Any:
    """Production of a turbine in ``seeds`` fields at each wind speed and yaw error."""
    return make_campaign(
        "nrel5mw",
        "IB",
        rated_wind=11.4,
        duration=2.0,
        transient=1.0,
        seeds=seeds,
        turbulence={"points": 5},
        changes={"without": sorted(load_table(4).rows.keys() - {"1.2"})},
    )


class Watch:
    """Processor time of the processes whose command line has a text; and what kills them."""

    def __init__(self, text: str, act: Callable[[list[psutil.Process]], None]) -> None:
        self.text, self.act, self.spent = text, act, dict[tuple[int, float], float]()
        self.ended = threading.Event()

    def run(self) -> None:
        while not self.ended.wait(0.25):
            found = []
            for process in psutil.process_iter():
                with suppress(psutil.Error):
                    words = " ".join(process.cmdline())
                    if self.text in words and "cluster_proof" not in words:
                        times = process.cpu_times()
                        self.spent[process.pid, process.create_time()] = times.user + times.system
                        found.append(process)
            self.act(found)


@contextmanager
def watched(text: str, act: Callable[[list[psutil.Process]], None] = lambda found: None) -> Iterator[Watch]:
    watch = Watch(text, act)
    thread = threading.Thread(target=watch.run, daemon=True)
    thread.start()
    yield watch
    watch.ended.set()
    thread.join()


def meltemi_command(*words: object) -> None:
    subprocess.run([sys.executable, "-m", "meltemi", *map(str, words)], check=True, stdout=subprocess.DEVNULL)


def by_threads(base: Path, tasks: int) -> tuple[float, Counter[str]]:
    with watched(str(base)) as watch:
        meltemi_command("loads", "run", base)
    return sum(watch.spent.values()), Counter()


def by_slurm(base: Path, tasks: int) -> tuple[float, Counter[str]]:
    """Each task is hit once, by one of three means."""
    chance, kills, due = random.Random(7), Counter[str](), dict[str, float]()
    hit: set[str] = set()

    def act(found: list[psutil.Process]) -> None:
        for process in found:
            with suppress(psutil.Error, OSError):
                words = process.cmdline()
                if "--shard" not in words:
                    continue
                task = words[words.index("--shard") + 1]
                moment = due.setdefault(task, process.create_time() + chance.uniform(2.0, 45.0))
                if task in hit or time.time() < moment:
                    continue
                hit.add(task)
                means = chance.choice(["process killed", "process killed", "job killed", "preempted"])
                kills[means] += 1
                if means == "process killed":
                    process.kill()
                elif means == "job killed":  # the script first, so that nobody asks for it to be started again
                    os.kill(process.ppid(), signal.SIGKILL)
                    process.kill()
                else:
                    job = process.environ()
                    number = f"{job['SLURM_ARRAY_JOB_ID']}_{job['SLURM_ARRAY_TASK_ID']}"
                    subprocess.run(["scontrol", "requeue", number], check=True)

    os.environ |= slurm.start(base.parent / "daemons", WORKERS // 2)
    try:
        with watched(f"loads run {base}", act) as watch:
            meltemi_command("loads", "submit", base, "--slurm", "--cores", 1, "--tasks", tasks, "--now")
            while subprocess.run(["squeue", "-h"], capture_output=True, check=True).stdout.strip():
                time.sleep(1.0)
    finally:
        slurm.stop(base.parent / "daemons")
    assert len(hit) > 0.9 * tasks, f"{len(hit)} of {tasks} tasks were hit"
    return sum(watch.spent.values()), kills


def by_dask(base: Path, tasks: int) -> tuple[float, Counter[str]]:
    """Each worker is killed once at least."""
    from distributed import LocalCluster

    chance, kills, due = random.Random(8), Counter[str](), dict[int, float]()

    def act(found: list[psutil.Process]) -> None:
        for process in found:
            with suppress(psutil.Error):
                if "spawn_main" not in " ".join(process.cmdline()):
                    continue
                life = chance.uniform(20.0, FIRST) if len(due) < WORKERS else chance.expovariate(1.0 / LIFE)
                if time.time() > due.setdefault(process.pid, process.create_time() + life):
                    kills["worker killed"] += 1
                    process.kill()

    with (
        LocalCluster(n_workers=WORKERS, threads_per_worker=1, dashboard_address=":0") as cluster,
        watched("multiprocessing.spawn", act) as workers,
        watched(f"loads run {base}") as host,
    ):
        cluster.adapt(minimum=WORKERS, maximum=WORKERS)  # also those that die as they begin
        meltemi_command("loads", "run", base, "--dask", cluster.scheduler_address)
    return sum(workers.spent.values()) + sum(host.spent.values()), kills


WAYS = {"threads": by_threads, "slurm": by_slurm, "dask": by_dask}


def tables(of: Plan, base: Path) -> Iterator[pd.DataFrame]:
    yield base_table(of, base)[["status", "message", "simulated", "stops"]]
    yield from (base_table(of, base, what) for what in TABLES)


def main(folder: Path, seeds: int, tasks: int, ways: list[str]) -> None:
    of = plan(campaign(seeds))
    rows = []
    for way in ways:
        base = (folder / way).resolve()
        base.mkdir(parents=True)
        write_campaign(of.campaign, base)
        began = time.time()
        spent, kills = WAYS[way](base, tasks)
        wall = time.time() - began
        stored = [
            name for file in base.glob("results/*.parquet") for name in pd.read_parquet(file, columns=["name"])["name"]
        ]
        cases = base_table(of, base)
        assert len(cases) == len(of.cases) and (cases["status"] == "OK").all(), f"{way}: cases are missing or failed"
        own = float(cases[["wind_seconds", "simulation_seconds", "reduction_seconds"]].to_numpy().sum())
        words = ", ".join(f"{n} {means}" for means, n in kills.items()) or "-"
        rows.append([way, f"{wall / 60.0:.1f}", f"{spent / 60.0:.1f}", f"{1e3 * (spent - own) / len(cases):.0f}", words,
                     str(len(cases)), str(len(stored) - len(cases))])  # fmt: skip
        print(*rows[-1], sep=" | ", flush=True)
        for one, other in zip(tables(of, folder / ways[0]), tables(of, base), strict=True):
            pd.testing.assert_frame_equal(one, other, check_exact=True)
    text = "\n".join(markdown_table(HEAD, rows))
    (folder / "proof.md").write_text(f"{text}\n", "utf-8")
    print(f"{text}\n{len(of.cases)} cases: the same tables to the bit; meltemi {meltemi.__version__}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--seeds", type=int, default=257)
    parser.add_argument("--tasks", type=int, default=64)
    parser.add_argument("--only", default="threads,slurm,dask")
    given = parser.parse_args()
    main(given.folder, given.seeds, given.tasks, given.only.split(","))
