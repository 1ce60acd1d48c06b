"""Every OpenFAST deck inside the rosco package: read, trimmed and run in turbulence, or refused by name."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

import meltemi
from meltemi import ModelOptions, Start, Status, SteadyWind, TurbulentWind, UnsupportedError
from meltemi.aero.bem import loss_factor
from meltemi.aero.tables import AeroNode, BladeFlow
from meltemi.bladed_controllers.rosco import edit_discon, rosco_example
from meltemi.compiler import View
from meltemi.simulation.case import Case

pytestmark = pytest.mark.rosco

DECKS: dict[str, tuple[dict[str, Any], float]] = {
    "5MW_Land_Simulink": ({"control_of": "NREL-5MW"}, 11.0),
    "BAR_10": ({}, 9.0),
    "IEA-15-240-RWT-Monopile": ({}, 10.5),
    "IEA-15-240-RWT-Monopile_wDTUcontroller": ({"control_of": "IEA-15-240-RWT-Monopile"}, 10.5),
    "IEA-15-240-RWT_OLAF": ({"momentum_wake": True}, 10.5),
    "IEA-15-240-RWT-UMaineSemi": ({"fixed_base": True}, 10.5),
    "NREL-2p8-127": ({}, 9.5),
    "NREL-5MW": ({}, 11.0),
}
"""How each is read, and a wind speed [m/s] somewhat below its rated one."""
REFUSED = {
    "MHK_RM1_Floating": "marine",
    "5MW_Land_Simulink": "controller is not ROSCO",
}


def main_file(folder: Path, name: str) -> Path:
    return next(folder.rglob(f"{name}.fst"))


def read(folder: Path, name: str, how: dict[str, Any]) -> meltemi.io.Deck:
    if "control_of" in how:
        how = how | {"control_of": meltemi.io.read_openfast(main_file(folder, how["control_of"]))}
    return meltemi.io.read_deck(main_file(folder, name), **how)


def test_no_deck_is_left_out(rosco_cases: Path) -> None:
    assert {path.stem for path in rosco_cases.rglob("*.fst")} == DECKS.keys() | REFUSED.keys()


@pytest.mark.parametrize("name", REFUSED)
def test_refused_by_name(rosco_cases: Path, name: str) -> None:
    with pytest.raises((UnsupportedError, meltemi.InputError), match=REFUSED[name]):
        meltemi.io.read_openfast(main_file(rosco_cases, name))


def test_a_vortex_wake_is_that_of_olaf(rosco_cases: Path) -> None:
    """600 panels of one time step, 5 ms: 0.38 revolutions at 7.55 rpm, less than the shortest wake that is possible."""
    deck = read(rosco_cases, "IEA-15-240-RWT_OLAF", {})
    options = ModelOptions(**deck.options)
    assert (options.wake, options.vortices.length, options.vortices.wake_core) == ("free", 1.0, 2.0)
    assert [note.what for note in deck.noted("approximated") if "nNWPanels" in note.what] == ["nNWPanels = 600"]


@pytest.mark.parametrize("models", ["as in the deck", "ours"])
@pytest.mark.parametrize("name", DECKS)
def test_trims_and_runs_in_turbulence(rosco_cases: Path, name: str, models: str) -> None:
    how, below = DECKS[name]
    deck = read(rosco_cases, name, how)
    turbine = deck.turbine
    model = meltemi.build(turbine, ModelOptions(**deck.options) if models == "as in the deck" else None)
    reference = turbine.control.pitch.reference_speed / turbine.drivetrain.gear_ratio
    pitch = []
    for speed in (0.6 * below, below, 1.3 * below, 2.0 * below):
        point = meltemi.operating_point(model, speed)
        assert abs(point.imbalance) < 1e-3 * turbine.rated_power / reference
        share = 0.5 * 1.225 * np.pi * turbine.rotor_radius**2 * speed**3
        assert 0.02 < point["rotor_power"] / share < 0.55
        pitch.append(point.pitch)
        if speed > 1.2 * below:
            assert point.rotor_speed == pytest.approx(reference, rel=2e-3)
            assert point["generator_power"] == pytest.approx(turbine.rated_power, rel=0.01)
    assert pitch[-1] > pitch[-2] > pitch[0]
    result = meltemi.simulate(model, TurbulentWind(speed=1.6 * below, intensity=0.12, seed=1), duration=60.0)
    assert result.status is Status.OK, result.message
    late = result.between(20.0, 60.0)
    assert late["generator_power"].mean() == pytest.approx(turbine.rated_power, rel=0.12)
    assert late["rotor_speed"].mean() == pytest.approx(reference, rel=0.06)
    assert late["tip_clearance_1"].min() > 0.0


def test_the_monopile_softens_the_tower(rosco_cases: Path) -> None:
    path = main_file(rosco_cases, "IEA-15-240-RWT-Monopile")
    free, clamped = (meltemi.build(meltemi.io.read_openfast(path, fixed_base=fixed)) for fixed in (False, True))
    on_pile, on_ground = (m.rotor.tower.modes.frequency[0] / (2.0 * np.pi) for m in (free, clamped))
    assert on_pile < 0.9 * on_ground
    assert on_pile == pytest.approx(0.17, abs=0.02)  # NREL/TP-5000-75698: 0.17 Hz on its monopile


def test_flaps_of_the_bar_stand_at_zero(rosco_cases: Path) -> None:
    """Four of its airfoils have tables for UserProp -10, 0 and 10; the first are half a unit of lift lower."""
    turbine = meltemi.io.read_openfast(main_file(rosco_cases, "BAR_10"))
    lift = [
        float(np.interp(0.05, polar.angle_of_attack, polar.lift))
        for name, polar in turbine.airfoils.items()
        if name[-2:] in ("20", "21", "22", "23")
    ]
    assert lift == pytest.approx([0.5526, 0.5718, 0.6008, 0.6286], abs=1e-3)


def test_losses_of_the_gearbox_are_read(rosco_cases: Path) -> None:
    assert meltemi.io.read_openfast(main_file(rosco_cases, "BAR_10")).drivetrain.gearbox_efficiency == pytest.approx(
        0.95
    )


# at fixed speed, against closed forms --------------------------------------------------------------------

PREBENT = {"BAR_10": 1.0, "IEA-15-240-RWT-Monopile": 0.79, "NREL-2p8-127": 1.2}
"""Decks of ElastoDyn's straight blades with prebent shapes and drag in the induction, and a rotor speed [rad/s]."""
RIGID = {"flap_modes": 0, "edge_modes": 0, "torsion_modes": 0, "mode_shapes": "computed", "tower_influence": "none"}
STATIC = {"inflow": "quasi_steady", "stall": "static", "skew": "none"}


