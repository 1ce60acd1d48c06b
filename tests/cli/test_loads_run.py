"""``meltemi loads run``, ``status`` and ``show``."""

from __future__ import annotations

import os
import signal
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from terminal import Command

from meltemi.loads.loadbase.campaign import make_campaign, read_campaign, write_campaign
from meltemi.loads.loadbase.coverage import problems_of, read_results
from meltemi.loads.loadbase.jobs import Workshop
from meltemi.loads.loadbase.plan import plan
from meltemi.loads.loadbase.table import load_table
from meltemi.postprocess.files import read_netcdf

pytestmark = pytest.mark.slow

pytest.importorskip("pyarrow")


@pytest.fixture(scope="module")
def base(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Nine cases of three seconds, and four that cannot run under a controller that cannot start the turbine."""
    return small_base(tmp_path_factory.mktemp("base"))


def small_base(folder: Path) -> Path:
    """The campaign of that base."""
    only = {"without": sorted(load_table(4).rows.keys() - {"1.2", "3.2"})}
    times = {"quick": True, "duration": 2.0, "transient": 1.0, "rated_wind": 11.4, "turbulence": {"points": 5}}
    write_campaign(make_campaign("nrel5mw", "IB", controller={"kind": "power"}, changes=only, **times), folder)
    return folder


def test_shards_make_the_base_and_a_case_is_shown(command: Command, base: Path) -> None:
    before = command("loads", "status", base)
    assert before.status == 0 and "0 of 9 cases done" in before.out
    half = command("loads", "run", base, "--shard", "1/2", "--workers", 1)
    assert half.status == 0 and "5 of 9 cases done" in half.out
    missing = command("loads", "show", base, "dlc1.2-11.4-y8-s01", "--out", base / "other")
    assert missing.status == 0 and ("not in the load base" in missing.out or "in all digits" in missing.out)
    ran = command("loads", "run", base)
    assert ran.status == 0 and "9 of 9 cases done, 0.0 h to be simulated" in ran.out
    shown = command("loads", "show", base, "dlc1.2-11.4-y8-s01", "--plot")
    assert shown.status == 0 and "equal to the load base in all digits" in shown.out
    series, plot = shown.files
    assert series == base / "cases" / "dlc1.2-11.4-y8-s01.nc" and plot.stat().st_size > 10_000
    assert np.all(np.isfinite(read_netcdf(series)["tower_station_1_moment_y"]))


def test_after_a_partial_report_a_case_that_ran_is_next(
    command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It was the first case of the plan, whether or not it was there."""
    planned = plan(read_campaign(small_base(tmp_path)))
    names = [case.name for case in planned.cases]
    missing = problems_of(read_results(planned, tmp_path))
    found = SimpleNamespace(problems=missing)
    monkeypatch.setattr("meltemi.loads.design_loads", lambda *_: found)
    monkeypatch.setattr("meltemi.loads.write_report", lambda *_, **__: [])
    assert f"meltemi loads run {tmp_path}\n" in command("loads", "report", tmp_path).out
    missing.loc[names[1], "state"], missing.loc[names[2], "state"] = "failed", "doubtful"
    assert f"meltemi loads show {tmp_path} {names[2]} --plot" in command("loads", "report", tmp_path).out


def test_damage_and_old_results_are_told(command: Command, base: Path) -> None:
    command("loads", "run", base)
    campaign, file = base / "campaign.yaml", next(base.glob("results/*.parquet"))
    text, data = campaign.read_text(), file.read_bytes()
    file.write_bytes(data[:100])
    told = command("loads", "status", base)
    assert f"{file} counts as missing: damaged" in told.err and "9 of 9" not in told.out
    file.write_bytes(data)
    campaign.write_text(text.replace("duration: 2.0", "duration: 2.5"))
    told = command("loads", "status", base)
    assert "9 results of other inputs, such as an earlier controller, are not used" in told.err
    assert "0 of 9 cases done" in told.out
    campaign.write_text(text)
    assert "9 of 9" in command("loads", "status", base).out


def test_report_and_comparison_are_written(command: Command, base: Path) -> None:
    command("loads", "run", base)
    told = command("loads", "report", base, "--against", base)
    assert told.status == 0 and told.files[0] == base / "report.html"
    assert base / "tables" / "design_loads.xlsx" in told.files and all(file.stat().st_size for file in told.files)
    text = told.files[0].read_text(encoding="utf-8")
    assert "0 utilisations above 1" in text and "dlc1.2-11.4-y8-s01" in text
    compared = command("loads", "compare", base, base, "--out", base / "both")
    assert compared.status == 0 and compared.files == [base / "both" / "report.html", base / "both" / "comparison.csv"]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("run", "{base}", "--shard", "3"), "--shard '3': expected k/N with k from 1 to N, for instance 3/16"),
        (("run", "{base}", "--shard", "3/2"), "--shard '3/2': expected k/N"),
        (("run", "{base}", "--workers", "0"), "--workers 0: expected 1 to 1000"),
        (("run", "nowhere"), "nowhere"),
        (("report", "{base}", "--limits", "nowhere.yaml"), "nowhere.yaml: no such file"),
        (("status", "nowhere"), "nowhere: no load base, since it has no campaign.yaml"),
        (("report", "{base}", "--limits", "nowhere.yaml", "--against", "{base}"), "give either --against or --limits"),
        (("compare", "{base}", "nowhere"), "nowhere"),
        (("show", "{base}", "dlc9"), "no case 'dlc9' in the plan"),
        (("show", "{base}", "dlc3.2-3-t-1"), "dlc3.2"),
    ],
)
def test_wrong_input_is_told(command: Command, base: Path, arguments: tuple[str, ...], words: str) -> None:
    ran = command("loads", *(text.format(base=base) for text in arguments))
    assert ran.status != 0 and words in ran.err and "Traceback" not in ran.err


