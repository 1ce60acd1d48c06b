"""Second-order actuator, stepped exactly under a held demand, then limited in rate and angle.

Dry friction shifts the equilibrium angle against the direction of motion by friction over stiffness; a blade
that comes to rest within this distance from its demand sticks.

Reference: docs/theory/control.md (C-10 to C-13, C-94 to C-96).
"""

from __future__ import annotations

from math import cos, cosh, exp, sin, sinh, sqrt

from meltemi.compiler import crossed, kernel
from meltemi.control.actuator_models.parameters import ActuatorParameters

RESTS, SECANTS = 4, 4
"""Times at rest within a step, and iterations to find each."""


def coefficients(frequency: float, damping: float) -> tuple[float, ...]:
    """Coefficients of x'' + 2 z w x' + w^2 (x - demand) = 0."""
    return frequency * frequency, 2.0 * damping * frequency


@kernel
def second_order_step(x: float, v: float, w: float, z: float, dt: float) -> tuple[float, float]:
    """Exact step of x'' + 2 z w x' + w^2 x = 0 (C-11)."""
    e = exp(-z * w * dt)
    d = 1.0 - z * z
    if d > 1e-12:
        wd = w * sqrt(d)
        c, s_w = cos(wd * dt), sin(wd * dt) / wd
    elif d < -1e-12:
        wd = w * sqrt(-d)
        c, s_w = cosh(wd * dt), sinh(wd * dt) / wd
    else:
        c, s_w = 1.0, dt
    return e * (x * (c + z * w * s_w) + v * s_w), e * (v * (c - z * w * s_w) - w * w * x * s_w)


@kernel
def friction_step(x: float, v: float, p: ActuatorParameters, dt: float) -> tuple[float, float]:
    """Step of x'' + 2 z w x' + w^2 x = -a sgn(x') (C-95, C-96): exact up to the time at which it comes to rest."""
    w, z = p.frequency, p.damping
    reach = p.friction / (w * w)
    for _ in range(RESTS):
        if v == 0.0 and abs(x) <= reach:
            return x, 0.0
        side = reach if v > 0.0 or (v == 0.0 and x < 0.0) else -reach
        new_x, new_v = second_order_step(x + side, v, w, z, dt)
        if new_v * side >= 0.0:
            return new_x - side, new_v
        # at rest within the step, at a time computed by the secant method from the velocities at its ends
        low, high, v_low, v_high = 0.0, dt, v if v != 0.0 else side, new_v
        for _ in range(SECANTS):
            t = high - v_high * (high - low) / (v_high - v_low)
            new_x, new_v = second_order_step(x + side, v, w, z, t)
            if new_v * side > 0.0:
                low, v_low = t, new_v
            else:
                high, v_high = t, new_v
        x, v, dt = new_x - side, 0.0, dt - t
    return x, v


@kernel
def advance(angle: float, rate: float, demand: float, p: ActuatorParameters, dt: float) -> tuple[float, float, float]:
    """Angle and rate of a second-order actuator after ``dt``, within its limits (C-11 to C-13).

    Args:
      demand: held, within the limits of the angle.

    Returns:
      Angle, rate, and what the limit of the rate adds to the switches.
    """
    if dt <= 0.0:
        return angle, rate, 0.0
    most = p.rate
    if p.friction > 0.0:
        error, free = friction_step(angle - demand, rate, p, dt)
    else:
        error, free = second_order_step(angle - demand, rate, p.frequency, p.damping, dt)
    new, limited = demand + error, min(max(free, -most), most)
    if limited != free:
        new = angle + 0.5 * (rate + limited) * dt
    # within the step the free motion may be faster than at its ends
    new = min(max(new, angle - most * dt), angle + most * dt)
    if new < p.minimum or new > p.maximum:
        new = min(max(new, p.minimum), p.maximum)
        limited = 0.0
    return new, limited, crossed(abs(free) - most)
