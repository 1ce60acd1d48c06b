"""Pitch, yaw and torque under one controller."""

from __future__ import annotations

import math
from functools import cache
from typing import Any

import numpy as np
import pytest

import meltemi
from meltemi import InputError, ModelOptions, Result, SteadyWind, WindSeries
from meltemi.control_laws.load_control import HarmonicLoop, LoadControl, SpeedNotch
from meltemi.control_laws.yaw import YawControl
from meltemi.environment import PowerGrid
from meltemi.power_control.coordinated import CoordinatedController, Coordination
from meltemi.power_control.settings import PowerControl

CHANNELS = ("generator_power", "rotor_speed", "pitch_1", "pitch_2", "yaw_command", "yaw_threshold", "wind_estimate")
OWN = YawControl().dead_band
TURNING = np.arange(0.0, 801.0, 10.0)


@cache
def machine() -> Any:
    turbine = meltemi.load_turbine("pmsg20mw")
    return turbine, meltemi.build(turbine, ModelOptions(yaw="driven")), meltemi.analysis.performance_of(turbine)


def run(relief: Coordination | None, wind: Any, power: float, **given: Any) -> Result:
    turbine, model, performance = machine()
    law = CoordinatedController(turbine, performance, yaw=YawControl(), relief=relief, **given)
    grid = PowerGrid(power_reference=power)
    return meltemi.simulate(model, wind, duration=800.0, controller=law, grid=grid, channels=CHANNELS, output_step=0.5)


def turning(speed: float) -> WindSeries:
    """A direction that swings by 11 degrees, wider than the yaw control's own dead band."""
    return WindSeries(time=TURNING, speed=speed, direction=0.2 * np.sin(2.0 * np.pi * TURNING / 500.0))


def test_power_to_spare_lets_the_nacelle_rest_at_equal_energy() -> None:
    plain, relieved = (run(relief, turning(13.0), 12e6) for relief in (None, Coordination()))
    assert np.ptp(plain["yaw_command"]) > 0.1
    assert np.ptp(relieved["yaw_command"]) == 0.0
    assert relieved["generator_power"].mean() == pytest.approx(plain["generator_power"].mean(), rel=1e-3)


def test_without_power_to_spare_nothing_changes() -> None:
    plain, relieved = (run(relief, turning(8.0), 20e6) for relief in (None, Coordination()))
    assert np.ptp(plain["yaw_command"]) > 0.1
    np.testing.assert_array_equal(plain.data, relieved.data)


def test_the_band_is_where_the_power_asked_for_would_just_be_there() -> None:
    """C-92 in steady wind, where mean and estimate are the wind and nothing scatters."""
    turbine, _, performance = machine()
    speed, relief = 10.0, Coordination(widest_band=0.6, mean_time=20.0, caution=0.0)
    found = run(relief, SteadyWind(speed=speed), 15e6)
    estimate = found["wind_estimate"][-1]  # its table is read by straight lines
    assert estimate == pytest.approx(speed, rel=6e-3)
    area = math.pi * turbine.rotor_radius**2
    cosine = (15e6 / turbine.drivetrain.generator_efficiency / (0.5 * 1.225 * area * performance.power.max())) ** (
        1.0 / 3.0
    )
    cosine /= estimate
    assert OWN < math.acos(cosine) < 0.6
    assert found["yaw_threshold"][-1] == pytest.approx(math.acos(cosine), abs=1e-3)
    assert np.max(performance.power) == pytest.approx(0.48, rel=1e-4)


def test_the_band_has_its_limits_and_settings_change_it() -> None:
    wide, narrow = (run(Coordination(widest_band=w), SteadyWind(speed=14.0), 10e6) for w in (0.3, 0.2))
    assert wide["yaw_threshold"][-1] == pytest.approx(0.3)
    assert narrow["yaw_threshold"][-1] == pytest.approx(0.2)
    swing = WindSeries(time=TURNING, speed=10.5 + np.sin(TURNING / 20.0))
    bold, shy = (run(Coordination(caution=c, widest_band=0.6), swing, 12e6)["yaw_threshold"][-1] for c in (0.0, 2.0))
    assert bold > shy + 0.05 > OWN + 0.05


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"relief": Coordination()}, "needs yaw"),
        ({"yaw": YawControl(dead_band=0.3), "relief": Coordination()}, "widest_band.*not more than the dead_band"),
        ({"load": LoadControl()}, "does not have"),
    ],
)
def test_contradictions_are_refused(given: dict[str, Any], message: str) -> None:
    turbine, _, performance = machine()
    with pytest.raises(InputError, match=message):
        CoordinatedController(turbine, performance, **given)


