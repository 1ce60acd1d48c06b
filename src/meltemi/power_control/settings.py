"""Settings of the power control."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import BeforeValidator, Field, model_validator

from meltemi.core.record import Record
from meltemi.environment.air import SEA_LEVEL_PRESSURE
from meltemi.environment.site import STANDARD

SCHEMES = {"A0": "optimal_speed", "A1": "rated_speed", "A2": "hold", "A3": "wide_hold"}
"""Names of the review of Palanimuthu et al. (2022) and ours."""

Scheme = Annotated[
    Literal["optimal_speed", "rated_speed", "hold", "wide_hold"],
    BeforeValidator(lambda name: SCHEMES.get(name, name) if isinstance(name, str) else name),
]
"""Scheme of pitch and speed while power is limited; A0 to A3 are aliases."""


class Droop(Record):
    """Power that follows the grid's frequency (C-87, C-88)."""

    droop: float = Field(default=0.05, gt=0.0, le=1.0)
    """Change of frequency, share of the nominal, for which the power changes by all of the rated one."""
    dead_band: float = Field(default=0.02, ge=0.0, lt=5.0)
    """[Hz] dead band to either side of the nominal frequency."""
    nominal: float | None = Field(default=None, gt=10.0, lt=100.0)
    """[Hz] frequency; by default that of the turbine's electrical system, 50 Hz where it has none."""
    reserve: float = Field(default=0.0, ge=0.0, lt=1.0)
    """Share of the available power that is kept in reserve, so that power can also increase."""
    inertia: float = Field(default=0.0, ge=0.0, le=30.0)
    """[s] synthetic inertia constant H: power against the rate of frequency as a synchronous machine; 0: none."""
    inertia_time: float = Field(default=0.2, gt=0.0, le=10.0)
    """[s] time constant of the filter of that rate."""
    available_time: float = Field(default=5.0, gt=0.0, le=600.0)
    """[s] time constant of the filter of the available power."""


class PowerControl(Record):
    """Settings of the power control; missing settings follow from the turbine."""

    torque: Literal["optimal", "tip_speed_ratio"] = "optimal"
    """Torque law below the power reference: proportional to the squared speed, or by an estimate of the wind."""
    density: Literal["fixed", "temperature", "weather"] = "fixed"
    """The air that the law assumes: ``air_density``; dry air of the measured temperature at ``air_pressure``; that of
    measured temperature, humidity and pressure."""
    air_density: float = Field(default=STANDARD, gt=0.2, lt=3.0)
    """[kg/m^3] air density for ``density: fixed``."""
    air_pressure: float = Field(default=SEA_LEVEL_PRESSURE, gt=3e4, lt=1.2e5)
    """[Pa] air pressure for ``density: temperature``."""
    scheme: Scheme = "hold"
    """While power is limited: ``optimal_speed`` (A0) pitches from the speed on at which the reference is met,
    ``rated_speed`` (A1) from rated speed on, ``hold`` (A2) holds the pitch between the two, ``wide_hold`` (A3) down to
    the lowest speed that can give the power at the present pitch."""
    recovery_speed: float | None = Field(default=None, gt=0.0)
    """[rad/s] rotor speed above the lower speed at which A2 and A3 begin to lower the pitch; 2 % of rated speed by
    default."""
    upper_speed: float | None = Field(default=None, gt=0.0)
    """[rad/s] rotor speed that the pitch of A1 to A3 holds while power is limited; rated speed by default. A lower
    speed costs pitch travel, and reduces the loads of fast rotation."""
    reference_rate: float | None = Field(default=None, gt=0.0)
    """[W/s] rate of the power set-point; a tenth of rated power per second by default."""
    droop: Droop | None = None
    """Frequency control; none by default."""
    frequency: float | None = Field(default=None, gt=0.0)
    """[rad/s] frequency of the speed loop through the pitch; by default that of the turbine's law at rated power."""
    damping_ratio: float = Field(default=0.7, gt=0.0, le=5.0)
    """Damping ratio of the speed loop, and of the loop of the tip-speed ratio."""
    anticipation: float = Field(default=0.0, ge=0.0, le=60.0)
    """[s] time over which the pitch loop extrapolates the speed, so that A1 to A3 begin to pitch before the rotor
    reaches rated speed."""
    tracking_frequency: float | None = Field(default=None, gt=0.0)
    """[rad/s] frequency of the loop of the tip-speed ratio through the torque; by default the rate at which the optimal
    torque comes back to its tip-speed ratio at rated speed, but at most ``frequency``."""
    estimator_frequency: float | None = Field(default=None, gt=0.0)
    """[rad/s] frequency of the wind estimate; ``frequency`` by default."""
    inertia: float | None = Field(default=None, gt=0.0)
    """[kg m^2] inertia of rotor and generator about the shaft; that of the turbine by default."""

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.density != "fixed" and self.air_density != STANDARD:
            raise ValueError(f"air_density is given, but density is {self.density!r}: write density: fixed")
        if self.density != "temperature" and self.air_pressure != SEA_LEVEL_PRESSURE:
            raise ValueError(f"air_pressure is given, but density is {self.density!r}: write density: temperature")
        return self
