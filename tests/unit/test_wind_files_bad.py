"""Damaged, foreign and absurd wind files end in one sentence, never in a traceback."""

from __future__ import annotations

import os
import re
import warnings
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import meltemi
from meltemi.core.errors import InputError
from meltemi.core.hdf5 import LENGTH
from meltemi.wind.fields import WindBox, WindSeries
from meltemi.wind_files.formats import FORMATS

steady = settings(derandomize=True, deadline=None, max_examples=150)
NAMES = ["a.bts", "a.wnd", "a-u.bin", "a.nc", "gust.wnd", "a.csv"]
READERS: dict[str, Callable[[Path], Any]] = dict.fromkeys(NAMES, meltemi.read_wind)
READERS["a.csv"] = meltemi.io.read_hub_csv
BOX = WindBox(
    velocity=np.random.default_rng(1).normal(8.0, 1.0, (5, 3, 4, 3)).astype(np.float32),
    dt=0.5, dy=10.0, dz=12.0, bottom=30.0, speed=8.0, hub_height=42.0,
)  # fmt: skip
SERIES = WindSeries(time=[0.0, 1.0, 2.0], speed=[8.0, 9.0, 8.0], direction=0.1)


@pytest.fixture(scope="module")
def good(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with one file of each format."""
    folder = tmp_path_factory.mktemp("good")
    for name in NAMES:
        meltemi.io.write_wind(SERIES if name == "gust.wnd" else BOX, folder / name)
    return folder


def outcome(path: Path) -> str:
    """What a reader says of a file; no other exception and no warning gets through."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            READERS[path.name](path)
        except InputError as error:
            assert path.stem.removesuffix("-u") in str(error)
            return str(error)
    return "read"


@pytest.mark.parametrize("name", NAMES)
def test_a_good_file_is_read(good: Path, name: str) -> None:
    assert outcome(good / name) == "read"


@pytest.mark.parametrize("name", NAMES)
def test_a_missing_file_a_folder_and_an_empty_file(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    assert re.search(r"cannot be read \(No such file|there is no a\.hawc2\.yaml", outcome(path))
    path.mkdir()
    assert outcome(path) != "read"
    path.rmdir()
    path.touch()
    assert outcome(path) != "read"


@pytest.mark.skipif(os.name != "posix" or os.geteuid() == 0, reason="the administrator may read everything")
@pytest.mark.parametrize("name", NAMES)
def test_a_file_without_permission(tmp_path: Path, good: Path, name: str) -> None:
    (tmp_path / name).write_bytes((good / name).read_bytes())
    (tmp_path / name).chmod(0)
    assert "ermission" in outcome(tmp_path / name)


def copy(good: Path, folder: Path, name: str) -> Path:
    """A file and what belongs to it."""
    folder.mkdir(exist_ok=True)
    for other in good.iterdir():
        (folder / other.name).write_bytes(other.read_bytes())
    return folder / name


BINARY = ["a.bts", "a.wnd", "a-u.bin"]


@pytest.mark.slow
@pytest.mark.parametrize("name", BINARY)
def test_every_shorter_file_is_refused(tmp_path: Path, good: Path, name: str) -> None:
    path = copy(good, tmp_path, name)
    whole = path.read_bytes()
    for size in range(len(whole)):
        path.write_bytes(whole[:size])
        # an odd last plane of a Bladed file is not counted in its header: without it there is one plane less
        without = name == "a.wnd" and size >= len(whole) - 2 * 3 * 4 * 3
        assert (outcome(path) == "read") == without, size


@pytest.mark.slow
def test_shorter_netcdf_files_are_refused(tmp_path: Path, good: Path) -> None:
    path = copy(good, tmp_path, "a.nc")
    whole = path.read_bytes()
    content = len(whole) - LENGTH
    for size in [0, 5, 50, *range(600, content, 4999), content - 1]:
        path.write_bytes(whole[:size])
        assert "not a wind box of meltemi" in outcome(path)
    for size in (content, content + 10):  # cut in the checksum: all data are there
        path.write_bytes(whole[:size])
        np.testing.assert_array_equal(meltemi.read_wind(path).velocity, BOX.velocity)  # type: ignore[union-attr]


@pytest.mark.parametrize("name", ["gust.wnd", "a.csv"])
def test_shorter_texts_are_read_or_refused(tmp_path: Path, good: Path, name: str) -> None:
    path = copy(good, tmp_path, name)
    whole = path.read_bytes()
    for size in range(len(whole)):
        path.write_bytes(whole[:size])
        outcome(path)


@pytest.mark.slow
@pytest.mark.parametrize("name", [*BINARY, "gust.wnd", "a.csv"])
@given(changes=st.lists(st.tuples(st.integers(0, 10**6), st.integers(0, 255)), min_size=1, max_size=4))
@steady
def test_changed_bytes_are_read_or_refused(
    tmp_path_factory: pytest.TempPathFactory, good: Path, name: str, changes: list[tuple[int, int]]
) -> None:
    path = copy(good, tmp_path_factory.getbasetemp() / "changed", name)
    data = bytearray(path.read_bytes())
    for place, value in changes:
        data[place % min(len(data), 110)] = value  # the headers
    path.write_bytes(data)
    outcome(path)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["a.sum", "a.hawc2.yaml"])
@given(changes=st.lists(st.tuples(st.integers(0, 10**6), st.binary(max_size=6)), min_size=1, max_size=3))
@steady
def test_changed_descriptions_are_read_or_refused(
    tmp_path_factory: pytest.TempPathFactory, good: Path, name: str, changes: list[tuple[int, bytes]]
) -> None:
    note = copy(good, tmp_path_factory.getbasetemp() / "noted", name)
    data = note.read_bytes()
    for place, value in changes:
        place %= len(data)
        data = data[:place] + value + data[place + 1 :]
    note.write_bytes(data)
    outcome(note.with_name("a.wnd" if name == "a.sum" else "a-u.bin"))


@pytest.mark.parametrize("place", range(0, 2000, 45))
def test_changed_netcdf_files_are_read_or_refused(tmp_path: Path, good: Path, place: int) -> None:
    path = copy(good, tmp_path, "a.nc")
    data = bytearray(path.read_bytes())
    data[place] ^= 0xFF
    path.write_bytes(data)
    outcome(path)


@pytest.mark.slow
@given(content=st.binary(max_size=300))
@steady
def test_foreign_content_is_refused(tmp_path_factory: pytest.TempPathFactory, content: bytes) -> None:
    for name in NAMES:
        folder = tmp_path_factory.getbasetemp() / "foreign"
        folder.mkdir(exist_ok=True)
        (folder / name).write_bytes(content)
        assert outcome(folder / name) != "read"


def test_netcdf_files_of_others_are_refused(tmp_path: Path) -> None:
    import xarray as xr

    path = tmp_path / "a.nc"
    xr.Dataset({"u": ("time", np.zeros(3))}).to_netcdf(path, engine="h5netcdf")
    assert "expected netCDF4 with u, v, w over time, z, y" in outcome(path)
    meltemi.io.write_wind(BOX, path)
    with xr.open_dataset(path) as data:
        data.load()
    del data.attrs["dy"]
    data.to_netcdf(path, engine="h5netcdf")
    assert "not a wind box of meltemi" in outcome(path)


def test_counts_that_would_fill_the_memory_are_refused_before(tmp_path: Path, good: Path) -> None:
    big = (2**31 - 1).to_bytes(4, "little")
    for name, places in {"a.bts": (2, 6, 14), "a.wnd": (44, 72, 76)}.items():
        path = copy(good, tmp_path, name)
        data = bytearray(path.read_bytes())
        for place in places:
            data[place : place + 4] = big
        path.write_bytes(data)
        assert "cut off" in outcome(path)


@pytest.mark.parametrize("name", ["a.bts", "a.wnd", "a.bin", "a.nc", "a.csv"])
def test_nothing_is_left_half_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    before = {p: p.read_bytes() for p in meltemi.io.write_wind(BOX, tmp_path / name)}

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "replace", full)
    with pytest.raises(InputError, match="cannot be written"):
        meltemi.io.write_wind(BOX, tmp_path / name)
    assert {p: p.read_bytes() for p in tmp_path.iterdir()} == before


