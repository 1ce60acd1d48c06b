"""Periods of a year with their air and wind: months of a climate, or hours of a weather file.

Files: CSV with a row for each hour and a header of the names in ``COLUMNS``; EPW, the hourly weather files of building
simulation (wind at 10 m). An hour in which the temperature, humidity or wind is missing is left out.

Reference: docs/guide/site-climate.md; EnergyPlus, Auxiliary Programs, chapter EPW.
"""

from __future__ import annotations

import csv
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import InputError, did_you_mean
from meltemi.core.files import text_of
from meltemi.environment.air import Air, density_of, site_pressure
from meltemi.environment.gases import CELSIUS
from meltemi.environment.rain import RAIN_CLASSES
from meltemi.studies.climate.climates import MONTH_HOURS, Climate, load_climate

Float = NDArray[np.float64]
Effect = Literal["altitude", "temperature", "humidity"]

COLUMNS = {
    "time": "ISO 8601; without it the rows are the hours of a year",
    "temperature": "degC",
    "humidity": "relative",
    "pressure": "Pa; without it that of the altitude",
    "wind_speed": "m/s",
    "rain": "mm/h",
    "icing": "hours of the hour, 0 to 1",
}
NEEDED = ("temperature", "humidity", "wind_speed")
RANGES = {"temperature": (-90, 70), "humidity": (0, 1), "pressure": (3e4, 1.2e5), "wind_speed": (0, 100)}
RANGES |= {"rain": (0, 2500), "icing": (0, 1)}
EPW = {"temperature": (6, 99.0, 1.0), "humidity": (8, 999.0, 0.01), "pressure": (9, 999999.0, 1.0)}
EPW |= {"wind_speed": (21, 999.0, 1.0), "rain": (33, 999.0, 1.0)}
"""Column of an EPW file, number from which on it is missing, and factor."""
EPW_HEIGHT = 10.0
LEAST_RAIN = 0.1
"""[mm/h] below which it does not rain."""


@dataclass(frozen=True)
class Periods:
    """Periods of a year.

    Attributes:
      name: name of the site.
      hours: (N,) [h] length.
      month: (N,) 1 to 12.
      temperature: (N,) [degC] air temperature.
      humidity: (N,) relative humidity.
      pressure: (N,) [Pa] air pressure; None if it follows from the altitude.
      altitude: [m] altitude of the site.
      rain_hours: (N,) [h] hours by class of rain.
      icing_hours: (N,) [h] hours with ice on the blades.
      wind_hours: (N, n) [h] hours in wind speed bins, function of edges (n + 1,) [m/s] and hub height [m].
      missing: hours that were left out.
    """

    name: str
    hours: Float
    month: NDArray[np.int64]
    temperature: Float = field(repr=False)
    humidity: Float = field(repr=False)
    pressure: Float | None = field(repr=False)
    altitude: float
    rain_hours: Mapping[str, Float] = field(repr=False)
    icing_hours: Float = field(repr=False)
    wind_hours: Callable[[Float, float], Float] = field(repr=False)
    missing: int = 0

    def density(self, what: Effect = "humidity") -> Float:
        """(N,) [kg/m^3] air density with the effects up to the named one: altitude, temperature, humidity."""
        if what == "altitude":
            air = Air(altitude=self.altitude)
            if self.pressure is not None:
                air = Air(pressure=float(np.average(self.pressure, weights=self.hours)))
            return np.full(len(self.hours), air.at([0.0])[-1][0])
        kelvin = self.temperature + CELSIUS
        pressure = site_pressure(kelvin, self.altitude) if self.pressure is None else self.pressure
        return np.asarray(density_of(kelvin, self.humidity if what == "humidity" else 0.0, pressure))


def periods(site: str | Path | Climate | Periods, **options: float) -> Periods:
    """Periods of a climate by name, of a YAML file of a climate, or of a weather file.

    Args:
      site: name or file.
      options: arguments of :func:`read_weather`.

    Raises:
      InputError: the climate or file does not exist or is not valid.
    """
    if isinstance(site, Periods):
        return site
    if not isinstance(site, Climate) and Path(site).suffix.lower() in (".csv", ".epw"):
        return read_weather(Path(site), **options)
    c = site if isinstance(site, Climate) else load_climate(site)  # climates already have altitude, height and shear
    return Periods(
        name=c.name,
        hours=MONTH_HOURS,
        month=np.arange(1, 13),
        temperature=c.temperature,
        humidity=c.humidity,
        pressure=c.pressure,
        altitude=c.altitude,
        rain_hours=c.rain_hours,
        icing_hours=c.icing_hours,
        wind_hours=c.wind_hours,
    )


