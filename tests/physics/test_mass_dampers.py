"""Tuned mass dampers: two coupled oscillators in closed form, weight, stops, section loads, linear models, errors."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import meltemi
from meltemi.core.errors import InputError
from meltemi.environment import Environment
from meltemi.turbine import MassDamper

Float = NDArray[np.float64]
OPTIONS: dict[str, Any] = {"blade_nodes": 5, "tower_nodes": 5, "time_step": 0.01}
LOCKED = ("blades", "yaw", "generator", "drivetrain")
BASE = {"surge": 0}
MASS, STIFFNESS = 5.0e6, 2.0e7
"""[kg], [N/m] of the moving base."""


def on_a_spring(*dampers: MassDamper, motion: str = "surge", thin_air: bool = False, **changes: Any) -> Any:
    """A rigid turbine that moves on a spring along one axis, with mass dampers."""
    stiffness = np.diag([STIFFNESS] * 3 + [1e14] * 3)
    foundation = {"motions": (motion,), "mass": np.diag([MASS] * 3 + [5e9] * 3), "stiffness": stiffness}
    turbine = meltemi.load_turbine("nrel5mw").replace(foundation=foundation, mass_dampers=dampers)
    options = meltemi.ModelOptions(**(OPTIONS | {"locked": (*LOCKED, "tower")} | changes))
    return meltemi.build(turbine, options, Environment(air_density=1e-4 if thin_air else 1.225))


def free(model: Any, duration: float = 20.0, motion: str = "surge", begin: float = 0.1, **more: Any) -> Any:
    return meltemi.simulate(
        model,
        0.0,
        duration=duration,
        output_step=more.pop("output_step", 0.01),
        controller=meltemi.control.ConstantController(),
        start=meltemi.Start(coordinates={f"base {motion}": begin}),
        **more,
    )


def total_mass(model: Any) -> float:
    """[kg] of the base and the turbine above it, by the frequency without a damper."""
    (mode,) = meltemi.analysis.natural_modes(model)
    return float(STIFFNESS / mode.frequency**2)


def two_masses(time: Float, m: tuple[float, float], k: tuple[float, float], c: float, begin: float) -> Float:
    """(T, 2) displacement of a mass on a spring, and of a second one relative to it."""
    from scipy.linalg import expm

    M = np.array([[m[0] + m[1], m[1]], [m[1], m[1]]])
    K, C = np.diag(k), np.diag([0.0, c])
    A = np.block([[np.zeros((2, 2)), np.eye(2)], [-np.linalg.solve(M, K), -np.linalg.solve(M, C)]])
    step, x, found = expm(A * (time[1] - time[0])), np.array([begin, 0.0, 0.0, 0.0]), []
    for _ in time:
        found.append(x[:2])
        x = step @ x
    return np.array(found)


@pytest.mark.slow
@pytest.mark.parametrize(("axes", "motion"), [("x", "surge"), ("y", "sway"), ("xy", "surge")])
def test_a_free_vibration_is_that_of_two_masses(axes: Any, motion: str) -> None:
    m = 2.5e5
    damper = MassDamper(height=60.0, mass=m, axes=axes, stiffness=8e5, damping=8e4)
    model = on_a_spring(damper, motion=motion)
    m0 = total_mass(on_a_spring(motion=motion))
    axis = "x" if motion == "surge" else "y"
    names = (f"q base {motion}", f"mass_damper_1_{axis}_position", f"mass_damper_1_{axis}_force")
    run = free(model, motion=motion, channels=names)
    exact = two_masses(run.time, (m0, m), (STIFFNESS, 8e5), 8e4, 0.1)
    for i, name in enumerate(names[:2]):
        assert np.abs(run[name] - exact[:, i]).max() < 2e-3 * np.abs(exact[:, i]).max(), name
    rate = np.gradient(exact[:, 1], run.time)
    assert np.abs(run[names[2]] - 8e5 * exact[:, 1] - 8e4 * rate)[2:-2].max() < 5e-3 * np.abs(run[names[2]]).max()


@pytest.mark.slow
def test_the_error_falls_with_the_square_of_the_step() -> None:
    damper = MassDamper(height=60.0, mass=2.5e5, stiffness=8e5, damping=8e4)
    m0, errors = total_mass(on_a_spring()), []
    for step in (0.04, 0.02, 0.01):
        run = free(on_a_spring(damper, time_step=step), channels=("q base surge",), duration=12.0, output_step=0.04)
        exact = two_masses(run.time, (m0, 2.5e5), (STIFFNESS, 8e5), 8e4, 0.1)[:, 0]
        errors.append(np.abs(run["q base surge"] - exact)[run.time > 2.0].max())
    ratios = np.array(errors[:-1]) / np.array(errors[1:])
    assert np.all(ratios > 3.0), ratios


@pytest.mark.slow
def test_the_tower_carries_the_mass_across_its_axis() -> None:
    """Along y the mass of a damper along x moves with the base."""
    damper = MassDamper(height=60.0, mass=2.5e5, axes="x", stiffness=8e5)
    run = free(on_a_spring(damper, motion="sway"), motion="sway", channels=("q base sway",))
    m0 = total_mass(on_a_spring(motion="sway"))
    exact = 0.1 * np.cos(np.sqrt(STIFFNESS / (m0 + 2.5e5)) * run.time)
    assert np.abs(run["q base sway"] - exact).max() < 1e-3


@pytest.mark.slow
def test_stops_hold_the_mass_and_lose_no_energy() -> None:
    m, k, stop = 2.5e5, 8e5, 4e6
    damper = MassDamper(height=60.0, mass=m, stiffness=k, stops=(-0.1, 0.15), stop_stiffness=stop)
    names = ("q base surge", "v base surge", "mass_damper_1_x_position", "mass_damper_1_x_force")
    run = free(on_a_spring(damper), begin=0.3, channels=names)
    m0 = total_mass(on_a_spring())
    x, v, y = (run[name] for name in names[:3])
    assert y.max() > 0.15 and y.min() < -0.1  # it meets both
    beyond = np.maximum(y - 0.15, 0.0) + np.minimum(y + 0.1, 0.0)
    assert np.abs(run[names[3]] - k * y - stop * beyond).max() < 1e-6 * np.abs(run[names[3]]).max()
    w = np.gradient(y, run.time)
    energy = 0.5 * (m0 * v**2 + m * (v + w) ** 2 + STIFFNESS * x**2 + k * y**2 + stop * beyond**2)
    assert np.abs(energy / energy[0] - 1.0)[2:-2].max() < 0.01
    loose = free(on_a_spring(damper.replace(stops=None, stop_stiffness=0.0)), begin=0.3, channels=names[2:3])
    assert np.abs(loose[names[2]]).max() > 1.5 * np.abs(y).max()


@pytest.mark.slow
def test_it_damps_the_tower_and_loads_are_in_balance() -> None:
    """A damper in the nacelle by Den Hartog's rule; the tower base carries its force and weight."""
    turbine = meltemi.load_turbine("nrel5mw")
    options = meltemi.ModelOptions(**(OPTIONS | {"locked": LOCKED}))
    bare = meltemi.build(turbine, options)
    first = min((mode for mode in meltemi.analysis.natural_modes(bare)), key=lambda mode: mode.frequency)
    ratio, m = 0.03, 12e3
    w = first.frequency / (1.0 + ratio)
    damping = 2.0 * np.sqrt(3.0 * ratio / (8.0 * (1.0 + ratio))) * m * w
    damper = MassDamper(height=89.0, mass=m, axes="xy", stiffness=m * w**2, damping=damping)
    model = meltemi.build(turbine.replace(mass_dampers=(damper,)), options)
    names = ("tower_top_fore_aft", "tower_base_force_z", "tower_base_force_x", "yaw_force_z", "mass_damper_1_x_force")
    runs = [
        meltemi.simulate(
            each,
            0.0,
            duration=60.0,
            controller=meltemi.control.ConstantController(),
            start=meltemi.Start(coordinates={"tower 1st fore-aft": 0.5}),
            channels=names[: 4 + (each is model)],
        )
        for each in (bare, model)
    ]
    late = [np.ptp(run["tower_top_fore_aft"][run.time > 45.0]) for run in runs]
    assert late[1] < 0.3 * late[0]
    for name in ("tower_base_force_z", "yaw_force_z"):
        assert runs[1][name].mean() - runs[0][name].mean() == pytest.approx(-m * 9.80665, rel=0.03), name


