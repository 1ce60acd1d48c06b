"""Weather in runs: loads follow the density, rain adds the drag of its drops."""

from __future__ import annotations

import numpy as np
import pytest

import meltemi
from meltemi import Environment, InputError, Model, ModelOptions, SteadyWind, Turbine
from meltemi.aero.tables import AeroNode, PolarPoint
from meltemi.environment import Air, Rain, TimeSeries, air_density, drops
from meltemi.simulation.rain import drag_of_drops

WIND = SteadyWind(speed=8.0)


def test_constant_air_is_its_density_to_the_bit(turbine: Turbine) -> None:
    """A run in air of a weather, and one at the density of that weather."""
    air = Air(temperature=31.0, humidity=0.7, altitude=420.0)
    density = float(air_density(31.0, 0.7, 420.0))
    runs = [
        meltemi.simulate(meltemi.build(turbine, environment=environment), WIND, duration=1.0)
        for environment in (Environment(air=air), Environment(air_density=density))
    ]
    assert np.array_equal(runs[0].data, runs[1].data)


def test_forces_follow_the_density_at_a_jump(turbine: Turbine) -> None:
    """Within the step of the jump flow and motion are the same, so thrust and torque change as the density does."""
    air = Air(temperature=TimeSeries(time=[0.0, 1.0, 1.0], value=[40.0, 40.0, -10.0]))
    channels = ["air_density", "air_temperature", "rotor_aero_thrust", "rotor_aero_torque", "generator_power"]
    run = meltemi.simulate(
        meltemi.build(turbine, environment=Environment(air=air)),
        WIND,
        duration=1.2,
        channels=channels,
        output_step=0.01,
    )
    before, after = int(np.flatnonzero(run.time < 1.0 - 1e-9)[-1]), int(np.flatnonzero(run.time > 1.0 - 1e-9)[0])
    cold, hot = (float(air_density(t)) for t in (-10.0, 40.0))
    assert run["air_density"][[before, after]] == pytest.approx([hot, cold], rel=1e-12)
    assert run["air_temperature"][after] == pytest.approx(263.15)
    for name in ("rotor_aero_thrust", "rotor_aero_torque"):
        assert run[name][after] / run[name][before] == pytest.approx(cold / hot, rel=3e-3)


def test_rain_is_in_the_polars_and_nowhere_else(turbine: Turbine, model: Model) -> None:
    rain = Rain(kind="rainstorm")
    wet = meltemi.build(turbine, environment=Environment(rain=rain))
    content = float(drops.water_content(rain.intensity, rain.water_density, 0.0, np.inf))
    grid = np.linspace(-np.pi, np.pi, model.rotor.polars.shape[1])
    more = wet.rotor.polars - model.rotor.polars
    tip = int(model.rotor.aero_nodes[AeroNode.index("polar"), 0, -1])
    assert more[tip, :, PolarPoint.index("drag")] == pytest.approx(
        drag_of_drops(content / 1.225, 0.18, grid), abs=1e-15
    )
    others = [i for i in range(more.shape[2]) if i != PolarPoint.index("drag")]
    assert not more[:, :, others].any()
    assert np.all(more[:, :, PolarPoint.index("drag")] > 0.0)


def test_rain_needs_a_thickness(turbine: Turbine) -> None:
    foils = turbine.airfoils
    names = tuple("tip" if name == "naca64" else name for name in turbine.blade.aerodynamics.airfoil)
    renamed = turbine.replace(
        **{
            "airfoils": {("tip" if name == "naca64" else name): foil.content() for name, foil in foils.items()},
            "blade.aerodynamics.airfoil": names,
        }
    )
    meltemi.build(renamed)
    with pytest.raises(InputError, match="airfoils.tip: relative_thickness is missing"):
        meltemi.build(renamed, environment=Environment(rain=Rain(rate=10.0)))


def test_blades_refuse_what_only_the_formula_takes(turbine: Turbine) -> None:
    """Rather than to leave it without effect."""
    for given in ({"half_thickness": 2.0}, {"tail_wind": 3.0}):
        rain = Rain.model_validate({"kind": "heavy", **given})
        with pytest.raises(InputError, match=rf"environment.rain.{next(iter(given))}: no effect on nrel5mw"):
            meltemi.build(turbine, environment=Environment(rain=rain))


RIGID = ModelOptions(locked=("tower", "yaw", "blades", "drivetrain"), stall="static", tower_influence="none")


@pytest.mark.long
def test_drag_in_the_engine_is_the_loss_of_the_elements(turbine: Turbine) -> None:
    """Polars in the rain cost the power, at the same speed and pitch, that drops cost which elements take along."""
    from meltemi.studies.rain_drops import rain_loads

    rain = Rain(kind="heavy_rainstorm_moderate")
    dry = meltemi.operating_point(meltemi.build(turbine, RIGID), 10.0)
    model = meltemi.build(turbine, RIGID, Environment(rain=rain))
    wet = meltemi.operating_point(model, 10.0, rotor_speed=dry.rotor_speed, pitch=dry.pitch)
    lost = (dry["rotor_aero_torque"] - wet["rotor_aero_torque"]) * dry.rotor_speed
    assert lost == pytest.approx(rain_loads(turbine, rain, 10.0, dry.rotor_speed, dry.pitch).power, rel=0.01)


@pytest.mark.long
def test_linear_models_know_the_density(turbine: Turbine) -> None:
    """The torque of a rigid rotor at one speed and pitch, and so its derivative by the wind, goes with the density."""
    found = []
    for temperature in (-10.0, 40.0):
        model = meltemi.build(turbine, RIGID, Environment(air=Air(temperature=temperature)))
        point = meltemi.operating_point(model, 8.0, rotor_speed=0.95, pitch=0.0)
        linear = meltemi.analysis.linearise(model, point, ("wind_speed",), ("rotor_aero_torque",))
        found.append(linear.D[0, 0])
    assert found[0] / found[1] == pytest.approx(float(air_density(-10.0) / air_density(40.0)), rel=1e-6)


@pytest.mark.long
def test_derivatives_in_air_of_a_weather(turbine: Turbine) -> None:
    """The same numbers as at the density of that weather, and unharmed by one that changes."""
    parameters = ["controller.gain_halving_pitch", "structure.hub_mass"]
    gust = SteadyWind(speed=14.0)
    by_air, by_density, changing = (
        meltemi.analysis.sensitivity(
            meltemi.Run(meltemi.build(turbine, environment=each), gust, duration=2.0), parameters
        )
        for each in (
            Environment(air=Air(temperature=30.0)),
            Environment(air_density=float(air_density(30.0))),
            Environment(air=Air(temperature=TimeSeries(time=[0.0, 2.0], value=[30.0, 30.0 + 1e-9]))),
        )
    )
    assert np.array_equal(by_air.slopes, by_density.slopes)
    scale = np.abs(by_density.slopes).max(axis=0)
    assert np.all(np.abs(changing.slopes - by_density.slopes) <= 1e-6 * scale)
