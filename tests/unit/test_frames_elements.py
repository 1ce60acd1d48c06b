"""Finite elements, reduction and recovery of frames against closed forms."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
import scipy.linalg

from meltemi import InputError, UnsupportedError, load_turbine
from meltemi.frames.definition import Foot, Frame, JointMass, Member, Releases, Section
from meltemi.frames.finite_elements import Assembly, assemble, geometric_stiffness, member_axes
from meltemi.frames.recovery import recovery
from meltemi.frames.reduction import frequencies, reduced, supported_tower, tower_base, weight_stiffness
from meltemi.frames.sections import properties
from meltemi.sea.pile_beam import pile_beam, pile_head, soil_springs
from meltemi.sea.soil import Sand, Soil
from meltemi.sea.support import Support
from meltemi.structure.beam import transfer
from meltemi.structure.members import points, rigid_body, tower_member

TUBE = Section(diameter=1.0, thickness=0.025, density=7860.0)


def frame(joints: dict[str, Any], members: Sequence[str], feet: str = "", interface: str = "", **more: Any) -> Frame:
    """A frame of tubes between joints with names of one letter."""
    beams = {name: Member(joints=(name[0], name[1]), section="tube") for name in members}
    return Frame(
        depth=50.0,
        joints=joints,
        sections={"tube": TUBE} | more.pop("sections", {}),
        members=beams | more.pop("other", {}),
        feet=[Foot(joint=joint) for joint in feet],
        interface=tuple(interface or members[-1][1]),
        **more,
    )


def moved(assembly: Assembly, loads: Any) -> Any:
    """(n, 6) displacements of nodes under static loads (n, 6) on them."""
    T = assembly.transformation
    return (T @ assembly.solver().solve(T.T @ loads.reshape(-1))).reshape(-1, 6)


def at_joint(assembly: Assembly, joint: str, load: Sequence[float]) -> Any:
    loads = np.zeros((len(assembly.points), 6))
    loads[assembly.joint_nodes[joint]] = load
    return loads


CANTILEVER = frame({"a": [0, 0, -10], "b": [0, 0, 0]}, ["ab"], feet="a")


def test_a_cantilever_bends_and_shears() -> None:
    found = moved(assemble(CANTILEVER), at_joint(assemble(CANTILEVER), "b", [2e6, 0, 0, 0, 0, 0]))
    p = properties(TUBE, TUBE, 0.5)
    assert found[-1, 0] == pytest.approx(
        2e6 * (10**3 / (3 * 210e9 * p.inertia_x) + 10 / (80.8e9 * p.shear_x)), rel=1e-12
    )
    # SubDyn's test case SD_2Beam_Cantilever of OpenFAST/r-test
    assert found[[2, 1], 0] == pytest.approx([0.112182, 0.355108], rel=3e-6)


@pytest.mark.parametrize(("divisions", "first"), [(2, 9.8155), (16, 9.8073)])
def test_the_frequency_of_a_cantilever(divisions: int, first: float) -> None:
    hertz = frequencies(assemble(CANTILEVER.replace(divisions=divisions)), 2) / (2 * np.pi)
    assert hertz == pytest.approx([first, first], rel=1e-5)


def test_sections_of_thin_walls_and_solid_ones() -> None:
    nu = 210.0 / (2 * 80.8) - 1
    solid, thin = Section(diameter=1.0), Section(diameter=1.0, thickness=0.002)
    rod, pipe = properties(solid, solid, 0.0), properties(thin, thin, 0.0)
    assert rod.area == pytest.approx(np.pi / 4) and rod.hole == 0.0
    # Cowper (1966): thin tubes 2(1 + nu)/(4 + 3 nu), which Steinboeck's agrees with to a few per cent
    assert pipe.shear_x / pipe.area == pytest.approx(2 * (1 + nu) / (4 + 3 * nu), rel=0.06)
    assert pipe.torsion == pytest.approx(np.pi / 4 * 0.998**3 * 0.002, rel=1e-4)
    bar = Section(kind="rectangle", width=0.2, height=0.6)
    p = properties(bar, bar, 0.0)
    assert p.shear_x == p.shear_y == pytest.approx(0.12 * 10 * (1 + nu) / (12 + 11 * nu))
    assert (p.inertia_x, p.inertia_y) == pytest.approx((0.2 * 0.6**3 / 12, 0.6 * 0.2**3 / 12))
    assert p.torsion == pytest.approx(0.263 * 0.6 * 0.2**3, rel=2e-3)  # Timoshenko and Goodier, b/a = 3
    box = Section(kind="rectangle", width=1.0, height=2.0, thickness=0.01)
    p = properties(box, box, 0.0)
    assert p.torsion == pytest.approx(4 * (0.99 * 1.99) ** 2 * 0.01 / (2 * (0.99 + 1.99)), rel=1e-6)
    # shear is carried by the walls along it, two of 2 m along y
    assert p.shear_y / (2 * 2.0 * 0.01) == pytest.approx(0.9, abs=0.12) and p.shear_x < p.shear_y


def test_a_cone_has_the_mean_of_each_element() -> None:
    wide = Section(diameter=2.0, thickness=0.05)
    p = properties(TUBE, wide, 0.25)
    assert p.breadth == 1.25 and p.hole == pytest.approx(np.pi / 4 * (1.25 - 2 * 0.03125) ** 2)
    cone = frame(
        {"a": [0, 0, -10], "b": [0, 0, 0]},
        [],
        feet="a",
        interface="b",
        sections={"wide": wide},
        divisions=2,
        other={"m": Member(joints=("a", "b"), section="tube", end_section="wide")},
    )
    halves = assemble(cone).elements.properties
    assert [each.breadth for each in halves if each] == [1.25, 1.75]


def test_axes_of_members_are_horizontal_in_x() -> None:
    assert member_axes(np.array([0.0, 0.0, 2.0])) == pytest.approx(np.eye(3))
    assert member_axes(np.array([0.0, 0.0, -2.0])) == pytest.approx(np.diag([1.0, -1.0, -1.0]))
    d = np.array([3.0, 4.0, 5.0])
    axes, across, length = member_axes(d), 5.0, np.sqrt(50.0)
    assert axes[:, 0] == pytest.approx([4 / 5, -3 / 5, 0])
    assert axes[:, 1] == pytest.approx(np.array([15.0, 20.0, -25.0]) / (across * length))
    assert member_axes(d, 0.5 * np.pi)[:, 0] == pytest.approx(axes[:, 1])


PORTAL = frame(
    {"a": [0, 0, -10], "b": [0, 0, 0], "c": [8, 0, 0], "d": [8, 0, -10]},
    ["ab", "bc", "dc"],
    feet="ad",
    interface="b",
    divisions=4,
    sections={"tube": Section(diameter=0.8, thickness=0.02, shear_modulus=210e9 / 2.6)},
)


def test_a_portal_sways() -> None:
    assembly = assemble(PORTAL)
    loads = at_joint(assembly, "b", [1e5, 0, 0, 0, 0, 0])
    assert moved(assembly, loads)[1, 0] == pytest.approx(7.649e-3, rel=1e-4)
    found = recovery(assembly, [("ab", 0.0), ("dc", 0.0)]).loads(loads).reshape(-1, 6)
    # bending alone: 279.41 kN m and 55.15 kN (Kleinlogel)
    assert found[0, 4] == pytest.approx(282.84e3, rel=1e-4) and found[0, 2] == pytest.approx(54.44e3, rel=1e-4)
    assert found[2:, :3].sum(axis=0) == pytest.approx([-1e5, 0, 0], abs=1e-3)
    hertz = frequencies(assembly, 3) / (2 * np.pi)
    assert hertz == pytest.approx([4.861, 7.718, 10.943], rel=1e-4)


def test_a_tetrahedron() -> None:
    feet = {
        name: [6 * np.cos(t), 6 * np.sin(t), -8]
        for name, t in zip("abc", (0, 2 * np.pi / 3, 4 * np.pi / 3), strict=True)
    }
    three = frame(
        feet | {"t": [0, 0, 0]},
        ["at", "bt", "ct"],
        feet="abc",
        sections={"tube": Section(diameter=0.2, thickness=0.01, shear_modulus=210e9 / 2.6)},
    )
    assembly = assemble(three)
    r = reduced(assembly, 6)
    expected = [6.78557e7, 2.40744e8, -8.1449e5, 5.80519e6, 3.28290e6]
    assert r.stiffness[[0, 2, 0, 4, 5], [0, 2, 4, 4, 5]] == pytest.approx(expected, rel=1e-5)
    # as a truss, 3 EA/l of the axes' directions
    p = properties(three.sections["tube"], three.sections["tube"], 0.0)
    assert r.stiffness[2, 2] == pytest.approx(3 * 210e9 * p.area / 10 * 0.64, rel=1e-3)
    assert -assembly.nodal(assembly.weight)[:, 2].sum() == pytest.approx(1405.706, rel=1e-6)
    assert r.mass[0, 0] == pytest.approx(512.433, rel=1e-5)
    assert r.frequency / (2 * np.pi) == pytest.approx([12.516] * 6, rel=1e-4)
    assert frequencies(assembly, 3) / (2 * np.pi) == pytest.approx([8.660, 8.660, 9.259], rel=1e-4)
    assert frequencies(assembly, 6, fixed=True) / (2 * np.pi) == pytest.approx([12.516] * 6, rel=1e-4)


BRANCHES = {"a": [0, 0, -10], "b": [0, 3, -5], "c": [4, 0, -6], "d": [1, 1, 0], "e": [2, 6, -3], "f": [2, 6, -1]}
TREE = ["ab", "bc", "bd", "cd", "be", "ef"]


def test_a_free_frame_moves_as_a_rigid_body() -> None:
    masses = [JointMass(joint="e", mass=1e4, centre=[1, 2, 3], inertia=[5e4, 6e4, 7e4, 100, 200, 300])]
    free = frame(
        BRANCHES,
        TREE,
        interface="d",
        masses=masses,
        other={"link": Member(joints=("c", "f"), section="-", kind="rigid", line_mass=50.0)},
    )
    assembly = assemble(free)
    r = reduced(assembly, 4)
    arms = transfer(assembly.points - assembly.points[-1])
    assert r.static.transpose(1, 2, 0) == pytest.approx(arms, abs=1e-9)
    assert np.abs(r.stiffness).max() < 1e-9 * assembly.free.diagonal().max()
    total = 1e4 + sum(e * length for e, length in zip(assembly.elements.steel, assembly.elements.length, strict=True))
    assert r.mass[:3, :3] == pytest.approx(total * np.eye(3), rel=1e-9, abs=1e-6)
    weight = assembly.nodal(assembly.weight) + assembly.joint_weight
    assert -weight[:, 2].sum() == pytest.approx(total)
    moment = np.einsum("nij,nj->i", arms.transpose(0, 2, 1), weight)
    assert r.mass[3:6, 2] == pytest.approx(-moment[3:], rel=1e-9, abs=1e-6)


def test_the_base_is_where_it_is_asked_for() -> None:
    standing = frame(BRANCHES, TREE, feet="ac", interface="d")
    here, there = assemble(standing), assemble(standing, np.array([2.0, -1.0, 3.0]))
    arm = transfer(there.points[-1] - here.points[-1])
    a, b = reduced(here, 0), reduced(there, 0)
    for x, y in ((a.stiffness, b.stiffness), (a.mass, b.mass)):
        assert x == pytest.approx(x.T, rel=1e-9, abs=1e-9 * x.max())
        assert x == pytest.approx(arm.T @ y @ arm, rel=1e-9, abs=1e-9 * x.max())


def test_springs_between_beams() -> None:
    """Two cantilevers with a soft spring between, as SubDyn's SD_2Beam_Spring."""
    k = np.diag([2e7, 1e12, 1e12, 1e12, 1e12, 1e12])
    two = frame(
        {"a": [0, 0, -10], "b": [0, 0, -5], "c": [0, 0, -5], "d": [0, 0, 0]},
        ["ab", "cd"],
        feet="a",
        interface="d",
        other={"s": Member(joints=("b", "c"), section="-", kind="spring", stiffness=k)},
    )
    assembly = assemble(two)
    loads = at_joint(assembly, "d", [2e6, 0, 0, 0, 0, 0])
    found = moved(assembly, loads)
    assert found[[1, 2], 0] == pytest.approx([0.11218, 0.21218], rel=5e-5)
    assert recovery(assembly, [("s", 0.0)]).loads(loads)[:6] == pytest.approx([2e6, 0, 0, 0, 1e7, 0], abs=1.0)


