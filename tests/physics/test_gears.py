"""Gearbox in the machine: loads, modes, energy, time step, number types."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.linalg import eigvals

import meltemi
from meltemi import Environment, Model, ModelOptions, Result, Start, SteadyWind, Turbine, simulate
from meltemi.analyses.modes import natural_modes
from meltemi.compiler import View
from meltemi.control import signals as s
from meltemi.simulation.bladed.rotor import with_static_gears
from meltemi.simulation.case import Case
from meltemi.simulation.run import Run
from meltemi.simulation.simulate import Simulation
from meltemi.simulation.start import begin
from meltemi.simulation.vibrations import time_step
from meltemi.structure.gear_train import gear_train, reduced
from meltemi.structure.tables import GearModes, StructureParameters
from meltemi.verification.closed_form import NO_DAMPING
from meltemi.verification.energy import mechanical_energy

Float = NDArray[np.float64]
GEAR_LOADS = [
    "main_shaft_torque",
    *(f"stage_{n}_{what}" for n in (1, 2) for what in ("sun_force", "ring_force", "shaft_torque")),
    "stage_3_mesh_force",
    "high_speed_shaft_torque",
]


@pytest.fixture(scope="module")
def multibody(geared: Turbine) -> Model:
    return meltemi.build(geared, ModelOptions(drivetrain="multibody"))


def test_two_masses_do_not_see_a_gearbox(turbine: Turbine, geared: Turbine) -> None:
    wind = meltemi.TurbulentWind(speed=12.0, intensity=0.15)
    runs = [simulate(meltemi.build(t), wind, duration=10.0).data for t in (turbine, geared)]
    assert np.array_equal(*runs)


def disturbed(geared: Turbine, kind: str, **options: Any) -> Case:
    """A moving machine in air, evaluated with all its loads."""
    model = meltemi.build(geared, ModelOptions(drivetrain=kind, locked=("tower",), **options))
    case = Case(model, SteadyWind(speed=12.0))
    rng = np.random.default_rng(3)
    n = len(model.coordinates)
    Start(rotor_speed=1.2, generator_torque=4e4).put(case)
    case["q"][:] += 0.01 * rng.standard_normal(n)
    case["v"][n - 1 :] += 0.05
    case["v"][model.coordinates.index("yaw")] = 0.02
    case["v"][model.coordinates.index("drivetrain")] = 0.03
    case["gears"][:2] = 1e-4 * rng.standard_normal(case["gears"][:2].shape)
    case.evaluate(0.0)
    case.loads(0.0)
    return case


@pytest.mark.parametrize("kind", ["quasi_static", "multibody"])
def test_what_the_rotor_gives_passes_through_the_gearbox(geared: Turbine, kind: str) -> None:
    """Rotor torque from what lies outboard is the torque of the main shaft; all parts are in equilibrium."""
    case = disturbed(geared, kind)
    d, p = geared.drivetrain, case.model.structure
    n = len(case.model.rotor.tower.names)
    torque = case.view("chain")["apex_moment"][0]
    loads = case["gear_loads"][0]
    assert loads[0] == pytest.approx(torque, rel=1e-9)
    # at the other end the shaft drives the generator: n J (W + n dv/dt), against its sense behind a parallel stage
    machine = case.view("machine")
    columns, a = case["columns"], case["a"]
    turning = machine["nacelle_spin_rate"] @ machine["shaft"]
    turning += (a[: n + 1] @ columns[3:, : n + 1].T) @ machine["shaft"]
    sense = p[StructureParameters.index("generator_sense")]
    assert sense == -1.0
    inertia = d.generator_inertia * (d.gear_ratio * a[n + 1] + sense * turning)
    assert loads[-1] - 4e4 == pytest.approx(inertia, rel=1e-6)


@pytest.mark.parametrize("kind", ["two_mass", "quasi_static", "multibody"])
def test_momentum_of_the_gears_reaches_the_yaw_bearing(geared: Turbine, kind: str) -> None:
    """Yaw moment from outboard inertia is what spring and damper carry; a steep shaft turns the gears with the yaw."""
    steep = geared.replace(**{"nacelle.tilt": 0.5, "hub.precone": 0.0})
    heavy = steep.replace(**{"drivetrain.gearbox.planetary": _heavier(steep)})
    case = disturbed(heavy, kind)
    y = case.model.coordinates.index("yaw")
    yaw = heavy.yaw
    moment = yaw.stiffness * case["q"][y] + yaw.damping * case["v"][y]
    assert case.view("chain")["yaw_moment"][2] == pytest.approx(moment, rel=1e-8)


def _heavier(turbine: Turbine) -> list[Any]:
    assert turbine.drivetrain.gearbox is not None
    first, second = (stage.content() for stage in turbine.drivetrain.gearbox.planetary)
    return [{**first, "carrier_inertia": 1e6}, second]


def test_static_gears_are_modes_left_out(geared: Turbine, multibody: Model) -> None:
    static = meltemi.build(geared, ModelOptions(drivetrain="quasi_static"))
    left = with_static_gears(multibody)
    for name in ("structure", "gear_modes", "gear_rows", "gear_shape"):
        np.testing.assert_array_equal(left.array(name), static.array(name))
    wind = meltemi.TurbulentWind(speed=12.0, intensity=0.16)
    runs = [simulate(m, wind, duration=30.0, channels=GEAR_LOADS) for m in (static, multibody)]
    for name in GEAR_LOADS:
        one, two = (run[name] for run in runs)
        # the gears' own motion at 90 Hz and more is hardly excited: differences are 1e-4 of the deviation
        assert 0.0 < np.max(np.abs(two - one)) < 2e-3 * np.std(one), name


@pytest.mark.parametrize("kind", ["quasi_static", "multibody"])
def test_power_passes_through(geared: Turbine, kind: str) -> None:
    lossy = geared.replace(**{"drivetrain.gearbox_efficiency": 0.95})
    point = meltemi.operating_point(meltemi.build(lossy, ModelOptions(tower_influence="none", drivetrain=kind)), 8.0)
    n = geared.drivetrain.gear_ratio
    assert point["high_speed_shaft_torque"] * n == pytest.approx(point["main_shaft_torque"], rel=1e-4)
    assert point["main_shaft_torque"] == pytest.approx(point["rotor_torque"], rel=1e-4)
    assert 0.95 * point["high_speed_shaft_torque"] == pytest.approx(point.generator_torque, rel=2e-3)
    (first, _) = lossy.drivetrain.gearbox.planetary if lossy.drivetrain.gearbox else ()
    force = point["main_shaft_torque"] / first.ratio / (first.planets * first.sun_radius)
    assert point["stage_1_sun_force"] == pytest.approx(force, rel=1e-4)
    assert point["stage_1_ring_force"] == pytest.approx(force, rel=1e-4)


# modes --------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_linear_model_has_the_modes_of_the_chain(geared: Turbine) -> None:
    undamped = geared.replace(**{"drivetrain.damping": 0.0, "drivetrain.gearbox.damping_ratio": 0.0})
    options = ModelOptions(drivetrain="multibody", locked=("tower", "yaw", "blades"), inflow="quasi_steady")
    model = meltemi.build(undamped, options, Environment(gravity=0.0))
    point = meltemi.operating_point(model, 9.0)
    found = meltemi.analysis.linearise(model, point, (), ("main_shaft_torque",))
    assert sum(name.startswith("q gear mode") for name in found.states) == 8
    r, d = reduced(gear_train(undamped.drivetrain)), undamped.drivetrain
    # the rotor's inertia as the equations have it: what is in the core's mass matrix beyond generator and gears
    case = Case(with_static_gears(model), point.wind)
    point.put(case)
    case["locked"][:] = 0.0
    meltemi_evaluate(case)
    n = len(model.rotor.tower.names)
    rotor = case["core_mass"][n + 2, n + 2] - r.inertia[2, 2]
    k = len(r.frequency)
    M, K = np.diag(np.full(2 + k, r.modal_inertia)), np.zeros((2 + k, 2 + k))
    M[:2, :2] = r.inertia[1:, 1:] + rotor
    M[0, 0] += d.generator_inertia * d.gear_ratio**2
    M[:2, 2:], M[2:, :2] = r.coupling[1:], r.coupling[1:].T
    K[1, 1], K[2:, 2:] = d.stiffness, np.diag(r.modal_inertia * r.frequency**2)
    expected = np.sort(np.sqrt(np.abs(eigvals(K, M))))[1:]
    modes = found.modes()
    assert len(modes) == 9
    np.testing.assert_allclose([m.frequency for m in modes], expected, rtol=2e-4)
    assert modes[1].participation(1).startswith("gear mode")


def meltemi_evaluate(case: Case) -> None:
    from meltemi.simulation.step import equations

    equations(0.0, 0.0, case.system)


def test_gears_move_the_first_mode_by_their_inertia_only(turbine: Turbine, geared: Turbine) -> None:
    """Torsion against the clamped generator has the same stiffness; seen from the rotor little inertia is added."""
    found = {}
    for kind in ("two_mass", "quasi_static", "multibody"):
        options = ModelOptions(drivetrain=kind, locked=("tower", "yaw", "blades"))
        found[kind] = natural_modes(meltemi.build(geared, options), generator_free=True)[0].frequency
    assert found["multibody"] == found["quasi_static"]
    assert found["quasi_static"] / found["two_mass"] - 1.0 == pytest.approx(-0.02, abs=0.015)


def test_modes_of_the_gears_leave_the_time_step_alone(turbine: Turbine, multibody: Model) -> None:
    assert time_step(multibody) == time_step(meltemi.build(turbine)) == pytest.approx(1 / 60)
    frequency = View(GearModes, multibody.rotor.gear_modes)["frequency"]
    assert frequency.max() / 60 > 100.0


# time ---------------------------------------------------------------------------------------------------


def energy(geared: Turbine, dt: float) -> tuple[Float, float]:
    """[J] total energy, vibrating without air and damping, and largest energy in the modes of the gears."""
    described = geared.replace(
        **{
            "blade.structure.damping": NO_DAMPING,
            "tower.damping": NO_DAMPING,
            "drivetrain.damping": 0.0,
            "drivetrain.gearbox.damping_ratio": 0.0,
            "yaw.damping": 0.0,
        },
    )
    options = ModelOptions(
        time_step=dt,
        integration="explicit",
        advanced={"corrections": 1},
        drivetrain="multibody",
        locked=("blades", "tower"),
        torsion_modes=0,
    )
    model = meltemi.build(described, options, Environment(gravity=0.0, air_density=1e-12))
    calm = SteadyWind(speed=0.0)
    start = Start(rotor_speed=1.267, coordinates={"drivetrain": 0.005, "yaw": 0.001})
    run = Simulation(
        Run(
            model,
            calm,
            duration=10.0,
            controller=meltemi.control.ConstantController(),
            start=start,
            channels=["azimuth"],
        )
    )
    probe, whole, inside = Case(model, calm), [], []
    modes = View(GearModes, model.rotor.gear_modes)
    # strike the gears: one of them is fast
    run.case.view("gears")["rate"][:] = 0.02
    run.advance(1)
    while not run.finished:
        probe["q"][:], probe["v"][:] = run.motion()
        gears = run.case.view("gears")
        # of the last instant: without damping the step from there was that of the trapezoidal rule
        rate = gears["rate"] - 0.5 * dt * gears["acceleration"]
        angle = gears["angle"] - dt * rate - 0.25 * dt**2 * gears["acceleration"]
        probe.view("gears")["rate"], probe.view("gears")["angle"] = rate, angle
        whole.append(sum(mechanical_energy(probe)))
        inside.append(0.5 * float(modes["inertia"] @ (rate**2 + (modes["frequency"] * angle) ** 2)))
        run.advance(7)
    return np.array(whole), float(np.max(inside))


def test_energy_of_gears_that_vibrate_is_kept(geared: Turbine) -> None:
    rough, inside = energy(geared, 0.01)
    fine, _ = energy(geared, 0.0025)
    assert inside > 200.0  # they do vibrate, for ten seconds
    # no drift, and what the explicit part of the step leaves falls with the square of the step
    third = len(rough) // 3
    assert abs(rough[-third:].mean() - rough[:third].mean()) < 0.02 * inside
    assert np.ptp(fine) < 0.1 * np.ptp(rough)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["quasi_static", "multibody"])
def test_time_integration_remains_of_second_order(geared: Turbine, kind: str) -> None:
    """At the default step no mode of the gears is resolved; what everything else does converges all the same."""
    options = {"torsion_modes": 0, "drivetrain": kind}
    start = meltemi.operating_point(meltemi.build(geared, ModelOptions(**options)), 9.0)
    time = np.arange(0.0, 6.0, 0.05)
    gust = 1.5 * (1.0 - np.cos(2.0 * np.pi * np.clip((time - 1.0) / 3.0, 0.0, 1.0)))
    wind = meltemi.WindSeries(time=time, speed=9.0, exponent=0.2, gust=gust)
    runs = []
    for dt in (0.01, 0.005, 0.0025, 0.00125):
        model = meltemi.build(geared, ModelOptions(time_step=dt, **options))
        names = ["q drivetrain", "rotor_speed", "main_shaft_torque", "stage_1_sun_force", "high_speed_shaft_torque"]
        runs.append(
            simulate(
                model, wind, duration=5.0, controller=meltemi.control.ConstantController(), start=start, channels=names
            ).data[20:]
        )
    change = [np.sqrt(np.mean((a - b) ** 2, axis=0)) for a, b in pairwise(runs)]
    order = 0.5 * np.log2(change[0] / change[-1])
    assert np.all(order > 1.7), order


def stopped(geared: Turbine, kind: str) -> Result:
    """A minute in turbulence; after 30 s the grid is lost, a strong brake falls in and the blades go to feather."""
    driven = geared.replace(**{"pitch_actuator.kind": "second_order", "drivetrain.brake_torque": 85e3})
    options = ModelOptions(drivetrain=kind)
    n, rated = geared.drivetrain.gear_ratio, 4.3e4

    def stop(state: Float, measured: Float, demands: Float, dt: float) -> None:
        running = measured[s.TIME] < 30.0
        demands[s.GENERATOR_TORQUE] = rated if running else 0.0
        demands[s.BRAKE] = 0.0 if running else 1.0
        speed = measured[s.GENERATOR_SPEED] - 1.267 * n
        state[0] += 0.003 * speed * dt
        demands[s.PITCH_DEMAND : s.PITCH_DEMAND + 3] = state[0] + 0.01 * speed if running else 1.4

    return simulate(
        meltemi.build(driven, options),
        meltemi.TurbulentWind(speed=16.0, intensity=0.16),
        duration=60.0,
        controller=meltemi.Controller(stop, init=lambda point: np.array([point.pitch])),
        channels=["rotor_speed", "rotor_torque", *(GEAR_LOADS if kind != "two_mass" else [])],
        output_step=0.01,
    )


@pytest.mark.slow
def test_stiff_modes_are_stable_through_an_emergency_stop(geared: Turbine) -> None:
    two, static, free = (stopped(geared, kind) for kind in ("two_mass", "quasi_static", "multibody"))
    for run in (static, free):
        assert run.status is meltemi.Status.OK
    rated = 4.18e6
    torque = free["main_shaft_torque"]
    assert 1.5 * rated < np.max(np.abs(torque[3000:])) < 5.0 * rated  # the brake shakes the drivetrain
    assert np.max(np.abs(free["rotor_torque"] - two["rotor_torque"])) < 0.1 * np.ptp(two["rotor_torque"])
    # what rings in the gears when the brake falls in dies as their damping has it, and nothing grows after
    ring = free["high_speed_shaft_torque"] - static["high_speed_shaft_torque"]
    struck, later = np.ptp(ring[3000:3100]), np.ptp(ring[5500:])
    assert struck > 1e-3 * np.ptp(free["high_speed_shaft_torque"])
    assert later < 0.05 * struck


# kinds of numbers ---------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["quasi_static", "multibody"])
def test_lanes_give_what_floats_give(geared: Turbine, kind: str) -> None:
    found = []
    for numbers in ("floats", "lanes"):
        model = meltemi.build(geared, ModelOptions(drivetrain=kind))
        wind = meltemi.TurbulentWind(speed=12.0, intensity=0.16)
        run = Simulation(Run(model, wind, duration=20.0, channels=[*GEAR_LOADS, "yaw_moment_x"]), numbers=numbers)  # type: ignore[arg-type]
        while not run.finished:
            run.advance(1000)
        found.append(run.result().data)
    assert np.max(np.abs(found[1] - found[0]) / np.abs(found[0]).max(axis=0)) < 1e-10


def test_a_run_begins_at_rest_in_the_gears(geared: Turbine, multibody: Model) -> None:
    case = Case(multibody, SteadyWind(speed=12.0))
    meltemi.operating_point(multibody, 12.0).put(case)
    begin(case)
    gears, w = case.view("gears"), View(GearModes, multibody.rotor.gear_modes)["frequency"]
    size = np.abs(w**2 * gears["angle"]).max()
    assert size > 0.0
    assert np.abs(gears["acceleration"]).max() < 1e-6 * size


@pytest.mark.long
def test_derivatives_go_through_the_gears(geared: Turbine) -> None:
    """Of a run by the stiffness of the drivetrain, against a difference of two runs."""
    model = meltemi.build(geared, ModelOptions(drivetrain="multibody", torsion_modes=0))
    wind = SteadyWind(speed=9.0, shear_exponent=0.3)
    start = meltemi.operating_point(model, 9.0)
    names = ["main_shaft_torque", "stage_2_ring_force"]
    given: dict[str, Any] = {
        "duration": 3.0,
        "channels": names,
        "start": start,
        "controller": meltemi.control.ConstantController(),
    }
    path = "structure.shaft_stiffness"
    exact = meltemi.analysis.sensitivity(meltemi.Run(model, wind, **given), [path]).slopes[..., 0]
    value = model.parameter(path)
    h = 1e-5 * value
    runs = [simulate(model.with_parameters(**{path: value + x}), wind, **given).data for x in (h, -h)]
    difference = (runs[0] - runs[1]) / (2.0 * h)
    assert np.abs(exact).max() > 1e-3 * np.abs(runs[0]).max() / value
    np.testing.assert_allclose(exact, difference, atol=1e-4 * np.abs(difference).max(axis=0).max(), rtol=1e-4)
