"""Trailing-edge flaps: what a deflection adds to the coefficients of a section.

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
from typing import NamedTuple

from numpy import float64
from numpy.typing import NDArray

from meltemi.core.kernel import kernel
from meltemi.maths.generic import where, whole
from meltemi.maths.tables import Numbers, Table, number

Float = NDArray[float64]


class FlapParameters(Table, axes="flap blade", title="flap"):
    """State of the flaps' actuators."""

    angle: Numbers = number("rad", "deflection, trailing edge towards the pressure side when positive")
    rate: Numbers = number("rad/s", "its rate")
    acceleration: Numbers = number("rad/s^2", "its acceleration over the last step")
    switches: Numbers = number("-", "limits that a difference step would have reached or left, in derivative runs")


ANGLE, RATE, ACCELERATION, SWITCHES = FlapParameters.slots("angle rate acceleration switches")

STEP = pi / 180.0
"""[rad] of the increments' grid, in both angles."""
ALPHAS, DELTAS = 81, 61
"""Rows and columns of it, symmetric about zero: 40 and 30 degrees to both sides."""
LIFT, DRAG, MOMENT = 0, 1, 2


class Increment(NamedTuple):
    """What flaps add to lift, drag and moment coefficient."""

    lift: float
    drag: float
    moment: float


@kernel
def flap_increment(share: Float, increments: Float, flap: Float, alpha: float, b: int, n: int) -> Increment:
    """Sum over the flaps of a node at angle of attack ``alpha`` [rad], each by the share of the node it covers.

    Args:
      share: (F, blades, nodes) share of each node that a flap covers.
      increments: (F, ALPHAS DELTAS, 3), angle by angle of attack.
      flap: state, table FLAP (fields, F, blades).
    """
    lift, drag, moment = 0.0 * alpha, 0.0 * alpha, 0.0 * alpha
    x = min(max(alpha / STEP + 0.5 * (ALPHAS - 1), 0.0), ALPHAS - 1.0)
    i = min(max(whole(x), 0), ALPHAS - 2)
    w = x - i
    for j in range(share.shape[0]):
        y = min(max(flap[ANGLE, j, b] / STEP + 0.5 * (DELTAS - 1), 1.0), DELTAS - 2.0)
        k = min(max(whole(y), 1), DELTAS - 3)
        here, u = i * DELTAS + k, y - k
        s = share[j, b, n]
        lift += s * between(increments, j, here, LIFT, w, u)
        drag += s * between(increments, j, here, DRAG, w, u)
        moment += s * between(increments, j, here, MOMENT, w, u)
    return Increment(lift, drag, moment)


@kernel
def between(increments: Float, j: int, here: int, column: int, w: float, u: float) -> float:
    """Linear in the angle of attack, and cubic in the deflection: its slope has no steps, not at zero either."""
    low = along(increments, j, here, column, u)
    return low + w * (along(increments, j, here + DELTAS, column, u) - low)


@kernel
def along(increments: Float, j: int, here: int, column: int, u: float) -> float:
    """Cubic through the entries at 0 and 1, with the slopes of their neighbours (Catmull and Rom 1974)."""
    a, b = increments[j, here - 1, column], increments[j, here, column]
    c, d = increments[j, here + 1, column], increments[j, here + 2, column]
    return b + 0.5 * u * ((c - a) + u * ((2.0 * a - 5.0 * b + 4.0 * c - d) + u * (3.0 * (b - c) + d - a)))


@kernel
def equivalent_angle(lift: float, slope: float) -> float:
    """Delta alpha [rad] of an increment of the lift (A-48)."""
    attached = slope > 0.1
    return where(attached, lift / where(attached, slope, 1.0), 0.0)
