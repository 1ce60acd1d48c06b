"""The yaw bearing with drive, brake and friction: closed forms, energy, symmetry, kinds of numbers."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import meltemi
from meltemi import Model, ModelOptions, Start, SteadyWind, Turbine, simulate
from meltemi.control import YawControl, YawController
from meltemi.control import signals as s
from meltemi.control.actuators import yaw_advance
from meltemi.gradients.sensitivity import finite_difference_runs
from meltemi.simulation.case import Case
from meltemi.simulation.run import Run
from meltemi.verification.energy import mechanical_energy
from meltemi.wind.fields import unusual

Float = NDArray[np.float64]
ALL_BUT_YAW = ("tower", "generator", "drivetrain", "blades")
CALM = SteadyWind(speed=1.0)
CHANNELS = ["nacelle_yaw", "v yaw", "yaw_drive_torque", "yaw_friction_torque", "yaw_drive_rate", "yaw_command"]


def in_vacuum(turbine: Turbine, options: dict[str, Any], **changes: Any) -> Model:
    described = turbine.replace(**{f"yaw.{name}": value for name, value in changes.items()})
    model = meltemi.build(described, ModelOptions(**{"time_step": 0.0025, "advanced": {"corrections": 1}} | options))
    return model.with_parameters(**{"aerodynamics.air_density": 0.0})


def turning(demand: Any) -> meltemi.Controller:
    def update(state: Float, measured: Float, demands: Float, dt: float) -> None:
        demands[s.YAW_RATE_DEMAND] = demand(measured[s.TIME])

    return meltemi.Controller(update=update, yaws=True)


def yaw_inertia(model: Model) -> float:
    """[kg m^2] of all that turns about the yaw axis: twice the kinetic energy at 1 rad/s."""
    case = Case(model, CALM)
    Start(velocities={"yaw": 1.0}).put(case)
    return 2.0 * mechanical_energy(case)[0]


# the drive ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("dt", [0.01, 0.37])
def test_the_drive_follows_the_trapezoid_exactly(turbine: Turbine, dt: float) -> None:
    """0 to 5 mrad/s at 1 mrad/s^2 takes 5 s and 12.5 mrad; then at the rate; then back through zero."""
    driven = meltemi.build(turbine, ModelOptions(yaw="driven"))
    c = Case(driven.with_parameters(actuators__yaw_rate=0.005, actuators__yaw_acceleration=0.001), CALM).control
    drive = c.drive
    t = 0.0
    for demand, until in ((1.0, 10.0), (-0.002, 20.0)):
        c.demands.yaw_rate = demand
        rate0, angle0, t0 = drive.yaw_drive_rate, drive.yaw_command, t
        while t < until:
            yaw_advance(dt, c, 1e9, 0.0, 0.0)
            t += dt
        target = min(demand, 0.005)
        ramp = abs(target - rate0) / 0.001
        assert drive.yaw_drive_rate == target
        exact = 0.5 * (rate0 + target) * ramp + target * (t - t0 - ramp)
        assert drive.yaw_command - angle0 == pytest.approx(exact, abs=1e-14)


def test_turning_needs_the_work_that_it_stores(turbine: Turbine) -> None:
    """In vacuum, without friction, the work of the drive is the energy of the turning head."""
    model = in_vacuum(turbine, {"yaw": "driven", "locked": ALL_BUT_YAW}, rate=0.02, acceleration=0.01, damping=2e8)
    result = simulate(
        model, CALM, duration=10.0, controller=turning(lambda t: 0.02 if t > 1.0 else 0.0), channels=CHANNELS,
        start=Start(), output_step=0.0025,
    )  # fmt: skip
    rate, torque = result["v yaw"], result["yaw_drive_torque"]
    work = np.trapezoid(torque * rate, result.time)
    kinetic = 0.5 * yaw_inertia(model) * 0.02**2
    assert rate[-1] == pytest.approx(0.02, rel=1e-4)
    assert work == pytest.approx(kinetic, rel=2e-3)
    during = (result.time > 2.0) & (result.time < 2.9)
    assert torque[during].mean() == pytest.approx(0.01 * yaw_inertia(model), rel=0.01)


def test_while_it_turns_the_drive_carries_the_friction(turbine: Turbine) -> None:
    model = in_vacuum(turbine, {"yaw": "driven", "locked": ALL_BUT_YAW}, rate=0.02, friction=2e6, damping=2e8)
    result = simulate(
        model, CALM, duration=10.0, controller=turning(lambda t: -0.02 if t < 5.0 else 0.0), channels=CHANNELS,
        start=Start(),
    )  # fmt: skip
    late = (result.time > 4.0) & (result.time < 5.0)
    assert result["yaw_drive_torque"][late] == pytest.approx(-2e6, rel=1e-3)
    np.testing.assert_allclose(result["yaw_friction_torque"][late], 2e6, rtol=1e-10)  # rounding of the angle
    assert result["yaw_friction_torque"][-1] == 0.0  # now the brake holds
    assert result["nacelle_yaw"][-1] == pytest.approx(result["yaw_command"][-1], abs=1e-6)


# brake and friction -------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["held", "driven"])
def test_the_brake_slips_at_its_limit(turbine: Turbine, kind: Any) -> None:
    wind = SteadyWind(speed=12.0, direction=0.3)
    holds, slips = (
        simulate(
            meltemi.build(turbine.replace(**{"yaw.brake_torque": b, "yaw.friction": 5e4}), ModelOptions(yaw=kind)),
            wind, duration=20.0, channels=CHANNELS,
        )
        for b in (1e9, 1.5e5)
    )  # fmt: skip
    plain = simulate(meltemi.build(turbine, ModelOptions(yaw=kind)), wind, duration=20.0, channels=CHANNELS)
    np.testing.assert_array_equal(holds.data, plain.data)
    # an upwind rotor of this size turns into the wind when it is let slip
    assert slips["nacelle_yaw"][-1] < -0.1
    sliding = np.abs(slips["v yaw"]) > 1e-3
    sliding[0] = False
    assert sliding.sum() > 200
    np.testing.assert_allclose(np.abs(slips["yaw_drive_torque"][sliding]), 2e5, rtol=1e-9)


@pytest.mark.parametrize("friction", [0.0, 3e5])
def test_free_yaw_loses_what_friction_takes(turbine: Turbine, friction: float) -> None:
    options = {"yaw": "free", "locked": ALL_BUT_YAW, "time_step": 0.005}
    model = in_vacuum(turbine, options, friction=friction)
    start = Start(velocities={"yaw": 0.1})
    result = simulate(
        model,
        CALM,
        duration=20.0,
        controller=meltemi.control.ConstantController(),
        start=start,
        channels=CHANNELS,
        output_step=0.005,
    )
    J, rate = yaw_inertia(model), result["v yaw"]
    stop = 0.5 * J * 0.1**2 / friction if friction else np.inf
    if not friction:
        np.testing.assert_allclose(rate, 0.1, rtol=1e-9)
        return
    # the friction's own spring gives way by mu / K before it slides
    spring = friction / turbine.yaw.stiffness
    assert result["nacelle_yaw"].max() == pytest.approx(stop + 0.5 * spring, rel=1e-3)
    moving = result.time < 0.9 * J * 0.1 / friction
    work = np.trapezoid((result["yaw_friction_torque"] * rate)[moving], result.time[moving])
    assert work == pytest.approx(0.5 * J * (rate[moving][-1] ** 2 - 0.1**2), rel=1e-3)
    assert np.ptp(result["nacelle_yaw"][result.time > 19.0]) < 0.1 * spring  # it sticks


def test_the_held_bearing_swings_at_its_frequency(turbine: Turbine) -> None:
    model = in_vacuum(turbine, {"locked": ALL_BUT_YAW, "integration": "explicit"}, damping=0.0)
    result = simulate(
        model, CALM, duration=10.0, controller=meltemi.control.ConstantController(),
        start=Start(coordinates={"yaw": 1e-3}),
        channels=["nacelle_yaw"], output_step=0.0025,
    )  # fmt: skip
    w, h = np.sqrt(turbine.yaw.stiffness / yaw_inertia(model)), 0.0025
    marched = 2.0 / h * np.arcsin(0.5 * w * h)  # what the time march makes of it, second order in the step
    assert marched == pytest.approx(w, rel=2e-4)
    np.testing.assert_allclose(result["nacelle_yaw"], 1e-3 * np.cos(marched * result.time), atol=2e-8)


# symmetry -----------------------------------------------------------------------------------------------


def test_yaw_to_the_other_side_is_a_half_turn_about_the_shaft(turbine: Turbine) -> None:
    """Without tilt, gravity, shear and tower nothing tells a yawed wind from its half turn about the shaft."""
    straight = turbine.replace(**{"nacelle.tilt": 0.0})
    options = ModelOptions(tower_influence="none", locked=("tower", "generator"))
    model = meltemi.build(straight, options, meltemi.Environment(gravity=1e-9))
    channels = ["rotor_torque", "rotor_thrust", "shaft_tilt_moment", "shaft_yaw_moment", "RootMyc1", "RootMxc1"]
    left, right = (
        simulate(
            model, SteadyWind(speed=10.0, direction=way * 0.35), duration=10.0, channels=channels,
            controller=meltemi.control.ConstantController(),
            start=Start(rotor_speed=1.2, coordinates={"generator": begin}),
        )
        for way, begin in ((1.0, 0.0), (-1.0, np.pi))
    )  # fmt: skip
    for name in channels:
        sign = -1.0 if name in ("shaft_tilt_moment", "shaft_yaw_moment") else 1.0
        size = np.abs(left[name]).max()
        np.testing.assert_allclose(right[name], sign * left[name], atol=1e-7 * size, err_msg=name)
    assert np.abs(left["shaft_yaw_moment"].mean()) > 1e5


# axes ---------------------------------------------------------------------------------------------------


def test_loads_in_axes_that_yaw(turbine: Turbine) -> None:
    model = meltemi.build(turbine.replace(**{"yaw.rate": 0.05}), ModelOptions(yaw="driven", integration="explicit"))
    names = [f"YawBr{kind}{axis}{frame}" for kind in "FM" for axis in "xy" for frame in "pn"]
    result = simulate(
        model,
        SteadyWind(speed=10.0),
        duration=20.0,
        controller=turning(lambda t: 0.05),
        channels=["nacelle_yaw", *names],
    )
    c, sn = np.cos(result["nacelle_yaw"]), np.sin(result["nacelle_yaw"])
    assert sn[-1] > 0.7
    for kind in "FM":
        x, y = result[f"YawBr{kind}xp"], result[f"YawBr{kind}yp"]
        size = np.hypot(x, y).max()
        np.testing.assert_allclose(result[f"YawBr{kind}xn"], c * x + sn * y, atol=1e-9 * size)
        np.testing.assert_allclose(result[f"YawBr{kind}yn"], c * y - sn * x, atol=1e-9 * size)


# kinds of numbers ---------------------------------------------------------------------------------------

FULL = {"yaw.acceleration": 1.9e-3, "yaw.friction": 3e5, "yaw.brake_torque": 4e5, "yaw.rate": 0.0103}
ACTIVE = YawControl(average_time=3.0, start_time=1.0, noise=0.01)


@pytest.mark.slow
def test_lanes_and_floats_agree_with_everything_on(turbine: Turbine) -> None:
    model = meltemi.build(turbine.replace(**FULL), ModelOptions(yaw="driven"))
    runs = []
    for numbers in ("floats", "lanes"):
        run = meltemi.Simulation(meltemi.Run(
            model, SteadyWind(speed=14.0, direction=0.25, shear_exponent=0.2), duration=30.0, channels=CHANNELS,
            controller=YawController(model.turbine, ACTIVE),  # type: ignore[arg-type]
        ), numbers=numbers)  # fmt: skip
        run.advance(run.n_steps)
        runs.append(run.result().data)
    assert np.ptp(runs[0][:, 0]) > 0.1
    size = np.abs(runs[0]).max(axis=0)
    np.testing.assert_allclose(runs[1] / size, runs[0] / size, rtol=0.0, atol=1e-10)


@pytest.mark.long
@pytest.mark.parametrize("kind", ["driven", "free"])
def test_derivatives_through_drive_brake_and_friction(turbine: Turbine, kind: Any) -> None:
    model = meltemi.build(turbine.replace(**FULL), ModelOptions(yaw=kind))
    settings = YawControl(average_time=3.0, start_time=1.0, rate=0.0083)
    controller = YawController(model.turbine, settings) if kind == "driven" else None
    parameters = ["actuators.yaw_friction"]
    if kind == "driven":
        parameters += ["actuators.yaw_acceleration", "actuators.yaw_hold", "controller.yaw_rate"]
    arguments: dict[str, Any] = {
        "wind": SteadyWind(speed=14.0, direction=0.25),
        "duration": 8.0,
        "channels": ["nacelle_yaw", "yaw_moment_z"],
        "controller": controller,
    }
    found = meltemi.analysis.sensitivity(meltemi.Run(model, **arguments), parameters=parameters)
    for k, name in enumerate(parameters):
        low, high, step = finite_difference_runs(Run(model=model, **arguments), parameter=name)
        slope = (high.data - low.data) / (2.0 * step)
        size = np.abs(slope).max(axis=0)
        assert size[0] > 0.0, name
        # where a spring begins to slide within the step a difference is a mixture of both sides
        error = np.abs(found.slopes[:, :, k] - slope) / size
        assert np.quantile(error, 0.97) < 1e-3, (name, np.quantile(error, [0.5, 0.9, 0.97, 1.0]))


# the angle at which the nacelle stands ---------------------------------------------------------------------


def test_a_nacelle_against_the_wind_has_the_power_of_one_that_faces_it(turbine: Turbine) -> None:
    """Direction is clockwise, yaw counter-clockwise: their sum is the yaw error, whichever of both makes it."""
    turn = np.radians(20.0)

    def power(yaw: float, direction: float) -> float:
        model = meltemi.build(turbine, ModelOptions(nacelle_yaw=yaw, blade_nodes=8, tower_nodes=5))
        point = meltemi.operating_point(model, SteadyWind(speed=9.0, direction=direction))
        assert point["nacelle_yaw"] == pytest.approx(yaw, abs=1e-3)
        return point["generator_power"]

    aligned = power(0.0, 0.0)
    assert power(-turn, turn) == pytest.approx(aligned, rel=1e-5)
    assert power(-0.75 * np.pi, 0.75 * np.pi) == pytest.approx(aligned, rel=1e-5)
    of_wind, of_nacelle = power(0.0, turn), power(turn, 0.0)
    assert of_nacelle == pytest.approx(of_wind, rel=1e-3)
    assert of_wind < 0.87 * aligned
    assert power(turn, turn) < 0.6 * aligned  # 40 deg


@pytest.mark.parametrize("yaw", [-20.0, 30.0])
def test_a_yawed_run_starts_in_steady_operation(turbine: Turbine, yaw: float) -> None:
    """The tower is bent towards the side from the start and stays so; turned after the search it swung for 20 s."""
    options = ModelOptions(nacelle_yaw=np.radians(yaw), blade_nodes=8, tower_nodes=5)
    names = ["TwrBsMxt", "TwrBsMyt", "rotor_speed", "nacelle_yaw"]
    result = simulate(meltemi.build(turbine, options), SteadyWind(speed=9.0), duration=15.0, channels=names)
    side, ahead = result["TwrBsMxt"], result["TwrBsMyt"]
    bent = side.mean() - 2.5e6  # what the torque of the rotor adds
    assert bent / ahead.mean() == pytest.approx(-np.tan(np.radians(yaw)), rel=0.15)
    assert side.std() < 0.02 * abs(bent)
    assert ahead.std() < 0.02 * ahead.mean()
    assert result["rotor_speed"].std() < 1e-3 * result["rotor_speed"].mean()
    assert np.degrees(result["nacelle_yaw"]) == pytest.approx(np.full(len(side), yaw), abs=0.05)


def test_other_starts_have_the_nacelle_at_its_angle(turbine: Turbine) -> None:
    options = ModelOptions(nacelle_yaw=-0.4, blade_nodes=8, tower_nodes=5)
    case = Case(meltemi.build(turbine, options), CALM)
    yaw = case.model.coordinates.index("yaw")
    for start in (Start(coordinates={}), meltemi.analysis.parked_point(case.model, SteadyWind(speed=5.0))):
        start.put(case)
        assert case["q"][yaw] == pytest.approx(-0.4, abs=1e-3)
        assert case.view("drive")["yaw_command"] == -0.4


def test_only_a_wind_from_behind_the_rotor_is_told() -> None:
    wind = SteadyWind(speed=9.0, direction=2.5)
    assert any("or from behind, 143 deg" in words for words in unusual(wind))
    assert not unusual(wind, yaw=-2.5)
    assert any("or from behind, 115 deg" in words for words in unusual(wind, yaw=-0.5))
    assert not unusual(SteadyWind(speed=9.0, direction=np.radians(350.0)))
