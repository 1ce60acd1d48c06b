"""The coupled near wake beside a lifting line with helical vortices, momentum, and OLAF; its steps; what works with it.

In plain Python, NUMBA_DISABLE_JIT=1, most of this file takes seconds.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import meltemi
from meltemi import (
    InputError,
    Model,
    ModelOptions,
    Run,
    Simulation,
    Start,
    SteadyWind,
    Turbine,
    TurbulentWind,
    UnsupportedError,
)
from meltemi.aero.tables import AeroNode, BladeFlow, PolarPoint, SectionConstants
from meltemi.analysis import linearise, operating_point
from meltemi.compiler import interpreted
from meltemi.gradients.adjoint import gradient
from meltemi.io import restore_state, save_state
from meltemi.simulation.case import Case
from meltemi.simulation.simulate import march
from meltemi.simulation.step import begin_parts_step
from meltemi.turbine import with_flaps
from meltemi.vortex.near_wake import part_of

pytestmark = pytest.mark.long  # machine code of a turbine with this part
compiled = pytest.mark.skipif(interpreted(), reason="takes too long in plain Python, or has derivatives")
Float = NDArray[np.float64]
OLAF = Path(__file__).parents[3] / "shared" / "reference" / "olaf" / "rigid_12.npz"
SPEED, WIND, RADIUS = 12.1 * np.pi / 30.0, 12.0, 63.0
LOADS = [BladeFlow.index(name) for name in ("alpha", "normal_force", "driving_force", "pitching_moment")]
LOCKED = ("tower", "blades", "yaw", "drivetrain", "generator")
RIGID = ModelOptions(stall="static", tower_influence="none", tower_nodes=3, locked=LOCKED)
STEADY = SteadyWind(speed=WIND, shear_exponent=0.0)
TURNING = Start(rotor_speed=SPEED, coordinates={})


@pytest.fixture(scope="module")
def flat(turbine: Turbine) -> Turbine:
    """The turbine without tilt and cone."""
    return turbine.replace(**{"nacelle.tilt": 0.0, "hub.precone": 0.0})


def settled(turbine: Turbine, wake: str, wind: Any = STEADY, start: Start = TURNING, **options: Any) -> Case:
    """Case of a rigid turbine in steady operation."""
    return settled_model(meltemi.build(turbine, RIGID.replace(wake=wake, **options)), wind, start)


def settled_model(model: Model[Any], wind: Any = STEADY, start: Start = TURNING) -> Case:
    case = Case(model, wind)
    start.put(case)
    case.begin_parts(0.01)
    for _ in range(4):
        case.settle(0.0)
    return case


def circulation(case: Case) -> Float:
    """(blades, nodes) [m^2/s]."""
    flow = case.view("flow")
    result: Float = 0.5 * case["aero_nodes"][AeroNode.index("chord")] * flow["speed"] * flow["lift"]
    return result


def thrust(case: Case) -> float:
    return float(case.view("rotor")["thrust"])


# steady operation -------------------------------------------------------------------------------------------


def helices(edges: Float, radius: Float, lead: float, turns: int = 16, steps: int = 120) -> Float:
    """(2, nodes, edges) axial and tangential velocity at the nodes of a blade by three helices from each edge."""
    ages = np.concatenate(
        [[0.0], np.geomspace(1e-5, 0.05, 60), 0.05 + 2.0 * np.pi / steps * np.arange(1, turns * steps)]
    )
    result = np.zeros((2, len(radius), len(edges)))
    for sign in (-1.0, 1.0):  # two points of Gauss
        b = 0.5 * (ages[1:] + ages[:-1]) + sign * np.diff(ages) / (2.0 * np.sqrt(3.0))
        for blade in range(3):
            c, s = np.cos(2.0 * np.pi / 3.0 * blade - b), np.sin(2.0 * np.pi / 3.0 * blade - b)
            for e, x in enumerate(edges):
                along, away = (lead, -x * c, x * s), (-lead * b, -x * s, radius[:, None] - x * c)
                cubed = (away[0] ** 2 + away[1] ** 2 + away[2] ** 2) ** 1.5
                axial, across = along[1] * away[2] - along[2] * away[1], along[2] * away[0] - along[0] * away[2]
                for row, u in ((0, axial), (1, across)):
                    result[row, :, e] += (u / cubed * 0.5 * np.diff(ages)).sum(axis=1) / (4.0 * np.pi)
    return result


def lifting_line(case: Case) -> Float:
    """(nodes,) [m^2/s] circulation of a lifting line with straight helical vortices, at the nodes of a case."""
    rotor, hub = case.model.rotor, case.model.turbine.hub.radius
    edges, radius = hub + rotor.blade_layout.edges, hub + rotor.blade_layout.position
    nodes, lift = rotor.aero_nodes[:, 0], rotor.polars[..., PolarPoint.index("lift")]
    chord, polar = nodes[AeroNode.index("chord")], nodes[AeroNode.index("polar")].astype(int)
    theta, angles = case.view("flow")["theta"][0], np.linspace(-np.pi, np.pi, lift.shape[1])
    mean = float(case.view("rotor")["induction"])
    u = np.diff(helices(edges, radius, WIND * (1.0 - 1.2 * mean) / SPEED), axis=2)
    G = circulation(case)[0].copy()
    for _ in range(2000):
        normal, along = WIND - u[0] @ G, SPEED * radius + np.abs(u[1] @ G)
        alpha = np.arctan2(normal, along) - theta
        static = np.array([np.interp(x, angles, lift[g]) for x, g in zip(alpha, polar, strict=True)])
        new = 0.5 * chord * np.hypot(normal, along) * static
        G += 0.05 * (new - G)
    assert np.max(np.abs(new - G)) < 1e-9
    return G


@pytest.fixture(scope="module")
def near(flat: Turbine) -> Case:
    return settled(flat, "near")


@pytest.fixture(scope="module")
def momentum(flat: Turbine) -> Case:
    return settled(flat, "momentum")


@pytest.fixture(scope="module")
def line(near: Case) -> Float:
    return lifting_line(near)


def spread(case: Case, line: Float, first: int = 4) -> Float:
    """Circulation over that of the lifting line, from 0.3 R to the tip, over its mean there."""
    ratio = circulation(case)[0, first:] / line[first:]
    return ratio / ratio.mean()


def test_the_circulation_is_that_of_a_lifting_line(near: Case, momentum: Case, line: Float) -> None:
    """From 0.3 R to the tip within 1.2 %, where momentum with Prandtl's factor has 5 % too little at the tip."""
    assert np.max(np.abs(spread(near, line) - 1.0)) < 0.013
    assert np.min(spread(momentum, line)) < 0.96
    assert np.all(circulation(near)[0, -2:] > 1.02 * circulation(momentum)[0, -2:])
    assert abs(circulation(near)[0, 4:].mean() / line[4:].mean() - 1.0) < 0.02  # the level is momentum's


