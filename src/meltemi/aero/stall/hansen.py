"""Dynamic stall after Hansen, Gaunaa and Madsen: two wake lags, a pressure lag and a separation lag.

With alpha the angle of attack at three quarters of the chord, T = c / (2 U), omega_p the pitching of the
section relative to the rotor (nose up), f_st the static degree of attachment:

    x_1' = b_1 / T (A_1 alpha - x_1),  x_2' = b_2 / T (A_2 alpha - x_2)
    alpha_E = alpha (1 - A_1 - A_2) + x_1 + x_2
    x_3' = (C_La (alpha_E - alpha_0) + pi T omega_p - x_3) / (T_p T)
    x_4' = (f_st(x_3 / C_La + alpha_0) - x_4) / (T_f T)
    C_L  = x_4 C_L,fa(alpha_E) + (1 - x_4) C_L,fs(alpha_E) + pi T omega_p,  C_L,fa = C_La (alpha_E - alpha_0)

In reversed flow only the wake lags, and C(pi + alpha_E) is that of the static polar. The coefficients blend into those
of the static polar in deep stall and at low speed (``section``).

Reference: docs/theory/aerodynamics.md (A-30 to A-42d); Hansen, Gaunaa & Madsen (2004), Risoe-R-1354, Eqs. 5-40.
"""

from __future__ import annotations

from math import pi, sqrt
from typing import NamedTuple

from meltemi.aero.air import Air
from meltemi.aero.lag import lag, lagged
from meltemi.aero.polars import SectionCoefficients, coefficient, locate, static_coefficients
from meltemi.aero.stall.section import SectionFlow, count_switches, section_flow
from meltemi.aero.tables import StallState
from meltemi.compiler import anywhere, kernel, where

STATES = ("wake_1", "wake_2", "pressure", "attachment")


class Stall(NamedTuple):
    """State of one node."""

    wake_1: float
    wake_2: float
    pressure: float
    attachment: float


class StallInput(NamedTuple):
    """Inputs of the lags: alpha [rad], U / (c/2) [1/s], attached lift, static attachment."""

    alpha: float
    rate: float
    pressure: float
    attachment: float


@kernel
def advance(dt: float, flap: float, m: Air, b: int, n: int) -> SectionCoefficients:
    """Advance the state of a node by ``dt`` and return its coefficients."""
    memory, x = m.memory, section_flow(flap, m, b, n)
    count_switches(m, b, n)
    old = StallInput(memory.alpha[b, n], memory.rate[b, n], memory.pressure[b, n], memory.attachment[b, n])
    y, new = stall_advance(dt, state(m.stall, b, n), old, x, m)
    put(m.stall, y, b, n)
    memory.alpha[b, n] = new.alpha
    memory.rate[b, n] = new.rate
    memory.pressure[b, n] = new.pressure
    memory.attachment[b, n] = new.attachment
    c = stall_coefficients(y, x, m)
    if anywhere(x.weight < 1.0):
        static = static_coefficients(m.flow.alpha[b, n], x.polar, m)
        c = static + x.weight * (c - static)
    return c


@kernel
def settle(flap: float, m: Air, b: int, n: int) -> None:
    """Set the state of a node to its steady value."""
    put(m.stall, stall_steady(section_flow(flap, m, b, n), m), b, n)


@kernel
def derivative(flap: float, m: Air, b: int, n: int) -> None:
    """Time derivative of the state of a node; zero where the model is off, since the state is set there."""
    x = section_flow(flap, m, b, n)
    rate = stall_derivative(state(m.stall, b, n), x, m)
    put(m.d_stall, either(x.weight > 0.0, rate, Stall(0.0, 0.0, 0.0, 0.0)), b, n)


@kernel
def either(condition: bool, yes: Stall, no: Stall) -> Stall:
    """``yes`` where the condition holds, else ``no``."""
    return Stall(
        where(condition, yes.wake_1, no.wake_1),
        where(condition, yes.wake_2, no.wake_2),
        where(condition, yes.pressure, no.pressure),
        where(condition, yes.attachment, no.attachment),
    )


@kernel
def state(stall: StallState, b: int, n: int) -> Stall:
    """State of a node."""
    return Stall(stall.wake_1[b, n], stall.wake_2[b, n], stall.pressure[b, n], stall.attachment[b, n])


@kernel
def put(stall: StallState, y: Stall, b: int, n: int) -> None:
    """Store the state of a node, or its derivative."""
    stall.wake_1[b, n] = y.wake_1
    stall.wake_2[b, n] = y.wake_2
    stall.pressure[b, n] = y.pressure
    stall.attachment[b, n] = y.attachment


@kernel
def effective_angle(y: Stall, x: SectionFlow, m: Air) -> float:
    """Effective angle of attack alpha_E [rad] (A-33), without the equivalent angle of the flaps (A-48)."""
    lagged_share = m.aero.stall_a1 + m.aero.stall_a2
    return x.alpha * (1.0 - lagged_share) + y.wake_1 + y.wake_2 - lagged_share * x.flap


@kernel
def attached_lift(alpha_E: float, x: SectionFlow, m: Air) -> float:
    """Input of the pressure lag (A-34)."""
    return m.section.slope[x.polar] * (alpha_E - m.section.zero_lift[x.polar]) + pi * x.rotation.pitching


