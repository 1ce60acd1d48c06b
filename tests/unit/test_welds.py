"""Fatigue of tower welds: curves by hand, stresses of a tube by closed form, signs, and the lifetime of a load base."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from importlib.util import find_spec
from math import log10, pi
from pathlib import Path

import numpy as np
import pytest
from synthetic_base import small_plan, synthetic_base

from meltemi import InputError, Result, load_turbine
from meltemi.frames.joints import fatigue as joints
from meltemi.loads.loadbase.campaign import write_campaign
from meltemi.loads.loadbase.coverage import read_results, shared_repetitions
from meltemi.postprocess.cycles import Cycles
from meltemi.postprocess.sn import editions, sn_curve
from meltemi.simulation.channels import ChannelSet, catalogue
from meltemi.strength.load_base import base_weld_fatigue, moments_at, tower_interfaces
from meltemi.strength.tube import Shell, Tube, buckling_stress, shear_stress, shell_stresses, tube_at
from meltemi.strength.welds import Weld, WeldPlan, read_welds, weld_fatigue

KNOWN = catalogue(ChannelSet(tower_stations=3))
NREL = load_turbine("nrel5mw")
MOMENTS = ("tower_base_moment_fore_aft", "tower_base_moment_side_side")
YEAR = 8760.0 * 3600.0


def result_of(series: dict[str, np.ndarray], stations: Sequence[float] = ()) -> Result:
    time = np.linspace(0.0, 600.0, 6001)
    data = np.stack([np.broadcast_to(x, time.shape) for x in series.values()], axis=1)
    meta = {"stations": {"tower": [*stations], "blade": []}}
    return Result(time, data, tuple(KNOWN[name] for name in series), meta=meta)


def wave(amplitude: float, mean: float = 0.0) -> np.ndarray:
    """60 cycles in 600 s, which begin and end at an extreme."""
    return mean + amplitude * np.cos(2.0 * np.pi * 0.1 * np.linspace(0.0, 600.0, 6001))


# S-N curves -----------------------------------------------------------------------------------------------


FATIGUE_LIMITS = {
    "B1": 106.97,
    "B2": 93.59,
    "C": 73.10,
    "C1": 65.50,
    "C2": 58.48,
    "D": 52.63,
    "E": 46.78,
    "F": 41.52,
    "F1": 36.84,
    "F3": 32.75,
    "G": 29.24,
    "W1": 26.32,
    "W2": 23.39,
    "W3": 21.05,
    "T": 67.09,
}
"""[MPa] at 1e7 cycles in air and with cathodic protection: DNVGL-RP-C203 (2016), tables 2-1 and 2-2."""


@pytest.mark.parametrize("name", FATIGUE_LIMITS)
def test_curves_of_dnv_have_the_fatigue_limit_of_the_table(name: str) -> None:
    for environment in ("air", "cathodic"):
        life = 1.0 / sn_curve(name, environment).rate(np.array([1e6 * FATIGUE_LIMITS[name]]))[0]
        assert life == pytest.approx(1e7, rel=3e-3 if name != "T" else 8e-3), environment  # its log a has two decimals
    air, free = (sn_curve(name, environment).rate(np.array([150e6]))[0] for environment in ("air", "free"))
    if name not in ("B1", "B2", "T"):  # a third of the life in air
        assert free / air == pytest.approx(3.0, rel=3e-3)


@pytest.mark.parametrize("category", editions()["EN1993"].curves)
def test_categories_of_the_eurocode(category: str) -> None:
    """EN 1993-1-9, 7.1: Delta sigma_C at 2e6, 0.737 of it at 5e6, 0.549 of that at 1e8, nothing below."""
    curve, C = sn_curve(category, "air", "EN1993"), 1e6 * float(category)
    life = 1.0 / curve.rate(np.array([2.0 * C, C, 0.737 * C, 0.549 * 0.737 * 1.002 * C]))
    assert life == pytest.approx([2e6 / 8.0, 2e6, 5e6, 1e8], rel=0.012)
    assert curve.rate(np.array([0.549 * 0.737 * 0.997 * C]))[0] == 0.0
    assert curve.rate(np.array([C]), 0.05)[0] / curve.rate(np.array([C]), 0.02)[0] == pytest.approx(2.0 ** (0.2 * 3.0))


def test_d_by_hand() -> None:
    curve = sn_curve("D", "air")
    assert 1.0 / curve.rate(np.array([100e6]))[0] == pytest.approx(10.0**12.164 / 100.0**3)
    assert 1.0 / curve.rate(np.array([20e6]))[0] == pytest.approx(10.0**15.606 / 20.0**5)
    thick = 100.0 * (0.04 / 0.025) ** 0.2
    assert 1.0 / curve.rate(np.array([100e6]), 0.04)[0] == pytest.approx(10.0**12.164 / thick**3)
    assert curve.rate(np.array([100e6]), 0.01)[0] == curve.rate(np.array([100e6]), 0.025)[0]


def test_joints_of_frames_have_the_same_curves() -> None:
    assert joints.sn_curve.__module__ == joints.Curve.__module__ == "meltemi.postprocess.sn"
    assert find_spec("meltemi.frames.joints.sn") is None


# stresses of a tube ---------------------------------------------------------------------------------------


def test_walls_of_the_nrel_tower() -> None:
    """NREL/TP-500-38060, 6.1: 6.00 and 3.87 m, 0.027 and 0.019 m, walls 30 % thicker; steel of 8500 kg/m^3."""
    for height, diameter, wall in ((0.0, 6.0, 0.027), (87.6, 3.87, 0.019)):
        tube, words = tube_at(NREL, height)
        assert tube.diameter == pytest.approx(diameter, rel=1e-6)
        assert tube.thickness == pytest.approx(1.3 * wall, rel=1e-4)
        assert words == ""
        assert tube.area * 8500.0 == pytest.approx(np.interp(height, NREL.tower.position, NREL.tower.mass), rel=1e-4)


def test_a_tower_that_is_not_of_steel_is_told() -> None:
    concrete = NREL.replace(tower=NREL.tower.replace(mass=[3.0 * m for m in NREL.tower.mass]))
    assert "density by the mass would be 25500 kg/m^3: give diameter and thickness" in tube_at(concrete, 0.0)[1]
    stiff = [1e3 * s for s in NREL.tower.fore_aft_stiffness]
    with pytest.raises(InputError, match="stiffer at 0 m than a full rod of steel"):
        tube_at(NREL.replace(tower=NREL.tower.replace(fore_aft_stiffness=stiff, side_side_stiffness=stiff)), 0.0)


def test_moments_compress_the_side_to_which_the_tower_is_pushed() -> None:
    tube = Tube(6.0, 0.03)
    downwind, left, upwind, right = 0.5 * pi * np.arange(4)
    at = np.array([downwind, left, upwind, right])
    inertia = pi / 64.0 * (6.0**4 - 5.94**4)
    pushed = shell_stresses({"moment_x": np.zeros(1), "moment_y": np.array([1e7])}, tube, at)[:, 0]
    assert pushed == pytest.approx(np.array([-1.0, 0.0, 1.0, 0.0]) * 1e7 * 3.0 / inertia, abs=1e-3)
    pushed = shell_stresses({"moment_x": np.array([1e7]), "moment_y": np.zeros(1)}, tube, at)[:, 0]
    assert pushed == pytest.approx(np.array([0.0, 1.0, 0.0, -1.0]) * 1e7 * 3.0 / inertia, abs=1e-3)  # to the right
    weight = {"moment_x": np.zeros(1), "moment_y": np.zeros(1), "force_z": np.array([-5e6])}
    assert shell_stresses(weight, tube, at)[:, 0] == pytest.approx([-5e6 / (pi * 5.97 * 0.03)] * 4)


def test_shear_of_a_thin_tube() -> None:
    tube = Tube(6.0, 1e-4)
    torsion = shear_stress({"moment_z": np.array([0.0, -1e6])}, tube)
    assert torsion == pytest.approx(1e6 / (2.0 * pi * 3.0**2 * 1e-4), rel=1e-4)  # Bredt
    shear = shear_stress({"force_x": np.array([3e5]), "force_y": np.array([4e5])}, tube)
    assert shear == pytest.approx(2.0 * 5e5 / (pi * 6.0 * 1e-4), rel=1e-4)


# fatigue --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("moment", "places"), [(0, (0.0, 180.0)), (1, (90.0, 270.0))])
def test_a_sinusoidal_moment_in_one_direction(moment: int, places: tuple[float, ...]) -> None:
    amplitude, tube = 40e6, Tube(6.0, 0.0351)
    series = {name: wave(amplitude * (k == moment), 3e7) for k, name in enumerate(MOMENTS)}
    plan = WeldPlan(welds=(Weld(height=0.0, diameter=6.0, thickness=0.0351, scf=1.2),))
    (found,), words = weld_fatigue([result_of(series)], NREL, plan, years=25.0)
    S = 1.2 * 2.0 * amplitude / tube.modulus / 1e6 * (0.0351 / 0.025) ** 0.2
    cycles = 60.0 * 25.0 * YEAR / 600.0
    line = (12.164, 3.0) if S > 52.63 else (15.606, 5.0)
    expected = cycles * S ** line[1] / 10.0 ** line[0]
    assert found.damage.max() == pytest.approx(expected, rel=1e-3)
    assert found.life == pytest.approx(25.0 / expected, rel=1e-3)
    at = np.degrees(found.angles[found.damage > 0.999 * found.damage.max()])
    assert at == pytest.approx(places)
    assert words == []
    # the range of 1 Hz of 0.1 Hz at m = 3
    assert found.load == pytest.approx(1.2 * 2.0 * amplitude / tube.modulus * 0.1 ** (1.0 / 3.0), rel=1e-3)
    assert found.damage.min() < 1e-6 * expected


def test_factors_and_shares() -> None:
    results = [result_of(dict(zip(MOMENTS, (wave(a), wave(0.0)), strict=True))) for a in (60e6, 120e6)]
    given = {"height": 0.0, "diameter": 6.0, "thickness": 0.025}
    plain = WeldPlan(welds=(Weld(**given),))

    def damage(plan: WeldPlan, shares: tuple[float, ...]) -> float:
        return float(weld_fatigue(results, NREL, plan, shares=shares)[0][0].damage.max())

    both = damage(plain, (0.3, 0.2))
    assert both == pytest.approx(0.3 * damage(plain, (1.0, 0.0)) + 0.2 * damage(plain, (0.0, 1.0)), rel=2e-3)
    large = WeldPlan(factors="iec61400-1-ed3", welds=(Weld(**given),))
    assert damage(large, (0.0, 1.0)) == pytest.approx(1.265**3 * damage(plain, (0.0, 1.0)), rel=1e-6)
    safe = WeldPlan(factors="dnv-inaccessible", welds=(Weld(**given),))
    (found,), _ = weld_fatigue(results, NREL, safe, shares=(0.0, 1.0))
    assert found.utilisation == pytest.approx(3.0 * damage(plain, (0.0, 1.0)))
    both_turbines = [results[0], replace(results[1], meta={"turbine": "other"})]
    both_turbines[0].meta["turbine"] = "nrel5mw"
    with pytest.raises(InputError, match="the results are of different turbines: nrel5mw, other"):
        weld_fatigue(both_turbines, NREL, plain)
    for shares in ((0.5,), (0.8, 0.8), (-0.1, 0.5)):
        with pytest.raises(InputError, match="shares: expected 2"):
            damage(plain, shares)


def test_loads_between_stations() -> None:
    series = dict(zip(MOMENTS, (wave(80e6), wave(0.0)), strict=True))
    series |= {"tower_station_1_moment_x": wave(0.0), "tower_station_1_moment_y": wave(40e6)}
    tube = {"diameter": 5.0, "thickness": 0.03}
    plan = WeldPlan(welds=tuple(Weld(height=h, **tube) for h in (0.0, 10.0, 40.0, 60.0)))
    found, _ = weld_fatigue([result_of(series, (40.0,))], NREL, plan)
    loads = np.array([each.load for each in found])
    assert loads / loads[0] == pytest.approx([1.0, 0.875, 0.5, 0.5])
    assert [each.loads_at for each in found] == [(0.0,), (0.0, 40.0), (40.0,), (40.0,)]
    with pytest.raises(InputError, match="place of tower station 1 is not known"):
        weld_fatigue([result_of(series)], NREL, plan)
    with pytest.raises(InputError, match="no bending moments of the tower"):
        weld_fatigue([result_of({"tower_base_force_z": wave(1.0)})], NREL)


def test_lifetime_of_a_load_base(tmp_path: Path) -> None:
    """Damage is that of the cases' cycles of bending with their weights; the same in all directions at the base."""
    planned = small_plan(("1.2",))
    turn = np.radians(40.0)

    def series(case: object, time: np.ndarray) -> dict[str, np.ndarray]:
        moment = 4e6 * case.variant.speed * np.cos(2.0 * np.pi * 0.5 * time)  # type: ignore[attr-defined]
        found = {MOMENTS[1]: np.cos(turn) * moment, MOMENTS[0]: np.sin(turn) * moment}
        found |= {"tower_station_1_moment_y": 0.4 * moment, "tower_station_1_moment_x": 0.5 * moment}
        return found | {"yaw_moment_y": 0.1 * moment}

    write_campaign(planned.campaign, tmp_path)
    synthetic_base(tmp_path, planned, series)
    (base, middle, top), words = base_weld_fatigue(tmp_path)
    assert words == []
    results, tube, curve = read_results(planned, tmp_path), tube_at(NREL, 0.0)[0], sn_curve("D", "air")
    repeated = shared_repetitions(results)
    expected = 0.0
    for case in results.present:
        S = 2.0 * 4e6 * case.variant.speed * np.cos(np.radians(10.0)) / tube.modulus  # about 30 degrees
        expected += repeated[case.name] * 0.5 * case.duration * curve.rate(np.array([S]), tube.thickness)[0]
    assert base.damage.max() == pytest.approx(expected, rel=5e-3)
    assert len(base.damage) == 12
    assert np.degrees(base.worst) == pytest.approx(120.0)  # moments about 30 degrees
    assert np.degrees(middle.worst) == pytest.approx(120.0)
    assert np.degrees(top.angles) == pytest.approx(np.arange(0.0, 360.0, 30.0))
    assert np.degrees(top.worst) == pytest.approx(0.0)
    assert top.damage[3] < 1e-9 * top.damage[0]
    two = {c: Cycles(*np.ones((3, 1))) for c in MOMENTS}  # of an older base
    assert sorted(moments_at(Weld(height=0.0), tower_interfaces(NREL), two, 3.0)[0]) == [0, 90]
    # between stations: linear, here exactly
    tubes = {"diameter": 6.0, "thickness": 0.03}
    low, between, high = base_weld_fatigue(
        tmp_path, WeldPlan(welds=tuple(Weld(height=h, **tubes) for h in (0.0, 10.95, 43.8)))
    )[0]
    assert between.loads_at == (0.0, 43.8)
    rest = np.hypot(0.4, 0.5) * np.cos(np.arctan2(0.4, 0.5) - np.radians(30.0)) / np.cos(np.radians(10.0))
    assert high.load / low.load == pytest.approx(rest, rel=5e-3)
    assert between.load == pytest.approx(0.75 * low.load + 0.25 * high.load, rel=5e-3)
    assert np.isnan(base.shear)