def shape_of(folder: Path, name: str) -> dict[str, NDArray[np.float64]]:
    """Columns of the AeroDyn blade file, read without the package."""
    named = {"NREL-2p8-127": "NREL_2p8_127", "IEA-15-240-RWT-Monopile": "IEA-15-240-RWT_AeroDyn15_blade"}
    (path,) = (p for p in folder.rglob("*AeroDyn*blade*.dat") if named.get(name, name) in str(p))
    lines = path.read_text(encoding="utf-8").splitlines()
    start = next(i for i, line in enumerate(lines) if "BlSpn" in line)
    rows = np.array([[float(x) for x in line.split()[:7]] for line in lines[start + 2 :] if line.split()])
    return dict(zip(lines[start].split()[:7], rows.T, strict=True))


def rigid_rotor(folder: Path, name: str, pitch: float) -> tuple[meltemi.Turbine, Case]:
    deck = meltemi.io.read_deck(main_file(folder, name), fixed_base=True)
    turbine = deck.turbine.replace(**{"nacelle.tilt": 0.0})
    options = ModelOptions(**(deck.options | RIGID | STATIC))
    assert options.axial_drag
    assert options.tangential_drag
    case = Case(meltemi.build(turbine, options), SteadyWind(speed=9.0))
    for _ in range(3):
        Start(rotor_speed=PREBENT[name], pitch=pitch).put(case)
    case.evaluate(0.0)
    return turbine, case


@pytest.mark.parametrize("name", PREBENT)
def test_lengths_and_angles_are_those_of_the_prebent_blade(rosco_cases: Path, name: str) -> None:
    shape, pitch = shape_of(rosco_cases, name), 0.2
    _, case = rigid_rotor(rosco_cases, name, pitch)
    nodes, flow = View(AeroNode, case.model.rotor.aero_nodes), View(BladeFlow, case["flow"])
    arc = np.sqrt(sum(np.diff(shape[c]) ** 2 for c in ("BlSpn", "BlCrvAC", "BlSwpAC")))
    assert arc.sum() > 1.001 * shape["BlSpn"][-1]
    np.testing.assert_allclose(nodes["length"][0, : len(arc) + 1].sum(), arc.sum(), rtol=1e-6)
    np.testing.assert_allclose(nodes["length"][0, 1:-1], 0.5 * (arc[1:] + arc[:-1]), rtol=1e-6)
    # the section's orientation in the coned frame, and from it cant and chord angle in AeroDyn's order
    found = []
    for cant, twist in np.radians(np.transpose([shape["BlCrvAng"], shape["BlTwist"]])):
        turns = (("z", -pitch), ("y", cant), ("z", -twist))
        section = Rotation.identity()
        for axis, angle in turns:
            section = section * Rotation.from_euler(axis, angle)
        found.append(section.as_euler("XYZ")[1:])
    cant, chord = np.transpose(found)
    np.testing.assert_allclose(np.arctan2(flow["sin_bend"][0], flow["cos_bend"][0]), cant, atol=2e-4)
    np.testing.assert_allclose(flow["theta"][0], -chord, atol=3e-4 * pitch)


