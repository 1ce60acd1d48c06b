"""Quasi-steady inflow: the induced velocities are those of the momentum balance."""

from __future__ import annotations

from meltemi.aero.air import Air
from meltemi.aero.inflow.constant import time_constant as time_constant
from meltemi.aero.inflow.lags import Inflow, put, remember
from meltemi.aero.inflow.lags import settle as settle
from meltemi.compiler import kernel


@kernel
def advance(dt: float, m: Air, b: int, n: int) -> None:
    """Set the induced velocities to those of the momentum balance."""
    settle(m, b, n)
    remember(m, b, n)


@kernel
def derivative(m: Air, b: int, n: int) -> None:
    """Zero: the model has no state."""
    put(m.d_inflow, Inflow(0.0, 0.0), Inflow(0.0, 0.0), b, n)
