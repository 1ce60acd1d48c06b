"""Plausibility of measurements for a turbine: units, signs, the wind of another turbine, clocks of wind and power."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import InputError
from meltemi.core.units import display
from meltemi.environment.site import STANDARD
from meltemi.turbine.definition import Turbine
from meltemi.validation.gauges import GRAVITY, first_moment
from meltemi.validation.issues import DataIssue
from meltemi.validation.measurements import LoggerSeries, Measurements, Signal
from meltemi.validation.quality import HALF_HOUR, clock_lag
from meltemi.validation.selection import rated_rotor_speed

Float = NDArray[np.float64]

RATIOS = {
    "W": (1e3, 1e-3, 1e6),
    "N m": (1e3, 1e-3, 1e6),
    "rad/s": (np.pi / 30.0, 30.0 / np.pi),
    "rad": (np.pi / 180.0, 180.0 / np.pi),
    "m/s": (1.0 / 3.6, 0.5144, 0.447),
}
"""Factors between units that are confused, by SI unit."""
BLOCK = 60.0
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
    """Issues of units, signs and origin, one sentence each."""
    limits = ranges(turbine)
    limits[measurements.channels.wind] = (0.0, 60.0)
    turns = _size(measurements, "rotor_speed") > 0.2 * rated_rotor_speed(turbine)
    produces = _size(measurements, "generator_power") > 0.05 * turbine.rated_power
    issues: list[DataIssue] = []
    for series in measurements.loggers:
        for name in series.values:
            if name in limits and np.any(np.isfinite(series.values[name])):
                low, high = limits[name]
                running = produces if name == "rotor_speed" else turns
                issues += _unit(measurements, series, name, (low if running else 0.0, high))
                issues += _sign(measurements, series, name, high)
    return [*issues, *_origin(measurements, turbine)]


def require_plausible(measurements: Measurements, turbine: Turbine) -> None:
    """Refuse measurements with issues of :func:`plausible`.

    Raises:
      InputError: with all sentences.
    """
    if issues := plausible(measurements, turbine):
        raise InputError("\n".join(map(str, issues)))


def _size(measurements: Measurements, name: str) -> float:
    """95 % quantile of the magnitude of a channel; infinite where there is none, so that nothing is concluded."""
    present = [s.values[name] for s in measurements.loggers if name in s.values]
    x = np.concatenate([x[np.isfinite(x)] for x in present]) if present else np.array([np.inf])
    return float(np.quantile(np.abs(x), 0.95)) if len(x) else 0.0


def _issue(kind: str, series: LoggerSeries, name: str, text: str) -> DataIssue:
    return DataIssue(
        kind, series.files[0], name, float(series.time[0]), len(series.time) / series.rate, len(series.time), text
    )


def _unit(
    measurements: Measurements, series: LoggerSeries, name: str, limits: tuple[float, float]
) -> Iterator[DataIssue]:
    """A channel whose magnitude is that of another unit."""
    x, sensor = series.values[name], measurements.channels.loggers[series.name].sensors[name]
    size, (low, high) = float(np.nanquantile(np.abs(x), 0.95)), limits
    if low <= size <= high or sensor.si[0] not in RATIOS:
        return
    unit, factor = display(sensor.si[0])
    fitting = [r for r in RATIOS[sensor.si[0]] if low <= size * r <= high]
    expected = f"at most {high * factor:.3g} {unit}" if size > high else f"at least {low * factor:.3g} {unit}"
    remedy = (
        f"times {fitting[0]:.4g} it would fit; correct unit or gain" if fitting else "choose another column or turbine"
    )
    text = (
        f"column {sensor.column!r} in {sensor.unit} reaches {size * factor:.3g} {unit}, expected of this turbine is "
        f"{expected}; {remedy}"
    )
    yield _issue("unit", series, name, text)


def _sign(measurements: Measurements, series: LoggerSeries, name: str, high: float) -> Iterator[DataIssue]:
    """A channel whose positive direction is the other one."""
    column = measurements.channels.loggers[series.name].sensors[name].column
    mean = float(np.nanmean(series.values[name]))
    positive = ("generator_power", "rotor_speed", "generator_speed", "generator_torque", measurements.channels.wind)
    if name in positive and mean < -0.005 * high:
        yield _issue(
            "sign", series, name, f"column {column!r} is negative, expected is positive in operation; give sign: -1"
        )
    bends = name.startswith(("root_moment_flap", "root_moment_out_of_plane", "tower_base_moment_fore_aft"))
    if bends and any("generator_power" in s.values for s in measurements.loggers):
        power = measurements.signals("generator_power")[0][1]
        x, p = _blocks(Signal(series.time, series.values[name]), power)
        partial = p < 0.8 * np.max(p, initial=0.0)
        if partial.sum() >= 8 and np.corrcoef(x[partial], p[partial])[0, 1] < -0.5:
            text = f"column {column!r} falls where power grows, expected is a moment of thrust; give sign: -1"
            yield _issue("sign", series, name, text)


def _origin(measurements: Measurements, turbine: Turbine) -> Iterator[DataIssue]:
    """Wind and power that do not belong together, or not at the same time."""
    wind_name, power_name = measurements.channels.wind, "generator_power"
    if not all(any(name in s.values for s in measurements.loggers) for name in (wind_name, power_name)):
        return
    (series, wind), (other, power) = measurements.signals(wind_name)[0], measurements.signals(power_name)[0]
    v, p = _blocks(wind, power)
    expected = 0.5 * STANDARD * np.pi * turbine.rotor_radius**2 * POWER_COEFFICIENT * np.maximum(v, 0.0) ** 3
    partial = (expected < 0.8 * turbine.rated_power) & (p > 0.01 * turbine.rated_power) & (v > turbine.cut_in)
    if partial.sum() < 10:
        return
    ratio = float(np.median(p[partial] / expected[partial]))
    related = float(np.corrcoef(v[partial], p[partial])[0, 1])
    if related >= RELATED and 0.2 < ratio < 3.0:
        return
    column = measurements.channels.loggers[series.name].sensors[wind_name].column
    if series.name != other.name and float(np.max(wind.time) - np.min(wind.time)) > HALF_HOUR:
        lag, best = clock_lag(wind, power, 0.1, 2.5 * HALF_HOUR)
        if best > max(related + 0.3, CLOSELY) and abs(lag.mean) > 5.0 * BLOCK:
            shift = f"{abs(lag.mean) / 60.0:.0f} min {'earlier' if lag.mean > 0.0 else 'later'}"
            text = (
                f"logger {other.name!r} fits the wind of column {column!r} best when it is {shift} "
                f"(correlation {best:.2f} instead of {related:.2f}); correct zone, stamp or clock"
            )
            yield _issue("clock", other, power_name, text)
            return
    text = (
        f"column {column!r}: correlation with power in partial load {related:.2f}, expected at least {RELATED:g}; "
        f"power {ratio:.2g} of that of this wind, expected 0.2 to 3: probably wind of another turbine; choose its own"
    )
    yield _issue("turbine", series, wind_name, text)


def _blocks(a: Signal, b: Signal) -> tuple[Float, Float]:
    """Means of two signals over the same minutes in which both have samples."""
    means = []
    for signal in (a, b):
        there = np.isfinite(signal.values)
        block = np.floor(signal.time[there] / BLOCK).astype(np.int64)
        keys, place = np.unique(block, return_inverse=True)
        means.append(
            (keys, np.bincount(place, signal.values[there], len(keys)) / np.bincount(place, minlength=len(keys)))
        )
    _, i, j = np.intersect1d(means[0][0], means[1][0], return_indices=True)
    return means[0][1][i], means[1][1][j]
