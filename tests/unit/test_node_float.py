"""Kernels of floating platforms and their lines, in plain Python."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from plain import plain, record, table
from scipy.spatial.transform import Rotation

import meltemi
from meltemi.compiler import Sym, Vec, View
from meltemi.floating import floater, lumped, mooring
from meltemi.floating.base import DragStrip, Floater, FloaterSystem, PlatformState, RadiationState
from meltemi.floating.floater import floater_forces
from meltemi.floating.lumped import LineState, LumpedSystem
from meltemi.floating.mooring import NONE, FreePoint, Line, LineEnd, LineLoad, LineOrder, PointState
from meltemi.floating.moving_base import (
    Base,
    BaseColumns,
    TowerBody,
    TowerMomentum,
    base_motion,
)
from meltemi.floating.potential import HydroCoefficients
from meltemi.floating.segments import LinePoint, LineSegment
from meltemi.floating.waves import HEADINGS, displaced_forces
from meltemi.sea.airy import wave_number
from meltemi.simulation.step import DIVERGED, OK, begin_parts_step, check_parts, outer_section_loads, part_rates
from meltemi.simulation.system import Outputs
from meltemi.structure.tables import (
    ApexColumns,
    ApexLoad,
    MachineLoad,
    StructureParameters,
    TopShape,
    TowerDrag,
    TowerNode,
    TowerPiece,
    TowerStationLoad,
)
from meltemi.structure.tower import WEIGHT, top_deflection, tower_equations, tower_loads, tower_top
from meltemi.turbine.exchange import Machine, TowerShape

Float = NDArray[np.float64]
G = 9.81
LAST = slice(1, 7)
"""Motions of the base, after one mode of the tower."""
ATTITUDE = np.array([0.0, 3.0, -2.0, 1.5, 0.2, -0.3, 0.5])
RATE = np.array([0.0, 0.4, 0.2, -0.1, 0.05, 0.15, -0.2])


def near(found: Any, expected: Any, tolerance: float = 1e-10) -> None:
    scale = max(float(np.abs([*expected]).max()), 1e-300)
    np.testing.assert_allclose([*found], [*expected], rtol=0.0, atol=tolerance * scale)


def matrix(A: Any) -> Float:
    return np.array([[A.xx, A.xy, A.xz], [A.xy, A.yy, A.yz], [A.xz, A.yz, A.zz]])


def floating(q: Float = ATTITUDE, v: Float = RATE, **changes: Any) -> Any:
    """A platform without water, lines and mass, below a tower whose base is 10 m above its point."""
    n = len(q)
    members = {
        "q": q.copy(), "v": v.copy(), "a": np.zeros(n), "top_shape": table(TopShape, {"mode": n}),
        "structure": StructureParameters.of(gravity=G, tower_base=10.0, tower_length=80.0),
        "floater": Floater.of(step=0.5, period=1e30, bed=-50.0), "platform": PlatformState.of(),
        "base": Base.of(), "base_columns": table(BaseColumns, {"coordinate": 6}), "tower_body": TowerBody.of(),
        "tower_momentum": table(TowerMomentum, {"mode": n - 6}),
        "hull_shape": np.zeros((0, 6)),
        "platform_columns": np.zeros((6, 6)), "base_six": np.zeros((7, 6)), "float_matrices": np.zeros((30, 6)),
        "float_waves": np.zeros((8, 7)), "float_flow": np.zeros((8, 0)), "float_lines": np.zeros((0, 3)),
        "float_forces": np.zeros((HEADINGS, 0, 12)), "radiation": table(RadiationState, {"mode": 0}),
        "d_radiation": table(RadiationState, {"mode": 0}), "strip": table(DragStrip, {"strip": 0}),
        "line_order": table(LineOrder, {"line": 0}), "line": table(Line, {"line": 0}),
        "line_end": table(LineEnd, {"line": 0}), "line_load": table(LineLoad, {"line": 0}),
        "point": table(FreePoint, {"point": 0}), "point_state": table(PointState, {"point": 0}),
        "tower_matrix": np.zeros((8, n, n)), "tower_weight": np.zeros(n), "tower_push": np.zeros(n),
        "core_force": np.zeros(n),         "core_mass": np.zeros((n, n)), "machine": Machine.of(),
    }  # fmt: skip
    return record(LumpedSystem if "line_point" in changes else FloaterSystem, **(members | changes))


def turned(q: Float) -> Float:
    """(3, 3) orientation of the base."""
    return np.asarray(Rotation.from_rotvec(q[4:7]).as_matrix())


# motion of the base -------------------------------------------------------------------------------------


def test_motion_of_the_point_is_that_of_a_rigid_body() -> None:
    """Velocity, partial velocities and known acceleration from differences of place and orientation (W-7)."""

    def moved(t: float) -> Any:
        m = floating(ATTITUDE + t * RATE)
        plain(base_motion)(m)
        return m.platform

    m, h = floating(), 1e-3
    plain(base_motion)(m)
    p, R = m.platform, turned(ATTITUDE)
    near(np.subtract([*p.displacement], [*m.base.position]), R @ [0.0, 0.0, -10.0])
    near(p.displacement, ATTITUDE[1:4] + R @ [0.0, 0.0, -10.0] + [0.0, 0.0, 10.0])
    near(p.angle, Rotation.from_matrix(R).as_euler("xyz"), 1e-7)
    before, after = (np.array([*moved(t).displacement]) for t in (-h, h))
    near(p.velocity, (after - before) / (2.0 * h), 1e-6)
    near(p.bias, (after - 2.0 * np.array([*p.displacement]) + before) / h**2, 1e-5)
    spins = [np.array([*moved(t).spin]) for t in (-h, h)]
    near(m.base.spin_rate, (spins[1] - spins[0]) / (2.0 * h), 1e-5)
    turn = Rotation.from_matrix(turned(ATTITUDE + h * RATE) @ turned(ATTITUDE - h * RATE).T).as_rotvec()
    near(p.spin, turn / (2.0 * h), 1e-5)
    near([*p.velocity, *p.spin], RATE[LAST] @ m.platform_columns)
    near(np.ravel(m.platform_columns[:3]), np.eye(3, 6).ravel())


def test_the_hull_of_a_flexible_platform_moves_with_the_modes() -> None:
    """Velocity, partial velocities and known acceleration of its mean, from differences of its place (F-73)."""
    place, rate = ATTITUDE + 0.4 * np.eye(7)[0], RATE + 0.3 * np.eye(7)[0]
    shape = np.array([[0.3, -0.2, 0.5, 1e-6, -2e-6, 3e-6]])

    def moved(t: float) -> Any:
        m = floating(place + t * rate, rate, hull_shape=shape, platform_columns=np.zeros((7, 6)))
        plain(base_motion)(m)
        return m

    m, h = moved(0.0), 1e-3
    p, R = m.platform, turned(place)
    near(p.displacement, place[1:4] + R @ ([0.0, 0.0, -10.0] + 0.4 * shape[0, :3]) + [0.0, 0.0, 10.0])
    before, after = (np.array([*moved(t).platform.displacement]) for t in (-h, h))
    near(p.velocity, (after - before) / (2.0 * h), 1e-6)
    near(p.bias, (after - 2.0 * np.array([*p.displacement]) + before) / h**2, 1e-5)
    near([*p.velocity, *p.spin], rate @ m.platform_columns)
    near(m.platform_columns[0], np.concatenate([R @ shape[0, :3], R @ shape[0, 3:]]))
    near(np.subtract([*p.spin], [*m.base.spin]), 0.3 * R @ shape[0, 3:], 1e-6)
    Q = np.reshape([*p.orientation], (3, 3))
    near(Rotation.from_matrix(R.T @ Q).as_rotvec(), 0.4 * shape[0, 3:], 1e-4)
    # a load on the hull works on the mode
    m.base_six[:], m.core_mass[:], m.core_force[:] = 0.0, 0.0, 0.0
    m.float_matrices[:6] = np.diag([2.0, 2.0, 3.0, 5.0, 5.0, 7.0])
    plain(floater_forces)(0.0, m)
    J = m.platform_columns
    np.testing.assert_allclose(np.tril(m.core_mass), np.tril(J @ m.float_matrices[:6] @ J.T), rtol=1e-12, atol=1e-12)


def test_motion_of_the_tower_top_is_that_of_bent_tower_and_base() -> None:
    """Velocity, partial velocities and known acceleration from differences of place and orientation (W-30)."""
    place, rate, h = ATTITUDE + 0.7 * np.eye(7)[0], RATE + 0.5 * np.eye(7)[0], 1e-3

    def top(q: Float, v: Float) -> Any:
        m = floating(q, v)
        m.top_shape.displacement[0], m.top_shape.rotation[0] = Vec(1.0, 0.3, 0.0), Vec(-0.01, 0.03, 0.0)
        m.top_second = np.zeros((3, 7, 7))
        m.top_second[:, 0, 0] = 0.002, 0.0, -0.04
        m.columns = table(ApexColumns, {"coordinate": 7})
        plain(tower_top)(m)
        return m

    def turned_top(q: Float) -> Any:
        return Rotation.from_matrix(np.reshape([*top(q, rate).machine.top], (3, 3)))

    m = top(place, rate)
    (x0, x1, x2), (w0, w2) = (
        [np.array([*getattr(top(place + t * rate, rate).machine, name)]) for t in times]
        for name, times in (("top_position", (-h, 0.0, h)), ("top_spin", (-h, h)))
    )
    R, machine = turned(place), m.machine
    bent = np.array([0.7, 0.21, 0.0]) + 0.5 * 0.7**2 * np.array([0.002, 0.0, -0.04])
    near(x1, place[1:4] + [0.0, 0.0, 10.0] + R @ (bent + np.array([0.0, 0.0, 80.0])))
    near(machine.top_velocity, (x2 - x0) / (2.0 * h), 1e-6)
    near(machine.top_acceleration, (x2 - 2.0 * x1 + x0) / h**2, 1e-4)
    near(
        machine.top_spin,
        (turned_top(place + h * rate) * turned_top(place - h * rate).inv()).as_rotvec() / (2.0 * h),
        1e-5,
    )
    near(machine.top_spin_rate, (w2 - w0) / (2.0 * h), 1e-5)
    for k, one in enumerate(np.eye(7)):
        ends = [np.array([*top(place + t * one, rate).machine.top_position]) for t in (-h, h)]
        near(m.columns.linear[k], (ends[1] - ends[0]) / (2.0 * h), 1e-5)
        turn = (turned_top(place + h * one) * turned_top(place - h * one).inv()).as_rotvec() / (2.0 * h)
        np.testing.assert_allclose([*m.columns.angular[k]], turn, atol=1e-6)


def test_a_body_that_nothing_holds_falls_and_keeps_its_momentum() -> None:
    """Platform and tower as one rigid body without water: its centre of mass falls with gravity, its angular momentum
    about it stays (W-7, W-31, W-32)."""
    m = floating()
    m.floater.mass, m.floater.centre, m.floater.inertia = 3e3, Vec(0.5, -0.3, -4.0), Vec(7e4, 8e4, 5e4)
    # a tower of three masses above its base, and one mode that is held
    masses, places = np.array([200.0, 150.0, 300.0]), np.array([[0, 0, 20.0], [0, 0, 50.0], [0, 0, 80.0]])
    T = np.concatenate([np.hstack([np.eye(3), np.cross(np.eye(3), r).T]) for r in places])
    mode = np.array([[0.1, 0.0, 0.0], [0.4, 0.0, 0.0], [1.0, 0.0, 0.0]]).reshape(-1, 1)
    columns, inertia = np.hstack([mode, T]), np.repeat(masses, 3)
    M = columns.T @ (inertia[:, None] * columns)
    m.tower_matrix[0, 0, 0], body, J = M[0, 0], m.tower_body, M[4:, 4:]
    body.mass, body.moment = masses.sum(), Vec(*(masses @ places))
    body.inertia = Sym(J[0, 0], J[1, 1], J[2, 2], J[0, 1], J[0, 2], J[1, 2])
    m.tower_momentum.linear[0], m.tower_momentum.angular[0] = Vec(*M[1:4, 0]), Vec(*M[4:, 0])
    m.tower_matrix[WEIGHT], m.tower_weight[:] = np.eye(7) * 3.0, 5.0
    plain(base_motion)(m)
    plain(tower_equations)(m)
    m.core_force[0] -= G * (5.0 - 3.0 * ATTITUDE[0])  # weight along the tower
    plain(floater_forces)(0.0, m)
    M = np.tril(m.core_mass) + np.tril(m.core_mass, -1).T
    a = np.zeros(7)
    a[LAST] = np.linalg.solve(M[1:, 1:], m.core_force[1:])
    places = np.vstack([places, [0.5, -0.3, -14.0]])
    masses = np.append(masses, 3e3)

    def momenta(t: float) -> tuple[Float, Float]:
        """Centre of mass, and angular momentum about it."""
        q, h = ATTITUDE + t * RATE + 0.5 * t * t * a, 1e-4
        ends = [ATTITUDE + s * RATE + 0.5 * s * s * a for s in (t - h, t + h)]
        w = Rotation.from_matrix(turned(ends[1]) @ turned(ends[0]).T).as_rotvec() / (2.0 * h)
        at = [places @ turned(x).T + x[1:4] for x in (ends[0], q, ends[1])]
        centre, R = masses @ at[1] / masses.sum(), turned(q)
        spin = np.cross(at[1] - centre, masses[:, None] * (at[2] - at[0]) / (2.0 * h)).sum(axis=0)
        return centre, spin + R @ np.diag([7e4, 8e4, 5e4]) @ R.T @ w

    step = 1e-2
    (c0, L0), (c1, _), (c2, L2) = (momenta(t) for t in (-step, 0.0, step))
    near((c0 - 2.0 * c1 + c2) / step**2, (0.0, 0.0, -G), 1e-4)
    assert np.abs(L2 - L0).max() < 2e-3 * step * np.abs(L0).max()
    # the mode that is held: its masses have the acceleration of the base, less gravity
    h = 1e-3
    seen = [places[:3] @ turned(ATTITUDE + t * RATE).T + t * RATE[1:4] for t in (-h, 0.0, h)]
    known = (seen[0] - 2.0 * seen[1] + seen[2]) / h**2 + [0.0, 0.0, G]
    own = (known @ turned(ATTITUDE)).ravel()
    assert m.core_force[0] == pytest.approx(-(mode[:, 0] * inertia) @ own - G * 5.0 + 5.0 * G, rel=1e-4)


def test_the_base_of_a_tower_carries_all_above_it_in_its_own_axes() -> None:
    """Newton's law for the masses of a tower on a base that moves and accelerates, with one mode in motion, from
    differences of their places (W-33)."""
    v, a, heights = RATE.copy(), np.array([0.7, 0.5, -0.4, 0.3, 0.1, -0.2, 0.15]), np.array([20.0, 60.0])
    v[0] = 0.6
    m = floating(ATTITUDE, v)
    m.a[:], m.structure.top_mass, masses = a, 50.0, np.array([300.0, 200.0])
    shape = table(TowerShape, {"mode": 7, "node": 3})
    for n, z in enumerate((*heights, 80.0)):
        shape.displacement[0, n] = Vec(0.5 * (n < 2), 0.25 * (n == 1), 0.0)
        for k in range(3):
            e = np.eye(3)[k]
            shape.displacement[1 + k, n] = Vec(*e)
            shape.displacement[4 + k, n], shape.rotation[4 + k, n] = Vec(*np.cross(e, [0.0, 0.0, z])), Vec(*e)
    m.tower_shape = shape
    nodes = table(TowerNode, {"node": 2}, height=heights, length=[40.0, 40.0], mass=masses)
    drag = table(TowerDrag, {"node": 2}, force=[[11.0, 7.0], [-5.0, 3.0], [2.0, 1.0]])
    s = record(
        Outputs, tower_nodes=nodes, tower_drag=drag, apex=ApexLoad.of(), tower_stations=np.zeros(1),
        tower_station=table(TowerStationLoad, {"station": 1}), tower_piece=table(TowerPiece, {"node": 2}),
    )  # fmt: skip
    s.apex.force, s.apex.moment = Vec(900.0, -300.0, -4e3), Vec(8e3, 9e3, -5e3)
    plain(base_motion)(m)
    R = turned(ATTITUDE)
    m.machine.top_position = Vec(*(ATTITUDE[1:4] + [0.0, 0.0, 10.0] + R @ [0.0, 0.0, 80.0]))

    def places(t: float) -> Float:
        """Of the masses, and of the top, from the base at rest."""
        q = ATTITUDE + t * v + 0.5 * t * t * a
        own = np.array([[0.5 * q[0], 0.0, 20.0], [0.5 * q[0], 0.25 * q[0], 60.0], [0.0, 0.0, 80.0]])
        return np.asarray(q[1:4] + own @ turned(q).T)

    h = 1e-3
    acceleration = (places(h) - 2.0 * places(0.0) + places(-h)) / h**2
    plain(tower_loads)(m, s)
    forces = np.array([*masses, 50.0])[:, None] * (-G * np.eye(3)[2] - acceleration)
    forces[:2] += np.array([[11.0, -5.0, 2.0], [7.0, 3.0, 1.0]])
    forces[2] += [900.0, -300.0, -4e3]
    arms = places(0.0) - ATTITUDE[1:4]
    near(s.tower_station.force[0], R.T @ forces.sum(axis=0), 1e-5)
    near(s.tower_station.moment[0], R.T @ (np.array([8e3, 9e3, -5e3]) + np.cross(arms, forces).sum(axis=0)), 1e-5)


# water --------------------------------------------------------------------------------------------------


def test_a_current_pushes_a_turned_hull_along_itself() -> None:
    """A platform with a heading of 90 deg in a current along x: the drag across it, D u^2, acts along x (W-10)."""
    q = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.5 * np.pi])
    m = floating(q, np.zeros(7))
    m.floater.current = Vec(2.0, 0.0, 0.0)
    m.float_matrices[24, 0], m.float_matrices[25, 1] = 100.0, 400.0
    plain(base_motion)(m)
    plain(floater_forces)(0.0, m)
    near(m.core_force[1:4], (1600.0, 0.0, 0.0))
    m.v[1] = 3.0
    m.core_force[:] = 0.0
    plain(base_motion)(m)
    plain(floater_forces)(0.0, m)
    near(m.core_force[1:4], (-400.0, 0.0, 0.0))


def test_drag_of_members_is_that_of_the_velocity_across_and_along() -> None:
    """Relative to the water, with the motion of the piece (W-20)."""
    m = floating()
    m.strip = table(
        DragStrip, {"strip": 2}, place=[[3.0, 0.0], [0.0, -4.0], [-5.0, -9.0]], axis=[[0, 0.6], [0, 0.0], [1, 0.8]]
    )
    m.strip.array[6:] = [[50.0, 80.0], [20.0, 30.0]]
    flow = np.array([0.5, -0.2, 0.1, 0.7, 0.3, -0.4])
    m.float_flow = np.tile(flow, (8, 1))
    plain(base_motion)(m)
    plain(floater_forces)(0.0, m)
    p, R = m.platform, turned(ATTITUDE)
    F, M = np.zeros(3), np.zeros(3)
    for n in range(2):
        r, e = R @ [*m.strip.place[n]], R @ [*m.strip.axis[n]]
        u = flow[3 * n : 3 * n + 3] - np.array([*p.velocity]) - np.cross([*p.spin], r)
        along = (u @ e) * e
        across = u - along
        push = (50.0, 80.0)[n] * np.linalg.norm(across) * across + (20.0, 30.0)[n] * np.linalg.norm(along) * along
        F, M = F + push, M + np.cross(r, push)
    near(m.core_force[LAST], m.platform_columns @ [*F, *M])


def test_water_pushes_damps_and_remembers() -> None:
    """All loads of the water but drag of members, from their matrices (W-8 to W-10, W-4)."""
    random = np.random.default_rng(1)
    m = floating()
    K = random.normal(size=(5, 6, 6))
    m.float_matrices = K.reshape(30, 6).copy()
    m.float_waves = np.tile(random.normal(size=7), (8, 1))
    m.radiation = table(RadiationState, {"mode": 2}, real=[0.3, -0.4], imaginary=[0.7, 0.2])
    m.float_output, m.float_input = random.normal(size=(2, 12)), random.normal(size=(2, 12))
    m.floater.current, m.floater.displaced = Vec(0.4, -0.3, 0.0), 70.0
    m.floater.buoyancy_x, m.floater.buoyancy_y = 1.5, -0.8
    plain(base_motion)(m)
    plain(floater.water_load)(0.3, m)
    p, R = m.platform, turned(ATTITUDE)
    x = np.array([*p.displacement, *p.angle])
    own = np.concatenate([R.T @ [*p.velocity], R.T @ [*p.spin]])
    against = own - np.concatenate([R.T @ [0.4, -0.3, 0.0], np.zeros(3)])
    water = m.float_waves[0, 1:] - K[0] @ [*p.bias, *m.base.spin_rate]
    water -= np.array([0.3, -0.4]) @ m.float_output[:, :6] - np.array([0.7, 0.2]) @ m.float_output[:, 6:]
    lift = 70.0 * np.array([1.0, -0.8, -1.5]) - K[1, 2:5, 2:5] @ x[2:5]
    heading = Rotation.from_euler("z", p.angle.z).as_matrix()
    water += G * np.concatenate([[0.0, 0.0, lift[0]], heading @ [lift[1], lift[2], 0.0]])
    drag = -K[3] @ own - K[4] @ (against * np.abs(against))
    water += np.concatenate([R @ drag[:3], R @ drag[3:]])
    near(m.base_six[1], water, 1e-9)
    near(m.base_six[2], -K[2] @ x, 1e-9)
    assert p.elevation == pytest.approx(m.float_waves[0, 0])


def test_the_load_of_the_water_has_the_added_mass() -> None:
    random = np.random.default_rng(2)
    m = floating()
    A = random.normal(size=(6, 6))
    m.float_matrices[:6], m.a[LAST] = A, random.normal(size=6)
    plain(base_motion)(m)
    m.base_six[1] = random.normal(size=6)
    m.machine.top_position = Vec(4.0, -3.0, 88.0)
    s = record(Outputs, chain=MachineLoad.of())
    plain(outer_section_loads)(m, s)
    plain(top_deflection)(m, s)
    near([*m.platform.force, *m.platform.moment], m.base_six[1] - A @ (m.a[LAST] @ m.platform_columns))
    R = turned(ATTITUDE)
    top = R.T @ (np.array([4.0, -3.0, 88.0]) - ATTITUDE[1:4] - [0.0, 0.0, 10.0])
    near(s.chain.top_deflection, top - [0.0, 0.0, 80.0])
    assert m.platform.offset == pytest.approx(np.hypot(*[*m.platform.displacement][:2]))
    assert m.platform.tilt == pytest.approx(np.arccos(R[2, 2]))


def test_added_mass_and_matrices_give_the_energy_of_the_motion() -> None:
    """v' M v is twice the energy of platform and water that move with it."""
    random = np.random.default_rng(3)
    m = floating()
    A = random.normal(size=(6, 6))
    m.float_matrices[:6] = A @ A.T
    m.floater.mass, m.floater.centre, m.floater.inertia = 30.0, Vec(0.5, -0.3, -4.0), Vec(7.0, 8.0, 5.0)
    plain(floater_forces)(0.0, m)
    M, p, R = m.core_mass[LAST, LAST], m.platform, turned(ATTITUDE)
    M = np.tril(M) + np.tril(M, -1).T
    u, w = np.array([*p.velocity]), np.array([*p.spin])
    own = u + np.cross(w, R @ [0.5, -0.3, -4.0])
    energy = np.array([*u, *w]) @ (A @ A.T) @ np.array([*u, *w]) + 30.0 * own @ own
    assert RATE[LAST] @ M @ RATE[LAST] == pytest.approx(energy + (R.T @ w) ** 2 @ [7.0, 8.0, 5.0])


