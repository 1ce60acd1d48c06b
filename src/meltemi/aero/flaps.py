"""Trailing-edge flaps: increments of the coefficients of a section.

The increments of lift, drag and moment are tables in angle of attack and deflection. Static coefficients are the
polar's plus the increments. In dynamic stall the lift of a flap is unsteady as if it were camber: as an angle

    Delta alpha = Delta C_l(alpha, delta) / C_La

it drives the wake lags together with the angle of attack, and is taken off the effective angle again before polars are
read (A-48). So lift builds up after Wagner, the steady state is the polar's plus the increment, and separation is that
of the section without deflection; what the flap changes in it is in the increments. The air that a moving
flap accelerates is left out: for a tenth of the chord it is small below 5 Hz.

Reference: docs/theory/aerodynamics.md (A-48, A-49).
"""

from __future__ import annotations

from math import pi

from meltemi.aero.air import Air
from meltemi.aero.polars import SectionCoefficients
from meltemi.aero.tables import FlapParameters as FlapParameters
from meltemi.compiler import Array3, Numbers, kernel, where, whole

STEP = pi / 180.0
"""[rad] step of the increments' grid, in both angles."""
ALPHAS, DELTAS = 81, 61
"""Rows and columns of the grid, symmetric about zero: 40 and 30 degrees to both sides."""


@kernel
def flap_increment(alpha: float, covered: Array3, m: Air, b: int, n: int) -> SectionCoefficients:
    """Increments of a node at angle of attack ``alpha`` [rad]: sum over its flaps, weighted by the covered share."""
    added, table = SectionCoefficients(0.0, 0.0, 0.0), m.increments
    x = min(max(alpha / STEP + 0.5 * (ALPHAS - 1), 0.0), ALPHAS - 1.0)
    i = min(max(whole(x), 0), ALPHAS - 2)
    w = x - i
    for j in range(covered.shape[0]):
        y = min(max(m.flap.angle[j, b] / STEP + 0.5 * (DELTAS - 1), 1.0), DELTAS - 2.0)
        k = min(max(whole(y), 1), DELTAS - 3)
        entry, u = i * DELTAS + k, y - k
        lift, drag = between(table.lift, j, entry, w, u), between(table.drag, j, entry, w, u)
        added += covered[j, b, n] * SectionCoefficients(lift, drag, between(table.moment, j, entry, w, u))
    return added


@kernel
def between(table: Numbers, j: int, entry: int, w: float, u: float) -> float:
    """Interpolation linear in the angle of attack and cubic in the deflection, with a continuous slope there."""
    low = over_deflection(table, j, entry, u)
    return low + w * (over_deflection(table, j, entry + DELTAS, u) - low)


@kernel
def over_deflection(table: Numbers, j: int, entry: int, u: float) -> float:
    """Cubic interpolation in the deflection, slopes from the neighbours (Catmull and Rom 1974)."""
    a, b, c, d = table[j, entry - 1], table[j, entry], table[j, entry + 1], table[j, entry + 2]
    return b + 0.5 * u * ((c - a) + u * ((2.0 * a - 5.0 * b + 4.0 * c - d) + u * (3.0 * (b - c) + d - a)))


@kernel
def equivalent_angle(lift: float, slope: float) -> float:
    """Equivalent angle Delta alpha [rad] of an increment of the lift (A-48)."""
    attached = slope > 0.1
    return where(attached, lift / where(attached, slope, 1.0), 0.0)
