"""Scans keep what they have: a point that fails is a row that says so, and status 1."""

from __future__ import annotations

import csv
import re
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from terminal import Command

import meltemi
from meltemi import InputError
from meltemi.analyses.power_curve import curve_size, power_curve, whole_speeds
from meltemi.reports.turbine_overview import power_turbine_overview
from meltemi.simulation import rotors

pytestmark = pytest.mark.slow


def test_a_power_curve_has_a_row_for_a_speed_that_fails(command: Command, tmp_path: Path) -> None:
    # beyond 18.7 m/s 25 degrees of pitch do not bring the formula of pmsg20mw down to rated power
    ran = command("power-curve", "pmsg20mw", "--wind-speeds", "8:24:8", "--out", tmp_path)
    assert ran.status == 1
    assert "failed at 24 m/s: no steady operation at a wind speed of 24 m/s: at its largest pitch" in ran.err
    assert "its cut_out is 18 m/s" in ran.err
    rows = list(csv.reader((tmp_path / "power_curve.csv").read_text().splitlines()))
    assert [row[0] for row in rows[1:]] == ["8", "16", "24"]
    assert rows[3][1] == "failed"
    assert len({len(row) for row in rows}) == 1
    assert (tmp_path / "power_curve.png").is_file()


def test_a_power_curve_of_failures_alone_leaves_no_folder(command: Command, tmp_path: Path) -> None:
    ran = command("power-curve", "pmsg20mw", "--wind-speeds", "0.1,24", "--out", tmp_path / "new")
    assert ran.status == 2
    assert "no steady operation at a wind speed of 24 m/s" in ran.err
    assert not (tmp_path / "new").exists()