SEA = meltemi.environment.ComponentSea(
    frequency=[0.5, 0.9], amplitude=[1.0, 0.5], phase=[0.3, 1.0], direction=[0.4, -1.0]
)


@pytest.mark.parametrize("heading", [0.0, 0.5 * np.pi, -np.radians(50.0), np.radians(33.0), -np.radians(177.0)])
def test_displaced_waves_push_a_turned_platform_along_themselves(heading: float) -> None:
    """A hull whose force is i rho g (1 + w) A along the waves, and that has a moment of yaw from waves on its side: the
    wave at its place, with the phase there, along the wave whatever the heading (W-39)."""
    pytest.importorskip("windIO")
    degrees, frequency = np.arange(-180.0, 181.0, 5.0), np.array([0.1, 2.0])
    X = np.zeros((2, len(degrees), 6), dtype=np.complex128)
    X[:, :, 0], X[:, :, 1] = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    X[:, :, 5] = 3.0 * np.sin(np.radians(degrees))
    X *= 1j * (1.0 + frequency[:, None, None])
    none = np.zeros((2, 6, 6))
    c = HydroCoefficients(frequency, none, none, none[0], degrees, X, none[0])
    platform = meltemi.load_turbine("iea15mw-volturnus").platform
    assert platform is not None
    lines, force = displaced_forces(SEA, c, platform, 60.0, (0.0, 0.0), G)
    m = floating(float_lines=lines, float_forces=force)
    place, t = np.array([12.0, -7.0]), 3.7
    m.platform.displacement, m.platform.angle = Vec(*place, 0.0), Vec(0.0, 0.0, heading)
    F, M = plain(floater.displaced_waves)(t, m)
    k = wave_number(np.array([0.5, 0.9]), platform.depth, G)
    expected, moment = np.zeros(3), 0.0
    for w, a, phase, direction, number in zip((0.5, 0.9), (1.0, 0.5), (0.3, 1.0), (-0.4, 1.0), k, strict=True):
        way = np.array([np.cos(direction), np.sin(direction)])
        wave = a * np.exp(1j * (w * t + phase - number * way @ place))
        size = (platform.water_density * G * 1j * (1.0 + w) * wave).real
        expected[:2] += size * way
        moment += 3.0 * size * np.sin(direction - heading)
    found = Rotation.from_euler("z", heading).apply([*F])
    near(found, expected, 5e-3)  # linear between headings 10 deg apart: up to 3.8e-3
    assert M.z == pytest.approx(moment, abs=0.015 * np.abs(expected).max())
    assert (M.x, M.y) == (0.0, 0.0)


