"""Averages over planes: the velocity with which wakes drift and meander, ambient wind and turbulence at a rotor.

Points below the lowest row of a field have no weight: the wind falls to zero there. The weight changes gradually, so
that results are continuous in the height.

Reference: docs/theory/wakes.md (K-4, K-9, K-11).
"""

from __future__ import annotations

from math import cos, pi, sin, sqrt

from numpy import float32, float64, int64
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
"""[rad] half the angle between neighbouring points of a ring."""
BESIDE = 1e-3
"""[m] shift of a plane's average into the wake, so that rounding does not decide between which planes it lies."""
LEAST_CHANGE = 0.1
"""[m] least limit of the change of a distance from one plane to the next."""
AMBIENT, DISTURBED, ALONG = 0.0, 1.0, 2.0
"""Winds of which :func:`mean_wind` is the mean: the ambient wind, with the wakes, or with their part along it."""


@kernel
def longest(m: WakeField, k: int, count: int) -> None:
    """Compute the largest distances between neighbouring planes of wake k and between the tips of their normals."""
    planes, step, turn = m.planes, 0.0, 0.0
    for i in range(count - 1):
        way, lean = planes.centre[k, i + 1] - planes.centre[k, i], planes.normal[k, i + 1] - planes.normal[k, i]
        step, turn = max(step, dot(way, way)), max(turn, dot(lean, lean))
    m.longest[0, k], m.longest[1, k] = sqrt(step), sqrt(turn)


@kernel
def select_planes(
    m: WakeField, count: Ints, near: Ints, centre: Vec, normal: Vec, radius: float, slack: float
) -> float:
    """Select the planes of wakes that may reach the disk of an observer (K-11); return their largest lean.

    From one plane to the next the distance along the normal changes by a limited amount (``longest``), so that planes
    are skipped which are too far away for this, without a look at them.

    Args:
      count: number of planes of each wake.
      near: 1 for each wake that is considered, 0 for others.
      centre, normal, radius: geometry of the disk, axes of the farm.
      slack: [m] largest displacement of the disk and the planes until the next selection.
    """
    planes, seen, reach, far, found, most = m.planes, m.visible, m.wakes.reach, radius + slack, 0, 0.0
    for k in range(seen.wakes):
        first, last, meets, i = 0, 0, False, 0
        if near[k] > 0 and count[k] > 1:
            aside = centre - planes.centre[k, 0]
            away = sqrt(dot(aside, aside)) + count[k] * m.longest[0, k]
            change = max(m.longest[0, k] + m.longest[1, k] * away, LEAST_CHANGE)
            ahead = dot(planes.normal[k, 0], aside)
            while i < count[k] - 1:
                away = max(ahead, -ahead) - far
                if away > change:
                    i += int(away / change)
                    if i >= count[k] - 1:
                        break
                    ahead = dot(planes.normal[k, i], centre - planes.centre[k, i])
                tilted, further, downstream = planes.normal[k, i], planes.normal[k, i + 1], ahead
                ahead = dot(further, centre - planes.centre[k, i + 1])
                if downstream + far >= 0.0 and ahead < far:
                    lean = cross(tilted, normal)
                    leaning = sqrt(dot(lean, lean))
                    span = radius * leaning + slack
                    if downstream + span >= 0.0 and ahead < span:
                        if last == 0:
                            first = i
                        last, most = i + 1, max(most, leaning)
                        aside = centre - planes.centre[k, i]
                        aside = aside - downstream * tilted
                        meets = meets or sqrt(dot(aside, aside)) < radius + reach + slack
                i += 1
        seen.first[k] = first
        seen.last[k] = last if meets else first
        if meets:
            seen.wake[found] = k
            found += 1
    if found < seen.wakes:
        seen.wake[found] = -1
    return most


@kernel
def observe(  # noqa: PLR0913 - arrays of a kernel
    m: WakeField,
    t: float,
    count: Ints,
    near: Ints,
    centre: Vec,
    normal: Vec,
    radius: float,
    bent: float,
    slack: float,
    profile: NDArray[float32],
) -> None:
    """Select the planes that a rotor evaluates until the next exchange, and set their profiles (K-11).

    They are those half a step ahead: planes keep them while they drift, and a plane becomes the next one in a step.

    Args:
      t: [s] time.
      bent: [m] deflection of nodes out of the rotor plane.
      profile: (wakes, planes, points, 3) profiles at this time.
      count, near, centre, normal, radius, slack: as of :func:`select_planes`.
    """
    lean, seen, shown = select_planes(m, count, near, centre, normal, radius, slack), m.visible, m.profile
    m.wakes.time, m.wakes.searched = t, t - 1.0
    m.wakes.disk, m.wakes.span = centre, radius * lean + bent
    for place in range(seen.wakes):
        k = seen.wake[place]
        if k < 0:
            break
        seen.begin[k], seen.end[k] = seen.first[k], seen.last[k]
        for i in range(seen.first[k], seen.last[k] + 1):
            on = min(i + 1, count[k] - 1)
            for j in range(shown.shape[2]):
                for c in range(3):
                    shown[k, i, j, c] = float32(0.5) * (profile[k, i, j, c] + profile[k, on, j, c])


@kernel
def share_above(z: float, reach: float, m: WakeField) -> float:
    """Weight, from 0 to 1, of a point at a height [m] in an average over a disk of radius ``reach`` [m]."""
    least = min(z - m.wind.box_z, m.wakes.ceiling - z)
    return min(max(least / (BLEND * reach) + 0.5, 0.0), 1.0)


