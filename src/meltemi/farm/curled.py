"""Curled wakes: planes of points in place of axisymmetric profiles, with cross-flow velocities.

The trailing vortices of a yawed or tilted rotor deflect and curl its wake, which also swirls against the rotor.

Reference: docs/theory/wakes.md (K-19 to K-23); Martinez-Tossas et al. (2019); FAST.Farm of OpenFAST 5.0.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache, cached_property
from math import sqrt
from typing import Any, ClassVar

import numpy as np
from numpy import float64
from numpy.typing import NDArray

from meltemi.compiler import Array2, Constant, kernel, neighbours, where, whole
from meltemi.farm.field import Deficit, PlaneField, WakeField, WakePart, across, between, sideways
from meltemi.farm.march import LEAST_VISCOSITY, LEAST_WIND, Mixing, age
from meltemi.farm.sets import NEAR_WAKE, WakeSet, disk_mean, gaussian_share, stream_tubes
from meltemi.maths.vectors import Vec, cross, dot

Float = NDArray[float64]
WIDE = 1.9
"""Half the side of a plane over the rotor diameter."""
VORTICES = np.arange(2, 100)
"""Numbers of the vortices along the rotor diameter, of 100: FAST.Farm's loop leaves out the lowest one."""
CORE = 0.2
"""Core radius of the vortices over the rotor diameter."""
STABLE = 0.2
"""Largest diffusion number of a step: viscosity times time over the square of the points' spacing."""
CARRIED = 0.5
"""Largest Courant number of a step: distance of advection across the wake over the points' spacing."""


class CurledField(WakeField):
    """Wakes with planes of square point grids, row by row upwards, each from right to left looking downwind.

    ``profile`` has shape (wakes, planes, points, 3): velocity [m/s] along the wake, to the left and upwards. ``around``
    has shape (2, points): direction cosines of the points from the centre, to the left and upwards.
    """

    around: Constant[Array2]


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
def eddy_viscosity(
    V: Array2, y: Array2, z: Array2, dr: float, outside: float, shear_viscosity: float, least: float, nu: Array2
) -> float:
    """Fill the eddy viscosity [m^2/s] of a plane but its edge; return the largest (K-22); y, z: direction cosines."""
    most = 0.0
    for i in range(1, V.shape[0] - 1):
        for j in range(1, V.shape[1] - 1):
            dy, dz = V[i, j + 1] - V[i, j - 1], V[i + 1, j] - V[i - 1, j]
            slope = (abs(dy * y[i, j] + dz * z[i, j]) + abs(dz * y[i, j] - dy * z[i, j])) / (2.0 * dr)
            nu[i, j] = outside + shear_viscosity * max(slope, least)
            most = max(most, nu[i, j])
    return most


@kernel
def advected(V: Array2, vy: Array2, vz: Array2, nu: Array2, h: float, g: float, new: Array2) -> None:
    """A step of diffusion (h: step over the squared spacing) and of advection (g: step over the spacing) (K-21)."""
    for i in range(1, V.shape[0] - 1):
        for j in range(1, V.shape[1] - 1):
            centre, left, right, up, down = V[i, j], V[i, j + 1], V[i, j - 1], V[i + 1, j], V[i - 1, j]
            flux = (nu[i, j] + nu[i, j + 1]) * (left - centre) - (nu[i, j] + nu[i, j - 1]) * (centre - right)
            flux += (nu[i, j] + nu[i + 1, j]) * (up - centre) - (nu[i, j] + nu[i - 1, j]) * (centre - down)
            new[i, j] = centre + h * flux - g * (vy[i, j] * (left - right) + vz[i, j] * (up - down))