def test_radiation_remembers_the_velocity_as_its_poles_say() -> None:
    """z' = p z + B u with constant u: exact over a step, whatever its length (W-4)."""
    m = floating(v=np.array([0.0, 1.0, -0.5, 0.2, 0.0, 0.3, 0.1]))
    m.platform_columns[:] = np.eye(6) + 0.1 * np.eye(6, k=1)
    m.radiation = table(RadiationState, {"mode": 1}, real=[0.7], imaginary=[-0.4])
    m.d_radiation = table(RadiationState, {"mode": 1})
    m.float_pole, m.float_input = np.array([[-0.3, 0.8]]), np.arange(12.0)[None] - 4.0
    m.float_decay = np.zeros((1, 5))
    pole, B, z = -0.3 + 0.8j, np.arange(6) - 4.0 + 1j * (np.arange(6) + 2.0), 0.7 - 0.4j
    dt = 1.3
    m.a[LAST] = 0.2, 0.1, -0.3, 0.0, 0.05, 0.0
    u = (m.v[LAST] - 0.5 * dt * m.a[LAST]) @ m.platform_columns
    plain(part_rates)(m)
    rate = pole * z + B @ (m.v[LAST] @ m.platform_columns)
    near((m.d_radiation.real[0], m.d_radiation.imaginary[0]), (rate.real, rate.imag))
    plain(begin_parts_step)(dt, m)
    after = (z + B @ u / pole) * np.exp(pole * dt) - B @ u / pole
    near((m.radiation.real[0], m.radiation.imaginary[0]), (after.real, after.imag))


