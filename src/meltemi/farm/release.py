"""Begin of a wake: load coefficients of its rotor, and the plane that leaves it with filtered states.

Reference: docs/theory/wakes.md (K-1, K-1a, K-4).
"""

from __future__ import annotations

from math import pi, sqrt

import numpy as np
from numpy import float64
from numpy.typing import NDArray

from meltemi.compiler import Table, kernel, number, xyz
from meltemi.farm.field import WakeField, sideways
from meltemi.maths.vectors import Vec, dot

Float = NDArray[float64]
FINE = 40
"""Points between the radii of a profile for integrals of the load along the blade."""
MOST_THRUST = 2.0
"""Largest thrust coefficient at any radius."""
LEAST_RADIUS = 1e-3
"""[m] least radius of a load coefficient."""


class Released(Table, title="state of a rotor with which a plane leaves it"):
    """Filtered quantities, in addition to the load coefficients."""

    hub: Vec = xyz("m", "rotor apex, axes of the farm")
    axis: Vec = xyz("-", "direction of the rotor axis, downwind")
    relative: float = number("m/s", "mean wind over the span of the blades along the axis, relative to the hub")
    ambient: float = number("m/s", "mean ambient wind along the axis")
    intensity: float = number("-", "ambient turbulence intensity")
    yaw: float = number("rad", "yaw error, from the axis to the wind")
    skew_left: float = number("-", "direction cosine of the wind in the rotor plane, to the left")
    skew_up: float = number("-", "direction cosine of the wind in the rotor plane, upwards")


@kernel
def load_coefficients(
    radius: Float, load: Float, spacing: float, tip: float, density: float, wind: float, out: Float
) -> None:
    """Fill ``out`` with local coefficients of thrust and driving force at equidistant radii from 0 (K-1, K-1a).

    Args:
      radius: (n,) [m] radii of the load, increasing.
      load: (2, n) [N/m] loads of all blades, linear in between and zero elsewhere.
      spacing: [m] between the radii of ``out``.
      tip: [m] rotor radius.
      density: [kg/m^3] air density.
      wind: [m/s] wind along the axis, positive.
      out: (2, R) output array.
    """
    n, last, work = out.shape[1], radius.shape[0] - 1, np.empty(out.shape[1])
    for c in range(out.shape[0]):
        b, j = out[c], 0
        for i in range(n):
            b[i] = 0.0
        for i in range(n):  # integrals of the load times functions that are linear between neighbouring radii
            for s in range(FINE):
                x, w = spacing / FINE * (i * FINE + s), s / FINE
                if x < radius[0] or x > radius[last]:
                    continue
                while j < last - 1 and radius[j + 1] <= x:
                    j += 1
                span = radius[j + 1] - radius[j]
                value = load[c, j] + (load[c, j + 1] - load[c, j]) * ((x - radius[j]) / span if span > 0.0 else 0.0)
                b[i] += (1.0 - w) * value / FINE
                if i + 1 < n:
                    b[i + 1] += w * value / FINE
        # mass matrix of these functions over the spacing: 4/6, 1/6 on both sides, 1/3 at the centre
        work[0], b[0] = 0.5, 3.0 * b[0]
        for i in range(1, n):
            pivot = 4.0 - work[i - 1]
            work[i], b[i] = 1.0 / pivot, (6.0 * b[i] - b[i - 1]) / pivot
        for i in range(n - 2, -1, -1):
            b[i] -= work[i] * b[i + 1]
        for i in range(n):
            r = spacing * i
            local = b[i] / max(r, LEAST_RADIUS) / (density * pi * wind * wind)
            least = 0.0 if c == 0 else -MOST_THRUST
            # the projection gives points beyond the tip a share of the load
            b[i] = min(max(local, least), MOST_THRUST) if 0.0 < r < tip + spacing else 0.0


@kernel
def release(
    m: WakeField, k: int, new: Released, loads: Float, old: Released, kept: Float, keep: float, way: Float
) -> None:
    """Set the plane of wake k at its rotor from filtered states (K-4).

    Args:
      new, loads: state and (2, R) load coefficients since the last exchange.
      old, kept: the filtered ones, which are updated.
      keep: share of the filtered ones that remains; 0 for the first plane of a wake.
      way: lateral offset [m] of the plane, the same per radian of yaw error.
    """
    a, b = new.array, old.array
    for i in range(a.shape[0]):
        b[i] = keep * b[i] + (1.0 - keep) * a[i]
    for c in range(loads.shape[0]):
        for i in range(loads.shape[1]):
            kept[c, i] = keep * kept[c, i] + (1.0 - keep) * loads[c, i]
    axis = (1.0 / sqrt(dot(old.axis, old.axis))) * old.axis
    old.axis = axis
    planes = m.planes
    planes.centre[k, 0] = old.hub + (way[0] + way[1] * old.yaw) * sideways(axis)
    planes.normal[k, 0] = axis
    planes.travelled[k, 0] = 0.0
    planes.wind[k, 0], planes.intensity[k, 0], planes.yaw[k, 0] = old.ambient, old.intensity, old.yaw
    if keep == 0.0:
        planes.axial[k, 0] = old.ambient


@kernel
def within(m: WakeField, k: int, count: int, reach: float) -> int:
    """Number of planes of wake k up to the first one that has travelled further than its reach [m]."""
    for i in range(count):
        if m.planes.travelled[k, i] > reach:
            return i + 1
    return count
