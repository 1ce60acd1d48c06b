"""A pile in the sea: closed forms of wave loads, added mass and stiffness, soil, and section loads in balance."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import scipy.linalg

import meltemi
from meltemi import InputError, ModelOptions, Start, build, load_turbine, simulate
from meltemi.analysis import natural_modes
from meltemi.environment import Crest, Current, IrregularSea, RegularSea, StillWater
from meltemi.sea.airy import wave_number
from meltemi.sea.pile_beam import mudline_deflection, pile_beam, pile_edges, soil_springs, supported_tower
from meltemi.sea.soil import Clay, Curve, Sand, Soil
from meltemi.simulation.case import Case
from meltemi.simulation.vibrations import vacuum_case
from meltemi.structure.beam import assemble
from meltemi.structure.members import points
from meltemi.turbine.definition import Turbine
from meltemi.wind.fields import SteadyWind

H, DEPTH, RHO, G = 4.0, 20.0, 1025.0, 9.80665
SMALL = {"blade_nodes": 5, "tower_nodes": 5, "time_step": 0.025}
RIGID = ModelOptions(**SMALL, locked=("tower", "blades", "yaw", "generator", "drivetrain"))
LOADS = ("wave_elevation", "sea_force_x", "sea_force_y", "sea_moment_y", "mudline_reaction_force_x",
         "mudline_reaction_moment_y", "pile_station_1_force_x", "pile_station_2_moment_y")  # fmt: skip


@pytest.fixture(scope="module")
def turbine() -> Turbine:
    return load_turbine("nrel5mw-monopile")


def amplitude(series: Any, time: Any, frequency: float) -> complex:
    """Complex amplitude of the first harmonic of whole periods."""
    return complex(2.0 * np.mean(series * np.exp(-1j * frequency * time)))


def loads(turbine: Turbine, sea: Any, period: float, options: ModelOptions = RIGID) -> Any:
    """Whole periods on a turbine in vacuum."""
    model = build(turbine, options).with_parameters(**{"aerodynamics.air_density": 0.0})
    steps = round(period / 0.025)
    run = simulate(
        model,
        0.1,
        duration=2.0 * period,
        sea=sea,
        channels=LOADS,
        start=Start(coordinates={}),
        output_step=0.025,
        controller=meltemi.control.ConstantController(),
    )
    return run.time[:steps], {name: run[name][:steps] for name in LOADS}


@pytest.mark.parametrize("period", [5.0, 8.0, 14.0])
def test_shear_and_moment_of_a_regular_wave(turbine: Turbine, period: float) -> None:
    """Inertia force from the sea bed to still water (H-27, H-28), 0.1 %."""
    plain = turbine.replace(**{"support.hydrodynamics.drag": 0.0})
    t, found = loads(plain, RegularSea(height=2.0, period=period, stretching="none"), period)
    w = 2.0 * np.pi / period
    k = float(wave_number(np.array([w]), DEPTH)[0])
    kh = k * DEPTH
    force = RHO * G * 1.0 * 2.0 * np.pi * 3.0**2 * np.tanh(kh)
    moment = RHO * G * 2.0 * np.pi * 3.0**2 * (kh * np.sinh(kh) - np.cosh(kh) + 1.0) / (k * np.cosh(kh))
    assert amplitude(found["sea_force_x"], t, w) == pytest.approx(1j * force, rel=1e-3)
    assert amplitude(-found["mudline_reaction_force_x"], t, w) == pytest.approx(1j * force, rel=1e-3)
    assert amplitude(-found["mudline_reaction_moment_y"], t, w) == pytest.approx(1j * moment, rel=1e-3)


def test_drag_of_a_regular_wave(turbine: Turbine) -> None:
    """Largest drag of a wave without inertia (H-29)."""
    plain = turbine.replace(
        **{"support.hydrodynamics": {"added_mass": 0.0, "pressure": 0.0, "drag": 1.0}, "support.flooded": None}
    )
    _, found = loads(plain, RegularSea(height=H, period=8.0, stretching="none"), 8.0)
    k = float(wave_number(np.array([2.0 * np.pi / 8.0]), DEPTH)[0])
    kh = k * DEPTH
    largest = RHO * G * 3.0 * (0.5 * H) ** 2 * (np.sinh(2.0 * kh) + 2.0 * kh) / (2.0 * np.sinh(2.0 * kh))
    assert found["sea_force_x"].max() == pytest.approx(largest, rel=1e-3)
    assert found["sea_force_x"].min() == pytest.approx(-largest, rel=1e-3)


def test_a_current_drags_by_the_square_of_its_speed(turbine: Turbine) -> None:
    _, found = loads(turbine, StillWater(current=Current(uniform=1.5)), 8.0)
    assert found["sea_force_x"][-1] == pytest.approx(0.5 * RHO * 6.0 * DEPTH * 1.5**2, rel=1e-9)
    _, turned = loads(turbine, StillWater(current=Current(uniform=1.5, direction=0.5 * np.pi)), 8.0)
    assert turned["sea_force_y"][-1] == pytest.approx(-0.5 * RHO * 6.0 * DEPTH * 1.5**2, rel=1e-9)


def test_stretching_reaches_to_the_crest_and_the_level_moves_the_water(turbine: Turbine) -> None:
    """Every kind has its own load; vertical stretching adds what lies between still water and crest."""
    plain = turbine.replace(**{"support.hydrodynamics": {"added_mass": 0.0, "pressure": 0.0}, "support.flooded": None})
    w, most = 2.0 * np.pi / 8.0, {}
    for kind in ("none", "vertical", "extrapolation", "wheeler"):
        _, found = loads(plain, RegularSea(height=H, period=8.0, stretching=kind), 8.0)
        most[kind] = found["sea_force_x"].max()
    k = float(wave_number(np.array([w]), DEPTH)[0])
    top = 0.5 * H * w / np.tanh(k * DEPTH)  # velocity at still water under the crest
    assert most["vertical"] - most["none"] == pytest.approx(RHO * 3.0 * 0.5 * H * top**2, rel=1e-3)
    slope = top * k * np.tanh(k * DEPTH)
    z = np.linspace(0.0, 0.5 * H, 400)
    above = np.trapezoid(RHO * 3.0 * (top + z * slope) ** 2, z)
    assert most["extrapolation"] - most["none"] == pytest.approx(above, rel=4e-3)
    assert most["none"] < most["wheeler"] < most["vertical"] < most["extrapolation"]
    still = StillWater(current=Current(uniform=1.5), level=2.25)
    _, found = loads(turbine, still, 8.0)
    assert found["sea_force_x"][-1] == pytest.approx(0.5 * RHO * 6.0 * (DEPTH + 2.25) * 1.5**2, rel=1e-9)


def test_diffraction_lowers_the_load_of_short_waves(turbine: Turbine) -> None:
    sea = RegularSea(height=1.0, period=3.5, stretching="none")
    force = []
    for kind in ("none", "maccamy_fuchs"):
        piled = turbine.replace(**{"support.hydrodynamics": {"drag": 0.0, "diffraction": kind}})
        t, found = loads(piled, sea, 3.5)
        force.append(abs(amplitude(found["sea_force_x"], t, 2.0 * np.pi / 3.5)))
    from meltemi.sea.airy import maccamy_fuchs

    k = wave_number(np.array([2.0 * np.pi / 3.5]), DEPTH)
    assert force[1] / force[0] == pytest.approx(0.5 * abs(maccamy_fuchs(3.0 * k))[0], rel=1e-6)
    assert force[1] < 0.9 * force[0]


def test_added_mass_and_the_water_inside_are_in_the_mass_matrix(turbine: Turbine) -> None:
    """Kinetic energy of the first mode with and without water: rho pi R^2 of the modal shape squared."""
    model = build(turbine, ModelOptions(**SMALL))
    matrices = []
    for density in (0.0, RHO):
        case = vacuum_case(model.with_parameters(**{"water.density": density}))
        case.evaluate(0.0)
        # the solver has overwritten the mass matrix: assemble it once more
        from meltemi.simulation.step import equations

        equations(0.0, 0.0, case.system)
        matrices.append(case["core_mass"].copy())
    member = model.rotor.tower
    z = np.linspace(0.0, DEPTH, 2001)
    phi = member.modes.at(z)[0, :, 0]
    added = RHO * np.pi * 3.0**2 * np.trapezoid(phi * phi, z)
    assert (matrices[1] - matrices[0])[0, 0] == pytest.approx(added, rel=2e-3)
    dry = build(turbine.replace(**{"support.flooded": None}), ModelOptions(**SMALL)).rotor.tower
    inside = RHO * np.pi * (3.0 - 0.06) ** 2 * DEPTH
    assert member.beam.rigid_pieces(np.array([0.0, 30.0]), np.zeros((1, 3)))[0][0, 0] - dry.beam.rigid_pieces(
        np.array([0.0, 30.0]), np.zeros((1, 3))
    )[0][0, 0] == pytest.approx(inside, rel=1e-3)


def test_water_lowers_frequencies_a_little(turbine: Turbine) -> None:
    model = build(turbine, ModelOptions(**SMALL))
    wet = [mode.frequency for mode in natural_modes(model)]
    dry = [
        mode.frequency
        for mode in natural_modes(
            build(turbine.replace(**{"support.flooded": None}), ModelOptions(**SMALL)).with_parameters(
                **{"water.density": 1e-9}
            )
        )
    ]
    assert 0.99 < wet[0] / dry[0] < 0.9999


def test_the_stiffness_of_the_pile_is_that_of_a_shear_flexible_cantilever(turbine: Turbine) -> None:
    support = turbine.support
    assert support is not None
    mesh = assemble(pile_beam(support), pile_edges(support) - pile_edges(support)[0])
    F = (mesh.flexibility @ mesh.flexibility.T)[-6:, -6:]
    area, bending = np.pi * 0.06 * 5.94, np.pi / 64.0 * (6.0**4 - 5.88**4)
    EI, GA = 210e9 * bending, 0.5 * 80.8e9 * area
    assert F[0, 0] == pytest.approx(30.0**3 / (3.0 * EI) + 30.0 / GA, rel=1e-6)
    assert F[0, 4] == pytest.approx(30.0**2 / (2.0 * EI), rel=1e-6)
    assert F[4, 4] == pytest.approx(30.0 / EI, rel=1e-6)


def test_given_shapes_on_static_shapes_of_the_pile(turbine: Turbine) -> None:
    """As in OpenFAST: mode shapes of the tower on the pile reduced to its top (Guyan), not natural modes of both."""
    shapes = {"fore_aft": [[1.0], [12.0, -16.0, 5.0]], "side_side": [[1.0], [12.0, -16.0, 5.0]]}
    tower = turbine.replace(**{"tower.mode_shapes": shapes}).tower
    layout, counts = points(np.linspace(0.0, tower.length, 11)), {"fore_aft": 2, "side_side": 2, "torsion": 0}
    head = np.diag([3.5e5] * 3 + [0.0] * 3)
    first = []
    for given in (False, True):
        member = supported_tower(turbine.support, tower, counts, head, None, layout, given=given)
        top = member.modes.shape[:, -1, :3]
        mass = member.modes.mass_alone + 3.5e5 * top @ top.T
        first.append(scipy.linalg.eigh(member.modes.stiffness, mass, eigvals_only=True)[:2])
    assert member.names[4:] == ("pile surge", "pile sway", "pile roll", "pile pitch", "pile yaw")
    np.testing.assert_allclose(first[1], first[0], rtol=0.03)
    assert np.all(first[1] > first[0])  # fewer shapes are stiffer


def test_a_mass_turns_with_the_pile_by_an_inertia_of_its_own(turbine: Turbine) -> None:
    """The pile's static shape for yaw of its top carries it whole; twice the other inertia by default."""
    shapes = {"fore_aft": [[1.0], [12.0, -16.0, 5.0]], "side_side": [[1.0], [12.0, -16.0, 5.0]]}
    tower = turbine.replace(**{"tower.mode_shapes": shapes}).tower
    layout, counts = points(np.linspace(0.0, tower.length, 11)), {"fore_aft": 2, "side_side": 2, "torsion": 0}
    assert turbine.support is not None
    piece = {"height": float(turbine.support.position[-1]), "mass": 1e5, "length": 0.1}
    found = []
    for own in ({}, {"inertia": 1e8}, {"inertia": 1e8, "yaw_inertia": 5e8}):
        support = turbine.support.replace(masses=(piece | own,))
        member = supported_tower(support, tower, counts, np.zeros((6, 6)), None, layout, given=True)
        found.append(member.modes.mass_alone[-1, -1])
    assert np.diff(found) == pytest.approx([2e8, 3e8], rel=0.01)


