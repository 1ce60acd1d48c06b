"""Reduction of a run to the results of a load base: statistics, extremes, cycles, durations, duty of the drives."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from math import cos, radians, sin
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meltemi.loads.durations import actuator_duty, count_stops, load_duration
from meltemi.loads.loadbase.interfaces import TURNED, Interface
from meltemi.postprocess.cycles import Cycles, bin_cycles, rainflow_cycles
from meltemi.postprocess.extremes import DRIVERS, TRANSVERSE, extreme_loads
from meltemi.postprocess.fatigue import equivalent_loads
from meltemi.simulation.result import Result

Float = NDArray[np.float64]

SMALL = 0.005
"""Share of the largest range of a channel below which cycles are left out: they do less than 1e-5 of the damage at
slope 3, 1e-7 at slope 4 (NREL 5 MW, 600 s in turbulence)."""
LEVELS = 20
"""Levels per octave of a load-duration distribution, the same for all loads, so that runs can be summed."""
OCTAVES = 8
"""Number of octaves of levels; all loads below them are one level."""
MOVING = radians(0.02)
"""Rate [rad/s] above which a drive moves."""
ON, OFF = 0.4, 0.2
"""Shares of rated rotor speed: a stop is a fall from the first to the second."""


@dataclass(frozen=True)
class Reduced:
    """Reduced results of a run.

    Attributes:
      channels: names of the series: the recorded channels, and moments by direction such as ``tower_base_moment@30``.
      statistics: (C, 4) mean, standard deviation, minimum, maximum; NaN where a channel is not defined.
      extremes: (14,) times [s] and (14, 6) contemporaneous loads by interface.
      cycles: cycles by channel of forces and moments; empty for a case of ultimate loads.
      durations: rows of lower and upper end of a level, time [s] and revolutions, by load.
      duties: ``ActuatorDuty`` by drive.
      stops: number of stops.
      equivalent: damage-equivalent range at 1 Hz by channel, for cases that keep nothing else of a load.
    """

    channels: tuple[str, ...]
    statistics: Float
    extremes: dict[str, tuple[Float, Float]] = field(default_factory=dict)
    cycles: dict[str, Cycles] = field(default_factory=dict)
    durations: dict[str, Float] = field(default_factory=dict)
    duties: dict[str, Any] = field(default_factory=dict)
    stops: int = 0
    equivalent: dict[str, float] = field(default_factory=dict)


def reduced(result: Result, interfaces: Sequence[Interface], *, rated_speed: float, cycles: bool) -> Reduced:
    """Reduce a complete run to the results of a load base.

    Args:
      result: result with all channels of the interfaces.
      rated_speed: [rad/s] rated rotor speed, for the number of stops.
      cycles: whether cycles are counted, for fatigue.
    """
    part = result.evaluated
    series = dict(zip(part.names, np.ascontiguousarray(part.data.T), strict=True))
    for each in interfaces:
        if each.rose:
            i, j = (series[each.channels[3 + k]] for k in TRANSVERSE[each.plane])
            for angle in TURNED:
                series[f"{each.name}_moment@{angle}"] = cos(radians(angle)) * i + sin(radians(angle)) * j
    loads = list(dict.fromkeys(name for each in interfaces for name in each.channels))
    loads += [
        name for name in series if "@" in name or name.startswith(("root_moment_flap", "root_moment_edge", "line_"))
    ]
    return Reduced(
        tuple(series),
        _statistics(series.values()),
        {each.name: _extremes(part.time, series, each) for each in interfaces},
        {name: large_cycles(series[name]) for name in loads} if cycles else {},
        dict(entry for each in interfaces if each.speed for entry in _durations(part, series, each)),
        {name: actuator_duty(series[name], dt=_step(part), threshold=MOVING) for name in series if _drive(name)},
        count_stops(series["rotor_speed"], on=ON * rated_speed, off=OFF * rated_speed),
    )


def equivalent(result: Result, slopes: Mapping[str, float]) -> Reduced:
    """Reduce a complete run to its statistics and the damage-equivalent range of each load.

    Args:
      result: result with the channels of the loads.
      slopes: slope m of the S-N curve by channel.
    """
    part = result.evaluated
    loads = equivalent_loads(part, list(slopes), slopes=slopes)
    return Reduced(tuple(part.names), _statistics(part.data.T), equivalent=loads)


def large_cycles(series: Float) -> Cycles:
    """Cycles of a series in bins, without those below ``SMALL`` of the largest."""
    cycles = bin_cycles(rainflow_cycles(series))
    kept = cycles.ranges >= SMALL * cycles.ranges.max(initial=0.0)
    return Cycles(*(each[kept] for each in cycles))


def _statistics(series: Iterable[Float]) -> Float:
    return np.array([(x.mean(), x.std(), x.min(), x.max()) for x in series])


def _step(result: Result) -> float:
    return float(result.meta["output_step"])


def _drive(name: str) -> bool:
    return name == "nacelle_yaw" or (name.startswith("pitch_") and name[6:].isdigit()) or name.startswith("flap_")


def _extremes(time: Float, series: dict[str, Float], each: Interface) -> tuple[Float, Float]:
    loads, at = extreme_loads(np.stack([series[name] for name in each.channels], axis=1), each.plane)
    assert len(loads) == len(DRIVERS)
    return time[at], loads


def _durations(part: Result, series: dict[str, Float], each: Interface) -> list[tuple[str, Float]]:
    """Durations of the transverse force and moment of a bearing, and of the torque of a shaft."""
    force, moment = (np.hypot(*(series[each.channels[first + k]] for k in TRANSVERSE[each.plane])) for first in (0, 3))
    loads = {f"{each.name}_force": force, f"{each.name}_moment": moment}
    if each.speed == "rotor_speed":
        loads["rotor_torque"] = series["rotor_torque"]
    durations = []
    for name, load in loads.items():
        edges = level_edges(float(np.abs(load).max()))
        d = load_duration(load, series[each.speed], dt=_step(part), load_edges=edges)
        rows = np.stack([d.load_edges[:-1], d.load_edges[1:], d.time[:, 0], d.revolutions[:, 0]], axis=1)
        durations.append((name, rows[rows[:, 2] > 0.0]))
    return durations


def level_edges(largest: float) -> Float:
    """Edges of levels up to a largest magnitude: powers of two in both directions, and one level about zero."""
    top = int(np.floor(LEVELS * np.log2(max(largest, 1e-9)))) + 1
    edges = 2.0 ** (np.arange(top - OCTAVES * LEVELS, top + 1) / LEVELS)
    return np.concatenate([-edges[::-1], edges])
