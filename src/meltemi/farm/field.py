"""Wind with wakes as a function of position: ambient wind plus the deficits of all wakes that reach a point.

A wake is a series of planes that drift downstream. Each has a centre, a normal and profiles of velocity and added
turbulence, axisymmetric here (curled.py has others), which are interpolated linearly between planes. There is
no grid: the field is evaluated at the nodes of turbines, in lanes, and at the points of the averages over planes.

Reference: docs/theory/wakes.md (K-10 to K-14).
"""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt
from typing import Any, ClassVar, NamedTuple

from meltemi.compiler import (
    Array2,
    Box,
    Constant,
    Entries,
    Nodes,
    Numbers,
    Table,
    Vectors,
    anywhere,
    by_record,
    floor,
    kernel,
    neighbours,
    number,
    where,
    whole,
    xyz,
)
from meltemi.maths.vectors import Sym, Vec, dot
from meltemi.simulation.parts import Part
from meltemi.wind.velocity import WindField, ambient_velocity, wind_velocity

QUADRATIC, LINEAR, LARGEST = 0.0, 1.0, 2.0
LEAST_RADIUS = 1e-3
"""[m] distance from the centre below which the radial direction is undefined, and the radial velocity zero."""


class Wakes(Table, title="wakes"):
    """Parameters of the wakes for an observer."""

    origin_x: float = number("m", "origin of the observer's axes in those of the farm, first coordinate")
    origin_y: float = number("m", "origin of these axes, second coordinate")
    time: float = number("s", "time of the positions of the planes")
    spacing: float = number("m", "spacing of the points of a profile")
    reach: float = number("m", "radius up to which a profile extends")
    merging: float = number("-", "0: root of the sum of squares, 1: sum, 2: largest deficit")
    ceiling: float = number("m", "height up to which averages over planes count")
    added: float = number("-", "1: with the turbulence that wakes add")
    eddy_spacing: float = number("m", "spacing of the points of the added turbulence")
    eddy_speed_x: float = number("m/s", "velocity of the added turbulence, first component")
    eddy_speed_y: float = number("m/s", "velocity of the added turbulence, second component")
    disk: Vec = xyz("m", "centre of the observer's disk, axes of the farm")
    span: float = number("m", "half the length along the wakes in which the observer evaluates them; 0: no limit")
    searched: float = number("s", "time of the last search for planes within that length")


class Planes(Table, axes="wake plane"):
    """Planes of the wakes, from the rotor downstream."""

    centre: Vectors = xyz("m", "centre, axes of the farm")
    normal: Vectors = xyz("-", "unit vector along the wake: the rotor's axis when the plane left it")
    velocity: Vectors = xyz("m/s", "velocity of the centre")
    axial: Numbers = number("m/s", "filtered velocity along the normal, with which the profile ages")
    travelled: Numbers = number("m", "path along the normal since the rotor")
    wind: Numbers = number("m/s", "filtered ambient wind along the normal, at the rotor when the plane left it")
    intensity: Numbers = number("-", "filtered ambient turbulence intensity there")
    yaw: Numbers = number("rad", "filtered yaw error there")
    eddies_deficit: Numbers = number("s/m", "factor of added turbulence over the deficit, for curled wakes")
    eddies_slope: Numbers = number("s", "the same over slopes of the axial velocity")
    flux: Numbers = number("m^3/s", "integral of the deficit over the plane, over 2 pi")
    square: Numbers = number("m^4/s^2", "integral of the squared deficit over the plane, over 2 pi")
    left: Numbers = number("m", "centroid of the deficit from the centre, to the left")
    up: Numbers = number("m", "centroid of the deficit from the centre, upwards")
    deepest: Numbers = number("m/s", "lowest axial velocity, for curled wakes")
    fastest: Numbers = number("m/s", "largest sum of the velocities to the left and upwards, for curled wakes")


class VisiblePlanes(Table, axes="wake", integer=True):
    """Range of planes of each wake that an observer evaluates: empty where first and last are equal."""

    wakes: int
    first: Entries[int] = number("-", "first plane now")
    last: Entries[int] = number("-", "last plane now")
    begin: Entries[int] = number("-", "first plane until the next exchange")
    end: Entries[int] = number("-", "last plane until the next exchange")
    wake: Entries[int] = number("-", "wakes with such planes, then -1")


