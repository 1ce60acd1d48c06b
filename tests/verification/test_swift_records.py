"""Measured records of a V27 at the SWiFT site (NREL/wakebench_swift, IEA Wind Task 31): statistics, missing samples."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from ruamel.yaml import YAML

import meltemi
from comparisons.swift import map_of_the_guide, write_folder
from meltemi.validation.channel_map import ChannelMap
from meltemi.validation.issues import DataIssue
from meltemi.validation.measurements import MeasuredRecord, measurements_of, read_measurements
from meltemi.validation.plausibility import plausible
from meltemi.validation.quality import doubtful, spikes
from meltemi.validation.selection import select

pytestmark = pytest.mark.reference

COLUMNS = {
    "generator_power": ("generator_power", 1e3),
    "generator_torque": ("generator_torque", 1.0),
    "rotor_speed": ("rotor_speed", np.pi / 30.0),
    "blade_root_flap_moment": ("root_moment_flap_1", 1.0),
    **{f"{c}_32m": (f"{c}_32m", 1.0) for c in "uvw"},
}
"""Channel and factor to SI by column."""
CHANNELS = ChannelMap(**YAML(typ="safe").load(map_of_the_guide()))


@pytest.fixture(scope="module")
def folder(reference: Path) -> Path:
    if not (reference / "swift_v27").is_dir():
        pytest.skip(f"needs the records of the SWiFT site in {reference / 'swift_v27'}")
    return reference / "swift_v27"


def measured(path: Path) -> tuple[MeasuredRecord, list[DataIssue]]:
    with np.load(path) as file:
        posix = CHANNELS.replace(**{"loggers.swift.time.form": "posix"})
        (record,) = measurements_of({"swift": dict(file)}, posix)
    return record, doubtful([record], posix)


def test_a_folder_of_csv_files_has_the_same_records(folder: Path, tmp_path: Path) -> None:
    paths = write_folder(folder / "records", tmp_path)
    records = read_measurements(tmp_path, CHANNELS)
    assert [record.file for record in records] == [path.name for path in paths]
    assert {issue.kind for issue in doubtful(records, CHANNELS)} <= {"missing"}
    for record in records:
        same, _ = measured((folder / "records" / record.file).with_suffix(".npz"))
        assert record["u_32m"].time - record.begin == pytest.approx(same["u_32m"].time, abs=1e-3)
        for name, signal in same.signals.items():
            assert record[name].values == pytest.approx(signal.values, rel=1e-7, nan_ok=True)


def test_statistics_and_missing_samples(folder: Path) -> None:
    statistics = {row["record"]: row for row in json.loads((folder / "stats.json").read_text())}
    paths = sorted((folder / "records").glob("*.npz"))
    assert len(paths) >= 11
    for path in paths:
        record, issues = measured(path)
        for column, (channel, factor) in COLUMNS.items():
            key = next(k for k in statistics[path.stem]["channels"] if k.startswith(f"{column}_["))
            theirs, signal = statistics[path.stem]["channels"][key], record[channel]
            assert len(signal.values) == statistics[path.stem]["samples"]
            assert len(signal.values) - len(signal.finite) == theirs["missing"]
            reported = sum(i.samples for i in issues if i.kind == "missing" and i.channel.startswith(channel))
            assert reported == theirs["missing"]
            if theirs["mean"] is not None:
                assert np.mean(signal.finite) == pytest.approx(factor * theirs["mean"], rel=2e-6, abs=1e-6)
                assert np.std(signal.finite) == pytest.approx(factor * theirs["std"], rel=2e-6)


def test_records_without_spikes_are_clean(folder: Path) -> None:
    for path in sorted((folder / "records").glob("*.npz")):
        if path.stem != "stable_02":
            assert {issue.kind for issue in measured(path)[1]} <= {"missing"}, path.stem


def test_spike_of_the_flap_moment(folder: Path) -> None:
    """The one of the record stable_02, where it is there; one of its size in each other record with a flap moment."""
    given = folder / "records" / "stable_02.npz"
    if given.is_file():
        issues = [i for i in measured(given)[1] if i.kind == "spike" and i.channel.startswith("root_moment_flap_1")]
        assert issues and "-155" in issues[0].text
    count = 0
    for path in sorted((folder / "records").glob("*.npz")):
        flap = measured(path)[0]["root_moment_flap_1"]
        x = flap.values.copy()
        if path.stem == "stable_02" or not np.isfinite(x).any():
            continue
        x[2345] = -155e3
        assert np.flatnonzero(spikes(x, flap.rate)).tolist() == [2345]
        count += 1
    assert count >= 7


def test_records_are_of_this_turbine_in_production(folder: Path) -> None:
    """No issue with the turbine of the deck; power that is taken for W, or a reversed flap moment, is one."""
    turbine = meltemi.io.read_openfast(folder / "deck/OpenFAST_model/SNLV27_OF2.fst")
    for path in sorted((folder / "records").glob("*.npz")):
        record, issues = measured(path)
        assert not plausible([record], CHANNELS, turbine), path.stem
        (one,) = select([record], turbine, wind="u_32m", issues=issues)
        assert one.operation == "production"
    wrong = {"generator_power": 1e-3, "rotor_speed": np.pi / 30.0, "root_moment_flap_1": -1.0}
    record, _ = measured(folder / "records" / "neutral_02.npz")
    for name, factor in wrong.items():
        signal = record[name]
        changed = {**record.signals, name: replace(signal, values=factor * signal.values)}
        issues = plausible([replace(record, signals=changed)], CHANNELS, turbine)
        assert [issue.kind for issue in issues if issue.channel == name] == ["unit" if factor > 0.0 else "sign"]