HINGED = {"a": [-10, 0, -5], "b": [0, 0, -5], "c": [10, 0, -5], "d": [-10, 0, 0]}
"""A beam along x between two clamped feet, of two members; the tower stands elsewhere."""
SPAN = properties(TUBE, TUBE, 0.0)
BENDING, SHEAR, TORSION = 210e9 * SPAN.inertia_x, 80.8e9 * SPAN.shear_x, 80.8e9 * SPAN.torsion


@pytest.mark.parametrize(
    ("release", "free"),
    [
        (Releases(kind="pin", axis=[0, 1, 0]), "y"),
        (Releases(kind="pin", axis=[0, 0, 2]), "z"),
        (Releases(kind="universal", axis=[1, 0, 0]), "yz"),
        (Releases(kind="ball"), "xyz"),
    ],
)
def test_released_joints_transfer_the_other_moments(release: Releases, free: str) -> None:
    assembly = assemble(frame(HINGED, ["ad", "ab", "bc"], feet="ac", interface="d", releases={"b": release}))
    loads = at_joint(assembly, "b", [0, 1e4, 1e4, 1e5, 0, 0])
    found, L = moved(assembly, loads)[1], 10.0
    hinged, clamped = (0.5e4 * (L**3 / (n * BENDING) + L / SHEAR) for n in (3, 12))
    assert found[2] == pytest.approx(hinged if "y" in free else clamped, rel=1e-9)
    assert found[1] == pytest.approx(hinged if "z" in free else clamped, rel=1e-9)
    assert found[3] == pytest.approx(1e5 * L / TORSION * (1.0 if "x" in free else 0.5), rel=1e-9)
    end = recovery(assembly, [("bc", 0.0)]).loads(loads)[3:6]  # member axes of bc: x is -y, y is -z, z is x
    moments = dict(zip("yzx", end, strict=True))
    for axis, moment in moments.items():
        assert (abs(moment) < 1e-3) == (axis in free)


