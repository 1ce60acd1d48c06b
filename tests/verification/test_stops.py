"""Gusts, stops and faults against OpenFAST: that the comparison notices errors, and what explains its deviations.

``test_verify.py`` runs the comparison itself.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import meltemi
from comparisons import reference_table, stops
from comparisons.known import KNOWN
from meltemi.bladed_controllers.rosco import edit_discon
from meltemi.maths.vectors import Vec
from meltemi.verification.table import Check, CheckVerdict
from meltemi.wind.fields import WindSeries, wind_field
from meltemi.wind.velocity import series_now, wind_velocity
from meltemi.wind_files import read_wnd

HUB, LEFT, TOP = (0.0, 0.0, 90.0), (0.0, 63.0, 90.0), (0.0, 0.0, 153.0)
CASES = stops.gust_cases() | stops.STOPS


def failed(rows: list[Check], table: str) -> list[Check]:
    return [row for row in (r.judged(table, KNOWN) for r in rows) if row.verdict is CheckVerdict.FAIL]


@pytest.mark.parametrize(
    ("name", "time", "place", "velocity"),
    [
        # eq. 17 at T / 2: + 0.37 * 2 Vg; Vg = 3.3 sigma_1 / 1.3, sigma_1 = 0.14 (0.75 V + 5.6)
        ("eog_11.4", 5.25, HUB, (11.4 + 0.74 * 5.02869, 0.0)),
        ("eog_25", 5.25, HUB, (25.0 + 0.74 * 8.65362, 0.0)),
        # 15 m/s and 720 / V deg; a positive change turns the wind to -y
        ("ecd_p_11.4", 10.0, HUB, (26.4 * math.cos(math.radians(63.1579)), -26.4 * math.sin(math.radians(63.1579)))),
        ("ecd_n_11.4", 10.0, HUB, (26.4 * math.cos(math.radians(63.1579)), 26.4 * math.sin(math.radians(63.1579)))),
        ("edc_p_12", 3.0, HUB, (12.0 * math.cos(math.radians(14.9294)), -12.0 * math.sin(math.radians(14.9294)))),
        ("edc_n_12", 6.0, HUB, (12.0 * math.cos(math.radians(29.8588)), 12.0 * math.sin(math.radians(29.8588)))),
        # half of 2 A over the diameter, A = 2.5 + 1.28 sigma_1 3^0.25
        ("ewsh_p_12", 6.0, LEFT, (12.0 + 5.94327, 0.0)),
        ("ewsh_n_12", 6.0, LEFT, (12.0 - 5.94327, 0.0)),
        ("ewsv_p_12", 6.0, TOP, (12.0 * (153.0 / 90.0) ** 0.2 + 5.94327, 0.0)),
        ("ewsv_n_12", 6.0, TOP, (12.0 * (153.0 / 90.0) ** 0.2 - 5.94327, 0.0)),
    ],
)
def test_winds_in_closed_form(
    name: str, time: float, place: tuple[float, float, float], velocity: tuple[float, float]
) -> None:
    wind = CASES[name].wind
    assert isinstance(wind, WindSeries)
    field = wind_field(wind, 90.0, 126.0)
    series_now(stops.BEGIN + time, field)
    u = wind_velocity(Vec(*place), stops.BEGIN + time, field)
    assert (u.x, u.y, u.z) == pytest.approx((*velocity, 0.0), abs=2e-5)


@pytest.mark.slow
def test_an_extreme_of_another_size_or_time_fails() -> None:
    """The opposite sense of a direction change; a stop 0.5 s late; a blade that pitches although it is stuck."""
    assert failed(stops.compare("edc_n_12", stops.run_case("edc_p_12"), stops.BEGIN), "gusts")
    late = [*stops.feather(stops.BEGIN + 0.5), *stops.off(stops.BEGIN)]
    assert failed(stops.compare("estop_25", stops.run_case("estop_25", events=late), stops.BEGIN), "stops")
    free = stops.run_case("stuck1_estop_14", events=CASES["estop_25"].events)
    assert failed(stops.compare("stuck1_estop_14", free, stops.BEGIN), "stops")


def test_the_law_without_rosco() -> None:
    """Its three regions, and the crossing of parabola and line."""
    state, demands = np.zeros(1), stops.Demands(stops.Demands.zeros())
    measured = stops.Measurements(stops.Measurements.zeros())
    torques = []
    for rpm in (1000.0, 1170.0, 1200.0):
        measured.generator_speed = rpm * stops.RPM
        stops.simple_law(state, measured, demands, 0.01)
        torques.append(demands.generator_torque)
    slope = 43093.55 / (1173.7 - 1173.7 / 1.1)
    assert torques == pytest.approx([0.0255764e6, slope * (1170.0 - 1067.0), 43093.55], rel=1e-9)


@pytest.mark.reference
def test_data_are_those_of_the_runs(reference: Path) -> None:
    """Winds of the files; extremes; what is played back, to the step of rounding."""
    folder = reference / "openfast_dlc"
    for name, case in CASES.items():
        with np.load(folder / f"series/{'S' if case.events else 'G'}_{name}.npz") as z:
            data = dict(zip(map(str, z["channels"]), z["data"].T.astype(float), strict=True))
        (row,) = reference_table("stops", case=name, channel="RootMyc1")
        late = 1e3 * data["RootMyc1"][data["Time"] > case.event - 0.01]
        assert [float(row["minimum"]), float(row["maximum"])] == pytest.approx([late.min(), late.max()], rel=1e-5)
        if not name.endswith("noROSCO"):
            table = stops.reference_run(name)
            before = data["Time"][: len(table)] < case.event - 0.01
            scale = np.array([np.pi / 180.0, 1e3, stops.RPM])
            theirs = np.stack([data[c][: len(table)] for c in ("BldPitch3", "GenTq", "GenSpeed")], axis=1) * scale
            np.testing.assert_allclose(table[before], theirs[before], atol=3.0)
            np.testing.assert_allclose(table[before][:, [0, 2]], theirs[before][:, [0, 2]], atol=3e-4)
        if isinstance(case.wind, WindSeries):
            file = read_wnd(folder / f"wind/{name}.wnd")
            for column in ("direction", "horizontal_shear", "exponent", "vertical_shear"):
                ours = np.interp(file.time, case.wind.time, getattr(case.wind, column))
                np.testing.assert_allclose(ours, getattr(file, column), atol=2e-5, err_msg=f"{name} {column}")
            total = np.interp(file.time, case.wind.time, case.wind.speed + case.wind.gust)
            np.testing.assert_allclose(total, file.speed + file.gust, atol=2e-5, err_msg=name)


@pytest.mark.long
def test_pitching_moment_of_rotary_inertia() -> None:
    """Omega^2 integral (J_edge - J_flap) sin theta cos theta dr; without it all pitching moments are OpenFAST's."""
    structure = stops.deck_model("B").turbine.blade.structure
    assert structure.flap_inertia is not None and structure.edge_inertia is not None
    full, slender = stops.run_case("estop_25"), stops.run_case("estop_25", model=stops.slender_model())
    before = (full.time > 35.0) & (full.time < stops.BEGIN)
    speed, pitch = (full[name][before].mean() for name in ("RotSpeed", "BldPitch1"))
    angle = pitch + structure.twist
    moment = (structure.edge_inertia - structure.flap_inertia) * np.sin(angle) * np.cos(angle)
    expected = speed**2 * np.trapezoid(moment, structure.position)
    assert (full["RootMzc1"] - slender["RootMzc1"])[before].mean() == pytest.approx(expected, rel=0.01)
    for name in ("estop_25", "estop_15_noROSCO", "stuck1_estop_14", "eog_11.4", "ewsh_n_12"):
        rows = stops.compare(name, stops.run_case(name, model=stops.slender_model()), stops.BEGIN)
        assert [r for r in rows if r.what == "RootMzc1" and abs(r.deviation) > r.band] == [], name


