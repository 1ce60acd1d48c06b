"""ROSCO's own library on our turbines: against OpenFAST with the same library, and by itself.

OpenFAST v5.0.0 with ROSCO 2.10.6, set A with the yaw spring and tower drag, in the box vkm20_s1, 100 to 700 s. Measured
deviations (docs/guide/bladed-controllers.md): mean of rotor speed, pitch and power 0.01 %, their std 0.3 %, equivalent
loads 1 %, but 2.1 % of TwrBsMxt, whose lateral mode is hardly damped.
"""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import least_squares

import meltemi
from meltemi.bladed_controllers.rosco import edit_discon, rosco_example
from meltemi.postprocess.fatigue import damage_equivalent_load
from meltemi.postprocess.files.openfast import si_unit
from meltemi.verification.openfast_deck import deck_options, deck_turbine

pytestmark = pytest.mark.rosco
CONTROL = ("RotSpeed", "BldPitch1", "GenPwr", "GenTq")
DELS = (
    "RootMyc1 RootMyc2 RootMyc3 RootMxc1 RootMyb1 RootMxb1 LSSTipMys LSSTipMzs YawBrMxp YawBrMyp YawBrMzp TwrBsMxt "
    "TwrBsMyt TwrBsMzt"
).split()
MEAN, STD, DEL = 0.1, 1.0, 1.5
"""[%] that rotor speed, pitch, power and torque, and equivalent loads, may deviate."""
LATERAL_DEL = 3.0
"""[%] of TwrBsMxt."""


