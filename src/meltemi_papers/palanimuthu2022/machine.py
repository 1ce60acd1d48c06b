"""The paper's rotor and torque law in closed form, with any of the models of its power coefficient."""

from __future__ import annotations

import math
from functools import cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from meltemi.environment.air import CELSIUS, density_of, site_pressure
from meltemi.turbine.library import load_turbine
from meltemi.turbine.power_turbine import (
    CalibratedCoefficient,
    Coefficient,
    HeierCoefficient,
    PowerTurbine,
    TableCoefficient,
)
from meltemi_papers.palanimuthu2022.paper import POWER_COEFFICIENT, TIP_SPEED_RATIO
from meltemi_studies.coefficient_rotor import Rotor

Float = NDArray[np.float64]

FORMULA, CALIBRATED, BLADES = "M1", "M2", "M3"
"""Heier's formula with the paper's best point; the same fitted to Figure 6; the table of a 20 MW rotor's blades."""
HEIER, SLOOTWEG, CONSTANT, COMMON, SCALED = "Heier", "Slootweg", "constant speed", "0.22, 116, 12.5", "M3 scaled"
CURVES = (FORMULA, HEIER, SLOOTWEG, CONSTANT, COMMON, SCALED)
"""Readings of the coefficient that the paper does not give, all with its best point: the constants of the MathWorks
block (M1); of Heier (1998); of variable-speed and of constant-speed turbines after Slootweg et al. (2003), IEEE Trans.
Power Syst. 18(1); a common set of the same form; the blades' own curve, scaled."""


def _coefficient(model: str) -> Coefficient:
    """Power coefficient of one of the readings of the paper's turbine."""
    if model == SCALED:
        (ratio, most), table = rotor(BLADES).best(), turbine(BLADES).coefficient
        assert isinstance(table, TableCoefficient)
        ratios, power = table.tip_speed_ratio * (TIP_SPEED_RATIO / ratio), table.power * (POWER_COEFFICIENT / most)
        return table.replace(tip_speed_ratio=ratios, power=power)
    if model == CALIBRATED:
        return CalibratedCoefficient()
    shift = 0.035 - 0.003  # of Slootweg's 1/l - 0.003 against 1/l - 0.035, at zero pitch
    constants = {  # Figure 6 does not pitch: the pitch's part of the constant-speed curve is Heier's
        HEIER: (0.5, 116.0, 0.4, 5.0, 21.0, 0.0),
        CONSTANT: (0.44 * math.exp(-16.5 * 0.037), 125.0, 0.4, 6.94 - 125.0 * 0.037, 16.5, 0.0),  # of 1/l + 0.002
        COMMON: (0.22, 116.0, 0.4, 5.0, 12.5, 0.0),
        SLOOTWEG: (0.73 * math.exp(-18.4 * shift), 151.0, 0.58, 13.2 - 151.0 * shift, 18.4, 0.0),
    }
    return HeierCoefficient(constants=constants[model])


def turbine(model: str = FORMULA) -> PowerTurbine:
    """The library's turbine with a model of its power coefficient."""
    made = load_turbine("pmsg20mw-bem" if model == BLADES else "pmsg20mw")
    return made if model in (FORMULA, BLADES) else made.replace(coefficient=_coefficient(model))


@cache
def rotor(model: str) -> Rotor:
    """Rotor with a model of the power coefficient."""
    made = turbine(model)
    return Rotor(model, made.coefficient, made.rotor_radius)


def density(temperature: ArrayLike, humidity: ArrayLike = 0.0, altitude: ArrayLike = 0.0) -> Float:
    """[kg/m^3] of air of a temperature [degC], relative humidity, and altitude [m] (eqs 2 to 4)."""
    kelvin = np.asarray(temperature, float) + CELSIUS
    return density_of(kelvin, humidity, site_pressure(kelvin, altitude))
