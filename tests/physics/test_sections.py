"""Angle of the chord and rotation of blade sections, against exact geometry and thin aerofoil theory."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

import meltemi
from meltemi import ModelOptions, Start, SteadyWind, Turbine
from meltemi.aero.tables import AeroNode, BladeFlow
from meltemi.compiler import View
from meltemi.simulation.case import Case

Float = NDArray[np.float64]


def prebent(turbine: Turbine, size: float) -> Turbine:
    """Its blades curved upwind and swept, their sections normal to the curve."""
    structure = turbine.blade.structure
    curve = size * structure.position**2 / structure.position[-1]
    return turbine.replace(**{"blade.structure.axis_x": -0.2 * curve, "blade.structure.axis_y": 0.1 * curve})


def bent(turbine: Turbine, size: float, **options: Any) -> tuple[View, Case]:
    """Flow and the case of a blade bent and twisted by ``size``."""
    model = meltemi.build(turbine, ModelOptions(flap_modes=1, edge_modes=1, torsion_modes=1, **options))
    case = Case(model, SteadyWind(speed=8.0))
    shape = {"blade 1 1st flap": 8.0 * size, "blade 1 1st edge": 6.0 * size, "blade 1 1st torsion": size}
    Start(rotor_speed=1.0, pitch=0.2, coordinates=shape).put(case)
    case.evaluate(0.0)
    return View(BladeFlow, case["flow"]), case


def sections_of(case: Case, pitch: float) -> Rotation:
    """Orientation of the sections of blade 1 in unpitched blade axes: of the undeformed one, then elastic."""
    a, structure = case.model.turbine.blade.aerodynamics, case.model.turbine.blade.structure
    place = case.model.rotor.blade_layout.position
    slope = [
        np.zeros(len(place))
        if axis is None
        else np.interp(place, structure.position, np.gradient(axis, structure.position))
        for axis in (structure.axis_x, structure.axis_y)
    ]
    tangent = np.stack([*slope, np.ones(len(place))], axis=1)
    angle = np.arctan(np.hypot(*slope))
    axis = np.cross([0.0, 0.0, 1.0], tangent)
    size = np.maximum(np.linalg.norm(axis, axis=1), 1e-300)
    undeformed = Rotation.from_rotvec(axis * (angle / size)[:, None])
    undeformed *= Rotation.from_euler("z", -np.interp(place, a.position, a.twist)[:, None])
    elastic = Rotation.from_matrix(case.view("motion")["orientation"][:, 0].T.reshape(-1, 3, 3))
    return Rotation.from_euler("z", -pitch) * elastic * undeformed


@pytest.mark.parametrize("curved", [False, True])
@pytest.mark.parametrize("blade_model", [pytest.param("modal", marks=pytest.mark.slow), "geometrically_exact"])
def test_angle_of_the_chord_is_that_of_the_rotated_section(turbine: Turbine, blade_model: str, curved: bool) -> None:
    """In the plane of the strip the angle is between those of chord and normal, whose difference is of fourth order."""
    given = prebent(turbine, 0.08) if curved else turbine
    flow, case = bent(given, 0.08, blade_model=blade_model)
    section = sections_of(case, 0.2)
    bend = np.arctan2(flow["sin_bend"][0], flow["cos_bend"][0])
    x, y, z = np.moveaxis((Rotation.from_euler("y", bend[:, None]).inv() * section).as_matrix(), 2, 0)
    assert np.abs(z[:, 0]).max() < 1e-14  # the strip is tangent to the blade
    chord, normal = np.arctan2(y[:, 0], y[:, 1]), np.arctan2(-x[:, 1], x[:, 0])
    np.testing.assert_allclose(flow["theta"][0], 0.5 * (chord + normal), rtol=0.0, atol=1e-6)
    assert np.abs(flow["theta"][0] - np.array([r.as_euler("XYZ")[2] for r in section])).max() > 1e-3


def test_openfasts_angle_of_the_chord_is_the_last_of_sweep_flap_and_twist(turbine: Turbine) -> None:
    flow, case = bent(prebent(turbine, 0.08), 0.08, advanced={"chord_angle": "openfast"})
    np.testing.assert_allclose(flow["theta"][0], -sections_of(case, 0.2).as_euler("XYZ")[:, 2], rtol=0.0, atol=1e-14)


@pytest.mark.parametrize("lean", [0.1, -0.1])
def test_a_blade_whose_sections_lean_alike_is_a_coned_one(turbine: Turbine, lean: float) -> None:
    """Offsets and cant of the sections on a straight beam, as decks of OpenFAST have them, against the same cone."""
    a, s, hub = turbine.blade.aerodynamics, turbine.blade.structure, turbine.hub.radius
    level = turbine.replace(**{"hub.precone": 0.0, "nacelle.tilt": 0.0, "blade.aerodynamics.centre_y": None})
    offset = (a.position + hub) * np.tan(lean)
    leaning = level.replace(
        **{"blade.aerodynamics.centre_x": offset, "blade.aerodynamics.cant": np.full_like(offset, lean)}
    )
    longer = 1.0 / np.cos(lean)
    coned = level.replace(
        **{
            "hub.precone": -lean,
            "hub.radius": hub * longer,
            "blade.aerodynamics.centre_x": None,
            "blade.aerodynamics.position": a.position * longer,
            "blade.structure.position": s.position * longer,
        }
    )
    rigid = ModelOptions(flap_modes=0, edge_modes=0, torsion_modes=0, inflow="quasi_steady", stall="static")
    options = rigid.replace(tower_influence="none", tip_loss=False, hub_loss=False)
    found = []
    for described in (leaning, coned):
        model = meltemi.build(described, options)
        case = Case(model, SteadyWind(speed=9.0))
        for _ in range(3):
            Start(rotor_speed=1.1).put(case)
        case.evaluate(0.0)
        rotor = case.view("rotor")
        flow = View(BladeFlow, case["flow"])
        found.append([rotor["thrust"], rotor["torque"], *flow["phi"][0], *flow["normal_force"][0]])
    np.testing.assert_allclose(*found, rtol=1e-9)


def test_a_bent_blade_turns_about_its_span_but_does_not_pitch(turbine: Turbine) -> None:
    flow, case = bent(turbine, 0.2)
    slope = np.arctan2(flow["sin_bend"][0], flow["cos_bend"][0]) - turbine.hub.precone
    np.testing.assert_allclose(flow["rotation"][0], np.sin(slope), atol=1e-12)  # at 1 rad/s
    assert np.all(flow["pitching"][0] == 0.0)
    case["pitch"][1] = 0.1  # rad/s towards feather is nose down
    case.evaluate(0.0)
    np.testing.assert_allclose(flow["pitching"][0], -0.1 * flow["cos_bend"][0], atol=1e-12)


@pytest.mark.parametrize(("variant", "least", "most"), [("camber", 0.0, 1e-3), ("openfast", 3e-3, 1e-1)])
def test_momentum_balances_the_lift_in_curved_flow(turbine: Turbine, variant: Any, least: float, most: float) -> None:
    # a / (1 - a) = sigma' C_x / (4 F sin^2 phi) on a coned rotor in steady operation
    coned = turbine.replace(**{"hub.precone": -0.15, "nacelle.tilt": 0.0})
    options = ModelOptions(advanced={"stall_rotation": variant}, tower_influence="none", tip_loss=False, hub_loss=False)
    model = meltemi.build(coned, options.replace(locked=("blades", "tower", "drivetrain", "yaw")))
    case = Case(model, SteadyWind(speed=8.0))
    for _ in range(3):
        Start(rotor_speed=0.95).put(case)
    case.evaluate(0.0)
    flow, nodes = View(BladeFlow, case["flow"]), View(AeroNode, model.rotor.aero_nodes)
    middle = slice(8, 17)
    phi, a = flow["phi"][0, middle], flow["axial"][0, middle]
    sigma = (nodes["solid_length"] / flow["radius"])[0, middle]
    balanced = sigma * flow["lift"][0, middle] * np.cos(phi) / (4.0 * np.sin(phi) ** 2)
    error = np.abs(balanced / (a / (1.0 - a)) - 1.0).max()
    assert least <= error < most


@pytest.mark.slow
@pytest.mark.parametrize("yaw", [0.0, 60.0, 85.0, 90.0, 95.0, 150.0, 180.0])
@pytest.mark.parametrize("speed", [1.2, 0.3, -1.2])
def test_momentum_is_balanced_at_any_yaw_and_speed(turbine: Turbine, yaw: float, speed: float) -> None:
    options = ModelOptions(locked=("generator", "blades", "tower", "drivetrain", "yaw"), stall="static")
    wind = SteadyWind(speed=12.0, direction=np.radians(yaw))
    start = Start(rotor_speed=speed)
    names = ["induction_residual", "mean_induction"]
    model = meltemi.build(turbine, options)
    result = meltemi.simulate(
        model, wind, duration=6.0, controller=meltemi.control.ConstantController(), start=start, channels=names
    )
    assert np.abs(result["induction_residual"]).max() < 1e-6


def test_a_rotor_that_idles_across_the_wind_has_no_wake(turbine: Turbine) -> None:
    model = meltemi.build(turbine, ModelOptions(locked=("generator",)))
    case = Case(model, SteadyWind(speed=40.0, direction=np.radians(89.0)))
    Start(rotor_speed=0.1, pitch=1.5).put(case)
    case.evaluate(0.0)
    assert np.all(View(BladeFlow, case["flow"])["axial"] == 0.0)


def test_what_is_no_number_stays_inside_the_tables(turbine: Turbine) -> None:
    wind = meltemi.wind.generate_field(meltemi.TurbulentWind(speed=10.0, intensity=0.1, points=5), turbine, 1.0)
    case = Case(meltemi.build(turbine), wind)
    Start(rotor_speed=1.0).put(case)
    case["q"][:] = np.nan
    case.evaluate(0.0)  # would read outside its arrays
    assert np.isnan(View(BladeFlow, case["flow"])["theta"]).all()


def test_a_free_nacelle_starts_where_a_held_one_does(turbine: Turbine) -> None:
    free, held = (
        meltemi.operating_point(meltemi.build(turbine, ModelOptions(yaw=kind)), 9.0) for kind in ("free", "held")
    )
    assert free["generator_power"] == pytest.approx(held["generator_power"], rel=1e-12)


def test_derivatives_of_inflow_and_stall_are_those_of_their_steps(turbine: Turbine) -> None:
    model = meltemi.build(turbine)
    case = Case(model, SteadyWind(speed=9.0, shear_exponent=0.2))
    Start(rotor_speed=1.0).put(case)
    rng = np.random.default_rng(1)
    inflow, stall = case["inflow"], case["stall"]
    inflow += 0.2 * rng.standard_normal(inflow.shape)
    stall += 0.02 * rng.standard_normal(stall.shape)
    case.evaluate(0.0)
    case.rates()
    rates = case["d_inflow"], case["d_stall"]
    before, h = (inflow.copy(), stall.copy()), 1e-6
    case.evaluate(0.0, h)
    np.testing.assert_allclose((inflow - before[0]) / h, rates[0], rtol=1e-3, atol=1e-4)
    moving = np.any(rates[1] != 0.0, axis=0)
    assert 30 < moving.sum() < moving.size  # cylinders have no states
    np.testing.assert_allclose(((stall - before[1]) / h)[:, moving], rates[1][:, moving], rtol=2e-3, atol=2e-3)
