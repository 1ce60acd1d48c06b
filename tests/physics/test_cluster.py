"""Batches and studies on a Dask cluster or in shards: the bits of threads, and one sentence for what is wrong."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import meltemi
from meltemi import Run, SteadyWind, simulate_batch
from meltemi.analysis import Piece
from meltemi.cluster import dask
from meltemi.core.errors import InputError, Status
from meltemi.tuning.run_store import FOLDER, FailedResult, cells, run_store

pytest.importorskip("distributed")
pytestmark = [pytest.mark.slow, pytest.mark.filterwarnings("ignore::ResourceWarning")]
N = 5


def runs(n: int = N) -> list[Run]:
    model = meltemi.build(meltemi.load_turbine("pmsg20mw"))
    return [Run(model, SteadyWind(speed=6.0 + k), duration=2.0, name=f"{k}") for k in range(n)]


def power(result: Any) -> float:
    return float(result["generator_power"].mean())


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    """A cluster in this process."""
    from distributed import LocalCluster

    with LocalCluster(n_workers=1, threads_per_worker=2, processes=False, dashboard_address=":0") as cluster:
        yield cluster.scheduler_address


def test_a_cluster_gives_the_bits_of_threads(address: str) -> None:
    here, there = simulate_batch(runs(), workers=2), simulate_batch(runs(), dask=address)
    assert [o.name for o in here] == [o.name for o in there]
    for one, other in zip(here, there, strict=True):
        assert other.ok and np.array_equal(one.value.data, other.value.data)
    brief = simulate_batch(runs(2), dask=address, series=False)
    assert brief[0].value.equivalent_loads() == simulate_batch(runs(2), series=False)[0].value.equivalent_loads()


def test_shards_are_the_whole_and_keep_the_names() -> None:
    unnamed = [Run(run.model, run.wind, duration=0.5) for run in runs()]
    parts = [simulate_batch(unnamed, shard=(k, 3), reduce=power) for k in (1, 2, 3)]
    whole = {o.name: o.value for o in simulate_batch(unnamed, reduce=power)}
    assert [o.name for o in parts[1]] == ["case_0002", "case_0005"]
    assert {o.name: o.value for part in parts for o in part} == whole
    with pytest.raises(InputError, match="shard: 4/3 must be k/N with k from 1 to N"):
        simulate_batch(unnamed, shard=(4, 3))
    with pytest.raises(InputError, match="device 'cuda' and dask exclude each other"):
        simulate_batch(unnamed, device="cuda", dask="local")


def test_files_are_written_by_workers_and_used_again(address: str, tmp_path: Path) -> None:
    first = simulate_batch(runs(2), dask=address, out=tmp_path)
    again = simulate_batch(runs(2), dask=address, out=tmp_path, reduce=power)
    assert [o.value for o in first] == [tmp_path / "0.nc", tmp_path / "1.nc"]
    assert all(o.reused for o in again) and again[0].value == simulate_batch(runs(1), reduce=power)[0].value


def test_a_piece_is_any_function(address: str, tmp_path: Path) -> None:
    def half(x: float) -> float:
        if x < 0.0:
            raise InputError(f"no half of {x:g}")
        return 0.5 * x

    pieces = [Piece("one", partial(half, 4.0)), Piece("other", partial(half, -1.0))]
    for where in (None, address):
        good, bad = simulate_batch(pieces, dask=where, reduce=lambda x: x + 1.0)
        assert good.ok and good.value == 3.0
        assert bad.status is Status.FAILED and bad.message == "no half of -1"
    (refused,) = simulate_batch(pieces[:1], out=tmp_path)
    assert refused.message == "out: only runs have time series, which files contain"


def test_a_farm_is_a_piece(address: str) -> None:
    turbine = meltemi.load_turbine("pmsg20mw")
    farm = meltemi.Farm(meltemi.build(turbine), [(0.0, 0.0), (900.0, 0.0)])
    work = partial(meltemi.simulate_farm, farm, SteadyWind(speed=9.0), duration=2.0)
    (there,) = simulate_batch([Piece("farm", work, inputs="9 m/s")], dask=address)
    assert there.ok, there.message
    assert np.array_equal(there.value[1]["generator_power"], work()[1]["generator_power"])


def test_what_is_wrong_with_workers_is_one_sentence(
    address: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with pytest.raises(InputError, match=r"the worker on \S+ does not see \S+absent: give a folder that all share"):
        dask.on_worker(dask.VERSION, tmp_path / "absent", lambda: 1)
    with pytest.raises(InputError, match=r"has meltemi \S+, physics \d+, the process that sends work meltemi 0\.0"):
        dask.on_worker("meltemi 0.0", None, lambda: 1)
    here = dask.on_worker
    monkeypatch.setattr(dask, "on_worker", lambda version, *rest: here("meltemi 0.0", *rest))
    (outcome,) = simulate_batch(runs(1), dask=address)
    assert outcome.status is Status.FAILED and "the process that sends work" in outcome.message


def test_a_scheduler_that_is_not_there_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(dask, "CONNECTED", 0.5)
    with pytest.raises(InputError, match=r"dask tcp://127.0.0.1:9: no scheduler there"):
        simulate_batch(runs(1), dask="tcp://127.0.0.1:9")
    with pytest.raises(InputError, match="dask nowhere: no scheduler there"):
        simulate_batch(runs(1), dask="nowhere")


def test_a_full_disk_of_a_worker_is_told_by_its_case(
    address: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: Any) -> None:
        raise InputError("1.nc: cannot be written (No space left on device)")

    monkeypatch.setattr("meltemi.postprocess.result_folder.write_netcdf", full)
    outcomes = simulate_batch(runs(2), dask=address, out=tmp_path)
    assert {o.message for o in outcomes} == {"1.nc: cannot be written (No space left on device)"}


@pytest.mark.parametrize("where", ["shards", "dask"])
def test_a_study_is_divided(where: str, address: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Of two stages, the second of which needs the first."""

    def study(**how: Any) -> float:
        with run_store(tmp_path, "study", **how) as book:
            first = cells(runs(), reduce=power)
            further = [replace(run, name=f"{run.name} again") for run in runs()]
            second = cells(further, reduce=lambda result: power(result) / sum(first))
            read.append(book.reused)
        return float(sum(second))

    read: list[int] = []
    if where == "shards":
        for shard in ((1, 2), (2, 2)):
            with pytest.raises(SystemExit) as ended:
                study(shard=shard)
            assert ended.value.code == 0
        told = capsys.readouterr().err
        assert "runs of this stage belong to other shards" in told and "the same command continues" in told
        kept = len(list((tmp_path / FOLDER).iterdir()))
        assert N < kept < 2 * N
        assert study(shard=(1, 2)) == pytest.approx(1.0) and read == [kept]
    else:
        assert study(dask=address) == pytest.approx(1.0)
    assert not (tmp_path / FOLDER).exists()


