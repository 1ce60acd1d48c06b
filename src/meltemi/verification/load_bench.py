"""``meltemi bench --loads``: time of a sample of a load base by its parts, and the time of the whole."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from meltemi.core.threads import available_cores
from meltemi.loads.loadbase.campaign import make_campaign
from meltemi.loads.loadbase.engine import base_status, base_table, run_base
from meltemi.loads.loadbase.plan import plan
from meltemi.verification.bench import peak_memory

PARTS = {"wind": "wind_seconds", "simulation": "simulation_seconds", "reduction": "reduction_seconds"}


def load_benchmark(*, cases: int = 40, say: Callable[[str], None] = lambda text: None) -> dict[str, Any]:
    """Run a sample of the load base of the NREL 5 MW, class IB, edition 4, on all cores.

    Args:
      cases: number of cases of the sample: every n-th case that can run.
      say: callback with the current activity.

    Returns:
      ``cases``, ``hours`` (simulated, of the sample), ``cores``, ``wall_s``, ``cpu_s`` (of the process), ``parts``
      (shares of wind, simulation, reduction and the rest in it), ``times`` (simulated time over processor time),
      ``megabytes`` (of files), ``peak_memory_mb``, ``plan_s``, ``status_s``; ``all_cases``, ``all_hours``, and of the
      whole base ``all_minutes`` on these cores, by processor time.
    """
    whole = plan(make_campaign("nrel5mw", "IB"))
    began = time.perf_counter()
    plan(whole.campaign)
    plan_s = time.perf_counter() - began
    able = [case for case in whole.cases if not case.unsupported]
    sample = replace(whole, cases=tuple(able[:: max(len(able) // cases, 1)]))
    with tempfile.TemporaryDirectory(prefix="meltemi-bench-") as folder:
        say("compiled kernels ...")
        run_base(replace(sample, cases=sample.cases[:1]), Path(folder, "warm"))
        say(f"{len(sample.cases)} cases ...")
        wall, cpu = time.perf_counter(), time.process_time()
        run_base(sample, folder)
        wall, cpu = time.perf_counter() - wall, time.process_time() - cpu
        began = time.perf_counter()
        base_status(whole, folder)
        status_s = time.perf_counter() - began
        table = base_table(sample, folder)
        size = sum(file.stat().st_size for file in Path(folder).glob("results/*"))
    parts = {name: float(table[column].sum()) / cpu for name, column in PARTS.items()}
    simulated, cores = float(table["simulated"].sum()), available_cores()
    return {
        "cases": len(table),
        "hours": simulated / 3600.0,
        "cores": cores,
        "wall_s": wall,
        "cpu_s": cpu,
        "parts": parts | {"storage and engine": 1.0 - sum(parts.values())},
        "times": simulated / cpu,
        "megabytes": size / 1e6,
        "peak_memory_mb": peak_memory() / 1e6,
        "plan_s": plan_s,
        "status_s": status_s,
        "all_cases": len(able),
        "all_hours": whole.hours,
        "all_minutes": whole.hours * 60.0 / (simulated / cpu) / cores,
    }


def load_lines(f: dict[str, Any]) -> list[str]:
    """The figures of :func:`load_benchmark` as lines."""
    shares = ", ".join(f"{name} {100.0 * share:.1f} %" for name, share in f["parts"].items())
    return [
        f"{f['cases']} cases, {f['hours']:.1f} h simulated, in {f['wall_s']:.0f} s on {f['cores']} cores",
        f"{f['cpu_s']:.0f} s of processor time: {f['times']:.0f} times real time a core; {shares}",
        f"{f['megabytes']:.0f} MB of results, peak memory {f['peak_memory_mb']:.0f} MB",
        f"plan of the whole base {f['plan_s']:.2f} s, status {f['status_s']:.2f} s",
        f"{f['all_cases']} cases, {f['all_hours']:.0f} h: {f['all_minutes']:.1f} min on {f['cores']} free cores",
    ]