@age.variant
@kernel
def _(m: CurledField, k: int, i: int, dt: float, way: float, c: Mixing, along: Float, work: Float) -> None:
    """Explicit time steps, as many as stability requires; no flux through the edge."""
    planes, dr, side, n = m.planes, m.wakes.spacing, side_of(m), m.profile.shape[2]
    U, deepest, fastest = max(planes.wind[k, i], LEAST_WIND), 0.0, 0.0
    for j in range(n):
        for axis in range(3):
            work[axis, j] = m.profile[k, i, j, axis]
        work[3, j], work[4, j] = 0.0, work[0, j]
        deepest, fastest = min(deepest, work[0, j]), max(fastest, abs(work[1, j]) + abs(work[2, j]))
    square = work.reshape(work.shape[0], side, side)
    V, vy, vz, nu, new = square[0], square[1], square[2], square[3], square[4]
    around = m.around.reshape(2, side, side)
    outside = max(c.ambient * along[0, i] * planes.intensity[k, i], 2.0 * LEAST_VISCOSITY) * c.radius * U
    shear_viscosity, least = c.shear * along[1, i] * c.radius * c.radius, max(U + deepest, 0.0) / c.radius
    most = eddy_viscosity(V, around[0], around[1], dr, outside, shear_viscosity, least, nu)
    steps = 1 + int(max(most * dt / (STABLE * dr * dr), fastest * dt / (CARRIED * dr)))
    h, g = 0.5 * dt / steps / (dr * dr), 0.5 * dt / steps / dr
    for _ in range(steps):
        advected(V, vy, vz, nu, h, g, new)
        V, new = new, V
    axial = V.reshape(n)
    for j in range(n):
        m.profile[k, i + 1, j, 0] = axial[j]
        m.profile[k, i + 1, j, 1], m.profile[k, i + 1, j, 2] = work[1, j], work[2, j]
    planes.eddies_deficit[k, i + 1] = along[2, i + 1] / U
    planes.eddies_slope[k, i + 1] = along[3, i + 1] * c.radius / U


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
        return {"around": np.array([y, z]) / np.maximum(away, 1e-9)}

    def inlet(self, state: dict[str, Any], radius: float, wind: float) -> Float:
        """(points, 3) profiles behind a rotor: deficit, smoothed, trailing vortices and swirl (K-19, K-20)."""
        from scipy.ndimage import uniform_filter

        (y, z, away), (thrust, driving), r = self.places, state["load"], self.r
        side, profile = 2 * self.half + 1, np.zeros((self.points, 3))
        deficit = np.interp(away, r, self.model.inlet(r, thrust, radius, wind), right=0.0)
        profile[:, 0] = uniform_filter(deficit.reshape(side, side), 3, mode="constant").ravel()
        total = disk_mean(r, thrust, radius)
        a, widened = stream_tubes(r, thrust, NEAR_WAKE)
        swirl = (1.0 - gaussian_share(total)) * NEAR_WAKE * wind / 4.0 * np.interp(r, widened, driving)
        around = np.interp(away, r, swirl / (1.0 - np.interp(r, widened, a)), right=0.0) / np.maximum(away, 1e-9)
        profile[:, 1], profile[:, 2] = around * z, -around * y
        sine = float(np.hypot(*state["skew"]))
        if sine > 1e-9:
            (left, up), cosine = state["skew"] / sine, math.sqrt(max(1.0 - sine**2, 0.0))
            circulation = radius * state["ambient"] * total * sine * cosine
            sheet, across = vortex_sheet(radius, float(r[1]), self.half), (-left * y - up * z, up * y - left * z)
            along, beside = (circulation * sheet.ev(*across, **order) for order in ({"dy": 1}, {"dx": 1}))
            profile[:, 1] -= left * along + up * beside
            profile[:, 2] += left * beside - up * along
        return profile

    def quadrature_error(self, diameter: float, rings: int) -> Float:
        """Zero: averages over a plane are sums over its points."""
        return np.zeros(0)

    def top_hats(self, V: Float) -> tuple[Float, Float, Float, Float]:
        """Integrals of deficits (planes, points) and of their squares over 2 pi, and the centroids [m] of deficits."""
        y, z, _ = self.places
        area, flux = self.r[1] ** 2 / (2.0 * np.pi), np.maximum(V, 0.0).sum(axis=1)
        whole = np.where(flux > 0.0, flux, np.inf)
        return area * flux, area * (V**2).sum(axis=1), np.maximum(V, 0.0) @ y / whole, np.maximum(V, 0.0) @ z / whole
