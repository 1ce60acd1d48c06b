"""Speed of the learning environments, and the deviations of their faster models."""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from meltemi.core.threads import available_cores
from meltemi.learning.fleet import Fleet, TaskSetup
from meltemi.learning.settings import MODELS, TEST_SEEDS, EnvironmentSettings
from meltemi.postprocess.fatigue import equivalent_loads
from meltemi.simulation.options import ModelOptions

TURBINES, STEPS, REPEATS = 16, 100, 11
"""Turbines that march together, timed steps of 0.1 s, and repetitions within an episode: the fastest counts."""
LOADS = ("tower_base_moment_fore_aft", "root_moment_flap_1")
"""Channels whose equivalent loads are compared."""


def timed_environments(seeds: tuple[int, ...] = TEST_SEEDS) -> dict[str, dict[str, float]]:
    """Environment steps of 0.1 s a second by model, and deviations of equivalent loads from the full one.

    Args:
      seeds: of the turbulence of the compared episodes of 120 s.

    Returns:
      by model ``time_step_s``, ``per_second`` (one core), ``per_second_all`` (all cores), ``reset_ms``, and by load the
      largest deviation of an episode.
    """
    found: dict[str, dict[str, float]] = {}
    loads = {name: _equivalent(options, seeds) for name, options in MODELS.items()}
    for name, options in MODELS.items():
        setup = TaskSetup("LoadControl", EnvironmentSettings(model=options))
        reset, one = _rate(setup, 1)
        found[name] = {
            "time_step_s": setup.dt,
            "per_second": round(one),
            "per_second_all": round(_rate(setup, available_cores())[1]),
            "reset_ms": round(1e3 * reset, 1),
        }
        for load in LOADS:
            ratios = np.divide(loads[name][load], loads["full"][load])
            found[name][load] = round(float(np.max(np.abs(ratios - 1.0))), 4)
    return found


def _rate(setup: TaskSetup, threads: int) -> tuple[float, float]:
    """[s] of a reset, and environment steps a second; of one thread by processor time."""
    clock = time.thread_time if threads == 1 else time.perf_counter
    fleet, actions, best = Fleet(setup, TURBINES, threads), np.zeros((TURBINES, 2), np.float32), 1e9
    rngs = [np.random.default_rng(i) for i in range(TURBINES)]
    for _ in range(2):  # the second time the winds are there
        began = clock()
        for i, rng in enumerate(rngs):
            fleet.begin(i, rng)
        reset = (clock() - began) / TURBINES
    which = np.arange(TURBINES)
    for _ in range(REPEATS):
        began = clock()
        for _ in range(STEPS):
            fleet.step(which, actions, rngs)
        best = min(best, clock() - began)
    fleet.close()
    return reset, TURBINES * STEPS / best


def _equivalent(options: ModelOptions, seeds: tuple[int, ...]) -> dict[str, list[float]]:
    """Equivalent loads of episodes under the baseline controller."""
    setup = TaskSetup("LoadControl", EnvironmentSettings(model=options, seeds=seeds, channels=LOADS[1:]))
    fleet = Fleet(setup, 1)
    found: dict[str, list[float]] = {load: [] for load in LOADS}
    for seed in seeds:
        fleet.begin(0, np.random.default_rng(0), {"turbulence_seed": seed, "begin": 0.0})
        for _ in range(setup.steps):
            fleet.step(np.zeros(1, dtype=np.int64), np.zeros((1, 2), np.float32), [])
        result = fleet.episodes[0].simulation.result().raise_for_status()
        for load, value in equivalent_loads(result, LOADS).items():
            found[load].append(value)
    fleet.close()
    return found


def environment_rows(figures: dict[str, Any]) -> list[str]:
    """Rows of the table of the benchmark page."""
    return [
        f"| {name} | {1e3 * f['time_step_s']:.1f} | **{f['per_second']:,.0f}** | {f['per_second_all']:,.0f} | "
        f"{f['reset_ms']:.0f} | {100.0 * f[LOADS[0]]:.1f} | {100.0 * f[LOADS[1]]:.1f} |"
        for name, f in figures.items()
    ]
