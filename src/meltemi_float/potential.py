"""Potential-flow coefficients of a platform.

Reference: docs/theory/floating.md (W-1, W-2).
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Float = NDArray[np.float64]
Complex = NDArray[np.complex128]
NONE, NO_FORCE = np.zeros(0), np.zeros((0, 0, 0, 6), dtype=np.complex128)


@dataclass(frozen=True)
class Coefficients:
    """Coefficients over water density, and gravity where they have it, about a point at still water.

    Attributes:
      frequency: (F,) [rad/s] increasing.
      added_mass: (F, 6, 6) [m^3 .. m^5] added mass over density.
      damping: (F, 6, 6) [m^3/s ..] radiation damping over density.
      infinite: (6, 6) added mass over density at infinite frequency.
      heading: (H,) [deg] of the waves' travel, counter-clockwise from x, increasing.
      excitation: (F, H, 6) force per wave amplitude over density and gravity, e^{+i w t}.
      hydrostatic: (6, 6) stiffness over density and gravity, without weight.
      drift_frequency: (D,) [rad/s]; drift: (N, D, D, 6) difference-frequency force per amplitude squared over density
        and gravity at increasing headings ``drift_heading`` (N,) [deg]; none if D and N are 0.
      sums_frequency, sums, sums_heading: the same at sum frequencies.
    """

    frequency: Float
    added_mass: Float
    damping: Float
    infinite: Float
    heading: Float
    excitation: Complex
    hydrostatic: Float
    drift_frequency: Float = field(default_factory=lambda: NONE)
    drift: Complex = field(default_factory=lambda: NO_FORCE)
    drift_heading: Float = field(default_factory=lambda: NONE)
    sums_frequency: Float = field(default_factory=lambda: NONE)
    sums: Complex = field(default_factory=lambda: NO_FORCE)
    sums_heading: Float = field(default_factory=lambda: NONE)
