"""Description of turbulent wind; its field is generated when a simulation or a file needs it."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from meltemi.core.record import Record, Vector
from meltemi.core.shown import Viewed
from meltemi.wind.fields import SteadyWind, Wind, WindBox

if TYPE_CHECKING:
    from meltemi.turbine.power_turbine import AnyTurbine


class HubSeries(Record):
    """Measured hub-height wind that constrains a turbulent field."""

    time: Vector
    """(T,) [s] increasing; time 0 is the start of the simulation."""
    u: Vector
    """(T,) [m/s] along the mean wind, including the mean."""
    v: Vector | None = None
    """(T,) [m/s] to the left looking downwind; unconstrained by default."""
    w: Vector | None = None
    """(T,) [m/s] upwards; unconstrained by default."""

    @model_validator(mode="after")
    def _check(self) -> Self:
        n = len(self.time)
        if n < 2:
            raise ValueError("time needs at least 2 entries")
        if np.any(np.diff(self.time) <= 0.0):
            i = int(np.flatnonzero(np.diff(self.time) <= 0.0)[0])
            raise ValueError(f"time must increase, but entry {i + 2} ({self.time[i + 1]:g} s) does not")
        for name in ("u", "v", "w"):
            values = getattr(self, name)
            if values is not None and len(values) != n:
                raise ValueError(f"{name} must have {n} entries like time, found {len(values)}")
        return self


class TurbulentWind(Record, Viewed):
    """A mean wind with shear, and turbulence of a given spectrum, coherence and intensity."""

    speed: float = Field(gt=0.0, le=100.0)
    """[m/s; 1 to 80] mean wind speed at hub height."""
    intensity: float = Field(ge=0.0, lt=2.0)
    """Standard deviation of the longitudinal component over the mean speed at the hub [-; 0.01 to 1]; 0.14 is 14 %."""
    seed: int = Field(default=1, ge=0, lt=2**63)
    """The same seed gives the same field."""
    spectrum: Literal["kaimal", "vonkarman", "mann"] = "kaimal"
    edition: Literal[2, 3, 4] = 3
    """Edition of IEC 61400-1 for length scales, coherence and constants."""
    length_factor: float = Field(default=1.0, gt=0.0, le=10.0)
    """Length scales of spectrum and coherence over those of the edition [-; 0.2 to 5]."""
    coherent: Literal["u", "all"] = "u"
    """Components that are coherent across the rotor: u only, as in the standard, or v and w like u. The coherence of
    Mann's turbulence follows from its tensor."""
    shear_exponent: float = Field(default=0.2, gt=-1.0, lt=1.0)
    """Exponent of the power law of the mean wind [-]."""
    roughness: float = Field(default=0.0, ge=0.0, lt=10.0)
    """[m; 1e-5 to 3] length of the logarithmic profile, used instead of the power law when above zero."""
    direction: float = Field(default=0.0, ge=-7.0, le=7.0)
    """[rad] clockwise seen from above."""
    veer: float = Field(default=0.0, gt=-0.1, lt=0.1)
    """[rad/m; 1e-5 to 0.02] change of the mean direction with height."""
    upflow: float = Field(default=0.0, gt=-1.0, lt=1.0)
    """[rad] inclination of the mean wind, upwards when positive."""
    scaled: bool = True
    """Scale the standard deviation at the hub to the target exactly; otherwise it scatters as for any sample of
    this length."""
    periodic: bool = False
    """The field has the length of the run and repeats; otherwise it is longer, to cover the rotor at begin and end."""
    points: int = Field(default=25, ge=3, le=201)
    """Grid points across the rotor's grid; an odd number has one at the hub."""
    dt: float = Field(default=0.1, gt=0.0, le=10.0)
    """[s; 0.01 to 2] time between planes."""
    hub_series: HubSeries | None = None
    """Measured hub-height wind that constrains the field."""

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.hub_series is not None and self.intensity == 0.0:
            raise ValueError("intensity must be above 0 for a field through a measured series")
        return self

    @property
    def label(self) -> str:
        """Short description, for titles and metadata."""
        name = {"kaimal": "Kaimal", "vonkarman": "von Karman", "mann": "Mann"}[self.spectrum]
        parts = [f"{name} turbulence {self.speed:g} m/s", f"intensity {100.0 * self.intensity:.3g} %"]
        parts.append(f"roughness {self.roughness:g} m" if self.roughness else f"shear exponent {self.shear_exponent:g}")
        if self.upflow:
            parts.append(f"upflow {np.degrees(self.upflow):g} deg")
        if self.length_factor != 1.0:
            parts.append(f"lengths times {self.length_factor:g}")
        if self.hub_series is not None:
            parts.append("through a measured series")
        return ", ".join([*parts, f"seed {self.seed}"])


SYNTHESIS = "meltemi.turbulence.field"
"""Module that generates fields of turbulent winds; it is imported for the first of them."""
AnyWind = Wind | TurbulentWind
"""Winds of a run."""


def realised(wind: float | AnyWind, turbine: AnyTurbine, duration: float) -> Wind:
    """The wind for a simulation: a speed [m/s] becomes a steady wind, a turbulent wind becomes a field."""
    if isinstance(wind, int | float):
        return SteadyWind(speed=wind)
    if not isinstance(wind, TurbulentWind):
        return wind
    field: WindBox = import_module(SYNTHESIS).generate_field(wind, turbine, duration)
    return field
