"""The discrete adjoint against derivatives by duals and central differences of runs."""

from __future__ import annotations

from math import sin, tanh
from typing import Any

import numba
import numpy as np
import pytest

import meltemi
from meltemi import (
    Controller,
    InputError,
    Model,
    ModelOptions,
    Result,
    Simulation,
    Start,
    Turbine,
    WindBox,
)
from meltemi.analysis import Gradient, gradient, sensitivity
from meltemi.gradients.adjoint import gradients
from meltemi.gradients.sensitivity import directions, settled
from meltemi.loads import del_weights, std_weights
from meltemi.simulation.run import Run
from meltemi.simulation.simulate import march

pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(bool(numba.config.DISABLE_JIT), reason="derivatives exist in compiled code only"),
]

EXACT = ModelOptions(advanced={"induction_tolerance": 0.0})
"""Else rounding decides where the induction's iterations stop, by up to 1e-8 of a derivative."""
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
def run() -> Run:
    model = meltemi.build(meltemi.load_turbine("nrel5mw"), EXACT)
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


CASES: dict[str, dict[str, Any]] = {
    "as by default": {},
    "corrections": {"advanced.corrections": 1},
    "electrical, gearbox": {"electrical": "averaged", "drivetrain": "multibody"},
    "modal blades, static polars": {"torsion_modes": 0, "stall": "static", "inflow": "quasi_steady"},
}


@pytest.mark.parametrize("case", CASES)
def test_random_weights_and_directions(case: str, turbine: Turbine, geared: Turbine) -> None:
    """The adjoint of random weights, times a direction, is the weighted sum of derivatives in it (J-5)."""
    if "electrical" in CASES[case]:
        law = turbine.control
        system = meltemi.turbine.size_electrical(law.torque.rated_power, law.pitch.reference_speed)
        turbine = geared.replace(electrical=system)
    # lanes end the iterations of the induction at a tolerance, duals do not
    model = meltemi.build(turbine, EXACT.replace(**CASES[case]))
    check(Run(model, 15.0, duration=0.2), [name for name in PARAMETERS if not name.startswith("turbine")])


def check(run: Run, parameters: list[str]) -> None:
    by = sensitivity(run, parameters)
    random = np.random.default_rng(2)
    direction = random.normal(size=len(parameters)) * [abs(value) or 1.0 for value in by.values]
    scale = np.abs(by.slopes).max(axis=(0, 2))
    weights = random.normal(size=by.slopes.shape[:2]) / np.where(scale > 0.0, scale, 1.0)
    found = gradient(run, lambda result: (0.0, dict(zip(result.names, weights.T, strict=True))), parameters)
    expected = np.einsum("tc,tcp,p", weights, by.slopes, direction)
    assert abs(found.slopes @ direction - expected) < 1e-9 * np.abs(found.slopes * direction).sum()
    assert expected != 0.0


def test_through_an_event_and_from_initial_conditions(turbine: Turbine) -> None:
    model = meltemi.build(turbine, EXACT)
    stuck = [{"at": 0.1, "type": "pitch_stuck", "blade": 2}]
    start = Start(rotor_speed=1.2, pitch=0.15, generator_torque=4e4, coordinates={})
    for run in (Run(model, 15.0, duration=0.2, events=stuck), Run(model, 15.0, duration=0.2, start=start)):
        check(run, ["controller.proportional_gain", "pitch_offset", "aerodynamics.air_density"])


def test_power_coefficient_turbine() -> None:
    model = meltemi.build(meltemi.load_turbine("pmsg20mw"))
    check(Run(model, 10.0, duration=0.2), ["aerodynamics.air_density", "controller.torque"])


@numba.njit
def nonlinear(state: Any, measurements: Any, demands: Any, dt: float) -> None:
    """Proportional control with an elementary function and a branch."""
    error = measurements.generator_speed / state[0] - 1.0
    added = state[1] * tanh(4.0 * error)
    for b in range(3):
        demands.pitch[b] = state[2] + (added if error > 0.0 else 0.5 * added)
    demands.generator_torque = state[3] * (1.0 + 0.1 * sin(error))


def own(update: Any) -> Controller:
    names = ("set_speed", "gain", "pitch", "torque")
    return Controller(
        update, init=lambda at: [at.generator_speed * 0.99, 0.3, at.pitch, at.generator_torque], state_names=names
    )


def test_own_controller(turbine: Turbine) -> None:
    model = meltemi.build(turbine, EXACT)
    names = ["controller.set_speed", "controller.gain", "controller.pitch", "controller.torque"]
    check(Run(model, 15.0, duration=0.2, controller=own(nonlinear)), names)


def test_controllers_without_derivatives_are_refused(model: Model) -> None:
    @numba.njit
    def allocates(state: Any, measurements: Any, demands: Any, dt: float) -> None:
        demands.pitch[0] = np.zeros(int(state[0]))[0]

    with pytest.raises(InputError, match="makes arrays"):
        gradient(Run(model, 15.0, duration=0.1, controller=own(allocates)), objective, ["controller.gain"])
    with pytest.raises(InputError, match="is plain Python; decorate"):
        gradient(Run(model, 15.0, duration=0.1, controller=own(nonlinear.py_func)), objective, ["controller.gain"])


def test_result_is_that_of_the_run_and_errors_are_clear(run: Run, found: Gradient) -> None:
    simulation = Simulation(run)
    march(simulation)
    np.testing.assert_array_equal(found.result.data, simulation.result().data)
    with pytest.raises(InputError, match="proportional_gain"):
        gradient(run, objective, ["controller.proportional_gian"])
    with pytest.raises(InputError, match="expected 81 derivatives"):
        gradient(run, lambda result: (0.0, {TOWER: np.zeros(3)}), PARAMETERS)


def test_several_objectives_from_one_record_are_those_of_each(run: Run) -> None:
    held, model, controller, start = settled(run)
    ways = directions(model, PARAMETERS, controller, start, {})

    def parts(result: Result) -> list[tuple[float, dict[str, Any]]]:
        root, by = del_weights(result[ROOT], duration=SECONDS, slope=10.0)
        tower, by_tower = std_weights(result[TOWER])
        return [(root, {ROOT: by}), (tower, {TOWER: by_tower}), objective(result)]

    together = gradients(held, parts, ways)
    for k in range(3):
        alone = gradients(held, lambda result, k=k: parts(result)[k : k + 1], ways)  # type: ignore[misc]
        np.testing.assert_array_equal(together.slopes[k], alone.slopes[0])
    np.testing.assert_allclose(together.slopes[0] + together.slopes[1], together.slopes[2], rtol=1e-9)
