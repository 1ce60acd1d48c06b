"""Rotors that stand or idle begin in equilibrium, so that no start has to be cut off."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import meltemi
from meltemi import InputError, Model, ModelOptions, Result, Start, SteadyWind, Turbine, simulate
from meltemi.analysis import parked_point
from meltemi.cases.case import case_controller, case_start, read_case
from meltemi.simulation.case import Case

FEATHER = 0.5 * math.pi
STORM = SteadyWind(speed=50.0, shear_exponent=0.11)
"""Steady extreme wind of class I."""
CHANNELS = ["TwrBsMyt", "TwrBsMxt", "RootMyc1", "RootMxc1", "rotor_aero_torque", "rotor_speed", "azimuth"]


@pytest.fixture(scope="module")
def held(turbine: Turbine) -> Model:
    return meltemi.build(turbine, ModelOptions(locked=("generator",)))


def run(model: Model, wind: SteadyWind, start: Start, duration: float = 40.0) -> Result:
    return simulate(
        model, wind, duration=duration, controller=meltemi.control.ConstantController(), start=start, channels=CHANNELS
    )


@pytest.mark.slow
@pytest.mark.parametrize("start", [Start(pitch=FEATHER), Start(rotor_speed="idling", pitch=FEATHER)])
def test_a_feathered_rotor_in_a_storm_has_no_false_extreme(model: Model, start: Start) -> None:
    """Undeflected it began with twice the mean fore-aft moment of the tower base."""
    result = run(model, STORM, start)
    first, last = result.between(0.0, 10.0)["TwrBsMyt"], result.between(20.0, 40.0)["TwrBsMyt"]
    assert first.max() < 1.03 * last.max()
    assert first.min() > 0.97 * last.min()
    assert run(model, STORM, Start(pitch=FEATHER, coordinates={}), 5.0)["TwrBsMyt"].max() > 1.7 * last.max()


def test_an_idling_rotor_begins_at_its_speed(model: Model) -> None:
    result = run(model, STORM, Start(rotor_speed="idling", pitch=FEATHER))
    late = result.between(20.0, 40.0)["rotor_speed"]
    assert late.min() < 0.0
    assert result["rotor_speed"][0] == pytest.approx(late.mean(), rel=0.25)
    # at rest the same blades would turn the rotor with megawatts' torque
    assert np.abs(result["rotor_aero_torque"]).max() < 2e5 < 3e6 < abs(parked_point(model, STORM).imbalance)


@pytest.mark.slow
@pytest.mark.parametrize("direction", [-0.5, 0.35, 1.571])
def test_in_oblique_wind_a_free_rotor_stays_where_its_torque_balances(model: Model, direction: float) -> None:
    """There it comes to from elsewhere, too."""
    wind = SteadyWind(speed=40.0, direction=direction)
    point = parked_point(model, wind, rotor_speed="idling")
    assert (point.rotor_speed, abs(point.imbalance) < 1e3) == (0.0, True)
    still = run(model, wind, Start(rotor_speed="idling", pitch=FEATHER), 20.0)
    for name in CHANNELS[:4]:
        assert np.ptp(still[name]) < 1e-3 * np.abs(still[name]).max(), name
    let_go = run(model, wind, Start(pitch=FEATHER), 100.0)
    assert let_go["azimuth"][-1] == pytest.approx(point.azimuth, abs=0.01)
    assert let_go["RootMxc1"][-1] == pytest.approx(point["RootMxc1"], rel=0.02)


@pytest.mark.slow
@pytest.mark.parametrize("azimuth", [0.0, 0.7, 2.0, 4.5])
@pytest.mark.parametrize("pitch", [0.0, 0.6, FEATHER])
def test_a_locked_rotor_stands_still(held: Model, azimuth: float, pitch: float) -> None:
    wind = SteadyWind(speed=25.0, direction=0.2, shear_exponent=0.14)
    point = parked_point(held, wind, pitch=pitch, azimuth=azimuth)
    case = Case(held, wind)
    point.put(case)
    case.settle(0.0)
    assert np.abs(case["a"]).max() < 1e-6
    assert not case["v"].any()
    result = run(held, wind, Start(pitch=pitch, azimuth=azimuth), 10.0)
    assert result["azimuth"] == pytest.approx(np.full(len(result.time), azimuth), abs=0.02)
    for name in CHANNELS[:4]:
        assert np.abs(result[name] - point[name]).max() < 1e-3 * np.abs(result[name]).max() + 1e3, name


def test_a_rotor_that_turns_without_torque_begins_deflected(model: Model) -> None:
    wind = SteadyWind(speed=20.0)
    point = parked_point(model, wind, rotor_speed=0.1, pitch=1.2)
    result = run(model, wind, Start(rotor_speed=0.1, pitch=1.2), 5.0)
    assert result["TwrBsMyt"][0] == pytest.approx(point["TwrBsMyt"], rel=0.05)


def test_words_of_a_parked_rotor(model: Model, held: Model) -> None:
    with pytest.raises(InputError, match=r"no idling at a wind speed of 12 m/s and a pitch of 0 deg: the wind drives"):
        parked_point(model, 12.0, pitch=0.0, rotor_speed="idling")
    with pytest.raises(InputError, match="needs a generator that is not locked"):
        parked_point(held, 12.0, rotor_speed="idling")
    with pytest.raises(InputError, match="less than or equal to 100"):
        parked_point(model, 120.0)
    with pytest.raises(InputError, match=r"use meltemi\.analysis\.parked_point for parked or idling rotors"):
        meltemi.operating_point(model, 12.0, rotor_speed=0.0)


def test_an_unstable_standing_rotor_says_so() -> None:
    """Wind from behind turns the sections about their trailing edges, if the lift has no lag."""
    options = ModelOptions(locked=("generator",), advanced={"reversed_flow": "static"})
    held = meltemi.build(meltemi.load_turbine("nrel5mw"), options)
    wind = SteadyWind(speed=40.0, direction=math.pi)
    (warning,) = parked_point(held, wind).warnings
    assert "the parked rotor is unstable: its mode at 5.0" in warning
    assert "torsion" in warning
    result = run(held, wind, Start(pitch=FEATHER), 0.1)
    assert warning in result.meta["warnings"]


CASE = """\
turbine: nrel5mw
wind: {kind: steady, speed: 50.0, shear_exponent: 0.11}
duration: 0.1
controller: {kind: fixed}
start: {rotor_speed: idling}
"""


def test_parked_in_a_case(model: Model, tmp_path: Path) -> None:
    path = tmp_path / "case.yaml"
    for text, start in (
        (CASE, Start(rotor_speed="idling", pitch=model.turbine.pitch_actuator.maximum)),
        (CASE.replace("{rotor_speed: idling}", "{pitch: 0.3, azimuth: 1.0}"), Start(pitch=0.3, azimuth=1.0)),
        (
            CASE.replace("kind: fixed", "kind: supervised"),
            Start(rotor_speed="idling", pitch=model.turbine.pitch_actuator.maximum),
        ),
    ):
        path.write_text(text, encoding="utf-8")
        case = read_case(path)
        assert case_start(case, model.turbine) == start
        assert case_controller(case, model, tmp_path) is not None
    path.write_text(CASE.replace("kind: fixed", "kind: baseline"), encoding="utf-8")
    with pytest.raises(InputError, match=r"controller: \{kind: fixed\} keeps it parked"):
        read_case(path)
