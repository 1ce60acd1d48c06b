"""Sites in the sea, and the load case table of IEC 61400-3-1: cases, seas, levels, currents, weights, errors."""

from __future__ import annotations

import math
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from meltemi.core.errors import InputError
from meltemi.loads.loadbase.campaign import make_campaign, read_campaign, write_campaign
from meltemi.loads.loadbase.interfaces import interfaces_of, known_channels, recorded
from meltemi.loads.loadbase.metocean import Metocean, list_metocean, read_metocean, wind_driven
from meltemi.loads.loadbase.plan import Plan, plan
from meltemi.loads.loadbase.table import edition_content, load_table
from meltemi.sea.conditions import BREAKS_IN_SHALLOWS, BREAKS_STEEP, breaking_height
from meltemi.sea.kinds import sea_of
from meltemi.turbine.library import load_turbine

# seas, levels and factors of the table: digest of WEIS's generator and of what is remembered of the standard
SEAS = {
    "normal": "1.1 1.3 1.4 1.5 2.1 2.2 2.3 3.2 3.3 4.2 5.1 8.1",
    "joint": "1.2 2.4 3.1 4.1 6.4 7.2 8.3",
    "severe": "1.6",
    "1-year": "6.3 7.1 7.1b 8.2",
    "50-year": "6.1 6.2",
}


def planned(site: str | Metocean = "weis", turbine: str = "iea15mw-monopile", **settings: Any) -> Plan:
    found = read_metocean(site) if isinstance(site, str) else site
    given: dict[str, Any] = {"rated_wind": 10.7, "standard": "61400-3-1", "metocean": found} | settings
    return plan(make_campaign(turbine, found.wind_class, **given))


def test_every_row_has_its_sea() -> None:
    table = load_table("61400-3-1")
    assert {kind: " ".join(n for n, row in table.rows.items() if row.sea == kind) for kind in SEAS} == SEAS
    assert list(table.rows) == sorted(table.rows)
    land = load_table(4)
    assert all(row.sea is None for row in land.rows.values())
    same = ("situation", "wind", "speeds", "factor", "characteristic", "type", "seeds", "duration")
    for name in land.rows.keys() & table.rows.keys():
        assert [getattr(land.rows[name], k) for k in same] == [getattr(table.rows[name], k) for k in same], name
    assert set(land.rows) - set(table.rows) == {"2.5"} and set(table.rows) - set(land.rows) == {"1.6", "7.2", "8.3"}
    assert (table.rows["1.6"].factor, table.rows["6.1"].factor, table.rows["7.1"].factor) == (1.35, 1.35, 1.1)


def test_what_is_from_memory_is_marked() -> None:
    """Seas that WEIS confirms are not marked; all others, and what only the sea has, are."""
    confirmed = {"1.1", "1.2", "1.3", "1.4", "1.5", "1.6", "6.1", "6.3"}
    for name, row in load_table("61400-3-1").rows.items():
        assert ("sea" in row.practice) == (name not in confirmed), name
        for key in ("misalignment", "levels", "wave"):
            assert getattr(row, key) is None or key in row.practice, (name, key)


def test_a_plan_has_seas_levels_and_directions() -> None:
    found = planned("template", seeds=1)
    count = Counter(case.row for case in found.cases)
    assert count["6.1"] == 2 * 3 * 2 and count["1.6"] == 13 * 2 and count["1.2"] == 13 * 3 * 5
    names = [case.name for case in found.cases if case.row == "6.1"]
    assert names[0] == "dlc6.1-50-y-8-m-30-low-s01" and len(set(names)) == len(names)
    case = found.case("dlc6.1-50-y8-m30-high-s01")
    sea = case.content["sea"]
    assert (sea["height"], sea["period"], sea["level"]) == (8.4, 12.8, 2.6)
    assert sea["direction"] == pytest.approx(math.radians(38.0))
    assert sea["crest"] == {"height": pytest.approx(1.86 * 8.4), "of": "crest to trough", "time": 360.0}
    site = read_metocean("template")
    assert sea["current"]["sub_surface"] == 1.0
    hub = load_turbine("iea15mw-monopile").hub_height
    assert sea["current"]["near_surface"] == pytest.approx(0.01 * 50.0 * (10.0 / hub) ** 0.14, rel=1e-4)
    assert wind_driven(site, 50.0, 10.0) == pytest.approx(0.5)
    assert case.case().sea is not None
    aligned = found.case("dlc1.2-13-y0-m-60-s01").content["sea"]
    assert "crest" not in aligned and "current" not in aligned and aligned["height"] == 1.7
    seeds = [c.content["sea"]["seed"] for c in found.cases]
    assert len(set(seeds)) == len(seeds)
    assert found.case("dlc1.2-13-y0-m-60-s01").content["wind"]["turbulence"] == {"shear_exponent": 0.14}


