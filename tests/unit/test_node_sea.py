"""Kernels at sea, in plain Python: water and soil on a pile, mass dampers in towers and in blades."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from plain import plain, record, table
from scipy.spatial.transform import Rotation

from meltemi.compiler import Rot, Vec, View
from meltemi.sea import blade_dampers, mass_dampers, pile
from meltemi.sea.blade_dampers import BladeDamperSystem, Rider, RiderLoad, Slide, Swing
from meltemi.sea.mass_dampers import DamperControl, DamperSystem, Mover, MoverState
from meltemi.sea.pile import PileLoad, PileNode, PileStationLoad, PileSystem, PileWater, SeaState
from meltemi.simulation.step import (
    begin_parts,
    begin_parts_step,
    end_parts_step,
    outer_blade_loads,
    outer_section_loads,
    part_rates,
)
from meltemi.simulation.system import Outputs
from meltemi.structure.tables import (
    ApexColumns,
    BladeBody,
    BladePartial,
    MachineLoad,
    StructureParameters,
    TowerStationLoad,
)
from meltemi.turbine.exchange import BladeFrame, BladeMotion, Machine, TowerShape

Float = NDArray[np.float64]
G = 9.81
STRUCTURE = StructureParameters.of(gravity=G, tower_base=10.0, tower_length=80.0)


def near(found: Any, expected: Any, tolerance: float = 1e-12) -> None:
    np.testing.assert_allclose([*found], [*expected], rtol=tolerance, atol=tolerance)


# pile ---------------------------------------------------------------------------------------------------

Q, V, A = np.array([0.5, 0.2]), np.array([0.7, -0.3]), np.array([1.1, 0.4])
"""Surge and sway of the pile in the tests."""


def pile_in_water(**water: Any) -> PileSystem:
    """A pile of two pieces from 20 m to 4 m below still water and from there to 6 m above, that moves as a whole along
    x and y; and the water, with a field of linear waves at two heights."""
    move = np.zeros((2, 3, 2))
    move[0, 0], move[1, 1] = 1.0, 1.0
    shape = table(TowerShape, {"mode": 2, "node": 2}, displacement=move)
    shape.rotation[1, 1] = Vec(0.01, 0.02, 0.03)  # the second piece turns with sway
    nodes = table(
        PileNode, {"node": 2}, height=[-12.0, 1.0], low=[-20.0, -4.0], high=[-4.0, 6.0], mass=[900.0, 500.0],
        lateral=[1000.0, 600.0], inertia=np.full((3, 2), 50.0), soil=[7e3, 0.0], soil_damping=[3e3, 0.0],
        drag=[2.0, 3.0], inertial=[5.0, 6.0], added=[4.0, 3.5],
    )  # fmt: skip
    load = table(PileLoad, {"node": 2})
    water = {"density": 1000.0, "depth": 20.0, "step": 0.5, "period": 1e30} | water
    return record(
        PileSystem, q=Q, v=V, a=A, structure=STRUCTURE, water=PileWater.of(**water), sea=SeaState.of(),
        sea_levels=np.array([-20.0, 0.0]), sea_field=np.zeros((8, 13)), sea_now=np.zeros(13),
        sea_current=np.zeros((2, 2)),
        pile_nodes=nodes, pile_shape=shape, pile_shape_rows=shape, pile_load=load, pile_load_rows=load,
        core_force=np.zeros(2), core_mass=np.zeros((2, 2)),
    )  # fmt: skip


def test_soil_and_inertia_oppose_displacement_velocity_and_acceleration() -> None:
    m = pile_in_water()
    m.pile_load.force[0], m.pile_load.added[0] = Vec(100.0, 200.0, 0.0), 250.0
    u, F, M = plain(pile.piece_load)(0, m)
    near(u, (0.5, 0.2, 0.0))
    near(F, (100.0 - 1250.0 * 1.1 - 7e3 * 0.5 - 3e3 * 0.7, 200.0 - 1250.0 * 0.4 - 7e3 * 0.2 + 3e3 * 0.3, -900.0 * G))
    near(M, (0.0, 0.0, 0.0))


def test_water_drags_a_pile_by_the_velocity_relative_to_it() -> None:
    """Morison's equation with current, waves and the motion of the pile (H-24, H-25)."""
    m = pile_in_water()
    m.sea_current[:] = [[1.5, 1.0], [0.4, 0.1]]
    m.sea_field[:, 0] = 0.3
    m.sea_field[:, 1:5], m.sea_field[:, 5:9] = (0.1, 0.2, 0.5, -0.6), (0.5, 0.6, 0.9, -0.2)
    plain(pile.pile_forces)(0.7, m)
    assert m.sea.elevation == pytest.approx(0.3)
    total, added = np.zeros(2), 0.0
    for n, (share, wet, D, C, own) in enumerate([(0.4, 16.0, 2.0, 5.0, 4.0), (0.9, 4.0, 3.0, 6.0, 3.5)]):
        wave = np.array([0.1, 0.2, 0.5, -0.6]) + 0.4 * share
        U = m.sea_current[:, n] + wave[:2] - V
        F = wet * 1000.0 * (D * np.hypot(*U) * U + C * wave[2:])
        near(m.pile_load.force[n], (*F, 0.0))
        assert m.pile_load.added[n] == pytest.approx(1000.0 * own * wet)
        total, added = total + F, added + 1000.0 * own * wet
    near(m.core_force, total)
    near(np.ravel(np.tril(m.core_mass)), (added, 0.0, 0.0, added))


