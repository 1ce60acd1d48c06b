"""Plausibility of measurements for a turbine: units, signs, the wind of another turbine, clocks of wind and power."""

from __future__ import annotations

import numpy as np

from meltemi.core.extras import need
from meltemi.core.units import display
from meltemi.environment.site import STANDARD
from meltemi.turbine.definition import Turbine
from meltemi.validation.channel_map import Sensor
from meltemi.validation.gauges import GRAVITY, first_moment
from meltemi.validation.issues import DataIssue
from meltemi.validation.measurements import Float, Measurements, Signal
from meltemi.validation.quality import HALF_HOUR, clock_lag
from meltemi.validation.selection import rated_rotor_speed

RATIOS = {
    "W": (1e3, 1e-3, 1e6),
    "N m": (1e3, 1e-3, 1e6),
    "rad/s": (np.pi / 30.0, 30.0 / np.pi),
    "rad": (np.pi / 180.0, 180.0 / np.pi),
    "m/s": (1.0 / 3.6, 0.5144, 0.447),
}
"""Factors between units that are confused, by SI unit."""
MINUTE = 60.0
"""[s] over which wind and power are averaged."""
RELATED = 0.3
"""Correlation of wind and power in partial load below which they are not of one turbine."""
CLOSELY = 0.7
"""Correlation from which on a lag explains what does not fit."""
POWER_COEFFICIENT = 0.4
"""For the power that a wind speed lets expect."""


def ranges(turbine: Turbine) -> dict[str, tuple[float, float]]:
    """Least and largest magnitude, SI, of the 95 % quantile of channels in operation; wide: errors are factors."""
    omega, power = rated_rotor_speed(turbine), turbine.rated_power
    ratio, radius = turbine.drivetrain.gear_ratio, turbine.rotor_radius
    thrust = power / 5.0  # at a speed of 10 m/s and half of it lost to the wake
    blade = max(GRAVITY * first_moment(turbine)[2], thrust * radius / 2.0 / turbine.n_blades)
    limits = {
        "generator_power": (0.005 * power, 2.0 * power),
        "rotor_speed": (0.2 * omega, 2.0 * omega),
        "generator_speed": (0.2 * omega * ratio, 2.0 * omega * ratio),
        "generator_torque": (0.005 * power / omega / ratio, 5.0 * power / omega / ratio),
        "tower_base_moment_fore_aft": (1e-3 * thrust * turbine.hub_height, 10.0 * thrust * turbine.hub_height),
    }
    for b in range(1, turbine.n_blades + 1):
        limits[f"pitch_{b}"] = (0.0, np.pi)
        for name in ("flap", "edge", "out_of_plane", "in_plane"):
            limits[f"root_moment_{name}_{b}"] = (0.005 * blade, 10.0 * blade)
    return limits


def plausible(measurements: Measurements, turbine: Turbine) -> list[DataIssue]:
    """Issues of units, signs and origin, one sentence each.

    Raises:
      MissingPackageError: pandas is not installed.
    """
    limits = ranges(turbine) | {measurements.channels.wind: (0.0, 60.0)}
    turns = _size(measurements, "rotor_speed") > 0.2 * rated_rotor_speed(turbine)
    produces = _size(measurements, "generator_power") > 0.05 * turbine.rated_power
    issues: list[DataIssue] = []
    for series in measurements.loggers:
        for name, sensor in measurements.channels.loggers[series.name].channels.items():
            if name in limits and len(series[name].finite):
                low, high = limits[name]
                least = low if (produces if name == "rotor_speed" else turns) else 0.0
                texts = {
                    "unit": _unit(series[name], sensor, least, high),
                    "sign": _sign(measurements, name, series[name], sensor.column, high),
                }
                issues += [series.issue(kind, name, text) for kind, text in texts.items() if text]
    return [*issues, *_origin(measurements, turbine)]


def _size(measurements: Measurements, name: str) -> float:
    """95 % quantile of the magnitude of a channel; infinite where there is none, so that nothing is concluded."""
    present = measurements.having(name)
    x = np.concatenate([series[name].finite for series in present]) if present else np.array([np.inf])
    return float(np.quantile(np.abs(x), 0.95)) if len(x) else 0.0


