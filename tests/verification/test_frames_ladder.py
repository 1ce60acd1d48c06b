"""Frames against SubDyn of OpenFAST 5.0: jacket of OC4, tripod of OC3, and test cases of its driver.

Decks and results are beside the project (``shared/reference/openfast_members``, from OpenFAST/r-test); tests that need
them are skipped without.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.linalg
import scipy.signal

from meltemi import ModelOptions, build, load_turbine
from meltemi.analysis import natural_modes
from meltemi.frames.definition import Foot, Frame, JointMass, Member, Releases, Section
from meltemi.frames.finite_elements import Assembly, assemble
from meltemi.frames.recovery import recovery
from meltemi.frames.reduction import frequencies, reduced, supported_tower, tower_base, weight_stiffness
from meltemi.sea.airy import GRAVITY
from meltemi.structure.beam import transfer
from meltemi.structure.members import points, rigid_body

REFERENCE = Path(__file__).parents[3] / "shared" / "reference" / "openfast_members"
needs_reference = pytest.mark.skipif(not REFERENCE.exists(), reason="the reference runs are not beside the project")

# docs/verification: mass, K11, K15, K33, K55, K66 of SubDyn's summaries at the base, clamped and free frequencies [Hz]
EXPECTED = {
    "jacket": (
        673882.7,
        [8.81935e7, -2.231229e9, 1.992616e9, 1.024844e11, 8.457464e9],
        [7.339, 7.339, 8.356, 8.974, 9.098, 9.521, 9.758, 9.758, 10.90],
        [2.757, 2.757, 5.416, 7.640, 7.640, 8.356],
    ),
    "tripod": (
        858127.4,
        [3.00297e8, -3.01196e9, 1.866696e9, 6.25267e10, 6.65471e9],
        [4.0414, 4.0414, 4.0609, 4.0754, 4.0754, 4.0948, 5.697, 5.697],
        [],
    ),
}
BASE = {"jacket": 18.15, "tripod": 10.0}


def bare(name: str) -> Frame:
    """The frame of a library turbine without liquid inside, growth and transition piece, as in SubDyn's file."""
    frame = load_turbine(f"nrel5mw-{name}").frame
    assert frame is not None
    members = {each: member.replace(flooded=False) for each, member in frame.members.items()}
    return frame.replace(members=members, growth=(), masses=())


def of_deck(path: Path) -> Frame:
    """The frame of one of SubDyn's files of 5.0, tubes only."""
    lines = path.read_text().splitlines()

    def table(title: str) -> list[list[str]]:
        first = next(i for i, line in enumerate(lines) if re.search(title, line))
        count = int(lines[first + 1].split()[0])
        return [line.split() for line in lines[first + 4 : first + 4 + count]]

    sections = {
        row[0]: Section(elastic_modulus=float(row[1]), shear_modulus=float(row[2]), density=float(row[3]),
                        diameter=float(row[4]), thickness=float(row[5]))
        for row in table("CIRCULAR BEAM CROSS-SECTION")
    }  # fmt: skip
    return Frame(
        depth=50.0,
        joints={row[0]: [float(x) for x in row[1:4]] for row in table("STRUCTURE JOINTS")},
        sections=sections,
        members={
            row[0]: Member(joints=(row[1], row[2]), section=row[3], end_section=row[4])
            for row in table("^-+ MEMBERS -+")
        },
        feet=[Foot(joint=row[0]) for row in table("BASE REACTION JOINTS")],
        interface=[row[0] for row in table("INTERFACE JOINTS")],
        divisions=int(next(line for line in lines if " NDiv " in line).split()[0]),
    )


def stiffness(assembly: Assembly) -> Any:
    return reduced(assembly, 0).stiffness[[0, 0, 2, 4, 5], [0, 4, 2, 4, 5]]


@pytest.mark.parametrize("name", ["jacket", "tripod"])
def test_the_library_has_the_published_frames(name: str) -> None:
    """Joints 1 mm above those of the jacket's file, and members of the tripod in one piece: below 1e-4 and 0.2 %."""
    mass, K, clamped, free = EXPECTED[name]
    assembly = assemble(bare(name), np.array([0.0, 0.0, BASE[name]]))
    assert -assembly.nodal(assembly.weight)[:, 2].sum() == pytest.approx(mass, rel=1e-4)
    assert stiffness(assembly) == pytest.approx(K, rel=1e-4)
    hertz = frequencies(assembly, len(clamped), fixed=True) / (2 * np.pi)
    assert hertz == pytest.approx(clamped, rel=2e-3)
    if free:
        assert frequencies(assembly, len(free)) / (2 * np.pi) == pytest.approx(free, rel=2e-3)