def test_ctrl_c_leaves_the_points_before_it(command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    original = rotors.operating_point

    def at(model: Any, speed: float) -> meltemi.analysis.OperatingPoint:
        if speed > 9.0:
            raise KeyboardInterrupt
        return original(model, speed)

    monkeypatch.setattr(rotors, "operating_point", at)
    ran = command("power-curve", "pmsg20mw", "--wind-speeds", "8,10", "--out", tmp_path)
    assert ran.status == 130
    _, *rows = csv.reader((tmp_path / "power_curve.csv").read_text().splitlines())
    assert [row[0] for row in rows] == ["8"]


def test_a_campbell_diagram_says_where_it_has_nothing(command: Command, tmp_path: Path) -> None:
    ran = command("campbell", "nrel5mw", "--vacuum", "--wind-speeds", "0.5,9", "--out", tmp_path)
    assert ran.status == 1
    assert "failed at 0.5 m/s: no steady operation" in ran.err
    rows = list(csv.DictReader((tmp_path / "campbell.csv").read_text().splitlines()))
    assert {row["frequency [Hz]"] for row in rows if row["wind [m/s]"] == "0.5"} == {"-"}
    assert all(float(row["frequency [Hz]"]) > 0.0 for row in rows if row["wind [m/s]"] == "9")
    model = meltemi.build(meltemi.load_turbine("nrel5mw"))
    shares: list[float] = []
    diagram = meltemi.analysis.campbell(model, wind_speeds=[9.0, 0.5], air=False, progress=shares.append)
    assert list(diagram.failures) == [0.5]
    assert shares == sorted(shares)
    assert len(shares) > 2
    with pytest.raises(InputError, match="all operating points failed"):
        meltemi.analysis.campbell(model, wind_speeds=[0.5], air=False)


def test_a_power_curve_under_a_controller(command: Command, tmp_path: Path) -> None:
    """The law of a file, with nine tenths of the optimal torque, turns the rotor faster than the turbine's own."""
    file = tmp_path / "mine.py"
    file.write_text(
        "import meltemi\n\n\ndef controller(turbine):\n    torque = turbine.control.torque\n"
        "    law = torque.replace(optimal_gain=0.9 * torque.optimal_gain)\n"
        "    return meltemi.control.BaselineController(turbine.replace(control=turbine.control.replace(torque=law)))\n"
    )
    speeds = []
    for given in ((), ("--controller", "baseline"), ("--controller", str(file))):
        ran = command("power-curve", "pmsg20mw", "--wind-speeds", "8", *given, "--out", tmp_path)
        assert ran.status == 0, ran.err
        with (tmp_path / "power_curve.csv").open(encoding="utf-8") as lines:
            (row,) = csv.DictReader(lines)
        speeds.append(float(next(value for name, value in row.items() if name.startswith("speed"))))
    assert speeds[1] == pytest.approx(speeds[0], rel=2e-3) and speeds[2] > 1.02 * speeds[0]
    assert command("power-curve", "pmsg20mw", "--controller", "ipcc").err.count("did you mean 'ipc'") == 1


def test_one_word_for_the_class_and_a_direction_for_every_wind(command: Command, tmp_path: Path) -> None:
    for option in ("--wind-class", "--class"):
        ran = command(
            *("run", "pmsg20mw", "--iec", "EOG", option, "IIB", "--wind-speed", 9, "--direction", 8, "--begin", 0),
            *("--duration", 1, "--channels", "wind_x,wind_y", "--out", tmp_path),
        )
        assert ran.status == 0
    case = meltemi.io.read_case(tmp_path / "case.yaml")
    assert case.wind.direction == pytest.approx(0.1396, rel=1e-3)  # type: ignore[union-attr]
    path = tmp_path / "mine.yaml"
    path.write_text("turbine: pmsg20mw\nwind: {kind: iec, model: NTM, class: IIB, speed: 9}\nduration: 1\n")
    assert "wind.class: unknown key; did you mean 'wind_class'?" in command("run", path, "--out", tmp_path).err
    path.write_text(
        "turbine: pmsg20mw\nwind: {kind: iec, model: NWP, speed: 9, direction: 8 deg}\nduration: 1\n"
        "channels: [wind_x, wind_y]\n"
    )
    assert command("run", path, "--out", tmp_path).status == 0
    result = meltemi.io.read_netcdf(tmp_path / "result.nc")
    assert -result["wind_y"][0] / result["wind_x"][0] == pytest.approx(0.14054, rel=1e-3)  # tan 8 deg


@pytest.mark.long
def test_flutter_writes_damping_over_rotor_speed(command: Command, tmp_path: Path) -> None:
    ran = command("flutter", "nrel5mw-offsets", "--rotor-speeds", "17,19", "--out", tmp_path)
    assert ran.status == 0, ran
    assert "limit: 18." in ran.out
    assert "Hz in the blades" in ran.out
    rows = list(csv.DictReader((tmp_path / "flutter.csv").read_text().splitlines()))
    assert {row["rotor [rpm]"] for row in rows} == {"17", "19"}
    fast = [row["damping [%]"] for row in rows if row["rotor [rpm]"] == "19"]
    assert min(float(damping) for damping in fast if damping != "-") < -0.1
    assert (tmp_path / "flutter.png").is_file()
    calm = command("flutter", "nrel5mw", "--rotor-speeds", "10", "--pitch", "1", "--wind-speed", "3", "--out", tmp_path)
    assert "no blade mode is unstable up to 10 rpm" in calm.out


def test_parked_writes_a_map(command: Command, tmp_path: Path) -> None:
    arguments = ("--wind-speed", "42.5", "--yaw", "0,30", "--pitch", "90", "--deep-stall", "plate", "--out", tmp_path)
    ran = command("parked", "nrel5mw", *arguments)
    assert ran.status == 0, ran
    rows = list(csv.DictReader((tmp_path / "parked.csv").read_text().splitlines()))
    assert [row["yaw [deg]"] for row in rows] == ["0", "30"]
    assert float(rows[0]["damping [%]"]) > 0.0 > float(rows[1]["damping [%]"])
    assert "side-side" in rows[1]["mode"]
    assert (tmp_path / "parked.png").is_file()


def fake_point(rated: float, peak: float) -> Any:
    """Steady operation with a kink of power at rated wind speed and the largest thrust at another one."""

    def at(model: Any, speed: float) -> Any:
        values = {"rotor_aero_thrust": 1.0 - 0.01 * abs(speed - peak)}
        pitch = max(speed - rated, 0.0)
        point = SimpleNamespace(wind=meltemi.SteadyWind(speed=speed), pitch=pitch, channels=values)
        return type("Point", (SimpleNamespace,), {"__getitem__": lambda self, name: values[name]})(**vars(point))

    return at


@pytest.mark.parametrize(("rated", "peak"), [(11.37, 11.37), (11.37, 9.6), (13.02, 15.3)])
def test_curves_bracket_rated_wind_and_the_peak_of_thrust(
    monkeypatch: pytest.MonkeyPatch, rated: float, peak: float
) -> None:
    monkeypatch.setattr(rotors, "operating_point", fake_point(rated, peak))
    model = meltemi.build(meltemi.load_turbine("nrel5mw"))
    speeds = np.array(sorted(speed for speed, _ in power_curve(model)))
    assert {*whole_speeds(model.turbine)} < {*speeds} and len(speeds) <= curve_size(model.turbine)
    above = speeds[speeds > rated + 1e-3].min()
    assert above - speeds[speeds < rated].max() < 0.05
    assert np.abs(speeds - peak).min() <= 0.0626
    assert [speed for speed, _ in power_curve(model, [9.0, 14.0])] == [9.0, 14.0]


def test_the_command_and_inspect_have_the_same_curve(command: Command, tmp_path: Path) -> None:
    assert command("power-curve", "pmsg20mw", "--out", tmp_path).status in (0, 1)
    _, *rows = csv.reader((tmp_path / "power_curve.csv").read_text().splitlines())
    seen = power_turbine_overview(meltemi.load_turbine("pmsg20mw"))
    assert seen.curve is not None
    assert [float(row[0]) for row in rows if row[1] != "failed"] == [p.wind.speed for p in seen.curve]


def test_all_points_of_a_campbell_diagram_are_printed(command: Command, tmp_path: Path) -> None:
    ran = command("campbell", "nrel5mw", "--rotor-speeds", "0,4,8,12", "--out", tmp_path)
    assert all(f"at {speed} rpm" in ran.out for speed in (0, 4, 8, 12)), ran.out


def test_the_command_lets_the_gust_happen(command: Command, tmp_path: Path) -> None:
    gust = ("run", "pmsg20mw", "--wind-speed", 9, "--iec", "EOG", "--wind-class", "IB")
    ran = command(*gust, "--begin", 3, "--out", tmp_path / "a")
    assert ran.status == 0 and re.search(r"3\.00 .*wind .*begins to change .*IEC EOG", ran.out), ran.err
    case = meltemi.io.read_case(tmp_path / "a" / "case.yaml")
    assert case.duration == 63.0 and case.wind.begin == 3.0  # type: ignore[union-attr]
    whole = command(*gust, "--out", tmp_path / "b")
    assert whole.status == 0 and meltemi.io.read_case(tmp_path / "b" / "case.yaml").duration == 120.0
    for options, said in (
        ((*gust, "--duration", 60), "the wind changes from 60 s to 70.5 s only, outside the run of 60 s"),
        (("run", "pmsg20mw", "--wind-speed", 9, "--begin", 3), "--begin: is that of a gust; add --iec"),
    ):
        ran = command(*options, "--out", tmp_path / "c")
        assert ran.status == 2 and said in ran.err and not (tmp_path / "c").exists()


@pytest.mark.long
def test_the_command_names_the_modes_of_a_floating_turbine_in_wind(command: Command, tmp_path: Path) -> None:
    ran = command("campbell", "iea15mw-volturnus", "--wind-speeds", "10", "--out", tmp_path)
    assert ran.status == 0 and "energy" in ran.out
    with (tmp_path / "campbell.csv").open(encoding="utf-8", newline="") as file:
        rows = {row["mode"]: row for row in csv.DictReader(file)}
    for label, hertz in {
        "base sway": 0.0061,
        "base surge": 0.0104,
        "base yaw": 0.0123,
        "base roll": 0.0344,
        "base pitch": 0.0414,
        "base heave": 0.0485,
        "1st tower side-side": 0.502,
        "1st tower fore-aft": 0.524,
    }.items():
        assert float(rows[label]["frequency [Hz]"]) == pytest.approx(hertz, rel=0.01), label
        largest, share = rows[label]["energy"].split(";")[0].rsplit(" ", 1)
        assert largest == label
        assert float(share) > 0.8
