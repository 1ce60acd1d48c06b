"""What one run of a farm gains over another, and the loads that it costs: closed forms, words, figure, files."""

from __future__ import annotations

from dataclasses import replace
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from meltemi import InputError
from meltemi.core.yamlfile import read_record
from meltemi.farm.layout import FarmCase
from meltemi.farm.report import (
    CHANNELS,
    FORE_AFT,
    SIDE_SIDE,
    compare_farms,
    comparison_rows,
    differences,
    plot_comparison,
)
from meltemi.farm.settings import WORDS, WakeSettings
from meltemi.farm.simulation import FarmResult
from meltemi.farm.stored import read_farm, write_farm
from meltemi.postprocess.files import write_netcdf
from meltemi.simulation.channels import every_kind
from meltemi.simulation.result import Result

ROOT = "root_moment_out_of_plane_1"
T = np.arange(0.0, 60.0, 0.05)


def turbine(power: float, root: float, tower: float = 1e6, side: float = 0.0) -> Result:
    """Constant power [W], and moments [N m] that oscillate at 0.5 Hz."""
    wave = np.sin(np.pi * T)
    series = {"generator_power": power + 0.0 * T, "wind_x": 9.0 + 0.0 * T, ROOT: root * wave}
    series |= {FORE_AFT: tower * wave, SIDE_SIDE: side * wave}
    channels = tuple(every_kind()[name] for name in series)
    return Result(T, np.stack(list(series.values()), axis=1), channels, meta={"wind": "steady", "transient": 0.0})


def farm(*turbines: Result, yaw: tuple[float, ...] = (0.0, 0.0), **more: Any) -> FarmResult:
    positions = np.array([[630.0 * i, 0.0] for i in range(len(turbines))])
    count = len(turbines)
    return FarmResult(
        turbines, positions, np.array(yaw[:count]), (126.0,) * count, (90.0,) * count, WakeSettings(), **more
    )


@pytest.fixture
def both() -> tuple[FarmResult, FarmResult]:
    """Steered and not: the first turbine gives 0.5 MW, the second gains 1 MW, at twice the load of its blades."""
    steered = farm(turbine(2e6, 1e6), turbine(2e6, 4e6), yaw=(np.radians(20.0), 0.0))
    return steered, farm(turbine(2.5e6, 1e6), turbine(1e6, 2e6))


def test_gain_and_price_are_those_of_the_series(both: tuple[FarmResult, FarmResult]) -> None:
    found = compare_farms(*both)
    assert found.power_change() == pytest.approx([-20.0, 100.0, 100.0 * (4.0 / 3.5 - 1.0)])
    changes = found.load_changes()
    assert list(changes) == [ROOT, FORE_AFT]
    assert changes[ROOT] == pytest.approx([0.0, 100.0])
    assert changes[FORE_AFT] == pytest.approx([0.0, 0.0])
    assert found.words() == (
        "power of the farm +14.29 %; largest rise of an equivalent load: blade root of T2, +100.0 %"
    )


def test_a_fall_of_all_loads_is_no_rise() -> None:
    found = compare_farms(farm(turbine(1e6, 1e6, 1e6)), farm(turbine(1e6, 2e6, 1.25e6)))
    assert found.words().endswith("smallest fall of an equivalent load: tower base of T1, -20.0 %")


def test_the_table_has_both_runs_and_the_farm_at_last(both: tuple[FarmResult, FarmResult]) -> None:
    head, rows = comparison_rows(compare_farms(*both))
    assert [row[0] for row in rows] == ["T1", "T2", "farm"]
    cells = dict(zip(head, rows[1], strict=True))
    assert (cells["power kW"], cells["reference power kW"], cells["power change %"]) == ("2000", "1000", "100.0")
    assert float(cells["blade root DEL kN m"]) == pytest.approx(2.0 * float(cells["reference blade root DEL kN m"]))
    assert cells["blade root DEL change %"] == "100.0"
    first = dict(zip(head, rows[0], strict=True))
    assert (first["yaw deg"], first["reference yaw deg"]) == ("20.00", "0")
    last = dict(zip(head, rows[2], strict=True))
    assert float(last["power change %"]) == pytest.approx(14.29, abs=0.01) and last["blade root DEL change %"] == ""
    short = comparison_rows(compare_farms(*both), values=False)[0]
    assert short == ["turbine", "yaw deg", "power kW", "power %", "blade root %", "tower base %"]


