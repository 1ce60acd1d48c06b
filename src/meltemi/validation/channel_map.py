"""Channel map: which column of which file is which channel, with unit, sign, gain, position and time stamps."""

from __future__ import annotations

from collections.abc import Iterator
from datetime import datetime, tzinfo
from functools import cache
from pathlib import Path
from typing import Literal, Self
from zoneinfo import ZoneInfo

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, field_validator, model_validator

from meltemi.core.errors import did_you_mean
from meltemi.core.record import Record
from meltemi.core.yamlfile import read_record
from meltemi.postprocess.files.openfast import UNITS, si_unit
from meltemi.simulation.channels import Channel, every_kind

Statistic = Literal["mean", "std", "min", "max", "DEL, m = 4", "DEL, m = 10"]
"""Statistics of ten minutes, by their names in reports."""
Kind = Literal["sonic", "cup", "vane", "gauge", "power", "rpm", "position", "acceleration", "other"]
FURTHER_UNITS = {"%": ("-", 0.01), "hPa": ("Pa", 100.0), "mV/V": ("mV/V", 1.0), "V": ("V", 1.0)}  # SI unit, factor
NACELLE = "nacelle_direction"
"""Channel of the direction [rad] to which the rotor's axis points, as compass of the vane."""


@cache
def known_channel(name: str) -> Channel | None:
    """The channel of the catalogue with one of its names, irrespective of case; None for a quantity of the mast."""
    return next((c for c in every_kind().values() if name.lower() in (known.lower() for known in c.names)), None)


class Sensor(Record):
    """A column of a file and what it measures: value = sign (gain x + offset), in ``unit``."""

    column: str = ""
    """Name of the column, with its group or structure if it has one: ``mast/u_32m``."""
    statistics: dict[Statistic, str] = Field(default_factory=dict)
    """In place of it, of a table with one row for ten minutes: the column of each statistic, as in
    ``{mean: P_avg, std: P_std}``."""
    unit: str
    """Unit of the value: kN m, rpm, deg, mV/V ..."""
    kind: Kind = "other"
    """Instrument. A ``position`` (pitch, azimuth, yaw) may rest; ``power`` and ``rpm`` may rest at zero."""
    sign: Literal[1, -1] = 1
    """-1 where the column has the other positive direction than the channel."""
    gain: float = Field(default=1.0, gt=0.0)
    """Unit per unit of the column; ``sign: -1`` reverses it."""
    offset: float = 0.0
    """[unit] added after the gain."""
    axes: str = ""
    """Axes of the column, as the catalogue names them (``pitched blade axes``); must be those of the channel."""
    component: Literal["", "u", "v", "w", "speed", "direction"] = ""
    """What an anemometer or vane upwind of the rotor measures: ``u`` along the mean wind and ``v`` to the left looking
    downwind of a sonic, ``w`` upwards, horizontal ``speed``, ``direction`` clockwise from above."""
    height: float | None = None
    """[m] above ground."""
    upwind: float = 0.0
    """[m] distance upwind of the tower's axis; negative for the nacelle's anemometer behind a rotor."""
    lateral: float = 0.0
    """[m] distance to the left looking downwind."""

    @property
    def si(self) -> tuple[str, float]:
        """SI unit and the factor to it."""
        return FURTHER_UNITS.get(self.unit) or si_unit(self.unit)

    @property
    def label(self) -> str:
        """Its column, or the first one of its statistics."""
        return self.column or next(iter(self.statistics.values()))

    @model_validator(mode="after")
    def _check(self) -> Self:
        if bool(self.column) == bool(self.statistics):
            raise ValueError("give column; or statistics, with the column of each, of a table of ten-minute statistics")
        return self

    def in_si(self, x: NDArray[np.float64], statistic: Statistic | None = None) -> NDArray[np.float64]:
        """SI values of numbers (T,) of the column, or of a statistic: the spread of a channel has no offset."""
        spread = statistic and statistic not in ("mean", "min", "max")
        return (self.gain * x if spread else self.sign * (self.gain * x + self.offset)) * self.si[1]

    @field_validator("unit")
    @classmethod
    def _unit(cls, unit: str) -> str:
        if unit not in FURTHER_UNITS and si_unit(unit)[0] not in {si for si, _ in UNITS.values()}:
            raise ValueError(f"unknown unit {unit!r}: {did_you_mean(unit, [*UNITS, *FURTHER_UNITS])}")
        return unit


class TimeStamps(Record):
    """How a file gives its times."""

    column: str
    """Name of the column."""
    form: Literal["iso", "posix", "matlab", "seconds"] = "iso"
    """ISO 8601 or dates; seconds since 1970; days of MATLAB's ``datenum``; seconds from the date in the name."""
    zone: str = "UTC"
    """Time zone of stamps that name none: ``UTC``, ``+01:00`` or a name such as ``Europe/Berlin``."""
    stamp: Literal["begin", "end"] = "begin"
    """Whether a stamp is the begin or the end of its period: that of a sample, or for one in the name, of the file."""
    name: str | None = None
    """Date in the name of the file of ``seconds``, in the codes of ``strptime``: ``swift_%Y%m%d_%H%M.csv``."""

    @property
    def time_zone(self) -> tzinfo | None:
        """The time zone."""
        if self.zone.startswith(("+", "-")):
            return datetime.fromisoformat(f"2000-01-01T00:00{self.zone}").tzinfo
        return ZoneInfo(self.zone)

    @model_validator(mode="after")
    def _check(self) -> Self:
        if (self.form == "seconds") != (self.name is not None):
            raise ValueError("form: seconds and name, with the date from which they count, go together; give both")
        try:
            _ = self.time_zone
        except (KeyError, ValueError, OSError):  # KeyError: not in the time zone database
            raise ValueError(f"no time zone {self.zone!r}; give UTC, one such as +01:00, or Europe/Berlin") from None
        return self

    def posix(self, moment: datetime) -> float:
        """[s] since 1970 of a moment; one without zone is in that of the logger."""
        return (moment if moment.tzinfo else moment.replace(tzinfo=self.time_zone)).timestamp()


