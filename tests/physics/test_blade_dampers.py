"""Tuned mass dampers in blades: closed forms at rest and in rotation, energy, loads, damping, saved states."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import meltemi
from meltemi.compiler import View
from meltemi.core.errors import InputError
from meltemi.environment import Environment
from meltemi.sea.blade_dampers import Rider, Slide
from meltemi.simulation.case import Case
from meltemi.simulation.step import equations
from meltemi.turbine import MassDamper
from meltemi.turbine.exchange import BladeFrame, BladeMotion, Machine
from meltemi.verification.closed_form import NO_DAMPING
from meltemi.verification.energy import mechanical_energy
from meltemi.verification.openfast_deck import deck_options, deck_turbine

Float = NDArray[np.float64]
GRAVITY, SPEED, SPAN = 9.80665, 1.2, 45.0
CORE = ("tower", "yaw", "generator", "drivetrain")
OPTIONS: dict[str, Any] = {"blade_nodes": 9, "tower_nodes": 3, "time_step": 0.01, "locked": (*CORE, "blades")}
CONSTANT = meltemi.control.ConstantController
M = 400.0
"""[kg] of a damper."""


def machine(*dampers: MassDamper, cone: float = 0.0, gravity: float = 0.0, **changes: Any) -> Any:
    """The NREL 5 MW without tilt in thin air, with dampers."""
    turbine = meltemi.load_turbine("nrel5mw")
    hub, nacelle = turbine.hub.replace(precone=cone), turbine.nacelle.replace(tilt=0.0)
    damping = changes.pop("damping", turbine.blade.structure.damping)
    turbine = turbine.replace(hub=hub, nacelle=nacelle, mass_dampers=dampers, **{"blade.structure.damping": damping})
    return meltemi.build(
        turbine, meltemi.ModelOptions(**(OPTIONS | changes)), Environment(air_density=1e-6, gravity=gravity)
    )


def poles(model: Any, speed: float, pitch: float = 0.0) -> tuple[NDArray[np.complex128], tuple[str, ...]]:
    """Eigenvalues without those of the air, and names of these states, with blade 1 up."""
    if speed:
        point = meltemi.operating_point(model, 8.0, rotor_speed=speed, pitch=pitch)
    else:
        point = meltemi.analysis.parked_point(model, 0.1, pitch=pitch)
    linear = meltemi.analysis.linearise(model, point, (), ("rotor_thrust",), azimuth=0.0)
    kept = [i for i, name in enumerate(linear.states) if "node" not in name]
    return np.linalg.eigvals(linear.A[np.ix_(kept, kept)]), tuple(linear.states[i] for i in kept)


def quadratic(mass: Float, damping: Float, stiffness: Float) -> NDArray[np.complex128]:
    """Eigenvalues of M x'' + C x' + K x = 0."""
    n = len(mass)
    A = np.block([[np.zeros((n, n)), np.eye(n)], [-np.linalg.solve(mass, stiffness), -np.linalg.solve(mass, damping)]])
    return np.linalg.eigvals(A)


def near(found: NDArray[np.complex128], expected: NDArray[np.complex128], tolerance: float) -> None:
    for pole in expected:
        assert np.abs(found - pole).min() < tolerance * abs(pole), (pole, found)


@pytest.mark.long
def test_at_rest_it_is_one_of_two_masses() -> None:
    """One edgewise mode of each blade: modal mass with what the blade carries across, the damper along its axis."""
    own = {"locked": CORE, "flap_modes": 0, "edge_modes": 1, "torsion_modes": 0, "residual_modes": 0}
    damper = MassDamper(span=SPAN, axes="y", mass=M, stiffness=M * 6.5**2, damping=0.1 * M * 6.5)
    model = machine(damper, **own)
    found, names = poles(model, 0.0)
    assert "blade 3 mass damper 1 y velocity" in names
    bare = Case(machine(**own), meltemi.SteadyWind(speed=0.1))
    equations(0.0, 0.0, bare.system)
    modal = float(bare["arm_mass"][0, 0, 0])
    (mode, *_) = meltemi.analysis.natural_modes(bare.model)
    twist = np.interp(SPAN, *(getattr(model.turbine.blade.structure, k) for k in ("position", "twist")))
    u = model.rotor.blade.modes.at(np.array([SPAN]))[0, 0, :3]
    axes = np.array([[np.cos(twist), -np.sin(twist), 0.0], [np.sin(twist), np.cos(twist), 0.0], [0.0, 0.0, 1.0]])
    x, y, z = axes @ u
    modes = model.rotor.blade
    mass = np.array([[modal + M * (x * x + y * y + z * z), M * y], [M * y, M]])
    stiffness = np.diag([modal * mode.frequency**2, damper.stiffness])
    expected = quadratic(mass, np.diag([modes.damping[0, 0], damper.damping]), stiffness)
    near(found, expected, 2e-3)


