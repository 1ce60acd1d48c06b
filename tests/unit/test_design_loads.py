"""Evaluation of load bases whose answers are known by hand: characteristic values, factors, fatigue, energy, gaps."""

from __future__ import annotations

from dataclasses import replace
from math import pi, sqrt
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from synthetic_base import small_plan, synthetic_base

from meltemi.core.errors import InputError, Status
from meltemi.loads.energy import YEAR
from meltemi.loads.extrapolation import fit_extremes
from meltemi.loads.loadbase.design import DesignLoads, compare_bases, design_loads, design_tables
from meltemi.loads.loadbase.engine import base_status
from meltemi.loads.loadbase.plan import Plan
from meltemi.loads.loadbase.report import write_design_loads
from meltemi.loads.loadbase.settings import DesignSettings
from meltemi.loads.loadbase.signals import tower_radius
from meltemi.loads.loadbase.ultimate import speed_shares
from meltemi.loads.loadbase.weights import HOURS
from meltemi.postprocess.cycles import cycle_load, rainflow_cycles
from meltemi.turbine.library import load_turbine

MY = "tower_base_moment_fore_aft"
MX = "tower_base_moment_side_side"
FLAT = 12.0
"""[m] clearance of the undeflected rotor."""


def evaluated(folder: Path, of: Plan, **settings: Any) -> DesignLoads:
    return design_loads(of, folder, DesignSettings(**{"undeflected": FLAT, "resamples": 20} | settings))


def peak(height: float, time: np.ndarray) -> np.ndarray:
    """A triangle from zero to a height and back."""
    return height * np.maximum(1.0 - np.abs(time - 5.0) / 2.0, 0.0)


# ultimate loads: production in extreme turbulence (mean), emergency stop (upper half), idling by direction


HEIGHTS = {
    # name of a case: largest fore-aft moment of the tower base [N m]; others have 1
    "dlc1.3-11.4-y-8-s01": 10.0,
    "dlc1.3-11.4-y0-s01": 20.0,
    "dlc1.3-11.4-y8-s01": 36.0,
    "dlc1.3-25-y0-s01": 60.0,
    "dlc5.1-13.4-s01": 10.0,
    "dlc5.1-13.4-s02": 20.0,
    "dlc5.1-13.4-s03": 22.0,
    "dlc5.1-13.4-s04": 16.0,
    "dlc6.2-50-y90-s01": 19.0,
}


def triangles(case: Any, time: np.ndarray) -> dict[str, Any]:
    wave = peak(HEIGHTS.get(case.name, 1.0), time)
    clearance = FLAT - 0.1 * peak(HEIGHTS.get(case.name, 1.0), time)
    radius = 0.0
    found = {MY: wave, MX: -0.5 * wave, "tower_base_force_z": -6.0 - 0.1 * wave}
    return found | {f"tip_clearance_{b}": clearance + radius for b in (1, 2, 3)}


@pytest.fixture(scope="module")
def ultimate_plan() -> Plan:
    whole = small_plan(("1.3", "5.1", "6.2"), quick=False)
    quick = small_plan(("1.3", "6.2"))
    stops = [c for c in whole.cases if c.row == "5.1" and c.variant.speed == 13.4 and c.variant.seed <= 4]
    return replace(quick, table=whole.table, cases=(*quick.cases, *stops))


