"""Structure: beams with closed forms, symmetry, section loads, bearing, foundation, brake."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import meltemi
from meltemi import (
    Environment,
    ModelOptions,
    Start,
    Stations,
    SteadyWind,
    Turbine,
    UnsupportedError,
    simulate,
)
from meltemi.analyses.modes import natural_modes
from meltemi.control import signals as s
from meltemi.exchange.pile import pile_foundation
from meltemi.simulation.vibrations import equilibrium, vacuum_case
from meltemi.structure.beam import assemble
from meltemi.structure.members import blade_beam
from meltemi.verification.closed_form import NO_DAMPING, uniform_blade

CALM = SteadyWind(speed=0.0)
LENGTH, EI, GJ, COUPLING, MASS = 60.0, 3.0e9, 1.0e9, 0.6e9, 250.0


def coupled_blade(turbine: Turbine) -> Turbine:
    """Uniform straight blade whose flapwise bending turns it nose up or down."""
    K = np.diag([1e12, 1e12, 1e12, 2.0 * EI, EI, GJ])
    K[4, 5] = K[5, 4] = COUPLING
    M = np.diag([MASS, MASS, MASS, 50.0, 50.0, 100.0])
    structure = {
        "position": [0.0, 0.5 * LENGTH, LENGTH],
        "twist": [0.0] * 3,
        "stiffness_matrix": [K.tolist()] * 3,
        "mass_matrix": [M.tolist()] * 3,
        "damping": NO_DAMPING,
    }
    return uniform_blade(turbine, **{"blade.structure": structure})


def test_bend_twist_coupling_of_the_finite_elements(turbine: Turbine) -> None:
    # with M = [EI K; K GJ] kappa and a force at the tip: kappa_y = F x GJ / D, kappa_z = -F x K / D, D = EI GJ - K^2
    mesh = assemble(blade_beam(coupled_blade(turbine).blade.structure), np.linspace(0.0, LENGTH, 11))
    force = np.zeros(6 * len(mesh.z))
    force[-6] = 1e4
    u = mesh.flexibility @ (mesh.flexibility.T @ force)
    determinant = EI * GJ - COUPLING**2
    assert u[-6] == pytest.approx(1e4 * LENGTH**3 / 3.0 * GJ / determinant, rel=1e-4)
    assert u[-1] == pytest.approx(-1e4 * LENGTH**2 / 2.0 * COUPLING / determinant, rel=1e-4)


def test_torsion_of_a_prebent_blade(turbine: Turbine) -> None:
    # axis x = a (z/L)^2, force F across it at the tip. About the tangent acts T = F a (1 - z/L)^2, and bending across
    # turns a section about an axis that leans with the tangent: theta_z = a F L / 3 (1 / GJ + 1 / EI)
    a, force = 0.6, 1e4
    z = np.linspace(0.0, LENGTH, 61)
    n = len(z)
    K, M = np.diag([1e13, 1e13, 1e13, EI, EI, GJ]), np.diag([MASS, MASS, MASS, 50.0, 50.0, 100.0])
    structure = {
        "position": z.tolist(),
        "axis_x": (a * (z / LENGTH) ** 2).tolist(),
        "twist": np.linspace(0.3, 0.0, n).tolist(),
        "stiffness_matrix": [K.tolist()] * n,
        "mass_matrix": [M.tolist()] * n,
        "damping": NO_DAMPING,
    }
    mesh = assemble(blade_beam(turbine.blade.structure.model_validate(structure)), np.linspace(0.0, LENGTH, 41))
    load = np.zeros(6 * len(mesh.z))
    load[-5] = force
    u = mesh.flexibility @ (mesh.flexibility.T @ load)
    assert u[-1] == pytest.approx(a * force * LENGTH / 3.0 * (1.0 / GJ + 1.0 / EI), rel=2e-3)
    assert u[-5] == pytest.approx(force * LENGTH**3 / (3.0 * EI), rel=1e-3)


def test_bend_twist_coupling_in_the_assembled_machine(turbine: Turbine) -> None:
    # own weight of a horizontal blade pitched by 90 deg bends it flapwise: w L^4 / 8, and twists it: w L^3 / 6
    gravity = 1e-3
    locked = ("tower", "yaw", "drivetrain", "generator")
    options = ModelOptions(flap_modes=4, edge_modes=1, torsion_modes=2, blade_nodes=40, locked=locked)
    model = meltemi.build(coupled_blade(turbine), options, Environment(gravity=gravity))
    case = vacuum_case(model)
    Start(pitch=0.5 * np.pi, coordinates={"generator": 0.5 * np.pi}).put(case)
    equilibrium(case, np.flatnonzero(model.locked == 0.0))
    case.evaluate(0.0)
    case.loads(0.0)
    determinant = EI * GJ - COUPLING**2
    w = MASS * gravity
    root = case.view("root")
    bend, twist = root["pitched_tip"][0, 0], root["tip_rotation"][2, 0]
    assert abs(bend) == pytest.approx(w * LENGTH**4 / 8.0 * GJ / determinant, rel=2e-3)
    assert abs(twist) == pytest.approx(w * LENGTH**3 / 6.0 * COUPLING / determinant, rel=1e-2)
    assert np.sign(bend) == -np.sign(twist)


def test_many_modes_of_a_kind_are_of_this_kind(turbine: Turbine) -> None:
    # among the higher modes are some that stretch the blade: they are neither flap nor edge
    model = meltemi.build(turbine, ModelOptions(flap_modes=5, edge_modes=5))
    assert np.abs(model.rotor.blade.modes.shape[:, :, :3]).max() < 3.0
    result = simulate(model, SteadyWind(speed=11.0), duration=2.0, channels=["RootMyc1"])
    assert result.status is meltemi.Status.OK


@pytest.mark.slow
def test_frequencies_converge_with_the_elements(turbine: Turbine) -> None:
    from meltemi.structure.beam import natural_modes as beam_modes

    beam = blade_beam(turbine.blade.structure)
    first = [beam_modes(assemble(beam, np.linspace(0.0, 61.5, n + 1)), 4).frequency for n in (20, 40, 80, 320)]
    error = [float(np.max(np.abs(f / first[-1] - 1.0))) for f in first[:3]]
    assert error[1] < 1e-3
    assert error[2] < 0.5 * error[1] < 0.5 * error[0]


def test_rotor_is_symmetric_under_a_third_of_a_turn(turbine: Turbine) -> None:
    """Turned by 120 deg with the blades renamed, the machine does exactly the same."""
    model = meltemi.build(turbine)
    wind = SteadyWind(speed=11.0, shear_exponent=0.2)
    names = ["RootMyc1", "RootMyc2", "RootMyc3", "TwrBsMyt", "RotSpeed"]
    runs = []
    for turned in (0, 1):
        coordinates = {"generator": 2.0 * np.pi / 3.0 * turned}
        for b in (1, 2, 3):
            # what blade b has in the first run, the blade that takes its place has in the second
            other = (b - 1 - turned) % 3 + 1
            coordinates |= {f"blade {other} 1st flap": 1.0 * b, f"blade {other} 1st edge": 0.1 * b}
        start = Start(rotor_speed=1.2, coordinates=coordinates, generator_torque=3e4)
        runs.append(
            simulate(
                model, wind, duration=20.0, channels=names, start=start, controller=meltemi.control.ConstantController()
            )
        )
    for b in (1, 2, 3):
        other = (b - 2) % 3 + 1
        assert runs[1][f"RootMyc{other}"] == pytest.approx(runs[0][f"RootMyc{b}"], rel=1e-7, abs=1.0)
    assert runs[1]["TwrBsMyt"] == pytest.approx(runs[0]["TwrBsMyt"], rel=1e-7)


def two_blades(turbine: Turbine, **changes: Any) -> Turbine:
    return turbine.replace(n_blades=2, **changes)


def test_two_blades_are_symmetric_under_half_a_turn(turbine: Turbine) -> None:
    model = meltemi.build(two_blades(turbine))
    wind = SteadyWind(speed=9.0, shear_exponent=0.2)
    runs = []
    for turned in (0, 1):
        coordinates = {"generator": np.pi * turned, f"blade {1 + turned} 1st flap": 2.0}
        start = Start(rotor_speed=1.0, coordinates=coordinates, generator_torque=1e4)
        runs.append(
            simulate(
                model,
                wind,
                duration=20.0,
                channels=["RootMyc1", "RootMyc2"],
                start=start,
                controller=meltemi.control.ConstantController(),
            )
        )
    assert runs[1]["RootMyc2"] == pytest.approx(runs[0]["RootMyc1"], rel=1e-7, abs=1.0)


def energy_range(turbine: Turbine, blades: int, time_step: float, **more: Any) -> float:
    """Range of the total energy over that of the elastic energy, vibrating without air and damping."""
    from meltemi.simulation.case import Case
    from meltemi.verification.energy import mechanical_energy

    described = turbine.replace(
        n_blades=blades,
        **{
            "blade.structure.damping": NO_DAMPING,
            "tower.damping": NO_DAMPING,
            "drivetrain.damping": 0.0,
            "yaw.damping": 0.0,
        },
    )
    options = ModelOptions(time_step=time_step, advanced={"corrections": 1}, **more)
    model = meltemi.build(described, options).with_parameters(**{"aerodynamics.air_density": 0.0})
    start = Start(rotor_speed=1.267, coordinates={"blade 1 1st flap": 2.0, "tower 1st side-side": 0.3, "yaw": 0.001})
    run = meltemi.Simulation(
        meltemi.Run(
            model,
            CALM,
            duration=20.0,
            controller=meltemi.control.ConstantController(),
            start=start,
            channels=["azimuth"],
        )
    )
    probe, energy = Case(model, CALM), []
    run.advance(1)
    while not run.finished:
        probe["q"][:], probe["v"][:] = run.motion()
        energy.append(mechanical_energy(probe))
        run.advance(7)
    kinetic, elastic, weight = np.array(energy).T
    assert np.ptp(elastic) > 1e5  # it does vibrate
    assert np.ptp(weight) > 1e4
    return float(np.ptp(kinetic + elastic + weight) / np.ptp(elastic))


@pytest.mark.slow
@pytest.mark.parametrize("blades", [2, 3])
def test_energy_is_kept(turbine: Turbine, blades: int) -> None:
    # 0.1 % is left however small the step: kinematics are complete to second order, energy shows the third
    assert energy_range(turbine, blades, 0.005) < 5e-3
    assert energy_range(turbine, blades, 0.00125) < 1.5e-3


@pytest.mark.slow
def test_energy_is_kept_with_implicit_steps(turbine: Turbine) -> None:
    assert energy_range(turbine, 3, 0.005, integration="implicit") < 5e-3
    assert energy_range(turbine, 3, 0.0125, integration="implicit") < 5e-3


def test_energy_is_kept_with_a_mass_at_the_tower_top(turbine: Turbine) -> None:
    assert energy_range(turbine.replace(**{"tower.top_mass": 5e4}), 3, 0.005) < 5e-3


def test_energy_is_kept_with_ice_on_one_blade(turbine: Turbine) -> None:
    assert energy_range(meltemi.turbine.with_ice(turbine, meltemi.turbine.Icing(blades=(2,))), 3, 0.005) < 5e-3


def test_section_loads_agree_with_the_springs_they_pass_through(turbine: Turbine) -> None:
    """Shaft torque and yaw moment from outboard inertia and air equal what spring and damper carry."""
    model = meltemi.build(turbine)
    wind = meltemi.TurbulentWind(speed=14.0, intensity=0.15)
    channels = ["rotor_torque", "yaw_moment_z", "q drivetrain", "nacelle_yaw", "rotor_speed", "generator_speed"]
    result = simulate(model, wind, duration=30.0, channels=channels, output_step=0.01)
    d = turbine.drivetrain
    twist_rate = result["rotor_speed"] - result["generator_speed"] / d.gear_ratio
    torque = d.stiffness * result["q drivetrain"] + d.damping * twist_rate
    # velocities in forces are extrapolated: the difference is of second order in the step
    assert np.max(np.abs(result["rotor_torque"] - torque)) < 0.01 * np.ptp(torque)
    yaw_rate = np.gradient(result["nacelle_yaw"], 0.01)
    moment = turbine.yaw.stiffness * result["nacelle_yaw"] + turbine.yaw.damping * yaw_rate
    # the bearing's own axis leans with the tower top, the channel's does not
    assert np.max(np.abs(result["yaw_moment_z"] - moment)[5:-5]) < 0.03 * np.ptp(moment)


def test_stations_join_root_and_tower_ends(turbine: Turbine) -> None:
    model = meltemi.build(turbine)
    channels = [
        *(f"station_{n}_{what}_{axis}_1" for n in (1, 2, 3) for what in ("force", "moment") for axis in "xyz"),
        *(f"tower_station_{n}_{what}_{axis}" for n in (1, 2) for what in ("force", "moment") for axis in "xyz"),
        *"RootFxb1 RootFyb1 RootFzc1 RootMxb1 RootMyb1 RootMzc1 TwrBsFxt TwrBsMyt TwrBsMxt YawBrFxp YawBrFzp".split(),
        *"yaw_force_x yaw_force_z yaw_moment_y".split(),
    ]
    stations = Stations(blade=(0.0, 30.0, 61.4), tower=(0.01, turbine.tower.length))
    wind = SteadyWind(speed=11.0, shear_exponent=0.2)
    result = simulate(model, wind, duration=10.0, channels=channels, stations=stations)
    pairs = {"force_x": "RootFxb1", "force_y": "RootFyb1", "moment_x": "RootMxb1", "moment_y": "RootMyb1"}
    for ours, root in pairs.items():
        assert result[f"station_1_{ours}_1"] == pytest.approx(result[root], rel=1e-6, abs=100.0)
        inner, middle, tip = (np.max(np.abs(result[f"station_{n}_{ours}_1"])) for n in (1, 2, 3))
        assert tip < 1e-2 * inner
        assert middle < inner
    assert result["tower_station_1_moment_y"] == pytest.approx(result["TwrBsMyt"], rel=1e-3)
    # at the top only the head is above: the same load as at the yaw bearing, in axes that do not lean
    assert result["tower_station_2_force_z"] == pytest.approx(result["yaw_force_z"], rel=2e-3)
    assert result["tower_station_2_moment_y"] == pytest.approx(result["yaw_moment_y"], rel=2e-2, abs=2e4)


def test_section_loads_of_a_hanging_blade(turbine: Turbine) -> None:
    """At rest the tension at a station is the weight outboard of it."""
    locked = ("tower", "yaw", "drivetrain", "generator", "blades")
    model = meltemi.build(
        turbine.replace(**{"nacelle.tilt": 0.0, "hub.precone": 0.0}), ModelOptions(locked=locked, blade_nodes=60)
    ).with_parameters(**{"aerodynamics.air_density": 0.0})
    result = simulate(
        model,
        CALM,
        duration=0.1,
        controller=meltemi.control.ConstantController(),
        start=Start(coordinates={"generator": np.pi}),
        stations=Stations(blade=(20.0, 41.0)),
        channels=["station_1_force_z_1", "station_2_force_z_1", "TwrBsFzt", "YawBrFzp"],
    )
    x, m = turbine.blade.structure.position, turbine.blade.structure.mass
    assert m is not None
    for n, at in ((1, 20.0), (2, 41.0)):
        fine = np.linspace(at, x[-1], 20001)
        weight = 9.80665 * np.trapezoid(np.interp(fine, x, m), fine)
        assert result[f"station_{n}_force_z_1"][-1] == pytest.approx(weight, rel=2e-3)
    head = 9.80665 * (turbine.nacelle.mass + turbine.hub.mass + 3 * np.trapezoid(m, x))
    assert result["YawBrFzp"][-1] == pytest.approx(-head, rel=1e-3)


@pytest.mark.parametrize("pitch", [0.0, 0.3])
def test_rotation_turns_sections_into_the_rotor_plane(turbine: Turbine, pitch: float) -> None:
    """The propeller moment of the rotary inertia, which ElastoDyn's blades have not: it is all of RootMzc here."""
    s = turbine.blade.structure
    one = np.ones(len(s.position))
    inertias = {"blade.structure.flap_inertia": 20.0 * one, "blade.structure.edge_inertia": 500.0 * one}
    level = {"hub.precone": 0.0, "nacelle.tilt": 0.0}
    rigid = ModelOptions(locked=("tower", "yaw", "drivetrain", "generator", "blades"), blade_nodes=60)
    model = meltemi.build(turbine.replace(**inertias, **level), rigid, Environment(gravity=0.0))
    start = Start(rotor_speed=1.2, pitch=pitch)
    result = simulate(
        model.with_parameters(**{"aerodynamics.air_density": 0.0}),
        CALM,
        duration=0.1,
        controller=meltemi.control.ConstantController(),
        start=start,
        channels=["RootMzc1"],
    )
    angle = s.twist + pitch
    expected = 1.2**2 * np.trapezoid(480.0 * np.sin(angle) * np.cos(angle), s.position)
    assert result["RootMzc1"][-1] == pytest.approx(expected, rel=2e-3)


