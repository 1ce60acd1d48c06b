"""Wind roses of other programs, and what a farm yields in one."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import meltemi
from meltemi.farm.layout import FarmCase
from meltemi.farm.report import LOADS
from meltemi.farm.rose import WindRose, farm_direction, read_rose
from meltemi.farm.rose_study import (
    RosePiece,
    finished,
    long_rows,
    rose_pieces,
    sector_rows,
    simulate_rose,
    turbine_rows,
)

FLORIS = "ws,wd,freq_val,ti\n8,0,0.1,0.06\n10,0,0.2,0.07\n8,270,0.3,0.08\n10,270,0.4,0.09\n"
WINDIO = """\
site:
  energy_resource:
    wind_resource:
      wind_direction: [0, 270]
      wind_speed: [8, 10]
      probability: {data: [[0.1, 0.3], [0.2, 0.4]], dims: [wind_speed, wind_direction]}
      turbulence_intensity: {data: [0.06, 0.08], dims: [wind_direction]}
"""
ROSE = WindRose(np.array([0.0, 270.0]), np.array([8.0, 30.0]), np.array([[0.1, 0.1], [0.3, 0.5]]))


def written(tmp_path: Path, name: str, text: str) -> Path:
    path = tmp_path / name
    path.write_text(text)
    return path


def test_tables_of_floris_and_windio_are_read_alike(tmp_path: Path) -> None:
    for name, text, intensity in (("a.csv", FLORIS, 0.08), ("a.yaml", WINDIO, 0.08)):
        rose = read_rose(written(tmp_path, name, text))
        assert rose.directions.tolist() == [0.0, 270.0] and rose.speeds.tolist() == [8.0, 10.0]
        assert rose.probability.tolist() == [[0.1, 0.2], [0.3, 0.4]]
        assert rose.intensity is not None and rose.intensity[1, 0] == intensity


def test_a_site_of_pywake_has_weibull_distributions_by_sector(tmp_path: Path) -> None:
    xr = pytest.importorskip("xarray")
    site = xr.Dataset(
        {name: ("wd", values) for name, values in (
            ("Sector_frequency", [0.25, 0.75, 0.25]), ("Weibull_A", [8.0, 10.0, 8.0]), ("Weibull_k", [2.0, 2.0, 2.0])
        )} | {"TI": 0.1},
        {"wd": [0.0, 180.0, 360.0]},
    )  # fmt: skip
    site.to_netcdf(tmp_path / "site.nc")
    rose = read_rose(tmp_path / "site.nc", [4.0, 6.0, 8.0])
    assert rose.directions.tolist() == [0.0, 180.0]  # the first sector is not counted twice
    expected = 0.75 * (math.exp(-((5.0 / 10.0) ** 2)) - math.exp(-((7.0 / 10.0) ** 2)))
    assert rose.probability[1, 1] == pytest.approx(expected)
    assert rose.intensity is not None and np.all(rose.intensity == 0.1)


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("a.txt", FLORIS, "expected a wind rose"),
        ("a.csv", FLORIS.replace("freq_val", "freq_vla"), "expected a column freq_val"),
        ("a.csv", FLORIS.replace("0.4", "40"), "sum of at most 1, found 40.6"),
        ("a.csv", FLORIS.replace("10,0,", "8,0,"), "appear twice"),
        ("a.csv", FLORIS.replace("0.4", "x"), "column freq_val: expected a number"),
        ("a.yaml", WINDIO.replace("probability", "probabilty"), "probability: expected numbers"),
        ("a.yaml", WINDIO.replace("[8, 10]", "[8, 10, 12]"), "2 directions x 3 speeds"),
    ],
)
def test_roses_with_mistakes_are_refused_in_words(tmp_path: Path, name: str, text: str, words: str) -> None:
    with pytest.raises(meltemi.InputError, match=words):
        read_rose(written(tmp_path, name, text))


@pytest.mark.parametrize(("wind_from", "blows"), [(270.0, (1.0, 0.0)), (300.0, (0.866, -0.5)), (0.0, (0.0, -1.0))])
def test_wind_from_the_west_blows_along_x_and_from_the_north_to_the_south(
    wind_from: float, blows: tuple[float, float]
) -> None:
    direction = farm_direction(wind_from)
    assert (math.cos(direction), -math.sin(direction)) == pytest.approx(blows, abs=1e-3)


def case_of(tmp_path: Path, **keys: Any) -> FarmCase:
    data = {"turbine": "nrel5mw", "positions": [(0.0, 0.0), (630.0, 0.0)], "duration": 20.0}
    return FarmCase(**(data | {"wind": {"kind": "turbulence", "speed": 9.0, "intensity": 0.1}} | keys))


def test_pieces_are_the_bins_in_which_the_turbine_operates_and_are_known_by_their_inputs(tmp_path: Path) -> None:
    pieces = rose_pieces(case_of(tmp_path), tmp_path, ROSE, 2, tmp_path)
    assert [(piece.bin, piece.name) for piece in pieces] == [
        ((1, 0), "270 deg, 8 m/s, seed 1"),
        ((1, 0), "270 deg, 8 m/s, seed 2"),
        ((0, 0), "0 deg, 8 m/s, seed 1"),
        ((0, 0), "0 deg, 8 m/s, seed 2"),
    ]
    changed = rose_pieces(case_of(tmp_path, duration=30.0), tmp_path, ROSE, 2, tmp_path)
    files = [{piece.work.args[2].name for piece in each} for each in (pieces, changed)]  # type: ignore[attr-defined]
    assert len(files[0] | files[1]) == 8


def values(power: float, load: float) -> dict[str, list[float]]:
    return {"power": [power], "power_no_wakes": [2e6], "wind_speed": [8.0]} | {name: [load] for name in LOADS}


def test_values_are_weighed_by_probability_and_a_failed_piece_ends_nothing() -> None:
    def fails() -> dict[str, list[float]]:
        raise meltemi.InputError("no wind")

    works = (lambda: values(1e6, 1.0), lambda: values(2e6, 3.0), lambda: values(1e6, 2.0), fails)
    bins = ((0, 0), (0, 0), (1, 0), (1, 1))
    done: list[float] = []
    pieces = [RosePiece(f"piece {n}", work, bin=at) for n, (at, work) in enumerate(zip(bins, works, strict=True))]
    result = simulate_rose(pieces, ROSE, 1, done.append)
    assert done[-1] == 1.0 and result.failed == {"piece 3": "no wind"}
    assert result.mean("power") == pytest.approx(0.1 * 1.5e6 + 0.3 * 1e6)
    m, name = 4.0, "tower_base_moment_fore_aft"
    damage = np.array([0.1 * 0.5 * (1.0 + 3.0**m), 0.3 * 2.0**m])
    assert result.lifetime(name) == pytest.approx(damage.sum() ** (1.0 / m))
    loads, shares = result.by_sector(name)
    assert loads[0] == pytest.approx((damage / [0.1, 0.3]) ** (1.0 / m))
    assert shares[0] == pytest.approx(damage / damage.sum())
    head, rows = turbine_rows(result)
    farm = dict(zip(head, rows[-1], strict=True))
    assert farm["AEP [MWh]"] == pytest.approx(8760.0 * 0.45) and farm["wake loss [%]"] == pytest.approx(43.75)
    assert len(long_rows(result)[1]) == 4 and len(sector_rows(result)[1]) == 2


@pytest.mark.slow
def test_a_wind_along_the_row_costs_the_second_turbine_power_and_is_kept(tmp_path: Path) -> None:
    rose = WindRose(np.array([0.0, 270.0]), np.array([9.0]), np.array([[0.4], [0.6]]))
    pieces = rose_pieces(case_of(tmp_path), tmp_path, rose, 1, tmp_path)
    result = simulate_rose(pieces, rose, 2)
    loss = 1.0 - result.values["power"] / result.values["power_no_wakes"]
    assert not result.failed
    assert loss[1, 1, 0] > 0.3 and np.abs(loss[:, 0]).max() < 0.02 and abs(loss[0, 1, 0]) < 0.02
    (case, folder, file) = pieces[0].work.args  # type: ignore[attr-defined]
    file.write_text(file.read_text().replace('"wind_speed": [', '"wind_speed": [1'))  # it is read, not simulated
    assert finished(case, folder, file)["wind_speed"][0] > 10.0
    file.write_text("{")
    assert finished(case, folder, file)["power"] == result.values["power"][:, 1, 0].tolist()
