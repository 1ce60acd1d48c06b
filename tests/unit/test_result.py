"""What a simulation gives back: series by name, parts, status, tables with labels."""

from __future__ import annotations

import csv
import json
import sys
from collections.abc import Callable
from dataclasses import FrozenInstanceError, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import meltemi
from meltemi import InputError, Result, RunError, Status
from meltemi.core import extras
from meltemi.postprocess.fatigue import equivalent_loads
from meltemi.postprocess.files import read_netcdf, write_netcdf
from meltemi.report.tables import early_extremes, number, statistics_rows, write_csv
from meltemi.simulation.channels import standard

TIME = np.arange(0.0, 10.05, 0.1)
NAMES = ("rotor_speed", "pitch_1", "root_moment_out_of_plane_1", "wind_x")
COLUMNS = (1.2 + 0.1 * np.sin(TIME), 0.02 * TIME, 8e6 + 1e6 * np.cos(2.0 * np.pi * TIME), np.full_like(TIME, 9.0))
META = {"turbine": "nrel5mw", "wind": "steady wind 9 m/s"}


@pytest.fixture
def result() -> Result:
    return Result(TIME, np.stack(COLUMNS, axis=1), tuple(standard()[name] for name in NAMES), meta=META)


def ended(status: Status, message: str = "") -> Result:
    return Result(TIME[:0], np.zeros((0, 1)), (standard()["wind_x"],), status, message)


@pytest.mark.parametrize("name", ["root_moment_out_of_plane_1", "RootMyc1", "ROOTMYC1", "Root_Moment_Out_Of_Plane_1"])
def test_a_series_is_found_by_either_name(result: Result, name: str) -> None:
    assert np.array_equal(result[name], COLUMNS[2])
    assert result.channel(name).unit == "N m"
    assert name in result


def test_series_that_were_not_recorded(result: Result) -> None:
    assert "RootMyc2" not in result
    with pytest.raises(InputError, match="no channel 'RootMyc2': did you mean RootMyc1"):
        result["RootMyc2"]
    with pytest.raises(InputError, match="no channel 'time'"):
        result.channel("time")


def test_a_result_is_a_mapping_of_names_to_series(result: Result) -> None:
    assert list(result) == list(result.keys()) == list(NAMES)
    assert len(result) == len(NAMES)
    assert np.array_equal(dict(result)["wind_x"], COLUMNS[3])
    assert result.get("RootMyc2") is None
    assert result["time"] is result.time
    assert "time" in result
    with pytest.raises(KeyError, match="^no channel 'RootMyc2'"):
        result["RootMyc2"]


def test_an_application_hears_the_logger_of_the_library(caplog: pytest.LogCaptureFixture) -> None:
    model = meltemi.build(meltemi.load_turbine("pmsg20mw"))
    with caplog.at_level("INFO", logger="meltemi"):
        meltemi.simulate(model, meltemi.SteadyWind(speed=9.0), duration=1.0)
    assert [(r.name, r.levelname) for r in caplog.records] == [("meltemi", "INFO")]
    assert "channels, 0 to 1 s, OK" in caplog.text


def test_names_are_in_the_order_of_the_columns(result: Result) -> None:
    assert result.names == list(NAMES)
    for i, name in enumerate(result.names):
        assert np.array_equal(result[name], result.data[:, i])


@pytest.mark.parametrize(
    ("begin", "end", "n"), [(2.0, 3.0, 11), (0.0, 10.0, 101), (-5.0, 0.0, 1), (2.04, 2.06, 0), (7.0, 99.0, 31)]
)
def test_a_part_of_the_series_has_both_ends(result: Result, begin: float, end: float, n: int) -> None:
    part = result.between(begin, end)
    assert len(part.time) == len(part.data) == n
    assert np.all((part.time >= begin - 1e-9) & (part.time <= end + 1e-9))
    assert (part.channels, part.meta, part.status) == (result.channels, result.meta, result.status)
    if n:
        i = int(np.searchsorted(TIME, part.time[0]))
        assert np.array_equal(part.data, result.data[i : i + n])


def test_a_part_of_a_part(result: Result) -> None:
    part = result.between(2.0, 8.0).between(4.0, 9.0)
    assert (part.time[0], part.time[-1]) == pytest.approx((4.0, 8.0))


def test_results_do_not_change(result: Result) -> None:
    with pytest.raises(FrozenInstanceError):
        result.status = Status.DIVERGED  # type: ignore[misc]


def test_a_run_that_ended_well_gives_itself(result: Result) -> None:
    assert result.raise_for_status() is result