@needs_reference
@pytest.mark.parametrize(("name", "case"), [("jacket", "J3_H6T10"), ("tripod", "T3_H6T10")])
def test_the_decks_have_subdyns_summaries(name: str, case: str) -> None:
    assembly = assemble(of_deck(REFERENCE / "decks" / case / "SubDyn.dat"), np.array([0.0, 0.0, BASE[name]]))
    text = (REFERENCE / "summaries" / f"{name}.SD.sum.yaml").read_text()

    def matrix(key: str) -> Any:
        rows = re.search(rf"^{key}:.*\n((?:  - .*\n){{6}})", text, re.MULTILINE)
        assert rows
        return np.array(
            [[float(x) for x in row[row.index("[") + 1 :].strip("], ").split(",")] for row in rows[1].splitlines()]
        )

    def hertz(key: str) -> Any:
        line = re.search(rf"^{key}:.*\n  - \[(.*),\]", text, re.MULTILINE)
        assert line
        return np.array([float(x) for x in line[1].split(",")])

    r = reduced(assembly, 8)
    for ours, key in ((r.stiffness, "KBBt"), (r.mass[:6, :6], "MBBt")):
        theirs = matrix(key)
        assert ours == pytest.approx(theirs, rel=1e-6, abs=2e-7 * np.abs(theirs).max())
    arms = transfer(assembly.points - assembly.points[-1]).reshape(-1, 6)
    rigid, theirs = arms.T @ (assembly.mass @ arms), matrix("M_P")
    assert rigid == pytest.approx(theirs, rel=1e-6, abs=2e-7 * np.abs(theirs).max())
    clamped = hertz("CB_frequencies")
    assert r.frequency[:8] / (2 * np.pi) == pytest.approx(clamped[:8], rel=1e-6)
    guyan = np.sqrt(scipy.linalg.eigvalsh(r.stiffness, r.mass[:6, :6])) / (2 * np.pi)
    assert guyan == pytest.approx(hertz("GY_frequencies"), rel=1e-6)


def test_weight_at_the_base_of_the_jacket() -> None:
    """Guyan's share of the weight, 2.36696 MN of 6.6085 MN."""
    assembly = assemble(bare("jacket"), np.array([0.0, 0.0, 18.15]))
    weight = 9.80665 * assembly.nodal(assembly.weight)
    r = reduced(assembly, 0)
    assert np.einsum("kni,ni->k", r.static, weight)[2] == pytest.approx(-2.36696e6, rel=1e-4)
    feet = recovery(assembly, []).loads(weight).reshape(-1, 6)
    assert feet[:, 2].sum() == pytest.approx(6.6085e6, rel=1e-4)


# test cases of SubDyn's driver --------------------------------------------------------------------


def column_of(case: str) -> dict[str, float]:
    """The last row of a case's results."""
    z = np.load(REFERENCE / "subdyn_driver" / case / f"{case}.npz")
    return dict(zip(map(str, z["channels"]), map(float, z["data"][-1]), strict=True))


def with_base(assembly: Assembly, loads: Any, motion: Any = 0.0) -> Any:
    """(n, 6) displacements of nodes under loads (n, 6) with the base at a given motion (6,)."""
    T, K, base = assembly.transformation, assembly.free, np.zeros(6) + motion
    right = (T.T @ loads.reshape(-1))[:-6] - K[:-6, -6:] @ base
    return (T @ np.concatenate([assembly.solver(base=True).solve(right), base])).reshape(-1, 6)


ROD = Section(diameter=2.1, elastic_modulus=4.2e10, shear_modulus=1.75e10, density=1375.0)


def ansys(rod: Section, **more: Any) -> Frame:
    """A beam of 32 m along x, that Ansys computed too (OpenFAST/r-test, SD_AnsysComp1 to 3)."""
    x = [0.0, 1.0, 2.0, 7.0, 12.0, 17.0, 22.0, 27.0, 32.0]
    beams = {f"{i}": Member(joints=(f"{i}", f"{i + 1}"), section="rod") for i in range(1, 9)}
    return Frame(
        depth=50.0,
        joints={f"{i + 1}": [each, 0.0, 0.0] for i, each in enumerate(x)} | more.pop("joints", {}),
        sections={"rod": rod},
        members=beams | more.pop("members", {}),
        interface=["1"],
        divisions=5,
        **more,
    )


