"""Rotor with a power coefficient and its optimal torque law in closed form, also in air of another density."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from meltemi.aero.coefficient import PowerCoefficients, power_coefficient, rotor_coefficients
from meltemi.environment.site import STANDARD
from meltemi.turbine.power_turbine import Coefficient

Float = NDArray[np.float64]


@dataclass(frozen=True)
class CoefficientRotor:
    """Rotor with a radius [m] and a power coefficient."""

    name: str
    coefficient: Coefficient
    radius: float

    @cached_property
    def _arrays(self) -> PowerCoefficients:
        return rotor_coefficients(self.coefficient)

    @property
    def area(self) -> float:
        """Rotor area [m^2]."""
        return math.pi * self.radius**2

    def coefficients(self, ratio: ArrayLike, pitch: ArrayLike = 0.0) -> Float:
        """C_p at tip-speed ratios above zero and pitch angles [rad], which broadcast."""
        ratios, pitches = np.broadcast_arrays(np.asarray(ratio, float), np.asarray(pitch, float))
        values = [power_coefficient(r, b, self._arrays) for r, b in zip(ratios.flat, pitches.flat, strict=True)]
        return np.array(values).reshape(ratios.shape)

    def best(self, pitch: float = 0.0) -> tuple[float, float]:
        """Tip-speed ratio and C_p of the maximum at a pitch angle [rad]."""
        from scipy.optimize import minimize_scalar

        grid = np.arange(2.0, 16.0, 0.05)
        near = float(grid[np.argmax(self.coefficients(grid, pitch))])
        optimum = minimize_scalar(
            lambda r: -float(self.coefficients(r, pitch)),
            bounds=(near - 0.1, near + 0.1),
            method="bounded",
            options={"xatol": 1e-9},
        )
        return float(optimum.x), -float(optimum.fun)

    def curvature(self) -> float:
        """Curvature -C_p'' lambda^2 / C_p at the maximum."""
        (ratio, c), h = self.best(), 0.3
        around = self.coefficients([ratio - h, ratio + h])
        return float(2.0 * c - around.sum()) / h**2 * ratio**2 / c

    def power(self, speed: ArrayLike, wind: ArrayLike, pitch: ArrayLike = 0.0, density: ArrayLike = STANDARD) -> Float:
        """Aerodynamic power [W] at rotor speeds [rad/s] and wind speeds [m/s] (eq. 1)."""
        v = np.asarray(wind, float)
        c = self.coefficients(np.asarray(speed, float) * self.radius / v, pitch)
        return np.asarray(0.5 * np.asarray(density, float) * self.area * c * v**3)

    def gain(self, density: float = STANDARD, pitch: float = 0.0) -> float:
        """Gain [N m s^2] of the optimal torque law (eq. 16)."""
        ratio, c = self.best(pitch)
        return 0.5 * density * math.pi * self.radius**5 * c / ratio**3

    def settled(self, assumed: float, density: float) -> float:
        """Tip-speed ratio at which the law of an assumed density [kg/m^3] settles in air of another, without losses.

        K_T omega^2 equals the aerodynamic torque where C_p / lambda^3 is that of the optimum times assumed over true
        density.
        """
        from scipy.optimize import brentq

        best, c = self.best()
        wanted = assumed / density * c / best**3
        return float(brentq(lambda r: float(self.coefficients(r)) / r**3 - wanted, 0.75 * best, 1.2 * best, xtol=1e-12))

    def settled_power(self, wind: float, assumed: float, density: float) -> float:
        """Aerodynamic power [W] at the settled tip-speed ratio."""
        return float(self.power(self.settled(assumed, density) * wind / self.radius, wind, 0.0, density))

    def speed_for(self, power: float, density: float = STANDARD, pitch: float = 0.0) -> float:
        """Rotor speed [rad/s] at which the optimal law gives a power [W]: the paper's omega_l, omega_opt if pitched."""
        return float((power / self.gain(density, pitch)) ** (1.0 / 3.0))

    def wind_for(self, power: float, density: float = STANDARD) -> float:
        """Wind speed [m/s] at which the rotor has a power [W] at its optimum."""
        return float((power / (0.5 * density * self.area * self.best()[1])) ** (1.0 / 3.0))