@pytest.mark.parametrize("name", ["a.bts", "a.wnd", "a.bin", "a.nc", "a.csv"])
def test_places_that_cannot_be_written(tmp_path: Path, name: str) -> None:
    with pytest.raises(InputError, match="cannot be written .the folder .*nowhere does not exist"):
        meltemi.io.write_wind(BOX, tmp_path / "nowhere" / name)
    first = meltemi.io.write_wind(BOX, tmp_path / name)
    for path in first:
        path.unlink()
    first[-1].mkdir()
    with pytest.raises(InputError, match="cannot be written .it is a folder"):
        meltemi.io.write_wind(BOX, tmp_path / name)
    assert list(tmp_path.iterdir()) == [first[-1]]


def test_the_summary_of_another_program_is_not_lost(tmp_path: Path) -> None:
    (tmp_path / "a.sum").write_text("This summary file was generated by TurbSim")
    with pytest.raises(InputError, match=r"a\.wnd: a\.sum in the same folder is of another program"):
        meltemi.io.write_wind(BOX, tmp_path / "a.wnd")
    (tmp_path / "a.sum").unlink()
    for _ in range(2):
        meltemi.io.write_wind(BOX, tmp_path / "a.wnd")


@pytest.mark.parametrize("name", ["a.bts", "a.wnd", "a-u.bin"])
def test_a_field_is_not_copied_in_memory(tmp_path: Path, name: str) -> None:
    import tracemalloc

    box = replace(BOX, velocity=np.ones((10_000, 10, 20, 3), np.float32))
    peaks = []
    for task in (lambda: meltemi.io.write_wind(box, tmp_path / name), lambda: meltemi.read_wind(tmp_path / name)):
        tracemalloc.start()
        task()
        peaks.append(tracemalloc.get_traced_memory()[1] / box.velocity.nbytes)
        tracemalloc.stop()
    assert peaks[0] < 0.6 and peaks[1] < 1.6  # reading makes the field itself