def test_the_steel_of_the_pile_damps_alike_in_given_and_natural_shapes(turbine: Turbine) -> None:
    """Its ratio is that of the first mode with the rotor, for its share of the stiffness of that mode (H-35)."""
    shapes = {"fore_aft": [[1.0], [12.0, -16.0, 5.0]], "side_side": [[1.0], [12.0, -16.0, 5.0]]}
    tower = turbine.replace(**{"tower.mode_shapes": shapes}).tower
    layout, counts = points(np.linspace(0.0, tower.length, 11)), {"fore_aft": 2, "side_side": 2, "torsion": 0}
    head = np.diag([3.5e5] * 3 + [0.0] * 3)
    assert turbine.support is not None
    ratio = []
    for given in (False, True):
        undamped, damped = (
            supported_tower(turbine.support.replace(damping=z), tower, counts, head, None, layout, given=given)
            for z in (0.0, 0.02)
        )
        w2, x = scipy.linalg.eigh(damped.modes.stiffness, damped.modes.mass)
        ratio.append(x[:, 0] @ (damped.damping - undamped.damping) @ x[:, 0] / (2.0 * np.sqrt(w2[0])))
    assert 0.1 < ratio[0] / 0.02 < 0.9
    assert ratio[1] == pytest.approx(ratio[0], rel=0.05)


