"""Rain, and the power loss of a rotor by the energy balance of Palanimuthu et al. (2022).

Reference: Palanimuthu et al. (2022), eqs (5) to (14). Drops that meet a body stop in the time in which they travel
their radius; the sum over all these drops is a pressure on the wetted area. The area is that of a flat ellipsoid,
the rotor disk with a thickness, that travels through slanting rain (Bailey 2002). The study of drops on blade elements
assesses the physical validity (docs: Air and rain).
"""

from __future__ import annotations

import math
from math import sqrt
from typing import ClassVar, Literal, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field, field_validator, model_validator

from meltemi.compiler import Table, kernel, number
from meltemi.core.errors import InputError, did_you_mean
from meltemi.core.record import Particular
from meltemi.environment import drops

Float = NDArray[np.float64]

RAIN_CLASSES = {
    "light": 2.5,
    "moderate": 8.0,
    "heavy": 16.0,
    "rainstorm": 32.0,
    "heavy_rainstorm_weak": 64.0,
    "heavy_rainstorm_moderate": 100.0,
    "heavy_rainstorm_strong": 200.0,
    "heavy_rainstorm_extreme": 709.2,
}
"""[mm/h] rain rates of the classes in the review's Table 2."""


class RainParameters(Table, title="rain"):
    """Rows of the parameters of :func:`rain_power_loss`."""

    drag_density: float = number(
        "kg/m^3", "rain density: pressure on the wetted area over the speed of drops squared; 0 without rain"
    )
    drop_speed: float = number("m/s", "speed of drops against the rotor; 0: the wind speed")
    radius: float = number("m", "rotor radius")
    half_thickness: float = number("m", "half the thickness of the ellipsoid that the rotor sweeps")
    tail_wind: float = number("m/s", "speed of drops along the wind")
    cross_wind: float = number("m/s", "speed of drops across the wind")
    fall_speed: float = number("m/s", "fall speed of drops")


class Rain(Particular):
    """Constant rain, by rate or class.

    An aeroelastic turbine uses the water content only; other keys are for the power loss formula and an error.
    """

    WHEN_GIVEN: ClassVar[tuple[str, ...]] = (
        "mode", "diameter", "fall_speed", "tail_wind", "cross_wind", "drop_speed", "half_thickness"
    )  # fmt: skip
    """Keys of the power loss formula only."""

    rate: float | None = Field(default=None, ge=0.0, le=2500.0)
    """[mm/h] rain rate."""
    kind: str | None = None
    """Class instead of a rate: `light` 2.5, `moderate` 8, `heavy` 16, `rainstorm` 32, `heavy_rainstorm_weak` 64,
    `heavy_rainstorm_moderate` 100, `heavy_rainstorm_strong` 200, `heavy_rainstorm_extreme` 709.2 mm/h."""
    mode: Literal["integrated", "seed"] = "integrated"
    """Integral over the drop size distribution, or all drops of one diameter (Palanimuthu et al. 2022)."""
    diameter: float = Field(default=3.0, gt=0.0, le=10.0)
    """[mm] diameter of the drops in mode `seed`."""
    fall_speed: float | None = Field(default=None, ge=0.0, le=20.0)
    """[m/s] fall speed of the drops; by default the terminal speed of the diameter, or of the mean one by mass."""
    tail_wind: float = Field(default=0.0, ge=-100.0, le=100.0)
    """[m/s] tail wind component of the drop velocity."""
    cross_wind: float = Field(default=0.0, ge=-100.0, le=100.0)
    """[m/s] cross wind component of the drop velocity."""
    drop_speed: float | None = Field(default=None, gt=0.0, le=200.0)
    """[m/s] speed at which drops meet the rotor; by default the wind speed."""
    half_thickness: float = Field(default=2.0, ge=0.0, le=100.0)
    """[m] half the thickness of the flat ellipsoid that represents the rotor."""
    water_density: float = Field(default=drops.WATER, gt=0.0, le=2000.0)
    """[kg/m^3] density of water."""

    @field_validator("kind")
    @classmethod
    def _known(cls, kind: str | None) -> str | None:
        if kind is not None and kind not in RAIN_CLASSES:
            raise ValueError(f"no class of rain {kind!r}; {did_you_mean(kind, RAIN_CLASSES)}")
        return kind

    @model_validator(mode="after")
    def _check(self) -> Self:
        if (self.rate is None) == (self.kind is None):
            raise ValueError(f"give either rate [mm/h] or kind ({', '.join(RAIN_CLASSES)})")
        return self

    @property
    def of_the_formula(self) -> tuple[str, ...]:
        """Given keys that only the formula of Palanimuthu et al. uses."""
        return tuple(name for name in self.WHEN_GIVEN if name in self.model_fields_set)

    @property
    def intensity(self) -> float:
        """Rain rate [m/s]."""
        rate = self.rate if self.kind is None else RAIN_CLASSES[self.kind]
        return (rate or 0.0) * drops.MM_PER_HOUR

    @property
    def falling(self) -> float:
        """Fall speed [m/s] of the drops."""
        if self.fall_speed is not None:
            return self.fall_speed
        return float(drops.terminal_speed(self.diameter * 1e-3 if self.mode == "seed" else self._mean_diameter))

    @property
    def _mean_diameter(self) -> float:
        return float(drops.mean_diameter(self.intensity))

    @property
    def drag_density(self) -> float:
        """[kg/m^3] pressure on the wetted area over the speed of drops squared (eqs 6 to 11).

        Mode seed: 2/9 pi sigma N d^3 with the number N of all drops and one diameter d. With drops of 3 mm that counts
        the water of the rain 124 (light), 64 (moderate), 43 (heavy), 29 (32 mm/h) or 5.2 times (709 mm/h). Mode
        integrated: the integral of n(d) d^3 in place of N d^3, so 4/3 of the water content.
        """
        if self.mode == "integrated":
            return 4.0 / 3.0 * float(drops.water_content(self.intensity, self.water_density))
        count = float(drops.drop_count(self.intensity))
        return 2.0 / 9.0 * math.pi * self.water_density * count * (self.diameter * 1e-3) ** 3