@needs_reference
def test_a_beam_with_a_pin_on_a_spring() -> None:
    expected = column_of("SD_AnsysComp1_PinBeam")
    pinned = Releases(kind="pin", axis=[0, 1, 0], stiffness=9.1673e9)
    # with a wall of 0 SubDyn takes the area of a solid rod and the share of it that carries shear of a thin tube, 0.5
    inertia = np.pi / 64.0 * 2.1**4
    rod = ROD.replace(
        kind="general",
        area=np.pi / 4.0 * 2.1**2,
        **dict.fromkeys(("shear_area_x", "shear_area_y"), np.pi / 8.0 * 2.1**2),
        **dict.fromkeys(("inertia_x", "inertia_y"), inertia),
        torsion=2.0 * inertia,
    )
    assembly = assemble(ansys(rod, releases={"2": pinned}))
    loads = 9.8066 * assembly.nodal(assembly.weight)
    loads[assembly.joint_nodes["9"], :3] += [-5.31e7, 0.0, 7.3e5]
    # of the fixed-end moments of the weight at the pin, one for each side, SubDyn has half of the first for both
    sides = [assembly.member_nodes["1"][-1], assembly.member_nodes["2"][0]]
    loads[sides, 4] = 0.5 * loads[sides[0], 4]
    found = with_base(assembly, loads)
    for i in range(1, 8):
        node = assembly.member_nodes[f"{i + 1}"][0]
        theirs = [expected[f"M{i + 1}N1TD{c}ss"] for c in "xz"]
        assert found[node, [0, 2]] == pytest.approx(theirs, rel=1e-6)
    assert found[assembly.joint_nodes["9"], 2] == pytest.approx(expected["M8N2TDzss"], rel=1e-6)


@needs_reference
def test_a_beam_held_by_a_cable() -> None:
    expected = column_of("SD_AnsysComp2_Cable")
    stay = Member(joints=("10", "9"), section="-", kind="cable", axial_stiffness=1.5151e10, pretension=6.26e6)
    assembly = assemble(ansys(ROD, joints={"10": [0.0, 0.0, 5.0]}, members={"9": stay}, feet=[Foot(joint="10")]))
    ends = 9.8066 * assembly.weight + assembly.pretension
    found = with_base(assembly, assembly.nodal(ends))
    for i in range(1, 9):
        node = assembly.member_nodes[f"{i}"][-1]
        place = f"M{i + 1}N1" if i < 8 else "M8N2"
        assert found[node, [0, 2]] == pytest.approx([expected[f"{place}TD{c}ss"] for c in "xz"], rel=2e-5, abs=1e-9)
    e = assembly.elements
    last = int(np.flatnonzero(e.member == assembly.members.index("9"))[0])
    pull = (e.stiffness[last] @ found[e.nodes[last]].reshape(-1))[6:9] @ e.axes[last, :, 2] + 6.26e6
    assert pull == pytest.approx(expected["M9N1FKze"], rel=2e-5)


@needs_reference
def test_a_pinned_beam_between_two_cables() -> None:
    expected = column_of("SD_AnsysComp3_PinBeamCable")
    stays = {
        f"{i + 8}": Member(joints=(f"{i + 9}", "9"), section="-", kind="cable", axial_stiffness=EA, pretension=tension)
        for i, EA, tension in ((1, 1.5095e10, 6.26e7), (2, 1.6065e10, 5.634e7))
    }
    ends = {"10": [0.0, 0.0, -5.0], "11": [0.0, 0.0, 21.0]}
    pin = {"2": Releases(kind="pin", axis=[0, 1, 0])}
    assembly = assemble(ansys(ROD, joints=ends, members=stays, feet=[Foot(joint="10"), Foot(joint="11")], releases=pin))
    found = with_base(assembly, assembly.nodal(9.8066 * assembly.weight + assembly.pretension))
    tip = found[assembly.joint_nodes["9"]]
    assert tip[[0, 2]] == pytest.approx([expected["M7N2TDxss"], expected["M7N2TDzss"]], rel=2e-5)
    e = assembly.elements
    for name, channel, tension in (("9", "M8N1FKze", 6.26e7), ("10", "M9N1FKze", 5.634e7)):
        k = int(np.flatnonzero(e.member == assembly.members.index(name))[0])
        pull = (e.stiffness[k] @ found[e.nodes[k]].reshape(-1))[6:9] @ e.axes[k, :, 2] + tension
        assert pull == pytest.approx(expected[channel], rel=2e-5)


