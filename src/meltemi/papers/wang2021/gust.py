"""Figures 9 and 10: the gust under the strategies, by machine, yaw control, direction, rise time, phase."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from meltemi.iec.gusts import Sign
from meltemi.papers.wang2021.winds import GUST_BEGIN, STATED, TIMES
from meltemi.papers.wang2021.words import sentence
from meltemi.reports.blocks import Table
from meltemi.simulation.result import Result
from meltemi.studies.machine_loads import LOADS, TOP_SHEAR, YAW_BENDING, YAW_TORSION, extreme
from meltemi.studies.yaw_gusts import transitions
from meltemi.tuning.run_store import FailedResult, FailedResultError

Float = NDArray[np.float64]

STOP, DERATE, IGNORE = "S1 stop", "S2 derate", "S3 ignore"
INTERPOLATED, EMERGENCY = "S1 interpolated", "S1 emergency stop"
"""Stopping at the interpolated threshold, in place of the stepwise one that the paper had before; and stopping as the
paper says, beside the normal stop of the yaw protection."""
SLOWED, SHORT = "S2 at low speed", "S2, recheck after 30 s"
"""Derating by a lower rotor speed in place of a lower torque; a recheck that comes too early."""
GENTLE, AT_ONCE = "S1 at half the pitch rate", "S2 at once"
"""Experiments on what makes the peaks: the pitch of the stop; and how late derating acts, within a step of the
controller in place of 10 % of rated power a second."""
DRAWN = (STOP, EMERGENCY, DERATE, SLOWED, IGNORE)
"""Strategies of the figures."""
MACHINE, SLOW = "12.6 rpm", "9.9 rpm"
"""Machines in the gust: the paper's rotor speed and a slower one, with constant torque above rated."""
SIGNS: Mapping[Sign, str] = {1: "clockwise", -1: "counter-clockwise"}
"""Senses of the direction change seen from above: the paper gives none, the standard has both."""
RATIOS = tuple((load, against) for load in (YAW_BENDING, YAW_TORSION, TOP_SHEAR) for against in (STOP, IGNORE))
"""Loads of derating, and the strategy that they are compared with."""
MOVED = np.radians(0.2)
"""[rad] pitch angle beyond which it has begun to move."""


def first(result: Result, where: NDArray[np.bool_]) -> float:
    """Time [s] of the first sample that meets a condition; NaN if none does."""
    return float(result.time[np.argmax(where)]) if where.any() else np.nan


@dataclass(frozen=True)
class Gust:
    """Runs in one wind, by strategy.

    Attributes:
      results: results by strategy.
    """

    results: Mapping[str, Result] = field(repr=False)

    def peak(self, strategy: str, load: str) -> float:
        """Largest magnitude of a load after the start of the gust, in engineering units."""
        return extreme(self.results[strategy].between(GUST_BEGIN, np.inf), load)

    def ratio(self, load: str, against: str, strategy: str = DERATE) -> float:
        """Ratio of the peaks of two strategies."""
        return self.peak(strategy, load) / self.peak(against, load)

    def first_pitch(self, strategy: str) -> float:
        """Time [s] at which the pitch of blade 1 differs from its initial value by 0.2 degrees."""
        result = self.results[strategy]
        return first(result, np.abs(result["pitch_1"] - result["pitch_1"][0]) > MOVED)

    def triggered(self, strategy: str) -> float:
        """Time [s] at which the yaw error first exceeds its threshold, both as measured by the controller."""
        result = self.results[strategy]
        return first(result, np.abs(result["yaw_error"]) > result["yaw_threshold"])

    def feathered(self, strategy: str) -> float:
        """Time [s] at which the pitch exceeds 85 degrees; NaN if it does not."""
        result = self.results[strategy]
        return first(result, result["pitch_1"] > np.radians(85.0))

    def derated_power(self) -> Float:
        """(T,) [kW] power from 30 s after the begin of derating; NaN without derating."""
        begin = next((e.time for e in transitions(self.results[DERATE], "derate")), np.inf)
        return self.power(DERATE, begin + 30.0) * 1e-3 if np.isfinite(begin) else np.array([np.nan])

    def power(self, strategy: str, begin: float, end: float = np.inf) -> Float:
        """(T,) [W] generator power from ``begin`` to ``end`` [s]."""
        return self.results[strategy].between(begin, end)["generator_power"]


