"""Averages over planes: the velocity with which wakes drift and meander, ambient wind and turbulence at a rotor.

Points below the lowest row of a field do not count: the wind falls to zero there. The bound is not sharp, so that a
small change of a height does not make a whole point count or not.

Reference: docs/theory/wakes.md (K-4, K-9, K-11).
"""

from __future__ import annotations

from math import cos, pi, sin, sqrt

from numpy import float64, int64
from numpy.typing import NDArray

from meltemi.compiler import anywhere, kernel, largest, total
from meltemi.farm.field import PlaneField, WakeField, sideways, wakes_velocity
from meltemi.farm.sets import IN_RING
from meltemi.maths.vectors import Vec, cross, dot
from meltemi.wind.velocity import ambient_velocity, series_now

Float = NDArray[float64]
Ints = NDArray[int64]
BLEND = 0.15
"""Height over which points begin to count, over the reach of an average."""
BETWEEN = pi / IN_RING
"""[rad] between a point of a ring and one that is turned by half their distance."""
BESIDE = 1e-3
"""[m] of a plane, where what it has is evaluated."""
AMBIENT, DISTURBED, ALONG = 0.0, 1.0, 2.0
"""Of an average: the ambient wind, with the wakes, or with their part along it."""


@kernel
def look(m: WakeField, count: Ints, near: Ints, centre: Vec, normal: Vec, radius: float, slack: float) -> None:
    """Choose the planes that a disk of an observer has to look at (K-11).

    Args:
      count: number of planes of each wake.
      near: 1 for each wake that is looked at, 0 for others.
      centre, normal, radius: of the disk, axes of the farm.
      slack: [m] by which the disk and the planes move until the next choice.
    """
    planes, reach, far = m.planes, m.wakes.reach, radius + slack
    for k in range(m.seen.wakes):
        first, last, meets = 0, 0, False
        ahead = dot(planes.normal[k, 0], centre - planes.centre[k, 0])
        for i in range(count[k] - 1 if near[k] > 0 else 0):
            tilted, further, downstream = planes.normal[k, i], planes.normal[k, i + 1], ahead
            ahead = dot(further, centre - planes.centre[k, i + 1])
            if downstream + far < 0.0 or ahead >= far:
                continue
            lean = cross(tilted, normal)
            span = radius * sqrt(dot(lean, lean)) + slack
            if downstream + span >= 0.0 and ahead < span:
                if last == 0:
                    first = i
                last = i + 1
                aside = centre - planes.centre[k, i]
                aside = aside - downstream * tilted
                meets = meets or sqrt(dot(aside, aside)) < radius + reach + slack
        m.seen.first[k] = first
        m.seen.last[k] = last if meets else first


@kernel
def above(z: float, reach: float, m: WakeField) -> float:
    """Share with which a point at a height [m] counts in an average that reaches as far [m] from its centre."""
    least = min(z - m.wind.box_z, m.wakes.ceiling - z)
    return min(max(least / (BLEND * reach) + 0.5, 0.0), 1.0)


@kernel
def mean_wind(
    m: PlaneField, t: float, centre: Vec, normal: Vec, turned: float, points: Float, reach: float, disturbed: float
) -> tuple[Vec, float, float]:
    """Weighted means over a disk of velocity [m/s] and its square, with the wakes that the observer sees, or ambient.

    The third value is 1 over the sum of the weights that count.

    Args:
      turned: [rad] angle by which the points are turned.
      points: (3, n) sideways, upwards [m] and weight; they reach as far [m] from the centre.
      disturbed: :data:`AMBIENT`, :data:`DISTURBED` or :data:`ALONG`.
    """
    level = sideways(normal)
    up = cos(turned) * cross(normal, level) - sin(turned) * level
    side = cross(up, normal)
    found, square, weights = Vec(0.0, 0.0, 0.0), 0.0, 0.0
    for j in range(points.shape[1]):
        q = centre + (points[0, j] * side + points[1, j] * up)
        weight = points[2, j] * above(q.z, reach, m)
        if anywhere(weight != 0.0):
            q = Vec(q.x, q.y, max(q.z, m.wind.box_z))
            u = ambient_velocity(q, t, m)
            if disturbed == DISTURBED:
                u += wakes_velocity(q, t, m)
            if disturbed == ALONG:
                u += dot(wakes_velocity(q, t, m), u) / max(dot(u, u), 1e-6) * u
            found += total(weight * u)
            square += total(weight * dot(u, u))
            weights += total(weight)
    share = 1.0 / weights if weights != 0.0 else 0.0
    return share * found, share * square, share


