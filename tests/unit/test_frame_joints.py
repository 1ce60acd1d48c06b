"""Joints of frames: stresses, stress concentration, hot spots, classification, S-N curves, damage over a lifetime.

Reference values of factors were computed with public code that cites OTH 88 (willwhitearup/oswdesigntools), for a brace
of 0.8 x 0.020 m on legs of 1.2 m: those of the OC4 jacket.
"""

from __future__ import annotations

from math import gamma, isnan, log10, pi, sqrt
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from meltemi import InputError
from meltemi.frames.definition import Frame, Member, Section
from meltemi.frames.joints.fatigue import LoadCase, environment_at, joint_fatigue, welds_of
from meltemi.frames.joints.geometry import Joint, tubular_joints
from meltemi.frames.joints.hot_spots import ATTACHMENT, classes, hot_spots, weld_stresses
from meltemi.frames.joints.picture import plot_joint_damage
from meltemi.frames.joints.scf import LEAST, Factors, Parameters, at_limits, efthymiou, factors, outside, parameters_of
from meltemi.frames.joints.settings import JointSettings
from meltemi.frames.joints.stress import nominal_stress, shear_stress
from meltemi.postprocess.cycles import rainflow_cycles
from meltemi.postprocess.sn import Curve, editions, sn_curve, spectral_damage
from meltemi.postprocess.spectra import power_spectrum
from meltemi.turbine.library import load_turbine

Float = NDArray[np.float64]
TUBE = Section(diameter=0.8, thickness=0.02)
AREA, MODULUS = 0.25 * pi * (0.8**2 - 0.76**2), pi / 32.0 * (0.8**4 - 0.76**4) / 0.8


def frame_of(braces: dict[str, tuple[float, float, float]], wall: float = 0.05, reach: float = 9.0) -> Frame:
    """A vertical chord through the origin, and braces from there to points."""
    ends = {f"end-{name}": place for name, place in braces.items()}
    return Frame(
        depth=50.0,
        joints={"low": (0.0, 0.0, -reach), "node": (0.0, 0.0, 0.0), "high": (0.0, 0.0, reach)} | ends,
        sections={"leg": Section(diameter=1.2, thickness=wall), "brace": TUBE},
        members={
            "lower": Member(joints=("low", "node"), section="leg"),
            "upper": Member(joints=("node", "high"), section="leg"),
        }
        | {name: Member(joints=("node", f"end-{name}"), section="brace") for name in braces},
        interface=("high",),
    )


def joint_of(frame: Frame) -> Joint:
    (joint,) = tubular_joints(frame)
    return joint


T_JOINT = {"a": (10.0, 0.0, 0.0)}
K_JOINT = {"a": (10.0, 0.0, 10.0), "b": (10.0, 0.0, -10.0)}
X_JOINT = {"a": (10.0, 0.0, 0.0), "b": (-10.0, 0.0, 0.0)}


def loads_of(frame: Frame, **given: Any) -> dict[tuple[str, str], Float]:
    """Section loads of all ends and middles; those of members not given are zero. Loads (T, 6), or 6 numbers."""
    largest = max(np.atleast_2d(each).shape[0] for each in given.values())
    blank = np.zeros((largest, 6))
    return {
        (name, place): np.atleast_2d(np.asarray(given.get(name, blank), dtype=float))
        for name in frame.members
        for place in ("start", "middle", "end")
    }


def noise(seed: int, n: int = 6000, dt: float = 0.1) -> Float:
    """(n, 6) Gaussian section loads with two humps in their spectra."""
    rng = np.random.default_rng(seed)
    f = np.fft.rfftfreq(n, dt)[:, None]
    shape = np.exp(-(((f - 0.1) / 0.03) ** 2)) + 0.4 * np.exp(-(((f - 0.8) / 0.1) ** 2))
    x = np.fft.irfft(np.fft.rfft(rng.standard_normal((n, 6)), axis=0) * shape, n, axis=0)
    return x / x.std(axis=0) * np.array([2e4, 2e4, 6e5, 1e5, 1e5, 1e4])


# stresses -------------------------------------------------------------------------------------------------


def test_stress_of_a_tube() -> None:
    loads = np.array([[0.0, 0.0, 1e6, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1e5, 0.0, 0.0], [0.0, 0.0, 0.0, 0.0, 1e5, 0.0]])
    tension, about_x, about_y = nominal_stress(loads, TUBE)
    assert tension == pytest.approx(np.full(8, 1e6 / AREA), rel=1e-12)
    bent = 1e5 / MODULUS
    assert about_x[[0, 2, 6]] == pytest.approx([0.0, bent, -bent], abs=1e-6 * bent)  # a moment about x pulls at +y
    assert about_y[[0, 2, 4]] == pytest.approx([-bent, 0.0, bent], abs=1e-6 * bent)
    assert about_x[1] == pytest.approx(bent / sqrt(2.0), rel=1e-12)


