"""File of a validation: which turbine, which columns, what the sensors do not give."""

from __future__ import annotations

from typing import Any, Literal, Self

from pydantic import Field, model_validator

from meltemi.core.record import Record
from meltemi.validation.channel_map import ChannelMap
from meltemi.validation.conditions import SiteConditions
from meltemi.validation.selection import SelectionRules


class Validation(Record):
    """Comparison of a turbine's measured records with simulations."""

    case: str
    """Case file with turbine, controller and options, relative to this file; its wind and duration do not count."""
    channels: ChannelMap
    """Columns of the measured files."""
    compare: tuple[str, ...] = ()
    """Channels; by default all that are measured and simulated, without angles and wind."""
    range_only: tuple[str, ...] = ()
    """Gauges whose zero and gain are not known: standard deviation, equivalent loads and spectra are compared. Those in
    mV/V are among them."""
    idle: tuple[str, ...] = ()
    """Patterns of the files of one date with slow rotations at idle, by which gauges of blade roots are calibrated."""
    yaw_sweep: tuple[str, ...] = ()
    """Patterns of files with a yaw sweep, by which gauges of the tower base are calibrated."""
    accuracy: dict[str, float] = Field(default_factory=dict)
    """Relative standard uncertainty of a sensor by channel [-]."""
    conditions: dict[str, SiteConditions] = Field(default_factory=dict)
    """What sensors do not give, by patterns of file names; later ones take precedence."""
    turbulence: dict[str, Any] = Field(default_factory=dict)
    """Further settings of the turbulent wind: spectrum, points, dt."""
    seeds: int = Field(default=5, ge=1, le=1000)
    """Wind fields through the measured series of each record."""
    transient: float = Field(default=60.0, ge=0.0, le=3600.0)
    """[s] simulated before the record begins."""
    integration: Literal["implicit", "case"] = "implicit"
    """Time integration: ``implicit`` takes longer steps than most cases ask for; or that of the case."""
    selection: SelectionRules = SelectionRules()
    """Which records are used."""
    priors: dict[str, float] = Field(default_factory=dict)
    """Prior standard deviations of uncertain parameters, in place of :data:`meltemi.validation.fit.PRIORS`."""

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.channels.statistical and (self.idle or self.yaw_sweep):
            raise ValueError("idle, yaw_sweep: gauges are calibrated by series; ten-minute statistics have none")
        return self
