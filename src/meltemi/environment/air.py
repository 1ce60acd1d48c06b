"""The air's density from temperature, humidity, altitude and pressure.

Reference: Palanimuthu et al. (2022), eqs (2) to (4), with 273.15 in place of the printed 273.5.
"""

from __future__ import annotations

from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field, model_validator

from meltemi.core.record import Record
from meltemi.core.series import Varying, on_times, values

Float = NDArray[np.float64]

CELSIUS = 273.15
"""[K] at 0 degrees Celsius."""
R_DRY, R_VAPOUR = 287.058, 461.495
"""[J/(kg K)] gas constants of dry air and water vapour."""
SEA_LEVEL_PRESSURE = 101325.0
"""[Pa] of the ISO 2533 standard atmosphere."""


def vapour_pressure(temperature: ArrayLike, humidity: ArrayLike) -> Float:
    """Partial pressure of water vapour [Pa] (eq. 3: Tetens, over water at all temperatures).

    Args:
      temperature: [K].
      humidity: relative, 0 to 1.
    """
    t = np.asarray(temperature, float) - CELSIUS
    return np.asarray(100.0 * np.asarray(humidity, float) * 6.1078 * 10.0 ** (7.5 * t / (t + 237.3)))


def site_pressure(temperature: ArrayLike, altitude: ArrayLike, sea_level: ArrayLike = SEA_LEVEL_PRESSURE) -> Float:
    """Pressure [Pa] at an altitude [m] (eq. 4: isothermal, with the local temperature [K])."""
    exponent = -9.80665 * 0.0289652 * np.asarray(altitude, float) / (8.31446 * np.asarray(temperature, float))
    return np.asarray(np.asarray(sea_level, float) * np.exp(exponent))


def density_of(temperature: ArrayLike, humidity: ArrayLike, pressure: ArrayLike) -> Float:
    """Density [kg/m^3] of moist air of a temperature [K], relative humidity and pressure [Pa] (eq. 2)."""
    vapour = vapour_pressure(temperature, humidity)
    dry = np.asarray(pressure, float) - vapour
    return np.asarray((dry / R_DRY + vapour / R_VAPOUR) / np.asarray(temperature, float))


class Air(Record):
    """The weather that makes the air's density; temperatures in degrees Celsius."""

    temperature: Varying = 15.0
    """[degC] constant or in time."""
    humidity: Varying = 0.0
    """Relative, 0 to 1, constant or in time."""
    pressure: Varying | None = None
    """[Pa] measured at the site, constant or in time; without it that of the altitude."""
    altitude: float = Field(default=0.0, ge=-500.0, le=9000.0)
    """[m] of the site above sea level."""
    sea_level_pressure: float = Field(default=SEA_LEVEL_PRESSURE, gt=8e4, lt=1.1e5)
    """[Pa] where the pressure is not measured."""

    @model_validator(mode="after")
    def _check(self) -> Self:
        coldest, hottest = values(self.temperature).min(), values(self.temperature).max()
        if coldest <= -CELSIUS:
            raise ValueError(f"temperature {coldest:g} degC is below absolute zero (-273.15 degC)")
        if coldest < -90.0 or hottest > 60.0:
            worst = coldest if coldest < -90.0 else hottest
            hint = f"; if it is in kelvin, write {worst - CELSIUS:g}" if 180.0 < worst < 335.0 else ""
            raise ValueError(f"temperature {worst:g} degC is not between -90 and 60 degC{hint}")
        low, high = values(self.humidity).min(), values(self.humidity).max()
        if low < 0.0 or high > 1.0:
            worst = low if low < 0.0 else high
            hint = f"; if it is in percent, write {worst / 100.0:g}" if 1.0 < worst <= 100.0 else ""
            raise ValueError(f"humidity {worst:g} is not between 0 and 1{hint}")
        if self.pressure is not None and not (3e4 < values(self.pressure).min() <= values(self.pressure).max() < 1.2e5):
            raise ValueError("pressure [Pa] is not between 30,000 and 120,000; 1 hPa is 100 Pa")
        return self

    def at(self, times: ArrayLike) -> tuple[Float, Float, Float, Float]:
        """Temperature [K], relative humidity, pressure [Pa] and density [kg/m^3] at non-decreasing times [s]."""
        temperature, humidity = on_times(self.temperature, times) + CELSIUS, on_times(self.humidity, times)
        if self.pressure is None:
            pressure = site_pressure(temperature, self.altitude, self.sea_level_pressure)
        else:
            pressure = on_times(self.pressure, times)
        return temperature, humidity, pressure, density_of(temperature, humidity, pressure)
