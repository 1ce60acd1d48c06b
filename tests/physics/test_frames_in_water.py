"""Frames in water: kinematics, wave loads, buoyancy and section loads against direct sums and closed forms."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from meltemi import InputError, ModelOptions, Start, build, load_turbine, simulate
from meltemi.compiler import Vec, View
from meltemi.control import ConstantController
from meltemi.environment import Current, IrregularSea, RegularSea, StillWater
from meltemi.frames.definition import Coefficients, EndCoefficients, Foot, Frame, JointMass, Member, Section
from meltemi.frames.finite_elements import assemble
from meltemi.frames.kinematics import kinematics
from meltemi.frames.loads import Loads
from meltemi.frames.part import FramePart, FrameWater, drag_force, in_water, part_of, still_forces
from meltemi.frames.reduction import supported_tower
from meltemi.frames.water import added_mass, pieces
from meltemi.sea.airy import WaveComponents, maccamy_fuchs, wave_number
from meltemi.sea.field import AHEAD
from meltemi.simulation.channels import catalogue, find
from meltemi.structure.beam import transfer
from meltemi.structure.members import points

G, RHO, DEPTH = 9.80665, 1025.0, 30.0
TUBE = Section(diameter=1.2, thickness=0.03)
WIDE = Section(diameter=2.0, thickness=0.03)
CLOSED = EndCoefficients(pressure=1.0)


def frame(joints: dict[str, Any], members: str = "ab", **more: Any) -> Frame:
    """Tubes between joints with names of one letter; the first is clamped, the last is the tower's base."""
    other = more.pop("other", {})
    beams = {name: Member(joints=(name[0], name[1]), section="tube", **other.get(name, {})) for name in members.split()}
    names = list(joints)
    return Frame(
        depth=DEPTH,
        joints=joints,
        sections={"tube": TUBE, "wide": WIDE} | more.pop("sections", {}),
        members=beams,
        feet=[Foot(joint=name) for name in more.pop("feet", names[0])],
        interface=[names[-1]],
        **{"ends": CLOSED, "piece": 0.5, "divisions": 3} | more,
    )


def rigid(description: Frame) -> Loads:
    """Loads on a frame whose modes are the six motions of a rigid body about (0, 0, 0)."""
    assembly = assemble(description)
    return Loads(assembly, pieces(assembly), transfer(assembly.points).transpose(2, 0, 1), G)


def waves(description: Frame, sea: Any, duration: float = 20.0) -> dict[str, Any]:
    """Arrays of a frame in a sea, with the force and moment (T, 6) of what is always wet, from time 0."""
    loads, water = rigid(description), FrameWater.zeros()
    View(FrameWater, water)["density"] = RHO
    found = in_water(loads, {"water": water}, sea, duration, (0.0, 0.0))
    still = in_water(loads, {"water": water}, StillWater(), 1.0, (0.0, 0.0))
    found["total"] = found["frame_push"][AHEAD:, 1:] - still["frame_push"][0, 1:]
    found["time"] = View(FrameWater, found["water"])["step"] * np.arange(len(found["total"]))
    return found


class Airy:
    """One wave in water of a depth, at places (..., 3)."""

    def __init__(self, w: float, amplitude: complex = 1.0, direction: float = 0.0) -> None:
        self.w, self.k = w, float(wave_number(np.array([w]), DEPTH, G)[0])
        self.e, self.amplitude = np.array([np.cos(direction), np.sin(direction)]), amplitude

    def phase(self, x: Any, t: Any) -> Any:
        return self.amplitude * np.exp(1j * (self.w * t - self.k * (x[..., :2] @ self.e)))

    def motion(self, x: Any, t: Any) -> tuple[Any, Any, Any]:
        """Velocity (..., 3), acceleration (..., 3) and pressure head (...)."""
        s, k, w = x[..., 2] + DEPTH, self.k, self.w
        eta = self.phase(x, t)
        flat, rise = w * eta * np.cosh(k * s) / np.sinh(k * DEPTH), 1j * w * eta * np.sinh(k * s) / np.sinh(k * DEPTH)
        v = np.stack([flat * self.e[0], flat * self.e[1], rise], axis=-1)
        return v.real, (1j * w * v).real, (eta * np.cosh(k * s) / np.cosh(k * DEPTH)).real


