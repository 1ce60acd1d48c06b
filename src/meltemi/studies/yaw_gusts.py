"""Energy, stops and loads of each strategy over thousands of gusts with direction change.

The grid varies rise, rise time, direction change and speed of the gust, turbulence seeds, yaw rate and recheck time. A
stopped turbine has a given downtime after the end of its run; the energy lost in this time is included.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import lru_cache, partial
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np

from meltemi.control.controller import Controller, LogEntry
from meltemi.control_laws.yaw import YawControl
from meltemi.iec.gusts import RISE_TIME, Sign, ecd
from meltemi.iec.winds import NORMAL_EXPONENT
from meltemi.simulation.bladed.rotor import BladedModel
from meltemi.simulation.options import ModelOptions
from meltemi.simulation.result import Result
from meltemi.simulation.rotors import build
from meltemi.simulation.run import Run
from meltemi.simulation.trim import operating_point
from meltemi.studies.machine_loads import CHANNELS, LOADS, extreme, fatigue
from meltemi.studies.yaw_limits import BasePoints
from meltemi.supervisor.settings import Supervision
from meltemi.supervisor.supervised import SupervisedController
from meltemi.supervisor.threshold import YawProtection
from meltemi.tuning.run_store import FailedResult, attempt, cells, survivors
from meltemi.turbine.definition import Turbine
from meltemi.turbulence.field import generate_field
from meltemi.turbulence.superposition import with_gust
from meltemi.wind.fields import SteadyWind, WindBox, WindSeries
from meltemi.wind.turbulent import TurbulentWind

if TYPE_CHECKING:
    import pandas as pd

INTENSITY = 0.10
FAST = ModelOptions(blade_nodes=10, yaw="driven")
"""Half the usual nodes: extremes of these runs change by some percent, the order of strategies does not."""
DOWN = 600.0
"""[s] time from the stop of a turbine to production: wait, yaw, start-up."""
LENGTH, BEGIN = 150.0, 20.0
"""[s] default duration of a run, and begin of its gust."""
WIND = ["speed", "rise", "change", "time", "sign", "seed"]
"""Columns of the results that identify a wind."""
STOP_RATE = 0.1
"""[rad/s] pitch rate of stops, 5.7 deg/s, where the actuator permits it; Wang et al. (2021) give none."""


def with_yaw_rate(turbine: Turbine, rate: float) -> Turbine:
    """The turbine with another yaw rate [rad/s]."""
    return turbine.replace(**{"yaw.rate": rate})


def strategy(
    turbine: Turbine, protection: YawProtection, yaw: YawControl | None = None, stop_rate: float = STOP_RATE
) -> Controller:
    """Supervisory controller with yaw control, a strategy of yaw protection, and a pitch rate [rad/s] in stops."""
    actuator = turbine.pitch_actuator
    rate = stop_rate if actuator.kind == "ideal" else min(stop_rate, actuator.rate_limit)
    # speed limits wide enough that only the strategies act: at 60 degrees the speed varies by up to 17 %
    settings = Supervision(over_speed=1.25, trip_speed=1.3, normal_rate=rate)
    return SupervisedController(turbine, settings, yaw=yaw or YawControl(), protection=protection)


def coherent_gust(
    turbine: Turbine,
    speed: float,
    *,
    rise: float,
    change: float | None = None,
    time: float = RISE_TIME,
    begin: float = BEGIN,
    sign: Sign = 1,
) -> WindSeries:
    """Coherent gust with direction change of IEC 61400-1 with another rise time.

    Args:
      turbine: turbine, for its hub height.
      speed: [m/s] wind speed before the gust.
      rise: [m/s] rise of the speed.
      change: [rad] change of the direction; by default that of the standard.
      time: [s] rise time of both; 10 s in the standard.
      begin: [s] begin of the gust.
      sign: sign of the direction change, 1 clockwise from above.
    """
    gust = ecd(turbine, speed, gust=rise, change=change, begin=begin, sign=sign)
    if time == RISE_TIME:
        return gust
    stretched = begin + (gust.time - begin) * time / RISE_TIME
    return gust.replace(time=stretched, source=f"{gust.source}, within {time:g} s")


def transitions(result: Result, to: str) -> list[LogEntry]:
    """Log entries of transitions to a state with this word in its name, such as "stop"."""
    return [entry for entry in result.log if to in entry.what.rsplit("->", 1)[-1]]


@dataclass(frozen=True)
class GustGrid:
    """Parameters of the gusts and strategies.

    Attributes:
      speeds: [m/s] wind speeds before the gust.
      rises: [m/s] rises of the wind speed.
      changes: [rad] changes of the direction.
      times: [s] rise times: that of the standard, and that of Wang et al. (2021).
      signs: signs of the direction change, 1 clockwise from above.
      seeds: turbulence seeds.
      yaw_rates: [rad/s] yaw rates.
      rechecks: [s] recheck times of the derating strategy.
      length: [s] duration of a run.
    """

    speeds: tuple[float, ...] = (7.0, 10.67)
    rises: tuple[float, ...] = (0.0, 14.33)
    changes: tuple[float, ...] = tuple(np.radians((30.0, 60.0, 90.0)))
    times: tuple[float, ...] = (RISE_TIME, 20.0)
    signs: tuple[Sign, ...] = (1, -1)
    seeds: tuple[int, ...] = (1, 2)
    yaw_rates: tuple[float, ...] = tuple(np.radians((0.3, 0.5, 0.8)))
    rechecks: tuple[float, ...] = (30.0, 60.0, 90.0)
    length: float = LENGTH

    def winds(self) -> Iterator[tuple[float, float, float, float, Sign, int]]:
        """Winds as in ``WIND``; those in the same turbulence are consecutive."""
        every = product(self.speeds, self.seeds, self.times, self.rises, self.changes, self.signs)
        return ((speed, rise, change, time, sign, seed) for speed, seed, time, rise, change, sign in every)

    def __len__(self) -> int:
        return len(list(self.winds())) * len(self.yaw_rates) * (2 + len(self.rechecks))


QUICK = GustGrid(
    (10.67,),
    (14.33,),
    (0.8, 1.2),
    times=(20.0,),
    signs=(1,),
    seeds=(1,),
    yaw_rates=GustGrid.yaw_rates[::2],
    rechecks=(30.0, 90.0),
)
OURS = "S2 ours"
"""Derating at base points from a load limit."""


@dataclass(frozen=True)
class GustResults:
    """Results over a grid of gusts, one row for each run.

    Attributes:
      grid: varied parameters.
      rows: columns speed, rise, change, time, sign, seed, yaw_rate, strategy, recheck, energy [J] from the begin of
        the gust to ``DOWN`` after it, stops, derates, and (load, "extreme" | "fatigue").
    """

    grid: GustGrid
    rows: pd.DataFrame = field(repr=False)


def run_grid(
    turbine: Turbine,
    grid: GustGrid,
    base_points: BasePoints | None = None,
    *,
    workers: int | None = None,
    progress: Callable[[float], None] = lambda share: None,
) -> GustResults:
    """Run all gusts of a grid.

    Args:
      base_points: base points of a further strategy, which derates like S2 with the longest recheck time.

    Raises:
      FailedResultError: all runs failed.
    """
    import pandas as pd

    keys: dict[str, dict[str, Any]] = {}
    results = cells(_Cases(turbine, grid, base_points, keys), reduce=reduced, workers=workers, progress=progress)
    survivors(results)
    rows = [
        key | value for key, value in zip(keys.values(), results, strict=True) if not isinstance(value, FailedResult)
    ]
    return GustResults(grid, pd.DataFrame(rows))


def strategies(
    rechecks: Sequence[float], base_points: BasePoints | None = None
) -> list[tuple[str, float, YawProtection]]:
    """Names, recheck times [s] and settings of the strategies.

    S1 has the stepwise threshold of Wang et al. (2021) before their optimisation; base points add a further strategy,
    which derates like S2 with the longest recheck time.
    """
    settings = [
        ("S1", 0.0, YawProtection(strategy="stop", law="stepwise")),
        ("S3", 0.0, YawProtection(strategy="ignore")),
        *(("S2", time, YawProtection(strategy="derate", recheck_time=time)) for time in rechecks),
    ]
    if base_points is not None:
        c, b = base_points
        ours = YawProtection(strategy="derate", recheck_time=rechecks[-1], wind_speeds=c, thresholds=b)
        settings.append((OURS, rechecks[-1], ours))
    return settings


class _Cases:
    """Cases in sequence; those in the same wind are consecutive."""

    def __init__(
        self, turbine: Turbine, grid: GustGrid, base_points: BasePoints | None, keys: dict[str, dict[str, Any]]
    ) -> None:
        self.turbine, self.grid, self.keys = turbine, grid, keys
        self.strategies = strategies(grid.rechecks, base_points)
        self.machines = {rate: with_yaw_rate(turbine, rate) for rate in grid.yaw_rates}
        self.models: dict[float, BladedModel] = {rate: build(t, FAST) for rate, t in self.machines.items()}
        steady = {speed: SteadyWind(speed=speed, shear_exponent=NORMAL_EXPONENT) for speed in grid.speeds}
        model = self.models[grid.yaw_rates[0]]
        self.starts = {
            speed: attempt(f"steady operation at {speed:g} m/s", operating_point, model, wind)
            for speed, wind in steady.items()
        }
        self.wind = lru_cache(maxsize=6)(self._wind)
        self.box = lru_cache(maxsize=3)(self._box)

    def __len__(self) -> int:
        g = self.grid
        return len(g) // (2 + len(g.rechecks)) * len(self.strategies)

    def __iter__(self) -> Iterator[Run]:
        g = self.grid
        for wind in g.winds():
            for rate, (name, recheck, protection) in product(g.yaw_rates, self.strategies):
                label = f"case_{len(self.keys) + 1:05d}"
                of_run = {"yaw_rate": rate, "strategy": name, "recheck": recheck}
                self.keys[label] = dict(zip(WIND, wind, strict=True)) | of_run
                yield Run(
                    model=self.models[rate],
                    wind=partial(self.wind, *wind),
                    duration=self.grid.length,
                    controller=strategy(self.machines[rate], protection),
                    channels=(*CHANNELS, "generator_power", "operating_state"),
                    output_step=0.1,
                    start=self.starts[wind[0]],
                    name=label,
                )

    def _box(self, speed: float, seed: int) -> WindBox:
        wind = TurbulentWind(speed=speed, intensity=INTENSITY, seed=seed, shear_exponent=NORMAL_EXPONENT, points=15)
        return generate_field(wind, self.turbine, self.grid.length)

    def _wind(self, speed: float, rise: float, change: float, time: float, sign: Sign, seed: int) -> WindBox:
        gust = coherent_gust(self.turbine, speed, rise=rise, change=change, time=time, sign=sign)
        return with_gust(self.box(speed, seed), gust)


def reduced(result: Result) -> dict[str, Any]:
    """Evaluated results of a run."""
    power, dt = result["generator_power"], float(result.time[1] - result.time[0])
    stopped = bool(transitions(result, "stop"))
    # after the run a stopped turbine stays down, another continues with the power of its last half minute
    last = 0.0 if stopped else float(power[-round(30.0 / dt) :].mean())
    row: dict[str, Any] = {
        "energy": float(power.sum() * dt) + last * DOWN,
        "stops": int(stopped),
        "derates": len(transitions(result, "derate")),
    }
    for name in LOADS:
        row[f"{name}, extreme"], row[f"{name}, fatigue"] = extreme(result, name), fatigue(result, name)
    return row
