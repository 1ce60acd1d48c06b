"""The NREL 5 MW of the OpenFAST reference runs, and the model options for the comparison.

The library's turbine is that of the report (NREL/TP-500-38060). The deck of the reference runs differs in a
few places, applied here one by one:

* blade mass: AdjBlMs 1.04536 instead of the factor that gives the report's 17,740 kg; and ElastoDyn's
  seventeen lumps have other moments, which a quadratic factor along the blade reproduces;
* zero-lift angles and drag floors as stated in the airfoil files, for OpenFAST's fit of the dynamic stall;
* mode shapes of blades and tower are the deck's polynomials (the fore-aft one makes the tower 3 % stiffer
  than its section data, see docs/verification);
* the tower of its AeroDyn file reaches the top diameter 2.3 m below the top, and is up to 1.4 % thinner;
* pitch actuators: none.

Options: blades without torsion (ElastoDyn has none), yaw locked, no drag on the tower, nodes of the
deck's AeroDyn file with the trapezoidal rule. Set A: quasi-steady wake and static polars; set B:
dynamic inflow and the Hansen-Gaunaa-Madsen model with Beddoes' constants; set P, for parked rotors: no
induction and static polars; set PU: no induction and the dynamic stall of set B.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from meltemi.simulation.options import BEDDOES, ModelOptions
from meltemi.turbine.definition import Turbine

ELASTODYN_MOMENTS = (17536.61413935, 362132.65281825, 11752352.26467880)
"""Blade mass [kg], first moment [kg m] and second moment [kg m^2] about the root in ElastoDyn's summary."""
AIRFOIL_CONSTANTS = {
    "du40": (-3.2, 0.03),
    "du35": (-1.2, 0.012),
    "du30": (-2.2, 0.008),
    "du25": (-3.2, 0.006),
    "du21": (-4.2, 0.006),
    "naca64": (-4.432, 0.0065),
}
"""Angle of zero lift [deg] and drag coefficient there, from the deck's airfoil files."""
TOWER_DIAMETER = ((0.0, 85.268, 87.6), (6.0, 3.87, 3.87))
"""Heights and diameters [m] of the tower in the deck's AeroDyn file, linear between."""
OPENFAST_STALL = {
    "advanced.stall_fit": "openfast",
    "advanced.stall_rotation": "openfast",
    "advanced.reversed_flow": "static",
}
BLADE_SHAPES = {
    "flap": ((0.0622, 1.7254, -3.2452, 4.7131, -2.2555), (-0.5809, 1.2067, -15.5349, 29.7347, -13.8255)),
    "edge": ((0.3627, 2.5337, -3.5772, 2.376, -0.6952),),
}
TOWER_SHAPES = {
    "fore_aft": ((0.7004, 2.1963, -5.6202, 6.2275, -2.504), (-70.5319, -63.7623, 289.737, -176.513, 22.0706)),
    "side_side": ((1.385, -1.7684, 3.0871, -2.2395, 0.5357), (-121.21, 184.415, -224.904, 298.536, -135.838)),
}
"""Mode shapes of the deck's ElastoDyn files."""


def deck_turbine(turbine: Turbine) -> Turbine:
    """The NREL 5 MW with the data of the reference deck."""
    structure = turbine.blade.structure
    r, m = structure.position, structure.mass
    assert m is not None
    x, w = _gauss(r)
    density = np.interp(x, r, m)
    moments = np.array([[np.sum(w * density * x ** (i + j)) for j in range(3)] for i in range(3)])
    c = np.linalg.solve(moments, np.array(ELASTODYN_MOMENTS))
    factor = c[0] + c[1] * r + c[2] * r**2
    changes: dict[str, Any] = {
        "blade.structure.mass": (m * factor).tolist(),
        "pitch_actuator.kind": "ideal",
        "blade.structure.mode_shapes": BLADE_SHAPES,
        "tower.mode_shapes": TOWER_SHAPES,
        "tower.diameter": np.interp(turbine.tower.position, *TOWER_DIAMETER).tolist(),
        "name": f"{turbine.name}-deck",
    }
    for name, (zero_lift, drag) in AIRFOIL_CONSTANTS.items():
        changes[f"airfoils.{name}.zero_lift_angle"] = math.radians(zero_lift)
        changes[f"airfoils.{name}.zero_lift_drag"] = drag
    return turbine.replace(**changes)


def _gauss(stations: Any) -> tuple[Any, Any]:
    """Quadrature points and weights, exact for the piecewise linear density times a quartic."""
    x, w = np.polynomial.legendre.leggauss(4)
    half = 0.5 * np.diff(stations)
    middle = 0.5 * (stations[1:] + stations[:-1])
    return (middle[:, None] + half[:, None] * x).reshape(-1), (half[:, None] * w).reshape(-1)


def deck_options(turbine: Turbine, aero: str, **changes: Any) -> ModelOptions:
    """Options for a comparison with reference set ``"A"``, ``"B"``, ``"E"``, ``"E3"``, ``"P"`` or ``"PU"``."""
    unsteady = {"stall": "hansen", "stall_constants": BEDDOES, **OPENFAST_STALL}
    sets: dict[str, dict[str, Any]] = {
        "A": {"inflow": "quasi_steady", "stall": "static"},
        "B": {"inflow": "variable", **unsteady},
        "P": {"wake": "none", "inflow": "quasi_steady", "stall": "static"},
        "PU": {"wake": "none", "inflow": "quasi_steady", **unsteady},
        "E": {"inflow": "variable", "stall": "static"},
        "E3": {"inflow": "constant", "inflow_time": 4.0, "stall": "static"},
    }
    common: dict[str, Any] = {
        "mode_shapes": "given",
        "torsion_modes": 0,
        "blade_model": "modal",
        "locked": ("yaw",),
        "integration": "explicit",  # as OpenFAST's, so that models are compared
        "advanced.chord_angle": "openfast",
        "tower_drag": False,
        "blade_nodes": tuple(turbine.blade.aerodynamics.position.tolist()),
    }
    return ModelOptions().replace(**{**common, **sets[aero], **changes})
