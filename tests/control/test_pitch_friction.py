"""Friction of pitch bearings: sticking, sliding, energy, load."""

from __future__ import annotations

import numpy as np
import pytest

import meltemi
from meltemi.control.actuator_models.parameters import ActuatorParameters
from meltemi.control.actuator_models.second_order import advance
from meltemi.core.errors import InputError
from meltemi.turbine.definition import PitchFriction


def moved(friction: float, damping: float, demand: np.ndarray, start: float = 0.0, dt: float = 0.01) -> np.ndarray:
    """(T, 2) angle and rate under demands, at 2 rad/s natural frequency."""
    p = ActuatorParameters(2.0, damping, 1e3, -1e3, 1e3, False, friction)
    x, v, rows = start, 0.0, []
    for d in demand:
        x, v, _ = advance(x, v, float(d), p, dt)
        rows.append((x, v))
    return np.array(rows)


@pytest.mark.parametrize("dt", [0.003, 0.05])
def test_free_amplitudes_fall_by_two_widths_each_half_cycle(dt: float) -> None:
    """Closed form of the undamped oscillator with Coulomb friction; then it sticks."""
    width = 0.4 / 2.0**2
    x = moved(0.4, 1e-9, np.zeros(int(12.0 / dt)), start=1.05, dt=dt)
    time = dt * np.arange(1, len(x) + 1)
    turns = [1.05 - 2.0 * width * k for k in range(6)]
    for k in range(1, 5):
        near = np.abs(time - k * np.pi / 2.0).argmin()
        assert abs(x[near, 0]) == pytest.approx(abs(turns[k]), abs=2.0 * dt**2 * 4.0)
    assert abs(x[-1, 0]) == pytest.approx(0.05, abs=1e-6) and x[-1, 1] == 0.0


def test_energy_is_lost_to_friction_alone() -> None:
    """Kinetic and spring energy fall by friction times the way."""
    x = moved(0.3, 1e-9, np.zeros(700), start=1.0, dt=1e-3)
    energy = 0.5 * x[:, 1] ** 2 + 0.5 * 4.0 * x[:, 0] ** 2
    way = np.cumsum(np.abs(np.diff(x[:, 0], prepend=1.0)))
    assert energy + 0.3 * way == pytest.approx(np.full(700, 2.0), rel=2e-4)


def test_a_slow_demand_is_followed_by_sticking_and_slipping() -> None:
    """A ramp: the blade waits until the demand is a width ahead; without friction it moves at once."""
    ramp = 0.02 * np.arange(1, 1500) * 0.01
    rubbed, free = (moved(friction, 0.6, ramp) for friction in (0.08, 0.0))
    width = 0.08 / 4.0
    waits = rubbed[ramp <= width, 0]
    assert np.all(waits == 0.0) and len(waits) > 50
    assert rubbed[-1, 0] > 0.2 and free[5, 0] > 0.0
    assert np.all(moved(0.08, 0.6, np.full(500, 0.9 * width)) == 0.0)


@pytest.mark.slow
def test_the_load_on_the_bearing_makes_friction(turbine: meltemi.turbine.Turbine) -> None:
    """A small change of pitch is not followed under load; it is with an unloaded bearing, and without friction."""
    rub = {"inertia": 3e4, "diameter": 3.0, "coefficient": 0.005}
    wind = meltemi.SteadyWind(speed=13.0)

    def update(state: np.ndarray, measurements: object, demands: object, dt: float) -> None:
        demands.generator_torque = 43000.0  # type: ignore[attr-defined]
        for b in range(3):
            demands.pitch[b] = 0.12 + (0.004 if measurements.time > 2.0 else 0.0)  # type: ignore[attr-defined]

    travel = []
    for friction in (None, PitchFriction(**rub), PitchFriction(**rub | {"coefficient": 0.0, "torque": 1.0})):
        actuator = turbine.pitch_actuator.replace(kind="second_order", natural_frequency=3.0, friction=friction)
        model = meltemi.build(turbine.replace(pitch_actuator=actuator), meltemi.ModelOptions(locked=("tower",)))
        start = meltemi.Start(rotor_speed=1.2, pitch=0.12)
        controller = meltemi.Controller(update=update, uses_loads=False)
        run = meltemi.simulate(model, wind, duration=5.0, controller=controller, start=start, channels=("BldPitch1",))
        travel.append(float(np.ptp(run["BldPitch1"])))
    assert travel[0] > 0.0038 and travel[2] > 0.0038
    # 4.4 mu / 2 * 6 MN m / J is 2 rad/s^2, the drive pulls with 0.04
    assert travel[1] == 0.0


def test_friction_needs_an_actuator_with_a_spring(turbine: meltemi.turbine.Turbine) -> None:
    with pytest.raises((InputError, ValueError), match="second_order"):
        turbine.pitch_actuator.replace(kind="ideal", friction=PitchFriction(inertia=1e4))


@pytest.mark.slow
def test_without_blades_only_the_constant_part_is_taken(turbine: meltemi.turbine.Turbine) -> None:
    """The load on the bearing is made by blades: refused, and left out of a turbine's power-coefficient twin."""
    friction = PitchFriction(inertia=1e4, torque=20.0, coefficient=0.004)
    machine = meltemi.load_turbine("pmsg20mw")
    actuator = turbine.pitch_actuator.replace(kind="second_order", friction=friction)
    with pytest.raises(
        (InputError, ValueError), match=r"friction\.coefficient: bearings are loaded by .* root moments"
    ):
        machine.replace(pitch_actuator=actuator)
    performance = meltemi.analysis.performance_of(turbine)
    twin = meltemi.analysis.power_turbine_of(turbine.replace(pitch_actuator=actuator), performance)
    assert twin.pitch_actuator.friction == friction.replace(coefficient=0.0)