def test_the_record_of_a_platform_has_its_numbers() -> None:
    pytest.importorskip("windIO")
    turbine = meltemi.load_turbine("iea15mw-volturnus")
    stiffness, damping, drag = (scale * np.arange(36.0).reshape(6, 6) for scale in (1.0, 2.0, 3.0))
    platform = turbine.platform.replace(stiffness=stiffness, linear_damping=damping, quadratic_damping=drag)
    tower = meltemi.build(turbine).rotor.tower
    part = floater.part_of(turbine.replace(platform=platform), None, SimpleNamespace(tower=tower))
    c, rho, hull = part.constants, platform.water_density, part.coefficients
    blocks = (rho * hull.infinite, rho * hull.hydrostatic, stiffness, damping, drag)
    np.testing.assert_array_equal(c["float_matrices"].reshape(5, 6, 6), blocks)
    # the oscillations of the kernels are those of the fit (W-5)
    t = np.linspace(0.0, 20.0, 7)
    B, C = (c[name][:, :6] + 1j * c[name][:, 6:] for name in ("float_input", "float_output"))
    decay = np.exp(np.outer(t, c["float_pole"] @ [1.0, 1j]))
    found = np.einsum("tp,pi,pj->tij", decay, C, B).real
    np.testing.assert_allclose(found, rho * part.radiation.kernel(t), atol=1e-9 * np.abs(found).max())
    v = View(Floater, c["floater"])
    assert (v["mass"], v["displaced"], v["bed"]) == (platform.mass, rho * platform.volume, -platform.depth)
    assert [*v["centre"], v["buoyancy_x"], v["buoyancy_y"]] == [*platform.centre, *platform.buoyancy_centre]
    np.testing.assert_array_equal(v["inertia"], platform.inertia)
    assert c["d_radiation"].shape[-1] == len(c["float_pole"])
    tower = turbine.tower
    assert c["tower_body"][0] == pytest.approx(tower.top_mass + np.trapezoid(tower.mass, tower.position), rel=1e-3)
    assert part.sizes == {"mode": len(c["float_pole"]), "line": 3, "point": 0}


