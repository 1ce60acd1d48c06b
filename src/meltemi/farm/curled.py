"""Curled wakes: planes of points in place of axisymmetric profiles, with cross-flow velocities.

The trailing vortices of a yawed or tilted rotor deflect and curl its wake, which also swirls against the rotor.

Reference: docs/theory/wakes.md (K-19 to K-23); Martinez-Tossas et al. (2019); FAST.Farm of OpenFAST 5.0.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache, cached_property
from math import pi, sqrt
from typing import Any, ClassVar

import numpy as np
from numpy import float32, float64
from numpy.typing import NDArray

from meltemi.compiler import Box, kernel, neighbours, where, whole
from meltemi.farm.field import Deficit, PlaneField, WakeField, WakePart, across, between, sideways
from meltemi.farm.march import LEAST_VISCOSITY, LEAST_WIND, Mixing, age, totals
from meltemi.farm.quick import quick
from meltemi.farm.sets import NEAR_WAKE, WakeSet, disk_mean, gaussian_share, stream_tubes
from meltemi.maths.vectors import Vec, cross, dot

Float = NDArray[float64]
Single = NDArray[float32]
WIDE = 1.9
"""Half the side of a plane over the rotor diameter."""
VORTICES = np.arange(2, 100)
"""Numbers of the vortices along the rotor diameter, of 100: FAST.Farm's loop leaves out the lowest one."""
CORE = 0.2
"""Core radius of the vortices over the rotor diameter."""
CHUNK = 32
"""Numbers that are compared at once."""
STABLE = 0.2
"""Largest diffusion number of a step: viscosity times time over the square of the points' spacing."""
CARRIED = 0.5
"""Largest Courant number of a step: distance of advection across the wake over the points' spacing."""


class CurledField(WakeField):
    """Wakes with planes of square point grids, row by row upwards, each from right to left looking downwind.

    ``profile`` has shape (wakes, planes, points, 3): velocity [m/s] along the wake, to the left and upwards. ``around``
    has shape (2, 1, side, side): direction cosines of the points from the centre, to the left and upwards.
    """

    around: Box


class CurledPlanes(PlaneField, CurledField):
    """Curled wakes with the points of averages."""


class CurledPart(WakePart):
    """Curled wakes in the wind of one turbine."""

    system: ClassVar[Any] = CurledField


@kernel
def side_of(m: CurledField) -> int:
    """Number of points along the side of a plane."""
    return 2 * int(m.wakes.reach / m.wakes.spacing + 0.5) + 1


@kernel
def row(m: CurledField, k: int, i: int, j: int, w: float) -> tuple[float, float, float, float, float, float]:
    """Profiles at points j and j + 1, interpolated with weight w between planes i and i + 1."""
    a, b, c, d, e, f = neighbours(m.profile, k, i, j)
    u, v, x, y, z, t = neighbours(m.profile, k, i + 1, j)
    return a + w * (u - a), b + w * (v - b), c + w * (x - c), d + w * (y - d), e + w * (z - e), f + w * (t - f)


