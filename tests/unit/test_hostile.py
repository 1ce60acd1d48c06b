"""Files and arguments that ask for too much, or are not what they say: each ends with one sentence."""

from __future__ import annotations

import json
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any
from zipfile import ZIP_DEFLATED, ZipFile

import numpy as np
import pandas as pd
import pytest
from synthetic_base import small_plan, synthetic_base

import meltemi
from meltemi import loads
from meltemi.core.errors import InputError
from meltemi.core.hdf5 import SEAL
from meltemi.loads.durations import actuator_duty, count_stops, load_duration
from meltemi.loads.extrapolation import fit_extremes
from meltemi.loads.loadbase.design import design_tables
from meltemi.loads.loadbase.engine import base_status, base_table
from meltemi.loads.loadbase.excel import read_changes, write_excel
from meltemi.loads.loadbase.settings import DesignSettings
from meltemi.loads.loadbase.store import read_file, write_file
from meltemi.loads.loadbase.table import load_table
from meltemi.postprocess.extremes import characteristic_value, extreme_loads

SINE = np.sin(np.arange(200.0))


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: loads.damage_equivalent_load([], duration=10.0, slope=4.0), "a row of at least 2 numbers"),
        (lambda: loads.damage_equivalent_load(np.ones((3, 3)), duration=10.0, slope=4.0), r"shape \(3, 3\)"),
        (lambda: loads.damage_equivalent_load(["a", "b"], duration=10.0, slope=4.0), r"found \['a', 'b'\]"),
        (lambda: loads.damage_equivalent_load(1j * SINE, duration=10.0, slope=4.0), "expected numbers in a regular"),
        (lambda: loads.damage_equivalent_load(SINE, duration="10", slope=4.0), "duration must be positive, found '10'"),
        (lambda: loads.damage_equivalent_load(SINE, duration=10.0, slope=[4.0]), r"slope must be positive, found \[4"),
        (lambda: loads.damage_equivalent_load(SINE, duration=9.0, slope=4.0, bins=2.5), "bins must be a whole number"),
        (lambda: loads.rainflow_cycles([[1.0], [2.0, 3.0]]), "a regular list"),
        (lambda: loads.cycle_load(loads.rainflow_cycles(SINE), slope=None, reference=1.0), "slope must be positive"),
        (lambda: loads.del_weights(np.ones((2, 2)), duration=1.0, slope=4.0), "a row of at least 2"),
        (lambda: loads.std_weights("text"), "found 'text'"),
        (lambda: fit_extremes("many"), "found 'many'"),
        (lambda: characteristic_value(3.0, rule="mean"), "a row of at least 1"),
        (lambda: extreme_loads([["a"] * 6], "xy"), "expected numbers"),
        (lambda: extreme_loads(np.ones((9, 6)), ["xy"]), r"no plane \['xy'\]"),
        (lambda: count_stops([1.0], on=[1.0], off=0.5), r"on must be a number, found \[1"),
        (lambda: actuator_duty(SINE, dt=0.1, threshold="0"), "threshold must be a number, found '0'"),
        (lambda: count_stops([[1.0]], on=1.0, off=0.5), "a row of at least 0"),
        (lambda: actuator_duty(SINE, dt="0.1"), "dt must be positive, found '0.1'"),
        (lambda: load_duration(SINE, SINE, dt=None, load_edges=[-2, 2]), "dt must be positive, found None"),
        (lambda: loads.power_spectrum(SINE, dt=0.1, segments=2.5), "segments must be a whole number"),
        (lambda: loads.power_spectrum("text", dt=0.1), "found 'text'"),
        (lambda: loads.mean_interval([None, {}]), "expected numbers"),
        (lambda: loads.rayleigh_weights([4.0, 8.0], "8"), "mean_speed must be positive, found '8'"),
        (lambda: loads.harmonic_bands("0.2", [1.0], 0.1), "rotor_frequency must be positive"),
    ],
)
def test_arguments_of_statistics(call: Callable[[], Any], words: str) -> None:
    with pytest.raises(InputError, match=words):
        call()