def test_shear_of_a_thin_and_a_solid_tube() -> None:
    loads = np.array([[3e5, 4e5, 0.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 0.0, 0.0, -1e5]])
    force, torsion = shear_stress(loads, TUBE)
    exact = 4.0 / 3.0 * (0.4**2 + 0.4 * 0.38 + 0.38**2) / (0.4**2 + 0.38**2)
    assert force == pytest.approx(exact * 5e5 / AREA, rel=1e-12)
    assert exact == pytest.approx(2.0, rel=1e-3)  # thin walls
    assert torsion == pytest.approx(0.5 * 1e5 / MODULUS, rel=1e-12)
    assert shear_stress(loads, Section(diameter=0.8))[0] == pytest.approx(4.0 / 3.0 * 5e5 / (0.16 * pi), rel=1e-12)


def test_stress_of_a_rectangle() -> None:
    box = Section(kind="rectangle", width=2.0, height=1.0, thickness=0.02)
    Ix = (2.0 * 1.0**3 - 1.96 * 0.96**3) / 12.0
    loads = np.array([[0.0, 0.0, 0.0, 1e6, 0.0, 0.0], [0.0, 0.0, 0.0, 0.0, 0.0, 1e6]])
    bending, twist = nominal_stress(loads, box)
    assert bending[[0, 1, 2, 3]] == pytest.approx(1e6 * 0.5 / Ix * np.array([0.0, 1.0, 1.0, 1.0]), abs=1.0)
    assert not twist.any()


def test_general_section_has_no_points() -> None:
    section = Section(kind="general", area=1.0, inertia_x=1.0, inertia_y=1.0, torsion=1.0)
    with pytest.raises(InputError, match="no outline"):
        nominal_stress(np.zeros((1, 6)), section)


# geometry -------------------------------------------------------------------------------------------------


def test_parameters_of_the_k_joint_of_oc4() -> None:
    joint = joint_of(frame_of(K_JOINT))
    p = parameters_of(joint)[0]
    assert (p.beta, p.gamma, p.tau, p.alpha) == pytest.approx((2.0 / 3.0, 12.0, 0.4, 30.0))
    assert p.theta == pytest.approx(pi / 4)
    assert joint.gap(0, 1) == pytest.approx(1.2 - 0.8 * sqrt(2.0))  # D cot - d / sin
    thin = parameters_of(joint_of(frame_of(K_JOINT, wall=0.035)))[0]
    assert (thin.gamma, thin.tau) == pytest.approx((120.0 / 7.0, 4.0 / 7.0))
    assert parameters_of(joint, alpha=12.0)[0].alpha == 12.0


def test_chord_is_the_thickest_pair_in_line() -> None:
    frame = frame_of({"a": (10.0, 0.0, 0.0), "b": (-10.0, 0.0, 0.0)})
    joint = joint_of(frame)
    assert {tube.member for tube in joint.chord} == {"lower", "upper"}
    assert abs(joint.axis[2]) == pytest.approx(1.0)
    assert [brace.tube.member for brace in joint.braces] == ["a", "b"]
    same, opposite = joint.beside()
    assert same.tolist() == [[True, False], [False, True]]
    assert opposite.tolist() == [[False, True], [True, False]]


def test_chord_that_ends_at_the_joint() -> None:
    whole = frame_of(T_JOINT)
    joints, members = (
        {k: v for k, v in each.items() if k not in ("high", "upper")} for each in (whole.joints, whole.members)
    )
    joint = joint_of(whole.replace(joints=joints, members=members, interface=("low",)))
    assert [tube.member for tube in joint.chord] == ["lower"] and joint.length == 9.0


def test_can_of_a_joint() -> None:
    frame = frame_of(K_JOINT)
    (joint,) = tubular_joints(frame, {"node": 0.1})
    p = parameters_of(joint)[0]
    assert (p.gamma, p.tau, p.alpha) == pytest.approx((6.0, 0.2, 30.0))
    assert joint.chord[0].area == pytest.approx(0.25 * pi * (1.2**2 - 1.0**2))
    assert joint.braces[0].tube.thickness == 0.02
    with pytest.raises(InputError, match="joints.cans: no joint 'nodes': did you mean 'node'"):
        welds_of(frame, JointSettings(cans={"nodes": 0.1}))


def test_joints_without_braces_are_passed_over() -> None:
    assert tubular_joints(frame_of({})) == ()
    with pytest.raises(InputError, match="no joint at which a tube meets a chord"):
        welds_of(frame_of({}), JointSettings())


# factors --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("wall", "axial", "bending"),
    [
        (0.05, [[2.809957, 4.578861], [2.799942, 5.540248]], [[1.725759, 4.444444], [2.258850, 4.458066]]),
        (0.035, [[4.198368, 9.683928], [2.648001, 8.591926]], [[2.840054, 9.070295], [2.783452, 7.371540]]),
    ],
)
def test_t_joint(wall: float, axial: list[list[float]], bending: list[list[float]]) -> None:
    (p,) = parameters_of(joint_of(frame_of(T_JOINT, wall, reach=6.0)))
    f = factors(p, 0.7, "formula")
    assert f.axial[2] == pytest.approx(np.array(axial), rel=1e-6)
    assert f.bending[:, :2] == pytest.approx(np.array(bending), rel=1e-6)


