"""Named sets of wake constants: that of FAST.Farm and three of the IEC family.

Each is the calibration of its authors: constants, filters along the wake, inlet behind the rotor, drift. They differ by
a third in the deficit at five diameters (docs/theory/wakes.md), so a result is only valid for the set that it names.

Reference: docs/theory/wakes.md (K-2 to K-10); Jonkman & Shaler (2021) for ``fast.farm``; IEC 61400-1:2019, Annex E.2;
Madsen et al. (2010); Keck et al. (2015).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from meltemi.compiler import kernel

Float = NDArray[np.float64]
Filter = Callable[[Float], Float]
"""Values at distances over the diameter."""
Inlet = Callable[[Float, Float, float, float], Float]
"""Axial velocity [m/s] of the wake at radii [m], of local thrust coefficients, rotor radius [m] and wind [m/s]."""


def power_filter(least: float, begin: float, end: float, exponent: float) -> Filter:
    """Filter of FAST.Farm: ``least`` up to ``begin`` diameters, 1 from ``end`` on, a power law between (K-6)."""

    def values(x: Float) -> Float:
        share = np.clip((x - begin) / (end - begin), 0.0, 1.0)
        return np.where(x <= begin, least, least + (1.0 - least) * share**exponent)

    return values


def smooth_filter(x: Float) -> Float:
    """Ambient filter of IEC 61400-1:2019 up to four diameters (K-6)."""
    y = np.clip(x / 4.0, 0.0, 1.0) ** 1.5
    return y - np.sin(2.0 * np.pi * y) / (2.0 * np.pi)


def linear_filter(x: Float) -> Float:
    """Ambient filter of Madsen and of Keck, up to two diameters."""
    return np.clip(x / 2.0, 0.0, 1.0)


def iec_shear_filter(x: Float) -> Float:
    """Filter of the wake shear of Madsen et al. (2010) and IEC 61400-1:2019."""
    y = 2.0 * x
    line = 0.025 * y - 0.0375
    far = line + np.where(y > 12.0, 0.00105 * (y - 12.0) ** 3, 0.0)
    return np.where(y < 4.0, 0.0625, np.where(y < 20.0, far, 1.0))


def keck_shear_filter(x: Float) -> Float:
    """Filter of the wake shear of Keck et al. (2015)."""
    return np.where(x < 2.0, 0.035, 1.0 - 0.965 * np.exp(-0.35 * (x - 2.0)))


@kernel
def disk_mean(r: Float, values: Float, radius: float) -> float:
    """Mean over the rotor disk of values by radius."""
    x = np.linspace(0.0, radius, 101)
    return float(2.0 / radius**2 * np.trapezoid(x * np.interp(x, r, values), x))


NEAR_WAKE, MOST_THRUST, LOW_THRUST, HIGH_THRUST, BRAKE = 1.8, 0.96, 0.96, 1.1, 2.0
"""FAST.Farm: near-wake constant, largest local thrust coefficient of momentum theory, ends of the transition to a
Gaussian wake, and thrust coefficient of the propeller brake."""


@kernel
def stream_tubes(r: Float, thrust: Float, near_wake: float) -> tuple[Float, Float]:
    """Induction factors, and the radii [m] to which the stream tubes at radii r expand (K-2)."""
    a = 0.5 - 0.5 * np.sqrt(1.0 - np.minimum(np.maximum(thrust, -BRAKE), MOST_THRUST))
    rate, square = (1.0 - a) * r / (1.0 - near_wake * a), np.zeros(r.shape[0])
    for i in range(1, r.shape[0]):
        square[i] = square[i - 1] + (rate[i] + rate[i - 1]) * (r[i] - r[i - 1])
    return a, np.sqrt(square)


@kernel
def gaussian_share(thrust: float) -> float:
    """Share of the Gaussian inlet at a thrust coefficient of the rotor."""
    return min(max((thrust - LOW_THRUST) / (HIGH_THRUST - LOW_THRUST), 0.0), 1.0)


@kernel
def fast_farm_inlet(r: Float, thrust: Float, radius: float, wind: float) -> Float:
    """Inlet of FAST.Farm: momentum theory with the expansion of the stream tubes, Gaussian at high thrust (K-2)."""
    total = min(disk_mean(r, thrust, radius), BRAKE)
    a, widened = stream_tubes(r, thrust, NEAR_WAKE)
    low = -wind * NEAR_WAKE * np.interp(r, widened, a)
    share = gaussian_share(total)
    if share == 0.0:
        return low
    centre, width = 0.3 / (2.0 * total**2 - 1.0) + 0.2, 0.5 * total + 0.16
    high = -wind * centre * np.exp(-((r / (2.0 * width * radius)) ** 2))
    return (1.0 - share) * low + share * high


def iec_induction(thrust: Float) -> Float:
    """Axial induction factor of a thrust coefficient, up to the largest of the family's inlets."""
    c = np.clip(thrust, -MOST_THRUST, 1.5)
    return np.clip(0.246 * c + 0.0586 * c**2 + 0.0883 * c**3, -0.47, 0.47)


