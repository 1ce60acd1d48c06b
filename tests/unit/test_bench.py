"""The benchmark's report and page: every figure that is measured is shown."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

from benchmarks import page, parts
from benchmarks.environments import LOADS, timed_environments
from benchmarks.steps import TURBINES, WAYS
from meltemi.learning.settings import MODELS
from meltemi.verification import bench
from meltemi.verification.load_bench import load_benchmark, load_lines

ROOT = Path(__file__).parents[2]
RUN = {"us_per_step": 12.3, "real_time_factor": 777, "time_step_s": 0.01}


def figures() -> dict[str, Any]:
    numbers = iter(range(101, 999))
    return {
        "machine": {**bench.machine(), "processor": "some processor"},
        "import_s": 0.0111,
        "stages": {f"stage {i}": (float(next(numbers)), next(numbers)) for i in range(5)},
        "cold_compile_s": 33.3,
        "signatures": next(numbers),
        "beyond": {f"something {i}": float(next(numbers)) for i in range(4)},
        "cached_start_s": 1.23,
        "runs": {
            name: {**RUN, "real_time_factor": next(numbers)}
            for name in (*bench.VARIANTS, parts.LOAD_CONTROL, *parts.FLOATERS)
        },
        "steps": {
            turbine: {way: {**RUN, "real_time_factor": next(numbers), "std": 0.00123, "load": 0.00456} for way in WAYS}
            for turbine in TURBINES
        },
        "floats": {**RUN, "us_per_step": 50.0},
        "derivatives": {**RUN, "us_per_step": 75.0},
        "gradient": {"run": 12.0, "by_controller": 54.0, "by_all": 60.0},
        "peak_memory_mb": next(numbers),
        "controllers": {
            "section loads at every step": 1.7,
            "compiled": 0.3,
            "empty, in plain Python": 0.4,
            "individual pitch in plain Python at 80 Hz, real-time factor": next(numbers),
            "step() from Python": 34.5,
            "step of an observer": next(numbers),
        },
        "environments": {
            name: {"time_step_s": 0.01, "per_second": 12345, "per_second_all": 23456, "reset_ms": 17.0}
            | dict.fromkeys(LOADS, 0.0123)
            for name in MODELS
        },
        "fields": {name: {"seconds": 0.25 + i, "peak_memory_mb": 400 + i} for i, name in enumerate(parts.FIELDS)},
        "cores": 64,
        "batch_cases": next(numbers),
        "batch_real_time_factor": next(numbers),
        "batch_loss": 0.0789,
        "batch_peak_memory_mb": next(numbers),
        "case": "some case",
    }


def test_the_page_shows_every_figure() -> None:
    f = figures()
    written = page.page(f)
    assert re.findall(r"\{[a-z_]*\}", written) == []
    shown = [*f["runs"], *f["stages"], *f["beyond"], "some case", "some processor", "1.50 times", "**33.3**"]
    shown += [str(run["real_time_factor"]) for run in f["runs"].values()]
    shown += [str(f[name]) for name in ("signatures", "peak_memory_mb", "batch_cases", "batch_real_time_factor")]
    shown += [f"**{run['real_time_factor']}** | 0.12 | 0.46 |" for ways in f["steps"].values() for run in ways.values()]
    shown += [name for name, _ in page.OPENFAST]
    shown += [f"| {name} | **{i}.25** | {400 + i} |" for i, name in enumerate(f["fields"])]
    shown += [f"| {name} | 10.0 | **12,345** | 23,456 | 17 | 1.2 | 1.2 |" for name in MODELS]
    for text in shown:
        assert text in written, text


def test_the_report_shows_the_same() -> None:
    f = figures()
    report = "\n".join(bench.report_lines(f))
    for text in (*f["runs"], *f["stages"], "7.9 %", "33.3 s", "some processor"):
        assert text in report, text


def test_the_page_of_the_documentation_is_the_one_that_is_written() -> None:
    """Remake it with `python -m benchmarks.page` after a change of its text or its rows."""
    written = (ROOT / "docs" / "performance.md").read_text(encoding="utf-8")
    template = page.TEMPLATE.read_text(encoding="utf-8")
    headings = [line for line in template.splitlines() if line.startswith("#")]
    assert [line for line in written.splitlines() if line.startswith("#")] == headings
    for name in (*bench.VARIANTS, parts.LOAD_CONTROL, *(name for name, _ in page.OPENFAST)):
        assert f"| {name} |" in written, name
    for turbine in TURBINES:
        assert written.count(f"| {turbine} |") == len(WAYS)


@pytest.mark.long
def test_environments_are_timed_and_their_models_compared() -> None:
    found = timed_environments(seeds=(2001, 2002))
    assert found["light"]["per_second"] > found["fast"]["per_second"] > found["full"]["per_second"] > 1000.0
    for load in LOADS:
        assert found["full"][load] == 0.0 and 0.0 < found["fast"][load] < 0.02 and found["light"][load] < 0.03


@pytest.mark.long
def test_runs_controllers_and_batches_are_measured() -> None:
    runs = bench.timed_runs(1.0)["runs"] | parts.timed_runs(1.0)
    assert set(runs) == {*bench.VARIANTS, parts.LOAD_CONTROL, *parts.FLOATERS}
    derivatives = parts.timed_derivatives(1.0)
    for run in (*runs.values(), derivatives["floats"], derivatives["derivatives"]):
        assert run["us_per_step"] > 0.0
    assert derivatives["floats"]["us_per_step"] > 2.0 * runs["one torsion mode a blade"]["us_per_step"]
    controllers = parts.timed_controllers(25.0)
    assert controllers["step() from Python"] > controllers["compiled"]
    assert bench.timed_batch(1.0)["batch_real_time_factor"] > 0


@pytest.mark.long
def test_a_sample_of_a_load_base_is_timed() -> None:
    pytest.importorskip("pyarrow")
    found = load_benchmark(cases=1)
    assert (found["cases"], found["all_cases"] > 1700, found["all_hours"] > 200.0) == (1, True, True)
    assert sum(found["parts"].values()) == pytest.approx(1.0)
    assert min(found["parts"].values()) > 0.0 and found["times"] > 50.0
    assert found["all_minutes"] == pytest.approx(60.0 * found["all_hours"] / found["times"] / found["cores"])
    assert load_lines(found)[0].startswith("1 cases, 0.2 h simulated, in ")
