"""Arrays of a vortex wake.

Zones follow each other with age. In the first each element of a blade has a panel for each step of the wake. In the
second a blade has four vortices, in the third two, with longer panels. A panel is a ring of vortices of one
circulation, positive from root to tip on its younger side, as the bound vortex. Age 0 is the row that left the blade
last.
"""

from __future__ import annotations

from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from meltemi.compiler import Array2, Constant, Numbers, Single, Table, Vectors, number, xyz
from meltemi.simulation.induction import InductionSystem

Columns32 = Annotated[NDArray[np.float32], 2, "constant"]
Column32 = Annotated[NDArray[np.float32], 1, "constant"]
Column = Annotated[NDArray[np.float64], 1, "constant"]


class VortexParameters(Table, title="vortex wake"):
    """Settings of the wake, and sizes of its zones."""

    azimuth_step: float = number("rad", "azimuth between the rows of the wake")
    radius: float = number("m", "radius of the rotor")
    panels_1: float = number("-", "panels of the first zone, at least")
    panels_2: float = number("-", "panels of the second zone, at least")
    panels_3: float = number("-", "panels of the third zone")
    merge_2: float = number("-", "panels of the first zone in one of the second")
    merge_3: float = number("-", "panels of the second zone in one of the third")
    shed: float = number("-", "first age whose shed vorticity counts")
    core: float = number("-", "number of the velocity within cores")
    blade_core: float = number("-", "core radius over width of an element, for velocities at the blades")
    wake_core: float = number("-", "core radius over width of an element, for velocities in the wake")
    growth: float = number("m^2/s", "growth of the square of the core radius")
    ground: float = number("-", "1: the wake is mirrored at the ground")
    mean_wind: float = number("-", "1: the mean wind over the rotor moves the wake")
    free: float = number("-", "1: velocities at each vortex; 0: by age and edge, averaged over the blades")


class VortexState(Table, title="vortex wake"):
    """State of the wake but for its vortices."""

    time: float = number("s", "time of the last evaluation")
    begin: float = number("s", "time of the last step of the wake")
    step: float = number("s", "length of the present step of the wake")
    rows_1: float = number("-", "rows of the first zone")
    rows_2: float = number("-", "rows of the second zone")
    rows_3: float = number("-", "rows of the third zone")
    turn: float = number("-", "number of the last step of the wake")
    fault: float = number("-", "blade, from 1, of a vortex without a valid position; 0 if there is none")
    fault_age: float = number("s", "age of that vortex")


class WakeZone(Table, axes="blade age edge", title="wake"):
    """Vortices of one zone of the wake."""

    position: Vectors = xyz("m", "point on the vortex, inertial axes")
    velocity: Vectors = xyz("m/s", "velocity over the last step, inertial axes")
    circulation: Numbers = number("m^2/s", "circulation of the panel to the next age and the next edge")
    width2: Numbers = number("m^2", "square of the width that its core radius refers to")


class WakeDrift(Table, axes="age edge", title="wake drift"):
    """Induced velocity of the vortices of one zone, averaged over the blades."""

    axial: Numbers = number("m/s", "along the shaft, downwind")
    radial: Numbers = number("m/s", "away from the axis of the wake")
    tangential: Numbers = number("m/s", "in the sense of the rotor")


class BoundFlow(Table, axes="blade element", title="bound vortex"):
    """Bound vortices, and the velocity there of all vortices but those that follow the present circulation."""

    circulation: Numbers = number("m^2/s", "bound circulation, positive towards the tip")
    before: Vectors = xyz("m/s", "at the begin of the step of the wake, axes of the blade without pitch")
    after: Vectors = xyz("m/s", "at its end")
    defect: Numbers = number("m^2/s", "change of the circulation in the last evaluation")


class BoundInfluence(Table, axes="blade element source", title="bound influence"):
    """Velocity at an element by unit circulation of another one of its blade and of its panel behind it."""

    before: Vectors = xyz("1/m", "at the begin of the step of the wake, axes of the blade without pitch")
    after: Vectors = xyz("1/m", "at its end")
    factor: Numbers = number("-", "factors of the matrix of Newton's method")


class VortexSystem(InductionSystem):
    """A turbine with a vortex wake.

    Attributes:
      wake_sources, wake_sources32: work arrays, filaments as ``filaments.store`` writes them.
      wake_point, wake_point32: work arrays, a point.
    """

    vortex: Constant[VortexParameters]
    vortex_state: VortexState
    wake_1: Constant[WakeZone]
    wake_2: Constant[WakeZone]
    wake_3: Constant[WakeZone]
    drift_1: Constant[WakeDrift]
    drift_2: Constant[WakeDrift]
    drift_3: Constant[WakeDrift]
    bound: BoundFlow
    bound_influence: Constant[Single[BoundInfluence]]
    wake_sources: Constant[Array2]
    wake_sources32: Columns32
    wake_point: Column
    wake_point32: Column32