@pytest.mark.parametrize(
    ("wall", "axial"),
    [
        (0.05, [[1.050470, 5.993221], [2.373275, 5.109007]]),
        (0.035, [[1.684815, 12.231064], [2.038478, 8.016004]]),
    ],
)
def test_x_joint(wall: float, axial: list[list[float]]) -> None:
    tall = 10.0 / sqrt(3.0)
    joint = joint_of(frame_of({"a": (10.0, 0.0, tall), "b": (-10.0, 0.0, -tall)}, wall))
    for p in parameters_of(joint):
        assert factors(p, 0.7, "formula").axial[1] == pytest.approx(np.maximum(axial, LEAST), rel=1e-6)
        balanced = p.gamma * p.tau * p.beta * (1.56 - 1.34 * p.beta**4) * 0.75**0.8  # X5
        assert factors(p).bending[0, 2] == pytest.approx(balanced, rel=1e-12)


def test_load_in_one_brace_of_an_x_joint() -> None:
    """Saddles have those of a T joint times 1 - 0.26 beta^3 (X7, X8), crowns those of a T joint."""
    alone = parameters_of(joint_of(frame_of(T_JOINT)))[0]
    for p in parameters_of(joint_of(frame_of(X_JOINT))):
        assert p == alone._replace(opposed=True)
        ratio = efthymiou(p, 0.7, "frame").axial[2] / efthymiou(alone, 0.7, "frame").axial[2]
        assert ratio == pytest.approx(np.array([[1.0, 1.0 - 0.26 * (2.0 / 3.0) ** 3]] * 2), rel=1e-12)


def test_k_joint() -> None:
    for p in parameters_of(joint_of(frame_of(K_JOINT))):
        f = factors(p)
        assert f.axial[0] == pytest.approx(np.array([[1.914810] * 2, [1.941673] * 2]), rel=1e-6)
        alone = efthymiou(p._replace(zeta=np.nan), 0.7, "frame").bending[:, 1]
        assert f.bending[:, 1] == pytest.approx(np.maximum([3.277339, 3.287383], alone), rel=1e-6)
        assert f.bending[0, 1] == pytest.approx(3.277339, rel=1e-6)


def test_short_chord() -> None:
    short, long = (Parameters(2.0 / 3.0, 12.0, 0.4, alpha, pi / 2) for alpha in (8.0, 12.0))
    for C, relief in ((0.5, 0.940053), (0.7, 0.991565)):
        f, whole = efthymiou(short, C, "formula"), efthymiou(short._replace(alpha=8.0), C, "formula")
        assert f.axial[1, 0, 1] == pytest.approx(relief * efthymiou(long, C, "formula").axial[1, 0, 1], rel=1e-6)
        assert f.axial[1, 0, 0] == pytest.approx(whole.axial[1, 0, 0])  # crowns are not relieved
    ratio = efthymiou(short, 0.7, "formula").bending / efthymiou(long, 0.7, "formula").bending
    assert ratio[:, 1:] == pytest.approx(np.full((2, 2), 0.959084), rel=1e-6)
    assert ratio[:, 0] == pytest.approx([1.0, 1.0])


def test_bending_of_the_chord_from_the_frame_is_alpha_of_zero_at_the_crowns() -> None:
    p = Parameters(0.5, 15.0, 0.6, 20.0, pi / 3)
    crowns = efthymiou(p, 0.7, "frame").axial[2, :, 0]
    plate = 15.0**0.2 * 0.6 * (2.65 + 5.0 * 0.15**2) - 3.0 * 0.6 * 0.5 * np.sin(pi / 3)
    brace = 3.0 + 15.0**1.2 * (0.12 * np.exp(-2.0) + 0.011 * 0.25 - 0.045) - 1.2 * 0.5 * 0.6
    assert crowns == pytest.approx([plate, brace], rel=1e-12)
    assert efthymiou(p, 0.7, "formula").axial[2, :, 0] == pytest.approx(
        crowns + 0.6 * 0.5 * 20.0 * np.array([0.35 * np.sin(pi / 3), 0.14]), rel=1e-12
    )


def test_outside_the_ranges_the_larger_factor_counts_and_is_reported() -> None:
    p = Parameters(0.5, 45.0, 0.6, 60.0, pi / 2)
    assert outside(p) == ["gamma", "alpha"]
    assert at_limits(p)[1] == 32.0 and at_limits(p).alpha == 40.0
    here, limited = efthymiou(p, 0.7, "formula"), efthymiou(at_limits(p), 0.7, "formula")
    f = factors(p, 0.7, "formula")
    assert (f.axial >= np.maximum(here.axial, limited.axial)).all() and f.axial.min() >= LEAST
    assert f.axial[2, 0, 1] == here.axial[2, 0, 1] > limited.axial[2, 0, 1]
    thin = Parameters(0.5, 4.0, 0.6, 20.0, pi / 2)
    assert factors(thin).bending[0, 1] == efthymiou(at_limits(thin), 0.7, "frame").bending[0, 1]
    assert outside(Parameters(0.5, 12.0, 0.6, 20.0, pi / 2)) == []
    wide = Parameters(0.5, 12.0, 0.6, 20.0, pi / 2, zeta=1.5, near=(0.5, 0.6, 1.0, 1.5))
    assert outside(wide) == ["zeta"]


