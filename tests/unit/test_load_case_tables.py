"""Load case tables: counts and factors of the editions, rules, names, seeds, weights, errors."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from meltemi.core.errors import InputError
from meltemi.loadbase.campaign import Campaign, make_campaign, read_campaign, write_campaign
from meltemi.loadbase.plan import plan
from meltemi.loadbase.ranges import numbers
from meltemi.loadbase.table import load_table
from meltemi.wind.iec.gusts import EDC_TIME

# cases of the NREL 5 MW (V_in 3, V_r 11.4, V_out 25 m/s: 13 speeds) and factors; Burton et al. (2021), chapter 5
EXPECTED = {
    "1.1": (4 * 6 + 9 * 15, 1.25),
    "1.2": (13 * 3 * 6, 1.0),
    "1.3": (13 * 3 * 6, 1.35),
    "1.4": (3 * 2 * 4, 1.35),
    "1.5": (13 * 4 * 4, 1.35),
    "2.1": (13 * 12, 1.35),
    "2.2": (13 * 12, 1.1),
    "2.3": (3 * 3 * 4, 1.1),
    "2.4": (13 * 2 * 3, 1.0),
    "2.5": (13 * 2, 1.2),
    "3.1": (3, 1.0),
    "3.2": (4 * 4, 1.35),
    "3.3": (4 * 2 * 2, 1.35),
    "4.1": (3, 1.0),
    "4.2": (3 * 6, 1.35),
    "5.1": (3 * 12, 1.35),
    "6.1": (2 * 6, 1.35),
    "6.2": (24, 1.1),
    "6.3": (2 * 6, 1.35),
    "6.4": (17 * 2 * 6, 1.0),
    "7.1": (24 * 4 + 24, 1.1),
    "8.1": (2 * 4 * 6, 1.35),
    "8.2": (24, 1.1),
}


def campaign(edition: int = 4, **settings: Any) -> Campaign:
    return make_campaign("nrel5mw", "IB", edition, rated_wind=11.4, **settings)


@pytest.mark.parametrize("edition", [3, 4])
def test_counts_and_factors_case_by_case(edition: int) -> None:
    found = plan(campaign(edition))
    expected = EXPECTED if edition == 4 else {k: v for k, v in EXPECTED.items() if k != "2.5"} | {"8.1": (48, 1.5)}
    assert {c.dlc for c in found.cases} == expected.keys()
    for dlc, (count, factor) in expected.items():
        own = [c for c in found.cases if c.dlc == dlc]
        assert (len(own), {c.factor for c in own}) == (count, {factor}), dlc
    assert len({c.seed for c in found.cases} - {None}) == sum(c.seed is not None for c in found.cases)


def test_the_time_of_all_states_is_the_lifetime() -> None:
    assert sum(c.weight.share for c in plan(campaign()).cases if c.weight) == pytest.approx(1.0, abs=1e-12)


def test_the_cut_out_is_reached_exactly_and_once() -> None:
    values = {"V_in": 3.1, "V_out": 3.1 + 11 * 0.7}
    found = numbers("V_in to V_out by 0.7", values)
    assert len(found) == 12 and found[-1] == values["V_out"]
    assert [c.variant.speed for c in plan(campaign(quick=True)).cases if c.row == "1.1"] == [3.0, 11.4, 25.0]


def test_direction_change_lasts_six_seconds_and_storms_are_turbulent_at_the_mean() -> None:
    assert EDC_TIME == 6.0
    storm = [c for c in plan(campaign()).cases if c.dlc == "6.1"]
    assert {c.variant.speed for c in storm} == {50.0} and all(c.seed is not None for c in storm)
    steady = [c for c in plan(campaign(extreme_wind="steady")).cases if c.dlc == "6.1"]
    assert {(c.variant.speed, c.variant.yaw, c.seed) for c in steady} == {(70.0, -15.0, None), (70.0, 15.0, None)}


def test_every_case_is_a_valid_case_and_seeds_depend_on_the_name_only() -> None:
    before = plan(campaign(quick=True))
    for case in before.cases:
        if not case.unsupported:
            case.case()
    after = plan(campaign(quick=True, changes={"rows": {"1.3x": {"like": "1.3", "factor": 1.2}}}))
    seeds = {c.name: c.seed for c in after.cases}
    assert all(seeds[c.name] == c.seed for c in before.cases) and len(seeds) > len(before.cases)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"rows": {"1.33": {"seeds": 2}}}, "no such row; did you mean '1.3'"),
        ({"rows": {"1.3": {"seed": 2}}}, "rows.1.3.seed: unknown key; did you mean 'seeds'"),
        ({"without": ["9.9"]}, "no row '9.9'"),
        ({"rows": {"1.3": {"speeds": "V_inn to V_out by 2"}}}, "unknown name 'V_inn'; did you mean 'V_in'"),
    ],
)
def test_wrong_changes_are_told(changes: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError) as error:
        load_table(4, changes)
    assert words in str(error.value)


def test_wrong_campaigns_are_told() -> None:
    with pytest.raises(InputError, match="wind class"):
        make_campaign("nrel5mw", "IX", rated_wind=11.4)
    with pytest.raises(InputError, match="cut_in < rated_wind < cut_out"):
        campaign(cut_in=26.0)


def test_a_campaign_survives_its_file(tmp_path: Path) -> None:
    made = campaign(changes={"rows": {"1.2": {"seeds": 12}}})
    write_campaign(made, tmp_path)
    assert read_campaign(tmp_path) == made


def test_excel_round_trip(tmp_path: Path) -> None:
    openpyxl = pytest.importorskip("openpyxl")
    from meltemi.loadbase.excel import read_excel, write_excel

    path = write_excel(load_table(4), tmp_path / "table.xlsx")
    assert read_excel(path, 4) == {}
    book = openpyxl.load_workbook(path)
    head = [cell.value for cell in book["cases"][1]]
    book["cases"].cell(4, head.index("factor") + 1).value = 1.3
    book.save(path)
    assert read_excel(path, 4) == {"rows": {"1.3": {"factor": 1.3}}}