@kernel
def static_attachment(pressure: float, g: int, m: Air) -> float:
    """Input of the separation lag (A-35)."""
    alpha_F = pressure / max(m.section.slope[g], 1e-3) + m.section.zero_lift[g]
    alpha_F = min(max(alpha_F, -0.5 * pi), 0.5 * pi)
    return coefficient(m.polars.attachment, g, locate(alpha_F, m))


@kernel
def stall_steady(x: SectionFlow, m: Air) -> Stall:
    """Steady state."""
    aero, driving = m.aero, x.alpha + x.flap
    x1, x2 = aero.stall_a1 * driving, aero.stall_a2 * driving
    pressure = attached_lift(effective_angle(Stall(x1, x2, 0.0, 0.0), x, m), x, m)
    return Stall(x1, x2, pressure, static_attachment(pressure, x.polar, m))


@kernel
def stall_advance(dt: float, y: Stall, old: StallInput, x: SectionFlow, m: Air) -> tuple[Stall, StallInput]:
    """State after ``dt``, and the input to remember for the next step (A-36 to A-38).

    Each lag is stepped exactly for an input that changes linearly over the step; with ``dt`` = 0 the
    state stays. Where the model has given way (weight 0) the state is the steady one.

    Args:
      old: input at the beginning of the step.
      x: flow at its end.
    """
    aero = m.aero
    h = 0.5 * (old.rate + x.rate) * dt
    driving = x.alpha + x.flap
    x1 = lagged(lag(aero.stall_b1 * h), y.wake_1, aero.stall_a1 * old.alpha, aero.stall_a1 * driving)
    x2 = lagged(lag(aero.stall_b2 * h), y.wake_2, aero.stall_a2 * old.alpha, aero.stall_a2 * driving)
    new_pressure = attached_lift(effective_angle(Stall(x1, x2, 0.0, 0.0), x, m), x, m)
    x3 = lagged(lag(h / aero.stall_pressure), y.pressure, old.pressure, new_pressure)
    new_attachment = static_attachment(x3, x.polar, m)
    x4 = lagged(lag(h / aero.stall_separation), y.attachment, old.attachment, new_attachment)
    x4 = min(max(x4, 0.0), 1.0)
    after = Stall(x1, x2, x3, x4)
    off = (x.weight <= 0.0) & (dt > 0.0)
    if anywhere(off):
        after = either(off, stall_steady(x, m), after)
    return after, StallInput(driving, x.rate, new_pressure, new_attachment)


@kernel
def stall_derivative(y: Stall, x: SectionFlow, m: Air) -> Stall:
    """Time derivative of the state."""
    aero, driving = m.aero, x.alpha + x.flap
    pressure = attached_lift(effective_angle(y, x, m), x, m)
    attachment = static_attachment(y.pressure, x.polar, m)
    return Stall(
        aero.stall_b1 * x.rate * (aero.stall_a1 * driving - y.wake_1),
        aero.stall_b2 * x.rate * (aero.stall_a2 * driving - y.wake_2),
        x.rate / aero.stall_pressure * (pressure - y.pressure),
        x.rate / aero.stall_separation * (attachment - y.attachment),
    )


@kernel
def stall_coefficients(y: Stall, x: SectionFlow, m: Air) -> SectionCoefficients:
    """Coefficients from state and flow (A-39 to A-40), without the increments of the flaps."""
    g, polars, rotation = x.polar, m.polars, x.rotation
    alpha_E = effective_angle(y, x, m)
    at = locate(alpha_E, m)
    f, x4 = coefficient(polars.attachment, g, at), min(max(y.attachment, 0.0), 1.0)
    attached, separated = coefficient(polars.attached_lift, g, at), coefficient(polars.separated_lift, g, at)
    circulatory = x4 * attached + (1.0 - x4) * separated
    static_drag = coefficient(polars.drag, g, at)
    separation = 0.5 * (sqrt(max(f, 0.0)) - sqrt(x4)) - 0.25 * (f - x4)
    tilted = (x.alpha - alpha_E + rotation.tilt) * circulatory
    drag = static_drag + tilted + (static_drag - m.section.drag_floor[g]) * separation
    # thin aerofoil theory: -pi/4 T omega from the curved flow, as much again from the air that pitching accelerates
    moment = coefficient(polars.moment, g, at) - 0.25 * pi * (rotation.turning + rotation.pitching)
    forward = SectionCoefficients(circulatory + pi * rotation.pitching, drag, moment)
    if anywhere(x.reversed > 0.0):
        return forward + x.reversed * (reversed_coefficients(alpha_E, x, m) - forward)
    return forward


@kernel
def reversed_coefficients(alpha_E: float, x: SectionFlow, m: Air) -> SectionCoefficients:
    """Coefficients in reversed flow, the mirror image of thin aerofoil theory (A-42c, A-42d)."""
    c, rotation = static_coefficients(where(alpha_E > 0.0, alpha_E - pi, alpha_E + pi), x.polar, m), x.rotation
    tilt = x.alpha - alpha_E + rotation.turning + rotation.tilt
    moment = c.moment - 0.25 * pi * (rotation.turning - rotation.pitching)
    return SectionCoefficients(c.lift + pi * rotation.pitching, c.drag + tilt * c.lift, moment)