def test_overlapping_braces() -> None:
    steep = joint_of(frame_of({"a": (10.0, 0.0, 4.0), "b": (10.0, 0.0, -4.0)}))
    (p, _), apart = parameters_of(steep), parameters_of(joint_of(frame_of(K_JOINT)))[0]
    assert p.zeta < 0.0 < apart.zeta
    near = (*p.near[:3], 0.0)
    assert factors(p).axial[0, 1, 0] > factors(p._replace(near=near)).axial[0, 1, 0]
    assert factors(p).bending[1, 0] > factors(p._replace(near=near)).bending[1, 0]


# hot spots ------------------------------------------------------------------------------------------------

PLAIN = Factors(np.array([[[2.0, 3.0], [4.0, 5.0]]] * 3), np.array([[1.5, 6.0, 1.0], [2.5, 7.0, 2.0]]))


def test_superposition_of_axial_and_bending_stress() -> None:
    frame = frame_of({"a": (0.0, 10.0, 0.0)})  # the brace's x is along (1, 0, 0), its y is down
    joint = joint_of(frame)
    tension = hot_spots(joint, [PLAIN], loads_of(frame, a=[0, 0, 1e6, 0, 0, 0]), "geometry")[0, :, :, 0] * AREA / 1e6
    chord = [2.0, 2.5, 3.0, 2.5, 2.0, 2.5, 3.0, 2.5]
    assert tension == pytest.approx(np.array([chord, np.add(chord, 2.0)]), rel=1e-12)
    in_plane = hot_spots(joint, [PLAIN], loads_of(frame, a=[0, 0, 0, 1e5, 0, 0]), "geometry")[0, :, :, 0]
    out_of_plane = hot_spots(joint, [PLAIN], loads_of(frame, a=[0, 0, 0, 0, 1e5, 0]), "geometry")[0, :, :, 0]
    wave = np.cos(0.25 * pi * np.arange(8)) * 1e5 / MODULUS
    assert np.abs(in_plane) == pytest.approx(np.abs(np.outer([1.5, 2.5], wave)), abs=1.0)
    assert np.abs(out_of_plane) == pytest.approx(np.abs(np.outer([6.0, 7.0], np.roll(wave, 2))), abs=1.0)


def test_moments_are_those_where_the_brace_meets_the_chord() -> None:
    frame = frame_of(T_JOINT)
    joint = joint_of(frame)
    # a force P across the tip of a brace: M = P (10 - s)
    start = [0.0, 1e4, 0.0, -1e5, 0.0, 0.0]
    stresses = weld_stresses(joint, joint.braces[0], loads_of(frame, a=start))
    assert np.linalg.norm(stresses[0, 1:]) == pytest.approx(1e4 * (10.0 - 0.6) / MODULUS, rel=1e-12)
    turned = frame.replace(members=dict(frame.members) | {"a": Member(joints=("end-a", "node"), section="brace")})
    opposed = [0.0, 1e4, 0.0, 1e5, 0.0, 0.0]  # P on the tip at the start: M = P s
    other = weld_stresses(joint_of(turned), joint_of(turned).braces[0], loads_of(turned, a=opposed))
    assert np.linalg.norm(other[0, 1:]) == pytest.approx(1e4 * (10.0 - 0.6) / MODULUS, rel=1e-12)


def test_bending_of_the_chord_adds_at_the_crowns() -> None:
    frame = frame_of(T_JOINT)
    joint = joint_of(frame)
    loads = loads_of(frame, upper=[0, 0, 0, 0, -1e6, 0], lower=[0, 0, 0, 0, -2e6, 0])
    W = pi / 32.0 * (1.2**4 - 1.1**4) / 1.2
    stress = hot_spots(joint, [PLAIN], loads, "geometry")[0, :, :, 0] * W / 1e6
    up = 0 if joint.axis[2] > 0.0 else 4  # which crown lies above
    assert stress[0, [up, 4 - up]] == pytest.approx([ATTACHMENT[0], 2.0 * ATTACHMENT[0]], rel=1e-9)
    assert stress[1, up] == pytest.approx(0.4 * ATTACHMENT[0], rel=1e-9)
    assert stress[:, [2, 6]] == pytest.approx(np.zeros((2, 2)), abs=1e-9)
    assert not hot_spots(joint, [PLAIN], loads, "geometry", bending=False).any()