def rain_parameters(rain: Rain | None, rotor_radius: float) -> RainParameters:
    """Parameters of :func:`rain_power_loss` for a rotor [m]; all zero without rain."""
    p = RainParameters(RainParameters.zeros())
    if rain is not None:
        p.drag_density, p.drop_speed = rain.drag_density, rain.drop_speed or 0.0
        p.radius, p.half_thickness = rotor_radius, rain.half_thickness
        p.tail_wind, p.cross_wind, p.fall_speed = rain.tail_wind, rain.cross_wind, rain.falling
    return p


@kernel
def rain_power_loss(rain: RainParameters, wind_speed: float) -> float:
    """Power loss [W] of a rotor due to rain (second term of eq. 14).

    Pressure times wetted area (eq. 12) times wind speed; the speed in the area's denominator cancels, so it is finite
    in a calm. It can exceed the aerodynamic power: the caller has to limit the remaining power to zero.
    """
    radius, half = rain.radius, rain.half_thickness
    speed = rain.drop_speed if rain.drop_speed > 0.0 else wind_speed
    along, across, down = radius * (rain.tail_wind - wind_speed), half * rain.cross_wind, half * rain.fall_speed
    return rain.drag_density * speed * speed * math.pi * radius * sqrt(along * along + across * across + down * down)


def wetness(
    speed: ArrayLike, radius: float, half_thickness: float, *, tail: float = 0.0, cross: float = 0.0, fall: float = 0.0
) -> Float:
    """Wetted area [m^2] of a flat ellipsoid: volume of rain swept per distance travelled (eq. 12).

    Args:
      speed: [m/s] speed of the ellipsoid along its axis; positive.
      radius: [m] radius.
      half_thickness: [m] half thickness along the axis.
      tail: [m/s] drop velocity in the direction of travel.
      cross: [m/s] drop velocity across it.
      fall: [m/s] fall speed.

    Raises:
      InputError: a speed or the radius is not positive, or the thickness negative.
    """
    s = np.asarray(speed, float)
    if not np.all(s > 0.0):
        raise InputError(f"wetness: speed must be positive, found {s[~(s > 0.0)].flat[0]:g} m/s")
    if not radius > 0.0:
        raise InputError(f"wetness: radius must be positive, found {radius:g} m")
    if not half_thickness >= 0.0:
        raise InputError(f"wetness: half_thickness must not be negative, found {half_thickness:g} m")
    squares = (radius * (tail - s)) ** 2 + half_thickness**2 * (cross**2 + fall**2)
    return np.asarray(np.pi * radius / s * np.sqrt(squares))


def driest_speed(radius: float, half_thickness: float, tail: float, cross: float, fall: float) -> float:
    """Speed [m/s] at which :func:`wetness` is minimal (eq. 13); infinite without tail wind."""
    if tail <= 0.0:
        return math.inf
    return tail + half_thickness**2 * (cross**2 + fall**2) / (radius**2 * tail)