# kinematics ---------------------------------------------------------------------------------------

PLACES = np.array([[0.0, 0.0, -0.2], [12.0, -9.0, -4.0], [-14.0, 14.0, -25.0], [6.0, 2.0, 0.8], [-6.0, 3.0, 2.0]])


def components(spread: bool) -> WaveComponents:
    random = np.random.default_rng(4)
    w = 2.0 * np.pi / 200.0 * np.arange(12, 90)  # many: those in one direction are interpolated
    amplitude = 0.25 * np.exp(-(((w - 0.8) / 0.5) ** 2)) * np.exp(2j * np.pi * random.random(len(w)))
    return WaveComponents(w, amplitude, random.normal(0.4, 0.5, len(w)) if spread else np.full(len(w), 0.4), None)


@pytest.mark.parametrize("stretching", ["none", "vertical", "wheeler", "extrapolation"])
@pytest.mark.parametrize("spread", [False, True])
def test_kinematics_are_the_sum_of_all_waves(stretching: str, spread: bool) -> None:
    sea = components(spread)
    found = kinematics(sea, DEPTH, PLACES, 40.0, stretching=stretching, radius=np.zeros(5), gravity=G)
    t = found.dt * (np.arange(len(found.elevation)) - AHEAD)
    each = [Airy(*row) for row in zip(sea.frequency, sea.amplitude, sea.direction, strict=True)]
    level = sum(wave.phase(PLACES, t[:, None]).real for wave in each)
    assert found.elevation == pytest.approx(level, abs=1e-3)
    at = np.repeat(PLACES[None], len(t), axis=0)
    z = at[..., 2].copy()
    if stretching == "wheeler":
        at[..., 2] = DEPTH * (DEPTH + z) / (DEPTH + level) - DEPTH
    at[..., 2] = np.minimum(at[..., 2], 0.0)
    expected = [sum(x) for x in zip(*(wave.motion(at, t[:, None]) for wave in each), strict=True)]
    if stretching == "extrapolation":
        below = at.copy()
        below[..., 2] -= 1e-3
        lower = [sum(x) for x in zip(*(wave.motion(below, t[:, None]) for wave in each), strict=True)]
        rise = np.maximum(z, 0.0) / 1e-3
        expected = [
            a + (rise[..., None] if a.ndim == 3 else rise) * (a - b) for a, b in zip(expected, lower, strict=True)
        ]
    wet = level > z if stretching != "none" else np.ones_like(z, bool)
    for ours, sums in zip((found.velocity, found.acceleration, found.pressure), expected, strict=True):
        assert np.abs(ours - sums)[wet].max() < 3e-3 * np.abs(sums[wet]).max()


def test_diffraction_has_the_factor_of_maccamy_and_fuchs() -> None:
    sea = WaveComponents(np.array([1.5]), np.array([1.0 + 0.0j]), np.array([0.0]), None)
    plain, thick = (
        kinematics(sea, DEPTH, PLACES[:2], 20.0, stretching="none", radius=np.array([r, 0.0]), gravity=G)
        for r in (0.0, 4.0)
    )
    k = float(wave_number(np.array([1.5]), DEPTH, G)[0])
    factor = 0.5 * complex(maccamy_fuchs(np.array([4.0 * k]))[0])
    turn = np.exp(1.5j * plain.dt * np.arange(len(plain.elevation)))
    basis = np.stack([turn.real, -turn.imag], axis=1)
    a, b = (complex(*np.linalg.lstsq(basis, each.acceleration[:, 0, 0], rcond=None)[0]) for each in (plain, thick))
    assert b / a == pytest.approx(factor, rel=1e-3)
    assert abs(factor) < 0.75 and thick.acceleration[:, 1] == pytest.approx(plain.acceleration[:, 1])


# wave loads ---------------------------------------------------------------------------------------

WAVE = RegularSea(height=2.0, period=6.0, stretching="none", direction=-0.6)
LINES = {
    "upright": ([0.0, 0.0, -20.0], [0.0, 0.0, -3.0]),
    "horizontal, along the wave": ([-8.0, -5.0, -6.0], [8.0, 5.5, -6.0]),
    "horizontal, across": ([5.0, -8.0, -4.0], [-5.0, 8.0, -4.0]),
    "inclined by 45 deg": ([-6.0, 0.0, -16.0], [6.0, 0.0, -4.0]),
    "askew": ([3.0, -7.0, -18.0], [-4.0, 6.0, -2.5]),
}


