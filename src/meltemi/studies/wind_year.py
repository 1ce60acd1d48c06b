"""Parts of a year of wind at 1 s: exceedances of the yaw-error threshold, and energy of each strategy.

The yaw control and the threshold of the supervisor run at 1 Hz in a synthetic wind; the turbine is represented by its
steady power curve. Directions change for four reasons:

* turbulence: lateral velocities of 0.8 of the longitudinal ones, with the length scales of IEC 61400-1 and the
  intensity of the site at that wind speed;
* meandering: lateral velocities of 0.6 m/s over twenty minutes at any wind speed, so that light winds turn most
  (after Mahrt 2011, J. Appl. Meteorol. Climatol. 50, 144-152);
* weather: the mean direction drifts within a day;
* fronts: fast turns of 30 to 120 degrees within 10 to 60 s, with a rise of up to 15 m/s that fades within ten minutes.
  No statistics are available; their number per year is varied.

The mean wind has a Rayleigh distribution and changes within hours.

The functions are compiled anew in every process: the kernel cache does not include studies.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from meltemi.compiler import njit
from meltemi.control.signals import Measurements
from meltemi.control_laws.sensors import normal, philox
from meltemi.control_laws.yaw import YawControl, YawControlState, wrap, yaw_settings, yaw_step
from meltemi.loadcases.batch import Piece
from meltemi.simulation.bladed.rotor import BladedModel
from meltemi.simulation.trim import operating_point
from meltemi.studies.yaw_limits import BasePoints
from meltemi.supervisor.threshold import YawProtection, YawThreshold, threshold
from meltemi.tuning.run_store import FailedResult, FailedResultError, attempt, completed, resumed
from meltemi.turbine.definition import Turbine

Float = NDArray[np.float64]
DAY, HOUR = 86400.0, 3600.0
YEAR = 365.0 * DAY
"""[s] seconds of a year."""
QUARTER = 91.25
"""[days] length of a part."""
WEATHER, DRIFT = 8.0 * HOUR, 24.0 * HOUR
"""[s] time scales of mean speed and mean direction."""
MEANDER, MEANDER_TIME = 0.6, 1200.0
"""[m/s], [s]."""
LENGTH_U, LENGTH_V = 340.0, 113.0
"""[m] integral scales of IEC 61400-1 ed. 3 for hubs above 60 m: 8.1 and 2.7 times 42 m."""
FRONTS = (0, 50, 200)
"""A year."""
COSINE = 2.0
"""Power goes with this power of the cosine of the yaw error below rated."""
DOWN_TIME = 600.0
"""[s] time from the stop of a turbine to production, if the yaw error permits."""
WINDOW = 30
"""[s] averaging time of the mean wind."""
IGNORE, STOP, DERATE = range(3)
STRATEGIES = {"S3": IGNORE, "S1": STOP, "S2": DERATE}
PRODUCING, DERATED, DOWN, IGNORING = range(4)
"""States of a turbine."""


@dataclass(frozen=True)
class WindSite:
    """Wind of a site at hub height.

    Attributes:
      mean: [m/s] annual mean.
      speed, intensity: (n,) [m/s], [-] turbulence intensity over wind speed.
    """

    mean: float
    speed: Float
    intensity: Float


@dataclass(frozen=True)
class StrategyYear:
    """Results of a strategy in a part of a year, extrapolated to a year.

    Attributes:
      strategy: name of the strategy.
      fronts: number of fronts.
      seed: seed of the wind.
      energy: [J] produced energy.
      stopped: [J] energy produced by S1 in the same wind.
      exceeded: number of exceedances of the threshold in production.
      derates, stops: numbers of deratings and stops.
      down: [s] downtime after stops.
    """

    strategy: str
    fronts: int
    seed: int
    energy: float
    stopped: float
    exceeded: float
    derates: float
    stops: float
    down: float

    @property
    def available(self) -> float:
        """Share of the year without downtime after stops."""
        return 1.0 - self.down / YEAR


@dataclass(frozen=True)
class PowerCurve:
    """Steady electrical power.

    Attributes:
      speed, power: [m/s], [W] curve up to rated power.
      cut_in, cut_out: [m/s] cut-in and cut-out wind speed.
      rated: [W] rated power.
    """

    speed: Float
    power: Float
    cut_in: float
    cut_out: float
    rated: float


def power_curve(model: BladedModel) -> PowerCurve:
    """Power curve of a turbine from cut-in to rated wind speed."""
    turbine = model.turbine
    speeds, powers = [], []
    for speed in np.arange(math.ceil(turbine.cut_in + 0.5), turbine.cut_out, 0.75):
        point = attempt(f"power curve at {speed:g} m/s", operating_point, model, float(speed))
        if isinstance(point, FailedResult):
            continue  # interpolated from its neighbours
        speeds.append(float(speed))
        powers.append(point["generator_power"])
        if powers[-1] > 0.999 * turbine.rated_power:
            break
    if not powers:
        raise FailedResultError("power curve: no wind speed has a steady operating point")
    first = powers[0] * (turbine.cut_in / speeds[0]) ** 3
    curve = np.array([turbine.cut_in, *speeds]), np.array([first, *powers])
    return PowerCurve(*curve, turbine.cut_in, turbine.cut_out, turbine.rated_power)


@njit(nogil=True)  # type: ignore[untyped-decorator]
def uniform(count: int, stream: int, seed: int) -> float:
    """Uniform random number between 0 and 1 by hashing a key."""
    return (philox(count, stream, seed)[0] + 0.5) / 4294967296.0


@njit(nogil=True)  # type: ignore[untyped-decorator]
def next_value(x: float, time: float, number: float) -> float:
    """Next value, after 1 s, of a Gaussian process with unit variance and exponential autocorrelation of a time [s]."""
    a = math.exp(-1.0 / time)
    return a * x + math.sqrt(1.0 - a * a) * number


@njit(nogil=True)  # type: ignore[untyped-decorator]
def simulate_year(  # noqa: PLR0913, PLR0915 - a year in one kernel: no records, no calls
    seconds: int,
    seed: int,
    fronts: float,
    curve_speed: Float,
    curve_power: Float,
    cut_out: float,
    mean_wind: float,
    site_speed: Float,
    site_intensity: Float,
    strategy: int,
    base: YawThreshold,
    power_limit: float,
    recheck: float,
    yaw: YawControlState,
    measured_now: Measurements,
    totals: Float,
) -> None:
    """Simulate the year second by second.

    Args:
      fronts: rate of fronts per second.
      strategy: ``IGNORE``, ``STOP``, or ``DERATE`` and recheck.
      base: law and base points of the threshold.
      yaw: settings of the yaw control.
      measured_now: present measurements of the sensors.
      totals: output: energy [J], exceedances, deratings, stops, downtime [s].
    """
    ring = np.full(WINDOW, mean_wind)
    mean, drift, along, across, meander = 0.0, 0.0, 0.0, 0.0, 0.0
    turned, turning, turn_left, rise, rising = 0.0, 0.0, 0.0, 0.0, 0.0
    nacelle, state, timer = 0.0, PRODUCING, 0.0
    total = WINDOW * mean_wind
    for k in range(seconds):
        mean = next_value(mean, WEATHER, normal(k, 0, seed))
        drift = next_value(drift, DRIFT, normal(k, 1, seed))
        share = 0.5 * math.erfc(mean / math.sqrt(2.0))
        speed = max(mean_wind * math.sqrt(-4.0 / math.pi * math.log(max(share, 1e-12))), 0.3)
        along = next_value(along, LENGTH_U / speed, normal(k, 2, seed))
        across = next_value(across, LENGTH_V / speed, normal(k, 3, seed))
        meander = next_value(meander, MEANDER_TIME, normal(k, 4, seed))
        if turn_left <= 0.0 and uniform(k, 5, seed) < fronts:
            turn_left = 10.0 + 50.0 * uniform(k, 6, seed)
            size = math.radians(30.0 + 90.0 * uniform(k, 7, seed))
            turning = (size if uniform(k, 8, seed) < 0.5 else -size) / turn_left
            rising = 15.0 * uniform(k, 9, seed) / turn_left
        if turn_left > 0.0:
            turned, rise, turn_left = turned + turning, rise + rising, turn_left - 1.0
        rise *= math.exp(-1.0 / 600.0)
        deviation = np.interp(speed, site_speed, site_intensity) * speed
        u = max(speed + deviation * along + rise, 0.1)
        v = 0.8 * deviation * across + MEANDER * meander
        direction = 1.5 * drift + turned + math.atan2(v, u)
        wind = math.hypot(u, v)

        total += wind - ring[k % WINDOW]
        ring[k % WINDOW] = wind
        measured_now.wind_speed, measured_now.wind_direction, measured_now.yaw = wind, direction, nacelle
        rate = yaw_step(yaw, measured_now, 1.0)
        limit = threshold(base, total / WINDOW)
        over = abs(yaw.filtered) > limit
        nacelle += rate
        error = wrap(direction + nacelle)
        facing = max(math.cos(error), 0.0)
        power = 0.0
        if curve_speed[0] <= wind <= cut_out:
            power = np.interp(wind * facing ** (COSINE / 3.0), curve_speed, curve_power) if facing > 0.0 else 0.0
        has_wind = total / WINDOW >= curve_speed[0]
        if state == PRODUCING and over and has_wind:
            totals[1] += 1.0
            if strategy == STOP:
                state, timer = DOWN, 0.0
                totals[3] += 1.0
            elif strategy == DERATE:
                state, timer = DERATED, 0.0
                totals[2] += 1.0
            else:
                state = IGNORING
        elif state == IGNORING and not over:
            state = PRODUCING
        elif state == DERATED:
            timer += 1.0
            power = min(power, power_limit)
            if timer >= recheck:
                state, timer = (DOWN if over else PRODUCING), 0.0
                totals[3] += 1.0 if over else 0.0
        elif state == DOWN:
            timer += 1.0
            power = 0.0
            totals[4] += 1.0
            if timer >= DOWN_TIME and not over:
                state = PRODUCING
        totals[0] += power


def a_year(
    turbine: Turbine,
    curve: PowerCurve,
    ours: BasePoints,
    site: WindSite,
    *,
    days: float = QUARTER,
    fronts: Sequence[int] = FRONTS,
    seeds: Sequence[int] = (1, 2, 3, 4),
    workers: int | None = None,
) -> tuple[StrategyYear, ...]:
    """Results of all strategies and numbers of fronts per year, by seed in the same wind.

    Args:
      ours: base points in addition to those of Wang et al. (2021), whose S1 has the stepwise threshold.
      site: wind of the site.
      days: days of each part.
      fronts: numbers of fronts per year.
      seeds: one for each part.
      workers: number of threads.
    """
    paper = YawProtection()
    first = (paper.wind_speeds, paper.thresholds)
    kinds = {
        "S1": ("S1", first),
        "S1 interpolated": ("S1", first),
        "S2": ("S2", first),
        "S2 ours": ("S2", ours),
        "S3": ("S3", first),
    }

    def one(number: int, seed: int, name: str) -> Float:
        kind, base = kinds[name]
        values = np.zeros(5)
        simulate_year(
            round(days * DAY),
            seed,
            number / YEAR,
            curve.speed,
            curve.power,
            curve.cut_out,
            site.mean,
            site.speed,
            site.intensity,
            STRATEGIES[kind],
            YawThreshold.of(stepwise=name == "S1", wind_speed=base[0], threshold=base[1]),
            2.0 / 3.0 * curve.rated,
            paper.recheck_time,
            yaw_settings(YawControl(), turbine.yaw),
            Measurements.of(),
            values,
        )
        return values

    year = 365.0 / days
    keys = [(number, seed, name) for number in fronts for seed in seeds for name in kinds]
    pieces = [Piece("{} fronts, seed {}, {}".format(*key), partial(one, *key)) for key in keys]
    values_of = completed(resumed(pieces, workers=workers))
    results = {key: year * values for key, values in zip(keys, values_of, strict=True)}
    return tuple(
        StrategyYear(
            name, number, seed, float(values[0]), float(results[number, seed, "S1"][0]), *map(float, values[1:])
        )
        for (number, seed, name), values in results.items()
    )