def test_a_platform_that_lies_on_its_side_ends_the_run() -> None:
    for tilt, over in ((0.9, False), (1.2, True)):
        m = floating(np.array([0.0, 0.0, 0.0, 0.0, 0.0, tilt, 0.0]), np.zeros(7))
        run = SimpleNamespace(clock=SimpleNamespace(status=OK))
        plain(check_parts)(m, run)
        assert run.clock.status == (DIVERGED if over else OK)
        assert m.platform.tilt == pytest.approx(tilt)


# lines --------------------------------------------------------------------------------------------------

N = 4
"""Segments of a line in the tests."""
CONSTANTS = {
    "length": 80.0, "mass": 50.0, "stiffness": 4e5, "friction": 0.6, "drag": 30.0, "axial_drag": 8.0, "inertia": 70.0,
    "axial_inertia": 55.0, "on_bed": 1.0, "damping": 2e4, "diameter": 0.2, "reach": 80.0,
}  # fmt: skip


def moving_line(x: Float, v: Float, start: Any, **changes: float) -> Any:
    """A line of four segments with points (3, 4), the last one its fairlead."""
    constants = {name: [value] for name, value in (CONSTANTS | changes).items()}
    order = {key: [NONE] for key in ("below", "point", "head", "foot", "onward", "back", "knot")}
    segments = table(LineSegment, {"line": 1, "node": N})
    m = floating(
        line_point=table(LinePoint, {"line": 1, "node": N}, position=x[:, None], velocity=v[:, None]),
        line_state=table(LineState, {"line": 1}, begun=[1.0], start=np.array(start, dtype=float)[:, None]),
        segments=segments, segments_alone=segments, line=table(Line, {"line": 1}, **constants),
        line_order=table(LineOrder, {"line": 1}, **order), line_end=table(LineEnd, {"line": 1}),
        line_load=table(LineLoad, {"line": 1}),
        faults=record(FloaterSystem, line_lost=np.zeros(1)),
    )  # fmt: skip
    m.line_end.upper[0] = m.line_point.position[0, N - 1]
    return m