def test_axial_stress_of_the_chord_adds_at_the_crowns() -> None:
    """A force through the chord does; what a brace brings, half to each side of a chord held at both ends, does not."""
    frame = frame_of(T_JOINT)
    joint, A = joint_of(frame), 0.25 * pi * (1.2**2 - 1.1**2)
    through, brought = (
        loads_of(frame, upper=[0, 0, force, 0, 0, 0], lower=[0, 0, 3e6, 0, 0, 0]) for force in (1e6, -3e6)
    )
    stress = hot_spots(joint, [PLAIN], through, "geometry", bending=False)[0, :, :, 0] * A / 1e6
    around = 2.0 * ATTACHMENT[0] * np.cos(0.25 * pi * np.arange(8)) ** 2
    assert stress == pytest.approx(np.array([around, 0.4 * around]), abs=1e-9)
    assert not hot_spots(joint, [PLAIN], brought, "geometry").any()
    assert not hot_spots(joint, [PLAIN], through, "geometry", axial=False).any()


def share(braces: dict[str, tuple[float, float, float]], **forces: float) -> Float:
    frame = frame_of(braces)
    loads = loads_of(frame, **{name: [0, 0, force, 0, 0, 0] for name, force in forces.items()})
    return classes(joint_of(frame), loads, "load path")[:, :, 0]


def test_classification_by_load_path() -> None:
    k, x, y = np.eye(3)
    assert share(K_JOINT, a=1.0, b=-1.0) == pytest.approx(np.array([k, k]))
    assert share(K_JOINT, a=1.0, b=1.0) == pytest.approx(np.array([y, y]))
    assert share(K_JOINT, a=1.0, b=-0.25) == pytest.approx(np.array([0.25 * k + 0.75 * y, k]))
    assert share(X_JOINT, a=-1.0, b=-1.0) == pytest.approx(np.array([x, x]))
    assert share(X_JOINT, a=1.0, b=-1.0) == pytest.approx(np.array([y, y]))  # both push the chord the same way
    assert share(X_JOINT, a=1.0, b=0.4) == pytest.approx(np.array([0.4 * x + 0.6 * y, x]))
    assert share(T_JOINT, a=0.0) == pytest.approx(np.array([y]))
    double = K_JOINT | {"c": (-10.0, 0.0, 10.0)}
    assert share(double, a=1.0, b=-0.5, c=0.25) == pytest.approx(np.array([0.5 * k + 0.25 * x + 0.25 * y, k, x]))
    across = K_JOINT | {"c": (0.0, 10.0, 0.0)}  # another plane takes no part
    assert share(across, a=1.0, b=-1.0, c=5.0)[2] == pytest.approx(y)


def test_classification_by_geometry() -> None:
    for braces, kind in ((T_JOINT, 2), (X_JOINT, 1), (K_JOINT, 0)):
        frame = frame_of(braces)
        shares = classes(joint_of(frame), {}, "geometry")[:, :, 0]
        assert shares.tolist() == [np.eye(3)[kind].tolist()] * len(braces)


def test_out_of_plane_bending_is_balanced_through_the_chord() -> None:
    frame = frame_of(X_JOINT)
    joint = joint_of(frame)
    loads = loads_of(frame, a=[0, 0, 0, 0, 1e5, 0])
    alone = np.abs(hot_spots(joint, [PLAIN] * 2, loads)[0, 0, :, 0]).max()
    assert alone == pytest.approx(6.0 * 1e5 / MODULUS, rel=1e-9)
    opposed = {}
    for sign in (1.0, -1.0):
        loads = loads_of(frame, a=[0, 0, 0, 0, 1e5, 0], b=[0, 0, 0, 0, sign * 1e5, 0])
        stresses = np.array([weld_stresses(joint, brace, loads) for brace in joint.braces])
        through = np.abs(stresses[:, :, 2].sum()) < 1e-3  # a moment that goes on in the other brace
        opposed[bool(through)] = np.abs(hot_spots(joint, [PLAIN] * 2, loads)[0, 0, :, 0]).max()
    assert opposed[True] == pytest.approx(1.0 / 6.0 * alone) and opposed[False] == pytest.approx(alone)
    by_geometry = hot_spots(joint, [PLAIN] * 2, loads_of(frame, a=[0, 0, 0, 0, 1e5, 0]), "geometry")
    assert np.abs(by_geometry[0, 0, :, 0]).max() == pytest.approx(alone / 6.0)


def test_missing_loads_are_named() -> None:
    frame = frame_of(T_JOINT)
    with pytest.raises(InputError, match="member 'a' at its start are missing"):
        hot_spots(joint_of(frame), [PLAIN], {})


# S-N curves -----------------------------------------------------------------------------------------------


def test_t_curve() -> None:
    cp, air, free = (sn_curve("T", environment) for environment in ("cathodic", "air", "free"))
    assert 1.0 / cp.rate(np.array([1e8]))[0] == pytest.approx(10.0 ** (12.18 - 6.0))
    assert 1.0 / cp.rate(np.array([5e7]))[0] == pytest.approx(10.0 ** (16.13 - 5.0 * log10(50.0)))
    assert 1.0 / air.rate(np.array([67.09e6]))[0] == pytest.approx(1e7, rel=0.01)  # fatigue limit of the table
    assert 1.0 / free.rate(np.array([5e6]))[0] == pytest.approx(10.0 ** (12.03 - 3.0 * log10(5.0)))
    thick = cp.rate(np.array([1e8]), 0.032)[0] / cp.rate(np.array([1e8]), 0.010)[0]
    assert thick == pytest.approx(2.0 ** (0.25 * 3.0))