def test_the_thrust_is_momentum_s(flat: Turbine) -> None:
    """Within 0.4 %; far above rated wind, where the tip has no lift, 2 %. The factor of the far wake is near 1."""
    winds = ((6.0, 0.0, 0.004), (9.0, 0.0, 0.004), (12.0, 0.0, 0.004), (16.0, 0.2, 0.004), (22.0, 0.36, 0.02))
    for speed, pitch, error in winds:
        start, wind = Start(rotor_speed=SPEED, pitch=pitch, coordinates={}), SteadyWind(speed=speed, shear_exponent=0.0)
        near, momentum = (settled(flat, wake, wind, start) for wake in ("near", "momentum"))
        assert thrust(near) == pytest.approx(thrust(momentum), rel=error)
        assert 0.95 < near.view("near_rotor")["factor"] < 1.5


def test_vortices_of_the_wrong_sign_are_noticed(near: Case, line: Float) -> None:
    (part,) = near.model.parts
    wrong = settled_model(replace(near.model, parts=(replace(part, reach=-part.reach),)))
    assert np.max(np.abs(spread(wrong, line) - 1.0)) > 0.1


@pytest.mark.skipif(not OLAF.is_file(), reason="needs the reference folder beside the repository")
def test_the_distribution_of_circulation_is_olaf_s(turbine: Turbine) -> None:
    """Between 0.3 R and 0.9 R within 2.5 % of OLAF 5.0's after 80 s, over the means, as momentum; beyond, only near."""
    file = np.load(OLAF, allow_pickle=True)
    names, rows = list(file["channels"]), file["data"][-300:]
    stations = np.array([19.95, 24.05, 28.15, 32.25, 36.35, 40.45, 44.55, 48.65, 52.75, 56.1667, 58.9])
    olaf = np.array([rows[:, names.index(f"AB1N{n:03d}Gam")].mean() for n in range(7, 18)])
    found = {}
    for wake in ("near", "momentum"):
        case = settled(turbine, wake)
        radius = case.model.turbine.hub.radius + case.model.rotor.blade_layout.position
        ratio = np.interp(stations, radius, circulation(case).mean(axis=0)) / olaf
        found[wake] = ratio / ratio[:-2].mean()
    assert np.max(np.abs(found["near"][:-2] - 1.0)) < 0.025
    assert np.max(np.abs(found["near"][-2:] - 1.0)) < np.max(np.abs(found["momentum"][-2:] - 1.0))