def test_points_on_the_bed_are_carried_by_it() -> None:
    """A slack line below the bed: implicit step of a mass on spring and damper, with its weight (W-25, W-27)."""
    h, theta, deep, v = 0.05, 0.5, 0.02, -0.3
    x = np.array([[5.0, 10.0, 15.0, 20.0], np.zeros(4), np.full(4, -50.0 - deep)])
    m = moving_line(
        x, np.array([np.zeros(4), np.zeros(4), [v, v, v, 0.0]]), (0.0, 0.0, -50.0 - deep), drag=0.0, axial_drag=0.0
    )
    plain(lumped.march)(h, theta, m)
    K, B, mass, weight = 3e6 * 0.2 * 20.0, 3e5 * 0.2 * 20.0, 70.0 * 20.0, 50.0 * 20.0 * G
    dv = h * (K * (deep - theta * h * v) - B * v - weight) / (mass + theta * h * B + theta**2 * h**2 * K)
    assert m.line_point.velocity[0, 1].z == pytest.approx(v + dv, rel=1e-9)
    assert m.line_point.position[0, 1].z == pytest.approx(-50.0 - deep + h * (v + theta * dv), rel=1e-12)


def forces_of_points(x: Float, v: Float) -> tuple[Float, Float, Float, Float, Float]:
    """Forces and their rate by what is elastic, mass, damping and stiffness matrices of three free points between start
    and fairlead (5, 3), by segments and halves of segments (W-24 to W-26)."""
    c, n = CONSTANTS, 3
    F, rate, M, D, K = np.zeros(9), np.zeros(9), np.zeros((9, 9)), np.zeros((9, 9)), np.zeros((9, 9))
    for s in range(N):
        d, change = x[s + 1] - x[s], v[s + 1] - v[s]
        size = np.linalg.norm(d)
        e = d / size
        taut = max(c["stiffness"] * (size / 20.0 - 1.0), 0.0)
        T = taut + c["damping"] / 20.0 * change @ e
        along = c["stiffness"] / 20.0 if taut > 0.0 else 0.0
        spring = taut / size * (np.eye(3) - np.outer(e, e)) + along * np.outer(e, e)
        damper = c["damping"] / 20.0 * np.outer(e, e)
        for p, sign in ((s - 1, 1.0), (s, -1.0)):
            if 0 <= p < n:
                F[3 * p : 3 * p + 3] += sign * T * e
                rate[3 * p : 3 * p + 3] += sign * spring @ change
                for r, other in ((s - 1, 1.0), (s, -1.0)):
                    if 0 <= r < n:
                        block = slice(3 * p, 3 * p + 3), slice(3 * r, 3 * r + 3)
                        K[block] += sign * other * spring
                        D[block] += sign * other * damper
    for p in range(n):
        way = x[p + 2] - x[p]
        way /= np.linalg.norm(way)
        u = v[p + 1]
        vt = u @ way
        vn = u - vt * way
        cn, ca = 20.0 * c["drag"] * np.linalg.norm(vn), 20.0 * c["axial_drag"] * abs(vt)
        block, P = slice(3 * p, 3 * p + 3), np.outer(way, way)
        F[block] += -cn * vn - ca * vt * way - [0.0, 0.0, 20.0 * c["mass"] * G]
        M[block, block] = 20.0 * (c["inertia"] * (np.eye(3) - P) + c["axial_inertia"] * P)
        D[block, block] += cn * (np.eye(3) - P) + ca * P
        if (deep := -50.0 - x[p + 1, 2]) > 0.0:
            hold = c["friction"] * 20.0 * c["mass"] * G / max(np.hypot(u[0], u[1]), 0.01)
            area = 20.0 * c["diameter"]
            F[block] += [-hold * u[0], -hold * u[1], area * (3e6 * deep - 3e5 * u[2])]
            D[block, block] += np.diag([2.0 * hold, 2.0 * hold, area * 3e5])
            K[block, block] += np.diag([0.0, 0.0, area * 3e6])
            rate[block] -= [0.0, 0.0, area * 3e6 * u[2]]
    return F, rate, M, D, K