@kernel
def mean_wind(
    m: PlaneField, t: float, centre: Vec, normal: Vec, turned: float, points: Float, reach: float, disturbed: float
) -> tuple[Vec, float, float]:
    """Weighted means over a disk of velocity [m/s] and its square, ambient or with the wakes selected for the observer.

    The third value is 1 over the sum of the weights.

    Args:
      turned: [rad] angle by which the points are rotated.
      points: (3, n) sideways, upwards [m] and weight, within the radius ``reach`` [m].
      disturbed: :data:`AMBIENT`, :data:`DISTURBED` or :data:`ALONG`.
    """
    level = sideways(normal)
    up = cos(turned) * cross(normal, level) - sin(turned) * level
    side = cross(up, normal)
    velocity, square, weights = Vec(0.0, 0.0, 0.0), 0.0, 0.0
    for j in range(points.shape[1]):
        q = centre + (points[0, j] * side + points[1, j] * up)
        weight = points[2, j] * share_above(q.z, reach, m)
        if anywhere(weight != 0.0):
            q = Vec(q.x, q.y, max(q.z, m.wind.box_z))
            u = ambient_velocity(q, t, m)
            if disturbed == DISTURBED:
                u += wakes_velocity(q, t, m)
            if disturbed == ALONG:
                u += dot(wakes_velocity(q, t, m), u) / max(dot(u, u), 1e-6) * u
            velocity += total(weight * u)
            square += total(weight * dot(u, u))
            weights += total(weight)
    share = 1.0 / weights if weights != 0.0 else 0.0
    return share * velocity, share * square, share


@kernel
def rotor_wind(m: PlaneField, t: float, centre: Vec, normal: Vec) -> tuple[float, float]:
    """Ambient wind along a direction [m/s] and turbulence intensity over a disk (K-4)."""
    series_now(t, m)
    mean, square, _ = mean_wind(m, t, centre, normal, 0.0, m.disk, reach_of(m.disk), AMBIENT)
    speed = sqrt(dot(mean, mean))
    return dot(normal, mean), sqrt(max(square - speed * speed, 0.0) / 3.0) / max(speed, 1e-3)


@kernel
def rotor_mean(m: PlaneField, t: float, count: Ints, near: Ints, centre: Vec, normal: Vec) -> tuple[Vec, Vec]:
    """Mean wind [m/s] over a rotor with the wakes of the other turbines, and ambient."""
    series_now(t, m)
    reach = reach_of(m.span)
    select_planes(m, count, near, centre, normal, reach, BESIDE)
    disturbed = mean_wind(m, t, centre, normal, 0.0, m.span, reach, DISTURBED)[0]
    return disturbed, mean_wind(m, t, centre, normal, 0.0, m.span, reach, AMBIENT)[0]


@kernel
def drift(
    m: PlaneField, k: int, count: Ints, near: Ints, t: float, disturbed: float, factors: Float, turn: Float
) -> None:
    """Velocities of the planes of a wake: a weighted mean of the wind over each, and its deflection (K-9).

    Every other plane has the mean of its neighbours' averages, as the planes are closer than the averages resolve.

    Args:
      count, near: number of planes of each wake, and whether it is considered.
      disturbed: as of :func:`mean_wind`; the wakes include wake ``k`` itself.
      factors: quadrature error of the points for the axial velocity of wake ``k``, factors of its profile (K-9a).
      turn: lateral drift per travelled distance, the same per radian of yaw error, drift per mean deficit, rotor
        radius [m].
    """
    series_now(t, m)
    planes, reach, last = m.planes, reach_of(m.drift), count[k] - 1
    for i in range(last + 1):
        if i % 2 == 0 or i == last:
            normal = planes.normal[k, i]
            # rounding decides between which planes a point in a plane lies: shift it a little into the wake
            centre = planes.centre[k, i] + (BESIDE if i < last else -BESIDE) * normal
            if disturbed > AMBIENT:
                select_planes(m, count, near, centre, normal, reach, 2.0 * BESIDE)
            # alternating angles: an average that moves with its plane then samples twice as many points
            turned = 0.5 * BETWEEN * (i % 4)
            mean, _, share = mean_wind(m, t, centre, normal, turned, m.drift, reach, disturbed)
            missed = 0.0
            for j in range(factors.shape[0] if disturbed == DISTURBED else 0):
                missed += factors[j] * m.profile[k, i, j, 0]
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
    """Fill ``speed`` (x, y) with the wind speed [m/s] at a height, at all x and y [m] of the farm."""
    series_now(t, m)
    for i in range(x.shape[0]):
        for j in range(y.shape[0]):
            q = Vec(x[i], y[j], z)
            select_planes(m, count, near, q, Vec(1.0, 0.0, 0.0), 1.0, BESIDE)
            u = ambient_velocity(q, t, m) + wakes_velocity(q, t, m)
            speed[i, j] = sqrt(u.x * u.x + u.y * u.y)


@kernel
def deficit(m: WakeField, k: int, i: int, radius: float) -> float:
    """Mean axial velocity [m/s] of a plane of a wake within a radius; negative for a deficit."""
    last = min(int(radius / m.wakes.spacing), m.profile.shape[2] - 1)
    integral, area = 0.0, 0.0
    for j in range(last + 1):
        integral += j * m.profile[k, i, j, 0]
        area += j
    return integral / max(area, 1.0)
