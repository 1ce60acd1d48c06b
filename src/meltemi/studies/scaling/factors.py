"""Scaling factors between a scaled turbine and its reference.

Geometric similarity with equal materials and tip speed multiplies lengths and times by s and masses by s^3, and other
quantities according to their units: forces by s^2, moments by s^3, bending stiffness by s^4, frequencies by 1/s.
Stresses and wind speeds are unchanged. Another specific power, design tip-speed ratio or rotor speed deviates from
similarity by three further factors: of rated wind speed, chord and time.

References: Burton et al. (2011), Wind Energy Handbook, 2nd ed. (similarity); Manwell, McGowan and Rogers (2009), Wind
Energy Explained, 2nd ed., chapter 3 (the optimum rotor with wake rotation); docs/guide/scaling.md.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meltemi.turbine.definition import Turbine

Float = NDArray[np.float64]

AIR = 1.225
"""[kg/m^3] air density."""
USUAL_POWER_COEFFICIENT = 0.48
"""Power coefficient of a rotor at its best tip-speed ratio; only its cube root matters here."""


@dataclass(frozen=True)
class ScalingFactors:
    """Ratios of new to reference values.

    Attributes:
      length: factor of the rotor radius, and of all geometrically similar lengths.
      time: factor of the time of a revolution at rated speed.
      power: factor of rotor power at rated power, before losses.
      gear: factor of the gear ratio.
      tip_speed_ratio: [-] design tip-speed ratio of the reference (not a factor).
      slender: factor of the design tip-speed ratio.
    """

    length: float
    time: float
    power: float
    gear: float
    tip_speed_ratio: float
    slender: float

    @property
    def pressure(self) -> float:
        """Factor of the dynamic pressure at rated wind speed, at equal power coefficient: (P / s^2)^(2/3)."""
        return float((self.power / self.length**2) ** (2.0 / 3.0))

    @property
    def thrust(self) -> float:
        """Factor of the rotor thrust at rated wind speed."""
        return self.pressure * self.length**2

    @property
    def moment(self) -> float:
        """Factor of the blade root moment at rated wind speed."""
        return self.pressure * self.length**3

    @property
    def torque(self) -> float:
        """Factor of the rated rotor torque."""
        return self.power * self.time

    def chord(self, share: Float) -> Float:
        """Factor of the chord beyond geometric similarity, at relative radii, for an equal lift coefficient.

        The optimum rotor has the chord 8 pi r (1 - cos phi) / (B C_l).
        """
        old, new = self._inflow(share)
        return np.asarray((1.0 - np.cos(new)) / (1.0 - np.cos(old)))

    def twist(self, share: Float) -> Float:
        """Increment [rad] of the twist for an equal angle of attack."""
        old, new = self._inflow(share)
        return new - old

    def _inflow(self, share: Float) -> tuple[Float, Float]:
        """Inflow angle [rad] of the optimum rotor, 2/3 atan(1 / (lambda r/R)): reference and new."""
        ratio = self.tip_speed_ratio * np.maximum(share, 1e-6)
        return 2.0 / 3.0 * np.arctan(1.0 / ratio), 2.0 / 3.0 * np.arctan(1.0 / (self.slender * ratio))


def design_ratio(turbine: Turbine) -> float:
    """Tip-speed ratio of the optimal torque law at a power coefficient of 0.48."""
    slow_gain = turbine.control.torque.optimal_gain * turbine.drivetrain.gear_ratio**3
    power = 0.5 * AIR * math.pi * turbine.rotor_radius**5 * USUAL_POWER_COEFFICIENT
    return float((power * turbine.drivetrain.gearbox_efficiency / slow_gain) ** (1.0 / 3.0))


def multiply(content: dict[str, Any], names: str, factor: Any) -> None:
    """Multiply existing values of a record's content, numbers or lists, by factors."""
    for name in names.split():
        if content[name] is not None:
            product = np.asarray(content[name]) * factor
            content[name] = product if product.ndim else float(product)