def test_finer_nodes_converge(flat: Turbine) -> None:
    """Flap moments of the nodes' loads, whose vortices are as close as the nodes."""

    def moment(nodes: int) -> float:
        case = settled(flat, "near", blade_nodes=nodes)
        flow, length = case.view("flow"), case["aero_nodes"][AeroNode.index("length")]
        return float((flow["normal_force"] * length * flow["radius"]).sum())

    coarse, middle, fine = (moment(n) for n in (12, 24, 48))
    assert abs(fine - middle) < 0.5 * abs(middle - coarse) + 2e-3 * fine
    assert coarse == pytest.approx(fine, rel=0.01)


def test_nodes_at_the_ends_and_no_loss_factors(flat: Turbine, near: Case) -> None:
    """The trapezoidal rule has nodes where vortices leave; without Prandtl's factors momentum leaves the ends alone."""
    at_ends = settled(flat, "near", blade_nodes=tuple(61.5 * np.sin(np.linspace(0.0, 0.5 * np.pi, 25))))
    assert thrust(at_ends) == pytest.approx(thrust(near), rel=0.02)
    without = settled(flat, "near", tip_loss=False, hub_loss=False)
    bare = settled(flat, "momentum", tip_loss=False, hub_loss=False)
    assert thrust(without) == pytest.approx(thrust(bare), rel=0.005)
    assert np.all(circulation(without)[0, -1] < 0.9 * circulation(bare)[0, -1])  # the vortices unload the tip


# steps ------------------------------------------------------------------------------------------------------


def pitched(case: Case, dt: float, duration: float, change: float = np.radians(3.0)) -> Float:
    """(steps, nodes) [m/s] velocity of the near wake after a step of the pitch."""
    case.view("pitch")["angle"] += change
    found = []
    case.evaluate(0.0)
    for _ in range(round(duration / dt)):
        begin_parts_step(dt, case.system)
        case.evaluate(0.0, dt)
        found.append(case["near_velocity"][0, :20].copy())
    return np.array(found)


def test_a_step_follows_within_a_quarter_turn_and_first_at_the_tip(flat: Turbine) -> None:
    """At once at the tip, in a tenth of a turn at mid-span; the far wake takes seconds."""
    case = settled(flat, "near")
    before, dt = case["near_velocity"][0, :20].copy(), 0.02
    found = pitched(case, dt, 2.0)
    change = found[-1] - before
    share = (found - before) / change
    tip, middle = 19, 8
    assert change[tip] < -0.3 and change[middle] < -0.02
    reached = [int(np.argmax(share[:, n] > 0.63) + 1) * dt for n in (tip, middle)]
    assert reached[0] < 0.05 < 0.1 < reached[1] < 0.5
    far = case["inflow"][1, 0, 12]
    assert abs(found[-1] - found[-5])[tip] < 0.02 * abs(change[tip])
    case.settle(0.0)
    assert abs(case["inflow"][1, 0, 12] - far) > 0.2  # after 2 s dynamic inflow is still on its way


def test_the_time_step_is_of_first_order(flat: Turbine) -> None:
    ends = [pitched(settled(flat, "near"), dt, 0.32)[-1] for dt in (0.04, 0.02, 0.01, 0.005)]
    errors = [np.max(np.abs(one - two)) for one, two in pairwise(ends)]
    assert errors[0] < 0.1
    assert 1.5 < errors[0] / errors[1] < 2.7 and 1.5 < errors[1] / errors[2] < 2.7


