"""Wind, sea, controller and events of the verification sets as case files (docs/verification/index.md)."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from comparisons import stops, thinned
from comparisons.transient import gust_wind, step_wind
from meltemi.cases.case import LoadCase, case_controller, case_run, case_turbine, case_wind, read_case
from meltemi.core.yamlfile import write_record
from meltemi.sea.given import ComponentSea
from meltemi.simulation.run import Run
from meltemi.simulation.simulate import Simulation, march, simulate
from meltemi.turbine.library import write_turbine
from meltemi.wind.fields import WindSeries
from meltemi.wind_files.formats import write_wind

STEADY: dict[str, Any] = {"kind": "steady", "speed": 12.0}
PLAYED = """from comparisons.stops import playback, reference_run

def controller(turbine):
    return playback(reference_run("ecd_p_11.4"), 81.0)
"""


def stated(folder: Path, **keys: Any) -> LoadCase:
    """A case, written as a file and read."""
    write_record(LoadCase(**{"turbine": "nrel5mw", "wind": STEADY, "duration": 200.0} | keys), folder / "case.yaml")
    return read_case(folder / "case.yaml")


@pytest.mark.parametrize("name", stops.gust_cases())
def test_gusts(name: str, tmp_path: Path) -> None:
    model, *sense, speed = name.split("_")
    wind = {"kind": "iec", "model": model.upper(), "speed": float(speed), "wind_class": stops.CLASS, "begin": 45.0}
    if sense:
        wind["sign"] = {"p": 1, "n": -1}[sense[0]]
    case = stated(tmp_path, wind=wind, duration=80.0)
    assert case_wind(case, stops.deck_model("B").turbine, tmp_path) == stops.gust_cases()[name].wind


@pytest.mark.parametrize("name", stops.STOPS)
def test_stops_are_events(name: str, tmp_path: Path) -> None:
    case = stated(tmp_path, duration=stops.STOPS[name].end, events=stops.STOPS[name].events)
    events = stops.STOPS[name].events
    assert len(case.events) == len(events) > 0
    for read, event in zip(case.events, events, strict=True):
        assert event.items() <= read.model_dump().items()


@pytest.mark.parametrize("wind", [gust_wind(), step_wind()], ids=["gust", "step"])
def test_a_gust_and_a_step_are_wind_files(wind: WindSeries, tmp_path: Path) -> None:
    write_wind(wind, tmp_path / "wind.wnd")
    case = stated(tmp_path, wind={"kind": "file", "file": "wind.wnd"})
    read = case_wind(case, case_turbine(case, tmp_path), tmp_path)
    assert isinstance(read, WindSeries)
    time = np.linspace(0.0, 200.0, 4001)
    speeds = [np.interp(time, w.time, w.speed + w.gust) for w in (wind, read)]
    np.testing.assert_allclose(speeds[1], speeds[0], atol=2e-3)
    np.testing.assert_allclose(read.exponent, wind.exponent, atol=1e-9)


@pytest.mark.parametrize("case", ["M3_Hs6Tp12", "F4_Hs6Tp12"])
def test_seas_are_given_wave_by_wave(case: str, tmp_path: Path) -> None:
    frequency, amplitude, phase, *_ = thinned("offshore_runs" if case[0] == "M" else "floating_runs")[f"{case}_waves"].T
    sea = ComponentSea(frequency=frequency, amplitude=amplitude, phase=phase, stretching="none")
    read = stated(tmp_path, turbine="iea15mw-monopile", sea=sea).sea
    assert isinstance(read, ComponentSea)
    for name in ("frequency", "amplitude", "phase"):
        np.testing.assert_allclose(getattr(read, name), getattr(sea, name), rtol=1e-9)


@pytest.mark.long
def test_a_case_file_repeats_a_gust(tmp_path: Path) -> None:
    """With pitch and torque of OpenFAST's run as a user-defined controller, from the same start: the same loads."""
    arguments = stops.arguments("ecd_p_11.4")
    model = arguments["model"]
    write_turbine(model.turbine, tmp_path / "deck.yaml")
    (tmp_path / "played.py").write_text(PLAYED, encoding="utf-8")
    case = stated(
        tmp_path,
        turbine="deck.yaml",
        wind={"kind": "iec", "model": "ECD", "speed": 11.4, "wind_class": "IB", "begin": 45.0},
        controller="played.py",
        start={"rotor_speed": 11.95 * stops.RPM, "pitch": 0.0, "undeflected": True},
        duration=80.0,
        options=model.options,
        channels=("RotSpeed", "RootMyc1"),
    )
    run = case_run(case, case_turbine(case, tmp_path), tmp_path)
    assert isinstance(run, Run) and case_controller(case, run.model, tmp_path) is not None
    marched = Simulation(run)
    march(marched)
    ours, theirs = marched.result(), simulate(**arguments)
    for name in ("RotSpeed", "RootMyc1"):
        np.testing.assert_allclose(ours[name], theirs[name], rtol=1e-3, atol=1e-3 * np.abs(theirs[name]).max())