def test_a_pin_with_a_spring() -> None:
    k, L, P = 3e8, 10.0, 1e4
    release = Releases(kind="pin", axis=[0, 1, 0], stiffness=k)
    assembly = assemble(frame(HINGED, ["ad", "ab", "bc"], feet="ac", interface="d", releases={"b": release}))
    slope = P * L**2 / (4 * BENDING) / (1 + 2 * k * L / BENDING)
    sag = P / 2 * (L**3 / (3 * BENDING) + L / SHEAR) - 2 * k * slope * L**2 / (2 * BENDING)
    assert moved(assembly, at_joint(assembly, "b", [0, 0, P, 0, 0, 0]))[1, 2] == pytest.approx(sag, rel=1e-9)


def test_chains_of_rigid_links() -> None:
    links = {
        name: Member(joints=(name[0], name[1]), section="-", kind="rigid", line_mass=10.0) for name in ("bc", "cd")
    }
    joints = {"a": [0, 0, -10], "b": [0, 0, -2], "c": [3, 0, -2], "d": [3, 4, -1], "e": [0, 0, 0]}
    assembly = assemble(frame(joints, ["ab", "be"], feet="a", interface="e", other=links))
    force = np.array([1e4, 2e4, 3e4, 1e3, 2e3, 3e3])
    arm = transfer(np.array([3.0, 4.0, 1.0]))
    far, near = (moved(assembly, at_joint(assembly, *load)) for load in (("d", force), ("b", arm.T @ force)))
    assert far == pytest.approx(near, rel=1e-9, abs=1e-12)
    assert far[3] == pytest.approx(arm @ far[1])
    assert -assembly.nodal(assembly.weight)[2:4, 2].sum() == pytest.approx(10.0 * (1.5 + 0.5 * 17**0.5 * 2))
    stiff = links | {name: Member(joints=(name[0], name[1]), section="-", kind="rigid") for name in ("ac", "de")}
    with pytest.raises(InputError, match="connect the foot 'a' with the interface; use a beam"):
        assemble(frame(joints, ["ab"], feet="a", interface="e", other=stiff))


