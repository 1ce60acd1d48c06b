"""Plausibility of measurements for a turbine: units, signs, the wind of another turbine, clocks of wind and power."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from meltemi.core.units import display
from meltemi.environment.site import STANDARD
from meltemi.turbine.definition import Turbine
from meltemi.validation.channel_map import ChannelMap, Sensor
from meltemi.validation.gauges import GRAVITY, first_moment
from meltemi.validation.issues import DataIssue, issue_of_all
from meltemi.validation.measurements import Float, MeasuredRecord, Signal, joined
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
    thrust, blades = power / 5.0, range(1, turbine.n_blades + 1)  # at 10 m/s, half of it lost to the wake
    root = 2.0 * max(GRAVITY * first_moment(turbine)[2], thrust * turbine.rotor_radius / 2.0 / turbine.n_blades)
    loads = {f"root_moment_{name}_{b}": root for name in ("flap", "edge", "out_of_plane", "in_plane") for b in blades}
    loads |= {"generator_power": power, "generator_torque": power / omega / ratio}
    loads |= {"tower_base_moment_fore_aft": thrust * turbine.hub_height}
    speeds = {"rotor_speed": omega, "generator_speed": omega * ratio}
    limits = {name: (0.005 * size, 5.0 * size) for name, size in loads.items()}
    limits |= {name: (0.2 * size, 2.0 * size) for name, size in speeds.items()}
    return limits | {f"pitch_{b}": (0.0, np.pi) for b in blades}


def plausible(records: Sequence[MeasuredRecord], channels: ChannelMap, turbine: Turbine) -> list[DataIssue]:
    """Issues of units, signs and origin, one sentence each."""
    if not records:
        return []
    limits = ranges(turbine) | {channels.wind: (0.0, 60.0)}
    sensors = {name: sensor for name, _, sensor in channels.sensors() if name in limits}
    signals = {name: signal for name in sensors if len((signal := joined(records, name)).finite)}
    sizes = {name: float(np.quantile(np.abs(signal.finite), 0.95)) for name, signal in signals.items()}
    power, wind = signals.get("generator_power"), signals.get(channels.wind)
    # without speed and power nothing is concluded from small magnitudes
    turns = sizes.get("rotor_speed", np.inf) > 0.2 * rated_rotor_speed(turbine)
    produces = sizes.get("generator_power", np.inf) > 0.05 * turbine.rated_power
    issues: list[DataIssue] = []
    for name, signal in signals.items():
        sensor, (low, high) = sensors[name], limits[name]
        low = low if (produces if name == "rotor_speed" else turns) else 0.0
        texts = {"unit": _unit(sensor, sizes[name], low, high), "sign": _sign(name, signal, high, power)}
        issues += [issue_of_all(kind, records, name, f"column {sensor.label!r} {x}") for kind, x in texts.items() if x]
    if wind and power:
        issues += _origin(records, channels, turbine, wind, power)
    return issues


def _unit(sensor: Sensor, size: float, low: float, high: float) -> str:
    """What is wrong with a channel whose magnitude is that of another unit."""
    ratios = RATIOS.get(sensor.si[0])
    if low <= size <= high or not ratios:
        return ""
    unit, factor = display(sensor.si[0])
    fitting = [ratio for ratio in ratios if low <= size * ratio <= high]
    expected = f"at most {high * factor:.3g} {unit}" if size > high else f"at least {low * factor:.3g} {unit}"
    remedy = f"times {fitting[0]:.4g} it would fit; correct unit or gain" if fitting else "choose another column"
    return f"in {sensor.unit} reaches {size * factor:.3g} {unit}, expected of this turbine is {expected}; {remedy}"


def _sign(name: str, signal: Signal, high: float, power: Signal | None) -> str:
    """What is wrong with a channel whose positive direction is the other one."""
    bends = name.startswith(("root_moment_flap", "root_moment_out", "tower_base_moment_fore"))
    if bends and power:
        x, p = _minutes(signal, power)
        partial = p < 0.8 * np.max(p, initial=0.0)
        if partial.sum() >= 8 and np.corrcoef(x[partial], p[partial])[0, 1] < -0.5:
            return "falls where power grows, expected is a moment of thrust; give sign: -1"
    elif not name.startswith(("root_", "tower_", "pitch_")) and np.mean(signal.finite) < -0.005 * high:
        return "is negative, expected is positive in operation; give sign: -1"
    return ""


def _origin(
    records: Sequence[MeasuredRecord], channels: ChannelMap, turbine: Turbine, wind: Signal, power: Signal
) -> Iterator[DataIssue]:
    """Wind and power that do not belong together, or not at the same time."""
    v, p = _minutes(wind, power)
    expected = 0.5 * STANDARD * np.pi * turbine.rotor_radius**2 * POWER_COEFFICIENT * np.maximum(v, 0.0) ** 3
    partial = (expected < 0.8 * turbine.rated_power) & (p > 0.01 * turbine.rated_power) & (v > turbine.cut_in)
    if partial.sum() < 10:
        return
    ratio = float(np.median(p[partial] / expected[partial]))
    related = float(np.corrcoef(v[partial], p[partial])[0, 1])
    if related >= RELATED and 0.2 < ratio < 3.0:
        return
    places = {name: (logger, sensor.label) for name, logger, sensor in channels.sensors()}
    (logger, column), (machine, _) = places[channels.wind], places["generator_power"]
    if logger != machine and np.ptp(wind.time) > HALF_HOUR:
        lag, best = clock_lag(wind, power, 0.1, 2.5 * HALF_HOUR)
        if best > max(related + 0.3, CLOSELY) and abs(lag) > 5.0 * MINUTE:
            shift = f"{abs(lag) / 60.0:.0f} min {'earlier' if lag > 0.0 else 'later'}"
            text = (
                f"logger {machine!r} fits the wind of column {column!r} best when it is {shift} (correlation "
                f"{best:.2f} instead of {related:.2f}); correct zone, stamp or clock"
            )
            yield issue_of_all("clock", records, "generator_power", text)
            return
    text = (
        f"column {column!r}: correlation with power in partial load {related:.2f}, expected at least {RELATED:g}; "
        f"power {ratio:.2g} of that of this wind, expected 0.2 to 3: probably wind of another turbine; choose its own"
    )
    yield issue_of_all("turbine", records, channels.wind, text)


def _minutes(a: Signal, b: Signal) -> tuple[Float, Float]:
    """Means of two signals over the minutes in which both have samples."""
    import pandas as pd

    means = [pd.Series(signal.values).groupby(signal.time // MINUTE).mean().dropna() for signal in (a, b)]
    x, y = pd.concat(means, axis=1, join="inner").to_numpy().T
    return x, y
