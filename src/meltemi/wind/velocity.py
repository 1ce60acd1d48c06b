"""Wind velocity at a point and time, for kernels.

Two kinds: a *series*, uniform across the rotor but for shear and veer, given by a table in time;
and a *box*, a turbulent field that is carried past the turbine by its mean speed (Taylor).

Inertial axes: x downwind for direction 0, y to the left looking downwind, z up from the ground.
The direction is positive when the wind turns clockwise seen from above: it then blows towards -y.

Reference: docs/theory/wind.md (W-1 to W-6).
"""

from __future__ import annotations

from math import cos, exp, floor, log, sin, tan

from numpy import float32, float64
from numpy.typing import NDArray

from meltemi.core.kernel import kernel
from meltemi.maths.generic import where, whole
from meltemi.maths.tables import Table, number
from meltemi.maths.vectors import Vec

Float = NDArray[float64]


class WindParameters(Table, title="wind"):
    """Parameters of the wind."""

    kind: float = number("-", "0: series, 1: box")
    reference_height: float = number("m", "height at which the speed of a series is given")
    reference_length: float = number("m", "over which linear shears of a series act")
    roughness: float = number("m", "roughness length of the logarithmic profile; 0 for the power law")
    veer: float = number("rad/m", "turning of the direction with height")
    upflow: float = number("rad", "inclination of the flow")
    box_speed: float = number("m/s", "at which a box is carried")
    box_dt: float = number("s", "between planes of a box")
    box_dy: float = number("m", "between its points, lateral")
    box_dz: float = number("m", "between its points, vertical")
    box_y: float = number("m", "of its first column")
    box_z: float = number("m", "of its lowest row")
    box_x: float = number("m", "where its first plane stands at time 0")
    box_direction: float = number("rad", "direction from which a box is turned")
    periodic: float = number("-", "1: a box begins again after its last plane")


class WindNow(Table, title="wind series"):
    """Columns of a series."""

    time: float = number("s", "increasing")
    speed: float = number("m/s", "horizontal, at the reference height")
    direction: float = number("rad", "towards which -y: clockwise from above")
    vertical: float = number("m/s", "vertical speed")
    horizontal_shear: float = number(
        "-", "difference of speed across the reference length, to the left, over the speed"
    )
    exponent: float = number("-", "of the power law")
    vertical_shear: float = number("-", "linear vertical shear over the reference length")
    gust: float = number("m/s", "added to the speed everywhere")


KIND, REFERENCE_HEIGHT, REFERENCE_LENGTH, ROUGHNESS, VEER, UPFLOW = WindParameters.slots(
    "kind reference_height reference_length roughness veer upflow"
)
BOX_SPEED, BOX_DT, BOX_DY, BOX_DZ, BOX_Y, BOX_Z, BOX_X, BOX_DIRECTION, PERIODIC = WindParameters.slots(
    "box_speed box_dt box_dy box_dz box_y box_z box_x box_direction periodic"
)
TIME, SPEED, DIRECTION, VERTICAL, H_SHEAR, EXPONENT, V_SHEAR, GUST = WindNow.slots(
    "time speed direction vertical horizontal_shear exponent vertical_shear gust"
)


@kernel
def series_now(t: float, series: Float, now: Float) -> None:
    """Interpolate a series (rows, 8) to time ``t``; constant before its first and after its last row."""
    n = series.shape[0]
    i, j = 0, n - 1
    while j - i > 1:
        m = (i + j) // 2
        if series[m, TIME] <= t:
            i = m
        else:
            j = m
    span = series[j, TIME] - series[i, TIME]
    w = min(max((t - series[i, TIME]) / span, 0.0), 1.0) if span > 0.0 else 0.0
    for c in range(series.shape[1]):
        now[c] = series[i, c] + w * (series[j, c] - series[i, c])


