"""Linear models: differences, the nonlinear machine's small steps, the fixed frame, exports."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.linalg import expm

import meltemi
from meltemi import InputError, Model, ModelOptions, Result, SteadyWind, Turbine
from meltemi.analysis import LinearModel, OperatingPoint, linearise
from meltemi.simulation.case import Case
from meltemi.simulation.channels import standard

pytestmark = pytest.mark.slow

Float = NDArray[np.float64]
WIND = 14.0
INPUTS = ("generator_torque", "pitch", "wind_speed")
OUTPUTS = ("rotor_speed", "tower_top_fore_aft", "generator_power", "RootMyc1")


@pytest.fixture(scope="module")
def point(model: Model) -> OperatingPoint:
    return meltemi.operating_point(model, WIND)


@pytest.fixture(scope="module")
def fixed(model: Model, point: OperatingPoint) -> LinearModel:
    return linearise(model, point, INPUTS, OUTPUTS)


def rates(model: Model, point: OperatingPoint, azimuth: float, change: dict[str, float]) -> dict[str, float]:
    """Accelerations and outputs with some coordinates and speeds changed, written without the linear module."""
    case = Case(model, point.wind)
    case["aero_options"][-1] = 60
    point.put(case, azimuth)
    names = model.coordinates
    for name, value in change.items():
        kind, what = name.split(" ", 1)
        case[kind][names.index(what)] += value
        if name == "q drivetrain":
            case["q"][names.index("generator")] -= value
    for _ in range(2):
        case.evaluate(0.0)
    case.loads(0.0)
    found = {f"v {name}": float(a) for name, a in zip(names, case["a"], strict=True)}
    return {**found, "rotor_thrust": float(case.signals.vector[case.place(standard()["rotor_thrust"])])}


@pytest.mark.parametrize("wind_speed", [9.0, 18.0])
@pytest.mark.parametrize("azimuth", [0.0, 0.5])
def test_columns_are_differences_of_the_simulation(model: Model, wind_speed: float, azimuth: float) -> None:
    point = meltemi.operating_point(model, wind_speed)
    found = linearise(model, point, (), ("rotor_thrust",), azimuth=azimuth)
    # all coordinates and speeds at once, by another step than that of the module
    rng = np.random.default_rng(3)
    names = [name for name in found.states if name[:2] in ("q ", "v ")]
    direction = dict(zip(names, rng.standard_normal(len(names)), strict=True))
    h = 3e-5
    ahead, behind = (rates(model, point, azimuth, {n: s * h * d for n, d in direction.items()}) for s in (1.0, -1.0))
    x = np.array([direction.get(name, 0.0) for name in found.states])
    expected = np.array([(ahead[n] - behind[n]) / (2.0 * h) if n.startswith("v ") else 0.0 for n in found.states])
    rows = np.array([name.startswith("v ") for name in found.states])
    np.testing.assert_allclose((found.A @ x)[rows], expected[rows], rtol=1e-6, atol=1e-6 * np.abs(expected).max())
    force = (ahead["rotor_thrust"] - behind["rotor_thrust"]) / (2.0 * h)
    assert (found.C @ x)[0] == pytest.approx(force, rel=1e-6)


def response(found: LinearModel, which: str, size: float, time: Float) -> Float:
    """(T, outputs) after a step of an input."""
    n, k, h = len(found.A), found.inputs.index(which), time[1]
    march = expm(h * np.block([[found.A, found.B[:, [k]]], [np.zeros((1, n + 1))]]))
    x = np.zeros(n + 1)
    x[-1] = size
    read = np.hstack([found.C, found.D[:, [k]]])
    rows = []
    for _ in time:
        rows.append(read @ x)
        x = march @ x
    return np.array(rows)


@pytest.mark.parametrize(("which", "size"), [("generator_torque", 50.0), ("pitch", 1e-4), ("wind_speed", 0.01)])
def test_small_steps_of_the_nonlinear_machine(
    model: Model, point: OperatingPoint, fixed: LinearModel, which: str, size: float
) -> None:
    zero = np.zeros(2)

    def run(step: float) -> Result:
        gust = step if which == "wind_speed" else 0.0
        wind = meltemi.WindSeries(
            time=[0.0, 1.0],
            speed=[WIND, WIND],
            direction=zero,
            vertical=zero,
            horizontal_shear=zero,
            exponent=zero,
            vertical_shear=zero,
            gust=[gust, gust],
        )
        start = replace(
            point,
            pitch=point.pitch + step * (which == "pitch"),
            generator_torque=point.generator_torque + step * (which == "generator_torque"),
        )
        names = ["azimuth", *OUTPUTS[:3]]
        return meltemi.simulate(
            model,
            wind,
            duration=30.0,
            controller=meltemi.control.ConstantController(),
            start=start,
            channels=names,
            output_step=0.01,
        )

    still, moved = run(0.0), run(size)
    found = response(fixed, which, size, moved.time)
    # at the same azimuth: it is no state of the linear model
    before, azimuth = np.unwrap(still["azimuth"]), np.unwrap(moved["azimuth"])
    there = azimuth < before[-1]
    for i, name in enumerate(OUTPUTS[:2]):
        expected = moved[name] - CubicSpline(before, still[name])(azimuth)
        error = (found[:, i] - expected)[there]
        # torque hardly moves the tower fore and aft: there the thrice-a-revolution part shows, 1.0 % alone
        most = 0.015 if (which, name) == ("generator_torque", "tower_top_fore_aft") else 0.01
        assert np.std(error) < most * np.sqrt(np.mean(expected[there] ** 2)), name


def test_speed_of_the_rotor_turns_the_fixed_frame(fixed: LinearModel) -> None:
    """A steady cyclic deflection stays steady in the fixed frame, however fast it turns."""
    # d(sine)/dt has -speed T' z: with the speed a state, its column holds the deflection itself
    row, column = fixed.states.index("q 1st edge sine"), fixed.states.index("v generator")
    assert fixed.A[row, column] == pytest.approx(fixed.x0[fixed.states.index("q 1st edge cosine")], rel=1e-3)


def test_names_units_and_values(fixed: LinearModel, point: OperatingPoint) -> None:
    assert fixed.outputs[3:] == tuple(f"root_moment_out_of_plane_{part}" for part in ("collective", "cosine", "sine"))
    assert fixed.input_units == ("N m", "rad", "m/s")
    assert fixed.u0 == pytest.approx([point.generator_torque, point.pitch, WIND])
    assert fixed.y0[0] == pytest.approx(point["rotor_speed"], rel=1e-4)
    assert fixed.y0[3] == pytest.approx(point["RootMyc1"], rel=1e-3)
    n, m, p = len(fixed.states), len(fixed.inputs), len(fixed.outputs)
    assert [x.shape for x in (fixed.A, fixed.B, fixed.C, fixed.D)] == [(n, n), (n, m), (p, n), (p, m)]
    assert len(set(fixed.states)) == n == len(fixed.state_units)
    assert not [name for name in fixed.states if "generator" in name and name.startswith("q")]
    # no pole at zero by artefact
    assert np.abs(np.linalg.eigvals(fixed.A)).min() > 1e-3


def test_azimuths_of_the_average_hardly_matter(model: Model, point: OperatingPoint) -> None:
    tower = [
        next(
            m for m in linearise(model, point, (), (), azimuths=n).modes() if "tower 1st fore-aft" in m.participation()
        )
        for n in (4, 12)
    ]
    assert tower[0].damping == pytest.approx(tower[1].damping, rel=1e-2)


@pytest.mark.parametrize(
    "name",
    "generator_torque pitch wind_speed vertical_wind wind_direction horizontal_shear vertical_shear shear_exponent yaw "
    "yaw_rate".split(),
)
def test_every_input_moves_the_machine(model: Model, point: OperatingPoint, name: str) -> None:
    found = linearise(model, point, (name,), ("yaw_moment_z", "tower_base_moment_fore_aft"), azimuth=0.3)
    assert np.abs(found.B).max() > 1e-9
    assert np.isfinite(found.A).all()


def test_blades_and_collective_pitch_agree(model: Model, point: OperatingPoint) -> None:
    each = linearise(model, point, ("pitch", "pitch_1", "pitch_2", "pitch_3"), ("rotor_speed",), azimuth=0.3)
    np.testing.assert_allclose(each.B[:, 0], each.B[:, 1:].sum(axis=1), rtol=1e-5, atol=1e-6 * np.abs(each.B).max())
    cyclic = linearise(model, point, ("pitch_2",), ("rotor_speed",), azimuths=1)
    assert cyclic.inputs == ("pitch_collective", "pitch_cosine", "pitch_sine")
    assert cyclic.u0 == pytest.approx([point.pitch, 0.0, 0.0], abs=1e-12)


def test_a_pitch_actuator_has_states(turbine: Turbine) -> None:
    described = turbine.replace(**{"pitch_actuator.kind": "second_order"})
    model = meltemi.build(described)
    found = linearise(model, meltemi.operating_point(model, WIND), ("pitch",), ("pitch_1",), azimuths=1)
    assert {"pitch collective", "pitch rate sine"} <= set(found.states)
    # the demand arrives: one to one at rest, with the frequency of the actuator
    gain = found.D - found.C @ np.linalg.solve(found.A, found.B)
    assert gain[0, 0] == pytest.approx(1.0, rel=1e-6)
    i = [found.states.index(f"pitch{rate} collective") for rate in ("", " rate")]
    a = described.pitch_actuator
    np.testing.assert_allclose(
        found.A[np.ix_(i, i)],
        [[0.0, 1.0], [-(a.natural_frequency**2), -2.0 * a.damping_ratio * a.natural_frequency]],
        rtol=1e-8,
        atol=1e-8,
    )


@pytest.mark.parametrize(
    ("options", "gone"),
    [
        ({"inflow": "quasi_steady"}, "inflow"),
        ({"wake": "none"}, "inflow"),
        ({"stall": "static"}, "stall"),
        ({"locked": ("generator",)}, "v generator"),
        ({"locked": ("tower",)}, "tower"),
    ],
)
def test_what_does_not_move_is_no_state(turbine: Turbine, options: dict[str, Any], gone: str) -> None:
    model = meltemi.build(turbine, ModelOptions(**options))
    found = linearise(model, meltemi.operating_point(model, WIND), (), (), azimuths=1)
    assert not [name for name in found.states if gone in name]
    assert np.abs(np.linalg.eigvals(found.A)).min() > 1e-4


def test_without_air_it_has_the_natural_modes(turbine: Turbine) -> None:
    speed = 1.2
    model = meltemi.build(turbine, ModelOptions(wake="none", stall="static"), meltemi.Environment(gravity=0.0))
    empty = model.with_parameters(**{"aerodynamics.air_density": 0.0})
    point = meltemi.operating_point(empty, 8.0, rotor_speed=speed, pitch=0.0)
    held = replace(empty, locked=np.array([float(name == "generator") for name in model.coordinates]))
    found = linearise(held, point, (), (), azimuths=1).modes()
    expected = meltemi.analysis.natural_modes(model, speed)
    assert len(found) == len(expected)
    for one, two in zip(found, expected, strict=True):
        assert one.frequency == pytest.approx(two.frequency, rel=2e-4)
        assert one.damping == pytest.approx(two.damping, rel=2e-2)


def test_modes_of_the_air_are_left_out(fixed: LinearModel) -> None:
    few, many = fixed.modes(), fixed.modes(structural=0.0)
    # 7 of the trunk, 4 of each blade, less the turning of the rotor, which does not oscillate
    assert len(few) == 18
    assert len(many) > 50
    assert {m.frequency for m in few} <= {m.frequency for m in many}


def test_states_at_any_azimuth_lie_on_the_orbit(model: Model, point: OperatingPoint) -> None:
    case = Case(model, point.wind)
    step = 2.0 * np.pi / len(point.revolution)
    point.put(case, 5.0 * step)
    generator = model.coordinates.index("generator")
    expected = point.revolution[5, : len(point.q)].copy()
    expected[generator] += 5.0 * step
    np.testing.assert_allclose(case["q"], expected, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(case.aero_states(), point.revolution[5, 2 * len(point.q) :], rtol=1e-9, atol=1e-9)
    # between them: a third of a revolution on, blade 2 is where blade 3 was
    motion = []
    for azimuth in (0.1, 0.1 + 2.0 * np.pi / 3.0):
        point.put(case, azimuth)
        motion.append(case["q"][model.n_core :].reshape(3, -1).copy())
    np.testing.assert_allclose(motion[1], np.roll(motion[0], -1, axis=0), rtol=0.0, atol=1e-9)


def test_scipy_takes_it(fixed: LinearModel) -> None:
    system = fixed.to_scipy()
    for name in "ABCD":
        assert np.array_equal(getattr(system, name), getattr(fixed, name))


def test_control_takes_it(fixed: LinearModel) -> None:
    control = pytest.importorskip("control", reason="python-control is not installed")
    system = fixed.to_control()
    assert isinstance(system, control.StateSpace)
    for name in "ABCD":
        assert np.array_equal(getattr(system, name), getattr(fixed, name))
    assert system.state_labels == list(fixed.states)
    assert (system.input_labels, system.output_labels) == (list(fixed.inputs), list(fixed.outputs))


def test_errors_name_what_is_wrong(model: Model, point: OperatingPoint) -> None:
    with pytest.raises(InputError, match="no input 'torque'.*generator_torque"):
        linearise(model, point, ("torque",))
    with pytest.raises(InputError, match="'azimuth' is not an output"):
        linearise(model, point, (), ("azimuth",))
    with pytest.raises(InputError, match="divide 12"):
        linearise(model, point, azimuths=5)


def test_two_blades_at_an_azimuth(turbine: Turbine) -> None:
    model = meltemi.build(turbine.replace(n_blades=2))
    point = meltemi.operating_point(model, SteadyWind(speed=8.0))
    found = linearise(model, point, ("pitch_2",), ("RootMyc2",), azimuth=1.0)
    assert np.isfinite(found.A).all() and found.D[0, 0] != 0.0
    with pytest.raises(meltemi.UnsupportedError, match="three blades"):
        linearise(model, point)
