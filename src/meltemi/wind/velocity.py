"""Wind velocity at a point and time, for kernels.

A *series*, uniform across the rotor except for shear and veer, given by a table in time; a *box*, a turbulent field
that is convected past the turbine at its mean speed (Taylor); or their sum, in which many cases share a box.

Both are in one record, :class:`WindField`, which the records of the turbines inherit.

Inertial axes: x downwind for direction 0, y to the left looking downwind, z up from the ground.
The direction is positive when the wind turns clockwise seen from above: it then blows towards -y.

Reference: docs/theory/wind.md (W-1 to W-6).
"""

from __future__ import annotations

from math import cos, exp, floor, log, sin, tan

from meltemi.compiler import (
    Array1,
    Array2,
    Box,
    Constant,
    KernelRecord,
    Table,
    by_record,
    kernel,
    neighbours,
    number,
    where,
    whole,
)
from meltemi.maths.vectors import Vec


class WindParameters(Table, title="wind"):
    """Parameters of the wind."""

    kind: float = number("-", "0: series, 1: box, 2: sum of a series and a box")
    reference_height: float = number("m", "height at which the speed of a series is given")
    reference_length: float = number("m", "distance over which linear shears of a series act")
    roughness: float = number("m", "roughness length of the logarithmic profile; 0 for the power law")
    veer: float = number("rad/m", "change of the wind direction with height")
    upflow: float = number("rad", "inclination of the mean wind against the horizontal")
    box_speed: float = number("m/s", "convection speed of a box")
    box_dt: float = number("s", "time between planes of a box")
    box_dy: float = number("m", "lateral distance of the grid points")
    box_dz: float = number("m", "vertical distance of the grid points")
    box_y: float = number("m", "lateral position of the first column")
    box_z: float = number("m", "height of the lowest row")
    box_x: float = number("m", "position of the first plane at time 0")
    box_direction: float = number("rad", "mean wind direction of a box")
    periodic: float = number("-", "1: a box repeats after its last plane")
    gain: float = number("-", "factor of a box that is added to a series")


class WindNow(Table, title="wind series"):
    """Columns of a series."""

    time: float = number("s", "time, increasing")
    speed: float = number("m/s", "horizontal wind speed at the reference height")
    direction: float = number("rad", "wind direction: positive towards -y, clockwise from above")
    vertical: float = number("m/s", "vertical speed")
    horizontal_shear: float = number(
        "-", "difference of speed across the reference length, to the left, over the speed"
    )
    exponent: float = number("-", "exponent of the power law")
    vertical_shear: float = number("-", "linear vertical shear over the reference length")
    gust: float = number("m/s", "gust: uniform increment of the speed")


class WindField(KernelRecord):
    """Arrays of a wind for kernels: a series (its box is a dummy), a box (its series is one row of zeros), or both.

    ``series`` has shape (rows, columns) with the columns of :class:`WindNow`, of which ``times`` [s] (rows,) is the
    first; ``box`` has shape (planes, rows, columns, 3) [m/s]. ``now`` is the series at the time of the last
    :func:`series_now`.
    """

    wind: WindParameters
    times: Constant[Array1]
    series: Array2
    now: WindNow
    box: Box


@kernel
def series_now(t: float, m: WindField) -> None:
    """Interpolate the series to time ``t``; constant before its first and after its last row."""
    times, series, now = m.times, m.series, m.now.array
    i, j = 0, times.shape[0] - 1
    while j - i > 1:
        k = (i + j) // 2
        if times[k] <= t:
            i = k
        else:
            j = k
    span = times[j] - times[i]
    w = min(max((t - times[i]) / span, 0.0), 1.0) if span > 0.0 else 0.0
    for c in range(series.shape[1]):
        now[c] = series[i, c] + w * (series[j, c] - series[i, c])


