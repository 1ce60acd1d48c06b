"""A lidar on the nacelle as a sensor of controllers: line-of-sight speeds at ranges ahead of the rotor.

Like other sensors it is a part of a controller: settings, the speeds of a run and those of the last scan are a table,
:class:`LidarSensor`, the result of ``meltemi.analysis.measure_lidar`` for a wind. ``lidar_scan`` in an update advances
it to the present time; ``line_of_sight`` and ``seen`` have a value for each beam. With Taylor's frozen turbulence and a
fixed nacelle only the blades that block a beam depend on the run.

Reference: docs/theory/control.md (C-97 to C-100); Simley et al. (2014), Wind Energy 17, 413-433; Peña et al. (2013),
Remote Sensing for Wind Energy, DTU Wind Energy-E-0029.
"""

from __future__ import annotations

from math import floor, pi

from meltemi.compiler import Numbers, Table, kernel, number, series, whole
from meltemi.control.signals import Measurements


class LidarSensor(Table, title="lidar"):
    """Settings and state of a lidar. Values of a beam are contiguous, one for each range."""

    values: float = number("-", "number of speeds of a run: scans times beams times ranges")
    channels: float = number("-", "number of beams times ranges")
    beams: float = number("-", "number of beams")
    ranges: float = number("-", "number of ranges of a beam")
    sample_time: float = number("s", "time of a scan, in which the beams measure one after the other")
    speed: Numbers = series("m/s", "line-of-sight speeds of a run, positive towards the lidar", "values")
    line_of_sight: Numbers = series("m/s", "state: the last line-of-sight speeds", "channels")
    share: Numbers = series("-", "line-of-sight speed over that of a uniform wind along the shaft", "beams")
    shadow: Numbers = series("rad", "azimuth at which a blade blocks a beam", "beams")
    half_width: Numbers = series("rad", "half the range of azimuth in which a blade blocks a beam; 0: none", "beams")
    scan: Numbers = series("-", "state: number of the last scan of a beam, from 1", "beams")
    seen: Numbers = series("-", "state: 1 if the last measurement of a beam was free, 0 if a blade was in it", "beams")


@kernel
def lidar_scan(x: LidarSensor, measured: Measurements) -> None:
    """Update the speeds to the present time; those of a blocked beam are kept (C-99)."""
    beams, ranges = whole(x.beams), whole(x.ranges)
    scans = whole(x.values) // (beams * ranges)
    for i in range(beams):
        k = min(whole(floor(measured.time / x.sample_time - i / x.beams + 1e-6)), scans - 1)
        if k + 1 <= whole(x.scan[i]):
            continue
        x.scan[i] = k + 1
        x.seen[i] = 1.0
        for b in range(whole(measured.n_blades)):
            away = measured.azimuth + 2.0 * pi * b / measured.n_blades - x.shadow[i]
            away -= 2.0 * pi * floor(away / (2.0 * pi) + 0.5)
            if abs(away) < x.half_width[i]:
                x.seen[i] = 0.0
        if x.seen[i] > 0.0:
            for g in range(ranges):
                x.line_of_sight[i * ranges + g] = x.speed[(k * beams + i) * ranges + g]


@kernel
def lidar_wind(x: LidarSensor, g: int) -> float:
    """Estimate of the rotor-effective wind speed [m/s] at a range: mean over the beams (C-100)."""
    beams, ranges = whole(x.beams), whole(x.ranges)
    mean = 0.0
    for i in range(beams):
        mean += x.line_of_sight[i * ranges + g] / (x.share[i] * beams)
    return mean
