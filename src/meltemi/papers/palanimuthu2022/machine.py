"""The paper's rotor and torque law in closed form, with a choice of models of its power coefficient."""

from __future__ import annotations

import math
from functools import cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from meltemi.environment.air import density_of, site_pressure
from meltemi.environment.gases import CELSIUS
from meltemi.papers.palanimuthu2022.paper import POWER_COEFFICIENT, RADIUS, TIP_SPEED_RATIO
from meltemi.studies.coefficient_rotor import CoefficientRotor
from meltemi.turbine.library import load_turbine
from meltemi.turbine.power_turbine import (
    CalibratedCoefficient,
    Coefficient,
    HeierCoefficient,
    PowerTurbine,
    TableCoefficient,
)

Float = NDArray[np.float64]

FORMULA, CALIBRATED, BLADES = "M1", "M2", "M3"
"""Heier's formula with the paper's best point; the same fitted to Figure 6; the table of a 20 MW rotor's blades."""
FORMULAS = {  # a, b, c, d, s of C_p = a (b x - c) exp(-d x), x = 1/l - s; without the pitch, which is 0 in Figure 6
    "Heier": (0.5, 116.0, 5.0, 21.0, 0.035),
    "Slootweg": (0.73, 151.0, 13.2, 18.4, 0.003),
    "constant speed": (0.44, 125.0, 6.94, 16.5, -0.002),
    "Feng": (0.22, 116.0, 5.0, 12.5, 0.035),
    "Dai": (0.22, 120.0, 5.0, 12.5, 0.035),
    "De Kooning": (0.77, 151.0, 13.65, 18.4, 0.0),
    "Llano": (0.5, 72.5, 5.0, 13.125, 0.035),
    "Ahmed": (1.0, 110.0, 9.6, 18.4, 0.03),
}
SINE, FIFTH, SCALED = "sine", "fifth degree", "M3 scaled"
CURVES = (FORMULA, *FORMULAS, SINE, FIFTH, SCALED)
"""Readings of the coefficient that the paper does not give, scaled to its best point: the constants of the MathWorks
block (M1); of Heier (1998); of variable-speed and of constant-speed turbines after Slootweg et al. (2003), IEEE Trans.
Power Syst. 18(1); Dai and De Kooning after Saint-Drenan et al. (2020), Renew. Energy 157; Feng, Llano, Ahmed, a sine
and a polynomial of the fifth degree after Carranza Castillo et al. (2023), Energies 16(6), 2774; of the blades."""


def _table(model: str) -> TableCoefficient:
    """Tabulated power coefficient for curves that are not exponential."""
    blades = turbine(BLADES).coefficient
    assert isinstance(blades, TableCoefficient)
    if model == SCALED:
        return blades
    ratios = np.arange(3.5, 14.0 if model == SINE else 10.0, 0.1)  # the polynomial rises again beyond 10
    terms = [-1.896, 1.156, -0.2454, 0.02928, -0.001955, 5.547e-05]
    power = 0.44 * np.sin(np.pi * (ratios - 3.0) / 15.0) if model == SINE else np.polynomial.Polynomial(terms)(ratios)
    return TableCoefficient(
        tip_speed_ratio=ratios, pitch=blades.pitch, power=np.tile(power[:, None], len(blades.pitch))
    )


def _coefficient(model: str) -> Coefficient:
    """Power coefficient of one of the readings of the paper's turbine."""
    if model == CALIBRATED:
        return CalibratedCoefficient()
    if model in FORMULAS:
        a, b, c, d, s = FORMULAS[model]
        shift = 0.035 - s  # convert its x to that of the formula
        return HeierCoefficient(constants=(a * math.exp(-d * shift), b, 0.4, c - b * shift, d, 0.0))
    table = _table(model)
    ratio, most = CoefficientRotor(model, table, RADIUS).best()
    return table.replace(
        tip_speed_ratio=table.tip_speed_ratio * (TIP_SPEED_RATIO / ratio),
        power=table.power * (POWER_COEFFICIENT / most),
    )


def turbine(model: str = FORMULA) -> PowerTurbine:
    """The library's turbine with a model of its power coefficient."""
    loaded = load_turbine("pmsg20mw-bem" if model == BLADES else "pmsg20mw")
    return loaded if model in (FORMULA, BLADES) else loaded.replace(coefficient=_coefficient(model))


@cache
def rotor(model: str) -> CoefficientRotor:
    """Rotor with a model of the power coefficient."""
    power_turbine = turbine(model)
    return CoefficientRotor(model, power_turbine.coefficient, power_turbine.rotor_radius)


def density(temperature: ArrayLike, humidity: ArrayLike = 0.0, altitude: ArrayLike = 0.0) -> Float:
    """Density [kg/m^3] of air at a temperature [degC], relative humidity and altitude [m] (eqs 2 to 4)."""
    kelvin = np.asarray(temperature, float) + CELSIUS
    return density_of(kelvin, humidity, site_pressure(kelvin, altitude))