def test_a_mass_below_the_yaw_bearing_loads_the_tower_only(turbine: Turbine) -> None:
    """Beside the same mass in the nacelle, on the yaw axis: equal motion, but other loads at the bearing."""
    mass, n = 3e4, turbine.nacelle
    total = n.mass + mass
    x, _, z = n.mass_centre
    spread = n.mass * mass / total
    in_nacelle = {
        "nacelle.mass": total,
        "nacelle.mass_centre": [x * n.mass / total, 0.0, z * n.mass / total],
        "nacelle.roll_inertia": n.roll_inertia + spread * z * z,
        "nacelle.nod_inertia": n.nod_inertia + spread * (x * x + z * z),
    }
    channels = ["YawBrFxp", "YawBrFzp", "YawBrTAxp", "TwrBsFzt", "TwrBsMyt", "tower_top_fore_aft", "nacelle_yaw"]
    start = Start(rotor_speed=1.2, coordinates={"tower 1st fore-aft": 0.3})
    below, above = (
        simulate(
            meltemi.build(turbine.replace(**changes)),
            SteadyWind(speed=10.0),
            duration=10.0,
            start=start,
            controller=meltemi.control.ConstantController(),
            channels=channels,
        )
        for changes in ({"tower.top_mass": mass}, in_nacelle)
    )
    for name in ("TwrBsFzt", "TwrBsMyt", "tower_top_fore_aft"):
        np.testing.assert_allclose(below[name], above[name], rtol=2e-3, atol=2e-3 * np.abs(above[name]).max())
    push = below["YawBrFxp"] - above["YawBrFxp"] - mass * below["YawBrTAxp"]
    # the axis leans by 0.01 rad, so a share of the weight comes in
    slope = -push / (mass * 9.80665 * below["tower_top_fore_aft"])
    assert np.all((slope > 1.3 / turbine.tower.length) & (slope < 2.0 / turbine.tower.length))
    np.testing.assert_allclose(below["YawBrFzp"] - above["YawBrFzp"], mass * 9.80665, rtol=2e-2)