def test_fine_nodes_and_long_steps_are_stable(flat: Turbine) -> None:
    """By the implicit circulations: with a lift slope of zero, explicitly, the same steps diverge."""
    case = settled(flat, "near", blade_nodes=60, inflow="quasi_steady")
    steady = case["near_velocity"][0, :60].copy()
    model = case.model
    section = model.rotor.section.copy()
    section[:, SectionConstants.index("slope")] = 0.0
    explicit = Case(model.with_arrays(section=section), STEADY)
    for each in (case, explicit):
        TURNING.put(each)
        each.evaluate(0.0)
        for _ in range(60):
            begin_parts_step(0.1, each.system)
            each.evaluate(0.0, 0.1)
    np.testing.assert_allclose(case["near_velocity"][0, :60], steady, atol=0.02)
    assert not np.max(np.abs(explicit["near_velocity"][0, :60] - steady)) < 5.0


def test_lagged_far_wake_and_vortices_reach_the_steady_state(flat: Turbine) -> None:
    case = settled(flat, "near")
    steady, start = thrust(case), circulation(case)
    for array in ("near_wake", "inflow"):
        case[array][...] = 0.0
    case.evaluate(0.0)
    assert thrust(case) > 1.2 * steady
    for _ in range(600):
        begin_parts_step(0.1, case.system)
        case.evaluate(0.0, 0.1)
    assert thrust(case) == pytest.approx(steady, rel=1e-3)
    np.testing.assert_allclose(circulation(case), start, atol=0.3)


# conditions and other parts of the machine ------------------------------------------------------------------


@pytest.mark.parametrize(
    ("rotor_speed", "wind", "yaw"),
    [(0.0, 12.0, 0.0), (0.05, 50.0, 0.0), (SPEED, 0.0, 0.0), (-0.3, 8.0, 0.0), (SPEED, -6.0, 0.0), (0.2, 20.0, 1.6)],
)
def test_stopped_idling_and_reversed_rotors(flat: Turbine, rotor_speed: float, wind: float, yaw: float) -> None:
    """Finite, and without effect where momentum fades out."""
    start = Start(rotor_speed=rotor_speed, coordinates={})
    air = SteadyWind(speed=abs(wind), shear_exponent=0.0, direction=yaw + (np.pi if wind < 0.0 else 0.0))
    near, none = (settled(flat, wake, air, start) for wake in ("near", "none"))
    for _ in range(20):
        begin_parts_step(0.05, near.system)
        near.evaluate(0.0, 0.05)
    assert np.all(np.isfinite(near["flow"])) and np.all(np.isfinite(near["near_wake"]))
    if abs(rotor_speed) * RADIUS < abs(wind):
        momentum = settled(flat, "momentum", air, start)
        np.testing.assert_allclose(near["flow"][LOADS], momentum["flow"][LOADS], atol=1e-3, rtol=1e-9)
        assert thrust(near) == pytest.approx(thrust(none), rel=1e-9, abs=1e-3)


def test_yaw_and_shear_move_the_flap_moment_less_than_momentum(flat: Turbine) -> None:
    """In yaw, Glauert's skew acts on the far wake only."""
    wind = SteadyWind(speed=10.0, shear_exponent=0.0, direction=np.radians(20.0))
    sines = {}
    for wake in ("near", "momentum"):
        case = settled(flat, wake, wind)
        flow, length = case.view("flow"), case["aero_nodes"][AeroNode.index("length")]
        moments = (flow["normal_force"] * length * flow["radius"]).sum(axis=1)
        sines[wake] = float(np.ptp(moments) / moments.mean())
    assert 0.4 * sines["momentum"] < sines["near"] < 0.95 * sines["momentum"]


def test_flaps_trail_vortices_at_their_ends(flat: Turbine) -> None:
    """A flap towards the pressure side slows the air at its nodes, and speeds it up beside them."""
    case = settled(with_flaps(flat), "near")
    before = case["near_velocity"][0, :20].copy()
    case.view("flap")["angle"] += np.radians(5.0)
    case.settle(0.0)
    change = case["near_velocity"][0, :20] - before
    lift = circulation(case)[0] - circulation(settled(flat, "near"))[0]
    assert change[np.argmax(lift)] > 0.1
    assert change[:18].min() < -0.1
    assert np.argmax(lift) - np.argmin(change[:18]) < 8  # inboard of the flap