def test_all_curves_meet_at_their_knee_and_get_worse_from_detail_to_detail() -> None:
    for source in (editions()[year] for year in ("2016", "2024")):
        for environment in ("air", "cathodic", "free"):
            at = [source.curves[name][environment].rate(np.array([1e8]))[0] for name in ("B1", "B2", "C", "C1", "C2")]
            at += [source.curves[name][environment].rate(np.array([1e8]))[0] for name in ("D", "E", "F", "F1", "F3")]
            at += [source.curves[name][environment].rate(np.array([1e8]))[0] for name in ("G", "W1", "W2", "W3")]
            assert at == sorted(at)
    new, old = (editions()[year].curves["C"]["air"] for year in ("2024", "2016"))
    assert (new.m[0], old.m[0]) == (3.5, 3.0)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ("unit: ksi", "expected MPa"),
        ("log_a: [30.18, 46.13]", "is it in Pa or ksi"),
        ("log_a: [9.664, 11.937]", "is it in Pa or ksi"),
        ("log_a: [12.18, 15.13]", "do not meet at the knee"),
        ("log_a: [12.18]", "each slope needs its log_a"),
    ],
)
def test_curves_in_other_units_are_refused(tmp_path: Path, change: str, words: str) -> None:
    text = "source: mine\nunit: MPa\ncurves:\n  T:\n    cathodic:\n      m: [3, 5]\n      log_a: [12.18, 16.13]\n"
    text += "      knee: 1.8e6\n"
    path = tmp_path / "curves.yaml"
    path.write_text(text, encoding="utf-8")
    assert sn_curve("T", "cathodic", str(path)).knee == 1.8e6
    key = change.split(":")[0]
    line = next(line for line in text.splitlines() if line.strip().startswith(key))
    path.write_text(text.replace(line.strip(), change), encoding="utf-8")
    with pytest.raises(InputError, match=words):
        sn_curve("T", "cathodic", str(path))


def test_unknown_curves_are_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no curve 'TT'"):
        sn_curve("TT")
    with pytest.raises(InputError, match="no edition '2017'"):
        sn_curve("T", "air", "2017")
    path = tmp_path / "air.yaml"
    path.write_text("source: s\nunit: MPa\ncurves: {T: {air: {m: [3], log_a: [12.0]}}}\n", encoding="utf-8")
    with pytest.raises(InputError, match="not for 'free'; s has air"):
        sn_curve("T", "free", str(path))


def test_damage_of_a_sine() -> None:
    curve = sn_curve()
    x = 50e6 * np.cos(2.0 * pi * 0.1 * np.arange(0.0, 1000.05, 0.05))
    expected = 100.0 * curve.rate(np.array([1e8]))[0]
    assert curve.damage(rainflow_cycles(x)) == pytest.approx(expected, rel=1e-3)


def gaussian(humps: list[tuple[float, float, float]], n: int = 2**18, dt: float = 0.1) -> Float:
    """Stress [N/m^2] with a spectrum of humps (frequency, width, share)."""
    rng = np.random.default_rng(7)
    f = np.fft.rfftfreq(n, dt)
    density = sum(share / width * np.exp(-(((f - middle) / width) ** 2)) for middle, width, share in humps)
    x = np.fft.irfft(np.sqrt(density) * np.exp(2j * pi * rng.random(len(f))), n)
    return np.asarray(x / x.std() * 25e6)


def test_dirlik_against_rainflow_for_two_humps() -> None:
    """Dirlik's formula is 7 % low with one slope of 3, 12 % with two slopes; for one hump 3 % (theory, F-65)."""
    x, dt = gaussian([(0.1, 0.02, 1.0), (0.6, 0.1, 0.7)]), 0.1
    duration = dt * (len(x) - 1)
    spectrum = power_spectrum(x, dt=dt, resolution=0.005)
    for environment, low in (("free", 0.925), ("cathodic", 0.883)):
        curve = sn_curve("T", environment)
        counted = curve.damage(rainflow_cycles(x))
        dirlik = spectral_damage(spectrum.frequency, spectrum.density, duration, curve)
        narrow = spectral_damage(spectrum.frequency, spectrum.density, duration, curve, method="narrow_band")
        assert dirlik == pytest.approx(low * counted, rel=0.02)
        assert narrow > 1.15 * counted  # an upper bound


def test_dirlik_against_rainflow_for_one_hump() -> None:
    x, dt = gaussian([(0.3, 0.15, 1.0)]), 0.1
    spectrum, curve = power_spectrum(x, dt=dt, resolution=0.005), sn_curve()
    counted = curve.damage(rainflow_cycles(x))
    dirlik = spectral_damage(spectrum.frequency, spectrum.density, dt * len(x), curve)
    assert dirlik == pytest.approx(counted, rel=0.03)


