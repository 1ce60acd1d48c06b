"""Every option changes something, in the direction it should."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import meltemi
from meltemi import (
    BEDDOES,
    Environment,
    ModelOptions,
    Result,
    SteadyWind,
    Turbine,
    operating_point,
    simulate,
)
from meltemi.environment import Air
from meltemi.simulation.bladed.build import _blade_layout

STEADY: list[tuple[dict[str, Any], dict[str, Any], str, float]] = [
    # option, base, channel, sign of option minus base
    ({"wake": "none"}, {}, "rotor_aero_thrust", +1.0),
    ({"tip_loss": False}, {}, "generator_power", +1.0),
    ({"hub_loss": False}, {"axial_drag": True}, "node_2_axial_induction_1", -1.0),
    ({"axial_drag": True}, {}, "rotor_aero_thrust", -1.0),
    ({"tangential_drag": True}, {}, "node_10_tangential_induction_1", -1.0),
    ({"tower_influence": "none"}, {}, "generator_power", +1.0),
    ({"tower_influence": "lower_half"}, {"tower_influence": "none"}, "generator_power", -1.0),
    ({"tower_drag": False}, {}, "tower_base_moment_fore_aft", -1.0),
    ({"torsion_modes": 0}, {}, "rotor_aero_thrust", +1.0),
    # blades bent downwind beyond their cone: cambered by the curved flow, and drag as OpenFAST has it
    ({"advanced": {"stall_rotation": "none"}}, {}, "rotor_aero_thrust", -1.0),
    ({"advanced": {"stall_rotation": "openfast"}}, {}, "generator_power", -1.0),
    ({"advanced": {"chord_angle": "openfast"}}, {}, "rotor_aero_thrust", -1.0),
    ({"stall": "static"}, {}, "rotor_aero_thrust", 0.0),
    ({"mode_shapes": "given", "torsion_modes": 0}, {"torsion_modes": 0}, "tip_out_of_plane_1", 0.0),
    ({"flap_modes": 1}, {}, "tip_out_of_plane_1", 0.0),
    ({"edge_modes": 2}, {}, "tip_in_plane_1", 0.0),
    ({"fore_aft_modes": 1}, {}, "tower_top_fore_aft", 0.0),
    ({"side_side_modes": 1}, {}, "tower_top_side_side", 0.0),
    ({"blade_nodes": 40}, {}, "generator_power", 0.0),
    ({"tower_nodes": 41}, {}, "tower_base_moment_fore_aft", 0.0),
    ({"locked": ("blades",)}, {}, "tower_base_moment_fore_aft", 0.0),
    ({"locked": ("tower",)}, {}, "yaw_moment_x", 0.0),
]


def advanced(**options: Any) -> ModelOptions:
    return ModelOptions(advanced=options)


def deck(turbine: Turbine) -> Turbine:
    from meltemi_verification.openfast_deck import deck_turbine

    return deck_turbine(turbine)


@pytest.mark.slow
@pytest.mark.parametrize(("change", "base", "channel", "sign"), STEADY, ids=lambda v: str(v)[:40])
def test_in_steady_operation(
    turbine: Turbine, change: dict[str, Any], base: dict[str, Any], channel: str, sign: float
) -> None:
    described = deck(turbine) if "mode_shapes" in change else turbine
    points = [operating_point(meltemi.build(described, ModelOptions(**kw)), 9.0) for kw in (base, {**base, **change})]
    difference = points[1][channel] - points[0][channel]
    assert abs(difference) > 1e-6 * abs(points[0][channel])
    if sign:
        assert np.sign(difference) == sign


def test_high_induction_correction_raises_thrust_of_a_heavily_loaded_rotor(turbine: Turbine) -> None:
    thrust = [
        meltemi.analysis.rotor_performance(turbine, [12.0], [-0.035], options=advanced(high_induction=kind)).thrust[
            0, 0
        ]
        for kind in ("buhl", "none", "madsen")
    ]
    assert thrust[0] > thrust[1] + 0.02
    assert thrust[2] > thrust[1] + 0.02
    assert abs(thrust[2] - thrust[0]) > 1e-3


def test_rotational_augmentation_raises_torque_and_thrust_in_stall(turbine: Turbine) -> None:
    none, snel, both = (
        meltemi.analysis.rotor_performance(turbine, [3.0], [-0.05], options=ModelOptions(rotational_augmentation=model))
        for model in ("none", "snel", "chaviaropoulos_hansen")
    )
    assert none.torque[0, 0] + 0.001 < snel.torque[0, 0]
    assert none.thrust[0, 0] + 0.001 < snel.thrust[0, 0] < both.thrust[0, 0] - 0.001


def run(turbine: Turbine, options: ModelOptions, wind: SteadyWind | None = None, **keywords: Any) -> Result:
    keywords = {"duration": 30.0, "channels": ["azimuth", "RootMyc1", "YawBrMzp", "RtFldFxh", "GenPwr"], **keywords}
    return simulate(meltemi.build(turbine, options), wind or SteadyWind(speed=10.0), **keywords)


def test_skewed_wake_adds_a_restoring_yaw_moment(turbine: Turbine) -> None:
    wind = SteadyWind(speed=10.0, direction=np.radians(25.0))
    corrected, plain = (run(turbine, ModelOptions(skew=kind), wind)["YawBrMzp"].mean() for kind in ("glauert", "none"))
    # the wind blows towards -y: turning the nacelle clockwise (negative) lines it up
    assert corrected < plain - 1e5


def pitch_step(turbine: Turbine, **options: Any) -> Any:
    """Thrust after a pitch step of the rigid rotor."""
    from meltemi.control import signals as s

    def step(state: Any, measured: Any, demands: Any, dt: float) -> None:
        demands[s.PITCH_DEMAND : s.PITCH_DEMAND + 3] = 0.035 if measured[s.TIME] >= 5.0 else 0.0

    locked = ("tower", "yaw", "generator", "drivetrain", "blades")
    ideal = turbine.replace(**{"pitch_actuator.kind": "ideal"})
    result = run(
        ideal,
        ModelOptions(locked=locked, tower_influence="none", **options),
        duration=60.0,
        controller=meltemi.Controller(update=step),
        start=meltemi.Start(rotor_speed=1.19),
    )
    return result["RtFldFxh"]


def undershoot(thrust: Any) -> tuple[float, float]:
    """Undershoot relative to the change, and samples until half of it is made good."""
    low, final, before = thrust[100:].min(), thrust[-1], thrust[90]
    late = thrust[100 + int(np.argmin(thrust[100:])) :]
    return float((final - low) / (before - final)), float(np.argmax(late > 0.5 * (low + final)))


@pytest.mark.slow
def test_skewed_momentum_lowers_the_induction_of_a_yawed_rotor(turbine: Turbine) -> None:
    """Power falls with the cosine of the yaw error to a power of 2.7, and of 1.2 to 1.5 with more flow through it."""
    speed = 10.3 * np.pi / 30.0
    exponent = {}
    for kind in ("axial", "cylinder", "glauert"):
        model = meltemi.build(turbine, ModelOptions(skew_momentum=kind))
        straight, yawed = (
            operating_point(model, SteadyWind(speed=9.0, direction=yaw), rotor_speed=speed, pitch=0.0)
            for yaw in (0.0, np.radians(30.0))
        )
        loss = yawed["rotor_aero_torque"] / straight["rotor_aero_torque"]
        exponent[kind] = np.log(loss) / np.log(np.cos(np.radians(30.0)))
    assert 2.5 < exponent["axial"] < 3.0
    assert 1.3 < exponent["cylinder"] < 1.8
    assert 0.9 < exponent["glauert"] < exponent["cylinder"]


def test_dynamic_inflow_undershoots_and_recovers_with_its_time(turbine: Turbine) -> None:
    quasi = undershoot(pitch_step(turbine, inflow="quasi_steady", stall="static"))[0]
    quick = undershoot(pitch_step(turbine, inflow="constant", inflow_time=2.0, stall="static"))
    slow = undershoot(pitch_step(turbine, inflow="constant", inflow_time=8.0, stall="static"))
    variable = undershoot(pitch_step(turbine, inflow="variable", stall="static"))
    assert abs(quasi) < 1e-3
    assert min(quick[0], slow[0], variable[0]) > 0.3
    assert slow[1] == pytest.approx(4.0 * quick[1], rel=0.1)
    assert quick[1] < variable[1]


@pytest.mark.slow
def test_dynamic_stall_lags_behind_static_polars(turbine: Turbine) -> None:
    # at 30 deg of yaw in strong wind the angle of attack swings: lift follows late and less
    wind = SteadyWind(speed=18.0, direction=np.radians(30.0))
    series = {}
    for name, options in {
        "static": ModelOptions(stall="static"),
        "hansen": ModelOptions(),
        "beddoes": ModelOptions(stall_constants=BEDDOES),
    }.items():
        result = run(turbine, options, wind, channels=["node_14_lift_1", "node_14_alpha_1"])
        series[name] = result["node_14_lift_1"]
    assert np.ptp(series["hansen"]) < np.ptp(series["static"])
    assert np.max(np.abs(series["beddoes"] - series["hansen"])) > 1e-3


@pytest.mark.slow
def test_stall_fit_of_openfast_differs(turbine: Turbine) -> None:
    wind = SteadyWind(speed=18.0, direction=np.radians(30.0))
    a, b = (run(deck(turbine), advanced(stall_fit=fit), wind)["RtFldFxh"] for fit in ("hansen", "openfast"))
    assert np.max(np.abs(a - b)) > 10.0


@pytest.mark.slow
def test_corrections_and_iterations_and_step_change_little(turbine: Turbine) -> None:
    base = run(turbine, ModelOptions())["RootMyc1"]
    for options, least, most in (
        (advanced(corrections=1), 1e-9, 2e-3),
        (advanced(induction_iterations=12, induction_tolerance=0.0), 1e-13, 1e-8),
        (advanced(induction_tolerance=1e-4), 1e-12, 1e-6),
        (ModelOptions(time_step=0.005), 1e-9, 2e-3),
    ):
        change = np.max(np.abs(run(turbine, options)["RootMyc1"] / base - 1.0))
        assert least <= change < most


def test_air_density_and_gravity(turbine: Turbine) -> None:
    thin = meltemi.build(turbine, environment=Environment(air_density=1.0))
    dense = meltemi.build(turbine)
    assert operating_point(thin, 8.0)["generator_power"] < 0.83 * operating_point(dense, 8.0)["generator_power"]
    floating = meltemi.build(turbine, environment=Environment(gravity=0.0))
    weight = operating_point(dense, 8.0)["tower_base_force_z"] - operating_point(floating, 8.0)["tower_base_force_z"]
    assert weight == pytest.approx(-9.80665 * (240000 + 56780 + 3 * 17740 + 347460), rel=2e-3)


@pytest.mark.parametrize("name", ["nrel5mw", "pmsg20mw"])
def test_points_know_what_surrounds_them(name: str) -> None:
    air = Air(temperature={"time": [0.0, 100.0], "value": [30.0, 10.0]}, humidity=0.5)  # type: ignore[arg-type]
    model = meltemi.build(meltemi.load_turbine(name), environment=Environment(air=air))
    found = [operating_point(model, 8.0)]
    if name == "nrel5mw":
        found.append(meltemi.analysis.parked_point(model, 8.0))
    outside = [c.name for c in found[0].channels.values() if c.source[0] == "outside"]
    begin = simulate(model, SteadyWind(speed=8.0), duration=0.5, channels=outside)
    assert begin["air_density"][0] == pytest.approx(model.environment.density, rel=1e-12)
    for point in found:
        assert [point[c] for c in outside] == pytest.approx([begin[c][0] for c in outside], rel=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["drivetrain", "generator", "yaw", "flap", "edge", "torsion", "tower", "blades"])
def test_locked_coordinates_do_not_move(turbine: Turbine, name: str) -> None:
    model = meltemi.build(turbine, ModelOptions(locked=(name,)))
    assert model.locked.any()
    names = [n for n, locked in zip(model.coordinates, model.locked, strict=True) if locked and n != "generator"]
    channels = ["nacelle_yaw" if n == "yaw" else f"q {n}" for n in names]
    result = simulate(model, SteadyWind(speed=11.0), duration=5.0, channels=[*channels, "generator_speed"])
    for channel in channels:
        assert np.all(result[channel] == 0.0), channel
    assert (np.ptp(result["generator_speed"]) == 0.0) == (name == "generator")


def test_pitch_actuator_lags_and_ideal_does_not(turbine: Turbine) -> None:
    def demand(state: Any, measured: Any, demands: Any, dt: float) -> None:
        from meltemi.control import signals as s

        demands[s.PITCH_DEMAND : s.PITCH_DEMAND + 3] = 0.1 if measured[s.TIME] > 1.0 else 0.0

    pitch: dict[str, Any] = {}
    for kind in ("second_order", "ideal"):
        described = turbine.replace(**{"pitch_actuator.kind": kind})
        result = run(
            described,
            ModelOptions(),
            duration=5.0,
            controller=meltemi.Controller(update=demand),
            start=meltemi.Start(rotor_speed=1.0),
            channels=["pitch_1", "pitch_rate_1"],
        )
        pitch[kind] = result["pitch_1"]
        assert np.max(np.abs(result["pitch_rate_1"])) <= turbine.pitch_actuator.rate_limit + 1e-12
    assert pitch["ideal"][22] == pytest.approx(0.1)
    assert 0.0 < pitch["second_order"][22] < 0.05
    assert pitch["second_order"][-1] == pytest.approx(0.1, abs=1e-3)


@pytest.mark.parametrize(
    ("name", "options", "said"),
    [
        ("iea15mw", {"torsion_modes": 0}, "needs torsion_modes of at least 1, found 0"),
        ("nrel5mw", {"mode_shapes": "given"}, "needs mode_shapes 'computed', found 'given'"),
        ("iea15mw", {"torsion_modes": 3}, "needs at most 5/3/2 flap, edge and torsion modes, found 3/2/3"),
        ("rigid in torsion", {}, "needs a blade with torsion_stiffness or stiffness_matrix"),
    ],
)
def test_residual_modes_that_do_harm(turbine: Turbine, name: str, options: dict[str, Any], said: str) -> None:
    if name == "rigid in torsion":
        described = turbine.replace(**{"blade.structure.torsion_stiffness": None})
    else:
        described = meltemi.load_turbine(name)
    with pytest.raises(meltemi.MeltemiError, match=f"options.residual_modes 2 {said}.*use 0"):
        meltemi.build(described, ModelOptions(residual_modes=2, **options))


def test_environment_and_options_refuse_nonsense() -> None:
    builders: list[Callable[[], Any]] = [
        lambda: ModelOptions(blade_nodes=3),
        lambda: ModelOptions(wake="vortex"),
        lambda: ModelOptions(time_step=0.0),
        lambda: Environment(air_density=-1.0),
    ]
    for builder in builders:
        with pytest.raises(meltemi.InputError, match=r"."):
            builder()


def test_given_blade_nodes_reach_both_ends_within_a_thousandth_of_the_blade(turbine: Turbine) -> None:
    L = turbine.blade.length

    def layout(first: float, last: float) -> Any:
        return _blade_layout(turbine, ModelOptions(blade_nodes=(first * L, 0.3 * L, 0.6 * L, 0.8 * L, last * L)))

    for first, last in ((0.0, 1.0), (0.95e-3, 1.0 - 0.95e-3), (-0.95e-3, 1.0 + 0.95e-3)):
        found = layout(first, last)
        assert found.position == pytest.approx(np.array([0.0, 0.3, 0.6, 0.8, 1.0]) * L)
    for first, last in ((1.05e-3, 1.0), (-1.05e-3, 1.0), (0.0, 1.0 - 1.05e-3), (0.0, 1.0 + 1.05e-3), (0.0, 0.5)):
        with pytest.raises(meltemi.InputError, match="blade_nodes must increase from 0 to the blade length 61.5 m"):
            layout(first, last)