@pytest.mark.parametrize(("kind", "wet"), [(pile.NONE, 4.0), (pile.VERTICAL, 6.0), (pile.EXTRAPOLATION, 6.0)])
def test_water_rises_above_the_pile_as_its_stretching_says(kind: int, wet: float) -> None:
    """With a level of 1 m and an elevation of 1 m the second piece is wet up to -4 m, 1 m or 2 m."""
    m = pile_in_water(stretching=kind, level=1.0)
    m.sea_field[:, 0], m.sea_field[:, 9:13] = 1.0, (0.1, 0.2, 0.3, 0.4)
    m.pile_nodes.low[1], m.v = 0.0, np.zeros(2)
    plain(pile.pile_forces)(0.7, m)
    wet -= 4.0 - (kind == pile.NONE)
    assert m.pile_load.added[1] == pytest.approx(3500.0 * wet)
    z = 0.5 * wet - 1.0
    over = z if kind == pile.EXTRAPOLATION and z > 0.0 else 0.0
    size = 1000.0 * 3.0 * np.hypot(0.1, 0.2) * over
    near(m.pile_load.force[1], (wet * (size * 0.1 + 1800.0) * over, wet * (size * 0.2 + 2400.0) * over, 0.0))


@pytest.mark.parametrize("elevation", [0.6, 1.6, 4.0])
def test_above_still_water_the_kinematics_go_on_with_their_slope(elevation: float) -> None:
    """Of a piece from still water to the crest, without drag."""
    m = pile_in_water(stretching=pile.EXTRAPOLATION)
    m.sea_field[:, 0], m.sea_field[:, 5:9], m.sea_field[:, 9:13] = (
        elevation,
        (0.5, 0.6, 0.9, -0.2),
        (0.1, 0.2, 0.3, 0.4),
    )
    m.pile_nodes.low[1], m.pile_nodes.drag[1] = 0.0, 0.0
    plain(pile.pile_forces)(0.7, m)
    z = 0.5 * elevation
    near(m.pile_load.force[1], (6e3 * elevation * (0.9 + 0.3 * z), 6e3 * elevation * (-0.2 + 0.4 * z), 0.0))


def test_wheeler_takes_the_kinematics_at_the_crest_from_still_water() -> None:
    stretched = plain(pile.stretched)
    assert stretched(pile.WHEELER, 3.0, 3.0, 20.0) == pytest.approx(0.0)
    assert stretched(pile.WHEELER, -20.0, 3.0, 20.0) == pytest.approx(-20.0)
    assert stretched(pile.WHEELER, -8.5, 3.0, 20.0) == pytest.approx(-10.0)
    assert stretched(pile.VERTICAL, 2.0, 3.0, 20.0) == 0.0
    assert stretched(pile.VERTICAL, -2.0, 3.0, 20.0) == -2.0


