"""The electrical system over a time step of the turbine, in sub-steps of its own.

Reference: docs/theory/electrical.md.
"""

from __future__ import annotations

from numpy import float64
from numpy.typing import NDArray

from meltemi.core.kernel import kernel

Float = NDArray[float64]


@kernel
def electric_begin(
    p: Float, torque: float, reactive: float, speed: float, voltage: float, frequency: float, electric: Float, dt: float
) -> None:
    """Steady operation; the arguments are those of :func:`electric_advance`."""


@kernel
def electric_advance(
    p: Float, torque: float, reactive: float, speed: float, voltage: float, frequency: float, electric: Float, dt: float
) -> None:
    """March the electrical system by ``dt``, everything else held.

    Afterwards ``electric[TORQUE]`` is the mean torque on the shaft and ``electric[GRID_POWER]`` the mean power into
    the grid.

    Args:
      p: (rows,) parameters, table ELECTRICAL.
      torque: [N m] demanded, on the generator's shaft.
      reactive: [var] demanded, delivered to the grid.
      speed: [rad/s] of the generator's shaft.
      voltage: of the grid, share of the nominal one.
      frequency: [Hz] of the grid.
      electric: (rows,) states and what is recorded, table ELECTRIC.
      dt: [s].
    """
