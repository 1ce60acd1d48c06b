"""Supervisor, derating, power control, observer and a learning environment on a floating turbine in wind and waves."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import meltemi
from meltemi.analyses.performance import performance_of
from meltemi.control import CoordinatedController, PowerControl, SupervisedController

pytestmark = [pytest.mark.slow, pytest.mark.long]
SEA = meltemi.environment.IrregularSea(height=3.0, period=9.0, seed=1)
WIND = meltemi.TurbulentWind(speed=14.0, intensity=0.12, seed=1, points=9)


@pytest.fixture(scope="module")
def model() -> Any:
    return meltemi.build(meltemi.load_turbine("iea15mw-volturnus"))


def run(model: Any, duration: float, controller: Any, *events: Any) -> meltemi.Result:
    return meltemi.simulate(model, WIND, duration=duration, sea=SEA, controller=controller, events=events)


def test_the_supervisor_stops_the_rotor(model: Any) -> None:
    result = run(
        model, 100.0, SupervisedController(model.turbine), meltemi.events.Request(at=40.0, request="normal_stop")
    )
    assert result["GenPwr"][-1] == 0.0 and result["RotSpeed"][-1] < 0.01
    assert np.abs(result["platform_pitch"]).max() < np.radians(8.0)


@pytest.mark.parametrize("kind", ["supervised", "optimal speed"])
def test_the_operator_limits_the_power(model: Any, kind: str) -> None:
    turbine = model.turbine
    controller = SupervisedController(turbine)
    if kind == "optimal speed":
        power = PowerControl(scheme="optimal_speed")
        controller = CoordinatedController(turbine, performance_of(turbine), power=power)
    result = run(model, 150.0, controller, meltemi.events.PowerLimit(at=40.0, power=8e6))
    time, power = result.time, np.asarray(result["GenPwr"])
    assert power[time < 40.0].mean() > 13e6 and power[time > 110.0].mean() == pytest.approx(8e6, rel=0.06)


def test_the_observer_sees_wind_and_platform(model: Any) -> None:
    observer = meltemi.analysis.observer(model, spacing=5.0)
    found = observer.estimate(meltemi.simulate(model, WIND, duration=60.0, sea=SEA), samples=2)
    assert {"q base surge", "q base pitch"} <= set(observer.states)
    assert np.mean(found.result["rotor_effective_wind"]) == pytest.approx(14.0, rel=0.05)


def test_an_agent_acts_in_waves() -> None:
    gymnasium = pytest.importorskip("gymnasium", reason="needs gymnasium")
    import meltemi.learning  # noqa: F401 - registers the environments

    settings = {"turbine": "iea15mw-volturnus", "model": "full", "wind_speeds": (14.0, 14.0), "duration": 20.0}
    seen = []
    for sea in (None, SEA):
        env = gymnasium.make("Meltemi/LoadControl-v0", sea=sea, **settings)
        env.reset(seed=1)
        seen.append([env.step(np.zeros(env.action_space.shape))[0] for _ in range(20)][-1])
    assert np.all(np.isfinite(seen)) and not np.allclose(*seen)