def test_a_pile_in_stiff_soil_is_clamped_at_the_mudline(turbine: Turbine) -> None:
    stiff = {"shear_modulus": 1e15}  # in shear a pile turns in the ground that holds it
    deep = {"position": [-50.0, -20.0, -10.0, 0.0, 10.0], "diameter": [6.0] * 5, "thickness": [0.06] * 5, **stiff}
    rock = Curve(top=0.0, deflection=[0.0, 1.0], load=[0.0, 1e13])
    modes = {}
    for name, soil in (("rock", rock), ("sand", Sand(top=0.0, friction_angle=0.61, weight=1e4))):
        embedded = turbine.replace(support=turbine.support.content() | deep | {"soil": {"layers": [soil.content()]}})
        modes[name] = natural_modes(build(embedded, ModelOptions(**SMALL)))[0].frequency
    clamped_there = turbine.replace(support=turbine.support.content() | stiff)
    clamped = natural_modes(build(clamped_there, ModelOptions(**SMALL)))[0].frequency
    assert 0.985 * clamped < modes["rock"] < clamped  # the pile bends over the first 0.8 m in it
    assert 0.75 * clamped < modes["sand"] < 0.97 * clamped


def test_a_long_pile_on_springs_is_a_beam_on_an_elastic_foundation(turbine: Turbine) -> None:
    """Hetenyi (1946): deflection 2 H lambda / k and 2 M lambda^2 / k of the head."""
    k, shear, moment = 2e7, 1e6, 3e7
    deep = {"position": [-100.0, -20.0, 0.0, 10.0], "diameter": [6.0] * 4, "thickness": [0.06] * 4}
    curve = Curve(top=0.0, deflection=[0.0, 1.0], load=[0.0, k]).content()
    soil = Soil(layers=[curve], shear=shear, moment=moment)
    support = turbine.support.replace(**deep, shear_share=1.0, shear_modulus=1e15)
    springs = soil_springs(support, soil)
    np.testing.assert_allclose(springs.stiffness, k * np.diff(pile_edges(support)[pile_edges(support) <= -20.0]))
    bending = 210e9 * np.pi / 64.0 * (6.0**4 - 5.88**4)
    rate = (k / (4.0 * bending)) ** 0.25
    expected = 2.0 * shear * rate / k + 2.0 * moment * rate**2 / k
    assert mudline_deflection(support, soil) == pytest.approx(expected, rel=3e-3)


