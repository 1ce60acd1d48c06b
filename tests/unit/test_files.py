"""Files as strangers leave them: endless, huge, damaged; and writing them whole or not at all."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

import meltemi
from meltemi import InputError, Result
from meltemi.core import files, hdf5
from meltemi.core.yamlfile import read_mapping
from meltemi.simulation.channels import standard

RESULT = Result(np.arange(200.0), np.random.default_rng(3).normal(size=(200, 1)), (standard()["wind_x"],))
READERS: tuple[Callable[[Path], Any], ...] = (
    read_mapping,
    meltemi.load_turbine,
    meltemi.io.read_case,
    meltemi.read_wind,
    meltemi.io.read_hub_csv,
    meltemi.read_result,
    meltemi.io.read_deck,
)
NAMES = ("a.yaml", "a.yaml", "a.yaml", "a.wnd", "a.csv", "a.out", "a.fst")


@pytest.mark.skipif(os.name != "posix", reason="there are no such devices")
@pytest.mark.parametrize(("read", "name"), [*zip(READERS, NAMES, strict=True)])
def test_what_has_no_end_is_not_read(tmp_path: Path, read: Callable[[Path], Any], name: str) -> None:
    path = tmp_path / name
    os.mkfifo(path)
    with pytest.raises(InputError, match=f"{name}: cannot be read .it is a device or a pipe, expected a file"):
        read(path)
    path.unlink()
    path.symlink_to("/dev/zero")
    with pytest.raises(InputError, match="a device or a pipe"):
        read(path)


@pytest.mark.parametrize(("read", "name"), [*zip(READERS[:5], NAMES, strict=False)])
def test_what_is_huge_is_refused_before_it_is_read(tmp_path: Path, read: Callable[[Path], Any], name: str) -> None:
    with (tmp_path / name).open("wb") as file:
        file.truncate(10**12)
    with pytest.raises(InputError, match="1000000 MB, expected at most"):
        read(tmp_path / name)


@pytest.mark.parametrize("name", ["a\x07b", "a\nb", "a\x1b[31mb", os.fsdecode(b"a\xff")])
def test_names_with_control_characters_are_not_written(tmp_path: Path, name: str) -> None:
    with pytest.raises(InputError, match="control characters"):
        files.write_text(tmp_path / name, "text")
    assert not list(tmp_path.iterdir())


def test_what_is_no_file_is_not_replaced(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(InputError, match="it is not a file"):
        files.write_text(tmp_path / "pipe", "text")
    assert (tmp_path / "pipe").is_fifo()


def test_a_file_that_cannot_be_finished_leaves_the_one_before(tmp_path: Path) -> None:
    path = files.write_text(tmp_path / "a.txt", "before")

    def half() -> None:
        with files.replacing(path) as (partial,):
            partial.write_text("half")
            raise OSError(28, "No space left on device")

    with pytest.raises(InputError, match="No space left"):
        half()
    assert path.read_text() == "before"
    assert list(tmp_path.iterdir()) == [path]


def test_aliases_do_not_fill_the_memory(tmp_path: Path) -> None:
    lines = ["k0: &a0 [x, x, x, x, x, x, x, x, x]"]
    lines += [f"k{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 9)}]" for i in range(1, 12)]
    for text in ("\n".join([*lines, "duration: *a11"]), "duration: &a [*a]"):
        (tmp_path / "a.yaml").write_text(text)
        with pytest.raises(InputError, match="a.yaml: not valid YAML: its aliases expand to more than 3000000 values"):
            meltemi.io.read_case(tmp_path / "a.yaml")
    (tmp_path / "a.yaml").write_text("k: &a [1.0, 2.0]\nl: *a")
    assert read_mapping(tmp_path / "a.yaml") == {"k": [1.0, 2.0], "l": [1.0, 2.0]}


# HDF5


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    return meltemi.write_result(RESULT, tmp_path_factory.mktemp("whole") / "a.nc").read_bytes()


def test_a_wrong_bit_anywhere_is_found(tmp_path: Path, whole: bytes) -> None:
    path = tmp_path / "a.nc"
    for place in np.linspace(8, len(whole) - 1, 300).astype(int):
        damaged = bytearray(whole)
        damaged[place] ^= 4
        path.write_bytes(damaged)
        if place < len(whole) - hdf5.LENGTH:
            with pytest.raises(InputError, match=r"damaged .its checksum does not match"):
                meltemi.read_result(path)


@pytest.mark.parametrize("seed", range(12))
def test_damage_without_a_checksum_is_refused_in_words_or_harmless(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, whole: bytes, seed: int
) -> None:
    monkeypatch.setattr(hdf5, "PATIENCE", 5.0)  # with one of these HDF5 does not return
    random = np.random.default_rng(seed)
    damaged = bytearray(whole[: -hdf5.LENGTH])
    for place in random.integers(8, 6000, 6):
        damaged[place] = random.integers(256)
    (tmp_path / "a.nc").write_bytes(damaged)
    try:
        assert isinstance(meltemi.read_result(tmp_path / "a.nc"), Result)
    except InputError as error:
        assert "not a result of meltemi" in str(error)


NO_ROOM = """
import resource, sys, numpy as np, meltemi
from meltemi.simulation.channels import standard
resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, 100_000))
channels = tuple(standard()[name] for name in ("wind_x", "azimuth", "rotor_speed"))
try:
    meltemi.write_result(meltemi.Result(np.arange(2e4), np.zeros((20_000, 3)), channels), sys.argv[1])
except meltemi.InputError as error:
    print(error)
"""
"""A disk that is full after some of the file."""


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="there are no limits of a process")
@pytest.mark.parametrize("name", ["a.nc", "a.outb", "a.out"])
def test_a_full_disk_is_said_and_leaves_nothing(tmp_path: Path, name: str) -> None:
    done = subprocess.run(
        [sys.executable, "-c", NO_ROOM, tmp_path / name], capture_output=True, text=True, check=False, timeout=120
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert f"{name}: cannot be written (File too large)" in done.stdout
    assert not list(tmp_path.iterdir())


def test_a_file_changed_by_another_program_is_read(tmp_path: Path) -> None:
    path = meltemi.write_result(RESULT, tmp_path / "a.nc")
    with h5py.File(path, "a") as file:
        file.attrs["message"] = "with a longer text than before"
    found = meltemi.read_result(path)
    assert found.message == "with a longer text than before"
    np.testing.assert_array_equal(found.data, RESULT.data)


def test_reading_ends(tmp_path: Path, whole: bytes, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "a.nc").write_bytes(whole[: -hdf5.LENGTH])
    (tmp_path / "probe.py").write_text("while True: pass")
    monkeypatch.setattr(hdf5, "PROBE", tmp_path / "probe.py")
    monkeypatch.setattr(hdf5, "PATIENCE", 0.5)
    with pytest.raises(InputError, match=r"not a result of meltemi, or damaged .HDF5 reads on after"):
        meltemi.read_result(tmp_path / "a.nc")