def test_cables_have_their_pretension() -> None:
    """A mast between two cables, one of which is tighter; closed form of equal springs."""
    joints = {"a": [0, 0, -10], "b": [0, 0, 0], "c": [-10, 0, -10], "d": [10, 0, -10]}
    stays = {
        name: Member(
            joints=(name[0], "b"), section="-", kind="cable", axial_stiffness=1e9, pretension=t, line_mass=20.0
        )
        for name, t in (("cb", 2e6), ("db", 1e6))
    }
    assembly = assemble(frame(joints, ["ab"], feet="acd", interface="b", other=stays))
    loads = assembly.nodal(assembly.pretension)
    sideways = moved(assembly, loads)[assembly.joint_nodes["b"], 0]
    length = 10 * 2**0.5
    stiffness = [1e9 / length * (1 + t / 1e9) for t in (2e6, 1e6)]
    mast = 1.0 / (10**3 / (3 * BENDING) + 10 / SHEAR)
    lateral = 0.5 * sum(stiffness) + mast
    # the difference of the cables also pushes the mast down, by which they slacken unequally: below 1e-3
    assert sideways == pytest.approx(-1e6 * 0.5**0.5 / lateral, rel=1e-3)
    tension = recovery(assembly, [("cb", 0.5), ("db", 0.0)]).loads(loads, assembly.pretension).reshape(-1, 6)[:2, 2]
    down = moved(assembly, loads)[assembly.joint_nodes["b"], 2]
    stretch = [0.5**0.5 * (sideways + down), 0.5**0.5 * (-sideways + down)]
    assert tension == pytest.approx([2e6 + stiffness[0] * stretch[0], 1e6 + stiffness[1] * stretch[1]], rel=1e-9)