@pytest.mark.parametrize("line", LINES)
def test_inertia_acts_across_a_tube_and_pressure_on_its_ends(line: str) -> None:
    """f = rho (Ca + Cp) A |a across|, and - p n A at both ends; force and moment about still water (F-37, F-38)."""
    a, b = map(np.array, LINES[line])
    one = frame({"a": a, "b": b}, hydrodynamics=Coefficients(drag=0.0, added_mass=0.7, pressure=1.0))
    found = waves(one, WAVE)
    wave, t, A = Airy(2.0 * np.pi / 6.0, 1.0, 0.6), found["time"], np.pi / 4 * 1.2**2
    length = float(np.linalg.norm(b - a))
    k = (b - a) / length
    s = (np.arange(400) + 0.5) / 400
    place = a + s[:, None] * (b - a)
    _, acceleration, _ = wave.motion(place, t[:, None])
    across = acceleration - (acceleration @ k)[..., None] * k
    force = RHO * 1.7 * A * length / 400 * across
    total = np.concatenate([force.sum(1), np.cross(place, force).sum(1)], axis=1)
    for end, sign in ((a, -1.0), (b, 1.0)):
        push = -sign * RHO * G * A * np.outer(wave.motion(end, t)[2], k)
        total += np.concatenate([push, np.cross(end, push)], axis=1)
    for some in (slice(0, 3), slice(3, 6)):
        assert np.abs(found["total"] - total)[:, some].max() < 2e-3 * np.abs(total[:, some]).max()


def test_drag_acts_across_a_tube_and_along_a_plate() -> None:
    e = Vec(0.6, 0.0, 0.8)
    F = drag_force(Vec(2.0, 1.0, -0.5), e, 3.0, 0.0)
    across = np.array([2.0, 1.0, -0.5]) - 0.8 * np.array([0.6, 0.0, 0.8])
    assert [F.x, F.y, F.z] == pytest.approx(3.0 * np.linalg.norm(across) * across)
    F = drag_force(Vec(-2.0, 1.0, -0.5), e, 0.0, 2.0)  # 1.6 m/s along - e
    assert [F.x, F.y, F.z] == pytest.approx(2.0 * -(1.6**2) * np.array([0.6, 0.0, 0.8]))
    one = pieces(assemble(frame({"a": [0, 0, -20], "b": [3, 0, -5]}, hydrodynamics=Coefficients(drag=1.3))))
    assert one.drag.sum() == pytest.approx(0.5 * RHO * 1.3 * 1.2 * np.hypot(3, 15))


def test_plates_at_joints_have_hydrodyns_coefficients() -> None:
    """Cd rho / 4 |A|, Ca rho 2/3 pi r^3, along the sum of the outward ends; a current pushes one way."""
    ends = EndCoefficients(drag=4.0, added_mass=2.0, pressure=0.0)
    p = pieces(assemble(frame({"a": [0, 0, -20], "b": [8, 0, -14]}, ends=ends)))
    some = p.plate > 0.0
    assert p.plate[some] == pytest.approx([RHO * np.pi / 4 * 1.2**2] * 2)
    heavy = p.along > 0.0
    assert p.along[heavy] == pytest.approx([2.0 * RHO * 2.0 / 3.0 * np.pi * 0.6**3] * 2)
    assert np.abs(p.axis[some] @ [0.8, 0.0, 0.6]) == pytest.approx([1.0, 1.0])
    # two tubes in line have no ends where they meet
    line = frame({"a": [0, 0, -20], "b": [4, 0, -17], "c": [8, 0, -14]}, "ab bc", ends=ends)
    assert (pieces(assemble(line)).plate > 0.0).sum() == 2


