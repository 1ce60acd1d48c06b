"""The paper's rotor and torque law in closed form, with any of the models of its power coefficient."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from meltemi.aero.coefficient import Coefficients, power_coefficient, rotor_coefficients
from meltemi.environment.air import CELSIUS, density_of, site_pressure
from meltemi.environment.site import STANDARD
from meltemi.turbine.library import load_turbine
from meltemi.turbine.power_turbine import (
    CalibratedCoefficient,
    Coefficient,
    HeierCoefficient,
    PowerTurbine,
    TableCoefficient,
)
from meltemi_papers.palanimuthu2022.paper import POWER_COEFFICIENT, TIP_SPEED_RATIO

Float = NDArray[np.float64]

FORMULA, CALIBRATED, BLADES = "M1", "M2", "M3"
"""Heier's formula with the paper's best point; the same fitted to Figure 6; the table of a 20 MW rotor's blades."""
HEIER, SLOOTWEG, CONSTANT, COMMON, SCALED = "Heier", "Slootweg", "constant speed", "0.22, 116, 12.5", "M3 scaled"
CURVES = (FORMULA, HEIER, SLOOTWEG, CONSTANT, COMMON, SCALED)
"""Readings of the coefficient that the paper does not give, all with its best point: the constants of the MathWorks
block (M1); of Heier (1998); of variable-speed and of constant-speed turbines after Slootweg et al. (2003), IEEE Trans.
Power Syst. 18(1); a common set of the same form; the blades' own curve, scaled."""


@dataclass(frozen=True)
class Rotor:
    """A rotor of the paper's radius and a power coefficient."""

    name: str
    coefficient: Coefficient
    radius: float

    @cached_property
    def _arrays(self) -> Coefficients:
        return rotor_coefficients(self.coefficient)

    @property
    def area(self) -> float:
        """[m^2] rotor area."""
        return math.pi * self.radius**2

    def coefficients(self, ratio: ArrayLike, pitch: ArrayLike = 0.0) -> Float:
        """C_p at tip-speed ratios above zero and pitch angles [rad], which broadcast."""
        ratios, pitches = np.broadcast_arrays(np.asarray(ratio, float), np.asarray(pitch, float))
        found = [power_coefficient(r, b, self._arrays) for r, b in zip(ratios.flat, pitches.flat, strict=True)]
        return np.array(found).reshape(ratios.shape)

    def best(self, pitch: float = 0.0) -> tuple[float, float]:
        """Tip-speed ratio and C_p of the maximum at a pitch angle [rad]."""
        from scipy.optimize import minimize_scalar

        grid = np.arange(2.0, 16.0, 0.05)
        near = float(grid[np.argmax(self.coefficients(grid, pitch))])
        found = minimize_scalar(
            lambda r: -float(self.coefficients(r, pitch)),
            bounds=(near - 0.1, near + 0.1),
            method="bounded",
            options={"xatol": 1e-9},
        )
        return float(found.x), -float(found.fun)

    def curvature(self) -> float:
        """-C_p'' lambda^2 / C_p at the maximum: how sharp it is."""
        (ratio, c), h = self.best(), 0.3
        around = self.coefficients([ratio - h, ratio + h])
        return float(2.0 * c - around.sum()) / h**2 * ratio**2 / c

    def power(self, speed: ArrayLike, wind: ArrayLike, pitch: ArrayLike = 0.0, density: ArrayLike = STANDARD) -> Float:
        """[W] aerodynamic power at rotor speeds [rad/s] and wind speeds [m/s] (eq. 1)."""
        v = np.asarray(wind, float)
        c = self.coefficients(np.asarray(speed, float) * self.radius / v, pitch)
        return np.asarray(0.5 * np.asarray(density, float) * self.area * c * v**3)

    def gain(self, density: float = STANDARD, pitch: float = 0.0) -> float:
        """[N m s^2] of the optimal torque law (eq. 16)."""
        ratio, c = self.best(pitch)
        return 0.5 * density * math.pi * self.radius**5 * c / ratio**3

    def settled(self, assumed: float, density: float) -> float:
        """Tip-speed ratio at which the law of an assumed density [kg/m^3] settles in air of another, without losses.

        K_T omega^2 is the air's torque where C_p / lambda^3 is the best point's times assumed over true density.
        """
        from scipy.optimize import brentq

        best, c = self.best()
        wanted = assumed / density * c / best**3
        return float(brentq(lambda r: float(self.coefficients(r)) / r**3 - wanted, 0.75 * best, 1.2 * best, xtol=1e-12))

    def settled_power(self, wind: float, assumed: float, density: float) -> float:
        """[W] aerodynamic power at that tip-speed ratio."""
        return float(self.power(self.settled(assumed, density) * wind / self.radius, wind, 0.0, density))

    def speed_for(self, power: float, density: float = STANDARD, pitch: float = 0.0) -> float:
        """[rad/s] at which the optimal law gives a power [W]: the paper's omega_l, and omega_opt at a pitch angle."""
        return float((power / self.gain(density, pitch)) ** (1.0 / 3.0))

    def wind_for(self, power: float, density: float = STANDARD) -> float:
        """[m/s] at which the rotor gives a power [W] at its best point."""
        return float((power / (0.5 * density * self.area * self.best()[1])) ** (1.0 / 3.0))


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
