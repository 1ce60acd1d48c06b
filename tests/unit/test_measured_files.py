"""Measurements from files of every kind: the same numbers, times by every kind of stamp, records, clear refusals."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from scipy.io import savemat

from meltemi import InputError
from meltemi.core.hdf5 import to_netcdf
from meltemi.core.yamlfile import write_record
from meltemi.validation.channel_map import ChannelMap, Logger, Sensor, TimeStamps, read_channel_map
from meltemi.validation.measurements import MeasuredRecord, Signal, measurements_of, read_measurements
from meltemi.validation.quality import doubtful

BEGIN = 1_714_564_800.0
"""2024-05-01 12:00:00 UTC."""
N, RATE = 1200, 2.0
TIME = BEGIN + np.arange(N) / RATE
POWER = 2000.0 + 500.0 * np.sin(0.1 * np.arange(N))
"""[kW]."""
WIND = 9.0 + np.cos(0.05 * np.arange(N))
POWER[7] = np.nan


def channel_map(stamps: dict[str, Any], prefix: str = "", **power: Any) -> ChannelMap:
    channels = {
        "GenPwr": {"column": f"{prefix}P", "unit": "kW", "kind": "power", **power},
        "wind_speed": {"column": f"{prefix}u", "unit": "m/s", "kind": "sonic", "height": 32.0, "upwind": 67.5},
    }
    return ChannelMap(loggers={"scada": {"time": stamps, "channels": channels}})


def iso(zone: str = "Z") -> list[str]:
    return [f"{np.datetime64(round(t * 1000), 'ms')}{zone}" for t in TIME]


def write_csv(path: Path, times: list[str], separator: str = ",", comma: str = ".") -> None:
    rows = [["t", "P [kW]", "u"], ["", "kW", "m/s"]]
    for t, p, u in zip(times, POWER, WIND, strict=True):
        rows.append([t, "" if np.isnan(p) else repr(float(p)).replace(".", comma), repr(float(u)).replace(".", comma)])
    path.write_text("# logger 3\n" + "\n".join(separator.join(row) for row in rows) + "\n")


def parquet(path: Path) -> None:
    frame().reset_index().to_parquet(path)


def frame() -> Any:
    import pandas as pd

    index = (
        pd.DatetimeIndex((TIME * 1000).round().astype("M8[ms]"), name="t").tz_localize("UTC").tz_convert("Asia/Tokyo")
    )
    return pd.DataFrame({"P": POWER, "u": WIND}, index=index)


def netcdf(path: Path) -> None:
    about = {"units": "seconds since 2024-05-01 12:00:00"}
    rows = {"P": (("t",), POWER, {"units": "kW"}), "u": (("t",), WIND, {})}
    to_netcdf({"t": (("t",), TIME - BEGIN, about)} | rows, {}, path)


def matlab73(path: Path) -> None:
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, x in (("t", TIME / 86400.0 + 719529.0), ("P", POWER), ("u", WIND)):
            file.create_dataset(f"mast/{name}", data=x[None, :])
    with path.open("r+b") as raw:
        raw.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(128))


def matlab5(path: Path) -> None:
    savemat(path, {"mast": {"t": TIME, "P": POWER, "u": WIND}})


KINDS: dict[str, tuple[str, Callable[[Path], None], dict[str, Any], str]] = {
    "csv": ("a.csv", lambda path: write_csv(path, iso()), {"column": "t"}, ""),
    "semicolon": ("a.txt", lambda path: write_csv(path, iso(), ";", ","), {"column": "t"}, ""),
    "tabulator": ("a.dat", lambda path: write_csv(path, iso(), "\t"), {"column": "t"}, ""),
    "parquet": ("a.parquet", parquet, {"column": "t"}, ""),
    "netcdf": ("a.nc", netcdf, {"column": "t", "form": "posix"}, ""),
    "matlab 7.3": ("a.mat", matlab73, {"column": "mast/t", "form": "matlab"}, "mast/"),
    "matlab 5": ("a.mat", matlab5, {"column": "mast/t", "form": "posix"}, "mast/"),
}


@pytest.mark.parametrize("kind", KINDS)
def test_every_format_has_the_same_numbers(kind: str, tmp_path: Path) -> None:
    name, write, stamps, prefix = KINDS[kind]
    write(tmp_path / name)
    (record,) = read_measurements(tmp_path, channel_map(stamps, prefix))
    power, wind = record["generator_power"], record["wind_speed"]
    assert power.time == pytest.approx(TIME, abs=1e-4) and wind.time == pytest.approx(TIME, abs=1e-4)
    assert power.rate == pytest.approx(RATE, rel=1e-3)
    assert power.values == pytest.approx(1e3 * POWER, nan_ok=True) and wind.values == pytest.approx(WIND)
    assert record.file == name


def wind_of(records: list[MeasuredRecord]) -> Signal:
    (record,) = records
    return record["wind_speed"]


def test_a_data_frame_and_columns() -> None:
    wind = wind_of(measurements_of({"scada": frame()}, channel_map({"column": "t"})))
    assert wind.time == pytest.approx(TIME, abs=1e-3) and wind.values == pytest.approx(WIND)
    columns = {"t": TIME, "P": POWER, "u": WIND}
    assert wind_of(measurements_of({"scada": columns}, channel_map({"column": "t", "form": "posix"}))).time[0] == BEGIN
    with pytest.raises(InputError, match="no table of logger 'scada': did you mean 'skada'"):
        measurements_of({"skada": columns}, channel_map({"column": "t"}))


def test_sign_gain_and_offset() -> None:
    columns = {"t": TIME, "P": POWER, "u": WIND}
    changed = channel_map({"column": "t", "form": "posix"}, sign=-1, gain=2.0, offset=5.0)
    (record,) = measurements_of({"scada": columns}, changed)
    assert record["generator_power"].values == pytest.approx(-1e3 * (2.0 * POWER + 5.0), nan_ok=True)


@pytest.mark.parametrize(
    ("stamps", "texts", "shift"),
    [
        ({"zone": "+02:00"}, iso(""), -7200.0),
        ({"zone": "-03:30"}, iso(""), 12600.0),
        ({"zone": "Europe/Berlin"}, iso(""), -7200.0),  # summer time
        ({"zone": "Europe/Berlin"}, iso("Z"), 0.0),  # the stamp's zone counts
        ({"stamp": "end"}, iso("Z"), -0.5),
    ],
)
def test_zones_and_ends_of_periods(stamps: dict[str, Any], texts: list[str], shift: float) -> None:
    columns = {"t": np.array(texts), "P": POWER, "u": WIND}
    wind = wind_of(measurements_of({"scada": columns}, channel_map({"column": "t", **stamps})))
    assert wind.time == pytest.approx(TIME + shift, abs=1e-3)


@pytest.mark.parametrize(("stamp", "shift"), [("begin", 0.0), ("end", -600.0)])
def test_dates_in_names_of_files(stamp: str, shift: float, tmp_path: Path) -> None:
    for i in (1, 0):
        write_csv(tmp_path / f"scada_20240501_12{i}0.csv", [str(k / RATE) for k in range(N)])
    stamps = {"column": "t", "form": "seconds", "stamp": stamp, "name": "scada_%Y%m%d_%H%M.csv"}
    records = read_measurements(tmp_path, channel_map(stamps))
    assert [r.begin - BEGIN for r in records] == pytest.approx([shift, 600.0 + shift], abs=1e-3)
    assert [r.file for r in records] == ["scada_20240501_1200.csv", "scada_20240501_1210.csv"]
    assert [len(r["wind_speed"].values) for r in records] == [N, N]
    write_csv(tmp_path / "other.csv", [str(k) for k in range(N)])
    with pytest.raises(InputError, match=r"other.csv: .*does not match format"):
        read_measurements(tmp_path, channel_map(stamps))


def long_file(n: int, rate: float = RATE, begin: float = BEGIN) -> list[MeasuredRecord]:
    columns = {"t": begin + np.arange(n) / rate, "P": np.arange(n) * 1.0, "u": np.arange(n) * 1.0}
    return measurements_of({"scada": columns}, channel_map({"column": "t", "form": "posix"}))


def test_long_files_are_cut_at_whole_periods() -> None:
    records = long_file(4 * N, begin=BEGIN + 240.0)
    assert [r.begin - BEGIN for r in records] == [
        0.0,
        600.0,
        1200.0,
        1800.0,
    ]  # 4 min missing in the first, the last 4 only
    first, second = records[0]["wind_speed"], records[1]["wind_speed"]
    assert len(first.values) == N - 480 and len(second.values) == N
    assert records[0].completeness("wind_speed") == pytest.approx(0.6) and records[1].completeness("wind_speed") == 1.0
    assert second.values[0] == N - 480


def test_a_short_file_is_a_record_with_all_its_samples() -> None:
    """Also with the sample at its end, as loggers write it."""
    (record,) = long_file(N + 1, begin=BEGIN + 17.0)
    assert len(record["wind_speed"].values) == N + 1 and np.mean(record["wind_speed"].values) == 0.5 * N
    assert record.length == 600.0
    assert not long_file(N // 3)
    (short,) = long_file(N // 2, begin=BEGIN + 17.0)  # is simulated as long as it is; of ten minutes it is the half
    assert short.length == 300.0 and short.completeness("wind_speed") == 0.5
    assert not [i for i in doubtful([short], channel_map({"column": "t", "form": "posix"})) if i.kind == "gap"]


def test_short_files_that_follow_each_other_are_joined(tmp_path: Path) -> None:
    """Minutes 0 to 14 but the ninth: one record whole, the next one in part; none across the gap."""
    for minute in (*range(8), *range(9, 15)):
        rows = [f"{BEGIN + 60.0 * minute + k / RATE!r},1,2" for k in range(120)]
        (tmp_path / f"{minute:02d}.csv").write_text("\n".join(["t,P,u", *rows]))
    given = channel_map({"column": "t", "form": "posix"})
    records = read_measurements(tmp_path, given)
    assert [(r.file, len(r["wind_speed"].values)) for r in records] == [("00.csv", 1080), ("10.csv", 600)]
    gap, rest = [issue for issue in doubtful(records, given) if issue.kind == "gap"]
    assert (gap.file, gap.samples) == ("00.csv", 120) and "missing after 2024-05-01 12:07:59.5" in gap.text
    assert (rest.file, rest.samples) == ("10.csv", 600)  # the file ends after five minutes
    (tmp_path / "08.csv").write_text("\n".join(["t,P,u", *(f"{BEGIN + 480.0 + k / RATE!r},1,2" for k in range(120))]))
    given = channel_map({"column": "t", "form": "posix"})
    records = read_measurements(tmp_path, given)
    assert [(r.file, len(r["wind_speed"].values)) for r in records] == [("00.csv", 1200), ("10.csv", 600)]


def test_rates_of_loggers_differ() -> None:
    channels = channel_map({"column": "t", "form": "posix"}).content()
    channels["loggers"]["mast"] = {
        "time": {"column": "t", "form": "posix"},
        "missing": [-999.0],
        "channels": {"shear": {"column": "a", "unit": "-"}},
    }
    fast = {"t": BEGIN + np.arange(12000) / 20.0, "a": np.where(np.arange(12000) == 5, -999.0, 0.2)}
    tables = {"scada": {"t": TIME, "P": POWER, "u": WIND}, "mast": fast}
    (record,) = measurements_of(tables, ChannelMap(**channels))
    assert record["shear"].rate == pytest.approx(20.0) and record["wind_speed"].rate == pytest.approx(2.0)
    assert len(record["shear"].values) == 12000 and len(record["shear"].finite) == 11999
    with pytest.raises(KeyError, match="did you mean 'wind_speed'"):
        record["wind_sped"]


def test_a_map_is_written_and_read(tmp_path: Path) -> None:
    first = channel_map({"column": "t"})
    write_record(first, tmp_path / "map.yaml")
    assert read_channel_map(tmp_path / "map.yaml") == first
    sensors = {name: sensor for name, _, sensor in first.sensors()}
    assert list(sensors) == ["generator_power", "wind_speed"] and sensors["wind_speed"].upwind == 67.5


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"unit": "kWatt"}, "unknown unit 'kWatt': did you mean 'kW'"),
        ({"unit": "rpm"}, "unit rpm of column 'P', but generator_power is in kW"),
        ({"axes": "coned blade axes"}, "column 'P' is in coned blade axes, but generator_power is in -"),
        ({"gain": -1.0}, "gain"),
        ({"sign": 2}, "sign"),
    ],
)
def test_wrong_entries_of_a_map(change: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=words):
        channel_map({"column": "t"}, **change)


def test_wrong_names_and_stamps() -> None:
    sensor = Sensor(column="P", unit="kW", kind="power")
    with pytest.raises(InputError, match="no channel 'GenPwrr' for a power: did you mean 'GenPwr'"):
        ChannelMap(loggers={"a": {"time": {"column": "t"}, "channels": {"GenPwrr": sensor}}})
    for stamps, words in (
        ({"column": "t", "form": "seconds"}, "go together"),
        ({"column": "t", "zone": "Europe/Berlon"}, "no time zone"),
        ({"column": "t", "zone": "+1"}, r"such as \+01:00"),
        ({"column": "t", "name": "%Y.csv"}, "go together"),
    ):
        with pytest.raises(InputError, match=words):
            TimeStamps(**stamps)
    with pytest.raises(InputError, match="has generator_power twice"):
        Logger(time={"column": "t"}, channels={"GenPwr": sensor, "generator_power": sensor})
    with pytest.raises(InputError, match="wind: no channel 'wind' in the map"):
        ChannelMap(**channel_map({"column": "t"}).content() | {"wind": "wind"})


def test_wrong_files(tmp_path: Path) -> None:
    given = channel_map({"column": "t"})
    with pytest.raises(InputError, match="no file '\\*' of logger 'scada'; it has no files"):
        read_measurements(tmp_path, given)
    with pytest.raises(InputError, match="no such file or folder"):
        read_measurements(tmp_path / "x", given)
    file = tmp_path / "a.csv"
    for text, words in (
        ("", "is empty"),
        ("t,P,u\n", "no row of numbers"),
        ("t,P,v\n2024-05-01T00:00,1,2\n", "a.csv: no column 'u' for wind_speed"),
        ("t,P,u\n2024-05-01T00:00,1\n", "expected 3 cells"),
        ("t,P,u\n2024-05-01T00:00,1,1\n2024-05-01T00:01,x,1\n", "'P' of generator_power: expected numbers, found 'x'"),
        ("t,P,u\n2024-05-41T00:00,1,1\n", "column 't'.*2024-05-41|day is out of range"),
        ("t,P,u\n1,1,1\n2,1,1\n", "expected dates such as .*form: posix"),
        ("t,P,u\n2024-05-01T00:00,1,1\n", "sampling rate cannot be seen"),
    ):
        file.write_text(text)
        with pytest.raises(InputError, match=words):
            read_measurements(tmp_path, given)
    for name in ("a.mat", "a.parquet", "a.nc"):
        (tmp_path / name).write_bytes(b"MATLAB 5.0 nothing" if name == "a.mat" else b"PAR1 nothing")
        with warnings.catch_warnings(action="ignore"), pytest.raises(InputError, match=f"{name}: not a"):
            read_measurements(tmp_path / name, given)
    (tmp_path / "a.xls").write_text("x")
    with pytest.raises(InputError, match=r"'.xls' is not the suffix"):
        read_measurements(tmp_path / "a.xls", given)


def test_files_of_another_rate(tmp_path: Path) -> None:
    for name, rate in (("a.csv", 2.0), ("b.csv", 50.0)):
        rows = [f"{BEGIN + k / rate!r},1,2" for k in range(1200 if name == "a.csv" else 600)]
        (tmp_path / name).write_text("\n".join(["t,P,u", *rows]))
    with pytest.raises(InputError, match="b.csv: its time stamps have 50 Hz, other files 2 Hz"):
        read_measurements(tmp_path, channel_map({"column": "t", "form": "posix"}))


def test_columns_of_other_lengths_and_texts() -> None:
    given = channel_map({"column": "t", "form": "posix"})
    with pytest.raises(InputError, match="column 'u' has 600 samples for 1200 times"):
        measurements_of({"scada": {"t": TIME, "P": POWER, "u": WIND[::2]}}, given)
    with pytest.raises(InputError, match="column 'P' has 1200 samples for 600 times"):
        measurements_of({"scada": {"t": TIME[::2], "P": POWER, "u": WIND}}, given)
    with pytest.raises(InputError, match="column 'P' of generator_power: expected numbers"):
        measurements_of({"scada": {"t": TIME, "P": np.array(["x"] * N), "u": WIND}}, given)