@pytest.mark.long
@pytest.mark.parametrize("axes", ["x", "y"])
def test_rotation_softens_a_spring_in_its_plane(axes: Any) -> None:
    """sqrt(k/m - W^2) in the rotor plane, sqrt(k/m) out of it."""
    model = machine(MassDamper(span=SPAN, axes=axes, angle=0.0, mass=M, stiffness=M * 16.0))
    found, _ = poles(model, SPEED)
    frequency = np.sqrt(16.0 - (SPEED**2 if axes == "y" else 0.0))
    assert np.sort(np.abs(found.imag))[-1] == pytest.approx(frequency, rel=1e-9)
    assert np.abs(found.real).max() < 1e-9


@pytest.mark.long
def test_two_axes_are_coupled_by_rotation_in_a_cone() -> None:
    """Axes across the rotor plane are coupled by the centrifugal force, with cone by that of Coriolis as well."""
    cone, angle, pitch, k, c = 0.3, 0.4, 0.2, 16.0, 0.1
    damper = MassDamper(span=SPAN, axes="xy", angle=angle, mass=M, stiffness=M * k, damping=M * c)
    found, _ = poles(machine(damper, cone=cone), SPEED, pitch)
    turn = angle + pitch
    w = SPEED * np.array([np.cos(cone) * np.cos(turn), np.cos(cone) * np.sin(turn), -np.sin(cone)])
    stiffness = k * np.eye(2) - w @ w * np.eye(2) + np.outer(w[:2], w[:2])
    near(found, quadratic(np.eye(2), c * np.eye(2) + 2.0 * w[2] * np.array([[0.0, -1.0], [1.0, 0.0]]), stiffness), 1e-9)


@pytest.mark.long
def test_gravity_swings_the_mass_once_a_revolution() -> None:
    """y'' + c y' + (k - W^2) y = -g sin(W t); radial load at the root and at stations inboard of the mass."""
    k, c = 9.0, 0.6
    dampers = (MassDamper(span=SPAN, axes="y", angle=0.0, mass=M, stiffness=M * k, damping=M * c),)
    names = ("mass_damper_1_y_position_1", "mass_damper_1_y_force_1", "RootFzb1", "RootFyb1", "azimuth")
    names = (*names, "Spn1FLzb1", "Spn2FLzb1")
    runs = []
    for each in (dampers, ()):
        model = machine(*each, gravity=GRAVITY)
        point = meltemi.operating_point(model, 8.0, rotor_speed=SPEED, pitch=0.0)
        runs.append(
            meltemi.simulate(
                model,
                8.0,
                duration=40.0,
                controller=CONSTANT(),
                start=point,
                channels=names[0 if each else 2 :],
                stations=meltemi.Stations(blade=(30.0, 50.0)),
            )
        )
    run, bare = runs
    late = run.time > 30.0
    t = run["azimuth"][late]
    # towards the trailing edge, against the rotation: up when the blade goes down
    answer = -GRAVITY / (k - 2.0 * SPEED**2 + 1j * SPEED * c)
    y = np.imag(answer * np.exp(1j * t))
    assert np.abs(run[names[0]][late] - y).max() < 2e-3 * abs(answer)
    rate = SPEED * np.real(answer * np.exp(1j * t))
    assert np.abs(run[names[1]][late] - M * (k * y + c * rate)).max() < 4e-3 * M * k * abs(answer)
    radius = model.turbine.hub.radius + SPAN
    # centrifugal force, weight, and that of Coriolis: a mass that slides against the rotation turns more slowly
    radial = M * (SPEED**2 * radius - GRAVITY * np.cos(t) - 2.0 * SPEED * rate)
    for name, scale in (("RootFzb1", 1.0), ("Spn1FLzb1", 1.0), ("Spn2FLzb1", 0.0)):
        added = run[name][late] - bare[name][late]
        assert np.abs(added - scale * radial).max() < 3e-3 * np.abs(radial).max(), name
    assert np.abs((run["RootFyb1"] - bare["RootFyb1"])[late] - run[names[1]][late]).max() < 1e-6 * M * GRAVITY


