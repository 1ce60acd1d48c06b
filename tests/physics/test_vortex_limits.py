"""Vortex wakes at their limits: rotors that do not turn, costs, and wakes that are lost."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest

import meltemi
from meltemi import InputError, ModelOptions, Simulation, Start, SteadyWind, Turbine
from meltemi.core.errors import RunError, Status, UnsupportedError
from meltemi.simulation.points import initial_state

WIND = SteadyWind(speed=10.0)
TURNING = Start(rotor_speed=1.2, coordinates={})


def test_a_parked_rotor_begins_as_with_momentum(turbine: Turbine) -> None:
    """The search for its equilibrium does not settle the wake at each trial, which takes minutes."""
    start = Start(pitch=0.5 * np.pi)
    states = [
        initial_state(meltemi.build(turbine, ModelOptions(wake=wake)), WIND, start)[0]
        for wake in ("momentum", "hybrid")
    ]
    np.testing.assert_array_equal(states[0].q, states[1].q)


@pytest.mark.parametrize("wake", ["hybrid", "free"])
def test_a_wake_that_takes_hours_is_refused_with_its_cost(turbine: Turbine, wake: str) -> None:
    finest = {"length": 100.0, "lattice": 20.0, "azimuth_step": 0.01}
    with pytest.raises(
        InputError, match=r"vortices: a wake of 7\d\d,\d\d\d vortices .* h a revolution; expected at most"
    ):
        meltemi.build(turbine, ModelOptions(wake=wake, vortices=finest))


def test_zones_that_are_longer_than_the_wake_are_refused(turbine: Turbine) -> None:
    with pytest.raises(InputError, match=r"length: expected at least lattice and free, 30, found 20"):
        ModelOptions(wake="free", vortices={"free": 30.0})


@pytest.mark.parametrize("analysis", ["sensitivity", "gradient"])
def test_derivatives_of_moving_vortices_are_refused(turbine: Turbine, analysis: str) -> None:
    model = meltemi.build(turbine, ModelOptions(wake="hybrid"))
    run = meltemi.Run(model, WIND, duration=1.0, start=TURNING)
    names, with_objective = ["aerodynamics.air_density"], partial(meltemi.analysis.gradient, run, lambda _: (0.0, {}))
    derive = with_objective if analysis == "gradient" else partial(meltemi.analysis.sensitivity, run)
    with pytest.raises(UnsupportedError, match=f"{analysis}: a wake of moving vortices has no derivatives; use"):
        derive(names)


@pytest.mark.long
def test_linear_models_keep_the_vortices_where_they_are(turbine: Turbine) -> None:
    """The wake has no states; the thrust follows the wind at once as with momentum, whose induction also lags."""
    rises = []
    for wake in ("hybrid", "momentum"):
        options = ModelOptions(wake=wake, stall="static", locked=("tower", "blades", "drivetrain"))
        model = meltemi.build(turbine, options)
        point = meltemi.operating_point(model, 10.0, rotor_speed=1.2, pitch=0.0)
        linear = meltemi.analysis.linearise(model, point, inputs=("wind_speed",), outputs=("rotor_aero_thrust",))
        assert not any("vort" in name or "wake" in name for name in linear.states)
        rises.append(float(linear.D[0, 0]))
    assert 0.8 < rises[0] / rises[1] < 1.05


@pytest.mark.long
@pytest.mark.parametrize(("zone", "row", "steps"), [(1, 4, 5), (2, 2, 24), (3, 1, 152)])
def test_a_lost_vortex_ends_the_run_with_blade_and_age(turbine: Turbine, zone: int, row: int, steps: int) -> None:
    """Ages in steps of the wake, of 10 degrees, after the next one: rows of the second zone are 3, of the third 6."""
    model = meltemi.build(turbine, ModelOptions(wake="hybrid"))
    run = Simulation(meltemi.Run(model, WIND, duration=5.0, start=TURNING, partial=True))
    run.advance(20)
    run.case.view(f"wake_{zone}")["position"][0, 1, row, 0] = 2e5
    run.advance(run.n_steps)
    result = run.result()
    assert result.status is Status.DIVERGED
    step = np.radians(10.0) / 1.2
    words = result.message
    assert "vortex wake: a vortex of blade 2, " in words and " s old, is lost" in words
    age = float(words.split("blade 2, ")[1].split(" s old")[0])
    assert age == pytest.approx(steps * step, abs=5.0 * step)
    assert result.time[-1] < 1.0
    with pytest.raises(RunError, match="blade 2"):
        result.raise_for_status()