def test_added_mass_is_across_and_moves_with_the_frame() -> None:
    one = rigid(frame({"a": [0, 0, -20], "b": [0, 12, -11]}, hydrodynamics=Coefficients(added_mass=0.9), piece=0.2))
    p, k = one.pieces, np.array([0.0, 0.8, 0.6])
    mass = added_mass(p, one.shape, len(p.low))
    m = RHO * 0.9 * np.pi / 4 * 1.2**2 * 15.0
    assert mass[:3, :3] == pytest.approx(m * (np.eye(3) - np.outer(k, k)), abs=1e-6 * m)
    # about the middle a rod of this mass
    arm = transfer(np.array([0.0, -6.0, 15.5]))
    about = (arm.T @ mass @ arm)[3:, 3:]
    assert about == pytest.approx(m * 15.0**2 / 12.0 * (np.eye(3) - np.outer(k, k)), rel=2e-3, abs=1e-3 * m)


# buoyancy -----------------------------------------------------------------------------------------


def wrench(p: Any, force: Any, about: Any) -> Any:
    return np.concatenate([force.sum(0), np.cross(p.place - about, force).sum(0)])


@pytest.mark.parametrize("line", LINES)
def test_a_closed_tube_is_lifted_by_its_volume_at_its_centroid(line: str) -> None:
    a, b = map(np.array, LINES[line])
    growth = [{"bottom": -12.0, "top": -7.0, "thickness": 0.1, "density": 1100.0}]
    for grown in ((), growth):
        p = pieces(assemble(frame({"a": a, "b": b}, growth=grown)))
        # the rings at the edges of the growth are ends, too
        lift = wrench(p, still_forces(p, RHO, 0.0, G), np.zeros(3))
        centre = (p.volume[:, None] * p.place).sum(0) / p.volume.sum()
        volume = RHO * G * p.volume.sum()
        assert lift[:3] == pytest.approx([0.0, 0.0, volume], abs=1e-9 * volume)
        assert lift[3:] == pytest.approx(np.cross(centre, [0, 0, volume]), abs=2e-3 * volume)
        if not grown:
            assert volume == pytest.approx(RHO * G * np.pi / 4 * 1.2**2 * np.linalg.norm(b - a), rel=1e-9)
            assert centre == pytest.approx(0.5 * (a + b), abs=1e-9)


def test_a_cone_is_lifted_by_its_volume() -> None:
    cone = frame({"a": [0, 0, -20], "b": [5, 0, -8]}, other={"ab": {"end_section": "wide"}}, piece=0.1)
    p = pieces(assemble(cone))
    lift = wrench(p, still_forces(p, RHO, 0.0, G), np.zeros(3))
    assert lift[:3] == pytest.approx(
        [0, 0, RHO * G * np.pi / 12 * 13.0 * (1.2**2 + 1.2 * 2.0 + 2.0**2)], rel=2e-4, abs=2.0
    )


def test_equal_pressure_does_not_move_closed_frames() -> None:
    """The ends at all joints, steps and cones of closed frames sum up to nothing; those open to the bed do not."""
    joints = {"a": [0, 0, -20], "b": [9, 0, -18], "c": [2, 7, -4], "d": [1, 1, -9]}
    growth = [{"bottom": -15.0, "top": -6.0, "thickness": 0.15}]
    other = {"cd": {"end_section": "wide"}}
    closed = frame(joints, "ab bc ca cd ad", other=other, growth=growth)
    p = pieces(assemble(closed))
    assert np.abs(p.area).sum() > 5.0 and (p.area[:, None] * p.axis).sum(0) == pytest.approx(0.0, abs=1e-9)
    assert (p.still_area[:, None] * p.axis).sum(0) == pytest.approx(0.0, abs=1e-9)
    down = closed.replace(joints=joints | {"a": [0, 0, -DEPTH]})
    p = pieces(assemble(down))
    assert np.linalg.norm((p.area[:, None] * p.axis).sum(0)) > 0.5


# section loads ------------------------------------------------------------------------------------


def tripod(**more: Any) -> Frame:
    """Three legs, one open to the sea, one partly filled, and a column through the surface."""
    joints = {"a": [-8, 0, -30], "b": [6, 7, -30], "c": [6, -7, -30], "d": [0.5, 0, -6], "e": [0, 0, 8]}
    other = {"ad": {"flooded": True}, "bd": {"filled_to": -12.0, "fill_density": 1200.0}}
    growth = [{"bottom": -20.0, "top": -3.0, "thickness": 0.1, "density": 1100.0}]
    return frame(joints, "ad bd dc de bc", **{"feet": "abc", "other": other, "growth": growth} | more)


