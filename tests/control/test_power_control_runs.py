"""Power control in runs of whole turbines: closed forms, schemes in turbulence, derivatives, and lanes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import meltemi
from meltemi import Environment, InputError, Result, Simulation, SteadyWind, TurbulentWind
from meltemi.cases.case import case_controller, read_case
from meltemi.control import Droop, PowerControl, PowerController
from meltemi.environment import Air, PowerGrid
from meltemi.power_control.tables import NUMBER
from meltemi.simulation.run import Run
from meltemi.simulation.simulate import march
from meltemi.turbine.power_turbine import AnyTurbine

CHANNELS = ("rotor_speed", "pitch_1", "generator_power", "generator_torque", "power_state", "wind_estimate", "wind_x")
SCHEMES = ("A0", "A1", "A2", "A3")


def control(turbine: AnyTurbine, **settings: Any) -> meltemi.Controller:
    return PowerController(turbine, meltemi.analysis.performance_of(turbine), PowerControl.model_validate(settings))


def run(model: Any, wind: Any, seconds: float, controller: Any, **more: Any) -> Result:
    result = meltemi.simulate(
        model, wind, duration=seconds, controller=controller, channels=CHANNELS, output_step=0.1, **more
    )
    result.raise_for_status()
    return result


@pytest.fixture(scope="module")
def formula() -> AnyTurbine:
    return meltemi.load_turbine("pmsg20mw")


@pytest.fixture(scope="module")
def table() -> AnyTurbine:
    return meltemi.load_turbine("pmsg20mw-bem")


CASE = """\
turbine: pmsg20mw
wind: {kind: steady, speed: 12.0}
duration: 100.0
grid: {power_reference: 1.5e+7}
controller: {kind: power, scheme: A1, density: weather, droop: {reserve: 0.1}}
"""


@pytest.mark.long
def test_a_case_file_has_it(tmp_path: Path) -> None:
    path = tmp_path / "case.yaml"
    path.write_text(CASE, encoding="utf-8")
    case = read_case(path)
    model = meltemi.build(meltemi.load_turbine(case.turbine))
    controller = case_controller(case, model, tmp_path)
    found = run(model, SteadyWind(speed=12.0), 100.0, controller, grid=case.grid)
    assert found["generator_power"][-1] == pytest.approx(15e6, rel=1e-3)
    assert found["rotor_speed"][-1] == pytest.approx(0.75, rel=1e-3)
    path.write_text(CASE.replace("A1", "A7"), encoding="utf-8")
    with pytest.raises(InputError, match=r"case.yaml.*\n?.*scheme"):
        read_case(path)


@pytest.mark.long
@pytest.mark.parametrize(("celsius", "ratio", "gain"), [(40.0, 9.24, 40.9e3), (-10.0, 9.79, 53.4e3)])
def test_what_a_measured_temperature_gains(formula: AnyTurbine, celsius: float, ratio: float, gain: float) -> None:
    """Palanimuthu et al. (2022), Fig. 6, in steady state with dry air and the formula for the power coefficient."""
    model = meltemi.build(formula, environment=Environment(air=Air(temperature=celsius)))
    fixed, measured = (
        run(model, SteadyWind(speed=10.0), 400.0, control(formula, density=kind)) for kind in ("fixed", "temperature")
    )
    assert fixed["rotor_speed"][-1] * 13.8 == pytest.approx(ratio, abs=0.005)
    assert measured["rotor_speed"][-1] * 13.8 == pytest.approx(9.5085, abs=0.001)
    gained = measured["generator_power"][-1] - fixed["generator_power"][-1]
    assert gained == pytest.approx(gain, rel=0.005)


@pytest.mark.long
def test_schemes_in_turbulence(table: AnyTurbine) -> None:
    """15 of 20 MW at 11 m/s and 10 % turbulence: all track, A0 at one speed, A2 with a third of the pitch travel."""
    model, wind = meltemi.build(table), TurbulentWind(speed=11.0, intensity=0.1, seed=1, points=9)
    results = {
        scheme: run(model, wind, 600.0, control(table, scheme=scheme), grid=PowerGrid(power_reference=15e6))
        for scheme in SCHEMES
    }
    travel = {scheme: float(np.abs(np.diff(r["pitch_1"][1000:])).sum()) for scheme, r in results.items()}
    for result in results.values():
        assert result["generator_power"][1000:].mean() == pytest.approx(15e6, rel=0.01)
    lower = results["A0"]["rotor_speed"][1000:]
    assert lower.mean() == pytest.approx(0.670, rel=0.01) and lower.std() < 0.005
    assert results["A2"]["rotor_speed"][1000:].max() < 0.77
    assert travel["A2"] < 0.5 * travel["A0"] and travel["A2"] < 0.5 * travel["A1"]
    assert np.mean(results["A2"]["power_state"][1000:] == NUMBER["hold"]) > 0.5


@pytest.mark.long
@pytest.mark.parametrize("scheme", SCHEMES)
def test_a_rotor_of_hardly_any_inertia_keeps_its_speed(table: AnyTurbine, scheme: str) -> None:
    """4.872e6 kg m^2, the literal reading of Table 1: nothing to store energy in, so power varies, but no more."""
    light = table.replace(**{"drivetrain.rotor_inertia": 4.872e6})
    wind = TurbulentWind(speed=11.0, intensity=0.1, seed=1, points=9)
    found = run(meltemi.build(light), wind, 300.0, control(light, scheme=scheme), grid=PowerGrid(power_reference=15e6))
    assert found["rotor_speed"].min() > 0.45 and found["rotor_speed"].max() < 1.2 * 0.75
    assert found["generator_power"][1000:].mean() == pytest.approx(15e6, rel=0.03)


@pytest.mark.long
def test_events_of_the_grid(table: AnyTurbine) -> None:
    """A loss takes the torque, a limit the power."""
    found = run(
        meltemi.build(table),
        SteadyWind(speed=13.0),
        150.0,
        control(table),
        events=[
            {"at": 30.0, "type": "grid_loss", "until": 40.0},
            {"at": 100.0, "type": "power_limit", "power": 12e6},
        ],
    )
    assert found["generator_torque"][350] == 0.0 and found["generator_power"][990] > 18e6
    assert found["generator_power"][-1] == pytest.approx(12e6, rel=1e-3)
    assert found["rotor_speed"].max() < 1.1 * 0.75


@pytest.mark.long
@pytest.mark.parametrize(
    "settings",
    [
        {"scheme": "A1"},
        {"scheme": "A2", "density": "weather"},
        {"scheme": "A3", "torque": "tip_speed_ratio", "droop": {"reserve": 0.1}},
    ],
    ids=str,
)
def test_derivatives_are_those_of_differences(table: AnyTurbine, settings: dict[str, Any]) -> None:
    model, wind = meltemi.build(table), TurbulentWind(speed=11.0, intensity=0.06, seed=1, points=7)
    arguments: dict[str, Any] = {
        "duration": 40.0,
        "controller": control(table, **settings),
        "channels": ["rotor_speed", "pitch_1", "generator_torque", "wind_estimate"],
        "output_step": 0.1,
    }
    names = [f"controller.{name}" for name in ("frequency", "best_coefficient", "estimator_gain", "inertia")]
    exact = meltemi.analysis.sensitivity(meltemi.Run(model, wind, **arguments), names)
    exact.result.raise_for_status()
    moved = 0
    for i, name in enumerate(names):
        below, above, step = meltemi.analysis.finite_difference_runs(meltemi.Run(model, wind, **arguments), name)
        difference = (above.data - below.data) / (2.0 * step)
        size = np.sqrt(np.mean(exact.slopes[:, :, i] ** 2, axis=0))
        error = np.sqrt(np.mean((exact.slopes[:, :, i] - difference) ** 2, axis=0))
        assert np.all(error <= 1e-4 * size + 1e-9 * np.abs(exact.values[i]) ** -1), (name, error / size)
        moved += int(np.count_nonzero(size))
    assert moved >= 8


@pytest.mark.long
def test_lanes_are_floats_on_blades(turbine: meltemi.Turbine) -> None:
    options = meltemi.ModelOptions(
        flap_modes=1, edge_modes=1, torsion_modes=0, fore_aft_modes=1, side_side_modes=1, blade_nodes=12
    )
    model, controller = meltemi.build(turbine, options), control(turbine, scheme="A2", droop=Droop().content())
    found = []
    for numbers in ("lanes", "floats"):
        one = Simulation(
            Run(
                model,
                SteadyWind(speed=12.0, shear_exponent=0.2),
                duration=20.0,
                controller=controller,
                channels=CHANNELS,
                grid=PowerGrid(power_reference=3e6),  # type: ignore[arg-type]
            ),
            numbers=numbers,
        )
        march(one)
        found.append(one.result().data)
    scale = np.abs(found[1]).max(axis=0) + 1e-12
    assert np.all(np.abs(found[0] - found[1]) <= 1e-10 * scale)


@pytest.mark.long
def test_a_flexible_turbine_tracks_too(turbine: meltemi.Turbine) -> None:
    """The NREL 5 MW: the estimate in steady wind, no motion of its own with tracking, and 3 MW in turbulence."""
    model = meltemi.build(turbine)
    steady = run(model, SteadyWind(speed=8.0), 150.0, control(turbine, torque="tip_speed_ratio"))
    # blades that twist take 1 % of the wind that the rigid rotor's performance would need
    assert steady["wind_estimate"][-100:].mean() == pytest.approx(8.0, rel=0.015)
    assert steady["generator_power"][-300:].std() < 0.01 * steady["generator_power"][-300:].mean()
    wind = TurbulentWind(speed=12.0, intensity=0.1, seed=1, points=9)
    results = [
        run(model, wind, 300.0, control(turbine, scheme=scheme), grid=PowerGrid(power_reference=3e6))
        for scheme in ("A0", "A2")
    ]
    travel = [float(np.abs(np.diff(r["pitch_1"][500:])).sum()) for r in results]
    assert travel[1] < 0.8 * travel[0]
    for result in results:
        assert result["generator_power"][500:].mean() == pytest.approx(3e6, rel=0.01)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["iea15mw", pytest.param("iea22mw", marks=pytest.mark.long)])
def test_the_speed_loop_of_a_large_turbine_has_no_limit_cycle(name: str) -> None:
    """Steady wind after a step of it: with loops of 0.27 and 0.30 rad/s pitch oscillated by 7 and 13 deg."""
    turbine = meltemi.load_turbine(name)
    wind = meltemi.WindSeries(time=(20.0, 21.0), speed=12.0, gust=(0.0, 0.5))
    grid = PowerGrid(power_reference=turbine.rated_power)
    result = run(meltemi.build(turbine), wind, 180.0, control(turbine, scheme="A1"), grid=grid)
    assert np.ptp(result["pitch_1"][1500:]) < np.radians(0.2)
