"""Dynamic stall after Hansen, Gaunaa and Madsen: two wake lags, a pressure lag and a separation lag.

With alpha the angle of attack at three quarters of the chord, T = c / (2 U), omega_p the pitching of the
section relative to the rotor (nose up), f_st the static degree of attachment:

    x_1' = b_1 / T (A_1 alpha - x_1),  x_2' = b_2 / T (A_2 alpha - x_2)
    alpha_E = alpha (1 - A_1 - A_2) + x_1 + x_2
    x_3' = (C_La (alpha_E - alpha_0) + pi T omega_p - x_3) / (T_p T)
    x_4' = (f_st(x_3 / C_La + alpha_0) - x_4) / (T_f T)
    C_L  = x_4 C_L,fa(alpha_E) + (1 - x_4) C_L,fs(alpha_E) + pi T omega_p,  C_L,fa = C_La (alpha_E - alpha_0)

A coned or bent blade turns about its span with the rotor: the flow is curved, which acts like camber (in
alpha and in the moment). It is no pitching: the air beside the section is not accelerated, so there is no
added mass in it. OpenFAST takes both for the same; that is a variant.

The coefficients blend into the static polar between 40 and 45 degrees and below 1 m/s.

Reference: docs/theory/aerodynamics.md (A-30 to A-42); Hansen, Gaunaa & Madsen (2004), Risoe-R-1354,
Eqs. 5-40; curved flow as Migliore, Wolfe & Fanucci (1980), J. Energy 4(2).
"""

from __future__ import annotations

from math import atan2, cos, floor, pi, sin, sqrt
from typing import NamedTuple

from numpy import float64
from numpy.typing import NDArray

from meltemi.aero.lag import lag, lagged
from meltemi.aero.polars import ATTACHED, ATTACHMENT, DRAG, LIFT, MOMENT, SEPARATED, coefficient, locate
from meltemi.aero.tables import AeroParameters, SectionConstants
from meltemi.core.kernel import kernel
from meltemi.maths.generic import anywhere, where

Float = NDArray[float64]

STATIC, HANSEN = 0, 1
NO_ROTATION, CAMBER, OPENFAST = 0, 1, 2
A1, A2, B1, B2, T_PRESSURE, T_SEPARATION = AeroParameters.slots(
    "stall_a1 stall_a2 stall_b1 stall_b2 stall_pressure stall_separation"
)
SLOPE, ZERO_LIFT, DRAG_FLOOR, DYNAMIC = SectionConstants.slots("slope zero_lift drag_floor dynamic")

FADE_FROM, FADE_TO = 40.0 * pi / 180.0, 45.0 * pi / 180.0
"""[rad] angles of attack between which the model gives way to the static polar."""
SLOW_FROM, SLOW_TO = 0.01, 1.0
"""[m/s] the same for the relative speed."""
MAX_REDUCED_RATE = 1.5
"""Limit of T omega: beyond, the section turns faster than the air passes it."""


class Stall(NamedTuple):
    """State of one node."""

    wake_1: float
    wake_2: float
    pressure: float
    attachment: float


class StallInput(NamedTuple):
    """What drives the states: alpha [rad], U / (c/2) [1/s], attached lift, static attachment."""

    alpha: float
    rate: float
    pressure: float
    attachment: float


class Rotation(NamedTuple):
    """Rotation of a section about its span, in angles: T omega in all, T omega of pitching, tilt of the lift."""

    turning: float
    pitching: float
    tilt: float


class Coefficients(NamedTuple):
    """Lift, drag and moment coefficient."""

    lift: float
    drag: float
    moment: float


@kernel
def wrap(angle: float) -> float:
    """Angle in [-pi, pi)."""
    return angle - 2.0 * pi * floor((angle + pi) * (0.5 / pi))


