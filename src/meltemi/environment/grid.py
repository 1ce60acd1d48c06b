"""Electrical grid at the turbine's terminals, with operator references."""

from __future__ import annotations

from typing import Self

from pydantic import model_validator

from meltemi.core.record import Record
from meltemi.core.series import Varying, values

NOMINAL_FREQUENCY = 50.0
"""[Hz] frequency of the grid of a turbine without an electrical system."""


class PowerGrid(Record):
    """Voltage, frequency and operator references, each constant or time-varying."""

    voltage: Varying = 1.0
    """Voltage at the terminals, per unit of the nominal one; below 1 in a dip."""
    frequency: Varying | None = None
    """[Hz]; by default the nominal one of the turbine's electrical system, otherwise 50 Hz."""
    power_reference: Varying | None = None
    """[W] active power reference of the operator; by default rated power."""
    reactive_power: Varying = 0.0
    """[var] reactive power reference of the operator, positive into the grid; added to the controller's demand."""

    @model_validator(mode="after")
    def _check(self) -> Self:
        for name, low, high in (("voltage", 0.0, 1.5), ("frequency", 10.0, 100.0)):
            given = getattr(self, name)
            for worst in () if given is None else (values(given).min(), values(given).max()):
                if not low <= worst <= high:
                    raise ValueError(f"{name} {worst:g} is not between {low:g} and {high:g}")
        if self.power_reference is not None and values(self.power_reference).min() < 0.0:
            raise ValueError(f"power_reference {values(self.power_reference).min():g} W is negative")
        return self