def test_water_inside_and_growth_move_with_the_member() -> None:
    wet = CANTILEVER.replace(
        joints={"a": [0, 0, -10], "b": [0, 0, 10]},
        members={"ab": Member(joints=("a", "b"), section="tube", flooded=True)},
        growth=[{"bottom": -40.0, "top": -4.0, "thickness": 0.1, "density": 1100.0}],
        divisions=4,
    )
    e = assemble(wet).elements
    assert e.fill == pytest.approx(1025 * np.pi / 4 * 0.95**2 * np.array([1, 1, 0, 0]))
    assert e.growth == pytest.approx(1100 * np.pi * 1.1 * 0.1 * np.array([1, 0.2, 0, 0]))
    axial, lateral = (e.mass[:, i, j] + e.mass[:, i, i] for i, j in ((2, 8), (0, 6)))
    total = (e.steel + e.fill + e.growth) * 5.0
    assert axial == pytest.approx(total / 2) and lateral == pytest.approx(total / 2, rel=0.02)
    partly = wet.replace(members={"ab": Member(joints=("a", "b"), section="tube", filled_to=-7.0, fill_density=2000.0)})
    assert assemble(partly).elements.fill == pytest.approx(2000 * np.pi / 4 * 0.95**2 * np.array([0.6, 0, 0, 0]))


# section loads ----------------------------------------------------------------------------------


def test_section_loads_under_uniform_load_are_exact() -> None:
    assembly, q, L = assemble(CANTILEVER.replace(divisions=3)), 1e3, 10.0
    ends = assembly.line_loads(np.tile([q, 0.0, 0.0], (3, 1)))
    x = np.array([0.0, 0.2, 0.5, 2 / 3, 1.0])
    found = recovery(assembly, [("ab", each) for each in x]).loads(assembly.nodal(ends), ends).reshape(-1, 6)
    assert found[:-1, 0] == pytest.approx(q * L * (1 - x), abs=1e-6)
    assert found[:-1, 4] == pytest.approx(q * L**2 / 2 * (1 - x) ** 2, abs=1e-5)
    assert found[-1] == pytest.approx([-q * L, 0, 0, 0, -q * L**2 / 2, 0], abs=1e-5)


def test_weight_is_in_equilibrium_at_every_joint() -> None:
    assembly = assemble(frame(BRANCHES, TREE, feet="ac", interface="d"))
    nodes = assembly.nodal(assembly.weight)
    nodes[-1] = [1e5, 2e4, -3e5, 1e6, 2e6, 3e5]
    r = recovery(assembly, [(member, x) for member in TREE for x in (0.0, 1.0)])
    found = r.loads(nodes, assembly.weight)
    sections, feet = found[: 12 * len(TREE)].reshape(-1, 2, 6), found[12 * len(TREE) :].reshape(-1, 6)
    for joint, name in zip((1, 4), "be", strict=True):
        total = np.zeros(6)
        for member, (start, end) in zip(TREE, sections, strict=True):
            first = assembly.elements.member.tolist().index(assembly.members.index(member))
            Q = scipy.linalg.block_diag(*2 * [assembly.elements.axes[first]])
            total += Q @ start * (member[0] == name) - Q @ end * (member[1] == name)
        assert joint == assembly.joint_nodes[name] and total == pytest.approx(0.0, abs=1e-6)
    arms = transfer(assembly.points).transpose(0, 2, 1)
    applied = np.einsum("nij,nj->i", arms, nodes)
    ground = sum(arms[assembly.joint_nodes[name]] @ load for name, load in zip(r.feet, feet, strict=True))
    assert applied + ground == pytest.approx(0.0, abs=1e-5)
    assert r.loads(nodes)[12 * len(TREE) :] == pytest.approx(feet.reshape(-1))
    assert r.interface == pytest.approx(r.nodal[:, -6:])


