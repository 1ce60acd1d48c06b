"""Turbines described by a power coefficient instead of blades, and the models of that coefficient.

Such a turbine has a rotor with a coefficient C_p(tip-speed ratio, pitch), a shaft, pitch actuators, a yaw drive and a
controller; no blades, no tower, no loads. It supports the same winds, controllers and events as an aeroelastic turbine
and runs thousands of times faster than real time.

Reference: docs/theory/power-turbines.md; Palanimuthu et al. (2022), Energies 15(21):8161.
"""

from __future__ import annotations

import math
from functools import cached_property
from typing import TYPE_CHECKING, Annotated, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from meltemi.core.deferred import deferred
from meltemi.core.errors import InputError
from meltemi.core.record import Array, Record, Vector
from meltemi.turbine.checks import above_ground, ordered
from meltemi.turbine.definition import BaselineControl, Flap, PitchActuator, Turbine, YawDrive
from meltemi.turbine.representation import TurbineBase

if TYPE_CHECKING:
    from meltemi.turbine import ElectricalSystem
else:
    ElectricalSystem = deferred("meltemi.electrical.system", "ElectricalSystem")


class HeierCoefficient(Record):
    """Heier's exponential formula, scaled to a prescribed maximum (P-2).

    C_p = s (c1 (c2 x - c3 b - c4) exp(-c5 x) + c6 l),   x = 1/(l + 0.08 b) - 0.035/(b^3 + 1)

    with the pitch b in degrees, not below 0, and l the tip-speed ratio times that of the unscaled maximum over
    ``tip_speed_ratio``; s makes the maximum ``maximum``. The constants are those of the MathWorks Wind Turbine block.
    """

    kind: Literal["heier"] = "heier"
    tip_speed_ratio: float = Field(default=9.5085, ge=1.0, le=30.0)
    """Tip-speed ratio of the maximum at zero pitch [-; 4 to 14]."""
    maximum: float = Field(default=0.48, gt=0.0, le=16.0 / 27.0)
    """Maximum power coefficient [-; 0.3 to 0.5926], at most the Betz limit."""
    constants: tuple[float, float, float, float, float, float] = (0.5176, 116.0, 0.4, 5.0, 21.0, 0.0068)
    """Constants c1 to c6."""

    @cached_property
    def peak(self) -> tuple[float, float]:
        """Tip-speed ratio and coefficient of the maximum of the unscaled formula at zero pitch."""
        from scipy.optimize import brentq

        c1, c2, _, c4, c5, c6 = self.constants

        def slope(ratio: float) -> float:
            x = 1.0 / ratio - 0.035
            return c6 + c1 * (c5 * (c2 * x - c4) - c2) * math.exp(-c5 * x) / ratio**2

        best = float(brentq(slope, 4.0, 15.0, xtol=1e-14, rtol=1e-14))
        x = 1.0 / best - 0.035
        return best, c1 * (c2 * x - c4) * math.exp(-c5 * x) + c6 * best

    @model_validator(mode="after")
    def _check(self) -> Self:
        try:
            _, most = self.peak
        except ValueError:
            raise ValueError("constants: the formula has no maximum between tip-speed ratios of 4 and 15") from None
        if most <= 0.0:
            raise ValueError("constants: the formula's maximum is not above zero")
        return self


class CalibratedCoefficient(Record):
    """Heier's formula at zero pitch, calibrated to the gains of Figure 6 of Palanimuthu et al. (P-3).

    C_p = 0.979372 (116 x - 6.363840) exp(-37.744134 x) + 0.0375390 l,   x = 1/l - 0.035

    It is valid for tip-speed ratios from 7 to 11.5 and zero pitch only: a run that leaves this range ends with a
    status.
    """

    kind: Literal["calibrated"] = "calibrated"


class TableCoefficient(Record):
    """Tabulated coefficients with smooth interpolation (P-4).

    Below the first tip-speed ratio the power falls to zero with it. Beyond the other edges coefficients go on in
    straight lines, but not below the table's smallest.
    """

    kind: Literal["table"] = "table"
    tip_speed_ratio: Vector
    """(n,) above zero, increasing."""
    pitch: Vector
    """(m,) [rad; 0.05 to 1.6] increasing."""
    power: Array
    """(n, m) power coefficients."""
    thrust: Array | None = None
    """(n, m) thrust coefficients; without them the turbine has no thrust."""
    source: str = ""

    @model_validator(mode="after")
    def _check(self) -> Self:
        for name, values in (("tip_speed_ratio", self.tip_speed_ratio), ("pitch", self.pitch)):
            if len(values) < 3 or np.any(np.diff(values) <= 0.0):
                raise ValueError(f"{name} needs at least 3 entries that increase")
        if self.tip_speed_ratio[0] <= 0.0:
            raise ValueError(f"tip_speed_ratio must be above zero, but begins with {self.tip_speed_ratio[0]:g}")
        if np.abs(self.pitch).max() > 1.6:
            raise ValueError(
                f"pitch is in radians, but reaches {np.abs(self.pitch).max():g}; if these are degrees, multiply by "
                "pi/180 = 0.01745329"
            )
        shape = (len(self.tip_speed_ratio), len(self.pitch))
        for name in ("power", "thrust"):
            table = getattr(self, name)
            if table is not None and table.shape != shape:
                raise ValueError(
                    f"{name} must have a row for each of {shape[0]} tip-speed ratios with {shape[1]} pitch angles, "
                    f"shape {shape}, but has {table.shape}"
                )
        if not 0.0 < self.power.max() < 1.0:
            raise ValueError(f"power: its largest coefficient is {self.power.max():g}, not between 0 and 1")
        return self