class Logger(Record):
    """Files of one data logger: they have one clock and one sampling rate."""

    files: str = "*"
    """Pattern of the names of its files in the folder: ``mast_*.csv``."""
    statistics: dict[Statistic, str] = Field(default_factory=dict)
    """In place of it, the file of each ten-minute statistic, as in ``{mean: means.csv, std: deviations.csv}``; all have
    the same columns and rows."""
    time: TimeStamps | None = None
    """Needed but for statistics, whose rows are numbered without it."""
    missing: tuple[float, ...] = ()
    """Values that stand for a missing sample, such as -9999."""
    channels: dict[str, Sensor]
    """Sensors by channel: meltemi's or OpenFAST's name, which becomes meltemi's, or any name for one of the mast."""

    @field_validator("channels")
    @classmethod
    def _known(cls, channels: dict[str, Sensor]) -> dict[str, Sensor]:
        known: dict[str, Sensor] = {}
        for name, sensor in channels.items():
            channel, unit = known_channel(name), sensor.si[0]
            key = channel.name if channel else name
            if key in known or "@" in key:
                raise ValueError(
                    f"{name}: the logger has {key} twice, or there is an @ in the name; choose another one"
                )
            known[key] = sensor
            if channel is None and sensor.kind in ("gauge", "power", "rpm", "position") and name != NACELLE:
                names = [known for c in every_kind().values() for known in c.names]
                raise ValueError(f"no channel {name!r} for a {sensor.kind}: {did_you_mean(name, names)}")
            if channel and unit != channel.unit and not (unit in ("mV/V", "V") and sensor.kind == "gauge"):
                raise ValueError(
                    f"{name}: unit {sensor.unit} of column {sensor.label!r}, but {channel.name} is in "
                    f"{channel.display_unit[0]}; correct the unit, or the name of the channel"
                )
            if channel and sensor.axes and sensor.axes != channel.frame:
                raise ValueError(
                    f"{name}: column {sensor.label!r} is in {sensor.axes}, but {channel.name} is in "
                    f"{channel.frame}; choose the channel of those axes"
                )
        return known

    @model_validator(mode="after")
    def _check(self) -> Self:
        of_columns = {bool(sensor.statistics) for sensor in self.channels.values()}
        if True in of_columns and (self.statistics or False in of_columns):
            raise ValueError("statistics: either every channel names the columns of them, or the logger the files")
        if self.time is None and not self.statistical:
            raise ValueError("time: the column of the time stamps is needed")
        return self

    @property
    def statistical(self) -> bool:
        """Whether its rows are ten-minute statistics."""
        return bool(self.statistics) or any(sensor.statistics for sensor in self.channels.values())

    def columns_of(self, sensor: Sensor) -> dict[Statistic | None, str]:
        """Column of a sensor, or of its statistics; those of a file for each statistic are ``mean/P``."""
        if not self.statistical:
            return {None: sensor.column}
        columns = sensor.statistics or {name: f"{name}/{sensor.column}" for name in self.statistics}
        other: dict[Statistic, Statistic] = {"min": "max", "max": "min"} if sensor.sign < 0 else {}
        return {other.get(name, name): column for name, column in columns.items()}


class ChannelMap(Record):
    """All loggers of a measurement; a channel that two of them have compares their clocks."""

    loggers: dict[str, Logger]
    """The first one decides where ten-minute records begin."""
    wind: str = "wind_speed"
    """Channel of the wind speed that sorts the records."""

    @model_validator(mode="after")
    def _check(self) -> Self:
        names = [name for name, _, _ in self.sensors()]
        if not names:
            raise ValueError("loggers: at least one channel is needed")
        if self.wind not in names:
            raise ValueError(f"wind: no channel {self.wind!r} in the map: {did_you_mean(self.wind, names)}")
        if self.statistical:
            loggers, one = self.loggers.values(), len(self.loggers) == 1
            if not all(each.statistical and (each.time or one) for each in loggers):
                raise ValueError("loggers: all have ten-minute statistics, with times to join their rows, or none has")
            known = next(self.loggers[key].columns_of(each) for name, key, each in self.sensors() if name == self.wind)
            if lacking := {"mean", "std"} - known.keys():
                raise ValueError(f"wind: {self.wind} needs mean and std to define the wind; {min(lacking)} is missing")
        return self

    @property
    def statistical(self) -> bool:
        """Whether the measurement is ten-minute statistics, not series."""
        return any(logger.statistical for logger in self.loggers.values())

    def sensors(self) -> Iterator[tuple[str, str, Sensor]]:
        """Channel, logger and sensor of all columns; a channel that another logger has, too, is ``channel@logger``."""
        known: set[str] = set()
        for key, logger in self.loggers.items():
            for name, sensor in logger.channels.items():
                yield (f"{name}@{key}" if name in known else name), key, sensor
                known.add(name)


def read_channel_map(path: str | Path) -> ChannelMap:
    """Read a channel map from a YAML file.

    Raises:
      InputError: the file is missing or does not describe a channel map; the message names line and key.
    """
    return read_record(path, ChannelMap)