@kernel
def ramp(x: float, low: float, high: float) -> float:
    """0 below ``low``, 1 above ``high``, half a cosine between."""
    t = min(max((x - low) / (high - low), 0.0), 1.0)
    if anywhere((t > 0.0) & (t < 1.0)):
        return 0.5 - 0.5 * cos(pi * t)
    return t


@kernel
def static_coefficients(polars: Float, g: int, alpha: float) -> Coefficients:
    """Coefficients of the polar at ``alpha`` [rad]."""
    at = locate(polars, alpha)
    return Coefficients(
        coefficient(polars, g, at, LIFT), coefficient(polars, g, at, DRAG), coefficient(polars, g, at, MOMENT)
    )


@kernel
def model_weight(section: Float, g: int, alpha: float, speed: float) -> float:
    """Weight of the dynamic model against the static polar (A-41)."""
    fade = (1.0 - ramp(abs(alpha), FADE_FROM, FADE_TO)) * ramp(speed, SLOW_FROM, SLOW_TO)
    return section[g, DYNAMIC] * fade


@kernel
def angle_at_three_quarters(alpha: float, speed: float, rotation: float, chord: float) -> float:
    """Angle of attack [rad] at 3/4 chord from that at the aerodynamic centre, half a chord ahead (A-31)."""
    return atan2(speed * sin(alpha) + 0.5 * rotation * chord, speed * cos(alpha))


@kernel
def reduced_rate(rotation: float, rate: float) -> float:
    """T omega, limited."""
    return min(max(rotation / rate, -MAX_REDUCED_RATE), MAX_REDUCED_RATE)


@kernel
def section_rotation(variant: int, rotation: float, pitching: float, rate: float) -> Rotation:
    """What the rotation of a section [rad/s], and the pitching in it, do (A-32)."""
    turning = where(variant == NO_ROTATION, 0.0, reduced_rate(rotation, rate))
    return Rotation(
        turning,
        where(variant == CAMBER, reduced_rate(pitching, rate), turning),
        where(variant == OPENFAST, turning, 0.0),
    )


@kernel
def effective_angle(aero: Float, y: Stall, alpha: float, flap: float = 0.0) -> float:
    """alpha_E [rad] (A-33), without the angle ``flap`` [rad] that stands for a flap's lift (A-48)."""
    lagged_share = aero[A1] + aero[A2]
    return alpha * (1.0 - lagged_share) + y.wake_1 + y.wake_2 - lagged_share * flap


@kernel
def attached_lift(section: Float, g: int, alpha_E: float, pitching: float) -> float:
    """Input of the pressure lag (A-34); ``pitching`` is T omega_p."""
    return section[g, SLOPE] * (alpha_E - section[g, ZERO_LIFT]) + pi * pitching


@kernel
def static_attachment(polars: Float, section: Float, g: int, pressure: float) -> float:
    """Input of the separation lag (A-35)."""
    alpha_F = pressure / max(section[g, SLOPE], 1e-3) + section[g, ZERO_LIFT]
    alpha_F = min(max(alpha_F, -0.5 * pi), 0.5 * pi)
    return coefficient(polars, g, locate(polars, alpha_F), ATTACHMENT)


@kernel
def stall_steady(
    aero: Float, polars: Float, section: Float, g: int, alpha: float, pitching: float, flap: float = 0.0
) -> Stall:
    """State in which nothing changes."""
    x1, x2 = aero[A1] * (alpha + flap), aero[A2] * (alpha + flap)
    pressure = attached_lift(section, g, effective_angle(aero, Stall(x1, x2, 0.0, 0.0), alpha, flap), pitching)
    return Stall(x1, x2, pressure, static_attachment(polars, section, g, pressure))