def test_files_of_welds(tmp_path: Path) -> None:
    path = tmp_path / "welds.yaml"
    path.write_text('edition: EN1993\nwelds: [{height: 10, category: "90"}]\n', encoding="utf-8")
    assert read_welds(path).welds[0].category == "90"
    bad = {
        'edition: EN1993\nwelds: [{height: 10, category: "95"}]': "has no curve '95'",
        "welds: [{height: 10, category: Q}]": "has no curve 'Q'",
        "welds: []": "welds",
        "factors: iec\nwelds: [{height: 10}]": "factors 'iec'",
        "welds: [{height: 10, wall: 0.03}]": "wall",
        "welds: [{height: 10, thickness: 30}]": "thickness",
    }
    for text, words in bad.items():
        path.write_text(text, encoding="utf-8")
        with pytest.raises(InputError, match=words):
            read_welds(path)
    with pytest.raises(InputError, match="the tower of nrel5mw is 87.6 m long"):
        weld_fatigue([result_of({name: wave(1e6) for name in MOMENTS})], NREL, WeldPlan(welds=(Weld(height=100.0),)))


def test_lines_of_the_eurocode_meet() -> None:
    for name, known in editions()["EN1993"].curves.items():
        curve = known["air"]
        knee = [(a - log10(curve.knee)) / m for a, m in zip(curve.log_a, curve.m, strict=True)]
        assert knee[0] == pytest.approx(knee[1], abs=1e-5), name


