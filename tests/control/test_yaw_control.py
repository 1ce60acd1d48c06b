"""The yaw control: signs, filters, start and stop, and every setting."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import meltemi
from meltemi import InputError, Model, ModelOptions, SteadyWind, Turbine
from meltemi.cases.case import case_controller, read_case
from meltemi.control import YawControl, YawController
from meltemi.control import signals as s
from meltemi.control_laws import yaw
from meltemi.turbine.definition import Yaw

Float = NDArray[np.float64]
DRIVE = Yaw(stiffness=9e9, damping=2e7, rate=math.radians(0.5))
DT = 0.1
FILTERED, AVERAGED = (yaw.YawControlState.index(name) for name in ("filtered", "averaged"))
QUICK = {"average_time": 0.0, "start_time": 0.0}


def march(direction: Any, seconds: float, speed: float = 10.0, drive: Yaw = DRIVE, **settings: Any) -> tuple[Any, ...]:
    """Nacelle (ideal drive) [rad], states, and demanded rates under a wind direction [rad], a number or of the time."""
    x, measured = yaw.yaw_settings(YawControl(**settings), drive), s.Measurements.of(wind_speed=speed)
    nacelle, rates, states = [0.0], [], []
    for k in range(round(seconds / DT)):
        measured.yaw = nacelle[-1]
        measured.wind_direction = direction(k * DT) if callable(direction) else direction
        rates.append(yaw.yaw_step(x, measured, DT))
        states.append(x.array.copy())
        nacelle.append(nacelle[-1] + rates[-1] * DT)
    return np.array(nacelle), np.array(states), np.array(rates)


def deg(value: float) -> float:
    return math.radians(value)


@pytest.mark.parametrize(
    ("direction", "nacelle", "error"), [(10, 0, 10), (0, 10, 10), (170, 20, -170), (-170, -20, 170), (180, 0, 180)]
)
def test_the_error_is_wind_minus_nacelle_clockwise(direction: float, nacelle: float, error: float) -> None:
    measured = s.Measurements.of(wind_direction=deg(direction), yaw=deg(nacelle))
    assert yaw.yaw_error(measured) == pytest.approx(deg(error), abs=1e-12)


@pytest.mark.parametrize("error", [20.0, -20.0, 170.0, -170.0])
def test_the_drive_turns_the_short_way_to_the_stop_band(error: float) -> None:
    nacelle, _, rates = march(deg(error), 400.0, **QUICK)
    assert nacelle[-1] == pytest.approx(-deg(error) + math.copysign(deg(0.5), error), abs=deg(0.06))
    assert set(np.round(np.unique(rates) * 1e6)) <= {0.0, round(-math.copysign(DRIVE.rate, error) * 1e6)}


def test_nothing_happens_within_the_dead_band() -> None:
    assert not march(deg(7.9), 100.0, **QUICK)[2].any()
    assert march(deg(8.1), 100.0, **QUICK)[2].any()


def test_the_drive_waits_for_the_start_time_and_forgets_when_the_error_goes_back() -> None:
    def gust(t: float) -> float:
        return deg(12.0) if 5.0 <= t < 12.0 or t >= 20.0 else 0.0

    rates = march(gust, 40.0, average_time=0.0, start_time=10.0)[2]
    first = np.flatnonzero(rates)[0] * DT
    assert first == pytest.approx(30.0, abs=2.1 * DT)


def test_the_average_is_of_the_wind_alone() -> None:
    """In a constant wind it is the error itself, however the nacelle turns, so the drive does not overshoot."""
    nacelle, states, _ = march(deg(40.0), 200.0, average_time=60.0)
    np.testing.assert_allclose(states[:, AVERAGED], deg(40.0) + nacelle[:-1], atol=1e-12)
    assert nacelle.min() > -deg(40.0)


@pytest.mark.parametrize(("name", "row"), [("filter_time", FILTERED), ("average_time", AVERAGED)])
def test_a_step_of_direction_is_followed_exponentially(name: str, row: int) -> None:
    settings = {"average_time": 30.0, "filter_time": 1.0, "start_time": 1e9} | {name: 7.0}
    states = march(lambda t: deg(10.0) if t > 0.0 else 0.0, 30.0, **settings)[1]
    t = DT * np.arange(len(states))
    np.testing.assert_allclose(states[:, row], deg(10.0) * (1.0 - np.exp(-t / 7.0)), atol=1e-12)


def test_the_filters_cross_the_back_without_a_turn() -> None:
    states = march(lambda t: deg(175.0) if t < 5.0 else deg(-175.0), 60.0, average_time=5.0, start_time=1e9)[1]
    for row in (FILTERED, AVERAGED):
        assert np.abs(states[:, row]).min() > deg(174.9)
        assert states[-1, row] == pytest.approx(deg(-175.0), abs=1e-4)


def test_it_starts_from_the_first_error_or_from_the_one_given() -> None:
    x, measured = yaw.yaw_settings(YawControl(), DRIVE), s.Measurements.of(wind_direction=0.3)
    yaw.yaw_step(x, measured, DT)
    assert (x.filtered, x.averaged) == pytest.approx((0.3, 0.3), abs=1e-12)
    yaw.yaw_start(x, -0.1)
    yaw.yaw_step(x, measured, DT)
    share = 1.0 - math.exp(-DT / 30.0)
    assert x.averaged == pytest.approx(-0.1 + share * 0.4, abs=1e-12)


def test_a_bias_leaves_the_nacelle_aside() -> None:
    straight, biased = (march(deg(20.0), 200.0, bias=bias, **QUICK)[0][-1] for bias in (0.0, deg(5.0)))
    assert biased - straight == pytest.approx(-deg(5.0), abs=deg(0.06))


def test_noise_has_its_deviation_and_seed() -> None:
    settings = {"noise": deg(2.0), "filter_time": 0.0, "start_time": 1e9}
    one, again, other = (march(0.1, 300.0, seed=seed, **settings)[1][:, FILTERED] for seed in (1, 1, 2))
    np.testing.assert_array_equal(one, again)
    assert abs(np.corrcoef(one, other)[0, 1]) < 0.1
    assert one.std() == pytest.approx(deg(2.0), rel=0.05)
    assert one.mean() == pytest.approx(0.1, abs=0.003)


def test_it_rests_in_little_wind() -> None:
    assert not march(0.5, 60.0, speed=2.4, **QUICK)[2].any()
    assert march(0.5, 60.0, speed=2.4, minimum_wind=2.0, **QUICK)[2].any()


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_cables_are_not_twisted_beyond_the_limit_but_untwisted(way: float) -> None:
    nacelle = march(lambda t: way * (0.8 if t < 200.0 else -0.2), 500.0, twist_limit=0.5, **QUICK)[0]
    assert np.abs(nacelle).max() == pytest.approx(0.5, abs=DRIVE.rate * DT * 1.01)
    assert nacelle[-1] == pytest.approx(way * 0.2, abs=deg(0.6))


def test_the_rate_is_the_drives_or_less() -> None:
    assert np.abs(march(0.5, 20.0, **QUICK)[2]).max() == DRIVE.rate
    assert np.abs(march(0.5, 20.0, rate=0.001, **QUICK)[2]).max() == 0.001


def test_it_stops_the_earlier_the_longer_the_drive_brakes() -> None:
    slow = DRIVE.replace(acceleration=2e-3)
    angle = DRIVE.rate**2 / (2.0 * 2e-3)
    ahead = march(0.5, 200.0, drive=slow, **QUICK)[0][-1] - march(0.5, 200.0, **QUICK)[0][-1]
    assert ahead == pytest.approx(angle, abs=1.1 * DRIVE.rate * DT)


def test_settings_that_cannot_work_are_refused() -> None:
    with pytest.raises(InputError, match="rate 0.1 rad/s is more than"):
        yaw.yaw_settings(YawControl(rate=0.1), DRIVE)
    with pytest.raises(InputError, match="less than the dead_band"):
        yaw.yaw_settings(YawControl(stop_band=0.2), DRIVE)
    with pytest.raises(InputError, match="in which it brakes"):
        yaw.yaw_settings(YawControl(dead_band=0.02), DRIVE.replace(acceleration=2e-3))


# in a run -----------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_a_turbine_turns_into_the_wind(turbine: Turbine) -> None:
    model = meltemi.build(turbine.replace(**{"yaw.rate": 0.01}), ModelOptions(yaw="driven"))
    controller = YawController(model.turbine, YawControl(average_time=5.0, start_time=2.0))
    wind = SteadyWind(speed=10.0, direction=0.3)
    channels = ["nacelle_yaw", "yaw_error", "yaw_threshold", "GenPwr"]
    result = meltemi.simulate(model, wind, duration=60.0, controller=controller, channels=channels)
    assert result["nacelle_yaw"][-1] == pytest.approx(-0.3 + deg(0.5), abs=2e-3)
    np.testing.assert_allclose(result["yaw_error"][-1], 0.3 + result["nacelle_yaw"][-1], atol=1e-4)
    assert result["yaw_threshold"][-1] == deg(8.0)
    assert result["GenPwr"][-1] > 1.05 * result["GenPwr"][0]
    # without a yaw error worth a start it is the baseline law to the bit
    still = SteadyWind(speed=10.0, direction=0.05)
    runs = [
        meltemi.simulate(model, still, duration=5.0, controller=c, channels=["RootMyc1"]) for c in (controller, None)
    ]
    np.testing.assert_array_equal(runs[0].data, runs[1].data)


@pytest.mark.parametrize("kind", ["held", "free"])
def test_a_held_nacelle_and_a_yaw_control_do_not_go_together(turbine: Turbine, kind: Any) -> None:
    with pytest.raises(InputError, match=rf"turns the nacelle, but the model's yaw is '{kind}'.*yaw=\"driven\""):
        meltemi.Simulation(
            meltemi.Run(
                meltemi.build(turbine, ModelOptions(yaw=kind)),
                SteadyWind(speed=10.0),
                duration=1.0,
                controller=YawController(turbine),
            )
        )


def test_beside_load_control(turbine: Turbine) -> None:
    load = meltemi.control.LoadControl(loops=(meltemi.control.HarmonicLoop(harmonic=1, integral_gain=5e-10),))
    model = meltemi.build(turbine, ModelOptions(yaw="driven"))
    wind = SteadyWind(speed=16.0, direction=0.3)
    settings = YawControl(average_time=1.0, start_time=0.0)
    plain, both = (
        meltemi.simulate(
            model,
            wind,
            duration=20.0,
            controller=YawController(turbine, settings, chosen),
            channels=["nacelle_yaw", "BldPitch1"],
        )
        for chosen in (None, load)
    )
    assert both["nacelle_yaw"][-1] < -0.05
    assert np.ptp(both["BldPitch1"][200:]) > np.ptp(plain["BldPitch1"][200:]) + 0.005


def test_in_a_case_file(model: Model, tmp_path: Path) -> None:
    path = tmp_path / "case.yaml"
    path.write_text(
        "turbine: nrel5mw\nwind: {kind: steady, speed: 10.0}\nduration: 1.0\noptions: {yaw: driven}\n"
        "controller: {kind: baseline, yaw: {dead_band: 0.1}}\n"
    )
    case = read_case(path)
    controller = case_controller(case, model, tmp_path)
    assert controller is not None
    assert controller.yaws
    state = controller.initial_state(meltemi.control.StartPoint(10.0, 100.0, 0.0, 1e4))
    assert state[controller.state_names.index("yaw_dead_band")] == 0.1
    assert case_controller(case.replace(**{"controller.yaw": None}), model, tmp_path) is None
    path.write_text(path.read_text().replace("dead_band", "deadband"))
    with pytest.raises(InputError, match="dead_band"):
        read_case(path)
