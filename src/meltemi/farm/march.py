"""Evolution of wakes: each plane becomes the next one downstream, and its profiles develop over the travelled distance.

Axisymmetric thin shear layer equations with an eddy viscosity: Crank-Nicolson along the wake, with coefficients of
the previous plane, so that each plane solves one tridiagonal system.

Reference: docs/theory/wakes.md (K-5 to K-8); Ainslie (1988).
"""

from __future__ import annotations

import numpy as np
from numpy import float64
from numpy.typing import NDArray

from meltemi.compiler import Table, by_record, kernel, number
from meltemi.farm.field import WakeField
from meltemi.maths.vectors import dot

Float = NDArray[float64]
LEAST_WIND = 0.5
"""[m/s] least wind speed of the march, also in reversed flow: a rotor at rest in calm air leaves no wake."""
LEAST_VISCOSITY = 1e-4
"""Least ambient eddy viscosity over diameter and wind."""
ENCLOSED = 0.95
"""Share of a deficit within the wake's half width, where a model has no other."""
CLOSE = 0.1
"""Least distance between planes over the travelled distance of a step."""


class Mixing(Table, title="mixing in a wake"):
    """Constants of the eddy viscosity and of added turbulence; those that vary along the wake are arrays by plane."""

    radius: float = number("m", "rotor radius")
    ambient: float = number("-", "factor of the eddy viscosity of the ambient turbulence")
    power: float = number("-", "exponent of the ambient turbulence intensity")
    shear: float = number("-", "factor of the eddy viscosity of the wake shear")
    gradient: float = number("-", "1: a mixing length times the gradient, where that is more")
    slowest: float = number("-", "1: of the slowest wind in the wake, 0: of the deepest deficit")
    rotor_wide: float = number("-", "1: the wake's half width is the rotor radius, 0: it encloses the deficit")


@kernel
def half_width(V: Float, spacing: float) -> float:
    """Radius [m] that encloses 95 % of a deficit."""
    whole = 0.0
    for j in range(1, V.shape[0]):
        whole += V[j] * (2.0 * j - 1.0)
    part = 0.0
    for j in range(1, V.shape[0]):
        part += V[j] * (2.0 * j - 1.0)
        if abs(part) >= ENCLOSED * abs(whole):
            return (j - 0.5) * spacing
    return 0.0


@kernel
def viscosity(
    V: Float, U: float, intensity: float, ambient: float, shear: float, spacing: float, c: Mixing, nu: Float
) -> None:
    """Eddy viscosity [m^2/s] of a plane (K-6).

    Args:
      V: axial velocity of the wake [m/s].
      U: ambient wind [m/s].
      ambient, shear: filters at this distance.
      nu: output array.
    """
    last, deepest = V.shape[0] - 1, 0.0
    for j in range(last + 1):
        deepest = min(deepest, V[j])
    b = c.radius if c.rotor_wide > 0.0 else half_width(V, spacing)
    least = b * max(U + deepest if c.slowest > 0.0 else -deepest, 0.0)
    outside = max(c.ambient * ambient * intensity**c.power * c.radius, 2.0 * LEAST_VISCOSITY * c.radius) * U
    for j in range(last + 1):
        slope = 0.0 if j == 0 else ((V[j + 1] if j < last else 0.0) - V[j - 1]) / (2.0 * spacing)
        nu[j] = outside + c.shear * shear * max(c.gradient * b * b * abs(slope), least)


@kernel
def one_step(  # noqa: PLR0913 - arrays of a kernel
    V: Float, Vr: Float, nu: Float, U: float, way: float, spacing: float, new: Float, new_r: Float, work: Float
) -> None:
    """Profiles after a distance [m] downstream (K-7, K-8).

    Args:
      V, Vr, nu: axial and radial velocity of the wake [m/s] and eddy viscosity there.
      U: ambient wind [m/s].
      new, new_r: output arrays.
      work: work array of the length of a profile.
    """
    n, dr = V.shape[0], spacing
    pivot = dr * (U + V[0]) / way + nu[0] / dr
    work[0] = -nu[0] / dr / pivot
    new[0] = ((dr * (U + V[0]) / way - nu[0] / dr) * V[0] + nu[0] / dr * V[1]) / pivot
    for j in range(1, n):
        outer = V[j + 1] if j < n - 1 else 0.0
        slope = (nu[j + 1] - nu[j - 1]) / (2.0 * dr) if j < n - 1 else 0.0
        carried = 0.25 * j * (Vr[j] - slope)
        A = -carried + (1.0 - 2.0 * j) * nu[j] / (4.0 * dr)
        C = carried - (1.0 + 2.0 * j) * nu[j] / (4.0 * dr) if j < n - 1 else 0.0
        along, across = j * dr * (U + V[j]) / way, j * nu[j] / dr
        pivot = along + across - A * work[j - 1]
        work[j] = C / pivot
        new[j] = (-A * V[j - 1] + (along - across) * V[j] - C * outer - A * new[j - 1]) / pivot
    for j in range(n - 2, -1, -1):
        new[j] -= work[j] * new[j + 1]
    new_r[0] = 0.0
    for j in range(1, n):
        change = new[j] + new[j - 1] - V[j] - V[j - 1]
        new_r[j] = (j - 1.0) / j * new_r[j - 1] - (2.0 * j - 1.0) * dr * change / (4.0 * j * way)