class WakeField(WindField):
    """Ambient wind with wakes.

    ``longest`` has shape (2, wakes): largest distance [m] between the centres of neighbouring planes, and between the
    tips of their normals. ``profile`` has shape (wakes, planes, points, 3): axial and radial velocity [m/s] of the
    wake, negative where it is slower than the wind, and factor [-] of the added turbulence. ``eddies`` is
    (n, n, n + 1, 3), isotropic turbulence of unit variance [m/s] by x, z and y; its last column is the first one.
    """

    wakes: Constant[Wakes]
    planes: Constant[Planes]
    profile: Box
    visible: Constant[VisiblePlanes]
    longest: Constant[Array2]
    eddies: Box


class PlaneField(WakeField):
    """Wind with wakes and the points of averages, read eight at a time: (3, n) sideways, upwards [m] and weight.

    ``drift`` has the points for a plane of a wake, ``disk`` for the ambient wind at the rotor, ``span`` for the wind
    over the span of its blades.
    """

    drift: Constant[Nodes[Array2]]
    disk: Constant[Nodes[Array2]]
    span: Constant[Nodes[Array2]]


class Deficit(NamedTuple):
    """Velocity that one wake adds at a point, its component along the wake, the wake direction, added turbulence."""

    velocity: Vec
    axial: float
    normal: Vec
    turbulence: float


@kernel
def sideways(n: Vec) -> Vec:
    """Horizontal unit vector across a direction, to the left."""
    h = 1.0 / sqrt(max(n.x * n.x + n.y * n.y, 1e-12))
    return Vec(-h * n.y, h * n.x, 0.0)


@kernel
def before(q: Vec, late: float, m: WakeField, k: int, i: int) -> float:
    """Distance [m] of a point downstream of plane i of wake k, ``late`` [s] after the planes' time."""
    c = m.planes.centre[k, i] + late * m.planes.velocity[k, i]
    return dot(m.planes.normal[k, i], q - c)


@kernel
def across(q: Vec, late: float, w: float, m: WakeField, k: int, i: int) -> tuple[Vec, Vec]:
    """Direction of wake k at a point, interpolated by w between planes i and i + 1; vector [m] from its centre."""
    planes = m.planes
    first = planes.centre[k, i] + late * planes.velocity[k, i]
    second = planes.centre[k, i + 1] + late * planes.velocity[k, i + 1]
    n = (1.0 - w) * planes.normal[k, i] + w * planes.normal[k, i + 1]
    aside = q - ((1.0 - w) * first + w * second)
    return n, aside - dot(n, aside) * n


@by_record
def between(q: Vec, late: float, w: float, m: WakeField, k: int, i: int) -> Deficit:
    """Deficit at a point between planes i and i + 1 of wake k, interpolated by w (K-10)."""
    raise NotImplementedError


@between.variant
@kernel
def _(q: Vec, late: float, w: float, m: WakeField, k: int, i: int) -> Deficit:
    n, aside = across(q, late, w, m, k, i)
    last, r = m.profile.shape[2] - 1, sqrt(dot(aside, aside))
    place = r / m.wakes.spacing
    j = min(max(whole(place), 0), last - 1)
    b = place - j
    x0, y0, z0, x1, y1, z1 = neighbours(m.profile, k, i, j)
    x2, y2, z2, x3, y3, z3 = neighbours(m.profile, k, i + 1, j)
    inside = place < last
    axial = where(inside, (1.0 - w) * (x0 + b * (x1 - x0)) + w * (x2 + b * (x3 - x2)), 0.0)
    radial = where(inside, (1.0 - w) * (y0 + b * (y1 - y0)) + w * (y2 + b * (y3 - y2)), 0.0)
    factor = where(inside, (1.0 - w) * (z0 + b * (z1 - z0)) + w * (z2 + b * (z3 - z2)), 0.0)
    return Deficit(axial * n + where(r > LEAST_RADIUS, radial / max(r, LEAST_RADIUS), 0.0) * aside, axial, n, factor)


@kernel
def search(t: float, m: WakeField) -> None:
    """Select the planes that an observer's disk can meet now from those that it can meet until the next exchange."""
    g, seen = m.wakes, m.visible
    late, g.searched = t - g.time, t
    for j in range(seen.wakes):
        k = seen.wake[j]
        if k < 0:
            break
        begin, end, first, last = seen.begin[k], seen.end[k], 0, 0
        ahead = before(g.disk, late, m, k, begin)
        for i in range(begin, end):
            downstream, ahead = ahead, before(g.disk, late, m, k, i + 1)
            if downstream + g.span >= 0.0 and ahead < g.span:
                if last == 0:
                    first = i
                last = i + 1
        seen.first[k], seen.last[k] = first, last


