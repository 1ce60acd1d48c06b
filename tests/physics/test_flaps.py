"""Trailing-edge flaps: increments, actuators, loads of their own blade, unsteady lift."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import meltemi
from meltemi import Controller, InputError, Model, ModelOptions, Simulation, SteadyWind, Turbine
from meltemi.aero.flaps import ALPHAS, DELTAS, STEP, flap_increment
from meltemi.aero.polars import SectionCoefficients
from meltemi.aero.tables import AeroNode, AeroOptions, AeroParameters, FlapIncrement, FlapParameters
from meltemi.compiler import Array3, KernelRecord
from meltemi.control import signals as s
from meltemi.simulation.case import Case
from meltemi.simulation.run import Run
from meltemi.turbine import naca64618_flap, with_flaps
from meltemi.turbine.flaps import DEFLECTION, LIFT

Float = NDArray[np.float64]
RIGID: dict[str, Any] = {f"{name}_modes": 0 for name in ("flap", "edge", "torsion", "fore_aft", "side_side")}
RIGID |= {"time_step": 0.01}
RATED = 12.1 * np.pi / 30.0


@pytest.fixture(scope="module")
def flapped(turbine: Turbine) -> Turbine:
    return with_flaps(turbine)


@pytest.fixture(scope="module")
def rigid(flapped: Turbine) -> Model:
    return meltemi.build(flapped, ModelOptions(**RIGID))


def moments(model: Model, speed: float, pitch: float, angles: tuple[float, float, float]) -> Float:
    """(blades,) [kN m] steady root moments out of plane with flaps at ``angles`` [deg], pitch [deg]."""
    case = Case(model, SteadyWind(speed=speed))
    meltemi.Start(rotor_speed=RATED, pitch=np.radians(pitch)).put(case)
    case["flap"][0, 0] = np.radians(angles)
    case.settle(0.0)
    case.loads(0.0)
    return case.view("root")["moment_y"] / 1e3


# from the slope of the table's middle, 0.0407 per degree; near rated the sections work at 6 degrees, where the table's
# own slope is 0.032
SLOPES: dict[tuple[float, float], tuple[float, float]] = {
    (11.4, 0.0): (167.0, 0.13),
    (15.0, 10.45): (206.0, 0.1),
    (20.0, 17.47): (217.0, 0.1),
    (25.0, 23.47): (226.0, 0.1),
}


@pytest.mark.parametrize(("point", "expected"), SLOPES.items())
def test_a_flap_moves_its_own_blades_root_moment(
    rigid: Model, point: tuple[float, float], expected: tuple[float, float]
) -> None:
    slope, tolerance = expected
    up, down, none = (moments(rigid, *point, (d, 0.0, 0.0)) for d in (5.0, -5.0, 0.0))
    assert (up - down)[0] / 10.0 == pytest.approx(slope, rel=tolerance)
    others = np.abs(up - none)[1:]  # through the mean induction only
    assert np.all(others < 0.03 * abs(up - none)[0])


class Flaps(KernelRecord):
    """What the look-up of increments takes of the record of the aerodynamics."""

    flap_nodes: Array3
    increments: FlapIncrement
    flap: FlapParameters


def increment(share: Float, table: Float, flap: Float, alpha: float, n: int = 0) -> SectionCoefficients:
    """What flaps add at a node of the first blade."""
    m: Any = Flaps("floats", {"flap_nodes": share, "increments": table, "flap": flap})
    return flap_increment(alpha, m.flap_nodes, m, 0, n)


def test_increments_are_those_of_the_table(rigid: Model) -> None:
    share, flap = np.ones((1, 1, 1)), np.zeros((4, 1, 1))
    rows = np.array([[float(x) for x in line.split()] for line in LIFT.strip().splitlines()])
    for alpha, *lifts in rows:
        for delta, lift in zip(DEFLECTION, lifts, strict=True):
            flap[0, 0, 0] = np.radians(delta)
            found = increment(share, rigid.rotor.increments, flap, np.radians(alpha))
            assert found.lift == pytest.approx(lift - lifts[3], abs=1e-9)
            share_less = increment(0.3 * share, rigid.rotor.increments, flap, np.radians(alpha))
            assert share_less.lift == pytest.approx(0.3 * found.lift, abs=1e-12)


def test_increments_are_smooth_and_fade_out_past_stall(rigid: Model) -> None:
    grid = rigid.rotor.increments[0].reshape(ALPHAS, DELTAS, 3)
    alpha = np.degrees(STEP) * (np.arange(ALPHAS) - ALPHAS // 2)
    far = (alpha < -25.9) | (alpha > 29.9)  # 16 degrees beyond the data
    np.testing.assert_allclose(grid[far], 0.0, atol=1e-12)
    np.testing.assert_allclose(grid[:, DELTAS // 2], 0.0, atol=1e-12)
    inside = grid[:, DELTAS // 2 - 15 : DELTAS // 2 + 16, 0]  # between the limits
    bends = [np.abs(np.diff(inside, n=2, axis=axis)).max() for axis in (0, 1)]
    assert max(bends) < 0.03


@pytest.mark.parametrize("stall", ["static", "hansen"])
def test_in_steady_flow_the_lift_is_that_of_the_polar_and_the_increment(flapped: Turbine, stall: Any) -> None:
    model = meltemi.build(flapped, ModelOptions(**RIGID, stall=stall))
    found = []
    for delta in (0.0, 8.0):
        case = Case(model, SteadyWind(speed=18.0))
        meltemi.Start(rotor_speed=RATED, pitch=np.radians(14.92)).put(case)
        case["flap"][0, 0] = np.radians(delta)
        for _ in range(4):
            case.settle(0.0)
        view = case.view("flow")
        found.append((view["alpha"][0].copy(), view["lift"][0].copy(), case["flap"].copy()))
    alpha, lift, flap = found[1]
    angles = np.linspace(-np.pi, np.pi, model.rotor.polars.shape[1])
    for n in np.flatnonzero(model.rotor.flap_nodes[0, 0] > 0.0):
        added = increment(model.rotor.flap_nodes, model.rotor.increments, flap, alpha[n], n)
        polar = model.rotor.polars[int(model.rotor.aero_nodes[AeroNode.index("polar"), 0, n])]
        # the curved flow of a coned blade turns it a little
        assert lift[n] == pytest.approx(np.interp(alpha[n], angles, polar[:, 0]) + added.lift, abs=0.02)
        assert added.moment < -0.02 * model.rotor.flap_nodes[0, 0, n]


def deflected(model: Model, wind: SteadyWind, demand: Any, duration: float, **more: Any) -> meltemi.Result:
    def update(state: Any, measured: Any, demands: Any, dt: float) -> None:
        demands[s.GENERATOR_TORQUE] = 4.0e4
        demands[s.PITCH_DEMAND : s.PITCH_DEMAND + 3] = 0.3
        demands[s.FLAP_DEMAND] = demand(measured[s.TIME])

    channels = (
        "flap_1_angle_1",
        "flap_1_rate_1",
        "flap_1_angle_2",
        "root_moment_out_of_plane_1",
        *more.pop("extra", ()),
    )
    start = meltemi.operating_point(model, wind, rotor_speed=RATED, pitch=0.3)
    return meltemi.simulate(
        model, wind, duration=duration, controller=Controller(update), channels=channels, output_step=0.01, start=start
    )


def test_limits_of_the_actuator(rigid: Model) -> None:
    result = deflected(rigid, SteadyWind(speed=18.0), lambda t: 1.0 if t < 2.0 else -1.0, 4.0)
    angle, rate = np.degrees(result["flap_1_angle_1"]), np.degrees(result["flap_1_rate_1"])
    assert angle.max() == pytest.approx(15.0, abs=1e-9)
    assert angle.min() == pytest.approx(-15.0, abs=1e-9)
    assert np.abs(rate).max() == pytest.approx(40.0, abs=1e-9)
    assert np.all(result["flap_1_angle_2"] == 0.0)
    # no wind-up: the demand turns at 2 s, and the flap leaves its limit at once
    after = result.between(2.0, 2.2)
    assert np.degrees(after["flap_1_angle_1"][-1]) < 9.0


def test_small_steps_follow_the_second_order_system(rigid: Model) -> None:
    result = deflected(rigid, SteadyWind(speed=18.0), lambda t: np.radians(0.1), 0.3)
    w, z = 62.8, 0.7
    wd, t = w * np.sqrt(1.0 - z * z), result.time
    expected = 0.1 * (1.0 - np.exp(-z * w * t) * (np.cos(wd * t) + z * w / wd * np.sin(wd * t)))
    np.testing.assert_allclose(np.degrees(result["flap_1_angle_1"]), expected, atol=1e-10)


def test_lift_of_a_flap_builds_up_after_wagner(flapped: Turbine) -> None:
    at_once = flapped.replace(**{"blade.flaps": [naca64618_flap().replace(frequency=None).content()]})
    node = 15
    found = {}
    for stall in ("static", "hansen"):
        options = ModelOptions(**RIGID, stall=stall, inflow="constant", blade_nodes=20)
        model = meltemi.build(at_once, options)
        name = f"node_{node}_lift_1"
        lift = deflected(model, SteadyWind(speed=18.0), lambda t: np.radians(2.0) * (t >= 1.0), 1.3, extra=(name,))
        found[stall] = lift[name] - lift[name][90]
    step = found["static"][105]
    assert step > 0.06
    # half of the lift at once, the other half with Wagner's lags; a semi-chord passes in 0.02 s
    share = found["hansen"] / step
    assert 0.5 < share[101] < 0.7
    assert 0.9 < share[-1] < 1.1  # the wake answers in part
    assert np.all(np.diff(share[102:]) > -1e-3)


@pytest.mark.slow
def test_lanes_and_floats_agree_with_flaps(flapped: Turbine) -> None:
    model = meltemi.build(flapped, meltemi.ModelOptions(integration="explicit"))
    runs = []
    for numbers in ("lanes", "floats"):
        run = Simulation(
            Run(model, SteadyWind(speed=18.0, shear_exponent=0.2), duration=3.0, channels=["all"]), numbers=numbers
        )
        run.case["flap"][0, 0] = (0.1, -0.05, 0.2)
        run.case["demands"][s.FLAP_DEMAND : s.FLAP_DEMAND + 3] = (-0.1, 0.2, 0.0)
        while not run.finished:
            run.advance(50)
        runs.append(run.result().data)
    scale = np.abs(runs[1]).max(axis=0) + 1e-4  # induction at the root is far smaller, and rounding
    assert np.max(np.abs(runs[0] - runs[1]) / scale) < 1e-10


@pytest.mark.long
def test_derivatives_with_flaps_are_limits_of_differences(flapped: Turbine) -> None:
    model = meltemi.build(flapped)
    wind, channel = SteadyWind(speed=18.0, shear_exponent=0.2), "root_moment_out_of_plane_1"
    start = meltemi.operating_point(model, wind)
    case = {"duration": 2.0, "channels": [channel], "start": start}

    found = meltemi.analysis.sensitivity(meltemi.Run(model, wind, **case), ["aerodynamics.air_density"])  # type: ignore[arg-type]
    low, high, step = meltemi.analysis.finite_difference_runs(
        meltemi.Run(model, wind, **case), "aerodynamics.air_density"
    )  # type: ignore[arg-type]
    change = (high[channel].mean() - low[channel].mean()) / (2.0 * step)
    assert found.mean(channel)[1][0] == pytest.approx(change, rel=1e-5)


@pytest.mark.slow
def test_linear_models_have_the_flaps_of_all_blades(flapped: Turbine) -> None:
    model = meltemi.build(flapped)
    point = meltemi.operating_point(model, 18.0)
    found = meltemi.analysis.linearise(model, point, ("flap_1_1",), ("root_moment_out_of_plane_1",), azimuth=0.4)
    i, j = (found.states.index(f"blade 1 flap 1{what}") for what in ("", " rate"))
    w, z = 62.8, 0.7
    np.testing.assert_allclose(found.A[j, [i, j]], [-w * w, -2.0 * z * w], rtol=1e-12)
    assert found.A[i, j] == pytest.approx(1.0)
    assert found.B[j, 0] == pytest.approx(w * w)
    # the column of the deflection against differences of the evaluation
    case = Case(model, point.wind, numbers="floats")
    case["aero_options"][AeroOptions.index("iterations")] = 30
    case["aero"][AeroParameters.index("induction_tolerance")] = 0.0
    moved = []
    for step in (-1e-6, 1e-6):
        point.put(case, 0.4)
        case["flap"][0, 0, 0] = step
        for _ in range(3):
            case.evaluate(0.0)
        case.rates()
        case.loads(0.0)
        moved.append(np.concatenate([case["a"], [case.view("root")["moment_y"][0]]]))
    difference = (moved[1] - moved[0]) / 2e-6
    v = [found.states.index(f"v {name}") for name in model.coordinates]
    np.testing.assert_allclose(found.A[v, i], difference[:-1], rtol=1e-5, atol=1e-6 * np.abs(difference[:-1]).max())
    assert found.C[0, i] == pytest.approx(difference[-1], rel=1e-5)
    fixed = meltemi.analysis.linearise(model, point, ("flap_1_1",), ("root_moment_out_of_plane_1",), azimuths=1)
    assert fixed.inputs == ("flap_1_collective", "flap_1_cosine", "flap_1_sine")
    assert {"flap 1 collective", "flap 1 rate sine"} <= set(fixed.states)


def test_without_deflection_nothing_changes(turbine: Turbine, flapped: Turbine) -> None:
    runs = [
        meltemi.simulate(
            meltemi.build(t), SteadyWind(speed=14.0), duration=2.0, channels=["root_moment_out_of_plane_1"]
        )
        for t in (turbine, flapped)
    ]
    np.testing.assert_allclose(runs[0].data, runs[1].data, rtol=1e-12)


def test_two_flaps_share_a_blade(turbine: Turbine) -> None:
    whole = naca64618_flap()
    halves = whole.replace(end=0.81), whole.replace(begin=0.81)
    models = [meltemi.build(with_flaps(turbine, *flaps), ModelOptions(**RIGID)) for flaps in ((whole,), halves)]
    np.testing.assert_allclose(models[1].rotor.flap_nodes.sum(axis=0), models[0].rotor.flap_nodes[0], atol=1e-12)
    one = moments(models[0], 18.0, 14.92, (5.0, 0.0, 0.0))
    case = Case(models[1], SteadyWind(speed=18.0))
    meltemi.Start(rotor_speed=RATED, pitch=np.radians(14.92)).put(case)
    case["flap"][0, :, 0] = np.radians(5.0)
    case.settle(0.0)
    case.loads(0.0)
    np.testing.assert_allclose(case.view("root")["moment_y"] / 1e3, one, rtol=1e-9)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"begin": 0.97}, "begin 0.97 must lie inside end 0.96"),
        ({"end": 1.1}, "less than or equal to 1"),
        ({"minimum": 0.0, "maximum": 0.0}, "must be less than maximum"),
        ({"minimum": 0.2}, "less than or equal to 0"),
        ({"maximum": 0.6}, "the limits lie outside increments.deflection"),
        ({"rate": 0.0}, "greater than 0"),
    ],
)
def test_a_flap_that_cannot_be_is_refused(changes: dict[str, float], message: str) -> None:
    with pytest.raises(InputError, match=message):
        naca64618_flap().replace(**changes)