@pytest.mark.slow
def test_free_and_driven_yaw(turbine: Turbine) -> None:
    wind = SteadyWind(speed=12.0, direction=np.radians(10.0))
    channels = ["nacelle_yaw", "YawBrMzp"]
    held, free = (
        simulate(meltemi.build(turbine, ModelOptions(yaw=kind)), wind, duration=20.0, channels=channels)
        for kind in ("held", "free")
    )
    assert np.max(np.abs(held["nacelle_yaw"])) < 1e-3
    assert np.max(np.abs(free["nacelle_yaw"])) > 0.02
    assert np.max(np.abs(free["YawBrMzp"])) < 0.02 * np.max(np.abs(held["YawBrMzp"]))

    def drive(state: Any, measured: Any, demands: Any, dt: float) -> None:
        demands[s.YAW_RATE_DEMAND] = 0.004 if measured[s.TIME] < 10.0 else 0.0

    driven = simulate(
        meltemi.build(turbine, ModelOptions(yaw="driven", locked=("generator",))),
        SteadyWind(speed=12.0),
        duration=20.0,
        channels=channels,
        controller=meltemi.Controller(update=drive),
    )
    assert driven["nacelle_yaw"][-1] == pytest.approx(0.04, abs=1e-3)


def test_foundation_softens_the_tower(turbine: Turbine) -> None:
    soft = np.diag([1e9, 1e9, 1e10, 4e10, 4e10, 1e10])
    stiff = soft * 1e4
    lowest = {}
    for name, matrix in {"soft": soft, "stiff": stiff}.items():
        model = meltemi.build(turbine.replace(foundation={"stiffness": matrix.tolist()}))
        lowest[name] = natural_modes(model)[0].frequency
    clamped = natural_modes(meltemi.build(turbine))[0].frequency
    assert lowest["stiff"] == pytest.approx(clamped, rel=5e-3)
    assert lowest["soft"] < 0.9 * clamped
    result = simulate(
        meltemi.build(turbine.replace(foundation={"stiffness": soft.tolist()})),
        SteadyWind(speed=11.0),
        duration=20.0,
        channels=["tower_top_fore_aft", "TwrBsMyt"],
    )
    rigid = simulate(meltemi.build(turbine), SteadyWind(speed=11.0), duration=20.0, channels=["tower_top_fore_aft"])
    # the base turns by M / K
    lean = result["TwrBsMyt"].mean() / soft[4, 4] * turbine.tower.length
    extra = result["tower_top_fore_aft"].mean() - rigid["tower_top_fore_aft"].mean()
    assert extra == pytest.approx(lean, rel=0.1)