def test_recovery_of_a_vibration_gives_the_elements_forces() -> None:
    assembly = assemble(frame(BRANCHES, TREE, feet="ac", interface="d", masses=[JointMass(joint="f", mass=5e3)]))
    T, w2 = assembly.transformation, (2 * np.pi * 3.0) ** 2
    push = at_joint(assembly, "e", [1e5, 2e5, 3e5, 0, 0, 0])
    u = T @ np.linalg.solve((assembly.free - w2 * T.T @ assembly.mass @ T).toarray(), T.T @ push.reshape(-1))
    u = u.reshape(-1, 6)
    ends = w2 * assembly.inertia(u)
    nodes = push + (w2 * assembly.mass @ u.reshape(-1)).reshape(-1, 6)
    r = recovery(assembly, [(member, x) for member in TREE for x in (0.0, 0.5, 1.0)])
    e = assembly.elements
    forces = np.einsum("eij,ej->ei", e.stiffness, u[e.nodes].reshape(-1, 12)) - ends.reshape(-1, 12)
    direct = np.einsum("sij,sj->si", r.cut, forces[r.element])
    assert r.loads(nodes, ends)[: direct.size] == pytest.approx(direct.reshape(-1), rel=1e-8, abs=1e-3)


def test_reactions_of_feet_on_springs() -> None:
    ground = np.diag([1e8, 2e8, 3e8, 4e9, 5e9, 6e9])
    joints = PORTAL.joints
    soft = PORTAL.replace(feet=[Foot(joint="a"), Foot(joint="d", stiffness=ground)])
    assembly = assemble(soft)
    loads = at_joint(assembly, "b", [1e5, 0, -2e5, 0, 0, 0])
    r = recovery(assembly, [])
    a, d = r.loads(loads).reshape(-1, 6)
    assert r.feet == ("a", "d")
    assert d == pytest.approx(-ground @ moved(assembly, loads)[assembly.joint_nodes["d"]])
    assert a[:3] + d[:3] == pytest.approx([-1e5, 0, 2e5], abs=1e-4)
    about_a = a[3:] + d[3:] + np.cross(joints["d"] - joints["a"], d[:3])
    assert about_a == pytest.approx([0, -1e6, 0], abs=1e-3)
    with pytest.raises(InputError, match="no member 'abc' that deforms: did you mean 'ab'"):
        recovery(assembly, [("abc", 0.0)])


# stability, tower, soil -------------------------------------------------------------------------


def test_the_buckling_load_of_a_column() -> None:
    assembly = assemble(CANTILEVER.replace(divisions=8))
    down = at_joint(assembly, "b", [0, 0, -1, 0, 0, 0])
    T = assembly.transformation
    K, soft = assembly.free.toarray(), (T.T @ geometric_stiffness(assembly, down) @ T).toarray()
    least = 1.0 / np.max(scipy.linalg.eigvalsh(-soft, K))
    euler = np.pi**2 * BENDING / (4 * 10**2)
    assert least == pytest.approx(euler / (1 + euler / SHEAR), rel=2e-4)


def test_a_column_buckles_under_its_weight() -> None:
    """q L^3 / EI = 7.837 (Timoshenko and Gere); the water around carries what it displaces."""
    assembly = assemble(CANTILEVER.replace(divisions=20, joints={"a": [0, 0, 10], "b": [0, 0, 110]}))
    shapes = np.eye(assembly.free.shape[0])
    T = assembly.transformation
    nodes = (T @ shapes).T.reshape(len(shapes), -1, 6)
    least = 1.0 / np.max(scipy.linalg.eigvalsh(-weight_stiffness(assembly, nodes), assembly.free.toarray()))
    line = 7860.0 * SPAN.area
    assert least * line == pytest.approx(7.837 * BENDING / 100**3, rel=2e-3)
    deep = assemble(CANTILEVER.replace(divisions=20, joints={"a": [0, 0, -110], "b": [0, 0, -10]}, depth=200.0))
    light = weight_stiffness(deep, nodes)
    share = 1.0 - 1025.0 * np.pi / 4.0 / line
    assert light == pytest.approx(share * weight_stiffness(assembly, nodes), rel=1e-6, abs=1e-6 * np.abs(light).max())


