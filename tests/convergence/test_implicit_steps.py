"""Implicit steps of stiff coordinates: exact vibrations, no growth, a step that the shaft does not limit."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import meltemi
from meltemi import Environment, ModelOptions, SteadyWind
from meltemi.analyses.modes import natural_modes
from meltemi.control import ConstantController
from meltemi.loads import damage_equivalent_load
from meltemi.simulation import vibrations
from meltemi.simulation.model import rows_of
from meltemi.simulation.vibrations import (
    LARGEST_ANGLE,
    derivative_matrix,
    fitted_step,
    single_vibrations,
    step_weights,
    time_step,
    vacuum_case,
)

CALM = SteadyWind(speed=0.0)
SHAFT = {"locked": ("tower", "yaw", "blades")}


def step_matrix(stiffness: Any, damping: Any, h: float, position: Any, lag: Any) -> Any:
    """Of the state (q, v, a, a of the step before) of q'' = -stiffness q - damping v, after M-41 to M-43."""
    n = len(stiffness)
    one, none = np.eye(n), np.zeros((n, n))
    P, L = np.diag(position), np.diag(lag)
    expected = np.hstack([none, none, 2.0 * one, -one])
    change = np.hstack([none, none, one, -one])
    q = np.hstack([one, h * one, 0.5 * h * h * one, none]) + (P + h * L) @ change
    v = np.hstack([none, one, 1.5 * h * one, -0.5 * h * one])
    V = (0.5 * h * one - L) * (np.asarray(position) > 0.0)
    resisting = stiffness @ P + damping @ V
    a = np.linalg.solve(one + resisting, resisting @ expected - stiffness @ q - damping @ v)
    correction = a - expected
    return np.vstack([q + P @ correction, v + (0.5 * h * one - L) @ correction, a, np.hstack([none, none, one, none])])


def oscillator_roots(x: float, damping: float) -> Any:
    beta, kappa = fitted_step(x, damping)
    return np.linalg.eigvals(step_matrix(np.array([[x * x]]), np.array([[2.0 * damping * x]]), 1.0, [beta], [kappa]))


@pytest.mark.parametrize("damping", [0.0, 0.02, 0.0711, 0.3])
@pytest.mark.parametrize("x", [0.1, 0.5, 1.0, 2.01, LARGEST_ANGLE])
def test_one_oscillator_moves_exactly(x: float, damping: float) -> None:
    exact = np.exp(x * (1j * np.sqrt(1.0 - damping**2) - damping))
    assert np.min(np.abs(oscillator_roots(x, damping) - exact)) < 1e-5


def test_no_oscillator_grows() -> None:
    for damping in (0.0, 1e-4, 0.01, 0.07, 0.3, 0.5, 0.7, 1.0, 3.0, 10.0):
        for x in np.concatenate([np.linspace(1e-3, 4.0, 100), np.geomspace(4.0, 500.0, 40)]):
            assert np.max(np.abs(oscillator_roots(x, damping))) < 1.0 + 1e-9, (x, damping)


def test_weights_of_small_steps_are_those_of_numerov_and_beeman() -> None:
    for x in (0.02, 0.05):
        assert fitted_step(x, 0.0) == pytest.approx((1.0 / 12.0, 1.0 / 12.0), rel=0.2 * x)


def test_default_step_is_not_limited_by_the_shaft_or_residual_modes() -> None:
    for name, implicit_step in (("nrel5mw", 0.05 / 3), ("iea15mw", 0.05 / 4), ("iea22mw", 0.05 / 3)):  # 15 MW: 2.5 rad
        turbine = meltemi.load_turbine(name)
        assert time_step(meltemi.build(turbine)) == pytest.approx(implicit_step, rel=1e-12)
        model = meltemi.build(turbine, ModelOptions(integration="explicit"))
        assert time_step(model) == pytest.approx(0.01, rel=1e-12)
        implicit = step_weights(model, 0.01)[0] > 0.0
        names = [model.coordinates[i] for i in np.flatnonzero(implicit)]
        assert [n for n in names if "residual" not in n] == ([] if name == "nrel5mw" else ["drivetrain"])


@pytest.mark.parametrize(("integration", "h"), [("explicit", 0.01), ("implicit", 0.01), ("implicit", 0.05 / 3)])
def test_modes_of_the_iea15mw(integration: Any, h: float) -> None:
    """Of the assembled turbine: no growth, and frequency and damping of each mode up to 2.5 rad a step."""
    options = ModelOptions(integration=integration)
    model = meltemi.build(meltemi.load_turbine("iea15mw"), options, Environment(gravity=0.0))
    case = vacuum_case(model)
    K, D = (-derivative_matrix(case, name) for name in ("q", "v"))
    roots = np.linalg.eigvals(step_matrix(K, D, h, *step_weights(model, h)))
    assert np.max(np.abs(roots)) < 1.0 + 1e-6
    found = np.log(roots.astype(complex) + 1e-300) / h
    found = found[np.abs(found) > 1e-2]
    modes = natural_modes(model, generator_free=True)
    assert max(mode.frequency for mode in modes) == pytest.approx(201.0, rel=0.01)
    for mode in modes:
        if mode.frequency * h > LARGEST_ANGLE:
            continue
        ratios = -found.real / np.abs(found)
        near = np.argmin(np.abs(np.abs(found) / mode.frequency - 1.0) + 5.0 * np.abs(ratios - mode.damping))
        assert abs(found[near]) == pytest.approx(mode.frequency, rel=1e-3 if integration == "implicit" else 9e-3)
        assert ratios[near] == pytest.approx(mode.damping, rel=3e-3 if integration == "implicit" else 0.02)


@pytest.mark.parametrize(("h", "limit"), [(0.05 / 26, 7e-3), (0.005, 1e-3), (0.01, 1e-3)])
def test_shaft_of_the_iea15mw_against_the_closed_form(h: float, limit: float) -> None:
    """Two inertias and a spring, let go: frequency and decay of the twist in the simulation itself."""
    model = meltemi.build(
        meltemi.load_turbine("iea15mw"), ModelOptions(time_step=h, **SHAFT), Environment(gravity=0.0)
    ).with_parameters(**{"aerodynamics.air_density": 0.0})
    frequency, damping = single_vibrations(model)[:, model.coordinates.index("drivetrain")]
    result = meltemi.simulate(
        model,
        CALM,
        duration=24 * h,
        controller=ConstantController(),
        start=meltemi.Start(coordinates={"drivetrain": 1e-4}),
        channels=["q drivetrain"],
        output_step=h,
    )
    # three successive values of a decaying oscillation: x'' = 2 exp(-z) cos(w) x' - exp(-2 z) x
    x = result["q drivetrain"][3:]
    (sum_, product), *_ = np.linalg.lstsq(np.stack([x[1:-1], -x[:-2]], axis=1), x[2:], rcond=None)
    root = np.log(0.5 * (sum_ + np.sqrt(complex(sum_**2 - 4.0 * product)))) / h
    assert abs(root) == pytest.approx(frequency, rel=limit)
    assert -root.real / abs(root) == pytest.approx(damping, rel=2.0 * limit)


def turbulent(integration: Any, h: float | None) -> Any:
    turbine = meltemi.load_turbine("nrel5mw")
    model = meltemi.build(turbine, ModelOptions(integration=integration, time_step=h))
    return meltemi.simulate(
        model,
        meltemi.TurbulentWind(speed=14.0, intensity=0.14, seed=3),
        duration=100.0,
        controller=meltemi.control.BaselineController(turbine, sample_time=0.05),
        channels=["RootMyc1", "RootMxc1", "TwrBsMyt", "TwrBsMxt", "YawBrMzp", "RotSpeed"],
        output_step=0.05,
    )


@pytest.mark.long
def test_long_implicit_steps_keep_loads_in_turbulence() -> None:
    fine, rough, other = turbulent("implicit", 0.0025), turbulent("implicit", None), turbulent("explicit", 0.0025)
    assert rough.meta["time_step"] == pytest.approx(0.05 / 3)
    for name in (channel.name for channel in fine.channels):
        equivalent = [damage_equivalent_load(x[name], duration=100.0, slope=4.0) for x in (fine, rough, other)]
        assert rough[name].std() == pytest.approx(fine[name].std(), rel=5e-3), name
        assert equivalent[1] == pytest.approx(equivalent[0], rel=5e-3), name
        assert equivalent[2] == pytest.approx(equivalent[0], rel=1e-3), name
        assert np.any(fine[name] != other[name]), name
    # an ideal pitch actuator jumps at the calls of the controller: without the mean there 0.7 % of the deviation
    for name in ("RotSpeed", "TwrBsMyt"):
        assert (rough[name] - fine[name]).std() < 2e-3 * fine[name].std(), name


@pytest.mark.slow
def test_a_torque_held_between_calls_does_not_lead() -> None:
    """Without the mean at the calls of the controller, the speed differs by 0.3 % of its deviation."""
    turbine, runs = meltemi.load_turbine("iea15mw"), []
    for h in (0.0025, 0.01):
        model = meltemi.build(turbine, ModelOptions(integration="implicit", time_step=h))
        runs.append(
            meltemi.simulate(
                model,
                meltemi.TurbulentWind(speed=14.0, intensity=0.14, seed=1),
                duration=60.0,
                controller=meltemi.control.BaselineController(turbine, sample_time=0.05),
                channels=["rotor_speed"],
            )["rotor_speed"]
        )
    fine, rough = runs
    assert np.sqrt(np.mean((rough - fine) ** 2)) < 1e-3 * fine.std()


def test_a_run_starts_again_with_the_same_numbers() -> None:
    model = meltemi.build(meltemi.load_turbine("iea15mw"), ModelOptions(integration="implicit"))
    run = meltemi.Simulation(
        meltemi.Run(model, SteadyWind(speed=10.0), duration=2.0, channels=["q drivetrain", "q blade 1 2nd flap"])
    )
    found = []
    for _ in range(2):
        run.reset()
        while not run.finished:
            run.advance(7)
        found.append(run.result().data)
    assert np.array_equal(*found)
    names = [list(model.coordinates).index(name) for name in ("drivetrain", "blade 1 2nd flap")]
    assert run.motion()[0][names] == pytest.approx(found[0][-1], rel=1e-12)


@pytest.mark.parametrize(
    ("frequencies", "expected"),
    [
        ((3.0, 25.0, 0.0, 0.0, 39.0, 50.0, 101.0, 130.0), (6, 7)),  # more than twice all below
        ((3.0, 25.0, 0.0, 0.0, 41.0, 50.0, 60.0, 99.0), (4,)),  # the shaft: twice 20 rad/s are enough
        ((3.0, 5.0, 0.0, 0.0, 30.0, 9.0, 130.0, 100.0), (6, 7)),
        ((3.0, 5.0, 0.0, 0.0, 10.0, 41.0, 19.0, 9.0), (5,)),
        ((3.0, 5.0, 0.0, 0.0, 10.0, 39.0, 12.0, 9.0), ()),  # and nothing below 40 rad/s
    ],
)
def test_coordinates_far_above_all_others_are_stiff(
    frequencies: tuple[float, ...], expected: tuple[int, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    names = ("tower a", "tower b", "yaw", "generator", "drivetrain", "blade 1 a", "blade 1 b", "blade 1 c")
    model: Any = SimpleNamespace(coordinates=names, rows=rows_of(5))
    monkeypatch.setattr(vibrations, "single_vibrations", lambda model: np.array([frequencies, np.zeros(8)]))
    assert tuple(np.flatnonzero(vibrations.stiff(model))) == expected
    model.coordinates = (*names[:7], "blade 1 1st residual")
    assert vibrations.stiff(model)[7]