def test_narrow_band_damage_is_rayleighs() -> None:
    f = np.linspace(0.0, 1.0, 2001)
    density = np.exp(-(((f - 0.2) / 0.004) ** 2))
    density *= (30e6) ** 2 / (density.sum() * f[1])
    curve = Curve(m=(3.0,), log_a=(12.0,))
    rate = sqrt(float((f**2 * density).sum() / density.sum()))
    closed = 3600.0 * rate / 1e12 * (2.0 * sqrt(2.0) * 30.0) ** 3 * gamma(2.5)
    assert spectral_damage(f, density, 3600.0, curve, method="narrow_band") == pytest.approx(closed, rel=1e-4)
    assert spectral_damage(f, density, 3600.0, curve) == pytest.approx(closed, rel=0.03)
    assert spectral_damage(f, 0.0 * density, 3600.0, curve) == 0.0


# damage over a lifetime -----------------------------------------------------------------------------------

FRAME = frame_of(K_JOINT)


def case(seed: int, hours: float = 1e5, sign: float = 1.0, frame: Frame = FRAME) -> LoadCase:
    loads = {
        (name, place): sign * noise(seed + 10 * i)
        for i, name in enumerate(frame.members)
        for place in ("start", "middle", "end")
    }
    return LoadCase(f"case {seed}", loads, 599.9, hours)


def test_tables_of_damage() -> None:
    cases = [case(1), case(2, hours=5e4)]
    result = joint_fatigue(FRAME, cases)
    table = result.table
    assert len(table) == 2 * 2 * 8 and set(table["side"]) == {"chord", "brace"}
    assert (table["life"] * table["damage"]).to_numpy() == pytest.approx(np.full(32, 20.0))
    assert table["utilisation"].to_numpy() == pytest.approx(3.0 * table["damage"].to_numpy())
    assert (table["curve"] == "T, free").all()  # at sea level, in the splash zone
    single = [joint_fatigue(FRAME, [each]) for each in cases]
    assert table["damage"].to_numpy() == pytest.approx(sum(each.table["damage"].to_numpy() for each in single))
    assert result.shares.loc["node"].sum() == pytest.approx(1.0)
    worst = result.worst.iloc[0]
    assert worst["damage"] == table["damage"].max()
    curve, thickness = sn_curve("T", "free"), 0.05 if worst["side"] == "chord" else 0.02
    assert curve.damage(result.markov["node"], thickness) == pytest.approx(worst["damage"], rel=1e-3)


def test_life_of_an_x_joint_by_hand() -> None:
    """Crossing braces of the OC4 jacket, 0.8 m by 20 mm at 60 degrees, under a balanced axial sine of 200 kN and 5 s.

    Area pi 0.78 0.02 = 0.049009 m^2, nominal stress +- 4.0809 MPa. X1 with beta = tau = 1, gamma = 20:
    3.87 20 0.10 sin(60)^1.7 = 6.0609. Range at the chord's saddle 2 6.0609 4.0809 = 49.467 MPa, by the thickness
    (20 / 16)^0.25 = 1.05737 in effect 52.305 MPa. With cathodic protection N = 10^16.13 / 52.305^5 = 3.4457e7 (above
    the knee at 1.8e6, 94.4 MPa), free N = 10^12.03 / 52.305^3 = 7.4879e6. 365.25 86400 / 5 = 6311520 cycles a year:
    lives of 5.459 and 1.186 years; damage of 20 years times DFF 3: 10.99 and 50.57.
    """
    frame = frame_of({"a": (5.0 * sqrt(3.0), 0.0, 5.0), "b": (-5.0 * sqrt(3.0), 0.0, -5.0)})
    frame = frame.replace(sections=dict.fromkeys(("leg", "brace"), TUBE))
    force = np.zeros((20 * 500 + 1, 6))
    force[:, 2] = 2e5 * np.cos(2.0 * pi * np.arange(len(force)) / 20)  # 500 cycles, which half cycles end
    case = LoadCase("sine", loads_of(frame, a=force, b=force), 2500.0, 20.0 * 8766.0)
    for around, life, utilisation in (("cathodic", 5.459, 10.99), ("free", 1.186, 50.57)):
        settings = JointSettings(environment=around)  # type: ignore[arg-type]
        worst = joint_fatigue(frame, [case], settings, years=20.0).worst.iloc[0]
        assert (worst["side"], worst["position"] % 180) == ("chord", 90)
        assert (worst["life"], worst["utilisation"]) == pytest.approx((life, utilisation), rel=5e-4)


def test_damage_is_that_of_the_mirrored_loads() -> None:
    plus, minus = (joint_fatigue(FRAME, [case(1, sign=sign)]).table["damage"] for sign in (1.0, -1.0))
    assert plus.to_numpy() == pytest.approx(minus.to_numpy(), rel=1e-9)