class GustSetting(NamedTuple):
    """Machine, averaging time [s] of the yaw control, sign of the direction change, and time [s] that it takes."""

    machine: str
    average: float
    sign: Sign
    time: float

    @property
    def words(self) -> str:
        """The setting as text."""
        return f"{self.machine}, {self.average:g} s, {SIGNS[self.sign]}, within {self.time:g} s"


@dataclass(frozen=True)
class Gusts:
    """Runs of all machines, yaw controls and directions.

    Attributes:
      phases: runs by setting, one entry for each azimuth of the rotor.
      shown: settings of the figures: both directions and all rise times.
    """

    phases: Mapping[GustSetting, Sequence[Gust]] = field(repr=False)
    shown: tuple[GustSetting, ...]

    def first(self, sign: int, time: float = STATED) -> Gust:
        """The first phase for a direction and a rise time, for the figures."""
        return self.phases[next(s for s in self.shown if (s.sign, s.time) == (sign, time))][0]

    def values(self, setting: GustSetting, of: Callable[[Gust], float]) -> Float:
        """(phases,) values of a function of the runs, without phases in which a run failed.

        Raises:
          FailedResultError: every phase has a run that failed.
        """
        gusts = self.phases[setting]
        failed = [r for g in gusts for r in g.results.values() if isinstance(r, FailedResult)]
        values = [of(g) for g in gusts if not any(isinstance(r, FailedResult) for r in g.results.values())]
        if not values:
            raise FailedResultError(failed[0].why)
        return np.array(values)

    def over_all(self, of: Callable[[Gust], float], machine: str = "", sign: int = 0, time: float = 0.0) -> Float:
        """Values in all settings, or in those of a given machine, direction and rise time."""
        chosen = [
            s for s in self.phases if machine in ("", s.machine) and sign in (0, s.sign) and time in (0.0, s.time)
        ]
        return np.concatenate([self.values(setting, of) for setting in chosen])

    def ratios(self, setting: GustSetting, load: str, against: str, strategy: str = DERATE) -> Float:
        """(phases,) ratios of the peak loads under a strategy (by default derating) and another one."""
        return self.values(setting, lambda g: g.ratio(load, against, strategy))


def ordered(g: Gust) -> float:
    """Whether the tower-top load rises from stopping over derating to ignoring."""
    one, two, three = (g.peak(name, TOP_SHEAR) for name in (STOP, DERATE, IGNORE))
    return float(one < two < three)


def spread(values: Float, form: str = ".2f") -> str:
    """Range from smallest to largest value, without missing ones."""
    low, high = format(np.nanmin(values), form), format(np.nanmax(values), form)
    return low if low == high else f"{low} to {high}"


def peaks(gust: Gust) -> list[list[str]]:
    """Table rows: peaks of every load under every strategy, and ratios."""
    rows = []
    for name, load in LOADS.items():
        values = [gust.peak(strategy, name) for strategy in gust.results]
        ratios = [gust.ratio(name, against) for against in (STOP, IGNORE)]
        rows.append([f"{name} [{load.unit}]", *(f"{v:.2f}" for v in values), *(f"{r:.2f}" for r in ratios)])
    return rows


EXPERIMENTS = (
    (GENTLE, STOP, YAW_BENDING),
    (INTERPOLATED, STOP, YAW_BENDING),
    (AT_ONCE, DERATE, YAW_BENDING),
    (AT_ONCE, DERATE, TOP_SHEAR),
)
"""Setting that changes, setting for comparison, and load."""


def ratios_table(g: Gusts) -> Table:
    """Table of ratios of loads by setting, over the phases."""
    against = [(load, DERATE, other) for load, other in RATIOS]
    against += [(YAW_BENDING, STOP, IGNORE)]
    if all(EMERGENCY in x.results for phases in g.phases.values() for x in phases):
        against.append((YAW_BENDING, DERATE, EMERGENCY))
    short = {other: other if other == EMERGENCY else other[:2] for *_, other in against}
    head = ["machine", "yaw average\ns", "change", "within\ns"]
    head += [f"{load}\n{strategy[:2]} over {short[other]}" for load, strategy, other in against]
    head += ["tower top\nS1 < S2 < S3"]
    rows = []
    for s in g.phases:
        x = g.values(s, ordered)
        cells = [spread(g.ratios(s, load, other, strategy)) for load, strategy, other in against]
        rows.append([s.machine, f"{s.average:g}", SIGNS[s.sign], f"{s.time:g}", *cells, f"{x.sum():.0f} of {len(x)}"])
    note = sentence("ratios", phases=len(next(iter(g.phases.values()))))
    return Table(head, rows, "Peaks of derating over those of stopping and ignoring", text_columns=1, note=note)