# buckling of the shell ------------------------------------------------------------------------------------


def test_buckling_stress_of_the_shell() -> None:
    """EN 1993-1-6, annex D by hand: a medium cylinder in its plastic range, and one that buckles elastically."""
    tube, steel = Tube(4.02, 0.02), Shell(strength=355e6, quality="B")
    r = 2.0
    critical = 0.605 * 210e9 / (r / 0.02)  # C_x = 1: 1.7 < omega = 5 / 0.2 = 25 < 50
    slenderness = np.sqrt(355e6 / critical)
    reduced = 0.62 / (1.0 + 1.91 * (np.sqrt(100.0) / 25.0) ** 1.44)
    chi = 1.0 - 0.6 * (slenderness - 0.2) / (np.sqrt(reduced / 0.4) - 0.2)
    assert slenderness < np.sqrt(reduced / 0.4)
    assert buckling_stress(tube, 5.0, steel, 0.0) == pytest.approx(chi * 355e6, rel=1e-12)
    assert buckling_stress(tube, 5.0, steel, 1.0) == buckling_stress(tube, 5.0, steel, 0.0)
    thin = Tube(4.004, 0.004)
    elastic = 0.62 / (1.0 + 1.91 * (np.sqrt(500.0) / 25.0) ** 1.44) * 0.605 * 210e9 / 500.0
    assert buckling_stress(thin, 5.0, steel, 0.0) == pytest.approx(elastic, rel=1e-12)
    # long: C_x = 1 + 0.2 (1 - 2 omega t / r) of axial force, 1 of bending with a longer plateau
    assert buckling_stress(tube, 20.0, steel, 0.0) < buckling_stress(tube, 12.0, steel, 0.0) < chi * 355e6
    assert buckling_stress(tube, 20.0, steel, 1.0) > chi * 355e6
    # short: more than a medium one; quality
    assert buckling_stress(tube, 0.2, steel, 0.0) > buckling_stress(tube, 5.0, steel, 0.0)
    by_class = [buckling_stress(tube, 5.0, steel.replace(quality=q), 0.0) for q in "ABC"]
    assert by_class == sorted(by_class, reverse=True)
    for stress in (buckling_stress(Tube(4.0, 0.2), 2.0, steel, 0.5), buckling_stress(Tube(1.0, 0.1), 2.0, steel, 1.0)):
        assert stress == pytest.approx(355e6)  # stocky shells yield


