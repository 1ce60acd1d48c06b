"""Plausibility of measurements for a turbine: units, signs, the wind of another turbine, clocks of wind and power."""

from __future__ import annotations

import numpy as np

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
MINUTE = 60.0  # [s] over which wind and power are averaged
RELATED = 0.3  # correlation of wind and power in partial load below which they are not of one turbine
CLOSELY = 0.7  # correlation from which on a lag explains what does not fit
POWER_COEFFICIENT = 0.4  # for the power that a wind speed lets expect


def ranges(turbine: Turbine) -> dict[str, tuple[float, float]]:
    """Least and largest magnitude, SI, of the 95 % quantile of channels in operation; wide: errors are factors."""
    omega, power, ratio = rated_rotor_speed(turbine), turbine.rated_power, turbine.drivetrain.gear_ratio
    thrust, torque = power / 5.0, power / omega / ratio  # at a speed of 10 m/s and half of it lost to the wake
    tower = thrust * turbine.hub_height
    blade = max(GRAVITY * first_moment(turbine)[2], thrust * turbine.rotor_radius / 2.0 / turbine.n_blades)
    limits = {
        "generator_power": (0.005 * power, 2.0 * power),
        "rotor_speed": (0.2 * omega, 2.0 * omega),
        "generator_speed": (0.2 * omega * ratio, 2.0 * omega * ratio),
        "generator_torque": (0.005 * torque, 5.0 * torque),
        "tower_base_moment_fore_aft": (1e-3 * tower, 10.0 * tower),
    }
    for b in range(1, turbine.n_blades + 1):
        roots = [f"root_moment_{name}_{b}" for name in ("flap", "edge", "out_of_plane", "in_plane")]
        limits |= {f"pitch_{b}": (0.0, np.pi), **dict.fromkeys(roots, (0.005 * blade, 10.0 * blade))}
    return limits


def plausible(measurements: Measurements, turbine: Turbine) -> list[DataIssue]:
    """Issues of units, signs and origin, one sentence each."""
    limits = ranges(turbine) | {measurements.channels.wind: (0.0, 60.0)}
    present = [(s, name) for s in measurements.loggers for name in s.values if name in limits and len(s[name].finite)]
    sizes = {(s.name, name): float(np.quantile(np.abs(s[name].finite), 0.95)) for s, name in present}

    def largest(name: str) -> float:
        """Without the channel nothing is concluded."""
        return max((size for (_, each), size in sizes.items() if each == name), default=np.inf)

    turns = largest("rotor_speed") > 0.2 * rated_rotor_speed(turbine)
    produces = largest("generator_power") > 0.05 * turbine.rated_power
    issues: list[DataIssue] = []
    for series, name in present:
        sensor, (low, high) = measurements.channels.loggers[series.name].channels[name], limits[name]
        running = produces if name == "rotor_speed" else turns
        if text := _unit(sensor, sizes[series.name, name], low if running else 0.0, high):
            issues.append(series.issue("unit", name, text))
        if text := _sign(measurements, name, series[name], high):
            issues.append(series.issue("sign", name, f"column {sensor.column!r} {text}; give sign: -1"))
    return [*issues, *_origin(measurements, turbine)]


def _unit(sensor: Sensor, size: float, low: float, high: float) -> str:
    """What is wrong with a channel whose magnitude is that of another unit."""
    ratios = RATIOS.get(sensor.si[0])
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


def _sign(measurements: Measurements, name: str, signal: Signal, high: float) -> str:
    """What is wrong with a channel whose positive direction is the other one."""
    if name in ("generator_power", "rotor_speed", "generator_speed", "generator_torque", measurements.channels.wind):
        return "is negative, expected is positive in operation" if np.mean(signal.finite) < -0.005 * high else ""
    machine = measurements.having("generator_power")
    if not machine or not name.startswith(("root_moment_flap", "root_moment_out", "tower_base_moment_fore")):
        return ""
    x, p = _minutes(signal, machine[0]["generator_power"])
    partial = p < 0.8 * np.max(p, initial=0.0)
    opposite = partial.sum() >= 8 and np.corrcoef(x[partial], p[partial])[0, 1] < -0.5
    return "falls where power grows, expected is a moment of thrust" if opposite else ""


def _origin(measurements: Measurements, turbine: Turbine) -> list[DataIssue]:
    """Wind and power that do not belong together, or not at the same time."""
    name = measurements.channels.wind
    if not (masts := measurements.having(name)) or not (machines := measurements.having("generator_power")):
        return []
    wind, power = masts[0][name], machines[0]["generator_power"]
    v, p = _minutes(wind, power)
    expected = 0.5 * STANDARD * np.pi * turbine.rotor_radius**2 * POWER_COEFFICIENT * np.maximum(v, 0.0) ** 3
    partial = (expected < 0.8 * turbine.rated_power) & (p > 0.01 * turbine.rated_power) & (v > turbine.cut_in)
    if partial.sum() < 10:
        return []
    ratio = float(np.median(p[partial] / expected[partial]))
    related = float(np.corrcoef(v[partial], p[partial])[0, 1])
    if related >= RELATED and 0.2 < ratio < 3.0:
        return []
    column = measurements.channels.loggers[masts[0].name].channels[name].column
    if masts[0] is not machines[0] and np.ptp(wind.time) > HALF_HOUR:
        lag, best = clock_lag(wind, power, 0.1, 2.5 * HALF_HOUR)
        if best > max(related + 0.3, CLOSELY) and abs(lag.mean) > 5.0 * MINUTE:
            text = (
                f"logger {machines[0].name!r} fits the wind of column {column!r} best when it is "
                f"{abs(lag.mean) / 60.0:.0f} min {'earlier' if lag.mean > 0.0 else 'later'} "
                f"(correlation {best:.2f} instead of {related:.2f}); correct zone, stamp or clock"
            )
            return [machines[0].issue("clock", "generator_power", text)]
    text = (
        f"column {column!r}: correlation with power in partial load {related:.2f}, expected at least {RELATED:g}; "
        f"power {ratio:.2g} of that of this wind, expected 0.2 to 3: probably wind of another turbine; choose its own"
    )
    return [masts[0].issue("turbine", name, text)]


def _minutes(a: Signal, b: Signal) -> tuple[Float, Float]:
    """Means of two signals over the minutes in which both have samples."""
    import pandas as pd

    means = [pd.Series(signal.values).groupby(signal.time // MINUTE).mean().dropna() for signal in (a, b)]
    x, y = pd.concat(means, axis=1, join="inner").to_numpy().T
    return x, y