def test_ctrl_c_ends_the_wait_for_workers(address: str, tmp_path: Path) -> None:
    """And the study keeps what was finished."""

    def slow() -> None:
        os.kill(os.getpid(), signal.SIGTERM)
        time.sleep(2.0)

    began = time.monotonic()
    pieces = [Piece("slow", slow), *(Piece(f"{k}", partial(time.sleep, 5.0)) for k in range(3))]
    with pytest.raises(KeyboardInterrupt), run_store(tmp_path, "study", dask=address):
        cells(pieces)
    assert time.monotonic() - began < 15.0


@pytest.mark.long
def test_workers_that_die_are_replaced_and_one_that_kills_them_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    from distributed import LocalCluster

    monkeypatch.setattr(dask, "TRIES", 1)

    def die() -> None:
        os.kill(os.getpid(), signal.SIGKILL)

    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=":0") as cluster:
        pieces = [*runs(), Piece("deadly", die)]
        *good, bad = simulate_batch(pieces, dask=cluster.scheduler_address, reduce=power)
    assert [o.value for o in good] == [o.value for o in simulate_batch(runs(), reduce=power)]
    assert bad.status is Status.FAILED and bad.message.startswith("workers died 1 times in it")


def test_a_failed_piece_is_a_failed_cell(tmp_path: Path) -> None:
    def bad() -> float:
        raise InputError("it cannot be")

    with run_store(tmp_path, "study") as book:
        (value,) = cells([Piece("bad", bad, inputs=1)])
        assert isinstance(value, FailedResult) and book.failed == {"bad": "it cannot be"}
        assert cells([Piece("good", lambda: 2.0, inputs=1)]) == [2.0] and book.waiting() == 1