def test_utilisation_of_the_shell() -> None:
    series = {**dict(zip(MOMENTS, (wave(80e6), wave(60e6)), strict=True)), "tower_base_force_z": wave(0.0, -6e6)}
    weld = {"height": 0.0, "diameter": 6.0, "thickness": 0.0351}
    plan = WeldPlan(welds=(Weld(**weld),), shell=Shell(length=20.0))
    tube = Tube(6.0, 0.0351)
    stress = 100e6 / tube.modulus + 6e6 / tube.area
    share = 100e6 / tube.modulus / stress

    def buckling(plan: WeldPlan, **settings: float) -> float:
        return weld_fatigue([result_of(series)], NREL, plan, **settings)[0][0].buckling

    expected = 1.35 * stress * 1.1 / buckling_stress(tube, 20.0, plan.shell, share)
    assert buckling(plan) == pytest.approx(expected, rel=1e-9)
    assert buckling(plan, load_factor=1.0) == pytest.approx(expected / 1.35)
    assert buckling(plan.replace(shell=Shell(length=20.0, factor=1.2))) == pytest.approx(1.2 / 1.1 * expected)
    assert buckling(plan.replace(shell=Shell())) > buckling(plan)  # the whole tower
    assert buckling(plan.replace(shell=Shell(length=20.0, strength=235e6))) > buckling(plan)