def test_symmetric_joint_has_symmetric_damage() -> None:
    """Braces mirrored about z = 0: the mirror keeps forces along x, and moments about the directions across."""
    given = case(3)
    x = given.loads["a", "start"]
    loads = dict(given.loads)
    chord = np.zeros_like(x)
    for place in ("start", "middle", "end"):
        loads["lower", place] = loads["upper", place] = chord
        loads["a", place] = x * np.array([0.0, 0.0, 1.0, 1.0, 0.0, 0.0])
        loads["b", place] = x * np.array([0.0, 0.0, 1.0, -1.0, 0.0, 0.0])
    table = joint_fatigue(FRAME, [given._replace(loads=loads)]).table.set_index(["brace", "side", "position"])["damage"]
    for side in ("chord", "brace"):
        for angle in range(0, 360, 45):
            opposite = (180 - angle) % 360
            assert table["a", side, angle] == pytest.approx(table["b", side, opposite], rel=1e-9)


def test_member_that_begins_at_its_other_joint_has_the_same_damage() -> None:
    turned = FRAME.replace(members=dict(FRAME.members) | {"a": Member(joints=("end-a", "node"), section="brace")})
    given = case(4)
    here = joint_of(FRAME).braces[0].tube.axes @ joint_of(turned).braces[0].tube.axes.T
    flip = np.zeros((6, 6))
    flip[:3, :3] = flip[3:, 3:] = -here
    other = {("a", "end"): given.loads["a", "start"] @ flip, ("a", "start"): given.loads["a", "end"]}
    loads = dict(given.loads) | other
    one = joint_fatigue(FRAME, [given]).table["damage"]
    two = joint_fatigue(turned, [given._replace(loads=loads)]).table["damage"]
    assert two.to_numpy() == pytest.approx(one.to_numpy(), rel=1e-9)


@pytest.mark.parametrize(
    "change",
    [
        {"curve": "D"},
        {"environment": "air"},
        {"splash_zone": (2.0, 6.0)},
        {"classification": "geometry"},
        {"chord_bending": "formula"},
        {"chord_axial": False},
        {"cans": {"node": 0.08}},
        {"fixity": 1.0},
        {"alpha": 6.0},
        {"counting": "dirlik"},
    ],
    ids=str,
)
def test_every_setting_of_fatigue_changes_the_damage(change: dict[str, Any]) -> None:
    given = [case(1)]
    usual, other = (joint_fatigue(FRAME, given, JointSettings(**each)).table["damage"] for each in ({}, change))
    assert abs(other.sum() / usual.sum() - 1.0) > 1e-4


def test_edition_and_design_fatigue_factor() -> None:
    given = [case(1)]
    old, new = (joint_fatigue(FRAME, given, JointSettings(curve="C", edition=year)) for year in ("2016", "2024"))
    assert old.table["curve"][0] == "C, free" and old.table["damage"].equals(new.table["damage"])  # as in the tables
    air = [JointSettings(curve="C", edition=year, environment="air") for year in ("2016", "2024")]
    assert np.ptp([joint_fatigue(FRAME, given, s).table["damage"].sum() for s in air]) > 0.0
    factored = joint_fatigue(FRAME, given, JointSettings(design_fatigue_factor=2.0)).table
    assert factored["utilisation"].to_numpy() == pytest.approx(2.0 * factored["damage"].to_numpy())


def test_environment_by_height() -> None:
    s = JointSettings(splash_zone=(-3.0, 5.0))
    assert [environment_at(z, s) for z in (-10.0, 0.0, 8.0)] == ["cathodic", "free", "air"]


def test_no_cases_are_refused() -> None:
    with pytest.raises(InputError, match="no cases"):
        joint_fatigue(FRAME, [])


def test_picture_has_both_scales() -> None:
    figure = plot_joint_damage(FRAME, {"node": 0.5}, {"a": 0.3, "upper": 1.2})
    labels = [ax.get_ylabel() for ax in figure.axes]
    assert "members: utilisation [-]" in labels and any("DFF" in label for label in labels)
    assert all(ax.get_xlabel().endswith("[m]") for ax in figure.axes[:2])
    assert isnan(Parameters(0.5, 12.0, 0.5, 20.0, 1.0).zeta)


def test_joints_of_the_oc4_jacket() -> None:
    """Numbers of a public post-processor of this jacket: 24 T/Y, 32 X and 48 K ends (it counts 16 more K, for both
    walls of the chord), gaps of 0.25, 0.296 and 0.34 D, alpha 3.12 of the lowest braces, 41 to 57 of the K joints."""
    frame = load_turbine("nrel5mw-jacket").frame
    joints = tubular_joints(frame)
    kinds = np.concatenate([classes(joint, {}, "geometry")[:, :, 0] for joint in joints])
    assert kinds.sum(axis=0).tolist() == [48.0, 32.0, 24.0]
    given = [p for joint in joints for p in parameters_of(joint)]
    of_k = [p for p, kind in zip(given, kinds, strict=True) if kind[0]]
    assert sorted({round(p.zeta, 2) for p in of_k}) == [0.25, 0.3, 0.34]
    assert sorted({round(p.alpha) for p in of_k}) == [41, 48, 57]
    assert min(p.alpha for p in given) == pytest.approx(3.12, abs=0.01)
    on_legs = {(round(p.beta, 3), round(p.gamma, 1), round(p.tau, 3)) for p in given if p.beta < 1.0}
    assert on_legs == {(0.667, 12.0, 0.4), (0.667, 17.1, 0.571)}