@pytest.fixture(scope="module")
def cut() -> tuple[Loads, Any, dict[tuple[str, str], Any]]:
    """Loads of the tripod, forces of still water, and (B, 7) section loads by each entry of the basis."""
    loads = Loads(assemble(tripod()), pieces(assemble(tripod())), np.zeros(0), G)
    a = loads.assembly
    below = np.random.default_rng(1).normal(size=(4, len(a.points), 6))
    T = a.transformation.toarray()
    below = (T @ np.linalg.lstsq(T, below.reshape(4, -1).T, rcond=None)[0]).T.reshape(below.shape)  # allowed motions
    loads = Loads(a, loads.pieces, below, G)
    still = still_forces(loads.pieces, RHO, 0.0, G)
    matrix = loads.of_members(loads.channels, still)
    return loads, still, {section: matrix[:, 7 * i : 7 * i + 7] for i, section in enumerate(loads.sections)}


@pytest.mark.parametrize("member", ["ad", "bd", "dc", "de", "bc"])
def test_what_is_between_two_sections_is_in_equilibrium(member: str, cut: Any) -> None:
    """End less start is inertia less the loads between, for any force of the water, motion of the frame, and weight."""
    loads, _, sections = cut
    a, p = loads.assembly, loads.pieces
    e, k, mine = a.elements, len(loads.below), np.flatnonzero(a.elements.member == a.members.index(member))
    Q, (one, two) = e.axes[mine[0]], a.member_nodes[member][[0, -1]]
    start, end = a.points[one], a.points[two]

    def about_start(force: Any, moment: Any, place: Any) -> Any:
        return np.concatenate([force, moment + np.cross(place - start, force)])

    m = 3 * len(p.low)
    expected = np.zeros((m + 7 + 2 * k, 6))
    for n in np.flatnonzero(np.isin(p.element, mine) & (p.node < 0)):
        for i, push in enumerate(np.eye(3)):
            expected[3 * n + i] = -about_start(push, np.zeros(3), p.place[n])
    inertia = a.inertia(loads.below)
    _, ends = loads.constant
    for row, load in [*((m + 6 + i, inertia[i]) for i in range(k)), (m + 6 + 2 * k, -ends)]:
        for part in mine:
            for side in (0, 1):
                F = load[part, side]
                expected[row] += about_start(F[:3], F[3:], a.points[e.nodes[part, side]])
    # loads (force and moment in the member's axes) of the part beyond on the part before
    first, last = (sections[member, place] for place in ("start", "end"))
    turned = [np.hstack([x[:, :3] @ Q.T, x[:, 3:6] @ Q.T]) for x in (first, last)]
    found = turned[1] - turned[0]
    found[:, 3:] += np.cross(end - start, turned[1][:, :3])
    skip = slice(m + 6 + k, m + 6 + 2 * k)  # moments of weight on the displaced frame have a test of their own
    found[skip] = expected[skip] = 0.0
    scale = np.abs(turned[0]).max(axis=1, keepdims=True) + np.abs(expected).max(axis=1, keepdims=True) + 1.0
    assert np.abs(found - expected).max() < 1e-6 * scale.max()
    assert (np.abs(found - expected) / scale).max() < 1e-6


