"""Induction models as parts: they see all nodes, take steps of their own, and enter trim and linear models.

In plain Python, NUMBA_DISABLE_JIT=1, most of this file takes seconds.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mean_inflow import MeanPart, MeanSystem, WithoutRates

import meltemi
from meltemi import InputError, Model, ModelOptions, Start, SteadyWind, Turbine, UnsupportedError
from meltemi.aero.air import Air
from meltemi.aero.lifting_line import LineAir
from meltemi.aero.rotor import induce, induced_velocity
from meltemi.aero.tables import AeroNode, BladeFlow
from meltemi.analysis import linearise, operating_point
from meltemi.compiler import interpreted, members
from meltemi.control import ConstantController
from meltemi.gradients.adjoint import gradient
from meltemi.gradients.sensitivity import sensitivity
from meltemi.simulation.case import Case
from meltemi.simulation.induction import InductionPart, InductionSystem
from meltemi.simulation.run import Run
from meltemi.simulation.simulate import Simulation, march

pytestmark = pytest.mark.long  # machine code of a turbine with these parts
compiled = pytest.mark.skipif(interpreted(), reason="derivatives need compiled kernels")
GAIN, TIME, STEP, DT = 0.05, 3.0, 0.2, 0.05
OPTIONS = ModelOptions(
    blade_nodes=6, tower_nodes=3, time_step=DT, stall="static", locked=("tower", "blades", "yaw", "drivetrain")
)
WIND = SteadyWind(speed=9.0, shear_exponent=0.1)
LOADS = [BladeFlow.index(name) for name in ("normal_force", "driving_force", "pitching_moment")]
THRUST = "rotor_aero_thrust"
TURNING = Start(rotor_speed=1.0, coordinates={})


class SecondSystem(InductionSystem):
    """The record of another model."""


class Second(InductionPart):
    """A second model."""

    system = SecondSystem


@pytest.fixture
def model(turbine: Turbine, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Model[Any]:
    """A turbine with a model that another package registers, as pip would leave it there."""
    info = tmp_path / "mean_inflow-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: mean_inflow\nVersion: 1.0\n", encoding="utf-8")
    (info / "entry_points.txt").write_text("[meltemi.parts]\nmean_inflow = mean_inflow:part_of\n", encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    data = {"gain": GAIN, "time": TIME, "step": STEP}
    return meltemi.build(turbine.replace(extensions={"mean_inflow": data}), OPTIONS)


def turning(model: Model[Any]) -> Case:
    """The case of a model at the start of a run."""
    case = Case(model, WIND)
    TURNING.put(case)
    case.begin_parts(DT)
    return case


def mean_circulation(case: Case) -> float:
    """[m^2/s] of all nodes: half of chord, speed and lift coefficient."""
    flow = case.view("flow")
    chord = case["aero_nodes"][AeroNode.index("chord")]
    return float((0.5 * chord * flow["speed"] * flow["lift"]).mean())


def velocity(case: Case) -> float:
    """[m/s] the state of the model."""
    return float(case.view("mean_velocity")["velocity"])


def test_a_registered_model_receives_and_moves_all_nodes(model: Model[Any]) -> None:
    """Its velocity follows from the circulation of all nodes, and all blade elements are in it."""
    case = turning(model)
    (part,) = model.parts
    assert isinstance(part, MeanPart)
    assert velocity(case) == pytest.approx(GAIN * mean_circulation(case), rel=1e-6)
    assert velocity(case) > 0.5
    line, flow = case.view("lifting_line"), case.view("flow")
    downwind = case.view("machine")["shaft"]
    np.testing.assert_allclose(line["induced"], np.zeros((3, 3, 6)) - velocity(case) * downwind[:, None, None])
    wind = line["onset"] + line["induced"]
    normal, along = (np.sum(wind * line[axis], axis=0) for axis in ("normal", "along"))
    np.testing.assert_allclose(flow["speed"], np.hypot(normal, along), rtol=1e-12)
    np.testing.assert_allclose(flow["phi"], np.arctan2(normal, along), rtol=1e-12)
    np.testing.assert_allclose((1.0 - flow["axial"]) * flow["vx"], normal, rtol=1e-12)


def test_elements_join_and_stand_for_the_lengths_of_the_nodes(model: Model[Any]) -> None:
    line = (case := turning(model)).view("lifting_line")
    inner, outer = line["inner_end"], line["outer_end"]
    np.testing.assert_allclose(inner[:, :, 1:], outer[:, :, :-1], rtol=1e-14)
    length = case["aero_nodes"][AeroNode.index("length")]
    np.testing.assert_allclose(np.linalg.norm(outer - inner, axis=0), length, rtol=0.02)  # chords of a bent line


def test_the_loads_are_those_of_the_induced_velocity(model: Model[Any], turbine: Turbine) -> None:
    """Without gain those of no induction; with it less, and other than those of momentum."""
    none = meltemi.build(turbine, OPTIONS.replace(wake="none", skew="none"))
    momentum = meltemi.build(turbine, OPTIONS)
    idle = model.with_parameters(**{"mean inflow.gain": 0.0})
    cases = [turning(each) for each in (none, idle, model, momentum)]
    np.testing.assert_allclose(cases[1]["flow"][LOADS], cases[0]["flow"][LOADS], rtol=1e-13)
    thrust = [float(case.view("rotor")["thrust"]) for case in cases]
    assert thrust[2] < 0.95 * thrust[1]
    assert abs(thrust[3] / thrust[2] - 1.0) > 0.01


def test_a_step_of_its_own_is_honoured(model: Model[Any]) -> None:
    """The state changes after every fourth step only, then by Euler's over all four, with the loads of the last."""
    run = Run(model, WIND, duration=1.3, start=TURNING, controller=ConstantController(), channels=(THRUST,))
    simulation = Simulation(run)
    case, times = simulation.case, round(STEP / DT)
    case["mean_velocity"][...] = 0.0  # far from steady
    changed = []
    for k in range(24):
        before = velocity(case)
        simulation.advance(1)
        if (k + 1) % times:
            assert velocity(case) == before
        else:
            rate = (GAIN * mean_circulation(case) - before) / TIME
            assert velocity(case) == pytest.approx(before + STEP * rate, rel=1e-12)
            changed.append(velocity(case) - before)
    assert len(changed) == 6
    assert min(changed) > 0.01
    simulation.reset()
    assert case.view("induction_time")["elapsed"] == 0.0


