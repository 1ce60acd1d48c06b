"""Site conditions: air, rain and gravity."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar, Self

from pydantic import Field, model_validator

from meltemi.core.deferred import deferred
from meltemi.core.record import Particular

if TYPE_CHECKING:
    from meltemi.environment.air import Air
    from meltemi.environment.rain import Rain
else:
    Air = deferred("meltemi.environment.air", "Air")
    Rain = deferred("meltemi.environment.rain", "Rain")

STANDARD = 1.225
"""[kg/m^3] air density of the ISO 2533 standard atmosphere at sea level."""


class Environment(Particular):
    """Air, rain and gravity at the site."""

    WHEN_GIVEN: ClassVar[tuple[str, ...]] = ("air_density",)
    air_density: float = Field(default=STANDARD, gt=0.0, lt=3.0)
    """Density of the air [kg/m^3; 0.7 to 1.6]; 1.225 is the ISO 2533 standard atmosphere at sea level."""
    air: Air | None = None
    """Weather, from which the density follows; instead of ``air_density``."""
    rain: Rain | None = None
    """Adds drag of drops to blades, or the loss formula of a power-coefficient turbine."""
    gravity: float = Field(default=9.80665, ge=0.0, lt=30.0)
    """Gravitational acceleration [m/s^2; 9.7 to 9.9]."""

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.air is not None and "air_density" in self.model_fields_set:
            raise ValueError("give either air_density or air (temperature, humidity, altitude, pressure), not both")
        return self

    @property
    def density(self) -> float:
        """Air density [kg/m^3] at the start of a run."""
        return self.air_density if self.air is None else float(self.air.at([0.0])[-1][0])