def test_brake_stops_a_parked_rotor(turbine: Turbine) -> None:
    def brake(state: Any, measured: Any, demands: Any, dt: float) -> None:
        demands[s.BRAKE] = 1.0
        demands[s.GENERATOR_TORQUE] = 0.0
        demands[s.PITCH_DEMAND : s.PITCH_DEMAND + 3] = 1.5

    braked = turbine.replace(**{"drivetrain.brake_torque": 28116.0})
    result = simulate(
        meltemi.build(braked),
        SteadyWind(speed=8.0),
        duration=30.0,
        controller=meltemi.Controller(update=brake),
        start=Start(rotor_speed=0.3, pitch=1.5),
        channels=["generator_speed", "rotor_speed", "brake_torque", "rotor_torque"],
        output_step=0.01,
    )
    late = result.time > 20.0
    # the rotor still swings on its shaft, the generator stands
    assert np.max(np.abs(result["generator_speed"][late])) < 0.2
    assert abs(result["rotor_speed"][late].mean()) < 1e-3
    assert result["brake_torque"].max() == pytest.approx(28116.0)
    # nothing alternates from step to step
    jumps = np.diff(result["rotor_torque"][late], n=2)
    assert np.max(np.abs(jumps)) < 0.02 * np.ptp(result["rotor_torque"][late])