def test_the_step_of_the_turbine_by_default(model: Model[Any]) -> None:
    every = model.with_parameters(**{"mean inflow.step": 0.0})
    run = Run(every, WIND, duration=0.3, start=TURNING, controller=ConstantController(), channels=("rotor_speed",))
    simulation = Simulation(run)
    simulation.case["mean_velocity"][...] = 0.0
    for _ in range(4):
        before = velocity(simulation.case)
        simulation.advance(1)
        assert velocity(simulation.case) > before


def test_steady_operation_has_the_steady_state_of_the_model(model: Model[Any]) -> None:
    """The search for it, and the case in which a run begins."""
    point = operating_point(model, WIND, rotor_speed=1.0, pitch=0.0)
    case = Case(model, point.wind)
    point.put(case)
    case.begin_parts(DT)
    assert velocity(case) == pytest.approx(GAIN * mean_circulation(case), rel=1e-6)
    assert case.view("rotor")["thrust"] == pytest.approx(point[THRUST], rel=0.01)


@compiled
def test_states_with_rates_are_those_of_linear_models(model: Model[Any]) -> None:
    """The derivative by the state is that of central differences; dynamic inflow of momentum is no state."""
    point = operating_point(model, WIND, rotor_speed=1.0, pitch=0.0)
    linear = linearise(model, point, ("wind_speed",), (THRUST,), azimuth=0.0)
    place = linear.states.index("mean induced velocity")
    assert not any(" inflow " in name for name in linear.states)
    case = Case(model, point.wind, numbers="floats")
    point.put(case, 0.0)
    case.begin_parts()
    state, found, h = case["mean_velocity"], [], 1e-4
    for x in state[0] + h * np.array([-1.0, 1.0]):
        state[0] = x
        case.evaluate(0.0)
        case.rates()
        found.append(np.array([case["d_mean_velocity"][0], case.view("rotor")["thrust"]]))
    slope, by_thrust = (found[1] - found[0]) / (2.0 * h)
    assert linear.A[place, place] == pytest.approx(slope, rel=1e-6)
    assert linear.C[0, place] == pytest.approx(by_thrust, rel=1e-6)
    assert slope < -1.0 / TIME  # more induction, less circulation


@compiled
def test_derivatives_of_a_run_pass_through_the_steps_of_the_model(model: Model[Any]) -> None:
    def run(gain: float) -> Run:
        other = model.with_parameters(**{"mean inflow.gain": gain})
        return Run(other, WIND, duration=1.0, start=TURNING, controller=ConstantController(), channels=(THRUST,))

    def series(one: Run) -> Any:
        simulation = Simulation(one)
        march(simulation)
        return simulation.result()[THRUST]

    h = 1e-5
    low, high = (series(run(GAIN + change)) for change in (-h, h))
    found = sensitivity(run(GAIN), ["mean inflow.gain"])
    np.testing.assert_allclose(found.slopes[:, 0, 0], (high - low) / (2.0 * h), rtol=1e-5)


@compiled
def test_models_without_derivatives_are_refused(model: Model[Any]) -> None:
    other = replace(model, parts=(WithoutRates(**vars(model.parts[0])),))
    point = operating_point(model, WIND, rotor_speed=1.0, pitch=0.0)
    with pytest.raises(UnsupportedError, match="the induction model WithoutRates has no rates of its states"):
        linearise(other, point, (), (), azimuth=0.0)
    run = Run(model, WIND, duration=0.1, start=TURNING, controller=ConstantController(), channels=("rotor_speed",))
    with pytest.raises(UnsupportedError, match="induction models have no derivatives in reverse"):
        gradient(run, lambda result: (0.0, {}), ("hub.mass",))


def test_one_model_and_blades(model: Model[Any]) -> None:
    (part,) = model.parts
    twice = replace(model, parts=(part, Second(part.n_blades, part.line_ends)))
    with pytest.raises(InputError, match="expected one induction model, found 2: MeanPart, Second; remove"):
        Case(twice, WIND).begin_parts()
    disk = meltemi.load_turbine("pmsg20mw")
    with pytest.raises(InputError, match="an induction model needs blades"):
        InductionPart.on(disk, meltemi.build(disk).rotor)


def test_a_plain_turbine_has_the_kernels_of_momentum_only(model: Model[Any], turbine: Turbine) -> None:
    """No arrays and no calls of an induction model; tests/architecture checks that nothing of it is imported."""
    plain, other = (type(Case(each, WIND).system) for each in (meltemi.build(turbine, OPTIONS), model))
    assert issubclass(other, MeanSystem)
    assert "lifting_line" in members(other)
    assert "lifting_line" not in members(plain)
    for function in (induce, induced_velocity):
        assert function.called(plain) == [function.texts[Air]]
        assert function.called(other) == [function.texts[LineAir]]