def test_soil_has_the_curves_of_api() -> None:
    """Ultimate resistance of sand by its coefficients C1, C2, C3 and of clay by Matlock's bearing factor."""
    sand = Sand(top=0.0, friction_angle=np.radians(30.0), weight=1e4, cyclic=True)
    p = sand.reaction(np.array([10.0]), 4.0, 2.0, 4e4)[0]
    assert p == pytest.approx(0.9 * min(1.9 * 4.0 + 2.7 * 2.0, 29.0 * 2.0) * 4e4, rel=3e-2)
    initial = sand.reaction(np.array([1e-7]), 4.0, 2.0, 4e4)[0] / 1e-7
    assert initial == pytest.approx(8e6 * 4.0, rel=1e-3)
    clay = Clay(top=0.0, strength=5e4, weight=8e3, strain=0.01)
    reference = 2.5 * 0.01 * 2.0
    full = min(3.0 + 8e3 * 4.0 / 5e4 + 0.5 * 4.0 / 2.0, 9.0) * 5e4 * 2.0
    found = clay.reaction(np.array([reference, 8.0 * reference, 20.0 * reference, -reference]), 4.0, 2.0, 3.2e4)
    np.testing.assert_allclose(found, np.array([0.5, 1.0, 1.0, -0.5]) * full, rtol=1e-12)