def test_samples_are_joined_by_cubics_and_repeat() -> None:
    """The first sample is one step before time 0; a cubic is exact (H-22)."""

    def f(t: float) -> float:
        return 1.0 + 2.0 * t - 0.3 * t**2 + 0.1 * t**3

    samples = np.array([[f(0.5 * (i - 1))] for i in range(12)])
    for t in (0.0, 0.2, 1.0, 1.7, 3.9):
        assert plain(pile.at)(plain(pile.cubic)(t, 0.5, 1e30), samples, 0) == pytest.approx(f(t))
        assert plain(pile.at)(plain(pile.cubic)(t + 8.0, 0.5, 4.0), samples, 0) == pytest.approx(f(t))


def test_section_loads_of_a_pile_are_the_loads_above_the_cut() -> None:
    """Force and moment at the mudline, and half-way up the lower piece, of which half counts (H-36)."""
    m = pile_in_water()
    m.pile_nodes.inertia[1] = Vec(50.0, 60.0, 70.0)
    m.pile_load.force[0], m.pile_load.force[1] = Vec(100.0, 0.0, 0.0), Vec(0.0, 300.0, 0.0)
    m.pile_load.added[0], m.pile_load.added[1] = 150.0, 250.0
    m.pile_stations = np.array([-20.0, -12.0])
    m.pile_station = table(PileStationLoad, {"station": 2})
    move = np.zeros((2, 3, 2))
    move[0, 0], move[1, 1] = (0.0, 0.5), (0.1, 1.0)
    m.pile_station_shape = table(TowerShape, {"mode": 2, "node": 2}, displacement=move)
    top = np.zeros((2, 3, 1))
    top[0, 0], top[1, 1] = 1.5, 2.0
    m.tower_shape = table(TowerShape, {"mode": 2, "node": 1}, displacement=top, rotation=0.02 * top[:, [1, 0, 2]])
    station = table(TowerStationLoad, {"station": 1})
    station.force[0], station.moment[0] = Vec(1e4, 2e4, -3e4), Vec(4e5, 5e5, 6e5)
    s = record(Outputs, tower_station=station, chain=MachineLoad.of())
    s.chain.top_deflection = Vec(0.0, 0.0, 0.0)
    F0, M0 = np.array([1e4, 2e4, -3e4]), np.array([4e5, 5e5, 6e5])
    plain(outer_section_loads)(m, s)
    base, turned = np.array([0.75, 0.4, 10.0]), np.array([0.02 * 0.4, 0.02 * 0.75, 0.0])
    pieces = [[np.array([*x]) for x in plain(pile.piece_load)(n, m)] for n in range(2)]
    near(pieces[1][2], (-50.0 * 0.01 * 0.4, -60.0 * 0.02 * 0.4, -70.0 * 0.03 * 0.4))
    for i, (place, low, share) in enumerate([((0.0, 0.02, -20.0), -20.0, 1.0), ((0.25, 0.2, -12.0), -12.0, 0.5)]):
        force, moment = F0.copy(), M0 + np.cross(base - place, F0)
        for (u, F, M), part, middle in zip(pieces, (share, 1.0), (0.5 * (low - 4.0), 1.0), strict=True):
            force += part * F
            moment += part * (M + np.cross([u[0], u[1], middle] - np.array(place), F))
        near(m.pile_station.force[i], force)
        near(m.pile_station.moment[i], moment)
    near(m.sea.reaction, -np.array([*m.pile_station.force[0]]))
    near(m.sea.reaction_moment, -np.array([*m.pile_station.moment[0]]))
    R = Rotation.from_rotvec(turned).as_matrix()
    near(station.force[0], R.T @ F0, 1e-9)
    near(station.moment[0], R.T @ M0, 1e-9)
    near(s.chain.top_deflection, -np.array([0.75, 0.4, 0.0]) - np.cross(turned, [0.0, 0.0, 80.0]))
    # water on all of the pile: with added mass and the water inside, not the steel
    water = [np.array([100.0 - 250.0 * 1.1, -250.0 * 0.4, 0.0]), np.array([-350.0 * 1.1, 300.0 - 350.0 * 0.4, 0.0])]
    near(m.sea.force, water[0] + water[1])
    near(m.sea.moment, np.cross([0.0, 0.0, -12.0], water[0]) + np.cross([0.0, 0.0, 1.0], water[1]))


# mass dampers in tower and nacelle ----------------------------------------------------------------------


