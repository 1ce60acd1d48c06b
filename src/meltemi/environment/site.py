"""Constants of the place: air and gravity."""

from __future__ import annotations

from pydantic import Field

from meltemi.core.record import Record


class Environment(Record):
    """Air and gravity at the site."""

    air_density: float = Field(default=1.225, gt=0.0, lt=3.0)
    """Density of the air [kg/m^3]; 1.225 is the ISO 2533 standard atmosphere at sea level."""
    gravity: float = Field(default=9.80665, ge=0.0, lt=30.0)
    """Gravitational acceleration [m/s^2]."""