def test_whole_numbers_as_floats_are_taken() -> None:
    assert loads.damage_equivalent_load(SINE, duration=10.0, slope=np.float32(4.0), bins=np.int64(64)) > 0.0


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"without": 2.5}, r"without: expected a list of rows, found 2.5; write \[2.5\]"),
        ([1], r"expected keys and values, found \[1\]"),
        ({"faults": {"a": {"title": "b", "events": [{"type": "brake", "after": [1]}]}}}, "after: expected a number"),
        ({"faults": {"a": {"title": "b", "events": [{"type": "grid_loss", "lasts": "x"}]}}}, "lasts: expected a numb"),
        ({"faults": {"a": {"title": "b", "events": [{"type": "pitch_runaway", "rate": []}]}}}, "rate"),
    ],
)
def test_changes_of_a_table(changes: Any, words: str) -> None:
    with pytest.raises(InputError, match=words):
        load_table(4, changes)


def test_an_empty_class_and_texts_as_speeds() -> None:
    with pytest.raises(InputError, match="wind class: expected I, II, III .* found ''"):
        loads.make_campaign("nrel5mw", "", rated_wind=11.4)
    with pytest.raises(InputError, match="cut_in"):
        loads.make_campaign("nrel5mw", "IB", cut_in="3 m/s")


def test_an_excel_file_that_unpacks_to_gigabytes_is_refused(tmp_path: Path) -> None:
    path = write_excel(load_table(4), tmp_path / "table.xlsx")
    bomb = tmp_path / "bomb.xlsx"
    with ZipFile(path) as old, ZipFile(bomb, "w", ZIP_DEFLATED) as new:
        for part in old.infolist():
            new.writestr(part.filename, old.read(part))
        new.writestr("xl/sharedStrings2.xml", b" " * 60_000_000)
    assert bomb.stat().st_size < 200_000
    with pytest.raises(InputError, match="unpacked it has 60 MB, at most 50 MB are read"):
        read_changes(bomb)
    assert read_changes(path) == {}


def test_a_result_that_asks_for_gigabytes_is_refused(tmp_path: Path) -> None:
    import h5py

    path = tmp_path / "forged.nc"
    with h5py.File(path, "w") as file:
        file.create_dataset("time", shape=(2_000_000_000,), chunks=(1000,), compression="gzip", dtype="f8")
        file.attrs["channels"] = "[]"
    content = path.read_bytes()
    path.write_bytes(content + SEAL + b"%08x\n" % zlib.crc32(content))
    with pytest.raises(InputError, match="MB stand for 16 GB, more than compression can give"):
        meltemi.read_result(path)


def test_a_load_base_with_another_table_is_told(tmp_path: Path) -> None:
    planned = synthetic_base(tmp_path, small_plan(("6.4",)))
    (path,) = (tmp_path / "results").glob("*.parquet")
    whole = read_file(path)
    path.unlink()
    write_file(whole.drop_columns(["status"]), tmp_path / "results")
    status = base_status(planned, tmp_path)
    assert status.done == 0 and len(status.unreadable) == 1
    (path,) = (tmp_path / "results").glob("*.parquet")
    path.unlink()
    write_file(whole.drop_columns(["statistics", "message", "extremes"]), tmp_path / "results")
    for what in ("cases", "statistics", "extremes"):
        with pytest.raises(InputError, match=r"parquet: cannot be read .*remove it and run its cases again"):
            base_table(planned, tmp_path, what)
    (path,) = (tmp_path / "results").glob("*.parquet")
    path.unlink()
    at = whole.column_names.index("warnings")
    write_file(whole.set_column(at, "warnings", [[1.0] * len(whole)]), tmp_path / "results")
    with pytest.raises(InputError, match=r"parquet: cannot be read .*remove it and run its cases again"):
        base_table(planned, tmp_path, "cases")


@pytest.mark.slow
def test_any_division_of_a_base_gives_the_same_design_loads(tmp_path: Path) -> None:
    planned = synthetic_base(tmp_path / "whole", small_plan(("1.1", "1.2", "4.1", "6.4")))
    (path,) = (tmp_path / "whole" / "results").glob("*.parquet")
    whole = read_file(path)
    for k in range(3):
        write_file(whole.take(np.arange(k, len(whole), 3)), tmp_path / "parts" / "results")
    found = [
        design_tables(loads.design_loads(planned, tmp_path / name, DesignSettings(resamples=2, undeflected=12.0)))
        for name in ("whole", "parts")
    ]
    assert found[0].keys() == found[1].keys()
    for name, table in found[0].items():
        pd.testing.assert_frame_equal(table, found[1][name], check_exact=True, obj=name)


def test_a_nested_cell_is_a_text(tmp_path: Path) -> None:
    from meltemi.loads.loadbase.excel import _parsed

    deep = "[" * 100_000
    assert _parsed(deep, "events") == deep
    with pytest.raises(RecursionError):
        json.loads(deep)
