"""Utilisation of tubular members: closed forms, limits, and values of public code.

Reference values are those of the formulas of a public checker of NORSOK N-004 revision 3 (NorsokChecker for IDEA
StatiCa), and of a public code for ISO 19902:2007 (svortega/steelpy), for a tube of 0.8 x 0.020 m, 20 m long.
"""

from __future__ import annotations

from math import pi, sqrt

import numpy as np
import pytest

from meltemi import InputError
from meltemi.frames.definition import Frame, Member, Section
from meltemi.frames.joints.fatigue import largest_utilisations
from meltemi.frames.joints.settings import JointSettings
from meltemi.frames.joints.utilisation import (
    CLAUSES,
    Standard,
    Strengths,
    column_strength,
    material_factor,
    member_checks,
    strengths,
)

TUBE = Section(diameter=0.8, thickness=0.02)
AREA, INERTIA = 0.25 * pi * (0.8**2 - 0.76**2), pi / 64.0 * (0.8**4 - 0.76**4)
LOADS = np.array([[2e5, 0.0, -4e6, 1e6, 5e5, 1e5], [2e5, 0.0, 4e6, 1e6, 5e5, 1e5]])
LIMIT = 355e6


def test_norsok_against_public_code() -> None:
    ratios = member_checks(LOADS, TUBE, 20.0, k=0.8).ratios
    assert ratios[1:4, 0] == pytest.approx([0.6203945506819806, 0.5758257257098973, 0.07588327476732591], rel=1e-12)
    assert ratios[0, 1] == pytest.approx(0.4089165489837085, rel=1e-12)
    assert not ratios[0, 0] and not ratios[1:3, 1].any() and not ratios[4:].any()


def test_slender_wall_has_a_larger_material_factor() -> None:
    wall = Section(diameter=2.0, thickness=0.02)
    checks = member_checks(np.array([[2e5, 0.0, -8e6, 6e6, 5e5, 1e5]]), wall, 20.0, k=0.8)
    assert checks.ratios[1:4, 0] == pytest.approx(
        [0.4849737636213366, 0.5213103553706298, 0.022641545689589725], rel=1e-12
    )
    assert 1.15 <= checks.factors["gamma_M"] <= 1.45


def test_iso_against_public_code() -> None:
    ratios = member_checks(LOADS, TUBE, 20.0, standard="ISO 19902", k=0.8).ratios
    assert ratios[1, 0] == pytest.approx(0.6016411237210362, rel=1e-9)
    assert ratios[3, 0] == pytest.approx(0.06928472913538465, rel=1e-9)
    assert ratios[0, 1] == pytest.approx(0.525753923474255, rel=1e-9)


def test_stocky_tube_yields() -> None:
    s = strengths(Section(diameter=0.5, thickness=0.025), 0.01, LIMIT)
    assert (s.local, s.hoop) == (LIMIT, LIMIT)
    assert s.column == pytest.approx(LIMIT, rel=1e-3)
    axial = np.array([[0.0, 0.0, 1e6, 0.0, 0.0, 0.0]])
    area = 0.25 * pi * (0.5**2 - 0.45**2)
    ratio = member_checks(axial, Section(diameter=0.5, thickness=0.025), 1.0).ratios[0, 0]
    assert ratio == pytest.approx((1.15 * 1e6 / area / LIMIT) ** 1.75, rel=1e-12)
    linear = member_checks(axial, Section(diameter=0.5, thickness=0.025), 1.0, standard="ISO 19902").ratios[0, 0]
    assert linear == pytest.approx(1.05 * 1e6 / area / LIMIT, rel=1e-12)


def test_slender_column_is_eulers() -> None:
    s = strengths(TUBE, 80.0, LIMIT)
    euler = pi**2 * 210e9 * INERTIA / AREA / 80.0**2
    assert s.euler == pytest.approx(euler, rel=1e-12) and s.column == pytest.approx(0.9 * euler, rel=1e-9)


def test_hoop_buckling_strength() -> None:
    assert strengths(TUBE, 20.0, LIMIT).elastic_hoop == pytest.approx(115.5e6, rel=1e-9)  # 2 x 0.44 E (t/D)^2
    per_length = 0.8 / sqrt(2.0 * 40.0)  # length over mu
    for mu, jump in ((1.5, 0.001), (33.0, 0.02), (64.0, 0.08)):
        below, above = (strengths(TUBE, x * mu * per_length, LIMIT).elastic_hoop for x in (0.9999, 1.0001))
        assert below == pytest.approx(above, rel=jump)
    assert strengths(TUBE, per_length, LIMIT).elastic_hoop == pytest.approx(2.0 * 0.8 * 210e9 / 40.0, rel=1e-9)
    steps = [strengths(TUBE, length, LIMIT).hoop for length in (0.5, 3.0, 20.0)]
    assert steps == sorted(steps, reverse=True) and steps[0] == LIMIT


def test_strength_of_a_column_under_pressure_is_continuous() -> None:
    s = strengths(TUBE, 20.0, LIMIT)
    assert column_strength(s, 0.0) == pytest.approx(s.column, rel=1e-12)
    for share in (0.05, 0.2, 0.4):
        knee = 1.34 / sqrt(1.0 - 2.0 * share)
        below, above = (column_strength(s._replace(slenderness=x * knee), share * s.local) for x in (0.9999, 1.0001))
        assert below == pytest.approx(above, rel=0.01)


