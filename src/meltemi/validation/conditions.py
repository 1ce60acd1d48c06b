"""Wind and air of a measured record: sensors, mean profile, density.

Reference: docs/theory/validation.md (V-19, V-20).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fnmatch import fnmatch
from typing import Any

import numpy as np
from pydantic import Field

from meltemi.core.errors import InputError
from meltemi.core.record import Record
from meltemi.environment.air import density_of
from meltemi.turbulence.sensors import Sensor as WindSensor
from meltemi.turbulence.sensors import measured_wind
from meltemi.validation.channel_map import NACELLE, ChannelMap
from meltemi.validation.measurements import MeasuredRecord
from meltemi.wind.turbulent import TurbulentWind

TEMPERATURE, PRESSURE, HUMIDITY = "air_temperature", "air_pressure", "humidity"
"""Channels of the density [K, Pa, -]."""


class SiteConditions(Record):
    """What the sensors of a record do not give."""

    air_density: float | None = Field(default=None, gt=0.3, lt=2.0)
    """[kg/m^3; 0.7 to 1.6] in place of that of the sensors."""
    shear_exponent: float | None = Field(default=None, ge=-1.0, le=2.0)
    """[-; -0.1 to 0.8] in place of that of anemometers at several heights."""
    veer: float | None = Field(default=None, ge=-0.1, le=0.1)
    """[rad/m] in place of that of vanes at several heights."""
    pressure: float | None = Field(default=None, gt=3e4, lt=1.2e5)
    """[Pa] where it is not measured."""


@dataclass(frozen=True)
class RecordConditions:
    """Wind and air of a record."""

    sensors: tuple[WindSensor, ...]  # anemometers and vanes upwind, their time 0 at the start of the simulation
    wind: TurbulentWind  # mean profile and turbulence; its seed is replaced
    distance: float  # [m] of the mast upwind of the tower
    air_density: float | None  # [kg/m^3]; None: that of the case


def given_conditions(patterns: Mapping[str, SiteConditions], file: str) -> SiteConditions:
    """The conditions of the patterns that a file's name matches; later ones take precedence."""
    keys = [each.model_dump(exclude_none=True) for pattern, each in patterns.items() if fnmatch(file, pattern)]
    return SiteConditions(**{key: value for each in keys for key, value in each.items()})


def conditions_of(
    record: MeasuredRecord,
    channels: ChannelMap,
    given: SiteConditions,
    hub_height: float,
    transient: float,
    turbulence: Mapping[str, Any],
) -> RecordConditions:
    """Wind and air of a record.

    Args:
      record: its signals.
      channels: positions of the sensors.
      given: what the sensors do not give, or is preferred to them.
      hub_height: [m].
      transient: [s] of the simulation before the record.
      turbulence: further fields of :class:`TurbulentWind`.

    Raises:
      InputError: no anemometer upwind, or anemometers at different distances.
    """
    masts: dict[tuple[float, float], dict[str, Any]] = {}
    distances = set()
    for name, _, sensor in channels.sensors():
        if not sensor.component or sensor.upwind < 0.0 or name not in record.signals:
            continue
        if sensor.height is None:
            raise InputError(f"channels.{name}: the height of an anemometer or vane is needed")
        signal = record[name]
        place = masts.setdefault((sensor.height, sensor.lateral), {"time": signal.time - record.begin + transient})
        if len(place["time"]) != len(signal.time):
            raise InputError(f"{record.file}: {name} and others at {sensor.height:g} m have different times")
        values = signal.values
        if sensor.component == "direction":  # from the axis of the rotor (V-19)
            axis = np.angle(np.nanmean(np.exp(1j * record.signals.get(NACELLE, signal).values)))
            values = np.angle(np.exp(1j * (values - axis)))
        place[sensor.component] = values
        distances.add(sensor.upwind)
    if not masts:
        raise InputError(
            f"{record.file}: no wind upwind of the rotor: the map needs a sensor with component: u and v, speed, ..."
        )
    if len(distances) > 1:
        raise InputError(
            f"{record.file}: anemometers at {', '.join(f'{d:g}' for d in sorted(distances))} m upwind: "
            "leave those out that are not at one distance"
        )
    try:
        sensors = tuple(WindSensor(height=height, across=across, **x) for (height, across), x in masts.items())
        wind = measured_wind(sensors, hub_height, shear_exponent=given.shear_exponent, veer=given.veer, **turbulence)
    except InputError as error:
        raise InputError(f"{record.file}: {error}") from None
    return RecordConditions(sensors, wind, distances.pop(), _density(record, given))


def _density(record: MeasuredRecord, given: SiteConditions) -> float | None:
    """[kg/m^3] (V-20); None if neither given nor measured."""
    measured = {
        name: signal.finite for name in (TEMPERATURE, PRESSURE, HUMIDITY) if (signal := record.signals.get(name))
    }
    mean = {name: float(np.mean(x)) for name, x in measured.items() if len(x)}
    pressure = mean.get(PRESSURE, given.pressure)
    if given.air_density is not None or TEMPERATURE not in mean or pressure is None:
        return given.air_density
    return float(density_of(mean[TEMPERATURE], mean.get(HUMIDITY, 0.5), pressure))