def test_the_base_of_the_tower_lowers_as_the_column_bends() -> None:
    tower = load_turbine("nrel5mw-tripod").tower
    slender = frame({"a": [0, 0, -90], "b": [0, 0, 10]}, ["ab"], feet="a", interface="b", divisions=4)
    counts, tip = {"fore_aft": 1, "side_side": 1, "torsion": 0}, rigid_body(3.5e5, np.zeros(3), np.zeros((3, 3)))
    layout = points(np.linspace(0.0, tower.length, 9))
    member = supported_tower(slender, tower, counts, tip, None, layout, given=True)
    assert member.names == (
        "1st fore-aft",
        "1st side-side",
        *(f"frame {n}" for n in ("surge", "sway", "heave", "roll", "pitch", "yaw")),
    )
    assert member.below is not None and member.below[:, -1] == pytest.approx(member.modes.shape[:, 0])
    # - integral of the slope squared: of a guided column 6/5L by unit motion, 2L/15 by unit rotation
    lowering = member.second[:, :, 0, 2]
    assert np.diag(lowering)[[2, 3, 5, 6]] == pytest.approx([-6 / 500] * 2 + [-200 / 15] * 2, rel=1e-3)
    assert member.second[2, 2, -1, 2] == pytest.approx(lowering[2, 2])


def test_a_vertical_tube_is_a_monopile() -> None:
    turbine = load_turbine("nrel5mw-monopile")
    support = turbine.support
    assert support is not None
    pile = Section(diameter=6.0, thickness=0.06, density=8500.0)
    tube = Frame(
        depth=20.0,
        joints={"a": [0, 0, -20], "b": [0, 0, 0], "c": [0, 0, 10]},
        sections={"pile": pile},
        members={name: Member(joints=(name[0], name[1]), section="pile", flooded=True) for name in ("ab", "bc")},
        feet=[Foot(joint="a")],
        interface=["c"],
        divisions=8,
        damping=0.01,
    )
    counts = {"fore_aft": 2, "side_side": 2, "torsion": 0}
    layout = points(np.linspace(0.0, turbine.tower.length, 21))
    tip = rigid_body(3.5e5, np.array([-0.4, 0, 2.0]), np.diag([4e7, 2e7, 2e7]))
    from meltemi.sea.pile_beam import supported_tower as on_pile

    one = on_pile(support, turbine.tower, counts, tip, None, layout)
    other = supported_tower(tube, turbine.tower, counts, tip, None, layout)
    assert one.names == other.names
    assert other.modes.frequency == pytest.approx(one.modes.frequency, rel=1e-3)
    assert other.modes.frequency_alone == pytest.approx(one.modes.frequency_alone, rel=2e-3)
    assert np.diag(other.damping) == pytest.approx(np.diag(one.damping), rel=5e-3)
    # displacement of the top by weight on it
    top_one, top_other = (each.second[0, 0, -1, 2] for each in (one, other))
    assert top_other == pytest.approx(top_one, rel=5e-3)


def test_a_tower_on_a_frame_keeps_a_mode() -> None:
    turbine, none = load_turbine("nrel5mw"), {"fore_aft": 0, "side_side": 0, "torsion": 0}
    layout, tip = points(np.linspace(0.0, turbine.tower.length, 21)), 3e5 * np.eye(6)
    with pytest.raises(UnsupportedError, match=r"needs a mode; keep one, and hold it still by options\.locked"):
        supported_tower(CANTILEVER, turbine.tower, none, tip, None, layout)


def test_walls_moduli_and_growth_are_plausible() -> None:
    section = TUBE.replace(thickness=0.002, shear_modulus=2.1e11)
    growth = [{"bottom": -20.0, "top": 14.0, "thickness": 0.1}]
    strange = CANTILEVER.replace(sections={"tube": section}, growth=growth)
    thin, moduli, top = filter(None, strange.doubts(None))
    assert thin == "frame.sections.tube.thickness: diameter over it is 500; usual is 3 to 400"
    assert moduli.startswith("frame.sections.tube.elastic_modulus: it over shear_modulus is 1;")
    assert top.startswith("frame.growth.0: its top [m] is 14;")
    assert not any(CANTILEVER.doubts(None))