def test_the_ground_carries_what_acts_on_frames(cut: Any) -> None:
    """Reaction at the mudline and the sum of loads: water, tower, weight and inertia (F-29)."""
    loads, still, _ = cut
    p, k = loads.pieces, len(loads.below)
    R = loads.of_ground_and_water(still)
    m = 3 * len(p.low)
    bed = np.array([0.0, 0.0, -DEPTH])
    for n in (0, len(p.low) - 1):
        for i, push in enumerate(np.eye(3)):
            assert R[3 * n + i] == pytest.approx(
                [*-push, *-np.cross(p.place[n] - bed, push), *push, *np.cross(p.place[n], push)]
            )
    base = loads.assembly.points[-1] - bed
    assert R[m] == pytest.approx([-1.0, 0.0, 0.0, *-np.cross(base, [1.0, 0.0, 0.0]), *np.zeros(6)])
    # liquid in a closed leg has its weight; of that in a leg open to the bed what does not stand on the bed
    e, hole = loads.assembly.elements, np.pi / 4 * 1.14**2
    closed, opened = (np.linalg.norm(each) for each in ([5.5, 7, 24], [8.5, 0, 24]))
    up = 24.0 / opened
    inside = 1200.0 * hole * 18.0 * closed / 24.0 + RHO * hole * (opened * (1.0 - up**2) - 6.0 * up)
    assert R[-1, 2] == pytest.approx(G * ((e.steel + e.growth) @ e.length + inside))
    x = (loads.assembly.mass @ loads.below[0].reshape(-1)).reshape(-1, 6)
    assert R[m + 6, :3] == pytest.approx(x[:, :3].sum(0)) and len(R) == m + 7 + 2 * k


def test_tension_is_the_wall_force_less_the_pressures(cut: Any) -> None:
    """T = N + p_e A_e - p_i A_i of still water on full sections (F-42); only the constant part differs."""
    _, _, sections = cut
    hole, tube, grown = np.pi / 4 * np.array([1.14, 1.2, 1.4]) ** 2
    expected = {
        ("ad", "middle"): RHO * G * 18.0 * (grown - hole),
        ("bd", "middle"): RHO * G * 18.0 * grown - 1200.0 * G * 6.0 * hole,
        ("bd", "start"): RHO * G * 30.0 * tube - 1200.0 * G * 18.0 * hole,
        ("dc", "end"): RHO * G * 30.0 * tube,
        ("de", "end"): 0.0,
    }
    for section, pressure in expected.items():
        difference = sections[section][:, 6] - sections[section][:, 2]
        assert difference[:-1] == pytest.approx(0.0, abs=1e-9)
        assert difference[-1] == pytest.approx(pressure, rel=1e-9, abs=1e-6)


@pytest.mark.parametrize("flooded", [True, False])
@pytest.mark.parametrize("level", [0.0, 2.0])
def test_tension_has_the_level_of_the_run(level: float, flooded: bool) -> None:
    """A tube on the bed in water up to ``level`` carries its weight less that of the water it displaces."""
    joints = {"a": [0, 0, -25.0], "b": [0, 0, 2.0], "c": [0, 0, 10.0]}
    pole = frame(joints, "ab bc", other={name: {"flooded": flooded} for name in ("ab", "bc")})
    loads = rigid(pole).at_level(level)
    still = still_forces(loads.pieces, RHO, level, G)
    wet = still * (loads.pieces.high < level + 1e-6)[:, None]
    asked = [channel for channel in loads.channels if channel.name == "member_ab_start_tension"]
    basis = np.concatenate([wet.reshape(-1), np.zeros(6 + 12), [1.0]])
    hole, tube = np.pi / 4 * np.array([1.14, 1.2]) ** 2
    steel = 7850.0 * (tube - hole) * 35.0
    displaced = RHO * (tube - flooded * hole) * (25.0 + level)
    assert (basis @ loads.of_members(asked, still))[0] == pytest.approx(-G * (steel - displaced), rel=1e-9)


def part_on(description: Frame, gravity: float = G) -> FramePart:
    """The part of a turbine on a frame; its tower ends at the frame's interface."""
    turbine = load_turbine("nrel5mw")
    base = float(description.joints[description.interface[0]][2])
    tower = turbine.tower.replace(base_height=base)
    counts = {"fore_aft": 1, "side_side": 1, "torsion": 0}
    layout = points(np.linspace(0.0, tower.length, 21))
    member = supported_tower(description, tower, counts, 3e5 * np.eye(6), None, layout, gravity=gravity)
    return part_of(SimpleNamespace(frame=description, tower=tower), None, SimpleNamespace(tower=member))


def test_the_weight_of_a_frame_is_that_of_the_site() -> None:
    one, half, none = (part_on(tripod(), gravity) for gravity in (G, 0.5 * G, 0.0))
    for name in ("frame_still", "frame_force"):
        assert np.abs(one.constants[name]).max() > 100.0
        np.testing.assert_allclose(half.constants[name], 0.5 * one.constants[name], rtol=1e-6)
        assert not none.constants[name].any()
    assert len(one.loads.below) == 2 and one.loads.gravity == G