@needs_reference
def test_a_rigid_link_beside_a_beam() -> None:
    expected = column_of("SD_Rigid")
    rod = Section(diameter=1.0, thickness=0.05, shear_modulus=8.0769e10)
    pairs = [("1", "2"), ("2", "3"), ("3", "4")]
    column = Frame(
        depth=50.0,
        joints={f"{i + 1}": [0.0, 0.0, 10.0 * i] for i in range(4)},
        sections={"rod": rod},
        members={f"{i + 1}": Member(joints=pair, section="rod") for i, pair in enumerate(pairs)}
        | {"4": Member(joints=("2", "3"), section="-", kind="rigid")},
        feet=[Foot(joint="1")],
        interface=["4"],
    )
    assembly = assemble(column)
    found = with_base(assembly, 9.81 * assembly.nodal(assembly.weight), [0.5, 0, 0, 0, 0, 0])
    for node, place in ((1, "M1N2"), (2, "M2N1")):
        assert found[node, [0, 2]] == pytest.approx([expected[f"{place}TD{c}ss"] for c in "xz"], rel=2e-6)


# moving cases of SubDyn's driver ------------------------------------------------------------------


def series_of(case: str) -> dict[str, Any]:
    z = np.load(REFERENCE / "subdyn_driver" / case / f"{case}.npz")
    return dict(zip(map(str, z["channels"]), z["data"].astype(float).T, strict=True))


def moving(assembly: Assembly, ratios: list[float], time: Any, joint: str, force: Any, surge: Any = 0.0) -> Any:
    """(t, n, 6) displacements by modes with a fixed base of given damping ratios, and static improvement.

    Args:
      force: (t,) [N] along x on a joint.
      surge: (t,) [m/s^2] acceleration of the base; displacements are then relative to it.
    """
    r, load = reduced(assembly, len(ratios)), np.zeros((len(assembly.points), 6))
    load[assembly.joint_nodes[joint], 0] = 1.0
    excited = np.outer(force, r.modes[:, assembly.joint_nodes[joint], 0])
    driven = excited - np.outer(surge + 0.0 * time, r.mass[0, 6:])
    q = [
        scipy.signal.lsim(([[0, 1], [-w * w, -2 * z * w]], [[0], [1]], [1, 0], 0), f, time)[1]
        for w, z, f in zip(r.frequency, ratios, driven.T, strict=True)
    ]
    static = np.multiply.outer(force, with_base(assembly, load))
    return static + np.tensordot(np.transpose(q) - excited / r.frequency**2, r.modes, 1)


def pendulum(section: Section, release: Releases | None, length: float = 6.0, lower: Section | None = None) -> Assembly:
    """A tube of 1 m below the base, and one below it in one element each."""
    frame = Frame(
        depth=50.0,
        joints={"1": [0.0, 0.0, 0.0], "2": [0.0, 0.0, -1.0], "3": [0.0, 0.0, -length]},
        sections={"upper": section, "lower": lower or section},
        members={"1": Member(joints=("1", "2"), section="upper"), "2": Member(joints=("2", "3"), section="lower")},
        releases={} if release is None else {"2": release},
        interface=["1"],
        divisions=1,
    )
    return assemble(frame)


def deviation(ours: Any, theirs: Any) -> float:
    """Root mean square of the difference over the standard deviation."""
    return float(np.sqrt(np.mean((ours - theirs) ** 2)) / np.std(theirs))


TUBE = Section(diameter=0.2, thickness=0.02, shear_modulus=8.0769e10)