def test_a_step_of_a_line_solves_the_implicit_equations_of_all_points() -> None:
    """(M + th D + t^2 h^2 K) dv = h F + t h^2 x (rate of the forces): the elimination from point to point against the
    whole matrix. Friction is taken at the end of the step, twice the weight of the middle."""
    h, theta = 0.02, 0.5
    start = np.array([0.0, 0.0, -50.001])
    points = np.array([[19.9, 1.0, -50.01], [40.3, 2.5, -46.0], [59.0, 6.0, -35.0], [73.0, 4.0, -21.0]])
    v = np.array([[0.3, -0.2, -0.1], [0.5, 1.0, -0.7], [-0.4, 0.8, 0.6], [1.0, 0.5, -0.3]])
    m = moving_line(points.T, v.T, start)
    m.line_end.upper[0] = Vec(*(points[3] + h * v[3]))
    x, u = np.vstack([start, points]), np.vstack([np.zeros(3), v])
    F, rate, M, D, K = forces_of_points(x, u)
    dv = np.linalg.solve(M + theta * h * D + (theta * h) ** 2 * K, h * F + theta * h * h * rate)
    plain(lumped.march)(h, theta, m)
    found = np.array([[*m.line_point.velocity[0, k]] for k in range(3)]) - v[:3]
    near(found.ravel(), dv)
    place = np.array([[*m.line_point.position[0, k]] for k in range(3)])
    near((place - points[:3]).ravel(), (h * (v[:3] + theta * found)).ravel())
    near(m.line_point.position[0, 3], points[3] + h * v[3])