def damper(**values: Any) -> DamperSystem:
    """A mass on the top of a tower with one mode along x and one along y, axis (c, s) between them."""
    constants = {
        "mass": 200.0, "across": 150.0, "weight": 120.0, "x": 0.6, "y": 0.8, "stiffness": 800.0, "damping": 40.0,
        "low": -0.4, "high": 0.3, "stop_stiffness": 5e3, "stop_damping": 60.0, "height": 85.0,
    }  # fmt: skip
    shape = table(TowerShape, {"mode": 2, "node": 1})
    shape.displacement[0, 0], shape.rotation[0, 0] = Vec(1.2, 0.1, 0.05), Vec(0.0, 0.03, 0.0)
    shape.displacement[1, 0], shape.rotation[1, 0] = Vec(0.0, 1.0, 0.0), Vec(-0.02, 0.0, 0.0)
    numbers = {name: [value] for name, value in (constants | values).items()}
    return record(
        DamperSystem, q=Q, v=V, a=A, structure=STRUCTURE, mover=table(Mover, {"node": 1}, **numbers),
        mover_shape=shape, mover_state=table(MoverState, {"node": 1}, position=[0.2], velocity=[0.5]),
        d_mover_state=table(MoverState, {"node": 1}), core_force=np.zeros(2), core_mass=np.zeros((2, 2)),
    )  # fmt: skip


def test_stops_push_back_and_damp_motion_into_them_only() -> None:
    p, pull = damper().mover, plain(mass_dampers.pull)
    assert pull(0.2, 0.5, 0, p) == pytest.approx(800.0 * 0.2 + 40.0 * 0.5)
    assert pull(0.5, 0.5, 0, p) == pytest.approx(800.0 * 0.5 + 100.0 * 0.5 + 5e3 * 0.2)
    assert pull(0.5, -0.5, 0, p) == pytest.approx(800.0 * 0.5 - 40.0 * 0.5 + 5e3 * 0.2)
    assert pull(-0.5, -0.5, 0, p) == pytest.approx(-800.0 * 0.5 - 100.0 * 0.5 - 5e3 * 0.1)
    assert pull(-0.5, 0.5, 0, p) == pytest.approx(-800.0 * 0.5 + 40.0 * 0.5 - 5e3 * 0.1)


def test_a_leaning_tower_lets_the_mass_slide_down() -> None:
    """A rotation about y leans towards x, one about -x towards y; the tower's acceleration leaves the mass behind."""
    m = damper()
    lean = G * (0.03 * 0.5 * 0.6 + 0.02 * 0.2 * 0.8)
    assert plain(mass_dampers.lean)(0, m) == pytest.approx(lean)
    along = 1.2 * 1.1 * 0.6 + (0.1 * 1.1 + 0.4) * 0.8
    assert plain(mass_dampers.drive)(0, m) == pytest.approx(lean - along)
    m.mover_state.force[0] = 90.0
    plain(part_rates)(m)
    assert m.d_mover_state.velocity[0] == pytest.approx(lean - along - 90.0 / 200.0)
    assert m.d_mover_state.position[0] == 0.5
    plain(begin_parts)(0.0, record(DamperControl), m)
    assert m.mover_state.position[0] == pytest.approx(200.0 / 800.0 * lean)
    assert m.mover_state.velocity[0] == 0.0


def test_a_tower_carries_what_does_not_move_along_the_axis() -> None:
    m = damper()
    plain(mass_dampers.damper_forces)(0.0, m)
    force, lever = 800.0 * 0.2 + 40.0 * 0.5, 200.0 * G * 0.2
    assert m.mover_state.force[0] == pytest.approx(force)
    first = force * (1.2 * 0.6 + 0.1 * 0.8) + lever * 0.03 * 0.6 - 120.0 * G * 0.05
    near(m.core_force, (first, force * 0.8 + lever * 0.02 * 0.8))
    aside = (0.1 * 0.6 - 1.2 * 0.8, 0.6)
    expected = [150.0 * aside[0] ** 2 + 120.0 * 0.05**2, 0.0, 150.0 * aside[0] * aside[1], 150.0 * aside[1] ** 2]
    near(np.ravel(m.core_mass), expected)


