"""Flexible floaters: free vibration, momentum, equilibrium, and the limit of a rigid frame."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.linalg
from numpy.typing import NDArray

from meltemi import InputError, load_turbine
from meltemi.compiler import View
from meltemi.environment import RegularSea, StillWater
from meltemi.floating.coefficients import read_coefficients, write_coefficients
from meltemi.floating.platform import Body, Platform
from meltemi.floating.potential import HydroCoefficients
from meltemi.frames.afloat import FALL, MODES, PLACE, TOWER, WATER, AfloatLoads, AfloatPart, in_waves
from meltemi.frames.definition import Coefficients, Frame, Member, Section
from meltemi.frames.finite_elements import assemble
from meltemi.frames.hull import (
    afloat,
    bodies_of,
    by_added_mass,
    by_water_plane,
    hull_spread,
    platform_inertia,
    rigid_inertia,
    rigid_motions,
)
from meltemi.frames.part import FrameWater
from meltemi.frames.recovery import recovery
from meltemi.frames.reduction import supported_tower
from meltemi.frames.water import pieces
from meltemi.sea.airy import GRAVITY
from meltemi.structure.beam import transfer
from meltemi.structure.members import ModalMember, points, rigid_body, tower_beam, tower_member
from meltemi.turbine.definition import Damping, Foundation, Tower

Float = NDArray[np.float64]
BASE = np.array([0.0, 0.0, 12.0])
COUNTS = {"fore_aft": 2, "side_side": 2, "torsion": 0}
AFLOAT = Foundation(motions=("surge", "sway", "heave", "roll", "pitch", "yaw"), stiffness=np.zeros((6, 6)))


def semi(stiffness: float = 1.0, added_mass: float = 1.0, tower: Tower | None = None, **more: Any) -> Frame:
    """Three columns and a main one on pontoons; with ``tower`` that of finite elements stands on it."""
    joints: dict[str, Any] = {"keel": [0.0, 0.0, -15.0], "water": [0.0, 0.0, 0.0], "base": BASE}
    members = {"lower": ("keel", "water", "column"), "upper": ("water", "base", "column")}
    for name, angle in (("A", np.pi), ("B", np.pi / 3), ("C", -np.pi / 3)):
        x, y = 40.0 * np.cos(angle), 40.0 * np.sin(angle)
        joints |= {f"{name}_keel": [x, y, -15.0], f"{name}_top": [x, y, 12.0]}
        members |= {
            f"pontoon_{name}": ("keel", f"{name}_keel", "pontoon"),
            f"column_{name}": (f"{name}_keel", f"{name}_top", "column"),
        }
    steel = {"elastic_modulus": 2.1e11 * stiffness, "shear_modulus": 8.08e10 * stiffness}
    sections = {
        "column": Section(diameter=9.0, thickness=0.04, **steel),
        "pontoon": Section(kind="rectangle", width=8.0, height=5.0, thickness=0.03, **steel),
    }
    interface = ("base",)
    if tower is not None:
        beam = tower_beam(tower)
        K, M = beam.stiffness[0], beam.mass[0]
        sections["tower"] = Section(
            kind="general", area=K[2, 2] / 2.1e11, shear_area_x=K[0, 0] / 8.08e10, shear_area_y=K[1, 1] / 8.08e10,
            inertia_x=K[3, 3] / 2.1e11, inertia_y=K[4, 4] / 2.1e11, torsion=K[5, 5] / 8.08e10,
            density=M[0, 0] / (K[2, 2] / 2.1e11), elastic_modulus=2.1e11, shear_modulus=8.08e10,
        )  # fmt: skip
        joints["top"] = [0.0, 0.0, BASE[2] + tower.length]
        members["tower"] = ("base", "top", "tower")
        interface = ("top",)
    return Frame(
        depth=100.0,
        joints=joints,
        sections=sections,
        members={
            name: Member(joints=(a, b), section=section, filled_to=-12.5 if section == "pontoon" else None)
            for name, (a, b, section) in members.items()
        },
        interface=interface,
        hydrodynamics=Coefficients(added_mass=added_mass),
        **{"divisions": 6, "ends": {"added_mass": added_mass}} | more,
    )


def a_tower() -> Tower:
    """A uniform tube that carries a top."""
    tube = {"mass": 4000.0, "fore_aft_stiffness": 6e11, "side_side_stiffness": 6e11, "diameter": 6.0}
    return Tower(
        base_height=float(BASE[2]),
        damping=Damping(fore_aft=0.005, side_side=0.005, torsion=0.005),
        position=np.array([0.0, 90.0]),
        torsion_stiffness=np.full(2, 4.6e11),
        axial_stiffness=np.full(2, 1.0e11),
        shear_stiffness=np.full(2, 1.0e10),
        **{name: np.full(2, value) for name, value in tube.items()},
    )


def platform_of(frame: Frame) -> Platform:
    """A platform that has exactly the mass of the frame, as far as three moments of inertia can say it."""
    J = rigid_inertia(assemble(frame, BASE, clamp="water"))
    mass, centre = J[0, 0], J[4, 0] / J[0, 0]
    about = np.diag(J)[3:] - mass * centre**2 * np.array([1.0, 1.0, 0.0])
    return Platform.model_construct(
        depth=100.0, mass=mass, centre=np.array([0.0, 0.0, centre]), inertia=about, lines=(), water_density=1025.0
    )


TIP = rigid_body(4e5, np.array([0.0, 0.0, 2.0]), np.zeros((3, 3)))


def member_of(frame: Frame, **given: Any) -> ModalMember:
    layout = points(np.linspace(0.0, 90.0, 31))
    return supported_tower(frame, a_tower(), COUNTS, TIP, AFLOAT, layout, platform=platform_of(frame), **given)


def free(member: ModalMember, frame: Frame) -> tuple[Float, Float]:
    """Stiffness and mass of all coordinates, as the equations of a floating turbine have them without water around."""
    n = len(member.names) - 6
    assert member.momenta is not None
    top = member.modes.shape[:, -1]
    M = member.modes.mass_alone + top @ TIP @ top.T
    M[n:, n:] = member.momenta[:, n:] + (top @ TIP @ top.T)[n:, n:]
    on_point = np.vstack([np.zeros((n, 6)), transfer(-BASE).T])
    M += on_point @ platform_inertia(platform_of(frame)) @ on_point.T
    return member.modes.stiffness, M


def test_free_vibration_is_that_of_all_finite_elements() -> None:
    """Lowest elastic frequencies against those of one mesh of frame and tower, which nothing holds, by SciPy."""
    frame = semi(added_mass=0.0)
    K, M = free(member_of(frame), frame)
    found = np.sqrt(scipy.linalg.eigvalsh(K, M)[6:]) / (2.0 * np.pi)
    # its last node, the tower's base of a frame, is a point without elements at the top of the tower here
    whole = assemble(semi(added_mass=0.0, tower=a_tower(), divisions=12), np.array([0.0, 0.0, 102.0]), clamp="water")
    K, M = whole.stiffness.toarray()[:-6, :-6], whole.mass.toarray()[:-6, :-6]
    top = 6 * whole.joint_nodes["top"] + np.arange(6)
    M[np.ix_(top, top)] += TIP
    square = scipy.linalg.eigvalsh(K, M)
    expected = np.sqrt(np.abs(square)) / (2.0 * np.pi)
    assert expected[5] < 1e-2 * expected[6]
    for one in found[:4]:
        assert np.abs(expected[6:] / one - 1.0).min() < 2e-3


def test_a_stiff_frame_is_a_rigid_platform() -> None:
    """First frequency of the tower on a platform with the same inertia; a soft frame lowers it, and its hull moves."""
    alone = tower_member(a_tower(), COUNTS, TIP, AFLOAT, points(np.linspace(0.0, 90.0, 31)))
    first = {}
    for stiffness in (1.0, 1e6):
        frame = semi(stiffness, added_mass=0.0)
        member = member_of(frame)
        first[stiffness] = scipy.linalg.eigvalsh(*free(member, frame))[6] ** 0.5
    rigid = scipy.linalg.eigvalsh(*free(alone, semi(added_mass=0.0)))[6] ** 0.5
    assert first[1e6] == pytest.approx(rigid, rel=1e-3)
    assert first[1.0] < 0.95 * rigid
    soft, stiff = (member_of(semi(stiffness)).hull for stiffness in (1.0, 1e6))
    assert soft is not None and stiff is not None
    assert np.abs(stiff).max() < 1e-4 < np.abs(soft).max()


def test_momenta_are_those_of_all_masses() -> None:
    """Momentum about the tower's base by unit rates of the modes, from the nodes of both meshes."""
    frame = semi()
    member, assembly = member_of(frame), afloat(frame, platform_of(frame), BASE)
    assert member.momenta is not None and member.below is not None
    n = len(member.below)
    of_frame = rigid_motions(assembly.points - BASE) @ (assembly.mass @ member.below.reshape(n, -1).T)
    z = member.modes.z
    linear = np.trapezoid(4000.0 * member.modes.shape[:n, :, :3], z, axis=1).T
    np.testing.assert_allclose(member.momenta[:3, :n] - of_frame[:3], linear, rtol=1e-3, atol=20.0)
    # the clamped joint does not move
    np.testing.assert_allclose(member.below[:, assembly.joint_nodes["water"]], 0.0, atol=1e-12)


