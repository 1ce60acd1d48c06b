"""What several unit tests share."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from meltemi.aero.stall_tables import hansen
from meltemi.aero.tables import AeroParameters, PolarPoint, SectionConstants
from meltemi.compiler import View
from meltemi.turbine.definition import Turbine

Float = NDArray[np.float64]
GRID = np.linspace(-np.pi, np.pi, 1441)
"""A quarter of a degree, as models use it."""


@pytest.fixture(scope="session")
def polar_of() -> Callable[..., tuple[Float, Float]]:
    """Polar and section constants, as kernels take them, from coefficients on the grid."""

    def make(lift: Float, drag: Float, moment: Float | None = None) -> tuple[Float, Float]:
        polar, section = np.zeros((1, len(GRID), len(PolarPoint))), np.zeros((1, len(SectionConstants)))
        table = hansen(GRID, lift, drag)
        columns = {
            "lift": lift,
            "drag": drag,
            "moment": np.zeros_like(GRID) if moment is None else moment,
            "attachment": table.attachment,
            "attached_lift": table.attached_lift,
            "separated_lift": table.separated_lift,
        }
        for name, values in columns.items():
            polar[0, :, PolarPoint.index(name)] = values
        constants = {"slope": table.slope, "zero_lift": table.zero_lift, "drag_floor": table.drag_floor, "dynamic": 1.0}
        for name, value in constants.items():
            section[0, SectionConstants.index(name)] = value
        return polar, section

    return make


@pytest.fixture(scope="session")
def polars(turbine: Turbine, polar_of: Callable[..., tuple[Float, Float]]) -> tuple[Float, Float]:
    """Polars (airfoils, rows, columns) and sections of the reference turbine's six airfoils."""
    found = []
    for airfoil in turbine.airfoils.values():
        if airfoil.dynamic_stall:
            a = airfoil.angle_of_attack
            found.append(polar_of(*(np.interp(GRID, a, c) for c in (airfoil.lift, airfoil.drag, airfoil.moment))))
    assert len(found) == 6
    return np.concatenate([p for p, _ in found]), np.concatenate([s for _, s in found])


@pytest.fixture
def aero() -> Float:
    """Parameters of the aerodynamics with the constants of the stall model's authors."""
    array = AeroParameters.zeros()
    view = View(AeroParameters, array)
    view["stall_a1"], view["stall_a2"], view["stall_b1"], view["stall_b2"] = 0.165, 0.335, 0.0455, 0.3
    view["stall_pressure"], view["stall_separation"] = 1.5, 6.0
    return array
