"""Air density for kernels, such as controllers that measure temperature; formulas of ``environment.air``."""

from __future__ import annotations

from math import exp, log

from meltemi.compiler import kernel
from meltemi.environment.gases import CELSIUS, R_DRY, R_VAPOUR

TEN = log(10.0)


@kernel
def moist_air_density(temperature: float, humidity: float, pressure: float) -> float:
    """Density [kg/m^3] of air of a temperature [K], relative humidity and pressure [Pa].

    Palanimuthu et al. (2022), eqs (2) and (3); the same as ``environment.air.density_of``, for any number type.
    """
    t = temperature - CELSIUS
    vapour = 610.78 * humidity * exp(TEN * 7.5 * t / (t + 237.3))
    return ((pressure - vapour) / R_DRY + vapour / R_VAPOUR) / temperature