def test_spread_loads_have_their_resultant() -> None:
    p = pieces(afloat(semi(), platform_of(semi()), BASE))
    for spread, motions in ((by_added_mass(p), range(6)), (by_water_plane(p), (2, 3, 4))):
        for k in motions:
            np.testing.assert_allclose(spread.resultant(spread.forces[:, :, k]), np.eye(6)[k], atol=1e-9)
        some = np.random.default_rng(1).normal(size=(len(p.low), 3))
        np.testing.assert_allclose(spread.resultant(spread.balanced(some))[list(motions)], 0.0, atol=1e-6)
    plane = by_water_plane(p).total
    area = 4.0 * np.pi * 4.5**2
    assert plane[2, 2] == pytest.approx(area, rel=1e-9)
    assert plane[4, 4] == pytest.approx(1.5 * 40.0**2 * area / 4.0, rel=1e-9)


def test_section_loads_balance_in_a_tilted_heaving_state() -> None:
    """Load of a pontoon's section from all beyond it: weight in tilted axes, inertia, water, lines, by their sums."""
    frame = semi()
    platform = platform_of(frame)
    assembly = afloat(frame, platform, BASE)
    member = member_of(frame)
    assert member.below is not None
    line = type("Line", (), {"fairlead": np.array([-44.5, 0.0, -10.0])})()
    moored = platform.model_copy(update={"lines": (line,)})
    loads = AfloatLoads(assembly, pieces(assembly), member.below, member.gravity, moored, 0.0)
    r = recovery(assembly, [("pontoon_A", 0.0)])
    B = loads.by_basis(r, 12, np.zeros((0, 3)))
    k, deep, random = len(member.below), loads.deep, np.random.default_rng(2)
    x = np.zeros(len(B))
    x[TOWER : TOWER + 6] = random.normal(size=6) * 1e6
    x[WATER : WATER + 6] = random.normal(size=6) * 1e7
    x[PLACE : PLACE + 3] = 0.7, 0.05, -0.08
    x[FALL : FALL + 6] = -0.8, 0.4, -9.3, 0.02, -0.03, 0.01
    x[MODES : MODES + k] = random.normal(size=k)
    x[MODES + k : MODES + k + 3] = 3e5, -1e5, -8e5
    x[MODES + k + 3 : -1] = random.normal(size=3 * deep) * 1e4
    x[-1] = 1.0
    found = (B.T @ x)[:6]
    # all beyond the section: nodes of pontoon and column A
    p, a = loads.pieces, assembly
    beyond = {*np.concatenate([a.member_nodes["pontoon_A"][1:], a.member_nodes["column_A"]]).tolist()}
    names = {a.members.index(name) for name in ("pontoon_A", "column_A")}
    e = a.elements
    start = a.points[a.joint_nodes["keel"]]
    total = np.zeros(6)

    def add(place: Float, force: Float) -> None:
        total[:3] += force
        total[3:] += np.cross(place - start, force)

    spread, plane = by_added_mass(p), by_water_plane(p)
    lift = -GRAVITY * 1025.0 * plane.total[:, 2:5] @ x[PLACE : PLACE + 3]
    added = np.einsum("kpi,k->pi", spread.weighted(loads.about_mean), x[MODES : MODES + k])
    force = spread.forces @ x[WATER : WATER + 6] + (plane.forces - spread.forces) @ lift - added
    force[:deep] += x[MODES + k + 3 : -1].reshape(-1, 3)
    for n in range(len(p.low)):
        mine = e.member[p.element[n]] in names if p.element[n] >= 0 else p.node[n] in beyond
        if mine:
            add(p.place[n], force[n])
    motion = rigid_motions(a.points - BASE).T @ x[FALL : FALL + 6]
    motion = motion.reshape(-1, 6) - np.einsum("k,kni->ni", x[MODES : MODES + k], member.below)
    ends = a.inertia(motion)
    for i in np.flatnonzero([m in names for m in e.member]):
        for side in (0, 1):
            add(a.points[e.nodes[i, side]], ends[i, side, :3])
            total[3:] += ends[i, side, 3:]
    add(np.array([-44.5, 0.0, -10.0]), x[MODES + k : MODES + k + 3])
    axes = e.axes[np.flatnonzero(e.member == a.members.index("pontoon_A"))[0]]
    expected = np.concatenate([axes.T @ total[:3], axes.T @ total[3:]])
    np.testing.assert_allclose(found, expected, rtol=1e-8, atol=1e-6 * np.abs(expected).max())


