"""Time steps of three turbines: speed, and deviations from a step of 2.5 ms."""

from __future__ import annotations

from typing import Any

import numpy as np

from meltemi.control.baseline import BaselineController
from meltemi.core.extras import skipped
from meltemi.postprocess.fatigue import damage_equivalent_load
from meltemi.simulation.options import ModelOptions
from meltemi.simulation.result import Result
from meltemi.simulation.rotors import build
from meltemi.simulation.simulate import simulate
from meltemi.turbine.library import load_turbine, packages_of
from meltemi.wind.turbulent import TurbulentWind

TURBINES = {"NREL 5 MW": "nrel5mw", "IEA 15 MW": "iea15mw", "IEA 22 MW": "iea22mw"}
REFERENCE = ModelOptions(time_step=0.0025)
WAYS = {
    "all modes explicit": {"nrel5mw": 0.01, "iea15mw": 0.05 / 26, "iea22mw": 0.05 / 12},
    "explicit but for stiff modes": "explicit",
    "default, 10 ms": 0.01,
    "default": None,
}
"""By name: the largest step of explicit modes; ``integration: explicit``; the default, at a given step or its own."""
SAMPLE = 0.05
"""[s] of controller and output, the same for all steps: the delay of a controller called at each step would vary."""
LOADS = {
    "root_moment_out_of_plane_1": 10.0,
    "root_moment_in_plane_1": 10.0,
    "tower_base_moment_fore_aft": 4.0,
    "tower_base_moment_side_side": 4.0,
    "yaw_moment_z": 4.0,
    "shaft_tilt_moment": 4.0,
    "rotor_torque": 4.0,
}
"""Channels that are compared, with the slope of their equivalent load."""
TRANSIENT = 30.0


def needs() -> dict[str, tuple[str, ...]]:
    """Optional packages by turbine."""
    return {title: packages_of(name) for title, name in TURBINES.items()}


def options(way: str, name: str) -> ModelOptions:
    """Model options of a way to integrate a turbine of the library."""
    step: Any = WAYS[way]
    if isinstance(step, dict):
        return ModelOptions(integration="explicit", time_step=step[name])
    return ModelOptions(integration="explicit") if step == "explicit" else ModelOptions(time_step=step)


def timed_steps(duration: float, repeats: int = 3) -> dict[str, dict[str, dict[str, float]]]:
    """Speed and deviations by turbine and way, in turbulence of 14 m/s; turbines without data are left out.

    Args:
      duration: [s] of the compared part of each run.
      repeats: runs of each, of which the fastest counts.

    Returns:
      ``time_step_s``, ``us_per_step``, ``real_time_factor``, and the largest relative deviations ``std`` and ``load``
      of standard deviation and damage-equivalent load of the channels ``LOADS``.
    """
    found: dict[str, dict[str, dict[str, float]]] = {}
    absent = skipped(needs())
    for title, name in TURBINES.items():
        if title in absent:
            continue
        exact, _ = _fastest(name, REFERENCE, duration, 1)
        found[title] = {}
        for way in WAYS:
            result, seconds = _fastest(name, options(way, name), duration, repeats)
            step, whole = result.meta["time_step"], float(result.time[-1])
            found[title][way] = {
                "time_step_s": step,
                "us_per_step": round(1e6 * seconds * step / whole, 2),
                "real_time_factor": round(whole / seconds),
                "std": max(abs(_part(result, c).std() / _part(exact, c).std() - 1.0) for c in LOADS),
                "load": max(abs(_load(result, c, duration) / _load(exact, c, duration) - 1.0) for c in LOADS),
            }
    return found


def _fastest(name: str, chosen: ModelOptions, duration: float, repeats: int) -> tuple[Result, float]:
    turbine = load_turbine(name)
    model, law = build(turbine, chosen), BaselineController(turbine, sample_time=SAMPLE)
    runs = [
        simulate(
            model,
            TurbulentWind(speed=14.0, intensity=0.14, seed=1),
            duration=TRANSIENT + duration,
            controller=law,
            channels=list(LOADS),
            output_step=SAMPLE,
        ).raise_for_status()
        for _ in range(repeats)
    ]
    return runs[0], min(run.meta["run_seconds"] for run in runs)


def _part(result: Result, channel: str) -> Any:
    return np.asarray(result[channel])[result.time >= TRANSIENT - 1e-9]


def _load(result: Result, channel: str, duration: float) -> float:
    return damage_equivalent_load(_part(result, channel), duration=duration, slope=LOADS[channel])