@pytest.mark.long
def test_steady_operation_has_the_mass_in_equilibrium() -> None:
    """Its radial load is in the means, and a run from there begins close to its periodic motion."""
    damper = MassDamper(span=SPAN, axes="xy", mass=M, stiffness=M * 49.0, damping=M * 2.0)
    point, bare = (
        meltemi.operating_point(machine(*each, gravity=GRAVITY), 8.0, rotor_speed=SPEED, pitch=0.0)
        for each in ((damper,), ())
    )
    radius = 1.5 + SPAN
    assert point["RootFzb1"] - bare["RootFzb1"] == pytest.approx(M * SPEED**2 * radius, rel=2e-4)
    run = meltemi.simulate(
        machine(damper, gravity=GRAVITY),
        8.0,
        duration=30.0,
        controller=CONSTANT(),
        start=point,
        channels=("mass_damper_1_y_position_2",),
    )
    y = run["mass_damper_1_y_position_2"]
    period = run.time < 2.0 * np.pi / SPEED
    assert np.ptp(y[period]) == pytest.approx(np.ptp(y[-np.count_nonzero(period) :]), rel=0.05)


@pytest.mark.long
@pytest.mark.parametrize("blade_model", ["modal", "geometrically_exact"])
def test_energy_is_kept(blade_model: Any) -> None:
    """Of a turbine that vibrates and turns under gravity, with undamped masses along two axes and in one blade only."""
    dampers = (
        MassDamper(span=SPAN, axes="xy", mass=M, stiffness=M * 25.0),
        MassDamper(span=60.0, axes="y", blades=(2,), angle=0.3, mass=M, stiffness=M * 16.0),
    )
    more = {"blade_model": blade_model, "locked": ("tower", "yaw"), "time_step": 0.0025, "damping": NO_DAMPING}
    more |= {"advanced": {"corrections": 1}}
    model, bare = machine(*dampers, gravity=GRAVITY, **more), machine(gravity=GRAVITY, **more)
    model, bare = (
        m.with_parameters(**{"aerodynamics.air_density": 0.0, "structure.shaft_damping": 0.0}) for m in (model, bare)
    )
    start = meltemi.Start(rotor_speed=SPEED, coordinates={"blade 1 1st flap": 1.0, "blade 2 1st edge": 0.5})
    calm = meltemi.SteadyWind(speed=0.1)
    run = meltemi.Simulation(
        meltemi.Run(model, calm, duration=10.0, controller=CONSTANT(), start=start, channels=["azimuth"])
    )
    probe, energy, own = Case(bare, calm), [], []
    run.advance(1)
    while not run.finished:
        probe["q"][:], probe["v"][:] = run.motion()
        energy.append(sum(mechanical_energy(probe)))
        own.append(energy_of_masses(run.case, probe))
        run.advance(9)
    whole = np.array(energy) + np.array(own)
    assert np.ptp(energy) > 3e4  # they do exchange energy
    assert np.ptp(whole) < 1e-3 * np.ptp(energy)


def energy_of_masses(case: Case, probe: Case) -> float:
    """Kinetic, elastic and gravitational energy of the masses; the blades' motion is that of ``probe``."""
    (part,) = (p for p in case.parts if "slide" in p.signals)
    p, s, h = View(Rider, part.rider), View(Slide, case["slide"]), case.settings.time_step
    # at the last evaluated instant, as ``Simulation.motion``
    position, velocities = s["position"] - h * (s["held"] + 0.5 * h * s["earlier"]), s["held"]
    motion, frame, hub = (
        View(BladeMotion, probe["motion"]),
        View(BladeFrame, probe["frame"]),
        View(Machine, probe["machine"]),
    )
    found = 0.0
    for n in range(part.rider.shape[1]):
        b, k, first = int(p["blade"][n]), int(p["node"][n]), int(p["first"][n])
        x, v = np.zeros(3), np.zeros(3)
        for axis in range(2):
            if p["xy"[axis]][n]:
                x[axis], v[axis] = position[first], velocities[first]
                first += 1
        R = motion["orientation"][:, b, k].reshape(3, 3)
        E = R @ p["frame"][:, n].reshape(3, 3)
        arm = R @ p["arm"][:, n] + E @ x
        velocity = motion["velocity"][:, b, k] + np.cross(motion["spin"][:, b, k], arm) + E @ v
        place = frame["orientation"][:, b].reshape(3, 3) @ (motion["position"][:, b, k] + arm) + hub["hub_position"]
        found += 0.5 * p["mass"][n] * velocity @ velocity + p["mass"][n] * GRAVITY * place[2]
        found += 0.5 * p["stiffness"][n] * x @ x
    return float(found)


@pytest.mark.long
def test_it_damps_the_first_edgewise_mode() -> None:
    """By Den Hartog's rule for a share of 3 % of the modal mass: from 0.5 to 5 % of critical damping."""
    own = {"locked": CORE, "flap_modes": 0, "edge_modes": 1, "torsion_modes": 0, "residual_modes": 0}
    bare = Case(machine(**own), meltemi.SteadyWind(speed=0.1))
    equations(0.0, 0.0, bare.system)
    modal = float(bare["arm_mass"][0, 0, 0])
    (mode, *_) = meltemi.analysis.natural_modes(bare.model)
    u = bare.model.rotor.blade.modes.at(np.array([55.0]))[0, 0, 1]
    mass = 0.03 * modal / u**2
    w = mode.frequency / 1.03
    damper = MassDamper(
        span=55.0, axes="y", mass=mass, stiffness=mass * w**2, damping=2.0 * mass * w * np.sqrt(0.09 / (8.0 * 1.03**3))
    )
    found, _ = poles(machine(damper, **own), 0.0)
    before = float(mode.damping)
    after = float(min(-p.real / abs(p) for p in found if p.imag > 0.0))
    assert before < 0.005 and after > 0.05, (before, after)