@needs_reference
def test_a_cable_is_pulled_against_another() -> None:
    """The interface between two cables under tension moves by 10 mm (SD_Cable_5Joints)."""
    expected, x = series_of("SD_Cable_5Joints"), {"2": -10.1, "3": -0.1, "4": 0.0, "5": 0.1, "6": 10.1}
    cables = {
        name: Member(joints=ends, section="-", kind="cable", axial_stiffness=EA, pretension=1e7)
        for name, ends, EA in (("12", ("2", "3"), 2.1e9), ("25", ("5", "6"), 4.2e9))
    }
    tubes = {each: Member(joints=(each, f"{int(each) + 1}"), section="tube") for each in "34"}
    frame = Frame(
        depth=50.0,
        joints={name: [each, 0.0, 0.0] for name, each in x.items()},
        sections={"tube": Section(diameter=5.0, thickness=1.75, shear_modulus=8.0769e10)},
        members=cables | tubes,
        feet=[Foot(joint="2"), Foot(joint="6")],
        interface=["4"],
        divisions=1,
    )
    assembly = assemble(frame)
    e = assembly.elements
    for i in (0, 500, 1000, 1998):
        found = with_base(assembly, assembly.nodal(assembly.pretension), [expected["IntfTDXss"][i], 0, 0, 0, 0, 0])
        for name, channel in (("12", "M1N1FKze"), ("25", "M4N1FKze")):
            k = int(np.flatnonzero(e.member == assembly.members.index(name))[0])
            pull = (e.stiffness[k] @ found[e.nodes[k]].reshape(-1))[6:9] @ e.axes[k, :, 2] + 1e7
            assert pull == pytest.approx(expected[channel][i], rel=1e-7)
        assert found[assembly.joint_nodes["3"], 0] == pytest.approx(expected["M1N2TDxss"][i], rel=1e-6, abs=1e-12)


@needs_reference
def test_a_beam_on_a_pin_with_a_spring_swings() -> None:
    """A force at its end that is let go (SD_Revolute_Joint): 0.421 m, ten swings, 1e-4 of the frequency."""
    expected = series_of("SD_Revolute_Joint")
    rod = Section(diameter=2.0, thickness=1.0, shear_modulus=8.08e10, density=7860.0)
    assembly = pendulum(rod, Releases(kind="pin", axis=[0, 1, 0], stiffness=1e6), length=5.0)
    time = 0.01 * np.arange(10001)
    force = np.interp(time, [0.0, 25.0, 50.0, 50.01], [0.0, 2.5e4, 2.5e4, 0.0])
    found = moving(assembly, [0.0], time, "3", force)[::5, :, 0]
    assert deviation(found[:, assembly.joint_nodes["3"]], expected["M1N2TDxss"]) < 0.005
    assert deviation(found[:, assembly.member_nodes["2"][0]], expected["M1N1TDxss"]) < 0.005
    assert np.ptp(found[:, assembly.joint_nodes["3"]]) == pytest.approx(np.ptp(expected["M1N2TDxss"]), rel=1e-3)


@needs_reference
def test_a_cantilever_under_a_slow_force() -> None:
    """Tubes, one of them as a general section; the force grows to 1 kN within 10 s (SD_Force)."""
    expected = series_of("SD_Force")
    area, shear, inertia = 1.1309733552923262e-2, 5.7694685539820189e-3, 4.6369907566985380e-5
    same = {"shear_area_x": shear, "shear_area_y": shear, "inertia_x": inertia, "inertia_y": inertia}
    general = Section(kind="general", area=area, torsion=2.0 * inertia, shear_modulus=8.0769e10, **same)
    assembly = pendulum(TUBE, None, lower=general)
    time = 0.01 * np.arange(1500)
    found = moving(assembly, [0.01, 0.01, 0.039, 0.039, 0.2524], time, "3", np.interp(time, [0, 10], [0, 1e3]))
    # of the two modes of 5.2 Hz SubDyn gives that in the force's plane 1 % of damping, the other 837 %
    for node, i, channel, sign in (("3", 0, "M2N2TDxss", 1), ("2", 0, "M2N1TDxss", 1), ("3", 4, "M2N2RDye", -1)):
        assert deviation(sign * found[:, assembly.joint_nodes[node], i], expected[channel]) < 0.003


@needs_reference
def test_a_pendulum_hangs_on_a_moving_base() -> None:
    """A pin with a spring, damped by 837 % (SD_PendulumDamp): displacements of the lower end by OpenFAST 5.0's SubDyn.

    A rigid pendulum of OpenModelica, whose results lie beside the case, deviates by 4.3 % from SubDyn.
    """
    motion = np.load(REFERENCE / "subdyn_driver/SD_PendulumDamp/input_time_series_interface_joint.npz")["data"]
    time, surge, acceleration = 0.02 * np.arange(len(motion)), motion[:, 1], motion[:, 13]
    assembly = pendulum(TUBE, Releases(kind="pin", axis=[0, 1, 0], stiffness=100.0))
    found = moving(assembly, [8.37, 0.01, 0.039, 0.01, 0.2524], time, "3", 0.0 * time, acceleration)
    x = found[:, assembly.joint_nodes["3"], 0] + surge
    assert x[[500, 1500, 2400]] == pytest.approx([-0.0359359, -0.106163, 0.212492], rel=5e-5)