def read_weather(
    path: Path, *, altitude: float | None = None, wind_height: float | None = None, shear_exponent: float = 0.14
) -> Periods:
    """Read hourly weather.

    Args:
      path: CSV or EPW file.
      altitude: [m] altitude for missing pressures; by default that of an EPW file, or 0.
      wind_height: [m] height of the wind data; by default 10 m for EPW files, and hub height for others.
      shear_exponent: shear exponent for the extrapolation to hub height.

    Raises:
      InputError: the file cannot be read, lacks a column, is empty, or has an implausible value.
    """
    if wind_height is not None and not wind_height > 0.0:
        raise InputError(f"{path}: wind_height: expected a height above the ground in m, found {wind_height:g}")
    lines = text_of(path).splitlines()
    epw = path.suffix.lower() == ".epw"
    columns, month, place = _epw(path, lines) if epw else _csv(path, lines)
    if epw and wind_height is None:
        wind_height = EPW_HEIGHT
    whole = np.all([np.isfinite(columns[name]) for name in NEEDED], axis=0)
    if not whole.any():
        raise InputError(f"{path}: no hour has {', '.join(NEEDED)}")
    kept = {name: values[whole] for name, values in columns.items()}
    for name, values in kept.items():
        _check(path, name, values)
    altitude = place if altitude is None else altitude
    pressure = kept.get("pressure")
    if pressure is not None and np.isnan(pressure).any():
        pressure = np.where(np.isnan(pressure), site_pressure(kept["temperature"] + CELSIUS, altitude), pressure)
    speed, n = kept["wind_speed"], int(whole.sum())

    def wind_hours(edges: Float, height: float) -> Float:
        at_hub = speed * (1.0 if wind_height is None else (height / wind_height) ** shear_exponent)
        return np.asarray((at_hub[:, None] >= edges[:-1]) & (at_hub[:, None] < edges[1:]), dtype=float)

    rain = np.nan_to_num(kept.get("rain", np.zeros(n)))
    rates = np.array(list(RAIN_CLASSES.values()))
    nearest = np.argmin(np.abs(np.log(rates / np.maximum(rain, LEAST_RAIN)[:, None])), axis=1)
    return Periods(
        name=path.stem,
        hours=np.ones(n),
        month=month[whole],
        temperature=kept["temperature"],
        humidity=kept["humidity"],
        pressure=pressure,
        altitude=altitude,
        # class with the closest rain rate, for the time with the same amount of water
        rain_hours={
            name: np.where((nearest == i) & (rain >= LEAST_RAIN), np.minimum(rain / rates[i], 1.0), 0.0)
            for i, name in enumerate(RAIN_CLASSES)
        },
        icing_hours=np.nan_to_num(kept.get("icing", np.zeros(n))),
        wind_hours=wind_hours,
        missing=len(whole) - n,
    )


def _check(path: Path, name: str, values: Float) -> None:
    low, high = RANGES[name]
    wrong = np.flatnonzero((values < low) | (values > high))
    if len(wrong):
        more = "; divide percent by 100" if name == "humidity" and values.max() <= 100.0 else ""
        raise InputError(
            f"{path}: {name} of {values[wrong[0]]:g} in hour {wrong[0] + 1}: expected {low:g} to {high:g} "
            f"({COLUMNS[name]}){more}"
        )


def _number(path: Path, text: str, where: str) -> float:
    try:
        return float(text) if text.strip() else np.nan
    except ValueError:
        raise InputError(f"{path}: {where}: expected a number, found {text!r}") from None


def _csv(path: Path, lines: list[str]) -> tuple[dict[str, Float], NDArray[np.int64], float]:
    """Columns, months and altitude of a CSV file."""
    reader = csv.DictReader(line for line in lines if line.strip() and not line.startswith("#"))
    names = [name.strip() for name in reader.fieldnames or ()]
    for name in names:
        if name not in COLUMNS:
            raise InputError(f"{path}: no column {name!r}: {did_you_mean(name, COLUMNS)}")
    for name in NEEDED:
        if name not in names:
            raise InputError(f"{path}: column {name} [{COLUMNS[name]}] is missing")
    reader.fieldnames = names
    rows = list(reader)
    columns = {
        name: np.array([_number(path, row[name] or "", f"hour {i}, {name}") for i, row in enumerate(rows, start=1)])
        for name in names
        if name != "time"
    }
    if "time" in names:
        try:
            month = np.array([datetime.fromisoformat(row["time"].strip()).month for row in rows], dtype=int)
        except ValueError as error:
            raise InputError(f"{path}: time: expected ISO 8601, such as 2024-01-31T13:00 ({error})") from None
    else:
        month = 1 + np.searchsorted(np.cumsum(MONTH_HOURS), np.arange(len(rows)) % 8766, side="right")
    return columns, month, 0.0


def _epw(path: Path, lines: list[str]) -> tuple[dict[str, Float], NDArray[np.int64], float]:
    """Columns, months and altitude of an EPW file."""
    head = lines[0].split(",") if lines else []
    if len(head) < 10 or head[0].strip().upper() != "LOCATION":
        raise InputError(f"{path}: line 1: expected LOCATION of an EPW file, with the elevation in its tenth field")
    rows = [line.split(",") for line in lines[8:] if line.strip()]
    for i, row in enumerate(rows, start=9):
        if len(row) < 22:
            raise InputError(f"{path}: line {i}: expected the 35 fields of an hour, found {len(row)}")
    columns = {}
    for name, (at, missing, factor) in EPW.items():
        cells = (row[at] if at < len(row) else "" for row in rows)
        values = np.array([_number(path, cell, f"line {i}") for i, cell in enumerate(cells, start=9)])
        columns[name] = np.where(values >= missing, np.nan, values * factor)
    columns["humidity"] = np.minimum(columns["humidity"], 1.0)  # supersaturated hours are rounded up
    month = np.array([int(_number(path, row[1], "month")) for row in rows], dtype=int)
    return columns, month, _number(path, head[9], "line 1, elevation")
