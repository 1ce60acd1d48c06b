"""Record of differences between the blades of a rotor. Reference: docs/guide/turbine-file.md."""

from __future__ import annotations

from typing import Any, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import model_validator

from meltemi.core.record import Record


class Imbalance(Record):
    """Deviations of single blades from the description, blade 1 first; blades that are not listed have none."""

    pitch: tuple[float, ...] = ()
    """[rad] pitch angle of each blade minus that of its encoder, which the controller measures."""
    mass: tuple[float, ...] = ()
    """Mass of each blade over that of the description, minus 1, evenly along the span."""

    @model_validator(mode="after")
    def _check(self) -> Self:
        if any(not abs(x) <= np.pi for x in self.pitch):
            raise ValueError(f"pitch {list(self.pitch)} must be between -pi and pi; they are in rad")
        if any(not -0.5 <= x <= 0.5 for x in self.mass):
            raise ValueError(f"mass {list(self.mass)} must be between -0.5 and 0.5 (0.005 is 0.5 %)")
        return self


def deviations(turbine: Any, name: str) -> NDArray[np.float64]:
    """(n_blades,) deviations ``pitch`` [rad] or ``mass`` [-] of the blades of a turbine.

    Raises:
      ValueError: more blades are listed than the rotor has.
    """
    imbalance: Imbalance | None = getattr(turbine, "imbalance", None)
    given, values = () if imbalance is None else getattr(imbalance, name), np.zeros(turbine.n_blades)
    if len(given) > len(values):
        raise ValueError(f"imbalance.{name} lists {len(given)} blades; the rotor has {len(values)}")
    values[: len(given)] = given
    return values
