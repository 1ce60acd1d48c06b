"""Load bases: what is there counts once, nothing is lost, and every division gives the same bits."""

from __future__ import annotations

import errno
import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import psutil
import pytest

import meltemi
from meltemi.core.errors import InputError, Status
from meltemi.loadcases.batch import Batch
from meltemi.loads.loadbase import engine
from meltemi.loads.loadbase.campaign import Campaign, make_campaign, write_campaign
from meltemi.loads.loadbase.jobs import Job, Workshop, jobs_of
from meltemi.loads.loadbase.plan import Plan, plan
from meltemi.loads.loadbase.store import ResultStore
from meltemi.loads.loadbase.table import load_table
from meltemi.simulation.simulate import simulate
from meltemi.studies.preview import rotor_average

pytestmark = pytest.mark.slow

pytest.importorskip("pyarrow")

ROWS = ("1.2", "6.4")
"""Production, and idling without control."""


def campaign(rows: Sequence[str] = ROWS, **settings: Any) -> Campaign:
    """Cases of three seconds."""
    given: dict[str, Any] = {
        "rated_wind": 11.4,
        "quick": True,
        "duration": 2.0,
        "transient": 1.0,
        "turbulence": {"points": 5},
        "changes": {"without": sorted(load_table(4).rows.keys() - {*rows})},
    }
    return make_campaign("nrel5mw", "IB", **given | settings)


@pytest.fixture(scope="module")
def tiny() -> Plan:
    return plan(campaign())


