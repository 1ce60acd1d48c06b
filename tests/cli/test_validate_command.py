"""``meltemi validate``: report and tables, interruption, and refusals before anything is simulated."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from terminal import Command, refused

from meltemi.cases.case import read_case
from meltemi.core.yamlfile import read_record
from meltemi.simulation.result import Result
from meltemi.tuning.run_store import run_store
from meltemi.validation import simulations
from meltemi.validation.comparison import ComparedRecord, Comparison
from meltemi.validation.fit import sections
from meltemi.validation.measurements import read_measurements
from meltemi.validation.reduction import STATISTICS, ReducedRecord
from meltemi.validation.settings import Validation
from simulated_measurement import (
    FIELD,
    load_case,
    loggers,
    measured,
    statistics_channels,
    write_records,
    write_statistics,
)

Float = NDArray[np.float64]
N = 600
"""Samples of a record, at 1 Hz."""
CASE: dict[str, Any] = {"turbine": "nrel5mw", "wind": {"kind": "steady", "speed": 10.0}, "duration": 10.0}
SONIC = {"unit": "m/s", "kind": "sonic", "height": 90.0, "upwind": 200.0}
WIND = {
    "wind_speed": {"column": "u", "component": "u", **SONIC},
    "mast_v": {"column": "v", "component": "v", **SONIC},
}
MACHINE = {
    "generator_power": {"column": "P", "unit": "kW", "kind": "power"},
    "rotor_speed": {"column": "n", "unit": "rpm", "kind": "rpm"},
    "root_moment_flap_1": {"column": "M", "unit": "kN m", "kind": "gauge"},
}


LAW = """
from meltemi.control.controller import Controller


def make(model):
    def update(state, measurements, demands, dt):
        demands.generator_torque = 3e4

    return Controller(update, name="plain")