COLUMNS = {"A": (-40.0, 0.0), "B": (20.0, 34.641), "C": (20.0, -34.641)}


def in_bodies(tmp_path: Path, coupling: float) -> tuple[Platform, HydroCoefficients]:
    """Platform of four bodies: added mass of strip theory, and a ``coupling`` [m^3] in surge; any excitation."""
    frame = semi()
    bodies = [Body(place=[0.0, 0.0, 0.0], volume=1000.0, members=("lower",))]
    bodies += [
        Body(place=[x, y, 0.0], volume=2000.0, members=(f"column_{name}", f"pontoon_{name}"))
        for name, (x, y) in COLUMNS.items()
    ]
    p = pieces(afloat(frame, platform_of(frame), BASE))
    platform = platform_of(frame).model_copy(update={"bodies": tuple(bodies), "coefficients": str(tmp_path / "c.npz")})
    some, w = np.random.default_rng(3), np.array([0.3, 0.6, 0.9])

    def file(added: Float) -> HydroCoefficients:
        X = np.tile(1e2 * some.normal(size=(1, 1, 24, 2)).view(np.complex128)[..., 0], (3, 2, 1))
        X[..., 5] = 0.0  # of an upright column about its axis
        many = np.tile(added, (3, 1, 1))
        c = HydroCoefficients(w, many, 0.0 * many, added, np.array([0.0, 360.0]), X, np.zeros((24, 24)))
        write_coefficients(c, tmp_path / "c.npz")
        return c

    file(np.zeros((24, 24)))
    found = bodies_of(afloat(frame, platform, BASE), platform, p)
    assert found is not None
    added = found.arms.T @ by_added_mass(p).weights @ found.arms / 1025.0
    for one, other in ((6, 12), (12, 18), (18, 6)):
        added[one, other] = added[other, one] = coupling
    return platform, file(added)