@kernel
def wakes_velocity(p: Vec, t: float, m: WakeField) -> Vec:
    """Velocity [m/s] that the wakes add to the ambient wind at a point of the observer's axes (K-12 to K-14)."""
    g, seen = m.wakes, m.visible
    if g.span > 0.0 and g.searched != t:
        search(t, m)
    q, late = Vec(p.x + g.origin_x, p.y + g.origin_y, p.z), t - g.time
    o = 0.0 * q.x  # zero of the number type of the point
    velocity, direction, strongest, largest = Vec(o, o, o), Vec(o, o, o), Vec(o, o, o), o
    squares, turbulence, fastest = Sym(o, o, o, o, o, o), o, o
    several = seen.wakes > 1 and seen.wake[1] >= 0
    for place in range(seen.wakes):
        k = seen.wake[place]
        if k < 0:
            break
        first, last = seen.first[k], seen.last[k]
        if first < last:
            s = before(q, late, m, k, first)
            for i in range(first, last):
                following = before(q, late, m, k, i + 1)
                inside = (s >= 0.0) & (following < 0.0)
                if anywhere(inside):
                    d = between(q, late, where(inside, s / where(inside, s - following, 1.0), 0.0), m, k, i)
                    one = where(inside, 1.0, 0.0)
                    v, size = one * d.velocity, one * abs(d.axial)
                    velocity += v
                    direction += size * d.normal
                    turbulence += one * d.turbulence * d.turbulence
                    fastest = max(fastest, one * d.axial)
                    if several:
                        squares += Sym(v.x * v.x, v.y * v.y, v.z * v.z, v.x * v.y, v.x * v.z, v.y * v.z)
                        more = size > largest
                        largest = where(more, size, largest)
                        strongest = Vec(
                            where(more, v.x, strongest.x), where(more, v.y, strongest.y), where(more, v.z, strongest.z)
                        )
                s = following
    # a single wake merges with none: M of K-13 is its velocity along its direction, but where that is positive
    if (g.merging != LINEAR) & (several | (anywhere(fastest > 0.0) & (g.merging == QUADRATIC))):
        length = sqrt(dot(direction, direction))
        n = where(length > 0.0, 1.0 / where(length > 0.0, length, 1.0), 0.0) * direction
        along = dot(velocity, n)
        merged = -abs(along)
        if several:
            merged = dot(strongest, n) if g.merging == LARGEST else -sqrt(max(dot(n, squares @ n), 0.0))
        velocity += (merged - along) * n
    if (g.added > 0.0) & anywhere(turbulence > 0.0):
        velocity += sqrt(turbulence) * eddy(q, t, m)
    return velocity


@kernel
def eddy(q: Vec, t: float, m: WakeField) -> Vec:
    """Isotropic turbulence [m/s] of unit variance at a point of the farm; it repeats in all directions (K-14)."""
    g, n = m.wakes, m.eddies.shape[0]
    x, y, z = (
        (q.x - t * g.eddy_speed_x) / g.eddy_spacing,
        (q.y - t * g.eddy_speed_y) / g.eddy_spacing,
        q.z / g.eddy_spacing,
    )
    x, y, z = x - n * floor(x / n), y - n * floor(y / n), z - n * floor(z / n)
    i, j, k = min(max(whole(x), 0), n - 1), min(max(whole(y), 0), n - 1), min(max(whole(z), 0), n - 1)
    a, b, c = x - i, y - j, z - k
    next_i, next_k = where(i + 1 < n, i + 1, 0), where(k + 1 < n, k + 1, 0)
    near = (1.0 - c) * pair(m, i, k, j, b) + c * pair(m, i, next_k, j, b)
    far = (1.0 - c) * pair(m, next_i, k, j, b) + c * pair(m, next_i, next_k, j, b)
    return (1.0 - a) * near + a * far


@kernel
def pair(m: WakeField, i: int, k: int, j: int, b: float) -> Vec:
    """Velocity in a row of the eddies, interpolated linearly by b from column j to the next."""
    x, y, z, next_x, next_y, next_z = neighbours(m.eddies, i, k, j)
    return (1.0 - b) * Vec(x, y, z) + b * Vec(next_x, next_y, next_z)


@wind_velocity.variant
@kernel
def _(p: Vec, t: float, m: WakeField) -> Vec:
    return ambient_velocity(p, t, m) + wakes_velocity(p, t, m)


@dataclass(frozen=True)
class WakePart(Part):
    """Wakes in the wind of one turbine.

    Attributes:
      members: arrays of :class:`WakeField` in addition to those of the ambient wind; the farm updates them between
        steps.
    """

    system: ClassVar[Any] = WakeField
    members: dict[str, Any]

    def arrays(self) -> dict[str, Any]:
        """The arrays without copies; turbines share those that are not specific to one of them."""
        return self.members