@pytest.fixture(scope="module")
def discon(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """ROSCO's NREL 5 MW, without its log of every call."""
    try:
        source = rosco_example("Test_Cases/NREL-5MW/DISCON.IN")
    except meltemi.InputError as missing:
        pytest.skip(str(missing))
    return edit_discon(source, tmp_path_factory.mktemp("rosco") / "DISCON.IN", LoggingLevel=0)


@pytest.mark.reference
def test_as_in_openfast(discon: Path, reference: Path) -> None:
    folder = reference / "openfast_rosco"
    turbine = deck_turbine(meltemi.load_turbine("nrel5mw"))
    options = deck_options(turbine, "A", locked=(), tower_drag=True, time_step=0.00625)
    result = meltemi.simulate(
        meltemi.build(turbine, options),
        meltemi.io.read_bts(reference / "openfast/wind/vkm20_s1.bts"),
        duration=700.0,
        controller=meltemi.control.BladedController(turbine, meltemi.control.find_rosco(), folder / "DISCON.IN"),
        channels=[*CONTROL, *DELS],
    )
    assert result.status is meltemi.Status.OK, result.message
    part = result.between(100.0, 700.0)
    with (folder / "statistics.csv").open(newline="", encoding="utf-8") as file:
        rows = {row["channel"]: row for row in csv.DictReader(file) if row["case"] == "bemt_noua"}
    for name in CONTROL:
        _, unit = si_unit(rows[name]["unit"])
        mean, std = (float(rows[name][key]) * unit for key in ("mean", "std"))
        assert 100.0 * abs(part[name].mean() / mean - 1.0) < MEAN, name
        assert 100.0 * abs(part[name].std() / std - 1.0) < STD, name
    for name in DELS:
        load, slope = float(rows[name]["DEL_1Hz"]) * 1e3, float(rows[name]["wohler_m"])
        ours = damage_equivalent_load(part[name], duration=600.0, slope=slope)
        print(f"{name}: {100.0 * (ours / load - 1.0):+.2f} %")
        assert 100.0 * abs(ours / load - 1.0) < (LATERAL_DEL if name == "TwrBsMxt" else DEL), name
    with np.load(folder / "rosco_vkm20_s1_bemt_noua.npz") as z:
        theirs = dict(zip(z["channels"], z["data"].T.astype(float), strict=True))
    inside = (theirs["Time"] >= 100.0 - 1e-6) & (theirs["Time"] <= 700.0 + 1e-6)
    for name in (*CONTROL, "RootMyc1"):
        assert np.corrcoef(theirs[name][inside], part[name])[0, 1] > 0.998, name


@pytest.mark.parametrize("speed", [8.0, 15.0, 18.0])
def test_it_holds_the_steady_state(discon: Path, model: meltemi.Model, speed: float) -> None:
    """ROSCO's set points are those of the report: tip speed ratio 7.5 below rated, 12.1 rpm and 5 MW well above it."""
    controller = meltemi.control.BladedController(model.turbine, meltemi.control.find_rosco(), discon)
    wind = meltemi.SteadyWind(speed=speed)
    result = meltemi.simulate(model, wind, duration=150.0, controller=controller, channels=["RotSpeed", "GenPwr"])
    assert result.status is meltemi.Status.OK, result.message
    end = result.between(120.0, 150.0)
    if speed < 10.0:
        assert end["RotSpeed"].mean() * 63.0 / speed == pytest.approx(7.5, rel=0.03)
    else:
        assert end["RotSpeed"].mean() == pytest.approx(12.1 * np.pi / 30.0, rel=2e-3)
        assert end["GenPwr"].mean() == pytest.approx(5e6, rel=5e-3)


def test_individual_pitch_acts(discon: Path, model: meltemi.Model, tmp_path: Path) -> None:
    """Its 1P mode takes load out, and its banner goes into the log."""
    single = edit_discon(discon, tmp_path / "ipc.IN", IPC_ControlMode=1, IPC_KI=(1e-8, 0.0))
    wind = meltemi.SteadyWind(speed=18.0, shear_exponent=0.3)
    spread = []
    for file in (discon, single):
        folder = tmp_path / file.stem
        folder.mkdir()
        controller = meltemi.control.BladedController(model.turbine, meltemi.control.find_rosco(), file, folder=folder)
        result = meltemi.simulate(model, wind, duration=90.0, controller=controller, channels=["RootMyc1"])
        assert result.status is meltemi.Status.OK, result.message
        spread.append(result.between(60.0, 90.0)["RootMyc1"].std())
        (log,) = folder.glob("*/library.log")
        assert "Running ROSCO-2" in log.read_text()
    assert spread[1] < 0.5 * spread[0]


@pytest.mark.parametrize("level", [1, 2, 3])
def test_its_logs_stand_in_the_folder_of_the_run(
    discon: Path, model: meltemi.Model, tmp_path: Path, level: int
) -> None:
    """Under a root name as OpenFAST gives it; with another form, level 2 opened one file twice and ended the run."""
    settings = edit_discon(discon, tmp_path / "log.IN", LoggingLevel=level)
    controller = meltemi.control.BladedController(
        model.turbine, meltemi.control.find_rosco(), settings, folder=tmp_path
    )
    result = meltemi.simulate(model, meltemi.SteadyWind(speed=12.0), duration=0.5, controller=controller)
    assert result.status is meltemi.Status.OK, result.message
    logs = ["run.RO.dbg", "run.RO.dbg2", "run.RO.dbg3"][:level]
    assert sorted(file.name for file in tmp_path.glob("controller-*/*")) == ["library.log", *logs]
    assert all(file.stat().st_size > 1000 for file in tmp_path.glob("controller-*/*.dbg*"))


def test_settings_are_asked_for(turbine: meltemi.Turbine) -> None:
    with pytest.raises(meltemi.InputError, match="--controller-input DISCON.IN"):
        meltemi.control.BladedController(turbine, meltemi.control.find_rosco())


def test_what_rosco_refuses_is_said(discon: Path, model: meltemi.Model, tmp_path: Path) -> None:
    """Its own message, not that of a crash."""
    wrong = edit_discon(discon, tmp_path / "wrong.IN", IPC_ControlMode=7)
    controller = meltemi.control.BladedController(model.turbine, meltemi.control.find_rosco(), wrong)
    result = meltemi.simulate(model, meltemi.SteadyWind(speed=12.0), duration=1.0, controller=controller, partial=True)
    assert result.status is meltemi.Status.CONTROLLER_RAISED
    assert "IPC_ControlMode must be" in result.message


@pytest.mark.parametrize("source", ["library", "deck"])
@pytest.mark.parametrize("speed", [12.0, 18.0])
def test_the_iea15mw(speed: float, source: str, tmp_path: Path) -> None:
    """Settings of the rosco package: 15 MW and 7.56 rpm, at the pitch of the baseline law's steady state."""
    folder = "Test_Cases/IEA-15-240-RWT/IEA-15-240-RWT-Monopile/IEA-15-240-RWT-Monopile"
    if source == "library":
        pytest.importorskip("windIO")
    try:
        deck, settings = rosco_example(f"{folder}.fst"), rosco_example(f"{folder}_DISCON.IN")
    except meltemi.InputError as missing:
        pytest.skip(str(missing))
    turbine = meltemi.io.read_openfast(deck) if source == "deck" else meltemi.load_turbine("iea15mw")
    discon = edit_discon(settings, tmp_path / "DISCON.IN", LoggingLevel=0)
    model = meltemi.build(turbine)
    controller = meltemi.control.BladedController(turbine, meltemi.control.find_rosco(), discon)
    wind = meltemi.SteadyWind(speed=speed)
    channels = ["RotSpeed", "GenPwr", "pitch_1"]
    result = meltemi.simulate(model, wind, duration=120.0, controller=controller, channels=channels)
    assert result.status is meltemi.Status.OK, result.message
    end = result.between(100.0, 120.0)
    assert end["RotSpeed"].mean() == pytest.approx(7.56 * np.pi / 30.0, rel=1e-3)
    assert end["GenPwr"].mean() == pytest.approx(15e6, rel=1e-3)
    assert end["pitch_1"].mean() == pytest.approx(meltemi.operating_point(model, speed).pitch, abs=2e-3)


def oscillation(time: NDArray[np.float64], x: NDArray[np.float64]) -> tuple[float, float]:
    """Frequency [rad/s] and damping ratio of the slow oscillation of a series, beside a straight line."""

    def deviation(p: NDArray[np.float64]) -> NDArray[np.float64]:
        wave = (p[2] * np.cos(p[4] * t) + p[3] * np.sin(p[4] * t)) * np.exp(-p[5] * t)
        return p[0] + p[1] * t + wave - x

    t = time - time[0]
    w, decay = least_squares(deviation, [x.mean(), 0.0, x.std(), x.std(), 1.1, 0.05]).x[4:]
    return float(w), float(decay / np.hypot(w, decay))


@pytest.mark.reference
def test_its_oscillation_above_rated_is_that_in_openfast(discon: Path, reference: Path) -> None:
    """At 14 m/s, 1.12 rad/s with a damping ratio of 7.3 %; torsion of the blades, which ElastoDyn lacks, lowers it."""
    with np.load(reference / "openfast_dlc/series/S_stuck1_estop_14.npz") as z:
        theirs = dict(zip(z["channels"], z["data"].T.astype(float), strict=True))
    inside = (theirs["Time"] >= 12.0) & (theirs["Time"] <= 44.9)  # before its event
    w, damping = oscillation(theirs["Time"][inside], theirs["BldPitch1"][inside])
    library = meltemi.load_turbine("nrel5mw")
    deck = deck_turbine(library)
    found = []
    for turbine, options in ((deck, deck_options(deck, "B", time_step=0.01)), (library, meltemi.ModelOptions())):
        result = meltemi.simulate(
            meltemi.build(turbine, options),
            meltemi.SteadyWind(speed=14.0, shear_exponent=0.2),
            duration=44.9,
            controller=meltemi.control.BladedController(turbine, meltemi.control.find_rosco(), discon),
            channels=["BldPitch1"],
            start=meltemi.Start(rotor_speed=12.1 * np.pi / 30.0, pitch=np.radians(6.0)),
        )
        part = result.between(12.0, 44.9)
        found.append(oscillation(part.time, np.degrees(part["BldPitch1"])))
    assert found[0][0] == pytest.approx(w, rel=0.02)
    assert found[0][1] == pytest.approx(damping, abs=0.01)
    assert 0.005 < found[1][1] < 0.03 < 0.5 * damping


@pytest.mark.parametrize("speed", [14.0, 16.0])
def test_its_gains_are_those_of_a_rigid_rotor_with_a_steady_wake(discon: Path, speed: float) -> None:
    """Its example is tuned for 0.6 rad/s: integral gain w^2 / B. Flexible rotors with dynamic inflow answer more."""
    lines = {line.rpartition("!")[2].split()[0]: line for line in discon.read_text().splitlines() if "!" in line}
    angles, gains = (np.array(lines[name].partition("!")[0].split(), float) for name in ("PC_GS_angles", "PC_GS_KI"))
    turbine, answers = meltemi.load_turbine("nrel5mw"), []
    rigid = dict.fromkeys(("torsion_modes", "flap_modes", "edge_modes", "fore_aft_modes", "side_side_modes"), 0)
    for options in (meltemi.ModelOptions(inflow="quasi_steady", stall="static", **rigid), meltemi.ModelOptions()):
        model = meltemi.build(turbine, options)
        point = meltemi.operating_point(model, speed)
        linear = meltemi.analysis.linearise(model, point, ("pitch",), ("generator_speed",), azimuths=12)
        s = 1j * np.array([1.15])
        answers.append(abs(s[0] * linear.response(s)[0, 0, 0]))
        if len(answers) == 1:
            expected = 0.6**2 / -np.interp(point.pitch, angles, gains)
    assert answers[0] == pytest.approx(expected, rel=0.1)
    assert answers[1] > 1.4 * answers[0]