def test_ends_of_members_that_act_like_plates_are_noticed() -> None:
    assert part_on(tripod()).notices(()) == []
    (words,) = part_on(tripod(ends=EndCoefficients(drag=1.0))).notices(())
    assert words.startswith("frame.ends: at 1 joints where members meet, d the first of them, drag and added mass")


def test_vertical_loads_of_the_water_are_channels_of_frames() -> None:
    names = {channel.name for channel in part_on(tripod()).channels()}
    assert {"sea_force_x", "sea_force_z", "sea_moment_z"} < names
    with pytest.raises(InputError, match="no channel 'sea_force_z': only a turbine on a frame in the sea has it"):
        find("sea_force_z", catalogue())


def test_weight_on_the_displaced_frame_turns_with_it() -> None:
    """A column with liquid inside that leans by rotation about its foot: minus weight times displacement (F-28)."""
    column = frame(
        {"a": [0, 0, -30], "b": [0, 0, 0]}, other={"ab": {"filled_to": 0.0}}, masses=[JointMass(joint="b", mass=2e4)]
    )
    assembly = assemble(column)
    arms = assembly.points - assembly.points[0]
    below = transfer(arms).transpose(2, 0, 1)
    loads = Loads(assembly, pieces(assembly), below, G)
    R = loads.of_ground_and_water(np.zeros((len(loads.pieces.low), 3)))
    steel = float(assembly.elements.steel[0])
    liquid = RHO * np.pi / 4 * 1.14**2  # rests on the foot, which does not move
    by_tilt = R[3 * len(loads.pieces.low) + 12 + 4, 4]  # of the second half of the coordinates, rotation about y
    assert by_tilt == pytest.approx(-G * (steel * 30.0**2 / 2.0 + 2e4 * 30.0), rel=1e-6)
    assert R[-1, 2] == pytest.approx(G * (30.0 * (steel + liquid) + 2e4))


# options ------------------------------------------------------------------------------------------


def summary(description: Frame) -> dict[str, Any]:
    """What the options of a frame change: mass, constant loads, drag, added mass, forces of a wave, still water."""
    loads, found = rigid(description), waves(description, WAVE)
    p, (nodes, ends) = loads.pieces, loads.constant
    return {
        "mass": loads.assembly.mass.sum(),
        "weight": nodes[:, 2].sum() + ends[..., 2].sum(),
        "drag": p.drag.sum(),
        "plate": p.plate.sum(),
        "added": p.added.sum() + p.along.sum(),
        "wave": np.abs(found["total"][:, 0]).max(),
        "still": still_forces(p, RHO, 0.0, G)[:, 2].sum(),
        "pieces": len(p.low),
    }


def members(**changes: Any) -> Callable[[Frame], dict[str, Any]]:
    return lambda f: {"members": {n: m.replace(**changes) for n, m in f.members.items()}}


CHANGES: dict[str, tuple[Any, str]] = {
    "growth": ({"growth": ()}, "mass weight drag added wave still"),
    "flooded": (members(flooded=False), "mass weight"),
    "filled_to": (members(filled_to=-20.0, flooded=False), "mass weight"),
    "fill_density": (members(fill_density=1100.0), "mass weight"),
    "pressure on ends": ({"ends": EndCoefficients(pressure=0.0)}, "wave"),
    "drag on ends": ({"ends": EndCoefficients(drag=1.0)}, "plate"),
    "added mass of ends": ({"ends": EndCoefficients(added_mass=1.0)}, "added wave"),
    "ends of a joint": ({"other_ends": {"d": EndCoefficients(drag=1.0, added_mass=1.0)}}, "plate added wave"),
    "piece": ({"piece": 2.0}, "pieces wave"),
    "drag": ({"hydrodynamics": Coefficients(drag=0.7)}, "drag"),
    "drag under growth": ({"hydrodynamics": Coefficients(grown_drag=2.0)}, "drag"),
    "added mass under growth": ({"hydrodynamics": Coefficients(grown_added_mass=2.0)}, "added wave"),
    "pressure under growth": ({"hydrodynamics": Coefficients(grown_pressure=2.0)}, "wave"),
    "diffraction": ({"hydrodynamics": Coefficients(diffraction="maccamy_fuchs")}, "wave"),
    "coefficients of members": (
        lambda f: {"other_hydrodynamics": {"x": Coefficients(drag=2.0)}} | members(hydrodynamics="x")(f),
        "drag",
    ),
    "potential flow": (members(potential_flow=True), "added wave still"),
    "divisions": ({"divisions": 5}, ""),
}


