"""Criteria of the test bench with their outcome, and the standing of a controller."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from meltemi.postprocess.ensemble import MeanEstimate
from meltemi.tuning.controller_bench.margins import OpenLoop

SLOPES = {"RootMyc1": 10.0, "RootMxc1": 10.0, "TwrBsMyt": 4.0, "TwrBsMxt": 4.0, "YawBrMyp": 4.0, "YawBrMzp": 4.0}
"""Loads, and the slopes of their S-N curves."""
NAMES = {
    "RootMyc1": "blade root, out of plane",
    "RootMxc1": "blade root, in plane",
    "TwrBsMyt": "tower base, fore-aft",
    "TwrBsMxt": "tower base, side-side",
    "YawBrMyp": "yaw bearing, tilt",
    "YawBrMzp": "yaw bearing, yaw",
}
"""Names of the loads in words."""


@dataclass(frozen=True)
class CriterionVerdict:
    """A criterion and its outcome.

    Attributes:
      criterion: name of the criterion.
      value, limit: value and its limit in ``unit``; NaN if there is no value.
      unit: engineering unit.
      passed: None if the criterion does not apply.
      where: case or reason.
      half_width: half-width of the 95 % interval of the value; NaN without one.
    """

    criterion: str
    value: float
    limit: float
    unit: str
    passed: bool | None
    where: str = ""
    half_width: float = math.nan

    @property
    def word(self) -> str:
        """``pass``, ``fail`` or ``-``, with a mark where the limit lies within the interval."""
        open_ = "" if not abs(self.value - self.limit) < self.half_width else ", limit within interval"
        return "-" if self.passed is None else ("pass" if self.passed else "fail") + open_


@dataclass(frozen=True)
class LoopMargins:
    """Smallest margins of a loop.

    Attributes:
      phase_margin, gain_margin: [rad], factor; smallest at all wind speeds where the loop has a linear response; NaN
        if there is none.
      nonlinear: [m/s] wind speeds without it, where the margins may be smaller.
    """

    phase_margin: float
    gain_margin: float
    nonlinear: tuple[float, ...]

    @classmethod
    def of(cls, loops: Sequence[OpenLoop]) -> LoopMargins:
        """Smallest margins of a loop that was measured at several wind speeds."""
        linear = [loop for loop in loops if loop.linear]
        return cls(
            min((loop.phase_margin for loop in linear), default=math.nan),
            min((loop.gain_margin for loop in linear), default=math.nan),
            tuple(loop.wind_speed for loop in loops if not loop.linear),
        )


@dataclass(frozen=True)
class Standing:
    """A controller on the leaderboard.

    Attributes:
      controller: name of the controller.
      failed, judged: numbers of criteria.
      energy, blade_load, tower_load: relative lifetime changes against the reference: energy, equivalent loads of the
        blade root out of plane and of the tower base fore-aft; None for the reference, and without a common seed.
      pitch_travel: [rad/s] mean pitch rate in production.
      speed: largest generator speed over its reference.
      clearance: smallest tower clearance over that of the undeflected blade.
      speed_loop, blade_loops: margins of the loops; None without blade loops.
    """

    controller: str
    failed: int
    judged: int
    energy: MeanEstimate | None
    blade_load: MeanEstimate | None
    tower_load: MeanEstimate | None
    pitch_travel: float
    speed: float
    clearance: float
    speed_loop: LoopMargins
    blade_loops: LoopMargins | None


def decibel(factor: float) -> float:
    """[dB] level of a gain."""
    return 20.0 * math.log10(factor)