def test_symmetric_matrices_are_reduced_and_inverted() -> None:
    random = np.random.default_rng(4)
    A, S, B = (
        (lambda X: X @ X.T)(random.normal(size=(3, 3))),
        *[(lambda X: X + X.T)(random.normal(size=(3, 3))) for _ in "SB"],
    )

    def sym(X: Float) -> Sym:
        return Sym(X[0, 0], X[1, 1], X[2, 2], X[0, 1], X[0, 2], X[1, 2])

    near(matrix(plain(mooring.inverse)(sym(A))).ravel(), np.linalg.inv(A).ravel())
    near(matrix(plain(lumped.reduced)(sym(A), sym(S), sym(B))).ravel(), (A - S @ B @ S).ravel())
    e = np.array([0.6, -0.3, 0.5])
    near(matrix(plain(mooring.dyad)(2.0, 3.0, Vec(*e))).ravel(), (2.0 * np.eye(3) + 3.0 * np.outer(e, e)).ravel())


def test_the_end_of_a_line_pulls_with_its_half_segment() -> None:
    """Tension, drag, weight and known inertia of the half segment at the fairlead, which moves with the platform."""
    points = np.array([[20.0, 1.0, -49.0], [40.3, 2.5, -46.0], [59.0, 6.0, -35.0], [76.0, 4.0, -21.0]])
    v = np.array([[0.3, -0.2, -0.1], [0.5, 1.0, -0.7], [-0.4, 0.8, 0.6], [1.0, 0.5, -0.3]])
    m = moving_line(points.T, v.T, (0.0, 0.0, -50.0))
    plain(base_motion)(m)
    p, r = m.platform, np.array([5.0, -3.0, -2.0])
    found = plain(floater.line_pull)(0, Vec(*r), m)
    d, change = points[3] - points[2], v[3] - v[2]
    e, size = d / np.linalg.norm(d), np.linalg.norm(d)
    T = 4e5 * (size / 20.0 - 1.0) + 2e4 / 20.0 * change @ e
    u = np.array([*p.velocity]) + np.cross([*p.spin], r)
    along = (u @ e) * e
    M = 10.0 * (70.0 * (np.eye(3) - np.outer(e, e)) + 55.0 * np.outer(e, e))
    w = np.array([*p.spin])
    known = np.array([*p.bias]) + np.cross([*m.base.spin_rate], r) + np.cross(w, np.cross(w, r))
    across = u - along
    expected = -T * e - 300.0 * np.linalg.norm(across) * across - 80.0 * np.linalg.norm(along) * along - M @ known
    expected[2] -= 10.0 * 50.0 * G
    near(found, expected)
    assert m.line_load.fairlead[0] == pytest.approx(np.linalg.norm(expected))
    J = np.hstack([m.platform_columns[:, :3] + np.cross(m.platform_columns[:, 3:], r)])
    near(m.core_mass[LAST, LAST][np.tril_indices(6)], (J @ M @ J.T)[np.tril_indices(6)])
    plain(lumped.lumped_tensions)(m)
    assert m.line_load.fairlead[0] == pytest.approx(4e5 * (size / 20.0 - 1.0))
    first = np.linalg.norm(points[0] - [0.0, 0.0, -50.0])
    assert m.line_load.anchor[0] == pytest.approx(4e5 * max(first / 20.0 - 1.0, 0.0))


def hanging(d: Any, **changes: float) -> Any:
    """A line in its static shape from an anchor at the origin, without bed."""
    m = moving_line(np.zeros((3, N)), np.zeros((3, N)), np.zeros(3), **({"on_bed": 0.0} | changes))
    m.line_end.upper[0] = Vec(*d)
    return m


@pytest.mark.parametrize("turn", [0.0, 1.1])
def test_a_taut_line_moves_with_its_end_in_proportion(turn: float) -> None:
    """Light and almost straight: across it, a third of its inertia and a quarter of its drag act at the end (W-15)."""
    R = Rotation.from_euler("z", turn).as_matrix()
    d = R @ [96.0, 0.0, 28.0]
    m = hanging(d, mass=1e-4, length=99.9, reach=99.9, stiffness=1e8)
    e, across = plain(mooring.string_forces)(0, Vec(*d), m)
    assert across == pytest.approx(96.0)
    aside, normal, along = R @ [0.0, 1.0, 0.0], R @ [-0.28, 0.0, 0.96], R @ [0.96, 0.0, 0.28]
    for way, drag, inertia in ((aside, 30.0, 70.0), (normal, 30.0, 70.0), (along, 8.0, 55.0)):
        F, M = plain(mooring.moved_string)(0, e, Vec(*d), across, Vec(*(1.5 * way)), m)
        near(F, -drag * 99.9 / 4.0 * 1.5**2 * way, 0.01)
        near(matrix(M) @ way, inertia * 99.9 / 3.0 * way, 0.01)
        F, _ = plain(mooring.moved_string)(0, e, Vec(*d), across, Vec(*(-1.5 * way)), m)
        near(F, drag * 99.9 / 4.0 * 1.5**2 * way, 0.01)


def test_the_stiffness_of_a_string_is_the_slope_of_its_forces() -> None:
    d, h = np.array([60.0, -35.0, 30.0]), 1e-4

    def force(d: Float) -> tuple[Float, Any, float, Any]:
        m = hanging(d)
        e, across = plain(mooring.string_forces)(0, Vec(*d), m)
        H = m.line_load.horizontal[0]
        return np.array([H * d[0] / across, H * d[1] / across, m.line_load.vertical[0]]), e, across, m

    _, e, across, m = force(d)
    K = matrix(plain(mooring.string_stiffness)(0, e, Vec(*d), across, m))
    slopes = [(force(d + h * axis)[0] - force(d - h * axis)[0]) / (2.0 * h) for axis in np.eye(3)]
    near(K.ravel(), np.array(slopes).T.ravel(), 1e-5)
