"""The supervised turbine in the wind: starts, stops, faults, idling; every run is stable and its log as expected."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import meltemi
from meltemi import InputError, Model, Result, Start, SteadyWind, WindSeries
from meltemi.cases.case import case_controller, case_start
from meltemi.control import HarmonicLoop, LoadControl, SupervisedController, Supervision, YawControl, YawProtection
from meltemi.control.controller import Controller, StartPoint
from meltemi.control_laws.moving_mean import mean_start, moving_mean
from meltemi.gradients.sensitivity import finite_difference_runs, sensitivity
from meltemi.iec.models import iec_wind
from meltemi.io import read_case
from meltemi.simulation.run import Run
from meltemi.supervisor.settings import limits
from meltemi.supervisor.supervised import SupervisedState
from meltemi.wind.fields import mean_before

RPM = 30.0 / math.pi
RATED = 12.1
"""[rpm] of the rotor."""
FEATHERED = Start(rotor_speed=0.0, pitch=math.pi / 2)
CHANNELS = (
    "rotor_speed generator_power generator_torque pitch_1 pitch_2 pitch_3 operating_state power_setpoint TwrBsMyt "
    "RootMyc1 yaw_error"
).split()


def run(
    model: Model,
    wind: Any,
    duration: float,
    controller: Controller,
    start: Start | None = None,
    events: Sequence[dict[str, Any]] = (),
) -> Result:
    result = meltemi.simulate(
        model, wind, duration=duration, controller=controller, start=start, channels=CHANNELS, events=events
    )
    result.raise_for_status()
    assert np.all(np.isfinite(result.data))
    return result


def whats(result: Result) -> list[str]:
    return [entry.what for entry in result.log if entry.source == "supervisor"]


def peak(result: Result) -> float:
    """Highest rotor speed over the rated one."""
    return float(result["rotor_speed"].max() * RPM / RATED)


def series(time: list[float], speed: list[float]) -> WindSeries:
    t = np.arange(time[0], time[-1] + 1.0)
    v, z = np.interp(t, time, speed), np.zeros(len(t))
    return WindSeries(
        time=t, speed=v, direction=z, vertical=z, horizontal_shear=z, exponent=z + 0.2, vertical_shear=z, gust=z
    )


@pytest.mark.slow
@pytest.mark.parametrize("loops", [(), (HarmonicLoop(harmonic=1, integral_gain=1e-9),)], ids=["law", "loops"])
def test_production_is_load_control_to_the_bit(model: Model, loops: Any) -> None:
    load = LoadControl(loops=loops)
    wind = meltemi.wind.generate_field(
        meltemi.TurbulentWind(speed=12.0, intensity=0.15, seed=3, points=7), model.turbine, 30.0
    )
    one = run(model, wind, 25.0, meltemi.control.LoadController(model.turbine, load))
    other = run(model, wind, 25.0, SupervisedController(model.turbine, load=load, protection=YawProtection()))
    for name in ("rotor_speed", "generator_torque", "pitch_1", "TwrBsMyt", "RootMyc1"):
        assert np.array_equal(one[name], other[name])
    assert other.log == ()
    assert other["operating_state"].min() >= 4.0


@pytest.mark.slow
def test_start_from_standstill(model: Model) -> None:
    """To the operation of a run that begins near it, without much overshoot.

    Not to the operating point: at 8 m/s it has one blade in another state of the flow near its root, 0.8 % in speed.
    """
    result = run(model, SteadyWind(speed=8.0), 160.0, SupervisedController(model.turbine), FEATHERED)
    assert whats(result) == ["standby -> start up", "start up -> connection", "connection -> maximum power"]
    begin = Start(rotor_speed=0.95, generator_torque=2e4)
    steady = run(model, SteadyWind(speed=8.0), 100.0, meltemi.control.BaselineController(model.turbine), begin)[
        "rotor_speed"
    ][-1]
    assert result["rotor_speed"][-1] == pytest.approx(steady, rel=2e-3)
    assert result["rotor_speed"].max() < 1.09 * steady
    assert result["TwrBsMyt"].max() < 60e6


@pytest.mark.slow
@pytest.mark.parametrize("speed", [11.4, 24.0])
def test_grid_loss(model: Model, speed: float) -> None:
    """No torque from the instant on; over-speed stays below 10 %, and the turbine comes back when the grid does."""
    loss = {"at": 20.0, "type": "grid_loss", "until": 40.0}
    wind = SteadyWind(speed=speed, shear_exponent=0.2)
    result = run(model, wind, 80.0, SupervisedController(model.turbine), events=[loss])
    assert whats(result)[1] == "emergency stop -> idling"
    first = next(entry for entry in result.log if entry.source == "supervisor")
    assert first.time == pytest.approx(20.0, abs=0.03)
    assert first.reason == "the grid is lost"
    gone = result.between(20.05, 39.9)
    assert np.all(gone["generator_torque"] == 0.0)
    assert peak(result) < 1.10
    assert result.between(35.0, 40.0)["pitch_1"].min() == pytest.approx(math.pi / 2, abs=0.01)
    assert ("idling -> standby" in whats(result)) is (speed < 22.0)


@pytest.mark.slow
@pytest.mark.parametrize("speed", [11.4, 24.0])
@pytest.mark.parametrize("word", ["normal_stop", "emergency_stop"])
def test_operators_stops(model: Model, speed: float, word: str) -> None:
    request = {"at": 20.0, "type": "request", "request": word}
    wind = SteadyWind(speed=speed, shear_exponent=0.2)
    result = run(model, wind, 90.0, SupervisedController(model.turbine), events=[request])
    kind = word.replace("_", " ")
    assert whats(result)[-2].endswith(f"-> {kind}")
    assert whats(result)[-1] == f"{kind} -> idling"
    assert peak(result) < 1.02
    assert abs(result["rotor_speed"][-1]) * RPM < 0.5
    assert result["TwrBsMyt"].min() > (-40e6 if word == "normal_stop" else -80e6)


@pytest.mark.slow
def test_cut_out_and_restart(model: Model) -> None:
    wind = series([0.0, 60.0, 160.0, 300.0, 400.0, 560.0], [20.0, 20.0, 31.0, 31.0, 12.0, 12.0])
    result = run(model, wind, 560.0, SupervisedController(model.turbine))
    assert whats(result)[:6] == [
        "power limit -> normal stop",
        "normal stop -> idling",
        "idling -> standby",
        "standby -> start up",
        "start up -> connection",
        "connection -> maximum power",
    ]
    assert next(e for e in result.log if e.source != "wind").reason == "wind of 30.0 m/s above 30.0 m/s"
    assert peak(result) < 1.05
    assert result["generator_power"][-1] == pytest.approx(5e6, rel=0.01)


@pytest.mark.slow
@pytest.mark.parametrize("speed", [15.0, 9.0])
def test_derating_and_back(model: Model, speed: float) -> None:
    limit = 2e6 if speed > 11.0 else 1e6
    event = {"at": 20.0, "type": "power_limit", "power": limit, "until": 80.0}
    wind = SteadyWind(speed=speed, shear_exponent=0.2)
    result = run(model, wind, 180.0, SupervisedController(model.turbine), events=[event])
    assert result.between(60.0, 79.0)["generator_power"].mean() == pytest.approx(limit, rel=0.005)
    before, after = result.between(10.0, 20.0), result.between(165.0, 180.0)
    assert after["generator_power"].mean() == pytest.approx(before["generator_power"].mean(), rel=0.005)
    assert peak(result) < 1.06
    assert np.abs(np.diff(result["generator_torque"])).max() < 0.05 * 15000.0 * 1.01  # N m in 0.05 s


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["ideal", "second_order"])
@pytest.mark.parametrize("speed", [11.4, 24.0])
def test_one_blade_stuck(model: Model, speed: float, kind: str) -> None:
    """Noticed where the pitch has to move, else when the turbine is to stop; the other blades stop the rotor."""
    own = meltemi.build(model.turbine.replace(**{"pitch_actuator.kind": kind}))
    wind = meltemi.TurbulentWind(speed=speed, intensity=0.14, seed=2, points=9)
    stuck = {"at": 20.0, "type": "pitch_stuck", "blade": 2}
    request = {"at": 70.0, "type": "request", "request": "emergency_stop"}
    result = run(own, wind, 120.0, SupervisedController(own.turbine), events=[stuck, request])
    assert any("emergency stop" in what for what in whats(result))
    assert any(entry.reason.startswith("a blade is") for entry in result.log) is (speed > 20.0)
    assert peak(result) < 1.12
    late = result.between(90.0, 120.0)
    assert np.abs(late["rotor_speed"]).max() * RPM < 0.5 * RATED
    assert late["pitch_2"].std() < 1e-9
    assert late["pitch_1"].min() == pytest.approx(math.pi / 2, abs=0.01)


@pytest.mark.slow
@pytest.mark.parametrize("holds", ["last", "zero"])
@pytest.mark.parametrize("sensor", ["generator_speed", "rotor_speed"])
def test_a_lost_sensor_of_speed_stops_the_turbine(model: Model, sensor: str, holds: str) -> None:
    loss = {"at": 20.0, "type": "sensor_loss", "sensor": sensor, "holds": holds}
    wind = meltemi.TurbulentWind(speed=14.0, intensity=0.14, seed=2, points=7)
    result = run(model, wind, 60.0, SupervisedController(model.turbine), events=[loss])
    assert any("emergency stop" in what for what in whats(result))
    assert peak(result) < 1.2
    assert abs(result["rotor_speed"][-1]) * RPM < 1.0


@pytest.mark.slow
@pytest.mark.parametrize("degrees", [-8.0, 8.0])
def test_idling_in_wind_of_fifty_years(model: Model, degrees: float) -> None:
    wind = SteadyWind(speed=1.4 * 37.5, shear_exponent=0.11, direction=math.radians(degrees))
    result = run(model, wind, 120.0, SupervisedController(model.turbine, Supervision(begin="idling")), FEATHERED)
    assert result.log == ()
    assert np.abs(result["rotor_speed"]).max() * RPM < 1.0
    late = result.between(60.0, 120.0)
    assert late["RootMyc1"].std() < 1.5e6
    assert late["TwrBsMyt"].std() < result.between(0.0, 60.0)["TwrBsMyt"].std()  # what the begin excited decays


@pytest.mark.slow
def test_strategies_in_a_gust_with_change_of_direction(model: Model) -> None:
    """Wang et al. (2021), Fig. 10 in words: stop, derate and ignore, here of the 5 MW turbine."""
    turbine = model.turbine.replace(**{"yaw.rate": math.radians(0.5)})
    driven = meltemi.build(turbine, meltemi.ModelOptions(yaw="driven"))
    found = {}
    for strategy in ("stop", "derate", "ignore"):
        law = SupervisedController(turbine, yaw=YawControl(), protection=YawProtection(strategy=strategy))
        found[strategy] = run(driven, meltemi.wind.ecd(turbine, 10.67, begin=10.0), 90.0, law)
    for strategy, what in (("stop", "normal -> shutdown"), ("derate", "normal -> derated")):
        (first, *_) = [entry for entry in found[strategy].log if entry.source == "yaw protection"]
        assert first.what == what
        assert 16.0 < first.time < 18.5
    assert {entry.source for entry in found["ignore"].log} == {"supervisor", "wind"}
    assert abs(found["stop"]["generator_power"][-1]) < 1e4
    late = found["derate"].between(60.0, 90.0)
    assert late["generator_power"].mean() == pytest.approx(5e6 * 2.0 / 3.0, rel=0.02)


@pytest.mark.long
def test_derivatives_go_through_the_supervisor(model: Model) -> None:
    """Derated production in turbulence: those of duals are those of central differences.

    The ramp must not end on a sample: there the derivative by its rate has two values.
    """
    wind = meltemi.wind.generate_field(
        meltemi.TurbulentWind(speed=20.0, intensity=0.14, seed=3, points=7), model.turbine, 12.0
    )
    law = SupervisedController(model.turbine, protection=YawProtection())
    arguments: dict[str, Any] = {"duration": 12.0, "controller": law}
    arguments["events"] = [{"at": 2.0, "type": "power_limit", "power": 3.7137e6}]
    names = ["controller.supervisor_derate_rate", "controller.proportional_gain"]
    channels = ["pitch_1", "generator_torque", "rotor_speed"]
    found = sensitivity(Run(model, wind, channels=channels, **arguments), names)
    for number, name in enumerate(names):
        step = 1e-6 * abs(found.values[number])
        low, high, step = finite_difference_runs(
            Run(model=model, wind=wind, channels=channels, **arguments), parameter=name, step=step
        )
        for channel in channels:
            exact = found.series(channel)[1][:, number]
            change = (high[channel] - low[channel]) / (2.0 * step)
            assert np.abs(exact).max() > 0.0
            assert np.abs(exact - change).max() < 1e-5 * np.abs(change).max(), (name, channel)


# case files ----------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_starts_of_cases(model: Model, supervised_case: str, tmp_path: Path) -> None:
    path = tmp_path / "case.yaml"
    for words, state, speed in (("standstill", 1, 0.0), ("idling", 9, 0.0), ("operating", 4, None)):
        path.write_text(supervised_case.replace("standstill", words), encoding="utf-8")
        case = read_case(path)
        law, start = case_controller(case, model, tmp_path), case_start(case, model.turbine)
        assert (start is None) == (speed is None)
        result = meltemi.simulate(
            model, SteadyWind(speed=8.0), duration=0.1, controller=law, start=start, channels=["operating_state"]
        )
        assert result["operating_state"][0] == state


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("kind: supervised", "kind: baseline", "start: standstill needs a controller that can start"),
        ("standstill", "standing", "standstill"),
        ("[0, 30]", "[30, 0]", "wind_speeds must increase"),
        ("[0.8, 0.6]", "[0.6, 0.8]", "must not rise with the wind"),
        ("start_time: 5.0", "start_tim: 5.0", "start_time"),
    ],
)
def test_cases_that_are_refused(supervised_case: str, tmp_path: Path, old: str, new: str, words: str) -> None:
    path = tmp_path / "case.yaml"
    text = supervised_case.replace(old, new)
    if new == "kind: baseline":
        text = text[: text.index("  supervision")]
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=words):
        read_case(path)


@pytest.mark.parametrize("seed", [1, 3])
def test_an_emergency_stop_at_cut_out_finds_production(model: Model, seed: int) -> None:
    """The means began with the size of the wind, 25.2 m/s, and the turbine stopped in its first step."""
    wind = iec_wind(turbine=model.turbine, model="NTM", wind_class="IA", speed=25.0, seed=seed, points=5)
    events = [{"at": 8.0, "type": "request", "request": "emergency_stop"}]
    result = run(model, wind, 10.0, SupervisedController(model.turbine), events=events)
    assert whats(result) == ["power limit -> emergency stop"]
    assert result.warnings == ()


def test_means_begin_with_the_mean_wind_of_the_case(model: Model) -> None:
    wind = iec_wind(turbine=model.turbine, model="NTM", wind_class="IA", speed=25.0, seed=1, points=5)
    box = meltemi.wind.generate_field(wind, model.turbine, 600.0)
    assert mean_before(box, model.turbine.hub_height) == pytest.approx(25.0, abs=0.01)
    measured = series([0.0, 1.0, 2.0, 3.0], [9.0, 11.0, 9.0, 11.0])
    assert mean_before(measured, 90.0) == pytest.approx(10.0)  # not what it has at first
    assert mean_before(series([0.0, 20.0, 30.0], [10.0, 10.0, 25.0]), 90.0) == 10.0  # a change that comes later
    start = StartPoint(26.0, 122.9, 0.3, 4e4, 24.0)
    protection = YawProtection(window=30.0)
    x = SupervisedState(SupervisedController(model.turbine, protection=protection).initial_state(start))
    for mean in (x.gust_mean, x.wind_mean, x.long_mean, x.protection_mean):
        assert moving_mean(mean, 24.0, 0.0125) == pytest.approx(24.0)


def test_ten_minutes_of_normal_turbulence_at_cut_out_are_no_storm(model: Model) -> None:
    """Means of what the anemometer has, as the supervisor makes them, against its limits."""
    wind = iec_wind(turbine=model.turbine, model="NTM", wind_class="IA", speed=25.0, seed=3, points=5)
    box = meltemi.wind.generate_field(wind, model.turbine, 700.0)
    size = np.hypot(*np.moveaxis(box.velocity[:, 2, 2, :2].astype(float), -1, 0))
    x = mean_start(600.0, 600, before=mean_before(box, model.turbine.hub_height))
    most = max(moving_mean(x, float(u), box.dt) for u in size)
    assert 25.0 < most < limits(model.turbine, Supervision())["cut_out_mean"]


def test_an_event_out_of_place_warns(model: Model) -> None:
    storm = SteadyWind(speed=26.5)
    stop = {"at": 1.0, "type": "request", "request": "emergency_stop"}
    late = run(model, storm, 2.0, SupervisedController(model.turbine), events=[stop])
    assert late.log[0].what == "power limit -> normal stop"
    (words,) = late.warnings
    assert words.startswith("events.0: request emergency stop at 1 s occurred in state 'normal stop'")
    assert "mean wind of 26.5 m/s above 26.0 m/s" in words
    assert words in repr(late)
    idle = SupervisedController(model.turbine, Supervision(begin="idling"))
    (words,) = run(model, SteadyWind(speed=8.0), 2.0, idle, FEATHERED, [stop]).warnings
    assert words.endswith("occurred in state 'idling'")
    start = {"at": 1.0, "type": "request", "request": "start"}
    assert (
        "'maximum power'"
        in run(model, SteadyWind(speed=8.0), 2.0, SupervisedController(model.turbine), None, [start]).warnings[0]
    )
    usual = [{"at": 0.5, "type": "grid_loss"}, {"at": 1.0, "type": "pitch_stuck", "blade": 1}]
    assert run(model, SteadyWind(speed=8.0), 2.0, SupervisedController(model.turbine), None, usual).warnings == ()
    deaf = meltemi.simulate(model, SteadyWind(speed=8.0), duration=2.0, channels=CHANNELS, events=[stop])
    assert "the baseline controller ignores operator requests" in deaf.warnings[0]
