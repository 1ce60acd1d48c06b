"""Statistics of ten minutes and their bins: exact on series made for it."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest

import meltemi as mt
from meltemi import InputError
from meltemi.postprocess.bins import EDGES, result_statistics
from meltemi.simulation.channels import catalogue
from meltemi.simulation.result import Result

RATE = 50.0
"""[Hz] of the campaign."""


def record(means: list[float], swing: float = 0.5) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Ten minutes at each mean wind speed: a square wave about it, and a power of a hundred times the wind."""
    n = int(600 * RATE)
    time = np.arange(n * len(means)) / RATE
    square = np.where(np.arange(n) % 100 < 50, swing, -swing)
    wind = np.concatenate([mean + square for mean in means])
    return time, {"wind_speed": wind, "power": 100.0 * wind}


def test_ten_minutes_are_exact() -> None:
    time, series = record([8.0, 3.0])
    found = mt.loads.period_statistics(time, series)
    assert list(found.index) == [0.0, 600.0]
    assert found["wind_speed", "mean"].to_numpy() == pytest.approx([8.0, 3.0], rel=1e-12)
    assert found["wind_speed", "std"].to_numpy() == pytest.approx([0.5, 0.5], rel=1e-12)
    assert found["power", "min"].tolist() == [750.0, 250.0]
    assert found["power", "max"].tolist() == [850.0, 350.0]


def test_bins_are_exact() -> None:
    time, series = record([8.1, 2.0, 7.7, 8.6, 2.5])
    found = mt.loads.bin_statistics(mt.loads.period_statistics(time, series))
    assert len(found) == len(EDGES) - 1
    assert found["bin", "sets"].loc[[1, 2, 7, 8]].tolist() == [1, 1, 2, 1]  # 2.5 belongs to the bin above
    assert found["bin", "sets"].sum() == 5
    row = found.loc[7]
    assert row["wind_speed", "mean"] == pytest.approx(7.9, rel=1e-12)
    assert row["power", "std"] == pytest.approx(50.0, rel=1e-12)
    assert (row["power", "min"], row["power", "max"]) == pytest.approx((720.0, 860.0))
    assert row["bin", "intensity"] == pytest.approx(0.5 * (0.5 / 8.1 + 0.5 / 7.7))
    assert np.isnan(found.loc[5]["power", "mean"])


def test_the_last_edge_belongs_to_the_last_bin_and_what_lies_outside_to_none() -> None:
    time, series = record([5.0, 6.0, 7.0])
    found = mt.loads.bin_statistics(mt.loads.period_statistics(time, series), edges=(4.0, 5.0, 6.0))
    assert found["bin", "sets"].tolist() == [0, 2]


def test_gaps_leave_periods_out() -> None:
    time, series = record([8.0, 9.0, 10.0])
    series["power"][: 60 * int(RATE)] = np.nan  # a minute of the first ten
    keep = (time < 900.0) | (time >= 1200.0)  # half of the second ten
    found = mt.loads.period_statistics(time[keep], {k: x[keep] for k, x in series.items()})
    assert list(found.index) == [1200.0]
    found = mt.loads.period_statistics(time[keep], {k: x[keep] for k, x in series.items()}, complete=0.8)
    assert list(found.index) == [0.0, 1200.0]
    assert found["power", "mean"].iloc[0] == pytest.approx(800.0)


def test_a_simulation_is_a_period() -> None:
    channels = tuple(catalogue()[name] for name in ("wind_x", "generator_power"))
    time = np.arange(0.0, 20.0, 0.05)
    data = np.stack([time, 2.0 * time], axis=1)
    row = result_statistics(Result(time, data, channels), ["generator_power"], begin=10.0)
    assert row["generator_power", "min"].iloc[0] == pytest.approx(20.0)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"time": [0.0, 0.0]}, "increasing"),
        ({"period": 0.0}, "period must be positive"),
        ({"complete": 0.0}, "complete must lie"),
        ({"series": {"power": [1.0, 2.0, 3.0]}}, "'power' has shape"),
    ],
)
def test_bad_series_are_refused(change: dict[str, object], words: str) -> None:
    arguments: dict[str, object] = {"time": [0.0, 1.0], "series": {"power": [1.0, 2.0]}} | change
    with pytest.raises(InputError, match=words):
        mt.loads.period_statistics(**arguments)  # type: ignore[arg-type]


def test_bad_bins_are_refused() -> None:
    time, series = record([8.0])
    periods = mt.loads.period_statistics(time, series)
    with pytest.raises(InputError, match="did you mean 'wind_speed'"):
        mt.loads.bin_statistics(periods, "wind_sped")
    with pytest.raises(InputError, match="edges"):
        mt.loads.bin_statistics(periods, edges=(2.0, 1.0))


def test_the_table_of_the_paper_adds_up() -> None:
    """Its sets are 2,917, and its bins are ours."""
    import meltemi_papers.wang2021 as study

    with (Path(study.__file__).parent / "table2.csv").open(encoding="utf-8") as file:
        rows = [{name: float(x) for name, x in row.items()} for row in csv.DictReader(file)]
    assert sum(row["sets"] for row in rows) == 2917
    assert [row["from"] for row in rows] == list(EDGES[: len(rows)])
    assert all(row["from"] <= row["speed"] < row["to"] for row in rows)


def test_a_period_too_short_to_count_is_refused() -> None:
    with pytest.raises(InputError, match="period 4.94066e-324 s is too short for times up to 2 s"):
        mt.loads.period_statistics([0.0, 1.0, 2.0], {"x": [0.0, 1.0, 2.0]}, period=5e-324)