@pytest.mark.parametrize("option", CHANGES)
def test_an_option_changes_what_it_is_about(option: str) -> None:
    change, what = CHANGES[option]
    plain = tripod()
    before, after = summary(plain), summary(plain.replace(**(change(plain) if callable(change) else change)))
    changed = {name for name in before if abs(after[name] - before[name]) > 1e-6 * abs(before[name])}
    assert changed >= set(what.split())
    loads = {"mass", "weight", "drag", "plate", "added", "still"}
    if option != "divisions":
        assert changed & loads <= set(what.split())


# a frame of one leg -------------------------------------------------------------------------------

RUN = ("sea_force_x", "sea_force_y", "sea_moment_y", "mudline_reaction_force_x", "mudline_reaction_force_z",
       "mudline_reaction_moment_y", "tower_base_moment_fore_aft", "wave_elevation")  # fmt: skip
MOVING = ("mudline_reaction_force_x", "mudline_reaction_moment_y", "tower_base_moment_fore_aft", "tower_top_fore_aft")


@pytest.fixture(scope="module")
def twins() -> dict[bool, tuple[Any, Any]]:
    """The library's monopile, and the same as a frame of a single leg; the tower rigid or not."""
    turbine = load_turbine("nrel5mw-monopile")
    leg = Frame(
        depth=20.0,
        joints={"a": [0, 0, -20], "b": [0, 0, 0], "c": [0, 0, 10]},
        sections={"pile": Section(diameter=6.0, thickness=0.06, density=8500.0)},
        members={n: Member(joints=(n[0], n[1]), section="pile", flooded=True) for n in ("ab", "bc")},
        feet=[Foot(joint="a")],
        interface=["c"],
        divisions=8,
        damping=0.01,
        piece=1.0,
    )
    locked = ("generator", "drivetrain", "yaw")
    both = {}
    for rigid_tower, more in ((True, ("tower", "blades")), (False, ())):
        options = ModelOptions(blade_nodes=5, tower_nodes=9, time_step=0.0125, locked=(*locked, *more))
        turbines = (turbine, turbine.replace(support=None, frame=leg))
        one, other = (build(t, options).with_parameters(**{"aerodynamics.air_density": 0.0}) for t in turbines)
        both[rigid_tower] = one, other
    return both


SEAS = {
    "regular": (RegularSea(height=4.0, period=9.0, stretching="none"), 2e-4),
    "stretched": (RegularSea(height=4.0, period=9.0, stretching="wheeler", direction=0.5), 1e-3),
    "current": (StillWater(current=Current(uniform=1.5, direction=-0.7)), 1e-6),
    "irregular": (IrregularSea(height=2.0, period=7.0, level=1.0, current=Current(sub_surface=1.0)), 8e-3),
}


@pytest.mark.parametrize("name", SEAS)
def test_a_frame_of_one_leg_is_a_monopile(twins: dict[bool, tuple[Any, Any]], name: str) -> None:
    """At rest within 1e-3, with a level that is not at the edge of a piece 8e-3; in motion it has the same modes."""
    sea, bound = SEAS[name]
    run: dict[str, Any] = {
        "duration": 18.0,
        "sea": sea,
        "controller": ConstantController(),
        "start": Start(),
        "output_step": 0.1,
    }
    one, other = (simulate(model, 0.1, channels=RUN, **run) for model in twins[True])
    for channel in RUN:
        assert np.abs(other[channel] - one[channel]).max() <= bound * np.abs(one[channel]).max(), channel
    if name in ("regular", "current"):
        one, other = (simulate(model, 0.1, channels=MOVING, **run) for model in twins[False])
        for channel in MOVING:
            assert np.abs(other[channel] - one[channel]).max() < 2e-3 * np.abs(one[channel]).max(), channel
