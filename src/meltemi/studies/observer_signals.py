"""Signals of a turbine as the steps of an observer: checked, without gaps, at equal times."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import InputError
from meltemi.simulation.result import Result
from meltemi.turbine.power_turbine import AnyTurbine

Float = NDArray[np.float64]

STEP = 0.04
"""[s] time step of the filter: 25 Hz."""
INPUTS = ("generator_torque", "pitch")
"""Signals that are known inputs of the model."""
SENSORS = ("generator_speed", "tower_top_acceleration_x", "tower_top_acceleration_y")
"""Signals that correct the estimate."""
LONGEST = 0.1
"""[s] longest interval between samples for which sensors are used."""


@dataclass(frozen=True)
class Signals:
    """Signals at the steps of a filter.

    Attributes:
      time: (T,) [s].
      inputs: (T, 2) ``INPUTS``, SI.
      sensors: (T, 3) ``SENSORS``, SI; NaN where they are not known.
      azimuth: (T,) [rad].
      warnings: on what is left out.
    """

    time: Float
    inputs: Float
    sensors: Float
    azimuth: Float
    warnings: tuple[str, ...]


def signals_of(result: Result, turbine: AnyTurbine) -> Signals:
    """The signals of a result.

    Raises:
      InputError: a signal is missing, hardly any of its samples is finite, or the series is too short or too coarse.
    """
    table = _checked(result)
    known, warnings = table.pop("time"), []
    if left := len(result.time) - len(known):
        warnings.append(f"{left} of {len(result.time)} samples are left out: not all of their signals are finite")
    apart = np.diff(known)
    if (spacing := float(np.median(apart))) > LONGEST + 1e-9:
        raise InputError(
            f"observer: signals need a sample every {LONGEST:g} s or more often, found one every {spacing:g} s"
        )
    time = np.arange(known[0], known[-1] + 0.25 * STEP, STEP)
    azimuth = np.unwrap(table.pop("azimuth")) if "azimuth" in table else None
    at = {name: np.interp(time, known, values) for name, values in table.items()}
    speed, missing = at["generator_speed"], np.full(len(time), np.nan)
    sensors = np.column_stack([at.get(name, missing) for name in SENSORS])
    for k in np.flatnonzero(apart > LONGEST + 1e-9):
        begin, end = float(known[k]), float(known[k + 1])
        sensors[(time > begin) & (time < end)] = np.nan
        warnings.append(f"no samples from {begin:g} to {end:g} s: the estimate there is a prediction without sensors")
    if "generator_torque" in at:
        torque = at["generator_torque"]
    else:
        torque = at["generator_power"] / turbine.drivetrain.generator_efficiency / np.maximum(speed, 1e-3)
    pitch = np.mean([values for name, values in at.items() if name.startswith("pitch_")], axis=0)
    turned = np.cumsum(speed) * STEP / turbine.drivetrain.gear_ratio
    angle = turned if azimuth is None else np.interp(time, known, azimuth)
    return Signals(time, np.column_stack([torque, pitch]), sensors, angle, _few(warnings))


def _checked(result: Result) -> dict[str, Float]:
    """Times and those signals that are used, where all of them are finite."""
    if len(result.time) < 2 or result.time[-1] - result.time[0] < 1.0:
        raise InputError("observer: the series is shorter than 1 s")
    for name in ("generator_speed", "pitch_1"):
        if name not in result:
            raise InputError(f"observer: the signal {name!r} is missing; found {', '.join(result.names)}")
    if not {"generator_torque", "generator_power"} & set(result.names):
        raise InputError("observer: neither 'generator_torque' nor 'generator_power' is given")
    torque = "generator_torque" if "generator_torque" in result else "generator_power"
    optional = ("pitch_2", "pitch_3", *SENSORS[1:], "azimuth")
    used = ["generator_speed", torque, "pitch_1", *(name for name in optional if name in result)]
    table = {name: np.asarray(result[name], float) for name in used}
    finite = np.all([np.isfinite(x) for x in table.values()], axis=0)
    if finite.sum() < max(2.0, 0.5 * len(finite)):
        broken = min(table, key=lambda name: np.isfinite(table[name]).sum())
        raise InputError(
            f"observer: {finite.sum()} of {len(finite)} samples are finite; most are not in the signal {broken!r}"
        )
    return {"time": result.time[finite]} | {name: x[finite] for name, x in table.items()}


def _few(lines: list[str], most: int = 4) -> tuple[str, ...]:
    return tuple(lines if len(lines) <= most else [*lines[: most - 1], f"and {len(lines) - most + 1} more gaps"])
