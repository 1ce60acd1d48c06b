"""Designs by gradients with real runs: the gradient of the whole objective, and an optimum that a scan finds, too."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numba
import numpy as np
import pytest

import meltemi
from meltemi.analysis import optimise
from meltemi.core.yamlfile import validated
from meltemi.designs.design import Teller, _Study
from meltemi.designs.problem import Problem
from meltemi.designs.settings import Design
from meltemi.gradients.sensitivity import table_slopes

pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(bool(numba.config.DISABLE_JIT), reason="derivatives exist in compiled code only"),
]

CASES = {"case": {"duration": 20.0, "transient": 8.0, "wind": {"intensity": 0.14, "points": 9}},
         "cases": [{"speed": 18.0, "seeds": [3]}], "turbine": "nrel5mw"}  # fmt: skip
GAIN = {"controller.proportional_gain": {"low": 0.3, "high": 4.0, "relative": True}}


def study(**changes: Any) -> _Study:
    found = _Study(validated(CASES | changes, Design, "design"), Path(), None, False, 1, Teller())
    found.runs.set_units()
    found.problem.begin()
    return found


def difference(problem: Problem, p: int, h: float) -> np.ndarray:
    """Central difference of objective and margins with a step of a scaled variable."""
    y, change = problem.scaled(problem.variables.start), h * np.eye(len(problem.variables.each))[p]
    low, high = (problem.trial(problem.unscaled(y + side * change)) for side in (-1.0, 1.0))
    return np.array([high.objective - low.objective, *(high.margins - low.margins)]) / (2.0 * h)


def test_the_gradient_of_the_whole_objective_with_new_build_and_new_start() -> None:
    """Central differences, every trial with its own build, steady operation and run, against the adjoint (D-21)."""
    given = study(
        variables=GAIN | {
            "turbine.blade.aerodynamics.twist": {"knots": 2, "add": True, "low": "-3 deg", "high": "3 deg"},
            "turbine.blade.structure.flap_stiffness": {"low": 0.7, "high": 1.4},
            "turbine.tower.fore_aft_stiffness": {"low": 0.7, "high": 1.4},
            "turbine.hub.precone": {"low": 0.0, "high": 0.1},
        },
        objective={"del TwrBsMyt": 0.5, "std rotor_speed": 0.5},
        constraints={"max RootMyc1": {"most": 1.0}, "energy": {"least": 0.99}, "mass tower": {"most": 1.0}},
    )  # fmt: skip
    problem, x = given.problem, given.variables.start
    slopes = problem.jacobian(x) * given.variables.scale
    for p in range(len(x)):
        size = np.abs(slopes).max(axis=1)
        found = difference(problem, p, 1e-4)
        # differences of the start to 1e-3; kinks of polars within the step
        np.testing.assert_allclose(slopes[:, p], found, rtol=3e-3, atol=3e-3 * size.max() if size.all() else 1e-3)


def test_the_gradient_by_plies_chord_and_twist_of_a_layup() -> None:
    """From the thickness of plies through section, blade and turbine in turbulence to a load (D-19, D-20)."""
    given = study(
        turbine="iea15mw", layup={"file": "iea15mw"},
        case={"duration": 20.0, "transient": 8.0, "wind": {"intensity": 0.12, "points": 9},
              "blade_stations": [30.0, 70.0]}, cases=[{"speed": 14.0}],
        variables={
            "layup.Spar_Cap_*": {"knots": 2, "low": 0.6, "high": 1.5}, "layup.Shell_skin": {"low": 0.7, "high": 1.5},
            "turbine.blade.aerodynamics.chord": {"knots": 2, "low": 0.9, "high": 1.1},
            "turbine.blade.aerodynamics.twist": {"knots": 2, "add": True, "low": "-3 deg", "high": "3 deg"},
        },
        objective={"del RootMyc1": 1.0},
        constraints={"clearance": {"least": 1.0}, "max RootMyc1": {"most": 1.0}, "mass blade": {"most": 1.0},
                     "max strain Spar_Cap_*": {"most": 1.0}},
    )  # fmt: skip
    problem, x = given.problem, given.variables.start
    slopes = problem.jacobian(x) * given.variables.scale
    size = np.abs(slopes).max()
    for p in range(len(x)):
        steps = (1e-2, 3e-3, 1e-3)  # cycles appear within large steps, steady operation rounds small ones
        found = [np.abs(difference(problem, p, h) - slopes[:, p]) for h in steps]
        assert np.all(np.min(found, axis=0) < 2e-3 * size), given.variables.names[p]


def test_the_gradient_of_the_strain_by_the_wall() -> None:
    """The moment changes by the runs, the strain per moment by the wall: both against differences of trials (D-8)."""
    given = study(
        variables=GAIN | {"tower.thickness": {"low": 0.7, "high": 1.3}, "tower.diameter": {"low": 0.9, "high": 1.1}},
        objective={"del tower_base_strain": 1.0},
        constraints={"max tower_base_strain": {"most": 1.0}, "del TwrBsMyt": {"most": 1.0}},
    )
    problem, x = given.problem, given.variables.start
    slopes = problem.jacobian(x) * given.variables.scale
    for p in range(len(x)):
        np.testing.assert_allclose(slopes[:, p], difference(problem, p, 1e-3), rtol=3e-3, atol=3e-4)
    found = dict(zip([t.name for t in problem.terms], problem.trial(x).totals, strict=True))
    tower = meltemi.load_turbine("nrel5mw").tower
    per = 0.5 * tower.diameter[0] / tower.fore_aft_stiffness[0]
    assert found["del tower_base_strain"] == pytest.approx(per * found["del TwrBsMyt"], rel=1e-12)


def test_the_optimum_of_one_gain_is_that_of_a_scan() -> None:
    found = optimise(validated(CASES | {
        "variables": GAIN, "objective": {"std rotor_speed": 0.6, "travel pitch_1": 0.4}, "tolerance": 1e-7,
        "proof": {"seeds": [5, 6]},
    }, Design, "design"))  # fmt: skip
    given = study(variables=GAIN, objective={"std rotor_speed": 0.6, "travel pitch_1": 0.4})
    factors = np.linspace(0.3, 4.0, 38)
    scan = [given.problem.trial(np.array([factor])).objective for factor in factors]
    best = int(np.argmin(scan))
    assert 0 < best < len(scan) - 1
    assert abs(found.end[0] - factors[best]) < 0.1  # the distance of two points of the scan
    assert found.objective <= min(scan) + 1e-9
    assert found.check is not None and found.check.error < 1e-4
    assert len(found.proof) == 2 and found.proof[0].change is not None and found.proof[0].change.n == 2


def test_a_variable_without_derivatives_is_left_to_differences_of_runs() -> None:
    given = study(
        variables={"turbine.drivetrain.generator_efficiency": {"low": 0.9, "high": 0.99}}, objective={"energy": -1.0}
    )
    x = given.variables.start
    slope = given.problem.jacobian(x)[0, 0]
    assert given.derivatives.without.keys() == {"turbine.drivetrain.generator_efficiency"}
    assert slope == pytest.approx(-1.0 / x[0], rel=1e-6)  # the energy is in proportion


@pytest.mark.parametrize("path", ["blade.aerodynamics.chord", "blade.structure.flap_stiffness", "tower.mass"])
def test_tables_are_differentiated_exactly(path: str) -> None:
    """Against a step of a third: what extrapolation leaves, and rounding of the modes."""
    turbine = meltemi.load_turbine("nrel5mw")
    model, values = meltemi.build(turbine), turbine
    for key in path.split("."):
        values = getattr(values, key)

    def moved(h: float) -> Any:
        return turbine.replace(**{path: (np.asarray(values) * (1.0 + h)).tolist()})

    found, error = table_slopes(path, model, moved, 0.03)
    other, _ = table_slopes(path, model, moved, 0.01)
    assert error < 1e-7
    for name in ("shape", "modal", "aero_nodes", "tower_matrix"):
        if name in found:
            size = max(np.abs(found[name]).max(), np.abs(model.array(name)).max() if name != "shape" else 0.0)
            np.testing.assert_allclose(found[name], other[name], atol=1e-8 * size)
