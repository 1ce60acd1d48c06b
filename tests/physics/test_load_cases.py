"""Each row of the load case tables, simulated: does the event occur, the stop stop, the start reach its power."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from meltemi import ModelOptions, Result, Status
from meltemi.cases.case import case_run, case_turbine
from meltemi.loads.loadbase.campaign import make_campaign
from meltemi.loads.loadbase.coverage import problems_of, read_results
from meltemi.loads.loadbase.engine import base_table, run_base
from meltemi.loads.loadbase.jobs import unplanned_stop
from meltemi.loads.loadbase.plan import Plan, PlannedCase, plan
from meltemi.simulation.simulate import Simulation, march

CHANNELS = (
    *("wind_x", "rotor_speed", "azimuth", "pitch_1", "pitch_2", "pitch_3", "generator_power", "generator_torque"),
    *("nacelle_yaw", "yaw_error", "operating_state", "tower_base_moment_fore_aft", "tower_base_moment_side_side"),
)
RATED = {"nrel5mw": 5.0e6, "iea15mw": 15.0e6}
QUICK = """
dlc1.1-15-s01 30, dlc1.4-13.4-p-a90 45, dlc2.1-13-grid_loss-s01 45, dlc2.2-25-overspeed-s01 45,
dlc2.2-13-yaw_runaway-s01 30, dlc2.5-13-voltage_dip_15 25, dlc3.1-11.4 110, dlc4.1-25 50, dlc5.1-25-s01 45,
dlc6.2-50-y90-s01 15, dlc6.2-50-y270-s01 15, dlc7.1-40-y30-a60-s01 15, dlc7.1b-40-y0-blade_stuck_idling-s01 40
"""
LONG = """
dlc1.2-5-y8-s01 60, dlc1.3-25-y-8-s01 60, dlc1.5-ewsv-13-p-a0 60, dlc1.5-ewsh-13-n-a60 60,
dlc2.1-13-speed_sensor-s01 60, dlc2.1-13-pitch_sensor-s01 60, dlc2.2-13-pitch_runaway-s01 60,
dlc2.2-13-blade_stuck-s01 60, dlc2.2-13-generator_overload-s01 60, dlc2.2-13-brake_failure-s01 60,
dlc2.3-25-a0-t4-grid_loss 60, dlc2.4-13-y20-s01 60, dlc2.5-25-voltage_dip_50 60, dlc3.1-25 200,
dlc3.2-25-t35 200, dlc3.3-25-n-t20 200, dlc4.2-25-t4 80, dlc6.1-50-y-8-s01 60, dlc6.3-40-y20-s01 60,
dlc6.4-19-y8-s01 60, dlc8.1-18-y8-a90-s01 60, dlc8.2-56-y0 60
"""


def chosen(text: str) -> list[tuple[str, float]]:
    return [(part.split()[0], float(part.split()[1])) for part in text.strip().split(",")]


@cache
def planned(turbine: str, edition: int = 4) -> Plan:
    """With short transients, so that events come early."""
    rated = {"nrel5mw": 11.4, "iea15mw": 10.7}[turbine]
    return plan(make_campaign(turbine, "IB", edition, rated_wind=rated, transient=10.0, begin=5.0))


def simulated(case: PlannedCase, seconds: float) -> Result:
    cut = case.case().replace(channels=CHANNELS, duration=seconds)
    simulation = Simulation(case_run(cut, case_turbine(cut, Path()), Path()))
    march(simulation)
    return simulation.result()


def check(case: PlannedCase, r: Result, rated: float) -> None:
    row, fault, event = case.setting.row, case.variant.fault, case.setting.event
    assert r.status is Status.OK
    before = (r.time > 2.0) & (r.time < event - 0.5)
    said = [(entry.time, entry.source, entry.what) for entry in r.log]
    stops = [time for time, source, what in said if source == "supervisor" and what.endswith("stop")]
    power, speed = r["generator_power"], r["rotor_speed"]
    if row.situation in ("idling", "locked"):
        assert np.all(np.abs(speed) < 0.3) and np.all(power == 0.0)
        free = [2, 3] if fault else [1, 2, 3]
        assert all(np.all(r[f"pitch_{b}"] == case.setting.campaign.idle_pitch) for b in free)
        if fault:
            assert r["pitch_1"][-1] == pytest.approx(0.0, abs=0.01)
        if row.situation == "locked":
            assert np.ptp(np.unwrap(r["azimuth"])) < 0.03
            assert r["azimuth"][0] == pytest.approx(np.radians(case.variant.azimuth or 0.0), abs=0.03)
        if case.variant.yaw in (90.0, 270.0):  # the wind from 90 deg clockwise, seen from above, blows towards -y
            sideways, along = (np.mean(r[f"tower_base_moment_{name}"]) for name in ("side_side", "fore_aft"))
            assert np.sign(sideways) == (1.0 if case.variant.yaw == 90.0 else -1.0)
            assert abs(sideways) > 3.0 * abs(along)
        return
    if row.situation == "start":
        assert np.all(power[r.time < 10.0] == 0.0)
        assert power[-1] > (0.9 * rated if case.variant.speed > 11.0 else 0.0)
        assert ("supervisor", "standby -> start up") in [(source, what) for _, source, what in said]
        return
    assert np.mean(power[before]) > (0.5 * rated if case.variant.speed > 10.0 else 0.0)
    assert np.ptp(r["pitch_1"] - r["pitch_2"]) < 1e-6 or fault is not None  # unequal by the imbalance alone
    assert (r["pitch_1"] - r["pitch_2"])[0] == pytest.approx(2.0 * np.radians(0.3), abs=1e-6)
    if case.variant.model == "NTM" and case.variant.yaw:
        assert np.degrees(np.mean(r["yaw_error"])) == pytest.approx(case.variant.yaw, abs=6.0)
    if case.variant.model in ("EOG", "ECD"):
        assert np.ptp(r["wind_x"][before & (r.time < case.setting.begin)]) < 1e-6 < np.ptp(r["wind_x"])
    if fault is not None:
        assert min(time for time, source, _ in said if source == "event") == pytest.approx(event, abs=0.02)
    if "voltage_dip" in (fault or ""):
        assert not stops and power[-1] == pytest.approx(np.mean(power[before]), rel=0.01)
        assert power.min() < 0.6 * rated
    elif fault == "yaw_runaway":
        assert np.degrees(r["nacelle_yaw"][-1]) == pytest.approx(0.3 * (r.time[-1] - event), abs=0.2)
    elif fault is not None or "stop" in row.situation:
        assert stops and event - 1e-6 <= stops[0] < event + 6.0
        assert abs(speed[-1]) < 0.4 * speed[0] and abs(power[-1]) < 1e3
        if row.situation == "normal stop":
            assert np.max(speed[r.time > event + 2.0]) < 1.2 * speed[0]
    else:
        assert np.mean(power[r.time > event]) > 0.0 and not stops


@pytest.mark.slow
@pytest.mark.parametrize(("name", "seconds"), chosen(QUICK))
def test_a_case_does_what_its_row_says(name: str, seconds: float) -> None:
    case = planned("nrel5mw").case(name)
    check(case, simulated(case, seconds), RATED["nrel5mw"])


@pytest.mark.long
@pytest.mark.parametrize(("name", "seconds"), chosen(LONG))
def test_the_other_rows(name: str, seconds: float) -> None:
    case = planned("nrel5mw").case(name)
    check(case, simulated(case, seconds), RATED["nrel5mw"])


@pytest.mark.slow
def test_a_deck_stops_under_its_options(openfast_deck: Path) -> None:
    (deck,) = openfast_deck.glob("*.fst")
    made = make_campaign(deck, "IB", rated_wind=11.4, transient=10.0, begin=5.0, quick=True)
    case = plan(made).case("dlc4.1-25")
    assert case.case().options == ModelOptions(**made.options) != ModelOptions()
    check(case, simulated(case, 50.0), RATED["nrel5mw"])


@pytest.mark.slow
@pytest.mark.parametrize(
    "name",
    [*(pytest.param(n, marks=pytest.mark.long) for n in ("dlc4.1-11.4", "dlc5.1-25-s01")), "dlc2.1-25-grid_loss-s01"],
)
def test_other_controllers_stop_too(name: str) -> None:
    made = make_campaign(
        "nrel5mw", rated_wind=11.4, transient=10.0, begin=5.0, quick=True, controller={"kind": "power"}
    )
    case = plan(made).case(name)
    r = simulated(case, 60.0)
    assert r.status is Status.OK
    assert abs(r["rotor_speed"][-1]) < 0.2 and abs(r["generator_power"][-1]) < 1e3
    assert r["pitch_2"][-1] > 1.5 and r["generator_power"][r.time < case.setting.event].min() > 3e6


def test_a_stop_that_was_not_planned_is_a_warning(tmp_path: Path) -> None:
    limits = {"kind": "supervised", "supervision": {"over_speed": 1.02, "trip_speed": 1.1}}
    made = make_campaign(
        "nrel5mw", rated_wind=11.4, transient=10.0, begin=5.0, duration=20.0, quick=True, controller=limits
    )
    production, fault = (plan(made).case(name) for name in ("dlc1.1-25-s01", "dlc2.1-25-grid_loss-s01"))
    both = replace(plan(made), cases=(production, fault))
    run_base(both, tmp_path)
    (words,), (late,) = base_table(both, tmp_path)["warnings"]
    assert words.startswith("stopped at ") and "generator speed" in words and "in state 'normal stop'" in late
    problem = problems_of(read_results(both, tmp_path)).loc[production.name]
    assert problem["state"] == "warned" and "not those of power production" in problem["meaning"]


@pytest.mark.parametrize("stops", [False, True])
def test_production_goes_on_in_any_wind_unless_it_may_stop(stops: bool) -> None:
    limits = {"kind": "supervised", "supervision": {"cut_out_wind": 15.0, "cut_out_mean": 15.0, "restart_wind": 10.0}}
    made = make_campaign(
        "nrel5mw", rated_wind=11.4, transient=10.0, begin=5.0, quick=True, controller=limits, wind_stops=stops
    )
    r = simulated(plan(made).case("dlc1.1-25-s01"), 40.0)
    assert ("wind" in unplanned_stop(r.log)) == (r["generator_power"][-1] < 1e6) == stops


def test_every_row_is_among_them() -> None:
    rows = {planned("nrel5mw").case(name).row for name, _ in chosen(QUICK) + chosen(LONG)}
    assert rows == planned("nrel5mw").table.rows.keys()
    assert planned("nrel5mw", 3).table.rows.keys() <= rows
    faults = {planned("nrel5mw").case(name).variant.fault for name, _ in chosen(QUICK) + chosen(LONG)} - {None}
    assert faults == {c.variant.fault for c in planned("nrel5mw").cases} - {None}