def madsen_inlet(r: Float, thrust: Float, radius: float, wind: float) -> Float:
    """Inlet of Madsen et al. (2010): annuli expand by continuity, reduced for the pressure in the wake (K-3)."""
    a = iec_induction(thrust)
    mean = disk_mean(r, a, radius)
    rings = (1.0 - a[:-1]) / (1.0 - 2.0 * a[:-1]) * np.diff(r**2)
    widened = (1.0 - 0.45 * mean**2) * np.sqrt(np.concatenate([[0.0], np.cumsum(rings)]))
    return -wind * np.interp(r, widened, 2.0 * a)


def keck_inlet(r: Float, thrust: Float, radius: float, wind: float) -> Float:
    """Inlet of Keck et al. (2015): one expansion of the whole rotor."""
    a = iec_induction(thrust)
    mean = disk_mean(r, a, radius)
    return -wind * np.interp(r, r * math.sqrt((1.0 - mean) / (1.0 - 1.98 * mean)), 2.1 * a)


def iec_inlet(r: Float, thrust: Float, radius: float, wind: float) -> Float:
    """Inlet of IEC 61400-1:2019: a uniform, expanded deficit (K-3)."""
    mean = disk_mean(r, iec_induction(thrust), radius)
    m = 1.0 / math.sqrt(1.0 - 4.0 * mean * (1.0 - mean))
    widened = 2.0 * r * (1.0 - 0.45 * mean**2) * math.sqrt((1.0 + m) / 8.0)
    return -wind * np.interp(r, widened, np.where(r <= radius, 2.0 * mean, 0.0))


@dataclass(frozen=True)
class WakeSet:
    """Constants and functions of a wake model.

    Attributes:
      source: publication.
      inlet: axial velocity of the wake behind the rotor.
      ambient, power, ambient_filter: eddy viscosity of the ambient turbulence: factor, exponent of its intensity, and
        filter along the wake.
      shear, shear_filter: factor and filter of the eddy viscosity of the wake shear.
      gradient: use a mixing length times the velocity gradient where that is larger.
      slowest: the wake shear is based on the lowest wind speed in the wake, not on the largest deficit.
      rotor_wide: the half width of the wake is the rotor radius; otherwise it encloses 95 % of the deficit.
      cut_off: [m/s] cut-off frequency of the filters times the rotor radius.
      aside, aside_yaw: [m] and [m/rad] lateral offset of a wake at the rotor, to the left, constant and by yaw error.
      turn, turn_yaw: [-] and [1/rad] lateral offset per travelled distance, constant and by yaw error.
      lateral: lateral drift over the mean deficit and the sine of the rotor's angle.
      meander: diameter of the averages that determine the drift of wakes, over the rotor diameter.
      windowed: the weight of these averages is a windowed jinc function instead of uniform.
      disturbed: these averages include the wakes.
      points: points of a profile per rotor diameter.
      curled: planes have cross-flow velocities, which curl them, and drift with the velocity along the wind.
      deficit_turbulence, gradient_turbulence: turbulence that wakes add, over deficit and gradient: factor, least
        share, begin and end [D], exponent.
    """

    source: str
    inlet: Inlet
    ambient: float
    ambient_filter: Filter
    shear: float
    shear_filter: Filter
    power: float = 1.0
    gradient: bool = False
    slowest: bool = False
    rotor_wide: bool = False
    cut_off: float = 12.5
    aside: float = 0.0
    aside_yaw: float = 0.0
    turn: float = 0.0
    turn_yaw: float = 0.0
    lateral: float = 0.4
    meander: float = 2.0
    windowed: bool = False
    disturbed: bool = False
    points: float = 25.0
    curled: bool = False
    deficit_turbulence: tuple[float, float, float, float, float] = (0.6, 1.0, 0.0, 1.0, 1.0)
    gradient_turbulence: tuple[float, float, float, float, float] = (0.35, 1.0, 0.0, 1.0, 1.0)

    def filters(self, x: Float) -> Float:
        """(2, n) filters of the ambient and shear viscosities at distances over the diameter."""
        return np.array([self.ambient_filter(x), self.shear_filter(x)])

    def added(self, x: Float) -> Float:
        """(2, n) factors of deficit and gradient in added turbulence, at distances over the diameter."""
        kinds = (self.deficit_turbulence, self.gradient_turbulence)
        return np.array([each[0] * power_filter(*each[1:])(x) for each in kinds])