def test_a_notch_belongs_to_the_law_that_is_replaced() -> None:
    turbine, _, performance = machine()
    with pytest.raises(InputError, match="notch and preview"):
        CoordinatedController(
            meltemi.load_turbine("nrel5mw"),
            performance,
            load=LoadControl(notch=SpeedNotch(frequency=10.0, damping=0.2)),
        )
    assert turbine.name


@pytest.mark.long  # compiles the aeroelastic engine twice
def test_individual_pitch_and_numbers_on_an_aeroelastic_turbine() -> None:
    """Blades move by themselves, lanes are floats, and derivatives are limits of differences."""
    turbine = meltemi.load_turbine("nrel5mw")
    model = meltemi.build(turbine, ModelOptions(yaw="driven", torsion_modes=0))
    loop = HarmonicLoop(harmonic=1, actuator="pitch", integral_gain=1e-9)
    law = CoordinatedController(
        turbine,
        meltemi.analysis.performance_of(turbine),
        power=PowerControl(density="weather"),
        yaw=YawControl(start_time=1.0),
        relief=Coordination(mean_time=10.0),
        load=LoadControl(loops=(loop,)),
    )
    grid = PowerGrid(power_reference=3e6)
    wind = WindSeries(time=[0.0, 10.0, 20.0], speed=[13.0, 14.0, 13.0], direction=[0.0, 0.3, 0.3], exponent=0.2)
    channels = ("generator_power", "pitch_1", "pitch_2", "root_moment_out_of_plane_1", "yaw_threshold")
    given: dict[str, Any] = {"duration": 20.0, "channels": channels, "controller": law, "grid": grid}
    lanes = meltemi.simulate(model, wind, **given)
    assert np.abs(lanes["pitch_1"] - lanes["pitch_2"]).max() > 1e-3
    floats = meltemi.Simulation(meltemi.Run(model, wind, **given), numbers="floats")
    floats.advance(10**6)
    np.testing.assert_allclose(lanes.data, floats.result().data, rtol=0.0, atol=1e-9 * np.abs(lanes.data).max())
    names = ["controller.frequency", "controller.coordination_caution", "aerodynamics.air_density"]
    found = meltemi.analysis.sensitivity(meltemi.Run(model, wind, **given), names)
    for number, name in enumerate(names):
        low, high, step = meltemi.analysis.finite_difference_runs(
            meltemi.Run(model, wind, **given), name, step=1e-5 * abs(found.values[number])
        )
        change, exact = (high.data - low.data) / (2.0 * step), found.slopes[..., number]
        size = np.maximum(np.abs(exact).max(axis=0), 1e-12)
        assert np.all(np.abs(change - exact).max(axis=0) / size < 1e-4), name


@pytest.mark.slow
def test_a_reference_is_one_of_power_into_the_grid() -> None:
    """C-86b: losses of machine, converters and filter are added to what the shaft has to give."""
    turbine, _, performance = machine()
    law = meltemi.control.PowerController(turbine, performance)
    found = {}
    for electrical in ("ideal", "averaged"):
        model = meltemi.build(turbine, ModelOptions(electrical=electrical))
        grid = PowerGrid(power_reference=12e6)
        channels = ("generator_power", "generator_torque", "rotor_speed")
        run = {"duration": 120.0, "controller": law, "grid": grid, "channels": channels, "output_step": 0.5}
        found[electrical] = meltemi.simulate(model, SteadyWind(speed=11.0), **run)
        assert found[electrical]["generator_power"][-1] == pytest.approx(12e6, rel=1e-3)
    shaft = found["averaged"]["generator_torque"][-1] * found["averaged"]["rotor_speed"][-1]
    assert shaft > 1.02 * 12e6
