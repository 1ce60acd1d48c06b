"""Winds of the paper: its two validation runs, the bins of its Table 2, and its gust with direction change.

Sources: Wang et al. (2021), Table 2 and Figures 4, 5, 9; IEC 61400-1 ed. 3, clause 6.3.2.5, of which Figure 9 is the
coherent gust with direction change at rated wind plus 2 m/s.
"""

from __future__ import annotations

import csv
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from meltemi.iec.gusts import RISE_TIME, Sign
from meltemi.studies.yaw_gusts import coherent_gust
from meltemi.turbine.definition import Turbine
from meltemi.turbulence.field import generate_field
from meltemi.turbulence.superposition import with_gust
from meltemi.wind.fields import WindBox, WindSeries
from meltemi.wind.turbulent import TurbulentWind

SHEAR = 0.2
"""Shear exponent of the normal wind profile; the paper does not give that of its site."""

GUST_BEGIN, GUST_SPEED, GUST_RISE = 10.0, 10.67, 14.33
"""[s], [m/s], [m/s] of Figure 9: rated wind 8.67 m/s plus 2 m/s, and up to 25 m/s (15 m/s in the standard). The paper
does not give the begin."""
STATED = 20.0
"""[s] time in which the paper's direction changes by "over 60 degrees"; the standard's gust has 10 s."""
TIMES = (STATED, RISE_TIME)
"""[s] readings of the gust: in how long speed and direction change."""

START_UP_SPEED, START_UP_LAST, START_UP_INTENSITY = 7.49, 8.06, 0.05
"""[m/s], [m/s], [-] of V1: the mean over 240 s is the paper's. Its power in the last minute needs 8.06 m/s on the
measured power curve of Table 2; the paper does not give the wind of that minute."""
START_UP_RISE = (145.0, 155.0)
"""[s] begin and end of the rise: early enough for the rotor to reach its new speed before the last minute."""
POWER_SPEED, POWER_INTENSITY = 10.49, 0.085
"""[m/s], [-] of V2; the intensity lies between those of the bins at 9.9 and 11.0 m/s."""
TURN, TURN_BEGIN, TURN_END = np.radians(20.0), 120.0, 180.0
"""[rad], [s] of the direction change in V2, of which the paper says only that the turbine yawed."""


@dataclass(frozen=True)
class MeasuredBin:
    """A row of Table 2; powers in kW and moments in kNm, as printed.

    The paper heads ``power_mean`` "min of power"; it is smooth in the wind speed and no other column holds the mean.
    The moment is not named; its level and course are those of the flapwise moment at the blade root.
    """

    bin: int
    begin: float
    end: float
    sets: int
    speed: float
    intensity: float
    power_mean: float
    power_max: float
    power_std: float
    moment_mean: float
    moment_min: float
    moment_max: float
    moment_std: float


@cache
def measured() -> tuple[MeasuredBin, ...]:
    """The 18 bins of Table 2 that hold data."""
    with (Path(__file__).parent / "table2.csv").open(newline="", encoding="utf-8") as file:
        rows = list(csv.reader(file))[1:]
    return tuple(
        MeasuredBin(int(k), float(low), float(high), int(n), float(v), float(ti) / 100.0, *map(float, rest))
        for k, low, high, n, v, ti, *rest in rows
    )


def bin_wind(row: MeasuredBin, seed: int) -> TurbulentWind:
    """Turbulence with mean and intensity of a bin."""
    return TurbulentWind(speed=row.speed, intensity=row.intensity, seed=seed, shear_exponent=SHEAR)


def start_up(turbine: Turbine, seed: int, duration: float = 240.0) -> WindBox:
    """V1: mean 7.49 m/s over 240 s, 8.06 m/s over their last minute and the preceding half minute."""
    begin, end = START_UP_RISE
    late = (240.0 - 0.5 * (begin + end)) / 240.0
    before = (START_UP_SPEED - late * START_UP_LAST) / (1.0 - late)
    box = _box(turbine, before, START_UP_INTENSITY, seed, duration)
    rise = WindSeries(time=(begin, end), speed=before, gust=(0.0, START_UP_LAST - before))
    return with_gust(box, rise)


def power_stage(turbine: Turbine, seed: int, duration: float = 480.0) -> WindBox:
    """V2: mean 10.49 m/s, and a change of wind direction that the turbine follows."""
    turn = WindSeries(time=(TURN_BEGIN, TURN_END), speed=POWER_SPEED, direction=(0.0, TURN))
    return with_gust(_box(turbine, POWER_SPEED, POWER_INTENSITY, seed, duration), turn)


def gust(turbine: Turbine, sign: Sign = 1, time: float = STATED, speed: float = GUST_SPEED) -> WindSeries:
    """Figure 9: from 10.67 m/s to 25 m/s and 67.5 degrees within a time, clockwise from above with ``sign`` 1."""
    return coherent_gust(turbine, speed, rise=GUST_RISE, time=time, begin=GUST_BEGIN, sign=sign)


def _box(turbine: Turbine, speed: float, intensity: float, seed: int, duration: float) -> WindBox:
    wind = TurbulentWind(speed=speed, intensity=intensity, seed=seed, shear_exponent=SHEAR)
    return generate_field(wind, turbine, duration)