def _unit(signal: Signal, sensor: Sensor, low: float, high: float) -> str:
    """What is wrong with a channel whose magnitude is that of another unit."""
    size, ratios = float(np.quantile(np.abs(signal.finite), 0.95)), RATIOS.get(sensor.si[0])
    if low <= size <= high or not ratios:
        return ""
    unit, factor = display(sensor.si[0])
    fitting = [ratio for ratio in ratios if low <= size * ratio <= high]
    expected = f"at most {high * factor:.3g} {unit}" if size > high else f"at least {low * factor:.3g} {unit}"
    remedy = f"times {fitting[0]:.4g} it would fit; correct unit or gain" if fitting else "choose another column"
    return (
        f"column {sensor.column!r} in {sensor.unit} reaches {size * factor:.3g} {unit}, expected of this turbine is "
        f"{expected}; {remedy}"
    )


def _sign(measurements: Measurements, name: str, signal: Signal, column: str, high: float) -> str:
    """What is wrong with a channel whose positive direction is the other one."""
    positive = ("generator_power", "rotor_speed", "generator_speed", "generator_torque", measurements.channels.wind)
    if name in positive and np.mean(signal.finite) < -0.005 * high:
        return f"column {column!r} is negative, expected is positive in operation; give sign: -1"
    bends = name.startswith(("root_moment_flap", "root_moment_out_of_plane", "tower_base_moment_fore_aft"))
    if bends and (machine := measurements.having("generator_power")):
        x, p = _minutes(signal, machine[0]["generator_power"])
        partial = p < 0.8 * np.max(p, initial=0.0)
        if partial.sum() >= 8 and np.corrcoef(x[partial], p[partial])[0, 1] < -0.5:
            return f"column {column!r} falls where power grows, expected is a moment of thrust; give sign: -1"
    return ""


def _origin(measurements: Measurements, turbine: Turbine) -> list[DataIssue]:
    """Wind and power that do not belong together, or not at the same time."""
    name = measurements.channels.wind
    if not (masts := measurements.having(name)) or not (machines := measurements.having("generator_power")):
        return []
    mast, machine = masts[0], machines[0]
    wind, power = mast[name], machine["generator_power"]
    v, p = _minutes(wind, power)
    expected = 0.5 * STANDARD * np.pi * turbine.rotor_radius**2 * POWER_COEFFICIENT * np.maximum(v, 0.0) ** 3
    partial = (expected < 0.8 * turbine.rated_power) & (p > 0.01 * turbine.rated_power) & (v > turbine.cut_in)
    if partial.sum() < 10:
        return []
    ratio = float(np.median(p[partial] / expected[partial]))
    related = float(np.corrcoef(v[partial], p[partial])[0, 1])
    if related >= RELATED and 0.2 < ratio < 3.0:
        return []
    column = measurements.channels.loggers[mast.name].channels[name].column
    if mast is not machine and np.ptp(wind.time) > HALF_HOUR:
        lag, best = clock_lag(wind, power, 0.1, 2.5 * HALF_HOUR)
        if best > max(related + 0.3, CLOSELY) and abs(lag.mean) > 5.0 * MINUTE:
            shift = f"{abs(lag.mean) / 60.0:.0f} min {'earlier' if lag.mean > 0.0 else 'later'}"
            text = (
                f"logger {machine.name!r} fits the wind of column {column!r} best when it is {shift} "
                f"(correlation {best:.2f} instead of {related:.2f}); correct zone, stamp or clock"
            )
            return [machine.issue("clock", "generator_power", text)]
    text = (
        f"column {column!r}: correlation with power in partial load {related:.2f}, expected at least {RELATED:g}; "
        f"power {ratio:.2g} of that of this wind, expected 0.2 to 3: probably wind of another turbine; choose its own"
    )
    return [mast.issue("turbine", name, text)]


def _minutes(a: Signal, b: Signal) -> tuple[Float, Float]:
    """Means of two signals over the minutes in which both have samples."""
    need("plausibility of measurements", "pandas")
    import pandas as pd

    means = [pd.Series(signal.values).groupby(signal.time // MINUTE).mean().dropna() for signal in (a, b)]
    x, y = pd.concat(means, axis=1, join="inner").to_numpy().T
    return x, y