@pytest.fixture(scope="module")
def ultimate_base(ultimate_plan: Plan, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("ultimate")
    synthetic_base(folder, ultimate_plan, triangles)
    return folder


def test_characteristic_values_follow_the_rule_of_each_row(ultimate_plan: Plan, ultimate_base: Path) -> None:
    design = evaluated(ultimate_base, ultimate_plan)
    rows = design.by_row.loc["tower_base", "My max"]
    # mean of a speed over its yaw errors: (10 + 20 + 36) / 3 = 22 at 11.4 m/s, (1 + 60 + 1) / 3 at 25 m/s
    assert rows.at["1.3", "characteristic"] == pytest.approx(22.0)
    assert (rows.at["1.3", "case"], rows.at["1.3", "runs"]) == ("dlc1.3-11.4-y0-s01", 3)
    # mean of the larger half of the four seeds: (20 + 22) / 2
    assert rows.at["5.1", "characteristic"] == pytest.approx(21.0)
    # directions are never averaged
    assert rows.at["6.2", "characteristic"] == pytest.approx(19.0)
    assert rows.at["6.2", "case"] == "dlc6.2-50-y90-s01"
    assert rows["design"].tolist() == pytest.approx([22.0 * 1.35, 21.0 * 1.35, 19.0 * 1.1])


def test_the_matrix_has_factored_contemporaneous_loads_of_the_governing_case(
    ultimate_plan: Plan, ultimate_base: Path
) -> None:
    design = evaluated(ultimate_base, ultimate_plan)
    row = design.ultimate.loc["tower_base", "My max"]
    assert (row["case"], row["dlc"], row["rule"], row["factor"]) == ("dlc1.3-11.4-y0-s01", "1.3", "mean", 1.35)
    assert row["factored"] and not design.characteristic["factored"].any()
    scale = 22.0 / 20.0  # from the run nearest to the mean
    assert row["scale"] == pytest.approx(scale)
    assert row["time"] == pytest.approx(5.0)
    expected = 1.35 * scale * np.array([0.0, 0.0, -8.0, -10.0, 20.0, 0.0])
    assert row[["Fx", "Fy", "Fz", "Mx", "My", "Mz"]].to_list() == pytest.approx(expected.tolist())
    assert row["M_res"] == pytest.approx(1.35 * scale * 10.0 * sqrt(5.0))
    plain = design.characteristic.loc["tower_base", "My max"]
    assert plain["My"] == pytest.approx(22.0) and plain["factor"] == 1.35
    # the compression that is smallest in magnitude relieves: factor 0.9 instead of 1.1 or 1.35
    least = design.ultimate.loc["tower_base", "Fz max"]
    assert (least["factor"], least["Fz"]) == (0.9, pytest.approx(0.9 * -6.0))


def test_moments_by_direction_and_tip_clearance(ultimate_plan: Plan, ultimate_base: Path) -> None:
    design = evaluated(ultimate_base, ultimate_plan)
    rose = design.roses.loc["tower_base"]
    for angle in range(0, 360, 30):
        share = np.cos(np.radians(angle)) * -0.5 + np.sin(np.radians(angle))
        expected = max(1.35 * 22.0 * share, 0.0)  # zero occurs in every run
        assert rose.at[angle, "largest"] == pytest.approx(expected, abs=1e-9), angle
    assert rose.at[120, "case"] == "dlc1.3-11.4-y0-s01"
    row = design.clearance.loc["1.3"]
    bent = FLAT - row["clearance"]
    assert row["left"] == pytest.approx(FLAT - 1.35 * 1.1 * bent)
    other = evaluated(ultimate_base, ultimate_plan, material=1.5).clearance.loc["1.3"]
    assert other["left"] == pytest.approx(FLAT - 1.35 * 1.5 * bent)
    assert row["fits"] == (row["left"] > 0.0)


def test_the_worst_blade_stands_for_all(tmp_path: Path) -> None:
    one = small_plan(("1.3",))
    one = replace(one, cases=one.cases[:1])

    def blades(case: Any, time: np.ndarray) -> dict[str, Any]:
        return {f"root_moment_out_of_plane_{b}": peak(10.0 * b, time) for b in (1, 2, 3)}

    synthetic_base(tmp_path, one, blades)
    design = evaluated(tmp_path, one)
    row = design.ultimate.loc["blade_root", "My max"]
    assert (row["blade"], row["My"]) == (3, pytest.approx(1.35 * 30.0))
    assert "blade_root_1" not in design.ultimate.index


# extrapolation


@pytest.fixture(scope="module")
def extrapolated(tmp_path_factory: pytest.TempPathFactory) -> tuple[Plan, Path]:
    """Fifteen seeds at three speeds; extremes are quantiles of Gumbel's distribution."""
    folder, of = tmp_path_factory.mktemp("extrapolated"), small_plan(("1.1",), quick=False)
    kept = [c for c in of.cases if c.variant.speed in (10.0 + 1.0, 13.0, 25.0)]
    of = replace(of, cases=tuple(kept))

    def gumbel(case: Any, time: np.ndarray) -> dict[str, Any]:
        towards = 0.02 * peak(height(case), time)
        return {MY: peak(height(case), time)} | {f"tip_clearance_{b}": FLAT - towards for b in (1, 2, 3)}

    synthetic_base(folder, of, gumbel)
    return of, folder


SIMPLIFIED = {"quantile_99": (1.2, 0.99), "quantile_93": (1.35, 0.933)}


def simplified(samples: list[list[float]], way: Any) -> float:
    """The ways of edition 4 (L-28, L-29), by the quantile of Gumbel's distribution."""
    factor, quantile = SIMPLIFIED[way]
    fits = map(fit_extremes, samples)
    return factor * max(fit.location - fit.scale * np.log(-np.log(quantile)) for fit in fits)


def height(case: Any) -> float:
    q = (case.variant.seed - 0.5) / 15.0
    return 100.0 + case.variant.speed - 10.0 * np.log(-np.log(q))


@pytest.mark.slow
def test_all_ways_of_extrapolation(extrapolated: tuple[Plan, Path]) -> None:
    of, folder = extrapolated
    design = evaluated(folder, of)
    (each,) = [e for e in design.extrapolations if (e.interface, e.driver) == ("tower_base", "My max")]
    speeds = sorted({c.variant.speed for c in of.cases})
    samples = [[height(c) for c in of.cases if c.variant.speed == v] for v in speeds]
    assert [x.tolist() for x in each.extremes] == [pytest.approx(x, rel=1e-9) for x in samples]
    assert each.gumbel is not None and each.weibull is not None
    # by the equation that the load satisfies: sum of p_i (1 - F_i) = 3.8e-7
    shares = speed_shares(of.campaign, speeds)
    total = sum(p * float(fit.exceedance(each.gumbel.load)) for p, fit in zip(shares, each.gumbel.fits, strict=True))
    assert total == pytest.approx(3.8e-7, rel=1e-6)
    assert each.gumbel.low < each.gumbel.load < each.gumbel.high
    for way in SIMPLIFIED:
        assert each.load(way) == pytest.approx(simplified(samples, way))
    for way in ("gumbel", "weibull", "quantile_99", "quantile_93"):
        row = evaluated(folder, of, extrapolation=way).ultimate.loc["tower_base", "My max"]
        assert row["My"] == pytest.approx(1.25 * each.load(way)), way
        assert row["rule"] == "extrapolated"


@pytest.mark.parametrize("way", ["quantile_99", "quantile_93"])
def test_factors_of_quantiles_increase_the_deflection(extrapolated: tuple[Plan, Path], way: Any) -> None:
    """Not the clearance, which a factor above 1 would make larger."""
    of, folder = extrapolated
    design = evaluated(folder, of, extrapolation=way)
    radius = tower_radius(load_turbine("nrel5mw"))  # clearance is measured from its axis
    speeds = sorted({c.variant.speed for c in of.cases})
    samples = [[radius + 0.02 * height(c) for c in of.cases if c.variant.speed == v] for v in speeds]
    row = design.clearance.loc["1.1"]
    assert row["deflection"] == pytest.approx(simplified(samples, way))
    assert row["clearance"] == pytest.approx(FLAT - row["deflection"])
    assert row["clearance"] < FLAT - max(map(max, samples))


def test_too_few_seeds_are_told_and_take_no_part(extrapolated: tuple[Plan, Path]) -> None:
    of, folder = extrapolated
    few = replace(of, cases=tuple(c for c in of.cases if c.variant.speed != 13.0 or c.variant.seed <= 5))
    design = evaluated(folder, few)
    assert "DLC 1.1: 13 m/s have fewer than 6 seeds and are not extrapolated." in design.notes
    assert evaluated(folder, of).notes == ()
    none = evaluated(folder, replace(of, cases=tuple(c for c in of.cases if c.variant.seed <= 5)))
    assert any("not evaluated" in note for note in none.notes)
    assert ("tower_base", "My max") not in none.ultimate.index and none.extrapolations == ()


def test_ways_that_are_not_there(extrapolated: tuple[Plan, Path], tmp_path: Path) -> None:
    of, folder = extrapolated
    with pytest.raises(InputError, match="extrapolation"):
        evaluated(folder, of, extrapolation="gumbell")
    with pytest.raises(InputError, match="not in the table of edition 3"):
        evaluated(tmp_path, small_plan(("1.3",), edition=3), extrapolation="quantile_99")
    with pytest.raises(InputError, match="slopes"):
        evaluated(folder, of, slopes=(3.0, 0.0))


def test_probabilities_of_the_speeds_are_those_between_cut_in_and_cut_out() -> None:
    campaign = small_plan(("1.3",)).campaign
    shares = speed_shares(campaign, [3.0, 11.4, 25.0])
    assert sum(shares) == pytest.approx(np.exp(-pi / 4 * (3 / 10) ** 2) - np.exp(-pi / 4 * (25 / 10) ** 2))


# fatigue, energy, duty


def sines(case: Any, time: np.ndarray) -> dict[str, Any]:
    """A cycle a second from peak to peak about a mean."""
    amplitude = {3.0: 1.0, 11.4: 3.0, 25.0: 5.0}.get(case.variant.speed, 2.0)
    return {
        MY: 10.0 + amplitude * np.cos(2.0 * pi * time),
        "generator_power": 1e6 * case.variant.speed + 1e5 * (case.variant.yaw or 0.0) + 0.0 * time,
        "pitch_1": 0.1 * np.sin(0.2 * pi * time),
        "rotor_torque": 4.0 + 0.0 * time,
        "rotor_speed": 2.0 * pi + 0.0 * time,
    }


@pytest.fixture(scope="module")
def fatigue_base(tmp_path_factory: pytest.TempPathFactory) -> tuple[Plan, Path]:
    folder, of = tmp_path_factory.mktemp("fatigue"), small_plan(("1.2", "4.1"))
    synthetic_base(folder, of, sines)
    return of, folder


def test_equivalent_loads_and_shares_of_the_lifetime(fatigue_base: tuple[Plan, Path]) -> None:
    of, folder = fatigue_base
    design = evaluated(folder, of)
    amplitude = {3.0: 1.0, 11.4: 3.0, 25.0: 5.0}
    for slope in (3.0, 4.0, 10.0):
        damage: dict[tuple[str, float], float] = {}
        for case in of.cases:
            key, cycles = (case.dlc, case.variant.speed), case.duration * case.weight.repetitions
            damage[key] = damage.get(key, 0.0) + cycles * (2.0 * amplitude[case.variant.speed]) ** slope
        expected = (sum(damage.values()) / 1e7) ** (1.0 / slope)
        # ranges are kept to 1.2e-4
        assert design.fatigue.at[MY, slope] == pytest.approx(expected, rel=2e-4)
        for key, part in damage.items():
            share = design.shares.at[(MY, *key), slope]
            assert share == pytest.approx(part / sum(damage.values()), rel=2e-3)
    hertz = evaluated(folder, of, reference=20.0 * HOURS * 3600.0).fatigue.at[MY, 4.0]
    assert hertz == pytest.approx(design.fatigue.at[MY, 4.0] * (1e7 / (20.0 * HOURS * 3600.0)) ** 0.25)
    assert design.covered == 1.0


def test_markov_matrices_count_every_cycle(fatigue_base: tuple[Plan, Path]) -> None:
    of, folder = fatigue_base
    matrix = evaluated(folder, of).markov[MY]
    assert matrix.counts.sum() == pytest.approx(sum(c.duration * c.weight.repetitions for c in of.cases))
    at_three = np.searchsorted(matrix.range_edges, 6.0) - 1
    of_three = sum(c.duration * c.weight.repetitions for c in of.cases if c.variant.speed == 11.4)
    assert matrix.counts[at_three].sum() == pytest.approx(of_three)
    used = np.flatnonzero(matrix.counts.sum(axis=0))
    assert all(matrix.mean_edges[k] <= 10.01 and matrix.mean_edges[k + 1] >= 9.99 for k in used)


def test_goodman_corrects_the_means(fatigue_base: tuple[Plan, Path]) -> None:
    of, folder = fatigue_base
    plain, corrected = evaluated(folder, of), evaluated(folder, of, strengths={MY: 50.0})
    # all cycles are about 10: the range that does the same damage about zero is 50 / 40 times as large
    ratio = corrected.fatigue.at[MY, 4.0] / plain.fatigue.at[MY, 4.0]
    assert ratio == pytest.approx(1.25, rel=1e-3)
    assert np.array_equal(corrected.markov[MY].counts, plain.markov[MY].counts)
    with pytest.raises(InputError, match=f"strengths: {MY}: .* reaches the strength 5"):
        evaluated(folder, of, strengths={MY: 5.0})
    with pytest.raises(InputError, match="no channel 'tower_base_moment_foreaft'"):
        evaluated(folder, of, strengths={"tower_base_moment_foreaft": 50.0})


def test_energy_of_a_year(fatigue_base: tuple[Plan, Path]) -> None:
    of, folder = fatigue_base
    design = evaluated(folder, of)
    speeds = [3.0, 11.4, 25.0]
    shares = speed_shares(of.campaign, speeds)
    # yaw errors of -8, 0, 8 deg have 1/4, 1/2, 1/4 of the time: their parts cancel
    expected = YEAR * sum(p * 1e6 * v for p, v in zip(shares, speeds, strict=True))
    assert design.energy is not None and design.energy.energy == pytest.approx(expected)
    assert design.powers["power"].tolist() == pytest.approx([1e6 * v for v in speeds])
    half = evaluated(folder, of, availability=0.5).energy
    assert half is not None and half.energy == pytest.approx(0.5 * expected)


def test_duty_and_durations(fatigue_base: tuple[Plan, Path]) -> None:
    of, folder = fatigue_base
    design = evaluated(folder, of)
    periods = sum(c.weight.repetitions * c.duration / 10.0 for c in of.cases) / 20.0
    # a sine of 0.1 rad and ten seconds
    assert design.duties.at["pitch_1", "travel"] == pytest.approx(0.4 * periods)
    assert design.duties.at["pitch_1", "reversals"] == pytest.approx(2.0 * periods)
    assert design.duties.at["pitch_2", "travel"] == 0.0
    torque = design.durations.loc["rotor_torque"].reset_index()
    seconds = sum(c.weight.repetitions * (c.duration + 0.05) for c in of.cases)  # each value stands for 0.05 s
    assert torque["time"].sum() == pytest.approx(seconds)
    assert torque["revolutions"].sum() == pytest.approx(seconds)  # one each second
    assert len(torque) == 1 and torque.at[0, "low"] <= 4.0 <= torque.at[0, "high"]
    assert design.duration_loads.at["rotor_torque", 3.0] == pytest.approx(4.0, rel=0.02)


def test_stops_of_a_year(tmp_path: Path) -> None:
    of = small_plan(("4.1",))

    def stop(case: Any, time: np.ndarray) -> dict[str, Any]:
        return {"rotor_speed": np.where(time < 5.0, 1.2, 0.05)}

    synthetic_base(tmp_path, of, stop)
    assert evaluated(tmp_path, of).stops.at["4.1", "stops"] == pytest.approx(1000 + 50 + 50)


# what is missing


def test_status_counts_rows_as_the_plan_does(tmp_path: Path) -> None:
    """7.1b was one with 7.1 in status, and apart in plan."""
    of = small_plan(("7.1", "7.1b"))
    found = {row.dlc: row.cases for row in base_status(of, tmp_path).dlcs}
    assert found == {row.name: row.cases for row in of.summary()} and found.keys() == {"7.1", "7.1b"}


def test_gaps_stand_beside_the_numbers(tmp_path: Path) -> None:
    of = small_plan(("1.2", "1.3"))
    names = [c.name for c in of.cases]
    doubtful = "blade within the tower's surface, by 1 m (limit 0 m)"
    synthetic_base(
        tmp_path,
        of,
        triangles,
        status={names[0]: (Status.FAILED, "the run needs 660 s"), names[9]: (Status.DOUBTFUL, doubtful)},
        warnings={names[10]: ("rotor overspeed 1.7 rad/s",)},
        without=[*names[3:6], names[11]],
    )
    design = evaluated(tmp_path, of)
    found = design.problems
    assert found["state"].value_counts().to_dict() == {"missing": 4, "failed": 1, "doubtful": 1, "warned": 1}
    assert found.at[names[0], "meaning"].startswith("no results") and "shorter" in found.at[names[0], "meaning"]
    assert "tower strike" in found.at[names[9], "meaning"]
    assert "overspeed" in found.at[names[10], "meaning"]
    line = design.coverage.loc["1.3"]
    assert line[["cases", "ok", "warned", "doubtful", "failed", "missing"]].tolist() == [9, 6, 1, 1, 0, 1]
    assert not line["complete"]
    assert "DLC 1.3 (1.3): 1 of 9 cases have no results: extreme loads may be underestimated." in design.notes
    assert set(design.by_row["lacking"]) == {1}
    # all cases of 1.2 at 11.4 m/s are missing, one of three at 3 m/s
    share = {
        v: sum(c.weight.share for c in of.cases if c.row == "1.2" and c.variant.speed == v) for v in (3.0, 11.4, 25.0)
    }
    lost = next(c.weight.share for c in of.cases if c.name == names[0])
    assert design.covered == pytest.approx(1.0 - (share[11.4] + lost) / sum(share.values()))
    assert "of the occurrences have no case" in design.coverage.at["1.2", "meaning"]


def test_missing_seeds_leave_their_time_to_the_others(tmp_path: Path) -> None:
    of = small_plan(("1.2",), quick=False, seeds=2)
    of = replace(of, cases=tuple(c for c in of.cases if c.variant.speed in (11.0, 13.0)))
    names = [c.name for c in of.cases]
    synthetic_base(tmp_path / "whole", of, sines)
    synthetic_base(tmp_path / "part", of, sines, without=names[:1])
    whole, part = evaluated(tmp_path / "whole", of), evaluated(tmp_path / "part", of)
    assert part.fatigue.at[MY, 4.0] == pytest.approx(whole.fatigue.at[MY, 4.0], rel=1e-9)
    assert part.covered == 1.0 and not part.coverage.at["1.2", "complete"]


def test_doubtful_cases_can_be_left_out(ultimate_plan: Plan, tmp_path: Path) -> None:
    name = "dlc1.3-11.4-y8-s01"
    synthetic_base(tmp_path, ultimate_plan, triangles, status={name: (Status.DOUBTFUL, "far")})
    with_it, without = evaluated(tmp_path, ultimate_plan), evaluated(tmp_path, ultimate_plan, doubtful=False)
    value = "tower_base", "My max", "1.3"
    assert with_it.by_row.at[value, "characteristic"] == pytest.approx(22.0)
    assert without.by_row.at[value, "characteristic"] == pytest.approx(62.0 / 3.0)
    assert any("outside the range of validity" in note for note in with_it.notes)


def test_an_empty_base_has_empty_tables(tmp_path: Path) -> None:
    design = evaluated(tmp_path, small_plan())
    assert design.ultimate.empty and design.fatigue.empty and design.energy is None
    assert (design.coverage["missing"] == design.coverage["cases"]).all()
    assert compare_bases(design, design).empty
    write_design_loads(design, tmp_path / "tables")


# comparison and files


def test_two_bases_side_by_side(ultimate_plan: Plan, ultimate_base: Path, tmp_path: Path) -> None:
    def twice(case: Any, time: np.ndarray) -> dict[str, Any]:
        given = triangles(case, time)
        return given | {MY: 2.0 * given[MY]}

    synthetic_base(tmp_path, ultimate_plan, twice)
    one, two = evaluated(ultimate_base, ultimate_plan), evaluated(tmp_path, ultimate_plan)
    ratios = compare_bases(two, one)
    assert ratios.at[("ultimate", "tower_base", "My max"), "ratio"] == pytest.approx(2.0)
    assert ratios.at[("ultimate", "tower_base", "Mx min"), "ratio"] == pytest.approx(1.0)
    assert np.isnan(ratios.at[("ultimate", "tower_base", "Mz max"), "ratio"])
    assert ("clearance", "blade", "tip") in ratios.index


def test_tables_as_files(fatigue_base: tuple[Plan, Path], tmp_path: Path) -> None:
    of, folder = fatigue_base
    design = evaluated(folder, of)
    files = write_design_loads(design, tmp_path / "tables")
    kept = pd.read_csv(tmp_path / "tables" / "fatigue.csv", index_col="channel")
    assert kept.at[MY, "4.0"] == pytest.approx(design.fatigue.at[MY, 4.0], rel=1e-12)
    sheet = pd.read_excel(files[-1], sheet_name="Fatigue loads", skiprows=2)
    value = sheet.set_index("channel").at[MY.replace("_", " "), "m = 4"]  # in kN m
    assert value == pytest.approx(1e-3 * design.fatigue.at[MY, 4.0], rel=1e-12)
    assert {path.stem for path in files[:-1]} == design_tables(design).keys()
    cycles = pd.read_csv(tmp_path / "tables" / "markov.csv")
    assert cycles[cycles["channel"] == MY]["cycles"].sum() == pytest.approx(design.markov[MY].counts.sum())


def test_equivalent_load_is_that_of_the_counted_series() -> None:
    time = 0.05 * np.arange(201)
    cycles = rainflow_cycles(10.0 + 3.0 * np.cos(2.0 * pi * time))
    assert cycle_load(cycles, slope=4.0, reference=10.0) == pytest.approx(6.0)