def test_a_pile_in_soil_is_its_head() -> None:
    soil = Soil(layers=[Sand(top=0.0, friction_angle=0.6, weight=1e4)], shear=2e6, moment=2e7, damping=0.05)
    pile = Section(diameter=2.0, thickness=0.04)
    foot = Foot(joint="a", soil=soil, pile_length=30.0, pile_section="pile")
    stands = CANTILEVER.replace(sections={"tube": TUBE, "pile": pile}, feet=[foot])
    assembly = assemble(stands)
    support = Support(
        depth=1.0, position=[-31.0, 1.0], diameter=[2.0, 2.0], thickness=[0.04, 0.04], soil=soil, flooded=None
    )
    stiffness, mass, springs = pile_head(support)
    assert assembly.sprung == ("a",) and assembly.ground.toarray()[:6, :6] == pytest.approx(stiffness)
    assert assembly.ground_damping.toarray()[:6, :6] == pytest.approx(0.1 * springs)
    assert 0.0 < springs[0, 0] < stiffness[0, 0]
    # the deflection under the load of the case is that of the secants
    deflection = np.linalg.solve(stiffness, [2e6, 0, 0, 0, 2e7, 0])
    z = soil_springs(support, soil)
    assert deflection[0] > 0 and z.stiffness.sum() > stiffness[0, 0]
    # along its axis it is a rod on a spring at its foot
    beam = pile_beam(support)
    rod = float(beam.stiffness[0, 2, 2]) / 30.0
    foot_share = rod / (rod + soil.axial_stiffness)
    assert stiffness[2, 2] == pytest.approx(rod * (1.0 - foot_share), rel=1e-9)
    assert mass[2, 2] == pytest.approx(float(beam.mass[0, 2, 2]) * 10.0 * (1 + foot_share + foot_share**2), rel=1e-6)


def test_mechanisms_are_named() -> None:
    loose = frame(
        {"a": [0, 0, -10], "b": [0, 0, -5], "c": [0, 0, 0]},
        ["ab", "bc"],
        feet="a",
        releases={"b": Releases(kind="pin", axis=[0, 1, 0])},
    )
    with pytest.raises(InputError, match=r"frame\.\w+\.\w+: the frame is a mechanism: it can (turn|move)"):
        assemble(loose).solver()
    assemble(loose.replace(releases={"b": Releases(kind="pin", axis=[0, 1, 0], stiffness=1e6)})).solver()
    afloat = frame(BRANCHES, TREE, interface="d")
    with pytest.raises(InputError, match="mechanism"):
        assemble(afloat).solver()
    assert assemble(afloat, clamp="c").clamped == ("c",) and assemble(afloat, clamp="c").solver()


def test_damping_of_frame_soil_and_interface() -> None:
    turbine = load_turbine("nrel5mw-jacket")
    counts, tip = (
        {"fore_aft": 1, "side_side": 1, "torsion": 0},
        rigid_body(3.5e5, np.array([-0.4, 0, 2.0]), np.zeros((3, 3))),
    )
    layout, frame_ = points(np.linspace(0.0, turbine.tower.length, 9)), turbine.frame
    assert frame_ is not None
    alone = tower_member(turbine.tower, counts, tip, None, layout)
    found = [
        supported_tower(f, turbine.tower, counts, tip, None, layout)
        for f in (frame_, frame_.replace(damping=0.0), frame_.replace(interface_damping=np.diag([1e6] * 6)))
    ]
    ratio = [m.damping[0, 0] / (2 * np.sqrt(m.modes.stiffness[0, 0] * m.modes.mass[0, 0])) for m in found]
    below = found[0].below
    assert below is not None and ratio[1] < ratio[0] < ratio[2]
    bent = below[0].reshape(-1)
    share = (
        bent @ (assemble(frame_, tower_base(frame_, turbine.tower)).stiffness @ bent) / found[0].modes.stiffness[0, 0]
    )
    assert 0.05 < share < 0.5 and ratio[0] - ratio[1] == pytest.approx(0.01 * share, rel=1e-3)
    base = found[0].modes.shape[0, 0]
    assert found[2].damping[0, 0] - found[0].damping[0, 0] == pytest.approx(1e6 * base @ base)
    assert alone.names == found[0].names
    assert tower_base(frame_, turbine.tower) == pytest.approx([0, 0, 20.15])