@between.variant
@kernel
def _(q: Vec, late: float, w: float, m: CurledField, k: int, i: int) -> Deficit:
    """Bilinear interpolation in a plane (K-23)."""
    n, aside = across(q, late, w, m, k, i)
    left, side, dr, planes = sideways(n), side_of(m), m.wakes.spacing, m.planes
    up = cross(n, left)
    y, z = dot(aside, left), dot(aside, up)
    at_y, at_z = (y + m.wakes.reach) / dr, (z + m.wakes.reach) / dr
    inside = (at_y >= 0.0) & (at_y < side - 1.0) & (at_z >= 0.0) & (at_z < side - 1.0)
    j, line = min(max(whole(at_y), 0), side - 2), min(max(whole(at_z), 0), side - 2)
    b, c, one = at_y - j, at_z - line, where(inside, 1.0, 0.0)
    V0, v0, w0, V1, v1, w1 = row(m, k, i, line * side + j, w)
    V2, v2, w2, V3, v3, w3 = row(m, k, i, (line + 1) * side + j, w)
    low, high = V0 + b * (V1 - V0), V2 + b * (V3 - V2)
    axial = one * (low + c * (high - low))
    vy = one * ((1.0 - c) * (v0 + b * (v1 - v0)) + c * (v2 + b * (v3 - v2)))
    vz = one * ((1.0 - c) * (w0 + b * (w1 - w0)) + c * (w2 + b * (w3 - w2)))
    factor = 0.0 * axial
    if m.wakes.added > 0.0:
        dy, dz = ((1.0 - c) * (V1 - V0) + c * (V3 - V2)) / dr, (high - low) / dr
        slope = (abs(dy * y + dz * z) + abs(dz * y - dy * z)) / sqrt(y * y + z * z + 1e-9)
        by_deficit = (1.0 - w) * planes.eddies_deficit[k, i] + w * planes.eddies_deficit[k, i + 1]
        by_slope = (1.0 - w) * planes.eddies_slope[k, i] + w * planes.eddies_slope[k, i + 1]
        factor = by_deficit * abs(axial) + one * by_slope * slope
    return Deficit(axial * n + vy * left + vz * up, axial, n, factor)


