"""Steady operation under any controller: the mean of a run in steady wind once it has settled."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

from meltemi.control.controller import Controller
from meltemi.simulation.model import Model
from meltemi.simulation.operating_point import OperatingPoint
from meltemi.simulation.simulate import simulate

SETTLING, AVERAGE = 120.0, 60.0
"""[s] duration of the run that is discarded, and the shortest one that is averaged."""


def controlled_point(model: Model[Any], controller: Controller, point: OperatingPoint) -> OperatingPoint:
    """Mean operation under a controller in the wind of an operating point, from which the run starts.

    The mean is over whole revolutions of at least ``AVERAGE``; a rotor that stands still has none. States are those
    of the start.

    Raises:
      RunError: the run ended early.
    """
    turn = 2.0 * math.pi / max(point.rotor_speed, 0.1)
    length = turn * math.ceil(AVERAGE / turn)
    names = [name for name in point.places if name != "time"]
    run = simulate(
        model, point.wind, duration=SETTLING + 2.0 * length, controller=controller, start=point, channels=names
    )
    late = run.between(SETTLING + length, math.inf)
    speed = float(late["rotor_speed"].mean())
    if speed > 0.1:
        turn = 2.0 * math.pi / speed
        late = run.between(float(run.time[-1]) - turn * math.ceil(length / turn), math.inf)
    means = point.means.copy()
    means[[point.places[name] for name in late.names]] = late.data.mean(axis=0)
    mean: dict[str, Any] = {
        name: float(late[name].mean()) for name in ("rotor_speed", "generator_speed", "generator_torque")
    }
    warnings = (*point.warnings, *run.warnings)
    return replace(point, means=means, warnings=warnings, imbalance=0.0, pitch=float(late["pitch_1"].mean()), **mean)
