"""Runs that are stepped from outside: the same bits as with the law as a plug-in, back to the start, clear refusals."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import meltemi
from meltemi import Controller, InputError, Model, Simulation, Status, SteadyWind, simulate
from meltemi.control import StartPoint
from meltemi.control import signals as s
from meltemi.simulation.run import Run

WIND = SteadyWind(speed=13.0, shear_exponent=0.2)


def uses_all(state: Any, measurements: Any, demands: Any, dt: float) -> None:
    """A law that looks at loads and wind of each blade."""
    demands[s.GENERATOR_TORQUE] = 4.1e4 + 10.0 * (measurements[s.WIND_SPEED] - 13.0)
    for blade in range(3):
        moment = measurements[s.OUT_OF_PLANE_MOMENT + blade]
        demands[s.PITCH_DEMAND + blade] = 0.11 + 2e-9 * moment + 0.01 * (measurements[s.GENERATOR_SPEED] - 122.9)


@pytest.mark.parametrize("sample_time", [None, 0.1])
@pytest.mark.parametrize("law", ["baseline", "loads"])
def test_stepping_gives_the_bits_of_the_same_law_as_plug_in(model: Model, law: str, sample_time: float | None) -> None:
    if law == "baseline":
        controller = meltemi.control.BaselineController(model.turbine, sample_time=sample_time)
    else:
        controller = Controller(uses_all, sample_time=sample_time)
    plugged = simulate(model, WIND, duration=3.0, controller=controller, channels=["all"])
    run = Simulation(
        Run(model, WIND, duration=3.0, controller=meltemi.control.ConstantController(sample_time), channels=["all"])
    )
    speed = run.start["rotor_speed"] * model.turbine.drivetrain.gear_ratio
    point = StartPoint(13.0, speed, run.start["pitch"], run.start["generator_torque"])
    for _ in range(2):  # the second time after a reset in the middle of things
        measurements, state = run.reset(), controller.initial_state(point)
        demands = run.case["demands"].copy()
        while not run.finished:
            controller.update(state, measurements.array, demands, sample_time or run.dt)
            measurements = run.step(demands)
        assert np.array_equal(run.result().data, plugged.data)
        assert run.result().status is Status.OK


def test_measurements_by_name_and_at_their_time(model: Model) -> None:
    run = Simulation(Run(model, WIND, duration=2.0, controller=meltemi.control.ConstantController(0.1)))
    first = run.reset()
    second = run.step()
    assert first["time"] == 0.0
    assert second["time"] == pytest.approx(0.1)
    assert dict(second)["pitch_2"] == second["pitch"][1]
    assert second["out_of_plane_moment"].shape == (3,)
    run.advance(3)
    assert second["time"] == pytest.approx(0.1)  # it is of its own
    assert run.step()["time"] == pytest.approx(0.2)  # on to the next sample instant


@pytest.mark.parametrize("yaw", [0.0, 0.8, -0.8])
def test_the_anemometer_stands_at_the_hub(model: Model, yaw: float) -> None:
    """In a box whose wind grows by 1 m/s a second and by 0.01 m/s a metre to the left, the hub's place can be read."""
    t, y = np.arange(80.0) - 10.0, 20.0 * np.arange(11) - 100.0
    u = np.broadcast_to(10.0 + t[:, None, None] + 0.01 * y, (80, 2, 11))
    velocity = np.stack([u, np.zeros_like(u), np.zeros_like(u)], axis=-1).astype(np.float32)
    box = meltemi.WindBox(velocity, dt=1.0, dy=20.0, dz=200.0, bottom=1.0, speed=10.0)
    run = Simulation(
        Run(
            model,
            box,
            duration=1.0,
            controller=meltemi.control.ConstantController(0.1),
            start=meltemi.Start(rotor_speed=1.2, coordinates={"yaw": yaw}),
        )
    )
    measured = run.reset()
    # NREL/TP-500-38060, Table 4-1: overhang 5.0191 m, shaft tilt 5 deg
    reach = 5.0191 * np.cos(np.radians(5.0))
    x, left = -reach * np.cos(yaw), -reach * np.sin(yaw)
    assert measured["wind_speed"] == pytest.approx(10.0 - x / 10.0 + 0.01 * left, abs=1e-4)


def test_demands_by_name(model: Model) -> None:
    run = Simulation(Run(model, WIND, duration=2.0, controller=meltemi.control.ConstantController()))
    run.reset()
    run.step({"pitch": 0.2, "generator_torque": 3e4})
    assert run.step()["pitch"] == pytest.approx(0.2)
    assert run.step({"pitch_2": 0.1})["pitch"] == pytest.approx([0.2, 0.1, 0.2])
    assert run.step()["torque"] == pytest.approx(3e4)


def test_what_is_refused(model: Model) -> None:
    run = Simulation(Run(model, WIND, duration=0.1, controller=meltemi.control.ConstantController()))
    run.reset()
    with pytest.raises(InputError, match=r"no 'pich'.*pitch"):
        run.step({"pich": 0.1})
    for wrong in ([0.0, 1.0], [[0.0], [0.0, 1.0]]):
        with pytest.raises(InputError, match="expected 25 demands"):
            run.step(wrong)
    run.step({"pitch": np.nan})
    assert run.finished
    assert run.status is Status.CONTROLLER_DEMAND
    with pytest.raises(InputError, match="reset"):
        run.step()
    run.reset()
    while not run.finished:
        run.step()
    assert run.status is Status.OK
    with pytest.raises(InputError, match="reset"):
        run.step()
    own = Simulation(Run(model, WIND, duration=0.1))
    with pytest.raises(InputError, match="ConstantController"):
        own.step({"pitch": 0.1})
    assert own.step()["time"] == pytest.approx(own.dt)  # its own controller goes on


def test_reset_forgets_everything(model: Model) -> None:
    wind = meltemi.TurbulentWind(speed=11.0, intensity=0.14, points=9)
    for controller in (None, Controller(uses_all)):
        run = Simulation(Run(model, wind, duration=2.0, channels=["all"], controller=controller))
        fresh = simulate(model, wind, duration=2.0, channels=["all"], controller=controller)
        run.advance(77)
        run.reset()
        run.advance(10_000)
        assert np.array_equal(run.result().data, fresh.data)