def test_section_loads_below_a_mass() -> None:
    """Force of spring, of what is carried, weight with its displacement; the same at the yaw bearing (H-48)."""
    m = damper()
    m.mover_state.force[0] = 90.0
    m.machine = Machine.of()
    m.machine.top, m.machine.top_position = Rot(0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0), Vec(0.4, 0.1, 90.0)
    s = record(Outputs, tower_stations=np.array([20.0, 88.0]), chain=MachineLoad.of())
    s.tower_station = table(TowerStationLoad, {"station": 2})
    plain(outer_section_loads)(m, s)
    u, a = np.array([0.6, 0.25, 0.025]), np.array([1.32, 0.51, 0.055])
    aside = 150.0 * (a @ [-0.8, 0.6, 0.0])
    F = np.array([90.0 * 0.6 + 0.8 * aside, 90.0 * 0.8 - 0.6 * aside, -120.0 * (G + a[2])])
    M = 200.0 * G * 0.2 * np.array([-0.8, 0.6, 0.0])
    share = (20.0 / 85.0) ** 2
    arm = u + np.array([0.0, 0.0, 65.0]) - share * np.array([u[0], u[1], 0.0])
    near(s.tower_station.force[0], F)
    near(s.tower_station.moment[0], M + np.cross(arm, F), 1e-11)
    assert not np.any(s.tower_station.array[:, 1])
    R = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    near(s.chain.yaw_force, R.T @ F)
    near(s.chain.yaw_moment, R.T @ (M + np.cross(u - np.array([0.4, 0.1, -5.0]), F)))


def test_a_mass_in_the_nacelle_moves_with_the_top_and_its_rotation() -> None:
    """3 m above the tower top; one below it moves as the tower there, and a mass along two axes is carried upwards by
    half for each."""
    shape = np.array([[1.0, 0.2, 0.0, -0.01, 0.03, 0.0]])
    asked = []

    def at(z: Float) -> Float:
        asked.append(float(z[0]))
        return shape[:, None] * z[0] / 80.0

    common = {"mass": 900.0, "stiffness": 4e3}
    turbine = SimpleNamespace(
        name="it", tower=SimpleNamespace(length=80.0, base_height=12.0),
        support=SimpleNamespace(position=np.array([-40.0, 10.0])),
        mass_dampers=(
            mass_dampers.MassDamper(height=83.0, axes="xy", stops=(-1.0, 2.0), stop_stiffness=1e5, **common),
            mass_dampers.MassDamper(height=40.0, axes="y", **common),
        ),
    )  # fmt: skip
    rotor = SimpleNamespace(tower=SimpleNamespace(names=("one",), modes=SimpleNamespace(at=at)))
    part = mass_dampers.part_of(turbine, SimpleNamespace(time_step=0.01), rotor)
    assert asked == [132.0, 132.0, 92.0]  # from the foot of the pile
    top = shape[0] * 132.0 / 80.0
    near(part.mover_shape[:, 0], [top[0] + 3.0 * top[4], top[1] - 3.0 * top[3], *top[2:]])
    near(part.mover_shape[:, 2], shape[0] * 92.0 / 80.0)
    p = View(Mover, part.mover)
    near(p["across"], (0.0, 0.0, 900.0))
    near(p["weight"], (450.0, 450.0, 900.0))
    near(p["x"], (1.0, 0.0, 0.0))
    near(p["y"], (0.0, 1.0, 1.0))
    near(p["low"], (-1.0, -1.0, -mass_dampers.FAR))
    near(p["height"], (83.0, 83.0, 40.0))


def test_a_mass_swings_on_its_spring_with_second_order() -> None:
    """x'' = -k x / m - c x' / m from rest of the tower, against the closed form; the error falls by 4."""
    w, d = np.sqrt(800.0 / 200.0 - 0.1**2), 0.1
    errors = []
    for steps in (40, 80):
        m, s, dt = damper(low=-9.0, high=9.0), None, 2.0 / steps
        m.q, m.a, s = np.zeros(2), np.zeros(2), m.mover_state
        for _ in range(steps):
            plain(mass_dampers.damper_forces)(0.0, m)
            plain(begin_parts_step)(dt, m)
            plain(mass_dampers.damper_forces)(0.0, m)
            plain(end_parts_step)(dt, m)
        x = np.exp(-d * 2.0) * (0.2 * np.cos(2.0 * w) + (0.5 + d * 0.2) / w * np.sin(2.0 * w))
        errors.append(abs(s.position[0] - x))
    assert errors[0] < 5e-3
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.1)


