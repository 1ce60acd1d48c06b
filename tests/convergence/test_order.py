"""Observed order of the time integration, the default step, and the nodes along the blade."""

from __future__ import annotations

from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

import meltemi
from meltemi import InputError, ModelOptions, Turbine, simulate
from meltemi.simulation.plan import step_of
from meltemi.simulation.vibrations import IMPLICIT_LIMIT, STEP_LIMIT, highest_frequency, time_step

STEPS = (0.01, 0.005, 0.0025, 0.00125)


def response(turbine: Turbine, dt: float, **options: Any) -> Any:
    """Tip and tower-top deflection and azimuth in a smooth gust, every 0.05 s, from steady operation."""
    model = meltemi.build(turbine, ModelOptions(time_step=dt, torsion_modes=0, **options))
    time = np.arange(0.0, 12.0, 0.05)
    gust = 1.5 * (1.0 - np.cos(2.0 * np.pi * np.clip((time - 1.0) / 6.0, 0.0, 1.0)))
    wind = meltemi.WindSeries(time=time, speed=9.0, exponent=0.2, gust=gust)
    return simulate(
        model,
        wind,
        duration=10.0,
        controller=meltemi.control.ConstantController(),
        start=meltemi.operating_point(meltemi.build(turbine, ModelOptions(torsion_modes=0, **options)), 9.0),
        channels=["tip_out_of_plane_1", "tower_top_fore_aft", "azimuth"],
    ).data


CHANGES: list[dict[str, Any]] = [
    {},
    {"inflow": "quasi_steady", "stall": "static"},
    {"advanced": {"corrections": 1}},
    {"integration": "implicit"},
]


@pytest.mark.slow
@pytest.mark.parametrize("options", CHANGES, ids=str)
def test_time_integration_is_of_second_order(turbine: Turbine, options: dict[str, Any]) -> None:
    runs = [response(turbine, dt, **options) for dt in STEPS]
    # differences between successive halvings fall by four; kinks of the polars make single ratios scatter
    change = [np.sqrt(np.mean((a - b) ** 2, axis=0)) for a, b in pairwise(runs)]
    order = 0.5 * np.log2(change[0] / change[-1])
    assert np.all(order[:2] > 1.7), order
    assert np.all(order[:2] < 2.5), order


def test_default_step_resolves_the_highest_mode(turbine: Turbine) -> None:
    for integration, limit in (("explicit", STEP_LIMIT), ("implicit", IMPLICIT_LIMIT)):
        for options in ({}, {"torsion_modes": 0}, {"flap_modes": 3, "edge_modes": 2}):
            model = meltemi.build(turbine, ModelOptions(integration=integration, **options))
            dt = time_step(model)
            assert highest_frequency(model) * dt <= limit
            assert abs(0.05 / dt - round(0.05 / dt)) < 1e-9


def test_default_step_divides_the_intervals_of_a_run(turbine: Turbine) -> None:
    model = meltemi.build(turbine)
    run = partial(meltemi.Run, model, meltemi.SteadyWind(speed=10.0), duration=1.0)
    sampled = meltemi.control.BaselineController
    for given, dt in (
        ({}, 1 / 60),
        ({"output_step": 0.1}, 1 / 60),
        ({"output_step": 0.02}, 0.01),
        ({"controller": sampled(turbine, sample_time=0.0125)}, 0.0125),
        ({"controller": sampled(turbine, sample_time=0.02)}, 0.01),
        ({"controller": sampled(turbine, sample_time=0.0513)}, 1 / 60),  # no step of useful length divides both
    ):
        assert step_of(run(**given), model) == pytest.approx(dt, rel=1e-12), given
    with pytest.raises(InputError, match="sample_time 0.0513 s is not a multiple of the time step"):
        meltemi.Simulation(run(controller=sampled(turbine, sample_time=0.0513)))


@pytest.mark.slow
def test_default_step_is_converged_in_turbulence(turbine: Turbine) -> None:
    wind = meltemi.TurbulentWind(speed=14.0, intensity=0.14, seed=3)
    names = ["RootMyc1", "RootMxc1", "TwrBsMyt", "RotSpeed", "RotTorq"]
    runs = []
    for dt in (None, 0.0025):
        model = meltemi.build(turbine, ModelOptions(time_step=dt))
        runs.append(simulate(model, wind, duration=120.0, channels=names))
    for name in names:
        rough, fine = runs[0][name], runs[1][name]
        assert rough.std() == pytest.approx(fine.std(), rel=5e-3), name
        assert np.sqrt(np.mean((rough - fine) ** 2)) < 0.03 * fine.std(), name


@pytest.mark.long
def test_steady_loads_converge_with_the_nodes(turbine: Turbine) -> None:
    names = ("generator_power", "rotor_aero_thrust", "root_moment_out_of_plane_1", "tip_out_of_plane_1")
    found = []
    for nodes in (10, 20, 40, 160):
        model = meltemi.build(turbine, ModelOptions(blade_nodes=nodes))
        point = meltemi.operating_point(model, 9.0, rotor_speed=1.07, pitch=0.0)
        found.append(np.array([point[name] for name in names]))
    error = [float(np.max(np.abs(f / found[-1] - 1.0))) for f in found[:-1]]
    assert error[2] < error[1] < error[0]
    assert error[1] < 5e-3  # the default of 20 nodes
