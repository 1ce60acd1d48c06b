"""Dynamic inflow with a constant time constant."""

from __future__ import annotations

from meltemi.aero.air import Air
from meltemi.aero.inflow.lags import advance as advance
from meltemi.aero.inflow.lags import derivative as derivative
from meltemi.aero.inflow.lags import settle as settle
from meltemi.compiler import kernel


@kernel
def time_constant(m: Air) -> float:
    """Time constant [s] of the first lag, as given by the option."""
    return m.aero.inflow_time
