"""``meltemi bench``: compile time, run time and memory, part by part.

New processes measure import, compilation into an empty cache and start from a filled one.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from typing import Any

from meltemi.compiler import Kind, processor, statistics, versions
from meltemi.core.errors import InputError, MeltemiError
from meltemi.simulation.case import Case
from meltemi.simulation.options import ModelOptions
from meltemi.simulation.rotors import build
from meltemi.simulation.run import Run
from meltemi.simulation.simulate import Simulation, march, simulate
from meltemi.simulation.trim import operating_point
from meltemi.turbine.library import load_turbine
from meltemi.turbulence.field import generate_field
from meltemi.wind.fields import SteadyWind
from meltemi.wind.turbulent import TurbulentWind

CHANNELS = (
    "time wind_x azimuth rotor_speed generator_torque generator_power pitch_1 rotor_aero_thrust rotor_torque "
    "root_moment_out_of_plane_1 root_moment_out_of_plane_2 root_moment_out_of_plane_3 root_moment_in_plane_1 "
    "root_moment_in_plane_2 root_moment_in_plane_3 tip_out_of_plane_1 tip_in_plane_1 tower_top_fore_aft "
    "tower_top_side_side tower_base_moment_fore_aft tower_base_moment_side_side yaw_moment_x yaw_moment_y yaw_moment_z "
    "shaft_tilt_moment generator_speed"
).split()
"""25 channels beside the time."""
BATCH_CASES = 3
"""Cases per core in the timed batch."""
REPEATS = 3
"""Timed runs of each kind, of which the fastest counts: what else runs on a machine only adds time."""
VARIANTS: dict[str, dict[str, Any]] = {
    "one torsion mode a blade": {},
    "second-order blades": {"blade_model": "modal"},
    "torsion locked": {"locked": ("torsion",)},
    "no torsion modes": {"torsion_modes": 0},
    "static polars, quasi-steady wake": {"stall": "static", "inflow": "quasi_steady"},
    "40 nodes a blade": {"blade_nodes": 40},
}
"""Options of the timed runs."""


def benchmark(*, duration: float = 600.0, say: Callable[[str], None] = lambda text: None) -> dict[str, Any]:
    """Measure on this machine: on one core, and a batch on all.

    Args:
      duration: [s] duration of the timed runs.
      say: callback with the current activity.

    Raises:
      InputError: ``duration`` is not positive.

    Returns:
      ``machine`` (processor, versions, date), ``import_s``, ``stages`` (compilation: seconds and signatures by stage),
      ``cold_compile_s``, ``signatures``, ``cached_start_s``, ``runs`` (microseconds a step, real-time factor and step
      of each variant), ``peak_memory_mb`` (the wind field not counted), ``cores``, ``batch_cases``,
      ``batch_real_time_factor``, ``batch_loss`` (share lost against cores times one core), ``batch_peak_memory_mb``
      (all counted), ``case``.
    """
    if not 0.0 < duration < float("inf"):
        raise InputError(f"bench: duration must be a positive number of seconds, found {duration!r}")
    say("import ...")
    importing, empty = zip(*((_seconds("import meltemi"), _seconds("pass")) for _ in range(5)), strict=True)
    import_s = min(importing) - min(empty)
    with tempfile.TemporaryDirectory(prefix="meltemi-bench-") as folder:
        say("compilation into an empty cache ...")
        stages = child(f"stages({2.0!r})", folder)
        say("start from the cache ...")
        cached_start_s = min(
            _seconds("from meltemi.verification.bench import stages; stages(2.0)", folder) for _ in range(2)
        )
        say(f"runs of {duration:g} s ...")
        runs = child(f"timed_runs({duration!r})", folder)
        say(f"a batch of runs of {duration:g} s on all cores ...")
        batch = child(f"timed_batch({duration!r})", folder)
    return {
        "machine": machine(),
        "import_s": round(import_s, 3),
        "stages": stages,
        "cold_compile_s": round(sum(seconds for seconds, _ in stages.values()), 1),
        "signatures": sum(count for _, count in stages.values()),
        "cached_start_s": round(cached_start_s, 2),
        **runs,
        **batch,
        "case": (
            "NREL 5 MW in turbulence (12 m/s), 2 flap + 1 edge + 1 torsion modes a blade, 4 tower modes, drivetrain "
            f"torsion, dynamic inflow and stall, 20 nodes a blade, {len(CHANNELS) - 1} channels at 20 Hz, baseline "
            "controller at every step"
        ),
    }


def machine() -> dict[str, str]:
    """Processor, versions and date."""
    import platform
    from datetime import UTC, datetime

    import numpy

    import meltemi

    return {
        "processor": processor(),
        "cores": str(os.cpu_count()),
        "system": f"{platform.system()} {platform.machine()}",
        "versions": (
            f"meltemi {meltemi.__version__}, Python {platform.python_version()}, Numba {versions()['numba']}, "
            f"llvmlite {versions()['llvmlite']}, NumPy {numpy.__version__}"
        ),
        "date": datetime.now(UTC).date().isoformat(),
    }


def _environment(folder: str | None) -> dict[str, str]:
    one = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
    return {**os.environ, **one, **({"MELTEMI_CACHE_DIR": folder} if folder else {})}


def _run(code: str, folder: str | None) -> str:
    """Output of a new process."""
    done = subprocess.run([sys.executable, "-c", code], env=_environment(folder), capture_output=True, text=True)
    if done.returncode:
        raise MeltemiError(f"bench: {done.stderr.strip().splitlines()[-1] if done.stderr else 'a process failed'}")
    return done.stdout


def _seconds(code: str, folder: str | None = None) -> float:
    """Time of a whole process."""
    began = time.perf_counter()
    _run(code, folder)
    return time.perf_counter() - began


def child(call: str, folder: str, module: str = __name__) -> dict[str, Any]:
    """Result of a call of a module, this one by default, in a new process."""
    result: dict[str, Any] = json.loads(_run(f"import json, {module} as b; print(json.dumps(b.{call}))", folder))
    return result


def peak_memory() -> float:
    """[bytes] peak resident memory of the process."""
    try:
        import resource
    except ImportError:  # Windows
        import psutil

        return float(psutil.Process().memory_info().peak_wset)
    kilobytes = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return float(kilobytes if sys.platform == "darwin" else 1024 * kilobytes)


def stages(duration: float) -> dict[str, tuple[float, int]]:
    """A first run in stages: seconds each takes, and the number of signatures it compiles."""
    durations: dict[str, tuple[float, int]] = {}
    model, wind = nrel5mw(), SteadyWind(speed=12.0)
    case = Case(model, wind)
    marks = [(time.perf_counter(), statistics()[0])]

    def mark(name: str) -> None:
        marks.append((time.perf_counter(), statistics()[0]))
        (t0, n0), (t1, n1) = marks[-2:]
        durations[name] = (round(t1 - t0, 2), n1 - n0)

    case.evaluate(0.0)
    mark("evaluation of the coupled machine")
    case.loads(0.0)
    mark("section loads")
    start = operating_point(model, wind)
    mark("operating point")
    simulate(model, wind, duration=duration, start=start, channels=CHANNELS)
    mark("controller and time loop")
    turbulence(duration)
    mark("turbulence")
    return durations


def nrel5mw(**options: Any) -> Any:
    """The model of the timed runs."""
    return build(load_turbine("nrel5mw"), ModelOptions(**options))


def turbulence(duration: float, **settings: Any) -> Any:
    """The wind of the timed runs."""
    return generate_field(TurbulentWind(speed=12.0, intensity=0.14, **settings), load_turbine("nrel5mw"), duration)


def timed(
    model: Any,
    wind: Any,
    duration: float,
    *,
    numbers: Kind = "lanes",
    prepare: Callable[[Case], None] | None = None,
    **arguments: Any,
) -> dict[str, float]:
    """Time step of the fastest of several runs."""
    best = float("inf")
    for _ in range(REPEATS):
        described = Run(model, wind, duration=duration, channels=CHANNELS, **arguments)
        run = Simulation(described, numbers=numbers, prepare=prepare)
        march(run)
        run.result().raise_for_status()
        best = min(best, run.run_seconds)
    return {
        "us_per_step": round(1e6 * best * run.dt / duration, 2),
        "real_time_factor": round(duration / best),
        "time_step_s": run.dt,
    }


def timed_runs(duration: float) -> dict[str, Any]:
    """Time a step of each variant, and peak memory of the first."""
    wind = turbulence(duration)
    runs: dict[str, dict[str, float]] = {}
    for name, options in VARIANTS.items():
        runs[name] = timed(nrel5mw(**options), wind, duration)
        if len(runs) == 1:
            peak = round((peak_memory() - wind.velocity.nbytes) / 1e6)
    return {"runs": runs, "peak_memory_mb": peak}


def timed_batch(duration: float) -> dict[str, Any]:
    """Time a batch on all cores and on one core, generation of winds and preparation of cases included."""
    from meltemi.core.threads import available_cores
    from meltemi.loadcases.batch import simulate_batch
    from meltemi.tuning.run_store import completed

    model = nrel5mw()

    def cases(seeds: range) -> list[Run]:
        winds = [TurbulentWind(speed=12.0, intensity=0.14, seed=seed) for seed in seeds]
        return [Run(model, wind, duration=duration, channels=CHANNELS) for wind in winds]

    def factor(some: list[Run], workers: int) -> float:
        began = time.perf_counter()
        outcomes = simulate_batch(some, workers=workers, reduce=lambda result: result.raise_for_status().status)
        seconds = time.perf_counter() - began
        completed(outcomes)
        return len(some) * duration / seconds

    simulate(model, SteadyWind(speed=12.0), duration=1.0, channels=CHANNELS)
    cores = available_cores()
    one = factor(cases(range(BATCH_CASES)), 1)
    together = factor(cases(range(BATCH_CASES, BATCH_CASES * (cores + 1))), cores)
    return {
        "cores": cores,
        "batch_cases": BATCH_CASES * cores,
        "batch_real_time_factor": round(together, 1),
        "batch_loss": round(1.0 - together / (cores * one), 3),
        "batch_peak_memory_mb": round(peak_memory() / 1e6),
    }


def report_lines(f: dict[str, Any]) -> list[str]:
    """The figures of :func:`benchmark` for the terminal."""
    m = f["machine"]

    def line(name: str, value: float, unit: str, note: str = "", digits: int = 1) -> str:
        return f"{name:52s} {value:9.{digits}f} {unit:3s} {note}".rstrip()

    lines = [f["case"], f"{m['processor']}, {m['cores']} cores, {m['system']}; {m['versions']}; {m['date']}"]
    lines += [line("import meltemi", f["import_s"], "s", digits=3)]
    lines += [line("cold compilation", f["cold_compile_s"], "s", f"{f['signatures']} signatures")]
    lines += [line(f"  {name}", seconds, "s", f"{n} signatures") for name, (seconds, n) in f["stages"].items()]
    lines += [line("start from the cache", f["cached_start_s"], "s", "a new process that simulates 2 s")]
    for name, run in f["runs"].items():
        note = f"{run['us_per_step']:.1f} us a step of {run['time_step_s']:g} s"
        lines.append(line(f"real-time factor, {name}", run["real_time_factor"], "", note, 0))
    lines.append(line("peak memory", f["peak_memory_mb"], "MB", "without the wind field", 0))
    batch = f"{f['batch_cases']} cases with their winds on {f['cores']} cores"
    lines.append(line("real-time factor of a batch", f["batch_real_time_factor"], "", batch, 0))
    lines.append(line("lost by the batch", 100.0 * f["batch_loss"], "%", "against cores times one core"))
    lines.append(line("peak memory of the batch", f["batch_peak_memory_mb"], "MB", "with the winds", 0))
    return lines