def test_a_run_that_is_told_to_end_says_what_is_missing(
    command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    make, begun = Workshop.run, list[str]()

    def run(self: Workshop, job: Any) -> Any:
        begun.append(job.name)
        if len(begun) == 4:
            os.kill(os.getpid(), signal.SIGTERM)
        return make(self, job)

    monkeypatch.setattr(Workshop, "run", run)
    ended = command("loads", "run", small_base(tmp_path), "--workers", 1)
    assert ended.status == 130
    assert "of 9 cases are kept, 0.0 h are missing; the same command continues" in ended.err
    monkeypatch.undo()
    kept = command("loads", "status", tmp_path).out
    assert any(f"{n} of 9 cases done" in kept for n in range(2, 9))


def test_jobs_are_sized_by_the_plan(command: Command, base: Path, tmp_path: Path) -> None:
    ours = small_base(tmp_path)
    done = command("loads", "submit", ours, "--slurm", "--tasks", 3, "--cores", 2)
    assert done.status == 0 and "3 tasks of 2 cores" in done.out and "estimate from short runs" in done.out
    expected = done.files[1].read_text().split("--expect ")[1].split()[0]
    assert command("loads", "run", ours, "--shard", "1/9", "--expect", expected).status == 0
    campaign = ours / "campaign.yaml"
    campaign.write_text(campaign.read_text().replace("duration: 2.0", "duration: 2.5"))
    refused = command("loads", "run", ours, "--expect", expected)
    assert refused.status == 2 and "not the plan that was submitted" in refused.err
    for scheduler in ((), ("--slurm", "--pbs")):
        refused = command("loads", "submit", ours, *scheduler)
        assert refused.status == 2 and "give one of --slurm, --pbs and --array" in refused.err
    command("loads", "run", base)
    refused = command("loads", "submit", base, "--array")
    assert refused.status == 2 and "all cases have results" in refused.err


def test_machine_code_of_a_base_is_compiled_without_results(command: Command, tmp_path: Path) -> None:
    done = command("loads", "warmup", small_base(tmp_path))
    assert done.status == 0 and "machine code is in" in done.out and not (tmp_path / "results").exists()
