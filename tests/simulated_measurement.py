"""Measurements of a turbine of which the truth is known: simulated in a field that a sonic upwind sees, too."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meltemi import TurbulentWind
from meltemi.cases.case import LoadCase
from meltemi.simulation.simulate import simulate
from meltemi.turbulence.field import generate_field
from meltemi.turbulence.grid import wind_grid_for
from meltemi.validation.channel_map import ChannelMap
from meltemi.validation.measurements import MeasuredRecord, Signal
from meltemi.validation.simulations import Simulator

Float = NDArray[np.float64]
HUB, UPWIND = 90.0, 200.0
"""[m] height of the sonic and its distance."""
POINTS, DT = 9, 0.25
"""Of all wind fields: points across, and [s] between planes, at which the sonic samples."""
STEP = 0.1
"""[s] of the samples at the turbine."""
BEFORE = 1800.0
"""[s] of wind before that of a record: it fluctuates on longer times than the record, as that of a site does."""
CASE: dict[str, Any] = {"turbine": "nrel5mw", "wind": {"kind": "steady", "speed": 10.0}, "duration": 10.0}
FIELD = {"points": POINTS, "dt": DT, "coherent": "all"}
MACHINE = {
    "generator_power": {"column": "P", "unit": "W", "kind": "power"},
    "rotor_speed": {"column": "n", "unit": "rad/s", "kind": "rpm"},
    "root_moment_flap_1": {"column": "M", "unit": "N m", "kind": "gauge"},
    "tower_base_moment_fore_aft": {"column": "T", "unit": "N m", "kind": "gauge"},
}
BEGIN = 1_714_564_800.0


def loggers() -> dict[str, Any]:
    """Sonic and turbine, with a clock and a rate each."""
    time = {"column": "t", "form": "posix"}
    names = {"u": "wind_speed", "v": "mast_v", "w": "mast_w"}
    place = {"unit": "m/s", "kind": "sonic", "height": HUB, "upwind": UPWIND}
    sonic = {name: {"column": key, "component": key, **place} for key, name in names.items()}
    return {
        "mast": {"files": "mast_*.csv", "time": time, "channels": sonic},
        "turbine": {"files": "turbine_*.csv", "time": time, "channels": MACHINE},
    }


def channel_map() -> ChannelMap:
    return ChannelMap(loggers=loggers())


def load_case() -> LoadCase:
    return LoadCase(**CASE)


def measured(
    simulator: Simulator, speed: float, seed: int, length: float, truth: Mapping[str, float], gaps: float = 0.02
) -> MeasuredRecord:
    """A record of the turbine with some parameters changed, with noise, and a share of the samples missing."""
    wind = TurbulentWind(speed=speed, intensity=0.12, seed=seed, scaled=False, **FIELD)
    grid = wind_grid_for(simulator.turbine, POINTS)
    transient, delay = simulator.settings.transient, UPWIND / speed
    whole = generate_field(wind, grid, BEFORE + transient + length + delay)
    box = replace(whole, velocity=whole.velocity[round(BEFORE / DT) :])
    real = simulator.at([*truth], truth.values())
    channels = (*MACHINE, "azimuth")
    result = simulate(real.model(None), box, duration=transient + length, channels=channels, output_step=STEP)
    passing = box.passing - delay - transient  # the mast
    inside = (passing >= 0.0) & (passing < length)
    draw = np.random.default_rng(seed)
    signals = {}

    def add(name: str, time: Float, x: Float, noise: float, rate: float) -> None:
        x = np.where(draw.random(len(x)) < gaps, np.nan, x + noise * draw.standard_normal(len(x)))
        signals[name] = Signal(BEGIN + time, x, rate)

    for name, x in zip(("wind_speed", "mast_v", "mast_w"), box.velocity[inside, *grid.hub].T, strict=True):
        add(name, passing[inside], x.astype(float), 0.05, 1.0 / DT)
    time = np.arange(0.0, length, STEP)
    for name in MACHINE:
        x = np.interp(time + transient, result.time, result[name])
        gain, zero = (truth.get(f"{kind}.{name}", 0.0) for kind in ("gauge_gain", "gauge_zero"))
        add(name, time, (1.0 + gain) * x + zero, 0.002 * float(np.std(x)), 1.0 / STEP)
    return MeasuredRecord(BEGIN, length, f"{seed}.csv", signals)


def write_records(folder: Path, records: Sequence[MeasuredRecord]) -> None:
    """Files of both loggers, ten minutes after each other."""
    for k, record in enumerate(records):
        for logger, columns in loggers().items():
            sensors = columns["channels"]
            signals = [record[name] for name in sensors]
            rows = np.column_stack([signals[0].time + 600.0 * k, *(signal.values for signal in signals)])
            head = ",".join(["t", *(sensor["column"] for sensor in sensors.values())])
            path = folder / f"{logger}_{k:02d}.csv"
            np.savetxt(path, rows, fmt=["%.4f", *["%.7g"] * len(signals)], delimiter=",", header=head, comments="")