@kernel
def largest_of(x: Single) -> float:
    """Largest number of an array of CHUNK or more: so many running maxima, in vector registers."""
    n, most = x.shape[0], np.empty(CHUNK, float32)
    for j in range(CHUNK):
        most[j] = x[j]
    for chunk in range(1, n // CHUNK):
        part = x[chunk * CHUNK : chunk * CHUNK + CHUNK]
        for j in range(CHUNK):
            most[j] = max(most[j], part[j])
    for j in range(n - n % CHUNK, n):
        most[0] = max(most[0], x[j])
    for j in range(1, CHUNK):
        most[0] = max(most[0], most[j])
    return float64(most[0])


@kernel
def eddy_viscosity(
    V: Single, y: Single, z: Single, dr: float, outside: float, shear_viscosity: float, least: float, nu: Single
) -> float:
    """Fill the eddy viscosity [m^2/s] of a plane but its edge; return the largest (K-22); y, z: direction cosines.

    The loop runs over all rows at once, so that it fills vector registers, also over the edges, which are set to zero.
    """
    side, flat, out = V.shape[0], V.reshape(-1), nu.reshape(-1)
    row, up, down, inside = flat[side:], flat[2 * side + 1 :], flat[1:], out[side + 1 :]
    at_y, at_z = y.reshape(-1)[side + 1 :], z.reshape(-1)[side + 1 :]
    per, far, shear, low = float32(0.5 / dr), float32(outside), float32(shear_viscosity), float32(least)
    for j in range(flat.shape[0] - 2 * side - 2):
        dy, dz = row[j + 2] - row[j], up[j] - down[j]
        slope = (abs(dy * at_y[j] + dz * at_z[j]) + abs(dz * at_y[j] - dy * at_z[j])) * per
        inside[j] = far + shear * max(slope, low)
    for i in range(side):
        nu[i, 0], nu[i, side - 1], nu[0, i], nu[side - 1, i] = float32(0), float32(0), float32(0), float32(0)
    return largest_of(out)


@kernel
def advected(V: Single, vy: Single, vz: Single, nu: Single, h: float, g: float, new: Single) -> None:
    """A step of diffusion (h: step over the squared spacing) and of advection (g: step over the spacing) (K-21)."""
    side, flat, mixing = V.shape[0], V.reshape(-1), nu.reshape(-1)
    at, by, across_it = side + 1, float32(h), float32(g)
    row, above, below, out = flat[side:], flat[at + side :], flat[at - side :], new.reshape(-1)[at:]
    n, n_above, n_below = mixing[side:], mixing[at + side :], mixing[at - side :]
    a, b = vy.reshape(-1)[at:], vz.reshape(-1)[at:]
    for j in range(flat.shape[0] - 2 * side - 2):
        right, centre, left, up, down = row[j], row[j + 1], row[j + 2], above[j], below[j]
        flux = (n[j + 1] + n[j + 2]) * (left - centre) - (n[j + 1] + n[j]) * (centre - right)
        flux += (n[j + 1] + n_above[j]) * (up - centre) - (n[j + 1] + n_below[j]) * (centre - down)
        out[j] = centre + by * flux - across_it * (a[j] * (left - right) + b[j] * (up - down))
    for i in range(side):  # no flux through the edge, over which the loop ran
        new[i, 0], new[i, side - 1], new[0, i], new[side - 1, i] = V[i, 0], V[i, side - 1], V[0, i], V[side - 1, i]


@totals.variant
@kernel
def _(m: CurledField, k: int, i: int) -> None:
    """Sums over the points of a plane, column by column; the velocity across does not change along the wake."""
    side, planes, dr, plane = side_of(m), m.planes, m.wakes.spacing, m.profile[k, i].reshape(-1)
    sums, row = np.zeros((5, side), float32), np.empty(side, float32)
    flux, square, up, deepest, fastest = sums[0], sums[1], sums[2], sums[3], sums[4]
    for line in range(side):
        height, at = float32(line - side // 2), plane[3 * side * line : 3 * side * (line + 1)]
        for j in range(side):
            row[j] = at[3 * j]
        for j in range(side):
            deficit = max(-row[j], float32(0))
            flux[j] += deficit
            square[j] += row[j] * row[j]
            up[j] += height * deficit
            deepest[j] = min(deepest[j], row[j])
        if i == 0:
            for j in range(side):
                fastest[j] = max(fastest[j], abs(at[3 * j + 1]) + abs(at[3 * j + 2]))
    total, squares, left, upwards, low, high = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for j in range(side):
        total, squares, upwards = total + flux[j], squares + square[j], upwards + up[j]
        left += (j - side // 2) * flux[j]
        low, high = min(low, float64(deepest[j])), max(high, float64(fastest[j]))
    part = dr * dr / (2.0 * pi)
    planes.flux[k, i], planes.square[k, i], planes.deepest[k, i] = part * total, part * squares, low
    planes.left[k, i] = dr * left / total if total > 0.0 else 0.0
    planes.up[k, i] = dr * upwards / total if total > 0.0 else 0.0
    if i == 0:
        planes.fastest[k, i] = high


@age.variant
@kernel
def _(m: CurledField, k: int, i: int, dt: float, way: float, c: Mixing, along: Float, work: Float) -> None:
    """Explicit time steps in single precision, as many as stability requires; no flux through the edge."""
    planes, dr, side, n = m.planes, m.wakes.spacing, side_of(m), m.profile.shape[2]
    before, after, arrays = m.profile[k, i].reshape(-1), m.profile[k, i + 1].reshape(-1), np.empty((5, n), float32)
    axial, left, up = arrays[0], arrays[1], arrays[2]
    for j in range(n):
        axial[j], left[j], up[j] = before[3 * j], before[3 * j + 1], before[3 * j + 2]
    for j in range(3 * n):
        after[j] = before[j]
    square = arrays.reshape(5, side, side)
    V, vy, vz, nu, new = square[0], square[1], square[2], square[3], square[4]
    U = max(planes.wind[k, i], LEAST_WIND)
    outside = max(c.ambient * along[0, i] * planes.intensity[k, i], 2.0 * LEAST_VISCOSITY) * c.radius * U
    shear_viscosity, least = c.shear * along[1, i] * c.radius * c.radius, max(U + planes.deepest[k, i], 0.0) / c.radius
    most = eddy_viscosity(V, m.around[0, 0], m.around[1, 0], dr, outside, shear_viscosity, least, nu)
    steps = 1 + int(max(most * dt / (STABLE * dr * dr), planes.fastest[k, i] * dt / (CARRIED * dr)))
    h, g = 0.5 * dt / steps / (dr * dr), 0.5 * dt / steps / dr
    for _ in range(steps):
        advected(V, vy, vz, nu, h, g, new)
        V, new = new, V
    axial = V.reshape(-1)
    for j in range(n):
        after[3 * j] = axial[j]
    planes.eddies_deficit[k, i + 1] = along[2, i + 1] / U
    planes.eddies_slope[k, i + 1] = along[3, i + 1] * c.radius / U


@kernel
def inlet_plane(
    deficit: Float, swirl: Float, sheet: Float, skew: Float, circulation: float, spacing: float, half: int
) -> Float:
    """(points, 3) velocity [m/s] along the wake, to the left and upwards, behind a rotor (K-19, K-20).

    Args:
      deficit, swirl: (R,) [m/s] axial velocity, and velocity around the axis, at equidistant radii.
      sheet: (4, n, n) stream function of the trailing vortices as of :func:`vortex_sheet`.
      skew: (2,) direction of the skew, to the left and upwards; zero without.
      circulation: [m^2/s] factor of the sheet.
      spacing: [m] between points, radii and the sheet's points.
      half: number of points from the centre to an edge.
    """
    side, last = 2 * half + 1, deficit.shape[0] - 1
    plane, sharp = np.zeros((side * side, 3)), np.zeros((side + 2, side + 2))
    for i in range(side):
        for j in range(side):
            y, z, at = j - half, i - half, i * side + j
            r = sqrt(y * y + z * z)
            n = min(int(r), last - 1)
            w = r - n
            if r <= last:
                sharp[i + 1, j + 1] = (1.0 - w) * deficit[n] + w * deficit[n + 1]
                around = ((1.0 - w) * swirl[n] + w * swirl[n + 1]) / max(r, 1e-9)
                plane[at, 1], plane[at, 2] = around * z, -around * y
            if circulation != 0.0:
                left, up = skew[0], skew[1]
                beside, along = slopes(sheet, -left * y - up * z, up * y - left * z)
                plane[at, 1] -= circulation * (left * along + up * beside) / spacing
                plane[at, 2] += circulation * (left * beside - up * along) / spacing
    for i in range(side):
        for j in range(side):
            total = 0.0
            for a in range(3):
                total += sharp[i + a, j] + sharp[i + a, j + 1] + sharp[i + a, j + 2]
            plane[i * side + j, 0] = total / 9.0
    return plane


@kernel
def slopes(sheet: Float, x: float, y: float) -> tuple[float, float]:
    """Derivatives by x and y of a surface of cubic cells, at a point in spacings from the middle.

    ``sheet`` has its values, derivatives by x, by y and mixed ones at the corners, so that it is the spline of these.
    """
    half, last = 0.5 * (sheet.shape[1] - 1), sheet.shape[1] - 2
    i, j = min(max(int(x + half), 0), last), min(max(int(y + half), 0), last)
    s, t = x + half - i, y + half - j
    by_x, by_y = 0.0, 0.0
    for a in range(2):
        p, q = (1.0 - s, 1.0) if a == 0 else (s, -1.0)  # distance from the opposite side, direction
        value_x, rate_x = p * p * (3.0 - 2.0 * p), q * p * p * (1.0 - p)
        d_value_x, d_rate_x = -q * 6.0 * p * (1.0 - p), 3.0 * p * p - 2.0 * p
        for b in range(2):
            u, v = (1.0 - t, 1.0) if b == 0 else (t, -1.0)
            value_y, rate_y = u * u * (3.0 - 2.0 * u), v * u * u * (1.0 - u)
            d_value_y, d_rate_y = -v * 6.0 * u * (1.0 - u), 3.0 * u * u - 2.0 * u
            f, fx, fy, fxy = (
                sheet[0, i + a, j + b],
                sheet[1, i + a, j + b],
                sheet[2, i + a, j + b],
                sheet[3, i + a, j + b],
            )
            by_x += d_value_x * (value_y * f + rate_y * fy) + d_rate_x * (value_y * fx + rate_y * fxy)
            by_y += d_value_y * (value_x * f + rate_x * fx) + d_rate_y * (value_x * fy + rate_x * fxy)
    return by_x, by_y


@cache
def vortex_sheet(radius: float, spacing: float, half: int) -> Any:
    """Spline of the stream function of the trailing vortices of unit circulation, along the upward axis (K-19)."""
    from scipy.interpolate import RectBivariateSpline
    from scipy.special import exp1

    y = spacing * np.arange(-1.5 * half, 1.5 * half + 1.0)  # corners of a rotated plane
    place = (0.02 * VORTICES - 1.0) * radius
    strength = 0.02 * place / np.sqrt(radius**2 - place**2)
    psi = np.zeros((len(y), len(y)))
    for z, one in zip(place, strength, strict=True):
        square = (y[:, None] ** 2 + (y - z) ** 2) / (2.0 * CORE * radius) ** 2 + 1e-12
        psi += one / (4.0 * np.pi) * (np.log(square) + exp1(square))
    return RectBivariateSpline(y, y, psi)


@cache
def corners_of(radius: float, spacing: float, half: int) -> Float:
    """(4, n, n) values of :func:`vortex_sheet` at its points, and derivatives by both places in spacings, and mixed."""
    spline = vortex_sheet(radius, spacing, half)
    y = spacing * np.arange(-1.5 * half, 1.5 * half + 1.0)
    orders = ((0, 0), (1, 0), (0, 1), (1, 1))
    return np.array([spacing ** (a + b) * spline(y, y, dx=a, dy=b) for a, b in orders])


@dataclass(frozen=True)
class Curled:
    """Properties of the planes of curled wakes.

    Attributes:
      model: set of constants.
      r: [m] equidistant radii.
      diameter: [m] largest rotor diameter.
    """

    model: WakeSet
    r: Float
    diameter: float
    part: ClassVar[Any] = CurledPart
    field: ClassVar[Any] = CurledField
    planes: ClassVar[Any] = CurledPlanes

    @property
    def half(self) -> int:
        """Number of points from the centre to an edge of a plane."""
        return round(WIDE * self.diameter / float(self.r[1]))

    @property
    def reach(self) -> float:
        """Half the side length [m] of a plane."""
        return self.half * float(self.r[1])

    @property
    def points(self) -> int:
        """Number of points of a plane."""
        return (2 * self.half + 1) ** 2

    @cached_property
    def places(self) -> tuple[Float, Float, Float]:
        """(points,) [m] coordinates to the left and upwards, and distance from the centre."""
        line = self.r[1] * np.arange(-self.half, self.half + 1)
        z, y = (each.ravel() for each in np.meshgrid(line, line, indexing="ij"))
        return y, z, np.hypot(y, z)

    @property
    def arrays(self) -> dict[str, Any]:
        """Arrays of :class:`CurledField` in addition to those of all wakes."""
        y, z, away = self.places
        side = 2 * self.half + 1
        return {"around": (np.array([y, z]) / np.maximum(away, 1e-9)).reshape(2, 1, side, side).astype(np.float32)}

    def inlet(self, state: dict[str, Any], radius: float, wind: float) -> Float:
        """(points, 3) profiles behind a rotor: deficit, smoothed, trailing vortices and swirl (K-19, K-20)."""
        (thrust, driving), r = state["load"], self.r
        deficit, total = self.model.inlet(r, thrust, radius, wind), disk_mean(r, thrust, radius)
        a, widened = stream_tubes(r, thrust, NEAR_WAKE)
        swirl = (1.0 - gaussian_share(total)) * NEAR_WAKE * wind / 4.0 * np.interp(r, widened, driving)
        swirl /= 1.0 - np.interp(r, widened, a)
        sine = float(np.hypot(*state["skew"]))
        skewed = sine > 1e-9
        circulation = radius * state["ambient"] * total * sine * math.sqrt(max(1.0 - sine**2, 0.0)) if skewed else 0.0
        skew = state["skew"] / sine if skewed else np.zeros(2)
        sheet = corners_of(radius, float(r[1]), self.half)
        return quick(inlet_plane, deficit, swirl, sheet, skew, circulation, float(r[1]), self.half)

    def quadrature_error(self, diameter: float, rings: int) -> Float:
        """Zero: averages over a plane are sums over its points."""
        return np.zeros(0)
