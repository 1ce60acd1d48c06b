"""Figures 9 and 10: the gust with direction change under the three strategies, by machine, yaw average and phase."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from meltemi.control.controller import LogEntry
from meltemi.simulation.result import Result
from meltemi_papers.wang2021.winds import GUST_BEGIN
from meltemi_studies.machine_loads import LOADS, TOP_SHEAR, YAW_BENDING, YAW_TORSION, extreme
from meltemi_tuning.run_store import FailedResult, FailedResultError

Float = NDArray[np.float64]
STOP, DERATE, IGNORE = "S1 stop", "S2 derate", "S3 ignore"
SHORT = "S2, recheck after 30 s"
MACHINE, SLOW, HELD = "12.6 rpm", "9.9 rpm", ", power held"
"""Machines in the gust: the paper's rotor speed and a slower one, with the paper's constant torque above rated or, as
the suffix of their names says, with constant power."""
RATIOS = tuple((load, against) for load in (YAW_BENDING, YAW_TORSION, TOP_SHEAR) for against in (STOP, IGNORE))
"""Loads of derating, and the strategy that they are compared with."""
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

    def triggered(self, strategy: str) -> float:
        """[s] time at which the yaw error first exceeds its threshold, both as measured by the controller."""
        result = self.results[strategy]
        return first(result, np.abs(result["yaw_error"]) > result["yaw_threshold"])

    def feathered(self, strategy: str) -> float:
        """[s] time at which the pitch exceeds 85 degrees; NaN if it does not."""
        result = self.results[strategy]
        return first(result, result["pitch_1"] > np.radians(85.0))

    def held(self) -> Float:
        """(T,) [kW] power of derating from 30 s after it began; NaN if it did not."""
        begin = next((e.time for e in transitions(self.results[DERATE], "derate")), np.inf)
        return self.power(DERATE, begin + 30.0) * 1e-3 if np.isfinite(begin) else np.array([np.nan])

    def power(self, strategy: str, begin: float, end: float = np.inf) -> Float:
        """(T,) [W] generator power from ``begin`` to ``end`` [s]."""
        return self.results[strategy].between(begin, end)["generator_power"]


@dataclass(frozen=True)
class Gusts:
    """Runs of all machines and yaw controls.

    Attributes:
      phases: by machine and averaging time [s] of the yaw control: one entry for each azimuth of the rotor.
    """

    phases: Mapping[tuple[str, float], Sequence[Gust]] = field(repr=False)

    @property
    def averages(self) -> list[float]:
        """[s] of the yaw control, in order."""
        return sorted({average for _, average in self.phases})

    @property
    def shown(self) -> Gust:
        """Of the paper's machine with the default yaw control, that of the figures."""
        return self.phases[MACHINE, self.averages[-1]][0]

    def values(self, machine: str, average: float, of: Callable[[Gust], float]) -> Float:
        """(phases,) values of a function of the runs, without phases in which a run failed.

        Raises:
          FailedResultError: every phase has a run that failed.
        """
        gusts = self.phases[machine, average]
        failed = [r for g in gusts for r in g.results.values() if isinstance(r, FailedResult)]
        found = [of(g) for g in gusts if not any(isinstance(r, FailedResult) for r in g.results.values())]
        if not found:
            raise FailedResultError(failed[0].why)
        return np.array(found)

    def ordered(self, machine: str, average: float) -> Float:
        """(phases,) whether the tower-top load rises from stopping over derating to ignoring."""

        def rises(g: Gust) -> float:
            one, two, three = (g.peak(name, TOP_SHEAR) for name in (STOP, DERATE, IGNORE))
            return float(one < two < three)

        return self.values(machine, average, rises)

    def ratios(self, machine: str, average: float, load: str, against: str) -> Float:
        """(phases,) ratios of the peaks of a load under derating and under another strategy."""
        return self.values(machine, average, lambda g: g.ratio(load, against))


def spread(values: Float, form: str = ".2f") -> str:
    """Smallest to largest value, of those that are there."""
    low, high = format(np.nanmin(values), form), format(np.nanmax(values), form)
    return low if low == high else f"{low} to {high}"


def peaks(gust: Gust) -> list[list[str]]:
    """Table rows: peaks of every load under every strategy, and ratios."""
    rows = []
    for name, load in LOADS.items():
        values = [gust.peak(strategy, name) for strategy in (STOP, DERATE, IGNORE)]
        ratios = [gust.ratio(name, against) for against in (STOP, IGNORE)]
        rows.append([f"{name} [{load.unit}]", *(f"{v:.2f}" for v in values), *(f"{r:.2f}" for r in ratios)])
    return rows