def test_weights_follow_the_joint_distribution() -> None:
    """Time of all fatigue cases is that of the states; that of each sea its share of the observations."""
    scatter = {
        "speed": [5.0, 5.0, 12.0, 12.0, 12.0, 20.0],
        "height": [0.8, 1.2, 1.5, 2.0, 2.0, 3.5],
        "period": [6.0, 7.0, 7.0, 8.0, 8.0, 9.0],
        "misalignment": [0.0, 30.0, 0.0, 0.0, 0.0, -45.0],
        "probability": [30.0, 10.0, 10.0, 5.0, 5.0, 1.0],
    }
    site = read_metocean("weis").replace(scatter=scatter, weibull_scale=10.0, weibull_shape=2.2)
    found = planned(site, seeds=1)
    cases = [case for case in found.cases if case.weight is not None and case.weight.state]
    assert sum(case.weight.share for case in cases if case.weight) == pytest.approx(1.0, abs=1e-9)
    own = {
        case.variant.waves.name: case.weight.share
        for case in found.cases
        if case.row == "7.2" and case.variant.speed == 11.0 and case.weight and case.variant.waves
    }
    assert own.keys() == {"h1.5-t7-m0", "h2-t8-m0"}
    assert own["h1.5-t7-m0"] == pytest.approx(own["h2-t8-m0"], rel=1e-12)  # 10 and 5 + 5 observations
    far = {case.variant.waves.name for case in found.cases if case.row == "6.4" and case.variant.speed == 33.0}  # type: ignore[union-attr]
    assert far == {"h3.5-t9-m-45"}  # the nearest wind speed with observations
    table = planned("template", seeds=1)
    shares = dict.fromkeys((-60.0, -30.0, 0.0, 30.0, 60.0), 0.0)
    for case in table.cases:
        if case.row == "1.2" and case.weight and case.variant.waves:
            shares[case.variant.waves.misalignment] += case.weight.share
    total = sum(shares.values())
    assert [share / total for share in shares.values()] == pytest.approx([0.08, 0.2, 0.44, 0.2, 0.08])


def test_embedded_waves_do_not_break() -> None:
    """In shallow water the wave of 50 years is the highest one that does not break, and the sea accepts it."""
    found = planned(turbine="nrel5mw-monopile", rated_wind=11.4, seeds=1)
    sea = next(case for case in found.cases if case.row == "6.1").content["sea"]
    assert sea["crest"]["height"] < 1.86 * 9.7 and sea["crest"]["height"] <= BREAKS_IN_SHALLOWS * 20.0
    sea_of(sea, "case").components(20.0, 660.0)
    assert breaking_height(1e3, 10.0) == pytest.approx(7.8)
    deep = BREAKS_STEEP * 9.80665 * 5.0**2 / (2.0 * math.pi)
    assert breaking_height(5.0, 500.0) == pytest.approx(deep, rel=1e-6)


def test_a_quick_plan_has_one_sea() -> None:
    found = planned("template", quick=True)
    assert {case.variant.waves.misalignment for case in found.cases if case.row == "1.2"} == {0.0}  # type: ignore[union-attr]
    assert {case.variant.waves.level for case in found.cases if case.row == "6.1"} == {2.6}  # type: ignore[union-attr]
    assert len(found.cases) < 150


def test_a_site_without_storms_says_which_cases_cannot_run() -> None:
    lacking = planned("iea22", turbine="iea22mw-monopile", quick=True).missing()
    assert lacking == {
        "metocean: the site has no severe_height": ["1.6"],
        "metocean: the site has no fifty_years": ["6.1", "6.2"],
        "metocean: the site has no one_year": ["6.3", "7.1", "7.1b", "8.2"],
    }


def test_campaign_is_written_and_read(tmp_path: Path) -> None:
    campaign = planned("template", quick=True).campaign
    write_campaign(campaign, tmp_path)
    again = read_campaign(tmp_path)
    assert [case.content for case in plan(again).cases] == [case.content for case in plan(campaign).cases]
    assert again.inclination == 0.0 and again.depth == 30.0


def test_loads_are_recorded_down_to_the_mudline() -> None:
    turbine = load_turbine("iea15mw-monopile")
    names = [each.name for each in interfaces_of(turbine)]
    assert names[-1] == "mudline" and names.count("pile_station_1") == 1
    assert turbine.support is not None
    assert sum(name.startswith("pile_station") for name in names) == len(turbine.support.load_stations)
    assert set(recorded(turbine, interfaces_of(turbine))) <= known_channels(3).keys()
    land = load_turbine("iea15mw")
    assert not any("pile" in name or name == "mudline" for name in recorded(land, interfaces_of(land)))


def test_sites_of_the_package() -> None:
    assert list_metocean() == ["iea22", "template", "weis"]
    weis, iea22 = read_metocean("weis"), read_metocean("iea22")
    assert weis.expected("normal", 12.0) == pytest.approx((1.46, 6.2))
    assert weis.expected("50-year", 50.0) == (9.7, 13.6)
    assert iea22.expected("joint", 10.0) == (1.537, 7.651) and len(iea22.speed) == 23