# mass dampers in blades ---------------------------------------------------------------------------------


def rider(axes: str = "xy", **changes: Any) -> BladeDamperSystem:
    """A mass on the only node of a turning blade, which two coordinates below and one mode of the blade move."""
    first = {"mass": [300.0], "stiffness": [2700.0], "low": [-9.0], "high": [9.0], "span": [40.0]}
    constants = table(Rider, {"damper": 1}, **first, x=[float("x" in axes)], y=[float("y" in axes)])
    constants.frame[0] = Rot(0.8, -0.6, 0.0, 0.6, 0.8, 0.0, 0.0, 0.0, 1.0)
    constants.arm[0] = Vec(0.2, 0.3, 1.0)
    motion = table(BladeMotion, {"blade": 1, "node": 1})
    motion.orientation[0, 0], motion.position[0, 0] = Rot(1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 1.0, 0.0), Vec(1, 2, 40)
    frame = table(BladeFrame, {"blade": 1})
    frame.orientation[0] = Rot(0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0)
    columns = table(ApexColumns, {"coordinate": 2})
    columns.linear[0], columns.angular[0] = Vec(0.5, 1.0, 0.3), Vec(0.01, -0.02, 0.03)
    columns.linear[1], columns.angular[1] = Vec(0.0, 0.4, -0.3), Vec(0.2, 0.0, 0.1)
    partial = table(BladePartial, {"mode": 1, "blade": 1, "node": 1})
    partial.velocity[0, 0, 0], partial.rotation[0, 0, 0] = Vec(1.0, 0.2, -0.1), Vec(0.02, -0.03, 0.01)
    slide = table(Slide, {"slider": len(axes)}, position=[0.4, -0.7][: len(axes)], velocity=[1.5, -2.0][: len(axes)])
    m = record(
        BladeDamperSystem, rider=constants, rider_load=table(RiderLoad, {"damper": 1}, free=[1.0]), slide=slide,
        d_slide=table(Slide, {"slider": len(axes)}), swing=table(Swing, {"coordinate": 3}), motion_alone=motion,
        frame=frame, columns=columns, partial_alone=partial, structure=StructureParameters.of(), a=np.zeros(3),
        core_force=np.zeros(2), core_mass=np.zeros((2, 2)), arm_force=np.zeros((1, 1)), arm_mass=np.zeros((1, 1, 1)),
        coupling=np.zeros((1, 1, 2)),
    )  # fmt: skip
    for name, value in changes.items():
        getattr(constants, name)[0] = value
    return m


def axes_of(m: BladeDamperSystem) -> Float:
    """(3, 3) axes of the mass as columns, blade axes."""
    return np.array([*plain(blade_dampers.place)(0, m)[1]]).reshape(3, 3)


def test_a_mass_without_springs_flies_straight_on() -> None:
    """Seen from a blade that turns about its node, a point in uniform motion has the acceleration - known (H-50)."""
    m = rider()
    w = np.array([0.3, -0.5, 0.7])
    m.motion_alone.spin[0, 0] = Vec(*w)
    arm, E = np.array([*plain(blade_dampers.place)(0, m)[0]]), axes_of(m)
    near(arm, E @ [0.4, -0.7, 0.0] + [0.2, -1.0, 0.3])
    rate = E @ [1.5, -2.0, 0.0]
    velocity = rate + np.cross(w, arm)

    def seen(t: float) -> Float:
        place: Float = Rotation.from_rotvec(-w * t).apply(arm + velocity * t)
        return place

    h = 1e-3
    expected = (seen(h) - 2.0 * seen(0.0) + seen(-h)) / h**2
    known = E @ [*plain(blade_dampers.known)(0, Vec(*arm), Rot(*E.ravel()), m)]
    near(known, -expected, 1e-6)


