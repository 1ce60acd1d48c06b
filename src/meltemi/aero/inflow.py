"""Dynamic inflow: the induced velocity follows its quasi-steady value through two lags (Øye).

With V_s the quasi-steady induced velocity (axial and tangential alike), k the lead:

    z  + tau_1 dz/dt = (1 - k) V_s          reduced state
    V  + tau_2 dV/dt = z + k V_s            tau_2 = (0.39 - 0.26 (r/R)^2) tau_1

Reference: docs/theory/aerodynamics.md (A-22 to A-26); Snel & Schepers (1995), ECN-C--94-107; Branlard
et al. (2022) for the form without dV_s/dt.
"""

from __future__ import annotations

from typing import NamedTuple

from meltemi.aero.lag import lag, lagged
from meltemi.core.kernel import kernel

QUASI_STEADY, CONSTANT_TIME, VARIABLE_TIME = 0, 1, 2


class Inflow(NamedTuple):
    """State of one component at one node: reduced state z and induced velocity V [m/s]."""

    reduced: float
    velocity: float


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
    """State in which nothing changes for quasi-steady induced velocity ``V_s``."""
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