WRONG: dict[str, dict[str, Any]] = {
    "height must have 15 entries like speed, found 1": {"height": [1.0]},
    "misalignment_share needs one share": {"misalignment": [0.0, 30.0]},
    "severe_height and severe_period come together": {"severe_height": None},
    "the lowest is above the highest": {"levels": (1.0, -1.0)},
    "speed needs at least 2 entries that increase": {"speed": list(range(15, 0, -1))},
    "height must be above 0 m": {"height": [0.0] * 15},
}


@pytest.mark.parametrize("words", WRONG)
def test_bad_sites(words: str) -> None:
    with pytest.raises(InputError, match=words):
        read_metocean("weis").replace(**WRONG[words])


def test_floating_turbines_have_their_own_table() -> None:
    """Records of an hour, without embedded waves; what is not in IEC 61400-3-1 is marked."""
    fixed, table = load_table("61400-3-1"), load_table("61400-3-2")
    assert set(table.rows) - set(fixed.rows) == {"4.3", "9.1", "9.2", "10.1", "10.2"} and not set(fixed.rows) - set(
        table.rows
    )
    assert list(table.rows)[-2:] == ["10.1", "10.2"]
    assert table.defaults.duration == 3600.0 and all(row.wave is None for row in table.rows.values())
    new = (row for name, row in table.rows.items() if name not in fixed.rows)
    assert all({"sea", "seeds", "factor"} <= {*row.practice} for row in new)
    assert {"line_mean", "line_dynamic"} <= {*table.factors.practice}
    same = [name for name, row in fixed.rows.items() if row.factor != table.rows[name].factor]
    assert not same


def test_a_line_parts_in_a_case_of_a_floating_turbine() -> None:
    found = planned(turbine="iea15mw-volturnus", standard="61400-3-2", quick=True)
    assert found.campaign.depth == 200.0 and found.campaign.inclination == 0.0
    production, storm = "dlc9.1-10.7-line_2_lost-s01", "dlc9.2-40-line_1_lost-s01"
    assert found.case(production).content["events"] == [{"type": "line_loss", "line": 2, "at": 310.0}]
    assert found.case(storm).content["events"] == [{"type": "line_loss", "line": 1, "at": 0.0}]
    late = found.case("dlc10.1-10.7-t-1190-line_3_lost-s01")
    assert late.content["events"][0]["at"] == 10.0 and late.transient == 1200.0
    turbine = load_turbine("iea15mw-volturnus")
    kept = recorded(turbine, interfaces_of(turbine))
    assert {"platform_offset", "platform_tilt", "line_3_anchor_tension", "wave_elevation"} <= {*kept}
    assert {*kept} <= known_channels(3).keys()
    for name, words in {"iea15mw-monopile": "has no platform", "iea15mw": "such as iea15mw-volturnus"}.items():
        with pytest.raises(InputError, match=words):
            planned(turbine=name, standard="61400-3-2")


def test_bad_input(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no site 'wei'; did you mean 'weis'"):
        read_metocean("wei")
    with pytest.raises(InputError, match="no such file; a site of the package is one of iea22, template, weis"):
        read_metocean("site.yaml")
    file = tmp_path / "site.yaml"
    file.write_text("name: here\nspeed: [3, 25]\nheight: [1, 4]\nperiods: [7, 9]\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"site\.yaml.*periods.*did you mean 'period'"):
        read_metocean(file)
    with pytest.raises(
        InputError, match="iea15mw has no support; choose a turbine that has one, such as iea15mw-monopile"
    ):
        planned(turbine="iea15mw")
    with pytest.raises(InputError, match="needs the conditions of the site"):
        make_campaign("iea15mw-monopile", "IB", standard="61400-3-1", rated_wind=10.7)
    with pytest.raises(InputError, match="rows.1.3: sea: normal needs the conditions of a site"):
        plan(make_campaign("iea15mw-monopile", "IB", rated_wind=10.7, changes={"rows": {"1.3": {"sea": "normal"}}}))
    for row, words in {
        "joint is for type fatigue": {"sea": "joint"},
        "need a sea": {"sea": None},
        "no level 'hihg'; did you mean 'high'": {"levels": "hihg"},
    }.items():
        with pytest.raises(InputError, match=row):
            load_table("61400-3-1", {"rows": {"1.6": words}})


def test_land_tables_are_as_before() -> None:
    assert edition_content(4).keys() == edition_content("61400-3-1").keys()
    case = plan(make_campaign("nrel5mw", "IB", rated_wind=11.4, quick=True)).cases[0]
    assert "sea" not in case.content and case.name == "dlc1.1-3-s01"
    assert np.isfinite(case.factor)