OPENFAST = {
    "mass_damper_1_x_position_1": (-0.22252, 0.036476),
    "mass_damper_1_y_position_1": (0.023089, 0.18539),
    "RootMxc1": (1.4856e6, 2.7431e6),
    "RootMyc1": (9.4112e6, 1.8817e5),
}
"""Mean and standard deviation from 60 to 120 s [m, N m] in OpenFAST 5.0.0, ModCoupling 3, step 5 ms: NREL 5 MW at
10.5 rpm in 12 m/s from undeflected, 500 kg with 20 kN/m and 600 N s/m along both axes of the root, 55 m from it."""


@pytest.mark.long
def test_masses_in_blades_move_as_in_openfast() -> None:
    """Means within 0.6 %, spreads within 0.2 %, and 1 % flapwise, where the tower still rings."""
    damper = MassDamper(span=55.0, angle=0.0, mass=500.0, stiffness=20e3, damping=600.0, axes="xy")
    turbine = deck_turbine(meltemi.load_turbine("nrel5mw")).replace(mass_dampers=(damper,))
    model = meltemi.build(turbine, deck_options(turbine, "A", locked=("yaw", "generator", "drivetrain")))
    result = meltemi.simulate(
        model,
        meltemi.SteadyWind(speed=12.0),
        duration=120.0,
        controller=CONSTANT(),
        start=meltemi.Start(rotor_speed=10.5 * np.pi / 30.0, coordinates={}),
        channels=tuple(OPENFAST),
        output_step=0.05,
        transient=60.0,
    )
    for name, (mean, spread) in OPENFAST.items():
        found = result.evaluated[name]
        assert found.mean() == pytest.approx(mean, rel=0.006), name
        assert found.std() == pytest.approx(spread, rel=0.01 if name == "RootMyc1" else 0.002), name


@pytest.mark.long
def test_a_saved_run_continues_bit_for_bit(tmp_path: Path) -> None:
    from meltemi.io import restore_state, save_state, stop_at

    damper = MassDamper(
        span=SPAN, axes="xy", mass=M, stiffness=M * 49.0, damping=M, stops=(-0.1, 0.1), stop_stiffness=1e4
    )
    run = meltemi.Run(machine(damper, gravity=GRAVITY), 8.0, duration=2.0, channels=("all",))
    first, second, whole = (meltemi.Simulation(run) for _ in range(3))
    stop_at(first, 0.8)
    first.advance(10**9)
    save_state(first, tmp_path / "run.state")
    assert restore_state(second, tmp_path / "run.state") == []
    second.advance(10**9)
    whole.advance(10**9)
    assert np.abs(whole.result()["mass_damper_1_y_position_1"]).max() > 0.1  # it meets a stop
    assert whole.result().data.tobytes() == second.result().data.tobytes()


def test_bad_input() -> None:
    fits = {"mass": M, "stiffness": M * 16.0}
    with pytest.raises(InputError, match="expected either height"):
        MassDamper(**fits)
    with pytest.raises(InputError, match="expected either height"):
        MassDamper(height=10.0, span=10.0, **fits)
    with pytest.raises(InputError, match="blades and angle are those of a damper in a blade"):
        MassDamper(height=10.0, blades=(1,), **fits)
    with pytest.raises(InputError, match="blades: a blade is named twice"):
        MassDamper(span=10.0, blades=(1, 1), **fits)
    with pytest.raises(InputError, match=r"mass_dampers.1.span: 70 m is beyond the blade of 61.5 m"):
        machine(MassDamper(span=70.0, **fits))
    with pytest.raises(InputError, match=r"mass_dampers.1.blades: expected numbers of blades from 1 to 3, found 4"):
        machine(MassDamper(span=40.0, blades=(4,), **fits))
    with pytest.raises(InputError, match=r"mass_dampers.1.stiffness: 400 N/m cannot hold .* use more than 6\d\d"):
        machine(MassDamper(span=40.0, axes="y", mass=M, stiffness=M))
    with pytest.raises(InputError, match="mass_dampers.1: spring and stop have 1e.03 rad/s, too fast"):
        machine(MassDamper(span=40.0, mass=1.0, stiffness=1e6))
