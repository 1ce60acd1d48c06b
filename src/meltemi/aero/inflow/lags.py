"""Dynamic inflow: the induced velocity follows its quasi-steady value through two lags (Øye).

With V_s the quasi-steady induced velocity (axial and tangential alike), k the lead:

    z  + tau_1 dz/dt = (1 - k) V_s          reduced state
    V  + tau_2 dV/dt = z + k V_s            tau_2 = (0.39 - 0.26 (r/R)^2) tau_1

Reference: docs/theory/aerodynamics.md (A-22 to A-26); Snel & Schepers (1995), ECN-C--94-107; Branlard
et al. (2022) for the form without dV_s/dt.
"""

from __future__ import annotations

from typing import NamedTuple

from meltemi.aero.air import Air
from meltemi.aero.lag import lag, lagged
from meltemi.aero.tables import InflowState
from meltemi.compiler import kernel, where


class Inflow(NamedTuple):
    """State of one component at one node: reduced state z and induced velocity V [m/s]."""

    reduced: float
    velocity: float


@kernel
def advance(dt: float, m: Air, b: int, n: int) -> None:
    """Advance the states of a node by ``dt``."""
    rotor, memory, k = m.rotor, m.memory, m.aero.inflow_lead
    V_x, V_y = quasi_steady(m, b, n)
    # the time constant changes over the step: its mean keeps the second order
    tau_1 = 0.5 * (memory.time[b, n] + rotor.inflow_time)
    tau_2 = second_time(tau_1, m.flow.radius[b, n] / rotor.tip_radius)
    x, y = state(m.inflow, b, n)
    x = inflow_advance(x, k, tau_1, tau_2, memory.induced_x[b, n], V_x, dt)
    y = inflow_advance(y, k, tau_1, tau_2, memory.induced_y[b, n], V_y, dt)
    at_once = blocked(m, b, n)
    put(m.inflow, either(at_once, inflow_steady(k, V_x), x), either(at_once, inflow_steady(k, V_y), y), b, n)
    remember(m, b, n)


@kernel
def settle(m: Air, b: int, n: int) -> None:
    """Set the states of a node to their steady values."""
    k = m.aero.inflow_lead
    V_x, V_y = quasi_steady(m, b, n)
    put(m.inflow, inflow_steady(k, V_x), inflow_steady(k, V_y), b, n)


@kernel
def derivative(m: Air, b: int, n: int) -> None:
    """Time derivatives of the states of a node; zero where the flow is blocked."""
    k, tau_1 = m.aero.inflow_lead, m.rotor.inflow_time
    tau_2 = second_time(tau_1, m.flow.radius[b, n] / m.rotor.tip_radius)
    V_x, V_y = quasi_steady(m, b, n)
    x, y = state(m.inflow, b, n)
    x_rate, y_rate = inflow_derivative(x, k, tau_1, tau_2, V_x), inflow_derivative(y, k, tau_1, tau_2, V_y)
    at_once, still = blocked(m, b, n), Inflow(0.0, 0.0)
    put(m.d_inflow, either(at_once, still, x_rate), either(at_once, still, y_rate), b, n)


@kernel
def quasi_steady(m: Air, b: int, n: int) -> tuple[float, float]:
    """Quasi-steady induced velocities [m/s] at a node, normal and tangential."""
    flow = m.flow
    return flow.steady_axial[b, n] * flow.vx[b, n], flow.steady_tangential[b, n] * flow.vy[b, n]


@kernel
def remember(m: Air, b: int, n: int) -> None:
    """Store the inputs of this step for the next one."""
    memory = m.memory
    memory.induced_x[b, n], memory.induced_y[b, n] = quasi_steady(m, b, n)
    memory.time[b, n] = m.rotor.inflow_time


@kernel
def blocked(m: Air, b: int, n: int) -> bool:
    """Whether the loss factor vanishes at the node: momentum cannot balance a load there."""
    return m.aero_nodes.end[b, n] > 0.0


@kernel
def either(condition: bool, yes: Inflow, no: Inflow) -> Inflow:
    """``yes`` where the condition holds, else ``no``."""
    return Inflow(where(condition, yes.reduced, no.reduced), where(condition, yes.velocity, no.velocity))


@kernel
def state(inflow: InflowState, b: int, n: int) -> tuple[Inflow, Inflow]:
    """States of the induced velocity at a node, normal and tangential."""
    return Inflow(inflow.reduced_x[b, n], inflow.x[b, n]), Inflow(inflow.reduced_y[b, n], inflow.y[b, n])


@kernel
def put(inflow: InflowState, normal: Inflow, tangential: Inflow, b: int, n: int) -> None:
    """Store the states of a node, or their derivatives."""
    inflow.reduced_x[b, n] = normal.reduced
    inflow.x[b, n] = normal.velocity
    inflow.reduced_y[b, n] = tangential.reduced
    inflow.y[b, n] = tangential.velocity


@kernel
def first_time(induction: float, radius: float, wind: float) -> float:
    """Time constant tau_1 [s] from mean induction, rotor radius [m] and wind along the shaft [m/s] (A-24)."""
    return min(1.1 * radius / ((1.0 - 1.3 * min(induction, 0.5)) * max(wind, 0.1)), 100.0)


@kernel
def second_time(tau_1: float, r_R: float) -> float:
    """Time constant tau_2 [s] at relative radius ``r_R`` (A-25)."""
    return (0.39 - 0.26 * r_R * r_R) * tau_1


@kernel
def inflow_steady(k: float, V_s: float) -> Inflow:
    """Steady state for the quasi-steady induced velocity ``V_s``."""
    return Inflow((1.0 - k) * V_s, V_s)


@kernel
def inflow_derivative(y: Inflow, k: float, tau_1: float, tau_2: float, V_s: float) -> Inflow:
    """Time derivative of the state."""
    return Inflow(((1.0 - k) * V_s - y.reduced) / tau_1, (y.reduced + k * V_s - y.velocity) / tau_2)


@kernel
def inflow_advance(y: Inflow, k: float, tau_1: float, tau_2: float, before: float, after: float, dt: float) -> Inflow:
    """State after ``dt``, exact for V_s linear from ``before`` to ``after`` in the first lag (A-26)."""
    z = lagged(lag(dt / tau_1), y.reduced, (1.0 - k) * before, (1.0 - k) * after)
    V = lagged(lag(dt / tau_2), y.velocity, y.reduced + k * before, z + k * after)
    return Inflow(z, V)
