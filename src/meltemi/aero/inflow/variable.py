"""Dynamic inflow with a time constant from wind and induction (A-24)."""

from __future__ import annotations

from meltemi.aero.air import Air
from meltemi.aero.inflow.lags import advance as advance
from meltemi.aero.inflow.lags import derivative as derivative
from meltemi.aero.inflow.lags import first_time
from meltemi.aero.inflow.lags import settle as settle
from meltemi.compiler import kernel


@kernel
def time_constant(m: Air) -> float:
    """Time constant [s] of the first lag from mean induction, rotor radius and wind."""
    return first_time(m.rotor.induction, m.rotor.tip_radius, m.rotor.axial_wind)