@pytest.mark.parametrize("name", PREBENT)
def test_momentum_of_the_air_on_the_cone(rosco_cases: Path, name: str) -> None:
    """Forces per length from the polars, the momentum of the air that they change, and their sums."""
    shape = shape_of(rosco_cases, name)
    turbine, case = rigid_rotor(rosco_cases, name, 0.0)
    nodes, flow, rotor = View(AeroNode, case.model.rotor.aero_nodes), View(BladeFlow, case["flow"]), case.view("rotor")
    inner = slice(1, -1)
    vx, vy, a, ap, r, theta = (flow[n][0, inner] for n in ("vx", "vy", "axial", "tangential", "radius", "theta"))
    un, ut = vx * (1.0 - a), vy * (1.0 + ap)
    phi, speed2 = np.arctan2(un, ut), un**2 + ut**2
    airfoils = [turbine.airfoils[turbine.blade.aerodynamics.airfoil[i]] for i in range(len(shape["BlSpn"]))][inner]
    cl, cd = np.transpose(
        [
            [np.interp(x, p.angle_of_attack, c) for c in (p.lift, p.drag)]
            for x, p in zip(phi - theta, airfoils, strict=True)
        ]
    )
    rho, chord = case.model.environment.density, shape["BlChord"][inner]
    pressure = 0.5 * rho * speed2 * chord
    normal = pressure * (cl * np.cos(phi) + cd * np.sin(phi))
    driving = pressure * (cl * np.sin(phi) - cd * np.cos(phi))
    np.testing.assert_allclose(flow["normal_force"][0, inner], normal, rtol=2e-3, atol=2e-3 * np.abs(normal).max())
    np.testing.assert_allclose(flow["driving_force"][0, inner], driving, rtol=2e-3, atol=2e-3 * np.abs(driving).max())
    # an annulus of the cone, along whose normal vx stands, as long as the blade's arc
    light = (a < 0.4) & (a > 0.0)
    assert light.sum() > 15
    numbers = zip(nodes["tip_number"][0, inner], nodes["hub_number"][0, inner], np.sin(phi), strict=True)
    F = np.array([loss_factor(tip, hub, s) for tip, hub, s in numbers])
    air = 2.0 * np.pi * r * rho * un * 2.0 * F / turbine.n_blades
    np.testing.assert_allclose(flow["normal_force"][0, inner][light], (air * a * vx)[light], rtol=1e-5)
    np.testing.assert_allclose(
        flow["driving_force"][0, inner][light], (air * ap * vy)[light], rtol=1e-4, atol=1e-5 * driving.max()
    )
    # sums over the arc: forces normal to the leaning sections, and their pitching moments about a leaning span
    lean, aside = np.radians(shape["BlCrvAng"]) - turbine.hub.precone, shape["BlSwpAC"]
    normal, driving, pitching = (flow[n][0] for n in ("normal_force", "driving_force", "pitching_moment"))
    along = np.sqrt(flow["radius"][0] ** 2 - aside**2)
    share = turbine.n_blades * nodes["length"][0]
    assert rotor["thrust"] == pytest.approx(np.sum(share * normal * np.cos(lean)), rel=1e-9)
    torque = driving * along + (pitching - aside * normal) * np.sin(lean)
    assert rotor["torque"] == pytest.approx(np.sum(share * torque), rel=1e-9)


@pytest.mark.parametrize("law", ["baseline", "rosco"])
def test_no_node_is_caught_in_a_second_solution(rosco_cases: Path, tmp_path: Path, law: str) -> None:
    """With drag in the induction single nodes were, here after 47 s under the baseline law, at a = -0.5 to the end."""
    deck = meltemi.io.read_deck(main_file(rosco_cases, "NREL-2p8-127"))
    assert deck.options["tangential_drag"]
    model = meltemi.build(deck.turbine, ModelOptions(**(deck.options | {"inflow": "quasi_steady", "stall": "static"})))
    controller = None
    if law == "rosco":
        settings = rosco_example("Test_Cases/NREL_2p8_127/NREL-2p8-127_DISCON.IN")
        settings = edit_discon(settings, tmp_path / "DISCON.IN", LoggingLevel=0)
        controller = meltemi.control.BladedController(deck.turbine, meltemi.control.find_rosco(), settings)
    wind = TurbulentWind(speed=7.0, intensity=0.16, seed=1)
    run = meltemi.Simulation(
        meltemi.Run(model, wind, duration=70.0, controller=controller, channels=["induction_residual"])
    )
    axial, lowest = View(BladeFlow, run.case["flow"])["axial"], 1.0
    while not run.finished:
        run.advance(20)
        lowest = min(lowest, axial[:, 2:-1].min())
    result = run.result()
    assert result.status is Status.OK, result.message
    assert lowest > -0.05
    assert result["induction_residual"].max() < 1e-6