def test_each_tower_is_bent_along_its_own_wind() -> None:
    """The same bending along the wind, from x and from 90 deg: no change."""
    along = farm(turbine(1e6, 1e6, tower=1e6, side=0.0))
    turned = farm(turbine(1e6, 1e6, tower=0.0, side=1e6), direction=0.5 * np.pi)
    assert compare_farms(turned, along).load_changes()[FORE_AFT] == pytest.approx([0.0], abs=1e-9)


def test_what_differs_is_named(both: tuple[FarmResult, FarmResult]) -> None:
    assert differences(*both) == ["yaw"]
    assert differences(both[0], both[0]) == []
    other = replace(both[1].turbines[0], meta={"wind": "another", "transient": 30.0})
    changed = replace(both[1], turbines=(other, both[1][1]), settings=WakeSettings(added_turbulence=False))
    assert differences(both[1], changed) == ["wakes", "wind", "evaluated time"]


def test_farms_of_other_counts_are_refused(both: tuple[FarmResult, FarmResult]) -> None:
    with pytest.raises(InputError, match="has 1 turbine and this farm 2: farms are compared turbine by turbine"):
        compare_farms(both[0], farm(both[1][0]))


def test_bars_are_the_changes(both: tuple[FarmResult, FarmResult]) -> None:
    axes: Any = plot_comparison(compare_farms(*both), "against").axes
    power, loads = axes
    assert [bar.get_height() for bar in power.patches] == pytest.approx([-20.0, 100.0, 14.2857], rel=1e-4)
    assert [text.get_text() for text in power.get_xticklabels()] == ["T1", "T2", "farm"]
    assert [bar.get_height() for bar in loads.patches] == pytest.approx([0.0, 100.0, 0.0, 0.0])
    assert [text.get_text() for text in loads.get_legend().get_texts()] == ["blade root", "tower base"]


def test_a_stored_farm_is_read_as_it_was(both: tuple[FarmResult, FarmResult], tmp_path: Path) -> None:
    place = {"position": [0.0, 0.0], "yaw": 0.3, "diameter": 126.0, "hub_height": 90.0, "direction": 0.1}
    meta = {**both[0][0].meta, "farm": place | {"wakes": WakeSettings(model="keck").model_dump(mode="json")}}
    stored = replace(both[0], turbines=tuple(replace(each, meta=meta) for each in both[0].turbines))
    assert [path.name for path in write_farm(stored, tmp_path)] == ["turbine_1.nc", "turbine_2.nc"]
    found = read_farm(tmp_path)
    assert np.array_equal(found[1].data, both[0][1].data)
    assert found.yaw == pytest.approx([0.3, 0.3]) and found.direction == 0.1
    assert found.settings == WakeSettings(model="keck")


def test_folders_without_a_farm_are_refused(both: tuple[FarmResult, FarmResult], tmp_path: Path) -> None:
    with pytest.raises(InputError, match="expected the output folder of meltemi farm"):
        read_farm(tmp_path)
    write_netcdf(both[0][0], tmp_path / "turbine_1.nc")
    with pytest.raises(InputError, match=r"turbine_1.nc has no position in a farm.*farm\.yaml"):
        read_farm(tmp_path)
    (tmp_path / "turbine_1.nc").rename(tmp_path / "turbine_2.nc")
    with pytest.raises(InputError, match=r"turbine_1\.nc"):
        read_farm(tmp_path)


def test_titles_name_the_model_in_words() -> None:
    assert WakeSettings().words == "wake model as FAST.Farm's"
    assert WakeSettings(added_turbulence=False).words == "wake model as FAST.Farm's, no added turbulence"
    assert WakeSettings(model="none", added_turbulence=False).words == "without wakes"
    assert all("fast.farm" not in words for words in WORDS.values())


def test_the_template_is_a_farm_with_and_without_its_comments(tmp_path: Path) -> None:
    text = (files("meltemi.farm") / "template.yaml").read_text(encoding="utf-8")
    path = tmp_path / "farm.yaml"
    path.write_text(text)
    case = read_record(path, FarmCase)
    assert set(case.channels) == set(CHANNELS) and len(case.positions) == 3
    for old in ("# yaw: ", "# intensity: ", "# step: "):
        assert old in text
        text = text.replace(old, old[2:], 1)
    path.write_text(text)
    full = read_record(path, FarmCase)
    assert full.yaw == pytest.approx((np.radians(20.0), 0.0, 0.0))
    assert (full.wakes.intensity, full.wakes.step) == (0.1, 2.0)