@pytest.mark.slow
@pytest.mark.parametrize("yaw", [0.0, 60.0, 120.0, 180.0])
@pytest.mark.parametrize("speed", [0.0, -0.5])
def test_parked_and_turning_backwards_at_any_yaw_angle(turbine: Turbine, yaw: float, speed: float) -> None:
    result = simulate(
        meltemi.build(turbine, ModelOptions(locked=("generator",))),
        SteadyWind(speed=25.0, direction=np.radians(yaw)),
        duration=20.0,
        controller=meltemi.control.ConstantController(),
        start=Start(rotor_speed=speed, pitch=1.57),
        channels=["RootMyc1", "TwrBsMyt", "induction_residual", "mean_induction", "rotor_speed"],
    )
    assert result.status is meltemi.Status.OK
    assert np.all(np.isfinite(result.data))
    assert result["induction_residual"].max() < 1e-3
    if speed == 0.0:
        assert abs(result["RootMyc1"]).max() < 3e7


@pytest.mark.slow
def test_induction_fades_out_for_a_parked_rotor(turbine: Turbine) -> None:
    model = meltemi.build(turbine, ModelOptions(locked=("generator",)))
    induction = {}
    for ratio in (0.5, 1.5, 3.0):
        result = simulate(
            model,
            SteadyWind(speed=10.0),
            duration=2.0,
            controller=meltemi.control.ConstantController(),
            start=Start(rotor_speed=ratio * 10.0 / 63.0),
            channels=["node_14_axial_induction_1"],
        )
        induction[ratio] = abs(result["node_14_axial_induction_1"]).max()
    assert induction[0.5] == 0.0
    assert 0.0 < induction[1.5] < induction[3.0]