@kernel
def rotor_wind(m: PlaneField, t: float, centre: Vec, normal: Vec) -> tuple[float, float]:
    """Ambient wind along a direction [m/s] and turbulence intensity over a disk (K-4)."""
    series_now(t, m)
    mean, square, _ = mean_wind(m, t, centre, normal, 0.0, m.disk, reach_of(m.disk), AMBIENT)
    speed = sqrt(dot(mean, mean))
    return dot(normal, mean), sqrt(max(square - speed * speed, 0.0) / 3.0) / max(speed, 1e-3)


@kernel
def rotor_mean(m: PlaneField, t: float, count: Ints, near: Ints, centre: Vec, normal: Vec) -> tuple[Vec, Vec]:
    """Mean wind [m/s] over a rotor with the wakes of the others, and without."""
    series_now(t, m)
    reach = reach_of(m.span)
    look(m, count, near, centre, normal, reach, BESIDE)
    seen = mean_wind(m, t, centre, normal, 0.0, m.span, reach, DISTURBED)[0]
    return seen, mean_wind(m, t, centre, normal, 0.0, m.span, reach, AMBIENT)[0]


@kernel
def drift(m: PlaneField, k: int, count: Ints, near: Ints, t: float, disturbed: float, own: Float, turn: Float) -> None:
    """Velocities of the planes of a wake: a weighted mean of the wind over each, and its deflection (K-9).

    Every other plane has the mean of its neighbours' averages: the planes are closer than averages can tell apart.

    Args:
      count, near: number of planes of each wake, and whether it is looked at.
      disturbed: as of :func:`mean_wind`; the wakes include its own one.
      own: what the points miss of the wake's own axial velocity, factors of its profile (K-9a).
      turn: lateral drift over the way, the same by radian of yaw error, drift by the mean deficit, rotor radius [m].
    """
    series_now(t, m)
    planes, reach, last = m.planes, reach_of(m.drift), count[k] - 1
    for i in range(last + 1):
        if i % 2 == 0 or i == last:
            normal = planes.normal[k, i]
            # a point in a plane is between two of them by rounding only: it is taken a little inside the wake
            centre = planes.centre[k, i] + (BESIDE if i < last else -BESIDE) * normal
            if disturbed > AMBIENT:
                look(m, count, near, centre, normal, reach, 2.0 * BESIDE)
            # the points between its last ones: an average that moves with its plane sees twice as many
            turned = 0.5 * BETWEEN * (i % 4)
            mean, _, share = mean_wind(m, t, centre, normal, turned, m.drift, reach, disturbed)
            missed = 0.0
            for j in range(own.shape[0] if disturbed == DISTURBED else 0):
                missed += own[j] * m.profile[k, i, j, 0]
            planes.velocity[k, i] = mean + share * missed * normal
    for i in range(1, last, 2):
        planes.velocity[k, i] = 0.5 * (planes.velocity[k, i - 1] + planes.velocity[k, i + 1])
    for i in range(last + 1):
        normal, mean = planes.normal[k, i], planes.velocity[k, i]
        way = (turn[0] + turn[1] * planes.yaw[k, i]) * abs(dot(normal, mean))
        across = Vec(0.0, normal.y, normal.z)
        aside = turn[2] * deficit(m, k, i, turn[3]) if turn[2] != 0.0 else 0.0
        planes.velocity[k, i] = mean + way * sideways(normal) + aside * across


@kernel
def reach_of(points: Float) -> float:
    """Largest distance [m] of points from their centre."""
    reach = 0.0
    for i in range(points.shape[1]):
        reach = max(reach, largest(sqrt(points[0, i] * points[0, i] + points[1, i] * points[1, i])))
    return reach


@kernel
def horizontal(m: WakeField, t: float, count: Ints, near: Ints, x: Float, y: Float, z: float, speed: Float) -> None:
    """Wind speed [m/s] at a height, at all x and y [m] of the farm; ``speed`` (x, y) is filled."""
    series_now(t, m)
    for i in range(x.shape[0]):
        for j in range(y.shape[0]):
            q = Vec(x[i], y[j], z)
            look(m, count, near, q, Vec(1.0, 0.0, 0.0), 1.0, BESIDE)
            u = ambient_velocity(q, t, m) + wakes_velocity(q, t, m)
            speed[i, j] = sqrt(u.x * u.x + u.y * u.y)


@kernel
def deficit(m: WakeField, k: int, i: int, radius: float) -> float:
    """Mean axial velocity [m/s] of a wake's plane within a radius; negative where the wake is slow."""
    last = min(int(radius / m.wakes.spacing), m.profile.shape[2] - 1)
    found, area = 0.0, 0.0
    for j in range(last + 1):
        found += j * m.profile[k, i, j, 0]
        area += j
    return found / max(area, 1.0)