@pytest.fixture(scope="module")
def whole(tiny: Plan, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The load base, run on two threads."""
    folder = tmp_path_factory.mktemp("whole")
    assert engine.run_base(tiny, folder, workers=2).done == len(tiny.cases) == 15
    return folder


@pytest.fixture
def small_groups(monkeypatch: pytest.MonkeyPatch) -> None:
    """A file for each pair of cases."""
    monkeypatch.setattr(engine, "GROUP", 6.0)
    monkeypatch.setattr(engine, "SHORTEST", 0.0)
    monkeypatch.setattr(engine, "FEWEST_GROUPS", 1)


def tables(of: Plan, folder: Path) -> dict[str, pd.DataFrame]:
    """All tables but times."""
    found = {what: engine.base_table(of, folder, what) for what in ("statistics", "extremes", "durations", "cycles")}
    return found | {"cases": engine.base_table(of, folder)[["status", "message", "simulated", "stops"]]}


def assert_same(of: Plan, one: Path, other: Path) -> None:
    a, b = tables(of, one), tables(of, other)
    for what in a:
        pd.testing.assert_frame_equal(a[what], b[what], check_exact=True)


def names_in(folder: Path) -> list[str]:
    return [name for path in folder.glob("results/*.parquet") for name in pd.read_parquet(path)["name"]]


@pytest.mark.long
def test_a_row_is_the_reduction_of_its_run(tiny: Plan, whole: Path) -> None:
    name = tiny.cases[4].name
    result = engine.show_case(tiny, name)
    part = result.evaluated
    assert engine.same_numbers(tiny, whole, name, result) is True
    shifted = replace(result, data=result.data * (1.0 + 1e-15))
    assert engine.same_numbers(tiny, whole, name, shifted) is False
    kept = engine.base_table(tiny, whole, "statistics").query("case == @name").set_index("channel")
    assert kept.at["generator_power", "mean"] == part["generator_power"].mean()
    assert kept.at["wind_x", "std"] == part["wind_x"].std()
    turned = np.cos(np.pi / 6) * part["tower_base_moment_side_side"] + 0.5 * part["tower_base_moment_fore_aft"]
    assert kept.at["tower_base_moment@30", "max"] == pytest.approx(turned.max(), rel=1e-12)
    extremes = engine.base_table(tiny, whole, "extremes").query("case == @name and interface == 'tower_base'")
    row = extremes.set_index("driver").loc["My max"]
    at = int(np.argmax(part["TwrBsMyt"]))
    assert (row["time"], row["My"], row["Fx"]) == (part.time[at], part["TwrBsMyt"][at], part["TwrBsFxt"][at])
    times = engine.base_table(tiny, whole, "durations").query("case == @name and load == 'rotor_torque'")
    assert times["time"].sum() == pytest.approx(len(part.time) * 0.05)
    assert times["revolutions"].sum() == pytest.approx(part["rotor_speed"].mean() * times["time"].sum() / 2 / np.pi)


def test_cases_begin_at_the_speed_that_the_rotor_meets_first() -> None:
    of = plan(campaign(("1.2",), quick=False, seeds=6))
    shop, jobs, starts = Workshop(), {job.name: job for job in jobs_of(of)}, {}
    for seed in range(1, 7):
        run = shop.run(jobs[f"dlc1.2-19-y0-s0{seed}"])
        box = run.wind()
        planes = (box.passing >= 0.0) & (box.passing < 2.0)
        met = float(rotor_average(box, 90.0, 63.0)[planes].mean())
        start = run.start()
        assert start.pitch == pytest.approx(meltemi.analysis.operating_point(run.model, met).pitch, abs=0.03)
        assert starts.setdefault(round(met), start) is start
    assert 1 < len(starts) < 6


def test_cycles_are_kept_for_fatigue_only_and_by_channel(whole: Path, tiny: Plan, tmp_path: Path) -> None:
    some = engine.base_table(tiny, whole, "cycles", ["tower_base_moment_fore_aft"])
    every = engine.base_table(tiny, whole, "cycles")
    assert some.equals(every[every["channel"] == "tower_base_moment_fore_aft"].reset_index(drop=True))
    assert set(some["case"]) == {case.name for case in tiny.cases}
    ultimate = plan(campaign(("1.3",)))
    one = replace(ultimate, cases=ultimate.cases[:1])
    engine.run_base(one, tmp_path, workers=1)
    assert engine.base_table(one, tmp_path, "cycles").empty
    assert len(engine.base_table(one, tmp_path, "statistics"))


@pytest.mark.long
@pytest.mark.usefixtures("small_groups")
def test_any_division_gives_the_same_bits(tiny: Plan, whole: Path, tmp_path: Path) -> None:
    for k in (3, 1, 2):
        engine.run_base(tiny, tmp_path, shard=(k, 3), workers=1)
    assert_same(tiny, whole, tmp_path)
    assert sorted(names_in(tmp_path)) == sorted(case.name for case in tiny.cases)
    with pytest.raises(InputError, match=r"shard: 4/3 must be k/N"):
        engine.run_base(tiny, tmp_path, shard=(4, 3))
    with pytest.raises(InputError, match="device 'cuda' and dask exclude each other"):
        engine.run_base(tiny, tmp_path, device="cuda", dask="local")
    with pytest.raises(InputError, match="device must be one of cpu, cuda, cuda-single, found 'gpu'"):
        engine.run_base(tiny, tmp_path, device="gpu")


def test_what_is_there_is_not_run_again(tiny: Plan, whole: Path) -> None:
    before = sorted(whole.glob("results/*"))
    engine.run_base(tiny, whole)
    assert sorted(whole.glob("results/*")) == before


@pytest.mark.long
@pytest.mark.usefixtures("small_groups")
def test_two_runs_in_one_folder(tiny: Plan, whole: Path, tmp_path: Path) -> None:
    with ThreadPoolExecutor(2) as pool:
        for done in [pool.submit(engine.run_base, tiny, tmp_path, workers=1) for _ in range(2)]:
            done.result()
    assert_same(tiny, whole, tmp_path)
    assert len(names_in(tmp_path)) < 2 * len(tiny.cases)  # they divided the work


def test_a_case_that_is_there_twice_counts_once(tiny: Plan, whole: Path, tmp_path: Path) -> None:
    for k in (1, 2):
        engine.run_base(tiny, tmp_path / str(k), shard=(k, 2), workers=1)
    engine.run_base(replace(tiny, cases=tiny.cases[:3]), tmp_path / "again", workers=1)
    (tmp_path / "all" / "results").mkdir(parents=True)
    for file in tmp_path.glob("*/results/*.parquet"):
        file.rename(tmp_path / "all" / "results" / file.name)
    assert len(names_in(tmp_path / "all")) == 18
    assert_same(tiny, whole, tmp_path / "all")


@pytest.mark.long
@pytest.mark.usefixtures("small_groups")
def test_a_full_disk_is_told_and_breaks_nothing(
    tiny: Plan, whole: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    calls = []

    def full(handle: int) -> None:
        calls.append(handle)
        if len(calls) > 3:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with monkeypatch.context() as patched:
        patched.setattr(os, "fsync", full)
        with pytest.raises(InputError, match=r"results/\w+\.parquet: cannot be written \(No space left on device\)"):
            engine.run_base(tiny, tmp_path, workers=1)
    assert not list(tmp_path.glob("results/.*"))
    kept = engine.base_status(tiny, tmp_path)
    assert 0 < kept.done < 15 and not kept.unreadable
    engine.run_base(tiny, tmp_path, workers=2)
    assert_same(tiny, whole, tmp_path)


@pytest.mark.usefixtures("small_groups")
@pytest.mark.parametrize("damage", ["cut", "byte"])
def test_a_damaged_file_counts_as_missing(tiny: Plan, tmp_path: Path, damage: str) -> None:
    few = replace(tiny, cases=tiny.cases[:4])
    engine.run_base(few, tmp_path, workers=1)
    file = next(tmp_path.glob("results/*.parquet"))
    data = bytearray(file.read_bytes())
    data[len(data) // 3] ^= 1
    file.write_bytes(data if damage == "byte" else data[: len(data) // 2])
    found = engine.base_status(few, tmp_path)
    assert found.done < 4 and list(found.unreadable) == [file]
    assert engine.run_base(few, tmp_path, workers=1).done == 4


def test_an_abandoned_file_goes(tiny: Plan, tmp_path: Path) -> None:
    (tmp_path / "results").mkdir()
    old, new = tmp_path / "results" / ".old.part", tmp_path / "results" / ".new.part"
    for path in (old, new):
        path.touch()
    os.utime(old, (0.0, 0.0))
    engine.run_base(replace(tiny, cases=()), tmp_path)
    assert (old.exists(), new.exists()) == (False, True)


def keys(of: Campaign) -> dict[str, str]:
    return {job.name: job.key for job in jobs_of(plan(of))}


def changed(before: dict[str, str], after: dict[str, str]) -> set[str]:
    """Rows with another key."""
    assert before.keys() == after.keys()
    return {name.split("-")[0] for name in before if before[name] != after[name]}


def test_a_change_reruns_what_it_changes(tmp_path: Path, library: Path) -> None:
    before = keys(campaign())
    assert changed(before, keys(campaign())) == set()
    controller = {"kind": "supervised", "supervision": {"start_time": 9.0}}
    assert changed(before, keys(campaign(controller=controller))) == {"dlc1.2"}
    assert changed(before, keys(campaign(idle_pitch=1.4))) == {"dlc6.4"}
    assert changed(before, keys(campaign(environment={"air_density": 1.2}))) == {"dlc1.2", "dlc6.4"}
    more = keys(campaign(changes={"without": sorted(load_table(4).rows.keys() - {*ROWS, "3.1"})}))
    assert before.items() < more.items() and {n.split("-")[0] for n in more.keys() - before.keys()} == {"dlc3.1"}
    order, table = tmp_path / "x.in", tmp_path / "table.txt"
    order.write_text('"table.txt"')
    table.write_text("1")
    foreign = {"kind": "bladed", "library": str(library), "input": str(order)}
    first = keys(campaign(controller=foreign))
    assert changed(before, first) == {"dlc1.2"}
    table.write_text("2")
    assert changed(first, keys(campaign(controller=foreign))) == {"dlc1.2"}


@pytest.mark.long
def test_gains_do_not_change_what_is_not_controlled(tmp_path: Path) -> None:
    """Neither the key nor the bits."""
    turbine = meltemi.load_turbine("nrel5mw")
    found = []
    for gain in (1.0, 1.3):
        path = tmp_path / f"{gain}.yaml"
        other = turbine.replace(**{"control.pitch.proportional_gain": gain * turbine.control.pitch.proportional_gain})
        meltemi.io.write_turbine(other, path)
        jobs = {job.name: job for job in jobs_of(plan(campaign().replace(turbine=str(path))))}
        found.append(jobs)
    assert changed(*({name: job.key for name, job in jobs.items()} for jobs in found)) == {"dlc1.2"}
    name = next(name for name in found[0] if name.startswith("dlc6.4"))
    one, other_ = (simulate_job(jobs[name]) for jobs in found)
    np.testing.assert_array_equal(one.data, other_.data)


def simulate_job(job: Job) -> Any:
    run = Workshop().run(job)
    return simulate(run.model, run.wind(), **{k: v for k, v in vars(run).items() if k not in ("model", "wind")})


def test_a_case_that_fails_is_one_row(
    tiny: Plan, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, library: Path
) -> None:
    """It cannot be prepared, its controller hangs, it diverges; or its run is fine."""
    order = tmp_path / "hang.in"
    order.write_text("hang 0.4")
    foreign = {"kind": "bladed", "library": str(library), "input": str(order), "timeout": 0.3}
    hanging = campaign(("1.2",), controller=foreign)
    cases = [plan(hanging).cases[0], tiny.cases[1], tiny.cases[4], tiny.cases[2]]
    mixed = replace(tiny, cases=tuple(cases))
    make = Workshop.run

    def run(self: Workshop, job: Job) -> Any:
        if job.name == cases[1].name:
            raise ZeroDivisionError("of the turbine")
        found = make(self, job)
        if job.name == cases[2].name:
            wild = meltemi.build(found.model.turbine, meltemi.ModelOptions(time_step=0.1))
            return replace(found, model=wild, output_step=0.1, start=meltemi.Start(rotor_speed=1.2))
        return found

    monkeypatch.setattr(Workshop, "run", run)
    found = engine.run_base(mixed, tmp_path, workers=1)
    assert (found.done, found.failed) == (4, 3)
    told = engine.base_table(mixed, tmp_path)
    assert list(told["status"]) == ["CONTROLLER_RAISED", "FAILED", "DIVERGED", "OK"]
    assert "did not come back from a call" in found.problems[cases[0].name]
    assert found.problems[cases[1].name] == "FAILED: ZeroDivisionError: of the turbine"
    assert set(engine.base_table(mixed, tmp_path, "statistics")["case"]) == {cases[3].name}
    assert len(engine.base_table(mixed, tmp_path)) == 4
    monkeypatch.setattr(Workshop, "run", make)
    assert engine.run_base(mixed, tmp_path, workers=1).failed == 3  # they are there
    assert engine.run_base(mixed, tmp_path, workers=1, retry=True).failed == 1
    assert ResultStore(tmp_path).places[jobs_of(mixed)[1].key].status is Status.OK


def test_progress_rises_to_the_end(tiny: Plan, tmp_path: Path) -> None:
    told: list[engine.Progress] = []
    engine.run_base(replace(tiny, cases=tiny.cases[:3]), tmp_path, workers=1, progress=told.append)
    assert [p.share for p in told] == sorted(p.share for p in told)
    assert (told[-1].done, told[-1].total, told[-1].share, told[-1].seconds_left) == (3, 3, 1.0, 0.0)


def test_bad_input_is_told_before_anything_runs(tiny: Plan, whole: Path, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"none\.so: no such file"):
        campaign(controller={"kind": "bladed", "library": str(tmp_path / "none.so")})
    with pytest.raises(InputError, match=r"no table 'extreme': did you mean 'extremes'"):
        engine.base_table(tiny, whole, "extreme")
    with pytest.raises(InputError, match="no case 'dlc1'"):
        engine.show_case(tiny, "dlc1")


def test_a_worker_with_other_files_is_refused(tiny: Plan) -> None:
    job = jobs_of(tiny)[0]
    with pytest.raises(InputError, match="this process has another version"):
        engine.compute([replace(job, key="0")])


CHILD = """
import sys
from meltemi.loads.loadbase import engine
from meltemi.loads.loadbase.campaign import read_campaign
from meltemi.loads.loadbase.plan import plan
engine.GROUP, engine.SHORTEST, engine.FEWEST_GROUPS = 6.0, 0.0, 1
if __name__ == "__main__":
    planned = plan(read_campaign(sys.argv[1]))
    print("begun", flush=True)
    engine.run_base(planned, sys.argv[1], workers=1, dask=sys.argv[2] if len(sys.argv) > 2 else None)
"""


@pytest.mark.long
def test_nothing_is_lost_by_kills_at_random_moments(tiny: Plan, whole: Path, tmp_path: Path) -> None:
    """Twenty kills, up to twice the time that the first result takes; then two processes are let finish."""
    write_campaign(tiny.campaign, tmp_path)
    chance, done, rose, first = random.Random(7), 0, 0, 0.0
    for i in range(20):
        child = subprocess.Popen([sys.executable, "-c", CHILD, str(tmp_path)], stdout=subprocess.PIPE)
        assert child.stdout is not None
        child.stdout.readline()
        process = psutil.Process(child.pid)
        begun, used = sum(process.cpu_times()[:2]), 0.0  # of its own time: others may be busy
        share = chance.uniform(0.1, 2.0)
        while child.poll() is None and (used < share * first if i else not [*tmp_path.glob("results/*.parquet")]):
            time.sleep(0.01)
            used = sum(process.cpu_times()[:2]) - begun
        first = first or used
        child.kill()
        child.wait()
        child.stdout.close()
        found = engine.base_status(tiny, tmp_path)
        assert found.done >= done and not found.unreadable
        rose += found.done > done
        done = found.done
        if done == 15:  # begin again
            for file in tmp_path.glob("results/*.parquet"):
                file.unlink()
            done = 0
    assert rose > 3
    both = [subprocess.Popen([sys.executable, "-c", CHILD, str(tmp_path)]) for _ in range(2)]
    assert [child.wait() for child in both] == [0, 0]
    assert_same(tiny, whole, tmp_path)


@pytest.mark.long
def test_two_worker_processes_of_which_one_is_killed(tiny: Plan, whole: Path, tmp_path: Path) -> None:
    pytest.importorskip("distributed")
    script = tmp_path / "child.py"
    script.write_text(CHILD)
    write_campaign(tiny.campaign, tmp_path)
    child = subprocess.Popen([sys.executable, str(script), str(tmp_path), "local"], stderr=subprocess.DEVNULL)
    while child.poll() is None and not list(tmp_path.glob("results/*.parquet")):
        time.sleep(0.05)
    workers = [p for p in psutil.Process(child.pid).children(recursive=True) if "spawn_main" in " ".join(p.cmdline())]
    workers[-1].send_signal(signal.SIGKILL)
    assert child.poll() is None and engine.base_status(tiny, tmp_path).done < 15
    assert child.wait(timeout=120.0) == 0
    assert_same(tiny, whole, tmp_path)


def test_ctrl_c_keeps_what_is_finished(tiny: Plan, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    make, n = Workshop.run, [0]

    def run(self: Workshop, job: Job) -> Any:
        n[0] += 1
        if n[0] == 4:
            batch[0]._heard(None)
        return make(self, job)

    batch: list[Batch] = []
    begin = Batch.__post_init__

    def noticed(self: Batch) -> None:
        begin(self)
        batch.append(self)

    monkeypatch.setattr(Batch, "__post_init__", noticed)
    monkeypatch.setattr(Workshop, "run", run)
    with pytest.raises(KeyboardInterrupt):
        engine.run_base(tiny, tmp_path, workers=1)
    assert 3 <= engine.base_status(tiny, tmp_path).done < 15