def test_secants_soften_with_the_load(turbine: Turbine) -> None:
    deep = {"position": [-50.0, -20.0, 0.0, 10.0], "diameter": [6.0] * 4, "thickness": [0.06] * 4}
    support = turbine.support.replace(**deep)
    layers = [
        Clay(top=0.0, strength=4e4, weight=8e3).content(),
        Sand(top=10.0, friction_angle=0.6, weight=1e4).content(),
    ]
    small, large = (
        soil_springs(support, Soil(layers=layers, shear=s, moment=m)).stiffness for s, m in ((0.0, 0.0), (4e6, 1.2e8))
    )
    assert np.all(large <= small * (1.0 + 1e-9)) and large[-1] < 0.7 * small[-1]


def test_section_loads_are_in_balance_with_the_ground(turbine: Turbine) -> None:
    """In a sea, a free pile: the reaction at the mudline is what the springs of a foundation feel there."""
    stiffness = np.diag([2e9, 2e9, 4e9, 2e12, 2e12, 6e11])
    stiffness[0, 4] = stiffness[4, 0] = -2e10
    stiffness[1, 3] = stiffness[3, 1] = 2e10
    sprung = turbine.replace(foundation={"stiffness": stiffness})
    options = ModelOptions(**SMALL, locked=("blades", "yaw", "generator", "drivetrain"), fore_aft_modes=4)
    model = build(sprung, options).with_parameters(**{"aerodynamics.air_density": 0.0})
    names = tuple(f"q {name}" for name in model.coordinates if name.startswith("tower"))
    run = simulate(model, 0.1, duration=10.0, sea=RegularSea(height=H, period=6.0), start=Start(coordinates={}),
                   channels=(*names, *LOADS), controller=meltemi.control.ConstantController())  # fmt: skip
    foot = np.einsum("kt,ki->ti", np.array([run[name] for name in names]), model.rotor.tower.modes.shape[:, 0])
    ground = -foot @ stiffness
    late = run.time > 2.0
    for i, name in ((0, "mudline_reaction_force_x"), (4, "mudline_reaction_moment_y")):
        # four modes leave out a little of the foot's motion, nothing of the loads
        assert np.std((run[name] - ground[:, i])[late]) < 0.12 * np.std(run[name][late])
    np.testing.assert_allclose(run["pile_station_1_force_x"], -run["mudline_reaction_force_x"], rtol=1e-12)


