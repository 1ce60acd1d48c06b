"""Air density from temperature, humidity, altitude and pressure.

Reference: Palanimuthu et al. (2022), eqs (2) to (4), with 273.15 in place of the printed 273.5.
"""

from __future__ import annotations

from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field, model_validator

from meltemi.core.errors import InputError
from meltemi.core.record import Record
from meltemi.core.series import Varying, on_times, union
from meltemi.environment.gases import CELSIUS, R_DRY, R_VAPOUR, STANDARD_TEMPERATURE

Float = NDArray[np.float64]

SEA_LEVEL_PRESSURE = 101325.0
"""[Pa] pressure of the ISO 2533 standard atmosphere at sea level."""
SEA_LEVEL_RANGE = (8e4, 1.1e5)
"""[Pa] limits of the pressure at sea level."""


def vapour_pressure(temperature: ArrayLike, humidity: ArrayLike) -> Float:
    """Partial pressure of water vapour [Pa] (eq. 3: Tetens, over water at all temperatures).

    Args:
      temperature: [K] air temperature.
      humidity: relative humidity, 0 to 1.
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


def _problem(temperature: ArrayLike, humidity: ArrayLike, pressure: ArrayLike | None) -> str | None:
    """Error message for invalid temperature [degC], relative humidity or pressure [Pa]; empty if valid."""
    t, h = np.asarray(temperature, float), np.asarray(humidity, float)
    coldest, hottest = t.min(), t.max()
    if coldest <= -CELSIUS:
        return f"temperature {coldest:g} degC is below absolute zero (-273.15 degC)"
    if not -90.0 <= coldest <= hottest <= 60.0:
        worst = coldest if coldest < -90.0 else hottest
        hint = f"; if it is in kelvin, write {worst - CELSIUS:g}" if 180.0 < worst < 335.0 else ""
        return f"temperature {worst:g} degC is not between -90 and 60 degC{hint}"
    low, high = h.min(), h.max()
    if not 0.0 <= low <= high <= 1.0:
        worst = low if low < 0.0 else high
        hint = f"; if it is in percent, write {worst / 100.0:g}" if 2.0 <= worst <= 100.0 else ""
        return f"humidity {worst:g} is not between 0 and 1{hint}"
    if pressure is None:
        return None
    p = np.asarray(pressure, float)
    excess = vapour_pressure(t + CELSIUS, h) - p
    if np.any(excess >= 0.0):
        return f"pressure {p.min():g} Pa is below that of the water vapour alone; 1 hPa is 100 Pa"
    if not 3e4 < p.min() <= p.max() < 1.2e5:
        worst = p.min() if p.min() <= 3e4 else p.max()
        return f"pressure {worst:g} Pa is not between 30,000 and 120,000 Pa; 1 hPa is 100 Pa"
    return None


def _numbers(**given: ArrayLike) -> list[Float]:
    """Arguments as arrays that can be broadcast.

    Raises:
      InputError: an argument is empty or not numeric, or the shapes do not match.
    """
    arrays = []
    for name, value in given.items():
        try:
            array = np.asarray(value, float)
        except (TypeError, ValueError):
            raise InputError(f"{name}: expected a number or an array of numbers, found {value!r}") from None
        if array.size == 0:
            raise InputError(f"{name}: at least one number is needed")
        arrays.append(array)
    try:
        np.broadcast_shapes(*(array.shape for array in arrays))
    except ValueError:
        shapes = ", ".join(f"{name} {array.shape}" for name, array in zip(given, arrays, strict=True))
        raise InputError(f"shapes do not go together: {shapes}") from None
    return arrays


def air_density(
    temperature: ArrayLike = 15.0,
    humidity: ArrayLike = 0.0,
    altitude: ArrayLike = 0.0,
    pressure: ArrayLike | None = None,
    sea_level_pressure: ArrayLike = SEA_LEVEL_PRESSURE,
) -> Float:
    """Density of moist air [kg/m^3] (eqs 2 to 4); arguments are broadcast.

    Args:
      temperature: [degC] air temperature.
      humidity: relative humidity, 0 to 1.
      altitude: [m] altitude above sea level.
      pressure: [Pa] pressure measured at the site; by default that of the altitude.
      sea_level_pressure: [Pa] pressure at sea level, for the altitude.

    Raises:
      InputError: a value outside the range of atmospheric air, or not finite.
    """
    given = {"temperature": temperature, "humidity": humidity, "altitude": altitude}
    given |= {"sea_level_pressure": sea_level_pressure} | ({} if pressure is None else {"pressure": pressure})
    t, h, height, sea, *measured = _numbers(**given)
    site = measured[0] if measured else None
    problem = _problem(t, h, site)
    if problem is None and not np.all((height >= -500.0) & (height <= 9000.0)):
        problem = "altitude is not between -500 and 9,000 m"
    low, high = SEA_LEVEL_RANGE
    if problem is None and not low < sea.min() <= sea.max() < high:
        worst = sea.max() if sea.min() > low else sea.min()
        problem = f"sea_level_pressure {worst:g} Pa is not between {low:,.0f} and {high:,.0f} Pa; 1 hPa is 100 Pa"
    if problem:
        raise InputError(problem)
    kelvin = t + CELSIUS
    return density_of(kelvin, h, site_pressure(kelvin, height, sea) if site is None else site)


class Air(Record):
    """State of the air that determines its density; temperatures in degrees Celsius."""

    temperature: Varying = STANDARD_TEMPERATURE
    """[degC] constant or time-varying."""
    humidity: Varying = 0.0
    """Relative humidity, 0 to 1, constant or time-varying."""
    pressure: Varying | None = None
    """[Pa] measured at the site, constant or time-varying; by default that of the altitude."""
    altitude: float = Field(default=0.0, ge=-500.0, le=9000.0)
    """[m] altitude of the site above sea level."""
    sea_level_pressure: float = Field(default=SEA_LEVEL_PRESSURE, gt=SEA_LEVEL_RANGE[0], lt=SEA_LEVEL_RANGE[1])
    """[Pa] used if the pressure is not measured."""

    @model_validator(mode="after")
    def _check(self) -> Self:
        times = union(self.temperature, self.humidity, 0.0 if self.pressure is None else self.pressure)
        pressure = None if self.pressure is None else on_times(self.pressure, times)
        problem = _problem(on_times(self.temperature, times), on_times(self.humidity, times), pressure)
        if problem:
            raise ValueError(problem)
        return self

    def at(self, times: ArrayLike) -> tuple[Float, Float, Float, Float]:
        """Temperature [K], relative humidity, pressure [Pa] and density [kg/m^3] at non-decreasing times [s]."""
        temperature, humidity = on_times(self.temperature, times) + CELSIUS, on_times(self.humidity, times)
        if self.pressure is None:
            pressure = site_pressure(temperature, self.altitude, self.sea_level_pressure)
        else:
            pressure = on_times(self.pressure, times)
        return temperature, humidity, pressure, density_of(temperature, humidity, pressure)