# with the turbine ---------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["jacket", "tripod"])
def test_modes_of_tower_and_frame_are_those_of_all_elements(name: str) -> None:
    """Tower and frame in one assembly of elements, with the head as a mass, against the member of a model."""
    turbine = load_turbine(f"nrel5mw-{name}")
    tower, frame = turbine.tower, turbine.frame
    assert frame is not None
    dry = {each: m.replace(flooded=False) for each, m in frame.members.items()}
    frame = frame.replace(growth=(), water_density=1e-9, members=dry)
    centre, inertia = np.array([-0.414, 0.0, 1.967]), [4.37e7, 2.353e7, 2.542e7]
    head = rigid_body(3.5e5, centre, np.diag(inertia))
    counts = {"fore_aft": 2, "side_side": 2, "torsion": 1}
    member = supported_tower(frame, tower, counts, head, None, points(np.linspace(0.0, tower.length, 21)))
    heights = np.linspace(0.0, tower.length, 81)
    middle = 0.5 * (heights[1:] + heights[:-1])
    mass = np.interp(middle, tower.position, tower.mass)
    bending = np.interp(middle, tower.position, tower.fore_aft_stiffness) / 210e9
    axial, torsion = (np.interp(middle, tower.position, v) for v in (tower.axial_stiffness, tower.torsion_stiffness))
    sections = {
        f"t{i}": Section(kind="general", area=axial[i] / 210e9, density=mass[i] / axial[i] * 210e9,
                         shear_area_x=1e6, shear_area_y=1e6, inertia_x=bending[i], inertia_y=bending[i],
                         torsion=torsion[i] / 80.8e9)
        for i in range(len(middle))
    }  # fmt: skip
    joints = {f"z{i}": [0.0, 0.0, tower.base_height + z] for i, z in enumerate(heights)}
    members = {f"t{i}": Member(joints=(f"z{i}", f"z{i + 1}"), section=f"t{i}") for i in range(80)}
    links = {f"l{joint}": Member(joints=("z0", joint), section="-", kind="rigid") for joint in frame.interface}
    whole = frame.replace(
        joints=frame.joints | joints,
        sections=frame.sections | sections,
        members=frame.members | members | links,
        masses=(*frame.masses, JointMass(joint="z80", mass=3.5e5, centre=centre, inertia=[*inertia, 0.0, 0.0, 0.0])),
        interface=["z80"],
    )
    hertz = frequencies(assemble(whole), 12) / (2 * np.pi)
    assert member.below is not None
    soft = GRAVITY * weight_stiffness(assemble(frame, tower_base(frame, tower)), member.below)
    found = np.sqrt(np.diag(member.modes.stiffness - soft) / np.diag(member.modes.mass)) / (2 * np.pi)
    nearest = np.array([hertz[np.abs(hertz - each).argmin()] for each in found])
    assert found == pytest.approx(nearest, rel=1e-3)
    # OC4, phase I: .31 to .32 Hz; SubDyn's own model with a rigid head .3187 and .3212 Hz
    assert np.sort(found)[:2] == pytest.approx({"jacket": [0.3187, 0.3212], "tripod": [0.3134, 0.3151]}[name], rel=0.01)


@pytest.mark.slow
def test_the_parked_turbine_on_the_jacket_vibrates_as_in_openfast() -> None:
    """Decay without water, blades feathered: 0.3106, 0.3136, 1.20 and 1.27 Hz."""
    turbine = load_turbine("nrel5mw-jacket")
    frame = turbine.frame
    assert frame is not None
    dry = {each: m.replace(flooded=False) for each, m in frame.members.items()}
    frame = frame.replace(growth=(), water_density=1e-9, members=dry)
    options = ModelOptions(blade_nodes=8, tower_nodes=8, torsion_modes=0, locked=("yaw", "drivetrain"))
    modes = natural_modes(build(turbine.replace(frame=frame), options), pitch=0.5 * np.pi)
    hertz = {mode.name: mode.frequency / (2 * np.pi) for mode in modes}
    first = [hertz["1st tower side-side"], hertz["1st tower fore-aft"]]
    assert first == pytest.approx([0.3106, 0.3136], rel=2e-3)
    assert [hertz["2nd tower side-side"], hertz["2nd tower fore-aft"]] == pytest.approx([1.20, 1.27], rel=1e-2)
