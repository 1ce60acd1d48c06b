"""The machine of a power coefficient against closed forms: steady points, decay, actuator, energy, order, options."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

import meltemi
from meltemi import (
    Environment,
    InputError,
    Model,
    ModelOptions,
    Result,
    Start,
    Status,
    SteadyWind,
    WindBox,
    WindSeries,
    build,
    operating_point,
    simulate,
)
from meltemi.compiler import View
from meltemi.control.signals import Demands
from meltemi.environment import Air, TimeSeries
from meltemi.environment.rain import Rain, rain_parameters, rain_power_loss
from meltemi.simulation.rotors import default_step, kind_of
from meltemi.turbine import CalibratedCoefficient, PowerTurbine

R, AREA = 138.0, np.pi * 138.0**2
LAMBDA, C_P = 9.5085, 0.48
DEG = np.pi / 180.0


@pytest.fixture(scope="module")
def turbine() -> PowerTurbine:
    return meltemi.load_turbine("pmsg20mw")


@pytest.fixture(scope="module")
def model(turbine: PowerTurbine) -> Model:
    return build(turbine)


def run(model: Model, wind: Any, duration: float, channels: Sequence[str], **more: Any) -> Result:
    result = simulate(model, wind, duration=duration, channels=channels, **({"output_step": 0.05} | more))
    assert result.status is Status.OK, result.message
    return result


def stepped(model: Model, wind: Any, duration: float, demands: dict[str, float], **more: Any) -> Result:
    """A run under constant demands."""
    view = View(Demands, Demands.zeros())
    rows = [(view.rows(name), value) for name, value in demands.items()]

    def update(state: Any, measured: Any, wanted: Any, dt: float) -> None:
        for row, value in rows:
            wanted[row] = value

    return simulate(
        model, wind, duration=duration, controller=meltemi.Controller(update), **({"output_step": 0.05} | more)
    )


# steady operation ------------------------------------------------------------------------------------


def test_optimal_torque_holds_the_optimum(model: Model) -> None:
    point = operating_point(model, 10.0)
    assert point["tip_speed_ratio"] == pytest.approx(LAMBDA, rel=1e-5)  # friction of the bearings: 112 W
    assert point["power_coefficient"] == pytest.approx(C_P, rel=1e-9)
    assert point.rotor_speed == pytest.approx(0.6890, abs=5e-5)
    assert point["aerodynamic_power"] == pytest.approx(17.59e6, rel=2e-4)
    assert point["aerodynamic_power"] == pytest.approx(0.5 * 1.225 * AREA * C_P * 1000.0, rel=1e-6)


@pytest.mark.parametrize(("temperature", "ratio"), [(40.0, 9.24), (15.0, 9.5085), (-10.0, 9.79)])
def test_with_another_density_the_tip_speed_ratio_obeys_the_closed_form(
    turbine: PowerTurbine, temperature: float, ratio: float
) -> None:
    model = build(turbine, environment=Environment(air=Air(temperature=temperature)))
    point = operating_point(model, 10.0)
    assert point["tip_speed_ratio"] == pytest.approx(ratio, abs=0.006)
    # C_p / lambda^3 = (rho_c / rho) C_max / lambda_opt^3
    left = point["power_coefficient"] / point["tip_speed_ratio"] ** 3
    assert left == pytest.approx(1.225 / model.environment.density * C_P / LAMBDA**3, rel=2e-5)


def test_rated_power_is_that_of_the_stator_and_pitch_holds_it(model: Model) -> None:
    assert operating_point(model, 10.43)["generator_power"] < 20e6
    for speed in (10.46, 12.0, 18.0):
        point = operating_point(model, speed)
        assert point["generator_power"] == pytest.approx(20e6, rel=1e-9)
    assert point.rotor_speed == pytest.approx(0.75)
    assert point.pitch > 20 * DEG
    with pytest.raises(InputError, match=r"at its largest pitch of 25 degrees pmsg20mw still produces more"):
        operating_point(model, 20.0)
    with pytest.raises(InputError, match=r"the generator\. Use a higher wind speed, or another start: in a case"):
        operating_point(model, 0.5)


def test_rain_that_takes_all_power_is_named(turbine: PowerTurbine) -> None:
    cloudburst = Rain(kind="heavy_rainstorm_extreme", mode="seed", diameter=10.0)
    model = build(turbine, environment=Environment(rain=cloudburst))
    with pytest.raises(InputError, match=r"rain takes 100 % of the rotor's power\. Use less rain or a higher wind"):
        operating_point(model, 9.0)


def test_a_run_begins_and_stays_in_steady_operation(model: Model) -> None:
    for speed in (8.0, 14.0):
        point = operating_point(model, speed)
        result = run(model, SteadyWind(speed=speed), 60.0, ["rotor_speed", "pitch_1", "generator_power"])
        assert np.ptp(result["rotor_speed"]) < 1e-9
        assert result["pitch_1"] == pytest.approx(point.pitch, abs=1e-8)


def test_the_calibrated_coefficient_ends_a_run_where_it_is_not_known(turbine: PowerTurbine) -> None:
    model = build(turbine.replace(coefficient=CalibratedCoefficient()))
    assert operating_point(model, 10.0)["tip_speed_ratio"] == pytest.approx(LAMBDA, rel=1e-4)
    with pytest.raises(InputError, match=r"would have to pitch, where its 'calibrated' coefficient is not known"):
        operating_point(model, 12.0)
    result = simulate(model, WindSeries(time=[0.0, 5.0, 20.0], speed=[10.0, 10.0, 16.0]), duration=30.0, partial=True)
    assert result.status is Status.UNKNOWN
    assert "range of tip-speed ratio and pitch for which its power coefficient is defined" in result.message


# motion ----------------------------------------------------------------------------------------------


def test_without_wind_and_torque_friction_slows_the_rotor_down(turbine: PowerTurbine) -> None:
    friction, inertia = 2e7, turbine.drivetrain.inertia
    model = build(turbine.replace(**{"drivetrain.friction": friction}))
    result = stepped(model, SteadyWind(speed=0.0), 200.0, {}, start=Start(rotor_speed=0.7), channels=["rotor_speed"])
    exact = 0.7 * np.exp(-friction / inertia * result.time)
    assert result["rotor_speed"] == pytest.approx(exact, rel=1e-7)
    assert result["rotor_speed"][-1] < 0.2
    # the paper's 200 N m s take months
    slow = stepped(build(turbine), SteadyWind(speed=0.0), 200.0, {}, start=Start(rotor_speed=0.7))
    assert slow["rotor_speed"][-1] == pytest.approx(0.7 * np.exp(-200.0 / inertia * 200.0), rel=1e-12)


def test_a_small_deviation_decays_with_the_time_of_optimal_torque(turbine: PowerTurbine) -> None:
    # J w' = T_a - K w^2: the torque of the air falls by C_p / lambda^2 at the optimum, so 3 K w / J
    for inertia, seconds in ((2.93e9, 26.0), (4.872e9, 44.0), (4.872e6, 0.04)):
        other = turbine.replace(
            **{"drivetrain.rotor_inertia": inertia, "control.filter_frequency": 1e4, "control.torque.rate_limit": 1e12}
        )
        model = build(other)
        steady = operating_point(model, 10.0)
        near = Start(rotor_speed=1.001 * steady.rotor_speed, generator_torque=steady.generator_torque * 1.001**2)
        time = inertia / (3.0 * other.control.torque.optimal_gain * steady.rotor_speed)
        assert time == pytest.approx(seconds, rel=0.1)
        step = 0.02 * time
        exact = build(other, ModelOptions(time_step=step))
        result = run(exact, SteadyWind(speed=10.0), 100 * step, ["rotor_speed"], start=near, output_step=step)
        left = (result["rotor_speed"] - steady.rotor_speed) / (0.001 * steady.rotor_speed)
        assert left[-1] == pytest.approx(np.exp(-2.0), rel=0.03)  # the torque is that of the last sample


def test_the_pitch_actuator_moves_exactly(model: Model) -> None:
    w, demand = 6.666667, 0.5 * DEG
    result = stepped(
        model, SteadyWind(speed=10.0), 2.0, {"pitch": demand, "generator_torque": 2.55e7}, channels=["pitch_1"]
    )
    t = result.time
    assert result["pitch_1"] == pytest.approx(demand * (1.0 - (1.0 + w * t) * np.exp(-w * t)), abs=1e-15)
    far = stepped(model, SteadyWind(speed=10.0), 10.0, {"pitch": 40 * DEG}, channels=["pitch_1", "pitch_rate_1"])
    assert far["pitch_rate_1"].max() == pytest.approx(8 * DEG, rel=1e-6)
    assert far["pitch_1"].max() == pytest.approx(25 * DEG, rel=1e-6)


def gusty(mean: float = 10.0) -> WindSeries:
    t = np.linspace(0.0, 60.0, 121)
    return WindSeries(time=t, speed=mean * (1.0 + 0.2 * np.sin(0.2 * t)))


def test_energy_is_kept(turbine: PowerTurbine) -> None:
    model = build(turbine.replace(**{"drivetrain.friction": 2e6}))
    channels = ["rotor_speed", "aerodynamic_power", "generator_torque", "generator_speed"]
    result = run(model, gusty(), 60.0, channels)
    speed = result["rotor_speed"]
    torque = result["generator_torque"]
    torque[1:] = 0.5 * (torque[1:] + torque[:-1])  # what acts at a call of the controller is the mean of both values
    left = result["aerodynamic_power"] - torque * speed - 2e6 * speed**2
    stored = 0.5 * turbine.drivetrain.inertia * np.diff(speed[[0, -1]] ** 2)[0]
    gained = np.trapezoid(left, result.time)
    assert abs(stored) > 5e6
    assert gained == pytest.approx(stored, abs=1e-7 * np.trapezoid(result["aerodynamic_power"], result.time))


@pytest.mark.parametrize("flexible", [False, True])
def test_the_scheme_is_of_second_order(turbine: PowerTurbine, flexible: bool) -> None:
    changes: dict[str, Any] = {"drivetrain.friction": 1e6}
    if flexible:  # a shaft of 0.5 Hz
        changes |= {"drivetrain.generator_inertia": 3e8, "drivetrain.stiffness": 2.5e9, "drivetrain.damping": 2e8}
    wind = WindSeries(time=np.linspace(0.0, 20.0, 20001), speed=9.0 + np.sin(0.6 * np.linspace(0.0, 20.0, 20001)))
    seen = {}
    for dt in (0.2, 0.1, 0.05, 0.0125):
        model = build(turbine.replace(**changes), ModelOptions(time_step=dt))
        result = stepped(model, wind, 20.0, {"generator_torque": 2.2e7}, channels=["rotor_speed"], output_step=0.2)
        seen[dt] = result["rotor_speed"]
    errors = [float(np.sqrt(np.mean((seen[dt] - seen[0.0125]) ** 2))) for dt in (0.2, 0.1, 0.05)]
    orders = np.log2(np.divide(errors[:-1], errors[1:]))
    assert orders.min() > 1.85, (errors, orders)


def test_a_shaft_twists_by_the_torque_it_carries_and_rings_at_its_frequency(turbine: PowerTurbine) -> None:
    stiff, inner = 2.5e9, 3e8
    flexible = turbine.replace(
        **{"drivetrain.stiffness": stiff, "drivetrain.generator_inertia": inner, "drivetrain.damping": 1e6}
    )
    model = build(flexible)
    point = operating_point(model, 10.0)
    assert point["q drivetrain"] == pytest.approx(
        (point["rotor_torque"] - 200.0 * point.rotor_speed) / stiff, rel=1e-12
    )
    result = stepped(
        model, SteadyWind(speed=10.0), 20.0, {"generator_torque": 0.5 * point.generator_torque}, channels=["all"]
    )
    twist = result["q drivetrain"] - result["q drivetrain"].mean()
    crossings = np.flatnonzero((twist[:-1] < 0.0) & (twist[1:] >= 0.0))
    frequency = (len(crossings) - 1) / (result.time[crossings[-1]] - result.time[crossings[0]])
    assert frequency == pytest.approx(np.sqrt(stiff * (1 / 2.93e9 + 1 / inner)) / (2 * np.pi), rel=0.01)


# surroundings ----------------------------------------------------------------------------------------


def test_yaw_takes_the_cube_of_its_cosine(turbine: PowerTurbine) -> None:
    angle = 20 * DEG
    power = []
    for exponent, direction in ((3.0, 0.0), (3.0, angle), (2.0, -angle)):
        model = build(turbine.replace(power_yaw_exponent=exponent))
        point = operating_point(model, SteadyWind(speed=10.0, direction=direction), rotor_speed=0.6890, pitch=0.0)
        power.append(point["aerodynamic_power"])
    assert power[1] / power[0] == pytest.approx(np.cos(angle) ** 3, rel=1e-12)
    assert power[2] / power[0] == pytest.approx(np.cos(angle) ** 2, rel=1e-12)
    assert point["skew_angle"] == pytest.approx(angle)


def test_the_yaw_drive_turns_the_nacelle_into_the_wind(turbine: PowerTurbine) -> None:
    model = build(turbine, ModelOptions(yaw="driven"))
    wind = SteadyWind(speed=10.0, direction=0.3)
    result = stepped(
        model, wind, 100.0, {"yaw_rate": -0.01, "generator_torque": 2.2e7}, channels=["nacelle_yaw", "skew_angle"]
    )
    assert result["nacelle_yaw"][-1] == pytest.approx(-100.0 * turbine.yaw.rate, rel=2e-3)
    assert result["skew_angle"] == pytest.approx(np.abs(0.3 + result["nacelle_yaw"]), abs=1e-9)


def test_density_in_time_acts_at_once(turbine: PowerTurbine) -> None:
    air = Air(temperature=TimeSeries(time=[0.0, 2.0, 2.0], value=[15.0, 15.0, -10.0]))
    model = build(turbine, environment=Environment(air=air))
    result = run(model, SteadyWind(speed=10.0), 4.0, ["aerodynamic_power", "air_density"])
    ratio = result["aerodynamic_power"][40] / result["aerodynamic_power"][39]
    assert ratio == pytest.approx(result["air_density"][40] / result["air_density"][39], rel=1e-9)
    assert ratio > 1.09


def test_rain_takes_its_power_and_never_more_than_there_is(turbine: PowerTurbine) -> None:
    rain = Rain(rate=32.0, mode="seed", diameter=3.0)
    dry, wet = (build(turbine, environment=Environment(rain=r)) for r in (None, rain))
    at = {"rotor_speed": 0.6890, "pitch": 0.0}
    loss = rain_power_loss(rain_parameters(rain, R), 10.0)
    seen = operating_point(wet, 10.0, **at)
    assert seen["rain_power_loss"] == pytest.approx(loss)
    assert seen["aerodynamic_power"] == pytest.approx(operating_point(dry, 10.0, **at)["aerodynamic_power"] - loss)
    flood = build(turbine, environment=Environment(rain=Rain(rate=709.2, mode="seed", diameter=6.0)))
    assert operating_point(flood, 10.0, **at)["aerodynamic_power"] == pytest.approx(0.0, abs=1e-6)


def test_a_field_of_wind_is_averaged_over_the_disk(turbine: PowerTurbine) -> None:
    # 10 m/s and a linear shear, whose mean over the disk is that of its centre; and one half of the disk in a lull
    z, y = np.linspace(10.0, 310.0, 31), np.linspace(-150.0, 150.0, 31)
    velocity = np.zeros((8, 31, 31, 3), np.float32)
    velocity[..., 0] = (10.0 + 0.01 * (z - turbine.hub_height))[:, None]
    sheared = WindBox(velocity=velocity, dt=10.0, dy=10.0, dz=10.0, bottom=10.0, speed=10.0, periodic=True)
    half = velocity.copy()
    half[..., 0] = np.where(y < 0.0, 8.0, 12.0)
    split = WindBox(velocity=half, dt=10.0, dy=10.0, dz=10.0, bottom=10.0, speed=10.0, periodic=True)
    seen = {}
    for n in (1, 32, 500):
        model = build(turbine, ModelOptions(disk_points=n))
        for name, box in (("sheared", sheared), ("split", split)):
            result = run(model, box, 1.0, ["disk_wind_speed", "wind_x"], start=Start(rotor_speed=0.7))
            seen[name, n] = result["disk_wind_speed"][0]
            assert result["wind_x"][0] == pytest.approx(10.0 if name == "sheared" else 12.0, abs=0.01)
    assert seen["sheared", 500] == pytest.approx(10.0, abs=0.01)
    assert seen["sheared", 32] == pytest.approx(10.0, abs=0.06)
    assert seen["split", 500] == pytest.approx(10.0, abs=0.1)
    assert abs(seen["split", 1] - 10.0) > 1.0  # option: one point sees one half


# behind the same front -------------------------------------------------------------------------------


def test_events_reach_it(model: Model) -> None:
    events = [{"at": 2.0, "type": "grid_loss", "until": 4.0}, {"at": 6.0, "type": "pitch_stuck", "blade": 2}]
    channels = ["generator_torque", "rotor_speed", "pitch_1", "pitch_2"]
    wind = WindSeries(time=[0.0, 20.0], speed=[12.0, 14.0])
    result = run(model, wind, 20.0, channels, events=events)
    without = result["generator_torque"][(result.time >= 2.0) & (result.time < 4.0)]
    assert not without.any()
    assert result["rotor_speed"][80] > result["rotor_speed"][40]
    after = result.time > 6.1
    assert np.ptp(result["pitch_2"][after]) == 0.0
    assert np.ptp(result["pitch_1"][after]) > 1 * DEG
    assert [entry.what for entry in result.log][:2] == ["grid lost", "grid lost: over"]
    with pytest.raises(InputError, match="there is no flap 1; pmsg20mw has none"):
        simulate(model, wind, duration=5.0, events=[{"at": 1.0, "type": "flap_stuck", "blade": 1}])


def test_a_brake_stops_the_rotor(turbine: PowerTurbine) -> None:
    model = build(turbine.replace(**{"drivetrain.brake_torque": 5e7}))
    result = stepped(model, SteadyWind(speed=8.0), 120.0, {"brake": 1.0, "pitch": 25 * DEG}, channels=["rotor_speed"])
    assert result.status is Status.OK
    assert abs(result["rotor_speed"][-1]) < 0.05


def test_a_plain_python_controller_runs_it_and_repeats_bit_by_bit(model: Model) -> None:
    from meltemi.control import signals as s

    def update(state: Any, measured: Any, demands: Any, dt: float) -> None:
        demands[s.GENERATOR_TORQUE] = 5.377e7 * measured[s.GENERATOR_SPEED] ** 2

    results = [
        run(model, gusty(), 30.0, ["rotor_speed"], controller=meltemi.Controller(update))["rotor_speed"] for _ in "ab"
    ]
    assert np.array_equal(*results)
    assert np.ptp(results[0]) > 0.01


def test_a_batch_takes_models_and_what_makes_them(model: Model) -> None:
    cases = [
        meltemi.Run(made, SteadyWind(speed=9.0), duration=2.0, name=name)
        for name, made in (("model", model), ("function", lambda: model))
    ]
    for outcome in meltemi.simulate_batch(cases):
        assert outcome.ok, outcome.message
        assert outcome.value["generator_power"][-1] == pytest.approx(operating_point(model, 9.0)["generator_power"])


def test_channels_of_blades_and_options_of_modes_are_refused_by_name(model: Model, turbine: PowerTurbine) -> None:
    calm = SteadyWind(speed=8.0)
    with pytest.raises(InputError, match="'TwrBsMyt': pmsg20mw is a power-coefficient turbine, without the blades"):
        simulate(model, calm, duration=1.0, channels=["TwrBsMyt"])
    with pytest.raises(InputError, match="did you mean rotor_speed"):
        simulate(model, calm, duration=1.0, channels=["rotor_spped"])
    with pytest.raises(InputError, match="no channel 'rotor_aero_thrust'"):
        simulate(model, calm, duration=1.0, channels=["rotor_aero_thrust"])
    with pytest.raises(InputError, match=r"options\.flap_modes concerns blades and tower"):
        build(turbine, ModelOptions(flap_modes=3))
    with pytest.raises(InputError, match="blade_stations and tower_stations need blades"):
        simulate(model, calm, duration=1.0, stations=meltemi.Stations(blade=(10.0,)))
    loops = meltemi.control.LoadControl(loops=(meltemi.control.HarmonicLoop(harmonic=1, integral_gain=1e-9),))
    with pytest.raises(InputError, match="loops, which need loads of the blades: pmsg20mw"):
        meltemi.control.LoadController(turbine, loops)
    assert "rotor_aero_torque" in kind_of(model).channels(model, meltemi.Stations())


def test_the_default_time_step_follows_the_inertia_and_the_shaft(turbine: PowerTurbine) -> None:
    def step(**changes: float) -> float:
        model = build(turbine.replace(**{f"drivetrain.{name}": value for name, value in changes.items()}))
        return kind_of(model).time_step(model)

    assert step() == 0.05
    assert step(rotor_inertia=4.872e6) == pytest.approx(0.0125)
    # two masses at w: 0.4 / w, a divisor of 0.05 s
    w = np.sqrt(7e9 * (1 / 2.93e9 + 1 / 1e7))
    assert step(stiffness=7e9, generator_inertia=1e7) <= 0.4 / w < 2 * step(stiffness=7e9, generator_inertia=1e7)


@pytest.mark.parametrize(
    ("changes", "cause"),
    [
        ({"rotor_inertia": 4.872}, r"drivetrain.rotor_inertia 4.872 kg m\^2"),
        ({"stiffness": 1e20, "generator_inertia": 1e4}, "drivetrain.stiffness 1e\\+20 N m/rad is large"),
    ],
)
def test_a_time_step_of_nearly_nothing_is_refused(turbine: PowerTurbine, changes: dict[str, float], cause: str) -> None:
    tiny = turbine.replace(**{f"drivetrain.{name}": value for name, value in changes.items()})
    with pytest.raises(InputError, match=f"pmsg20mw: its time step would be .* s, .*{cause}.*set options.time_step"):
        simulate(build(tiny), SteadyWind(speed=9.0), duration=1.0)
    assert default_step(build(tiny, ModelOptions(time_step=1e-6))) == 1e-6


# against the aeroelastic machine, and derivatives -----------------------------------------------------


@pytest.mark.long  # 180,000 evaluations of the rotor, and the kernels of the aeroelastic machine
def test_its_steady_power_is_that_of_the_rigid_aeroelastic_turbine() -> None:
    nrel = meltemi.load_turbine("nrel5mw")
    twin = build(meltemi.analysis.power_turbine_of(nrel))
    rigid = build(
        nrel,
        ModelOptions(
            **dict.fromkeys("flap_modes edge_modes torsion_modes fore_aft_modes side_side_modes".split(), 0),
            locked=("drivetrain",),
            stall="static",  # dynamic stall in the tower's wake changes the mean power above rated by 2 % at a pitch
            inflow="quasi_steady",
        ),
    )
    for speed in (5.0, 7.0, 9.0, 13.0, 18.0, 24.0):
        one, two = operating_point(twin, speed), operating_point(rigid, speed)
        assert one["generator_power"] == pytest.approx(two["generator_power"], rel=1e-3), speed
        assert one.rotor_speed == pytest.approx(two.rotor_speed, rel=1e-3)
        assert one.pitch == pytest.approx(two.pitch, abs=0.05 * DEG)
        assert one["rotor_aero_thrust"] == pytest.approx(two["rotor_aero_thrust"], rel=5e-3)


@pytest.mark.long  # kernels of duals
def test_the_linear_model_is_the_slope_of_the_machine(turbine: PowerTurbine) -> None:
    flexible = turbine.replace(**{"drivetrain.stiffness": 2.5e9, "drivetrain.generator_inertia": 3e8})
    for t in (turbine, flexible):
        model = build(t)
        point = operating_point(model, 14.0)
        linear = meltemi.analysis.linearise(model, point, outputs=["rotor_speed", "aerodynamic_power"])
        assert "v generator" in linear.states
        assert ("q drivetrain" in linear.states) == (t is flexible)
        i = linear.states.index("v generator")
        j = linear.inputs.index("wind_speed")
        step = 1e-4

        def torque(speed: float, wind: float) -> float:
            return operating_point(model, wind, rotor_speed=speed, pitch=point.pitch)["rotor_aero_torque"]  # noqa: B023

        by_speed = (torque(0.75 + step, 14.0) - torque(0.75 - step, 14.0)) / (2 * step)
        by_wind = (torque(0.75, 14.0 + step) - torque(0.75, 14.0 - step)) / (2 * step)
        if t is turbine:
            inertia = t.drivetrain.inertia
            assert linear.A[i, i] == pytest.approx((by_speed - 200.0) / inertia, rel=1e-6)
            assert linear.B[i, j] == pytest.approx(by_wind / inertia, rel=1e-6)
        else:
            (mode,) = [m for m in linear.modes() if "drivetrain" in m.coordinates]
            assert mode.frequency == pytest.approx(np.sqrt(2.5e9 * (1 / 2.93e9 + 1 / 3e8)), rel=1e-3)


@pytest.mark.long  # kernels of duals
def test_derivatives_of_a_run_are_those_of_differences() -> None:
    # of the table, which has a slope at zero pitch, below which the formula has none, and without switches: below rated
    # wind, away from the actuator's limit
    turbine = meltemi.load_turbine("pmsg20mw-bem").replace(**{"pitch_actuator.minimum": -0.05})
    model, wind = build(turbine), gusty(7.5)
    names = ["disk.inertia", "aerodynamics.air_density", "pitch_offset", "turbine.drivetrain.friction"]
    arguments: dict[str, Any] = {"duration": 20.0, "channels": ["rotor_speed", "generator_power"]}
    found = meltemi.analysis.sensitivity(meltemi.Run(model, wind, **arguments), names)
    for k, name in enumerate(names):
        given = 1e-2 if "friction" in name else None
        low, high, step = meltemi.analysis.finite_difference_runs(
            meltemi.Run(model, wind, **arguments), name, step=given
        )
        difference = (high.data - low.data) / (2.0 * step)
        error = np.abs(found.slopes[..., k] - difference).max(axis=0)
        assert (error < 3e-5 * np.abs(difference).max(axis=0)).all(), name


def test_the_nacelle_of_a_power_turbine_stands_at_its_angle() -> None:
    found = {}
    for yaw in (-0.5, 0.5):
        model = meltemi.build(meltemi.load_turbine("pmsg20mw"), meltemi.ModelOptions(nacelle_yaw=yaw))
        found[yaw] = meltemi.operating_point(model, meltemi.SteadyWind(speed=8.0, direction=0.5))["generator_power"]
    plain = meltemi.build(meltemi.load_turbine("pmsg20mw"))
    assert found[-0.5] == pytest.approx(meltemi.operating_point(plain, 8.0)["generator_power"], rel=1e-9)
    assert found[0.5] < 0.3 * found[-0.5]