@pytest.mark.parametrize("status", [s for s in Status if s is not Status.OK])
def test_a_run_that_ended_early_raises_with_its_reason(status: Status) -> None:
    with pytest.raises(RunError, match=r"^at t = 3 s: because$"):
        ended(status, "at t = 3 s: because").raise_for_status()
    with pytest.raises(RunError) as caught:
        ended(status).raise_for_status()
    assert str(caught.value) == status.message and caught.value.result.status is status


def test_labelled_arrays(result: Result) -> None:
    data = result.to_xarray()
    assert list(data.data_vars) == list(NAMES)
    np.testing.assert_array_equal(data["pitch_1"].sel(time=2.0, method="nearest"), COLUMNS[1][20])
    for channel in result.channels:
        attributes = data[channel.name].attrs
        assert attributes["units"] == channel.unit
        assert (attributes["unit_in_tables"], attributes["factor_to_tables"]) == channel.display_unit
        assert attributes["frame"] == channel.frame
        assert attributes["positive_direction"] == channel.sign
        assert attributes["long_name"] == channel.description
        assert attributes["openfast_name"] == channel.alias
    assert data["time"].attrs["units"] == "s"
    assert (data.attrs["status"], data.attrs["message"]) == (0, "")
    assert json.loads(data.attrs["meta"]) == META


def test_files_and_tables_of_commands_need_neither_xarray_nor_pandas(
    result: Result, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("xarray", "pandas"):
        monkeypatch.setitem(sys.modules, name, None)
    monkeypatch.setattr(extras, "installed", lambda name: False)
    again = read_netcdf(write_netcdf(result, tmp_path / "a.nc"))
    assert statistics_rows(again) == statistics_rows(result)
    for call, needed in ((Result.to_xarray, "xarray"), (Result.to_pandas, "pandas"), (Result.statistics, "pandas")):
        with pytest.raises(extras.MissingPackageError, match=rf"{call.__name__} needs {needed}.*pip install '{needed}"):
            call(result)


def test_statistics_are_in_units_for_people(result: Result) -> None:
    table = result.statistics()
    assert list(table.index) == list(NAMES)
    assert list(table.columns) == ["unit", "mean", "std", "min", "max"]
    assert list(table["unit"]) == ["rpm", "deg", "kN m", "m/s"]
    factors = (30.0 / np.pi, 180.0 / np.pi, 1e-3, 1.0)
    for name, x, factor in zip(NAMES, COLUMNS, factors, strict=True):
        expected = [np.mean(x), np.std(x), np.min(x), np.max(x)]
        found = [float(table.loc[name, key]) for key in ("mean", "std", "min", "max")]
        assert found == pytest.approx([factor * v for v in expected], rel=1e-12, abs=1e-12)


@pytest.mark.parametrize(
    "evaluate",
    [Result.statistics, equivalent_loads, meltemi.plot, meltemi.loads.summary, statistics_rows, lambda r: r.evaluated],
)
def test_nothing_cannot_be_evaluated(result: Result, evaluate: Callable[[Result], Any]) -> None:
    with pytest.raises(InputError, match=r"^the result has no samples.*: at t = 3 s: because$"):
        evaluate(ended(Status.DIVERGED, "at t = 3 s: because"))
    late = replace(result, meta={"transient": 60.0})
    if evaluate is not meltemi.plot:
        with pytest.raises(InputError, match="none after its initial transient$"):
            evaluate(late)
    assert "empty" in ended(Status.DIVERGED)._repr_html_() and not late.sampled
    with pytest.raises(InputError, match="one sample"):
        equivalent_loads(result.between(0.0, 0.0))


def test_a_table_of_the_series(result: Result) -> None:
    table = result.to_pandas()
    assert list(table.columns) == list(NAMES) and table.attrs["units"]["pitch_1"] == "rad"
    np.testing.assert_array_equal(table["pitch_1"].to_numpy(), COLUMNS[1])
    np.testing.assert_array_equal(table.index.to_numpy(), TIME)


def test_a_result_says_what_it_is(result: Result) -> None:
    assert repr(result) == "<Result: 4 channels, 0 to 10 s, OK>"
    assert repr(ended(Status.DIVERGED, "because")) == "<Result: 1 channels, empty, DIVERGED; because>"
    html = result._repr_html_()
    assert "<table" in html
    for name in NAMES:
        assert name in html


def test_a_browser_shows_what_a_result_is(result: Result) -> None:
    assert "4 channels" in result._repr_html_()


# the same as a table of text


def test_rows_of_the_statistics(result: Result) -> None:
    head, rows = statistics_rows(result)
    assert head == ["channel", "OpenFAST", "unit", "mean", "std", "min", "max", "DEL 1 Hz"]
    assert [row[:3] for row in rows] == [
        ["rotor_speed", "RotSpeed", "rpm"],
        ["pitch_1", "BldPitch1", "deg"],
        ["root_moment_out_of_plane_1", "RootMyc1", "kN m"],
        ["wind_x", "Wind1VelX", "m/s"],
    ]
    assert rows[3][3:] == ["9.000", "0", "9.000", "9.000", ""]
    # a cosine of 1 Hz: its range
    assert rows[2][3:] == ["8010", number(np.std(COLUMNS[2]) * 1e-3), "7000", "9000", "2000"]
    assert equivalent_loads(result)["root_moment_out_of_plane_1"] == pytest.approx(2e6, rel=1e-9)
    assert [row[-1] for row in rows] == ["", "", "2000", ""]


def test_tables_survive_a_file(result: Result, tmp_path: Path) -> None:
    head, rows = statistics_rows(result)
    rows.append(['a, "b"', "é", "", "-", "1e9", "0", "", ""])
    path = write_csv(tmp_path / "a.csv", head, rows)
    with path.open(newline="", encoding="utf-8") as file:
        found = list(csv.reader(file))
    assert found[0] == head and found[-1] == rows[-1] and [r[:3] for r in found] == [r[:3] for r in (head, *rows)]
    # the table shows 4 digits, the file has them all
    assert float(found[3][4]) == pytest.approx(np.std(COLUMNS[2]) * 1e-3, rel=1e-14)
    assert rows[2][4] != found[3][4]


@pytest.mark.parametrize("name", ["nowhere/a.csv", "folder"])
def test_tables_that_cannot_be_written_are_named(tmp_path: Path, name: str) -> None:
    (tmp_path / "folder").mkdir()
    with pytest.raises(InputError, match=rf"{name}: cannot be written \("):
        write_csv(tmp_path / name, ["a"], [["1"]])


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.0, "0"),
        (-0.0, "0"),
        (1.0, "1.000"),
        (-12.3456, "-12.35"),
        (123.456, "123.5"),
        (1234.56, "1235"),
        (54321.0, "54321"),
        (1234567.0, "1.235e+06"),
        (0.5, "0.5000"),
        (1e-7, "1.000e-07"),
        (float("nan"), "-"),
    ],
)
def test_numbers_for_people(value: float, text: str) -> None:
    assert number(value) == text


