"""The discrete adjoint against derivatives by duals and central differences of runs."""

from __future__ import annotations

from typing import Any

import numba
import numpy as np
import pytest

import meltemi
from meltemi import InputError, Model, Result, Simulation, WindBox
from meltemi.analysis import Gradient, gradient, sensitivity
from meltemi.loads import del_weights, std_weights
from meltemi.simulation.run import Run
from meltemi.simulation.simulate import march

pytestmark = pytest.mark.skipif(bool(numba.config.DISABLE_JIT), reason="derivatives exist in compiled code only")

SECONDS = 4.0
TOWER, ROOT = "tower_base_moment_fore_aft", "root_moment_out_of_plane_1"
PARAMETERS = (
    "controller.proportional_gain",
    "controller.filter_frequency",
    "pitch_offset",
    "aerodynamics.air_density",
    "structure.hub_mass",
    "turbine.tower.damping.fore_aft",
)


def objective(result: Result) -> tuple[float, dict[str, Any]]:
    tower, by_tower = std_weights(result[TOWER])
    root, by_root = del_weights(result[ROOT], duration=SECONDS, slope=10.0)
    return tower + root, {TOWER: by_tower, ROOT: by_root}


@pytest.fixture(scope="module")
def run(model: Model) -> Run:
    field = meltemi.TurbulentWind(speed=18.0, intensity=0.14, seed=3, points=9)
    wind: WindBox = meltemi.wind.generate_field(field, model.turbine, SECONDS)
    return Run(model, wind, duration=SECONDS, channels=(TOWER, ROOT))


@pytest.fixture(scope="module")
def found(run: Run) -> Gradient:
    return gradient(run, objective, PARAMETERS)


def test_adjoint_equals_duals(run: Run, found: Gradient) -> None:
    by = sensitivity(run, PARAMETERS)
    expected = by.std(TOWER)[1] + by.fatigue(ROOT, 10.0)[1]
    assert np.all(expected != 0.0)
    np.testing.assert_allclose(found.slopes, expected, rtol=1e-9)
    assert found.value == pytest.approx(by.std(TOWER)[0] + by.fatigue(ROOT, 10.0)[0], rel=1e-9)


def test_adjoint_is_the_limit_of_differences(run: Run, found: Gradient) -> None:
    values = []
    for change in (-1e-7, 1e-7):

        def prepare(case: Any, change: float = change) -> None:
            row = case.controller.state_names.index("proportional_gain")
            case.controller_state[row] *= 1.0 + change

        simulation = Simulation(run, prepare=prepare)
        march(simulation)
        values.append(objective(simulation.result())[0])
    slope = (values[1] - values[0]) / (2e-7 * found.values[0])
    assert found.slopes[0] == pytest.approx(slope, rel=1e-5)


def test_result_is_that_of_the_run_and_errors_are_clear(run: Run, found: Gradient) -> None:
    simulation = Simulation(run)
    march(simulation)
    np.testing.assert_array_equal(found.result.data, simulation.result().data)
    with pytest.raises(InputError, match="proportional_gain"):
        gradient(run, objective, ["controller.proportional_gian"])
    with pytest.raises(InputError, match="expected 81 derivatives"):
        gradient(run, lambda result: (0.0, {TOWER: np.zeros(3)}), PARAMETERS[:1])