def test_what_is_not_modelled_is_refused_by_name(turbine: Turbine) -> None:
    def refused(match: str, described: Turbine, options: ModelOptions | None = None) -> None:
        with pytest.raises((UnsupportedError, meltemi.InputError), match=match):
            meltemi.build(described, options)

    refused("torsion", uniform_blade(turbine), ModelOptions(torsion_modes=1))
    refused(
        "tower_torsion_modes needs",
        turbine.replace(**{"tower.torsion_stiffness": None}),
        ModelOptions(tower_torsion_modes=1),
    )
    refused("mode_shapes", turbine, ModelOptions(mode_shapes="given"))
    refused("did you mean", turbine, ModelOptions(locked=("towr",)))


@pytest.mark.parametrize("torque", [2.0e4, -2.0e4])
def test_gearbox_takes_its_share(turbine: Turbine, torque: float) -> None:
    # (J + n^2 J_g / eta) dw/dt = -n Q / eta, driven the other way -n Q eta; J from a run without losses
    n, Jg, eta = turbine.drivetrain.gear_ratio, turbine.drivetrain.generator_inertia, 0.9
    options = ModelOptions(
        torsion_modes=0, wake="none", locked=("tower", "yaw", "drivetrain", "blades"), tower_drag=False
    )
    start = Start(rotor_speed=0.5, pitch=0.0, generator_torque=torque)

    def acceleration(efficiency: float) -> float:
        lossy = turbine.replace(**{"drivetrain.gearbox_efficiency": efficiency})
        model = meltemi.build(lossy, options, Environment(gravity=0.0, air_density=1e-9))
        result = simulate(
            model,
            CALM,
            duration=1.0,
            start=start,
            controller=meltemi.control.ConstantController(),
            channels=["rotor_speed"],
        )
        return float(np.polyfit(result.time, result["rotor_speed"], 1)[0])

    whole = -n * torque / acceleration(1.0)
    loss = eta if torque > 0.0 else 1.0 / eta
    expected = -n * torque / loss / (whole - n**2 * Jg + n**2 * Jg / eta)
    assert acceleration(eta) == pytest.approx(expected, rel=1e-6)