def test_loads_of_bodies_spread_within_each(tmp_path: Path) -> None:
    """With the added mass of strip theory as with one body; with any, the whole has that of all bodies."""
    p = pieces(afloat(semi(), platform_of(semi()), BASE))
    strip = by_added_mass(p)
    for coupling in (0.0, 300.0):
        platform, c = in_bodies(tmp_path, coupling)
        spread = hull_spread(afloat(semi(), platform, BASE), platform, p)
        total = transfer(np.array([each.place for each in platform.bodies])).reshape(-1, 6)
        expected = 1025.0 * total.T @ c.infinite @ total
        np.testing.assert_allclose(spread.total, expected, atol=1e-6 * np.abs(expected).max())
        same = np.abs(spread.weights - strip.weights).max() / np.abs(strip.weights).max()
        assert same < 1e-6 if coupling == 0.0 else same > 1e-3
        np.testing.assert_allclose(spread.resultant(spread.forces[:, :, 0]), np.eye(6)[0], atol=1e-9)


def test_waves_push_each_body_as_its_potential_flow_says(tmp_path: Path) -> None:
    """Amplitudes of the resultants on bodies in a regular wave: forces of the frame, and those of the whole hull."""
    platform, c = in_bodies(tmp_path, 300.0)
    assembly, member = afloat(semi(), platform, BASE), member_of(semi())
    assert member.below is not None
    loads = AfloatLoads(assembly, pieces(assembly), member.below, GRAVITY, platform, 0.0)
    assert loads.bodies is not None
    sea = RegularSea(height=2.0, period=10.0)
    wave, still = (in_waves(loads, each, 20.0, (0.0, 0.0), GRAVITY) for each in (sea, StillWater()))
    deep = 3 * loads.deep
    of_bodies = (wave["frame_force"] - still["frame_force"][:1]) @ loads.bodies.arms[:deep]
    phase = 0.2 * np.pi * float(View(FrameWater, wave["water"])["step"]) * np.arange(len(of_bodies))
    found = np.linalg.lstsq(np.stack([np.cos(phase), np.sin(phase)], axis=1), of_bodies)[0]
    # their potential flow, less their share of the whole hull
    whole = transfer(np.array([each.place for each in platform.bodies])).reshape(-1, 6).T @ c.excitation[0, 0]
    share = loads.bodies.arms[:deep].T @ loads.spread.forces.reshape(-1, 6)[:deep] @ whole
    expected = 1025.0 * GRAVITY * np.abs(c.excitation[0, 0] - share)
    np.testing.assert_allclose(np.hypot(*found), expected, rtol=1e-4, atol=1.0)


