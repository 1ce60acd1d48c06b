"""Monthly climate of a site: air and wind."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import AfterValidator, Field, model_validator

from meltemi.core.errors import InputError, did_you_mean
from meltemi.core.record import Record, Vector
from meltemi.core.yamlfile import read_record
from meltemi.environment.air import Air
from meltemi.environment.rain import RAIN_CLASSES

Float = NDArray[np.float64]

DATA = Path(__file__).parent / "data"
MONTH_HOURS = 24.0 * np.array([31.0, 28.25, 31.0, 30.0, 31.0, 30.0, 31.0, 31.0, 30.0, 31.0, 30.0, 31.0])
"""[h] hours of each month, with the mean of leap years."""


def _twelve(values: Float) -> Float:
    if len(values) != 12:
        raise ValueError(f"expected 12 numbers, January to December, found {len(values)}")
    return values


def _ascending(edges: ArrayLike) -> Float:
    """Edges of wind speeds; infinity may be the last one."""
    try:
        speeds = np.asarray(edges, float)
    except (TypeError, ValueError):
        speeds = np.zeros(0)
    if speeds.ndim != 1 or len(speeds) < 2:
        raise InputError(f"edges: expected at least two wind speeds, found {edges!r}")
    if np.any(np.isnan(speeds)):
        raise InputError("edges: nan is not a wind speed")
    if speeds.min() < 0.0:
        raise InputError(f"edges must not be negative, found {speeds.min():g} m/s")
    if not np.all(speeds[1:] > speeds[:-1]):
        i = int(np.flatnonzero(~(speeds[1:] > speeds[:-1]))[0])
        raise InputError(f"edges must ascend, but edge {i + 2} is {speeds[i + 1]:g} m/s")
    return speeds


Months = Annotated[Vector, AfterValidator(_twelve)]
"""Twelve numbers, January to December."""


class Climate(Record):
    """Monthly means of weather and wind at a site."""

    name: str
    altitude: float = Field(default=0.0, ge=-500.0, le=9000.0)
    """[m] altitude above sea level, used without a pressure."""
    temperature: Months
    """(12,) [degC] mean of each month."""
    humidity: Months
    """(12,) relative, 0 to 1."""
    pressure: Months | None = None
    """(12,) [Pa] measured at the site; by default that of the altitude."""
    rain_hours: dict[str, Months] = Field(default_factory=dict)
    """(12,) [h] hours by class of rain (see `Rain.kind`), at the class's rate."""
    icing_hours: Months = Field(default_factory=lambda: np.zeros(12))
    """(12,) [h] hours of blade icing (instrumental icing as defined by IEA Wind)."""
    wind_scale: Months
    """(12,) [m/s] scale A of the Weibull distribution of the wind speed."""
    wind_shape: Months
    """(12,) shape parameter k."""
    wind_height: float = Field(default=100.0, gt=0.0)
    """[m] height of the given wind."""
    shear_exponent: float = Field(default=0.14, ge=0.0, le=0.5)
    """Shear exponent of the mean wind."""
    source: str = ""
    """Source of the data."""

    @model_validator(mode="after")
    def _check(self) -> Self:
        for name in ("wind_scale", "wind_shape"):
            if getattr(self, name).min() <= 0.0:
                raise ValueError(f"{name} must be positive")
        for name in self.rain_hours:
            if name not in RAIN_CLASSES:
                raise ValueError(f"rain_hours: no class of rain {name!r}; {did_you_mean(name, RAIN_CLASSES)}")
        for name, hours in (("rain", sum(self.rain_hours.values(), np.zeros(12))), ("icing", self.icing_hours)):
            if hours.min() < 0.0 or np.any(hours > MONTH_HOURS):
                worst = int(np.argmax(np.maximum(-hours, hours - MONTH_HOURS)))
                raise ValueError(
                    f"{name} of {hours[worst]:g} h in month {worst + 1}, which has {MONTH_HOURS[worst]:g} h"
                )
        for month in range(1, 13):
            self.air(month)
        return self

    def air(self, month: int) -> Air:
        """The air of a month, 1 to 12.

        Raises:
          InputError: the month is not within 1 to 12.
        """
        if month not in range(1, 13):
            raise InputError(f"month: expected 1 to 12, found {month!r}")
        i = int(month) - 1
        pressure = None if self.pressure is None else float(self.pressure[i])
        return Air(
            temperature=float(self.temperature[i]),
            humidity=float(self.humidity[i]),
            pressure=pressure,
            altitude=self.altitude,
        )

    @property
    def density(self) -> Float:
        """(12,) [kg/m^3] air density."""
        return np.array([self.air(month).at([0.0])[-1][0] for month in range(1, 13)])

    def shifted(
        self,
        temperature: float = 0.0,
        humidity: float = 0.0,
        pressure: float = 0.0,
        wind: float = 1.0,
        rain: float = 1.0,
        icing: float = 1.0,
    ) -> Climate:
        """A climate scenario with changes of temperature, humidity, wind and rain.

        Args:
          temperature: [K] added to each month.
          humidity: added to the relative humidity, which stays between 0 and 1.
          pressure: [Pa] added to each month's; needs measured pressures.
          wind: factor on the scale of the wind speed.
          rain: factor on the hours of every class of rain.
          icing: factor on the hours with ice.

        Raises:
          InputError: pressures are not given but shifted, or the resulting year is impossible.
        """
        if pressure and self.pressure is None:
            raise InputError(f"climate {self.name!r} has no pressure to shift; it follows from the altitude")
        return self.replace(
            temperature=self.temperature + temperature,
            humidity=np.clip(self.humidity + humidity, 0.0, 1.0),
            pressure=None if self.pressure is None else self.pressure + pressure,
            wind_scale=self.wind_scale * wind,
            rain_hours={name: hours * rain for name, hours in self.rain_hours.items()},
            icing_hours=self.icing_hours * icing,
        )

    def wind_hours(self, edges: ArrayLike, height: float | None = None) -> Float:
        """Hours of each month in wind speed bins.

        Args:
          edges: (n + 1,) [m/s] ascending edges, from 0 on.
          height: [m] hub height; by default the height of the wind data.

        Returns:
          (12, n) [h] hours.

        Raises:
          InputError: edges do not ascend or are no wind speeds, or the height is not positive.
        """
        speeds = _ascending(edges)
        if height is None:
            height = self.wind_height
        if not 0.0 < height < np.inf:
            raise InputError(f"height must be a positive number of metres, found {height:g}")
        scale = self.wind_scale * (height / self.wind_height) ** self.shear_exponent
        above = np.exp(-((speeds / scale[:, None]) ** self.wind_shape[:, None]))
        return np.asarray(MONTH_HOURS[:, None] * (above[:, :-1] - above[:, 1:]))


def list_climates() -> list[str]:
    """Names that :func:`load_climate` knows."""
    return sorted(path.stem for path in DATA.glob("*.yaml"))


def load_climate(name: str | Path) -> Climate:
    """Load an example climate by name, or a climate from a YAML file by path.

    Raises:
      InputError: the climate or file does not exist, or the file does not describe a valid climate.
    """
    if str(name) in list_climates():
        return read_record(DATA / f"{name}.yaml", Climate)
    path = Path(name)
    if path.suffix in (".yaml", ".yml") or path.exists():
        return read_record(path, Climate)
    raise InputError(
        f"unknown climate {str(name)!r}: {did_you_mean(str(name), list_climates())} (or give the path of a .yaml file)"
    )