def test_gearbox_losses_in_the_power(turbine: Turbine) -> None:
    lossy = turbine.replace(**{"drivetrain.gearbox_efficiency": 0.95})
    point = meltemi.operating_point(meltemi.build(lossy, ModelOptions(tower_influence="none")), 8.0)
    share = point.generator_torque * point.generator_speed / point["rotor_power"]
    assert share == pytest.approx(0.95, rel=2e-3)


def test_pile_as_springs() -> None:
    # uniform cantilever: u = F L^3 / 3EI + F L / GA, theta = F L^2 / 2EI; it moves 33/140 of its mass (Rayleigh)
    z, one = np.linspace(-30.0, 15.0, 4), np.ones(4)
    length, EI, GA = 45.0, 1.6e12, 1e14
    pile = pile_foundation(z, EI * one, GA * one, 3e11 * one, 1.2e12 * one, 2e4 * one)
    F = np.linalg.inv(pile.stiffness)
    assert F[0, 0] == pytest.approx(length**3 / (3.0 * EI) + length / GA, rel=1e-9)
    assert F[4, 0] == pytest.approx(length**2 / (2.0 * EI), rel=1e-9)
    assert F[3, 1] == pytest.approx(-(length**2) / (2.0 * EI), rel=1e-9)
    assert F[5, 5] == pytest.approx(length / 1.2e12, rel=1e-9)
    assert F[2, 2] == pytest.approx(length / 3e11, rel=1e-9)
    assert pile.mass == pytest.approx(33.0 / 140.0 * 2e4 * length, rel=1e-3)


def test_damping_by_ratios_and_by_times_agree(turbine: Turbine) -> None:
    options = ModelOptions(torsion_modes=0)
    by_ratio = meltemi.build(turbine, options)
    w = by_ratio.rotor.blade.modes.frequency_alone
    flap, edge = 0.0123, 0.0234
    alike = turbine.replace(
        **{"blade.structure.damping": {"flap": 0.5 * flap * w[0], "edge": 0.5 * edge * w[2], "torsion": 0.0}}
    )
    timed = turbine.replace(
        **{"blade.structure.damping": None, "blade.structure.damping_time": {"flap": flap, "edge": edge}}
    )
    C, D = (meltemi.build(t, options).rotor.blade.damping for t in (alike, timed))
    np.testing.assert_allclose(C[[0, 2]][:, [0, 2]], D[[0, 2]][:, [0, 2]], rtol=1e-9, atol=1e-9 * C.max())
    assert D[1, 1] > 2.0 * C[1, 1]  # the second flap mode: its ratio grows with frequency instead of staying


def test_a_blade_that_cannot_twist_has_no_torsion_mode(turbine: Turbine) -> None:
    stiff = turbine.replace(**{"blade.structure.torsion_stiffness": None})
    assert "1st torsion" in meltemi.build(turbine).rotor.blade.names
    assert "1st torsion" not in meltemi.build(stiff).rotor.blade.names
    with pytest.raises(UnsupportedError, match="with torsion_stiffness"):
        meltemi.build(stiff, ModelOptions(torsion_modes=1))