def causes_table(g: Gusts) -> Table:
    """Table of experiments on the causes of the peaks: each changes one parameter in the same gust and phase."""
    rows = []
    for s, (strategy, against, load) in product(g.shown, EXPERIMENTS):
        ratio = spread(g.ratios(s, load, against, strategy))
        rows.append([f"{strategy} over {against}", load, SIGNS[s.sign], f"{s.time:g}", ratio])
    for (sign, words), name, load in product(SIGNS.items(), (STOP, DERATE, IGNORE), (YAW_BENDING, TOP_SHEAR)):
        long, short = (
            g.values(next(s for s in g.shown if (s.sign, s.time) == (sign, time)), lambda x: x.peak(name, load))  # noqa: B023
            for time in TIMES
        )
        if len(long) == len(short):
            times = " over ".join(f"{time:g}" for time in TIMES)
            rows.append([f"{name} within {times} s", load, words, times, spread(long / short)])
    head = ["experiment", "load", "change", "within\ns", "ratio of the peaks"]
    note = "Default yaw control, 12.6 rpm; smallest to largest over the azimuths of the rotor."
    return Table(head, rows, "What makes the peaks", text_columns=4, note=note)


def loads_tables(g: Gusts) -> list[Table]:
    """Tables of peak loads after the start of the gust, by rise time and direction."""
    tables = []
    for time, (sign, words) in product(TIMES, SIGNS.items()):
        gust = g.first(sign, time)
        head = ["largest size after the gust began", *gust.results, "S2 over S1", "S2 over S3"]
        caption = f"Loads of the strategies, {words} change within {time:g} s, 12.6 rpm, default yaw control, "
        tables.append(Table(head, peaks(gust), f"{caption}first phase"))
    return tables


def log_table(g: Gusts, recheck: Result) -> Table:
    """Table of the supervisor's transitions."""
    results = {**g.first(1).results, SHORT: recheck}
    rows = [
        [name, f"{entry.time:.2f}", entry.what, entry.reason]
        for name, result in results.items()
        for entry in result.log
    ]
    return Table(["strategy", "time [s]", "transition", "reason"], rows, "The supervisor's log", text_columns=4)


def slowed_words(g: Gusts) -> str:
    """Text on derating by rotor speed against derating by torque, and on emergency against normal stops."""
    parts = []
    for setting in g.shown:
        whole = [x for x in g.phases[setting] if SLOWED in x.results and EMERGENCY in x.results]
        bending, shear, stop = (
            spread(np.array([x.ratio(load, against, strategy) for x in whole]))
            for load, against, strategy in (
                (YAW_BENDING, DERATE, SLOWED),
                (TOP_SHEAR, DERATE, SLOWED),
                (YAW_BENDING, STOP, EMERGENCY),
            )
        )
        kind = {"direction": SIGNS[setting.sign], "time": setting.time}
        parts.append(sentence("slowed ratio", bending=bending, shear=shear, stop=stop, **kind))
    return sentence("slowed", ratios="; ".join(parts))


def gust_words(g: Gusts) -> str:
    """Text on where derating has lower or higher loads than the other strategies in the paper's gust, by reading."""
    machine = next(iter(g.phases)).machine
    ratios, peaks_of_stopping, worst = [], [], {}
    for time, (sign, words) in product(TIMES, SIGNS.items()):
        kind = {"direction": words, "time": time}
        stop, ignore = (
            spread(g.over_all(lambda x, other=other: x.ratio(YAW_BENDING, other), machine, sign, time))  # type: ignore[misc]
            for other in (STOP, IGNORE)
        )
        ratios.append(sentence("ratio", stop=stop, ignore=ignore, **kind))
        stop_peak = float(np.median(g.over_all(lambda x: x.peak(STOP, YAW_BENDING), machine, sign, time)))
        peaks_of_stopping.append(sentence("peak", peak=stop_peak, **kind))
        worst[sentence("governs", **kind)] = float(
            g.over_all(lambda x: max(x.peak(name, YAW_BENDING) for name in x.results), machine, sign, time).max()
        )
    governs = max(worst, key=lambda words: worst[words])
    numbers = {"machine": machine, "ratios": "; ".join(ratios), "peaks": ", ".join(peaks_of_stopping)}
    return sentence("gust", governs=governs, **numbers)