@kernel
def series_velocity(p: Vec, m: WindField) -> Vec:
    """Velocity of a series at point p (W-1 to W-3)."""
    wind, now = m.wind, m.now
    z = max(p.z, 0.01)
    zr, z0 = wind.reference_height, wind.roughness
    ratio = log(z / zr)
    if z0 > 0.0:
        profile = max(1.0 + ratio / log(zr / z0), 0.0)
    else:
        profile = exp(now.exponent * ratio)
    c, s = cos(now.direction), sin(now.direction)
    across = p.y * c + p.x * s
    linear = (now.horizontal_shear * across + now.vertical_shear * (p.z - zr)) / wind.reference_length
    speed = now.speed * (profile + linear) + now.gust
    turned = now.direction + wind.veer * (p.z - zr)
    return Vec(speed * cos(turned), -speed * sin(turned), now.vertical + speed * tan(wind.upflow))


@kernel
def box_velocity(p: Vec, t: float, m: WindField) -> Vec:
    """Velocity of a box at point p, trilinear (W-4 to W-6).

    Beyond its sides the box continues with the values at its edge; below its lowest row the wind
    falls linearly to zero at the ground.
    """
    wind, box = m.wind, m.box
    nt, nz, ny = box.shape[0], box.shape[1], box.shape[2]
    c, s = cos(wind.box_direction), sin(wind.box_direction)
    x, y = p.x * c - p.y * s, p.x * s + p.y * c
    ti = (t + (wind.box_x - x) / wind.box_speed) / wind.box_dt
    if wind.periodic > 0.0:
        ti -= nt * floor(ti / nt)
        i = min(max(whole(ti), 0), nt - 1)
        i1 = where(i + 1 < nt, i + 1, 0)
    else:
        ti = min(max(ti, 0.0), nt - 1.000001)
        i = min(max(whole(ti), 0), nt - 2)
        i1 = i + 1
    yi = min(max((y - wind.box_y) / wind.box_dy, 0.0), ny - 1.000001)
    zi = min(max((p.z - wind.box_z) / wind.box_dz, 0.0), nz - 1.000001)
    # NaN must not index outside the box
    j, k = min(max(whole(yi), 0), ny - 2), min(max(whole(zi), 0), nz - 2)
    a, b, d = ti - i, yi - j, zi - k
    ground = min(max(p.z / wind.box_z, 0.0), 1.0)
    before, after = plane(m, i, k, j, d, b), plane(m, i1, k, j, d, b)
    u = ground * (before + a * (after - before))
    return Vec(u.x * c + u.y * s, -u.x * s + u.y * c, u.z)


@kernel
def plane(m: WindField, i: int, k: int, j: int, d: float, b: float) -> Vec:
    """Velocity in plane i of the box, bilinear: by d from row k to the next and by b from column j to the next."""
    return (1.0 - d) * row(m, i, k, j, b) + d * row(m, i, k + 1, j, b)


@kernel
def row(m: WindField, i: int, k: int, j: int, b: float) -> Vec:
    """Velocity in row k of plane i, linear: by b from column j to the next."""
    x, y, z, next_x, next_y, next_z = neighbours(m.box, i, k, j)
    return (1.0 - b) * Vec(x, y, z) + b * Vec(next_x, next_y, next_z)


@kernel
def ambient_velocity(p: Vec, t: float, m: WindField) -> Vec:
    """Velocity [m/s] of the described wind."""
    if m.wind.kind == 0.0:
        return series_velocity(p, m)
    u = box_velocity(p, t, m)
    if m.wind.kind == 1.0:
        return u
    mean, gain = series_velocity(p, m), m.wind.gain
    return Vec(mean.x + gain * u.x, mean.y + gain * u.y, mean.z + gain * u.z)


@by_record
def wind_velocity(p: Vec, t: float, m: WindField) -> Vec:
    """Wind velocity [m/s] at point p [m] and time t [s], inertial axes; of a series at the time of ``m.now``.

    A part that adds to the described wind, such as the wakes of other turbines, is a variant for its class of records,
    which calls :func:`ambient_velocity`.
    """
    raise NotImplementedError


wind_velocity.variant(ambient_velocity)