@pytest.mark.slow
@pytest.mark.long
def test_its_states_are_those_of_linear_models() -> None:
    damper = MassDamper(height=60.0, mass=2.5e5, stiffness=8e5, damping=8e4)
    model = on_a_spring(damper, thin_air=True)
    point = meltemi.operating_point(model, 8.0, rotor_speed=1.0, pitch=0.0)
    linear = meltemi.analysis.linearise(model, point, (), ("rotor_thrust",))
    assert {"mass damper 1 x position", "mass damper 1 x velocity"} <= set(linear.states)
    m0 = total_mass(on_a_spring())
    M = np.array([[m0 + 2.5e5, 2.5e5], [2.5e5, 2.5e5]])
    A = np.block(
        [
            [np.zeros((2, 2)), np.eye(2)],
            [-np.linalg.solve(M, np.diag([STIFFNESS, 8e5])), -np.linalg.solve(M, np.diag([0.0, 8e4]))],
        ]
    )
    found = np.linalg.eigvals(linear.A)
    for pole in np.linalg.eigvals(A):
        assert np.abs(found - pole).min() < 2e-3 * abs(pole)


def test_bad_input() -> None:
    with pytest.raises(InputError, match="stops: expected one below and one above 0"):
        MassDamper(height=60.0, mass=1e4, stiffness=1e4, stops=(0.1, 0.2), stop_stiffness=1e5)
    with pytest.raises(InputError, match="stops and stop_stiffness come together"):
        MassDamper(height=60.0, mass=1e4, stiffness=1e4, stops=(-0.1, 0.2))
    with pytest.raises(InputError, match="mass_dampers.1: spring and stop have 100 rad/s, too fast for a step"):
        on_a_spring(MassDamper(height=60.0, mass=1e3, stiffness=1e7), time_step=0.02)
    turbine = meltemi.load_turbine("nrel5mw")
    with pytest.raises(InputError, match=r"mass_dampers.*stifness"):
        turbine.replace(mass_dampers=({"height": 60.0, "mass": 1e4, "stifness": 1e4},))