def test_a_blade_that_speeds_up_leaves_the_mass_behind_and_gravity_pulls_it_down() -> None:
    m = rider()
    arm, E = np.array([*plain(blade_dampers.place)(0, m)[0]]), axes_of(m)
    m.motion_alone.spin_rate[0, 0], m.motion_alone.acceleration[0, 0] = Vec(0.1, 0.2, -0.4), Vec(3.0, -2.0, 1.0)
    m.structure.gravity = G
    # the blade's y axis points up
    expected = E.T @ (np.array([3.0, -2.0 + G, 1.0]) + np.cross([0.1, 0.2, -0.4], arm))
    known = plain(blade_dampers.known)(0, Vec(*arm), Rot(*E.ravel()), m)
    near(known, expected)
    m.slide.force[0], m.slide.force[1] = 600.0, -900.0
    near(plain(blade_dampers.slide_rates)(0, m), (-expected[0] - 2.0, -expected[1] + 3.0))
    plain(part_rates)(m)
    near(m.d_slide.array[Slide.index("velocity")], (-expected[0] - 2.0, -expected[1] + 3.0))
    near(m.d_slide.array[Slide.index("position")], (1.5, -2.0))


def test_partial_velocities_are_those_of_the_place_of_the_mass() -> None:
    """Acceleration of the mass by second derivatives of coordinates (H-51)."""
    m = rider()
    m.a[:] = 0.5, -2.0, 3.0
    arm, E = np.array([*plain(blade_dampers.place)(0, m)[0]]), axes_of(m)
    R = np.array([*m.frame.orientation[0]]).reshape(3, 3)
    r = R @ (np.array([1.0, 2.0, 40.0]) + arm)
    u = [np.array([*m.columns.linear[j]]) + np.cross([*m.columns.angular[j]], r) for j in range(2)]
    own = np.array([1.0, 0.2, -0.1]) + np.cross([0.02, -0.03, 0.01], arm)
    near(plain(blade_dampers.acceleration)(0, m), E.T @ (R.T @ (0.5 * u[0] - 2.0 * u[1]) + 3.0 * own), 1e-11)


@pytest.mark.parametrize(("axes", "free"), [("xy", 1.0), ("x", 1.0), ("y", 1.0), ("xy", 0.0)])
def test_the_work_of_a_mass_on_the_coordinates_is_that_of_its_force(axes: str, free: float) -> None:
    """Generalised forces are its power at unit rates, masses the energy of what is carried (H-53, H-54)."""
    m = rider(axes)
    m.motion_alone.spin[0, 0], m.structure.gravity, m.rider_load.free[0] = Vec(0.9, 0.1, -0.2), G, free
    plain(blade_dampers.blade_damper_forces)(0.0, m)
    (arm, E), p = plain(blade_dampers.place)(0, m), m.rider
    a = np.array([*plain(blade_dampers.known)(0, arm, E, m)])
    free_along = free * np.array([p.x[0], p.y[0], 0.0])
    springs = np.zeros(3)
    for k, axis in enumerate(axes):
        springs[0 if axis == "x" else 1] = p.stiffness[0] * m.slide.position[k]
        assert m.slide.force[k] == pytest.approx(p.stiffness[0] * m.slide.position[k])
    F = free_along * springs - 300.0 * (1.0 - free_along) * a
    u = m.swing.array.T[:3]
    near([*m.core_force, m.arm_force[0, 0]], u @ F, 1e-9)
    M = u @ np.diag(300.0 * (1.0 - free_along)) @ u.T
    near(m.core_mass[np.tril_indices(2)], M[:2, :2][np.tril_indices(2)], 1e-9)
    near([*m.coupling[0, 0], m.arm_mass[0, 0, 0]], M[2], 1e-9)
    m.a[:] = 0.5, -2.0, 3.0
    m.body = table(BladeBody, {"blade": 1})
    plain(outer_blade_loads)(m)
    plain(outer_blade_loads)(m)  # once only
    force = E @ Vec(*(F - 300.0 * (1.0 - free_along) * (u.T @ m.a)))
    near(m.body.force[0], force, 1e-9)
    near(m.body.torque[0], np.cross([*m.rider_load.place[0]], [*force]), 1e-9)
    near(m.rider_load.place[0], np.array([1.0, 2.0, 40.0]) + np.array([*arm]), 1e-9)


