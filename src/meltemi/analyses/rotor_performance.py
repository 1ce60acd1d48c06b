"""Steady rotor performance, for controllers and power-coefficient turbines."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from meltemi.core.shown import Brief

Float = NDArray[np.float64]


@dataclass(frozen=True, repr=False)
class RotorPerformance(Brief):
    """Coefficients of a rigid rotor in uniform wind, averaged over the azimuth.

    Attributes:
      tip_speed_ratio: (n,) tip-speed ratios.
      pitch: (m,) [rad] pitch angles.
      power, thrust, torque: (n, m) C_p, C_t, C_q, referred to the rotor radius without cone.
    """

    tip_speed_ratio: Float
    pitch: Float
    power: Float
    thrust: Float
    torque: Float
