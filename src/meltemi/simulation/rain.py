"""Rain in the polars of a model: additional drag of the drops that blades accelerate.

Per unit length of the span a blade element meets the mass flow L W h of water, with the water content L of the air, the
relative speed W and the height h of the section normal to it, and accelerates it to the speed of the section: a force
L W^2 h along the flow. Over 1/2 rho W^2 c this is a drag coefficient 2 (L / rho) (h / c), independent of the motion.
The section is taken as an ellipse.

Reference: docs/guide/air-and-rain.md (R-11).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from meltemi.aero.tables import PolarPoint, SectionConstants
from meltemi.core.errors import InputError
from meltemi.environment.drops import water_content
from meltemi.environment.rain import Rain
from meltemi.environment.site import Environment
from meltemi.turbine.definition import Turbine
from meltemi.turbine.thickness import relative_thickness

Float = NDArray[np.float64]

DRAG = PolarPoint.index("drag")
DRAG_FLOOR, ZERO_LIFT = (SectionConstants.index(name) for name in "drag_floor zero_lift".split())


def drag_of_drops(water_over_air: float, thickness: float, angle_of_attack: Float) -> Float:
    """Drag coefficient of the drops that a section accelerates (R-11).

    Args:
      water_over_air: water content of the air over air density.
      thickness: section thickness over chord.
      angle_of_attack: [rad].
    """
    return np.asarray(2.0 * water_over_air * np.hypot(np.sin(angle_of_attack), thickness * np.cos(angle_of_attack)))


def wet_polars(
    turbine: Turbine,
    environment: Environment,
    rain: Rain,
    position: Float,
    polars: Float,
    section: Float,
    index: NDArray[np.int64],
) -> tuple[Float, Float, NDArray[np.int64]]:
    """Polars of blades in rain.

    Args:
      position: (n,) [m] positions of the nodes.
      polars: (g, rows, columns) on the grid over the full circle; section: (g, constants); index: (blades, n).

    Raises:
      InputError: the thickness of an airfoil is not known, or the rain has keys that blades do not use.
    """
    if rain.of_the_formula:
        raise InputError(
            f"environment.rain.{', '.join(rain.of_the_formula)}: no effect on {turbine.name}, whose blades use "
            "rate or kind, and water_density; the other keys are for power-coefficient turbines"
        )
    content = float(water_content(rain.intensity, rain.water_density, 0.0, np.inf))
    thickness = np.interp(position, turbine.blade.aerodynamics.position, relative_thickness(turbine))
    polars, section, grid = polars.copy(), section.copy(), np.linspace(-np.pi, np.pi, polars.shape[1])
    done = set()
    for nodes in index:
        for g, t in zip(nodes, thickness, strict=True):
            if g not in done:
                more = drag_of_drops(content / environment.density, float(t), grid)
                polars[g, :, DRAG] += more
                section[g, DRAG_FLOOR] += np.interp(section[g, ZERO_LIFT], grid, more)
                done.add(g)
    return polars, section, index