@kernel
def series_velocity(p: Vec, wind: Float, now: Float) -> Vec:
    """Velocity of a series at point p (W-1 to W-3)."""
    z = max(p.z, 0.01)
    zr, z0 = wind[REFERENCE_HEIGHT], wind[ROUGHNESS]
    ratio = log(z / zr)
    if z0 > 0.0:
        profile = max(1.0 + ratio / log(zr / z0), 0.0)
    else:
        profile = exp(now[EXPONENT] * ratio)
    c, s = cos(now[DIRECTION]), sin(now[DIRECTION])
    across = p.y * c + p.x * s
    linear = (now[H_SHEAR] * across + now[V_SHEAR] * (p.z - zr)) / wind[REFERENCE_LENGTH]
    speed = now[SPEED] * (profile + linear) + now[GUST]
    turned = now[DIRECTION] + wind[VEER] * (p.z - zr)
    return Vec(speed * cos(turned), -speed * sin(turned), now[VERTICAL] + speed * tan(wind[UPFLOW]))


@kernel
def box_velocity(p: Vec, t: float, wind: Float, box: NDArray[float32]) -> Vec:
    """Velocity of a box (planes, rows, columns, 3) at point p, trilinear (W-4 to W-6).

    Beyond its sides the box continues with the values at its edge; below its lowest row the wind
    falls linearly to zero at the ground.
    """
    nt, nz, ny = box.shape[0], box.shape[1], box.shape[2]
    c, s = cos(wind[BOX_DIRECTION]), sin(wind[BOX_DIRECTION])
    x, y = p.x * c - p.y * s, p.x * s + p.y * c
    ti = (t + (wind[BOX_X] - x) / wind[BOX_SPEED]) / wind[BOX_DT]
    if wind[PERIODIC] > 0.0:
        ti -= nt * floor(ti / nt)
        i = min(max(whole(ti), 0), nt - 1)
        i1 = where(i + 1 < nt, i + 1, 0)
    else:
        ti = min(max(ti, 0.0), nt - 1.000001)
        i = min(max(whole(ti), 0), nt - 2)
        i1 = i + 1
    yi = min(max((y - wind[BOX_Y]) / wind[BOX_DY], 0.0), ny - 1.000001)
    zi = min(max((p.z - wind[BOX_Z]) / wind[BOX_DZ], 0.0), nz - 1.000001)
    # NaN must not index outside the box
    j, k = min(max(whole(yi), 0), ny - 2), min(max(whole(zi), 0), nz - 2)
    a, b, d = ti - i, yi - j, zi - k
    w00, w01, w10, w11 = (1.0 - d) * (1.0 - b), (1.0 - d) * b, d * (1.0 - b), d * b
    ground = min(max(p.z / wind[BOX_Z], 0.0), 1.0)
    u = _plane(box, i, k, j, 0, w00, w01, w10, w11)
    v = _plane(box, i, k, j, 1, w00, w01, w10, w11)
    w = _plane(box, i, k, j, 2, w00, w01, w10, w11)
    u = ground * (u + a * (_plane(box, i1, k, j, 0, w00, w01, w10, w11) - u))
    v = ground * (v + a * (_plane(box, i1, k, j, 1, w00, w01, w10, w11) - v))
    w = ground * (w + a * (_plane(box, i1, k, j, 2, w00, w01, w10, w11) - w))
    return Vec(u * c + v * s, -u * s + v * c, w)


@kernel
def _plane(
    box: NDArray[float32], i: int, k: int, j: int, m: int, w00: float, w01: float, w10: float, w11: float
) -> float:
    """Component m in plane i, bilinear."""
    return w00 * box[i, k, j, m] + w01 * box[i, k, j + 1, m] + w10 * box[i, k + 1, j, m] + w11 * box[i, k + 1, j + 1, m]


@kernel
def wind_velocity(p: Vec, t: float, wind: Float, now: Float, box: NDArray[float32]) -> Vec:
    """Wind velocity [m/s] at point p [m] and time t [s], inertial axes.

    Args:
      wind: table WIND.
      now: a series' row at time t, see :func:`series_now`.
      box: (planes, rows, columns, 3) [m/s].
    """
    if wind[KIND] == 0.0:
        return series_velocity(p, wind, now)
    return box_velocity(p, t, wind, box)