def test_bodies_that_do_not_fit_are_refused(tmp_path: Path) -> None:
    platform, _ = in_bodies(tmp_path, 0.0)
    first, *others = platform.bodies

    def refusal(*bodies: Body) -> str:
        changed = platform.model_copy(update={"bodies": bodies})
        with pytest.raises(InputError) as caught:
            bodies_of(afloat(semi(), changed, BASE), changed, pieces(afloat(semi(), changed, BASE)))
        return str(caught.value)

    assert "no member 'lowr' in frame: did you mean 'lower'" in refusal(first.replace(members=("lowr",)), *others)
    assert "member 'lower' is in the water and in no body" in refusal(first.replace(members=()), *others)
    two = others[0].replace(members=("lower", *others[0].members))
    assert "member 'lower' is in two bodies" in refusal(first, two, *others[1:])
    assert "3 bodies, but" in refusal(first.replace(members=("lower", *others[2].members)), *others[:2])


def test_what_does_not_float_is_refused() -> None:
    frame = semi()
    layout = points(np.linspace(0.0, 90.0, 31))
    with pytest.raises(InputError, match=r"frame.feet: the frame has no feet; give some, or a platform"):
        supported_tower(frame, a_tower(), COUNTS, TIP, None, layout)
    platform = platform_of(frame)
    with pytest.raises(InputError, match=r"frame.depth: 100 m, but platform.depth is 120 m"):
        afloat(frame, platform.model_copy(update={"depth": 120.0}), BASE)
    with pytest.raises(InputError, match=r"frame: its members, masses and ballast have .* t, but platform.mass"):
        afloat(frame, platform.model_copy(update={"mass": 1e6}), BASE)
    assert "frame_section" in AfloatPart.afterwards  # linear models and operating points refuse it
    with pytest.raises(InputError, match=r"frame.feet: a frame with a platform floats"):
        afloat(frame.replace(feet=[{"joint": "A_keel"}]), platform, BASE)


def test_the_library_semi_has_its_masses() -> None:
    """Steel of 3914 t and platform.mass of the frame; stiffness of the water plane that of its potential flow."""
    turbine = load_turbine("iea15mw-volturnus-flexible")
    assert turbine.frame is not None and turbine.platform is not None
    a = afloat(turbine.frame, turbine.platform, np.array([0.0, 0.0, 15.0]))
    bulkheads = 7850.0 * 0.05 * np.pi * (2 * 5.0**2 + 3 * 4 * 6.25**2)
    assert float(a.elements.steel @ a.elements.length) + bulkheads == pytest.approx(3.914e6, rel=5e-3)
    J = rigid_inertia(a)
    assert J[0, 0] == pytest.approx(turbine.platform.mass, rel=1e-3)
    assert -14.94 < J[4, 0] / J[0, 0] < turbine.platform.centre[2]  # that of the report, and of the deck
    np.testing.assert_allclose(np.diag(J)[3:], np.diag(platform_inertia(turbine.platform))[3:], rtol=0.06)
    assert by_water_plane(pieces(a)).total[2, 2] == pytest.approx(443.0, rel=0.01)


def test_the_hull_of_the_iea_22_mw_has_its_masses() -> None:
    """Mass, centre, inertia of the OpenFAST deck; volume and water plane of its potential flow."""
    turbine = load_turbine("iea22mw-semi-flexible")
    assert turbine.frame is not None and turbine.platform is not None
    a = afloat(turbine.frame, turbine.platform, np.array([0.0, 0.0, 15.0]))
    J, water, platform = rigid_inertia(a), pieces(a), turbine.platform
    assert J[0, 0] == pytest.approx(platform.mass, rel=1e-6)
    assert J[4, 0] / J[0, 0] == pytest.approx(platform.centre[2], abs=0.01)
    np.testing.assert_allclose(np.diag(J)[3:], np.diag(platform_inertia(platform))[3:], rtol=0.01)
    assert water.volume[water.high < 1e-3].sum() == pytest.approx(platform.volume, rel=1e-5)
    plane = read_coefficients("iea22mw-semi").hydrostatic
    np.testing.assert_allclose(by_water_plane(water).total[2, 2], plane[2, 2], rtol=1e-4)