"""


def columns(records: int, seed: int = 0) -> dict[str, Float]:
    """Wind that changes within minutes, and what a turbine of 5 MW would make of it."""
    draw, n = np.random.default_rng(seed), records * N
    slow = np.interp(np.arange(n), np.arange(0, n + 120, 120), draw.uniform(-2.0, 2.0, n // 120 + 1))
    u = 8.0 + slow + 0.1 * draw.standard_normal(n)
    return {
        "u": u,
        "v": 0.3 * draw.standard_normal(n),
        "P": 2.7 * u**3 + 3.0 * draw.standard_normal(n),
        "n": 1.1 * u + 0.02 * draw.standard_normal(n),
        "M": 700.0 * u + 50.0 * draw.standard_normal(n),
    }


def prepare(
    folder: Path,
    data: dict[str, Float] | None = None,
    *,
    case: dict[str, Any] | None = None,
    channels: dict[str, Any] | None = None,
    loggers: dict[str, Any] | None = None,
    **settings: Any,
) -> Path:
    """The file of a validation, its case, and a folder ``records`` with a file for each ten minutes."""
    stamps = {"column": "t", "form": "posix"}
    known = {"one": {"time": stamps, "channels": channels or {**WIND, **MACHINE}}}
    content = {"case": "case.yaml", "channels": {"loggers": loggers or known}, "seeds": 2, **settings}
    (folder / "case.yaml").write_text(json.dumps(CASE if case is None else case))
    (folder / "v.yaml").write_text(json.dumps(content, sort_keys=False))
    (folder / "records").mkdir()
    data = columns(2) if data is None else data
    for k in range(len(data["u"]) // N):
        write(folder / "records" / f"r{k:02d}.csv", k, {key: x[k * N : (k + 1) * N] for key, x in data.items()})
    return folder / "v.yaml"


def write(path: Path, number: int, data: dict[str, Float]) -> None:
    time = 1_714_564_800.0 + N * number + np.arange(N)
    rows = np.column_stack([time, *data.values()])
    np.savetxt(
        path, rows, fmt=["%.1f", *["%.6g"] * len(data)], delimiter=",", header=",".join(["t", *data]), comments=""
    )


@pytest.fixture
def validated(command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., None]:
    """The command on ``v.yaml`` is refused for these reasons, in one sentence, before it simulates."""

    def never(*_: Any, **__: Any) -> None:
        raise AssertionError("it simulated")

    monkeypatch.setattr(simulations.Simulator, "run", never)

    def call(*parts: str, options: tuple[Any, ...] = (), file: Path | None = None, data: Path | None = None) -> None:
        out = tmp_path / "out"
        out.mkdir()
        ran = command(
            "validate", file or tmp_path / "v.yaml", "--data", data or tmp_path / "records", "--out", out, *options
        )
        refused(ran, out, *parts)
        assert len(ran.err.strip().splitlines()) == 1, ran.err

    return call


Refused = Callable[..., None]


def test_a_unit_that_does_not_fit(validated: Refused, tmp_path: Path) -> None:
    prepare(tmp_path, columns(2) | {"P": 1e3 * columns(2)["P"]})
    validated(
        "records: no record can be compared", "generator_power: column 'P' in kW reaches", "times 0.001 it would fit"
    )


def test_a_unit_of_another_quantity(validated: Refused, tmp_path: Path) -> None:
    prepare(tmp_path, channels={**WIND, **MACHINE, "generator_power": {"column": "P", "unit": "rpm", "kind": "power"}})
    validated("v.yaml", "generator_power: unit rpm of column 'P'")


def test_a_sign_that_does_not_fit(validated: Refused, tmp_path: Path) -> None:
    prepare(tmp_path, columns(2) | {"P": -columns(2)["P"]})
    validated("no record can be compared", "generator_power: column 'P' is negative", "give sign: -1")


def test_a_column_that_is_not_there(validated: Refused, tmp_path: Path) -> None:
    prepare(tmp_path, channels={**WIND, **MACHINE, "rotor_speed": {"column": "N", "unit": "rpm", "kind": "rpm"}})
    validated("r00.csv: no column 'N' for rotor_speed", "did you mean 'n'")


def test_a_channel_that_selection_needs(validated: Refused, tmp_path: Path) -> None:
    prepare(tmp_path, channels={**WIND, "generator_power": MACHINE["generator_power"]})
    validated("no channel 'rotor_speed'")


def test_no_channel_of_the_simulation(validated: Refused, tmp_path: Path) -> None:
    prepare(tmp_path, channels=WIND)
    validated("none of the measured channels is one of the simulation")


def test_a_channel_to_compare_that_is_not_measured(validated: Refused, tmp_path: Path) -> None:
    prepare(tmp_path, compare=["generator_power", "rotor_sped"])
    validated("compare: 'rotor_sped' is not measured: did you mean 'rotor_speed'")


def test_wind_of_another_turbine(validated: Refused, tmp_path: Path) -> None:
    other = columns(4, seed=7)
    prepare(tmp_path, columns(4) | {"u": other["u"], "v": other["v"]})
    validated("no record can be compared", "probably wind of another turbine")


def test_clocks_half_an_hour_apart(validated: Refused, tmp_path: Path) -> None:
    data, stamps = columns(12), {"column": "t", "form": "posix"}
    machine = {key: np.roll(x, 1800) for key, x in data.items() if key in "PnM"}
    loggers = {
        "mast": {"files": "r*.csv", "time": stamps, "channels": WIND},
        "turbine": {"files": "r*.csv", "time": stamps, "channels": MACHINE},
    }
    prepare(tmp_path, data | machine, loggers=loggers)
    validated("no record can be compared", "30 min", "correct zone, stamp or clock")


def test_files_and_folders_that_are_not_there(validated: Refused, tmp_path: Path) -> None:
    prepare(tmp_path)
    validated("nowhere: no such file or folder", data=tmp_path / "nowhere")


def test_an_empty_folder(validated: Refused, tmp_path: Path) -> None:
    prepare(tmp_path)
    (tmp_path / "empty").mkdir()
    validated("empty: no file '*' of logger 'one'; it has no files", data=tmp_path / "empty")


def test_no_validation(validated: Refused, tmp_path: Path) -> None:
    validated("v.yaml", file=tmp_path / "v.yaml")


def test_a_folder_as_validation(validated: Refused, tmp_path: Path) -> None:
    prepare(tmp_path)
    validated("records", file=tmp_path / "records")


def test_no_case(validated: Refused, tmp_path: Path) -> None:
    prepare(tmp_path)
    (tmp_path / "case.yaml").unlink()
    validated("case.yaml")


def test_a_record_that_is_no_table(validated: Refused, tmp_path: Path) -> None:
    prepare(tmp_path)
    (tmp_path / "records" / "r01.csv").write_bytes(bytes(range(256)))
    validated("r01.csv")


def test_an_unknown_parameter(validated: Refused, tmp_path: Path) -> None:
    prepare(tmp_path)
    validated("no parameter 'drga' to fit: did you mean 'drag'", options=("--fit", "drga"))


def test_a_fit_of_too_few_seeds(validated: Refused, tmp_path: Path) -> None:
    prepare(tmp_path)
    validated("must be at least 8, found 1; give --seeds", options=("--fit", "drag"))


def test_a_fit_of_one_record(validated: Refused, tmp_path: Path) -> None:
    prepare(tmp_path, columns(1))
    validated("fit: at least two records are needed", options=("--fit", "drag"))


def test_a_fit_with_a_controller_without_derivatives(validated: Refused, tmp_path: Path) -> None:
    prepare(tmp_path, case={**CASE, "controller": {"kind": "python", "file": "law.py", "function": "make"}})
    (tmp_path / "law.py").write_text(LAW)
    validated("has no derivatives", options=("--fit", "drag"))


def test_a_fit_of_a_gauge_that_is_not_compared(validated: Refused, tmp_path: Path) -> None:
    prepare(tmp_path, compare=["generator_power"])
    validated("no parameter 'gauge_gain.root_moment_flap_1' to fit", options=("--fit", "gauge_gain.root_moment_flap_1"))


def test_why_with_a_controller_without_derivatives(tmp_path: Path) -> None:
    """The report says so in place of the table."""
    law = {"kind": "python", "file": "law.py", "function": "make"}
    settings = read_record(prepare(tmp_path, columns(1), case={**CASE, "controller": law}), Validation)
    (tmp_path / "law.py").write_text(LAW)
    simulator = simulations.Simulator.of(settings, read_case(tmp_path / "case.yaml"), tmp_path)
    (record,) = read_measurements(tmp_path / "records", settings.channels)
    measured = simulator.prepared(record, ["generator_power"]).measured
    comparison = Comparison((ComparedRecord(record.name, 8.0, 0.1, 1.2, 0.2, measured, ()),), ("generator_power",))
    (section,) = sections(simulator, [record], comparison, (), why=1)
    (text,) = section.content
    assert str(text).startswith("No sensitivities: ") and "no derivatives" in str(text)


def test_a_turbine_without_blades(validated: Refused, tmp_path: Path) -> None:
    prepare(tmp_path, case={**CASE, "turbine": "pmsg20mw"})
    validated("meltemi validate")


def statistics(folder: Path, sensors: dict[str, Any], text: str = "t,v,sv,P\n0,8,0.8,1500\n600,9,0.9,2100\n") -> None:
    """The file of a validation by a table of ten-minute statistics; the power has no extremes."""
    wind = {"statistics": {"mean": "v", "std": "sv"}, "unit": "m/s", "component": "speed", "height": 90.0}
    power = {"statistics": {"mean": "P"}, "unit": "kW", "kind": "power"}
    channels = {"wind_speed": wind, "generator_power": power, **sensors}
    prepare(folder, {"u": np.empty(0)}, channels=channels)
    (folder / "records" / "scada.csv").write_text(text)


def test_statistics_with_a_wrong_column(validated: Refused, tmp_path: Path) -> None:
    statistics(tmp_path, {"rotor_speed": {"statistics": {"mean": "n_avg"}, "unit": "rpm", "kind": "rpm"}})
    validated("scada.csv: no column 'n_avg' for rotor_speed")


def test_statistics_with_swapped_columns(validated: Refused, tmp_path: Path) -> None:
    power = {"statistics": {"mean": "P", "min": "v"}, "unit": "kW", "kind": "power"}
    wind = {"mean": "sv", "std": "v", "min": "v"}
    place = {"unit": "m/s", "component": "speed", "height": 90.0}
    statistics(tmp_path, {"generator_power": power, "wind_speed": {"statistics": wind, **place}})
    validated(
        "no record can be compared", "wind_speed: column 'sv': the mean is not between minimum and maximum; correct"
    )


def test_statistics_without_one_that_is_needed(validated: Refused, tmp_path: Path) -> None:
    wind = {"statistics": {"mean": "v"}, "unit": "m/s", "component": "speed", "height": 90.0}
    statistics(tmp_path, {"wind_speed": wind})
    validated("v.yaml", "wind: wind_speed needs mean and std to define the wind; std is missing")


def test_statistics_in_a_wrong_unit(validated: Refused, tmp_path: Path) -> None:
    statistics(tmp_path, {}, "t,v,sv,P\n0,8,0.8,1500000\n600,9,0.9,2100000\n")
    validated("no record can be compared", "generator_power: column 'P' in kW reaches", "times 0.001 it would fit")


def test_no_wind_upwind(validated: Refused, tmp_path: Path) -> None:
    behind = {"wind_speed": {"column": "u", "unit": "m/s", "component": "speed", "height": 90.0, "upwind": -5.0}}
    prepare(tmp_path, channels={**behind, **MACHINE})
    validated("no wind upwind of the rotor")


@pytest.mark.slow
def test_report_tables_and_interruption(command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shorter = {"selection": {"complete": 0.45}, "transient": 30.0, "turbulence": FIELD}
    file, out = prepare(tmp_path, {"u": np.empty(0)}, loggers=loggers(), **shorter), tmp_path / "out"
    simulator = simulations.Simulator.of(read_record(file, Validation), load_case(), tmp_path)
    records = [measured(simulator, speed, seed, 320.0, {}) for speed, seed in ((8.0, 1), (9.0, 2))]
    write_records(tmp_path / "records", records)
    arguments = ("validate", file, "--data", tmp_path / "records", "--out", out, "--why", 0, "--workers", 1)
    reduced, calls = simulations.Simulator.reduced, 0

    def stopped(*arguments: Any) -> ReducedRecord:
        nonlocal calls
        calls += 1
        if calls == 3:
            raise KeyboardInterrupt
        return reduced(*arguments)

    with monkeypatch.context() as patch:
        patch.setattr(simulations.Simulator, "reduced", stopped)
        ran = command(*arguments)
    assert ran.status == 130 and "2 finished runs are kept" in ran.err and "Traceback" not in ran.err
    assert [path.name for path in out.iterdir()] == ["finished-runs"]

    simulated = []

    def counted(self: simulations.Simulator, prepared: simulations.Prepared, result: Result) -> ReducedRecord:
        simulated.append(result.meta["case"])
        return reduced(self, prepared, result)

    monkeypatch.setattr(simulations.Simulator, "reduced", counted)
    ran = command(*arguments)
    assert ran.status == 0, ran.err
    assert "reading 2 finished runs" in ran.err and len(simulated) == 2
    names = {"report.html", "report.docx", "statistics.csv", "records.csv", "selection.csv", "issues.csv"}
    assert {path.name for path in ran.files} == {path.name for path in out.iterdir()} == names
    page = (out / "report.html").read_text()
    assert "means, standard deviations and equivalent loads lie inside what seeds and sensors can resolve." in page
    with (out / "statistics.csv").open(newline="") as table:
        rows = list(csv.DictReader(table))
    channels = ("generator_power", "rotor_speed", "root_moment_flap_1", "tower_base_moment_fore_aft")
    assert [(row["channel"], row["statistic"]) for row in rows] == [(c, s) for c in channels for s in STATISTICS]
    (power,) = (row for row in rows if (row["channel"], row["statistic"]) == ("generator_power", "mean"))
    means = [float(np.mean(record["generator_power"].finite)) for record in records]
    assert float(power["measured"]) * {"kW": 1e3, "MW": 1e6}[power["unit"]] == pytest.approx(np.mean(means), rel=5e-3)
    bias = 100.0 * (float(power["simulated"]) / float(power["measured"]) - 1.0)
    assert float(power["bias [%]"]) == pytest.approx(bias, abs=0.3) and abs(bias) < 15.0
    assert (power["records"], power["seeds"]) == ("2", "2")


@pytest.mark.long
def test_statistics_of_a_right_and_a_wrong_model(command: Command, tmp_path: Path) -> None:
    """Nothing is outside for the model that made the table; power and thrust are with air that is 10 % too thin."""
    logger = {"one": {"time": {"column": "t", "form": "posix"}, "channels": statistics_channels()}}
    field = {"points": FIELD["points"], "dt": FIELD["dt"]}
    file = prepare(tmp_path, {"u": np.empty(0)}, loggers=logger, seeds=4, turbulence=field)
    simulator = simulations.Simulator.of(read_record(file, Validation), load_case(), tmp_path)
    winds = [(6.5, 0.14), (7.5, 0.12), (8.5, 0.12), (9.5, 0.1), (10.5, 0.11), (14.0, 0.1)]
    write_statistics(tmp_path / "records" / "scada.csv", simulator, winds)
    thin = tmp_path / "thin.yaml"
    thin.write_text(json.dumps({**json.loads(file.read_text()), "conditions": {"*": {"air_density": 1.1025}}}))
    verdicts: list[dict[tuple[str, str], str]] = []
    for each in (file, thin):
        out = tmp_path / f"out-{each.stem}"
        ran = command("validate", each, "--data", tmp_path / "records", "--out", out, "--why", 0)
        assert ran.status == 0, ran.err
        with (out / "statistics.csv").open(newline="") as table:
            verdicts.append({(r["channel"], r["statistic"]): r["verdict"] for r in csv.DictReader(table)})
        page = (out / "report.html").read_text()
        assert "The wind is known by its statistics only" in page and "Spectra" not in page
        assert (out / "report.docx").is_file()
    right, wrong = verdicts
    assert {statistic for _, statistic in right} == {"mean", "std", "min", "max", "DEL, m = 10"}  # of the table
    assert [v for (_, s), v in right.items() if s in ("mean", "std", "DEL, m = 10")] == ["inside"] * 12
    for name in ("generator_power", "tower_base_moment_fore_aft"):
        assert wrong[name, "mean"].startswith("outside by")


@pytest.mark.slow
def test_a_gauge_is_read_anew_from_the_runs_of_a_study(tmp_path: Path) -> None:
    file, flap = prepare(tmp_path, {"u": np.empty(0)}, loggers=loggers(), turbulence=FIELD), "root_moment_flap_1"
    simulator = simulations.Simulator.of(
        read_record(file, Validation).replace(seeds=1, transient=20.0), load_case(), tmp_path
    )
    record = measured(simulator, 8.0, 1, 30.0, {})
    changed = simulator.at([f"gauge_gain.{flap}", f"gauge_zero.{flap}"], [0.1, 2e5])
    with run_store(tmp_path, "study"):
        before, after = (
            simulations.simulate_records(each, [record], [flap])[0][0].simulated[0].values[flap]
            for each in (simulator, changed)
        )
    mean, std = (STATISTICS.index(name) for name in ("mean", "std"))
    assert after[mean] == pytest.approx(1.1 * before[mean] + 2e5) and after[std] == pytest.approx(1.1 * before[std])