Coefficient = Annotated[HeierCoefficient | CalibratedCoefficient | TableCoefficient, Field(discriminator="kind")]
"""Any power coefficient; ``kind`` selects the class."""


class Shaft(Record):
    """Rotor, shaft and generator. Rotor inertia, stiffness, damping and friction refer to the low-speed side."""

    gear_ratio: float = Field(default=1.0, gt=0.0)
    """Generator speed over rotor speed [-]; 1 for a direct drive."""
    rotor_inertia: float = Field(gt=0.0)
    """[kg m^2; 2e6 to 1e8 at 100 m] inertia of the rotor about the shaft."""
    generator_inertia: float = Field(default=0.0, ge=0.0)
    """[kg m^2] inertia of the generator about its shaft."""
    stiffness: float | None = Field(default=None, gt=0.0)
    """[N m/rad] torsional stiffness; without it the shaft is rigid."""
    damping: float = Field(default=0.0, ge=0.0)
    """[N m s/rad] torsional damping."""
    friction: float = Field(default=0.0, ge=0.0)
    """[N m s/rad; 0.1 to 1e5 at 100 m] viscous friction of the bearings."""
    generator_efficiency: float = Field(default=1.0, gt=0.0, le=1.0)
    """Electrical over mechanical power [-; 0.75 to 1]."""
    brake_torque: float = Field(default=0.0, ge=0.0)
    """[N m] torque of the fully applied brake on the generator's shaft."""
    source: str = ""

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.stiffness is not None and self.generator_inertia == 0.0:
            raise ValueError("a shaft with stiffness needs generator_inertia at its other end")
        return self

    @property
    def inertia(self) -> float:
        """Inertia [kg m^2] of rotor and generator, referred to the low-speed shaft."""
        return self.rotor_inertia + self.gear_ratio**2 * self.generator_inertia


class PowerTurbine(TurbineBase):
    """A horizontal-axis wind turbine described by a power coefficient."""

    n_blades: int = Field(default=3, ge=2, le=3)
    """Number of blades, each with a pitch actuator; the coefficient is the mean over their pitch angles."""
    rated_power: float = Field(gt=0.0)
    """[W; 5e5 to 8e6 at 100 m] electrical, for tables; the controller uses ``control.torque.rated_power``."""
    cut_in: float = Field(default=3.0, gt=0.0)
    """[m/s; 1.5 to 6] wind speed at hub height where power curves start; not used in simulations."""
    cut_out: float = Field(default=25.0, gt=0.0)
    """[m/s; 12 to 40] wind speed at hub height where power curves end; not used in simulations."""
    rotor_radius: float = Field(gt=0.0)
    """[m] rotor radius to which the coefficients refer."""
    hub_height: float = Field(gt=0.0)
    """[m; 50 to 300 at 100 m] hub height above ground."""
    coefficient: Coefficient
    """Power coefficient, and thrust coefficient if a table contains it."""
    power_yaw_exponent: float = Field(default=3.0, ge=0.0, le=5.0)
    """Exponent of the cosine of the yaw misalignment in the power [-; 1 to 4]."""
    thrust_yaw_exponent: float = Field(default=2.0, ge=0.0, le=5.0)
    """Exponent of the cosine of the yaw misalignment in the thrust [-; 1 to 4]."""
    drivetrain: Shaft
    pitch_actuator: PitchActuator
    yaw: YawDrive = YawDrive()
    electrical: ElectricalSystem | None = None
    """Generator, converters and grid, for ``options.electrical: averaged``; ``size_electrical`` sizes one."""
    control: BaselineControl

    @model_validator(mode="after")
    def _check(self) -> Self:
        ordered(self, "cut_in", "cut_out", "m/s")
        above_ground(self.hub_height, self.rotor_radius)
        if (friction := self.pitch_actuator.friction) is not None and friction.coefficient > 0.0:
            raise ValueError(
                "pitch_actuator.friction.coefficient: bearings are loaded by the blades' root moments, which a "
                "power-coefficient turbine has not; give friction.torque alone"
            )
        return self

    @property
    def flaps(self) -> tuple[Flap, ...]:
        """No flaps: the rotor has no blades."""
        return ()

    @property
    def rotor_diameter(self) -> float:
        """Rotor diameter [m]."""
        return 2.0 * self.rotor_radius


AnyTurbine = Turbine | PowerTurbine
"""Turbine of either kind, as runs, controllers and winds accept it."""


def aeroelastic(turbine: AnyTurbine, what: str) -> Turbine:
    """Check that a turbine has blades and a tower, as required for ``what``.

    Raises:
      InputError: the turbine is a power-coefficient turbine.
    """
    if isinstance(turbine, PowerTurbine):
        raise InputError(
            f"{what}: {turbine.name} is a power-coefficient turbine, without blades and tower; this needs an "
            "aeroelastic turbine, such as nrel5mw"
        )
    return turbine
