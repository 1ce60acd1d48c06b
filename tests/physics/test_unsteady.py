"""What changes in a run without control is in the run, or it is said that it is not."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import meltemi
from meltemi import InputError, SteadyWind, WindSeries
from meltemi.core.series import TimeSeries
from meltemi.environment import Air, PowerGrid
from meltemi.wind import ecd, ecg, edc, eog, ews_horizontal, ews_vertical

TURBINE = meltemi.load_turbine("pmsg20mw")
MODEL = meltemi.build(TURBINE)
GUSTS: dict[str, Callable[..., WindSeries]] = {
    "EOG": lambda **o: eog(TURBINE, 9.0, "IB", **o),
    "EDC": lambda **o: edc(TURBINE, 9.0, "IB", **o),
    "ECD": lambda **o: ecd(TURBINE, 9.0, **o),
    "ECG": lambda **o: ecg(TURBINE, 9.0, **o),
    "EWSH": lambda **o: ews_horizontal(TURBINE, 9.0, "IB", **o),
    "EWSV": lambda **o: ews_vertical(TURBINE, 9.0, "IB", **o),
}


def run(wind: Any, duration: float, **more: Any) -> meltemi.Result:
    return meltemi.simulate(MODEL, wind, duration=duration, channels=["wind_x", "rotor_speed"], **more)


@pytest.mark.parametrize("name", GUSTS)
def test_a_gust_outside_of_its_run_is_refused(name: str) -> None:
    with pytest.raises(InputError, match=rf"IEC {name}.*: the wind changes from 60 s to \d\d.* the run of 60 s"):
        run(GUSTS[name](), 60.0)
    with pytest.raises(InputError, match="outside the run of 5 s"):
        run(WindSeries(time=[-9.0, -2.0], speed=[9.0, 10.0]), 5.0)
    (outcome,) = meltemi.simulate_batch([meltemi.Run(MODEL, GUSTS[name](), duration=60.0)])
    assert not outcome.ok and "outside the run" in outcome.message


def test_the_log_says_when_the_wind_changed() -> None:
    result = run(GUSTS["EOG"](begin=2.0), 15.0)
    assert [(e.time, e.source, e.what) for e in result.log] == [
        (2.0, "wind", "begins to change"),
        (12.5, "wind", "is constant again"),
    ]
    changed = result.time[np.flatnonzero(np.diff(result["wind_x"]) != 0.0)]
    assert changed[0] == pytest.approx(2.0, abs=0.051) and changed[-1] == pytest.approx(12.5, abs=0.051)
    assert result.warnings == ()
    cut = run(GUSTS["EOG"](begin=2.0), 5.0)
    assert [e.time for e in cut.log] == [2.0]
    assert "the wind changes until 12.5 s, but the run ends at 5 s" in cut.warnings[0]


def test_other_winds_have_no_log() -> None:
    steady = WindSeries(time=[0.0, 50.0], speed=[9.0, 9.0])
    measured = WindSeries(time=np.arange(0.0, 20.0), speed=9.0 + np.sin(np.arange(20.0)))
    for wind in (9.0, SteadyWind(speed=9.0), steady, measured):
        result = run(wind, 3.0)
        assert result.log == () and result.warnings == ()


def test_a_gust_that_is_not_evaluated_causes_a_warning() -> None:
    (said,) = run(GUSTS["EOG"](begin=0.0), 14.0, transient=11.0).warnings
    assert "over at 10.5 s, within the initial transient of 11 s" in said


def test_grid_and_air_that_change_after_the_run_cause_a_warning() -> None:
    late = TimeSeries(time=[0.0, 50.0, 60.0], value=[15.0, 15.0, 30.0])
    warm = meltemi.build(TURBINE, environment=meltemi.Environment(air=Air(temperature=late)))
    (said,) = meltemi.simulate(warm, 9.0, duration=3.0).warnings
    assert said.startswith("environment.air.temperature: changes at 50 s for the first time, after the end of the run")
    weak = PowerGrid(frequency=TimeSeries(time=[5.0, 6.0], value=[50.0, 49.0]))
    assert any("grid.frequency: changes at 5 s" in words for words in run(9.0, 3.0, grid=weak).warnings)


def test_a_gust_outside_of_a_box_is_refused() -> None:
    box = meltemi.WindBox(np.full((40, 3, 3, 3), 9.0, np.float32), 0.5, 60.0, 60.0, 90.0, 9.0)
    with pytest.raises(InputError, match="it begins at 60 s, but the box ends at"):
        meltemi.wind.with_gust(box, GUSTS["EOG"]())