def test_formats_are_told_by_suffix_content_and_name(tmp_path: Path) -> None:
    assert [p.name for p in meltemi.io.write_wind(BOX, tmp_path / "A.WND")] == ["A.WND", "A.sum"]
    assert isinstance(meltemi.read_wind(tmp_path / "A.WND"), WindBox)
    meltemi.io.write_wind(SERIES, tmp_path / "a.wnd")
    assert isinstance(meltemi.read_wind(str(tmp_path / "a.wnd")), WindSeries)
    meltemi.io.write_wind(BOX, tmp_path / "a.dat", format="bts")
    assert isinstance(meltemi.io.read_bts(tmp_path / "a.dat"), WindBox)
    assert {f.name for f in FORMATS} == {"bts", "bladed", "uniform", "hawc2", "netcdf", "hub_csv"}


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (
            lambda p: meltemi.read_wind(p / "a.btz"),
            r"'\.btz' is not the suffix .* did you mean '\.bts'.* supported are \.bts",
        ),
        (lambda p: meltemi.read_wind(p / "a"), r"'a name without suffix' is not the suffix|a name without suffix"),
        (lambda p: meltemi.io.write_wind(BOX, p / "a.x"), r"supported are \.bts, \.wnd, \.bin, \.nc, \.csv"),
        (
            lambda p: meltemi.io.write_wind(BOX, p / "a.bts", format="bst"),
            r"unknown wind file format 'bst'; did you mean 'bts'",
        ),
        (lambda p: meltemi.io.write_wind(SERIES, p / "a.bts"), r"cannot store a WindSeries; one is written as \.wnd"),
        (lambda p: meltemi.io.write_wind(BOX, p / "a.wnd", format="uniform"), "cannot store a WindBox"),
        (lambda p: meltemi.io.write_wind(BOX, p / "a.sum", format="bladed"), r"expected the name of the field, a\.wnd"),
        (
            lambda p: meltemi.io.read_wnd(meltemi.io.write_wind(BOX, p / "a.wnd")[0]),
            r"a\.wnd: a Bladed-style field, not uniform wind: read it with meltemi\.read_wind",
        ),
        (lambda p: meltemi.read_wind(p / "a.csv"), r"read it with meltemi\.io\.read_hub_csv"),
        (
            lambda p: meltemi.read_wind(
                p / "a.bts",
                meltemi.io.Hawc2Grid(planes=2, columns=2, rows=2, dx=1, dy=1, dz=1, speed=1, bottom=1),
            ),
            r"grid= applies to HAWC2",
        ),
    ],
)
def test_what_no_format_takes_is_explained(tmp_path: Path, call: Callable[[Path], Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        call(tmp_path)


@pytest.mark.parametrize(
    "text",
    [
        "time [s],u [m/s],v [m/s],w [m/s]\n0,8,1,2\n1,9,3,4\n",
        "\ufeff# a mast\r\n\r\nTime [s], w [m/s], v [m/s], u [m/s]\r\n0,2,1,8\r\n# later\r\n1,4,3,9\r\n",
        '"time [s]","wind_x [m/s]","wind_y [m/s]","wind_z [m/s]"\n0,8,1,2\n1,9,3,4\n',
    ],
)
def test_hub_files(tmp_path: Path, text: str) -> None:
    (tmp_path / "a.csv").write_bytes(text.encode())
    series = meltemi.io.read_hub_csv(tmp_path / "a.csv")
    expected = {"time": [0, 1], "u": [8, 9], "v": [1, 3], "w": [2, 4]}
    for name, values in expected.items():
        assert getattr(series, name).tolist() == values


def test_hub_files_without_all_components(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("time [s],w [m/s],u [m/s]\n0,2,8\n1,4,9\n")
    series = meltemi.io.read_hub_csv(tmp_path / "a.csv")
    assert series.v is None and series.w is not None and series.w.tolist() == [2.0, 4.0]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("time,u\n0,8\n1,9\n", r"a\.csv:1: column 'time' has no unit in brackets; expected names with units"),
        ("time [s],u (m/s)\n0,8\n1,9\n", r"a\.csv:1: column 'u \(m/s\)' has no unit in brackets"),
        ("0,8\n1,9\n", r"a\.csv:1: column '0' has no unit in brackets"),
        ("time [s];u [m/s]\n0;8\n", r"a\.csv:1: column 'time \[s\];u \[m/s\]' has no unit"),
        (
            "time [s],u [m/s],x [m/s]\n0,8,1\n",
            r"a\.csv: unknown column 'x'; did you mean|a\.csv: unknown column 'x'; valid",
        ),
        ("time [min],u [m/s]\n0,8\n", r"a\.csv:1: the first column must be 'time \[s\]', found 'time \[min\]'"),
        ("u [m/s],time [s]\n8,0\n", r"a\.csv:1: the first column must be 'time \[s\]', found 'u \[m/s\]'"),
        ("time [s],u [km/h]\n0,8\n", r"a\.csv: u is in 'km/h', expected 'm/s'"),
        ("time [s],u [m/s],u [m/s]\n0,8,8\n", r"a\.csv:1: the column 'u' appears twice"),
        ("time [s],u [m/s],wind_x [m/s]\n0,8,8\n", r"a\.csv: the component 'u' appears twice"),
        ("time [s],v [m/s]\n0,8\n", r"a\.csv: no column 'u \[m/s\]'"),
        ("# c\ntime [s],u [m/s]\n0,8\n1,eight\n", r"a\.csv:4: expected 2 numbers, found '1,eight'"),
        ("time [s],u [m/s]\n0,8\n1,9,10\n", r"a\.csv:3: expected 2 numbers, found '1,9,10'"),
        ("time [s],u [m/s]\n", r"a\.csv: expected a row of names with units"),
        ("time [s],u [m/s]\n0,8\n0,9\n", r"a\.csv: time must increase, but entry 2"),
        ("time [s],u [m/s]\n0,8\n1,nan\n", r"a\.csv: u: every entry must be a finite number; not so at entry 2"),
        ("time [s],u [m/s]\n0,8\n1,\n", r"a\.csv: u: every entry must be a finite number; not so at entry 2"),
        ("time [s],u [m/s]\n0,8\n", r"a\.csv: time needs at least 2 entries"),
    ],
)
def test_hub_files_that_cannot_be_read_name_the_line(tmp_path: Path, text: str, message: str) -> None:
    (tmp_path / "a.csv").write_text(text)
    with pytest.raises(InputError, match=message):
        meltemi.io.read_hub_csv(tmp_path / "a.csv")
