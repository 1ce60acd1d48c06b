"""Figures 9 and 10: the gust with direction change under the three strategies."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from meltemi.control.controller import LogEntry
from meltemi.simulation.result import Result
from meltemi_papers.wang2021.loads import LOADS, YAW_BENDING, extreme
from meltemi_papers.wang2021.winds import GUST_BEGIN

Float = NDArray[np.float64]
STOP, DERATE, IGNORE = "S1 stop", "S2 derate", "S3 ignore"
SHORT = "S2, recheck after 30 s"
MOVED = np.radians(0.2)
"""[rad] of pitch beyond which it has begun to move."""


def transitions(result: Result, to: str) -> list[LogEntry]:
    """Log entries of transitions to a state with this word in its name, such as "stop"."""
    return [entry for entry in result.log if to in entry.what.rsplit("->", 1)[-1]]


def first(result: Result, where: NDArray[np.bool_]) -> float:
    """[s] time of the first record that meets a condition; NaN if none does."""
    return float(result.time[np.argmax(where)]) if where.any() else np.nan


@dataclass(frozen=True)
class Gust:
    """Runs in one wind, by strategy.

    Attributes:
      results: by strategy.
    """

    results: Mapping[str, Result] = field(repr=False)

    def peak(self, strategy: str, load: str) -> float:
        """Largest magnitude of a load after the start of the gust, in engineering units."""
        return extreme(self.results[strategy].between(GUST_BEGIN, np.inf), load)

    def ratio(self, load: str, against: str, strategy: str = DERATE) -> float:
        """Ratio of the peaks of two strategies."""
        return self.peak(strategy, load) / self.peak(against, load)

    def first_pitch(self, strategy: str) -> float:
        """[s] time at which the pitch of blade 1 differs from its initial value by 0.2 degrees."""
        result = self.results[strategy]
        return first(result, np.abs(result["pitch_1"] - result["pitch_1"][0]) > MOVED)

    def parting(self, strategy: str) -> float:
        """[s] time at which the pitch of blade 1 differs by 0.2 degrees from that without any reaction to the error."""
        one, other = self.results[strategy], self.results[IGNORE]
        return first(one, np.abs(one["pitch_1"] - other["pitch_1"]) > MOVED)

    def late(self) -> tuple[float, float, float]:
        """Ratios of derating to ignoring over the last 40 s: mean bending, ranges of bending and torsion."""
        parts = [self.results[name].between(60.0, np.inf) for name in (DERATE, IGNORE)]
        bend = [LOADS[YAW_BENDING].size(r) for r in parts]
        twist = [r["yaw_moment_z"] for r in parts]
        return (
            float(bend[0].mean() / bend[1].mean()),
            float(np.ptp(bend[0]) / np.ptp(bend[1])),
            float(np.ptp(twist[0]) / np.ptp(twist[1])),
        )

    def triggered(self, strategy: str) -> float:
        """[s] time at which the yaw error first exceeds its threshold, both as measured by the controller."""
        result = self.results[strategy]
        return first(result, np.abs(result["yaw_error"]) > result["yaw_threshold"])

    def feathered(self, strategy: str) -> float:
        """[s] time at which the pitch exceeds 85 degrees; NaN if it does not."""
        result = self.results[strategy]
        return first(result, result["pitch_1"] > np.radians(85.0))

    def power(self, strategy: str, begin: float, end: float = np.inf) -> Float:
        """(T,) [W] generator power from ``begin`` to ``end`` [s]."""
        return self.results[strategy].between(begin, end)["generator_power"]


def peaks(gust: Gust) -> list[list[str]]:
    """Table rows: peaks of every load under every strategy, and ratios."""
    rows = []
    for name, load in LOADS.items():
        values = [gust.peak(strategy, name) for strategy in (STOP, DERATE, IGNORE)]
        ratios = [gust.ratio(name, against) for against in (STOP, IGNORE)]
        rows.append([f"{name} [{load.unit}]", *(f"{v:.2f}" for v in values), *(f"{r:.2f}" for r in ratios)])
    return rows