_IEC = WakeSet(
    source="IEC 61400-1:2019, Annex E.2",
    inlet=iec_inlet,
    ambient=0.023,
    power=0.3,
    ambient_filter=smooth_filter,
    shear=0.008,
    shear_filter=iec_shear_filter,
)
_FAST_FARM = WakeSet(
    source="FAST.Farm of OpenFAST 5.0, default constants of polar wakes",
    inlet=fast_farm_inlet,
    ambient=0.05,
    ambient_filter=power_filter(1.0, 0.0, 1.0, 0.01),
    shear=0.016,
    shear_filter=power_filter(0.2, 3.0, 25.0, 0.1),
    gradient=True,
    slowest=True,
    rotor_wide=True,
    aside_yaw=math.degrees(0.3),
    turn_yaw=math.degrees(-0.004),
    lateral=0.0,
    meander=1.9,
    windowed=True,
    disturbed=True,
    deficit_turbulence=(0.6, 0.0, 0.0, 2.0, 1.0),
    gradient_turbulence=(3.0, 0.0, 0.0, 12.0, 0.65),
)
SETS: dict[str, WakeSet] = {
    "fast.farm": _FAST_FARM,
    "curled": replace(
        _FAST_FARM,
        source="FAST.Farm of OpenFAST 5.0, default constants of curled wakes",
        shear=0.032,
        aside_yaw=0.0,
        turn_yaw=0.0,
        points=16.0,
        curled=True,
    ),
    "iec": _IEC,
    "madsen": replace(
        _IEC, source="Madsen et al. (2010)", inlet=madsen_inlet, ambient=0.07, power=1.0, ambient_filter=linear_filter
    ),
    "keck": replace(
        _IEC,
        source="Keck et al. (2015)",
        inlet=keck_inlet,
        ambient=0.0914,
        power=1.0,
        ambient_filter=linear_filter,
        shear=0.0216,
        shear_filter=keck_shear_filter,
        gradient=True,
    ),
}
"""Sets by name."""


def average_points(wake: WakeSet, diameter: float, rings: int = 16, meander: float | None = None) -> Float:
    """(n, 3) points of the average for the drift of wakes: sideways, upwards [m], weight (K-9).

    They are symmetric about the vertical, so that a symmetric wake is not deflected.

    Args:
      diameter: [m] rotor diameter.
      rings: number of rings of points, at the radii of Gauss's rule.
      meander: diameter of the average over the rotor diameter; by default that of the set.
    """
    wide = (wake.meander if meander is None else meander) * diameter
    radius = 0.5 * SECOND_ZERO / np.pi * wide if wake.windowed else 0.5 * wide
    rows = []
    for k, (place, share) in enumerate(zip(*np.polynomial.legendre.leggauss(rings), strict=True)):
        r = 0.5 * radius * (1.0 + place)
        angles = 0.5 * np.pi + np.pi / IN_RING * (k % 2 + 2.0 * np.arange(IN_RING))
        weight = share * r * (jinc(r / wide) * jinc(0.5 * r / wide) if wake.windowed else 1.0)
        rows += [(r * math.cos(angle), r * math.sin(angle), weight) for angle in angles]
    return np.array(rows)


def by_angle(points: Float) -> Float:
    """The same points (n, 3) by angle, then radius: of eight at a time all are below the ground, or none."""
    y, z, _ = points.T
    return points[np.lexsort((y**2 + z**2, np.round(np.arctan2(z, y), 6)))]


def quadrature_error(points: Float, exact: Float, r: Float) -> Float:
    """(n,) error of a sum over points for a profile, linear between radii r [m], as factors of its values (K-9a).

    Args:
      points: (p, 3) sideways, upwards [m], weight.
      exact: (q, 3) points of a fine quadrature rule for the same average.
    """

    def mean(rule: Float) -> Float:
        hats = np.clip(1.0 - np.abs(np.hypot(rule[:, 0], rule[:, 1]) - r[:, None]) / r[1], 0.0, None)
        return np.asarray(hats @ rule[:, 2] / rule[:, 2].sum())

    return (mean(exact) - mean(points)) * float(points[:, 2].sum())


IN_RING = 8
"""Points of a ring."""
FINE_RINGS = 400
"""Rings of the quadrature rule from which the error of the usual ones is evaluated."""
SECOND_ZERO = 7.015586669815619
"""Second zero of the Bessel function J1, where the averages of FAST.Farm end."""


def jinc(x: float) -> float:
    """J1(2 pi x) / x, and pi at 0: a low-pass filter over a disk."""
    from scipy.special import j1

    return math.pi if x == 0.0 else float(j1(2.0 * math.pi * x) / x)