@pytest.mark.slow
@pytest.mark.reference
def test_stop_in_turbulence(reference: Path) -> None:
    """With ElastoDyn's frequencies of slender blades 6 and 12 % of a channel's range become less than 2 %."""
    assert failed(list(stops.stops(reference).rows), "stops in turbulence") == []
    arguments, model = stops.arguments(stops.BOX, reference), stops.slender_model()
    modal = np.array(model.rotor.modal)
    # first flapwise and edgewise frequency of the isolated blade: ElastoDyn's over ours
    factor = np.array([0.66860 / 0.67738, 1.0, 1.07864 / 1.08785])
    modal[0] *= factor[:, None] * factor
    result = meltemi.simulate(**(arguments | {"model": model.with_arrays(modal=modal)}))
    rows = stops.compare(stops.BOX, result, CASES[stops.BOX].event)
    assert [r for r in rows if abs(r.deviation) > (stops.LATE if r.measure == "s" else 2.0)] == []


@pytest.mark.rosco
@pytest.mark.reference
@pytest.mark.parametrize("name", ["eog_25", "estop_25", "gridloss_25", "stuck1_estop_14"])
def test_under_rosco_itself(name: str, reference: Path, tmp_path: Path) -> None:
    """The same library in place of its played-back pitch and torque."""
    settings = edit_discon(reference / "openfast_rosco/DISCON.IN", tmp_path / "DISCON.IN", LoggingLevel=0)
    turbine = stops.deck_model("B").turbine
    controller = meltemi.control.BladedController(turbine, meltemi.control.find_rosco(), settings)
    rows = stops.compare(name, stops.run_case(name, controller=controller), stops.BEGIN)
    bound = 5.5 if name == "eog_25" else 2.5
    assert [r for r in rows if r.measure == "%" and r.what != "RootMzc1" and abs(r.deviation) > bound] == []