@pytest.mark.parametrize("size", 10.0 ** np.arange(-6, 10))
def test_numbers_have_four_digits(size: Any) -> None:
    for value in size * np.array([1.0, 1.23456, 4.99951, 9.8765]):
        assert float(number(value)) == pytest.approx(value, rel=5.001e-4)


def test_a_status_prints_its_name() -> None:
    assert str(Status.OK) == f"{Status.OK}" == "OK"
    assert f"{Status.DOUBTFUL:>10}" == "  DOUBTFUL"
    assert int(Status.OK) == 0 and json.dumps({"status": Status.DOUBTFUL}) == '{"status": 7}'


def test_statistics_leave_the_transient_out(result: Result) -> None:
    late = replace(result, meta=META | {"transient": 5.0})
    part = result.between(5.0, 10.0)
    assert late.statistics().equals(part.statistics())
    assert equivalent_loads(late) == equivalent_loads(part)
    assert statistics_rows(late) == statistics_rows(part)
    assert not late.statistics().equals(result.statistics())
    # a part that is asked for is judged as it is
    assert late.between(0.0, 4.0).statistics().equals(result.between(0.0, 4.0).statistics())


def test_extremes_of_the_first_seconds_are_told(result: Result) -> None:
    result = replace(result, time=4.0 * TIME)
    assert early_extremes(result) == ""
    data = result.data.copy()
    data[3, 2] = 12e6
    early = replace(result, data=data)
    assert early_extremes(replace(early, time=TIME)) == ""  # too short to say
    assert early_extremes(early).startswith("extremes occur in the first seconds")
    assert "root_moment_out_of_plane_1 at 1.20 s" in early_extremes(early)
    assert early_extremes(replace(early, meta=META | {"transient": 2.0})) == ""
    data[3, 2], data[3, 3] = 9.1e6, 30.0  # hardly more than later; a gust is wind
    assert early_extremes(early) == ""


def test_times_that_are_none_are_told() -> None:
    series = Result(np.arange(3.0), np.zeros((3, 0)), ())
    for begin in ("1", [], np.zeros(0), np.zeros(3)):
        with pytest.raises(InputError, match="between: expected two numbers"):
            series.between(begin, 2.0)  # type: ignore[arg-type]