def test_an_irregular_sea_of_a_run_is_that_of_its_components(turbine: Turbine) -> None:
    """The elevation channel, interpolated in time, against the sum of the waves."""
    sea = IrregularSea(height=3.0, period=9.0, crest=Crest(height=4.0, time=6.0))
    t, found = loads(turbine, sea, 8.0)
    waves = sea.components(DEPTH, 0.0)
    exact = (np.exp(1j * np.outer(t, waves.frequency)) @ waves.amplitude).real
    assert np.abs(found["wave_elevation"] - exact).max() < 1e-3
    assert np.interp(6.0, t, found["wave_elevation"]) == pytest.approx(4.0, abs=1e-3)


def test_what_does_not_fit_is_told(turbine: Turbine) -> None:
    land = build(load_turbine("nrel5mw"), RIGID)
    with pytest.raises(InputError, match="sea: nrel5mw stands on land; give it a support"):
        simulate(land, 8.0, duration=1.0, sea=RegularSea(height=1.0, period=8.0))
    for change, words in (
        ({"support.depth": 25.0}, "position must begin at the sea bed, at -25 m"),
        ({"support.position": [-20.0, -10.0, 0.0, 9.0]}, "support.position ends at 9 m, but tower.base_height is 10 m"),
        ({"support.thickness": [3.1, 0.06, 0.06, 0.06]}, "thickness at station 1 is more than half the diameter"),
        ({"support.stations": [-40.0]}, "stations: -40 m is not on the pile, from -20 to 10 m"),
    ):
        with pytest.raises(InputError, match=words):
            turbine.replace(**change)
    with pytest.raises(InputError, match=r"sea.level: -19.5 m leaves 0.5 m of water"):
        simulate(build(turbine, RIGID), 8.0, duration=1.0, sea=StillWater(level=-19.5))


def test_still_water_is_what_a_run_without_sea_has(turbine: Turbine) -> None:
    model = build(turbine, RIGID)
    case = Case(model, SteadyWind(speed=8.0))
    case.evaluate(0.0)
    assert not case.view("pile_load")["force"].any()
    assert case.view("pile_load")["added"].sum() == pytest.approx(RHO * np.pi * 9.0 * DEPTH, rel=1e-9)


@pytest.mark.slow
@pytest.mark.long
def test_derivatives_pass_through_the_water(turbine: Turbine) -> None:
    """The mean mudline moment in a sea and current by the density of the water: dual numbers against differences."""
    model = build(turbine, ModelOptions(**SMALL))
    sea = RegularSea(height=2.0, period=6.0, current=Current(uniform=1.0))
    name = "mudline_reaction_moment_y"

    def run(density: float) -> meltemi.Run:
        changed = model.with_parameters(**{"water.density": density})
        return meltemi.Run(changed, 9.0, duration=2.0, sea=sea, channels=(name,), start=Start(rotor_speed=1.0))

    found = meltemi.analysis.sensitivity(run(RHO), ["water.density"])
    series = []
    for density in (RHO + 1.0, RHO - 1.0):
        simulation = meltemi.Simulation(run(density))
        simulation.advance(simulation.n_steps)
        series.append(simulation.result()[name])
    above, below = series
    slope = found.slopes[:, 0, 0]
    np.testing.assert_allclose(slope, 0.5 * (above - below), rtol=1e-4, atol=1e-4 * abs(slope).max())
