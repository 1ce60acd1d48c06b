"""``meltemi bench``: what a run costs, each part apart.

Everything that start-up could hide is measured in new processes: import, compilation into an empty cache,
start from a filled one.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from functools import partial
from typing import Any

from meltemi.core.errors import InputError, MeltemiError

CHANNELS = (
    "time wind_x azimuth rotor_speed generator_torque generator_power pitch_1 rotor_aero_thrust rotor_torque "
    "root_moment_out_of_plane_1 root_moment_out_of_plane_2 root_moment_out_of_plane_3 root_moment_in_plane_1 "
    "root_moment_in_plane_2 root_moment_in_plane_3 tip_out_of_plane_1 tip_in_plane_1 tower_top_fore_aft "
    "tower_top_side_side tower_base_moment_fore_aft tower_base_moment_side_side yaw_moment_x yaw_moment_y yaw_moment_z "
    "shaft_tilt_moment generator_speed"
).split()
"""25 channels beside the time."""
STAGES = ("evaluation", "section loads", "trim", "controller", "time loop")

BATCH_CASES = 3
"""Cases a core in the timed batch."""


def benchmark(*, duration: float = 600.0, say: Callable[[str], None] = lambda text: None) -> dict[str, Any]:
    """Measure on this machine: on one core, and a batch on all.

    Args:
      duration: [s] of the timed run.
      say: called with what is going on.

    Raises:
      InputError: ``duration`` is not positive.

    Returns:
      ``import_s``, ``cold_compile_s`` with ``cold_compile_stages``, ``signatures``, ``cached_start_s``,
      ``us_per_step``, ``real_time_factor``, ``peak_memory_mb`` (the wind field not counted),
      ``cores``, ``batch_cases``, ``batch_real_time_factor``, ``batch_loss`` (share lost against cores times one core),
      ``batch_peak_memory_mb`` (all counted), ``case``.
    """
    if not 0.0 < duration < float("inf"):
        raise InputError(f"bench: duration must be a positive number of seconds, found {duration!r}")
    say("import ...")
    import_s = min(_seconds("import meltemi") - _seconds("pass") for _ in range(3))
    with tempfile.TemporaryDirectory(prefix="meltemi-bench-") as folder:
        say("compilation into an empty cache ...")
        cold = _child(f"stages({2.0!r})", folder)
        say("start from the cache ...")
        cached_start_s = min(
            _seconds("from meltemi.studies.bench import stages; stages(2.0)", folder) for _ in range(2)
        )
        say(f"a run of {duration:g} s ...")
        run = _child(f"timed_run({duration!r})", folder)
        say(f"a batch of runs of {duration:g} s on all cores ...")
        run |= _child(f"timed_batch({duration!r})", folder)
    case = (
        "NREL 5 MW in turbulence, 2 flap + 1 edge + 1 torsion modes a blade, 4 tower modes, drivetrain torsion, "
        f"dynamic inflow and stall, 20 nodes a blade, {len(CHANNELS) - 1} channels at 20 Hz, baseline controller"
    )
    return {
        "import_s": round(import_s, 3),
        "cold_compile_s": round(sum(cold["stages"].values()), 2),
        "cold_compile_stages": cold["stages"],
        "signatures": cold["signatures"],
        "cached_start_s": round(cached_start_s, 2),
        **run,
        "case": case,
    }


def _environment(folder: str | None) -> dict[str, str]:
    one = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
    return {**os.environ, **one, **({"MELTEMI_CACHE_DIR": folder} if folder else {})}


def _seconds(code: str, folder: str | None = None) -> float:
    """Time of a whole process."""
    began = time.perf_counter()
    done = subprocess.run([sys.executable, "-c", code], env=_environment(folder), capture_output=True, text=True)
    if done.returncode:
        raise MeltemiError(f"bench: {done.stderr.strip().splitlines()[-1] if done.stderr else 'a process failed'}")
    return time.perf_counter() - began


def _child(call: str, folder: str) -> dict[str, Any]:
    """Result of a call of this module in a new process."""
    code = f"import json, meltemi.studies.bench as b; print(json.dumps(b.{call}))"
    done = subprocess.run([sys.executable, "-c", code], env=_environment(folder), capture_output=True, text=True)
    if done.returncode:
        raise MeltemiError(f"bench: {done.stderr.strip().splitlines()[-1] if done.stderr else 'a process failed'}")
    result: dict[str, Any] = json.loads(done.stdout)
    return result


def stages(duration: float) -> dict[str, Any]:
    """A first run in stages: seconds each takes, and the number of compiled signatures."""
    from meltemi.control.baseline import baseline
    from meltemi.core.kernel import statistics
    from meltemi.simulation.case import Case
    from meltemi.simulation.model import build
    from meltemi.simulation.simulate import simulate
    from meltemi.simulation.trim import operating_point
    from meltemi.turbine.library import load_turbine
    from meltemi.wind.fields import SteadyWind

    seconds: dict[str, float] = {}
    marks = [time.perf_counter()]

    def mark(name: str) -> None:
        marks.append(time.perf_counter())
        seconds[name] = round(marks[-1] - marks[-2], 2)

    model, wind = build(load_turbine("nrel5mw")), SteadyWind(speed=12.0)
    case = Case(model, wind)
    marks[:] = [time.perf_counter()]
    case.evaluate(0.0)
    mark("evaluation")
    case.loads(0.0)
    mark("section loads")
    start = operating_point(model, wind)
    mark("trim")
    controller = baseline(model.turbine.control)
    mark("controller")
    simulate(model, wind, duration=duration, controller=controller, start=start, channels=CHANNELS)
    mark("time loop")
    return {"stages": seconds, "signatures": statistics()[0]}


def timed_run(duration: float) -> dict[str, Any]:
    """Time a step and peak memory of the benchmark case."""
    import psutil

    from meltemi.simulation.model import build
    from meltemi.simulation.simulate import simulate
    from meltemi.turbine.library import load_turbine
    from meltemi.wind.turbulence import turbulence

    model = build(load_turbine("nrel5mw"))
    turbine = model.turbine
    wind = turbulence(
        12.0, 0.14, hub_height=turbine.hub_height, rotor_diameter=turbine.rotor_diameter, duration=duration, seed=1
    )
    best: dict[str, Any] = {}
    for _ in range(2):
        result = simulate(model, wind, duration=duration, channels=CHANNELS)
        result.raise_for_status()
        steps = duration / result.meta["time_step"]
        factor = result.meta["real_time_factor"]
        if not best or factor > best["real_time_factor"]:
            best = {
                "us_per_step": round(1e6 * result.meta["run_seconds"] / steps, 2),
                "real_time_factor": factor,
                "time_step_s": result.meta["time_step"],
            }
    memory = psutil.Process().memory_info()
    peak = float(getattr(memory, "peak_wset", 0) or _peak_resident())
    best["peak_memory_mb"] = round((peak - wind.velocity.nbytes) / 1e6)
    return best


def timed_batch(duration: float) -> dict[str, Any]:
    """Time a batch on all cores against one core: making the winds and preparing the cases count, too."""
    from meltemi.loadcases.batch import BatchCase, available_cores, simulate_batch
    from meltemi.simulation.model import build
    from meltemi.simulation.simulate import simulate
    from meltemi.turbine.library import load_turbine
    from meltemi.wind.fields import SteadyWind
    from meltemi.wind.turbulence import turbulence

    model = build(load_turbine("nrel5mw"))
    turbine = model.turbine
    wind = partial(
        turbulence, 12.0, 0.14, hub_height=turbine.hub_height, rotor_diameter=turbine.rotor_diameter, duration=duration
    )

    def cases(seeds: range) -> list[BatchCase]:
        return [BatchCase(model, partial(wind, seed=seed), duration, channels=CHANNELS) for seed in seeds]

    def factor(some: list[BatchCase], workers: int) -> float:
        began = time.perf_counter()
        outcomes = simulate_batch(some, workers=workers, reduce=lambda result: result.raise_for_status().status)
        seconds = time.perf_counter() - began
        failed = [outcome.message for outcome in outcomes if not outcome.ok]
        if failed:
            raise MeltemiError(failed[0])
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
        "batch_peak_memory_mb": round(_peak_resident() / 1e6),
    }


def _peak_resident() -> float:
    """[bytes]"""
    import psutil

    try:
        import resource
    except ImportError:
        return float(psutil.Process().memory_info().rss)
    kilobytes = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return float(kilobytes if sys.platform == "darwin" else 1024 * kilobytes)


def report_lines(figures: dict[str, Any]) -> list[str]:
    """The figures for people."""
    staged = ", ".join(f"{name} {s:g} s" for name, s in figures["cold_compile_stages"].items())
    batch = f"{figures['batch_cases']} cases with their winds on {figures['cores']} cores"
    return [
        figures["case"],
        f"import meltemi          {figures['import_s']:8.3f} s",
        f"cold compilation        {figures['cold_compile_s']:8.1f} s    ({staged}; {figures['signatures']} signatures)",
        f"start from the cache    {figures['cached_start_s']:8.2f} s    (a new process that simulates 2 s)",
        f"time a step             {figures['us_per_step']:8.1f} us   (time step {figures['time_step_s']:g} s)",
        f"real-time factor        {figures['real_time_factor']:8.0f}      (one core)",
        f"peak memory             {figures['peak_memory_mb']:8.0f} MB   (without the wind field)",
        f"batch, real-time factor {figures['batch_real_time_factor']:8.0f}      ({batch})",
        f"lost by the batch       {100.0 * figures['batch_loss']:8.0f} %    (against cores times one core)",
        f"batch, peak memory      {figures['batch_peak_memory_mb']:8.0f} MB   (with the winds)",
    ]