@by_record
def age(m: WakeField, k: int, i: int, dt: float, way: float, c: Mixing, along: Float, work: Float) -> None:
    """Compute the profiles of plane i + 1 of wake k from those of plane i after a time [s] and a distance [m].

    Args:
      along: (4, planes) filters of ambient and shear viscosity, factors of deficit and gradient in added turbulence.
      work: (6, points) work array.
    """
    raise NotImplementedError


@by_record
def totals(m: WakeField, k: int, i: int) -> None:
    """Compute the integrals over plane i of wake k from its profile."""
    raise NotImplementedError


@totals.variant
@kernel
def _(m: WakeField, k: int, i: int) -> None:
    dr, flux, square = m.wakes.spacing, 0.0, 0.0
    for j in range(m.profile.shape[2]):
        V = float64(m.profile[k, i, j, 0])
        flux -= j * V
        square += j * V * V
    m.planes.flux[k, i], m.planes.square[k, i] = dr * dr * flux, dr * dr * square


@age.variant
@kernel
def _(m: WakeField, k: int, i: int, dt: float, way: float, c: Mixing, along: Float, work: Float) -> None:
    planes, dr, n = m.planes, m.wakes.spacing, m.profile.shape[2]
    V, Vr, nu, new, new_r, U = work[0], work[1], work[2], work[3], work[4], max(planes.wind[k, i], LEAST_WIND)
    for j in range(n):
        V[j], Vr[j] = m.profile[k, i, j, 0], m.profile[k, i, j, 1]
        new[j], new_r[j] = V[j], Vr[j]
    if way > 0.0:
        viscosity(V, U, planes.intensity[k, i], along[0, i], along[1, i], dr, c, nu)
        one_step(V, Vr, nu, U, way, dr, new, new_r, work[5])
    for j in range(n):
        slope = 0.0 if j == 0 else ((new[j + 1] if j < n - 1 else 0.0) - new[j - 1]) / (2.0 * dr)
        m.profile[k, i + 1, j, 0], m.profile[k, i + 1, j, 1] = new[j], new_r[j]
        m.profile[k, i + 1, j, 2] = (along[2, i + 1] * abs(new[j]) + along[3, i + 1] * c.radius * abs(slope)) / U


@kernel
def march(m: WakeField, k: int, count: int, dt: float, keep: float, c: Mixing, along: Float) -> int:
    """Advance wake k by a step; plane 0 is unchanged and will be replaced by the new one at the rotor.

    Args:
      count: number of its planes.
      dt: [s] time step.
      keep: share of the filtered axial velocity that remains after a step.
      along: as of :func:`age`.

    Returns:
      The number of planes; one that has caught up with the plane ahead of it is removed.
    """
    planes, work = m.planes, np.empty((6, m.profile.shape[2]))
    count = min(count, m.profile.shape[1] - 1)
    for i in range(count - 1, -1, -1):
        speed = dot(planes.normal[k, i], planes.velocity[k, i])
        planes.axial[k, i] = keep * planes.axial[k, i] + (1.0 - keep) * speed
        inherit(m, k, i, i + 1)
        age(m, k, i, dt, abs(planes.axial[k, i]) * dt, c, along, work)
        totals(m, k, i + 1)
        planes.centre[k, i + 1] = planes.centre[k, i] + dt * planes.velocity[k, i]
        planes.travelled[k, i + 1] = planes.travelled[k, i] + abs(speed) * dt
    return ordered(m, k, count + 1, dt)


@kernel
def inherit(m: WakeField, k: int, i: int, to: int) -> None:
    """Copy position and filtered quantities of a plane of wake k to another one."""
    rows = m.planes.array
    for c in range(rows.shape[0]):
        rows[c, k, to] = rows[c, k, i]


@kernel
def ordered(m: WakeField, k: int, count: int, dt: float) -> int:
    """Remove planes of wake k that have caught up with the one ahead, so that planes remain in order."""
    planes, kept = m.planes, 2
    for i in range(2, count):
        before = kept - 1
        gap = dot(planes.normal[k, before], planes.centre[k, i] - planes.centre[k, before])
        if gap > CLOSE * LEAST_WIND * dt:
            if kept < i:
                inherit(m, k, i, kept)
                for j in range(m.profile.shape[2]):
                    for c in range(3):
                        m.profile[k, kept, j, c] = m.profile[k, i, j, c]
            kept += 1
    return min(kept, count)