def test_pressure() -> None:
    idle = np.zeros((1, 6))
    checks = member_checks(idle, TUBE, 20.0, pressure=5e5, end_caps=False)
    hoop = 5e5 * 0.8 / 0.04
    assert checks.factors["sigma_p"] == pytest.approx(hoop)
    assert checks.ratios[5, 0] == pytest.approx(checks.factors["gamma_M"] * hoop / checks.factors["f_h"], rel=1e-12)
    assert checks.ratios[2, 0] == pytest.approx(0.5 * hoop * 1.15 / LIMIT, rel=0.01)  # pressure on the ends alone
    # the wall force of a closed tube contains the pressure on its ends: the same member
    wall = np.array([[0.0, 0.0, -0.5 * hoop * AREA, 0.0, 0.0, 0.0]])
    assert member_checks(wall, TUBE, 20.0, pressure=5e5).ratios == pytest.approx(checks.ratios, abs=1e-12)
    bent = np.array([[0.0, 0.0, 1e6, 1e6, 0.0, 0.0]])
    dry, wet = (member_checks(bent, TUBE, 20.0, pressure=p, end_caps=False).ratios.max() for p in (0.0, 5e5))
    assert wet > dry


def test_local_buckling_under_pressure() -> None:
    thin = Section(diameter=2.0, thickness=0.02)
    squeezed = np.array([[0.0, 0.0, -2e7, 0.0, 0.0, 0.0]])
    assert member_checks(squeezed, thin, 20.0, pressure=4e5).ratios[6, 0] > 0.0
    assert member_checks(squeezed, thin, 20.0).ratios[6, 0] == 0.0


def test_shear_beside_bending() -> None:
    loads = np.array([[4e6, 0.0, 0.0, 1e6, 0.0, 0.0]])
    ratios = member_checks(loads, TUBE, 5.0).ratios[:, 0]
    assert ratios[3] > 0.4 and ratios[4] == pytest.approx((ratios[0] + ratios[3]) / 1.4, rel=1e-9)


def test_material_factor() -> None:
    s = Strengths(1.0, 1.0, 1.0, 1.0, 4.0, 1.0, 4.0, 0.5)  # f_y = 4 x 0.2: slender
    assert material_factor(s, 0.8, np.array([0.0, 2.0, 9.0]), 0.0) == pytest.approx(
        [1.15, 0.85 + 0.6 * sqrt(0.8), 1.45]
    )
    assert material_factor(s._replace(elastic_local=40.0), 0.8, np.array([9.0]), 0.0) == pytest.approx([1.15])


def test_refusals() -> None:
    with pytest.raises(InputError, match="is it in MPa"):
        member_checks(LOADS, TUBE, 20.0, yield_stress=355.0)
    with pytest.raises(InputError, match="tubes with a wall"):
        member_checks(LOADS, Section(kind="rectangle", width=1.0, height=1.0, thickness=0.02), 20.0)
    with pytest.raises(InputError, match="is it in mm"):
        Section(diameter=800.0, thickness=20000.0)


FRAME = Frame(
    depth=50.0,
    joints={"a": (0.0, 0.0, -40.0), "b": (8.0, 0.0, -20.0)},
    sections={"tube": TUBE, "box": Section(kind="rectangle", width=1.0, height=1.0, thickness=0.02)},
    members={"brace": Member(joints=("a", "b"), section="tube"), "beam": Member(joints=("a", "b"), section="box")},
    interface=("b",),
)
MEMBER_LOADS = {(name, place): LOADS for name in FRAME.members for place in ("start", "middle", "end")}


def test_largest_utilisations_of_a_frame() -> None:
    effective = JointSettings(end_caps=False)
    used = largest_utilisations(FRAME, MEMBER_LOADS, effective)
    assert set(used) == {("brace", place) for place in ("start", "middle", "end")}  # boxes are not in the standards
    start, end = used["brace", "start"], used["brace", "end"]
    assert start[0] > end[0] and start[1] in CLAUSES["NORSOK N-004"]  # deeper
    assert largest_utilisations(FRAME, MEMBER_LOADS, effective, 1.35)["brace", "end"][0] > 1.3 * end[0]


@pytest.mark.parametrize(
    "change",
    [
        {"standard": "ISO 19902"},
        {"yield_stress": 420e6},
        {"yield_stresses": {"brace": 420e6}},
        {"effective_length": 0.7},
        {"effective_lengths": {"brace": 0.7}},
        {"moment_factor": 1.0},
        {"end_caps": False},
    ],
    ids=str,
)
def test_every_setting_changes_the_utilisation(change: dict[str, object]) -> None:
    loads = dict.fromkeys(MEMBER_LOADS, LOADS[:1])
    usual, other = (
        largest_utilisations(FRAME, loads, JointSettings.model_validate(each))["brace", "end"][0]
        for each in ({}, change)
    )
    assert abs(other / usual - 1.0) > 1e-3


@pytest.mark.parametrize("setting", [{"effective_lengths": {"brase": 0.7}}, {"yield_stresses": {"brase": 420e6}}])
def test_unknown_member_of_a_setting(setting: dict[str, dict[str, float]]) -> None:
    with pytest.raises(InputError, match=f"{next(iter(setting))}: no member 'brase'.*brace"):
        largest_utilisations(FRAME, MEMBER_LOADS, JointSettings(**setting))  # type: ignore[arg-type]


def test_clauses_are_named_for_both_standards() -> None:
    standards: tuple[Standard, ...] = ("NORSOK N-004", "ISO 19902")
    for standard in standards:
        ratios = member_checks(LOADS, TUBE, 20.0, standard=standard).ratios
        assert len(CLAUSES[standard]) == len(ratios)