@kernel
def stall_advance(
    aero: Float,
    polars: Float,
    section: Float,
    g: int,
    y: Stall,
    old: StallInput,
    alpha: float,
    rate: float,
    pitching: float,
    weight: float,
    dt: float,
    flap: float = 0.0,
) -> tuple[Stall, StallInput]:
    """State after ``dt``, and the input to remember for the next step (A-36 to A-38).

    Each lag is stepped exactly for an input that changes linearly over the step; with ``dt`` = 0 the
    state stays. Where the model has given way (``weight`` 0) the state is the steady one.

    Args:
      old: input at the beginning of the step.
      alpha, rate, pitching: alpha [rad], U / (c/2) [1/s] and T omega_p at its end.
      flap: [rad] angle that stands for the flaps' lift, at its end.
    """
    h = 0.5 * (old.rate + rate) * dt
    driving = alpha + flap
    x1 = lagged(lag(aero[B1] * h), y.wake_1, aero[A1] * old.alpha, aero[A1] * driving)
    x2 = lagged(lag(aero[B2] * h), y.wake_2, aero[A2] * old.alpha, aero[A2] * driving)
    new_pressure = attached_lift(section, g, effective_angle(aero, Stall(x1, x2, 0.0, 0.0), alpha, flap), pitching)
    x3 = lagged(lag(h / aero[T_PRESSURE]), y.pressure, old.pressure, new_pressure)
    new_attachment = static_attachment(polars, section, g, x3)
    x4 = lagged(lag(h / aero[T_SEPARATION]), y.attachment, old.attachment, new_attachment)
    x4 = min(max(x4, 0.0), 1.0)
    state = Stall(x1, x2, x3, x4)
    off = (weight <= 0.0) & (dt > 0.0)
    if anywhere(off):
        steady = stall_steady(aero, polars, section, g, alpha, pitching, flap)
        state = Stall(
            where(off, steady.wake_1, x1),
            where(off, steady.wake_2, x2),
            where(off, steady.pressure, x3),
            where(off, steady.attachment, x4),
        )
    return state, StallInput(driving, rate, new_pressure, new_attachment)


@kernel
def stall_derivative(
    aero: Float,
    polars: Float,
    section: Float,
    g: int,
    y: Stall,
    alpha: float,
    rate: float,
    pitching: float,
    flap: float = 0.0,
) -> Stall:
    """Time derivative of the state."""
    pressure = attached_lift(section, g, effective_angle(aero, y, alpha, flap), pitching)
    attachment = static_attachment(polars, section, g, y.pressure)
    return Stall(
        aero[B1] * rate * (aero[A1] * (alpha + flap) - y.wake_1),
        aero[B2] * rate * (aero[A2] * (alpha + flap) - y.wake_2),
        rate / aero[T_PRESSURE] * (pressure - y.pressure),
        rate / aero[T_SEPARATION] * (attachment - y.attachment),
    )


@kernel
def stall_coefficients(
    aero: Float, polars: Float, section: Float, g: int, y: Stall, alpha: float, rotation: Rotation, flap: float = 0.0
) -> Coefficients:
    """Coefficients from the state and the angle of attack at 3/4 chord (A-39 to A-40), the flaps' increments apart."""
    alpha_E = effective_angle(aero, y, alpha, flap)
    at = locate(polars, alpha_E)
    f, x4 = coefficient(polars, g, at, ATTACHMENT), min(max(y.attachment, 0.0), 1.0)
    circulatory = x4 * coefficient(polars, g, at, ATTACHED) + (1.0 - x4) * coefficient(polars, g, at, SEPARATED)
    static_drag = coefficient(polars, g, at, DRAG)
    separation = 0.5 * (sqrt(max(f, 0.0)) - sqrt(x4)) - 0.25 * (f - x4)
    tilted = (alpha - alpha_E + rotation.tilt) * circulatory
    drag = static_drag + tilted + (static_drag - section[g, DRAG_FLOOR]) * separation
    # thin aerofoil theory: -pi/4 T omega from the curved flow, as much again from the air that pitching accelerates
    moment = coefficient(polars, g, at, MOMENT) - 0.25 * pi * (rotation.turning + rotation.pitching)
    return Coefficients(circulatory + pi * rotation.pitching, drag, moment)