def test_without_blades_it_is_refused() -> None:
    with pytest.raises(InputError, match="wake near needs blades, not a power coefficient"):
        part_of(disk := meltemi.load_turbine("pmsg20mw"), ModelOptions(wake="near"), meltemi.build(disk).rotor)


def test_another_induction_model_is_refused(near: Case) -> None:
    class Other(type(near.model.parts[0])):  # type: ignore[misc]
        replaces_momentum = True

    (part,) = near.model.parts
    twice = Case(replace(near.model, parts=(part,)), STEADY)
    twice.parts = (part, Other(**vars(part)))
    with pytest.raises(InputError, match="wake near: it needs momentum, which Other replaces; remove one of them"):
        part.begin(twice)


@compiled
def test_gradients_in_reverse_are_refused(turbine: Turbine) -> None:
    run = Run(meltemi.build(turbine, RIGID.replace(wake="near")), STEADY, duration=0.1, start=TURNING)
    with pytest.raises(UnsupportedError, match="induction models have no derivatives in reverse; sensitivity has"):
        gradient(run, lambda result: (0.0, {}), ("hub.mass",))


@compiled
def test_a_run_in_turbulence_and_its_saved_state(turbine: Turbine, tmp_path: Path) -> None:
    """All coordinates and dynamic stall; the rest of a saved run has the same bits."""
    model = meltemi.build(turbine, ModelOptions(wake="near"))
    run = Run(model, TurbulentWind(speed=12.0, intensity=0.14), duration=4.0, channels=("all",))
    whole, first, second = Simulation(run), Simulation(run), Simulation(run)
    whole.advance(10**9)
    first.advance(200)
    save_state(first, tmp_path / "run.state")
    assert restore_state(second, tmp_path / "run.state") == []
    second.advance(10**9)
    assert whole.result().data.tobytes() == second.result().data.tobytes()
    factor = whole.result()["far_wake_factor"]
    assert np.all((factor > 0.8) & (factor < 1.6)) and np.ptp(factor) > 0.01


@compiled
def test_numbers_in_lanes_and_node_by_node(turbine: Turbine) -> None:
    model = meltemi.build(turbine, ModelOptions(wake="near"))
    found = []
    for kind in ("lanes", "floats"):
        run = Run(model, STEADY, duration=0.5, channels=("rotor_aero_thrust", "generator_power"))
        simulation = Simulation(run, numbers=kind)
        march(simulation)
        found.append(simulation.result().data)
    np.testing.assert_allclose(found[0], found[1], rtol=1e-10)


@compiled
def test_linear_models_have_the_states_of_the_vortices(turbine: Turbine) -> None:
    """Derivatives by the state of a tip vortex beside central differences; the model is stable."""
    model = meltemi.build(turbine, RIGID.replace(wake="near", blade_nodes=6))
    point = operating_point(model, SteadyWind(speed=9.0, shear_exponent=0.0), rotor_speed=1.0, pitch=0.0)
    linear = linearise(model, point, ("wind_speed",), ("rotor_aero_thrust",), azimuth=0.0)
    place = linear.states.index("blade 1 vortex 7 circulation 2")
    rows = [i for i, name in enumerate(linear.states) if "circulation" in name]
    assert len(rows) == 3 * 7 * 4
    case = Case(model, point.wind, numbers="floats")
    point.put(case, 0.0)
    case.begin_parts()
    at, rates, thrusts, h = (1, 0, 6), [], [], 1e-3
    x = case["near_wake"][at]
    for change in (-h, h):
        case["near_wake"][at] = x + change
        case.evaluate(0.0)
        case.rates()
        rates.append(case["d_near_wake"].ravel().copy())
        thrusts.append(thrust(case))
    slope = (rates[1] - rates[0]) / (2.0 * h)
    np.testing.assert_allclose(linear.A[rows, place], slope, rtol=1e-5, atol=1e-6 * np.abs(slope).max())
    assert linear.C[0, place] == pytest.approx((thrusts[1] - thrusts[0]) / (2.0 * h), rel=1e-5)
    assert np.max(np.linalg.eigvals(linear.A).real) < 1e-9