@pytest.mark.parametrize("axis", ["x", "y"])
def test_a_mass_rests_where_its_spring_balances_the_rotation(axis: str) -> None:
    """k x = m W^2 (r + x) across the axis of rotation, r: distance of the arm; along it only the weight counts."""
    m = rider(axis, arm=Vec(0.3, 0.5, 0.0), frame=Rot(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0))
    m.motion_alone.orientation[0, 0] = Rot(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)
    for spin, across in (
        (Vec(0.0, 0.0, 2.0), True),
        (Vec(2.0, 0.0, 0.0), axis == "y"),
        (Vec(0.0, 2.0, 0.0), axis == "x"),
    ):
        m.motion_alone.spin[0, 0], m.slide.velocity[0] = spin, 0.0
        plain(blade_dampers.settle)(0, m)
        r = 0.3 if axis == "x" else 0.5
        assert m.slide.position[0] == pytest.approx(4.0 * r / (9.0 - 4.0) if across else 0.0, abs=1e-12)
    m.motion_alone.spin[0, 0], m.rider.stiffness[0] = Vec(0.0, 0.0, 2.0), 300.0
    plain(blade_dampers.settle)(0, m)
    assert m.slide.position[0] == 9.0  # rotation overcomes the spring


def test_a_mass_in_a_blade_swings_on_its_spring_with_second_order() -> None:
    errors = []
    for steps in (40, 80):
        m, dt = rider("y", damping=60.0), 2.0 / steps
        w, d = np.sqrt(9.0 - 0.1**2), 0.1
        for _ in range(steps):
            plain(blade_dampers.blade_damper_forces)(0.0, m)
            plain(begin_parts_step)(dt, m)
            plain(blade_dampers.blade_damper_forces)(0.0, m)
            plain(end_parts_step)(dt, m)
        x = np.exp(-2.0 * d) * (0.4 * np.cos(2.0 * w) + (1.5 + d * 0.4) / w * np.sin(2.0 * w))
        errors.append(abs(m.slide.position[0] - x))
    assert errors[0] < 0.015
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.1)


def test_masses_in_blades_have_the_axes_of_their_section() -> None:
    """On the nearest node, by the arm from it; turned by the twist, or by an angle of their own (H-49)."""
    span, twist = np.array([0.0, 20.0, 60.0]), np.array([0.2, 0.1, 0.0])
    common = {"mass": 300.0, "stiffness": 9e3}
    turbine = SimpleNamespace(
        name="it", n_blades=3, rated_rotor_speed=1.2,
        blade=SimpleNamespace(length=60.0, structure=SimpleNamespace(position=span, twist=twist)),
        mass_dampers=(
            mass_dampers.MassDamper(height=40.0, **common),
            mass_dampers.MassDamper(span=38.0, axes="xy", blades=(2,), **common),
            mass_dampers.MassDamper(span=50.0, axes="y", angle=-0.3, stops=(-1.0, 2.0), stop_stiffness=1e4, **common),
        ),
    )  # fmt: skip
    beam = SimpleNamespace(at=lambda x, name: np.stack([0.01 * x, 0.02 * x, x], axis=1))
    rotor = SimpleNamespace(
        n_core=7, blade=SimpleNamespace(beam=beam, names=("a", "b")),
        blade_layout=SimpleNamespace(position=np.array([10.0, 30.0, 48.0])),
    )  # fmt: skip
    part = blade_dampers.part_of(turbine, SimpleNamespace(time_step=0.01), rotor)
    assert part.sliders == ((2, "x", 2), (2, "y", 2), (3, "y", 1), (3, "y", 2), (3, "y", 3))
    assert (part.full, part.coordinates) == (frozenset({3}), 9)
    p = Rider(part.rider)
    near([p.blade[n] for n in range(4)], (1, 0, 1, 2))
    near([p.node[n] for n in range(4)], (1, 2, 2, 2))
    near([p.first[n] for n in range(4)], (0, 2, 3, 4))
    near([p.x[n] for n in range(2)] + [p.y[n] for n in range(2)], (1, 0, 1, 1))
    near([p.low[0], p.high[0], p.low[1], p.high[1]], (-mass_dampers.FAR, mass_dampers.FAR, -1.0, 2.0))
    near(p.arm[0], (0.08, 0.16, 8.0))
    near(p.arm[1], (0.02, 0.04, 2.0))
    for n, angle in ((0, 0.055), (1, -0.3)):
        # towards feather is about -z of the blade
        near(p.frame[n], Rotation.from_euler("z", -angle).as_matrix().ravel())
    rows = part.states()[0]
    assert rows.units == ("m",) * 5 + ("m/s",) * 5
    assert rows.names[2] == "blade 1 mass damper 3 y position"
    assert rows.names[5] == "mass damper 2 x velocity in blade 2"
